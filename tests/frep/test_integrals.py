"""Integral properties of steady lattices: sums over hubs against every hub one by one, closed forms, invariances, clean tests."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frep.errors import ArgumentError
from frep.hubs import cone_beam, hub_moments, hub_rows, moment_matrices
from frep.integrals import _points, _weights, clean_report, integrals
from frep.overlaps import beam_gaps
from frep.similarity import Screw, Similarity, Swirl, Translation
from frep.steady import SteadySkeleton
from topologies.steady import SteadyLattice

CUBIC = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
BRACED = [*CUBIC, (0, 0, 1, 1, 0), (0, 0, 1, 0, -1)]
TWO_NODES = [(0, 1, 0, 0, 0), (1, 0, 1, 0, 0), (1, 0, 0, 1, 0), (1, 0, 0, 0, 1), (0, 0, 1, 0, 0), (1, 1, 0, -1, 1)]
UNIT = (Translation((1, 0, 0)), Translation((0, 1, 0)), Translation((0, 0, 1)))


def lattice(nodes, radii, racks, steps, counts, start=(0, 0, 0)):
    return SteadySkeleton(
        nodes=np.array(nodes, dtype=float),
        radii=np.array(radii, dtype=float),
        racks=np.array(racks, dtype=np.int64).reshape(-1, 5),
        u=steps[0],
        v=steps[1],
        w=steps[2],
        counts=np.array(counts),
        start=np.array(start),
    )


def every_hub(skeleton):
    """Volume, area, centroid and inertia by looking at every hub of the lattice."""
    n = len(skeleton.nodes)
    ranges = [range(s, s + c) for s, c in zip(skeleton.start, skeleton.counts, strict=True)]
    clusters = np.array(list(itertools.product(*ranges)))
    number = {tuple(c): m for m, c in enumerate(clusters.tolist())}
    neighbours = [set() for _ in range(len(clusters) * n)]
    for start, end, *offset in skeleton.racks.tolist():
        for cluster, m in number.items():
            there = number.get(tuple(np.add(cluster, offset)))
            if there is not None:
                neighbours[m * n + start].add(there * n + end)
                neighbours[there * n + end].add(m * n + start)
    centers, radii = skeleton.balls(*clusters.T)
    centers, radii = centers.reshape(-1, 3), radii.ravel()
    first = np.cumsum([0, *map(len, neighbours)])
    other = np.array([e for s in neighbours for e in sorted(s)], dtype=int)
    own = np.repeat(np.arange(len(neighbours)), np.diff(first))
    rows = hub_rows(radii, first, (centers[other] - centers[own]).reshape(-1, 3), radii[other])
    assert rows[:, 1].max() <= 0
    origin = centers.mean(axis=0)
    moments = moment_matrices(rows[:, 4:])
    shift = np.tile(np.eye(4), (len(centers), 1, 1))
    shift[:, :3, 3] = centers - origin
    moment = (shift @ moments @ shift.transpose(0, 2, 1)).sum(axis=0)
    center = moment[:3, 3] / moment[3, 3]
    second = moment[:3, :3] - moment[3, 3] * np.outer(center, center)
    return moment[3, 3], rows[:, 0].sum(), origin + center, np.trace(second) * np.eye(3) - second


def assert_equal_sums(skeleton, rel=1e-12):
    found = integrals(skeleton, check=False)
    volume, area, centroid, inertia = every_hub(skeleton)
    size = math.sqrt(np.trace(inertia) / 2 / volume)
    assert found.volume == pytest.approx(volume, rel=rel)
    assert found.area == pytest.approx(area, rel=rel)
    assert found.centroid == pytest.approx(centroid, rel=rel, abs=rel * size)
    assert found.inertia == pytest.approx(inertia, rel=rel, abs=rel * np.abs(inertia).max())
    assert found.spherical_inertia == pytest.approx(np.trace(inertia) / 2, rel=rel)
    assert found.n_hubs == len(skeleton.nodes) * int(np.prod(skeleton.counts))
    return found


# --- against every hub -------------------------------------------------------------------------------------------------

BENT = (Swirl(1.02, (-30, 0, 0)), Screw(0.03, "z", (-33, 0, 0)), Swirl(0.98, (3, 2, 40), 0.02, "x"))
KINDS = {
    "regular": lattice([[0, 0, 0]], [0.1], CUBIC, UNIT, (5, 4, 3)),
    "single clusters": lattice([[0, 0, 0]], [0.1], CUBIC, UNIT, (1, 4, 1), (3, -2, 5)),
    "one cluster": lattice([[0, 0, 0], [0.5, 0.5, 0.5]], [0.06, 0.05], TWO_NODES, UNIT, (1, 1, 1)),
    "oblique": lattice(
        [[0, 0, 0]],
        [0.05],
        BRACED,
        (Translation((1, 0.1, 0)), Translation((0.2, 1, 0)), Translation((0, 0.3, 1))),
        (5, 4, 6),
        (1, 2, 3),
    ),
    "cylinder": lattice([[10, 0, 0]], [0.1], BRACED, (UNIT[2], Screw(0.1), Swirl(1.1)), (5, 4, 6), (1, 2, 3)),
    "screws": lattice(
        [[10, 0, 0], [10.4, 0.5, 0.4]],
        [0.05, 0.04],
        TWO_NODES[:4],
        (UNIT[0], Screw(0.1, pitch=0.1), Screw(0.02, "x", (0, -30, 5), 1.0)),
        (3, 4, 3),
    ),
    "swirls": lattice([[0, 0, 0], [0.5, 0.5, 0.5]], [0.06, 0.05], TWO_NODES, BENT, (6, 5, 4), (-2, 1, 0)),
    "long offsets": lattice([[0, 0, 0]], [0.03], [(0, 0, 2, 1, 0), (0, 0, -1, 0, 3)], BENT, (5, 4, 5), (-1, 0, 2)),
    "no beams": lattice([[0, 0, 0], [0.5, 0.5, 0.5]], [0.1, 0.2], [], BENT, (3, 2, 4)),
    "the same rack twice": lattice([[0, 0, 0]], [0.1], [*CUBIC, (0, 0, -1, 0, 0)], BENT, (3, 3, 3)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_against_every_hub(kind):
    assert_equal_sums(KINDS[kind])


@pytest.mark.parametrize("seed", range(6))
def test_random_lattices_against_every_hub(seed):
    """Directions that nearly are a unit grid, turned, scaled and moved at random; they commute with nothing."""
    rng = np.random.default_rng(seed)

    def step(direction):
        frame = np.eye(4)
        frame[:3, :3] = math.exp(rng.normal(0, 0.02)) * Screw(rng.normal(0, 0.03), rng.normal(size=3)).rotation
        frame[:3, 3] = direction + rng.normal(0, 0.05, 3)
        return Similarity.from_matrix(frame)

    steps = tuple(step(d) for d in np.eye(3))
    assert_equal_sums(lattice([[0, 0, 0]], [0.03], BRACED, steps, rng.integers(1, 6, 3), rng.integers(-3, 4, 3)))


@pytest.mark.parametrize(
    ("counts", "start"), [((40, 45, 3), (0, 0, 0)), ((3, 70, 2), (1, -30, 0)), ((50, 2, 3), (0, 0, 5))]
)
def test_polynomials_through_chebyshev_points(counts, start):
    """Ranges long enough that hubs are not all evaluated, along i, j or both, with faces, edges and corners."""
    steps = (Swirl(1.004, (-90, 0, 0)), Screw(0.012, "z", (-83, 0, 0)), Swirl(0.99, (3, 2, 70), 0.01, "x"))
    found = assert_equal_sums(lattice([[0, 0, 0]], [0.06], BRACED, steps, counts, start))
    assert found.error <= 1e-12


@given(count=st.integers(2, 100_000), order=st.sampled_from([5, 9, 17, 33]), first=st.integers(-1000, 1000))
def test_sums_of_polynomials_are_exact(count, order, first):
    degree = min(order, count) - 1
    middle, half = first + (count - 1) / 2, max((count - 1) / 2, 1)

    def polynomial(x):
        t = (x - middle) / half
        return 1 + t + t ** (degree // 2 * 2) + 3 * t**degree

    points = _points(first, first + count, order)
    expected = math.fsum(polynomial(np.arange(first, first + count, dtype=float)))
    assert _weights(count, order) @ polynomial(points) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("scale", [1.0, 1 + 1e-12, 1 - 1e-12, 1.02, 0.97])
@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_a_row_is_a_sum_of_powers(scale, count):
    """Near scale 1 the naive geometric sum loses half the digits."""
    step = Swirl(scale, (3, 0, 2), 0.1, (1, -1, 0))
    skeleton = lattice([[0, 0, 0]], [0.05], [], (Similarity.identity(), Similarity.identity(), step), (1, 1, count))
    found = assert_equal_sums(skeleton)
    assert found.hubs_evaluated == 1
    assert found.error == 0


# --- closed forms ------------------------------------------------------------------------------------------------------


def test_a_billion_cubic_hubs():
    n, r = 1000, 0.2
    found = integrals(lattice([[0, 0, 0]], [r], CUBIC, UNIT, (n, n, n)))
    ends = np.vstack([np.eye(3), -np.eye(3)])
    inside = 3 * math.pi * r**2 - 8 * math.sqrt(2) * r**3, 6 * math.pi * r - 24 * math.sqrt(2) * r**2
    face, edge, corner = (hub_moments(r, ends[:m], [r] * m) for m in (5, 4, 3))
    sums = [
        (n - 2) ** 3 * a + 6 * (n - 2) ** 2 * b + 12 * (n - 2) * c + 8 * d
        for a, b, c, d in (
            (inside[0], face.volume, edge.volume, corner.volume),
            (inside[1], face.area, edge.area, corner.area),
        )
    ]
    assert (found.volume, found.area) == pytest.approx(sums, rel=1e-12)
    assert found.centroid == pytest.approx([(n - 1) / 2] * 3)
    assert found.inertia == pytest.approx(np.eye(3) * found.inertia[0, 0], abs=1e-12 * found.inertia[0, 0])
    assert (found.n_hubs, found.hubs_evaluated, found.error) == (n**3, 27, 0)


def test_a_straight_row_is_one_rod():
    skeleton = lattice([[0, 0, 0]], [0.2], [(0, 0, 1, 0, 0)], UNIT, (10**6, 1, 1))
    found = integrals(skeleton)
    volume, area = cone_beam(10**6 - 1, 0.2, 0.2)
    assert (found.volume, found.area) == pytest.approx((volume, area), rel=1e-12)
    assert found.centroid == pytest.approx([(10**6 - 1) / 2, 0, 0])


def test_the_balls_of_the_published_lattice():
    """The numeric lattice of Constructive Lattice Geometry, Fig 6.3; balls only, their overlaps counted twice."""
    steps = (
        Swirl(1.187, (-3.333, 0, 0)),
        Screw(0.285, "z", (-1.555, 0.003, 0)),
        Swirl(0.953, (10.872, 0, 0.039), 0.224, "y"),
    )
    skeleton = lattice([[0, 0, 0]], [0.0645], [], steps, (7, 12, 15))
    centers, radii = skeleton.balls(6, 11, 14)
    assert centers[0] == pytest.approx([21.05085999, 0.02840919, 0.1158054], rel=1e-6)
    assert radii[0] == pytest.approx(0.0919527321, rel=1e-8)
    found = integrals(skeleton, check=False)
    assert (found.volume, found.area) == pytest.approx((4.701296279, 127.9855736), rel=1e-9)


def test_cost_does_not_depend_on_counts():
    """A bent and graded slab whose directions commute: nine families, a hub each."""
    steps = (Swirl(1 + 1e-4, (-1e4, 0, 0)), Screw(1e-4, point=(-1e4, 0, 0)), Similarity.identity())
    for n in (3, 5, 5000):
        found = integrals(lattice([[0, 0, 0]], [0.1], CUBIC[:2], steps, (n, n, 1)))
        assert (found.n_hubs, found.hubs_evaluated, found.error) == (n * n, 9, 0)


def test_a_trillion_hubs_that_all_differ():
    n = 10_000
    steps = (Swirl(1 + 1e-5, (-1e5, 0, 0)), Screw(2e-5, point=(-5e4, 0, 0)), Screw(1e-5, "x", (0, -1e5, 0)))
    found = integrals(lattice([[0, 0, 0]], [0.06], BRACED, steps, (n, n, n)))
    assert found.error <= 1e-12
    assert found.hubs_evaluated < n**2 / 100


@pytest.mark.parametrize("kind", ["oblique", "cylinder", "swirls"])
def test_against_samples_of_the_field(kind):
    """The solid of the same lattice, whose volume comes from its signed field on a grid."""
    s = KINDS[kind]
    steady = SteadyLattice(s.nodes, s.radii, s.racks, s.u, s.v, s.w, counts=s.counts, start=s.start)
    assert integrals(steady.skeleton).volume == pytest.approx(steady.solid().volume(0.02), rel=2e-3)


# --- invariances -------------------------------------------------------------------------------------------------------


def moved(skeleton, motion):
    """The lattice moved by a similarity."""
    steps = [
        Similarity.from_matrix(motion.matrix @ s.matrix @ motion.inverse().matrix)
        for s in (skeleton.u, skeleton.v, skeleton.w)
    ]
    return lattice(
        motion.apply(skeleton.nodes),
        motion.scale * skeleton.radii,
        skeleton.racks,
        steps,
        skeleton.counts,
        skeleton.start,
    )


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), scale=st.floats(0.1, 10), kind=st.sampled_from(["oblique", "cylinder", "swirls"]))
def test_a_moved_lattice(seed, scale, kind):
    rng = np.random.default_rng(seed)
    motion = Swirl(scale, rng.normal(0, 10, 3), rng.normal(), rng.normal(size=3)) @ Translation(rng.normal(0, 10, 3))
    before, after = integrals(KINDS[kind]), integrals(moved(KINDS[kind], motion))
    rotation = motion.rotation
    assert after.volume == pytest.approx(scale**3 * before.volume, rel=1e-9)
    assert after.area == pytest.approx(scale**2 * before.area, rel=1e-9)
    assert after.centroid == pytest.approx(motion.apply(before.centroid), rel=1e-9, abs=1e-9 * scale)
    inertia = scale**5 * rotation @ before.inertia @ rotation.T
    assert after.inertia == pytest.approx(inertia, rel=1e-9, abs=1e-9 * np.abs(inertia).max())


@settings(max_examples=20)
@given(shift=st.integers(-20, 20))
def test_slabs_further_on_are_similar(shift):
    """W^shift takes the clusters from k to those from k + shift."""
    here, there = (
        integrals(lattice([[0, 0, 0]], [0.06], BRACED, BENT, (3, 12, 4), (0, 0, k)), check=False) for k in (0, shift)
    )
    step = BENT[2].power(shift)
    assert there.volume == pytest.approx(step.scale**3 * here.volume, rel=1e-11)
    assert there.centroid == pytest.approx(step.apply(here.centroid), rel=1e-9)
    assert there.spherical_inertia == pytest.approx(step.scale**5 * here.spherical_inertia, rel=1e-10)


# --- clean lattices ----------------------------------------------------------------------------------------------------


def test_clean_lattices_are_clean():
    for kind in ("regular", "oblique", "cylinder", "swirls"):
        report = clean_report(KINDS[kind])
        assert (report.is_clean, report.overlap) == (True, 0), (kind, report.message)


def test_hubs_that_overlap():
    """A braced square: two cylinders at 45 degrees whose seam passes the middle of the shorter beam."""
    r = 0.25
    skeleton = lattice([[0, 0, 0]], [r], [(0, 0, 1, 0, 0), (0, 0, 1, 1, 0)], UNIT, (1000, 1000, 1))
    depth = r / math.tan(math.pi / 8) - 0.5
    report = clean_report(skeleton)
    assert not report.is_clean
    assert report.overlap == pytest.approx(depth)
    with pytest.raises(ArgumentError, match=r"at node 0 of cluster .* overlap 0\.1036 mm .*volume\(voxel\)"):
        integrals(skeleton)


def test_hubs_that_touch_are_clean():
    assert clean_report(lattice([[0, 0, 0]], [0.5], CUBIC[:2], UNIT, (4, 4, 1))).is_clean


def test_beams_that_cross():
    """Both diagonals of each square cross in its middle, where no node joins them."""
    skeleton = lattice([[0, 0, 0]], [0.05], [(0, 0, 1, 1, 0), (0, 0, 1, -1, 0)], UNIT, (100, 100, 1))
    report = clean_report(skeleton)
    assert not report.is_clean
    assert report.overlap == pytest.approx(0.1)
    with pytest.raises(ArgumentError, match=r"the beam from node 0 .* overlap by 0\.1 mm"):
        integrals(skeleton)
    assert integrals(skeleton, check=False).volume > 0


def test_a_ring_that_laps_itself():
    """62 clusters of 0.1 rad fall short of a turn; with the 64th the row lies on its own beginning."""
    ring = [
        clean_report(lattice([[10, 0, 0]], [0.1], [CUBIC[0]], (Screw(0.1), *UNIT[1:]), (n, 1, 1))) for n in (62, 64)
    ]
    assert [r.is_clean for r in ring] == [True, False]


def test_balls_that_overlap():
    report = clean_report(lattice([[0, 0, 0]], [0.6], [], UNIT, (3, 3, 3)))
    assert not report.is_clean
    assert report.overlap == pytest.approx(0.2)
    assert "the ball of node 0" in report.message
    assert clean_report(lattice([[0, 0, 0]], [0.4], [], UNIT, (3, 3, 3))).is_clean


def test_a_ball_on_a_beam():
    nodes = [[0, 0, 0], [0, 0.5, 0.2]]
    report = clean_report(lattice(nodes, [0.1, 0.15], [(0, 0, 0, 1, 0)], UNIT, (2, 2, 2)))
    assert report.overlap == pytest.approx(0.05)


def test_a_ball_inside_another_is_refused():
    skeleton = lattice([[0, 0, 0], [0.5, 0, 0]], [0.1, 0.7], [(0, 1, 0, 0, 0)], UNIT, (2, 2, 2))
    with pytest.raises(ArgumentError, match=r"node 0 of cluster .* radius 0\.1 mm and node 1 .* 0\.5 mm apart"):
        integrals(skeleton)


# --- gaps between beams ------------------------------------------------------------------------------------------------


def _pair(a, b):
    return (np.array(a, dtype=float)[None], np.array(b, dtype=float)[None])


@pytest.mark.parametrize(
    ("a", "b", "gap"),
    [
        ([[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]], 1 - 0.3),  # parallel
        ([[0, 0, 0], [1, 0, 0]], [[0.5, -1, 0.4], [0.5, 1, 0.4]], 0.4 - 0.3),  # crossing
        ([[0, 0, 0], [1, 0, 0]], [[3, 0, 0], [4, 0, 0]], 2 - 0.3),  # in line
        ([[0, 0, 0], [1, 0, 0]], [[0.5, 0, 0], [0.5, 0, 0]], -0.3),  # a ball on the axis
    ],
)
def test_gaps_of_cylinders(a, b, gap):
    a, b = _pair(a, b)
    assert beam_gaps(a, np.array([[0.1, 0.1]]), b, np.array([[0.2, 0.2]]))[0] == pytest.approx(gap)
    assert beam_gaps(b, np.array([[0.2, 0.2]]), a, np.array([[0.1, 0.1]]))[0] == pytest.approx(gap)


@given(seed=st.integers(0, 10**6))
def test_gaps_against_balls(seed):
    """A beam is the union of the balls between its ends."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 1, 2, 3))
    ra, rb = rng.uniform(0.01, 0.8, size=(2, 1, 2))
    n = 200
    t = np.linspace(0, 1, n + 1)
    p, q = (e[0, 0] + t[:, None] * (e[0, 1] - e[0, 0]) for e in (a, b))
    r, s = (e[0, 0] + t * (e[0, 1] - e[0, 0]) for e in (ra, rb))
    sampled = (np.linalg.norm(p[:, None] - q[None], axis=2) - r[:, None] - s[None]).min()
    gap = beam_gaps(a, ra, b, rb)[0]
    step = sum(np.linalg.norm(e[0, 1] - e[0, 0]) + 0.8 for e in (a, b)) / (2 * n)
    assert sampled - step <= gap <= sampled + 1e-9
    assert beam_gaps(b, rb, a, ra)[0] == pytest.approx(gap, abs=1e-9)
