"""Sampled grids and splines as Fields: interpolation against scipy, refinement, wrapping, bounds, content keys."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import map_coordinates

import frep
from frep import ArgumentError
from frep.field import Field
from frep.sampled import PeriodicSpline, SampledGrid

RNG = np.random.default_rng(13)
ORIGIN, SPACING = np.array([1.0, -2.0, 0.5]), np.array([0.5, 0.7, 0.9])
NODES = RNG.normal(size=(7, 5, 6)).astype(np.float32)
X, Y, Z = frep.coordinates()


def plain(**changes) -> SampledGrid:
    return SampledGrid(**{"origin": ORIGIN, "spacing": SPACING, "nodes": NODES, **changes})


def extent(grid: SampledGrid) -> tuple[np.ndarray, np.ndarray]:
    return grid.origin, grid.origin + grid.spacing * grid.cells


def wrapped_nodes() -> np.ndarray:
    nodes = NODES.copy()
    nodes[-1], nodes[:, -1], nodes[:, :, -1] = nodes[0], nodes[:, 0], nodes[:, :, 0]
    return nodes


def refined() -> SampledGrid:
    """Two cells refined: on their faces the fine nodes continue the coarse ones, within they are anything."""
    table = np.full((6, 4, 5), -1, np.int32)
    blocks = np.empty((2, 9, 9, 9), np.float32)
    t = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 3, indexing="ij"), -1)
    for number, (i, j, k) in enumerate([(2, 1, 3), (5, 3, 0)]):
        table[i, j, k] = number
        corners = NODES[i : i + 2, j : j + 2, k : k + 2].astype(float)
        coarse = RegularGridInterpolator([[0, 1]] * 3, corners)(t)
        blocks[number] = coarse + np.prod(4 * t * (1 - t), axis=-1) * RNG.normal(size=(9, 9, 9))
    return plain(table=table, blocks=blocks)


def test_values_are_trilinear():
    grid = plain()
    lo, hi = extent(grid)
    points = RNG.uniform(lo, hi, (2000, 3))
    axes = [np.linspace(a, b, n) for a, b, n in zip(lo, hi, NODES.shape, strict=True)]
    expected = RegularGridInterpolator(axes, NODES.astype(float))(points)
    np.testing.assert_allclose(grid.field()(points), expected, atol=1e-6)


def test_nodes_are_met():
    grid = plain()
    index = np.argwhere(np.ones(NODES.shape, bool))
    np.testing.assert_allclose(grid.field()(ORIGIN + SPACING * index), NODES.reshape(-1), atol=1e-6)


def test_outside_the_nearest_value_goes_on_with_slope_one():
    grid = plain()
    lo, hi = extent(grid)
    points = RNG.uniform(lo - 5, hi + 5, (1000, 3))
    nearest = np.clip(points, lo, hi)
    expected = grid.field()(nearest) + np.linalg.norm(points - nearest, axis=1)
    np.testing.assert_allclose(grid.field()(points), expected, atol=1e-6)


def test_refined_cells_use_their_block():
    grid = refined()
    for cell, block in (((2, 1, 3), 0), ((5, 3, 0), 1)):
        t = RNG.uniform(0.001, 0.999, (300, 3))
        points = grid.origin + grid.spacing * (np.array(cell) + t)
        axes = [np.linspace(0, 1, 9)] * 3
        expected = RegularGridInterpolator(axes, grid.blocks[block].astype(float))(t)
        np.testing.assert_allclose(grid.field()(points), expected, atol=1e-6)
    elsewhere = grid.origin + grid.spacing * (np.array([1, 1, 1]) + RNG.uniform(0.01, 0.99, (100, 3)))
    np.testing.assert_allclose(grid.field()(elsewhere), plain().field()(elsewhere), atol=1e-6)


def test_periodic_grids_repeat():
    grid = plain(nodes=wrapped_nodes(), periodic=True)
    lo, hi = extent(grid)
    points = RNG.uniform(lo, hi, (500, 3))
    shifts = RNG.integers(-3, 4, (500, 3)) * (hi - lo)
    np.testing.assert_allclose(grid.field()(points + shifts), grid.field()(points), atol=1e-5)


SPLINE = PeriodicSpline(np.array([4.0, 6.0, 5.0]), RNG.normal(size=(8, 12, 10)))


def test_spline_passes_through_its_values_and_agrees_with_scipy():
    field = SPLINE.field()
    index = np.argwhere(np.ones(SPLINE.values.shape, bool))
    points = index * SPLINE.period / SPLINE.values.shape
    np.testing.assert_allclose(field(points), SPLINE.values.reshape(-1), atol=2e-6)
    points = RNG.uniform(-9, 15, (1000, 3))
    where = (points / SPLINE.period * SPLINE.values.shape).T
    expected = map_coordinates(SPLINE.values, where, order=3, mode="grid-wrap")
    np.testing.assert_allclose(field(points), expected, atol=5e-6)


def test_spline_is_smooth():
    """Slopes from both sides of a node agree."""
    field = SPLINE.field()
    node = np.array([3, 4, 5]) * SPLINE.period / SPLINE.values.shape
    for axis in np.eye(3):
        before = (field(node) - field(node - 1e-3 * axis)) / 1e-3
        after = (field(node + 1e-3 * axis) - field(node)) / 1e-3
        assert before == pytest.approx(after, abs=0.05)


@pytest.mark.parametrize("turn", [False, True], ids=["along the axes", "turned"])
@pytest.mark.parametrize(
    "leaf",
    [plain(), refined(), plain(nodes=wrapped_nodes(), periodic=True), SPLINE],
    ids=["plain", "refined", "periodic", "spline"],
)
def test_blocks_agree_with_points(leaf, turn):
    """The block kernels (separable where the coordinates are the grid's own) give what points give."""
    from frep.evaluate import Program, block_points

    field: Field = leaf.field()
    if turn:
        field = field.substitute(0.8 * X - 0.6 * Y, 0.6 * X + 0.8 * Y, Z + 0.1 * X)
    blocks = np.argwhere(np.ones((3, 2, 3), bool)).astype(np.int32)
    for voxel in (0.05, 0.3, 2.0):
        axes = tuple(-1.0 + 0.3 * a + voxel * np.arange(24) for a in range(3))
        out = np.empty((1, len(blocks), 512), np.float32)
        Program((field,)).on_blocks(blocks, axes, out)
        expected = field(block_points(blocks, axes)).reshape(out.shape)
        np.testing.assert_allclose(out, expected, atol=5e-5 * max(1.0, float(np.abs(expected).max())))


@pytest.mark.parametrize(
    "leaf",
    [plain(), refined(), plain(nodes=wrapped_nodes(), periodic=True), SPLINE],
    ids=["plain", "refined", "periodic", "spline"],
)
def test_bounds_enclose_and_are_of_use(leaf):
    field = leaf.field()
    lo = RNG.uniform(-8, 8, (600, 3))
    hi = lo + 8 * RNG.uniform(0, 1, (600, 1)) ** 4 * RNG.uniform(0.1, 1, (600, 3))
    least, most = field.bounds(lo, hi)
    points = lo[:, None] + RNG.uniform(0, 1, (600, 50, 3)) * (hi - lo)[:, None]
    values = field(points.reshape(-1, 3)).reshape(600, 50)
    assert np.all(least <= values.min(axis=1) + 1e-6)
    assert np.all(most >= values.max(axis=1) - 1e-6)
    everywhere = field.bounds((-1e6,) * 3, (1e6,) * 3)
    assert np.isfinite(everywhere[0])


def test_equal_data_is_one_field_and_pickles():
    assert plain().field() is plain(nodes=NODES.copy()).field()
    assert plain().field() is not plain(nodes=NODES + 1).field()
    assert plain().field() is not plain(spacing=2 * SPACING).field()
    assert SPLINE.field() is PeriodicSpline(SPLINE.period, SPLINE.values.copy()).field()
    points = RNG.uniform(0, 5, (50, 3))
    for leaf in (refined(), SPLINE):
        again = pickle.loads(pickle.dumps(leaf.field()))
        np.testing.assert_array_equal(again(points), leaf.field()(points))


@pytest.mark.parametrize(
    ("argument", "changes"),
    [
        ("nodes", {"nodes": NODES[:1]}),
        ("nodes", {"nodes": NODES[0]}),
        ("nodes", {"nodes": np.where(NODES > 1, np.nan, NODES)}),
        ("table", {"table": np.full((7, 5, 6), -1, np.int32)}),
    ],
)
def test_bad_data_is_refused(argument, changes):
    with pytest.raises(ArgumentError, match=argument):
        plain(**changes)


def test_grids_of_equal_bytes_and_other_shapes_are_other_fields():
    """Fields of equal content are one; the shape is content too."""
    numbers = np.arange(32, dtype=np.float32)
    one, other = (
        SampledGrid(np.zeros(3), np.ones(3), numbers.reshape(shape)).field() for shape in ((2, 4, 4), (4, 4, 2))
    )
    assert one != other
    assert one([[0, 3, 1]])[0] == 13
    assert other([[0, 3, 1]])[0] == 7
