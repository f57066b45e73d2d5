"""STEP: read back by cadquery, valid, volumes by closed form, limits and bad input refused before any work."""

from __future__ import annotations

import re

import numpy as np
import pytest

import frep
from frep.errors import ArgumentError, FileError, FrepError, TooLargeError
from frep.io import _brep, step
from frep.io.step import MAX_BEAMS, write_beams_step, write_cell_pattern_step, write_faceted_step
from frep.mesh import Mesh
from topologies import beams

CORNERS = 10.0 * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
BCC_NODES = np.vstack([CORNERS, [[5, 5, 5]]])
BCC_EDGES = np.array([[8, i] for i in range(8)])


def read_solids(path):
    import cadquery as cq

    shapes = cq.importers.importStep(str(path)).vals()
    solids = [solid for shape in shapes for solid in shape.Solids()]
    assert all(solid.isValid() for solid in solids)
    return solids


def cross(n_axes: int, half: float = 6.0):
    """Beams along the first axes through the origin, as a node with 2 n_axes edges."""
    ends = half * np.vstack([np.eye(3)[:n_axes], -np.eye(3)[:n_axes]])
    return np.vstack([[[0, 0, 0]], ends]), np.array([[0, i + 1] for i in range(2 * n_axes)])


def test_one_beam_is_a_capsule(tmp_path):
    write_beams_step(tmp_path / "a.step", [[1, 2, 3], [4, 6, 3]], [[0, 1]], [[0.7, 0.7]])
    (solid,) = read_solids(tmp_path / "a.step")
    assert solid.Volume() == pytest.approx(np.pi * 0.49 * 5 + 4 / 3 * np.pi * 0.343, rel=1e-5)


def test_a_tapered_beam_cut_at_its_ends_is_a_frustum(tmp_path):
    nodes = [[-1, 0, 0], [11, 0, 0]]
    write_beams_step(tmp_path / "a.step", nodes, [[0, 1]], [[0.9, 2.1]], clip=([0, -5, -5], [10, 5, 5]))
    (solid,) = read_solids(tmp_path / "a.step")
    # The larger ball, r = 2.1 at x = 11, stands out of the cone next to it before the cut at x = 10.
    x = np.linspace(0, 10, 200_001)
    area = np.pi * np.maximum((0.9 + 1.2 * (x + 1) / 12) ** 2, np.clip(2.1**2 - (x - 11) ** 2, 0, None))
    area = np.maximum(area, np.pi * np.clip(0.9**2 - (x + 1) ** 2, 0, None))
    assert solid.Volume() == pytest.approx(float(np.mean((area[1:] + area[:-1]) / 2)) * 10, rel=1e-5)


@pytest.mark.parametrize(("n_axes", "common"), [(2, 16 / 3), (3, 16 - 8 * (2 - np.sqrt(2)))])
def test_crossing_beams_have_steinmetz_volume(tmp_path, n_axes, common):
    r = 1.0
    nodes, edges = cross(n_axes)
    write_beams_step(tmp_path / "a.step", nodes, edges, np.full((len(edges), 2), r), clip=([-5] * 3, [5] * 3))
    (solid,) = read_solids(tmp_path / "a.step")
    assert solid.Volume() == pytest.approx(n_axes * np.pi * r**2 * 10 - common * r**3, rel=1e-5)
    kinds = {face.geomType() for face in solid.Faces()}
    assert kinds <= {"CYLINDER", "PLANE", "SPHERE"}


def test_a_large_node_ball_is_there(tmp_path):
    nodes, edges = cross(1)
    radius, ball = 0.5, 2.0
    write_beams_step(
        tmp_path / "a.step", nodes, edges, np.full((2, 2), radius), node_radii=[ball, 0, 0], clip=([-5] * 3, [5] * 3)
    )
    (solid,) = read_solids(tmp_path / "a.step")
    # A ball with a cylinder through it: the cylinder counts outside the ball only (napkin ring).
    ring = 4 / 3 * np.pi * (ball**2 - radius**2) ** 1.5
    assert solid.Volume() == pytest.approx(np.pi * radius**2 * 10 + ring, rel=1e-5)


@pytest.mark.parametrize("pairs", [[(1, 0), (2, 0)], [(0, 1), (2, 0), (3, 0), (4, 1)]])
def test_a_file_is_valid_when_it_is_read_again(tmp_path, pairs):
    """Here the solid is valid, and what a reader makes of its balls is not, until their seams are turned."""
    nodes = [[19.75, 6.37, 15.77], [7.45, 2.14, 9.58], [4.83, 5.14, 3.69], [17.4, 7.82, 8.76], [3.88, 16.28, 8.46]]
    radii, balls = np.array([0.72, 0.94, 0.41, 0.75, 0.56]), np.array([1.03, 1.19, 0, 0.77, 0])
    write_beams_step(tmp_path / "a.step", nodes, pairs, radii[np.array(pairs)], balls)
    assert len(read_solids(tmp_path / "a.step")) == 1


def test_a_union_that_fails_by_the_seam_of_a_ball_is_made_with_another(tmp_path):
    nodes = [[13.64, 4.15, 10.95], [18.53, 15.8, 16.98], [18.92, 5.43, 2.97], [11.98, 18.21, 0.95], [15.79, 4.21, 1.86]]
    balls = [2.12, 2.8, 2.61, 2.57, 0.95]
    write_beams_step(tmp_path / "a.step", nodes, [(1, 0), (2, 1), (3, 1), (4, 2)], np.full((4, 2), 0.96), balls)
    assert len(read_solids(tmp_path / "a.step")) == 1


@pytest.mark.parametrize("depth", [0.02, 0.05, 0.5, 1.3])
def test_a_little_left_of_a_ball_has_its_volume(depth):
    """What unions are checked against is good to 0.1 % for caps of any height."""
    none = np.zeros((0, 3))
    ball = _brep.Pieces(none, none, np.zeros(0), np.zeros(0), none, np.zeros((1, 3)), np.ones(1))
    cap = np.pi * depth**2 * (3.0 - depth) / 3.0
    assert ball.volume((np.array([1.0 - depth, -2, -2]), np.full(3, 2.0))) == pytest.approx(cap, rel=1e-3)


@pytest.mark.parametrize("inset", [0.6, 0.69, 0.7])
def test_a_corner_of_the_box_may_leave_a_sliver_of_a_beam(tmp_path, inset):
    nodes, box = [(0, 0, -5), (0, 0, 5)], ([inset, inset, -4], [5, 5, 4])
    write_beams_step(tmp_path / "a.step", nodes, [(0, 1)], np.ones((1, 2)), clip=box)
    section = 0.5 * (np.arccos(inset) - np.arcsin(inset)) - inset * (np.sqrt(1.0 - inset**2) - inset)
    assert [s.Volume() for s in read_solids(tmp_path / "a.step")] == pytest.approx([8.0 * section], rel=1e-5)


def test_every_turn_of_a_ball_has_its_poles_elsewhere():
    """All as far from the beams as can be, none near the poles of another."""
    ways = np.vstack([np.eye(3), -np.eye(3)])
    seams = _brep.seam_directions(ways)
    pieces = _brep.Pieces(np.zeros((6, 3)), ways, np.ones(6), np.ones(6), seams, np.zeros((1, 3)), np.ones(1))
    frames = [_brep._away_from(pieces, np.zeros(3), turn) for turn in range(1, 5)]
    poles = np.array([pole for pole, _ in frames])
    assert all(abs(pole @ side) < 1e-12 for pole, side in frames)
    assert np.abs(poles @ poles.T - np.eye(4)).max() <= 0.8 + 1e-12
    assert np.abs(poles).max() < 0.9


def test_separate_beams_become_a_compound(tmp_path):
    nodes = [[0, 0, 0], [5, 0, 0], [0, 9, 0], [5, 9, 0]]
    write_beams_step(tmp_path / "a.step", nodes, [[0, 1], [2, 3]], np.full((2, 2), 0.5))
    solids = read_solids(tmp_path / "a.step")
    one = np.pi * 0.25 * 5 + 4 / 3 * np.pi * 0.125
    assert [s.Volume() for s in solids] == pytest.approx([one, one], rel=1e-5)


def test_beams_that_overlap_beyond_their_nodes_are_united(tmp_path):
    """Two beams that cross between their nodes: no node tells, the union must."""
    nodes = [[-6, 0, 0], [6, 0, 0], [0, -6, 0], [0, 6, 0]]
    write_beams_step(tmp_path / "a.step", nodes, [[0, 1], [2, 3]], np.ones((2, 2)), clip=([-5] * 3, [5] * 3))
    (solid,) = read_solids(tmp_path / "a.step")
    assert solid.Volume() == pytest.approx(2 * np.pi * 10 - 16 / 3, rel=1e-5)


def test_beam_order_direction_and_repetition_do_not_matter(tmp_path):
    random = np.random.default_rng(1)
    radius_at = 0.6 + 0.05 * BCC_NODES[:, 0]
    order = random.permutation(8)
    edges = np.vstack([BCC_EDGES[order][:, ::-1], BCC_EDGES[:2]])
    for name, pairs in (("a.step", BCC_EDGES), ("b.step", edges)):
        write_beams_step(tmp_path / name, BCC_NODES, pairs, radius_at[pairs])
    (a,), (b,) = read_solids(tmp_path / "a.step"), read_solids(tmp_path / "b.step")
    assert a.Volume() == pytest.approx(b.Volume(), rel=1e-6)


def test_pattern_and_general_route_agree(tmp_path):
    """The same two BCC cells as copies of one cell and as one graph."""
    write_cell_pattern_step(tmp_path / "p.step", BCC_NODES, BCC_EDGES, 10, 1.0, 1.1, (2, 1, 1), origin=(0, 0, 100))
    nodes = np.vstack([BCC_NODES, BCC_NODES + np.array([10, 0, 0])]) + np.array([0, 0, 100])
    nodes, number = np.unique(nodes, axis=0, return_inverse=True)
    edges = number.reshape(-1)[np.vstack([BCC_EDGES, BCC_EDGES + 9])]
    write_beams_step(
        tmp_path / "g.step", nodes, edges, np.ones((16, 2)), np.full(len(nodes), 1.1), clip=([0, 0, 100], [20, 10, 110])
    )
    (p,), (g,) = read_solids(tmp_path / "p.step"), read_solids(tmp_path / "g.step")
    assert p.Volume() == pytest.approx(g.Volume(), rel=1e-6)
    box = p.BoundingBox()
    assert (box.xmin, box.xmax, box.zmin, box.zmax) == pytest.approx((0, 20, 100, 110), abs=1e-4)


def test_cells_that_fail_are_written_beam_by_beam_then_with_facets(tmp_path, monkeypatch):
    """Nothing that OpenCASCADE cannot do comes to the user as an error."""

    def fails(*_args, **_options):
        raise _brep.BrepError("cell_edges: no")

    part = beams.simple_cubic(cell=10).thicken(2) & frep.box((0, 0, 0), (10, 10, 10))
    monkeypatch.setattr(step, "write_cell_pattern_step", fails)
    part.save(tmp_path / "a.step")
    (solid,) = read_solids(tmp_path / "a.step")
    assert solid.Volume() == pytest.approx(10 * 3 * np.pi - 8 * np.sqrt(2), rel=1e-4)
    monkeypatch.setattr(step, "write_beams_step", fails)
    with pytest.warns(UserWarning, match="facets instead"):
        part.save(tmp_path / "a.step", voxel=0.4)
    (solid,) = read_solids(tmp_path / "a.step")
    assert solid.Volume() == pytest.approx(part.mesh(voxel=0.4).volume, rel=1e-4)


def test_a_pattern_takes_the_beams_that_reach_in_from_its_neighbours(tmp_path):
    """Simple cubic named by three edges of the cell: all twelve edges must appear, a quarter of each."""
    nodes = 10.0 * np.vstack([np.zeros(3), np.eye(3)])
    write_cell_pattern_step(tmp_path / "a.step", nodes, [[0, 1], [0, 2], [0, 3]], 10, 1.0, counts=(2, 2, 1))
    (solid,) = read_solids(tmp_path / "a.step")
    a_cell = 3 * np.pi * 10 - (16 - 8 * (2 - np.sqrt(2)))
    assert solid.Volume() == pytest.approx(4 * a_cell, rel=1e-5)


def test_a_faceted_solid_has_the_volume_of_its_mesh(tmp_path):
    import pyvista as pv

    mesh = Mesh.from_pyvista(pv.Icosphere(radius=5.0, nsub=3))
    for name, faces in (("a.step", mesh.faces), ("b.stp", mesh.faces[:, ::-1])):
        write_faceted_step(tmp_path / name, Mesh(mesh.vertices, faces))
        (solid,) = read_solids(tmp_path / name)
        assert solid.Volume() == pytest.approx(mesh.volume, rel=1e-6)
        assert len(solid.Faces()) == mesh.n_faces


def test_limits_state_the_count_and_the_limit(tmp_path):
    import pyvista as pv

    n = MAX_BEAMS + 1
    nodes = np.stack([np.arange(n + 1), 0 * np.arange(n + 1), 0 * np.arange(n + 1)], axis=1)
    edges = np.stack([np.arange(n), np.arange(n) + 1], axis=1)
    with pytest.raises(TooLargeError, match=f"{n:,} beams.*{MAX_BEAMS}.*faceted"):
        write_beams_step(tmp_path / "a.step", nodes, edges, np.full((n, 2), 0.1))
    with pytest.raises(TooLargeError, match=r"1,000 cells.*512"):
        write_cell_pattern_step(tmp_path / "a.step", BCC_NODES, BCC_EDGES, 10, 1.0, counts=(10, 10, 10))
    mesh = Mesh.from_pyvista(pv.Icosphere(nsub=2))
    with pytest.raises(TooLargeError, match=r"320 triangles.*max_faces=100"):
        write_faceted_step(tmp_path / "a.step", mesh, max_faces=100)
    assert not list(tmp_path.iterdir())


def test_bad_input_is_named_and_the_old_file_stays(tmp_path):
    path = tmp_path / "a.step"
    path.write_text("old")
    nodes, edges, radii = [[0, 0, 0], [5, 0, 0]], [[0, 1]], [[1.0, 1.0]]
    for arguments, words in [
        (([[0, 0]], edges, radii), r"nodes.*\(1, 2\)"),
        (([[0, 0, np.nan], [1, 0, 0]], edges, radii), "nodes.*finite"),
        ((nodes, [[0, 2]], radii), "edges.*0 to 1"),
        ((nodes, [[0.0, 1.0]], radii), "edges.*float64"),
        ((nodes, [[0, 0]], radii), "beam 0 has no length"),
        ((nodes, edges, [[1.0, 0.0]]), "radii.*positive.*0.0"),
        ((nodes, edges, [1.0]), r"radii.*\(1, 2\)"),
        ((nodes, edges, radii, [-1.0, 0]), "node_radii"),
        ((nodes, edges, radii, None, ([0, 0, 0], [0, 1, 1])), "clip.*above"),
        ((nodes, edges, radii, None, ([50, 50, 50], [60, 60, 60])), "clip.*nothing is left"),
    ]:
        with pytest.raises(ArgumentError, match=words):
            write_beams_step(path, *arguments)
    with pytest.raises(FrepError, match=re.compile("closed.*NO", re.DOTALL)):
        write_faceted_step(path, Mesh(np.eye(3), np.array([[0, 1, 2]])))
    with pytest.raises(ArgumentError, match="counts"):
        write_cell_pattern_step(path, BCC_NODES, BCC_EDGES, 10, 1.0, counts=(1, 0, 1))
    with pytest.raises(ArgumentError, match="cell_size"):
        write_cell_pattern_step(path, BCC_NODES, BCC_EDGES, -10, 1.0)
    with pytest.raises(FileError, match="no folder"):
        write_beams_step(tmp_path / "none" / "a.step", nodes, edges, radii)
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_nothing_is_printed(tmp_path, capfd):
    write_beams_step(tmp_path / "a.step", [[0, 0, 0], [5, 0, 0]], [[0, 1]], [[1.0, 1.0]])
    assert capfd.readouterr() == ("", "")
