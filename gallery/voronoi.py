"""A bone-like foam in a rounded block, its Voronoi cells growing towards one end, with a net for a skin (LF-rep Fig. 4.12)."""

import frep
from graded import linear
from topologies import seeds, stochastic

size = 40.0  # mm
beam = 0.9  # mm: diameter of the beams, and thickness of the walls where cells are closed
fine, coarse = 3.0, 8.0  # mm: least distance of the seeds at the two ends
closed = False  # walls and a skin instead of beams and a net
cut = ""  # "x", "y" or "z": leave out the upper half along that axis, to look inside
seed = 7
voxel = 0.2
title = "Voronoi foam, cells graded from 3 to 8 mm"

body = frep.rounded_box((0, 0, 0), (2 * size, size, size), 0.2 * size)
distance = linear("x", 0, 2 * size, fine, coarse)
points = seeds.poisson_disk(body, distance, random_state=seed)
points = seeds.relaxed(body, points, 3, cell_size=distance, random_state=seed)
walls = stochastic.voronoi_walls(body, beam, seeds=points)
# Walls cut by the skin are a net, in whose corners the beams end that the surface cuts.
lattice = stochastic.voronoi(body, seeds=points, connected=False).thicken(beam, blend=0.3 * beam)
part = walls | body.shell(beam) if closed else lattice & body | walls & body.shell(beam)
cells = len(points)
if cut:
    part = part & frep.half_space([axis == cut for axis in "xyz"], body.bounds.mean(axis=0))
