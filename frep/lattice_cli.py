"""`frep lattice`: examine, draw and export the lattice that a program defines, region by region.

A *lattice program* is a design file that defines `lattice`. The lattice may have more beams than any memory holds; what is asked
for is evaluated, no more. Any object will do that has what `Lattice` lists: the kernel knows no topology by name.

A file that holds a lattice will do as well. A package announces what it reads in the entry-point group `frep.lattices`: under
each suffix a function that takes a path and gives a lattice,

    [project.entry-points."frep.lattices"]
    json = "my_package.files:read_json"
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, TextIO, cast

import numpy as np

from frep.errors import ArgumentError, ArgumentTypeError, FileError, TooLargeError

if TYPE_CHECKING:
    from frep.mesh import Mesh
    from frep.parameter import Parameter
    from frep.solid import Solid

GROUP = "frep.lattices"
"""The entry-point group of functions that read lattices, by suffix."""

Action = Literal["info", "beams", "mesh", "render", "export"]

MOST = 50_000_000
"""Beams that are written without being told to (--all)."""

DRAWN = 100_000
"""Beams that a picture shows; of a larger lattice, those of a block at its first corner."""

EXPORTED = (".json", ".txt", ".py")

_BLOCK = 65_536  # beams at a time: a few MB
_SIDES = 12  # of a drawn beam
_HAIR = 0.0012  # radius of an outline, as a part of the size of what is drawn
_VISIBLE = 0.02  # a region smaller than this part of the whole is drawn without the outline


class Lattice(Protocol):
    """What `frep lattice` asks of the object that a program calls `lattice`.

    Clusters of balls have indices (i, j, k) from `start` on, `counts` of them along each direction. A rack is a beam
    repeated at all of them; each beam has an index of its own, (i, j, k, rack).
    """

    counts: Any
    start: Any
    racks: Any

    @property
    def n_nodes(self) -> int:
        """How many balls, exactly."""
        ...

    @property
    def n_beams(self) -> int:
        """How many beams, exactly."""
        ...

    def beams(self, block: int) -> Iterator[np.ndarray]:
        """The indices of all beams, (m, 4) int64 rows (i, j, k, rack), about `block` at a time."""
        ...

    def region(self, start: Any, span: Any) -> Lattice:
        """The same lattice with `span` clusters from index `start` on, under the same indices."""
        ...

    def ends(self, beams: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Centres (m, 2, 3) and radii (m, 2) of the balls of beams, given by (m, 4) rows (i, j, k, rack)."""
        ...

    def outline(self) -> list[np.ndarray]:
        """Polylines (n, 3) that show where the whole lattice is."""
        ...

    def solid(self) -> Solid:
        """The union of its beams."""
        ...

    def clean(self) -> Any:
        """Whether beams meet only at balls: true or false, or a report with `is_clean` and `message`."""
        ...

    def volume(self) -> float:
        """mm3, of a clean lattice."""
        ...

    def area(self) -> float:
        """mm2, of a clean lattice."""
        ...

    def save(self, path: Path, *, most: int | None) -> None:
        """Write it as .json (the model), .txt (at most `most` balls and beams) or .py (a program)."""
        ...


_NEEDED: dict[Action, tuple[str, ...]] = {
    "info": ("counts", "start", "racks", "n_nodes", "n_beams", "clean", "volume", "area"),
    "beams": ("counts", "start", "n_beams", "region", "beams", "ends"),
    "mesh": ("counts", "start", "region", "solid"),
    "render": ("counts", "start", "n_beams", "region", "beams", "ends", "outline"),
    "export": ("counts", "start", "n_nodes", "n_beams", "region", "save"),
}


@dataclass(frozen=True)
class Options:
    """What `frep lattice` was asked, beyond the program and the action; text as it was typed.

    Attributes:
        roi: "i,j,k:di,dj,dk", the clusters of a region of interest: the first and how many.
        box: "x0,y0,z0:x1,y1,z1", mm.
        voxel: mm.
        output: the file to write.
        everything: write however many beams there are.
    """

    roi: str | None = None
    box: str | None = None
    voxel: float | None = None
    output: Path | None = None
    everything: bool = False


_TAKES: dict[Action, tuple[str, ...]] = {
    "info": (),
    "beams": ("roi", "output", "everything"),
    "mesh": ("roi", "box", "voxel", "output"),
    "render": ("roi", "output"),
    "export": ("roi", "output", "everything"),
}
_FLAGS = {"roi": "--roi", "box": "--box", "voxel": "--voxel", "output": "--output", "everything": "--all"}


def run_lattice(program: Path, action: Action, options: Options, replaced: dict[str, str]) -> None:
    """Do what `frep lattice` says.

    Args:
        program: the script; it defines `lattice`. Or a file that holds a lattice, of a suffix that a package reads.
        action: one of `info`, `beams`, `mesh`, `render`, `export`.
        options: region, files and the like.
        replaced: new values of the program's parameters, as text.

    Raises:
        ArgumentError: an option that the action does not take, a region that is not one, a program without a lattice.
        ArgumentTypeError: `lattice` lacks what the action needs.
        FileError: a file that cannot be written, before the program runs.
        TooLargeError: more beams than are written without --all.
        FrepError: whatever the program or its lattice raises.
    """
    for name in _FLAGS.keys() - set(_TAKES[action]):
        if getattr(options, name) not in (None, False):
            takes = ", ".join(_FLAGS[name] for name in _TAKES[action]) or "no option but --param"
            raise ArgumentError(
                f"{_FLAGS[name].strip('-')}: `frep lattice {action}` does not take it; it takes {takes}"
            )
    roi = None if options.roi is None else _triples(options.roi, "roi", "i,j,k:di,dj,dk", int)
    box = None if options.box is None else _triples(options.box, "box", "x0,y0,z0:x1,y1,z1", float)
    output = _checked_output(program, action, options.output)

    held = _held(program, replaced)
    names = held or _run(program, replaced)
    whole = _lattice_of(program, names, action)
    if action == "info":
        from frep.design import declared_parameters

        _info(program, names, whole, [] if held else declared_parameters(program), replaced)
        return
    region = whole if roi is None else _region(whole, roi)
    if action == "beams":
        _beams(region, output, options.everything)
    elif action == "mesh":
        _mesh(program, names, region, box, options.voxel, cast(Path, output))
    elif action == "render":
        _render(names.get("title"), whole, None if roi is None else region, cast(Path, output))
    else:
        _export(region, cast(Path, output), options.everything)


# What is asked


def _triples(text: str, name: str, form: str, kind: type) -> np.ndarray:
    """(2, 3) numbers of "a,b,c:d,e,f"."""
    try:
        rows = [[kind(word) for word in part.split(",")] for part in text.split(":")]
    except ValueError:
        rows = []
    if len(rows) != 2 or any(len(row) != 3 for row in rows):
        numbers = "whole numbers" if kind is int else "numbers in mm"
        raise ArgumentError(f"{name}: expected six {numbers}, {form}, got {text!r}")
    array = np.array(rows)
    if not np.all(np.isfinite(array)):
        raise ArgumentError(f"{name}: expected finite numbers, got {text!r}")
    if kind is float and not np.all(array[0] < array[1]):
        raise ArgumentError(f"{name}: expected a lower and an upper corner, {form}, got {text!r}")
    return array


def _checked_output(program: Path, action: Action, output: Path | None) -> Path | None:
    from frep.io.atomic import check_target

    if action == "beams" and output is None:
        return None  # to stdout
    if action == "info":
        return None
    suffix = {"mesh": ".stl", "render": ".png", "export": ".json", "beams": ".txt"}[action]
    path = output or Path(f"{program.stem}{suffix}")
    if action == "mesh":
        from frep.io.save import SUFFIXES as known
    else:
        known = {"render": (".png",), "export": EXPORTED, "beams": ()}[action]
    if known and path.suffix.lower() not in known:
        raise FileError(f"output: {str(path)!r} has an unknown suffix; known for {action}: {', '.join(known)}")
    target = check_target(path)
    if target == program.resolve():
        raise FileError(f"output: {str(path)!r} is the program itself; give another name")
    return path


def _run(program: Path, replaced: dict[str, str]) -> dict[str, Any]:
    from frep.design import run_script
    from frep.progress import progress

    with progress("program"):
        return run_script(program, replaced)


def _held(program: Path, replaced: dict[str, str]) -> dict[str, Any] | None:
    """What a file that holds a lattice defines, under the names of a script; None for a script."""
    from importlib.metadata import entry_points

    from frep.progress import progress

    suffix = program.suffix.lower()
    points = list(entry_points(group=GROUP, name=suffix.lstrip("."))) if suffix not in ("", ".py") else []
    if not points:
        if suffix in EXPORTED and suffix != ".py":
            raise FileError(
                f"program: no installed package reads lattices from {suffix} files (entry points {GROUP!r}), for {str(program)!r}"
            )
        return None
    if replaced:
        raise ArgumentError(
            f"param: {program} holds a lattice, not a program, and declares no parameters; got {', '.join(replaced)}"
        )
    with progress("reading"):
        return {"lattice": points[0].load()(program)}


def _lattice_of(program: Path, names: dict[str, Any], action: Action) -> Lattice:
    if "lattice" not in names:
        raise ArgumentError(
            f"lattice: {program} defines no `lattice`; a lattice program ends with lattice = <a lattice>"
        )
    found = names["lattice"]
    missing = [name for name in _NEEDED[action] if not hasattr(found, name)]
    if missing:
        raise ArgumentTypeError(
            f"lattice: `lattice` in {program} is a {type(found).__name__}, which lacks {', '.join(missing)}; "
            f"`frep lattice {action}` needs {', '.join(_NEEDED[action])}"
        )
    return found


def _region(lattice: Lattice, roi: np.ndarray) -> Lattice:
    first, end = np.asarray(lattice.start), np.asarray(lattice.start) + np.asarray(lattice.counts)
    start, span = roi
    if np.any(span < 1) or np.any(start < first) or np.any(start + span > end):
        whole = ":".join(",".join(str(int(n)) for n in row) for row in (first, end - first))
        asked = ":".join(",".join(str(int(n)) for n in row) for row in roi)
        raise ArgumentError(f"roi: expected clusters within the lattice, {whole}, at least one each way, got {asked}")
    return lattice.region(tuple(int(n) for n in start), tuple(int(n) for n in span))


def _few_enough(lattice: Lattice, everything: bool, what: str) -> None:
    if lattice.n_beams > MOST and not everything:
        raise TooLargeError(
            f"lattice: {what} would write {lattice.n_beams:,} beams, more than {MOST:,}; "
            "choose clusters with --roi i,j,k:di,dj,dk, or say --all"
        )


# What is done


def _info(
    program: Path, names: dict[str, Any], lattice: Lattice, declared: list[Parameter], replaced: dict[str, str]
) -> None:
    from frep.progress import progress

    title = names.get("title")
    first, counts = (tuple(int(n) for n in row) for row in (lattice.start, lattice.counts))
    rows = [
        ("lattice", title if isinstance(title, str) else program.stem),
        ("clusters", " x ".join(f"{n:,}" for n in counts) + (f", from {first}" if any(first) else "")),
        ("racks", f"{len(lattice.racks):,}"),
        ("balls", f"{lattice.n_nodes:,}"),
        ("beams", f"{lattice.n_beams:,}"),
    ]
    with progress("measuring"):
        report = lattice.clean()
        clean = bool(getattr(report, "is_clean", report))
        if clean:
            rows += [
                ("clean", "yes"),
                ("volume, mm3", f"{lattice.volume():,.6g}"),
                ("area, mm2", f"{lattice.area():,.6g}"),
            ]
        else:
            rows.append(("clean", f"no: {getattr(report, 'message', 'beams overlap beyond their balls')}"))
    for parameter in declared:
        now = names.get(parameter.name, parameter.default)
        if parameter.name == "title":
            continue
        told = f"{now!r}" + (f" {parameter.unit}" if parameter.unit else "")
        remarks = [text for text in (parameter.range, parameter.help) if text]
        if parameter.name in replaced:
            remarks.insert(0, f"default {parameter.default!r}")
        rows.append((f"--param {parameter.name}", told + (f"  ({'; '.join(remarks)})" if remarks else "")))
    width = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{width}}  {value}" for name, value in rows))


def _beams(lattice: Lattice, output: Path | None, everything: bool) -> None:
    _few_enough(lattice, everything, "beams")
    from frep.io.atomic import replacing
    from frep.progress import progress

    with ExitStack() as stack:
        file: TextIO = sys.stdout
        advance = stack.enter_context(progress("beams", total=lattice.n_beams))
        if output is not None:
            temporary = stack.enter_context(replacing(output))
            file = stack.enter_context(temporary.open("w", encoding="ascii", newline="\n"))
        file.write("# i j k rack  x y z radius  x y z radius: both balls of each beam, mm\n")
        for block in lattice.beams(_BLOCK):
            centers, radii = lattice.ends(block)
            numbers = np.concatenate([centers, radii[:, :, None]], axis=2).reshape(len(block), 8)
            values = [v for row, tail in zip(block.tolist(), numbers.tolist(), strict=True) for v in (*row, *tail)]
            file.write("%d %d %d %d %r %r %r %r %r %r %r %r\n" * len(block) % tuple(values))
            advance(len(block))
    if output is not None:
        _wrote(output)


def _mesh(
    program: Path, names: dict[str, Any], lattice: Lattice, box: np.ndarray | None, voxel: float | None, output: Path
) -> None:
    from frep.design import Design
    from frep.io import MESH_SUFFIXES
    from frep.job import make
    from frep.primitives import box as box_between
    from frep.progress import Stages, closing_table, progress

    with Stages() as stages:
        solid = lattice.solid()
        if box is not None:
            solid = solid & box_between(tuple(box[0]), tuple(box[1]))
        design = Design(program, solid, names)
        made = make(design, voxel=voxel)
        with progress(f"writing {output.suffix.lower()}"):
            if output.suffix.lower() in MESH_SUFFIXES:
                made.mesh.save(output)
            else:
                solid.save(output, voxel=made.voxel)
    closing_table(design.title, made.facts(), stages)
    _wrote(output)


def _render(title: Any, whole: Lattice, region: Lattice | None, output: Path) -> None:
    from frep.view import render

    if region is None:
        region = _drawable(whole)
        if region.n_beams > DRAWN:
            raise TooLargeError(
                f"lattice: a single cluster has {region.n_beams:,} beams, more than the {DRAWN:,} that a picture shows"
            )
    elif region.n_beams > DRAWN:
        raise TooLargeError(
            f"roi: its {region.n_beams:,} beams are more than the {DRAWN:,} that a picture shows; choose fewer clusters"
        )
    parts, size = _beams_drawn(region)
    curves = whole.outline()
    around = float(np.linalg.norm(np.ptp(np.concatenate(curves), axis=0))) if curves else 0.0
    outlined = region.n_beams < whole.n_beams and size >= _VISIBLE * around
    if outlined:
        parts += _lines_drawn(curves, _HAIR * max(size, around))
    if not parts:
        raise ArgumentError("lattice: it has no beams to draw; expected at least one rack that fits into the counts")
    render(_joined(parts), output, title=title if isinstance(title, str) else None)
    if region.n_beams < whole.n_beams:
        asked = ":".join(",".join(str(int(n)) for n in row) for row in (region.start, region.counts))
        rest = (
            "and the outline of all"
            if outlined
            else f"too small a part to show in the outline, {around:,.4g} mm across"
        )
        print(f"{region.n_beams:,} of {whole.n_beams:,} beams, --roi {asked}, {rest}")
    _wrote(output)


def _drawable(lattice: Lattice) -> Lattice:
    """The lattice, or a block of about as many clusters each way at its first corner whose beams a picture can show."""
    counts = np.array([int(n) for n in lattice.counts], dtype=object)
    side = int(max(counts))
    while True:
        span = np.minimum(counts, side)
        region = lattice.region(tuple(int(n) for n in lattice.start), tuple(int(n) for n in span))
        if region.n_beams <= DRAWN or side == 1:
            return region
        side = max(side // 2, 1) if side > 64 else side - 1


def _export(lattice: Lattice, output: Path, everything: bool) -> None:
    if output.suffix.lower() == ".txt":
        _few_enough(lattice, everything, "a .txt file")
    lattice.save(output, most=None)
    _wrote(output)


def _wrote(path: Path) -> None:
    size = path.stat().st_size
    print(f"wrote {path} ({f'{size / 1e6:.1f} MB' if size >= 1e5 else f'{size / 1e3:.1f} kB'})")


# What is drawn


_Part = tuple[np.ndarray, np.ndarray]  # vertices and faces


def _beams_drawn(region: Lattice) -> tuple[list[_Part], float]:
    """Triangles that show the beams of a region, and its size: to look at, neither closed nor one surface."""
    parts, low, high = [], np.full(3, np.inf), np.full(3, -np.inf)
    for block in region.beams(_BLOCK):
        centers, radii = region.ends(block)
        parts += [_cones(centers, radii), _spheres(centers.reshape(-1, 3), radii.reshape(-1))]
        low, high = np.minimum(low, centers.min(axis=(0, 1))), np.maximum(high, centers.max(axis=(0, 1)))
    return parts, float(np.linalg.norm(high - low)) if parts else 0.0


def _lines_drawn(curves: list[np.ndarray], radius: float) -> list[_Part]:
    segments = [np.stack([curve[:-1], curve[1:]], axis=1) for curve in curves]
    return [_cones(ends, np.full(ends.shape[:2], radius)) for ends in segments]


def _joined(parts: list[_Part]) -> Mesh:
    from frep.mesh import Mesh

    shifts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = np.concatenate([faces + shift for (_, faces), shift in zip(parts, shifts, strict=True)])
    return Mesh(np.concatenate([vertices for vertices, _ in parts]), faces)


def _cones(centers: np.ndarray, radii: np.ndarray) -> _Part:
    """Beams (m, 2, 3) as frusta tangent to their balls (m, 2): vertices and faces, without ends."""
    axis = centers[:, 1] - centers[:, 0]
    length = np.linalg.norm(axis, axis=1)
    keep = length > np.abs(radii[:, 1] - radii[:, 0])  # a ball within the other has no cone
    centers, radii, axis, length = centers[keep], radii[keep], axis[keep], length[keep]
    axis = axis / length[:, None]
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis), axis=1)])
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(axis, x)
    angles = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
    rings = np.cos(angles)[:, None] * x[:, None] + np.sin(angles)[:, None] * y[:, None]
    sine = (radii[:, 0] - radii[:, 1]) / length
    cosine = np.sqrt(1.0 - sine**2)
    offset = sine[:, None, None] * axis[:, None] + cosine[:, None, None] * rings
    vertices = centers[:, :, None] + radii[:, :, None, None] * offset[:, None]
    a = np.arange(_SIDES)
    b = (a + 1) % _SIDES
    quad = np.concatenate([np.stack([a, b, b + _SIDES], 1), np.stack([a, b + _SIDES, a + _SIDES], 1)])
    faces = quad[None] + 2 * _SIDES * np.arange(len(vertices))[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _spheres(centers: np.ndarray, radii: np.ndarray) -> _Part:
    """Balls, each once though many beams share it: vertices and faces."""
    scale = max(float(np.abs(centers).max(initial=0.0)), 1e-300)
    _, first = np.unique(np.round(centers / scale, 9), axis=0, return_index=True)
    ball, triangles = _ball()
    vertices = centers[first, None] + radii[first, None, None] * ball
    faces = triangles[None] + len(ball) * np.arange(len(first))[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _ball() -> _Part:
    """An octahedron, twice refined, on the unit sphere."""
    vertices = [sign * row for row in np.eye(3) for sign in (1.0, -1.0)]
    faces = [(x, y, z) if (x + y + z) % 2 == 0 else (x, z, y) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    # Each negative corner flips the turn of (+x, +y, +z); odd numbers stand for them, so that the sum's parity counts them.
    for _ in range(2):
        finer = []
        number: dict[tuple[int, int], int] = {}  # of the middle of each edge
        for a, b, c in faces:
            middles = []
            for p, q in ((a, b), (b, c), (c, a)):
                edge = (min(p, q), max(p, q))
                if edge not in number:
                    number[edge] = len(vertices)
                    vertices.append((vertices[p] + vertices[q]) / np.linalg.norm(vertices[p] + vertices[q]))
                middles.append(number[edge])
            ab, bc, ca = middles
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return np.array(vertices), np.array(faces)
