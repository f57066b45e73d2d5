"""Solids: signed fields with bounds, and everything that makes one solid from others.

A solid is where its field is negative. Primitives and transforms keep fields exact distances; booleans keep the sign and a
lower bound of the distance. Nothing is sampled until a mesh, a volume or a file is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .arguments import direction, positive, turn, width
from .arguments import vector as vector_of
from .errors import ArgumentError, ArgumentTypeError, EmptyError, UnboundedError
from .field import Field, FieldLike, _points, as_field, constant, coordinates
from .functions import maximum, maximum_of, minimum_of, sqrt, square, where

if TYPE_CHECKING:
    from .grid import SparseGrid
    from .mesh import Mesh
    from .skeleton import Skeleton

_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


@dataclass(frozen=True, eq=False)
class Feature:
    """A width that the solid was asked to have: `what` ("wall", "beam"), its full width in mm as a Field, and the argument that
    asked for it."""

    what: str
    width: Field
    argument: str


@dataclass(frozen=True, eq=False)
class BeamDesign:
    """What a beam lattice was made of, for exporters that keep beams as beams.

    Attributes:
        skeleton: nodes and beams, before they were moved.
        diameter, node_diameter: Fields in mm, read where the part is.
        end_radii, ball_radii: one number a node, mm, before it was moved.
        section, blended: as they were asked for.
        clip: (2, 3) corners of the box that cuts it, in the axes `turn`.
        matrix, shift: p -> matrix p + shift moves the skeleton to where the part is, a similarity.
        turn: (3, 3) rotation: a point p of the part is turn^T p in the axes of the box.
    """

    skeleton: Skeleton
    diameter: Field | None
    end_radii: np.ndarray | None
    node_diameter: Field | None
    section: str
    blended: bool
    clip: np.ndarray | None = None
    ball_radii: np.ndarray | None = None
    matrix: np.ndarray = dataclass_field(default_factory=lambda: np.eye(3))
    shift: np.ndarray = dataclass_field(default_factory=lambda: np.zeros(3))
    turn: np.ndarray = dataclass_field(default_factory=lambda: np.eye(3))

    def placed(self, matrix: np.ndarray, shift: np.ndarray) -> BeamDesign:
        """The skeleton under a similarity p -> matrix p + shift, before any box; diameters stay where they are."""
        return replace(self, matrix=matrix @ self.matrix, shift=matrix @ self.shift + shift)

    def moved(
        self, matrix: np.ndarray, shift: np.ndarray, scale: float, field_there: Callable[[Field], Field]
    ) -> BeamDesign:
        """The whole of it under a similarity of ratio `scale`, its Fields as `field_there` moves them."""
        there = self.placed(matrix, shift)
        clip, axes = self.clip, self.turn
        if clip is not None:
            # Where the image of the box is upright no rotation is left over.
            whole = matrix @ self.turn / scale
            upright = bool(np.all(np.count_nonzero(np.abs(whole) > 1e-12, axis=0) == 1))
            axes = np.eye(3) if upright else whole * (np.array([-1.0, 1.0, 1.0]) if np.linalg.det(whole) < 0.0 else 1.0)
            rest = axes.T @ (matrix @ self.turn)
            rest[np.abs(rest) < 1e-12 * scale] = 0.0
            clip = _image_of_box(clip, rest, axes.T @ shift)
        widths = [None if f is None else scale * field_there(f) for f in (self.diameter, self.node_diameter)]
        return replace(there, diameter=widths[0], node_diameter=widths[1], clip=clip, turn=axes)


@dataclass(frozen=True, eq=False)
class _Provenance:
    features: tuple[Feature, ...] = ()
    label: str = "solid"
    operands: tuple[Solid, ...] = ()
    is_box: bool = False
    beams: BeamDesign | None = None
    report: Any = None


class Solid:
    """A part, or an infinite pattern: where `field` is negative.

    Args:
        field: a Field, or a function of `(x, y, z)`; negative inside, in mm where it is a distance.
        bounds: (2, 3) lower and upper corner in mm. Material beyond them is cut off, with exact flat caps. Without bounds
            the solid is infinite, and must be intersected with a bounded one before it can be sampled.

    Raises:
        ArgumentError: bounds of another shape, NaN, or lower not below upper.

    Example:
        >>> x, y, z = coordinates()
        >>> ball = Solid(sqrt(x**2 + y**2 + z**2) - 5, bounds=((-5, -5, -5), (5, 5, 5)))
        >>> ball.contains([[0, 0, 0], [4, 4, 4]])
        array([ True, False])
    """

    __slots__ = ("_provenance", "bounds", "field")

    field: Field
    bounds: np.ndarray

    def __init__(self, field: FieldLike, bounds=None) -> None:
        from .primitives import box_distance

        f = as_field(field, "field")
        if bounds is None:
            limits = _EVERYWHERE
        else:
            try:
                limits = np.array(bounds, dtype=float)
            except (TypeError, ValueError):
                raise ArgumentError(f"bounds: expected ((x0, y0, z0), (x1, y1, z1)) in mm, got {bounds!r}") from None
            if limits.shape != (2, 3) or not np.all(limits[0] < limits[1]):
                raise ArgumentError(f"bounds: expected ((x0, y0, z0), (x1, y1, z1)) with lower < upper, got {bounds!r}")
            if np.any(np.isfinite(limits)):
                f = maximum(f, box_distance(*limits))
        self._set(f, limits, _Provenance())

    def _set(self, field: Field, bounds: np.ndarray, provenance: _Provenance) -> None:
        limits = np.array(bounds, dtype=float)
        limits.setflags(write=False)
        object.__setattr__(self, "field", field)
        object.__setattr__(self, "bounds", limits)
        object.__setattr__(self, "_provenance", provenance)

    @classmethod
    def _make(cls, field: Field, bounds: np.ndarray, **provenance: Any) -> Solid:
        """A solid whose field is known to be positive outside `bounds`."""
        solid = object.__new__(cls)
        solid._set(field, bounds, _Provenance(**provenance))
        return solid

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError("a Solid is immutable; operations return new ones")

    def __reduce__(self):
        return _restore, (self.field, self.bounds, self._provenance)

    def __repr__(self) -> str:
        lo, hi = (np.array2string(b, precision=6) for b in self.bounds)
        return f"<Solid {self._provenance.label}, bounds {lo} to {hi} mm>"

    @property
    def features(self) -> tuple[Feature, ...]:
        """The widths that were asked for: walls and beams, which the sampler holds against the voxel size."""
        return self._provenance.features

    @property
    def beams(self) -> BeamDesign | None:
        """The beam lattice that this solid is, if it is one (clipped by a box at most)."""
        return self._provenance.beams

    @property
    def report(self) -> Any:
        """What was found in the file the solid was loaded from, if it was."""
        return self._provenance.report

    @property
    def is_bounded(self) -> bool:
        """Whether the bounds are finite."""
        return bool(np.all(np.isfinite(self.bounds)))

    # --- booleans ------------------------------------------------------------------------------------------------------

    def __and__(self, other: Solid) -> Solid:
        return intersection(self, other)

    def __or__(self, other: Solid) -> Solid:
        return union(self, other)

    def __sub__(self, other: Solid) -> Solid:
        return difference(self, other)

    def __invert__(self) -> Solid:
        return Solid._make(-self.field, _EVERYWHERE, features=self.features, label="complement", operands=(self,))

    # --- offsets ---------------------------------------------------------------------------------------------------------

    def offset(self, distance: FieldLike) -> Solid:
        """Grow (or with a negative distance shrink) by `distance` mm, a number or a Field.

        Exact where the field is an exact distance; elsewhere the surface moves by at least that much.
        """
        d = as_field(distance, "distance")
        bounds = grown(self.bounds, d, 1.0, "distance")
        return Solid._make(self.field - d, bounds, features=self.features, label="offset", operands=(self,))

    def shell(self, thickness: FieldLike, *, side: Literal["inner", "outer", "both"] = "inner") -> Solid:
        """The skin of the solid: a wall of `thickness` mm inside, outside or to both sides of its surface.

        Raises:
            ArgumentError: thickness not positive, or an unknown side.
        """
        t = width(thickness, "thickness")
        if side not in ("inner", "outer", "both"):
            raise ArgumentError(f'side: expected "inner", "outer" or "both", got {side!r}')
        out = {"inner": 0.0, "outer": 1.0, "both": 0.5}[side]
        outer = self.offset(out * t) if out else self
        field = maximum(outer.field, -(self.field + (1.0 - out) * t))
        features = (*self.features, Feature("wall", t, "thickness"))
        return Solid._make(field, outer.bounds, features=features, label="shell", operands=(self,))

    # --- transforms ------------------------------------------------------------------------------------------------------

    def translate(self, vector) -> Solid:
        """Move by `vector` (x, y, z) mm."""
        return self._moved(np.eye(3), vector_of(vector, "vector"), 1.0, "translate")

    def rotate(self, axis, angle: float, center=(0.0, 0.0, 0.0)) -> Solid:
        """Turn by `angle` rad round `axis` ("x", "y", "z" or a vector) through `center`, right-handed."""
        u = direction(axis, "axis")
        by = turn(angle, "angle")
        k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        matrix = np.eye(3) + math.sin(by) * k + (1.0 - math.cos(by)) * k @ k
        matrix[np.abs(matrix) < 1e-15] = 0.0
        c = vector_of(center, "center")
        return self._moved(matrix, c - matrix @ c, 1.0, "rotate")

    def mirror(self, normal, point=(0.0, 0.0, 0.0)) -> Solid:
        """Reflect in the plane through `point` with `normal` ("x", "y", "z" or a vector)."""
        n = direction(normal, "normal")
        matrix = np.eye(3) - 2.0 * np.outer(n, n)
        p = vector_of(point, "point")
        return self._moved(matrix, p - matrix @ p, 1.0, "mirror")

    def scale(self, factor: float, center=(0.0, 0.0, 0.0)) -> Solid:
        """Magnify by `factor` > 0 about `center`; widths grow with it."""
        s, c = positive(factor, "factor", ""), vector_of(center, "center")
        return self._moved(s * np.eye(3), c - s * c, s, "scale")

    def _moved(self, matrix: np.ndarray, shift: np.ndarray, scale: float, label: str) -> Solid:
        """The image under p -> matrix p + shift, a similarity of ratio `scale`."""
        inverse = np.linalg.inv(matrix)
        inverse[np.abs(inverse) < 1e-15] = 0.0
        offset = -inverse @ shift
        source = [sum((inverse[i, j] * c for j, c in enumerate(coordinates())), start=offset[i]) for i in range(3)]

        def moved(field: Field) -> Field:
            return field.substitute(*source)

        features = tuple(Feature(f.what, scale * moved(f.width), f.argument) for f in self.features)
        field = scale * moved(self.field)
        bounds = _image_of_box(self.bounds, matrix, shift)
        turned = np.count_nonzero(np.round(matrix, 15)) > 3
        is_box = self._provenance.is_box and not turned
        beams = None if self.beams is None else self.beams.moved(matrix, shift, scale, moved)
        return Solid._make(field, bounds, features=features, label=label, operands=(self,), is_box=is_box, beams=beams)

    # --- numbers -----------------------------------------------------------------------------------------------------------

    def contains(self, points) -> np.ndarray:
        """Which of (n, 3) points lie inside: (n,) bool; for one point (3,) a bool. The surface counts as outside."""
        pts, single = _points(points)
        inside = self.field(pts) < 0.0
        return inside[0] if single else inside

    def first_hit(self, origins, directions, max_distance: float = math.inf, *, slope: float = 1.0) -> np.ndarray:
        """Distance along each of n rays to where it first meets the solid: (n,) mm, inf for a miss.

        Args:
            origins, directions: (n, 3), or one (3,) for all rays; directions of any length but 0.
            max_distance: how far to look, mm along the ray.
            slope: how fast the field changes at most, mm a mm; 1 for distances (see `frep/rays.py`).

        Raises:
            ArgumentError: shapes, numbers that are not finite, a direction of length 0.
            UnboundedError: an infinite solid and no `max_distance`.
        """
        from .rays import first_hit

        return first_hit(self, origins, directions, max_distance, slope=slope)

    def sample(self, voxel: float | None = None, *, tolerance: float | None = None) -> SparseGrid:
        """Samples of the field in a narrow band round the surface, exact within two voxels of it.

        Args:
            voxel: distance of the samples, mm.
            tolerance: instead of `voxel`, the distance that flat facets may keep from a smooth surface, mm (not at sharp
                edges, which no voxel resolves). With neither, a thousandth of the longest side.

        Raises:
            UnboundedError: the solid is infinite.
            EmptyError: no material; names the part that is empty.
            TooLargeError: the samples would not fit in memory; names the estimate and a voxel that fits.
            ArgumentError: voxel or tolerance not positive, or a width that is not positive somewhere.
            FunctionError: a user function raised, or a value is NaN.

        Warns:
            ThinWallWarning: a wall or beam is thinner than two voxels.
        """
        from .sizing import sample_solid

        return sample_solid(self, voxel, tolerance, exact=2.0)

    def mesh(self, voxel: float | None = None, *, polish: bool = False, tolerance: float | None = None) -> Mesh:
        """A closed, oriented, 2-manifold triangle mesh.

        Args:
            voxel, tolerance: as for `sample`.
            polish: move the vertices onto the surface with Newton steps and fit the facets to it (see `frep/polish.py`);
                volumes and curved walls come out several times more accurate at the same voxel size.

        Raises and warns as `sample`.

        Example:
            >>> from frep import sphere
            >>> mesh = sphere((0, 0, 0), 5).mesh(voxel=0.5)
            >>> mesh.check().closed
            True
        """
        from .meshing.mesher import mesh_solid

        return mesh_solid(self, voxel, tolerance, polish)

    def volume(self, voxel: float | None = None) -> float:
        """Volume in mm3, from the field and not from a mesh: each sample counts by how much of its voxel is inside.

        `voxel` as for `sample`; the field is sampled at half of it, and more finely where the part is small, so that three
        voxels a beam's diameter give the volume of a cell of a lattice to 0.1 %, and of many to about 0.2 %. Raises as `sample`.
        """
        from .measure import volume

        return volume(self, voxel)

    def save(
        self, path: str | Path, voxel: float | None = None, *, polish: bool = False, max_faces: int | None = None
    ) -> None:
        """Write to a file, by suffix: `.step` and `.stp`, `.vdb`, or any mesh format (`.stl`, `.ply`, `.obj`).

        A lattice of some hundreds of round beams, clipped by a box at most, whose diameters are constant or taper evenly,
        becomes an analytic STEP solid, moved afterwards or not; anything else a faceted one of at most `max_faces` triangles
        (20,000 unless given), thinned out from a finer mesh where no voxel is given. The file appears complete or not at all.

        Raises:
            FileError: unknown suffix, no such folder, no space.
            FrepError: as `mesh` and `sample`; a STEP file that would be too large.

        Warns:
            FacetsWarning: a STEP file of a lattice has facets, and why; or facets so coarse that the volume is 1 % off
                (`frep.io.save.FacetsWarning`).
        """
        from .io.save import save_solid

        save_solid(self, path, voxel, polish=polish, max_faces=max_faces)


def _restore(field: Field, bounds: np.ndarray, provenance: _Provenance) -> Solid:
    solid = object.__new__(Solid)
    solid._set(field, bounds, provenance)
    return solid


def _image_of_box(bounds: np.ndarray, matrix: np.ndarray, shift: np.ndarray) -> np.ndarray:
    lo, hi = shift.copy(), shift.copy()
    for i in range(3):
        for j in range(3):
            if matrix[i, j] != 0.0:
                ends = sorted((matrix[i, j] * bounds[0, j], matrix[i, j] * bounds[1, j]))
                lo[i] += ends[0]
                hi[i] += ends[1]
    return np.array([lo, hi])


def _solids(solids: Iterable[Any], name: str) -> list[Solid]:
    found = list(solids)
    if not found:
        raise ArgumentError(f"{name}: expected at least one solid, got none")
    for s in found:
        if not isinstance(s, Solid):
            raise ArgumentTypeError(f"{name}: expected Solids, got {type(s).__name__}: {s!r}")
    return found


def grown(bounds: np.ndarray, law: Field, share: float, name: str) -> np.ndarray:
    """Bounds that hold everything within `share` times the law's value of what the given ones hold.

    The law counts where the material reaches, so the bounds grow until they hold; a law that grows as fast as it spreads
    has no end.

    Raises:
        ArgumentError: the law has no upper limit there.
    """
    outward = np.array([[-1.0], [1.0]])
    if share == 0.0 or not np.any(np.isfinite(bounds)):
        return bounds
    if law.is_constant:
        return bounds + max(share * law.data, 0.0) * outward
    reach = 0.0
    for _ in range(_MOST_ROUNDS):
        trial = bounds + reach * outward
        found = max(share * law.bounds(*trial)[1], 0.0)
        if found <= reach * (1.0 + 1e-9):
            return trial
        if not math.isfinite(found):
            break
        # A little more than found, so that a law of small slope settles in a few rounds.
        reach = found + 0.5 * (found - reach) if reach else found
    raise ArgumentError(
        f"{name}: {law!r} grows without limit beyond the solid, which then has no end; limit it with clip"
    )


_MOST_ROUNDS = 60


def _features(solids: Iterable[Solid]) -> tuple[Feature, ...]:
    return tuple(dict.fromkeys(f for s in solids for f in s.features))


def round_minimum(fields: list[Field], radius: Field) -> Field:
    """The n-ary round union of distances: circular fillets of `radius` where two surfaces meet at a right angle.

    With k the radius: max(k, min d) - sqrt(sum max(k - d, 0)^2). Symmetric in its arguments, exact where only one is within
    k of the point, and never larger than the minimum.
    """
    within = [square(maximum(radius - d, 0.0)) for d in fields]
    total = within[0]
    for term in within[1:]:
        total = total + term
    nearest = minimum_of(fields)
    return where(nearest < radius, radius - sqrt(total), nearest)


def _combine(solids: list[Solid], radius: Field, sign: float) -> Field:
    """Union (sign 1) or intersection (sign -1) of fields, with fillets of `radius`."""
    fields = [s.field for s in solids]
    radius = radius if radius.is_constant else maximum(radius, 0.0)
    if radius.is_constant:
        if radius.data < 0.0:
            raise ArgumentError(f"blend: expected a radius >= 0 mm, got {radius.data:g}")
        if radius.data == 0.0 or len(fields) == 1:
            return minimum_of(fields) if sign > 0 else maximum_of(fields)
    if sign < 0:
        return -round_minimum([-f for f in fields], radius)
    return round_minimum(fields, radius)


def union(*solids: Solid, blend: FieldLike = 0.0) -> Solid:
    """All that is in any of the solids; `blend` mm (a number or a Field) fillets where they meet.

    A Field below zero counts as zero.

    Example:
        >>> from frep import sphere
        >>> two = union(sphere((0, 0, 0), 2), sphere((3, 0, 0), 2), blend=0.5)
        >>> bool(two.contains((1.5, 1.4, 0)))
        True
    """
    parts = _solids(solids, "union")
    radius = as_field(blend, "blend")
    field = _combine(parts, radius, 1.0)
    bounds = np.array([np.min([s.bounds[0] for s in parts], axis=0), np.max([s.bounds[1] for s in parts], axis=0)])
    # Where n surfaces run side by side, their round union lies k (1 - 1 / sqrt n) outside them.
    bounds = grown(bounds, radius, 1.0 - 1.0 / math.sqrt(len(parts)), "blend")
    return Solid._make(field, bounds, features=_features(parts), label="union", operands=tuple(parts))


def intersection(*solids: Solid, blend: FieldLike = 0.0) -> Solid:
    """What is in all of the solids; `blend` mm (a number or a Field) rounds the edges where they meet."""
    parts = _solids(solids, "intersection")
    radius = as_field(blend, "blend")
    field = _combine(parts, radius, -1.0)
    bounds = np.array([np.max([s.bounds[0] for s in parts], axis=0), np.min([s.bounds[1] for s in parts], axis=0)])
    beams = None
    lattices = [s.beams for s in parts if s.beams is not None]
    if (
        len(lattices) == 1
        and all(s.beams is not None or s._provenance.is_box for s in parts)
        and radius is constant(0.0)
    ):
        beams = _clipped_beams(lattices[0], parts, bounds)
    is_box = radius is constant(0.0) and all(s._provenance.is_box for s in parts)
    return Solid._make(
        field,
        bounds,
        features=_features(parts),
        label="intersection",
        operands=tuple(parts),
        beams=beams,
        is_box=is_box,
    )


def _clipped_beams(design: BeamDesign, parts: list[Solid], bounds: np.ndarray) -> BeamDesign | None:
    """A lattice within upright boxes, whose common bounds are given; None where it has a box in other axes already.

    A box that holds all of the lattice cuts nothing off.
    """
    if design.clip is None or np.array_equal(design.turn, np.eye(3)):
        return replace(design, clip=bounds)
    lattice = next(s for s in parts if s.beams is not None)
    return design if np.array_equal(bounds, lattice.bounds) else None


def difference(first: Solid, *others: Solid, blend: FieldLike = 0.0) -> Solid:
    """What is in the first solid and in none of the others; `blend` mm rounds the new edges."""
    parts = _solids((first, *others), "difference")
    field = _combine([parts[0], *(~s for s in parts[1:])], as_field(blend, "blend"), -1.0)
    return Solid._make(field, parts[0].bounds, features=_features(parts), label="difference", operands=tuple(parts))


def require_bounded(solid: Solid) -> None:
    """Raise UnboundedError for an infinite solid, EmptyError for one whose parts do not overlap."""
    lo, hi = solid.bounds
    if np.any(lo >= hi):
        raise EmptyError(f"{_name(solid)} is empty: the bounds of its parts do not overlap")
    if not solid.is_bounded:
        free = ", ".join("xyz"[a] for a in range(3) if not (np.isfinite(lo[a]) and np.isfinite(hi[a])))
        raise UnboundedError(
            f"{_name(solid)} is infinite along {free}: intersect it with a bounded solid first, "
            "for example `part & frep.box((0, 0, 0), (50, 50, 50))`"
        )


def _name(solid: Solid) -> str:
    operands = solid._provenance.operands
    if operands:
        return f"the {solid._provenance.label} of " + " and ".join(s._provenance.label for s in operands)
    return f"the {solid._provenance.label}"


def explain_empty(solid: Solid, empty_in: Callable[[Solid], bool]) -> str:
    """Which part is empty, for the message of an EmptyError; `empty_in` tells whether a part has nothing in the bounds."""
    operands = solid._provenance.operands
    empty = [s._provenance.label for s in operands if empty_in(s)]
    if empty:
        return f"{_name(solid)} is empty: its part {' and '.join(repr(e) for e in empty)} has no material there"
    if len(operands) > 1:
        return (
            f"{_name(solid)} is empty: each part has material, but they do not overlap, or one removes all of the other"
        )
    return f"{_name(solid)} is empty"
