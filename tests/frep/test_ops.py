"""One conformance suite for every row of the operation table and every evaluator made from it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frep import Field, coordinates, evaluate
from frep.ops import OPERATIONS
from frep.tape import CODE

ROWS = list(OPERATIONS.values())
NAMES = [row.name for row in ROWS]
EVERY_ROW = pytest.mark.parametrize("row", ROWS, ids=NAMES)

_SPECIAL = [0.0, -0.0, 1.0, -1.0, 1e-30, -1e-30, 1e-36, 1e30, -1e30, math.inf, -math.inf, math.nan]
_PLAIN = [0.1, 0.3, 0.6, -0.7, 0.5, 2.5, -2.5, 3.0, -7.0, 42.0, 87.0, -86.0, 88.0, 99.0, 1e-3, -1e5]
_ANGLES = [k * math.pi / 2 for k in (-40, -7, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6, 20, 63)]
SPICY = [*_SPECIAL, *_PLAIN, *_ANGLES]
FEWER = [*_SPECIAL, *_PLAIN[:8]]

EPS32 = float(np.finfo(np.float32).eps)
TINY32 = float(np.finfo(np.float32).tiny)


def spicy_arguments(row, dtype) -> np.ndarray:
    """(arity, n) every combination of spicy numbers, as the evaluator of that precision can hold them."""
    values = np.array(SPICY if row.arity < 3 else FEWER).astype(dtype)
    if row.name == "arctan2":
        # On the cut the sign of zero decides between pi and -pi; kernels are compiled without signed zeros.
        values = np.where(values == 0.0, dtype(0.0), values)
    return np.array(np.meshgrid(*[values] * row.arity)).reshape(row.arity, -1)


def definition(row, arguments: np.ndarray) -> np.ndarray:
    """The row's `value` rule, number by number, in float64."""
    with np.errstate(all="ignore"):
        return np.array([float(row.value(*(np.float64(a) for a in column))) for column in arguments.T])


def arithmetic(row, arguments: np.ndarray, dtype) -> np.ndarray:
    """What the block interpreter computes, a register at a time."""
    kernel = evaluate._arithmetic_32 if dtype is np.float32 else evaluate._arithmetic_64
    n = arguments.shape[1]
    padded = -(-n // evaluate.BLOCK) * evaluate.BLOCK
    held = np.zeros((row.arity, padded), dtype)
    held[:, :n] = arguments
    out = np.empty(padded, dtype)
    for start in range(0, padded, evaluate.BLOCK):
        registers = np.zeros((4, evaluate.BLOCK), dtype)
        registers[: row.arity] = held[:, start : start + evaluate.BLOCK]
        kernel(CODE[row.name], registers, 3, 0, 1, 2, evaluate.BLOCK)
        out[start : start + evaluate.BLOCK] = registers[3]
    return out[:n].astype(np.float64)


def row_field(row) -> Field:
    return Field(row.name, coordinates()[: row.arity])


def as_points(arguments: np.ndarray) -> np.ndarray:
    points = np.zeros((arguments.shape[1], 3))
    points[:, : len(arguments)] = arguments.T
    return points


def assert_agrees(got: np.ndarray, want: np.ndarray, error: np.ndarray, arguments: np.ndarray) -> None:
    """NaN where the definition is NaN, infinite where it is infinite, else within `error`."""
    with np.errstate(invalid="ignore"):
        close = np.abs(got - want) <= error
    ok = np.where(np.isnan(want), np.isnan(got), np.where(np.isinf(want), got == want, close))
    bad = np.flatnonzero(~ok)
    assert len(bad) == 0, [(arguments[:, i].tolist(), got[i], want[i]) for i in bad[:5]]


def comparable(row, arguments: np.ndarray) -> np.ndarray:
    """Without the one place where the sign of a zero shows: a division by it."""
    return arguments[:, arguments[1] != 0.0] if row.name in ("divide", "mod") else arguments


# --- values ----------------------------------------------------------------------------------------------------------


@EVERY_ROW
def test_float64_blocks_and_points_follow_the_definition(row):
    arguments = comparable(row, spicy_arguments(row, np.float64))
    want = definition(row, arguments)
    error = 4e-16 * np.abs(want)
    if row.name == "mod":
        a, b = arguments
        # A fused a - b*n is exact where the definition rounds the product; beyond 2^50 periods nothing is left of a.
        keep = ~(np.abs(a) > 2.0**50 * np.abs(b)) | np.isinf(a)
        arguments, want, error = arguments[:, keep], want[keep], 4e-16 * np.abs(a[keep])
    assert_agrees(arithmetic(row, arguments, np.float64), want, error, arguments)
    assert_agrees(row_field(row)(as_points(arguments)), want, error, arguments)


def error_of_float32(row, arguments: np.ndarray, want: np.ndarray) -> np.ndarray:
    """What is promised of a float32 block whose arguments are exact."""
    if row.name in ("sin", "cos"):
        return np.where(np.abs(arguments[0]) <= 100.0, 2e-6, 2.0)
    if row.name == "arctan2":
        return np.full(len(want), 1e-6)
    if row.name == "exp":
        return 1e-6 * np.abs(want)
    if row.name == "log":
        return 1e-6 * np.abs(want) + 1e-7
    return 2.0 * EPS32 * np.abs(want) + TINY32


@EVERY_ROW
def test_float32_blocks_follow_the_definition(row):
    arguments = comparable(row, spicy_arguments(row, np.float32)).astype(np.float64)
    want = definition(row, arguments)
    got = arithmetic(row, arguments, np.float32)
    if row.name == "mod":
        a, b = arguments
        keep = ~(np.abs(a) > 2.0**20 * np.abs(b)) & np.isfinite(a) & np.isfinite(b)
        # On the edge of a period a sample may fold to either side.
        apart = np.abs(got - want)[keep]
        apart = np.minimum(apart, np.abs(np.abs(b[keep]) - apart))
        assert np.all(apart <= 4 * EPS32 * (np.abs(a) + np.abs(b))[keep])
        assert np.all(np.isnan(got[np.isnan(want)]))
        return
    if row.name == "exp":
        # float32 ends here; beyond, the result stays at the end.
        inside = ~(np.abs(arguments[0]) > 87.0)
        assert np.all(got[arguments[0] > 88.0] > 1e38)
        assert np.all((got >= 0.0) & (got < 1e-37), where=arguments[0] < -87.0)
        arguments, want, got = arguments[:, inside], want[inside], got[inside]
    with np.errstate(over="ignore"):
        want = np.where(np.abs(want.astype(np.float32)) == np.inf, want.astype(np.float32), want)
    assert_agrees(got, want, error_of_float32(row, arguments, want), arguments)


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_float32_sine_is_accurate_between_the_spicy_numbers_and_never_above_one(name):
    row = OPERATIONS[name]
    near = np.random.default_rng(1).uniform(-100, 100, (1, 20000)).astype(np.float32)
    assert np.max(np.abs(arithmetic(row, near, np.float32) - definition(row, near))) <= 2e-6
    far = np.geomspace(1e2, 3e38, 4096, dtype=np.float32)[None]
    assert np.all(np.abs(arithmetic(row, np.concatenate([far, -far], 1), np.float32)) <= 1.0)


def test_float32_exp_and_arctan2_are_accurate_between_the_spicy_numbers():
    rng = np.random.default_rng(2)
    a = rng.uniform(-87, 88, (1, 20000)).astype(np.float32)
    want = definition(OPERATIONS["exp"], a)
    assert np.max(np.abs(arithmetic(OPERATIONS["exp"], a, np.float32) / want - 1)) <= 1e-6
    ab = (rng.normal(size=(2, 20000)) * 10.0 ** rng.integers(-36, 30, 20000)).astype(np.float32)
    row = OPERATIONS["arctan2"]
    assert np.max(np.abs(arithmetic(row, ab, np.float32) - definition(row, ab))) <= 1e-6


@pytest.mark.parametrize("name", ["minimum", "maximum"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nan_survives_minimum_and_maximum(name, dtype):
    arguments = np.array([[np.nan, 1.0, np.nan, np.nan], [1.0, np.nan, -np.inf, np.inf]], dtype)
    assert np.all(np.isnan(arithmetic(OPERATIONS[name], arguments, dtype)))


@given(st.floats(-1e300, 1e300), st.floats(1e-3, 1e3), st.booleans())
def test_mod_stays_between_zero_and_its_period(a, b, negative):
    b = -b if negative else b
    row = OPERATIONS["mod"]
    arguments = np.array([[a, a * 1e-290, 3 * b, np.nextafter(3 * b, 0)], [b] * 4])
    for values in (definition(row, arguments), row_field(row)(as_points(arguments))):
        assert np.all((min(b, 0.0) <= values) & (values <= max(b, 0.0)))


# --- intervals -------------------------------------------------------------------------------------------------------

_END = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, math.inf, -math.inf, *_ANGLES]),
    st.floats(-10, 10),
    st.floats(-1e6, 1e6),
    st.floats(-1e-6, 1e-6),
    st.floats(allow_nan=False),
)
_RANGE = st.one_of(
    st.tuples(_END, _END).map(sorted),
    _END.filter(math.isfinite).map(lambda v: [v, v]),
    st.tuples(st.floats(-50, 50), st.floats(0, 8)).map(lambda cw: [cw[0], cw[0] + cw[1]]),
)
_BOXES = st.lists(st.tuples(_RANGE, _RANGE, _RANGE), min_size=1, max_size=8)
_FRACTIONS = np.concatenate([np.eye(3), 1 - np.eye(3), np.zeros((1, 3)), np.ones((1, 3)), np.full((1, 3), 0.5)])


def inside(lo: np.ndarray, hi: np.ndarray, seed: int) -> np.ndarray:
    """(boxes, samples, 3) points of the boxes: corners, centre, random ones; unbounded boxes are sampled to 1e9."""
    a = np.where(np.isfinite(lo), lo, np.minimum(hi, 0.0) - 1e9)
    a = np.where(np.isfinite(a), a, lo)
    b = np.where(np.isfinite(hi), hi, np.maximum(lo, 0.0) + 1e9)
    b = np.where(np.isfinite(b), b, hi)
    t = np.concatenate([_FRACTIONS, np.random.default_rng(seed).uniform(size=(24, 3))])
    with np.errstate(all="ignore"):
        points = a[:, None] * (1 - t) + b[:, None] * t
    return np.clip(np.where(np.isfinite(points), points, a[:, None]), lo[:, None], hi[:, None])


@EVERY_ROW
@given(boxes=_BOXES, seed=st.integers(0, 2**31))
def test_intervals_enclose_values(row, boxes, seed):
    lo, hi = np.moveaxis(np.array(boxes, dtype=float), 2, 0)
    field = row_field(row)
    low, high = field.bounds(lo, hi)
    assert np.all(low <= high)
    points = inside(lo, hi, seed).reshape(-1, 3)
    per_box = len(points) // len(lo)
    low, high = np.repeat(low, per_box), np.repeat(high, per_box)
    for values in (field(points), definition(row, points.T[: row.arity])):
        held = np.isnan(values) | ((low <= values) & (values <= high))
        i = int(np.argmin(held))
        assert np.all(held), f"{points[i]}: {values[i]!r} not in [{low[i]!r}, {high[i]!r}]"


@pytest.mark.parametrize(("name", "lo", "hi"), [("sqrt", -2.0, -1.0), ("log", -2.0, -1.0)])
def test_nothing_is_known_where_no_value_is_a_number(name, lo, hi):
    assert Field(name, coordinates()[:1]).bounds((lo, 0, 0), (hi, 0, 0)) == (-math.inf, math.inf)


@pytest.mark.parametrize(
    ("name", "box", "want"),
    [
        ("square", [(-2, 1)], (0, 4)),
        ("absolute", [(-2, 1)], (0, 2)),
        ("sin", [(0, math.pi)], (0, 1)),
        ("sin", [(math.pi, 2 * math.pi)], (-1, 0)),
        ("cos", [(-0.1, 0.1)], (math.cos(0.1), 1)),
        ("cos", [(0.0, 100.0)], (-1, 1)),
        ("multiply", [(-2, 3), (-5, 7)], (-15, 21)),
        ("divide", [(1, 2), (4, 8)], (0.125, 0.5)),
        ("arctan2", [(1, 1), (-1, 1)], (math.pi / 4, 3 * math.pi / 4)),
        ("mod", [(10.25, 10.5), (1, 1)], (0.25, 0.5)),
        ("mod", [(9.5, 10.5), (1, 1)], (0, 1)),
        ("floor", [(-0.5, 2.5)], (-1, 2)),
        ("less", [(0, 1), (2, 3)], (1, 1)),
        ("less", [(2, 3), (0, 1)], (0, 0)),
        ("less_equal", [(0, 1), (1, 2)], (1, 1)),
        ("where", [(0, 0), (1, 2), (5, 6)], (5, 6)),
        ("where", [(-1, 1), (1, 2), (5, 6)], (1, 6)),
        ("sqrt", [(-1, 4)], (0, 2)),
        ("log", [(0, 1)], (-math.inf, 0)),
    ],
)
def test_intervals_are_tight_where_they_can_be(name, box, want):
    lo, hi = np.zeros(3), np.zeros(3)
    lo[: len(box)], hi[: len(box)] = np.array(box, dtype=float).T
    got = Field(name, coordinates()[: len(box)]).bounds(lo, hi)
    assert got == pytest.approx(want, rel=1e-14, abs=1e-13)


# --- partial derivatives -----------------------------------------------------------------------------------------------


@EVERY_ROW
def test_partials_match_central_differences(row):
    rng = np.random.default_rng(3)
    points = rng.uniform(-3, 3, (400, 3))
    field, h = row_field(row), 1e-5
    with np.errstate(all="ignore"):
        gradient = field.gradient(points)
        forward, backward = (
            np.stack([(field(points + s * h * e) - field(points)) / (s * h) for e in np.eye(3)], 1) for s in (1, -1)
        )
    # A jump or a crease within the step, or no value: nothing to compare.
    smooth = np.all(np.abs(forward - backward) <= 1e-3 * (1 + np.abs(forward)), axis=1) & np.isfinite(field(points))
    assert smooth.sum() > 150
    central = 0.5 * (forward + backward)
    assert np.allclose(gradient[smooth], central[smooth], rtol=1e-4, atol=1e-6)
    assert np.all(gradient[:, row.arity :] == 0.0)


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_the_tip_of_a_cone_has_gradient_zero(scale):
    x, y, z = coordinates()
    field = (x**2 + y**2 + z**2) ** 0.5 * scale
    assert np.all(field.gradient((0, 0, 0)) == 0.0)
    blocks = np.zeros((1, 3), np.int32)
    axis = np.arange(8.0) - 3
    out = np.empty((3, 1, 512), np.float32)
    evaluate.Program(field.derivatives()).on_blocks(blocks, (axis, axis, axis), out)
    assert np.all(np.isfinite(out))
    assert np.all(out.reshape(3, 8, 8, 8)[:, 3, 3, 3] == 0.0)


# --- the table itself --------------------------------------------------------------------------------------------------


def test_rows_say_what_they_are():
    assert [row.name for row in ROWS] == NAMES == list(OPERATIONS)
    for row in ROWS:
        assert 1 <= row.arity <= 3
        partials = row.partials(row_field(row), *row_field(row).args)
        assert len(partials) == row.arity
        if row.commutative:
            a, b = spicy_arguments(row, np.float64)
            assert np.array_equal(definition(row, np.array([a, b])), definition(row, np.array([b, a])), equal_nan=True)


@pytest.mark.parametrize("row", [row for row in ROWS if row.exact], ids=lambda row: row.name)
def test_exact_rows_do_not_round(row):
    """What is exact needs no widening: its float32 result is among the float32 numbers it came from, or whole."""
    arguments = spicy_arguments(row, np.float32)
    got = arithmetic(row, arguments, np.float32)
    want = definition(row, arguments.astype(np.float64))
    assert np.array_equal(got, want, equal_nan=True)
