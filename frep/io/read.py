"""Any triangle mesh file becomes a `Mesh`, or an error that says what is wrong with it.

VTK reads the formats; it answers a damaged file with a warning on the terminal and half a mesh. Here the warning
becomes the error, and what a header promises is compared with what the file holds.
"""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from frep.errors import FileError, FrepError
from frep.io import suffix_of
from frep.mesh import Mesh

READABLE_SUFFIXES = (".stl", ".ply", ".obj", ".off", ".vtk", ".vtp", ".vtu", ".gltf", ".glb")
"""Suffixes that `read_mesh` takes."""


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Read the surface in a mesh file as triangles.

    Polygons are split; of volume cells the outer skin is taken; lines and loose points are dropped. Coordinates are
    used as they are, whatever unit the file was made in. STL shares no vertices, so those at exactly one place become
    one, and triangles that collapse by it are dropped; glTF likewise. ASCII PLY coordinates are rounded to float32 by
    the reader.

    Args:
        path: a file that ends in one of `READABLE_SUFFIXES`, in capitals or not.

    Raises:
        FileError: missing, unreadable, empty or truncated file, unknown suffix, or one that holds no surface (text, an
            image, a point cloud).
    """
    suffix = suffix_of(path)
    file = Path(path)
    name = os.fspath(path)
    if file.is_dir():
        raise FileError(f"path: {name!r} is a folder; give a mesh file")
    if not file.exists():
        raise FileError(f"path: there is no file {name!r}")
    if suffix in (".step", ".stp", ".iges", ".igs", ".brep"):
        raise FileError(
            f"path: {name!r} is a CAD file, and meshes are read here; make triangles of it first, with cadquery: "
            "exporters.export(importers.importStep('part.step'), 'part.stl', tolerance=0.05)"
        )
    if suffix not in READABLE_SUFFIXES:
        raise FileError(f"path: {name!r} is not a mesh file by its suffix; known are {', '.join(READABLE_SUFFIXES)}")
    try:
        size = file.stat().st_size
        with file.open("rb") as stream:
            head = stream.read(65_536)
    except OSError as error:
        raise FileError(f"path: cannot read {name!r}: {error.strerror or error}") from error
    if not size:
        raise FileError(f"path: {name!r} is empty (0 bytes)")
    try:
        if suffix == ".stl":
            mesh = _read_stl(file, head, size)
        elif suffix == ".ply":
            mesh = _read_ply(file, head, size)
        elif suffix == ".obj":
            mesh = _read_obj(file)
        elif suffix == ".off":
            mesh = _read_off(file)
        else:
            mesh = _surface(_read_with_vtk(file, suffix), merge=suffix in (".gltf", ".glb"))
    except _Damaged as damage:
        raise FileError(f"path: cannot read {name!r} as a mesh: {damage}") from damage.__cause__
    if not mesh.n_faces:
        raise FileError(f"path: {name!r} holds no triangle ({len(mesh.vertices):,} points)")
    return mesh


class _Damaged(Exception):
    """What is wrong with the file, in words that finish the sentence 'cannot read it as a mesh: ...'."""


def _read_with_vtk(file: Path, suffix: str) -> Any:
    """The data set in the file. VTK's complaints become an error and stay off the terminal."""
    import pyvista as pv

    reader = _vtk_reader(suffix)
    reader.SetFileName(str(file))
    # The catcher collects what VTK would print, the verbosity silences its second channel.
    with pv.VtkErrorCatcher(send_to_logging=False) as catcher, pv.vtk_verbosity("off"):
        reader.Update()
    for event in catcher.events:
        # Other warnings are harmless (an unknown keyword, a missing texture).
        if event.kind.upper() == "ERROR" or "rror reading" in event.alert:
            raise _Damaged(" ".join(event.alert.split())[:200])
    output = reader.GetOutputDataObject(0)
    if output is None:
        raise _Damaged("the reader made nothing of it; the file is damaged, or of another kind than its suffix says")
    return pv.wrap(output)


def _vtk_reader(suffix: str) -> Any:
    if suffix == ".stl":
        from vtkmodules.vtkIOGeometry import vtkSTLReader as Reader
    elif suffix == ".ply":
        from vtkmodules.vtkIOPLY import vtkPLYReader as Reader
    elif suffix == ".vtk":
        from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader as Reader
    elif suffix == ".vtp":
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader as Reader
    elif suffix == ".vtu":
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader as Reader
    else:
        from vtkmodules.vtkIOGeometry import vtkGLTFReader as Reader
    return Reader()


def _surface(dataset: Any, *, merge: bool = False) -> Mesh:
    """The triangles of a data set; `merge` joins points at one place (formats that split vertices at every crease)."""
    import pyvista as pv

    if isinstance(dataset, (pv.ImageData, pv.RectilinearGrid)):
        raise _Damaged(
            f"it holds {type(dataset).__name__} (an image of {tuple(dataset.dimensions)} samples), no surface"
        )
    if isinstance(dataset, pv.MultiBlock):
        dataset = dataset.combine()
    if not isinstance(dataset, pv.DataSet):
        raise _Damaged(f"it holds {type(dataset).__name__}, no surface")
    if merge and dataset.n_points:
        dataset = dataset.extract_surface(algorithm="dataset_surface").clean(tolerance=0.0, point_merging=True)
    if not dataset.n_points:
        raise _Damaged("it holds no points; the file is damaged, or of another kind than its suffix says")
    try:
        mesh = Mesh.from_pyvista(dataset)
    except FrepError as error:
        raise _Damaged(str(error)) from error
    if not mesh.n_faces:
        raise _Damaged(f"it is a point cloud or line drawing: {dataset.n_points:,} points and no faces")
    return mesh


def _read_stl(file: Path, head: bytes, size: int) -> Mesh:
    count = int.from_bytes(head[80:84], "little")
    binary = size == 84 + 50 * count
    if not binary:
        if not (head.lstrip()[:5].lower() == b"solid" and b"facet" in head.lower()):
            raise _Damaged(
                f"a binary STL file of {count:,} triangles has {84 + 50 * count:,} bytes, this one has {size:,}; "
                "it is truncated, or no STL file"
            )
        with file.open("rb") as stream:
            stream.seek(max(0, size - 4096))
            if b"endsolid" not in stream.read().lower():
                raise _Damaged("the text ends without 'endsolid'; it is truncated")
    return _surface(_read_with_vtk(file, ".stl"))


_PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


def _read_ply(file: Path, head: bytes, size: int) -> Mesh:
    """Triangles in binary directly, which keeps float64 (VTK rounds to float32); everything else through VTK."""
    order, elements, start = _ply_header(head)
    counts = {name: count for name, count, _ in elements}
    n_points, n_faces = counts.get("vertex", 0), counts.get("face", 0)
    if n_points and not n_faces:
        raise _Damaged(f"it is a point cloud: {n_points:,} points and no faces")
    if order != "ascii":
        mesh = _read_ply_triangles(file, order, elements, start, size)
        if mesh is not None:
            return mesh
        _walk_ply(file, order, elements, start)
    dataset = _read_with_vtk(file, ".ply")
    if dataset.n_points != n_points or dataset.n_cells != n_faces:
        raise _Damaged(
            f"its header promises {n_points:,} points and {n_faces:,} faces, it holds {dataset.n_points:,} and "
            f"{dataset.n_cells:,}; it is truncated"
        )
    if np.any(np.diff(dataset.GetPolys().GetOffsetsArray()) < 3):
        raise _Damaged("it has faces of fewer than three corners; it is truncated, or damaged")
    return _surface(dataset)


def _ply_header(head: bytes) -> tuple[str, list[tuple[str, int, list[list[str]]]], int]:
    """The number format ('ascii', '<' or '>'), the elements (name, count, properties), and where the data start."""
    end = head.find(b"end_header")
    if not head.startswith(b"ply") or end < 0 or b"\n" not in head[end:]:
        raise _Damaged("it has no PLY header; it is truncated, or no PLY file")
    order = ""
    elements: list[tuple[str, int, list[list[str]]]] = []
    try:
        for line in head[:end].decode("ascii", "replace").splitlines():
            words = line.split()
            if words[:1] == ["format"]:
                order = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                elements[-1][2].append(words[1:])
    except (KeyError, IndexError, ValueError) as error:
        raise _Damaged("its PLY header makes no sense") from error
    if not order:
        raise _Damaged("its PLY header names no format")
    return order, elements, head.index(b"\n", end) + 1


def _read_ply_triangles(file: Path, order: str, elements, start: int, size: int) -> Mesh | None:
    """Vertices of fixed size, then faces that are three numbers each and nothing more; None when it is otherwise."""
    if [name for name, _, _ in elements[:2]] != ["vertex", "face"]:
        return None
    (_, n_points, columns), (_, n_faces, lists) = elements[0], elements[1]
    if any(len(words) != 2 or words[0] not in _PLY_TYPES for words in columns):
        return None
    if len(lists) != 1 or lists[0][0] != "list" or any(kind not in _PLY_TYPES for kind in lists[0][1:3]):
        return None
    point = np.dtype([(name, order + _PLY_TYPES[kind]) for kind, name in columns])
    face = np.dtype([("count", order + _PLY_TYPES[lists[0][1]]), ("corners", order + _PLY_TYPES[lists[0][2]], 3)])
    need = start + n_points * point.itemsize + n_faces * face.itemsize
    with file.open("rb") as stream:
        stream.seek(start)
        points = np.fromfile(stream, point, n_points)
        faces = np.fromfile(stream, face, n_faces)
    if len(points) < n_points or (len(faces) < n_faces and (faces["count"] == 3).all()):
        raise _Damaged(f"its header promises {need:,} bytes, it has {size:,}; it is truncated")
    if not (faces["count"] == 3).all() or not {"x", "y", "z"} <= set(point.names or ()):
        return None
    try:
        return Mesh(np.stack([points[axis].astype(np.float64) for axis in "xyz"], axis=1), faces["corners"])
    except FrepError as error:
        raise _Damaged(str(error)) from error


def _walk_ply(file: Path, order: str, elements, start: int) -> None:
    """Step over every row of a binary file with lists of any length: VTK crashes where such a file ends early."""
    data = file.read_bytes()
    at = start
    for name, count, properties in elements:
        fixed = [_PLY_TYPES.get(words[0]) for words in properties if words[0] != "list"]
        if None in fixed:
            raise _Damaged(f"its PLY header gives {name!r} a property of unknown type")
        if len(fixed) == len(properties):
            at += count * sum(np.dtype(kind).itemsize for kind in fixed if kind)
            continue
        for _ in range(count):
            for words in properties:
                if words[0] != "list":
                    at += np.dtype(_PLY_TYPES[words[0]]).itemsize
                    continue
                width = np.dtype(_PLY_TYPES[words[1]]).itemsize
                length = int.from_bytes(data[at : at + width], "little" if order == "<" else "big")
                at += width + length * np.dtype(_PLY_TYPES[words[2]]).itemsize
            if at > len(data):
                break
    if at > len(data):
        raise _Damaged(f"its header promises more than the {len(data):,} bytes it has; it is truncated")


def _read_obj(file: Path) -> Mesh:
    """The vertices as the file shares them (VTK splits them at every texture seam and crease); polygons split as
    fans."""
    points: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    number = 0
    try:
        with file.open(encoding="utf-8", errors="replace") as lines:
            for line in lines:
                number += 1
                if line.startswith("v "):
                    x, y, z = line.split()[1:4]
                    points.append((float(x), float(y), float(z)))
                elif line.startswith("f "):
                    # "7", "7/1", "7//3": the vertex comes first; counted from 1, or back from the latest as -1.
                    numbers = [int(word.split("/")[0]) for word in line.split()[1:]]
                    corners = [n - 1 if n > 0 else len(points) + n for n in numbers]
                    if len(corners) < 3 or 0 in numbers:
                        raise ValueError("a face needs three vertices, numbered from 1")
                    faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
    except ValueError as error:
        raise _Damaged(f"line {number} makes no sense ({error})") from error
    if not points:
        raise _Damaged("it holds no points; the file is damaged, or of another kind than its suffix says")
    if not faces:
        raise _Damaged(f"it is a point cloud or line drawing: {len(points):,} points and no faces")
    try:
        return Mesh(np.array(points), np.array(faces, np.int64))
    except FrepError as error:
        raise _Damaged(str(error)) from error


def _read_off(file: Path) -> Mesh:
    """The Geomview text format, which VTK does not read: 'OFF', counts, points, then polygons (split as fans)."""
    try:
        words = " ".join(line.split("#")[0] for line in file.read_text("ascii").splitlines()).split()
        if words[0] != "OFF":
            raise ValueError
        n_points, n_faces = int(words[1]), int(words[2])
        points = np.array(words[4 : 4 + 3 * n_points], np.float64).reshape(n_points, 3)
        faces: list[tuple[int, int, int]] = []
        at = 4 + 3 * n_points
        for _ in range(n_faces):
            corners = [int(word) for word in words[at + 1 : at + 1 + int(words[at])]]
            if len(corners) != int(words[at]):
                raise ValueError
            faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
            at += 1 + len(corners)
        return Mesh(points, np.array(faces, np.int64).reshape(-1, 3))
    except (ValueError, IndexError, UnicodeDecodeError, FrepError) as error:
        raise _Damaged(f"it is no complete OFF file ({error or 'bad number'})") from error
