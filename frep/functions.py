"""Functions of Fields, under numpy's names: `frep.sin(x)` and `np.sin(x)` are the same Field."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from .field import Field, FieldLike, _lift, _make, constant


def sqrt(a: FieldLike) -> Field:
    """Square root; NaN below zero."""
    return _make("sqrt", (_lift(a),))


def square(a: FieldLike) -> Field:
    """The argument times itself; its interval is tighter than that of a product."""
    return _make("square", (_lift(a),))


def exp(a: FieldLike) -> Field:
    """e to the power of the argument."""
    return _make("exp", (_lift(a),))


def log(a: FieldLike) -> Field:
    """Natural logarithm."""
    return _make("log", (_lift(a),))


def sin(a: FieldLike) -> Field:
    """Sine of an angle in rad."""
    return _make("sin", (_lift(a),))


def cos(a: FieldLike) -> Field:
    """Cosine of an angle in rad."""
    return _make("cos", (_lift(a),))


def tan(a: FieldLike) -> Field:
    """Tangent of an angle in rad."""
    return sin(a) / cos(a)


def arctan2(a: FieldLike, b: FieldLike) -> Field:
    """Angle of the point `(b, a)` from the b-axis, rad, in (-pi, pi]."""
    return _make("arctan2", (_lift(a), _lift(b)))


def arctan(a: FieldLike) -> Field:
    """Inverse tangent, rad."""
    return arctan2(a, 1.0)


def hypot(a: FieldLike, b: FieldLike) -> Field:
    """`sqrt(a**2 + b**2)`."""
    return sqrt(square(a) + square(b))


def floor(a: FieldLike) -> Field:
    """The largest whole number not above the argument."""
    return _make("floor", (_lift(a),))


def mod(a: FieldLike, b: FieldLike) -> Field:
    """Remainder with the sign of `b`, as Python's `%`."""
    return _make("mod", (_lift(a), _lift(b)))


def minimum(a: FieldLike, b: FieldLike) -> Field:
    """The smaller of two."""
    return _make("minimum", (_lift(a), _lift(b)))


def maximum(a: FieldLike, b: FieldLike) -> Field:
    """The larger of two."""
    return _make("maximum", (_lift(a), _lift(b)))


def where(condition: FieldLike, a: FieldLike, b: FieldLike) -> Field:
    """`a` where the condition is not zero, else `b`; both are evaluated everywhere."""
    return _make("where", (_lift(condition), _lift(a), _lift(b)))


def clip(a: FieldLike, lower: FieldLike | None, upper: FieldLike | None) -> Field:
    """The argument limited to `[lower, upper]`; either may be None."""
    result = _lift(a)
    if lower is not None:
        result = maximum(result, lower)
    return result if upper is None else minimum(result, upper)


def sign(a: FieldLike) -> Field:
    """-1, 0 or 1."""
    return (_lift(a) > 0.0) - (_lift(a) < 0.0)


def tanh(a: FieldLike) -> Field:
    """Hyperbolic tangent."""
    return 1.0 - 2.0 / (exp(2.0 * clip(a, -30.0, 30.0)) + 1.0)


def power(base: FieldLike, exponent: FieldLike) -> Field:
    """`base ** exponent`: whole exponents by repeated products, 0.5 by `sqrt`, others for a positive base only."""
    b, e = _lift(base), _lift(exponent)
    if e.op != "constant":
        return exp(e * log(b))
    n = e.data
    if n == 0.5:
        return sqrt(b)
    if not n.is_integer():
        return exp(e * log(b))
    if n < 0:
        return 1.0 / power(b, -n)
    return _whole_power(b, int(n))


def _whole_power(base: Field, n: int) -> Field:
    if n == 0:
        return constant(1.0)
    if n == 1:
        return base
    half = square(_whole_power(base, n // 2))
    return half * base if n % 2 else half


def minimum_of(fields: Sequence[FieldLike]) -> Field:
    """The smallest of several, as a balanced tree."""
    return _fold(minimum, fields)


def maximum_of(fields: Sequence[FieldLike]) -> Field:
    """The largest of several, as a balanced tree."""
    return _fold(maximum, fields)


def _fold(function: Callable[[Any, Any], Field], fields: Sequence[FieldLike]) -> Field:
    level = [_lift(f) for f in fields]
    while len(level) > 1:
        level = [function(*level[i : i + 2]) if i + 1 < len(level) else level[i] for i in range(0, len(level), 2)]
    return level[0]


UFUNCS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: _make("add", (_lift(a), _lift(b))),
    "subtract": lambda a, b: _make("subtract", (_lift(a), _lift(b))),
    "multiply": lambda a, b: _make("multiply", (_lift(a), _lift(b))),
    "divide": lambda a, b: _make("divide", (_lift(a), _lift(b))),
    "true_divide": lambda a, b: _make("divide", (_lift(a), _lift(b))),
    "floor_divide": lambda a, b: floor(_lift(a) / b),
    "negative": lambda a: -a,
    "positive": lambda a: a,
    "absolute": abs,
    "fabs": abs,
    "less": lambda a, b: _make("less", (_lift(a), _lift(b))),
    "greater": lambda a, b: _make("less", (_lift(b), _lift(a))),
    "less_equal": lambda a, b: _make("less_equal", (_lift(a), _lift(b))),
    "greater_equal": lambda a, b: _make("less_equal", (_lift(b), _lift(a))),
    "logical_and": lambda a, b: minimum(a, b),
    "logical_or": lambda a, b: maximum(a, b),
    "logical_not": lambda a: 1.0 - a,
    "remainder": mod,
    "mod": mod,
    "power": power,
    "float_power": power,
    "sqrt": sqrt,
    "square": square,
    "reciprocal": lambda a: 1.0 / a,
    "exp": exp,
    "log": log,
    "sin": sin,
    "cos": cos,
    "tan": tan,
    "arctan": arctan,
    "arctan2": arctan2,
    "hypot": hypot,
    "floor": floor,
    "minimum": minimum,
    "maximum": maximum,
    "fmin": minimum,
    "fmax": maximum,
    "sign": sign,
    "tanh": tanh,
    "clip": clip,
    "deg2rad": lambda a: a * (math.pi / 180.0),
    "radians": lambda a: a * (math.pi / 180.0),
}
"""What `Field.__array_ufunc__` knows, by the name of the ufunc."""
