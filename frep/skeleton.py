"""Skeletons: beams of zero thickness, periodic or explicit, and what gives them thickness.

A skeleton answers one question, the ball-interference query (BIQ): *which beams meet the ball (c, r)?* The sampler
asks it to bound a box and to make the short list of beams that a leaf block evaluates. `PeriodicSkeleton` folds the
ball into its cell; `GraphSkeleton` looks it up in a uniform grid of segment lists; `SteadySkeleton` (`frep/steady.py`)
descends its index brick. Values and bounds come from `frep/beam_kernels.py`.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from .beam_kernels import CONE, ROUND, SQUARE
from .biq_kernels import CAPACITY, GRAPH, HEAD, PERIODIC, R_CELL, R_ID, ROW, SEGMENT, gather
from .errors import ArgumentError, TooLargeError
from .field import Field, constant, leaf_field
from .packing import Packer, digest

Section = Literal["circle", "cone", "square"]
Source = tuple[int, np.ndarray, list[int]]
"""Which `gather` of `frep/biq_kernels.py` answers, the segments it answers with, and what it needs to know."""

_SECTIONS = {"circle": ROUND, "cone": CONE, "square": SQUARE}


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Nodes joined by straight beams. Base of the sources.

    Attributes:
        nodes: (n, 3) float64 positions in mm.
        edges: (m, 2) int64 node numbers.
    """

    nodes: np.ndarray
    edges: np.ndarray

    def segments(self) -> np.ndarray:
        """(m, 2, 3) end points of the beams (of one period, for a periodic skeleton)."""
        return self.nodes[self.edges]

    def beams_meeting(self, center, radius: float, most: int | None = None) -> np.ndarray:
        """The beams whose axis comes within `radius` mm of `center`: (n, 4) int64 rows (edge, i, j, k).

        `i, j, k` number the period; they are zero for an explicit graph.

        Raises:
            ArgumentError: radius negative or not finite, center not three finite numbers.
            TooLargeError: more than `most` beams.
        """
        c = np.asarray(center, float)
        if c.shape != (3,) or not np.all(np.isfinite(c)):
            raise ArgumentError(f"center: expected three finite numbers, got {center!r}")
        if not (math.isfinite(radius) and radius >= 0):
            raise ArgumentError(f"radius: expected a finite number >= 0, got {radius!r}")
        rows = np.empty((CAPACITY, ROW))
        while (n := gather(*self.packed, *c, float(radius), 0, rows)) > len(rows):
            if most is not None and n > most:
                raise TooLargeError(f"radius: more than {most:,} beams meet the ball of {radius:g} mm")
            rows = np.empty((max(n, 4 * len(rows)), ROW))
        return rows[:n, R_ID : R_CELL + 3].astype(np.int64)

    @cached_property
    def packed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Head, `fdata` and `idata` of its axes, for `gather`."""
        packer = Packer()
        head = np.zeros(HEAD, np.int64)
        leaf = BeamLeaf(self, "circle", blended=False).pack(packer)
        head[: len(leaf)] = leaf
        return head, packer.joined("f", np.float64), packer.joined("i", np.int32)

    @property
    def content_key(self) -> bytes:
        """Equal for equal skeletons."""
        raise NotImplementedError

    def _source(self, packer: Packer, rows: np.ndarray, box: np.ndarray | None = None) -> Source:
        """What answers `gather` for the segments `rows`. Only beams that come near the box (2, 3) will be asked for."""
        raise NotImplementedError

    @property
    def lone_nodes(self) -> np.ndarray:
        """Nodes that have no beam, and are balls of their own radius."""
        return np.zeros(0, np.int64)

    @property
    def scales(self) -> tuple[float, float]:
        """The smallest and largest factor by which stored radii are multiplied."""
        return 1.0, 1.0

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) box of the axes; infinite for a periodic skeleton."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class PeriodicSkeleton(Skeleton):
    """A cell of beams that repeats through all space.

    `size` (3,) is the period in mm. Edges that coincide after a shift by whole periods are given once.
    """

    size: np.ndarray

    @property
    def bounds(self) -> np.ndarray:
        return np.array([[-np.inf] * 3, [np.inf] * 3])

    @property
    def content_key(self) -> bytes:
        return digest(b"periodic", self.nodes, self.edges, self.size)

    def _source(self, packer: Packer, rows: np.ndarray, box: np.ndarray | None = None) -> Source:
        largest = rows[:, 6:8].max(initial=0.0)
        data = packer.floats([*self.size, largest])
        return PERIODIC, rows, [data, 0, 0, 0, 0]


@dataclass(frozen=True, eq=False)
class GraphSkeleton(Skeleton):
    """An explicit, finite graph of beams."""

    @property
    def bounds(self) -> np.ndarray:
        return np.array([self.nodes.min(axis=0), self.nodes.max(axis=0)])

    @property
    def content_key(self) -> bytes:
        return digest(b"graph", self.nodes, self.edges)

    def _source(self, packer: Packer, rows: np.ndarray, box: np.ndarray | None = None) -> Source:
        return indexed(packer, rows)


def indexed(packer: Packer, rows: np.ndarray) -> Source:
    """The source of explicit segments: a uniform grid of lists of them."""
    lo = np.minimum(rows[:, 0:3], rows[:, 3:6])
    hi = np.maximum(rows[:, 0:3], rows[:, 3:6])
    origin, extent = lo.min(axis=0), hi.max(axis=0) - lo.min(axis=0)
    # About two segments a cell, and no cell much finer than a segment is long.
    volume = float(np.prod(np.maximum(extent, 1e-3 * max(extent.max(), 1e-9))))
    spacing = max((2.0 * volume / len(rows)) ** (1 / 3), 0.5 * float(np.mean((hi - lo).max(axis=1))), 1e-9)
    shape = np.maximum(np.ceil(extent / spacing).astype(np.int64), 1)
    starts, entries = _segment_lists(lo, hi, origin, spacing, shape)
    data = packer.floats([*origin, spacing, rows[:, 6:8].max(initial=0.0)])
    index = packer.ints(np.concatenate([starts, entries]))
    return GRAPH, rows, [data, index, *(int(n) for n in shape)]


def _segment_lists(lo, hi, origin, spacing, shape) -> tuple[np.ndarray, np.ndarray]:
    """For each cell of a uniform grid the segments whose bounding box touches it, as starts and entries."""
    first = np.clip(np.floor((lo - origin) / spacing).astype(np.int64), 0, shape - 1)
    last = np.clip(np.floor((hi - origin) / spacing).astype(np.int64), 0, shape - 1)
    span = last - first + 1
    count = span.prod(axis=1)
    seg = np.repeat(np.arange(len(lo)), count)
    # The running number of each entry within its segment, taken apart into (i, j, k).
    local = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    k = local % span[seg, 2]
    j = local // span[seg, 2] % span[seg, 1]
    i = local // (span[seg, 2] * span[seg, 1])
    cell = ((first[seg, 0] + i) * shape[1] + first[seg, 1] + j) * shape[2] + first[seg, 2] + k
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(int(shape.prod()) + 1))
    return starts.astype(np.int32), seg[order].astype(np.int32)


@dataclass(frozen=True, eq=False)
class BeamLeaf:
    """The data of a Field that measures the distance to a skeleton with sections. Made by `beam_field`."""

    skeleton: Skeleton
    section: Section
    blended: bool
    node_radii: np.ndarray | None = None
    with_nodes: bool = False
    ball_radii: np.ndarray | None = None

    @property
    def name(self) -> str:
        return "beams"

    @cached_property
    def content_key(self) -> bytes:
        h = hashlib.blake2b(self.skeleton.content_key, digest_size=16)
        h.update(f"{self.section} {self.blended} {self.with_nodes}".encode())
        for radii in (self.node_radii, self.ball_radii):
            if radii is not None:
                h.update(f"{len(radii)}".encode())
                h.update(np.ascontiguousarray(radii).tobytes())
        return h.digest()

    @cached_property
    def _rows(self) -> np.ndarray:
        """(m, SEGMENT) beams, then node balls as segments of no length."""
        sk = self.skeleton
        beams = np.zeros((len(sk.edges), SEGMENT))
        beams[:, 0:6] = sk.segments().reshape(-1, 6)
        if self.node_radii is not None:
            beams[:, 6:8] = self.node_radii[sk.edges]
        if self.node_radii is not None:
            beams = np.concatenate([beams, self._balls(sk.lone_nodes, self.node_radii)])
        if self.ball_radii is not None:
            beams = np.concatenate([beams, self._balls(np.flatnonzero(self.ball_radii > 0.0), self.ball_radii)])
        if not self.with_nodes:
            return beams
        nodes = self._balls(np.arange(len(sk.nodes)), np.zeros(len(sk.nodes)))
        return np.concatenate([beams, _distinct_nodes(nodes, sk)])

    def _balls(self, numbers: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Nodes as segments of no length."""
        balls = np.zeros((len(numbers), SEGMENT))
        balls[:, 0:3] = balls[:, 3:6] = self.skeleton.nodes[numbers]
        balls[:, 6] = balls[:, 7] = radii[numbers]
        balls[:, 8] = 1.0
        return balls

    def pack(self, packer: Packer, box: np.ndarray | None = None) -> list[int]:
        """The head of the leaf. Where it will only be asked near a `box` (2, 3) of lattice space, its source may know
        less."""
        source, rows, data = self.skeleton._source(packer, self._rows, box)
        segments = packer.floats(rows)
        return [source, _SECTIONS[self.section], int(self.blended), int(self.with_nodes), segments, len(rows), *data]


def _distinct_nodes(rows: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Node balls of a periodic cell, each once: corners shared by cells are one node of the period."""
    if not isinstance(skeleton, PeriodicSkeleton):
        return rows
    folded = np.round(np.mod(rows[:, 0:3] / skeleton.size, 1.0), 9) % 1.0
    _, first = np.unique(folded, axis=0, return_index=True)
    return rows[np.sort(first)]


def beam_field(
    skeleton: Skeleton,
    *,
    section: Section = "circle",
    width: Field | None = None,
    fillet: Field | None = None,
    node_radius: Field | None = None,
    node_radii: np.ndarray | None = None,
    ball_radii: np.ndarray | None = None,
    blend: Field | None = None,
) -> Field:
    """Signed distance (mm) to the beams of a skeleton, and to its node balls.

    Args:
        skeleton: the topology.
        section: "circle", "cone" or "square".
        width: radius of a circle, side of a square; unused for cones.
        fillet: fillet radius of a square's corners.
        node_radius: radius of a ball at each node; None for no balls.
        node_radii: (n,) radius at each node, for cones.
        ball_radii: (n,) radius of a ball at each node, 0 for none, for cones; instead of `node_radius`.
        blend: radius of the fillet between beams; None for a hard union.

    The value is an exact distance outside where the widths are constant and nothing blends; with a varying width its
    slope is at most one plus that of the width (lf-rep section 2).
    """
    args = [constant(0.0) if a is None else a for a in (width, fillet, node_radius, blend)]
    leaf = BeamLeaf(skeleton, section, blend is not None, node_radii, node_radius is not None, ball_radii)
    return leaf_field("beams", leaf, *args)
