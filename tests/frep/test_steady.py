"""Steady skeletons: clusters against products of matrices, ball queries and fields against brute force, windows of
huge lattices."""

from __future__ import annotations

import numpy as np
import pytest

import frep
from frep.field import topological
from frep.packing import pack_leaves
from frep.sampling import cutoffs, regions
from frep.skeleton import GraphSkeleton
from frep.thicken import thickened
from tests.steady_cases import (
    CUBIC,
    KINDS,
    X,
    Z,
    all_beams,
    axis_distances,
    clusters,
    figure_6_3,
    lattice,
    placed_by_matrices,
    random_lattice,
)
from topologies import beams
from topologies.steady import Screw, SteadyLattice, Swirl, Translation

RNG = np.random.default_rng(20)


@pytest.fixture(params=KINDS, scope="module")
def case(request) -> SteadyLattice:
    return KINDS[request.param]()


def explicit(case: SteadyLattice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, radii and edges of a lattice, written out: every beam, and a beam of no length for every node."""
    skeleton = case.skeleton
    nodes, radii = skeleton.balls(*clusters(skeleton).T)
    n = len(skeleton.nodes)

    def number(cluster: np.ndarray, node: int) -> int:
        return int(np.ravel_multi_index(tuple(cluster - skeleton.start), tuple(skeleton.counts))) * n + node

    edges = []
    for i, j, k, rack in all_beams(skeleton):
        start, end, *offset = skeleton.racks[rack].tolist()
        edges.append((number(np.array([i, j, k]), start), number(np.array([i, j, k]) + offset, end)))
    edges += [(i, i) for i in range(n * len(clusters(skeleton)))]
    return nodes.reshape(-1, 3), radii.reshape(-1), np.array(edges)


# --- what there is
# -------------------------------------------------------------------------------------------------------


def test_clusters_are_products_of_the_matrices(case):
    skeleton = case.skeleton
    for cluster in clusters(skeleton)[RNG.integers(0, len(clusters(skeleton)), 5)]:
        centers, _ = skeleton.balls(*cluster)
        for node in range(len(skeleton.nodes)):
            expected = placed_by_matrices(skeleton, cluster, node)
            scale = 1.0 + np.abs(expected).max() + max(np.abs(s.matrix).max() for s in skeleton.directions)
            assert np.allclose(centers[node], expected, atol=1e-11 * scale)


def test_figure_6_3():
    """O7: the one node whose place and radius the thesis' numbers fix."""
    centers, radii = figure_6_3().balls(6, 11, 14)
    assert np.allclose(centers[0], (21.05085999, 0.02840919, 0.1158054), atol=5e-9)
    assert radii[0] == pytest.approx(0.0919527321, abs=5e-11)


def test_numbers_of_beams_and_nodes_are_exact(case):
    skeleton = case.skeleton
    assert skeleton.n_beams == len(all_beams(skeleton))
    assert skeleton.n_nodes == len(clusters(skeleton)) * len(skeleton.nodes)


def test_scales_and_bounds_hold_every_ball(case):
    skeleton = case.skeleton
    centers, radii = skeleton.balls(*clusters(skeleton).T)
    ratio = radii / skeleton.radii
    assert np.allclose([ratio.min(), ratio.max()], skeleton.scales, rtol=1e-12)
    assert np.all(centers >= skeleton.bounds[0] - 1e-9)
    assert np.all(centers <= skeleton.bounds[1] + 1e-9)


def test_bounds_of_a_large_lattice_are_a_little_larger(monkeypatch):
    """Beyond some size not every node is looked at: the box still holds, and is larger by a thousandth and a
    cluster."""
    case = lattice(Translation((1, 0, 0)), Screw(0.02, "z", (-30, 0, 0)), Swirl(1.004, (0, 0, -60)), (30, 30, 30))
    exact = case.skeleton.bounds
    monkeypatch.setattr("frep.steady._ENUMERATED", 0)
    larger = case.region((0, 0, 0), (30, 30, 30)).skeleton.bounds
    assert np.all(larger[0] <= exact[0])
    assert np.all(larger[1] >= exact[1])
    assert np.all(np.abs(larger - exact) < 3.0)


def test_lone_nodes_are_those_without_a_beam_somewhere(case):
    skeleton = case.skeleton
    joined = np.zeros((*skeleton.counts, len(skeleton.nodes)), bool)
    for i, j, k, rack in all_beams(skeleton):
        start, end, *offset = skeleton.racks[rack].tolist()
        cluster = np.array([i, j, k]) - skeleton.start
        joined[(*cluster, start)] = joined[(*(cluster + offset), end)] = True
    assert set(skeleton.lone_nodes) == set(np.flatnonzero(~joined.all(axis=(0, 1, 2))))


# --- ball queries
# --------------------------------------------------------------------------------------------------------


def check_queries(case: SteadyLattice, queries: int, rng: np.random.Generator) -> int:
    skeleton = case.skeleton
    every = all_beams(skeleton)
    ends, _ = skeleton.ends(every)
    low, high = skeleton.bounds
    size = max(float(np.ptp(skeleton.bounds, axis=0).max()), 1.0)
    hits = 0
    for _ in range(queries):
        center = rng.uniform(low - 0.1 * size, high + 0.1 * size)
        if len(every) and rng.random() < 0.7:
            center = ends[rng.integers(len(every)), 0] + 0.3 * rng.normal(size=3)
        radius = float(rng.choice([0.0, 1e-3, 0.2, 0.7])) * rng.random() + (size if rng.random() < 0.02 else 0.0)
        distance = axis_distances(ends, center)
        found = {tuple(row) for row in skeleton.beams_meeting(center, radius)[:, [1, 2, 3, 0]]}
        rounding = 1e-9 * (size + np.abs(center).max())
        sure = {tuple(row) for row in every[distance <= radius - rounding]}
        possible = {tuple(row) for row in every[distance <= radius + rounding]}
        assert sure <= found <= possible
        hits += len(found)
    return hits


def test_ball_queries_find_what_brute_force_finds(case):
    assert check_queries(case, 150, RNG) > 0


@pytest.mark.parametrize("seed", range(40))
def test_ball_queries_of_random_lattices(seed):
    rng = np.random.default_rng(seed)
    check_queries(random_lattice(rng), 60, rng)


def test_a_query_that_meets_everything_returns_everything():
    case = lattice(X, Screw(0.1, "z", (-20, 0, 0)), Z, (12, 12, 12))
    assert len(case.skeleton.beams_meeting((0, 0, 0), 1e3)) == case.n_beams > 4096


# --- fields
# --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["regular", "two nodes", "swirls", "figure 6.3", "region", "row", "single cluster"])
def test_fields_are_those_of_the_same_beams_written_out(kind):
    case = KINDS[kind]()
    nodes, radii, edges = explicit(case)
    graph = GraphSkeleton(nodes, edges)
    points = RNG.uniform(case.bounds[0] - 0.5, case.bounds[1] + 0.5, (400, 3))

    def written_out(diameter, **options):
        settings = {"node": None, "section": "circle", "blend": 0.0, **options}
        return thickened(graph, diameter, label="graph", **settings)

    assert np.allclose(case.solid().field(points), written_out(2 * radii).field(points), atol=1e-9)
    joined = edges[edges[:, 0] != edges[:, 1]]
    graph = GraphSkeleton(nodes[: joined.max() + 1], joined)
    if len(np.unique(joined)) == len(nodes):
        for options in ({"node": 0.3}, {"blend": 0.1}):
            expected = written_out(0.2, **options).field(points)
            assert np.allclose(case.thicken(0.2, **options).field(points), expected, atol=1e-9)


def test_bounds_of_the_field_enclose_it(case):
    field = case.solid().field
    low = RNG.uniform(case.bounds[0] - 0.5, case.bounds[1], (200, 3))
    high = low + RNG.uniform(0.0, 1.0, (200, 3)) * RNG.choice([0.01, 0.3, 3.0], (200, 1))
    for a, b in zip(low[:60], high[:60], strict=True):
        least, most = field.bounds(a, b)
        values = field(RNG.uniform(a, b, (20, 3)))
        assert least - 1e-9 <= values.min()
        assert values.max() <= most + 1e-9


@pytest.mark.parametrize("kind", ["two nodes", "cylinder", "figure 6.3", "region"])
def test_a_window_of_the_lattice_is_the_window_of_its_beams(kind, monkeypatch):
    """What lies outside the window is not even packed; the samples inside are the same."""
    case = KINDS[kind]()
    nodes, radii, edges = explicit(case)
    middle = nodes[len(nodes) // 2]
    window = frep.box(middle - 0.8, middle + 0.8)
    graph = thickened(GraphSkeleton(nodes, edges), 2 * radii, node=None, section="circle", blend=0.0, label="graph")
    one, other = ((part & window).mesh(0.05) for part in (case.solid(), graph))
    assert one.n_faces == other.n_faces
    assert np.allclose(one.vertices, other.vertices, atol=1e-5)
    monkeypatch.setattr("frep.steady._WRITTEN_OUT", 0)  # neither are the few beams of a small window written out
    assert np.allclose((case.solid() & window).mesh(0.05).vertices, other.vertices, atol=1e-5)


def test_a_window_of_billions_of_beams():
    """One cell of a cubic lattice of 3e9 beams is the cell of a periodic one, and has the closed form's volume."""
    r, n = 0.1, 1000
    case = lattice(X, Translation((0, 1, 0)), Z, (n, n, n), radii=r)
    assert case.n_beams == 3 * n * n * (n - 1)
    corner = np.array([500.5, 400.5, 300.5])
    part, periodic = (s & frep.box(corner, corner + 1) for s in (case.solid(), beams.simple_cubic(1).thicken(2 * r)))
    assert part.volume(voxel=0.02) == pytest.approx(periodic.volume(voxel=0.02), rel=1e-9)
    expected = 3 * np.pi * r**2 - 8 * np.sqrt(2) * r**3
    assert part.mesh(voxel=0.02, polish=True).volume == pytest.approx(expected, rel=1e-2)
    assert np.all(case.contains([[500.5, 400, 300], [500.5, 400.5, 300]]) == [True, False])


@pytest.mark.parametrize("written_out", [0, 1_000_000])
def test_only_the_window_is_packed(written_out, monkeypatch):
    """Of a lattice of 1e9 clusters, asked for a window: the tables of powers hold the window's, or its beams are
    written out."""
    monkeypatch.setattr("frep.steady._WRITTEN_OUT", written_out)
    case = lattice(X, Translation((0, 1, 0)), Z, (1000, 1000, 1000))
    part = case.solid() & frep.box((500, 500, 500), (503, 503, 503))
    limits = cutoffs(part.field, *part.bounds, 0.1)
    boxes = regions(limits, *part.bounds)
    (leaf,) = (n for n in topological([part.field]) if n.op == "beams")
    whole, window = pack_leaves((leaf,), limits), pack_leaves((leaf,), limits, boxes)
    assert len(window.fdata) < 0.05 * len(whole.fdata)


def test_sections_stand_on_steady_beams():
    """A square beam of a steady row has the volume of a prism."""
    row = lattice(Translation((2, 0, 0)), None, None, (4,), CUBIC[:1])
    part = row.thicken(0.5, section=beams.square()) & frep.box((0.5, -1, -1), (5.5, 1, 1))
    assert part.volume(voxel=0.05) == pytest.approx(5 * 0.25, rel=1e-3)


@pytest.mark.parametrize("kind", ["regular", "cylinder", "swirls", "figure 6.3"])
def test_the_field_far_away_is_the_distance_of_the_nearest_beam(kind):
    """Far off, thousands of beams are about as near."""
    case = KINDS[kind]()
    nodes, radii, _ = explicit(case)
    center = nodes.mean(axis=0)
    for away in (50.0, 1e3, 1e5):
        points = center + away * RNG.normal(size=(5, 3))
        gaps = np.linalg.norm(points[:, None] - nodes, axis=2) - radii
        value = case.solid().field(points)
        assert np.all(value <= gaps.min(axis=1) + 1e-9 * away)
        assert np.all(value >= gaps.min(axis=1) - 3.0)


def test_the_field_far_from_millions_of_beams():
    """A brick of 3e6 beams: the nearest is its corner, or its face."""
    case = lattice(X, Translation((0, 1, 0)), Z, (100, 100, 100))
    points = np.array([(1e5, 0, 0), (-300, 40.3, 40.2), (-1e4, -1e4, -1e4), (49.5, 49.5, 1e3)])
    field = case.solid().field(points)
    expected = [1e5 - 99, 300.0, np.sqrt(3) * 1e4, 901.0]
    assert np.allclose(field + 0.1, expected, atol=0.6)


def test_bounds_of_long_coils_are_as_narrow_as_the_coil(monkeypatch):
    monkeypatch.setattr("frep.steady._ENUMERATED", 0)
    coil = lattice(Screw(np.pi / 8, pitch=0.01), None, None, (100_000,), CUBIC[:1], nodes=[(10, 0, 0)], radii=0.05)
    low, high = coil.skeleton.bounds
    assert np.all(low <= [-10, -10, 0])
    assert np.all(high >= [10, 10, 999.99])
    assert np.all(low >= [-12, -12, -2])
    assert np.all(high <= [12, 12, 1002])


def test_directions_of_too_many_clusters_are_refused_with_a_remedy():
    case = SteadyLattice([(0, 0, 0)], 0.1, CUBIC[:1], X, counts=10**9)
    assert case.n_beams == 10**9 - 1
    with pytest.raises(frep.TooLargeError, match=r"counts: 999,999,999 .* take a `region`"):
        case.skeleton.beams_meeting((0, 0, 0), 1.0)
    assert len(case.region((5, 0, 0), (10, 1, 1)).skeleton.beams_meeting((6.5, 0, 0), 0.1)) == 1
