"""The 256 cases of marching cubes, derived instead of copied.

A cell has eight corners, numbered `4 dx + 2 dy + dz`; bit `c` of its *case* is set when corner `c` is inside. The
surface meets a face of the cell in segments, one for each run of inside corners round the face: on an ambiguous face
(two inside corners, diagonally opposite) that cuts off the two inside corners one by one. The rule looks at the face
alone, so the two cells that share it agree. The segments chain into loops, each edge with a sign change in exactly
one loop, and every loop is cut into triangles by diagonals that never join two points of one face of the cell.

What follows, for any signs whatever: each segment is an edge of exactly two triangles (one in each cell of its face),
each diagonal of exactly two (both in its cell, for a neighbour could repeat it only inside a shared face), and the
triangles round a vertex form one closed fan (four cells round a grid edge, one loop each). The mesh is closed,
oriented, and manifold at edges and vertices. What does not follow: the right topology of the trilinear interpolant,
whose ambiguous cells have other solutions, and freedom from self-intersection.

Source: Lorensen and Cline 1987 for the method, Montani, Scateni and Scopigno 1994 for the rule on faces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

CORNERS = [(c >> 2, c >> 1 & 1, c & 1) for c in range(8)]
"""Offset (dx, dy, dz) of each corner of a cell."""

EDGES = [(axis, c) for axis in range(3) for c in range(8) if not c >> (2 - axis) & 1]
"""The twelve edges: the axis each runs along and the corner at its lower end, which *owns* it."""

_AXIS_BIT = (4, 2, 1)
_EDGE_OF = {frozenset((c, c | _AXIS_BIT[axis])): e for e, (axis, c) in enumerate(EDGES)}


@dataclass(frozen=True, eq=False)
class CaseTable:
    """The triangles of each case.

    Attributes:
        counts: (256,) uint8, number of triangles.
        triangles: (256, most, 3) uint8, edge numbers (rows of `EDGES`), counter-clockwise seen from outside; the rest
            is zero.
    """

    counts: np.ndarray
    triangles: np.ndarray


def _faces() -> list[tuple[int, int, int, int]]:
    """Corners of the six faces of a cell, each counter-clockwise seen from outside the cell."""
    faces = []
    for axis in range(3):
        a, b, c = _AXIS_BIT[axis], _AXIS_BIT[(axis + 1) % 3], _AXIS_BIT[(axis + 2) % 3]
        faces.append((a, a | b, a | b | c, a | c))
        faces.append((0, c, b | c, b))
    return faces


_FACES = _faces()
_FACES_OF_EDGE = [
    {f for f, face in enumerate(_FACES) if c in face and c | _AXIS_BIT[axis] in face} for axis, c in EDGES
]
_MIDPOINTS = [tuple(CORNERS[c][k] + (0.5 if k == axis else 0.0) for k in range(3)) for axis, c in EDGES]


def loops(case: int) -> list[list[int]]:
    """The closed chains of edge points of a case, counter-clockwise seen from outside the solid.

    Args:
        case: 0 to 255, bit `c` set when corner `c` is inside.

    Returns:
        Lists of edge numbers.
    """
    following: dict[int, int] = {}
    for face in _FACES:
        inside = [case >> c & 1 for c in face]
        for n in range(4):
            if inside[n] and not inside[n - 1]:  # a run of inside corners starts at n ...
                last = n
                while inside[(last + 1) % 4]:  # ... and ends here; the face has an outside corner, so this stops
                    last += 1
                enter = _EDGE_OF[frozenset((face[n - 1], face[n]))]
                leave = _EDGE_OF[frozenset((face[last % 4], face[(last + 1) % 4]))]
                following[enter] = leave
    chains = []
    while following:
        start, point = following.popitem()
        chain = [start]
        while point != start:
            chain.append(point)
            point = following.pop(point)
        chains.append(chain)
    return chains


def triangulate(loop: list[int]) -> list[tuple[int, int, int]] | None:
    """Cut a loop into triangles by the shortest diagonals none of which joins two points of one face.

    Args:
        loop: edge numbers in order.

    Returns:
        The triangles, turning as the loop does, or None when every triangulation has a diagonal in a face.
    """
    n = len(loop)

    def diagonal(i: int, j: int) -> float:
        if j - i == 1 or j - i == n - 1:
            return 0.0
        if _FACES_OF_EDGE[loop[i]] & _FACES_OF_EDGE[loop[j]]:
            return np.inf
        return sum((a - b) ** 2 for a, b in zip(_MIDPOINTS[loop[i]], _MIDPOINTS[loop[j]], strict=True))

    @cache
    def best(i: int, j: int) -> tuple[float, tuple[tuple[int, int, int], ...]]:
        """The cheapest triangulation of the polygon i, i + 1, ..., j."""
        if j - i < 2:
            return 0.0, ()
        choices = []
        for k in range(i + 1, j):
            left, right = best(i, k), best(k, j)
            cost = left[0] + right[0] + diagonal(i, k) + diagonal(k, j)
            choices.append((cost, (*left[1], (loop[i], loop[k], loop[j]), *right[1])))
        return min(choices)

    cost, triangles = best(0, n - 1)
    return list(triangles) if cost < np.inf else None


@cache
def case_table() -> CaseTable:
    """Derive the table (a few milliseconds, once a process)."""
    cases = []
    for case in range(256):
        triangles: list[tuple[int, int, int]] = []
        for loop in loops(case):
            cut = triangulate(loop)
            assert cut is not None, f"case {case}: every triangulation of loop {loop} has a diagonal in a face"
            triangles += cut
        cases.append(triangles)
    counts = np.array([len(triangles) for triangles in cases], dtype=np.uint8)
    table = np.zeros((256, int(counts.max()), 3), dtype=np.uint8)
    for case, triangles in enumerate(cases):
        table[case, : len(triangles)] = np.array(triangles, dtype=np.uint8).reshape(-1, 3)
    return CaseTable(counts, table)
