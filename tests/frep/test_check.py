"""`Mesh.check`: shapes whose topology is known, an independent count of edges, and every kind of fault, planted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frep.mesh import Mesh

TETRA_VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
TETRA = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def torus(n: int = 12, m: int = 9) -> Mesh:
    """A torus of n x m quads, two triangles each: genus 1 by construction."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    points = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.indices((n, m))
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    return Mesh(points, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3))


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=False)]),
    )


def tetra() -> Mesh:
    return Mesh(TETRA_VERTICES, TETRA)


def test_known_shapes():
    for mesh, components, genus in ((tetra(), 1, 0), (torus(), 1, 1), (joined(torus(), tetra(), torus()), 3, 2)):
        report = mesh.check()
        assert report.closed
        assert report.manifold
        assert report.oriented
        assert report.printable
        assert (report.components, report.genus) == (components, genus)
        assert report.open_edges == report.degenerate_faces == report.duplicate_faces == 0
        assert mesh.volume > 0


def test_unused_vertices_change_nothing():
    mesh = torus()
    more = Mesh(np.vstack([[[7.0, 7, 7]], mesh.vertices, [[9.0, 9, 9]]]), mesh.faces + 1)
    assert more.check() == mesh.check()


def test_a_missing_face_opens_three_edges():
    report = Mesh(TETRA_VERTICES, TETRA[:3]).check()
    assert not report.closed
    assert report.manifold
    assert report.oriented
    assert report.open_edges == 3
    assert report.genus is None


def test_a_flipped_face_is_not_oriented():
    faces = TETRA.copy()
    faces[1] = faces[1, ::-1]
    report = Mesh(TETRA_VERTICES, faces).check()
    assert report.closed
    assert report.manifold
    assert not report.oriented
    assert not report.printable


def test_two_solids_that_share_a_vertex_or_an_edge_are_not_manifold():
    by_vertex = Mesh(
        np.vstack([TETRA_VERTICES, -TETRA_VERTICES[1:]]), np.vstack([TETRA, np.where(TETRA, TETRA + 3, 0)[:, ::-1]])
    )
    report = by_vertex.check()
    assert report.closed
    assert not report.manifold
    assert (report.non_manifold_vertices, report.non_manifold_edges) == (1, 0)
    assert report.genus is None

    shared = np.array([0, 1, 4, 5])  # the edge 0-1 belongs to both
    by_edge = Mesh(np.vstack([TETRA_VERTICES, [[0, -1, 0], [0, 0, -1]]]), np.vstack([TETRA, shared[TETRA]]))
    report = by_edge.check()
    assert report.closed
    assert not report.manifold
    assert report.non_manifold_edges == 1


def test_three_faces_on_an_edge_are_neither_closed_nor_manifold():
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]], float)
    report = Mesh(vertices, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])).check()
    assert not report.closed
    assert report.non_manifold_edges == 1
    assert report.open_edges == 6


def test_degenerate_and_duplicate_faces_are_counted():
    vertices = np.vstack([TETRA_VERTICES, [[0.5, 0, 0]]])
    faces = np.vstack([TETRA, [[0, 0, 1], [0, 4, 1], [1, 0, 2], [0, 2, 1]]])
    report = Mesh(vertices, faces).check()
    assert report.degenerate_faces == 2  # a vertex twice; three vertices on one line
    assert report.duplicate_faces == 2  # in another order, and the same again


def test_an_empty_mesh_is_not_closed():
    report = Mesh(np.empty((0, 3)), np.empty((0, 3), int)).check()
    assert not report.closed
    assert report.components == 0


def test_a_fan_of_a_thousand_faces_is_one_fan():
    n = 1000
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    i = np.arange(n)
    j = (i + 1) % n
    faces = np.vstack([np.stack([0 * i, 2 + i, 2 + j], 1), np.stack([0 * i + 1, 2 + j, 2 + i], 1)])
    report = Mesh(np.vstack([[[0, 0, 1], [0, 0, -1]], rim]), faces).check()
    assert report.printable
    assert report.genus == 0


@settings(deadline=None, max_examples=60)
@given(faces=st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=3, unique=True), min_size=1, max_size=30))
def test_edge_counts_agree_with_sorting_them_all(faces):
    """Against numpy.unique over all edges, and scipy's components."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    f = np.array(faces)
    report = Mesh(np.random.default_rng(0).random((8, 3)), f).check()
    half = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    _, index, count = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True, return_counts=True)
    forward = np.bincount(index.ravel(), half[:, 0] < half[:, 1])
    assert report.open_edges == np.count_nonzero(count == 1)
    assert report.non_manifold_edges == np.count_nonzero(count > 2)
    assert report.closed == (not (count % 2).any())
    assert report.oriented == (np.abs(2 * forward - count) <= count % 2).all()
    graph = coo_array((np.ones(len(half)), (half[:, 0], half[:, 1])), shape=(8, 8))
    pieces = connected_components(graph, directed=False)[0] - (8 - len(np.unique(f)))
    assert report.components == pieces
    assert report.duplicate_faces == len(f) - len(np.unique(np.sort(f, axis=1), axis=0))


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_numbering_and_order_do_not_matter(seed):
    random = np.random.default_rng(seed)
    mesh = torus(7, 5)
    order = random.permutation(len(mesh.vertices))
    faces = np.argsort(order)[mesh.faces][random.permutation(mesh.n_faces)]
    faces = np.take_along_axis(faces, (np.arange(3) + random.integers(0, 3, (len(faces), 1))) % 3, axis=1)
    assert Mesh(mesh.vertices[order], faces).check() == mesh.check()


@pytest.mark.parametrize("words", ["closed", "yes (0 open edges)", "genus", "components"])
def test_the_report_reads(words):
    assert words in str(torus().check())
