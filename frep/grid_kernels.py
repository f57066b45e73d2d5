"""Sampled grids in compiled code: trilinear or cubic values at points, bounds over boxes from a min/max pyramid.

A grid holds coarse nodes everywhere and, where the data asks for it, fine blocks of 9 x 9 x 9 nodes that refine one coarse cell
eightfold (`frep/sampled.py` packs it). A periodic grid wraps. Outside a grid that does not wrap, the value at the nearest
point of its box is continued with slope one, which keeps the sign of a signed distance.
"""

from __future__ import annotations

import math

import numpy as np

from .beam_kernels import SEPARABLE
from .jit import kernel

# Columns of `head`: cells along each axis, first coarse node in gdata, first cell of the block table in idata (or -1), first
# fine node in gdata, 1 if periodic, first pyramid number in gdata, pyramid levels, first float in fdata (origin, spacing), 1 if
# the nodes are coefficients of a periodic cubic B-spline.
G_NX, G_NY, G_NZ, G_NODES, G_TABLE, G_FINE, G_PERIODIC, G_PYRAMID, G_LEVELS, G_FLOATS, G_CUBIC = range(11)

FINE = 8
"""Fine cells along the edge of a refined coarse cell."""


@kernel
def _cell(u, n, periodic):
    """Wrapped or clamped coordinate in cells, its cell, and how far outside it was."""
    if periodic:
        v = u - n * math.floor(u / n)
        c = min(int(v), n - 1)
        return v, c, 0.0
    v = min(max(u, 0.0), float(n))
    return v, min(int(v), n - 1), u - v


@kernel
def _trilinear(g, base, sy, sz, fx, fy, fz):
    # sz = 1: eight loads, seven interpolations.
    a = g[base] + fz * (g[base + sz] - g[base])
    b = g[base + sy] + fz * (g[base + sy + sz] - g[base + sy])
    return a + fy * (b - a)


@kernel
def grid_value(head, fdata, idata, gdata, x, y, z):
    """Value at one point, about 6 ns."""
    f = head[G_FLOATS]
    nx, ny, nz = head[G_NX], head[G_NY], head[G_NZ]
    periodic = head[G_PERIODIC] != 0
    u, i, du = _cell((x - fdata[f]) / fdata[f + 3], nx, periodic)
    v, j, dv = _cell((y - fdata[f + 1]) / fdata[f + 4], ny, periodic)
    w, k, dw = _cell((z - fdata[f + 2]) / fdata[f + 5], nz, periodic)
    fx, fy, fz = u - i, v - j, w - k
    block = -1
    if head[G_TABLE] >= 0:
        block = idata[head[G_TABLE] + (i * ny + j) * nz + k]
    if block >= 0:
        fx, fy, fz = fx * FINE, fy * FINE, fz * FINE
        i, j, k = min(int(fx), FINE - 1), min(int(fy), FINE - 1), min(int(fz), FINE - 1)
        fx, fy, fz = fx - i, fy - j, fz - k
        sy = FINE + 1
        sx = sy * sy
        base = head[G_FINE] + block * sx * sy + i * sx + j * sy + k
    else:
        sy = nz + 1
        sx = (ny + 1) * sy
        base = head[G_NODES] + i * sx + j * sy + k
    a = _trilinear(gdata, base, sy, 1, fx, fy, fz)
    b = _trilinear(gdata, base + sx, sy, 1, fx, fy, fz)
    value = a + fx * (b - a)
    if du != 0.0 or dv != 0.0 or dw != 0.0:
        ex, ey, ez = du * fdata[f + 3], dv * fdata[f + 4], dw * fdata[f + 5]
        value += math.sqrt(ex * ex + ey * ey + ez * ez)
    return value


@kernel
def _weights(s, one):
    """Uniform cubic B-spline weights at s in [0, 1), in the number type of s."""
    r = one - s
    half, sixth, two_thirds = one * np.float32(0.5), one / np.float32(6.0), one / np.float32(1.5)
    return (
        r * r * r * sixth,
        two_thirds + s * s * (s * half - one),
        two_thirds + r * r * (r * half - one),
        s * s * s * sixth,
    )


@kernel
def _split(x, n):
    """Cell and fraction of a coordinate in cells, folded into the period of n cells."""
    u = x - n * math.floor(x / n)
    i = min(max(int(math.floor(u)), 0), n - 1)
    return i, u - i


@kernel
def _cubic_block(head, fdata, gdata, x, y, z, n, out):
    """Periodic cubic B-spline (twice continuously differentiable) at any points: 64 coefficients, about 25 ns a point.

    The coefficients carry the wrapped layers past each end (see `frep/sampled.py`), so that no index wraps inside a
    neighbourhood.
    """
    f = head[G_FLOATS]
    nx, ny, nz = head[G_NX], head[G_NY], head[G_NZ]
    sz = nz + 3
    sy = (ny + 3) * sz
    for p in range(n):
        px, py, pz = np.float64(x[p]), np.float64(y[p]), np.float64(z[p])
        if not (px - px == 0.0 and py - py == 0.0 and pz - pz == 0.0):
            out[p] = math.nan
            continue
        i, u = _split(px / fdata[f + 3], nx)
        j, v = _split(py / fdata[f + 4], ny)
        k, w = _split(pz / fdata[f + 5], nz)
        wu, wv, ww = _weights(u, 1.0), _weights(v, 1.0), _weights(w, 1.0)
        start = head[G_NODES] + i * sy + j * sz + k
        total = 0.0
        for a in range(4):
            for b in range(4):
                c = start + a * sy + b * sz
                row = (ww[0] * gdata[c] + ww[1] * gdata[c + 1]) + (ww[2] * gdata[c + 2] + ww[3] * gdata[c + 3])
                total += wu[a] * wv[b] * row
        out[p] = total


_SPAN = 256


@kernel
def _cubic_separable(head, fdata, gdata, x, y, z, out):
    """The same on a leaf block whose coordinates each depend on one axis only: about 2 ns a sample.

    For each of the 64 rows of samples along z, the sixteen rows of coefficients round it are summed once over the whole
    span (contiguous, so it vectorises), and the eight samples weigh four numbers of the sum each. Returns False where the
    span is too long (voxels far coarser than the spline).
    """
    f = head[G_FLOATS]
    nx, ny, nz = head[G_NX], head[G_NY], head[G_NZ]
    sz = nz + 3
    sy = (ny + 3) * sz
    lowest, highest = np.float64(z[0]), np.float64(z[0])
    for k in range(8):
        lowest, highest = min(lowest, np.float64(z[k])), max(highest, np.float64(z[k]))
    first = math.floor(lowest / fdata[f + 5])
    if not highest / fdata[f + 5] - first < _SPAN - 5:
        return False
    span = int(math.floor(highest / fdata[f + 5]) - first) + 4
    base = int(first - nz * math.floor(first / nz))
    sums = np.empty(_SPAN, np.float32)
    near = np.empty(8, np.int64)
    wz = np.empty((8, 4), np.float32)
    for k in range(8):
        w = np.float64(z[k]) / fdata[f + 5] - first
        near[k] = int(math.floor(w))
        ww = _weights(w - near[k], 1.0)
        wz[k, 0], wz[k, 1], wz[k, 2], wz[k, 3] = ww[0], ww[1], ww[2], ww[3]
    for i in range(8):
        ci, u = _split(np.float64(x[64 * i]) / fdata[f + 3], nx)
        wu = _weights(u, 1.0)
        for j in range(8):
            cj, v = _split(np.float64(y[8 * j]) / fdata[f + 4], ny)
            wv = _weights(v, 1.0)
            sums[:span] = np.float32(0.0)
            for a in range(4):
                start = head[G_NODES] + (ci + a) * sy + cj * sz
                w0, w1 = np.float32(wu[a] * wv[0]), np.float32(wu[a] * wv[1])
                w2, w3 = np.float32(wu[a] * wv[2]), np.float32(wu[a] * wv[3])
                m, k = 0, base
                while m < span:
                    # The span may run through several periods; within one, a row is contiguous.
                    run = min(span - m, nz - k)
                    # Unsigned, because an index that might be negative keeps a loop from vectorising.
                    c0, at = np.uint64(start + k), np.uint64(m)
                    c1, c2, c3 = c0 + np.uint64(sz), c0 + np.uint64(2 * sz), c0 + np.uint64(3 * sz)
                    for q in range(np.uint64(run)):
                        sums[at + q] += (w0 * gdata[c0 + q] + w1 * gdata[c1 + q]) + (
                            w2 * gdata[c2 + q] + w3 * gdata[c3 + q]
                        )
                    m += run
                    k = 0
            for k in range(8):
                q = near[k]
                out[64 * i + 8 * j + k] = (wz[k, 0] * sums[q] + wz[k, 1] * sums[q + 1]) + (
                    wz[k, 2] * sums[q + 2] + wz[k, 3] * sums[q + 3]
                )
    return True


@kernel
def grid_block(head, fdata, idata, gdata, x, y, z, n, known, out):
    """Values at n points; `known` is what the tape knows of them, see `frep/tape.py`."""
    if head[G_CUBIC]:
        if not (known & SEPARABLE and _cubic_separable(head, fdata, gdata, x, y, z, out)):
            _cubic_block(head, fdata, gdata, x, y, z, n, out)
        return
    for i in range(n):
        px, py, pz = np.float64(x[i]), np.float64(y[i]), np.float64(z[i])
        if px - px == 0.0 and py - py == 0.0 and pz - pz == 0.0:
            out[i] = grid_value(head, fdata, idata, gdata, px, py, pz)
        else:
            out[i] = math.nan


@kernel
def _span(lo, hi, n, periodic):
    """First and last cell of a range, and how far it lies outside."""
    if periodic:
        if not hi - lo < n:
            return 0, n - 1, 0.0
        first = math.floor(lo)
        return int(first), int(math.floor(hi)), 0.0
    outside = max(max(-lo, hi - n), 0.0)
    return int(min(max(math.floor(lo), 0.0), n - 1.0)), int(min(max(math.floor(hi), 0.0), n - 1.0)), outside


@kernel
def grid_interval(head, fdata, gdata, box):
    """Bounds over a box (lo and hi of the three coordinates)."""
    for c in range(6):
        if not box[c] - box[c] == 0.0:
            return -math.inf, math.inf
    f = head[G_FLOATS]
    nx, ny, nz = head[G_NX], head[G_NY], head[G_NZ]
    periodic = head[G_PERIODIC] != 0
    i0, i1, ex = _span((box[0] - fdata[f]) / fdata[f + 3], (box[3] - fdata[f]) / fdata[f + 3], nx, periodic)
    j0, j1, ey = _span((box[1] - fdata[f + 1]) / fdata[f + 4], (box[4] - fdata[f + 1]) / fdata[f + 4], ny, periodic)
    k0, k1, ez = _span((box[2] - fdata[f + 2]) / fdata[f + 5], (box[5] - fdata[f + 2]) / fdata[f + 5], nz, periodic)
    # Climb the pyramid until the range is a few cells wide.
    base, level = head[G_PYRAMID], 0
    mx, my, mz = nx, ny, nz
    while level + 1 < head[G_LEVELS] and max(max(i1 - i0, j1 - j0), k1 - k0) > 4:
        base += 2 * mx * my * mz
        mx, my, mz = (mx + 1) // 2, (my + 1) // 2, (mz + 1) // 2
        i0, i1, j0, j1, k0, k1 = i0 >> 1, i1 >> 1, j0 >> 1, j1 >> 1, k0 >> 1, k1 >> 1
        level += 1
    lo, hi = math.inf, -math.inf
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            for k in range(k0, k1 + 1):
                c = base + 2 * (((i % mx) * my + j % my) * mz + k % mz)
                lo = min(lo, gdata[c])
                hi = max(hi, gdata[c + 1])
    ex, ey, ez = ex * fdata[f + 3], ey * fdata[f + 4], ez * fdata[f + 5]
    return lo, hi + math.sqrt(ex * ex + ey * ey + ez * ez)
