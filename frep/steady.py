"""Steady lattices: bricks of clusters `C[i,j,k] = W^k V^j U^i C0` joined by racks of beams, as a skeleton. Nothing is
stored but a cluster, its racks and three similarities; queries are answered by `frep/steady_kernels.py`.

Source: Gupta et al., Programmed-Lattice Editor; Kurzeja, Constructive Lattice Geometry, sections 2.6 and 6.1.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from . import steady_kernels as kernels
from .biq_kernels import H_INDEX, H_SOURCE_DATA, SEGMENT, STEADY
from .errors import TooLargeError
from .packing import Packer, digest
from .similarity import Similarity
from .skeleton import Skeleton, Source, indexed

_ENUMERATED = 200_000
"""Nodes up to which bounds are found by looking at each."""

_BOXES = 200_000
"""Boxes of indices after which bounds are not made tighter."""

_LONGEST = 2_000_000
"""Clusters along a direction whose powers are tabulated: some 500 MB."""

_WRITTEN_OUT = 250_000
"""Indices among which the beams near a window are looked for, to be written out for it: 8 ms."""


@dataclass(frozen=True, eq=False)
class SteadySkeleton(Skeleton):
    """A brick of clusters of nodes, with racks of beams between them.

    Attributes:
        nodes: (n, 3) nodes of cluster (0, 0, 0), mm.
        radii: (n,) their radii, mm; they grow with the scales of u, v, w.
        racks: (m, 5) int64 rows (start node, end node, di, dj, dk): beams from the start node of each cluster (i, j,
            k) to the end node of cluster (i + di, j + dj, k + dk), wherever both clusters exist.
        u, v, w: similarities; cluster (i, j, k) is W^k V^j U^i applied to cluster (0, 0, 0).
        counts: (3,) clusters along each direction.
        start: (3,) the first index of each direction.

    A beam has the index (i, j, k, rack), (i, j, k) being the cluster of its start node; a node (i, j, k, node).
    """

    nodes: np.ndarray
    edges: np.ndarray = field(init=False)
    radii: np.ndarray
    racks: np.ndarray
    u: Similarity
    v: Similarity
    w: Similarity
    counts: np.ndarray
    start: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "edges", self.racks[:, :2])

    @property
    def directions(self) -> tuple[Similarity, Similarity, Similarity]:
        """u, v, w."""
        return self.u, self.v, self.w

    @property
    def n_nodes(self) -> int:
        """How many nodes there are."""
        return len(self.nodes) * math.prod(int(n) for n in self.counts)

    @property
    def n_beams(self) -> int:
        """How many beams there are: of each rack, those whose both clusters exist."""
        return sum(math.prod(int(n) for n in spans) for spans in self.spans)

    @cached_property
    def spans(self) -> np.ndarray:
        """(m, 3) anchors of each rack along each direction: a beam's anchor is the lower of its two clusters in each
        index."""
        return np.maximum(self.counts - np.abs(self.racks[:, 2:]), 0)

    @cached_property
    def scales(self) -> tuple[float, float]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The smallest and largest scale of a cluster."""
        ends = np.array([self.start, self.start + self.counts - 1])
        logs = ends * [s.log_scale for s in self.directions]
        return math.exp(logs.min(axis=0).sum()), math.exp(logs.max(axis=0).sum())

    def frames(self, i, j, k) -> np.ndarray:
        """(..., 4, 4) matrices W^k V^j U^i of clusters, real indices allowed; arrays of indices are broadcast."""
        i, j, k = np.broadcast_arrays(i, j, k)
        out = np.eye(4)
        for similarity, index in zip(self.directions, (i, j, k), strict=True):
            values, back = np.unique(index, return_inverse=True)
            out = similarity.powers(values)[back.reshape(index.shape)] @ out
        return out

    def balls(self, i, j, k) -> tuple[np.ndarray, np.ndarray]:
        """Centers (..., n, 3) and radii (..., n) of the nodes of clusters; arrays of indices are broadcast."""
        frames = self.frames(i, j, k)
        centers = np.einsum("...ab,nb->...na", frames[..., :3, :3], self.nodes) + frames[..., None, :3, 3]
        return centers, self._scale_at(i, j, k)[..., None] * self.radii

    def _scale_at(self, i, j, k) -> np.ndarray:
        """By how much a cluster is larger than the first."""
        u, v, w = (s.log_scale for s in self.directions)
        return np.exp(u * np.asarray(i) + v * np.asarray(j) + w * np.asarray(k))

    def placed(self, clusters: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Centers (m, 3) and radii (m,) of single nodes: their clusters (m, 3) and their numbers (m,) in the cluster."""
        frames = self.frames(*clusters.T)
        centers = np.einsum("mab,mb->ma", frames[:, :3, :3], self.nodes[nodes]) + frames[:, :3, 3]
        return centers, self._scale_at(*clusters.T) * self.radii[nodes]

    def ends(self, beams: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m, 2, 3) and radii (m, 2) of beams given by index, (m, 4) rows (i, j, k, rack)."""
        beams = np.asarray(beams)
        racks = self.racks[beams[:, 3]]
        clusters = np.concatenate([beams[:, :3], beams[:, :3] + racks[:, 2:]])
        centers, radii = self.placed(clusters, racks[:, :2].T.ravel())
        return np.stack(np.split(centers, 2), axis=1), np.stack(np.split(radii, 2), axis=1)

    @cached_property
    def lone_nodes(self) -> np.ndarray:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Nodes of the cluster that somewhere have no beam; often at the brick's boundary, or none."""
        reach = int(np.abs(self.racks[:, 2:]).max(initial=0))
        # Deeper in than the racks reach, all clusters are alike.
        layers = [sorted({*range(min(n, reach + 1)), *range(max(0, n - reach - 1), n)}) for n in map(int, self.counts)]
        lone = np.zeros(len(self.nodes), bool)
        for cluster in itertools.product(*layers):
            joined = np.zeros(len(self.nodes), bool)
            for start, end, *offset in self.racks:
                there, back = np.add(cluster, offset), np.subtract(cluster, offset)
                joined[start] |= bool(np.all((there >= 0) & (there < self.counts)))
                joined[end] |= bool(np.all((back >= 0) & (back < self.counts)))
            lone |= ~joined
        return np.flatnonzero(lone)

    @cached_property
    def bounds(self) -> np.ndarray:  # pyright: ignore[reportIncompatibleMethodOverride]
        """(2, 3) box of the nodes' centers, mm; of large lattices a little larger than need be."""
        if self.n_nodes <= _ENUMERATED:
            indices = np.meshgrid(*(np.arange(s, s + n) for s, n in zip(self.start, self.counts, strict=True)))
            points = self.balls(*indices)[0].reshape(-1, 3)
            return np.array([points.min(axis=0), points.max(axis=0)])
        packer = Packer()
        rows = np.zeros((len(self.nodes), 9))
        rows[:, 0:3] = rows[:, 3:6] = self.nodes
        data, q, *_ = self._packed(packer, rows, np.zeros((len(rows), 3), np.int64))
        fdata, idata = packer.joined("f", np.float64), packer.joined("i", np.int32)
        tolerance = 1e-3 * fdata[data + kernels.F_ALL + 3]
        while True:
            corners, visited = np.empty((2, 3)), 0
            for side, axis in itertools.product((-1.0, 1.0), range(3)):
                farthest, boxes = kernels.extent_along(fdata, idata, q, data, *(side * np.eye(3)[axis]), tolerance)
                corners[int(side > 0), axis] = side * farthest
                visited += boxes
            # What is long, but coiled up, first seems as large as it is long.
            fine = 1e-3 * float(np.ptp(corners, axis=0).max())
            if tolerance <= 2.0 * fine or visited > _BOXES:
                return corners
            tolerance = max(fine, 0.25 * tolerance)

    @property
    def content_key(self) -> bytes:
        numbers = [np.array([s.log_scale, s.angle, *s.axis, *s.velocity]) for s in self.directions]
        return digest(b"steady", self.nodes, self.radii, self.racks, *numbers, self.counts, self.start)

    def box_round(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A box, mm, that holds the centers of the nodes of the clusters low..high and of those that their racks
        reach."""
        head, fdata, idata = self.packed
        swept = np.empty(kernels.SWEPT)
        kernels.sweep(fdata, idata, head[H_INDEX], head[H_SOURCE_DATA], np.concatenate([low, high]), swept)
        half = np.abs(swept[3:12].reshape(3, 3)).sum(axis=0) + swept[kernels.S_RHO]
        return swept[:3] - half, swept[:3] + half

    def _source(self, packer: Packer, rows: np.ndarray, box: np.ndarray | None = None) -> Source:
        offsets = self._offsets(rows)
        if box is None:
            return STEADY, rows, self._packed(packer, rows, offsets)
        anchors, q, fdata, idata = self._anchors_near(rows, box)
        first, last = self._ranges(offsets, anchors)
        most = int(np.maximum(last - first + 1, 0).prod(axis=1).sum())
        if most <= _WRITTEN_OUT:
            # Few indices come into question: a grid of their beams is quicker than the indices.
            near = np.empty((max(most, 1), SEGMENT))
            packed = np.concatenate([fdata, rows.ravel()])
            n = kernels.write_out(packed, idata, q, len(fdata), len(rows), anchors.ravel(), *np.array(box), near)
            if n:
                return indexed(packer, near[:n])
        return STEADY, rows, self._packed(packer, rows, offsets, anchors)

    def _offsets(self, rows: np.ndarray) -> np.ndarray:
        # Behind the racks come balls of nodes, which are racks of no offset.
        offsets = np.zeros((len(rows), 3), np.int64)
        offsets[: len(self.racks)] = self.racks[:, 2:]
        return offsets

    def _ranges(self, offsets: np.ndarray, anchors: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """First and last anchor (m, 3) of each rack, within a box (2, 3) of anchors."""
        first = np.broadcast_to(self.start, offsets.shape)
        last = first + self.counts - 1 - np.abs(offsets)
        return (first, last) if anchors is None else (np.maximum(first, anchors[0]), np.minimum(last, anchors[1]))

    def _anchors_near(self, rows: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, int, np.ndarray, np.ndarray]:
        """The box (2, 3) of anchors whose beams can come near a box, and the packed lattice that told it."""
        trial = Packer()
        data, q, *_ = self._packed(trial, rows, self._offsets(rows))
        fdata, idata = trial.joined("f", np.float64), trial.joined("i", np.int32)
        anchors = np.empty(6, np.int64)
        center, radius = box.mean(axis=0), 0.5 * float(np.linalg.norm(box[1] - box[0]))
        if not kernels.anchors_meeting(fdata, idata, q, data, *center, radius, anchors):
            anchors[:3] = anchors[3:] = self.start
        return anchors.reshape(2, 3), q, fdata, idata

    def _packed(
        self, packer: Packer, rows: np.ndarray, offsets: np.ndarray, anchors: np.ndarray | None = None
    ) -> list[int]:
        """The source's part of a leaf's head; `anchors` (2, 3) restricts it to a box of anchors."""
        first, last = self._ranges(offsets, anchors)
        low = first.min(axis=0) if len(rows) else self.start
        high = np.maximum(last.max(axis=0), low) if len(rows) else self.start + self.counts - 1
        reach = np.abs(offsets).max(axis=0, initial=0)
        longest = int((high + reach - low).max())
        if longest > _LONGEST:
            raise TooLargeError(
                f"counts: {longest:,} clusters along one direction are more than are searched at once ({_LONGEST:,}); "
                "take a `region` of the lattice"
            )
        powers, growth, generators = [], [], []
        for axis, similarity in enumerate(self.directions):
            steps = 0.5 * np.arange(2 * low[axis], 2 * (high[axis] + reach[axis]) + 1)
            frames = similarity.powers(steps)
            table = np.empty((len(frames), kernels.POWER))
            table[:, :9] = frames[:, :3, :3].reshape(-1, 9)
            table[:, 9:12] = frames[:, :3, 3]
            table[:, 12] = np.exp(similarity.log_scale * steps)
            powers.append(packer.floats(table))
            growth.append(packer.floats(_growth(similarity, len(frames))))
            generator = similarity.generator
            rate = math.hypot(similarity.log_scale, similarity.angle)
            generators.append(packer.floats([*generator[:3, :3].ravel(), *generator[:3, 3], rate]))
        head = [low, high, low, powers, growth, generators, reach]
        index = packer.ints(np.concatenate([*head, np.hstack([offsets, first, last]).ravel()]))
        balls = np.concatenate([rows[:, 0:3], rows[:, 3:6]]) if len(rows) else self.nodes
        center = 0.5 * (balls.min(axis=0) + balls.max(axis=0))
        away = np.linalg.norm(balls - center, axis=1) + (rows[:, 6:8].T.ravel() if len(rows) else 0.0)
        radius = float(away.max())
        data = packer.floats([*center, radius, *self._ball(center, radius, low, high + reach), self._step(radius)])
        return [data, index, 0, 0, 0]

    def _ball(self, center: np.ndarray, radius: float, low: np.ndarray, high: np.ndarray) -> list[float]:
        """A ball round the whole brick, by the arcs along which it is swept."""
        for similarity, first, last in zip(self.directions, low, high, strict=True):
            growth, travel = _growth(similarity, int(last - first) + 1)[-1]
            center = similarity.power(0.5 * (first + last)).apply(center)
            velocity = similarity.generator[:3, :3] @ center + similarity.generator[:3, 3]
            scale = math.exp(0.5 * similarity.log_scale * (first + last))
            radius = radius * scale * growth + travel * float(np.linalg.norm(velocity))
        return [*center, radius]

    def _step(self, radius: float) -> float:
        """A radius with which to start searching: a quarter of the typical length of a beam."""
        middle = self.start + self.counts // 2
        beams = np.array([[*middle, rack] for rack in range(len(self.racks))]).reshape(-1, 4)
        lengths = [0.0]
        if len(beams):
            ends, _ = self.ends(beams)
            lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return max(0.25 * float(np.max(lengths)), radius * self.scales[0], 1e-300)


def _growth(similarity: Similarity, count: int) -> np.ndarray:
    """(count, 2): within half of 0, 1, 2... applications to either side lengths grow at most by the first number, and
    a point moves by its velocity times at most the second."""
    rate, steps = abs(similarity.log_scale), 0.5 * np.arange(count)
    travel = steps if rate == 0.0 else np.expm1(rate * steps) / rate
    return np.stack([np.exp(rate * steps), travel], axis=1)
