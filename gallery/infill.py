"""Any triangle mesh, holes and all: a solid skin, filled with a gyroid that thickens towards it."""

from pyvista import examples

import frep
from graded import distance_to
from topologies import tpms

body = "airplane.ply"  # any mesh file; this one pyvista brings along
size = 0.0  # mm, the longest side; 0 takes the numbers of a file of yours as mm, and makes the airplane 200
cell = 8.0
skin = 1.2
thin, thick, depth = 0.8, 1.6, 10.0  # mm: the walls deep inside and at the skin, and how far in they thin out
voxel = 0.4
cut = ""  # "x", "y" or "z": leave out the upper half along that axis, to look inside
title = "Gyroid infill graded by the distance to the skin"

mesh = frep.Mesh.load(examples.planefile if body == "airplane.ply" else body)
longest = (mesh.bounds[1] - mesh.bounds[0]).max()
mesh = mesh.scale((size or (200.0 if body == "airplane.ply" else longest)) / longest)
cells = round((mesh.bounds[1] - mesh.bounds[0]).prod() / cell**3)  # of the box round the body
solid = frep.from_mesh(mesh, voxel=0.75 * voxel)

inward = abs(distance_to(solid))  # mm
wall = thin + (thick - thin) * frep.clip(1 - inward / depth, 0, 1)
part = solid.shell(skin) | (solid & tpms.gyroid(cell=cell).sheet(wall))
if cut:
    part = part & frep.half_space([axis == cut for axis in "xyz"], solid.bounds.mean(axis=0))
