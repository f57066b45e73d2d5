"""A Schwarz P sheet, 10 x 10 x 10 cells, whose wall grows along z up to 7 mm (LF-rep Fig. 4.1)."""

import frep
from graded import linear
from topologies import tpms

size = 200.0  # mm
cell = 20.0
thin = 1.0  # mm: two voxels, the thinnest wall that the grid is sure not to tear
voxel = 0.5
title = "Schwarz P, wall linear in z, 1 to 7 mm"
cells = round(size / cell) ** 3

wall = linear("z", 0, size, thin, 7)
part = tpms.schwarz_p(cell=cell).sheet(wall) & frep.box((0, 0, 0), (size, size, size))
