"""Meshes that become solids: closed forms, invariances, and an independent winding number."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st

from frep.bodies import BodyReport, BodyWarning, from_mesh, load
from frep.errors import ArgumentError, ArgumentTypeError, FileError, TooLargeError
from frep.io import save_mesh
from frep.io.read import read_mesh
from frep.mesh import Mesh
from frep.solid import Solid

BUNNY = Path(__file__).parents[2].parent / "shared" / "data" / "bunny.ply"
RADIUS = 10.0
VOXEL = 0.4
rng = np.random.default_rng(20)


def icosphere(center=(0.0, 0.0, 0.0), radius: float = RADIUS, subdivisions: int = 4) -> Mesh:
    return Mesh.from_pyvista(pv.Icosphere(radius=radius, center=center, nsub=subdivisions).clean())


SPHERE = icosphere()
# Sagitta of the longest edge, 0.077 of the radius: how far the flat triangles are inside the ball.
CHORD = RADIUS * 0.077**2 / 6


def joined(*meshes: Mesh) -> Mesh:
    shift = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
    faces = [m.faces + s for m, s in zip(meshes, shift, strict=True)]
    return Mesh(np.concatenate([m.vertices for m in meshes]), np.concatenate(faces))


def inside_out(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def quiet(mesh: Mesh, voxel: float | None = VOXEL) -> Solid:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BodyWarning)
        return from_mesh(mesh, voxel=voxel)


def near_sphere(n: int = 4000, reach: float = 1.0) -> np.ndarray:
    p = rng.normal(size=(n, 3))
    return p / np.linalg.norm(p, axis=1, keepdims=True) * (RADIUS + rng.uniform(-reach, reach, (n, 1)))


def from_center(points, center=(0.0, 0.0, 0.0)) -> np.ndarray:
    return np.linalg.norm(points - np.asarray(center), axis=1) - RADIUS


def largest_step(solid: Solid) -> float:
    """The largest difference of neighbouring samples, in their distance: 1 for a distance, much more where its sign jumps."""
    grid = solid.field.data
    fine = max(float(np.abs(np.diff(grid.blocks, axis=a)).max()) for a in (1, 2, 3)) / solid.report.voxel
    return max(fine, *(float(np.abs(np.diff(grid.nodes, axis=a)).max() / grid.spacing[a]) for a in range(3)))


def solid_angles(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Winding numbers by the exact formula of van Oosterom and Strackee, summed over all triangles."""
    out = np.empty(len(points))
    triangles = mesh.vertices[mesh.faces]
    for i, p in enumerate(points):
        a, b, c = np.moveaxis(triangles - p, 1, 0)
        la, lb, lc = (np.sqrt(np.einsum("ij,ij->i", v, v)) for v in (a, b, c))
        triple = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a)))
        out[i] = np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2.0 * np.pi)
    return out


def plain_distance(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Unsigned distance to the triangles by VTK."""
    cloud = pv.PolyData(points).compute_implicit_distance(mesh.to_pyvista())
    return np.abs(cloud["implicit_distance"])


# --- distance and sign of good meshes ----------------------------------------------------------------------------------


def test_a_sphere_is_a_sphere():
    body = from_mesh(SPHERE, voxel=VOXEL)
    points = near_sphere()
    # Trilinear cells of edge h miss a sphere by at most 3 h^2 / 8 R, on top of the flat triangles.
    np.testing.assert_allclose(body.field(points), from_center(points), atol=CHORD + 3 * VOXEL**2 / 8 / 9 + 1e-3)
    assert body.field((0.0, 0.0, 0.0)) == pytest.approx(-RADIUS, abs=8 * VOXEL)
    assert body.report.clean
    assert body.report.holes == 0


def test_halving_the_voxel_quarters_the_error():
    points = near_sphere(2000, 0.5)
    exact = np.sign(from_center(points)) * plain_distance(SPHERE, points)
    error = [np.sqrt(np.mean((quiet(SPHERE, h).field(points) - exact) ** 2)) for h in (1.6, 0.8)]
    assert error[1] < error[0] / 3


def test_a_cube_is_exact_on_its_faces_and_right_within_a_third_of_a_voxel_at_its_edges():
    cube = Mesh.from_pyvista(pv.Cube(x_length=20, y_length=20, z_length=20).triangulate().clean())
    body = from_mesh(cube, voxel=VOXEL)
    points = rng.uniform(-11, 11, (20000, 3))
    q = np.abs(points) - 10
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    near = np.abs(exact) < 2 * VOXEL
    error = np.abs(body.field(points) - exact)[near]
    assert error.max() < VOXEL / 3
    flat = np.sort(np.abs(q[near]), axis=1)[:, 1] > 4 * VOXEL
    assert error[flat].max() < 1e-5


def test_far_from_the_origin_nothing_is_lost():
    here, there = quiet(SPHERE), quiet(Mesh(SPHERE.vertices + 1e6, SPHERE.faces))
    points = near_sphere(500)
    np.testing.assert_allclose(there.field(points + 1e6), here.field(points), atol=1e-5)


def test_a_body_of_another_size_is_the_same_body():
    points = near_sphere(500)
    small = quiet(Mesh(SPHERE.vertices * 1e-4, SPHERE.faces), VOXEL * 1e-4)
    np.testing.assert_allclose(small.field(points * 1e-4) * 1e4, quiet(SPHERE).field(points), atol=1e-4)


def test_beyond_its_grid_the_body_stays_outside():
    body = quiet(SPHERE)
    points = rng.normal(size=(1000, 3)) * 60
    points = points[np.linalg.norm(points, axis=1) > RADIUS + 1]
    value = body.field(points)
    # Continued with slope one from the nearest point of the box: never below the distance, by less than its margin above.
    assert np.all(value > from_center(points) - 8 * VOXEL)
    assert np.all(value < 2 * from_center(points) + 8 * VOXEL)
    lo, hi = body.bounds
    assert np.all(np.abs(body.bounds - SPHERE.bounds) <= VOXEL * 1.0001)
    shell = rng.uniform(lo, hi, (3000, 3))
    face = rng.integers(0, 3, 3000)
    shell[np.arange(3000), face] = np.where(rng.random(3000) < 0.5, lo[face], hi[face])
    assert np.all(body.field(shell) > 0)


def test_bounds_over_boxes_enclose_the_values():
    body = quiet(SPHERE)
    lo = rng.uniform(-15, 12, (200, 3))
    hi = lo + rng.uniform(0, 6, (200, 3))
    least, most = body.field.bounds(lo, hi)
    for a, b, low, high in zip(lo, hi, least, most, strict=True):
        values = body.field(rng.uniform(a, b, (50, 3)))
        assert low - 1e-5 <= values.min()
        assert values.max() <= high + 1e-5


# --- the same body, told differently ---------------------------------------------------------------------------------


def test_inside_out_is_turned_and_said():
    points = near_sphere(1000)
    with pytest.warns(BodyWarning, match="inside out"):
        body = from_mesh(inside_out(SPHERE), voxel=VOXEL)
    np.testing.assert_array_equal(body.field(points), quiet(SPHERE).field(points))
    assert body.report.inside_out


def test_separate_corners_doubled_faces_and_loose_points_change_nothing():
    points = near_sphere(1000)
    exact = quiet(SPHERE).field(points)
    corners = Mesh(SPHERE.vertices[SPHERE.faces].reshape(-1, 3), np.arange(3 * SPHERE.n_faces).reshape(-1, 3))
    doubled = Mesh(SPHERE.vertices, np.concatenate([SPHERE.faces, SPHERE.faces[::3, [1, 2, 0]]]))
    loose = Mesh(np.concatenate([[[99.0, 0.0, 0.0]], SPHERE.vertices]), SPHERE.faces + 1)
    flat = Mesh(SPHERE.vertices, np.concatenate([SPHERE.faces, SPHERE.faces[:50, [0, 1, 1]]]))
    for mesh in (corners, doubled, loose, flat):
        np.testing.assert_allclose(quiet(mesh).field(points), exact, atol=1e-5)
    assert quiet(corners).report.duplicate_points == 3 * SPHERE.n_faces - len(SPHERE.vertices)
    assert quiet(loose).report.unused_points == 1
    assert quiet(doubled).report.mesh.duplicate_faces > 0


def test_faces_that_disagree_are_turned():
    points = near_sphere(1000)
    turned = np.where(rng.random(SPHERE.n_faces)[:, None] < 0.4, SPHERE.faces[:, ::-1], SPHERE.faces)
    with pytest.warns(BodyWarning, match="disagreed"):
        body = from_mesh(Mesh(SPHERE.vertices, turned), voxel=VOXEL)
    np.testing.assert_allclose(body.field(points), quiet(SPHERE).field(points), atol=1e-5)


def test_a_cavity_stays_and_a_piece_inside_out_is_turned():
    shell = joined(SPHERE, inside_out(icosphere(radius=5)))
    away = icosphere(center=(25, 0, 0), radius=5)
    for mesh in (shell, inside_out(shell), joined(shell, inside_out(away)), joined(inside_out(shell), away)):
        body = quiet(mesh)
        assert not body.contains((0.0, 0.0, 0.0))
        assert body.contains((7.5, 0.0, 0.0))
        assert body.contains((25.0, 0.0, 0.0)) == (len(mesh.vertices) > len(shell.vertices))


# --- holes -------------------------------------------------------------------------------------------------------------


def test_small_holes_are_closed_near_the_sphere_and_named():
    kept = np.ones(SPHERE.n_faces, bool)
    kept[rng.choice(SPHERE.n_faces, 20, replace=False)] = False
    with pytest.warns(BodyWarning, match=r"open edges in \d+ holes were closed") as caught:
        body = from_mesh(Mesh(SPHERE.vertices, SPHERE.faces[kept]), voxel=0.15)
    assert len(caught) == 1
    points = near_sphere()
    np.testing.assert_allclose(body.field(points), from_center(points), atol=3 * CHORD + 0.1)
    assert largest_step(body) < 1.4
    assert 15 <= body.report.holes <= 20
    assert body.report.mesh.open_edges >= 55


def tube(radius: float, *, outward: bool = True) -> Mesh:
    """The wall of a cylinder along z from 0 to 30, without ends."""
    angle = np.linspace(0, 2 * np.pi, 97)[:-1]
    ring = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    vertices = np.concatenate([ring + np.array((0.0, 0.0, z)) for z in np.linspace(0, 30, 16)])
    i = (np.arange(15)[:, None] * 96 + np.arange(96)).reshape(-1)
    j = (np.arange(15)[:, None] * 96 + (np.arange(96) + 1) % 96).reshape(-1)
    faces = np.concatenate([np.stack([i, j, j + 96], axis=1), np.stack([i, j + 96, i + 96], axis=1)])
    return Mesh(vertices, faces if outward else faces[:, ::-1])


def test_flat_holes_get_flat_lids_at_true_distance():
    body = quiet(tube(10))
    assert body.report.holes == 2
    assert body.report.lids > 0
    points = rng.uniform((-12, -12, -2), (12, 12, 32), (20000, 3))
    radial = np.hypot(points[:, 0], points[:, 1]) - 10
    axial = np.abs(points[:, 2] - 15) - 15
    exact = np.hypot(np.maximum(radial, 0), np.maximum(axial, 0)) + np.minimum(np.maximum(radial, axial), 0)
    near = np.abs(exact) < 2 * VOXEL
    error = np.abs(body.field(points) - exact)[near]
    assert error.max() < VOXEL / 2
    assert error[(radial[near] < -4 * VOXEL)].max() < 1e-5
    assert largest_step(body) < 1.4


def test_a_ring_between_two_open_tubes_is_closed_and_their_bore_stays_open():
    body = quiet(joined(tube(10), tube(6, outward=False)))
    z = rng.uniform(1, 29, 200)
    bore, wall = np.stack([0 * z + 2, 0 * z, z], axis=1), np.stack([0 * z + 8, 0 * z, z], axis=1)
    assert not body.contains(bore).any()
    assert body.contains(wall).all()
    # The discs that the two lids share cancel and leave no trace across the bore.
    np.testing.assert_allclose(body.field(((2.0, 0.0, 0.0), (2.0, 0.0, 30.0), (0.0, 3.0, 0.0))), (4, 4, 3), atol=0.1)
    np.testing.assert_allclose(body.field(((8.0, 0.0, 0.0), (0.0, 8.0, 30.0))), 0.0, atol=1e-3)


def test_a_hole_in_a_flat_wall_is_closed_in_the_plane_of_the_wall():
    grid = pv.Box((-10, 10, -10, 10, -10, 10), level=9).triangulate().clean()
    mesh = Mesh.from_pyvista(grid)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    away = (middle[:, 2] > 9.99) & (np.abs(middle[:, 0]) < 4) & (np.abs(middle[:, 1]) < 6)
    body = quiet(Mesh(mesh.vertices, mesh.faces[~away]))
    points = np.column_stack([rng.uniform(-9, 9, (500, 2)), rng.uniform(9.2, 10.8, 500)])
    np.testing.assert_allclose(body.field(points), points[:, 2] - 10, atol=1e-4)


def test_a_large_ragged_hole_gets_a_smooth_lid():
    bowl = Mesh(SPHERE.vertices, SPHERE.faces[SPHERE.vertices[SPHERE.faces].mean(axis=1)[:, 2] < 5])
    body = quiet(bowl)
    assert largest_step(body) < 1.4
    # The rim is ragged by half a triangle, 0.4 mm; the lid lies level with its middle.
    disc = rng.uniform(-5, 5, (2000, 2))
    for height in (-1.0, 0.0, 1.0):
        points = np.column_stack([disc, np.full(2000, 5 + height)])
        np.testing.assert_allclose(body.field(points), height, atol=0.15)


def test_a_sphere_of_loose_triangles_with_gaps_is_still_a_sphere():
    corners = SPHERE.vertices[SPHERE.faces]
    corners = corners.mean(axis=1, keepdims=True) + 0.9 * (corners - corners.mean(axis=1, keepdims=True))
    body = quiet(Mesh(corners.reshape(-1, 3), np.arange(3 * SPHERE.n_faces).reshape(-1, 3)))
    points = near_sphere()
    np.testing.assert_allclose(body.field(points), from_center(points), atol=0.75 * VOXEL)


# --- pieces that overlap -----------------------------------------------------------------------------------------------


def test_overlapping_spheres_are_their_union_with_nothing_buried():
    center = np.array((9.0, 2.0, 1.0))
    body = quiet(joined(SPHERE, icosphere(center)))
    points = rng.uniform((-12, -12, -12), (21, 14, 13), (20000, 3))
    a, b = from_center(points), from_center(points, center)
    value = body.field(points)
    outside = (np.minimum(a, b) > 0) & (np.minimum(a, b) < 2 * VOXEL)
    np.testing.assert_allclose(value[outside], np.minimum(a, b)[outside], atol=VOXEL / 2)
    # Inside, the distance to the union's skin: to densely spread points of either sphere that the other one leaves bare.
    skin = near_sphere(200_000, 0.0)
    skin = np.concatenate([skin[from_center(skin, center) > 0], (skin + center)[from_center(skin + center) > 0]])
    from scipy.spatial import cKDTree

    within = np.minimum(a, b) < -VOXEL
    depth = cKDTree(skin).query(points[within])[0]
    near = depth < 2 * VOXEL
    np.testing.assert_allclose(-value[within][near], depth[near], atol=VOXEL)
    assert np.all(value[within] < -0.3 * depth)
    assert 0.1 < body.report.buried < 0.5
    assert largest_step(body) < 1.4


def test_an_open_sheet_beside_a_body_leaves_no_trace():
    sheet = Mesh.from_pyvista(pv.Plane(center=(20, 0, 0), direction=(1, 0, 0), i_size=8, j_size=8).triangulate())
    body = quiet(joined(SPHERE, sheet))
    points = rng.uniform((19, -4, -4), (21, 4, 4), (500, 3))
    assert np.all(body.field(points) > 6)
    assert body.report.buried > 0.01


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 40), spread=st.floats(0.0, 5.0))
def test_any_soup_is_a_body_without_jumps_or_encloses_nothing(seed: int, n: int, spread: float):
    draw = np.random.default_rng(seed)
    corners = spread * draw.normal(size=(n, 1, 3)) + draw.normal(size=(n, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))
    try:
        body = quiet(mesh, float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / 64)
    except ArgumentError:
        number = solid_angles(mesh, draw.uniform(*mesh.bounds, (300, 3)))
        assert np.count_nonzero(np.abs(number) > 0.6) < 10
        return
    assert largest_step(body) < 2.0
    lo, hi = body.bounds
    side = draw.uniform(lo, hi, (300, 3))
    side[:, 0] = hi[0]
    assert np.all(body.field(side) > 0)


# --- real scans --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def bunny() -> tuple[Mesh, Solid]:
    if not BUNNY.exists():
        pytest.skip("../shared/data/bunny.ply is not there")
    mesh = read_mesh(BUNNY)
    mesh = Mesh((mesh.vertices - mesh.bounds.mean(axis=0)) * 120 / np.ptp(mesh.bounds, axis=0).max(), mesh.faces)
    with pytest.warns(BodyWarning, match="223 open edges in 5 holes were closed"):
        return mesh, from_mesh(mesh)


def test_the_bunny_has_the_sign_of_an_independent_winding_number(bunny):
    mesh, body = bunny
    lo, hi = mesh.bounds
    points = np.concatenate(
        [rng.uniform(lo, hi, (100, 3)), rng.uniform(lo, (hi[0], lo[1] + 15, hi[2]), (100, 3)),
         mesh.vertices[rng.integers(0, len(mesh.vertices), 200)] + rng.normal(size=(200, 3)) * 2]
    )  # fmt: skip
    # The scan's faces look inward.
    number = -solid_angles(mesh, points)
    clear = (plain_distance(mesh, points) > body.report.voxel) & (np.abs(number - 0.5) > 0.05)
    assert np.count_nonzero(clear) > 200
    np.testing.assert_array_equal(body.contains(points[clear]), number[clear] > 0.5)


def test_the_bunny_has_true_distances_near_its_surface(bunny):
    mesh, body = bunny
    h = body.report.voxel
    triangles = mesh.vertices[mesh.faces[rng.integers(0, mesh.n_faces, 20000)]]
    points = triangles.mean(axis=1) + rng.uniform(-h, h, (20000, 3))
    exact = plain_distance(mesh, points)
    error = np.abs(np.abs(body.field(points)) - exact)
    # Lids may be nearer than any triangle, and creases are rounded; nothing is off by more than a voxel.
    assert error.max() < h
    assert np.quantile(error, 0.99) < 0.2 * h
    assert largest_step(body) < 1.4


def test_the_airplane_becomes_one_solid_without_jumps():
    from pyvista import examples

    plane = read_mesh(examples.planefile)
    plane = Mesh((plane.vertices - plane.bounds.mean(axis=0)) * 200 / np.ptp(plane.bounds, axis=0).max(), plane.faces)
    with pytest.warns(BodyWarning, match="223 open edges in 10 holes were closed"):
        body = from_mesh(plane)
    assert largest_step(body) < 1.4
    points = rng.uniform(*plane.bounds, (400, 3))
    number = solid_angles(plane, points)
    clear = (plain_distance(plane, points) > body.report.voxel) & (np.abs(number - 0.5) > 0.05)
    np.testing.assert_array_equal(body.contains(points[clear]), number[clear] > 0.5)


# --- files, reports, bad input -----------------------------------------------------------------------------------------


def test_a_file_and_its_mesh_are_the_same_body(tmp_path):
    save_mesh(SPHERE, tmp_path / "ball.ply")
    points = near_sphere(100)
    body = load(tmp_path / "ball.ply", voxel=VOXEL)
    np.testing.assert_array_equal(body.field(points), from_mesh(SPHERE, voxel=VOXEL).field(points))
    assert "ball.ply" in repr(body)


def test_the_report_reads_well():
    bowl = Mesh(SPHERE.vertices, SPHERE.faces[SPHERE.vertices[SPHERE.faces].mean(axis=1)[:, 2] < 5])
    report = quiet(bowl).report
    assert isinstance(report, BodyReport)
    assert report.holes == 1
    assert not report.clean
    text = str(report)
    assert "1, closed by" in text
    assert f"{report.mesh.open_edges:,} open edges" in text
    assert "voxel             0.4 mm" in text


def test_a_clean_mesh_is_loaded_without_a_word():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        from_mesh(SPHERE, voxel=2.0)


@pytest.mark.parametrize("voxel", [0, -1, 0.0, np.nan, np.inf])
def test_a_voxel_must_be_positive(voxel):
    with pytest.raises(ArgumentError, match=r"voxel: expected a .*number"):
        from_mesh(SPHERE, voxel=voxel)


@pytest.mark.parametrize("voxel", ["1", True, [1.0]])
def test_a_voxel_must_be_a_number(voxel):
    with pytest.raises(ArgumentTypeError, match=r"voxel: expected a .*number"):
        from_mesh(SPHERE, voxel=voxel)


def test_too_fine_a_voxel_is_refused_with_one_that_fits():
    with pytest.raises(TooLargeError, match=r"GB are free; a voxel of \S+ mm would fit"):
        from_mesh(SPHERE, voxel=1e-5)


def test_what_encloses_nothing_is_refused():
    corner = np.eye(3)
    with pytest.raises(ArgumentError, match="no faces"):
        from_mesh(Mesh(corner, np.empty((0, 3), int)))
    with pytest.raises(ArgumentError, match="zero area"):
        from_mesh(Mesh(np.outer([0.0, 1.0, 2.0], [1.0, 2.0, 3.0]), [[0, 1, 2]]))
    with pytest.raises(ArgumentError, match="zero area or cancel out"):
        from_mesh(Mesh(corner, [[0, 1, 2], [2, 1, 0]]))
    with pytest.raises(ArgumentError, match="no volume"):
        quiet(Mesh(corner, [[0, 1, 2]]), None)
    with pytest.raises(ArgumentTypeError, match=r"expected a frep\.Mesh, got str"):
        from_mesh("bunny.ply")  # type: ignore[arg-type]


def test_a_file_that_is_no_body_is_named(tmp_path):
    with pytest.raises(FileError, match=r"no file .*nothing\.stl"):
        load(tmp_path / "nothing.stl")
    sheet = Mesh.from_pyvista(pv.Plane().triangulate())
    save_mesh(sheet, tmp_path / "sheet.stl")
    with pytest.raises(FileError, match=r"sheet\.stl.*cannot be read as a body.*no volume"):
        load(tmp_path / "sheet.stl")
    with pytest.raises(ArgumentError, match="voxel"):
        load(tmp_path / "sheet.stl", voxel=-1)
