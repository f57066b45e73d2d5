"""`Mesh`: measures against closed forms, invariances, validation, saving without loss."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frep.errors import ArgumentError, ArgumentTypeError, EmptyError, FileError
from frep.io.read import read_mesh
from frep.mesh import Mesh

CUBE_VERTICES = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE_FACES = np.array(
    [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
)


def cube() -> Mesh:
    return Mesh(CUBE_VERTICES, CUBE_FACES)


@settings(deadline=None)
@given(
    sides=st.tuples(*[st.floats(0.01, 1e3)] * 3),
    offset=st.tuples(*[st.floats(-1e6, 1e6)] * 3),
)
def test_box_has_its_volume_area_and_bounds_anywhere(sides, offset):
    a, b, c = sides
    mesh = Mesh(CUBE_VERTICES * sides + offset, CUBE_FACES)
    # What float64 coordinates at 1e6 mm still resolve.
    slack = 1e-9 * max(1.0, *np.abs(offset)) * (a * b + b * c + c * a)
    assert mesh.volume == pytest.approx(a * b * c, rel=1e-9, abs=slack)
    assert mesh.area == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-6)
    np.testing.assert_allclose(mesh.bounds, [np.array(offset), np.add(offset, sides)], atol=1e-9)


def test_flipped_faces_turn_the_volume_negative():
    assert Mesh(CUBE_VERTICES, CUBE_FACES[:, ::-1]).volume == pytest.approx(-1.0)


def test_sphere_converges_to_its_volume_with_order_two():
    import pyvista as pv

    errors = []
    for n in (3, 4, 5):
        mesh = Mesh.from_pyvista(pv.Icosphere(radius=2.0, nsub=n))
        errors.append(4 / 3 * np.pi * 8 - mesh.volume)
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.05)


def test_unused_vertices_do_not_count():
    mesh = Mesh(np.vstack([CUBE_VERTICES, [[99, 99, 99]]]), CUBE_FACES)
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 1]])
    assert mesh.volume == pytest.approx(1.0)


def test_arrays_are_read_only_and_the_callers_stay_writable():
    vertices = CUBE_VERTICES.copy()
    mesh = Mesh(vertices, CUBE_FACES)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 5
    vertices[0, 0] = 0.0
    assert np.shares_memory(mesh.vertices, vertices)


def test_pickle_keeps_everything():
    again = pickle.loads(pickle.dumps(cube()))
    np.testing.assert_array_equal(again.vertices, CUBE_VERTICES)
    np.testing.assert_array_equal(again.faces, CUBE_FACES)


@pytest.mark.parametrize(
    ("vertices", "faces", "error", "words"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], ArgumentError, r"vertices.*\(3, 2\)"),
        ([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], ArgumentError, "vertices.*vertex 0.*nan"),
        ([[0, 0, 0], [1, 0, 0], [0, -np.inf, 0]], [[0, 1, 2]], ArgumentError, "vertices.*vertex 2.*inf"),
        (np.zeros((3, 3)), [[0, 1]], ArgumentError, r"faces.*\(1, 2\)"),
        (np.zeros((3, 3)), [[0, 1, 3]], ArgumentError, "faces.*0 to 2.*3"),
        (np.zeros((3, 3)), [[0, 1, -1]], ArgumentError, "faces.*0 to 2.*-1"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], ArgumentTypeError, "faces.*integers.*float64"),
        ("cube", [[0, 1, 2]], ArgumentTypeError, "vertices.*str"),
    ],
)
def test_nonsense_is_refused_by_name_and_value(vertices, faces, error, words):
    with pytest.raises(error, match=words):
        Mesh(vertices, np.asarray(faces))


def test_an_empty_mesh_is_a_value_without_bounds_and_without_a_file(tmp_path):
    mesh = Mesh(np.empty((0, 3)), np.empty((0, 3), int))
    assert mesh.volume == mesh.area == 0
    with pytest.raises(EmptyError, match="no faces"):
        mesh.bounds  # noqa: B018
    for suffix in (".stl", ".ply", ".obj"):
        with pytest.raises(EmptyError, match="nothing to save"):
            mesh.save(tmp_path / f"part{suffix}")
    assert not list(tmp_path.iterdir())


def test_pyvista_round_trip_keeps_vertices_and_faces():
    mesh = cube()
    again = Mesh.from_pyvista(mesh.to_pyvista())
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.faces, mesh.faces)
    assert mesh.to_pyvista().volume == pytest.approx(mesh.volume)


def test_polygons_and_volume_cells_become_triangles():
    import pyvista as pv

    assert Mesh.from_pyvista(pv.Cube().clean()).volume == pytest.approx(1.0)
    grid = pv.ImageData(dimensions=(4, 4, 4)).cast_to_unstructured_grid()
    assert Mesh.from_pyvista(grid).volume == pytest.approx(27.0)
    assert Mesh.from_pyvista(pv.MultiBlock([pv.Cube().clean()])).volume == pytest.approx(1.0)
    with pytest.raises(ArgumentTypeError, match=r"pyvista.*int"):
        Mesh.from_pyvista(3)


def test_unknown_suffix_lists_the_known_and_writes_nothing(tmp_path):
    for name in ("part.xyz", "part"):
        with pytest.raises(FileError, match=r"\.stl, \.ply, \.obj"):
            cube().save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_suffix_in_capitals_is_the_same_suffix(tmp_path):
    cube().save(tmp_path / "PART.STL")
    assert read_mesh(tmp_path / "PART.STL").n_faces == 12


@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_ply_and_obj_keep_every_bit_and_stl_float32(tmp_path_factory, data):
    n = data.draw(st.integers(3, 20))
    coordinate = st.floats(-1e30, 1e30)
    vertices = np.array(data.draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=n, max_size=n)))
    corner = st.integers(0, n - 1)
    faces = np.array(data.draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=30)))
    mesh = Mesh(vertices, faces)
    folder = tmp_path_factory.mktemp("round")
    for name in ("part.ply", "part.obj"):
        mesh.save(folder / name)
        again = read_mesh(folder / name)
        np.testing.assert_array_equal(again.vertices, vertices)
        np.testing.assert_array_equal(again.faces, faces)
    mesh.save(folder / "part.stl")
    from frep.io.stl import HEADER_BYTES, RECORD

    records = np.fromfile(folder / "part.stl", RECORD, offset=HEADER_BYTES)
    corners = np.stack([records[name] for name in ("ax", "ay", "az", "bx", "by", "bz", "cx", "cy", "cz")], axis=1)
    np.testing.assert_array_equal(corners.reshape(-1, 3, 3), vertices[faces].astype(np.float32))
