"""Foams, stochastic lattices and noises of the catalogue, blocks of one size, in the order of `frep topologies`."""

import math

import numpy as np

import frep
from frep.view import THREE_QUARTER
from topologies import catalogue

across = 2  # cells each way, of those that have cells
side = 20.0  # mm, of a block
wide = 4  # blocks in a row
pitch = 34.0  # mm, from block to block
voxel = 0.2
title = "Foams, stochastic lattices and noises of the catalogue"

names = [name for family in ("foams", "stochastic", "noise") for name in catalogue.names(family)]
right = (-math.sin(THREE_QUARTER[0]), math.cos(THREE_QUARTER[0]))  # rows as the picture sees them
blocks = []
for k, entry in enumerate(map(catalogue.describe, names)):
    box = entry.block(across if entry.family == "foams" else 1)
    block = (entry.solid(*entry.shown) & box).scale(side / np.prod(box.bounds[1]) ** (1 / 3))
    blocks.append(block.translate((pitch * (k % wide) * right[0], pitch * (k % wide) * right[1], -pitch * (k // wide))))
part = frep.union(*blocks)
