"""Fields: symbolic scalar expressions of position, the one language in which everything is composed.

A `Field` is a node of an immutable, hash-consed expression graph over the coordinates `x, y, z` (mm). Python operators and
numpy ufuncs build it, so an ordinary function `lambda x, y, z: 0.1 + abs(0.025 * x)` is traced, not called per point; a
function that cannot be traced becomes a foreign leaf that is called in batches. Nothing is evaluated until numbers are
asked for: `field(points)`, `field.bounds(lo, hi)`, `field.gradient(points)`, or a solid is sampled.
"""

from __future__ import annotations

import hashlib
import math
import numbers
import struct
import threading
import weakref
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np

from .errors import ArgumentError, ArgumentTypeError
from .ops import OPERATIONS

FieldLike: TypeAlias = "Field | float | int | Callable[..., Any]"
"""What is accepted where a Field is expected: a Field, a number, or a function of `(x, y, z)`."""


_nodes: weakref.WeakValueDictionary[bytes, Field] = weakref.WeakValueDictionary()
_nodes_lock = threading.Lock()


class Field:
    """A symbolic scalar function of position. Immutable; equal expressions are the same object.

    Build Fields from `coordinates()`, numbers, operators, numpy functions (`np.sin(x)`, `np.hypot(x, y)`) and the functions
    of `frep.functions`; or trace a function with `as_field`. Comparisons give Fields that are 1 where true and 0 elsewhere, for
    use in `where`. A Field has no truth value: a function with `if x < 0` cannot be traced and becomes a foreign leaf, which
    works, but slowly and without bounds; write `where(x < 0, a, b)`.

    Example:
        >>> import numpy as np, frep
        >>> x, y, z = frep.coordinates()
        >>> f = frep.sqrt(x**2 + y**2 + z**2) - 5
        >>> f
        sqrt(x**2 + y**2 + z**2) - 5
        >>> f([[3, 4, 0], [0, 0, 0]])
        array([ 0., -5.])
        >>> round(f.bounds((0, 0, 0), (1, 1, 1))[0], 9)
        -5.0
    """

    __slots__ = ("__weakref__", "args", "axes", "data", "has_data", "key", "op")

    op: str
    args: tuple[Field, ...]
    data: Any
    key: bytes
    axes: frozenset[int]
    has_data: bool

    __array_priority__ = 1000.0

    def __new__(cls, op: str, args: tuple[Field, ...] = (), data: Any = None) -> Field:
        key = _content_key(op, args, data)
        with _nodes_lock:
            node = _nodes.get(key)
            if node is None:
                node = object.__new__(cls)
                set_ = object.__setattr__
                set_(node, "op", op)
                set_(node, "args", args)
                set_(node, "data", data)
                set_(node, "key", key)
                own = frozenset((data,)) if op == "coordinate" else frozenset()
                set_(node, "axes", own.union(*(a.axes for a in args)))
                leaf = op not in OPERATIONS and op not in ("constant", "coordinate")
                set_(node, "has_data", leaf or any(a.has_data for a in args))
                _nodes[key] = node
            return node

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError("a Field is immutable")

    def __reduce__(self):
        order = topological([self])
        number = {node: i for i, node in enumerate(order)}
        rows = [(node.op, tuple(number[a] for a in node.args), node.data) for node in order]
        return _rebuild, (rows,)

    def __hash__(self) -> int:
        return int.from_bytes(self.key[:8], "little", signed=True)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, numbers.Real):
            raise ArgumentTypeError(
                f"{self!r} == {other}: Fields are compared with < and >, which differ from place to place; == tells whether two "
                "Fields are the same expression"
            )
        return self is other

    # --- numbers ---------------------------------------------------------------------------------------------------

    def __call__(self, points) -> np.ndarray:
        """Values at an (n, 3) array of points in mm: (n,) float64; at one point (3,): a float.

        Raises:
            ArgumentError: points of another shape.
            FunctionError: a user function inside raised, or returned NaN or the wrong shape.
        """
        from .evaluate import values_at

        pts, single = _points(points)
        out = values_at((self,), pts)[0]
        return out[0] if single else out

    def bounds(self, lo, hi):
        """Numbers `(lowest, highest)` that enclose every value in the box from `lo` to `hi`.

        `lo`, `hi` are (3,) for one box (floats come back) or (n, 3) for many ((n,) arrays come back). The enclosure is
        guaranteed, not tight. Raises `ArgumentError` where `lo > hi` or a corner is NaN.
        """
        from .evaluate import bounds_over

        try:
            low, high = np.broadcast_arrays(np.asarray(lo, float), np.asarray(hi, float))
        except TypeError as error:
            raise ArgumentTypeError(f"lo, hi: expected corners in mm, got {lo!r} and {hi!r}") from error
        except ValueError as error:
            raise ArgumentError(
                f"lo, hi: expected two shapes (3,) or (n, 3) of numbers, got {lo!r} and {hi!r}"
            ) from error
        single = low.ndim == 1
        low, high = np.atleast_2d(low), np.atleast_2d(high)
        if low.shape[1:] != (3,):
            raise ArgumentError(f"lo, hi: expected shape (3,) or (n, 3), got {np.shape(lo)} and {np.shape(hi)}")
        if not np.all(low <= high):
            raise ArgumentError(f"lo, hi: every lo must be <= hi and not NaN, got lo={lo!r}, hi={hi!r}")
        least, most = bounds_over(self, low, high)
        return (float(least[0]), float(most[0])) if single else (least, most)

    def gradient(self, points) -> np.ndarray:
        """Gradient at an (n, 3) array of points: (n, 3) float64; at one point: (3,).

        Exact derivatives of the expression; leaves with data (beams, sampled grids, foreign functions) are differenced
        centrally. At a crease of `minimum`, `maximum` or `abs` the gradient of one of the branches is returned.
        """
        from .evaluate import values_at

        pts, single = _points(points)
        out = np.ascontiguousarray(values_at(self.derivatives(), pts).T)
        return out[0] if single else out

    def derivatives(self) -> tuple[Field, Field, Field]:
        """The three partial derivatives with respect to x, y, z as Fields (forward mode, shared subexpressions)."""
        from .derivative import derivatives

        return derivatives(self)

    # --- substitution ------------------------------------------------------------------------------------------------

    def substitute(self, x: FieldLike, y: FieldLike, z: FieldLike) -> Field:
        """The same expression with `x, y, z` replaced: the mechanism of every transform and coordinate map.

        `f.substitute(X, Y, Z)(p) == f((X(p), Y(p), Z(p)))` for all points p.
        """
        new = (as_field(x), as_field(y), as_field(z))
        done: dict[Field, Field] = {}
        for node in topological([self]):
            if node.op == "coordinate":
                done[node] = new[node.data]
            elif not node.axes:
                done[node] = node
            else:
                done[node] = _make(node.op, tuple(done[a] for a in node.args), node.data)
        return done[self]

    # --- operators ---------------------------------------------------------------------------------------------------

    def __add__(self, other):
        return _binary("add", self, other)

    def __radd__(self, other):
        return _binary("add", other, self)

    def __sub__(self, other):
        return _binary("subtract", self, other)

    def __rsub__(self, other):
        return _binary("subtract", other, self)

    def __mul__(self, other):
        return _binary("multiply", self, other)

    def __rmul__(self, other):
        return _binary("multiply", other, self)

    def __truediv__(self, other):
        return _binary("divide", self, other)

    def __rtruediv__(self, other):
        return _binary("divide", other, self)

    def __mod__(self, other):
        return _binary("mod", self, other)

    def __rmod__(self, other):
        return _binary("mod", other, self)

    def __floordiv__(self, other):
        ratio = _binary("divide", self, other)
        return ratio if ratio is NotImplemented else _make("floor", (ratio,))

    def __rfloordiv__(self, other):
        ratio = _binary("divide", other, self)
        return ratio if ratio is NotImplemented else _make("floor", (ratio,))

    def __pow__(self, exponent):
        from .functions import power

        return power(self, exponent)

    def __rpow__(self, base):
        from .functions import power

        return power(base, self)

    def __neg__(self):
        return _make("negative", (self,))

    def __pos__(self):
        return self

    def __abs__(self):
        return _make("absolute", (self,))

    def __lt__(self, other):
        return _binary("less", self, other)

    def __gt__(self, other):
        return _binary("less", other, self)

    def __le__(self, other):
        return _binary("less_equal", self, other)

    def __ge__(self, other):
        return _binary("less_equal", other, self)

    def __and__(self, other):
        return _make("minimum", (self, _lift(other)))

    def __or__(self, other):
        return _make("maximum", (self, _lift(other)))

    def __invert__(self):
        return 1.0 - self

    def clip(self, lower=None, upper=None, **_ignored) -> Field:
        """`clip(self, lower, upper)`; also what `numpy.clip` calls."""
        from .functions import clip

        return clip(self, lower, upper)

    def __bool__(self) -> bool:
        raise ArgumentTypeError(
            "a Field has no truth value, because it differs from place to place; write where(condition, a, b) instead of "
            "`if`, `and`, `or`, min() or max()"
        )

    def __float__(self) -> float:
        if self.op == "constant":
            return self.data
        raise ArgumentTypeError(
            f"expected a number, got the Field {self!r}; use frep functions or numpy ufuncs, not math ones"
        )

    def __len__(self):
        raise TypeError("a Field is a scalar and has no len()")

    def __iter__(self):
        raise TypeError("a Field is a scalar and cannot be iterated")

    def __array__(self, *args, **kwargs):
        raise ArgumentTypeError(f"the Field {self!r} cannot become an array; evaluate it at points: field(points)")

    # --- numpy -------------------------------------------------------------------------------------------------------

    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
        from .functions import UFUNCS

        function = UFUNCS.get(ufunc.__name__)
        if method != "__call__" or kwargs or function is None:
            raise ArgumentTypeError(
                f"numpy.{ufunc.__name__} cannot be applied to a Field{' in this form' if function else ''}; "
                f"known are {', '.join(sorted(UFUNCS))}; for anything else use frep.foreign"
            )
        return function(*(_scalar(i) for i in inputs))

    def __array_function__(self, function, types, args, kwargs):
        from .functions import clip, where

        if function is np.where and not kwargs:
            return where(*args)
        if function is np.clip:
            lower = kwargs.get("a_min", kwargs.get("min"))
            upper = kwargs.get("a_max", kwargs.get("max"))
            return clip(args[0], *args[1:3]) if len(args) > 1 else clip(args[0], lower, upper)
        return NotImplemented

    # --- text --------------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        from .printing import expression_text

        return expression_text(self)

    @property
    def is_constant(self) -> bool:
        """True where the expression has been folded to one number."""
        return self.op == "constant"


def _rebuild(rows) -> Field:
    nodes: list[Field] = []
    for op, args, data in rows:
        nodes.append(Field(op, tuple(nodes[i] for i in args), data))
    return nodes[-1]


def _content_key(op: str, args: tuple[Field, ...], data: Any) -> bytes:
    h = hashlib.blake2b(op.encode(), digest_size=16)
    for a in args:
        h.update(a.key)
    if op == "constant":
        h.update(struct.pack("<d", data))
    elif op == "coordinate":
        h.update(bytes((data,)))
    elif data is not None:
        h.update(data.content_key)
    return h.digest()


def _points(points, name: str = "points") -> tuple[np.ndarray, bool]:
    """(n, 3) float64, contiguous, and whether a single point (3,) was given."""
    try:
        pts = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentTypeError(f"{name}: expected an (n, 3) array of numbers, got {type(points).__name__}") from error
    if pts.ndim not in (1, 2) or pts.shape[-1] != 3:
        raise ArgumentError(f"{name}: expected shape (3,) or (n, 3), got {pts.shape}")
    return np.ascontiguousarray(np.atleast_2d(pts)), pts.ndim == 1


def topological(roots: Iterable[Field]) -> list[Field]:
    """Every node below the roots, arguments before users. Iterative: graphs may be deeper than Python's stack."""
    order: list[Field] = []
    seen: set[Field] = set()
    for root in roots:
        stack: list[tuple[Field, bool]] = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if ready:
                order.append(node)
            elif node not in seen:
                seen.add(node)
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args) if a not in seen)
    return order


# --- construction ----------------------------------------------------------------------------------------------------


def constant(value: float) -> Field:
    """A Field that is the same number everywhere."""
    return Field("constant", (), float(value) + 0.0)


_AXES = (Field("coordinate", (), 0), Field("coordinate", (), 1), Field("coordinate", (), 2))


def coordinates() -> tuple[Field, Field, Field]:
    """The Fields `x, y, z`: position in mm.

    Example:
        >>> x, y, z = coordinates()
        >>> 2 * x + 1
        2*x + 1
    """
    return _AXES


def _scalar(value: Any) -> Any:
    """A Field, or a float from any real number (including 0-d arrays)."""
    if isinstance(value, Field):
        return value
    if isinstance(value, (numbers.Real, np.bool_)):
        try:
            return float(value)
        except OverflowError:
            return -math.inf if value < 0 else math.inf
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return float(value)
    raise ArgumentTypeError(f"expected a Field or a number, got {type(value).__name__}: {value!r}")


def _lift(value: Any) -> Field:
    value = _scalar(value)
    return value if isinstance(value, Field) else constant(value)


def _binary(op: str, a: Any, b: Any):
    try:
        return _make(op, (_lift(a), _lift(b)))
    except ArgumentTypeError:
        return NotImplemented


def _is(field: Field, value: float) -> bool:
    return field.op == "constant" and field.data == value


def _make(op: str, args: tuple[Field, ...], data: Any = None) -> Field:
    """A node, simplified where an identity holds for every finite number (constants folded, neutral elements dropped)."""
    row = OPERATIONS.get(op)
    if row is None:
        return Field(op, args, data)
    if all(a.op == "constant" for a in args):
        with np.errstate(all="ignore"):
            return constant(row.value(*(np.float64(a.data) for a in args)))
    a = args[0]
    b = args[-1]
    match op:
        case "add":
            if _is(a, 0.0):
                return b
            if _is(b, 0.0):
                return a
        case "subtract":
            if _is(b, 0.0):
                return a
            if _is(a, 0.0):
                return _make("negative", (b,))
            if a is b:
                return constant(0.0)
        case "multiply":
            if _is(a, 1.0):
                return b
            if _is(b, 1.0):
                return a
            if _is(a, 0.0) or _is(b, 0.0):
                return constant(0.0)
            if _is(a, -1.0):
                return _make("negative", (b,))
            if _is(b, -1.0):
                return _make("negative", (a,))
            if a is b:
                return _make("square", (a,))
        case "divide":
            if b.op == "constant" and b.data != 0.0:
                return _make("multiply", (a, constant(1.0 / b.data))) if _exact_reciprocal(b.data) else Field(op, args)
            if _is(a, 0.0):
                return constant(0.0)
        case "negative":
            if a.op == "negative":
                return a.args[0]
        case "minimum" | "maximum":
            if a is b:
                return a
        case "absolute":
            if a.op in ("absolute", "square", "sqrt"):
                return a
        case "where":
            _, chosen, other = args
            if a.op == "constant":
                return chosen if a.data != 0.0 else other
            if chosen is other:
                return chosen
    if row.commutative:
        # One order for a constant: 2*x, but x + 2.
        late, early = (a, b) if op == "multiply" else (b, a)
        if early.op == "constant" and late.op != "constant":
            args = (b, a)
    return Field(op, args, data)


def _exact_reciprocal(value: float) -> bool:
    return math.frexp(value)[0] in (0.5, -0.5) and 1e-300 < abs(value) < 1e300


def as_field(value: FieldLike, name: str = "value") -> Field:
    """A Field from a Field, a number, or a function of `(x, y, z)`, which is traced where it can be.

    A function that cannot be traced (it branches with `if`, calls a library, looks up a table) becomes a foreign leaf, see
    `foreign`. `name` is the argument's name for the error message.

    Raises:
        ArgumentTypeError: neither a Field, nor a number, nor a callable.
        ArgumentError: a number that is not finite.
    """
    if isinstance(value, Field):
        return value
    if callable(value):
        return trace(value)
    try:
        number = _scalar(value)
    except ArgumentTypeError:
        raise ArgumentTypeError(
            f"{name}: expected a number, a Field or a function of (x, y, z), got {type(value).__name__}: {value!r}"
        ) from None
    if not math.isfinite(number):
        raise ArgumentError(f"{name}: expected a finite number, got {number}")
    return constant(number)


def trace(function: Callable[..., Any]) -> Field:
    """Call `function` once with the coordinate Fields and return the expression it builds; else a foreign leaf.

    Raises:
        FunctionError: the function fails when called with arrays as well.
    """
    try:
        result = _lift(function(*_AXES))
        if not any(n.op == "constant" and math.isnan(n.data) for n in topological([result])):
            return result
    except Exception:
        pass
    # Not traceable (a branch, a math function, a library call), or NaN somewhere, which a foreign leaf names when it comes to
    # that: call it with arrays, in batches.
    return foreign(function)


def foreign(function: Callable[..., Any], *, lipschitz: float | None = None, name: str | None = None) -> Field:
    """A Field that calls a Python function in batches.

    Args:
        function: called as `function(x, y, z)` with three float64 arrays of one shape (n,); returns (n,) finite numbers. Where
            that raises a ValueError or TypeError it is called point by point with three floats.
        lipschitz: a bound on the change of the value for each mm, if known. With it, regions without surface are skipped;
            without it, every voxel in the solid's bounds is evaluated.
        name: shown by `repr` and in errors; the function's name unless given.

    Raises:
        ArgumentError: `lipschitz` negative or not finite.
        FunctionError: a first call with a few points raises, or returns NaN or the wrong shape.

    Example:
        >>> import numpy as np
        >>> table = np.linspace(1, 2, 11)
        >>> f = foreign(lambda x, y, z: np.interp(x, np.arange(11), table), lipschitz=0.1)
        >>> f([[5, 0, 0]])
        array([1.5])
    """
    from .foreign_leaf import Foreign

    if not callable(function):
        raise ArgumentTypeError(f"function: expected a callable, got {type(function).__name__}")
    if lipschitz is not None and not isinstance(lipschitz, numbers.Real):
        raise ArgumentTypeError(f"lipschitz: expected a number or None, got {type(lipschitz).__name__}: {lipschitz!r}")
    if lipschitz is not None and not (math.isfinite(lipschitz) and lipschitz >= 0):
        raise ArgumentError(f"lipschitz: expected a finite number >= 0, got {lipschitz!r}")
    leaf = Foreign(function, lipschitz, name or getattr(function, "__name__", type(function).__name__))
    leaf.call(np.zeros((2, 3)))
    return Field("foreign", _AXES, leaf)


def leaf_field(op: str, leaf: Any, *parameters: Field) -> Field:
    """A Field of a data leaf (beams, a sampled grid) at `(x, y, z)` with further argument Fields.

    For the kernel's own modules. The leaf has `content_key` (bytes; equal keys mean equal data), `name` (shown by `repr`) and
    `pack` (see `frep/packing.py`).
    """
    return Field(op, (*_AXES, *parameters), leaf)
