"""Beams in compiled code: the distance to the beams that a ball-interference query returns.

Everything, bounds over a box as well as values on a block, is computed from the short list that `gather` returns
(`frep/biq_kernels.py`), in coordinates relative to the ball's centre, so that float32 is enough on a block.
"""

from __future__ import annotations

import math

import numpy as np

from . import steady_kernels as steady
from .biq_kernels import (
    H_BLEND,
    H_COUNT,
    H_INDEX,
    H_NODES,
    H_SECTION,
    H_SEGMENTS,
    H_SOURCE,
    H_SOURCE_DATA,
    R_DISTANCE,
    R_ID,
    R_NODE,
    ROW,
    SEGMENT,
    STEADY,
    gather,
    hopeless,
    nearest_beam,
    relevant_radius,
    store,
)
from .jit import kernel

ROUND, CONE, SQUARE = 0, 1, 2
"""Sections: circle of radius p0; cone between the node radii stored in the segment; rounded square of side p0, fillet
p1."""

SEPARABLE, CONSTANT_0, CONSTANT_2 = 1, 2, 4
"""Bits of what a tape knows of a leaf's arguments: the coordinates are those of the grid, each along its own axis; the
widths of the beams, of the nodes, are the same everywhere."""


@kernel
def beam_distance(section, r, px, py, pz, p0, p1, p_node):
    """Signed distance of one point (relative to the ball centre) to one gathered beam or node ball."""
    qx, qy, qz = px - r[0], py - r[1], pz - r[2]
    t = qx * r[3] + qy * r[4] + qz * r[5]
    length = r[6]
    if r[9] != 0.0:
        return math.sqrt(qx * qx + qy * qy + qz * qz) - (p_node + r[7])
    if section == ROUND:
        s = min(max(t, 0.0), length)
        dx, dy, dz = qx - s * r[3], qy - s * r[4], qz - s * r[5]
        return math.sqrt(dx * dx + dy * dy + dz * dz) - p0
    if section == CONE:
        square = max(qx * qx + qy * qy + qz * qz - t * t, 0.0)
        return cone_distance(math.sqrt(square), t, length, r[7], r[8])
    e2x, e2y, e2z = r[4] * r[12] - r[5] * r[11], r[5] * r[10] - r[3] * r[12], r[3] * r[11] - r[4] * r[10]
    u = abs(qx * r[10] + qy * r[11] + qz * r[12])
    v = abs(qx * e2x + qy * e2y + qz * e2z)
    return _rounded_prism(u, v, abs(t - 0.5 * length) - 0.5 * length, 0.5 * p0, p1)


@kernel
def cone_distance(radial, t, length, ra, rb):
    """Exact distance to the sphere-swept cone (lf-rep O5), in the half plane of the axis."""
    if abs(ra - rb) >= length:
        # One end ball holds the other.
        if ra >= rb:
            return math.sqrt(radial * radial + t * t) - ra
        return math.sqrt(radial * radial + (t - length) * (t - length)) - rb
    s = (ra - rb) / length
    c = math.sqrt(1.0 - s * s)
    along = t * c - radial * s
    if along < 0.0:
        return math.sqrt(radial * radial + t * t) - ra
    if along > length * c:
        return math.sqrt(radial * radial + (t - length) * (t - length)) - rb
    return radial * c + t * s - ra


@kernel
def _rounded_prism(u, v, w, half_side, fillet):
    """Exact distance to a rounded square (lf-rep 3.2) extruded between flat ends; `w` is the distance past the end."""
    f = min(fillet, half_side)
    a, b = u - half_side + f, v - half_side + f
    x, y = max(a, 0.0), max(b, 0.0)
    d = math.sqrt(x * x + y * y) + min(max(a, b), 0.0) - f
    x, y = max(d, 0.0), max(w, 0.0)
    return math.sqrt(x * x + y * y) + min(max(d, w), 0.0)


@kernel
def half_width(section, p0):
    """Largest distance of the section's outline from the axis, for a circle's radius or a square's side."""
    if section == ROUND:
        return p0
    if section == CONE:
        return 0.0
    return 0.7071067811865476 * p0


@kernel
def _least_half_width(section, p0, p_node, has_nodes):
    if section == SQUARE:
        # The flat end of a square beam passes through its node.
        return 0.0
    least = p0 if section == ROUND else 0.0
    return min(least, p_node) if has_nodes else least


@kernel
def beams_interval(head, fdata, idata, box, params_lo, params_hi, cutoff, rows):
    """Bounds of the skeleton's distance over a box of lattice space.

    Args:
        box: (6,) lo and hi of the three coordinates.
        params_lo, params_hi: (4,) bounds of p0, p1, node radius, blend.
    """
    section = head[H_SECTION]
    is_blended = head[H_BLEND] != 0
    half_x, half_y, half_z = 0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2])
    half = math.sqrt(half_x * half_x + half_y * half_y + half_z * half_z)
    if not half < math.inf:
        return -math.inf, math.inf
    cx, cy, cz = box[0] + half_x, box[1] + half_y, box[2] + half_z
    reach = max(half_width(section, params_hi[0]), params_hi[2])
    least = _least_half_width(section, params_lo[0], params_lo[2], head[H_NODES])
    blend = params_hi[3] if is_blended else 0.0
    if not (reach < math.inf and blend < math.inf):
        return -math.inf, math.inf
    radius = relevant_radius(head, fdata, idata, cx, cy, cz, half, least, reach, blend, cutoff, rows)
    n = len(rows) + 1
    if not hopeless(head, fdata, radius, len(rows)):
        n = gather(head, fdata, idata, cx, cy, cz, radius, 0, rows)
    if n > len(rows):
        lowest, upper = nearest_beam(head, fdata, idata, cx, cy, cz, 0.1, rows)
        lo, hi = lowest - reach - half, upper - least + half
        return (-math.inf if lo < blend else lo), hi
    if n == 0:
        return cutoff, math.inf
    lo, hi = math.inf, math.inf
    touching = 0
    for i in range(n):
        if section == ROUND:
            widest, thinnest = (params_hi[2], params_lo[2]) if rows[i, R_NODE] != 0.0 else (params_hi[0], params_lo[0])
            near, far = rows[i, R_DISTANCE] - widest - half, rows[i, R_DISTANCE] - thinnest + half
        else:
            # Wider sections and smaller fillets are nearer.
            near = beam_distance(section, rows[i], 0.0, 0.0, 0.0, params_hi[0], params_lo[1], params_hi[2]) - half
            far = beam_distance(section, rows[i], 0.0, 0.0, 0.0, params_lo[0], params_hi[1], params_lo[2]) + half
        lo, hi = min(lo, near), min(hi, far)
        if near < blend:
            touching += 1
    lo = min(lo, cutoff)
    if is_blended and lo < blend and touching > 1:
        lo -= (math.sqrt(touching) - 1.0) * (blend - lo)
    return lo, hi


@kernel
def largest(a, sign, n, fold):
    """Largest of sign * a[:n], by folding halves on each other: vector operations, where a running maximum is a chain.

    A NaN survives, and the caller evaluates point by point.
    """
    for i in range(n):
        fold[i] = sign * a[i]
    while n > 1:
        half = n // 2
        rest = n - half
        for i in range(half):
            u, v = fold[i], fold[i + rest]
            fold[i] = u if (u > v or u != u) else v
        n = rest
    return fold[0]


@kernel
def beams_block(head, fdata, idata, x, y, z, p0, p1, p2, p3, n, known, cutoff, rows, local, out):
    """Distance to the skeleton at n <= 512 points.

    x, y, z: coordinates in lattice space; p0..p3: the parameters, arrays like x. `known` tells what the tape knows of
        them, see
    `frep/tape.py`. `local` is scratch (4, n) of the same type.
    Cost: 0.2 to 0.4 ns a point and beam in float32, plus the query, about 1 us a block.
    """
    fold = local[0]
    if known & SEPARABLE:
        x0, x1 = min(x[0], x[448]), max(x[0], x[448])
        y0, y1 = min(y[0], y[56]), max(y[0], y[56])
        z0, z1 = min(z[0], z[7]), max(z[0], z[7])
    else:
        x0, x1 = -largest(x, -1, n, fold), largest(x, 1, n, fold)
        y0, y1 = -largest(y, -1, n, fold), largest(y, 1, n, fold)
        z0, z1 = -largest(z, -1, n, fold), largest(z, 1, n, fold)
    # The centre is a number of the coordinates' own type, so that differences from it are exact and stay in that type.
    mx, my, mz = x0 + (x1 - x0) / 2, y0 + (y1 - y0) / 2, z0 + (z1 - z0) / 2
    local[1, 0], local[1, 1], local[1, 2] = mx, my, mz
    mx, my, mz = local[1, 0], local[1, 1], local[1, 2]
    x0, x1, y0, y1 = np.float64(x0), np.float64(x1), np.float64(y0), np.float64(y1)
    z0, z1 = np.float64(z0), np.float64(z1)
    q0 = l0 = np.float64(p0[0])
    if not known & CONSTANT_0:
        q0, l0 = np.float64(largest(p0, 1, n, fold)), -np.float64(largest(p0, -1, n, fold))
    q2 = l2 = np.float64(p2[0])
    if not known & CONSTANT_2:
        q2, l2 = np.float64(largest(p2, 1, n, fold)), -np.float64(largest(p2, -1, n, fold))
    q3 = np.float64(largest(p3, 1, n, fold)) if head[H_BLEND] else 0.0
    section = head[H_SECTION]
    cx, cy, cz = np.float64(mx), np.float64(my), np.float64(mz)
    dx, dy, dz = max(x1 - cx, cx - x0), max(y1 - cy, cy - y0), max(z1 - cz, cz - z0)
    half = math.sqrt(dx * dx + dy * dy + dz * dz)
    reach = max(half_width(section, q0), q2)
    least = _least_half_width(section, l0, l2, head[H_NODES])
    blend = q3 if head[H_BLEND] else 0.0
    count = len(rows) + 1
    if half < math.inf and reach < math.inf and blend < math.inf:
        radius = relevant_radius(head, fdata, idata, cx, cy, cz, half, least, reach, blend, cutoff, rows)
        if not hopeless(head, fdata, radius, len(rows)):
            count = gather(head, fdata, idata, cx, cy, cz, radius, 0, rows)
    if count > len(rows):
        _point_by_point(head, fdata, idata, x, y, z, p0, p1, p2, p3, n, cutoff, rows, out)
        return
    if count == 0:
        far = min(cutoff, 1e30)
        for i in range(n):
            out[i] = far
        return
    lx, ly, lz, total = local[0], local[1], local[2], local[3]
    for i in range(n):
        lx[i] = x[i] - mx
        ly[i] = y[i] - my
        lz[i] = z[i] - mz
    if section == ROUND and not head[H_BLEND]:
        _round_hard(rows, count, lx, ly, lz, p0, p2, n, total, out)
    else:
        _general(head, rows, count, lx, ly, lz, p0, p1, p2, p3, n, total, out)


@kernel
def _round_hard(rows, count, lx, ly, lz, p0, p2, n, best, out):
    # Smallest squared axis distance first, one root at the end. 12 flops a point and beam.
    for i in range(n):
        best[i] = 1e30
        out[i] = 1e30
    one = np.empty(7, lx.dtype)
    nodes = 0
    for b in range(count):
        for c in range(7):
            one[c] = rows[b, c]
        ax, ay, az, ux, uy, uz, length = one[0], one[1], one[2], one[3], one[4], one[5], one[6]
        zero = length - length
        if rows[b, R_NODE] != 0.0:
            nodes += 1
            for i in range(n):
                qx, qy, qz = lx[i] - ax, ly[i] - ay, lz[i] - az
                out[i] = min(out[i], qx * qx + qy * qy + qz * qz)
        else:
            for i in range(n):
                qx, qy, qz = lx[i] - ax, ly[i] - ay, lz[i] - az
                t = min(max(qx * ux + qy * uy + qz * uz, zero), length)
                qx, qy, qz = qx - t * ux, qy - t * uy, qz - t * uz
                best[i] = min(best[i], qx * qx + qy * qy + qz * qz)
    if nodes:
        for i in range(n):
            out[i] = min(np.sqrt(best[i]) - p0[i], np.sqrt(out[i]) - p2[i])
    else:
        for i in range(n):
            out[i] = np.sqrt(best[i]) - p0[i]


@kernel
def _general(head, rows, count, lx, ly, lz, p0, p1, p2, p3, n, total, out):
    """Any section, hard or blended.

    The blend is the n-ary round union: with v_i the distances and k the radius, k - |max(k - v_i, 0)| where min v < k.
    It is symmetric in the beams, exact where only one is within k, and leaves a circular fillet of radius k between two
    surfaces that meet at a right angle.
    """
    section = head[H_SECTION]
    blended = head[H_BLEND] != 0
    row = np.empty(ROW, lx.dtype)
    zero = lx[0] - lx[0]
    half_one = zero + np.float32(0.5)
    for i in range(n):
        out[i] = 1e30
        total[i] = zero
    for b in range(count):
        for c in range(R_ID):
            row[c] = rows[b, c]
        ax, ay, az, ux, uy, uz, length, ra, rb = row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8]
        fx, fy, fz = row[10], row[11], row[12]
        gx, gy, gz = uy * fz - uz * fy, uz * fx - ux * fz, ux * fy - uy * fx
        node = rows[b, R_NODE] != 0.0
        # cone constants
        slope = zero
        if length > zero:
            slope = (ra - rb) / length
        inside_cone = abs(slope) < 1.0 and length > zero
        cosine = np.sqrt(max(zero + np.float32(1.0) - slope * slope, zero))
        for i in range(n):
            qx, qy, qz = lx[i] - ax, ly[i] - ay, lz[i] - az
            t = qx * ux + qy * uy + qz * uz
            square = qx * qx + qy * qy + qz * qz
            if node:
                v = np.sqrt(square) - (p2[i] + ra)
            elif section == ROUND:
                s = min(max(t, zero), length)
                qx, qy, qz = qx - s * ux, qy - s * uy, qz - s * uz
                v = np.sqrt(qx * qx + qy * qy + qz * qz) - p0[i]
            elif section == CONE:
                wx, wy, wz = qx - t * ux, qy - t * uy, qz - t * uz
                radial = np.sqrt(wx * wx + wy * wy + wz * wz)
                past = t - length
                at_a = np.sqrt(square) - ra
                at_b = np.sqrt(radial * radial + past * past) - rb
                along = t * cosine - radial * slope
                v = radial * cosine + t * slope - ra
                v = at_a if along < zero else v
                v = at_b if along > length * cosine else v
                if not inside_cone:
                    v = at_a if ra >= rb else at_b
            else:
                hs = half_one * p0[i]
                f = min(p1[i], hs)
                u = abs(qx * fx + qy * fy + qz * fz) - hs + f
                w = abs(qx * gx + qy * gy + qz * gz) - hs + f
                e = abs(t - half_one * length) - half_one * length
                x1, y1 = max(u, zero), max(w, zero)
                d = np.sqrt(x1 * x1 + y1 * y1) + min(max(u, w), zero) - f
                x1, y1 = max(d, zero), max(e, zero)
                v = np.sqrt(x1 * x1 + y1 * y1) + min(max(d, e), zero)
            out[i] = min(out[i], v)
            if blended:
                k = max(p3[i] - v, zero)
                total[i] += k * k
    if blended:
        for i in range(n):
            out[i] = p3[i] - np.sqrt(total[i]) if out[i] < p3[i] else out[i]


@kernel
def _nearest_value(head, fdata, idata, x, y, z, p0, p1, p_node, radius, reach, best):
    """The least distance to the beams of a steady source: what is nearer than the nearest so far is all that is looked
    for."""
    p, q, section = head[H_SOURCE_DATA], head[H_INDEX], head[H_SECTION]
    stack, near = np.empty((steady.STACK, 6), np.int64), np.empty(6, np.int64)
    swept, dual, ends, row = np.empty(steady.SWEPT), np.empty(3), np.empty(11), np.empty((1, ROW))
    top = steady.descend(fdata, idata, q, p, x, y, z, radius, stack, steady.start(idata, q, stack), swept, dual)
    while top > 0:
        for rack in range(head[H_COUNT]):
            s, b = head[H_SEGMENTS] + SEGMENT * rack, q + steady.I_RACKS + steady.RACK * rack
            steady.rack_anchors(idata, b, stack[top - 1], swept, near)
            for i in range(near[0], near[3] + 1):
                for j in range(near[1], near[4] + 1):
                    for k in range(near[2], near[5] + 1):
                        steady.rack_ends(fdata, idata, q, s, b, i, j, k, ends)
                        ax, ay, az = ends[0] - x, ends[1] - y, ends[2] - z
                        bx, by, bz = ends[3] - x, ends[4] - y, ends[5] - z
                        r = ends[6], ends[7], fdata[s + 8]
                        store(row, 0, ax, ay, az, bx, by, bz, r[0], r[1], r[2], 0, 0, 0, 0, 0.0)
                        best = min(best, beam_distance(section, row[0], 0.0, 0.0, 0.0, p0, p1, p_node))
        radius = min(radius, max(best + reach, 0.0))
        top = steady.descend(fdata, idata, q, p, x, y, z, radius, stack, top - 1, swept, dual)
    return best


@kernel
def _point_by_point(head, fdata, idata, x, y, z, p0, p1, p2, p3, n, cutoff, rows, out):
    section = head[H_SECTION]
    for i in range(n):
        px, py, pz = np.float64(x[i]), np.float64(y[i]), np.float64(z[i])
        q0, q1, q2, q3 = np.float64(p0[i]), np.float64(p1[i]), np.float64(p2[i]), np.float64(p3[i])
        blend = q3 if head[H_BLEND] else 0.0
        reach = max(half_width(section, q0), q2)
        if not (px - px == 0.0 and py - py == 0.0 and pz - pz == 0.0 and reach - reach == 0.0 and blend - blend == 0.0):
            out[i] = math.nan
            continue
        least = _least_half_width(section, q0, q2, head[H_NODES])
        radius = relevant_radius(head, fdata, idata, px, py, pz, 0.0, least, reach, blend, cutoff, rows)
        best, total = min(cutoff, 1e30), 0.0
        if head[H_SOURCE] == STEADY:
            best = _nearest_value(head, fdata, idata, px, py, pz, q0, q1, q2, radius, reach, best)
            if not best < blend:
                out[i] = best
                continue
            radius = blend + reach
        # However many beams there are, they come in pages of what the list holds.
        skip, m = 0, 1
        while skip < m:
            m = gather(head, fdata, idata, px, py, pz, radius, skip, rows)
            for b in range(min(m - skip, len(rows))):
                v = beam_distance(section, rows[b], 0.0, 0.0, 0.0, q0, q1, q2)
                best = min(best, v)
                k = max(blend - v, 0.0)
                total += k * k
            skip += len(rows)
        out[i] = blend - math.sqrt(total) if head[H_BLEND] and best < blend else best
