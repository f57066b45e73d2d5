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
from .evaluate import program, require_finite
from .field import Field
from .progress import progress
from .sampled import BoxSpline, PeriodicSpline

NODES = 64
"""Spline nodes along the shortest period: a cubic spline then keeps within 1e-4 of it of the true distance, away from
the channel centres, where the distance has a crease."""

_FOOT_STEPS = 10
"""At most so many steps to a closest point; one to three do for nearly all."""
_ENOUGH, _NEAR = 1e-6, 4.0
"""How much too long a distance may be for its foot to be left alone, of the spacing; and how many spacings from the surface
this is doubled. It grows with the third power: to a thousandth of a spacing at 40 spacings."""
_SETTLED, _EXACT = 0.3, 0.02
"""Of the spacing: from how far off the surface a Newton step is trusted to find it, and from how far it need not be repeated."""
_SIDE = 0.25
"""Of the spacing: so near to the surface a node's side is told by the normal at its foot, since values at nodes are float32."""
_PASSES = 3
"""How often nodes try the feet of their neighbours."""
_BRICK = 4_000_000
"""Nodes worked on at once: about half a gigabyte."""
_CHUNK = 16_384
"""Nodes whose feet are moved at once, which a processor's cache holds; between two chunks Ctrl-C is heard."""
_MOST_NODES = 10**8
_NO_SURFACE = "surface: the field has no zero set, so there is nothing to thicken"


@dataclass(frozen=True)
class _Nodes:
    """A grid of nodes: `origin + step * (i, j, k)`; a periodic one goes on behind its last node with its first."""

    origin: np.ndarray
    step: np.ndarray
    shape: tuple[int, int, int]
    periodic: bool

    def at(self, index: np.ndarray) -> np.ndarray:
        """(3, n) positions of nodes by their number, the last axis running fastest."""
        ijk = np.unravel_index(index, self.shape)
        return np.stack([o + s * k for o, s, k in zip(self.origin, self.step, ijk, strict=True)])

    def last(self, axis: int, side: int) -> tuple[Any, ...]:
        """The layer that has no neighbour on that side."""
        return (slice(None),) * axis + (-1 if side > 0 else 0,)

    def values(self, field: Field) -> np.ndarray:
        """Float32 values of a field at all nodes, as sampling has them: some nanoseconds each."""
        blocks = [-(-n // 8) for n in self.shape]
        axes = [o + s * np.arange(8 * b) for o, s, b in zip(self.origin, self.step, blocks, strict=True)]
        corners = np.stack(np.meshgrid(*[np.arange(b) for b in blocks], indexing="ij"), -1).reshape(-1, 3)
        out = np.empty((1, len(corners), 512), np.float32)
        program(field).on_blocks(corners.astype(np.int32), (axes[0], axes[1], axes[2]), out)
        whole = out.reshape(*blocks, 8, 8, 8).transpose(0, 3, 1, 4, 2, 5).reshape([8 * b for b in blocks])
        values = np.ascontiguousarray(whole[tuple(slice(0, n) for n in self.shape)])
        # Float32 may have overflown on its way.
        bad = np.flatnonzero(np.isnan(values))
        values.reshape(-1)[bad] = field(self.at(bad).T)
        return values


@lru_cache(maxsize=32)
def periodic_distance(
    field: Field, period: tuple[float, float, float], nodes: tuple[int, int, int] | None = None
) -> Field:
    """The signed distance, in mm, to the zero set of a field of period (a, b, c) mm, as a Field of the same period.

    Costs about a fifth of a second, once for a surface and cell; after that a lookup.

    Args:
        field: of that period.
        period: mm.
        nodes: even numbers of spline nodes along each axis; `NODES` along the shortest and as dense along the others
            unless given.

    Raises:
        ArgumentError: the field has no zero set, or its gradient vanishes on it.
    """
    size = np.array(period)
    a, b, c = (int(2 * round(NODES / 2 * p / size.min())) for p in size)
    shape = nodes or (a, b, c)
    if nodes is None and max(shape) > 8 * NODES:
        raise ArgumentError(f"cell: a period more than 8 times longer than another is not supported, got {period}")
    grid = _Nodes(np.zeros(3), size / shape, shape, True)
    with progress("distance to the surface", total=1) as advance:
        values = grid.values(field)
        _require_numbers(values, grid)
        own = (slice(None),) * 3
        feet = _Feet.of(field, values, grid, own)
        if feet is None:
            raise ArgumentError(_NO_SURFACE)
        distance = feet.distances(np.full(shape, np.inf, np.float32))
        advance(1)
    return PeriodicSpline(size, distance.astype(float), label="distance").field()


def distance_over(field: Field, box: Any, reach: Any, spacing: float | None = None) -> Field:
    """The signed distance, in mm, to the zero set of any smooth field within a box, as a Field.

    Near the surface a spline through exact distances: within 1e-4 of a sphere's radius where the nodes are a tenth of that
    apart; of a gyroid within 4e-4 of the cell for 32 nodes a cell. Two parts of the surface nearer to one
    another than two nodes are seen as none; creases of the distance and edges of the surface are rounded by a spacing or so.
    Costs about a second for a million nodes within reach, once; after that a lookup.

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
        FunctionError: the field is not a number somewhere in the box; names the place.
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
            distance[tuple(slice(*ends) for ends in brick)], some = _brick(field, part, beyond, law, most, (lo, hi))
            found |= some
            advance(1)
    if not found:
        raise ArgumentError(_NO_SURFACE)
    return BoxSpline(origin, np.full(3, step), distance, label="distance").field()


def _brick(
    field: Field, grid: _Nodes, beyond: int, law: Field | None, most: float, box: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, bool]:
    """Distances at the nodes of a grid that are not among its `beyond` outer layers, and whether there was a surface."""
    from scipy.ndimage import maximum_filter

    values = grid.values(field)
    _require_numbers(values, grid, box)
    step = float(grid.step[0])
    far = most + 4.0 * step
    # Feet are moved a little further out than they are wanted: where bricks meet, both have the same neighbours.
    rim = min(_PASSES + 1, beyond)
    own = (slice(beyond - rim, rim - beyond or None),) * 3
    inner = (slice(rim, -rim),) * 3
    feet = _Feet.of(field, values, grid, own)
    if feet is None:
        return np.copysign(np.float32(far), values[own])[inner], False
    limit = np.full(feet.shape, most, np.float32)
    if law is not None:
        asked = feet.grid.values(law)
        # A spline goes by the nodes round a point, and a little by those further off: four spacings are enough.
        limit = maximum_filter(np.where(asked > 0.0, asked, -np.inf), size=9)
    distance = feet.distances(np.where(limit > 0.0, limit + 3.0 * step, -np.inf))
    return np.clip(distance, -far, far)[inner], True


def _require_numbers(values: np.ndarray, grid: _Nodes, box: tuple[np.ndarray, np.ndarray] | None = None) -> None:
    """Raise FunctionError where values are NaN, within a box if one is given."""
    bad = np.flatnonzero(np.isnan(values))
    if not len(bad):
        return
    points = grid.at(bad).T
    if box is not None:
        points = points[np.all((points >= box[0]) & (points <= box[1]), axis=1)]
    require_finite(np.full(len(points), np.nan), points, "surface: the field")


@lru_cache(maxsize=32)
def _derivatives(field: Field) -> tuple[Field, Field, Field]:
    return field.derivatives()


def _value_and_gradient(field: Field, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) and (3, n) at (3, n) points."""
    found = program(field, *_derivatives(field)).at(points.T)
    return found[0], found[1:]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@dataclass
class _Feet:
    """For each node of a part of a grid, a point of the zero set near it, on its way to the closest.

    Attributes:
        field: whose zero set.
        grid: the part's nodes.
        offset: (3, n) float32, from the node to its foot.
        normal: (3, m) unit normals at feet found first.
        source: (n,) which of them is at the node's foot.
        side: (n,) 1 or -1, the sign of the field at the node.
        done: (n,) bool: the foot is the closest point, as far as its own sheet goes.
    """

    field: Field
    grid: _Nodes
    offset: np.ndarray
    normal: np.ndarray
    source: np.ndarray
    side: np.ndarray
    done: np.ndarray

    @property
    def shape(self) -> tuple[int, int, int]:
        return self.grid.shape

    @staticmethod
    def of(field: Field, values: np.ndarray, grid: _Nodes, own: tuple[slice, ...]) -> _Feet | None:
        """Feet for the nodes of a part of a grid; None where there is no zero set.

        Where the zero set crosses a grid edge, both ends of the edge get their closest points; every other node takes the
        point of the nearest node that has one.
        """
        index, start = _crossings(values, grid)
        if not len(index):
            return None
        nodes = grid.at(index)
        step = float(grid.step.min())
        parts = [slice(k, k + _CHUNK) for k in range(0, len(index), _CHUNK)]
        made = [_towards(field, nodes[:, p], start[:, p], np.full(nodes[:, p].shape[1], np.inf), step) for p in parts]
        points, normal, height = (np.concatenate(arrays, axis=-1) for arrays in zip(*made, strict=True))
        away = points - nodes
        # A way there may lead off where the surface crosses itself, or the field jumps.
        found = _dot(away, away) < (2.0 * grid.step.max()) ** 2
        steep = _dot(normal, normal) > 0.0
        if grid.periodic and not np.all(steep[found]):
            raise ArgumentError("surface: the gradient of the field vanishes on its zero set")
        found &= steep
        if not found.any():
            return None
        side = np.copysign(np.float32(1.0), values)
        side.reshape(-1)[index] = _sided(side.reshape(-1)[index], height, away, step)
        index, away, normal = index[found], away[:, found].astype(np.float32), normal[:, found]
        part, way, nearest = _nearest(index, grid, own)
        side = side[own].reshape(-1)
        offset = np.empty((3, side.size), np.float32)
        for a in range(3):
            offset[a] = away[a][nearest] + way[a]
        return _Feet(field, part, offset, normal, nearest, side, np.abs(way).max(axis=0) == 0.0)

    def distances(self, limit: np.ndarray) -> np.ndarray:
        """The signed distance at each node that is nearer than its limit; elsewhere that to a point near the closest one.

        When its foot has come to rest each node tries those of its neighbours, in case it has been following a sheet that
        is not the nearest.
        """
        limit = limit.reshape(-1)
        limit = np.square(np.maximum(limit, 0.0))
        going = np.flatnonzero(~self.done & (_dot(self.offset, self.offset) < limit))
        # First to the place on the tangent plane at the foot that is below the node.
        normal = self.normal[:, self.source[going]]
        self._move(going, _dot(self.offset[:, going], normal) * normal)
        for _ in range(_PASSES):
            going = self._from_neighbours()
            going = going[_dot(self.offset[:, going], self.offset[:, going]) < limit[going]]
            if not len(going):
                break
            self._move(going, self.offset[:, going])
        return (self.side * np.sqrt(_dot(self.offset, self.offset))).reshape(self.shape)

    def _move(self, index: np.ndarray, way: np.ndarray) -> None:
        """Feet of nodes brought to the closest points; `way`, (3, n): from the nodes to where to look first."""
        step = float(self.grid.step.min())
        for k in range(0, len(index), _CHUNK):
            own = index[k : k + _CHUNK]
            nodes, offset = self.grid.at(own), self.offset[:, own]
            best = _dot(offset, offset).astype(float)
            feet, _, height = _towards(self.field, nodes, nodes + way[:, k : k + _CHUNK], best, step)
            away = feet - nodes
            found = np.isfinite(height)
            self.offset[:, own[found]] = away[:, found]
            self.side[own] = _sided(self.side[own], height, away, step)

    def _from_neighbours(self) -> np.ndarray:
        """Gives each node the nearest of its own foot and those of its six neighbours; returns who took another's."""
        offset = self.offset.reshape(3, *self.shape)
        squared = _dot(offset, offset)
        # Nearer by less is the same foot, not quite at rest.
        best = np.maximum(np.sqrt(squared) - np.float32(1e-3 * self.grid.step.min()), 0.0) ** 2
        choice = np.zeros(self.shape, np.int8)
        for axis in range(3):
            s = np.float32(self.grid.step[axis])
            for side in (1, -1):
                # The neighbour's foot as seen from here is one spacing further along the axis: |e + o|^2 = e^2 + 2 e.o + o^2.
                trial = np.roll(squared + (2.0 * side * s) * offset[axis] + s * s, -side, axis)
                nearer = trial < best
                if not self.grid.periodic:
                    nearer[self.grid.last(axis, side)] = False
                best[nearer] = trial[nearer]
                choice[nearer] = side * (axis + 1)
        changed = np.flatnonzero(choice)
        taken = self.offset[:, changed]
        for axis in range(3):
            for side in (1, -1):
                here = np.flatnonzero(choice.reshape(-1)[changed] == side * (axis + 1))
                at = np.unravel_index(changed[here], self.shape)
                there = list(at)
                there[axis] = (at[axis] + side) % self.shape[axis]
                taken[:, here] = self.offset[:, np.ravel_multi_index(tuple(there), self.shape)]
                taken[axis, here] += np.float32(side * self.grid.step[axis])
        self.offset[:, changed] = taken
        return changed


def _sided(side: np.ndarray, height: np.ndarray, away: np.ndarray, step: float) -> np.ndarray:
    """The side of nodes, by the height over the tangent plane at their feet where they are near."""
    distance = np.sqrt(_dot(away, away))
    told = (distance < _SIDE * step) & (np.abs(height) > 0.5 * distance)
    return np.where(told, np.sign(height), side).astype(np.float32)


def _crossings(values: np.ndarray, grid: _Nodes) -> tuple[np.ndarray, np.ndarray]:
    """(m,) the nodes that have an edge on which the field changes its sign, and (3, m) the nearest such place, by the values
    at its ends."""
    inside = values < 0
    nearest = np.full(values.size, np.inf, np.float32)
    along = np.zeros(values.size, np.float32)
    axes = np.zeros(values.size, np.int8)
    for axis in range(3):
        crossed = inside != np.roll(inside, -1, axis)
        if not grid.periodic:
            crossed[grid.last(axis, 1)] = False
        own = np.flatnonzero(crossed)
        at = list(np.unravel_index(own, grid.shape))
        at[axis] = (at[axis] + 1) % grid.shape[axis]
        following = np.ravel_multi_index(tuple(at), grid.shape)
        one, other = values.reshape(-1)[own].astype(float), values.reshape(-1)[following].astype(float)
        with np.errstate(invalid="ignore"):
            share = np.nan_to_num(one / (one - other), nan=0.5).clip(0.0, 1.0)
        for index, part in ((own, share), (following, share - 1.0)):
            length = (part * grid.step[axis]).astype(np.float32)
            nearer = np.abs(length) < nearest[index]
            index, length = index[nearer], length[nearer]
            nearest[index], along[index], axes[index] = np.abs(length), length, axis
    index = np.flatnonzero(np.isfinite(nearest))
    points = grid.at(index)
    points[axes[index], np.arange(len(index))] += along[index]
    return index, points


def _nearest(index: np.ndarray, grid: _Nodes, own: tuple[slice, ...]) -> tuple[_Nodes, np.ndarray, np.ndarray]:
    """For the nodes of a part of a grid the nearest of those listed: the part's grid, (3, n) the way there, mm, (n,) which."""
    free = np.ones(grid.shape, bool)
    free.reshape(-1)[index] = False
    number = np.zeros(grid.shape, np.int32)
    number.reshape(-1)[index] = np.arange(len(index))
    own = tuple(slice(*s.indices(n)[:2]) for s, n in zip(own, grid.shape, strict=True))
    first = [s.start for s in own]
    x, y, z = (s.stop - s.start for s in own)
    part = _Nodes(grid.origin + grid.step * first, grid.step, (x, y, z), grid.periodic)
    if grid.periodic:
        # A period goes on for a quarter of itself on all sides; for half, where something is so far away.
        pad = [n // 4 for n in grid.shape]
        way, there = _transformed(free, grid, own, pad)
        if np.sqrt(_dot(way, way).max()) > (grid.step * pad).min():
            way, there = _transformed(free, grid, own, [n // 2 for n in grid.shape])
    else:
        way, there = _transformed(free, grid, own, [0, 0, 0])
    return part, way.reshape(3, -1), number[there].reshape(-1)


def _transformed(
    free: np.ndarray, grid: _Nodes, own: tuple[slice, ...], pad: list[int]
) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """The way, mm, from each node of a part of a grid to the nearest that is not free, and where that is in the period (scipy's
    distance transform); the grid goes on as its period does for so many nodes."""
    from scipy.ndimage import distance_transform_edt

    found = np.asarray(
        distance_transform_edt(
            np.pad(free, [(p, p) for p in pad], mode="wrap"),
            sampling=grid.step,
            return_distances=False,
            return_indices=True,
        )
    )
    window = tuple(slice(s.start + p, s.stop + p) for s, p in zip(own, pad, strict=True))
    way, there = np.empty((3, *(s.stop - s.start for s in own)), np.float32), []
    for axis, (s, p, n) in enumerate(zip(own, pad, grid.shape, strict=True)):
        at = found[axis][window] - p
        here = np.arange(s.start, s.stop).reshape([-1 if k == axis else 1 for k in range(3)])
        way[axis] = (at - here) * grid.step[axis]
        there.append(np.mod(at, n))
    return way, tuple(there)


def _towards(
    field: Field, nodes: np.ndarray, place: np.ndarray, best: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The closest points of the zero set to (3, n) nodes, from places that are near them.

    A step brings the present point back to the surface by Newton's rule, and moves it along the tangent plane to below the node
    (Chopp 2001, SIAM J. Sci. Comput. 23, 230). How far, after the first: as far as the last step says that the surface's
    curvature wants it (Barzilai and Borwein 1988). A point rests where what is left of the way along the plane could shorten
    the distance by no more than a thousandth of a spacing.

    Args:
        best: (n,) squares of distances; what is not nearer is not taken.

    Returns:
        (3, n) the nearest points met that are on the surface, (3, n) unit normals there, and (n,) the node's height over the
        tangent plane, NaN where none was near enough.
    """
    found, normal, height = place.copy(), np.zeros_like(place), np.full(len(best), np.nan)
    best, going, at = best.copy(), np.arange(len(best)), nodes
    last: tuple[np.ndarray, np.ndarray] | None = None
    for _ in range(_FOOT_STEPS):
        value, gradient = _value_and_gradient(field, place)
        squared = np.maximum(_dot(gradient, gradient), 1e-300)
        slope = value / squared
        trial, off = place - slope * gradient, slope * value
        unit = gradient / np.sqrt(squared)
        ray = at - trial
        above = _dot(ray, unit)
        along = ray - above * unit
        distance = _dot(ray, ray)
        better = (off < (_SETTLED * step) ** 2) & (distance < best[going])
        taken = going[better]
        found[:, taken], normal[:, taken] = trial[:, better], unit[:, better]
        best[taken], height[taken] = distance[better], above[better]
        pace = np.ones(len(going))
        if last is not None:
            moved, change = trial - last[0], last[1] - along
            turned = _dot(moved, change)
            pace = np.where(
                turned > 0.0, np.clip(_dot(moved, moved) / np.where(turned > 0.0, turned, 1.0), 0.5, 4.0), 1.0
            )
        far = np.sqrt(distance)
        rest = pace * _dot(along, along) < 2.0 * far * _ENOUGH * step * (1.0 + (far / (_NEAR * step)) ** 3)
        on = ~(rest & (off < (_EXACT * step) ** 2)) & (far < np.sqrt(best[going]) + step)
        if not on.any():
            break
        going, at, last = going[on], at[:, on], (trial[:, on], along[:, on])
        place = last[0] + pace[on] * last[1]
    return found, normal, height
