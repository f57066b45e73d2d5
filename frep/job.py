"""A design made: sampled and meshed, with what there is to tell about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from frep.errors import ArgumentTypeError

if TYPE_CHECKING:
    from frep.design import Design
    from frep.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Made:
    """What `make` made.

    Attributes:
        mesh: the part's surface.
        volume: of the part, mm3, from the field.
        voxel: distance of the samples, mm.
        cells: unit cells in the part, where the design tells.
        evaluated: samples at which the field was evaluated.
        in_box: samples that a dense grid over the same box would have.
    """

    mesh: Mesh
    volume: float
    voxel: float
    cells: int | None
    evaluated: int
    in_box: int

    def facts(self) -> dict[str, str]:
        """The lines of the closing table."""
        facts = {"voxel, mm": f"{self.voxel:g}"}
        if self.cells is not None:
            facts["cells"] = f"{self.cells:,}"
        facts["voxels evaluated"] = f"{self.evaluated:,}"
        facts["voxels in the box"] = f"{self.in_box:,}"
        facts["evaluated, %"] = f"{100 * self.evaluated / self.in_box:.1f}"
        facts["triangles"] = f"{self.mesh.n_faces:,}"
        facts["volume, mm3"] = f"{self.volume:,.1f}"
        facts["area, mm2"] = f"{self.mesh.area:,.1f}"
        return facts


def make(design: Design, *, voxel: float | None = None, tolerance: float | None = None, polish: bool = False) -> Made:
    """Sample and mesh a design's part.

    Args:
        design: a design file that has been run.
        voxel: distance of the samples, mm. Where neither it nor `tolerance` is given: the script's own `voxel`, and
            without that what `Solid.mesh` takes.
        tolerance: instead, the largest distance that facets may keep from the surface, mm.
        polish: move the vertices onto the surface by Newton steps.

    Raises:
        ArgumentTypeError: the script's `voxel` or `cells` is not a number.
        FrepError: whatever `Solid.mesh` refuses.
    """
    from frep.measure import volume_of
    from frep.meshing.mesher import mesh_samples
    from frep.sampling import MESH_BYTES
    from frep.sizing import sample_solid

    if voxel is None and tolerance is None:
        voxel = _number(design, "voxel")
    cells = _number(design, "cells")
    # The steps of Solid.mesh, one by one: the samples are counted, and not made twice for it.
    grid = sample_solid(design.part, voxel, tolerance, extra_bytes=MESH_BYTES)
    mesh = mesh_samples(design.part, grid, polish)
    return Made(
        mesh=mesh,
        volume=volume_of(grid),
        voxel=grid.voxel,
        cells=None if cells is None else round(cells),
        evaluated=grid.n_voxels_evaluated,
        in_box=grid.n_voxels_in_box,
    )


def _number(design: Design, name: str) -> float | None:
    value = design.names.get(name)
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise ArgumentTypeError(f"{name}: {design.path} sets it to {value!r}; expected a number")
    return value
