"""Integral properties from the field, not from a mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .errors import TooLargeError
from .field import topological
from .grid import INSIDE, LEAF, SparseGrid

if TYPE_CHECKING:
    from .solid import Solid

_FEW = 1500
"""Leaves of a part that is so small that twice as fine a grid takes a few hundredths of a second."""

_TABLE = 1 << 20
"""Blocks in the box of such a part: a finer grid has eight times as many."""

_BATCH = 256
"""Leaves looked at together: few enough that their arrays stay in the cache."""


def volume(solid: Solid, voxel: float | None) -> float:
    """`Solid.volume`: the field is sampled at half the voxel, and at half of that again while the part is small.

    Edges cost of second order in the voxel, faces along the axes of first order; a part with few voxels has most of both.
    """
    from .sizing import chosen_voxel, sample_solid

    size = 0.5 * chosen_voxel(solid, voxel, None)
    try:
        grid = sample_solid(solid, size, None, exact=2.0)
    except TooLargeError as error:
        raise TooLargeError(f"{error} (a volume is sampled at half the voxel given, here {2.0 * size:g} mm)") from None
    # What calls Python takes longer, and how much longer is not known.
    quick = all(node.op != "foreign" for node in topological([solid.field]))
    while quick and len(grid.leaves) < _FEW and grid.table.size < _TABLE:
        size *= 0.5
        grid = sample_solid(solid, size, None, exact=2.0, quiet=True)
    return volume_of(grid)


def volume_of(grid: SparseGrid) -> float:
    """Volume in mm3 of a sampled solid: the sum over samples of how much of their voxel is inside.

    A sample at distance d from the surface (outside positive) counts as 1/2 - 9/8 s + 5/8 s^3 with s = d / voxel, between -1 and
    1. This smoothed step has no second moment, so that the sum has no bias where the surface is curved; the plane fraction
    clip(1/2 - s, 0, 1) makes a tube of three voxels 3 % too large. d is the field over its slope, the slope from central
    differences, so that fields that are not distances are measured as well. Walls and beams need two voxels.

    Flat faces along the axes are off by up to 0.06 voxel, with a sign that depends on where they lie between samples; along other
    directions that averages out. Edges cost of second order in the voxel.

    Values far from the surface only promise to be larger (`frep/sampling.py`): they are cut off at three voxels, by how steep the
    field is where it crosses zero nearby, lest a jump among them pass for a slope and a sample far away for one beside the
    surface.
    """
    usual = _usual(grid)
    tiles = float(np.count_nonzero(grid.table == INSIDE)) * LEAF**3
    partial = 0.0
    for start in range(0, len(grid.leaves), _BATCH):
        part = slice(start, start + _BATCH)
        steep = _steepness(grid.values[part])
        limit = 3.0 * np.where(steep > 0, steep, np.float32(usual))[:, None, None, None]
        values = np.clip(grid.values[part], -limit, limit)
        s = np.clip(values / _slope(grid, part, values, limit), -1.0, 1.0)
        partial += float((0.5 + s * (0.625 * s * s - 1.125)).sum(dtype=np.float64))
    return (tiles + partial) * grid.voxel**3


_ASKED = 2000
"""Leaves whose crossings are looked at."""


def _usual(grid: SparseGrid) -> float:
    """The steepness of most leaves, for those that have no crossing of their own."""
    found = _steepness(grid.values[:: max(1, len(grid.leaves) // _ASKED)])
    found = found[found > 0]
    return float(np.median(found)) if len(found) else grid.voxel


def _steepness(values: np.ndarray) -> np.ndarray:
    """(n,) largest change over one voxel where the field changes sign, along the axes, of each leaf; 0 where it does not."""
    most = np.zeros(len(values), np.float32)
    inside = values < 0
    for axis in range(3):
        behind, ahead = [slice(None)] * 4, [slice(None)] * 4
        behind[axis + 1], ahead[axis + 1] = slice(None, -1), slice(1, None)
        steps = np.abs(values[tuple(ahead)] - values[tuple(behind)])
        steps *= inside[tuple(ahead)] != inside[tuple(behind)]
        np.maximum(most, steps.max(axis=(1, 2, 3)), out=most)
    return most


def _slope(grid: SparseGrid, part: slice, values: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Change of the field over one voxel along its gradient, at each sample of some leaves, by central differences."""
    total = np.zeros_like(values)
    for axis in range(3):
        before, after = (np.clip(_beyond(grid, part, axis, side), -limit, limit) for side in (-1, 1))
        padded = np.concatenate([before, values, after], axis=axis + 1)
        ahead = [slice(None)] * 4
        behind = [slice(None)] * 4
        ahead[axis + 1], behind[axis + 1] = slice(2, None), slice(None, -2)
        step = padded[tuple(ahead)] - padded[tuple(behind)]
        total += np.square(step, out=step)
    return np.maximum(0.5 * np.sqrt(total, out=total), np.float32(1e-20))


def _beyond(grid: SparseGrid, part: slice, axis: int, side: int) -> np.ndarray:
    """The layer of samples next to some leaves: of the neighbouring leaves, or extrapolated where there is a tile."""
    values, neighbour = grid.values[part], grid.leaves[part].copy()
    neighbour[:, axis] += side
    exists = (neighbour[:, axis] >= 0) & (neighbour[:, axis] < grid.table.shape[axis])
    neighbour[~exists] = 0
    number = np.where(exists, grid.table[tuple(neighbour.T)], -1)

    def layer(source: np.ndarray, k: int) -> np.ndarray:
        where = [slice(None)] * 4
        where[axis + 1] = slice(k, k + 1)
        return source[tuple(where)]

    near, next_ = (
        (layer(values, 0), layer(values, 1)) if side < 0 else (layer(values, LEAF - 1), layer(values, LEAF - 2))
    )
    beyond = 2.0 * near - next_
    there = number >= 0
    beyond[there] = layer(grid.values, LEAF - 1 if side < 0 else 0)[number[there]]
    return beyond
