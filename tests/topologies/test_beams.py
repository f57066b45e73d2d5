"""Beam topologies: counts of Table 3.1, closed-form volumes, the frame rule, merged nodes and edges, clear refusals."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import quad

import frep
from frep import ArgumentError, ArgumentTypeError, EmptyError, Solid
from frep.arguments import DegreesWarning
from topologies import beams, tpms

RNG = np.random.default_rng(2)
X, Y, Z = frep.coordinates()


def ball_over_frustum(r1: float, r2: float, length: float) -> float:
    """Volume of a sphere-swept cone (O5)."""
    s = (r1 - r2) / length
    c = math.sqrt(1 - s * s)
    a, b, h = r1 * c, r2 * c, length - s * (r1 - r2)
    caps = [math.pi * q * q * (3 * r - q) / 3 for r, q in ((r1, r1 * (1 + s)), (r2, r2 * (1 - s)))]
    return math.pi * h / 3 * (a * a + a * b + b * b) + sum(caps)


def simple_cubic_volume(u: float, r: float, ball: float = 0.0) -> float:
    """O5, tiled, one cell."""
    if ball:
        return 3 * math.pi * r**2 * u + 4 / 3 * math.pi * ball**3 - 4 * math.pi * (ball**3 - (ball**2 - r**2) ** 1.5)
    return 3 * math.pi * r**2 * u - 8 * math.sqrt(2) * r**3


# --- topology ----------------------------------------------------------------------------------------------------------


def tiled(topology: beams.BeamTopology) -> tuple[int, int, set[int], float]:
    """Distinct nodes and edges of a period, valences, and the length of the beams over a cell side."""
    skeleton = topology.skeleton
    size = np.asarray(skeleton.size)
    ends = np.round(np.mod(np.round(skeleton.segments() / size, 9), 1.0), 9).reshape(-1, 3) % 1.0
    _, number, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    segments = skeleton.segments()
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
    return number.max() + 1, len(skeleton.edges), set(count.tolist()), length / size[0]


def test_simple_cubic_and_bcc_have_the_counts_of_the_table():
    """O4: nodes, edges, valence and length of a tiled cell."""
    assert tiled(beams.simple_cubic(7)) == (1, 3, {6}, pytest.approx(3.0))
    assert tiled(beams.bcc(7)) == (2, 8, {8}, pytest.approx(4 * math.sqrt(3)))
    nodes, edges, valence, _ = tiled(beams.bcc((3, 4, 5)))
    assert (nodes, edges, valence) == (2, 8, {8})


def test_edges_that_coincide_after_a_shift_are_one():
    box = [(i, j, k) for i in (0.0, 4.0) for j in (0.0, 4.0) for k in (0.0, 4.0)]
    frame = [(0, 1), (0, 2), (0, 4), (7, 6), (7, 5), (7, 3), (1, 5), (1, 0)]
    topology = beams.cell(box, frame, size=4)
    assert len(topology.skeleton.edges) == 3
    points = RNG.uniform(-6, 6, (500, 3))
    reference = beams.simple_cubic(4).thicken(1).field(points)
    np.testing.assert_allclose(topology.thicken(1).field(points), reference, atol=1e-9)


def test_edges_on_one_line_that_differ_stay():
    """Half edges of a line are not copies of each other."""
    topology = beams.cell([(0, 0, 0), (1, 0, 0), (4, 0, 0)], [(0, 1), (1, 2)], size=4)
    assert len(topology.skeleton.edges) == 2
    long = beams.cell([(0, 0, 0), (8, 0, 0)], [(0, 1)], size=4, check=False)
    points = RNG.uniform(-6, 6, (300, 3))
    np.testing.assert_allclose(topology.thicken(1).field(points), long.thicken(1).field(points), atol=1e-9)


def test_custom_cell_is_bcc():
    """Another choice of cell, in other numbers, of the same lattice."""
    centre = [(2, 2, 2)]
    corners = [(2 + i, 2 + j, 2 + k) for i in (-2, 2) for j in (-2, 2) for k in (-2, 2)]
    topology = beams.cell(centre + corners, [(0, i) for i in range(1, 9)], size=4)
    points = RNG.uniform(-9, 9, (500, 3))
    for make in (lambda t: t.thicken(0.7), lambda t: t.thicken(0.7, node=1.1, blend=0.3)):
        np.testing.assert_allclose(make(topology).field(points), make(beams.bcc(4)).field(points), atol=1e-9)


def test_graph_edges_given_twice_count_once():
    nodes = [(0, 0, 0), (5, 0, 0), (5, 5, 0)]
    once, twice = beams.graph(nodes, [(0, 1), (1, 2)]), beams.graph(nodes, [(0, 1), (1, 2), (1, 0), (0, 1)])
    assert len(twice.skeleton.edges) == 2
    points = RNG.uniform(-2, 7, (300, 3))
    np.testing.assert_array_equal(once.thicken(1, blend=0.4).field(points), twice.thicken(1, blend=0.4).field(points))


def test_nodes_given_twice_are_warned_of():
    """A list of segments, each with its own ends, looks right and falls into as many parts."""
    nodes, edges = [(0, 0, 0), (5, 0, 0), (5, 0, 0), (5, 5, 0)], [(0, 1), (2, 3)]
    with pytest.warns(beams.CoincidentNodesWarning, match=r"1 of 4 .* nodes 1 and 2 at \(5, 0, 0\) mm"):
        apart = beams.graph(nodes, edges)
    assert apart.connectivity().components == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = frep.graphs.merged([apart.skeleton]).skeleton
        assert beams.graph(one.nodes, one.edges).connectivity().components == 1


def test_a_node_has_one_diameter_in_all_cells():
    cubic = beams.simple_cubic(10)
    with pytest.raises(ArgumentError, match=r"diameter: nodes 0 and 1 are one, a period apart, and have 1 and 3 mm"):
        cubic.thicken([1, 3, 1, 1, 1, 1, 1, 1])
    with pytest.raises(ArgumentTypeError, match="diameter"):
        cubic.thicken([X] * 8)
    with pytest.raises(ArgumentError, match=r"diameter: .* 1 of 8 nodes .* node 3: nan"):
        cubic.thicken([1, 1, 1, math.nan, 1, 1, 1, 1])
    with pytest.raises(ArgumentError, match=r"node: nodes 0 and 7 "):
        cubic.thicken(1, node=[2, 2, 2, 2, 2, 2, 2, 0])
    points = np.random.default_rng(1).uniform(0, 10, (200, 3))
    np.testing.assert_allclose(cubic.thicken([2] * 8).field(points), cubic.thicken(2).field(points), atol=1e-12)
    # Thick at the hearts of the cells, and as the same beams written out.
    centred = beams.bcc(10)
    block = centred.over(((-10, -10, -10), (20, 20, 20)))
    thick = [np.where(np.mod(t.skeleton.nodes, 10).any(axis=1), 3.0, 1.0) for t in (centred, block)]
    np.testing.assert_allclose(
        centred.thicken(thick[0]).field(points), block.thicken(thick[1]).field(points), atol=1e-12
    )


def test_node_balls_of_a_period_count_once():
    """With a blend, a ball that stood twice at one node would bulge."""
    topology = beams.simple_cubic(5)
    thick = topology.thicken(0.6, node=2.0, blend=0.2)
    away = np.array([0.5, 0.5, 0.5]) / math.sqrt(0.75)
    assert thick.field(1.3 * away) == pytest.approx(0.3, abs=1e-9), "only the ball is near: the value is its distance"


def test_lattices_repeat_and_mirror():
    part = beams.bcc((4, 5, 6)).thicken(0.9, node=1.2, blend=0.3)
    points = RNG.uniform(0, 6, (400, 3))
    values = part.field(points)
    np.testing.assert_allclose(part.field(points + np.array([8, -5, 12])), values, atol=1e-9)
    np.testing.assert_allclose(part.field(points * np.array([-1, 1, 1])), values, atol=1e-9)


# --- volumes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("r", "ball"), [(0.5, 0.0), (1.0, 0.0), (0.6, 1.0), (0.8, 1.9)])
def test_simple_cubic_volume(r, ball):
    """O5: 3 pi r^2 u - 8 sqrt(2) r^3, and with node balls."""
    u = 5.0
    # A whole period, cut anywhere but along the beams.
    part = beams.simple_cubic(u).thicken(2 * r, node=2 * ball or None) & frep.box((2, 2, 2), (2 + u, 2 + u, 2 + u))
    expected = simple_cubic_volume(u, r, ball)
    assert part.volume(voxel=0.1) == pytest.approx(expected, rel=3e-3)
    mesh = part.mesh(voxel=0.1, polish=True)
    assert mesh.volume == pytest.approx(expected, rel=3e-3)
    assert mesh.check().printable


def test_simple_cubic_area_is_the_derivative_of_the_volume():
    """O5: 6 pi r u - 24 sqrt(2) r^2 inside, less the caps' own area on the faces."""
    u, r, cells = 5.0, 0.8, 2
    # Cut midway between nodes: caps are discs.
    lo, hi = np.full(3, 0.5 * u), np.full(3, (cells + 0.5) * u)
    part = beams.simple_cubic(u).thicken(2 * r) & frep.box(lo, hi)
    walls = cells**3 * (6 * math.pi * r * u - 24 * math.sqrt(2) * r**2)
    caps = 6 * cells**2 * math.pi * r**2
    areas = [part.mesh(voxel=h, polish=True).area for h in (0.16, 0.08)]
    # Chamfered edges lose area in proportion to the voxel, or faster.
    assert areas[1] == pytest.approx(walls + caps, rel=6e-3)
    assert abs(areas[1] - walls - caps) < 0.6 * abs(areas[0] - walls - caps)


def test_bcc_volume_fraction():
    """The numeric fraction of lf-rep 3.1: r = 0.05 u struts only, 0.04958."""
    u = 10.0
    octant = beams.bcc(u).thicken(0.1 * u) & frep.box((0, 0, 0), (u / 2, u / 2, u / 2))
    assert octant.volume(voxel=0.05) / (u / 2) ** 3 == pytest.approx(0.04958, rel=4e-3)


def test_bcc_part_of_a_thousand_cells():
    """14,913 mm3 (14,902 by fine quadrature) at a quarter millimetre, where a strut is three voxels thick."""
    part = beams.bcc(5.0).thicken(0.8) & frep.box((0, 0, 0), (50, 50, 50))
    assert part.volume(voxel=0.25) == pytest.approx(14_913, rel=3e-3)


def test_polished_mesh_of_thin_struts():
    part = beams.bcc(5.0).thicken(0.8) & frep.box((0, 0, 0), (20, 20, 20))
    expected = 14_913 * (20 / 50) ** 3
    mesh = part.mesh(voxel=0.25, polish=True)
    assert mesh.volume == pytest.approx(expected, rel=0.03)
    assert mesh.check().printable


def test_one_beam_is_a_capsule():
    """O5: pi r^2 L + 4/3 pi r^3."""
    a, b, d = np.array([1.0, 2, 3]), np.array([4.0, -2, 3.5]), 1.6
    part = beams.graph([a, b], [(0, 1)]).thicken(d)
    points = RNG.uniform(-4, 8, (500, 3))
    np.testing.assert_allclose(part.field(points), frep.capsule(a, b, d / 2).field(points), atol=1e-9)
    length = float(np.linalg.norm(b - a))
    expected = math.pi * 0.64 * length + 4 / 3 * math.pi * 0.512
    assert part.volume(voxel=0.08) == pytest.approx(expected, rel=3e-3)
    np.testing.assert_allclose(part.bounds, [np.minimum(a, b) - 0.8, np.maximum(a, b) + 0.8], atol=1e-9)


@pytest.mark.parametrize(("r1", "r2"), [(1.5, 0.5), (0.3, 1.2), (1.0, 1.0)])
def test_tapered_beam_is_a_sphere_swept_cone(r1, r2):
    length = 4.0
    part = beams.graph([(0, 0, 0), (0, 0.6 * length, 0.8 * length)], [(0, 1)]).thicken([2 * r1, 2 * r2])
    assert part.volume(voxel=0.08) == pytest.approx(ball_over_frustum(r1, r2, length), rel=3e-3)
    assert part.mesh(voxel=0.1, polish=True).volume == pytest.approx(ball_over_frustum(r1, r2, length), rel=3e-3)


def test_the_formula_of_the_swept_cone_agrees_with_quadrature():
    """The oracle itself: slices of the union of balls."""
    r1, r2, length = 1.5, 0.5, 4.0

    def radius_squared(t: float) -> float:
        s = np.linspace(0, 1, 20001)
        return float(max(0.0, (((1 - s) * r1 + s * r2) ** 2 - (t - s * length) ** 2).max()))

    volume = quad(lambda t: math.pi * radius_squared(t), -r1, length + r2, limit=200)[0]
    assert ball_over_frustum(r1, r2, length) == pytest.approx(volume, rel=1e-5)


def test_a_ball_that_holds_the_other_end():
    part = beams.graph([(0, 0, 0), (1, 0, 0)], [(0, 1)]).thicken([6.0, 1.0])
    points = RNG.uniform(-4, 4, (300, 3))
    np.testing.assert_allclose(part.field(points), frep.sphere((0, 0, 0), 3).field(points), atol=1e-9)


# --- sections ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fillet", [0.0, 0.3, 0.6, 1.0])
def test_rounded_square_prism(fillet):
    """O7: area delta^2 - (4 - pi) rho^2, times the length between flat ends."""
    side, length = 2.0, 5.0
    part = beams.graph([(0, 0, 0), (0.6 * length, 0.8 * length, 0)], [(0, 1)]).thicken(
        side, section=beams.square(fillet=fillet)
    )
    area = side**2 - (4 - math.pi) * fillet**2
    assert part.volume(voxel=0.08) == pytest.approx(area * length, rel=6e-3)
    across = np.array([-0.8, 0.6, 0])
    assert part.field(np.array([1.5, 2, 0]) + 1.3 * across) == pytest.approx(0.3), "the first side is horizontal"
    assert part.field([1.5, 2, 1.25]) == pytest.approx(0.25)


def test_fillet_of_half_the_side_is_a_circle():
    nodes, edges = [(0, 0, 0), (3, 4, 2)], [(0, 1)]
    squared = beams.graph(nodes, edges).thicken(2, section=beams.square(fillet=1.0))
    points = RNG.uniform(-3, 7, (400, 3))
    cylinder = frep.cylinder(nodes[0], nodes[1], 1.0)
    np.testing.assert_allclose(squared.field(points), cylinder.field(points), atol=1e-9)


def test_sections_do_not_depend_on_the_direction_of_an_edge():
    """The frame rule of lf-rep 3.2."""
    nodes = RNG.uniform(0, 10, (12, 3))
    nodes[1] = nodes[0] + (0, 0, 5)  # one vertical beam
    edges = np.array([(0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (10, 11)])
    points = RNG.uniform(-2, 12, (800, 3))
    for section in ("circle", "square", beams.square(fillet=0.2)):
        forth = beams.graph(nodes, edges).thicken(1.0, section=section, blend=0.2)
        back = beams.graph(nodes, edges[:, ::-1]).thicken(1.0, section=section, blend=0.2)
        np.testing.assert_allclose(forth.field(points), back.field(points), atol=1e-9)


def test_vertical_squares_stand_along_x():
    part = beams.graph([(0, 0, 0), (0, 0, 8)], [(0, 1)]).thicken(2, section="square")
    np.testing.assert_allclose(part.field([[1.5, 0.9, 4], [0.9, -1.5, 4], [1, 1, 4]]), [0.5, 0.5, 0], atol=1e-12)


def test_fillet_may_vary_along_the_beam():
    """Square at one end, a circle at the other (lf-rep 5)."""
    part = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)]).thicken(
        2, section=beams.square(fillet=frep.clip(X / 10, 0, 1))
    )
    corner = np.array([[x, 0.9, 0.9] for x in (1.0, 5.0, 9.0)])
    assert (part.field(corner) < 0).tolist() == [True, False, False]


def test_diameter_is_read_where_the_point_is():
    law = 1 + 0.1 * X
    part = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)]).thicken(law)
    for x in (2.0, 5.0, 8.0):
        assert part.field([x, 0.5 * (1 + 0.1 * x), 0]) == pytest.approx(0, abs=1e-12)


def test_square_beams_with_balls_and_blend_mesh():
    part = beams.simple_cubic(5).thicken(1.2, section=beams.square(0.2), node=2.0, blend=0.3) & frep.box(
        (0,) * 3, (10,) * 3
    )
    assert part.mesh(voxel=0.2).check().printable


def test_bounds_of_a_graph_hold_its_material():
    nodes, edges = RNG.uniform(0, 10, (8, 3)), [(i, i + 1) for i in range(7)]
    top = beams.graph(nodes, edges)
    made: list[Solid] = [
        top.thicken(1.0),
        top.thicken(1.0, node=2.5),
        top.thicken(1.0, blend=1.5),
        top.thicken(np.linspace(0.5, 3, 8)),
        top.thicken(1.0, section="square"),
        top.thicken(0.5 + 0.3 * abs(X), node=1 + 0.3 * abs(Y)),
        top.thicken(1.0, blend=0.5 + 0.1 * abs(Z)),
    ]
    points = RNG.uniform(-15, 25, (30000, 3))
    for part in made:
        outside = np.any((points < part.bounds[0]) | (points > part.bounds[1]), axis=1)
        assert np.all(part.field(points[outside]) > 0)


def test_widths_are_features():
    part = beams.bcc(5).thicken(1 + 0.1 * X)
    assert [f.what for f in part.features] == ["beam"]
    assert part.features[0].width is frep.as_field(1 + 0.1 * X)
    tapered = beams.graph([(0, 0, 0), (5, 0, 0)], [(0, 1)]).thicken([1.0, 0.4])
    assert float(tapered.features[0].width) == pytest.approx(0.4)


# --- moved -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("axis", "angle"), [("y", -math.pi / 4), ((1, 2, 3), 0.7), ("z", math.pi / 2), ("x", 0.0)])
def test_a_turned_lattice_is_the_solid_turned(axis, angle):
    topology, center = beams.bcc((4, 5, 6)), (1, -2, 3)
    points = RNG.uniform(-12, 12, (500, 3))
    made = topology.rotate(axis, angle, center).translate((0.3, -7, 2)).thicken(0.9, node=1.3, blend=0.2)
    expected = topology.thicken(0.9, node=1.3, blend=0.2).rotate(axis, angle, center).translate((0.3, -7, 2))
    np.testing.assert_allclose(made.field(points), expected.field(points), atol=1e-9)
    assert not made.is_bounded


def test_widths_of_a_moved_are_read_in_the_world():
    """At every point the value is that of a lattice of the constant width that the law has there."""
    axis, angle, center = (1, 2, 3), 0.7, (1, -2, 3)
    width, ball, round_ = 1 + 0.05 * X, 1.2 + 0.04 * frep.sin(Y), 0.2 + 0.01 * Z
    moved = beams.fcc(6).rotate(axis, angle, center)
    graded = moved.thicken(width, node=ball, blend=round_)
    assert graded.features[0].width is frep.as_field(width)
    for point in RNG.uniform(-8, 8, (40, 3)):
        widths = [float(frep.as_field(f)(point)) for f in (width, ball, round_)]
        plain = beams.fcc(6).thicken(widths[0], node=widths[1], blend=widths[2]).rotate(axis, angle, center)
        assert graded.field(point) == pytest.approx(float(plain.field(point)), abs=1e-9)
    square = moved.thicken(width, section=beams.square(0.05 * (3 + frep.cos(Z))))
    for point in RNG.uniform(-8, 8, (20, 3)):
        fillet = beams.square(0.05 * (3 + math.cos(point[2])))
        plain = beams.fcc(6).thicken(1 + 0.05 * point[0], section=fillet).rotate(axis, angle, center)
        assert square.field(point) == pytest.approx(float(plain.field(point)), abs=1e-9)


def test_a_turned_lattice_meshes_with_the_volume_it_had():
    """A ball of the lattice, turned about its centre, holds what the ball held before."""
    ball = frep.sphere((2, 2, 2), 6)
    plain, moved = beams.bcc(4), beams.bcc(4).rotate((1, 2, 3), 0.7, (2, 2, 2))
    parts = [topology.thicken(0.8) & ball for topology in (plain, moved)]
    volumes = [part.volume(voxel=0.2) for part in parts]
    assert volumes[0] == pytest.approx(volumes[1], rel=4e-3)
    assert parts[1].mesh(voxel=0.2).check().printable


def test_graphs_move_node_by_node():
    strut = beams.graph([(0, 0, 0), (10, 0, 0)], [(0, 1)])
    there = strut.rotate("z", math.pi / 2, (10, 0, 0)).translate((1, 2, 3))
    np.testing.assert_allclose(there.skeleton.nodes, [[11, -8, 3], [11, 2, 3]], atol=1e-12)
    assert there.placement is None


# --- explicit graphs ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("move", [lambda t: t, lambda t: t.rotate((1, 2, 3), 0.7, (5, 0, 0)).translate((0.2, 0.1, 5))])
@pytest.mark.parametrize("make", [beams.bcc, beams.kagome, beams.vintiles, beams.diamond])
def test_the_graph_of_a_region_is_the_lattice_there(make, move):
    topology, box = move(make(4)), ((-3, 1, 2), (6.5, 7, 9))
    explicit = topology.over(box, margin=2.0)
    points = RNG.uniform(*box, (800, 3))
    periodic, graph = topology.thicken(0.7, node=1.0).field(points), explicit.thicken(0.7, node=1.0).field(points)
    near = periodic < 1.4  # farther beams than the margin are not there
    np.testing.assert_allclose(graph[near], periodic[near], atol=1e-9)
    assert near.mean() > 0.5
    solid = topology.over(frep.box(*box), margin=2.0)
    np.testing.assert_array_equal(solid.skeleton.nodes, explicit.skeleton.nodes)


def test_a_trimmed_lattice_ends_on_the_body():
    body = frep.sphere((1, 2, 3), 9)
    with pytest.warns(frep.DisconnectedWarning, match=r"octet falls into \d+ parts"):
        inside = beams.octet(5).trimmed(body)
    nodes, cut = inside.skeleton.nodes, inside.report.cut
    assert body.field(nodes).max() <= 1e-7
    np.testing.assert_allclose(body.field(nodes[cut]), 0, atol=1e-7)
    assert set(inside.connectivity().dangling.tolist()) <= set(cut.tolist())
    points = RNG.uniform(-4, 8, (500, 3))
    points = points[body.field(points) < -1.0]
    np.testing.assert_allclose(
        (inside.thicken(0.8).field(points) < 0), (beams.octet(5).thicken(0.8).field(points) < 0), atol=0
    )
    half = beams.octet(5).over(body).trimmed(frep.half_space((0, 0, 1), (0, 0, 2.5)))
    assert half.skeleton.nodes[:, 2].max() == pytest.approx(2.5)


ARCH = beams.graph([(0, 0, 0), (0, 0, 10), (6, 0, 10), (6, 0, 4)], [(0, 1), (1, 2), (2, 3)])
BELOW = frep.half_space("z", (0, 0, 8))  # leaves its feet, 8 and 4 mm


def test_what_is_cut_loose_is_told():
    with pytest.warns(frep.DisconnectedWarning, match=r"2 parts .*hold 0\.33 of .*connected=True"):
        feet = ARCH.trimmed(BELOW)
    assert feet.connectivity().components == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = ARCH.trimmed(BELOW, connected=True)
        ARCH.trimmed(frep.half_space("z", (0, 0, 11)))
        feet.trimmed(frep.half_space("z", (0, 0, 6)))  # two before, two after
    np.testing.assert_array_equal(np.sort(one.skeleton.nodes[:, 2]), [0, 8])
    np.testing.assert_array_equal(one.skeleton.nodes[one.report.cut], [(0, 0, 8)])
    np.testing.assert_array_equal(np.sort(one.report.nodes), [-1, 0])
    np.testing.assert_array_equal(one.report.beams, [0])


def test_divided_beams_are_the_same_lattice():
    points = RNG.uniform(-6, 6, (300, 3))
    for topology in (beams.bcc(4), beams.bcc(4).over(((-9, -9, -9), (9, 9, 9))), beams.bcc(4).rotate("x", 0.3)):
        fine = topology.subdivided(1.0)
        assert len(fine.skeleton.edges) == 4 * len(topology.skeleton.edges)
        np.testing.assert_allclose(fine.thicken(1).field(points), topology.thicken(1).field(points), atol=1e-9)


def test_groups_that_were_moved_alike_combine():
    def move(t):
        return t.rotate("x", 0.3).translate((1, 2, 3))

    points = RNG.uniform(-6, 6, (300, 3))
    one = beams.combine(move(beams.bcc(4)), move(beams.columns(4))).thicken(0.6).field(points)
    np.testing.assert_array_equal(one, move(beams.bccz(4)).thicken(0.6).field(points))
    with pytest.raises(ArgumentError, match=r"topologies: .* were not moved alike"):
        beams.combine(beams.bcc(4), move(beams.columns(4)))
    assert move(beams.columns(4)).check()[0].kind == "separate parts"


# --- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "turn",
    [
        lambda by: beams.bcc(5).rotate("z", by),
        lambda by: frep.box((0, 0, 0), (1, 1, 1)).rotate("z", by),
        lambda by: tpms.gyroid(5, rotation=("z", by)),
    ],
)
def test_degrees_are_warned_of(turn):
    """45 is a legal angle, of seven turns; a full turn and all below is taken without a word."""
    with pytest.warns(DegreesWarning, match=r"45 rad is 7\.16 turns; .*math\.radians\(45\), which is 0\.7854 rad"):
        turn(45)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        turn(-2.0 * math.pi)
        turn(8 * (math.pi / 4))


N2 = [(0, 0, 0), (1, 0, 0)]
ONE = beams.graph(N2, [(0, 1)])
BAD = [
    ("nodes", ArgumentError, lambda: beams.graph([(0, 0), (1, 0)], [(0, 1)])),
    ("nodes", ArgumentError, lambda: beams.graph([(0, 0, 0), (1, math.nan, 0)], [(0, 1)])),
    ("nodes", ArgumentTypeError, lambda: beams.graph([(0, 0, "a"), (1, 0, 0)], [(0, 1)])),
    ("nodes", ArgumentTypeError, lambda: beams.graph(X, [(0, 1)])),
    ("nodes", ArgumentError, lambda: beams.graph(np.empty((0, 3)), [(0, 1)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, 2)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, -1)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, 0.5)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, math.nan)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, math.inf)])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [])),
    ("edges", ArgumentError, lambda: beams.graph(N2, [(0, 1, 1)])),
    ("edge", ArgumentError, lambda: beams.graph(N2, [(1, 1)])),
    ("edge", ArgumentError, lambda: beams.cell([(0, 0, 0), (1, 0, 0), (1, 0, 0)], [(0, 1), (1, 2)], size=2)),
    ("size", ArgumentError, lambda: beams.cell(N2, [(0, 1)], size=0)),
    ("size", ArgumentError, lambda: beams.cell(N2, [(0, 1)], size=(1, 1, math.inf))),
    ("size", ArgumentTypeError, lambda: beams.cell(N2, [(0, 1)], size=X)),
    ("cell", ArgumentError, lambda: beams.bcc(-5)),
    ("cell", ArgumentTypeError, lambda: beams.simple_cubic("large")),
    ("diameter", ArgumentError, lambda: ONE.thicken(0)),
    ("diameter", ArgumentError, lambda: ONE.thicken(-1)),
    ("diameter", ArgumentError, lambda: ONE.thicken(math.nan)),
    ("diameter", ArgumentError, lambda: ONE.thicken([1.0])),
    ("diameter", ArgumentError, lambda: ONE.thicken([1.0, 0.0])),
    ("diameter", ArgumentError, lambda: ONE.thicken([1.0, math.inf])),
    ("diameter", ArgumentTypeError, lambda: ONE.thicken(["thin", "thick"])),
    ("diameter", ArgumentTypeError, lambda: ONE.thicken([X, X])),
    ("diameter", ArgumentTypeError, lambda: ONE.thicken("thick")),
    ("diameter", ArgumentError, lambda: ONE.thicken([1.0, 2.0], section="square")),
    ("node", ArgumentError, lambda: ONE.thicken(1, node=0)),
    ("node", ArgumentTypeError, lambda: ONE.thicken(1, node="big")),
    ("section", ArgumentError, lambda: ONE.thicken(1, section="triangle")),
    ("fillet", ArgumentError, lambda: beams.square(-0.1)),
    ("blend", ArgumentError, lambda: ONE.thicken(1, blend=-1)),
    ("blend", ArgumentError, lambda: ONE.thicken(1, blend=math.nan)),
    ("axis", ArgumentTypeError, lambda: ONE.rotate("w", 1)),
    ("angle", ArgumentError, lambda: beams.bcc().rotate("x", math.inf)),
    ("center", ArgumentError, lambda: beams.bcc().rotate("x", 1, (0, 0))),
    ("vector", ArgumentTypeError, lambda: beams.bcc().translate("up")),
    ("region", frep.UnboundedError, lambda: beams.bcc().over(frep.half_space((0, 0, 1)))),
    ("region", ArgumentError, lambda: beams.bcc().over(((0, 0, 0), (1, 1, 0)))),
    ("region", ArgumentTypeError, lambda: beams.bcc().over("all")),
    ("region", EmptyError, lambda: ONE.over(((5, 5, 5), (6, 6, 6)))),
    ("margin", ArgumentError, lambda: beams.bcc().over(((0, 0, 0), (1, 1, 1)), margin=-1)),
    ("solid", ArgumentError, lambda: beams.bcc().trimmed(frep.half_space((0, 0, 1)))),
    ("solid", ArgumentTypeError, lambda: ONE.trimmed(((0, 0, 0), (1, 1, 1)))),
    ("solid", EmptyError, lambda: ONE.trimmed(frep.sphere((5, 5, 5), 1))),
    ("length", ArgumentError, lambda: ONE.subdivided(0)),
    ("connectivity", ArgumentTypeError, lambda: beams.bcc().connectivity()),
    ("check", ArgumentTypeError, lambda: ONE.check()),
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
