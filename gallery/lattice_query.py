"""Listing 3 of LF-rep as it stands in LatticeQuery's script, its import line changed."""

from topologies.lattice_query import bcc_heterogeneous_lattice

unit_cell_size = 10
min_strut_diameter = 0.8
max_strut_diameter = 5.0
min_node_diameter = 0.88
max_node_diameter = 5.5
Nx = 4
Ny = 4
Nz = 20
voxel = 0.4
title = "LatticeQuery's BCC by a parabola, layer by layer"
cells = Nx * Ny * Nz

part = bcc_heterogeneous_lattice(
    unit_cell_size, min_strut_diameter, max_strut_diameter, min_node_diameter, max_node_diameter, Nx, Ny, Nz,
    topology="bcc", rule="parabola",
)  # fmt: skip
