"""Where a parameter is read: at the point itself, once a cell, at the nodes of a graph, or at the foot.

LF-rep 5 names four rules. A law is a Field, so that three of them are Field arithmetic: `point` is the law as it is,
`cell` reads it at the centre of the cell (`per_cell`), and `foot` at the nearest point of a surface whose distance is a
Field (`at_foot`). The foot on a beam is a point of its axis: a law read there makes tapered beams, which `along_beams`
puts together from exact cones, as many as the law needs. `node` reads the law at the nodes alone (`at_nodes`), and
beams taper evenly between them. Both are for explicit graphs, which `topology.over(region)` makes of a periodic
lattice.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, as_field, clip, coordinates, floor
from frep.arguments import positive, sizes, vector
from frep.graphs import divided
from frep.skeleton import GraphSkeleton


def per_cell(law: FieldLike, cell: Any, origin: Any = (0.0, 0.0, 0.0)) -> Field:
    """A law that is constant in every cell: it is read at the cell's centre (LF-rep 5, `sample="cell"`).

    Args:
        law: number, Field or function of position.
        cell: size of the cells in mm, a number or three; the period of the topology.
        origin: a corner of a cell, mm.

    Raises:
        ArgumentError: sizes that are not positive.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> per_cell(x, cell=10)([[1, 0, 0], [9, 0, 0], [-3, 0, 0]])
        array([ 5.,  5., -5.])
    """
    field, size, corner = as_field(law, "law"), sizes(cell, "cell"), vector(origin, "origin")
    if field.is_constant:
        return field
    centres = [c0 + s * (floor((c - c0) / s) + 0.5) for c, c0, s in zip(coordinates(), corner, size, strict=True)]
    return field.substitute(*centres)


def at_nodes(law: FieldLike, topology: Any) -> np.ndarray:
    """The law's numbers at the nodes of an explicit graph: beams taper between them (LF-rep 5, `sample="node"`).

    Args:
        law: number, Field or function of position.
        topology: an explicit graph of `topologies.beams`: `beams.graph`, or a periodic lattice's `over(region)`.

    Returns:
        (n,) numbers, what `thicken` takes as `diameter`.

    Raises:
        ArgumentTypeError: something without a skeleton.
        ArgumentError: a periodic topology, whose nodes repeat without end: its law would repeat too.

    Example:
        >>> from topologies import beams
        >>> strut = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)])
        >>> at_nodes(lambda x, y, z: 1 + x / 10, strut)
        array([1., 2.])
    """
    return as_field(law, "law")(_graph_of(topology).nodes)


def along_beams(law: FieldLike, topology: Any, *, tolerance: float = 0.01) -> tuple[Any, np.ndarray]:
    """A graph whose beams taper as a law says along their axes (LF-rep 5, "foot"), and its diameters at the nodes.

    Beams along which the law is not straight get nodes in between, where it bends and only as many as it takes.

    Args:
        law: number, Field or function of position, mm.
        topology: an explicit graph of `topologies.beams`, such as a periodic lattice's `over(region)`.
        tolerance: how far the diameter may be off the law along an axis, mm. Where the law jumps, it is off next to the
            jump, over a thousandth of the beam at most.

    Returns:
        The graph, and (n,) numbers, what its `thicken` takes as `diameter`.

    Raises:
        ArgumentTypeError: something without a skeleton.
        ArgumentError: a periodic topology, a tolerance that is not positive.

    Example:
        >>> from topologies import beams
        >>> strut = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)])
        >>> along_beams(lambda x, y, z: 1 + x / 10, strut)
        (<graph: 2 nodes, 1 beams>, array([1., 2.]))
        >>> bent, diameter = along_beams(lambda x, y, z: 1 + (x / 10) ** 2, strut, tolerance=0.02)
        >>> bent, diameter
        (<graph: 5 nodes, 4 beams>, array([1.    , 2.    , 1.0625, 1.25  , 1.5625]))
        >>> part = bent.thicken(diameter)
    """
    skeleton, field, off = _graph_of(topology), as_field(law, "law"), positive(tolerance, "tolerance")
    beams, shares = _bends(field, skeleton.segments(), off)
    if not len(beams):
        return topology, field(skeleton.nodes)
    finer = divided(skeleton, beams, shares)
    return replace(topology, skeleton=finer), field(finer.nodes)


_LOOKS = np.array([0.0, 0.113, 0.237, 0.354, 0.5, 0.619, 0.762, 0.871, 1.0])
"""Where a piece of a beam is looked at to see whether a law is straight along it: unevenly, since laws often share the period of
the cells and have zeros at its even parts."""
_MOST_HALVINGS = 10


def _bends(field: Field, ends: np.ndarray, off: float) -> tuple[np.ndarray, np.ndarray]:
    """Beams (k,) and shares of their lengths (k,) between which a law is straight to `off`, by halving."""
    beam, low = np.arange(len(ends)), np.zeros(len(ends))
    found = [(np.zeros(0, np.int64), np.zeros(0))]
    for halving in range(_MOST_HALVINGS):
        width = 0.5**halving
        shares = low[:, None] + width * _LOOKS
        points = ends[beam, None, 0] + shares[..., None] * (ends[beam, 1] - ends[beam, 0])[:, None, :]
        values = field(points.reshape(-1, 3)).reshape(shares.shape)
        straight = values[:, :1] + _LOOKS * (values[:, -1:] - values[:, :1])
        bent = np.abs(values - straight).max(axis=1) > off
        beam, low = beam[bent], low[bent]
        if not len(beam):
            break
        middle = low + 0.5 * width
        found.append((beam, middle))
        beam, low = np.concatenate([beam, beam]), np.concatenate([low, middle])
    return np.concatenate([b for b, _ in found]), np.concatenate([s for _, s in found])


def _graph_of(topology: Any) -> GraphSkeleton:
    """The skeleton of an explicit topology."""
    skeleton = getattr(topology, "skeleton", None)
    if skeleton is None:
        raise ArgumentTypeError(f"topology: expected a beam topology with nodes, got {type(topology).__name__}")
    if not isinstance(skeleton, GraphSkeleton):
        if not np.all(np.isfinite(skeleton.bounds)):
            raise ArgumentError(
                f"topology: {topology!r} repeats without end, so that a number a node cannot vary; take the beams of a "
                "region, topology.over(region), or give the Field itself"
            )
        raise ArgumentTypeError(f"topology: expected an explicit graph, got {topology!r}, whose nodes are not stored")
    return skeleton


def at_foot(law: FieldLike, distance: FieldLike) -> Field:
    """A law read at the nearest point of a surface: constant along the surface's normals (LF-rep 5, "foot").

    Args:
        law: number, Field or function of position.
        distance: signed distance to the surface, mm: `gyroid(cell=8).distance`, or the `field` of a solid that is
            exact.

    The foot of X is X - d grad d. Sampled distances (periodic surfaces, loaded bodies) are differenced for the slope,
    which costs six more evaluations of each. For beams there is `along_beams`.

    Raises:
        ArgumentTypeError: no Field, a beam topology.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> at_foot(x, frep.sphere((0, 0, 0), 5).field)([[3, 0, 0], [50, 0, 0], [-1, 0, 0]])
        array([ 5.,  5., -5.])
    """
    if hasattr(distance, "skeleton"):
        raise ArgumentTypeError(
            f"distance: expected a Field, got {distance!r}; for beams there is along_beams(law, graph)"
        )
    field, d = as_field(law, "law"), as_field(distance, "distance")
    if field.is_constant:
        return field
    # A foot lies within |d|; said outright, because bounds of a difference quotient say nothing.
    reach = abs(d)
    feet = [c - clip(d * slope, -reach, reach) for c, slope in zip(coordinates(), d.derivatives(), strict=True)]
    return field.substitute(*feet)
