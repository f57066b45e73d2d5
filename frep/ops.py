"""The operation table: one row an operation, from which every evaluator is made.

A row gives the arity and three rules, each written once:

- `value`: the scalar result. It is the definition; it folds constants and is compiled into the block and point evaluators.
- `interval`: bounds of the result from bounds of the arguments (`lo, hi` pairs, flattened). It must enclose.
- `partials`: the partial derivatives as expressions in the result and the arguments. They are written with operators and
  numpy functions, so that they build Fields when the arguments are Fields.

`exact` says that the result is not rounded, so that its interval needs no widening. `fast32`, where given, is a float32 form
that LLVM can vectorise (numba wheels carry no vector maths library). Everything else users call (`tan`, `hypot`, `clip`,
`tanh`, powers ...) is composed from these rows in `frep/functions.py`.

The functions here are compiled by `frep/evaluate.py`; they may use only scalar arithmetic, `math` and numpy functions that
numba knows. Adding an operation means adding a row, and a line in `frep/functions.py` if users shall call it by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .jit import kernel

_INF = math.inf
_PI = math.pi
_HALF_PI = 0.5 * math.pi
_TWO_PI = 2.0 * math.pi


@dataclass(frozen=True)
class Operation:
    """One row of the table. See the module documentation for the meaning of the rules."""

    name: str
    arity: int
    value: Callable
    interval: Callable
    partials: Callable
    fast32: Callable | None = None
    exact: bool = False
    commutative: bool = False


OPERATIONS: dict[str, Operation] = {}
"""Every operation by name, in the order of their codes."""


def _row(name: str, arity: int, value, interval, partials, fast32=None, exact=False, commutative=False) -> None:
    OPERATIONS[name] = Operation(name, arity, value, interval, partials, fast32, exact, commutative)


# --- arithmetic ------------------------------------------------------------------------------------------------------


def _add(a, b):
    return a + b


def _add_interval(al, ah, bl, bh):
    return al + bl, ah + bh


def _subtract(a, b):
    return a - b


def _subtract_interval(al, ah, bl, bh):
    return al - bh, ah - bl


def _multiply(a, b):
    return a * b


def _multiply_interval(al, ah, bl, bh):
    p, q, r, s = al * bl, al * bh, ah * bl, ah * bh
    # 0 * inf is NaN in floating point but 0 here: an unbounded factor may still meet an exact zero.
    p = 0.0 if p != p else p
    q = 0.0 if q != q else q
    r = 0.0 if r != r else r
    s = 0.0 if s != s else s
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


def _divide(a, b):
    return a / b


def _divide_interval(al, ah, bl, bh):
    if bl <= 0.0 and bh >= 0.0:
        return -_INF, _INF
    p, q, r, s = al / bl, al / bh, ah / bl, ah / bh
    if p != p or q != q or r != r or s != s:
        return -_INF, _INF
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


def _negative(a):
    return -a


def _negative_interval(al, ah):
    return -ah, -al


_row("add", 2, _add, _add_interval, lambda f, a, b: (1.0, 1.0), commutative=True)
_row("subtract", 2, _subtract, _subtract_interval, lambda f, a, b: (1.0, -1.0))
_row("multiply", 2, _multiply, _multiply_interval, lambda f, a, b: (b, a), commutative=True)
_row("divide", 2, _divide, _divide_interval, lambda f, a, b: (1.0 / b, -f / b))
_row("negative", 1, _negative, _negative_interval, lambda f, a: (-1.0,), exact=True)


# --- choice ----------------------------------------------------------------------------------------------------------


def _minimum(a, b):
    # Written so that a NaN in either argument survives.
    return a if (a < b or a != a) else b


def _minimum_interval(al, ah, bl, bh):
    return min(al, bl), min(ah, bh)


def _maximum(a, b):
    return a if (a > b or a != a) else b


def _maximum_interval(al, ah, bl, bh):
    return max(al, bl), max(ah, bh)


def _absolute(a):
    return abs(a)


def _absolute_interval(al, ah):
    if al >= 0.0:
        return al, ah
    if ah <= 0.0:
        return -ah, -al
    return 0.0, max(-al, ah)


def _less(a, b):
    return 1.0 if a < b else 0.0


def _less_interval(al, ah, bl, bh):
    return (1.0 if ah < bl else 0.0), (1.0 if al < bh else 0.0)


def _less_equal(a, b):
    return 1.0 if a <= b else 0.0


def _less_equal_interval(al, ah, bl, bh):
    return (1.0 if ah <= bl else 0.0), (1.0 if al <= bh else 0.0)


def _where(c, a, b):
    return a if c != 0.0 else b


def _where_interval(cl, ch, al, ah, bl, bh):
    if cl > 0.0 or ch < 0.0:
        return al, ah
    if cl == 0.0 and ch == 0.0:
        return bl, bh
    return min(al, bl), max(ah, bh)


_row("minimum", 2, _minimum, _minimum_interval, lambda f, a, b: (a <= b, b < a), commutative=True, exact=True)
_row("maximum", 2, _maximum, _maximum_interval, lambda f, a, b: (a >= b, b > a), commutative=True, exact=True)
_row("absolute", 1, _absolute, _absolute_interval, lambda f, a: (np.where(a < 0.0, -1.0, 1.0),), exact=True)
_row("less", 2, _less, _less_interval, lambda f, a, b: (0.0, 0.0), exact=True)
_row("less_equal", 2, _less_equal, _less_equal_interval, lambda f, a, b: (0.0, 0.0), exact=True)
_row(
    "where",
    3,
    _where,
    _where_interval,
    lambda f, c, a, b: (0.0, np.where(c, 1.0, 0.0), np.where(c, 0.0, 1.0)),
    exact=True,
)


# --- powers, exponentials ----------------------------------------------------------------------------------------------


def _square(a):
    return a * a


def _square_interval(al, ah):
    if al >= 0.0:
        return al * al, ah * ah
    if ah <= 0.0:
        return ah * ah, al * al
    m = max(-al, ah)
    return 0.0, m * m


def _sqrt(a):
    return np.sqrt(a)


def _sqrt_interval(al, ah):
    if ah < 0.0:
        # No value anywhere is a number: nothing is known, so that the NaN is met by whoever samples, not culled.
        return -_INF, _INF
    return np.sqrt(max(al, 0.0)), np.sqrt(max(ah, 0.0))


def _exp(a):
    return np.exp(a)


def _exp_interval(al, ah):
    # libm's exp is monotone to within an ulp; the evaluator rounds outward by more than that.
    return np.exp(al), np.exp(ah)


def _exp32(a):
    # 2^k * e^r, |r| <= ln(2)/2, Taylor to degree 6 (relative error 2e-7); clamped where float32 ends.
    x = min(max(a, np.float32(-87.0)), np.float32(88.0))
    k = np.floor(x * np.float32(1.4426950408889634) + np.float32(0.5))
    r = (x - k * np.float32(0.693359375)) + k * np.float32(2.12194440e-4)
    p = np.float32(1.0 / 720.0)
    p = p * r + np.float32(1.0 / 120.0)
    p = p * r + np.float32(1.0 / 24.0)
    p = p * r + np.float32(1.0 / 6.0)
    p = p * r + np.float32(0.5)
    p = p * r + np.float32(1.0)
    p = p * r + np.float32(1.0)
    e = p * np.int32((np.int32(k) + np.int32(127)) << np.int32(23)).view(np.float32)
    return a if a != a else e


def _log(a):
    return np.log(a)


def _log_interval(al, ah):
    if ah < 0.0:
        return -_INF, _INF
    return (np.log(al) if al > 0.0 else -_INF), (np.log(ah) if ah > 0.0 else -_INF)


_row("square", 1, _square, _square_interval, lambda f, a: (2.0 * a,))
# The cone tip of a distance has no gradient; the guard, a float32, gives zero there instead of NaN.
_row("sqrt", 1, _sqrt, _sqrt_interval, lambda f, a: (0.5 / np.maximum(f, 1e-30),))
_row("exp", 1, _exp, _exp_interval, lambda f, a: (f,), fast32=_exp32)
_row("log", 1, _log, _log_interval, lambda f, a: (1.0 / a,))


# --- angles ------------------------------------------------------------------------------------------------------------


def _sin(a):
    return np.sin(a)


def _cos(a):
    return np.cos(a)


@kernel
def _cosine_bounds(al, ah):
    if not (ah - al < _TWO_PI):
        return -1.0, 1.0
    # Turns that have a crest (even multiples of pi) or a trough (odd ones) inside.
    u, v = np.cos(al), np.cos(ah)
    lo, hi = min(u, v), max(u, v)
    if np.floor(ah / _TWO_PI) > np.floor(al / _TWO_PI):
        hi = 1.0
    if np.floor((ah - _PI) / _TWO_PI) > np.floor((al - _PI) / _TWO_PI):
        lo = -1.0
    # Rounding of the quarter turns must not lose a crest that lies on an end.
    return max(lo - 1e-15 * max(1.0, abs(al)), -1.0), min(hi + 1e-15 * max(1.0, abs(ah)), 1.0)


def _cos_interval(al, ah):
    return _cosine_bounds(al, ah)


def _sin_interval(al, ah):
    return _cosine_bounds(al - _HALF_PI, ah - _HALF_PI)


@kernel
def _sin_reduced32(r, k):
    # Odd minimax polynomial on [-pi/2, pi/2] (error 3e-8), sign from the parity of k half turns.
    s = r * r
    p = np.float32(2.6083159809786593e-06)
    p = p * s + np.float32(-1.981069071916863e-04)
    p = p * s + np.float32(8.333078585565090e-03)
    p = p * s + np.float32(-1.666665971279144e-01)
    parity = k - np.float32(2.0) * np.floor(k * np.float32(0.5))
    v = (r + r * s * p) * (np.float32(1.0) - np.float32(2.0) * parity)
    # Where the argument is too large to be reduced the phase is lost, but never the range; NaN survives.
    v = np.float32(1.0) if v > np.float32(1.0) else v
    return np.float32(-1.0) if v < np.float32(-1.0) else v


@kernel
def _reduce32(a, k):
    # a - k pi in three parts (Cody and Waite), exact to float32 for |a| below about 1e5.
    r = a - k * np.float32(3.140625)
    r = r - k * np.float32(9.67502593994140625e-04)
    return r - k * np.float32(1.509957990978376432e-07)


def _sin32(a):
    k = np.floor(a * np.float32(0.3183098861837907) + np.float32(0.5))
    return _sin_reduced32(_reduce32(a, k), k)


def _cos32(a):
    # cos a = sin(a + pi/2): reduce by half-odd multiples so that nothing is added to a.
    k = np.floor(a * np.float32(0.3183098861837907)) + np.float32(0.5)
    return _sin_reduced32(_reduce32(a, k), k + np.float32(0.5))


def _arctan2(a, b):
    return np.arctan2(a, b)


def _arctan2_interval(al, ah, bl, bh):
    if bl <= 0.0 and al <= 0.0 and ah >= 0.0:
        return -_PI, _PI
    # The box does not meet the cut (negative b-axis) or the origin: the extremes are at its corners.
    p, q, r, s = np.arctan2(al, bl), np.arctan2(al, bh), np.arctan2(ah, bl), np.arctan2(ah, bh)
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


def _arctan2_32(a, b):
    x, y = abs(b), abs(a)
    big, small = max(x, y), min(x, y)
    t = small / (big if big > np.float32(0.0) else np.float32(1.0))
    t = np.float32(1.0) if small == np.float32(_INF) else t
    # arctan on [0, 1] by an odd minimax polynomial (error 2e-7).
    s = t * t
    p = np.float32(2.82363896258175373077393e-03)
    p = p * s + np.float32(-1.59569028764963150024414e-02)
    p = p * s + np.float32(4.25049886107444763183594e-02)
    p = p * s + np.float32(-7.48900920152664184570312e-02)
    p = p * s + np.float32(1.06347933411598205566406e-01)
    p = p * s + np.float32(-1.42027363181114196777344e-01)
    p = p * s + np.float32(1.99926957488059997558594e-01)
    p = p * s + np.float32(-3.33331018686294555664062e-01)
    r = t + t * s * p
    r = np.float32(1.5707963267948966) - r if y > x else r
    r = np.float32(3.141592653589793) - r if b < np.float32(0.0) else r
    r = -r if a < np.float32(0.0) else r
    return a + b if (a != a or b != b) else r


_row("sin", 1, _sin, _sin_interval, lambda f, a: (np.cos(a),), fast32=_sin32)
_row("cos", 1, _cos, _cos_interval, lambda f, a: (-np.sin(a),), fast32=_cos32)
_row(
    "arctan2",
    2,
    _arctan2,
    _arctan2_interval,
    lambda f, a, b: (b / (a * a + b * b), -a / (a * a + b * b)),
    fast32=_arctan2_32,
)


# --- steps -------------------------------------------------------------------------------------------------------------


def _floor(a):
    return np.floor(a)


def _floor_interval(al, ah):
    return np.floor(al), np.floor(ah)


def _mod(a, b):
    r = a - b * np.floor(a / b)
    # Rounding of a / b may leave r an ulp of a below 0 or above b; NaN passes both tests.
    zero = b - b  # of b's type
    low, high = (b, zero) if b < zero else (zero, b)
    r = low if r < low else r
    return high if r > high else r


def _mod_interval(al, ah, bl, bh):
    if bl == bh and bl != 0.0 and np.floor(al / bl) == np.floor(ah / bl):
        n = bl * np.floor(al / bl)
        size = abs(al) + abs(ah) + abs(bl)
        # In the float32 evaluators a sample on a period's edge may fold to either side.
        if al - n > 1e-6 * size and abs(bl) - (ah - n) > 1e-6 * size:
            # The product n may be fused or rounded: the error is relative to the argument, not to the remainder.
            return al - n - 1e-15 * size, ah - n + 1e-15 * size
    return min(bl, 0.0), max(bh, 0.0)


_row("floor", 1, _floor, _floor_interval, lambda f, a: (0.0,), exact=True)
_row("mod", 2, _mod, _mod_interval, lambda f, a, b: (1.0, -np.floor(a / b)))
