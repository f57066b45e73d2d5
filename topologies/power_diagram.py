"""Voronoi, Delaunay and power diagrams of seeds in a box or repeating ones: their vertices, edges and neighbours.

A power diagram (Laguerre diagram, radical Voronoi diagram) gives each seed a ball: a point belongs to the seed with the
least power `|x - p|^2 - r^2`. Only differences of the powers count, so each seed is held as a height h, `h^2 = max(r)^2
- r^2`: the power is then the squared distance of (x, 0) from (p, h) in four dimensions, which a KD-tree answers, but
for a constant. The diagram is the lower convex hull of the points (p, |p|^2 + h^2) (Aurenhammer, SIAM J. Comput. 16,
1987).

Heights that are tiny also settle which diagonals the Delaunay tetrahedra of a grid have.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, EmptyError, Field
from frep.arguments import refuse_nan
from frep.errors import warn

from . import seeds as seeding

if TYPE_CHECKING:
    from scipy.spatial import KDTree


class VanishedCellsWarning(UserWarning):
    """Seeds have no cell: everywhere their power is above that of others."""


_SAME = 1e-7
"""Vertices closer than this, of a cell, are one: seeds on a sphere (those of a regular lattice) give several."""

_UPRIGHT = 1e-9
"""A facet of the lifted hull that leans less is upright: it has no tetrahedron below it."""

_FLAT = 1e-7
"""A tetrahedron of less than this, of its longest edge's cube (times 6), is flat."""

_JOGGLE = 1e7 * np.finfo(float).eps
"""What settles ties of the Delaunay tetrahedra, of the greatest squared coordinate: well above rounding, no more."""

_LEAN = np.array([[0.19, 0.53, 0.71], [0.53, -0.31, 0.37], [0.71, 0.37, 0.83]])
"""A metric like no lattice's own."""

Edges = tuple[np.ndarray, np.ndarray]
"""(n, 3) vertices, mm, and (m, 2) which of them each edge joins."""


@dataclass(frozen=True, eq=False)
class _Hull:
    """The regular tetrahedra of lifted points, with the vertex of the power diagram that each is dual to."""

    corners: np.ndarray
    centres: np.ndarray
    sides: np.ndarray
    """Pairs of tetrahedra that share a triangle."""


def require_still_seeds(weights: Any, seeds: Any, relax: Any) -> None:
    """Complain of weights where the seeds are still to be placed, or move."""
    if weights is None:
        return
    if seeds is None:
        raise ArgumentError(
            "weights: expected seeds= with them, one radius for each seed; these seeds are still to be placed"
        )
    if relax:
        raise ArgumentError(f"weights: expected relax=0 with them, got relax={relax}: Lloyd's steps know no weights")


def checked_weights(weights: Any, number: int) -> np.ndarray | None:
    """The heights of `number` seeds with radii `weights`; None where there are none.

    Raises:
        ArgumentTypeError, ArgumentError: not one radius >= 0 mm for each seed.
    """
    if weights is None:
        return None
    try:
        radii = np.array(None if isinstance(weights, Field) else weights, dtype=float)
    except (TypeError, ValueError):
        radii = np.array(np.nan)
    if radii.ndim == 0:
        raise ArgumentTypeError(f"weights: expected {number} radii in mm, one for each seed, got {weights!r}")
    if radii.shape != (number,):
        raise ArgumentError(f"weights: expected {number} radii in mm, one for each seed, got shape {radii.shape}")
    refuse_nan(radii, "weights", "seed")
    bad = np.flatnonzero(radii < 0.0)
    if len(bad):
        raise ArgumentError(f"weights: expected radii >= 0 mm, got {radii[bad[0]]:g} of seed {bad[0]}")
    return np.sqrt((radii.max() - radii) * (radii.max() + radii))


# --- edges ------------------------------------------------------------------------------------------------------------


def voronoi_edges(points: np.ndarray, bounds: np.ndarray, heights: np.ndarray | None) -> Edges:
    """Vertices and edges of the diagram; right and complete in the box, and somewhat beyond."""
    side = float((np.prod(bounds[1] - bounds[0]) / len(points)) ** (1 / 3))
    all_points, all_heights = _guarded(points, heights, bounds, 3.0)
    vertices, edges = _cell_edges(all_points, all_heights, len(points), side)
    group = _groups(vertices, _SAME * side, None)
    edges = np.unique(np.sort(group[edges], axis=1), axis=0)
    _, first = np.unique(group, return_index=True)
    return vertices[first], edges[edges[:, 0] != edges[:, 1]]


def delaunay_edges(points: np.ndarray, owner: np.ndarray, side: float) -> np.ndarray:
    """Which points the Delaunay tetrahedra join; `owner` is the seed that each is an image of.

    Seeds on one sphere, such as the corners of a cube, may be cut up in several ways, and Qhull's for one cell need not
    fit that for the next: diagonals of their face cross. So all are lifted by a little more, by another metric and
    another bit for each seed. Positions stay, and as each repeats with the seeds but for what is linear, so do the
    tetrahedra.
    """
    local = (points - points.mean(axis=0)) / side
    little = _JOGGLE * float((local**2).sum(axis=1).max())
    own = np.random.default_rng(0).uniform(0.0, 0.05, owner.max() + 1)[owner]
    hull = _lower_hull(local, little * (np.einsum("ni,ij,nj->n", local, _LEAN, local) + own))
    t = hull.corners[np.abs(_volumes(local, hull.corners)) > _FLAT]
    pairs = np.concatenate([t[:, [i, j]] for i in range(4) for j in range(i)])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def periodic_edges(points: np.ndarray, size: np.ndarray, kind: str, heights: np.ndarray | None = None) -> Edges:
    """One period of the edges, "voronoi" or "delaunay", of seeds that repeat; some end in the next period."""
    images, owner = _images(points, size, _margin(points, heights, size))
    side = float((np.prod(size) / len(points)) ** (1 / 3))
    lo, slack = points.min(axis=0), 1e-6 * size
    if kind == "voronoi":
        vertices, edges = _cell_edges(images, None if heights is None else heights[owner], len(points), side)
        # A seed that is missing is more than a ball off the box, and could cut no edge short of its middle.
        place = 0.5 * (vertices[edges[:, 0]] + vertices[edges[:, 1]])
        chosen = np.all((place >= lo - slack) & (place <= lo + size + slack), axis=1)
    else:
        vertices, edges = images, delaunay_edges(images, owner, side)
        chosen = np.all((vertices >= lo - slack) & (vertices <= lo + size + slack), axis=1)[edges].any(axis=1)
    return _one_period(vertices, edges[chosen], size, len(points))


def _cell_edges(points: np.ndarray, heights: np.ndarray | None, seeds: int, side: float) -> Edges:
    """The finite edges between the cells of points, of which the first `seeds` are seeds; vertices may coincide."""
    if heights is None:
        from scipy.spatial import Voronoi

        diagram = Voronoi(points)
        return diagram.vertices, _ridge_edges(diagram.ridge_vertices)
    centre = points.mean(axis=0)
    hull = _lower_hull((points - centre) / side, (heights / side) ** 2)
    _tell_of_vanished(np.setdiff1d(np.arange(seeds), hull.corners.ravel()), seeds)
    return hull.centres * side + centre, hull.sides


def _tell_of_vanished(left: np.ndarray, seeds: int) -> None:
    if len(left):
        warn(
            f"weights: {len(left)} of {seeds} seeds have no cell, as seed {left[0]}: their balls lie too deep in "
            "others, or their cells far outside the body",
            VanishedCellsWarning,
        )


def _lower_hull(points: np.ndarray, raised: np.ndarray) -> _Hull:
    """The lower hull of (p, |p|^2 + raised), lengths in cells."""
    from scipy.spatial import ConvexHull

    lifted = np.column_stack([points, (points**2).sum(axis=1) + raised])
    # A lid over their middle makes one of four points, too, a body; it is in no facet below.
    hull = ConvexHull(np.vstack([lifted, [*points.mean(axis=0), lifted[:, 3].max() + 1.0]]))
    below = hull.equations[:, 3] < -_UPRIGHT
    number = np.cumsum(below) - 1
    here = np.repeat(np.arange(len(below)), 4)
    there = hull.neighbors.ravel()
    kept = (here < there) & below[here] & below[there]
    corners, planes = hull.simplices[below], hull.equations[below]
    # A plane of slopes 2 c touches the paraboloid over c.
    centres = -0.5 * planes[:, :3] / planes[:, 3:4]
    # That is rounded in proportion to the height of the whole; where a tetrahedron is not flat, its corners tell
    # better.
    fat = np.abs(_volumes(points, corners)) > 1e-5
    first, rest = corners[fat, 0], corners[fat, 1:]
    across = points[rest] - points[first][:, None]
    levels = (across**2).sum(axis=2) + raised[rest] - raised[first][:, None]
    centres[fat] = points[first] + np.linalg.solve(2.0 * across, levels[..., None])[..., 0]
    return _Hull(corners, centres, np.column_stack([number[here[kept]], number[there[kept]]]))


def _volumes(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Six times the volume of tetrahedra, of the cube of the longest edge at their first corner."""
    across = points[corners[:, 1:]] - points[corners[:, :1]]
    return np.linalg.det(across) / np.maximum(np.linalg.norm(across, axis=2).max(axis=1), 1e-300) ** 3


def _ridge_edges(ridges: list[list[int]]) -> np.ndarray:
    """Each edge once: consecutive vertices of the ridges (Qhull lists them in order round a face, -1 at infinity)."""
    sizes = np.fromiter(map(len, ridges), np.int64, len(ridges))
    flat = np.fromiter((v for r in ridges for v in r), np.int64, int(sizes.sum()))
    ends = np.cumsum(sizes)
    following = np.roll(flat, -1)
    following[ends - 1] = flat[ends - sizes]
    pairs = np.stack([flat, following], axis=1)
    return np.unique(np.sort(pairs[(pairs >= 0).all(axis=1)], axis=1), axis=0)


def _groups(points: np.ndarray, near: float, wrap: np.ndarray | None) -> np.ndarray:
    """A group number for each point, one for those that hang together by steps of at most `near`; groups count up in
    the order of their first points."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = seeding.tree_of(points, np.zeros(3), wrap).query_pairs(near, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    return connected_components(links, directed=False)[1]


# --- what is round the seeds ------------------------------------------------------------------------------------------


def _guarded(points: np.ndarray, heights: np.ndarray | None, bounds: np.ndarray, diagonals: float) -> Any:
    """Seeds and six points so far off that none is the nearest anywhere in the box; they make the cells in it finite.

    A point of the box is within its diagonal d of any seed in it, and 2.5 d or more from these. They are as high as
    any.
    """
    centre, d = bounds.mean(axis=0), float(np.linalg.norm(bounds[1] - bounds[0]))
    far = centre + diagonals * d * np.concatenate([np.eye(3), -np.eye(3)])
    high = None if heights is None else np.concatenate([heights, np.full(6, heights.max())])
    return np.concatenate([points, far]), high


def _images(points: np.ndarray, size: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Seeds, then their images in the box grown by `margin`; and whose images they are."""
    lo = points.min(axis=0)
    reach = np.ceil(margin / size).astype(int) + 1
    shifts = np.stack(np.meshgrid(*(np.arange(-r, r + 1) for r in reach), indexing="ij"), axis=-1).reshape(-1, 3)
    shifts = shifts[shifts.any(axis=1)]
    everywhere = (points + (shifts * size)[:, None]).reshape(-1, 3)
    near = np.all((everywhere >= lo - margin) & (everywhere <= lo + size + margin), axis=1)
    seeds = np.arange(len(points))
    return np.concatenate([points, everywhere[near]]), np.concatenate([seeds, np.tile(seeds, len(shifts))[near]])


def _margin(points: np.ndarray, heights: np.ndarray | None, size: np.ndarray) -> float:
    """How far round a period images of the seeds have a say in it: the greatest diameter of a ball without seeds.

    Nowhere a seed (the lowest of them, where they have heights) is further off than half the diagonal of the period,
    since each has images. With heights balls are of four dimensions, about points of height 0.
    """
    cell = float((np.prod(size) / len(points)) ** (1 / 3))
    bound = float(np.linalg.norm(size))
    if bound <= 4.0 * cell:
        return 1.01 * bound
    # On a grid of h, the furthest point from the seeds is at most h sqrt(3) / 2 further than the furthest node.
    counts = np.ceil(2.0 * size / cell).astype(int)
    nodes = np.stack(np.meshgrid(*(np.arange(n) * s / n for n, s in zip(counts, size, strict=True)), indexing="ij"), -1)
    far = Nearest(points, heights, np.zeros(3), size)(nodes.reshape(-1, 3))[0].max()
    return min(2.02 * (float(far) + 0.5 * float(np.linalg.norm(size / counts))), 1.01 * bound)


def _one_period(vertices: np.ndarray, edges: np.ndarray, size: np.ndarray, seeds: int) -> Edges:
    """Edges of a periodic graph, each once for a period, from a piece of the graph that holds each at least once."""
    used, edges = np.unique(edges, return_inverse=True)
    edges, points = edges.reshape(-1, 2), vertices[used]
    near = _SAME * float((np.prod(size) / seeds) ** (1 / 3))
    group = _groups(points, near, size)
    count, first = np.unique(group, return_index=True)
    nodes = np.mod(points[first], size)
    # Which period each vertex is in, counted from the place of its group in the first one.
    period = np.round((points - nodes[group]) / size).astype(np.int64)
    a, b = edges.T
    step = period[b] - period[a]
    turn = (group[a] > group[b]) | ((group[a] == group[b]) & _negative(step))
    a, b, step = np.where(turn, b, a), np.where(turn, a, b), np.where(turn[:, None], -step, step)
    rows = np.unique(np.column_stack([group[a], group[b], step]), axis=0)
    rows = rows[(rows[:, 0] != rows[:, 1]) | rows[:, 2:].any(axis=1)]
    ends, where = np.unique(rows[:, 1:], axis=0, return_inverse=True)
    beyond = nodes[ends[:, 0]] + ends[:, 1:] * size
    moved = ends[:, 1:].any(axis=1)
    number = np.where(moved, len(count) + np.cumsum(moved) - 1, ends[:, 0])
    return np.concatenate([nodes, beyond[moved]]), np.column_stack([rows[:, 0], number[where.reshape(-1)]])


def _negative(steps: np.ndarray) -> np.ndarray:
    """Whether the first number that is not zero is negative, of each row."""
    x, y, z = steps.T
    return (x < 0) | ((x == 0) & ((y < 0) | ((y == 0) & (z < 0))))


# --- cells ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Nearest:
    """The seed whose cell a point is in, and its distance (with heights, in four dimensions)."""

    points: np.ndarray
    heights: np.ndarray | None
    lo: np.ndarray
    wrap: np.ndarray | None

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = seeding.folded(points, self.lo, self.wrap)
        if self.heights is not None:
            at = np.column_stack([at, np.zeros(len(at))])
        distance, index = self._tree.query(at)
        return np.asarray(distance), np.asarray(index)

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree

        if self.heights is None:
            return seeding.tree_of(self.points, self.lo, self.wrap)
        lifted = np.column_stack([seeding.folded(self.points, self.lo, self.wrap), self.heights])
        # Heights do not repeat: with such a period no image is nearer.
        return KDTree(lifted, boxsize=None if self.wrap is None else [*self.wrap, 3.0 * self.heights.max() + 1.0])


@dataclass(frozen=True, eq=False)
class Cells:
    """The distance to the faces of the cells, as a function of position."""

    seeds: np.ndarray
    bounds: np.ndarray
    wrap: np.ndarray | None
    heights: np.ndarray | None = None

    def __call__(self, x, y, z) -> np.ndarray:
        points = np.stack([x, y, z], axis=1)
        across, offsets, starts = self.planes
        cell = self._nearest(points)[1]
        away = points - self.seeds[cell]
        if self.wrap is not None:
            away -= self.wrap * np.round(away / self.wrap)
        order = np.argsort(cell, kind="stable")
        cells, first = np.unique(cell[order], return_index=True)
        out = np.empty(len(points))
        for one, rows in zip(cells, np.split(order, first[1:]), strict=True):
            of = slice(starts[one], starts[one + 1])
            out[rows] = (offsets[of] - away[rows] @ across[of].T).min(axis=1)
        return np.maximum(out, 0.0)

    def prepare(self) -> None:
        """Find the faces now, and tell of cells that vanish: not when the field is first asked."""
        starts = np.array(self.planes[2])
        _tell_of_vanished(np.flatnonzero(np.diff(starts) == 0), len(self.seeds))

    @cached_property
    def _nearest(self) -> Nearest:
        return Nearest(self.seeds, self.heights, self.bounds[0], self.wrap)

    @cached_property
    def planes(self) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """The planes between each seed and its neighbours: normals, distances from the seed, where those of each start.

        Raises:
            EmptyError: one seed alone has a cell.
        """
        n = len(self.seeds)
        if self.wrap is None:
            # So far off that a face between seeds which they hide is hundreds of diagonals away (with heights, dozens:
            # the hull is rounded in proportion to the greatest height).
            far = 1000.0 if self.heights is None else 100.0
            points, heights = _guarded(self.seeds, self.heights, self.bounds, far)
            owner = np.arange(len(points))
        else:
            points, owner = _images(self.seeds, self.wrap, _margin(self.seeds, self.heights, self.wrap))
            heights = None if self.heights is None else self.heights[owner]
        pairs = self._neighbours(points, heights)
        pairs = np.concatenate([pairs, pairs[:, ::-1]])
        pairs = pairs[pairs[:, 0] < n]
        if self.wrap is None:
            pairs = pairs[pairs[:, 1] < n]
        if not len(pairs):
            raise EmptyError(
                "weights: one ball holds all the others so deep that it alone has a cell; there is no face"
            )
        pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
        starts = np.searchsorted(pairs[:, 0], np.arange(n + 1)).tolist()
        across = points[pairs[:, 1]] - points[pairs[:, 0]]
        length = np.linalg.norm(across, axis=1)
        offsets = 0.5 * length
        if heights is not None:
            offsets += 0.5 * (heights[pairs[:, 1]] ** 2 - heights[pairs[:, 0]] ** 2) / length
        return across / length[:, None], offsets, starts

    def _neighbours(self, points: np.ndarray, heights: np.ndarray | None) -> np.ndarray:
        if heights is None:
            from scipy.spatial import Voronoi

            return Voronoi(points).ridge_points
        side = float((np.prod(self.bounds[1] - self.bounds[0]) / len(self.seeds)) ** (1 / 3))
        hull = _lower_hull((points - points.mean(axis=0)) / side, (heights / side) ** 2)
        # Neighbours that meet in a corner alone do no harm: their plane is no nearer than the faces there.
        t = hull.corners
        return np.unique(np.sort(np.concatenate([t[:, [i, j]] for i in range(4) for j in range(i)]), axis=1), axis=0)
