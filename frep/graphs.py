"""Explicit graphs from skeletons: cut out of periodic ones, trimmed by solids, merged, bridged, divided, looked over.

All functions take skeletons and give new ones with what a caller has to know of the change (which nodes are cut points,
which node came from which). They are numpy throughout: a million beams take seconds.

Promised: nodes that coincide are one node, an edge stands once, no edge is without length. Not promised: that beams
cross only at nodes; nothing here looks for crossings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from .arguments import positive
from .errors import ArgumentError, EmptyError, TooLargeError
from .field import Field
from .skeleton import GraphSkeleton, PeriodicSkeleton, Skeleton
from .solid import Solid

_SAME = 1e-9
"""Points closer than this, of the size of the whole, are one."""
_SLIVER = 1e-6
"""Shorter pieces of beams than this, of the size of the whole, are left out where a beam only touches a border."""
_STEPS = 16
"""A beam is looked at so many times, to see where it leaves a solid and comes back."""
_HALVINGS = 48
_MOST_BEAMS = 50_000_000
_BATCH = 1 << 20
"""Points at which a field is read at once."""

AnySkeleton = TypeVar("AnySkeleton", bound=Skeleton)


@dataclass(frozen=True, eq=False)
class Copies:
    """Shifted copies of beams, joined where their ends coincide.

    Attributes:
        skeleton: the graph.
        ends: (k, 2) numbers in it of the ends of every beam asked for, those given twice too.
    """

    skeleton: GraphSkeleton
    ends: np.ndarray


@dataclass(frozen=True, eq=False)
class Trimmed:
    """What is left of a graph in a solid.

    Attributes:
        skeleton: the graph that is left.
        cut: (k,) numbers of its nodes at which a beam was cut off.
        nodes: (n,) for each of its nodes the number it had before, -1 for cut points.
        beams: (m,) for each of its beams the number of the beam that it is a part of.
    """

    skeleton: GraphSkeleton
    cut: np.ndarray
    nodes: np.ndarray
    beams: np.ndarray


@dataclass(frozen=True, eq=False)
class Merged:
    """The union of graphs.

    Attributes:
        skeleton: the union.
        nodes: for each graph, (n,) the numbers of its nodes in the union.
    """

    skeleton: GraphSkeleton
    nodes: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Bridged:
    """A graph with beams added between parts of it.

    Attributes:
        skeleton: the graph.
        added: (k, 2) the beams that were added, as node numbers.
        unreached: (j,) numbers of the ends that had no target within reach.
    """

    skeleton: GraphSkeleton
    added: np.ndarray
    unreached: np.ndarray


@dataclass(frozen=True, eq=False)
class Connectivity:
    """How a graph hangs together.

    Attributes:
        components: how many parts it falls into, lone nodes not counted.
        component: (n,) which part each node belongs to, 0 for the one of most nodes; -1 for lone nodes.
        dangling: numbers of nodes at which only one beam ends.
        lone: numbers of nodes without a beam.
        isolated: numbers of beams that touch no other.
    """

    components: int
    component: np.ndarray
    dangling: np.ndarray
    lone: np.ndarray
    isolated: np.ndarray

    @property
    def sound(self) -> bool:
        """One part, nothing loose."""
        return self.components == 1 and len(self.dangling) == 0 and len(self.lone) == 0

    def __str__(self) -> str:
        text = "one component" if self.components == 1 else f"{self.components} components"
        found = [(self.dangling, "dangling node"), (self.lone, "lone node"), (self.isolated, "isolated beam")]
        counts = [f"{len(items)} {name}{'s' * (len(items) != 1)}" for items, name in found if len(items)]
        return ", ".join([text, *counts]) if counts else f"{text}, nothing loose"


def tolerance_of(*points: np.ndarray) -> float:
    """How close, in mm, points of a whole are that are one: a billionth of its longest side."""
    low = np.min([p.min(axis=0) for p in points], axis=0)
    high = np.max([p.max(axis=0) for p in points], axis=0)
    return _SAME * max(float((high - low).max()), 1e-300)


# --- out of a periodic skeleton ---------------------------------------------------------------------------------------


def repeated(nodes: np.ndarray, edges: np.ndarray, size: np.ndarray, beams: np.ndarray, shifts: np.ndarray) -> Copies:
    """The beams number `beams` (k,) of a table, each shifted by `shifts` (k, 3) whole periods of `size` mm.

    Nodes are joined by number and not by place: those that coincide after a shift by whole periods do so in all copies.
    """
    number, base, offset = _folded(nodes, size)
    at = edges[beams]
    cell = shifts[:, None, :] + offset[at]
    low = cell.min(axis=(0, 1))
    span = cell.max(axis=(0, 1)) - low + 1
    local = cell - low
    key = ((local[..., 0] * span[1] + local[..., 1]) * span[2] + local[..., 2]) * len(base) + number[at]
    used, ends = _numbered(key.reshape(-1), int(span.prod()) * len(base))
    kind, place = used % len(base), used // len(base)
    i, j, k = place // (span[1] * span[2]), place // span[2] % span[1], place % span[2]
    points = base[kind] + (np.stack([i, j, k], axis=1) + low) * size
    ends = ends.reshape(-1, 2)
    return Copies(GraphSkeleton(points, ends[distinct(ends)]), ends)


def cut_out(skeleton: Skeleton, region: Solid | np.ndarray) -> GraphSkeleton:
    """The beams of a skeleton that come into the box of a region, whole, as an explicit graph.

    A beam in a face of the box comes into it; one that only touches it with an end does not. So a box of whole cells
    gives the beams of these cells, and those of their outer faces.

    Args:
        skeleton: periodic or explicit.
        region: a bounded Solid, whose bounds count, or a (2, 3) box in mm.

    Raises:
        ArgumentError: an infinite region.
        EmptyError: no beam comes into it.
        TooLargeError: more than fifty million beams.

    Example:
        >>> cell = PeriodicSkeleton(np.zeros((2, 3)) + [[0], [5]], np.array([[0, 1]]), np.full(3, 5.0))
        >>> len(cut_out(cell, np.array([[0, 0, 0], [10, 10, 10]])).edges)
        8
    """
    box = np.asarray(region.bounds if isinstance(region, Solid) else region, float)
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or not np.all(box[0] <= box[1]):
        raise ArgumentError(f"region: expected a bounded solid or a finite (2, 3) box, got {region!r}")
    if isinstance(skeleton, PeriodicSkeleton):
        beams, shifts = _candidates(skeleton, box)
        moved = shifts * skeleton.size
        ends = skeleton.edges[beams]
        kept = come_in(skeleton.nodes[ends[:, 0]] + moved, skeleton.nodes[ends[:, 1]] + moved, box)
        if kept.any():
            return repeated(skeleton.nodes, skeleton.edges, skeleton.size, beams[kept], shifts[kept]).skeleton
    else:
        ends = skeleton.segments()
        kept = come_in(ends[:, 0], ends[:, 1], box)
        if kept.any():
            return _without_unused(skeleton.nodes, skeleton.edges[kept])[0]
    raise EmptyError(f"region: no beam comes into the box from {box[0]} to {box[1]} mm")


def _candidates(skeleton: PeriodicSkeleton, box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Beams (k,) and shifts (k, 3) whose bounding boxes touch the box."""
    ends = skeleton.segments()
    first = np.ceil((box[0] - ends.max(axis=1)) / skeleton.size - _SLIVER).astype(np.int64)
    last = np.floor((box[1] - ends.min(axis=1)) / skeleton.size + _SLIVER).astype(np.int64)
    span = np.maximum(last - first + 1, 0)
    count = span.prod(axis=1)
    if count.astype(float).sum() > _MOST_BEAMS:
        raise TooLargeError(f"region: {count.astype(float).sum():.3g} beams come into it; ask for a smaller one")
    beams = np.repeat(np.arange(len(span)), count)
    local = np.arange(len(beams)) - np.repeat(np.cumsum(count) - count, count)
    width, height = span[beams, 2], span[beams, 1]
    shifts = np.stack([local // (width * height), local // width % height, local % width], axis=1)
    return beams, shifts + first[beams]


def come_in(a: np.ndarray, b: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Which segments, from a to b (n, 3), have more than an end in a closed (2, 3) box."""
    if not len(a):
        return np.zeros(0, bool)
    size = float(max((box[1] - box[0]).max(), np.abs(b - a).max()))
    enter, leave = _within(a, b, box + _SAME * size * np.array([[-1.0], [1.0]]))
    length = np.linalg.norm(b - a, axis=1)
    # A beam may itself be shorter than a sliver.
    return (leave - enter) * length > np.minimum(_SLIVER * size, 0.5 * length)


def _within(a: np.ndarray, b: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Between which shares of their lengths segments lie in a box; those that miss it leave before they enter."""
    enter, leave = np.zeros(len(a)), np.ones(len(a))
    for axis in range(3):
        start, along = a[:, axis], b[:, axis] - a[:, axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = (box[0, axis] - start) / along, (box[1, axis] - start) / along
        # Parallel to the faces: between them all along, or nowhere.
        level = along == 0.0
        outside = level & ((start < box[0, axis]) | (start > box[1, axis]))
        enter = np.where(level, np.where(outside, 2.0, enter), np.maximum(enter, np.minimum(low, high)))
        leave = np.where(level, np.where(outside, -1.0, leave), np.minimum(leave, np.maximum(low, high)))
    return enter, leave


def _folded(nodes: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For nodes of a period: the class of each (n,), where the first of each class lies (c, 3), and the whole periods
    (n, 3) by which each node is away from it."""
    share = np.mod(nodes / size, 1.0)
    share[share >= 1.0] = 0.0
    number, first = _classes(share, _SAME, 1.0)
    base = nodes[first]
    return number, base, np.rint((nodes - base[number]) / size).astype(np.int64)


def _classes(points: np.ndarray, near: float, period: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Classes of points within `near` of each other: the number of each (n,), in order, and the first point of each."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    tree = KDTree(points, balanced_tree=False, compact_nodes=False, boxsize=period)
    pairs = tree.query_pairs(near, output_type="ndarray")
    if not len(pairs):
        return np.arange(len(points)), np.arange(len(points))
    links = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    label = connected_components(links, directed=False)[1]
    _, first, number = np.unique(label, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[number.reshape(-1)], first[order]


def _numbered(keys: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The keys that occur, rising, and for each key its place among them."""
    if most > 20 * len(keys) + 1000:
        used, number = np.unique(keys, return_inverse=True)
        return used, number.reshape(-1)
    seen = np.zeros(most, bool)
    seen[keys] = True
    return np.flatnonzero(seen), (np.cumsum(seen) - 1)[keys]


def distinct(edges: np.ndarray) -> np.ndarray:
    """Numbers of the edges (m, 2) that join two nodes, and repeat no earlier edge in either direction."""
    low, high = edges.min(axis=1), edges.max(axis=1)
    real = np.flatnonzero(low != high)
    if not len(real):
        return real
    _, first = np.unique(low[real] * (int(high.max()) + 1) + high[real], return_index=True)
    return real[np.sort(first)]


def _without_unused(nodes: np.ndarray, edges: np.ndarray) -> tuple[GraphSkeleton, np.ndarray]:
    """The graph of the nodes that edges use, and which they are."""
    used, number = _numbered(edges.reshape(-1), len(nodes))
    return GraphSkeleton(nodes[used], number.reshape(-1, 2)), used


# --- in a solid -------------------------------------------------------------------------------------------------------


def trimmed(skeleton: GraphSkeleton, solid: Solid, *, step: float | None = None, overhang: float = 0.0) -> Trimmed:
    """The parts of beams in a solid, cut where they cross its surface (lf-rep 9: clip, do not drop).

    Beams in the surface stay, and ends on it are no cuts. A beam may come and go many times; that it does is seen where
    it is in the solid, or out of it, for longer than a step.

    Args:
        skeleton: an explicit graph.
        solid: any Solid, bounded or not; only the sign of its field counts.
        step: how far apart beams are looked at, mm. None for a sixteenth of each beam.
        overhang: how far beams may reach out of the solid, mm as its field has them.

    Raises:
        ArgumentError: a step that is not positive.
        EmptyError: no beam lies in the solid.
    """
    spacing = None if step is None else positive(step, "step")
    nodes, edges = skeleton.nodes, skeleton.edges
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    # Nodes may lie very far off, such as the vertices of a Voronoi diagram: a bounded solid sets the scale.
    same = tolerance_of(solid.bounds if solid.is_bounded else nodes)
    t0, t1, owner = stretches(a, b, solid, same, spacing, overhang)
    length = np.linalg.norm(b - a, axis=1)[owner]
    sliver = np.minimum(_SLIVER / _SAME * same / length, 0.5)
    long_enough = t1 - t0 > sliver
    t0, t1, owner, sliver = t0[long_enough], t1[long_enough], owner[long_enough], sliver[long_enough]
    if not len(owner):
        raise EmptyError(f"solid: no beam lies in {solid!r}")
    # Next to a node, the end is the node.
    t0, t1 = np.where(t0 <= sliver, 0.0, t0), np.where(t1 >= 1.0 - sliver, 1.0, t1)
    share = np.stack([t0, t1], axis=1)
    own = np.stack([t0 == 0.0, t1 == 1.0], axis=1)
    whose = np.stack([owner, owner], axis=1)[~own]
    points = a[whose] + share[~own][:, None] * (b - a)[whose]
    ends = edges[owner]
    if len(points):
        # Beams that cross the surface at one place share their cut.
        number, first = _classes(points, same)
        ends[~own] = len(nodes) + number
        nodes = np.concatenate([nodes, points[first]])
    kept = distinct(ends)
    left, used = _without_unused(nodes, ends[kept])
    source = np.where(used < len(skeleton.nodes), used, -1)
    return Trimmed(left, np.flatnonzero(source < 0), source, owner[kept])


def largest_part(found: Trimmed) -> tuple[Trimmed, int, float]:
    """What hangs together with the greatest length of beams; into how many parts all falls, and the share of the others.

    Example:
        >>> from frep import box
        >>> bars = GraphSkeleton(np.array([[0, 0, 0], [4, 0, 0], [0, 9, 0], [1, 9, 0]]), np.array([[0, 1], [2, 3]]))
        >>> main, parts, others = largest_part(trimmed(bars, box((-1, -1, -1), (9, 9, 9))))
        >>> len(main.skeleton.edges), parts, round(others, 6)
        (1, 2, 0.2)
    """
    nodes, edges = found.skeleton.nodes, found.skeleton.edges
    part = connectivity(found.skeleton).component[edges[:, 0]]
    lengths = np.bincount(part, np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1))
    kept = np.flatnonzero(part == np.argmax(lengths))
    left, used = _without_unused(nodes, edges[kept])
    is_cut = np.zeros(len(nodes), bool)
    is_cut[found.cut] = True
    main = Trimmed(left, np.flatnonzero(is_cut[used]), found.nodes[used], found.beams[kept])
    return main, len(lengths), 1.0 - float(lengths.max() / lengths.sum())


def stretches(
    a: np.ndarray, b: np.ndarray, solid: Solid, same: float, step: float | None, overhang: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The parts of segments (n, 3) to (n, 3) in a solid: the shares at which they start and stop, and whose part each is.

    `same`: how near to its surface is on it, mm; `step` and `overhang` as for `trimmed`.
    """
    outward = np.array([[-1.0], [1.0]])
    enter, leave = _within(a, b, solid.bounds + (overhang + 2.0 * same) * outward)
    field = solid.field - overhang
    met = np.flatnonzero(leave > enter)
    length = np.linalg.norm(b - a, axis=1)[met] * (leave - enter)[met]
    count = np.full(len(met), _STEPS) if step is None else np.maximum(np.ceil(length / step), 2).astype(np.int64)
    found = [np.zeros((0, 3))]
    # In batches, so that the samples of a million beams need no gigabytes.
    breaks = np.searchsorted(np.cumsum(count + 1), np.arange(_BATCH, int((count + 1).sum()), _BATCH))
    for rows in np.split(np.arange(len(met)), np.unique(breaks)):
        if len(rows):
            some = met[rows]
            parts = _runs(a[some], b[some], enter[some], leave[some], count[rows], field, same)
            parts[:, 2] = some[parts[:, 2].astype(np.int64)]
            found.append(parts)
    t0, t1, owner = np.concatenate(found).T
    return t0, t1, owner.astype(np.int64)


def _runs(a, b, enter, leave, count, field: Field, same: float) -> np.ndarray:
    """(k, 3) start, stop and number of the stretches of segments where a field is negative, or within `same` of it."""
    whose = np.repeat(np.arange(len(a)), count + 1)
    local = np.arange(len(whose)) - np.repeat(np.cumsum(count + 1) - (count + 1), count + 1)
    part = local / count[whose]
    # In this form the ends are met exactly.
    share = enter[whose] * (1.0 - part) + leave[whose] * part
    along = b - a

    def value(number: np.ndarray, at: np.ndarray) -> np.ndarray:
        return field(a[number] + at[:, None] * along[number])

    inside = value(whose, share) <= same
    together = whose[1:] == whose[:-1]
    opens = np.flatnonzero(together & ~inside[:-1] & inside[1:])
    closes = np.flatnonzero(together & inside[:-1] & ~inside[1:])
    firsts = np.flatnonzero(np.r_[True, ~together] & inside)
    lasts = np.flatnonzero(np.r_[~together, True] & inside)
    begun = _crossings(value, whose[opens], share[opens], share[opens + 1])
    ended = _crossings(value, whose[closes], share[closes + 1], share[closes])
    t0, t1 = np.concatenate([share[firsts], begun]), np.concatenate([share[lasts], ended])
    starts, stops = np.concatenate([whose[firsts], whose[opens]]), np.concatenate([whose[lasts], whose[closes]])
    # Stretches of a segment do not overlap: its starts and its stops, each in order, belong together.
    by_start, by_stop = np.lexsort((t0, starts)), np.lexsort((t1, stops))
    return np.stack([t0[by_start], t1[by_stop], starts[by_start]], axis=1)


def _crossings(value, number: np.ndarray, outside: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Where between a share outside and one inside each segment crosses the surface, by halving.

    On the surface itself, and not within some tolerance of it: cuts from both of its sides must be one point. Where the
    share inside is only just outside, it is that share.
    """
    for _ in range(_HALVINGS if len(number) else 0):
        middle = 0.5 * (outside + inside)
        hit = value(number, middle) <= 0.0
        inside, outside = np.where(hit, middle, inside), np.where(hit, outside, middle)
    return inside


# --- together ---------------------------------------------------------------------------------------------------------


def merged(skeletons: Sequence[Skeleton], tolerance: float | None = None) -> Merged:
    """The union of graphs: nodes that coincide are one, equal edges stand once, edges without length go.

    Args:
        skeletons: explicit graphs. One is merged with itself.
        tolerance: how close nodes are that are one, mm; a billionth of the longest side where None.

    Raises:
        ArgumentError: no graph, a tolerance that is not positive.
        EmptyError: no edge is left.
    """
    if not skeletons:
        raise ArgumentError("skeletons: expected at least one graph, got none")
    near = tolerance_of(*(s.nodes for s in skeletons)) if tolerance is None else positive(tolerance, "tolerance")
    starts = np.cumsum([0, *(len(s.nodes) for s in skeletons)])
    everything = np.concatenate([s.nodes for s in skeletons])
    number, first = _classes(everything, near)
    edges = number[np.concatenate([s.edges + start for s, start in zip(skeletons, starts, strict=False)])]
    edges = edges[distinct(edges)]
    if not len(edges):
        raise EmptyError(f"skeletons: no beam is longer than {near:g} mm")
    return Merged(GraphSkeleton(everything[first], edges), tuple(np.split(number, starts[1:-1])))


def bridged(skeleton: GraphSkeleton, ends: np.ndarray, targets: np.ndarray, reach: float) -> Bridged:
    """A beam from each of some nodes to the nearest of others, where one lies within `reach` mm.

    Args:
        skeleton: an explicit graph.
        ends: (k,) numbers of the nodes that want a beam.
        targets: (j,) numbers of the nodes that may be at its other end.
        reach: the longest beam, mm.

    Raises:
        ArgumentError: a reach that is not positive.
    """
    from scipy.spatial import KDTree

    far = positive(reach, "reach")
    ends, targets = np.asarray(ends, np.int64), np.asarray(targets, np.int64)
    if not len(ends) or not len(targets):
        return Bridged(skeleton, np.zeros((0, 2), np.int64), ends)
    # An end that is itself a target asks for the next one.
    count = min(2, len(targets))
    distance, which = KDTree(skeleton.nodes[targets]).query(skeleton.nodes[ends], k=count, distance_upper_bound=far)
    distance, which = distance.reshape(-1, count), which.reshape(-1, count)
    other = np.append(targets, -1)[which]
    distance[other == ends[:, None]] = np.inf
    best = distance.argmin(axis=1)[:, None]
    met = np.isfinite(np.take_along_axis(distance, best, axis=1)[:, 0])
    wanted = np.stack([ends, np.take_along_axis(other, best, axis=1)[:, 0]], axis=1)[met]
    edges = np.concatenate([skeleton.edges, wanted])
    kept = distinct(edges)
    added = edges[kept[kept >= len(skeleton.edges)]]
    return Bridged(GraphSkeleton(skeleton.nodes, edges[kept]), added, ends[~met])


# --- divided ----------------------------------------------------------------------------------------------------------


def divided(skeleton: AnySkeleton, beams: np.ndarray, shares: np.ndarray) -> AnySkeleton:
    """A skeleton with nodes put on its beams: on beam `beams` (k,) at a share `shares` (k,) of it, between 0 and 1.

    Its own nodes keep their numbers; the new ones follow, beam by beam and along each. None is given twice.
    """
    order = np.lexsort((shares, beams))
    beams, shares = np.asarray(beams, np.int64)[order], np.asarray(shares, float)[order]
    ends = skeleton.segments()[beams]
    points = ends[:, 0] + shares[:, None] * (ends[:, 1] - ends[:, 0])
    count = np.bincount(beams, minlength=len(skeleton.edges))
    # Each beam as a row of nodes: its first, its new ones, its last; edges join neighbours in a row.
    row = np.repeat(np.arange(len(count)), count + 2)
    starts = np.cumsum(count + 2) - (count + 2)
    chain = np.empty(len(row), np.int64)
    inner = np.ones(len(row), bool)
    inner[starts] = inner[starts + count + 1] = False
    chain[starts], chain[starts + count + 1] = skeleton.edges.T
    chain[inner] = len(skeleton.nodes) + np.arange(len(points))
    along = row[1:] == row[:-1]
    edges = np.stack([chain[:-1][along], chain[1:][along]], axis=1)
    return replace(skeleton, nodes=np.concatenate([skeleton.nodes, points]), edges=edges)


def subdivided(skeleton: AnySkeleton, length: float) -> AnySkeleton:
    """Every beam in equal pieces of at most `length` mm.

    Raises:
        ArgumentError: a length that is not positive.
        TooLargeError: more than fifty million pieces.
    """
    longest = positive(length, "length")
    ends = skeleton.segments()
    # A beam of exactly n lengths is n pieces, whatever rounding says.
    count = np.maximum(np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / longest - _SLIVER), 1.0)
    if count.sum() > _MOST_BEAMS:
        raise TooLargeError(f"length: {count.sum():.3g} pieces; ask for longer ones")
    pieces = count.astype(np.int64)
    beams = np.repeat(np.arange(len(pieces)), pieces - 1)
    local = np.arange(len(beams)) - np.repeat(np.cumsum(pieces - 1) - (pieces - 1), pieces - 1)
    return divided(skeleton, beams, (local + 1) / pieces[beams])


# --- looked over ------------------------------------------------------------------------------------------------------


def connectivity(skeleton: GraphSkeleton) -> Connectivity:
    """Components, dangling and lone nodes, and isolated beams of an explicit graph.

    Example:
        >>> print(connectivity(GraphSkeleton(np.eye(4, 3), np.array([[0, 1], [1, 2]]))))
        one component, 2 dangling nodes, 1 lone node
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n, edges = len(skeleton.nodes), skeleton.edges
    valence = np.bincount(edges.reshape(-1), minlength=n)
    links = coo_array((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=(n, n))
    label = connected_components(links, directed=False)[1]
    label[valence == 0] = -1
    parts, sizes = np.unique(label[label >= 0], return_counts=True)
    rank = np.full(max(int(label.max(initial=-1)) + 1, 1), -1)
    rank[parts[np.argsort(-sizes, kind="stable")]] = np.arange(len(parts))
    component = np.where(label >= 0, rank[label], -1)
    isolated = np.flatnonzero((valence[edges] == 1).all(axis=1))
    return Connectivity(len(parts), component, np.flatnonzero(valence == 1), np.flatnonzero(valence == 0), isolated)
