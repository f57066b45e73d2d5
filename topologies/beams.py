"""Beam topologies: periodic cells and explicit graphs of straight beams.

A topology has no thickness; `thicken` composes it with parameter fields into a Solid. Cells fill all space: intersect with a
bounded solid before meshing, or take the beams of a region alone with `over`. What a topology can do is in
`topologies.beam_topology`; several of them in one part, in `topologies.assembly`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

import frep
from frep import ArgumentError, ArgumentTypeError, Field, FieldLike
from frep.arguments import box_of, one_of, real, refuse_nan, sizes
from frep.errors import warn
from frep.skeleton import GraphSkeleton, PeriodicSkeleton
from frep.thicken import Rectangle

from . import beam_cells
from .assembly import Transition as Transition
from .assembly import assemble as assemble
from .assembly import cell_map as cell_map
from .beam_topology import BeamTopology
from .truncation import truncated

_MERGE = 1e-9
"""Nodes closer than this, of the size of the cell or graph, are one."""
_MANY = 2.0
"""A cell whose nodes reach over more periods, and whose beams meet, was given the wrong size."""
_ARCHIMEDEAN = 1.0 / (2.0 + math.sqrt(2.0))
"""The truncation of a cube of side 1 that makes all edges equal (LF-rep 3.22)."""


class CoincidentNodesWarning(UserWarning):
    """Nodes of a graph at one place, which its beams do not hang together by: they were meant to be one."""


class DanglingBeamWarning(UserWarning):
    """A beam of a periodic cell that ends in the air: no other starts from its end, in this cell or the next. Or a node
    without any."""


def square(fillet: FieldLike = 0.0) -> Rectangle:
    """A square section whose corners are rounded by `fillet` mm, a number or a Field: 0 is square, half the side a circle.

    Raises:
        ArgumentError: a negative fillet.
    """
    radius = frep.as_field(fillet, "fillet")
    if radius.is_constant and radius.data < 0.0:
        raise ArgumentError(f"fillet: expected a radius >= 0 mm, got {radius.data:g}")
    return Rectangle(radius)


def _array(value: Any, name: str, columns: int, dtype) -> np.ndarray:
    if isinstance(value, Field):
        raise ArgumentTypeError(f"{name}: expected numbers, got a Field")
    try:
        array = np.array(value, dtype=dtype)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected an (n, {columns}) array of numbers, got {value!r}") from None
    if array.ndim != 2 or array.shape[1] != columns or len(array) == 0:
        raise ArgumentError(f"{name}: expected a non-empty (n, {columns}) array, got shape {array.shape}")
    return array


def _nodes_and_edges(nodes: Any, edges: Any) -> tuple[np.ndarray, np.ndarray]:
    n = _array(nodes, "nodes", 3, float)
    refuse_nan(n, "nodes", "node")
    raw = _array(edges, "edges", 2, float)
    refuse_nan(raw, "edges", "edge")
    broken = np.flatnonzero((raw != np.floor(raw)).any(axis=1))
    if len(broken):
        raise ArgumentError(f"edges: expected whole node numbers, edge {broken[0]} has {raw[broken[0]].tolist()}")
    beyond = np.flatnonzero(((raw < 0) | (raw >= len(n))).any(axis=1))
    if len(beyond):
        i, j = raw[beyond[0]].astype(np.int64)
        more = f" (and {len(beyond) - 1} more)" if len(beyond) > 1 else ""
        raise ArgumentError(
            f"edges: node numbers must lie in 0..{len(n) - 1}, edge {beyond[0]} joins {i} and {j}{more}"
        )
    e = raw.astype(np.int64)
    lengths = np.linalg.norm(n[e[:, 0]] - n[e[:, 1]], axis=1)
    scale = max(float(np.ptp(n, axis=0).max()), 1e-300)
    short = np.flatnonzero(lengths <= _MERGE * scale)
    if len(short):
        i, j = e[short[0]]
        raise ArgumentError(f"edges: edge {short[0]} joins node {i} to node {j} at the same place")
    return n, e


def cell(nodes, edges, *, size: Any = 1.0, label: str = "cell", check: bool = True) -> BeamTopology:
    """A custom periodic cell.

    Args:
        nodes: (n, 3) positions in mm, usually within the cell, `0 <= x <= size`.
        edges: (m, 2) node numbers.
        size: the period in mm: a number, or three for a cuboid cell.
        check: refuse a cell whose nodes or beams meet by accident or miss each other across the period, and warn of loose
            ends. False takes it as it is, at once; `check()` of the topology then tells.

    Edges that coincide with another after a shift by whole cells (on shared faces and edges of the cell) are kept once.

    Raises:
        ArgumentError: shapes, node numbers out of range, edges without length, sizes not positive; and with `check` nodes
            given twice, nodes that miss each other by a hair in the cell or across its period, beams that cross or run along
            each other where they have no node. The message says which, and where.

    Warns:
        DanglingBeamWarning: a node at which only one beam ends, and none continues in the next cell, or none at all.

    Example:
        >>> column = cell([(0, 0, 0), (0, 0, 4)], [(0, 1)], size=4)
        >>> column
        <cell: 2 nodes, 1 beams>
    """
    n, e = _nodes_and_edges(nodes, edges)
    period = sizes(size, "size")
    if check:
        _refuse_faults(n, e, period)
    return BeamTopology(PeriodicSkeleton(n, e[beam_cells.distinct_edges(n, e, period)], period), label)


def _refuse_faults(nodes: np.ndarray, edges: np.ndarray, period: np.ndarray, groups: Sequence[str] = ()) -> None:
    """Raise the first fault of a cell, or warn of its loose ends; `groups` names what each edge came from."""
    found = beam_cells.faults(nodes, edges, period)
    loose = [fault for fault in found if fault.kind in ("dangling node", "lone node")]
    wrong = [fault for fault in found if fault.kind not in ("dangling node", "lone node", "separate parts")]
    if wrong:
        periods = np.ptp(nodes, axis=0) / period
        if periods.max() > _MANY and not groups:
            reach = " x ".join(f"{side:g}" for side in np.ptp(nodes, axis=0))
            sides = " x ".join(f"{side:g}" for side in period)
            raise ArgumentError(
                f"size: expected the period of the cell in mm, got {sides}, where the nodes reach over {reach} mm; {wrong[0]}"
            )
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        of_edges = wrong[0].kind in ("crossing beams", "overlapping beams")
        whose = " and ".join(groups[i] for i in wrong[0].items) if of_edges and groups else "groups"
        origin = f"topologies: {whose} do not fit together: " if groups else ""
        raise ArgumentError(f"{origin}{wrong[0]}{more}; check=False takes the cell as it is")
    if loose:
        more = f" (and {len(loose) - 1} more)" if len(loose) > 1 else ""
        warn(f"{loose[0]}{more}", DanglingBeamWarning)


def combine(*topologies: BeamTopology, check: bool = True) -> BeamTopology:
    """The union of groups of beams of one period: new cells from reusable parts, as LF-rep composes its cubic family (4.1).

    Nodes that coincide become one, and beams that two groups share are kept once.

    Args:
        topologies: periodic topologies of equal period. Those that were moved must all have been moved alike.
        check: as for `cell`: refuse groups whose beams cross where they have no node.

    Raises:
        ArgumentTypeError: something that is no periodic topology.
        ArgumentError: no topology, different periods, different places, beams that cross or run along each other.

    Example:
        >>> combine(bcc(cell=5), columns(cell=5))
        <bcc + columns: 9 nodes, 9 beams>
    """
    if not topologies:
        raise ArgumentError("topologies: expected at least one beam topology")
    skeletons = []
    for i, topology in enumerate(topologies):
        skeleton = topology.skeleton if isinstance(topology, BeamTopology) else None
        if not isinstance(skeleton, PeriodicSkeleton):
            raise ArgumentTypeError(f"topologies: expected periodic beam topologies, got {topology!r} at place {i + 1}")
        skeletons.append(skeleton)
    period = skeletons[0].size
    for i, skeleton in enumerate(skeletons):
        if not np.allclose(skeleton.size, period, rtol=_MERGE, atol=0.0):
            sizes = " and ".join(" x ".join(f"{x:g}" for x in size) for size in (period, skeleton.size))
            raise ArgumentError(f"topologies: expected equal periods, got {sizes} mm at places 1 and {i + 1}")
        if topologies[i].placement != topologies[0].placement:
            raise ArgumentError(
                f"topologies: {topologies[0]!r} and {topologies[i]!r} at places 1 and {i + 1} were not moved alike; combine "
                "them before they are moved, or assemble them over a region"
            )
    nodes, edges = beam_cells.table(line for sk in skeletons for line in (sk.segments() / period).tolist())
    if check:
        groups = [t.label for t, sk in zip(topologies, skeletons, strict=True) for _ in sk.edges]
        _refuse_faults(nodes * period, edges, period, groups)
    label = " + ".join(topology.label for topology in topologies)
    combined = cell(nodes * period, edges, size=period, label=label, check=False)
    return replace(combined, placement=topologies[0].placement)


def graph(nodes, edges) -> BeamTopology:
    """An explicit graph of beams.

    Args:
        nodes: (n, 3) positions in mm.
        edges: (m, 2) node numbers; an edge given twice counts once.

    Raises:
        ArgumentError: shapes, node numbers out of range, edges without length.

    Warns:
        CoincidentNodesWarning: nodes given twice, as by a list of segments, each with ends of its own.

    Example:
        >>> graph([(0, 0, 0), (10, 0, 0), (10, 10, 0)], [(0, 1), (1, 2)])
        <graph: 3 nodes, 2 beams>
    """
    n, e = _nodes_and_edges(nodes, edges)
    _warn_of_coincident(n, np.unique(e))
    _, first = np.unique(np.sort(e, axis=1), axis=0, return_index=True)
    return BeamTopology(GraphSkeleton(n, e[np.sort(first)]), "graph")


def _warn_of_coincident(nodes: np.ndarray, used: np.ndarray) -> None:
    scale = float(np.ptp(nodes, axis=0).max())
    places = np.rint((nodes[used] - nodes.min(axis=0)) / (_MERGE * scale))
    # One number a place, sorted ten times as fast as three; places that share one by chance are told apart below.
    key = (places.astype(np.int64) * (1_000_003, 998_244_353_000_001, 4_611_686_018_427)).sum(axis=1)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    same = same[(places[order[same]] == places[order[same + 1]]).all(axis=1)]
    if len(same):
        i, j = used[[order[same[0]], order[same[0] + 1]]].tolist()
        x, y, z = nodes[i].tolist()
        warn(
            f"nodes: {len(same)} of {len(used)} lie where others do, the first are nodes {i} and {j} at "
            f"({x:g}, {y:g}, {z:g}) mm; give each once, or beams that meet there do not hang together "
            "(frep.graphs.merged([topology.skeleton]) makes them one)",
            CoincidentNodesWarning,
        )


# --- the cells -----------------------------------------------------------------------------------------------------------


def _unit_cell(lines: Iterable[beam_cells.Line], size: Any, label: str) -> BeamTopology:
    """A cell from a table of lines in the unit cube. The tables are sound, so that nothing is checked."""
    period = sizes(size, "cell")
    nodes, edges = beam_cells.table(lines)
    return cell(nodes * period, edges, size=period, label=label, check=False)


def _inset(value: Any, name: str, size: Any, default: float) -> float:
    """A length in mm from 0 to half of the shortest side of the cell, as a share of that side; exact at both ends."""
    side = float(sizes(size, "cell").min())
    if value is None:
        return default
    share = real(value, name, "mm") / side
    if not -_MERGE <= share <= 0.5 + _MERGE:
        raise ArgumentError(
            f"{name}: expected 0 to {0.5 * side:g} mm, half of the shortest side of the cell, got {value!r}"
        )
    return 0.0 if share < _MERGE else 0.5 if share > 0.5 - _MERGE else share


def _truncation(
    lines: Callable[[float], list[beam_cells.Line]],
    size: Any,
    value: Any,
    name: str,
    over: Any,
    label: str,
    default: float,
) -> BeamTopology:
    """A truncated polyhedron: a periodic cell for a number, a graph where the truncation varies."""
    if isinstance(value, Field) or callable(value):
        if over is None:
            raise ArgumentTypeError(f"{name}: expected a number in mm, got a Field, which needs over=region to vary in")
        period, box = sizes(size, "cell"), box_of(over, "over")
        return truncated(lines, period, value, box, name=name, label=label, centred=name == "setback")
    topology = _unit_cell(lines(_inset(value, name, size, default)), size, label)
    return topology if over is None else topology.over(box_of(over, "over"))


def simple_cubic(cell: Any = 10.0) -> BeamTopology:
    """Simple cubic: beams along the edges of the cell (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.cube(), cell, "simple_cubic")


def bcc(cell: Any = 10.0) -> BeamTopology:
    """Body-centred cubic: beams from the centre to the eight corners (LF-rep Table 3.1). `cell` mm, a number or three.

    None is horizontal, so that LF-rep's S-BCC is the same cell.
    """
    return _unit_cell(beam_cells.body(), cell, "bcc")


def bccz(cell: Any = 10.0) -> BeamTopology:
    """BCC and the upright edges of the cell (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.body() + beam_cells.uprights(), cell, "bccz")


def fcc(cell: Any = 10.0) -> BeamTopology:
    """Face-centred cubic: both diagonals of every face, joined at its centre (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.faces(), cell, "fcc")


def fccz(cell: Any = 10.0) -> BeamTopology:
    """FCC and the upright edges of the cell (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.faces() + beam_cells.uprights(), cell, "fccz")


def s_fcc(cell: Any = 10.0) -> BeamTopology:
    """FCC without its horizontal beams, which do not print well (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.sides(), cell, "s_fcc")


def s_fccz(cell: Any = 10.0) -> BeamTopology:
    """S-FCC and the upright edges of the cell (LF-rep Table 3.1, corrected). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.sides() + beam_cells.uprights(), cell, "s_fccz")


def fbcc(cell: Any = 10.0) -> BeamTopology:
    """BCC and FCC together (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.body() + beam_cells.faces(), cell, "fbcc")


def s_fbcc(cell: Any = 10.0) -> BeamTopology:
    """BCC and S-FCC together (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.body() + beam_cells.sides(), cell, "s_fbcc")


def s_fbccz(cell: Any = 10.0) -> BeamTopology:
    """BCC and S-FCCz together (LF-rep Table 3.1). `cell` mm, a number or three."""
    return _unit_cell(beam_cells.body() + beam_cells.sides() + beam_cells.uprights(), cell, "s_fbccz")


def isotruss(cell: Any = 10.0) -> BeamTopology:
    """Simple cubic and BCC together, the pair that can be elastically isotropic. `cell` mm, a number or three.

    To first order it is so where the beams of BCC hold 3/2 of the volume of the others, in a cubic cell: where their diameter
    is 3/4 sqrt(2/sqrt 3) = 0.806 of the others' (Gurtner and Durand 2014; Latture, Begley and Zok 2018). For two diameters,
    unite `simple_cubic(u).thicken(d)` and `bcc(u).thicken(0.806 * d)`.
    """
    return _unit_cell(beam_cells.cube() + beam_cells.body(), cell, "isotruss")


def octet(cell: Any = 10.0) -> BeamTopology:
    """Octet truss: FCC and the octahedron of its face centres, twelve beams at every node. `cell` mm, a number or three."""
    lines = beam_cells.faces() + beam_cells.truncated_octahedron(setback=0.0)
    return _unit_cell(lines, cell, "octet")


def diamond(cell: Any = 10.0) -> BeamTopology:
    """Diamond: four beams at every node (LF-rep Table 3.2, repaired). No mirror planes. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.diamond(), cell, "diamond")


def rhombicuboctahedron(cell: Any = 10.0, *, tau: FieldLike | None = None, over: Any = None) -> BeamTopology:
    """Rhombicuboctahedra: squares on the faces of the cell, triangles at its corners (LF-rep Table 3.3).

    Args:
        cell: mm, a number or three.
        tau: truncation in mm, 0 (simple cubic) to half the cell (octahedra); of a cuboid cell along its shortest side, along
            the others in proportion. None for the Archimedean solid, whose edges are equal: cell / (2 + sqrt 2). A Field or
            a function of position makes a transition (LF-rep 6.3): each node goes by the truncation at its corner of the
            cells, so that neighbours meet.
        over: the region of a transition, a bounded Solid or two corners in mm: its beams, as by `BeamTopology.over`.

    Raises:
        ArgumentError: tau out of its range, somewhere.
        ArgumentTypeError: a tau that varies without `over`.

    Example:
        >>> rhombicuboctahedron(cell=10, tau=2)
        <rhombicuboctahedron: 24 nodes, 36 beams>
        >>> rhombicuboctahedron(cell=10, tau=0)
        <rhombicuboctahedron: 8 nodes, 3 beams>
    """
    return _truncation(beam_cells.rhombicuboctahedron, cell, tau, "tau", over, "rhombicuboctahedron", _ARCHIMEDEAN)


def truncated_cube(cell: Any = 10.0, *, tau: FieldLike | None = None, over: Any = None) -> BeamTopology:
    """Truncated cubes: octagons on the faces of the cell, corners cut off by triangles (LF-rep Table 3.4).

    Args:
        cell: mm, a number or three.
        tau: truncation in mm, 0 (simple cubic) to half the cell (cuboctahedra); of a cuboid cell along its shortest side,
            along the others in proportion. None for the Archimedean solid, whose edges are equal: cell / (2 + sqrt 2). A
            Field or a function of position makes a transition, as for `rhombicuboctahedron`.
        over: the region of a transition, a bounded Solid or two corners in mm.

    Raises:
        ArgumentError: tau out of its range, somewhere.
        ArgumentTypeError: a tau that varies without `over`.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> truncated_cube(cell=10, tau=z / 4, over=((0, 0, 0), (10, 10, 20)))
        <truncated_cube: 28 nodes, 48 beams>
    """
    return _truncation(beam_cells.truncated_cube, cell, tau, "tau", over, "truncated_cube", _ARCHIMEDEAN)


def truncated_octahedron(cell: Any = 10.0, *, setback: FieldLike | None = None, over: Any = None) -> BeamTopology:
    """Truncated octahedra, squares on the faces of the cell: the Kelvin cell and its relatives.

    Args:
        cell: mm, a number or three.
        setback: half the diagonal of the squares in mm, 0 (octahedron) to half the cell (cuboctahedron); of a cuboid cell
            along its shortest side, along the others in proportion. None for a quarter of the cell: Kelvin's, whose edges
            are equal. Octahedron <- Kelvin -> cuboctahedron is LatticeRobot's family. A Field or a function of position
            makes a transition: each square goes by the setback at its middle.
        over: the region of a transition, a bounded Solid or two corners in mm.

    Raises:
        ArgumentError: setback out of its range, somewhere.
        ArgumentTypeError: a setback that varies without `over`.

    Example:
        >>> truncated_octahedron(cell=10)
        <truncated_octahedron: 24 nodes, 24 beams>
    """
    return _truncation(beam_cells.truncated_octahedron, cell, setback, "setback", over, "truncated_octahedron", 0.25)


def octahedron(cell: Any = 10.0) -> BeamTopology:
    """Octahedra that touch at the centres of the faces. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.truncated_octahedron(setback=0.0), cell, "octahedron")


def cuboctahedron(cell: Any = 10.0) -> BeamTopology:
    """Cuboctahedra: the middles of the edges of the cell, joined on its faces. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.truncated_octahedron(setback=0.5), cell, "cuboctahedron")


def truncated_cuboctahedron(cell: Any = 10.0) -> BeamTopology:
    """Truncated cuboctahedra, octagons on the faces of the cell, all edges equal. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.truncated_cuboctahedron(), cell, "truncated_cuboctahedron")


def rhombic_dodecahedron(cell: Any = 10.0) -> BeamTopology:
    """Edges of the rhombic dodecahedra that fill space, the Voronoi cells of FCC; also fluorite. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.rhombic_dodecahedron(), cell, "rhombic_dodecahedron")


def weaire_phelan(cell: Any = 10.0, *, equal: bool = True) -> BeamTopology:
    """Edges of the Weaire-Phelan foam, two dodecahedra and six tetrakaidecahedra a cell (Weaire and Phelan 1994), straightened.

    Args:
        cell: mm, a number or three.
        equal: the eight bubbles hold equal volumes, as in the foam (the power diagram of the A15 sites); otherwise they are the
            Voronoi cells of the sites, the dodecahedra 3 % smaller.
    """
    level = 32.0 ** (-1.0 / 3.0) if equal else 5.0 / 16.0
    return _unit_cell(beam_cells.weaire_phelan(level), cell, "weaire_phelan")


def vintiles(cell: Any = 10.0) -> BeamTopology:
    """Vintiles (IntraLattice): the Kelvin net half a cell up, squares on the ends of the cell. `cell` mm, a number or three."""
    return _unit_cell(beam_cells.vintiles(), cell, "vintiles")


def supported_cubic(cell: Any = 10.0) -> BeamTopology:
    """Simple cubic that prints upright: struts from the columns hold every horizontal beam in its middle.

    They rise at 45 degrees in a cubic cell; no horizontal span is longer than half a cell. `cell` mm, a number or three.
    """
    return _unit_cell(beam_cells.supported_cubic(), cell, "supported_cubic")


def _hexagonal(size: Any) -> np.ndarray:
    """The rectangular period of a hexagonal net: one number is the distance of neighbouring hexagons, and the height."""
    period = sizes(size, "cell")
    return period if np.ndim(size) else period * (1.0, math.sqrt(3.0), 1.0)


def hexagonal_honeycomb(cell: Any = 10.0) -> BeamTopology:
    """Layers of regular hexagons in the x-y plane, a column at every node.

    `cell` mm: the width of a hexagon across its flats, which is also the height between layers; or the three sizes of the
    period, `(width, sqrt(3) width, height)` for regular hexagons.
    """
    return _unit_cell(beam_cells.layers(beam_cells.honeycomb(1.0 / 3.0)), _hexagonal(cell), "hexagonal_honeycomb")


def triangular_honeycomb(cell: Any = 10.0) -> BeamTopology:
    """Layers of equilateral triangles in the x-y plane (an isogrid), a column at every node.

    `cell` mm: the side of a triangle, which is also the height between layers; or the three sizes of the period,
    `(side, sqrt(3) side, height)` for equilateral triangles.
    """
    return _unit_cell(beam_cells.layers(beam_cells.triangles()), _hexagonal(cell), "triangular_honeycomb")


def kagome(cell: Any = 10.0) -> BeamTopology:
    """Layers of triangles and hexagons in turn in the x-y plane, a column at every node.

    `cell` mm: the distance of neighbouring hexagons (twice the side of a triangle), which is also the height between layers; or
    the three sizes of the period, `(distance, sqrt(3) distance, height)` for regular hexagons.
    """
    return _unit_cell(beam_cells.layers(beam_cells.kagome()), _hexagonal(cell), "kagome")


def reentrant(cell: Any = 10.0, *, angle: float = math.pi / 6.0) -> BeamTopology:
    """Layers of re-entrant hexagons in the x-y plane, which widen when they are pulled, a column at every node.

    Args:
        cell: mm, a number or three: the width of a hexagon, the period along its ribs (y), the height between layers.
        angle: how far the slanted ribs lean inwards from x, in rad: between 0 (bricks, not auxetic) and where the waist
            closes, atan(cell y / cell x). The straight ribs are `cell y / 2 + tan(angle) cell x / 2` long (Masters and Evans
            1996, whose angle is the negative).

    Raises:
        ArgumentError: an angle out of its range.
    """
    size = sizes(cell, "cell")
    lean, most = real(angle, "angle", "rad"), math.atan2(size[1], size[0])
    if not 0.0 < lean < most:
        raise ArgumentError(f"angle: expected more than 0 and less than {most:.4g} rad for this cell, got {angle!r}")
    rib = 0.5 + 0.5 * math.tan(lean) * float(size[0] / size[1])
    return _unit_cell(beam_cells.layers(beam_cells.honeycomb(rib)), size, "reentrant")


def columns(
    cell: Any = 10.0, *, pattern: Literal["square", "hexagonal", "triangular", "kagome"] = "square"
) -> BeamTopology:
    """Upright columns without anything between them: a group to `combine`, or pins between plates.

    Args:
        cell: mm, a number or three; one number as for the honeycomb of the pattern.
        pattern: the plane net at whose nodes they stand: "square", "hexagonal", "triangular" or "kagome".

    Raises:
        ArgumentError: an unknown pattern.

    Example:
        >>> columns(cell=6, pattern="hexagonal")
        <columns: 8 nodes, 4 beams>
    """
    nets = {
        "square": beam_cells.squares,
        "hexagonal": lambda: beam_cells.honeycomb(1.0 / 3.0),
        "triangular": beam_cells.triangles,
        "kagome": beam_cells.kagome,
    }
    one_of(pattern, "pattern", nets)
    size = sizes(cell, "cell") if pattern == "square" else _hexagonal(cell)
    return _unit_cell(beam_cells.columns(nets[pattern]()), size, "columns")
