"""Balls of their own diameter at the nodes of a graph: what they add, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep.errors import ArgumentError, ArgumentTypeError
from topologies import beams
from topologies.steady import SteadyLattice, Swirl, Translation

NODES = np.array([(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 4.0)])
EDGES = [(0, 1), (1, 2), (2, 3)]
GRAPH = beams.graph(NODES, EDGES)
diameters = st.lists(st.floats(0.1, 3.0), min_size=4, max_size=4)
balls = st.lists(st.one_of(st.just(0.0), st.floats(0.1, 6.0)), min_size=4, max_size=4)


@settings(max_examples=20)
@given(diameters, balls, st.floats(0.0, 1.0))
def test_balls_are_a_union_of_spheres(thick, ball, share):
    """The distance to beams and balls is the least of both."""
    both, alone = GRAPH.thicken(thick, node=ball), GRAPH.thicken(thick)
    points = np.random.default_rng(int(1e6 * share)).uniform(-4, 14, (200, 3))
    expected = alone.field(points)
    for centre, d in zip(NODES, ball, strict=True):
        if d > 0.0:
            expected = np.minimum(expected, np.linalg.norm(points - centre, axis=1) - 0.5 * d)
    assert np.allclose(both.field(points), expected, atol=1e-9)
    assert np.all(both.bounds[0] <= alone.bounds[0])
    if max(ball) > 0.0:
        reach = np.array([np.min(NODES - 0.5 * np.array(ball)[:, None], axis=0)])
        assert np.all(both.bounds[0] <= reach + 1e-9)


def test_equal_balls_are_those_of_a_number():
    by_number, by_node = GRAPH.thicken(1.0, node=2.5), GRAPH.thicken(1.0, node=[2.5] * 4)
    points = np.random.default_rng(0).uniform(-4, 14, (500, 3))
    assert np.allclose(by_number.field(points), by_node.field(points), atol=1e-9)


def test_blocks_and_points_agree():
    """The sampler, which lists the beams and balls near each block, against points one by one."""
    part = GRAPH.thicken([1, 2, 0.8, 1.4], node=[4, 0, 3, 2.2], blend=0.5)
    mesh = part.mesh(0.2)
    assert np.abs(part.field(mesh.vertices)).max() < 0.05
    assert mesh.check().closed


def test_a_file_of_beams_keeps_the_balls(tmp_path):
    """STEP of cones and balls: the volume is that of the field."""
    cadquery = pytest.importorskip("cadquery")
    part = GRAPH.thicken([1, 2, 0.8, 1.4], node=[4, 0, 3, 2.2])
    part.save(tmp_path / "part.step")
    shape = cadquery.importers.importStep(str(tmp_path / "part.step"))
    assert shape.faces().size() < 40  # analytic, not facets
    assert shape.val().Volume() == pytest.approx(part.volume(voxel=0.1), rel=3e-3)


def test_balls_of_a_steady_lattice_grow_with_its_clusters():
    u, still = Swirl(1.25, center=(0, 0, 0), angle=0.0), Translation((0, 4, 0))
    lattice = SteadyLattice(
        [(4, 0, 0)], [0.2], [(0, 0, 1, 0, 0)], u=u, v=still, w=Translation((0, 0, 4)), counts=(4, 1, 1)
    )
    part = lattice.thicken([0.4], node=[2.0])
    for i in range(4):
        x = 4 * 1.25**i
        assert part.field([(x, 1.25**i, 0)])[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("thick", "node", "error", "said"),
    [
        ([1] * 4, [1, 2, 3], ArgumentError, "node: expected one number for each of 4 nodes, got 3"),
        ([1] * 4, [1, 2, -3, 1], ArgumentError, "node: expected diameters >= 0 mm, 1 of 4 nodes have .*node 2: -3"),
        ([1] * 4, [1, 2, np.nan, 1], ArgumentError, "node: .*1 of 4 nodes have NaN .*node 2: nan"),
        ([1, np.nan, 1, np.inf], None, ArgumentError, "diameter: .*2 of 4 nodes have NaN .*node 1: nan"),
        ([1] * 4, ["a"] * 4, ArgumentTypeError, "node: expected a number for each node"),
        (1 + frep.coordinates()[0] ** 2, [1] * 4, ArgumentError, "numbers for the diameter"),
        (1.0, np.ones((4, 2)), ArgumentError, r"node: .* each of 4 nodes, got shape \(4, 2\)"),
        (np.ones((4, 1)), None, ArgumentError, r"diameter: .* each of 4 nodes, got shape \(4, 1\)"),
        ([1, 1, 0, 1], None, ArgumentError, "diameter: expected diameters > 0 mm, 1 of 4 nodes .*node 2: 0"),
    ],
)
def test_what_is_refused(thick, node, error, said):
    with pytest.raises(error, match=said):
        GRAPH.thicken(thick, node=node)


def test_square_beams_take_no_balls_of_their_own():
    with pytest.raises(ArgumentError, match="circular sections"):
        GRAPH.thicken(1.0, node=[1] * 4, section="square")
