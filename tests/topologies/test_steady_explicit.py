"""Lattices written out as balls and beams: the same body, the same integrals, and the same commands as the model they came from."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from frep.cli import main
from frep.errors import ArgumentError, FileError
from frep.lattice_cli import GROUP
from topologies.steady import Screw, SteadyLattice, Swirl, Translation
from topologies.steady_files import read_json, read_text, write_text
from topologies.steady_program import program_text

ROOT = Path(__file__).resolve().parents[2]
GRID = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]


def bent(radius=0.06):
    return SteadyLattice(
        [(0, 0, 0)],
        radius,
        GRID,
        u=Translation((1, 0, 0)),
        v=Translation((0, 1, 0)),
        w=Swirl(0.97, center=(-10, 3, 2), angle=0.07, axis=(0.2, -1, 0.1)),
        counts=(4, 3, 6),
    )


def wheel():
    """Two balls a cluster, wires that close round it, and balls that have no beam."""
    return SteadyLattice(
        [(10, 0, 0), (11, 0.5, 0.5), (13, 0, 0)],
        [0.05, 0.06, 0.2],
        [(0, 1, 0, 0, 0), (1, 0, 1, 0, 0), (1, 0, -15, 0, 0), (0, 0, 0, 1, 0)],
        u=Screw(math.tau / 16),
        v=Translation((0, 0, 2)),
        counts=(16, 3),
    )


def written(lattice, path):
    write_text(lattice, path)
    return read_text(path)


@pytest.fixture(params=[bent, wheel], ids=["bent", "wheel"])
def pair(request, tmp_path):
    lattice = request.param()
    return lattice, written(lattice, tmp_path / "a.txt")


def test_integrals_are_those_of_the_model(pair):
    model, explicit = pair
    assert explicit.clean().is_clean
    assert explicit.volume() == pytest.approx(model.volume(), rel=1e-12)
    assert explicit.area() == pytest.approx(model.area(), rel=1e-12)
    assert np.allclose(explicit.centroid(), model.centroid(), rtol=0, atol=1e-11)
    assert np.allclose(explicit.inertia(), model.inertia(), rtol=1e-10, atol=1e-9)


def test_it_is_the_same_body(pair):
    """Balls without beams among them."""
    model, explicit = pair
    low, high = model.bounds
    where = np.random.default_rng(0).uniform(low, high, (2000, 3))
    assert np.allclose(explicit.solid().field(where), model.solid().field(where), atol=1e-9)
    assert np.all(explicit.solid().field(explicit.nodes) < 0)


def test_it_is_written_as_it_was_read(pair, tmp_path):
    model, explicit = pair
    explicit.save(tmp_path / "b.txt")
    assert (tmp_path / "b.txt").read_bytes() == (tmp_path / "a.txt").read_bytes()
    explicit.save(tmp_path / "b.json")
    again = read_json(tmp_path / "b.json")
    assert (again.n_nodes, again.n_beams) == (model.n_nodes, model.n_beams)
    assert np.array_equal(again.nodes, explicit.nodes)
    assert {frozenset(rack) for rack in again.racks[:, :2].tolist()} == {frozenset(e) for e in explicit.edges.tolist()}
    with pytest.raises(FileError, match="suffix"):
        explicit.save(tmp_path / "b.foo")


def test_beams_are_listed_with_their_balls(pair):
    model, explicit = pair
    rows = np.concatenate(list(explicit.beams(7)))
    assert all(len(block) <= 7 for block in explicit.beams(7))
    assert rows[:, 3].tolist() == list(range(model.n_beams))
    ends, radii = explicit.ends(rows)
    theirs, sizes = model.ends(np.concatenate(list(model.beams())))
    assert np.allclose(ends, theirs, rtol=0, atol=1e-12)
    assert np.allclose(radii, sizes, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "overlap", "told"),
    [
        # beams that cross at one height, and 0.15 apart
        ("balls 4\n0 0 0 .1\n2 2 0 .1\n0 2 0 .1\n2 0 0 .1\nbeams 2\n0 1\n2 3\n", 0.2, "from ball 0 to ball 1"),
        ("balls 4\n0 0 0 .1\n2 2 0 .1\n0 2 .15 .1\n2 0 .15 .1\nbeams 2\n0 1\n2 3\n", 0.05, "from ball 2 to ball 3"),
        # a ball without beams in a beam
        ("balls 3\n0 0 0 .1\n2 0 0 .1\n1 .25 0 .2\nbeams 1\n0 1\n", 0.05, "and ball 2 overlap"),
        # a ball within its neighbour
        ("balls 2\n0 0 0 1\n.5 0 0 .2\nbeams 1\n0 1\n", 0.7, "ball 1 lies inside ball 0"),
        # two beams at an angle of 0.1 rad
        (
            f"balls 3\n0 0 0 .2\n2 0 0 .2\n{2 * math.cos(0.1)} {2 * math.sin(0.1)} 0 .2\nbeams 2\n0 1\n0 2\n",
            None,
            "at ball",
        ),
    ],
)
def test_overlaps_are_found_and_named(tmp_path, text, overlap, told):
    (tmp_path / "a.txt").write_text(text)
    lattice = read_text(tmp_path / "a.txt")
    report = lattice.clean()
    assert not report.is_clean
    assert told in report.message
    if overlap is not None:
        assert report.overlap == pytest.approx(overlap, rel=1e-6)
    with pytest.raises(ArgumentError, match="by sampling"):
        lattice.volume()


def test_beams_that_only_come_near_are_clean(tmp_path):
    (tmp_path / "a.txt").write_text("balls 4\n0 0 0 .1\n2 2 0 .1\n0 2 .21 .1\n2 0 .21 .1\nbeams 2\n0 1\n2 3\n")
    length = math.sqrt(8)
    each = math.pi * 0.01 * length + 4 / 3 * math.pi * 0.001
    assert read_text(tmp_path / "a.txt").volume() == pytest.approx(2 * each, rel=1e-12)


def test_a_beam_given_twice_counts_once(tmp_path):
    text = "balls 2\n0 0 0 .1\n1 0 0 .1\nbeams 2\n0 1\n1 0\n"
    (tmp_path / "a.txt").write_text(text)
    lattice = read_text(tmp_path / "a.txt")
    assert lattice.volume() == pytest.approx(0.0356047167, rel=1e-8)
    assert lattice.model().n_beams == 1


def test_of_nothing_there_is_no_body(tmp_path):
    (tmp_path / "a.txt").write_text("balls 0\nbeams 0\n")
    lattice = read_text(tmp_path / "a.txt")
    assert lattice.clean().is_clean
    assert (lattice.volume(), lattice.area()) == (0.0, 0.0)
    for call in (lattice.solid, lattice.centroid):
        with pytest.raises(ArgumentError, match="at least one ball"):
            call()
    with pytest.raises(ArgumentError, match="one cluster"):
        lattice.region((0, 0, 0), (2, 1, 1))


@pytest.mark.parametrize(
    ("counts", "u", "v", "w", "racks"),
    [
        (
            (10, 2, 3),
            Translation((1.027, 0.046, -0.168)),
            Swirl(0.9867, (0, 75.34, 0), 0.281, "y"),
            Swirl(1.0282, (0, 0, -35.4), -0.265),
            [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 1, 0, 0, 0), (1, 0, 1, 0, 0)],
        ),
        (
            (12, 4, 8),
            Translation((1.246, -0.0056, -0.101)),
            Swirl(0.98274, (0, 57.95, 0), -0.4172, "y"),
            Swirl(0.97123, (0, 0, 34.76), 0.15285),
            GRID[:1],
        ),
    ],
)
def test_tangles_of_small_lattices_are_found_wherever_they_are(tmp_path, counts, u, v, w, racks):
    """Written out, every pair of beams is looked at; the model must not miss what that finds."""
    model = SteadyLattice([(0, 0, 0), (0.5, 0.45, 0.4)], [0.02, 0.03], racks, u, v, w, counts)
    explicit = written(model, tmp_path / "a.txt")
    assert not explicit.clean().is_clean
    assert not model.clean().is_clean
    assert model.clean().overlap == pytest.approx(explicit.clean().overlap, rel=1e-3)


# --- the command ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder with a lattice as a program, a model and text; the readers announced as pyproject.toml announces them."""
    group = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"][GROUP]
    info = tmp_path / "announced-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: announced\nVersion: 1.0\n")
    lines = [f"[{GROUP}]", *(f"{suffix} = {reader}" for suffix, reader in group.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    lattice = bent()
    (tmp_path / "l.py").write_text(program_text(lattice))
    lattice.save("l.json")
    lattice.save("l.txt")
    return lattice


def told(capsys, *arguments):
    assert main(["lattice", *arguments]) == 0
    return capsys.readouterr().out


def test_info_of_a_file_is_that_of_the_program(files, capsys):
    rows = told(capsys, "l.py", "info")
    assert told(capsys, "l.json", "info") == rows
    assert told(capsys, "l.json") == rows
    # of the clusters text knows nothing
    strip = [row for row in rows.splitlines() if not row.startswith(("clusters", "racks"))]
    text = [row for row in told(capsys, "l.txt", "info").splitlines() if not row.startswith(("clusters", "racks"))]
    assert text == strip


def test_files_are_exported_as_they_were(files, capsys):
    told(capsys, "l.json", "export", "-o", "again.json")
    told(capsys, "l.json", "export", "-o", "again.txt")
    told(capsys, "l.txt", "export", "-o", "once_more.txt")
    assert Path("again.json").read_bytes() == Path("l.json").read_bytes()
    assert Path("again.txt").read_bytes() == Path("once_more.txt").read_bytes() == Path("l.txt").read_bytes()
    told(capsys, "l.txt", "export", "-o", "text.py")
    assert f"{files.n_beams:,}" in told(capsys, "text.py", "info")


def test_beams_pictures_and_meshes_of_files(files, capsys):
    roi = ("--roi", "1,1,1:2,2,2")
    assert told(capsys, "l.json", "beams", *roi) == told(capsys, "l.py", "beams", *roi)
    assert len(told(capsys, "l.txt", "beams").splitlines()) == 1 + files.n_beams
    told(capsys, "l.txt", "render", "-o", "a.png")
    for name in ("l.json", "l.txt"):
        told(capsys, name, "mesh", "--box=-0.5,-0.5,-0.5:1,1,1", "--voxel", "0.1", "-o", f"{name}.stl")
    assert Path("l.json.stl").stat().st_size == Path("l.txt.stl").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["l.json", "--param", "twist=1"], ["param", "twist", "l.json"]),
        (["gone.json"], ["gone.json"]),
        (["gone.txt"], ["gone.txt"]),
        (["l.txt", "export", "-o", "l.txt"], ["the program itself"]),
        (["l.txt", "mesh", "--roi", "0,0,0:2,1,1", "-o", "a.stl"], ["roi", "0,0,0:1,1,1"]),
        (["bad.json"], ["bad.json", "no steady lattice"]),
    ],
)
def test_what_is_wrong_with_a_file_is_told_in_a_line(files, capsys, arguments, words):
    Path("bad.json").write_text("{}")
    assert main(["lattice", *arguments]) == 1
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert all(word in error for word in words)


FILTERED = """
import frep
from topologies.steady import SteadyLattice, Translation

size = frep.parameter(2.6, 0.5, 9, "mm")
racks = [(0, 0, 1, 0, 0), (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)]
steps = [Translation(s) for s in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
lattice = SteadyLattice([(0, 0, 0)], 0.1, racks, *steps, (6, 6, 6)).filtered(frep.sphere((2, 2, 2), size))
"""


def test_a_program_may_define_a_filtered_lattice(files, capsys):
    Path("f.py").write_text(FILTERED)
    index = np.indices((6, 6, 6)).reshape(3, -1).T
    kept = {tuple(p) for p in index[np.linalg.norm(index - 2, axis=1) < 2.6].tolist()}
    steps = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    pairs = [(p, q) for p in kept for q in kept if tuple(b - a for a, b in zip(p, q, strict=True)) in steps]
    rows = dict(line.split("  ", 1) for line in told(capsys, "f.py").splitlines())
    rows = {name.strip(): value.strip() for name, value in rows.items()}
    assert (rows["beams"], rows["balls"]) == (f"{len(pairs)}", f"{len(kept)}")
    within = [(p, q) for p, q in pairs if max(q) < 3]
    assert len(told(capsys, "f.py", "beams", "--roi", "0,0,0:3,3,3").splitlines()) == 1 + len(within)
    told(capsys, "f.py", "export", "-o", "f.txt")
    text = read_text("f.txt")
    assert {tuple(p) for p in text.nodes.round().astype(int).tolist()} == kept
    assert len(text.edges) == len(pairs)
    assert rows["volume, mm3"] == f"{text.volume():,.6g}"
    told(capsys, "f.py", "mesh", "--roi", "1,1,1:2,2,2", "--voxel", "0.1", "-o", "f.stl")
    assert main(["lattice", "f.py", "export", "-o", "f.json"]) == 1
    assert ".txt" in capsys.readouterr().err
    assert main(["lattice", "f.py", "--param", "size=0.5", "info"]) == 0
    assert main(["lattice", "f.py", "--param", "size=0.5", "mesh", "-o", "f.stl"]) == 1
    assert "no beam" in capsys.readouterr().err


def test_a_picture_of_too_many_beams_is_refused(files, capsys, monkeypatch):
    monkeypatch.setattr("frep.lattice_cli.DRAWN", 100)
    assert main(["lattice", "l.txt", "render", "-o", "a.png"]) == 1
    assert "100" in capsys.readouterr().err


def test_where_no_package_reads_it_the_command_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("frep.lattice_cli.GROUP", "frep.lattices_of_nobody")
    Path("l.json").write_text("{}")
    assert main(["lattice", "l.json"]) == 1
    assert "no installed package reads" in capsys.readouterr().err
