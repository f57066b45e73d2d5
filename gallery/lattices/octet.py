"""A bent and tapered octet truss: a slab of octet cells, carried along a spiral by a swirl, which bends and shrinks it."""

import math

import frep
from topologies.steady import SteadyLattice, Swirl, Translation

title = "Bent and tapered octet"
voxel = 0.2
cell = frep.parameter(10.0, 1, 100, "mm", "side of the first cells")
diameter = frep.parameter(0.1, 0.02, 0.2, help="of the beams, by the side of their cell")
bend = frep.parameter(1.6, 0.05, 3, "rad", "from the first layer to the last")
taper = frep.parameter(0.4, 0.1, 2, help="size of the last cells by that of the first")
wide = frep.parameter(5, 2, 10_000, help="cells across, either way")
long = frep.parameter(20, 2, 10_000, help="cells along the bend")

nodes = [(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)]
steps = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
racks = [
    (a, b, *step)
    for a in range(4)
    for b in range(a + 1, 4)
    for step in steps
    if math.isclose(math.dist(nodes[a], [x + d for x, d in zip(nodes[b], step, strict=True)]), math.sqrt(0.5))
]
middle = 0.5 * cell * (wide - 1)
away = cell * long / bend  # the layers follow one another at the side of a cell
lattice = SteadyLattice(
    nodes=[(cell * x, cell * y, cell * z) for x, y, z in nodes],
    radii=[0.5 * diameter * cell] * 4,
    racks=racks,
    u=Translation((cell, 0, 0)),
    v=Translation((0, cell, 0)),
    w=Swirl(taper ** (1 / long), center=(middle - away, middle, 0), angle=bend / long, axis=(0, -1, 0)),
    counts=(wide, wide, long),
)
