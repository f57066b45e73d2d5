"""A spinodal block, columnar along z, whose solid share grows from 0.35 to 0.65 (Kumar et al. 2020)."""

import frep
from graded import linear
from topologies import noise

size = 40.0  # mm
cell = 6.0  # mm, from a wall to the next
least, most = 0.35, 0.65  # solid share at the two ends
wall = 0.0  # mm: a sheet of that thickness instead of the solid phase
seed = 3
voxel = 0.25
title = "Columnar spinodal, solid share graded from 0.35 to 0.65"
cells = round(size / cell) ** 3

structure = noise.spinodal(cell, directions=["x", "y"], spread=0.35, repeat=8, random_state=seed)
share = linear("x", 0, size, least, most)
phase = structure.sheet(wall) if wall else structure.solid(share)
part = phase & frep.box((0, 0, 0), (size, size, size))
