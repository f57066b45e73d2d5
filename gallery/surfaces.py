"""Every surface of the catalogue, two by two by two, in the order of `frep topologies`, from the upper left."""

import math

import frep
from frep.view import THREE_QUARTER
from topologies import catalogue

across = 2  # cells each way
wall = 0.7  # mm; 0 for what lies on one side
scale = "distance"  # "gradient" needs no tables of distances
cell = 10.0
wide = 6  # blocks in a row
pitch = 34.0  # mm, from block to block
voxel = 0.2
title = "Surfaces of the catalogue"

names = catalogue.names("surfaces")
right = (-math.sin(THREE_QUARTER[0]), math.cos(THREE_QUARTER[0]))  # rows as the picture sees them
blocks = []
for k, entry in enumerate(map(catalogue.describe, names)):
    surface = entry.build(cell=cell, scale=scale, **entry.example)
    block = (surface.sheet(wall) if wall else surface.solid()) & frep.box(
        (-0.5 * across * cell,) * 3, (0.5 * across * cell,) * 3
    )
    blocks.append(block.translate((pitch * (k % wide) * right[0], pitch * (k % wide) * right[1], -pitch * (k // wide))))
part = frep.union(*blocks)
