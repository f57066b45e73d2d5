"""The ball-interference query of steady lattices in compiled code: contraction of the index brick, nothing stored.

The clusters W^k V^j U^i C0 whose indices lie in a box, and the beams between them, lie in a *swept box*

    c + a d1 + b d2 + e d3 + rest,     |a|, |b|, |e| <= 1,  |rest| <= rho,

c being the middle cluster, d1, d2, d3 how far half the box moves it along U, V, W, and rho what bending, scaling and
the size of a cluster add. It follows from the generators: with y' = A y + v the velocity of the group S^t at y, and
travel(t) = expm1(|l| t) / |l| (l the logarithm of the scale),

    |S^t y - y - t (A y + v)| <= |A| t travel(t) / 2 |A y + v|,     |(e^(tA) - 1) d| <= |A| travel(t) |d|.

Seen in the basis dual to d1, d2, d3 a query ball is an interval in each index, rho added to its radius: the box
contracts to the indices that can meet it. That is RangeFinder with the dual basis (thesis 7.3.1), made valid for
lattices that bend. Straight lattices contract to the answer in one step, others in a few: where nothing contracts, the
box is halved. Every kind of similarity, any number of turns, axes and fixed points inside the query: one rule, no lost
hits.

A beam's *anchor* is the lower of its two clusters in each index, so that beams of rack (di, dj, dk) with anchor a lie
within the clusters a .. a + |d|. Racks are packed as segments (`frep/biq_kernels.py`) whose two ends are given in
cluster (0, 0, 0).
"""

from __future__ import annotations

import math

import numpy as np

from .jit import kernel

# What `idata` holds of a lattice: first and last anchor, index of the first entry of the tables of powers, then where
# in `fdata` these tables, the tables of growth and the generators begin; largest |d| of the racks; then the racks.
I_LOW, I_HIGH, I_BASE, I_POWERS, I_GROWTH, I_GENERATOR, I_REACH, I_RACKS = 0, 3, 6, 9, 12, 15, 18, 21

RACK = 9
"""Columns of a rack in `idata`: offset (3), first anchor (3), last anchor (3)."""

POWER = 13
"""Columns of a table of powers, two entries an index (the middle of two clusters is one): matrix (9, row by row),
translation (3), scale."""

GENERATOR = 13
"""Columns of a generator: A (9, row by row), v (3), norm of A."""

# What `fdata` holds at the source data: ball round cluster (0, 0, 0), ball round the lattice, a radius to start
# searches with.
F_BALL, F_ALL, F_FIRST = 0, 4, 8

STACK = 256
"""Boxes that wait: one a halving on the way down, of which there are at most three times 64."""

SWEPT = 24
"""Numbers of a swept box: c (3), d1, d2, d3 (9), rho, radius of a ball round it, how far each direction sweeps (3);
then, once contracted, the real indices (low, high) along each direction that can meet the query (6)."""

S_RHO, S_RADIUS, S_SPREAD, S_LOW, S_HIGH = 12, 13, 14, 17, 20

LEAF = 8.0
"""Anchors a rack that are looked at one by one, rather than contracting further."""

ROUNDING = 1e-9
"""By how much, relatively, swept boxes are widened for the rounding of their own computation."""


@kernel
def placed(fdata, idata, q, i, j, k, x, y, z):
    """The point (x, y, z) of cluster (0, 0, 0) in cluster (i, j, k), and the scale there. Three matrices, about 10
    ns."""
    scale = 1.0
    for axis in range(3):
        index = i if axis == 0 else (j if axis == 1 else k)
        e = np.int64(idata[q + I_POWERS + axis]) + 2 * POWER * (index - idata[q + I_BASE + axis])
        x1 = fdata[e] * x + fdata[e + 1] * y + fdata[e + 2] * z + fdata[e + 9]
        y1 = fdata[e + 3] * x + fdata[e + 4] * y + fdata[e + 5] * z + fdata[e + 10]
        z = fdata[e + 6] * x + fdata[e + 7] * y + fdata[e + 8] * z + fdata[e + 11]
        x, y = x1, y1
        scale *= fdata[e + 12]
    return x, y, z, scale


@kernel
def sweep(fdata, idata, q, p, box, swept):
    """The swept box of all beams whose anchors lie in `box` (6: lows, highs). About 60 ns."""
    for c in range(12):
        swept[c] = fdata[p + c] if c < 3 else 0.0
    rho = fdata[p + 3]
    for axis in range(3):
        low, high = box[axis], box[3 + axis] + idata[q + I_REACH + axis]
        e = np.int64(idata[q + I_POWERS + axis]) + POWER * (low + high - 2 * idata[q + I_BASE + axis])
        g = np.int64(idata[q + I_GENERATOR + axis])
        s = np.int64(idata[q + I_GROWTH + axis]) + 2 * (high - low)
        half, grow, travel, rate = 0.5 * (high - low), fdata[s], fdata[s + 1], fdata[g + 12]
        before = 0.0
        for d in range(axis + 1):
            x, y, z = swept[3 * d], swept[3 * d + 1], swept[3 * d + 2]
            for row in range(3):
                m = e + 3 * row
                swept[3 * d + row] = fdata[m] * x + fdata[m + 1] * y + fdata[m + 2] * z
                if d == 0:
                    swept[row] += fdata[e + 9 + row]
            if d > 0:
                before += math.sqrt(swept[3 * d] ** 2 + swept[3 * d + 1] ** 2 + swept[3 * d + 2] ** 2)
        x, y, z = swept[0], swept[1], swept[2]
        wx = fdata[g] * x + fdata[g + 1] * y + fdata[g + 2] * z + fdata[g + 9]
        wy = fdata[g + 3] * x + fdata[g + 4] * y + fdata[g + 5] * z + fdata[g + 10]
        wz = fdata[g + 6] * x + fdata[g + 7] * y + fdata[g + 8] * z + fdata[g + 11]
        speed = math.sqrt(wx * wx + wy * wy + wz * wz)
        rho *= fdata[e + 12] * grow
        swept[S_SPREAD + axis] = travel * speed
        for d in range(axis):
            swept[S_SPREAD + d] *= fdata[e + 12]
        m = 3 + 3 * axis
        if rate * travel <= 1.0:
            swept[m], swept[m + 1], swept[m + 2] = half * wx, half * wy, half * wz
            rho += rate * travel * (0.5 * half * speed + before)
        else:
            # The box turns or grows too far for straight directions to tell anything.
            for d in range(3, m + 3):
                swept[d] = 0.0
            rho += travel * speed + grow * before
    ux, uy, uz, vx, vy, vz = swept[3], swept[4], swept[5], swept[6], swept[7], swept[8]
    wx, wy, wz = swept[9], swept[10], swept[11]
    square = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
    skew = abs(ux * vx + uy * vy + uz * vz) + abs(ux * wx + uy * wy + uz * wz) + abs(vx * wx + vy * wy + vz * wz)
    rho += ROUNDING * (rho + abs(swept[0]) + abs(swept[1]) + abs(swept[2]))
    swept[S_RHO] = rho
    swept[S_RADIUS] = rho + math.sqrt(square + 2.0 * skew) * (1.0 + ROUNDING)


@kernel
def _dual(swept, axis, g):
    """The direction that measures the index along `axis` and none of the others: g . d = 1.

    Returns how much of the others it measures all the same, by rounding: |g . a| + |g . b|, which is large where directions
    are all but parallel; infinity if there is no such direction.
    """
    d, a, b = 3 + 3 * axis, 3 + 3 * ((axis + 1) % 3), 3 + 3 * ((axis + 2) % 3)
    dx, dy, dz = swept[d], swept[d + 1], swept[d + 2]
    ax, ay, az, bx, by, bz = swept[a], swept[a + 1], swept[a + 2], swept[b], swept[b + 1], swept[b + 2]
    aa, bb = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
    if aa > 0.0 and bb > 0.0:
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    elif aa + bb > 0.0:
        ax, ay, az, aa = ax + bx, ay + by, az + bz, aa + bb
        t = (dx * ax + dy * ay + dz * az) / aa
        x, y, z = dx - t * ax, dy - t * ay, dz - t * az
    else:
        x, y, z = dx, dy, dz
    along = x * dx + y * dy + z * dz
    if not abs(along) > 1e-9 * math.sqrt((x * x + y * y + z * z) * (dx * dx + dy * dy + dz * dz)):
        return math.inf
    x, y, z = x / along, y / along, z / along
    g[0], g[1], g[2] = x, y, z
    ax, ay, az = swept[a], swept[a + 1], swept[a + 2]
    noise = abs(x) * (abs(ax) + abs(bx)) + abs(y) * (abs(ay) + abs(by)) + abs(z) * (abs(az) + abs(bz))
    return abs(x * ax + y * ay + z * az) + abs(x * bx + y * by + z * bz) + 1e-15 * noise


@kernel
def _contract(idata, q, box, swept, cx, cy, cz, radius, g):
    """Shrink a box of anchors to those whose beams can meet a ball; False if there are none. About 60 ns."""
    x, y, z = cx - swept[0], cy - swept[1], cz - swept[2]
    reach = radius + swept[S_RADIUS]
    if not x * x + y * y + z * z <= reach * reach:
        return False
    for axis in range(3):
        low, high = box[axis], box[3 + axis] + np.int64(idata[q + I_REACH + axis])
        swept[S_LOW + axis], swept[S_HIGH + axis] = low, high
        leak = _dual(swept, axis, g)
        if leak < 1.0:
            half, middle = 0.5 * (high - low), 0.5 * (low + high)
            t = middle + half * (g[0] * x + g[1] * y + g[2] * z)
            w = half * (math.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * (radius + swept[S_RHO]) + leak)
            w += ROUNDING * (1.0 + abs(t))
            if not (t + w >= low and t - w <= high):
                return False
            swept[S_LOW + axis], swept[S_HIGH + axis] = max(t - w, float(low)), min(t + w, float(high))
            box[axis] = max(low, np.int64(math.ceil(swept[S_LOW + axis])) - np.int64(idata[q + I_REACH + axis]))
            box[3 + axis] = min(box[3 + axis], np.int64(math.floor(swept[S_HIGH + axis])))
            if box[3 + axis] < box[axis]:
                return False
    return True


@kernel
def start(idata, q, stack):
    """Put the whole brick on the stack."""
    for axis in range(3):
        stack[0, axis] = idata[q + I_LOW + axis]
        stack[0, 3 + axis] = idata[q + I_HIGH + axis]
    return 1


@kernel
def _size(box):
    return float(box[3] - box[0] + 1) * float(box[4] - box[1] + 1) * float(box[5] - box[2] + 1)


@kernel
def _halve(stack, top, swept):
    """Replace the topmost box by its halves along the direction that sweeps farthest; returns the number of boxes."""
    box = stack[top - 1]
    split, farthest = 0, -1.0
    for axis in range(3):
        if box[3 + axis] > box[axis] and swept[S_SPREAD + axis] > farthest:
            split, farthest = axis, swept[S_SPREAD + axis]
    for c in range(6):
        stack[top, c] = box[c]
    middle = (box[split] + box[3 + split]) >> 1
    box[split] = middle + 1
    stack[top, 3 + split] = middle
    return top + 1


@kernel
def descend(fdata, idata, q, p, cx, cy, cz, radius, stack, top, swept, g):
    """Go on until the topmost box has few anchors left that can meet the ball; returns the number of boxes, 0 when
    done.

    The box is `stack[top - 1]`, its real indices are in `swept`; the caller takes it off.
    """
    while top > 0:
        box = stack[top - 1]
        before = _size(box)
        sweep(fdata, idata, q, p, box, swept)
        if not _contract(idata, q, box, swept, cx, cy, cz, radius, g):
            top -= 1
            continue
        after = _size(box)
        likely = 1.0
        for axis in range(3):
            likely *= swept[S_HIGH + axis] - swept[S_LOW + axis] + 1.0
        if after == 1.0 or likely <= LEAF:
            return top
        if after > 0.5 * before:
            top = _halve(stack, top, swept)
    return 0


@kernel
def rack_anchors(idata, b, box, swept, out):
    """The anchors of a box (6) at which the rack at `b` has beams that can meet the ball that the box was contracted
    for."""
    for axis in range(3):
        reach = abs(np.int64(idata[b + axis]))
        first = max(box[axis], np.int64(idata[b + 3 + axis]))
        last = min(box[3 + axis], np.int64(idata[b + 6 + axis]))
        out[axis] = max(first, np.int64(math.ceil(swept[S_LOW + axis])) - reach)
        out[3 + axis] = min(last, np.int64(math.floor(swept[S_HIGH + axis])))


@kernel
def rack_ends(fdata, idata, q, s, b, ai, aj, ak, ends):
    """The beam of the rack (segment at `s`, integers at `b`) with an anchor: ends[0:3], ends[3:6], their radii
    ends[6], ends[7]; the index of its start cluster in ends[8:11]. About 20 ns."""
    di, dj, dk = np.int64(idata[b]), np.int64(idata[b + 1]), np.int64(idata[b + 2])
    i, j, k = ai + max(0, -di), aj + max(0, -dj), ak + max(0, -dk)
    x, y, z, scale = placed(fdata, idata, q, i, j, k, fdata[s], fdata[s + 1], fdata[s + 2])
    ends[0], ends[1], ends[2], ends[6] = x, y, z, fdata[s + 6] * scale
    x, y, z, scale = placed(fdata, idata, q, i + di, j + dj, k + dk, fdata[s + 3], fdata[s + 4], fdata[s + 5])
    ends[3], ends[4], ends[5], ends[7] = x, y, z, fdata[s + 7] * scale
    ends[8], ends[9], ends[10] = i, j, k


@kernel
def anchors_meeting(fdata, idata, q, p, cx, cy, cz, radius, found):
    """The box of all anchors whose beams can meet a ball; False if there is none."""
    stack, swept, g = np.empty((STACK, 6), np.int64), np.empty(SWEPT), np.empty(3)
    any_found = False
    top = descend(fdata, idata, q, p, cx, cy, cz, radius, stack, start(idata, q, stack), swept, g)
    while top > 0:
        box = stack[top - 1]
        for axis in range(3):
            found[axis] = min(found[axis], box[axis]) if any_found else box[axis]
            found[3 + axis] = max(found[3 + axis], box[3 + axis]) if any_found else box[3 + axis]
        any_found = True
        top -= 1
        # What lies within the boxes found has nothing to add.
        while top > 0 and _holds(found, stack[top - 1]):
            top -= 1
        top = descend(fdata, idata, q, p, cx, cy, cz, radius, stack, top, swept, g)
    return any_found


@kernel
def _holds(outer, inner):
    for axis in range(3):
        if inner[axis] < outer[axis] or inner[3 + axis] > outer[3 + axis]:
            return False
    return True


@kernel
def extent_along(fdata, idata, q, p, dx, dy, dz, tolerance):
    """An upper bound, at most `tolerance` and one cluster's ball too large, of x . d over the lattice, d a unit vector;
    and how many boxes were looked at."""
    visited = 0
    stack, swept = np.empty((STACK, 6), np.int64), np.empty(SWEPT)
    top = start(idata, q, stack)
    least, most = -math.inf, -math.inf
    while top > 0:
        box = stack[top - 1]
        visited += 1
        for corner in range(8):
            i, j, k = box[3 * (corner & 1)], box[1 + 3 * ((corner >> 1) & 1)], box[2 + 3 * (corner >> 2)]
            x, y, z, _ = placed(fdata, idata, q, i, j, k, fdata[p], fdata[p + 1], fdata[p + 2])
            least = max(least, x * dx + y * dy + z * dz)
        sweep(fdata, idata, q, p, box, swept)
        bound = swept[0] * dx + swept[1] * dy + swept[2] * dz + swept[S_RHO]
        for axis in range(3):
            m = 3 + 3 * axis
            bound += abs(swept[m] * dx + swept[m + 1] * dy + swept[m + 2] * dz)
        size = _size(box)
        if bound <= least + tolerance or size <= 1.0:
            most = max(most, bound)
            top -= 1
            continue
        top = _halve(stack, top, swept)
    return most, visited


@kernel
def write_out(fdata, idata, q, segments, count, box, low, high, rows):
    """Fill `rows` with the segments (ends, radii, node flag) of all beams whose anchors lie in `box` and which reach
    into the box low..high;
    returns how many. About 30 ns a beam."""
    ends = np.empty(11)
    n = 0
    for rack in range(count):
        s, b = segments + 9 * rack, q + I_RACKS + RACK * rack
        for i in range(max(box[0], idata[b + 3]), min(box[3], idata[b + 6]) + 1):
            for j in range(max(box[1], idata[b + 4]), min(box[4], idata[b + 7]) + 1):
                for k in range(max(box[2], idata[b + 5]), min(box[5], idata[b + 8]) + 1):
                    rack_ends(fdata, idata, q, s, b, i, j, k, ends)
                    r = max(ends[6], ends[7])
                    near = True
                    for axis in range(3):
                        first, last = min(ends[axis], ends[3 + axis]) - r, max(ends[axis], ends[3 + axis]) + r
                        near = near and first <= high[axis] and last >= low[axis]
                    if near:
                        for c in range(8):
                            rows[n, c] = ends[c]
                        rows[n, 8] = fdata[s + 8]
                        n += 1
    return n
