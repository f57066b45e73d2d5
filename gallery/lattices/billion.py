"""A window cut from a lattice of two billion beams, bent and tapered: only the window is ever evaluated."""

import frep
from topologies.steady import Screw, SteadyLattice, Swirl, Translation

title = "A window of two billion beams"
voxel = 0.05
cells = frep.parameter(700, 20, 100_000, help="clusters along each direction")
bend = frep.parameter(0.35, 0.01, 0.5, "rad", "turn from the first cluster to the last along v")
taper = frep.parameter(0.7, 0.5, 1.5, help="size of the last clusters along w by that of the first")
thick = frep.parameter(0.1, 0.02, 0.15, "mm", "radius of the thin ends of the beams")
window = frep.parameter(6.0, 2, 100, "mm", "side of the cube that is cut out, at the middle cluster")

lattice = SteadyLattice(
    nodes=[(0, 0, 0), (0.5, 0.5, 0.5)],
    radii=[thick, 1.4 * thick],
    racks=[(0, 1, -i, -j, -k) for i in (0, 1) for j in (0, 1) for k in (0, 1)],
    u=Translation((1, 0, 0)),
    v=Screw(bend / cells, axis="z", point=(-cells / bend, 0, 0)),
    w=Swirl(taper ** (1 / cells), center=(0.5 * cells, 0.5 * cells, cells / (1 - taper))),
    counts=(cells, cells, cells),
)
middle = lattice.balls(*(lattice.counts // 2))[0][0]
part = lattice.solid() & frep.box(middle - 0.5 * window, middle + 0.5 * window)
