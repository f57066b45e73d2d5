"""Thickness for a fraction: measured against Solid.volume where one cell is not like another, thin, flat or with balls."""

from __future__ import annotations

import math

import numpy as np
import pytest

import frep
from frep import ArgumentError, ArgumentTypeError
from graded import thickness_for, transition, volume_fraction_curve
from topologies import beams, foams, noise, stochastic, tpms
from topologies import seeds as seeding
from topologies.catalogue import describe

X = frep.coordinates()[0]
BOX = frep.box((0, 0, 0), (20, 20, 20))


def measured(solid: frep.Solid, period, samples: int = 90) -> float:
    volume = math.prod(period)
    return (solid & frep.box((0, 0, 0), period)).volume(voxel=volume ** (1 / 3) / samples) / volume


def counted(solid: frep.Solid) -> float:
    """By 100,000 random points of the box, within 0.0016 as standard error."""
    return solid.contains(np.random.default_rng(5).uniform(0, 20, (100_000, 3))).mean()


def test_many_cells_in_a_period():
    """A random foam's struts are much thinner than its period."""
    lattice = stochastic.voronoi(BOX, seeds=seeding.uniform(BOX, 150, random_state=1), periodic=True)
    diameter = thickness_for(lattice, 0.05)
    assert counted(lattice.thicken(diameter)) == pytest.approx(0.05, abs=0.005)


def test_random_walls():
    points = seeding.uniform(BOX, 60, random_state=1)

    def foam(wall: float) -> frep.Solid:
        return stochastic.voronoi_walls(BOX, wall, seeds=points, periodic=True)

    assert counted(foam(thickness_for(foam, 0.3, cell=20))) == pytest.approx(0.3, abs=0.005)


def cells_left(name: str, t: float) -> float:
    """The share of space that walls of t leave of cells of side 1."""
    if name == "kelvin":
        # Two octahedra less their tips, all of whose faces move inwards by t / 2.
        whole, face = 0.75 - math.sqrt(3) / 2 * t, 0.5 - t / 2
        return 2 * (4 / 3 * whole**3 - 4 * max(whole - face, 0.0) ** 3)
    # All faces of the others touch one ball: they shrink to similar ones.
    depth, dimensions = {"honeycomb": (0.5, 2), "rhombic": (1 / math.sqrt(8), 3), "closed_cubes": (0.5, 3)}[name]
    return (1 - t / (2 * depth)) ** dimensions


@pytest.mark.parametrize("name", ["honeycomb", "kelvin", "rhombic", "closed_cubes"])
def test_foams_tell_their_period(name):
    foam = getattr(foams, name)(6.0)
    for fraction in (0.03, 0.3, 0.9):
        assert 1 - cells_left(name, thickness_for(foam, fraction) / 6) == pytest.approx(fraction, abs=0.003)


def test_walls_along_the_axes_are_not_missed_or_counted_twice():
    """Cubes' walls lie in planes, in which the places of a grid would all be in or out at once."""
    walls, fractions = volume_fraction_curve(foams.closed_cubes(10.0), np.linspace(0.1, 9, 60))
    np.testing.assert_allclose(fractions, 1 - (1 - walls / 10) ** 3, atol=0.0015)


@pytest.mark.parametrize("fraction", [0.01, 0.1, 0.5])
@pytest.mark.parametrize("size", [(20, 20, 2), (10, 5, 20)])
def test_cuboid_cells(size, fraction):
    lattice = beams.bcc(cell=size)
    part = lattice.thicken(thickness_for(lattice, fraction))
    assert measured(part, size) == pytest.approx(fraction, abs=0.005)


@pytest.mark.parametrize("fraction", [0.04, 0.2, 0.95])
def test_balls_of_their_own_size_are_there_without_beams(fraction):
    lattice = beams.bcc(cell=10)
    part = lattice.thicken(thickness_for(lattice, fraction, node=3.0), node=3.0)
    assert measured(part, (10, 10, 10), 120) == pytest.approx(fraction, abs=0.005)
    balls = 2 * 4 / 3 * math.pi * 1.5**3 / 1000
    with pytest.raises(ArgumentError, match=rf"fills {balls:.3f}"):
        thickness_for(lattice, 0.5 * balls, node=3.0)


def test_the_catalogue_measures_alike():
    """Walls in the planes of a grid, and of two in one."""
    for entry, width in ((describe("closed_cubes"), 0.1), (describe("double_gyroid"), 1.6), (describe("bcc"), 2.0)):
        form = entry.forms[0]
        _, fractions = volume_fraction_curve(entry.sample, [width], form=form)
        assert entry.fraction(form, width) == pytest.approx(fractions[0], abs=1e-9)


def test_spinodal_walls():
    structure = noise.spinodal(5, repeat=2, random_state=1)
    assert measured(structure.sheet(thickness_for(structure, 0.2)), structure.period, 60) == pytest.approx(
        0.2, abs=0.005
    )


def test_whole_multiples_of_the_period_will_do_others_not():
    lattice = beams.bcc(cell=10)
    assert thickness_for(lattice, 0.2, cell=(20, 10, 30)) == pytest.approx(thickness_for(lattice, 0.2), rel=0.01)
    for cell in (7, 5, (10, 10, 15)):
        with pytest.raises(ArgumentError, match=r"cell: .*10 x 10 x 10"):
            thickness_for(lattice, 0.2, cell=cell)


@pytest.mark.parametrize(
    ("error", "text", "call"),
    [
        (ArgumentTypeError, "sections: .*'section'", lambda: thickness_for(beams.bcc(), 0.2, sections="square")),
        (ArgumentTypeError, "node: .*same all over", lambda: thickness_for(beams.bcc(), 0.2, node=2 + 0.1 * X)),
        (ArgumentTypeError, "gives? a Solid", lambda: thickness_for(lambda w: w, 0.2, cell=10)),
        (ArgumentError, "form: .*'sheet'", lambda: thickness_for(tpms.gyroid(), 0.2, form="shet")),
        (ArgumentError, "percent", lambda: thickness_for(beams.bcc(), 30)),
        (ArgumentError, "widths", lambda: volume_fraction_curve(beams.bcc(cell=10), [1e9])),
        (ArgumentTypeError, "widths", lambda: volume_fraction_curve(beams.bcc(cell=10), "wide")),
    ],
)
def test_bad_input(error, text, call):
    with pytest.raises(error, match=text):
        call()


@pytest.mark.parametrize("turn", [("z", 0.5), ((1, 1, 0), 0.9)])
def test_cells_are_measured_along_their_own_axes(turn):
    """A box of space would hold parts of cells only: 0.005 off, and more where cells are flat."""
    for cell in (10, (6, 8, 12)):
        for make, turned in (
            (tpms.gyroid, lambda c: tpms.gyroid(c, rotation=turn)),
            (beams.octet, lambda c: beams.octet(c).rotate(*turn)),
        ):
            _, (moved,) = volume_fraction_curve(turned(cell), [1.0])
            _, (still,) = volume_fraction_curve(make(cell), [1.0])
            assert moved == pytest.approx(still, abs=5e-5)


def test_cells_that_differ_have_no_fraction_of_their_own():
    pair = transition(tpms.gyroid(8), tpms.schwarz_p(8), plane=((4, 0, 0), "x"), width=4)
    varying = [
        pair,
        tpms.gyroid(8, phase=(X / 20, 0, 0)),
        tpms.gyroid(8, phase=(0, frep.sin(X / 20), 0)),
        tpms.gyroid(8, drop_x=frep.clip(X / 20, 0, 1), scale="gradient"),
        tpms.primitive_gyroid_diamond(frep.clip(X / 20, 0, 1.4), 8),
    ]
    for surface in varying:
        with pytest.raises(ArgumentError, match="no period"):
            thickness_for(surface, 0.3)
    assert tpms.gyroid(8).repeats
    # A box of them has one.
    _, (fraction,) = volume_fraction_curve(pair, [0.8], cell=(8, 8, 8))
    assert fraction == pytest.approx(measured(pair.sheet(0.8), (8, 8, 8), 60), abs=0.005)


def test_a_surface_without_a_third_period_has_no_fraction_of_its_own():
    """Scherk's surface turns from one set of planes into another along z: its fraction depends on where one looks."""
    with pytest.raises(ArgumentError, match="period"):
        thickness_for(tpms.scherk(cell=10), 0.3)
