"""Windows of a lattice of a billion beams: meshing a window costs the same as meshing the lattice cut to it.

Lattices: *straight*, cubic cells of 1 mm; *bent*, turning by 0.001 rad a cell along v about an axis 1 m off; *tapered
and twisted*, no two of whose similarities commute. Nodes of 0.12 mm, 700^3 clusters, 1.03e9 beams. The window is a
cube of 10 mm at the middle cluster, meshed at 0.1 mm; *cut* is the same lattice's region of the clusters that reach
into it. `--explicit` also meshes the window's beams written out as a graph with a spatial index. Then the beams tested
for a leaf block, and the time a voxel as the counts grow.

python benchmarks/steady_window.py [--runs 5]
"""

from __future__ import annotations

import numpy as np
from _lattices import CUBIC
from _timing import alternate, options, print_ratio, setting, table

import frep
from frep.biq_kernels import CAPACITY, ROW, gather
from frep.sizing import sample_solid
from topologies.steady import FilteredLattice, Screw, SteadyLattice, Swirl, Translation

VOXEL = 0.1
HALF = 5.0


def kinds(n: int) -> dict[str, SteadyLattice]:
    """Lattices of n^3 clusters; what bends does so by the same amount a cell, whatever n."""
    x, y, z = (Translation(e) for e in np.eye(3))
    similarities = {
        "straight": (x, y, z),
        "bent": (x, Screw(0.001, "z", (-1000, 0, 0)), z),
        "tapered, twisted": (
            Swirl(1.0003, (-3333, 0, 0), 0.0005),
            Screw(0.001, "x", (0, 0, -1000)),
            Swirl(0.9998, (0, 0, 5000), 0.0005, "y"),
        ),
    }
    return {name: SteadyLattice([(0, 0, 0)], 0.12, CUBIC, *s, counts=(n, n, n)) for name, s in similarities.items()}


def window(lattice: SteadyLattice) -> tuple[np.ndarray, np.ndarray]:
    """A box of 10 mm about the middle cluster."""
    center = lattice.balls(*(lattice.counts // 2))[0][0]
    return center - HALF, center + HALF


def cut(lattice: SteadyLattice) -> SteadyLattice:
    """The region of all clusters whose beams reach into the window."""
    low, high = window(lattice)
    beams = lattice.beams_meeting(0.5 * (low + high), float(np.linalg.norm(high - low)) / 2)
    ends = np.concatenate([beams[:, :3], beams[:, :3] + lattice.racks[beams[:, 3], 2:]])
    return lattice.region(ends.min(axis=0), np.ptp(ends, axis=0) + 1)


def beams_a_block(lattice: SteadyLattice) -> float:
    """Mean length of the lists of beams with which leaf blocks of the window are evaluated."""
    grid = sample_solid(lattice.solid() & frep.box(*window(lattice)), VOXEL, None, quiet=True)
    head, fdata, idata = lattice.skeleton.packed
    rows = np.empty((CAPACITY, ROW))
    centers = grid.origin + grid.voxel * (8.0 * grid.leaves + 3.5)
    reach = 3.5 * np.sqrt(3.0) * VOXEL + 0.12 * lattice.skeleton.scales[1] + VOXEL
    return float(np.mean([gather(head, fdata, idata, *c, reach, 0, rows) for c in centers]))


def main() -> None:
    chosen = options(__doc__)
    print(setting(chosen.runs, f"window {2 * HALF:g} mm at {VOXEL:g} mm"))
    rows, ratios = [], {}
    for name, lattice in kinds(700).items():
        part = cut(lattice)
        nodes, radii, edges = FilteredLattice(part, None).explicit()
        from topologies import beams

        box = frep.box(*window(lattice))
        contestants = {
            "whole": lambda s=lattice, box=box: (s.solid() & box).mesh(VOXEL),
            "cut": lambda s=part, box=box: (s.solid() & box).mesh(VOXEL),
            "graph": lambda n=nodes, r=radii, e=edges, box=box: (beams.graph(n, e).thicken(2 * r) & box).mesh(VOXEL),
        }
        times = alternate(contestants, chosen.runs, lambda mesh: mesh.n_faces)
        seconds = [times[c].median for c in contestants]
        triangles = {times[c].facts for c in contestants}
        ratios[name] = seconds[0] / seconds[1]
        rows.append(
            [name, f"{lattice.n_beams:,}", f"{part.n_beams:,}", *(f"{s:.4f}" for s in seconds), sorted(triangles)]
        )
    table(["", "beams", "in the region", "whole, s", "cut, s", "as a graph, s", "triangles"], rows)
    for name, ratio in ratios.items():
        print_ratio(f"{name}: whole / cut", ratio, "1.5")
    print()
    rows = []
    for name in kinds(2):
        for n in (20, 60, 200, 700):
            lattice = kinds(n)[name]
            box = frep.box(*window(lattice))
            times = alternate(
                {"sample": lambda s=lattice, b=box: (s.solid() & b).sample(VOXEL)},
                chosen.runs,
                lambda g: g.n_voxels_evaluated,
            )
            t = times["sample"]
            rows.append(
                [
                    name if n == 20 else "",
                    f"{n}^3",
                    f"{t.facts:,}",
                    f"{1e9 * t.median / t.facts:.2f}",
                    f"{beams_a_block(lattice):.2f}",
                ]
            )
    table(["sampling the window", "clusters", "voxels evaluated", "ns a voxel", "beams a leaf block"], rows)


if __name__ == "__main__":
    main()
