"""Which nodes of one steady lattice meet another (Lattice-in-Lattice), in compiled code: each node is tested once,
none is stored."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from . import steady_kernels as steady
from .beam_kernels import cone_distance
from .biq_kernels import H_COUNT, H_INDEX, H_SEGMENTS, H_SOURCE_DATA, SEGMENT
from .jit import kernel, parallel_kernel


@kernel
def _kept(kept, low, i, j, k, node):
    i, j, k = int(i) - low[0], int(j) - low[1], int(k) - low[2]
    inside = 0 <= i < kept.shape[0] and 0 <= j < kept.shape[1] and 0 <= k < kept.shape[2]
    return inside and kept[i, j, k, node] != 0


@kernel
def _is_kept(idata, b, ends, pairs, rack, kept, low):
    """Whether both nodes of a beam are; balls of lone nodes are not."""
    i, j, k = ends[8], ends[9], ends[10]
    return (
        rack < len(pairs)
        and _kept(kept, low, i, j, k, pairs[rack, 0])
        and _kept(kept, low, i + idata[b], j + idata[b + 1], k + idata[b + 2], pairs[rack, 1])
    )


@kernel
def _ball_distance(ends, cx, cy, cz):
    """Signed distance of a point from a cone-beam."""
    ax, ay, az, bx, by, bz = ends[0] - cx, ends[1] - cy, ends[2] - cz, ends[3] - cx, ends[4] - cy, ends[5] - cz
    ux, uy, uz = bx - ax, by - ay, bz - az
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    if length == 0.0:
        return math.sqrt(ax * ax + ay * ay + az * az) - ends[6]
    t = -(ax * ux + ay * uy + az * uz) / length
    radial = math.sqrt(max(ax * ax + ay * ay + az * az - t * t, 0.0))
    return cone_distance(radial, t, length, ends[6], ends[7])


SIDE = 4
"""Clusters along a side of the blocks that share one query."""

_LIST = 48
"""Beams that the list of a block holds at first."""


@kernel
def _largest_scale(fdata, idata, q, box):
    """Scales grow evenly along each direction: the largest in a box of clusters is at one of its corners."""
    largest = 1.0
    for axis in range(3):
        table = np.int64(idata[q + steady.I_POWERS + axis]) + 12
        low = fdata[table + 2 * steady.POWER * (box[axis] - idata[q + steady.I_BASE + axis])]
        high = fdata[table + 2 * steady.POWER * (box[3 + axis] - idata[q + steady.I_BASE + axis])]
        largest *= max(low, high)
    return largest


@kernel
def _beams_near(head, fdata, idata, pairs, kept, low, cx, cy, cz, radius, stack, near, swept, dual, ends, found):
    """List the ends and radii of the beams that come near a ball; returns how many, one more than fit if they do not."""
    p, q = head[H_SOURCE_DATA], head[H_INDEX]
    filtered = kept.shape[0] > 0
    n = 0
    top = steady.descend(fdata, idata, q, p, cx, cy, cz, radius, stack, steady.start(idata, q, stack), swept, dual)
    while top > 0:
        for rack in range(head[H_COUNT]):
            s, b = head[H_SEGMENTS] + SEGMENT * rack, q + steady.I_RACKS + steady.RACK * rack
            steady.rack_anchors(idata, b, stack[top - 1], swept, near)
            for i in range(near[0], near[3] + 1):
                for j in range(near[1], near[4] + 1):
                    for k in range(near[2], near[5] + 1):
                        steady.rack_ends(fdata, idata, q, s, b, i, j, k, ends)
                        if _ball_distance(ends, cx, cy, cz) <= radius and (
                            not filtered or _is_kept(idata, b, ends, pairs, rack, kept, low)
                        ):
                            if n == len(found):
                                return n + 1
                            for c in range(8):
                                found[n, c] = ends[c]
                            n += 1
        top = steady.descend(fdata, idata, q, p, cx, cy, cz, radius, stack, top - 1, swept, dual)
    return n


@kernel
def _mark_block(fine, box, nodes, radii, first, out, coarse):
    """Mark the nodes of one block of clusters."""
    fine_head, fine_fdata, fine_idata = fine
    head, fdata, idata, pairs, kept, low = coarse
    p, q = fine_head[H_SOURCE_DATA], fine_head[H_INDEX]
    stack, near = np.empty((steady.STACK, 6), np.int64), np.empty(6, np.int64)
    swept, dual, ends, found = np.empty(steady.SWEPT), np.empty(3), np.empty(11), np.empty((_LIST, 8))
    swept_box = box.copy()
    for axis in range(3):
        # Of the nodes alone, not of the beams that start from them.
        swept_box[3 + axis] -= fine_idata[q + steady.I_REACH + axis]
    steady.sweep(fine_fdata, fine_idata, q, p, swept_box, swept)
    x, y, z = swept[0], swept[1], swept[2]
    reach = swept[steady.S_RADIUS] + radii.max() * _largest_scale(fine_fdata, fine_idata, q, box)
    n = _beams_near(head, fdata, idata, pairs, kept, low, x, y, z, reach, stack, near, swept, dual, ends, found)
    while n > len(found):
        found = np.empty((4 * len(found), 8))
        n = _beams_near(head, fdata, idata, pairs, kept, low, x, y, z, reach, stack, near, swept, dual, ends, found)
    for i in range(box[0], box[3] + 1):
        for j in range(box[1], box[4] + 1):
            for k in range(box[2], box[5] + 1):
                for node in range(len(nodes)):
                    touching = False
                    if n > 0:
                        x, y, z, scale = steady.placed(
                            fine_fdata, fine_idata, q, i, j, k, nodes[node, 0], nodes[node, 1], nodes[node, 2]
                        )
                        m = 0
                        while m < n and not touching:
                            touching = _ball_distance(found[m], x, y, z) <= radii[node] * scale
                            m += 1
                    out[i - first[0], j - first[1], k - first[2], node] = touching


@parallel_kernel
def nodes_touching(fine, nodes, radii, first, out, coarse):
    """Mark in `out` (i, j, k, node) the nodes of a block of clusters, from `first` on, whose balls meet a lattice of cones.

    One query of a few us for a block of 64 clusters, then some 15 ns a node and beam that comes near the block.
    """
    bi, bj, bk = (out.shape[0] - 1) // SIDE + 1, (out.shape[1] - 1) // SIDE + 1, (out.shape[2] - 1) // SIDE + 1
    for block in prange(bi * bj * bk):
        box = np.empty(6, np.int64)
        at = block // (bj * bk), block // bk % bj, block % bk
        for axis in range(3):
            box[axis] = first[axis] + SIDE * at[axis]
            box[3 + axis] = min(box[axis] + SIDE, first[axis] + out.shape[axis]) - 1
        _mark_block(fine, box, nodes, radii, first, out, coarse)
