"""Places in a period: even in every box, and volume fractions in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import frep
from frep.places import PLACES, share_within, spread

X, Y, Z = frep.coordinates()
SIDE = st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted)


@settings(max_examples=60, deadline=None)
@given(side=SIDE, axis=st.integers(0, 2))
def test_every_layer_has_its_share(side, axis):
    """Places thrown at random would be 0.0015 off, as standard error."""
    low, high = side
    at = spread()[:, axis]
    assert ((at >= low) & (at < high)).mean() == pytest.approx(high - low, abs=2e-4)


@settings(max_examples=60, deadline=None)
@given(sides=st.lists(SIDE, min_size=3, max_size=3))
def test_every_box_has_its_share(sides):
    low, high = np.array(sides).T
    share = np.all((spread() >= low) & (spread() < high), axis=1).mean()
    assert share == pytest.approx(float(np.prod(high - low)), abs=4e-3)


def test_places_lie_in_no_rows():
    places = spread()
    assert places.shape == (PLACES, 3)
    assert all(len(np.unique(places[:, axis])) == PLACES for axis in range(3))


@pytest.mark.parametrize("wall", [0.02, 0.1, 1.0, 3.0])
@pytest.mark.parametrize("start", [0.0, 0.5, 0.777])
def test_layers_along_an_axis(wall, start):
    """However thin, and wherever they lie."""
    layers = frep.Solid(abs(frep.mod(Z - start, 4.0) - 2.0) - 0.5 * wall)
    assert share_within(layers, (4, 7, 4)) == pytest.approx(wall / 4, abs=3e-4)


@pytest.mark.parametrize("radius", [0.3, 1.0, 1.9])
def test_balls_in_a_cuboid_period(radius):
    ball = frep.sphere((2, 3, 2), radius)
    expected = 4 / 3 * math.pi * radius**3 / (4 * 6 * 4)
    assert share_within(ball, (4, 6, 4)) == pytest.approx(expected, abs=6e-4)
    assert share_within(~ball, (4, 6, 4)) == pytest.approx(1 - expected, abs=6e-4)
