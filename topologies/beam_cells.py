"""Unit cells of beams as tables of lines, and what makes a cell sound.

A table is a list of lines between points of the unit cube; `topologies.beams` scales it to millimetres. Coordinates are exact:
points that coincide in a limit of a parameter coincide to the last digit, so that degenerate cells merge by themselves.

The second half finds what is wrong with a cell that somebody wrote down: nodes and beams that meet by accident or miss each
other, in the cell and across its period.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

Point = tuple[float, float, float]
Line = tuple[Point, Point]

_MERGE = 1e-9
"""Nodes closer than this, of the period, are one."""
_MEET = 1e-6
"""Beams closer than this, of the period, meet."""
_NEAR = 1e-3
"""Distinct nodes closer than this, of the period, were meant to be one."""
_MATCH = 0.1
"""Loose ends at opposite faces closer than this, of the period, were meant to match."""

CORNERS: list[Point] = [(float(i), float(j), float(k)) for i, j, k in itertools.product((0, 1), repeat=3)]
CENTRE: Point = (0.5, 0.5, 0.5)
SIDES: list[Point] = [(0.0, 0.5, 0.5), (1.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 1.0, 0.5)]
TOPS: list[Point] = [(0.5, 0.5, 0.0), (0.5, 0.5, 1.0)]


# --- tables --------------------------------------------------------------------------------------------------------------


def table(lines: Iterable[Line]) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) and edges (m, 2) of lines: points that coincide are one node, lines without length go."""
    number: dict[Point, int] = {}
    nodes: list[Point] = []
    edges: list[tuple[int, int]] = []
    for line in lines:
        ends = []
        for x, y, z in line:
            key = (round(x, 12) + 0.0, round(y, 12) + 0.0, round(z, 12) + 0.0)
            if key not in number:
                number[key] = len(nodes)
                nodes.append((x, y, z))
            ends.append(number[key])
        edges.append((ends[0], ends[1]))
    kept = np.array([edge for edge in edges if edge[0] != edge[1]], np.int64)
    used, renumbered = np.unique(kept, return_inverse=True)
    return np.array(nodes, float)[used], renumbered.reshape(-1, 2)


def _spokes(hubs: Sequence[Point], ends: Sequence[Point], length: float) -> list[Line]:
    """Lines from every hub to the points that lie `length` away from it."""
    return [(a, b) for a in hubs for b in ends if math.isclose(math.dist(a, b), length)]


def _joined(points: Sequence[Point], length: float) -> list[Line]:
    """Lines between all points that lie `length` apart."""
    return [(a, b) for a, b in itertools.combinations(points, 2) if math.isclose(math.dist(a, b), length)]


def _at(axis: int, along: float, first: float, second: float) -> Point:
    """The point whose coordinate on `axis` is `along`, and on the next two axes, cyclically, `first` and `second`."""
    values = (along, first, second)
    return (values[-axis % 3], values[(1 - axis) % 3], values[(2 - axis) % 3])


def _cut(corner: float, tau: float) -> float:
    """The coordinate `tau` inward of a side (0 or 1) of the unit cell."""
    return 1.0 - tau if corner else tau


_BINARY = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
_SIGNS = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]


def cube() -> list[Line]:
    """The 12 edges of the cell (`E_cube` of lf-rep 3.1)."""
    return _joined(CORNERS, 1.0)


def uprights() -> list[Line]:
    """The 4 vertical edges of the cell (`E_z`)."""
    return [((i, j, 0.0), (i, j, 1.0)) for i, j in _BINARY]


def body() -> list[Line]:
    """The 8 half-diagonals from the centre (`E_body`)."""
    return _spokes([CENTRE], CORNERS, math.sqrt(0.75))


def sides() -> list[Line]:
    """The 16 half-diagonals of the four upright faces (`E_side`)."""
    return _spokes(SIDES, CORNERS, math.sqrt(0.5))


def faces() -> list[Line]:
    """The 24 half-diagonals of all faces (`E_side` and `E_top`)."""
    return _spokes([*SIDES, *TOPS], CORNERS, math.sqrt(0.5))


def diamond() -> list[Line]:
    """Table 3.2 of LF-rep as repaired in lf-rep 3.1; as printed the net falls in two, with loose ends."""
    inner = [(0.75, 0.25, 0.25), (0.25, 0.75, 0.25), (0.25, 0.25, 0.75), (0.75, 0.75, 0.75)]
    ends = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), *SIDES, *TOPS]
    return _spokes(inner, ends, math.sqrt(3.0) / 4.0)


def rhombicuboctahedron(tau: float) -> list[Line]:
    """Table 3.3 of LF-rep: (a) the squares on the faces, (b) the triangles at the corners. `tau` of the cell, 0 to 1/2."""
    lines = []
    for axis in range(3):
        for (p, r), swap in itertools.product(_BINARY, (False, True)):
            pair = (r, _cut(p, tau)) if swap else (_cut(p, tau), r)
            lines.append((_at(axis, tau, *pair), _at(axis, 1.0 - tau, *pair)))
        for along, (p, q) in itertools.product((tau, 1.0 - tau), _BINARY):
            lines.append((_at(axis, along, _cut(p, tau), q), _at(axis, along, p, _cut(q, tau))))
    return lines


def truncated_cube(tau: float) -> list[Line]:
    """Table 3.4 of LF-rep, with the last row's ranges repaired. `tau` of the cell, 0 to 1/2."""
    lines = []
    for axis, (p, q) in itertools.product(range(3), _BINARY):
        lines.append((_at(axis, tau, p, q), _at(axis, 1.0 - tau, p, q)))
        for face in (0.0, 1.0):
            lines.append((_at(axis, face, _cut(p, tau), q), _at(axis, face, p, _cut(q, tau))))
    return lines


def truncated_octahedron(setback: float) -> list[Line]:
    """Squares of half-diagonal `setback` of the cell on its faces, and the edges between them.

    0 is the octahedron, 1/4 the Kelvin cell, 1/2 the cuboctahedron (part C of the LatticeRobot specification).
    """
    s = setback
    lines = []
    for axis in range(3):
        for (a, b), face in itertools.product(_SIGNS, (0.0, 1.0)):
            lines.append((_at(axis, face, 0.5 + a * s, 0.5), _at(axis, face, 0.5, 0.5 + b * s)))
        for a, b in _SIGNS:
            lines.append(
                (_at(axis, 0.5, 0.5 + 0.5 * a, 0.5 + b * s), _at(axis, 0.5, 0.5 + a * s, 0.5 + 0.5 * b)),
            )
    return lines


def vintiles() -> list[Line]:
    """The Kelvin net, half a cell up: twelve nodes of four beams, its squares on the ends and in the middle of the height."""
    return [
        ((ax, ay, az + 0.5), (bx, by, bz + 0.5)) for (ax, ay, az), (bx, by, bz) in truncated_octahedron(setback=0.25)
    ]


def truncated_cuboctahedron() -> list[Line]:
    """48 nodes, permutations of (1, 1 + sqrt 2, 1 + 2 sqrt 2) about the centre, its octagons on the faces of the cell."""
    edge = 1.0 / (1.0 + 2.0 * math.sqrt(2.0))
    offsets = (0.5 * edge, 0.5 * (1.0 + math.sqrt(2.0)) * edge, 0.5)
    nodes = [
        (0.5 + i * x, 0.5 + j * y, 0.5 + k * z)
        for x, y, z in itertools.permutations(offsets)
        for i, j, k in itertools.product((-1.0, 1.0), repeat=3)
    ]
    return _joined(nodes, edge)


def rhombic_dodecahedron() -> list[Line]:
    """Edges of the Voronoi cells of the FCC sites: every tetrahedral hole joined to its four octahedral holes."""
    tetrahedral = [(x, y, z) for x, y, z in itertools.product((0.25, 0.75), repeat=3)]
    halves = [(x, y, z) for x, y, z in itertools.product((0.0, 0.5, 1.0), repeat=3)]
    octahedral = [p for p in halves if p.count(0.5) % 2 == 1]
    return _spokes(tetrahedral, octahedral, math.sqrt(3.0) / 4.0)


def weaire_phelan(c: float) -> list[Line]:
    """Edges of the Weaire-Phelan foam with flat faces: the power diagram of the A15 sites.

    The sites are 2a, (0, 0, 0) and (1/2, 1/2, 1/2), and 6c, (1/2, 1/4, 0) and its like. The face between the 2a site at the
    origin and its neighbour (1/2, 1/4, 0) lies in x + y/2 = c; c = 5/16 where neither site has a power. The twelve such planes
    cut a pyritohedron with the vertices 2c/3 (1, 1, 1) (sites 16i) and (0, c/2, c) (24k), of volume 4 c^3. The vertices that
    remain (6d), (0, 1/4, 1/2) and their like, are equally far from four 6c sites. So c = 5/16 gives Voronoi cells and
    c = 32^(-1/3) the foam, whose eight cells are equally large.
    """
    x = 2.0 * c / 3.0
    lines: list[Line] = []
    for i, j, k in itertools.product((-1.0, 1.0), repeat=3):
        corner = (i * x, j * x, k * x)
        lines += [(corner, _at(axis, 0.0, 0.5 * a * c, b * c)) for axis, a, b in ((0, j, k), (1, k, i), (2, i, j))]
    for axis, (a, b) in itertools.product(range(3), _SIGNS):
        if a > 0:
            lines.append((_at(axis, 0.0, -0.5 * c, b * c), _at(axis, 0.0, 0.5 * c, b * c)))
        lines.append((_at(axis, 0.0, 0.5 * a * c, b * c), _at(axis, 0.0, 0.25 * a, 0.5 * b)))
    # The cell at the centre is the one at the corner, mirrored in a diagonal plane.
    lines += [(_swapped(a), _swapped(b)) for a, b in lines]
    y = 0.5 - x
    signs = itertools.product((-1.0, 1.0), repeat=3)
    return lines + [((i * x, j * x, k * x), (i * y, j * y, k * y)) for i, j, k in signs]


def _swapped(p: Point) -> Point:
    return (p[0] + 0.5, p[2] + 0.5, p[1] + 0.5)


def supported_cubic() -> list[Line]:
    """The edges of the cell, and from the middle of every upright a strut to the middle of the four beams above it."""
    middle = [(i, j, 0.5) for i, j in _BINARY]
    above = [(0.5, 0.0, 1.0), (0.5, 1.0, 1.0), (0.0, 0.5, 1.0), (1.0, 0.5, 1.0)]
    below = [(x, y, 0.0) for x, y, _ in above]
    return [*_spokes([*middle, *above, *below], CORNERS, 0.5), *_spokes(middle, above, math.sqrt(0.5))]


# Layers: a plane net at z = 0, and a column from each of its nodes to the next layer.

Net = list[tuple[tuple[float, float], tuple[float, float]]]


def honeycomb(rib: float) -> Net:
    """Hexagons with two sides along y, of length `rib` of the period in y: regular at 1/3, bricks at 1/2, re-entrant above."""
    h = 0.5 * rib
    return [
        ((0.0, -h), (0.0, h)),
        ((0.5, 0.5 - h), (0.5, 0.5 + h)),
        *(((0.0, h), (x, 0.5 - h)) for x in (-0.5, 0.5)),
        *(((0.0, 1.0 - h), (x, 0.5 + h)) for x in (-0.5, 0.5)),
    ]


def triangles() -> Net:
    """Triangles with one side along x: six beams at every node."""
    return [
        ((0.0, 0.0), (1.0, 0.0)),
        ((0.5, 0.5), (1.5, 0.5)),
        *(((0.5, 0.5), corner) for corner in _BINARY),
    ]


def kagome() -> Net:
    """Triangles and hexagons in turn: the middles of the sides of `triangles`, four beams at every node."""
    rows = [((x, y), (x + 0.5, y)) for x in (0.25, 0.75) for y in (0.25, 0.75)]
    ends = [(0.5, 0.0), (0.5, 1.0), (0.0, 0.5), (1.0, 0.5)]
    inner = [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)]
    return rows + [(a, b) for a in ends for b in inner if math.isclose(math.dist(a, b), math.sqrt(0.125))]


def squares() -> Net:
    """A square net."""
    return [((0.0, 0.0), (1.0, 0.0)), ((0.0, 0.0), (0.0, 1.0))]


def columns(net: Net) -> list[Line]:
    """A column of the height of the cell at every node of a plane net, once a period."""
    found = {}
    for x, y in itertools.chain.from_iterable(net):
        found.setdefault((round(x % 1.0, 9) % 1.0, round(y % 1.0, 9) % 1.0), (x % 1.0, y % 1.0))
    return [((x, y, 0.0), (x, y, 1.0)) for x, y in found.values()]


def layers(net: Net) -> list[Line]:
    """A plane net at z = 0 and the columns that carry it."""
    return [((*a, 0.0), (*b, 0.0)) for a, b in net] + columns(net)


# --- what makes a cell sound ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fault:
    """Something wrong with a cell.

    Attributes:
        kind: "coincident nodes", "unmatched nodes", "overlapping beams", "crossing beams", "dangling node", "lone node" or
            "separate parts".
        message: what, which, where and what to do, after the name of the argument it came in by.
        items: numbers of the nodes or edges.
        point: where, in mm; None for a fault of the whole.
    """

    kind: str
    message: str
    items: tuple[int, ...]
    point: Point | None = None

    def __str__(self) -> str:
        return self.message


def folded(nodes: np.ndarray, period: np.ndarray) -> np.ndarray:
    """(n,) numbers of the nodes of a period: equal for nodes that are whole periods apart."""
    places = np.round(np.mod(np.round(nodes / period, 9), 1.0), 9) % 1.0
    return np.unique(places, axis=0, return_inverse=True)[1].reshape(-1)


def distinct_edges(nodes: np.ndarray, edges: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Numbers of the edges that are not whole-period shifts of earlier ones."""
    ends, number = nodes[edges] / period, folded(nodes, period)[edges]
    run = np.round(ends[:, 1] - ends[:, 0], 9) + 0.0
    seen: set[tuple] = set()
    keep = []
    for i, (a, b) in enumerate(number.tolist()):
        forward, backward = (a, b, *run[i].tolist()), (b, a, *(0.0 - run[i]).tolist())
        if not seen.intersection((forward, backward)):
            keep.append(i)
            seen.update((forward, backward))
    return np.array(keep, np.int64)


def faults(nodes: np.ndarray, edges: np.ndarray, period: np.ndarray) -> list[Fault]:
    """Everything wrong with a cell, the worst first. `nodes` in mm; those that no edge uses are told, and not looked at."""
    distinct = distinct_edges(nodes, edges, period)
    loose = _loose_ends(nodes, edges[distinct], period)
    found = _coincident(nodes, np.unique(edges), period) + _mismatched(nodes, loose, period)
    found += _meetings(nodes, edges, distinct, period) + _dangling(nodes, loose, period)
    # A node without a beam may be the copy, a period away, of one that has some.
    number = folded(nodes, period)
    for i in np.flatnonzero(~np.isin(number, number[edges])).tolist():
        text = f"nodes: no beam ends at node {i} at {_text(nodes[i])}; a node ball there would hang in the air"
        found.append(Fault("lone node", text, (i,), _place(nodes[i])))
    parts = pieces(nodes, edges[distinct], period)
    if parts != 1:
        count = f"{parts:.0f} parts that never touch" if math.isfinite(parts) else "columns or layers that never touch"
        found.append(Fault("separate parts", f"edges: the lattice falls into {count}", ()))
    return found


def _text(point: Iterable[float]) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in point) + ") mm"


def _place(point: np.ndarray) -> Point:
    x, y, z = point.tolist()
    return (x, y, z)


def _coincident(nodes: np.ndarray, used: np.ndarray, period: np.ndarray) -> list[Fault]:
    """Nodes given twice, and nodes that miss each other by a hair, in the cell or across the period."""
    found = []
    for a, i in enumerate(used.tolist()):
        others = used[a + 1 :]
        apart = (nodes[others] - nodes[i]) / period
        shift = np.round(apart)
        gap = np.linalg.norm((apart - shift) * period, axis=1)
        given_twice = (gap <= _MERGE * period.max()) & ~shift.any(axis=1)
        near = (gap > _MERGE * period.max()) & (gap <= _NEAR * period.min())
        for k in np.flatnonzero(given_twice | near):
            j = int(others[k])
            if given_twice[k]:
                kind, text = "coincident nodes", f"node {i} and node {j} are both at {_text(nodes[i])}; give it once"
            elif shift[k].any():
                text = f"node {i} at {_text(nodes[i])} misses node {j} at {_text(nodes[j])} across the period"
                kind, text = "unmatched nodes", f"{text} by {gap[k]:.3g} mm; move one"
            else:
                text = f"node {i} and node {j} are {gap[k]:.3g} mm apart at {_text(nodes[i])}; make them one"
                kind = "coincident nodes"
            found.append(Fault(kind, f"nodes: {text}", (i, j), _place(nodes[i])))
    return found


def _loose_ends(nodes: np.ndarray, edges: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Nodes at which one beam ends and no other starts."""
    number = folded(nodes, period)
    valence = np.bincount(number[edges].reshape(-1), minlength=len(nodes))
    used = np.unique(edges)
    return used[valence[number[used]] == 1]


def _mismatched(nodes: np.ndarray, loose: np.ndarray, period: np.ndarray) -> list[Fault]:
    """Loose ends at opposite faces of the cell, one of them on its face, that nearly face each other."""
    found = []
    for axis, name in enumerate("xyz"):
        along = nodes[loose, axis] / period[axis]
        low, high = (np.flatnonzero(np.abs(along - side) <= _MATCH) for side in (0.0, 1.0))
        for a, b in itertools.product(low.tolist(), high.tolist()):
            i, j = int(loose[a]), int(loose[b])
            apart = (nodes[j] - nodes[i]) / period
            gap = float(np.linalg.norm((apart - np.round(apart)) * period))
            on_face = min(abs(along[a]), abs(along[b] - 1.0)) <= _MERGE
            if on_face and _NEAR * period.min() < gap <= _MATCH * period.min():
                text = (
                    f"node {i} at {_text(nodes[i])} and node {j} at {_text(nodes[j])} face each other across the period"
                )
                text = f"nodes: {text} in {name} and do not match, by {gap:.3g} mm"
                found.append(Fault("unmatched nodes", text, (i, j), _place(nodes[i])))
    return found


def _dangling(nodes: np.ndarray, loose: np.ndarray, period: np.ndarray) -> list[Fault]:
    found = []
    for i in loose.tolist():
        share = nodes[i] / period
        on = [f"{'xyz'[k]} = {nodes[i, k]:g}" for k in range(3) if abs(share[k] - round(share[k])) <= _MERGE]
        reason = f", on the face {on[0]}, and none continues beyond it" if on else ""
        text = f"nodes: only one beam ends at node {i} at {_text(nodes[i])}{reason}"
        found.append(Fault("dangling node", text, (i,), _place(nodes[i])))
    return found


def _meetings(nodes: np.ndarray, edges: np.ndarray, distinct: np.ndarray, period: np.ndarray) -> list[Fault]:
    """Beams that meet elsewhere than at a node of both, in the cell or across the period.

    Each beam is shifted so that its middle lies in the cell; boxes round the beams and their shifts leave a few pairs, which are
    compared as segments. Quadratic: three seconds for 5,000 beams a period.
    """
    ends = nodes[edges[distinct]]
    ends = ends - (np.floor(ends.mean(axis=1) / period) * period)[:, None, :]
    low, high = ends.min(axis=1), ends.max(axis=1)
    tolerance = _MEET * period.max()
    found = []
    for i in range(len(ends)):
        shifts = _shifts(
            (low[i] - high.max(axis=0) - tolerance) / period, (high[i] - low.min(axis=0) + tolerance) / period
        )
        near = np.ones((len(ends) - i, len(shifts)), bool)
        for axis in range(3):
            moved = shifts[:, axis] * period[axis]
            near &= low[i:, axis, None] + moved <= high[i, axis] + tolerance
            near &= high[i:, axis, None] + moved >= low[i, axis] - tolerance
        # A beam meets its own shift forth where it meets its shift back.
        near[0] &= [tuple(shift) > (0.0, 0.0, 0.0) for shift in shifts]
        others, which = np.nonzero(near)
        if len(others) == 0:
            continue
        other = ends[i + others] + (shifts[which] * period)[:, None, :]
        kind, point = _meet(ends[i], other, tolerance)
        for k in np.flatnonzero(kind):
            numbers = (int(distinct[i]), int(distinct[i + others[k]]))
            found.append(_meeting(numbers, int(kind[k]), point[k], period))
    return found


def _shifts(least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """(n, 3) whole numbers of periods between two bounds."""
    ranges = [np.arange(math.ceil(lo), math.floor(hi) + 1) for lo, hi in zip(least, most, strict=True)]
    return np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)


def _meeting(numbers: tuple[int, int], kind: int, point: np.ndarray, period: np.ndarray) -> Fault:
    place = point - np.floor(point / period + _MERGE) * period
    what = "cross" if kind == 1 else "run along each other"
    who = f"edge {numbers[0]} and edge {numbers[1]}" if numbers[0] != numbers[1] else f"edge {numbers[0]} and its copy"
    text = f"edges: {who} {what} at {_text(place)}; split them at a node there"
    return Fault("crossing beams" if kind == 1 else "overlapping beams", text, numbers, _place(place))


def _meet(segment: np.ndarray, others: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """How a segment (2, 3) meets others (n, 2, 3): 0 not or at ends of both, 1 crossing, 2 along a stretch; and where."""
    p, d = segment[0], segment[1] - segment[0]
    q, e = others[:, 0], others[:, 1] - others[:, 0]
    a, c = d @ d, np.einsum("ij,ij->i", e, e)
    b, r = e @ d, p - q
    f, g = np.einsum("ij,ij->i", e, r), r @ d
    denominator = a * c - b * b
    parallel = denominator <= 1e-14 * a * c
    # The closest points of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
    s = np.clip((b * f - g * c) / np.where(parallel, 1.0, denominator), 0.0, 1.0)
    t = np.clip((b * s + f) / c, 0.0, 1.0)
    s = np.clip((b * t - g) / a, 0.0, 1.0)
    here, there = p + s[:, None] * d, q + t[:, None] * e
    close = np.linalg.norm(here - there, axis=1) <= tolerance
    # Lines that are not parallel meet once: at a common end, if they have one.
    gaps = np.linalg.norm(segment[None, :, None, :] - others[:, None, :, :], axis=3)
    common = gaps.reshape(len(others), 4).min(axis=1) <= tolerance
    kind = (close & ~parallel & ~common).astype(int)
    # Parallel: the stretch of the one that the other covers.
    along = np.sort(np.stack([-g, b - g], axis=1) / a, axis=1)
    beside = np.linalg.norm(r - (g / a)[:, None] * d, axis=1) <= tolerance
    first, last = np.maximum(along[:, 0], 0.0), np.minimum(along[:, 1], 1.0)
    kind[parallel & beside & ((last - first) * math.sqrt(a) > tolerance)] = 2
    return kind, np.where((kind == 2)[:, None], p + (0.5 * (first + last))[:, None] * d, here)


def pieces(nodes: np.ndarray, edges: np.ndarray, period: np.ndarray) -> float:
    """How many separate parts the endless lattice has: 1 for a sound cell, infinity for columns and layers.

    The nodes of a period hang together along a tree of edges; every further edge closes a loop, which returns some whole periods
    away. A part has as many copies as there are classes of periods modulo those returns: the determinant of their lattice.
    """
    number = folded(nodes, period)
    places = nodes / period
    base = {k: places[i] for i, k in reversed(list(enumerate(number.tolist())))}
    arcs: dict[int, list[tuple[int, tuple[int, ...]]]] = {}
    for i, j in edges.tolist():
        a, b = int(number[i]), int(number[j])
        jump = np.rint((places[j] - base[b]) - (places[i] - base[a])).astype(int)
        arcs.setdefault(a, []).append((b, tuple(jump.tolist())))
        arcs.setdefault(b, []).append((a, tuple((-jump).tolist())))
    total, seen = 0.0, {}
    for start in arcs:
        if start in seen:
            continue
        seen[start], queue, loops = (0, 0, 0), [start], []
        while queue:
            a = queue.pop()
            for b, jump in arcs[a]:
                cell = tuple(x + y for x, y in zip(seen[a], jump, strict=True))
                if b not in seen:
                    seen[b] = cell
                    queue.append(b)
                else:
                    loops.append([x - y for x, y in zip(cell, seen[b], strict=True)])
        total += _index(loops)
    return total


def _index(vectors: list[list[int]]) -> float:
    """Index in Z^3 of the lattice that integer vectors span, by elimination; infinity if they span less than space."""
    rows = [v for v in vectors if any(v)]
    index = 1
    for column in range(3):
        while len(busy := [v for v in rows if v[column]]) > 1:
            pivot = min(busy, key=lambda v: abs(v[column]))
            for v in busy:
                if v is not pivot:
                    ratio = v[column] // pivot[column]
                    v[:] = [x - ratio * y for x, y in zip(v, pivot, strict=True)]
        if not busy:
            return math.inf
        index *= abs(busy[0][column])
        rows = [v for v in rows if v is not busy[0] and any(v)]
    return float(index)
