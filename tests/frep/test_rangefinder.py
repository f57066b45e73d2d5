"""RangeFinder: rows and whole lattices against brute force, which is the judge; conditions; derived queries; bad input."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frep import ArgumentError
from frep.errors import ArgumentTypeError
from frep.rangefinder import conditions, contains, distance, find_beams, find_nodes, meets, nearest, row_ranges
from frep.similarity import Screw, Similarity, Swirl, Translation
from frep.steady import SteadySkeleton
from topologies.steady import SteadyLattice


def _from_benchmarks(name: str) -> Any:
    """Random lattices and brute force, shared with `benchmarks/biq.py --exhaustive`."""
    path = Path(__file__).parents[2] / "benchmarks" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"benchmarks_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


lattices = _from_benchmarks("_lattices")
CUBIC = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
X, Y, Z = Translation((1, 0, 0)), Translation((0, 1, 0)), Translation((0, 0, 1))


def grid(n: int = 6, start=(0, 0, 0)) -> SteadySkeleton:
    return SteadyLattice([(0, 0, 0)], 0.1, CUBIC, X, Y, Z, (n, n, n), start=start).skeleton


def wheel() -> SteadySkeleton:
    """No two similarities commute."""
    steps = Swirl(1.1, (-5, 0, 0)), Screw(0.3, "z", (-4, 0, 0), 0.2), Swirl(0.95, (0, 9, 1), 0.2, (0, 1, 1))
    return SteadyLattice([(0, 0, 0)], 0.15, [*CUBIC, (0, 0, 1, -1, 1)], *steps, (4, 5, 6), start=(-1, 2, -3)).skeleton


# --- golden --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def figure() -> SteadySkeleton:
    """Figure 6.3 of Constructive Lattice Geometry, its fourth rack once (oracles O7 and O8)."""
    u = Swirl(1.187, (-3.333, 0, 0))
    v = Screw(0.285, "z", (-1.555, 0.003, 0))
    w = Swirl(0.953, (10.872, 0, 0.039), 0.224, "y")
    racks = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 1, 1), (0, 0, 1, 1, 0)]
    return SteadyLattice([(0, 0, 0)], 0.0645, racks, u, v, w, (7, 12, 15)).skeleton


def test_the_figure_is_the_one_of_the_thesis(figure: SteadySkeleton) -> None:
    center, radius = figure.balls(6, 11, 14)
    np.testing.assert_allclose(center[0], [21.05085999, 0.02840919, 0.1158054], rtol=1e-6)
    np.testing.assert_allclose(radius, [0.0919527321], rtol=1e-8)
    assert figure.n_beams == 4303


def test_sixteen_beams_and_two_nodes_meet_the_ball_of_oracle_o8(figure: SteadySkeleton) -> None:
    center = figure.balls(3, 5, 7)[0]
    for method in conditions(figure).methods:
        assert len(find_beams(figure, center, 0.6, method)) == 16
        assert len(find_nodes(figure, center, 0.6, method)) == 2


# --- rows ----------------------------------------------------------------------------------------------------------------


def listed(ranges: list[tuple[int, int]]) -> list[int]:
    return [k for low, high in ranges for k in range(low, high + 1)]


def row_hits(s: Similarity, template, center, radius: float, count: int) -> tuple[set[int], set[int]]:
    """The k that meet the ball by more than rounding, and those that may."""
    balls = template if isinstance(template[0][0], tuple) else (template, template)
    m = s.powers(np.arange(count))
    ends = np.stack([m[:, :3, :3] @ np.array(c, float) + m[:, :3, 3] for c, _ in balls], axis=1)
    radii = np.exp(s.log_scale * np.arange(count))[:, None] * [r for _, r in balls]
    gaps = lattices.hull_distances(np.array([center], float), ends, radii)[0] - radius
    size = 1e-10 * (1.0 + np.abs(ends).max() + np.abs(center).max())
    return set(np.flatnonzero(gaps <= -size).tolist()), set(np.flatnonzero(gaps <= size).tolist())


def near_ring(angle: float = 0.999 * math.tau / 20) -> Similarity:
    return Screw(angle)


def at(azimuth: float, radius: float = 1.0, height: float = 0.0) -> tuple[float, float, float]:
    return (radius * math.cos(azimuth), radius * math.sin(azimuth), height)


def test_a_ring_almost_closed_is_met_at_both_ends_of_its_seam() -> None:
    step = 0.999 * math.tau / 20
    assert row_ranges(Screw(step), (at(-0.3), 0.05), at(-0.3 - step / 2), 0.15, 20) == [(0, 0), (19, 19)]
    assert row_ranges(Screw(-step), (at(-0.3), 0.05), at(-0.3 + step / 2), 0.15, 20) == [(0, 0), (19, 19)]


ROWS = {
    "one": (Screw(0.4), (at(0.1), 0.2), at(0.1), 0.1, 1),
    "point": (Translation((1, 0, 0)), (at(0.0), 0.2), (5, 0.1, 0), 0.0, 9),
    "four turns": (Screw(0.9, pitch=0.05), (at(1.0), 0.2), at(1.0, 1, 0.9), 0.3, 40),
    "four turns back": (Screw(-0.9, pitch=-0.05), ((at(1.0), 0.2), (at(1.4, 1.3), 0.1)), at(1.0, 1, -0.9), 0.3, 40),
    "more than a turn a step": (Screw(7.0, pitch=0.05), (at(1.0), 0.2), at(1.5, 1, 0.9), 0.3, 40),
    "whole turns": (Screw(math.tau, pitch=0.5), (at(1.0), 0.2), at(1.0, 1, 4.9), 0.3, 40),
    "half turns": (Screw(math.pi), (at(1.0), 0.2), at(1.0 + math.pi), 0.3, 9),
    "shrinking": (Swirl(0.8, angle=0.7), (at(1.0), 0.2), at(1.0 + 2.1, 0.5), 0.05, 30),
    "fixed point in the query": (Swirl(0.8, angle=0.7), (at(1.0), 0.2), (0, 0, 0.01), 0.05, 30),
    "fixed point in the ball": (Swirl(1.2, angle=0.7), ((0.1, 0, 0), 0.2), (1, 1, 1), 0.5, 30),
    "fixed point in the beam": (Swirl(1.2, angle=0.7), (((-1, 0, 0), 0.1), ((1, 0, 0), 0.2)), (3, 3, 0.1), 0.5, 30),
    "axis through the beam": (
        Screw(0.3, pitch=0.1),
        (((-1, 0, 0), 0.1), ((2, 0.1, 0), 0.2)),
        at(2.2, 1.5, 0.8),
        0.1,
        50,
    ),
    "axis through the ball": (Screw(0.3, pitch=0.1), ((0.1, 0, 0), 0.2), at(2.2, 0.25, 0.8), 0.1, 50),
    "axis through the query": (Screw(0.3), (at(0.3), 0.2), (0.1, 0, 0), 1.0, 50),
    "beam that wraps the axis": (Screw(0.3), ((at(0.0), 0.05), (at(3.0), 0.05)), at(1.0, 0.5), 0.1, 21),
    "beam in a ball": (Screw(0.3), ((at(0.0), 0.5), (at(0.1), 0.05)), at(1.0, 1.2), 0.1, 21),
    "nothing moves": (Similarity.identity(), (at(0.0), 0.5), at(0.1), 0.1, 5),
    "scale near one": (Swirl(1 + 1e-12, (-1e12, 0, 0)), (at(0.0), 0.3), (7.2, 0, 0), 0.1, 20),
    "scale by rounding": (Similarity(1e-17, 1e-17, [0, 1, 0], [1, 0, 0]), (at(0.0), 0.3), (7.2, 0, 0), 0.1, 20),
    # Slow enough to be searched as a simpler kind, long enough to end up elsewhere.
    "slow growth": (
        Similarity(9e-8, 0.0, [0, 0, 1], [0, 0, 1]),
        ((100, 0, 0), 0.3),
        (100.813, 0, 90365.4),
        0.3,
        100_000,
    ),
    "slow growth of a screw": (
        Similarity(9e-8, 0.5, [0, 0, 1], [0, 0, 1]),
        ((5, 0, 0), 0.3),
        (0, 0, 90365.4),
        5.3,
        100_000,
    ),
    "slow turn": (Similarity(0.0, 9e-8, [0, 0, 1], [1, 0, 0]), ((0, 0, 0), 0.3), (89901.6, 364.4, 0), 0.6, 100_000),
    "angle near none": (Screw(1e-9, "z", (0, 1e9, 0)), (at(0.0), 0.3), (7.2, 0, 0), 0.1, 20),
}


@pytest.mark.parametrize("case", ROWS)
def test_rows_lose_no_hit(case: str) -> None:
    similarity, template, center, radius, count = ROWS[case]
    ranges = row_ranges(similarity, template, center, radius, count)
    surely, _ = row_hits(similarity, template, center, radius, count)
    assert surely <= set(listed(ranges))
    assert surely or case in ("axis through the ball",)  # a row that nothing meets would prove nothing


def test_rows_near_a_simpler_kind_are_bounded_as_tightly_as_it() -> None:
    for case in ("scale near one", "scale by rounding", "angle near none", "point"):
        similarity, template, center, radius, count = ROWS[case]
        assert (
            set(listed(row_ranges(similarity, template, center, radius, count)))
            == row_hits(similarity, template, center, radius, count)[1]
        )


numbers = st.floats(-2.0, 2.0)
points = st.tuples(numbers, numbers, numbers)
balls = st.tuples(points, st.floats(0.0, 0.7))
axes = points.filter(lambda v: math.hypot(*v) > 0.1)
steps = st.one_of(
    st.builds(Translation, points),
    st.builds(Screw, st.floats(-8, 8), axes, points, st.floats(-0.5, 0.5)),
    st.builds(Swirl, st.floats(0.8, 1.25), points, st.floats(-8, 8), axes),
    st.builds(
        lambda a, b, axis, v: Similarity(a, b, np.array(axis) / math.hypot(*axis), v),
        st.sampled_from([0.0, 1e-17, -1e-12, 1e-9, 9e-8, 1.1e-7, -1e-6]),
        st.sampled_from([0.0, 1e-17, -1e-12, 1e-9, 9e-8, 1.1e-7, -1e-6, math.tau, math.tau + 1e-9]),
        axes,
        points,
    ),
)


@settings(max_examples=1000)
@given(steps, st.one_of(balls, st.tuples(balls, balls)), points, st.floats(0.0, 1.0), st.integers(1, 60))
def test_ranges_hold_every_hit_and_are_ascending_and_disjoint(step, template, center, radius, count) -> None:
    ranges = row_ranges(step, template, center, radius, count)
    surely, _ = row_hits(step, template, center, radius, count)
    assert surely <= set(listed(ranges))
    flat = [k for pair in ranges for k in pair]
    assert flat == sorted(flat)
    assert all(high + 1 < low for (_, high), (low, _) in zip(ranges[:-1], ranges[1:], strict=True))
    assert not flat or (flat[0] >= 0 and flat[-1] < count)


def test_a_row_of_many_turns_has_a_range_a_turn() -> None:
    ring = Screw(math.tau / 12)
    assert row_ranges(ring, (at(0.0), 0.05), at(0.0), 0.05, 1200) == [(12 * n, 12 * n) for n in range(100)]


# --- lattices ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", lattices.KINDS)
def test_every_method_finds_what_brute_force_finds(kind: str) -> None:
    rng = np.random.default_rng(list(map(ord, kind)))
    each, hits = 250, 0
    for _ in range(10):  # 2,500 balls a kind, 25,000 in all
        skeleton = lattices.random_lattice(rng, kind)
        beams, ends, radii = lattices.all_beams(skeleton)
        centers = rng.uniform(ends.min(axis=(0, 1)), ends.max(axis=(0, 1)), (each, 3))
        near = rng.integers(len(ends), size=each)
        centers[::2] = (ends[near, 0] + rng.normal(size=(each, 3)) * radii.max())[::2]
        reach = rng.uniform(0, 3, each) * radii.max() * rng.integers(0, 2, each)
        gaps = lattices.hull_distances(centers, ends, radii) - reach[:, None]
        size = 1e-9 * (np.abs(ends).max() + np.abs(skeleton.nodes).max())
        number = {tuple(row): n for n, row in enumerate(beams.tolist())}
        hits += int((gaps <= 0).sum())
        for method in conditions(skeleton).methods:
            found = find_beams(skeleton, centers, reach, method)
            met = np.zeros(gaps.shape, int)
            np.add.at(met, (found[:, 0], [number[tuple(row)] for row in found[:, 1:].tolist()]), 1)
            assert not np.any((gaps <= -size) & (met == 0)), f"{method} lost a beam"
            assert not np.any((gaps > size) & (met > 0)), f"{method} found a beam that does not meet the ball"
            assert met.max() <= 1
            assert np.all(np.diff(found[:, 0]) >= 0)
    assert hits > 1000


@pytest.mark.parametrize("seed", range(6))
def test_directions_that_are_parallel_measure_no_index(seed: int) -> None:
    """What is left of a direction across its parallel is rounding, of any direction; it must not bound anything."""
    rng = np.random.default_rng(seed)
    along = rng.normal(size=3)
    across = np.cross(along, rng.normal(size=3))
    # all parallel; two and a turn about them; nearly; and a third in their plane
    for v, w in (
        (Translation(-0.26 * along), Screw(6.6, along)),
        (Translation(0.37 * along), Translation(1.9 * along)),
        (Translation(0.37 * along + 1e-13 * across), Screw(0.3, along, pitch=0.1)),
        (Translation(0.37 * along + 1e-9 * across), Translation(0.2 * along + 0.3 * across)),
    ):
        racks = [(0, 1, 2, 2, 0), (1, 0, 1, -2, 0), (1, 1, 1, 0, 0), (0, 0, 0, 0, 1)]
        nodes = rng.normal(size=(2, 3))
        lattice = SteadyLattice(nodes, 0.02, racks, Translation(along), v, w, (5, 4, 3))
        skeleton, beams = lattice.skeleton, np.concatenate(list(lattice.beams()))
        ends, _ = skeleton.ends(beams)
        for method in conditions(skeleton).methods:
            found = find_beams(skeleton, ends.mean(axis=1), 0.01, method)
            own = {(query, *row) for query, row in enumerate(beams.tolist())}
            assert own <= set(map(tuple, found.tolist())), method


def test_the_sample_can_tell_a_lost_turn() -> None:
    # The balls of the test above do meet lattices at more than one turn and at the last index.
    rng = np.random.default_rng(list(map(ord, "turns")))
    skeleton = lattices.random_lattice(rng, "turns")
    assert abs(skeleton.w.angle) * int(skeleton.counts[2]) > math.tau


def test_nodes_are_found_as_balls() -> None:
    rng = np.random.default_rng(5)
    for kind in lattices.KINDS:
        skeleton = lattices.random_lattice(rng, kind)
        index = np.stack(
            np.meshgrid(
                *(np.arange(s, s + n) for s, n in zip(skeleton.start, skeleton.counts, strict=True)), indexing="ij"
            ),
            -1,
        )
        index = index.reshape(-1, 3)
        positions, radii = skeleton.balls(*index.T)
        points = positions.reshape(-1, 3)
        centers = points[rng.integers(len(points), size=100)] + 0.5 * rng.normal(size=(100, 3))
        gaps = np.linalg.norm(centers[:, None, None] - positions, axis=3) - radii - 0.3
        want = {(q, *index[c].tolist(), n) for q, c, n in np.argwhere(gaps <= 0.0).tolist()}
        for method in conditions(skeleton).methods:
            assert set(map(tuple, find_nodes(skeleton, centers, 0.3, method).tolist())) == want


def test_a_region_has_the_beams_of_the_whole_within_it() -> None:
    lattice = SteadyLattice([(0, 0, 0)], 0.15, CUBIC, X, Screw(0.1, "z", (-9, 0, 0)), Z, (9, 10, 11), start=(-3, -2, 5))
    part = lattice.region((-1, 1, 7), (4, 3, 5))
    rng = np.random.default_rng(8)
    beams, ends, _ = lattices.all_beams(part.skeleton)
    centers = ends[rng.integers(len(ends), size=200), 0]
    inside = set(map(tuple, beams.tolist()))
    for method in conditions(lattice.skeleton).methods:
        whole = find_beams(lattice.skeleton, centers, 0.6, method).tolist()
        want = sorted(row for row in whole if tuple(row[1:]) in inside)
        assert sorted(find_beams(part.skeleton, centers, 0.6, method).tolist()) == want


def test_a_trillion_beams_are_searched_as_the_few_nearby() -> None:
    n = 10_000
    huge = SteadyLattice([(0, 0, 0)], 0.1, CUBIC, X, Y, Z, (n, n, n)).skeleton
    middle = (5000.2, 4999.9, 5000.4)
    want = find_beams(grid(8), [np.array(middle) - 4996], 0.9, "naive")[:, 1:] + [4996, 4996, 4996, 0]
    for method in ("O(1)", "O(u)", "descent"):
        found = find_beams(huge, [middle], 0.9, method)[:, 1:]
        assert sorted(found.tolist()) == sorted(want.tolist())


def test_a_ball_that_holds_everything_meets_everything() -> None:
    for skeleton in (grid(), wheel()):
        beams, *_ = lattices.all_beams(skeleton)
        for method in conditions(skeleton).methods:
            found = find_beams(skeleton, [(0, 0, 0), (1e6, 0, 0), (1, 1, 1)], [1e3, 1.0, 1e3], method)
            assert sorted(found[:, 1:].tolist()) == sorted(2 * beams.tolist())
            assert found[:, 0].tolist() == [0] * len(beams) + [2] * len(beams)


def test_no_balls_meet_nothing() -> None:
    assert find_beams(grid(), np.zeros((0, 3)), np.zeros(0)).shape == (0, 5)


def test_threads_do_not_matter() -> None:
    centers = np.random.default_rng(1).uniform(0, 5, (500, 3))
    assert np.array_equal(find_beams(grid(), centers, 0.5, threads=1), find_beams(grid(), centers, 0.5))


# --- conditions ----------------------------------------------------------------------------------------------------------


def made(u, v, w, counts=(5, 6, 7)) -> SteadySkeleton:
    return SteadyLattice([(3, 0.2, 0.1)], 0.1, CUBIC, u, v, w, counts).skeleton


def test_orthogonal_translations_pass_the_plain_conditions() -> None:
    assert conditions(grid()).plain_constant
    assert conditions(grid()).methods[0] == "O(1)"


def test_oblique_translations_fail_the_plain_conditions_and_are_served_by_the_dual_basis() -> None:
    held = conditions(made(X, Translation((0.5, 0.9, 0)), Translation((0.2, 0.3, 1.1))))
    assert held.uv
    assert held.uw
    assert held.vw
    assert not held.plain_constant
    assert not held.plain_linear
    assert held.dual
    assert held.methods[:2] == ("O(1)", "O(u)")


def test_dependent_translations_are_refused() -> None:
    held = conditions(made(X, Y, Translation((1, 1, 0))))
    assert "O(1)" not in held.methods
    assert held.dual_vw  # v and w are independent still


@pytest.mark.parametrize(
    ("v", "w", "linear"),
    [
        (Screw(0.3), Z, True),
        (Z, Screw(0.3), True),
        (Screw(0.3), Swirl(1.1), True),
        (Swirl(1.1, (0, 0, 2)), Screw(0.3, "z"), True),
        (Screw(0.3), Translation((0.1, 0, 1)), False),
        (Screw(0.3), Swirl(1.1, (0.1, 0, 0)), False),
        (Screw(0.3, pitch=0.1), Z, False),
        (Screw(0.3), Screw(0.2), False),
        (Swirl(1.1), Swirl(1.2), False),
        (Swirl(1.1, angle=0.1), Screw(0.2), False),
        (Z, Z, False),
    ],
)
def test_which_pairs_pass(v: Similarity, w: Similarity, linear: bool) -> None:
    assert conditions(made(X, v, w)).plain_linear == linear


def test_a_node_on_the_axis_does_not_pass_for_commuting_steps() -> None:
    # The node of a cluster lies where V and W agree by accident; their operators do not.
    skeleton = SteadyLattice(
        [(0, 0, 0)], 0.1, CUBIC, X, Screw(0.2, "y", (0, 0, -4)), Screw(0.3, "x", (0, 0, -4)), (4, 4, 4)
    ).skeleton
    assert not conditions(skeleton).vw
    with pytest.raises(ArgumentError, match="method"):
        find_beams(skeleton, [(0, 0, 0)], 1.0, "O(u)")


def test_one_cluster_along_a_direction_commutes_with_all() -> None:
    held = conditions(
        SteadyLattice([(3, 0, 0)], 0.1, [(0, 0, 0, 1, 0)], Screw(1.0, "x"), Screw(0.3), Z, (1, 6, 7)).skeleton
    )
    assert held.methods[0] == "O(1)"


# --- derived queries -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("skeleton", [grid(), wheel()], ids=["grid", "wheel"])
def test_containment_distance_and_nearest_agree_with_brute_force(skeleton: SteadySkeleton) -> None:
    rng = np.random.default_rng(3)
    beams, ends, radii = lattices.all_beams(skeleton)
    low, high = ends.min(axis=(0, 1)) - 1, ends.max(axis=(0, 1)) + 1
    points = np.concatenate([rng.uniform(low, high, (300, 3)), ends[:100, 0] + 0.1 * rng.normal(size=(100, 3))])
    gaps = lattices.hull_distances(points, ends, radii)
    least = gaps.min(axis=1)
    np.testing.assert_array_equal(contains(skeleton, points), least <= 0.0)
    np.testing.assert_array_equal(meets(skeleton, points, 0.3), least <= 0.3)
    np.testing.assert_allclose(distance(skeleton, points, within=0.5), np.minimum(least, 0.5), atol=1e-12)
    rows, depth = nearest(skeleton, points)
    np.testing.assert_allclose(depth, least, atol=1e-12)
    number = {tuple(row): n for n, row in enumerate(beams.tolist())}
    picked = [number[tuple(row)] for row in rows.tolist()]
    np.testing.assert_allclose(gaps[np.arange(len(points)), picked], least, atol=1e-12)


def test_the_nearest_beam_of_a_point_far_away() -> None:
    row, gap = nearest(grid(), (-1000.0, 0, 0))
    assert row.tolist()[:3] == [0, 0, 0]
    assert gap == pytest.approx(999.9, abs=1e-9)


def test_a_node_without_beams_is_solid_too() -> None:
    alone = SteadyLattice([(0, 0, 0), (0.5, 0.5, 0.5)], 0.1, [(0, 0, 1, 0, 0)], X, Y, Z, (3, 3, 3)).skeleton
    assert contains(alone, (1.5, 0.5, 0.5))
    assert distance(alone, (1.5, 0.5, 0.7), within=5) == pytest.approx(0.1)


# --- bad input -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("centers", "radii"),
    [
        ([(0, 0, 0)], -1.0),
        ([(0, 0, 0)], math.nan),
        ([(0, 0, 0)], math.inf),
        ([(0, 0, 0)], [1.0, 2.0]),
        ([(0, 0, 0)], [[1.0]]),
        ([(0, 0, math.nan)], 1.0),
        ([(0, 0)], 1.0),
        ((0, 0, 0), 1.0),
        ("here", 1.0),
    ],
)
def test_bad_balls_are_refused(centers, radii) -> None:
    for find in (find_beams, find_nodes):
        with pytest.raises((ArgumentError, ArgumentTypeError), match=r"centers|radi"):
            find(grid(), centers, radii)


def test_unknown_methods_and_thread_counts_are_refused() -> None:
    with pytest.raises(ArgumentError, match="method"):
        find_beams(grid(), [(0, 0, 0)], 1.0, "O(n)")  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="threads"):
        find_beams(grid(), [(0, 0, 0)], 1.0, threads=0)


@pytest.mark.parametrize(
    "arguments",
    [
        (None, ((0, 0, 0), 1.0), (0, 0, 0), 1.0, 3),
        (X, ((0, 0, 0), -1.0), (0, 0, 0), 1.0, 3),
        (X, (0, 0, 0), (0, 0, 0), 1.0, 3),
        (X, ((0, 0, 0), 1.0, 2.0), (0, 0, 0), 1.0, 3),
        (X, 7, (0, 0, 0), 1.0, 3),
        (X, ((0, 0, 0), 1.0), (0, 0), 1.0, 3),
        (X, ((0, 0, 0), 1.0), (0, 0, 0), math.nan, 3),
        (X, ((0, 0, 0), 1.0), (0, 0, 0), 1.0, 0),
        (X, ((0, 0, 0), 1.0), (0, 0, 0), 1.0, 2.5),
    ],
)
def test_bad_rows_are_refused(arguments) -> None:
    with pytest.raises((ArgumentError, ArgumentTypeError)):
        row_ranges(*arguments)


def test_bad_points_are_refused() -> None:
    with pytest.raises(ArgumentError, match="points"):
        contains(grid(), [(0, 0, math.inf)])
    with pytest.raises(ArgumentError, match="points"):
        nearest(grid(), [(0, 0)])
    with pytest.raises(ArgumentError, match="within"):
        distance(grid(), [(0, 0, 0)], within=-1.0)
    lonely = SteadySkeleton(
        nodes=np.zeros((1, 3)), radii=np.ones(1), racks=np.zeros((0, 5), np.int64), u=X, v=Y, w=Z,
        counts=np.array([2, 2, 2]), start=np.zeros(3, np.int64),
    )  # fmt: skip
    with pytest.raises(ArgumentError, match="beams"):
        nearest(lonely, (0, 0, 0))
    assert len(find_beams(lonely, [(0, 0, 0)], 1.0, "descent")) == 0
    assert contains(lonely, (0.5, 0.5, 0.5))


def test_something_else_than_a_steady_skeleton_is_refused() -> None:
    for ask in (lambda s: find_beams(s, [(0, 0, 0)], 1.0), lambda s: nearest(s, (0, 0, 0)), conditions):
        with pytest.raises(ArgumentTypeError, match="skeleton"):
            ask("lattice")
