"""Integrals over one hub in compiled code: a node ball and its half-beams.

All cones of a hub touch one ball, which makes the geometry linear. A point of cone `i` lies on the ruling of azimuth `phi`
at the distance `L` from the contact circle: `x = X a + rho e(phi)`, `X = r s + L c`, `rho = r c - L s`, with `a` the unit
axis, `s = (r - r_end)/length` and `c = sqrt(1 - s^2)`. Let `w = L/rho`, which grows with `L`. Cone `j` covers the ruling as
far as

    w_j(phi) = (a_j . e(phi) - P_j)/Q_j,   P_j = (s_j - A s)/c,   Q_j = (s s_j + c c_j - A)/c,   A = a . a_j,

a sinusoid (`Q_j > 0` unless one cone holds the other). The exposed part of cone `i` begins at the upper envelope of these
sinusoids and of zero, and ends at the cut. Two sinusoids cross at most twice, in closed form; between crossings everything
is analytic, and Gauss-Legendre quadrature over `phi` reaches rounding. Where the envelope is zero, the contact circle is a
part of the edge of the exposed ball.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import inlined, kernel, parallel_kernel

# Columns of a hub's row. Moments are integrals about the node over the hub's volume: 1, x, y, z, xx, xy, xz, yy, yz, zz.
H_AREA, H_EXCESS, H_BEAM, H_OTHER, H_MOMENTS = 0, 1, 2, 3, 4
HUB_ROW = 14

_PAIRS = ((3, 3), (0, 3), (1, 3), (2, 3), (0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Where the ten moments stand in the 4x4 matrix of [x; 1] [x; 1]^T."""

# Columns of a half-beam: unit axis, two unit vectors normal to it, s, c, ruling length up to the cut.
_A, _E1, _E2, _S, _C, _LEND = 0, 3, 6, 9, 10, 11
_BEAM_ROW = 12

# Columns of a lateral sum: integrals over the exposed part of a cone, by dA = rho dL dphi, of 1, X, X^2; then of rho e,
# X rho e (two components each); then of rho^2 e e (11, 12, 22).
_LATERAL = 10

_GAUSS = 20
_FEW = 14
_rules = [np.polynomial.legendre.leggauss(n) for n in (_GAUSS, _FEW)]
_GAUSS_X, _GAUSS_W = (tuple(x.tolist()) for x in _rules[0])
_FEW_X, _FEW_W = (tuple(x.tolist()) for x in _rules[1])

_PIECE = 0.5 * math.pi
"""The longest piece of azimuth that one rule integrates."""

_SLIVER = 1e-13
"""Pieces of azimuth shorter than this are dropped: at their ends the functions agree, so the loss is its square."""


@kernel
def _half_beams(radius, ends, end_radii, beams):
    # O(m) for m beams. False where a ball holds another one or shares its centre.
    for i in range(ends.shape[0]):
        x, y, z = ends[i, 0], ends[i, 1], ends[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        step = radius - end_radii[i]
        if not length > abs(step):
            return False
        x, y, z = x / length, y / length, z / length
        # The axis of least component gives a normal that is well defined.
        if abs(x) <= abs(y) and abs(x) <= abs(z):
            ux, uy, uz = 0.0, z, -y
        elif abs(y) <= abs(z):
            ux, uy, uz = -z, 0.0, x
        else:
            ux, uy, uz = y, -x, 0.0
        norm = math.sqrt(ux * ux + uy * uy + uz * uz)
        ux, uy, uz = ux / norm, uy / norm, uz / norm
        row = beams[i]
        row[0], row[1], row[2] = x, y, z
        row[3], row[4], row[5] = ux, uy, uz
        row[6], row[7], row[8] = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
        s = step / length
        row[_S] = s
        row[_C] = math.sqrt((1.0 - s) * (1.0 + s))
        row[_LEND] = 0.5 * length * row[_C]
    return True


@kernel
def _covers(beams, i, waves):
    # The sinusoids u cos(phi) + v sin(phi) - p of the other cones over cone i, after the constant 0. O(m).
    # Returns their number, or -1 - j where cone j holds cone i.
    b = beams[i]
    s, c = b[_S], b[_C]
    waves[0, 0] = waves[0, 1] = waves[0, 2] = 0.0
    waves[0, 3] = -1.0
    n = 1
    for j in range(beams.shape[0]):
        if j == i:
            continue
        o = beams[j]
        # c Q = cos(t_i - t_j) - A and c P = s_j - A s, by half the square of the difference of the axes (1 - A) or of their
        # sum (1 + A): contact circles of nearly opposite beams nearly coincide, and all digits of the sliver count.
        sign = -1.0 if o[0] * b[0] + o[1] * b[1] + o[2] * b[2] < 0.0 else 1.0
        dx, dy, dz = o[0] - sign * b[0], o[1] - sign * b[1], o[2] - sign * b[2]
        ds, dc = o[_S] - sign * s, o[_C] - c
        gap = 0.5 * (dx * dx + dy * dy + dz * dz)
        if sign > 0.0:
            q = gap - 0.5 * (ds * ds + dc * dc)
            p = ds + gap * s
        else:
            q = 1.0 - gap + s * o[_S] + c * o[_C]
            # Opposite to rounding: the circles coincide, and nothing of the ball shows between them.
            p = -1e-14 if gap <= 1e-28 and abs(ds) <= 1e-14 else ds - gap * s
        if q <= 1e-14 * (gap if sign > 0.0 else 1.0) or (sign > 0.0 and gap <= 1e-28):
            # One cone holds the other.
            if o[_S] <= s:
                return -1 - j
            continue
        waves[n, 0] = (dx * b[3] + dy * b[4] + dz * b[5]) * c / q
        waves[n, 1] = (dx * b[6] + dy * b[7] + dz * b[8]) * c / q
        waves[n, 2] = p / q
        waves[n, 3] = j
        n += 1
    return n


@inlined
def _wave(waves, k, cos, sin):
    return waves[k, 0] * cos + waves[k, 1] * sin - waves[k, 2]


@kernel
def _largest(waves, n, begin, end):
    # The wave that is largest near the middle of (begin, end), and the azimuth of that comparison, chosen to lie
    # off crossings: there rounding could put a crossing on the wrong side. O(m).
    best, at, margin = 0, 0.0, -1.0
    for trial in range(4):
        phi = begin + (0.4837 + 0.0711 * trial) * (end - begin)
        cos, sin = math.cos(phi), math.sin(phi)
        top, first, second = 0, -math.inf, -math.inf
        for k in range(n):
            value = _wave(waves, k, cos, sin)
            if value > first:
                top, first, second = k, value, first
            elif value > second:
                second = value
        if first - second > margin:
            best, at, margin = top, phi, first - second
        if margin > 1e-6 * (end - begin) * (1.0 + abs(first)):
            break
    return best, at


@kernel
def _reach(waves, n, top, at):
    # How far the wave `top`, largest at azimuth `at`, stays the largest: backwards and forwards, at most a turn. O(m).
    back = ahead = 2.0 * math.pi
    for k in range(n):
        if k == top:
            continue
        u = waves[k, 0] - waves[top, 0]
        v = waves[k, 1] - waves[top, 1]
        p = waves[k, 2] - waves[top, 2]
        amplitude = math.sqrt(u * u + v * v)
        if not amplitude > abs(p):
            continue
        middle = math.atan2(v, u) - at
        half = math.acos(p / amplitude)
        # Wave k is larger between middle - half and middle + half.
        ahead = min(ahead, (middle - half) % (2.0 * math.pi))
        back = min(back, (-middle - half) % (2.0 * math.pi))
    return back, ahead


@inlined
def _ruling(radius, s, c, end, waves, k, phi, weight, sums):
    # Adds one ruling's integrals over L, from wave k to the end.
    t0, t1 = radius * s, radius * c
    cos, sin = math.cos(phi), math.sin(phi)
    w = max(0.0, _wave(waves, k, cos, sin))
    low = end if 1.0 + s * w <= 0.0 else min(end, w * t1 / (1.0 + s * w))
    # Polynomials of degree 3 at most: Gauss-Legendre of two points is exact.
    m, h = 0.5 * (low + end), 0.5 * (end - low)
    h1 = 0.5773502691896257 * h
    xa, ra = t0 + (m - h1) * c, t1 - (m - h1) * s
    xb, rb = t0 + (m + h1) * c, t1 - (m + h1) * s
    weight *= h
    fa, fb = weight * ra, weight * rb
    ga, gb = fa * ra, fb * rb
    sums[0] += fa + fb
    sums[1] += fa * xa + fb * xb
    sums[2] += fa * xa * xa + fb * xb * xb
    first, mixed, second = ga + gb, ga * xa + gb * xb, ga * ra + gb * rb
    sums[3] += first * cos
    sums[4] += first * sin
    sums[5] += mixed * cos
    sums[6] += mixed * sin
    sums[7] += second * cos * cos
    sums[8] += second * cos * sin
    sums[9] += second * sin * sin


@kernel
def _lateral(radius, s, c, end, waves, k, begin, stop, sums):
    # Adds the lateral integrals of one piece of azimuth whose exposed part begins at wave k. 14 or 20 points a quarter turn:
    # sinusoids need 14; the more the cone's width changes, the nearer is the pole of 1/(1 + s w).
    parts = int(math.ceil((stop - begin) / _PIECE))
    half = 0.5 * (stop - begin) / parts
    slim = abs(s) * end < 0.15 * (radius * c - s * end)
    for part in range(parts):
        middle = begin + (2 * part + 1) * half
        if slim:
            for g in range(_FEW):
                _ruling(radius, s, c, end, waves, k, middle + half * _FEW_X[g], half * _FEW_W[g], sums)
        else:
            for g in range(_GAUSS):
                _ruling(radius, s, c, end, waves, k, middle + half * _GAUSS_X[g], half * _GAUSS_W[g], sums)


@kernel
def _arc(beams, i, widest, begin, stop, ball):
    # Adds what an arc of the contact circle of beam i contributes to the exposed part of the unit sphere:
    # area, then first moments, then the six line integrals of the second moments. 20 points a quarter turn.
    b = beams[i]
    s, c = b[_S], b[_C]
    px, py, pz, ps = beams[widest, 0], beams[widest, 1], beams[widest, 2], beams[widest, _S]
    parts = int(math.ceil((stop - begin) / _PIECE))
    half = 0.5 * (stop - begin) / parts
    for part in range(parts):
        middle = begin + (2 * part + 1) * half
        for g in range(_GAUSS):
            phi = middle + half * _GAUSS_X[g]
            cos, sin = math.cos(phi), math.sin(phi)
            ex = cos * b[3] + sin * b[6]
            ey = cos * b[4] + sin * b[7]
            ez = cos * b[5] + sin * b[8]
            wx, wy, wz = s * b[0] + c * ex, s * b[1] + c * ey, s * b[2] + c * ez
            dx, dy, dz = c * b[0] - s * ex, c * b[1] - s * ey, c * b[2] - s * ez
            weight = half * _GAUSS_W[g] * c
            # (1 - cos theta) dphi about the pole opposite to the axis of the widest cap, whose inside is not exposed.
            if i == widest:
                ball[0] += weight * c / (1.0 - ps)
            else:
                ball[0] += weight * (px * dx + py * dy + pz * dz) / (1.0 - (px * wx + py * wy + pz * wz))
            ball[1] -= 0.5 * weight * dx
            ball[2] -= 0.5 * weight * dy
            ball[3] -= 0.5 * weight * dz
            ball[4] -= weight * wx * dx
            ball[5] -= weight * 0.5 * (wx * dy + wy * dx)
            ball[6] -= weight * 0.5 * (wx * dz + wz * dx)
            ball[7] -= weight * wy * dy
            ball[8] -= weight * 0.5 * (wy * dz + wz * dy)
            ball[9] -= weight * wz * dz


@kernel
def _add_beam(radius, beam, sums, out):
    # Adds a half-beam to the hub's moments by the divergence theorem: x . n = r on the cone, = h on the cut disk.
    s, c = beam[_S], beam[_C]
    height, cut = radius * s + beam[_LEND] * c, radius * c - beam[_LEND] * s
    disk = math.pi * cut * cut
    out[H_AREA] += sums[0]
    out[H_MOMENTS] += (radius * sums[0] + height * disk) / 3.0
    n = 4
    for p in range(3):
        a, u, v = beam[p], beam[3 + p], beam[6 + p]
        out[H_MOMENTS + 1 + p] += (
            radius * (a * sums[1] + u * sums[3] + v * sums[4]) + height * height * a * disk
        ) / 4.0
        for q in range(p, 3):
            a2, u2, v2 = beam[q], beam[3 + q], beam[6 + q]
            lateral = (
                a * a2 * sums[2]
                + (a * u2 + u * a2) * sums[5]
                + (a * v2 + v * a2) * sums[6]
                + u * u2 * sums[7]
                + (u * v2 + v * u2) * sums[8]
                + v * v2 * sums[9]
            )
            flat = disk * (height * height * a * a2 + 0.25 * cut * cut * (u * u2 + v * v2))
            out[H_MOMENTS + n] += (radius * lateral + height * flat) / 5.0
            n += 1


@kernel
def _add_ball(radius, ball, out):
    # Adds the exposed part of the node ball: moments over the unit sphere's part, scaled. `ball` as in `_arc`.
    cube = radius * radius * radius
    area = ball[0]
    out[H_AREA] += area * radius * radius
    out[H_MOMENTS] += area * cube / 3.0
    n = 4
    for p in range(3):
        out[H_MOMENTS + 1 + p] += ball[1 + p] * cube * radius / 4.0
        for q in range(p, 3):
            second = (ball[n] + (area if p == q else 0.0)) / 3.0
            out[H_MOMENTS + n] += second * cube * radius * radius / 5.0
            n += 1


@kernel
def _excess(radius, beam, waves, n, out, i):
    # How far in mm the seams of half-beam i pass its cut, by the peaks of the waves; keeps the worst of the hub. O(m).
    s, c, end = beam[_S], beam[_C], beam[_LEND]
    peak, other = 0.0, -1.0
    for k in range(1, n):
        height = math.sqrt(waves[k, 0] ** 2 + waves[k, 1] ** 2) - waves[k, 2]
        if height > peak:
            peak, other = height, waves[k, 3]
    growth = 1.0 + s * peak
    excess = peak * radius * c / growth - end if growth > 0.0 else math.inf
    if excess > out[H_EXCESS]:
        out[H_EXCESS], out[H_BEAM], out[H_OTHER] = excess, i, other


@kernel
def hub(radius, ends, end_radii, out):
    """Moments, area and excess of one hub into a row of `HUB_ROW` numbers.

    O(m p) crossings for m beams with p pieces of seam each, and 20 points a piece: 10 us for six beams, 0.1 ms for 24.
    A hub in which one ball holds another gets NaN.
    """
    m = ends.shape[0]
    out[:] = 0.0
    out[H_EXCESS], out[H_BEAM], out[H_OTHER] = -math.inf, -1.0, -1.0
    ball = np.zeros(10)
    if m == 0:
        ball[0] = 4.0 * math.pi
        _add_ball(radius, ball, out)
        return
    beams = np.empty((m, _BEAM_ROW))
    if not _half_beams(radius, ends, end_radii, beams):
        out[:] = math.nan
        return
    widest = 0
    for i in range(m):
        if beams[i, _S] < beams[widest, _S]:
            widest = i
    waves = np.empty((m, 4))
    sums = np.empty(_LATERAL)
    stack = np.empty((4 * m + 16, 2))
    for i in range(m):
        n = _covers(beams, i, waves)
        if n < 0:
            out[H_EXCESS], out[H_BEAM], out[H_OTHER] = math.inf, i, -1 - n
            continue
        _excess(radius, beams[i], waves, n, out, i)
        sums[:] = 0.0
        stack[0, 0], stack[0, 1] = -math.pi, math.pi
        height = 1
        while height > 0:
            height -= 1
            begin, stop = stack[height, 0], stack[height, 1]
            top, at = _largest(waves, n, begin, stop)
            back, ahead = _reach(waves, n, top, at)
            left, right = max(begin, at - back), min(stop, at + ahead)
            _lateral(radius, beams[i, _S], beams[i, _C], beams[i, _LEND], waves, top, left, right, sums)
            if top == 0:
                _arc(beams, i, widest, left, right, ball)
            # The stack holds disjoint pieces that wait; a hub never has as many as it has room for.
            if left - begin > _SLIVER and height < stack.shape[0]:
                stack[height, 0], stack[height, 1] = begin, left
                height += 1
            if stop - right > _SLIVER and height < stack.shape[0]:
                stack[height, 0], stack[height, 1] = right, stop
                height += 1
        _add_beam(radius, beams[i], sums, out)
    _add_ball(radius, ball, out)


@parallel_kernel
def hubs(radii, first, ends, end_radii, out):
    """One row of `out` (n, HUB_ROW) a hub; the beams of hub i are rows first[i] to first[i + 1]. Parallel over hubs."""
    for i in prange(radii.shape[0]):
        hub(radii[i], ends[first[i] : first[i + 1]], end_radii[first[i] : first[i + 1]], out[i])


# --- hubs of a steady lattice ------------------------------------------------------------------------------------------

# Columns of a similarity: logarithm of the scale, angle, unit axis, velocity (see `frep.similarity`).
_LOG, _ANGLE, _AXIS, _VELOCITY = 0, 1, 2, 5
SIMILARITY_ROW = 8


@inlined
def _spread(axial, real, imag, s, x, y, z):
    # A vector multiplied by the number `axial` along the axis and by the complex number `real + i imag` across it.
    ax, ay, az = s[_AXIS], s[_AXIS + 1], s[_AXIS + 2]
    along = (axial - real) * (ax * x + ay * y + az * z)
    return (
        real * x + along * ax + imag * (ay * z - az * y),
        real * y + along * ay + imag * (az * x - ax * z),
        real * z + along * az + imag * (ax * y - ay * x),
    )


@kernel
def _turned(s, t, x, y, z):
    # The linear part of S^t, applied to a vector.
    growth = math.exp(t * s[_LOG])
    angle = t * s[_ANGLE]
    return _spread(growth, growth * math.cos(angle), growth * math.sin(angle), s, x, y, z)


@kernel
def _moved(s, t, x, y, z):
    # S^t x - x, without the cancellation of that difference: t phi(t A) (A x + v).
    log, angle = s[_LOG], s[_ANGLE]
    vx, vy, vz = _spread(log, log, angle, s, x, y, z)
    vx, vy, vz = vx + s[_VELOCITY], vy + s[_VELOCITY + 1], vz + s[_VELOCITY + 2]
    norm = log * log + angle * angle
    axial = math.expm1(t * log) / log if abs(log) > 1e-290 else t
    if norm > 1e-290:
        sine = math.sin(0.5 * t * angle)
        grown = math.expm1(t * log)
        real = grown * math.cos(t * angle) - 2.0 * sine * sine
        imag = (1.0 + grown) * math.sin(t * angle)
        real, imag = (real * log + imag * angle) / norm, (imag * log - real * angle) / norm
    else:
        real, imag = t, 0.0
    return _spread(axial, real, imag, s, vx, vy, vz)


@kernel
def _action(s, t, out):
    # What S^t does to area and moments of a body: M' = scale^3 H M H^T on the entries of the symmetric 4x4 matrix M, as (11, 11).
    h = np.zeros((4, 4))
    for column in range(3):
        h[0, column], h[1, column], h[2, column] = _turned(
            s, t, 1.0 if column == 0 else 0.0, 1.0 if column == 1 else 0.0, 1.0 if column == 2 else 0.0
        )
    h[0, 3], h[1, 3], h[2, 3] = _moved(s, t, 0.0, 0.0, 0.0)
    h[3, 3] = 1.0
    scale = math.exp(t * s[_LOG])
    out[:] = 0.0
    out[0, 0] = scale * scale
    for a in range(10):
        p, q = _PAIRS[a]
        for b in range(10):
            r, c = _PAIRS[b]
            value = h[p, r] * h[q, c]
            if r != c:  # an entry off the diagonal stands for two
                value += h[p, c] * h[q, r]
            out[1 + a, 1 + b] = scale * scale * scale * value


@kernel
def _multiplied(a, b, out):
    for i in range(11):
        for j in range(11):
            total = 0.0
            for k in range(11):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@kernel
def power_sum(s, low, high):
    """(11, 11): the sum over low <= k < high of the action of S^k on area and moments.

    From the largest member down, so that nothing is magnified. By doubling: sum over 2m = (1 + L^m) sum over m, and sum over
    m + 1 = sum over m + L^m; all powers in closed form, none by squaring. Two small products a binary digit, a microsecond each.
    """
    n = high - low
    sign, largest = (-1.0, high - 1) if s[_LOG] > 0.0 else (1.0, low)
    action, product, total = np.empty((11, 11)), np.empty((11, 11)), np.eye(11)
    bits = 0
    while n >> (bits + 1):
        bits += 1
    for bit in range(bits - 1, -1, -1):
        m = n >> (bit + 1)
        _action(s, sign * m, action)
        _multiplied(action, total, product)
        total += product
        if (n >> bit) & 1:
            _action(s, sign * 2.0 * m, action)
            total += action
    _action(s, float(largest), action)
    _multiplied(total, action, product)
    # Areas again, as the stable geometric sum.
    log = 2.0 * s[_LOG]
    product[0, 0] = math.exp(low * log) * (math.expm1(n * log) / math.expm1(log) if log != 0.0 else float(n))
    return product


@kernel
def _place(steps, i, j, k, x, y, z):
    # W^k V^j U^i x.
    mx, my, mz = _moved(steps[0], i, x, y, z)
    x, y, z = x + mx, y + my, z + mz
    mx, my, mz = _moved(steps[1], j, x, y, z)
    x, y, z = x + mx, y + my, z + mz
    mx, my, mz = _moved(steps[2], k, x, y, z)
    return x + mx, y + my, z + mz


@kernel
def conjugated(s, by, t):
    """The similarity B^t S B^-t, as a row: S as seen after B^t moved everything."""
    out = s.copy()
    inverse = math.exp(-t * by[_LOG])
    ax, ay, az = _turned(by, t, s[_AXIS], s[_AXIS + 1], s[_AXIS + 2])
    ax, ay, az = ax * inverse, ay * inverse, az * inverse
    vx, vy, vz = _turned(by, t, s[_VELOCITY], s[_VELOCITY + 1], s[_VELOCITY + 2])
    x, y, z = _moved(by, t, 0.0, 0.0, 0.0)
    out[_AXIS], out[_AXIS + 1], out[_AXIS + 2] = ax, ay, az
    out[_VELOCITY] = vx - s[_LOG] * x - s[_ANGLE] * (ay * z - az * y)
    out[_VELOCITY + 1] = vy - s[_LOG] * y - s[_ANGLE] * (az * x - ax * z)
    out[_VELOCITY + 2] = vz - s[_LOG] * z - s[_ANGLE] * (ax * y - ay * x)
    return out


@kernel
def spread_positions(steps, x, y, z, low, high):
    """(27, 3) where the point (x, y, z) of the cluster is at the first, middle and last indices."""
    out = np.empty((27, 3))
    index = np.empty(3)
    for n in range(27):
        digits = n
        for axis in range(3):
            index[axis] = low[axis] + 0.5 * (digits % 3) * (high[axis] - 1 - low[axis])
            digits //= 3
        out[n, 0], out[n, 1], out[n, 2] = _place(steps, index[0], index[1], index[2], x, y, z)
    return out


@kernel
def _beam_end(steps, nodes, here, other, at, offset, end):
    # Where the other node of a beam is, relative to its node in the cluster `at`, as a sum of steps of one beam's length:
    # the difference of two positions would lose the digits by which the lattice is longer than a beam.
    u, v, w = steps[0], steps[1], steps[2]
    i, j, k = at[0], at[1], at[2]
    di, dj, dk = float(offset[0]), float(offset[1]), float(offset[2])
    px, py, pz = nodes[other, 0], nodes[other, 1], nodes[other, 2]
    x, y, z = _moved(u, di, px, py, pz)
    x, y, z = x + px - nodes[here, 0], y + py - nodes[here, 1], z + pz - nodes[here, 2]
    x, y, z = _turned(u, i, x, y, z)
    if dj != 0.0 or dk != 0.0:
        mx, my, mz = _moved(u, i + di, px, py, pz)
        px, py, pz = px + mx, py + my, pz + mz
        mx, my, mz = _moved(v, dj, px, py, pz)
        x, y, z = x + mx, y + my, z + mz
    x, y, z = _turned(v, j, x, y, z)
    if dk != 0.0:
        mx, my, mz = _moved(v, j + dj, px, py, pz)
        mx, my, mz = _moved(w, dk, px + mx, py + my, pz + mz)
        x, y, z = x + mx, y + my, z + mz
    end[0], end[1], end[2] = _turned(w, k, x, y, z)


@kernel
def _about_origin(row, x, y, z):
    # Moments about the node at (x, y, z) become moments about the origin. Second moments first: they need the first.
    m = row[H_MOMENTS:]
    volume, mx, my, mz = m[0], m[1], m[2], m[3]
    m[4] += 2.0 * mx * x + volume * x * x
    m[5] += mx * y + my * x + volume * x * y
    m[6] += mx * z + mz * x + volume * x * z
    m[7] += 2.0 * my * y + volume * y * y
    m[8] += my * z + mz * y + volume * y * z
    m[9] += 2.0 * mz * z + volume * z * z
    m[1] += volume * x
    m[2] += volume * y
    m[3] += volume * z


@parallel_kernel
def lattice_hubs(steps, nodes, radii, first, links, families, family, at, origin, rows):
    """Hubs of a steady lattice at real indices (i, j, k): a row each, its moments about `origin`.

    `steps` (3, SIMILARITY_ROW): U, V, W. `families`: the node of each family of hubs; its beams are the rows first[f] to
    first[f + 1] of `links` (other node, di, dj, dk). `family` and `at` (n, 3): the family and the indices of each hub.
    Parallel over hubs; 0.2 us a beam on top of the hub itself.
    """
    for n in prange(family.shape[0]):
        f = family[n]
        here, begin, stop = families[f], first[f], first[f + 1]
        log = at[n, 0] * steps[0, _LOG] + at[n, 1] * steps[1, _LOG] + at[n, 2] * steps[2, _LOG]
        ends = np.empty((stop - begin, 3))
        end_radii = np.empty(stop - begin)
        for b in range(begin, stop):
            offset = links[b, 1:]
            _beam_end(steps, nodes, here, links[b, 0], at[n], offset, ends[b - begin])
            grown = log + offset[0] * steps[0, _LOG] + offset[1] * steps[1, _LOG] + offset[2] * steps[2, _LOG]
            end_radii[b - begin] = radii[links[b, 0]] * math.exp(grown)
        hub(radii[here] * math.exp(log), ends, end_radii, rows[n])
        x, y, z = _place(steps, at[n, 0], at[n, 1], at[n, 2], nodes[here, 0], nodes[here, 1], nodes[here, 2])
        _about_origin(rows[n], x - origin[0], y - origin[1], z - origin[2])
