"""Several beam lattices in one part: each in a region of its own, or one a cell.

LF-rep joins lattices at planes (6.2) and by cells of one grid (6.1). Both give one explicit graph: beams cut where
their region ends, nodes that coincide made one, beams that two lattices share kept once; and a `Transition`, which
tells how well they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from frep import ArgumentError, ArgumentTypeError, EmptyError, Solid, graphs
from frep.arguments import box_of, positive, sizes
from frep.arguments import vector as vector_of
from frep.errors import DisconnectedWarning, warn
from frep.skeleton import GraphSkeleton, PeriodicSkeleton

from .beam_topology import BeamTopology

_PROBES = 48
"""Gaps and overlaps of regions are looked for at the middles of so many boxes along each side."""


@dataclass(frozen=True)
class Transition:
    """How lattices that were put together meet.

    Attributes:
        components: how many parts the graph falls into.
        dangling: beams that end in the air, within the region, and did not before they were cut.
        matched: nodes at which lattices meet.
        unmatched: cut points, and other nodes where two regions meet, at which no other lattice has a node.
        nodes: for each lattice, how many of its nodes lie where its region meets another.
        bridges: beams that were added between unmatched nodes and the nearest nodes of other lattices.
        gaps: the share of the volume that is in no region.
        overlaps: the share of the volume that is in several.
        place: (x, y, z) in mm, where something is loose; None where nothing is.
    """

    components: int
    dangling: int
    matched: int
    unmatched: int
    nodes: tuple[int, ...]
    bridges: int = 0
    gaps: float = 0.0
    overlaps: float = 0.0
    place: tuple[float, float, float] | None = None

    @property
    def sound(self) -> bool:
        """One part, nothing that ends in the air."""
        return self.components == 1 and self.dangling == 0

    def __str__(self) -> str:
        text = f"{self.components} component{'s' * (self.components != 1)}, {self.matched} nodes matched"
        counts = [(self.unmatched, "unmatched"), (self.dangling, "dangling"), (self.bridges, "bridged")]
        text = ", ".join([text, *(f"{n} {name}" for n, name in counts if n)])
        shares = [(self.gaps, "in no region"), (self.overlaps, "in several regions")]
        return "; ".join([text, *(f"{share:.3g} of the volume {name}" for share, name in shares if share)])


def assemble(
    parts: Sequence[tuple[BeamTopology, Solid | None]],
    *,
    over: Any,
    bridge: Literal["nearest"] | None = None,
    reach: float | None = None,
) -> BeamTopology:
    """One graph of several lattices, each in a region of its own (LF-rep 6.2, equations 3.16 to 3.18).

    The beams of each lattice that come into `over` are taken whole, and cut where their region ends; what is left of
    them wholly beyond `over` goes. Regions are closed: a beam in the plane between two belongs to both, and is kept
    once where both have it.

    Args:
        parts: pairs of a topology and its region: a Solid, bounded or not (`frep.half_space`), or None for everywhere.
        over: the part that the regions divide: a bounded Solid, or two corners in mm.
        bridge: "nearest" adds a beam from every unmatched node to the nearest node of another lattice.
        reach: the longest bridge, mm; half of the shortest side of the lattices' cells where None.

    Returns:
        An explicit topology; its `report` is a `Transition`.

    Raises:
        ArgumentError: no parts, an infinite `over`, an unknown bridge, a reach not positive or without a bridge, or none for
            graphs.
        ArgumentTypeError: parts that are not pairs of a topology and a Solid or None.
        EmptyError: a lattice has no beam in its region; the message says which.

    Warns:
        DisconnectedWarning: the result falls into several parts, or beams end in the air within `over` that did not
            before.

    Example:
        >>> import frep
        >>> from topologies.beams import bcc, fcc
        >>> left, right = frep.half_space((1, 0, 0), (20, 0, 0)), frep.half_space((-1, 0, 0), (20, 0, 0))
        >>> both = assemble([(bcc(cell=10), left), (fcc(cell=10), right)], over=((0, 0, 0), (40, 10, 10)))
        >>> print(both.report)
        1 component, 4 nodes matched, 1 unmatched
    """
    members, regions = _checked_parts(parts)
    box = box_of(over, "over")
    body = over if isinstance(over, Solid) else None
    if bridge not in (None, "nearest"):
        raise ArgumentError(f'bridge: expected "nearest" or None, got {bridge!r}')
    if reach is not None and bridge is None:
        raise ArgumentError(f'reach: expected bridge="nearest" with it, got {reach!r} and no bridge')
    longest = _reach(members, reach) if bridge else 0.0
    wholes = [_taken(topology, box, i) for i, topology in enumerate(members)]
    pieces = [_in_region(whole, region, box, i) for i, (whole, region) in enumerate(zip(wholes, regions, strict=True))]
    union = graphs.merged([piece.skeleton for piece in pieces])
    met = _meeting(union, pieces, regions, _Extent(box, body, graphs.tolerance_of(box)))
    skeleton, bridges = union.skeleton, 0
    advice = '; bridge="nearest" joins lattices that do not meet'
    if bridge:
        advice = f"; bridges of up to {longest:.6g} mm do not reach, a greater `reach` may"
        for i, loose in enumerate(met.unmatched):
            others = np.flatnonzero(np.delete(met.member, i, axis=1).any(axis=1))
            found = graphs.bridged(skeleton, loose, others, longest)
            skeleton, bridges = found.skeleton, bridges + len(found.added)
    # Nodes that dangled before dangle still, and are none of the transition's.
    before = np.zeros(len(skeleton.nodes), bool)
    for whole, piece, number in zip(wholes, pieces, union.nodes, strict=True):
        kept = piece.nodes >= 0
        valence = np.bincount(whole.edges.reshape(-1), minlength=len(whole.nodes))
        before[number[kept]] |= valence[piece.nodes[kept]] == 1
    gaps, overlaps = _tiling(regions, box, body)
    label = " | ".join(dict.fromkeys(topology.label for topology in members))
    within = met.extent.holds(skeleton.nodes, -1.0) & ~before
    return _reported(
        skeleton,
        label,
        within,
        advice=advice,
        matched=met.matched,
        unmatched=sum(len(loose) for loose in met.unmatched),
        nodes=met.nodes,
        bridges=bridges,
        gaps=gaps,
        overlaps=overlaps,
    )


def _reported(skeleton: GraphSkeleton, label: str, within: np.ndarray, advice: str = "", **counts: Any) -> BeamTopology:
    """The topology with its `Transition`, and a warning where it is not sound; ends count where `within` says so."""
    found = graphs.connectivity(skeleton)
    dangling = found.dangling[within[found.dangling]]
    apart = np.flatnonzero(found.component > 0)
    loose = dangling if len(dangling) else apart
    place = None
    if len(loose):
        x, y, z = skeleton.nodes[loose[0]].tolist()
        place = (x, y, z)
    report = Transition(components=found.components, dangling=len(dangling), place=place, **counts)
    if not report.sound and place is not None:
        said = []
        if report.components != 1:
            said.append(f"falls into {report.components} components")
        if report.dangling:
            said.append(f"has {report.dangling} beams that end in the air")
        at = ", ".join(f"{c:.6g}" for c in place)
        warn(f"{label}: the graph {' and '.join(said)}, one of them at ({at}) mm{advice}", DisconnectedWarning)
    return BeamTopology(skeleton, label, report=report)


def _checked_parts(parts: Any) -> tuple[list[BeamTopology], list[Solid | None]]:
    try:
        pairs = [tuple(part) for part in parts]
    except TypeError:
        raise ArgumentTypeError(
            f"parts: expected pairs of a beam topology and a Solid or None, got {parts!r}"
        ) from None
    if not pairs:
        raise ArgumentError("parts: expected at least one pair of a beam topology and its region, got none")
    for i, pair in enumerate(pairs):
        good = len(pair) == 2 and isinstance(pair[0], BeamTopology) and (pair[1] is None or isinstance(pair[1], Solid))
        if not good:
            raise ArgumentTypeError(
                f"parts: expected pairs of a beam topology and a Solid or None, got {pair!r} at place {i + 1}"
            )
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def _reach(members: list[BeamTopology], reach: float | None) -> float:
    if reach is not None:
        return positive(reach, "reach")
    sides = [t.skeleton.size.min() for t in members if isinstance(t.skeleton, PeriodicSkeleton)]
    if not sides:
        raise ArgumentError("reach: expected the longest bridge in mm; graphs have no cell to take it from")
    return 0.5 * float(min(sides))


def _taken(topology: BeamTopology, box: np.ndarray, place: int) -> GraphSkeleton:
    try:
        found = topology.over(box).skeleton
    except EmptyError:
        raise EmptyError(f"parts: {topology!r} at place {place + 1} has no beam in `over`") from None
    assert isinstance(found, GraphSkeleton)
    return found


def _in_region(whole: GraphSkeleton, region: Solid | None, box: np.ndarray, place: int) -> graphs.Trimmed:
    if region is None:
        nobody = np.zeros(0, np.int64)
        return graphs.Trimmed(whole, nobody, np.arange(len(whole.nodes)), np.arange(len(whole.edges)))
    try:
        return _coming_in(graphs.trimmed(whole, region), box)
    except EmptyError:
        raise EmptyError(f"parts: the lattice at place {place + 1} has no beam in its region {region!r}") from None


def _coming_in(piece: graphs.Trimmed, box: np.ndarray) -> graphs.Trimmed:
    """Without what is left, beyond the box, of beams that came into it elsewhere: it would hang in the air."""
    ends = piece.skeleton.segments()
    kept = graphs.come_in(ends[:, 0], ends[:, 1], box)
    if kept.all():
        return piece
    if not kept.any():
        raise EmptyError("parts: no beam in the region")
    used, number = np.unique(piece.skeleton.edges[kept], return_inverse=True)
    left = GraphSkeleton(piece.skeleton.nodes[used], number.reshape(-1, 2))
    return graphs.Trimmed(left, np.flatnonzero(np.isin(used, piece.cut)), piece.nodes[used], piece.beams[kept])


@dataclass(frozen=True, eq=False)
class _Extent:
    """What `over` holds: a box, and a body in it."""

    box: np.ndarray
    body: Solid | None
    same: float

    def holds(self, points: np.ndarray, share: float) -> np.ndarray:
        """Which points lie in it, with its border (share 1) or without (share -1)."""
        reach = share * self.same
        within = np.all((points >= self.box[0] - reach) & (points <= self.box[1] + reach), axis=1)
        if self.body is not None:
            within[within] = self.body.field(points[within]) <= reach
        return within


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Which nodes belong to which lattice (n, p), how many are matched, and for each lattice how many nodes lie where
    regions meet, and which of its nodes are unmatched."""

    extent: _Extent
    member: np.ndarray
    matched: int
    nodes: tuple[int, ...]
    unmatched: list[np.ndarray]


def _meeting(
    union: graphs.Merged, pieces: list[graphs.Trimmed], regions: list[Solid | None], extent: _Extent
) -> _Meeting:
    points, count = union.skeleton.nodes, len(pieces)
    member = np.zeros((len(points), count), bool)
    cut = np.zeros((len(points), count), bool)
    for i, (piece, number) in enumerate(zip(pieces, union.nodes, strict=True)):
        member[number, i] = True
        cut[number[piece.cut], i] = True
    inside = extent.holds(points, 1.0)
    values = np.stack([np.full(len(points), -np.inf) if r is None else r.field(points) for r in regions], axis=1)
    closed, border = values <= extent.same, np.abs(values) <= extent.same
    shared = member.sum(axis=1) > 1
    nodes, unmatched = [], []
    for i in range(count):
        others = np.delete(np.arange(count), i)
        meets = (closed[:, others] & (border[:, others] | border[:, [i]])).any(axis=1) & member[:, i] & inside
        nodes.append(int(meets.sum()))
        unmatched.append(np.flatnonzero((meets | (cut[:, i] & inside)) & ~shared))
    return _Meeting(extent, member, int((shared & inside).sum()), tuple(nodes), unmatched)


def _tiling(regions: list[Solid | None], box: np.ndarray, body: Solid | None) -> tuple[float, float]:
    """The shares of a volume that no region holds, and that several do."""
    sides = [(np.arange(_PROBES) + 0.5) / _PROBES * (high - low) + low for low, high in box.T]
    points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
    if body is not None:
        points = points[body.field(points) < 0.0]
    if not len(points):
        return 0.0, 0.0
    same = graphs.tolerance_of(box)
    values = [np.full(len(points), -np.inf) if region is None else region.field(points) for region in regions]
    held = np.sum([v <= same for v in values], axis=0)
    deep = np.sum([v < -same for v in values], axis=0)
    return float(np.mean(held == 0)), float(np.mean(deep > 1))


# --- one a cell -------------------------------------------------------------------------------------------------------


def cell_map(
    topologies: Sequence[BeamTopology | Callable[..., BeamTopology]],
    cells: Any,
    *,
    cell: Any = 10.0,
    origin: Any = (0.0, 0.0, 0.0),
    counts: tuple[int, int, int] | None = None,
) -> BeamTopology:
    """One graph of different lattices on one grid of cells (LF-rep 6.1).

    Each cell holds the beams of its topology that lie in it, those of its faces too; beams that two cells share are
    kept once. The cubic family (simple cubic, BCC, FCC and their relatives) meets at the corners of the cells, however
    it is mixed. Beams that run on from cell to cell (diamond does not, the honeycombs do) have a node where they cross
    a face.

    Args:
        topologies: functions such as `bcc`, called with `cell`, or periodic topologies of that cell.
        cells: which of them stands in each cell: an (nx, ny, nz) array of whole numbers, -1 for an empty cell; or, with
            `counts`, a function of the cell's index (i, j, k).
        cell: size of the cells in mm, a number or three.
        origin: the lower corner of cell (0, 0, 0), mm.
        counts: (nx, ny, nz), for a function.

    Returns:
        An explicit topology; its `report` is a `Transition`, in which the lattices are the topologies, and a beam that
        ends at an empty cell or outside the grid does not count as dangling.

    Raises:
        ArgumentTypeError: not topologies or functions of them, cells that are no whole numbers.
        ArgumentError: no topologies, numbers of topologies that do not exist, another period, a moved topology, shapes.
        EmptyError: every cell is empty.

    Warns:
        DisconnectedWarning: the result falls into several parts, or beams end in the air where two topologies meet.

    Example:
        >>> from topologies.beams import bcc, fcc
        >>> print(cell_map([bcc, fcc], [[[0, 1, 0, 1]]], cell=5).report)
        1 component, 12 nodes matched, 3 unmatched
    """
    size, corner = sizes(cell, "cell"), vector_of(origin, "origin")
    members = _cell_members(topologies, size)
    numbers = _cell_numbers(cells, counts, len(members))
    if not (numbers >= 0).any():
        raise EmptyError("cells: every cell is empty")
    tables = [_closed_cell(topology, size) for topology in members]
    starts = np.cumsum([0, *(len(t.nodes) for t in tables)])
    nodes = np.concatenate([t.nodes for t in tables])
    edges = np.concatenate([t.edges + start for t, start in zip(tables, starts, strict=False)])
    first = np.cumsum([0, *(len(t.edges) for t in tables)])
    beams, shifts, whose = [], [], []
    for i, table in enumerate(tables):
        here = np.argwhere(numbers == i)
        beams.append(np.tile(np.arange(len(table.edges)) + first[i], len(here)))
        shifts.append(np.repeat(here, len(table.edges), axis=0))
        whose.append(np.full(len(beams[-1]), i))
    copies = graphs.repeated(nodes, edges, size, np.concatenate(beams), np.concatenate(shifts))
    member = np.zeros((len(copies.skeleton.nodes), len(members)), bool)
    member[copies.ends, np.concatenate(whose)[:, None]] = True
    inner, meets = _between_cells(copies.skeleton.nodes / size, numbers, len(members))
    shared = member.sum(axis=1) > 1
    label = " | ".join(dict.fromkeys(topology.label for topology in members))
    return _reported(
        GraphSkeleton(copies.skeleton.nodes + corner, copies.skeleton.edges),
        label,
        inner,
        matched=int(shared.sum()),
        unmatched=int((meets & ~shared).sum()),
        nodes=tuple((member & meets[:, None]).sum(axis=0).tolist()),
        gaps=float(np.mean(numbers < 0)),
    )


def _cell_members(topologies: Any, size: np.ndarray) -> list[BeamTopology]:
    if not isinstance(topologies, Iterable):
        raise ArgumentTypeError(
            f"topologies: expected a list of topologies or of functions of them, got {topologies!r}"
        )
    members = [_of_cell(topology, size, i) for i, topology in enumerate(topologies)]
    if not members:
        raise ArgumentError("topologies: expected at least one topology, got none")
    return members


def _of_cell(topology: Any, size: np.ndarray, place: int) -> BeamTopology:
    made = topology(tuple(size.tolist())) if callable(topology) else topology
    if not isinstance(made, BeamTopology) or not isinstance(made.skeleton, PeriodicSkeleton):
        raise ArgumentTypeError(
            f"topologies: expected periodic topologies or functions such as bcc, got {topology!r} at place {place + 1}"
        )
    if made.placement is not None:
        raise ArgumentError(f"topologies: {made!r} at place {place + 1} was moved; `origin` moves the whole grid")
    if not np.allclose(made.skeleton.size, size, rtol=1e-9, atol=0.0):
        sizes = [" x ".join(f"{x:g}" for x in s) for s in (size, made.skeleton.size)]
        raise ArgumentError(f"topologies: expected cells of {sizes[0]} mm, got {sizes[1]} mm at place {place + 1}")
    return made


def _cell_numbers(cells: Any, counts: Any, most: int) -> np.ndarray:
    if callable(cells):
        shape = np.asarray(counts if counts is not None else ())
        if shape.shape != (3,) or shape.dtype.kind not in "iu" or shape.min() < 1:
            raise ArgumentError(f"counts: expected three whole numbers > 0 with a function of cells, got {counts!r}")
        cells = [[[cells(i, j, k) for k in range(shape[2])] for j in range(shape[1])] for i in range(shape[0])]
    elif counts is not None:
        raise ArgumentError("counts: goes with a function; an array of cells has its own")
    try:
        numbers = np.asarray(cells)
    except ValueError:
        numbers = np.zeros(0)
    if numbers.ndim != 3 or numbers.size == 0:
        raise ArgumentError(f"cells: expected an (nx, ny, nz) array of whole numbers, got shape {numbers.shape}")
    if numbers.dtype.kind not in "iu":
        raise ArgumentTypeError(f"cells: expected whole numbers, got {numbers.dtype}")
    bad = np.argwhere((numbers < -1) | (numbers >= most))
    if len(bad):
        at = tuple(bad[0].tolist())
        raise ArgumentError(f"cells: expected -1 to {most - 1}, got {numbers[at]} in cell {at}")
    return numbers.astype(np.int64)


def _closed_cell(topology: BeamTopology, size: np.ndarray) -> GraphSkeleton:
    """All beams in one cell and on its faces, cut at these. A periodic table has those that cells share only once."""
    box = np.array([np.zeros(3), size])
    whole = topology.over(box).skeleton
    assert isinstance(whole, GraphSkeleton)
    same = graphs.tolerance_of(box)
    if np.all((whole.nodes >= -same) & (whole.nodes <= size + same)):
        return whole
    from frep import box as box_solid

    return graphs.trimmed(whole, box_solid(*box)).skeleton


def _between_cells(places: np.ndarray, numbers: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """For places counted in cells: which touch no empty cell and no outside; which touch cells of two topologies."""
    around = np.pad(numbers, 1, constant_values=-1)
    low = np.floor(places - 1e-6).astype(np.int64)
    high = np.floor(places + 1e-6).astype(np.int64)
    least, largest = np.full(len(places), most), np.full(len(places), -1)
    filled_least = np.full(len(places), most)
    for corner in range(8):
        at = np.where([(corner >> axis) & 1 for axis in range(3)], high, low) + 1
        found = around[tuple(np.clip(at, 0, np.array(around.shape) - 1).T)]
        least, largest = np.minimum(least, found), np.maximum(largest, found)
        filled_least = np.where(found >= 0, np.minimum(filled_least, found), filled_least)
    return least >= 0, filled_least < largest
