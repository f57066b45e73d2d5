"""Laws: how a parameter varies along an axis, round an axis, or along any Field.

Every law takes the same keyword arguments (`Where`), which say in what coordinates its positions count and whether it
is read at every point or once a cell:

    linear("z", 0, 100, 1, 3)                                            # mm
    linear("z", 0, 1, 1, 3, coordinates="normalised", over=body)         # 0 to 1 across the body's bounds
    linear("z", 0, 8, 1, 3, coordinates="cell", cell=10)                 # counted in cells of 10 mm
    linear("z", 0, 100, 1, 3, sample="cell", cell=10)                    # one value a cell, read at its centre

Laws with a start and a stop keep the value of the nearer end outside them. Any function of position does in place of a
law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypedDict, Unpack

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, as_field, clip, maximum, sin, sqrt, square, where
from frep import coordinates as position
from frep.arguments import box_of, direction, positive, real, sizes, suggestion, vector

from .sampling_rules import per_cell


class Where(TypedDict, total=False):
    """Keyword arguments of every law.

    Attributes:
        coordinates: of the axis: "world" (mm, the default), "normalised" (0 to 1 across `over`) or "cell" (counted in
            `cell` from the origin). Lengths along the axis are in the same unit.
        over: a bounded Solid, or two corners in mm, for normalised coordinates.
        cell: size of a cell in mm, a number or three, for cell coordinates and for `sample="cell"`.
        sample: "point" (the default: read everywhere) or "cell" (read at the centre of each cell, `per_cell`). For the
            rules "node" and "foot" of LF-rep 5 see `at_nodes`, and `along_beams` and `at_foot`.
    """

    coordinates: str
    over: Any
    cell: Any
    sample: str


_KNOWN = ("coordinates", "over", "cell", "sample")


def _frame(options: Where) -> tuple[Field, Field, Field]:
    """The coordinates in which positions count."""
    unknown = [name for name in options if name not in _KNOWN]
    if unknown:
        raise ArgumentTypeError(
            f"{unknown[0]}: no such argument; a law also takes {', '.join(_KNOWN)}{suggestion(unknown[0], _KNOWN)}"
        )
    kind = options.get("coordinates", "world")
    over, cell, sample = options.get("over"), options.get("cell"), options.get("sample", "point")
    if sample in ("node", "foot"):
        name = "at_nodes(law, graph)" if sample == "node" else "along_beams(law, graph) or at_foot(law, distance)"
        raise ArgumentError(f"sample: {sample!r} is a function of its own, graded.{name}")
    if sample not in ("point", "cell"):
        raise ArgumentError(
            f'sample: expected "point" or "cell", got {sample!r}{suggestion(sample, ("point", "cell"))}'
        )
    if kind not in (kinds := ("world", "normalised", "cell")):
        raise ArgumentError(
            f'coordinates: expected "world", "normalised" or "cell", got {kind!r}{suggestion(kind, kinds)}'
        )
    if (kind == "normalised") != (over is not None):
        raise ArgumentError('over: a Solid or two corners go with coordinates="normalised", and with nothing else')
    if (kind == "cell" or sample == "cell") != (cell is not None):
        raise ArgumentError('cell: a size in mm goes with coordinates="cell" or sample="cell", and with nothing else')
    x, y, z = position()
    if kind == "normalised":
        low, high = box_of(over)
        size = high - low
        return (x - low[0]) / size[0], (y - low[1]) / size[1], (z - low[2]) / size[2]
    if kind == "cell":
        size = sizes(cell, "cell")
        return x / size[0], y / size[1], z / size[2]
    return x, y, z


def _along(axis: FieldLike | str, options: Where) -> Field:
    """The coordinate that a law follows."""
    frame = _frame(options)
    if isinstance(axis, str):
        if axis not in ("x", "y", "z"):
            raise ArgumentError(f'axis: expected "x", "y", "z" or a Field, got {axis!r}{suggestion(axis, "xyz")}')
        return frame["xyz".index(axis)]
    return as_field(axis, "axis").substitute(*frame)


def _read(law: Field, options: Where) -> Field:
    """The law, read as `sample` says."""
    return per_cell(law, options.get("cell")) if options.get("sample") == "cell" else law


def _share(axis: FieldLike | str, start: float, stop: float, options: Where) -> Field:
    """Where between start (0) and stop (1) a point lies along the axis, limited to [0, 1]."""
    along = _along(axis, options)
    low, high = real(start, "start", "mm"), real(stop, "stop", "mm")
    if low == high:
        raise ArgumentError(f"start, stop: expected two different positions in mm, got {start!r} twice")
    return clip((along - low) / (high - low), 0.0, 1.0)


def _between(low: FieldLike, high: FieldLike, share: Field, names: tuple[str, str] = ("low", "high")) -> Field:
    at_start = as_field(low, names[0])
    return at_start + (as_field(high, names[1]) - at_start) * share


def linear(
    axis: FieldLike | str, start: float, stop: float, low: FieldLike, high: FieldLike, **options: Unpack[Where]
) -> Field:
    """From `low` at `start` to `high` at `stop` in a straight line (LF-rep 3.15).

    Args:
        axis: "x", "y", "z", or any Field to use as the coordinate.
        start, stop: where the law begins and ends, mm; `start` may be above `stop`.
        low, high: the values there, numbers or Fields.
        options: coordinates, over, cell, sample; see `Where`.

    Raises:
        ArgumentError: unknown axis, equal or non-finite positions, options that do not fit together.

    Example:
        >>> linear("z", 0, 10, 1, 3)([[0, 0, -5], [0, 0, 5], [0, 0, 99]])
        array([1., 2., 3.])
        >>> linear("z", 0, 1, 1, 3, coordinates="normalised", over=((0, 0, 0), (9, 9, 40)))([[0, 0, 20]])
        array([2.])
    """
    return _read(_between(low, high, _share(axis, start, stop, options)), options)


def parabola(
    axis: FieldLike | str, start: float, stop: float, ends: FieldLike, middle: FieldLike, **options: Unpack[Where]
) -> Field:
    """From `ends` through `middle` halfway and back to `ends` (LF-rep 4.1, corrected: `middle` is reached, not passed).

    Arguments as for `linear`.

    Example:
        >>> parabola("x", 0, 200, ends=1, middle=6)([[0, 0, 0], [100, 0, 0], [200, 0, 0]])
        array([1., 6., 1.])
    """
    # 4 s (1 - s), written so that its bounds are those of its values.
    hill = 1.0 - square(2.0 * _share(axis, start, stop, options) - 1.0)
    return _read(_between(ends, middle, hill, ("ends", "middle")), options)


def parabola_thesis(
    axis: FieldLike | str, start: float, stop: float, ends: FieldLike, middle: FieldLike, **options: Unpack[Where]
) -> Field:
    """The parabola as the thesis prints it (LF-rep 4.1): `-4 middle (s - 1/2)^2 + middle + ends`.

    It passes `middle` by `ends` halfway: D_min = 1 and D_max = 6 peak at 7. For parts that must be like those printed
    there; `parabola` is the law that was meant. Arguments as for `linear`.

    Example:
        >>> parabola_thesis("x", 0, 200, ends=1, middle=6)([[0, 0, 0], [100, 0, 0], [200, 0, 0]])
        array([1., 7., 1.])
    """
    hill = 1.0 - square(2.0 * _share(axis, start, stop, options) - 1.0)
    return _read(as_field(ends, "ends") + as_field(middle, "middle") * hill, options)


def sine(
    axis: FieldLike | str,
    mean: FieldLike,
    amplitude: FieldLike,
    period: float,
    phase: float = 0.0,
    **options: Unpack[Where],
) -> Field:
    """`mean + amplitude * sin(2 pi s / period + phase)` along the axis (LF-rep 4.2: mean 4, amplitude 3).

    Args:
        axis: "x", "y", "z", or any Field to use as the coordinate.
        mean, amplitude: numbers or Fields.
        period: mm, not zero.
        phase: rad.
        options: coordinates, over, cell, sample; see `Where`.

    Example:
        >>> sine("z", mean=4, amplitude=3, period=20)([[0, 0, 0], [0, 0, 5], [0, 0, 15]])
        array([4., 7., 1.])
    """
    wave = positive(period, "period")
    angle = _along(axis, options) * (2.0 * math.pi / wave) + real(phase, "phase", "rad")
    return _read(as_field(mean, "mean") + as_field(amplitude, "amplitude") * sin(angle), options)


def radial(
    center: Any,
    start: float,
    stop: float,
    low: FieldLike,
    high: FieldLike,
    *,
    axis: Any = None,
    **options: Unpack[Where],
) -> Field:
    """Linear in the distance from an axis, or from a point where `axis` is None (LF-rep 4.5.2, section 9).

    Args:
        center: the point, or any point of the axis, (x, y, z) mm.
        start, stop: distances between which the law runs, mm.
        low, high: the values there, numbers or Fields.
        axis: "x", "y", "z" or a direction.
        options: coordinates, over, cell, sample; see `Where`.

    Example:
        >>> radial((0, 0, 0), 0, 10, 1, 2, axis="z")([[0, 0, 7], [3, 4, -8], [30, 0, 0]])
        array([1. , 1.5, 2. ])
    """
    c = vector(center, "center")
    offsets = [p - o for p, o in zip(position(), c, strict=True)]
    if axis is not None:
        u = direction(axis, "axis")
        along = offsets[0] * u[0] + offsets[1] * u[1] + offsets[2] * u[2]
        offsets = [d - along * a for d, a in zip(offsets, u, strict=True)]
    distance = sqrt(square(offsets[0]) + square(offsets[1]) + square(offsets[2]))
    return linear(distance, start, stop, low, high, **options)


def axial(
    center: Any,
    axis: Any,
    start: float,
    stop: float,
    low: FieldLike,
    high: FieldLike,
    **options: Unpack[Where],
) -> Field:
    """Linear along any direction, counted from `center`.

    Args:
        center: where the position is zero, (x, y, z) mm.
        axis: "x", "y", "z" or a direction of any length.
        start, stop, low, high, options: as for `linear`.

    Example:
        >>> axial((1, 0, 0), (0, 3, 4), 0, 10, 1, 2)([[1, 3, 4]])
        array([1.5])
    """
    c, u = vector(center, "center"), direction(axis, "axis")
    x, y, z = position()
    return linear((x - c[0]) * u[0] + (y - c[1]) * u[1] + (z - c[2]) * u[2], start, stop, low, high, **options)


def power(
    axis: FieldLike | str,
    start: float,
    stop: float,
    low: FieldLike,
    high: FieldLike,
    exponent: float,
    **options: Unpack[Where],
) -> Field:
    """From `low` to `high` by a power: `low + (high - low) * s ** exponent` with s from 0 at `start` to 1 at `stop`.

    Args:
        exponent: above 0; 1 is `linear`.
        axis, start, stop, low, high, options: as for `linear`.

    Example:
        >>> power("x", 0, 10, 1, 5, exponent=2)([[0, 0, 0], [5, 0, 0], [10, 0, 0]])
        array([1., 2., 5.])
    """
    e = positive(exponent, "exponent", "")
    s = _share(axis, start, stop, options)
    # Other than whole powers go through a logarithm, which has no value at 0; where the power has one.
    raised = s**e if e.is_integer() or e == 0.5 else where(s > _TINY, maximum(s, _TINY) ** e, 0.0)
    return _read(_between(low, high, raised), options)


_TINY = 1e-30
"""Stands for 0 under a logarithm; also above 0 in float32."""


def step(axis: FieldLike | str, at: float, low: FieldLike, high: FieldLike, **options: Unpack[Where]) -> Field:
    """`low` before `at`, `high` from there on.

    Args:
        at: the place of the jump, mm.
        axis, low, high, options: as for `linear`.

    Example:
        >>> step("x", 10, 1, 2)([[9, 0, 0], [10, 0, 0], [11, 0, 0]])
        array([1., 2., 2.])
    """
    return piecewise(axis, [real(at, "at", "mm")], [as_field(low, "low"), as_field(high, "high")], **options)


def smoothstep(
    axis: FieldLike | str, start: float, stop: float, low: FieldLike, high: FieldLike, **options: Unpack[Where]
) -> Field:
    """From `low` to `high` with slope zero at both ends: `s ** 2 * (3 - 2 s)`.

    Arguments as for `linear`.

    Example:
        >>> smoothstep("x", 0, 10, 1, 3)([[0, 0, 0], [5, 0, 0], [10, 0, 0]])
        array([1., 2., 3.])
    """
    s = _share(axis, start, stop, options)
    # Limited to what it keeps to anyway: its factors have wider bounds.
    return _read(_between(low, high, clip(square(s) * (3.0 - 2.0 * s), 0.0, 1.0)), options)


def piecewise(
    axis: FieldLike | str,
    positions: Sequence[float] | np.ndarray,
    laws: Sequence[FieldLike] | np.ndarray,
    **options: Unpack[Where],
) -> Field:
    """One law before the first position, another up to the second, and so on.

    Args:
        axis: "x", "y", "z", or any Field to use as the coordinate.
        positions: where one law ends and the next begins, mm, rising.
        laws: one more than positions; numbers, Fields or functions.
        options: coordinates, over, cell, sample; see `Where`.

    Raises:
        ArgumentError: positions that do not rise, or another number of laws.

    Example:
        >>> piecewise("x", [10, 20], [1, 5, 2])([[0, 0, 0], [10, 0, 0], [25, 0, 0]])
        array([1., 5., 2.])
    """
    at = _numbers(positions, "positions")
    if np.any(np.diff(at) <= 0):
        raise ArgumentError(f"positions: expected rising positions, got {positions!r}")
    if isinstance(laws, np.ndarray):
        laws = laws.tolist()
    if isinstance(laws, str) or not isinstance(laws, Sequence) or len(laws) != len(at) + 1:
        raise ArgumentError(f"laws: expected {len(at) + 1} laws for {len(at)} positions, got {laws!r}")
    along = _along(axis, options)
    result = as_field(laws[-1], f"laws[{len(at)}]")
    for i in range(len(at) - 1, -1, -1):
        result = where(along < float(at[i]), as_field(laws[i], f"laws[{i}]"), result)
    return _read(result, options)


def table(
    axis: FieldLike | str,
    positions: Sequence[float] | np.ndarray,
    values: Sequence[float] | np.ndarray,
    *,
    smooth: bool = False,
    **options: Unpack[Where],
) -> Field:
    """Measured values, interpolated along the axis; beyond the ends the values of the ends.

    Args:
        axis: "x", "y", "z", or any Field to use as the coordinate: `table(density, [0, 1], [0.4, 2])`.
        positions: (n,) rising, mm, or in the unit of the axis.
        values: (n,) numbers, in the unit of the parameter.
        smooth: False for straight lines between the values; True for the monotone cubic of Fritsch and Carlson (1980),
            which rises and falls only where the values do.
        options: coordinates, over, cell, sample; see `Where`.

    Straight lines through up to 32 values are exact; longer tables and cubics are kept as float32 samples, at least
    1,024.

    Raises:
        ArgumentError: fewer than two positions, positions that do not rise, values that are not finite, or differing
        lengths.

    Example:
        >>> table("x", [0, 10, 30], [1, 2, 1])([[-5, 0, 0], [5, 0, 0], [20, 0, 0]])
        array([1. , 1.5, 1.5])
    """
    at, held = _numbers(positions, "positions"), _numbers(values, "values")
    if len(at) < 2 or np.any(np.diff(at) <= 0):
        raise ArgumentError(f"positions: expected at least two rising positions, got {positions!r}")
    if len(held) != len(at):
        raise ArgumentError(f"values: expected {len(at)} numbers, one a position, got {len(held)}")
    along = _along(axis, options)
    if smooth or len(at) > _MOST_KNOTS:
        return _read(_sampled_table(along, at, held, smooth), options)
    # A sum of limited ramps: where the values rise or fall throughout, its bounds are exact.
    result = as_field(float(held[0]))
    for i in range(len(at) - 1):
        share = clip((along - float(at[i])) / float(at[i + 1] - at[i]), 0.0, 1.0)
        result = result + float(held[i + 1] - held[i]) * share
    if not (np.all(np.diff(held) >= 0.0) or np.all(np.diff(held) <= 0.0)):
        # Limited to what it keeps to anyway: a sum has wider bounds than its values.
        result = clip(result, float(held.min()), float(held.max()))
    return _read(result, options)


_MOST_KNOTS = 32
_LEAST_SAMPLES, _MOST_SAMPLES = 1024, 65536


def _sampled_table(along: Field, at: np.ndarray, held: np.ndarray, smooth: bool) -> Field:
    """A table as a grid of one row, read at `along`."""
    from frep.sampled import SampledGrid

    steps = np.diff(at)
    length = float(at[-1] - at[0])
    even = np.allclose(steps, steps[0], rtol=1e-9, atol=0.0)
    if smooth:
        from scipy.interpolate import PchipInterpolator

        n = int(np.clip(16.0 * length / steps.min(), _LEAST_SAMPLES, _MOST_SAMPLES))
        samples = PchipInterpolator(at, held)(np.linspace(at[0], at[-1], n + 1))
    else:
        # Evenly spaced values are themselves the samples.
        n = len(at) - 1 if even else int(np.clip(16.0 * length / steps.min(), _LEAST_SAMPLES, _MOST_SAMPLES))
        samples = held if even else np.interp(np.linspace(at[0], at[-1], n + 1), at, held)
    nodes = np.broadcast_to(samples[:, None, None], (n + 1, 2, 2)).astype(np.float32)
    # Counted in samples, so that a step of the differences suits any unit.
    spacing = np.array([length / n, 1.0, 1.0])
    row = SampledGrid(np.array([float(at[0]), 0.0, 0.0]), spacing, nodes, label="table")
    return row.field().substitute(clip(along, float(at[0]), float(at[-1])), 0.5, 0.5)


def _numbers(values: Any, name: str) -> np.ndarray:
    """A row of finite numbers."""
    if isinstance(values, Field):
        raise ArgumentTypeError(f"{name}: expected a row of numbers, got a Field")
    try:
        row = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a row of numbers, got {values!r}") from None
    if row.ndim != 1 or len(row) == 0 or not np.all(np.isfinite(row)):
        raise ArgumentError(f"{name}: expected a non-empty row of finite numbers, got {values!r}")
    return row
