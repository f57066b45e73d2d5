"""The neck of a notched bar from a finite-element mesh, filled with a gyroid that is as dense as the stress asks for."""

import frep
from graded import from_mesh_data, remap, thickness_for
from topologies import tpms

results = "notch_stress.vtk"  # any mesh with results at its nodes; this one is in metres and Pa
scale = 1000.0  # mm for a unit of the mesh: a bar of 400 x 100 x 10 mm
light, dense = 0.38, 0.8  # volume fraction where the stress is low, and where it is high
low, high = 0.2e6, 5e6  # Pa
cell = 5.0
voxel = 0.3
title = "Gyroid as dense as the stress asks for"

stress = from_mesh_data(results, "Nodal Stress-normed", spacing=2.0, scale=scale)
bar = frep.from_mesh(frep.Mesh.load(results).scale(scale), voxel=1.5)
neck = frep.box((145, 0, 0), (255, 100, 10))
gyroid = tpms.gyroid(cell=cell)
wall = thickness_for(gyroid, remap(stress, (low, high), (light, dense), curve=0.7))
part = bar & neck & gyroid.sheet(wall)
