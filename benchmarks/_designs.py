"""The parts that the benchmarks share with `peers.py`, in frep's own words. All fill a cube of cells of 5 mm.

A: gyroid level-set sheet; B: BCC, strut radius 0.4 mm; CA, CB: the same with a thickness that is linear along z.
"""

from __future__ import annotations

import math

import frep
from frep import Field, Solid
from graded import linear
from topologies import beams, tpms

CELL, VOXEL = 5.0, 0.25
RADIUS, BLEND = 0.4, 0.4
GRADED_RADIUS = (0.3, 0.5)
LEVEL = 0.5
GRADED_LEVEL = (0.3, 0.7)
WALL = 0.65


def cube(cells: int) -> Solid:
    """The design space."""
    return frep.box((0, 0, 0), (CELL * cells,) * 3)


def gyroid_level(x: Field, y: Field, z: Field) -> Field:
    """The gyroid of 5 mm cells, composed from coordinates."""
    k = 2 * math.pi / CELL
    x, y, z = k * x, k * y, k * z
    return frep.sin(x) * frep.cos(y) + frep.sin(y) * frep.cos(z) + frep.sin(z) * frep.cos(x)


def a(cells: int = 10) -> Solid:
    """A: `abs(F) - 0.5`."""
    return frep.Solid(abs(gyroid_level(*frep.coordinates())) - LEVEL) & cube(cells)


def a_graded(cells: int = 10) -> Solid:
    """CA: the level from 0.3 to 0.7."""
    level = linear("z", 0, CELL * cells, *GRADED_LEVEL)
    return frep.Solid(abs(gyroid_level(*frep.coordinates())) - level) & cube(cells)


def a_true(cells: int = 10) -> Solid:
    """The same sheet with a wall of 0.65 mm, measured along its normal."""
    return tpms.gyroid(cell=CELL).sheet(WALL) & cube(cells)


def b(cells: int = 10, blend: float = 0.0) -> Solid:
    """B, or Bs with a blend."""
    return beams.bcc(cell=CELL).thicken(2 * RADIUS, blend=blend) & cube(cells)


def b_graded(cells: int = 10) -> Solid:
    """CB: the radius from 0.3 to 0.5 mm."""
    r0, r1 = GRADED_RADIUS
    return beams.bcc(cell=CELL).thicken(linear("z", 0, CELL * cells, 2 * r0, 2 * r1)) & cube(cells)
