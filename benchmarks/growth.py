"""How time and memory grow with resolution: the gyroid sheet at 1, 2, 4, 8 times, each run in a process of its own.

Memory is what the mesh added to the peak of the process, whose interpreter and kernels are there at any resolution; the
kernels are loaded by a small part first. Surface grows by 4 a doubling. A resolution that would need more than half of the
free memory is left out.

    python benchmarks/growth.py [--cells 10] [--voxel 0.5] [--doublings 3] [--runs 5]
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

from _timing import child, options, peak_bytes, print_ratio, report, setting, table, this_script


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def make(cells: int, voxel: float) -> None:
    """In a process of its own: mesh the part once."""
    import _designs as designs

    designs.a(1).mesh(voxel=0.5)  # loads every kernel
    before = _resident_bytes()
    start = time.perf_counter()
    mesh = designs.a(cells).mesh(voxel=voxel)
    seconds = time.perf_counter() - start
    report(seconds=seconds, added=peak_bytes() - before, peak=peak_bytes(), triangles=mesh.n_faces)


def main() -> None:
    if sys.argv[1:2] == ["make"]:
        make(int(sys.argv[2]), float(sys.argv[3]))
        return
    given = options(
        __doc__,
        cells=(10, "unit cells of 5 mm along each edge of the cube"),
        voxel=(0.5, "the coarsest, mm"),
        doublings=(3, "how often the resolution doubles"),
    )
    print(setting(given.runs, f"gyroid sheet, {5 * given.cells} mm cube, a process a run"))
    from frep.sampling import free_bytes

    sizes = [given.voxel / 2**i for i in range(given.doublings + 1)]
    results: list[dict[str, float]] = []
    child(this_script("make", "1", str(given.voxel)))  # compiles, if need be
    for voxel in sizes:
        if len(results) and 4.5 * results[-1]["added"] > 0.5 * free_bytes():
            print(f"{voxel} mm left out: it would need about {4.5 * results[-1]['added'] / 1e9:.1f} GB")
            break
        runs = [child(this_script("make", str(given.cells), str(voxel))) for _ in range(given.runs)]
        results.append({key: statistics.median(run[key] for run in runs) for key in runs[0]})
    rows = []
    for voxel, now in zip(sizes, results, strict=False):
        memory = [f"{now['added'] / 1e6:.0f}", f"{now['peak'] / 1e6:.0f}"]
        rows.append([f"{voxel:g}", f"{now['triangles']:,.0f}", f"{now['seconds']:.3f}", *memory])
    table(["voxel mm", "triangles", "median s", "added MB", "peak MB"], rows)
    for voxel, before, now in zip(sizes[1:], results, results[1:], strict=False):
        for name, key in (("triangles", "triangles"), ("time", "seconds"), ("memory", "added")):
            print_ratio(f"{name}, {2 * voxel:g} -> {voxel:g} mm", now[key] / before[key], "4 +- 30 % (2.8 to 5.2)")


if __name__ == "__main__":
    main()
