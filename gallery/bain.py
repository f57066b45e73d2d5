"""FCC becomes BCC across a plane, and every node on the plane belongs to both (LF-rep Fig. 4.6, Bain's correspondence)."""

import math

import frep
from graded import transition
from topologies import beams

u = 3.75  # cell of FCC, mm
p = 10  # cells
diameter = 0.7
node = 0.75
voxel = 0.12
title = "FCC to BCC across a plane"

size = p * u
block = frep.box((0, 0, 0), (size, size, size))
short = u / math.sqrt(2)
fcc = beams.fcc(cell=u)
bcc = beams.bcc(cell=(short, u, short)).rotate("y", math.pi / 4)
plane = ((size, 0, 0), (1, 0, 1))  # a point and the normal, from FCC to BCC
lattice = transition(fcc, bcc, plane=plane, over=block)
matched = lattice.report.matched
components = lattice.report.components
part = lattice.thicken(diameter, node=node)
