"""Topologies `T`: skeletons and surfaces of no thickness, to which parameter fields give body.

- `topologies.beams`: periodic beam cells and explicit graphs; their tables in `beam_cells`;
- `topologies.tpms`: periodic surfaces; their formulas in `waveforms`, their four variants in `variants`;
- `topologies.foams`: honeycombs and closed-cell foams with exact distances;
- `topologies.stochastic`: Voronoi, Delaunay and fibre networks, Voronoi walls; their `seeds`;
- `topologies.noise`: spinodal structures, Perlin and simplex noise;
- `topologies.steady`: bricks of beams along similarities, of any size, and their filters.
"""
