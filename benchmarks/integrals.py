"""Integral properties of lattices too large to list: volume, area, centroid and inertia by sums over hubs.

The bent, graded brick has 10,000 x 10,000 x 10,000 clusters of an octet lattice: 4 nodes and 24 racks each, 24e12 beams. Over the
whole brick U scales by 1.5 about a point two brick lengths away, V turns by 0.6 rad about an axis along z, W by 0.5 rad about one
along x; no two commute. At the origin clusters are 0.8 x 1 x 1 mm, radii 0.03 mm. Held against the ten minutes of Gupta et al.
(C++, hardware not given), who have volume only.

The lattices whose directions commute: a cubic brick of 10,000^3 clusters with 3 racks, and a slab bent and graded in its plane,
both without and with the search for overlaps. Every hub one by one is timed on a brick of 20^3 of the same bent lattice, as what
the sums replace; that both agree is a test (`tests/frep/test_integrals.py`).

    python benchmarks/integrals.py [--clusters 10000] [--runs 5]
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from _timing import alternate, options, print_ratio, setting, table

from frep.hubs import hub_rows
from frep.integrals import LatticeIntegrals, integrals
from frep.similarity import Screw, Similarity, Swirl, Translation
from frep.steady import SteadySkeleton
from topologies.steady import SteadyLattice

FCC = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])


def octet_racks() -> list[tuple[int, ...]]:
    """The 24 shortest links between points of the face-centred cubic lattice, each once."""
    racks = []
    for a, b, d in itertools.product(range(4), range(4), itertools.product((-1, 0, 1), repeat=3)):
        link = FCC[b] + d - FCC[a]
        if math.isclose(link @ link, 0.5) and tuple(link) > (0, 0, 0):
            racks.append((a, b, *d))
    return racks


def bent_octet(n: int, counts: int) -> SteadySkeleton:
    """`counts`^3 clusters of the brick that has n^3: its nodes are where half steps of U, V, W take the origin."""
    size = float(n)
    whole = (
        Swirl(1.5, (-2 * size, 0, 0)),
        Screw(0.6, "z", (-size / 0.6, 0, 0)),
        Screw(0.5, "x", (0, -2 * size, 0)),
    )
    u, v, w = (s.power(1 / n) for s in whole)
    frames = [w.power(c) @ v.power(b) @ u.power(a) for a, b, c in FCC]
    nodes = [f.translation for f in frames]
    radii = [0.03 * f.scale for f in frames]
    return SteadyLattice(nodes, radii, octet_racks(), u, v, w, counts=(counts,) * 3).skeleton


def cubic(n: int) -> SteadySkeleton:
    racks = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
    steps = [Translation(axis) for axis in np.eye(3)]
    return SteadyLattice([(0, 0, 0)], 0.1, racks, *steps, counts=(n, n, n)).skeleton


def bent_slab(n: int) -> SteadySkeleton:
    """A square grid, graded by 1.6 and bent by half a radian about one point: U and V commute."""
    pole = (-2.0 * n, 0, 0)
    steps = (Swirl(1.6 ** (1 / n), pole), Screw(0.5 / n, point=pole), Similarity.identity())
    return SteadyLattice([(0, 0, 0)], 0.05, [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0)], *steps, counts=(n, n, 1)).skeleton


def one_by_one(skeleton: SteadySkeleton) -> float:
    """Volume by integrating every hub of the inside: what a loop over the lattice costs at least."""
    inside = [np.arange(1, n - 1) for n in skeleton.counts]
    clusters = np.stack([a.ravel() for a in np.meshgrid(*inside, indexing="ij")], axis=1)
    volume = 0.0
    for node in range(len(skeleton.nodes)):
        links = [(b, d) for a, b, *d in skeleton.racks.tolist() if a == node]
        links += [(a, [-x for x in d]) for a, b, *d in skeleton.racks.tolist() if b == node]
        centers, radii = (x[:, node] for x in skeleton.balls(*clusters.T))
        found = [skeleton.balls(*(clusters + d).T) for _, d in links]
        ends = np.stack([c[:, b] - centers for (b, _), (c, _) in zip(links, found, strict=True)], axis=1)
        end_radii = np.stack([r[:, b] for (b, _), (_, r) in zip(links, found, strict=True)], axis=1)
        first = np.arange(len(clusters) + 1) * len(links)
        volume += float(hub_rows(radii, first, ends.reshape(-1, 3), end_radii.ravel())[:, 4].sum())
    return volume


def main() -> None:
    given = options(__doc__, clusters=(10_000, "clusters along each direction"))
    n = given.clusters
    print(setting(given.runs, f"{n}^3 clusters"))
    bent, plain, slab, part = bent_octet(n, n), cubic(n), bent_slab(n), bent_octet(n, 20)
    contestants: dict[str, Callable[[], LatticeIntegrals | float]] = {
        "bent, graded octet": lambda: integrals(bent),
        "cubic": lambda: integrals(plain),
        "cubic, overlaps not searched": lambda: integrals(plain, check=False),
        "bent, graded slab": lambda: integrals(slab),
        "bent, graded slab, not searched": lambda: integrals(slab, check=False),
        "20^3 of the octet, hub by hub": lambda: one_by_one(part),
    }
    times = alternate(contestants, given.runs)
    beams = [bent.n_beams, plain.n_beams, plain.n_beams, slab.n_beams, slab.n_beams, part.n_beams]
    rows = []
    for (name, t), count in zip(times.items(), beams, strict=True):
        found = t.facts
        is_sum = isinstance(found, LatticeIntegrals)
        more = (f"{found.hubs_evaluated:,}", f"{found.error:.0e}") if is_sum else (f"{4 * 18**3:,}", "0")
        rows.append([name, f"{t.median * 1e3:,.2f}", f"{count:.3g}", *more])
    table(["", "median ms", "beams", "hubs evaluated", "error"], rows)
    octet = times["bent, graded octet"].median
    print_ratio("bent, graded octet, seconds", octet, "30; published: below 600", " s")
    print_ratio("commuting, seconds", times["cubic, overlaps not searched"].median, "0.001", " s")
    loop = times["20^3 of the octet, hub by hub"].median / (4 * 18**3) * bent.n_nodes
    print_ratio("a loop over its hubs, by the small brick", loop / octet, "report", " x")


if __name__ == "__main__":
    main()
