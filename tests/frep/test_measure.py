"""Volumes from the field: closed forms, the slope's independence, invariances."""

from __future__ import annotations

import math

import numpy as np
import pytest

import frep
from frep import Solid
from frep.grid import INSIDE, LEAF
from frep.measure import volume_of
from frep.sizing import sample_solid
from topologies import beams

X, Y, Z = frep.coordinates()
BALL = 4 / 3 * math.pi * 5**3


def by_samples(part: Solid, spacing: float) -> float:
    """The sum over one grid, which `Solid.volume` may refine."""
    return volume_of(sample_solid(part, spacing, None, exact=2.0))


def test_ball_converges():
    """Halving the voxel divides the error by about four, so that a quarter of the voxel divides it by eight at least."""
    ball = frep.sphere((0.1, 0.2, 0.3), 5)
    errors = [abs(by_samples(ball, 0.5 * h) - BALL) for h in (1.0, 0.25)]
    assert errors[1] < errors[0] / 8
    assert errors[1] < 2e-3 * BALL


@pytest.mark.parametrize("factor", [0.01, 0.3, 7.0])
def test_fields_that_are_no_distances_measure_the_same(factor):
    """The slope is taken out: the same zero set, another steepness, and one that varies."""
    ball = frep.sphere((0, 0, 0), 5)
    steep = Solid(factor * ball.field, bounds=4 * ball.bounds)
    assert steep.volume(0.25) == pytest.approx(BALL, rel=4e-3)
    squared = Solid((X**2 + Y**2 + Z**2 - 25) * factor, bounds=4 * ball.bounds)
    assert squared.volume(0.25) == pytest.approx(BALL, rel=0.01)
    # A field that is flatter than the faces that cut it.
    cut = Solid(0.01 * ball.field, bounds=1.1 * ball.bounds)
    assert cut.volume(0.25) == pytest.approx(BALL, rel=4e-3)


def test_steep_faces_away_from_the_solid_add_nothing():
    """A flat field in a box whose faces are a hundred times as steep: samples beside those have a slope, and no surface."""
    ball = frep.sphere((0.1, 0.2, 0.3), 5)
    for h in (1.0, 0.7, 0.5):
        assert by_samples(Solid(0.01 * ball.field, bounds=1.5 * ball.bounds), 0.5 * h) == pytest.approx(BALL, rel=4e-3)


def test_flat_boxes_are_exact_but_for_their_edges():
    """Faces midway between samples cost nothing: what is left goes with the edges, of second order."""
    lo, hi = np.array([0.3, -1.7, 2.2]), np.array([9.1, 6.4, 8.8])
    size = hi - lo
    errors = [abs(by_samples(frep.box(lo, hi), 0.5 * h) - size.prod()) for h in (0.4, 0.2)]
    assert errors[1] < 0.8 * size.sum() * 0.2**2
    assert errors[1] < 0.5 * errors[0]


def test_thin_walls_of_any_alignment():
    """A plate 2.2 voxels thick, turned and shifted."""
    voxel, wall = 0.25, 0.55
    for normal, shift in (((0, 0, 1), 0.0), ((0, 0, 1), 0.11), ((1, 2, 2), 0.07), ((3, 4, 0), 0.2)):
        plate = frep.half_space(normal).shell(wall).translate((0, 0, shift)) & frep.sphere((0, 0, 0), 8)
        # The slab between the plane and `wall` behind it, cut from the ball.
        top = shift * normal[2] / float(np.linalg.norm(normal))
        low = top - wall
        expected = math.pi * (64 * (top - low) - (top**3 - low**3) / 3)
        assert plate.volume(voxel) == pytest.approx(expected, rel=0.01)


def test_moved_parts_measure_the_same():
    part = beams.bcc(5).thicken(1.4) & frep.sphere((0, 0, 0), 9)
    volume = part.volume(0.3)
    assert part.translate((3 * 0.3, 0, 0)).volume(0.3) == pytest.approx(volume, rel=5e-4)
    assert part.rotate((1, 2, 3), 0.4).volume(0.3) == pytest.approx(volume, rel=0.01)
    assert part.scale(2).volume(0.6) == pytest.approx(8 * volume, rel=5e-4)


def test_union_and_intersection_share_out_the_volume():
    """|A| + |B| = |A or B| + |A and B|, sample by sample up to the creases."""
    a, b = frep.sphere((0, 0, 0), 4), frep.box((-1, -2, -3), (6, 5, 4))
    h = 0.2
    assert (a | b).volume(h) + (a & b).volume(h) == pytest.approx(a.volume(h) + b.volume(h), rel=3e-3)


def test_inside_tiles_count():
    grid = frep.box((0, 0, 0), (30, 30, 30)).sample(0.5)
    assert np.count_nonzero(grid.table == INSIDE) * LEAF**3 * 0.125 > 0.3 * 30**3
    assert frep.box((0, 0, 0), (30, 30, 30)).volume(0.5) == pytest.approx(27000, rel=2e-3)


def test_small_parts_are_sampled_more_finely():
    """Few voxels across, edges and all: within 0.3 %, where one grid of half the voxel is off by more than 1 %."""
    rng = np.random.default_rng(4)
    ours, plain = [], []
    for _ in range(20):
        lo, size = rng.uniform(-1, 1, 3), rng.uniform(3, 8, 3)
        box = frep.box(lo, lo + size)
        ours.append(box.volume(1.0) / size.prod() - 1)
        plain.append(by_samples(box, 0.5) / size.prod() - 1)
    assert np.abs(ours).max() < 3e-3
    assert np.abs(plain).max() > 1e-2


def test_a_cell_of_three_voxels_a_beam_is_measured_to_a_thousandth():
    """Wherever it is cut: a period of a lattice has one volume."""
    lattice = beams.bcc(10).thicken(1.2)
    rng = np.random.default_rng(5)
    found = []
    for _ in range(8):
        start = rng.uniform(-5, 5, 3)
        found.append((lattice & frep.box(start, start + 10)).volume(0.4))
    assert np.ptp(found) < 1e-3 * np.mean(found)


def test_a_small_part_in_a_large_box_stays_affordable():
    """A finer grid of the whole box would not fit: no more is sampled than a few million blocks."""
    dot = Solid(frep.sphere((1, 2, 3), 2).field, bounds=[(-400, -400, -400), (400, 400, 400)])
    assert dot.volume(2.0) == pytest.approx(4 / 3 * math.pi * 8, rel=0.1)


def test_python_functions_are_not_asked_more_often_than_need_be():
    asked = []

    def ball(x, y, z):
        asked.append(np.size(x))
        return np.sqrt(x * x + y * y + z * z) - 5

    Solid(frep.foreign(ball, lipschitz=1.0), bounds=[(-6, -6, -6), (6, 6, 6)]).volume(1.0)
    assert sum(asked) < 2 * 32**3
