"""What functions accept: numbers, vectors and widths, checked once, with the argument's name in the error.

For the packages that build on the kernel as well: a topology checks its thickness as the kernel does.
"""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np

from .errors import ArgumentError, ArgumentTypeError
from .field import Field, FieldLike, as_field


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
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a number{unit}, got {value!r}") from None
    if not math.isfinite(number):
        raise ArgumentError(f"{name}: expected a finite number{unit}, got {value!r}")
    return number


def width(value: FieldLike, name: str) -> Field:
    """A thickness, diameter or radius as a Field; a number must be positive."""
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
