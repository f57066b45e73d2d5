"""From solid to mesh: closed and manifold for many designs, second order, independent oracles, exact caps, invariances."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

import frep
from frep import Mesh, Solid
from graded import linear, parabola
from topologies import beams, tpms

RNG = np.random.default_rng(9)
X, Y, Z = frep.coordinates()
LEVEL = frep.sin(X) * frep.cos(Y) + frep.sin(Y) * frep.cos(Z) + frep.sin(Z) * frep.cos(X)
BOX = frep.box((0.1, -0.2, 0.3), (12.3, 10.1, 9.4))


def designs() -> dict[str, tuple[Solid, float]]:
    law = parabola("x", 0, 12, ends=1.0, middle=2.5)
    ball = frep.sphere((6, 5, 5), 4.8)
    nodes = RNG.uniform(0, 10, (25, 3))
    holes = [frep.cylinder((3 * i, 3 * j, -1), (3 * i, 3 * j, 11), 1) for i in (1, 2, 3) for j in (1, 2)]
    ring = frep.torus((0, 0, 1), (0, 0, 1), 4, 1)
    return {
        "box": (BOX, 0.7),
        "graded bcc": (beams.bcc(4).thicken(law, node=1.1 * law) & BOX, 0.35),
        "blended cubic": (beams.simple_cubic(4).thicken(1.0, blend=0.5) & BOX, 0.3),
        "square beams": (beams.bcc(5).thicken(1.2, section=beams.square(0.3)) & BOX, 0.35),
        "graph": (beams.graph(nodes, [(i, i + 1) for i in range(24)]).thicken(np.linspace(0.8, 2, 25), blend=0.3), 0.3),
        "gyroid": (tpms.gyroid(cell=6).sheet(linear("z", 0, 9, 0.7, 1.8)) & BOX, 0.3),
        "P in a ball with a skin": ((tpms.schwarz_p(cell=4).sheet(0.8) & ball) | ball.shell(0.7), 0.3),
        "level set": (Solid(abs(LEVEL) - 0.4) & BOX, 0.3),
        "plate with holes": (
            frep.difference(BOX, *holes, blend=0.3),
            0.4,
        ),
        "cone and torus": (frep.union(frep.cone((0, 0, 0), (0, 0, 6), 3), ring, blend=0.5), 0.3),
        "cube corner to corner": (frep.box((0, 0, 0), (4, 4, 4)) | frep.box((4, 4, 4), (8, 8, 8)), 0.5),
        "rotated box": (frep.box((0, 0, 0), (6, 5, 4)).rotate((1, 2, 3), 0.7), 0.35),
    }


DESIGNS = designs()


@pytest.mark.parametrize("polish", [False, True], ids=["raw", "polished"])
@pytest.mark.parametrize("name", DESIGNS)
def test_meshes_are_closed_manifold_and_oriented(name, polish):
    part, voxel = DESIGNS[name]
    mesh = part.mesh(voxel, polish=polish)
    report = mesh.check()
    assert report.printable, str(report)
    assert report.duplicate_faces == 0
    assert mesh.volume > 0
    lo, hi = part.bounds
    assert np.all(mesh.vertices > lo - 1e-6)
    assert np.all(mesh.vertices < hi + 1e-6)


@pytest.mark.parametrize("name", DESIGNS)
def test_faces_look_outward_and_lie_on_the_surface(name):
    """The field changes sign across every facet that is not a sliver, from inside behind to outside in front."""
    part, voxel = DESIGNS[name]
    mesh = part.mesh(voxel, polish=True)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    good = length > 0.2 * voxel**2
    centre, normal = ((a + b + c) / 3)[good], normal[good] / length[good, None]
    front, back = part.field(centre + 0.5 * voxel * normal), part.field(centre - 0.5 * voxel * normal)
    # Creases, chamfered within a voxel, are the rest.
    assert np.mean((front > 0) & (back < 0)) > 0.97


@pytest.mark.parametrize(
    ("part", "volume", "area"),
    [
        (frep.sphere((0.03, 0.05, 0.02), 3), 4 / 3 * math.pi * 27, 4 * math.pi * 9),
        (frep.torus((0.01, 0.04, 0.07), (1, 2, 2), 3, 1.2), 2 * math.pi**2 * 3 * 1.44, 4 * math.pi**2 * 3.6),
    ],
    ids=["ball", "torus"],
)
def test_second_order(part, volume, area):
    """Volume, area and Hausdorff distance: halving the voxel divides the errors by about four."""
    errors = []
    for voxel in (0.4, 0.2, 0.1):
        mesh = part.mesh(voxel)
        corners = mesh.vertices[mesh.faces]
        inner = np.einsum(
            "wk,fkc->fwc", np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]], corners
        )
        away = np.abs(part.field(np.concatenate([mesh.vertices, inner.reshape(-1, 3)])))
        errors.append((abs(mesh.volume - volume), abs(mesh.area - area), away.max()))
    for coarse, fine in pairwise(np.array(errors)):
        ratio = coarse / fine
        assert np.all((ratio > 3.2) & (ratio < 4.8)), ratio


def test_scikit_image_agrees():
    """An independent marching cubes on the dense samples: the same volume, area and vertices."""
    from skimage.measure import marching_cubes

    part, voxel = DESIGNS["gyroid"]
    grid = part.sample(voxel)
    theirs, faces, _, _ = marching_cubes(grid.dense(), 0.0, spacing=(voxel,) * 3, gradient_direction="ascent")
    other = Mesh(theirs.astype(float) + grid.origin, faces)
    ours = part.mesh(voxel)
    # Cells with several sheets may be cut up in different ways.
    assert ours.volume == pytest.approx(abs(other.volume), rel=2e-3)
    assert ours.area == pytest.approx(other.area, rel=5e-3)
    apart, _ = cKDTree(other.vertices).query(ours.vertices)
    assert np.mean(apart < 1e-4) > 0.999


def test_vtk_agrees():
    import pyvista as pv

    part, voxel = DESIGNS["graded bcc"]
    grid = part.sample(voxel)
    image = pv.ImageData(dimensions=grid.shape, spacing=(voxel,) * 3, origin=grid.origin)
    image["f"] = grid.dense().ravel(order="F")
    theirs = image.contour([0.0], scalars="f", method="flying_edges")
    ours = part.mesh(voxel)
    assert ours.volume == pytest.approx(abs(theirs.volume), rel=2e-3)
    assert ours.area == pytest.approx(theirs.area, rel=2e-3)
    assert len(ours.vertices) == pytest.approx(theirs.n_points, rel=1e-3)


@pytest.mark.parametrize("name", ["graded bcc", "gyroid", "P in a ball with a skin"])
def test_translation_by_whole_voxels_moves_the_mesh(name):
    part, voxel = DESIGNS[name]
    shift = np.array([7, -3, 12]) * voxel
    here, there = part.mesh(voxel), part.translate(shift).mesh(voxel)
    np.testing.assert_array_equal(here.faces, there.faces)
    np.testing.assert_allclose(there.vertices - shift, here.vertices, atol=2e-5 * voxel + 1e-6)


@pytest.mark.parametrize("polish", [False, True], ids=["raw", "polished"])
@pytest.mark.parametrize("name", ["graded bcc", "gyroid"])
def test_far_from_the_origin_the_same_mesh(name, polish):
    part, voxel = DESIGNS[name]
    shift = np.array([1e6, 0.0, -3e5])
    here, there = part.mesh(voxel, polish=polish), part.translate(shift).mesh(voxel, polish=polish)
    assert there.check().printable
    assert there.volume == pytest.approx(here.volume, rel=1e-6)
    apart, _ = cKDTree(here.vertices).query(there.vertices - shift)
    # Where a sample is zero to rounding, one vertex more or less: all others within a thousandth of a voxel.
    assert np.mean(apart < 1e-3 * voxel) > 0.9995
    assert abs(len(here.vertices) - len(there.vertices)) < 1e-3 * len(here.vertices)


PATTERNS = {
    "bcc": beams.bcc(4).thicken(2.5),
    "blended cubic": beams.simple_cubic(4).thicken(2.0, blend=0.5),
    "gyroid": tpms.gyroid(cell=7).sheet(1.6),
    "level set": Solid(abs(LEVEL) - 1.0),
}


@pytest.mark.parametrize(("polish", "exact"), [(True, 1e-9), (False, 1e-6)], ids=["polished", "raw"])
@pytest.mark.parametrize("name", PATTERNS)
def test_caps_lie_exactly_on_the_box(name, polish, exact):
    """No vertex outside the box; where a face of it cuts through the middle of material, the vertices lie on the face."""
    voxel = 0.3
    pattern = PATTERNS[name]
    mesh = (pattern & BOX).mesh(voxel, polish=polish)
    lo, hi = BOX.bounds
    vertices = mesh.vertices
    assert np.all(vertices >= lo - exact)
    assert np.all(vertices <= hi + exact)
    depth = np.minimum(vertices - lo, hi - vertices)
    deep = pattern.field(vertices) < -1.5 * voxel
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        cap = deep & (depth[:, axis] < 0.45 * voxel) & np.all(depth[:, others] > 2 * voxel, axis=1)
        assert np.count_nonzero(cap) > 20
        assert np.abs(depth[cap, axis]).max() <= exact


def test_a_box_is_exact_but_for_its_chamfers():
    mesh = frep.box((0, 0, 0), (10, 8, 6)).mesh(voxel=0.25, polish=True)
    assert mesh.volume == pytest.approx(480, rel=2e-3)
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [10, 8, 6]], atol=1e-9)
    assert mesh.check().genus == 0


def test_genus_of_cut_cells():
    """O4: one frame of a simple cubic cell has genus 5; O9: a cell of P cut at mid-channels is a ball with handles."""
    corners = [(i, j, k) for i in (0, 6) for j in (0, 6) for k in (0, 6)]
    edges = [(a, b) for a in range(8) for b in range(a + 1, 8) if math.dist(corners[a], corners[b]) == 6]
    report = beams.graph(corners, edges).thicken(1.2).mesh(voxel=0.3).check()
    assert (report.components, report.genus) == (1, 5)


def test_mesh_grows_as_the_surface():
    """Triangles and evaluated samples: four times as many at half the voxel."""
    part, voxel = DESIGNS["gyroid"]
    coarse, fine = part.mesh(voxel / 1.5), part.mesh(voxel / 3)
    assert fine.n_faces / coarse.n_faces == pytest.approx(4, rel=0.1)
    ball = frep.sphere((0, 0, 0), 6)
    a, b = ball.sample(0.1), ball.sample(0.05)
    assert b.n_voxels_evaluated / a.n_voxels_evaluated == pytest.approx(4, rel=0.15)


def test_meshing_twice_is_the_same():
    part, voxel = DESIGNS["P in a ball with a skin"]
    first, second = part.mesh(voxel), part.mesh(voxel)
    np.testing.assert_array_equal(first.vertices, second.vertices)
    np.testing.assert_array_equal(first.faces, second.faces)
