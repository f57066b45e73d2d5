"""Ball-interference queries of steady lattices: RangeFinder's methods beside a compiled loop over every beam, one thread.

As table 7.2 of Constructive Lattice Geometry: 100 random balls, centres uniform in the lattice's box, radii 90 to 110 % of the
mean ball radius. Lattices (`_lattices.py`; the thesis gives counts, nodes and racks, the rest is chosen): *regular*, 75^3 cubic
cells of 1 mm, and *cylindrical*, 32 x 128 x 128 cells round a tube of 20 to 51 mm, both with 2 nodes (0.10 and 0.08 mm) and 14
racks; *warped*, 100^3, bent by 60 degrees, twisted by 45 and tapered to 0.5 and 0.7, with 1 node of 0.12 mm and 3 racks. The loop
steps along each row by one product with W for each end of a beam; it answers the first `--naive` balls, and its time is scaled.

`--exhaustive` instead asks random balls of random small lattices of every kind, by every method that each allows, and counts the
beams lost and wrongly found against distances computed by numpy. Contacts within 1e-9 of the lattice's size are left out.

    python benchmarks/biq.py [--queries 100] [--naive 10] [--runs 5]
    python benchmarks/biq.py --exhaustive [--queries 1000000]
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from _lattices import KINDS, all_beams, cylindrical, hull_distances, random_lattice, regular, warped
from _timing import alternate, options, print_ratio, setting, table

from frep.rangefinder import conditions, find_beams
from frep.steady import SteadySkeleton

_REACH = {  # ms a method on the three lattices, and the same in the thesis: Java, i7-7700K, one thread
    "regular": {"O(1)": (0.5, 5.86), "O(u)": (5, 55.8), "O(uv)": (200, 1600), "naive": (None, 55_200)},
    "cylindrical": {"O(u)": (5, 55.4), "O(uv)": (400, 2720), "naive": (None, 259_000)},
    "warped": {"O(uv)": (400, 3680), "naive": (None, 167_000)},
}
_RATIO = {"regular": "9420", "cylindrical": "4675", "warped": "45.4"}


def balls(skeleton: SteadySkeleton, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Centres and radii of random balls."""
    rng = np.random.default_rng(7)
    low, high = skeleton.bounds
    clusters = skeleton.start[:, None] + rng.integers(0, skeleton.counts[:, None], (3, 10_000))
    mean = float(skeleton.balls(*clusters)[1].mean())
    return rng.uniform(low, high, (count, 3)), mean * rng.uniform(0.9, 1.1, count)


def measure(name: str, skeleton: SteadySkeleton, queries: int, naive: int, runs: int) -> None:
    """One lattice: every method in turn, and the loop."""
    centers, radii = balls(skeleton, queries)

    def search(method) -> Callable[[], np.ndarray]:
        return lambda: find_beams(skeleton, centers, radii, method)

    methods = [m for m in conditions(skeleton).methods if m != "naive"]
    times = alternate({m: search(m) for m in methods}, runs, len)
    find_beams(skeleton, centers[:1], radii[:1], "naive")
    start = time.perf_counter()
    few = find_beams(skeleton, centers[:naive], radii[:naive], "naive")
    loop = (time.perf_counter() - start) * queries / naive
    same = all(np.array_equal(_few(find_beams(skeleton, centers, radii, m), naive), _few(few, naive)) for m in methods)
    print(f"\n{name}: {skeleton.n_beams:,} beams, {queries} balls; all methods find the same beams: {same}")
    rows = []
    for m in (*methods, "naive"):
        ms = 1e3 * (times[m].median if m != "naive" else loop)
        reach, thesis = _REACH[name].get(m, (None, None))
        rows.append([m, f"{ms:,.3f}", f"{1e3 * loop / ms:,.0f}", reach, thesis, times[m].facts if m != "naive" else ""])
    table(["", "median ms", "loop / this", "reach ms", "thesis ms", "beams met"], rows)
    best = min(times[m].median for m in methods if m != "descent")
    print_ratio(f"{name}: loop against the quickest of the thesis's methods", loop / best, f"{_RATIO[name]} or more")


def _few(found: np.ndarray, queries: int) -> np.ndarray:
    rows = found[found[:, 0] < queries]
    return rows[np.lexsort(rows.T)]


def exhaustive(queries: int, seed: int = 0) -> tuple[int, int]:
    """Random balls against brute force: beams lost, and beams wrongly found, over all methods."""
    rng = np.random.default_rng(seed)
    lost = wrong = done = hits = asked = 0
    start, each = time.perf_counter(), 2000
    while done < queries:
        skeleton = random_lattice(rng, KINDS[(done // each) % len(KINDS)])
        beams, ends, radii = all_beams(skeleton)
        centers, reach = random_balls(rng, skeleton, ends, radii, each)
        gaps = hull_distances(centers, ends, radii) - reach[:, None]
        size = 1e-9 * (float(np.abs(ends).max()) + float(radii.max()) + float(np.abs(skeleton.nodes).max()))
        surely, maybe = gaps <= -size, gaps <= size
        number = {tuple(row): n for n, row in enumerate(beams.tolist())}
        for method in conditions(skeleton).methods:
            if method == "naive" and done % (10 * each):
                continue
            found = find_beams(skeleton, centers, reach, method)
            met = np.zeros(gaps.shape, np.int64)
            np.add.at(met, (found[:, 0], [number[tuple(row)] for row in found[:, 1:].tolist()]), 1)
            new_lost, new_wrong = int((surely & (met == 0)).sum()), int(((met > 0) & ~maybe).sum() + (met > 1).sum())
            if new_lost or new_wrong:
                print(
                    f"lattice {done // each} ({KINDS[(done // each) % len(KINDS)]}), {method}: {new_lost} lost, {new_wrong} wrong"
                )
            lost, wrong, asked = lost + new_lost, wrong + new_wrong, asked + each
        done, hits = done + each, hits + int(surely.sum())
    seconds = time.perf_counter() - start
    print(f"{done:,} random balls, {hits:,} hits, {asked:,} searches by all methods, {seconds:.0f} s")
    print(f"false negatives: {lost}; false positives: {wrong}")
    return lost, wrong


def random_balls(
    rng: np.random.Generator, skeleton: SteadySkeleton, ends: np.ndarray, radii: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Anywhere in the box, near beams, on axes and at fixed points; of radius 0, of the beams' size, and large."""
    points, size = (
        ends.reshape(-1, 3),
        float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))) + float(radii.max()),
    )
    centers = rng.uniform(points.min(axis=0), points.max(axis=0), (count, 3))
    share = rng.uniform(0, 1, (count, 1))
    near = ends[rng.integers(len(ends), size=count)]
    close = share * near[:, 0] + (1 - share) * near[:, 1] + 0.2 * size * rng.normal(size=(count, 3))
    centers = np.where(rng.uniform(size=(count, 1)) < 0.5, close, centers)
    for similarity in skeleton.directions:
        special = similarity.fixed_point if similarity.fixed_point is not None else similarity.point
        if special is not None and np.abs(special).max() < 1e4:
            some = rng.integers(count, size=count // 40)
            along = rng.normal(size=(len(some), 1)) * similarity.axis * rng.integers(0, 2)
            centers[some] = special + along + rng.normal(size=(len(some), 3)) * rng.choice([0.0, 0.1])
    reach = rng.uniform(0, 1, count) ** 2 * size * rng.choice([0.0, 0.5, 2.0], count, p=[0.2, 0.6, 0.2])
    return centers, reach


def main() -> None:
    given = options(
        __doc__,
        queries=(0, "balls: 100, or 1,000,000 with --exhaustive"),
        naive=(10, "of these, how many the loop over every beam answers"),
        exhaustive=(False, "compare with brute force instead"),
        seed=(0, "of the random lattices of --exhaustive"),
    )
    if given.exhaustive:
        exhaustive(given.queries or 1_000_000, given.seed)
        return
    import numba

    numba.set_num_threads(1)
    print(setting(given.runs))
    for name, make in (("regular", regular), ("cylindrical", cylindrical), ("warped", warped)):
        measure(name, make(), given.queries or 100, given.naive, given.runs)


if __name__ == "__main__":
    main()
