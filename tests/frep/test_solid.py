"""Solids: boolean identities, round blends, offsets, transforms, bounds, pickling, clear refusals."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, Solid, difference, intersection, union

RNG = np.random.default_rng(5)
X, Y, Z = frep.coordinates()
POINTS = RNG.uniform(-9, 9, (3000, 3))

A = frep.sphere((1, 0, 0), 3)
B = frep.box((-2, -3, -1), (4, 1, 2))
C = frep.torus((0, 1, 0), (0.6, 0, 0.8), 4, 1.2)


def inside_bounds(solid: Solid) -> np.ndarray:
    lo, hi = solid.bounds
    return np.all((lo <= POINTS) & (hi >= POINTS), axis=1)


# --- booleans --------------------------------------------------------------------------------------------------------


def test_booleans_are_minima_and_maxima():
    a, b = A.field(POINTS), B.field(POINTS)
    np.testing.assert_array_equal((A | B).field(POINTS), np.minimum(a, b))
    np.testing.assert_array_equal((A & B).field(POINTS), np.maximum(a, b))
    np.testing.assert_array_equal((A - B).field(POINTS), np.maximum(a, -b))
    np.testing.assert_array_equal((~A).field(POINTS), -a)


def test_boolean_identities():
    def same(p: Solid, q: Solid) -> None:
        np.testing.assert_array_equal(p.field(POINTS), q.field(POINTS))

    same(~(A | B), ~A & ~B)
    same(~(A & B), ~A | ~B)
    same(~~A, A)
    same(A | A, A)
    same(A & A, A)
    same(A | B, B | A)
    same(A & (B | C), (A & B) | (A & C))
    same(A | (A & B), A)
    same(A - B, A & ~B)
    same(union(A, B, C), A | (B | C))
    same(intersection(A, B, C), A & (B & C))
    same(difference(A, B, C), A - B - C)
    same(union(A), A)


def test_contains_is_set_algebra():
    a, b = A.contains(POINTS), B.contains(POINTS)
    np.testing.assert_array_equal((A | B).contains(POINTS), a | b)
    np.testing.assert_array_equal((A & B).contains(POINTS), a & b)
    np.testing.assert_array_equal((A - B).contains(POINTS), a & ~b)
    assert A.contains((1, 0, 0))
    assert not A.contains((4, 0, 0)), "the surface is outside"


def test_bounds_of_booleans_hold_the_material():
    for solid in (
        A | B,
        A & B,
        A - B,
        union(A, B, C, blend=1.5),
        intersection(A, B, blend=0.5),
        difference(C, A, blend=1),
    ):
        assert np.all(solid.field(POINTS[~inside_bounds(solid)]) > 0)
    np.testing.assert_array_equal((A | B).bounds, [np.minimum(*[s.bounds[0] for s in (A, B)]), [4, 3, 3]])
    np.testing.assert_array_equal((A & B).bounds, [[-2, -3, -1], [4, 1, 2]])
    np.testing.assert_array_equal((A - B).bounds, A.bounds)
    assert not (~A).is_bounded
    assert (~A & B).is_bounded


def test_disjoint_balls_add_their_volumes():
    """O2."""
    two = frep.sphere((0, 0, 0), 2) | frep.sphere((10, 0, 0), 3)
    mesh = two.mesh(voxel=0.2, polish=True)
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * (8 + 27), rel=1e-3)
    assert mesh.check().components == 2


def test_a_cavity_is_a_component_that_takes_volume_away():
    shell = frep.sphere((0, 0, 0), 5) - frep.sphere((0, 0, 0), 3)
    mesh = shell.mesh(voxel=0.25, polish=True)
    report = mesh.check()
    assert report.printable
    assert (report.components, report.genus) == (2, 0)
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * (125 - 27), rel=2e-3)


# --- blends ----------------------------------------------------------------------------------------------------------


def test_blend_of_orthogonal_half_spaces_is_a_circular_fillet():
    """Between the solids x < 0 and y < 0 a fillet of radius k has its centre at (k, k)."""
    k = 1.7
    corner = union(frep.half_space((1, 0, 0)), frep.half_space((0, 1, 0)), blend=k)
    points = RNG.uniform(0, k, (500, 3))
    np.testing.assert_allclose(corner.field(points), k - np.hypot(k - points[:, 0], k - points[:, 1]), atol=1e-12)
    # And nothing changes where only one of them is within k.
    far = RNG.uniform(-5, 5, (500, 3))
    far[:, 1] = k + np.abs(far[:, 1])
    np.testing.assert_allclose(corner.field(far), np.minimum(far[:, 0], far[:, 1]), atol=1e-12)


def test_blended_intersection_rounds_an_edge_to_the_radius():
    k = 0.8
    rounded = intersection(frep.half_space((1, 0, 0)), frep.half_space((0, 1, 0)), blend=k)
    points = RNG.uniform(-k, 0, (500, 3))
    np.testing.assert_allclose(rounded.field(points), np.hypot(points[:, 0] + k, points[:, 1] + k) - k, atol=1e-12)


def test_blended_difference_rounds_the_new_edge():
    k = 0.5
    step = difference(frep.half_space((0, 0, 1)), frep.half_space((-1, 0, 0)), blend=k)
    points = np.array([[-k + k * math.cos(t), 0.3, -k + k * math.sin(t)] for t in np.linspace(0, math.pi / 2, 20)])
    np.testing.assert_allclose(step.field(points), 0.0, atol=1e-12)


def test_fillet_volume_of_two_boxes():
    """A plate on a plate: the fillet along both sides of the foot has the section k^2 (1 - pi / 4)."""
    k = 1.5
    foot, wall = frep.box((-8, 0, -3), (8, 20, 0)), frep.box((-1, 0, -3), (1, 20, 8))
    parts = [union(foot, wall, blend=b) & frep.box((-7, 5, -2), (7, 15, 7)) for b in (0.0, k)]
    # Far from the ends of the plates: within the cut, only the foot of the wall changes.
    hard, blended = (p.volume(voxel=0.1) for p in parts)
    assert blended - hard == pytest.approx(2 * 10 * k**2 * (1 - math.pi / 4), rel=0.02)


@pytest.mark.parametrize("blend", [0.0, 0.9, 0.5 + 0.1 * abs(X)], ids=["hard", "number", "Field"])
def test_unions_do_not_depend_on_the_order(blend):
    reference = union(A, B, C, blend=blend).field(POINTS)
    for order in itertools.permutations((A, B, C)):
        np.testing.assert_allclose(union(*order, blend=blend).field(POINTS), reference, atol=1e-12)


def test_blend_is_local_and_adds_material_only():
    k = 0.7
    hard, soft = (A | B).field(POINTS), union(A, B, blend=k).field(POINTS)
    assert np.all(soft <= hard + 1e-12)
    one = np.maximum(A.field(POINTS), B.field(POINTS)) >= k
    np.testing.assert_allclose(soft[one], hard[one], atol=1e-12)
    assert np.any(soft < hard - 0.05)


def test_three_orthogonal_half_spaces_blend_to_a_ball_corner():
    k = 1.2
    solid = union(*[frep.half_space(n) for n in np.eye(3)], blend=k)
    points = RNG.uniform(0, k, (300, 3))
    np.testing.assert_allclose(solid.field(points), k - np.linalg.norm(k - points, axis=1), atol=1e-12)


def test_blend_field_is_the_blend_of_its_local_value():
    law = 0.2 + 0.1 * abs(X)
    varying = union(A, B, blend=law).field(POINTS)
    for i in range(0, len(POINTS), 300):
        here = union(A, B, blend=float(law(POINTS[i]))).field(POINTS[i])
        assert varying[i] == pytest.approx(here, abs=1e-12)


# --- offsets and shells ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [1.5, -1.0, 0.0])
def test_offset_of_a_ball_is_a_ball(distance):
    grown = frep.sphere((1, 2, 3), 4).offset(distance)
    np.testing.assert_allclose(grown.field(POINTS), frep.sphere((1, 2, 3), 4 + distance).field(POINTS), atol=1e-12)
    assert np.all(grown.field(POINTS[~inside_bounds(grown)]) > 0)


def test_offset_of_a_box_has_round_edges():
    """Steiner: V + A d + pi d^2 (sum of edges) / 4 + 4/3 pi d^3."""
    d, (a, b, c) = 1.0, (4.0, 6.0, 5.0)
    grown = frep.box((0, 0, 0), (a, b, c)).offset(d)
    expected = a * b * c + 2 * (a * b + b * c + c * a) * d + math.pi * d**2 * (a + b + c) + 4 / 3 * math.pi * d**3
    assert grown.volume(voxel=0.1) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("law", [1 + 0.5 * X, 0.3 * Y, 1 - 0.4 * X], ids=repr)
def test_offset_by_a_field_stays_in_its_bounds(law):
    grown = frep.sphere((0, 0, 0), 3).offset(law)
    far = RNG.uniform(-14, 14, (20000, 3))
    outside = np.any((far < grown.bounds[0]) | (far > grown.bounds[1]), axis=1)
    assert np.all(grown.field(far[outside]) > 0)


@pytest.mark.parametrize(("side", "inner", "outer"), [("inner", -1.0, 0.0), ("outer", 0.0, 1.0), ("both", -0.5, 0.5)])
def test_shell_is_the_wall_asked_for(side, inner, outer):
    t, r = 0.8, 4.0
    skin = frep.sphere((0, 0, 0), r).shell(t, side=side)
    radii = np.linspace(0.1, 7, 400)
    points = radii[:, None] * np.array([0.36, 0.48, 0.8])
    expected = np.abs(radii - r - 0.5 * (inner + outer) * t) - 0.5 * t
    np.testing.assert_allclose(skin.field(points), expected, atol=1e-12)
    volume = 4 / 3 * math.pi * ((r + outer * t) ** 3 - (r + inner * t) ** 3)
    assert skin.volume(voxel=0.2) == pytest.approx(volume, rel=4e-3)
    assert [f.what for f in skin.features] == ["wall"]
    assert float(skin.features[0].width) == t


def test_shell_thickness_may_vary():
    skin = frep.box((0, 0, 0), (20, 20, 20)).shell(1 + 0.1 * X)
    for x in (4.0, 10.0, 16.0):
        depth = np.linspace(0, 4, 4001)
        points = np.stack([np.full(4001, x), np.full(4001, 10.0), depth], axis=1)
        wall = depth[skin.field(points) <= 1e-12]
        assert wall.max() == pytest.approx(1 + 0.1 * x, abs=2e-3)


# --- transforms ------------------------------------------------------------------------------------------------------

AXIS = np.array([1.0, 2.0, -2.0]) / 3.0


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    k = np.cross(np.eye(3), axis)
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def moved() -> dict[str, tuple[Solid, np.ndarray, np.ndarray, float]]:
    """The image of B, and the map p -> M p + s of ratio k that makes it."""
    c = np.array([1.0, -2.0, 3.0])
    turn, quarter = rotation(AXIS, 0.7), rotation(np.array([0, 0, 1.0]), math.pi / 2)
    flip = np.eye(3) - 2 * np.outer(AXIS, AXIS)
    return {
        "translate": (B.translate((1, 2, 3)), np.eye(3), np.array([1.0, 2, 3]), 1.0),
        "rotate": (B.rotate(tuple(AXIS), 0.7, center=c), turn, c - turn @ c, 1.0),
        "quarter turn": (B.rotate("z", math.pi / 2), quarter, np.zeros(3), 1.0),
        "mirror": (B.mirror(tuple(3 * AXIS), point=c), flip, c - flip @ c, 1.0),
        "mirror x": (B.mirror("x"), np.diag([-1.0, 1, 1]), np.zeros(3), 1.0),
        "scale": (B.scale(2.5, center=c), 2.5 * np.eye(3), c - 2.5 * c, 2.5),
    }


@pytest.mark.parametrize("kind", moved())
def test_field_of_the_image_is_the_field_of_the_preimage(kind):
    solid, matrix, shift, ratio = moved()[kind]
    before = (POINTS - shift) @ np.linalg.inv(matrix).T
    np.testing.assert_allclose(solid.field(POINTS), ratio * B.field(before), atol=1e-11)


@pytest.mark.parametrize("kind", moved())
def test_bounds_of_the_image_hold_the_corners_and_touch(kind):
    solid, matrix, shift, _ = moved()[kind]
    corners = np.array(list(itertools.product(*B.bounds.T))) @ matrix.T + shift
    np.testing.assert_allclose(solid.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)


def test_rotations_are_right_handed():
    spot = frep.sphere((1, 0, 0), 0.1)
    for axis, at in (("z", (0, 1, 0)), ("y", (0, 0, -1)), ("x", (1, 0, 0)), (np.array([0, 0, 2.0]), (0, 1, 0))):
        assert spot.rotate(axis, math.pi / 2).field(at) == pytest.approx(-0.1)


def test_transforms_compose_and_undo():
    def same(p: Solid, q: Solid) -> None:
        np.testing.assert_allclose(p.field(POINTS), q.field(POINTS), atol=1e-10)

    same(C.rotate(tuple(AXIS), 0.4).rotate(tuple(AXIS), 0.5), C.rotate(tuple(AXIS), 0.9))
    same(C.rotate("y", 1.1).rotate("y", -1.1), C)
    same(C.translate((1, 2, 3)).translate((-3, 0, 1)), C.translate((-2, 2, 4)))
    same(C.mirror("y", point=(0, 2, 0)).mirror("y", point=(0, 2, 0)), C)
    same(C.mirror("x").mirror("y"), C.rotate("z", math.pi))
    same(C.scale(3).scale(1 / 3), C)
    same((A | B).rotate("x", 0.3), A.rotate("x", 0.3) | B.rotate("x", 0.3))
    same(A.scale(2).offset(1), A.offset(0.5).scale(2))


def test_widths_move_and_grow_with_the_solid():
    skin = frep.sphere((0, 0, 0), 5).shell(1 + 0.05 * X).translate((10, 0, 0)).scale(3)
    (feature,) = skin.features
    points = POINTS + np.array([30.0, 0, 0])
    np.testing.assert_allclose(feature.width(points), 3 * (1 + 0.05 * (points[:, 0] / 3 - 10)), atol=1e-12)


def test_infinite_bounds_stay_infinite_and_finite_sides_move():
    slab = frep.half_space((0, 0, 1), (0, 0, 2))
    np.testing.assert_array_equal(slab.rotate("x", math.pi / 2).bounds[0], [-np.inf, -2, -np.inf])
    np.testing.assert_array_equal(slab.rotate("x", 0.1).bounds, [[-np.inf] * 3, [np.inf] * 3])
    np.testing.assert_array_equal(slab.translate((0, 0, 3)).bounds[1], [np.inf, np.inf, 5.0])
    assert not np.any(np.isnan(slab.rotate((1, 1, 1), 0.3).bounds))


@settings(max_examples=30, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.floats(-6, 6),
    st.floats(0.1, 10),
    st.tuples(*[st.floats(-20, 20)] * 3),
)
def test_distances_stay_distances(axis, angle, factor, shift):
    """A similarity multiplies all distances by its ratio: the ball's image is the ball at the image of its centre."""
    image = frep.sphere((1, 2, 3), 2).rotate(axis, angle).scale(factor).translate(shift)
    unit = np.array(axis) / np.linalg.norm(axis)
    centre = factor * rotation(unit, angle) @ np.array([1.0, 2.0, 3.0]) + np.array(shift)
    expected = np.linalg.norm(POINTS[:200] - centre, axis=1) - 2 * factor
    np.testing.assert_allclose(image.field(POINTS[:200]), expected, atol=1e-9)
    np.testing.assert_array_less(image.bounds[0], centre - 2 * factor + 1e-9)
    np.testing.assert_array_less(centre + 2 * factor - 1e-9, image.bounds[1])


# --- construction, pickling, refusals --------------------------------------------------------------------------------


def test_bounds_cut_the_field():
    plane = Solid(lambda x, y, z: z - 100.0, bounds=((0, 0, 0), (2, 3, 4)))
    assert plane.volume(voxel=0.1) == pytest.approx(24, rel=2e-3)
    half = Solid(Z - 1.0, bounds=((0, 0, -np.inf), (2, 2, np.inf)))
    assert not half.is_bounded
    assert (half & frep.box((-5, -5, 0), (5, 5, 5))).volume(voxel=0.05) == pytest.approx(4, rel=2e-3)


def test_solids_survive_pickling():
    part = (union(A, B, blend=0.3 + 0.01 * X).shell(0.8) & frep.box((-3, -3, -3), (3, 3, 3))).rotate("z", 0.2)
    again = pickle.loads(pickle.dumps(part))
    assert again.field is part.field
    np.testing.assert_array_equal(again.bounds, part.bounds)
    assert [f.width for f in again.features] == [f.width for f in part.features]
    mesh, other = part.mesh(voxel=0.4), again.mesh(voxel=0.4)
    np.testing.assert_array_equal(mesh.vertices, other.vertices)
    np.testing.assert_array_equal(mesh.faces, other.faces)


def test_solids_are_immutable():
    with pytest.raises(AttributeError):
        A.field = B.field
    with pytest.raises(ValueError, match="read-only"):
        A.bounds[0, 0] = 9


BAD = [
    ("bounds", ArgumentError, lambda: Solid(X, bounds=((0, 0, 0), (1, 0, 1)))),
    ("bounds", ArgumentError, lambda: Solid(X, bounds=((0, 0, 0), (1, math.nan, 1)))),
    ("bounds", ArgumentError, lambda: Solid(X, bounds=(0, 1))),
    ("bounds", ArgumentError, lambda: Solid(X, bounds=((0, 0), (1, 1, 1)))),
    ("bounds", ArgumentError, lambda: Solid(X, bounds=(("a", 0, 0), (1, 1, 1)))),
    ("field", ArgumentTypeError, lambda: Solid("x")),
    ("intersection", ArgumentTypeError, lambda: A & 3),
    ("union", ArgumentTypeError, lambda: A | X),
    ("difference", ArgumentTypeError, lambda: A - 0.5),
    ("union", ArgumentError, lambda: union()),
    ("blend", ArgumentError, lambda: union(A, B, blend=-1)),
    ("blend", ArgumentError, lambda: intersection(A, B, blend=-0.1)),
    ("blend", ArgumentError, lambda: difference(A, B, blend=math.nan)),
    ("blend", ArgumentTypeError, lambda: union(A, B, blend="soft")),
    ("distance", ArgumentError, lambda: A.offset(math.inf)),
    ("distance", ArgumentTypeError, lambda: A.offset(B)),
    ("thickness", ArgumentError, lambda: A.shell(0)),
    ("thickness", ArgumentError, lambda: A.shell(-1)),
    ("thickness", ArgumentTypeError, lambda: A.shell(B)),
    ("side", ArgumentError, lambda: A.shell(1, side="up")),
    ("vector", ArgumentError, lambda: A.translate((1, 2))),
    ("vector", ArgumentTypeError, lambda: A.translate(X)),
    ("axis", ArgumentError, lambda: A.rotate((0, 0, 0), 1)),
    ("axis", ArgumentTypeError, lambda: A.rotate("w", 1)),
    ("angle", ArgumentError, lambda: A.rotate("z", math.inf)),
    ("angle", ArgumentTypeError, lambda: A.rotate("z", X)),
    ("angle", ArgumentTypeError, lambda: A.rotate("z", "half")),
    ("center", ArgumentError, lambda: A.rotate("z", 1, center=(0, 0, math.nan))),
    ("normal", ArgumentError, lambda: A.mirror((0, 0, 0))),
    ("point", ArgumentError, lambda: A.mirror("x", point=(0, 0))),
    ("factor", ArgumentError, lambda: A.scale(0)),
    ("factor", ArgumentError, lambda: A.scale(-2)),
    ("factor", ArgumentTypeError, lambda: A.scale(X)),
    ("points", ArgumentError, lambda: A.contains([[1, 2]])),
]


@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
