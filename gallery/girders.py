"""A lattice of lattices: the beams of an octahedron are girders, whose beams are girders in turn."""

import frep
from topologies import beams
from topologies.hierarchy import trussed

size = 80.0  # mm, the octahedron's diagonal
voxel = 0.16
title = "An octahedron of girders of girders"

block = frep.box((0, 0, 0), (size, size, size))
frame = trussed(beams.octahedron(cell=size).over(block), size / 8)
part = trussed(frame, size / 50, bays=4).thicken(size / 200)
