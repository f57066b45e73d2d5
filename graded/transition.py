"""One structure turning into another: across a plane, across any surface, round points (LF-rep 3.3).

What is joined decides how: periodic surfaces become one surface, whose walls are made after the blend; beam lattices become
one graph, cut where they meet and bridged; Solids become one Solid. Whether the result hangs together is asked in one line,
`connection_report(part)`; a graph says it of itself, in its `report`. Several regions at once: `graded.regions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frep import (
    ArgumentError,
    ArgumentTypeError,
    EmptyError,
    Field,
    FieldLike,
    Solid,
    as_field,
    clip,
    constant,
    coordinates,
    exp,
    maximum,
    minimum,
    square,
    tanh,
    union,
    where,
)
from frep import box as box_solid
from frep.arguments import box_of, direction, one_of, positive, real, vector
from frep.errors import DisconnectedWarning, warn
from frep.evaluate import require_finite

_SIGMOID = 10.0
"""Slope of the sigmoid at its middle, times four, where it goes from 0 to 1 in a length of 1."""
_DEVIATIONS = 3.0
"""Standard deviations from the middle of the Gaussian profile to its ends."""


# --- profiles --------------------------------------------------------------------------------------------------------


def _smoothstep(s: Field) -> Field:
    return clip(square(s) * (3.0 - 2.0 * s), 0.0, 1.0)


def _sigmoid(s: Field) -> Field:
    return _ended(s, 0.5 + 0.5 * tanh(0.5 * _SIGMOID * (s - 0.5)) / math.tanh(0.25 * _SIGMOID))


def _gaussian(s: Field) -> Field:
    x = (2.0 * s - 1.0) * (_DEVIATIONS / math.sqrt(2.0))
    return _ended(s, 0.5 + 0.5 * _erf(x) / math.erf(_DEVIATIONS / math.sqrt(2.0)))


def _erf(x: Field) -> Field:
    """The error function to 2e-7 (Abramowitz and Stegun 7.1.26)."""
    t = 1.0 / (1.0 + 0.3275911 * abs(x))
    series: Field = constant(0.0)
    for a in (1.061405429, -1.453152027, 1.421413741, -0.284496736, 0.254829592):
        series = (series + a) * t
    tail = series * exp(-square(x))
    return where(x < 0.0, tail - 1.0, 1.0 - tail)


def _ended(s: Field, share: Field) -> Field:
    """0 and 1 to the last digit at the ends, which rounding would miss."""
    return where(s <= 0.0, 0.0, where(s >= 1.0, 1.0, clip(share, 0.0, 1.0)))


PROFILES: dict[str, Callable[[Field], Field]] = {
    "smoothstep": _smoothstep,
    "linear": lambda s: s,
    "sigmoid": _sigmoid,
    "gaussian": _gaussian,
}
"""How a share rises from 0 to 1 while its argument does."""


def share_across(border: Field, width: float, profile: str) -> Field:
    """0 where `border` is below -width / 2 mm, 1 above width / 2, rising between; with no width, a switch at 0."""
    if width == 0.0:
        return where(border < 0.0, 0.0, 1.0)
    return PROFILES[profile](clip(border * (1.0 / width) + 0.5, 0.0, 1.0))


# --- two structures ----------------------------------------------------------------------------------------------------


def transition(
    first: Any,
    second: Any,
    *,
    plane: tuple[Any, Any] | None = None,
    field: FieldLike | None = None,
    width: float = 0.0,
    profile: str = "smoothstep",
    over: Any = None,
    bridge: str | None = None,
    how: str = "morph",
    blend: FieldLike = 0.0,
) -> Any:
    """One structure turning into another.

    Args:
        first, second: two periodic surfaces, two beam lattices, or two Solids (a beam lattice and a surface with their bodies
            on: `beams.bcc(10).thicken(1)`, `tpms.gyroid(10).sheet(1)`).
        plane: (point, normal) of the middle of the zone; the normal points from the first to the second (LF-rep 3.16).
        field: in place of a plane, a Field in mm: zero in the middle of the zone, negative on the first's side.
        width: of the zone, mm; 0 for a hard switch. Beyond the zone everything is the first or the second, to the last digit.
        profile: how the share of the second rises: "smoothstep", "linear", "sigmoid" (logistic, ten zone widths steep) or
            "gaussian" (the integral of a Gaussian whose deviation is a sixth of the width); the last two are stretched a little,
            to be 0 and 1 at the ends of the zone.
        over: a bounded Solid, or two corners in mm. Surfaces: the box in which walls are true within the zone, and not only to
            first order. Beams: where they are wanted; they need it. Solids: where they are looked at, for whether they hang
            together.
        bridge: beams: "nearest" joins cut ends to the nearest node of the other side, see `assembled` of beams. They have no
            zone; a width is left free between them, to be bridged.
        how: Solids: "morph" weighs the two fields; "overlap" keeps both through the zone, and fillets them by `blend`.
        blend: radius in mm of the fillets of an overlap, a number or a Field.

    Returns:
        What was given: a surface (give it a body: `.sheet(0.8)`), a beam lattice, a Solid with the bounds of both. The `report`
        of beams says how they meet, see `assembled`; that of Solids is a `ConnectionReport` of the part in `over`, if there is
        one, and two million samples tell.

    Surfaces join: the gyroid and Schwarz P across a quarter of a cell, a half or a whole one are one sheet with two labyrinths
    (lf-rep 6.4). Its wall, asked for as a tenth of the cell and measured along normals within the zone, is short by more than
    5 % in a fortieth of all places across a quarter of the cell (by 11 % at most), in a 300th across a half; within 1 % of what
    was asked for in nine tenths across a half, in 97 % across a whole one. What is short lies at the ends of the zone, where
    the surface bends: from there on walls are those of the first and the second, to the last digit.

    Solids need not. FCC beams (1.2 mm, cells of 8 mm) into a sheet of Schwarz P (0.8 mm) fall apart into two halves as a morph
    across a quarter of a cell to two cells; BCC beams into a gyroid sheet stay one piece, with crumbs of 0.03 % across two
    cells. As an overlap both are one piece, and as a hard switch at a face of the cells. With `over` there is a warning where
    the two come apart and both of them together would not.

    Raises:
        ArgumentError: neither plane nor field, or both; a negative width; an unknown profile; no `over` for beams, or one
            without end; structures of two kinds; a blend without an overlap.
        ArgumentTypeError: what has neither beams, nor a surface, nor a field.
        FunctionError: a field that is not a number somewhere in `over`.

    Warns:
        DisconnectedWarning: two Solids that fall apart in `over`, and would not as an overlap.

    Example:
        >>> import frep
        >>> from topologies import tpms
        >>> box = frep.box((0, 0, 0), (24, 8, 8))
        >>> both = transition(tpms.gyroid(8), tpms.schwarz_p(8), plane=((12, 0, 0), "x"), width=4, over=box)
        >>> part = both.sheet(0.8) & box  # the gyroid up to x = 10, Schwarz P from 14 on, walls of 0.8 mm all along
        >>> part.contains([[4, 4, 4], [22, 2, 2]])
        array([ True,  True])

        Solids, round whose border one becomes the other:

        >>> left, right = frep.sphere((0, 0, 0), 3), frep.box((-9, -2, -2), (9, 2, 2))
        >>> part = transition(left, right, plane=((0, 0, 0), "x"), width=2)
        >>> part.contains([[-2.9, 0, 0], [-2.9, 1.9, 0], [2.9, 1.9, 0]])
        array([ True, False,  True])
    """
    kind = common_kind((first, second), ("first", "second"))
    border = _border(plane, field)
    size = real(width, "width", "mm")
    if size < 0.0:
        raise ArgumentError(f"width: expected 0 mm or more, got {size:g}")
    check_profile(profile)
    if how not in ("morph", "overlap"):
        raise ArgumentError(f'how: expected "morph" or "overlap", got {how!r}')
    if how == "overlap" and size == 0.0:
        raise ArgumentError("width: an overlap needs more than 0 mm, got 0")
    if kind != "solid" and how != "morph":
        raise ArgumentError(f"how: {how!r} is for Solids; give each its body first (.thicken, .sheet)")
    if bridge is not None and kind != "beams":
        raise ArgumentError(f"bridge: only beam lattices are bridged, got {bridge!r} for {kind_name(kind)}")
    fillet = as_field(blend, "blend")
    if how == "morph" and not (fillet.is_constant and fillet.data == 0.0):
        raise ArgumentError(f'blend: fillets are for how="overlap" of Solids, got {blend!r}')
    if over is not None:
        _check_border(border, box_of(over))
    if kind == "beams":
        if size > 0.0 and bridge is None:
            raise ArgumentError(
                f'width: {size:g} mm without beams between two beam lattices need bridge="nearest"; or give each its body first'
            )
        half = 0.5 * size
        parts = [(first, Solid(border + half)), (second, Solid(half - border))]
        return assembled(parts, over, bridge)
    half = 0.5 * size
    if how == "overlap":
        solid = union(first & Solid(border - half), second & Solid(-border - half), blend=fillet)
    else:
        solid = joined(kind, first, second, border, size, profile, over)
    if kind == "surface" or over is None:
        return solid
    # What could have been: both through the zone; of a hard switch, both all over.
    both = (first & Solid(border - half)) | (second & Solid(-border - half)) if size else first | second
    report = _looked_at(solid, both if how == "morph" else None, box_of(over))
    operands = (first, second)
    return Solid._make(
        solid.field, solid.bounds, features=solid.features, label="transition", operands=operands, report=report
    )


def _looked_at(solid: Solid, both: Solid | None, box: np.ndarray) -> ConnectionReport | None:
    """Whether a transition of Solids hangs together in a box; warns where it does not, and both of them in one place would."""
    window = box_solid(*box)
    try:
        fine = _coarse(solid & window)
        voxel = max(fine, _voxel_of(box, _LOOKED_AT))
        if voxel > 2.0 * fine:
            return None  # too large a box: what is thin would be torn by the samples
        report = connection_report(solid & window, voxel)
    except EmptyError:
        return None
    if both is not None and report.main_share < 1.0 - _PARTED:
        joined_up = connection_report(both & window, report.voxel).main_share
        if joined_up > report.main_share + _PARTED:
            warn(
                f"how: the two fall into {len(report.pieces)} pieces, the largest {report.main_share:.0%} of the volume; "
                f'how="overlap", which keeps both through the zone, can have {joined_up:.0%} in one',
                DisconnectedWarning,
            )
    return report


_LOOKED_AT = 2 * 10**6
"""Samples that tell whether Solids hang together."""
_PARTED = 0.05
"""Of the volume: pieces of less are crumbs."""


def joined(kind: str, first: Any, second: Any, border: Field, width: float, profile: str, over: Any) -> Any:
    """Two surfaces or two Solids in one, of which the second lies where `border` is positive."""
    share = share_across(border, width, profile)
    switch = border if width == 0.0 else None
    if kind == "surface":
        return first.blended(second, share, over=over, border=switch)
    return _morphed(first, second, share, switch)


def _morphed(first: Solid, second: Solid, share: Field, border: Field | None) -> Solid:
    if border is None:
        field = (1.0 - share) * first.field + share * second.field
    else:
        # What lies in both is in none of the halves where they meet.
        halves = minimum(maximum(first.field, border), maximum(second.field, -border))
        field = minimum(halves, maximum(first.field, second.field))
    pair = (first, second)
    bounds = np.array([np.minimum(*(s.bounds[0] for s in pair)), np.maximum(*(s.bounds[1] for s in pair))])
    features = tuple(dict.fromkeys((*first.features, *second.features)))
    return Solid._make(field, bounds, features=features, label="transition", operands=pair)


def assembled(parts: Sequence[tuple[Any, Solid]], over: Any, bridge: str | None) -> Any:
    """Beam lattices, each in its region, as one graph."""
    if over is None:
        raise ArgumentError(
            "over: beam lattices become one graph, which must end: give the Solid that they are wanted in"
        )
    return parts[0][0].assembled(list(parts), over=over, bridge=bridge)


def _border(plane: Any, field: FieldLike | None) -> Field:
    if (plane is None) == (field is None):
        raise ArgumentError(
            "plane, field: give one of them: where the first structure ends and the second begins, as (point, normal) or as a "
            f"Field; got {'neither' if plane is None else 'both'}"
        )
    if field is not None:
        border = as_field(field, "field")
        if border.is_constant:
            raise ArgumentError(f"field: expected a Field that is negative on the first's side, got {border.data:g} mm")
        return border
    if isinstance(plane, (str, Field)) or not hasattr(plane, "__len__") or len(plane) != 2:
        raise ArgumentTypeError(
            f"plane: expected (point, normal), such as ((0, 0, 20), 'z'), got {plane!r}; several planes go to graded.regions"
        )
    point, normal = vector(plane[0], "plane"), direction(plane[1], "plane")
    terms = [float(n) * (c - float(p)) for n, c, p in zip(normal, coordinates(), point, strict=True)]
    return terms[0] + terms[1] + terms[2]


def _check_border(border: Field, box: np.ndarray) -> None:
    """Raise FunctionError where a border is no number: a share made of it would hide that."""
    axes = [np.linspace(lo, hi, 12) for lo, hi in box.T]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    require_finite(border(points), points, "field: the border between the two")


# --- several, round points -------------------------------------------------------------------------------------------


def mixture(parts: Sequence[tuple[Any, Any]], *, sharpness: float, over: Any = None) -> Any:
    """Several surfaces or Solids, each round its own point, by Gaussian weights exp(-sharpness r^2) that are divided by their
    sum (Yang, Quan, Zhang and Tian 2014, radial basis functions).

    Args:
        parts: (surface or Solid, centre (x, y, z) mm), two or more.
        sharpness: 1 / mm2. Halfway between centres L apart, the share changes from one to the other within 4 / (sharpness L).
        over: surfaces: the box in which walls are true, as for `transition`. Weights are never quite 0, so that all of it
            is computed, once for each part after the first.

    Raises:
        ArgumentError: fewer than two parts, of two kinds, or at one place; a sharpness that is not positive.

    Example:
        >>> import frep
        >>> from topologies import tpms
        >>> both = mixture([(tpms.gyroid(8), (0, 0, 0)), (tpms.schwarz_p(8), (24, 0, 0))], sharpness=0.02)
        >>> part = both.sheet(0.8) & frep.box((0, 0, 0), (24, 8, 8))  # the gyroid round (0, 0, 0), P round (24, 0, 0)
    """
    things, places = pairs(parts, "parts", "centre")
    kind = common_kind(things, [f"parts[{i}]" for i in range(len(things))])
    if kind == "beams":
        raise ArgumentError("parts: beam lattices are not mixed; give each its body first (.thicken)")
    k = positive(sharpness, "sharpness", " in 1/mm2")
    centres = [vector(place, f"centre of parts[{i}]") for i, place in enumerate(places)]
    if len({tuple(c) for c in centres}) < len(centres):
        raise ArgumentError(f"parts: two parts have the same centre, got {centres!r}")
    if over is not None:
        box_of(over)
    x = coordinates()
    whole: Any = things[0]
    for i in range(1, len(things)):
        # Share of part i among those up to it. Squared radii differ by a function of first degree, which loses no digits.
        total: Field = constant(1.0)
        for centre in centres[:i]:
            nearer = sum((2.0 * float(a - b) * c for a, b, c in zip(centre, centres[i], x, strict=True)), constant(0.0))
            total = total + exp(clip(k * (nearer + float(centres[i] @ centres[i] - centre @ centre)), -60.0, 60.0))
        share = 1.0 / total
        whole = (
            whole.blended(things[i], share, over=over) if kind == "surface" else _morphed(whole, things[i], share, None)
        )
    return whole


# --- what is given -----------------------------------------------------------------------------------------------------


def pairs(parts: Any, name: str, second: str) -> tuple[list[Any], list[Any]]:
    """The two columns of a list of pairs, at least two of them."""
    expected = f"expected a list of two or more (structure, {second})"
    if isinstance(parts, (str, Field)) or not hasattr(parts, "__len__"):
        raise ArgumentTypeError(f"{name}: {expected}, got {parts!r}")
    if len(parts) < 2:
        raise ArgumentError(f"{name}: {expected}, got {len(parts)}")
    for i, part in enumerate(parts):
        if not isinstance(part, (tuple, list)) or len(part) != 2:
            raise ArgumentTypeError(f"{name}[{i}]: expected (structure, {second}), got {part!r}")
    return [part[0] for part in parts], [part[1] for part in parts]


def common_kind(things: Sequence[Any], names: Sequence[str]) -> str:
    """ "solid", "beams" or "surface": what all of the structures are.

    Raises:
        ArgumentTypeError: one is none of these.
        ArgumentError: they are of two kinds.
    """
    kinds = [_kind(thing, name) for thing, name in zip(things, names, strict=True)]
    for kind, name in zip(kinds, names, strict=True):
        if kind != kinds[0]:
            raise ArgumentError(
                f"{names[0]}, {name}: expected structures of one kind, got {kind_name(kinds[0])} and {kind_name(kind)}; give "
                "each its body first: beams.thicken(diameter), surface.sheet(thickness)"
            )
    return kinds[0]


def _kind(thing: Any, name: str) -> str:
    if isinstance(thing, Solid):
        return "solid"
    if hasattr(thing, "skeleton"):
        if not hasattr(thing, "assembled"):
            raise ArgumentError(
                f"{name}: {thing!r} cannot be cut into regions; give it its body first, .thicken(diameter)"
            )
        return "beams"
    if hasattr(thing, "blended"):
        return "surface"
    raise ArgumentTypeError(
        f"{name}: expected a beam lattice, a periodic surface or a Solid, got {type(thing).__name__}: {thing!r}"
    )


def kind_name(kind: str) -> str:
    """For messages."""
    return {"solid": "Solids", "beams": "beam lattices", "surface": "surfaces"}[kind]


def check_profile(profile: Any) -> None:
    """Raise ArgumentError for an unknown profile."""
    one_of(profile, "profile", PROFILES)


# --- does it hang together ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Piece:
    """A part of a solid that hangs together.

    Attributes:
        volume: mm3, of the samples in it.
        place: (x, y, z) mm, a place well inside of it.
    """

    volume: float
    place: tuple[float, float, float]


@dataclass(frozen=True)
class ConnectionReport:
    """Whether a solid hangs together.

    Attributes:
        pieces: the largest first.
        voxel: distance of the samples, mm: gaps and necks thinner than it may have been missed.
    """

    pieces: tuple[Piece, ...]
    voxel: float

    @property
    def is_connected(self) -> bool:
        """Whether there is one piece."""
        return len(self.pieces) == 1

    @property
    def main_share(self) -> float:
        """How much of the volume the largest piece has."""
        return self.pieces[0].volume / sum(piece.volume for piece in self.pieces)

    def __str__(self) -> str:
        if self.is_connected:
            return f"one piece, {self.pieces[0].volume:.4g} mm3 (at voxels of {self.voxel:.3g} mm)"
        listed = [
            f"{p.volume:.4g} mm3 at ({', '.join(f'{c:.4g}' for c in p.place)})" for p in self.pieces[: self._LISTED]
        ]
        more = len(self.pieces) - self._LISTED
        rest = f" and {more} more" if more > 0 else ""
        return f"{len(self.pieces)} pieces: {', '.join(listed)}{rest} (at voxels of {self.voxel:.3g} mm)"

    _LISTED = 5


_MOST_SAMPLES = 4 * 10**7


def connection_report(solid: Solid, voxel: float | None = None) -> ConnectionReport:
    """Into how many pieces a solid falls, from samples of its field; two of them hang together where they share a side.

    `connection_report(~part & box)` tells the same of the voids.

    Args:
        solid: a bounded one.
        voxel: distance of the samples, mm; unless given, half of the thinnest width, a 200th of the longest side at most,
            and 40 million samples at most.

    Raises:
        UnboundedError: the solid is infinite.
        EmptyError: it has no material.

    Example:
        >>> import frep
        >>> print(connection_report(frep.box((0, 0, 0), (8, 4, 4)), voxel=0.5))
        one piece, 128 mm3 (at voxels of 0.5 mm)
        >>> report = connection_report(frep.sphere((0, 0, 0), 2) | frep.sphere((5, 0, 0), 1))
        >>> report.is_connected, len(report.pieces), round(report.main_share, 2)
        (False, 2, 0.89)
    """
    from scipy.ndimage import find_objects, label

    if not isinstance(solid, Solid):
        raise ArgumentTypeError(f"solid: expected a Solid, got {type(solid).__name__}; give it its body first")
    from frep.sizing import sample_solid

    grid = sample_solid(solid, _coarse(solid) if voxel is None else voxel, None, quiet=True)
    values = grid.dense()
    marks, count = label(values < 0.0)  # type: ignore[misc]
    volumes = np.bincount(marks.ravel(), minlength=count + 1)[1:] * grid.voxel**3
    found = find_objects(marks)
    pieces = []
    for number in np.argsort(-volumes, kind="stable"):
        window = found[number]
        own = np.where(marks[window] == number + 1, values[window], np.inf)
        deepest = np.unravel_index(int(np.argmin(own)), own.shape)
        at = grid.origin + grid.voxel * np.array([s.start + k for s, k in zip(window, deepest, strict=True)])
        x, y, z = (float(c) for c in np.round(at, 9) + 0.0)
        pieces.append(Piece(float(volumes[number]), (x, y, z)))
    return ConnectionReport(tuple(pieces), float(grid.voxel))


def _coarse(solid: Solid) -> float:
    from frep.solid import require_bounded

    require_bounded(solid)
    size = np.ptp(solid.bounds, axis=0)
    widths = [float(f.width.bounds(*solid.bounds)[0]) for f in solid.features]
    thinnest = min((w for w in widths if w > 0.0), default=math.inf)
    return max(min(0.5 * thinnest, float(size.max()) / 200.0), _voxel_of(solid.bounds, _MOST_SAMPLES))


def _voxel_of(box: np.ndarray, samples: int) -> float:
    """The distance of so many samples in a box, mm."""
    return float(np.prod(np.ptp(box, axis=0)) / samples) ** (1 / 3)
