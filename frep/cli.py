"""The command `frep`: make, examine and draw parts without writing more Python than the design itself."""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from frep.errors import ArgumentError, FileError, FrepError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frep.design import Design
    from frep.mesh import Mesh

Outputs = Annotated[list[Path] | None, Parameter(name=["--output", "-o"], negative="", consume_multiple=False)]
Param = Annotated[list[str] | None, Parameter(name="--param", negative="", consume_multiple=False)]

app = App(
    name="frep",
    help="Graded cellular structures: from a short design script to a print-ready part.",
    help_format="plaintext",
    version_flags=["--version"],
    suppress_keyboard_interrupt=False,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: the words after `frep`; the process's own where None.

    Returns:
        0; 1 after an error or for a part that does not pass its check; 2 for a wrong command; 130 after Ctrl-C.
    """
    return run(app, arguments)


def run(app: App, arguments: Sequence[str] | None = None) -> int:
    """Run a command line application so that errors are a line each and Ctrl-C is quiet; see `main`."""
    from cyclopts import CycloptsError

    shown = warnings.showwarning
    warnings.showwarning = _warn
    interrupts = _Interrupts()
    try:
        result = app(arguments, exit_on_error=False, result_action="return_value")
        return result if isinstance(result, int) else 0
    except CycloptsError:
        return 2  # cyclopts has explained it
    except FrepError as error:
        _explain(error)
        return 1
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        sys.stderr.close()  # the reader has gone (`frep info part.stl | head -1`): nobody is left to tell
        return 1
    except Exception:
        if interrupts.seen:
            # Numba turns an interrupt during compilation into errors of its own.
            return _interrupted()
        raise
    finally:
        interrupts.restore()
        warnings.showwarning = shown


def _interrupted() -> int:
    print("interrupted: files that were there are unchanged", file=sys.stderr)
    return 130


class _Interrupts:
    """Remembers Ctrl-C; a second one ends the process at once, whatever holds up the first."""

    def __init__(self) -> None:
        self.seen = False
        self._before: Any = None
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._handle)

    def _handle(self, *_: object) -> None:
        if self.seen:
            os._exit(130)
        self.seen = True
        raise KeyboardInterrupt

    def restore(self) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)


@app.command
def mesh(
    design: Path,
    /,
    *,
    voxel: float | None = None,
    tolerance: float | None = None,
    output: Outputs = None,
    polish: Annotated[bool, Parameter(negative="")] = False,
    param: Param = None,
) -> None:
    """Make a design's part and write it.

    Parameters
    ----------
    design
        A Python script that defines `part`, a Solid.
    voxel
        Distance of the samples in mm; the script's own `voxel` if not given.
    tolerance
        Instead of a voxel: the largest distance in mm that facets may keep from the surface.
    output
        The file to write: .stl .ply .obj for the mesh, .step .stp .vdb for the part itself. May be given several times.
        If not given: the design's name with .stl, in this folder.
    polish
        Move the mesh's vertices onto the exact surface.
    param
        name=value, a new value for one of the script's parameters. May be given several times.
    """
    from frep.io import MESH_SUFFIXES
    from frep.io.atomic import check_target
    from frep.io.save import SUFFIXES
    from frep.job import make
    from frep.progress import Stages, closing_table, progress

    paths = output or [Path(f"{design.stem}.stl")]
    for path in paths:
        if path.suffix.lower() not in SUFFIXES:
            raise FileError(f"output: {str(path)!r} has an unknown suffix; known: {', '.join(SUFFIXES)}")
        check_target(path)

    with Stages() as stages:
        loaded = _run(design, param)
        made = make(loaded, voxel=voxel, tolerance=tolerance, polish=polish)
        for path in paths:
            with progress(f"writing {path.suffix.lower()}"):
                if path.suffix.lower() in MESH_SUFFIXES:
                    made.mesh.save(path)
                else:
                    loaded.part.save(path, voxel=made.voxel)
    closing_table(loaded.title, made.facts(), stages)
    for path in paths:
        print(f"wrote {path} ({path.stat().st_size / 1e6:.1f} MB)")


@app.command
def info(part: Path, /) -> None:
    """Tell a mesh file's size, volume, area and state.

    Parameters
    ----------
    part
        A mesh file: .stl .ply .obj .off .vtp ...
    """
    mesh = _read(part)
    report = mesh.check()
    low, high = mesh.bounds
    rows = [
        ("from, mm", " ".join(f"{x:.3f}" for x in low)),
        ("to, mm", " ".join(f"{x:.3f}" for x in high)),
        ("size, mm", " x ".join(f"{x:.3f}" for x in high - low)),
        ("volume, mm3", f"{mesh.volume:,.3f}"),
        ("area, mm2", f"{mesh.area:,.3f}"),
    ]
    print("\n".join(f"{name:<17} {value}" for name, value in rows))
    print(report)


@app.command
def check(part: Path, /) -> int:
    """Say whether a mesh file is closed, manifold and oriented; the exit code is 1 if not.

    Parameters
    ----------
    part
        A mesh file: .stl .ply .obj .off .vtp ...
    """
    report = _read(part).check()
    print(report)
    print(f"{part}: {'ready to print' if report.printable else 'NOT ready to print'}")
    return 0 if report.printable else 1


@app.command
def render(
    part: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    voxel: float | None = None,
    param: Param = None,
) -> None:
    """Draw a design, or a mesh file, into a PNG. No display is needed.

    Parameters
    ----------
    part
        A design script (.py) or a mesh file.
    output
        The picture; if not given: the part's name with .png, in this folder.
    voxel
        For a design: distance of the samples in mm; the script's own `voxel` if not given.
    param
        For a design: name=value, a new value for one of its parameters. May be given several times.
    """
    from frep.view import check_picture
    from frep.view import render as draw

    output = output or Path(f"{part.stem}.png")
    check_picture(output)
    title = None
    if part.suffix.lower() == ".py":
        from frep.job import make

        design = _run(part, param)
        drawn, title = make(design, voxel=voxel).mesh, design.title
    elif voxel is not None or param:
        raise ArgumentError(f"part: {str(part)!r} is a mesh file; --voxel and --param are for a design (.py)")
    else:
        drawn = _read(part)
    draw(drawn, output, title=title)
    print(f"wrote {output}")


@app.command
def lattice(
    program: Path,
    action: Literal["info", "beams", "mesh", "render", "export"] = "info",
    /,
    *,
    param: Param = None,
    roi: str | None = None,
    box: str | None = None,
    voxel: float | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    everything: Annotated[bool, Parameter(name="--all", negative="")] = False,
) -> None:
    """Examine, draw, mesh or export the lattice that a program defines, whole or in part.

    Parameters
    ----------
    program
        A Python script that defines `lattice`; or a lattice that export wrote (.json, .txt).
    action
        info: its counts, measures and parameters. beams: both balls of each beam, as text. mesh: print-ready triangles.
        render: a picture of the beams of a region in the outline of the whole. export: the model (.json), all balls and
        beams (.txt) or a program that builds it (.py).
    param
        name=value, a new value for one of the program's parameters. May be given several times.
    roi
        For beams, mesh, render and export: i,j,k:di,dj,dk, the first cluster of a region and how many each way.
    box
        For mesh: x0,y0,z0:x1,y1,z1 in mm, a box that cuts the lattice; --box=-1,... where it starts with a minus.
    voxel
        For mesh: distance of the samples in mm; the program's own `voxel` if not given.
    output
        The file to write; if not given: the program's name in this folder, and the terminal for beams.
    everything
        For beams and export: write more than 50 million beams.
    """
    from frep.lattice_cli import Options, run_lattice

    options = Options(roi=roi, box=box, voxel=voxel, output=output, everything=everything)
    run_lattice(program, action, options, _replaced(param))


@app.command
def topologies(
    name: str | None = None,
    /,
    *,
    family: str | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
    picture: Path | None = None,
    curve: Path | None = None,
    page: Path | None = None,
) -> None:
    """List the topologies there are, or tell all of one.

    Parameters
    ----------
    name
        A topology; all of them in tables if not given.
    family
        List only this family.
    json
        Print JSON instead.
    picture
        A .png to draw the topology into.
    curve
        A .png or .csv for its volume fraction against thickness, diameter or bias.
    page
        A .html for the whole catalogue, or a family: pictures, parameters, limits, volume fractions, in one file.
    """
    from frep.topology_cli import Options, run_topologies

    run_topologies(name, Options(family=family, json=json, picture=picture, curve=curve, page=page))


def _run(path: Path, params: list[str] | None) -> Design:
    from frep.design import load_design
    from frep.progress import progress

    replaced = _replaced(params)
    with progress("design"):
        return load_design(path, replaced)


def _replaced(params: list[str] | None) -> dict[str, str]:
    replaced: dict[str, str] = {}
    for param in params or []:
        name, equals, value = param.partition("=")
        if not equals or not name.strip():
            raise ArgumentError(f"param: expected name=value, got {param!r}")
        replaced[name.strip()] = value
    return replaced


def _read(path: Path) -> Mesh:
    from frep.io.read import read_mesh
    from frep.progress import progress

    with progress("reading"):
        return read_mesh(path)


def _explain(error: FrepError) -> None:
    """One line; before it, the user's own part of the traceback where the user's code is what failed."""
    from frep.errors import FunctionError

    if isinstance(error, FunctionError) and error.__cause__ is not None:
        import traceback

        package = str(Path(__file__).resolve().parent)
        told = traceback.TracebackException.from_exception(error.__cause__)
        frames = [frame for frame in told.stack if not str(Path(frame.filename).resolve()).startswith(package)]
        told.stack = traceback.StackSummary.from_list(frames)
        told.__cause__ = told.__context__ = None
        print("".join(told.format()), end="", file=sys.stderr)
    where = "".join(f" ({note})" for note in getattr(error, "__notes__", []))
    print(f"frep: error: {error}{where}", file=sys.stderr)


def _warn(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any) -> None:
    print(f"frep: warning: {message}", file=sys.stderr)
