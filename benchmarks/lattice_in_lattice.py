"""Lattice-in-Lattice: the beams of a fine lattice whose nodes lie in a coarse one; a compound filter, streamed.

Counts and racks are those of table 7.1 and figure 9.3 of Constructive Lattice Geometry, whose similarities and radii
are not published; chosen here: *regular*, 75^3 body-centred cells of 1 mm in 9^3 of 8.33 mm with balls of 1 mm;
*cylindrical*, 32 x 128 x 128 cells of a tube in 5 x 17 x 9 with balls of 1.5 mm; *warped*, the regular fine lattice in
8^3 that bend by 60 degrees, twist by 45 and taper by 0.5 and 0.7, with balls of 1.2 mm. *Compound*: 138^3 cells of 1
mm (one node, three racks) both in 12^3 of 11.5 mm with balls of 3 mm and in 36^3 of 3.83 mm with balls of 1.3 mm:
beams of beams of beams. The thesis' times are of 8 threads of an i7-7700K in Java, two queries a fine beam; here each
node is asked once.

python benchmarks/lattice_in_lattice.py [--runs 5]
"""

from __future__ import annotations

import math

import numpy as np
from _lattices import CUBIC, cylindrical, regular, warped
from _timing import alternate, child, options, peak_bytes, print_ratio, report, setting, table, this_script

from frep.steady import SteadySkeleton
from topologies.steady import FilteredLattice, NodeFilter, Screw, SteadyLattice, Translation, lattice_in_lattice

_REACH = {"regular": (1, 3.44), "cylindrical": (3, 22.3), "warped": (10, 266)}


def lattice(skeleton: SteadySkeleton) -> SteadyLattice:
    s = skeleton
    return SteadyLattice(s.nodes, s.radii, s.racks, s.u, s.v, s.w, s.counts)


def cubic(n: int, step: float, radius: float) -> SteadyLattice:
    moves = [Translation(step * e) for e in np.eye(3)]
    return SteadyLattice([(0, 0, 0)], radius, CUBIC, *moves, counts=(n, n, n))


def cases() -> dict[str, tuple[SteadyLattice, NodeFilter]]:
    turn, height = 2 * math.pi / 17, 127 / 8
    tube = SteadyLattice(
        [(21, 0, 0)], 1.5, CUBIC, Translation((7.25, 0, 0)), Screw(turn, "z"), Translation((0, 0, height)), (5, 17, 9)
    )
    bent = warped(8)
    scale = 75 / 8
    bent_coarse = SteadyLattice(
        scale * bent.nodes,
        1.2,
        CUBIC,
        *(type(s)(s.log_scale, s.angle, s.axis, scale * s.velocity) for s in bent.directions),
        (8, 8, 8),
    )
    return {
        "regular": (lattice(regular()), lattice_in_lattice(cubic(9, 75 / 9, 1.0))),
        "cylindrical": (lattice(cylindrical()), lattice_in_lattice(tube)),
        "warped": (lattice(regular()), lattice_in_lattice(bent_coarse)),
    }


def compound() -> FilteredLattice:
    keep = lattice_in_lattice(cubic(12, 11.5, 3.0)) & lattice_in_lattice(cubic(36, 23 / 6, 1.3))
    return cubic(138, 1.0, 0.1).filtered(keep)


def main() -> None:
    chosen = options(__doc__, compound=(False, "run the compound filter alone, in this process"))
    if chosen.compound:
        before = peak_bytes()
        times = alternate({"compound": lambda: compound().count()}, chosen.runs)["compound"]
        report(seconds=times.median, kept=times.facts, peak=peak_bytes(), before=before)
        return
    print(setting(chosen.runs))
    contestants = {name: (lambda f=fine, k=keep: f.filtered(k).count()) for name, (fine, keep) in cases().items()}
    times = alternate(contestants, chosen.runs)
    rows = []
    for name, (fine, _) in cases().items():
        reach, source = _REACH[name]
        t = times[name].median
        rows.append(
            [
                name,
                f"{fine.n_nodes:,}",
                f"{times[name].facts:,}",
                f"{t:.3f}",
                f"{1e9 * t / fine.n_nodes:.0f}",
                source,
                reach,
            ]
        )
    table(["", "nodes tested", "beams kept", "median s", "ns a node", "thesis s", "reach s"], rows)
    facts = child(this_script("--compound", "--runs", str(chosen.runs)))
    print(f"\ncompound, 138^3: {facts['kept']:,} of {compound().lattice.n_beams:,} beams kept (thesis 1,494,074)")
    print_ratio("streamed in", facts["seconds"], "10", " s")
    print_ratio("peak memory of the process", facts["peak"] / 1e6, "500", " MB")
    print_ratio("of which the imports", facts["before"] / 1e6, "-", " MB")


if __name__ == "__main__":
    main()
