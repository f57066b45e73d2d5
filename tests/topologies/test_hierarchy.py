"""Lattices of lattices: volumes by closed forms, girders by formulas of their counts and lengths, joints that hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import frep
from frep import ArgumentError, ArgumentTypeError, TooLargeError
from topologies import beams, hierarchy, tpms
from topologies.hierarchy import NoInsideWarning, filled, trussed
from topologies.stochastic import voronoi

RNG = np.random.default_rng(3)
CORNER = beams.graph([(0, 0, 0), (40, 0, 0), (0, 50, 0), (10, 10, 60)], [(0, 1), (0, 2), (0, 3), (2, 3)])


# --- filled --------------------------------------------------------------------------------------------------------------


def test_square_beams_of_square_beams_have_the_volume_of_their_boxes():
    """All faces lie on multiples of half a millimetre: counting cubes of that side is exact."""
    outer = beams.simple_cubic(12).thicken(4, section="square")
    inner = beams.simple_cubic(4).thicken(1, section="square")
    part = filled(outer, inner) & frep.box((0, 0, 0), (12, 12, 12))
    x = np.arange(24) * 0.5 + 0.25
    place = np.stack(np.meshgrid(x, x, x, indexing="ij"), -1)

    def frame(period, side):
        near = np.abs(place - period * np.round(place / period)) < 0.5 * side
        return near.sum(axis=-1) >= 2

    expected = frame(12, 4) & frame(4, 1)
    np.testing.assert_array_equal(part.contains(place.reshape(-1, 3)), expected.ravel())
    # Edges of cubes of four samples are rounded by the sum over samples.
    assert part.volume(voxel=0.25) == pytest.approx(expected.sum() * 0.125, rel=0.02)


@pytest.mark.parametrize("cell", [3.0, 4.0])
def test_two_levels_hold_the_product_of_their_fractions(cell):
    """lf-rep row 37: where the scales are apart, the volume is that of the coarse level times the fraction of the fine one."""
    box = frep.box((0, 0, 0), (40, 40, 40))
    coarse = beams.bcc(40).thicken(16)
    wall = 0.2 * cell
    share = 3.0916 * 0.2 - 8 * np.pi / 6 * 0.2**3  # O8, gyroid
    part = filled(coarse, tpms.gyroid(cell).sheet(wall)) & box
    assert part.volume(voxel=0.5) == pytest.approx((coarse & box).volume(voxel=0.5) * share, rel=0.02)


def test_three_levels_are_where_all_three_are():
    levels = [beams.simple_cubic(u).thicken(0.3 * u) for u in (27, 9, 3)]
    part = filled(levels[0], filled(levels[1], levels[2]))
    points = RNG.uniform(-30, 30, (4000, 3))
    expected = np.all([s.contains(points) for s in levels], axis=0)
    np.testing.assert_array_equal(part.contains(points), expected)
    assert 50 < expected.sum() < 3000


@given(skin=st.floats(0.1, 3.0), radius=st.floats(4.0, 9.0))
def test_a_skin_is_where_the_depth_is_less(skin, radius):
    ball, core = frep.sphere((0, 0, 0), radius), frep.sphere((0, 0, 0), 0.2)
    r = RNG.uniform(0, 10, 200)
    clear = (abs(r - radius) > 1e-6) & (abs(r - radius + skin) > 1e-6) & (abs(r - 0.2) > 1e-6)
    points = np.outer(r, (0.6, 0.0, 0.8))
    expected = (r < radius) & ((r > radius - skin) | (r < 0.2))
    np.testing.assert_array_equal(filled(ball, core, skin=skin).contains(points)[clear], expected[clear])


def test_the_skin_of_a_ball_has_the_volume_of_a_shell():
    part = filled(frep.sphere((0, 0, 0), 10), frep.sphere((0, 0, 0), 5), skin=1)
    assert part.volume(voxel=0.4) == pytest.approx(4 / 3 * np.pi * (1000 - 729 + 125), rel=0.003)


def test_a_sandwich_wall_has_two_skins_of_true_thickness():
    """What is solid of a wall of 4 mm with skins of 0.6: from 1.4 to 2 mm off the surface, on both sides."""
    surface = tpms.gyroid(cell=20)
    wall = filled(surface.sheet(4), frep.sphere((1e3, 0, 0), 1), skin=0.6)
    box = frep.box((0, 0, 0), (20, 20, 20))
    points = RNG.uniform(0, 20, (3000, 3))
    depth = abs(surface.distance(points))
    np.testing.assert_array_equal(wall.contains(points), (depth < 2) & (depth > 1.4))
    t = np.array([4.0, 2.8]) / 20
    tube = (3.0916 * t - 8 * np.pi / 6 * t**3) * 20**3
    assert (wall & box).volume(voxel=0.3) == pytest.approx(tube[0] - tube[1], rel=0.01)


def test_a_skin_may_vary():
    x, _, _ = frep.coordinates()
    part = filled(frep.box((0, 0, 0), (20, 20, 20)), frep.sphere((10, 10, 10), 0.1), skin=1 + x / 10)
    np.testing.assert_array_equal(
        part.contains([(3, 1.2, 10), (3, 1.4, 10), (17, 2.6, 10), (17, 2.8, 10)]), [1, 0, 1, 0]
    )


def test_the_skin_of_a_swelling_beam_is_measured_across_it():
    x, _, _ = frep.coordinates()
    outer = beams.graph([(0, 0, 0), (20, 0, 0)], [(0, 1)]).thicken(6 + 0.4 * x)
    part = filled(outer, frep.sphere((0, 0, 9), 0.1), skin=0.8)
    at, away = RNG.uniform(1, 19, 500), RNG.uniform(0, 8, 500)
    radius = 3 + 0.2 * at
    points = np.stack([at, 0.6 * away, 0.8 * away], 1)
    np.testing.assert_array_equal(part.contains(points), (away < radius) & (away > radius - 0.8))


def test_too_thick_a_skin_is_told():
    wall = tpms.gyroid(cell=20).sheet(2)
    with pytest.warns(NoInsideWarning, match="walls"):
        filled(wall, beams.bcc(2).thicken(0.5), skin=1.0)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((None, frep.sphere((0, 0, 0), 1)), ArgumentTypeError, "outer"),
        ((frep.sphere((0, 0, 0), 1), beams.bcc(2)), ArgumentTypeError, "inner"),
        ((frep.sphere((0, 0, 0), 1), frep.sphere((0, 0, 0), 1), -0.1), ArgumentError, "skin"),
    ],
)
def test_filled_names_what_is_wrong(arguments, error, message):
    with pytest.raises(error, match=message):
        filled(*arguments)


# --- trussed -------------------------------------------------------------------------------------------------------------

DIAGONALS = {"none": 0, "cross": 4, "warren": 1, "pratt": 1, "howe": 1, "spiral": 1}


@settings(max_examples=40)
@given(sides=st.integers(3, 7), bays=st.integers(1, 6), pattern=st.sampled_from(hierarchy.PATTERNS))
def test_counts_are_those_of_the_formula(sides, bays, pattern):
    made = trussed(CORNER, 3, bays=bays, sides=sides, pattern=pattern)
    n, b, m = sides, bays, len(CORNER.skeleton.edges)
    middles = n * b if pattern == "cross" else 0
    assert len(made.skeleton.nodes) == 4 + m * (n * (b + 1) + middles)
    assert len(made.skeleton.edges) == m * (2 * n + n * b + n * (b + 1) + DIAGONALS[pattern] * n * b)
    # Each beam once, none without length.
    pairs = np.sort(made.skeleton.edges, axis=1)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert np.ptp(made.skeleton.segments(), axis=1).max(axis=1).min() > 0.1


@settings(max_examples=25)
@given(
    sides=st.integers(3, 6),
    pattern=st.sampled_from(hierarchy.PATTERNS),
    cell=st.sampled_from(["bcc", "octet", "diamond"]),
)
def test_girders_hold_together(sides, pattern, cell):
    """One component, and no node at which fewer than three beams meet."""
    coarse = getattr(beams, cell)(30).over(((0, 0, 0), (30, 30, 30)))
    made = trussed(coarse, 1.5, pattern=pattern, sides=sides)
    assert made.connectivity().components == 1
    assert np.bincount(made.skeleton.edges.ravel(), minlength=len(made.skeleton.nodes)).min() >= 3


@given(sides=st.integers(3, 6), bays=st.integers(1, 5), width=st.floats(0.5, 4.0))
def test_lengths_are_exact(sides, bays, width):
    """A lone beam: rings half a width from its ends; longerons, rings, diagonals and spokes by Pythagoras."""
    length, radius = 30.0, 0.5 * width
    made = trussed(beams.graph([(1, 2, 3), (1, 2 + length, 3)], [(0, 1)]), width, bays=bays, sides=sides)
    bay = (length - 2 * radius) / bays
    side = 2 * radius * math.sin(math.pi / sides)
    expected = [math.hypot(radius, radius)] * (2 * sides) + [bay] * (sides * bays) + [side] * (sides * (bays + 1))
    expected += [math.hypot(bay, side)] * (sides * bays)
    found = np.linalg.norm(np.diff(made.skeleton.segments(), axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(found), np.sort(expected), rtol=1e-9)


@given(pitch=st.floats(0.5, 60.0))
def test_bays_are_as_near_to_the_pitch_as_whole_numbers_get(pitch):
    made = trussed(beams.graph([(0, 0, 0), (0, 0, 42)], [(0, 1)]), 2, pitch=pitch, pattern="none")
    bays = (len(made.skeleton.nodes) - 2) // 3 - 1
    assert bays == max(1, round(40 / pitch))


@given(seed=st.integers(0, 2**31))
def test_turned_girders_are_the_girders_turned(seed):
    """Lengths do not depend on the axes; about z not even the frames do."""
    nodes, edges = CORNER.skeleton.nodes, CORNER.skeleton.edges
    made = trussed(CORNER, 3, bays=3)
    lengths = np.sort(np.linalg.norm(np.diff(made.skeleton.segments(), axis=1)[:, 0], axis=1))
    turn = Rotation.random(rng=np.random.default_rng(seed))
    there = trussed(beams.graph(turn.apply(nodes), edges), 3, bays=3)
    found = np.sort(np.linalg.norm(np.diff(there.skeleton.segments(), axis=1)[:, 0], axis=1))
    np.testing.assert_allclose(found, lengths, atol=1e-9)
    np.testing.assert_array_equal(there.skeleton.edges, made.skeleton.edges)
    about = Rotation.from_rotvec((0, 0, turn.magnitude()))
    there = trussed(beams.graph(about.apply(nodes), edges), 3, bays=3)
    np.testing.assert_allclose(there.skeleton.nodes, about.apply(made.skeleton.nodes), atol=1e-9)


def own_and_other(coarse, made, per_beam):
    """Distances of the nodes of each girder to its own beam's line, and the least to the others'."""
    a, b = coarse.skeleton.segments()[:, 0], coarse.skeleton.segments()[:, 1]
    nodes = made.skeleton.nodes[len(np.unique(coarse.skeleton.edges)) :].reshape(len(a), per_beam, 3)
    way = b - a
    share = np.einsum("ijk,mk->ijm", nodes, way) - np.einsum("mk,mk->m", a, way)
    share = np.clip(share / np.einsum("mk,mk->m", way, way), 0, 1)
    away = np.linalg.norm(nodes[:, :, None] - (a + share[..., None] * way), axis=-1)
    own = away[np.arange(len(a)), :, np.arange(len(a))]
    away[np.arange(len(a)), :, np.arange(len(a))] = np.inf
    return own, away.min(axis=2)


@pytest.mark.parametrize("cell", ["simple_cubic", "bcc", "octet", "fbcc"])
def test_girders_keep_out_of_each_other(cell):
    """Every node of a girder is nearer to its own beam than to any other."""
    coarse = getattr(beams, cell)(40).over(((0, 0, 0), (40, 40, 40)))
    made = trussed(coarse, 1.6, bays=4)
    own, other = own_and_other(coarse, made, 15)
    np.testing.assert_allclose(own, 0.8, atol=1e-9)
    assert np.all(other > own)


def test_beams_keep_their_order():
    """Girder i is that of beam i, whatever the numbers of bays."""
    made = trussed(CORNER, 3, pitch=7, pattern="cross")
    segments = CORNER.skeleton.segments()
    hubs = 4
    start = hubs
    for a, b in segments:
        i = np.flatnonzero(np.any(made.skeleton.edges == start, axis=1))[0]
        spoke = set(made.skeleton.edges[i].tolist()) - {start}
        np.testing.assert_allclose(made.skeleton.nodes[spoke.pop()], a)
        way = (b - a) / np.linalg.norm(b - a)
        k = start
        while k < len(made.skeleton.nodes):
            off = made.skeleton.nodes[k] - a
            if np.linalg.norm(off - (off @ way) * way) > 1.5 + 1e-6:
                break
            k += 1
        assert k > start + 6
        start = k
    assert start == len(made.skeleton.nodes)


def test_girders_of_girders():
    """Two levels once more: one piece; slender beams hold their length times their section (lf-rep row 37)."""
    once = trussed(CORNER, 8, bays=2)
    twice = trussed(once, 1.2, pattern="cross")
    assert twice.connectivity().components == 1
    assert len(twice.skeleton.nodes) > 30 * len(once.skeleton.nodes)
    total = np.linalg.norm(np.diff(once.skeleton.segments(), axis=1)[:, 0], axis=1).sum()
    assert once.thicken(0.3).volume(voxel=0.15) == pytest.approx(np.pi * 0.15**2 * total, rel=0.03)


def test_a_straight_chain_needs_no_more_than_half_a_width():
    """Beams that go on straight do not touch: their rings stand half a width off."""
    made = trussed(beams.graph([(0, 0, 0), (10, 0, 0), (20, 0, 0)], [(0, 1), (1, 2)]), 2, bays=1)
    assert sorted(set(np.round(made.skeleton.nodes[:, 0], 9))) == [0, 1, 9, 10, 11, 19, 20]


def test_the_width_that_is_said_to_fit_fits():
    with pytest.raises(ArgumentError, match=r"less than 27\.5 mm"):
        trussed(CORNER, 27.6)
    assert trussed(CORNER, 27.4).connectivity().components == 1


def test_setbacks_are_as_asked_for():
    made = trussed(CORNER, 3, bays=2, setback=6)
    assert np.linalg.norm(made.skeleton.nodes[4] - CORNER.skeleton.nodes[0]) == pytest.approx(math.hypot(6, 1.5))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: trussed(beams.bcc(10), 1), ArgumentTypeError, r"over\(region\)"),
        (lambda: trussed("bcc", 1), ArgumentTypeError, "topology"),
        (lambda: trussed(CORNER, 0), ArgumentError, "width"),
        (lambda: trussed(CORNER, 60), ArgumentError, "width: 60 mm is too wide for beam 3, 72.8 mm.*less than 27.5 mm"),
        (lambda: trussed(CORNER, 2, bays=0), ArgumentError, "bays"),
        (lambda: trussed(CORNER, 2, bays=1.5), ArgumentTypeError, "bays"),
        (lambda: trussed(CORNER, 2, bays=2, pitch=2), ArgumentError, "bays, pitch"),
        (lambda: trussed(CORNER, 2, pitch=-1), ArgumentError, "pitch"),
        (lambda: trussed(CORNER, 2, sides=2), ArgumentError, "sides"),
        (lambda: trussed(CORNER, 2, pattern="waren"), ArgumentError, "did you mean 'warren'"),
        (lambda: trussed(CORNER, 2, short="plane"), ArgumentError, "did you mean 'plain'"),
        (lambda: trussed(CORNER, 27.6), ArgumentError, 'short="plain" leaves beams too short as they are, 3 of 4'),
        (lambda: trussed(CORNER, 500, short="plain"), ArgumentError, "no beam is long enough"),
        (lambda: trussed(CORNER, 4, setback=0.5), ArgumentError, "setback: expected more than"),
        (lambda: trussed(CORNER, 0.1, pitch=1e-5), TooLargeError, "beams"),
        (
            lambda: trussed(beams.graph([(0, 0, 0), (9, 0, 0), (5, 0, 0)], [(0, 1), (0, 2)]), 1),
            ArgumentError,
            "run along",
        ),
    ],
)
def test_trussed_names_what_is_wrong(call, error, message):
    with pytest.raises(error, match=message):
        call()


@pytest.mark.parametrize("pattern", hierarchy.PATTERNS)
def test_a_foam_of_girders_keeps_its_short_edges_plain(pattern):
    foam = voronoi(frep.sphere((0, 0, 0), 40), cell_size=30, random_state=1)
    with pytest.raises(ArgumentError, match="too wide"):
        trussed(foam, 3, pattern=pattern)
    made = trussed(foam, 3, bays=2, pattern=pattern, short="plain")
    old, ends = len(foam.skeleton.nodes), made.skeleton.edges
    plain = ends[(ends < old).all(axis=1)]
    girders = len(foam.skeleton.edges) - len(plain)
    assert 0 < len(plain) < len(foam.skeleton.edges)
    np.testing.assert_array_equal(ends[-len(plain) :], plain)
    n, b = 3, 2
    assert len(ends) == len(plain) + girders * (2 * n + n * b + n * (b + 1) + DIAGONALS[pattern] * n * b)
    # Whoever was joined still is, and no girder is squeezed: its longerons are at least half a bay in all.
    assert made.connectivity().components == foam.connectivity().components
    one_bay = trussed(foam, 3, bays=1, pattern="none", short="plain")
    assert np.linalg.norm(np.diff(one_bay.skeleton.segments(), axis=1)[:, 0], axis=1)[: -len(plain)].min() >= 1.5 - 1e-9


def test_where_all_beams_are_long_enough_the_option_changes_nothing():
    there, here = trussed(CORNER, 3).skeleton, trussed(CORNER, 3, short="plain").skeleton
    np.testing.assert_array_equal(there.nodes, here.nodes)
    np.testing.assert_array_equal(there.edges, here.edges)
