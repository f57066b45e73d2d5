"""Redistancing: the true distance to the zero set of a field, periodic or within a box.

`field / |grad field|` is a distance to first order only: a gyroid sheet made with it is up to 11 % short of material at a
wall of a fifth of the cell (lf-rep 3.4). Here the distance is computed once, by closest points on the surface, for one period
or for the nodes of a box, and kept as a smooth spline.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from .arguments import box_of, positive
from .errors import ArgumentError, TooLargeError
from .evaluate import program
from .field import Field
from .progress import progress
from .sampled import BoxSpline, PeriodicSpline

NODES = 64
"""Spline nodes along the shortest period: a cubic spline then keeps within 1e-4 of it of the true distance, away from
the channel centres, where the distance has a crease."""

_NEWTON_STEPS = 5
_FOOT_STEPS = 8
_BRICK = 1_200_000
"""Nodes worked on at once: about 400 MB."""
_CHUNK = 100_000
"""Nodes between two looks at the keyboard."""
_MOST_NODES = 10**8
_NO_SURFACE = "surface: the field has no zero set, so there is nothing to thicken"


@dataclass(frozen=True)
class _Nodes:
    """A grid of nodes: `origin + step * (i, j, k)`; a periodic one goes on behind its last node with its first."""

    origin: np.ndarray
    step: np.ndarray
    shape: tuple[int, int, int]
    periodic: bool

    def points(self) -> np.ndarray:
        """(nx * ny * nz, 3) positions."""
        axes = [o + s * np.arange(n) for o, s, n in zip(self.origin, self.step, self.shape, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def last(self, axis: int, side: int) -> tuple[Any, ...]:
        """The layer that has no neighbour on that side."""
        return (slice(None),) * axis + (-1 if side > 0 else 0,)


@lru_cache(maxsize=32)
def periodic_distance(field: Field, period: tuple[float, float, float]) -> Field:
    """The signed distance, in mm, to the zero set of a field of period (a, b, c) mm, as a Field of the same period.

    Costs about half a second, once for a surface and cell; after that a lookup.

    Raises:
        ArgumentError: the field has no zero set, or its gradient vanishes on it.
    """
    size = np.array(period)
    a, b, c = (int(2 * round(NODES / 2 * p / size.min())) for p in size)
    shape = (a, b, c)
    if max(shape) > 8 * NODES:
        raise ArgumentError(f"cell: a period more than 8 times longer than another is not supported, got {period}")
    grid = _Nodes(np.zeros(3), size / shape, shape, True)
    with progress("distance to the surface", total=1) as advance:
        nodes = grid.points()
        values = field(nodes)
        feet = _first_feet(field, nodes, values.reshape(shape), grid)
        if feet is None:
            raise ArgumentError(_NO_SURFACE)
        feet = _closest(field, nodes, feet, grid, np.full(len(nodes), np.inf))
        distance = np.copysign(_lengths(nodes - feet), values)
        advance(1)
    return PeriodicSpline(size, distance.reshape(shape), label="distance").field()


def distance_over(field: Field, box: Any, reach: Any, spacing: float | None = None) -> Field:
    """The signed distance, in mm, to the zero set of any smooth field within a box, as a Field.

    Near the surface a spline through exact distances: within 1e-4 of a sphere's radius where the nodes are a tenth of that
    apart; of a gyroid within 4e-4 of the cell for 32 nodes a cell. Two parts of the surface nearer to one
    another than two nodes are seen as none; creases of the distance and edges of the surface are rounded by a spacing or so.
    Costs about 3 s for a million nodes within reach, once; after that a lookup.

    Args:
        field: negative on one side. Its surface beyond the box counts as far as `reach` from it.
        box: a bounded Solid, or its lower and upper corner, mm. Beyond it the value at the nearest point of the box goes on.
        reach: how far from the surface the distance has to be true, mm: a number, or a Field, which is zero or less where
            the distance is not asked for. Further away the distance is that of a point near the closest one, at most a
            spacing too large, and held at the farthest reach and four spacings.
        spacing: distance of the nodes, mm; a 128th of the longest side unless given.

    Raises:
        UnboundedError: a box without end.
        ArgumentError: a box without volume; a reach or a spacing that is not positive; no surface in the box.
        TooLargeError: more nodes than 100 million; names the spacing that has as many.

    Example:
        >>> from frep import coordinates
        >>> x, y, z = coordinates()
        >>> bowl = distance_over(x**2 + y**2 + 2 * z**2 - 36, ((-8, -8, -8), (8, 8, 8)), 2.0, 0.5)
        >>> round(float(bowl((7, 0, 0))), 3)
        1.0
    """
    lo, hi = box_of(box)
    step = positive(spacing, "spacing") if spacing is not None else float((hi - lo).max()) / 128
    law = reach if isinstance(reach, Field) else None
    most = positive(reach, "reach") if law is None else law.bounds(lo, hi)[1]
    if not 0.0 < most < np.inf:
        raise ArgumentError(
            f"reach: expected more than 0 mm somewhere in the box, and a limit, got at most {most:g} mm"
        )
    return _distance_over(field, tuple(lo.tolist()), tuple(hi.tolist()), law, float(most), step)


@lru_cache(maxsize=8)
def _distance_over(
    field: Field, low: tuple[float, ...], high: tuple[float, ...], law: Field | None, most: float, step: float
) -> Field:
    lo, hi = np.array(low), np.array(high)
    # Two layers outside: what the spline's ends do is not seen.
    counts = np.ceil((hi - lo) / step - 1e-9) + 5
    if np.prod(counts) > _MOST_NODES:
        fits = step * float(np.prod(counts) / _MOST_NODES) ** (1 / 3)
        raise TooLargeError(
            f"spacing: {np.prod(counts):,.0f} nodes {step:g} mm apart; {fits:.2g} mm has {_MOST_NODES:,}"
        )
    shape = tuple(int(n) for n in counts)
    origin = lo - 2.0 * step
    distance = np.empty(shape, np.float32)
    beyond = int(np.ceil(most / step)) + 4
    side = max(int(_BRICK ** (1 / 3)) - 2 * beyond, beyond)
    cuts = [np.linspace(0, n, int(np.ceil(n / side)) + 1).astype(int) for n in shape]
    bricks = list(itertools.product(*[list(itertools.pairwise(c.tolist())) for c in cuts]))
    found = False
    with progress("distance to the surface", total=len(bricks)) as advance:
        for brick in bricks:
            first = np.array([start for start, _ in brick]) - beyond
            x, y, z = (stop - start + 2 * beyond for start, stop in brick)
            part = _Nodes(origin + step * first, np.full(3, step), (x, y, z), False)
            distance[tuple(slice(*ends) for ends in brick)], some = _brick(field, part, beyond, law, most)
            found |= some
            advance(1)
    if not found:
        raise ArgumentError(_NO_SURFACE)
    return BoxSpline(origin, np.full(3, step), distance, label="distance").field()


def _brick(field: Field, grid: _Nodes, beyond: int, law: Field | None, most: float) -> tuple[np.ndarray, bool]:
    """Distances at the nodes of a grid that are not among its `beyond` outer layers, and whether there was a surface."""
    from scipy.ndimage import maximum_filter

    nodes = grid.points()
    values = np.concatenate([field(nodes[k : k + _CHUNK]) for k in range(0, len(nodes), _CHUNK)])
    inner = (slice(beyond, -beyond),) * 3
    step = float(grid.step[0])
    far = most + 4.0 * step
    feet = _first_feet(field, nodes, values.reshape(grid.shape), grid)
    if feet is None:
        return np.copysign(far, values).reshape(grid.shape)[inner], False
    limit = np.full(grid.shape, -np.inf)
    if law is None:
        limit[inner] = most
    else:
        own = nodes.reshape(*grid.shape, 3)[inner]
        # A spline goes by the nodes round a point, and a little by those further off: four spacings are enough.
        limit[inner] = maximum_filter(law(own.reshape(-1, 3)).reshape(own.shape[:3]), size=9)
    limit = np.where(limit > 0.0, limit + 3.0 * step, -np.inf)
    feet = _closest(field, nodes, feet, grid, limit.reshape(-1))
    distance = np.minimum(_lengths(nodes - feet), far)
    return np.copysign(distance, values).reshape(grid.shape)[inner], True


@lru_cache(maxsize=32)
def _derivatives(field: Field) -> tuple[Field, Field, Field]:
    return field.derivatives()


def _value_and_gradient(field: Field, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    value, *slope = program(field, *_derivatives(field)).at(points)
    return value, np.stack(slope, axis=1)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    """Along the last axis; several times quicker than numpy's norm."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _first_feet(field: Field, nodes: np.ndarray, values: np.ndarray, grid: _Nodes) -> np.ndarray | None:
    """For each node a point of the zero set near the closest one, within a spacing or two; None where there is none.

    Where the zero set crosses a grid edge, both ends of the edge get a point on it; every other node takes the point of the
    nearest node that has one (scipy's distance transform; a period is padded by half of itself all round).
    """
    from scipy.ndimage import distance_transform_edt

    held = _crossings(nodes, values, grid)
    has = np.isfinite(held[..., 0])
    if not has.any():
        return None
    points, gradient = _onto(field, held[has], _NEWTON_STEPS)
    steep = _lengths(gradient) > 0.0
    if grid.periodic and not np.all(steep):
        raise ArgumentError("surface: the gradient of the field vanishes on its zero set")
    # Newton's way may lead off where the surface crosses itself, or the field jumps.
    steep &= _lengths(points - held[has]) < 2.0 * grid.step.max()
    held[has] = np.where(steep[:, None], points, np.nan)
    has[has] = steep
    if not has.any():
        return None
    pad = [(n // 2, n // 2) if grid.periodic else (0, 0) for n in grid.shape]
    index = np.asarray(
        distance_transform_edt(
            np.pad(~has, pad, mode="wrap"), sampling=grid.step, return_distances=False, return_indices=True
        )
    )
    middle = tuple(slice(p[0], p[0] + n) for p, n in zip(pad, grid.shape, strict=True))
    nearest = [index[a][middle] - pad[a][0] for a in range(3)]
    folded = tuple(np.mod(k, n) for k, n in zip(nearest, grid.shape, strict=True))
    shift = np.stack([(k - f) * s for k, f, s in zip(nearest, folded, grid.step, strict=True)], axis=-1)
    return (held[folded] + shift).reshape(-1, 3)


def _crossings(nodes: np.ndarray, values: np.ndarray, grid: _Nodes) -> np.ndarray:
    """(nx, ny, nz, 3) where the field changes its sign on an edge of the node, by its ends' values; NaN where on none."""
    inside = values < 0
    held = np.full((*values.shape, 3), np.nan)
    own = nodes.reshape(*values.shape, 3)
    for axis in range(3):
        following = np.roll(values, -1, axis)
        crossed = inside != np.roll(inside, -1, axis)
        if not grid.periodic:
            crossed[grid.last(axis, 1)] = False
        along = np.zeros((int(crossed.sum()), 3))
        along[:, axis] = grid.step[axis] * values[crossed] / (values[crossed] - following[crossed])
        held[crossed] = own[crossed] + along
        along[:, axis] -= grid.step[axis]
        beyond = np.roll(crossed, 1, axis)
        # The far end, in the order of the near ones: roll the points with their edges.
        moved = np.full((*values.shape, 3), np.nan)
        moved[crossed] = along
        held[beyond] = own[beyond] + np.roll(moved, 1, axis)[beyond]
    return held


def _closest(field: Field, nodes: np.ndarray, feet: np.ndarray, grid: _Nodes, limit: np.ndarray) -> np.ndarray:
    """The closest point of the zero set to each node nearer to it than `limit`, from points that are near it.

    Halfway, each node tries the feet of its neighbours, in case it has been following a sheet that is not the nearest.
    """
    for half in range(2):
        asked = np.flatnonzero(_lengths(nodes - feet) < limit)
        for start in range(0, len(asked), _CHUNK):
            own = asked[start : start + _CHUNK]
            feet[own] = _towards(field, nodes[own], feet[own], float(grid.step.min()))
        if half == 0:
            feet = _from_neighbours(nodes, feet, grid)
    return feet


def _towards(field: Field, nodes: np.ndarray, feet: np.ndarray, step: float) -> np.ndarray:
    """Feet brought towards the closest points of their nodes.

    A step drops the node onto the tangent plane at the present foot and brings that point back to the surface; the
    tangential error falls by the distance over the radius of curvature each time. Nothing is taken that is not nearer, nor
    what is not on the surface; a foot that has come to rest is left alone.
    """
    best = _lengths(nodes - feet)
    _, gradient = _value_and_gradient(field, feet)
    going = np.arange(len(nodes))
    for _ in range(_FOOT_STEPS // 2):
        at, normal = nodes[going], gradient[going]
        normal = normal / np.maximum(_lengths(normal), 1e-300)[:, None]
        start = at - np.einsum("ij,ij->i", at - feet[going], normal)[:, None] * normal
        middle, _ = _onto(field, start, 1)
        trial, slope = _onto(field, middle, 1)
        distance = _lengths(at - trial)
        settled = _lengths(trial - middle) < 0.3 * step
        better = (distance < best[going]) & settled
        gain = best[going] - distance
        taken = going[better]
        feet[taken], best[taken], gradient[taken] = trial[better], distance[better], slope[better]
        going = going[better & (gain > 1e-6 * step)]
        if not len(going):
            break
    return feet


def _from_neighbours(nodes: np.ndarray, feet: np.ndarray, grid: _Nodes) -> np.ndarray:
    """Of each node's foot and those of its six neighbours, the nearest."""
    offset = (feet - nodes).reshape(*grid.shape, 3)
    best, nearest = offset, _lengths(offset)
    for axis in range(3):
        for side in (1, -1):
            # The neighbour's foot as seen from here: one spacing further along the axis, then its offset.
            trial = np.roll(offset, -side, axis).copy()
            trial[..., axis] += side * grid.step[axis]
            length = _lengths(trial)
            nearer = length < nearest
            if not grid.periodic:
                nearer[grid.last(axis, side)] = False
            best = np.where(nearer[..., None], trial, best)
            nearest = np.where(nearer, length, nearest)
    return nodes + best.reshape(-1, 3)


def _onto(field: Field, points: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Points brought onto the zero set by Newton steps, and the gradient at the last but one place."""
    gradient = np.zeros_like(points)
    for _ in range(steps):
        value, gradient = _value_and_gradient(field, points)
        squared = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 1e-300)
        points = points - (value / squared)[:, None] * gradient
    return points, gradient
