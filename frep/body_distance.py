"""From oriented triangles to a signed distance on a refined grid, whatever is wrong with the triangles.

Inside is where the winding number of the triangles exceeds one half (Jacobson et al. 2013, evaluated by the tree code of Barill
et al. 2018). That defines a closed surface for any input: an open mesh is closed by the sheet on which the number is one half,
which in a flat hole is the flat lid; of overlapping pieces it is the union. The distance must be to *that* surface, so

- triangles with the same side in front and behind (buried in an overlap, or part of an open sheet) are taken out, cut to the size
  of a cell where they are so only in part;
- the sheets that close the holes are added as triangles, found where neighbouring nodes differ in sign although no triangle is
  near enough to pass between them.

Inside this module lengths are in fine cells: node (i, j, k) lies at (i, j, k), and coarse cells have an edge of 8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .body_kernels import owners, regions
from .errors import ArgumentError

FINE = 8
NODES = (FINE + 1) ** 3
HALF_DIAGONAL = 0.5 * math.sqrt(3.0) * FINE
BAND = 2.0
"""A coarse cell is refined where the surface comes nearer to it than this many fine cells."""

_EXACT = 2.0 + math.sqrt(3.0)
"""Fine nodes farther from the surface than this are interpolated from every other node."""

_PROBE = 0.02
"""How far in front of and behind a triangle its sides are looked at."""

_NOISE = 0.02
"""More than the error of the tree code, which is 0.002 on scans and 0.01 at worst."""

_BATCH = 200_000

_IJK = np.indices((FINE + 1,) * 3).reshape(3, -1)
_EVEN = np.all(_IJK % 2 == 0, axis=0)
# For each node of a block the even ones round it, and how far they are.
_EVEN_BELOW = np.ravel_multi_index(tuple(_IJK - _IJK % 2), (FINE + 1,) * 3)
_EVEN_ABOVE = np.ravel_multi_index(tuple(_IJK + _IJK % 2), (FINE + 1,) * 3)
_EVEN_AWAY = np.sqrt((_IJK % 2).sum(axis=0)).astype(np.float32)

Advance = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class BodySamples:
    """The signed distance of a body in fine cells: what a `SampledGrid` is made of, and what was done to get it.

    Attributes:
        nodes: (nx + 1, ny + 1, nz + 1) float32, coarse nodes.
        table: (nx, ny, nz) int32, fine block of each cell or -1.
        blocks: (m, 9, 9, 9) float32.
        lids: triangles that close holes which were open in `faces`.
        buried: share of the area that was inside an overlap or in open sheets.
    """

    nodes: np.ndarray
    table: np.ndarray
    blocks: np.ndarray
    lids: int
    buried: float


class Winding:
    """The winding number of oriented triangles at points."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, advance: Advance | None = None) -> None:
        import igl

        self._tree = igl.FastWindingNumberBVH()
        self._tree.init(vertices, faces)
        self._lo, self._hi = vertices.min(axis=0), vertices.max(axis=0)
        self._advance = advance

    def at(self, points: np.ndarray) -> np.ndarray:
        """(n,) winding numbers."""
        out = np.empty(len(points))
        for part in _batches(np.arange(len(points))):
            out[part] = self._tree.winding_number(np.ascontiguousarray(points[part]))
            if self._advance:
                self._advance(len(part))
        return out

    def within(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether points are in the box of the triangles. Open sheets one upon the other may wind round points beyond it,
        which are outside all the same."""
        return np.all((points > self._lo) & (points < self._hi), axis=1)

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether points are inside."""
        return (self.at(points) > 0.5) & self.within(points)


class _Surface:
    """Unsigned distance to triangles."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, advance: Advance) -> None:
        import igl

        self.vertices, self.faces = vertices, faces
        self._tree = igl.AABB()
        self._tree.init(vertices, faces)
        self._advance = advance

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) the nearest points of the surface."""
        return np.asarray(self._tree.squared_distance(self.vertices, self.faces, np.ascontiguousarray(points))[2])

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) unsigned distances."""
        out = np.empty(len(points))
        for part in _batches(np.arange(len(points))):
            squared, _, _ = self._tree.squared_distance(self.vertices, self.faces, np.ascontiguousarray(points[part]))
            out[part] = np.sqrt(squared)
            self._advance(len(part))
        return out


def _batches(indices: np.ndarray) -> list[np.ndarray]:
    return [indices[start : start + _BATCH] for start in range(0, len(indices), _BATCH)]


# --- the whole ---------------------------------------------------------------------------------------------------------


def sample_body(vertices: np.ndarray, faces: np.ndarray, cells: tuple[int, int, int], advance: Advance) -> BodySamples:
    """Signed distance, in fine cells, to the body that oriented triangles enclose.

    Args:
        vertices: (n, 3) float64, in fine cells, in the grid, clear of its border
            by at least one fine cell and at most one coarse cell.
        faces: (m, 3) int64, oriented outward, none of zero area.
        cells: coarse cells along each axis.
        advance: told how many points have been evaluated.

    Raises:
        ArgumentError: the triangles enclose nothing.
    """
    winding = Winding(vertices, faces, advance)
    surface = _Surface(vertices, faces, advance)
    shape = tuple(n + 1 for n in cells)
    corners = FINE * np.indices(shape).reshape(3, -1).T.astype(float)
    coarse = surface.distance(corners).reshape(shape)
    inside = winding.inside(corners).reshape(shape)

    field = _Blocks(cells)
    field.add(_near(surface, coarse) | _mixed(inside))
    field.measure(surface, slice(None))
    numbers = field.sign(winding, vertices[open_edges(faces)[0]])

    exposed, removed, share = _exposed(surface, winding, field, numbers)
    if removed is not None:
        if exposed is None:
            raise ArgumentError("mesh: its triangles enclose no volume (a flat sheet, or faces that cancel out)")
        surface = _Surface(*exposed, advance)
        coarse = surface.distance(corners).reshape(shape)
        gone = _Surface(*removed, advance).distance(field.centres)
        field.measure(surface, np.flatnonzero(gone - HALF_DIAGONAL <= field.distance.max(axis=1)))

    lids = _close(field, surface, winding)
    if lids is not None:
        lid = _Surface(*lids, advance)
        to_lid = lid.distance(corners).reshape(shape)
        coarse = np.minimum(coarse, to_lid)
        surface = _Surface(*_joined(surface.vertices, surface.faces, *lids), advance)
        near = lid.distance(field.centres) - HALF_DIAGONAL <= field.distance.max(axis=1)
        field.measure(surface, np.flatnonzero(near))
        fresh = field.add(_near(lid, to_lid))
        field.measure(surface, fresh)
        field.sign_finely(winding, fresh)
    if not (inside.any() or field.inside.any()):
        raise ArgumentError(
            "mesh: its triangles enclose no volume that the grid can see; is it a flat sheet, or thinner than the voxel?"
        )
    table, blocks = field.finished()
    nodes = np.where(inside, -coarse, coarse).astype(np.float32)
    return BodySamples(nodes, table, blocks, 0 if lids is None else len(lids[1]), share)


def _near(surface: _Surface, coarse: np.ndarray) -> np.ndarray:
    """The coarse cells that the surface comes near to, by the distance at their centres."""
    shape = tuple(n - 1 for n in coarse.shape)
    # The distance changes by at most the way: most cells are ruled out by one corner.
    low = np.asarray(coarse[:-1, :-1, :-1]) <= 2.0 * HALF_DIAGONAL + BAND
    near = np.zeros(shape, bool)
    cells = np.argwhere(low)
    near[tuple(cells.T)] = surface.distance((cells + 0.5) * FINE) <= HALF_DIAGONAL + BAND
    return near


def _mixed(inside: np.ndarray) -> np.ndarray:
    """The coarse cells whose corners do not agree."""
    count = np.zeros(tuple(n - 1 for n in inside.shape), np.int8)
    for corner in np.ndindex(2, 2, 2):
        count += inside[tuple(slice(c, c + n) for c, n in zip(corner, count.shape, strict=True))]
    return (count > 0) & (count < 8)


def open_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k, 2) edges where the oriented triangles do not cancel, tail to head, and (k,) a face of each.

    They are the boundary of the mesh as a chain, therefore closed loops whatever the triangles are.
    """
    tail = faces.reshape(-1)
    head = np.roll(faces, -1, axis=1).reshape(-1)
    n = int(faces.max()) + 1 if len(faces) else 0
    forward = tail < head
    key = np.where(forward, tail * n + head, head * n + tail)
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    if not len(starts):
        return np.empty((0, 2), np.int64), np.empty(0, np.int64)
    balance = np.add.reduceat(np.where(forward, 1, -1)[order], starts)
    unmatched = balance != 0
    left = key[order][starts][unmatched]
    ends = np.stack([left // n, left % n], axis=1)
    return np.where(balance[unmatched, None] > 0, ends, ends[:, ::-1]), order[starts][unmatched] // 3


# --- the fine blocks ---------------------------------------------------------------------------------------------------


class _Blocks:
    """The fine blocks under construction: unsigned distance and side of every node."""

    def __init__(self, shape: tuple[int, int, int]) -> None:
        self.table = np.full(shape, -1, np.int32)
        self.cells = np.empty((0, 3), np.int32)
        self.distance = np.empty((0, NODES), np.float32)
        self.inside = np.empty((0, NODES), bool)

    @property
    def centres(self) -> np.ndarray:
        return (self.cells + 0.5) * FINE

    def add(self, wanted: np.ndarray) -> np.ndarray:
        """Make blocks for the cells of a mask; returns their numbers."""
        cells = np.argwhere(wanted & (self.table < 0)).astype(np.int32)
        first, n = len(self.cells), len(cells)
        self.cells = np.concatenate([self.cells, cells])
        self.table[tuple(cells.T)] = np.arange(first, first + n)
        self.distance = np.concatenate([self.distance, np.zeros((n, NODES), np.float32)])
        self.inside = np.concatenate([self.inside, np.zeros((n, NODES), bool)])
        return np.arange(first, first + n)

    def _shared(self, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cells of some blocks, and for each of their nodes the slot (among them) that answers for it."""
        cells = self.cells[which]
        table = np.full_like(self.table, -1)
        table[tuple(cells.T)] = np.arange(len(cells))
        owner = np.empty((len(cells), NODES), np.int64)
        owners(table, cells, owner)
        return cells, owner

    def measure(self, surface: _Surface, which: np.ndarray | slice) -> None:
        """Unsigned distance at the nodes of some blocks: exact near the surface, from every other node elsewhere."""
        which = np.arange(len(self.cells))[which]
        cells, owner = self._shared(which)
        own = owner == np.arange(owner.size).reshape(owner.shape)
        d = np.zeros((len(cells), 9, 9, 9), np.float32)
        flat = d.reshape(-1)
        slots = np.flatnonzero(own & _EVEN)
        flat[slots] = surface.distance(_positions(cells, slots))
        flat[:] = flat[owner.reshape(-1)]
        d[:, 1::2, ::2, ::2] = 0.5 * (d[:, :-1:2, ::2, ::2] + d[:, 2::2, ::2, ::2])
        d[:, :, 1::2, ::2] = 0.5 * (d[:, :, :-1:2, ::2] + d[:, :, 2::2, ::2])
        d[:, :, :, 1::2] = 0.5 * (d[:, :, :, :-1:2] + d[:, :, :, 2::2])
        slots = np.flatnonzero(own & ~_EVEN & (flat.reshape(own.shape) < _EXACT))
        flat[slots] = surface.distance(_positions(cells, slots))
        self.distance[which] = flat[owner]

    def sign(self, winding: Winding, rims: np.ndarray) -> np.ndarray:
        """The side of every node, from one winding number for each group of nodes that nothing separates.

        Near the open edges `rims` (k, 2, 3) the number varies within a group; where it could reach one half every node is
        asked. Returns (m, 729) winding numbers, elsewhere constant in a group.
        """
        group = np.empty((len(self.cells), NODES), np.int64)
        regions(self.distance, group)
        flat = group.reshape(-1)
        spokesmen = np.flatnonzero(flat == np.arange(len(flat)))
        number = np.zeros(len(flat), np.float32)
        number[spokesmen] = winding.at(_positions(self.cells, spokesmen))
        numbers = number[flat].reshape(group.shape)
        self._decide(winding, np.arange(len(self.cells)), numbers)
        if len(rims):
            slope = _steepest(self.centres, rims)
            change = 2.0 * HALF_DIAGONAL * slope + _NOISE  # nothing turns round a rim in a block clear of it
            unsure = np.flatnonzero(np.abs(numbers - 0.5).min(axis=1) < change)
            numbers[unsure] = self.sign_finely(winding, unsure, slope[unsure])
        return numbers

    def sign_finely(self, winding: Winding, which: np.ndarray, slope: np.ndarray | None = None) -> np.ndarray:
        """The side of every node of some blocks from winding numbers at every other node, and at more where that leaves doubt.

        `slope` bounds how fast the number changes where no triangle is crossed; without it every node is asked. Returns the
        numbers.
        """
        cells, owner = self._shared(which)
        own = owner == np.arange(owner.size).reshape(owner.shape)
        distance = self.distance[which]
        numbers = np.full(owner.shape, np.nan, np.float32)
        if slope is not None:
            self._ask(winding, cells, own & _EVEN, numbers)
            numbers = numbers.reshape(-1)[owner]
            for start in (_EVEN_BELOW, _EVEN_ABOVE):
                near = numbers[:, start]
                apart = distance + distance[:, start] > 1.0001 * _EVEN_AWAY
                certain = np.abs(near - 0.5) > slope[:, None] * _EVEN_AWAY + _NOISE
                numbers = np.where(np.isnan(numbers) & apart & certain, near, numbers)
        self._ask(winding, cells, own & np.isnan(numbers), numbers)
        numbers = numbers.reshape(-1)[owner]
        self._decide(winding, which, numbers)
        return numbers

    def _decide(self, winding: Winding, which: np.ndarray, numbers: np.ndarray) -> None:
        self.inside[which] = numbers > 0.5
        # Only the outermost cells reach beyond the box of the triangles.
        last = np.array(self.table.shape) - 1
        outer = which[np.any((self.cells[which] == 0) | (self.cells[which] == last), axis=1)]
        points = _positions(self.cells[outer], np.arange(NODES * len(outer)))
        self.inside[outer] &= winding.within(points).reshape(-1, NODES)

    @staticmethod
    def _ask(winding: Winding, cells: np.ndarray, nodes: np.ndarray, numbers: np.ndarray) -> None:
        slots = np.flatnonzero(nodes)
        numbers.reshape(-1)[slots] = winding.at(_positions(cells, slots))

    def gaps(self, which: np.ndarray) -> np.ndarray:
        """(k, 4) edges (lower node, axis) between neighbours on different sides with no triangle near enough to divide them."""
        d = self.distance[which].reshape(-1, 9, 9, 9)
        side = self.inside[which].reshape(-1, 9, 9, 9)
        found = []
        for axis in range(3):
            low = tuple(slice(None, -1) if a == axis + 1 else slice(None) for a in range(4))
            high = tuple(slice(1, None) if a == axis + 1 else slice(None) for a in range(4))
            at = np.argwhere((side[low] != side[high]) & (d[low] + d[high] > 1.001))
            node = FINE * self.cells[which][at[:, 0]] + at[:, 1:]
            found.append(np.column_stack([node, np.full(len(node), axis)]))
        return np.concatenate(found).astype(np.int64)

    def finished(self) -> tuple[np.ndarray, np.ndarray]:
        """Table and signed blocks; shared nodes agree, and blocks that hold no surface any more are dropped."""
        _, owner = self._shared(np.arange(len(self.cells)))
        signed = np.where(self.inside, -self.distance, self.distance).reshape(-1)[owner].astype(np.float32)
        mixed = (signed.min(axis=1) <= 0) & (signed.max(axis=1) >= 0)
        keep = np.flatnonzero(mixed | (np.abs(signed[:, NODES // 2]) <= HALF_DIAGONAL + BAND))
        table = np.full_like(self.table, -1)
        table[tuple(self.cells[keep].T)] = np.arange(len(keep))
        return table, signed[keep].reshape(-1, 9, 9, 9)


def _steepest(centres: np.ndarray, rims: np.ndarray) -> np.ndarray:
    """How fast the winding number can change in the block round each centre, by Biot and Savart's law for its open edges."""
    slope = np.full(len(centres), np.inf)
    if len(centres) * len(rims) > 5e7:
        return slope
    middle = rims.mean(axis=1)
    length = np.linalg.norm(rims[:, 1] - rims[:, 0], axis=1)
    for part in np.array_split(np.arange(len(centres)), 1 + len(centres) * len(rims) // 1_000_000):
        away = np.linalg.norm(centres[part, None] - middle, axis=2) - HALF_DIAGONAL - 0.5 * length
        slope[part] = (length / np.maximum(away, 1e-6) ** 2).sum(axis=1) / (4.0 * math.pi)
    return slope


def _positions(cells: np.ndarray, slots: np.ndarray) -> np.ndarray:
    block, node = np.divmod(slots, NODES)
    return (FINE * cells[block] + np.stack([node // 81, node // 9 % 9, node % 9], axis=1)).astype(float)


# --- holes -------------------------------------------------------------------------------------------------------------


def _close(field: _Blocks, surface: _Surface, winding: Winding) -> tuple[np.ndarray, np.ndarray] | None:
    """Triangles of the sheets on which the winding number is one half away from every triangle; None where there are none.

    The sheet is followed from block to block, so that it is whole even where no coarse corner tells of it.
    """
    edges = field.gaps(np.arange(len(field.cells)))
    fresh = edges
    while len(fresh):
        wanted = np.zeros(field.table.shape, bool)
        wanted[tuple(_around(fresh, FINE, field.table.shape).T)] = True
        new = field.add(wanted)
        if not len(new):
            break
        field.measure(surface, new)
        field.sign_finely(winding, new)
        fresh = field.gaps(new)
        edges = np.concatenate([edges, fresh])
    if not len(edges):
        return None
    edges = np.unique(edges, axis=0)
    # One vertex in each fine cell that the sheet passes, one quadrilateral across each edge: a surface net.
    fine = tuple(FINE * n for n in field.table.shape)
    quads = _around(edges, 1, fine, whole=True)
    key = np.ravel_multi_index(tuple(quads.T), fine)
    cells, corner = np.unique(key, return_inverse=True)
    vertices = _net_vertices(np.stack(np.unravel_index(cells, fine), axis=1), winding)
    corner = corner.reshape(-1, 4)
    faces = np.concatenate([corner[:, [0, 1, 3]], corner[:, [0, 3, 2]]])
    return vertices, faces.astype(np.int64)


def _around(edges: np.ndarray, size: int, shape: tuple[int, ...], *, whole: bool = False) -> np.ndarray:
    """Cells of edge `size` round grid edges, four an edge; those that the edge does not touch repeat or, off the grid, go.

    With `whole` every edge keeps its four, in the order (0, 0), (0, 1), (1, 0), (1, 1) of the other two axes.
    """
    node, axis = edges[:, :3], edges[:, 3]
    out = []
    for first in (1, 0):
        for second in (1, 0):
            back = np.zeros_like(node)
            rows = np.arange(len(node))
            back[rows, (axis + 1) % 3] = first
            back[rows, (axis + 2) % 3] = second
            out.append((node - back) // size)
    cells = np.stack(out, axis=1).reshape(-1, 3)
    if whole:
        return np.clip(cells, 0, np.array(shape) - 1)
    return cells[np.all((cells >= 0) & (cells < shape), axis=1)]


def _net_vertices(cells: np.ndarray, winding: Winding) -> np.ndarray:
    """For each fine cell the mean of the points where its edges cross the level one half."""
    offsets = np.array(list(np.ndindex(2, 2, 2)))
    corners = (cells[:, None] + offsets).reshape(-1, 3)
    nodes, inverse = np.unique(corners, axis=0, return_inverse=True)
    points = nodes.astype(float)
    level = np.where(winding.within(points), winding.at(points), 0.0) - 0.5
    level = level[inverse.reshape(-1)].reshape(-1, 8)
    total, count = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for a in range(8):
        for b in range(a + 1, 8):
            if np.abs(offsets[a] - offsets[b]).sum() != 1:
                continue
            cross = np.flatnonzero((level[:, a] > 0) != (level[:, b] > 0))
            t = level[cross, a] / (level[cross, a] - level[cross, b])
            total[cross] += offsets[a] + t[:, None] * (offsets[b] - offsets[a])
            count[cross] += 1
    middle = np.full(3, 0.5)
    return cells + np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], middle)


# --- what is not surface -----------------------------------------------------------------------------------------------


def _exposed(surface: _Surface, winding: Winding, field: _Blocks, numbers: np.ndarray):
    """Split the triangles into those that bound the body and those with the same side in front and behind.

    Only looked at near suspicious blocks: a winding number beyond 0 to 1, or a surface without a change of side.

    Returns:
        (vertices, faces) of what bounds the body (None: nothing), the same of the rest (None: nothing), and the share of the
        area that the rest has.
    """
    from scipy.ndimage import binary_dilation

    vertices, faces = surface.vertices, surface.faces
    marked = np.zeros(field.table.shape, bool)
    marked[tuple(field.cells[(numbers.max(axis=1) > 1.25) | (numbers.min(axis=1) < -0.25)].T)] = True
    same = ~field.inside.any(axis=1) | field.inside.all(axis=1)
    quiet = np.flatnonzero(same & (field.distance.min(axis=1) < 0.9))  # half the diagonal of a fine cell
    if len(quiet):
        # Most of these are only grazed, or hold a wall thinner than a cell: look behind the nearest triangle.
        node = NODES * quiet + field.distance[quiet].argmin(axis=1)
        point = _positions(field.cells, node)
        behind = surface.nearest(point) - point
        behind *= 1.0 + _PROBE / np.maximum(np.linalg.norm(behind, axis=1), 1e-3)[:, None]
        still = winding.inside(point + behind) == field.inside.reshape(-1)[node]
        marked[tuple(field.cells[quiet[still]].T)] = True
    if not marked.any():
        return (vertices, faces), None, 0.0
    marked = binary_dilation(marked, np.ones((3, 3, 3), bool))
    pieces, parent, asked = _cut(vertices[faces], marked)
    normal = np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
    twice = np.linalg.norm(normal, axis=1)
    step = _PROBE * normal / np.maximum(twice, 1e-300)[:, None]
    middle = pieces.mean(axis=1)
    bounds = np.ones(len(pieces), bool)
    bounds[asked] = winding.inside((middle + step)[asked]) != winding.inside((middle - step)[asked])
    if bounds.all():
        return (vertices, faces), None, 0.0
    # A triangle that is whole stays as it was; of the others the pieces go in.
    broken = np.zeros(len(faces), bool)
    broken[parent[~bounds]] = True
    loose = pieces[bounds & broken[parent]]
    kept = faces[~broken]
    soup = (loose.reshape(-1, 3), np.arange(3 * len(loose)).reshape(-1, 3))
    exposed = _joined(vertices, kept, *soup) if len(kept) + len(loose) else None
    gone = pieces[~bounds]
    area = 0.5 * np.linalg.norm(np.cross(*np.moveaxis(np.diff(vertices[faces], axis=1), 1, 0)), axis=1).sum()
    removed = (gone.reshape(-1, 3), np.arange(3 * len(gone)).reshape(-1, 3))
    return exposed, removed, float(0.5 * twice[~bounds].sum() / area)


def _cut(triangles: np.ndarray, marked: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut the triangles in marked coarse cells until they are no longer than a fine cell.

    Returns:
        The pieces, the triangle each comes from, and whether it lies in a marked cell. Triangles that meet none are left out.
    """
    # Marked cells in any box from eight sums.
    sums = np.pad(marked.astype(np.int64).cumsum(0).cumsum(1).cumsum(2), ((1, 0),) * 3)
    top = np.array(marked.shape)

    def meets(pieces: np.ndarray) -> np.ndarray:
        lo = np.clip(np.floor(pieces.min(axis=1) / FINE).astype(np.int64), 0, top - 1)
        hi = np.clip(np.floor(pieces.max(axis=1) / FINE).astype(np.int64), 0, top - 1) + 1
        count = np.zeros(len(pieces), np.int64)
        for corner in np.ndindex(2, 2, 2):
            count += (-1) ** (3 - sum(corner)) * sums[tuple(np.where(corner, hi, lo).T)]
        return count > 0

    parent = np.flatnonzero(meets(triangles))
    pieces = triangles[parent]
    done = []
    while len(pieces):
        near = meets(pieces)
        longest = np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2)
        ready = ~near | (longest.max(axis=1) <= 1.0)
        done.append((pieces[ready], parent[ready], near[ready]))
        pieces, parent = _halved(pieces[~ready], longest[~ready]), np.repeat(parent[~ready], 2)
    if not done:
        return np.empty((0, 3, 3)), np.empty(0, np.int64), np.empty(0, bool)
    whole = [np.concatenate(part) for part in zip(*done, strict=True)]
    return whole[0], whole[1], whole[2]


def _halved(triangles: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Each triangle cut across its longest edge, which keeps slivers from breaking into very many pieces."""
    rows, k = np.arange(len(triangles)), edges.argmax(axis=1)
    a, b, c = triangles[rows, k], triangles[rows, (k + 1) % 3], triangles[rows, (k + 2) % 3]
    middle = 0.5 * (a + b)
    return np.stack([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)], axis=1).reshape(-1, 3, 3)


def _joined(vertices: np.ndarray, faces: np.ndarray, more: np.ndarray, more_faces: np.ndarray):
    return np.concatenate([vertices, more]), np.concatenate([faces, more_faces + len(vertices)])
