"""`Mesh`: triangles with shared vertices, the last form of a part before a file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from frep.errors import ArgumentError, ArgumentTypeError, EmptyError

if TYPE_CHECKING:
    import pyvista

    from frep.check import MeshReport


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A triangle mesh in mm, counter-clockwise seen from outside.

    Arrays of the right type are taken over without a copy, behind a read-only view.

    Attributes:
        vertices: (n, 3) float64, finite.
        faces: (m, 3) vertex numbers, int32 (int64 only beyond 2**31 vertices).

    Raises:
        ArgumentError: wrong shape, a coordinate that is not finite, a vertex number out of range.
        ArgumentTypeError: `faces` are not integers, or `vertices` not numbers.
    """

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.integer[Any]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", _checked_vertices(self.vertices))
        object.__setattr__(self, "faces", _checked_faces(self.faces, len(self.vertices)))

    @classmethod
    def _made(cls, vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int32]) -> Mesh:
        """A mesh from arrays that are known to be right, without looking through them."""
        mesh = object.__new__(cls)
        vertices.setflags(write=False)
        faces.setflags(write=False)
        object.__setattr__(mesh, "vertices", vertices)
        object.__setattr__(mesh, "faces", faces)
        return mesh

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Mesh:
        """The triangles of any mesh file, as they are; `frep.load` makes a solid of them.

        Raises:
            FileError: as `frep.load`.
        """
        from frep.io.read import read_mesh

        return read_mesh(path)

    def scale(self, factor: float) -> Mesh:
        """The mesh magnified by `factor` > 0 about the origin.

        Raises:
            ArgumentError: `factor` is not a finite number above zero.
        """
        from frep.arguments import positive

        return Mesh(self.vertices * positive(factor, "factor", ""), self.faces)

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices):,} vertices, {self.n_faces:,} faces)"

    def __reduce__(self) -> tuple[Any, ...]:
        return (Mesh, (np.asarray(self.vertices), np.asarray(self.faces)))

    @property
    def n_faces(self) -> int:
        """The number of triangles."""
        return len(self.faces)

    @cached_property
    def reach(self) -> float:
        """The largest magnitude of any coordinate, mm; what it is next to `voxel` decides whether float32 will do."""
        return float(max(self.vertices.max(), -self.vertices.min())) if len(self.vertices) else 0.0

    @property
    def volume(self) -> float:
        """Enclosed volume in mm3 by the divergence theorem: positive when the faces look outward.

        Meaningful for a closed mesh; an open one is closed, as it were, by the cone from its holes to the centre of
        its box.
        """
        return self._volume_and_area[0]

    @property
    def area(self) -> float:
        """Surface area in mm2."""
        return self._volume_and_area[1]

    @cached_property
    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3): the lower and the upper corner of the box round the faces, mm. Unused vertices don't count.

        Raises:
            EmptyError: the mesh has no face.
        """
        if not self.n_faces:
            raise EmptyError("mesh: it has no faces, therefore no bounds")
        from frep.triangles import bounds_of_faces

        return _read_only(bounds_of_faces(self.vertices, self.faces))

    @cached_property
    def _volume_and_area(self) -> tuple[float, float]:
        from frep.triangles import volume_and_area

        if not self.n_faces:
            return 0.0, 0.0
        # About the centre of the box: far from the origin the terms would cancel only to their rounding.
        volume, area = volume_and_area(self.vertices, self.faces, self.bounds.mean(axis=0))
        return float(volume), float(area)

    def check(self) -> MeshReport:
        """Report holes, non-manifold edges and vertices, orientation, pieces, genus and bad faces (see
        `MeshReport`)."""
        from frep.check import check

        return check(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mesh in the format of the suffix: `.stl` and `.ply` (both binary) or `.obj`.

        The file is whole or it is the old one, whatever happens while writing.

        Raises:
            FileError: unknown suffix, missing folder, no permission, no space.
            EmptyError: the mesh has no face.
        """
        from frep.io import save_mesh

        save_mesh(self, path)

    @classmethod
    def from_pyvista(cls, dataset: Any) -> Mesh:
        """The surface of any pyvista data set as triangles; polygons and cells are split, lines and points dropped.

        Args:
            dataset: a `pyvista.PolyData`, or a grid or blocks of which the outer surface is taken. Coordinates in mm.

        Raises:
            ArgumentTypeError: not a pyvista data set.
        """
        import pyvista as pv

        if isinstance(dataset, pv.MultiBlock):
            dataset = dataset.combine()
        if not isinstance(dataset, pv.DataSet):
            raise ArgumentTypeError(f"dataset: expected a pyvista data set, got {type(dataset).__name__}")
        surface = dataset if isinstance(dataset, pv.PolyData) else dataset.extract_surface(algorithm="dataset_surface")
        if surface.n_strips or not surface.is_all_triangles:
            surface = surface.triangulate()
        if not surface.n_cells or not surface.n_points:
            return cls(np.empty((0, 3)), np.empty((0, 3), np.int32))
        return cls(np.array(surface.points, np.float64), np.array(surface.regular_faces, np.int32))

    def to_pyvista(self) -> pyvista.PolyData:
        """A copy of the mesh as `pyvista.PolyData`, for viewing and for VTK's filters."""
        import pyvista as pv

        return pv.PolyData.from_regular_faces(np.array(self.vertices), np.array(self.faces))


def _checked_vertices(vertices: Any) -> npt.NDArray[np.float64]:
    try:
        array = np.ascontiguousarray(vertices, np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentTypeError(f"vertices: expected (n, 3) numbers, got {type(vertices).__name__}") from error
    if np.ndim(vertices) != 2 or array.shape[1] != 3:
        raise ArgumentError(f"vertices: expected the shape (n, 3), got {np.shape(vertices)}")
    # Minimum and maximum pass NaN on and, unlike isfinite, make no array.
    if array.size and not (np.isfinite(array.min()) and np.isfinite(array.max())):
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise ArgumentError(f"vertices: every coordinate must be finite; vertex {row} is {array[row].tolist()}")
    return _read_only(array)


def _checked_faces(faces: Any, n_vertices: int) -> npt.NDArray[np.integer[Any]]:
    array = np.asarray(faces)
    if array.dtype.kind not in "iu":
        raise ArgumentTypeError(f"faces: expected (m, 3) integers, got {array.dtype} values")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ArgumentError(f"faces: expected the shape (m, 3), got {array.shape}")
    if array.size and (array.min() < 0 or array.max() >= n_vertices):
        bad = int(array.min() if array.min() < 0 else array.max())
        raise ArgumentError(f"faces: vertex numbers must be 0 to {n_vertices - 1}; found {bad}")
    # One integer type: kernels over faces compile once, and int32 halves their traffic.
    return _read_only(np.ascontiguousarray(array, np.int32 if n_vertices <= 2**31 else np.int64))


def _read_only(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view
