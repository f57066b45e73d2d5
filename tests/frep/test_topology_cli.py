"""`frep topologies`: lists, describes, draws and measures what a package announces, of which the kernel knows nothing."""

from __future__ import annotations

import base64
import csv
import functools
import importlib
import io
import json
import re
import sys
import textwrap
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

import frep.catalogue
import frep.topology_cli
from frep.catalogue import GROUP
from frep.cli import main

MINE = """
    import frep
    from frep.catalogue import Entry, EntryParameter, Facts

    class Layers:
        def __init__(self, cell=4.0):
            self.cell = cell

        def sheet(self, thickness):
            return frep.Solid(abs(frep.mod(frep.coordinates()[2], self.cell) - 0.5 * self.cell) - 0.5 * thickness)

        def twin(self, thickness):
            return ~self.sheet(thickness)

    class Bare:
        cell = 3.0

    CELL = EntryParameter("cell", 4.0, 0, unit="mm", help="how far <apart>", above=True)
    ENTRIES = [
        Entry("layers_for_tests", "tests", "Layers across z & more.", Layers, (CELL,), source="nobody 2001", call="from mine import Layers; Layers(4)", facts_of=lambda _: Facts(pinch=0.0, full=1.0, symmetry="4/mmm")),
        Entry("bare_for_tests", "tests", "Nothing.", Bare, (CELL, EntryParameter("own", 1.0, 0, 2))),
    ]
"""
NAME = "layers_for_tests"


@pytest.fixture(autouse=True)
def site(tmp_path, monkeypatch):
    """A package as an installer leaves it, on the path, and an empty folder to work in."""
    packages, work = tmp_path / "packages", tmp_path / "work"
    info = packages / "mine-1.0.dist-info"
    info.mkdir(parents=True)
    work.mkdir()
    (packages / "topology_cli_mine.py").write_text(textwrap.dedent(MINE))
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\nmine = topology_cli_mine:ENTRIES\n")
    monkeypatch.syspath_prepend(packages)
    # Another test's module of this name may be loaded still.
    monkeypatch.delitem(sys.modules, "topology_cli_mine", raising=False)
    importlib.invalidate_caches()
    monkeypatch.chdir(work)
    return work


def fails(capsys, arguments: list[str]) -> str:
    assert main(["topologies", *arguments]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert len(told.err.splitlines()) == 1
    assert told.err.startswith("frep: error: ")
    return told.err


def test_a_family_is_listed(capsys):
    assert main(["topologies", "--family", "tests"]) == 0
    told = capsys.readouterr().out
    row = next(line for line in told.splitlines() if NAME in line)
    for word in ("sheet, twin", "unsigned", "4/mmm", " 0 ", " 1 ", "nobody 2001"):
        assert word in row
    assert "  cell = 4 mm (more than 0 mm): how far <apart>\n" in told
    assert "  own = 1 (0 to 2) [bare_for_tests]\n" in told


def test_lists_are_plain_text_in_a_pipe_and_fit_a_narrow_terminal(capsys, monkeypatch):
    assert main(["topologies"]) == 0
    told = capsys.readouterr().out
    assert "\x1b" not in told
    assert max(map(len, told.splitlines())) <= 120
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "xterm")
    assert main(["topologies"]) == 0
    told = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out)
    assert max(map(len, told.splitlines())) <= 60
    # Words are whole.
    assert {"unsigned", "valence", "layers_for_tests", "pinch", "full", "4/mmm"} <= set(told.split())


def test_nothing_is_sampled_for_a_list(monkeypatch, capsys):
    """What the topologies of this package are is written down; of another package's it is found out."""
    made = []
    real = frep.catalogue.Entry.sample.func

    def counted(self):
        made.append(self.name)
        return real(self)

    sample = functools.cached_property(counted)
    sample.__set_name__(frep.catalogue.Entry, "sample")
    monkeypatch.setattr(frep.catalogue.Entry, "sample", sample)
    assert main(["topologies"]) == 0
    assert main(["topologies", "--json"]) == 0
    assert len(capsys.readouterr().out) > 10_000
    assert set(made) <= {NAME, "bare_for_tests"}


def test_text_of_another_package_is_no_markup(site, capsys):
    module = site.parent / "packages" / "topology_cli_mine.py"
    entry = 'Entry("odd_for_tests", "[red]odd", "Odd.", Bare, source="[bold]x[/nonsense] <b>")'
    module.write_text(textwrap.dedent(MINE) + f"ENTRIES = [{entry}]\n")
    assert main(["topologies", "--family", "[red]odd"]) == 0
    told = capsys.readouterr().out
    assert "[bold]x[/nonsense] <b>" in told
    assert "[red]odd: 1" in told
    assert main(["topologies", "--family", "[red]odd", "--page", "a.html"]) == 0
    assert "&lt;b&gt;" in (site / "a.html").read_text()


BROKEN = """
    def fails(*_, **__):
        raise ZeroDivisionError("deep inside")

    ENTRIES += [Entry("broken_for_tests", "tests", "Fails.", fails, (CELL,))]
"""


def test_an_entry_that_fails_does_not_take_the_others_along(site, capsys):
    module = site.parent / "packages" / "topology_cli_mine.py"
    module.write_text(textwrap.dedent(MINE) + textwrap.dedent(BROKEN))
    for more in ([], ["--json"], ["--page", "a.html"]):
        assert main(["topologies", "--family", "tests", *more]) == 0
        told = capsys.readouterr()
        assert told.err.count("frep: warning:") == 1
        assert "'broken_for_tests' fails and is left out: ZeroDivisionError('deep inside')" in told.err
        if more == ["--json"]:
            assert [row["name"] for row in json.loads(told.out)] == [NAME, "bare_for_tests"]
    assert f'id="{NAME}"' in (site / "a.html").read_text()
    for more in ([], ["--json"], ["--picture", "a.png"], ["--curve", "a.csv"]):
        assert main(["topologies", "broken_for_tests", *more]) == 1
        told = capsys.readouterr().err
        assert told.splitlines()[-1].startswith("frep: error: topologies: 'broken_for_tests' fails: ZeroDivisionError")


def test_one_is_told_in_whole(capsys):
    assert main(["topologies", NAME]) == 0
    told = capsys.readouterr().out
    for word in (
        "Layers across z",
        "nobody 2001",
        "from mine import",
        "cell = 4 mm (more than 0 mm)",
        "closed from the start",
    ):
        assert word in told
    widths, shares = (np.array(line.split()[-9:], float) for line in told.splitlines()[-4:-2])
    np.testing.assert_allclose(shares, widths / 4.0, atol=3e-3)


def test_json_is_the_same_in_numbers(capsys):
    assert main(["topologies", "--family", "tests", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == [NAME, "bare_for_tests"]
    assert main(["topologies", NAME, "--json"]) == 0
    one = json.loads(capsys.readouterr().out)
    curves = one.pop("curves")
    assert one == rows[0]
    assert one["parameters"] == [
        {
            "name": "cell",
            "default": 4.0,
            "required": False,
            "unit": "mm",
            "range": "more than 0 mm",
            "low": 0,
            "high": None,
            "above": True,
            "of_cell": False,
            "choices": [],
            "meaning": "how far <apart>",
        }
    ]
    np.testing.assert_allclose(curves["sheet"][1], 1.0 - np.array(curves["twin"][1]), atol=1e-6)


def test_a_picture_shows_something(site):
    assert main(["topologies", NAME, "--picture", "a.png"]) == 0
    assert np.asarray(Image.open("a.png").convert("L")).std() > 10


def test_a_curve_as_numbers_and_as_a_picture(site):
    assert main(["topologies", NAME, "--curve", "a.csv"]) == 0
    with open("a.csv") as file:
        rows = list(csv.DictReader(file))
    assert {row["form"] for row in rows} == {"sheet", "twin"}
    for row in rows:
        share = float(row["width"]) / 4.0
        assert float(row["fraction"]) == pytest.approx(share if row["form"] == "sheet" else 1.0 - share, abs=3e-3)
    assert main(["topologies", NAME, "--curve", "a.png"]) == 0
    picture = np.asarray(Image.open("a.png").convert("RGB")).astype(int)
    for color in ((0x2F, 0x6F, 0x9F), (0x7A, 0x4F, 0x9A)):
        assert (np.abs(picture - color).sum(axis=2) < 10).sum() > 500


class _Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "rect", "line", "polyline"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("meta", "img", "rect", "line", "polyline"):
            assert self.open.pop() == tag


def test_the_page_is_one_file_with_everything_in_it(site, capsys):
    assert main(["topologies", "--family", "tests", "--page", "a.html"]) == 0
    text = (site / "a.html").read_text()
    page = _Page(text)
    assert not page.open
    assert [a["id"] for tag, a in page.tags if tag == "article"] == [NAME, "bare_for_tests"]
    pictures = [a["src"] or "" for tag, a in page.tags if tag == "img"]
    assert len(pictures) == 1
    assert pictures[0].startswith("data:image/png;base64,")
    drawn = Image.open(io.BytesIO(base64.b64decode(pictures[0].partition(",")[2])))
    assert np.asarray(drawn.convert("L")).std() > 10
    assert len([tag for tag, _ in page.tags if tag == "polyline"]) == 2
    assert "how far &lt;apart&gt;" in text
    assert "z &amp; more" in text
    ids = [a["id"] for _, a in page.tags if "id" in a]
    assert len(ids) == len(set(ids))
    assert {a["href"] for tag, a in page.tags if tag == "a"} <= {f"#{i}" for i in ids}
    assert not any(" " in i for i in ids if i)
    alternatives = [a.get("alt") or a.get("aria-label") or "" for tag, a in page.tags if tag in ("img", "svg")]
    assert len(alternatives) == 2
    assert all(NAME in text and "sheet" in text for text in alternatives)
    # Nothing is fetched from anywhere.
    assert not re.search(r"""(?:src|href)=["'](?!data:|#)""", text)
    assert "2 topologies" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [(frep.errors.FileError("draw: no space"), 1, "no space"), (KeyboardInterrupt(), 130, "interrupted")],
)
def test_a_page_that_fails_or_is_interrupted_leaves_the_old_one(site, monkeypatch, capsys, error, code, told):
    (site / "a.html").write_text("old")

    def broken(*_, **__):
        raise error

    monkeypatch.setattr(frep.topology_cli, "draw", broken)
    assert main(["topologies", "--family", "tests", "--page", "a.html"]) == code
    assert told in capsys.readouterr().err
    assert (site / "a.html").read_text() == "old"
    assert [path.name for path in site.iterdir()] == ["a.html"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["layers_for_test"], "did you mean 'layers_for_tests'"),
        (["--family", "test"], "did you mean 'tests'"),
        (["--picture", "a.png"], "give its name"),
        (["--curve", "a.csv"], "give its name"),
        ([NAME, "--family", "tests"], "family"),
        ([NAME, "--page", "a.html"], "page"),
        ([NAME, "--json", "--picture", "a.png"], "json"),
        (["--json", "--page", "a.html"], "json"),
        ([NAME, "--picture", "a.jpg"], ".png"),
        ([NAME, "--curve", "a.txt"], ".csv"),
        (["--page", "a.txt"], ".html"),
        ([NAME, "--picture", "nowhere/a.png"], "folder"),
        (["bare_for_tests", "--picture", "a.png"], "no form"),
    ],
)
def test_bad_requests_are_one_line(site, capsys, arguments, told):
    assert told in fails(capsys, arguments)
    assert not list(site.iterdir())


def test_without_announcements_it_says_what_to_do(capsys, monkeypatch):
    monkeypatch.setattr(frep.topology_cli, "discover", dict)
    assert "make setup" in fails(capsys, [])
