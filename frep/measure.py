"""Integral properties from the field, not from a mesh."""

from __future__ import annotations

import numpy as np

from .grid import INSIDE, LEAF, SparseGrid

_BATCH = 4096


def volume_of(grid: SparseGrid) -> float:
    """Volume in mm3 of a sampled solid: the sum over samples of the part of their voxel that is inside.

    A plane at distance d from a voxel's centre leaves about clip(1/2 - d/h, 0, 1) of it inside; d is the field over its
    slope, the slope from differences between samples, so that fields that are not distances are measured as well.
    """
    tiles = float(np.count_nonzero(grid.table == INSIDE)) * LEAF**3
    partial = 0.0
    for start in range(0, len(grid.leaves), _BATCH):
        values = grid.values[start : start + _BATCH]
        fraction = 0.5 - values / _slope(values)
        partial += float(np.clip(fraction, 0.0, 1.0).sum(dtype=np.float64))
    return (tiles + partial) * grid.voxel**3


def _slope(values: np.ndarray) -> np.ndarray:
    """Change of the field over one voxel along its gradient, within each leaf.

    Along each axis the larger of the two one-sided differences, because a central one halves the slope at the crease in the
    middle of a thin wall.
    """
    total = np.zeros_like(values)
    for axis in (1, 2, 3):
        step = np.abs(np.diff(values, axis=axis))
        first = [slice(None)] * 4
        last = [slice(None)] * 4
        first[axis], last[axis] = slice(None, 1), slice(-1, None)
        before = np.concatenate([step[tuple(first)], step], axis=axis)
        after = np.concatenate([step, step[tuple(last)]], axis=axis)
        np.maximum(before, after, out=before)
        total += np.square(before, out=before)
    return np.maximum(np.sqrt(total, out=total), np.float32(1e-20))
