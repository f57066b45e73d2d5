"""frep against every peer that installs: script to triangle mesh, one process a run, each through its own natural API.

A: gyroid sheet `abs(F) - 0.5`; B: BCC, radius 0.4 mm; Bs: B, blended by 0.4 mm; CA: level linear along z, 0.3 to 0.7;
CB: radius linear along z, 0.3 to 0.5 mm. All 10^3 cells of 5 mm in a 50 mm cube, at about 0.25 mm. Each process first makes
one cell, which loads what is loaded on first use (`first`); the seconds are of the whole part after that. Volumes are of the
meshes, by the divergence theorem; the true ones are frep's by field at 0.1 mm (Bs has none: every system blends its way).

Each peer gets a virtual environment of its own under ~/.cache/frep-peers (or $XDG_CACHE_HOME), made when first needed; one
that does not install, fails or takes too long is listed with the reason, as are those that are not asked. A whole run takes
some six minutes, nearly all of it the peers'.

    python benchmarks/peers.py [--cells 10] [--runs 5] [--peer-runs 1] [--only microgen]
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from _timing import child, options, peak_bytes, print_ratio, report, setting, table

PARTS = ("A", "B", "Bs", "CA", "CB")
CELL, VOXEL = 5.0, 0.25
RADIUS, BLEND, LEVEL = 0.4, 0.4, 0.5
GRADED_RADIUS, GRADED_LEVEL = (0.3, 0.5), (0.3, 0.7)

DIAGONALS = ((1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1))


@dataclass(frozen=True)
class Peer:
    """What pip installs, and which parts the peer can make."""

    requirements: tuple[str, ...]
    parts: tuple[str, ...]
    remark: str


PEERS = {
    "microgen": Peer(("microgen==2.0.0b1",), PARTS, "TPMS grid clipped by VTK; struts by its implicit capsules"),
    "sdfcad": Peer(("sdfcad==0.5.2",), PARTS, "its triangles are not indexed; graded by a function of z"),
    "manifold3d": Peer(("manifold3d==3.5.4", "numpy>=2"), ("A", "B", "CA"), "level_set of a Python function; booleans"),
    "distforge": Peer(("distforge==1.0.0",), ("B", "Bs"), "no TPMS without a GPU"),
    "pyscaffolder": Peer(("PyScaffolder==1.5.4", "numpy>=2"), ("A",), "its double gyroid, cut by a box"),
}

NOT_ASKED = {
    "MeshLib 3.1": "non-commercial licence",
    "OpenVCAD 3.1": "non-commercial licence",
    "tpmslab 0.3": "makes one cell only",
}


# --- in the peer's process ------------------------------------------------------------------------------------------------


def make_frep(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import _designs as designs

    makers = {
        "A": designs.a,
        "B": designs.b,
        "Bs": lambda n: designs.b(n, BLEND),
        "CA": designs.a_graded,
        "CB": designs.b_graded,
    }

    def run() -> tuple[Any, Any]:
        mesh = makers[part](cells).mesh(voxel=VOXEL)
        return mesh.vertices, mesh.faces

    return run


def _linear(z: Any, half: float, ends: tuple[float, float]) -> Any:
    return ends[0] + (ends[1] - ends[0]) * (z + half) / (2 * half)


def make_microgen(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import microgen
    import numpy as np
    from microgen.shape import implicit_ops
    from scipy.spatial.transform import Rotation

    half = 0.5 * CELL * cells
    box = (-half, half) * 3

    def sheet(offset: Any) -> Any:
        surface = microgen.Tpms(
            microgen.surface_functions.gyroid,
            offset=offset,
            cell_size=CELL,
            repeat_cell=cells,
            resolution=round(CELL / VOXEL),
        )
        return surface.generate_surface_mesh("sheet")

    def lattice(radius: float, blend: float) -> Any:
        struts = [
            microgen.Capsule(
                height=CELL * np.sqrt(3), radius=radius, orientation=Rotation.align_vectors([d], [[1, 0, 0]])[0]
            )
            for d in DIAGONALS
        ]
        return implicit_ops.repeat(implicit_ops.batch_smooth_union(struts, blend), (CELL,) * 3)

    def run() -> tuple[Any, Any]:
        if part in ("A", "CA"):
            # The offset is of both sides together.
            graded = lambda x, y, z: 2 * _linear(z, half, GRADED_LEVEL)  # noqa: E731
            mesh = sheet(2 * LEVEL if part == "A" else graded)
        else:
            shape = lattice(RADIUS, BLEND if part == "Bs" else 0.0)
            if part == "CB":
                axis = lattice(0.0, 0.0).require_func()
                shape = implicit_ops.from_field(lambda x, y, z: axis(x, y, z) - _linear(z, half, GRADED_RADIUS))
            mesh = shape.generate_surface_mesh(bounds=box, resolution=round(2 * half / VOXEL) + 1)
        return mesh.points, mesh.faces.reshape(-1, 4)[:, 1:]

    return run


def make_sdfcad(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import numpy as np
    import sdf

    half = 0.5 * CELL * cells

    @sdf.sdf3
    def gyroid(ends: tuple[float, float]) -> Any:
        def f(p: Any) -> Any:
            x, y, z = (p * (2 * np.pi / CELL)).T
            level = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
            return np.abs(level) - _linear(p[:, 2], half, ends)

        return f

    def lattice(radius: float, blend: float) -> Any:
        struts = [sdf.capsule(-0.5 * CELL * np.array(d), 0.5 * CELL * np.array(d), radius) for d in DIAGONALS]
        return sdf.union(*struts, r=blend).repeat(CELL)

    @sdf.sdf3
    def thickened(axis: Any) -> Any:
        return lambda p: axis(p).reshape(-1) - _linear(p[:, 2], half, GRADED_RADIUS)

    def run() -> tuple[Any, Any]:
        if part in ("A", "CA"):
            shape = gyroid((LEVEL, LEVEL) if part == "A" else GRADED_LEVEL)
        elif part == "CB":
            shape = thickened(lattice(0.0, 0.0))
        else:
            shape = lattice(RADIUS, BLEND if part == "Bs" else 0.0)
        reach = half + VOXEL
        solid = shape & sdf.box(2 * half)
        # It leaves out the last sample of a range.
        bounds = ((-reach,) * 3, (reach + 0.5 * VOXEL,) * 3)
        points = solid.generate(step=VOXEL, bounds=bounds, verbose=False)
        return np.asarray(points), None

    return run


def make_manifold3d(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import math

    import manifold3d
    import numpy as np
    from manifold3d import Manifold

    half = 0.5 * CELL * cells

    def level_set(ends: tuple[float, float]) -> Any:
        k, sin, cos = 2 * math.pi / CELL, math.sin, math.cos

        def inside(x: float, y: float, z: float) -> float:
            level = _linear(z, half, ends)
            x, y, z = k * x, k * y, k * z
            return level - abs(sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x))

        return Manifold.level_set(inside, [-half] * 3 + [half] * 3, VOXEL)

    def booleans() -> Any:
        # A strut and its ends, placed everywhere; one union of all, as the library advises.
        length = CELL * math.sqrt(3)
        strut = Manifold.cylinder(length, RADIUS, circular_segments=16, center=True)
        tilt = math.degrees(math.acos(1 / math.sqrt(3)))
        cell = [strut.rotate([0, tilt, 45 + 90 * turn]) for turn in range(4)]
        places = (np.argwhere(np.ones((cells,) * 3)) + 0.5) * CELL - half
        struts = [s.translate(place.tolist()) for place in places for s in cell]
        return Manifold.batch_boolean(struts, manifold3d.OpType.Add) ^ Manifold.cube([2 * half] * 3, True)

    def run() -> tuple[Any, Any]:
        solid = booleans() if part == "B" else level_set((LEVEL, LEVEL) if part == "A" else GRADED_LEVEL)
        mesh = solid.to_mesh()
        return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)

    return run


def make_distforge(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import distforge
    import numpy as np
    from distforge.api.engine.mesh import generate

    half = 0.5 * CELL * cells

    def run() -> tuple[Any, Any]:
        struts = [
            distforge.line(tuple(-0.5 * CELL * np.array(d)), tuple(0.5 * CELL * np.array(d)), radius=RADIUS)
            for d in DIAGONALS
        ]
        lattice = struts[0].union(*struts[1:], blend=BLEND if part == "Bs" else 0.0).repeat((CELL,) * 3)
        reach = half + VOXEL
        shape = lattice & distforge.box((2 * half,) * 3)
        return generate(
            shape, ((-reach,) * 3, (reach + 0.5 * VOXEL,) * 3), voxel_size=VOXEL, verbose=False, backend="cpu"
        )

    return run


def make_pyscaffolder(part: str, cells: int) -> Callable[[], tuple[Any, Any]]:
    import numpy as np
    import PyScaffolder

    corners = np.argwhere(np.ones((2, 2, 2))) * CELL * cells
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)

    def run() -> tuple[Any, Any]:
        wanted = PyScaffolder.Parameter()
        wanted.surface_name = "double-gyroid"
        wanted.coff = 2 * np.pi / CELL
        wanted.isolevel = LEVEL
        wanted.grid_size = round(CELL * cells / VOXEL)
        wanted.is_intersect = True
        wanted.verbose = False
        made = PyScaffolder.generate_scaffold(corners.astype(float), box, wanted)
        return made.v, made.f

    return run


def mesh_volume(vertices: Any, faces: Any) -> float:
    """Enclosed volume, mm3, without its sign; `faces` None for triangles that are not indexed."""
    import numpy as np

    total = 0.0
    corners = np.asarray(vertices, float)
    count = len(corners) // 3 if faces is None else len(faces)
    for start in range(0, count, 1 << 20):
        if faces is None:
            a, b, c = corners[3 * start : 3 * (start + (1 << 20))].reshape(-1, 3, 3).transpose(1, 0, 2)
        else:
            a, b, c = (corners[np.asarray(faces[start : start + (1 << 20), i])] for i in range(3))
        total += float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6.0
    return abs(total)


def run_here(peer: str, part: str, cells: int) -> None:
    """In a process of its own, under the peer's interpreter."""
    make = globals()[f"make_{peer}"]
    start = time.perf_counter()
    make(part, 1)()
    loaded = time.perf_counter()
    vertices, faces = make(part, cells)()
    seconds = time.perf_counter() - loaded
    peak = peak_bytes()
    count = len(vertices) // 3 if faces is None else len(faces)
    report(seconds=seconds, first=loaded - start, peak=peak, triangles=count, volume=mesh_volume(vertices, faces))


# --- in this one ------------------------------------------------------------------------------------------------------------


def interpreter_of(name: str, peer: Peer) -> str:
    """The Python of the peer's virtual environment, which is made if it is not there.

    Raises:
        RuntimeError: it does not install.
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = cache / "frep-peers" / name
    python, stamp = folder / "bin" / "python", folder / "installed.txt"
    wanted = "\n".join(peer.requirements)
    if stamp.exists() and stamp.read_text() == wanted:
        return str(python)
    folder.parent.mkdir(parents=True, exist_ok=True)
    for command in (
        [sys.executable, "-m", "venv", str(folder)],
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *peer.requirements],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            errors = [line for line in done.stderr.splitlines() if "ERROR" in line] or done.stderr.splitlines()
            raise RuntimeError(f"does not install: {errors[-1] if errors else done.returncode}")
    stamp.write_text(wanted)
    return str(python)


def measure(python: str, peer: str, part: str, cells: int, runs: int, limit: float) -> dict[str, float]:
    """Medians over `runs` processes."""
    command = [python, sys.argv[0], "run", peer, part, str(cells)]
    all_runs = [child(command, limit=limit) for _ in range(runs)]
    return {key: statistics.median(run[key] for run in all_runs) for key in all_runs[0]}


def true_volumes(parts: Iterable[str], cells: int) -> dict[str, float]:
    """By field, mm3, of a few cells scaled up: the parts are periodic, or as good as, along x and y."""
    import _designs as designs

    made = {
        "A": designs.a,
        "B": designs.b,
        "Bs": lambda n: designs.b(n, BLEND),
        "CA": designs.a_graded,
        "CB": designs.b_graded,
    }
    return {part: made[part](cells).volume(voxel=0.1) for part in parts}


def main() -> None:
    if sys.argv[1:2] == ["run"]:
        run_here(sys.argv[2], sys.argv[3], int(sys.argv[4]))
        return
    given = options(
        __doc__,
        cells=(10, "unit cells along each edge of the cube"),
        peer_runs=(1, "runs of each peer"),
        only=("", "one peer instead of all"),
        limit=(600.0, "seconds a run of a peer may take"),
    )
    print(setting(given.runs, f"{given.cells}^3 cells, {VOXEL} mm, peers' runs: {given.peer_runs}, a process a run"))
    true = true_volumes(PARTS, given.cells)
    measure(sys.executable, "frep", "A", 1, 1, 600.0)  # compiles, if need be
    ours = {part: measure(sys.executable, "frep", part, given.cells, given.runs, 600.0) for part in PARTS}
    rows = [row_of("frep", part, ours[part], true[part]) for part in PARTS]
    left_out = [[name, "", reason] for name, reason in NOT_ASKED.items()]
    best: dict[str, tuple[float, str]] = {}
    for name, peer in PEERS.items():
        if given.only and name != given.only:
            continue
        try:
            python = interpreter_of(name, peer)
        except RuntimeError as error:
            left_out.append([name, "", str(error)])
            continue
        for part in peer.parts:
            try:
                found = measure(python, name, part, given.cells, given.peer_runs, given.limit)
            except RuntimeError as error:
                left_out.append([name, part, str(error)[:150]])
                continue
            rows.append(row_of(name, part, found, true[part]))
            best[part] = min(best.get(part, (float("inf"), "")), (found["seconds"], name))
    rows.sort(key=lambda row: (PARTS.index(row[1]), float(row[2])))
    table(["", "part", "seconds", "first", "peak MB", "triangles", "volume mm3", "error"], rows)
    for part, (seconds, name) in sorted(best.items(), key=lambda item: PARTS.index(item[0])):
        print_ratio(f"{part}: best peer ({name}) / frep", seconds / ours[part]["seconds"], ">= 10")
    print()
    table(["left out", "part", "reason"], left_out)
    for name, peer in PEERS.items():
        if not given.only or name == given.only:
            print(f"{name}: {', '.join(peer.requirements)}; {peer.remark}")


def row_of(name: str, part: str, found: dict[str, float], true: float) -> list[str]:
    """A line of the table."""
    return [
        name,
        part,
        f"{found['seconds']:.3f}",
        f"{found['first']:.2f}",
        f"{found['peak'] / 1e6:.0f}",
        f"{found['triangles']:,.0f}",
        f"{found['volume']:,.0f}",
        "" if part == "Bs" else f"{100 * (found['volume'] / true - 1):+.1f} %",
    ]


if __name__ == "__main__":
    main()
