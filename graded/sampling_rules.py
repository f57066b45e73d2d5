"""Where a parameter is read: at the point itself, once a cell, at the nodes of a graph, or at the foot on a surface.

LF-rep 5 names four rules. A law is a Field, so that three of them are Field arithmetic: `point` is the law as it is,
`cell` reads it at the centre of the cell (`per_cell`), and `foot` at the nearest point of a surface whose distance is a
Field (`at_foot`). `node` gives numbers instead of a Field (`at_nodes`). Beams of a periodic cell have no `foot`: the
kernel tells how far the nearest beam is, not where on it the nearest point lies; for an explicit graph `at_nodes` gives
the same tapered beams.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, Solid, as_field, clip, coordinates, floor
from frep.arguments import vector


def sizes(value: Any, name: str) -> np.ndarray:
    """One size or three as (3,) positive mm.

    Raises:
        ArgumentError: not positive, not finite, or neither one number nor three.
        ArgumentTypeError: no numbers.
    """
    if isinstance(value, Field) or callable(value):
        raise ArgumentTypeError(f"{name}: expected a number or three numbers in mm, got {value!r}")
    try:
        size = np.broadcast_to(np.asarray(value, dtype=float), (3,)).copy()
    except (TypeError, ValueError):
        raise ArgumentError(f"{name}: expected a number or three numbers in mm, got {value!r}") from None
    if not np.all(np.isfinite(size) & (size > 0)):
        raise ArgumentError(f"{name}: expected finite sizes > 0 mm, got {value!r}")
    return size


def box_of(over: Any, name: str = "over") -> np.ndarray:
    """The (2, 3) box of a bounded Solid, or of two corners in mm.

    Raises:
        ArgumentError: an infinite solid, or corners that are not two points in order.
    """
    if isinstance(over, Solid):
        if not over.is_bounded:
            raise ArgumentError(f"{name}: expected a bounded solid, got {over!r}; intersect it with a box first")
        return np.array(over.bounds)
    try:
        box = np.array(over, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a Solid or ((x0, y0, z0), (x1, y1, z1)), got {over!r}") from None
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or not np.all(box[0] < box[1]):
        raise ArgumentError(
            f"{name}: expected a Solid or finite ((x0, y0, z0), (x1, y1, z1)) with lower < upper, got {over!r}"
        )
    return box


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
        topology: a topology of `topologies.beams` that was made from nodes, such as `beams.graph`.

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
    skeleton = getattr(topology, "skeleton", None)
    if skeleton is None:
        raise ArgumentTypeError(f"topology: expected a beam topology with nodes, got {type(topology).__name__}")
    if not np.all(np.isfinite(skeleton.bounds)):
        raise ArgumentError(
            f"topology: {topology!r} repeats without end, so that a number a node cannot vary; give the Field itself, "
            "or make an explicit graph"
        )
    return as_field(law, "law")(skeleton.nodes)


def at_foot(law: FieldLike, distance: FieldLike) -> Field:
    """A law read at the nearest point of a surface: constant along the surface's normals (LF-rep 5, "foot").

    Args:
        law: number, Field or function of position.
        distance: signed distance to the surface, mm: `gyroid(cell=8).distance`, or the `field` of a solid that is
            exact.

    The foot of X is X - d grad d. Sampled distances (periodic surfaces, loaded bodies) are differenced for the slope,
    which costs six more evaluations of each.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> at_foot(x, frep.sphere((0, 0, 0), 5).field)([[3, 0, 0], [50, 0, 0], [-1, 0, 0]])
        array([ 5.,  5., -5.])
    """
    field, d = as_field(law, "law"), as_field(distance, "distance")
    if field.is_constant:
        return field
    # A foot lies within |d|; said outright, because bounds of a difference quotient say nothing.
    reach = abs(d)
    feet = [c - clip(d * slope, -reach, reach) for c, slope in zip(coordinates(), d.derivatives(), strict=True)]
    return field.substitute(*feet)
