"""Binary STL: the bytes against the format's definition, and three independent readers."""

from __future__ import annotations

import numpy as np
import pytest

from frep.errors import ArgumentError
from frep.io.read import read_mesh
from frep.io.stl import HEADER_BYTES, RECORD
from frep.mesh import Mesh


def sphere(nsub: int = 4, radius: float = 5.0) -> Mesh:
    import pyvista as pv

    return Mesh.from_pyvista(pv.Icosphere(radius=radius, center=(1, 2, 3), nsub=nsub))


@pytest.mark.parametrize("nsub", [0, 3, 5])  # less than a chunk, and several
def test_bytes_are_the_format(tmp_path, nsub):
    mesh = sphere(nsub)
    path = tmp_path / "part.stl"
    mesh.save(path)
    assert path.stat().st_size == 84 + 50 * mesh.n_faces
    data = path.read_bytes()
    assert not data.startswith(b"solid")
    assert int.from_bytes(data[80:84], "little") == mesh.n_faces
    records = np.fromfile(path, RECORD, offset=HEADER_BYTES)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(np.stack([records[n] for n in ("nx", "ny", "nz")], 1), normals, atol=1e-6)
    for k, letter in enumerate("abc"):
        written = np.stack([records[letter + axis] for axis in "xyz"], axis=1)
        np.testing.assert_array_equal(written, corners[:, k].astype(np.float32))
    assert not records["unused"].any()


def test_vtk_and_trimesh_read_the_same_solid(tmp_path):
    import pyvista as pv

    trimesh = pytest.importorskip("trimesh")
    mesh = sphere()
    path = tmp_path / "part.stl"
    mesh.save(path)
    seen = pv.read(path)
    assert seen.n_cells == mesh.n_faces
    assert seen.n_points == len(mesh.vertices)
    assert seen.volume == pytest.approx(mesh.volume, rel=1e-5)
    other = trimesh.load_mesh(path)
    assert len(other.faces) == mesh.n_faces
    assert other.is_watertight
    assert other.volume == pytest.approx(mesh.volume, rel=1e-5)


def test_read_back_is_the_same_closed_surface(tmp_path):
    mesh = sphere()
    mesh.save(tmp_path / "part.stl")
    again = read_mesh(tmp_path / "part.stl")
    assert again.check() == mesh.check()
    np.testing.assert_array_equal(
        again.vertices[again.faces].astype(np.float32), mesh.vertices[mesh.faces].astype(np.float32)
    )


def test_a_flat_face_has_a_zero_normal(tmp_path):
    Mesh(np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2.0]]), np.array([[0, 1, 2]])).save(tmp_path / "flat.stl")
    record = np.fromfile(tmp_path / "flat.stl", RECORD, offset=HEADER_BYTES)[0]
    assert (record["nx"], record["ny"], record["nz"]) == (0, 0, 0)


def test_coordinates_beyond_float32_are_refused(tmp_path):
    with pytest.raises(ArgumentError, match="float32"):
        Mesh(np.array([[0, 0, 0], [1e39, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])).save(tmp_path / "far.stl")
    assert not list(tmp_path.iterdir())
