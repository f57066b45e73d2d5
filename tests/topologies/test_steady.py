"""Steady lattices as users meet them: what is accepted, regions, filters against direct enumeration (O14), streaming."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import frep
from frep import ArgumentError, ArgumentTypeError
from frep.rangefinder import meets
from tests.steady_cases import CUBIC, KINDS, X, Y, Z, all_beams, clusters, figure_6_3, lattice
from topologies.steady import (
    FilteredLattice,
    Screw,
    Similarity,
    SteadyLattice,
    Swirl,
    Translation,
    implicit,
    lattice_in_lattice,
    stencil,
)

RNG = np.random.default_rng(5)


def rows(blocks) -> set[tuple[int, ...]]:
    """Beams as a set; none may come twice."""
    beams = [tuple(row) for block in blocks for row in block.tolist()]
    assert len(beams) == len(set(beams))
    return set(beams)


# --- making one ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nodes": [(0, 0)]}, r"nodes: expected a non-empty \(n, 3\) array"),
        ({"nodes": [(0, 0, math.nan)]}, "nodes: expected finite numbers, row 0"),
        ({"radii": 0.0}, "radii: expected finite radii > 0 mm, node 0 has 0"),
        ({"radii": -0.1}, "radii: expected finite radii > 0"),
        ({"radii": [0.1, 0.2]}, "radii: expected one number or one for each of 1 nodes"),
        ({"racks": [(0, 1, 1, 0, 0)]}, r"racks: node numbers must lie in 0..0"),
        ({"racks": [(0, 0, 0, 0, 0)]}, "racks: rack 0 joins node 0 to itself"),
        (
            {"racks": [(0, 0, 1, 0, 0), (0, 0, 0, -5, 0)]},
            r"rack 1 with offset \(0, -5, 0\) leaves a brick of \(4, 5, 6\)",
        ),
        ({"racks": [(0, 0)]}, "racks: expected whole numbers of shape"),
        ({"racks": [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 1, 0, 0)]}, "racks: racks 0 and 2 are the same beams"),
        ({"racks": [(0, 0, 1, 0, 0), (0, 0, -1, 0, 0)]}, "racks: racks 0 and 1 are the same beams"),
        ({"u": Screw(2 * math.pi)}, "u: Screw.* moves no node"),
        ({"v": Similarity.identity()}, "v: .* moves no node"),
        (
            {"u": Swirl(2, (5, 0, 0)), "counts": (3000, 1, 1), "racks": CUBIC[:1]},
            "counts: a scale of 2 to the power 2999",
        ),
        ({"counts": (4, 0, 6)}, "counts: expected at least 1"),
        ({"counts": (4, -1, 6)}, "counts: expected at least 1"),
        ({"counts": (1, 2, 3, 4)}, "counts: expected one to three"),
        ({"radii": [1.1], "u": Swirl(0.4, (-1, 0, 0))}, "lies inside node 0 of cluster"),
    ],
)
def test_bad_values_are_named(change, message):
    good = {"nodes": [(0, 0, 0)], "radii": 0.1, "racks": CUBIC, "u": X, "v": Y, "w": Z, "counts": (4, 5, 6)}
    with pytest.raises(ArgumentError, match=message):
        SteadyLattice(**{**good, **change})


@pytest.mark.parametrize(
    "change",
    [
        {"u": (1, 0, 0)},
        {"v": None},
        {"counts": (4.5, 5, 6)},
        {"racks": [(0, 0, 0.5, 0, 0)]},
        {"nodes": "abc"},
        {"radii": "x"},
    ],
)
def test_bad_types_are_named(change):
    good = {"nodes": [(0, 0, 0)], "radii": 0.1, "racks": CUBIC, "u": X, "v": Y, "w": Z, "counts": (4, 5, 6)}
    with pytest.raises(ArgumentTypeError, match=next(iter(change))):
        SteadyLattice(**{**good, **change})


def test_a_contained_ball_says_which():
    """Shrinking towards a point inside the ball: the message names both balls, their radii and the distance."""
    with pytest.raises(ArgumentError) as caught:
        lattice(Swirl(0.3, (-1.0, 0, 0)), Similarity.identity(), Similarity.identity(), (4, 1, 1), CUBIC[:1], radii=1.1)
    text = str(caught.value)
    assert "rack 0" in text
    assert "cluster (1, 0, 0), radius 0.33 mm" in text
    assert "cluster (0, 0, 0), radius 1.1 mm" in text


def test_rows_and_slabs_need_no_more_directions():
    row = SteadyLattice([(0, 0, 0)], 0.1, [(0, 0, 1)], u=X, counts=5)
    slab = SteadyLattice([(0, 0, 0)], 0.1, [(0, 0, 1), (0, 0, 1, 1)], u=X, v=Y, counts=(5, 4))
    assert (row.n_nodes, row.n_beams) == (5, 4)
    assert (slab.n_nodes, slab.n_beams) == (20, 16 + 12)


def test_cumulative_similarities_reach_the_last_cluster():
    total = Swirl(2.0, (-3, 0, 0), 1.0), Screw(4.0, "x", (0, 5, 0), pitch=3.0), Translation((0, 0, 7))
    for counts in ((5, 4, 3), (9, 2, 8)):
        case = SteadyLattice.spanning([(1, 2, 3)], 0.01, CUBIC, *total, counts=counts)
        last = case.balls(*(n - 1 for n in counts))[0][0]
        assert np.allclose(last, (total[2] @ total[1] @ total[0]).apply((1, 2, 3)), atol=1e-12)


def test_counts_of_beams_are_exact_whole_numbers():
    huge = lattice(X, Y, Z, (10**7, 10**7, 10**7), [(0, 0, 1, 0, 0), (0, 0, -2, 3, 1)])
    n = 10**7
    assert huge.n_beams == (n - 1) * n * n + (n - 2) * (n - 3) * (n - 1)


# --- regions and blocks ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_blocks_hold_every_beam_once(kind):
    case = KINDS[kind]()
    expected = {tuple(row) for row in all_beams(case.skeleton).tolist()}
    assert rows(case.beams()) == expected
    assert rows(case.beams(block=7)) == expected
    ends, radii = case.ends(np.array(sorted(expected)))
    centers, sizes = case.balls(*np.array(sorted(expected))[:, :3].T)
    start = case.racks[np.array(sorted(expected))[:, 3], 0]
    assert np.allclose(ends[:, 0], centers[np.arange(len(start)), start])
    assert np.allclose(radii[:, 0], sizes[np.arange(len(start)), start])


def test_a_region_keeps_indices_and_drops_what_reaches_out():
    case = figure_6_3()
    part = case.region((2, 3, 4), (4, 5, 6))
    inside = {
        tuple(row)
        for row in all_beams(case.skeleton).tolist()
        if all(
            lo <= a < lo + n and lo <= b < lo + n
            for a, b, lo, n in zip(row[:3], np.add(row[:3], case.racks[row[3], 2:]), (2, 3, 4), (4, 5, 6), strict=True)
        )
    }
    assert rows(part.beams()) == inside
    assert part.n_beams == len(inside)
    assert np.array_equal(part.balls(3, 4, 5)[0], case.balls(3, 4, 5)[0])
    for start, span in (((0, 0, 0), (8, 1, 1)), ((-1, 0, 0), (1, 1, 1)), ((6, 0, 0), (2, 1, 1))):
        with pytest.raises(ArgumentError, match="reaches out of the lattice"):
            case.region(start, span)
    with pytest.raises(ArgumentError, match="span"):
        case.region((0, 0, 0), (0, 1, 1))


def test_selecting_racks_keeps_nodes():
    case = figure_6_3().select([0, 2])
    assert case.n_nodes == figure_6_3().n_nodes
    assert np.array_equal(case.racks, figure_6_3().racks[[0, 2]])
    with pytest.raises(ArgumentError, match="racks"):
        case.select([2])


def test_beams_and_nodes_meeting_a_ball():
    """O8: brute force on the Fig 6.3 lattice, with the ball at N[3, 5, 7] and radius 0.6."""
    case = figure_6_3()
    center = case.balls(3, 5, 7)[0][0]
    assert len(case.beams_meeting(center, 0.6)) == 16
    assert len(case.nodes_meeting(center, 0.6)) == 2


@pytest.mark.parametrize(
    ("center", "radius", "message"),
    [
        ((0, 0), 1.0, "center"),
        ([(0, 0, 0), (1, 1, 1)], 1.0, "center"),
        ((0, 0, math.inf), 1.0, "center"),
        ("here", 1.0, "center"),
        ((0, 0, 0), -1.0, "radius"),
        ((0, 0, 0), math.nan, "radius"),
        ((0, 0, 0), [1.0, 2.0], "radius"),
        ((0, 0, 0), None, "radius"),
    ],
)
def test_queries_of_nonsense_name_the_argument(center, radius, message):
    case = figure_6_3()
    for ask in (case.beams_meeting, case.nodes_meeting):
        with pytest.raises((ArgumentError, ArgumentTypeError), match=f"^{message}"):
            ask(center, radius)


def test_beams_that_are_not_there_are_named():
    case = figure_6_3()
    for row in ((0, 0, 0, 4), (0, 0, 0, -1), (6, 0, 0, 0), (7, 0, 0, 1)):
        with pytest.raises(ArgumentError, match="is no beam of this lattice"):
            case.ends([(0, 0, 0, 0), row])


def test_models_are_saved_and_loaded(tmp_path):
    case = figure_6_3().region((1, 2, 3), (4, 5, 6))
    case.save(tmp_path / "figure.json")
    again = SteadyLattice.load(tmp_path / "figure.json")
    assert again.skeleton.content_key == case.skeleton.content_key


def test_a_lattice_of_balls_alone():
    case = SteadyLattice([(0, 0, 0)], 0.4, [], X, Y, Z, (3, 3, 3))
    assert (case.n_beams, case.n_nodes) == (0, 27)
    assert np.all(case.contains([[1, 1, 1.3], [0.5, 0, 0], [2, 2, 2.39]]) == [True, False, True])
    assert list(case.beams()) == []


# --- filters -------------------------------------------------------------------------------------------------------------


def kept_by(case: SteadyLattice, keep) -> set[tuple[int, ...]]:
    """Direct enumeration: a beam stays when `keep(cluster, node)` holds for both ends."""
    found = set()
    for i, j, k, rack in all_beams(case.skeleton).tolist():
        start, end, *offset = case.racks[rack].tolist()
        if keep((i, j, k), start) and keep(tuple(np.add((i, j, k), offset)), end):
            found.add((i, j, k, rack))
    return found


@pytest.mark.parametrize("kind", ["two nodes", "figure 6.3", "region", "many turns"])
def test_stencils_are_direct_enumeration(kind):
    case = KINDS[kind]()
    for shape in ((2, 3, 2), (3, 1, 4), (2, 2, 2, len(case.nodes))):
        pattern = RNG.random(shape) < 0.6

        def keep(cluster, node, pattern=pattern):
            index = tuple(i % s for i, s in zip(cluster, pattern.shape[:3], strict=True))
            return pattern[index] if pattern.ndim == 3 else pattern[(*index, node)]

        expected = kept_by(case, keep)
        assert rows(case.filtered(stencil(pattern)).blocks()) == expected
        assert rows(case.filtered(stencil(pattern)).blocks(block=5)) == expected


def cone_distance(point: np.ndarray, a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> float:
    """Distance to the hull of two balls, by minimising over the balls between: an independent formula."""
    t = np.linspace(0.0, 1.0, 4001)[:, None]
    return float(np.min(np.linalg.norm(a + t * (b - a) - point, axis=1) - (ra + t[:, 0] * (rb - ra))))


def test_lattice_in_lattice_is_the_brute_node_test():
    fine = lattice(
        Translation((0.5, 0, 0)), Screw(0.1, "z", (-4, 0, 0)), Translation((0, 0, 0.5)), (9, 12, 7), radii=0.05
    )
    coarse = lattice(
        Translation((2, 0, 0)), Screw(0.4, "z", (-4, 0, 0)), Swirl(0.8, (-4, 0, 6), 0.1), (3, 4, 2), radii=0.35
    )
    ends, radii = coarse.ends(all_beams(coarse.skeleton))
    where = {}
    for cluster in clusters(fine.skeleton):
        centers, sizes = fine.balls(*cluster)
        gaps = [cone_distance(centers[0], *e, *r) - sizes[0] for e, r in zip(ends, radii, strict=True)]
        where[tuple(cluster)] = min(gaps)
    assert min(abs(gap) for gap in where.values()) > 1e-5  # none is undecided
    expected = kept_by(fine, lambda cluster, _: where[cluster] < 0)
    assert 0 < len(expected) < fine.n_beams
    filtered = fine.filtered(lattice_in_lattice(coarse))
    assert rows(filtered.blocks()) == expected
    assert filtered.count() == len(expected)


@pytest.mark.parametrize("step", [0.45, 1.7, 6.0])
@pytest.mark.parametrize("kind", ["regular", "two nodes", "swirls", "negative turns", "figure 6.3", "region"])
def test_nodes_are_kept_that_meet_the_coarse_lattice_by_another_search(kind, step):
    """Blocks of nodes share a query; RangeFinder asks for each node alone. From coarse lattices far finer than a block, many of
    whose beams meet it, to one that is larger than the whole."""
    case = KINDS[kind]()
    low, high = case.bounds
    n = np.minimum(np.ceil((high - low) / step).astype(int) + 1, 30)
    coarse = lattice(*(Translation(step * e) for e in np.eye(3)), n, nodes=[low + 0.1], radii=0.2 * step)
    skeleton = case.skeleton
    mask = lattice_in_lattice(coarse).mask(skeleton, skeleton.start, skeleton.counts)
    centers, radii = skeleton.balls(*clusters(skeleton).T)
    expected = meets(coarse.skeleton, centers.reshape(-1, 3), radii.ravel()).reshape(mask.shape)
    assert np.array_equal(mask, expected)
    assert mask.any()


def test_a_coarse_lattice_that_covers_everything_removes_nothing_and_a_distant_one_all():
    fine = figure_6_3()
    middle = fine.bounds.mean(axis=0)
    size = float(np.ptp(fine.bounds))
    cover = SteadyLattice([middle], 2 * size, [(0, 0, 1)], u=Translation((0.1, 0, 0)), counts=2)
    distant = SteadyLattice([middle + 9 * size], 0.1, [(0, 0, 1)], u=X, counts=2)
    assert fine.filtered(lattice_in_lattice(cover)).count() == fine.n_beams
    assert fine.filtered(lattice_in_lattice(distant)).count() == 0
    assert list(fine.filtered(lattice_in_lattice(distant)).blocks()) == []


def test_implicit_filters_take_solids_fields_and_functions():
    case = lattice(X, Y, Z, (9, 9, 9))
    expected = kept_by(case, lambda cluster, _: np.linalg.norm(np.subtract(cluster, 4)) < 3.3)
    x, y, z = frep.coordinates()
    for shape in (
        frep.sphere((4, 4, 4), 3.3),
        frep.sqrt((x - 4) ** 2 + (y - 4) ** 2 + (z - 4) ** 2) - 3.3,
        lambda x, y, z: np.sqrt((x - 4) ** 2 + (y - 4) ** 2 + (z - 4) ** 2) - 3.3,
    ):
        assert rows(case.filtered(implicit(shape)).blocks()) == expected


def test_a_small_shape_in_a_huge_lattice_is_found_without_looking_everywhere():
    """Blocks that cannot hold a node of the shape are passed over: 1e9 clusters, a second."""
    huge = lattice(X, Y, Z, (1000, 1000, 1000))
    kept = rows(huge.filtered(frep.sphere((500, 400, 300), 3.3)).blocks())
    small = lattice(X, Y, Z, (9, 9, 9))
    expected = kept_by(small, lambda cluster, _: np.linalg.norm(np.subtract(cluster, 4)) < 3.3)
    assert kept == {(i + 496, j + 396, k + 296, rack) for i, j, k, rack in expected}


def test_filters_combine():
    case = lattice(X, Y, Z, (6, 6, 6))
    even, ball = stencil(np.indices((2, 1, 1)).sum(axis=0) == 0), implicit(frep.sphere((0, 0, 0), 4.2))

    def is_even(c, _):
        return c[0] % 2 == 0

    def in_ball(c, _):
        return np.linalg.norm(c) < 4.2

    for keep, expected in (
        (even & ball, lambda c, n: is_even(c, n) and in_ball(c, n)),
        (even | ball, lambda c, n: is_even(c, n) or in_ball(c, n)),
        (~even & ball, lambda c, n: not is_even(c, n) and in_ball(c, n)),
    ):
        assert rows(case.filtered(keep).blocks()) == kept_by(case, expected)


def test_lattice_in_a_filtered_lattice_meets_only_its_beams():
    """Beams of beams of beams: what a filter has taken from the coarse lattice takes no part."""
    fine = lattice(
        Translation((0.25, 0, 0)), Translation((0, 0.25, 0)), Translation((0, 0, 0.25)), (17, 17, 9), radii=0.02
    )
    coarse = lattice(Translation((2, 0, 0)), Translation((0, 2, 0)), Translation((0, 0, 2)), (3, 3, 2), radii=0.3)
    plane = coarse.filtered(stencil(np.indices((1, 1, 2))[2] == 0))  # the layer k = 0 alone
    kept = rows(fine.filtered(lattice_in_lattice(plane)).blocks())
    flat = SteadyLattice([(0, 0, 0)], 0.3, CUBIC[:2], coarse.u, coarse.v, counts=(3, 3))
    assert kept == rows(fine.filtered(lattice_in_lattice(flat)).blocks())
    assert kept < rows(fine.filtered(lattice_in_lattice(coarse)).blocks())


def test_what_is_left_is_a_solid():
    """Two parallel rows of a slab, by stencil: capsules of known volume."""
    slab = lattice(X, Translation((0, 2, 0)), Similarity.identity(), (5, 3, 1), CUBIC[:1], radii=0.25)
    left = slab.filtered(stencil([[[True], [False]]]))
    nodes, radii, edges = left.explicit()
    assert (len(nodes), len(edges)) == (10, 8)
    assert np.all(radii == 0.25)
    capsule = math.pi * 0.25**2 * 4 + 4 / 3 * math.pi * 0.25**3
    assert left.solid().mesh(voxel=0.05, polish=True).volume == pytest.approx(2 * capsule, rel=5e-3)
    assert left.graph().skeleton.edges.shape == (8, 2)
    with pytest.raises(ArgumentError, match="leaves no beam"):
        slab.filtered(stencil([[[False]]])).explicit()


def test_blocks_are_streamed():
    """A filtered lattice of 1e9 beams yields its first block at once."""
    huge = lattice(X, Y, Z, (1000, 1000, 1000)).filtered(stencil([[[True]], [[False]]]))
    first = list(itertools.islice(huge.blocks(block=1000), 3))
    assert all(0 < len(block) <= 3000 for block in first)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: stencil([[True]]), ArgumentError, "pattern: expected a non-empty"),
        (lambda: stencil([[[0.5]]]), ArgumentTypeError, "pattern: expected booleans"),
        (lambda: stencil([[[1, 2]]]), ArgumentTypeError, "pattern: expected booleans"),
        (lambda: stencil([[[True], [True, False]]]), ArgumentError, "pattern"),
        (lambda: figure_6_3().filtered(5), ArgumentTypeError, "keep: expected a filter"),
        (lambda: stencil([[[True]]]) & 5, TypeError, "unsupported operand"),
        (lambda: figure_6_3().filtered(stencil(np.ones((1, 1, 1, 3), bool))).count(), ArgumentError, "pattern: has 3"),
        (lambda: lattice_in_lattice("coarse"), ArgumentTypeError, "coarse: expected a SteadyLattice"),
        (lambda: list(FilteredLattice(figure_6_3(), None).blocks(0)), ArgumentError, "block"),
    ],
)
def test_bad_filters_are_named(make, error, message):
    with pytest.raises(error, match=message):
        make()
