"""Primitive solids with exact signed distances, in mm."""

from __future__ import annotations

import math

import numpy as np

from .arguments import direction, positive, vector
from .errors import ArgumentError
from .field import Field, coordinates
from .functions import hypot, maximum, maximum_of, minimum, sqrt, square, where
from .solid import Solid


def _corners(lo, hi) -> tuple[np.ndarray, np.ndarray]:
    low, high = vector(lo, "lo"), vector(hi, "hi")
    if not np.all(low < high):
        raise ArgumentError(f"lo, hi: every coordinate of lo must be below that of hi, got lo={lo!r}, hi={hi!r}")
    return low, high


def _length(parts: list[Field]) -> Field:
    total = square(parts[0])
    for part in parts[1:]:
        total = total + square(part)
    return sqrt(total)


def box_distance(lo: np.ndarray, hi: np.ndarray) -> Field:
    """Exact signed distance to an axis-aligned box; sides at infinity are allowed and left out."""
    sides = []
    for axis, c in enumerate(coordinates()):
        if np.isfinite(lo[axis]) and np.isfinite(hi[axis]):
            sides.append(abs(c - 0.5 * (lo[axis] + hi[axis])) - 0.5 * (hi[axis] - lo[axis]))
        elif np.isfinite(lo[axis]):
            sides.append(lo[axis] - c)
        elif np.isfinite(hi[axis]):
            sides.append(c - hi[axis])
    if len(sides) == 1:
        return sides[0]
    return _length([maximum(q, 0.0) for q in sides]) + minimum(maximum_of(sides), 0.0)


def box(lo, hi) -> Solid:
    """The axis-aligned box from corner `lo` to corner `hi`, mm.

    Raises:
        ArgumentError: a coordinate of `lo` is not below that of `hi`, or not finite.

    Example:
        >>> float(box((0, 0, 0), (2, 2, 2)).field([1, 1, 3]))
        1.0
    """
    low, high = _corners(lo, hi)
    return Solid._make(box_distance(low, high), np.array([low, high]), label="box", is_box=True)


def rounded_box(lo, hi, radius) -> Solid:
    """A box from `lo` to `hi` whose edges and corners are rounded by `radius` mm (at most half the shortest side)."""
    low, high = _corners(lo, hi)
    r = positive(radius, "radius")
    if r > 0.5 * (high - low).min():
        raise ArgumentError(
            f"radius: expected at most half the shortest side ({0.5 * (high - low).min():g} mm), got {r:g}"
        )
    return Solid._make(box_distance(low + r, high - r) - r, np.array([low, high]), label="rounded_box")


def sphere(center, radius) -> Solid:
    """The ball round `center` with `radius` mm.

    Example:
        >>> float(sphere((0, 0, 0), 2).field([0, 0, 5]))
        3.0
    """
    c, r = vector(center, "center"), positive(radius, "radius")
    x, y, z = coordinates()
    return Solid._make(_length([x - c[0], y - c[1], z - c[2]]) - r, np.array([c - r, c + r]), label="sphere")


def half_space(normal, point=(0.0, 0.0, 0.0)) -> Solid:
    """Everything behind the plane through `point` whose outward `normal` is given, a vector or "x", "y", "z". Infinite."""
    n, p = direction(normal, "normal"), vector(point, "point")
    x, y, z = coordinates()
    bounds = np.array([[-np.inf] * 3, [np.inf] * 3])
    axis = int(np.argmax(np.abs(n)))
    if abs(n[axis]) == 1.0:
        bounds[1 if n[axis] > 0 else 0, axis] = p[axis]
    field = n[0] * (x - p[0]) + n[1] * (y - p[1]) + n[2] * (z - p[2])
    return Solid._make(field, bounds, label="half_space")


def _axis_frame(start, end) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    a, b = vector(start, "start"), vector(end, "end")
    length = float(np.linalg.norm(b - a))
    if length == 0.0:
        raise ArgumentError(f"start, end: expected two different points, got {start!r} twice")
    return a, b, (b - a) / length, length


def _axial(a: np.ndarray, u: np.ndarray) -> tuple[Field, Field]:
    """Distance along the axis from `a`, and distance from the axis."""
    p = [c - a[i] for i, c in enumerate(coordinates())]
    on_axis = [i for i in range(3) if abs(u[i]) == 1.0]
    if on_axis:
        i = on_axis[0]
        return u[i] * p[i], hypot(p[(i + 1) % 3], p[(i + 2) % 3])
    t = u[0] * p[0] + u[1] * p[1] + u[2] * p[2]
    return t, _length([p[i] - u[i] * t for i in range(3)])


def _disc_bounds(a, b, u, ra: float, rb: float) -> np.ndarray:
    reach = np.sqrt(np.maximum(1.0 - u * u, 0.0))
    return np.array([np.minimum(a - ra * reach, b - rb * reach), np.maximum(a + ra * reach, b + rb * reach)])


def cylinder(start, end, radius) -> Solid:
    """The cylinder with flat ends from `start` to `end` with `radius`, mm."""
    a, b, u, length = _axis_frame(start, end)
    r = positive(radius, "radius")
    t, radial = _axial(a, u)
    side, cap = radial - r, abs(t - 0.5 * length) - 0.5 * length
    field = hypot(maximum(side, 0.0), maximum(cap, 0.0)) + minimum(maximum(side, cap), 0.0)
    return Solid._make(field, _disc_bounds(a, b, u, r, r), label="cylinder")


def cone(start, end, start_radius, end_radius=0.0) -> Solid:
    """The cone frustum with flat ends, `start_radius` at `start` and `end_radius` (may be 0) at `end`, mm."""
    a, b, u, length = _axis_frame(start, end)
    ra = positive(start_radius, "start_radius")
    rb = 0.0 if isinstance(end_radius, int | float) and end_radius == 0 else positive(end_radius, "end_radius")
    t, radial = _axial(a, u)
    # Half plane (radial, t): distance to the two cap segments and to the slanted side, sign by the half planes.
    cap_radius = where(t < 0.5 * length, ra, rb)
    cap = hypot(maximum(radial - cap_radius, 0.0), abs(t - 0.5 * length) - 0.5 * length)
    dr, slant = rb - ra, math.hypot(rb - ra, length)
    along = ((radial - ra) * dr + t * length) / slant**2
    foot = minimum(maximum(along, 0.0), 1.0)
    side = hypot(radial - ra - foot * dr, t - foot * length)
    outward = ((radial - ra) * length - t * dr) / slant
    inside = maximum(outward, abs(t - 0.5 * length) - 0.5 * length) < 0.0
    distance = minimum(cap, side)
    return Solid._make(where(inside, -distance, distance), _disc_bounds(a, b, u, ra, rb), label="cone")


def capsule(start, end, radius) -> Solid:
    """All points within `radius` mm of the segment from `start` to `end`."""
    a, b, u, length = _axis_frame(start, end)
    r = positive(radius, "radius")
    t, radial = _axial(a, u)
    past = maximum(abs(t - 0.5 * length) - 0.5 * length, 0.0)
    return Solid._make(hypot(radial, past) - r, np.array([np.minimum(a, b) - r, np.maximum(a, b) + r]), label="capsule")


def torus(center, axis, major_radius, minor_radius) -> Solid:
    """The torus round `center` whose tube of `minor_radius` follows a circle of `major_radius` across `axis`, mm.

    The axis is a vector or "x", "y", "z".
    """
    c, u = vector(center, "center"), direction(axis, "axis")
    big, small = positive(major_radius, "major_radius"), positive(minor_radius, "minor_radius")
    t, radial = _axial(c, u)
    reach = big * np.sqrt(np.maximum(1.0 - u * u, 0.0)) + small
    return Solid._make(hypot(radial - big, t) - small, np.array([c - reach, c + reach]), label="torus")
