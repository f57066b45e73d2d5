"""Steady maps: control points are met, iso-curves are the paths of similarities, rectified balls are balls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from conformal.steady_map import SteadyMap, rectify, steady_template
from frep import ArgumentError, ArgumentTypeError, FunctionError
from frep.similarity import Screw, Similarity, Swirl, Translation

COORDINATES = st.floats(-10, 10, allow_subnormal=False)
PLANE = st.tuples(COORDINATES, COORDINATES)
SPACE = st.tuples(COORDINATES, COORDINATES, COORDINATES)
AXES = SPACE.filter(lambda a: np.linalg.norm(a) > 1e-3)
UNIT = st.floats(0, 1)
SIMILARITIES = st.one_of(
    st.builds(Swirl, st.floats(0.5, 2), SPACE, st.floats(-3, 3), AXES),
    st.builds(Screw, st.floats(-3, 3), AXES, SPACE, COORDINATES),
    st.builds(Translation, SPACE),
)
MAPS = st.builds(SteadyMap, SIMILARITIES, SIMILARITIES, SIMILARITIES, SPACE)
BOX = SteadyMap(Translation((1, 0, 0)), Translation((0, 1, 0)), Translation((0, 0, 1)))
ARCH = SteadyMap(Swirl(1.4, (-30, 0, 0)), Screw(1.0, point=(-20, 0, 0)), Translation((0, 0, 8)), (10, 0, 0))
ARC = {"a": (0, 0), "b": (4, 0), "c": (0, 4), "d": (4, 5), "e": (2, 1)}
CORNERS = [(0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0)]


# Control


@given(PLANE, PLANE, PLANE, PLANE, PLANE)
def test_five_points_are_met(a, b, c, d, e):
    assume(min(math.dist(a, e), math.dist(e, b), math.dist(a, b), math.dist(c, d)) > 0.5)
    steady = SteadyMap.from_five_points(a=a, b=b, c=c, d=d, e=e)
    found = steady.apply(CORNERS)
    assert_allclose(found[:, :2], [a, b, c, d, e], atol=2e-12)
    assert not found[:, 2].any()


@given(PLANE, PLANE, PLANE, UNIT, UNIT)
def test_a_parallelogram_is_mapped_linearly(a, along, across, u, v):
    a, along, across = np.array(a), np.array(along), np.array(across)
    assume(np.linalg.norm(along) > 0.1)
    steady = SteadyMap.from_five_points(a=a, b=a + along, c=a + across, d=a + along + across, e=a + along / 2)
    assert_allclose(steady.apply((u, v))[:2], a + u * along + v * across, atol=1e-12)
    assert steady.u.kind == "translation"
    assert steady.v.kind in ("translation", "identity")


def test_a_side_may_bend_by_more_than_half_a_turn():
    # Three quarters of a circle from (1, 0) to (0, -1); its middle is at 135 degrees.
    middle = (-math.sqrt(0.5), math.sqrt(0.5))
    steady = SteadyMap.from_five_points(a=(1, 0), e=middle, b=(0, -1), c=(2, 0), d=(0, -2))
    assert steady.u.angle == pytest.approx(1.5 * math.pi)
    assert_allclose(np.linalg.norm(steady.iso_curve("u"), axis=1), 1.0, atol=1e-14)
    assert_allclose(np.linalg.norm(steady.iso_curve("u", v=1.0), axis=1), 2.0, atol=1e-14)


@given(SIMILARITIES, SIMILARITIES, SIMILARITIES, SIMILARITIES)
def test_three_and_four_frames_are_met(s, b, c, d):
    frames = [s.matrix, *((x @ s).matrix for x in (b, c, d))]
    steady = SteadyMap.from_frames(*frames)
    for parameters, frame in zip(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), frames, strict=True):
        size = 1e-11 * (1 + np.abs(frame).max())
        assert_allclose(steady.apply(parameters), frame[:3, 3], atol=size)
        assert_allclose(steady.at(*parameters).matrix @ frames[0], frame, atol=size)
    assert_allclose(
        SteadyMap.from_frames(*frames[:3]).apply((1, 0)), frames[1][:3, 3], atol=1e-11 * (1 + np.abs(frames[1]).max())
    )


def test_frames_of_three_vectors():
    steady = SteadyMap.from_frames(
        ((1, 2, 3), (1, 0, 0), (0, 1, 0)), ((5, 2, 3), (0, 2, 0), (-2, 0, 0)), ((1, 6, 3), (1, 0, 0), (0, 0, 1))
    )
    assert_allclose(steady.apply([(0, 0), (1, 0), (0, 1)]), [(1, 2, 3), (5, 2, 3), (1, 6, 3)], atol=1e-14)


# The map


@given(MAPS, UNIT, UNIT, UNIT)
def test_u_acts_first_then_v_then_w(steady, u, v, w):
    by_hand = steady.w.power(w).apply(steady.v.power(v).apply(steady.u.power(u).apply(steady.origin)))
    size = 1e-12 * (1 + np.abs(by_hand).max())
    assert_allclose(steady.apply((u, v, w)), by_hand, atol=size)
    assert_allclose(steady.at(u, v, w).apply(steady.origin), by_hand, atol=10 * size)


@given(MAPS, UNIT, UNIT, UNIT)
def test_the_last_parameter_is_steady(steady, u, v, w):
    moved = steady.w.power(0.3).apply(steady.apply((u, v, w)))
    assert_allclose(steady.apply((u, v, w + 0.3)), moved, atol=1e-12 * (1 + np.abs(moved).max()))


def test_many_points_at_once():
    parameters = np.random.default_rng(1).random((100_000, 3))
    images = ARCH.apply(parameters)
    for i in (0, 32767, 32768, 99_999):
        assert_allclose(images[i], ARCH.apply(parameters[i]), rtol=1e-15)
    assert ARCH.apply(np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("along", ["u", "v", "w"])
def test_iso_curves(along):
    curve = ARCH.iso_curve(along, u=0.2, v=0.3, w=0.4, count=5)
    fixed = {"u": 0.2, "v": 0.3, "w": 0.4}
    for t, point in zip(np.linspace(0, 1, 5), curve, strict=True):
        assert_allclose(point, ARCH.apply(list((fixed | {along: t}).values())), rtol=1e-15)


# Rectification


@given(SPACE, st.floats(0.01, 5), st.sampled_from([4, 5, 30]))
def test_the_identity_returns_the_ball(center, radius, samples):
    for warp in (BOX, lambda p: p):
        c, r = rectify(warp, center, radius, samples=samples)
        assert_allclose(c, center, atol=1e-12)
        assert r == pytest.approx(radius, rel=1e-11)


@given(SIMILARITIES, SPACE, st.floats(0.1, 5), st.sampled_from([4, 5, 30]))
def test_a_similarity_returns_the_image_ball(s, center, radius, samples):
    c, r = rectify(s.apply, center, radius, samples=samples)
    assert_allclose(c, s.apply(center), atol=1e-11 * (1 + s.scale))
    assert r == pytest.approx(s.scale * radius, rel=1e-11)


def test_the_sphere_passes_through_the_four_images():
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / math.sqrt(3)
    images = ARCH.apply((0.5, 0.5, 0.5) + 0.1 * corners)
    c, r = rectify(ARCH, (0.5, 0.5, 0.5), 0.1)
    assert_allclose(np.linalg.norm(images - c, axis=1), r, rtol=1e-12)


def test_small_balls_under_a_conformal_warp_tend_to_their_images():
    """Inversion maps spheres to spheres, so that any samples give the same one."""

    def invert(p):
        return p / np.sum(p**2, axis=1, keepdims=True)

    for samples in (4, 7, 40):
        c, r = rectify(invert, (3.0, 0.0, 0.0), 1.0, samples=samples)
        assert_allclose(c, (3 / 8, 0, 0), atol=1e-13)  # the sphere with the diameter from 1/4 to 1/2
        assert r == pytest.approx(1 / 8, rel=1e-12)


def test_a_disk_on_a_surface():
    plane = SteadyMap(Translation((2, 0, 0)), Translation((0, 0, 2)), origin=(1, 2, 3))
    c, r = rectify(plane, (0.5, 0.25), 0.125)
    assert_allclose(c, (2, 2, 3.5), atol=1e-14)
    assert r == pytest.approx(0.25, rel=1e-14)


@pytest.mark.parametrize("thickness", [0.0, 1e-9, 1e-3])
def test_flat_images_are_refused(thickness):
    def flatten(p):
        return p * (1.0, 1.0, thickness)

    with pytest.raises(ArgumentError, match=r"center \(0\.0, 0\.0, 1\.0\), radius 0\.5.*nearly coplanar"):
        rectify(flatten, (0, 0, 1), 0.5)
    with pytest.raises(ArgumentError, match="collinear"):
        rectify(lambda p: np.column_stack((p[:, 0], thickness * p[:, 1], 0 * p[:, 0])), (0, 0), 0.5)
    with pytest.raises(ArgumentError, match="coplanar"):
        rectify(lambda p: np.zeros((len(p), 3)), (0, 0, 1), 0.5)


# Templates


def test_the_template_of_a_box_is_the_scaled_cell():
    box = SteadyMap(Translation((40, 0, 0)), Translation((0, 20, 0)), Translation((0, 0, 10)), (1, 2, 3))
    cell = steady_template(box, [(0, 0, 0), (0.5, 0.25, 0.75)], [0.1, 0.2], (8, 4, 2))
    assert_allclose(cell.nodes, [(1, 2, 3), (3.5, 3.25, 6.75)], atol=1e-13)
    assert_allclose(cell.radii, [0.5, 1.0], rtol=1e-13)
    assert cell.counts == (8, 4, 2)
    assert_allclose([s.translation for s in (cell.u, cell.v, cell.w)], 5 * np.eye(3), atol=1e-15)


@given(MAPS)
def test_the_steps_of_a_template_walk_the_map(steady):
    u, v, w = steady.steps((3, 4, 5))
    for i, j, k in ((0, 0, 0), (3, 0, 0), (2, 3, 1), (3, 4, 5)):
        carried = (w.power(k) @ v.power(j) @ u.power(i)).apply(steady.origin)
        expected = steady.apply((i / 3, j / 4, k / 5))
        assert_allclose(carried, expected, atol=1e-10 * (1 + np.abs(expected).max()))


def test_a_template_lies_along_its_map():
    cell = steady_template(ARCH, [(0.5, 0.5, 0.5)], 0.01, (6, 5, 2))  # small balls: hardly warped
    center = ARCH.apply((0.5 / 6, 0.5 / 5, 0.5 / 2))
    assert np.linalg.norm(cell.nodes[0] - center) < cell.radii[0]


def test_a_surface_has_one_layer():
    vault = SteadyMap(Translation((0, 0, 50)), Screw(math.pi / 2), origin=(10, 0, 0))
    cell = steady_template(vault, [(0.5, 0.5)], 0.1, (10, 3))
    assert cell.counts == (10, 3, 1)
    assert cell.w == Similarity.identity()
    assert_allclose(cell.nodes[0], 10 * np.array([math.cos(math.pi / 12), math.sin(math.pi / 12), 0.25]), rtol=1e-2)
    assert 0.5 <= cell.radii[0] <= 10 * math.pi / 6 * 0.1


# What is refused


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: SteadyMap(3, Screw(1.0)), "^u: expected a Similarity, got 3"),
        (lambda: SteadyMap(Screw(1.0), None), "^v: expected a Similarity, got None"),
        (lambda: SteadyMap(Screw(1.0), Screw(1.0), "w"), "^w: "),
        (lambda: SteadyMap(Screw(1.0), Screw(1.0), origin=(0, 0)), "^origin: "),
        (lambda: SteadyMap.from_five_points(**ARC | {"e": (0, 0)}), r"^a, e: .*\(0.0, 0.0\)"),
        (lambda: SteadyMap.from_five_points(**ARC | {"e": (4, 0)}), "^e, b: "),
        (lambda: SteadyMap.from_five_points(**ARC | {"b": (0, 0)}), "^a, b: "),
        (lambda: SteadyMap.from_five_points(**ARC | {"d": (0, 4)}), "^c, d: "),
        (lambda: SteadyMap.from_five_points(**ARC | {"d": (0, 4, 1)}), "^d: expected a point"),
        (lambda: SteadyMap.from_five_points(**ARC | {"c": (0, math.nan)}), "^c: expected finite"),
        (lambda: SteadyMap.from_frames(np.eye(3, 4), -np.eye(3, 4), np.eye(3, 4)), "^b: .*left-handed"),
        (lambda: SteadyMap.from_frames(np.eye(3, 4), np.eye(3, 4), np.eye(2)), "^c: .*shape"),
        (lambda: BOX.apply((0, 0)), r"^parameters: .*\(n, 3\).*\(2,\)"),
        (lambda: BOX.apply((0, 0, math.nan)), "^parameters: .*finite"),
        (lambda: SteadyMap(Screw(1.0), Screw(1.0)).at(0, 0, 1), "^w: this map has u and v only"),
        (lambda: SteadyMap(Screw(1.0), Screw(1.0)).iso_curve("w"), "^along: expected one of u, v, got 'w'"),
        (lambda: SteadyMap(Screw(1.0), Screw(1.0)).iso_curve("u", w=1), "^w: this map"),
        (lambda: BOX.iso_curve("u", count=1), "^count: .*2 or more"),
        (lambda: BOX.at(math.inf), "^u: "),
        (lambda: BOX.steps((1, 2)), "^counts: expected 3"),
        (lambda: BOX.steps(3), "^counts: expected 3"),
        (lambda: BOX.steps((1, 2, 0)), "^counts: .*1 or more, got 0"),
        (lambda: BOX.steps((1, 2, 1.5)), "^counts: .*1.5"),
        (lambda: rectify(BOX, (0, 0, 0), 0.0), "^radius: "),
        (lambda: rectify(BOX, (0, 0, 0, 0), 1.0), "^center: "),
        (lambda: rectify(BOX, (0, 0, 0), 1.0, samples=3), "^samples: .*4 or more"),
        (lambda: rectify(3, (0, 0, 0), 1.0), "^warp: "),
        (lambda: rectify(lambda p: p[:2], (0, 0, 0), 1.0), r"^warp: expected \(4, 3\).*\(2, 3\)"),
        (lambda: rectify(lambda p: p * math.nan, (0, 0, 0), 1.0), "^warp: .*not finite"),
        (lambda: steady_template(3, [(0, 0, 0)], 0.1, (1, 1, 1)), "^warp: "),
        (lambda: steady_template(BOX, [(0, 0)], 0.1, (1, 1, 1)), "^nodes: "),
        (lambda: steady_template(BOX, np.zeros((0, 3)), 0.1, (1, 1, 1)), "^nodes: "),
        (lambda: steady_template(BOX, [(0, 0, 0)], [0.1, 0.2], (1, 1, 1)), "^radii: "),
        (lambda: steady_template(BOX, [(0, 0, 0)], 0.0, (1, 1, 1)), "^radii: .*> 0"),
        (lambda: steady_template(BOX, [(0, 0, 0)], "x", (1, 1, 1)), "^radii: .*'x'"),
    ],
)
def test_bad_input_is_named(make, says):
    with pytest.raises((ArgumentError, ArgumentTypeError, FunctionError), match=says):
        make()
