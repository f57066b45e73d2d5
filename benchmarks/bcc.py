"""BCC, hard, blended and graded, against a kernel made by hand for it; and its volume, by field and by mesh.

10^3 cells in a 50 mm cube, struts of 0.4 mm radius, 0.25 mm voxels (3.2 samples a diameter), script to indexed triangle
mesh. The blend is the n-ary round union of radius 0.4 mm on both sides; graded radii are linear along z, 0.3 to 0.5 mm.

    python benchmarks/bcc.py [--cells 10] [--runs 5]
"""

from __future__ import annotations

import math
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


@numba.njit(parallel=True, cache=True)
def _octant_volume(n, half, radius):
    # The octant between a corner of the cell and its centre: exact lengths inside the struts along n^2 lines parallel to z.
    volume = 0.0
    for i in numba.prange(n):
        low, high = np.empty(8), np.empty(8)
        x = half * (i + 0.5) / n
        for j in range(n):
            y = half * (j + 0.5) / n
            count = 0
            for node in range(2):
                px, py = (x, y) if node == 0 else (half - x, half - y)
                for sign in range(4):
                    # A strut through the node along (1, b, c) / sqrt 3: p^2 - t^2 < r^2 is quadratic in z.
                    b, c = 1.0 if sign & 1 else -1.0, 1.0 if sign & 2 else -1.0
                    s = px + b * py
                    # (2/3) z^2 - (2/3) c s z + px^2 + py^2 - s^2 / 3 - r^2 < 0
                    root = s * s / 4.0 - 1.5 * (px * px + py * py - s * s / 3.0 - radius * radius)
                    if root <= 0.0:
                        continue
                    middle, reach = 0.5 * c * s, math.sqrt(root)
                    z0, z1 = middle - reach, middle + reach
                    if node == 1:
                        z0, z1 = half - z1, half - z0
                    z0, z1 = max(z0, 0.0), min(z1, half)
                    if z0 < z1:
                        low[count], high[count] = z0, z1
                        count += 1
            # Length of the union.
            order = np.argsort(low[:count])
            end = 0.0
            for o in order:
                start = max(low[o], end)
                if high[o] > start:
                    volume += high[o] - start
                    end = high[o]
    return volume * (half / n) ** 2


def true_volume(cells: int, n: int = 4000) -> float:
    """Volume of the hard part by quadrature over one octant of a cell, mm3: no field of frep, no mesh, no distance."""
    return 8 * cells**3 * float(_octant_volume(n, 0.5 * CELL, RADIUS))


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

    true = true_volume(n)
    print(f"\nvolume of the hard part, by quadrature over an octant of a cell: {true:.2f} mm3")
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
