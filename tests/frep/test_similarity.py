"""Similarities: one-parameter groups, their round trips through frames and matrices, and what they refuse."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from frep import ArgumentError, ArgumentTypeError
from frep.similarity import Screw, Similarity, Swirl, Translation, planar

COORDINATES = st.floats(-10, 10, allow_subnormal=False)
POINTS = st.tuples(COORDINATES, COORDINATES, COORDINATES)
NEAR_ONE = st.sampled_from([1.0, 1 + 1e-12, 1 - 1e-12, 1 + 1e-6, 1 - 1e-9])
SCALES = st.one_of(NEAR_ONE, st.floats(0.5, 2))
CAREFUL_ANGLES = st.sampled_from([0.0, 1e-12, -1e-9, 1e-5, math.pi, -math.pi, math.pi - 1e-9, math.pi + 1e-9])
TURNS = st.one_of(CAREFUL_ANGLES, st.floats(-3, 3), st.floats(-30, 30))  # several turns among them
AXES = st.one_of(
    st.sampled_from([(1.0, -1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, -2.0)]),
    POINTS.filter(lambda a: np.linalg.norm(a) > 1e-3),
)
SCREWS = st.builds(Screw, TURNS, AXES, POINTS, COORDINATES)
SWIRLS = st.builds(Swirl, SCALES, POINTS, TURNS, AXES)
ALL = st.one_of(SCREWS, SWIRLS, st.builds(Translation, POINTS), st.just(Similarity.identity()))
EXPONENTS = st.floats(-2, 2)


def assert_same(a: np.ndarray, b: np.ndarray, tolerance: float = 1e-12) -> None:
    assert_allclose(a, b, rtol=0, atol=tolerance * (1 + np.abs(b).max()))


def frames(similarity: Similarity, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Some frame, and its image."""
    a = Swirl(1.7, (3.0, -1.0, 2.0), 1.1, np.random.default_rng(seed).normal(size=3)).matrix
    return a, similarity.matrix @ a


# The group


@given(ALL, EXPONENTS, EXPONENTS)
def test_exponents_add(s, a, b):
    assert_same((s.power(a) @ s.power(b)).matrix, s.power(a + b).matrix, 1e-11)


@given(ALL)
def test_half_twice_is_the_whole(s):
    assert_same((s.power(0.5) @ s.power(0.5)).matrix, s.matrix)


@given(ALL)
def test_inverse_undoes(s):
    assert_same((s @ s.inverse()).matrix, np.eye(4), 1e-11)
    assert s.inverse() == s.power(-1)
    assert s.power(0).kind == "identity"


@given(ALL, st.integers(0, 6))
def test_whole_powers_repeat(s, n):
    repeated = Similarity.identity()
    for _ in range(n):
        repeated = s @ repeated
    assert_same(repeated.matrix, s.power(n).matrix, 1e-11)
    assert_same(np.linalg.matrix_power(s.matrix, n), s.power(n).matrix, 1e-11)


@given(ALL, st.lists(EXPONENTS, max_size=5))
def test_powers_are_the_power_of_each(s, ts):
    together = s.powers(ts)
    assert together.shape == (len(ts), 4, 4)
    for m, t in zip(together, ts, strict=True):
        assert_same(m, s.power(t).matrix, 1e-13)


@given(ALL, ALL)
def test_products_are_those_of_the_matrices(s, t):
    assert_same((s @ t).matrix, s.matrix @ t.matrix)
    assert 0.0 <= (s @ t).angle <= math.pi


@given(ALL, POINTS)
def test_apply_is_the_matrix(s, p):
    image = s.apply(p)
    assert image.shape == (3,)
    assert_same(image, s.matrix[:3, :3] @ p + s.translation)
    assert_same(s.apply([p, p])[1], image)
    assert_same(s.scale * s.rotation, s.matrix[:3, :3])
    assert s.apply(np.zeros((0, 3))).shape == (0, 3)


@given(ALL)
def test_the_matrix_is_the_exponential_of_the_generator(s):
    expm = pytest.importorskip("scipy.linalg").expm
    assert_same(expm(s.generator), s.matrix, 1e-11)


def test_an_angle_of_many_turns_is_kept():
    once = Swirl(1.2, (1, 2, 3), 17.0)
    assert once.power(0.5).angle == 8.5
    assert_same(once.power(0.5).rotation, Screw(8.5).rotation)


@pytest.mark.parametrize("log_scale", [1e-12, -1e-12, 1e-300])
@pytest.mark.parametrize("angle", [0.0, 1e-12])
def test_near_the_identity_no_digit_is_lost(log_scale, angle):
    s = Similarity(log_scale, angle, (0, 0, 1), (1.0, 2.0, 3.0))  # its centre is 1e12 mm away
    assert_allclose(s.translation, (1.0, 2.0, 3.0), rtol=1e-11)
    assert_allclose(
        s.power(1e12).translation[2], 3e12 * (math.expm1(1e12 * log_scale) / (1e12 * log_scale)), rtol=1e-14
    )


# Frames, matrices and back (spec O1)


@given(ALL)
def test_from_frames_takes_the_first_to_the_second(s):
    a, b = frames(s)
    found = Similarity.from_frames(a, b)
    assert_same(found.matrix @ a, b)
    assert_same(found.matrix, s.matrix, 1e-11)
    assert_same((found.power(0.5) @ found.power(0.5)).matrix @ a, b)
    assert 0.0 <= found.angle <= math.pi


@given(ALL)
def test_from_matrix_round_trip(s):
    found = Similarity.from_matrix(s.matrix)
    assert_same(found.matrix, s.matrix)
    assert_same(Similarity.from_matrix(s.matrix[:3]).matrix, s.matrix)
    assert 0.0 <= found.angle <= math.pi


@given(st.floats(0.6, 1.8), POINTS, st.floats(0.1, 3.0), AXES)
def test_swirl_is_recovered(scale, center, angle, axis):
    swirl = Swirl(scale, center, angle, axis)
    if abs(scale - 1) < 1e-2:
        return
    found = Similarity.from_frames(*frames(swirl))
    assert_allclose(found.scale, scale, rtol=1e-13)
    assert_allclose(found.angle, angle, rtol=1e-12)
    assert_allclose(found.axis, np.array(axis) / np.linalg.norm(axis), atol=1e-12)
    assert_allclose(found.fixed_point, center, atol=1e-9)
    assert_allclose(swirl.apply(center), center, atol=1e-12)
    assert found.kind == "swirl"
    assert found.pitch is None


@given(POINTS, st.floats(0.1, 3.0), AXES, COORDINATES)
def test_screw_is_recovered(point, angle, axis, pitch):
    found = Similarity.from_frames(*frames(Screw(angle, axis, point, pitch)))
    unit = np.array(axis) / np.linalg.norm(axis)
    assert found.kind == "screw"
    assert found.fixed_point is None
    assert found.pitch == pytest.approx(pitch, abs=1e-10)
    assert_allclose(found.angle, angle, rtol=1e-12)
    assert_allclose(found.axis, unit, atol=1e-12)
    assert_allclose(found.point, point - (unit @ point) * unit, atol=1e-9)
    assert_allclose(found.apply(found.point), found.point + pitch * unit, atol=1e-10)


def test_axis_across_the_sum_of_the_axes():
    found = Similarity.from_frames(*frames(Screw(1.0, (1, -1, 0))))  # the thesis's (2.10) gives axis 0 here
    assert_allclose(found.axis, np.array([1, -1, 0]) / math.sqrt(2), atol=1e-14)
    assert found.angle == pytest.approx(1.0, abs=1e-14)
    assert found.kind == "screw"


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -1, 0), (1, 2, 3), (-1, 1e-9, 0)])
@pytest.mark.parametrize("short", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_half_turns(axis, short):
    screw = Screw(math.pi - short, axis, (1, 2, 3), 4.0)
    found = Similarity.from_frames(*frames(screw))
    assert_same(found.matrix, screw.matrix, 1e-13)
    assert found.angle == pytest.approx(math.pi - short, abs=1e-14)
    assert abs(found.axis @ screw.axis) == pytest.approx(1.0, abs=1e-14)


def test_pure_dilation_has_the_closed_form_centre():
    a, b = frames(Swirl(3.0, (1.0, 5.0, -2.0)))
    found = Similarity.from_frames(a, b)
    assert_allclose(found.fixed_point, (3.0 * a[:3, 3] - b[:3, 3]) / 2.0, atol=1e-13)
    assert found.angle == 0.0
    assert found.point is None


def test_pure_translation():
    found = Similarity.from_frames(*frames(Translation((1.0, 5.0, -2.0))))
    assert found.kind == "translation"
    assert_allclose(found.velocity, (1.0, 5.0, -2.0), atol=1e-14)
    assert found.pitch == pytest.approx(math.sqrt(30))
    assert Similarity.from_frames(np.eye(4), np.eye(4)) == Similarity.identity()


def test_a_frame_may_be_three_vectors():
    a = ((1, 2, 3), (2, 0, 0), (0, 2, 0))
    b = np.array([[0, -4, 0, 5], [4, 0, 0, 6], [0, 0, 4, 7]])
    found = Similarity.from_frames(a, b)
    assert_allclose(found.apply([(1, 2, 3), (3, 2, 3), (1, 4, 3)]), [(5, 6, 7), (5, 10, 7), (1, 6, 7)], atol=1e-13)


def test_far_from_the_origin_frames_still_meet():
    here = Translation((1e6, -2e6, 5e5))
    a = here.matrix
    b = (here @ Swirl(1 + 1e-9, (1.0, 0.0, 0.0), 1e-7, (1, 1, 1))).matrix
    found = Similarity.from_frames(a, b)
    assert_allclose(found.matrix @ a, b, rtol=1e-15, atol=1e-9)


@given(ALL.filter(lambda s: abs(s.angle) < 3.1), st.integers(2, 9))
def test_interpolating_ends_on_the_last_frame(s, count):
    a, b = frames(s)
    step = Similarity.interpolating(a, b, count)
    assert_same(step.power(count - 1).matrix @ a, b)
    assert_same(step.matrix, s.power(1 / (count - 1)).matrix, 1e-11)


# The plane


@given(
    *(st.tuples(COORDINATES, COORDINATES) for _ in range(4)),
)
def test_planar_takes_pair_to_pair(a, b, c, d):
    if math.dist(a, b) < 1e-3 or math.dist(c, d) < 1e-3:
        return
    s = planar((a, b), (c, d))
    assert_allclose(s.apply([(*a, 7.0 / s.scale), (*b, 0.0)])[:, :2], [c, d], atol=1e-11 * (1 + s.scale))
    assert -math.pi < s.angle <= math.pi
    assert s.translation[2] == 0.0


def test_planar_translation_and_half_turn():
    s = planar([(0.1, 0.2), (1.3, 0.7)], [(0.1 + 0.3, 0.2 + 0.6), (1.3 + 0.3, 0.7 + 0.6)])
    assert s.kind == "translation"
    assert_allclose(s.velocity, (0.3, 0.6, 0.0), atol=1e-15)
    assert planar([(0, 0), (1, 0)], [(0, 0), (-1, -0.0)]).angle == math.pi
    assert planar([(0, 0), (0, 1)], [(5, 0), (5, 1)]).axis.tolist() == [1, 0, 0]


# Commuting


def test_what_commutes():
    z_screw, z_swirl = Screw(1.0, pitch=3.0), Swirl(1.1, angle=5.0)
    assert Screw(1.0).commutes_with(z_screw)
    assert Screw(1.0).commutes_with(z_swirl)
    assert Translation((1, 2, 3)).commutes_with(Translation((3, 2, -7)))
    assert Similarity.identity().commutes_with(Screw(1.0, "x"))
    assert not z_screw.commutes_with(z_swirl)  # the swirl scales the pitch
    assert not Screw(1.0).commutes_with(Screw(1.0, "x"))
    assert not Screw(2 * math.pi).commutes_with(Screw(2 * math.pi, "x"))  # two identities, not their halves
    assert not Screw(1.0).commutes_with(Screw(1.0, point=(1, 0, 0)))
    assert Screw(1.0).commutes_with(Screw(1.0, point=(1e-12, 0, 0)), size=100.0)


@given(ALL, ALL, EXPONENTS, EXPONENTS)
def test_commuting_means_that_powers_commute(s, t, a, b):
    if s.commutes_with(t, size=10.0, tolerance=1e-13):
        s, t = s.power(a), t.power(b)
        assert_same((s @ t).matrix, (t @ s).matrix, 1e-8)


@given(ALL, EXPONENTS, st.floats(1e-6, 1e3))
def test_a_group_commutes_with_itself(s, a, size):
    assert s.commutes_with(s.power(a), size=size)


# Identity as a value


@given(ALL, EXPONENTS)
def test_repr_is_the_same_value(s, t):
    for each in (s, s.power(t), s @ s):
        again = eval(repr(each))
        assert again == each
        assert hash(again) == hash(each)
        assert again.matrix.tobytes() == each.matrix.tobytes()
        assert pickle.loads(pickle.dumps(each)) == each


def test_repr_reads_as_it_was_written():
    assert repr(Screw(0.5, "x", (1, 2, 3), 4)) == "Screw(0.5, axis='x', point=(1.0, 2.0, 3.0), pitch=4.0)"
    assert repr(Swirl(2, angle=1, axis=(1, 1, 0))) == (
        "Swirl(2.0, center=(0.0, 0.0, 0.0), angle=1.0, axis=(1.0, 1.0, 0.0))"
    )
    assert repr(Translation((1, 2, 3))) == "Translation((1.0, 2.0, 3.0))"


def test_equality_is_of_values():
    assert Screw(1.0, "z") == Screw(-1.0, (0, 0, -1))
    assert Screw(1.0) != Screw(1.0 + 2**-52)
    assert Translation((0, 0, 1)) == Screw(0.0, pitch=1.0)
    assert Screw(1.0) != "Screw"
    assert len({Screw(1.0), Screw(1.0), Translation((1, 0, 0))}) == 2


def test_kinds():
    assert Similarity.identity().kind == "identity"
    assert Translation((0, 1, 0)).kind == "translation"
    assert Screw(1.0).kind == "screw"
    assert Swirl(2.0).kind == "swirl"
    assert Swirl(1.0, angle=1.0).kind == "screw"


def test_values_cannot_be_changed():
    s = Screw(1.0)
    for array in (s.axis, s.velocity, s.matrix, s.translation):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 3.0
    with pytest.raises(AttributeError):
        s.angle = 2.0


# What is refused

EYE = np.eye(4)


def changed(row: int, column: int, value: float) -> np.ndarray:
    m = np.eye(4)
    m[row, column] = value
    return m


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Swirl(0.0), "scale: expected a number > 0, got 0.0; mirror images"),
        (lambda: Swirl(-1.0), "mirror images are not similarities of a steady lattice"),
        (lambda: Swirl(math.nan), "scale: .*finite"),
        (lambda: Swirl(2.0, (0, 0)), "center"),
        (lambda: Swirl(2.0, angle=math.inf), "angle"),
        (lambda: Screw("a"), "angle.*'a'"),
        (lambda: Screw(1.0, "w"), "axis.*'w'"),
        (lambda: Screw(1.0, (0, 0, 0)), "axis.*not zero"),
        (lambda: Screw(1.0, point=(0, math.nan, 0)), "point"),
        (lambda: Screw(1.0, pitch=math.nan), "pitch"),
        (lambda: Translation((1, 2)), "shift"),
        (lambda: Similarity(math.nan, 0.0, (0, 0, 1), (0, 0, 0)), "log_scale"),
        (lambda: Similarity(0.0, 0.0, (0, 0, 1.1), (0, 0, 0)), r"axis.*length 1, got length 1\.1"),
        (lambda: Similarity(0.0, 0.0, (0, 0, 1), (0, 0)), "velocity"),
        (lambda: Similarity.from_matrix(np.eye(3)), r"m: .*\(3, 3\)"),
        (lambda: Similarity.from_matrix("abc"), "m: .*'abc'"),
        (lambda: Similarity.from_matrix(changed(3, 0, 1.0)), r"m: expected the last row \(0, 0, 0, 1\)"),
        (lambda: Similarity.from_matrix(changed(0, 0, math.nan)), "m: expected finite"),
        (lambda: Similarity.from_frames(changed(2, 2, -1.0), EYE), "^a: .*left-handed.*mirror"),
        (lambda: Similarity.from_frames(EYE, -EYE[:3]), "^b: .*left-handed"),
        (lambda: Similarity.from_frames(EYE, changed(2, 2, 0.0)), "^b: .*above 0"),
        (lambda: Similarity.from_frames(EYE, changed(0, 0, 1.25)), r"^b: .*one length.*miss by 0\.\d+"),
        (lambda: Similarity.from_frames(changed(0, 1, 0.001), EYE), "^a: .*orthogonal.*miss by 0.001"),
        (lambda: Similarity.from_frames(EYE, ((0, 0, 0), (1, 0, 0), (0.5, 1, 0))), "^b: .*orthogonal"),
        (lambda: Similarity.from_frames(EYE, ((0, 0, 0), (0, 0, 0), (0, 0, 0))), "^b: .*above 0"),
        (lambda: Similarity.from_frames(EYE, ((0, 0, math.inf), (1, 0, 0), (0, 1, 0))), "^b: .*finite"),
        (lambda: Similarity.from_frames(np.eye(2), EYE), r"^a: .*shape \(2, 2\)"),
        (lambda: Similarity.from_frames(((0, 0, 0), (1, 0), (0, 1, 0)), EYE), "^a: "),
        (lambda: Similarity.interpolating(EYE, -EYE[:3], 3), "^last: "),
        (lambda: Similarity.interpolating(EYE, EYE, 1), "^count: .*2 or more, got 1"),
        (lambda: Similarity.interpolating(EYE, EYE, 2.5), "^count: .*2.5"),
        (lambda: Similarity.interpolating(EYE, EYE, True), "^count: .*True"),
        (lambda: planar([(0, 0), (0, 0)], [(0, 0), (1, 0)]), r"^pair_a: .*\(0.0, 0.0\) twice"),
        (lambda: planar([(0, 0), (1, 0)], [(2, 1), (2, 1)]), "^pair_b: .*twice"),
        (lambda: planar([(0, 0), (1, math.nan)], [(2, 1), (2, 1)]), "^pair_a: .*finite"),
        (lambda: planar([(0, 0, 0), (1, 0, 0)], [(2, 1), (2, 1)]), "^pair_a: .*two points"),
        (lambda: Screw(1.0).power(math.nan), "^t: "),
        (lambda: Screw(1.0).powers([1.0, math.inf]), "^ts: "),
        (lambda: Screw(1.0).powers(1.0), "^ts: "),
        (lambda: Swirl(10.0).powers([400.0]), "^ts: the scale"),
        (lambda: Screw(1.0).apply([[1.0, 2.0]]), r"^points: .*\(1, 2\)"),
        (lambda: Screw(1.0).apply([math.nan] * 3), "^points: .*finite"),
        (lambda: Screw(1.0).commutes_with(3), "^other: "),
        (lambda: Screw(1.0).commutes_with(Screw(1.0), size=0.0), "^size: "),
        (lambda: Screw(1.0).commutes_with(Screw(1.0), tolerance=-1.0), "^tolerance: "),
    ],
)
def test_bad_input_is_named(make, says):
    with pytest.raises((ArgumentError, ArgumentTypeError), match=says):
        make()


def test_only_similarities_multiply():
    with pytest.raises(TypeError):
        Screw(1.0) @ np.eye(4)
