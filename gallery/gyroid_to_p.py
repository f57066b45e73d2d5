"""A gyroid becomes Schwarz P across a gap of a cell, its wall graded the other way and true in the gap too (LF-rep Fig. 4.10)."""

import frep
from graded import linear, transition
from topologies import tpms

cell = 10.0
length = 6  # cells
wide = 3
gap = 10.0  # mm
thin = 0.6
thick = 1.6
voxel = 0.2
title = "Gyroid to Schwarz P across a gap"

# A gyroid passes through the corners of its cells: a block cut there would have a chip in one of its own.
start = cell / 4
block = frep.box((0, start, 0), (length * cell, start + wide * cell, wide * cell))
middle = ((length * cell / 2, 0, 0), (1, 0, 0))
surface = transition(tpms.gyroid(cell=cell), tpms.schwarz_p(cell=cell), plane=middle, width=gap, over=block)
part = surface.sheet(linear("z", 0, wide * cell, thin, thick)) & block
