"""A gyroid whose wall is a sandwich: two skins, and a lattice between them."""

import frep
from topologies import beams, tpms
from topologies.hierarchy import filled

size = 30.0
wall = 4.0  # mm, of which
skin = 0.4  # on either side
voxel = 0.1
title = "A gyroid of sandwich walls"

core = beams.bcc(cell=2).thicken(0.5)
part = filled(tpms.gyroid(cell=20).sheet(wall), core, skin=skin) & frep.box((0, 0, 0), (size, size, size))
