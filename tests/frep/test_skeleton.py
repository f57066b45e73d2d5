"""Beam fields: the ball query against brute force, distances against independent formulas, enclosing bounds, cutoffs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

import frep
from frep import ArgumentError, Field
from frep.evaluate import Program
from frep.sampling import cutoffs
from frep.skeleton import GraphSkeleton, PeriodicSkeleton, Skeleton, beam_field
from topologies import beams

RNG = np.random.default_rng(23)
X, Y, Z = frep.coordinates()


# --- brute force, in plain numpy -----------------------------------------------------------------------------------------


def unrolled(skeleton: Skeleton, lo, hi) -> tuple[np.ndarray, np.ndarray]:
    """Segments (m, 2, 3) that can come near the box and their labels (edge, i, j, k)."""
    segments = skeleton.segments()
    if isinstance(skeleton, GraphSkeleton):
        labels = np.zeros((len(segments), 4), np.int64)
        labels[:, 0] = np.arange(len(segments))
        return segments, labels
    assert isinstance(skeleton, PeriodicSkeleton)
    size = skeleton.size
    first = np.floor((np.asarray(lo) - segments.max(axis=(0, 1))) / size).astype(int) - 1
    last = np.ceil((np.asarray(hi) - segments.min(axis=(0, 1))) / size).astype(int) + 1
    cells = np.stack(np.meshgrid(*[np.arange(a, b + 1) for a, b in zip(first, last, strict=True)], indexing="ij"), -1)
    cells = cells.reshape(-1, 3)
    shifted = segments[None] + (cells * size)[:, None, None, :]
    edge = np.broadcast_to(np.arange(len(segments)), (len(cells), len(segments)))
    labels = np.concatenate([edge[..., None], np.broadcast_to(cells[:, None], (*edge.shape, 3))], axis=-1)
    return shifted.reshape(-1, 2, 3), labels.reshape(-1, 4)


def along(points: np.ndarray, segments: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For every point and segment: position along the axis from its start, distance off the axis line, the length."""
    a, b = segments[:, 0], segments[:, 1]
    length = np.linalg.norm(b - a, axis=1)
    u = (b - a) / length[:, None]
    off = points[:, None] - a
    t = np.einsum("pmk,mk->pm", off, u)
    return t, np.linalg.norm(off - t[..., None] * u, axis=2), length


def axis_distances(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """(p, m) distances of points to segments."""
    t, radial, length = along(points, segments)
    return np.hypot(radial, np.maximum(np.maximum(-t, t - length), 0))


def prism_distances(points: np.ndarray, segments: np.ndarray, side, fillet) -> np.ndarray:
    """(p, m) signed distances to rounded square prisms with flat ends whose first side is horizontal."""
    t, _, length = along(points, segments)
    out = np.empty(t.shape)
    for m, (a, b) in enumerate(segments):
        u = (b - a) / length[m]
        e1 = np.cross([0, 0, 1.0], u)
        e1 = np.array([1.0, 0, 0]) if np.linalg.norm(e1) < 1e-9 else e1 / np.linalg.norm(e1)
        q = points - a
        flat = np.abs(np.stack([q @ e1, q @ np.cross(u, e1)], axis=1)) - (0.5 * side - fillet)[:, None]
        round_square = np.linalg.norm(np.maximum(flat, 0), axis=1) + np.minimum(flat.max(axis=1), 0) - fillet
        past = np.abs(t[:, m] - 0.5 * length[m]) - 0.5 * length[m]
        both = np.stack([round_square, past], axis=1)
        out[:, m] = np.linalg.norm(np.maximum(both, 0), axis=1) + np.minimum(both.max(axis=1), 0)
    return out


def swept_distances(points: np.ndarray, segments: np.ndarray, radii: np.ndarray, stations: int = 4001) -> np.ndarray:
    """(p, m) signed distances to sphere-swept cones, as the least distance to the balls at many stations."""
    t, radial, length = along(points, segments)
    best = np.full(t.shape, np.inf)
    for s in np.linspace(0, 1, stations):
        best = np.minimum(best, np.hypot(radial, t - s * length) - ((1 - s) * radii[:, 0] + s * radii[:, 1]))
    return best


def round_union(values: np.ndarray, k: np.ndarray) -> np.ndarray:
    """max(k, min v) - |max(k - v, 0)|."""
    k = k[:, None]
    return np.maximum(k[:, 0], values.min(axis=1)) - np.sqrt((np.maximum(k - values, 0) ** 2).sum(axis=1))


# --- skeletons -----------------------------------------------------------------------------------------------------------


def random_graph(kind: str) -> GraphSkeleton:
    rng = np.random.default_rng(3)
    if kind == "single":
        nodes, edges = np.array([[1.0, 2, 3], [4, 0, -1]]), np.array([[0, 1]])
    elif kind == "flat":
        nodes = np.concatenate([rng.uniform(0, 20, (60, 2)), np.full((60, 1), 3.0)], axis=1)
        edges = rng.integers(0, 60, (150, 2))
    elif kind == "clustered":
        centres = rng.uniform(0, 100, (6, 3))
        nodes = centres[rng.integers(0, 6, 300)] + rng.normal(0, 1.0, (300, 3))
        edges = rng.integers(0, 300, (200, 2))
    else:  # tiny beams beside ones that cross everything
        start = rng.uniform(0, 30, (250, 3))
        nodes = np.concatenate([start, start + rng.normal(0, 0.05, (250, 3)), rng.uniform(-5, 35, (40, 3))])
        edges = np.concatenate([np.stack([np.arange(250), np.arange(250) + 250], 1), rng.integers(500, 540, (60, 2))])
    edges = edges[edges[:, 0] != edges[:, 1]]
    skeleton = beams.graph(nodes, edges).skeleton
    assert isinstance(skeleton, GraphSkeleton)
    return skeleton


def slanted() -> PeriodicSkeleton:
    """Beams that leave their cell, in an uneven period."""
    nodes = [(0, 0, 0), (3, 7, 1), (-2, 1, 9), (1.5, 1.5, 1.5), (1.6, 1.5, 1.5)]
    skeleton = beams.cell(nodes, [(0, 1), (0, 2), (3, 4), (1, 2)], size=(4, 6, 3), check=False).skeleton
    assert isinstance(skeleton, PeriodicSkeleton)
    return skeleton


SKELETONS: dict[str, Skeleton] = {
    "simple cubic": beams.simple_cubic(5).skeleton,
    "bcc": beams.bcc((4, 5, 7)).skeleton,
    "slanted": slanted(),
    "one beam": random_graph("single"),
    "flat graph": random_graph("flat"),
    "clustered": random_graph("clustered"),
    "long and tiny": random_graph("long"),
}
BALLS = 100_000 // len(SKELETONS) + 1


@pytest.mark.parametrize("kind", SKELETONS)
def test_ball_query_finds_every_beam_once(kind):
    """No false negative, no false positive and no duplicate in 100,000 random balls altogether."""
    skeleton = SKELETONS[kind]
    if isinstance(skeleton, PeriodicSkeleton):
        lo, hi, largest = -1.5 * skeleton.size, 1.5 * skeleton.size, 0.9 * skeleton.size.min()
    else:
        span = np.ptp(skeleton.bounds, axis=0).max()
        lo, hi, largest = skeleton.bounds[0] - 0.3 * span, skeleton.bounds[1] + 0.3 * span, 0.25 * span
    centers = RNG.uniform(lo, hi, (BALLS, 3))
    radii = largest * RNG.uniform(0, 1, BALLS) ** 3
    segments, labels = unrolled(skeleton, lo - largest, hi + largest)
    # The labels as one number, to compare lists fast.
    weight = np.array([1, 1_000, 1_000_000, 1_000_000_000])
    middle = np.array([0, 500, 500, 500])
    code = (labels + middle) @ weight
    missed = extra = twice = 0
    for part in np.array_split(np.arange(BALLS), 80):
        distance = axis_distances(centers[part], segments)
        for row, ball in zip(distance, part, strict=True):
            found = (skeleton.beams_meeting(centers[ball], radii[ball]) + middle) @ weight
            surely, maybe = code[row < radii[ball] - 1e-9], code[row < radii[ball] + 1e-9]
            missed += len(np.setdiff1d(surely, found))
            extra += len(np.setdiff1d(found, maybe))
            twice += len(found) - len(np.unique(found))
    assert (missed, extra, twice) == (0, 0, 0)


def test_ball_query_grows_its_list():
    """More beams than the first list holds."""
    skeleton = beams.simple_cubic(1.0).skeleton
    found = skeleton.beams_meeting((0.5, 0.5, 0.5), 9.0)
    segments, _ = unrolled(skeleton, (-10, -10, -10), (11, 11, 11))
    assert len(found) == np.count_nonzero(axis_distances(np.full((1, 3), 0.5), segments) <= 9.0) > 1024
    assert len(np.unique(found, axis=0)) == len(found)


@pytest.mark.parametrize(
    ("center", "radius"), [((0, 0), 1), ((0, 0, math.nan), 1), ((0, 0, 0), -1), ((0, 0, 0), math.inf)]
)
def test_ball_query_refuses_nonsense(center, radius):
    with pytest.raises(ArgumentError, match=r"center|radius"):
        SKELETONS["bcc"].beams_meeting(center, radius)


# --- distances -------------------------------------------------------------------------------------------------------------


def near(skeleton: Skeleton, n: int = 1500) -> np.ndarray:
    """Points round a skeleton, in an order without locality."""
    if isinstance(skeleton, PeriodicSkeleton):
        return RNG.uniform(-skeleton.size, 2 * skeleton.size, (n, 3))
    span = np.ptp(skeleton.bounds, axis=0).max()
    return RNG.uniform(skeleton.bounds[0] - 0.2 * span, skeleton.bounds[1] + 0.2 * span, (n, 3))


def around(skeleton: Skeleton, points: np.ndarray) -> np.ndarray:
    """All segments that can matter at the points."""
    return unrolled(skeleton, points.min(axis=0), points.max(axis=0))[0]


def node_distances(skeleton: Skeleton, points: np.ndarray) -> np.ndarray:
    nodes = around(skeleton, points).reshape(-1, 3)
    if isinstance(skeleton, GraphSkeleton):
        nodes = skeleton.nodes
    return cKDTree(nodes).query(points)[0]


WIDTH = 0.8 + 0.1 * frep.sin(X) + 0.01 * Y
"""A radius that varies, between 0.5 and 1.5 in the boxes here."""


@pytest.mark.parametrize("radius", [0.7, WIDTH], ids=["number", "Field"])
@pytest.mark.parametrize("kind", SKELETONS)
def test_round_beams(kind, radius):
    skeleton = SKELETONS[kind]
    points = near(skeleton)
    field = beam_field(skeleton, width=frep.as_field(radius))
    expected = axis_distances(points, around(skeleton, points)).min(axis=1) - frep.as_field(radius)(points)
    np.testing.assert_allclose(field(points), expected, atol=1e-9)


@pytest.mark.parametrize("kind", SKELETONS)
def test_round_beams_with_node_balls(kind):
    skeleton = SKELETONS[kind]
    points = near(skeleton)
    field = beam_field(skeleton, width=frep.as_field(0.6), node_radius=1.2 + 0.1 * WIDTH)
    beams_at = axis_distances(points, around(skeleton, points)).min(axis=1) - 0.6
    balls_at = node_distances(skeleton, points) - (1.2 + 0.1 * WIDTH)(points)
    np.testing.assert_allclose(field(points), np.minimum(beams_at, balls_at), atol=1e-9)


@pytest.mark.parametrize("blend", [0.5, 0.3 + 0.1 * frep.cos(Y)], ids=["number", "Field"])
@pytest.mark.parametrize("kind", SKELETONS)
def test_blended_round_beams(kind, blend):
    skeleton = SKELETONS[kind]
    points = near(skeleton, 800)
    k = frep.as_field(blend)
    field = beam_field(skeleton, width=WIDTH, blend=k)
    values = axis_distances(points, around(skeleton, points)) - WIDTH(points)[:, None]
    np.testing.assert_allclose(field(points), round_union(values, k(points)), atol=1e-8)


@pytest.mark.parametrize("fillet", [0.0, 0.3, 0.1 + 0.05 * frep.sin(Z)], ids=["sharp", "number", "Field"])
@pytest.mark.parametrize("kind", ["simple cubic", "bcc", "slanted", "one beam", "flat graph"])
def test_square_beams(kind, fillet):
    skeleton = SKELETONS[kind]
    points = near(skeleton, 500)
    rounding = frep.as_field(fillet)
    field = beam_field(skeleton, section="square", width=2 * WIDTH, fillet=rounding)
    values = prism_distances(points, around(skeleton, points), 2 * WIDTH(points), rounding(points))
    np.testing.assert_allclose(field(points), values.min(axis=1), atol=1e-9)


@pytest.mark.parametrize("blended", [False, True])
@pytest.mark.parametrize("kind", ["one beam", "flat graph", "long and tiny"])
def test_cones(kind, blended):
    """Tapered beams are unions of balls: no closed form is shared with the kernel."""
    skeleton = SKELETONS[kind]
    rng = np.random.default_rng(1)
    radii = rng.uniform(0.1, 1.5, len(skeleton.nodes))
    points = near(skeleton, 60)
    k = 0.4
    field = beam_field(skeleton, section="cone", node_radii=radii, blend=frep.constant(k) if blended else None)
    values = swept_distances(points, skeleton.segments(), radii[skeleton.edges])
    expected = round_union(values, np.full(len(points), k)) if blended else values.min(axis=1)
    # The stations are a few hundredths apart: the ball between two is missed by their sagitta.
    reach = skeleton.segments()
    step = np.linalg.norm(reach[:, 1] - reach[:, 0], axis=1).max() / 4000
    np.testing.assert_allclose(field(points), expected, atol=step**2 / 0.05 + 1e-4)


def test_periodic_cones_repeat():
    skeleton = SKELETONS["bcc"]
    radii = np.array([0.3] * 8 + [0.9])
    field = beam_field(skeleton, section="cone", node_radii=radii)
    points = near(skeleton, 300)
    np.testing.assert_allclose(field(points), field(points + 3 * np.array([4.0, 5, 7])), atol=1e-9)
    segments = around(skeleton, points)
    ends = np.broadcast_to(radii[skeleton.edges], (len(segments) // len(skeleton.edges), len(skeleton.edges), 2))
    values = swept_distances(points[:20], segments, ends.reshape(-1, 2), 801)
    np.testing.assert_allclose(field(points[:20]), values.min(axis=1), atol=5e-4)


def test_distance_is_exact_however_far():
    """A graph far away, and points far from it."""
    skeleton = random_graph("single")
    field = beam_field(skeleton, width=frep.as_field(0.5))
    points = np.array([[1e4, 0, 0], [0, -1e5, 3], [1e6, 1e6, 1e6]])
    expected = axis_distances(points, skeleton.segments())[:, 0] - 0.5
    np.testing.assert_allclose(field(points), expected, rtol=1e-12)


@pytest.mark.parametrize("blend", [None, 0.2])
@pytest.mark.parametrize("height", [1.0, 10.0, 300.0, 1e5])
def test_distance_far_from_many_beams(height, blend):
    """From afar, thousands of beams are about equally near."""
    number = np.arange(50 * 50).reshape(50, 50)
    nodes = np.stack(np.meshgrid(np.arange(50.0), np.arange(50.0), [0.0], indexing="ij"), -1).reshape(-1, 3)
    edges = np.concatenate(
        [
            np.stack([number[:-1], number[1:]], -1).reshape(-1, 2),
            np.stack([number[:, :-1], number[:, 1:]], -1).reshape(-1, 2),
        ]
    )
    skeleton = beams.graph(nodes, edges).skeleton
    points = np.array([[24.3, 25.2, height], [-height, 3.5, 0.0], [10.5, -height, height]])
    expected = axis_distances(points, skeleton.segments()).min(axis=1) - 0.3
    k = None if blend is None else frep.constant(blend)
    np.testing.assert_allclose(beam_field(skeleton, width=frep.constant(0.3), blend=k)(points), expected, rtol=1e-9)


# --- bounds ----------------------------------------------------------------------------------------------------------------


def designs() -> dict[str, Field]:
    cell, graph = SKELETONS["bcc"], SKELETONS["flat graph"]
    radii = np.linspace(0.2, 1.4, len(graph.nodes))
    k = 0.4 + 0.2 * frep.sin(X)
    side, fillet = 2 * WIDTH, 0.2 + 0.1 * frep.sin(Z)
    return {
        "round": beam_field(cell, width=WIDTH),
        "round, balls": beam_field(cell, width=WIDTH, node_radius=1.3 * WIDTH),
        "round, blend": beam_field(cell, width=WIDTH, blend=k),
        "round, balls, blend": beam_field(graph, width=WIDTH, node_radius=1.3 * WIDTH, blend=k),
        "square": beam_field(cell, section="square", width=side),
        "rounded square": beam_field(graph, section="square", width=side, fillet=fillet),
        "rounded square, balls, blend": beam_field(
            cell, section="square", width=side, fillet=fillet, node_radius=WIDTH, blend=k
        ),
        "cone": beam_field(graph, section="cone", node_radii=radii),
        "cone, balls, blend": beam_field(graph, section="cone", node_radii=radii, node_radius=WIDTH, blend=k),
        "warped": beam_field(cell, width=WIDTH, blend=k).substitute(X + frep.sin(Y), Y * 0.5, Z - 0.1 * X),
    }


@pytest.mark.parametrize("kind", designs())
def test_interval_bounds_enclose(kind):
    field = designs()[kind]
    n, inside = 400, 60
    lo = RNG.uniform(-8, 20, (n, 3))
    hi = lo + 6.0 * RNG.uniform(0, 1, (n, 1)) ** 3 * RNG.uniform(0.05, 1, (n, 3))
    least, most = field.bounds(lo, hi)
    t = RNG.uniform(0, 1, (n, inside, 3))
    t[:, :8] = [[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    points = lo[:, None] + t * (hi - lo)[:, None]
    values = field(points.reshape(-1, 3)).reshape(n, inside)
    assert np.all(least <= values.min(axis=1) + 1e-9)
    assert np.all(most >= values.max(axis=1) - 1e-9)
    # They are of use: for small boxes they are not much wider than the box.
    small = np.linalg.norm(hi - lo, axis=1) < 0.1
    assert np.median((most - least)[small]) < 0.5


# --- cutoffs ---------------------------------------------------------------------------------------------------------------


def cut_designs() -> dict[str, frep.Solid]:
    box = frep.box((0, 0, 0), (20, 15, 14))
    sparse = random_graph("long")
    tiny = beams.graph(sparse.nodes, sparse.edges[:250])
    law = 1 + 0.05 * X
    return {
        "bcc": beams.bcc(5).thicken(law, node=1.2 * law) & box,
        "blended": beams.bcc(5).thicken(law, blend=0.5) & box,
        "square": beams.simple_cubic(5).thicken(law, section=beams.square(fillet=0.2)) & box,
        "skin": (box & ~beams.simple_cubic(5).thicken(1.5)) | box.shell(0.8),
        "offset": (beams.bcc(5).thicken(0.8) & box).offset(0.5),
        "tiny beams": tiny.thicken(0.8),
        "shrunk": tiny.thicken(0.8).scale(0.1),
        "grown": tiny.thicken(0.8).scale(7.0),
        "two": frep.union(tiny.thicken(0.8), beams.bcc(6).thicken(1.0) & box, blend=0.7),
        "sheared": frep.Solid(
            beams.bcc(5).thicken(1.0).field.substitute(3 * X + Z, Y, 2 * Z + Y), bounds=((0, 0, 0), (4, 6, 5))
        ),
    }


@pytest.mark.parametrize("kind", cut_designs())
def test_cutoffs_change_nothing_near_the_surface(kind):
    """What sampling leaves inexact lies far from every crossing: leaves of 8^3 samples with and without the cutoffs."""
    part = cut_designs()[kind]
    voxel = 0.012 * float(np.ptp(part.bounds, axis=0).max())
    lo, hi = part.bounds[0] - voxel, part.bounds[1] + voxel
    limits = cutoffs(part.field, lo, hi, 4 * voxel)
    blocks = np.argwhere(np.ones(np.ceil((hi - lo) / (8 * voxel)).astype(int), bool)).astype(np.int32)
    axes = tuple(lo[a] + voxel * np.arange(8 * (blocks[:, a].max() + 1)) for a in range(3))
    exact, cut = np.empty((2, 1, len(blocks), 512), np.float32)
    Program((part.field,)).on_blocks(blocks, axes, exact)
    Program((part.field,), limits).on_blocks(blocks, axes, cut)
    slope = max(1.0, float(np.abs(np.diff(exact.reshape(-1, 8, 8, 8), axis=3)).max()) / voxel)
    band = np.abs(exact) < 2 * voxel
    assert np.count_nonzero(band) > 1000
    np.testing.assert_allclose(cut[band], exact[band], atol=1e-4 * voxel * slope)
    np.testing.assert_array_equal(cut < 0, exact < 0)
    # And where a beam is cut off, the value that stands for it is beyond the band.
    assert np.all(np.abs(cut[~band]) >= 2 * voxel * (1 - 1e-4))
