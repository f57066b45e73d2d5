"""Beams as exact solids through OpenCASCADE: the pieces, their union, and the proof that it is right.

OpenCASCADE's union of many tangled cylinders is slow and, worse, sometimes wrong while it says "valid": a face lost, a
fifth of the volume gone. So the union is cut into *knots*, half beams round one node that touch the next knot only in
a flat disc; each knot is small, its volume is checked against the signed distance, and other tolerances are tried
until it agrees. Knots are then glued, which needs no intersection. Knots that overlap are made as one.
"""

# pyright: reportAttributeAccessIssue=false
# (OCP is a compiled module whose stubs pyright does not find.)
from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from frep.errors import FrepError

Array = npt.NDArray[np.float64]
Box = tuple[Array, Array]

# Wrong unions are off by 1 % and far more; the quadrature they are checked against is good to about 0.1 %.
_VOLUME_TOLERANCE = 0.004
_CRUMB = 2e-5


_ATTEMPTS = (
    (0, 1.0, 0.0),
    (0, 1.0, 1e-5),
    (0, 1.0, 1e-4),
    (1, 1.0, 0.0),
    (2, 1.0, 0.0),
    (0, 1.003, 0.0),
    (0, 1.003, 1e-5),
    (0, 1.0, 1e-3),
    (0, 1.01, 1e-4),
)
"""How a union is tried: by how many turns further the balls, how much larger, and with which tolerance.

A plain union first; then with vertices and curves allowed to differ a little, which settles near-tangencies; then with the
seams of balls elsewhere; then with balls a touch larger, which removes the tangency of a ball and a beam of its own radius."""


class BrepError(FrepError):
    """OpenCASCADE could not make a correct solid; the message says of what, and what to do instead."""


@dataclass(frozen=True)
class Pieces:
    """Cylinders or cones and balls, to be united.

    Attributes:
        start, end: (m, 3) axis ends.
        start_radius, end_radius: (m,).
        seam: (m, 3) unit vectors across the axis; where the seam of the cylinder lies. Two pieces that touch in a disc
            need the same one, so that the discs are the same circle with the same vertex.
        center, ball: (k, 3) and (k,), balls.
    """

    start: Array
    end: Array
    start_radius: Array
    end_radius: Array
    seam: Array
    center: Array
    ball: Array

    def bounds(self) -> Box:
        """A box round everything (ends of cylinders taken as balls)."""
        points = np.concatenate([self.start, self.end, self.center])
        radii = np.concatenate([self.start_radius, self.end_radius, self.ball])[:, None]
        return (points - radii).min(axis=0), (points + radii).max(axis=0)

    def count_containing(self, points: Array) -> npt.NDArray[np.int64]:
        """(n,) how many pieces each point lies in."""
        count = np.zeros(len(points), np.int64)
        for a, b, ra, rb in zip(self.start, self.end, self.start_radius, self.end_radius, strict=True):
            axis = b - a
            from_a = points - a
            t = from_a @ axis / (axis @ axis)
            across = from_a - t[:, None] * axis
            count += (t >= 0) & (t <= 1) & (np.einsum("ij,ij->i", across, across) <= (ra + (rb - ra) * t) ** 2)
        for c, r in zip(self.center, self.ball, strict=True):
            from_c = points - c
            count += np.einsum("ij,ij->i", from_c, from_c) <= r * r
        return count

    def volume(self, clip: Box | None) -> float:
        """Volume of the union within `clip`, to about 0.1 %.

        Points spread evenly in each piece, each worth its share of the piece divided by the number of pieces it lies
        in: only overlaps and cuts carry an error. Where little is left of the pieces, points spread in the box instead.
        """
        if clip is not None:
            low, high = self._shrunk(np.maximum(self.bounds()[0], clip[0]), np.minimum(self.bounds()[1], clip[1]))
            if float(np.prod(high - low)) < self.sum_of_volumes():
                inside = self.count_containing(spread_in_box(low, high, 86)) > 0
                return float(np.prod(high - low) * inside.mean())
        m = int(np.cbrt(max(1000, 640_000 // (len(self.start) + len(self.center)))))
        random = np.random.default_rng(0)

        def numbers() -> list[Array]:
            """Three numbers in [0, 1), one random triple in each cell of a grid: far less noise than plain random
            ones."""
            return [(i.ravel() + random.random(m**3)) / m for i in np.indices((m, m, m))]

        total = 0.0
        pieces = [_spread_in_cone(*cone, *numbers()) for cone in self.cones()]
        pieces += [_spread_in_ball(c, r, *numbers()) for c, r in zip(self.center, self.ball, strict=True)]
        for points, size in pieces:
            share = 1.0 / np.maximum(self.count_containing(points), 1)
            if clip is not None:
                share[(points < clip[0]).any(axis=1) | (points > clip[1]).any(axis=1)] = 0.0
            total += size * float(share.mean())
        return total

    def _shrunk(self, low: Array, high: Array) -> Box:
        """The part of a box that holds all that the pieces have in it, roughly; all of it where nothing is found."""
        if (high <= low).any():
            return low, low
        points = spread_in_box(low, high, 40)
        points = points[self.count_containing(points) > 0]
        if not len(points):
            return low, high
        step = (high - low) / 20.0
        return np.maximum(low, points.min(axis=0) - step), np.minimum(high, points.max(axis=0) + step)

    def sum_of_volumes(self) -> float:
        """Of all pieces, overlaps as often as they are there."""
        a, b = self.start_radius, self.end_radius
        heights = np.linalg.norm(self.end - self.start, axis=1)
        return float(np.pi / 3.0 * ((heights * (a * a + a * b + b * b)).sum() + 4.0 * (self.ball**3).sum()))

    def cones(self) -> list[tuple[Array, Array, float, float, Array]]:
        """Start, end, the two radii and the seam of each cylinder or cone."""
        columns = (self.start, self.end, self.start_radius, self.end_radius, self.seam)
        return list(zip(*columns, strict=True))


def spread_in_box(low: Array, high: Array, m: int) -> Array:
    """m^3 points, one in each cell of a grid."""
    random = np.random.default_rng(0)
    places = np.stack([(i.ravel() + random.random(m**3)) / m for i in np.indices((m, m, m))], axis=1)
    return low + places * (high - low)


def _spread_in_cone(start, end, start_radius, end_radius, seam, u, v, w) -> tuple[Array, float]:
    """Points that fill a cone or cylinder evenly, and its volume."""
    axis = end - start
    height = float(np.linalg.norm(axis))
    # The volume up to radius r grows as its cube along the cone, evenly along a cylinder.
    slope = end_radius - start_radius
    t = (
        u
        if abs(slope) < 1e-9
        else (np.cbrt(start_radius**3 + u * (end_radius**3 - start_radius**3)) - start_radius) / slope
    )
    across = np.cross(axis / height, seam)
    distance = (start_radius + slope * t) * np.sqrt(v)
    spokes = np.cos(2 * np.pi * w)[:, None] * seam + np.sin(2 * np.pi * w)[:, None] * across
    size = np.pi / 3 * height * (start_radius**2 + start_radius * end_radius + end_radius**2)
    return start + t[:, None] * axis + distance[:, None] * spokes, float(size)


def _spread_in_ball(center, radius, u, v, w) -> tuple[Array, float]:
    """Points that fill a ball evenly, and its volume."""
    z = 2 * v - 1
    ring = np.sqrt(1 - z * z)
    directions = np.stack([ring * np.cos(2 * np.pi * w), ring * np.sin(2 * np.pi * w), z], axis=1)
    return center + radius * np.cbrt(u)[:, None] * directions, float(4 / 3 * np.pi * radius**3)


def seam_directions(axes: Array) -> Array:
    """(m, 3) unit vectors across each axis, the same for an axis and its opposite."""
    axes = axes * np.where(_leading_sign(axes) < 0, -1.0, 1.0)[:, None]
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    across = np.cross(axes, helper)
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def _leading_sign(axes: Array) -> Array:
    """(m,) the sign of the first coordinate that is not nothing."""
    sizeable = np.abs(axes) > 1e-9 * np.abs(axes).max(axis=1, keepdims=True)
    return np.sign(axes[np.arange(len(axes)), sizeable.argmax(axis=1)])


def unite(pieces: Pieces, clip: Box | None, what: str, *, turn: int = 0, ready: Sequence[Any] = ()) -> Any:
    """One shape: the union of the pieces, within `clip`, its volume checked; None where nothing is left.

    With `turn` 0 the poles of balls are upright; 1 puts poles and seams as far from the beams as can be, 2 and 3 likewise,
    each with poles somewhere else. `ready` are fewer solids of the same union, which are tried first.

    Raises:
        BrepError: no tolerance gives a valid shape of the right volume; `what` names it in the message.
    """
    expected = pieces.volume(clip)
    low, high = pieces.bounds()
    if expected <= 1e-9 * float(np.prod(high - low)):
        return None
    # Of a crumb, which the quadrature hardly sees, what would not be missed from the whole.
    allowed = max(_VOLUME_TOLERANCE * expected, _CRUMB * pieces.sum_of_volumes())
    crossing = clip is not None and bool((low < clip[0]).any() or (high > clip[1]).any())
    smallest = min(float(pieces.start_radius.min(initial=np.inf)), float(pieces.ball.min(initial=np.inf)))
    attempts = [(0, 0.0, 0.0), (0, 0.0, 1e-5)] if len(ready) else []
    for way, swell, fuzzy in (*attempts, *_ATTEMPTS):
        shapes: Sequence[Any] = [
            _ball(c, max(swell, 1.0) * r, _away_from(pieces, c, turn + way) if turn + way else _UPRIGHT)
            for c, r in zip(pieces.center, pieces.ball, strict=True)
        ]
        shapes += [_cone(*cone) for cone in pieces.cones()]
        shapes = shapes if swell else ready
        shape = fuse(shapes, fuzzy=fuzzy * smallest)
        if shape is not None and crossing and clip is not None:
            shape = within(shape, clip)
        if shape is not None and is_valid(shape) and abs(volume(shape) - expected) < allowed:
            return shape
    raise BrepError(
        f"{what}: OpenCASCADE makes no correct union of them. Change the radii or the clip box by a few per cent, "
        "or write a faceted STEP file (from a mesh)"
    )


def glue(shapes: Sequence[Any], what: str) -> Any:
    """Join shapes that touch in whole faces and nowhere overlap.

    Raises:
        BrepError: the result is not valid or has not the volume of its parts.
    """
    expected = sum(volume(shape) for shape in shapes)
    for mode in ("full", "shift", ""):
        joined = fuse(shapes, glue=mode)
        if joined is not None and is_valid(joined) and abs(volume(joined) / expected - 1) < 1e-4:
            return joined
    raise BrepError(f"{what}: OpenCASCADE could not join the parts; write a faceted STEP file (from a mesh)")


def fuse(shapes: Sequence[Any], *, glue: str = "", fuzzy: float = 0.0) -> Any:
    """OpenCASCADE's union; None where it fails. `glue` is "", "shift" (parts of faces touch) or "full" (whole
    faces)."""
    from OCP.BOPAlgo import BOPAlgo_GlueEnum
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse

    if len(shapes) == 1:
        return shapes[0]
    operation = BRepAlgoAPI_Fuse()
    operation.SetArguments(_list(shapes[:1]))
    operation.SetTools(_list(shapes[1:]))
    operation.SetRunParallel(True)
    operation.SetNonDestructive(True)
    if glue:
        full = glue == "full"
        operation.SetGlue(BOPAlgo_GlueEnum.BOPAlgo_GlueFull if full else BOPAlgo_GlueEnum.BOPAlgo_GlueShift)
    if fuzzy:
        operation.SetFuzzyValue(fuzzy)
    return _built(operation)


def moved(shape: Any, offset: Iterable[float]) -> Any:
    """A translated shape that shares the geometry of the first."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    translation = gp_Trsf()
    translation.SetTranslation(gp_Vec(*(float(x) for x in offset)))
    return shape.Moved(TopLoc_Location(translation))


def turned(shape: Any, rotation: Array) -> Any:
    """A rotated shape, its geometry anew: readers of STEP place a solid more surely than they turn it."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Trsf

    motion = gp_Trsf()
    motion.SetValues(*(float(x) for row in rotation for x in (*row, 0.0)))
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()


def is_valid(shape: Any) -> bool:
    """OpenCASCADE's own check of geometry and topology."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return bool(BRepCheck_Analyzer(shape).IsValid()) and bool(solids(shape))


def volume(shape: Any) -> float:
    """Volume in mm3, from the exact faces."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def read_back(path: str | os.PathLike[str]) -> tuple[float, bool]:
    """What a reader sees in a STEP file: the volume of all that it holds, mm3, and whether its solids are valid.

    0 and False where it sees nothing.
    """
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(os.fspath(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    return (0.0, False) if shape.IsNull() else (volume(shape), is_valid(shape) and can_be_shown(shape))


def can_be_shown(shape: Any) -> bool:
    """Whether every curved face falls into triangles, where there is doubt: some reach more than once round their ball.

    Readers make such faces of half balls. Of one the area is right and it is "valid", and yet a CAD program shows a hole.
    """
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    doubtful = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face_s(explorer.Current())
        begin, end, _, _ = BRepTools.UVBounds_s(face)
        if not _is_flat(face) and end - begin > 2.0 * np.pi + 1e-4:
            doubtful.append(face)
        explorer.Next()
    if doubtful:
        # Coarse triangles would not tell.
        BRepMesh_IncrementalMesh(shape, 0.004 * float(np.cbrt(abs(volume(shape)))), False, 0.2, True)
    return all(BRep_Tool.Triangulation_s(face, TopLoc_Location()) is not None for face in doubtful)


def _is_flat(face: Any) -> bool:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType

    return BRepAdaptor_Surface(face, False).GetType() == GeomAbs_SurfaceType.GeomAbs_Plane


def solids(shape: Any) -> list[Any]:
    """The solids in a shape."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    found = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def compound(shapes: Sequence[Any]) -> Any:
    """The one solid there is, or all in a compound."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    if len(shapes) == 1:
        return shapes[0]
    result = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def within(shape: Any, clip: Box) -> Any:
    """What of a shape lies in a box; None where OpenCASCADE fails."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    operation = BRepAlgoAPI_Common()
    operation.SetArguments(_list([shape]))
    operation.SetTools(_list([BRepPrimAPI_MakeBox(_point(clip[0]), _point(clip[1])).Solid()]))
    operation.SetRunParallel(True)
    return _built(operation)


def _built(operation: Any) -> Any:
    try:
        operation.Build()
    except Exception:  # OpenCASCADE raises its own classes; to the caller all mean "not this way"
        return None
    return operation.Shape() if operation.IsDone() and not operation.Shape().IsNull() else None


_UPRIGHT = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


_APART = 0.8
"""Cosine of the least angle between the poles of one turn and the next."""


def _away_from(pieces: Pieces, center: Array, turn: int) -> tuple[Array, Array]:
    """The pole of a ball and the side of its seam, as far as can be from the beams that start at its centre.

    `turn` 1 is the best of all, 2 the best of those with a pole elsewhere, and so on.

    The seam is the half circle from pole to pole where the sphere's longitude begins and ends. Where a beam's rim
    crosses it, readers of STEP may take the rest of the sphere for the hole: a ball is lost from the file.
    """
    # Cones begin at the centre, or where they touch the ball.
    axes = pieces.end - pieces.start
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    gap = pieces.start - center
    size = max(float(np.abs(pieces.start).max(initial=1.0)), 1.0)
    own = float(pieces.ball[np.linalg.norm(pieces.center - center, axis=1).argmin()])
    at = (np.linalg.norm(np.cross(gap, axes), axis=1) < 1e-9 * size) & (np.linalg.norm(gap, axis=1) < 0.99 * own)
    beams = (pieces.end - pieces.start)[at]
    if not len(beams):
        return _UPRIGHT
    beams = beams / np.linalg.norm(beams, axis=1, keepdims=True)
    frames = _frames()
    along, side = beams @ frames[:, 0].T, beams @ frames[:, 1].T
    # The cosine of the angle to the half circle: in its plane, on its side; else to the nearer pole.
    nearest = np.where(side > 0.0, np.hypot(along, side), np.abs(along)).max(axis=0)
    nearest = np.round(nearest, 9)
    best = frames[int(np.argmin(nearest))]
    for _ in range(turn - 1):
        nearest = np.where(np.abs(frames[:, 0] @ best[0]) > _APART, np.inf, nearest)
        best = frames[int(np.argmin(nearest))]
    return best[0], best[1]


@cache
def _frames() -> Array:
    """(n, 2, 3) poles and sides, spread evenly: a spiral of directions, and a turn about each."""
    k = np.arange(60) + 0.5
    height, turn = 1.0 - 2.0 * k / len(k), np.pi * (1.0 + np.sqrt(5.0)) * k
    pole = np.stack([np.sqrt(1.0 - height**2) * np.cos(turn), np.sqrt(1.0 - height**2) * np.sin(turn), height], axis=1)
    first = seam_directions(pole)
    second = np.cross(pole, first)
    angle = 2.0 * np.pi * np.arange(24) / 24
    seam = np.cos(angle)[:, None, None] * first + np.sin(angle)[:, None, None] * second
    return np.stack([np.broadcast_to(pole, seam.shape), seam], axis=2).reshape(-1, 2, 3)


def _ball(center: Array, radius: float, frame: tuple[Array, Array]) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.gp import gp_Ax2, gp_Dir

    pole, seam = frame
    return BRepPrimAPI_MakeSphere(
        gp_Ax2(_point(center), gp_Dir(*pole.tolist()), gp_Dir(*seam.tolist())), float(radius)
    ).Solid()


def _cone(start: Array, end: Array, start_radius: float, end_radius: float, seam: Array) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir

    axis = end - start
    height = float(np.linalg.norm(axis))
    frame = gp_Ax2(_point(start), gp_Dir(*axis.tolist()), gp_Dir(*seam.tolist()))
    if abs(start_radius - end_radius) < 1e-6 * max(start_radius, end_radius):
        return BRepPrimAPI_MakeCylinder(frame, float(start_radius), height).Solid()
    return BRepPrimAPI_MakeCone(frame, float(start_radius), float(end_radius), height).Solid()


def _point(coordinates: Array) -> Any:
    from OCP.gp import gp_Pnt

    return gp_Pnt(*(float(x) for x in coordinates))


def _list(shapes: Sequence[Any]) -> Any:
    from OCP.TopTools import TopTools_ListOfShape

    result = TopTools_ListOfShape()
    for shape in shapes:
        result.Append(shape)
    return result
