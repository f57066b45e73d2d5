"""The ball-interference query of beams in compiled code: which beams meet the ball (c, r)?

A skeleton is a source of segments that answers this one question (`gather`). Explicit graphs answer through a uniform
grid of segment lists, periodic cells by folding the ball into the period, steady lattices by descending their index
brick (`frep/steady_kernels.py`). The nearest beam, and how far away a beam can matter, are found by asking again.

The data of a skeleton is packed into flat arrays (see `frep/skeleton.py`): `head` (integers), `fdata` (float64),
`idata` (int32).
"""

from __future__ import annotations

import math

import numpy as np

from . import steady_kernels as steady
from .jit import kernel

# Columns of `head`.
H_SOURCE, H_SECTION, H_BLEND, H_NODES, H_SEGMENTS, H_COUNT, H_SOURCE_DATA, H_INDEX, H_NX, H_NY, H_NZ = range(11)
HEAD = 16

PERIODIC, GRAPH, STEADY = 0, 1, 2
"""Sources. Periodic source data: cell size (3), largest own radius. Graph: index origin (3), index spacing, largest
radius. Steady: see `frep/steady_kernels.py`."""

SEGMENT = 9
"""Columns of a stored segment: a (3), b (3), radius at a, radius at b, 1 for a node ball."""

# Columns of a gathered row: start relative to the ball centre, unit direction, length, radii, node flag, first section
# axis, segment number, cell (i, j, k), distance of the axis from the ball centre.
R_U, R_LENGTH, R_RA, R_RB, R_NODE, R_E1, R_ID, R_CELL, R_DISTANCE = 3, 6, 7, 8, 9, 10, 13, 14, 17
ROW = 18

CAPACITY = 1024
"""Rows a block's list holds. A block that meets more beams is evaluated point by point."""


@kernel
def store(rows, n, ax, ay, az, bx, by, bz, ra, rb, node, seg, ci, cj, ck, distance):
    # The ends are relative to the ball centre.
    ux, uy, uz = bx - ax, by - ay, bz - az
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    if length > 0.0:
        ux, uy, uz = ux / length, uy / length, uz / length
    else:
        ux, uy, uz = 0.0, 0.0, 1.0
    # Section frame (lf-rep 3.2): e1 = z x e3, or x for a vertical beam; the same solid for both directions.
    horizontal = math.sqrt(ux * ux + uy * uy)
    if horizontal > 1e-9:
        e1x, e1y = -uy / horizontal, ux / horizontal
    else:
        e1x, e1y = 1.0, 0.0
    r = rows[n]
    r[0], r[1], r[2] = ax, ay, az
    r[3], r[4], r[5] = ux, uy, uz
    r[6], r[7], r[8], r[9] = length, ra, rb, node
    r[10], r[11], r[12] = e1x, e1y, 0.0
    r[13], r[14], r[15], r[16] = seg, ci, cj, ck
    r[17] = distance


@kernel
def _axis_distance(ax, ay, az, bx, by, bz):
    """Distance of the origin from a segment."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    squared = ux * ux + uy * uy + uz * uz
    t = 0.0
    if squared > 0.0:
        t = min(max(-(ax * ux + ay * uy + az * uz) / squared, 0.0), 1.0)
    dx, dy, dz = ax + t * ux, ay + t * uy, az + t * uz
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@kernel
def gather(head, fdata, idata, cx, cy, cz, radius, skip, rows):
    """The beams whose axis, thickened by their own stored radius, comes within `radius` of (cx, cy, cz).

    Returns how many there are, and fills `rows` with those after the first `skip`, as many as fit. A steady source
    stops looking where the rows are full, and then returns one more than it has passed. About 10 ns a candidate.
    """
    if head[H_SOURCE] == PERIODIC:
        return _gather_periodic(head, fdata, cx, cy, cz, radius, skip, rows)
    if head[H_SOURCE] == STEADY:
        return _gather_steady(head, fdata, idata, cx, cy, cz, radius, skip, rows)
    return _gather_graph(head, fdata, idata, cx, cy, cz, radius, skip, rows)


@kernel
def hopeless(head, fdata, radius, capacity):
    """Whether a ball is so large that a source that goes on and on likely has more beams in it than a list holds."""
    if head[H_SOURCE] == STEADY:
        # Four beams' lengths; F_FIRST is a quarter of one.
        return radius > 16.0 * fdata[head[H_SOURCE_DATA] + steady.F_FIRST]
    if head[H_SOURCE] != PERIODIC:
        return False
    p = head[H_SOURCE_DATA]
    side = 2.0 * radius / math.sqrt(3.0)
    return (side / fdata[p] - 1.0) * (side / fdata[p + 1] - 1.0) * (side / fdata[p + 2] - 1.0) > capacity and (
        side > 2.0 * max(fdata[p], max(fdata[p + 1], fdata[p + 2]))
    )


@kernel
def _gather_periodic(head, fdata, cx, cy, cz, radius, skip, rows):
    n = 0
    p = head[H_SOURCE_DATA]
    sx, sy, sz, own = fdata[p], fdata[p + 1], fdata[p + 2], fdata[p + 3]
    reach = radius + own
    for seg in range(head[H_COUNT]):
        s = head[H_SEGMENTS] + seg * SEGMENT
        ax, ay, az, bx, by, bz = fdata[s], fdata[s + 1], fdata[s + 2], fdata[s + 3], fdata[s + 4], fdata[s + 5]
        i0 = math.ceil((cx - reach - max(ax, bx)) / sx)
        i1 = math.floor((cx + reach - min(ax, bx)) / sx)
        j0 = math.ceil((cy - reach - max(ay, by)) / sy)
        j1 = math.floor((cy + reach - min(ay, by)) / sy)
        k0 = math.ceil((cz - reach - max(az, bz)) / sz)
        k1 = math.floor((cz + reach - min(az, bz)) / sz)
        most = radius + max(fdata[s + 6], fdata[s + 7])
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    x, y, z = i * sx - cx, j * sy - cy, k * sz - cz
                    px, py, pz, qx, qy, qz = ax + x, ay + y, az + z, bx + x, by + y, bz + z
                    d = _axis_distance(px, py, pz, qx, qy, qz)
                    if d <= most:
                        if skip <= n < skip + len(rows):
                            r = fdata[s + 6], fdata[s + 7], fdata[s + 8]
                            store(rows, n - skip, px, py, pz, qx, qy, qz, r[0], r[1], r[2], seg, i, j, k, d)
                        n += 1
    return n


@kernel
def _clamped_cell(value, count):
    return int(min(max(math.floor(value), 0.0), count - 1.0))


@kernel
def _gather_graph(head, fdata, idata, cx, cy, cz, radius, skip, rows):
    n = 0
    p = head[H_SOURCE_DATA]
    ox, oy, oz, spacing, own = fdata[p], fdata[p + 1], fdata[p + 2], fdata[p + 3], fdata[p + 4]
    nx, ny, nz = head[H_NX], head[H_NY], head[H_NZ]
    reach = radius + own
    i0, i1 = _clamped_cell((cx - reach - ox) / spacing, nx), _clamped_cell((cx + reach - ox) / spacing, nx)
    j0, j1 = _clamped_cell((cy - reach - oy) / spacing, ny), _clamped_cell((cy + reach - oy) / spacing, ny)
    k0, k1 = _clamped_cell((cz - reach - oz) / spacing, nz), _clamped_cell((cz + reach - oz) / spacing, nz)
    starts = head[H_INDEX]
    entries = starts + nx * ny * nz + 1
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            for k in range(k0, k1 + 1):
                cell = (i * ny + j) * nz + k
                for e in range(idata[starts + cell], idata[starts + cell + 1]):
                    seg = idata[entries + e]
                    s = head[H_SEGMENTS] + seg * SEGMENT
                    # A segment is listed in many cells; it counts in the first one that the query visits.
                    if i != max(i0, _clamped_cell((min(fdata[s], fdata[s + 3]) - ox) / spacing, nx)):
                        continue
                    if j != max(j0, _clamped_cell((min(fdata[s + 1], fdata[s + 4]) - oy) / spacing, ny)):
                        continue
                    if k != max(k0, _clamped_cell((min(fdata[s + 2], fdata[s + 5]) - oz) / spacing, nz)):
                        continue
                    ax, ay, az = fdata[s] - cx, fdata[s + 1] - cy, fdata[s + 2] - cz
                    bx, by, bz = fdata[s + 3] - cx, fdata[s + 4] - cy, fdata[s + 5] - cz
                    d = _axis_distance(ax, ay, az, bx, by, bz)
                    if d <= radius + max(fdata[s + 6], fdata[s + 7]):
                        if skip <= n < skip + len(rows):
                            r = fdata[s + 6], fdata[s + 7], fdata[s + 8]
                            store(rows, n - skip, ax, ay, az, bx, by, bz, r[0], r[1], r[2], seg, 0, 0, 0, d)
                        n += 1
    return n


@kernel
def _gather_steady(head, fdata, idata, cx, cy, cz, radius, skip, rows):
    # 150 ns a box of indices, of which there are two or three in a straight lattice; 30 ns a beam of those that are
    # left.
    n = 0
    p, q = head[H_SOURCE_DATA], head[H_INDEX]
    stack, near = np.empty((steady.STACK, 6), np.int64), np.empty(6, np.int64)
    swept, dual, ends = np.empty(steady.SWEPT), np.empty(3), np.empty(11)
    top = steady.descend(fdata, idata, q, p, cx, cy, cz, radius, stack, steady.start(idata, q, stack), swept, dual)
    while top > 0:
        for rack in range(head[H_COUNT]):
            s, b = head[H_SEGMENTS] + SEGMENT * rack, q + steady.I_RACKS + steady.RACK * rack
            steady.rack_anchors(idata, b, stack[top - 1], swept, near)
            for i in range(near[0], near[3] + 1):
                for j in range(near[1], near[4] + 1):
                    for k in range(near[2], near[5] + 1):
                        steady.rack_ends(fdata, idata, q, s, b, i, j, k, ends)
                        ax, ay, az = ends[0] - cx, ends[1] - cy, ends[2] - cz
                        bx, by, bz = ends[3] - cx, ends[4] - cy, ends[5] - cz
                        d = _axis_distance(ax, ay, az, bx, by, bz)
                        if d <= radius + max(ends[6], ends[7]):
                            if n == skip + len(rows):
                                return n + 1
                            if n >= skip:
                                r = ends[6], ends[7], fdata[s + 8]
                                c = ends[8], ends[9], ends[10]
                                store(
                                    rows, n - skip, ax, ay, az, bx, by, bz, r[0], r[1], r[2], rack, c[0], c[1], c[2], d
                                )
                            n += 1
        top = steady.descend(fdata, idata, q, p, cx, cy, cz, radius, stack, top - 1, swept, dual)
    return n


@kernel
def _first_radius(head, fdata, cx, cy, cz):
    """A radius with which to start looking for the nearest beam, and one beyond which there is nothing new."""
    p = head[H_SOURCE_DATA]
    if head[H_SOURCE] == PERIODIC:
        sx, sy, sz = fdata[p], fdata[p + 1], fdata[p + 2]
        return 0.25 * min(sx, min(sy, sz)), 4.0 * (sx + sy + sz)
    if head[H_SOURCE] == STEADY:
        dx, dy, dz = fdata[p + steady.F_ALL] - cx, fdata[p + steady.F_ALL + 1] - cy, fdata[p + steady.F_ALL + 2] - cz
        away = math.sqrt(dx * dx + dy * dy + dz * dz)
        r = fdata[p + steady.F_ALL + 3]
        return max(away - r, fdata[p + steady.F_FIRST]), away + r
    spacing = fdata[p + 3]
    dx = max(abs(cx - fdata[p]), abs(fdata[p] + head[H_NX] * spacing - cx))
    dy = max(abs(cy - fdata[p + 1]), abs(fdata[p + 1] + head[H_NY] * spacing - cy))
    dz = max(abs(cz - fdata[p + 2]), abs(fdata[p + 2] + head[H_NZ] * spacing - cz))
    most = math.sqrt(dx * dx + dy * dy + dz * dz) + spacing
    return min(spacing, most), most


@kernel
def nearest_beam(head, fdata, idata, cx, cy, cz, precision, rows):
    """Bounds of the distance from a point to the nearest beam, thickened by its own stored radii at either end.

    `lowest` is below the distance of every beam, `upper` above that of at least one. Where more beams than `rows` hold
    are about as near, the two are apart by the part `precision` of the distance.
    """
    radius, most = _first_radius(head, fdata, cx, cy, cz)
    empty = 0.0
    n = gather(head, fdata, idata, cx, cy, cz, radius, 0, rows)
    while n == 0:
        if radius > most:
            return math.inf, math.inf
        empty = radius
        radius *= 2.0
        n = gather(head, fdata, idata, cx, cy, cz, radius, 0, rows)
    # From far away the ball may meet millions: look for one that meets few. `rows` are those of the smallest that met
    # any.
    while n > len(rows) and radius - empty > precision * radius:
        middle = 0.5 * (empty + radius)
        met = gather(head, fdata, idata, cx, cy, cz, middle, 0, rows)
        if met == 0:
            empty = middle
        else:
            radius, n = middle, met
    lowest, upper = math.inf, math.inf
    for i in range(min(n, len(rows))):
        lowest = min(lowest, rows[i, R_DISTANCE] - max(rows[i, R_RA], rows[i, R_RB]))
        upper = min(upper, rows[i, R_DISTANCE] - min(rows[i, R_RA], rows[i, R_RB]))
    if n > len(rows):
        lowest = empty if empty > 0.0 else -math.inf
    return lowest, upper


@kernel
def relevant_radius(head, fdata, idata, cx, cy, cz, half, least, reach, blend, cutoff, rows):
    """How far from the centre a beam can be that decides the distance somewhere within `half` of it.

    Args:
        half: radius of the region.
        least, reach: smallest and largest half-width of beams and nodes in the region (without what is stored in
            segments).
        blend: largest blend radius in the region.
        cutoff: values above it need not be exact, only larger than it; `inf` when all must be.
    """
    bounded = max(cutoff, blend) + reach + half
    if cutoff < math.inf and not hopeless(head, fdata, bounded, len(rows)):
        return bounded
    # A beam that is nearest somewhere in the region is no farther from the centre than the nearest one by twice `half`
    # and the spread of the widths.
    _, upper = nearest_beam(head, fdata, idata, cx, cy, cz, 0.1 if half > 0.0 else 1e-3, rows)
    wanted = max(upper + 2.0 * half + reach - least, blend + reach + half)
    # The nearest beam itself must not be lost to rounding.
    return min(bounded, wanted + 1e-9 * (abs(upper) + reach + half))
