"""Exact files of lattices that were moved: one solid of cylinders, of the volume and in the place of the part."""

from __future__ import annotations

import math

import numpy as np
import pytest

import frep
from topologies import beams

X, Y, Z = frep.coordinates()
CELL = frep.box((0, 0, 0), (5, 5, 5))
BCC = beams.bcc(cell=5)
TETRAHEDRON = ([[0, 0, 0], [8, 0, 0], [4, 6, 0], [4, 3, 6]], [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])


def saved(part, path):
    """The solids of its file; every one valid, none with facets."""
    import cadquery as cq

    part.save(path)
    solids = [solid for shape in cq.importers.importStep(str(path)).vals() for solid in shape.Solids()]
    assert all(solid.isValid() for solid in solids)
    assert {face.geomType() for solid in solids for face in solid.Faces()} & {"CYLINDER", "CONE"}
    return solids


def volume(solids) -> float:
    return sum(solid.Volume() for solid in solids)


def inside(solids, points):
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_State

    found = np.zeros(len(points), bool)
    for solid in solids:
        classify = BRepClass3d_SolidClassifier(solid.wrapped)
        for n, point in enumerate(points.tolist()):
            classify.Perform(gp_Pnt(*point), 1e-7)
            found[n] |= classify.State() == TopAbs_State.TopAbs_IN
    return found


@pytest.mark.parametrize(
    "move",
    [
        lambda s: s.translate((1, 2, 3)),
        lambda s: s.rotate("z", 0.5).translate((1, 2, 3)),
        lambda s: s.rotate("x", math.pi / 2),
        lambda s: s.scale(1.5, center=(1, 0, 0)).rotate((1, 2, 3), 1.0),
        lambda s: s.rotate("y", 0.3).mirror((1, 1, 0)),
    ],
)
def test_a_moved_part_is_the_image_of_the_part(tmp_path, move):
    """Points in the one are points in the other, by OpenCASCADE's classifier."""
    part = BCC.thicken(1) & CELL
    there = move(part)
    whole, solids = saved(part, tmp_path / "a.step"), saved(there, tmp_path / "b.step")
    ratio = float(there.beams.diameter.data)
    assert volume(solids) == pytest.approx(ratio**3 * volume(whole), rel=1e-6)
    points = np.random.default_rng(0).uniform(*there.bounds, (120, 3))
    clear = np.abs(there.field(points)) > 0.02
    assert np.array_equal(inside(solids, points[clear]), there.contains(points[clear]))


@pytest.mark.parametrize(
    "part",
    [
        BCC.translate((1, 2, 0.7)).thicken(1) & frep.box((1, 2, 0.7), (6, 7, 5.7)),
        BCC.rotate("z", 0.5).thicken(1) & CELL,
        BCC.thicken(1).rotate("z", 0.5) & CELL,
        (BCC.thicken(0.8 + 0.01 * X) & CELL).rotate("y", 0.3),
        beams.graph(*TETRAHEDRON).thicken([1, 1.4, 1.2, 0.8]),
        beams.graph(*TETRAHEDRON).thicken([1, 1.4, 1.2, 0.8], node=[2, 0, 0, 1.5]).rotate("y", 0.3).scale(2.0),
    ],
    ids=["translated", "rotated before", "rotated after", "graded", "cones", "cones moved"],
)
def test_the_file_has_the_volume_of_the_field(tmp_path, part):
    solids = saved(part, tmp_path / "a.step")
    assert volume(solids) == pytest.approx(part.volume(0.2), rel=2e-3)
    points = np.random.default_rng(1).uniform(*part.bounds, (120, 3))
    clear = np.abs(part.field(points)) > 0.02
    assert np.array_equal(inside(solids, points[clear]), part.contains(points[clear]))


def test_a_box_off_the_cells_takes_whole_cells_as_well(tmp_path):
    part = BCC.thicken(1) & frep.box((-2.5, -2.5, -2.5), (2.5, 2.5, 2.5))
    (moved,) = saved(part, tmp_path / "a.step")
    (plain,) = saved(BCC.thicken(1) & CELL, tmp_path / "b.step")
    assert moved.Volume() == pytest.approx(plain.Volume(), rel=1e-6)


def test_a_second_box_in_other_axes_is_no_longer_one_box():
    part = (BCC.thicken(1) & CELL).rotate("z", 0.5)
    assert (part & CELL).beams is None
    assert (part & frep.box((-20, -20, -20), (20, 20, 20))).beams is part.beams
    quarter = (BCC.thicken(1) & CELL).rotate("z", math.pi / 2)
    cut = (quarter & frep.box((-2, 0, 0), (0, 5, 5))).beams
    assert cut.clip == pytest.approx(np.array([[-2, 0, 0], [0, 5, 5]]))


def test_files_are_in_millimetres_and_named(tmp_path):
    path = tmp_path / "bracket.step"
    saved(BCC.thicken(1) & CELL, path)
    text = path.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text.replace(" ", "").replace("\n", "")
    assert "PRODUCT('bracket'" in text.replace(" ", "").replace("\n", "")
