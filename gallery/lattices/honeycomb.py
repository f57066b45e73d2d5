"""A bent honeycomb: sheets of hexagons, stacked along an arc by a rotation."""

import math

import frep
from topologies.steady import Screw, SteadyLattice, Translation

title = "Bent honeycomb"
voxel = 0.25
side = frep.parameter(6.0, 1, 100, "mm", "of the hexagons")
diameter = frep.parameter(1.0, 0.2, 3, "mm", "of the beams")
bend = frep.parameter(math.pi / 2, 0.05, math.pi, "rad", "from the first sheet to the last")
height = frep.parameter(6.0, 1, 100, "mm", "between sheets, in the middle of them")
across = frep.parameter(6, 2, 10_000, help="hexagons across")
rows = frep.parameter(4, 2, 10_000, help="pairs of rows of hexagons")
sheets = frep.parameter(20, 2, 10_000, help="along the bend")

x = math.sqrt(0.75) * side
flat = [(0, 1, 0, 0, 0), (1, 2, 0, 0, 0), (1, 2, -1, 0, 0), (2, 3, 0, 0, 0), (3, 0, 0, 1, 0), (3, 0, 1, 1, 0)]
turn = bend / (sheets - 1)
middle = x * across
lattice = SteadyLattice(
    nodes=[(0, 0, 0), (0, 0, side), (x, 0, 1.5 * side), (x, 0, 2.5 * side)],
    radii=[0.5 * diameter] * 4,
    racks=flat + [(n, n, 0, 0, 1) for n in range(4)],
    u=Translation((2 * x, 0, 0)),
    v=Translation((0, 0, 3 * side)),
    w=Screw(turn, axis="z", point=(middle - height / turn, 0, 0)),
    counts=(across, rows, sheets),
)
