"""Sparse grids: 8 x 8 x 8 leaf blocks of samples where surface can be, constant tiles elsewhere.

The layout is OpenVDB's, so that `.vdb` export is a copy. A block holds samples, not cells: sample `(i, j, k)` of the grid
lies at `origin + voxel * (i, j, k)` and belongs to block `(i // 8, j // 8, k // 8)`. A block is a *leaf* when a sign change
can touch one of its samples, that is when the field may vanish within one voxel around it; therefore every cell that
holds surface has all eight corners in leaves. Memory grows with the surface, not with the volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LEAF = 8
"""Samples along the edge of a leaf block."""

OUTSIDE = -1
"""`SparseGrid.table` entry of a block that is wholly outside the solid."""

INSIDE = -2
"""`SparseGrid.table` entry of a block that is wholly inside the solid."""


@dataclass(frozen=True, eq=False)
class SparseGrid:
    """Samples of a signed field (mm, negative inside) in a narrow band of leaf blocks.

    Attributes:
        origin: (3,) float64, the position of sample (0, 0, 0) in mm.
        voxel: distance of neighbouring samples, mm.
        table: (bx, by, bz) int32, for each block its leaf number, or `OUTSIDE`, or `INSIDE`.
        leaves: (n, 3) int32, the block coordinates of each leaf, in lexicographic order.
        values: (n, 8, 8, 8) float32, `values[l, i, j, k]` is the field at sample `8 * leaves[l] + (i, j, k)`.
        background: the magnitude, in mm, that stands for "far" when a tile must become a number.
    """

    origin: np.ndarray
    voxel: float
    table: np.ndarray
    leaves: np.ndarray
    values: np.ndarray
    background: float

    @property
    def shape(self) -> tuple[int, int, int]:
        """Samples along each axis of the whole box."""
        bx, by, bz = self.table.shape
        return (bx * LEAF, by * LEAF, bz * LEAF)

    @property
    def n_voxels_in_box(self) -> int:
        """Samples that a dense grid over the same box would hold."""
        return self.table.size * LEAF**3

    @property
    def n_voxels_evaluated(self) -> int:
        """Samples that were evaluated."""
        return len(self.leaves) * LEAF**3

    def dense(self) -> np.ndarray:
        """The whole box as one float32 array; tiles become plus or minus `background`. For tests and small grids."""
        blocks = np.where(self.table == INSIDE, -self.background, self.background).astype(np.float32)
        full = np.broadcast_to(blocks[..., None, None, None], (*self.table.shape, LEAF, LEAF, LEAF)).copy()
        full[tuple(self.leaves.T)] = self.values
        return np.ascontiguousarray(full.transpose(0, 3, 1, 4, 2, 5)).reshape(self.shape)
