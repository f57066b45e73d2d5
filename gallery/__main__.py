"""`python -m gallery`: make the gallery's parts, or compare them with their baselines."""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from frep.cli import run
from frep.errors import ArgumentError
from gallery import check as checks
from gallery.entries import BASELINES, ENTRIES, PICTURES, Entry, entry

SIZE = (1000, 750)
COMPARED_SIZE = (600, 450)

app = App(
    name="python -m gallery",
    help="Make the gallery's parts and pictures, or compare them with their baselines.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)


@app.default
def gallery(
    *,
    check: Annotated[bool, Parameter(negative="")] = False,
    update: Annotated[bool, Parameter(negative="")] = False,
    only: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    out: Path | None = None,
) -> int:
    """Make pictures and print what they took; with --check compare with the baselines instead.

    Parameters
    ----------
    check
        Make every entry in its smaller form and compare it with its baseline; exit code 1 if they differ.
    update
        Make every entry in its smaller form and store it as the new baseline.
    only
        Names of entries; all if not given.
    out
        A folder for the parts (.stl) and pictures; if not given, only pictures are made, in gallery/pictures.
    """
    if check and update:
        raise ArgumentError("check: give --check or --update, not both")
    entries = [entry(name) for name in only] if only else list(ENTRIES)
    good = True
    for item in entries:
        if item.missing:
            print(f"{item.name}: skipped, {item.missing}")
        elif check:
            with tempfile.TemporaryDirectory() as folder:
                good &= compare(item, Path(folder), report=out)
        elif update:
            BASELINES.mkdir(exist_ok=True)
            make_compared(item, BASELINES)
            print(f"{item.name}: new baseline")
        else:
            show(item, out)
    return 0 if good else 1


def show(item: Entry, out: Path | None) -> None:
    """Make an entry as it is shown: into `out` the part, the closing table, and the picture."""
    from frep.design import load_design
    from frep.job import make
    from frep.progress import Stages, closing_table, progress
    from frep.view import render

    folder = out or PICTURES
    folder.mkdir(parents=True, exist_ok=True)
    with Stages() as stages:
        with progress("design"):
            design = load_design(item.path, item.shown)
        made = make(design)
        if out is not None:
            with progress("writing"):
                made.mesh.save(folder / f"{item.name}.stl")
    closing_table(design.title, made.facts(), stages)

    drawn = made.mesh
    if item.cut:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the whole part has given them
            drawn = make(load_design(item.path, {**item.shown, **item.cut})).mesh
    picture = folder / f"{item.name}.png"
    render(drawn, picture, size=SIZE, title=design.title)
    print(f"wrote {picture}{'' if out is None else ' and .stl'}\n")


def make_compared(item: Entry, folder: Path) -> None:
    """Make an entry as it is compared: `name.png` and `name.json` in `folder`."""
    from frep.design import load_design
    from frep.job import make
    from frep.view import render

    made = make(load_design(item.path, item.compared))
    render(made.mesh, folder / f"{item.name}.png", size=COMPARED_SIZE, occlusion=False)
    # A file's folder is this machine's affair, not the baseline's.
    settings: dict[str, Any] = {name: value.rpartition("/")[2] for name, value in item.compared.items()}
    checks.write_numbers(
        folder / f"{item.name}.json", checks.numbers(made.mesh, made.evaluated, {**settings, "voxel": made.voxel})
    )


def compare(item: Entry, folder: Path, *, report: Path | None = None) -> bool:
    """Make an entry again in `folder`, print baseline and result side by side, and say whether they agree.

    Args:
        item: the entry.
        folder: for the new picture and numbers.
        report: a folder for a picture of both, made where they differ.
    """
    from rich.console import Console
    from rich.table import Table

    old_numbers, old_picture = (BASELINES / f"{item.name}.{kind}" for kind in ("json", "png"))
    if not (old_numbers.exists() and old_picture.exists()):
        print(f"{item.name}: DIFFERENT, no baseline; make it with: python -m gallery --update --only {item.name}")
        return False
    make_compared(item, folder)
    new_numbers, new_picture = (folder / f"{item.name}.{kind}" for kind in ("json", "png"))
    lines = checks.compare_numbers(checks.read_numbers(old_numbers), checks.read_numbers(new_numbers))
    lines += checks.compare_pictures(old_picture, new_picture)
    good = all(line.good for line in lines)

    table = Table(title=f"{item.name}: {'same' if good else 'DIFFERENT'}", title_justify="left")
    for heading in ("", "baseline", "now", "allowed", ""):
        table.add_column(heading, overflow="fold")
    for line in lines:
        style = None if line.good else "bold red"
        row = (line.name, line.baseline, line.now, line.allowed, "" if line.good else "DIFFERENT")
        table.add_row(*map(str, row), style=style)
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    if not good and report is not None:
        report.mkdir(parents=True, exist_ok=True)
        checks.side_by_side(old_picture, new_picture, report / f"{item.name}_difference.png")
        print(f"wrote {report / f'{item.name}_difference.png'}: baseline, now, difference")
    return good


if __name__ == "__main__":
    sys.exit(run(app))
