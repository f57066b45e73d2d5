"""Marching cubes on given samples, against VTK's flying edges with SMP threads on the same dense array.

The shape is the gyroid sheet `abs(F) - 0.5`, 10^3 cells in a 50 mm cube at 0.25 mm, cut by the cube so that it is
closed: about 7.7 million triangles. Runs alternate, so that both meet the same machine; the figure is the ratio of
the medians.

    python benchmarks/marching.py [--cells 10] [--runs 5]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numba
import numpy as np

from frep.grid import LEAF, SparseGrid
from frep.meshing.marching import marching_cubes

VOXEL, CELL = 0.25, 5.0


def gyroid_samples(cells: int) -> np.ndarray:
    """Samples over the cube and at least one voxel around it, a whole number of blocks."""
    n = int(cells * CELL / VOXEL)
    size = -(-(n + 5) // LEAF) * LEAF
    x = (np.arange(size, dtype=np.float32) - 2) * np.float32(VOXEL)
    s, c = np.sin(x * np.float32(2 * np.pi / CELL)), np.cos(x * np.float32(2 * np.pi / CELL))
    wall = np.abs(x - np.float32(cells * CELL / 2)) - np.float32(cells * CELL / 2)
    field = s[:, None, None] * c[:, None] + s[:, None] * c
    field += s * c[:, None, None]
    np.subtract(np.abs(field, out=field), np.float32(0.5), out=field)
    for axis in range(3):
        np.maximum(field, np.expand_dims(wall, [a for a in range(3) if a != axis]), out=field)
    return field


def grid_of(samples: np.ndarray) -> SparseGrid:
    """The same samples in blocks, every block a leaf: nothing is culled, as VTK culls nothing."""
    b = samples.shape[0] // LEAF
    blocks = samples.reshape(b, LEAF, b, LEAF, b, LEAF).transpose(0, 2, 4, 1, 3, 5).reshape(-1, LEAF, LEAF, LEAF)
    table = np.arange(b**3, dtype=np.int32).reshape(b, b, b)
    leaves = np.argwhere(table >= 0).astype(np.int32)
    return SparseGrid(np.full(3, -2 * VOXEL), VOXEL, table, leaves, np.ascontiguousarray(blocks), 3 * VOXEL)


def flying_edges(samples: np.ndarray) -> Callable[[], int]:
    """A function that runs VTK once and returns the number of triangles."""
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk

    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(numba.get_num_threads())
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.SetSpacing(VOXEL, VOXEL, VOXEL)
    image.GetPointData().SetScalars(numpy_to_vtk(samples.reshape(-1)))

    def run() -> int:
        filter = vtk.vtkFlyingEdges3D()
        filter.SetInputData(image)
        filter.SetValue(0, 0.0)
        filter.ComputeNormalsOff()
        filter.ComputeGradientsOff()
        filter.ComputeScalarsOff()
        filter.Update()
        return filter.GetOutput().GetNumberOfPolys()

    return run


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--cells", type=int, default=10, help="unit cells along each edge of the cube")
    arguments.add_argument("--runs", type=int, default=5)
    options = arguments.parse_args()

    samples = gyroid_samples(options.cells)
    grid = grid_of(samples)
    runs = {"frep": lambda: len(marching_cubes(grid).faces), "VTK flying edges": flying_edges(samples)}
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    triangles = {}
    for turn in range(options.runs + 1):
        for name, run in runs.items():
            start = time.perf_counter()
            triangles[name] = run()
            if turn > 0:  # the first compiles or loads
                seconds[name].append(time.perf_counter() - start)
    print(f"{samples.shape[0]}^3 samples, {numba.get_num_threads()} threads, median of {options.runs}")
    for name, times in seconds.items():
        median = float(np.median(times))
        rate = triangles[name] / median / 1e6
        print(f"{name:18s} {median:7.4f} s  (best {min(times):.4f})  {triangles[name]:9d} triangles  {rate:6.1f} M/s")
    print(f"ratio frep / VTK   {np.median(seconds['frep']) / np.median(seconds['VTK flying edges']):.2f}")


if __name__ == "__main__":
    main()
