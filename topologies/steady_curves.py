"""The cage view of a steady lattice: curves of its map S(u, v, w) = W^w V^v U^u through cluster centres, by real powers.

Display curves: drawn by straight segments fine enough for the eye, their number bounded whatever the counts. A helix or spiral
of more turns than that bound can carry is drawn coarsely.

Source: Constructive Lattice Geometry 2.6.4 (iso-curves), 6.2 (cage view).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from frep.errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from frep.similarity import Similarity
    from topologies.steady import SteadyLattice

_STEP = 2.0 * math.pi / 96.0
"""rad of turn, or of logarithm of scale, from point to point: a chord leaves the arc by 1/2000 of its radius."""

MOST_POINTS = 4096
"""Points of a curve at most."""


def outline(lattice: SteadyLattice) -> list[np.ndarray]:
    """The edges of the brick of clusters, traced through the centres of the clusters there.

    Returns:
        Polylines (n, 3), mm: twelve of a brick, four of a slab (counts of 1 have no edges along them), one of a row.
    """
    return [curve for direction in "uvw" for curve in iso_curves(lattice, direction)]


def iso_curves(
    lattice: SteadyLattice, direction: str, lines: int | tuple[int, int] = 2, *, points: int | None = None
) -> list[np.ndarray]:
    """Curves along which one of the three parameters varies, evenly spread over the other two, both ends included.

    Args:
        lattice: the lattice.
        direction: "u", "v" or "w".
        lines: how many along each of the other two directions, in the order of the alphabet; a number for both. Where a direction
            has a single cluster there is one.
        points: of each curve; None for as many as its turns need, 4096 at most. Straight curves have two.

    Returns:
        Polylines (n, 3), mm. None where the direction has a single cluster.

    Raises:
        ArgumentError: an unknown direction, less than one line or two points.
        ArgumentTypeError: lines or points that are no whole numbers.

    Example:
        >>> from topologies.steady import Screw, SteadyLattice, Translation
        >>> quarter = Screw(0.1, axis="z", point=(-20, 0, 0))
        >>> slab = SteadyLattice([(0, 0, 0)], [1], [(0, 0, 1, 0, 0)], Translation((5, 0, 0)), quarter, quarter, (4, 16, 1))
        >>> [len(curve) for curve in iso_curves(slab, "u")], len(iso_curves(slab, "v", lines=5)), len(outline(slab))
        ([2, 2], 5, 4)
    """
    if direction not in ("u", "v", "w"):
        raise ArgumentError(f'direction: expected "u", "v" or "w", got {direction!r}')
    along = "uvw".index(direction)
    a, b = (axis for axis in range(3) if axis != along)
    wanted = _whole_pair(lines)
    similarities = lattice.skeleton.directions
    first = [int(n) for n in lattice.start]
    last = [f + int(n) - 1 for f, n in zip(first, lattice.counts, strict=True)]
    if last[along] == first[along]:
        return []
    number = (
        _points(similarities[along], last[along] - first[along]) if points is None else _at_least(points, "points", 2)
    )

    parameters = [np.empty(0)] * 3
    parameters[along] = np.linspace(first[along], last[along], number)
    for axis, count in zip((a, b), wanted, strict=True):
        parameters[axis] = np.unique(np.linspace(first[axis], last[axis], count))
    # The points of the map on the grid of the three parameters: U first, then V, then W.
    grid = np.mean(lattice.nodes, axis=0)[None]
    for similarity, values in zip(similarities, parameters, strict=True):
        frames = similarity.powers(values)
        grid = np.einsum("tab,...b->...ta", frames[:, :3, :3], grid) + frames[:, :3, 3]
    # Axes of the grid: the one point of the template, then u, v, w.
    curves = np.moveaxis(grid[0], along, 2)
    return [np.ascontiguousarray(curve) for curve in curves.reshape(-1, number, 3)]


def _points(similarity: Similarity, span: int) -> int:
    """How many points draw `span` applications of a similarity; lines, straight ones of a dilation too, need two."""
    if similarity.angle == 0.0:
        return 2
    turned = max(abs(similarity.angle), abs(similarity.log_scale)) * span
    return int(min(math.ceil(turned / _STEP) + 2, MOST_POINTS))


def _whole_pair(lines: int | tuple[int, int]) -> tuple[int, int]:
    if isinstance(lines, tuple) and len(lines) == 2:
        return _at_least(lines[0], "lines", 1), _at_least(lines[1], "lines", 1)
    number = _at_least(lines, "lines", 1)
    return number, number


def _at_least(value: object, name: str, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ArgumentTypeError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    if value < least:
        raise ArgumentError(f"{name}: expected a whole number of at least {least}, got {value!r}")
    return int(value)
