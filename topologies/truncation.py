"""Truncation as a transition: truncated polyhedra whose truncation varies through the part (LF-rep 6.3).

Every node belongs to a point of the grid of cells, a corner (rhombicuboctahedron, truncated cube) or the centre of a
face (truncated octahedron), and lies in a fixed direction from it, by the truncation read there. So cells that share a
node agree on where it is, and nothing comes apart: with one truncation a cell, two layers of rhombicuboctahedra would
meet in concentric squares that do not touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from frep import ArgumentError, FieldLike, as_field, graphs
from frep.skeleton import GraphSkeleton

from . import beam_cells
from .beam_topology import BeamTopology

_GENERIC = 0.2
"""A truncation at which no two nodes coincide, to read from a table which way each node goes."""
_SAME = 1e-9
_ROUNDING = 1e-9


def truncated(
    lines: Callable[[float], list[beam_cells.Line]],
    size: np.ndarray,
    law: FieldLike,
    box: np.ndarray,
    *,
    name: str,
    label: str,
    centred: bool = False,
) -> BeamTopology:
    """The beams of cells of varying truncation that come into a box, as an explicit graph.

    Args:
        lines: the table of a unit cell for a truncation of it, 0 to 1/2.
        size: (3,) mm of the cell.
        law: the truncation in mm along the shortest side, a Field or a function of position; along the others in
            proportion.
        box: (2, 3) mm.
        name: what the law is called in messages.
        centred: whether nodes go from the middles of faces, and not from corners.

    Raises:
        ArgumentError: a truncation below 0 or above half the shortest side; the message says where.
    """
    places, ways = _directions(lines, 2 if centred else 1)
    # Cells that share more than a face with the box, and their neighbours: what these have beyond is cut off below.
    near = graphs.tolerance_of(box) / size
    first = np.floor(box[0] / size + near).astype(np.int64)
    last = np.ceil(box[1] / size - near).astype(np.int64)
    last = np.maximum(last, first + 1)
    cells = np.stack(np.meshgrid(*[np.arange(a, b) for a, b in zip(first, last, strict=True)], indexing="ij"), axis=-1)
    at = (places[None] + 2 * cells.reshape(-1, 1, 1, 3)).reshape(-1, 3)
    towards = np.broadcast_to(ways[None], (cells[..., 0].size, *ways.shape)).reshape(-1, 3)
    # One number for each point of the grid and direction from it.
    low = at.min(axis=0)
    span = at.max(axis=0) - low + 1
    point = ((at[:, 0] - low[0]) * span[1] + at[:, 1] - low[1]) * span[2] + at[:, 2] - low[2]
    way = (towards[:, 0] * 3 + towards[:, 1]) * 3 + towards[:, 2] + 13
    _, chosen, number = np.unique(point * 27 + way, return_index=True, return_inverse=True)
    origin, inverse = np.unique(point[chosen], return_inverse=True)
    grid = np.stack([origin // (span[1] * span[2]), origin // span[2] % span[1], origin % span[2]], axis=1) + low
    share = _shares(law, 0.5 * grid * size, float(size.min()), name)[inverse.reshape(-1)]
    nodes = (0.5 * at[chosen] + share[:, None] * towards[chosen]) * size
    edges = number.reshape(-1, 2)
    joined = graphs.merged([GraphSkeleton(nodes, edges[graphs.distinct(edges)])], _SAME * float(size.max()))
    return BeamTopology(graphs.cut_out(joined.skeleton, box), label)


def _directions(lines: Callable[[float], list[beam_cells.Line]], steps: int) -> tuple[np.ndarray, np.ndarray]:
    """For the ends of every line (m, 2, 3): the point of the grid that each belongs to, in half cells, and its way."""
    ends = np.array(lines(_GENERIC))
    base = np.rint(ends * steps) / steps
    return np.rint(2.0 * base).astype(np.int64), np.rint((ends - base) / _GENERIC).astype(np.int64)


def _shares(law: FieldLike, points: np.ndarray, side: float, name: str) -> np.ndarray:
    """The truncation at points, as a share of the shortest side; exact at both ends of its range."""
    values = as_field(law, name)(points)
    slack = _ROUNDING * side
    wrong = ~((values >= -slack) & (values <= 0.5 * side + slack))
    if wrong.any():
        worst = int(np.argmax(np.where(wrong, np.abs(values - 0.25 * side), -math.inf)))
        where = ", ".join(f"{c:.6g}" for c in points[worst] + 0.0)
        raise ArgumentError(
            f"{name}: expected 0 to {0.5 * side:g} mm, half of the shortest side of the cell, "
            f"got {values[worst]:.6g} at ({where}) mm; limit it with frep.clip"
        )
    share = np.clip(values / side, 0.0, 0.5)
    share[share < _ROUNDING] = 0.0
    share[share > 0.5 - _ROUNDING] = 0.5
    return share
