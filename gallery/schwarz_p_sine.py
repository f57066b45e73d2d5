"""Schwarz P of 10 x 10 x 20 cells whose wall goes from 1 to 7 mm and back three times (LF-rep Fig. 4.3)."""

import frep
from graded import sine
from topologies import tpms

cell = 20.0
wide = 10  # cells
high = 20
voxel = 0.5
title = "Schwarz P, walls of 1 to 7 mm by a sine"

height = high * cell
wall = sine("z", mean=4, amplitude=3, period=height / 3)
part = tpms.schwarz_p(cell=cell).sheet(wall) & frep.box((0, 0, 0), (wide * cell, wide * cell, height))
