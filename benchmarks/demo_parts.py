"""The first two parts of the demo, 0.5 mm voxels, script to a binary STL on disk, each run in a fresh process.

Against the figures of the LF-rep thesis (Table 4.1) for the same two parts. The seconds run from the start of the process to
its end, interpreter and imports included; the kernels come from numba's cache.

    python benchmarks/demo_parts.py [--runs 5] [--voxel 0.5]
"""

from __future__ import annotations

import runpy
import statistics
import sys
import tempfile
import time
from pathlib import Path

from _timing import child, options, peak_bytes, print_ratio, report, setting, table, this_script

GALLERY = Path(__file__).resolve().parent.parent / "gallery"
THESIS = {"bcc_parabola": 23.2, "schwarz_p_linear": 122.7}
"""Minutes, LF-rep Table 4.1."""


def make(script: str, voxel: float, path: str) -> None:
    """In a process of its own: run the design, mesh it, write it."""
    start = time.perf_counter()
    part = runpy.run_path(str(GALLERY / f"{script}.py"))["part"]
    designed = time.perf_counter()
    mesh = part.mesh(voxel=voxel)
    meshed = time.perf_counter()
    mesh.save(path)
    end = time.perf_counter()
    report(
        design=designed - start, mesh=meshed - designed, save=end - meshed, triangles=mesh.n_faces, peak=peak_bytes()
    )


def main() -> None:
    if sys.argv[1:2] == ["make"]:
        make(sys.argv[2], float(sys.argv[3]), sys.argv[4])
        return
    given = options(__doc__, voxel=(0.5, "mm"))
    print(setting(given.runs, f"demo parts, {given.voxel} mm, a process a run"))
    rows, results = [], []
    with tempfile.TemporaryDirectory() as folder:
        for script, minutes in THESIS.items():
            runs = []
            for turn in range(given.runs + 1):
                said = child(this_script("make", script, str(given.voxel), f"{folder}/part.stl"))
                if turn > 0:  # the first may compile
                    runs.append(said)
            middle = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
            stages = [f"{middle[key]:.2f}" for key in ("design", "mesh", "save", "wall")]
            rows.append([script, *stages, f"{middle['peak'] / 1e9:.2f}", f"{middle['triangles']:,.0f}"])
            results.append((script, middle, minutes))
    table(["part", "design s", "mesh s", "STL s", "all s", "peak GB", "triangles"], rows)
    for script, middle, minutes in results:
        print_ratio(f"{script}: seconds", middle["wall"], "<= 10", " s")
        print_ratio(f"{script}: peak memory", middle["peak"] / 1e9, "<= 2", " GB")
        print(f"{script}: LF-rep thesis {minutes} min, {60 * minutes / middle['wall']:,.0f} x as long")


if __name__ == "__main__":
    main()
