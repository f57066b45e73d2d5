"""Parts graded by data, at 200^3 voxels and more: a bar by its finite-element results, a head by its CT.

The seconds run from after the imports to the mesh: reading and checking the files, the distance table of the surface, the
inverse of the volume fraction, sampling, marching cubes; each run in a fresh process, kernels from numba's cache.

    python benchmarks/from_data.py [--runs 5]
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

from _timing import child, options, peak_bytes, print_ratio, report, setting, table, this_script

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

VOXELS = {"fe_graded": "0.25", "ct_graded": "0.55"}
"""mm, at which each part takes more than 200^3 voxels."""


def make(name: str) -> None:
    """In a process of its own: the imports, then the part and its mesh."""
    import graded  # noqa: F401
    import topologies.tpms  # noqa: F401
    from frep.design import load_design
    from frep.job import make as make_design
    from gallery.entries import entry

    item = entry(name)
    start = time.perf_counter()
    design = load_design(item.path, {**item.shown, "voxel": VOXELS[name]})
    designed = time.perf_counter()
    made = make_design(design)
    end = time.perf_counter()
    report(
        design=designed - start,
        mesh=end - designed,
        total=end - start,
        voxels=made.evaluated,
        triangles=made.mesh.n_faces,
        peak=peak_bytes(),
    )


def main() -> None:
    if sys.argv[1:2] == ["make"]:
        make(sys.argv[2])
        return
    from gallery.entries import entry

    given = options(__doc__)
    print(setting(given.runs, "parts graded by data, a process a run"))
    rows, results = [], []
    for name, voxel in VOXELS.items():
        if missing := entry(name).missing:
            print(f"{name}: left out, {missing}")
            continue
        runs = [child(this_script("make", name)) for _ in range(given.runs + 1)][1:]  # the first may compile
        middle = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        seconds = [f"{middle[key]:.2f}" for key in ("design", "mesh", "total")]
        counts = [f"{middle['voxels'] / 1e6:.1f}", f"{middle['triangles'] / 1e6:.1f}", f"{middle['peak'] / 1e9:.2f}"]
        rows.append([name, voxel, *seconds, *counts])
        results.append((name, middle))
    table(["part", "voxel mm", "design s", "mesh s", "both s", "M voxels", "M triangles", "peak GB"], rows)
    for name, middle in results:
        print_ratio(f"{name}: seconds after import", middle["total"], "<= 5", " s")
        print_ratio(f"{name}: voxels evaluated", middle["voxels"] / 1e6, ">= 8", " M")


if __name__ == "__main__":
    main()
