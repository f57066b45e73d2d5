"""Fields from results on meshes: finite elements and their like, by VTK's own interpolation."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from frep import ArgumentError, ArgumentTypeError, Field, foreign
from frep.arguments import positive, sizes

from .data import array_of, checked_nan, dataset, filled, grid_field, lattice

_CLOSEST = 50_000
"""Most grid nodes beside a mesh that get the value of the closest point on it; beyond, that of the closest node."""

_KIN = {5: (3, 22, 6), 9: (4, 23, 8), 10: (4, 24, 10), 12: (8, 25, 20), 13: (6, 26, 15), 14: (5, 27, 13)}
"""Linear VTK cells: their corners, their quadratic kin and its nodes (corners first in both)."""


def from_mesh_data(
    data: Any,
    array: str | None = None,
    *,
    spacing: Any = None,
    component: int | str | None = None,
    scale: float = 1.0,
    nan: float | str | None = None,
) -> Field:
    """A result on the nodes or cells of a mesh, such as a stress of a finite-element calculation.

    Inside the mesh the values are VTK's own interpolation in each cell, quadratic ones included (numbers of cells are
    constant in each); outside it the value at the nearest point of the mesh: a mesh of triangles or shells, which has
    no inside, gives its values to the space about it. Quadratic cells with results on their corners only are taken as
    linear.

    Args:
        data: path of a mesh with results (`.vtk`, `.vtu`, whatever pyvista reads), or a pyvista dataset.
        array: name of the array; not needed where there is one.
        spacing: resample onto a grid of this distance in mm, one number or three: a lookup for each voxel, and true
            bounds. None asks VTK at every point instead: exact, but far slower, and every voxel is asked.
        component: of an array with several numbers a point: their index, or "magnitude".
        scale: mm for each unit of the mesh's coordinates; 1000 for a mesh in metres. Values are not scaled.
        nan: as for `from_grid`. Nodes that no interpolation uses may hold NaN.

    Raises:
        ArgumentError: no such array (the message lists those there are), several components and none chosen, NaN.
        FileError: the file is missing or cannot be read.

    Example:
        >>> import pyvista
        >>> block = pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid()
        >>> block["load"] = 2 * block.points[:, 0]
        >>> from_mesh_data(block, "load", spacing=0.5)([[0.3, 1, 1], [9, 1, 1]]).round(6)
        array([0.6, 4. ])
    """
    factor, nan = positive(scale, "scale", " of mm for each unit of the mesh"), checked_nan(nan)
    step = None if spacing is None else sizes(spacing, "spacing") / factor
    label = Path(data).name if isinstance(data, str | os.PathLike) else "mesh data"
    mesh = _single(dataset(data, "data") if isinstance(data, str | os.PathLike) else data, "data")
    values, association = array_of(mesh, array)
    values = _component(values, component, array)
    mesh, values = _mended(mesh, values, association)
    probe = _probe(mesh, values, association)
    if step is None:
        _refuse_nan(*probe(np.array(mesh.points, float))[:2], factor * np.array(mesh.points, float), nan)

        def at(x, y, z):
            points = np.stack([np.atleast_1d(c) for c in (x, y, z)], axis=1) / factor
            return _at_points(mesh, probe, points, nan)

        return foreign(at, name=label)
    nodes, shape, origin, step = lattice(np.reshape(mesh.bounds, (3, 2)).T, step)
    on = nodes if _has_inside(mesh) else _closest_on(mesh, nodes)
    found, inside = probe(on)
    _refuse_nan(found, inside, factor * nodes, nan)
    known = inside & np.isfinite(found)
    if nan is not None and nan != "nearest":
        found[inside & ~known] = nan
        known = inside
    _fill_rim(mesh, probe, nodes, found, known, inside, shape)
    field = filled(found.reshape(shape), ~known.reshape(shape), step, "nearest") if not known.all() else found
    return grid_field(field.reshape(shape), step * factor, origin * factor, nan=None, label=label, name="data")


def _single(data: Any, name: str) -> Any:
    """One dataset, blocks put together."""
    import pyvista

    if isinstance(data, pyvista.MultiBlock):
        data = data.combine()
    if not isinstance(data, pyvista.DataSet):
        raise ArgumentTypeError(f"{name}: expected a path or a pyvista dataset, got {type(data).__name__}")
    return data


def _component(values: np.ndarray, component: int | str | None, array: str | None) -> np.ndarray:
    index = int(component) if isinstance(component, int | np.integer) and not isinstance(component, bool) else None
    what = "the array" if array is None else repr(array)
    if values.ndim == 1:
        if component is None or index == 0:
            return values
        raise ArgumentError(f"component: {what} holds one number a place, so that there is no {component!r}")
    n = values.shape[1]
    if isinstance(component, str) and component == "magnitude":
        return np.linalg.norm(values, axis=1)
    if index is not None and 0 <= index < n:
        return values[:, index]
    raise ArgumentError(
        f'component: {what} holds {n} numbers a place; give 0 to {n - 1} or "magnitude", got {component!r}'
    )


def _has_inside(mesh: Any) -> bool:
    """Whether some of its cells are solid, so that points can lie in them."""
    import pyvista

    kinds = mesh.celltypes if isinstance(mesh, pyvista.UnstructuredGrid) else np.zeros(min(mesh.n_cells, 1))
    return any(mesh.get_cell(int(one)).dimension == 3 for one in np.unique(kinds, return_index=True)[1])


def _mended(mesh: Any, values: np.ndarray, association: str) -> tuple[Any, np.ndarray]:
    """The mesh as its results need it, cells in an order of their own, and the values in that order.

    Two habits of solvers would spoil VTK's interpolation: quadratic cells declared as linear ones with nodes to spare,
    and results on the corner nodes only, NaN between them. The former get their true type, the latter are taken as
    linear.
    """
    import pyvista

    if not isinstance(mesh, pyvista.UnstructuredGrid) or not mesh.n_cells:
        return mesh, values
    quadratic = {kin: linear for linear, (_, kin, _) in _KIN.items()}
    starts = np.array(pyvista.convert_array(mesh.GetCells().GetOffsetsArray()))
    counts = np.diff(starts)
    kinds = np.stack([mesh.celltypes.astype(int), counts], axis=1)
    groups: dict[int, list[np.ndarray]] = {}
    order, changed = [], False
    for kind, count in np.unique(kinds, axis=0):
        linear = quadratic.get(int(kind), int(kind))
        if linear not in _KIN or count not in (_KIN[linear][0], _KIN[linear][2]):
            return mesh, values  # other cells: left to VTK
        corners, kin, full = _KIN[linear]
        cells = np.flatnonzero((kinds == (kind, count)).all(axis=1))
        nodes = mesh.cell_connectivity[starts[cells][:, None] + np.arange(count)]
        if count == corners:
            lost = np.ones(len(cells), bool)
        else:
            lost = np.zeros(len(cells), bool)
            if association == "point":
                empty = ~np.isfinite(values[nodes])
                lost = empty[:, corners:].any(axis=1) & ~empty[:, :corners].any(axis=1)
            changed |= kind != kin or bool(lost.any())
        for part, name, width in ((cells[lost], linear, corners), (cells[~lost], kin, full)):
            if len(part):
                groups.setdefault(name, []).append(nodes[np.isin(cells, part)][:, :width])
                order.append((name, part))
    if not changed:
        return mesh, values
    mended = pyvista.UnstructuredGrid({k: np.concatenate(v) for k, v in groups.items()}, np.array(mesh.points))
    if association == "cell":
        # The grid holds its cells type by type, in the order of `groups`.
        values = values[np.concatenate([part for name in groups for n, part in order if n == name])]
    return mended, values


def _probe(mesh: Any, values: np.ndarray, association: str) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """A function of (n, 3) points in the mesh's unit: values, and which points lie in the mesh."""
    import pyvista

    bare = mesh.copy(deep=False)
    bare.clear_data()
    (bare.point_data if association == "point" else bare.cell_data)["value"] = values

    def at(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found: Any = pyvista.PolyData(points).sample(bare)
        return np.array(found.point_data["value"], float), np.asarray(found.point_data["vtkValidPointMask"]).astype(
            bool
        )

    return at


def _refuse_nan(found: np.ndarray, inside: np.ndarray, points: np.ndarray, nan: float | str | None) -> None:
    bad = inside & ~np.isfinite(found)
    if nan is None and bad.any():
        place = ", ".join(f"{v:.6g}" for v in points[np.argmax(bad)])
        raise ArgumentError(
            f"data: the result is NaN or infinite at {int(bad.sum()):,} of {int(inside.sum()):,} places in the mesh, "
            f'the first at ({place}) mm; give nan="nearest" or a number to put in their place'
        )


def _closest_on(mesh: Any, points: np.ndarray) -> np.ndarray:
    """The nearest point of the mesh to each point, a hair inside, where a probe finds it."""
    cells, near = mesh.find_closest_cell(points, return_closest_point=True)
    return near + 1e-5 * (mesh.cell_centers().points[cells] - near)


def _at_points(mesh: Any, probe: Callable, points: np.ndarray, nan: float | str | None) -> np.ndarray:
    found, inside = probe(points)
    if not inside.all():
        found[~inside], inside[~inside] = probe(_closest_on(mesh, points[~inside]))
    bad = ~(inside & np.isfinite(found))
    if bad.any() and nan is not None and nan != "nearest":
        found[bad] = nan
    elif bad.any():
        held = np.array(mesh.points, float)
        near, there = probe(held)
        there &= np.isfinite(near)
        from scipy.spatial import KDTree

        found[bad] = near[there][KDTree(held[there]).query(points[bad])[1]]
    return found


def _fill_rim(
    mesh: Any,
    probe: Callable,
    nodes: np.ndarray,
    found: np.ndarray,
    known: np.ndarray,
    inside: np.ndarray,
    shape: tuple[int, int, int],
) -> None:
    """Give nodes just outside the mesh, which points beside its surface read, the value of the closest point on it."""
    from scipy.ndimage import binary_dilation

    grown = binary_dilation(inside.reshape(shape), np.ones((3, 3, 3))).reshape(-1)
    rim = np.flatnonzero(grown & ~inside)
    if 0 < len(rim) <= _CLOSEST:
        near, there = probe(_closest_on(mesh, nodes[rim]))
        there &= np.isfinite(near)
        found[rim[there]] = near[there]
        known[rim[there]] = True
