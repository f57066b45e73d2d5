"""Entries: what is found out from a topology that the kernel has never heard of; announcements, sound and broken."""

from __future__ import annotations

import dataclasses
import importlib
import json
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError, ArgumentTypeError
from frep.catalogue import (
    FORMS,
    GROUP,
    CatalogueWarning,
    Entry,
    EntryParameter,
    Facts,
    Known,
    discover,
    find,
    fraction_of,
    of_family,
    suggestion,
)
from frep.skeleton import PeriodicSkeleton

ROOT = Path(__file__).resolve().parents[2]
X, Y, Z = frep.coordinates()


class Layers:
    """Planes across z, `cell` apart, and what lies between them."""

    def __init__(self, cell: float = 4.0, tilt: float = 0.0) -> None:
        self.cell = cell
        self.level = abs(frep.mod(Z, cell) - 0.5 * cell)

    def sheet(self, thickness):
        return frep.Solid(self.level - 0.5 * thickness)

    def solid(self, bias=0.0):
        return frep.Solid(self.level - 0.25 * self.cell - bias)


class Grid:
    """Beams along x, y and z."""

    def __init__(self, cell: float = 5.0) -> None:
        nodes = cell * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
        self.skeleton = PeriodicSkeleton(nodes, np.array([(0, 1), (0, 2), (0, 3)]), np.full(3, cell))

    def thicken(self, diameter):
        from frep.thicken import thickened

        return thickened(self.skeleton, diameter, node=None, section="circle", blend=0.0, label="grid")


PARAMETERS = (
    EntryParameter("cell", 4.0, 0, unit="mm", help="the period", above=True),
    EntryParameter("tilt", 0.0, 0, 0.5, "mm", "nothing", of_cell=True),
    EntryParameter("pattern", "a", help="a choice", choices=("alpha", "beta")),
    EntryParameter("count", 2, 1, 9),
)
LAYERS = Entry(
    "layers",
    "mine",
    "Layers.",
    lambda **given: Layers(np.min(given.get("cell", 4.0))),
    PARAMETERS,
    facts_of=lambda _: Facts(full=1.0),
)
GRID = Entry("grid", "mine", "A grid.", Grid, PARAMETERS[:1])


# --- what is found out -----------------------------------------------------------------------------------------------


def test_forms_are_the_methods_that_there_are():
    assert LAYERS.forms == ("sheet", "solid")
    assert LAYERS.signed
    assert GRID.forms == ("thicken",)
    assert not GRID.signed
    assert Entry("x", "y", "", Layers, methods=("sheet",)).forms == ("sheet",)


def test_valences_count_beams_that_go_on_in_the_next_cell():
    assert GRID.valences == (6,)
    assert LAYERS.valences == ()


def test_a_period_is_found_or_asked_for():
    np.testing.assert_array_equal(GRID.period, [5, 5, 5])
    np.testing.assert_array_equal(LAYERS.period, [4, 4, 4])
    assert Entry("x", "y", "", Layers, body=frep.box((0, 0, 0), (1, 1, 1))).period is None
    with pytest.raises(ArgumentTypeError, match="needs a body"):
        _ = Entry("x", "y", "", dict).period


@given(st.floats(0.1, 0.9))
def test_the_fraction_of_layers_is_their_share(share):
    assert LAYERS.fraction("sheet", 4.0 * share) == pytest.approx(share, abs=4e-3)
    assert LAYERS.fraction("solid", 4.0 * (0.5 * share - 0.25)) == pytest.approx(share, abs=4e-3)


@pytest.mark.parametrize("share", [0.2, 0.7])
def test_the_fraction_in_a_body_is_that_of_the_body(share):
    cut = Entry("x", "y", "", Layers, body=frep.box((0, 0, 0), (4, 4, 8)))
    assert cut.fraction("sheet", 4.0 * share) == pytest.approx(share, abs=5e-3)
    assert Entry("x", "y", "", Layers, body=frep.box((0, 0, 0), (1, 1, 1))).fraction("sheet", 1e-3) == 0.0


def test_fraction_of_a_cuboid_period():
    """Crossed walls: what is left of the cell is a box."""
    field = frep.minimum(abs(frep.mod(X, 4.0) - 2.0), abs(frep.mod(Y, 6.0) - 3.0)) - 0.5
    assert fraction_of(frep.Solid(field), (4, 6, 2)) == pytest.approx(1.0 - (3 / 4) * (5 / 6), abs=4e-3)


def test_curves_leave_out_what_is_refused():
    class Choosy(Layers):
        def sheet(self, thickness):
            if thickness > 3.0:
                raise ArgumentError("thickness: too thick")
            return super().sheet(thickness)

    entry = Entry("x", "y", "", Choosy, facts_of=lambda _: Facts(full=1.0))
    widths, shares = entry.curve("sheet", 8)
    np.testing.assert_allclose(widths, [0.25, 0.75, 1.25, 1.75, 2.25, 2.75])
    np.testing.assert_allclose(shares, widths / 4.0, atol=4e-3)


def test_an_unknown_form_is_told():
    with pytest.raises(ArgumentError, match=r"sheet, solid.*did you mean 'sheet'"):
        LAYERS.solid("sheets", 1.0)
    assert set(FORMS.values()) == {"diameter", "thickness", "bias"}


# --- parameters ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given_", "told"),
    [
        ({"cel": 3}, "did you mean 'cell'"),
        ({"cell": 0}, "more than 0 mm"),
        ({"cell": (4, 0, 4)}, "more than 0 mm"),
        ({"cell": float("nan")}, "more than 0 mm"),
        ({"tilt": 2.1}, "0 to 0.5 of the cell 4 mm"),
        ({"cell": 2, "tilt": 1.1}, "0 to 0.5 of the cell 2 mm"),
        ({"pattern": "gamma"}, "one of 'alpha', 'beta'"),
        ({"pattern": "alpa"}, "did you mean 'alpha'"),
        ({"pattern": np.array(["alpha", "beta"])}, "one of 'alpha', 'beta'"),
        ({"count": 10}, "1 to 9"),
    ],
)
def test_what_is_out_of_range_is_refused_with_the_range(given_, told):
    with pytest.raises(ArgumentError, match=told):
        LAYERS.build(**given_)


def test_what_is_in_range_passes_and_fields_are_the_makers_affair():
    assert LAYERS.build(cell=2, tilt=1.0).cell == 2
    LAYERS.build(tilt=X)
    LAYERS.build(cell=(4, 5, 6), count=9, pattern="beta")


def test_a_parameter_without_a_default_is_asked_for():
    entry = Entry("x", "y", "", Layers, (EntryParameter("body", "", help="what is filled", required=True),))
    with pytest.raises(ArgumentError, match=r"body: x needs it: what is filled"):
        entry.build()


@given(st.floats(-1, 3), st.floats(0.1, 10))
def test_shares_of_the_cell_scale_with_it(share, cell):
    parameter = PARAMETERS[1]
    if 0.0 <= share <= 0.5:
        parameter.accept(share * cell, cell)
    elif not -1e-6 < share < 0.500001:
        with pytest.raises(ArgumentError):
            parameter.accept(share * cell, cell)


def test_an_entry_prints_all_of_it():
    told = str(LAYERS)
    for word in ("layers", "mine", "cell = 4 mm (more than 0 mm): the period", "sheet(thickness)", "signed"):
        assert word in told
    assert LAYERS.record()["parameters"][1]["range"] == "0 to 0.5 of the cell"


def test_a_range_without_its_end_says_so():
    assert EntryParameter("angle", 0.5, 0, 1.5, "rad", above=True).range == "more than 0 and at most 1.5 rad"
    assert EntryParameter("cell", 1.0, 0, unit="mm", above=True).range == "more than 0 mm"


# --- known beforehand ------------------------------------------------------------------------------------------------


def test_what_is_known_needs_no_sample_and_what_is_found_out_is_the_same():
    found = LAYERS.found_out()
    assert found.forms == ("sheet", "solid")
    assert found.period == (4.0, 4.0, 4.0)
    np.testing.assert_allclose(np.array(found.fractions["sheet"], float), (np.arange(9) + 0.5) / 9, atol=4e-3)

    def never(**_):
        raise AssertionError("a sample was made")

    known = dataclasses.replace(LAYERS, known=found, make=never)
    assert (known.forms, known.signed, known.valences, known.facts) == (("sheet", "solid"), True, (), Facts(full=1.0))
    assert known.record() == LAYERS.record()
    assert str(known) == str(LAYERS)
    for form in known.forms:
        np.testing.assert_array_equal(known.curve(form), LAYERS.curve(form))
    assert known.shown == LAYERS.shown
    # Asked for otherwise, it is sampled.
    with pytest.raises(AssertionError, match="a sample was made"):
        known.curve("sheet", 5)
    assert dataclasses.replace(known, make=LAYERS.make).found_out() == found


def test_widths_that_were_refused_stay_left_out():
    known = Known(("sheet",), period=(4, 4, 4), facts=Facts(full=1.0), fractions={"sheet": (0.25, None)})
    widths, shares = Entry("x", "y", "", Layers, known=known).curve("sheet", 2)
    np.testing.assert_array_equal((widths, shares), [[1.0], [0.25]])


def test_records_hold_only_what_json_can():
    odd = EntryParameter("body", frep.box((0, 0, 0), (1, 1, 1)), choices=(1, "a"), help="odd")  # type: ignore[arg-type]
    facts = Facts(full=np.float64(1.0), pinch=float("inf"))  # type: ignore[arg-type]
    entry = Entry("x", "y", "", Layers, (odd,), example={"cell": np.float64(4.0)}, facts_of=lambda _: facts)
    record = json.loads(json.dumps(entry.record(), allow_nan=False))
    assert record["parameters"][0]["default"].startswith("<Solid box")
    assert record["parameters"][0]["choices"] == [1, "a"]
    assert (record["pinch"], record["full"], record["sample"]) == (None, 1.0, {"cell": 4.0})


def test_curves_end_somewhere_where_nothing_is_full():
    open_ = Entry("x", "y", "", Grid, PARAMETERS[:1], widest=0.3)
    assert open_.span("thicken") == (0.0, pytest.approx(0.3 * open_.size))
    assert open_.facts.full is None


# --- found -----------------------------------------------------------------------------------------------------------


def announce(folder: Path, name: str, *points: str) -> None:
    """A distribution as an installer leaves it, that announces entry points."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n" + "\n".join(points) + "\n")


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "mine_for_tests.py").write_text(
        "from frep.catalogue import Entry\n"
        "ENTRIES = [Entry('one_for_tests', 'mine', 'First.', dict), Entry('two_for_tests', 'mine', 'Second.', dict)]\n"
        "AGAIN = [Entry('one_for_tests', 'yours', 'Another.', dict), Entry('three_for_tests', 'yours', 'Third.', dict)]\n"
        "NUMBERS = [1, 2]\n"
        "UNNAMED = [Entry(7, 'mine', 'A number.', dict)]\n"
        "def MAKER(): return ENTRIES\n"
    )
    (tmp_path / "quits_for_tests.py").write_text("import sys\nsys.exit('no licence')\n")
    (tmp_path / "breaks_for_tests.py").write_text(
        "def made():\n    raise ZeroDivisionError('in the middle')\n    yield\nENTRIES = made()\n"
    )
    importlib.invalidate_caches()
    return tmp_path


def test_what_a_package_announces_is_found(site):
    announce(site, "mine", "mine = mine_for_tests:ENTRIES")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = discover()
    assert found["one_for_tests"].summary == "First."
    assert list(of_family(found, "mine")) == ["one_for_tests", "two_for_tests"]


@pytest.mark.parametrize(
    "value",
    [
        "no_such_module:ENTRIES",
        "mine_for_tests:MISSING",
        "mine_for_tests:NUMBERS",
        "mine_for_tests:UNNAMED",
        "mine_for_tests:MAKER",
        "frep:__version__x",
        "quits_for_tests:ENTRIES",
        "breaks_for_tests:ENTRIES",
    ],
)
def test_a_broken_announcement_is_left_out_with_a_warning(site, value):
    announce(site, "broken", f"broken = {value}")
    announce(site, "mine", "mine = mine_for_tests:ENTRIES")
    with pytest.warns(CatalogueWarning, match=value) as told:
        found = discover()
    assert {"one_for_tests", "two_for_tests"} <= set(found)
    assert len(told) == 1


def test_a_name_is_not_taken_twice(site):
    announce(site, "amine", "mine = mine_for_tests:ENTRIES")
    announce(site, "zmine", "mine = mine_for_tests:ENTRIES", "other = mine_for_tests:AGAIN")
    with pytest.warns(CatalogueWarning, match="repeats the name 'one_for_tests'"):
        found = discover()
    assert "three_for_tests" in found


def test_this_package_announces_what_it_has(site):
    """What pyproject.toml declares can be loaded, whether or not the installation here is fresh."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"][GROUP]
    assert declared
    announce(site, "fresh", *(f"{name} = {value}" for name, value in declared.items()))
    found = discover()
    for value in declared.values():
        module, _, attribute = value.partition(":")
        entries = getattr(importlib.import_module(module), attribute)
        assert len(entries) > 20
        assert {entry.name for entry in entries} <= set(found)


def test_an_unknown_name_or_family_suggests_the_nearest():
    entries = {entry.name: entry for entry in (LAYERS, GRID)}
    assert find(entries, "grid") is GRID
    with pytest.raises(ArgumentError, match="did you mean 'layers'"):
        find(entries, "layer")
    with pytest.raises(ArgumentError, match="there are layers, grid"):
        find(entries, "qqq")
    with pytest.raises(ArgumentError, match="mine"):
        of_family(entries, "yours")
    assert suggestion("qqq", entries) == ""
