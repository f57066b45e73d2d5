"""The gyroid sheet `abs(F) - 0.5`, composed from Fields: against what a scientist writes and what a hand can fuse.

10^3 cells in a 50 mm cube, 0.25 mm voxels, script to indexed triangle mesh; the Fields are built anew in every run. Then
the same sheet with a wall of true thickness, its wall measured on the mesh, and what its distance table costs once.

    python benchmarks/gyroid_level_set.py [--cells 10] [--runs 5]
"""

from __future__ import annotations

import time

import _designs as designs
import numpy as np
from _baselines import flying_edges, grid, gyroid_samples, skimage_cubes, triangles
from _designs import CELL, GRADED_LEVEL, LEVEL, VOXEL, WALL
from _timing import alternate, options, print_ratio, print_times, setting


def numpy_skimage(cells: int, level: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Broadcast arrays and scikit-image's marching cubes."""
    x, y, z = (c * np.float32(2 * np.pi / CELL) for c in grid(cells, CELL, VOXEL))
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    levels = np.interp(grid(cells, CELL, VOXEL)[2], (0.0, cells * CELL), level).astype(np.float32)
    return skimage_cubes(np.abs(field) - levels, VOXEL)


def hand_fused(cells: int, level: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """One numba kernel for this shape, and VTK's flying edges."""
    return flying_edges(gyroid_samples(cells, CELL, VOXEL, level), VOXEL)


def measured_walls(n_points: int = 3000) -> np.ndarray:
    """Walls of a mesh of the true sheet, found from points on the mid-surface along its normal both ways, mm.

    The mid-surface and its normals are written out here; frep made nothing but the mesh.
    """
    import vtk

    cells = 3
    mesh = designs.a_true(cells).mesh(voxel=VOXEL).to_pyvista()
    k = 2 * np.pi / CELL
    p = np.random.default_rng(0).uniform(CELL, 2 * CELL, (n_points, 3))

    def level_and_normal(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        (sx, sy, sz), (cx, cy, cz) = np.sin(k * p).T, np.cos(k * p).T
        slope = np.stack([cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz], axis=1) * k
        return sx * cy + sy * cz + sz * cx, slope

    for _ in range(30):
        value, slope = level_and_normal(p)
        step = (value / np.maximum((slope**2).sum(axis=1), 1e-3))[:, None] * slope
        p -= np.clip(step, -0.2, 0.2)
    value, slope = level_and_normal(p)
    p, slope = p[np.abs(value) < 1e-9], slope[np.abs(value) < 1e-9]
    normal = slope / np.linalg.norm(slope, axis=1)[:, None]

    locator = vtk.vtkStaticCellLocator()
    locator.SetDataSet(mesh)
    locator.BuildLocator()
    t, hit, where, sub = vtk.mutable(0.0), [0.0] * 3, [0.0] * 3, vtk.mutable(0)
    walls = np.zeros(len(p))
    for sign in (-1.0, 1.0):
        ends = p + sign * 1.5 * WALL * normal
        for i in range(len(p)):
            found = locator.IntersectWithLine(p[i], ends[i], 0.0, t, hit, where, sub)
            walls[i] += float(t) * 1.5 * WALL if found else np.inf
    return walls


def main() -> None:
    given = options(__doc__, cells=(10, "unit cells along each edge of the cube"))
    n = given.cells
    print(setting(given.runs, f"gyroid sheet, {n}^3 cells, {VOXEL} mm"))
    times = alternate(
        {
            "frep, level set": lambda: designs.a(n).mesh(voxel=VOXEL),
            "frep, true wall": lambda: designs.a_true(n).mesh(voxel=VOXEL),
            "frep, level linear in z": lambda: designs.a_graded(n).mesh(voxel=VOXEL),
            "hand-fused numba + VTK SMP": lambda: hand_fused(n, (LEVEL, LEVEL)),
            "hand-fused, level linear in z": lambda: hand_fused(n, GRADED_LEVEL),
            "numpy + scikit-image": lambda: numpy_skimage(n, (LEVEL, LEVEL)),
        },
        given.runs,
        triangles,
    )
    print_times(times)
    ours = times["frep, level set"].median
    print_ratio("numpy + scikit-image / frep", times["numpy + scikit-image"].median / ours, ">= 10")
    print_ratio("frep / hand-fused", ours / times["hand-fused numba + VTK SMP"].median, "<= 1.0")
    graded = times["frep, level linear in z"].median
    print_ratio("frep / hand-fused, linear in z", graded / times["hand-fused, level linear in z"].median, "<= 1.0")
    print_ratio("frep true wall / frep level set", times["frep, true wall"].median / ours, "<= 3")

    walls = measured_walls()
    low, middle, high = np.percentile(walls, (2.5, 50, 97.5))
    print(
        f"true wall of {WALL} mm, measured on the mesh at {len(walls)} points: median {middle:.4f}, "
        f"95 % within {low:.4f} to {high:.4f} mm; reach {WALL} +- {VOXEL / 4:.4f}"
    )

    from frep.redistance import periodic_distance

    first = []
    for _ in range(given.runs):
        periodic_distance.cache_clear()
        start = time.perf_counter()
        designs.a_true(n)
        first.append(time.perf_counter() - start)
    print(
        f"its distance table, once a process for a surface and cell (not in the times above): {np.median(first):.3f} s"
    )


if __name__ == "__main__":
    main()
