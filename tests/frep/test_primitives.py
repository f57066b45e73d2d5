"""Primitives: exact signed distances against brute force, unit slope, tight bounds, closed-form volumes, clear refusals."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, Solid

RNG = np.random.default_rng(11)
OBLIQUE = np.array([0.48, -0.6, 0.64])
START = np.array([1.0, -2.0, 0.5])
LENGTH = 4.0


def scattered(solid: Solid, n: int = 4000, grow: float = 0.7) -> np.ndarray:
    """Points in and round the bounds of a bounded solid."""
    lo, hi = solid.bounds
    size = hi - lo
    return RNG.uniform(lo - grow * size, hi + grow * size, (n, 3))


def to_segment(points: np.ndarray, a, b) -> np.ndarray:
    """Distance of points (in any dimension) to the segment from a to b."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)


def axial(points: np.ndarray, origin: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(n, 2): distance from the axis, and along it."""
    t = (points - origin) @ axis
    return np.stack([np.linalg.norm(points - origin - t[:, None] * axis, axis=1), t], axis=1)


def revolved(
    points: np.ndarray, origin: np.ndarray, axis: np.ndarray, profile: list[tuple[float, float]]
) -> np.ndarray:
    """Signed distance to the solid that a convex profile (radius, height), from axis to axis, sweeps."""
    flat = axial(points, origin, axis)
    distance = np.min([to_segment(flat, p, q) for p, q in pairwise(profile)], axis=0)
    inside = np.ones(len(points), bool)
    for (r0, t0), (r1, t1) in pairwise(profile):
        inside &= (r1 - r0) * (flat[:, 1] - t0) - (t1 - t0) * (flat[:, 0] - r0) > 0
    return np.where(inside, -distance, distance)


def box_by_faces(points: np.ndarray, lo, hi) -> np.ndarray:
    """Signed distance to a box as the least distance to its six rectangles."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    distance = np.full(len(points), np.inf)
    for axis in range(3):
        for side in (lo, hi):
            foot = np.clip(points, lo, hi)
            foot[:, axis] = side[axis]
            distance = np.minimum(distance, np.linalg.norm(points - foot, axis=1))
    inside = np.all((points > lo) & (points < hi), axis=1)
    return np.where(inside, -distance, distance)


def ends(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return START, START + LENGTH * axis


AXES = {
    "x": np.array([1.0, 0, 0]),
    "-y": np.array([0, -1.0, 0]),
    "z": np.array([0, 0, 1.0]),
    "oblique": OBLIQUE,
    "nearly z": np.array([1e-5, 0.0, math.sqrt(1 - 1e-10)]),
}


def cone_case(ra: float, rb: float) -> Callable:
    def case(axis: np.ndarray):
        profile = [(0.0, 0.0), (ra, 0.0), (rb, LENGTH), (0.0, LENGTH)]
        if rb == 0.0:
            profile = profile[:-1]
        return frep.cone(*ends(axis), ra, rb), lambda p: revolved(p, START, axis, profile)

    return case


def cylinder_case(axis: np.ndarray):
    profile = [(0.0, 0.0), (1.5, 0.0), (1.5, LENGTH), (0.0, LENGTH)]
    return frep.cylinder(*ends(axis), 1.5), lambda p: revolved(p, START, axis, profile)


def capsule_case(axis: np.ndarray):
    return frep.capsule(*ends(axis), 0.8), lambda p: to_segment(p, *ends(axis)) - 0.8


def torus_case(axis: np.ndarray):
    def distance(p: np.ndarray) -> np.ndarray:
        flat = axial(p, START, axis)
        return np.linalg.norm(flat - (3.0, 0.0), axis=1) - 0.9

    return frep.torus(START, 2.5 * axis, 3.0, 0.9), distance


AXIAL = {
    "cylinder": cylinder_case,
    "cone": cone_case(2.0, 0.7),
    "widening cone": cone_case(0.4, 2.5),
    "pointed cone": cone_case(1.5, 0.0),
    "flat cone": cone_case(9.0, 5.0),
    "capsule": capsule_case,
    "torus": torus_case,
}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("kind", AXIAL)
def test_axial_primitives_are_exact_signed_distances(kind, axis):
    solid, distance = AXIAL[kind](AXES[axis])
    points = scattered(solid)
    np.testing.assert_allclose(solid.field(points), distance(points), atol=1e-9)


def test_box_is_the_least_distance_to_its_faces():
    solid = frep.box((-1, 2, 0), (3, 2.5, 7))
    points = scattered(solid)
    np.testing.assert_allclose(solid.field(points), box_by_faces(points, (-1, 2, 0), (3, 2.5, 7)), atol=1e-12)


def test_rounded_box_is_a_smaller_box_grown():
    solid = frep.rounded_box((-1, 2, 0), (3, 4, 7), 0.6)
    points = scattered(solid)
    core = box_by_faces(points, (-0.4, 2.6, 0.6), (2.4, 3.4, 6.4))
    np.testing.assert_allclose(solid.field(points), core - 0.6, atol=1e-12)


def test_rounded_box_with_half_the_cube_is_a_sphere():
    solid = frep.rounded_box((0, 0, 0), (2, 2, 2), 1.0)
    points = scattered(solid)
    np.testing.assert_allclose(solid.field(points), np.linalg.norm(points - 1.0, axis=1) - 1.0, atol=1e-12)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_half_spaces_take_axes_by_name(axis):
    normal = np.eye(3)["xyz".index(axis)]
    points = np.random.default_rng(0).normal(size=(20, 3))
    assert np.array_equal(frep.half_space(axis, START).field(points), frep.half_space(normal, START).field(points))


def test_sphere_and_half_space():
    points = RNG.uniform(-9, 9, (1000, 3))
    sphere = frep.sphere((1, 2, 3), 2.5)
    np.testing.assert_allclose(sphere.field(points), np.linalg.norm(points - (1, 2, 3), axis=1) - 2.5, atol=1e-12)
    plane = frep.half_space(3 * OBLIQUE, START)
    np.testing.assert_allclose(plane.field(points), (points - START) @ OBLIQUE, atol=1e-12)


def every_primitive() -> dict[str, Solid]:
    made = {kind: case(OBLIQUE)[0] for kind, case in AXIAL.items()}
    made["box"] = frep.box((-1, 2, 0), (3, 2.5, 7))
    made["rounded_box"] = frep.rounded_box((-1, 2, 0), (3, 4, 7), 0.6)
    made["sphere"] = frep.sphere((1, 2, 3), 2.5)
    return made


PRIMITIVES = every_primitive()


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_slope_is_one_off_creases(kind):
    """The slope of a distance is one wherever the nearest surface point is unique: differences over a short step."""
    solid = PRIMITIVES[kind]
    points = scattered(solid)
    gradient = solid.field.gradient(points)
    length = np.linalg.norm(gradient, axis=1)
    # Within a thousandth of a crease the two sides differ; random points hardly ever lie there.
    assert np.mean(np.abs(length - 1.0) < 1e-6) > 0.995
    step = 1e-4
    moved = solid.field(points + step * gradient) - solid.field(points)
    assert np.mean(np.abs(moved / step - 1.0) < 1e-3) > 0.98


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_bounds_hold_and_touch(kind):
    solid = PRIMITIVES[kind]
    points = scattered(solid, 20000)
    lo, hi = solid.bounds
    outside = np.any((points < lo) | (points > hi), axis=1)
    assert np.all(solid.field(points[outside]) > 0)
    mesh = solid.mesh(voxel=float((hi - lo).max()) / 40, polish=True)
    slack = 0.02 * float((hi - lo).max())
    np.testing.assert_allclose(mesh.bounds, solid.bounds, atol=slack)
    # Tighter than a mesh can tell: no face of the box can be pulled in by a thousandth.
    for axis in range(3):
        for side, sign in ((0, 1.0), (1, -1.0)):
            other = [a for a in range(3) if a != axis]
            face = np.empty((90, 90, 3))
            u = np.linspace(lo[other[0]], hi[other[0]], 90)
            v = np.linspace(lo[other[1]], hi[other[1]], 90)
            face[..., axis] = solid.bounds[side, axis] + sign * 0.02 * (hi - lo)[axis]
            face[..., other[0]], face[..., other[1]] = u[:, None], v[None, :]
            assert solid.field(face.reshape(-1, 3)).min() < 0, f"nothing touches side {side} of axis {axis}"


VOLUMES = {
    "box": 4 * 0.5 * 7,
    "sphere": 4 / 3 * math.pi * 2.5**3,
    "cylinder": math.pi * 1.5**2 * LENGTH,
    "cone": math.pi * LENGTH / 3 * (2.0**2 + 2.0 * 0.7 + 0.7**2),
    "pointed cone": math.pi * LENGTH / 3 * 1.5**2,
    "capsule": math.pi * 0.8**2 * LENGTH + 4 / 3 * math.pi * 0.8**3,
    "torus": 2 * math.pi**2 * 3.0 * 0.9**2,
}


@pytest.mark.parametrize("kind", VOLUMES)
def test_volumes_from_field_and_mesh(kind):
    solid = PRIMITIVES[kind]
    voxel = {"box": 0.03, "torus": 0.15}.get(kind, 0.04 * float(np.ptp(solid.bounds, axis=0).min()))
    assert solid.volume(voxel) == pytest.approx(VOLUMES[kind], rel=4e-3)
    assert solid.mesh(voxel, polish=True).volume == pytest.approx(VOLUMES[kind], rel=4e-3)


@pytest.mark.parametrize("axis", "xyz")
def test_a_torus_takes_axes_by_name(axis):
    named, given = frep.torus(START, axis, 3, 0.9), frep.torus(START, np.eye(3)["xyz".index(axis)], 3, 0.9)
    np.testing.assert_array_equal(named.bounds, given.bounds)
    points = np.random.default_rng(1).uniform(-5, 5, (50, 3))
    np.testing.assert_array_equal(named.field(points), given.field(points))


def test_torus_area_volume_and_genus():
    """O1: 2 pi^2 R r^2, 4 pi^2 R r, one handle."""
    mesh = frep.torus((0, 0, 0), (0, 0, 1), 3.0, 0.9).mesh(voxel=0.12, polish=True)
    report = mesh.check()
    assert report.printable
    assert (report.genus, report.components) == (1, 1)
    assert mesh.volume == pytest.approx(2 * math.pi**2 * 3.0 * 0.81, rel=1e-3)
    assert mesh.area == pytest.approx(4 * math.pi**2 * 3.0 * 0.9, rel=2e-3)


@settings(max_examples=30, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.floats(0.2, 3.0),
    st.floats(0.0, 3.0),
    st.floats(0.3, 6.0),
)
def test_any_cone_is_exact(direction, ra, rb, length):
    axis = np.array(direction) / np.linalg.norm(direction)
    rb = rb if rb > 1e-3 else 0.0
    solid = frep.cone(START, START + length * axis, ra, rb)
    profile = [(0.0, 0.0), (ra, 0.0), (rb, length), (0.0, length)]
    points = START + RNG.uniform(-8, 8, (300, 3))
    expected = revolved(points, START, axis, profile if rb else profile[:-1])
    np.testing.assert_allclose(solid.field(points), expected, atol=1e-9)


X = frep.coordinates()[0]
NAN, INF = math.nan, math.inf
P, Q = (0, 0, 0), (1, 1, 1)
BAD = [
    ("lo", ArgumentError, lambda: frep.box(Q, P)),
    ("lo", ArgumentError, lambda: frep.box(P, (1, 0, 1))),
    ("lo", ArgumentError, lambda: frep.box((NAN, 0, 0), Q)),
    ("hi", ArgumentError, lambda: frep.box(P, (1, 1, INF))),
    ("hi", ArgumentError, lambda: frep.box(P, (1, 1))),
    ("lo", ArgumentTypeError, lambda: frep.box("abc", Q)),
    ("lo", ArgumentTypeError, lambda: frep.box(X, Q)),
    ("radius", ArgumentError, lambda: frep.rounded_box(P, Q, 0.6)),
    ("radius", ArgumentError, lambda: frep.rounded_box(P, Q, 0.0)),
    ("center", ArgumentError, lambda: frep.sphere((0, NAN, 0), 1)),
    ("radius", ArgumentError, lambda: frep.sphere(P, 0)),
    ("radius", ArgumentError, lambda: frep.sphere(P, -2)),
    ("radius", ArgumentError, lambda: frep.sphere(P, NAN)),
    ("radius", ArgumentError, lambda: frep.sphere(P, INF)),
    ("radius", ArgumentTypeError, lambda: frep.sphere(P, X)),
    ("radius", ArgumentTypeError, lambda: frep.sphere(P, lambda x, y, z: x)),
    ("radius", ArgumentTypeError, lambda: frep.sphere(P, "big")),
    ("radius", ArgumentTypeError, lambda: frep.sphere(P, None)),
    ("start", ArgumentError, lambda: frep.cylinder(P, P, 1)),
    ("end", ArgumentError, lambda: frep.cylinder(P, (0, 0, INF), 1)),
    ("radius", ArgumentError, lambda: frep.cylinder(P, Q, -1)),
    ("start_radius", ArgumentError, lambda: frep.cone(P, Q, 0, 1)),
    ("end_radius", ArgumentError, lambda: frep.cone(P, Q, 1, -1)),
    ("end_radius", ArgumentTypeError, lambda: frep.cone(P, Q, 1, X + 1)),
    ("start", ArgumentError, lambda: frep.capsule(Q, Q, 1)),
    ("radius", ArgumentTypeError, lambda: frep.capsule(P, Q, X)),
    ("axis", ArgumentError, lambda: frep.torus(P, P, 2, 1)),
    ("major_radius", ArgumentError, lambda: frep.torus(P, Q, 0, 1)),
    ("minor_radius", ArgumentError, lambda: frep.torus(P, Q, 2, NAN)),
    ("normal", ArgumentError, lambda: frep.half_space(P)),
    ("point", ArgumentError, lambda: frep.half_space(Q, (0, 0, NAN))),
]


@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
