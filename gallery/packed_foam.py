"""A foam of bubbles of many sizes: the power diagram of packed balls, closed in one half and open in the other."""

import numpy as np

import frep
from topologies import seeds, stochastic

size = 24.0  # mm
wall = 0.5
strut = 0.7
spread = 0.4  # of the logarithm of the bubbles' radii
state = 2
voxel = 0.15
title = "Foam of packed balls, 130 sizes"

body = frep.box((0, 0, 0), (size, size, size))
radii = np.random.default_rng(3).lognormal(0.4, spread, round(130 * (size / 24) ** 3))
centres = seeds.packed_balls(body, radii, random_state=state)
walls = stochastic.voronoi_walls(body, wall, seeds=centres, weights=radii)
struts = stochastic.voronoi(body, seeds=centres, weights=radii).thicken(strut)
part = (walls & frep.half_space((-1, 0, 0), (size / 2, 0, 0)) | struts) & body
