"""`frep topologies`: what topologies there are, one in whole, its picture, its volume fractions, and a page of all.

Topologies are those that installed packages announce (`frep.catalogue`); the kernel knows none by name.
"""

from __future__ import annotations

import base64
import html
import io
import json
import sys
import tempfile
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frep.catalogue import FORMS, GROUP, CatalogueWarning, Entry, discover, find, of_family, told
from frep.errors import ArgumentError, FileError, FrepError, FunctionError, MissingDependencyError, warn

_COLORS = {"thicken": "#2f6f9f", "sheet": "#2f6f9f", "solid": "#b3572e", "inverse": "#8a8f2f", "twin": "#7a4f9a"}
_PLOT = (720, 480)  # px of a plot in a file of its own
_SMALL = (260, 180)  # px of one on the page
_THUMBNAIL = (360, 270)
_WIDE = 100  # characters of a terminal that has room for the sources

Curves = dict[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Options:
    """What `frep topologies` was asked beyond the name.

    Attributes:
        family: list only this one.
        json: print JSON instead of a table.
        picture: a .png to draw the topology into.
        curve: a .png or .csv for its volume fractions.
        page: a .html for the whole catalogue.
    """

    family: str | None = None
    json: bool = False
    picture: Path | None = None
    curve: Path | None = None
    page: Path | None = None


def run_topologies(name: str | None, options: Options) -> None:
    """Do what `frep topologies` says.

    Args:
        name: a topology, or None for all.
        options: files and the like.

    Raises:
        ArgumentError: an unknown name or family, or an option that does not go with the rest.
        FileError: a file that cannot be written, before any work.
        MissingDependencyError: no package announces topologies.
    """
    if name is None and (options.picture or options.curve):
        raise ArgumentError("name: --picture and --curve are of one topology; give its name")
    if options.json and (options.picture or options.curve or options.page):
        raise ArgumentError("json: goes to the terminal, not with --picture, --curve or --page")
    if name is not None and (options.family or options.page):
        raise ArgumentError(f"{'family' if options.family else 'page'}: not with the name of one topology, {name!r}")
    _check_files(options)
    entries = discover()
    if not entries:
        raise MissingDependencyError(
            f"topologies: no installed package announces any in the entry-point group {GROUP!r}; those of this one are "
            "announced when it is installed (again): make setup, or pip install -e ."
        )
    if name is None:
        _list(of_family(entries, options.family), options)
    else:
        entry = find(entries, name)
        try:
            _one(entry, options)
        except (FrepError, OSError):
            raise
        except Exception as error:  # another package's code
            raise FunctionError(f"topologies: {name!r} fails: {type(error).__name__}: {error}") from error


def _check_files(options: Options) -> None:
    from frep.io.atomic import check_target

    for option, path, suffixes in (
        ("picture", options.picture, (".png",)),
        ("curve", options.curve, (".png", ".csv")),
        ("page", options.page, (".html", ".htm")),
    ):
        if path is None:
            continue
        if path.suffix.lower() not in suffixes:
            raise FileError(f"{option}: {str(path)!r} has an unknown suffix; known: {', '.join(suffixes)}")
        check_target(path)


# --- all of them -----------------------------------------------------------------------------------------------------


def _list(entries: Mapping[str, Entry], options: Options) -> None:
    if options.page is not None:
        _page(entries, options.page)
    elif options.json:
        print(json.dumps(list(_of_each(entries, "facts", Entry.record).values()), indent=1, allow_nan=False))
    else:
        _tables(entries)


def _of_each(entries: Mapping[str, Entry], doing: str, what: Callable[[Entry], Any]) -> dict[str, Any]:
    """Something of each entry, by name, with a bar; what it is only shown for warns nobody.

    Warns:
        CatalogueWarning: another package's code fails for one entry; the rest is there all the same.
    """
    from frep.progress import progress

    found, failed = {}, {}
    with progress(doing, total=len(entries)) as advance, _silent():
        for entry in entries.values():
            try:
                found[entry.name] = what(entry)
            except (FileError, MissingDependencyError):
                raise  # no fault of the entry's
            except Exception as error:
                failed[entry.name] = error
            advance(1)
    for name, error in failed.items():
        warn(f"topologies: {name!r} fails and is left out: {error!r}", CatalogueWarning)
    return found


@contextmanager
def _silent() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _tables(entries: Mapping[str, Entry]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    # Names come from other packages: no markup is looked for in them.
    console = Console(width=None if sys.stdout.isatty() else 120, markup=False, highlight=False)
    rows = _of_each(entries, "facts", _row)
    shown = [entries[name] for name in rows]
    for family in dict.fromkeys(entry.family for entry in shown):
        members = [entry for entry in shown if entry.family == family]
        narrow = console.width < _WIDE
        table = Table(
            title=f"{family}: {len(members)}",
            title_justify="left",
            title_style="bold",
            box=box.SIMPLE_HEAD if narrow else box.HEAVY_HEAD,
            padding=(0, 1, 0, 0) if narrow else (0, 1),
        )
        columns = {heading: [rows[entry.name][heading] for entry in members] for heading in rows[members[0].name]}
        if narrow:
            del columns["source"]
        # What all have in common stands once, under the table.
        shared = {h: texts[0] for h, texts in columns.items() if len(texts) > 1 and len(set(texts)) == 1}
        columns = {h: texts for h, texts in columns.items() if h not in shared and any(texts)}
        table.add_column("name", no_wrap=True)
        for heading, texts in columns.items():
            words = " ".join([heading, *texts]).split()
            table.add_column(heading, overflow="fold", min_width=min(12, max(map(len, words))))
        for entry, *texts in zip(members, *columns.values(), strict=True):
            table.add_row(entry.name, *texts)
        console.print(table)
        for line in [f"{h}: {text}" for h, text in shared.items() if text] + _parameters_of(members):
            filled = textwrap.fill(line, console.width, initial_indent="  ", subsequent_indent="      ")
            console.print(filled, style="dim")
        console.print()
    console.print("pinch, full: width in cells that closes the channels, that fills the cell", style="dim")
    console.print("frep topologies NAME tells all of one, --page PATH.html draws all", style="dim")


def _parameters_of(members: Sequence[Entry]) -> list[str]:
    """A line for each parameter, with its default and range, and who takes it where not all do."""
    takers: dict[str, list[str]] = {}
    for entry in members:
        for p in entry.parameters:
            takers.setdefault(told(p), []).append(entry.name)
    lines = []
    for text, names in takers.items():
        others = [entry.name for entry in members if entry.name not in names]
        who = f"all but {', '.join(others)}" if len(others) < len(names) else ", ".join(names)
        lines.append(f"{text} [{who}]" if others else text)
    return lines


def _row(entry: Entry) -> dict[str, str]:
    facts = entry.facts
    wave = ("signed" if entry.signed else "unsigned") if entry.forms else ""
    return {
        "forms": ", ".join(entry.forms),
        "waveform": wave + (", congruent" if entry.complement_congruent else ""),
        "point group": facts.symmetry or "",
        "valence": _valences(entry),
        "pinch": _number(facts.pinch),
        "full": _number(facts.full),
        "source": entry.source,
    }


def _valences(entry: Entry) -> str:
    if len(entry.valences) > 4:
        return f"{entry.valences[0]} to {entry.valences[-1]}"
    return ", ".join(map(str, entry.valences))


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


# --- one -------------------------------------------------------------------------------------------------------------


def _one(entry: Entry, options: Options) -> None:
    if options.picture or options.curve:
        if not entry.forms:
            raise ArgumentError(f"name: {entry.name} has no form to draw or measure")
        if options.picture:
            with _silent():
                draw(entry, options.picture)
            print(f"wrote {options.picture}")
        if options.curve:
            write_curves(curves(entry), entry.name, options.curve)
            print(f"wrote {options.curve}")
        return
    if options.json:
        with _silent():
            measured = {form: [list(map(float, row)) for row in rows] for form, rows in curves(entry).items()}
            print(json.dumps({**entry.record(), "curves": measured}, indent=1, allow_nan=False))
        return
    print(entry)
    print("\n".join(f"{name:<11} {value}" for name, value in _fact_lines(entry)))
    _fraction_table(entry)


def _fact_lines(entry: Entry) -> list[tuple[str, str]]:
    with _silent():
        facts = entry.facts
        rows = [("symmetry", facts.symmetry)]
        if facts.range is not None:
            rows.append(("range", f"{facts.range[0]:.4g} to {facts.range[1]:.4g}"))
        if facts.pinch is not None:
            closes = (
                f"channels close at {facts.pinch:.3g} of the cell" if facts.pinch else "cells are closed from the start"
            )
            rows.append(("pinch", closes))
        if facts.full is not None:
            rows.append(("full", f"nothing is left open at {facts.full:.3g} of the cell"))
        if entry.period is not None:
            rows.append(("period", " x ".join(f"{p:.4g}" for p in entry.period) + " mm, of the sample below"))
    if entry.forms:
        form, width = entry.shown
        sample = "".join(f", {k}={v!r}" for k, v in entry.example.items()).lstrip(", ")
        rows.append(("sample", f"{entry.name}({sample}).{form}({width:.3g})"))
    return [(name, text) for name, text in rows if text]


def curves(entry: Entry, count: int = 9) -> Curves:
    """Volume fraction against width of every form, by form; see `Entry.curve`."""
    from frep.progress import progress

    with progress("volume fractions"), _silent():
        return {form: entry.curve(form, count) for form in entry.forms}


def _fraction_table(entry: Entry) -> None:
    measured = curves(entry)
    if not measured:
        return
    print("\nvolume fraction of the sample")
    for form, (widths, shares) in measured.items():
        unit = "" if FORMS[form] == "bias" and not _is_length(entry) else ", mm"
        print(f"  {form + ' ' + FORMS[form] + unit:<22}" + "".join(f"{round(w, 6) + 0.0:9.3g}" for w in widths))
        print(f"  {'':<22}" + "".join(f"{s:9.3f}" for s in shares))


def _is_length(entry: Entry) -> bool:
    """Whether a bias is in mm: a level of noise has none."""
    return entry.facts.full is not None and "twin" in entry.forms


def draw(entry: Entry, path: Path, size: tuple[int, int] = (1000, 750), cells: int = 48) -> None:
    """A picture of two periods each way, slender; one of structures whose period holds many cells.

    Args:
        entry: what to draw.
        path: the .png.
        size: pixels.
        cells: samples along a cell; a sixth of so many across a wall or beam, at least.
    """
    from frep.view import render

    form, width = entry.shown
    wide = entry.period is not None and float(entry.period.min()) > 1.5 * entry.size
    voxel = entry.size / cells
    if FORMS[form] != "bias":
        voxel = min(voxel, 6.0 * width / cells)
    mesh = (entry.solid(form, width) & entry.block(1 if wide else 2)).mesh(voxel=voxel, polish=True)
    render(mesh, path, size=size)


def write_curves(measured: Curves, title: str, path: Path) -> None:
    """Volume fractions into a .csv (form, argument, width, fraction) or a .png."""
    from frep.io.atomic import replacing

    with replacing(path) as temporary:
        if path.suffix.lower() == ".csv":
            rows = ["form,argument,width,fraction"]
            for form, (widths, shares) in measured.items():
                rows += [f"{form},{FORMS[form]},{w:.6g},{s:.6f}" for w, s in zip(widths, shares, strict=True)]
            temporary.write_text("\n".join(rows) + "\n")
        else:
            _plot_picture(measured, title).save(temporary, format="PNG", optimize=True)


# --- plots -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Plot:
    """Volume fraction from 0 to 1 against width, in pixels."""

    size: tuple[int, int]
    frame: tuple[float, float, float, float]
    low: float
    high: float

    @classmethod
    def of(cls, measured: Curves, size: tuple[int, int], margin: float) -> _Plot:
        widths = np.concatenate([w for w, _ in measured.values()] or [np.zeros(0)])
        low, high = (float(widths.min()), float(widths.max())) if len(widths) else (0.0, 1.0)
        low = min(low, 0.0)
        return cls(
            size, (margin, 0.4 * margin, size[0] - 0.4 * margin, size[1] - 0.8 * margin), low, max(high, low + 1e-9)
        )

    def points(self, widths: np.ndarray, shares: np.ndarray) -> list[tuple[float, float]]:
        left, top, right, bottom = self.frame
        x = left + (right - left) * (widths - self.low) / (self.high - self.low)
        y = bottom - (bottom - top) * shares
        return [(round(float(a), 1), round(float(b), 1)) for a, b in zip(x, y, strict=True)]

    def ticks(self) -> np.ndarray:
        """Round widths, a handful, zero among them."""
        wide = (self.high - self.low) / 4.0
        power = 10.0 ** np.floor(np.log10(wide))
        step = power * min((1.0, 2.0, 5.0, 10.0), key=lambda m: abs(m * power - wide))
        return step * np.arange(np.ceil(self.low / step), np.floor(self.high / step) + 1.0) + 0.0


def _plot_picture(measured: Curves, title: str) -> Any:
    from PIL import Image, ImageDraw, ImageFont

    plot = _Plot.of(measured, _PLOT, 70)
    image = Image.new("RGB", _PLOT, "white")
    pen = ImageDraw.Draw(image)
    font = ImageFont.load_default(15)
    left, top, right, bottom = plot.frame
    for k in range(5):
        y = bottom - (bottom - top) * k / 4
        pen.line([(left, y), (right, y)], fill="#d5dade")
        pen.text((left - 8, y), f"{k / 4:g}", fill="#2b3640", font=font, anchor="rm")
    for tick in plot.ticks():
        x = plot.points(np.array([tick]), np.zeros(1))[0][0]
        pen.line([(x, bottom), (x, bottom + 5)], fill="#2b3640")
        pen.text((x, bottom + 9), f"{tick:.3g}", fill="#2b3640", font=font, anchor="mt")
    pen.rectangle([left, top, right, bottom], outline="#2b3640")
    for k, (form, (widths, shares)) in enumerate(measured.items()):
        color = _COLORS[form]
        places = plot.points(widths, shares)
        pen.line(places, fill=color, width=3)
        for x, y in places:
            pen.ellipse([x - 3.5, y - 3.5, x + 3.5, y + 3.5], fill=color)
        pen.text((left + 12 + 150 * k, top - 5), f"{form} ({FORMS[form]})", fill=color, font=font, anchor="lb")
    pen.text(
        ((left + right) / 2, _PLOT[1] - 8),
        f"{title}: volume fraction against width in mm, or bias",
        fill="#2b3640",
        font=font,
        anchor="mb",
    )
    return image


def _plot_svg(measured: Curves, name: str) -> str:
    """A small plot as inline SVG."""
    plot = _Plot.of(measured, _SMALL, 34)
    left, top, right, bottom = plot.frame
    width, height = _SMALL
    told = html.escape(f"volume fraction of {name} against width or bias: {', '.join(measured)}")
    parts = [
        f'<svg viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img" aria-label="{told}">',
        f'<rect x="{left:g}" y="{top:g}" width="{right - left:g}" height="{bottom - top:g}" class="frame"/>',
    ]
    for k in range(5):
        y = bottom - (bottom - top) * k / 4
        parts.append(f'<line x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}" class="grid"/>')
    ticks = plot.ticks()
    places = plot.points(ticks, np.zeros(len(ticks)))
    parts += [
        f'<text x="{x}" y="{bottom + 13}" text-anchor="middle">{v:.3g}</text>'
        for v, (x, _) in zip(ticks, places, strict=True)
    ]
    parts += [f'<text x="{left - 4}" y="{y + 4}" text-anchor="end">{v}</text>' for v, y in ((0, bottom), (1, top))]
    for form, (widths, shares) in measured.items():
        path = " ".join(f"{x},{y}" for x, y in plot.points(widths, shares))
        parts.append(f'<polyline points="{path}" stroke="{_COLORS[form]}"/>')
    for k, form in enumerate(measured):
        parts.append(f'<text x="{left + 55 * k}" y="{height - 3}" fill="{_COLORS[form]}">{form}</text>')
    return "".join(parts) + "</svg>"


# --- the page --------------------------------------------------------------------------------------------------------

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #2b3640; margin: 2rem auto; max-width: 1180px; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; border-bottom: 1px solid #d5dade; }
article { display: grid; grid-template-columns: 360px 1fr 260px; gap: 1.2rem; padding: 1rem 0; border-bottom: 1px solid #e8ebee; }
article h3 { margin: 0 0 .3rem; font-size: 1.05rem; } article p { margin: 0 0 .4rem; } img { width: 100%; height: auto; }
.source { color: #67737d; } ul { margin: .2rem 0; padding-left: 1.1rem; } code { background: #f1f3f5; padding: 0 .2rem; }
dl { display: grid; grid-template-columns: auto 1fr; gap: 0 .7rem; margin: .4rem 0 0; } dt { color: #67737d; } dd { margin: 0; }
nav a { margin-right: .8rem; } svg text { font: 11px system-ui, sans-serif; } details { margin: .2rem 0; }
svg polyline { fill: none; stroke-width: 2; } .frame { fill: none; stroke: #8b959d; } .grid { stroke: #e1e5e8; }
@media (max-width: 900px) { article { grid-template-columns: 1fr; } }
"""


def _page(entries: Mapping[str, Entry], path: Path) -> None:
    from frep.io.atomic import replacing

    with tempfile.TemporaryDirectory() as folder:
        articles = _of_each(entries, "page", lambda entry: _article(entry, Path(folder)))
    sections: dict[str, list[str]] = {}
    for name, article in articles.items():
        sections.setdefault(entries[name].family, []).append(article)
    links, body = "", ""
    for k, (family, rows) in enumerate(sections.items()):
        # A number, since an id holds no spaces and "steady" is a family and a name.
        links += f'<a href="#family-{k}">{html.escape(family)} ({len(rows)})</a> '
        body += f'<section><h2 id="family-{k}">{html.escape(family)}</h2>{"".join(rows)}</section>'
    with replacing(path) as temporary:
        temporary.write_text(
            '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Topologies</title>'
            '<meta name="viewport" content="width=device-width">'
            f"<style>{_STYLE}</style></head><body><h1>Topologies</h1><p>Limits are in cells; the plots show the volume "
            f"fraction of the sample against width in mm, or bias.</p><nav>{links}</nav>{body}</body></html>\n",
            encoding="utf-8",
        )
    print(f"wrote {path} ({len(articles)} topologies, {path.stat().st_size / 1e6:.1f} MB)")


def _small(picture: Path) -> bytes:
    """A PNG in few colours, a third of the size."""
    from PIL import Image

    packed = io.BytesIO()
    Image.open(picture).convert("RGB").quantize(96).save(packed, format="PNG", optimize=True)
    return packed.getvalue()


def _article(entry: Entry, folder: Path) -> str:
    def text(value: str) -> str:
        return html.escape(value)

    picture, plot = "", ""
    if entry.forms:
        draw(entry, folder / "thumbnail.png", size=_THUMBNAIL, cells=20)
        data = base64.b64encode(_small(folder / "thumbnail.png")).decode("ascii")
        form, width = entry.shown
        seen = f"{entry.name}: {form}, {FORMS[form]} {width:.3g}"
        wide, high = _THUMBNAIL
        picture = f'<img alt="{text(seen)}" width="{wide}" height="{high}" src="data:image/png;base64,{data}">'
        plot = _plot_svg(curves(entry), entry.name)
    parameters = "".join(f"<li>{text(told(p))}</li>" for p in entry.parameters)
    facts = [("forms", ", ".join(entry.forms)), ("waveform", _row(entry)["waveform"]), ("valences", _valences(entry))]
    facts += [row for row in _fact_lines(entry) if row[0] not in ("sample", "period")]
    rows = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in facts if value)
    note = f"<p>{text(entry.note)}</p>" if entry.note else ""
    source = f'<p class="source">{text(entry.source)}</p>' if entry.source else ""
    call = f"<p><code>{text(entry.call)}</code></p>" if entry.call else ""
    return (
        f'<article id="{text(entry.name)}"><div>{picture}</div><div><h3>{text(entry.name)}</h3><p>{text(entry.summary)}</p>'
        f"{source}{note}{call}<details><summary>parameters ({len(entry.parameters)})</summary><ul>{parameters}</ul></details>"
        f"<dl>{rows}</dl></div><div>{plot}</div></article>"
    )
