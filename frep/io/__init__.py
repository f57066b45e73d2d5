"""Files in and out, one module a format.

| suffix | writes | reads |
|---|---|---|
| `.stl` | `stl.write_stl` (binary) | `read.read_mesh` |
| `.ply` | `ply.write_ply` (binary) | `read.read_mesh` |
| `.obj` | `obj.write_obj` | `read.read_mesh` |
| `.step` `.stp` | `step.write_beams_step`, `step.write_cell_pattern_step`, `step.write_faceted_step` | - |
| `.vdb` | `vdb.write_vdb` | `vdb.read_vdb` |
| `.vtp` `.vtk` `.vtu` `.off` `.gltf` `.glb` ... | - | `read.read_mesh` |

Every writer goes through `atomic.replacing`: a file is whole or it is the old one.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from frep.errors import ArgumentTypeError, FileError

if TYPE_CHECKING:
    from frep.mesh import Mesh

MESH_SUFFIXES = (".stl", ".ply", ".obj")
"""Suffixes that `save_mesh` writes."""


def suffix_of(path: str | os.PathLike[str]) -> str:
    """The suffix of a file name in small letters, with its dot.

    Raises:
        ArgumentTypeError: `path` is no file name.
    """
    if not isinstance(path, str | os.PathLike):
        raise ArgumentTypeError(f"path: expected a file name, got {type(path).__name__}: {path!r}")
    return Path(path).suffix.lower()


def save_mesh(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a triangle mesh in the format that the suffix of `path` names.

    Args:
        mesh: the triangles, mm.
        path: a file name that ends in one of `MESH_SUFFIXES`, in capitals or not.

    Raises:
        FileError: unknown suffix, missing folder, no permission, no space; the old file is intact.
        EmptyError: the mesh has no triangle.
    """
    suffix = suffix_of(path)
    if suffix == ".stl":
        from frep.io.stl import write_stl as write
    elif suffix == ".ply":
        from frep.io.ply import write_ply as write
    elif suffix == ".obj":
        from frep.io.obj import write_obj as write
    else:
        raise FileError(
            f"path: {os.fspath(path)!r} has {f'the unknown suffix {suffix!r}' if suffix else 'no suffix'}; "
            f"a mesh is saved as one of {', '.join(MESH_SUFFIXES)} (a Solid also as .step or .vdb)"
        )
    write(path, mesh)
