"""True distances to the zero set of any field within a box: closed forms, brute force, independence of how they were made."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

import frep
from frep import ArgumentError, ArgumentTypeError, TooLargeError, UnboundedError, redistance
from frep.redistance import distance_over, periodic_distance
from frep.sampled import BoxSpline

RNG = np.random.default_rng(31)
X, Y, Z = frep.coordinates()
R = 5.0
BALL = X**2 + Y**2 + Z**2 - R**2
BOX = ((-8.0, -8.0, -8.0), (8.0, 8.0, 8.0))
POINTS = RNG.uniform(-8, 8, (20000, 3))
TO_BALL = np.linalg.norm(POINTS, axis=1) - R
NEAR = np.abs(TO_BALL) < 1.0


def test_distance_to_a_ball_in_closed_form():
    """Errors fall faster than the square of the spacing, to a hundred-thousandth of the radius."""
    worst = [np.abs(distance_over(BALL, BOX, 1.0, h)(POINTS) - TO_BALL)[NEAR].max() / R for h in (1.0, 0.5, 0.25)]
    assert worst[0] < 5e-4
    assert worst[1] < 1.5e-4
    assert worst[2] < 5e-5


def test_only_the_zero_set_counts():
    """Whatever the field is elsewhere, and however steep: the same surface, the same distances."""
    plain = distance_over(BALL, BOX, 1.0, 0.5)(POINTS)
    for other in (1e3 * BALL, BALL * (3.0 + frep.sin(X)), frep.sqrt(X**2 + Y**2 + Z**2) - R):
        np.testing.assert_allclose(distance_over(other, BOX, 1.0, 0.5)(POINTS)[NEAR], plain[NEAR], atol=1e-4)


def test_distance_to_an_ellipsoid_against_brute_force():
    field = (X / 6) ** 2 + (Y / 4) ** 2 + (Z / 3) ** 2 - 1.0
    u = RNG.normal(size=(600000, 3))
    surface = u / np.linalg.norm(u, axis=1)[:, None] * (6, 4, 3)
    points = RNG.uniform((-7, -6, -5), (7, 6, 5), (4000, 3))
    brute = cKDTree(surface).query(points)[0]
    found = distance_over(field, ((-7, -6, -5), (7, 6, 5)), 1.5, 0.25)(points)
    # A cloud of points is farther away than the surface, by up to half its spacing squared over the distance.
    near = (brute > 0.4) & (brute < 1.5) & (np.linalg.norm(points / (6, 4, 3), axis=1) > 1)
    assert near.sum() > 300
    np.testing.assert_allclose(np.abs(found)[near], brute[near], atol=6e-3)
    assert np.quantile(np.abs(found)[near] - brute[near], 0.98) < 1e-3
    np.testing.assert_array_equal(found[near] < 0, field(points)[near] < 0)


def test_box_and_period_agree():
    field = frep.cos(X) + frep.cos(Y) + frep.cos(Z)
    whole = periodic_distance(field, (math.tau,) * 3)
    points = RNG.uniform(-5, 5, (5000, 3))
    near = np.abs(whole(points)) < 0.8
    found = distance_over(field, ((-5,) * 3, (5,) * 3), 0.8, math.tau / 32)
    np.testing.assert_allclose(found(points)[near], whole(points)[near], atol=2e-3 * math.tau)
    assert np.quantile(np.abs(found(points) - whole(points))[near], 0.99) < 4e-4 * math.tau


def test_bricks_leave_no_trace(monkeypatch):
    points = POINTS[NEAR]
    whole = distance_over(BALL, BOX, 1.0, 0.4)(points)
    redistance._distance_over.cache_clear()
    monkeypatch.setattr(redistance, "_BRICK", 1)
    monkeypatch.setattr(redistance, "_CHUNK", 1000)
    np.testing.assert_allclose(distance_over(BALL, BOX, 1.0, 0.4)(points), whole, atol=1e-3)
    redistance._distance_over.cache_clear()


def test_the_surface_beyond_the_box_counts():
    """A box that the ball only looks into from above: the closest points lie below it."""
    low = ((-4.0, -4.0, 5.2), (4.0, 4.0, 7.0))
    field = frep.minimum(BALL, BALL.substitute(X, Y, Z - 12.1))
    points = RNG.uniform(*low, (2000, 3))
    distance = np.linalg.norm(points, axis=1) - R
    other = np.linalg.norm(points - (0, 0, 12.1), axis=1) - R
    clear = (distance < 1.5) & (distance < other - 1.0)
    assert clear.sum() > 50
    np.testing.assert_allclose(distance_over(field, low, 1.5, 0.2)(points)[clear], distance[clear], atol=3e-3)


def test_reach_by_a_field():
    """Where the reach is zero the sign stays; elsewhere the distance is that of everywhere."""
    law = frep.where(X > 0, 1.0, 0.0)
    found = distance_over(BALL, BOX, law, 0.5)(POINTS)
    right = NEAR & (POINTS[:, 0] > 0)
    np.testing.assert_allclose(found[right], TO_BALL[right], atol=1e-3)
    far = np.abs(TO_BALL) > 0.5
    np.testing.assert_array_equal(found[far] < 0, TO_BALL[far] < 0)
    # A near point of the surface instead of the closest: not nearer, and farther by a spacing at most.
    left = NEAR & (POINTS[:, 0] < -1)
    assert np.all(np.abs(found[left]) > np.abs(TO_BALL[left]) - 0.05)
    assert np.all(np.abs(found[left]) < np.abs(TO_BALL[left]) + 0.5)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-12, 9)] * 3),
    st.tuples(*[st.floats(0, 6)] * 3),
    st.lists(st.tuples(*[st.floats(0, 1)] * 3), min_size=1, max_size=8),
)
def test_bounds_enclose(low, size, places):
    field = distance_over(BALL, BOX, 1.0, 1.0)
    low, high = np.array(low), np.array(low) + size
    least, most = field.bounds(low, high)
    values = field(np.clip(low + np.array(places) * size, low, high))
    assert np.all(values >= least - 1e-6)
    assert np.all(values <= most + 1e-6)


def test_spline_in_a_box_is_scipys():
    values = RNG.normal(size=(9, 7, 8)).astype(np.float32)
    origin, spacing = np.array([1.0, -2.0, 300.0]), np.array([0.5, 0.7, 0.9])
    spline = BoxSpline(origin, spacing, values)
    index = RNG.uniform(1.0, np.array(values.shape) - 2.0, (500, 3))
    points = origin + spacing * index
    expected = map_coordinates(values.astype(float), index.T, order=3, mode="mirror")
    np.testing.assert_allclose(spline.field()(points), expected, atol=2e-5)
    # Beyond, the value at the nearest point goes on.
    lo, hi = origin + spacing, origin + spacing * (np.array(values.shape) - 2)
    outside = RNG.uniform(lo - 3, hi + 3, (500, 3))
    held = np.clip(outside, lo, hi)
    np.testing.assert_allclose(spline.field()(outside), spline.field()(held), atol=1e-5)
    again = pickle.loads(pickle.dumps(spline.field()))
    assert again is spline.field()
    moved = BoxSpline(origin + 1, spacing, values).field()
    np.testing.assert_allclose(moved(points + 1), expected, atol=2e-5)


def test_two_surfaces_up_to_the_middle_between_them():
    """Nodes follow the nearer of two sheets, also beside the place where both are equally far."""
    other = (X - 13.3) ** 2 + Y**2 + Z**2 - 36.0
    box = ((1.0, -6.0, -6.0), (11.0, 6.0, 6.0))
    step = 0.4
    found = distance_over(frep.minimum(BALL, other), box, 3.0, step)
    axes = [np.arange(lo, hi, step) for lo, hi in zip(*box, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    both = np.stack([np.linalg.norm(nodes, axis=1) - R, np.linalg.norm(nodes - (13.3, 0, 0), axis=1) - 6.0])
    nearest = np.abs(both).min(axis=0)
    near = nearest < 3.0
    # At nodes the spline is what was found there: within a hundredth of a spacing even on the crease.
    np.testing.assert_allclose(np.abs(found(nodes))[near], nearest[near], atol=0.01 * step)


@pytest.mark.parametrize("period", [(1.0, 3.0, 1.0), (2.0, 1.0, 1.5)])
def test_planes_in_a_flat_period(period):
    """cos(2 pi x / a) is zero on planes a half period apart: the distance is a triangle wave, at nodes exactly."""
    field = frep.cos(X * (math.tau / period[0])) + 0.0 * Y
    distance = periodic_distance(field, period)
    n = round(redistance.NODES * period[0] / min(period))
    nodes = np.stack([np.arange(n) * period[0] / n, np.full(n, 0.25 * period[1]), np.full(n, 0.5 * period[2])], 1)
    folded = np.abs((nodes[:, 0] / period[0] + 0.5) % 1.0 - 0.5)
    np.testing.assert_allclose(distance(nodes), (np.abs(folded) - 0.25) * -period[0], atol=1e-5 * period[0])


def test_a_surface_that_is_more_than_a_quarter_of_the_period_away():
    """Small bubbles of cos x + cos y + cos z = 5/2, one a period: from the corner of the cell the nearest is on the diagonal."""
    distance = periodic_distance(frep.cos(X) + frep.cos(Y) + frep.cos(Z) - 2.5, (math.tau,) * 3)
    pole = math.acos(2.5 / 3.0)
    corner = np.full((1, 3), math.pi)
    assert float(np.abs(distance(corner))[0]) == pytest.approx(math.sqrt(3) * (math.pi - pole), rel=0.02)
    diagonal = np.linspace(0.9, 2.0, 20)[:, None] * np.ones(3)
    np.testing.assert_allclose(-distance(diagonal), math.sqrt(3) * (diagonal[:, 0] - pole), atol=1e-3)


def test_a_field_that_is_no_number():
    """In the box it is refused, with a place; beyond, where nobody asked, there is no surface."""
    hole = frep.sqrt(9.5 - X)
    with pytest.raises(frep.FunctionError, match=r"surface: .*NaN.* at \(") as found:
        distance_over(BALL + 1e-9 * frep.sqrt(2.0 - X), BOX, 1.0, 0.5)
    assert found.value.point is not None
    assert found.value.point[0] > 2.0
    whole = distance_over(BALL + 1e-9 * hole, BOX, 1.0, 0.5)(POINTS)
    np.testing.assert_allclose(whole[NEAR], TO_BALL[NEAR], atol=1e-3)
    with pytest.raises(frep.FunctionError, match="surface"):
        periodic_distance(frep.cos(X) + frep.sqrt(frep.cos(Y)), (math.tau,) * 3)


def test_a_solid_box_and_the_default_spacing():
    found = distance_over(BALL, frep.box(*BOX), 0.5)
    points = POINTS[np.abs(TO_BALL) < 0.5][:300]
    np.testing.assert_allclose(found(points), np.linalg.norm(points, axis=1) - R, atol=1e-3)


@pytest.mark.parametrize(
    ("argument", "error", "call"),
    [
        ("reach", ArgumentError, lambda: distance_over(BALL, BOX, 0.0, 1.0)),
        ("reach", ArgumentError, lambda: distance_over(BALL, BOX, frep.clip(X, -2, -1), 1.0)),
        ("spacing", ArgumentError, lambda: distance_over(BALL, BOX, 1.0, -1.0)),
        ("spacing", TooLargeError, lambda: distance_over(BALL, BOX, 1.0, 0.001)),
        ("over", UnboundedError, lambda: distance_over(BALL, frep.half_space((0, 0, 1)), 1.0, 1.0)),
        ("over", ArgumentTypeError, lambda: distance_over(BALL, 3, 1.0, 1.0)),
        ("over", ArgumentError, lambda: distance_over(BALL, (BOX[1], BOX[0]), 1.0, 1.0)),
        ("surface", ArgumentError, lambda: distance_over(BALL + 100, BOX, 1.0, 1.0)),
    ],
)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
