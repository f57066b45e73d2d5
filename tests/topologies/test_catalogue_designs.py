"""Designs of experiments: those that differ, each once, and no shape that was asked for is lost."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frep
from frep import ArgumentError
from topologies import catalogue
from topologies.catalogue import Design, doe, make

RNG = np.random.default_rng(12)
X, Y, Z = frep.coordinates()


def kinds(designs: list[Design]) -> set[str]:
    return {design.variant for design in designs}


def test_thickness_says_nothing_of_solid_and_inverse():
    found = doe("iwp", variants=("solid", "inverse"), thickness=[0.5, 1.0], bias=[-0.2, 0.2])
    assert [(d.variant, dict(d.parameters)) for d in found] == [
        ("solid", {"bias": -0.2}),
        ("solid", {"bias": 0.2}),
        ("inverse", {"bias": -0.2}),
        ("inverse", {"bias": 0.2}),
    ]


@pytest.mark.parametrize("name", ["gyroid", "schwarz_p", "schwarz_d"])
def test_congruent_surfaces_need_no_inverse_and_no_negative_bias_of_walls(name):
    found = doe(name, thickness=[0.5, 1.0], bias=[-0.4, -0.2, 0.0, 0.2, 0.4])
    assert kinds(found) == {"solid", "thin", "twin"}
    assert [d.parameters["bias"] for d in found if d.variant == "solid"] == [-0.4, -0.2, 0.0, 0.2, 0.4]
    assert all(d.parameters["bias"] >= 0.0 for d in found if d.variant != "solid")
    assert len(found) == 5 + 2 * 3 + 2 * 3


def test_other_surfaces_need_them_all():
    found = doe("iwp", thickness=[0.5, 1.0], bias=[-0.2, 0.0, 0.2])
    assert kinds(found) == {"solid", "inverse", "thin", "twin"}
    assert len(found) == 3 + 3 + 2 * 3 + 2 * 3


@pytest.mark.parametrize(("name", "there"), [("bcc", ["thin"]), ("kelvin", ["thin", "twin"]), ("columns", ["thin"])])
def test_unsigned_waveforms_are_thin_or_twin(name, there):
    """Their Solid at a bias is Thin of twice that, their Inverse Twin; what lies between walls is no wall."""
    found = doe(name, thickness=[0.5, 1.0], bias=[0.0, 0.3])
    assert [(d.variant, dict(d.parameters)) for d in found] == [
        (v, {"thickness": t}) for v in there for t in (0.5, 1.0)
    ]
    points = RNG.uniform(-10, 10, (500, 3))
    if "twin" in there:
        np.testing.assert_array_equal(found[0].solid().contains(points), ~found[2].solid().contains(points))
    with pytest.raises(ArgumentError, match="only in thin"):
        doe(name, variants="solid", thickness=1.0)


@given(
    st.sets(st.sampled_from([-0.9, -0.5, -0.3, 0.0, 0.3, 0.5, 0.9]), min_size=1),
    st.sets(st.sampled_from([0.4, 0.8, 1.2]), min_size=1),
    st.sampled_from(["gyroid", "iwp"]),
)
def test_no_shape_that_was_asked_for_is_lost_and_none_comes_twice(biases, walls, name):
    """Every variant, wall and bias is listed, itself or as the design that has its shape."""
    found = [
        (d.variant, d.parameters.get("thickness"), d.parameters["bias"])
        for d in doe(name, thickness=list(walls), bias=list(biases))
    ]
    assert len(found) == len(set(found))
    congruent = name == "gyroid"
    for b in biases:
        assert ("solid", None, b) in found
        assert ("inverse", None, b) in found or (congruent and ("solid", None, -b) in found)
        for t, variant in itertools.product(walls, ("thin", "twin")):
            assert (variant, t, b) in found or (congruent and (variant, t, -b) in found)
    assert congruent == ("inverse" not in {v for v, _, _ in found})


@pytest.mark.parametrize("variant", ["inverse", "thin", "twin"])
def test_what_was_left_out_has_the_shape_of_what_is_listed(variant):
    """Half a gyroid's cell on, along its diagonal, turned over: the listed design is the one left out."""
    surface = make("gyroid")
    kept = doe("gyroid", variants=variant, thickness=0.8, bias=-0.6)
    assert len(kept) == 1
    solid = kept[0].solid()
    left_out = {
        "inverse": lambda: surface.inverse(-0.6),
        "thin": lambda: surface.sheet(0.8, bias=-0.6),
        "twin": lambda: surface.twin(0.8, bias=-0.6),
    }[variant]()
    points = RNG.uniform(-10, 10, (800, 3))
    # sin(-x) cos(-y) = -sin x cos y: the point reflection is what changes the sign.
    np.testing.assert_allclose(solid.field(-points), left_out.field(points), atol=5e-3)


def test_lists_of_parameters_are_taken_one_by_one():
    found = doe("truncated_octahedron", thickness=1.0, setback=[1.0, 2.5, 4.0], cell=[10.0, (10.0, 10.0, 12.0)])
    assert len(found) == 6
    assert {d.parameters["setback"] for d in found} == {1.0, 2.5, 4.0}
    assert {d.parameters["cell"] for d in found} == {10.0, (10.0, 10.0, 12.0)}
    part = found[0].solid() & frep.box((0, 0, 0), (10, 10, 10))
    assert part.mesh(voxel=0.5).check().printable
    assert "setback=1.0" in repr(found[0])


def test_arrays_and_ranges_of_numbers_are_lists_too():
    found = doe("gyroid", variants="thin", thickness=1.0, cell=np.linspace(4, 6, 3))
    assert [d.parameters["cell"] for d in found] == [4.0, 5.0, 6.0]
    assert [d.parameters["cell"] for d in doe("bcc", thickness=1.0, cell=range(4, 6))] == [4, 5]
    shifts = (0.1, 0.2, 0.3)
    assert [d.parameters["phase"] for d in doe("gyroid", variants="thin", thickness=1.0, phase=shifts)] == [shifts]


def test_equal_values_are_one():
    assert len(doe("bcc", thickness=[1, 1.0], cell=[[5, 6, 7], [5, 6, 7], (5.0, 6.0, 7.0)])) == 1
    assert len(doe("gyroid", variants="thin", thickness=1.0, phase=[np.zeros(3), np.zeros(3)])) == 1


def test_drops_and_laws_break_the_congruence():
    assert "inverse" in kinds(doe("gyroid", thickness=1.0, drop_x=0.5))
    assert "inverse" not in kinds(doe("gyroid", thickness=1.0))
    graded = doe("gyroid", variants=("thin", "solid", "inverse"), thickness=[1.0 + 0.01 * X], bias=[-0.2, 0.2])
    assert [d.parameters["bias"] for d in graded if d.variant == "thin"] == [-0.2, 0.2]


@pytest.mark.parametrize(
    ("given_", "told"),
    [
        ({"variants": "thick"}, "did you mean 'thin'"),
        ({"variants": "thin"}, "thickness: thin needs one"),
        ({"thickness": [1.0, -1.0]}, "thickness"),
        ({"thickness": 1.0, "cel": [5, 6]}, "did you mean 'cell'"),
        ({"thickness": 1.0, "drop_x": [0.0, 1.5]}, "-1 to 1"),
        ({"thickness": 1.0, "variants": None}, "variants: expected some of"),
        ({"thickness": 1.0, "variants": []}, "got none"),
        ({"thickness": 1.0, "variants": [3]}, "variants: expected solid"),
        ({"thickness": 1.0, "bias": []}, "bias: expected a value"),
        ({"thickness": 1.0, "cell": []}, "cell: expected a value"),
    ],
)
def test_what_cannot_be_enumerated_is_told(given_, told):
    with pytest.raises(frep.FrepError, match=told):
        doe("gyroid", **given_)


def test_a_design_does_not_change():
    design = doe("bcc", thickness=1.0)[0]
    with pytest.raises(TypeError):
        design.parameters["thickness"] = 2.0  # type: ignore[index]
    assert catalogue.VARIANTS["thin"] == "sheet"


def test_designs_of_random_lattices_share_their_body():
    body = frep.box((0, 0, 0), (10, 10, 10))
    found = doe("voronoi", thickness=[0.6, 0.9], body=body, cell_size=[4.0, 5.0], random_state=1)
    assert [(d.parameters["cell_size"], d.parameters["thickness"]) for d in found] == [
        (4.0, 0.6),
        (4.0, 0.9),
        (5.0, 0.6),
        (5.0, 0.9),
    ]
    assert (found[3].solid() & body).mesh(voxel=0.4).check().printable
