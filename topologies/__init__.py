"""Topologies `T`: skeletons and surfaces of no thickness, to which parameter fields give body.

- `topologies.beams`: periodic beam cells and explicit graphs; their tables in `beam_cells`, what they can do in
  `beam_topology`, several in one part in `assembly`, truncation that varies in `truncation`;
- `topologies.tpms`: periodic surfaces; their formulas in `waveforms`, their four variants in `variants`, one turning into
  another in `blends`;
- `topologies.foams`: honeycombs and closed-cell foams with exact distances;
- `topologies.stochastic`: Voronoi, Delaunay and fibre networks, Voronoi walls; their `seeds`, and how space is divided among
  these in `power_diagram`;
- `topologies.noise`: spinodal structures, Perlin and simplex noise;
- `topologies.hierarchy`: beams that are girders, walls and bodies that are filled with lattices;
- `topologies.lattice_query`: the calls of LatticeQuery;
- `topologies.catalogue`: all of them by name, with what is known of each, and designs of experiments;
- `topologies.steady`: bricks of beams along similarities, of any size, and their filters.
"""
