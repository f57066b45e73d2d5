"""Compiled steps over the fine blocks of a body: which block answers for a shared node, which nodes share a side."""

from __future__ import annotations

import numpy as np

from .jit import kernel

NODES = 9
"""Nodes along the edge of a fine block; the outer ones are shared with the neighbours."""


# 729 table look-ups a block at worst, most of them skipped: 2 us a block; writes 6 kB.
@kernel
def owners(table, cells, out):
    """For each node of each block, the flat slot `729 * block + node` that answers for it.

    Args:
        table: (nx, ny, nz) int32, block numbers of cells, -1 where there is none.
        cells: (m, 3) int32, the cell of each block.
        out: (m, 729) int64, filled. A node on a shared face, edge or corner belongs to the last of its blocks.
    """
    nx, ny, nz = table.shape
    for m in range(cells.shape[0]):
        i, j, k = cells[m, 0], cells[m, 1], cells[m, 2]
        for a in range(9):
            for b in range(9):
                for c in range(9):
                    slot = 729 * m + (a * 9 + b) * 9 + c
                    # The blocks round a node: on a low face also the one before, on a high face also the one after.
                    for di in range(1 if a == 8 else 0, -2 if a == 0 else -1, -1):
                        if not 0 <= i + di < nx:
                            continue
                        for dj in range(1 if b == 8 else 0, -2 if b == 0 else -1, -1):
                            if not 0 <= j + dj < ny:
                                continue
                            for dk in range(1 if c == 8 else 0, -2 if c == 0 else -1, -1):
                                if 0 <= k + dk < nz and table[i + di, j + dj, k + dk] >= 0:
                                    other = np.int64(table[i + di, j + dj, k + dk])
                                    node = ((a - 8 * di) * 9 + b - 8 * dj) * 9 + c - 8 * dk
                                    slot = max(slot, 729 * other + node)
                    out[m, (a * 9 + b) * 9 + c] = slot


# A flood fill: each node is pushed once and looks at six neighbours; 15 us a block, all of it in cache.
@kernel
def regions(distance, out):
    """Group the nodes of each block that no surface separates.

    Two neighbours whose distances to the surface add up to more than the one cell between them lie on the same side of it.

    Args:
        distance: (m, 729) float32, unsigned distance in cells.
        out: (m, 729) int64, filled: the flat slot of the node that stands for the group, the one farthest from the surface.
    """
    stack = np.empty(729, np.int64)
    group = np.empty(729, np.int64)
    for m in range(distance.shape[0]):
        d = distance[m]
        for n in range(729):
            out[m, n] = -1
        for seed in range(729):
            if out[m, seed] >= 0:
                continue
            top, size, best = 1, 0, seed
            stack[0] = seed
            out[m, seed] = seed
            while top > 0:
                top -= 1
                n = stack[top]
                group[size] = n
                size += 1
                if d[n] > d[best]:
                    best = n
                a, b, c = n // 81, (n // 9) % 9, n % 9
                for side in range(6):
                    step = 81 if side < 2 else (9 if side < 4 else 1)
                    at = a if side < 2 else (b if side < 4 else c)
                    up = side % 2 == 0
                    if (up and at == 8) or (not up and at == 0):
                        continue
                    other = n + step if up else n - step
                    if out[m, other] < 0 and d[n] + d[other] > 1.0001:
                        out[m, other] = seed
                        stack[top] = other
                        top += 1
            for g in range(size):
                out[m, group[g]] = 729 * m + best
