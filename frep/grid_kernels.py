"""Sampled grids in compiled code: trilinear or cubic values at points, bounds over boxes from a min/max pyramid.

A grid holds coarse nodes everywhere and, where the data asks for it, fine blocks of 9 x 9 x 9 nodes that refine one coarse cell
eightfold (`frep/sampled.py` packs it). A periodic grid wraps. Outside a grid that does not wrap, the value at the nearest
point of its box is continued with slope one, which keeps the sign of a signed distance.
"""

from __future__ import annotations

import math

import numpy as np

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
def _cubic_block(head, fdata, gdata, x, y, z, n, out):
    """Periodic cubic B-spline (twice continuously differentiable), 64 coefficients a point in 16 rows of four.

    The coefficients carry three wrapped layers past each end (see `frep/sampled.py`), so that no index wraps inside the
    loop: about 15 ns a point.
    """
    f = head[G_FLOATS]
    nx, ny, nz = head[G_NX], head[G_NY], head[G_NZ]
    sz = nz + 3
    sy = (ny + 3) * sz
    base = head[G_NODES]
    # Everything in the number type of x, so that float32 blocks stay float32.
    one = x[0] - x[0] + np.float32(1.0)
    third, sixth = one / np.float32(3.0), one / np.float32(6.0)
    consts = np.empty(6, x.dtype)
    for a in range(3):
        consts[a] = fdata[f + a]
        consts[3 + a] = 1.0 / fdata[f + 3 + a]
    ox, oy, oz, rx, ry, rz = consts[0], consts[1], consts[2], consts[3], consts[4], consts[5]
    w = np.empty((3, 4), x.dtype)
    for p in range(n):
        if not (x[p] - x[p] == 0.0 and y[p] - y[p] == 0.0 and z[p] - z[p] == 0.0):
            out[p] = math.nan
            continue
        u, v, t = (x[p] - ox) * rx, (y[p] - oy) * ry, (z[p] - oz) * rz
        fu, fv, ft = np.floor(u), np.floor(v), np.floor(t)
        i, j, k = int(fu) % nx, int(fv) % ny, int(ft) % nz
        u, v, t = u - fu, v - fv, t - ft
        for a in range(3):
            s = u if a == 0 else (v if a == 1 else t)
            r = one - s
            w[a, 0] = r * r * r * sixth
            w[a, 1] = third + third + s * s * (s * np.float32(0.5) - one)
            w[a, 2] = third + third + r * r * (r * np.float32(0.5) - one)
            w[a, 3] = s * s * s * sixth
        z0, z1, z2, z3 = w[2, 0], w[2, 1], w[2, 2], w[2, 3]
        total = one - one
        start = base + i * sy + j * sz + k
        for a in range(4):
            plane = one - one
            for b in range(4):
                c = start + a * sy + b * sz
                row = z0 * gdata[c] + z1 * gdata[c + 1] + z2 * gdata[c + 2] + z3 * gdata[c + 3]
                plane += w[1, b] * row
            total += w[0, a] * plane
        out[p] = total


@kernel
def grid_block(head, fdata, idata, gdata, x, y, z, n, out):
    """Values at n points."""
    if head[G_CUBIC]:
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
