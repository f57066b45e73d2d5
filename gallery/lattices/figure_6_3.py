"""The program of Constructive Lattice Geometry, Fig. 6.3: a scaling, then a rotation, then a swirl; one ball, four racks.

The figure adds the rack (0, 1, 1) twice; once is enough.
"""

import frep
from topologies.steady import Screw, SteadyLattice, Swirl

title = "Fig. 6.3: scaled, bent, swirled"
voxel = 0.03
radius = frep.parameter(0.0645, 0.01, 0.1, "mm", "of the first ball")
nu = frep.parameter(7, 2, 100, help="clusters along the scaling")
nv = frep.parameter(12, 2, 100, help="clusters along the rotation")
nw = frep.parameter(15, 2, 100, help="clusters along the swirl")

lattice = SteadyLattice(
    nodes=[(0, 0, 0)],
    radii=[radius],
    racks=[(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 1, 1), (0, 0, 1, 1, 0)],
    u=Swirl(1.187, center=(-3.333, 0, 0)),
    v=Screw(0.285, axis="z", point=(-1.555, 0.003, 0)),
    w=Swirl(0.953, center=(10.872, 0, 0.039), angle=0.224, axis="y"),
    counts=(nu, nv, nw),
)
