"""Polish: vertices near the surface, volumes several times better, flat facets untouched, caps kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

import frep
from frep import Solid
from frep.polish import surface_distance
from topologies import beams, tpms

RNG = np.random.default_rng(12)
X, Y, Z = frep.coordinates()
BALL = frep.sphere((0.03, -0.02, 0.01), 3)


@pytest.mark.parametrize("voxel", [0.6, 0.3])
def test_volume_of_curved_parts_is_several_times_better(voxel):
    for part, volume in (
        (BALL, 36 * math.pi),
        (frep.torus((0, 0, 0), (1, 2, 2), 3, 1), 6 * math.pi**2),
        (frep.capsule((0, 0, 0), (3, 4, 5), 1), math.pi * (math.sqrt(50) + 4 / 3)),
    ):
        raw, polished = (abs(part.mesh(voxel, polish=p).volume - volume) for p in (False, True))
        assert polished < 0.2 * raw


def test_struts_three_voxels_thick_keep_their_volume():
    """Raw marching cubes loses several percent of such a lattice."""
    part = beams.bcc(5).thicken(0.8) & frep.box((0, 0, 0), (10, 10, 10))
    expected = 14_902 * (10 / 50) ** 3
    raw, polished = (part.mesh(0.25, polish=p).volume for p in (False, True))
    assert abs(polished - expected) < 0.01 * expected
    assert abs(raw - expected) > 0.02 * expected


def test_polish_moves_vertices_by_less_than_a_voxel_and_keeps_the_faces():
    part = tpms.gyroid(cell=5).sheet(0.8) & frep.box((0, 0, 0), (10, 10, 10))
    raw, polished = part.mesh(0.25), part.mesh(0.25, polish=True)
    np.testing.assert_array_equal(raw.faces, polished.faces)
    assert np.linalg.norm(raw.vertices - polished.vertices, axis=1).max() < 0.6 * 0.25
    # The facets straddle the surface: vertices a little outside, centres a little inside.
    distance = part.field(polished.vertices)
    assert np.percentile(np.abs(distance), 95) < 0.1 * 0.25


def test_flat_faces_stay_flat():
    """A prism turned any way: its facets lie on the planes."""
    part = frep.box((0, 0, 0), (6, 5, 4)).rotate((1, 2, 3), 0.7)
    mesh = part.mesh(0.3, polish=True)
    distance = np.abs(part.field(mesh.vertices))
    # All vertices, but those that no facet of one plane has.
    assert np.mean(distance < 1e-9) > 0.75
    # The edges, 60 mm of them, are chamfered: a part of a voxel squared each millimetre.
    assert abs(mesh.volume - 120) < 0.25 * 0.3**2 * 60


def test_a_plane_cut_by_a_box_is_exact():
    part = frep.half_space((1, 2, 2), (3, 3, 3)) & frep.box((0, 0, 0), (6, 6, 6))
    mesh = part.mesh(0.3, polish=True)
    assert mesh.volume == pytest.approx(108, rel=0.01)
    assert np.all(mesh.vertices >= 0)
    assert np.all(mesh.vertices <= 6)


@pytest.mark.parametrize("factor", [0.05, 1.0, 30.0])
def test_the_scale_of_the_field_does_not_matter(factor):
    reference = BALL.mesh(0.4, polish=True)
    scaled = Solid(factor * BALL.field, bounds=4 * BALL.bounds)
    mesh = scaled.mesh(0.4, polish=True)
    assert mesh.volume == pytest.approx(36 * math.pi, rel=2e-3)
    assert reference.volume == pytest.approx(36 * math.pi, rel=2e-3)


def test_surface_distance_is_first_order_distance_and_unit_normal():
    points = RNG.normal(size=(500, 3))
    points *= (3 + RNG.uniform(-0.3, 0.3, (500, 1))) / np.linalg.norm(points, axis=1)[:, None]
    squared = Solid(X**2 + Y**2 + Z**2 - 9, bounds=((-9, -9, -9), (9, 9, 9)))
    distance, normal = surface_distance(squared, points, 0.3)
    radius = np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(distance, (radius**2 - 9) / (2 * radius), atol=1e-9)
    np.testing.assert_allclose(normal, points / radius[:, None], atol=1e-9)


def test_sharp_corners_do_not_fly():
    """Newton does not settle at creases: there the interpolated vertex stays."""
    part = frep.cone((0, 0, 0), (0, 0, 5), 2) | frep.box((-2, -2, -3), (2, 2, 0))
    raw, polished = part.mesh(0.3), part.mesh(0.3, polish=True)
    assert np.linalg.norm(raw.vertices - polished.vertices, axis=1).max() < 0.6 * 0.3
    assert polished.check().printable
