"""What OpenCASCADE does to a process stays in that process; what becomes facets says so; files that show no holes."""

# pyright: reportAttributeAccessIssue=false
# (OCP is a compiled module whose stubs pyright does not find.)
from __future__ import annotations

import operator
import os
import sys
import time

import numpy as np
import pytest

import frep
from frep.errors import FileError
from frep.io import _brep, _worker
from frep.io._worker import TooLongError, apart
from frep.io.save import FacetsWarning
from frep.io.step import write_beams_step
from topologies import beams

CROSSING = [[-6, 0, 0], [6, 0, 0], [0, -6, 0], [0, 6, 0]], [[0, 1], [2, 3]], np.ones((2, 2))


def refuse():
    raise FileError("path: no")


def test_a_crash_is_an_error():
    with pytest.raises(_brep.BrepError, match="edges: OpenCASCADE crashed"):
        apart(os.abort, seconds=60, what="edges")


def test_what_takes_too_long_is_ended():
    with pytest.raises(TooLongError, match="in 3 s"):
        apart(time.sleep, 600, seconds=3, what="edges")


@pytest.mark.parametrize(
    ("function", "arguments", "error"), [(operator.truediv, (1, 0), ZeroDivisionError), (refuse, (), FileError)]
)
def test_what_is_raised_there_is_raised_here(function, arguments, error):
    with pytest.raises(error):
        apart(function, *arguments, seconds=60, what="edges")


def test_without_a_python_to_start_it_is_done_here(monkeypatch):
    done: list[int] = []
    monkeypatch.setattr(sys, "executable", "/usr/bin/blender")
    apart(done.append, 1, seconds=60, what="edges")
    assert done == [1]


def test_a_worker_that_cannot_start_leaves_the_work_to_us(monkeypatch):
    done: list[int] = []
    monkeypatch.setattr(_worker, "_START", "raise SystemExit(1)")
    apart(done.append, 1, seconds=60, what="edges")
    assert done == [1]


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_is_heard_at_once_and_the_old_file_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.step"
    path.write_text("old")
    # The worker itself presses it, when we wait for it and for nothing else.
    start = "import os, signal, time; time.sleep(0.5); os.kill(os.getppid(), signal.SIGINT); time.sleep(600)"
    monkeypatch.setattr(_worker, "_START", start)
    with pytest.raises(KeyboardInterrupt):
        write_beams_step(path, *CROSSING)
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_beams_whose_union_crashes_come_with_facets_and_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(_worker, "_START", "import os; os.abort()")
    part = beams.graph(*CROSSING[:2]).thicken(2.0)
    with pytest.warns(FacetsWarning, match=r"crashed.*facets instead.*voxel of 0.5 mm"):
        part.save(tmp_path / "a.step", voxel=0.5)
    assert _brep.read_back(tmp_path / "a.step")[0] == pytest.approx(part.mesh(0.5).volume, rel=1e-4)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (beams.simple_cubic(cell=5).thicken(0.45 + 0.02 * frep.coordinates()[2]), r"diameter.*up to 1\.0%"),
        (beams.simple_cubic(cell=5).thicken(0.5, node=0.8 + 0.1 * frep.coordinates()[2]), r"node.*up to \d\.\d%"),
        (beams.simple_cubic(cell=5).thicken(0.5, blend=0.3), "blend"),
        (beams.simple_cubic(cell=5).thicken(0.5, section="square"), "section"),
    ],
    ids=["graded across", "graded nodes", "blended", "square"],
)
def test_beams_without_exact_faces_say_why_and_keep_their_volume(tmp_path, part, words):
    """Quarter beams in a box: a mesh as coarse as the limit asks for has lost a fifth of them."""
    part = part & frep.box((0, 0, 0), (5, 5, 5))
    with pytest.warns(FacetsWarning, match=f"{words}.*facets instead"):
        part.save(tmp_path / "a.step", max_faces=4000)
    volume, valid = _brep.read_back(tmp_path / "a.step")
    assert valid
    assert volume == pytest.approx(part.volume(0.03), rel=0.03)


def test_every_face_of_two_cones_at_eight_degrees_can_be_shown(tmp_path):
    """The first solid for these is "valid" when read again and of the right volume; half the ball at an end is a hole."""
    from OCP.STEPControl import STEPControl_Reader

    nodes = [[0, 0, 0], [30, 0, 0], [30 * np.cos(np.pi * 8 / 180), 30 * np.sin(np.pi * 8 / 180), 0]]
    part = beams.graph(nodes, [[0, 1], [0, 2]]).thicken([2, 1.2, 2.6])
    part.save(tmp_path / "a.step")
    reader = STEPControl_Reader()
    reader.ReadFile(str(tmp_path / "a.step"))
    reader.TransferRoots()
    assert triangulated_volume(reader.OneShape()) == pytest.approx(part.volume(0.1), rel=0.01)


def triangulated_volume(shape) -> float:
    """By the divergence theorem from the triangles of every face."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    BRepMesh_IncrementalMesh(shape, 0.02, False, 0.2)
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    volume = 0.0
    while explorer.More():
        face, place = TopoDS.Face_s(explorer.Current()), TopLoc_Location()
        found = BRep_Tool.Triangulation_s(face, place)
        assert found is not None
        nodes = [found.Node(n + 1).Transformed(place.Transformation()) for n in range(found.NbNodes())]
        points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
        a, b, c = points[np.array([found.Triangle(n + 1).Get() for n in range(found.NbTriangles())]) - 1].swapaxes(0, 1)
        sign = -1.0 if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else 1.0
        volume += sign * float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6.0
        explorer.Next()
    return volume
