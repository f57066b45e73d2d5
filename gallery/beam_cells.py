"""Every beam cell of the catalogue, two by two by two, in the order of `frep topologies`, from the upper left."""

import math

import numpy as np

import frep
from frep.view import THREE_QUARTER
from topologies import catalogue

across = 2  # cells each way
diameter = 0.19  # of the beams, by that at which the cell is full
side = 20.0  # mm, of a block
wide = 6  # blocks in a row
pitch = 34.0  # mm, from block to block
voxel = 0.25
title = "Beam cells of the catalogue"

names = catalogue.names("beams")
right = (-math.sin(THREE_QUARTER[0]), math.cos(THREE_QUARTER[0]))  # rows as the picture sees them
blocks = []
for k, entry in enumerate(map(catalogue.describe, names)):
    box = entry.block(across)
    block = entry.solid("thicken", diameter * entry.span("thicken")[1]) & box
    block = block.scale(side / np.prod(box.bounds[1]) ** (1 / 3))
    blocks.append(block.translate((pitch * (k % wide) * right[0], pitch * (k % wide) * right[1], -pitch * (k // wide))))
part = frep.union(*blocks)
