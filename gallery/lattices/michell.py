"""A cantilever after Michell (1904): two families of spirals that cross at right angles, by two swirls about one fixed point.

Each spiral makes 45 degrees with the rays from that point: along it the logarithm of the distance grows as the angle does.
"""

import math

import frep
from topologies.steady import SteadyLattice, Swirl

title = "Michell cantilever"
voxel = 0.1
tip = frep.parameter(100.0, 10, 1000, "mm", "distance of the loaded tip from the fixed point")
spread = frep.parameter(1.0, 0.2, math.pi / 2, "rad", "angle of the outermost corners, to either side")
n = frep.parameter(12, 3, 200, help="meshes of each family")
slenderness = frep.parameter(0.15, 0.05, 0.25, help="diameter of a beam by the side of its mesh")

step = spread / n
side = math.sqrt(2) * step  # of a mesh, by its distance from the fixed point
root = tip * math.exp(-2 * spread)
lattice = SteadyLattice(
    nodes=[(root, 0, 0)],
    radii=[0.5 * slenderness * side * root],
    racks=[(0, 0, 1, 0), (0, 0, 0, 1)],
    u=Swirl(math.exp(step), angle=step),
    v=Swirl(math.exp(step), angle=-step),
    counts=(n + 1, n + 1),
)
