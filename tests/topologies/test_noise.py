"""Random fields: the fraction asked for, true walls, waves of one length, noise that vanishes at its nodes."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest

import frep
from frep import ArgumentError, ArgumentTypeError
from topologies import noise

X, Y, Z = frep.coordinates()
CELL = 5.0
SPINODAL = noise.spinodal(CELL, repeat=4, random_state=1)
PERIOD = frep.box((0, 0, 0), SPINODAL.period)


def uniform(n: int, size=SPINODAL.period, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, size, (n, 3))


@pytest.mark.parametrize("fraction", [0.15, 0.3, 0.5, 0.8])
def test_fraction_of_a_period(fraction):
    part = SPINODAL.solid(fraction) & PERIOD
    assert part.volume(voxel=0.5) / math.prod(SPINODAL.period) == pytest.approx(fraction, abs=0.003)


@pytest.mark.parametrize("directions", [None, ["z"], ["x", "y"], ["x", "y", "z"]])
def test_level_is_normally_distributed(directions):
    """Mean 0, variance 1, and the fraction below a bias that of the Gaussian inverse."""
    level = noise.spinodal((4, 5, 6), directions=directions, random_state=2).level(uniform(200_000, (24, 30, 36)))
    assert level.mean() == pytest.approx(0.0, abs=0.01)
    assert level.std() == pytest.approx(1.0, abs=0.01)
    for share in (0.2, 0.5, 0.7):
        assert (level < NormalDist().inv_cdf(share)).mean() == pytest.approx(share, abs=0.02)


def test_graded_fraction():
    """In slices of an infinite average: over many seeds the fraction follows the Field within 0.01."""
    points = uniform(20_000)
    law = 0.2 + 0.6 * X / SPINODAL.period[0]
    found = np.zeros(len(points))
    for seed in range(40):
        found += noise.spinodal(CELL, repeat=4, random_state=seed).solid(law).contains(points)
    for low in (0.2, 0.35, 0.5, 0.65):
        chosen = (law(points) >= low) & (law(points) < low + 0.15)
        assert found[chosen].mean() / 40 == pytest.approx(law(points[chosen]).mean(), abs=0.01)


def test_waves_have_the_length_asked_for():
    """The mean square of the slope is (2 pi / cell)^2 along each stretched axis together; in lamellae it is along their axis."""
    slopes = SPINODAL.level.gradient(uniform(50_000))
    assert (slopes**2).sum(axis=1).mean() == pytest.approx((2 * math.pi / CELL) ** 2, rel=0.05)
    lamellar = noise.spinodal(CELL, directions=["z"], spread=0.3, random_state=1).level.gradient(uniform(20_000))
    share = (lamellar**2).mean(axis=0) / (lamellar**2).sum(axis=1).mean()
    assert share[2] > math.cos(0.4) ** 2
    stretched = noise.spinodal((5, 5, 15), random_state=1)
    slopes = stretched.level.gradient(uniform(50_000, stretched.period))
    ratio = (slopes**2).mean(axis=0)
    assert ratio[0] / ratio[2] == pytest.approx(9.0, rel=0.15)


def test_sheet_is_as_thick_as_asked_along_the_normal():
    t = 0.5
    sheet = SPINODAL.sheet(t)
    points = uniform(4000)
    for _ in range(20):
        slope = SPINODAL.level.gradient(points)
        squared = np.maximum((slope**2).sum(axis=1), 0.1)
        points = points - np.clip(SPINODAL.level(points) / squared, -0.5, 0.5)[:, None] * slope
    points = points[np.abs(SPINODAL.level(points)) < 1e-6]
    assert len(points) > 3000
    slope = SPINODAL.level.gradient(points)
    normal = slope / np.linalg.norm(slope, axis=1)[:, None]
    for side in (-1, 1):
        # Exact up to 0.01 of the cell, and mostly to a tenth of that; nearer where another part of the sheet is.
        error = sheet.field(points + side * t / 2 * normal)
        assert np.median(np.abs(error)) < 1e-3 * CELL
        assert error.max() < 0.01 * CELL
    assert sheet.features[0].width.data == t


def test_solid_promises_no_more_than_the_distance():
    solid = SPINODAL.solid(bias=0.3)
    points = uniform(20_000)
    ahead = points + 0.1 * np.random.default_rng(2).normal(size=points.shape)
    rise = np.abs(solid.field(points) - solid.field(ahead))
    assert np.all(rise <= 1.001 * np.linalg.norm(points - ahead, axis=1) + 1e-6)
    assert solid.field.bounds((0, 0, 0), (1, 1, 1))[0] <= solid.field(uniform(1000, (1, 1, 1))).min()


def test_reproducible_and_periodic():
    points = uniform(1000)
    for make in (noise.spinodal, noise.perlin, noise.simplex):
        first, same, other = (make(CELL, random_state=s) for s in (3, 3, 4))
        fields = [f.level if isinstance(f, noise.Spinodal) else f for f in (first, same, other)]
        values = [f(points) for f in fields]
        assert np.array_equal(values[0], values[1])
        assert np.abs(values[0] - values[2]).max() > 0.1
    shift = np.array(SPINODAL.period) * (1, -2, 3)
    assert SPINODAL.level(points + shift) == pytest.approx(SPINODAL.level(points), abs=1e-6)
    perlin = noise.perlin(2, repeat=5, octaves=3, random_state=1)
    assert perlin(points + np.array([10, -20, 30])) == pytest.approx(perlin(points), abs=1e-6)


def test_perlin_noise_vanishes_at_its_nodes_with_unit_slope():
    """There it rises with the unit gradient of the node, scaled as the whole noise is to -1 to 1."""
    perlin = noise.perlin(2.0, random_state=1)
    nodes = 2.0 * np.random.default_rng(1).integers(-20, 20, (200, 3))
    assert perlin(nodes) == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(perlin.gradient(nodes), axis=1) == pytest.approx(2 / math.sqrt(3) / 2.0, rel=0.05)


def test_perlin_noise_is_the_classic_one():
    """Against the definition, corner by corner: within the 2e-3 of its spline."""
    repeat = 4
    slopes = noise.random_directions(repeat**3, random_state=np.random.default_rng(6)).reshape(4, 4, 4, 3)
    perlin = noise.perlin(1.0, repeat=repeat, random_state=6)
    points = uniform(2000, (4, 4, 4))
    base = np.floor(points).astype(int)
    t = points - base
    fade = t**3 * (t * (6 * t - 15) + 10)
    expected = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(np.array(corner) == 1, fade, 1 - fade), axis=1)
        slope = slopes[tuple(((base + corner) % repeat).T)]
        expected += weight * (slope * (t - corner)).sum(axis=1)
    assert perlin(points) == pytest.approx(expected * 2 / math.sqrt(3), abs=3e-3)


def test_octaves_add_finer_noise():
    """Between -1 and 1, of mean 0, and steeper the more octaves there are."""
    points = uniform(50_000, (32, 32, 32))
    steep = []
    for octaves in (1, 2, 4):
        field = noise.perlin(2, octaves=octaves, persistence=0.7, random_state=1)
        values = field(points)
        assert np.abs(values).max() <= 1.0
        assert abs(values.mean()) < 0.02
        steep.append(np.linalg.norm(field.gradient(points[:5000]), axis=1).mean() / values.std())
    assert np.all(np.diff(steep) > 0)


def test_simplex_noise_is_continuous_and_keeps_its_promises():
    simplex = noise.simplex(2.0, random_state=1)
    points = uniform(100_000, (60, 60, 60), seed=3)
    values = simplex(points)
    assert 0.8 < np.abs(values).max() <= 1.0
    assert abs(values.mean()) < 0.01
    limit = simplex.data.lipschitz
    for step in (1e-3, 0.1):
        ahead = points + step * np.random.default_rng(2).normal(size=points.shape)
        assert np.all(np.abs(simplex(ahead) - values) <= limit * np.linalg.norm(ahead - points, axis=1) + 1e-12)


def test_noise_roughens_a_wall():
    wall = 1.0 + 0.3 * noise.perlin(3, octaves=2, random_state=1)
    shell = frep.sphere((0, 0, 0), 8).shell(wall)
    assert shell.volume(voxel=0.4) == pytest.approx(frep.sphere((0, 0, 0), 8).shell(1.0).volume(voxel=0.4), rel=0.1)


BAD = [
    (lambda: noise.spinodal(5), ArgumentTypeError, "random_state"),
    (lambda: noise.spinodal(0, random_state=1), ArgumentError, "cell_size"),
    (lambda: noise.spinodal(5, n_waves=0, random_state=1), ArgumentError, "n_waves"),
    (lambda: noise.spinodal(5, repeat=9, random_state=1), ArgumentError, "repeat"),
    (lambda: noise.spinodal(5, directions=[(0, 0, 0)], random_state=1), ArgumentError, "directions"),
    (lambda: noise.spinodal(5, directions="z", random_state=1), ArgumentTypeError, "directions"),
    (lambda: SPINODAL.solid(), ArgumentError, "got none"),
    (lambda: SPINODAL.solid(0.5, bias=0), ArgumentError, "got both"),
    (lambda: SPINODAL.solid(1.0), ArgumentError, "between 0 and 1"),
    (lambda: SPINODAL.solid(bias=9), ArgumentError, "bias"),
    (lambda: SPINODAL.sheet(0), ArgumentError, "thickness"),
    (lambda: noise.perlin(5), ArgumentTypeError, "random_state"),
    (lambda: noise.perlin(-5, random_state=1), ArgumentError, "cell_size"),
    (lambda: noise.perlin(5, octaves=0, random_state=1), ArgumentError, "octaves"),
    (lambda: noise.perlin(5, persistence=2, random_state=1), ArgumentError, "persistence"),
    (lambda: noise.perlin(5, repeat=99, random_state=1), ArgumentError, "repeat"),
    (lambda: noise.simplex(5), ArgumentTypeError, "random_state"),
    (lambda: noise.simplex(X, random_state=1), ArgumentTypeError, "cell_size"),
]


@pytest.mark.parametrize(("call", "error", "text"), BAD)
def test_bad_input(call, error, text):
    with pytest.raises(error, match=text):
        call()
