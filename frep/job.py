"""A design made: sampled and meshed, with what there is to tell about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from frep.errors import ArgumentError
from frep.progress import Stages

if TYPE_CHECKING:
    from frep.design import Design
    from frep.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Made:
    """What `make` made.

    Attributes:
        mesh: the part's surface.
        voxel: the voxel it was sampled at, mm.
        cells: unit cells in the part, where the design tells.
        evaluated: samples at which the field was evaluated.
        in_box: samples that a dense grid over the same box would have.
        stages: where the seconds went.
    """

    mesh: Mesh
    voxel: float
    cells: int | None
    evaluated: int
    in_box: int
    stages: Stages

    def facts(self) -> dict[str, str]:
        """The lines of the closing table."""
        facts = {"voxel, mm": f"{self.voxel:g}"}
        if self.cells is not None:
            facts["cells"] = f"{self.cells:,}"
        facts["voxels evaluated"] = f"{self.evaluated:,}"
        facts["of voxels in the box"] = f"{self.in_box:,} ({100 * self.evaluated / max(self.in_box, 1):.1f} %)"
        facts["triangles"] = f"{self.mesh.n_faces:,}"
        facts["volume, mm3"] = f"{self.mesh.volume:,.1f}"
        facts["area, mm2"] = f"{self.mesh.area:,.1f}"
        return facts


def size_text(bounds: Mapping[int, object]) -> str:
    raise NotImplementedError


def make(design: Design, stages: Stages, *, voxel: float | None = None, polish: bool = False) -> Made:
    """Sample and mesh a design's part.

    Args:
        design: a design file that has been run.
        stages: the job's stages, entered.
        voxel: mm; the script's own `voxel` where None.
        polish: move the vertices onto the surface by Newton steps.

    Raises:
        ArgumentError: neither the caller nor the script gives a voxel.
        FrepError: whatever sampling and meshing refuse.
    """
    if voxel is None:
        voxel = design.names.get("voxel")
        if not isinstance(voxel, int | float) or isinstance(voxel, bool):
            raise ArgumentError(f"voxel: {design.path} sets no `voxel`, so give one, for example --voxel 0.5")
