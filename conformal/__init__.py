"""Coordinate maps: how a lattice follows a cylinder, a surface or a volume.

`steady_map` carries a lattice along powers of similarities and makes its balls round again. Any other map is a substitution of
coordinates, `Field.substitute`.
"""
