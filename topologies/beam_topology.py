"""What `topologies.beams` makes: a skeleton of beams that can be moved, cut out, trimmed and given thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, Solid, as_field, coordinates, graphs
from frep.arguments import box_of, direction, real, turn
from frep.arguments import vector as vector_of
from frep.errors import DisconnectedWarning, warn
from frep.similarity import Screw, Similarity, Translation
from frep.skeleton import GraphSkeleton, PeriodicSkeleton, Skeleton
from frep.thicken import Rectangle, thickened

from . import beam_cells

if TYPE_CHECKING:
    from frep.graphs import Connectivity

_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])
_ROUNDING = 1e-15
"""Smaller entries of a rotation are the rounding of zeros."""


@dataclass(frozen=True, eq=False)
class BeamTopology:
    """A skeleton of beams, made by the functions of `topologies.beams`. `skeleton` answers ball queries.

    Attributes:
        skeleton: nodes and beams, periodic or explicit; of a moved lattice, before it was moved.
        label: what it is called in messages.
        placement: where a periodic lattice was moved; None where it was not. Explicit graphs are moved node by node.
        report: what was found when it was made: a `Transition` of `assembled` and `cell_map`, a `frep.graphs.Trimmed`
            of `trimmed`.
    """

    skeleton: Skeleton
    label: str
    placement: Similarity | None = None
    report: Any = None

    def __repr__(self) -> str:
        moved = ", moved" if self.placement is not None else ""
        return f"<{self.label}: {len(self.skeleton.nodes)} nodes, {len(self.skeleton.edges)} beams{moved}>"

    def thicken(
        self,
        diameter: FieldLike | np.ndarray | list[float],
        *,
        node: FieldLike | np.ndarray | list[float] | None = None,
        section: str | Rectangle = "circle",
        blend: FieldLike = 0.0,
    ) -> Solid:
        """Beams of the given diameter, joined by node balls where `node` is given.

        Args:
            diameter: full width of the beams in mm: a number, a Field or a function of position; or one number a node,
                between which beams taper (exact sphere-swept cones), the same for nodes that are one, a period apart.
                For a square section, its side.
            node: diameter of a ball at every node, number or Field; None for none. Or one number a node, 0 for none, with
                numbers for `diameter`. Round beams end in half balls and need none; square ones end flat.
            section: "circle", "square", or `square(fillet=...)` for a rounded square. Sections stand upright: their
                first side is horizontal (lf-rep 3.2); those of a periodic lattice turn with it.
            blend: radius in mm of the fillet between beams, number or Field. It is exact where two surfaces meet at a
                right angle. Where a Field for `node`, `blend` or a fillet falls below zero it counts as zero.

        Fields are read where the part is, whether the lattice was moved or not. The field is an exact distance outside
        while the diameter is constant and nothing blends.

        Raises:
            ArgumentError: a diameter, node or blend that is not positive, a wrong number of node diameters, or two for
                a node and its copy in the next cell.
            ArgumentTypeError: a Field where numbers are needed.

        Example:
            >>> import frep
            >>> from topologies.beams import simple_cubic
            >>> part = simple_cubic(cell=10).thicken(2) & frep.box((0, 0, 0), (10, 10, 10))
            >>> part.contains([[5, 0.5, 0.5], [5, 5, 5]])
            array([ True, False])
        """
        if isinstance(self.skeleton, PeriodicSkeleton):
            for name, value in (("diameter", diameter), ("node", node)):
                _require_alike(value, name, self.skeleton)
        solid = thickened(self.skeleton, diameter, node=node, section=section, blend=blend, label=self.label)
        return solid if self.placement is None else _placed(solid, self.placement)

    def check(self) -> list[beam_cells.Fault]:
        """What is wrong with a periodic cell, the worst first; empty for a sound one.

        Looks for nodes that coincide or miss each other (in the cell or across its period), beams that cross or run
        along each other where they have no node, nodes at which one beam ends or none, and lattices of several parts that
        never touch. A moved cell is looked at as it was before.

        Raises:
            ArgumentTypeError: an explicit graph, which has no period; it has `connectivity()`.

        Example:
            >>> from topologies.beams import bcc, columns
            >>> bcc(cell=5).check()
            []
            >>> for fault in columns(cell=5).check():
            ...     print(fault)
            edges: the lattice falls into columns or layers that never touch
        """
        if not isinstance(self.skeleton, PeriodicSkeleton):
            raise ArgumentTypeError(f"check: expected a periodic cell, got {self!r}; a graph has connectivity()")
        return beam_cells.faults(self.skeleton.nodes, self.skeleton.edges, self.skeleton.size)

    # --- moved --------------------------------------------------------------------------------------------------------

    def rotate(self, axis: Any, angle: float, center: Any = (0.0, 0.0, 0.0)) -> BeamTopology:
        """Turn by `angle` rad round `axis` ("x", "y", "z" or a vector) through `center`, right-handed.

        Warns:
            DegreesWarning: more than a full turn (`frep.arguments.DegreesWarning`), as 45 for 45 degrees would be.

        Example:
            >>> import math
            >>> from topologies.beams import bcc
            >>> bcc(cell=5).rotate("y", math.pi / 4)
            <bcc: 9 nodes, 8 beams, moved>
        """
        along, through = direction(axis, "axis"), vector_of(center, "center")
        return self._moved(Screw(turn(angle, "angle"), along.tolist(), through.tolist()))

    def translate(self, vector: Any) -> BeamTopology:
        """Move by `vector` (x, y, z) mm."""
        return self._moved(Translation(vector_of(vector, "vector").tolist()))

    def _moved(self, by: Similarity) -> BeamTopology:
        if isinstance(self.skeleton, PeriodicSkeleton):
            return replace(self, placement=by if self.placement is None else by @ self.placement, report=None)
        return replace(self, skeleton=replace(self.skeleton, nodes=by.apply(self.skeleton.nodes)), report=None)

    # --- explicit graphs ----------------------------------------------------------------------------------------------

    def over(self, region: Any, *, margin: float = 0.0) -> BeamTopology:
        """All beams that come into the box of a region, whole, as an explicit graph.

        A beam in a face of the box comes into it; one that only touches it with an end does not. So a box of whole
        cells gives the beams of these cells.

        Args:
            region: a bounded Solid, whose bounds count, or two corners ((x0, y0, z0), (x1, y1, z1)) in mm.
            margin: how far beyond the box beams are wanted too, mm: half a diameter, where thick beams that run beside
                the region reach into it.

        Raises:
            ArgumentError: a negative margin.
            UnboundedError: an infinite region.
            ArgumentTypeError: neither a Solid nor two corners.
            EmptyError: no beam comes into it.
            TooLargeError: more than fifty million beams.

        Example:
            >>> from topologies.beams import simple_cubic
            >>> simple_cubic(cell=5).over(((0, 0, 0), (10, 10, 10)))
            <simple_cubic: 27 nodes, 54 beams>
        """
        wider = real(margin, "margin", "mm")
        if wider < 0.0:
            raise ArgumentError(f"margin: expected a width >= 0 mm, got {margin!r}")
        box = box_of(region, "region") + wider * np.array([[-1.0], [1.0]])
        if self.placement is None:
            return BeamTopology(graphs.cut_out(self.skeleton, box), self.label)
        # The box of the region's image holds all that is wanted, and more.
        corners = self.placement.inverse().apply(_corners(box))
        found = graphs.cut_out(self.skeleton, np.array([corners.min(axis=0), corners.max(axis=0)]))
        there = replace(found, nodes=self.placement.apply(found.nodes))
        return BeamTopology(graphs.cut_out(there, box), self.label)

    def trimmed(self, solid: Solid, *, step: float | None = None, connected: bool = False) -> BeamTopology:
        """The parts of beams in a solid, cut where they cross its surface (lf-rep 9: clip, do not drop).

        Beams in the surface stay. `report` is a `frep.graphs.Trimmed`, which tells the cut points.

        Args:
            solid: any Solid; a bounded one for a periodic lattice.
            step: how far apart beams are looked at, mm; a beam that leaves the solid for less may stay. None for a
                sixteenth of each beam.
            connected: leave out all but the part with the greatest length of beams: what is cut loose at the surface.

        Raises:
            ArgumentError: an infinite solid for a periodic lattice, a step that is not positive.
            ArgumentTypeError: no Solid.
            EmptyError: no beam lies in it.

        Warns:
            DisconnectedWarning: the lattice falls into more parts than it had, and all are kept.

        Example:
            >>> import frep
            >>> from topologies.beams import bcc
            >>> inside = bcc(cell=5).trimmed(frep.sphere((0, 0, 0), 8))
            >>> float(abs(inside.skeleton.nodes[inside.report.cut]).max() <= 8)
            1.0
        """
        if not isinstance(solid, Solid):
            raise ArgumentTypeError(f"solid: expected a Solid, got {type(solid).__name__}: {solid!r}")
        if not isinstance(self.skeleton, GraphSkeleton):
            if not solid.is_bounded:
                raise ArgumentError(f"solid: expected a bounded solid, got {solid!r}; {self!r} repeats without end")
            return self.over(solid).trimmed(solid, step=step, connected=connected)
        found = graphs.trimmed(self.skeleton, solid, step=step)
        main, parts, others = graphs.largest_part(found)
        if connected:
            found = main
        elif parts > 1 and parts > graphs.connectivity(self.skeleton).components:
            warn(
                f"solid: {self.label} falls into {parts:,} parts where it is cut; all but the largest hold {others:.2g} of the "
                "length of its beams. connected=True leaves them out; a skin, as of solid.shell(1), holds them",
                DisconnectedWarning,
            )
        return BeamTopology(found.skeleton, self.label, report=found)

    def subdivided(self, length: float) -> BeamTopology:
        """Every beam in equal pieces of at most `length` mm.

        Raises:
            ArgumentError: a length that is not positive.
        """
        return replace(self, skeleton=graphs.subdivided(self.skeleton, length), report=None)

    def connectivity(self) -> Connectivity:
        """Components, dangling and lone nodes, and isolated beams of an explicit graph.

        Raises:
            ArgumentTypeError: a periodic lattice, which has no end; it has `check()`.

        Example:
            >>> from topologies.beams import diamond
            >>> print(diamond(cell=5).over(((0, 0, 0), (5, 5, 5))).connectivity())
            one component, 4 dangling nodes
        """
        if not isinstance(self.skeleton, GraphSkeleton):
            raise ArgumentTypeError(
                f"connectivity: expected an explicit graph, got {self!r}, which repeats without end; make one with "
                "over(region), or see check()"
            )
        return graphs.connectivity(self.skeleton)

    @staticmethod
    def assembled(
        parts: Sequence[tuple[BeamTopology, Solid | None]],
        *,
        over: Any,
        bridge: Literal["nearest"] | None = None,
        reach: float | None = None,
    ) -> BeamTopology:
        """One graph of several lattices, each in a region of its own: `topologies.beams.assemble`, which see."""
        from .assembly import assemble

        return assemble(parts, over=over, bridge=bridge, reach=reach)


def _corners(box: np.ndarray) -> np.ndarray:
    return np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])


def _require_alike(value: Any, name: str, skeleton: PeriodicSkeleton) -> None:
    """Refuse two diameters for one node of a periodic lattice; what is no number for each node is checked elsewhere."""
    try:
        widths = np.asarray(value, float) if isinstance(value, list | tuple | np.ndarray) else np.zeros(0)
    except (TypeError, ValueError):
        return
    if widths.shape != (len(skeleton.nodes),) or not np.all(np.isfinite(widths)):
        return
    number = beam_cells.folded(skeleton.nodes, skeleton.size)
    first = np.unique(number, return_index=True)[1][number]
    unlike = np.flatnonzero(widths != widths[first])
    if len(unlike):
        i, j = int(unlike[0]), int(first[unlike[0]])
        raise ArgumentError(
            f"{name}: nodes {j} and {i} are one, a period apart, and have {widths[j]:g} and {widths[i]:g} mm; give them the "
            "same, or take the beams of a region with over(region)"
        )


def _placed(solid: Solid, placement: Similarity) -> Solid:
    """A periodic lattice, moved: its beams, and not its widths, which are read where the part is."""
    back = placement.rotation.T
    back[np.abs(back) < _ROUNDING] = 0.0
    shift = -back @ placement.translation
    place = [sum((back[i, j] * c for j, c in enumerate(coordinates())), start=float(shift[i])) for i in range(3)]
    # A beam leaf is read at its first three arguments; its widths follow them.
    leaf = solid.field
    field = Field(leaf.op, (*(as_field(p) for p in place), *leaf.args[3:]), leaf.data)
    beams = None if solid.beams is None else solid.beams.placed(back.T, placement.translation)
    return Solid._make(field, _EVERYWHERE, features=solid.features, label=solid._provenance.label, beams=beams)
