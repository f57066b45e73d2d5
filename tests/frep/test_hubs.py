"""Hubs: closed forms, brute-force quadrature over directions, the offset law, invariances."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from frep.errors import ArgumentError, ArgumentTypeError
from frep.hubs import HubMoments, cone_beam, hub_moments, hub_rows

AXES = np.vstack([np.eye(3), -np.eye(3)])
SQUARE = AXES[[0, 1, 3, 4]]
OCTET = np.array([p for p in np.ndindex(3, 3, 3) if sum(c != 1 for c in p) == 2]) - 1.0

# --- closed forms ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("length", "r1", "r2", "volume", "area"),
    [(1, 0.1, 0.1, 0.0356047167, 0.7539822369), (2, 0.5, 0.25, 1.2251393226, 6.7495154667)],
)
def test_cone_beam_oracle(length, r1, r2, volume, area):
    assert cone_beam(length, r1, r2) == pytest.approx((volume, area), abs=1e-10)
    assert cone_beam(length, r2, r1) == pytest.approx((volume, area), abs=1e-10)


def test_cone_beam_becomes_the_larger_ball():
    ball = 4 / 3 * math.pi * 0.5**3, 4 * math.pi * 0.5**2
    for length in (0, 0.1, 0.25):
        assert cone_beam(length, 0.5, 0.25) == pytest.approx(ball)
    assert cone_beam(0.25 + 1e-9, 0.5, 0.25) == pytest.approx(ball, rel=1e-6)


@pytest.mark.parametrize("r", [0.01, 0.2, 0.35])
def test_cubic_hub(r):
    hub = hub_moments(r, AXES, [r] * 6)
    assert hub.volume == pytest.approx(3 * math.pi * r**2 - 8 * math.sqrt(2) * r**3, rel=1e-13)
    assert hub.area == pytest.approx(6 * math.pi * r - 24 * math.sqrt(2) * r**2, rel=1e-13)
    # The seams of two perpendicular cylinders reach as far as their radius.
    assert hub.excess == pytest.approx(r - 0.5)
    assert hub.moment == pytest.approx(np.diag(np.diag(hub.moment)), abs=1e-16)


@pytest.mark.parametrize("r", [0.01, 0.2, 0.5])
def test_square_slab_hub(r):
    hub = hub_moments(r, SQUARE, [r] * 4)
    assert hub.volume == pytest.approx(2 * math.pi * r**2 - 16 * r**3 / 3, rel=1e-13)
    assert hub.area == pytest.approx(4 * math.pi * r - 16 * r**2, rel=1e-13)


def test_no_beams_leave_a_ball():
    hub = hub_moments(0.3, np.zeros((0, 3)), [])
    assert hub.volume == pytest.approx(4 / 3 * math.pi * 0.027)
    assert hub.area == pytest.approx(4 * math.pi * 0.09)
    assert hub.moment[:3, :3] == pytest.approx(np.eye(3) * 4 / 15 * math.pi * 0.3**5)
    assert (hub.beam, hub.other, hub.excess) == (-1, -1, -math.inf)


@pytest.mark.parametrize(("length", "r1", "r2"), [(1, 0.2, 0.2), (1, 0.3, 0.1), (1, 0.1, 0.3), (2, 1.9, 0.05)])
def test_the_two_hubs_of_one_beam_are_the_beam(length, r1, r2):
    here = hub_moments(r1, [[length, 0, 0]], [r2])
    there = hub_moments(r2, [[-length, 0, 0]], [r1])
    assert (here.volume + there.volume, here.area + there.area) == pytest.approx(cone_beam(length, r1, r2), rel=1e-13)
    assert (here.beam, here.other) == (0, -1)


def test_a_straight_chain_is_a_cylinder():
    """Two opposite half-beams of one width: a piece of cylinder, off centre where the beams differ in length."""
    r, left, right = 0.3, 2.0, 3.0
    hub = hub_moments(r, [[right, 0, 0], [-left, 0, 0]], [r, r])
    a, b, disk = -left / 2, right / 2, math.pi * r**2
    across = disk * r**2 / 4 * (b - a)
    expected = np.diag([disk * (b**3 - a**3) / 3, across, across, disk * (b - a)])
    expected[0, 3] = expected[3, 0] = disk * (b**2 - a**2) / 2
    assert hub.moment == pytest.approx(expected, rel=1e-13, abs=1e-15)
    assert hub.area == pytest.approx(2 * math.pi * r * (b - a), rel=1e-13)


# --- brute force -------------------------------------------------------------------------------------------------------


def _exit(directions, radius, ends, end_radii):
    """How far the hub reaches along unit directions from its node."""
    far = np.full(len(directions), radius)
    for end, other in zip(ends, end_radii, strict=True):
        length = np.linalg.norm(end)
        s = (radius - other) / length
        c = math.sqrt(1 - s * s)
        along = directions @ end / length
        normal = along * s + np.sqrt(np.maximum(1 - along**2, 0)) * c
        cone = np.where(normal > 0, radius / np.where(normal > 0, normal, 1), np.inf)
        cut = np.where(along > 0, (radius * s + length * c * c / 2) / np.where(along > 0, along, 1), np.inf)
        far = np.maximum(far, np.where(along >= s, np.minimum(cone, cut), 0))
    return far


def _brute(radius, ends, end_radii, n=600):
    """Moments from rho(w)^3 .. rho(w)^5 over a grid of directions; the reach has kinks, so some 1e-5 is what it gives."""
    moment = np.zeros((4, 4))
    nodes, weights = np.polynomial.legendre.leggauss(n)
    turn = (np.arange(2 * n) + 0.5) * math.pi / n
    for z, weight in zip(nodes, weights, strict=True):
        level = math.sqrt(1 - z * z)
        w = np.stack([level * np.cos(turn), level * np.sin(turn), np.full_like(turn, z)], axis=1)
        reach = _exit(w, radius, ends, end_radii)
        area = weight * math.pi / n
        moment[3, 3] += area * np.sum(reach**3) / 3
        moment[:3, 3] += area * np.sum(w * reach[:, None] ** 4, axis=0) / 4
        moment[:3, :3] += area * np.einsum("ni,nj,n->ij", w, w, reach**5) / 5
    moment[3, :3] = moment[:3, 3]
    return moment


def _random_hub(rng, beams, radii=(0.05, 0.6)):
    """A clean hub of random beams: drawn again until it is."""
    while True:
        ends = rng.normal(size=(beams, 3))
        ends *= rng.uniform(2, 4, size=(beams, 1)) / np.linalg.norm(ends, axis=1, keepdims=True)
        end_radii = rng.uniform(*radii, size=beams)
        hub = hub_moments(0.2, ends, end_radii)
        if hub.excess < 0:
            return 0.2, ends, end_radii, hub


@pytest.mark.parametrize("seed", range(8))
def test_moments_against_directions(seed):
    """Beams that narrow and that widen, one to eight at a node."""
    rng = np.random.default_rng(seed)
    radius, ends, end_radii, hub = _random_hub(rng, 1 + seed, (0.05, 0.6) if seed < 5 else (0.05, 0.35))
    expected = _brute(radius, ends, end_radii)
    assert hub.volume == hub.moment[3, 3]
    assert hub.moment == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    assert hub.volume == pytest.approx(expected[3, 3], rel=3e-5)


@pytest.mark.parametrize("seed", range(8))
def test_area_is_the_derivative_of_volume(seed):
    """All radii grown by t: faces move along their normals by t, cut disks by s t along the axis. With the seams' order
    unchanged the volume is a cubic in t, for which this difference is exact."""
    rng = np.random.default_rng(100 + seed)
    radius, ends, end_radii, hub = _random_hub(rng, 1 + seed, (0.05, 0.35))
    lengths = np.linalg.norm(ends, axis=1)
    s = (radius - end_radii) / lengths
    disks = math.pi * (1 - s**2) * (0.5 * (radius + end_radii)) ** 2

    def grown(t):
        return hub_moments(radius + t, ends, end_radii + t).volume

    t = 1e-4
    slope = (8 * (grown(t) - grown(-t)) - (grown(2 * t) - grown(-2 * t))) / (12 * t)
    assert hub.area + np.sum(s * disks) == pytest.approx(slope, rel=1e-9)


# --- invariances -------------------------------------------------------------------------------------------------------


def _rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.linalg.det(q)


@given(seed=st.integers(0, 10**6), beams=st.integers(1, 7), scale=st.floats(1e-3, 1e3))
def test_rotation_and_scale(seed, beams, scale):
    rng = np.random.default_rng(seed)
    radius, ends, end_radii, hub = _random_hub(rng, beams, (0.05, 0.3))
    turn = np.eye(4)
    turn[:3, :3] = scale * _rotation(rng)
    order = rng.permutation(beams)
    moved = hub_moments(scale * radius, (ends @ turn[:3, :3].T)[order], scale * end_radii[order])
    expected = scale**3 * turn @ hub.moment @ turn.T
    sizes = np.array([scale, scale, scale, 1.0])
    assert moved.moment / np.outer(sizes, sizes) == pytest.approx(
        expected / np.outer(sizes, sizes), rel=1e-12, abs=1e-12 * scale**3
    )
    assert moved.area == pytest.approx(scale**2 * hub.area, rel=1e-12)
    assert moved.excess == pytest.approx(scale * hub.excess, rel=1e-10)


@given(seed=st.integers(0, 10**6), beams=st.integers(1, 5))
def test_mirror(seed, beams):
    radius, ends, end_radii, hub = _random_hub(np.random.default_rng(seed), beams, (0.05, 0.3))
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    mirrored = hub_moments(radius, ends @ mirror[:3, :3], end_radii)
    assert mirrored.moment == pytest.approx(mirror @ hub.moment @ mirror, rel=1e-12, abs=1e-13)


@given(tilt=st.floats(-1e-6, 1e-6), turn=st.floats(-1e-9, 1e-9))
def test_seams_that_nearly_meet_in_a_point(tilt, turn):
    """Four seams of an octet hub meet in one point above each square of beams; bent a little, they meet in two."""
    ends = 3.0 * OCTET @ np.array([[1, 0, 0], [tilt, 1, turn], [0, 0, 1]])
    straight = hub_moments(0.2, 3.0 * OCTET, [0.2] * 12)
    hub = hub_moments(0.2, ends, [0.2] * 12)
    assert hub.volume == pytest.approx(straight.volume, rel=2 * (abs(tilt) + abs(turn)) + 1e-13)
    assert hub.area == pytest.approx(straight.area, rel=2 * (abs(tilt) + abs(turn)) + 1e-13)


# --- where a hub is not clean ------------------------------------------------------------------------------------------


def test_seams_that_touch_the_cut_are_clean():
    assert hub_moments(0.5, SQUARE, [0.5] * 4).excess == pytest.approx(0, abs=1e-12)


@given(angle=st.floats(0.1, 3.0), radius=st.floats(0.01, 0.2))
def test_excess_of_two_cylinders(angle, radius):
    """The seam of two cylinders at an angle reaches r cot(angle / 2)."""
    hub = hub_moments(radius, [[1, 0, 0], [math.cos(angle), math.sin(angle), 0]], [radius] * 2)
    assert hub.excess == pytest.approx(radius / math.tan(angle / 2) - 0.5, abs=1e-9)


def test_one_beam_inside_another():
    hub = hub_moments(0.1, [[1, 0, 0], [2, 0, 0]], [0.1, 0.1])
    assert hub.excess == math.inf
    wide = hub_moments(0.1, [[1, 0, 0], [1, 0.01, 0]], [0.05, 0.5])
    assert (wide.excess, wide.beam, wide.other) == (math.inf, 0, 1)
    # A cone that widens fast holds another even at more than a right angle.
    wide = hub_moments(0.5, [[0.5, 0, 0], [-0.55, 2.0, 0]], [0.05, 2.45])
    assert (wide.excess, wide.beam, wide.other) == (math.inf, 0, 1)


def test_contained_balls_are_refused():
    with pytest.raises(ArgumentError, match=r"node 1 of radius 1.5 mm.*1 mm apart"):
        hub_moments(0.2, [[1, 0, 0], [0, 1, 0]], [0.2, 1.5])


def test_bad_arguments():
    with pytest.raises(ArgumentError, match="radius"):
        hub_moments(0, [[1, 0, 0]], [0.1])
    with pytest.raises(ArgumentError, match=r"ends.*\(1, 2\)"):
        hub_moments(0.1, [[1, 0]], [0.1])
    with pytest.raises(ArgumentError, match="end_radii"):
        hub_moments(0.1, [[1, 0, 0]], [0.1, 0.1])
    with pytest.raises(ArgumentError, match="end_radii"):
        hub_moments(0.1, [[1, 0, 0]], [-0.1])
    with pytest.raises(ArgumentError, match="ends"):
        hub_moments(0.1, [[1, 0, math.nan]], [0.1])
    with pytest.raises(ArgumentTypeError, match="ends"):
        hub_moments(0.1, "beams", [0.1])
    with pytest.raises(ArgumentError, match="length"):
        cone_beam(-1, 0.1, 0.1)
    with pytest.raises(ArgumentError, match="r2"):
        cone_beam(1, 0.1, math.nan)


# --- many at once ------------------------------------------------------------------------------------------------------


def test_a_batch_is_its_hubs():
    rng = np.random.default_rng(5)
    single, radii, ends, end_radii, first = [], [], [], [], [0]
    for beams in (3, 0, 6, 1):
        if beams == 0:
            radius, e, er, hub = 0.2, np.zeros((0, 3)), np.zeros(0), hub_moments(0.2, np.zeros((0, 3)), [])
        else:
            radius, e, er, hub = _random_hub(rng, beams, (0.05, 0.3))
        single.append(hub)
        radii.append(radius)
        ends.append(e)
        end_radii.append(er)
        first.append(first[-1] + beams)
    rows = hub_rows(np.array(radii), np.array(first), np.vstack(ends), np.concatenate(end_radii))
    for row, hub in zip(rows, single, strict=True):
        assert isinstance(hub, HubMoments)
        assert (row[4], row[0], row[1]) == (hub.volume, hub.area, hub.excess)


@given(seed=st.integers(0, 10**6))
def test_a_held_ball_in_a_batch_is_nan(seed):
    rng = np.random.default_rng(seed)
    end = rng.normal(size=3)
    assume(np.linalg.norm(end) > 0.1)
    rows = hub_rows(np.array([0.1]), np.array([0, 1]), end[None], np.array([0.2 + np.linalg.norm(end)]))
    assert np.isnan(rows).all()
