"""A slice through a lattice of a billion beams, bent and tapered: only the slice is ever evaluated."""

import frep
from topologies.steady import Screw, SteadyLattice, Swirl, Translation

title = "A window of a billion beams"
voxel = 0.05
cells = frep.parameter(700, 20, 100_000, help="clusters along each direction")
window = frep.parameter(6.0, 2, 100, "mm", "side of the cube that is cut out, at the middle cluster")

lattice = SteadyLattice(
    nodes=[(0, 0, 0), (0.5, 0.5, 0.5)],
    radii=[0.1, 0.14],
    racks=[(0, 1, -i, -j, -k) for i in (0, 1) for j in (0, 1) for k in (0, 1)],
    u=Translation((1, 0, 0)),
    v=Screw(0.5 / cells, axis="z", point=(-cells, 0, 0)),
    w=Swirl(0.5 ** (1 / cells), center=(0, 0, 1.44 * cells), angle=1 / cells),
    counts=(cells, cells, cells),
)
middle = lattice.balls(*(lattice.counts // 2))[0][0]
part = lattice.solid() & frep.box(middle - 0.5 * window, middle + 0.5 * window)
