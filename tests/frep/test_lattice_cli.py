"""`frep lattice`: any object with the right methods is examined, listed, meshed, drawn and exported, region by region."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import frep.lattice_cli
from frep.cli import main
from frep.io.read import read_mesh
from frep.lattice_cli import _cones, _spheres

# No topology: the kernel's command must do with what its Protocol says. A row of beads on a square grid in the plane.
GRID = """
    import itertools
    import numpy as np
    import frep

    pitch = frep.parameter(4.0, 1, 10, "mm", "from bead to bead")
    n = frep.parameter(3, 1, 1_000_000_000)
    sound = True
    voxel = 0.25
    title = "Beads"

    class Grid:
        racks = np.array([(0, 0, 1, 0, 0), (0, 0, 0, 1, 0)])

        def __init__(self, counts, start=(0, 0, 0)):
            self.counts, self.start = np.array(counts), np.array(start)

        @property
        def n_nodes(self):
            return int(self.counts[0]) * int(self.counts[1])

        @property
        def n_beams(self):
            a, b = int(self.counts[0]), int(self.counts[1])
            return (a - 1) * b + a * (b - 1)

        def region(self, start, span):
            return Grid(span, start)

        def beams(self, block):
            a, b, _ = self.counts
            rows = [(i, j, 0, 0) for i in range(a - 1) for j in range(b)] + [(i, j, 0, 1) for i in range(a) for j in range(b - 1)]
            for begin in range(0, len(rows), 2):
                yield np.array(rows[begin : begin + 2]) + (*self.start, 0)

        def ends(self, beams):
            first = pitch * beams[:, :3]
            step = self.racks[beams[:, 3], 2:]
            return np.stack([first, first + pitch * step], axis=1), np.full((len(beams), 2), 0.5)

        def outline(self):
            corners = pitch * np.array([(0, 0, 0), (n - 1, 0, 0), (n - 1, 1, 0), (0, 1, 0), (0, 0, 0.0)])
            return [corners[k : k + 2] for k in range(4)]

        def solid(self):
            parts = []
            for block in self.beams(2):
                parts += [frep.capsule(tuple(a), tuple(b), 0.5) for a, b in self.ends(block)[0]]
            return frep.union(*parts)

        def clean(self):
            return sound

        def volume(self):
            return 12345.678

        def area(self):
            return 90.0

        def save(self, path, *, most):
            path.write_text(f"{self.start.tolist()} {self.counts.tolist()} {most}")

    lattice = Grid((n, 2, 1))
"""


@pytest.fixture
def program(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grid.py").write_text(textwrap.dedent(GRID))
    return "grid.py"


def fails(capsys, arguments: list[str]) -> str:
    assert main(arguments) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert len(told.err.splitlines()) == 1
    assert told.err.startswith("frep: error: ")
    return told.err


def test_info_tells_counts_measures_and_parameters(program, capsys):
    assert main(["lattice", program, "--param", "n=1000000000", "--param", "pitch=5", "info"]) == 0
    rows = [line.split("  ", 1) for line in capsys.readouterr().out.splitlines()]
    told = {name.strip(): value.strip() for name, value in rows}
    assert told["lattice"] == "Beads"
    assert told["clusters"] == "1,000,000,000 x 2 x 1"
    assert told["balls"] == "2,000,000,000"
    assert told["beams"] == "2,999,999,998"
    assert told["clean"] == "yes"
    assert told["volume, mm3"] == "12,345.7"
    assert told["--param pitch"].startswith("5.0 mm")
    for word in ("default 4.0", "1 to 10 mm", "from bead to bead"):
        assert word in told["--param pitch"]
    assert "title" not in " ".join(told)


def test_info_of_a_lattice_that_is_not_clean_gives_no_volume(program, capsys):
    assert main(["lattice", program, "info", "--param", "sound=no"]) == 0
    told = capsys.readouterr().out
    assert "clean" in told
    assert "no:" in told
    assert "volume" not in told


def test_info_is_what_it_does_when_nothing_is_said(program, capsys):
    assert main(["lattice", program]) == 0
    first = capsys.readouterr().out
    assert main(["lattice", program, "info"]) == 0
    assert capsys.readouterr().out == first


def test_beams_of_a_region_are_listed(program, capsys):
    """Every beam once, its balls where the lattice has them, the same on the terminal and in a file."""
    roi = ["--roi", "1,0,0:2,2,1"]
    assert main(["lattice", program, "beams", *roi]) == 0
    told = capsys.readouterr().out
    assert main(["lattice", program, "beams", *roi, "-o", "b.txt"]) == 0
    assert Path("b.txt").read_text() == told
    rows = np.loadtxt("b.txt")
    assert {tuple(row) for row in rows[:, :4].astype(int)} == {(1, 0, 0, 0), (1, 1, 0, 0), (1, 0, 0, 1), (2, 0, 0, 1)}
    assert np.all(rows[:, [7, 11]] == 0.5)
    assert np.allclose(rows[:, 4:7], 4.0 * rows[:, :3])
    assert np.allclose(np.linalg.norm(rows[:, 8:11] - rows[:, 4:7], axis=1), 4.0)


def test_too_many_beams_are_refused_with_their_number_and_the_remedy(program, capsys, monkeypatch):
    for action in (["beams", "-o", "b.txt"], ["beams"], ["export", "-o", "b.txt"]):
        told = fails(capsys, ["lattice", program, "--param", "n=1000000000", *action])
        for word in ("2,999,999,998", "--roi", "--all"):
            assert word in told
    monkeypatch.setattr(frep.lattice_cli, "MOST", 6)
    fails(capsys, ["lattice", program, "beams", "-o", "b.txt"])
    assert main(["lattice", program, "beams", "--all", "-o", "b.txt"]) == 0
    assert len(np.loadtxt("b.txt")) == 7
    assert main(["lattice", program, "export", "-o", "model.json"]) == 0  # whose size does not grow with the counts


def test_a_failure_while_writing_leaves_the_old_file(program, tmp_path, capsys):
    """The first block of beams is written before the second one fails."""
    broken = """
    from frep import ArgumentError
    sound = Grid.ends

    def ends(self, beams):
        if beams[0, 3]:
            raise ArgumentError("ends: enough")
        return sound(self, beams)

    Grid.ends = ends
    """
    with (tmp_path / program).open("a") as file:
        file.write(textwrap.dedent(broken))
    (tmp_path / "b.txt").write_text("old")
    assert "enough" in fails(capsys, ["lattice", program, "beams", "-o", "b.txt"])
    assert (tmp_path / "b.txt").read_text() == "old"
    assert {p.name for p in tmp_path.iterdir() if not p.name.startswith("__")} == {program, "b.txt"}


def test_mesh_of_a_region_and_of_a_box(program, capsys):
    assert main(["lattice", program, "mesh", "--roi", "0,0,0:2,1,1", "--voxel", "0.2", "-o", "a.stl"]) == 0
    part = read_mesh("a.stl")
    assert part.check().printable
    assert part.bounds == pytest.approx(np.array([[-0.5, -0.5, -0.5], [4.5, 0.5, 0.5]]), abs=0.03)
    assert "Beads" in capsys.readouterr().out
    assert main(["lattice", program, "mesh", "--box=-1,-1,-1:2,1,1", "-o", "b.stl"]) == 0
    part = read_mesh("b.stl")
    assert part.check().printable
    assert part.bounds == pytest.approx(np.array([[-0.5, -0.5, -0.5], [2.0, 1.0, 0.5]]), abs=0.03)


def test_mesh_of_the_design_is_that_of_the_lattice(program):
    assert main(["lattice", program, "mesh", "-o", "a.stl"]) == 0
    assert main(["mesh", program, "-o", "b.stl"]) == 0
    assert Path("a.stl").read_bytes() == Path("b.stl").read_bytes()


def test_render_draws_a_region_and_the_outline_of_all(program, capsys, monkeypatch):
    assert main(["lattice", program, "render"]) == 0
    assert np.asarray(Image.open("grid.png").convert("L")).std() > 3
    monkeypatch.setattr(frep.lattice_cli, "DRAWN", 10)
    assert main(["lattice", program, "render", "--param", "n=100", "-o", "part.png"]) == 0
    assert "10 of 298 beams, --roi 0,0,0:4,2,1, and the outline of all" in capsys.readouterr().out
    assert main(["lattice", program, "render", "--param", "n=1000", "-o", "part.png"]) == 0
    assert "too small a part to show in the outline, 3,996 mm across" in capsys.readouterr().out
    assert "10" in fails(capsys, ["lattice", program, "render", "--param", "n=1000", "--roi", "0,0,0:5,2,1"])


def test_export_hands_the_region_to_the_lattice(program):
    assert main(["lattice", program, "export", "--roi", "1,0,0:2,1,1", "-o", "a.txt"]) == 0
    assert Path("a.txt").read_text() == "[1, 0, 0] [2, 1, 1] None"
    assert main(["lattice", program, "export"]) == 0
    assert Path("grid.json").read_text() == "[0, 0, 0] [3, 2, 1] None"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["beams", "--roi", "0,0,0"], "i,j,k:di,dj,dk"),
        (["beams", "--roi", "0,0,0:1,1,x"], "i,j,k:di,dj,dk"),
        (["beams", "--roi", "0,0,0:1,1,0"], "0,0,0:3,2,1"),
        (["beams", "--roi", "2,0,0:2,1,1"], "0,0,0:3,2,1"),
        (["beams", "--roi=-1,0,0:2,1,1"], "0,0,0:3,2,1"),
        (["mesh", "--box", "0,0,0:1,1,0"], "upper corner"),
        (["mesh", "--box", "0,0,0:1,1,nan"], "finite"),
        (["mesh", "--box", "0,0,0:1,1"], "six numbers"),
        (["mesh", "--voxel", "-1"], "voxel"),
        (["info", "--roi", "0,0,0:1,1,1"], "roi"),
        (["beams", "--voxel", "1"], "voxel"),
        (["render", "--box", "0,0,0:1,1,1"], "box"),
        (["mesh", "--all"], "all"),
        (["export", "-o", "a.stl"], ".json"),
        (["export", "-o", "grid.py"], "the program itself"),
        (["mesh", "-o", "a.xyz"], ".stl"),
        (["render", "-o", "a.jpg"], ".png"),
        (["beams", "-o", "nowhere/a.txt"], "folder"),
        (["info", "--param", "n=0"], "1 to 1e+09"),
    ],
)
def test_bad_requests_are_one_line(program, tmp_path, capsys, arguments, told):
    assert told in fails(capsys, ["lattice", program, *arguments])
    assert {p.name for p in tmp_path.iterdir() if not p.name.startswith("__")} == {program}


def test_an_unknown_action_is_a_wrong_command(program):
    assert main(["lattice", program, "draw"]) == 2


def test_what_is_no_lattice_is_told_what_it_lacks(tmp_path, program, capsys):
    (tmp_path / "none.py").write_text("x = 1\n")
    assert "`lattice`" in fails(capsys, ["lattice", "none.py"])
    (tmp_path / "half.py").write_text("class Half:\n    counts = start = (1, 1, 1)\n\nlattice = Half()\n")
    told = fails(capsys, ["lattice", "half.py", "mesh"])
    assert "Half, which lacks region, solid;" in told


# What is drawn


ENDS = np.array([[[0, 0, 0], [5.0, 0, 0]], [[5.0, 0, 0], [5.0, 3.0, 4.0]]])
RADII = np.array([[1.0, 0.5], [0.5, 2.0]])


@pytest.mark.parametrize("drawn", ["cones", "balls"])
def test_a_picture_shows_beams_and_balls_where_they_are(drawn):
    """Vertices lie on the balls (those of a cone where it touches them), and faces look outward."""
    centers, radii = ENDS.reshape(-1, 3), RADII.reshape(-1)
    vertices, faces = _cones(ENDS, RADII) if drawn == "cones" else _spheres(centers, radii)
    distance = np.linalg.norm(vertices[:, None] - centers, axis=2) - radii
    assert np.abs(distance).min(axis=1).max() < 1e-12
    assert set(faces.ravel()) == set(range(len(vertices)))
    corners = vertices[faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = centers[np.argmin(np.abs(distance), axis=1)][faces].mean(axis=1)  # of its ball, or on the axis of its beam
    assert np.all(np.einsum("na,na->n", outward, corners.mean(axis=1) - inside) > 0)


def test_a_ball_that_beams_share_is_drawn_once():
    assert len(_spheres(ENDS.reshape(-1, 3), RADII.reshape(-1))[0]) * 4 == 3 * len(
        _spheres(np.eye(4)[:, :3], np.ones(4))[0]
    )
