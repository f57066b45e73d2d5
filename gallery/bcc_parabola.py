"""A BCC lattice whose beams swell from 1 to 6 mm and back along x, with nodes 10 % larger (LF-rep Fig. 4.2)."""

import frep
from graded import parabola
from topologies import beams

length = 200.0  # mm
cell = 10.0
voxel = 0.5
title = "BCC, 1 to 6 to 1 mm by a parabola"
cells = round(length / cell) * 6 * 6

diameter = parabola("x", 0, length, ends=1, middle=6)
part = beams.bcc(cell=cell).thicken(diameter, node=1.1 * diameter) & frep.box((0, 0, 0), (length, 6 * cell, 6 * cell))
