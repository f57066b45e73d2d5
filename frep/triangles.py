"""Kernels over indexed triangles: sums over faces, and which faces share which edge.

Everything is one counting pass over the corners, no sort: 8 M faces take a second or two and 0.4 GB.
*Half-edge* `3 f + k` runs from corner `k` of face `f` to the next one.
"""

from __future__ import annotations

import numpy as np

from frep.jit import kernel


# 5 ns a face when the vertices are in cache: nine loads, one square root.
@kernel
def volume_and_area(vertices, faces, origin):
    """Signed volume (divergence theorem about `origin`) and area."""
    x0, y0, z0 = origin[0], origin[1], origin[2]
    six_volumes = 0.0
    two_areas = 0.0
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = vertices[a, 0] - x0, vertices[a, 1] - y0, vertices[a, 2] - z0
        ux, uy, uz = vertices[b, 0] - x0 - ax, vertices[b, 1] - y0 - ay, vertices[b, 2] - z0 - az
        vx, vy, vz = vertices[c, 0] - x0 - ax, vertices[c, 1] - y0 - ay, vertices[c, 2] - z0 - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        six_volumes += ax * nx + ay * ny + az * nz
        two_areas += np.sqrt(nx * nx + ny * ny + nz * nz)
    return six_volumes / 6.0, two_areas / 2.0


# Three vertices gathered a face, six comparisons each; nothing written.
@kernel
def bounds_of_faces(vertices, faces):
    """(2, 3) lower and upper corner of the box round the vertices that faces use."""
    box = np.empty((2, 3), np.float64)
    for axis in range(3):
        low = high = vertices[faces[0, 0], axis]
        for f in range(faces.shape[0]):
            for k in range(3):
                x = vertices[faces[f, k], axis]
                low = min(low, x)
                high = max(high, x)
        box[0, axis], box[1, axis] = low, high
    return box


# Reads the vertices of each face once; writes one byte a face.
@kernel
def degenerate_faces(vertices, faces, tolerance):
    """For each face: 2 when it names a vertex twice, 1 when its corners lie on one line, else 0.

    On one line: the area is at most `tolerance` times the square of the longest edge.
    """
    kind = np.zeros(faces.shape[0], np.uint8)
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if a == b or b == c or c == a:
            kind[f] = 2
            continue
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz)
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        if 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz) <= tolerance * longest:
            kind[f] = 1
    return kind


# Two passes over the half-edges (count, scatter) and one over the buckets; a bucket holds about three edges.
@kernel
def pair_half_edges(faces, skip, n_vertices, twin):
    """Match the half-edges of each edge; fill `twin` and count the edges by kind.

    Args:
        faces: (m, 3).
        skip: (m,) uint8, faces with a nonzero entry `>= 2` take no part.
        n_vertices: one more than the largest index.
        twin: (3 m,) integers to fill: the other half-edge of an edge that exactly two faces share, else -1.

    Returns:
        Counts: edges, edges of one face, edges of more than two, edges of an odd number of faces, edges whose faces
        disagree on which side is out.
    """
    m = faces.shape[0]
    start = np.zeros(n_vertices + 1, np.int64)
    for f in range(m):
        if skip[f] >= 2:
            continue
        for k in range(3):
            start[min(faces[f, k], faces[f, (k + 1) % 3]) + 1] += 1
    for v in range(n_vertices):
        start[v + 1] += start[v]
    # Buckets by the smaller end; each sorted by the larger end.
    far = np.empty(start[n_vertices], faces.dtype)
    half = np.empty(start[n_vertices], twin.dtype)
    fill = start[:n_vertices].copy()
    for f in range(m):
        for k in range(3):
            twin[3 * f + k] = -1
            if skip[f] >= 2:
                continue
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            low, high = min(a, b), max(a, b)
            far[fill[low]] = high
            half[fill[low]] = 3 * f + k
            fill[low] += 1
    edges = 0
    single = 0
    many = 0
    odd = 0
    twisted = 0
    for v in range(n_vertices):
        lo, hi = start[v], start[v + 1]
        # Shell's sort: plain insertion for the usual handful, and still quick at the hub of a large fan.
        gap = 1
        while gap < (hi - lo) // 9:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(lo + gap, hi):
                x, h = far[i], half[i]
                j = i - gap
                while j >= lo and far[j] > x:
                    far[j + gap], half[j + gap] = far[j], half[j]
                    j -= gap
                far[j + gap], half[j + gap] = x, h
            gap //= 3
        i = lo
        while i < hi:
            j = i
            balance = 0
            while j < hi and far[j] == far[i]:
                h = half[j]
                balance += 1 if faces[h // 3, h % 3] == v else -1
                j += 1
            count = j - i
            edges += 1
            single += count == 1
            many += count > 2
            odd += count % 2
            twisted += abs(balance) > count % 2
            if count == 2:
                twin[half[i]], twin[half[i + 1]] = half[i + 1], half[i]
            i = j
    return edges, single, many, odd, twisted


# One step a corner, each a read of `twin` and of one face nearby.
@kernel
def broken_fans(faces, skip, twin, n_vertices):
    """Count the vertices used, and those whose faces do not form one fan (one disc, or one half disc at a border)."""
    corners = np.zeros(n_vertices, np.int32)
    first = np.zeros(n_vertices, twin.dtype)
    for f in range(faces.shape[0]):
        if skip[f] < 2:
            for k in range(3):
                corners[faces[f, k]] += 1
                first[faces[f, k]] = 3 * f + k
    used = 0
    broken = 0
    for v in range(n_vertices):
        if corners[v] == 0:
            continue
        used += 1
        seen = 1
        # At corner k of a face the two edges that end in v are the half-edges k and k + 2; leave by either.
        for side in (0, 2):
            f, k = first[v] // 3, first[v] % 3
            leave = (k + side) % 3
            closed = False
            while True:
                across = twin[3 * f + leave]
                if across < 0:
                    break
                f, e = across // 3, across % 3
                leave = (e + 2) % 3 if faces[f, e] == v else (e + 1) % 3
                if f == first[v] // 3:
                    closed = True
                    break
                seen += 1
                if seen > corners[v]:
                    break
            if closed or seen > corners[v]:
                break
        broken += seen != corners[v]
    return used, broken


# Union-find with path halving: a few reads a face on meshes whose neighbours are near in memory.
@kernel
def connected_components(faces, skip, n_vertices):
    """Count the pieces: groups of faces that hang together by vertices."""
    parent = np.arange(n_vertices)
    used = np.zeros(n_vertices, np.bool_)
    for f in range(faces.shape[0]):
        if skip[f] >= 2:
            continue
        used[faces[f, 0]] = True
        a = faces[f, 0]
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        for k in range(1, 3):
            used[faces[f, k]] = True
            b = faces[f, k]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a != b:
                # The smaller index becomes the root: no rank array, and roots stay near the front.
                low, high = min(a, b), max(a, b)
                parent[high] = low
                a = low
    pieces = 0
    for v in range(n_vertices):
        pieces += used[v] and parent[v] == v
    return pieces


# Buckets by the smallest corner, two faces each on average, each sorted.
@kernel
def duplicate_faces(faces, skip, n_vertices):
    """Count the faces that repeat the three vertices of another one, in any order."""
    m = faces.shape[0]
    start = np.zeros(n_vertices + 1, np.int64)
    for f in range(m):
        if skip[f] < 2:
            start[min(faces[f, 0], faces[f, 1], faces[f, 2]) + 1] += 1
    for v in range(n_vertices):
        start[v + 1] += start[v]
    keys = np.empty(start[n_vertices], np.uint64)
    fill = start[:n_vertices].copy()
    for f in range(m):
        if skip[f] < 2:
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            low, high = min(a, b, c), max(a, b, c)
            middle = np.int64(a) + np.int64(b) + np.int64(c) - low - high
            keys[fill[low]] = np.uint64(middle) << np.uint64(32) | np.uint64(high)
            fill[low] += 1
    repeats = 0
    for v in range(n_vertices):
        lo, hi = start[v], start[v + 1]
        gap = 1
        while gap < (hi - lo) // 9:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(lo + gap, hi):
                x = keys[i]
                j = i - gap
                while j >= lo and keys[j] > x:
                    keys[j + gap] = keys[j]
                    j -= gap
                keys[j + gap] = x
            gap //= 3
        for i in range(lo + 1, hi):
            repeats += keys[i] == keys[i - 1]
    return repeats
