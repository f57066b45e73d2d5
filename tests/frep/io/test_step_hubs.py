"""Hubs laid down in closed form: the union by its definition, closed forms, and OpenCASCADE's own volume and check."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frep.hubs import hub_moments
from frep.io import _brep, step
from frep.io._knots import Beams, Halves
from frep.io._net import Hub, NotAHubError, net
from frep.io._shell import Placed, solids_of

CUT = 4.0
AXES = np.vstack([np.eye(3), -np.eye(3)])
DIAGONALS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(3.0)
FACES = np.array([v for v in np.ndindex(3, 3, 3) if sum(c != 1 for c in v) == 2]) - 1.0
FACES /= np.sqrt(2.0)


def hub(along, ball=1.0, sines=0.0, cut=CUT):
    along = np.asarray(along, float)
    k = len(along)
    return Hub(1.0, ball, along, np.broadcast_to(np.float64(sines), k), _brep.seam_directions(along), np.full(k, cut))


def laid_down(a_hub: Hub):
    found = net(a_hub)
    (solid,) = solids_of([Placed(np.array([3.0, -2.0, 1.0]), a_hub, found, [(-1, -1)] * len(a_hub.along))])
    return found, solid


def volume_by_points(a_hub: Hub, n: int = 90) -> float:
    """By the definition of the union: hulls of balls, cut."""
    reach = CUT + 2.5
    points = _brep.spread_in_box(np.full(3, -reach), np.full(3, reach), n)
    inside = np.linalg.norm(points, axis=1) < a_hub.ball
    for u, sine in zip(a_hub.along, a_hub.sines, strict=True):
        # The ball of radius 1 - s c at c along the axis, that reaches furthest round the point.
        t = points @ u
        rho = np.linalg.norm(points - t[:, None] * u, axis=1)
        slope = sine / np.sqrt(1.0 - sine**2)
        c = np.maximum(t - rho * slope, 0.0)
        radius = 1.0 - sine * c
        inside |= (np.hypot(t - c, rho) < radius) & (t < CUT)
    return float(inside.mean()) * (2.0 * reach) ** 3


@pytest.mark.parametrize("along", [AXES[:1], AXES[[0, 3]], AXES[[0, 1]], AXES[[0, 1, 3]], AXES, DIAGONALS, FACES])
@pytest.mark.parametrize(("ball", "sine"), [(1.0, 0.0), (1.25, 0.0), (1.0, 0.08), (1.0, -0.08)])
def test_a_hub_is_closed_valid_and_of_the_volume_of_its_definition(along, ball, sine):
    a_hub = hub(along, ball, sine)
    found, solid = laid_down(a_hub)
    assert _brep.is_valid(solid)
    assert _brep.volume(solid) == pytest.approx(found.volume, rel=1e-5)
    assert found.volume == pytest.approx(volume_by_points(a_hub), rel=0.01)


def test_closed_forms():
    capsule = 4.0 * np.pi + 2.0 / 3.0 * np.pi
    assert net(hub(AXES[:1])).volume == pytest.approx(capsule, rel=1e-12)
    # Steinmetz: three cylinders that cross.
    assert net(hub(AXES)).volume == pytest.approx(3 * np.pi * 2 * CUT - 16 + 8 * (2 - np.sqrt(2)), rel=1e-9)
    # A ball with a cylinder through it: outside of that, a napkin ring.
    ring = 4.0 / 3.0 * np.pi * (1.5**2 - 1.0) ** 1.5
    assert net(hub(AXES[[0, 3]], ball=1.5)).volume == pytest.approx(np.pi * 2 * CUT + ring, rel=1e-12)


@given(seed=st.integers(0, 10**6), k=st.integers(1, 6), ball=st.sampled_from([1.0, 1.02, 1.3, 1.7]))
@settings(max_examples=25, deadline=None)
def test_hubs_of_random_beams(seed, k, ball):
    random = np.random.default_rng(seed)
    along: list[np.ndarray] = []
    while len(along) < k:
        u = random.normal(size=3)
        u /= np.linalg.norm(u)
        if all(u @ v < 0.6 for v in along):
            along.append(u)
    a_hub = hub(along, ball, random.uniform(-0.15, 0.15, k) * random.integers(0, 2))
    try:
        found, solid = laid_down(a_hub)
    except NotAHubError:  # a seam that passes a cut: for OpenCASCADE's union
        return
    assert _brep.is_valid(solid)
    # OpenCASCADE's own quadrature of the ball is good to some 1e-5.
    assert _brep.volume(solid) == pytest.approx(found.volume, rel=5e-5)
    assert found.volume == pytest.approx(volume_by_points(a_hub, 60), rel=0.03)


def test_contains_agrees_with_the_definition():
    a_hub = hub(DIAGONALS[:3], 1.2, 0.1)
    points = _brep.spread_in_box(np.full(3, -2.3), np.full(3, 2.3), 30)  # short of the cuts
    pieces = np.linalg.norm(points, axis=1) < 1.2
    for u in a_hub.along:
        centers = np.linspace(0.0, 6.0, 150)
        distance = np.linalg.norm(points[:, None] - centers[None, :, None] * u, axis=2)
        pieces |= (distance < 1.0 - 0.1 * centers).any(axis=1)
    assert np.mean(pieces != a_hub.contains(points)) < 2e-3


def test_beams_too_close_are_no_hub():
    u = np.array([np.cos(0.1), np.sin(0.1), 0.0])
    with pytest.raises(NotAHubError):
        net(hub([AXES[0], u]))


def test_hubs_of_a_lattice_have_the_volumes_of_the_exact_integrals(tmp_path):
    """Against `frep.hubs`, which shares no line with this; and the file against their sum."""
    nodes = np.array([[0, 0, 0], [9, 1, 0], [4, 8, 1], [4, 3, 7], [12, 9, 6]], float)
    edges = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3], [3, 4], [2, 4]])
    radii = np.array([0.8, 1.0, 0.7, 0.9, 0.6])
    hubs = Halves(Beams(nodes, edges, radii[edges], radii, True)).hubs(list(range(5)))
    exact = []
    for node in range(5):
        ends = np.concatenate([edges[edges[:, 0] == node, 1], edges[edges[:, 1] == node, 0]])
        exact.append(hub_moments(radii[node], nodes[ends] - nodes[node], radii[ends]).volume)
    assert [hubs[node].net.volume for node in range(5)] == pytest.approx(exact, rel=1e-9)
    step.write_beams_step(tmp_path / "a.step", nodes, edges, radii[edges], swept=True)
    volume, valid = _brep.read_back(tmp_path / "a.step")
    assert valid
    assert volume == pytest.approx(sum(exact), rel=1e-5)


def test_beams_that_crashed_the_union_are_laid_down(tmp_path):
    """Two cones from a ball of their own radius: OpenCASCADE's union of the three does not come back."""
    random = np.random.default_rng(2)
    along: list[np.ndarray] = []
    while len(along) < 2:
        u = random.normal(size=3)
        u /= np.linalg.norm(u)
        if all(u @ v < 0.6 for v in along):
            along.append(u)
    nodes = np.vstack([np.zeros(3), 10.0 * np.array(along)])
    radii = np.array([[1.0, 0.6], [1.0, 0.6]])
    step.write_beams_step(tmp_path / "a.step", nodes, [[0, 1], [0, 2]], radii)
    volume, valid = _brep.read_back(tmp_path / "a.step")
    cone = np.pi / 3.0 * 10.0 * (1.0 + 0.6 + 0.36)
    assert valid
    assert cone < volume < 2.0 * cone + 4.0 / 3.0 * np.pi * (1.0 + 2.0 * 0.6**3)
