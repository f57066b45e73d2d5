"""Power diagrams (cells of seeds with radii): all bisectors, known foams, packed balls; Delaunay edges of grids."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, EmptyError
from topologies import beams, power_diagram, stochastic
from topologies import seeds as seeding
from topologies.beams import BeamTopology

UNIT = frep.box((0, 0, 0), (1, 1, 1))
BLOCK = frep.box((-3, 2, 1), (9, 11, 12))
BALL = frep.sphere((1, 2, 3), 10)
SIZE = BLOCK.bounds[1] - BLOCK.bounds[0]
_SIX = [(0.25, 0, 0.5), (0.75, 0, 0.5), (0.5, 0.25, 0), (0.5, 0.75, 0), (0, 0.5, 0.25), (0, 0.5, 0.75)]
A15 = np.array([(0, 0, 0), (0.5, 0.5, 0.5), *_SIX], float)
FCC = np.array([(0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0)])
BCC = np.array([(0, 0, 0), (0.5, 0.5, 0.5)])
GRID = np.array(list(itertools.product((0.0, 0.25, 0.5, 0.75), repeat=3)))


def net(lattice: BeamTopology, size=1.0) -> set[tuple]:
    """The beams of a period, as middles folded into it and directions without sign."""
    found = set()
    for a, b in lattice.skeleton.segments():
        middle = np.mod(np.round(np.mod(0.5 * (a + b), size), 6), size)
        run = np.round(b - a, 6) + 0.0
        found.add((*middle.tolist(), *max(tuple(run.tolist()), tuple((0.0 - run).tolist()))))
    assert len(found) == len(lattice.skeleton.edges)
    return found


def middles(lattice: BeamTopology) -> np.ndarray:
    """Middles of the beams in order: the same for the same edges, however they are listed."""
    found = np.round(lattice.skeleton.segments().mean(axis=1), 6)
    return found[np.lexsort(found.T)]


def powers(points: np.ndarray, seeds: np.ndarray, radii: np.ndarray) -> np.ndarray:
    return ((points[:, None] - seeds) ** 2).sum(axis=2) - radii**2


def images(points: np.ndarray, radii: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    shifts = np.array(list(itertools.product(range(-2, 3), repeat=3))) * size
    return (points + shifts[:, None]).reshape(-1, 3), np.tile(radii, len(shifts))


def quietly(call, *args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", power_diagram.VanishedCellsWarning)
        return call(*args, **options)


# --- power diagrams ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.0, 0.7, 30.0])
@pytest.mark.parametrize("number", [6, 150])
def test_equal_weights_are_none(radius, number):
    """Of seeds in a body and of seeds that repeat: edges, and the distance to the faces."""
    points = seeding.uniform(BLOCK, number, random_state=3)
    same = np.full(number, radius)
    plain, weighted = (stochastic.voronoi(BLOCK, seeds=points, weights=w, connected=False) for w in (None, same))
    assert middles(weighted) == pytest.approx(middles(plain), abs=2e-6)
    plain, weighted = (
        stochastic.voronoi(UNIT, seeds=(points - BLOCK.bounds[0]) / SIZE, weights=w, periodic=True)
        for w in (None, same)
    )
    found, expected = (np.array(sorted(net(v))) for v in (weighted, plain))
    assert found == pytest.approx(expected, abs=2e-6)
    probes = seeding.uniform(BLOCK, 500, random_state=4)
    for periodic in (False, True):
        plain, weighted = (
            stochastic.face_distance(BLOCK, points, weights=w, periodic=periodic)(probes) for w in (None, same)
        )
        assert weighted == pytest.approx(plain, abs=1e-7)


@pytest.mark.parametrize("sites", [A15, FCC, BCC, np.array([(0.1, 0.2, 0.3)]), GRID], ids=len)
def test_equal_weights_of_regular_lattices(sites):
    """Where many seeds lie on one sphere, and Qhull's facets are not simplices."""
    plain = stochastic.voronoi(UNIT, seeds=sites, periodic=True)
    assert net(stochastic.voronoi(UNIT, seeds=sites, weights=np.full(len(sites), 0.4), periodic=True)) == net(plain)


def test_weaire_phelan_foam():
    """Equal cells take a power of c - 5/16 at the 2a sites of A15, c = 32^(-1/3) (with flat faces)."""
    c, u = 32 ** (-1 / 3), 6.0
    radii = u * np.array([math.sqrt(c - 5 / 16)] * 2 + [0.0] * 6)
    box = frep.box((0, 0, 0), (u, u, u))
    foam = stochastic.voronoi(box, seeds=u * A15, weights=radii, periodic=True)
    assert net(foam, u) == net(beams.weaire_phelan(u, equal=True), u)
    assert net(foam, u) != net(beams.weaire_phelan(u, equal=False), u)
    assert foam.check() == []
    # Any power more at every seed is the same diagram.
    more = stochastic.voronoi(box, seeds=u * A15, weights=np.sqrt(radii**2 + 4.0), periodic=True)
    assert net(more, u) == net(foam, u)


def test_two_seeds():
    """The plane is where the powers are equal: half the way, and (r_a^2 - r_b^2) / 2 d on; also beyond a seed."""
    a, b = np.array([0, 5, 6.0]), np.array([4, 7, 10.0])
    d = 6.0
    for ra, rb in ((1.0, 1.0), (3.0, 1.0), (0.0, 2.5), (6.5, 1.0)):
        field = stochastic.face_distance(BLOCK, [a, b], weights=[ra, rb])
        at = 0.5 * d + (ra**2 - rb**2) / (2 * d)
        probes = seeding.uniform(BLOCK, 200, random_state=1)
        along = (probes - a) @ (b - a) / d
        assert field(probes) == pytest.approx(np.abs(along - at), abs=1e-9)


@given(
    seed=st.integers(0, 1000), number=st.integers(2, 40), periodic=st.booleans(), most=st.sampled_from([0.3, 3.0, 9.0])
)
@settings(max_examples=60)
def test_faces_are_those_of_the_least_power(seed, number, periodic, most):
    """Against the planes to all seeds, neighbours or not, of 5 x 5 x 5 periods where they repeat."""
    points = seeding.uniform(BLOCK, number, random_state=seed)
    radii = np.random.default_rng(seed).uniform(0, most, number)
    probes = seeding.uniform(BLOCK, 60, random_state=seed + 1)
    everything, all_radii = images(points, radii, SIZE) if periodic else (points, radii)
    power = powers(probes, everything, all_radii)
    own = power.argmin(axis=1)
    apart = np.linalg.norm(everything - everything[own][:, None], axis=2)
    apart[np.arange(60), own] = np.inf
    # The walls of a seed without a cell do not count: they lie outside the cell of each probe.
    rise = power - power.min(axis=1)[:, None]
    rise[np.arange(60), own] = np.inf
    expected = (rise / (2 * np.where(np.isinf(apart), 1.0, apart))).min(axis=1)
    try:
        field = quietly(stochastic.face_distance, BLOCK, points, weights=radii, periodic=periodic)
    except EmptyError:
        assert len(np.unique(own)) == 1
        return
    near = expected < 15.0  # far from the body's cells those that cut theirs are not looked for
    assert field(probes)[near] == pytest.approx(expected[near], abs=1e-8)


@given(
    seed=st.integers(0, 1000), number=st.integers(5, 60), periodic=st.booleans(), most=st.sampled_from([0.5, 2.0, 6.0])
)
@settings(max_examples=40)
def test_vertices_have_four_least_powers(seed, number, periodic, most):
    """The powers of four seeds are equal at a vertex, those of three at a cut, and no seed has less."""
    points = seeding.uniform(BLOCK, number, random_state=seed)
    radii = np.random.default_rng(seed).uniform(0, most, number)
    try:
        lattice = quietly(stochastic.voronoi, BLOCK, seeds=points, weights=radii, connected=False, periodic=periodic)
    except EmptyError:
        return
    nodes, edges = lattice.skeleton.nodes, lattice.skeleton.edges
    if periodic:
        folded = BLOCK.bounds[0] + np.mod(nodes - BLOCK.bounds[0], SIZE)
        power = np.sort(powers(folded, *images(points, radii, SIZE)), axis=1)
        assert np.ptp(power[:, :4], axis=1) == pytest.approx(0.0, abs=1e-6)
        return
    power = np.sort(powers(nodes, points, radii), axis=1)
    valence = np.bincount(edges.ravel())
    cut = valence == 1
    assert np.abs(BLOCK.field(nodes[cut])).max(initial=0.0) < 1e-6
    assert np.ptp(power[:, :3], axis=1) == pytest.approx(0.0, abs=1e-6)
    assert np.ptp(power[~cut, :4], axis=1) == pytest.approx(0.0, abs=1e-6)
    assert np.all(valence[~cut] == 4)


def test_edges_are_complete():
    """Periodic: V - E + F - C = 0, C the seeds with a cell: as many as a grid of labels finds, or a few more."""
    points = seeding.uniform(UNIT, 300, random_state=2)
    radii = np.random.default_rng(2).uniform(0, 0.12, 300)
    with pytest.warns(power_diagram.VanishedCellsWarning, match=r"weights: \d+ of 300 seeds have no cell") as caught:
        lattice = stochastic.voronoi(UNIT, seeds=points, weights=radii, periodic=True)
    told = int(str(caught[0].message).split()[1])
    probes = np.stack(np.meshgrid(*[(np.arange(60) + 0.5) / 60] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    heights = np.sqrt(radii.max() ** 2 - radii**2)
    labels = power_diagram.Nearest(points, heights, np.zeros(3), np.ones(3))(probes)[1]
    # Every vertex is of four edges. A small cell may slip through the grid.
    found = len(np.unique(labels))
    assert found <= 300 - told <= found + 5
    check = np.random.default_rng(1).choice(len(probes), 300, replace=False)
    brute = powers(probes[check], *images(points, radii, np.ones(3))).argmin(axis=1) % 300
    assert np.array_equal(brute, labels[check])
    # Faces of the neighbours' planes, each counted from both sides; some touch in a corner only at ties.
    wrap = np.ones(3)
    _, _, starts = quietly(lambda: power_diagram.Cells(points, UNIT.bounds, wrap, heights).planes)
    faces = starts[-1] / 2
    edges = len(lattice.skeleton.edges)
    assert edges == 2 * (faces - (300 - told))  # V = E / 2, so E / 2 = F - C


def test_balls_apart_lie_in_their_own_cells():
    """No edge and no wall enters a ball, however unlike the balls are."""
    radii = np.random.default_rng(5).lognormal(-0.1, 0.5, 60)
    points = seeding.packed_balls(BLOCK, radii, random_state=1)
    assert np.all(powers(points, points, radii) + 2 * np.diag(radii**2) >= (radii**2)[:, None] - 1e-9)
    lattice = stochastic.voronoi(BLOCK, seeds=points, weights=radii, connected=False)
    a, b = lattice.skeleton.segments().transpose(1, 0, 2)
    for t in np.linspace(0, 1, 21):
        assert powers(a + t * (b - a), points, radii).min() > -1e-6
    depth = stochastic.face_distance(BLOCK, points, weights=radii)(points)
    assert np.all(depth >= radii - 1e-9)
    # Without weights walls cut balls.
    assert np.any(stochastic.face_distance(BLOCK, points)(points) < radii)


def test_larger_balls_have_larger_cells():
    """A foam with a distribution of sizes: volumes follow those of the balls."""
    radii = np.random.default_rng(6).lognormal(-2.6, 0.4, 60)
    points = seeding.packed_balls(UNIT, radii, random_state=1, periodic=True)
    probes = seeding.uniform(UNIT, 30_000, random_state=2)
    heights = np.sqrt(radii.max() ** 2 - radii**2)
    weighted, plain = (
        np.bincount(power_diagram.Nearest(points, h, np.zeros(3), np.ones(3))(probes)[1], minlength=60)
        for h in (heights, None)
    )
    assert np.corrcoef(weighted, radii**3)[0, 1] > np.corrcoef(plain, radii**3)[0, 1] + 0.1
    assert np.corrcoef(weighted, radii**3)[0, 1] > 0.8


def test_a_hidden_ball_has_no_cell():
    """Deep in a larger one: the diagram is that of the others, and the warning names it."""
    points = seeding.uniform(BALL, 20, random_state=1)
    radii = np.full(20, 0.1)
    radii[0] = 2.0
    more = np.concatenate([points, [points[0] + (1e-5, 0.0, 0.0)]])
    without = stochastic.voronoi(BALL, seeds=points, weights=radii, connected=False)
    with pytest.warns(power_diagram.VanishedCellsWarning, match="1 of 21 seeds have no cell, as seed 20"):
        hidden = stochastic.voronoi(BALL, seeds=more, weights=[*radii, 0.1], connected=False)
    assert middles(hidden) == pytest.approx(middles(without), abs=2e-6)
    with pytest.warns(power_diagram.VanishedCellsWarning, match="1 of 21 seeds") as caught:
        stochastic.face_distance(BALL, more, weights=[*radii, 0.1])
    assert caught[0].filename == __file__
    with pytest.raises(EmptyError, match="weights: one ball"):
        stochastic.voronoi_walls(BALL, 1, seeds=points, weights=[500.0] + [0.0] * 19)


def test_walls_of_a_power_diagram():
    body = frep.box((0, 0, 0), (20, 10, 10))
    foam = stochastic.voronoi_walls(body, 2, seeds=[(5, 5, 5), (15, 5, 5)], weights=[5, 1])
    # The face is at 5 + 5 + 24 / 20 = 11.2.
    assert foam.contains([[10.3, 1, 1], [12.1, 8, 8], [10.1, 5, 5], [12.3, 5, 5]]).tolist() == [
        True,
        True,
        False,
        False,
    ]


# --- packed balls -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("periodic", [False, True])
def test_packed_balls_do_not_meet(periodic):
    radii = np.random.default_rng(1).uniform(0.3, 1.4, 80)
    centres = seeding.packed_balls(BLOCK, radii, random_state=2, periodic=periodic)
    assert BLOCK.contains(centres).all()
    away = centres[:, None] - centres
    if periodic:
        away -= SIZE * np.round(away / SIZE)
    gap = np.linalg.norm(away, axis=2) - radii[:, None] - radii
    assert gap[~np.eye(80, dtype=bool)].min() >= 0.0
    assert np.array_equal(centres, seeding.packed_balls(BLOCK, radii, random_state=2, periodic=periodic))


# --- Delaunay edges of grids ------------------------------------------------------------------------------------------


def crossings(a: np.ndarray, b: np.ndarray, near: float) -> int:
    """Pairs of segments that come nearer than `near` though they share no end, or run along each other."""
    count = 0
    steps = np.linspace(0, 1, 61)
    for i in range(len(a)):
        rest = slice(i + 1, None)
        p, q = a[rest], b[rest] - a[rest]
        on = a[i] + steps[:, None] * (b[i] - a[i])
        t = np.clip(np.einsum("skj,kj->sk", on[:, None] - p, q) / (q**2).sum(axis=1), 0, 1)
        foot = p + t[..., None] * q
        distance = np.linalg.norm(foot - on[:, None], axis=2)
        # Ends that meet are no crossing; elsewhere on the first segment, or on the second, it is one.
        inner = (np.abs(steps - 0.5) < 0.45)[:, None] | (np.abs(t - 0.5) < 0.45)
        count += int(np.any((distance < near) & inner, axis=0).sum())
    return count


def grid_of(name: str) -> np.ndarray:
    sites = {"cubic": [(0, 0, 0)], "bcc": BCC, "fcc": FCC, "a15": A15}[name]
    cells = np.array(list(itertools.product(range(3), repeat=3)))
    points = (cells[:, None] + np.array(sites)).reshape(-1, 3)
    return points[np.all(points <= 2, axis=1)]


@pytest.mark.parametrize("name", ["cubic", "bcc", "fcc", "a15"])
@pytest.mark.parametrize("turned", [False, True])
def test_delaunay_edges_of_a_grid_do_not_cross(name, turned):
    """Cut up in different ways on the two sides of a face, they did; nearest neighbours are joined in any case."""
    points = 2.0 * grid_of(name) - 2
    if turned:
        q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
        points = points @ q.T
    lattice = stochastic.delaunay(frep.sphere((0, 0, 0), 8), seeds=points)
    a, b = lattice.skeleton.segments().transpose(1, 0, 2)
    assert crossings(a, b, 1e-3) == 0
    assert len(lattice.skeleton.nodes) == len(points)
    # Nearest neighbours are joined: their ball of Thales is empty but for its surface.
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    first = np.sort(distance, axis=1)[:, 1].min()
    joined = np.linalg.norm(b - a, axis=1)
    assert (np.abs(joined - first) < 1e-9).sum() == (np.abs(distance - first) < 1e-9).sum() / 2


def test_the_helper_sees_crossings():
    a = np.array([(0, 0, 0), (1, 0, 0), (0, 0, 0.0)])
    b = np.array([(1, 1, 0), (0, 1, 0), (2, 2, 0.0)])
    assert crossings(a[:2], b[:2], 1e-2) == 1
    assert crossings(a[[0, 2]], b[[0, 2]], 1e-2) == 1


@pytest.mark.parametrize(
    ("sites", "edges"),
    [([(0.0, 0.0, 0.0)], 7), (GRID, 7 * 64), (BCC, 14), (FCC, 28), (A15, None)],
    ids=["one", "grid", "bcc", "fcc", "a15"],
)
def test_periodic_delaunay_edges_of_grids(sites, edges):
    """A generic lattice has 14 neighbours (Voronoi, 1908), so 7 edges a seed; cut up otherwise there were crossings."""
    lattice = stochastic.delaunay(UNIT, seeds=sites, periodic=True)
    assert lattice.check() == []
    if edges:
        assert len(lattice.skeleton.edges) == edges


@given(seed=st.integers(0, 1000), number=st.integers(5, 60))
@settings(max_examples=25)
def test_delaunay_balls_are_empty(seed, number):
    """Qhull's own Delaunay tetrahedra have the same edges."""
    from scipy.spatial import Delaunay

    points = seeding.uniform(BLOCK, number, random_state=seed)
    t = Delaunay(points).simplices
    expected = {tuple(sorted(p)) for s in t.tolist() for p in itertools.combinations(s, 2)}
    found = power_diagram.delaunay_edges(points, np.arange(number), 1.0)
    assert {tuple(p) for p in found.tolist()} == expected


# --- bad input --------------------------------------------------------------------------------------------------------

SEEDS = [(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4)]
BAD = [
    (
        lambda: stochastic.voronoi(BALL, cell_size=5, weights=[1], random_state=1),
        ArgumentError,
        "weights: expected seeds=",
    ),
    (lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=[1, 1, 1]), ArgumentError, r"weights: expected 4 .*\(3,\)"),
    (lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=[1, 1, 1, -2]), ArgumentError, "-2 of seed 3"),
    (
        lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=[1, 1, 1, math.nan]),
        ArgumentError,
        "1 of 4 seeds .* seed 3",
    ),
    (lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=2), ArgumentTypeError, "4 radii in mm"),
    (lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights="big"), ArgumentTypeError, "4 radii in mm"),
    (lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=frep.coordinates()[0]), ArgumentTypeError, "4 radii in mm"),
    (
        lambda: stochastic.voronoi(BALL, seeds=SEEDS, weights=[1] * 4, relax=2, random_state=1),
        ArgumentError,
        "weights: expected relax=0",
    ),
    (lambda: stochastic.voronoi_walls(BALL, 1, seeds=SEEDS, weights=[1]), ArgumentError, "weights"),
    (lambda: stochastic.face_distance(BALL, SEEDS, weights=[1]), ArgumentError, "weights"),
    (
        lambda: stochastic.voronoi(UNIT, cell_size=0.3, periodic=True, overhang=0.1, random_state=1),
        ArgumentError,
        "overhang: expected 0 with periodic",
    ),
    (
        lambda: stochastic.delaunay(UNIT, cell_size=0.3, periodic=True, overhang=0.1, random_state=1),
        ArgumentError,
        "overhang: expected 0 with periodic",
    ),
    (lambda: seeding.packed_balls(BALL, [], random_state=1), ArgumentTypeError, "radii"),
    (lambda: seeding.packed_balls(BALL, "big", random_state=1), ArgumentTypeError, "radii"),
    (
        lambda: seeding.packed_balls(BALL, [1, 0], random_state=1),
        ArgumentError,
        "radii: expected more than 0.* of ball 1",
    ),
    (lambda: seeding.packed_balls(BALL, [1, math.nan], random_state=1), ArgumentError, "1 of 2 balls .* ball 1"),
    (lambda: seeding.packed_balls(BALL, [1, 2], random_state=None), ArgumentTypeError, "random_state"),  # type: ignore[arg-type]
    (lambda: seeding.packed_balls(BALL, [9] * 30, random_state=1), ArgumentError, "radii: .* found no place"),
    (lambda: seeding.packed_balls(UNIT, [0.6], random_state=1, periodic=True), ArgumentError, "radii: .*meets itself"),
]


@pytest.mark.parametrize(("call", "error", "text"), BAD)
def test_bad_input(call, error, text):
    with pytest.raises(error, match=text):
        call()
