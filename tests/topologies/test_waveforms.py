"""Formulas of the periodic surfaces: values by hand, symmetries, drops, transitions, curvature."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from topologies import tpms, waveforms
from topologies.waveforms import WAVEFORMS, Wave

RNG = np.random.default_rng(11)
X, Y, Z = frep.coordinates()
TURN = 2.0 * math.pi
ANGLES = RNG.uniform(-TURN, TURN, (400, 3))
NAMES = sorted(WAVEFORMS)
MIRRORED = [name for name in NAMES if WAVEFORMS[name].mirrored]


def waveform(name: str, drops=(1.0, 1.0, 1.0)) -> frep.Field:
    """The formula as a Field of three angles."""
    facts = WAVEFORMS[name]
    return facts.formula(*(Wave(a, d, facts.mirrored) for a, d in zip((X, Y, Z), drops, strict=True)))


AT_POINTS = {
    # (turns of x, y, z): the value, by hand from the printed formula.
    "gyroid": {(0, 0, 0): 0.0, (1 / 8, 1 / 8, 1 / 8): 1.5, (1 / 4, 0, 0): 1.0},
    "schwarz_p": {(0, 0, 0): 3.0, (1 / 2, 1 / 2, 1 / 2): -3.0, (1 / 4, 1 / 4, 1 / 4): 0.0},
    "schwarz_d": {(0, 0, 0): 1.0, (1 / 4, 1 / 4, 1 / 4): -1.0, (1 / 8, 1 / 8, 1 / 8): 0.0},
    "neovius": {(0, 0, 0): 13.0, (1 / 2, 0, 0): -1.0, (1 / 4, 1 / 4, 1 / 4): 0.0},
    "iwp": {(0, 0, 0): 3.0, (1 / 4, 1 / 4, 1 / 4): 3.0, (1 / 2, 0, 0): -5.0},
    "f_rd": {(0, 0, 0): 1.0, (1 / 2, 0, 0): -7.0, (1 / 4, 1 / 4, 0): 1.0},
    "lidinoid": {(0, 0, 0): -1.35, (1 / 4, 0, 0): 0.65, (1 / 8, 1 / 8, 1 / 8): 0.9},
    "split_p": {(0, 0, 0): -1.8, (1 / 4, 1 / 4, 1 / 4): 0.6, (1 / 8, 1 / 8, 1 / 8): 1.65},
    "fischer_koch_s": {(0, 0, 0): 0.0, (0, 1 / 4, 0): 1.0, (1 / 4, 0, 1 / 2): -1.0 * -1.0},
    "fischer_koch_cy": {(0, 0, 0): -1.0, (1 / 4, 1 / 4, 1 / 4): -1.0, (1 / 2, 0, 0): 1.0},
    "fischer_koch_cs": {(0, 0, 0): 3.0, (1 / 4, 1 / 4, 1 / 4): -3.0, (1 / 2, 0, 0): 3.0},
    "octo": {(0, 0, 0): 0.85, (1 / 2, 1 / 2, 1 / 2): 3.25, (1 / 2, 0, 0): -0.75},
    "p_w_hybrid": {(0, 0, 0): 11.4, (1 / 2, 1 / 2, 0): -4.6, (1 / 2, 1 / 2, 1 / 2): 17.4},
    "gyroid_prime": {(0, 0, 0): 0.32, (1 / 8, 1 / 8, 1 / 8): 1.82},
    "diamond_prime": {(0, 0, 0): 0.3, (1 / 2, 0, 0): -0.7, (1 / 4, 1 / 4, 0): 0.3},
    "double_gyroid": {(0, 0, 0): -3.0, (1 / 8, 1 / 8, 1 / 8): 4.125},
    "double_diamond": {(0, 0, 0): 1.0, (1 / 8, 1 / 8, 1 / 8): 3.0, (1 / 4, 0, 0): -1.0},
    "double_primitive": {(0, 0, 0): 2.1, (1 / 2, 0, 0): 0.1, (1 / 4, 1 / 4, 1 / 4): -0.6},
}


def test_every_formula_is_listed():
    assert set(AT_POINTS) == set(WAVEFORMS)
    assert set(tpms.SURFACES) == {*WAVEFORMS, "scherk"}


@pytest.mark.parametrize("name", NAMES)
def test_values_at_points_of_high_symmetry(name):
    level = waveform(name)
    for turns, value in AT_POINTS[name].items():
        assert level(TURN * np.array(turns)) == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_cyclic_and_periodic(name):
    level = waveform(name)
    np.testing.assert_allclose(level(ANGLES[:, [1, 2, 0]]), level(ANGLES), atol=1e-9)
    for axis in range(3):
        np.testing.assert_allclose(level(ANGLES + TURN * np.eye(3)[axis]), level(ANGLES), atol=1e-9)


@pytest.mark.parametrize("name", sorted(set(NAMES) - set(MIRRORED)))
def test_cosines_alone_are_mirror_symmetric(name):
    level = waveform(name)
    for signs in itertools.product((1, -1), repeat=3):
        np.testing.assert_allclose(level(ANGLES * signs), level(ANGLES), atol=1e-9)
    np.testing.assert_allclose(level(ANGLES[:, [1, 0, 2]]), level(ANGLES), atol=1e-9)


COMPLEMENTS = {
    # -W is W at these angles.
    "gyroid": lambda p: -p,
    "schwarz_p": lambda p: p + math.pi,
    "schwarz_d": lambda p: p + math.pi * np.array([1, 0, 0]),
    "neovius": lambda p: p + math.pi,
    "fischer_koch_s": lambda p: -p,
    "fischer_koch_cy": lambda p: p + math.pi,
    "fischer_koch_cs": lambda p: p[:, [0, 2, 1]] + math.pi / 2,
}


@pytest.mark.parametrize("name", NAMES)
def test_complement_congruence(name):
    level = waveform(name)
    assert WAVEFORMS[name].complement_congruent == (name in COMPLEMENTS)
    if name in COMPLEMENTS:
        np.testing.assert_allclose(level(COMPLEMENTS[name](ANGLES)), -level(ANGLES), atol=1e-9)
    else:
        grid = TURN * np.stack(np.meshgrid(*[np.arange(32) / 32] * 3), -1).reshape(-1, 3)
        values = np.sort(level(grid))
        assert np.abs(values + values[::-1]).max() > 0.05  # the sides differ, wherever they are moved


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("name", NAMES)
def test_a_drop_of_nothing_is_the_mean_along_its_axis(name, axis):
    drops = [1.0, 1.0, 1.0]
    drops[axis] = 0.0
    flat = waveform(name, drops)
    steps = TURN * (np.arange(24) / 24)[:, None, None] * np.eye(3)[axis]
    mean = waveform(name)((ANGLES[None] + steps).reshape(-1, 3)).reshape(24, -1).mean(axis=0)
    np.testing.assert_allclose(flat(ANGLES), mean, atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("name", NAMES)
def test_a_drop_of_minus_one_mirrors_or_moves(name, axis):
    drops = [1.0, 1.0, 1.0]
    drops[axis] = -1.0
    unit = np.eye(3)[axis]
    moved = ANGLES * (1 - 2 * unit) if name in MIRRORED else ANGLES + math.pi * unit
    np.testing.assert_allclose(waveform(name, drops)(ANGLES), waveform(name)(moved), atol=1e-9)


@given(st.tuples(*[st.floats(-1, 1)] * 3), st.tuples(*[st.floats(-7, 7)] * 3))
def test_the_drops_of_schwarz_p_weigh_its_terms(drops, angles):
    """LatticeRobot: drop_x cos x + drop_y cos y + drop_z cos z."""
    expected = sum(d * math.cos(a) for d, a in zip(drops, angles, strict=True))
    assert waveform("schwarz_p", drops)(np.array(angles)) == pytest.approx(expected, abs=1e-9)


def axes() -> tuple[Wave, Wave, Wave]:
    return Wave(X), Wave(Y), Wave(Z)


def test_transitions_end_at_their_surfaces():
    for shares, name, factor, shift in [
        ((0.0, 0.0), "schwarz_p", 1.0, 1 / 4),
        ((1.0, 0.0), "gyroid", 1.0, 0.0),
        ((1.0, 1.0), "schwarz_d", math.sqrt(2.0), 3 / 8),
    ]:
        here = waveforms.primitive_gyroid_diamond(*shares)(*axes())
        np.testing.assert_allclose(here(ANGLES), factor * waveform(name)(ANGLES - TURN * shift), atol=1e-9)
    for share, name, factor in [(0.0, "schwarz_p", 3.0), (1.0, "neovius", 1.0)]:
        here = waveforms.primitive_neovius(share)(*axes())
        np.testing.assert_allclose(here(ANGLES), factor * waveform(name)(ANGLES), atol=1e-9)


def curvature(level: frep.Field, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean curvature, and the root of the sum of the squared principal ones, of the level set through each point."""
    slope = level.derivatives()
    length = frep.sqrt(sum((s * s for s in slope), start=frep.constant(0.0)))
    turning = np.stack([(s / length).gradient(points) for s in slope], axis=1)
    normal = np.stack([s(points) for s in slope], axis=1) / length(points)[:, None]
    # Only the change along the surface counts.
    along = turning - np.einsum("nij,nj,nk->nik", turning, normal, normal)
    return 0.5 * np.einsum("nii->n", along), np.sqrt((along**2).sum(axis=(1, 2)))


def on_surface(level: frep.Field, points: np.ndarray) -> np.ndarray:
    for _ in range(30):
        gradient = level.gradient(points)
        step = (level(points) / np.maximum((gradient**2).sum(axis=1), 0.05))[:, None] * gradient
        points = points - step * np.minimum(1.0, 0.3 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
    return points[np.abs(level(points)) < 1e-10]


@pytest.mark.parametrize(("name", "share"), [("gyroid", 0.03), ("schwarz_d", 0.1), ("schwarz_p", 0.2)])
def test_nodal_surfaces_are_nearly_minimal(name, share):
    level = waveform(name)
    mean, total = curvature(level, on_surface(level, ANGLES))
    assert math.sqrt(np.mean(mean**2)) < share * math.sqrt(np.mean(total**2))


def test_scherk_is_minimal():
    level = waveforms.scherk(*axes())
    points = on_surface(level, ANGLES * (1, 1, 0.3))
    assert len(points) > 300
    mean, total = curvature(level, points)
    assert np.abs(mean).max() < 1e-9 + 1e-9 * total.max()
    np.testing.assert_allclose(np.exp(points[:, 2]) * np.cos(points[:, 1]), np.cos(points[:, 0]), atol=1e-8)
    np.testing.assert_allclose(level(ANGLES[:, [1, 0, 2]] * (1, 1, -1)), -level(ANGLES), atol=1e-12)
