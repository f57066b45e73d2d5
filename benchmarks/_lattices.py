"""The steady lattices of the query benchmarks, of the sizes of table 7.2 of Constructive Lattice Geometry.

Its similarities and radii are not published: those here are chosen, and stated. Also random lattices of every kind, and their
beams and distances by brute force.
"""

from __future__ import annotations

import math

import numpy as np

from frep.steady import SteadySkeleton
from topologies.steady import Screw, Similarity, SteadyLattice, Swirl, Translation

# Two nodes a cluster and 14 racks: a body-centred cell with its eight struts, and the cubic edges of both of its nodes.
BODY_CENTRED = [
    *((0, 1, -i, -j, -k) for i in (0, 1) for j in (0, 1) for k in (0, 1)),
    *((node, node, *step) for node in (0, 1) for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
]
CUBIC = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]


def regular(n: int = 75) -> SteadySkeleton:
    """n^3 cubic cells of 1 mm, nodes of 0.10 and 0.08 mm."""
    steps = [Translation(shift) for shift in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    lattice = SteadyLattice([(0, 0, 0), (0.5, 0.5, 0.5)], [0.10, 0.08], BODY_CENTRED, *steps, counts=(n, n, n))
    return lattice.skeleton


def cylindrical(nu: int = 32, nv: int = 128, nw: int = 128) -> SteadySkeleton:
    """A tube: nu layers 1 mm apart from radius 20 mm, nv cells round it (one full turn), nw cells of 1 mm along it; nodes of
    0.10 and 0.08 mm."""
    turn = 2.0 * math.pi / nv
    centre = (20.5 * math.cos(0.5 * turn), 20.5 * math.sin(0.5 * turn), 0.5)
    steps = Translation((1, 0, 0)), Screw(turn, "z"), Translation((0, 0, 1))
    lattice = SteadyLattice([(20, 0, 0), centre], [0.10, 0.08], BODY_CENTRED, *steps, counts=(nu, nv, nw))
    return lattice.skeleton


def warped(n: int = 100) -> SteadySkeleton:
    """n^3 cells of 1 mm at one corner, node of 0.12 mm: tapered to half along u, bent by 60 degrees along v, twisted by 45
    degrees and tapered to 0.7 along w. No two similarities commute."""
    last = n - 1
    centre = (-last / 2, -last / 2, 0.0)
    steps = (
        Swirl(0.5 ** (1.0 / last), center=(1.0 / (1.0 - 0.5 ** (1.0 / last)), 0, 0)),
        Screw(math.radians(60) / last, "z", point=(0, last / math.radians(60), 0)),
        Swirl(
            0.7 ** (1.0 / last), center=(*centre[:2], 1.0 / (1.0 - 0.7 ** (1.0 / last))), angle=math.radians(45) / last
        ),
    )
    return SteadyLattice([(0, 0, 0)], 0.12, CUBIC, *steps, counts=(n, n, n)).skeleton


# --- random lattices -----------------------------------------------------------------------------------------------------

KINDS = ("regular", "oblique", "tube", "horn", "screws", "swirls", "turns", "nearly", "parallel", "mixed")


def random_lattice(rng: np.random.Generator, kind: str) -> SteadySkeleton:
    """A small lattice of one of `KINDS`: one or two nodes, racks with offsets of either sign, any first index, sometimes far
    from the origin."""
    counts = rng.integers(1, 7, 3) if kind != "turns" else rng.integers((1, 1, 6), (4, 4, 40))
    nodes = rng.normal(size=(int(rng.integers(1, 3)), 3))
    racks = []
    for _ in range(int(rng.integers(1, 6))):
        offset = np.clip(rng.integers(-2, 3, 3), 1 - counts, counts - 1)
        racks.append((*rng.integers(0, len(nodes), 2), *offset))
    home = rng.normal(size=3) * rng.choice([0.0, 1.0, 1000.0], p=[0.4, 0.5, 0.1])
    u, v, w = (_about(step, home) for step in _steps(rng, kind))
    return SteadySkeleton(
        nodes=nodes + home, radii=rng.uniform(0.02, 0.4, len(nodes)), racks=np.array(racks, np.int64), u=u, v=v, w=w,
        counts=counts.astype(np.int64), start=rng.integers(-3, 4, 3) * int(rng.integers(0, 2)),
    )  # fmt: skip


def _about(step: Similarity, home: np.ndarray) -> Similarity:
    """The same step about `home` instead of the origin."""
    a = step.generator[:3, :3]
    return Similarity(step.log_scale, step.angle, step.axis, step.velocity - a @ home)


def _direction(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def _steps(rng: np.random.Generator, kind: str) -> list[Similarity]:
    def any_screw() -> Similarity:
        angle = rng.choice(
            [rng.uniform(-0.6, 0.6), rng.uniform(-9, 9), math.pi, 2 * math.pi, 0.0], p=[0.6, 0.25, 0.05, 0.05, 0.05]
        )
        return Screw(angle, _direction(rng), rng.normal(size=3) * 2, rng.choice([0.0, rng.normal()]))

    def any_swirl() -> Similarity:
        scale = math.exp(rng.choice([rng.uniform(-0.3, 0.3), 10.0 ** rng.uniform(-12, -2)]))
        return Swirl(
            scale,
            rng.normal(size=3) * 3,
            rng.choice([0.0, rng.uniform(-0.6, 0.6), rng.uniform(-9, 9)]),
            _direction(rng),
        )

    def any_near() -> Similarity:
        # Scales near 1 and angles near 0, from below rounding to where they are searched as what they are.
        log_scale, angle = (rng.choice([-1, 0, 1]) * 10.0 ** rng.uniform(-17, -5) for _ in range(2))
        return Similarity(
            log_scale, angle, _direction(rng), rng.normal(size=3) * rng.choice([0.0, 1e-9, 1.0], p=[0.1, 0.1, 0.8])
        )

    axis = _direction(rng)
    across = np.cross(axis, _direction(rng))
    if kind == "regular":
        basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return [Translation(b * s) for b, s in zip(basis, rng.uniform(0.3, 2, 3), strict=True)]
    if kind == "oblique":
        return [Translation(rng.normal(size=3)) for _ in range(3)]
    if kind == "tube":
        steps = [Screw(rng.uniform(-1, 1), axis), Translation(axis * rng.uniform(0.3, 2))]
        return [Translation(across), *rng.permutation(np.array(steps, object))]
    if kind == "horn":
        steps = [Screw(rng.uniform(-1, 1), axis), Swirl(math.exp(rng.uniform(-0.3, 0.3)))]
        return [any_screw(), *rng.permutation(np.array(steps, object))]
    if kind == "parallel":
        # Translations along one line, exactly or nearly, and what turns about it or lies in a plane with it.
        slant = rng.choice([0.0, 10.0 ** rng.uniform(-17, -5)])
        last = [
            Screw(rng.uniform(-9, 9), axis, (0, 0, 0), rng.normal()),
            Translation(rng.normal() * axis + rng.normal() * across),
        ]
        steps = [
            Translation(rng.normal() * axis),
            Translation(rng.normal() * axis + slant * across),
            last[rng.integers(2)],
        ]
        return [*rng.permutation(np.array(steps, object))]
    if kind == "turns":
        scale = rng.choice([1.0, math.exp(rng.uniform(-0.05, 0.05))])
        turn = rng.uniform(0.3, 4.0) * rng.choice([-1, 1])
        return [any_screw(), any_screw(), Screw(turn, axis, rng.normal(size=3), rng.uniform(-0.3, 0.3))] if scale == 1.0 else [
            any_screw(), any_screw(), Swirl(scale, rng.normal(size=3), turn, axis),
        ]  # fmt: skip
    makers = {"screws": [any_screw], "swirls": [any_swirl], "nearly": [any_near]}.get(
        kind, [any_screw, any_swirl, any_near]
    )
    return [makers[int(rng.integers(len(makers)))]() for _ in range(3)]


def all_beams(skeleton: SteadySkeleton) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every beam: rows (m, 4) of (i, j, k, rack), ends (m, 2, 3) and radii (m, 2)."""
    ranges = [np.arange(s, s + n) for s, n in zip(skeleton.start, skeleton.counts, strict=True)]
    clusters = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    rows = []
    for number, offset in enumerate(skeleton.racks[:, 2:]):
        there = clusters + offset - skeleton.start
        kept = clusters[np.all((there >= 0) & (there < skeleton.counts), axis=1)]
        rows.append(np.column_stack([kept, np.full(len(kept), number)]))
    beams = np.concatenate(rows)
    return (beams, *skeleton.ends(beams))


def hull_distances(points: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(q, m) signed distances of points to cone-beams, by another formula than the kernels': the nearest of the balls
    that slide from end to end."""
    a, (ra, rb) = ends[:, 0], radii.T
    d = ends[:, 1] - a
    square = np.einsum("ma,ma->m", d, d)
    length = np.sqrt(square)
    inside = length <= np.abs(ra - rb)  # one ball holds the other
    safe = np.where(inside, 1.0, length)
    t = (points @ d.T - np.einsum("ma,ma->m", a, d)) / safe**2
    across = points[:, None] - a - t[..., None] * d
    h = np.sqrt(np.einsum("qma,qma->qm", across, across))
    taper = np.where(inside, 0.0, (ra - rb) / safe)
    # The ball of the hull nearest to the point touches its cone: its centre lies back along the axis by h tan(taper).
    s = np.clip(t - h * taper / np.sqrt(1.0 - taper**2) / safe, 0.0, 1.0)
    along = np.hypot(h, (t - s) * safe) - (ra + s * (rb - ra))
    balls = np.minimum(*(np.linalg.norm(points[:, None] - ends[:, e], axis=2) - radii[:, e] for e in (0, 1)))
    return np.where(inside, balls, along)
