"""The gallery's parts are the parts they were, and a part that is not would be noticed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import frep
import gallery
from frep.cli import run
from frep.design import load_design, parameters
from frep.mesh import Mesh
from gallery.__main__ import app, compare
from gallery.check import compare_numbers, compare_pictures, numbers, side_by_side
from gallery.entries import BASELINES, ENTRIES

INFILL = Path(gallery.__file__).parent / "infill.py"


@pytest.mark.parametrize("item", ENTRIES, ids=lambda item: item.name)
def test_the_part_is_the_part_it_was(item, tmp_path, capsys):
    if item.missing:
        pytest.skip(item.missing)
    assert compare(item, tmp_path), capsys.readouterr().out


@pytest.mark.parametrize("item", ENTRIES, ids=lambda item: item.name)
def test_every_entry_has_a_sound_baseline(item):
    """Stored numbers of a part that is closed, manifold and oriented, and a picture that shows something."""
    stored = json.loads((BASELINES / f"{item.name}.json").read_text())
    assert stored["closed"]
    assert stored["manifold"]
    assert stored["oriented"]
    assert 0 < stored["volume"] < np.prod(np.diff(stored["bounds"], axis=0))
    assert np.asarray(Image.open(BASELINES / f"{item.name}.png").convert("L")).std() > 10


@pytest.mark.parametrize("item", ENTRIES, ids=lambda item: item.name)
def test_entries_set_declared_parameters(item):
    declared = parameters(item.path)
    assert set(item.shown) | set(item.compared) <= set(declared)
    assert {"title", "voxel"} <= set(declared)


@pytest.mark.parametrize(("size", "longest"), [(None, 30.0), ("60", 60.0)])
def test_infill_keeps_a_body_as_large_as_it_is_unless_told(size, longest, tmp_path):
    frep.box((5, 0, 0), (35, 20, 10)).mesh(voxel=1.0).save(tmp_path / "part.stl")
    told = {"body": str(tmp_path / "part.stl"), "voxel": "2", **({"size": size} if size else {})}
    part = load_design(INFILL, told).part
    points = np.array([[5.5, 10, 5], [34.5, 10, 5], [4.5, 10, 5], [35.5, 10, 5]]) * longest / 30.0
    assert part.contains(points).tolist() == [True, True, False, False]


# The comparison itself


@pytest.fixture
def two_pictures(tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (60, 80, 3), dtype=np.uint8)
    for name in ("old", "new"):
        Image.fromarray(noise).save(tmp_path / f"{name}.png")
    return tmp_path / "old.png", tmp_path / "new.png"


def verdicts(lines) -> dict[str, bool]:
    return {line.name: line.good for line in lines}


def test_equal_pictures_pass(two_pictures):
    assert all(verdicts(compare_pictures(*two_pictures)).values())


def test_a_moved_part_fails(two_pictures):
    old, new = two_pictures
    Image.fromarray(np.roll(np.asarray(Image.open(old)), 2, axis=1)).save(new)
    assert not any(verdicts(compare_pictures(old, new)).values())


def test_a_darker_picture_fails_by_its_difference(two_pictures):
    old, new = two_pictures
    Image.fromarray((np.asarray(Image.open(old)) * 0.97).astype(np.uint8)).save(new)
    assert verdicts(compare_pictures(old, new)) == {"picture difference": False, "picture similarity": True}


def test_a_picture_of_another_size_fails(two_pictures):
    old, new = two_pictures
    Image.open(old).resize((40, 30)).save(new)
    assert verdicts(compare_pictures(old, new)) == {"picture size": False}


def test_side_by_side_shows_both_and_the_difference(two_pictures, tmp_path):
    old, new = two_pictures
    changed = np.asarray(Image.open(old)).copy()
    changed[10, 20] = 255 - changed[10, 20]
    Image.fromarray(changed).save(new)
    side_by_side(old, new, tmp_path / "both.png")
    both = np.asarray(Image.open(tmp_path / "both.png"))
    assert both.shape == (60, 240, 3)
    assert np.array_equal(both[:, :80], np.asarray(Image.open(old)))
    assert np.array_equal(both[:, 80:160], changed)
    assert np.argwhere(both[:, 160:].min(axis=2) < 255).tolist() == [[10, 20]]


def tetrahedron() -> Mesh:
    return Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
        np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
    )


def test_numbers_are_the_parts_own():
    told = numbers(tetrahedron(), 512, {"voxel": 0.5})
    assert told["volume"] == pytest.approx(1 / 6, abs=1e-3)
    assert told["bounds"] == [[0, 0, 0], [1, 1, 1]]
    assert (told["triangles"], told["components"], told["genus"], told["closed"]) == (4, 1, 0, True)
    assert all(verdicts(compare_numbers(told, told)).values())
    assert json.loads(json.dumps(told)) == told


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("volume", 1 / 6 * 1.001),
        ("area", 2.5),
        ("bounds", [[0, 0, 0], [1, 1, 1.001]]),
        ("triangles", 5),
        ("components", 2),
        ("genus", 1),
        ("closed", False),
        ("voxels evaluated", 600),
        ("voxel", 0.4),
        ("volume", None),
    ],
)
def test_every_number_is_compared(name, value):
    """A change beyond the tolerance is noticed, of each number, and only of that one."""
    told = numbers(tetrahedron(), 512, {"voxel": 0.5})
    found = verdicts(compare_numbers(told, {**told, name: value}))
    assert [key for key, good in found.items() if not good] == [name]


def test_a_number_that_only_one_side_has_fails():
    told = numbers(tetrahedron(), 512, {})
    assert verdicts(compare_numbers(told, {**told, "colour": "red"}))["colour"] is False
    assert verdicts(compare_numbers({**told, "colour": "red"}, told))["colour"] is False


def test_the_command_refuses_unknown_entries_and_contradictions(capsys):
    assert run(app, ["--only", "no_such_entry"]) == 1
    assert "bcc_parabola" in capsys.readouterr().err
    assert run(app, ["--check", "--update"]) == 1


def test_a_missing_baseline_is_a_difference(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("gallery.__main__.BASELINES", tmp_path)
    assert compare(ENTRIES[0], tmp_path / "new") is False
    assert "--update" in capsys.readouterr().out
