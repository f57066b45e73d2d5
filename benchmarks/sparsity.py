"""How much is evaluated: voxels of the box, and leaf blocks against the blocks that hold surface.

A block holds surface when the 9^3 samples of its cells have two signs. What else is evaluated is the price of bounds that are
not exact, and of the layer of samples that a neighbour's cells need.

    python benchmarks/sparsity.py
"""

from __future__ import annotations

import runpy
import time
from collections.abc import Callable
from pathlib import Path

import _designs as designs
import numpy as np
from _designs import BLEND, VOXEL
from _timing import options, table

from frep import Solid, SparseGrid
from frep.grid import LEAF

HERE = Path(__file__).resolve().parent.parent
BUNNY = HERE.parent / "shared" / "data" / "bunny.ply"


def blocks_with_surface(grid: SparseGrid) -> int:
    """Blocks whose cells meet the surface, counted on the dense grid of signs."""
    inside = grid.dense() < 0
    some, every = inside, inside
    for axis in range(3):
        some = _over_cells(np.logical_or, some, axis)
        every = _over_cells(np.logical_and, every, axis)
    return int(np.count_nonzero(some & ~every))


def _over_cells(combine: np.ufunc, samples: np.ndarray, axis: int) -> np.ndarray:
    """One value a block along an axis: of its eight samples and the first of the next block."""
    first = np.arange(0, samples.shape[axis], LEAF)
    own = combine.reduceat(samples, first, axis=axis)
    following = np.minimum(first + LEAF, samples.shape[axis] - 1)
    return combine(own, samples.take(following, axis=axis))


def infill(body: str) -> tuple[Solid, float]:
    """The gallery's infill of a body, and its voxel."""
    from frep.design import load_design

    design = load_design(HERE / "gallery" / "infill.py", {"body": body, "size": "120"})
    return design.part, design.names["voxel"]


def main() -> None:
    options(__doc__)

    def gallery(script: str) -> tuple[Solid, float]:
        names = runpy.run_path(str(HERE / "gallery" / f"{script}.py"))
        return names["part"], names["voxel"]

    parts: dict[str, Callable[[], tuple[Solid, float]]] = {
        "A gyroid level set": lambda: (designs.a(), VOXEL),
        "A true wall": lambda: (designs.a_true(), VOXEL),
        "CA graded": lambda: (designs.a_graded(), VOXEL),
        "B BCC": lambda: (designs.b(), VOXEL),
        "Bs blended": lambda: (designs.b(10, BLEND), VOXEL),
        "CB graded": lambda: (designs.b_graded(), VOXEL),
        "demo 1 BCC": lambda: gallery("bcc_parabola"),
        "demo 2 Schwarz P": lambda: gallery("schwarz_p_linear"),
        "demo 3 airplane": lambda: gallery("infill"),
    }
    if BUNNY.exists():
        parts["bunny infill"] = lambda: infill(str(BUNNY))
    else:
        print(f"bunny infill left out: {BUNNY} is not here")
    rows = []
    for name, make in parts.items():
        part, voxel = make()
        start = time.perf_counter()
        grid = part.sample(voxel=voxel)
        seconds = time.perf_counter() - start
        surface = blocks_with_surface(grid)
        leaves = len(grid.leaves)
        rows.append(
            [
                name,
                f"{grid.n_voxels_in_box:,}",
                f"{grid.n_voxels_evaluated:,}",
                f"{100 * grid.n_voxels_evaluated / grid.n_voxels_in_box:.1f} %",
                f"{leaves:,}",
                f"{surface:,}",
                f"{leaves / surface:.2f}",
                f"{seconds:.2f}",
            ]
        )
    heads = ["part", "voxels in the box", "evaluated", "", "leaf blocks", "with surface", "ratio", "sampling s"]
    table(heads, rows)
    print("ratio of leaf blocks to blocks that hold surface: reach <= 2")


if __name__ == "__main__":
    main()
