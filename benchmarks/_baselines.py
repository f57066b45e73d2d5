"""What frep is measured against: kernels written by hand for one shape each, and two ways from samples to triangles.

The kernels are what a patient engineer would write in numba for exactly this shape: float32, one pass, tables along the
axes, each strut in its own box, threads over slabs of planes, no intermediate array. They know nothing of other shapes.
Samples lie at `voxel * (i - 0.5)`, where frep's lie; the outermost layer is a positive constant, the cheap way to close
the mesh (its caps lie off the box by a part of a voxel; frep's lie on it).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numba import njit, prange

TAU = 2.0 * math.pi


@njit(parallel=True, fastmath=True, cache=True)
def _gyroid(s, c, level, out):
    n = len(s)
    far = np.float32(0.5)
    for i in prange(n):
        if i == 0 or i == n - 1:
            out[i] = far
            continue
        for j in range(n):
            if j == 0 or j == n - 1:
                out[i, j] = far
                continue
            a, b, d = s[i] * c[j], s[j], c[i]
            for k in range(n):
                out[i, j, k] = abs(a + b * c[k] + s[k] * d) - level[k]
            out[i, j, 0] = out[i, j, n - 1] = far


def gyroid_samples(cells: int, cell: float, voxel: float, level: tuple[float, float]) -> np.ndarray:
    """`abs(F) - level` of a gyroid, the level linear along z from its first to its second value."""
    n = round(cells * cell / voxel) + 2
    x = voxel * (np.arange(n) - 0.5)
    s, c = (f(x * (TAU / cell)).astype(np.float32) for f in (np.sin, np.cos))
    levels = np.interp(x, (0.0, cells * cell), level).astype(np.float32)
    out = np.empty((n, n, n), np.float32)
    _gyroid(s, c, levels, out)
    return out


_SLAB = 8


@njit(parallel=True, fastmath=True, cache=True)
def _struts(a, b, voxel, radius, reach, blend, out):
    # A slab of planes a thread at a time, which stays in its cache; 1.5 ns a strut and voxel of its box.
    n = len(radius)
    for slab in prange((n + _SLAB - 1) // _SLAB):
        first, last = slab * _SLAB, min((slab + 1) * _SLAB, n)
        part = out[first:last]
        total = np.zeros(part.shape if blend > 0.0 else (1, 1, 1), np.float32)
        part[:] = np.float32(1e4)
        for s in range(len(a)):
            i0 = max(first, math.ceil((min(a[s, 0], b[s, 0]) - reach) / voxel + 0.5))
            i1 = min(last, math.floor((max(a[s, 0], b[s, 0]) + reach) / voxel + 0.5) + 1)
            if i0 >= i1:
                continue
            j0 = max(1, math.ceil((min(a[s, 1], b[s, 1]) - reach) / voxel + 0.5))
            j1 = min(n - 1, math.floor((max(a[s, 1], b[s, 1]) + reach) / voxel + 0.5) + 1)
            k0 = max(1, math.ceil((min(a[s, 2], b[s, 2]) - reach) / voxel + 0.5))
            k1 = min(n - 1, math.floor((max(a[s, 2], b[s, 2]) + reach) / voxel + 0.5) + 1)
            ux, uy, uz = b[s, 0] - a[s, 0], b[s, 1] - a[s, 1], b[s, 2] - a[s, 2]
            length = math.sqrt(ux * ux + uy * uy + uz * uz)
            ux, uy, uz = np.float32(ux / length), np.float32(uy / length), np.float32(uz / length)
            most, zero = np.float32(length), np.float32(0.0)
            step, start = np.float32(voxel), np.float32(-0.5 * voxel - a[s, 2])
            k_blend = np.float32(blend)
            for i in range(i0, i1):
                x = np.float32((i - 0.5) * voxel - a[s, 0])
                for j in range(j0, j1):
                    y = np.float32((j - 0.5) * voxel - a[s, 1])
                    along = x * ux + y * uy
                    for k in range(k0, k1):
                        z = start + step * np.float32(k)
                        t = min(max(along + z * uz, zero), most)
                        qx, qy, qz = x - t * ux, y - t * uy, z - t * uz
                        square = qx * qx + qy * qy + qz * qz
                        part[i - first, j, k] = min(part[i - first, j, k], square)
                        if blend > 0.0:
                            near = max(k_blend + radius[k] - np.sqrt(square), zero)
                            total[i - first, j, k] += near * near
        for i in range(first, last):
            border = i == 0 or i == n - 1
            for j in range(n):
                if border or j == 0 or j == n - 1:
                    out[i, j] = np.float32(0.5)
                    continue
                for k in range(n):
                    d = np.sqrt(out[i, j, k]) - radius[k]
                    if blend > 0.0:
                        d = max(np.float32(blend), d) - np.sqrt(total[i - first, j, k])
                    out[i, j, k] = d
                out[i, j, 0] = out[i, j, n - 1] = np.float32(0.5)


def bcc_struts(cells: int, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """The ends of the eight half diagonals of every cell."""
    corners = np.argwhere(np.ones((2, 2, 2), bool)).astype(float)
    cubes = np.argwhere(np.ones((cells, cells, cells), bool)).astype(float)
    a = np.repeat(cubes + 0.5, 8, axis=0) * cell
    b = (cubes[:, None] + corners).reshape(-1, 3) * cell
    return a, b


def bcc_samples(cells: int, cell: float, voxel: float, radius: tuple[float, float], blend: float = 0.0) -> np.ndarray:
    """Distance to BCC struts whose radius is linear along z; `blend` > 0 is the n-ary round union that frep has."""
    a, b = bcc_struts(cells, cell)
    n = round(cells * cell / voxel) + 2
    z = voxel * (np.arange(n) - 0.5)
    radii = np.interp(z, (0.0, cells * cell), radius).astype(np.float32)
    out = np.empty((n, n, n), np.float32)
    # The samples next to the surface, half a cell's diagonal beyond it, must be right; farther ones may stay large.
    reach = max(radius) + max(blend, 0.0) + 1.8 * voxel
    _struts(a, b, voxel, radii, reach, blend, out)
    return out


def flying_edges(samples: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and faces (m, 3) by VTK's flying edges with SMP threads, without a copy on either side.

    VTK's first axis is the fastest: it gets the dimensions reversed, and the columns of its points are swapped back.
    """
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(numba.get_num_threads())
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.SetSpacing(voxel, voxel, voxel)
    image.SetOrigin(-0.5 * voxel, -0.5 * voxel, -0.5 * voxel)
    image.GetPointData().SetScalars(numpy_to_vtk(samples.reshape(-1)))
    contour = vtk.vtkFlyingEdges3D()
    contour.SetInputData(image)
    contour.SetValue(0, 0.0)
    contour.ComputeNormalsOff()
    contour.ComputeGradientsOff()
    contour.ComputeScalarsOff()
    contour.Update()
    made = contour.GetOutput()
    vertices = vtk_to_numpy(made.GetPoints().GetData())[:, ::-1]
    return vertices, vtk_to_numpy(made.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def skimage_cubes(samples: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces by scikit-image, of samples to which a layer of outside is added to close the mesh."""
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(np.pad(samples, 1, constant_values=0.5), 0.0, spacing=(voxel,) * 3)
    return vertices - 0.5 * voxel, faces


def grid(cells: int, cell: float, voxel: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates along the three axes, shaped to broadcast, float32: what a scientist would start with."""
    x = voxel * (np.arange(round(cells * cell / voxel), dtype=np.float32) + np.float32(0.5))
    return x[:, None, None], x[:, None], x


def triangles(made) -> int:
    """Triangles of a frep mesh, or of (vertices, faces)."""
    return len(made.faces) if hasattr(made, "faces") else len(made[1])
