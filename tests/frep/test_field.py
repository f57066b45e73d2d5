"""Fields: what users write means what numpy means; functions are traced or called in batches; nonsense is refused."""

from __future__ import annotations

import copy
import importlib
import itertools
import math
import pickle
import pkgutil
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import frep
from frep import ArgumentError, ArgumentTypeError, Field, FrepError, FunctionError, coordinates
from frep.field import constant, topological
from frep.functions import maximum_of, minimum_of

x, y, z = coordinates()

PAIRS = st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=1, max_size=30)


def points_of(pairs) -> np.ndarray:
    return np.array([(a, b, 0.5) for a, b in pairs])


def random_points(n: int, low: float = -5.0, high: float = 5.0, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(low, high, (n, 3))


# --- the same as numpy -------------------------------------------------------------------------------------------------

UNARY = {
    "sqrt": np.sqrt,
    "square": np.square,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "arctan": np.arctan,
    "floor": np.floor,
    "sign": np.sign,
    "tanh": np.tanh,
}
BINARY = {
    "arctan2": np.arctan2,
    "hypot": np.hypot,
    "mod": np.mod,
    "minimum": np.minimum,
    "maximum": np.maximum,
}


@pytest.mark.parametrize("name", UNARY)
@given(pairs=PAIRS)
def test_functions_of_one_argument_are_numpys(name, pairs):
    points = points_of(pairs)
    a = points[:, 0]
    with np.errstate(all="ignore"):
        want = UNARY[name](a)
    # tan is a quotient: near a pole the error of cos is magnified.
    scale = 1 + np.tan(a) ** 2 if name == "tan" else np.maximum(np.abs(want), 1.0)
    got = getattr(frep, name)(x)(points)
    number = np.isfinite(want)
    assert np.all(np.abs(got[number] - want[number]) <= 1e-14 * scale[number])
    assert np.array_equal(got[~number], want[~number], equal_nan=True)


@pytest.mark.parametrize("name", BINARY)
@given(pairs=PAIRS)
def test_functions_of_two_arguments_are_numpys(name, pairs):
    points = points_of(pairs) + 0.0
    a, b = points[:, 0], points[:, 1]
    got = getattr(frep, name)(x, y)(points)
    with np.errstate(all="ignore"):
        want = BINARY[name](a, b)
    if name == "mod":
        held = np.isfinite(want) & (np.abs(a) < 1e9 * np.abs(b))
        # On the edge of a period, 0 and b are the same remainder.
        error = np.abs(got - want)[held]
        error = np.minimum(error, np.abs(np.abs(b[held]) - error))
        assert np.all(error <= 1e-15 * (np.abs(a) + np.abs(b))[held])
    elif name == "arctan2":
        # At a zero the sign of zero may show.
        assert np.allclose(np.exp(1j * got), np.exp(1j * want), rtol=0, atol=1e-14)
    else:
        assert np.allclose(got, want, rtol=1e-14, atol=1e-150)


@pytest.mark.parametrize("exponent", [0, 1, 2, 3, 5, 8, 17, 65, 101, -1, -2, -3, 0.5, -0.5, 1.5, 1 / 3, 2.5])
def test_powers_of_a_number(exponent):
    a = np.array([0.25, 0.9, 1.0, 1.1, 3.0])
    if float(exponent).is_integer():
        a = np.concatenate([a, -a])
    points = np.stack([a, a * 0, a * 0], 1)
    assert np.allclose((x**exponent)(points), a**exponent, rtol=1e-13)
    assert np.power(x, exponent) is x**exponent is frep.power(x, exponent)


def test_powers_with_a_field():
    points = random_points(50, 0.1, 3.0)
    a, b = points[:, 0], points[:, 1]
    assert np.allclose((x**y)(points), a**b, rtol=1e-13)
    assert np.allclose((2**y)(points), 2.0**b, rtol=1e-13)
    assert np.allclose((np.float64(2) ** y)(points), 2.0**b, rtol=1e-13)
    assert np.allclose((x ** (-y))(points), a**-b, rtol=1e-13)


@pytest.mark.parametrize("exponent", [math.inf, -math.inf, math.nan])
def test_powers_that_are_not_finite(exponent):
    points = np.array([[0.5, 0, 0], [2.0, 0, 0]])
    assert np.array_equal((x**exponent)(points), points[:, 0] ** exponent, equal_nan=True)


@given(pairs=PAIRS, limits=st.tuples(st.floats(-5, 5), st.floats(-5, 5)).map(sorted))
def test_clip_where_sign_and_comparisons(pairs, limits):
    points = points_of(pairs)
    a, b = points[:, 0], points[:, 1]
    low, high = limits
    cases = [
        (frep.clip(x, low, high), np.clip(a, low, high)),
        (np.clip(x, low, high), np.clip(a, low, high)),
        (x.clip(low, high), np.clip(a, low, high)),
        (frep.clip(x, None, high), np.minimum(a, high)),
        (frep.clip(x, low, None), np.maximum(a, low)),
        (frep.clip(x, y, y + 1), np.clip(a, b, b + 1)),
        (frep.where(x < y, x, 2 * y), np.where(a < b, a, 2 * b)),
        (np.where(x >= low, x, y), np.where(a >= low, a, b)),
        (x < y, a < b),
        (x <= y, a <= b),
        (x > y, a > b),
        (x >= y, a >= b),
        (x < low, a < low),
        (low < x, low < a),
        (np.float64(low) < x, low < a),
        ((x < y) & (x > low), (a < b) & (a > low)),
        ((x < y) | (x > low), (a < b) | (a > low)),
        (~(x < y), ~(a < b)),
        # The definition: numpy's own differs by one where a / 3 rounds to a whole number.
        (x // 3, np.floor(a / 3)),
    ]
    for field, want in cases:
        assert np.array_equal(field(points), want.astype(float)), field


def test_operators_of_numbers_and_fields_on_either_side():
    points = random_points(40, 0.5, 4.0)
    a = points[:, 0]
    for three in (3, 3.0, np.float64(3), np.float32(3), np.int64(3), np.array(3.0), True + 2):
        cases = [
            (x + three, a + 3),
            (three + x, 3 + a),
            (x - three, a - 3),
            (three - x, 3 - a),
            (x * three, a * 3),
            (three * x, 3 * a),
            (x / three, a / 3),
            (three / x, 3 / a),
            (x % three, a % 3),
            (three % x, 3 % a),
            (x // three, a // 3),
            (three // x, 3 // a),
            (x**three, a**3),
            (three**x, 3**a),
            (-x, -a),
            (+x, a),
            (abs(x - three), abs(a - 3)),
        ]
        for field, want in cases:
            assert isinstance(field, Field)
            assert np.allclose(field(points), want, rtol=1e-13), field


SAME = [*UNARY, *BINARY, "clip", "where"]


@pytest.mark.parametrize("name", SAME)
def test_numpy_functions_build_the_same_field(name):
    arity = 1 if name in UNARY else 2 if name in BINARY else 3
    arguments = (x, y, z)[:arity]
    assert getattr(np, name)(*arguments) is getattr(frep, name)(*arguments)


@pytest.mark.parametrize(
    ("ufunc", "operator"),
    [
        (np.add, lambda a, b: a + b),
        (np.subtract, lambda a, b: a - b),
        (np.multiply, lambda a, b: a * b),
        (np.divide, lambda a, b: a / b),
        (np.floor_divide, lambda a, b: a // b),
        (np.remainder, lambda a, b: a % b),
        (np.power, lambda a, b: a**b),
        (np.less, lambda a, b: a < b),
        (np.less_equal, lambda a, b: a <= b),
        (np.greater, lambda a, b: a > b),
        (np.greater_equal, lambda a, b: a >= b),
    ],
)
def test_operators_build_the_field_of_their_ufunc(ufunc, operator):
    for a, b in [(x, y), (x, 2.0), (2.0, x), (np.float64(2), x), (x, np.float64(2))]:
        assert ufunc(a, b) is operator(a, b)


def test_unary_operators_build_the_field_of_their_ufunc():
    assert np.negative(x) is -x
    assert np.positive(x) is x
    assert np.absolute(x) is np.abs(x) is np.fabs(x) is abs(x)
    assert np.reciprocal(x) is 1 / x
    assert np.logical_not(x < 0) is ~(x < 0)
    assert np.logical_and(x < 0, y < 0) is (x < 0) & (y < 0)
    assert np.logical_or(x < 0, y < 0) is (x < 0) | (y < 0)
    assert np.radians(x) is np.deg2rad(x)
    assert np.radians(x)((180.0, 0, 0)) == pytest.approx(math.pi)


def test_the_extreme_of_many():
    fields = [x + i * y - i for i in range(7)]
    points = random_points(30)
    values = np.array([f(points) for f in fields])
    assert np.array_equal(minimum_of(fields)(points), values.min(axis=0))
    assert np.array_equal(maximum_of(fields)(points), values.max(axis=0))
    assert minimum_of([x]) is x


def test_no_module_hides_a_public_name():
    """Importing a module binds its name in the package: a public function of that name would be lost."""
    for found in pkgutil.iter_modules(frep.__path__, "frep."):
        if found.name != "frep.__main__":
            importlib.import_module(found.name)
    assert [name for name in frep.__all__ if isinstance(getattr(frep, name), ModuleType)] == []


# --- one expression, one object ----------------------------------------------------------------------------------------


def test_equal_expressions_are_one_object():
    def build():
        return frep.sqrt(x**2 + y**2) - 5 + frep.sin(3 * z) * 0.25

    assert build() is build()
    assert hash(build()) == hash(build())
    assert {build(): 1}[build()] == 1
    assert build() != build() + 1
    assert copy.deepcopy(build()) is build() is copy.copy(build())


@pytest.mark.parametrize("value", [2.0, -3.5, 0.1, 1e9, 7.25, math.pi])
def test_a_number_may_stand_on_either_side_of_what_commutes(value):
    assert x + value is value + x
    assert x * value is value * x
    assert frep.minimum(x, value) is frep.minimum(value, x)
    assert frep.maximum(x, value) is frep.maximum(value, x)
    assert x - value is not value - x


def test_identities_and_constants_fold():
    assert x + 0 is x is 0 + x is x - 0 is 1 * x is x * 1 is x / 1 is x**1
    minus_x = -x
    assert -minus_x is x
    assert 0 - x is -x is -1 * x
    assert x * x is x**2 is frep.square(x)
    assert frep.minimum(x, x) is x is frep.maximum(x, x) is frep.where(x < y, x, x)
    assert abs(abs(x)) is abs(x)
    for field, number in [
        (x - x, 0.0),
        (0 * x, 0.0),
        (x**0, 1.0),
        (constant(2) * 3 + frep.sin(constant(0.5)), 6 + math.sin(0.5)),
        (frep.where(constant(1), 3, x), 3.0),
        (frep.arctan2(1, 1), math.pi / 4),
    ]:
        assert field.is_constant
        assert float(field) == pytest.approx(number, rel=1e-15, abs=0)
    assert constant(-0.0) is constant(0.0) is constant(0)


def test_a_field_cannot_be_changed():
    with pytest.raises(AttributeError, match="immutable"):
        x.op = "sin"


def test_axes_say_on_which_coordinates_a_field_depends():
    assert frep.sin(x).axes == {0}
    assert (x * z).axes == {0, 2}
    assert constant(3).axes == frozenset()
    assert (x * z).substitute(1, 2, y).axes == {1}


# --- evaluation at points ------------------------------------------------------------------------------------------------


def test_shapes_of_points():
    field = x + 10 * y + 100 * z
    one = field((1, 2, 3))
    assert np.ndim(one) == 0
    assert one == 321
    assert field([[1, 2, 3], [0, 0, 1]]).tolist() == [321, 100]
    assert field(np.array([[1, 2, 3]], dtype=np.int32)).dtype == np.float64
    assert field(np.asfortranarray(random_points(100))).shape == (100,)
    assert field.gradient((1, 2, 3)).tolist() == [1, 10, 100]
    assert field.gradient([[1, 2, 3]]).shape == (1, 3)


@pytest.mark.parametrize("field", [x * y, constant(2.0), frep.foreign(lambda a, b, c: np.array([max(a), *a[1:]]))])
def test_no_points_give_no_values(field):
    empty = np.empty((0, 3))
    assert field(empty).shape == (0,)
    assert field.gradient(empty).shape == (0, 3)
    low, high = field.bounds(empty, empty)
    assert low.shape == high.shape == (0,)


@pytest.mark.parametrize("points", [1.0, [1, 2], [[1, 2]], [1, 2, 3, 4], np.zeros((2, 2, 3)), np.zeros((3, 2)), []])
def test_points_of_another_shape_are_refused(points):
    for call in (x, x.gradient):
        with pytest.raises(ArgumentError, match=r"points: .*\(n, 3\)"):
            call(points)


@pytest.mark.parametrize("points", ["abc", None, [(1, 2, "z")], [(1, 2), (1, 2, 3)], (x, y, z), {1: 2}])
def test_points_that_are_not_numbers_are_refused(points):
    with pytest.raises(FrepError, match="points"):
        x(points)


def test_bounds_of_one_box_and_of_many():
    field = frep.sin(x) * y + abs(z)
    lo = random_points(200, seed=1)
    hi = lo + np.random.default_rng(2).uniform(0, 3, (200, 3))
    low, high = field.bounds(lo, hi)
    for i in range(0, 200, 17):
        assert field.bounds(lo[i], hi[i]) == (low[i], high[i])
    assert all(isinstance(v, float) for v in field.bounds((0, 0, 0), (1, 1, 1)))
    low, high = field.bounds((-9, -9, -9), hi)
    assert low.shape == (200,)


@pytest.mark.parametrize(
    ("lo", "hi"),
    [
        ((0, 0, 1), (1, 1, 0)),
        ((0, 0, math.nan), (1, 1, 1)),
        ((0, 0), (1, 1)),
        (0, 1),
        (np.zeros((2, 3)), np.ones((3, 3))),
        ("a", "b"),
        ((0, 0, None), (1, 1, 1)),
        ((0, 0, x), (1, 1, 1)),
    ],
)
def test_boxes_that_are_none_are_refused(lo, hi):
    with pytest.raises(FrepError, match="lo"):
        x.bounds(lo, hi)


@given(hnp.arrays(np.int64, 3, elements=st.integers(0, 2**31)))
def test_the_order_of_points_does_not_matter(seeds):
    points = random_points(700, -20, 20, seed=seeds[0])
    field = frep.sin(x) * y - frep.exp(-(z**2))
    order = np.random.default_rng(seeds[1]).permutation(len(points))
    assert np.array_equal(field(points)[order], field(points[order]))


def test_the_order_of_points_does_not_matter_to_beams():
    from topologies import beams

    field = beams.bcc(cell=5).thicken(0.8).field
    rng = np.random.default_rng(5)
    points = rng.uniform(-20, 20, (3000, 3))
    values = field(points)
    order = rng.permutation(len(points))
    assert np.allclose(field(points[order]), values[order], rtol=0, atol=1e-12)
    assert np.allclose([field(p) for p in points[:100]], values[:100], rtol=0, atol=1e-12)
    # BCC beams run along the diagonals of the cell: the oracle folds the point and measures to the four lines.
    folded = points - 2.5 - 5 * np.round((points - 2.5) / 5)
    directions = np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]) / math.sqrt(3)
    nearest = np.full(len(points), np.inf)
    for shift in itertools.product((-5, 0, 5), repeat=3):
        p = folded - shift
        for d in directions:
            t = np.clip(p @ d, -2.5 * math.sqrt(3), 2.5 * math.sqrt(3))
            nearest = np.minimum(nearest, np.linalg.norm(p - t[:, None] * d, axis=1))
    assert np.allclose(values, nearest - 0.4, rtol=0, atol=1e-9)


# --- tracing -----------------------------------------------------------------------------------------------------------


def has_foreign(field: Field) -> bool:
    return any(node.op == "foreign" for node in topological([field]))


def steps(x, y, z):
    if x < 0:
        return -1.0
    return y


def with_math(x, y, z):
    return math.sin(x) + math.hypot(y, z)


def test_plain_functions_are_traced():
    traced = frep.as_field(lambda a, b, c: 0.1 + abs(0.025 * a) + np.sin(b) * np.where(c < 0, 1.0, 2.0))
    assert not has_foreign(traced)
    assert traced is 0.1 + abs(0.025 * x) + frep.sin(y) * frep.where(z < 0, 1, 2)
    assert frep.as_field(lambda a, b, c: 3).is_constant
    assert frep.trace(lambda a, b, c: b) is y


def test_functions_with_if_are_called_point_by_point():
    field = frep.as_field(steps)
    assert has_foreign(field)
    points = random_points(40)
    assert np.array_equal(field(points), np.where(points[:, 0] < 0, -1.0, points[:, 1]))
    assert field((3.0, 7.0, 0.0)) == 7.0


def test_functions_of_math_are_called_point_by_point():
    field = frep.as_field(with_math)
    points = random_points(40)
    want = np.sin(points[:, 0]) + np.hypot(points[:, 1], points[:, 2])
    assert np.allclose(field(points), want, rtol=1e-14)
    assert np.allclose(field(points[:1]), want[:1], rtol=1e-14)
    assert "with_math" in repr(field)


def test_functions_of_arrays_are_called_in_batches():
    calls = []

    def table(x, y, z):
        calls.append(len(x))
        return np.interp(x, [-5.0, 5.0], [0.0, 1.0])

    field = frep.foreign(table)
    calls.clear()
    points = random_points(5000)
    assert np.allclose(field(points), points[:, 0] / 10 + 0.5)
    assert calls == [5000]


def test_a_foreign_field_composes_like_any_other():
    field = frep.foreign(with_math)
    points = random_points(60)
    want = np.sin(points[:, 0]) + np.hypot(points[:, 1], points[:, 2])
    assert np.allclose((2 * field - frep.square(x) * field)(points), 2 * want - points[:, 0] ** 2 * want)
    moved = field.substitute(x - 1, 2 * y, x * z)
    p = points
    assert np.allclose(moved(p), np.sin(p[:, 0] - 1) + np.hypot(2 * p[:, 1], p[:, 0] * p[:, 2]))
    assert np.allclose(moved(p), field(np.stack([p[:, 0] - 1, 2 * p[:, 1], p[:, 0] * p[:, 2]], 1)))
    assert np.allclose(field.substitute(1, 2, 2)(p), math.sin(1) + math.hypot(2, 2))
    gradient = np.stack([np.cos(p[:, 0]), *(p[:, i] / np.hypot(p[:, 1], p[:, 2]) for i in (1, 2))], 1)
    assert np.allclose(field.gradient(p), gradient, atol=1e-6)
    assert np.allclose(field.substitute(3 * x, y, z).gradient(p)[:, 0], 3 * np.cos(3 * p[:, 0]), atol=1e-6)


def test_a_foreign_field_inside_another():
    inner = frep.foreign(lambda a, b, c: np.sort(a * 0) + a**2, name="inner")
    outer = frep.foreign(lambda a, b, c: np.interp(a, [0, 100], [0, 10]) + b, name="outer")
    both = outer.substitute(inner, inner + y, z)
    p = random_points(100)
    assert np.allclose(both(p), p[:, 0] ** 2 / 10 + p[:, 0] ** 2 + p[:, 1])


def test_a_lipschitz_bound_gives_bounds():
    def cone(x, y, z):
        return np.linalg.norm([x, y, z], axis=0)

    known, unknown = frep.foreign(cone, lipschitz=1.0), frep.foreign(cone)
    rng = np.random.default_rng(3)
    lo = rng.uniform(-9, 9, (50, 3))
    hi = lo + rng.uniform(0, 2, (50, 3))
    low, high = known.bounds(lo, hi)
    inside = lo[:, None] + rng.uniform(size=(50, 64, 3)) * (hi - lo)[:, None]
    values = known(inside.reshape(-1, 3)).reshape(50, 64)
    assert np.all((low[:, None] <= values) & (values <= high[:, None]))
    assert np.all(high - low <= np.linalg.norm(hi - lo, axis=1) * (1 + 1e-12) + 1e-12)
    assert unknown.bounds((0, 0, 0), (1, 1, 1)) == (-math.inf, math.inf)
    assert known.bounds((0, 0, 0), (math.inf, 1, 1)) == (-math.inf, math.inf)
    # Through a map the box is that of the mapped coordinates.
    low, high = (known.substitute(2 * x, 2 * y, 2 * z) - 1).bounds((1, 0, 0), (2, 0, 0))
    assert low == pytest.approx(1.0)
    assert high == pytest.approx(3.0)


def test_a_constant_result_is_a_constant_field():
    calls = frep.foreign(lambda a, b, c: 4.0)
    assert np.array_equal(calls(np.zeros((3, 3))), [4.0] * 3)


def test_a_function_that_writes_to_its_arguments_harms_nobody():
    def careless(x, y, z):
        x += 100.0
        return x

    field = frep.foreign(careless)
    for n in (1, 5):
        points = np.zeros((n, 3))
        assert np.array_equal((field + x)(points), [100.0] * n)
        assert np.array_equal(points, np.zeros((n, 3)))


def returns_y(x, y, z):
    return np.array(y)


def test_foreign_fields_survive_pickling_and_never_meet_another():
    field = frep.foreign(steps) + x
    assert pickle.loads(pickle.dumps(field)) is field
    assert frep.foreign(steps) is not frep.foreign(steps)
    # The key must be unique beyond this process, or a worker would answer with its own function of the same number.
    keys = {frep.foreign(returns_y).data.content_key for _ in range(3)}
    assert len(keys) == 3
    assert min(map(len, keys)) > 20


# --- what is refused ---------------------------------------------------------------------------------------------------


def test_a_function_that_raises_is_named_and_keeps_its_error():
    def broken(x, y, z):
        raise RuntimeError("no data loaded")

    with pytest.raises(FunctionError, match=r"'broken'.*RuntimeError: no data loaded") as caught:
        frep.as_field(broken)
    assert isinstance(caught.value.__cause__, RuntimeError)


def test_a_function_that_raises_later_is_named():
    def late(x, y, z):
        if np.max(x) > 3:
            raise KeyError("beyond the table")
        return np.array(x)

    field = frep.foreign(late)
    with pytest.raises(FunctionError, match=r"'late'.*beyond the table") as caught:
        field([[0, 0, 0], [4, 0, 0]])
    assert isinstance(caught.value.__cause__, KeyError)


def test_a_function_that_fails_for_numbers_and_arrays_says_both():
    def neither(x, y, z):
        return [1, 2, 3] @ x

    with pytest.raises(FunctionError, match=r"'neither'.*single numbers.*arrays") as caught:
        frep.as_field(neither)
    assert caught.value.__cause__ is not None


def test_nan_names_the_point():
    field = frep.foreign(lambda a, b, c: np.where(a > 2, np.nan, a), name="holey")
    with pytest.raises(FunctionError, match=r"'holey' returned NaN at \(3, 0.25, -1\) and 1 more"):
        field([[0, 0, 0], [3, 0.25, -1], [4, 0, 0]])
    with pytest.raises(FunctionError, match="NaN"):
        (field + 1).gradient([[3, 0, 0]])


@pytest.mark.parametrize(
    "result",
    [
        lambda n: np.zeros(n + 1),
        lambda n: np.zeros((n, 3)),
        lambda n: np.zeros((n, 1)),
        lambda n: "text",
        lambda n: None,
        lambda n: np.full(n, 1j),
        lambda n: [object()] * n,
    ],
)
def test_results_that_are_not_one_number_a_point_are_refused(result):
    def wrong(a, b, c):
        return result(np.size(a))

    with pytest.raises(FunctionError, match=r"'wrong'.*(shape|numbers)"):
        frep.foreign(wrong)


def test_a_condition_on_a_field_says_what_to_write():
    for attempt in (lambda: bool(x < 0), lambda: min(x, y), lambda: 0 < x < 1, lambda: x and y, lambda: not x):
        with pytest.raises(ArgumentTypeError, match=r"truth value.*where\("):
            attempt()


def test_math_functions_of_a_field_say_what_to_write():
    for attempt in (lambda: float(x), lambda: math.sin(x), lambda: math.sqrt(x + 1), lambda: math.floor(x)):
        with pytest.raises(ArgumentTypeError, match=r"expected a number, got the Field.*numpy"):
            attempt()
    assert math.sin(constant(0.5)) == math.sin(0.5)


def test_a_field_is_neither_a_sequence_nor_an_array():
    for attempt in (lambda: len(x), lambda: list(x), lambda: np.asarray(x), lambda: np.array([x, y])):
        with pytest.raises(TypeError):
            attempt()
    with pytest.raises(ArgumentTypeError, match="evaluate it at points"):
        np.asarray(x)


@pytest.mark.parametrize("value", ["thick", None, [1, 2], np.zeros(3), {}, 1j])
def test_what_is_neither_number_nor_field_is_refused(value):
    with pytest.raises(ArgumentTypeError, match="wall: expected a number, a Field or a function"):
        frep.as_field(value, "wall")
    if not isinstance(value, np.ndarray):
        with pytest.raises(TypeError):
            x + value
        with pytest.raises(TypeError):
            x // value
        with pytest.raises(TypeError):
            value % x
    with pytest.raises(ArgumentTypeError):
        frep.sin(value)
    with pytest.raises(ArgumentTypeError):
        x**value


@pytest.mark.parametrize(
    "value",
    [math.inf, -math.inf, math.nan, np.float32("inf"), 10**400, -(10**400)],
    ids=["inf", "-inf", "nan", "float32", "huge", "-huge"],
)
def test_numbers_that_are_not_finite_are_refused(value):
    with pytest.raises(ArgumentError, match=r"wall.*finite"):
        frep.as_field(value, "wall")


@pytest.mark.parametrize("value", [True, np.float32(1), np.array(1.0), 1])
def test_any_real_number_is_a_field(value):
    assert frep.as_field(value) is constant(1)


@pytest.mark.parametrize("lipschitz", [-1.0, math.inf, math.nan])
def test_a_lipschitz_bound_is_a_finite_number(lipschitz):
    with pytest.raises(ArgumentError, match="lipschitz"):
        frep.foreign(steps, lipschitz=lipschitz)


def test_foreign_wants_a_function():
    with pytest.raises(ArgumentTypeError, match="function"):
        frep.foreign(3.0)
    with pytest.raises(ArgumentTypeError, match="lipschitz"):
        frep.foreign(steps, lipschitz="one")


def test_an_array_and_a_field_do_not_mix():
    with pytest.raises(ArgumentTypeError, match="Field or a number"):
        np.arange(3.0) * x
    with pytest.raises(ArgumentTypeError):
        x * np.arange(3.0)
