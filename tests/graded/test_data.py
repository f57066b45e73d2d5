"""Fields from data: what is sampled comes back, positions are mm, gaps are named; remaps; thickness from volume fraction."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError, FileError
from graded import (
    from_grid,
    from_image,
    from_mesh_data,
    from_points,
    linear,
    remap,
    smoothed,
    thickness_for,
    volume_fraction_curve,
)
from topologies import beams, tpms

X, Y, Z = frep.coordinates()
RNG = np.random.default_rng(11)
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CT, NOTCH = DATA / "head_ct.vti", DATA / "notch_stress.vtk"
needs_data = pytest.mark.skipif(not CT.exists(), reason="the real inputs of ../shared/data are not here")

SPACING, ORIGIN, SHAPE = np.array([2.0, 3.0, 0.5]), np.array([10.0, -5.0, 1.0]), (6, 5, 9)
END = ORIGIN + SPACING * (np.array(SHAPE) - 1)


def plane(p: np.ndarray) -> np.ndarray:
    return 1.0 + 0.5 * p[..., 0] - 0.25 * p[..., 1] + 2.0 * p[..., 2]


def nodes() -> np.ndarray:
    axes = [o + s * np.arange(n) for o, s, n in zip(ORIGIN, SPACING, SHAPE, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


INSIDE = RNG.uniform(ORIGIN, END, (400, 3))
ANYWHERE = RNG.uniform(ORIGIN - 20, END + 20, (400, 3))


def image() -> pv.ImageData:
    grid = pv.ImageData(dimensions=SHAPE, spacing=tuple(SPACING), origin=tuple(ORIGIN))
    grid["HU"] = plane(np.asarray(grid.points))
    return grid


# --- grids and images ------------------------------------------------------------------------------------------------------


def test_a_linear_function_sampled_comes_back():
    field = from_grid(plane(nodes()), SPACING, ORIGIN)
    np.testing.assert_allclose(field(INSIDE), plane(INSIDE), atol=1e-5)
    # Outside its box: the value at the nearest point of the box.
    np.testing.assert_allclose(field(ANYWHERE), plane(np.clip(ANYWHERE, ORIGIN, END)), atol=1e-5)
    np.testing.assert_allclose(field.gradient(INSIDE), np.broadcast_to([0.5, -0.25, 2.0], (400, 3)), atol=1e-3)


def test_bounds_of_a_grid_enclose_and_hold_everywhere():
    values = RNG.uniform(1, 2, SHAPE)
    field = from_grid(values, SPACING, ORIGIN)
    low, high = field.bounds((-1e6,) * 3, (1e6,) * 3)
    assert low == pytest.approx(values.min(), abs=1e-6)
    assert high == pytest.approx(values.max(), abs=1e-6)
    lo = ANYWHERE[:50]
    low, high = field.bounds(lo, lo + 3)
    for t in RNG.uniform(0, 3, (20, 50, 3)):
        found = field(lo + t)
        assert np.all((found >= low - 1e-6) & (found <= high + 1e-6))


def test_a_periodic_grid_repeats():
    field = from_grid(RNG.uniform(0, 1, SHAPE), SPACING, ORIGIN, periodic=True)
    np.testing.assert_allclose(field(ANYWHERE), field(ANYWHERE + 3 * SPACING * SHAPE), atol=1e-5)


def test_the_same_image_by_every_way(tmp_path):
    image().save(tmp_path / "a.vti")
    ways = [
        from_image(plane(nodes()), spacing=SPACING, origin=ORIGIN),
        from_image(plane(nodes()).transpose(2, 1, 0), spacing=SPACING, origin=ORIGIN, axes="zyx"),
        from_image(image()),
        from_image(tmp_path / "a.vti"),
        from_image(str(tmp_path / "a.vti"), "HU"),
    ]
    for field in ways:
        np.testing.assert_allclose(field(INSIDE), plane(INSIDE), atol=1e-4)


def test_voxel_data_lies_at_the_centres_of_the_voxels():
    grid = pv.ImageData(dimensions=(5, 5, 5), spacing=(2, 2, 2))
    grid.cell_data["HU"] = plane(grid.cell_centers().points)
    points = RNG.uniform(1, 7, (100, 3))
    np.testing.assert_allclose(from_image(grid)(points), plane(points), atol=1e-4)


@pytest.mark.parametrize("association", ["point", "cell"])
def test_turned_axes_and_pieces_of_an_image_stay_where_they_are(association, tmp_path):
    """A direction matrix turns the axes of an image, an extent that does not begin at 0 is a piece of a larger one."""
    for turn in (np.eye(3), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]]):
        grid = pv.ImageData(
            dimensions=SHAPE, spacing=tuple(SPACING), origin=tuple(ORIGIN), offset=(2, -1, 3), direction_matrix=turn
        )
        places = np.asarray((grid if association == "point" else grid.cell_centers()).points)
        (grid.point_data if association == "point" else grid.cell_data)["HU"] = plane(places)
        grid.save(tmp_path / "turned.vti")
        field = from_image(tmp_path / "turned.vti")
        np.testing.assert_allclose(field(places), plane(places), atol=1e-4)
        between = 0.5 * (places[:-1] + places[1:])[:4]
        np.testing.assert_allclose(field(between), plane(between), atol=1e-4)
        values = plane(places)
        values[5] = math.nan
        (grid.point_data if association == "point" else grid.cell_data)["HU"] = values
        where = ", ".join(f"{v:.6g}" for v in places[5])
        with pytest.raises(ArgumentError, match=f"1 of .*{re.escape(where)}"):
            from_image(grid)


@pytest.mark.filterwarnings("ignore:The VTK reader")
def test_a_file_that_is_no_image_says_so(tmp_path):
    (tmp_path / "broken.vti").write_text("hello")
    with pytest.raises(FileError, match=r"image: .*broken"):
        from_image(tmp_path / "broken.vti")
    with pytest.raises(ArgumentError, match="no arrays"):
        from_image(pv.ImageData(dimensions=(2, 2, 2)))


@pytest.mark.parametrize("kind", [">f8", "<f4", "i8", "u1"])
def test_any_real_numbers_make_a_grid(kind):
    values = np.arange(24).reshape(2, 3, 4).astype(kind)
    values.flags.writeable = False
    assert from_grid(values, 1)((1, 1, 1)) == 17


def test_masked_numbers_are_nan():
    values = np.ma.masked_greater(np.arange(24.0).reshape(2, 3, 4), 3)
    with pytest.raises(ArgumentError, match="20 of 24"):
        from_grid(values, 1)
    assert from_grid(values, 1, nan=-1)((1, 1, 1)) == -1


def test_a_stack_of_pictures(tmp_path):
    from skimage.io import imsave

    values = RNG.integers(0, 255, (3, 4, 6)).astype(np.uint8)  # slices, rows, columns
    paths = [tmp_path / f"{k}.png" for k in range(3)]
    for path, picture in zip(paths, values, strict=True):
        imsave(path, picture, check_contrast=False)
    field = from_image(paths, spacing=(1, 2, 5))
    assert field((5, 2 * 3, 5 * 2)) == values[2, 3, 5]
    assert field((4, 2 * 1, 5 * 1)) == values[1, 1, 4]
    colours = np.stack([values[0], 0 * values[0], values[0], 255 + 0 * values[0]], axis=-1)
    imsave(tmp_path / "colours.png", colours, check_contrast=False)
    assert from_image([tmp_path / "colours.png"] * 2, spacing=1)((5, 3, 1)) == pytest.approx(
        float(values[0, 3, 5]) * 2 / 3
    )
    imsave(tmp_path / "pages.tif", np.zeros((7, 8, 9), np.uint8), check_contrast=False)
    with pytest.raises(ArgumentError, match=r"image: .*pages"):
        from_image([tmp_path / "pages.tif"], spacing=1)
    with pytest.raises(FileError, match=r"9\.png"):
        from_image([*paths, tmp_path / "9.png"], spacing=1)
    for unknown in (paths, paths[0], tmp_path / "pages.tif"):
        with pytest.raises(ArgumentError, match="spacing"):
            from_image(unknown)
    with pytest.raises(FileError, match=r"9\.png"):
        from_image(tmp_path / "9.png", spacing=1)


def test_one_picture_lies_as_a_stack_of_them_does(tmp_path):
    """And a file of several pages as their array."""
    from skimage.io import imsave

    values = RNG.integers(0, 255, (3, 4, 6)).astype(np.uint8)
    imsave(tmp_path / "one.png", values[0], check_contrast=False)
    imsave(tmp_path / "all.tif", values, check_contrast=False)
    points = RNG.uniform((0, 0, 0), (5, 6, 10), (50, 3))
    one, listed = (from_image(source, spacing=(1, 2, 5)) for source in (tmp_path / "one.png", [tmp_path / "one.png"]))
    np.testing.assert_array_equal(one(points), listed(points))
    assert one((4, 2 * 1, 0)) == values[0, 1, 4]
    pages, array = (
        from_image(tmp_path / "all.tif", spacing=(1, 2, 5)),
        from_image(values, spacing=(1, 2, 5), axes="zyx"),
    )
    np.testing.assert_array_equal(pages(points), array(points))


def test_nan_is_counted_and_placed():
    values = plane(nodes())
    values[2, 3, 4] = math.nan
    values[5, 0, 0] = math.inf
    with pytest.raises(ArgumentError, match=r"2 of 270 .*\[2, 3, 4\], \(14, 4, 3\) mm"):
        from_grid(values, SPACING, ORIGIN)
    filled = from_grid(values, SPACING, ORIGIN, nan=-7)
    assert filled((14, 4, 3)) == -7
    # The nearest along z is 0.5 mm off.
    assert from_grid(values, SPACING, ORIGIN, nan="nearest")((14, 4, 3)) in (values[2, 3, 3], values[2, 3, 5])
    with pytest.raises(ArgumentError, match="every value"):
        from_grid(np.full((2, 2, 2), math.nan), 1, nan="nearest")


def test_a_sparse_grid_keeps_its_level_set():
    ball = frep.sphere((0, 0, 0), 5)
    field = from_grid(ball.sample(voxel=0.5))
    points = RNG.normal(size=(200, 3))
    points *= 5 / np.linalg.norm(points, axis=1, keepdims=True)
    assert np.abs(field(points)).max() < 0.02
    assert field((0, 0, 0)) < 0 < field((9, 9, 9))


def test_a_vdb_file_is_read_as_the_grid_that_was_written(tmp_path):
    ball = frep.sphere((1, 2, 3), 5)
    try:
        ball.save(tmp_path / "ball.vdb", voxel=0.5)
    except frep.MissingDependencyError as error:
        pytest.skip(str(error))
    points = RNG.normal(size=(200, 3))
    points *= 5 / np.linalg.norm(points, axis=1, keepdims=True)
    assert np.abs(from_grid(tmp_path / "ball.vdb")(points + (1, 2, 3))).max() < 0.02


# --- meshes ------------------------------------------------------------------------------------------------------------------


def block(n: int = 4) -> pv.UnstructuredGrid:
    grid = pv.ImageData(dimensions=(n + 1,) * 3, spacing=(10 / n,) * 3).cast_to_unstructured_grid()
    grid["load"] = plane(np.asarray(grid.points))
    grid["pull"] = np.asarray(grid.points) * [3, 0, 4]
    grid.cell_data["part"] = (grid.cell_centers().points[:, 0] > 5).astype(float)
    return grid


def named() -> pv.UnstructuredGrid:
    grid = block(1)
    grid["name"] = np.array(["a"] * grid.n_points)
    return grid


def test_a_linear_result_comes_back_sampled_and_asked():
    points = RNG.uniform(0, 10, (200, 3))
    sampled, asked = from_mesh_data(block(), "load", spacing=0.9), from_mesh_data(block(), "load")
    np.testing.assert_allclose(sampled(points), plane(points), atol=1e-4)
    np.testing.assert_allclose(asked(points), plane(points), atol=1e-4)
    outside = RNG.uniform(-5, 15, (200, 3))
    for field in (sampled, asked):
        np.testing.assert_allclose(field(outside), plane(np.clip(outside, 0, 10)), atol=1e-3)


def test_units_of_the_mesh_are_scaled_and_values_are_not(tmp_path):
    metres = block()
    metres.points *= 1e-3
    metres.save(tmp_path / "result.vtu")
    points = RNG.uniform(0, 10, (100, 3))
    field = from_mesh_data(tmp_path / "result.vtu", "load", spacing=1.0, scale=1000)
    np.testing.assert_allclose(field(points), plane(points), atol=1e-4)


def quadratic() -> pv.UnstructuredGrid:
    """Two 20-node hexahedra side by side along x, 10 x 5 x 5."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    cell = 5 * np.concatenate([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    points = np.concatenate([cell, cell + (5, 0, 0)])
    return pv.UnstructuredGrid({25: np.arange(40).reshape(2, 20)}, points)


def test_quadratic_cells_carry_quadratic_results():
    """As well as VTK finds a place in a quadratic cell, to a thousandth of it."""
    grid = quadratic()
    x, y, z = np.asarray(grid.points).T
    grid["stress"] = 1 + x**2 - y * z + 0.5 * z**2
    points = RNG.uniform(0, (10, 5, 5), (200, 3))
    field = from_mesh_data(grid, "stress")
    px, py, pz = points.T
    np.testing.assert_allclose(field(points), 1 + px**2 - py * pz + 0.5 * pz**2, atol=0.02)
    fine = from_mesh_data(grid, "stress", spacing=0.25)
    np.testing.assert_allclose(fine(points), field(points), atol=0.25**2 / 4 + 0.02)


@pytest.mark.parametrize("declared", [12, 25])
def test_results_on_corners_only_and_cells_declared_as_linear(declared):
    """Some solvers write 20-node cells as VTK's 8-node type, and NaN between the corners."""
    grid = quadratic()
    grid = pv.UnstructuredGrid(
        np.insert(np.arange(40).reshape(2, 20), 0, 20, axis=1).reshape(-1), np.full(2, declared, np.uint8), grid.points
    )
    values = plane(np.asarray(grid.points))
    points = RNG.uniform(0, (10, 5, 5), (100, 3))
    grid["load"] = values
    np.testing.assert_allclose(from_mesh_data(grid, "load")(points), plane(points), atol=5e-3)
    values[np.arange(40) % 20 >= 8] = np.nan
    grid["load"] = values
    np.testing.assert_allclose(from_mesh_data(grid, "load", spacing=0.7)(points), plane(points), atol=5e-3)
    values[0] = np.nan
    grid["load"] = values
    with pytest.raises(ArgumentError, match="NaN"):
        from_mesh_data(grid, "load", spacing=0.7)
    assert np.isfinite(from_mesh_data(grid, "load", spacing=0.7, nan="nearest")(points)).all()


def test_numbers_of_cells_and_components():
    part = from_mesh_data(block(), "part")
    assert part([[2, 3, 4], [8, 3, 4]]).tolist() == [0, 1]
    pull = from_mesh_data(block(), "pull", component="magnitude", spacing=2.5)
    assert pull((10, 0, 10)) == pytest.approx(50)
    for third in (2, np.int64(2)):
        assert from_mesh_data(block(), "pull", component=third, spacing=2.5)((1, 2, 3)) == pytest.approx(12)
    with pytest.raises(ArgumentError, match="component"):
        from_mesh_data(block(), "pull")


def test_a_missing_array_lists_those_there_are():
    for name in ("stress", None):
        with pytest.raises(ArgumentError, match=r"'load' \(points\).*'part' \(cells\)"):
            from_mesh_data(block(), name)


@pytest.mark.parametrize("spacing", [None, 0.25])
def test_shells_give_their_values_to_the_space_about_them(spacing):
    """A mesh of triangles has no inside: the value is that of the nearest point of it."""
    shell = pv.Plane(i_size=10, j_size=10, i_resolution=5, j_resolution=5).triangulate()
    shell.clear_data()
    shell["load"] = np.asarray(shell.points)[:, 0]
    roof = pv.UnstructuredGrid(shell)
    points = RNG.uniform(-5, 5, (100, 3)) * [1, 1, 0.1]
    for mesh in (shell, roof):
        np.testing.assert_allclose(from_mesh_data(mesh, "load", spacing=spacing)(points), points[:, 0], atol=1e-3)
    ball = pv.Sphere(radius=5, theta_resolution=60, phi_resolution=60)
    ball.clear_data()
    ball["load"] = np.asarray(ball.points)[:, 2]
    normal = RNG.normal(size=(100, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    found = from_mesh_data(ball, "load", spacing=spacing)(5 * normal)
    np.testing.assert_allclose(found, 5 * normal[:, 2], atol=0.1)


@needs_data
def test_a_real_ct_and_a_real_stress():
    ct = from_image(CT)
    volume = pv.read(CT)
    k = RNG.integers(0, volume.n_points, 200)
    np.testing.assert_allclose(ct(np.asarray(volume.points)[k]), np.asarray(volume["HU"])[k], atol=1e-2)

    stress = from_mesh_data(NOTCH, "Nodal Stress-normed", spacing=2, scale=1000)
    mesh = pv.read(NOTCH)
    values = np.asarray(mesh["Nodal Stress-normed"])
    known = np.isfinite(values)  # solved at the corners of the quadratic cells only
    found = stress(1000 * np.asarray(mesh.points)[known])
    assert np.corrcoef(found, values[known])[0, 1] > 0.98
    low, high = stress.bounds((0, 0, 0), (400, 100, 10))
    assert values[known].min() * 0.999 <= low < high <= values[known].max() * 1.001


# --- points ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["linear", "rbf"])
def test_scattered_points_reproduce_a_linear_function(method):
    at = np.concatenate([RNG.uniform(0, 10, (80, 3)), [(i, j, k) for i in (0, 10) for j in (0, 10) for k in (0, 10)]])
    field = from_points(at, plane(at), method, spacing=1.25)
    points = RNG.uniform(0, 10, (100, 3))
    np.testing.assert_allclose(field(points), plane(points), atol=1e-3)


def test_nearest_and_inverse_distance_meet_their_points_and_keep_within():
    at = 2.0 * RNG.permutation(np.argwhere(np.ones((5, 5, 5))))[:40]
    values = RNG.uniform(1, 2, 40)
    points = RNG.uniform(0, 8, (200, 3))
    for method in ("nearest", "inverse distance"):
        field = from_points(at, values, method, spacing=2, over=((0, 0, 0), (8, 8, 8)))
        np.testing.assert_allclose(field(at), values, atol=1e-5)
        assert values.min() - 1e-6 <= field(points).min() <= field(points).max() <= values.max() + 1e-6


def test_of_points_at_one_place_the_mean_counts():
    at = np.concatenate([RNG.uniform(0, 10, (40, 3)), [(i, j, k) for i in (0, 10) for j in (0, 10) for k in (0, 10)]])
    points = RNG.uniform(0, 10, (50, 3))
    for method in ("nearest", "linear", "inverse distance", "rbf"):
        once = from_points(at, plane(at), method, spacing=2)
        twice = from_points(np.concatenate([at, at]), np.concatenate([plane(at) + 1, plane(at) - 1]), method, spacing=2)
        np.testing.assert_allclose(twice(points), once(points), atol=1e-3)


# --- remap -------------------------------------------------------------------------------------------------------------------

finite = st.floats(-100, 100)


@given(finite, finite, finite, finite)
def test_remap_takes_the_ends_to_the_ends(a, b, c, d):
    if abs(a - b) < 1e-3:
        return
    points = np.array([[a, 0, 0], [b, 0, 0], [(a + b) / 2, 0, 0], [a - (b - a), 0, 0]])
    np.testing.assert_allclose(remap(X, (a, b), (c, d))(points), [c, d, (c + d) / 2, c], atol=1e-6)
    np.testing.assert_allclose(remap(X, (a, b), (c, d), clamp=False)(points), [c, d, (c + d) / 2, 2 * c - d], atol=1e-6)
    back = remap(remap(X, (a, b), (0, 1)), (0, 1), (a, b))
    np.testing.assert_allclose(back(points[:3]), points[:3, 0], atol=1e-6)


def test_curves_of_a_remap():
    s = np.linspace(0, 1, 21)
    points = np.stack([100 * s, 0 * s, 0 * s], axis=1)
    for curve, expected in [
        ("smoothstep", 3 * s**2 - 2 * s**3),
        (2, s**2),
        (0.5, np.sqrt(s)),
        (1.3, s**1.3),
        (lambda t: t**3, s**3),
        (np.sin, np.sin(s)),
    ]:
        np.testing.assert_allclose(remap(X, (0, 100), (1, 3), curve=curve)(points), 1 + 2 * expected, atol=1e-9)
    law = remap(X, (0, 100), (1, 3), curve=0.7)
    low, high = law.bounds((-1e9,) * 3, (1e9,) * 3)
    assert low == pytest.approx(1)
    assert high == pytest.approx(3)


def test_smoothing_keeps_lines_and_spreads_a_spike_as_a_gaussian():
    ramp = from_grid(np.arange(60.0).reshape(60, 1, 1), 0.5)
    inner = np.stack([RNG.uniform(8, 22, 50), np.zeros(50), np.zeros(50)], axis=1)
    np.testing.assert_allclose(smoothed(ramp, 1.5)(inner), ramp(inner), atol=1e-3)
    spike = np.zeros((81, 1, 1))
    spike[40] = 1
    for spacing, deviation in ((0.5, 3.0), (0.25, 2.0)):
        x = spacing * np.arange(20, 60)
        found = smoothed(from_grid(spike, spacing), deviation)(np.stack([x, 0 * x, 0 * x], axis=1))
        normal = np.exp(-0.5 * ((x - 40 * spacing) / deviation) ** 2) / math.sqrt(2 * math.pi)
        np.testing.assert_allclose(found, normal * spacing / deviation, atol=2e-4)
    # The same through a remap, which smooths the data and not its own result.
    both = remap(ramp, (10, 20), (1, 2), smoothing=1.5)
    np.testing.assert_allclose(both(inner), remap(smoothed(ramp, 1.5), (10, 20), (1, 2))(inner), atol=1e-12)


# --- thickness for a fraction ------------------------------------------------------------------------------------------------

CELL = 10.0


def measured(solid: frep.Solid) -> float:
    return (solid & frep.box((0, 0, 0), (CELL,) * 3)).volume(voxel=CELL / 50) / CELL**3


@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.7])
def test_the_fraction_asked_for_is_the_fraction_measured(fraction):
    bcc = beams.bcc(cell=CELL)
    assert measured(bcc.thicken(thickness_for(bcc, fraction))) == pytest.approx(fraction, abs=0.005)
    gyroid = tpms.gyroid(cell=CELL)
    wall = thickness_for(gyroid, fraction)
    if fraction < 0.6:  # beyond it seals its channels, and says so
        assert measured(gyroid.sheet(wall)) == pytest.approx(fraction, abs=0.005)


def test_closed_forms_of_simple_cubic_and_gyroid():
    """LF-rep O5: 3 pi r^2 - 8 sqrt 2 r^3 of the cell's side; O8: a t + pi chi / 6 t^3 with a 3.0916 and chi -8."""
    d, f = volume_fraction_curve(beams.simple_cubic(cell=CELL))
    r = d / 2 / CELL
    thin = r < 0.4
    np.testing.assert_allclose(f[thin], (3 * np.pi * r**2 - 8 * math.sqrt(2) * r**3)[thin], atol=0.003)
    t, f = volume_fraction_curve(tpms.gyroid(cell=CELL))
    tau = t / CELL
    thin = tau < 0.35
    np.testing.assert_allclose(f[thin], (3.0916 * tau - np.pi * 8 / 6 * tau**3)[thin], atol=0.004)
    assert np.all(np.diff(f) > 0)


def test_a_field_of_fractions_is_read_place_by_place():
    gyroid = tpms.gyroid(cell=CELL)
    fraction = linear("x", 0, 100, 0.1, 0.5)
    wall = thickness_for(gyroid, fraction)
    for x in (0, 77):
        assert wall((x, 4, 5)) == pytest.approx(thickness_for(gyroid, fraction((x, 0, 0))), rel=0.01)
    low, high = wall.bounds((-1e6,) * 3, (1e6,) * 3)
    assert 0.2 < low < high < 2.0


def test_a_graded_part_has_the_fraction_asked_for():
    """Slow against the cell, the part's volume is the integral of the fraction."""
    bcc = beams.bcc(cell=5)
    diameter = thickness_for(bcc, linear("x", 0, 40, 0.1, 0.4))
    part = bcc.thicken(diameter) & frep.box((0, 0, 0), (40, 5, 5))
    assert part.volume(voxel=0.15) / (40 * 25) == pytest.approx(0.25, abs=0.005)


def test_any_function_from_a_width_to_a_solid_and_further_arguments():
    cubic = beams.simple_cubic(cell=CELL)
    d = thickness_for(lambda w: cubic.thicken(w, section="square"), 0.2, cell=CELL)
    assert d == pytest.approx(thickness_for(cubic, 0.2, section="square"), rel=1e-3)
    s = d / CELL  # three square bars that meet in cubes
    assert 3 * s**2 - 2 * s**3 == pytest.approx(0.2, abs=0.005)


@pytest.mark.parametrize(("form", "fraction"), [("solid", 0.3), ("inverse", 0.2), ("twin", 0.6)])
def test_biases_and_falling_curves(form, fraction):
    gyroid = tpms.gyroid(cell=CELL)
    if not hasattr(gyroid, form):
        pytest.skip(f"no {form!r} here")
    width = thickness_for(gyroid, fraction, form=form)
    assert measured(getattr(gyroid, form)(width)) == pytest.approx(fraction, abs=0.005)
    field = thickness_for(gyroid, fraction + 1e-4 * frep.sin(X), form=form)
    assert field((0, 0, 0)) == pytest.approx(width, abs=0.02)


@pytest.mark.parametrize("fraction", [-0.1, 0.0, 1.01])
def test_an_unreachable_fraction_names_the_reachable_ones(fraction):
    with pytest.raises(ArgumentError, match=r"fraction: .* fills .* to "):
        thickness_for(beams.bcc(), fraction)
    with pytest.raises(ArgumentError, match=r"fraction: .* fills .* to "):
        thickness_for(beams.bcc(), math.copysign(1e-3, fraction - 0.5) + fraction + 1e-4 * frep.sin(X))


def test_a_field_is_held_against_the_part_it_is_for():
    body = frep.box((0, 0, 0), (100, 10, 10))
    with pytest.raises(ArgumentError, match=r"fraction: .* at \("):
        thickness_for(beams.bcc(), 0.3 + 0.02 * X, over=body)
    thickness_for(beams.bcc(), 0.3 + 0.002 * X, over=body)


@pytest.mark.parametrize(
    ("argument", "error", "call"),
    [
        ("spacing", ArgumentError, lambda: from_grid(np.zeros((2, 2, 2)))),
        ("spacing", ArgumentError, lambda: from_grid(np.zeros((2, 2, 2)), -1)),
        ("spacing", ArgumentError, lambda: from_image(np.zeros((2, 2, 2)))),
        ("values", ArgumentError, lambda: from_grid(np.zeros((2, 2)), 1)),
        ("values", ArgumentTypeError, lambda: from_grid([["a"]], 1)),
        ("origin", ArgumentError, lambda: from_grid(np.zeros((2, 2, 2)), 1, (0, 0))),
        ("nan", ArgumentError, lambda: from_grid(np.full((2, 2, 2), np.nan), 1, nan="zero")),
        ("axes", ArgumentError, lambda: from_image(np.zeros((2, 2, 2)), spacing=1, axes="yxz")),
        ("image", FileError, lambda: from_image("nowhere.vti")),
        ("path", FileError, lambda: from_grid("nowhere.vdb")),
        ("data", FileError, lambda: from_mesh_data("nowhere.vtu")),
        ("image", ArgumentError, lambda: from_image(block(), "load")),
        ("array", ArgumentError, lambda: from_image(image(), "density")),
        ("data", ArgumentTypeError, lambda: from_mesh_data(np.zeros(3), "load")),
        ("values", ArgumentTypeError, lambda: from_grid(np.zeros((2, 2, 2), complex), 1)),
        ("values: 8 of 8 .* beyond", ArgumentError, lambda: from_grid(np.full((2, 2, 2), 1e300), 1)),
        ("nan: .*did you mean 'nearest'", ArgumentError, lambda: from_grid(np.zeros((2, 2, 2)), 1, nan="neares")),
        ("spacing", ArgumentError, lambda: from_grid(frep.sphere((0, 0, 0), 2).sample(voxel=0.5), 1)),
        ("periodic", ArgumentError, lambda: from_grid(frep.sphere((0, 0, 0), 2).sample(voxel=0.5), periodic=True)),
        ("array", ArgumentError, lambda: from_image(np.zeros((2, 2, 2)), "HU", spacing=1)),
        ("array: .*did you mean 'HU'", ArgumentError, lambda: from_image(image(), "hu")),
        ("nan", ArgumentError, lambda: from_mesh_data(block(), "load", nan="closest")),
        ("nan", ArgumentTypeError, lambda: from_mesh_data(block(), "load", nan=X)),  # type: ignore[arg-type]
        ("component", ArgumentError, lambda: from_mesh_data(block(), "pull", component=True)),
        ("component", ArgumentError, lambda: from_mesh_data(block(), "load", component=1)),
        ("array: 'name'", ArgumentTypeError, lambda: from_mesh_data(named(), "name")),
        ("plane", ArgumentError, lambda: from_points(RNG.uniform(0, 9, (20, 3)) * [1, 1, 0], np.ones(20), "rbf")),
        ("method: .*'linear'", ArgumentError, lambda: from_points(np.eye(3), [1, 2, 3], "liner")),
        ("curve: .*'smoothstep'", ArgumentError, lambda: remap(X, (0, 1), (0, 1), curve="smothstep")),
        ("smoothing", ArgumentError, lambda: smoothed(from_grid(np.zeros((2, 2, 2)), 1), 1e9)),
        ("spacing", ArgumentError, lambda: from_mesh_data(block(), "load", spacing=0)),
        ("spacing", frep.TooLargeError, lambda: from_mesh_data(block(), "load", spacing=1e-4)),
        ("scale", ArgumentError, lambda: from_mesh_data(block(), "load", scale=0)),
        ("points", ArgumentError, lambda: from_points(np.zeros((3, 2)), np.zeros(3))),
        ("points", ArgumentError, lambda: from_points(np.zeros((3, 3)), np.zeros(3))),
        ("points", ArgumentError, lambda: from_points([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [1, 2, 3])),
        ("values", ArgumentError, lambda: from_points(np.eye(3), [1, 2])),
        ("values: 1 of 3", ArgumentError, lambda: from_points(np.eye(3), [1, math.nan, 2])),
        ("method", ArgumentError, lambda: from_points(np.eye(3), [1, 2, 3], "cubic")),
        ("source", ArgumentError, lambda: remap(X, (1, 1), (0, 1))),
        ("source", ArgumentError, lambda: remap(X, 5, (0, 1))),
        ("target", ArgumentError, lambda: remap(X, (0, 1), (0, math.inf))),
        ("curve", ArgumentError, lambda: remap(X, (0, 1), (0, 1), curve="wavy")),
        ("curve", ArgumentError, lambda: remap(X, (0, 1), (0, 1), curve=0.5, clamp=False)),
        ("smoothing", ArgumentError, lambda: remap(X, (0, 1), (0, 1), smoothing=2)),
        ("smoothing", ArgumentError, lambda: smoothed(from_grid(np.zeros((2, 2, 2)), 1), -1)),
        ("topology", ArgumentTypeError, lambda: thickness_for(5, 0.2)),
        ("cell", ArgumentError, lambda: thickness_for(lambda w: w, 0.2)),
        ("cell", ArgumentError, lambda: thickness_for(beams.graph([(0, 0, 0), (1, 0, 0)], [(0, 1)]), 0.2)),
        ("form", ArgumentError, lambda: thickness_for(beams.bcc(), 0.2, form="sheet")),
        ("fraction", ArgumentTypeError, lambda: thickness_for(beams.bcc(), "half")),
        ("widths", ArgumentError, lambda: volume_fraction_curve(beams.bcc(), [math.nan])),
    ],
)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=argument):
        call()
