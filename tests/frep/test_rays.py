"""Rays: first hits against closed forms of boxes, balls, cone-beams and whole lattices; grazing rays; bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest

import frep
from frep import ArgumentError, UnboundedError
from frep.errors import ArgumentTypeError
from frep.rays import first_hit
from frep.similarity import Screw, Swirl, Translation
from topologies.steady import SteadyLattice

RNG = np.random.default_rng(41)


def rays_at(targets: np.ndarray, spread: float, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Rays from all sides that pass near the targets."""
    u = RNG.normal(size=targets.shape)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return targets + spread * RNG.normal(size=targets.shape) - distance * u, u


# --- closed forms --------------------------------------------------------------------------------------------------------


def ball_hits(o: np.ndarray, u: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """(n, 2) where rays enter and leave a ball; inf, -inf where they miss."""
    to = center - o
    middle = np.einsum("na,na->n", to, u)
    root = radius**2 - np.einsum("na,na->n", to, to) + middle**2
    half = np.sqrt(np.maximum(root, 0.0))
    return np.where((root >= 0.0)[:, None], np.stack([middle - half, middle + half], axis=1), [math.inf, -math.inf])


def cone_beam_hits(o: np.ndarray, u: np.ndarray, a: np.ndarray, ra: float, b: np.ndarray, rb: float) -> np.ndarray:
    """(n,) first hits of a cone-beam: of its two balls, and of the cone that touches both, between the circles of contact."""
    first = np.stack([ball_hits(o, u, a, ra)[:, 0], ball_hits(o, u, b, rb)[:, 0]], axis=1).min(axis=1)
    length = float(np.linalg.norm(b - a))
    if length <= abs(ra - rb):
        return first
    axis, s = (b - a) / length, (ra - rb) / length
    c = math.sqrt(1.0 - s * s)
    x0, x1 = (o - a) @ axis, u @ axis
    across, turn = o - a - np.outer(x0, axis), u - np.outer(x1, axis)
    # c^2 y^2 = (ra - x s)^2
    qa = c * c * np.einsum("na,na->n", turn, turn) - s * s * x1 * x1
    qb = c * c * np.einsum("na,na->n", across, turn) + s * x1 * (ra - s * x0)
    qc = c * c * np.einsum("na,na->n", across, across) - (ra - s * x0) ** 2
    root = qb * qb - qa * qc
    half = np.sqrt(np.maximum(root, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        for t in ((-qb - half) / qa, (-qb + half) / qa):
            x = x0 + t * x1
            on = (root >= 0.0) & (x >= ra * s) & (x <= length + rb * s) & (t >= 0.0)
            first = np.minimum(first, np.where(on, t, math.inf))
    return first


def lattice_hits(lattice: SteadyLattice, o: np.ndarray, u: np.ndarray) -> np.ndarray:
    skeleton = lattice.skeleton
    first = np.full(len(o), math.inf)
    ranges = [np.arange(s, s + n) for s, n in zip(skeleton.start, skeleton.counts, strict=True)]
    for number, offset in enumerate(skeleton.racks[:, 2:]):
        for index in np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3):
            there = index + offset - skeleton.start
            if np.all((there >= 0) & (there < skeleton.counts)):
                ends, radii = skeleton.ends(np.array([[*index, number]]))
                first = np.minimum(first, cone_beam_hits(o, u, ends[0, 0], radii[0, 0], ends[0, 1], radii[0, 1]))
    return first


# --- hits ----------------------------------------------------------------------------------------------------------------


def test_balls_are_hit_where_the_quadratic_says() -> None:
    o, u = rays_at(np.zeros((2000, 3)), 3.0, 30.0)
    want = ball_hits(o, u, np.zeros(3), 5.0)[:, 0]
    found = first_hit(frep.sphere((0, 0, 0), 5), o, u)
    np.testing.assert_array_equal(np.isinf(found), np.isinf(want))
    hit = np.isfinite(want)
    assert 0.3 < hit.mean() < 1.0
    incidence = np.abs(np.einsum("na,na->n", o[hit] + want[hit, None] * u[hit], u[hit])) / 5
    assert np.all(np.abs(found[hit] - want[hit]) <= 2e-7 / incidence)


def test_grazing_rays_hit_within_the_ball_and_miss_beyond() -> None:
    ball = frep.sphere((0, 0, 0), 5)
    for miss in (1e-3, 1e-5):
        o = np.array([(-20.0, 5 - miss, 0), (-20.0, 5 + miss, 0)])
        found = first_hit(ball, o, (1, 0, 0), tolerance=1e-9)
        assert found[0] == pytest.approx(20 - math.sqrt(25 - (5 - miss) ** 2), abs=1e-4)
        assert math.isinf(found[1])


def test_rays_along_a_wall_miss_it() -> None:
    block = frep.box((0, 0, 0), (100, 1, 1)) | frep.box((0, 3, 0), (100, 4, 1))
    found = first_hit(block, [(-5, 1.001, 0.5), (-5, 0.999, 0.5), (-5, 2, 0.5)], (1, 0, 0))
    assert math.isinf(found[0])
    assert found[1] == pytest.approx(5.0, abs=1e-5)
    assert math.isinf(found[2])


def test_boxes_are_hit_where_the_slabs_say() -> None:
    low, high = np.array([-1.0, -2, -3]), np.array([2.0, 1, 4])
    o, u = rays_at(np.zeros((2000, 3)), 2.0, 20.0)
    t = np.stack([(low - o) / u, (high - o) / u])
    enter, leave = t.min(axis=0).max(axis=1), t.max(axis=0).min(axis=1)
    want = np.where(enter <= leave, enter, math.inf)
    found = first_hit(frep.box(low, high), o, u)
    np.testing.assert_array_equal(np.isinf(found), np.isinf(want))
    hit = np.isfinite(want)
    np.testing.assert_allclose(found[hit], want[hit], atol=1e-5)


LATTICES = {
    "grid": SteadyLattice(
        [(0, 0, 0)], 0.12, [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)],
        Translation((1, 0, 0)), Translation((0, 1, 0)), Translation((0, 0, 1)), (3, 3, 4),
    ),
    "horn": SteadyLattice(
        [(3, 0, 0)], 0.2, [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 1, -1, 1)],
        Translation((1, 0, 0.1)), Screw(0.4, pitch=0.3), Swirl(0.85, (0, 0, 4), 0.2), (3, 4, 3),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LATTICES)
def test_lattices_are_hit_where_their_cone_beams_are(name: str) -> None:
    lattice = LATTICES[name]
    low, high = lattice.skeleton.bounds
    targets = RNG.uniform(low, high, (400, 3))
    o, u = rays_at(targets, 0.0, 1.5 * float(np.linalg.norm(high - low)))
    want = lattice_hits(lattice, o, u)
    found = first_hit(lattice.solid(), o, u)
    hit = np.isfinite(want)
    assert 0.1 < hit.mean() < 1.0
    np.testing.assert_array_equal(np.isfinite(found), hit)
    # A ray that grazes a beam is short by more than the tolerance, by as much as its angle of incidence is small.
    short = want[hit] - found[hit]
    assert np.all(short >= -1e-6)
    assert np.mean(short < 1e-5) > 0.98
    p = o[hit] + found[hit, None] * u[hit]
    assert np.all(np.abs(lattice.solid().field(p)) < 1e-6)


def test_a_ray_that_starts_inside_hits_at_once() -> None:
    assert first_hit(frep.sphere((0, 0, 0), 5), [(1, 2, 0)], [(0, 0, 1)]).tolist() == [0.0]


def test_hits_beyond_the_distance_do_not_count() -> None:
    ball = frep.sphere((0, 0, 0), 5)
    assert first_hit(ball, [(-10, 0, 0)], (1, 0, 0), 5.001)[0] == pytest.approx(5.0, abs=1e-6)
    assert math.isinf(first_hit(ball, [(-10, 0, 0)], (1, 0, 0), 4.999)[0])
    assert math.isinf(first_hit(ball, [(-10, 0, 0)], (-1, 0, 0))[0])


def test_the_length_of_a_direction_does_not_matter() -> None:
    o, u = rays_at(np.zeros((50, 3)), 2.0, 20.0)
    ball = frep.sphere((0, 0, 0), 5)
    scaled = first_hit(ball, o, u * RNG.uniform(0.1, 9, (50, 1)))
    np.testing.assert_allclose(scaled, first_hit(ball, o, u), atol=1e-9)


def test_a_steep_field_needs_its_slope() -> None:
    x, y, z = frep.coordinates()
    steep = frep.Solid(4 * (frep.sqrt(x**2 + y**2 + z**2) - 5), bounds=((-6, -6, -6), (6, 6, 6)))
    o, u = rays_at(np.zeros((300, 3)), 3.0, 30.0)
    want = ball_hits(o, u, np.zeros(3), 5.0)[:, 0]
    found = first_hit(steep, o, u, slope=4)
    np.testing.assert_array_equal(np.isinf(found), np.isinf(want))
    np.testing.assert_allclose(found[np.isfinite(want)], want[np.isfinite(want)], atol=1e-4)


def test_no_step_passes_a_thin_wall() -> None:
    # Plates of 1 um, 10 mm apart: whatever the angle, the first is hit.
    plates = frep.union(*(frep.box((k, -50, -50), (k + 1e-3, 50, 50)) for k in (0, 10, 20)))
    u = np.stack([np.ones(500), *RNG.uniform(-1, 1, (2, 500))], axis=1)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    found = first_hit(plates, np.full((500, 3), (-7.3, 0, 0)), u)
    np.testing.assert_allclose(found, 7.3 / u[:, 0], atol=1e-5)


# --- bad input -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "given",
    [
        {"solid": 7},
        {"origins": [(0, 0)]},
        {"origins": [(0, 0, math.nan)]},
        {"directions": (0, 0, 0)},
        {"directions": [(1, 0, 0), (0, 1, 0), (0, 0, 1)]},
        {"max_distance": -1.0},
        {"max_distance": math.nan},
        {"slope": 0.0},
        {"tolerance": 0.0},
    ],
    ids=str,
)
def test_bad_rays_are_refused(given: dict) -> None:
    arguments = {
        "solid": frep.sphere((0, 0, 0), 1),
        "origins": [(5, 0, 0), (6, 0, 0)],
        "directions": (1, 0, 0),
        **given,
    }
    name = next(iter(given))
    with pytest.raises((ArgumentError, ArgumentTypeError), match=f"^{name}: "):
        first_hit(**arguments)


@pytest.mark.parametrize("directions", [np.zeros((0, 3)), (1, 0, 0)], ids=["none", "one"])
def test_no_rays_have_no_hits(directions) -> None:
    assert first_hit(frep.sphere((0, 0, 0), 1), np.zeros((0, 3)), directions).shape == (0,)


def test_an_infinite_solid_needs_a_distance() -> None:
    ground = frep.half_space((0, 0, 1), (0, 0, 0))
    with pytest.raises(UnboundedError, match="max_distance"):
        first_hit(ground, [(0, 0, 5)], (0, 0, -1))
    assert first_hit(ground, [(0, 0, 5)], (0, 0, -1), 100)[0] == pytest.approx(5.0, abs=1e-5)
