"""Laws of random expressions: intervals enclose, blocks equal points, gradients equal differences, text and pickle return."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import frep
from frep import Field, FunctionError, coordinates
from frep.evaluate import Program, _blocks, block_points, bounds_over, program, values_at
from frep.field import as_field, constant, topological

ROOT = Path(__file__).resolve().parents[2]
x, y, z = coordinates()

LEAVES = st.one_of(
    st.sampled_from([x, y, z]),
    st.sampled_from([x, y, z]),
    st.integers(-12, 12).map(lambda n: constant(n / 4)),
)

# Functions that magnify no error: a float32 evaluation of a tree of them is as good as its last operations.
TAME_1 = [frep.sin, frep.cos, abs, frep.tanh, frep.arctan, lambda a: -a, lambda a: frep.sqrt(a * a + 1)]
TAME_2 = [
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: frep.sin(a) * frep.cos(b),
    frep.minimum,
    frep.maximum,
    lambda a, b: frep.hypot(a, frep.maximum(b, 0.5)),
    lambda a, b: frep.arctan2(a, 2 + frep.sin(b)),
    lambda a, b: frep.clip(a, -1, 1) / (2 + frep.cos(b)),
    lambda a, b: frep.exp(-abs(a)) + b,
    lambda a, b: frep.log(1 + a * a) - b,
]

# Everything, with jumps, poles, and values that are no numbers.
WILD_1 = [
    *TAME_1,
    frep.sqrt,
    frep.square,
    frep.exp,
    frep.log,
    frep.tan,
    frep.floor,
    frep.sign,
    lambda a: a**3,
    lambda a: 1 / a,
]
WILD_2 = [
    *TAME_2,
    lambda a, b: a * b,
    lambda a, b: a / b,
    frep.mod,
    frep.arctan2,
    frep.hypot,
    lambda a, b: a < b,
    lambda a, b: a <= b,
    lambda a, b: frep.where(a < b, a - 1, b * 2),
    lambda a, b: abs(a) ** b,
    lambda a, b: a // (abs(b) + 0.5),
    lambda a, b: a % 0.75 + b,
]


def trees(unary, binary, leaves: int = 10):
    def grow(children):
        return st.one_of(
            st.builds(lambda f, a: f(a), st.sampled_from(unary), children),
            st.builds(lambda f, a, b: f(a, b), st.sampled_from(binary), children, children),
        )

    return st.recursive(LEAVES, grow, max_leaves=leaves)


TAME = trees(TAME_1, TAME_2)
WILD = trees(WILD_1, WILD_2)
SEEDS = st.integers(0, 2**31)


def boxes(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of all sizes, some flat, some through the origin, some unbounded."""
    rng = np.random.default_rng(seed)
    lo = rng.uniform(-4, 4, (n, 3))
    size = 10.0 ** rng.uniform(-4, 1, (n, 1)) * rng.uniform(size=(n, 3)) * (rng.uniform(size=(n, 3)) < 0.9)
    hi = lo + size
    through = rng.uniform(size=n) < 0.2
    lo[through], hi[through] = -size[through], size[through] / 2
    whole = rng.uniform(size=n) < 0.1
    lo[whole], hi[whole] = np.round(lo[whole]), np.round(lo[whole]) + 1
    endless = rng.uniform(size=(n, 3)) < 0.02
    return np.where(endless, -np.inf, lo), np.where(endless, np.inf, hi)


def within(lo: np.ndarray, hi: np.ndarray, seed: int, n: int = 12) -> np.ndarray:
    """(boxes, n, 3) points, corners among them."""
    rng = np.random.default_rng(seed)
    t = rng.uniform(size=(len(lo), n, 3))
    t[:, :4] = np.round(t[:, :4])
    a, b = np.maximum(lo, -50.0)[:, None], np.minimum(hi, 50.0)[:, None]
    return np.clip(a + t * (b - a), lo[:, None], hi[:, None])


# --- intervals ---------------------------------------------------------------------------------------------------------


@settings(max_examples=200)
@given(field=WILD, seed=SEEDS)
def test_bounds_enclose_values(field, seed):
    lo, hi = boxes(seed, 150)
    low, high = field.bounds(lo, hi)
    points = within(lo, hi, seed)
    parts = values_at(tuple(topological([field])), points.reshape(-1, 3)).reshape(-1, *points.shape[:2])
    # A comparison turns a part that is no number (0 * infinity) into one: there nothing is promised.
    values, unknown = parts[-1], np.isnan(parts).any(axis=0)
    held = unknown | ((low[:, None] <= values) & (values <= high[:, None]))
    i, j = np.unravel_index(np.argmin(held), held.shape)
    assert np.all(held), f"{field!r} at {points[i, j]!r}: {values[i, j]!r} not in {low[i]!r}, {high[i]!r}"


@given(field=WILD, seed=SEEDS)
def test_bounds_of_many_boxes_are_those_of_each(field, seed):
    lo, hi = boxes(seed, 70)
    low, high = bounds_over(field, lo, hi)
    for i in (0, 33, 69):
        assert np.array_equal(field.bounds(lo[i], hi[i]), (low[i], high[i]), equal_nan=True)


@given(field=TAME, seed=SEEDS)
def test_bounds_of_smooth_fields_shrink_to_the_value(field, seed):
    point = np.random.default_rng(seed).uniform(-2, 2, 3)
    low, high = field.bounds(point - 1e-9, point + 1e-9)
    assert high - low < 1e-4
    assert low <= field(point) <= high


# --- blocks ------------------------------------------------------------------------------------------------------------


def block_values(fields: tuple[Field, ...], axes, dtype=np.float32) -> tuple[np.ndarray, np.ndarray]:
    """(k, n) values of the block evaluator over every sample of a grid, and their (n, 3) points."""
    blocks = np.argwhere(np.ones([len(a) // 8 for a in axes])).astype(np.int32)
    out = np.full((len(fields), len(blocks), 512), np.nan, dtype)
    Program(fields).on_blocks(blocks, axes, out)
    return out.reshape(len(fields), -1), block_points(blocks, axes)


@settings(max_examples=80)
@given(field=TAME, seed=SEEDS)
def test_float32_blocks_equal_points(field, seed):
    start = np.random.default_rng(seed).uniform(-3, 3, 3)
    axes = tuple(start[a] + 0.13 * np.arange(8 * n) for a, n in enumerate((2, 1, 3)))
    got, points = block_values((field, field + 0.5 * x), axes)
    for values, f in zip(got, (field, field + 0.5 * x), strict=True):
        want = f(points)
        assert np.max(np.abs(values - want) / np.maximum(np.abs(want), 1.0)) < 5e-5


@settings(max_examples=80)
@given(field=TAME, seed=SEEDS)
def test_float64_blocks_equal_points(field, seed):
    """Far from the origin blocks are evaluated in float64: only the last rounding, to what is asked for, remains."""
    start = np.random.default_rng(seed).uniform(-3, 3, 3) + np.array([1e5, -1e5, 0.0])
    axes = tuple(start[a] + 0.13 * np.arange(8) for a in range(3))
    near = field.substitute(x - 1e5, y + 1e5, z)
    got, points = block_values((near,), axes, np.float64)
    assert np.allclose(got[0], near(points), rtol=1e-9, atol=1e-9)
    assert np.allclose(got[0], field(points - (1e5, -1e5, 0)), rtol=1e-6, atol=1e-6)


def test_blocks_may_be_few_and_anywhere():
    field = frep.sin(x * y) + z
    axes = tuple(0.2 * np.arange(40.0) + a for a in range(3))
    blocks = np.array([[4, 0, 2], [0, 0, 0], [1, 3, 4], [4, 4, 4]], np.int32)
    out = np.empty((1, 4, 512), np.float32)
    Program((field,)).on_blocks(blocks, axes, out)
    assert np.allclose(out.ravel(), field(block_points(blocks, axes)), atol=2e-5)
    none = np.empty((1, 0, 512), np.float32)
    Program((field,)).on_blocks(blocks[:0], axes, none)


def test_foreign_functions_are_called_with_many_blocks_at_once():
    calls: list[int] = []

    def measured(a, b, c):
        calls.append(len(a))
        return np.hypot(a, b)

    field = frep.foreign(measured) * frep.cos(z)
    axes = tuple(0.1 * np.arange(8.0 * 11) for _ in range(3))
    calls.clear()
    got, points = block_values((field,), axes)
    assert np.allclose(got[0], np.hypot(points[:, 0], points[:, 1]) * np.cos(points[:, 2]), atol=1e-5)
    assert calls == [1024 * 512, (11**3 - 1024) * 512]


def test_foreign_functions_see_mapped_coordinates_in_blocks():
    field = frep.foreign(lambda a, b, c: np.cbrt(a) + b).substitute(x * y, z - 1, 0)
    axes = tuple(0.3 * np.arange(8.0) - 1 for _ in range(3))
    got, points = block_values((field,), axes)
    assert np.allclose(got[0], np.cbrt(points[:, 0] * points[:, 1]) + points[:, 2] - 1, atol=1e-5)


def test_nan_of_a_user_function_in_a_block_is_named():
    field = frep.foreign(lambda a, b, c: np.where(a > 0.5, np.nan, a), name="holey")
    axes = tuple(0.1 * np.arange(8.0) for _ in range(3))
    with pytest.raises(FunctionError, match=r"'holey' returned NaN at \(0.6, 0, 0\) and 127 more"):
        block_values((field,), axes)


# --- far from the origin -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make",
    [
        lambda c: frep.sphere(c, 5),
        lambda c: frep.box((-4, -3, -2), (4, 3, 2)).rotate((1, 2, 3), 0.7).translate(c),
        lambda c: frep.rounded_box((-4, -3, -2), (4, 3, 2), 1).rotate("z", 0.3).translate(c),
        lambda c: frep.torus((0, 0, 0), (0, 0, 1), 4, 1).translate(c),
    ],
    ids=["sphere", "box", "rounded_box", "torus"],
)
@pytest.mark.parametrize("far", [(1e6, 0, 0), (1e6, -1e6, 5e5)])
def test_a_kilometre_from_the_origin_nothing_is_lost(make, far):
    axes = tuple(-6 + 0.1 * np.arange(8.0 * 15) for _ in range(3))
    moved = tuple(a + c for a, c in zip(axes, far, strict=True))
    here, _ = block_values((make((0, 0, 0)).field,), axes)
    there, _ = block_values((make(far).field,), moved)
    assert np.max(np.abs(here - there)) < 1e-4


# --- gradients -----------------------------------------------------------------------------------------------------------


@settings(max_examples=100)
@given(
    field=trees([*TAME_1, frep.square, frep.tan], [*TAME_2, lambda a, b: a * b, lambda a, b: a % 1.5 + b]), seed=SEEDS
)
def test_gradients_equal_central_differences_where_smooth(field, seed):
    points = np.random.default_rng(seed).uniform(-2, 2, (60, 3))
    h = 1e-5
    gradient, value = field.gradient(points), field(points)
    assert gradient.shape == (60, 3)
    step = h * np.eye(3)
    ahead = np.stack([(field(points + s) - value) / h for s in step], 1)
    behind = np.stack([(value - field(points - s)) / h for s in step], 1)
    wider = np.stack([(field(points + 4 * s) - field(points - 4 * s)) / (8 * h) for s in step], 1)
    central = 0.5 * (ahead + behind)
    scale = 1 + np.abs(central) + np.abs(value)[:, None]
    smooth = (np.abs(ahead - behind) < 1e-3 * scale) & (np.abs(wider - central) < 1e-6 * scale)
    assert np.all(np.abs(gradient - central)[smooth] < 1e-5 * np.broadcast_to(scale, smooth.shape)[smooth])


@given(field=TAME)
def test_gradients_of_smooth_fields_are_numbers_everywhere(field):
    points = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 3), -1).reshape(-1, 3)
    assert np.all(np.isfinite(field.gradient(points)))


@given(field=TAME, seed=SEEDS)
def test_a_gradient_is_made_of_the_derivatives(field, seed):
    points = np.random.default_rng(seed).uniform(-2, 2, (20, 3))
    assert np.array_equal(field.gradient(points), np.stack([d(points) for d in field.derivatives()], 1))


# --- substitution ----------------------------------------------------------------------------------------------------------


@settings(max_examples=100)
@given(field=TAME, a=TAME, b=TAME, c=TAME, seed=SEEDS)
def test_substitution_is_evaluation_at_the_mapped_point(field, a, b, c, seed):
    points = np.random.default_rng(seed).uniform(-2, 2, (50, 3))
    mapped = np.stack([f(points) for f in (a, b, c)], axis=1)
    assert np.allclose(field.substitute(a, b, c)(points), field(mapped), rtol=1e-9, atol=1e-9)


@given(field=WILD)
def test_substituting_the_coordinates_changes_nothing(field):
    assert field.substitute(x, y, z) is field
    assert field.substitute(y, z, x).substitute(z, x, y) is field


# --- identity: objects, pickles, keys, text ----------------------------------------------------------------------------------


@given(field=WILD)
def test_a_pickle_returns_the_same_object(field):
    assert pickle.loads(pickle.dumps(field)) is field


def test_keys_and_pickles_are_the_same_in_another_process():
    fields = [
        frep.sqrt(x**2 + y**2 + z**2) - 5,
        np.sin(2 * x) * np.cos(y / 3) + 0.1,
        frep.where(x < y, frep.mod(z, 2.5), frep.exp(-x)),
        frep.box((0, 0, 0), (1, 2, 3)).rotate("z", 0.3).field,
    ]
    points = np.random.default_rng(0).uniform(-3, 3, (20, 3))
    script = (
        "import sys, pickle\n"
        "payload = pickle.load(sys.stdin.buffer)\n"
        "import frep\n"
        "x, y, z = frep.coordinates()\n"
        "fields = [pickle.loads(p) for p in payload]\n"
        "assert fields[0] is frep.sqrt(x**2 + y**2 + z**2) - 5\n"
        "sys.stdout.buffer.write(pickle.dumps(([f.key for f in fields], [pickle.dumps(f) for f in fields])))\n"
    )
    sent = pickle.dumps([pickle.dumps(f) for f in fields])
    done = subprocess.run([sys.executable, "-c", script], input=sent, capture_output=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr.decode()
    keys, pickles = pickle.loads(done.stdout)
    assert keys == [f.key for f in fields]
    for data, field in zip(pickles, fields, strict=True):
        assert pickle.loads(data) is field
        assert np.array_equal(pickle.loads(data)(points), field(points))


NAMESPACE = {name: getattr(frep, name) for name in frep.__all__ if callable(getattr(frep, name))} | {
    "x": x,
    "y": y,
    "z": z,
    "abs": abs,
    "inf": math.inf,
    "nan": math.nan,
}


@settings(max_examples=300)
@given(field=WILD)
def test_the_text_of_a_field_builds_it_again(field):
    text = repr(field)
    assume(len(text) < 1900)
    again = as_field_or_nan(eval(text, dict(NAMESPACE)))
    numbers = [n.data for n in topological([field]) if n.op == "constant"]
    if all(float(f"{v:.12g}") == v for v in numbers):
        assert again is field, text
    else:
        # Numbers are shown with twelve digits.
        points = np.random.default_rng(0).uniform(0.1, 0.9, (20, 3))
        ours, theirs = field(points), again(points)
        same = np.isclose(ours, theirs, rtol=1e-6, atol=1e-6, equal_nan=True)
        assert same.mean() > 0.5, text


def as_field_or_nan(value) -> Field:
    return value if isinstance(value, Field) else constant(value)


@pytest.mark.parametrize(
    ("field", "text"),
    [
        (2 * x + 1, "2*x + 1"),
        (1 + x * 2, "2*x + 1"),
        (frep.sqrt(x**2 + y**2 + z**2) - 5, "sqrt(x**2 + y**2 + z**2) - 5"),
        (x - (y - z), "x - (y - z)"),
        (x - y - z, "x - y - z"),
        (-(x**2), "-x**2"),
        ((-x) ** 2, "(-x)**2"),
        (x / (y * z), "x/(y*z)"),
        (-(x * y), "-(x*y)"),
        ((x < y) < z, "(x < y) < z"),
        (abs(x) + np.minimum(y, -3.5), "abs(x) + minimum(y, -3.5)"),
        (as_field(0.1), "0.1"),
    ],
)
def test_text_reads_as_it_was_written(field, text):
    assert repr(field) == text


# --- programs ----------------------------------------------------------------------------------------------------------------


def test_a_program_is_kept_for_a_field_asked_again():
    field = frep.sin(x) * 3 - y
    assert program(field) is program(frep.sin(x) * 3 - y)
    assert program(field).tape(False) is program(field).tape(False)


@given(fields=st.lists(TAME, min_size=1, max_size=5), seed=SEEDS)
def test_many_fields_at_once_are_each_alone(fields, seed):
    points = np.random.default_rng(seed).uniform(-2, 2, (40, 3))
    got = values_at(tuple(fields), points)
    assert np.array_equal(got, np.stack([f(points) for f in fields]))


@pytest.mark.parametrize("n", [0, 1, 2, 511, 512, 513, 1025, 5000])
def test_any_number_of_points(n):
    points = np.random.default_rng(n).uniform(-3, 3, (n, 3))
    field = frep.exp(-frep.square(x)) * frep.sin(y) + z
    want = np.exp(-(points[:, 0] ** 2)) * np.sin(points[:, 1]) + points[:, 2]
    assert np.allclose(field(points), want, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 1000])
def test_any_number_of_boxes(n):
    lo = np.random.default_rng(n).uniform(-3, 3, (n, 3))
    low, high = (x + 2 * y).bounds(lo, lo + 1)
    assert np.allclose(low, lo[:, 0] + 2 * lo[:, 1], rtol=1e-14, atol=1e-14)
    assert np.allclose(high, lo[:, 0] + 2 * lo[:, 1] + 3, rtol=1e-14, atol=1e-14)


def test_blocks_of_any_memory_layout_run_on_one_compiled_kernel():
    """Numba makes a type of each layout, and compiles for seconds; the values are the same."""
    x, y, z = coordinates()
    # Two outputs, and a user's function: it runs in parts, and parts of two outputs are not contiguous.
    whole = program(x + 2 * y - z, frep.foreign(lambda x, y, z: x * y))
    axes = tuple(0.1 * np.arange(128) for _ in range(3))
    blocks = np.argwhere(np.ones((16, 16, 6), bool)).astype(np.int32)
    first = np.empty((2, len(blocks), 512), np.float32)
    whole.on_blocks(blocks, axes, first)
    compiled = len(_blocks.signatures)
    unwritable = blocks.copy()
    unwritable.flags.writeable = False
    for layout, out in (
        (np.asfortranarray(blocks), np.empty_like(first)),
        (np.repeat(blocks, 2, 0)[::2], np.empty_like(first)),
        (np.asfortranarray(np.repeat(blocks, 2, 0))[::2], np.empty_like(first)),
        (unwritable, np.empty_like(first)),
        (blocks.astype(np.int64), np.empty_like(first)),
        (blocks, np.empty(first.shape, np.float64)),
        (blocks, np.asfortranarray(first)),
        (blocks, np.empty((len(blocks), 2, 512), np.float32).swapaxes(0, 1)),
    ):
        out[:] = np.nan
        whole.on_blocks(layout, axes, out)
        assert np.array_equal(out, first)
    assert len(_blocks.signatures) == compiled
