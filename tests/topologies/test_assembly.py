"""Lattices put together: LF-rep's worked transition, mismatches that are told, bridges, and cells of one grid."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, DisconnectedWarning, EmptyError
from topologies import beams
from topologies.assembly import assemble, cell_map

RNG = np.random.default_rng(6)
U = 3.75


def bain(u: float, p: float):
    """FCC below the plane x + z = p u, BCC above, as in the worked case of LF-rep (3.19, 3.20): the Bain
    correspondence."""
    v = u / math.sqrt(2)
    # Coordinates of the BCC lattice are R X; R turns by 45 degrees round y, so that its beams turn back.
    bcc = beams.bcc((v, u, v)).rotate("y", -math.pi / 4)
    plane = (p * u, 0, 0)
    return [(beams.fcc(u), frep.half_space((1, 0, 1), plane)), (bcc, frep.half_space((-1, 0, -1), plane))]


def lines(topology, digits: int = 6) -> set[frozenset]:
    segments = topology.skeleton.segments()
    return {frozenset(tuple((np.round(p, digits) + 0.0).tolist()) for p in beam) for beam in segments}


def valence(topology) -> np.ndarray:
    return np.bincount(topology.skeleton.edges.reshape(-1), minlength=len(topology.skeleton.nodes))


def test_the_turn_of_the_worked_case():
    """O11: (3.20) is orthonormal, of determinant 1, and what `bain` turns by."""
    r = np.array([[1, 0, 1], [0, math.sqrt(2), 0], [-1, 0, 1]]) * math.sqrt(0.5)
    np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(r) == pytest.approx(1.0)
    placement = bain(U, 10)[1][0].placement
    assert placement is not None
    np.testing.assert_allclose(placement.rotation, r.T, atol=1e-15)


@pytest.mark.parametrize(
    ("counts", "p", "on_plane"),
    [
        ((10, 10, 10), 10, 21 * 11),  # the cube of Fig. 4.6, 37.5 mm
        ((14, 2, 14), 14, 87),
        ((6, 3, 6), 4, 9 * 4),
        ((6, 3, 6), 9, 7 * 4),
    ],
)
def test_fcc_meets_bcc_at_all_nodes(counts, p, on_plane):
    """O11: along the plane nodes lie u / sqrt 2 apart, across it u: all of both lattices coincide, and nothing is
    loose."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part = assemble(bain(U, p), over=((0, 0, 0), U * np.array(counts)))
    report = part.report
    assert (report.matched, report.unmatched, report.nodes) == (on_plane, 0, (on_plane, on_plane))
    assert (report.components, report.dangling, report.gaps, report.overlaps) == (1, 0, 0, 0)
    assert report.sound
    nodes = part.skeleton.nodes
    at_plane = np.abs(nodes[:, 0] + nodes[:, 2] - p * U) < 1e-6
    assert at_plane.sum() == on_plane
    assert valence(part)[at_plane].min() > 1


def test_beams_in_the_plane_are_kept_once():
    """The half diagonals of FCC's faces that lie in the plane."""
    part = assemble(bain(U, 4), over=((0, 0, 0), (4 * U, 2 * U, 4 * U)))
    segments = part.skeleton.segments()
    inside = np.all(np.abs(segments[:, :, 0] + segments[:, :, 2] - 4 * U) < 1e-6, axis=1)
    assert inside.sum() == 3 * 8
    assert len(lines(part)) == len(segments)


@pytest.mark.parametrize("p", [4.2, 4.5, 4.9])
def test_planes_between_the_layers_are_told(p):
    """O11: FCC's beams across the plane end there; those aslant go on as beams of BCC, which has their directions."""
    over = ((0, 0, 0), (6 * U, 2 * U, 6 * U))
    with pytest.warns(DisconnectedWarning, match=r"has \d+ beams that end in the air, one of them at \("):
        part = assemble(bain(U, p), over=over)
    report = part.report
    assert report.unmatched >= report.dangling > 0
    assert not report.sound
    place = np.array(report.place)
    assert place[0] + place[2] == pytest.approx(p * U)
    assert np.abs(part.skeleton.nodes - place).max(axis=1).min() < 1e-9
    nodes, edges = part.skeleton.nodes, part.skeleton.edges
    on_plane = np.abs(nodes[:, 0] + nodes[:, 2] - p * U) < 1e-6
    inside = np.all((nodes > 1e-6) & (nodes < np.array(over[1]) - 1e-6), axis=1)
    loose = on_plane & inside & (valence(part) == 1)
    ends = part.skeleton.segments()
    below = ends.mean(axis=1) @ [1, 0, 1] < p * U
    along = np.diff(ends, axis=1)[below & loose[edges].any(axis=1), 0]
    assert len(along) > 0
    np.testing.assert_allclose(np.abs(along @ [1, 0, 1]), math.sqrt(2) * np.linalg.norm(along, axis=1))
    # In the open faces y = 0 and y = 2 u ends count no more than on the other outer faces.
    assert report.dangling == loose.sum()


@pytest.mark.parametrize(("shift", "reach"), [((0.3, 0.4, 0.1), None), ((1.1, 0.2, 0.9), 3.0)])
def test_lattices_that_miss_are_told_and_bridged(shift, reach):
    over = ((0, 0, 0), (6 * U, 2 * U, 6 * U))
    (fcc, below), (bcc, above) = bain(U, 5)
    parts = [(fcc, below), (bcc.translate(shift), above)]
    with pytest.warns(DisconnectedWarning, match=r"falls into \d+ components and has \d+ beams that end in the air"):
        apart = assemble(parts, over=over)
    assert apart.report.matched == 0
    assert apart.report.components >= 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DisconnectedWarning)
        joined = assemble(parts, over=over, bridge="nearest", reach=reach)
        short = assemble(parts, over=over, bridge="nearest", reach=1e-3)
    assert joined.report.components < apart.report.components
    assert joined.report.dangling == 0
    assert lines(apart) <= lines(joined)
    added = lines(joined) - lines(apart)
    assert len(added) == joined.report.bridges > 0
    assert max(math.dist(*beam) for beam in added) <= (reach or 0.5 * U / math.sqrt(2)) + 1e-9
    assert short.report.bridges == 0
    with pytest.warns(DisconnectedWarning, match="bridges of up to 0.001 mm do not reach"):
        assemble(parts, over=over, bridge="nearest", reach=1e-3)


def test_nothing_is_left_wholly_beyond_the_part():
    """A beam cut in two may have its one half in the part and the other beyond: that one would be a loose piece."""
    n, over = np.array([1.0, 0.3, 0.2]), np.array([(0, 0, 0), (40, 30, 30)])
    one, other = (frep.half_space(tuple(s * n), (20, 15, 15)) for s in (1, -1))
    parts = [(beams.bcc(5), one), (beams.bcc(5).rotate("z", 0.4), other)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DisconnectedWarning)
        lattice = assemble(parts, over=over)
        joined = assemble(parts, over=over, bridge="nearest", reach=4)
    a, b = lattice.skeleton.segments().transpose(1, 0, 2)
    t = np.linspace(0, 1, 201)[:, None, None]
    within = np.all((a + t * (b - a) >= over[0] - 1e-3) & (a + t * (b - a) <= over[1] + 1e-3), axis=2)
    assert within.any(axis=0).all()
    assert (joined.report.components, joined.report.dangling) == (1, 0)


def test_each_region_has_its_own_lattice():
    """Away from the border the solid of the union is that of one lattice or the other."""
    parts = bain(U, 4)
    over = ((0, 0, 0), (6 * U, 2 * U, 6 * U))
    part = beams.BeamTopology.assembled(parts, over=over).thicken(0.7)
    points = RNG.uniform(*over, (4000, 3))
    for topology, region in parts:
        deep = points[(region.field(points) < -1.5) & np.all((points > 1) & (points < np.array(over[1]) - 1), axis=1)]
        assert len(deep) > 100
        np.testing.assert_array_equal(part.contains(deep), topology.thicken(0.7).contains(deep))


def test_gaps_and_overlaps_are_shares_of_the_volume():
    over = ((0, 0, 0), (40, 10, 10))
    left, right = frep.half_space((1, 0, 0), (10, 0, 0)), frep.half_space((-1, 0, 0), (20, 0, 0))
    with pytest.warns(DisconnectedWarning, match="2 components"):
        gap = assemble([(beams.bcc(10), left), (beams.bcc(10), right)], over=over).report
    assert gap.gaps == pytest.approx(0.25)
    assert gap.overlaps == 0
    both = assemble([(beams.bcc(10), ~right), (beams.fcc(10), ~left)], over=over).report
    assert both.overlaps == pytest.approx(0.25)
    assert both.gaps == 0
    ball = frep.sphere((0, 0, 0), 10)
    with pytest.warns(DisconnectedWarning):
        half = assemble([(beams.fcc(4), frep.half_space((0, 0, 1), (0, 0, 0.3)))], over=ball).report
    expected = math.pi * (10 - 0.3) ** 2 * (30 - 9.7) / 3 / (4 / 3 * math.pi * 1000)
    assert half.gaps == pytest.approx(expected, abs=0.01)


def test_three_regions_meet():
    """LF-rep (3.18): regions are intersections of half-spaces; here three wedges of one lattice give the lattice."""
    over = ((0, 0, 0), (20, 20, 10))
    bounds = [frep.half_space((1, 0, 0), (10, 0, 0)), frep.half_space((0, 1, 0), (0, 10, 0))]
    wedges = [bounds[0], ~bounds[0] & bounds[1], ~bounds[0] & ~bounds[1]]
    part = assemble([(beams.octet(5), wedge) for wedge in wedges], over=over)
    assert lines(part) == lines(beams.octet(5).over(over))
    assert part.report.sound
    assert part.report.unmatched == 0
    # Nodes on x = 10, and those of the half plane y = 10 that are not on it.
    nodes = part.skeleton.nodes
    shared = (nodes[:, 0] == 10) | ((nodes[:, 1] == 10) & (nodes[:, 0] > 10))
    assert part.report.matched == shared.sum()


def test_ends_that_hung_before_are_not_the_transition_s():
    with pytest.warns(beams.DanglingBeamWarning):
        hairy = beams.cell(
            [(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4), (1, 1, 1)], [(0, 1), (0, 2), (0, 3), (0, 4)], size=4
        )
    half = frep.half_space((1, 0, 0), (4, 0, 0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part = assemble([(hairy, half), (hairy, ~half)], over=((0, 0, 0), (8, 8, 8)))
    assert part.report.dangling == 0
    assert len(part.connectivity().dangling) > 0


def test_a_region_without_end_and_graphs_as_parts():
    strut = beams.graph([(0, 0, 0), (10, 0, 0), (5, 0, 0)], [(0, 2), (2, 1)])
    both = assemble(
        [(strut, None), (beams.graph([(5, 0, 0), (5, 5, 0)], [(0, 1)]), None)], over=((0, -1, -1), (10, 5, 1))
    )
    assert len(both.skeleton.edges) == 3
    assert both.report.overlaps == 1
    assert both.report.components == 1


REGION = frep.half_space((1, 0, 0), (5, 0, 0))
BOX = ((0, 0, 0), (10, 10, 10))


@pytest.mark.parametrize(
    ("argument", "error", "call"),
    [
        ("parts", ArgumentError, lambda: assemble([], over=BOX)),
        ("parts", ArgumentTypeError, lambda: assemble(5, over=BOX)),
        ("parts", ArgumentTypeError, lambda: assemble([beams.bcc()], over=BOX)),
        ("parts", ArgumentTypeError, lambda: assemble([(REGION, beams.bcc())], over=BOX)),
        ("parts", EmptyError, lambda: assemble([(beams.bcc(4), frep.sphere((99, 0, 0), 1))], over=BOX)),
        ("over", frep.UnboundedError, lambda: assemble([(beams.bcc(4), REGION)], over=REGION)),
        ("bridge", ArgumentError, lambda: assemble([(beams.bcc(4), REGION)], over=BOX, bridge="all")),
        ("reach", ArgumentError, lambda: assemble([(beams.bcc(4), REGION)], over=BOX, bridge="nearest", reach=-1)),
        ("reach", ArgumentError, lambda: assemble([(beams.bcc(4), REGION)], over=BOX, reach=2)),
        ("reach", ArgumentError, lambda: assemble([(beams.bcc(4).over(BOX), None)], over=BOX, bridge="nearest")),
        ("cells", ArgumentError, lambda: cell_map([beams.bcc], [[0]])),
        ("cells", ArgumentError, lambda: cell_map([beams.bcc], [[[1]]])),
        ("cells", ArgumentError, lambda: cell_map([beams.bcc], [[[-2]]])),
        ("cells", ArgumentTypeError, lambda: cell_map([beams.bcc], [[[0.5]]])),
        ("cells", EmptyError, lambda: cell_map([beams.bcc], [[[-1]]])),
        ("counts", ArgumentError, lambda: cell_map([beams.bcc], lambda i, j, k: 0)),
        ("counts", ArgumentError, lambda: cell_map([beams.bcc], [[[0]]], counts=(1, 1, 1))),
        ("topologies", ArgumentError, lambda: cell_map([beams.bcc(5)], [[[0]]], cell=6)),
        ("topologies", ArgumentError, lambda: cell_map([beams.bcc(10).translate((1, 0, 0))], [[[0]]])),
        ("topologies", ArgumentTypeError, lambda: cell_map([beams.bcc(10).over(BOX)], [[[0]]])),
        ("topologies", ArgumentTypeError, lambda: cell_map(beams.bcc, [[[0]]])),
        ("topologies", ArgumentError, lambda: cell_map([], [[[0]]])),
        ("cell", ArgumentError, lambda: cell_map([beams.bcc], [[[0]]], cell=0)),
        ("origin", ArgumentError, lambda: cell_map([beams.bcc], [[[0]]], origin=(0, 0))),
    ],
)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()


# --- one a cell -------------------------------------------------------------------------------------------------------

FAMILY = [
    beams.simple_cubic,
    beams.bcc,
    beams.bccz,
    beams.fcc,
    beams.fccz,
    beams.s_fcc,
    beams.s_fccz,
    beams.fbcc,
    beams.s_fbcc,
    beams.s_fbccz,
]


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.integers(1, 3)] * 3), st.integers(0, 10**6))
def test_the_cubic_family_hangs_together_however_it_is_mixed(shape, seed):
    """LF-rep 6.1: ten cells share the corners of the grid."""
    numbers = np.random.default_rng(seed).integers(0, len(FAMILY), shape)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part = cell_map(FAMILY, numbers, cell=(4, 5, 6), origin=(1, 2, 3))
    assert part.report.sound
    expected = set()
    for index in itertools.product(*map(range, shape)):
        low = np.array([1, 2, 3]) + np.array(index) * (4, 5, 6)
        cell = FAMILY[numbers[index]]((4, 5, 6)).over(((0, 0, 0), (4, 5, 6))).translate(low)
        expected |= lines(cell)
    assert lines(part) == expected
    assert len(part.skeleton.edges) == len(expected)


@pytest.mark.parametrize(
    "make", [beams.octet, beams.diamond, beams.truncated_cube, beams.supported_cubic, beams.isotruss]
)
def test_one_topology_everywhere_is_its_lattice(make):
    part = cell_map([make], np.zeros((3, 2, 2), int), cell=5)
    np.testing.assert_allclose(part.skeleton.bounds, [[0, 0, 0], [15, 10, 10]], atol=1e-9)
    whole = make(5).over(((0, 0, 0), (15, 10, 10)))
    inside = [
        b for b in lines(whole) if all(-1e-6 <= c <= top for p in b for c, top in zip(p, (15, 10, 10), strict=True))
    ]
    assert set(inside) <= lines(part)
    points = RNG.uniform((1, 1, 1), (14, 9, 9), (800, 3))
    np.testing.assert_array_equal(part.thicken(0.6).contains(points), make(5).thicken(0.6).contains(points))


@pytest.mark.parametrize("make", [beams.kagome, beams.vintiles, beams.reentrant, beams.weaire_phelan])
def test_beams_that_run_on_are_cut_at_the_faces(make):
    size = make(5).skeleton.size
    part = cell_map([make(5)], np.zeros((2, 2, 2), int), cell=size)
    points = RNG.uniform(0.5 * size - 0.3 * size, 1.8 * size, (800, 3))
    np.testing.assert_array_equal(part.thicken(0.6).contains(points), make(5).thicken(0.6).contains(points))
    assert np.all((part.skeleton.nodes >= -1e-9) & (part.skeleton.nodes <= 2 * size + 1e-9))


def test_matched_and_unmatched_nodes_between_cells():
    """FCC has a node in the middle of a face, BCC none; both have the corners."""
    report = cell_map([beams.bcc, beams.fcc], [[[0]], [[1]]], cell=4).report
    assert (report.matched, report.unmatched, report.nodes) == (4, 1, (4, 5))
    with pytest.warns(DisconnectedWarning, match="2 components"):
        alone = cell_map([beams.bcc, beams.fcc], [[[0]], [[-1]], [[1]]], cell=4)
    assert alone.report.gaps == pytest.approx(1 / 3)
    assert alone.report.matched == 0


def test_cells_that_do_not_meet_are_told():
    with pytest.warns(DisconnectedWarning, match="2 components"):
        part = cell_map([beams.bcc, beams.octahedron], [[[0]], [[1]]], cell=4)
    assert part.report.matched == 0
    ends = [(2, 2, 0), (2, 2, 4), (2, 0, 2), (2, 4, 2), (0, 2, 2), (4, 2, 2)]
    jack = beams.cell([(2, 2, 2), *ends], [(0, i) for i in range(1, 7)], size=4)
    with pytest.warns(DisconnectedWarning, match="2 beams that end in the air, one of them at"):
        mixed = cell_map([beams.simple_cubic, jack], [[[0, 1, 1, 0]]], cell=4)
    assert mixed.report.dangling == 2  # the middles of two faces; eight ends are on the outside
    assert mixed.report.unmatched == 2 + 8  # and the corners of these faces, which the jacks do not reach


def test_a_function_of_the_cell_s_index():
    stripes = cell_map([beams.bcc, beams.fcc], lambda i, j, k: k % 2, counts=(2, 3, 4), cell=5)
    same = cell_map([beams.bcc(5), beams.fcc(5)], np.broadcast_to([0, 1, 0, 1], (2, 3, 4)), cell=5)
    assert lines(stripes) == lines(same)
