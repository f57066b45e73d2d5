"""LatticeQuery's calls, layer by layer, from the call to a binary STL on disk, against LatticeQuery's seconds a cell.

Listing 3 of LF-rep, BCC of 4 x 4 x 20 cells of 10 mm by a parabola, 0.8 to 5 mm; and Fig. 4.1, Schwarz P of 10^3 cells of 20 mm,
walls from 0.1 to 7 mm. LatticeQuery's seconds: the thesis' averages (1.843 s a cell of beams, 6.453 of surfaces; Ryzen 7 3700X,
4.6.2), and its code run again on two cores of a Xeon (CadQuery 2.8: 2.77 s a BCC cell by a parabola, 53.7 s a P cell of 20 mm).
They are the seconds to a B-rep, before meshing.

    python benchmarks/lattice_query.py [--runs 5] [--beams 0.4] [--sheets 0.5]
"""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

from _timing import alternate, options, print_ratio, setting, table

from frep import Solid
from frep.errors import ThinWallWarning
from topologies.lattice_query import bcc_heterogeneous_lattice, schwartz_p_heterogeneous_lattice

THESIS = {"BCC, Listing 3": 1.843, "Schwarz P, Fig. 4.1": 6.453}
AGAIN = {"BCC, Listing 3": 2.77, "Schwarz P, Fig. 4.1": 53.7}
"""Seconds a cell."""
CELLS = {"BCC, Listing 3": 320, "Schwarz P, Fig. 4.1": 1000}


def bcc() -> Solid:
    """Listing 3."""
    return bcc_heterogeneous_lattice(10, 0.8, 5.0, 0.88, 5.5, 4, 4, 20, topology="bcc", rule="parabola")


def schwarz_p() -> Solid:
    """Fig. 4.1."""
    return schwartz_p_heterogeneous_lattice(20, 0.1, 7, 10, 10, 10)


def main() -> None:
    given = options(__doc__, beams=(0.4, "mm, voxel of the beams"), sheets=(0.5, "mm, voxel of the sheets"))
    print(setting(given.runs, f"LatticeQuery's calls, {given.beams:g} and {given.sheets:g} mm"))
    # The first layer of P, 0.1 mm, is thinner than any voxel of a benchmark.
    warnings.simplefilter("ignore", ThinWallWarning)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.stl"

        def written(part: Solid, voxel: float) -> int:
            mesh = part.mesh(voxel=voxel)
            mesh.save(path)
            return mesh.n_faces

        times = alternate(
            {
                "BCC, Listing 3": lambda: written(bcc(), given.beams),
                "Schwarz P, Fig. 4.1": lambda: written(schwarz_p(), given.sheets),
            },
            given.runs,
        )
    rows = []
    for name, t in times.items():
        each = t.median / CELLS[name]
        rows.append(
            [name, CELLS[name], f"{t.median:.2f}", f"{t.facts:,}", f"{1e3 * each:.2f}", THESIS[name], AGAIN[name]]
        )
    table(["part", "cells", "all s", "triangles", "ms a cell", "thesis, s a cell", "run again, s a cell"], rows)
    for name, t in times.items():
        each = t.median / CELLS[name]
        print_ratio(f"{name}: times as fast as the thesis", THESIS[name] / each, ">= 10")
        print_ratio(f"{name}: times as fast as its code run again", AGAIN[name] / each, ">= 10")


if __name__ == "__main__":
    main()
