"""Laws along an axis. Outside their range they keep the value of the nearer end."""

from __future__ import annotations

from frep import ArgumentError, Field, FieldLike, as_field, clip, coordinates
from frep.arguments import real


def _position(axis: FieldLike | str, start: float, stop: float) -> Field:
    """Where between start (0) and stop (1) a point lies along the axis, limited to [0, 1]."""
    if isinstance(axis, str):
        if axis not in ("x", "y", "z"):
            raise ArgumentError(f'axis: expected "x", "y", "z" or a Field, got {axis!r}')
        along = coordinates()["xyz".index(axis)]
    else:
        along = as_field(axis, "axis")
    low, high = real(start, "start", "mm"), real(stop, "stop", "mm")
    if low == high:
        raise ArgumentError(f"start, stop: expected two different positions in mm, got {start!r} twice")
    return clip((along - low) / (high - low), 0.0, 1.0)


def linear(axis: FieldLike | str, start: float, stop: float, low: FieldLike, high: FieldLike) -> Field:
    """From `low` at `start` to `high` at `stop` in a straight line (LF-rep 3.15).

    Args:
        axis: "x", "y", "z", or any Field to use as the coordinate.
        start, stop: where the law begins and ends, mm; `start` may be above `stop`.
        low, high: the values there, numbers or Fields.

    Raises:
        ArgumentError: unknown axis, equal or non-finite positions.

    Example:
        >>> linear("z", 0, 10, 1, 3)([[0, 0, -5], [0, 0, 5], [0, 0, 99]])
        array([1., 2., 3.])
    """
    at_start = as_field(low, "low")
    return at_start + (as_field(high, "high") - at_start) * _position(axis, start, stop)


def parabola(axis: FieldLike | str, start: float, stop: float, ends: FieldLike, middle: FieldLike) -> Field:
    """From `ends` through `middle` halfway and back to `ends` (LF-rep 4.1, corrected: the middle is reached, not exceeded).

    Arguments as for `linear`.

    Example:
        >>> parabola("x", 0, 200, ends=1, middle=6)([[0, 0, 0], [100, 0, 0], [200, 0, 0]])
        array([1., 6., 1.])
    """
    s = _position(axis, start, stop)
    at_ends = as_field(ends, "ends")
    return at_ends + (as_field(middle, "middle") - at_ends) * (4.0 * s * (1.0 - s))
