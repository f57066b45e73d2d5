"""Fields from data: so far the distance to a body."""

from __future__ import annotations

from frep import ArgumentTypeError, Field, Solid


def distance_to(solid: Solid) -> Field:
    """Distance to the surface of a solid, mm, positive on both sides.

    Exact where the solid's field is an exact distance (primitives, loaded bodies), a lower bound elsewhere.

    Example:
        >>> import frep
        >>> distance_to(frep.sphere((0, 0, 0), 5))([[0, 0, 0], [0, 0, 7]])
        array([5., 2.])
    """
    if not isinstance(solid, Solid):
        raise ArgumentTypeError(f"solid: expected a Solid, got {type(solid).__name__}: {solid!r}")
    return abs(solid.field)
