"""The command line: what it makes, what it says, how it fails, and that a failure leaves nothing behind."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from PIL import Image

from frep.cli import main
from frep.design import load_design, parameters
from frep.errors import ArgumentError, FileError, FunctionError
from frep.io.read import read_mesh
from frep.mesh import Mesh

BALL = """
    import frep

    radius = 4.0
    centre = (0, 0, 0)
    voxel = 0.5
    title = "A ball"
    cells = 1
    half = False

    part = frep.sphere(centre, radius)
    if half:
        part = part & frep.box((0, -9, -9), (9, 9, 9))
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def script(folder, text: str, name: str = "design.py") -> str:
    (folder / name).write_text(textwrap.dedent(text))
    return name


def cube(size: float = 2.0) -> Mesh:
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(size * corners, np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]))


def names(folder) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.startswith("__")}


# Making a part


def test_mesh_writes_the_part_and_says_what_it_took(folder, capsys):
    design = script(folder, BALL)
    assert main(["mesh", design, "--voxel", "0.25", "-o", "ball.stl"]) == 0
    assert names(folder) == {"design.py", "ball.stl"}
    ball = read_mesh("ball.stl")
    assert ball.check().printable
    assert ball.volume == pytest.approx(4 / 3 * math.pi * 4**3, rel=0.01)
    told = capsys.readouterr().out
    for word in ("A ball", "cells", "voxels evaluated", "voxels in the box", "%", "triangles", "volume", "area"):
        assert word in told
    for word in ("sampling", "meshing", "writing", "peak memory", "ball.stl"):
        assert word in told


def test_the_scripts_own_voxel_and_name_are_the_defaults(folder):
    design = script(folder, BALL)
    assert main(["mesh", design]) == 0
    assert main(["mesh", design, "--voxel", "0.5", "-o", "again.stl"]) == 0
    assert (folder / "design.stl").read_bytes() == (folder / "again.stl").read_bytes()


def test_several_outputs_are_the_same_part(folder):
    assert main(["mesh", script(folder, BALL), "-o", "a.stl", "-o", "a.ply", "-o", "a.obj"]) == 0
    volumes = [read_mesh(f"a.{kind}").volume for kind in ("stl", "ply", "obj")]
    assert volumes == pytest.approx([volumes[0]] * 3, rel=1e-5)


def test_polish_brings_the_mesh_nearer_to_the_solid(folder):
    design = script(folder, BALL)
    assert main(["mesh", design, "-o", "plain.stl"]) == 0
    assert main(["mesh", design, "--polish", "-o", "polished.stl"]) == 0
    plain, polished = (abs(read_mesh(f"{kind}.stl").volume - 4 / 3 * math.pi * 4**3) for kind in ("plain", "polished"))
    assert polished < 0.3 * plain


def test_a_tolerance_chooses_the_voxel(folder):
    """Facets of a ball that keep within the tolerance of it, and a script that need not name a voxel."""
    design = script(folder, "import frep\npart = frep.sphere((0, 0, 0), 4.0)")
    assert main(["mesh", design, "--tolerance", "0.01", "-o", "ball.stl"]) == 0
    corners = read_mesh("ball.stl")
    radii = np.linalg.norm(corners.vertices[corners.faces].mean(axis=1), axis=1)
    assert np.abs(radii - 4.0).max() < 0.03
    assert main(["mesh", design, "--tolerance", "0.01", "--voxel", "0.5"]) == 1


def test_a_parameter_replaces_the_declared_value(folder):
    design = script(folder, BALL)
    assert main(["mesh", design, "--param", "radius=2", "--param", "centre=(10, 0, 1)", "-o", "small.stl"]) == 0
    bounds = read_mesh("small.stl").bounds
    assert bounds == pytest.approx(np.array([[8, -2, -1], [12, 2, 3]]), abs=0.05)
    assert main(["mesh", design, "--param", "half=yes", "-o", "half.stl"]) == 0
    assert read_mesh("half.stl").bounds[0, 0] == pytest.approx(0, abs=1e-3)


def test_a_script_sees_modules_beside_it(folder):
    script(folder, "RADIUS = 3.0", "measures.py")
    design = script(folder, "import frep, measures\npart = frep.sphere((0, 0, 0), measures.RADIUS)")
    assert main(["mesh", design, "--voxel", "0.5", "-o", "a.stl"]) == 0
    sys.modules.pop("measures")


# Parameters


def test_parameters_are_the_literals_assigned_at_top_level(folder):
    design = script(
        folder,
        """
        import math
        cell = 10
        low, high = 1, 2
        wall: float = 0.8
        shift = (-1, 2.5)
        body = "airplane.ply"
        solid = True
        half = cell / 2
        cell = 12
        items = [1, 2]
        def f():
            inner = 3
        """,
    )
    assert parameters(design) == {"cell": 10, "wall": 0.8, "shift": (-1, 2.5), "body": "airplane.ply", "solid": True}


@pytest.mark.parametrize(
    ("default", "text", "value"),
    [
        ("10", "12", 12),
        ("10", "7.5", 7.5),
        ("0.5", "2", 2.0),
        ("-0.5", "-1e-3", -1e-3),
        ("'a'", "b=c d", "b=c d"),
        ("'1'", "2", "2"),
        ("True", "no", False),
        ("False", "TRUE", True),
        ("(1, 2)", "3,4.5", (3, 4.5)),
        ("(1, 2)", "(3, 4)", (3, 4)),
    ],
)
def test_a_value_takes_the_type_of_its_default(folder, default, text, value):
    design = script(folder, f"import frep\np = {default}\nq = p\npart = frep.sphere((0, 0, 0), 1)")
    q = load_design(design, {"p": text}).names["q"]
    assert q == value
    assert type(q) is type(value)


@pytest.mark.parametrize(
    ("default", "text"), [("10", "ten"), ("0.5", ""), ("True", "perhaps"), ("(1, 2)", "1,2,3"), ("(1, 2)", "f(x)")]
)
def test_a_value_that_does_not_fit_is_refused_before_the_script_runs(folder, default, text):
    design = script(folder, f"p = {default}\nraise SystemExit('ran')")
    with pytest.raises(ArgumentError, match=r"p=.*expected"):
        load_design(design, {"p": text})


def test_an_unknown_parameter_names_the_declared_ones(folder, capsys):
    assert main(["mesh", script(folder, BALL), "--param", "radios=2"]) == 1
    told = capsys.readouterr().err
    assert "radios" in told
    assert "radius=4.0" in told
    assert "voxel=0.5" in told
    assert main(["mesh", "design.py", "--param", "radius"]) == 1
    assert "name=value" in capsys.readouterr().err


# Failing well


def fails(capsys, arguments: list[str]) -> str:
    """Run, expect exit code 1 and one clean line at the end; return what was said."""
    assert main(arguments) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.splitlines()[-1].startswith("frep: error: ")
    return told.err


def test_an_error_of_frep_is_one_line(folder, capsys):
    design = script(folder, "import frep\npart = frep.sphere((0, 0, 0), -1.0)")
    told = fails(capsys, ["mesh", design, "--voxel", "0.5"])
    assert "-1.0" in told
    assert "design.py, line 2" in told
    assert "Traceback" not in told
    assert len(told.splitlines()) == 1
    assert names(folder) == {"design.py"}


@pytest.mark.parametrize("voxel", ["0", "-1", "nan", "inf"])
def test_a_bad_voxel_is_one_line_and_writes_nothing(folder, capsys, voxel):
    told = fails(capsys, ["mesh", script(folder, BALL), f"--voxel={voxel}", "-o", "a.stl"])
    assert "voxel" in told
    assert len(told.splitlines()) == 1
    assert names(folder) == {"design.py"}


def test_a_failing_script_shows_its_own_lines(folder, capsys):
    design = script(
        folder,
        """
        def wall(n):
            return 1 / n

        part = wall(0)
        """,
    )
    told = fails(capsys, ["mesh", design, "--voxel", "1"])
    assert "return 1 / n" in told
    assert "part = wall(0)" in told
    assert "ZeroDivisionError" in told
    assert "exec(" not in told
    assert "frep/" not in told


def test_a_failing_user_function_shows_its_own_lines(folder, capsys):
    design = script(
        folder,
        """
        import frep
        def wall(x, y, z):
            if len(x) > 0:
                raise RuntimeError("no data here")
        x, y, z = frep.coordinates()
        part = frep.Solid(x - 1, bounds=((0, 0, 0), (2, 2, 2))) & frep.box((0, 0, 0), (1, 1, 1))
        wall([1], 2, 3)
        """,
    )
    told = fails(capsys, ["mesh", design, "--voxel", "1"])
    assert 'raise RuntimeError("no data here")' in told


def test_a_script_that_is_not_python(folder, capsys):
    assert "SyntaxError" in fails(capsys, ["mesh", script(folder, "part = (1,"), "--voxel", "1"])
    with pytest.raises(FunctionError):
        parameters("design.py")


def test_a_script_without_a_part(folder, capsys):
    assert "`part`" in fails(capsys, ["mesh", script(folder, "x = 1"), "--voxel", "1"])
    assert "int" in fails(capsys, ["mesh", script(folder, "part = 1"), "--voxel", "1"])


def test_bad_outputs_are_refused_before_the_script_runs(folder, capsys):
    design = script(folder, "raise SystemExit('ran')")
    told = fails(capsys, ["mesh", design, "-o", "part.xyz"])
    for suffix in (".stl", ".ply", ".obj", ".step", ".vdb"):
        assert suffix in told
    assert "folder" in fails(capsys, ["mesh", design, "-o", "nowhere/part.stl"])
    assert "png" in fails(capsys, ["render", design, "-o", "part.jpg"])
    assert "no_such.py" in fails(capsys, ["mesh", "no_such.py"])


def test_an_old_file_survives_a_failure(folder, capsys):
    (folder / "a.stl").write_bytes(b"old")
    fails(
        capsys, ["mesh", script(folder, "import frep\npart = frep.sphere((0, 0, 0), 1)"), "--voxel=-1", "-o", "a.stl"]
    )
    assert (folder / "a.stl").read_bytes() == b"old"
    assert names(folder) == {"design.py", "a.stl"}


def test_wrong_commands_explain_themselves(folder, capsys):
    assert main(["mash", "x.py"]) == 2
    assert "mesh" in capsys.readouterr().err
    assert main(["mesh"]) == 2
    assert main(["mesh", "a.py", "--voxel", "small"]) == 2


def test_ctrl_c_is_one_line_and_leaves_the_old_file(folder):
    """A real interrupt, in a real process."""
    (folder / "a.stl").write_bytes(b"old")
    design = script(
        folder,
        """
        import pathlib, time, frep
        pathlib.Path("running").touch()
        while True:
            time.sleep(0.01)
        """,
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen(
        [sys.executable, "-m", "frep", "mesh", design, "-o", "a.stl"],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    until = time.monotonic() + 60
    while not (folder / "running").exists():
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert len(told.splitlines()) == 1
    assert told.startswith("interrupted")
    assert (folder / "a.stl").read_bytes() == b"old"
    assert names(folder) == {"design.py", "a.stl", "running"}


# Examining and drawing


def test_info_tells_the_numbers(folder, capsys):
    cube(2.0).save("cube.stl")
    assert main(["info", "cube.stl"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.replace(", ", ",_").splitlines())
    assert rows["faces"] == "12"
    assert float(rows["volume,_mm3"]) == 8
    assert float(rows["area,_mm2"]) == 24
    assert rows["size,_mm"] == "2.000 x 2.000 x 2.000"
    assert rows["closed"].startswith("yes")


def test_check_passes_a_closed_mesh_and_fails_an_open_one(folder, capsys):
    cube().save("closed.ply")
    assert main(["check", "closed.ply"]) == 0
    assert "ready to print" in capsys.readouterr().out
    Mesh(cube().vertices, cube().faces[:-1]).save("open.ply")
    assert main(["check", "open.ply"]) == 1
    told = capsys.readouterr().out
    assert "NOT ready" in told
    assert "3 open edges" in told


@pytest.mark.parametrize("command", ["info", "check", "render"])
def test_files_that_are_no_mesh(folder, capsys, command):
    (folder / "text.stl").write_text("hello")
    assert "text.stl" in fails(capsys, [command, "text.stl"])
    assert "missing.stl" in fails(capsys, [command, "missing.stl"])
    assert names(folder) == {"text.stl"}


def test_render_draws_a_mesh_and_a_design(folder, capsys):
    cube().save("cube.stl")
    assert main(["render", "cube.stl"]) == 0
    assert Image.open("cube.png").size == (1200, 900)
    design = script(folder, BALL)
    assert main(["render", design, "-o", "ball.png", "--voxel", "0.5", "--param", "radius=2"]) == 0
    assert np.asarray(Image.open("ball.png")).std() > 10
    capsys.readouterr()
    assert "--voxel" in fails(capsys, ["render", "cube.stl", "--voxel", "1"])


# The command itself


def test_help_loads_no_heavy_library():
    code = (
        "import sys; from frep.cli import main; assert main(['--help']) == 0;"
        "heavy = {'vtk', 'vtkmodules', 'pyvista', 'skimage', 'cadquery', 'igl'};"
        "print('heavy:', sorted(heavy & set(sys.modules)))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    for word in ("mesh", "info", "check", "render"):
        assert word in done.stdout
    assert done.stdout.splitlines()[-1] == "heavy: []"


def test_a_missing_design_is_a_file_error(folder):
    with pytest.raises(FileError, match=r"nowhere\.py"):
        load_design("nowhere.py")
