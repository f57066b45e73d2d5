"""Stochastic topologies: Poisson-Voronoi means, equidistant vertices, least distances, true walls, cut edges, bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from scipy.spatial.distance import pdist

import frep
from frep import ArgumentError, ArgumentTypeError
from topologies import seeds as seeding
from topologies import stochastic
from topologies.beams import BeamTopology

X, Y, Z = frep.coordinates()
UNIT = frep.box((0, 0, 0), (1, 1, 1))
BLOCK = frep.box((-3, 2, 1), (9, 11, 12))
BALL = frep.sphere((1, 2, 3), 10)
BONE = (frep.capsule((0, 0, 0), (30, 0, 0), 6) | frep.sphere((0, 0, 0), 9)) - frep.cylinder((-20, 0, 0), (40, 0, 0), 2)


def lengths(lattice: BeamTopology) -> np.ndarray:
    return np.linalg.norm(np.diff(lattice.skeleton.segments(), axis=1)[:, 0], axis=1)


def pieces(edges: np.ndarray, count: int) -> np.ndarray:
    links = coo_array((np.ones(len(edges)), tuple(edges.T)), shape=(count, count))
    return connected_components(links, directed=False)[1]


def folded(lattice: BeamTopology, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of one period and the edges between them."""
    nodes = np.mod(lattice.skeleton.nodes, size) % size
    pairs = KDTree(nodes, boxsize=size).query_pairs(1e-8 * size, output_type="ndarray")
    place = pieces(pairs, len(nodes))
    return nodes[np.unique(place, return_index=True)[1]], place[lattice.skeleton.edges]


# --- seeds -------------------------------------------------------------------------------------------------------------


@given(seed=st.integers(0, 10_000), number=st.integers(1, 300))
def test_uniform_seeds_lie_in_the_body(seed, number):
    points = seeding.uniform(BONE, number, random_state=seed)
    assert points.shape == (number, 3)
    assert BONE.contains(points).all()


def test_uniform_seeds_are_spread_evenly():
    """Along each axis the share below t is t, within four standard errors."""
    points = seeding.uniform(UNIT, 20_000, random_state=4)
    for t in (0.2, 0.5, 0.9):
        share = (points < t).mean(axis=0)
        assert np.all(np.abs(share - t) < 4 * math.sqrt(t * (1 - t) / len(points)))


@pytest.mark.parametrize("periodic", [False, True])
def test_least_distance(periodic):
    points = seeding.poisson_disk(BLOCK, 1.2, random_state=3, periodic=periodic)
    assert BLOCK.contains(points).all()
    lo, hi = BLOCK.bounds
    tree = KDTree(points - lo, boxsize=hi - lo if periodic else None)
    assert tree.query(points - lo, k=2)[0][:, 1].min() >= 1.2
    # Few places are left: a point of the block is hardly ever further than the distance from all seeds.
    probes = seeding.uniform(BLOCK, 5000, random_state=1) - lo
    assert (tree.query(probes)[0] > 1.2).mean() < 0.02


def test_least_distance_by_a_field():
    """Two points keep at least the smaller of the distances asked for at their places, and crowd where it is small."""
    law = 0.6 + 0.1 * (X + 3)
    points = seeding.poisson_disk(BLOCK, law, random_state=3)
    asked = law(points)
    for i, j in KDTree(points).query_pairs(float(asked.max())):
        assert np.linalg.norm(points[i] - points[j]) >= min(asked[i], asked[j])
    near, far = points[:, 0] < 0, points[:, 0] > 6
    expected = np.mean([(0.6 + 0.1 * t) ** -3 for t in np.linspace(0, 3, 99)]) / np.mean(
        [(0.6 + 0.1 * t) ** -3 for t in np.linspace(9, 12, 99)]
    )
    assert near.sum() / far.sum() == pytest.approx(expected, rel=0.35)


def test_seeds_on_a_density():
    """The number expected in each half, within four standard deviations."""
    points = seeding.on_density(UNIT, 4000 * X, random_state=2)
    for half, expected in ((points[:, 0] < 0.5, 500), (points[:, 0] >= 0.5, 1500)):
        assert abs(half.sum() - expected) < 4 * math.sqrt(expected)


@pytest.mark.parametrize("periodic", [False, True])
def test_lloyd_lowers_the_mean_squared_distance(periodic):
    lo, hi = BLOCK.bounds
    start = seeding.uniform(BLOCK, 80, random_state=1)
    probes = seeding.uniform(BLOCK, 20_000, random_state=9) - lo
    energy = []
    for steps in (0, 1, 3, 10):
        now = seeding.relaxed(BLOCK, start, steps, random_state=5, periodic=periodic)
        assert BLOCK.contains(now).all()
        tree = KDTree(np.mod(now - lo, hi - lo), boxsize=hi - lo if periodic else None)
        energy.append((tree.query(probes)[0] ** 2).mean())
    assert np.all(np.diff(energy) < 0)
    # Near the best there is, a body-centred cubic lattice: 0.0785 * 3 of the cell's volume to the power 2/3.
    cell = (np.prod(hi - lo) / 80) ** (2 / 3)
    assert 0.0785 * 3 < energy[-1] / cell < 1.15 * 0.0785 * 3 + 0.03


def test_directions():
    """On the sphere the mean of u u^T is a third of the unit matrix; in a cone of half-angle a the mean |cosine| is (1 + cos a) / 2."""
    u = seeding.random_directions(40_000, random_state=1)
    assert np.linalg.norm(u, axis=1) == pytest.approx(1.0)
    assert u.T @ u / len(u) == pytest.approx(np.eye(3) / 3, abs=0.01)
    v = seeding.random_directions(40_000, ["z"], 0.5, random_state=1)
    cosine = np.abs(v[:, 2])
    assert cosine.min() >= math.cos(0.5) - 1e-12
    assert cosine.mean() == pytest.approx(0.5 * (1 + math.cos(0.5)), abs=1e-3)


# --- Voronoi and Delaunay edges ----------------------------------------------------------------------------------------


def test_poisson_voronoi_means():
    """O13, with the standard errors of 3000 cells: 15.54 faces a cell, 6.768 vertices and 13.535 edges a seed, valence 4."""
    n = 3000
    points = seeding.uniform(UNIT, n, random_state=11)
    lattice = stochastic.voronoi(UNIT, seeds=points, periodic=True)
    nodes, edges = folded(lattice, 1.0)
    assert np.all(np.bincount(edges.ravel()) == 4)
    # Faces a cell scatter by 3.33 (Poisson-Voronoi), so vertices a seed by half of that.
    slack = 4 * 3.33 / math.sqrt(n)
    assert len(nodes) / n == pytest.approx(24 * math.pi**2 / 35, abs=slack / 2)
    assert len(edges) / n == pytest.approx(48 * math.pi**2 / 35, abs=slack)
    assert lengths(lattice).sum() / n ** (2 / 3) == pytest.approx(5.832, rel=0.01)
    # On the torus V - E + F - C = 0; each face is shared by two cells, and is a Delaunay edge.
    faces = len(edges) - len(nodes) + n
    assert 2 * faces / n == pytest.approx(48 * math.pi**2 / 35 + 2, abs=slack)
    assert len(stochastic.delaunay(UNIT, seeds=points, periodic=True).skeleton.edges) == faces
    assert len(np.unique(pieces(edges, len(nodes)))) == 1


def test_bcc_seeds_give_truncated_octahedra():
    """O13: 12 vertices and 24 edges a cubic cell, all edges u sqrt(2) / 4."""
    u = 6.0
    box = frep.box((0, 0, 0), (u, u, u))
    lattice = stochastic.voronoi(box, seeds=[(0, 0, 0), (u / 2, u / 2, u / 2)], periodic=True)
    nodes, edges = folded(lattice, u)
    assert (len(nodes), len(edges)) == (12, 24)
    assert lengths(lattice) == pytest.approx(u * math.sqrt(2) / 4)


@pytest.mark.parametrize("size", [(4, 4, 4), (3, 5, 8)])
def test_one_periodic_seed_gives_its_cuboid(size):
    """The cell of a cuboid lattice is the cuboid: three edges a period."""
    lattice = stochastic.voronoi(frep.box((0, 0, 0), size), seeds=[(1, 1, 1)], periodic=True)
    assert sorted(lengths(lattice)) == pytest.approx(sorted(size))


@given(seed=st.integers(0, 1000), number=st.integers(4, 60))
def test_vertices_are_equidistant_from_four_seeds(seed, number):
    """And no seed is nearer. Nodes on the surface lie between three seeds."""
    points = seeding.uniform(BALL, number, random_state=seed)
    lattice = stochastic.voronoi(BALL, seeds=points, connected=False)
    nodes, edges = lattice.skeleton.nodes, lattice.skeleton.edges
    depth = BALL.field(nodes)
    assert depth.max() < 1e-6
    nearest = KDTree(points).query(nodes, k=4)[0]
    valence = np.bincount(edges.ravel())
    cut = valence == 1
    assert np.all(np.abs(depth[cut]) < 1e-6)
    assert np.ptp(nearest[:, :3], axis=1) == pytest.approx(0.0, abs=1e-7)
    assert np.ptp(nearest[~cut], axis=1) == pytest.approx(0.0, abs=1e-7)
    assert np.all(valence[~cut] == 4)


def test_periodic_vertices_are_equidistant_from_four_seeds():
    size = BLOCK.bounds[1] - BLOCK.bounds[0]
    points = seeding.uniform(BLOCK, 50, random_state=5)
    nodes = stochastic.voronoi(BLOCK, seeds=points, periodic=True).skeleton.nodes
    distance = KDTree(np.mod(points, size), boxsize=size).query(np.mod(nodes, size), k=4)[0]
    assert np.ptp(distance, axis=1) == pytest.approx(0.0, abs=1e-9)


def test_a_periodic_lattice_repeats():
    lattice = stochastic.voronoi(UNIT, cell_size=0.3, random_state=1, periodic=True).thicken(0.05)
    probes = np.random.default_rng(1).uniform(0, 1, (500, 3))
    for shift in ((1, 0, 0), (0, -2, 3)):
        assert lattice.field(probes + shift) == pytest.approx(lattice.field(probes), abs=1e-6)


def test_edges_do_not_depend_on_where_they_are_cut():
    """In a part of the body the cut lattice of the same seeds has the length that the whole one has there."""
    points = seeding.poisson_disk(BLOCK, 2.0, random_state=1)
    whole = stochastic.voronoi(BLOCK, seeds=points, connected=False)
    a, b = whole.skeleton.segments().transpose(1, 0, 2)
    steps = (np.arange(200) + 0.5) / 200
    inner = frep.sphere(BLOCK.bounds.mean(axis=0), 4)
    inside = inner.field((a[:, None] + steps[:, None] * (b - a)[:, None]).reshape(-1, 3)).reshape(-1, 200) < 0
    expected = (inside.mean(axis=1) * lengths(whole)).sum()
    cut = frep.graphs.trimmed(whole.skeleton, inner, step=0.1).skeleton.segments()
    assert np.linalg.norm(cut[:, 1] - cut[:, 0], axis=1).sum() == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("connected", [True, False])
def test_what_hangs_on_the_surface_alone(connected):
    """Connected lattices are one piece; the pieces left out of them all end on the surface of the body."""
    points = seeding.uniform(BONE, 150, random_state=8)
    lattice = stochastic.voronoi(BONE, seeds=points, connected=connected)
    nodes, edges = lattice.skeleton.nodes, lattice.skeleton.edges
    piece = pieces(edges, len(nodes))
    if connected:
        assert len(np.unique(piece)) == 1
    else:
        assert np.abs(BONE.field(nodes[np.bincount(edges.ravel()) == 1])).max() < 1e-6
        on_surface = np.abs(BONE.field(nodes)) < 1e-6
        assert all(on_surface[piece == p].any() for p in np.unique(piece))


def test_delaunay_edges_across_a_notch():
    """Seeds on both legs of a U: the pieces of the edges between the legs are cut at the notch, and what hangs loose goes."""
    legs = frep.box((0, 0, 0), (20, 20, 20)) - frep.box((8, -1, -1), (9, 18, 21)) - frep.box((11, -1, -1), (12, 18, 21))
    points = np.concatenate([seeding.uniform(frep.box((0, 0, 0), (8, 18, 20)), 60, random_state=2)])
    points = np.concatenate([points, points * (-1, 1, 1) + (20, 0, 0), [(10, 19.5, 10), (2, 19, 10), (18, 19, 10)]])
    whole = stochastic.delaunay(legs, seeds=points, connected=False)
    assert whole.connectivity().components > 1, "pieces in the middle leg hang in the air"
    lattice = stochastic.delaunay(legs, seeds=points)
    assert lattice.connectivity().components == 1
    kept = {tuple(sorted(map(tuple, s))) for s in np.round(lattice.skeleton.segments(), 9).tolist()}
    assert kept < {tuple(sorted(map(tuple, s))) for s in np.round(whole.skeleton.segments(), 9).tolist()}


def test_edges_stay_in_a_body_with_a_hole():
    """Also midway: the bone is hollow, so that edges leave it and come back."""
    lattice = stochastic.voronoi(BONE, cell_size=2.5, random_state=1)
    a, b = lattice.skeleton.segments().transpose(1, 0, 2)
    for t in np.linspace(0, 1, 9):
        assert BONE.field(a + t * (b - a)).max() < 0.1


def test_overhang():
    """Beams reach out of the body by so much, and the cut part ends flat on its surface."""
    lattice = stochastic.voronoi(BALL, cell_size=5, overhang=0.5, random_state=1)
    assert BALL.field(lattice.skeleton.nodes).max() == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("method", ["poisson_disk", "uniform"])
def test_cell_size(method):
    """So many cells as cubes of that side, in one period."""
    random = 3
    box = frep.box((0, 0, 0), (12, 12, 12))
    lattice = stochastic.voronoi(box, cell_size=1.2, method=method, periodic=True, random_state=random)
    nodes, edges = folded(lattice, 12.0)
    # For simple vertices V - E + F - C = 0 and E = 2 V; F and C are told apart by the Delaunay edges.
    faces = len(
        stochastic.delaunay(box, cell_size=1.2, method=method, periodic=True, random_state=random).skeleton.edges
    )
    assert faces - (len(edges) - len(nodes)) == pytest.approx(1000, rel=0.05)


RIM = [
    (frep.box((0, 0, 0), (8, 8, 8)), 512.0, 384.0),
    (frep.box((0, 0, 0), (20, 12, 0.5)), 120.0, 512.0),
    (frep.box((0, 0, 0), (20, 12, 1)), 240.0, 544.0),
    (frep.box((0, 0, 0), (16, 12, 3)), 576.0, 552.0),
    (frep.sphere((0, 0, 0), 5), 500 * math.pi / 3, 100 * math.pi),
]


@pytest.mark.parametrize(("body", "volume", "surface"), RIM)
def test_cells_at_the_surface_are_smaller(body, volume, surface):
    """As documented, within 4 %: V + 0.235 S cells of size 1, since nothing beyond the surface keeps them off it."""
    counts = [len(seeding.chosen(body, 1.0, None, None, s, "poisson_disk", 0, False, least=1)[0]) for s in range(4)]
    assert np.mean(counts) == pytest.approx(volume + 0.235 * surface, rel=0.04)
    uniform = seeding.chosen(body, 1.0, None, None, 1, "uniform", 0, False, least=1)[0]
    assert abs(len(uniform) - volume) < 4 * math.sqrt(volume)


def test_reproducible():
    """The same number gives the same lattice; another one, or a generator that has moved on, another."""
    first, same, other = (stochastic.voronoi(BALL, cell_size=4, random_state=s, relax=2) for s in (5, 5, 6))
    assert np.array_equal(first.skeleton.nodes, same.skeleton.nodes)
    assert np.array_equal(first.skeleton.edges, same.skeleton.edges)
    assert not np.array_equal(first.skeleton.nodes[:10], other.skeleton.nodes[:10])
    random = np.random.default_rng(5)
    moved = [stochastic.voronoi(BALL, cell_size=4, random_state=random).skeleton.nodes for _ in range(2)]
    assert not np.array_equal(moved[0][:10], moved[1][:10])


def test_delaunay_of_a_convex_body():
    """Nodes are the seeds, edges V - E + F - T = 1, and no beam leaves the body."""
    points = seeding.poisson_disk(BLOCK, 2.0, random_state=1)
    lattice = stochastic.delaunay(BLOCK, seeds=points)
    assert np.array_equal(lattice.skeleton.nodes, points)
    assert np.all(np.bincount(lattice.skeleton.edges.ravel()) >= 3)


# --- walls -------------------------------------------------------------------------------------------------------------


@given(seed=st.integers(0, 1000), number=st.integers(2, 40), periodic=st.booleans())
def test_wall_distance_is_that_to_all_bisectors(seed, number, periodic):
    """Against all pairs of seeds, neighbours or not, of 5 x 5 x 5 periods where they repeat."""
    points = seeding.uniform(BLOCK, number, random_state=seed)
    probes = seeding.uniform(BLOCK, 100, random_state=seed + 1)
    size = BLOCK.bounds[1] - BLOCK.bounds[0]
    reach = range(-2, 3) if periodic else range(1)
    everything = np.concatenate([points + size * (i, j, k) for i in reach for j in reach for k in reach])
    squared = ((probes[:, None] - everything) ** 2).sum(axis=-1)
    nearest = squared.argmin(axis=1)
    apart = np.linalg.norm(everything - everything[nearest][:, None], axis=-1)
    apart[np.arange(100), nearest] = np.inf
    rise = squared - squared.min(axis=1)[:, None]
    rise[np.arange(100), nearest] = np.inf
    expected = (rise / (2 * np.where(np.isinf(apart), 1.0, apart))).min(axis=1)
    field = stochastic.face_distance(BLOCK, points, periodic=periodic)
    assert field(probes) == pytest.approx(expected, abs=1e-9)


def test_wall_thickness():
    """Across the middle of each face between neighbours the wall is as thick as asked, here graded by a Field."""
    points = seeding.poisson_disk(BLOCK, 3.0, random_state=2)
    law = 0.3 + 0.05 * (X + 3)
    foam = stochastic.voronoi_walls(BLOCK, law, seeds=points)
    measured = 0
    for i, j in KDTree(points).query_pairs(4.0):
        middle, across = 0.5 * (points[i] + points[j]), points[j] - points[i]
        across /= np.linalg.norm(across)
        gap = np.sort(np.linalg.norm(points - middle, axis=1))
        if gap[2] < gap[0] + 1.0:
            continue  # near a third cell
        t = np.linspace(-1, 1, 20_001)
        line = middle + t[:, None] * across
        if BLOCK.field(line).max() > -1e-3:
            continue
        wall = t[foam.field(line) < 0]
        near = wall[np.abs(wall) < 0.6]
        assert np.ptp(near) == pytest.approx(float(law(middle)), abs=0.02)
        measured += 1
    assert measured > 20


def test_wall_area():
    """Thin walls of Poisson-Voronoi cells have 2.910 n^(1/3) of area a volume, half the surface of the cells."""
    n, t = 200, 0.004
    points = seeding.uniform(UNIT, n, random_state=3)
    field = stochastic.face_distance(UNIT, points, periodic=True)
    probes = seeding.uniform(UNIT, 400_000, random_state=4)
    share = (field(probes) < t / 2).mean()
    expected = 2.910 * n ** (1 / 3) * t
    # Cells scatter by some 25 % in surface, points by their number; corners take off t times the edges' length or so.
    assert share == pytest.approx(expected, rel=4 * 0.25 / math.sqrt(n) + 4 / math.sqrt(400_000 * expected))


def test_closed_foam_is_a_printable_part():
    body = frep.box((0, 0, 0), (8, 8, 8))
    foam = stochastic.voronoi_walls(body, 0.8, cell_size=4, random_state=1)
    mesh = (foam | body.shell(0.8)).mesh(voxel=0.25)
    assert mesh.check().closed
    assert foam.features[0].width.data == 0.8


# --- fibres ------------------------------------------------------------------------------------------------------------


def test_mean_chord():
    """Random lines are cut by a convex body to 4 V / S on average (Cauchy), whatever its shape."""
    for body, chord in ((frep.sphere((1, 2, 3), 3), 4.0), (frep.box((0, 0, 0), (1, 2, 6)), 4 * 12 / 40)):
        found = lengths(stochastic.fibres(body, 4000, random_state=1))
        assert found.mean() == pytest.approx(chord, abs=4 * found.std() / math.sqrt(len(found)))


def test_fibres_are_cut_to_the_body():
    felt = stochastic.fibres(BONE, 200, length=12, directions=["x"], spread=0.2, random_state=1)
    assert BONE.field(felt.skeleton.nodes).max() < 1e-6
    assert lengths(felt).max() <= 12 + 1e-9
    along = np.diff(felt.skeleton.segments(), axis=1)[:, 0] / lengths(felt)[:, None]
    assert np.abs(along[:, 0]).min() >= math.cos(0.2) - 1e-9


@pytest.mark.parametrize("length", [0.5, 5.0, 1e5])
def test_mean_length_of_cut_fibres(length):
    """Of random pieces of length l that meet a convex body, V + l S / 4 parts in all, l V lies in it."""
    body, volume, surface = frep.box((0, 0, 0), (1, 2, 6)), 12.0, 40.0
    found = lengths(stochastic.fibres(body, 4000, length=length, random_state=2))
    expected = length * volume / (volume + length * surface / 4)
    assert found.mean() == pytest.approx(expected, abs=4 * found.std() / math.sqrt(len(found)))


# --- bad input -----------------------------------------------------------------------------------------------------------

VORONOI = stochastic.voronoi
BAD = [
    (lambda: VORONOI(BALL, cell_size=3), ArgumentTypeError, "random_state"),
    (lambda: VORONOI(BALL, cell_size=3, random_state=True), ArgumentTypeError, "random_state"),
    (lambda: VORONOI(BALL, cell_size=3, random_state=-1), ArgumentError, "random_state"),
    (lambda: VORONOI(BALL, random_state=1), ArgumentError, "got none"),
    (lambda: VORONOI(BALL, cell_size=3, density=1, random_state=1), ArgumentError, "cell_size and density"),
    (lambda: VORONOI(BALL, cell_size=-3, random_state=1), ArgumentError, "cell_size"),
    (lambda: VORONOI(BALL, cell_size=X, random_state=1), ArgumentError, "more than 0 mm everywhere"),
    (lambda: VORONOI(BALL, cell_size=40, random_state=1), ArgumentError, "seeds in a body whose bounds"),
    (lambda: VORONOI(BALL, cell_size=0.01, random_state=1), ArgumentError, "are the most"),
    (lambda: VORONOI(BALL, cell_size=3, method="halton", random_state=1), ArgumentError, "method"),
    (
        lambda: VORONOI(BALL, cell_size=3, method="poisson", random_state=1),
        ArgumentError,
        "did you mean 'poisson_disk'",
    ),
    (
        lambda: VORONOI(BALL, cell_size=X, random_state=1, method="uniform"),
        ArgumentError,
        "^cell_size: .*more than 0 mm",
    ),
    (lambda: VORONOI(BALL, density=X, random_state=1), ArgumentError, "^density: .*more than 0"),
    (lambda: VORONOI(BALL, cell_size=0.01, random_state=1), ArgumentError, "^cell_size: asks for"),
    (lambda: VORONOI(UNIT, cell_size=1 + X, random_state=1, periodic=True), ArgumentTypeError, "^cell_size: .*uniform"),
    (lambda: VORONOI(BALL, cell_size=3, relax=-1, random_state=1), ArgumentError, "relax"),
    (lambda: VORONOI(BALL, cell_size=3, overhang=-1, random_state=1), ArgumentError, "overhang"),
    (lambda: VORONOI(BALL, cell_size=3, periodic=True, random_state=1), ArgumentError, "frep.box"),
    (lambda: VORONOI(BALL, seeds=[(0, 0, 0), (1, 0, 0), (0, 1, 0)]), ArgumentError, "at least 4"),
    (lambda: VORONOI(BALL, seeds=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (99, 0, 0)]), ArgumentError, "outside the body"),
    (lambda: VORONOI(BALL, seeds=[(0, 0, 0), (0, 0, 0), (0, 1, 0), (1, 0, 0)]), ArgumentError, "same place"),
    (
        lambda: VORONOI(BALL, seeds=[(0, 0, 0), *[(0, 0, math.nan)] * 4]),
        ArgumentError,
        "seeds: .*4 of 5 seeds .* seed 1",
    ),
    (
        lambda: VORONOI(BALL, cell_size=3 + frep.sqrt(X), random_state=1),
        ArgumentError,
        r"cell_size: .*NaN at [\d,]+ of .* \(-",
    ),
    (lambda: seeding.on_density(BALL, 3 + frep.sqrt(X), random_state=1), ArgumentError, r"density: .*NaN at [\d,]+ of"),
    (
        lambda: seeding.poisson_disk(BALL, 3 + frep.sqrt(X), random_state=1),
        ArgumentError,
        r"distance: .*NaN at [\d,]+ of",
    ),
    (lambda: VORONOI(BALL, seeds="many"), ArgumentTypeError, "seeds"),
    (
        lambda: VORONOI(BALL, seeds=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], relax=1),
        ArgumentTypeError,
        "random_state",
    ),
    (lambda: VORONOI("ball", cell_size=3, random_state=1), ArgumentTypeError, "body"),
    (lambda: VORONOI(frep.half_space((0, 0, 1)), cell_size=3, random_state=1), frep.UnboundedError, "infinite"),
    (lambda: stochastic.delaunay(BALL, seeds=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]), ArgumentError, "plane"),
    (lambda: stochastic.voronoi_walls(BALL, 0, cell_size=3, random_state=1), ArgumentError, "thickness"),
    (lambda: stochastic.voronoi_walls(BALL, 1, seeds=[(0, 0, 0)]), ArgumentError, "at least 2"),
    (lambda: stochastic.fibres(BALL, 0, random_state=1), ArgumentError, "number"),
    (lambda: stochastic.fibres(BALL, 5, length=-1, random_state=1), ArgumentError, "length"),
    (lambda: stochastic.fibres(BALL, 5, directions="x", random_state=1), ArgumentTypeError, "directions"),
    (lambda: stochastic.fibres(BALL, 5, directions=["x"], spread=2, random_state=1), ArgumentError, "spread"),
    (lambda: stochastic.fibres(BALL, 5), ArgumentTypeError, "random_state"),
    (lambda: stochastic.fibres(BALL, 5, directions=(0, 0, 1), random_state=1), ArgumentTypeError, "list of axes"),
    (lambda: stochastic.fibres(BALL, 5, spread=9, random_state=1), ArgumentError, "spread"),
    (lambda: stochastic.fibres(BALL, 10**9, random_state=1), ArgumentError, "^number: asks for"),
    (lambda: seeding.uniform(BALL, 10**12, random_state=1), ArgumentError, "^number: asks for"),
    (lambda: seeding.uniform(BALL, 2.5, random_state=1), ArgumentTypeError, "number"),  # type: ignore[arg-type]
    (lambda: seeding.poisson_disk(UNIT, X + 1, random_state=1, periodic=True), ArgumentTypeError, "distance"),
]


@pytest.mark.parametrize(("call", "error", "text"), BAD)
def test_bad_input(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_a_body_as_thin_as_its_cells_warns_that_edges_are_left_out():
    """Edges across a plate hang together through its faces alone."""
    plate = frep.box((0, 0, 0), (50, 50, 0.2))
    with pytest.warns(frep.DisconnectedWarning, match="connected=False"):
        lattice = VORONOI(plate, cell_size=5, random_state=1)
    everything = VORONOI(plate, cell_size=5, random_state=1, connected=False)
    assert len(everything.skeleton.edges) > 20 * len(lattice.skeleton.edges)


def test_density_may_vanish():
    """Nothing is placed where no cells are asked for; there cells are as large as those about them make them."""
    points = VORONOI(BLOCK, density=0.2 * frep.clip(X - 3, 0, 1), random_state=1, connected=False).skeleton.nodes
    assert (points[:, 0] > 3).mean() > 0.8


@given(seed=st.integers(0, 500))
def test_a_seed_and_its_image_are_one(seed):
    """A period apart they are the same seed, which no cell parts."""
    points = seeding.uniform(BLOCK, 6, random_state=seed)
    lo, hi = BLOCK.bounds
    points[0, seed % 3] = lo[seed % 3]
    image = points[0].copy()
    image[seed % 3] = hi[seed % 3]
    both = np.concatenate([points, [image]])
    for make in (stochastic.voronoi, stochastic.delaunay, stochastic.face_distance):
        with pytest.raises(ArgumentError, match=r"seeds 0 and 6 .*a period apart"):
            make(BLOCK, seeds=both, periodic=True)


def test_seeds_in_a_plane_will_do_for_a_foam():
    """They are columns: edges run through the body, across the plane."""
    flat = [(x, y, 5.0) for x in (2, 5, 8.5) for y in (2, 6, 8)]
    box = frep.box((0, 0, 0), (10, 10, 10))
    lattice = stochastic.voronoi(box, seeds=flat, connected=False)
    assert lengths(lattice) == pytest.approx(10.0)
    assert len(lattice.skeleton.edges) == 4
    assert pdist(np.array(flat)).min() > 0
