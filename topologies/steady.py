"""Steady lattices: bricks of clusters of nodes, `C[i,j,k] = W^k V^j U^i C0`, joined by racks of beams.

A dozen numbers describe curved, tapered and twisted lattices of any size. Beams are computed when they are asked for,
and only those that a query, a window or a slice needs; whole-lattice volumes, areas and inertias come from sums in
closed form.

    lattice = SteadyLattice(
        nodes=[(0, 0, 0)], radii=[0.1], racks=[(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)],
        u=Translation((1, 0, 0)), v=Screw(0.02, "z", point=(-60, 0, 0)), w=Translation((0, 0, 1)), counts=(1000, 300, 1000),
    )
    part = lattice.solid() & frep.box((500, 0, 500), (510, 10, 510))

Boundary rule: a rack has a beam wherever both of its clusters exist; what would reach out of the brick is left out.

Source: Gupta et al., Programmed-Lattice Editor; Kurzeja, Constructive Lattice Geometry, chapters 2, 3, 6 and 7.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, FieldLike, Solid
from frep.arguments import real, vector
from frep.similarity import Screw, Similarity, Swirl, Translation, planar
from frep.steady import SteadySkeleton
from frep.thicken import Rectangle, thickened

from .steady_filters import FilteredLattice, NodeFilter, implicit, lattice_in_lattice, stencil

if TYPE_CHECKING:
    from frep.integrals import CleanReport, LatticeIntegrals

__all__ = [
    "FilteredLattice",
    "NodeFilter",
    "Screw",
    "Similarity",
    "SteadyLattice",
    "Swirl",
    "Translation",
    "implicit",
    "lattice_in_lattice",
    "planar",
    "stencil",
]

_LOOKED_AT = 48
"""Clusters along each direction at which contained balls are looked for."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyLattice:
    """A steady lattice: clusters of nodes and racks of beams between them.

    Args:
        nodes: (n, 3) nodes of cluster (0, 0, 0), mm.
        radii: their radii in mm, (n,) or one number. Radii grow with the scales of u, v and w.
        racks: rows (start node, end node, di, dj, dk): beams from the start node of each cluster (i, j, k) to the end
            node of (i + di, j + dj, k + dk). Offsets may be negative.
        u, v, w: similarities from one cluster to the next (`Translation`, `Screw`, `Swirl`...): cluster (i, j, k) is
            W^k V^j U^i applied to cluster (0, 0, 0). None where there is only one.
        counts: clusters along each direction: three numbers, or one or two for a row or a slab.
        start: the first index of each direction; see `region`.

    Beams are cone-beams: the convex hull of two balls.

    Raises:
        ArgumentError: shapes, node numbers out of range, radii not positive, counts below 1, a rack that leaves the
            brick entirely or joins a node to itself, or a ball that lies inside its neighbour.
        ArgumentTypeError: u, v, w that are not similarities, counts that are not whole numbers.

    Example:
        >>> grid = SteadyLattice(
        ...     nodes=[(0, 0, 0)], radii=0.1, racks=[(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)],
        ...     u=Translation((1, 0, 0)), v=Translation((0, 1, 0)), w=Translation((0, 0, 1)), counts=(1000, 1000, 1000),
        ... )
        >>> grid.n_beams
        2997000000
        >>> grid.beams_meeting((500.5, 500, 500), 0.2).tolist()
        [[500, 500, 500, 0]]
    """

    nodes: Any
    radii: Any
    racks: Any
    u: Similarity
    v: Similarity | None = None
    w: Similarity | None = None
    counts: Any = (1, 1, 1)
    start: Any = (0, 0, 0)

    def __post_init__(self) -> None:
        nodes = _table(self.nodes, "nodes", 3)
        radii = _radii(self.radii, len(nodes))
        counts = _counts(self.counts)
        start = _whole(self.start, "start", (3,))
        directions = [
            _similarity(s, name, n) for s, name, n in zip((self.u, self.v, self.w), "uvw", counts, strict=True)
        ]
        racks = _racks(self.racks, len(nodes), nodes)
        for name, value in [("nodes", nodes), ("radii", radii), ("racks", racks), ("counts", counts), ("start", start)]:
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        for name, similarity in zip("uvw", directions, strict=True):
            object.__setattr__(self, name, similarity)
        for number, rack in enumerate(racks):
            if np.any(np.abs(rack[2:]) >= counts):
                raise ArgumentError(
                    f"racks: rack {number} with offset {tuple(rack[2:].tolist())} leaves a brick of "
                    f"{tuple(counts.tolist())} clusters entirely"
                )
        _refuse_what_stands_still(self.skeleton)
        _refuse_contained_balls(self.skeleton)

    @classmethod
    def spanning(cls, nodes, radii, racks, u, v=None, w=None, counts: Any = (1, 1, 1)) -> SteadyLattice:
        """A lattice built from *cumulative* similarities: u takes the first cluster along i to the last, and so on.

        The step between neighbours is u to the power 1 / (count - 1), so that the ends stay where they are when the
        count changes (the interpolating design of thesis section 2.6.1).

        Example:
            >>> arch = SteadyLattice.spanning([(10, 0, 0)], 0.5, [(0, 0, 1)], u=Screw(3.14159, "z"), counts=(13,))
            >>> arch.balls(12, 0, 0)[0].round(4).tolist()
            [[-10.0, 0.0, 0.0]]
        """
        steps = []
        for total, n, name in zip((u, v, w), _counts(counts), "uvw", strict=True):
            total = _similarity(total, name, n)
            steps.append(total.power(1.0 / (n - 1)) if n > 1 else total)
        return cls(nodes, radii, _padded(racks), *steps, counts=counts)

    def __repr__(self) -> str:
        counts = " x ".join(str(n) for n in self.counts)
        return f"<steady lattice of {counts} clusters: {self.n_nodes:,} nodes, {self.n_beams:,} beams>"

    # --- what it consists of -----------------------------------------------------------------------------------------

    @cached_property
    def skeleton(self) -> SteadySkeleton:
        """Its nodes and beams as a skeleton, which answers ball queries."""
        u, v, w = (s or Similarity.identity() for s in (self.u, self.v, self.w))
        return SteadySkeleton(
            nodes=self.nodes, radii=self.radii, racks=self.racks, u=u, v=v, w=w, counts=self.counts, start=self.start
        )

    @property
    def n_nodes(self) -> int:
        """How many nodes there are, exactly."""
        return self.skeleton.n_nodes

    @property
    def n_beams(self) -> int:
        """How many beams there are, exactly."""
        return self.skeleton.n_beams

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) box in mm that holds it; of large lattices a little larger than need be."""
        return self.solid().bounds

    def balls(self, i, j, k) -> tuple[np.ndarray, np.ndarray]:
        """Centers (..., n, 3) and radii (..., n), mm, of the nodes of clusters (i, j, k): numbers or arrays, real ones
        as well."""
        indices = (_numbers(index, name, "numbers") for index, name in zip((i, j, k), "ijk", strict=True))
        return self.skeleton.balls(*indices)

    def ends(self, beams) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m, 2, 3) and their radii (m, 2), mm, of beams given as (m, 4) rows (i, j, k, rack)."""
        rows = _whole(beams, "beams", (None, 4))
        there = (rows[:, 3] >= 0) & (rows[:, 3] < len(self.racks))
        racks = np.zeros((len(rows), 5), np.int64)
        racks[there] = self.racks[rows[there, 3]]
        for clusters in (rows[:, :3], rows[:, :3] + racks[:, 2:]):
            there &= np.all((clusters >= self.start) & (clusters < self.start + self.counts), axis=1)
        if not there.all():
            raise ArgumentError(
                f"beams: {tuple(rows[np.argmin(there)].tolist())} (i, j, k, rack) is no beam of this lattice"
            )
        return self.skeleton.ends(rows)

    def beams(self, block: int = 1_000_000) -> Iterator[np.ndarray]:
        """All beams, in blocks of at most about `block` rows (i, j, k, rack): (m, 4) int64. Nothing else is stored."""
        return FilteredLattice(self, None).blocks(block)

    def region(self, start, span) -> SteadyLattice:
        """The clusters start <= index < start + span alone, with their beams; indices stay those of the whole lattice.

        Raises:
            ArgumentError: the region reaches out of the lattice, or a span below 1.
        """
        first, spans = _whole(start, "start", (3,)), _whole(span, "span", (3,))
        if np.any(spans < 1):
            raise ArgumentError(f"span: expected whole numbers >= 1, got {span!r}")
        if np.any(first < self.start) or np.any(first + spans > self.start + self.counts):
            raise ArgumentError(
                f"start, span: {tuple(first.tolist())} + {tuple(spans.tolist())} reaches out of the lattice, whose indices "
                f"run from {tuple(self.start.tolist())} to {tuple((self.start + self.counts - 1).tolist())}"
            )
        return self._copy(self.racks, spans, first)

    def select(self, racks) -> SteadyLattice:
        """The same nodes with some of the racks only, given by number."""
        numbers = _whole(racks, "racks", (None,))
        if len(numbers) and (numbers.min() < 0 or numbers.max() >= len(self.racks)):
            raise ArgumentError(f"racks: expected numbers in 0..{len(self.racks) - 1}, got {racks!r}")
        return self._copy(self.racks[numbers], self.counts, self.start)

    def _copy(self, racks: np.ndarray, counts: np.ndarray, start: np.ndarray) -> SteadyLattice:
        # What is valid stays valid, though racks may now have no beam: no further checks.
        lattice = object.__new__(SteadyLattice)
        for name in ("nodes", "radii", "u", "v", "w"):
            object.__setattr__(lattice, name, getattr(self, name))
        for name, value in (("racks", racks), ("counts", counts), ("start", start)):
            object.__setattr__(lattice, name, value)
        return lattice

    def filtered(self, keep: NodeFilter | Solid | Field) -> FilteredLattice:
        """Only the beams both of whose nodes pass a filter (`stencil`, `lattice_in_lattice`, `implicit`, joined by & | ~).

        A Solid or a Field is short for `implicit` of it. Balls without beams are not kept.

        Raises:
            ArgumentTypeError: something else.
        """
        if isinstance(keep, Solid | Field):
            keep = implicit(keep)
        if not isinstance(keep, NodeFilter):
            raise ArgumentTypeError(f"keep: expected a filter, a Solid or a Field, got {type(keep).__name__}: {keep!r}")
        return FilteredLattice(self, keep)

    # --- as a solid --------------------------------------------------------------------------------------------------

    def solid(self) -> Solid:
        """The lattice as a Solid: its balls and cone-beams. The field is an exact distance outside.

        Beams are found by ball queries as they are needed: intersect with a box and mesh that, whatever the size of
            the whole.
        """
        return self.thicken(2.0 * self.radii)

    def thicken(
        self,
        diameter: FieldLike | np.ndarray | list[float],
        *,
        node: FieldLike | np.ndarray | list[float] | None = None,
        section: str | Rectangle = "circle",
        blend: FieldLike = 0.0,
    ) -> Solid:
        """Beams of another diameter than the nodes' own: as `BeamTopology.thicken`, whose documentation describes the
        arguments.

        A list of diameters is one a node of the cluster; these grow with the scales of u, v and w, as the lattice's
        own radii do. A number or a Field is a diameter in mm as it stands.
        """
        return thickened(self.skeleton, diameter, node=node, section=section, blend=blend, label="steady lattice")

    # --- files and display -------------------------------------------------------------------------------------------

    def save(self, path: str | Path, *, most: int | None = 50_000_000) -> None:
        """Write the model (.json), a program that makes it (.py), or its balls and beams (.txt); see `steady_files`.

        Raises:
            FileError: another suffix, no such folder, no space.
            TooLargeError: a text file of more than `most` beams; None writes any number.
        """
        from .steady_files import save

        save(self, path, most=most)

    @classmethod
    def load(cls, path: str | Path) -> SteadyLattice:
        """Read a model (.json) back.

        Raises:
            FileError: no such file, or not a model.
        """
        from .steady_files import read_json

        return read_json(path)

    def outline(self) -> list[np.ndarray]:
        """The edges of the brick as polylines (n, 3), mm, for display; see `topologies.steady_curves`."""
        from .steady_curves import outline

        return outline(self)

    # --- queries -----------------------------------------------------------------------------------------------------

    def beams_meeting(self, center, radius: float) -> np.ndarray:
        """The beams that meet a ball (BIQ): (n, 4) int64 rows (i, j, k, rack), (i, j, k) the cluster of the start node.

        Raises:
            ArgumentError: a radius that is negative or not finite, a center that is not three finite numbers.
        """
        from frep.rangefinder import find_beams

        return find_beams(self.skeleton, vector(center, "center")[None], _radius(radius))[:, 1:]

    def nodes_meeting(self, center, radius: float) -> np.ndarray:
        """The node balls that meet a ball: (n, 4) int64 rows (i, j, k, node). Raises as `beams_meeting`."""
        from frep.rangefinder import find_nodes

        return find_nodes(self.skeleton, vector(center, "center")[None], _radius(radius))[:, 1:]

    def contains(self, points) -> np.ndarray:
        """Which of (n, 3) points lie in a beam or ball: (n,) bool; for one point a bool. The surface counts as
        inside."""
        from frep.rangefinder import contains

        return contains(self.skeleton, points)

    def nearest(self, points) -> tuple[np.ndarray, np.ndarray]:
        """The beam nearest to each of (n, 3) points: rows (n, 4) (i, j, k, rack), and signed distances (n,) in mm.

        Rays: `solid().first_hit(origins, directions)`. Many balls at once, and by which method: `frep.rangefinder`.

        Raises:
            ArgumentError: points of another shape or not finite; a lattice without beams.
        """
        from frep.rangefinder import nearest

        return nearest(self.skeleton, points)

    # --- integral properties -----------------------------------------------------------------------------------------

    @cached_property
    def integrals(self) -> LatticeIntegrals:
        """All integral properties, by sums over hubs in closed form; see `frep/integrals.py`.

        Raises:
            ArgumentError: the lattice is not clean: hubs overlap; says where and by how much.
        """
        from frep.integrals import integrals

        return integrals(self.skeleton)

    def volume(self) -> float:
        """Volume in mm3 of the union of all beams. Raises as `integrals`."""
        return self.integrals.volume

    def area(self) -> float:
        """Surface area in mm2. Raises as `integrals`."""
        return self.integrals.area

    def centroid(self) -> np.ndarray:
        """(3,) centre of mass, mm. Raises as `integrals`."""
        return self.integrals.centroid

    def inertia(self) -> np.ndarray:
        """(3, 3) inertia tensor about the centroid at unit density, mm5. Raises as `integrals`."""
        return self.integrals.inertia

    def clean(self) -> CleanReport:
        """Whether hubs (nodes with their half-beams) keep apart, and by how much they overlap if not."""
        from frep.integrals import clean_report

        return clean_report(self.skeleton)


# --- what the constructor accepts ------------------------------------------------------------------------------------


def _numbers(value: Any, name: str, accepted: str) -> np.ndarray:
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected {accepted}, got {value!r}") from None


def _radius(value: Any) -> float:
    radius = real(value, "radius", "mm")
    if radius < 0.0:
        raise ArgumentError(f"radius: expected a finite number >= 0 in mm, got {value!r}")
    return radius


def _table(value: Any, name: str, columns: int) -> np.ndarray:
    array = _numbers(value, name, f"an (n, {columns}) array of numbers")
    if array.ndim != 2 or array.shape[1] != columns or not len(array):
        raise ArgumentError(f"{name}: expected a non-empty (n, {columns}) array, got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ArgumentError(
            f"{name}: expected finite numbers, row {int(np.argwhere(~np.isfinite(array))[0, 0])} has others"
        )
    return array


def _whole(value: Any, name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    array = _numbers(value, name, "whole numbers")
    if array.size == 0 and None in shape:
        array = array.reshape([0 if n is None else n for n in shape])
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise ArgumentError(f"{name}: expected whole numbers of shape ({wanted}), got shape {array.shape}")
    if not np.all(array == np.floor(array)) or not np.all(np.abs(array) < 2**53):
        raise ArgumentTypeError(f"{name}: expected whole numbers, got {value!r}")
    return array.astype(np.int64)


def _radii(value: Any, n: int) -> np.ndarray:
    radii = _numbers(value, "radii", f"one positive number or {n}, mm")
    if radii.shape not in ((), (n,)):
        raise ArgumentError(f"radii: expected one number or one for each of {n} nodes, got shape {radii.shape}")
    radii = np.broadcast_to(radii, (n,)).copy()
    bad = np.flatnonzero(~(np.isfinite(radii) & (radii > 0)))
    if len(bad):
        raise ArgumentError(f"radii: expected finite radii > 0 mm, node {bad[0]} has {radii[bad[0]]:g}")
    return radii


def _counts(value: Any) -> np.ndarray:
    numbers = _numbers(value, "counts", "one to three whole numbers")
    if np.asarray(value).dtype.kind not in "iuf" or not np.all(numbers == np.floor(numbers)):
        raise ArgumentTypeError(f"counts: expected one to three whole numbers, got {value!r}")
    given = _whole(np.atleast_1d(numbers), "counts", (None,))
    if not 1 <= len(given) <= 3:
        raise ArgumentError(f"counts: expected one to three whole numbers, got {value!r}")
    counts = np.ones(3, np.int64)
    counts[: len(given)] = given
    if np.any(counts < 1):
        raise ArgumentError(f"counts: expected at least 1 cluster along each direction, got {value!r}")
    return counts


def _similarity(value: Any, name: str, count: int) -> Similarity:
    if value is None and count == 1:
        return Similarity.identity()
    if not isinstance(value, Similarity):
        raise ArgumentTypeError(
            f"{name}: expected a similarity such as Translation((1, 0, 0)) for {count} clusters, got {value!r}"
        )
    return value


def _padded(racks: Any) -> Any:
    """Racks of rows and slabs may leave out the offsets along directions that have one cluster only."""
    if isinstance(racks, np.ndarray) and racks.ndim == 2:
        return [[*row, *[0] * (5 - len(row))] for row in racks.tolist()]
    if isinstance(racks, list | tuple) and all(isinstance(r, list | tuple) and 3 <= len(r) <= 5 for r in racks):
        return [[*row, *[0] * (5 - len(row))] for row in racks]
    return racks


def _racks(value: Any, n: int, nodes: np.ndarray) -> np.ndarray:
    racks = _whole(_padded(value), "racks", (None, 5))
    if len(racks) and (racks[:, :2].min() < 0 or racks[:, :2].max() >= n):
        raise ArgumentError(
            f"racks: node numbers must lie in 0..{n - 1}, got {racks[:, :2].min()} to {racks[:, :2].max()}"
        )
    seen: dict[tuple[int, ...], int] = {}
    for number, (start, end, *offset) in enumerate(racks.tolist()):
        if start == end and not any(offset):
            raise ArgumentError(f"racks: rack {number} joins node {start} to itself")
        back = (end, start, *(-d for d in offset))
        before = seen.setdefault(min((start, end, *offset), back), number)
        if before != number:
            raise ArgumentError(f"racks: racks {before} and {number} are the same beams; give one of them")
    return racks


def _refuse_what_stands_still(skeleton: SteadySkeleton) -> None:
    """A direction that moves no node puts all its clusters in one place; one that grows beyond a float puts them
    nowhere."""
    for name, similarity, count, first in zip("uvw", skeleton.directions, skeleton.counts, skeleton.start, strict=True):
        if count == 1:
            continue
        farthest = max(abs(int(first)), abs(int(first + count - 1)))
        if abs(similarity.log_scale) * farthest > 600.0:
            raise ArgumentError(
                f"counts: a scale of {similarity.scale:g} to the power {farthest} is beyond a float ({name})"
            )
        moved = np.linalg.norm(similarity.apply(skeleton.nodes) - skeleton.nodes, axis=1)
        if np.all(moved <= 1e-9 * skeleton.radii):
            raise ArgumentError(f"{name}: {similarity!r} moves no node, so that {count} clusters would be in one place")


def _refuse_contained_balls(skeleton: SteadySkeleton) -> None:
    """A ball inside its neighbour has no beam to it. Looked for at up to 48 x 48 clusters (u, v; along w all scale
    alike)."""
    for number, (span, offset) in enumerate(zip(skeleton.spans, skeleton.racks[:, 2:], strict=True)):
        if not span.all():
            continue
        axes = [np.unique(np.linspace(0, n - 1, min(int(n), _LOOKED_AT)).round().astype(np.int64)) for n in span[:2]]
        i, j = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
        clusters = np.stack([i, j, np.zeros_like(i)], axis=1) + skeleton.start + np.maximum(0, -offset)
        beams = np.column_stack([clusters, np.full(len(i), number)])
        ends, radii = skeleton.ends(beams)
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        inside = np.flatnonzero(lengths <= np.abs(radii[:, 0] - radii[:, 1]) + 1e-9 * radii.max())
        if len(inside):
            worst = inside[0]
            small = int(np.argmin(radii[worst]))
            cluster = clusters[worst], clusters[worst] + offset
            node = skeleton.racks[number, :2]
            raise ArgumentError(
                f"racks: rack {number} joins balls of which one holds the other: node {node[small]} of cluster "
                f"{tuple(cluster[small].tolist())}, radius {radii[worst, small]:.4g} mm, lies inside node "
                f"{node[1 - small]} of cluster {tuple(cluster[1 - small].tolist())}, radius {radii[worst, 1 - small]:.4g} mm, "
                f"{lengths[worst]:.4g} mm away"
            )
