"""What a user waits for before any work: `import frep`, and once a machine the compilation of all kernels.

python benchmarks/startup.py [--runs 10] [--imports-only]
"""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

from _timing import child, options, print_ratio, report, table, this_script


def slowest_imports(n: int = 5) -> list[list[str]]:
    """The packages whose own modules take most of `import frep`, by the interpreter's account, ms."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", "import frep"], capture_output=True, text=True, check=True
    )
    own: dict[str, float] = {}
    for line in done.stderr.splitlines():
        found = re.match(r"import time:\s*(\d+) \|\s*(\d+) \|\s*(\S+)", line)
        if found:
            package = found[3].split(".")[0]
            own[package] = own.get(package, 0.0) + int(found[1]) / 1000
    return [[name, f"{ms:.0f}"] for name, ms in sorted(own.items(), key=lambda item: -item[1])[:n]]


def exercise() -> None:
    """In a process with an empty cache: everything that compiles, then other designs, which must not."""
    from numba.core import event

    start = time.perf_counter()
    import numpy as np

    import frep
    from graded import distance_to, linear
    from topologies import beams, tpms
    from topologies.steady import Screw, SteadyLattice, Swirl, Translation, lattice_in_lattice

    imported = time.perf_counter() - start
    warnings.simplefilter("ignore")
    box = frep.box((0, 0, 0), (10, 10, 10))
    far = frep.box((1e6, 0, 0), (1e6 + 10, 10, 10))
    diameter = linear("x", 0, 10, 1, 2)
    graph = beams.graph([(1, 1, 1), (9, 9, 9), (9, 1, 5)], [(0, 1), (1, 2)])

    cubic = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
    moves = Translation((2, 0, 0)), Screw(0.05, "z", (-40, 0, 0)), Swirl(0.97, (0, 0, 70))
    steady = SteadyLattice([(1, 1, 1)], 0.4, cubic, *moves, counts=(5, 5, 5))
    coarse = SteadyLattice([(1, 1, 1)], 0.5, cubic, *(s.power(2) for s in moves), counts=(3, 3, 3))

    def body() -> None:
        with tempfile.TemporaryDirectory() as folder:
            for suffix in (".stl", ".ply", ".obj"):
                frep.sphere((0, 0, 0), 5).mesh(voxel=1).save(f"{folder}/ball{suffix}")
            loaded = frep.load(f"{folder}/ball.stl")
            (loaded.shell(1.5) | (loaded & tpms.gyroid(cell=5).sheet(1 + 0.1 * distance_to(loaded)))).mesh(voxel=0.5)

    stages: dict[str, Callable[[], object]] = {
        "points, intervals, gradients": lambda: (
            box.field(np.ones((600, 3))),
            box.field.bounds((0, 0, 0), (1, 1, 1)),
            box.field.gradient(np.ones((600, 3))),
        ),
        "float32 blocks, marching": lambda: (box - frep.sphere((5, 5, 5), 4)).mesh(voxel=0.5),
        "float64 blocks": lambda: (far - frep.sphere((1e6, 5, 5), 4)).mesh(voxel=0.05 * 8),
        "beams, periodic": lambda: (beams.bcc(cell=5).thicken(1) & box).mesh(voxel=0.5),
        "beams, every section": lambda: [
            (beams.bcc(cell=5).thicken(diameter, node=1.1 * diameter, blend=0.5) & box).mesh(voxel=0.5),
            (beams.simple_cubic(cell=5).thicken(1, section=beams.square(fillet=0.2)) & box).mesh(voxel=0.5),
            graph.thicken([1, 2, 1]).mesh(voxel=0.5),
        ],
        "beams, float64": lambda: (beams.bcc(cell=5).thicken(diameter, blend=0.5) & far).mesh(voxel=0.4),
        "grids": lambda: (tpms.gyroid(cell=5).sheet(1) & box).mesh(voxel=0.5),
        "grids, float64": lambda: (tpms.gyroid(cell=5).sheet(1) & far).mesh(voxel=0.4),
        "steady lattices": lambda: (
            (steady.solid() & box).mesh(voxel=0.5),
            steady.beams_meeting((5, 5, 5), 1),
            steady.nodes_meeting((5, 5, 5), 1),
            steady.filtered(lattice_in_lattice(coarse)).count(),
            steady.volume(),
        ),
        "polish, volume": lambda: (
            frep.sphere((0, 0, 0), 5).mesh(voxel=1, polish=True),
            frep.sphere((0, 0, 0), 5).volume(voxel=1),
        ),
        "mesh numbers and check": lambda: (
            (m := frep.torus((0, 0, 0), (0, 0, 1), 5, 2).mesh(voxel=0.5)).check(),
            m.volume,
            m.bounds,
        ),
        "files, bodies": body,
    }
    x, y, z = frep.coordinates()
    wavy = frep.sin(x) * frep.exp(-0.1 * frep.hypot(y, z)) + frep.tanh(x - y)
    wavy = wavy + frep.where(z > 5, frep.arctan2(y, x), 0.3)
    later: dict[str, Callable[[], object]] = {
        "second: every operation": lambda: (frep.Solid(wavy) & box).mesh(voxel=0.5),
        "second: Schwarz P, graded": lambda: (tpms.schwarz_p(cell=6).sheet(diameter) & box).mesh(voxel=0.4),
        "second: a custom cell": lambda: (
            beams.cell([(0, 0, 0), (4, 4, 2), (2, 0, 4)], [(0, 1), (1, 2)], size=4, check=False).thicken(0.8, node=1.2)
            & box
        ).mesh(voxel=0.4, polish=True),
    }
    seconds, compiling, failed = {}, {}, {}
    for name, run in [*stages.items(), *later.items()]:
        recorder = event.RecordingListener()
        event.register("numba:compile", recorder)
        start = time.perf_counter()
        try:
            run()
        except Exception as error:  # one stage that fails must not hide the others' seconds
            failed[name] = f"{type(error).__name__}: {error}"
        seconds[name] = time.perf_counter() - start
        event.unregister("numba:compile", recorder)
        compiling[name] = _outermost(recorder.buffer)
    report(imported=imported, seconds=seconds, compiling=compiling, failed=failed)


def _outermost(records: list) -> float:
    """Seconds within compile events, those that contain others counted once."""
    depth, total, began = 0, 0.0, 0.0
    for when, record in records:
        if record.is_start:
            began = when if depth == 0 else began
            depth += 1
        else:
            depth -= 1
            total += when - began if depth == 0 else 0.0
    return total


def _compilation() -> None:
    with tempfile.TemporaryDirectory() as cache:
        first = child(this_script("exercise"), {"NUMBA_CACHE_DIR": cache})
        size = sum(path.stat().st_size for path in Path(cache).rglob("*") if path.is_file())
        again = child(this_script("exercise"), {"NUMBA_CACHE_DIR": cache})
    rows = []
    for name in first["seconds"]:
        cells = [first["seconds"][name], first["compiling"][name], again["seconds"][name], again["compiling"][name]]
        rows.append([name, *(f"{value:.2f}" for value in cells)])
    heads = ["kernels, in the order of first use", "fresh cache s", "compiling s", "cached s", "compiling s"]
    table(heads, rows)
    for name, reason in first["failed"].items():
        print(f"failed: {name}: {reason}")
    new = sum(value for name, value in first["compiling"].items() if name.startswith("second"))
    print_ratio("all compilation on a fresh cache", sum(first["compiling"].values()), "<= 60", " s")
    print_ratio("compilation for other designs after it", new, "0", " s")
    print_ratio("compilation with the cache, another process", sum(again["compiling"].values()), "0", " s")
    print(f"the cache: {size / 1e6:.1f} MB; the process with it {again['wall']:.1f} s, without {first['wall']:.1f} s")


def main() -> None:
    if sys.argv[1:2] == ["exercise"]:
        exercise()
        return
    given = options(__doc__, imports_only=(False, "leave the compilation out"))
    runs = max(given.runs, 10)
    program = "import time; t = time.perf_counter(); import frep; print(time.perf_counter() - t)"
    times, whole = [], []
    for turn in range(runs + 1):
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
        if turn > 0:  # the first reads the files from the disk
            times.append(float(done.stdout))
            whole.append(time.perf_counter() - start)
    print(f"import frep, median of {runs} fresh processes: least {min(times):.3f}, most {max(times):.3f} s")
    print_ratio("import frep", statistics.median(times), "<= 0.5", " s")
    print(f"the whole process, interpreter included: {statistics.median(whole):.3f} s")
    table(["slowest, own modules", "ms"], slowest_imports())
    if not given.imports_only:
        print()
        _compilation()


if __name__ == "__main__":
    main()
