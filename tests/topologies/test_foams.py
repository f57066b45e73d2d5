"""Foams: distances against the lattice of their centres, volumes of their cells, variants."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

import frep
from frep import ArgumentError, ArgumentTypeError
from topologies import foams

RNG = np.random.default_rng(5)
U = 6.0
CENTRES = {
    "honeycomb": ([(0, 0, 0), (0.5, 0.5 * math.sqrt(3), 0)], (1, math.sqrt(3), 1e6)),
    "kelvin": ([(0, 0, 0), (0.5, 0.5, 0.5)], (1, 1, 1)),
    "rhombic": ([(0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0)], (1, 1, 1)),
    "closed_cubes": ([(0, 0, 0)], (1, 1, 1)),
}


@pytest.mark.parametrize("name", CENTRES)
def test_walls_are_those_of_voronoi_cells(name):
    """The nearest wall is the nearest of the planes midway between the own centre and the others."""
    base, period = CENTRES[name]
    cells = np.array(list(itertools.product(range(-3, 4), repeat=3))) * (np.array(period) < 1e5)
    centres = U * np.unique((np.array(base)[:, None] + cells * np.array(period)).reshape(-1, 3), axis=0)
    points = RNG.uniform(-U, U, (2000, 3)) * (np.array(period) < 1e5)
    _, own = cKDTree(centres).query(points)
    away = centres[None] - centres[own][:, None]
    length = np.linalg.norm(away, axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        planes = 0.5 * length - np.einsum("nkc,nc->nk", away, points - centres[own]) / length
    expected = np.nanmin(planes, axis=1)
    foam = getattr(foams, name)(cell=U)
    np.testing.assert_allclose(foam.distance(points), expected, atol=1e-9)
    assert foam.distance(centres[0]) == pytest.approx(foam.depth)


@pytest.mark.parametrize("name", CENTRES)
def test_variants_part_space(name):
    foam = getattr(foams, name)(cell=U)
    points = RNG.uniform(-U, U, (2000, 3))
    np.testing.assert_array_equal(foam.sheet(0.7).contains(points), ~foam.twin(0.7).contains(points))
    part = foam.sheet(0.3 + 0.05 * frep.coordinates()[2]) & frep.box((0, 0, 0), (U, U, U))
    report = part.mesh(voxel=0.15).check()
    assert report.closed
    assert report.manifold


def test_the_cells_of_a_honeycomb_are_hexagons():
    wall = 0.8
    block = frep.box((0, 0, 0), (2 * U, 2 * math.sqrt(3) * U, 3.0))
    comb = (foams.honeycomb(cell=U).sheet(wall) & block).volume(voxel=0.1)
    box = 12 * math.sqrt(3) * U**2
    assert comb / box == pytest.approx(1 - (1 - wall / U) ** 2, abs=2e-3)


@pytest.mark.parametrize("name", CENTRES)
def test_the_period_repeats(name):
    foam = getattr(foams, name)(cell=U)
    points = RNG.uniform(-U, U, (500, 3))
    for axis in range(3):
        shift = np.eye(3)[axis] * foam.period[axis]
        np.testing.assert_allclose(foam.distance(points + shift), foam.distance(points), atol=1e-9)


@pytest.mark.parametrize(
    ("argument", "error", "call"),
    [
        ("cell", ArgumentError, lambda: foams.kelvin(0)),
        ("cell", ArgumentTypeError, lambda: foams.honeycomb("wide")),
        ("thickness", ArgumentError, lambda: foams.honeycomb(U).sheet(-1)),
        ("thickness", ArgumentError, lambda: foams.honeycomb(U).sheet(U)),
        (
            "thickness",
            ArgumentError,
            lambda: foams.closed_cubes(U).twin(1.01 * U + frep.clip(frep.coordinates()[0], 0, 1)),
        ),
    ],
)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
