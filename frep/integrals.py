"""Volume, area, centroid and inertia of whole steady lattices, however many beams they have.

A steady lattice `C[i,j,k] = W^k V^j U^i C0` is the union of its hubs, and hubs integrate exactly (`frep/hubs.py`). What is
left is a sum over indices:

- *Families*: within a range of indices over which the same racks are incident on a node, its hubs are alike; at the faces,
  edges and corners of the brick some racks are missing. A node has at most `2 max|d| + 1` ranges along each direction.
- *Along k* hubs of a family are similar, hub(k) = W^k hub(0), so that moments sum as powers of one linear operator,
  `M' = s^3 H M H^T`, and areas as powers of `s^2`: O(log n) steps. The same along j where the family's racks keep k or V and W
  commute, and along i where all of them commute as far as the racks need.
- *Otherwise* hubs change with i (and j), but smoothly: a hub exists for real i and j. The sum over a range is that of the
  polynomial through Chebyshev points, exactly summed over the integers. Orders are doubled, then ranges halved, until results
  agree; short ranges are summed hub by hub.

Source: Kurzeja, Constructive Lattice Geometry, 3.6 to 3.8 and 6.1; Gupta et al., Programmed-Lattice Editor (centroid, inertia).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from .errors import ArgumentError
from .hubs import moment_matrices
from .overlaps import CleanReport, strangers
from .progress import progress
from .similarity import Similarity

if TYPE_CHECKING:
    from .steady import SteadySkeleton

_TOLERANCE = 1e-12
"""Relative agreement of nested orders at which a sum is taken for converged."""

_FIRST, _LAST = 9, 33
"""Chebyshev points of a range at first, and at most; a range that has no more indices is summed index by index."""

_BATCH = 20_000
"""Hubs in one call of the kernel: a second or two, after which Ctrl-C is heard."""

_COMMUTING = 1e-13
"""How nearly directions must commute for sums in closed form: the error it allows stays below `_TOLERANCE`."""

_TOUCHING = 1e-9
"""Overlaps below this part of a node's radius are rounding of hubs that touch."""


@dataclass(frozen=True, eq=False)
class LatticeIntegrals:
    """Integral properties of a lattice at unit density.

    Attributes:
        volume: mm3.
        area: of the surface, mm2.
        centroid: (3,), mm.
        inertia: (3, 3) inertia tensor about the centroid, mm5.
        spherical_inertia: the integral of the squared distance from the centroid, mm5.
        n_hubs: nodes of the lattice.
        hubs_evaluated: hubs that were integrated to find all this.
        error: estimated relative error of the sums; 0 where they were exact to rounding.
    """

    volume: float
    area: float
    centroid: np.ndarray
    inertia: np.ndarray
    spherical_inertia: float
    n_hubs: int
    hubs_evaluated: int
    error: float


def integrals(skeleton: SteadySkeleton, *, check: bool = True) -> LatticeIntegrals:
    """Integral properties of the union of all beams of a steady lattice.

    Exact to rounding where the directions commute (as far as the racks need) and over short ranges; otherwise sums over i and j
    converge to 1e-12. The cost does not depend on the repetition counts.

    Args:
        skeleton: the lattice.
        check: look for beams that overlap without sharing a node, as `clean_report` does. Overlaps of beams that share a node
            are noticed in any case. An optimiser whose designs are known to keep apart saves the time.

    Raises:
        ArgumentError: the lattice is not clean (hubs overlap; the message says which, and by how much), or one ball holds the
            ball at the other end of its beam.

    >>> from topologies.steady import Screw, SteadyLattice, Translation
    >>> wheel = SteadyLattice(
    ...     [(100, 0, 0)], 0.2, [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0)],
    ...     u=Screw(0.01), v=Translation((0, 0, 1)), counts=(628, 1000, 1),
    ... )
    >>> found = integrals(wheel.skeleton)
    >>> found.n_hubs, found.hubs_evaluated
    (628000, 9)
    >>> round(float(found.centroid[2]), 9)
    499.5
    """
    sums = _Sums(skeleton)
    sums.begin()
    report = sums.report()
    if report.is_clean:
        sums.converge()
        report = sums.report()
    if report.is_clean and check:
        report = strangers(skeleton)
    if not report.is_clean:
        raise ArgumentError(
            f"lattice: expected hubs that do not overlap, for sums over hubs; {report.message}. Of a region of it,"
            " lattice.region(...).solid().volume(voxel) measures the union by sampling"
        )
    return sums.result()


def clean_report(skeleton: SteadySkeleton) -> CleanReport:
    """Whether the hubs of a steady lattice keep apart: what `integrals` needs.

    Two things are looked at. At a node, the seams between half-beams must end before the beams are cut half-way: one hub of
    each family where hubs are similar, otherwise those of 9 x 9 indices (i, j) spread over each family, or all of fewer.
    Beams that share no node must keep apart: those of the first, middle and last clusters along each direction, of more where
    directions do not commute, and all of a small lattice, against all beams near them.

    Raises:
        ArgumentError: one ball holds the ball at the other end of its beam.

    >>> from topologies.steady import SteadyLattice, Translation
    >>> crossed = SteadyLattice(
    ...     [(0, 0, 0)], 0.05, [(0, 0, 1, 1, 0), (0, 0, 1, -1, 0)],
    ...     u=Translation((1, 0, 0)), v=Translation((0, 1, 0)), counts=(9, 9),
    ... )
    >>> report = clean_report(crossed.skeleton)
    >>> report.is_clean, round(report.overlap, 6)
    (False, 0.1)
    """
    sums = _Sums(skeleton)
    sums.begin()
    report = sums.report()
    return report if not report.is_clean else strangers(skeleton)


# --- families ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Family:
    """Hubs of one node with the same beams: indices low <= (i, j, k) < high."""

    node: int
    links: np.ndarray  # (m, 4): other node, di, dj, dk
    low: tuple[int, int, int]
    high: tuple[int, int, int]
    steady: tuple[bool, bool]  # whether hubs are similar along i, along j
    at: tuple[int, int, int]  # the indices of the largest of similar hubs: sums over the others then lose no digits
    operator: np.ndarray  # (11, 11): from area and moments of what is summed by points (i, j) to those of all hubs


def _families(
    skeleton: SteadySkeleton, steps: tuple[Similarity, ...], numbers: np.ndarray, size: float
) -> list[_Family]:
    from .hub_kernels import conjugated, power_sum

    u, v, w = steps
    uv, uw, vw = (a.commutes_with(b, size=size, tolerance=_COMMUTING) for a, b in ((u, v), (u, w), (v, w)))
    low = [int(s) for s in skeleton.start]
    high = [s + int(n) for s, n in zip(low, skeleton.counts, strict=True)]

    @cache
    def total(axis: int, first: int, last: int, at: tuple[int, int, int]) -> np.ndarray:
        # Sums over j start from hubs that W has already moved to at[2], sums over i from those that V has moved as well.
        step = numbers[axis]
        if axis == 0 and not uv:
            step = conjugated(step, numbers[1], float(at[1]))
        if axis < 2 and not (vw if axis == 1 else uv and uw):
            step = conjugated(step, numbers[2], float(at[2]))
        return power_sum(step, first - at[axis], last - at[axis])

    families = []
    for node in range(len(skeleton.nodes)):
        links = _incident(skeleton.racks, node)
        ranges = [_ranges(low[axis], high[axis], links[:, 1 + axis]) for axis in range(3)]
        for (i0, i1, in_i), (j0, j1, in_j), (k0, k1, in_k) in itertools.product(*ranges):
            present = links[in_i & in_j & in_k]
            j_steady = vw or not present[:, 3].any()
            i_steady = j_steady and (uw or not present[:, 3].any()) and (uv or not present[:, 2].any())
            i, j, k = (
                b - 1 if s.log_scale > 0.0 else a for s, a, b in zip(steps, (i0, j0, k0), (i1, j1, k1), strict=True)
            )
            operator = total(2, k0, k1, (0, 0, k))
            if j_steady:
                operator = operator @ total(1, j0, j1, (0, j, 0 if vw else k))
            if i_steady:
                operator = operator @ total(0, i0, i1, (i, 0 if uv else j, 0 if uv and uw else k))
            at = (i, j, k)
            families.append(_Family(node, present, (i0, j0, k0), (i1, j1, k1), (i_steady, j_steady), at, operator))
    return families


def _incident(racks: np.ndarray, node: int) -> np.ndarray:
    """Beams at a node inside the lattice, as (m, 4) rows (other node, di, dj, dk), each once."""
    links = set()
    for start, end, *offset in racks.tolist():
        if start == node:
            links.add((end, *offset))
        if end == node:
            links.add((start, *(-d for d in offset)))
    return np.array(sorted(links), dtype=np.int64).reshape(-1, 4)


def _ranges(low: int, high: int, offsets: np.ndarray) -> list[tuple[int, int, np.ndarray]]:
    """Ranges of one index over which the same beams exist, and which (m,) bool those are."""
    cuts = {low, high}
    for d in set(offsets.tolist()):
        cut = low - d if d < 0 else high - d
        if low < cut < high:
            cuts.add(cut)
    ends = sorted(cuts)
    return [(a, b, (a + offsets >= low) & (a + offsets < high)) for a, b in itertools.pairwise(ends)]


# --- polynomials through Chebyshev points, summed over the integers ----------------------------------------------------


def _points(low: int, high: int, order: int) -> np.ndarray:
    """(order,) indices at which a range is evaluated: all of them, or Chebyshev points from the first to the last."""
    if order >= high - low:
        return np.arange(low, high, dtype=float)
    x = np.cos(np.arange(order) * (math.pi / (order - 1)))
    return low + 0.5 * (1.0 - x) * (high - low - 1)


@lru_cache(maxsize=1000)
def _weights(count: int, order: int) -> np.ndarray:
    """(order,) weights with which values at `_points` give the sum over `count` indices: exact for polynomials below `order`."""
    if order >= count:
        return np.ones(count)
    n = order - 1
    sums = np.array([_chebyshev_sum(p, count) for p in range(order)])
    angles = np.arange(order)
    halves = np.where((angles == 0) | (angles == n), 0.5, 1.0)
    weights = 2.0 / n * halves * (np.cos(np.outer(angles, angles) * (math.pi / n)) @ (halves * sums))
    weights.setflags(write=False)
    return weights


_BERNOULLI = (1 / 12, -1 / 720, 1 / 30240, -1 / 1209600, 1 / 47900160, -691 / 1307674368000, 1 / 74724249600)
"""B_2k / (2k)!"""


def _chebyshev_sum(degree: int, count: int) -> float:
    """The sum of the Chebyshev polynomial T_p over `count` equidistant points from -1 to 1."""
    if degree % 2:
        return 0.0
    if degree == 0:
        return float(count)
    if count < 2 * degree**2 + 2:
        return float(np.sum(np.cos(degree * np.arccos(np.linspace(-1.0, 1.0, count)))))
    # Euler-Maclaurin: for a polynomial it ends, and with so many points it is over long before.
    step = 2.0 / (count - 1)
    total = 2.0 / (1 - degree**2) / step + 1.0
    slope, order = float(degree**2), 1
    for factor in _BERNOULLI:
        total += 2.0 * factor * step**order * slope
        for q in (order, order + 1):
            slope *= (degree**2 - q**2) / (2 * q + 1)
        order += 2
    return total


@dataclass(eq=False)
class _Patch:
    """A rectangle of indices (i, j) of one family, the values at its points, and the sums by them."""

    family: int
    ranges: tuple[tuple[int, int], ...]
    orders: tuple[int, ...]
    values: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 11)))  # (points of i, points of j, 11)
    total: np.ndarray = field(default_factory=lambda: np.zeros(11))
    change: np.ndarray = field(default_factory=lambda: np.zeros((2, 11)))  # by half the order along i, along j
    errors: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def is_exact(self, axis: int) -> bool:
        """Whether this direction is summed index by index."""
        low, high = self.ranges[axis]
        return self.orders[axis] >= high - low

    def raised(self, axes: list[int]) -> list[_Patch]:
        """Patches in its place with more points along `axes`: this one with twice the order, or halves of it."""
        if all(self.orders[axis] < _LAST for axis in axes):
            self.orders = tuple(
                min(2 * n - 1, high - low) if axis in axes else n
                for axis, (n, (low, high)) in enumerate(zip(self.orders, self.ranges, strict=True))
            )
            return [self]
        parts = []
        for axis, (low, high) in enumerate(self.ranges):
            middle = (low + high) // 2
            halved = axis in axes and self.orders[axis] >= _LAST
            parts.append([(low, middle), (middle, high)] if halved else [(low, high)])
        order = _LAST // 2 + 1
        return [
            _Patch(
                self.family,
                ranges,
                tuple(
                    min(order if axis in axes else self.orders[axis], high - low)
                    for axis, (low, high) in enumerate(ranges)
                ),
            )
            for ranges in itertools.product(*parts)
        ]

    def missing(self) -> tuple[np.ndarray, np.ndarray]:
        """The points (n, 2) that have no values yet, and which (points of i, points of j) bool they are."""
        old, new = self.values.shape[:2], self.orders
        values = np.full((*new, 11), np.nan)
        nested = all(
            b == a or (b == 2 * a - 1 and not self.is_exact(axis))
            for axis, (a, b) in enumerate(zip(old, new, strict=True))
        )
        if nested:
            steps = [1 if a == b else 2 for a, b in zip(old, new, strict=True)]
            values[:: steps[0], :: steps[1]] = self.values
        self.values = values
        unknown = np.isnan(values[..., 0])
        i, j = (_points(*r, n) for r, n in zip(self.ranges, new, strict=True))
        grid = np.empty((*new, 2))
        grid[..., 0], grid[..., 1] = i[:, None], j[None]
        return grid[unknown], unknown

    def sum_up(self, operator: np.ndarray) -> None:
        """The sums by the values, and how much half the order would change them."""
        lengths = [high - low for low, high in self.ranges]
        wi, wj = (_weights(length, n) for length, n in zip(lengths, self.orders, strict=True))
        rows = np.einsum("ijc,j->ic", self.values, wj)
        total = wi @ rows
        self.total = operator @ total
        self.change = np.zeros((2, 11))
        if not self.is_exact(0):
            self.change[0] = operator @ (total - _weights(lengths[0], self.orders[0] // 2 + 1) @ rows[::2])
        if not self.is_exact(1):
            half = _weights(lengths[1], self.orders[1] // 2 + 1)
            self.change[1] = operator @ (total - wi @ np.einsum("ijc,j->ic", self.values[:, ::2], half))


# --- a lattice ---------------------------------------------------------------------------------------------------------


class _Sums:
    """The sums over one lattice while they converge.

    Moments are about `origin`, the middle of the lattice. Hubs are placed in the lattice's own coordinates: in others a template
    that is tiny beside the lattice would lose its digits.
    """

    def __init__(self, skeleton: SteadySkeleton) -> None:
        from .hub_kernels import spread_positions

        self.skeleton = skeleton
        similarities = (skeleton.u, skeleton.v, skeleton.w)
        low, high = skeleton.start.astype(np.int64), (skeleton.start + skeleton.counts).astype(np.int64)
        self.numbers = _numbers(similarities)
        centers = spread_positions(self.numbers, *skeleton.nodes.mean(axis=0), low, high)
        self.origin = centers.mean(axis=0)
        # Copies: the kernels would be compiled again for arrays that are read only.
        self.nodes = np.array(skeleton.nodes, dtype=np.float64, order="C")
        self.radii = np.array(skeleton.radii, dtype=np.float64)
        steps = tuple(_seen_from(s, self.origin) for s in similarities)
        size = float(np.abs(centers - self.origin).max()) + _cluster_size(skeleton)
        self.families = _families(skeleton, steps, _numbers(steps), size)
        self.first = np.cumsum([0, *(len(f.links) for f in self.families)])
        self.links = np.concatenate([f.links for f in self.families])
        self.family_nodes = np.array([f.node for f in self.families])
        self.patches: list[_Patch] = []
        self.closed = np.zeros(11)
        self.evaluated = 0
        self.error = 0.0
        self.overlap, self.worst = 0.0, (0, np.zeros(3), -1, -1)

    def begin(self) -> None:
        """Sum the families that need one hub each, and look at a few hubs of the others."""
        single = [f for f, family in enumerate(self.families) if all(family.steady)]
        places = np.array([self.families[f].at for f in single], dtype=float).reshape(-1, 3)
        values = self._hubs(np.array(single, dtype=np.int64), places)
        if single:
            self.closed = np.einsum("fab,fb->a", np.array([self.families[f].operator for f in single]), values)
        for number, family in enumerate(self.families):
            if not all(family.steady):
                ranges = tuple(
                    (family.at[axis], family.at[axis] + 1) if steady else (family.low[axis], family.high[axis])
                    for axis, steady in enumerate(family.steady)
                )
                orders = tuple(min(_FIRST, high - low) for low, high in ranges)
                self.patches.append(_Patch(number, ranges, orders))
        self._evaluate(self.patches)

    def converge(self) -> None:
        """Refine the worst patches until nested orders disagree by less than the tolerance, or hubs turn out to overlap."""
        error = first = self._judge()
        if error > _TOLERANCE:
            with progress("integrating", total=1.0) as advance:
                done = 0.0
                while error > _TOLERANCE and self.overlap <= _TOUCHING:
                    self._refine()
                    error = self._judge()
                    reached = min(1.0, math.log(first / max(error, _TOLERANCE)) / math.log(first / _TOLERANCE))
                    if reached > done:
                        advance(reached - done)
                        done = reached
        self.error = error

    def _refine(self) -> None:
        # The worst, and all within a factor of 20 of it: fewer would leave a core idle, more would not pay.
        worst = max(float(p.errors.max()) for p in self.patches)
        kept, pending = [], []
        for patch in self.patches:
            if patch.errors.max() < 0.05 * worst:
                kept.append(patch)
            else:
                pending += patch.raised([axis for axis in range(2) if patch.errors[axis] >= 0.05 * worst])
        self._evaluate(pending)
        self.patches = kept + pending

    def _judge(self) -> float:
        """The error of all sums, relative to their sizes; each patch learns its part."""
        if not self.patches:
            return 0.0
        total = self.total
        reach = math.sqrt((total[5] + total[8] + total[10]) / total[1])
        sizes = np.array([total[0], total[1], *[total[1] * reach] * 3, *[total[1] * reach**2] * 6])
        changes = np.abs(np.array([p.change for p in self.patches])) / sizes
        for patch, errors in zip(self.patches, changes.max(axis=2), strict=True):
            patch.errors = errors
        return float(changes.sum(axis=(0, 1)).max())

    def _evaluate(self, patches: list[_Patch]) -> None:
        if not patches:
            return
        wanted = [patch.missing() for patch in patches]
        counts = [len(at) for at, _ in wanted]
        number = np.repeat([p.family for p in patches], counts)
        third = np.repeat([float(self.families[p.family].at[2]) for p in patches], counts)
        found = self._hubs(number, np.column_stack([np.concatenate([at for at, _ in wanted]), third]))
        for patch, (_, unknown), values in zip(patches, wanted, np.split(found, np.cumsum(counts)[:-1]), strict=True):
            patch.values[unknown] = values
            patch.sum_up(self.families[patch.family].operator)

    def _hubs(self, family: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(n, 11) areas and moments of hubs of these families at real indices (n, 3); remembers the worst overlap."""
        from .hub_kernels import H_AREA, H_BEAM, H_EXCESS, H_MOMENTS, H_OTHER, HUB_ROW, lattice_hubs

        out = np.empty((len(at), 11))
        for begin in range(0, len(at), _BATCH):
            part = slice(begin, begin + _BATCH)
            families, places = np.ascontiguousarray(family[part]), np.ascontiguousarray(at[part])
            rows = np.empty((len(places), HUB_ROW))
            lattice_hubs(
                self.numbers,
                self.nodes,
                self.radii,
                self.first,
                self.links,
                self.family_nodes,
                families,
                places,
                self.origin,
                rows,
            )
            if np.isnan(rows[:, H_AREA]).any():
                n = int(np.isnan(rows[:, H_AREA]).argmax())
                raise ArgumentError(self._held(int(families[n]), places[n]))
            radii = self.radii[self.family_nodes[families]] * np.exp(places @ self.numbers[:, 0])
            relative = rows[:, H_EXCESS] / radii
            n = int(np.argmax(relative))
            if relative[n] > max(self.overlap, _TOUCHING):
                self.overlap = float(relative[n])
                self.worst = int(families[n]), places[n], int(rows[n, H_BEAM]), int(rows[n, H_OTHER])
            out[part, 0] = rows[:, H_AREA]
            out[part, 1:] = rows[:, H_MOMENTS:]
        self.evaluated += len(at)
        return out

    def _held(self, family: int, at: np.ndarray) -> str:
        f = self.families[family]
        cluster = _nearest(at)
        here = self.radii[f.node] * math.exp(float(np.dot(cluster, self.numbers[:, 0])))
        for link in f.links:
            there = self._cluster_of(cluster, link)
            radius = self.radii[link[0]] * math.exp(float(np.dot(there, self.numbers[:, 0])))
            ends = [self.skeleton.balls(*c)[0][n] for c, n in ((cluster, f.node), (there, link[0]))]
            length = float(np.linalg.norm(ends[0] - ends[1]))
            if length <= abs(here - radius) * (1 + 1e-9):
                return (
                    f"lattice: {_name(f.node, cluster)} of radius {here:.6g} mm and {_name(link[0], there)} of radius"
                    f" {radius:.6g} mm are {length:.6g} mm apart: one ball holds the other, and there is no beam between them"
                )
        return f"lattice: near {_name(f.node, cluster)} a ball holds the ball at the other end of its beam"

    @staticmethod
    def _cluster_of(cluster: tuple[int, int, int], link: np.ndarray) -> tuple[int, int, int]:
        i, j, k = (c + int(d) for c, d in zip(cluster, link[1:], strict=True))
        return i, j, k

    def report(self) -> CleanReport:
        """What the hubs evaluated so far say."""
        if self.overlap <= _TOUCHING:
            return CleanReport(True, 0.0, "no hubs overlap among those looked at")
        number, at, beam, other = self.worst
        family = self.families[number]
        cluster = _nearest(at)
        scale = math.exp(float(np.dot(cluster, self.numbers[:, 0])))
        depth = float(self.overlap * self.radii[family.node] * scale)
        beams = [_name(link[0], self._cluster_of(cluster, link)) for link in family.links[[beam, other]]]
        by = (
            f"{depth:.4g} mm past the middle of the first"
            if math.isfinite(depth)
            else "all the way: one lies in the other"
        )
        message = (
            f"at {_name(family.node, cluster)} the beams to {beams[0]} and to {beams[1]} overlap {by}, so that hubs overlap;"
            " thinner nodes or a wider angle would part them"
        )
        return CleanReport(False, depth, message)

    @property
    def total(self) -> np.ndarray:
        """(11,) area and moments of the whole lattice about `origin`."""
        return self.closed + sum((p.total for p in self.patches), np.zeros(11))

    def result(self) -> LatticeIntegrals:
        n = len(self.nodes) * math.prod(int(c) for c in self.skeleton.counts)
        moment = moment_matrices(self.total[None, 1:])[0]
        return of_moments(float(self.total[0]), moment, self.origin, n, self.evaluated, self.error)


def of_moments(
    area: float, moment: np.ndarray, origin: np.ndarray, n_hubs: int, evaluated: int, error: float = 0.0
) -> LatticeIntegrals:
    """The integral properties that follow from an area and the (4, 4) integral of [x; 1] [x; 1]^T, x from `origin`."""
    volume = float(moment[3, 3])
    center = moment[:3, 3] / volume
    second = moment[:3, :3] - volume * np.outer(center, center)
    spherical = float(np.trace(second))
    return LatticeIntegrals(
        volume=volume,
        area=area,
        centroid=origin + center,
        inertia=spherical * np.eye(3) - second,
        spherical_inertia=spherical,
        n_hubs=n_hubs,
        hubs_evaluated=evaluated,
        error=error,
    )


def _numbers(similarities: tuple[Similarity, ...]) -> np.ndarray:
    """(3, 8) as `hub_kernels` takes them: logarithm of the scale, angle, axis, velocity."""
    return np.array([[s.log_scale, s.angle, *s.axis, *s.velocity] for s in similarities])


def _seen_from(similarity: Similarity, origin: np.ndarray) -> Similarity:
    """The same similarity in coordinates relative to `origin`."""
    s = similarity
    (ax, ay, az), (x, y, z) = s.axis, origin
    turned = np.array([ay * z - az * y, az * x - ax * z, ax * y - ay * x])
    velocity = s.velocity + s.log_scale * origin + s.angle * turned
    return Similarity(s.log_scale, s.angle, s.axis, velocity)


def _cluster_size(skeleton: SteadySkeleton) -> float:
    low, high = skeleton.nodes.min(axis=0), skeleton.nodes.max(axis=0)
    return skeleton.scales[1] * (float(np.abs(high - low).max()) + float(skeleton.radii.max()))


def _nearest(at: np.ndarray) -> tuple[int, int, int]:
    i, j, k = (round(x) for x in at.tolist())
    return i, j, k


def _name(node: int, cluster: tuple[int, ...]) -> str:
    return f"node {node} of cluster ({', '.join(str(int(c)) for c in cluster)})"
