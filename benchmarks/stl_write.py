"""Binary STL: ours, a plain write of the same bytes, and pyvista's writer, on about 8 M triangles (391 MB).

    python benchmarks/stl_write.py [folder]

Prints the median of 5 for each and the ratios. The claim: at least 80 % of the speed of the plain write.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from frep.mesh import Mesh

RUNS = 5
SIDE = 2024  # 2 x 2024^2 = 8.19 M triangles


def wavy_sheet(side: int) -> Mesh:
    """A closed-form surface with `2 side^2` triangles, numbered row by row as marching cubes would."""
    u, v = np.meshgrid(np.linspace(0, 50, side + 1), np.linspace(0, 50, side + 1), indexing="ij")
    vertices = np.stack([u, v, np.sin(u) * np.cos(v)], axis=-1).reshape(-1, 3)
    n = np.arange(side * (side + 1), dtype=np.int32).reshape(side, side + 1)[:, :-1]
    quads = np.stack([n, n + side + 1, n + side + 2, n + 1], axis=-1).reshape(-1, 4)
    return Mesh(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3))


def main() -> None:
    import pyvista as pv

    mesh = wavy_sheet(SIDE)
    surface = mesh.to_pyvista()
    wavy_sheet(8).save(Path(tempfile.mkdtemp()) / "warm.stl")  # compile or load the kernel
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else None) as folder:
        ours, plain, theirs = (Path(folder) / name for name in ("ours.stl", "plain.stl", "pyvista.stl"))
        mesh.save(ours)
        data = ours.read_bytes()

        def write_plain() -> None:
            with plain.open("wb", buffering=0) as file:
                file.write(data)

        works = {
            "plain": (plain, write_plain),
            "ours": (ours, lambda: mesh.save(ours)),
            "pyvista": (theirs, lambda: surface.save(str(theirs), binary=True)),
        }
        times: dict[str, list[float]] = {f"{name}{end}": [] for end in ("", ", synced") for name in works}
        # Interleaved, each to a fresh name, so that a slow minute of the machine meets all three; once into the
        # system's memory, once until the disk has it.
        for _ in range(RUNS):
            for name, (path, work) in works.items():
                path.unlink(missing_ok=True)
                start = time.perf_counter()
                work()
                times[name].append(time.perf_counter() - start)
                with path.open("rb+") as file:
                    os.fsync(file.fileno())
                times[f"{name}, synced"].append(time.perf_counter() - start)
        assert ours.stat().st_size == len(data) == 84 + 50 * mesh.n_faces
        assert pv.read(str(ours)).n_cells == mesh.n_faces

    median = {name: statistics.median(values) for name, values in times.items()}
    print(f"{mesh.n_faces:,} triangles, {len(data) / 1e6:.0f} MB, median of {RUNS}")
    for name, value in median.items():
        spread = f"{min(times[name]):.3f} to {max(times[name]):.3f}"
        print(f"{name:<16} {value:6.3f} s  {len(data) / 1e6 / value:6.0f} MB/s  ({spread} s)")
    print(f"ours / plain write:  {median['plain'] / median['ours']:.2f} of its speed into memory")
    print(f"                     {median['plain, synced'] / median['ours, synced']:.2f} of its speed onto the disk")
    print(f"ours / pyvista:      {median['pyvista'] / median['ours']:.1f} x its speed")


if __name__ == "__main__":
    main()
