"""Two laws at once (LF-rep Fig. 4.4): FCC beams thin out along y while their section turns from square to round along z."""

import frep
from graded import linear
from topologies import beams

cell = 10.0
nx = 1
ny = 8
nz = 8
thick = 2.0  # side of the section, mm
thin = 0.5
voxel = 0.125
title = "FCC: side 2.0 to 0.5 mm along y, square to round along z"

side = linear("y", 0, ny * cell, thick, thin)
fillet = side * linear("z", 0, nz * cell, 0.2, 0.5)  # half of the side makes a circle
fcc = beams.fcc(cell=cell).thicken(side, section=beams.square(fillet=fillet))
part = fcc & frep.box((0, 0, 0), (nx * cell, ny * cell, nz * cell))
