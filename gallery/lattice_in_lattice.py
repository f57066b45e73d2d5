"""Beams made of beams: the fine lattice that is left where a coarser, bent one passes."""

import frep
from topologies.steady import Screw, SteadyLattice, Translation, lattice_in_lattice

title = "Lattice in lattice"
voxel = 0.12
cells = frep.parameter(24, 8, 400, help="fine cells along each side of the first coarse row")
thickness = frep.parameter(0.24, 0.1, 0.5, "mm", "diameter of the fine beams")
beam = frep.parameter(2.6, 1, 5, "mm", "diameter of the coarse beams")

cubic = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
turn = Screw(0.02, axis="z", point=(-40, 0, 0))  # bends both lattices alike, 0.8 mm a cell at the inner side
fine = SteadyLattice(
    [(0, 0, 0)], 0.5 * thickness, cubic, Translation((1, 0, 0)), turn, Translation((0, 0, 1)), (cells, 2 * cells, cells)
)
step = (cells - 2) / 2
moves = Translation((step, 0, 0)), turn.power(step), Translation((0, 0, step))
coarse = SteadyLattice([(0.5, 0, 0.5)], 0.5 * beam, cubic, *moves, counts=(3, 5, 3))
left = fine.filtered(lattice_in_lattice(coarse))
part = left.solid()
