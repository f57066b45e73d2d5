"""What every argument is checked by."""

from __future__ import annotations

import numpy as np
import pytest

import frep
from frep import ArgumentError, ArgumentTypeError
from frep.arguments import refuse_nan, width
from topologies import beams, tpms


@pytest.mark.parametrize("value", [True, np.True_])
def test_a_truth_value_is_no_width(value):
    with pytest.raises(ArgumentTypeError, match="thickness: expected a number"):
        tpms.gyroid(cell=5).sheet(value)
    with pytest.raises(ArgumentTypeError, match="diameter: expected a number"):
        beams.bcc(cell=5).thicken(value)
    x = frep.coordinates()[0]
    assert width(x > 1, "thickness") is (x > 1)


@pytest.mark.parametrize("shape", [(4,), (4, 3), (4, 2, 3)])
def test_nan_is_counted_and_placed(shape):
    array = np.zeros(shape)
    refuse_nan(array, "seeds", "seed")
    refuse_nan(array[:0], "seeds", "seed")
    array[1] = np.nan
    array.reshape(4, -1)[3, 0] = np.inf
    with pytest.raises(ArgumentError, match="2 of 4 seeds have NaN or infinite ones, the first is seed 1"):
        refuse_nan(array, "seeds", "seed")
