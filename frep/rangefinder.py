"""RangeFinder: ball-interference queries (BIQ) of steady lattices, and what follows from them: containment, distance, nearest.

A beam's place in a row S^k is bounded by coordinates in which S is a shift, instead of a search; a lattice whose similarities
commute is searched in O(1) or O(nu) operations, any other in O(nu nv) or by descent of its index brick. All methods find the
same beams: index bounds are conservative, and each beam within them is tested against the ball exactly (a beam is the hull of
two balls; touching counts as meeting). Not promised: contacts closer than rounding, about 1e-12 of the lattice's size.

Source: Kurzeja, Constructive Lattice Geometry, chapter 7; corrected: the last index, all turns, oblique translations.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import rangefinder_kernels as kernels
from .arguments import vector
from .errors import ArgumentError, ArgumentTypeError
from .field import _points
from .rangefinder_packing import Conditions, Method, conditions, coordinates_of, packed
from .similarity import Similarity
from .steady import SteadySkeleton

__all__ = [
    "Conditions",
    "conditions",
    "contains",
    "distance",
    "find_beams",
    "find_nodes",
    "meets",
    "nearest",
    "row_ranges",
]

_METHODS = {
    "O(1)": kernels.BOXES,
    "O(u)": kernels.SHEETS,
    "O(uv)": kernels.ROWS,
    "descent": kernels.DESCENT,
    "naive": kernels.NAIVE,
}
_BATCH = 16_384  # queries at once
_CAPACITY = 64  # beams a query at first
_CELLS = 1 << 22  # rows of results held at once


# --- whole lattices ------------------------------------------------------------------------------------------------------


def find_beams(
    skeleton: SteadySkeleton, centers: Any, radii: Any, method: Method = "auto", *, threads: int | None = None
) -> np.ndarray:
    """The beams that meet each of many balls: (m, 5) int64 rows (query, i, j, k, rack), ordered by query.

    Args:
        skeleton: the lattice; (i, j, k) is the cluster of a beam's start node.
        centers: (q, 3) mm.
        radii: (q,) mm, or one number; 0 asks which beams hold the point.
        method: "auto" takes O(1) where `conditions` allow it, and the descent elsewhere. "O(1)": index boxes by a dual basis;
            "O(u)": j and k bounded apart for each i; "O(uv)": rows along w; "descent": contraction and halving of the index
            brick (`frep/steady_kernels.py`), on any lattice; "naive": every beam.
        threads: how many to use; all of numba's unless given.

    Raises:
        ArgumentError: shapes, numbers that are not finite, a negative radius, a method that the lattice does not allow.

    Example:
        >>> from topologies.steady import SteadyLattice, Translation
        >>> grid = SteadyLattice([(0, 0, 0)], 0.1, [(0, 0, 1, 0, 0)], u=Translation((1, 0, 0)), counts=(1000, 1, 1))
        >>> find_beams(grid.skeleton, [(500.5, 0, 0), (3, 0, 0)], 0.2).tolist()
        [[0, 500, 0, 0, 0], [1, 2, 0, 0, 0], [1, 3, 0, 0, 0]]

    Source: Constructive Lattice Geometry, 7.3.
    """
    return _find(skeleton, "beams", centers, radii, method, threads)


def find_nodes(
    skeleton: SteadySkeleton, centers: Any, radii: Any, method: Method = "auto", *, threads: int | None = None
) -> np.ndarray:
    """The node balls that meet each of many balls: (m, 5) int64 rows (query, i, j, k, node). Otherwise as `find_beams`."""
    return _find(skeleton, "nodes", centers, radii, method, threads)


def meets(skeleton: SteadySkeleton, centers: Any, radii: Any) -> np.ndarray:
    """Whether each of many balls meets a beam or a node ball: (q,) bool. Ends at the first met; otherwise as `find_beams`."""
    c, r = _asked(centers, radii)
    return _search(skeleton, "solid", c, r, kernels.ANY)[0] > 0


def contains(skeleton: SteadySkeleton, points: Any) -> np.ndarray:
    """Which of (n, 3) points lie in a beam or a node ball: (n,) bool, for one point (3,) a bool. The surface counts as inside.

    Raises:
        ArgumentError: points of another shape, or not finite.
    """
    pts, single = _finite(points)
    inside = meets(skeleton, pts, 0.0)
    return inside[0] if single else inside


def distance(skeleton: SteadySkeleton, points: Any, within: float) -> np.ndarray:
    """Signed distance (mm) from (n, 3) points to the union of beams and node balls, (n,), cut off at `within` mm.

    Negative inside, where it is the depth in the beam that holds the point deepest. A point with nothing within `within` mm gets
    `within`, so that the value never exceeds the distance.

    Raises:
        ArgumentError: points of another shape or not finite, `within` negative or not finite.
    """
    pts, single = _finite(points)
    if not (isinstance(within, (int, float, np.number)) and math.isfinite(within) and within >= 0):
        raise ArgumentError(f"within: expected a finite number >= 0 in mm, got {within!r}")
    found, _, gaps = _search(skeleton, "solid", pts, np.full(len(pts), float(within)), kernels.NEAREST)
    out = np.where(found > 0, gaps, float(within))
    return out[0] if single else out


def nearest(skeleton: SteadySkeleton, points: Any) -> tuple[np.ndarray, np.ndarray]:
    """The beam nearest to each of (n, 3) points: rows (n, 4) int64 (i, j, k, rack), and signed distances (n,) in mm.

    Balls are asked for, of a radius that doubles until one meets a beam. A single point (3,) gives a row (4,) and a number.

    Raises:
        ArgumentError: points of another shape or not finite; a lattice without beams.
    """
    pts, single = _finite(points)
    conditions(skeleton)  # refuses what is no steady skeleton
    if skeleton.n_beams == 0:
        raise ArgumentError("skeleton: expected a lattice that has beams, got none")
    low, high = skeleton.bounds
    widest = float(np.max(skeleton.radii)) * skeleton.scales[1]
    step = max(2.0 * widest, 1e-6 * float(np.max(high - low)), 1e-300)
    reach = np.linalg.norm(np.maximum(np.maximum(low - pts, pts - high), 0.0), axis=1) + step
    rows, gaps = np.empty((len(pts), 4), np.int64), np.empty(len(pts))
    waiting = np.arange(len(pts))
    while len(waiting):
        found, cells, depth = _search(skeleton, "beams", pts[waiting], reach[waiting], kernels.NEAREST)
        hit = found > 0
        rows[waiting[hit]], gaps[waiting[hit]] = cells[hit], depth[hit]
        waiting = waiting[~hit]
        reach[waiting] *= 2.0
    return (rows[0], gaps[0]) if single else (rows, gaps)


# --- rows ----------------------------------------------------------------------------------------------------------------


def row_ranges(
    similarity: Similarity, ball_or_beam: Any, center: Any, radius: float, count: int
) -> list[tuple[int, int]]:
    """Where a row S^k T, 0 <= k < count, may meet a ball: ranges (low, high), both included, ascending and disjoint.

    Conservative: every k that meets the ball lies in a range; some that do not may as well.

    Args:
        similarity: S.
        ball_or_beam: T, a ball `(center, radius)` or a cone-beam `((center, radius), (center, radius))`.
        center, radius: the ball asked about, mm.
        count: how many there are in the row.

    Raises:
        ArgumentError, ArgumentTypeError: not finite, a negative radius, a count below 1, another form of T.

    Example:
        >>> from frep.similarity import Screw
        >>> ring = Screw(0.999 * 2 * math.pi / 20)  # twenty balls, almost closed
        >>> row_ranges(ring, ((1, 0, 0), 0.05), (1, -0.16, 0), 0.15, 20)
        [(0, 0), (19, 19)]

    Source: Constructive Lattice Geometry, 7.1 and 7.2, with all turns looked at.
    """
    if not isinstance(similarity, Similarity):
        raise ArgumentTypeError(f"similarity: expected a Similarity, got {similarity!r}")
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise ArgumentError(f"count: expected a whole number of 1 or more, got {count!r}")
    balls = _balls(ball_or_beam)
    c, r = vector(center, "center"), _radius(radius, "radius")
    size = float(np.abs(balls[:, :3]).max() + balls[:, 3].max())
    coordinates, _ = coordinates_of(similarity, 0, int(count) - 1, size)
    pad = kernels._PAD * (
        size + float(np.linalg.norm(coordinates[kernels.C_POINT : kernels.C_POINT + 3]) + np.abs(c).sum())
    )
    beam, extent = np.empty(kernels.BEAM), np.empty(4)
    kernels.prepare(*balls[0], *balls[-1], beam)
    kernels.ball_extent(coordinates, *c, r + pad, extent)
    out = np.empty((8, 2), np.int64)
    n = kernels.row_of_beam(coordinates, extent, beam, pad, 0, int(count) - 1, out)
    if n > len(out):
        out = np.empty((n, 2), np.int64)  # n or, as neighbours merge where they are held, fewer
        n = kernels.row_of_beam(coordinates, extent, beam, pad, 0, int(count) - 1, out)
    return [(int(low), int(high)) for low, high in out[:n]]


def _balls(value: Any) -> np.ndarray:
    """(1 or 2, 4) centres and radii."""
    try:
        _, second = value
        balls = [value] if isinstance(second, (int, float, np.number)) else value
        rows = [[*vector(c, "ball_or_beam"), _radius(r, "ball_or_beam")] for c, r in balls]
    except (TypeError, ValueError) as error:
        if isinstance(error, (ArgumentError, ArgumentTypeError)):
            raise
        raise ArgumentError(f"ball_or_beam: expected (center, radius) or two of these, got {value!r}") from None
    return np.array(rows)


def _radius(value: Any, name: str) -> float:
    number = value if isinstance(value, (int, float, np.number)) and not isinstance(value, bool) else math.nan
    if not (math.isfinite(number) and number >= 0):
        raise ArgumentError(f"{name}: expected a finite radius >= 0 in mm, got {value!r}")
    return float(number)


# --- running the kernels -------------------------------------------------------------------------------------------------


def _finite(points: Any) -> tuple[np.ndarray, bool]:
    pts, single = _points(points)
    if not np.all(np.isfinite(pts)):
        raise ArgumentError("points: expected finite numbers in mm")
    return np.array(pts), single  # writable, as the kernels were compiled for


@contextlib.contextmanager
def _threads(count: int | None) -> Iterator[None]:
    if count is None:
        yield
        return
    import numba

    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= numba.config.NUMBA_NUM_THREADS:  # type: ignore[attr-defined]
        limit = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
        raise ArgumentError(f"threads: expected a whole number from 1 to {limit}, got {count!r}")
    before = numba.get_num_threads()
    numba.set_num_threads(count)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def _kernel(way: int) -> Any:
    return kernels.find if way in (kernels.BOXES, kernels.DESCENT) else kernels.find_by_rows


def _chosen(skeleton: SteadySkeleton, method: Method) -> int:
    allowed = conditions(skeleton).methods
    name = method
    if method == "auto":
        # Contraction of the index brick takes about as long as O(u), on any lattice.
        name = "O(1)" if "O(1)" in allowed and conditions(skeleton).dual else "descent"
    if name not in _METHODS:
        raise ArgumentError(f'method: expected "auto" or one of {", ".join(map(repr, _METHODS))}, got {method!r}')
    if name not in allowed:
        raise ArgumentError(
            f"method: {name!r} would miss beams of this lattice; expected one of {', '.join(map(repr, allowed))}"
        )
    if name == "O(1)" and not conditions(skeleton).dual:
        name = "O(u)"  # with a single i the same
    return _METHODS[name]


def _asked(centers: Any, radii: Any) -> tuple[np.ndarray, np.ndarray]:
    try:
        c, r = np.asarray(centers, float), np.asarray(radii, float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"centers, radii: expected numbers in mm, got {centers!r} and {radii!r}") from None
    if c.ndim != 2 or c.shape[1] != 3 or not np.all(np.isfinite(c)):
        raise ArgumentError(f"centers: expected finite numbers of shape (q, 3) in mm, got shape {c.shape}")
    if r.ndim > 1 or r.size not in (1, len(c)):
        raise ArgumentError(f"radii: expected one number or shape ({len(c)},), got shape {r.shape}")
    if not np.all(np.isfinite(r) & (r >= 0.0)):
        bad = r.ravel()[np.argmin(np.isfinite(r.ravel()) & (r.ravel() >= 0.0))]
        raise ArgumentError(f"radius: expected finite numbers >= 0 in mm, got {bad!r}")
    return np.array(c, order="C"), np.array(np.broadcast_to(r.ravel(), (len(c),)))


def _find(
    skeleton: SteadySkeleton, what: str, centers: Any, radii: Any, method: Method, threads: int | None
) -> np.ndarray:
    c, r = _asked(centers, radii)
    way = _chosen(skeleton, method)
    if what == "beams" and not len(skeleton.racks):
        return np.zeros((0, 5), np.int64)
    lattice = packed(skeleton, what, way)
    pieces = []
    with _threads(threads):
        for first in range(0, len(c), _BATCH):
            pieces += _collected(lattice, way, c[first : first + _BATCH], r[first : first + _BATCH], first)
    return np.concatenate(pieces) if pieces else np.zeros((0, 5), np.int64)


def _collected(lattice: kernels.Lattice, way: int, c: np.ndarray, r: np.ndarray, first: int) -> list[np.ndarray]:
    """Rows of all hits of a batch, in order of the queries."""
    found = np.zeros(len(c), np.int64)
    cells, gaps = np.empty((len(c), _CAPACITY, 4), np.int64), np.empty((len(c), _CAPACITY))
    _kernel(way)(way, lattice, c, r, kernels.ALL, cells, gaps, found)
    held = np.minimum(found, _CAPACITY)
    rows = _numbered(cells, held, np.arange(first, first + len(c)))
    many = np.flatnonzero(found > _CAPACITY)
    if not len(many):
        return [rows]
    rows = rows[~np.isin(rows[:, 0] - first, many)]
    pieces, at = [rows], 0
    while at < len(many):
        span = 1
        while at + span < len(many) and (span + 1) * int(found[many[at : at + span + 1]].max()) <= _CELLS:
            span += 1
        some = many[at : at + span]
        most = int(found[some].max())
        cells, gaps, again = np.empty((span, most, 4), np.int64), np.empty((span, most)), np.zeros(span, np.int64)
        _kernel(way)(way, lattice, c[some], r[some], kernels.ALL, cells, gaps, again)
        pieces.append(_numbered(cells, again, first + some))
        at += span
    rows = np.concatenate(pieces)
    return [rows[np.argsort(rows[:, 0], kind="stable")]]


def _numbered(cells: np.ndarray, held: np.ndarray, queries: np.ndarray) -> np.ndarray:
    mask = np.arange(cells.shape[1]) < held[:, None]
    return np.column_stack([np.repeat(queries, held), cells[mask]])


def _search(
    skeleton: SteadySkeleton, what: str, points: np.ndarray, reach: np.ndarray, mode: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One answer a point: how many were met (as far as was counted), the row (n, 4) of the last, and its distance."""
    way = _chosen(skeleton, "auto")
    found, cells, gaps = (
        np.zeros(len(points), np.int64),
        np.zeros((len(points), 1, 4), np.int64),
        np.zeros((len(points), 1)),
    )
    _kernel(way)(way, packed(skeleton, what, way), points, reach, mode, cells, gaps, found)
    return found, cells[:, 0], gaps[:, 0]
