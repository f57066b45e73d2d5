"""Marching cubes: closed, oriented and manifold for any signs; exact, second order and equal to independent meshers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from frep.errors import TooLargeError
from frep.grid import INSIDE, LEAF, OUTSIDE, SparseGrid
from frep.meshing import marching
from frep.meshing.case_table import CORNERS, EDGES, case_table, loops
from frep.meshing.marching import Triangles, marching_cubes


def grid_of(samples: np.ndarray, *, voxel: float = 1.0, origin=(0.0, 0.0, 0.0), sparse: bool = False) -> SparseGrid:
    """A grid from a dense array, padded with outside to whole blocks; `sparse` keeps only the leaves near a sign
    change."""
    blocks = [-(-n // LEAF) for n in samples.shape]
    far = 3.0 * voxel
    dense = np.full([LEAF * b for b in blocks], far, dtype=np.float32)
    dense[tuple(slice(n) for n in samples.shape)] = samples
    table = np.full(blocks, OUTSIDE, dtype=np.int32)
    leaves = []
    for block in np.ndindex(*blocks):
        around = dense[tuple(slice(max(0, LEAF * b - 1), LEAF * b + LEAF + 1) for b in block)] < 0
        if sparse and around.all() == around.any():
            table[block] = INSIDE if around.any() else OUTSIDE
        else:
            table[block] = len(leaves)
            leaves.append(block)
    leaves = np.array(leaves, dtype=np.int32).reshape(-1, 3)
    values = [dense[tuple(slice(LEAF * b, LEAF * b + LEAF) for b in leaf)] for leaf in leaves]
    values = np.array(values, dtype=np.float32).reshape(-1, LEAF, LEAF, LEAF)
    return SparseGrid(np.array(origin, dtype=float), voxel, table, leaves, values, far)


def tiles(table: np.ndarray) -> SparseGrid:
    """A grid without leaves."""
    none = np.empty((0, 3), dtype=np.int32)
    values = np.empty((0, LEAF, LEAF, LEAF), dtype=np.float32)
    return SparseGrid(np.zeros(3), 1.0, table.astype(np.int32), none, values, 2.0)


def axes_of(n: int, half: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Open coordinate grids of n samples over [-half, half], the voxel and the origin."""
    x = np.linspace(-half, half, n)
    return x[:, None, None], x[None, :, None], x[None, None, :], x[1] - x[0], -half


def sphere(n: int, radius: float = 1.0, *, sparse: bool = False) -> SparseGrid:
    x, y, z, voxel, low = axes_of(n, 1.3 * radius)
    samples = np.sqrt((x - 0.031) ** 2 + (y + 0.017) ** 2 + (z - 0.011) ** 2) - radius
    return grid_of(samples, voxel=voxel, origin=(low, low, low), sparse=sparse)


def torus(n: int, *, sparse: bool = False) -> SparseGrid:
    x, y, z, voxel, low = axes_of(n, 1.6)
    samples = np.hypot(np.hypot(x - 0.013, y - 0.007) - 1.0, z - 0.021) - 0.4
    return grid_of(samples, voxel=voxel, origin=(low, low, low), sparse=sparse)


def gyroid(n: int = 64, *, sparse: bool = False) -> SparseGrid:
    """A sheet cut by a box, so that it is closed and has edges."""
    x, y, z, voxel, low = axes_of(n, 5.0)
    sheet = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)) - 0.5
    box = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z)) - 4.7
    return grid_of(np.maximum(sheet, box), voxel=voxel, origin=(low, low, low), sparse=sparse)


def corners_of(mesh: Triangles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return a, b, c


def volume_of(mesh: Triangles) -> float:
    a, b, c = corners_of(mesh)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def areas_of(mesh: Triangles) -> np.ndarray:
    a, b, c = corners_of(mesh)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def euler_of(mesh: Triangles) -> int:
    return len(mesh.vertices) - len(mesh.faces) // 2  # E = 3 F / 2 on a closed mesh


def assert_closed_manifold(mesh: Triangles) -> None:
    """Every edge in one triangle each way, the triangles round every vertex one fan, every vertex used."""
    n = len(mesh.vertices)
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int32
    assert np.isfinite(mesh.vertices).all()
    if len(mesh.faces) == 0:
        assert n == 0
        return
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < n
    f = mesh.faces.astype(np.int64)
    start, end = f.reshape(-1), np.roll(f, -1, axis=1).reshape(-1)
    assert (start != end).all()
    one_way, other_way = np.sort(start * n + end), np.sort(end * n + start)
    np.testing.assert_array_equal(one_way, other_way)
    assert (np.diff(one_way) > 0).all()
    # Two corners at the same vertex are neighbours when their triangles share an edge at it: the edge leaving the
    # vertex in one enters it in the other.
    corner = np.arange(f.size)
    before = np.roll(f, 1, axis=1).reshape(-1)  # the vertex before `start` in its triangle
    leaving, entering = start * n + end, start * n + before
    by_entering = np.argsort(entering)
    neighbour = by_entering[np.searchsorted(entering, leaving, sorter=by_entering)]
    np.testing.assert_array_equal(entering[neighbour], leaving)
    fans = connected_components(coo_array((np.ones(f.size), (corner, neighbour)), shape=(f.size, f.size)))[0]
    assert fans == n


def soup_of(mesh: Triangles) -> np.ndarray:
    """(m, 9) triangles in an order that depends on their positions only."""
    points = np.stack(corners_of(mesh), axis=1)
    first = np.argmin(points @ np.array([1.0, np.sqrt(2.0), np.sqrt(3.0)]), axis=1)
    turned = points[np.arange(len(points))[:, None], (first[:, None] + np.arange(3)) % 3]
    flat = turned.reshape(-1, 9)
    return flat[np.lexsort(flat.T)]


class TestCaseTable:
    def test_each_crossed_edge_is_in_one_loop(self):
        for case in range(256):
            inside = [case >> c & 1 for c in range(8)]
            ends = {e: (c, c + (4, 2, 1)[axis]) for e, (axis, c) in enumerate(EDGES)}
            crossed = [e for e, (a, b) in ends.items() if inside[a] != inside[b]]
            assert sorted(e for loop in loops(case) for e in loop) == crossed

    def test_no_inner_edge_joins_two_points_of_one_face(self):
        table = case_table()

        def planes(e: int) -> set[tuple[int, int]]:
            axis, c = EDGES[e]
            return {(k, CORNERS[c][k]) for k in range(3) if k != axis}

        for case in range(256):
            segments = {(a, b) for loop in loops(case) for a, b in zip(loop, [*loop[1:], loop[0]], strict=True)}
            used = set()
            for a, b, c in table.triangles[case, : table.counts[case]].tolist():
                used |= {(a, b), (b, c), (c, a)}
            assert segments <= used
            for a, b in used - segments:
                assert (b, a) in used
                assert not planes(a) & planes(b)

    def test_all_cases_embedded(self):
        """One cell of each case, 4 samples apart, in every position relative to the borders of leaves."""
        cells = np.ones((64, 64, 4))
        for case in range(256):
            for c, (i, j, k) in enumerate(CORNERS):
                cells[4 * (case >> 4) + i, 4 * (case & 15) + j, k] = -1.0 if case >> c & 1 else 1.0
        for i, j, k in np.ndindex(4, 4, 2):
            samples = np.ones((72, 72, 16))
            samples[1 + i : 65 + i, 1 + j : 65 + j, 6 + k : 10 + k] = cells
            assert_closed_manifold(marching_cubes(grid_of(samples, sparse=True)))
            assert_closed_manifold(marching_cubes(grid_of(-samples)))


class TestTopology:
    @settings(max_examples=40, deadline=None)
    @given(seed=st.integers(0, 2**32 - 1), inside=st.floats(0.02, 0.98))
    def test_noise(self, seed, inside):
        """Random samples up to the border of the grid: every case beside every other, capped at the box."""
        samples = np.random.default_rng(seed).random((16, 16, 16)) - inside
        mesh = marching_cubes(grid_of(samples))
        assert_closed_manifold(mesh)
        assert areas_of(mesh).min(initial=1.0) > 0

    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 2**32 - 1))
    def test_zeros_and_infinities(self, seed):
        values = np.array([-np.inf, -1.0, -1e-30, -0.0, 0.0, 1e-30, 1.0, np.inf])
        mesh = marching_cubes(grid_of(np.random.default_rng(seed).choice(values, (13, 9, 17))))
        assert_closed_manifold(mesh)
        assert areas_of(mesh).min() > 0

    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 2**32 - 1))
    def test_tiles_that_contradict_their_neighbours(self, seed):
        random = np.random.default_rng(seed)
        table = random.choice([INSIDE, OUTSIDE, 0], (3, 2, 4)).astype(np.int32)
        leaves = np.argwhere(table == 0).astype(np.int32)
        table[tuple(leaves.T)] = np.arange(len(leaves))
        values = (random.random((len(leaves), LEAF, LEAF, LEAF)) - random.random()).astype(np.float32)
        grid = SparseGrid(np.zeros(3), 1.0, table, leaves, values, 2.0)
        mesh = marching_cubes(grid)
        assert_closed_manifold(mesh)
        # The same as with the tiles written out, but for where the vertices beside them are numbered.
        np.testing.assert_array_equal(soup_of(mesh), soup_of(marching_cubes_far(grid.dense(), far=2.0)))

    def test_genus(self):
        assert euler_of(marching_cubes(sphere(24))) == 2
        assert euler_of(marching_cubes(torus(32))) == 0

    def test_full_tile_is_a_capped_block(self):
        mesh = marching_cubes(tiles(np.full((2, 1, 1), INSIDE)))
        assert_closed_manifold(mesh)
        assert euler_of(mesh) == 2
        np.testing.assert_allclose(mesh.vertices.min(axis=0), -0.5)
        np.testing.assert_allclose(mesh.vertices.max(axis=0), [15.5, 7.5, 7.5])
        assert mesh.leaf_starts.tolist() == [0]

    def test_empty(self):
        empty = marching_cubes(tiles(np.full((2, 3, 1), OUTSIDE)))
        assert empty.vertices.shape == (0, 3)
        assert empty.faces.shape == (0, 3)
        quiet = marching_cubes(grid_of(np.ones((9, 9, 9))))
        assert quiet.vertices.shape == (0, 3)
        assert quiet.leaf_starts.tolist() == [0] * 9


def marching_cubes_far(dense: np.ndarray, far: float) -> Triangles:
    grid = grid_of(dense)
    return marching_cubes(SparseGrid(grid.origin, grid.voxel, grid.table, grid.leaves, grid.values, far))


class TestGeometry:
    @pytest.mark.parametrize(
        ("shape", "volume", "area"),
        [(sphere, 4 / 3 * np.pi, 4 * np.pi), (torus, 2 * np.pi**2 * 0.16, 4 * np.pi**2 * 0.4)],
    )
    def test_second_order(self, shape, volume, area):
        counts = np.array([24, 48, 96])
        meshes = [marching_cubes(shape(n)) for n in counts]
        for mesh in meshes:
            assert_closed_manifold(mesh)
        for errors in (
            [volume_of(mesh) / volume - 1 for mesh in meshes],
            [areas_of(mesh).sum() / area - 1 for mesh in meshes],
        ):
            order = -np.diff(np.log(np.abs(errors))) / np.diff(np.log(counts - 1))
            assert (order > 1.7).all(), (errors, order)
            assert abs(errors[-1]) < 2e-3

    def test_oriented_outward(self):
        mesh = marching_cubes(sphere(32))
        a, b, c = corners_of(mesh)
        assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()

    def test_plane_is_exact(self):
        """A linear field, whose zero is linear on every edge: vertices lie on it to float32 in a voxel."""
        x, y, z, voxel, low = axes_of(30, 7.0)
        normal = np.array([0.6, 0.48, 0.64])
        field = normal[0] * x + normal[1] * y + normal[2] * z - 0.123
        mesh = marching_cubes(grid_of(field, voxel=voxel, origin=(low, low, low)))
        inner = (np.abs(mesh.vertices) < 6.9).all(axis=1)
        assert inner.sum() > 1000
        np.testing.assert_allclose(mesh.vertices[inner] @ normal, 0.123, atol=2e-6)

    @pytest.mark.parametrize("shape", [sphere, torus])
    def test_vertices_and_area_of_skimage(self, shape):
        from skimage.measure import marching_cubes as reference

        grid = shape(40)
        mesh = marching_cubes(grid)
        vertices, faces, _, _ = reference(grid.dense(), 0.0, spacing=(grid.voxel,) * 3, method="lorensen")
        vertices = vertices + grid.origin
        assert len(vertices) == len(mesh.vertices)
        distance, partner = cKDTree(vertices).query(mesh.vertices)
        assert distance.max() < 1e-4 * grid.voxel
        assert len(np.unique(partner)) == len(vertices)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
        np.testing.assert_allclose(areas_of(mesh).sum(), area, rtol=1e-3)

    def test_volume_of_vtk(self):
        import pyvista

        grid = gyroid()
        mesh = marching_cubes(grid)
        assert_closed_manifold(mesh)
        image = pyvista.ImageData(dimensions=grid.shape, spacing=(grid.voxel,) * 3, origin=tuple(grid.origin))
        image.point_data["value"] = grid.dense().ravel(order="F")
        reference = image.contour([0.0], scalars="value", method="flying_edges")
        np.testing.assert_allclose(volume_of(mesh), reference.volume, rtol=1e-3)
        np.testing.assert_allclose(areas_of(mesh).sum(), reference.area, rtol=2e-3)

    def test_zero_samples_leave_no_degenerate_face(self):
        """A box and an octahedron whose faces, edges and corners lie on samples."""
        x, y, z = np.ogrid[-9:10, -9:10, -9:10]
        for samples, volume in [
            (np.maximum(np.maximum(abs(x), abs(y)), abs(z)) - 6.0, 12.0**3),
            (abs(x) + abs(y) + abs(z) - 6.0, 4 / 3 * 6.0**3),
        ]:
            mesh = marching_cubes(grid_of(samples, sparse=True))
            assert_closed_manifold(mesh)
            assert areas_of(mesh).min() > 1e-9
            assert 0.95 * volume < volume_of(mesh) < volume  # the box loses half a voxel square along its edges


class TestBlocks:
    @pytest.mark.parametrize("shape", [sphere, torus, gyroid])
    def test_sparse_is_dense(self, shape):
        dense, sparse = shape(80), shape(80, sparse=True)
        assert len(sparse.leaves) < len(dense.leaves)
        np.testing.assert_array_equal(soup_of(marching_cubes(dense)), soup_of(marching_cubes(sparse)))

    def test_leaf_starts_name_the_owner_of_each_vertex(self):
        samples = np.random.default_rng(5).random((24, 16, 32)) - 0.3
        samples[[0, -1]] = samples[:, [0, -1]] = samples[:, :, [0, -1]] = 1.0
        grid = grid_of(samples, voxel=0.25, origin=(-2.0, 3.0, 0.5))
        mesh = marching_cubes(grid)
        assert mesh.leaf_starts[0] == 0
        assert mesh.leaf_starts[-1] == len(mesh.vertices)
        owner = np.floor((mesh.vertices - grid.origin) / grid.voxel).astype(int) // LEAF
        leaf = np.repeat(np.arange(len(grid.leaves)), np.diff(mesh.leaf_starts))
        np.testing.assert_array_equal(owner, grid.leaves[leaf])

    def test_far_from_the_origin(self):
        here = gyroid(40)
        shift = np.array([1e6, -1e6, 3e5])
        there = SparseGrid(here.origin + shift, here.voxel, here.table, here.leaves, here.values, here.background)
        a, b = marching_cubes(here), marching_cubes(there)
        np.testing.assert_array_equal(a.faces, b.faces)
        np.testing.assert_allclose(b.vertices - shift, a.vertices, rtol=0, atol=1e-9)

    def test_does_not_depend_on_threads(self):
        import numba

        grid = gyroid(40)
        many = marching_cubes(grid)
        threads = numba.get_num_threads()
        numba.set_num_threads(1)
        try:
            one = marching_cubes(grid)
        finally:
            numba.set_num_threads(threads)
        np.testing.assert_array_equal(one.faces, many.faces)
        np.testing.assert_array_equal(one.vertices, many.vertices)

    def test_leaves_the_grid_alone(self):
        grid = gyroid(40, sparse=True)
        before = [grid.origin.copy(), grid.table.copy(), grid.leaves.copy(), grid.values.copy()]
        marching_cubes(grid)
        for old, new in zip(before, [grid.origin, grid.table, grid.leaves, grid.values], strict=True):
            np.testing.assert_array_equal(old, new)

    def test_too_many_vertices(self, monkeypatch):
        monkeypatch.setattr(marching, "_MOST_VERTICES", 100)
        with pytest.raises(TooLargeError, match=r"voxel=.*vertices"):
            marching_cubes(sphere(24))
