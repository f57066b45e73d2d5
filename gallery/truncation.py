"""Truncation as a transition: cubes become cuboctahedra upwards (or octahedra), beams swell along x (LF-rep Fig. 4.7, 4.8)."""

import frep
from graded import linear
from topologies import beams

kind = "truncated_cube"  # or "rhombicuboctahedron"
cell = 10.0
n = 10
thin = 0.5
thick = 5.0
voxel = 0.25
title = "Truncated cubes, 0 to u/2 along z"

size = n * cell
block = frep.box((0, 0, 0), (size, size, size))
tau = linear("z", 0, size, 0, cell / 2)
diameter = linear("x", 0, size, thin, thick)
lattice = getattr(beams, kind)(cell=cell, tau=tau, over=block)
part = lattice.thicken(diameter, node=1.1 * diameter)
