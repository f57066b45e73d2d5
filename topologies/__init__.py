"""Topologies `T`: skeletons and surfaces of no thickness, to which parameter fields give body.

- `topologies.beams`: periodic beam cells and explicit graphs;
- `topologies.tpms`: triply periodic minimal surfaces;
- `topologies.steady`: bricks of beams along similarities, of any size, and their filters.
"""
