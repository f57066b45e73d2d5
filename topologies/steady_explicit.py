"""Lattices written out, ball by ball and beam by beam: what a text file of a steady lattice holds.

Of the clusters nothing is left: all balls stand in one, (0, 0, 0), and rack m is beam m. Otherwise such a lattice answers what a
steady one does: it is meshed, drawn, measured and written again, and `frep lattice x.txt` takes it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from frep import ArgumentError, Solid
from frep.overlaps import TOUCHING, CleanReport, beam_gaps
from frep.packing import digest
from frep.progress import progress
from frep.skeleton import GraphSkeleton
from frep.thicken import thickened

if TYPE_CHECKING:
    from frep.integrals import LatticeIntegrals
    from topologies.steady import SteadyLattice

_BATCH = 20_000  # hubs, or beams, at a time
_LINES = 65_536  # of a file at a time
_ROUNDING = 1e-9  # hubs whose seams pass their cuts by less, as a part of the radius, only touch


@dataclass(frozen=True, eq=False)
class _Skeleton(GraphSkeleton):
    """A graph whose nodes without beams are balls."""

    @cached_property
    def lone_nodes(self) -> np.ndarray:  # pyright: ignore[reportIncompatibleMethodOverride]
        return np.setdiff1d(np.arange(len(self.nodes)), self.edges)

    @property
    def content_key(self) -> bytes:
        return digest(b"balls and beams", self.nodes, self.edges)


@dataclass(frozen=True, eq=False)
class BallsAndBeams:
    """An explicit lattice, as a text file holds it. `solid()` gives it body.

    Attributes:
        nodes: (n, 3) float64 centres of the balls, mm.
        radii: (n,) float64, mm.
        edges: (m, 2) int64 ball numbers.

    Example:
        >>> bar = BallsAndBeams(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([0.1, 0.1]), np.array([[0, 1]]))
        >>> bar, round(bar.volume(), 10)
        (<lattice of 2 balls, 1 beam>, 0.0356047167)
    """

    nodes: np.ndarray
    radii: np.ndarray
    edges: np.ndarray

    def __repr__(self) -> str:
        return f"<lattice of {self.n_nodes:,} balls, {self.n_beams:,} beam{'' if self.n_beams == 1 else 's'}>"

    # --- what it consists of -----------------------------------------------------------------------------------------

    @property
    def counts(self) -> np.ndarray:
        """(3,) clusters along each direction: a single one."""
        return np.ones(3, np.int64)

    @property
    def start(self) -> np.ndarray:
        """(3,) its index."""
        return np.zeros(3, np.int64)

    @cached_property
    def racks(self) -> np.ndarray:
        """(m, 5) beams as racks (start node, end node, 0, 0, 0) of that cluster."""
        return np.column_stack([self.edges, np.zeros((len(self.edges), 3), np.int64)])

    @property
    def n_nodes(self) -> int:
        """How many balls there are."""
        return len(self.nodes)

    @property
    def n_beams(self) -> int:
        """How many beams there are."""
        return len(self.edges)

    def beams(self, block: int = 1_000_000) -> Iterator[np.ndarray]:
        """All beams in blocks of at most `block` rows (0, 0, 0, beam), (m, 4) int64."""
        for begin in range(0, len(self.edges), block):
            rows = np.zeros((min(block, len(self.edges) - begin), 4), np.int64)
            rows[:, 3] = np.arange(begin, begin + len(rows))
            yield rows

    def ends(self, beams: Any) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m, 2, 3) and their radii (m, 2), mm, of beams given as (m, 4) rows (0, 0, 0, beam)."""
        balls = self.edges[np.asarray(beams)[:, 3]]
        return self.nodes[balls], self.radii[balls]

    def region(self, start: Any, span: Any) -> BallsAndBeams:
        """The whole, which is one cluster.

        Raises:
            ArgumentError: another start than (0, 0, 0), or another span than (1, 1, 1).
        """
        if tuple(start) != (0, 0, 0) or tuple(span) != (1, 1, 1):
            raise ArgumentError(
                f"start, span: expected (0, 0, 0) and (1, 1, 1), as balls and beams are one cluster, got {start} and {span}"
            )
        return self

    def outline(self) -> list[np.ndarray]:
        """No curves: what its map was is not known."""
        return []

    def model(self) -> SteadyLattice:
        """The steady lattice of one cluster that has these balls and beams; a beam given twice counts once.

        Raises:
            ArgumentError: there is no ball, or one ball holds the ball at the other end of its beam.
        """
        from .steady import SteadyLattice

        racks = np.column_stack([self._joined, np.zeros((len(self._joined), 3), np.int64)])
        return SteadyLattice(self.nodes, self.radii, racks, None)  # pyright: ignore[reportArgumentType]

    def save(self, path: str | os.PathLike[str], *, most: int | None = 50_000_000) -> None:
        """Write balls and beams (.txt), or `model()` as a model (.json) or a program (.py).

        Raises:
            FileError: another suffix, no such folder, no space.
            TooLargeError: a text file of more than `most` beams; None writes any number.
        """
        from .steady_files import save, write_blocks

        if os.fspath(path).lower().endswith(".txt"):
            balls = np.column_stack([self.nodes, self.radii])
            write_blocks(path, (self.n_nodes, self.n_beams), _pieces(balls), _pieces(self.edges), most)
        else:
            save(self.model(), path, most=most)

    # --- as a solid --------------------------------------------------------------------------------------------------

    def solid(self) -> Solid:
        """Its balls and cone-beams as a Solid.

        Raises:
            ArgumentError: there is no ball.
        """
        if not len(self.nodes):
            raise ArgumentError("lattice: expected at least one ball, got none")
        skeleton = _Skeleton(self.nodes, self._joined)
        return thickened(skeleton, 2.0 * self.radii, node=None, section="circle", blend=0.0, label="balls and beams")

    # --- integral properties -----------------------------------------------------------------------------------------

    @cached_property
    def _joined(self) -> np.ndarray:
        """(m, 2) beams, each once."""
        return np.unique(np.sort(self.edges, axis=1), axis=0).reshape(-1, 2)

    @cached_property
    def _hubs(self) -> np.ndarray:
        """(n, HUB_ROW) integrals of all hubs, see `frep.hubs`."""
        from frep.hubs import hub_rows

        edges = self._joined
        here, there = np.concatenate([edges, edges[:, ::-1]]).T
        order = np.lexsort([there, here])
        here, there = here[order], there[order]
        first = np.searchsorted(here, np.arange(len(self.nodes) + 1))
        rows = []
        with progress("integrating", total=len(self.nodes)) as advance:
            for begin in range(0, len(self.nodes), _BATCH):
                marks = first[begin : begin + _BATCH + 1]
                part = slice(marks[0], marks[-1])
                ends = self.nodes[there[part]] - self.nodes[here[part]]
                rows.append(
                    hub_rows(self.radii[begin : begin + _BATCH], marks - marks[0], ends, self.radii[there[part]])
                )
                advance(len(rows[-1]))
        return np.concatenate(rows)

    @cached_property
    def _report(self) -> CleanReport:
        if not len(self.nodes):
            return CleanReport(True, 0.0, "there are no balls")
        for report in (self._held_balls(), self._crowded_hubs()):
            if report is not None:
                return report
        return self._strangers() or CleanReport(True, 0.0, "no hubs overlap")

    def _held_balls(self) -> CleanReport | None:
        ends, radii = self.nodes[self._joined], self.radii[self._joined]
        depth = np.abs(radii[:, 1] - radii[:, 0]) - np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        if not len(depth) or depth.max() < 0.0:
            return None
        worst = int(np.argmax(depth))
        a, b = self._joined[worst][np.argsort(radii[worst])].tolist()
        message = f"ball {a} lies inside ball {b}, to which a beam joins it"
        return CleanReport(False, float(2.0 * radii[worst].min() + depth[worst]), message)

    def _crowded_hubs(self) -> CleanReport | None:
        from frep.hub_kernels import H_EXCESS

        excess = self._hubs[:, H_EXCESS] / self.radii
        worst = int(np.argmax(excess))
        if excess[worst] <= _ROUNDING:
            return None
        depth = float(excess[worst] * self.radii[worst])
        by = f"{depth:.4g} mm past the middle of one" if np.isfinite(depth) else "all the way: one lies in the other"
        return CleanReport(False, depth, f"at ball {worst} two beams overlap {by}, so that hubs overlap")

    def _strangers(self) -> CleanReport | None:
        """The deepest overlap of beams that share no ball, and of balls that have no beam."""
        from scipy.spatial import KDTree

        lone = np.setdiff1d(np.arange(len(self.nodes)), self._joined)
        pairs = np.concatenate([self._joined, np.column_stack([lone, lone])])
        ends, radii = self.nodes[pairs], self.radii[pairs]
        middle = ends.mean(axis=1)
        reach = 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) + radii.max(axis=1)
        tree = KDTree(middle)
        found: tuple[float, float, np.ndarray] | None = None
        for begin in range(0, len(pairs), _BATCH):
            part = np.arange(begin, min(begin + _BATCH, len(pairs)))
            near = tree.query_ball_point(middle[part], reach[part] + reach.max())
            one = np.repeat(part, [len(others) for others in near])
            other = np.concatenate([np.array(others, np.int64) for others in near])
            apart = np.linalg.norm(middle[one] - middle[other], axis=1) < reach[one] + reach[other]
            shared = (pairs[one][:, :, None] == pairs[other][:, None]).any(axis=(1, 2))
            keep = (one < other) & apart & ~shared
            one, other = one[keep], other[keep]
            if not len(one):
                continue
            gaps = beam_gaps(ends[one], radii[one], ends[other], radii[other])
            relative = gaps / np.minimum(radii[one].min(axis=1), radii[other].min(axis=1))
            worst = int(np.argmin(relative))
            if relative[worst] < -TOUCHING and (found is None or relative[worst] < found[0]):
                found = float(relative[worst]), float(-gaps[worst]), np.stack([pairs[one[worst]], pairs[other[worst]]])
        if found is None:
            return None
        names = [f"ball {a}" if a == b else f"the beam from ball {a} to ball {b}" for a, b in found[2].tolist()]
        return CleanReport(False, found[1], f"{names[0]} and {names[1]} overlap by {found[1]:.4g} mm")

    def clean(self) -> CleanReport:
        """Whether hubs (balls with their half-beams) keep apart, and by how much they overlap if not. All are looked at."""
        return self._report

    @cached_property
    def integrals(self) -> LatticeIntegrals:
        """All integral properties, by the sum over hubs.

        Raises:
            ArgumentError: there is no ball, or the lattice is not clean: hubs overlap; says where and by how much.
        """
        from frep.hub_kernels import H_AREA, H_MOMENTS
        from frep.hubs import moment_matrices
        from frep.integrals import of_moments

        if not len(self.nodes):
            raise ArgumentError("lattice: expected at least one ball, got none")
        if not self._report.is_clean:
            raise ArgumentError(
                f"lattice: expected hubs that do not overlap, for sums over hubs; {self._report.message}."
                " lattice.solid().volume(voxel) measures the union by sampling"
            )
        origin = self.nodes.mean(axis=0)
        total = np.zeros((4, 4))
        for begin in range(0, len(self.nodes), _BATCH):
            part = slice(begin, begin + _BATCH)
            moments = moment_matrices(self._hubs[part, H_MOMENTS:])
            shifts = np.tile(np.eye(4), (len(moments), 1, 1))
            shifts[:, :3, 3] = self.nodes[part] - origin
            total += np.einsum("nab,nbc,ndc->ad", shifts, moments, shifts, optimize=True)
        return of_moments(float(self._hubs[:, H_AREA].sum()), total, origin, self.n_nodes, self.n_nodes)

    def volume(self) -> float:
        """Volume in mm3 of the union of all beams; 0 without balls. Otherwise raises as `integrals`."""
        return self.integrals.volume if len(self.nodes) else 0.0

    def area(self) -> float:
        """Surface area in mm2. Raises as `volume`."""
        return self.integrals.area if len(self.nodes) else 0.0

    def centroid(self) -> np.ndarray:
        """(3,) centre of mass, mm. Raises as `integrals`."""
        return self.integrals.centroid

    def inertia(self) -> np.ndarray:
        """(3, 3) inertia tensor about the centroid at unit density, mm5. Raises as `integrals`."""
        return self.integrals.inertia


def _pieces(rows: np.ndarray) -> Iterator[np.ndarray]:
    return (rows[begin : begin + _LINES] for begin in range(0, len(rows), _LINES))
