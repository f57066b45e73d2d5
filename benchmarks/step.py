"""Exact STEP files: whole cells, a graded lattice of 300 beams and more, and a moved one, against fusing beams one by one.

Seconds from the part to the file, with its volume read back and checked. The naive way is what a CadQuery script does: a cone a
beam, a ball a node, each fused to what is there; on the first `--naive` beams of the graded lattice, for all of them take
longer than the rest of this benchmark. Its seconds a beam grow with what is there, so the ratio by beam is a lower bound.

    python benchmarks/step.py [--runs 3] [--naive 120]
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from _timing import alternate, options, print_ratio, setting, table

import frep
from frep import Solid
from frep.io import _brep
from topologies import beams


def block() -> Solid:
    """27 cells of BCC, 216 beams."""
    return beams.bcc(cell=5).thicken(1) & frep.box((0, 0, 0), (15, 15, 15))


def moved() -> Solid:
    return block().rotate((1, 2, 3), 0.5).translate((10, 0, 5))


def graded() -> Solid:
    """A graph of 5 x 5 x 3 cells of a simple cubic lattice, whose nodes grow from 0.8 to 1.6 mm, no two alike."""
    skeleton = beams.simple_cubic(cell=5).over(((0, 0, 0), (25, 25, 15))).skeleton
    widths = 0.8 + 0.8 * np.linalg.norm(skeleton.nodes, axis=1) / np.linalg.norm(skeleton.nodes.max(axis=0))
    return beams.graph(skeleton.nodes, skeleton.edges).thicken(widths)


def one_by_one(part: Solid, most: int, path: Path) -> int:
    """The first beams of a graph, fused by CadQuery one after the other."""
    import cadquery as cq

    design = part.beams
    assert design is not None
    assert design.end_radii is not None
    nodes, whole = design.skeleton.nodes, None
    edges = design.skeleton.edges[:most]
    for a, b in edges.tolist():
        axis = cq.Vector(*(nodes[b] - nodes[a]).tolist())
        radii, at = [float(design.end_radii[n]) for n in (a, b)], cq.Vector(*nodes[a].tolist())
        pieces = [cq.Solid.makeCone(*radii, axis.Length, at, axis)]
        pieces += [
            cq.Solid.makeSphere(float(design.end_radii[n]), cq.Vector(*nodes[n].tolist()), angleDegrees1=-90)
            for n in (a, b)
        ]
        for piece in pieces:
            whole = piece if whole is None else whole.fuse(piece)
    cq.exporters.export(cq.Workplane(whole), str(path))
    return len(edges)


def main() -> None:
    given = options(__doc__, naive=(120, "beams that the naive way fuses"))
    print(setting(given.runs, "STEP"))
    parts = {"27 cells, 216 beams": block(), "the same, moved": moved(), "graded graph": graded()}
    counts = {"27 cells, 216 beams": 216, "the same, moved": 216}
    skeleton = parts["graded graph"].beams
    assert skeleton is not None
    counts["graded graph"] = len(skeleton.skeleton.edges)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"

        def written(part: Solid) -> tuple[float, bool]:
            part.save(path)
            return _brep.read_back(path)

        times = alternate({name: lambda part=part: written(part) for name, part in parts.items()}, given.runs)
        start = time.perf_counter()
        done = one_by_one(parts["graded graph"], given.naive, path)
        naive = time.perf_counter() - start
        of_naive = _brep.read_back(path)
    rows = []
    for name, t in times.items():
        volume, valid = t.facts
        true = parts[name].volume(0.3)
        rows.append(
            [name, f"{t.median:.2f}", f"{1e3 * t.median / counts[name]:.1f}", f"{volume / true - 1:+.2%}", valid]
        )
    rows.append([f"one by one, {done} beams", f"{naive:.2f}", f"{1e3 * naive / done:.1f}", "", of_naive[1]])
    table(["", "s", "ms a beam", "volume off the field's", "valid"], rows)
    each = times["graded graph"].median / counts["graded graph"]
    print_ratio("graded: a beam, times as fast as one by one", naive / done / each, "report", " x")
    still, there = times["27 cells, 216 beams"].median, times["the same, moved"].median
    print_ratio("moved: seconds, of those where it stood", there / still, "<= 1.5", " x")


if __name__ == "__main__":
    main()
