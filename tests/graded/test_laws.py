"""Laws: closed forms, constant beyond the ends, any direction, Fields as ends, clear refusals; distance to a solid."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError
from graded import distance_to, linear, parabola

X, Y, Z = frep.coordinates()
POINTS = np.random.default_rng(4).uniform(-30, 30, (500, 3))
numbers = st.floats(-100, 100)


@given(st.sampled_from("xyz"), numbers, numbers, numbers, numbers)
def test_linear_interpolates_between_its_ends(axis, start, stop, low, high):
    if abs(stop - start) < 1e-3:
        return
    law = linear(axis, start, stop, low, high)
    expected = np.interp(POINTS[:, "xyz".index(axis)], *zip(*sorted([(start, low), (stop, high)]), strict=True))
    np.testing.assert_allclose(frep.as_field(law)(POINTS), expected, atol=1e-9)


@given(numbers, st.floats(0.1, 100), numbers, numbers)
def test_parabola_has_its_ends_and_its_middle(start, length, ends, middle):
    law = parabola("y", start, start + length, ends, middle)
    s = np.clip((POINTS[:, 1] - start) / length, 0, 1)
    expected = ends + 4 * (middle - ends) * s * (1 - s)
    np.testing.assert_allclose(frep.as_field(law)(POINTS), expected, atol=1e-9)


def test_parabola_reaches_its_middle_and_does_not_exceed_it():
    """The thesis' own formula (4.1) peaks at 7 for 1 and 6 (lf-rep O10); the corrected one at 6."""
    law = parabola("x", 0, 200, ends=1, middle=6)
    values = law(np.stack([np.linspace(-50, 250, 3001), np.zeros(3001), np.zeros(3001)], axis=1))
    assert values.max() == pytest.approx(6.0)
    assert values.min() == pytest.approx(1.0)
    # Means over the length: 1 + 2/3 * 5.
    inside = law(np.stack([np.linspace(0, 200, 20001), np.zeros(20001), np.zeros(20001)], axis=1))
    assert inside.mean() == pytest.approx(1 + 2 / 3 * 5, rel=1e-3)


def test_ends_are_clamped():
    law = linear("z", 10, 20, 1, 3)
    np.testing.assert_array_equal(law([[0, 0, -1e9], [0, 0, 10], [0, 0, 20], [0, 0, 1e9]]), [1, 1, 3, 3])
    curve = parabola("z", 10, 20, 1, 3)
    np.testing.assert_array_equal(curve([[0, 0, -1e9], [0, 0, 15], [0, 0, 1e9]]), [1, 3, 1])


def test_reversed_laws_mirror():
    np.testing.assert_allclose(linear("x", 20, -5, 3, 1)(POINTS), linear("x", -5, 20, 1, 3)(POINTS), atol=1e-12)
    np.testing.assert_allclose(parabola("x", 20, -5, 3, 1)(POINTS), parabola("x", -5, 20, 3, 1)(POINTS), atol=1e-12)


def test_any_field_is_an_axis_and_any_field_an_end():
    radius = frep.hypot(X, Y)
    law = linear(radius, 2, 8, 1.0, 1.0 + 0.1 * Z)
    s = np.clip((np.hypot(POINTS[:, 0], POINTS[:, 1]) - 2) / 6, 0, 1)
    np.testing.assert_allclose(law(POINTS), 1 + 0.1 * POINTS[:, 2] * s, atol=1e-9)
    np.testing.assert_allclose(linear(lambda x, y, z: x, 0, 9, 1, 2)(POINTS), linear("x", 0, 9, 1, 2)(POINTS))


def test_bounds_of_the_laws_enclose():
    for law in (linear("x", 0, 10, 1, 3), parabola("x", 0, 10, 1, 6)):
        low, high = law.bounds((-100, -100, -100), (100, 100, 100))
        values = law(POINTS)
        assert low <= values.min()
        assert high >= values.max()
        assert low > 0, "a law that is positive is seen to be so, or every part would be searched for zeros"


def test_distance_to_a_solid_is_positive_on_both_sides():
    ball = distance_to(frep.sphere((1, 2, 3), 5))
    np.testing.assert_allclose(ball(POINTS), np.abs(np.linalg.norm(POINTS - (1, 2, 3), axis=1) - 5), atol=1e-12)
    cube = distance_to(frep.box((-1, -1, -1), (1, 1, 1)))
    np.testing.assert_allclose(cube([[0, 0, 0], [0, 0.5, 0], [4, 5, 1]]), [1, 0.5, 5], atol=1e-12)


def test_a_wall_graded_by_the_distance_to_a_solid():
    depth = distance_to(frep.box((0, 0, 0), (20, 20, 20)))
    law = linear(depth, 0, 10, 3.0, 1.0)
    np.testing.assert_allclose(law([[10, 10, 0], [10, 10, 5], [10, 10, 10]]), [3, 2, 1], atol=1e-12)


BAD = [
    ("axis", ArgumentError, lambda f: f("w", 0, 1, 1, 2)),
    ("axis", ArgumentTypeError, lambda f: f(None, 0, 1, 1, 2)),
    ("axis", ArgumentTypeError, lambda f: f((1, 0, 0), 0, 1, 1, 2)),
    ("start", ArgumentError, lambda f: f("x", 5, 5, 1, 2)),
    ("start", ArgumentError, lambda f: f("x", math.nan, 5, 1, 2)),
    ("stop", ArgumentError, lambda f: f("x", 0, math.inf, 1, 2)),
    ("start", ArgumentTypeError, lambda f: f("x", X, 1, 1, 2)),
    ("stop", ArgumentTypeError, lambda f: f("x", 0, "end", 1, 2)),
    ("low|ends", ArgumentTypeError, lambda f: f("x", 0, 1, "thin", 2)),
    ("high|middle", ArgumentError, lambda f: f("x", 0, 1, 1, math.nan)),
    ("high|middle", ArgumentTypeError, lambda f: f("x", 0, 1, 1, None)),
]


@pytest.mark.parametrize("law", [linear, parabola])
@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(law, argument, error, call):
    with pytest.raises(error, match=rf"\b({argument})\b"):
        call(law)


def test_distance_to_needs_a_solid():
    with pytest.raises(ArgumentTypeError, match="solid"):
        distance_to(X)
