"""Beams of a lattice that overlap although they share no node.

Sums over hubs, and meshes joined from hubs, need a *clean* lattice, whose hubs keep apart. Whether beams of one node part before
their middles is found by `frep/hubs.py`; here are all others: beams that cross, graze, or wind round onto the lattice itself.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .steady import SteadySkeleton

TOUCHING = 1e-7
"""Overlaps below this part of a beam's radius are rounding of beams that touch."""

_ALL = 1500
"""Beams and balls of a lattice that is small enough to look at all of them: a fifth of a second."""

_HALVINGS = 55
"""Golden sections of a beam: down to 1e-11 of its length."""


@dataclass(frozen=True, eq=False)
class CleanReport:
    """Whether the hubs of a lattice keep apart.

    Attributes:
        is_clean: no overlap was found.
        overlap: the deepest one found, mm; 0 where there is none.
        message: which hubs or beams overlap, and by how much; a sentence in either case.
    """

    is_clean: bool
    overlap: float
    message: str


def beam_gaps(a: np.ndarray, ra: np.ndarray, b: np.ndarray, rb: np.ndarray) -> np.ndarray:
    """How far apart beams are: (n,) mm, negative where they overlap (then by how much one must move, at most).

    The minimum over both beams of |p(s) - q(t)| - r_a(s) - r_b(t), which is convex in (s, t): over t in closed form, over s by
    golden sections.

    Args:
        a: (n, 2, 3) ends of one beam of each pair; two equal ends are a ball.
        ra: (n, 2) radii at these ends.
        b: (n, 2, 3) and
        rb: (n, 2): the other beam.
    """

    def at(s: np.ndarray) -> np.ndarray:
        p = a[:, 0] + s[:, None] * (a[:, 1] - a[:, 0])
        return _beam_distance(p, b, rb) - (ra[:, 0] + s * (ra[:, 1] - ra[:, 0]))

    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    low, high = np.zeros(len(a)), np.ones(len(a))
    least = np.minimum(at(low), at(high))
    s, t = high - ratio * (high - low), low + ratio * (high - low)
    fs, ft = at(s), at(t)
    for _ in range(_HALVINGS):
        left = fs < ft
        low, high = np.where(left, low, s), np.where(left, t, high)
        s, t = np.where(left, high - ratio * (high - low), t), np.where(left, s, low + ratio * (high - low))
        known = np.where(left, fs, ft)
        new = at(np.where(left, s, t))
        fs, ft = np.where(left, new, known), np.where(left, known, new)
    return np.minimum(least, np.minimum(fs, ft))


def _beam_distance(points: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(n,) signed distance of each point to its cone-beam (steady-and-clg 2.1)."""
    to = points - ends[:, 0]
    axis = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(axis, axis=1)
    step = radii[:, 0] - radii[:, 1]
    is_beam = length > np.abs(step)
    axis = axis / np.where(length > 0.0, length, 1.0)[:, None]
    x = np.einsum("nc,nc->n", to, axis)
    y = np.linalg.norm(to - x[:, None] * axis, axis=1)
    sine = np.where(is_beam, step / np.where(is_beam, length, 1.0), 0.0)
    cosine = np.sqrt((1.0 - sine) * (1.0 + sine))
    k = x * cosine - y * sine
    first, last = np.hypot(x, y) - radii[:, 0], np.hypot(x - length, y) - radii[:, 1]
    side = x * sine + y * cosine - radii[:, 0]
    distance = np.where(k <= 0.0, first, np.where(k >= length * cosine, last, side))
    return np.where(is_beam, distance, np.minimum(first, last))


def strangers(skeleton: SteadySkeleton) -> CleanReport:
    """Whether beams that share no node keep apart, among a sample of the lattice's beams and all beams near those.

    Of a small lattice, of a thousand beams, the sample is all. Otherwise it holds of each rack the beams at the first, middle and
    last clusters along each direction, and of nodes without beams the balls at those clusters. Where the directions commute these
    stand for all others but for laps of a lattice over itself. Where they do not, it is nine clusters along u and along v; beams
    between them may still overlap.
    """
    from .rangefinder import find_beams, find_nodes

    beams, balls = _sampled_beams(skeleton), _sampled_balls(skeleton)
    ends, radii = skeleton.ends(beams)
    if len(balls):
        points, own = skeleton.placed(balls[:, :3], balls[:, 3])
        ends = np.concatenate([ends, np.stack([points, points], axis=1)])
        radii = np.concatenate([radii, np.stack([own, own], axis=1)])
    if not len(ends):
        return CleanReport(True, 0.0, "there are no beams")
    nodes = np.concatenate([_end_nodes(skeleton, beams), np.repeat(balls[:, None], 2, axis=1)])
    centers = ends.mean(axis=1)
    reach = 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) + radii.max(axis=1)

    found = find_beams(skeleton, centers, reach)
    query, other = found[:, 0], found[:, 1:]
    other_nodes = _end_nodes(skeleton, other)
    other_ends, other_radii = skeleton.ends(other)
    if len(skeleton.lone_nodes):
        found = find_nodes(skeleton, centers, reach)
        found = found[np.isin(found[:, 4], skeleton.lone_nodes)]
        points, sizes = skeleton.placed(found[:, 1:4], found[:, 4])
        query = np.concatenate([query, found[:, 0]])
        other_nodes = np.concatenate([other_nodes, np.repeat(found[:, None, 1:], 2, axis=1)])
        other_ends = np.concatenate([other_ends, np.stack([points, points], axis=1)])
        other_radii = np.concatenate([other_radii, np.stack([sizes, sizes], axis=1)])

    mine = nodes[query]
    shared = (mine[:, :, None] == other_nodes[:, None]).all(axis=3).any(axis=(1, 2))
    pairs = np.flatnonzero(~shared)
    if not len(pairs):
        return CleanReport(True, 0.0, "no hubs overlap among those looked at")
    query = query[pairs]
    gaps = beam_gaps(ends[query], radii[query], other_ends[pairs], other_radii[pairs])
    thinner = np.minimum(radii[query].min(axis=1), other_radii[pairs].min(axis=1))
    worst = int(np.argmin(gaps / thinner))
    if gaps[worst] >= -TOUCHING * thinner[worst]:
        return CleanReport(True, 0.0, "no hubs overlap among those looked at")
    message = f"{_named(mine[pairs[worst]])} and {_named(other_nodes[pairs[worst]])} overlap by {-gaps[worst]:.4g} mm"
    return CleanReport(False, float(-gaps[worst]), message)


def _densities(skeleton: SteadySkeleton) -> tuple[int, int, int]:
    """How many clusters are looked at along each direction. Along w all are similar: what is asked for is the ends and laps."""
    if skeleton.n_beams + skeleton.n_nodes <= _ALL:
        i, j, k = (int(n) for n in skeleton.counts)
        return i, j, k
    size = float(np.abs(skeleton.bounds).max())
    commute = all(a.commutes_with(b, size=size) for a, b in itertools.combinations(skeleton.directions, 2))
    return (3, 3, 3) if commute else (9, 9, 3)


def _sampled(low: int, high: int, most: int) -> list[int]:
    """Whole numbers from low to high, both included: `most` of them, or all of fewer."""
    steps = max(min(most, high - low + 1) - 1, 1)
    return sorted({low + (high - low) * n // steps for n in range(steps + 1)}) if high >= low else []


def _sampled_beams(skeleton: SteadySkeleton) -> np.ndarray:
    """(m, 4) rows (i, j, k, rack)."""
    rows, densities = [], _densities(skeleton)
    for rack, offset in enumerate(skeleton.racks[:, 2:].tolist()):
        ranges = [
            _sampled(int(s) + max(0, -d), int(s) + int(n) - 1 - max(0, d), most)
            for s, n, d, most in zip(skeleton.start, skeleton.counts, offset, densities, strict=True)
        ]
        rows += [(*cluster, rack) for cluster in itertools.product(*ranges)]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)


def _sampled_balls(skeleton: SteadySkeleton) -> np.ndarray:
    """(m, 4) rows (i, j, k, node) of nodes that somewhere have no beam."""
    ranges = [
        _sampled(int(s), int(s) + int(n) - 1, most)
        for s, n, most in zip(skeleton.start, skeleton.counts, _densities(skeleton), strict=True)
    ]
    rows = [(*cluster, int(node)) for node in skeleton.lone_nodes for cluster in itertools.product(*ranges)]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)


def _end_nodes(skeleton: SteadySkeleton, beams: np.ndarray) -> np.ndarray:
    """(m, 2, 4) rows (i, j, k, node) of both ends of beams (i, j, k, rack)."""
    racks = skeleton.racks[beams[:, 3]]
    start = np.column_stack([beams[:, :3], racks[:, 0]])
    return np.stack([start, np.column_stack([beams[:, :3] + racks[:, 2:], racks[:, 1]])], axis=1)


def _named(nodes: np.ndarray) -> str:
    (i, j, k, a), (i2, j2, k2, b) = nodes.tolist()
    if nodes[0].tolist() == nodes[1].tolist():
        return f"the ball of node {a} of cluster ({i}, {j}, {k})"
    return f"the beam from node {a} of cluster ({i}, {j}, {k}) to node {b} of cluster ({i2}, {j2}, {k2})"
