"""A gyroid sheet twisted by a Field: sines and cosines that no table along an axis can hold.

The angle of the twist depends on all three coordinates, so that of its sine and cosine and those of the twisted x and y,
six a voxel, none can be hoisted; only z stays straight. 10^3 cells, 50 mm cube, 0.25 mm voxels, against numpy (which
computes the functions of z once, too) and scikit-image.

    python benchmarks/warped_gyroid.py [--cells 10] [--runs 5]
"""

from __future__ import annotations

import math

import _designs as designs
import numpy as np
from _baselines import grid, skimage_cubes, triangles
from _designs import CELL, LEVEL, VOXEL
from _timing import alternate, options, print_ratio, print_times, setting

import frep
from frep import Field


def twist(side: float, x: Field, y: Field, z: Field) -> Field:
    """A quarter turn from bottom to top, a little more far from the axis, rad. Fields or numpy arrays."""
    return 0.5 * math.pi / side * (z + (x * x + y * y) / (2.0 * side))


def composed(cells: int) -> frep.Solid:
    """The part in frep: the gyroid at twisted coordinates."""
    side = CELL * cells
    x, y, z = frep.coordinates()
    x, y = x - 0.5 * side, y - 0.5 * side
    angle = twist(side, x, y, z)
    s, c = frep.sin(angle), frep.cos(angle)
    level = designs.gyroid_level(c * x - s * y, s * x + c * y, z)
    return frep.Solid(abs(level) - LEVEL) & designs.cube(cells)


def numpy_skimage(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The same in numpy, float32, and scikit-image's marching cubes."""
    side = CELL * cells
    x, y, z = grid(cells, CELL, VOXEL)
    x, y = x - np.float32(0.5 * side), y - np.float32(0.5 * side)
    angle = twist(side, x, y, z)
    s, c = np.sin(angle), np.cos(angle)
    k = np.float32(2 * math.pi / CELL)
    u, v, w = k * (c * x - s * y), k * (s * x + c * y), k * z
    level = np.sin(u) * np.cos(v) + np.sin(v) * np.cos(w) + np.sin(w) * np.cos(u)
    return skimage_cubes(np.abs(level) - np.float32(LEVEL), VOXEL)


def main() -> None:
    given = options(__doc__, cells=(10, "unit cells along each edge of the cube"))
    print(setting(given.runs, f"twisted gyroid sheet, {given.cells}^3 cells, {VOXEL} mm"))
    times = alternate(
        {
            "frep": lambda: composed(given.cells).mesh(voxel=VOXEL),
            "numpy + scikit-image": lambda: numpy_skimage(given.cells),
        },
        given.runs,
        triangles,
    )
    print_times(times)
    print_ratio("numpy + scikit-image / frep", times["numpy + scikit-image"].median / times["frep"].median, ">= 10")


if __name__ == "__main__":
    main()
