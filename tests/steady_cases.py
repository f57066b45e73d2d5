"""Steady lattices for the tests: named ones of every kind, random ones, and the brute force that judges them."""

from __future__ import annotations

import math

import numpy as np

from frep.steady import SteadySkeleton
from topologies.steady import Screw, Similarity, SteadyLattice, Swirl, Translation

CUBIC = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
X, Y, Z = Translation((1, 0, 0)), Translation((0, 1, 0)), Translation((0, 0, 1))
EYE = Similarity.identity()


def lattice(u, v, w, counts, racks=CUBIC, nodes=((0.0, 0.0, 0.0),), radii=0.1) -> SteadyLattice:
    return SteadyLattice(nodes, radii, racks, u, v, w, counts)


def figure_6_3() -> SteadyLattice:
    """The only lattice of the thesis whose numbers are all given (section 6.2), with its four distinct patterns."""
    return lattice(
        Swirl(1.187, (-3.333, 0, 0)),
        Screw(0.285, "z", (-1.555, 0.003, 0)),
        Swirl(0.953, (10.872, 0, 0.039), 0.224, "y"),
        (7, 12, 15),
        [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 1, 1), (0, 0, 1, 1, 0)],
        radii=0.0645,
    )


KINDS = {
    "regular": lambda: lattice(X, Y, Z, (5, 4, 6)),
    "oblique": lambda: lattice(X, Translation((0.5, 0.9, 0)), Translation((0.2, 0.3, 1.1)), (5, 5, 4)),
    "two nodes": lambda: lattice(
        X, Y, Z, (4, 5, 3),
        [(0, 0, 1, 0, 0), (0, 1, 0, 0, 0), (1, 0, 1, 1, 1), (1, 0, -1, 2, 0)],
        [(0, 0, 0), (0.5, 0.4, 0.6)], (0.1, 0.15),
    ),
    "cylinder": lambda: lattice(X, Screw(0.31, "z", (-4, 0, 0)), Z, (4, 21, 3)),
    "many turns": lambda: lattice(
        Screw(0.7, "z", (-2, 0, 0), pitch=0.3), Translation((0.6, 0, 0)), EYE, (60, 4, 1), CUBIC[:2], radii=0.05
    ),
    "negative turns": lambda: lattice(
        Screw(-0.9, (1, 2, 2), (0, 3, 0), pitch=-0.4), Swirl(0.97, (0, 0, 9)), X, (15, 5, 3), radii=0.05
    ),
    "swirls": lambda: lattice(
        Swirl(1.1, (-6, 0, 0), 0.2, "z"), Swirl(0.93, (-6, 0, 0), -0.3, "z"), Z, (9, 8, 2), radii=0.04
    ),
    "shrinking": lambda: lattice(
        Swirl(0.5, (0, 0, 0), 1.0), Translation((0.3, 0, 0)), Z, (12, 3, 2), nodes=[(4, 0, 0)], radii=0.02
    ),
    "near unit scale": lambda: lattice(
        Swirl(1 + 1e-12, (3e12, 0, 0), 1e-12, "y"), Swirl(1 - 1e-9, (0, 1e9, 0)), Screw(1e-10, "x", (0, 1e10, 0)), (5, 4, 3)
    ),
    "through the axis": lambda: lattice(Screw(1.1, "z", pitch=0.5), X, Y, (7, 4, 3), nodes=[(-1.5, -1, 0)], radii=0.03),
    "slab": lambda: lattice(X, Screw(0.2, "y", (0, 0, 5)), EYE, (6, 9, 1), CUBIC[:2]),
    "row": lambda: lattice(Swirl(1.05, (-3, 0, 0), 0.5, (1, 1, 0)), EYE, EYE, (20, 1, 1), CUBIC[:1], radii=0.04),
    "single cluster": lambda: lattice(
        EYE, EYE, EYE, (1, 1, 1), [(0, 1, 0, 0, 0)], [(0, 0, 0), (1, 0.5, 0)], (0.1, 0.2)
    ),
    "figure 6.3": figure_6_3,
    "region": lambda: figure_6_3().region((2, 3, 4), (4, 5, 6)),
}  # fmt: skip


def random_lattice(rng: np.random.Generator) -> SteadyLattice:
    """Any three similarities, one to three nodes, racks with offsets of either sign."""

    def direction(step: float) -> Similarity:
        kind = rng.integers(4)
        if kind == 0:
            return Translation(step * rng.normal(size=3))
        angle = rng.choice([1e-9, 0.05, 0.4, 1.3]) * rng.normal()
        away = step / max(abs(angle), 1e-3) * rng.normal(size=3)
        if kind == 1:
            return Screw(angle, rng.normal(size=3), away, step * rng.normal())
        scale = math.exp(rng.choice([1e-12, 0.003, 0.05]) * rng.normal())
        return Swirl(scale, rng.normal(size=3) * rng.choice([1.0, 10.0, 100.0]), angle, rng.normal(size=3))

    while True:
        n = int(rng.integers(1, 4))
        counts = rng.integers(1, 9, 3)
        racks = []
        for _ in range(rng.integers(1, 5)):
            offset = [int(rng.integers(-min(2, c - 1), min(2, c - 1) + 1)) for c in counts]
            start, end = (int(i) for i in rng.integers(0, n, 2))
            if start != end or any(offset):
                racks.append((start, end, *offset))
        try:
            return SteadyLattice(
                0.4 * rng.normal(size=(n, 3)),
                rng.uniform(0.01, 0.05, n),
                racks,
                *(direction(1.0) for _ in "uvw"),
                counts,
            )
        except ValueError:  # a ball inside its neighbour, or no rack at all
            continue


def all_beams(skeleton: SteadySkeleton) -> np.ndarray:
    """Every beam, (m, 4) rows (i, j, k, rack), straight from the definition."""
    beams = []
    for rack, (_, _, *offset) in enumerate(skeleton.racks.tolist()):
        for cluster in np.ndindex(*skeleton.counts):
            there = np.add(cluster, offset)
            if np.all((there >= 0) & (there < skeleton.counts)):
                beams.append((*np.add(cluster, skeleton.start), rack))
    return np.array(beams, np.int64).reshape(-1, 4)


def clusters(skeleton: SteadySkeleton) -> np.ndarray:
    """(n, 3) indices of every cluster."""
    return np.array(list(np.ndindex(*skeleton.counts)), np.int64).reshape(-1, 3) + skeleton.start


def placed_by_matrices(skeleton: SteadySkeleton, cluster, node: int) -> np.ndarray:
    """A node's position by repeated products of matrices: what the closed-form powers must give."""
    point = np.append(skeleton.nodes[node], 1.0)
    for similarity, n in zip(skeleton.directions, cluster, strict=True):
        point = np.linalg.matrix_power(similarity.matrix, int(n)) @ point
    return point[:3]


def axis_distances(ends: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Distance of a point from segments (m, 2, 3)."""
    a, u = ends[:, 0], ends[:, 1] - ends[:, 0]
    square = np.einsum("ij,ij->i", u, u)
    t = np.clip(np.einsum("ij,ij->i", point - a, u) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return np.linalg.norm(a + t[:, None] * u - point, axis=1)
