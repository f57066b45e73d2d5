"""From one quantity to another: values of data to millimetres of a parameter, and volume fractions to thicknesses."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from frep import (
    ArgumentError,
    ArgumentTypeError,
    Field,
    FieldLike,
    Solid,
    as_field,
    clip,
)
from frep.arguments import box_of, positive, real, sizes, suggestion
from frep.field import topological
from frep.places import PLACES, share_within

from .laws import table

Curve = str | float | Callable[[Field], FieldLike] | None


def remap(
    field: FieldLike,
    source: Sequence[float],
    target: Sequence[float],
    *,
    clamp: bool = True,
    curve: Curve = None,
    smoothing: float = 0.0,
) -> Field:
    """Values from one interval to another: Hounsfield units or MPa in, millimetres out.

    Args:
        field: number, Field or function of position, in any unit.
        source: (a, b), two different values in the unit of `field`; a may be the larger.
        target: (c, d), what they become, in the unit of the result (mm for a thickness).
        clamp: values beyond `source` stay at the ends of `target`; otherwise the line goes on.
        curve: how s, 0 at a and 1 at b, becomes the share of the way from c to d: None (a straight line), "smoothstep",
            an exponent (`s ** curve`, with `clamp` only), or a function of the Field s.
        smoothing: standard deviation in mm of a Gaussian by which the data under `field` is smoothed first
            (`smoothed`).

    Raises:
        ArgumentError: equal source values, an unknown curve, or smoothing without data.

    Example:
        >>> import frep
        >>> x, y, z = frep.coordinates()
        >>> wall = remap(x, (0, 100), (0.4, 2.0))
        >>> wall([[-10, 0, 0], [50, 0, 0], [500, 0, 0]])
        array([0.4, 1.2, 2. ])
    """
    value = as_field(field, "field")
    a, b = _pair(source, "source")
    c, d = _pair(target, "target")
    if a == b:
        raise ArgumentError(f"source: expected two different values, got {source!r}")
    if smoothing:
        value = smoothed(value, smoothing)
    share = (value - a) / (b - a)
    if clamp:
        share = clip(share, 0.0, 1.0)
    return c + (d - c) * _curved(share, curve, clamp)


def _pair(values: Any, name: str) -> tuple[float, float]:
    if isinstance(values, Field | str) or not hasattr(values, "__len__") or len(values) != 2:
        raise ArgumentError(f"{name}: expected two numbers, got {values!r}")
    return real(values[0], name, "the unit of the values"), real(values[1], name, "the unit of the values")


def _curved(share: Field, curve: Curve, clamp: bool) -> Field:
    if curve is None:
        return share
    if curve == "smoothstep":
        s = clip(share, 0.0, 1.0)
        return clip(s * s * (3.0 - 2.0 * s), 0.0, 1.0)
    if isinstance(curve, str):
        raise ArgumentError(
            f'curve: expected None, "smoothstep", an exponent or a function, got {curve!r}{suggestion(curve, ["smoothstep"])}'
        )
    if callable(curve):
        return as_field(curve(share), "curve")
    exponent = positive(curve, "curve", "")
    if not clamp:
        raise ArgumentError(
            f"curve: a power of values below `source` is no number; the exponent {curve!r} needs clamp=True"
        )
    return share**exponent if exponent.is_integer() else clip(share, 1e-30, 1.0) ** exponent


def smoothed(field: Field, deviation: float) -> Field:
    """The same Field with the grids under it smoothed by a Gaussian.

    Args:
        field: made by `from_image`, `from_grid`, `from_mesh_data(spacing=...)` or `from_points`, whatever was done with
            it since.
        deviation: standard deviation, mm. Beyond their box the data counts as constant.

    Raises:
        ArgumentError: no sampled data under the Field, or a negative deviation.

    Example:
        >>> import numpy as np
        >>> from graded import from_grid
        >>> spike = np.zeros((21, 1, 1))
        >>> spike[10] = 1
        >>> float(smoothed(from_grid(spike, spacing=1), 2.0)((10, 0, 0)).round(3))
        0.199
    """
    from frep.sampled import SampledGrid

    width = positive(deviation, "smoothing")
    done: dict[Field, Field] = {}
    found = False
    for node in topological([as_field(field, "field")]):
        data = node.data
        if isinstance(data, SampledGrid):
            if data.table is not None:
                raise ArgumentError(f"smoothing: {data.label!r} is a body, not data; smooth what is made of it instead")
            data, found = _gaussian(data, width), True
        done[node] = Field(node.op, tuple(done[a] for a in node.args), data)
    if not found:
        raise ArgumentError(f"smoothing: there is no sampled data under {field!r}")
    return done[as_field(field)]


def _gaussian(grid: Any, width: float) -> Any:
    from dataclasses import replace

    from scipy.ndimage import gaussian_filter

    most = 10.0 * float((grid.spacing * np.array(grid.cells)).max())
    if width > most:
        raise ArgumentError(f"smoothing: expected at most {most:.4g} mm, ten times the data's extent, got {width:g}")
    sigma = width / grid.spacing
    if grid.periodic:
        # The last node along each axis repeats the first.
        nodes = np.pad(gaussian_filter(grid.nodes[:-1, :-1, :-1], sigma, mode="wrap"), ((0, 1),) * 3, mode="wrap")
    else:
        nodes = gaussian_filter(grid.nodes, sigma, mode="nearest")
    return replace(grid, nodes=np.ascontiguousarray(nodes, np.float32))


# --- volume fraction ---------------------------------------------------------------------------------------

_FEWER = PLACES // 8
"""So many places are looked at to find how far the width goes."""

_KNOTS = 12
_TABLE = 4096


def volume_fraction_curve(
    topology: Any, widths: Any = None, *, form: str | None = None, cell: Any = None, **options: Any
) -> tuple[np.ndarray, np.ndarray]:
    """How the volume fraction of a cell changes with its width (or bias): (n,) widths in mm, (n,) fractions.

    One period is looked at in 110,000 places, spread so evenly that the share within the material is right to 0.001.

    Args:
        topology: a periodic topology (`beams.bcc()`, `tpms.gyroid()`); or a function from a width in mm to a Solid,
            with `cell`, such as `lambda d: lattice.thicken(d, node=1.1 * d)`.
        widths: those to measure, mm; else a dozen, from none to where the cell is full.
        form: the method that gives the topology its body: "thicken" (a diameter), "sheet" (a wall), or another that
            takes a number, such as "solid" (a bias). "thicken" or "sheet" unless given.
        cell: the period in mm, a number or three, where the topology does not tell; otherwise multiples of its own.
        options: further arguments of that method, such as `section="square"`, the same all over.

    Raises:
        ArgumentTypeError: something that is no topology, a function that gives no Solid, an option that the method does
            not take or that varies.
        ArgumentError: no such form, an unknown period (of a topology whose cells differ, such as a transition, as well), or
            widths far beyond it.

    Example:
        >>> from topologies import beams
        >>> widths, fractions = volume_fraction_curve(beams.simple_cubic(cell=10), [2.0])
        >>> abs(fractions[0] - (3 * 3.14159 * 0.1**2 - 8 * 2**0.5 * 0.1**3)) < 1e-3  # lf-rep O5
        np.True_
    """
    body = _body(topology, form, cell, options)
    if widths is None:
        return body.curve()
    try:
        row = np.atleast_1d(np.array(widths, dtype=float))
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"widths: expected a row of numbers in mm, got {widths!r}") from None
    if row.ndim != 1 or not np.all(np.isfinite(row)):
        raise ArgumentError(f"widths: expected a row of finite numbers in mm, got {widths!r}")
    most = 4.0 * float(body.period.max())
    if np.any(np.abs(row) > most):
        raise ArgumentError(f"widths: expected at most {most:g} mm, four periods, got {widths!r}")
    return row, np.array([body.fraction(w) for w in row])


def thickness_for(
    topology: Any, fraction: FieldLike, *, form: str | None = None, cell: Any = None, over: Any = None, **options: Any
) -> Any:
    """The thickness, diameter or bias at which a topology fills a given share of space (lf-rep O19).

    For a number the cell is measured until it fits; for a Field the measured curve is a table, read at the local
    fraction, so that the part has the fraction asked for where it varies slowly against the cell.

    Args:
        topology, form, cell, options: as for `volume_fraction_curve`.
        fraction: volume fraction, 0 to 1, a number, a Field or a function of position.
        over: for a Field, the Solid or box (mm) in which it must be reachable; it is looked at in 17 x 17 x 17 places.
            Fractions beyond the reachable ones count as the nearest of them elsewhere.

    Returns:
        mm, or the bias: a float for a number, a Field otherwise. The fraction is met within 0.005.

    Raises:
        ArgumentError: a fraction that no width reaches; the message gives the reachable interval. A topology without a
            period, whose cells differ: give each of its parents, or `cell`, the box from the origin that is to be measured.

    Example:
        >>> from topologies import beams
        >>> round(thickness_for(beams.simple_cubic(cell=10), 0.0829), 1)
        2.0
    """
    wanted = as_field(fraction, "fraction")
    body = _body(topology, form, cell, options)
    widths, fractions = body.curve()
    if wanted.is_constant:
        return _width_at(body, widths, fractions, wanted.data)
    shares, held = _inverse(widths, fractions)
    low, high = wanted.bounds((-1e6,) * 3, (1e6,) * 3)
    if low > shares[-1] or high < shares[0]:
        _unreachable(f"{low:.4g} to {high:.4g}", shares)
    if over is not None:
        box = box_of(over)
        axes = [np.linspace(box[0, a], box[1, a], 17) for a in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        if isinstance(over, Solid):
            points = points[over.contains(points)]
        values = wanted(points)
        bad = np.flatnonzero((values < shares[0] - 1e-9) | (values > shares[-1] + 1e-9))
        if len(bad):
            place = ", ".join(f"{v:.4g}" for v in points[bad[0]])
            _unreachable(f"{values[bad[0]]:.4g} at ({place})", shares)
    # Only what is asked for: bounds of a shorter table are tighter.
    first, last = (float(np.clip(end, shares[0], shares[-1])) for end in (low, high))
    used = np.linspace(first, last, _TABLE) if first < last else shares
    return table(wanted, used, np.interp(used, shares, held))


def _unreachable(what: str, shares: np.ndarray) -> NoReturn:
    # Rounded inwards, so that both ends can be asked for.
    low, high = np.ceil(1e4 * shares[0]) / 1e4, np.floor(1e4 * shares[-1]) / 1e4
    low = min(low, high)
    hint = "; fractions are parts of one, not percent" if 2.0 <= float(what.split()[0]) <= 100.0 else ""
    raise ArgumentError(f"fraction: {what} cannot be reached; this topology fills {low:.4f} to {high:.4f}{hint}")


def _width_at(body: _Body, widths: np.ndarray, fractions: np.ndarray, wanted: float) -> float:
    from scipy.optimize import brentq

    shares, held = _inverse(widths, fractions)
    if not shares[0] <= wanted <= shares[-1]:
        _unreachable(f"{wanted:.4g}", shares)
    guess = float(np.interp(wanted, shares, held))
    k = int(np.clip(np.searchsorted(widths, guess), 1, len(widths) - 1))
    if body.from_nothing and k == 1:
        return guess
    low, high = float(widths[k - 1]), float(widths[k])
    if (body.fraction(low) - wanted) * (body.fraction(high) - wanted) >= 0.0:
        return guess
    root: Any = brentq(lambda w: body.fraction(w) - wanted, low, high, xtol=1e-4 * (high - low))
    return float(root)


def _inverse(widths: np.ndarray, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Evenly spaced fractions and their widths, by the monotone cubic through the measured ones.

    Near nothing a beam's fraction goes as the square of its width: the root of the fraction is what is interpolated.
    """
    from scipy.interpolate import PchipInterpolator

    fine = np.linspace(widths[0], widths[-1], _TABLE)
    power = 2 if _is_square(widths, fractions) else 1
    least = fractions[0] if power == 2 else 0.0
    grown = least + PchipInterpolator(widths, np.maximum(fractions - least, 0.0) ** (1 / power))(fine) ** power
    # A width of nothing is none.
    first = 1 if widths[0] == 0.0 else 0
    grown, fine = grown[first:], fine[first:]
    if grown[-1] < grown[0]:
        grown, fine = grown[::-1], fine[::-1]
    grown = np.maximum.accumulate(grown)
    rising = np.flatnonzero(np.diff(grown, prepend=-1.0) > 1e-12)
    shares = np.linspace(grown[0], grown[-1], _TABLE)
    return shares, np.interp(shares, grown[rising], fine[rising])


def _is_square(widths: np.ndarray, fractions: np.ndarray) -> bool:
    if widths[0] != 0.0:
        return False
    # Of fractions that are not mere specks.
    told = np.flatnonzero(fractions - fractions[0] > 2e-3)[:2]
    if len(told) < 2:
        return False
    grown, wider = fractions[told] - fractions[0], widths[told]
    return bool(np.log(grown[1] / grown[0]) / np.log(wider[1] / wider[0]) > 1.5)


class _Body:
    """A topology with a width: what is measured."""

    def __init__(
        self, make: Callable[[float], Any], period: np.ndarray, from_nothing: bool, axes: np.ndarray | None = None
    ) -> None:
        self.make = make
        self.period = period
        self.axes = axes
        """Directions of the period's sides, as columns, if they are not those of space."""
        self.from_nothing = from_nothing
        """Widths begin at 0; otherwise a bias may be negative."""
        self._known: dict[tuple[float, int], float] = {}

    def fraction(self, width: float, *, roughly: bool = False) -> float:
        """Measured share of a period."""
        if self.from_nothing and width <= 0.0:
            # What is there without a width, such as node balls of a size of their own.
            width = 1e-6 * float(self.period.min())
        places = _FEWER if roughly else PLACES
        if (width, places) not in self._known:
            with warnings.catch_warnings():
                # Sealed channels are for the one who builds with them.
                warnings.simplefilter("ignore")
                solid = self.make(width)
            if not isinstance(solid, Solid):
                raise ArgumentTypeError(
                    f"topology: expected a function that gives a Solid for a width in mm, it gave {type(solid).__name__}"
                )
            self._known[width, places] = share_within(solid, self.period, places, self.axes)
        return self._known[width, places]

    def curve(self) -> tuple[np.ndarray, np.ndarray]:
        """A dozen widths from nothing to a full cell, or as near to these as it gets, and their fractions.

        More of them near nothing, where a flat cell's beams soon grow into each other.
        """
        high = self._limit(1.0)
        low = 0.0 if self.from_nothing else self._limit(-1.0)
        widths = np.linspace(low, high, _KNOTS + self.from_nothing)
        if self.from_nothing:
            widths = np.concatenate([widths[:1], widths[1] * np.array([0.25, 0.5]), widths[1:]])
        if self._refused(float(widths[0])):
            widths = widths[1:]
        return widths, np.array([self.fraction(float(w)) for w in widths])

    def _limit(self, side: float) -> float:
        """How far the width goes up (side 1) or down: to where the cell is full or empty, or no more is taken."""
        side *= 0.1 * float(self.period.min())
        inner, outer = 0.1 * abs(side) if self._refused(0.0) else 0.0, side
        for _ in range(7):
            if self._ends(outer):
                break
            inner, outer = outer, 2.0 * outer
        for _ in range(7):
            middle = 0.5 * (inner + outer)
            inner, outer = (inner, middle) if self._ends(middle) else (middle, outer)
        return inner if self._refused(outer) else outer

    def _ends(self, width: float) -> bool:
        return self._refused(width) or not 1e-4 < self.fraction(width, roughly=True) < 1.0 - 1e-4

    def _refused(self, width: float) -> bool:
        """Whether the topology takes no such width."""
        try:
            self.fraction(width, roughly=True)
        except ArgumentTypeError:
            raise
        except ArgumentError:
            return True
        return False


def _body(topology: Any, form: str | None, cell: Any, options: dict[str, Any]) -> _Body:
    """What to measure: how to make it, its period, and whether it starts from nothing."""
    own = _period(topology)
    period = cell if cell is not None else own
    if cell is not None and own is not None:
        times = sizes(cell, "cell") / sizes(own, "cell")
        if np.any(np.abs(times - np.round(times)) > 1e-6) or np.any(times < 0.5):
            raise ArgumentError(
                f"cell: {topology!r} repeats every {' x '.join(f'{s:g}' for s in sizes(own, 'cell'))} mm; expected whole "
                f"multiples of that, or nothing, got {cell!r}"
            )
    for option, value in options.items():
        if callable(value) or (isinstance(value, Field) and not value.is_constant):
            raise ArgumentTypeError(
                f"{option}: expected what is the same all over, since one cell is measured, got {value!r}"
            )
    known = [name for name in ("thicken", "sheet") if callable(getattr(topology, name, None))]
    if not known and form is None:
        if not callable(topology):
            raise ArgumentTypeError(
                f"topology: expected a topology or a function from a width to a Solid, got {type(topology).__name__}"
            )
        if period is None:
            raise ArgumentError("cell: a function does not tell its period; give the cell in mm, a number or three")
        return _Body(lambda w: topology(w, **options), sizes(period, "cell"), from_nothing=True)
    if period is None:
        raise ArgumentError(
            f"cell: {topology!r} has no period that it could tell; give a periodic topology, or the cell in mm: the box from "
            "the origin that is measured"
        )
    name = form or known[0]
    method: Any = getattr(topology, name, None)
    if not callable(method):
        forms = [n for n in dir(topology) if not n.startswith("_") and n in _FORMS and callable(getattr(topology, n))]
        there = ", ".join(forms) or "none that is known"
        raise ArgumentError(f"form: {topology!r} has no {name!r}; it has {there}{suggestion(name, forms)}")
    taken = inspect.signature(method).parameters
    for option in options:
        if option not in taken and not any(p.kind is p.VAR_KEYWORD for p in taken.values()):
            raise ArgumentTypeError(
                f"{option}: {name} takes no such argument; it takes {', '.join(taken)}{suggestion(option, taken)}"
            )
    from_nothing = name in ("thicken", "sheet")
    return _Body(lambda w: method(w, **options), sizes(period, "cell"), from_nothing, _axes(topology))


_FORMS = ("thicken", "sheet", "solid", "inverse", "twin")


def _axes(topology: Any) -> np.ndarray | None:
    """The directions of the sides of a topology's period, as columns; None for those of space."""
    placement = getattr(topology, "placement", None)
    if placement is not None:
        return (placement.apply(np.eye(3)) - placement.apply(np.zeros((1, 3)))).T
    return getattr(topology, "axes", None)


def _period(topology: Any) -> Any:
    if getattr(topology, "aperiodic", False) or not getattr(topology, "repeats", True):
        return None
    # A surface made of cells that differ has a period longer than its cell.
    for name in ("period", "cell"):
        if (length := getattr(topology, name, None)) is not None:
            return length
    from frep.skeleton import PeriodicSkeleton

    skeleton = getattr(topology, "skeleton", None)
    return skeleton.size if isinstance(skeleton, PeriodicSkeleton) else None
