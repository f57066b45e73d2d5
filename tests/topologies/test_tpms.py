"""Periodic surfaces: volume fractions of Steiner's formula, true wall thickness, distances with unit slope, warnings."""

from __future__ import annotations

import math
import warnings
from functools import partial

import numpy as np
import pytest
from scipy.spatial import cKDTree

import frep
from frep import ArgumentError, ArgumentTypeError
from topologies import tpms

RNG = np.random.default_rng(8)
X, Y, Z = frep.coordinates()
SURFACES = {
    "gyroid": (tpms.gyroid, 3.0916, -8),
    "schwarz_p": (tpms.schwarz_p, 2.3526, -4),
}
AREAS = {
    **SURFACES,
    "schwarz_d": (tpms.schwarz_d, 3.8380, -16),
    "schwarz_d, pi": (partial(tpms.schwarz_d, period="pi"), 1.9190, -2),
}
"""Area of a cell's nodal surface over the cell side squared, and the sheet's Euler number (lf-rep O8)."""


CUBOID = (6.0, 9.0, 7.0)
"""One uneven cell for all tests: a distance is made once for a surface and cell."""


def on_surface(surface: tpms.PeriodicSurface, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Random points of the zero set and their unit normals, by Newton steps on the level function alone."""
    points = RNG.uniform(0, surface.cell, (n, 3))
    for _ in range(30):
        gradient = surface.level.gradient(points)
        squared = np.maximum((gradient**2).sum(axis=1), 1e-3 * np.max((gradient**2).sum(axis=1)))
        step = (surface.level(points) / squared)[:, None] * gradient
        length = np.linalg.norm(step, axis=1)[:, None]
        points = points - step * np.minimum(1.0, 0.05 * min(surface.cell) / np.maximum(length, 1e-300))
    points = points[np.abs(surface.level(points)) < 1e-12]
    assert len(points) > 0.9 * n
    gradient = surface.level.gradient(points)
    return points, gradient / np.linalg.norm(gradient, axis=1)[:, None]


@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("kind", AREAS)
def test_volume_fractions(kind, share):
    """O8: rho = a tau + (pi chi / 6) tau^3, which first-order distances miss by up to 14 %."""
    make, area, euler = AREAS[kind]
    u = 10.0
    part = make(cell=u).sheet(share * u) & frep.box((0, 0, 0), (u, u, u))
    expected = area * share + math.pi * euler / 6 * share**3
    assert part.volume(voxel=u / 80) / u**3 == pytest.approx(expected, abs=4e-3)


@pytest.mark.parametrize("kind", SURFACES)
def test_areas_of_both_sides(kind):
    """O8: 2 a + pi chi tau^2, of the facets in one period, away from the cut faces."""
    make, area, euler = SURFACES[kind]
    u, share = 10.0, 0.15
    mesh = (make(cell=u).sheet(share * u) & frep.box((-1, -1, -1), (u + 1, u + 1, u + 1))).mesh(
        voxel=u / 60, polish=True
    )
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    size = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    period = np.all((centres >= 0) & (centres < u), axis=1)
    assert size[period].sum() / u**2 == pytest.approx(2 * area + math.pi * euler * share**2, rel=0.01)


@pytest.mark.parametrize("cell", [10.0, CUBOID], ids=["cubic", "cuboid"])
@pytest.mark.parametrize("kind", SURFACES)
def test_walls_have_the_thickness_asked_for(kind, cell):
    """From random points of the mid-surface along both normals, the wall ends after half its thickness."""
    surface = SURFACES[kind][0](cell=cell)
    points, normals = on_surface(surface)
    for thickness in (0.1, 0.4, 0.8):
        sheet = surface.sheet(thickness)
        for side in (-1.0, 1.0):
            at_end = sheet.field(points + 0.5 * side * thickness * normals)
            assert np.abs(at_end).max() < 2e-4
            assert np.median(np.abs(at_end)) < 1e-6


@pytest.mark.parametrize("kind", SURFACES)
def test_walls_of_the_mesh_measured_by_inscribed_balls(kind):
    """0.8 mm asked is 0.8 mm within a quarter voxel: the largest ball round a point of the mid-surface touches the mesh
    at half the wall."""
    voxel, wall = 0.2, 0.8
    surface = SURFACES[kind][0](cell=10.0)
    mesh = (surface.sheet(wall) & frep.box((0, 0, 0), (10, 10, 10))).mesh(voxel=voxel, polish=True)
    points, _ = on_surface(surface, 3000)
    points = points[(points > 1).all(axis=1) & (points < 9).all(axis=1)]
    # Dense samples of the facets, so that the tree measures to the facets and not to the corners alone.
    corners = mesh.vertices[mesh.faces]
    weights = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
    samples = np.einsum("wk,fkc->fwc", weights, corners).reshape(-1, 3)
    nearest, _ = cKDTree(samples).query(points)
    width = 2 * nearest
    assert np.abs(np.median(width) - wall) < 0.05 * voxel
    assert np.abs(width - wall).max() < 0.25 * voxel


@pytest.mark.parametrize("kind", SURFACES)
def test_distance_agrees_with_dense_samples_of_the_surface(kind):
    surface = SURFACES[kind][0](cell=CUBOID)
    dense, _ = on_surface(surface, 60_000)
    tree = cKDTree(np.mod(dense, surface.cell) % surface.cell, boxsize=surface.cell)
    points = RNG.uniform(0, surface.cell, (3000, 3))
    by_samples, _ = tree.query(points)
    ours = np.abs(surface.distance(points))
    # Samples are a few hundredths of a millimetre apart, and the nearest of them is never nearer than the surface. The
    # spline rounds the crease in the middle of the channels.
    far = by_samples > 0.3
    assert (by_samples - ours)[far].max() < 0.07
    # Where creases meet, at the centres of Schwarz P's chambers, it overshoots: by 0.0042 cells, of 600,000 places.
    assert (by_samples - ours).min() > -5e-3 * min(surface.cell)
    assert (by_samples - ours)[ours < 0.08 * min(surface.cell)].min() > -1e-4
    assert np.median((by_samples - ours)[far]) < 5e-3
    level = surface.level(points)
    clear = ours > 1e-3
    np.testing.assert_array_equal(surface.distance(points)[clear] > 0, level[clear] > 0)


@pytest.mark.parametrize("kind", SURFACES)
def test_distance_has_unit_slope_and_the_period_of_the_cell(kind):
    surface = SURFACES[kind][0](cell=CUBOID)
    field = surface.distance
    points = RNG.uniform(0, 30, (4000, 3))
    near = points[np.abs(field(points)) < 0.5]
    slope = np.linalg.norm(field.gradient(near), axis=1)
    # Cubic splines between rounded creases: of 200,000 places three in 100,000 are off by more than 0.005, none by 0.006.
    assert np.abs(slope - 1).max() < 6e-3
    np.testing.assert_allclose(field(points + np.array([6, -18, 21])), field(points), atol=1e-5)
    # No two values differ by more than the points are apart, but for the rounded creases.
    other = points + RNG.normal(0, 0.5, points.shape)
    assert np.all(np.abs(field(other) - field(points)) <= np.linalg.norm(other - points, axis=1) + 0.03)
    near = np.maximum(np.abs(field(points)), np.abs(field(other))) < 0.5
    apart = np.linalg.norm(other - points, axis=1)
    assert np.all(np.abs(field(other) - field(points))[near] <= apart[near] + 1e-4)


def test_distance_bounds_enclose():
    field = tpms.gyroid(cell=CUBOID).distance
    lo = RNG.uniform(-20, 20, (500, 3))
    hi = lo + 5 * RNG.uniform(0, 1, (500, 1)) ** 3
    least, most = field.bounds(lo, hi)
    values = field((lo[:, None] + RNG.uniform(0, 1, (500, 40, 3)) * (hi - lo)[:, None]).reshape(-1, 3)).reshape(500, 40)
    assert np.all(least <= values.min(axis=1))
    assert np.all(most >= values.max(axis=1))


def test_symmetries():
    """The gyroid turns about (1, 1, 1) and inverts; P is symmetric in each mid-plane; a sheet keeps both."""
    gyroid, schwarz = tpms.gyroid(cell=10).sheet(0.7), tpms.schwarz_p(cell=10).sheet(0.7)
    points = RNG.uniform(0, 10, (1000, 3))
    # To the accuracy of the spline, which lies on a grid that has the symmetries only in part.
    np.testing.assert_allclose(gyroid.field(points[:, [1, 2, 0]]), gyroid.field(points), atol=5e-3)
    np.testing.assert_allclose(gyroid.field(-points), gyroid.field(points), atol=5e-3)
    np.testing.assert_allclose(schwarz.field(points * (1, -1, 1)), schwarz.field(points), atol=5e-3)
    np.testing.assert_allclose(schwarz.field(points + 5), schwarz.field(points), atol=5e-3)


def test_graded_walls_follow_the_law():
    surface = tpms.schwarz_p(cell=10)
    law = 0.4 + 0.04 * Z
    sheet = surface.sheet(law)
    points, normals = on_surface(surface)
    for side in (-1.0, 1.0):
        # Where the wall ends, its law is half the distance from the mid-surface: solve along the normal.
        end = points.copy()
        for _ in range(8):
            end = points + side * 0.5 * law(end)[:, None] * normals
        assert np.abs(sheet.field(end)).max() < 2e-3


def test_sheet_meshes_with_the_euler_number_of_its_periods():
    """O9: a block of cells of P cut at its mid-planes is one closed component."""
    part = tpms.schwarz_p(cell=10).sheet(1.6) & frep.box((0, 0, 0), (20, 20, 20))
    report = part.mesh(voxel=0.4).check()
    assert report.printable
    assert report.components == 1


@pytest.mark.parametrize(("kind", "pinch"), [("gyroid", math.sqrt(3) / 4), ("schwarz_p", math.sqrt(2) / 3)])
def test_walls_that_seal_the_channels_warn(kind, pinch):
    surface = SURFACES[kind][0](cell=10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface.sheet(9.9 * pinch)
        surface.sheet(1 + 0.1 * Z)
    with pytest.warns(tpms.SealedChannelWarning, match="seals the channels"):
        surface.sheet(10.1 * pinch)
    with pytest.warns(tpms.SealedChannelWarning, match="seals the channels"):
        surface.sheet(0.1 + 10 * pinch * frep.clip(Z, 0, 1))  # somewhere
    with pytest.raises(ArgumentError, match=r"thickness: a wall of .* fills the cell"):
        surface.sheet(10.1 * surface.full)
    with pytest.raises(ArgumentError, match="thickness"):
        surface.sheet(10.1 * surface.full + frep.clip(Z, 0, 1))  # everywhere


@pytest.mark.parametrize("kind", SURFACES)
def test_channels_pinch_where_the_table_says(kind):
    """The largest distance from the surface that a point can have along a channel is what the wall must stay under: a wall
    just above the pinch leaves voids that do not meet across the cell faces."""
    from scipy.ndimage import label

    surface = SURFACES[kind][0](cell=10.0)
    n = 48  # the middles of the necks are nodes
    g = 10.0 * np.arange(2 * n) / n
    distance = surface.distance(np.stack(np.meshgrid(g, g, g, indexing="ij"), -1).reshape(-1, 3)).reshape(
        2 * n, 2 * n, 2 * n
    )

    def through(share: float) -> bool:
        pieces, _ = label(distance > 5.0 * share, structure=np.ones((3, 3, 3)))
        return bool(np.intersect1d(pieces[0][pieces[0] > 0], pieces[-1][pieces[-1] > 0]).size)

    assert through(surface.pinch - 0.015)
    assert not through(surface.pinch + 0.015)


BAD = [
    ("cell", ArgumentError, lambda: tpms.gyroid(0)),
    ("cell", ArgumentError, lambda: tpms.gyroid((5, -5, 5))),
    ("cell", ArgumentError, lambda: tpms.schwarz_p(math.nan)),
    ("cell", ArgumentTypeError, lambda: tpms.schwarz_p(X)),
    ("cell", ArgumentTypeError, lambda: tpms.gyroid((1, 2))),
    ("thickness", ArgumentError, lambda: tpms.gyroid(5).sheet(0)),
    ("thickness", ArgumentError, lambda: tpms.gyroid(5).sheet(-1)),
    ("thickness", ArgumentError, lambda: tpms.gyroid(5).sheet(math.inf)),
    ("thickness", ArgumentTypeError, lambda: tpms.gyroid(5).sheet("thin")),
    ("thickness", ArgumentTypeError, lambda: tpms.gyroid(5).sheet(frep.sphere((0, 0, 0), 1))),
]


@pytest.mark.parametrize(("argument", "error", "call"), BAD)
def test_bad_input_names_the_argument(argument, error, call):
    with pytest.raises(error, match=rf"\b{argument}\b"):
        call()
