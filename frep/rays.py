"""Rays against solids: the first hit, by sphere tracing of any solid's field.

Promised: no hit is passed over, so long as the field nowhere changes faster than `slope` mm a mm: then a ball of radius
`field / slope` round a point outside holds no material, and the ray may go on to where the next such ball begins. Distances of
lattices, primitives and bodies have slope 1, as have their unions, intersections and differences; a width that varies, a
coordinate map or an arithmetic field may have more. Not promised: that a ray which comes within `tolerance` of the surface
without touching it is a miss.

Source: Hart, Sphere tracing (1996). Where the surface looks flat a step goes beyond the ball, and is taken back if the balls do
not overlap: Keinert et al., Enhanced sphere tracing (2014); Balint and Valasek, Accelerating sphere tracing (2018).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .arguments import positive, refuse_nan
from .errors import ArgumentError, ArgumentTypeError, UnboundedError
from .field import _points
from .solid import Solid

_BATCH = 1 << 16  # rays at once
_TOLERANCE = 1e-8  # of the longest side
_CALLS = 20_000  # of the field, before a ray counts as touching what it runs along
_POINTS, _AHEAD = 2048, 64  # points of a call that few rays share, and steps that one ray looks ahead


def first_hit(
    solid: Solid,
    origins: Any,
    directions: Any,
    max_distance: float = math.inf,
    *,
    slope: float = 1.0,
    tolerance: float | None = None,
) -> np.ndarray:
    """Distance along each ray to where it first meets the solid: (n,) mm, inf for a miss, 0 for a ray that starts inside.

    Args:
        solid: any bounded solid, or an infinite one with a finite `max_distance`.
        origins: (n, 3) mm, or one (3,) for all rays.
        directions: (n, 3) of any length but 0, or one for all rays.
        max_distance: how far to look, mm along the ray.
        slope: how fast the field changes at most, mm a mm. 1 for distances; more makes smaller steps.
        tolerance: a ray hits where the field is at most this, mm; 1e-8 of the longest side of the bounds unless given. Where it
            meets a flat surface at an angle of incidence a, the distance is short by at most tolerance / cos a.

    Raises:
        ArgumentError, ArgumentTypeError: shapes, numbers that are not finite, a direction of length 0, a distance, slope or
            tolerance that is not positive.
        UnboundedError: an infinite solid and no `max_distance`.
        FunctionError: a user function of the field raised or returned NaN.

    Example:
        >>> from frep import sphere
        >>> ball = sphere((0, 0, 0), 5)
        >>> first_hit(ball, [(-10, 0, 0), (-10, 6, 0)], (1, 0, 0)).round(6).tolist()
        [5.0, inf]
    """
    if not isinstance(solid, Solid):
        raise ArgumentTypeError(f"solid: expected a Solid, got {type(solid).__name__}: {solid!r}")
    start, along = _rays(origins, directions)
    far = math.inf if max_distance == math.inf else positive(max_distance, "max_distance")
    steepest = positive(slope, "slope", "")
    if not math.isfinite(far) and not solid.is_bounded:
        raise UnboundedError("solid: has no bounds; intersect it with a bounded one, or give max_distance")
    if tolerance is None:
        longest = float(np.max(solid.bounds[1] - solid.bounds[0])) if solid.is_bounded else far
        close = _TOLERANCE * longest
    else:
        close = positive(tolerance, "tolerance")
    out = np.empty(len(start))
    for first in range(0, len(start), _BATCH):
        batch = slice(first, first + _BATCH)
        low, high = _clipped(solid.bounds, start[batch], along[batch])
        out[batch] = _trace(solid, start[batch], along[batch], low, np.minimum(high, far), steepest, close)
    return out


def _rays(origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray]:
    start, along = _points(origins, "origins")[0], _points(directions, "directions")[0]
    if len(start) != len(along):
        if 1 not in (len(start), len(along)):
            raise ArgumentError(f"directions: expected as many as origins, {len(start)}, or one, got {len(along)}")
        start, along = (np.repeat(a, max(len(start), len(along)), axis=0) if len(a) == 1 else a for a in (start, along))
    for name, array in (("origins", start), ("directions", along)):
        refuse_nan(array, name, "ray")
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if not np.all(length > 0.0):
        raise ArgumentError(f"directions: expected vectors that are not zero, got {along[np.argmin(length)].tolist()}")
    return start, along / length


def _clipped(bounds: np.ndarray, start: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays enter and leave the bounds; low > high if they do not."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (bounds[:, None] - start) / along  # (2, n, 3)
    parallel = along == 0.0
    between = (start >= bounds[0]) & (start <= bounds[1])
    enter = np.where(parallel, np.where(between, -np.inf, np.inf), t.min(axis=0)).max(axis=1)
    leave = np.where(parallel, np.where(between, np.inf, -np.inf), t.max(axis=0)).min(axis=1)
    slack = 1e-12 * (np.abs(start).max(axis=1) + np.abs(np.where(np.isfinite(bounds), bounds, 0.0)).max())
    return np.maximum(enter - slack, 0.0), leave + slack


def _trace(
    solid: Solid, start: np.ndarray, along: np.ndarray, low: np.ndarray, high: np.ndarray, slope: float, close: float
) -> np.ndarray:
    """Distances of hits between `low` and `high` on each ray. All rays still under way take steps at once; few rays look several
    equal steps ahead at a time, because a call costs more than a point."""
    out = np.full(len(start), math.inf)
    alive = np.flatnonzero(low <= high)
    t = low[alive]
    radius = _radius(solid, start[alive] + t[:, None] * along[alive], slope)
    out[alive[radius <= close]] = t[radius <= close]
    going = radius > close
    alive, t, radius = alive[going], t[going], radius[going]
    change = np.full(len(alive), -1.0)  # how the radius changes a mm of the ray; -1: towards a wall
    for _ in range(_CALLS):
        if not len(alive):
            return out
        # The next ball touches this one if the radius goes on changing so; at worst the step is the radius.
        step = np.maximum(2.0 * radius / (1.0 - np.minimum(change, 0.9)), radius)
        ahead = min(max(_POINTS // len(alive), 1), _AHEAD)
        there = t[:, None] + step[:, None] * np.arange(1, ahead + 1)
        points = start[alive][:, None] + there[..., None] * along[alive][:, None]
        balls = np.empty((len(alive), ahead + 1))
        balls[:, 0], balls[:, 1:] = radius, _radius(solid, points.reshape(-1, 3), slope).reshape(there.shape)
        # Balls that overlap leave no room for material between them. Where they do not, or one is of the inside: a safe step.
        clear = (balls[:, 1:] > close) & (step[:, None] <= balls[:, :-1] + balls[:, 1:])
        count = np.where(clear.all(axis=1), ahead, clear.argmin(axis=1))
        hit = (count == 0) & (step <= radius) & (balls[:, 1] <= close) & (there[:, 0] <= high[alive])
        out[alive[hit]] = there[hit, 0]
        over = (count == 0) & (step <= radius)  # a safe step that hits, or that would beyond the end
        each, last = np.arange(len(alive)), np.maximum(count, 1)
        slowed = (balls[each, last] - balls[each, last - 1]) / step
        change = np.where(count == ahead, 0.5 * (change + slowed), -1.0)
        t, radius = t + count * step, balls[each, count]
        going = ~over & (t <= high[alive])
        alive, t, radius, change = alive[going], t[going], radius[going], change[going]
    # Rays that run along the surface this close and this long count as touching it.
    out[alive] = t
    return out


def _radius(solid: Solid, points: np.ndarray, slope: float) -> np.ndarray:
    return solid.field(points) / slope if len(points) else np.zeros(0)
