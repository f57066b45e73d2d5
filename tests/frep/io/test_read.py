"""`read_mesh`: every format gives the same solid, real files have their known faults, damaged files are refused
aloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frep.errors import FileError
from frep.io.read import READABLE_SUFFIXES, read_mesh
from frep.mesh import Mesh

DATA = Path(__file__).parents[4] / "shared" / "data"


def shared(name: str) -> Path:
    if not (DATA / name).exists():
        pytest.skip(f"../shared/data/{name} is not here")
    return DATA / name


@pytest.fixture(scope="module")
def ball():
    import pyvista as pv

    return pv.Icosphere(radius=3.0, nsub=3)


def written(ball, folder: Path, name: str) -> Path:
    path = folder / name
    if name == "ascii.off":
        faces = "\n".join(f"3 {a} {b} {c}" for a, b, c in ball.regular_faces)
        points = "\n".join(f"{x} {y} {z}" for x, y, z in ball.points)
        path.write_text(f"OFF  # a comment\n{ball.n_points} {ball.n_cells} 0\n{points}\n{faces}\n")
    elif name.endswith(".gltf"):
        import pyvista as pv

        plotter = pv.Plotter(off_screen=True)
        plotter.add_mesh(ball)
        plotter.export_gltf(path)
    elif name.endswith(".obj"):
        Mesh.from_pyvista(ball).save(path)
    else:
        ball.save(path, binary=not name.startswith("ascii"))
    return path


NAMES = [
    "binary.stl", "ascii.stl", "binary.ply", "ascii.ply", "part.obj", "ascii.off", "binary.vtk", "ascii.vtk",
    "part.vtp", "part.gltf",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_every_format_gives_the_same_closed_solid(ball, tmp_path, name):
    mesh = read_mesh(written(ball, tmp_path, name))
    assert mesh.n_faces == ball.n_cells
    assert mesh.check().printable
    assert mesh.check().genus == 0
    assert mesh.volume == pytest.approx(ball.volume, rel=1e-5)


@pytest.mark.parametrize("part", [0.2, 0.6, 0.97])
@pytest.mark.parametrize("name", [name for name in NAMES if name != "part.obj"])  # OBJ has no end to miss
def test_a_truncated_file_is_refused_and_nothing_is_printed(ball, tmp_path, capfd, name, part):
    path = written(ball, tmp_path, name)
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    capfd.readouterr()
    with pytest.raises(FileError, match=name):
        read_mesh(path)
    assert capfd.readouterr() == ("", "")


def test_a_truncated_file_of_polygons_is_refused(tmp_path):
    import pyvista as pv

    path = tmp_path / "cube.ply"
    pv.Cube().save(path)
    assert read_mesh(path).check().printable
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(FileError, match="truncated"):
        read_mesh(path)


@pytest.mark.parametrize("suffix", READABLE_SUFFIXES)
@pytest.mark.parametrize(
    "content", [b"", b"this is a text, no mesh\n" * 40, bytes(range(256)) * 40, b"\x89PNG\r\n\x1a\n" * 99]
)
def test_other_content_under_a_mesh_suffix_is_refused(tmp_path, capfd, suffix, content):
    path = tmp_path / f"part{suffix}"
    path.write_bytes(content)
    with pytest.raises(FileError, match=f"part.{suffix[1:]}"):
        read_mesh(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [".ply", ".vtp", ".vtk"])
def test_a_point_cloud_is_named_as_one(tmp_path, suffix):
    import pyvista as pv

    path = tmp_path / f"cloud{suffix}"
    pv.PolyData(np.random.default_rng(0).random((50, 3))).save(path)
    with pytest.raises(FileError, match=r"no faces|no triangle|point cloud"):
        read_mesh(path)


def test_image_data_is_named_as_such(tmp_path):
    import pyvista as pv

    path = tmp_path / "scan.vtk"
    pv.ImageData(dimensions=(3, 4, 5)).save(path)
    with pytest.raises(FileError, match=r"image of \(3, 4, 5\)"):
        read_mesh(path)


def test_missing_folder_and_unknown_suffix(tmp_path):
    with pytest.raises(FileError, match="no file"):
        read_mesh(tmp_path / "part.stl")
    with pytest.raises(FileError, match="folder"):
        read_mesh(tmp_path)
    (tmp_path / "part.txt").write_text("x")
    with pytest.raises(FileError, match=r"known are \.stl"):
        read_mesh(tmp_path / "part.txt")


def test_obj_polygons_negative_numbers_and_texture_seams(tmp_path):
    path = tmp_path / "quad.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1/1 -2//1 4\n")
    assert read_mesh(path).area == pytest.approx(1.0)
    assert len(read_mesh(path).vertices) == 4
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n")
    with pytest.raises(FileError, match=r"faces.*0 to 2"):
        read_mesh(path)
    path.write_text("v 0 0 0\nv 1 0 zero\n")
    with pytest.raises(FileError, match="line 2"):
        read_mesh(path)


def test_ply_keeps_float64(tmp_path):
    vertices = 1e6 + np.array([[0, 0, 0], [1 / 3, 0, 0], [0, 1e-7, 0]])
    Mesh(vertices, np.array([[0, 1, 2]])).save(tmp_path / "far.ply")
    np.testing.assert_array_equal(read_mesh(tmp_path / "far.ply").vertices, vertices)


def test_the_airplane_has_its_known_faults():
    from pyvista import examples

    report = read_mesh(examples.planefile).check()
    # VTK counts the two together: 224.
    assert (report.open_edges, report.non_manifold_edges) == (223, 1)


def test_the_bunny_has_its_known_holes():
    report = read_mesh(shared("bunny.ply")).check()
    assert report.open_edges == 223
    assert report.faces == 69_451


@pytest.mark.parametrize("name", ["fan.stl", "fandisk.obj"])
def test_the_cad_parts_are_closed(name):
    report = read_mesh(shared(name)).check()
    assert report.printable


def test_the_skin_of_quadratic_cells():
    assert read_mesh(shared("notch_stress.vtk")).check().closed


@pytest.mark.parametrize("name", ["part.step", "part.STP", "part.iges"])
def test_cad_files_are_refused_with_what_to_do(tmp_path, name):
    (tmp_path / name).write_text("ISO-10303-21;")
    with pytest.raises(FileError, match=r"CAD file.*importers.importStep"):
        read_mesh(tmp_path / name)
