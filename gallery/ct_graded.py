"""A head from its CT: an outline by threshold, a gyroid whose walls follow the density, 1.6 mm in soft tissue, 4.6 mm in bone."""

import frep
from graded import from_image, remap, smoothed
from topologies import tpms

ct = "head_ct.vti"  # any CT volume with its voxel size
skin, soft, bone = 500.0, 1100.0, 1500.0  # raw scanner units: where air ends, and where walls begin and end to thicken
thin, thick = 1.6, 4.6  # mm
cell = 11.0
voxel = 0.8
cut = 1  # leave out the half beyond the middle, to look inside
title = "Gyroid graded by the density in a CT"
size = (201.6, 201.6, 138.0)  # mm, the volume scanned

density = from_image(ct)
slope = 100.0  # scanner units a mm near the skin: makes a length of a difference of density
head = frep.Solid((skin - smoothed(density, 3.0)) / slope, bounds=((0, 0, 0), size))
wall = remap(density, (soft, bone), (thin, thick), curve="smoothstep", smoothing=1.5)
part = head & tpms.gyroid(cell=cell).sheet(wall)
if cut:
    part = part & frep.half_space((1, 0, 0), [s / 2 for s in size])
