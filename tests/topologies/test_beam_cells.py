"""Beam cells: the reference table of LF-rep, Voronoi diagrams as oracles, limits of their parameters, sound meshes."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection, Voronoi

import frep
from frep import ArgumentError, ArgumentTypeError
from frep.skeleton import PeriodicSkeleton
from topologies import beam_cells, beams

U = 10.0
RNG = np.random.default_rng(5)

# lf-rep 3.1: V, E, genus of one cell; V, E, valences and length of a period; fractions with node balls and without; ball radius.
TABLE = {
    "simple_cubic": (8, 12, 5, 1, 3, {6}, 3, 0.02216, 0.02215, 0.055),
    "bcc": (9, 8, 0, 2, 8, {8}, 4 * 3**0.5, 0.04958, 0.04958, 0.055),
    "s_fcc": (12, 16, 5, 3, 8, {4, 8}, 4 * 2**0.5, 0.04059, 0.04056, 0.055),
    "fcc": (14, 24, 11, 4, 12, {4, 12}, 6 * 2**0.5, 0.05991, 0.05988, 0.055),
    "bccz": (9, 12, 4, 2, 9, {8, 10}, 4 * 3**0.5 + 1, 0.05619, 0.05619, 0.055),
    "fccz": (14, 28, 15, 4, 13, {4, 14}, 6 * 2**0.5 + 1, 0.06624, 0.06620, 0.055),
    "s_fccz": (12, 20, 9, 3, 9, {4, 10}, 4 * 2**0.5 + 1, 0.04691, 0.04689, 0.055),
    "fbcc": (15, 32, 18, 5, 20, {4, 8, 20}, 4 * 3**0.5 + 6 * 2**0.5, 0.10448, 0.10444, 0.055),
    "s_fbcc": (13, 24, 12, 4, 16, {4, 8, 16}, 4 * 3**0.5 + 4 * 2**0.5, 0.08619, 0.08617, 0.055),
    "s_fbccz": (13, 28, 16, 4, 17, {4, 8, 18}, 4 * 3**0.5 + 4 * 2**0.5 + 1, 0.09252, 0.09249, 0.055),
    "diamond": (14, 16, 3, 8, 16, {4}, 4 * 3**0.5, 0.05363, 0.04957, 0.08),
    "rhombicuboctahedron": (24, 48, 25, 12, 36, {6}, 12 * 0.6 + 24 * 2**0.5 * 0.2, 0.09492, 0.09181, 0.08),
    "truncated_cube": (24, 36, 13, 6, 15, {5}, 3 * 0.6 + 12 * 2**0.5 * 0.2, 0.03659, 0.03339, 0.08),
}
LENGTHS = {
    "simple_cubic": {1.0},
    "bcc": {3**0.5 / 2},
    "s_fcc": {2**0.5 / 2},
    "fcc": {2**0.5 / 2},
    "bccz": {3**0.5 / 2, 1.0},
    "fccz": {2**0.5 / 2, 1.0},
    "s_fccz": {2**0.5 / 2, 1.0},
    "fbcc": {3**0.5 / 2, 2**0.5 / 2},
    "s_fbcc": {3**0.5 / 2, 2**0.5 / 2},
    "s_fbccz": {3**0.5 / 2, 2**0.5 / 2, 1.0},
    "diamond": {3**0.5 / 4},
    "rhombicuboctahedron": {0.6, 0.2 * 2**0.5},
    "truncated_cube": {0.6, 0.2 * 2**0.5},
}
# The other cells: V, E, valences of a period.
MORE = {
    "octet": (4, 24, {12}),
    "octahedron": (3, 12, {8}),
    "cuboctahedron": (3, 12, {8}),
    "truncated_octahedron": (12, 24, {4}),
    "truncated_cuboctahedron": (24, 48, {4}),
    "rhombic_dodecahedron": (12, 32, {4, 8}),
    "weaire_phelan": (46, 92, {4}),
    "isotruss": (2, 11, {8, 14}),
    "vintiles": (12, 24, {4}),
    "supported_cubic": (4, 10, {4, 6}),
    "hexagonal_honeycomb": (4, 10, {5}),
    "triangular_honeycomb": (2, 8, {8}),
    "kagome": (6, 18, {6}),
    "reentrant": (4, 10, {5}),
}
ALL = [*TABLE, *MORE]
CUBIC = [
    name
    for name in ALL
    if name not in ("diamond", "hexagonal_honeycomb", "triangular_honeycomb", "kagome", "reentrant")
]


def make(name: str, size=U) -> beams.BeamTopology:
    """The cell of a name, truncated where the table is."""
    parameters = {"tau": 0.2 * float(np.min(size))} if name in ("rhombicuboctahedron", "truncated_cube") else {}
    return getattr(beams, name)(size, **parameters)


def periodic(topology: beams.BeamTopology) -> PeriodicSkeleton:
    assert isinstance(topology.skeleton, PeriodicSkeleton)
    return topology.skeleton


def lengths(topology: beams.BeamTopology) -> np.ndarray:
    return np.linalg.norm(np.diff(topology.skeleton.segments(), axis=1)[:, 0], axis=1)


def net(topology: beams.BeamTopology, shift=(0.0, 0.0, 0.0)) -> set[tuple]:
    """The beams of a period in units of the cell, as middles folded into it and directions without sign."""
    ends = topology.skeleton.segments() / periodic(topology).size + np.array(shift)
    found = set()
    for a, b in ends:
        middle = np.mod(np.round(np.mod(0.5 * (a + b), 1.0), 7), 1.0)
        run = np.round(b - a, 7) + 0.0
        run = max(tuple(run.tolist()), tuple((0.0 - run).tolist()))
        found.add((*middle.tolist(), *run))
    assert len(found) == len(ends)
    return found


def tiled(topology: beams.BeamTopology) -> tuple[int, int, set[int]]:
    skeleton = periodic(topology)
    number = beam_cells.folded(skeleton.nodes, skeleton.size)[skeleton.edges]
    valence = np.bincount(number.reshape(-1))
    return len(valence), len(skeleton.edges), set(valence.tolist())


# --- the reference table -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TABLE)
def test_counts_and_lengths_of_the_table(name):
    """O4: nodes, edges, valences, length of a period; and the lengths of single struts."""
    _, _, _, nodes, edges, valences, length, *_ = TABLE[name]
    topology = make(name)
    assert tiled(topology) == (nodes, edges, valences)
    assert lengths(topology).sum() / U == pytest.approx(length)
    assert {round(x, 9) for x in lengths(topology) / U} == {round(x, 9) for x in LENGTHS[name]}


@pytest.mark.parametrize("name", MORE)
def test_counts_of_the_other_cells(name):
    assert tiled(make(name)) == MORE[name]


def unit_table(name: str) -> tuple[np.ndarray, np.ndarray]:
    """All lines of one cell, shared ones as well."""
    parts = {
        "simple_cubic": [beam_cells.cube()],
        "bcc": [beam_cells.body()],
        "s_fcc": [beam_cells.sides()],
        "fcc": [beam_cells.faces()],
        "bccz": [beam_cells.body(), beam_cells.uprights()],
        "fccz": [beam_cells.faces(), beam_cells.uprights()],
        "s_fccz": [beam_cells.sides(), beam_cells.uprights()],
        "fbcc": [beam_cells.body(), beam_cells.faces()],
        "s_fbcc": [beam_cells.body(), beam_cells.sides()],
        "s_fbccz": [beam_cells.body(), beam_cells.sides(), beam_cells.uprights()],
        "diamond": [beam_cells.diamond()],
        "rhombicuboctahedron": [beam_cells.rhombicuboctahedron(0.2)],
        "truncated_cube": [beam_cells.truncated_cube(0.2)],
        "octet": [beam_cells.faces(), beam_cells.truncated_octahedron(0.0)],
        "truncated_octahedron": [beam_cells.truncated_octahedron(0.25)],
        "truncated_cuboctahedron": [beam_cells.truncated_cuboctahedron()],
        "rhombic_dodecahedron": [beam_cells.rhombic_dodecahedron()],
    }
    return beam_cells.table(itertools.chain(*parts[name]))


@pytest.mark.parametrize("name", TABLE)
def test_one_cell_of_the_table(name):
    nodes, edges = unit_table(name)
    v, e, genus, *_ = TABLE[name]
    assert (len(nodes), len(edges), len(edges) - len(nodes) + 1) == (v, e, genus)
    topology = beams.cell(nodes * U, edges, size=U)
    assert net(topology) == net(make(name)), "the cell repeated is the lattice, and passes the checks of a custom cell"


@pytest.mark.parametrize(
    "name", ["bcc", "fcc", "diamond", "truncated_cube", "truncated_cuboctahedron", "rhombic_dodecahedron"]
)
def test_the_mesh_of_one_cell_has_the_handles_of_its_graph(name):
    """O17: genus E - V + 1."""
    nodes, edges = unit_table(name)
    report = beams.graph(nodes * U, edges).thicken(0.7).mesh(voxel=0.23).check()
    assert report.printable
    assert (report.components, report.genus) == (1, len(edges) - len(nodes) + 1)


@pytest.mark.parametrize("name", TABLE)
def test_solid_fractions_of_the_table(name):
    """r = 0.05 u, with balls and without; the reference is known to 0.2 %."""
    *_, with_nodes, struts, ball = TABLE[name]
    topology = make(name)
    # One period, cut at random.
    low = np.array([2.13, 1.71, 0.77])
    for node, expected in ((None, struts), (2 * ball * U, with_nodes)):
        part = topology.thicken(0.1 * U, node=node) & frep.box(low, low + U)
        assert part.volume(voxel=0.125) / U**3 == pytest.approx(expected, rel=2.5e-3)


def test_the_diamond_as_printed_falls_apart():
    """lf-rep 3.1: Table 3.2 prints y - 0.25 u for y - 0.5 u."""
    lines = beam_cells.diamond()
    wrong = [line for line in lines if set(line) != {(0.75, 0.75, 0.75), (1.0, 0.5, 0.5)}]
    assert len(wrong) == 15
    wrong.append(((1.0, 0.25, 0.5), (0.75, 0.5, 0.75)))
    with pytest.warns(beams.DanglingBeamWarning, match="only one beam ends at node"):
        printed = beams.cell(*beam_cells.table(wrong))
    assert {fault.kind for fault in printed.check()} == {"dangling node", "separate parts"}
    assert beams.diamond().check() == []


# --- all cells -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_cells_are_sound_and_hang_together(name):
    """No crossing, no loose end, one part; also in a cuboid cell."""
    assert make(name).check() == []
    assert make(name, (7.0, 9.0, 12.0)).check() == []


@pytest.mark.parametrize("name", ALL)
def test_cells_mesh_closed_and_manifold(name):
    part = make(name).thicken(1.0, node=1.4) & frep.box((1, 2, 3), (13, 12, 14))
    assert part.mesh(voxel=0.45).check().printable


@pytest.mark.parametrize("voxel", [0.7, 0.37, 0.25])
@pytest.mark.parametrize("name", ["octet", "weaire_phelan", "kagome"])
def test_cells_mesh_at_any_resolution(name, voxel):
    part = make(name).thicken(1.4, blend=0.3) & frep.box((0, 0, 0), (10, 10, 10))
    assert part.mesh(voxel=voxel).check().printable


@pytest.mark.parametrize(
    "name", [name for name in ALL if name != "reentrant"]
)  # its ribs depend on the ratio of its sides
def test_cuboid_cells_are_affine_images(name):
    """Three sizes move the nodes; a rectangular period makes the same net."""
    size = np.array((7.0, 9.0, 12.0))
    assert net(make(name, size)) == net(make(name))
    np.testing.assert_allclose(periodic(make(name, size)).size, size)


@pytest.mark.parametrize("name", CUBIC)
def test_cubic_cells_have_mirrors(name):
    """Three mirrors through the centre (supports stand one way up: two)."""
    there = net(make(name))
    for axis in range(2 if name == "supported_cubic" else 3):
        mirrored = set()
        for *middle, i, j, k in there:
            run = np.array([i, j, k])
            middle[axis] = (1.0 - middle[axis]) % 1.0
            run[axis] *= -1.0
            run += 0.0
            mirrored.add((*np.round(middle, 7).tolist(), *max(tuple(run.tolist()), tuple((0.0 - run).tolist()))))
        assert mirrored == there


# --- parameters ----------------------------------------------------------------------------------------------------------


def test_truncation_runs_from_the_cube_to_the_octahedron_and_the_cuboctahedron():
    """O6: tau = 0 is simple cubic; at u/2 the nets are the same, half a cell apart; nodes have merged."""
    cube = net(beams.simple_cubic(U))
    assert net(beams.truncated_cube(U, tau=0)) == cube
    assert net(beams.rhombicuboctahedron(U, tau=0)) == cube
    full, round_ = beams.truncated_cube(U, tau=U / 2), beams.rhombicuboctahedron(U, tau=U / 2)
    assert net(full) == net(round_, (0.5, 0.5, 0.5)) == net(beams.cuboctahedron(U))
    assert net(round_) == net(beams.octahedron(U))
    assert (len(full.skeleton.nodes), len(round_.skeleton.nodes)) == (12, 6)


@given(st.floats(0.01, 0.49))
def test_lengths_of_truncated_cells(share):
    """O6: L(tau)."""
    tau = share * U
    root = math.sqrt(2)
    assert lengths(beams.rhombicuboctahedron(U, tau=tau)).sum() == pytest.approx(12 * (U - 2 * tau) + 24 * root * tau)
    assert lengths(beams.truncated_cube(U, tau=tau)).sum() == pytest.approx(3 * (U - 2 * tau) + 12 * root * tau)
    setback = lengths(beams.truncated_octahedron(U, setback=tau))
    assert setback.sum() == pytest.approx(12 * root * tau + 12 * root * (U / 2 - tau))


def test_archimedean_cells_have_equal_edges():
    """u = 2 tau + sqrt 2 tau (LF-rep 3.21); Kelvin's sqrt 2 / 4 u (O13); the truncated cuboctahedron."""
    for topology, edge in (
        (beams.rhombicuboctahedron(U), 0.41421356 * U),
        (beams.truncated_cube(U), 0.41421356 * U),
        (beams.truncated_octahedron(U), math.sqrt(2) / 4 * U),
        (beams.truncated_cuboctahedron(U), U / (1 + 2 * math.sqrt(2))),
    ):
        np.testing.assert_allclose(lengths(topology), edge)


def test_setback_runs_from_the_octahedron_to_the_cuboctahedron():
    """Part C of the LatticeRobot specification."""
    assert net(beams.truncated_octahedron(U, setback=0)) == net(beams.octahedron(U))
    assert net(beams.truncated_octahedron(U, setback=U / 2)) == net(beams.cuboctahedron(U))
    assert net(beams.truncated_octahedron(U)) == net(beams.truncated_octahedron(U, setback=U / 4))


def test_truncation_of_a_cuboid_cell_is_along_its_shortest_side():
    topology = beams.truncated_cube((8, 10, 20), tau=4)
    assert net(topology) == net(beams.cuboctahedron(U))
    assert net(beams.truncated_cube((8, 10, 20), tau=2)) == net(beams.truncated_cube(8, tau=2))


def test_nearly_degenerate_truncation_merges():
    for tau in (1e-12, U / 2 - 1e-12):
        nearest = round(tau / U * 2) / 2 * U
        assert net(beams.truncated_cube(U, tau=tau)) == net(beams.truncated_cube(U, tau=nearest))


def test_vintiles_is_kelvin_half_a_cell_up():
    """IntraLattice's nodes, written out: on z = 0 the middles (0, 1/4), between them (0, 1/2, 1/4), a square at half height."""
    assert net(beams.vintiles(U)) == net(beams.truncated_octahedron(U), (0, 0, 0.5))
    nodes = np.array([(0, 1, 0), (1, 0, 0), (0, 2, 1), (2, 0, 1), (2, 1, 2), (1, 2, 2)]) / 4
    have = {tuple(p) for p in np.round(np.mod(beams.vintiles(1.0).skeleton.nodes, 1.0), 9)}
    assert {tuple(p) for p in nodes} <= have


@given(st.floats(0.1, 1.2), st.floats(2, 8), st.floats(0.05, 0.9))
def test_reentrant_ribs_keep_their_lengths_while_the_cell_widens(angle, slanted, share):
    """Hinged ribs of fixed length: a smaller angle makes the cell wider and taller at once."""
    rib = slanted * math.sin(angle) * (1.05 + share) * 2  # so long that the waist stays open
    sizes = []
    for lean in (angle, 0.7 * angle):
        size = (2 * slanted * math.cos(lean), 2 * (rib - slanted * math.sin(lean)), 5.0)
        have = {round(x, 6) for x in lengths(beams.reentrant(size, angle=lean)).tolist()}
        assert have == {round(x, 6) for x in (rib, slanted, 5.0)}
        sizes.append(size)
    assert sizes[1][0] > sizes[0][0]
    assert sizes[1][1] > sizes[0][1]


@pytest.mark.parametrize("name", ["hexagonal_honeycomb", "triangular_honeycomb", "kagome"])
def test_honeycombs_are_regular(name):
    """All beams in the plane are equally long, in as many directions as they have; one number sets the period."""
    topology = make(name)
    flat = np.abs(np.diff(topology.skeleton.segments(), axis=1)[:, 0, 2]) < 1e-9
    edge = {"hexagonal_honeycomb": U / math.sqrt(3), "triangular_honeycomb": U, "kagome": U / 2}[name]
    np.testing.assert_allclose(lengths(topology)[flat], edge)
    np.testing.assert_allclose(lengths(topology)[~flat], U)


def fourth_moments(topology: beams.BeamTopology, weight: float) -> np.ndarray:
    """Sum of n n n n over the beams, times length and weight: stiffness to first order (Gurtner and Durand 2014)."""
    run = np.diff(topology.skeleton.segments(), axis=1)[:, 0]
    length = np.linalg.norm(run, axis=1)
    n = run / length[:, None]
    return weight * np.einsum("m,mi,mj,mk,ml->ijkl", length, n, n, n, n)


def test_isotruss_is_isotropic_with_the_diameters_of_its_docstring():
    ratio = 0.75 * math.sqrt(2 / math.sqrt(3))
    total = fourth_moments(beams.simple_cubic(U), 1.0) + fourth_moments(beams.bcc(U), ratio**2)
    turned = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    rotated = np.einsum("ijkl,ai,bj,ck,dl->abcd", total, turned, turned, turned, turned)
    np.testing.assert_allclose(rotated, total, atol=1e-9 * total.max())
    assert net(beams.isotruss(U)) == net(beams.simple_cubic(U)) | net(beams.bcc(U))


def test_supported_cubic_has_no_long_bridge():
    run = np.diff(beams.supported_cubic(U).skeleton.segments(), axis=1)[:, 0]
    rise = np.abs(run[:, 2]) / np.linalg.norm(run, axis=1)
    flat = rise < 1e-9
    assert np.linalg.norm(run[flat], axis=1).max() == pytest.approx(U / 2)
    assert np.all(rise[~flat] > math.sin(math.pi / 4) - 1e-9)


def test_columns_stand_at_the_nodes_of_their_honeycomb():
    for pattern, name in (
        ("hexagonal", "hexagonal_honeycomb"),
        ("triangular", "triangular_honeycomb"),
        ("kagome", "kagome"),
    ):
        pins = beams.columns(U, pattern=pattern)
        assert net(pins) <= net(make(name))
        assert [fault.kind for fault in pins.check()] == ["separate parts"]
    assert net(beams.combine(beams.bcc(U), beams.columns(U))) == net(beams.bccz(U))


# --- foams: Voronoi diagrams as oracles ----------------------------------------------------------------------------------

FCC = [(0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0)]
BCC = [(0, 0, 0), (0.5, 0.5, 0.5)]
A15 = [*BCC, (0.25, 0, 0.5), (0.75, 0, 0.5), (0.5, 0.25, 0), (0.5, 0.75, 0), (0, 0.5, 0.25), (0, 0.5, 0.75)]
IMAGES = np.array(list(itertools.product(range(-2, 3), repeat=3)), float)


def voronoi_net(sites) -> set[tuple]:
    """The edges of a periodic Voronoi diagram, as `net` tells them."""
    points = (np.array(sites)[None] + IMAGES[:, None]).reshape(-1, 3)
    diagram = Voronoi(points)
    edges = set()
    for ridge in diagram.ridge_vertices:
        corners = diagram.vertices[ridge]
        if -1 in ridge or np.any(corners < -0.6) or np.any(corners > 1.6):
            continue
        # Qhull numbers a vertex of more than four cells several times: corners at one place are one.
        distinct = [p for i, p in enumerate(corners) if np.linalg.norm(p - corners[i - 1]) > 1e-6]
        rounded = [tuple(np.round(p, 10).tolist()) for p in distinct]
        edges |= {tuple(sorted((rounded[i - 1], p))) for i, p in enumerate(rounded)}
    nodes, pairs = beam_cells.table(edges)
    return net(beams.cell(nodes, pairs, size=1.0, check=False))


@pytest.mark.parametrize(
    ("topology", "sites"),
    [
        (beams.rhombic_dodecahedron(U), FCC),
        (beams.truncated_octahedron(U), [(0.5 + x, 0.5 + y, 0.5 + z) for x, y, z in BCC]),
        (beams.weaire_phelan(U, equal=False), A15),
    ],
    ids=["rhombic_dodecahedron", "truncated_octahedron", "weaire_phelan"],
)
def test_foams_are_voronoi_diagrams(topology, sites):
    assert net(topology) == voronoi_net(sites)


@pytest.mark.parametrize("equal", [True, False])
def test_weaire_phelan_is_a_power_diagram_of_equal_cells(equal):
    """The faces lie where |x - s|^2 - w is equal, w of the 6c sites from c = 5/16 - w; volumes 4 c^3 and the rest."""
    c = 32 ** (-1 / 3) if equal else 5 / 16
    points = (np.array(A15)[None] + IMAGES[:, None]).reshape(-1, 3)
    power = np.tile([0.0, 0.0] + 6 * [5 / 16 - c], len(IMAGES))
    nodes = beams.weaire_phelan(1.0, equal=equal).skeleton.nodes
    folded = {tuple(p) for p in np.round(np.mod(np.round(nodes, 7), 1.0), 7)}
    seen, volumes = set(), []
    for site, own in zip(A15, [0.0, 0.0] + 6 * [5 / 16 - c], strict=True):
        s = np.array(site)
        away = points - s
        near = (np.linalg.norm(away, axis=1) < 1.3) & (np.linalg.norm(away, axis=1) > 1e-9)
        # 2 x.(t - s) <= |t|^2 - |s|^2 - w_t + w_s
        level = (points[near] ** 2).sum(axis=1) - s @ s - power[near] + own
        planes = np.column_stack([2 * away[near], -level])
        corners = HalfspaceIntersection(planes, s).intersections
        volumes.append(ConvexHull(corners).volume)
        seen |= {tuple(p) for p in np.round(np.mod(np.round(corners, 7), 1.0), 7)}
    assert seen == folded
    assert volumes[:2] == pytest.approx([4 * c**3] * 2)
    assert volumes == pytest.approx([1 / 8] * 8 if equal else [4 * c**3] * 2 + [(1 - 8 * c**3) / 6] * 6)


# --- groups and custom cells ---------------------------------------------------------------------------------------------


def test_the_cubic_family_composes():
    """Table 3.1: FBCC = BCC with FCC, and so on; order and repetition do not matter."""
    z = beams.columns(U)
    for whole, parts in (
        ("fbcc", (beams.bcc(U), beams.fcc(U))),
        ("s_fbccz", (beams.s_fcc(U), z, beams.bcc(U), z)),
        ("fccz", (z, beams.fcc(U))),
        ("octet", (beams.octahedron(U), beams.fcc(U))),
    ):
        assert net(beams.combine(*parts)) == net(make(whole))
        assert net(beams.combine(*reversed(parts))) == net(make(whole))
    assert repr(beams.combine(beams.bcc(U), z)) == "<bcc + columns: 9 nodes, 9 beams>"


@pytest.mark.parametrize("name", ["bcc", "octet", "weaire_phelan", "kagome"])
def test_a_cell_does_not_depend_on_how_it_is_written(name):
    """Edges in another order, turned round, and shifted by whole periods, node by node and beam by beam."""
    skeleton = periodic(make(name))
    ends = skeleton.segments()
    ends = ends + RNG.integers(-2, 3, (len(ends), 1, 3)) * skeleton.size
    ends[::2] = ends[::2, ::-1]
    nodes, edges = beam_cells.table((ends[RNG.permutation(len(ends))] / skeleton.size).tolist())
    again = beams.cell(nodes * skeleton.size, edges, size=skeleton.size)
    assert net(again) == net(make(name))
    assert again.check() == []
    points = RNG.uniform(-5, 25, (300, 3))
    values = make(name).thicken(0.8, blend=0.3).field(points)
    np.testing.assert_allclose(again.thicken(0.8, blend=0.3).field(points), values, atol=1e-9)


BOX = [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (0.0, 0.0, 10.0)]
FRAME = [(0, 1), (0, 2), (0, 3)]
GONE = [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0)]
FAULTY = {
    "coincident nodes": (
        [*BOX, (0, 10, 0), (5, 5, 5)],
        [*FRAME, (4, 5), (5, 1)],
        r"nodes: node 2 and node 4 are both at \(0, 10, 0\) mm",
    ),
    "nearly coincident nodes": (
        [*BOX, (0, 0.002, 0), (5, 5, 5)],
        [*FRAME, (4, 5), (5, 1)],
        r"nodes: node 0 and node 4 are 0\.002 mm apart",
    ),
    "nearly matching nodes": (
        [(0, 0, 0), (10, 0, 0.001), (0, 10, 0), (0, 0, 10)],
        FRAME,
        r"node 0 at \(0, 0, 0\) mm misses node 1 at \(10, 0, 0\.001\) mm across the period by 0\.001 mm",
    ),
    "unmatched nodes": (
        [(0, 5, 5), (5, 5, 5), (10, 5.5, 5), (5, 0, 5), (5, 10, 5)],
        [(0, 1), (1, 2), (1, 3), (1, 4)],
        r"node 0 at .* and node 2 at \(10, 5\.5, 5\) mm face each other across the period in x .* by 0\.5 mm",
    ),
    "a beam longer than the period": (
        [(0, 0, 0), (10.4, 0, 0)],
        [(0, 1)],
        r"node 0 at \(0, 0, 0\) mm and node 1 at \(10\.4, 0, 0\) mm face each other across the period in x .* by 0\.4 mm",
    ),
    "a beam shorter than the period": (
        [(0.3, 0, 0), (10, 0, 0)],
        [(0, 1)],
        r"node 0 at \(0\.3, 0, 0\) mm and node 1 at \(10, 0, 0\) mm face each other across the period in x .* by 0\.3 mm",
    ),
    "overlap": (
        [*BOX, (4, 0, 0), (5, 5, 5)],
        [*FRAME, (0, 4), (4, 5), (5, 1)],
        r"edges: edge 0 and edge 3 run along each other at \(2, 0, 0\) mm",
    ),
    "overlap across the period": (
        [*BOX, (14, 0, 0), (5, 5, 5)],
        [*FRAME, (1, 4), (4, 5), (5, 1)],
        r"edges: edge 0 and edge 3 run along each other at \(2, 0, 0\) mm",
    ),
    "own copy": ([(0, 0, 0), (20, 0, 0)], [(0, 1)], r"edges: edge 0 and its copy run along each other"),
    "crossing": (
        [(0, 0, 0), (10, 10, 0), (10, 0, 0), (0, 10, 0)],
        [(0, 1), (2, 3)],
        r"edges: edge 0 and edge 1 cross at \(5, 5, 0\) mm",
    ),
    "crossing across the period": (
        [(8, 0, 1), (12, 0, 1), (1, -2, 1), (1, 2, 1)],
        [(0, 1), (2, 3)],
        r"edges: edge 0 and edge 1 cross at \(1, 0, 1\) mm",
    ),
    "a node on a beam": (
        [*BOX, (5, 0, 0), (5, 5, 5)],
        [*FRAME, (4, 5), (5, 1)],
        r"edges: edge 0 and edge 3 cross at \(5, 0, 0\) mm",
    ),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("case", FAULTY)
def test_a_faulty_cell_is_refused_with_which_and_where(case):
    nodes, edges, message = FAULTY[case]
    with pytest.raises(ArgumentError, match=message):
        beams.cell(nodes, edges, size=10)
    assert beams.cell(nodes, edges, size=10, check=False).check(), "and told, where it was taken as it is"


def test_a_crossing_with_a_node_is_sound():
    nodes = [(0, 0, 0), (10, 10, 0), (10, 0, 0), (0, 10, 0), (5, 5, 0), (0, 0, 10)]
    topology = beams.cell(nodes, [(0, 4), (4, 1), (2, 4), (4, 3), (0, 5)], size=10)
    assert topology.check() == []


def test_crossings_of_groups_are_refused():
    across = beams.cell([(0, 5, 5), (10, 5, 5)], [(0, 1)], size=10, label="across")
    with pytest.raises(ArgumentError, match=r"^topologies: bcc and across do not fit .* cross at \(5, 5, 5\) mm"):
        beams.combine(beams.bcc(U), across)
    assert len(periodic(beams.combine(beams.bcc(U), across, check=False)).edges) == 9


def test_loose_ends_are_warned_of():
    nodes = [*BOX, (3, 3, 3)]
    with pytest.warns(beams.DanglingBeamWarning, match=r"node 4 at \(3, 3, 3\) mm"):
        topology = beams.cell(nodes, [*FRAME, (0, 4)], size=10)
    assert [(fault.kind, fault.items, fault.point) for fault in topology.check()] == [
        ("dangling node", (4,), (3.0, 3.0, 3.0))
    ]
    with pytest.warns(beams.DanglingBeamWarning, match="on the face x = 10, and none continues beyond it"):
        beams.cell([*BOX, (10, 4, 4)], [*FRAME, (1, 4)], size=10)


def test_a_node_without_a_beam_is_warned_of():
    """Its ball would hang in the air; a copy, a period away, of a node with beams is none."""
    with pytest.warns(beams.DanglingBeamWarning, match=r"no beam ends at node 4 at \(3, 3, 3\) mm"):
        topology = beams.cell([*BOX, (3, 3, 3)], FRAME, size=10)
    assert [(fault.kind, fault.items) for fault in topology.check()] == [("lone node", (4,))]
    assert topology.thicken(1, node=2).contains([(3, 3, 3)]).all()
    with pytest.warns(beams.DanglingBeamWarning, match="no beam ends at node 4"):
        beams.cell([*BOX, (13, -7, 3)], FRAME, size=10)
    assert beams.cell([*BOX, (10, 10, 10)], FRAME, size=10).check() == []


def test_parts_that_interpenetrate_are_told():
    """Two cubic nets through each other's cells are two parts, though one period of each hangs together."""
    two = beams.combine(
        beams.simple_cubic(U), beams.cell([(5, 5, 5), (15, 5, 5), (5, 15, 5), (5, 5, 15)], FRAME, size=U)
    )
    assert [fault.message for fault in two.check()] == ["edges: the lattice falls into 2 parts that never touch"]
    # One beam a direction, two periods long: eight cubic nets.
    nodes, edges = np.array([(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2)]), np.array(FRAME)
    assert beam_cells.pieces(nodes, edges, np.ones(3)) == 8
    assert beam_cells.pieces(nodes, edges[:2], np.ones(3)) == math.inf


def exact_meeting(p, q) -> bool:
    """Whether two segments of whole numbers meet elsewhere than at ends of both; exactly."""

    def dot(a, b):
        return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))

    (p0, p1), (q0, q1) = p, q
    d = [Fraction(b - a) for a, b in zip(p0, p1, strict=True)]
    e = [Fraction(b - a) for a, b in zip(q0, q1, strict=True)]
    r = [Fraction(a - b) for a, b in zip(p0, q0, strict=True)]
    a, b, c = dot(d, d), dot(d, e), dot(e, e)
    if a * c == b * b:
        along = sorted((-dot(r, d) / a, (b - dot(r, d)) / a))
        beside = a * dot(r, r) == dot(r, d) ** 2
        return beside and min(along[1], 1) > max(along[0], 0)
    s = (b * dot(e, r) - c * dot(d, r)) / (a * c - b * b)
    t = (a * dot(e, r) - b * dot(d, r)) / (a * c - b * b)
    gap = [x + s * y - t * z for x, y, z in zip(r, d, e, strict=True)]
    return not any(gap) and 0 <= s <= 1 and 0 <= t <= 1 and not (s in (0, 1) and t in (0, 1))


WHOLE = st.tuples(*[st.integers(-3, 6)] * 3)


@given(st.lists(WHOLE, min_size=4, max_size=4, unique=True), st.sampled_from([3, 4]))
def test_meetings_across_the_period_are_found_exactly(points, period):
    """Against rational arithmetic over all shifts that could matter."""
    nodes, edges = np.array(points, float), np.array([(0, 1), (2, 3)])
    size = np.full(3, float(period))
    kinds = {fault.kind for fault in beam_cells.faults(nodes, edges, size)}
    if len(beam_cells.distinct_edges(nodes, edges, size)) < 2:
        return
    p, q = points[:2], points[2:]
    # Boxes of coordinates -3 to 6 are apart after a shift by 10.
    shifts = list(itertools.product(range(-3 * period, 3 * period + 1, period), repeat=3))

    def moved(segment, shift):
        return [tuple(x + s for x, s in zip(point, shift, strict=True)) for point in segment]

    def boxes_touch(first, second):
        return all(
            min(a) <= max(b) and min(b) <= max(a)
            for a, b in zip(zip(*first, strict=True), zip(*second, strict=True), strict=True)
        )

    pairs = [(p, moved(q, s)) for s in shifts]
    pairs += [(x, moved(x, s)) for x in (p, q) for s in shifts if any(s)]
    expected = any(exact_meeting(x, y) for x, y in pairs if boxes_touch(x, y))
    assert bool(kinds & {"crossing beams", "overlapping beams"}) == expected


# --- refusals ------------------------------------------------------------------------------------------------------------

X = frep.coordinates()[0]
BAD = [
    (r"tau: expected 0 to 5 mm", ArgumentError, lambda: beams.truncated_cube(U, tau=5.1)),
    (r"tau: expected 0 to 5 mm.*got -0.1", ArgumentError, lambda: beams.rhombicuboctahedron(U, tau=-0.1)),
    (r"tau: expected 0 to 2 mm", ArgumentError, lambda: beams.rhombicuboctahedron((4, 9, 9), tau=3)),
    (r"\btau\b", ArgumentError, lambda: beams.truncated_cube(U, tau=math.nan)),
    (r"\btau\b", ArgumentTypeError, lambda: beams.truncated_cube(U, tau="much")),  # type: ignore[arg-type]
    (r"\btau\b", ArgumentTypeError, lambda: beams.truncated_cube(U, tau=X)),  # type: ignore[arg-type]
    (r"setback: expected 0 to 5 mm", ArgumentError, lambda: beams.truncated_octahedron(U, setback=6)),
    (r"angle: expected more than 0 and less than 0.7854 rad", ArgumentError, lambda: beams.reentrant(U, angle=1.0)),
    (r"\bangle\b", ArgumentError, lambda: beams.reentrant(U, angle=0)),
    (r"pattern: expected one of 'square'", ArgumentError, lambda: beams.columns(U, pattern="round")),  # type: ignore[arg-type]
    (r"did you mean 'hexagonal'", ArgumentError, lambda: beams.columns(U, pattern="hexagon")),  # type: ignore[arg-type]
    (
        r"nodes: .* 2 of 4 nodes .* node 1: \[nan",
        ArgumentError,
        lambda: beams.cell([BOX[0], *GONE, BOX[3]], FRAME, size=U),
    ),
    (
        r"edges: .* edge 1 joins 0 and 7 \(and 1 more\)",
        ArgumentError,
        lambda: beams.graph(BOX, [(0, 1), (0, 7), (9, 0)]),
    ),
    (r"edges: .* 1 of 2 edges .* edge 1", ArgumentError, lambda: beams.graph(BOX, [(0, 1), (0, math.nan)])),
    (r"size: .* got 1 x 1 x 1, .* reach over 10 x 10 x 10 mm; .*edge 0", ArgumentError, lambda: beams.cell(BOX, FRAME)),
    (r"\bcell\b", ArgumentError, lambda: beams.kagome(0)),
    (r"\bcell\b", ArgumentError, lambda: beams.octet((1, 2, -3))),
    (r"\bcell\b", ArgumentTypeError, lambda: beams.hexagonal_honeycomb(X)),
    (r"\btopologies\b", ArgumentError, lambda: beams.combine()),
    (r"topologies: .* 10 x 10 x 10 and 5 x 5 x 5", ArgumentError, lambda: beams.combine(beams.bcc(10), beams.fcc(5))),
    (r"\btopologies\b.*place 2", ArgumentTypeError, lambda: beams.combine(beams.bcc(10), beams.graph(BOX, FRAME))),
    (r"\btopologies\b", ArgumentTypeError, lambda: beams.combine("bcc")),  # type: ignore[arg-type]
    (r"\bcheck\b", ArgumentTypeError, lambda: beams.graph(BOX, FRAME).check()),
]


@pytest.mark.parametrize(("message", "error", "call"), BAD)
def test_bad_input_names_the_argument(message, error, call):
    with pytest.raises(error, match=message):
        call()
