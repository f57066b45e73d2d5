"""Kernels of RangeFinder: which beams of a steady pattern W^k V^j U^i meet a ball, without a list of beams.

A row S^k T of one beam T is searched through coordinates in which S is a shift by one: height along the axis, or the
logarithm of the distance to the fixed point (together with the azimuth round the axis, if S turns). The extents of beam and
ball in them bound k; every turn of the azimuth is looked at. Bounds are widened by more than rounding can do, and each index
left is tested exactly, with the ball pulled back to the first beam. See `frep/rangefinder.py` for what is packed where.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from . import steady_kernels as steady
from .jit import kernel, parallel_kernel

# How a lattice is searched, and what is asked of the beams met.
NAIVE, ROWS, SHEETS, BOXES, DESCENT = 0, 1, 2, 3, 4
ALL, ANY, NEAREST = 0, 1, 2

# Coordinates of one direction (float64): what changes by one with each step.
C_LINEAR, C_VECTOR, C_STEP, C_TURN, C_POINT, C_FRAME, C_SLACK, C_NORM, COORDINATES = 0, 1, 4, 5, 6, 9, 18, 20, 21
NOTHING, HEIGHT, SHELL = 0.0, 1.0, 2.0

# Where orbits lie (float64): the surface swept by all steps, for throwing out whole rows.
O_CLASS, O_POINT, O_FRAME, O_SLACK, O_RANGE, O_SWAY, O_CLIMB, ORBIT = 0, 1, 4, 13, 15, 17, 18, 19
STILL, LINE, PLANE, HELIX, CONE, ANYWHERE = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0

# A similarity as a one-parameter group (float64): log scale, angle, frame (e1, e2, axis), velocity in that frame.
S_LOG, S_ANGLE, S_FRAME, S_VELOCITY, GROUP = 0, 1, 2, 11, 14

# A cone-beam prepared for distances: first centre, unit axis, length, sine and cosine of the taper, two radii.
G_START, G_AXIS, G_LENGTH, G_SIN, G_COS, G_RADIUS, BEAM = 0, 3, 6, 7, 8, 9, 11

SEGMENT = 9  # columns of a rack among the packed floats: two ends, two radii, one unused

_PAD = 1e-10  # mm per mm of the coordinates: more than the rounding of any position here
_WIDEN = 1e-9  # steps


class Lattice(NamedTuple):
    """What the kernels read of a lattice: templates, and powers of the two inner directions."""

    racks: np.ndarray  # (m, 5) int64
    start: np.ndarray  # (3,) int64
    span: np.ndarray  # (3,) int64, how many clusters
    balls: np.ndarray  # (nu, n, 4): U^i of the nodes, centre and radius
    hubs: np.ndarray  # (nu, 4): U^i of the cluster's centre, and how far its beams reach, for rows
    sheet_hubs: np.ndarray  # (nu, 4): the same, for sheets
    v_powers: np.ndarray  # (nv, 13): V^j row by row, and its scale
    v_local: np.ndarray  # (nv, 13): the same, in the frame of W's orbits
    steps: np.ndarray  # (m, 13): W^dk
    sheet_steps: np.ndarray  # (m, 13): W^dk V^dj
    orbit: np.ndarray  # (ORBIT,) of W
    sheet_orbit: np.ndarray  # (ORBIT,) of V and W together
    coordinates: np.ndarray  # (2, COORDINATES) of V and W; for rows W's own
    groups: np.ndarray  # (2, GROUP) of V and W
    dual: np.ndarray  # (3, 4): dual vector of each translation, and its length
    translations: np.ndarray  # (3, 3)
    templates: np.ndarray  # (m, BEAM + 6): prepared beams and their extents along the dual vectors
    size: float  # mm, how large coordinates get
    fdata: np.ndarray  # the packed lattice of `frep/steady_kernels.py`,
    idata: np.ndarray  # for the descent of its index brick,
    tree: np.ndarray  # and where in these it and its racks begin


# --- beams ---------------------------------------------------------------------------------------------------------------


@kernel
def prepare(ax, ay, az, ra, bx, by, bz, rb, g):
    # About 15 ns. A ball that holds the other is the whole beam: its axis has no length then.
    dx, dy, dz = bx - ax, by - ay, bz - az
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length <= abs(ra - rb):
        if rb > ra:
            ax, ay, az, ra = bx, by, bz, rb
        g[0], g[1], g[2] = ax, ay, az
        g[3], g[4], g[5] = 0.0, 0.0, 0.0
        g[6], g[7], g[8], g[9], g[10] = 0.0, 0.0, 1.0, ra, ra
        return
    f = 1.0 / length
    s = (ra - rb) * f
    g[0], g[1], g[2] = ax, ay, az
    g[3], g[4], g[5] = dx * f, dy * f, dz * f
    g[6], g[7], g[8], g[9], g[10] = length, s, np.sqrt(1.0 - s * s), ra, rb


@kernel
def gap(x, y, z, g):
    # Signed distance to a cone-beam (section 2.1 of the thesis notes): 5 ns.
    dx, dy, dz = x - g[0], y - g[1], z - g[2]
    t = dx * g[3] + dy * g[4] + dz * g[5]
    dx -= t * g[3]
    dy -= t * g[4]
    dz -= t * g[5]
    h = np.sqrt(dx * dx + dy * dy + dz * dz)
    along = t * g[8] - h * g[7]
    if along <= 0.0:
        return np.sqrt(t * t + h * h) - g[9]
    if along >= g[6] * g[8]:
        t -= g[6]
        return np.sqrt(t * t + h * h) - g[10]
    return t * g[7] + h * g[8] - g[9]


@kernel
def _shadow_gap(ax, ay, ra, bx, by, rb):
    # Signed distance of the origin to the hull of two disks.
    dx, dy = bx - ax, by - ay
    length = np.sqrt(dx * dx + dy * dy)
    if length <= abs(ra - rb):
        return min(np.sqrt(ax * ax + ay * ay) - ra, np.sqrt(bx * bx + by * by) - rb)
    s = (ra - rb) / length
    c = np.sqrt(1.0 - s * s)
    t = -(ax * dx + ay * dy) / length
    h = abs(ax * dy - ay * dx) / length
    along = t * c - h * s
    if along <= 0.0:
        return np.sqrt(t * t + h * h) - ra
    if along >= length * c:
        return np.sqrt((t - length) ** 2 + h * h) - rb
    return t * s + h * c - ra


@kernel
def _image(m, x, y, z):
    return (
        m[0] * x + m[1] * y + m[2] * z + m[3],
        m[4] * x + m[5] * y + m[6] * z + m[7],
        m[8] * x + m[9] * y + m[10] * z + m[11],
    )


@kernel
def moved(s, t, x, y, z):
    # S^t of a point, and the scale of S^t: e^(tA) x + t phi(tA) v in the frame of the axis. 5 ns a translation, 60 ns else.
    ell, angle = s[S_LOG], s[S_ANGLE]
    e = s[S_FRAME : S_FRAME + 9]
    v = s[S_VELOCITY : S_VELOCITY + 3]
    if ell == 0.0 and angle == 0.0:
        p, q, h = t * v[0], t * v[1], t * v[2]
        return (
            x + p * e[0] + q * e[3] + h * e[6],
            y + p * e[1] + q * e[4] + h * e[7],
            z + p * e[2] + q * e[5] + h * e[8],
            1.0,
        )
    grow = np.exp(ell * t)
    turn = angle * t
    c, sn = np.cos(turn), np.sin(turn)
    more = np.expm1(ell * t)
    half = np.sin(0.5 * turn)
    # (e^(lambda t) - 1) / lambda, axial and planar
    lift = more / ell if ell != 0.0 else t
    re, im = more * c - 2.0 * half * half, grow * sn
    f = 1.0 / (ell * ell + angle * angle)
    re, im = (re * ell + im * angle) * f, (im * ell - re * angle) * f
    p = x * e[0] + y * e[1] + z * e[2]
    q = x * e[3] + y * e[4] + z * e[5]
    h = x * e[6] + y * e[7] + z * e[8]
    p, q = grow * (p * c - q * sn) + re * v[0] - im * v[1], grow * (p * sn + q * c) + re * v[1] + im * v[0]
    h = grow * h + lift * v[2]
    return (
        p * e[0] + q * e[3] + h * e[6],
        p * e[1] + q * e[4] + h * e[7],
        p * e[2] + q * e[5] + h * e[8],
        grow,
    )


# --- extents and ranges --------------------------------------------------------------------------------------------------


@kernel
def ball_extent(c, x, y, z, r, e):
    # Of the query, once a query: linear low, high; azimuth, half width (2 pi: all round).
    e[0], e[1], e[2], e[3] = -np.inf, np.inf, 0.0, 7.0
    if c[0] == HEIGHT:
        h = c[1] * x + c[2] * y + c[3] * z
        e[0], e[1] = h - r * c[C_NORM], h + r * c[C_NORM]
    elif c[0] == SHELL:
        d = np.sqrt((x - c[1]) ** 2 + (y - c[2]) ** 2 + (z - c[3]) ** 2)
        e[0] = np.log(d - r) if d > r else -np.inf
        e[1] = np.log(d + r + 1e-300)
    if c[C_TURN] != 0.0:
        dx, dy, dz = x - c[6], y - c[7], z - c[8]
        p = dx * c[9] + dy * c[10] + dz * c[11]
        q = dx * c[12] + dy * c[13] + dz * c[14]
        rho = np.sqrt(p * p + q * q)
        e[2] = np.arctan2(q, p)
        e[3] = np.arcsin(r / rho) if rho > r else 7.0


@kernel
def beam_window(c, e, g, pad, low, high):
    # The k of [low, high] for which S^k of the beam may meet the ball of extent e, as (a, b, y0, y1, period): a <= k <= b and,
    # for some whole w, y0 <= k - w period <= y1. 5 ns a height, 30 ns a shell, 100 ns more with an azimuth.
    length = g[6]
    ra, rb = g[9] + pad, g[10] + pad
    if c[C_SLACK + 1] > 0.0 or c[C_SLACK] > 0.0:
        far = np.sqrt((g[0] - c[6]) ** 2 + (g[1] - c[7]) ** 2 + (g[2] - c[8]) ** 2)
        slack = c[C_SLACK] + c[C_SLACK + 1] * (far + length + ra + rb)
        ra += slack
        rb += slack
    bx, by, bz = g[0] + length * g[3], g[1] + length * g[4], g[2] + length * g[5]
    a, b = float(low), float(high)
    if c[0] == HEIGHT:
        ha = c[1] * g[0] + c[2] * g[1] + c[3] * g[2]
        hb = c[1] * bx + c[2] * by + c[3] * bz
        norm = c[C_NORM]
        a = max(a, np.ceil(e[0] - max(ha + ra * norm, hb + rb * norm) - _WIDEN))
        b = min(b, np.floor(e[1] - min(ha - ra * norm, hb - rb * norm) + _WIDEN))
    elif c[0] == SHELL:
        da = np.sqrt((g[0] - c[1]) ** 2 + (g[1] - c[2]) ** 2 + (g[2] - c[3]) ** 2)
        db = np.sqrt((bx - c[1]) ** 2 + (by - c[2]) ** 2 + (bz - c[3]) ** 2)
        near = gap(c[1], c[2], c[3], g) - (ra - g[9])
        first = e[0] - np.log(max(da + ra, db + rb) + 1e-300)
        last = e[1] - np.log(near) if near > 0.0 else np.inf
        f = 1.0 / c[C_STEP]
        if f < 0.0:
            first, last = last, first
        wide = _WIDEN + 1e-14 * abs(f)
        a = max(a, np.ceil(first * f - wide))
        b = min(b, np.floor(last * f + wide))
    if not a <= b:  # before they become integers, which hold no infinity
        return 1, 0, -np.inf, np.inf, 0.0
    turn = c[C_TURN]
    if turn == 0.0 or e[3] > 6.0:
        return int(a), int(b), -np.inf, np.inf, 0.0
    dx, dy, dz = g[0] - c[6], g[1] - c[7], g[2] - c[8]
    ap = dx * c[9] + dy * c[10] + dz * c[11]
    aq = dx * c[12] + dy * c[13] + dz * c[14]
    bp = ap + length * (g[3] * c[9] + g[4] * c[10] + g[5] * c[11])
    bq = aq + length * (g[3] * c[12] + g[4] * c[13] + g[5] * c[14])
    if _shadow_gap(ap, aq, ra, bp, bq, rb) <= 0.0:  # the axis meets the beam
        return int(a), int(b), -np.inf, np.inf, 0.0
    ha = np.arcsin(min(1.0, ra / np.sqrt(ap * ap + aq * aq)))
    hb = np.arcsin(min(1.0, rb / np.sqrt(bp * bp + bq * bq)))
    sweep = np.arctan2(ap * bq - aq * bp, ap * bp + aq * bq)
    offset = e[2] - np.arctan2(aq, ap)
    y0 = (offset - e[3] - max(ha, sweep + hb)) / turn
    y1 = (offset + e[3] - min(-ha, sweep - hb)) / turn
    wide = _WIDEN + 1e-13 / abs(turn)
    return int(a), int(b), min(y0, y1) - wide, max(y0, y1) + wide, 2.0 * np.pi / abs(turn)


@kernel
def wraps(a, b, y0, y1, period):
    # The whole turns that can meet [a, b] (RangeFinder 7.3, corrected: all of them).
    if period == 0.0:
        return 0, 0
    return int(np.ceil((a - y1) / period)), int(np.floor((b - y0) / period))


@kernel
def turn_range(a, b, y0, y1, period, w):
    low = max(float(a), np.ceil(y0 + w * period))
    high = min(float(b), np.floor(y1 + w * period))
    return int(low), int(high)


@kernel
def row_of_beam(c, e, g, pad, low, high, out):
    # All ranges of one row, ascending and disjoint; their number (which may exceed what `out` holds).
    a, b, y0, y1, period = beam_window(c, e, g, pad, low, high)
    n = 0
    if a > b:
        return n
    w0, w1 = wraps(a, b, y0, y1, period)
    last = a - 1
    for w in range(w0, w1 + 1):
        k0, k1 = turn_range(a, b, y0, y1, period, w)
        k0 = max(k0, last + 1)
        if k0 > k1:
            continue
        if n > 0 and k0 == last + 1 and n <= len(out):
            out[n - 1, 1] = k1
        else:
            if n < len(out):
                out[n, 0], out[n, 1] = k0, k1
            n += 1
        last = k1
    return n


# --- whole orbits --------------------------------------------------------------------------------------------------------


@kernel
def _misses(o, y0, y1, y2, reach, q0, q1, q2, q_rho, q_far, r):
    # Whether no step of the ball (y, reach) can meet the ball (q, r); both in the frame of the orbits. 2 to 8 ns.
    kind = o[O_CLASS]
    if kind == ANYWHERE:
        return False
    if o[O_SLACK + 1] > 0.0 or o[O_SLACK] > 0.0:
        reach += o[O_SLACK] + o[O_SLACK + 1] * (np.sqrt(y0 * y0 + y1 * y1 + y2 * y2) + reach)
    both = reach + r
    if kind == LINE:
        return (y0 - q0) ** 2 + (y1 - q1) ** 2 > both * both
    if kind == PLANE:
        return abs(y2 - q2) > both
    if kind == STILL:
        return (y0 - q0) ** 2 + (y1 - q1) ** 2 + (y2 - q2) ** 2 > both * both
    rho = np.sqrt(y0 * y0 + y1 * y1)
    if kind == HELIX:
        if abs(rho - q_rho) > both:
            return True
        return y2 + o[O_RANGE + 1] + both < q2 or y2 + o[O_RANGE] - both > q2
    # A cone of apex 0: in the half plane through the axis the images of a disk sweep a wedge.
    far2 = rho * rho + y2 * y2
    far = np.sqrt(far2)
    if o[O_RANGE] * (far - reach) > q_far + r or o[O_RANGE + 1] * (far + reach) < q_far - r:
        return True
    if reach >= far:
        return False
    across = abs(q_rho * y2 - q2 * rho)
    return across * np.sqrt(far2 - reach * reach) - (q_rho * rho + q2 * y2) * reach > r * far2


@kernel
def _local(o, x, y, z):
    dx, dy, dz = x - o[1], y - o[2], z - o[3]
    return (
        dx * o[4] + dy * o[5] + dz * o[6],
        dx * o[7] + dy * o[8] + dz * o[9],
        dx * o[10] + dy * o[11] + dz * o[12],
    )


@kernel
def _keep(mode, n, i, j, k, b, d, cells, gaps):
    at = 0 if mode == NEAREST else n
    if at < len(cells):
        cells[at, 0], cells[at, 1], cells[at, 2], cells[at, 3] = i, j, k, b
        gaps[at] = d
    return n + 1


# --- four ways to search a lattice ---------------------------------------------------------------------------------------
# Each takes one ball, writes what fits of the beams met and their distances, and returns how many they are. `ANY` ends at the
# first; `NEAREST` draws the ball in to the nearest beam so far, which stands in the first row.


@kernel
def _naive(lat, x, y, z, r, mode, cells, gaps):
    # Every beam, each by a step from the one before: about 25 ns a beam.
    g = np.empty(BEAM)
    n = 0
    w, s = lat.steps[len(lat.racks)], lat.steps[len(lat.racks), 12]
    for i in range(lat.span[0]):
        for j in range(lat.span[1]):
            for b in range(len(lat.racks)):
                i2, j2 = i + lat.racks[b, 2], j + lat.racks[b, 3]
                dk = lat.racks[b, 4]
                if i2 < 0 or j2 < 0 or i2 >= lat.span[0] or j2 >= lat.span[1]:
                    continue
                p, q = lat.balls[i, lat.racks[b, 0]], lat.balls[i2, lat.racks[b, 1]]
                ra, rb = p[3] * lat.v_powers[j, 12], q[3] * lat.v_powers[j2, 12] * lat.steps[b, 12]
                ax, ay, az = _image(lat.v_powers[j], p[0], p[1], p[2])
                bx, by, bz = _image(lat.v_powers[j2], q[0], q[1], q[2])
                bx, by, bz = _image(lat.steps[b], bx, by, bz)
                first = lat.start[2] + max(0, -dk)
                ax, ay, az, grow = moved(lat.groups[1], float(first), ax, ay, az)
                bx, by, bz, grow = moved(lat.groups[1], float(first), bx, by, bz)
                ra *= grow
                rb *= grow
                for k in range(first, lat.start[2] + lat.span[2] - max(0, dk)):
                    prepare(ax, ay, az, ra, bx, by, bz, rb, g)
                    d = gap(x, y, z, g)
                    if d <= r:
                        n = _keep(mode, n, i + lat.start[0], j + lat.start[1], k, b, d, cells, gaps)
                        if mode == ANY:
                            return n
                        if mode == NEAREST:
                            r = d
                    ax, ay, az = _image(w, ax, ay, az)
                    bx, by, bz = _image(w, bx, by, bz)
                    ra *= s
                    rb *= s
    return n


@kernel
def _rows(lat, x, y, z, r, mode, cells, gaps):
    # O(nu nv): rows along W. A row that cannot meet the ball costs the orbit test alone.
    g, e = np.empty(BEAM), np.empty(4)
    c, o, group = lat.coordinates[1], lat.orbit, lat.groups[1]
    pad = _PAD * (lat.size + abs(x) + abs(y) + abs(z))
    ball_extent(c, x, y, z, max(r, 0.0) + pad, e)
    q0, q1, q2 = _local(o, x, y, z)
    q_rho = np.sqrt(q0 * q0 + q1 * q1)
    q_far = np.sqrt(q_rho * q_rho + q2 * q2)
    wide = max(r, 0.0) + pad
    # What W^dk adds to the reach of a cluster: nothing across a line; a sway in proportion to the distance, and a climb
    sway, climb = o[O_SWAY], o[O_CLIMB]
    n = 0
    for i in range(lat.span[0]):
        h0, h1, h2 = lat.hubs[i, 0], lat.hubs[i, 1], lat.hubs[i, 2]
        reach = lat.hubs[i, 3] * (1.0 + sway)
        for j in range(lat.span[1]):
            y0, y1, y2 = _image(lat.v_local[j], h0, h1, h2)
            hub = reach * lat.v_local[j, 12] + climb
            if sway > 0.0:
                hub += sway * np.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
            if _misses(o, y0, y1, y2, hub, q0, q1, q2, q_rho, q_far, wide):
                continue
            for b in range(len(lat.racks)):
                i2, j2, dk = i + lat.racks[b, 2], j + lat.racks[b, 3], lat.racks[b, 4]
                if i2 < 0 or j2 < 0 or i2 >= lat.span[0] or j2 >= lat.span[1]:
                    continue
                p, q = lat.balls[i, lat.racks[b, 0]], lat.balls[i2, lat.racks[b, 1]]
                ra, rb = p[3] * lat.v_powers[j, 12], q[3] * lat.v_powers[j2, 12] * lat.steps[b, 12]
                ax, ay, az = _image(lat.v_powers[j], p[0], p[1], p[2])
                bx, by, bz = _image(lat.v_powers[j2], q[0], q[1], q[2])
                bx, by, bz = _image(lat.steps[b], bx, by, bz)
                prepare(ax, ay, az, ra, bx, by, bz, rb, g)
                half = 0.5 * g[6]
                y0, y1, y2 = _local(o, g[0] + half * g[3], g[1] + half * g[4], g[2] + half * g[5])
                if _misses(o, y0, y1, y2, half + max(g[9], g[10]), q0, q1, q2, q_rho, q_far, wide):
                    continue
                first = lat.start[2] + max(0, -dk)
                a, z1, t0, t1, period = beam_window(c, e, g, pad, first, first + lat.span[2] - abs(dk) - 1)
                if a > z1:
                    continue
                w0, w1 = wraps(a, z1, t0, t1, period)
                last = a - 1
                for w in range(w0, w1 + 1):
                    k0, k1 = turn_range(a, z1, t0, t1, period, w)
                    for k in range(max(k0, last + 1), k1 + 1):
                        px, py, pz, shrink = moved(group, -float(k), x, y, z)
                        d = gap(px, py, pz, g) / shrink
                        if d <= r:
                            n = _keep(mode, n, i + lat.start[0], j + lat.start[1], k, b, d, cells, gaps)
                            if mode == ANY:
                                return n
                            if mode == NEAREST:
                                r = d
                                wide = max(r, 0.0) + pad
                                ball_extent(c, x, y, z, wide, e)
                    last = max(last, k1)
    return n


@kernel
def _sheets(lat, x, y, z, r, mode, cells, gaps):
    # O(nu): V and W commute and leave each other's coordinates alone, so that j and k are bounded apart.
    g, ev, ew = np.empty(BEAM), np.empty(4), np.empty(4)
    cv, cw, o = lat.coordinates[0], lat.coordinates[1], lat.sheet_orbit
    pad = _PAD * (lat.size + abs(x) + abs(y) + abs(z))
    wide = max(r, 0.0) + pad
    ball_extent(cv, x, y, z, wide, ev)
    ball_extent(cw, x, y, z, wide, ew)
    q0, q1, q2 = _local(o, x, y, z)
    q_rho = np.sqrt(q0 * q0 + q1 * q1)
    q_far = np.sqrt(q_rho * q_rho + q2 * q2)
    n = 0
    for i in range(lat.span[0]):
        y0, y1, y2 = _local(o, lat.sheet_hubs[i, 0], lat.sheet_hubs[i, 1], lat.sheet_hubs[i, 2])
        if _misses(o, y0, y1, y2, lat.sheet_hubs[i, 3], q0, q1, q2, q_rho, q_far, wide):
            continue
        for b in range(len(lat.racks)):
            i2, dj, dk = i + lat.racks[b, 2], lat.racks[b, 3], lat.racks[b, 4]
            if i2 < 0 or i2 >= lat.span[0]:
                continue
            p, q = lat.balls[i, lat.racks[b, 0]], lat.balls[i2, lat.racks[b, 1]]
            bx, by, bz = _image(lat.sheet_steps[b], q[0], q[1], q[2])
            prepare(p[0], p[1], p[2], p[3], bx, by, bz, q[3] * lat.sheet_steps[b, 12], g)
            half = 0.5 * g[6]
            y0, y1, y2 = _local(o, g[0] + half * g[3], g[1] + half * g[4], g[2] + half * g[5])
            if _misses(o, y0, y1, y2, half + max(g[9], g[10]), q0, q1, q2, q_rho, q_far, wide):
                continue
            first = lat.start[2] + max(0, -dk)
            ka, kb, s0, s1, k_period = beam_window(cw, ew, g, pad, first, first + lat.span[2] - abs(dk) - 1)
            if ka > kb:
                continue
            first = lat.start[1] + max(0, -dj)
            ja, jb, t0, t1, j_period = beam_window(cv, ev, g, pad, first, first + lat.span[1] - abs(dj) - 1)
            if ja > jb:
                continue
            kw0, kw1 = wraps(ka, kb, s0, s1, k_period)
            jw0, jw1 = wraps(ja, jb, t0, t1, j_period)
            k_last = ka - 1
            for kw in range(kw0, kw1 + 1):
                k0, k1 = turn_range(ka, kb, s0, s1, k_period, kw)
                for k in range(max(k0, k_last + 1), k1 + 1):
                    kx, ky, kz, k_shrink = moved(lat.groups[1], -float(k), x, y, z)
                    j_last = ja - 1
                    for jw in range(jw0, jw1 + 1):
                        j0, j1 = turn_range(ja, jb, t0, t1, j_period, jw)
                        for j in range(max(j0, j_last + 1), j1 + 1):
                            px, py, pz, shrink = moved(lat.groups[0], -float(j), kx, ky, kz)
                            d = gap(px, py, pz, g) / (k_shrink * shrink)
                            if d <= r:
                                n = _keep(mode, n, i + lat.start[0], j, k, b, d, cells, gaps)
                                if mode == ANY:
                                    return n
                                if mode == NEAREST:
                                    r = d
                                    wide = max(r, 0.0) + pad
                                    ball_extent(cv, x, y, z, wide, ev)
                                    ball_extent(cw, x, y, z, wide, ew)
                        j_last = max(j_last, j1)
                k_last = max(k_last, k1)
    return n


@kernel
def _boxes(lat, x, y, z, r, mode, cells, gaps):
    # O(1): three translations, whose dual basis turns the ball's box into a box of indices (E13: for any angle between them).
    t = lat.translations
    pad = _PAD * (lat.size + abs(x) + abs(y) + abs(z))
    low, high = np.empty(3), np.empty(3)
    wide = max(r, 0.0) + pad
    for a in range(3):
        c = lat.dual[a, 0] * x + lat.dual[a, 1] * y + lat.dual[a, 2] * z
        h = wide * lat.dual[a, 3] + _WIDEN
        low[a], high[a] = c - h, c + h
    n = 0
    for b in range(len(lat.racks)):
        g = lat.templates[b]
        dk = lat.racks[b, 4]
        i0 = max(lat.start[0] + max(0, -lat.racks[b, 2]), int(np.ceil(low[0] - g[BEAM + 3])))
        i1 = min(lat.start[0] + lat.span[0] - 1 - max(0, lat.racks[b, 2]), int(np.floor(high[0] - g[BEAM])))
        j0 = max(lat.start[1] + max(0, -lat.racks[b, 3]), int(np.ceil(low[1] - g[BEAM + 4])))
        j1 = min(lat.start[1] + lat.span[1] - 1 - max(0, lat.racks[b, 3]), int(np.floor(high[1] - g[BEAM + 1])))
        k0 = max(lat.start[2] + max(0, -dk), int(np.ceil(low[2] - g[BEAM + 5])))
        k1 = min(lat.start[2] + lat.span[2] - 1 - max(0, dk), int(np.floor(high[2] - g[BEAM + 2])))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                px = x - i * t[0, 0] - j * t[1, 0]
                py = y - i * t[0, 1] - j * t[1, 1]
                pz = z - i * t[0, 2] - j * t[1, 2]
                for k in range(k0, k1 + 1):
                    d = gap(px - k * t[2, 0], py - k * t[2, 1], pz - k * t[2, 2], g)
                    if d <= r:
                        n = _keep(mode, n, i, j, k, b, d, cells, gaps)
                        if mode == ANY:
                            return n
                        if mode == NEAREST:
                            r = d
    return n


@kernel
def _descent(lat, x, y, z, r, mode, cells, gaps):
    # Contraction and halving of the index brick (`frep/steady_kernels.py`): some 100 ns a box, for any three similarities.
    fdata, idata, p, q, segments = lat.fdata, lat.idata, lat.tree[0], lat.tree[1], lat.tree[2]
    g, ends, swept, dual = np.empty(BEAM), np.empty(11), np.empty(steady.SWEPT), np.empty(3)
    stack, anchors = np.empty((steady.STACK, 6), np.int64), np.empty(6, np.int64)
    n = 0
    top = steady.descend(fdata, idata, q, p, x, y, z, max(r, 0.0), stack, steady.start(idata, q, stack), swept, dual)
    while top > 0:
        for b in range(len(lat.racks)):
            rack = q + steady.I_RACKS + steady.RACK * b
            steady.rack_anchors(idata, rack, stack[top - 1], swept, anchors)
            for ai in range(anchors[0], anchors[3] + 1):
                for aj in range(anchors[1], anchors[4] + 1):
                    for ak in range(anchors[2], anchors[5] + 1):
                        steady.rack_ends(fdata, idata, q, segments + SEGMENT * b, rack, ai, aj, ak, ends)
                        prepare(ends[0], ends[1], ends[2], ends[6], ends[3], ends[4], ends[5], ends[7], g)
                        d = gap(x, y, z, g)
                        if d <= r:
                            n = _keep(mode, n, int(ends[8]), int(ends[9]), int(ends[10]), b, d, cells, gaps)
                            if mode == ANY:
                                return n
                            if mode == NEAREST:
                                r = d
        top = steady.descend(fdata, idata, q, p, x, y, z, max(r, 0.0), stack, top - 1, swept, dual)
    return n


@parallel_kernel
def find(method, lat, centers, radii, mode, cells, gaps, found):
    # Queries side by side: cells (q, capacity, 4), gaps (q, capacity), found (q,).
    for a in prange(len(centers)):
        x, y, z, r = centers[a, 0], centers[a, 1], centers[a, 2], radii[a]
        if method == BOXES:
            found[a] = _boxes(lat, x, y, z, r, mode, cells[a], gaps[a])
        else:
            found[a] = _descent(lat, x, y, z, r, mode, cells[a], gaps[a])


@parallel_kernel
def find_by_rows(method, lat, centers, radii, mode, cells, gaps, found):
    # As `find`, by the methods that are asked for by name: apart, so that nobody else compiles them.
    for a in prange(len(centers)):
        x, y, z, r = centers[a, 0], centers[a, 1], centers[a, 2], radii[a]
        if method == NAIVE:
            found[a] = _naive(lat, x, y, z, r, mode, cells[a], gaps[a])
        elif method == ROWS:
            found[a] = _rows(lat, x, y, z, r, mode, cells[a], gaps[a])
        else:
            found[a] = _sheets(lat, x, y, z, r, mode, cells[a], gaps[a])
