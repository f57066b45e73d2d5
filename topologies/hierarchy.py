"""Lattices of lattices: parts whose inside is a lattice (`filled`), graphs whose beams are girders (`trussed`).

Both nest, to any level (LF-rep 3 and future work: parameters of parameters). `filled` takes any solid: beams, sheets, bodies.
`trussed` takes an explicit graph and gives one back, with nodes and beams that can be counted, measured and trussed again.
`topologies.steady.lattice_in_lattice` keeps the whole beams of a fine lattice inside a coarse one, of any size.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, Solid, TooLargeError, as_field, intersection, union
from frep.arguments import one_of, positive, real
from frep.errors import warn
from frep.skeleton import GraphSkeleton

from .beam_topology import BeamTopology

MOST_BEAMS = 5_000_000
"""What `trussed` makes at most."""

PATTERNS = ("warren", "pratt", "howe", "cross", "spiral", "none")
"""How the diagonals of a girder run."""

SHORT = ("refuse", "plain")
"""What becomes of beams too short for a girder."""

_CLEARANCE = 1.2
"""How much further than where they touch the end rings of neighbouring girders lie from their node."""


class NoInsideWarning(UserWarning):
    """A skin so thick that nothing is left inside it."""


# --- solids in solids ----------------------------------------------------------------------------------------------------


def filled(outer: Solid, inner: Solid, skin: FieldLike = 0.0) -> Solid:
    """A solid whose inside is another, usually an infinite lattice, under an optional skin.

    Args:
        outer: a lattice, a sheet, a body, bounded or not.
        inner: what its inside becomes; it may be filled itself.
        skin: thickness in mm of a wall inside the surface of `outer`, a number or a Field; 0 for none. Without it, inner beams
            that only graze the outer solid may come out as loose pieces.

    The skin follows the whole surface: cut a box out of the result to see inside, and out of `outer` to have its cuts closed.
    It is `skin` mm thick where the field of `outer` is the distance to its surface: in bodies and primitives, in beams of one
    diameter, in sheets measured by "distance". Beams that swell by a Field have it square to their axis, so that along the
    normal it is thinner by 1 / sqrt(1 + slope^2) of their radius; a sheet of another scale has it as true as its wall. In the
    crease between two beams it fills in where both surfaces are near.

    Raises:
        ArgumentTypeError: something that is no Solid.
        ArgumentError: a negative skin.

    Warns:
        NoInsideWarning: two skins that fill the thinnest wall or beam of `outer`.

    Example:
        A sandwich wall, two skins of 0.4 mm and a lattice between them:

        >>> import frep
        >>> from topologies import beams, tpms
        >>> wall = filled(tpms.gyroid(cell=20).sheet(4), beams.bcc(cell=2).thicken(0.4), skin=0.4)
        >>> part = wall & frep.box((0, 0, 0), (40, 40, 40))

        Beams of beams of beams:

        >>> fine, mid, coarse = (beams.simple_cubic(u).thicken(u / 4) for u in (1, 4, 16))
        >>> three = filled(coarse, filled(mid, fine)) & frep.box((0, 0, 0), (16, 16, 16))
    """
    for name, value in (("outer", outer), ("inner", inner)):
        if not isinstance(value, Solid):
            raise ArgumentTypeError(f"{name}: expected a Solid, got {type(value).__name__}: {value!r}")
    depth = as_field(skin, "skin")
    if depth.is_constant and depth.data < 0.0:
        raise ArgumentError(f"skin: expected a thickness >= 0 mm, got {depth.data:g}")
    core = intersection(outer, inner)
    if depth.is_constant and depth.data == 0.0:
        return core
    _warn_of_no_inside(outer, depth)
    return union(core, outer.shell(depth))


def _warn_of_no_inside(outer: Solid, skin: Field) -> None:
    everywhere = np.array([[-np.inf] * 3, [np.inf] * 3])
    thin = float(skin.bounds(*everywhere)[0])
    for feature in outer.features:
        widest = float(feature.width.bounds(*everywhere)[1])
        if widest <= 2.0 * thin:
            warn(
                f"skin: {thin:g} mm on both sides fills the {feature.what}s of the outer solid, which are at most {widest:g} mm",
                NoInsideWarning,
            )


# --- girders -------------------------------------------------------------------------------------------------------------


def trussed(
    topology: BeamTopology,
    width: float,
    *,
    bays: int | None = None,
    pitch: float | None = None,
    sides: int = 3,
    pattern: str = "warren",
    setback: float | None = None,
    short: str = "refuse",
) -> BeamTopology:
    """A graph whose every beam is a lattice girder, joined at the nodes that there were: beams of beams.

    A girder has `sides` longerons on a circle round the old beam, a ring at either end of every bay, and diagonals on its
    sides. Its end rings are set back from the old nodes, and `sides` spokes join each to its node, where all girders meet.
    Girders lie in cones round their beams that do not meet: a girder never runs into its neighbour. The first longeron is
    where the first side of a square section looks (lf-rep 3.2): horizontally off the beam, or along x off a vertical one.

    Args:
        topology: an explicit graph; of a periodic cell take `.over(region)` first.
        width: diameter of the circle of the longerons, mm.
        bays: of every girder; or
        pitch: the length that bays should have, mm, of which every girder takes the nearest whole number. With neither, `width`.
        sides: longerons a girder, 3 or more.
        pattern: "warren": diagonals in zigzag from bay to bay; "pratt": falling towards the middle of the girder, "howe": rising
            towards it; "spiral": all one way; "cross": both, joined by a node where they cross; "none": none, a Vierendeel
            girder. Girders run from the first to the second node of the old beam.
        setback: distance from the old nodes to the end rings, mm; None for what each end needs: 1.2 times where it would touch
            the girder of its nearest neighbour, `width / 2 / tan(angle / 2)`, and at least half the width.
        short: what becomes of beams too short for a girder: "refuse" raises an error; "plain" leaves those a beam from node to
            node that have no room for half a bay between their end rings (half of `pitch`, or of `width` where it is None).
            Voronoi graphs, some of whose beams are always very short, want "plain".

    Returns:
        an explicit graph: first the old nodes that have beams, then the rings, girder by girder. With b bays, a girder of n sides
        has n (b + 1) nodes, 2 n spokes, n b longerons, n (b + 1) ring beams and n b diagonals; "cross" has n b nodes more and
        4 n b half diagonals, "none" no diagonals. Beams left plain come last.

    Raises:
        ArgumentTypeError: no beam topology, or a periodic one.
        ArgumentError: sizes that are not positive; both bays and pitch; fewer than 3 sides; an unknown pattern; a setback at
            which girders touch; a beam too short for its two ends: the message says which, and how many are; no beam long
            enough.
        TooLargeError: more than five million beams.

    Example:
        >>> from topologies import beams
        >>> coarse = beams.graph([(0, 0, 0), (40, 0, 0), (0, 40, 0)], [(0, 1), (0, 2)])
        >>> trussed(coarse, 4, bays=8)
        <trussed graph: 57 nodes, 162 beams>
        >>> twice = trussed(trussed(coarse, 8, bays=3), 0.8)

        A foam of girders, its shortest edges left as they are:

        >>> import frep
        >>> from topologies.stochastic import voronoi
        >>> foam = voronoi(frep.sphere((0, 0, 0), 40), cell_size=30, random_state=1)
        >>> girders = trussed(foam, 2, short="plain").thicken(0.4)
    """
    skeleton = _explicit(topology)
    radius = 0.5 * positive(width, "width")
    n = _whole(sides, "sides", 3)
    one_of(pattern, "pattern", PATTERNS)
    one_of(short, "short", SHORT)
    if bays is not None and pitch is not None:
        raise ArgumentError("bays, pitch: expected one of them, got both")
    used, number = np.unique(skeleton.edges, return_inverse=True)
    hubs, edges = skeleton.nodes[used], number.reshape(-1, 2)
    along = hubs[edges[:, 1]] - hubs[edges[:, 0]]
    lengths = np.linalg.norm(along, axis=1)
    back = _setbacks(hubs, edges, along / lengths[:, None], radius, setback)
    step = positive(pitch, "pitch") if pitch is not None else 2.0 * radius
    inner = lengths - back.sum(axis=1)
    long_enough = inner > 1e-9 * lengths if short == "refuse" else inner >= 0.5 * step
    if not long_enough.all() and (short == "refuse" or not long_enough.any()):
        _refuse_short(lengths, back, ~long_enough, radius, setback)
    plain = edges[~long_enough]
    edges, back, inner = edges[long_enough], back[long_enough], inner[long_enough]
    if bays is not None:
        counts = np.full(len(edges), _whole(bays, "bays", 1))
    else:
        counts = np.maximum(np.rint(inner / step), 1).astype(np.int64)
    per_bay = {"cross": 6, "none": 2}.get(pattern, 3)
    total = int(n * (3 * len(edges) + per_bay * counts.sum())) + len(plain)
    if total > MOST_BEAMS:
        raise TooLargeError(
            f"trussed: {total:,} beams, more than {MOST_BEAMS:,}; take fewer bays or a smaller region, or `filled`, whose inner "
            "lattice repeats without being stored"
        )
    nodes, beams = _girders(hubs, edges, back, counts, radius, n, pattern)
    return BeamTopology(GraphSkeleton(nodes, np.concatenate([beams, plain])), f"trussed {topology.label}")


def _refuse_short(lengths: np.ndarray, back: np.ndarray, short: np.ndarray, radius: float, setback: Any) -> None:
    """Raise, naming the beam that lacks most."""
    i = int(np.argmin(lengths - back.sum(axis=1)))
    fits = "a smaller setback"
    if setback is None:
        fits = f"less than {2.0 * radius * float((lengths / back.sum(axis=1)).min()):.3g} mm"
    count = int(np.count_nonzero(short))
    rest = f'short="plain" leaves beams too short as they are, {count:,} of {len(short):,}'
    if count == len(short):
        rest = "no beam is long enough"
    raise ArgumentError(
        f"width: {2.0 * radius:g} mm is too wide for beam {i}, {lengths[i]:.3g} mm long, whose ends take "
        f"{back[i, 0]:.3g} and {back[i, 1]:.3g} mm; expected {fits}; {rest}"
    )


def _whole(value: Any, name: str, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ArgumentTypeError(f"{name}: expected a whole number, got {value!r}")
    if value < least:
        raise ArgumentError(f"{name}: expected at least {least}, got {value}")
    return int(value)


def _explicit(topology: Any) -> GraphSkeleton:
    if not isinstance(topology, BeamTopology):
        raise ArgumentTypeError(f"topology: expected a beam topology, got {type(topology).__name__}: {topology!r}")
    if not isinstance(topology.skeleton, GraphSkeleton):
        raise ArgumentTypeError(
            f"topology: expected an explicit graph, got {topology!r}, which repeats without end; take its beams "
            "in a region first: `trussed(topology.over(region), ...)`"
        )
    if len(topology.skeleton.edges) == 0:
        raise ArgumentError(f"topology: expected beams, got {topology!r}")
    return topology.skeleton


def _setbacks(hubs: np.ndarray, edges: np.ndarray, along: np.ndarray, radius: float, setback: Any) -> np.ndarray:
    """(m, 2) distances of the end rings of each beam from its nodes, mm."""
    # At each node the beams that leave it, and the smallest angle of each to another.
    ends = np.concatenate([edges[:, 0], edges[:, 1]])
    ways = np.concatenate([along, -along])
    order = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[order], np.arange(len(hubs) + 1))
    sharpest = np.full(len(ends), math.pi)
    for node in range(len(hubs)):
        here = order[starts[node] : starts[node + 1]]
        if len(here) > 1:
            apart = np.linalg.norm(ways[here][:, None] - ways[here][None], axis=2)
            np.fill_diagonal(apart, 2.0)
            sharpest[here] = 2.0 * np.arcsin(np.clip(0.5 * apart.min(axis=1), 0.0, 1.0))
    if np.any(sharpest < 1e-6):
        raise ArgumentError(f"topology: two beams of node {int(ends[np.argmin(sharpest)])} run along each other")
    # Where a circle of this radius, square to the beam, reaches the plane half way to its neighbour.
    touch = radius / np.tan(0.5 * np.minimum(sharpest, math.pi - 1e-9))
    if setback is None:
        return np.maximum(_CLEARANCE * touch, radius).reshape(2, -1).T
    given = positive(setback, "setback")
    if given <= touch.max():
        raise ArgumentError(
            f"setback: expected more than {touch.max():g} mm, where the girders of node {int(ends[np.argmax(touch)])} touch, "
            f"got {real(setback, 'setback', 'mm'):g}"
        )
    return np.full((len(edges), 2), given)


def _frames(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across each direction: the first horizontal, or x for a vertical one (lf-rep 3.2)."""
    first = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
    size = np.linalg.norm(first, axis=1)
    upright = size < 1e-9
    first[upright] = (1.0, 0.0, 0.0)
    first[~upright] /= size[~upright, None]
    second = np.cross(along, first)
    return first, second / np.linalg.norm(second, axis=1)[:, None]


def _girders(
    hubs: np.ndarray, edges: np.ndarray, back: np.ndarray, counts: np.ndarray, radius: float, n: int, pattern: str
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and beams of all girders, between rings `back` from the hubs, in `counts` bays."""
    angles = 2.0 * np.pi * np.arange(n) / n
    crossed = pattern == "cross"
    sizes = n * (counts + 1 + crossed * counts)
    ends = len(hubs) + np.cumsum(sizes)
    nodes = np.empty((int(ends[-1]), 3))
    nodes[: len(hubs)] = hubs
    tables: list[np.ndarray] = [np.zeros((0, 2), np.int64)] * len(edges)
    for b in np.unique(counts):
        of = np.flatnonzero(counts == b)
        start, stop = hubs[edges[of, 0]], hubs[edges[of, 1]]
        way = (stop - start) / np.linalg.norm(stop - start, axis=1)[:, None]
        u, v = _frames(way)
        share = np.arange(int(b) + 1)[:, None] / b
        spine = (start + back[of, :1] * way)[:, None] * (1.0 - share) + (stop - back[of, 1:] * way)[:, None] * share
        circle = radius * (np.cos(angles)[:, None] * u[:, None] + np.sin(angles)[:, None] * v[:, None])
        rings = spine[:, :, None] + circle[:, None]
        places = [rings.reshape(len(of), -1, 3)]
        if crossed:
            # The panel between two longerons is a rectangle: its diagonals meet in its middle.
            panels = 0.5 * (rings[:, :-1] + np.roll(rings, -1, axis=2)[:, 1:])
            places.append(panels.reshape(len(of), -1, 3))
        own = (ends - sizes)[of, None] + np.arange(int(sizes[of[0]]))
        nodes[own] = np.concatenate(places, axis=1)
        # The table's numbers -1 and -2 are the hubs at the start and the end.
        known = np.concatenate([own, edges[of][:, ::-1]], axis=1)
        for i, table in zip(of, known[:, _one_girder(int(b), n, pattern)], strict=True):
            tables[i] = table
    return nodes, np.concatenate(tables)


def _one_girder(b: int, n: int, pattern: str) -> np.ndarray:
    """(m, 2) beams of a girder of b bays: node i of ring k is k n + i, -1 and -2 are the hubs at its start and end."""
    ring = np.arange(n)
    beams = [np.stack([np.full(n, -1), ring], 1), np.stack([b * n + ring, np.full(n, -2)], 1)]
    after = (ring + 1) % n
    for k in range(b + 1):
        beams.append(np.stack([k * n + ring, k * n + after], 1))
        if k == b:
            break
        here, there = k * n, (k + 1) * n
        beams.append(np.stack([here + ring, there + ring], 1))
        if pattern == "cross":
            middle = (b + 1) * n + k * n + ring
            ends = (here + ring, here + after, there + ring, there + after)
            beams.extend(np.stack([end, middle], 1) for end in ends)
        elif pattern != "none":
            forward = {"warren": k % 2 == 0, "pratt": 2 * k < b, "howe": 2 * k >= b, "spiral": True}[pattern]
            beams.append(np.stack([here + ring, there + after] if forward else [here + after, there + ring], 1))
    return np.concatenate(beams)
