"""LatticeQuery's calls: the laws layer by layer, the kernel's own lattices as oracles, published scripts, clear refusals."""

from __future__ import annotations

import inspect
import math
import subprocess
import sys
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, Solid
from frep.graphs import connectivity
from topologies import beams, lattice_query, tpms
from topologies.lattice_query import (
    bcc_heterogeneous_lattice,
    cubic_heterogeneous_lattice,
    cylinder,
    diamond_heterogeneous_lattice,
    fbcc_heterogeneous_lattice,
    fcc_heterogeneous_lattice,
    gyroid_heterogeneous_lattice,
    gyroid_homogeneous_lattice,
    rco_heterogeneous_lattice,
    schwartz_d_heterogeneous_lattice,
    schwartz_p_heterogeneous_lattice,
    tco_heterogeneous_lattice,
    tcubic_heterogeneous_lattice,
    transition_layer,
)
from topologies.lattice_query_laws import RULES, Law
from topologies.lattice_query_sheets import SolidCellsWarning
from topologies.variants import SealedChannelWarning

RNG = np.random.default_rng(11)


# --- laws ----------------------------------------------------------------------------------------------------------------

sizes = st.floats(0.1, 10.0)


@given(low=sizes, more=sizes, n=st.integers(1, 40))
def test_laws_keep_to_their_range(low, more, n):
    """All but the thesis' parabola, which peaks at min + max (lf-rep 5)."""
    high = low + more
    for rule in RULES:
        layers = Law(rule, low, high, n, 3.0, 2).layers
        top = low + high if rule == "parabola_thesis" else high
        assert len(layers) == n
        assert low - 1e-9 <= layers.min()
        assert layers.max() <= top + 1e-9


@given(n=st.integers(2, 30))
def test_laws_have_the_bounds_of_their_range(n):
    """What is said of the thickest wall is true: a wall of 7 mm leaves the channels of 20 mm cells open (lf-rep 3.4)."""
    for rule in RULES:
        top = 11.0 if rule == "parabola_thesis" else 7.0
        low, high = Law(rule, 4.0, 7.0, n, 20.0, 2).field("cell").bounds([-np.inf] * 3, [np.inf] * 3)
        assert low >= 4.0 - 1e-9
        assert high <= top + 1e-9
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        schwartz_p_heterogeneous_lattice(20, 0.4, 7, 1, 1, n, rule="parabola")


@given(n=st.integers(2, 30))
def test_laws_are_those_of_the_table(n):
    linear, sine, parabola = (Law(rule, 1.0, 6.0, n, 2.0, 2).layers for rule in ("linear", "sin", "parabola"))
    np.testing.assert_allclose(np.diff(linear), 5.0 / (n - 1))
    k = np.arange(n)
    np.testing.assert_allclose(sine, 3.5 + 2.5 * np.sin(k * n / (n - 1)), atol=1e-9)
    np.testing.assert_allclose(parabola, parabola[::-1], atol=1e-9)
    assert parabola[0] == 1.0
    if n % 2:
        assert parabola[n // 2] == pytest.approx(6.0)
        assert Law("parabola_thesis", 1.0, 6.0, n, 2.0, 2).layers[n // 2] == pytest.approx(7.0)


@given(n=st.integers(1, 12), axis=st.integers(0, 2), rule=st.sampled_from(sorted(RULES)))
def test_a_law_as_a_field_is_its_layers(n, axis, rule):
    law = Law(rule, 0.5, 2.0, n, 3.0, axis)
    middles = RNG.uniform(-9, 9, (n + 2, 3))
    middles[:, axis] = 3.0 * (np.arange(-1, n + 1) + RNG.uniform(0.1, 0.9, n + 2))
    expected = law.layers[np.clip(np.arange(-1, n + 1), 0, n - 1)]
    np.testing.assert_allclose(law.field("cell")(middles), expected, atol=1e-9)
    # Continuous: the value of layer k of n at t = k / (n - 1).
    points = np.zeros((n, 3))
    points[:, axis] = 3.0 * n * np.linspace(0, 1, n)
    np.testing.assert_allclose(law.field("point")(points), law.layers, atol=1e-9)


# --- beams ---------------------------------------------------------------------------------------------------------------

CELLS = {
    "cubic": (cubic_heterogeneous_lattice, (), beams.simple_cubic),
    "bcc": (bcc_heterogeneous_lattice, ("bcc",), beams.bcc),
    "sbcc": (bcc_heterogeneous_lattice, ("sbcc",), beams.bcc),
    "bccz": (bcc_heterogeneous_lattice, ("bccz",), beams.bccz),
    "fcc": (fcc_heterogeneous_lattice, ("fcc",), beams.fcc),
    "fccz": (fcc_heterogeneous_lattice, ("fccz",), beams.fccz),
    "sfcc": (fcc_heterogeneous_lattice, ("sfcc",), beams.s_fcc),
    "sfccz": (fcc_heterogeneous_lattice, ("sfccz",), beams.s_fccz),
    "fbcc": (fbcc_heterogeneous_lattice, ("fbcc",), beams.fbcc),
    "sfbcc": (fbcc_heterogeneous_lattice, ("sfbcc",), beams.s_fbcc),
    "sfbccz": (fbcc_heterogeneous_lattice, ("sfbccz",), beams.s_fbccz),
    "diamond": (diamond_heterogeneous_lattice, (), beams.diamond),
    "tco": (tco_heterogeneous_lattice, (0.5,), beams.truncated_cuboctahedron),
    "rco": (rco_heterogeneous_lattice, (0.4, 0.4), lambda u: beams.rhombicuboctahedron(u, tau=0.2 * u)),
    "rco, one": (rco_heterogeneous_lattice, (0.4,), lambda u: beams.rhombicuboctahedron(u, tau=0.2 * u)),
    "tcubic": (tcubic_heterogeneous_lattice, (0.4, 0.4), lambda u: beams.truncated_cube(u, tau=0.2 * u)),
}


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("sample", ["cell", "point"])
def test_one_diameter_is_the_lattice_of_the_kernel(name, sample):
    call, extra, topology = CELLS[name]
    part = call(6.0, 1.0, 1.0, 1.6, 1.6, 4, 3, 3, *extra, sample=sample)
    points = RNG.uniform((6.0, 6.0, 6.0), (18, 12, 12), (400, 3))
    reference = topology(6.0).thicken(1.0, node=1.6)
    # In the middle of the block, where the nearest beam of the endless lattice is one of its own.
    np.testing.assert_allclose(part.field(points), reference.field(points), atol=1e-6)
    np.testing.assert_allclose(part.bounds, [[-0.8] * 3, [24.8, 18.8, 18.8]], atol=1e-9)


@given(k=st.integers(0, 5), rule=st.sampled_from(["linear", "sin", "parabola", "parabola_thesis"]))
def test_every_layer_has_its_own_diameter(k, rule):
    """On the axis of a half-diagonal, at its middle, the field is minus the radius of the layer."""
    part = bcc_heterogeneous_lattice(10, 0.8, 3.0, 0.9, 3.3, 1, 1, 6, rule=rule)
    layers = Law(rule, 0.8, 3.0, 6, 10.0, 2).layers
    for share in (0.25, 0.75):
        middle = np.array([10 * share, 10 * share, 10 * (k + share)])
        across = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
        assert part.field(middle) == pytest.approx(-0.5 * layers[k], abs=1e-6)
        assert part.field(middle + 0.5 * layers[k] * across) == pytest.approx(0.0, abs=1e-6)


@given(k=st.integers(0, 4))
def test_a_node_between_layers_has_the_larger_ball(k):
    """Thin struts, thick balls: the field above a corner is the distance to its ball."""
    part = bcc_heterogeneous_lattice(10, 0.2, 0.2, 1.0, 4.0, 1, 1, 4)
    layers = np.linspace(1.0, 4.0, 4)
    larger = max(layers[max(k - 1, 0)], layers[min(k, 3)])
    corner = np.array([0.0, 0.0, 10.0 * k])
    assert part.field(corner + (-0.5 * larger, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-6)
    if k < 4:
        body = np.array([5.0, 5.0, 10.0 * k + 5.0])
        assert part.field(body + (0.5 * layers[k], 0.0, 0.0)) == pytest.approx(0.0, abs=1e-6)


def test_a_strut_in_a_shared_face_has_the_larger_diameter():
    part = cubic_heterogeneous_lattice(10, 1.0, 3.0, 0, 0, 1, 1, 3)
    radii = [part.field((5.0, 0.0, 10.0 * k)) for k in range(4)]
    np.testing.assert_allclose(radii, [-0.5, -1.0, -1.5, -1.5], atol=1e-6)
    assert part.field((0.0, 0.0, 5.0)) == pytest.approx(-0.5, abs=1e-6)


def test_without_nodes_a_graded_lattice_keeps_its_beams_for_step_files():
    part = bcc_heterogeneous_lattice(10, 1.0, 2.0, 0, 0, 1, 1, 2)
    assert part.beams is not None
    assert part.beams.end_radii is not None
    assert len(part.beams.skeleton.edges) == 16


@pytest.mark.parametrize("n", [2, 5])
def test_the_mesh_has_the_genus_of_the_graph(n):
    """Edges less nodes and one: each cell has 8 beams and its middle, layers share 4 corners (O4)."""
    mesh = bcc_heterogeneous_lattice(10, 1.0, 2.5, 1.1, 2.75, 1, 1, n).mesh(voxel=0.35)
    found = mesh.check()
    assert found.closed
    assert found.components == 1
    assert found.genus == 8 * n - (5 * n + 4) + 1


def test_a_square_section_counts():
    """Differs from LatticeQuery: across the upright strut the square's corner is material."""
    square = fcc_heterogeneous_lattice(10, 2, 2, 0, 0, 1, 1, 1, type="sfccz", c_section="square")
    circle = fcc_heterogeneous_lattice(10, 2, 2, 0, 0, 1, 1, 1, type="sfccz")
    corner = (-0.95, -0.95, 2.0)
    assert square.contains(corner)
    assert not circle.contains(corner)


# --- truncation ----------------------------------------------------------------------------------------------------------


def test_truncation_ends_in_cubes_and_cuboctahedra():
    """O6."""
    points = RNG.uniform(0, 12, (300, 3))
    made = [tcubic_heterogeneous_lattice(6.0, 1, 1, 0, 0, 2, 2, 2, t, t) for t in (0.0, 1.0)]
    for part, reference in zip(made, (beams.simple_cubic(6.0), beams.cuboctahedron(6.0)), strict=True):
        np.testing.assert_allclose(part.field(points), reference.thicken(1).field(points), atol=1e-6)
    octahedra = rco_heterogeneous_lattice(6.0, 1, 1, 0, 0, 2, 2, 2, truncation=1.0)
    np.testing.assert_allclose(octahedra.field(points), beams.octahedron(6.0).thicken(1).field(points), atol=1e-6)


@given(low=st.floats(0.05, 0.5), more=st.floats(0.0, 0.45), n=st.integers(1, 4))
def test_a_graded_truncation_holds_together(low, more, n):
    """Neighbours agree on the truncation at their common corners: one piece, no loose end (lf-rep 6.3)."""
    for call in (tcubic_heterogeneous_lattice, rco_heterogeneous_lattice):
        part = call(10.0, 1, 1, 0, 0, 1, 2, n, low, low + more)
        assert part.beams is not None
        found = connectivity(part.beams.skeleton)
        assert (found.components, len(found.dangling)) == (1, 0)


def test_truncations_are_those_of_the_corners():
    """The upright of a truncated cube is left out near its ends by the truncation of their heights."""
    part = tcubic_heterogeneous_lattice(10.0, 0.2, 0.2, 0, 0, 1, 1, 2, 0.2, 0.8, direction="Z")
    t = 0.5 * 10 * np.linspace(0.2, 0.8, 3)
    for at, inside in (
        (t[0] + 0.1, 1),
        (t[0] - 0.15, 0),
        (10 - t[1] - 0.1, 1),
        (10 - t[1] + 0.15, 0),
        (10 + t[1] + 0.1, 1),
    ):
        assert part.contains((0.0, 0.0, at)) == bool(inside)


def test_tcubic_grades_diameters_along_its_direction():
    part = tcubic_heterogeneous_lattice(10.0, 1.0, 3.0, 0, 0, 3, 1, 1, 0.2, 0.2, direction="X")
    assert part.field((5.0, 0.0, 0.0)) == pytest.approx(-0.5, abs=1e-6)
    assert part.field((25.0, 0.0, 0.0)) == pytest.approx(-1.5, abs=1e-6)


# --- sheets --------------------------------------------------------------------------------------------------------------


def p_fraction(share):
    """O8, with the area of the nodal surface."""
    return 2.3526 * share + np.pi * -4 / 6 * share**3


@pytest.mark.parametrize("sample", ["cell", "point"])
def test_the_thickness_of_schwarz_p_gives_its_volume(sample):
    """O10: Fig. 4.1's law over 10 layers, by the tube formula of each layer, or of each height."""
    part = schwartz_p_heterogeneous_lattice(20, 0.1, 7, 1, 1, 10, sample=sample)
    share = np.linspace(0, 1, 10 if sample == "cell" else 2001)
    expected = p_fraction((0.1 + 6.9 * share) / 20).mean() * 20 * 20 * 200
    with pytest.warns(frep.errors.ThinWallWarning):
        assert part.volume(voxel=0.8) == pytest.approx(expected, rel=0.01)


def test_the_gyroid_is_where_latticequery_has_it():
    """Its octant: from (u/2, 0, u/2) by (3u/8, 0, u/4) in the face y = 0; in z = 0 by (u/4, u/8, 0), in x = 0 by (0, u/4, u/8)."""
    on = np.array([(5, 0, 5), (3.75, 0, 2.5), (2.5, 1.25, 0), (0, 2.5, 1.25)])
    part = gyroid_homogeneous_lattice(10, 0.5, 1, 1, 1)
    inside = np.clip(on, 0.3, 9.7)
    value = tpms.gyroid(10, phase=(math.pi, 0, 0)).distance
    np.testing.assert_allclose(value(on), 0.0, atol=1e-3)
    np.testing.assert_allclose(part.field(inside), np.maximum(abs(value(inside)) - 0.25, -0.3), atol=1e-9)


def test_schwarz_d_holds_its_straight_lines():
    """The skew hexagon of its first octant (lf-rep 3.4)."""
    part = schwartz_d_heterogeneous_lattice(20, 1, 1, 2, 2, 2)
    corners = np.array([(0, 10, 0), (10, 10, 0), (10, 0, 0), (10, 0, 10), (0, 0, 10), (0, 10, 10)])
    line = np.concatenate([corners + s * (np.roll(corners, -1, axis=0) - corners) for s in (0.2, 0.5, 0.8)])
    # One cell further in, clear of the faces of the block.
    np.testing.assert_allclose(part.field(line + 20 * (line < 1)), -0.5, atol=5e-3)


def test_gyroid_thickness_goes_along_its_direction():
    for axis, name in enumerate("xyz"):
        part = gyroid_heterogeneous_lattice(10, 0.5, 2.5, 3, 3, 3, direction=name)
        points = RNG.uniform(1.5, 28.5, (200, 3))
        wall = 0.5 + np.floor(points[:, axis] / 10)
        distance = tpms.gyroid(10, phase=(math.pi, 0, 0)).distance
        # A block's faces are at least 1.5 mm away, its walls at most 1.25.
        np.testing.assert_allclose(part.field(points), abs(distance(points)) - 0.5 * wall, atol=1e-6)


def test_listing_4_says_from_where_on_it_is_solid():
    """u = 4 with 7 mm: sealed beyond 0.471 u, solid beyond 0.866 u (lf-rep 3.4)."""
    with pytest.warns(SealedChannelWarning, match="1.89 mm"), pytest.warns(SolidCellsWarning, match="solid from 3.4"):
        part = schwartz_p_heterogeneous_lattice(4, 0.1, 7, 1, 1, 10)
    top = RNG.uniform((0.1, 0.1, 36.1), (3.9, 3.9, 39.9), (500, 3))
    assert part.contains(top).all()
    assert not part.contains(top - (0, 0, 36)).all()
    with pytest.raises(ArgumentError, match="thickness"):
        schwartz_p_heterogeneous_lattice(4, 5, 7, 1, 1, 10)


# --- transition, cylinder ------------------------------------------------------------------------------------------------


def test_a_transition_is_one_wall_from_gyroid_to_p():
    parts = transition_layer(1.0, 1.0, 20.0, 1, 2)
    np.testing.assert_allclose([p.bounds[:, 0] for p in parts], [(0, 10), (20, 30), (10, 20)])
    part = parts[0] | parts[1] | parts[2]
    # The union's cut faces at 10 and 20 mm are inside it: sheets go on.
    points = RNG.uniform((1, 1, 1), (29, 19, 39), (3000, 3))
    for surface, side in ((tpms.gyroid, points[:, 0] < 8.5), (tpms.schwarz_p, points[:, 0] > 21.5)):
        distance = surface(20, phase=(math.pi, 0, 0)).distance(points[side])
        near = abs(distance) < 1.0
        assert near.sum() > 50
        inside = part.contains(points[side][near])
        sure = abs(abs(distance[near]) - 0.5) > 0.05
        np.testing.assert_array_equal(inside[sure], (abs(distance[near]) < 0.5)[sure])
    # Without the corners, where the block leaves chips of the walls that pass through them.
    found = (part & frep.box((1, 1, 1), (29, 19, 39))).mesh(voxel=0.45).check()
    assert found.closed
    assert found.components == 1


def test_the_halves_of_a_transition_are_the_surfaces_themselves():
    """To the last digit; and between them the middle of the wall is where (1 - w) gyroid + w P is zero (lf-rep 6.4)."""
    u, phase = 20.0, (math.pi, 0.0, 0.0)
    gyroid, schwarz = tpms.gyroid(u, phase=phase), tpms.schwarz_p(u, phase=phase)
    half, other, between = transition_layer(1.0, 1.0, u, 1, 1)
    for part, surface, start in ((half, gyroid, 0.0), (other, schwarz, 20.0)):
        points = RNG.uniform((start + 0.1, 1, 1), (start + 9.9, 19, 19), (2000, 3))
        points = points[np.abs(surface.distance(points)) < 0.8]
        assert len(points) > 50
        box = frep.box((start, 0, 0), (start + 10, u, u))
        np.testing.assert_array_equal(part.field(points), (surface.sheet(1.0) & box).field(points))
    points = RNG.uniform((11, 2, 2), (19, 18, 18), (40_000, 3))
    t = (points[:, 0] - 10) / 10
    w = t * t * (3 - 2 * t)
    level = (1 - w) * gyroid.level(points) + w * schwarz.level(points)
    on = points[np.abs(level) < 2e-3]
    assert len(on) > 20
    np.testing.assert_allclose(between.field(on), -0.5, atol=0.02)


@pytest.mark.parametrize("direction", ["Y+", "Z+", "X-", "Y-", "Z-"])
def test_transitions_are_one_another_turned(direction):
    """Forward ones by a cyclic permutation, backward ones mirrored."""
    points = RNG.uniform((0.5, 0.5, 0.5), (29.5, 19.5, 39.5), (300, 3))
    moved = np.roll(points, "XYZ".index(direction[0]), axis=1)
    if direction[1] == "-":
        moved[:, "XYZ".index(direction[0])] = 30.0 - moved[:, "XYZ".index(direction[0])]
    first, other = (transition_layer(0.5, 2.0, 20.0, 1, 2, d) for d in ("X+", direction))
    for a, b in zip(first, other, strict=True):
        np.testing.assert_allclose(b.field(moved), a.field(points), atol=1e-6)


def test_the_cylinder_of_the_tyre_script():
    """O16: 63 rings, 1296 radial and 168 axial members; true tori."""
    arcs, radials, axials = cylinder(8, 15, 100, 100, 10, 40, 350, 950)
    assert radials.beams is not None
    assert axials.beams is not None
    assert len(radials.beams.skeleton.edges) == 1296
    assert len(axials.beams.skeleton.edges) == 168
    radii, widths = np.linspace(350, 950, 7), np.linspace(10, 40, 7)
    expected = 9 * (2 * np.pi**2 * radii * widths**2).sum()
    assert arcs.volume(voxel=8) == pytest.approx(expected, rel=0.01)
    # Every node of the beams is on the axis of a ring.
    for part in (radials, axials):
        depth = arcs.field(part.beams.skeleton.nodes)
        assert np.all(
            np.abs(depth + widths[np.rint((np.hypot(*part.beams.skeleton.nodes[:, [0, 2]].T) - 350) / 100).astype(int)])
            < 1e-3
        )


# --- CadQuery ------------------------------------------------------------------------------------------------------------


def test_importing_does_not_import_cadquery():
    code = "import sys; import topologies.lattice_query; print('cadquery' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_position_and_rotation_are_those_of_cadquery():
    cq = pytest.importorskip("cadquery")
    plane = cq.Workplane().transformed(rotate=cq.Vector(20, -35, 50), offset=cq.Vector(3, -4, 5)).plane
    here = bcc_heterogeneous_lattice(10, 1, 2, 1.2, 2.4, 1, 1, 2)
    there = bcc_heterogeneous_lattice(10, 1, 2, 1.2, 2.4, 1, 1, 2, position=(3, -4, 5), rotation=(20, -35, 50))
    points = RNG.uniform(0, 20, (60, 3))
    world = np.array([plane.toWorldCoords(tuple(p)).toTuple() for p in points])
    np.testing.assert_allclose(there.field(world), here.field(points), atol=1e-6)


@pytest.mark.parametrize("name", ["XY", "XZ", "YZ", "left"])
def test_workplanes_put_the_part_in_their_axes(name):
    cq = pytest.importorskip("cadquery")
    lattice_query.register()
    workplane = cq.Workplane(name, origin=(1, 2, 3))
    here = schwartz_p_heterogeneous_lattice(10, 1, 2, 1, 1, 2)
    there = workplane.schwartz_p_heterogeneous_lattice(10, 1, 2, 1, 1, 2)
    points = RNG.uniform(0, 12, (60, 3))
    world = np.array([workplane.plane.toWorldCoords(tuple(p)).toTuple() for p in points])
    np.testing.assert_allclose(there.field(world), here.field(points), atol=1e-6)


SCRIPTS = {
    "Listing 3": """
cell, nx, ny, nz = 10, 4, 4, 20
struts, nodes = (0.8, 5.), (0.88, 5.5)
cq.Workplane.bcc_heterogeneous_lattice = bcc_heterogeneous_lattice
result = bcc_heterogeneous_lattice(cell, *struts, *nodes, nx, ny, nz, topology = 'bcc', rule = 'parabola')
""",
    "Listing 4, larger": """
cq.Workplane.schwartz_p_heterogeneous_lattice = schwartz_p_heterogeneous_lattice
result = schwartz_p_heterogeneous_lattice(20, 0.1, 7, 10, 10, 10)
""",
    "FCC by a sine": """
cq.Workplane.fcc_heterogeneous_lattice = fcc_heterogeneous_lattice
result = fcc_heterogeneous_lattice(10, 1, 3, 1.1, 3.3, 1, 1, 10, rule = 'sin')
""",
    "truncated cubes": """
cq.Workplane.tcubic_heterogeneous_lattice = tcubic_heterogeneous_lattice
low, high = 0.001, 0.999
result = tcubic_heterogeneous_lattice(10, 0.5, 4, 0.55, 4.4, 10, 10, 10, low, high,
                                      rule = 'linear', direction = 'X', truncation = 'linear')
""",
    "truncated cubes of one truncation": "result = tcubic_heterogeneous_lattice(10, 1, 3, 1.1, 3.3, 1, 1, 1, 0.4)",
    "rhombicuboctahedra": """
cq.Workplane.rco_heterogeneous_lattice = rco_heterogeneous_lattice
result = rco_heterogeneous_lattice(10, 1, 1, 1.05, 1.05, 10, 1, 10, 0.001, 0.999, 'linear_truncation')
""",
    "truncated cuboctahedra": "result = tco_heterogeneous_lattice(10, 0.5, 0.5, 1.1, 1.1, 1, 1, 1, 0.5)",
    "gyroid": """
cq.Workplane.gyroid_homogeneous_lattice = gyroid_homogeneous_lattice
result = gyroid_homogeneous_lattice(10, 0.1, 2, 2, 2)
""",
    "gyroid along x": "result = gyroid_heterogeneous_lattice(10, 0.2, 0.2, 1, 1, 1, direction = 'x')",
    "transition": "g, p, tr = transition_layer(2., 2., 100., 1, 1, 'Z+'); result = g | p | tr",
    "older names": "result = BCC_heterogeneous_lattice(10, 1, 3, 1.1, 3.3, 2, 2, 2) | schwartz_heterogeneous_lattice(10, 1, 1, 1, 1, 1)",
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_published_scripts_run(name):
    pytest.importorskip("cadquery")
    there: dict = {}
    exec("import cadquery as cq\nfrom topologies.lattice_query import *\n" + SCRIPTS[name], there)
    part = there["result"]
    assert isinstance(part, Solid)
    assert part.is_bounded
    assert part.contains(RNG.uniform(*part.bounds, (20_000, 3))).any()
    lattice_query.register()


def test_arguments_have_the_published_names_and_order():
    """LF-rep Listing 3 and 4, and the public code."""
    struts = ["unit_cell_size", "min_strut_diameter", "max_strut_diameter", "min_node_diameter", "max_node_diameter"]
    cells = ["Nx", "Ny", "Nz"]
    walls = ["unit_cell_size", "min_thickness", "max_thickness", *cells]
    published = {
        cubic_heterogeneous_lattice: [*struts, *cells, "type", "rule"],
        bcc_heterogeneous_lattice: [*struts, *cells, "topology", "rule", "position", "rotation"],
        fcc_heterogeneous_lattice: [*struts, *cells, "type", "rule", "c_section"],
        fbcc_heterogeneous_lattice: [*struts, *cells, "type", "rule"],
        diamond_heterogeneous_lattice: [*struts, *cells, "rule"],
        tco_heterogeneous_lattice: [*struts, *cells, "truncation", "rule"],
        rco_heterogeneous_lattice: [*struts, *cells, "min_truncation", "max_truncation", "rule"],
        tcubic_heterogeneous_lattice: [
            *struts,
            *cells,
            "min_truncation",
            "max_truncation",
            "rule",
            "direction",
            "truncation",
        ],
        gyroid_homogeneous_lattice: ["unit_cell_size", "thickness", *cells],
        gyroid_heterogeneous_lattice: [*walls, "direction"],
        schwartz_p_heterogeneous_lattice: [*walls, "rule"],
        schwartz_d_heterogeneous_lattice: [*walls, "rule"],
        transition_layer: ["min_thickness", "max_thickness", "unit_cell_size", "size_1", "size_2", "direction", "rule"],
    }
    for function, names in published.items():
        assert list(inspect.signature(function).parameters)[: len(names)] == names


# --- refusals ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rule": "parabla"}, "rule.*parabla.*did you mean 'parabola'"),
        ({"topology": "bbc"}, "topology.*did you mean 'bcc'"),
        ({"topology": "BCCZ"}, "did you mean 'bccz'"),
        ({"sample": "node"}, "sample"),
        ({"unit_cell_size": -1}, "unit_cell_size"),
        ({"min_strut_diameter": 3}, "min_strut_diameter.*max_strut_diameter"),
        ({"min_strut_diameter": 0}, "min_strut_diameter"),
        ({"max_node_diameter": math.nan}, "max_node_diameter"),
        ({"min_node_diameter": -0.1}, "min_node_diameter"),
        ({"Nx": 0}, "Nx"),
        ({"rotation": (0, 0)}, "rotation"),
    ],
)
def test_wrong_values_are_named(arguments, message):
    good = dict.fromkeys(("Nx", "Ny", "Nz", "min_strut_diameter", "min_node_diameter"), 1)
    good |= {"unit_cell_size": 10, "max_strut_diameter": 2, "max_node_diameter": 2}
    with pytest.raises(ArgumentError, match=message):
        bcc_heterogeneous_lattice(**{**good, **arguments})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fcc_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, type="sfc"), "type.*sfcc"),
        (lambda: fcc_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, c_section="triangle"), "c_section"),
        (lambda: tcubic_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, 0.2, 1.2), "max_truncation"),
        (lambda: tcubic_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, -0.2, 0.2), "min_truncation"),
        (lambda: tcubic_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, 0.1, 0.2, direction="W"), "direction"),
        (lambda: rco_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1), "truncation"),
        (lambda: tco_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 1, 2.0), "truncation"),
        (lambda: gyroid_heterogeneous_lattice(10, 1, 2, 1, 1, 1, direction="w"), "direction"),
        (lambda: schwartz_p_heterogeneous_lattice(10, 2, 1, 1, 1, 1), "min_thickness"),
        (lambda: transition_layer(1, 2, 10, 1, 1, "x"), "direction.*X"),
        (lambda: transition_layer(1, 2, 10, 1, 1, rule="sine"), "rule.*'sin'"),
        (lambda: cylinder(2, 50, 10, 10, 1, 2, 20, 40), "angle_uc_size"),
        (lambda: cylinder(2, 30, 10, 10, 1, 2, 20, 45), "r_uz_size"),
    ],
)
def test_wrong_choices_are_named(call, message):
    with pytest.raises(ArgumentError, match=message):
        call()


def test_counts_are_whole():
    with pytest.raises(ArgumentTypeError, match="Nz"):
        cubic_heterogeneous_lattice(10, 1, 2, 1, 2, 1, 1, 2.5)  # type: ignore[arg-type]
