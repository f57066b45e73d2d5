"""Coordinate maps: how a lattice follows a cylinder, a surface or a volume.

A map is a substitution of coordinates, `Field.substitute`; the maps themselves are still to come.
"""
