"""Binary PLY: shared vertices and float64 coordinates, nothing lost."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from frep.errors import EmptyError, FileError
from frep.io.atomic import replacing

if TYPE_CHECKING:
    from frep.mesh import Mesh

FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
"""One triangle of the files written here."""

_CHUNK = 65_536


def write_ply(path: str | os.PathLike[str], mesh: Mesh) -> None:
    """Write a binary little-endian PLY file (double coordinates, int32 triangles), whole or not at all.

    Args:
        path: file name.
        mesh: triangles, mm.

    Raises:
        EmptyError: the mesh has no face.
        FileError: 2**31 vertices or more, or the file cannot be written.
    """
    if not mesh.n_faces:
        raise EmptyError("mesh: it has no faces; there is nothing to save")
    if len(mesh.vertices) >= 2**31:
        raise FileError(f"mesh: PLY numbers at most 2,147,483,647 vertices, this mesh has {len(mesh.vertices):,}")
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment written by frep, mm\n"
        f"element vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {mesh.n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    records = np.zeros(_CHUNK, FACE)
    records["count"] = 3
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(header.encode("ascii"))
        for begin in range(0, len(mesh.vertices), _CHUNK):
            file.write(mesh.vertices[begin : begin + _CHUNK].astype("<f8", copy=False))
        for begin in range(0, mesh.n_faces, _CHUNK):
            chunk = mesh.faces[begin : begin + _CHUNK]
            records["corners"][: len(chunk)] = chunk
            file.write(records[: len(chunk)].view(np.uint8))
