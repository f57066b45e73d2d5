"""BCC, hard, blended and graded, against a kernel made by hand for it; and its volume, by field and by mesh.

10^3 cells in a 50 mm cube, struts of 0.4 mm radius, 0.25 mm voxels (3.2 samples a diameter), script to indexed triangle
mesh. The blend is the n-ary round union of radius 0.4 mm on both sides; graded radii are linear along z, 0.3 to 0.5 mm.

    python benchmarks/bcc.py [--cells 10] [--runs 5]
"""

from __future__ import annotations

import time

import _designs as designs
import numba
import numpy as np
from _baselines import bcc_samples, flying_edges, triangles
from _designs import BLEND, CELL, GRADED_RADIUS, RADIUS, VOXEL
from _timing import alternate, options, print_ratio, print_times, setting, table


def hand_fused(cells: int, radius: tuple[float, float], blend: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Each strut in its own box of a dense grid, and VTK's flying edges."""
    return flying_edges(bcc_samples(cells, CELL, VOXEL, radius, blend), VOXEL)


@numba.njit(parallel=True, fastmath=True, cache=True)
def _inside_octant(n, half, radius):
    # Of n^3 points of the octant between a corner of the cell and its centre: those within a strut's radius.
    count = 0
    for i in numba.prange(n):
        inside = 0
        x = half * (i + 0.5) / n
        for j in range(n):
            y = half * (j + 0.5) / n
            for k in range(n):
                z = half * (k + 0.5) / n
                nearest = 1e30
                for node in range(2):
                    px, py, pz = (x, y, z) if node == 0 else (half - x, half - y, half - z)
                    square = px * px + py * py + pz * pz
                    for sign in range(4):
                        # A line through the node; within the octant the nearest point lies between its ends.
                        t = px + (py if sign & 1 else -py) + (pz if sign & 2 else -pz)
                        nearest = min(nearest, square - t * t / 3.0)
                if nearest < radius * radius:
                    inside += 1
        count += inside
    return count


def counted_volume(cells: int, n: int = 768) -> float:
    """Volume of the part by counting points of one octant of one cell, mm3: no field of frep, no mesh, no distance."""
    return cells**3 * CELL**3 * _inside_octant(n, 0.5 * CELL, RADIUS) / n**3


def cap_error(mesh, cells: int) -> tuple[float, int]:
    """How far, at most, the caps' vertices lie off the faces of the cube, mm, and how many triangles the caps have."""
    v, f = mesh.vertices, mesh.faces
    off = np.minimum(np.abs(v), np.abs(v - CELL * cells))
    worst, count = 0.0, 0
    for axis in range(3):
        near = off[:, axis] < 0.25 * VOXEL
        faces = f[near[f].all(axis=1)]
        cross = np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
        flat = np.abs(cross[:, axis]) > 0.95 * np.maximum(np.linalg.norm(cross, axis=1), 1e-30)
        worst = max(worst, float(off[faces[flat], axis].max(initial=0.0)))
        count += int(np.count_nonzero(flat))
    return worst, count


def main() -> None:
    given = options(__doc__, cells=(10, "unit cells along each edge of the cube"))
    n = given.cells
    one = (RADIUS, RADIUS)
    print(setting(given.runs, f"BCC, {n}^3 cells, {VOXEL} mm"))
    times = alternate(
        {
            "frep, hard": lambda: designs.b(n).mesh(voxel=VOXEL),
            "hand-fused, hard": lambda: hand_fused(n, one),
            "frep, blended": lambda: designs.b(n, BLEND).mesh(voxel=VOXEL),
            "hand-fused, blended": lambda: hand_fused(n, one, BLEND),
            "frep, graded": lambda: designs.b_graded(n).mesh(voxel=VOXEL),
            "hand-fused, graded": lambda: hand_fused(n, GRADED_RADIUS),
        },
        given.runs,
        triangles,
    )
    print_times(times)
    for kind in ("hard", "blended", "graded"):
        ratio = times[f"frep, {kind}"].median / times[f"hand-fused, {kind}"].median
        print_ratio(f"frep / hand-fused, {kind}", ratio, "<= 0.8")

    true = counted_volume(n)
    print(f"\nvolume of the hard part, counted over points of an octant of a cell: {true:.2f} mm3")
    part = designs.b(n)
    start = time.perf_counter()
    plain = part.mesh(voxel=VOXEL)
    middle = time.perf_counter()
    polished = part.mesh(voxel=VOXEL, polish=True)
    end = time.perf_counter()
    vertices, faces = hand_fused(n, one)
    corners = vertices[faces].astype(np.float64)
    theirs = abs(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0)
    rows = []
    for name, value, reach in (
        ("Solid.volume, from the field", part.volume(voxel=VOXEL), "0.3 %"),
        ("mesh", plain.volume, ""),
        ("mesh, polished", polished.volume, "3 %"),
        ("hand-fused + VTK, mesh", float(theirs), ""),
    ):
        rows.append([name, f"{value:.1f}", f"{100 * (value / true - 1):+.3f} %", reach])
    table(["", "mm3", "error", "reach"], rows)
    print(f"seconds: mesh {middle - start:.3f}, polished {end - middle:.3f}")
    for name, mesh in (("mesh", plain), ("mesh, polished", polished)):
        worst, count = cap_error(mesh, n)
        bounds = np.abs(mesh.bounds - [[0.0] * 3, [CELL * n] * 3]).max()
        print(
            f"caps of the {name}: {count:,} triangles, off the cube by at most {worst:.3g} mm; bounds off by {bounds:.3g}"
        )


if __name__ == "__main__":
    main()
