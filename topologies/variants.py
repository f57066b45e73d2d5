"""A periodic surface and its four variants: what lies on one side, on the other, near it, and away from it.

After LatticeRobot: a waveform W is scaled to mm, moved by a *bias* and cut four ways (negative inside):

| variant | field |
|---|---|
| `solid` | `W - bias` |
| `inverse` | `-(W - bias)` |
| `sheet` (Thin) | `abs(W - bias) - thickness / 2` |
| `twin` | `thickness / 2 - abs(W - bias)` |

A surface that changes in space (a varying drop, phase or member; two surfaces `blended`) has no distance of its own; one is
made for a box, its `over`. Surfaces fill all space: intersect with a bounded solid before meshing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from frep import (
    ArgumentError,
    Field,
    FieldLike,
    FunctionError,
    Solid,
    as_field,
    constant,
    maximum,
    sqrt,
    square,
    where,
)
from frep.arguments import box_of, width
from frep.errors import warn
from frep.primitives import box_distance
from frep.redistance import NODES, distance_over, periodic_distance
from frep.solid import Feature

SCALES = ("distance", "gradient", "range")
"""What a waveform becomes in mm: the true distance; W / |grad W|, its first order; W with its largest value at a quarter of
the cell, as a triangle wave of unit slope has it (LatticeRobot)."""

PER_CELL = 32
"""Nodes along the smallest cell where the distance is made for a box: within 4e-4 of the cell near the surface."""
REACH = 0.3
"""Of the largest cell: how far from the surface that distance is true; half of the thickest wall that makes sense."""
_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])
_LEAST_SLOPE = 1e-3
"""Of 1 / (cell / 2 pi): a waveform flatter than this counts as that steep in `scale="gradient"`, which else divides by zero."""


class SealedChannelWarning(UserWarning):
    """A wall so thick that it seals the channels between the sheets: powder or resin stays inside."""


class LoosePiecesWarning(UserWarning):
    """A solid of separate pieces that nothing holds together."""


class Depths(NamedTuple):
    """How far from the surface things end, on its negative and on its positive side, in mm.

    `pinch`: beyond it the channel of that side falls into closed pockets; 0 where it is closed to begin with.
    `full`: beyond it nothing of that side is left.
    """

    pinch: tuple[float, float]
    full: tuple[float, float]


@dataclass(frozen=True, eq=False)
class PeriodicSurface:
    """A periodic surface: the zero set of `level`, a Field without unit.

    Attributes:
        level: the waveform where it was put, negative on the side that `solid` keeps.
        cell: three sizes of the cell, mm.
        label: the surface's name.
        scale: one of `SCALES`, what `value` is.
        complement_congruent: `-level` is `level` moved, so that `inverse` is `solid` moved, and a negative bias says nothing new.
        members: level functions in the axes of the cell, of which `blend` chooses: one, unless a Field shapes the surface.
        period: of the members, mm.
        place: the coordinates in the axes of the cell as Fields of position.
        knots: the values of `blend` that the members belong to.
        blend: the Field that varies the surface, if one does.
        steady: whether the distance can be had from the members.
        over: lower and upper corner, mm, of the box for which a distance may be made that the members do not tell.
        aperiodic: the third axis has no period: the members are folded there, and `period` is that of the fold.
        report: what was found when it was put together (`graded.regions`), if it was.
        shares: pinch and full depth of a cubic cell, of the cell; None to find them when they are needed.
    """

    level: Field
    cell: tuple[float, float, float]
    label: str
    members: tuple[Field, ...]
    period: tuple[float, float, float]
    place: tuple[Field, Field, Field]
    scale: str = "distance"
    complement_congruent: bool = False
    knots: tuple[float, ...] = ()
    blend: Field | None = None
    steady: bool = True
    shares: Depths | None = None
    over: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    aperiodic: bool = False
    report: Any = None

    def __repr__(self) -> str:
        return f"<{self.label}, cell {' x '.join(f'{c:g}' for c in self.cell)} mm>"

    # --- fields --------------------------------------------------------------------------------------------------------

    @cached_property
    def distance(self) -> Field:
        """Signed distance to the surface in mm: a smooth spline through exact distances. Near the surface it is within 1e-4
        of the cell (5e-4 for C(S), whose features are finest); where two parts of the surface are equally far, a crease is
        rounded.

        With `over`, where a drop, a phase or a Field that blends members varies: distances to the surface as it is in that
        box, within 4e-4 of the cell near the surface; to first order beyond the box. Without, where a Field blends members,
        distances between those of neighbouring members; under a varying phase, the distance to the surface before it is
        moved.

        Raises:
            ArgumentError: a drop that varies and no `over`, so that there is no distance known beforehand.
        """
        if self.over is not None and not (self.steady and self.blend is None and self.axes is not None):
            near = distance_over(self.level, self.over, REACH * max(self.cell), min(self.cell) / PER_CELL)
            return in_box(self.over, near, self.first_order)
        if not self.steady:
            raise ArgumentError(
                "scale: a drop that varies has no distance known beforehand; give the box where it is needed, `over=`, or "
                'use scale="gradient" or "range"'
            )
        tables = [periodic_distance(member, self.period, self._nodes) for member in self.members]
        if self.blend is None:
            return tables[0].substitute(*self.place)
        # Hat functions: each member counts up to its neighbours, linearly.
        step = self.knots[1] - self.knots[0]
        total: Field = constant(0.0)
        for knot, table in zip(self.knots, tables, strict=True):
            share = maximum(1.0 - abs(self.blend - knot) / step, 0.0)
            total = total + share * table.substitute(*self.place)
        return total

    @property
    def _nodes(self) -> tuple[int, int, int]:
        """Spline nodes of a period: a stretched axis takes up to twice as many as the shortest, no more, for what is
        stretched bends less. A fold has four lengths of its own."""
        fold = 4 if self.aperiodic else 1
        lengths = (self.period[0], self.period[1], self.period[2] / fold)
        a, b, c = (2 * round(NODES / 2 * min(length / min(lengths), 2.0)) for length in lengths)
        return a, b, c * fold

    @cached_property
    def value(self) -> Field:
        """The waveform in mm as `scale` says: what bias and thickness are measured in."""
        if self.scale == "distance":
            return self.distance
        if self.scale == "range":
            least, most = self.range
            return self.level * (0.25 * min(self.cell) / max(-least, most))
        return self.first_order

    @property
    def first_order(self) -> Field:
        """W / |grad W| in mm."""
        floor = _LEAST_SLOPE * 2.0 * np.pi / min(self.cell)
        dx, dy, dz = self.level.derivatives()
        return self.level / sqrt(square(dx) + square(dy) + square(dz) + floor**2)

    @cached_property
    def steepness(self) -> float:
        """The mean length of the level's gradient on the surface, 1/mm (of all that a Field blends)."""
        return float(np.mean([_steepness(member, self.period) for member in self.members]))

    @cached_property
    def range(self) -> tuple[float, float]:
        """The least and largest value of the waveform (of all that a Field blends)."""
        ends = [_extremes(member, self.period) for member in self.members]
        return min(e[0] for e in ends), max(e[1] for e in ends)

    @cached_property
    def depths(self) -> Depths | None:
        """How far from the surface its channels pinch shut and end, in mm; None where a Field shapes the surface.

        From a table for cubic cells, else to about a hundredth of the cell, from samples of one period.
        """
        if not self.steady or self.blend is not None:
            return None
        if self.shares is not None and self.scale == "distance" and len(set(self.cell)) == 1:
            pinch, full = ((s[0] * self.cell[0], s[1] * self.cell[0]) for s in self.shares)
            return Depths(pinch, full)
        if self.scale == "distance":
            return _depths(periodic_distance(self.members[0], self.period, self._nodes), self.period)
        bare = PeriodicSurface(
            self.members[0], self.cell, self.label, self.members, self.period, self.place, self.scale
        )
        return _depths(bare.value, self.period)

    @property
    def repeats(self) -> bool:
        """Whether all cells are alike: no Field shapes or stretches it, and each axis has its period."""
        return self.steady and self.blend is None and not self.aperiodic and self.axes is not None

    @cached_property
    def axes(self) -> np.ndarray | None:
        """(3, 3) the directions of the sides of the cell, as columns; None where it is not only moved and turned."""
        slopes = [c.derivatives() for c in self.place]
        if not all(slope.is_constant for row in slopes for slope in row):
            return None
        turn = np.array([[float(slope.data) for slope in row] for row in slopes])
        return turn.T if np.allclose(turn @ turn.T, np.eye(3), atol=1e-9) else None

    @property
    def pinch(self) -> float:
        """The thinnest sheet that seals a channel, of the smallest side of the cell."""
        depths = self.depths
        return np.inf if depths is None else 2.0 * min(depths.pinch) / min(self.cell)

    @property
    def full(self) -> float:
        """The thinnest sheet that fills the cell, of the smallest side of the cell."""
        depths = self.depths
        return np.inf if depths is None else 2.0 * max(depths.full) / min(self.cell)

    # --- two in one ----------------------------------------------------------------------------------------------------

    def blended(
        self, other: PeriodicSurface, share: FieldLike, over: Any = None, *, border: Field | None = None
    ) -> PeriodicSurface:
        """This surface turning into another: where (1 - share) F1 + share F2 is zero, with F1 and F2 the two levels, each by
        its mean slope on its own surface, so that near it both count in mm (lf-rep 6.4).

        Where the share is 0 or 1 the result is this surface or the other, to the last digit, and its bias and thickness are
        measured as theirs. Between, thickness is measured from the surface that the blend makes.

        Args:
            other: another surface, of any cell, phase and rotation.
            share: how much of the other, from 0 to 1 (and limited to it): a number, a Field or a function of position. See
                `graded.transition` for one that changes across a plane.
            over: a bounded Solid, or two corners in mm: thickness is then true in that box, from distances that are made
                once, where the share lies between 0 and 1, in about a second a million nodes (32 along a cell, up to 64 across a
                narrow gap). Beyond the box, or without one, it is right to first order between the two surfaces, W / |grad W|;
                or W as "range" has it, where that is the scale of both and there is no box.
            border: for a share that switches: a Field in mm, zero where it does and negative on this surface's side. Bodies
                then end in exact faces there, where the other one has none.

        A share that rises within less than a 32nd of the cell counts as a switch, at 1/2. Which side of the other surface
        goes with which of this one is told by their signs; half a period of `phase` swaps those of Schwarz P.

        Raises:
            ArgumentError: a share that is a number outside [0, 1].

        Example:
            >>> import frep
            >>> from topologies import tpms
            >>> x, y, z = frep.coordinates()
            >>> both = tpms.gyroid(cell=8).blended(tpms.schwarz_p(cell=8), frep.clip((x - 20) / 8, 0, 1))
            >>> both
            <gyroid to schwarz_p, cell 8 x 8 x 8 mm>
            >>> both.sheet(0.8).contains([[0, 0, 0], [40, 4, 4]]) == [True, False]
            array([ True,  True])
        """
        from .blends import blend

        return blend(self, other, share, over, border)

    # --- variants ------------------------------------------------------------------------------------------------------

    def sheet(self, thickness: FieldLike, *, bias: FieldLike = 0.0) -> Solid:
        """The Thin variant: a wall that reaches half of `thickness` mm to both sides, measured along the surface's normal.

        Args:
            thickness: full wall in mm: a number, a Field or a function of position. Where a Field asks for more than the
                cell has room for, the cell is full; where for 0 mm or less, empty. Warned of as far as the Field's bounds
                tell, all over or in `over`.
            bias: mm by which the middle of the wall is moved to the positive side, alike.

        Raises:
            ArgumentError: a thickness that is not positive, or so large that the wall fills the cell; a bias beyond the cell.

        Warns:
            SealedChannelWarning: a wall, somewhere, that seals the channels of a side.

        Example:
            >>> import frep
            >>> from topologies import tpms
            >>> part = tpms.gyroid(cell=5).sheet(0.8) & frep.box((0, 0, 0), (10, 10, 10))
            >>> round(part.volume(voxel=0.2) / 1000, 2)
            0.48
        """
        t, b = width(thickness, "thickness"), as_field(bias, "bias")
        self._check_wall(t, b, sheet=True)
        return self._solid(lambda value: abs(value - b) - 0.5 * t, "sheet", Feature("wall", t, "thickness"))

    def solid(self, bias: FieldLike = 0.0) -> Solid:
        """The Solid variant: the side where the waveform is below `bias` mm; a larger bias, more material.

        Raises:
            ArgumentError: a bias so far out that everything or nothing is left.

        Warns:
            SealedChannelWarning: the other side is closed pockets.
            LoosePiecesWarning: this side is.

        Example:
            >>> from topologies import tpms
            >>> tpms.schwarz_p(cell=10).solid(bias=0.5).contains([[5, 5, 5], [0, 0, 0]])
            array([ True, False])
        """
        b = as_field(bias, "bias")
        self._check_side(b, keeps=0)
        return self._solid(lambda value: value - b, "solid")

    def inverse(self, bias: FieldLike = 0.0) -> Solid:
        """The Inverse variant: all that `solid(bias)` leaves out. Raises and warns as it."""
        b = as_field(bias, "bias")
        self._check_side(b, keeps=1)
        return self._solid(lambda value: b - value, "inverse")

    def twin(self, thickness: FieldLike, bias: FieldLike = 0.0) -> Solid:
        """The Twin variant: all that `sheet(thickness, bias=bias)` leaves out, a region on each side of it.

        Raises:
            ArgumentError: a thickness that is not positive, or so large that nothing is left; a bias beyond the cell.

        Warns:
            LoosePiecesWarning: a gap, somewhere, that parts one of the two regions into pieces.
        """
        t, b = width(thickness, "thickness"), as_field(bias, "bias")
        self._check_wall(t, b, sheet=False)
        return self._solid(lambda value: 0.5 * t - abs(value - b), "twin")

    def _solid(self, body: Callable[[Field], Field], what: str, *features: Feature) -> Solid:
        field, label = self._body(body), f"{self.label} {what}"
        return Solid._make(field, _EVERYWHERE, features=features, label=label, report=self.report)

    def _body(self, body: Callable[[Field], Field]) -> Field:
        return body(self.value)

    # --- limits --------------------------------------------------------------------------------------------------------

    def _check_wall(self, t: Field, b: Field, *, sheet: bool, at: np.ndarray | None = None) -> None:
        """`at`, (n, 3): where the surface is used, if it is not all over; then what is wrong there is only warned of."""
        (thin, thick), (low, high) = self._ends(t, at), self._ends(b, at)
        if at is None and thick <= 0.0:
            raise ArgumentError(f"thickness: expected more than 0 mm somewhere, got a Field of at most {thick:g} mm")
        depths = self.depths
        if depths is None:
            return
        if at is None and 0.5 * thin - high >= depths.full[0] and 0.5 * thin + low >= depths.full[1]:
            raise ArgumentError(
                f"thickness: a {'wall' if sheet else 'gap'} of {thin:g} mm {'fills' if sheet else 'takes all of'} the cell of "
                f"{self!r}; expected less than {2.0 * max(depths.full):.3g} mm"
            )
        if at is None and sheet and (low - 0.5 * thick >= depths.full[1] or high + 0.5 * thick <= -depths.full[0]):
            raise ArgumentError(f"bias: {low:g} mm leaves nothing of {self!r}; expected {_between(depths)}")
        if _reaches(0.5 * thick - low, 0.5 * thin - high, depths.pinch[0]) or _reaches(
            0.5 * thick + high, 0.5 * thin + low, depths.pinch[1]
        ):
            wall = thick if np.isfinite(thick) else thin
            limit = (
                f"channels stay open below {2.0 * min(depths.pinch):.3g} mm"
                if min(depths.pinch) > 0.0
                else "one of its sides is closed pockets from the start"
            )
            if sheet:
                warn(f"thickness: a wall of {wall:g} mm seals the channels of {self!r}; {limit}", SealedChannelWarning)
            else:
                warn(f"thickness: a gap of {wall:g} mm leaves loose pieces of {self!r}; {limit}", LoosePiecesWarning)

    def _check_side(self, b: Field, *, keeps: int, at: np.ndarray | None = None) -> None:
        depths = self.depths
        if depths is None:
            return
        low, high = self._ends(b, at)
        if at is None and (low >= depths.full[1] or high <= -depths.full[0]):
            rest = "all" if (low > 0.0) == (keeps == 0) else "nothing"
            raise ArgumentError(f"bias: {low:g} mm leaves {rest} of {self!r}; expected {_between(depths)}")
        # Which sides fall into pockets: the positive one where the bias takes too much of it, and the reverse.
        closed = _reaches(-low, -high, depths.pinch[0]), _reaches(high, low, depths.pinch[1])
        if closed[keeps]:
            warn(f"bias: what is left of {self!r} is loose pieces", LoosePiecesWarning)
        if closed[1 - keeps]:
            warn(f"bias: the channels of {self!r} are sealed", SealedChannelWarning)

    def _ends(self, law: Field, at: np.ndarray | None) -> tuple[float, float]:
        """The least and largest value of a law at places; without any, what its bounds tell, in `over` if there is one."""
        if law.is_constant:
            return law.data, law.data
        if at is not None:
            try:
                values = law(at)
            except FunctionError:
                # What a function does not know is told where the part is sampled.
                return -np.inf, np.inf
            values = values[np.isfinite(values)]
            return (float(values.min()), float(values.max())) if len(values) else (-np.inf, np.inf)
        low, high = (float(end) for end in law.bounds(*(_EVERYWHERE if self.over is None else np.array(self.over))))
        return (low if low == low else -np.inf), (high if high == high else np.inf)


def fixed_box(over: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The corners of `over`, a bounded Solid or two in mm, checked; as tuples, which can be keys."""
    lo, hi = box_of(over)
    return tuple(lo.tolist()), tuple(hi.tolist())


def in_box(box: tuple[tuple[float, ...], tuple[float, ...]], near: Field, beyond: Field) -> Field:
    """What has been computed for a box there, and what is known everywhere beyond it."""
    return where(box_distance(np.array(box[0]), np.array(box[1])) <= 0.0, near, beyond)


def _between(depths: Depths) -> str:
    return f"a bias between {-depths.full[0]:.3g} and {depths.full[1]:.3g} mm"


def _reaches(most: float, least: float, limit: float) -> bool:
    """Whether a law reaches the limit somewhere; one without a known upper end counts by its lower one."""
    return (most if np.isfinite(most) else least) >= limit


# --- numbers of one period -----------------------------------------------------------------------------------------------


@lru_cache(maxsize=64)
def _extremes(member: Field, period: tuple[float, float, float]) -> tuple[float, float]:
    """The least and largest value over a period: the best nodes of a grid, each then refined on smaller grids round it."""
    size = np.array(period)
    n = 48
    axes = [np.arange(n) * p / n for p in size]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3, indexing="ij"), -1).reshape(-1, 3)
    found = []
    for sign in (-1.0, 1.0):
        best = nodes[np.argmax(sign * member(nodes))]
        step = size / n
        for _ in range(6):
            trial = best + offsets * step
            best = trial[np.argmax(sign * member(trial))]
            step = step / 4.0
        found.append(float(member(best)))
    return found[0], found[1]


@lru_cache(maxsize=64)
def _steepness(member: Field, period: tuple[float, float, float]) -> float:
    """The mean length of the gradient on the zero set, at points that Newton steps bring there from a grid."""
    size = np.array(period)
    points = np.stack(np.meshgrid(*[np.arange(24) * p / 24 for p in size], indexing="ij"), -1).reshape(-1, 3)
    for _ in range(4):
        values, gradient = member(points), member.gradient(points)
        squared = np.maximum((gradient**2).sum(axis=1), 1e-12)
        near = np.abs(values) < np.sqrt(squared) * size.min() / 24
        points = (points - (values / squared)[:, None] * gradient)[near]
    if not len(points):
        raise ArgumentError("surface: the field has no zero set, so there is nothing to blend")
    return float(np.linalg.norm(member.gradient(points), axis=1).mean())


@lru_cache(maxsize=64)
def _depths(value: Field, period: tuple[float, float, float]) -> Depths:
    """Pinch and full depth of both sides, from samples of one period."""
    size = np.array(period)
    counts = [int(2 * round(NODES / 2 * p / size.min())) for p in size]
    axes = [np.arange(n) * p / n for n, p in zip(counts, size, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    # W / |grad W| has no limit where W stands still; no wall is thicker than the period.
    far = 0.5 * float(size.max())
    samples = np.clip(value(nodes.reshape(-1, 3)).reshape(counts), -far, far)
    # A centre may lie between the nodes: what is sure to fill the cell is half a diagonal more.
    slack = 0.5 * float(np.linalg.norm(size / counts))
    full = [float((side * samples).max()) + slack for side in (-1.0, 1.0)]
    return Depths((_pinch(-samples), _pinch(samples)), (full[0], full[1]))


def _pinch(values: np.ndarray) -> float:
    """The least r for which the places above r no longer run on without end, to a sample; 0 if they never do."""
    if not percolates(values > 0.0):
        return 0.0
    levels = np.unique(values[values > 0.0])
    open_below, shut = -1, len(levels) - 1
    while open_below + 1 < shut:
        middle = (open_below + shut) // 2
        open_below, shut = (middle, shut) if percolates(values > levels[middle]) else (open_below, middle)
    return float(levels[shut])


def percolates(mask: np.ndarray) -> bool:
    """Whether a periodic set, given on the nodes of one period, has a path to its own copy in another period.

    A path may step along edges and diagonals: with edges alone one along a slanted channel would leave its middle, and the
    channel would seem to close where it is still 0.01 of the cell wide. Pieces within the period are joined across its
    faces with the step that this takes; a piece reached by two ways of different steps runs on for ever.
    """
    from scipy.ndimage import label

    # The first nodes again behind the last: the same places, one period on.
    pieces, count = label(np.pad(mask, ((0, 1),) * 3, mode="wrap"), structure=np.ones((3, 3, 3)))  # type: ignore[misc]
    links: dict[int, list[tuple[int, tuple[int, ...]]]] = {i + 1: [] for i in range(count)}
    for axis in range(3):
        last, first = np.take(pieces, -1, axis).ravel(), np.take(pieces, 0, axis).ravel()
        both = (last > 0) & (first > 0)
        for a, b in np.unique(np.stack([last[both], first[both]], 1), axis=0).tolist():
            step = tuple(int(axis == k) for k in range(3))
            links[a].append((b, step))
            links[b].append((a, tuple(-s for s in step)))
    at: dict[int, tuple[int, ...]] = {}
    for start in links:
        if start in at:
            continue
        at[start], queue = (0, 0, 0), [start]
        while queue:
            a = queue.pop()
            for b, step in links[a]:
                there = tuple(p + s for p, s in zip(at[a], step, strict=True))
                if b not in at:
                    at[b] = there
                    queue.append(b)
                elif at[b] != there:
                    return True
    return False
