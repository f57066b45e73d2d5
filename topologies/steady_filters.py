"""Filters of steady lattices: which nodes stay. A beam stays when both of its nodes do.

`stencil` keeps nodes by index, `lattice_in_lattice` those whose ball meets a coarser lattice, `implicit` those inside
a Solid or where a Field is negative; `&`, `|` and `~` join them. A filtered lattice is never stored: it comes in
blocks of (i, j, k, rack).

Source: Kurzeja, Constructive Lattice Geometry, chapter 9. As there, Lattice-in-Lattice looks at nodes alone: a beam
between two nodes of the coarse lattice may leave it, and a coarse beam thinner than the spacing of the fine nodes may
be missed.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, FileError, Solid, TooLargeError, as_field
from frep.packing import Packer
from frep.progress import progress
from frep.skeleton import BeamLeaf
from frep.steady import SteadySkeleton

from .beams import BeamTopology, graph
from .steady_explicit import BallsAndBeams

if TYPE_CHECKING:
    from frep.overlaps import CleanReport

    from .steady import SteadyLattice

_CLUSTERS = 1 << 18
"""Clusters that are filtered at once."""

_MOST_MARKED = 1_000_000_000
"""Nodes of a filtered coarse lattice: a byte each."""

_MOST_STORED = 20_000_000
"""Beams of an explicit graph."""


class NodeFilter:
    """What decides which nodes of a lattice stay. Joined by `&` (both), `|` (either) and `~` (the others)."""

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        """Which nodes stay of the clusters first <= index < first + span: (span[0], span[1], span[2], n) bool."""
        raise NotImplementedError

    def may_keep(self, low: np.ndarray, high: np.ndarray) -> bool:
        """Whether a node in the box low..high (mm) can stay; where it is not known, True."""
        return True

    def __and__(self, other: NodeFilter) -> NodeFilter:
        return _Joined(np.logical_and, self, other) if isinstance(other, NodeFilter) else NotImplemented

    def __or__(self, other: NodeFilter) -> NodeFilter:
        return _Joined(np.logical_or, self, other) if isinstance(other, NodeFilter) else NotImplemented

    def __invert__(self) -> NodeFilter:
        return _Others(self)


@dataclass(frozen=True, eq=False)
class _Joined(NodeFilter):
    how: np.ufunc
    one: NodeFilter
    other: NodeFilter

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        return self.how(self.one.mask(skeleton, first, span), self.other.mask(skeleton, first, span))

    def may_keep(self, low: np.ndarray, high: np.ndarray) -> bool:
        return bool(self.how(self.one.may_keep(low, high), self.other.may_keep(low, high)))


@dataclass(frozen=True, eq=False)
class _Others(NodeFilter):
    those: NodeFilter

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        return ~self.those.mask(skeleton, first, span)


@dataclass(frozen=True, eq=False)
class _Stencil(NodeFilter):
    pattern: np.ndarray

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        if self.pattern.ndim == 4 and self.pattern.shape[3] != len(skeleton.nodes):
            raise ArgumentError(
                f"pattern: has {self.pattern.shape[3]} entries a cluster, and the lattice {len(skeleton.nodes)} nodes"
            )
        index = [np.arange(f, f + s) % n for f, s, n in zip(first, span, self.pattern.shape, strict=False)]
        kept = self.pattern[np.ix_(*index)]
        shape = (*span.tolist(), len(skeleton.nodes))
        return np.broadcast_to(kept if kept.ndim == 4 else kept[..., None], shape)


def stencil(pattern: Any) -> NodeFilter:
    """Keep the nodes of clusters (i, j, k) where `pattern[i % a, j % b, k % c]` is true.

    Args:
        pattern: an (a, b, c) array of booleans; or (a, b, c, n), one a node of the cluster.

    Raises:
        ArgumentError: another shape.
        ArgumentTypeError: not booleans (or zeros and ones).

    Example:
        >>> import numpy as np
        >>> from topologies.steady import SteadyLattice, Translation
        >>> row = SteadyLattice([(0, 0, 0)], 0.1, [(0, 0, 1)], u=Translation((1, 0, 0)), counts=(10,))
        >>> np.concatenate(list(row.filtered(stencil([[[True]], [[True]], [[False]]])).blocks())).tolist()
        [[0, 0, 0, 0], [3, 0, 0, 0], [6, 0, 0, 0]]
    """
    try:
        array = np.array(pattern)
    except ValueError:
        raise ArgumentError("pattern: expected an (a, b, c) array of booleans, got rows of different lengths") from None
    if array.dtype != bool:
        if array.dtype.kind not in "iu" or not np.all((array == 0) | (array == 1)):
            raise ArgumentTypeError(f"pattern: expected booleans, got {array.dtype} values")
        array = array.astype(bool)
    if array.ndim not in (3, 4) or not array.size:
        raise ArgumentError(f"pattern: expected a non-empty (a, b, c) or (a, b, c, n) array, got shape {array.shape}")
    return _Stencil(array)


@dataclass(frozen=True, eq=False)
class _Implicit(NodeFilter):
    field: Field

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        index = np.meshgrid(*(np.arange(f, f + s) for f, s in zip(first, span, strict=True)), indexing="ij")
        centers = skeleton.balls(*index)[0]
        return (self.field(centers.reshape(-1, 3)) < 0.0).reshape(centers.shape[:-1])

    def may_keep(self, low: np.ndarray, high: np.ndarray) -> bool:
        return bool(self.field.bounds(low, high)[0] < 0.0)


def implicit(shape: Solid | FieldLike) -> NodeFilter:
    """Keep the nodes whose center lies inside a Solid, or where a Field or function of (x, y, z) is negative.

    Example:
        >>> import frep
        >>> from topologies.steady import SteadyLattice, Translation
        >>> row = SteadyLattice([(0, 0, 0)], 0.1, [(0, 0, 1)], u=Translation((1, 0, 0)), counts=(10,))
        >>> row.filtered(implicit(frep.sphere((0, 0, 0), 3.5))).count()
        3
    """
    return _Implicit(shape.field if isinstance(shape, Solid) else as_field(shape, "shape"))


@dataclass(frozen=True, eq=False)
class _InLattice(NodeFilter):
    coarse: SteadyLattice
    keep: NodeFilter | None

    @cached_property
    def _packed(self) -> tuple[np.ndarray, ...]:
        skeleton = self.coarse.skeleton
        packer = Packer()
        head = np.array(BeamLeaf(skeleton, "cone", False, skeleton.radii).pack(packer), np.int64)
        kept = np.zeros((0, 0, 0, 0), np.uint8)
        if self.keep is not None:
            kept = self._kept_nodes(self.keep)
        return (
            head,
            packer.joined("f", np.float64),
            packer.joined("i", np.int32),
            *(np.array(a) for a in (skeleton.edges, kept, skeleton.start)),
        )

    def _kept_nodes(self, keep: NodeFilter) -> np.ndarray:
        skeleton = self.coarse.skeleton
        if skeleton.n_nodes > _MOST_MARKED:
            raise TooLargeError(
                f"coarse: a filtered lattice of {skeleton.n_nodes:,} nodes is more than can be marked ({_MOST_MARKED:,}); "
                "take a `region` of it"
            )
        kept = np.empty((*skeleton.counts.tolist(), len(skeleton.nodes)), np.uint8)
        end = skeleton.start + skeleton.counts
        size = _box_size(skeleton.counts, _CLUSTERS)
        for low in _corners(skeleton.start, end, size):
            span = np.minimum(low + size, end) - low
            at = tuple(slice(a, a + n) for a, n in zip((low - skeleton.start).tolist(), span.tolist(), strict=True))
            kept[at] = keep.mask(skeleton, low, span)
        return kept

    def mask(self, skeleton: SteadySkeleton, first: np.ndarray, span: np.ndarray) -> np.ndarray:
        from frep.filter_kernels import nodes_touching

        out = np.empty((*span.tolist(), len(skeleton.nodes)), np.bool_)
        nodes_touching(skeleton.packed, np.array(skeleton.nodes), np.array(skeleton.radii), first, out, self._packed)
        return out


def lattice_in_lattice(coarse: SteadyLattice | FilteredLattice) -> NodeFilter:
    """Keep the nodes whose ball meets another, coarser lattice: beams made of beams.

    Of a coarse lattice that is itself filtered only the beams that are left count: beams of beams of beams.
    """
    if isinstance(coarse, FilteredLattice):
        return _InLattice(coarse.lattice, coarse.keep)
    if not isinstance(getattr(coarse, "skeleton", None), SteadySkeleton):
        raise ArgumentTypeError(f"coarse: expected a SteadyLattice, got {type(coarse).__name__}: {coarse!r}")
    return _InLattice(coarse, None)


@dataclass(frozen=True, eq=False)
class FilteredLattice:
    """The beams of a steady lattice both of whose nodes pass a filter. Made by `SteadyLattice.filtered`."""

    lattice: SteadyLattice
    keep: NodeFilter | None

    def __repr__(self) -> str:
        return f"<filtered {self.lattice!r}>"

    def blocks(self, block: int = 1_000_000) -> Iterator[np.ndarray]:
        """The beams in blocks of at most about `block` rows (i, j, k, rack), (m, 4) int64, in the order of their
        blocks of indices.

        A block is filtered when it is asked for, and nothing is kept of it.
        """
        if not isinstance(block, int | np.integer) or block < 1:
            raise ArgumentError(f"block: expected a whole number >= 1, got {block!r}")
        skeleton = self.lattice.skeleton
        offsets = skeleton.racks[:, 2:]
        if not len(offsets):
            return
        reach = np.abs(offsets).max(axis=0)
        size = _box_size(skeleton.counts, max(1, min(_CLUSTERS, int(block) // len(offsets))))
        end = skeleton.start + skeleton.counts
        with progress("filtering", total=float(math.prod(map(int, skeleton.counts)))) as advance:
            for low in _corners(skeleton.start, end, size):
                high = np.minimum(low + size, end)
                mask = None
                if self.keep is not None:
                    if not self.keep.may_keep(*skeleton.box_round(low, high - 1)):
                        advance(float(np.prod(high - low)))
                        continue
                    mask = self.keep.mask(skeleton, low, np.minimum(high + reach, end) - low)
                found = [self._of_rack(rack, low, high, mask) for rack in range(len(offsets))]
                advance(float(np.prod(high - low)))
                beams = np.concatenate(found)
                if len(beams):
                    yield beams

    def _of_rack(self, rack: int, low: np.ndarray, high: np.ndarray, mask: np.ndarray | None) -> np.ndarray:
        """The beams of a rack whose anchors lie in low..high; `mask` is of the nodes from low on."""
        skeleton = self.lattice.skeleton
        start, end, *d = skeleton.racks[rack].tolist()
        last = np.minimum(high, skeleton.start + skeleton.spans[rack])
        span = np.maximum(last - low, 0)
        if not span.all():
            return np.zeros((0, 4), np.int64)
        if mask is None:
            anchors = np.indices(span.tolist()).reshape(3, -1).T
        else:
            ends = []
            for node, shift in ((start, [max(0, -n) for n in d]), (end, [max(0, n) for n in d])):
                ends.append(mask[tuple(slice(f, f + n) for f, n in zip(shift, span.tolist(), strict=True))][..., node])
            anchors = np.argwhere(ends[0] & ends[1])
        beams = np.empty((len(anchors), 4), np.int64)
        beams[:, :3] = anchors + low + np.maximum(0, -np.array(d))
        beams[:, 3] = rack
        return beams

    def count(self) -> int:
        """How many beams are left."""
        return sum(len(beams) for beams in self.blocks())

    def graph(self) -> BeamTopology:
        """The beams that are left as an explicit graph, which is stored: for meshing, or for another program.

        Its nodes carry the lattice's radii: `graph().thicken(2 * radii)` with the radii of `explicit`.

        Raises:
            TooLargeError: more than 20 million beams.
            ArgumentError: no beam is left.
        """
        nodes, _, edges = self.explicit()
        return graph(nodes, edges)

    def explicit(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What is left as arrays: nodes (n, 3) and radii (n,) in mm, beams (m, 2) as node numbers. Raises as
        `graph`."""
        found, total = [], 0
        for beams in self.blocks():
            found.append(beams)
            total += len(beams)
            if total > _MOST_STORED:
                raise TooLargeError(
                    f"more than {_MOST_STORED:,} beams are left: take them in blocks (`blocks`), or a `region` of the lattice"
                )
        if not total:
            raise ArgumentError("the filter leaves no beam")
        beams = np.concatenate(found)
        skeleton = self.lattice.skeleton
        racks = skeleton.racks[beams[:, 3]]
        sizes = (*skeleton.counts.tolist(), len(skeleton.nodes))
        keys = []
        for node, clusters in ((racks[:, 0], beams[:, :3]), (racks[:, 1], beams[:, :3] + racks[:, 2:])):
            keys.append(np.ravel_multi_index((*(clusters - skeleton.start).T, node), sizes))
        nodes, edges = np.unique(np.stack(keys, axis=1), return_inverse=True)
        *cluster, node = np.unravel_index(nodes, sizes)
        points, radii = skeleton.placed(np.stack(cluster, axis=1) + skeleton.start, node)
        return points, radii, edges.reshape(-1, 2)

    def solid(self) -> Solid:
        """What is left as a Solid of cone-beams. Raises as `graph`."""
        nodes, radii, edges = self.explicit()
        return graph(nodes, edges).thicken(2.0 * radii)

    # --- what a lattice answers; `frep lattice` takes a filtered one too ---------------------------------------------

    @property
    def counts(self) -> np.ndarray:
        """(3,) clusters along each direction, before the filter."""
        return self.lattice.counts

    @property
    def start(self) -> np.ndarray:
        """(3,) first index along each direction."""
        return self.lattice.start

    @property
    def racks(self) -> np.ndarray:
        """(m, 5) racks, before the filter."""
        return self.lattice.racks

    @cached_property
    def n_beams(self) -> int:
        """How many beams are left: they are counted."""
        return self.count()

    @property
    def n_nodes(self) -> int:
        """How many balls are left that have a beam. Raises TooLargeError as `graph`."""
        return self.written_out.n_nodes

    def beams(self, block: int = 1_000_000) -> Iterator[np.ndarray]:
        """The beams in blocks; see `blocks`."""
        return self.blocks(block)

    def ends(self, beams: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m, 2, 3) and their radii (m, 2), mm, of beams given as (m, 4) rows (i, j, k, rack)."""
        return self.lattice.ends(beams)

    def region(self, start: Any, span: Any) -> FilteredLattice:
        """The same of some clusters; see `SteadyLattice.region`. Which nodes stay depends on their index and place alone."""
        return FilteredLattice(self.lattice.region(start, span), self.keep)

    def outline(self) -> list[np.ndarray]:
        """The edges of the brick before the filter, as polylines (n, 3), mm."""
        return self.lattice.outline()

    @cached_property
    def written_out(self) -> BallsAndBeams:
        """What is left, ball by ball. Raises TooLargeError as `graph`."""
        if not self.n_beams:
            return BallsAndBeams(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2), np.int64))
        return BallsAndBeams(*self.explicit())

    def clean(self) -> CleanReport:
        """Whether what is left are hubs that keep apart, and by how much they overlap if not."""
        return self.written_out.clean()

    def volume(self) -> float:
        """Volume in mm3, hub by hub: of stored beams. Raises as `graph`; ArgumentError where hubs overlap."""
        return self.written_out.volume()

    def area(self) -> float:
        """Surface area in mm2. Raises as `volume`."""
        return self.written_out.area()

    def centroid(self) -> np.ndarray:
        """(3,) centre of mass, mm. Raises as `volume`."""
        return self.written_out.centroid()

    def inertia(self) -> np.ndarray:
        """(3, 3) inertia tensor about the centroid at unit density, mm5. Raises as `volume`."""
        return self.written_out.inertia()

    def save(self, path: str | os.PathLike[str], *, most: int | None = 50_000_000) -> None:
        """Write the balls and beams that are left (.txt): a filter is no part of a model.

        Raises:
            FileError: another suffix, no such folder, no space.
            TooLargeError: more than `most` beams (None is any number), or as `graph`.
        """
        if not os.fspath(path).lower().endswith(".txt"):
            raise FileError(
                f"path: {os.fspath(path)!r}: a filtered lattice is written as balls and beams, .txt; "
                "a model (.json, .py) holds no filter"
            )
        self.written_out.save(path, most=most)


def _box_size(counts: np.ndarray, most: int) -> np.ndarray:
    """A box of about `most` clusters, as near to a cube as the counts allow: few layers are filtered twice."""
    size = np.ones(3, np.int64)
    for left, axis in zip((3, 2, 1), np.argsort(counts), strict=True):
        size[axis] = max(1, min(int(counts[axis]), int((most / int(size.prod())) ** (1 / left) + 1e-9)))
    return size


def _corners(start: np.ndarray, end: np.ndarray, size: np.ndarray) -> Iterator[np.ndarray]:
    for i in range(int(start[0]), int(end[0]), int(size[0])):
        for j in range(int(start[1]), int(end[1]), int(size[1])):
            for k in range(int(start[2]), int(end[2]), int(size[2])):
                yield np.array([i, j, k])
