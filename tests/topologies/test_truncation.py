"""Truncation as a transition: constant Fields are the cells, neighbours meet, and what is out of range is told."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, graphs
from topologies import beams

X, Y, Z = frep.coordinates()
FAMILIES = [
    (beams.rhombicuboctahedron, "tau"),
    (beams.truncated_cube, "tau"),
    (beams.truncated_octahedron, "setback"),
]
BLOCK = ((0, 0, 0), (100, 100, 100))


def lines(topology, digits: int = 6) -> set[frozenset]:
    segments = topology.skeleton.segments()
    return {frozenset(tuple((np.round(p, digits) + 0.0).tolist()) for p in beam) for beam in segments}


def assert_same(one, other):
    """Laid over each other, neither adds a node or a beam."""
    union = graphs.merged([one.skeleton, other.skeleton], 1e-8).skeleton
    assert len(union.nodes) == len(one.skeleton.nodes) == len(other.skeleton.nodes)
    assert len(union.edges) == len(one.skeleton.edges) == len(other.skeleton.edges)


@pytest.mark.parametrize(("make", "name"), FAMILIES)
@pytest.mark.parametrize("size", [10.0, (4.0, 7.0, 5.0)])
@settings(max_examples=15, deadline=None)
@given(
    share=st.one_of(st.sampled_from([0.0, 0.25, 0.5, 1 / (2 + math.sqrt(2))]), st.floats(1e-6, 0.5 - 1e-6)),
    low=st.tuples(*[st.integers(-3, 3)] * 3),
    count=st.tuples(*[st.integers(1, 2)] * 3),
    off=st.sampled_from([0.0, 0.3]),
)
def test_a_constant_field_is_the_cell_of_the_number(make, name, size, share, low, count, off):
    period = np.broadcast_to(np.asarray(size, float), (3,))
    value = share * float(period.min())
    box = (np.array(low) + off) * period + np.array([np.zeros(3), np.array(count) * period])
    plain = make(size, **{name: value}, over=box)
    for law in (frep.constant(value), lambda x, y, z: value + 0 * x):
        assert_same(make(size, **{name: law}, over=box), plain)
    assert_same(make(size, **{name: value}).over(box), plain)


@pytest.mark.parametrize(("make", "name"), FAMILIES)
@pytest.mark.parametrize(
    "law", [Z / 20, X * Y / 2000, 5 - 0.05 * frep.hypot(X - 50, Z - 50), 2.5 + 2.5 * frep.sin(X + Y + Z)]
)
def test_from_none_to_all_nothing_comes_apart(make, name, law):
    """LF-rep Fig. 4.7 and 4.8: 10 x 10 x 10 cells, truncation 0 to half a cell."""
    found = make(10, **{name: law}, over=BLOCK).connectivity()
    assert found.sound, str(found)


def test_the_ends_of_the_range_are_the_cells_of_the_limits():
    """O6: at the bottom simple cubic, at the top cuboctahedra or octahedra."""
    for make, limit in ((beams.truncated_cube, beams.cuboctahedron), (beams.rhombicuboctahedron, beams.octahedron)):
        part = make(10, tau=frep.clip((Z - 20) / 4, 0, 5), over=((0, 0, 0), (20, 20, 60)))
        assert {b for b in lines(part) if all(p[2] <= 20 for p in b)} == lines(
            beams.simple_cubic(10).over(((0, 0, 0), (20, 20, 20)))
        )
        top = {b for b in lines(part) if all(p[2] >= 40 for p in b)}
        assert top == lines(limit(10).over(((0, 0, 40), (20, 20, 60))))


def test_layers_of_rhombicuboctahedra_share_their_squares():
    """The trap of lf-rep 6.3: with a truncation a layer, the squares of two layers would be concentric and not
    touch."""
    part = beams.rhombicuboctahedron(10, tau=Z / 20, over=BLOCK)
    nodes = part.skeleton.nodes
    for level in range(10, 100, 10):
        square = nodes[np.abs(nodes[:, 2] - level) < 1e-9]
        inset = np.abs(square[:, :2] - 10 * np.round(square[:, :2] / 10))
        # On this face nodes lie by the truncation of its corners, from both sides of it, and nowhere else.
        np.testing.assert_allclose(inset, level / 20, atol=1e-9)
        assert len(square) == 4 * 10 * 10


def test_nodes_go_by_the_law_at_their_corner():
    """Truncated cubes: along a line of corners, every corner has a node at its own truncation to both sides."""
    law = 2 + 0.02 * X + frep.sin(Y) + 0.01 * Z
    part = beams.truncated_cube((10, 12, 15), tau=law, over=((0, 0, 0), (40, 24, 30)))
    places = {tuple((np.round(p, 6) + 0.0).tolist()) for p in part.skeleton.nodes}
    for corner in ((0, 0, 0), (10, 12, 15), (20, 12, 30), (40, 24, 0)):
        tau = float(law(corner))
        for axis, size in enumerate((10, 12, 15)):
            for sign in (-1, 1):
                node = np.array(corner, float)
                node[axis] += sign * tau * size / 10
                inside = np.all((node >= 0) & (node <= (40, 24, 30)))
                assert (tuple((np.round(node, 6) + 0.0).tolist()) in places) == inside


def test_a_transition_meshes():
    """Fig. 4.8, a corner of it: truncation along z, diameter along x."""
    part = beams.rhombicuboctahedron(10, tau=1 + Z / 10, over=((0, 0, 0), (20, 20, 40))).thicken(0.8 + X / 50)
    report = part.mesh(voxel=0.3).check()
    assert report.printable
    assert report.components == 1


BOX = ((0, 0, 0), (20, 20, 20))
BAD = [
    (r"tau: expected 0 to 5 mm.* got 6 at \(0, 0, 20\) mm", lambda: beams.truncated_cube(10, tau=0.3 * Z, over=BOX)),
    (r"tau: .* got -2 at \(0, 0, 0\) mm", lambda: beams.rhombicuboctahedron(10, tau=Z / 10 - 2, over=BOX)),
    (r"setback: .* at ", lambda: beams.truncated_octahedron(10, setback=lambda x, y, z: x, over=BOX)),
    ("tau: .* needs over", lambda: beams.truncated_cube(10, tau=Z)),
    ("setback: .* needs over", lambda: beams.truncated_octahedron(10, setback=Z)),
    ("over: ", lambda: beams.truncated_cube(10, tau=1, over=((0, 0, 0), (1, 1, -1)))),
    ("tau: ", lambda: beams.truncated_cube(10, tau=6, over=BOX)),
]


@pytest.mark.parametrize(("message", "call"), BAD)
def test_bad_input_says_what_and_where(message, call):
    with pytest.raises((ArgumentError, ArgumentTypeError), match=message):
        call()


def test_a_region_without_end_is_refused():
    with pytest.raises(frep.UnboundedError, match="over: "):
        beams.truncated_cube(10, tau=Z, over=frep.half_space((0, 0, 1)))
