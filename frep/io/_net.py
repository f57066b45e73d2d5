"""The surface of a hub, in closed form: which part of each cone, cylinder and of the ball shows, and the curves between.

A hub is a node ball with the half beams that end in it. All its beams touch one ball of radius `radius` at the node, so
two of them meet in a plane (Monge): with h(x) = (x.u - radius s) / c, for a beam along u whose radius falls by s a mm
and c = sqrt(1 - s^2), the beam is |x|^2 - radius^2 <= h^2 where h >= 0, and of several the one of the largest h shows.
A larger ball of radius `ball` shows where every h is below H = sqrt(ball^2 - radius^2). So all edges are arcs of
ellipses and circles, and nothing is left for an intersection algorithm to get wrong (steady-and-clg 2.1.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from frep.io import _brep

Array = npt.NDArray[np.float64]
Step = tuple[int, bool]
"""An arc by number, and whether it is run along from its start to its end."""

_SAME = 2e-6
"""Points nearer than this share of the ball's radius are one."""

_BALL = -1
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


class NotAHubError(Exception):
    """The half beams reach too far into each other; only an intersection algorithm can unite them."""


@dataclass(frozen=True)
class Hub:
    """A node at the origin.

    Attributes:
        radius: of the ball that all beams touch, mm.
        ball: radius of the node's own ball, no less.
        along: (k, 3) unit vectors of the beams, away from the node.
        sines: (k,) by how much a radius falls a mm along the axis, of the hull of two balls; below 1 in size.
        seams: (k, 3) unit vectors across the beams, where they are halved.
        cuts: (k,) mm along the axis, where the half beams end.
    """

    radius: float
    ball: float
    along: Array
    sines: Array
    seams: Array
    cuts: Array

    def contains(self, points: Array) -> npt.NDArray[np.bool_]:
        """Which of (n, 3) points, about the node, lie in it."""
        cosines = np.sqrt(1.0 - self.sines**2)
        along = points @ self.along.T
        heights = (along - self.radius * self.sines) / cosines
        size = np.einsum("ij,ij->i", points, points)
        beams = (heights >= 0.0) & (along <= self.cuts) & (size[:, None] - self.radius**2 <= heights**2)
        return beams.any(axis=1) | (size <= self.ball**2)


@dataclass(frozen=True)
class Arc:
    """A piece of an ellipse: center + a cos(t) x + b sin(t) y, t from `first` to `last`, between two points."""

    ends: tuple[int, int]
    middle: Array
    center: Array
    x: Array
    y: Array
    a: float
    b: float
    first: float
    last: float


@dataclass
class Net:
    """What shows of a hub.

    Attributes:
        points: vertices, about the node.
        arcs: edges between them.
        chains: of each beam the two half turns of the curve where it begins, from its seam on, right-handed about `along`.
        patches: pieces of the ball: a loop of arcs, anticlockwise from outside; the pole and the side of a
            parametrisation whose poles and seam lie outside.
        volume: of the hub, mm3.
    """

    points: list[Array] = field(default_factory=list)
    arcs: list[Arc] = field(default_factory=list)
    chains: list[tuple[list[Step], list[Step]]] = field(default_factory=list)
    patches: list[tuple[list[Step], Array, Array]] = field(default_factory=list)
    volume: float = 0.0


def net(hub: Hub) -> Net:
    """The surface of a hub.

    Raises:
        NotAHubError: a half beam is swallowed, or the curves close in no simple way.
    """
    return _Maker(hub).made()


class _Maker:
    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self.k = len(hub.along)
        self.c = np.sqrt(1.0 - hub.sines**2)
        self.slope = hub.sines / self.c
        self.right = np.cross(hub.along, hub.seams)
        self.level = math.sqrt(max(hub.ball**2 - hub.radius**2, 0.0))
        self.eps = _SAME * hub.ball
        # h is x . gradient - offset
        self.gradient = hub.along / self.c[:, None]
        self.offset = hub.radius * self.slope
        self.cap = hub.radius * hub.sines + self.level * self.c
        self.net = Net()
        self.known: dict[tuple[Any, ...], list[int]] = {}

    # --- formulas -----------------------------------------------------------------------------------------------------

    def heights(self, points: Array) -> Array:
        """(n, k) h of every beam."""
        return points @ self.gradient.T - self.offset

    def spoke(self, i: int, phi: Array) -> Array:
        return np.cos(phi)[:, None] * self.hub.seams[i] + np.sin(phi)[:, None] * self.right[i]

    def thickness(self, i: int, t: Any) -> Any:
        """Radius of a beam t mm along its axis."""
        return (self.hub.radius - t * self.hub.sines[i]) / self.c[i]

    def starts(self, i: int, phi: Array) -> Array:
        """(n, k) mm along the axis, on the ruling at phi, where beam i rises above every other; -inf for itself."""
        others = self.spoke(i, phi) @ self.gradient.T
        own = self.gradient @ self.hub.along[i]
        rise = (1.0 / self.c[i] - own) + self.slope[i] * others
        base = -self.offset[i] + self.offset - self.hub.radius / self.c[i] * others
        rise[:, i] = 1.0
        if (rise < 1e-6).any():
            raise NotAHubError
        found = -base / rise
        found[:, i] = -np.inf
        return found

    def on_cone(self, i: int, phi: float, t: float) -> Array:
        return t * self.hub.along[i] + self.thickness(i, t) * self.spoke(i, np.array([phi]))[0]

    def outer(self, i: int, phi: Array) -> tuple[Array, npt.NDArray[np.int64]]:
        """On the ball, angle from the beam where another's part begins, and whose."""
        hub = self.hub
        normal = self.gradient[i] - np.delete(self.gradient, i, axis=0)
        level = (self.offset[i] - np.delete(self.offset, i)) / hub.ball
        along, aside = normal @ hub.along[i], self.spoke(i, phi) @ normal.T
        size = np.hypot(along, aside)
        first = math.acos(min(max(self.cap[i] / hub.ball, -1.0), 1.0))
        with np.errstate(invalid="ignore"):
            angle = np.arctan2(aside, along) + np.arccos(level / size)
        angle = (angle - first + 1e-9) % (2.0 * np.pi) + first - 1e-9
        angle = np.where(np.abs(level) < size, angle, np.inf)
        other = angle.argmin(axis=1)
        return angle.min(axis=1), other + (other >= i)

    # --- points -------------------------------------------------------------------------------------------------------

    def point(self, place: Array) -> int:
        for number, known in enumerate(self.net.points):
            if np.abs(known - place).max() < self.eps:
                return number
        self.net.points.append(place)
        return len(self.net.points) - 1

    def corners(self) -> None:
        """Where three beams meet, or two and the ball."""
        trios = list(combinations(range(self.k), 3))
        for trio in trios:
            a, rest = trio[0], list(trio[1:])
            normals, levels = self.gradient[a] - self.gradient[rest], self.offset[a] - self.offset[rest]
            for ball in (None, self.hub.ball):
                for place in self.meeting(normals, levels, a, ball):
                    self.keep(place, a, outside=ball is None)
        for a, b in combinations(range(self.k), 2):
            for place in self.meeting(self.gradient[[a, b]], self.offset[[a, b]] + self.level, a, self.hub.ball):
                self.keep(place, a, outside=True)

    def keep(self, place: Array, i: int, *, outside: bool) -> None:
        """Note a corner where beam i and others are the highest, outside the ball or on it."""
        heights = self.heights(place[None])[0]
        top = float(heights.max())
        if heights[i] > top - self.eps and (top > self.level - self.eps if outside else top < self.level + self.eps):
            self.point(place)

    def meeting(self, normals: Array, levels: Array, i: int, ball: float | None) -> list[Array]:
        """Points in two planes, on a ball about the node or (None) on beam i."""
        way = np.cross(normals[0], normals[1])
        size = np.linalg.norm(way)
        if size < 1e-7 * np.linalg.norm(normals[0]) * np.linalg.norm(normals[1]):
            return []
        way = way / size
        base = np.linalg.lstsq(normals, levels, rcond=None)[0]
        if ball is None:
            alpha, beta = base @ self.gradient[i] - self.offset[i], way @ self.gradient[i]
            terms = 1.0 - beta**2, base @ way - alpha * beta, base @ base - self.hub.radius**2 - alpha**2
        else:
            terms = 1.0, base @ way, base @ base - ball**2
        a, b, c = (float(x) for x in terms)
        inside = b * b - a * c
        if abs(a) < 1e-12 or inside < -1e-9 * max(b * b, abs(a * c)):
            return []
        root = math.sqrt(max(inside, 0.0))
        return [base + (-b + sign * root) / a * way for sign in (-1.0, 1.0)]

    # --- curves -------------------------------------------------------------------------------------------------------

    def arc(self, key: tuple[Any, ...], ends: tuple[int, int], middle: Array, conic: Any) -> Step:
        """The arc from one point to another over `middle`; the one that is there already, whichever way it runs."""
        p, q = (self.net.points[n] for n in ends)
        chord = middle - 0.5 * (p + q)
        for number in self.known.setdefault((*key, *sorted(ends)), []):
            found = self.net.arcs[number]
            if (found.middle - 0.5 * (p + q)) @ chord > 0.0 or len(set(ends)) == 1:
                return number, found.ends == ends
        center, x, y, a, b = conic

        def angle(place: Array) -> float:
            return math.atan2((place - center) @ y / b, (place - center) @ x / a)

        first = angle(p)
        to_middle, last = ((angle(place) - first) % (2.0 * np.pi) for place in (middle, q))
        if to_middle > last:
            y = -y
            first = angle(p)
            last = (angle(q) - first) % (2.0 * np.pi)
        if not 1e-9 < last < 2.0 * np.pi - 1e-9:
            raise NotAHubError
        self.net.arcs.append(Arc(ends, middle, center, x, y, a, b, first, first + last))
        number = len(self.net.arcs) - 1
        self.known[(*key, *sorted(ends))].append(number)
        return number, True

    def circle(self, normal: Array, level: float, radius: float) -> tuple[Array, Array, Array, float, float]:
        """Where a plane cuts a ball about the node."""
        size = float(np.linalg.norm(normal))
        n, d = normal / size, level / size
        around = math.sqrt(max(radius**2 - d**2, 0.0))
        x: Array = _brep.seam_directions(n[None])[0]
        y: Array = np.cross(n, x).astype(np.float64)
        return d * n, x, y, around, around

    def ellipse(self, i: int, j: int) -> tuple[Array, Array, Array, float, float]:
        """Where the plane of beams i and j cuts beam i."""
        u, normal = self.hub.along[i], self.gradient[i] - self.gradient[j]
        level = self.offset[i] - self.offset[j]
        tilt = normal - (normal @ u) * u
        size = float(np.linalg.norm(tilt))
        if size < 1e-9 * np.linalg.norm(normal):
            t = level / (normal @ u)
            around = float(self.thickness(i, t))
            return t * u, self.hub.seams[i], self.right[i], around, around
        spoke = tilt / size
        # The extreme rulings lie in the plane of the axis and the normal.
        ends = []
        for side in (spoke, -spoke):
            # normal . (t u + thickness(t) side) = level
            across = float(normal @ side)
            rise = normal @ u - across * self.slope[i]
            if abs(rise) < 1e-9:
                raise NotAHubError
            t = (level - across * self.hub.radius / self.c[i]) / rise
            if self.thickness(i, t) <= 0.0:
                raise NotAHubError  # a hyperbola
            ends.append(t * u + self.thickness(i, t) * side)
        center, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[0] - ends[1])
        a = float(np.linalg.norm(half))
        along = center @ u
        b = math.sqrt(max(self.thickness(i, along) ** 2 - float(np.sum((center - along * u) ** 2)), 0.0))
        if not 0.0 < b <= a * (1.0 + 1e-9):
            raise NotAHubError
        return center, half / a, np.cross(u, spoke), a, min(a, b)

    # --- the whole ----------------------------------------------------------------------------------------------------

    def made(self) -> Net:
        self.corners()
        self.begin_seams()
        points = np.array(self.net.points)
        heights = self.heights(points)
        top = heights.max(axis=1)
        active = heights > top[:, None] - self.eps
        self.of_cone = active & (top >= self.level - self.eps)[:, None]
        self.of_ball = active & (top <= self.level + self.eps)[:, None]
        for i in range(self.k):
            self.beam(i)
        return self.net

    def begin_seams(self) -> None:
        """Where rulings at the seams of beams begin: on another beam or the ball, and on the ball where they end."""
        self.seam_starts, self.seam_outers = [], []
        for i in range(self.k):
            phi = np.array([0.0, np.pi])
            starts = self.starts(i, phi).max(axis=1) if self.k > 1 else np.full(2, -np.inf)
            open_ball = starts < self.cap[i] - self.eps
            t = np.maximum(starts, self.cap[i])
            self.seam_starts.append([self.point(self.on_cone(i, phi[n], t[n])) for n in (0, 1)])
            if self.k == 1:
                apex = self.point(-self.hub.ball * self.hub.along[i])
                self.seam_outers.append([apex, apex])
                continue
            angle, _ = self.outer(i, phi)
            outers: list[int | None] = [None, None]
            for n in (0, 1):
                if open_ball[n]:
                    if angle[n] > np.pi - 0.02:
                        raise NotAHubError
                    outers[n] = self.point(self.on_ball(i, phi[n], angle[n]))
            self.seam_outers.append(outers)

    def on_ball(self, i: int, phi: float, angle: float) -> Array:
        spoke = self.spoke(i, np.array([phi]))[0]
        return self.hub.ball * (math.cos(angle) * self.hub.along[i] + math.sin(angle) * spoke)

    def around(self, i: int, numbers: npt.NDArray[np.int64], seams: list[int | None]) -> list[tuple[float, int]]:
        """Points by their angle about beam i; its seams at 0 and pi."""
        points = np.array(self.net.points)[numbers]
        phi = np.arctan2(points @ self.right[i], points @ self.hub.seams[i]) % (2.0 * np.pi)
        fixed = {number: np.pi * n for n, number in enumerate(seams) if number is not None}
        return sorted((fixed.get(int(n), float(p)), int(n)) for n, p in zip(numbers, phi, strict=True))

    def beam(self, i: int) -> None:
        """The curve where a beam begins, and the pieces of the ball next to it."""
        hub = self.hub
        loop = self.around(i, np.flatnonzero(self.of_cone[:, i]), list(self.seam_starts[i]))
        halves: tuple[list[Step], list[Step]] = ([], [])
        open_arcs: list[tuple[float, float, int, int, Step]] = []
        turn = 2.0 * np.pi
        for (phi, p), (after, q) in zip(loop, [*loop[1:], (turn, loop[0][1])], strict=True):
            middle = 0.5 * (phi + after)
            at = middle + 0.5 * (after - phi) * np.concatenate([[0.0], _NODES])
            starts = self.starts(i, at) if self.k > 1 else np.full((len(at), 1), -np.inf)
            j = int(starts[0].argmax())
            of_ball = starts[0, j] < self.cap[i] - self.eps
            t = np.full(len(at), self.cap[i]) if of_ball else starts[:, j]
            if t.max() > hub.cuts[i] - 1e-3 * hub.ball or (self.thickness(i, t) <= 0.0).any():
                raise NotAHubError
            half = (hub.radius * (hub.cuts[i] - t[1:]) - 0.5 * hub.sines[i] * (hub.cuts[i] ** 2 - t[1:] ** 2)) / self.c[
                i
            ] ** 2
            self.net.volume += hub.radius / 3.0 * 0.5 * (after - phi) * float(_WEIGHTS @ half)
            key, conic = (
                (("cap", i), self.circle(hub.along[i], self.cap[i], hub.ball))
                if of_ball
                else (("cone", *sorted((i, j))), self.ellipse(i, j))
            )
            step = self.arc(key, (p, q), self.on_cone(i, middle, float(t[0])), conic)
            halves[int(middle > np.pi)].append(step)
            if of_ball:
                open_arcs.append((phi, after, p, q, step))
        self.net.chains.append(halves)
        self.net.volume += hub.cuts[i] / 3.0 * np.pi * self.thickness(i, hub.cuts[i]) ** 2
        if self.k == 1:
            self.end(i, open_arcs)
        else:
            for run in self.runs(i, open_arcs):
                self.patch(i, run)

    def end(self, i: int, arcs: list[tuple[float, float, int, int, Step]]) -> None:
        """The ball at the end of a single beam: two halves that meet in a point."""
        hub = self.hub
        u, away = hub.along[i], math.acos(self.cap[i] / hub.ball)
        side = [*self.seam_starts[i]]
        apex = self.seam_outers[i][0]
        meridians = []
        for n, seam in enumerate(side):
            spoke = (1.0 - 2.0 * n) * hub.seams[i]
            middle = self.on_ball(i, n * np.pi, 0.5 * (away + np.pi))
            meridians.append(
                self.arc(("meridian", i, n), (seam, apex), middle, (np.zeros(3), u, spoke, *(hub.ball,) * 2))
            )
        for half, own in enumerate(arcs):
            w = (1.0 - 2.0 * half) * self.right[i]
            down, up = meridians[half], meridians[1 - half]
            loop = [down, _back(up), _back(own[4])]
            tilt = 0.5 * away
            pole = math.cos(tilt) * u + math.sin(tilt) * w
            self.net.patches.append((loop, pole, math.sin(tilt) * u - math.cos(tilt) * w))
        self.net.volume += hub.ball**3 / 3.0 * 2.0 * np.pi * (1.0 + self.cap[i] / hub.ball)

    def runs(self, i: int, arcs: list[tuple[float, float, int, int, Step]]) -> list[list[Any]]:
        """Arcs of the ball's rim on one beam, in groups that bound one piece of the ball; none passes a seam."""
        found: list[list[Any]] = []
        for arc in arcs:
            angle, _ = self.outer(i, np.array([arc[0]]))
            at_seam = arc[2] in self.seam_starts[i]
            joined = found and found[-1][-1][3] == arc[2] and not at_seam
            if joined and angle[0] > math.acos(self.cap[i] / self.hub.ball) + 1e-5:
                found[-1].append(arc)
            else:
                found.append([arc])
        return found

    def patch(self, i: int, run: list[Any]) -> None:
        """A piece of the ball between the rim of a beam and the parts of the others."""
        hub = self.hub
        begin, end = run[0][0], run[-1][1]
        corners = [run[0][2], run[-1][3]]
        low: list[int] = list(corners)
        sides: list[Step | None] = [None, None]
        first = math.acos(self.cap[i] / hub.ball)
        for n, (corner, phi) in enumerate(zip(corners, (begin, end), strict=True)):
            if corner in self.seam_starts[i]:
                which = self.seam_starts[i].index(corner)
                outer = self.seam_outers[i][which]
                if outer is not None and outer != corner:
                    spoke = (1.0 - 2.0 * which) * hub.seams[i]
                    angle, _ = self.outer(i, np.array([phi]))
                    middle = self.on_ball(i, phi, 0.5 * (first + float(angle[0])))
                    conic = (np.zeros(3), hub.along[i], spoke, hub.ball, hub.ball)
                    sides[n] = self.arc(("meridian", i, which), (corner, outer), middle, conic)
                    low[n] = outer
        inside = [
            (phi, number)
            for phi, number in self.around(i, np.flatnonzero(self.of_ball[:, i]), [None, None])
            if begin + 1e-9 < phi < end - 1e-9 and number not in (*low, *corners)
        ]
        path = [(begin, low[0]), *inside, (end, low[1])]
        loop: list[Step] = []
        for (phi, p), (after, q) in pairwise(path):
            middle = 0.5 * (phi + after)
            at = middle + 0.5 * (after - phi) * np.concatenate([[0.0], _NODES])
            angle, others = self.outer(i, at)
            if not (angle < np.pi - 0.02).all() or p == q:
                raise NotAHubError
            j = int(others[0])
            conic = self.circle(self.gradient[i] - self.gradient[j], self.offset[i] - self.offset[j], hub.ball)
            loop.append(self.arc(("ball", *sorted((i, j))), (p, q), self.on_ball(i, middle, float(angle[0])), conic))
            area = math.cos(first) - np.cos(angle[1:])
            self.net.volume += hub.ball**3 / 3.0 * 0.5 * (after - phi) * float(_WEIGHTS @ area)
        if sides[1] is not None:
            loop.append(_back(sides[1]))
        loop += [_back(arc[4]) for arc in reversed(run)]
        if sides[0] is not None:
            loop.append(sides[0])
        half = 1.0 if 0.5 * (begin + end) < np.pi else -1.0
        # The seam of the ball's parametrisation behind the beam, its poles on the axis: away from this half.
        self.net.patches.append((loop, hub.along[i], -half * self.right[i]))


def _back(step: Step) -> Step:
    return step[0], not step[1]
