"""A tire of woven springs: two balls and four racks a cluster, a screw and two rotations.

The screw winds half a turn of a double spring; the first rotation lines up such halves along the arc of the tire's section,
where the two wires change places; the second repeats the springs about the axle. Neighbours reach through each other, as the
wires of a fence do.
"""

import math

import frep
from topologies.steady import Screw, SteadyLattice

title = "Spring tire"
voxel = 0.3
axle = frep.parameter(60.0, 40, 200, "mm", "from the axle, which is z, to the middle of the section")
section = frep.parameter(25.0, 15, 60, "mm", "radius of the section's arc")
coil = frep.parameter(6.0, 3, 8, "mm", "radius of a spring")
wire = frep.parameter(1.2, 0.5, 1.5, "mm", "diameter of its wires")
pitch = frep.parameter(12.0, 8, 20, "mm", "length of a full turn")
halves = frep.parameter(13, 3, 24, help="half turns of each spring")
springs = frep.parameter(56, 20, 400, help="springs about the axle")

sides = 8  # beams a half turn
bend = 0.5 * pitch / section
outer = axle + section
half = Screw(math.pi / sides, axis="z", point=(outer, 0, 0), pitch=0.5 * pitch / sides)  # where z is the spring's axis
along = Screw(bend, axis=(0, -1, 0), point=(axle, 0, 0))
first = along.power(-0.5 * (halves - 1))
low = 0.25 * pitch * (1 / sides - 1)
lattice = SteadyLattice(
    nodes=first.apply([(outer, coil, low), (outer, -coil, low)]),
    radii=[0.5 * wire, 0.5 * wire],
    racks=[(0, 0, 1, 0, 0), (1, 1, 1, 0, 0), (0, 1, 1 - sides, 1, 0), (1, 0, 1 - sides, 1, 0)],
    u=first @ half @ first.inverse(),
    v=along,
    w=Screw(2 * math.pi / springs, axis="z"),
    counts=(sides, halves, springs),
)
