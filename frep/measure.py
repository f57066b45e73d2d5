"""Integral properties from the field, not from a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .grid import INSIDE, LEAF, SparseGrid

_BATCH = 4096


def volume_of(grid: SparseGrid) -> float:
    """Volume in mm3 of a sampled solid: the sum over samples of how much of their voxel is inside.

    A sample at distance d from the surface (outside positive) counts as 1/2 - 9/8 s + 5/8 s^3 with s = d / voxel, between -1 and
    1. This smoothed step has no second moment, so that the sum has no bias where the surface is curved; the plane fraction
    clip(1/2 - s, 0, 1) makes a tube of three voxels 3 % too large. d is the field over its slope, the slope from central
    differences, so that fields that are not distances are measured as well. Walls and beams need two voxels.

    Values far from the surface only promise to be larger (`frep/sampling.py`): they are cut off, lest a jump among them pass for
    a slope and a sample far away for one beside the surface.
    """
    limit = 3.0 * grid.voxel * max(1.0, _steepest(grid))
    grid = replace(grid, values=np.clip(grid.values, -limit, limit))
    tiles = float(np.count_nonzero(grid.table == INSIDE)) * LEAF**3
    partial = 0.0
    for start in range(0, len(grid.leaves), _BATCH):
        part = slice(start, start + _BATCH)
        s = np.clip(grid.values[part] / _slope(grid, part), -1.0, 1.0)
        partial += float((0.5 + s * (0.625 * s * s - 1.125)).sum(dtype=np.float64))
    return (tiles + partial) * grid.voxel**3


_ASKED = 2000
"""Leaves whose crossings are looked at."""


def _steepest(grid: SparseGrid) -> float:
    """How fast the field changes at its steepest crossings, along the axes, per mm: about 1 for a distance."""
    values = grid.values[:: max(1, len(grid.leaves) // _ASKED)]
    steps = []
    for axis in (1, 2, 3):
        a, b = (np.take(values, range(k, k + LEAF - 1), axis=axis) for k in (0, 1))
        steps.append(np.abs(a - b)[(a < 0) != (b < 0)])
    found = np.concatenate(steps)
    return float(np.quantile(found, 0.9)) / grid.voxel if len(found) else 1.0


def _slope(grid: SparseGrid, part: slice) -> np.ndarray:
    """Change of the field over one voxel along its gradient, at each sample of some leaves, by central differences."""
    values = grid.values[part]
    total = np.zeros_like(values)
    for axis in range(3):
        padded = np.concatenate([_beyond(grid, part, axis, -1), values, _beyond(grid, part, axis, 1)], axis=axis + 1)
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
