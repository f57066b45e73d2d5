"""Wavefront OBJ: text, for programs that read nothing better."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from frep.errors import EmptyError
from frep.io.atomic import replacing

if TYPE_CHECKING:
    from frep.mesh import Mesh

_CHUNK = 65_536


def write_obj(path: str | os.PathLike[str], mesh: Mesh) -> None:
    """Write an OBJ file, whole or not at all.

    Coordinates carry as many digits as give the same float64 again. Vertices are numbered from 1, as the format has it.

    Args:
        path: file name.
        mesh: triangles, mm.

    Raises:
        EmptyError: the mesh has no face.
        FileError: the file cannot be written.
    """
    if not mesh.n_faces:
        raise EmptyError("mesh: it has no faces; there is nothing to save")
    with replacing(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as file:
        file.write("# written by frep, mm\n")
        # One format operation a chunk: 0.4 us a number, several times faster than one a line.
        for begin in range(0, len(mesh.vertices), _CHUNK):
            chunk = mesh.vertices[begin : begin + _CHUNK]
            file.write("v %r %r %r\n" * len(chunk) % tuple(chunk.ravel().tolist()))
        for begin in range(0, mesh.n_faces, _CHUNK):
            chunk = mesh.faces[begin : begin + _CHUNK]
            file.write("f %d %d %d\n" * len(chunk) % tuple((chunk.ravel() + 1).tolist()))
