"""Binary STL, written at the speed of the disk.

The format: 80 bytes of header, the number of triangles as uint32, then 50 bytes a triangle: normal and three corners as
float32, two bytes unused; all little endian.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from frep.errors import ArgumentError, EmptyError, FileError
from frep.io.atomic import replacing
from frep.jit import kernel

if TYPE_CHECKING:
    from frep.mesh import Mesh

RECORD = np.dtype([(point + axis, "<f4") for point in "nabc" for axis in "xyz"] + [("unused", "<u2")])
"""One triangle of a binary STL file: normal, three corners, two bytes of nothing."""

HEADER_BYTES = 84

# 5,120 records are 256 kB: a chunk is still in cache when it is written.
_CHUNK = 5_120


def write_stl(path: str | os.PathLike[str], mesh: Mesh) -> None:
    """Write a binary STL file, whole or not at all.

    Coordinates become float32, as the format has it: about 7 digits. A part at x = 1e6 mm is rounded to 0.06 mm, so
    move it to the origin first, or save PLY or OBJ, which keep float64. The format shares no vertices between
    triangles.

    Args:
        path: file name.
        mesh: triangles, mm. Normals are those of the faces (zero for a face flat to a line).

    Raises:
        EmptyError: the mesh has no face.
        ArgumentError: a coordinate is beyond float32 (3.4e38).
        FileError: more than 4,294,967,295 triangles, or the file cannot be written.
    """
    if not mesh.n_faces:
        raise EmptyError("mesh: it has no faces; there is nothing to save")
    if mesh.n_faces >= 2**32:
        raise FileError(f"mesh: STL holds at most {2**32 - 1:,} triangles, this mesh has {mesh.n_faces:,}; save .ply")
    if mesh.reach > float(np.finfo(np.float32).max):
        raise ArgumentError("mesh: STL holds float32 coordinates, at most 3.4e38 mm; a vertex lies beyond")
    with replacing(path) as temporary:
        with temporary.open("r+b", buffering=0) as file:
            _write_all(file, _header(mesh.n_faces))
        _write_records(temporary, mesh)


def _header(n_faces: int) -> bytes:
    # Not "solid ...": with that word readers take the file for a text one.
    return b"binary STL by frep, mm".ljust(80) + n_faces.to_bytes(4, "little")


def _write_records(path: Path, mesh: Mesh) -> None:
    """Each worker fills one chunk in its own buffer and writes it in place, while the others fill theirs."""
    n_chunks = -(-mesh.n_faces // _CHUNK)
    n_workers = min(os.cpu_count() or 1, 4, n_chunks)
    stop = threading.Event()

    def work(first: int) -> None:
        buffer = np.zeros(_CHUNK, RECORD)
        with path.open("r+b", buffering=0) as file:
            for chunk in range(first, n_chunks, n_workers):
                if stop.is_set():
                    return
                begin = chunk * _CHUNK
                end = min(begin + _CHUNK, mesh.n_faces)
                _fill(mesh.vertices, mesh.faces, begin, end, buffer)
                file.seek(HEADER_BYTES + begin * RECORD.itemsize)
                _write_all(file, buffer[: end - begin].view(np.uint8))

    with ThreadPoolExecutor(n_workers) as pool:
        tasks = [pool.submit(work, first) for first in range(n_workers)]
        try:
            for task in tasks:
                task.result()
        finally:
            stop.set()  # after an error or Ctrl-C: don't wait for gigabytes that nobody will see


def _write_all(file, data) -> None:
    """A raw write may take a part only (a full disk, 2 GB at a time)."""
    view = memoryview(data)
    while len(view):
        view = view[file.write(view) :]


# 5 ns a triangle: nine float64 gathered, one square root, twelve stores of 4 bytes. Filling a small array and copying
# its bytes took three times as long (wide loads behind narrow stores wait).
@kernel
def _fill(vertices, faces, begin, end, out):
    """Fill `out` with the records of the faces `begin` to `end`; `unused` stays as it is."""
    for f in range(begin, end):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        bx, by, bz = vertices[b, 0], vertices[b, 1], vertices[b, 2]
        cx, cy, cz = vertices[c, 0], vertices[c, 1], vertices[c, 2]
        ux, uy, uz = bx - ax, by - ay, bz - az
        vx, vy, vz = cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        scale = 1.0 / length if length > 0.0 else 0.0
        record = out[f - begin]
        record.nx, record.ny, record.nz = nx * scale, ny * scale, nz * scale
        record.ax, record.ay, record.az = ax, ay, az
        record.bx, record.by, record.bz = bx, by, bz
        record.cx, record.cy, record.cz = cx, cy, cz
