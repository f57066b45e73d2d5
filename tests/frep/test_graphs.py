"""Graphs: beams of a box against brute force, lengths in balls in closed form, unions, bridges, pieces, connectivity
against networkx."""

from __future__ import annotations

import itertools
import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, EmptyError, TooLargeError, graphs
from frep.skeleton import GraphSkeleton, PeriodicSkeleton

RNG = np.random.default_rng(5)
whole = st.integers(-3, 3)
counts = st.integers(1, 3)


def faces_of_cube(u: float) -> PeriodicSkeleton:
    """FCC: both diagonals of three faces, in halves."""
    nodes, edges = [np.zeros(3)], []
    for axis in range(3):
        a, b = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3]]
        middle = len(nodes)
        nodes.append(0.5 * (a + b))
        for corner in (0 * a, a, b, a + b):
            nodes.append(corner)
            edges.append((middle, len(nodes) - 1))
    return PeriodicSkeleton(u * np.array(nodes), np.array(edges), np.full(3, u))


def random_cell(random: np.random.Generator, size=(2.0, 3.0, 2.5)) -> PeriodicSkeleton:
    """Beams in all directions, some longer than the cell."""
    nodes = random.uniform(-2, 5, (8, 3))
    return PeriodicSkeleton(nodes, np.array([(0, 1), (2, 3), (4, 5), (6, 7), (1, 2), (3, 6)]), np.array(size))


def random_graph(random: np.random.Generator, n: int = 40, m: int = 60, span: float = 20.0) -> GraphSkeleton:
    pairs = np.array(list(itertools.combinations(range(n), 2)))
    return GraphSkeleton(random.uniform(-span / 2, span / 2, (n, 3)), random.permutation(pairs)[:m])


def length(skeleton) -> float:
    ends = skeleton.segments()
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


def lines(skeleton, digits: int = 6) -> set[frozenset]:
    return {frozenset(tuple((np.round(p, digits) + 0.0).tolist()) for p in beam) for beam in skeleton.segments()}


def is_clean(skeleton: GraphSkeleton) -> bool:
    """Nodes distinct and used, edges distinct and of some length."""
    pairs = {tuple(sorted(edge)) for edge in skeleton.edges.tolist()}
    places = {tuple(p) for p in np.round(skeleton.nodes, 7).tolist()}
    return (
        len(pairs) == len(skeleton.edges)
        and len(places) == len(skeleton.nodes)
        and all(a != b for a, b in pairs)
        and set(itertools.chain.from_iterable(pairs)) == set(range(len(skeleton.nodes)))
    )


# --- out of a periodic skeleton ---------------------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(st.tuples(whole, whole, whole), st.tuples(counts, counts, counts), st.sampled_from([0.1, 2.5, 7.3]))
def test_a_box_of_whole_cells_has_their_beams_and_those_of_its_faces(first, count, u):
    low = u * np.array(first, float)
    nx_, ny, nz = count
    found = graphs.cut_out(faces_of_cube(u), np.array([low, low + u * np.array(count)]))
    faces = (nx_ + 1) * ny * nz + nx_ * (ny + 1) * nz + nx_ * ny * (nz + 1)
    corners = (nx_ + 1) * (ny + 1) * (nz + 1)
    assert len(found.edges) == 4 * faces
    assert len(found.nodes) == corners + faces
    assert is_clean(found)
    np.testing.assert_allclose(found.bounds, [low, low + u * np.array(count)], atol=1e-12 * u)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_the_beams_of_a_box_are_those_of_brute_force(seed):
    random = np.random.default_rng(seed)
    skeleton = random_cell(random)
    low = random.uniform(-8, 8, 3)
    box = np.array([low, low + random.uniform(0.5, 6, 3)])
    expected, shares = set(), np.linspace(0, 1, 4001)[:, None]
    for shift in itertools.product(range(-9, 10), repeat=3):
        for a, b in skeleton.segments() + skeleton.size * np.array(shift):
            if np.all(np.maximum(a, b) >= box[0]) and np.all(np.minimum(a, b) <= box[1]):
                points = a + shares * (b - a)
                if np.all((points >= box[0]) & (points <= box[1]), axis=1).any():
                    expected.add(frozenset(tuple((np.round(p, 6) + 0.0).tolist()) for p in (a, b)))
    if not expected:
        with pytest.raises(EmptyError, match="region"):
            graphs.cut_out(skeleton, box)
        return
    found = graphs.cut_out(skeleton, box)
    # Brute force looks at points: it may miss what only clips a corner.
    assert expected <= lines(found)
    assert len(lines(found)) - len(expected) <= 1
    assert is_clean(found)


def test_a_solid_stands_for_its_bounds_and_a_graph_for_itself():
    cell = faces_of_cube(2.0)
    box = np.array([[0, 0, 0], [6.0, 4.0, 2.0]])
    found = graphs.cut_out(cell, frep.box(*box))
    assert lines(found) == lines(graphs.cut_out(cell, box))
    part = np.array([[0, 0, 0], [2.0, 2.0, 2.0]])
    assert lines(graphs.cut_out(found, part)) == lines(graphs.cut_out(cell, part))


def test_beams_that_only_touch_the_box_stay_out_and_short_ones_stay_in():
    places = np.array([[0, 0, 0], [1.0, 0, 0], [2.0, 1.0, 0], [2.0, 1.0 + 1e-6, 0]])
    strut = GraphSkeleton(places, np.array([(0, 1), (1, 2), (2, 3)]))
    assert len(graphs.cut_out(strut, np.array([[0, -1, -1], [1.0, 1, 1]])).edges) == 1
    assert len(graphs.cut_out(strut, np.array([[1.0, 0, 0], [200, 200, 200]])).edges) == 2


def test_too_many_beams_are_refused_before_they_are_made():
    with pytest.raises(TooLargeError, match="region"):
        graphs.cut_out(faces_of_cube(0.001), np.array([[0, 0, 0], [100.0, 100, 100]]))


# --- in a solid -------------------------------------------------------------------------------------------------------


def length_in_ball(skeleton, centre, radius: float) -> float:
    a, b = np.moveaxis(skeleton.segments(), 1, 0)
    along = b - a
    size = np.linalg.norm(along, axis=1)
    middle = np.einsum("ij,ij->i", centre - a, along) / size
    off2 = np.sum((a + (middle / size)[:, None] * along - centre) ** 2, axis=1)
    half = np.sqrt(np.maximum(radius**2 - off2, 0.0))
    return float(np.maximum(np.minimum(middle + half, size) - np.maximum(middle - half, 0.0), 0.0).sum())


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(6, 12))
def test_the_length_of_beams_in_a_ball(seed, radius):
    random = np.random.default_rng(seed)
    skeleton, centre = random_graph(random), random.uniform(-4, 4, 3)
    ball = frep.sphere(centre, radius)
    found = graphs.trimmed(skeleton, ball, step=0.05)
    assert length(found.skeleton) == pytest.approx(length_in_ball(skeleton, centre, radius), abs=1e-3)
    values = ball.field(found.skeleton.nodes)
    assert values.max() <= 1e-7
    np.testing.assert_allclose(values[found.cut], 0.0, atol=1e-6)
    kept = found.nodes >= 0
    np.testing.assert_array_equal(found.skeleton.nodes[kept], skeleton.nodes[found.nodes[kept]])
    assert set(np.flatnonzero(~kept)) == set(found.cut)
    # Every piece lies on the beam that it is said to be of.
    for piece, (a, b) in zip(found.skeleton.segments(), skeleton.segments()[found.beams], strict=True):
        off = np.linalg.norm(np.cross(piece - a, b - a), axis=1) / np.linalg.norm(b - a)
        assert off.max() < 1e-9


def test_what_is_in_and_what_is_out_is_all():
    """A beam that comes and goes: through a shell, four crossings."""
    shell = frep.sphere((0, 0, 0), 8).shell(2.0)
    skeleton = random_graph(np.random.default_rng(3))
    inside, outside = graphs.trimmed(skeleton, shell), graphs.trimmed(skeleton, ~shell)
    assert length(inside.skeleton) + length(outside.skeleton) == pytest.approx(length(skeleton), abs=1e-5)
    across = GraphSkeleton(np.array([[-10.0, 0, 0], [10, 0, 0]]), np.array([[0, 1]]))
    found = graphs.trimmed(across, shell)
    assert sorted(found.skeleton.nodes[:, 0].round(9).tolist()) == [-8, -6, 6, 8]
    assert found.beams.tolist() == [0, 0]


def test_whole_cells_keep_all_their_beams():
    """O15: a body of whole cells trims nothing, and beams in its faces stay."""
    box = np.array([[-7.3, 0, 0], [14.6, 7.3, 21.9]])
    skeleton = graphs.cut_out(faces_of_cube(7.3), box)
    found = graphs.trimmed(skeleton, frep.box(*box))
    assert lines(found.skeleton) == lines(skeleton)
    assert len(found.cut) == 0
    turned = frep.box(*box).rotate((1, 2, 3), 0.7)
    there = GraphSkeleton(np.array([p @ rotation((1, 2, 3), 0.7).T for p in skeleton.nodes]), skeleton.edges)
    found = graphs.trimmed(there, turned)
    assert len(found.skeleton.edges) == len(skeleton.edges)
    assert len(found.cut) == 0


def rotation(axis, angle: float) -> np.ndarray:
    u = np.array(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def test_half_of_mirror_symmetric_cells():
    """O15: a half-space through mid-planes keeps exactly half."""
    box = np.array([[0, 0, 0], [4.0, 4, 2]])
    skeleton = graphs.cut_out(faces_of_cube(2.0), box)
    found = graphs.trimmed(skeleton, frep.half_space((0, 0, 1), (0, 0, 1.0)))
    assert length(found.skeleton) == pytest.approx(0.5 * length(skeleton))


def test_beams_that_cross_at_one_place_share_their_cut():
    star = GraphSkeleton(np.array([[-1.0, 0, 0], [1, 0, 0], [-1, 1, 0], [1, -1, 0]]), np.array([(0, 1), (2, 3)]))
    found = graphs.trimmed(star, frep.half_space((1, 0, 0)))
    assert len(found.cut) == 1
    assert graphs.connectivity(found.skeleton).components == 1


def test_cuts_from_both_sides_are_one_point():
    """Half-spaces at all angles: what they cut apart fits together again."""
    skeleton = random_graph(np.random.default_rng(8))
    for _ in range(20):
        normal, point = RNG.normal(size=3), RNG.uniform(-3, 3, 3)
        sides = [graphs.trimmed(skeleton, frep.half_space(sign * normal, point)) for sign in (1, -1)]
        crossed = (frep.half_space(normal, point).field(skeleton.nodes)[skeleton.edges] < 0).sum(axis=1) == 1
        assert [len(side.cut) for side in sides] == [crossed.sum()] * 2
        union = graphs.merged([side.skeleton for side in sides])
        assert len(union.skeleton.nodes) == len(np.unique(skeleton.edges)) + crossed.sum()


def test_ends_on_the_surface_are_no_cuts():
    strut = GraphSkeleton(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([(0, 1), (1, 2)]))
    for nudge in (0.0, 1e-10, -1e-10):
        found = graphs.trimmed(strut, frep.half_space((1, 0, 0), (1.0 + nudge, 0, 0)))
        assert len(found.cut) == 0
        assert len(found.skeleton.edges) == 1
    with pytest.raises(EmptyError, match="solid"):
        graphs.trimmed(strut, frep.half_space((1, 0, 0)))


# --- together ---------------------------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_merging_is_a_union(seed):
    random = np.random.default_rng(seed)
    graph = random_graph(random)
    parts = []
    for rows in np.array_split(random.permutation(len(graph.edges)), 3):
        used, edges = np.unique(np.concatenate([graph.edges[rows], graph.edges[:5, ::-1]]), return_inverse=True)
        noise = random.uniform(-1e-9, 1e-9, (len(used), 3))
        parts.append(GraphSkeleton(graph.nodes[used] + noise, edges.reshape(-1, 2)))
    found = graphs.merged(parts)
    whole = graphs.merged([graph, found.skeleton])
    assert len(whole.skeleton.edges) == len(found.skeleton.edges) == len(graph.edges)
    assert len(found.skeleton.nodes) == len(np.unique(graph.edges))
    assert is_clean(found.skeleton)
    for part, number in zip(parts, found.nodes, strict=True):
        np.testing.assert_allclose(found.skeleton.nodes[number], part.nodes, atol=1e-7)
    again = graphs.merged([found.skeleton, found.skeleton])
    np.testing.assert_array_equal(again.skeleton.nodes, found.skeleton.nodes)


def test_edges_that_lose_their_length_go():
    short = GraphSkeleton(np.array([[0.0, 0, 0], [1, 0, 0], [1.001, 0, 0]]), np.array([(0, 1), (1, 2), (2, 0)]))
    assert len(graphs.merged([short]).skeleton.edges) == 3
    assert len(graphs.merged([short], 0.01).skeleton.edges) == 1
    with pytest.raises(EmptyError, match="skeletons"):
        graphs.merged([short], 5.0)


def test_copies_join_at_equal_places():
    """A chain of cells: their ends are one node each."""
    step = np.array([[0.0, 0, 0], [1, 0, 0]])
    shifts = np.array([[i, 0, 0] for i in (0, 1, 2, 1)])
    found = graphs.repeated(step, np.array([[0, 1]]), np.ones(3), np.zeros(4, int), shifts)
    assert sorted(found.skeleton.nodes[:, 0].tolist()) == [0, 1, 2, 3]
    assert len(found.skeleton.edges) == 3
    np.testing.assert_array_equal(found.skeleton.nodes[found.ends][:, :, 0], shifts[:, :1] + [0, 1])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.5, 10))
def test_bridges_go_to_the_nearest_target(seed, reach):
    graph = random_graph(np.random.default_rng(seed), 40, 10)
    ends, targets = np.arange(12), np.arange(8, 40)
    found = graphs.bridged(graph, ends, targets, reach)
    apart = np.linalg.norm(graph.nodes[ends, None] - graph.nodes[None, targets], axis=2)
    apart[ends[:, None] == targets] = np.inf
    nearest = {(i, int(targets[j])) for i, j in enumerate(apart.argmin(axis=1)) if apart[i, j] <= reach}
    had = {tuple(sorted(e)) for e in graph.edges.tolist()}
    wanted = {tuple(sorted(e)) for e in nearest} - had
    assert {tuple(sorted(e)) for e in found.added.tolist()} == wanted
    assert {tuple(sorted(e)) for e in found.skeleton.edges.tolist()} == wanted | had
    assert found.unreached.tolist() == [i for i in range(12) if apart[i].min() > reach]


# --- divided ----------------------------------------------------------------------------------------------------------


@given(st.floats(0.2, 30))
@settings(max_examples=25, deadline=None)
def test_pieces_are_short_and_equal_and_nothing_moves(longest):
    graph = random_graph(np.random.default_rng(1))
    found = graphs.subdivided(graph, longest)
    ends = found.segments()
    pieces = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert pieces.max() <= longest * (1 + 1e-5)
    assert pieces.sum() == pytest.approx(length(graph))
    beams = np.linalg.norm(np.diff(graph.segments(), axis=1)[:, 0], axis=1)
    assert len(pieces) == pytest.approx(np.ceil(beams / longest).sum(), abs=1)
    np.testing.assert_array_equal(found.nodes[: len(graph.nodes)], graph.nodes)
    assert is_clean(GraphSkeleton(*used_only(found)))


def used_only(skeleton) -> tuple[np.ndarray, np.ndarray]:
    used, edges = np.unique(skeleton.edges, return_inverse=True)
    return skeleton.nodes[used], edges.reshape(-1, 2)


def test_a_periodic_cell_divides_too():
    from frep.skeleton import beam_field

    cell = faces_of_cube(3.0)
    fine = graphs.subdivided(cell, 0.3)
    assert len(fine.edges) == 12 * 8
    points = RNG.uniform(-5, 5, (300, 3))
    one, other = (beam_field(s, width=frep.constant(0.4))(points) for s in (cell, fine))
    np.testing.assert_allclose(one, other, atol=1e-9)


def test_nodes_at_shares():
    strut = GraphSkeleton(np.array([[0.0, 0, 0], [8, 0, 0], [8, 8, 0]]), np.array([(0, 1), (1, 2)]))
    found = graphs.divided(strut, np.array([1, 0, 0]), np.array([0.5, 0.75, 0.25]))
    assert found.nodes[3:].tolist() == [[2, 0, 0], [6, 0, 0], [8, 4, 0]]
    assert found.edges.tolist() == [[0, 3], [3, 4], [4, 1], [1, 5], [5, 2]]


# --- looked over ------------------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 40))
def test_connectivity_is_that_of_networkx(seed, m):
    graph = random_graph(np.random.default_rng(seed), 25, m)
    found = graphs.connectivity(graph)
    other = nx.Graph(graph.edges.tolist())
    other.add_nodes_from(range(25))
    parts = [c for c in nx.connected_components(other) if len(c) > 1]
    assert found.components == len(parts)
    assert {frozenset(np.flatnonzero(found.component == i).tolist()) for i in range(len(parts))} == set(
        map(frozenset, parts)
    )
    sizes = [int((found.component == i).sum()) for i in range(len(parts))]
    assert sizes == sorted(sizes, reverse=True)
    assert found.dangling.tolist() == [i for i in range(25) if other.degree(i) == 1]
    assert found.lone.tolist() == [i for i in range(25) if other.degree(i) == 0]
    assert found.isolated.tolist() == [
        k for k, e in enumerate(graph.edges) if all(other.degree(int(i)) == 1 for i in e)
    ]
    assert found.sound == (nx.is_connected(other) and min(d for _, d in other.degree()) > 1)


def test_connectivity_reads_as_one_says_it():
    square = GraphSkeleton(np.eye(4, 3), np.array([(0, 1), (1, 2), (2, 3), (3, 0)]))
    assert str(graphs.connectivity(square)) == "one component, nothing loose"
    two = GraphSkeleton(np.arange(15.0).reshape(5, 3), np.array([(0, 1), (2, 3)]))
    assert str(graphs.connectivity(two)) == "2 components, 4 dangling nodes, 1 lone node, 2 isolated beams"


STRUT = GraphSkeleton(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]))


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("region", lambda: graphs.cut_out(STRUT, frep.half_space((0, 0, 1)))),
        ("region", lambda: graphs.cut_out(STRUT, np.array([[0, 0, 0], [1, math.nan, 1]]))),
        ("region", lambda: graphs.cut_out(STRUT, np.array([[2, 0, 0], [1, 1, 1]]))),
        ("step", lambda: graphs.trimmed(STRUT, frep.sphere((0, 0, 0), 1), step=0)),
        ("skeletons", lambda: graphs.merged([])),
        ("tolerance", lambda: graphs.merged([STRUT], -1.0)),
        ("reach", lambda: graphs.bridged(STRUT, np.array([0]), np.array([1]), 0.0)),
        ("length", lambda: graphs.subdivided(STRUT, 0.0)),
    ],
)
def test_bad_input_names_the_argument(argument, call):
    with pytest.raises(ArgumentError, match=rf"\b{argument}\b"):
        call()
