"""Hubs as one boundary of OpenCASCADE: every face is laid down by its curves, and no algorithm intersects anything.

Cylinders and cones are halved along their seams and balls are cut between the beams, so that no face wraps round or
holds a pole: readers of STEP have nothing to guess.
"""

# pyright: reportAttributeAccessIssue=false
# (OCP is a compiled module whose stubs pyright does not find.)
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from frep.io._net import Arc, Hub, Net, Step

Array = npt.NDArray[np.float64]

_TOLERANCE = 1e-7
_STRAIGHT = 1e-9
"""Beams whose radius changes less, mm a mm, are cylinders."""


@dataclass(frozen=True)
class Placed:
    """A hub where it is, and for each of its beams which hub and which of its beams it goes to; -1 for one cut off."""

    center: Array
    hub: Hub
    net: Net
    other: Sequence[tuple[int, int]]


def solids_of(hubs: Sequence[Placed]) -> list[Any]:
    """One solid for each set of hubs that hangs together."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    builder = BRep_Builder()
    made = []
    for group in _components(hubs):
        shell = TopoDS_Shell()
        builder.MakeShell(shell)
        for face in _Layer({n: hubs[n] for n in group}).faces():
            builder.Add(shell, face)
        shell.Closed(True)
        solid = TopoDS_Solid()
        builder.MakeSolid(solid)
        builder.Add(solid, shell)
        made.append(solid)
    return made


def _components(hubs: Sequence[Placed]) -> list[list[int]]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.array([(n, m) for n, hub in enumerate(hubs) for m, _ in hub.other if m >= 0]).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(hubs),) * 2)
    _, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == number).tolist() for number in np.unique(label)]


class _Layer:
    """Lays down the faces of some hubs; edges and vertices that faces share are made once."""

    def __init__(self, hubs: dict[int, Placed]) -> None:
        from OCP.BRep import BRep_Builder
        from OCP.ShapeFix import ShapeFix_Edge

        self.hubs = hubs
        self.builder = BRep_Builder()
        self.fix = ShapeFix_Edge()
        self.corners: dict[tuple[int, int], Any] = {}
        self.edges: dict[tuple[int, int], Any] = {}

    def faces(self) -> list[Any]:
        found = []
        for n, placed in self.hubs.items():
            for loop, pole, side in placed.net.patches:
                wire = [self.arc(n, step) for step in loop]
                found.append(self.face(self.sphere(placed.center, placed.hub.ball, pole, side), wire))
            for i, (m, j) in enumerate(placed.other):
                if m < 0:
                    found += self.stub(n, i)
                elif (n, i) < (m, j):
                    found += self.beam(n, i, m, j)
        return found

    # --- faces --------------------------------------------------------------------------------------------------------

    def beam(self, n: int, i: int, m: int, j: int) -> list[Any]:
        """The two halves of a beam from one hub to another."""
        here, there = self.hubs[n].net.chains[i], self.hubs[m].net.chains[j]
        ends = [(self.seam(n, i, k), self.seam(m, j, k)) for k in (0, 1)]
        sides = [self.line(*pair) for pair in ends]
        halves = []
        for half in (0, 1):
            wire = [self.arc(n, step) for step in here[half]]
            wire.append(sides[1 - half])
            wire += [self.arc(m, step) for step in there[1 - half]]
            wire.append(sides[half].Reversed())
            halves.append(self.face(self.mantle(n, i, half), wire))
        return halves

    def stub(self, n: int, i: int) -> list[Any]:
        """The two halves of a half beam, and the disc where it is cut."""
        placed = self.hubs[n]
        hub = placed.hub
        u, seam, cut = hub.along[i], hub.seams[i], hub.cuts[i]
        right = np.cross(u, seam)
        radius = (hub.radius - cut * hub.sines[i]) / math.sqrt(1.0 - hub.sines[i] ** 2)
        middle = cut * u
        rim = [self.vertex(placed.center + middle + radius * side) for side in (seam, -seam)]
        sides = [self.line(self.seam(n, i, k), rim[k]) for k in (0, 1)]
        circle = Arc((0, 0), middle, middle, seam, right, radius, radius, 0.0, np.pi)
        back = Arc((0, 0), middle, middle, seam, right, radius, radius, np.pi, 2.0 * np.pi)
        halves = [self.curve(circle, placed.center, rim[0], rim[1]), self.curve(back, placed.center, rim[1], rim[0])]
        faces = []
        for half in (0, 1):
            wire = [self.arc(n, step) for step in placed.net.chains[i][half]]
            wire += [sides[1 - half], halves[half].Reversed(), sides[half].Reversed()]
            faces.append(self.face(self.mantle(n, i, half), wire))
        return [*faces, self.face(_plane(placed.center + middle, u, seam), halves)]

    def face(self, surface: Any, edges: list[Any]) -> Any:
        from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Wire

        wire, face = TopoDS_Wire(), TopoDS_Face()
        self.builder.MakeWire(wire)
        for edge in edges:
            self.builder.Add(wire, edge)
        wire.Closed(True)
        self.builder.MakeFace(face, surface, _TOLERANCE)
        self.builder.Add(face, wire)
        for edge in edges:
            self.fix.FixAddPCurve(TopoDS.Edge_s(edge), face, False, _TOLERANCE)
        return face

    # --- surfaces -----------------------------------------------------------------------------------------------------

    def mantle(self, n: int, i: int, half: int) -> Any:
        """Cylinder or cone, its parametrisation's seam on the other half."""
        from OCP.Geom import Geom_ConicalSurface, Geom_CylindricalSurface

        placed = self.hubs[n]
        hub = placed.hub
        u, sine = hub.along[i], float(hub.sines[i])
        x = (2.0 * half - 1.0) * np.cross(u, hub.seams[i])
        if abs(sine) < _STRAIGHT:
            return Geom_CylindricalSurface(_frame(placed.center, u, x), hub.radius)
        # STEP wants the radius to grow along the axis.
        u = -math.copysign(1.0, sine) * u
        radius = hub.radius / math.sqrt(1.0 - sine * sine)
        return Geom_ConicalSurface(_frame(placed.center, u, x), math.asin(abs(sine)), radius)

    def sphere(self, center: Array, radius: float, pole: Array, side: Array) -> Any:
        from OCP.Geom import Geom_SphericalSurface

        return Geom_SphericalSurface(_frame(center, pole, side), radius)

    # --- edges and vertices -------------------------------------------------------------------------------------------

    def vertex(self, place: Array) -> Any:
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        vertex = TopoDS_Vertex()
        self.builder.MakeVertex(vertex, gp_Pnt(*place.tolist()), _TOLERANCE)
        return vertex

    def corner(self, n: int, number: int) -> Any:
        if (n, number) not in self.corners:
            placed = self.hubs[n]
            self.corners[n, number] = self.vertex(placed.center + placed.net.points[number])
        return self.corners[n, number]

    def seam(self, n: int, i: int, k: int) -> Any:
        """The vertex where a seam of a beam begins: at the start of its half turn k."""
        net = self.hubs[n].net
        number, forward = net.chains[i][k][0]
        return self.corner(n, net.arcs[number].ends[0 if forward else 1])

    def arc(self, n: int, step: Step) -> Any:
        number, forward = step
        if (n, number) not in self.edges:
            placed = self.hubs[n]
            arc = placed.net.arcs[number]
            ends = [self.corner(n, end) for end in arc.ends]
            self.edges[n, number] = self.curve(arc, placed.center, *ends)
        edge = self.edges[n, number]
        return edge if forward else edge.Reversed()

    def curve(self, arc: Arc, center: Array, start: Any, end: Any) -> Any:
        from OCP.Geom import Geom_Circle, Geom_Ellipse

        axes = _axes(center + arc.center, np.cross(arc.x, arc.y), arc.x)
        round_ = arc.a - arc.b < 1e-9 * arc.a
        curve = Geom_Circle(axes, arc.a) if round_ else Geom_Ellipse(axes, arc.a, arc.b)
        return self.edge(curve, start, end, arc.first, arc.last)

    def line(self, start: Any, end: Any) -> Any:
        from OCP.BRep import BRep_Tool
        from OCP.Geom import Geom_Line
        from OCP.gp import gp_Dir, gp_Vec

        p, q = BRep_Tool.Pnt_s(start), BRep_Tool.Pnt_s(end)
        return self.edge(Geom_Line(p, gp_Dir(gp_Vec(p, q))), start, end, 0.0, p.Distance(q))

    def edge(self, curve: Any, start: Any, end: Any, first: float, last: float) -> Any:
        from OCP.BRep import BRep_Tool
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopoDS import TopoDS_Edge

        edge = TopoDS_Edge()
        self.builder.MakeEdge(edge, curve, _TOLERANCE)
        self.builder.Add(edge, start.Oriented(TopAbs_Orientation.TopAbs_FORWARD))
        self.builder.Add(edge, end.Oriented(TopAbs_Orientation.TopAbs_REVERSED))
        self.builder.Range(edge, float(first), float(last))
        # Points that were nearly one have become one.
        for vertex, parameter in ((start, first), (end, last)):
            gap = BRep_Tool.Pnt_s(vertex).Distance(curve.Value(float(parameter)))
            if gap > 0.5 * _TOLERANCE:
                self.builder.UpdateVertex(vertex, 2.0 * gap + _TOLERANCE)
        return edge


def _frame(center: Array, axis: Array, x: Array) -> Any:
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

    return gp_Ax3(gp_Pnt(*center.tolist()), gp_Dir(*axis.tolist()), gp_Dir(*x.tolist()))


def _axes(center: Array, axis: Array, x: Array) -> Any:
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return gp_Ax2(gp_Pnt(*center.tolist()), gp_Dir(*axis.tolist()), gp_Dir(*x.tolist()))


def _plane(center: Array, axis: Array, x: Array) -> Any:
    from OCP.Geom import Geom_Plane

    return Geom_Plane(_frame(center, axis, x))
