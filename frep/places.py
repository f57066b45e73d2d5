"""Places spread evenly through a period, and the share of them that a solid has: its volume fraction."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from .solid import Solid

PLACES = 110_000
"""Places in a period: the share of them in the material is that of the volume within 0.0015, mostly within 0.0005; of walls along
the axes within 0.0002."""


@lru_cache(maxsize=4)
def spread(count: int = PLACES) -> np.ndarray:
    """(count, 3) places in a unit cube, spread evenly and in no rows: walls along the axes are measured as others are.

    Multiples of the powers of 1 / g, with g**4 = g + 1 (Roberts 2018, after Niederreiter 1992), in an order in which
    those near each other follow each other.

    Example:
        >>> round(float((spread()[:, 0] < 0.1).mean()), 3)
        0.1
    """
    g = 1.2207440846057596
    places = np.mod(0.5 + np.arange(1, count + 1)[:, None] * g ** -np.arange(1.0, 4.0), 1.0)
    i, j, k = np.floor(places * round((count / 100) ** (1 / 3))).T
    places = places[np.lexsort((k, j, i))]
    places.setflags(write=False)
    return places


def share_within(solid: Solid, period: Any, count: int = PLACES, axes: Any = None) -> float:
    """Share of a period that a solid fills, by the places in it.

    Args:
        solid: fills all space.
        period: (3,) mm.
        count: of places; the error of the share falls nearly as their number grows.
        axes: (3, 3) the directions of the period's sides as columns, if they are not x, y and z.

    Example:
        >>> import frep
        >>> z = frep.coordinates()[2]
        >>> round(share_within(frep.Solid(abs(frep.mod(z, 4.0) - 2.0) - 0.5), (4, 4, 4)), 3)
        0.25
    """
    places = np.asarray(period, float) * spread(count)
    if axes is not None:
        places = places @ np.asarray(axes, float).T
    return float((solid.field(places) < 0.0).mean())
