"""From a solid to a mesh: sample, march, polish."""

from __future__ import annotations

import numpy as np

from ..errors import EmptyError
from ..grid import SparseGrid
from ..mesh import Mesh
from ..progress import progress
from ..sampling import MESH_BYTES
from ..sizing import sample_solid
from ..solid import Solid
from .marching import marching_cubes


def mesh_solid(solid: Solid, voxel: float | None, tolerance: float | None, polish: bool) -> Mesh:
    """`Solid.mesh`."""
    return mesh_samples(solid, sample_solid(solid, voxel, tolerance, extra_bytes=MESH_BYTES), polish)


def mesh_samples(solid: Solid, grid: SparseGrid, polish: bool) -> Mesh:
    """The mesh of a solid that has been sampled."""
    with progress("meshing", total=1) as advance:
        surface = marching_cubes(grid)
        advance(1)
    if not len(surface.faces):
        raise EmptyError("the solid is empty: its surface meets no voxel edge")
    vertices = surface.vertices
    if polish:
        from ..polish import polished

        vertices = polished(solid, vertices, surface.faces, grid.voxel)
    return Mesh._made(vertices, surface.faces)


def trial_sag(solid: Solid, voxel: float) -> float:
    """99th percentile of the distance between facet centres and the surface, mm, of a coarse polished mesh."""
    from ..polish import surface_distance

    grid = sample_solid(solid, voxel, None, quiet=True)
    surface = marching_cubes(grid)
    if not len(surface.faces):
        return 0.0
    faces = surface.faces[:: max(1, len(surface.faces) // 20000)]
    used, local = np.unique(faces, return_inverse=True)
    corners = surface.vertices[used]
    distance, normal = surface_distance(solid, corners, voxel)
    corners = corners - np.clip(distance, -voxel, voxel)[:, None] * normal
    centres = corners[local.reshape(-1, 3)].mean(axis=1)
    sag, _ = surface_distance(solid, centres, voxel)
    return float(np.percentile(np.abs(sag), 99.0))
