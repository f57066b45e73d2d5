"""Marching cubes over the leaf blocks of a sparse grid.

Promises, for any values without NaN: the mesh is closed, oriented outward, manifold at every edge and vertex, and no
triangle has zero area (see `case_table` and `_CLAMP` for why). Beyond the grid everything is outside, so a solid that
is cut by the box of the grid is capped there. Does not promise: freedom from self-intersection, the topology of the
trilinear interpolant in ambiguous cells, or anything about features thinner than two voxels.

A vertex belongs to the grid edge it lies on, and the edge to the sample at its lower end; so every leaf owns its
vertices and knows without asking how many they are. Two passes: *count* writes, for each leaf, bit masks of the edges
that the surface crosses and the case of each cell; after prefix sums *emit* writes positions and triangles to their
final place. The number of a vertex in a neighbouring leaf is a popcount in that leaf's mask, so that no edge table is
shared and no vertex is merged.

Source: Lorensen and Cline 1987; the two passes after Schroeder, Maynard and Geveci 2015 (flying edges), over blocks
instead of rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from frep.errors import TooLargeError
from frep.grid import INSIDE, LEAF, OUTSIDE, SparseGrid
from frep.jit import kernel, parallel_kernel
from frep.meshing.case_table import CORNERS, EDGES, case_table

_MOST_VERTICES = 2**31 - 1

_CLAMP = np.float32(1e-4)
"""A vertex stays this fraction of a voxel away from the samples at both ends of its edge.

Three points strictly inside three edges of a cell are never on a line: a line meets the surface of a cube in two
points unless it lies in a face, and the border of a face in two points unless it follows an edge. So no triangle
degenerates, even where samples are exactly zero. The area left is at least about 1e-8 voxel**2, with sides of 1e-4
voxel: 1e-6 mm in a part of 10 m at 0.01 mm, where float64 resolves 2e-12 mm. The error in position is far below that
of linear interpolation.
"""


@dataclass(frozen=True, eq=False)
class Triangles:
    """An indexed triangle mesh and the leaf each vertex came from.

    Attributes:
        vertices: (n, 3) float64, mm.
        faces: (m, 3) int32, counter-clockwise seen from outside.
        leaf_starts: (n_leaves + 1,) int64: `vertices[leaf_starts[l]:leaf_starts[l + 1]]` lie on grid edges owned by
            leaf `l`, that is edges that start at a sample of the leaf and run along +x, +y or +z. Vertices after
            `leaf_starts[-1]` lie on edges that start in a tile or outside the grid; there are none where the band of
            leaves is complete.
    """

    vertices: np.ndarray
    faces: np.ndarray
    leaf_starts: np.ndarray


def marching_cubes(grid: SparseGrid) -> Triangles:
    """Triangulate the zero level of a sparse grid.

    A sample is inside when its value is below zero; the surface crosses an edge between an inside and another sample
    at the zero of the linear interpolant. Tiles and everything beyond the grid count as plus or minus
    `grid.background`.

    Args:
        grid: the samples, in mm, without NaN.

    Returns:
        The closed mesh; empty arrays for a grid without surface.

    Raises:
        TooLargeError: more than 2**31 - 1 vertices.
    """
    n_leaves = len(grid.leaves)
    values = np.ascontiguousarray(grid.values, dtype=np.float32)
    signs = np.empty((n_leaves, 8), dtype=np.uint64)
    _find_signs(values, signs)
    # Samplers deliver a complete band; what follows costs nothing then.
    band = replace(
        grid,
        table=np.ascontiguousarray(grid.table, dtype=np.int32),
        leaves=np.ascontiguousarray(grid.leaves, dtype=np.int32),
        values=values,
    )
    band, signs, pad = _complete(band, signs)

    n = len(band.leaves)
    masks = np.empty((n, 32), dtype=np.uint64)
    firsts = np.empty((n, 24), dtype=np.uint16)
    cases = np.empty((n, 512), dtype=np.uint8)
    counts = np.zeros((2, n + 1), dtype=np.int64)
    table = case_table()
    with numba.parallel_chunksize(_CHUNKS_A_TASK):
        _count(band.table, pad, band.leaves, signs, table.counts, masks, firsts, cases, counts)
        starts = np.cumsum(counts, axis=1)
        n_vertices, n_faces = int(starts[0, -1]), int(starts[1, -1])
        if n_vertices > _MOST_VERTICES:
            fits = 1.01 * grid.voxel * (n_vertices / _MOST_VERTICES) ** 0.5
            raise TooLargeError(
                f"voxel={grid.voxel:g} mm makes {n_vertices} vertices; int32 faces number at most {_MOST_VERTICES}: "
                f"use voxel={fits:.3g} mm or coarser, or mesh in parts"
            )
        # Allocated by numpy, not in the kernel: numpy asks for huge pages, which saves most page faults.
        vertices = np.empty((n_vertices, 3), dtype=np.float64)
        faces = np.empty((n_faces, 3), dtype=np.int32)
        _emit(
            band.table, pad, band.leaves, band.values, np.float32(grid.background),
            np.array(grid.origin, dtype=np.float64), float(grid.voxel), masks, firsts, cases, starts,
            table.counts, _triangle_offsets(), vertices.reshape(-1), faces.reshape(-1),
        )  # fmt: skip
    return Triangles(vertices, faces, starts[0, : n_leaves + 1].copy())


def _complete(grid: SparseGrid, signs: np.ndarray) -> tuple[SparseGrid, np.ndarray, int]:
    """Turn tiles that own a crossed edge into leaves of plus or minus `background`.

    Such a tile contradicts the promise of `SparseGrid` (or lies beyond the table, beside a solid that is cut there),
    and without it the mesh would have a hole. The new leaves are numbered after the others. Returns also the padding
    of the new table.
    """
    starts = np.zeros(grid.table.shape[0] + 2, dtype=np.int64)
    none = np.empty((0, 3), dtype=np.int32)
    _find_contradictions(grid.table, signs, starts, none)
    if not starts.any():
        return grid, signs, 0
    starts = np.cumsum(starts)
    blocks = np.empty((starts[-1], 3), dtype=np.int32)
    _find_contradictions(grid.table, signs, starts, blocks)
    table = np.pad(grid.table, 1, constant_values=OUTSIDE)
    inside = table[tuple((blocks + 1).T)] == INSIDE
    table[tuple((blocks + 1).T)] = len(grid.leaves) + np.arange(len(blocks), dtype=np.int32)
    far = np.where(inside, -grid.background, grid.background).astype(np.float32)
    values = np.broadcast_to(far[:, None, None, None], (len(blocks), LEAF, LEAF, LEAF))
    far_signs = np.where(inside, _ALL, _NONE)
    band = replace(
        grid,
        table=table,
        leaves=np.concatenate([grid.leaves, blocks]),
        values=np.concatenate([grid.values, values]),
    )
    return band, np.concatenate([signs, np.broadcast_to(far_signs[:, None], (len(blocks), 8))]), 1


# Everything below works on *words*: 64 samples of one leaf with the same i as the bits of a uint64, bit 8 j + k for
# sample (i, j, k). Indices in the hot loops are uint64 too: numba then drops the test for negative indices, and a
# mixture with int64 would become float64.

_U = np.uint64
_NONE, _ALL = _U(0), _U(0xFFFFFFFFFFFFFFFF)
_LOW_J, _LOW_K = _U(0xFF), _U(0x0101010101010101)
_BITS = _U(1) << np.arange(64, dtype=np.uint64)

_CHUNK = 32
"""Leaves that share one scratch buffer."""
_CHUNKS_A_TASK = 4
"""Chunks a thread takes at a time: leaves differ in work, so an even split of the list is not an even split of the
work."""


def _instruction(build: Callable[[Any, Any], Any]) -> Any:
    """An instruction of the processor on one word, which numba has no name for."""

    def typed(typingctx, word):
        return types.uint64(types.uint64), lambda context, builder, signature, args: build(builder, args[0])

    return intrinsic(typed)


_popcount = _instruction(lambda builder, word: builder.ctpop(word))
_lowest = _instruction(lambda builder, word: builder.cttz(word, ir.Constant(ir.IntType(1), 1)))
"""Position of the lowest set bit of a word that is not zero."""


@cache
def _triangle_offsets() -> np.ndarray:
    """(256 * 16,) uint16 (8 KB, a sixth of the first cache): the triangles of each case as offsets in the `ids` of
    `_emit`."""
    table = case_table()
    at = [axis * 729 + CORNERS[c][0] * 81 + CORNERS[c][1] * 9 + CORNERS[c][2] for axis, c in EDGES]
    offsets = np.zeros((256, 16), dtype=np.uint16)
    offsets[:, : 3 * table.triangles.shape[1]] = np.array(at, dtype=np.uint16)[table.triangles].reshape(256, -1)
    return offsets.reshape(-1)


@parallel_kernel
def _find_signs(values, signs):
    """Word of inside samples for each leaf and i. Reads 4 bytes a voxel once: memory bound."""
    for leaf in numba.prange(len(values)):
        block = values[leaf].reshape(512)
        for i in range(8):
            word = _NONE
            for n in range(64):
                word |= _BITS[n] if block[64 * i + n] < np.float32(0.0) else _NONE
            signs[leaf, i] = word


@kernel
def _block(table, pad, bi, bj, bk):
    """Entry of the table at a block, `OUTSIDE` beyond it."""
    i, j, k = bi + pad, bj + pad, bk + pad
    if 0 <= i < table.shape[0] and 0 <= j < table.shape[1] and 0 <= k < table.shape[2]:
        return table[i, j, k]
    return np.int32(OUTSIDE)


@kernel
def _word(signs, block, i):
    if block >= 0:
        return signs[block, i]
    return _ALL if block == INSIDE else _NONE


@parallel_kernel
def _find_contradictions(table, signs, starts, found):
    """Blocks without leaf that own a crossed edge: counted by plane into `starts[1:]`, then listed into `found`.

    A few nanoseconds a block, 4 bytes read.
    """
    bx, by, bz = table.shape
    for plane in numba.prange(bx + 1):
        bi = plane - 1
        n = 0
        for bj in range(-1, by):
            for bk in range(-1, bz):
                own = _block(table, 0, bi, bj, bk)
                if own >= 0:
                    continue
                sign = _ALL if own == INSIDE else _NONE
                differs = False
                for c in range(1, 8):
                    di, dj, dk = c >> 2, c >> 1 & 1, c & 1
                    block = _block(table, 0, bi + di, bj + dj, bk + dk)
                    if block == own:
                        continue
                    # The samples of that block which share a cell with this one.
                    touching = (_LOW_J if dj else _ALL) & (_LOW_K if dk else _ALL)
                    for i in range(1 if di else 8):
                        differs |= ((_word(signs, block, i) ^ sign) & touching) != _NONE
                if differs:
                    if len(found) > 0:
                        at = starts[plane] + n
                        found[at, 0], found[at, 1], found[at, 2] = bi, bj, bk
                    n += 1
        if len(found) == 0:
            starts[plane + 1] = n


@kernel
def _neighbours(table, pad, leaves, leaf, blocks):
    """The eight blocks that the cells of a leaf touch, numbered like the corners of a cell."""
    for c in range(8):
        blocks[c] = _block(
            table, pad, leaves[leaf, 0] + (c >> 2), leaves[leaf, 1] + (c >> 1 & 1), leaves[leaf, 2] + (c & 1)
        )


@parallel_kernel
def _count(table, pad, leaves, signs, case_counts, masks, firsts, cases, counts):
    """Edge masks, cell cases, vertex and triangle counts of each leaf. A nanosecond a voxel, 0.8 KB written a leaf.

    `masks[leaf, 4 i + d]` are the crossed edges along axis d in plane i (d = 3: the active cells), `firsts[leaf, 3 i
    + d]` the number of the first vertex there within its leaf, `cases[leaf, 64 i + 8 j + k]` the case of a cell.
    """
    n = len(leaves)
    for chunk in numba.prange((n + _CHUNK - 1) // _CHUNK):
        blocks = np.empty(8, dtype=np.int32)
        corner = np.empty((4, 9), dtype=np.uint64)  # signs at (j, k), (j, k+1), (j+1, k), (j+1, k+1)
        for leaf in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, n)):
            _neighbours(table, pad, leaves, leaf, blocks)
            for i in range(9):
                # Plane 8 is plane 0 of the blocks at +x.
                h, p = (0, i) if i < 8 else (4, 0)
                own, right = _word(signs, blocks[h], p), _word(signs, blocks[h + 2], p)
                up, diagonal = _word(signs, blocks[h + 1], p), _word(signs, blocks[h + 3], p)
                own_k = (own >> _U(1) & ~(_LOW_K << _U(7))) | (up & _LOW_K) << _U(7)
                right_k = (right >> _U(1) & ~(_LOW_K << _U(7))) | (diagonal & _LOW_K) << _U(7)
                corner[0, i] = own
                corner[1, i] = own_k
                corner[2, i] = own >> _U(8) | right << _U(56)
                corner[3, i] = own_k >> _U(8) | right_k << _U(56)
            n_vertices = _NONE
            n_faces = _NONE
            for i in range(8):
                own, own_next = corner[0, i], corner[0, i + 1]
                every, some = own & own_next, own | own_next
                for c in range(1, 4):
                    every &= corner[c, i] & corner[c, i + 1]
                    some |= corner[c, i] | corner[c, i + 1]
                masks[leaf, 4 * i] = own ^ own_next
                masks[leaf, 4 * i + 1] = own ^ corner[2, i]
                masks[leaf, 4 * i + 2] = own ^ corner[1, i]
                masks[leaf, 4 * i + 3] = some & ~every
                for d in range(3):
                    firsts[leaf, 3 * i + d] = n_vertices
                    n_vertices += _popcount(masks[leaf, 4 * i + d])
                if some & ~every:
                    n_faces += _find_cases(corner, i, some & ~every, case_counts, cases[leaf])
            counts[0, leaf + 1] = n_vertices
            counts[1, leaf + 1] = n_faces


@kernel
def _find_cases(corner, i, active, case_counts, cases):
    """Cases of the 64 cells of a plane (eight 8 x 8 bit transposes, SIMD over j) and the triangles of the active
    ones."""
    for j in range(8):
        # Byte c of x is row j of corner c; bit 8 k + c of its transpose is corner c of cell k.
        shift = _U(8 * j)
        x = _NONE
        for c in range(4):
            x |= (corner[c, i] >> shift & _LOW_J) << _U(8 * c)
            x |= (corner[c, i + 1] >> shift & _LOW_J) << _U(8 * c + 32)
        # Hacker's Delight 7-3.
        t = (x ^ (x >> _U(7))) & _U(0x00AA00AA00AA00AA)
        x = x ^ t ^ (t << _U(7))
        t = (x ^ (x >> _U(14))) & _U(0x0000CCCC0000CCCC)
        x = x ^ t ^ (t << _U(14))
        t = (x ^ (x >> _U(28))) & _U(0x00000000F0F0F0F0)
        x = x ^ t ^ (t << _U(28))
        for k in range(8):
            cases[64 * i + 8 * j + k] = np.uint8(x >> _U(8 * k) & _LOW_J)
    n = _NONE
    first = _U(64 * i)
    while active:
        n += _U(case_counts[cases[first + _lowest(active)]])
        active &= active - _U(1)
    return n


@kernel
def _gather(values, blocks, background, box):
    """The 9 x 9 x 9 samples that the cells of a leaf touch, in `box[81 i + 9 j + k]`."""
    for c in range(8):
        block = blocks[c]
        far = -background if block == INSIDE else background
        for i in range(8, 9) if c & 4 else range(8):
            for j in range(8, 9) if c & 2 else range(8):
                at = 81 * i + 9 * j
                if c & 1:
                    box[at + 8] = values[block, i & 7, j & 7, 0] if block >= 0 else far
                elif block >= 0:
                    for k in range(8):
                        box[at + k] = values[block, i & 7, j & 7, k]
                else:
                    for k in range(8):
                        box[at + k] = far


@kernel
def _fraction(a, b):
    """Where the line from a to b crosses zero, kept inside the edge; the comparisons send NaN (infinite samples) to
    an end."""
    t = a / (a - b)
    t = t if t > _CLAMP else _CLAMP
    return np.float64(t if t < np.float32(1.0) - _CLAMP else np.float32(1.0) - _CLAMP)


@kernel
def _place(box, masks, first, origin, step, ids, xyz):
    """Write the vertices of one leaf, numbered from `first`, and their numbers into `ids[729 d + 81 i + 9 j + k]`."""
    number = first
    for i in range(8):
        plane = _U(81 * i)
        x = origin[0, i]
        for d in range(3):
            mask = masks[4 * i + d]
            base = _U(729 * d) + plane
            ahead = plane + (_U(81) if d == 0 else _U(9) if d == 1 else _U(1))
            dx, dy, dz = step if d == 0 else 0.0, step if d == 1 else 0.0, step if d == 2 else 0.0
            while mask:
                bit = _lowest(mask)
                mask &= mask - _U(1)
                j = bit >> _U(3)
                at = bit + j
                t = _fraction(box[plane + at], box[ahead + at])
                ids[base + at] = np.int32(number)
                to = _U(3) * number
                xyz[to] = x + dx * t
                xyz[to + _U(1)] = origin[1, j] + dy * t
                xyz[to + _U(2)] = origin[2, bit & _U(7)] + dz * t
                number += _U(1)


@kernel
def _number(masks, firsts, starts, block, i, d, part, to, ids):
    """Look up the vertices of another leaf on its edges along d in plane i, as far as `part` selects them."""
    mask = masks[block, 4 * i + d]
    wanted = mask & part
    base = _U(starts[block]) + _U(firsts[block, 3 * i + d])
    at = _U(729 * d + to)
    while wanted:
        bit = _lowest(wanted)
        wanted &= wanted - _U(1)
        below = (_U(1) << bit) - _U(1)
        ids[at + bit + (bit >> _U(3))] = np.int32(base + _popcount(mask & below))


@kernel
def _number_neighbours(masks, firsts, starts, blocks, ids):
    """Numbers of the crossed edges in the faces i = 8, j = 8 and k = 8 of a leaf, which its neighbours own."""
    for c in range(1, 7):
        block = blocks[c]
        if block >= 0:
            part = (_LOW_J if c & 2 else _ALL) & (_LOW_K if c & 1 else _ALL)
            to = 648 * (c >> 2) + 72 * (c >> 1 & 1) + 8 * (c & 1)
            for i in range(1 if c & 4 else 8):
                for d in range(3):
                    if not c >> (2 - d) & 1:
                        _number(masks, firsts, starts, block, i, d, part, to + 81 * i, ids)


@kernel
def _connect(active, cases, i, case_counts, offsets, ids, stage, faces, first):
    """Write the triangles of one plane of cells, from index `first` of `faces`; returns the index after them.

    The number of triangles of a cell cannot be predicted, and a wrong guess costs as much as three triangles. So
    every cell writes three and the rest if any, and the next cell overwrites what was too much; hence the `stage`, as
    threads write side by side in `faces`.
    """
    n = _NONE
    plane = _U(64 * i)
    while active:
        bit = _lowest(active)
        active &= active - _U(1)
        case = _U(cases[plane + bit])
        cell = _U(81 * i) + bit + (bit >> _U(3))
        row = case << _U(4)
        for q in range(9):
            stage[n + _U(q)] = ids[cell + _U(offsets[row + _U(q)])]
        many = _U(case_counts[case])
        if many > _U(3):
            for q in range(9, 15):
                stage[n + _U(q)] = ids[cell + _U(offsets[row + _U(q)])]
        n += _U(3) * many
    for q in range(n):
        faces[first + q] = stage[q]
    return first + n


@parallel_kernel
def _emit(
    table, pad, leaves, values, background, origin, voxel, masks, firsts, cases, starts,
    case_counts, offsets, xyz, faces,
):  # fmt: skip
    """Vertices and triangles. About 6 ns of CPU a triangle; writes 24 bytes a vertex and 12 a triangle once."""
    n = len(leaves)
    for chunk in numba.prange((n + _CHUNK - 1) // _CHUNK):
        blocks = np.empty(8, dtype=np.int32)
        box = np.empty(729, dtype=np.float32)
        ids = np.zeros(3 * 729 + 91, dtype=np.int32)
        stage = np.empty(64 * 15 + 15, dtype=np.int32)
        corner = np.empty((3, 8))
        for leaf in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, n)):
            first = _U(3) * _U(starts[1, leaf])
            if starts[1, leaf + 1] == starts[1, leaf]:
                continue
            _neighbours(table, pad, leaves, leaf, blocks)
            _gather(values, blocks, background, box)
            for d in range(3):
                for i in range(8):
                    corner[d, i] = origin[d] + voxel * (8 * np.int64(leaves[leaf, d]) + i)
            _place(box, masks[leaf], _U(starts[0, leaf]), corner, voxel, ids, xyz)
            _number_neighbours(masks, firsts, starts[0], blocks, ids)
            for i in range(8):
                first = _connect(masks[leaf, 4 * i + 3], cases[leaf], i, case_counts, offsets, ids, stage, faces, first)
