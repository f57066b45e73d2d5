"""Steady maps: a point carried by real powers of two or three similarities, and lattices rectified along them.

`M(u, v) = V^v U^u P` is a surface, `M(u, v, w) = W^w V^v U^u P` fills space; U acts first, and the similarities need
not commute. Their iso-curves along the last parameter are similar to each other; all are helices or conchospirals. A
regular lattice is not warped by such a map (its balls would be balls no more): the balls of one cell are *rectified*,
replaced by true balls, and carried on by the similarities themselves, which keep balls round.

Promised: the control points and frames are met to rounding. Not promised: a map without folds, or a rectified ball that
suits every design; a strongly warped ball has no best one, and the answer is there to be edited.

Source: Constructive Lattice Geometry, 2.6.2 to 2.6.6 and chapter 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from frep.arguments import finite, positive, real, vector
from frep.errors import ArgumentError, ArgumentTypeError, FunctionError
from frep.similarity import Similarity, planar

_FLAT = 0.01  # images thinner than this part of their width determine no ball worth having
_BATCH = 1 << 15  # points whose matrices are held at a time: 4 MB each for u, v and w

_TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) / math.sqrt(3)


@dataclass(frozen=True, eq=False)
class SteadyMap:
    """`M(u, v, w) = W^w V^v U^u P`, of two similarities (a surface) or three (a volume).

    Args:
        u, v, w: what one unit of each parameter does; without `w` the map is a surface.
        origin: (3,) mm, P = M(0, 0).

    Raises:
        ArgumentTypeError, ArgumentError: not similarities; an origin that is not three finite numbers.

    Example:
        >>> from frep.similarity import Screw, Translation
        >>> vault = SteadyMap(Translation((0, 0, 5)), Screw(math.pi), origin=(10, 0, 0))
        >>> vault.apply([(0, 0), (1, 0.5)]).round(9).tolist()
        [[10.0, 0.0, 0.0], [0.0, 10.0, 5.0]]
    """

    u: Similarity
    v: Similarity
    w: Similarity | None = None
    origin: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("u", "v", "w"):
            given = getattr(self, name)
            if not isinstance(given, Similarity) and not (name == "w" and given is None):
                raise ArgumentTypeError(f"{name}: expected a Similarity, got {given!r}")
        origin = vector(self.origin, "origin").copy()
        origin.setflags(write=False)
        object.__setattr__(self, "origin", origin)

    @classmethod
    def from_five_points(cls, *, a: Any, b: Any, c: Any, d: Any, e: Any, w: Similarity | None = None) -> SteadyMap:
        """The map of the xy-plane with M(0,0) = a, M(1,0) = b, M(0,1) = c, M(1,1) = d and M(1/2, 0) = e.

        Points are (x, y), mm. The side from a through e to b may bend by up to a full turn. `w` makes the surface a
        volume, for instance `Translation((0, 0, height))`.

        Raises:
            ArgumentError, ArgumentTypeError: not five finite points of the plane; a = e, e = b, a = b or c = d.

        Source: Constructive Lattice Geometry, 2.6.5; corners as there, which COTS maps name otherwise.
        """
        points = {name: _plane_point(p, name) for name, p in zip("abcde", (a, b, c, d, e), strict=True)}
        for one, other in ("ae", "eb", "ab", "cd"):
            if np.array_equal(points[one], points[other]):
                raise ArgumentError(
                    f"{one}, {other}: expected two distinct points, got {tuple(points[one].tolist())} for both"
                )
        a, b, c, d, e = points.values()
        half = planar((a, e), (e, b))
        return cls(half.power(2.0), planar((a, b), (c, d)), w, (*a, 0.0))  # power: the angle stays unwrapped

    @classmethod
    def from_frames(cls, a: Any, b: Any, c: Any, d: Any = None) -> SteadyMap:
        """The map that starts at the origin of frame `a`, U taking `a` to `b`, V `a` to `c` and W, if given, `a` to
        `d`.

        So M(1,0) and M(0,1) are the origins of `b` and `c`. Frames are those of `Similarity.from_frames`.

        Raises:
            ArgumentError, ArgumentTypeError: the frame named is not one.

        Source: Constructive Lattice Geometry, 2.6.6.
        """
        frames = {"a": a, "b": b, "c": c} if d is None else {"a": a, "b": b, "c": c, "d": d}
        for name, frame in frames.items():
            try:
                Similarity.from_frames(frame, frame)
            except (ArgumentError, ArgumentTypeError) as error:
                raise type(error)(f"{name}: {str(error).partition(': ')[2]}") from None
        start = np.asarray(a, dtype=float)
        origin = start[0] if start.shape == (3, 3) else start[:3, 3]
        w = None if d is None else Similarity.from_frames(a, d)
        return cls(Similarity.from_frames(a, b), Similarity.from_frames(a, c), w, origin)

    @property
    def dimension(self) -> int:
        """2 for a surface, 3 for a volume: how many parameters a point has."""
        return 2 if self.w is None else 3

    def at(self, u: float = 0.0, v: float = 0.0, w: float = 0.0) -> Similarity:
        """The similarity `W^w V^v U^u`, which carries whatever stands at the origin of the map.

        Raises:
            ArgumentError, ArgumentTypeError: parameters that are not finite numbers; `w` of a surface.
        """
        carried = self.v.power(real(v, "v", "1")) @ self.u.power(real(u, "u", "1"))
        if self.w is not None:
            return self.w.power(real(w, "w", "1")) @ carried
        if w != 0.0:
            raise ArgumentError(f"w: this map has u and v only, got w = {w!r}")
        return carried

    def apply(self, parameters: Any) -> np.ndarray:
        """The points M(u, v) or M(u, v, w), mm, of `parameters` (n, 2) or (n, 3), as (n, 3); of one point as (3,).

        Raises:
            ArgumentError, ArgumentTypeError: parameters of another shape than the map's `dimension` asks for, or not
                finite.
        """
        given = finite(parameters, "parameters")
        if given.ndim not in (1, 2) or given.shape[-1] != self.dimension:
            n = self.dimension
            raise ArgumentError(f"parameters: expected an array of shape (n, {n}) or ({n},), got shape {given.shape}")
        rows = np.atleast_2d(given)
        points = np.tile(self.origin, (len(rows), 1))
        steps = [step for step in (self.u, self.v, self.w) if step is not None]
        for first in range(0, len(rows), _BATCH):
            batch = slice(first, first + _BATCH)
            for step, exponents in zip(steps, rows[batch].T, strict=True):
                m = step.powers(exponents)
                points[batch] = np.einsum("nij,nj->ni", m[:, :3, :3], points[batch]) + m[:, :3, 3]
        return points.reshape(*given.shape[:-1], 3)

    def iso_curve(
        self, along: Literal["u", "v", "w"], *, u: float = 0.0, v: float = 0.0, w: float = 0.0, count: int = 65
    ) -> np.ndarray:
        """(count, 3) mm: the polyline on which `along` runs from 0 to 1 and the other parameters keep the values given.

        Raises:
            ArgumentError, ArgumentTypeError: `along` is no parameter of the map; a count below 2; values not finite.
        """
        names = ("u", "v", "w")[: self.dimension]
        if along not in names:
            raise ArgumentError(f"along: expected one of {', '.join(names)}, got {along!r}")
        _at_least(count, 2, "count")
        fixed = {"u": real(u, "u", "1"), "v": real(v, "v", "1"), "w": real(w, "w", "1")}
        if "w" not in names and fixed["w"] != 0.0:
            raise ArgumentError(f"w: this map has u and v only, got w = {w!r}")
        parameters = np.tile([fixed[name] for name in names], (count, 1))
        parameters[:, names.index(along)] = np.linspace(0.0, 1.0, count)
        return self.apply(parameters)

    def steps(self, counts: Any) -> tuple[Similarity, ...]:
        """`U^(1/nu), V^(1/nv)[, W^(1/nw)]`: what carries one cell of `counts` to the next.

        Raises:
            ArgumentError, ArgumentTypeError: not one whole number of 1 or more for each parameter.
        """
        steps = [step for step in (self.u, self.v, self.w) if step is not None]
        return tuple(step.power(1.0 / n) for step, n in zip(steps, self._counts(counts), strict=True))

    def _counts(self, counts: Any) -> tuple[int, ...]:
        try:
            given = tuple(counts)
        except TypeError:
            raise ArgumentTypeError(f"counts: expected {self.dimension} whole numbers, got {counts!r}") from None
        if len(given) != self.dimension:
            raise ArgumentError(f"counts: expected {self.dimension} whole numbers, got {counts!r}")
        for count in given:
            _at_least(count, 1, "counts")
        return tuple(int(count) for count in given)


def rectify(
    warp: SteadyMap | Callable[[np.ndarray], Any], center: Any, radius: float, *, samples: int = 4
) -> tuple[np.ndarray, float]:
    """The ball for the image of a ball under a map: the sphere through the images of four equally spaced points of it.

    A `center` (2,) is that of a disk, for maps of two parameters; the answer is then the ball with the circle that
    fits the images best as its equator.

    Args:
        warp: a SteadyMap, or a function of an (n, 3) (or (n, 2)) array that returns (n, 3) points, mm.
        center, radius: the ball (3,) or disk (2,), in the parameters of the map.
        samples: more than 4 spreads that many points evenly and fits the sphere by least squares.

    Returns:
        center, radius: (3,) and a number, mm.

    Raises:
        ArgumentError, ArgumentTypeError: a radius not above 0, a center of another length, fewer than 4 samples;
            images that lie in a plane (of a disk: on a line), or within 1 % of their width of one, through which only
            huge spheres pass.
        FunctionError: `warp` returns another shape, or values that are not finite.

    Source: Constructive Lattice Geometry, 3.4.

    Example:
        >>> from frep.similarity import Swirl
        >>> center, radius = rectify(Swirl(2.0).apply, (1, 2, 3), 0.25)
        >>> center.round(9).tolist(), round(radius, 9)
        ([2.0, 4.0, 6.0], 0.5)
    """
    at, radius = finite(center, "center"), positive(radius, "radius", "")
    if at.shape not in ((2,), (3,)):
        raise ArgumentError(f"center: expected two or three numbers, got {center!r}")
    _at_least(samples, 4, "samples")
    images = _images(warp, at + radius * _spread(samples, len(at)))
    return _ball_through(images, len(at), f"center {tuple(at.tolist())}, radius {radius:g}")


@dataclass(frozen=True, eq=False)
class SteadyTemplate:
    """The cell of a steady lattice: what `topologies.steady.SteadyLattice` takes, racks apart.

    Attributes: nodes (n, 3) mm and radii (n,) mm of cluster (0, 0, 0); u, v, w: from one cluster to the next; counts.
    """

    nodes: np.ndarray
    radii: np.ndarray
    u: Similarity
    v: Similarity
    w: Similarity
    counts: tuple[int, int, int]


def steady_template(warp: SteadyMap, nodes: Any, radii: Any, counts: Any, *, samples: int = 4) -> SteadyTemplate:
    """A regular lattice along a steady map: the balls of its unit cell rectified, and the steps between clusters.

    Args:
        nodes: (n, 3) in the unit cell of a volume; (n, 2) of a surface, whose lattice has counts (nu, nv, 1) then.
        radii: (n,), or one number for all, in units of the cell.
        counts: cells along each parameter; the map's 0 to 1 holds all of them.
        samples: as for `rectify`.

    Raises:
        ArgumentError, ArgumentTypeError: wrong shapes or counts, radii not above 0; a node whose image is flat.

    Source: Constructive Lattice Geometry, 3.1 to 3.4: `N[i,j] = V^j U^i N[0,0]`.

    Example:
        >>> from frep.similarity import Translation
        >>> box = SteadyMap(Translation((40, 0, 0)), Translation((0, 20, 0)), Translation((0, 0, 10)))
        >>> cell = steady_template(box, [(0.2, 0.2, 0.2), (0.5, 0.5, 0.5)], 0.1, (8, 4, 2))
        >>> cell.nodes.round(9).tolist(), cell.radii.round(9).tolist()
        ([[1.0, 1.0, 1.0], [2.5, 2.5, 2.5]], [0.5, 0.5])
        >>> cell.u.translation.tolist()
        [5.0, 0.0, 0.0]
    """
    if not isinstance(warp, SteadyMap):
        raise ArgumentTypeError(f"warp: expected a SteadyMap, got {warp!r}")
    cells = np.array(warp._counts(counts), dtype=float)
    places = finite(nodes, "nodes")
    n = warp.dimension
    if places.ndim != 2 or places.shape[1] != n or len(places) == 0:
        raise ArgumentError(f"nodes: expected an array of shape (n, {n}), got shape {places.shape}")
    sizes = finite(radii, "radii")
    if sizes.shape not in ((), (len(places),)):
        raise ArgumentError(f"radii: expected one number, or one for each of {len(places)} nodes, got {radii!r}")
    sizes = np.broadcast_to(sizes, (len(places),))
    if not sizes.min() > 0.0:
        raise ArgumentError(f"radii: expected numbers > 0, got {float(sizes.min()):g}")
    balls = [
        rectify(lambda p: warp.apply(p / cells), place, float(size), samples=samples)
        for place, size in zip(places, sizes, strict=True)
    ]
    u, v, *w = warp.steps(counts)
    nu, nv, *nw = (int(count) for count in cells)
    return SteadyTemplate(
        nodes=np.array([center for center, _ in balls]),
        radii=np.array([radius for _, radius in balls]),
        u=u,
        v=v,
        w=w[0] if w else Similarity.identity(),
        counts=(nu, nv, nw[0] if nw else 1),
    )


def _spread(count: int, dimension: int) -> np.ndarray:
    """`count` evenly spread points of the unit circle or sphere."""
    if dimension == 2:
        turns = 2.0 * math.pi * np.arange(count) / count
        return np.stack((np.cos(turns), np.sin(turns)), axis=1)
    if count == 4:
        return _TETRAHEDRON
    heights = 1.0 - (2.0 * np.arange(count) + 1.0) / count  # a Fibonacci spiral
    turns = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - heights**2)
    return np.stack((across * np.cos(turns), across * np.sin(turns), heights), axis=1)


def _images(warp: SteadyMap | Callable[[np.ndarray], Any], points: np.ndarray) -> np.ndarray:
    if isinstance(warp, SteadyMap):
        return warp.apply(points)
    if not callable(warp):
        raise ArgumentTypeError(f"warp: expected a SteadyMap or a function, got {warp!r}")
    images = np.asarray(warp(points), dtype=float)
    if images.shape != (len(points), 3) or not np.all(np.isfinite(images)):
        raise FunctionError(
            f"warp: expected ({len(points)}, 3) finite numbers back for {points.shape}, got shape {images.shape}"
            + ("" if np.all(np.isfinite(images)) else " with values that are not finite")
        )
    return images


def _ball_through(points: np.ndarray, dimension: int, of: str) -> tuple[np.ndarray, float]:
    """The sphere (dimension 3) or the equator (2) nearest to `points` in algebraic distance; through four exactly."""
    middle = points.mean(axis=0)
    _, widths, axes = np.linalg.svd(points - middle, full_matrices=False)
    if not widths[dimension - 1] > _FLAT * widths[0]:
        flat = "coplanar" if dimension == 3 else "collinear"
        raise ArgumentError(
            f"warp: the images of the node ({of}) are nearly {flat}: their thickness is "
            f"{widths[dimension - 1] / widths[0] if widths[0] else 0.0:.2g} of their width, and {_FLAT:g} is the least from "
            "which a ball follows; change the node or the map there, or give the ball yourself"
        )
    local = (points - middle) @ axes[:dimension].T / widths[0]
    # |x - c|^2 = r^2 is linear in c and k = r^2 - |c|^2
    rows = np.column_stack((2.0 * local, np.ones(len(local))))
    found = np.linalg.lstsq(rows, (local**2).sum(axis=1), rcond=None)[0]
    c, k = found[:-1], found[-1]
    return middle + widths[0] * (c @ axes[:dimension]), float(widths[0] * math.sqrt(k + c @ c))


def _plane_point(value: Any, name: str) -> np.ndarray:
    point = finite(value, name)
    if point.shape != (2,):
        raise ArgumentError(f"{name}: expected a point (x, y), got {value!r}")
    return point


def _at_least(value: Any, least: int, name: str) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ArgumentTypeError(f"{name}: expected whole numbers of {least} or more, got {value!r}")
    if value < least:
        raise ArgumentError(f"{name}: expected whole numbers of {least} or more, got {value!r}")
