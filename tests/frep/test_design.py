"""Declared parameters: listed without running the script, held against their ranges, and the same whether run alone or not."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep.cli import main
from frep.design import declared_parameters, load_design, parameters, run_script
from frep.errors import ArgumentError, ArgumentTypeError, FrepError, FunctionError
from frep.parameter import Parameter

PROGRAM = """
    import math
    import frep
    import frep as kernel
    from frep import parameter as control

    twist = frep.parameter(0.3, 0, math.pi / 2, "rad", help="of the whole")
    radius: float = kernel.parameter(default=2.0, low=0.5, unit="mm")
    count = control(3, 1, 10)
    corner = control((1, 2.5), high=4.0)
    hollow = frep.parameter(False)
    body = frep.parameter("a.stl", help="any mesh")
    plain = 7
    derived = twist * count
    part = frep.sphere((0, 0, 0), radius)
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(text: str, name: str = "design.py") -> str:
        (tmp_path / name).write_text(textwrap.dedent(text))
        return name

    return write


def test_declarations_are_listed_without_running(write):
    design = write(PROGRAM + "\n    raise SystemExit('ran')")
    assert declared_parameters(design) == [
        Parameter("twist", 0.3, 0, math.pi / 2, "rad", "of the whole"),
        Parameter("radius", 2.0, low=0.5, unit="mm"),
        Parameter("count", 3, 1, 10),
        Parameter("corner", (1, 2.5), high=4.0),
        Parameter("hollow", False),
        Parameter("body", "a.stl", help="any mesh"),
        Parameter("plain", 7),
    ]
    assert parameters(design)["twist"] == 0.3


def test_the_script_run_alone_has_the_defaults(write):
    names = run_script(write(PROGRAM))
    assert all(names[p.name] == p.default for p in declared_parameters("design.py"))
    space: dict = {}
    exec(textwrap.dedent(PROGRAM), space)
    assert {key: space[key] for key in names if key in ("twist", "count", "derived")} == {
        "twist": 0.3,
        "count": 3,
        "derived": names["derived"],
    }


@given(twist=st.floats(0, math.pi / 2), count=st.integers(1, 10), low=st.floats(-1e3, 4.0))
def test_values_in_range_arrive_and_what_derives_from_them_follows(tmp_path_factory, twist, count, low):
    path = tmp_path_factory.mktemp("d") / "design.py"
    path.write_text(textwrap.dedent(PROGRAM))
    replaced = {"twist": repr(twist), "count": str(count), "corner": f"{low!r}, -1", "hollow": "yes", "body": "b=c"}
    names = load_design(path, replaced).names
    assert (names["twist"], names["count"], names["corner"]) == (twist, count, (low, -1))
    assert names["derived"] == twist * count
    assert names["hollow"] is True
    assert names["body"] == "b=c"


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("twist", "1.6", "0 to 1.5708 rad"),
        ("twist", "-1e-9", "0 to 1.5708 rad"),
        ("twist", "nan", "0 to 1.5708 rad"),
        ("twist", "wide", "a number"),
        ("radius", "0.4", "at least 0.5 mm"),
        ("radius", "inf", "at least 0.5 mm"),
        ("count", "11", "1 to 10"),
        ("count", "2.5", "whole number"),
        ("corner", "1, 5", "at most 4"),
        ("corner", "1", "2 values"),
        ("corner", "1, 'a'", "numbers"),
        ("hollow", "2", "true or false"),
        ("twists", "1", "twist=0.3"),
    ],
)
def test_values_that_do_not_fit_are_refused_before_the_script_runs(write, name, text, told):
    design = write(PROGRAM.replace("import math", "import math\n    open('ran', 'w')", 1))
    with pytest.raises(ArgumentError) as raised:
        load_design(design, {name: text})
    assert name in str(raised.value)
    assert told in str(raised.value)
    assert not Path("ran").exists()


def test_the_commands_obey_ranges(write, capsys):
    design = write(PROGRAM)
    for command in ("mesh", "render"):
        assert main([command, design, "--param", "radius=0.1", "--voxel", "0.3"]) == 1
        told = capsys.readouterr().err
        assert told == "frep: error: param: radius=0.1 is out of range; expected at least 0.5 mm\n"


@pytest.mark.parametrize(
    ("call", "told"),
    [
        ("frep.parameter(5, 0, 1, 'rad')", "0 to 1 rad"),
        ("frep.parameter(5, 9, 1)", "empty"),
        ("frep.parameter('a', 0)", "only numbers"),
        ("frep.parameter(True, 0)", "only numbers"),
        ("frep.parameter(1, low='a')", "low"),
        ("frep.parameter(1, float('nan'))", "written out"),
        ("frep.parameter(1, 0, limit)", "written out"),
        ("frep.parameter([1])", "tuple"),
        ("frep.parameter(1, unit=3)", "unit"),
        ("frep.parameter()", "default at least"),
        ("frep.parameter(1, default=2)", "each once"),
        ("frep.parameter(1, colour=2)", "known"),
        ("frep.parameter(*limits)", "written out"),
    ],
)
def test_declarations_that_make_no_sense(write, call, told):
    design = write(f"import frep\nlimit = 2\n\np = {call}\n")
    with pytest.raises(FrepError, match=told) as raised:
        declared_parameters(design)
    assert "line 4" in " ".join(raised.value.__notes__)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ((2.0, 0, 1), ArgumentError),
        ((math.inf,), ArgumentError),
        ((1, math.nan), ArgumentError),
        ((1, 2, 1), ArgumentError),
        (("a", 1), ArgumentTypeError),
        ((None,), ArgumentTypeError),
        (([1, 2],), ArgumentTypeError),
        ((1, "0"), ArgumentTypeError),
        ((1, True), ArgumentTypeError),
    ],
)
def test_a_call_checks_what_it_is_given(arguments, error):
    with pytest.raises(error):
        frep.parameter(*arguments)


def test_only_frep_parameter_declares(write):
    """Another function of that name is the script's own business."""
    design = write("import other\ndef parameter(x): return x\na = parameter(1)\nb = other.parameter(2)\nc = 3")
    assert parameters(design) == {"c": 3}


def test_a_unit_makes_a_whole_default_a_measure(write):
    design = write("import frep\na = frep.parameter(10, 1, 20, 'mm')\nb = frep.parameter(10, 1, 20)")
    a, b = declared_parameters(design)
    assert not a.is_count
    assert b.is_count
    assert run_script(design, {"a": "7.5"})["a"] == 7.5


def test_a_lattice_stands_for_its_solid(write):
    lattice = """
        import frep
        class Ball:
            def solid(self):
                return frep.sphere((1, 2, 3), 4.0)
        lattice = Ball()
    """
    assert load_design(write(lattice)).part.contains([[1, 2, 6.9]]).all()
    both = textwrap.dedent(lattice) + "part = frep.sphere((0, 0, 0), 1.0)\n"
    assert not load_design(write(both)).part.contains([[1, 2, 6.9]]).any()
    with pytest.raises(ArgumentTypeError, match=r"lattice\.solid\(\)"):
        load_design(write(lattice.replace("frep.sphere((1, 2, 3), 4.0)", "1")))
    with pytest.raises(ArgumentError, match="no `part`"):
        load_design(write("lattice = 1"))


def test_a_script_that_is_not_python(write):
    with pytest.raises(FunctionError):
        declared_parameters(write("p = frep.parameter("))


@pytest.mark.parametrize(
    ("command", "name", "content", "told"),
    [
        ("mesh", "a.stl", bytes(84) + b"\x01", "is a mesh file by its suffix, not a Python script"),
        ("lattice", "a.stl", bytes(84) + b"\x01", "is a mesh file by its suffix, not a Python script"),
        ("mesh", "a.ply", b"ply\nformat ascii 1.0\n", "is a mesh file by its suffix, not a Python script"),
        ("mesh", "a.bin", b"p\0\0", "is not text, but a Python script was expected"),
        ("render", "a.py", b"p\0\0", "is not text, but a Python script was expected"),
    ],
)
def test_files_that_are_no_scripts_are_one_line(tmp_path, monkeypatch, capsys, command, name, content, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(content)
    assert main([command, name]) == 1
    said = capsys.readouterr().err
    assert said.startswith("frep: error: design: ")
    assert told in said
    assert said.count("\n") == 1
