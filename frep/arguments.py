"""What functions accept: numbers, vectors, widths, boxes and words, checked once, with the argument's name in the error.

For the packages that build on the kernel as well: a topology checks its thickness as the kernel does.
"""

from __future__ import annotations

import difflib
import math
import numbers
from collections.abc import Iterable
from typing import Any

import numpy as np

from .errors import ArgumentError, ArgumentTypeError, UnboundedError, warn
from .field import Field, FieldLike, as_field


class DegreesWarning(UserWarning):
    """An angle of more than a full turn, taken as rad as it stands: degrees were probably meant."""


def direction(value: Any, name: str) -> np.ndarray:
    """A unit vector from "x", "y", "z" or three numbers."""
    if isinstance(value, str) and value in ("x", "y", "z"):
        return np.eye(3)["xyz".index(value)]
    if isinstance(value, str):
        raise ArgumentTypeError(f'{name}: expected "x", "y", "z" or a vector of three numbers, got {value!r}')
    v = vector(value, name)
    length = float(np.linalg.norm(v))
    if length == 0.0:
        raise ArgumentError(f"{name}: expected a vector that is not zero")
    return v / length


def real(value: Any, name: str, unit: str) -> float:
    """`value` as a float, checked to be a finite number; `unit` is for the message, "1" for none."""
    unit = "" if unit == "1" else f" in {unit}"
    if isinstance(value, Field):
        raise ArgumentTypeError(f"{name}: expected a number{unit}, got the Field {value!r}")
    if isinstance(value, str | bool):
        raise ArgumentTypeError(f"{name}: expected a number{unit}, got {value!r}")
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a number{unit}, got {value!r}") from None
    if not math.isfinite(number):
        raise ArgumentError(f"{name}: expected a finite number{unit}, got {value!r}")
    return number


def turn(value: Any, name: str) -> float:
    """The angle of a rotation in rad, checked to be a finite number; more than a full turn is taken, with a warning.

    Example:
        >>> turn(0.5, "angle")
        0.5
    """
    angle = real(value, name, "rad")
    if abs(angle) > 2.0 * math.pi * (1.0 + 1e-9):
        warn(
            f"{name}: {angle:g} rad is {abs(angle) / (2.0 * math.pi):.3g} turns; if degrees were meant, give "
            f"math.radians({angle:g}), which is {math.radians(angle):.4g} rad",
            DegreesWarning,
        )
    return angle


def width(value: FieldLike, name: str) -> Field:
    """A thickness, diameter or radius as a Field; a number must be positive."""
    if isinstance(value, bool | np.bool_):
        raise ArgumentTypeError(f"{name}: expected a number in mm, a Field or a function of position, got {value!r}")
    field = as_field(value, name)
    if field.is_constant and not field.data > 0.0:
        raise ArgumentError(f"{name}: expected more than 0 mm, got {field.data:g}")
    return field


def vector(value: Any, name: str) -> np.ndarray:
    """`value` as (3,) float64, checked to be three finite numbers."""
    if isinstance(value, Field):
        raise ArgumentTypeError(f"{name}: expected three numbers (x, y, z) in mm, got a Field")
    try:
        v = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected three numbers (x, y, z) in mm, got {value!r}") from None
    if v.shape != (3,) or not np.all(np.isfinite(v)):
        raise ArgumentError(f"{name}: expected three finite numbers (x, y, z) in mm, got {value!r}")
    return v


def finite(value: Any, name: str) -> np.ndarray:
    """`value` as a float64 array of any shape, checked to hold finite numbers."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected an array of numbers, got {value!r}") from None
    if not np.all(np.isfinite(array)):
        raise ArgumentError(f"{name}: expected finite numbers, got {value!r}")
    return array


def refuse_nan(array: np.ndarray, name: str, item: str) -> None:
    """Raise for NaN and infinite numbers in data of one item a row: how many items have them, and which is the first.

    Raises:
        ArgumentError: a number that is not finite.

    Example:
        >>> refuse_nan(np.zeros((4, 3)), "seeds", "seed")
    """
    bad = np.flatnonzero(~np.isfinite(array).all(axis=tuple(range(1, array.ndim))))
    if len(bad):
        first = array[bad[0]].tolist()
        raise ArgumentError(
            f"{name}: expected finite numbers, {len(bad):,} of {len(array):,} {item}s have NaN or infinite ones, "
            f"the first is {item} {bad[0]}: {first}"
        )


def positive(value: Any, name: str, unit: str = " in mm") -> float:
    """`value` as a float, checked to be a finite number above zero."""
    if isinstance(value, Field) or callable(value):
        raise ArgumentTypeError(
            f"{name}: expected a number{unit}, got a Field; only thickness, blend and offset may vary"
        )
    is_number = isinstance(value, numbers.Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
    if not is_number or isinstance(value, bool):
        raise ArgumentTypeError(f"{name}: expected a number{unit}, got {type(value).__name__}: {value!r}")
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise ArgumentError(f"{name}: expected a finite number > 0{unit}, got {value!r}")
    return number


def sizes(value: Any, name: str) -> np.ndarray:
    """One size or three as (3,) positive mm: the sides of a cell, the spacings of a grid."""
    if isinstance(value, Field) or callable(value):
        raise ArgumentTypeError(f"{name}: expected a number or three numbers in mm, got a Field: {value!r}")
    try:
        held = np.asarray(value)
        if held.dtype.kind not in "iuf":
            raise TypeError
        size = np.broadcast_to(held.astype(float), (3,)).copy()
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a number or three numbers in mm, got {value!r}") from None
    if not np.all(np.isfinite(size) & (size > 0)):
        raise ArgumentError(f"{name}: expected finite sizes > 0 mm, got {value!r}")
    return size


def box_of(value: Any, name: str = "over") -> np.ndarray:
    """The (2, 3) box of a bounded Solid, or of two corners in mm."""
    bounds = getattr(value, "bounds", value)
    try:
        box = np.array(bounds, dtype=float)
    except (TypeError, ValueError):
        box = np.zeros(0)
    if box.shape != (2, 3):
        raise ArgumentTypeError(f"{name}: expected a bounded Solid or ((x0, y0, z0), (x1, y1, z1)), got {value!r}")
    if not np.all(np.isfinite(box)):
        raise UnboundedError(
            f"{name}: expected a bounded Solid, or two finite corners in mm, got {value!r}; intersect it with a box first"
        )
    if not np.all(box[0] < box[1]):
        raise ArgumentError(f"{name}: expected a lower and an upper corner, with space between them, got {value!r}")
    return box


def suggestion(word: Any, known: Iterable[Any]) -> str:
    """ "; did you mean 'x'?" for a word that is nearly one of those known, else nothing: the end of a message.

    Example:
        >>> suggestion("layres", ["layers", "grid"])
        "; did you mean 'layers'?"
    """
    folded = {str(k).lower(): str(k) for k in known}
    near = difflib.get_close_matches(str(word).lower(), folded, n=1, cutoff=0.5)
    return f"; did you mean {folded[near[0]]!r}?" if near else ""


def one_of(value: Any, name: str, known: Iterable[str]) -> str:
    """`value`, checked to be one of the words known; the error suggests the nearest."""
    words = list(known)
    if isinstance(value, str) and value in words:
        return value
    raise ArgumentError(
        f"{name}: expected one of {', '.join(map(repr, words))}, got {value!r}{suggestion(value, words)}"
    )
