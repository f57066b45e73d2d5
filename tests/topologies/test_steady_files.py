"""Steady lattices on paper: as JSON and as a program bit for bit, as balls and beams the same solid; and their display curves."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from frep.cli import main
from frep.design import declared_parameters, load_design, run_script
from frep.errors import ArgumentError, ArgumentTypeError, FileError, TooLargeError
from topologies import beams
from topologies.steady import Screw, SteadyLattice, Swirl, Translation
from topologies.steady_curves import MOST_POINTS, iso_curves, outline
from topologies.steady_files import ball_numbers, read_json, read_text, save, write_json, write_text
from topologies.steady_program import program_text, rack_between

GALLERY = sorted((Path(__file__).resolve().parents[2] / "gallery" / "lattices").glob("[a-z]*.py"))

numbers = st.floats(-20, 20)
points = st.tuples(numbers, numbers, numbers)
axes = st.sampled_from(["x", "y", "z", (1, -1, 0), (0.1, -2.0, 0.3)])
similarities = st.one_of(
    st.builds(Translation, points),
    st.builds(Screw, st.floats(-4, 4), axes, points, numbers),
    st.builds(Swirl, st.floats(0.8, 1.25), points, st.floats(-4, 4), axes),
)
powers = st.builds(lambda s, t: s.power(t), similarities, st.floats(-1.5, 1.5))


@st.composite
def lattices(draw):
    n = draw(st.integers(1, 3))
    racks = draw(st.lists(st.tuples(*[st.integers(0, n - 1)] * 2, *[st.integers(-2, 2)] * 3), max_size=4, unique=True))
    whole = draw(st.tuples(*[st.integers(1, 4)] * 3))
    start = draw(st.tuples(*[st.integers(-3, 3)] * 3))
    try:
        lattice = SteadyLattice(
            draw(st.lists(points, min_size=n, max_size=n)),
            draw(st.lists(st.floats(1e-3, 2), min_size=n, max_size=n)),
            racks,
            *(draw(st.one_of(similarities, powers)) for _ in range(3)),
            counts=whole,
            start=start,
        )
    except ArgumentError:
        reject()
    if draw(st.booleans()):
        first = [draw(st.integers(0, c - 1)) for c in whole]
        lattice = lattice.region(
            np.add(start, first), [draw(st.integers(1, c - f)) for c, f in zip(whole, first, strict=True)]
        )
    return lattice


def bits(lattice) -> list[bytes]:
    """All numbers of a lattice."""
    found = [np.asarray(getattr(lattice, name)) for name in ("nodes", "radii", "racks", "counts", "start")]
    for s in lattice.skeleton.directions:
        found += [np.array([s.log_scale, s.angle]), s.axis, s.velocity]
    return [array.tobytes() for array in found]


def grid(**changes) -> SteadyLattice:
    given = {
        "nodes": [(0, 0, 0), (0.5, 0.5, 0.5)],
        "radii": [0.1, 0.15],
        "racks": [(0, 0, 1, 0, 0), (0, 1, 0, 0, 0), (1, 0, 1, -1, 1)],
        "u": Translation((1, 0, 0)),
        "v": Screw(0.1, "z", (-8, 0, 0), 0.05),
        "w": Swirl(1.05, (0, -20, 0), 0.05, "x"),
        "counts": (4, 3, 5),
    }
    return SteadyLattice(**{**given, **changes})


# The model


@given(lattices())
def test_json_gives_the_same_lattice_bit_for_bit(tmp_path_factory, lattice):
    path = tmp_path_factory.mktemp("j") / "a.json"
    write_json(lattice, path)
    assert bits(read_json(path)) == bits(lattice)


@given(lattices())
def test_a_program_builds_the_same_lattice_bit_for_bit(lattice):
    space: dict = {}
    exec(program_text(lattice), space)
    assert bits(space["lattice"]) == bits(lattice)


def test_a_program_is_readable():
    """Similarities as the user spells them, one row a line, and only what is used is imported."""
    text = program_text(grid())
    assert "u = Translation((1.0, 0.0, 0.0))\n" in text
    assert "from topologies.steady import Screw, SteadyLattice, Swirl, Translation\n" in text
    assert "    (1, 0, 1, -1, 1),\n" in text
    same = Translation((1, 0, 0))
    assert "import SteadyLattice, Translation\n" in program_text(grid(u=same, v=same, w=same))


def test_a_program_is_a_lattice_program(tmp_path):
    save(grid(), tmp_path / "a.py")
    assert bits(run_script(tmp_path / "a.py")["lattice"]) == bits(grid())


def test_the_rack_of_two_clicked_balls_joins_them():
    rack = rack_between((2, 1, 0, 0), (3, 0, 1, 1))
    lattice = grid(racks=[rack])
    ends, _ = lattice.ends([(2, 1, 0, 0)])
    assert np.array_equal(ends[0, 0], lattice.balls(2, 1, 0)[0][0])
    assert np.array_equal(ends[0, 1], lattice.balls(3, 0, 1)[0][1])
    for bad in ((1, 2, 3), (1.5, 0, 0, 0), "abcd", (3, 0, 1, 1)):
        with pytest.raises(ArgumentError):
            rack_between(bad, (3, 0, 1, 1))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"format": "other"}, "no steady lattice"),
        ({"version": 2}, "version 2"),
        ({"version": None}, "version"),
        ({"unit": "inch"}, "unit"),
        ({"nodes": None}, "nodes"),
        ({"nodes": [[0, 0]]}, "nodes"),
        ({"radii": [1, -1]}, "radii"),
        ({"radii": "a"}, "radii"),
        ({"racks": [[0, 9, 0, 0, 1]]}, "racks"),
        ({"racks": [[0, 0, 0.5, 0, 1]]}, "whole"),
        ({"counts": [1, 1]}, "counts"),
        ({"counts": [0, 1, 1]}, "counts"),
        ({"start": 3}, "holds no lattice"),
        ({"u": {}}, "log_scale"),
        ({"u": 1}, "holds no lattice"),
        ({"u": {"log_scale": 0, "angle": 0, "axis": [0, 0, 2], "velocity": [0, 0, 0]}}, "axis"),
        ({"u": {"log_scale": 0, "angle": 0, "axis": [0, 0, 1], "velocity": [0, 0, 0], "x": 1}}, "x"),
        ({"w": "gone"}, "'w'"),
    ],
)
def test_bad_models_are_refused_by_name(tmp_path, change, told):
    write_json(grid(), tmp_path / "a.json")
    model = {**json.loads((tmp_path / "a.json").read_text()), **change}
    if change == {"w": "gone"}:
        del model["w"]
    (tmp_path / "a.json").write_text(json.dumps(model))
    with pytest.raises(FileError, match=told) as raised:
        read_json(tmp_path / "a.json")
    assert "a.json" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "told"), [("{\n\n", "line 3"), ("[1]", "no steady"), ("", "line 1"), ("\udcff", "JSON")]
)
def test_files_that_are_no_json(tmp_path, text, told):
    (tmp_path / "a.json").write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(FileError, match=told):
        read_json(tmp_path / "a.json")
    with pytest.raises(FileError, match="nowhere"):
        read_json(tmp_path / "nowhere.json")


# Balls and beams


@given(lattices())
def test_text_holds_every_ball_and_beam_where_it_is(tmp_path_factory, lattice):
    path = tmp_path_factory.mktemp("t") / "a.txt"
    write_text(lattice, path)
    read = read_text(path)
    assert (len(read.nodes), len(read.radii), len(read.edges)) == (lattice.n_nodes, lattice.n_nodes, lattice.n_beams)
    index = np.indices(lattice.counts).reshape(3, -1) + np.reshape(lattice.start, (3, 1))
    centers, radii = lattice.balls(*index)
    assert np.allclose(read.nodes, centers.reshape(-1, 3), rtol=1e-13, atol=1e-12)
    assert np.allclose(read.radii, radii.ravel(), rtol=1e-12)
    for block in lattice.beams():
        ends, radii = lattice.ends(block)
        pairs = ball_numbers(lattice, block)
        assert np.allclose(read.nodes[pairs], ends, rtol=1e-12, atol=1e-12)
        assert np.allclose(read.radii[pairs], radii, rtol=1e-12)
        assert {tuple(p) for p in pairs} <= {tuple(p) for p in read.edges}


def test_text_is_the_same_solid(tmp_path):
    lattice = grid()
    write_text(lattice, tmp_path / "a.txt")
    read = read_text(tmp_path / "a.txt")
    explicit = beams.graph(read.nodes, read.edges).thicken(2 * read.radii)
    low, high = lattice.bounds
    where = np.random.default_rng(0).uniform(low, high, (2000, 3))
    assert np.allclose(explicit.field(where), lattice.solid().field(where), atol=1e-4)


def test_text_of_a_region_is_that_part_of_the_whole(tmp_path):
    """Blocks of the whole are larger than a chunk of lines; balls are numbered within the region."""
    lattice = grid(counts=(40, 30, 30))
    write_text(lattice, tmp_path / "a.txt")
    write_text(lattice.region((3, 2, 1), (2, 2, 2)), tmp_path / "b.txt")
    whole, part = read_text(tmp_path / "a.txt"), read_text(tmp_path / "b.txt")
    assert len(whole.nodes) == 72_000
    assert len(whole.edges) == lattice.n_beams == len(np.unique(whole.edges, axis=0))
    own = {tuple(np.round(row, 9)) for row in np.concatenate([whole.nodes, whole.radii[:, None]], axis=1)}
    assert {tuple(np.round(row, 9)) for row in np.concatenate([part.nodes, part.radii[:, None]], axis=1)} <= own


TEXT = "# a comment\n# another\nballs 3\n0 0 0 1\n4 0 0.5 1e0\n8 0 0 .5\nbeams 2\n0 1\n2 1\n"


def test_text_of_others_is_read(tmp_path):
    (tmp_path / "a.txt").write_text(TEXT)
    read = read_text(tmp_path / "a.txt")
    assert read.nodes.tolist() == [[0, 0, 0], [4, 0, 0.5], [8, 0, 0]]
    assert read.radii.tolist() == [1, 1, 0.5]
    assert read.edges.tolist() == [[0, 1], [2, 1]]
    (tmp_path / "a.txt").write_text("balls 0\nbeams 0\n")
    assert read_text(tmp_path / "a.txt").edges.shape == (0, 2)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("balls 3", "ball 3", "line 3: expected 'balls"),
        ("balls 3", "balls -3", "line 3: expected 'balls"),
        ("balls 3", "balls 2", "line 6: expected 'beams"),
        ("balls 3", "balls 4", "line 7: expected 4 numbers"),
        ("4 0 0.5 1e0", "4 0 0.5", "line 5: expected 4 numbers"),
        ("4 0 0.5 1e0", "4 0 a 1", "line 5: expected 4 numbers"),
        ("0 0 0 1\n4 0 0.5 1e0", "0 0 0\n1 4 0 0.5 1e0", "line 4: expected 4 numbers"),
        ("4 0 0.5 1e0", "4 0 nan 1", "line 5: expected numbers that are finite"),
        ("4 0 0.5 1e0", "4 0 1 0", "line 5: expected a radius above 0"),
        ("beams 2", "beams 2 3", "line 7: expected 'beams"),
        ("beams 2", "beams 1", "line 9: expected the end"),
        ("beams 2", "beams 3", "line 10: the file ends 1 lines early"),
        ("2 1", "3 1", "line 9: expected ball numbers from 0 to 2"),
        ("2 1", "-1 1", "line 9: expected ball numbers from 0 to 2"),
        ("2 1", "2 1.5", "line 9: expected 2 whole numbers"),
        ("2 1", "2 99999999999999999999", "line 9: expected 2 whole numbers"),
        ("2 1", "2 2", "line 9: expected two different balls"),
        (TEXT, "", "line 1: expected 'balls <how many>', got the end of the file"),
        (TEXT, "\x00\xff\n", "line 1"),
    ],
)
def test_bad_text_is_refused_by_line(tmp_path, old, new, told):
    (tmp_path / "a.txt").write_bytes(TEXT.replace(old, new, 1).encode("latin-1"))
    with pytest.raises(FileError) as raised:
        read_text(tmp_path / "a.txt")
    assert told in str(raised.value)
    assert "a.txt" in str(raised.value)


def test_a_missing_file_and_a_folder():
    for path in ("nowhere.txt", "."):
        with pytest.raises(FileError):
            read_text(path)
        with pytest.raises(FileError):
            read_json(path)


def test_what_would_fill_the_disk_is_refused(tmp_path):
    huge = grid(counts=(10_000, 10_000, 10_000))
    with pytest.raises(TooLargeError, match="region"):
        save(huge, tmp_path / "a.txt")
    with pytest.raises(TooLargeError, match="most=10"):
        save(grid(), tmp_path / "a.txt", most=10)
    with pytest.raises(FileError, match=r"\.json, \.txt, \.py"):
        save(grid(), tmp_path / "a.stl")
    with pytest.raises(FileError, match="folder"):
        save(grid(), tmp_path / "nowhere" / "a.txt")
    assert not list(tmp_path.iterdir())
    save(huge, tmp_path / "a.json")
    assert (tmp_path / "a.json").stat().st_size < 2000


def test_an_old_file_survives_a_failure(tmp_path, monkeypatch):
    (tmp_path / "a.txt").write_text("old")

    def fails(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("topologies.steady_files.ball_numbers", fails)
    with pytest.raises(KeyboardInterrupt):
        write_text(grid(), tmp_path / "a.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


# Display curves


@given(lattices())
def test_iso_curves_run_through_cluster_centers(lattice):
    """A point at each index, on every grid line: the curves are the rows of cluster centres."""
    centers = lattice.balls(*(np.indices(lattice.counts) + np.reshape(lattice.start, (3, 1, 1, 1))))[0].mean(axis=-2)
    for axis, direction in enumerate("uvw"):
        a, b = (int(n) for k, n in enumerate(lattice.counts) if k != axis)
        n = int(lattice.counts[axis])
        if n == 1:
            assert iso_curves(lattice, direction) == []
            continue
        curves = iso_curves(lattice, direction, (a, b), points=n)
        rows = np.moveaxis(centers, axis, 2).reshape(-1, n, 3)
        assert np.allclose(curves, rows, rtol=1e-10, atol=1e-9)


@given(lattices())
def test_the_outline_joins_the_corners_of_the_brick(lattice):
    curves = outline(lattice)
    flat = sum(int(n) == 1 for n in lattice.counts)
    assert len(curves) == (12, 4, 1, 0)[flat]
    first, last = np.asarray(lattice.start), np.asarray(lattice.start) + lattice.counts - 1
    corners = [lattice.balls(*np.where(side, last, first))[0].mean(axis=0) for side in np.ndindex(2, 2, 2)]
    for curve in curves:
        for end in (curve[0], curve[-1]):
            assert min(np.linalg.norm(end - c) for c in corners) <= 1e-9 * (1 + np.linalg.norm(end))


def test_curves_are_fine_enough_and_bounded():
    """A ring of 1000 clusters: chords leave the circle by less than a thousandth of its radius; of 10^12, bounded."""
    straight = Translation((0, 0, 1))
    for turns, count in ((1.0, 1000), (40.0, 1000), (1e6, 10**12)):
        ring = grid(
            nodes=[(10, 0, 0)],
            radii=[0.01],
            racks=[],
            u=Screw(2 * math.pi * turns / count),
            v=straight,
            counts=(count, 2),
        )
        curve = iso_curves(ring, "u")[0]
        assert len(curve) <= MOST_POINTS
        if turns < 50:
            middles = 0.5 * (curve[1:] + curve[:-1])
            assert np.linalg.norm(middles, axis=1).min() > 10 * (1 - 1e-3)
        assert all(len(line) == 2 for line in iso_curves(ring, "v"))


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("x",), ArgumentError),
        (("u", 0), ArgumentError),
        (("u", 2.5), ArgumentTypeError),
        (("u", (1, 2, 3)), ArgumentTypeError),
        (("u", (1, True)), ArgumentTypeError),
    ],
)
def test_curves_of_nonsense(arguments, error):
    with pytest.raises(error):
        iso_curves(grid(), *arguments)
    with pytest.raises(ArgumentError, match="points"):
        iso_curves(grid(), "u", points=1)


# The programs of the gallery


@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_programs_are_clean_lattices_with_declared_parameters(path):
    assert 10 <= len(path.read_text().splitlines()) <= 45
    design = load_design(path)
    lattice = design.names["lattice"]
    assert lattice.clean().is_clean, lattice.clean().message
    assert {"title", "voxel"} <= set(design.names)
    declared = [p for p in declared_parameters(path) if p.range]
    assert len(declared) >= 4
    space: dict = {}
    exec(program_text(lattice), space)
    assert bits(space["lattice"]) == bits(lattice)


def test_the_programs_are_there():
    assert {path.stem for path in GALLERY} >= {"figure_6_3", "honeycomb", "michell", "octet", "spring_tire"}


def test_michells_spirals_cross_at_right_angles():
    lattice = run_script(next(path for path in GALLERY if path.stem == "michell"), {"n": "40"})["lattice"]
    center = np.array([20.0, 20.0])
    a, b, c = (lattice.balls(*(center + step), 0)[0][0] for step in ((0, 0), (1e-6, 0), (0, 1e-6)))
    assert abs((b - a) @ (c - a)) < 1e-5 * np.linalg.norm(b - a) * np.linalg.norm(c - a)
    assert np.linalg.norm(lattice.balls(40, 40, 0)[0][0]) == pytest.approx(100)


def test_figure_6_3_has_its_last_ball_where_the_thesis_puts_it():
    lattice = run_script(next(path for path in GALLERY if path.stem == "figure_6_3"))["lattice"]
    centers, radii = lattice.balls(6, 11, 14)
    assert np.allclose(centers[0], (21.05085999, 0.02840919, 0.1158054), atol=1e-8)
    assert radii[0] == pytest.approx(0.0919527321, abs=1e-10)
    assert lattice.n_beams == 4303


def test_the_tires_wires_are_unbroken():
    """Each wire is one path: no ball has more than two beams, and only the ends of the springs have one."""
    lattice = run_script(next(path for path in GALLERY if path.stem == "spring_tire"))["lattice"]
    pairs = np.concatenate([ball_numbers(lattice, block) for block in lattice.beams()])
    degree = np.bincount(pairs.ravel(), minlength=lattice.n_nodes)
    assert degree.max() == 2
    assert np.count_nonzero(degree == 1) == 4 * lattice.counts[2]
    assert not np.any(degree == 0)


def test_the_command_works_on_a_steady_lattice(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    program = str(next(path for path in GALLERY if path.stem == "octet"))
    assert (
        main(["lattice", program, "--param", "wide=10000", "--param", "long=10000", "--param", "cell=1", "info"]) == 0
    )
    assert "23,997,600,060,000" in capsys.readouterr().out
    assert main(["lattice", program, "export", "--roi", "1,1,1:2,2,2", "-o", "a.txt"]) == 0
    assert main(["lattice", program, "export", "-o", "a.py"]) == 0
    assert main(["lattice", program, "export", "-o", "a.json"]) == 0
    whole = run_script(program)["lattice"]
    assert bits(read_json("a.json")) == bits(run_script("a.py")["lattice"]) == bits(whole)
    assert len(read_text("a.txt").edges) == whole.region((1, 1, 1), (2, 2, 2)).n_beams
    assert main(["lattice", program, "render", "-o", "a.png"]) == 0
