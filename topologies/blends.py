"""Two periodic surfaces in one: the first where a share is 0, the second where it is 1 (`PeriodicSurface.blended`).

The zero set between is that of the weighed levels; thickness is measured from it, after the blend (lf-rep 6.4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, as_field, clip, maximum, minimum, square, where
from frep.redistance import distance_over

from .variants import PER_CELL, REACH, PeriodicSurface, fixed_box, in_box

_FADE = 0.01
"""Share of the other surface up to which a blend passes from the distance of its parent to that of the blend: walls there are
between both, so that much more of it thins them; much less leaves a step on them."""
_FINER, _BUDGET = 2.0, 1_000_000
"""Across a narrow gap surfaces bend more sharply than their parents: nodes up to so much closer, as long as they are no more."""
_LOOKS = 17
"""Places along each side of the box at which walls that vary are held against what the parents have room for."""
_ALONE = 0.05
"""Share of the other up to which a parent's channels are what its own would be."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Blend(PeriodicSurface):
    """One surface turning into another, see `PeriodicSurface.blended`.

    Attributes:
        parents: the two.
        share: how much of the second, from 0 to 1.
        border: where the share switches, if it does, and the caller knows.
    """

    parents: tuple[PeriodicSurface, PeriodicSurface]
    share: Field
    border: Field | None = None

    @property
    def repeats(self) -> bool:
        """A share that is the same all over mixes cells of two sizes, in general; any other, cells that differ."""
        return False

    @cached_property
    def steepness(self) -> float:
        """Both levels have been divided by theirs."""
        return 1.0

    @cached_property
    def distance(self) -> Field:
        """Signed distance to the surface in mm: that of the first where the share is 0, of the second where it is 1, within
        4e-4 of the cell near the surface between, inside of `over`.

        Raises:
            ArgumentError: no `over`.
        """
        if self.over is None:
            raise ArgumentError(
                "over: a blend of two surfaces has no distance known beforehand; give the box where it is needed"
            )
        step = min(self.cell) / PER_CELL
        gap = _gap(self.share, self.over, step)
        first, second = (parent.distance for parent in self.parents)
        if gap is None:
            return where(self.share < 0.5, first, second)
        room = float(np.prod(gap[1] - gap[0]))
        step = max(step / _FINER, min(step, (room / _BUDGET) ** (1 / 3)))
        asked = where(minimum(self.share, 1.0 - self.share) > 0.0, REACH * max(max(p.cell) for p in self.parents), 0.0)
        between = in_box(self.over, distance_over(self.level, gap, asked, step), self.first_order)
        return self._faded(first, between, second)

    @cached_property
    def value(self) -> Field:
        """The waveform in mm: the parents' own where the share is 0 or 1, between them as `scale` says."""
        if self.scale == "distance":
            return self.distance
        first, second = (parent.value for parent in self.parents)
        if self.scale == "range":
            return (1.0 - self.share) * first + self.share * second
        return self._faded(first, self.first_order, second)

    def _faded(self, first: Field, between: Field, second: Field) -> Field:
        """A surface is not the offset of its parent just behind the place where it leaves it: the step is spread over the
        first and the last shares, where both are nearly the same."""
        rise = clip(minimum(self.share, 1.0 - self.share) * (1.0 / _FADE), 0.0, 1.0)
        faded = clip(square(rise) * (3.0 - 2.0 * rise), 0.0, 1.0)
        return (1.0 - faded) * where(self.share < 0.5, first, second) + faded * between

    def _body(self, body: Callable[[Field], Field]) -> Field:
        if self.border is None:
            return body(self.value)
        first, second = (parent._body(body) for parent in self.parents)
        # What lies in both bodies is in none of the halves where they meet.
        halves = minimum(maximum(first, self.border), maximum(second, -self.border))
        return minimum(halves, maximum(first, second))

    def _check_wall(self, t: Field, b: Field, *, sheet: bool, at: np.ndarray | None = None) -> None:
        if at is None:
            super()._check_wall(t, b, sheet=sheet)
        for parent, places in self._used(t, b, at):
            parent._check_wall(t, b, sheet=sheet, at=places)

    def _check_side(self, b: Field, *, keeps: int, at: np.ndarray | None = None) -> None:
        for parent, places in self._used(b, b, at):
            parent._check_side(b, keeps=keeps, at=places)

    def _used(self, one: Field, other: Field, at: np.ndarray | None) -> list[tuple[PeriodicSurface, np.ndarray | None]]:
        """Each parent, and places in `over` where it stands nearly alone: None for numbers, which are the same all over. Of laws
        that vary, without a box, nothing is known."""
        if one.is_constant and other.is_constant and at is None:
            return [(parent, None) for parent in self.parents]
        if at is None and self.over is None:
            return []
        if at is None:
            axes = [np.linspace(lo, hi, _LOOKS) for lo, hi in zip(*self.over, strict=True)]  # type: ignore[misc]
            at = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        share = self.share(at)
        alone = [(self.parents[0], at[share < _ALONE]), (self.parents[1], at[share > 1.0 - _ALONE])]
        return [(parent, places) for parent, places in alone if len(places)]


def blend(
    first: PeriodicSurface, second: PeriodicSurface, share: FieldLike, over: Any, border: Field | None
) -> PeriodicSurface:
    """`first.blended(second, share, over, border=border)`, which see."""
    if not isinstance(second, PeriodicSurface):
        raise ArgumentTypeError(f"other: expected a periodic surface, got {type(second).__name__}: {second!r}")
    weight = as_field(share, "share")
    if weight.is_constant and not 0.0 <= weight.data <= 1.0:
        raise ArgumentError(f"share: expected a number in [0, 1], or a Field, got {weight.data:g}")
    weight = clip(weight, 0.0, 1.0)
    box, scale, pair = None, "range" if first.scale == second.scale == "range" else "gradient", (first, second)
    if over is not None:
        box, scale = fixed_box(over), "distance"
        pair = (_measured(first, box), _measured(second, box))
    a, b = (parent.level / parent.steepness for parent in (first, second))
    x, y, z = (min(sizes) for sizes in zip(first.cell, second.cell, strict=True))
    return Blend(
        (1.0 - weight) * a + weight * b,
        (x, y, z),
        f"{first.label} to {second.label}",
        first.members,
        first.period,
        first.place,
        scale=scale,
        steady=False,
        over=box,
        parents=pair,
        share=weight,
        border=border,
    )


def _measured(surface: PeriodicSurface, box: tuple[tuple[float, ...], tuple[float, ...]]) -> PeriodicSurface:
    """The surface with true distances in a box."""
    if isinstance(surface, Blend):
        first, second = surface.parents
        return replace(surface, scale="distance", over=box, parents=(_measured(first, box), _measured(second, box)))
    return replace(surface, scale="distance", over=box)


def _gap(share: Field, box: tuple[tuple[float, ...], tuple[float, ...]], step: float) -> np.ndarray | None:
    """(2, 3) the part of a box that holds all nodes whose share lies between 0 and 1; None where there are none."""
    lo, hi = (np.array(corner) for corner in box)
    # A box too large is reported by what is to be made for it.
    step = max(step, float(np.prod((hi - lo) / 500.0)) ** (1 / 3))
    axes = [np.linspace(a, b, int(np.ceil((b - a) / step)) + 1) for a, b in zip(lo, hi, strict=True)]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for x in axes[0]:
        nodes = np.stack(np.meshgrid([x], axes[1], axes[2], indexing="ij"), -1).reshape(-1, 3)
        values = share(nodes)
        nodes = nodes[(values > 0.0) & (values < 1.0)]
        if len(nodes):
            low, high = np.minimum(low, nodes.min(axis=0)), np.maximum(high, nodes.max(axis=0))
    return np.array([low - step, high + step]) if np.all(low <= high) else None
