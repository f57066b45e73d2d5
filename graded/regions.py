"""Several structures, each in its region (LF-rep 3.18: regions between planes; here any Solid)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Solid
from frep.arguments import box_of, real
from frep.errors import warn
from frep.functions import minimum_of

from .transition import assembled, check_profile, common_kind, joined, pairs

_SIDE = 64
"""Places along each axis at which regions are looked at: one in each of so many equal boxes, at random."""
_ROUNDING = 1e-9
"""Of the size of the whole: regions that overlap or part by less touch."""


class RegionWarning(UserWarning):
    """Regions that overlap, or leave gaps between them."""


@dataclass(frozen=True)
class RegionReport:
    """How regions tile a box.

    Attributes:
        overlap: mm3 that two or more regions claim.
        gap: mm3 that none does.
        overlap_place, gap_place: (x, y, z) mm of a place where they do; None where none was found.
        smallest: the smallest volume that is sure to be noticed, mm3, about.
    """

    overlap: float
    gap: float
    overlap_place: tuple[float, float, float] | None
    gap_place: tuple[float, float, float] | None
    smallest: float

    @property
    def tiles(self) -> bool:
        """Whether no overlap and no gap was found."""
        return self.overlap_place is None and self.gap_place is None

    def __str__(self) -> str:
        if self.tiles:
            return "the regions tile the box"
        found = [
            f"{what} of {volume:.3g} mm3, at ({', '.join(f'{c:.4g}' for c in place)})"
            for what, volume, place in (
                ("an overlap", self.overlap, self.overlap_place),
                ("a gap", self.gap, self.gap_place),
            )
            if place is not None
        ]
        return f"the regions have {' and '.join(found)}"


def regions(
    parts: Sequence[tuple[Any, Solid]],
    *,
    over: Any,
    width: float = 0.0,
    profile: str = "smoothstep",
    bridge: str | None = None,
) -> Any:
    """Several structures, each in its region: an intersection of half spaces, or any Solid.

    Args:
        parts: (surface, beam lattice or Solid; its region), two or more, all structures of one kind.
        over: a bounded Solid, or two corners in mm: where regions are checked, where beams are wanted, and where the walls of
            surfaces are true and not only to first order.
        width, profile: as for `transition`, of the zones between regions, measured where their fields are distances. A
            region's zone lies half in it and half in its neighbour.
        bridge: beams: "nearest" joins cut ends to the nearest node of another region, see `assembled` of beams.

    Returns:
        What was given: a surface, a beam lattice, or a Solid. Its `report` tells overlaps and gaps (of beams: what
        `assembled` found).

    What two regions claim belongs to the one of whose border it is farther inside. In a gap there is nothing of Solids and
    beams; a surface has to go on, and goes on as the nearest region has it.

    Raises:
        ArgumentError: fewer than two parts, structures of two kinds, an `over` without end, a negative width, an unknown
            profile.
        ArgumentTypeError: a region that is no Solid.

    Warns:
        RegionWarning: regions overlap, or leave gaps.

    Example:
        >>> import frep
        >>> from topologies import tpms
        >>> left, right = frep.half_space((1, 0, 0), (12, 0, 0)), frep.half_space((-1, 0, 0), (12, 0, 0))
        >>> box = frep.box((0, 0, 0), (24, 8, 8))
        >>> whole = regions([(tpms.gyroid(8), left), (tpms.schwarz_p(8), right)], over=box)
        >>> print(whole.report)
        the regions tile the box
        >>> part = whole.sheet(0.8) & box
    """
    things, places = pairs(parts, "parts", "region")
    names = [f"parts[{i}]" for i in range(len(things))]
    kind = common_kind(things, names)
    for name, place in zip(names, places, strict=True):
        if not isinstance(place, Solid):
            raise ArgumentTypeError(f"{name}: expected a Solid as region, got {type(place).__name__}: {place!r}")
    size = real(width, "width", "mm")
    if size < 0.0:
        raise ArgumentError(f"width: expected 0 mm or more, got {size:g}")
    check_profile(profile)
    box = box_of(over)
    if bridge is not None and kind != "beams":
        raise ArgumentError(f"bridge: only beam lattices are bridged, got {bridge!r}")
    if kind == "beams" and size > 0.0:
        raise ArgumentError("width: beam lattices have no zone between them; leave a gap between the regions")
    report = tiling(places, box)
    if not report.tiles:
        warn(f"parts: {report}", RegionWarning)
    if kind == "beams":
        return assembled(list(zip(things, places, strict=True)), over, bridge)
    whole = things[0]
    for i in range(1, len(things)):
        # Half of the difference is the distance to a plane between two half spaces.
        border = 0.5 * (minimum_of([p.field for p in places[:i]]) - places[i].field)
        whole = joined(kind, whole, things[i], border, size, profile, over)
    if kind == "surface":
        return replace(whole, report=report)
    field = whole.field
    if report.gap_place is not None:
        # A little wider, since where two regions touch both end.
        cover = minimum_of([p.field for p in places]) - 1e-5 * float(np.ptp(box, axis=0).max())
        whole = whole & Solid(cover)
        field = whole.field
    return Solid._make(field, whole.bounds, features=whole.features, label="regions", operands=(whole,), report=report)


def tiling(places: Sequence[Solid], box: np.ndarray) -> RegionReport:
    """How regions tile a box, from a quarter of a million places in it."""
    size = np.ptp(box, axis=0)
    seen = np.stack(np.meshgrid(*[np.arange(_SIDE)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = box[0] + (seen + np.random.default_rng(0).uniform(0.0, 1.0, seen.shape)) * size / _SIDE
    depth = np.sort(np.stack([p.field(points) for p in places]), axis=0)
    touching = _ROUNDING * float(size.max())
    claimed, free = depth[1] < -touching, depth[0] > touching
    each = float(np.prod(size)) / len(points)

    def place(mask: np.ndarray, how_far: np.ndarray) -> tuple[float, float, float] | None:
        if not mask.any():
            return None
        x, y, z = points[np.argmax(np.where(mask, how_far, -np.inf))].tolist()
        return x, y, z

    return RegionReport(
        each * int(claimed.sum()), each * int(free.sum()), place(claimed, -depth[1]), place(free, depth[0]), 3.0 * each
    )
