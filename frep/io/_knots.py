"""Beams taken apart for an exact file: half beams, the hubs they form, and the knots of hubs that overlap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from frep.io import _brep
from frep.io._net import Hub, NotAHubError, net
from frep.io._shell import Placed, solids_of

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

_SAME_BALL = 1e-9
"""Part of its radius by which the balls that two beams touch at a node may differ."""


_SEAMS = (0.0, 0.8, 0.37, 1.2)
"""Angles in rad at which the seams of beams are tried: whether OpenCASCADE cuts a hub by a box hangs on where they lie."""

WAYS = len(_SEAMS)


@dataclass(frozen=True)
class Beams:
    """Beams and balls, checked.

    Attributes:
        nodes: (n, 3) mm.
        edges: (m, 2) node numbers, no two alike.
        radii: (m, 2) at either end, mm.
        balls: (n,) radius of the ball at each node, mm.
        swept: whether a beam is the hull of balls of these radii, and not the cone between discs of them.
    """

    nodes: Array
    edges: Numbers
    radii: Array
    balls: Array
    swept: bool = False


class Halves:
    """Each beam cut in the middle: two halves, each belonging to the node it ends in. The first m end in `edges[:, 0]`."""

    def __init__(self, beams: Beams, way: int = 0) -> None:
        """`way` numbers where the seams of cylinders lie: elsewhere for each."""
        self.nodes, self.balls = beams.nodes, beams.balls
        a, b = beams.edges.T
        axis = beams.nodes[b] - beams.nodes[a]
        length = np.linalg.norm(axis, axis=1)
        u = axis / length[:, None]
        fall = beams.radii[:, 0] - beams.radii[:, 1]
        # The sine of the slope of a hull of two balls, the tangent of that of a cone.
        sine = fall / length if beams.swept else fall / np.hypot(length, fall)
        if (np.abs(sine) > 1.0 - 1e-6).any():
            raise _brep.BrepError("radii: a node's ball holds the whole of a beam")
        cosine = np.sqrt(1.0 - sine**2)
        touching = beams.radii if beams.swept else beams.radii * cosine[:, None]
        first = sine * beams.radii[:, 0] if beams.swept else np.zeros(len(length))
        last = length + sine * beams.radii[:, 1] if beams.swept else length
        cut = 0.5 * (first + last)
        rim = beams.radii * cosine[:, None] if beams.swept else beams.radii
        middle = beams.nodes[a] + cut[:, None] * u
        seam = _brep.seam_directions(axis)
        angle = _SEAMS[way]
        seam = np.cos(angle) * seam + np.sin(angle) * np.cross(u, seam)
        self.node = beams.edges.T.ravel()
        self.start = np.concatenate([beams.nodes[a] + first[:, None] * u, beams.nodes[a] + last[:, None] * u])
        self.end = np.concatenate([middle, middle])
        self.radius = rim.T.ravel()
        self.end_radius = np.tile(rim.mean(axis=1), 2)
        self.seam = np.concatenate([seam, seam])
        self.along = np.concatenate([u, -u])
        self.sine = np.concatenate([sine, -sine])
        self.touching = touching.T.ravel()
        self.cut = np.concatenate([cut, length - cut])

    def twin(self, half: Numbers) -> Numbers:
        """The other half of a beam."""
        return (half + len(self.node) // 2) % len(self.node)

    def knots(self) -> list[list[int]]:
        """Groups of nodes whose half beams overlap those of no other group; a group of one is the usual case."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        reach = np.maximum(self.radius, self.end_radius)
        i, j = self._close_pairs(reach)
        # The halves of one beam meet in a disc: no overlap, unless a ball reaches over the middle.
        other = (self.node[i] != self.node[j]) & (j != self.twin(i))
        i, j = i[other], j[other]
        near = segment_distance(self.nodes[self.node[i]], self.end[i], self.nodes[self.node[j]], self.end[j])
        meet = near < (reach[i] + reach[j]) * (1 + 1e-6)
        pairs = [(self.node[i[meet]], self.node[j[meet]])]
        for node in np.unique(self.node):
            gap = segment_distance(self.nodes[node], self.nodes[node], self.nodes[self.node], self.end)
            hit = (gap < self.balls[node] + reach - 1e-6 * reach) & (self.node != node)
            own = np.flatnonzero(self.node == node)
            # Along its own beam the other half begins at the middle, flat.
            hit[self.twin(own)] = self.cut[own] <= self.balls[node]
            pairs.append((np.full(int(hit.sum()), node), self.node[hit]))
        rows, columns = (np.concatenate(ends) for ends in zip(*pairs, strict=True))
        graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(self.nodes),) * 2)
        _, label = connected_components(graph, directed=False)
        used = np.unique(self.node)
        return [used[label[used] == group].tolist() for group in np.unique(label[used])]

    def _close_pairs(self, reach: Array) -> tuple[Numbers, Numbers]:
        """Pairs of half beams whose balls about their middles meet."""
        from scipy.spatial import KDTree

        middle = 0.5 * (self.nodes[self.node] + self.end)
        round_ = 0.5 * np.linalg.norm(self.end - self.nodes[self.node], axis=1) + reach
        pairs = KDTree(middle).query_pairs(2.0 * float(round_.max()) * (1 + 1e-6), output_type="ndarray")
        i, j = pairs.T
        close = np.linalg.norm(middle[i] - middle[j], axis=1) <= (round_[i] + round_[j]) * (1 + 1e-6)
        return i[close], j[close]

    def pieces(self, knot: list[int]) -> _brep.Pieces:
        """The half beams and balls of a group of nodes."""
        own = np.isin(self.node, knot)
        return _brep.Pieces(
            start=self.start[own],
            end=self.end[own],
            start_radius=self.radius[own],
            end_radius=self.end_radius[own],
            seam=self.seam[own],
            center=self.nodes[knot],
            ball=self.balls[knot],
        )

    def hubs(self, nodes: list[int]) -> dict[int, Placed]:
        """Those of some nodes that are hubs, each joined to those of its neighbours that are."""
        known: dict[bytes, object] = {}
        found = {}
        for node in nodes:
            own = np.flatnonzero(self.node == node)
            touching = self.touching[own]
            if np.ptp(touching) > _SAME_BALL * touching.max():
                continue
            hub = Hub(
                float(touching.mean()),
                float(max(self.balls[node], touching.mean())),
                self.along[own],
                self.sine[own],
                self.seam[own],
                self.cut[own],
            )
            key = b"|".join(np.asarray(part).tobytes() for part in vars(hub).values())
            if key not in known:
                try:
                    known[key] = net(hub)
                except NotAHubError:
                    known[key] = None
            if known[key] is not None:
                found[node] = own, hub, known[key]
        order = {node: n for n, node in enumerate(found)}
        place = {int(half): (order[node], n) for node, (own, _, _) in found.items() for n, half in enumerate(own)}
        return {
            node: Placed(self.nodes[node], hub, shape, [place.get(int(half), (-1, -1)) for half in self.twin(own)])
            for node, (own, hub, shape) in found.items()
        }


def clipped_hubs(halves: Halves, nodes: list[int], box: _brep.Box) -> tuple[list[Any], list[int]]:
    """Hubs of some nodes, each by itself, within a box; and the nodes of which OpenCASCADE makes no correct ones."""
    known: dict[bytes, Any] = {}
    found, missing = [], []
    hubs = halves.hubs(nodes)
    for node in nodes:
        if node not in hubs:
            missing.append(node)
            continue
        placed = hubs[node]
        low, high = (corner - placed.center for corner in halves.pieces([node]).bounds())
        # What the box does far from the hub does not matter.
        near = tuple(np.clip(corner - placed.center, low - 1.0, high + 1.0) for corner in box)
        key = b"|".join((np.round(part, 9) + 0.0).tobytes() for part in (*vars(placed.hub).values(), *near))
        if key not in known:
            known[key] = _clipped(placed, (near[0], near[1]), (low, high))
        shape = known[key]
        if shape is None:
            missing.append(node)
        elif shape is not _EMPTY:
            found.append(_brep.moved(shape, placed.center))
    return found, missing


_EMPTY = object()


def _clipped(placed: Placed, box: _brep.Box, bounds: _brep.Box) -> Any:
    """A hub about its node, within a box; `_EMPTY` where nothing is left, None where it comes out wrong."""
    low, high = np.maximum(bounds[0], box[0]), np.minimum(bounds[1], box[1])
    inside = placed.hub.contains(_brep.spread_in_box(low, high, 40)) if (low < high).all() else np.zeros(1)
    expected = float(np.prod(np.maximum(high - low, 0.0)) * inside.mean())
    if expected <= 1e-6 * placed.net.volume:
        return _EMPTY
    (solid,) = solids_of([Placed(np.zeros(3), placed.hub, placed.net, [(-1, -1)] * len(placed.other))])
    shape = _brep.within(solid, box)
    if shape is None or not _brep.is_valid(shape):
        return None
    # The points are good to about half a per cent; a lost face is far more.
    return shape if abs(_brep.volume(shape) - expected) < 0.015 * expected + 1e-4 * placed.net.volume else None


def segment_distance(p: Array, q: Array, r: Array, s: Array) -> Array:
    """(n,) distance of the segments pq and rs (Ericson, Real-Time Collision Detection, 5.1.9)."""
    p, q, r, s = np.broadcast_arrays(*(np.atleast_2d(x) for x in (p, q, r, s)))
    u, v, w = q - p, s - r, p - r
    a, e, f = (u * u).sum(1), (v * v).sum(1), (v * w).sum(1)
    b, c = (u * v).sum(1), (u * w).sum(1)
    cross = a * e - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(cross > 1e-12 * a * e, np.clip((b * f - c * e) / cross, 0, 1), 0.0)
        t = np.where(e > 0, (b * along + f) / e, 0.0)
        clipped = np.clip(t, 0, 1)
        along = np.where(a > 0, np.clip((b * clipped - c) / np.where(a > 0, a, 1), 0, 1), 0.0)
    return np.linalg.norm(w + along[:, None] * u - clipped[:, None] * v, axis=1)
