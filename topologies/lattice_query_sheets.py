"""The calls of LatticeQuery for surfaces; `topologies.lattice_query` says what they have in common."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import frep
from frep import Solid
from frep.arguments import positive, sizes
from frep.errors import warn
from frep.solid import Feature

from . import tpms
from .lattice_query_laws import Law, Sample, checked_range, one_of, whole_counts
from .variants import PeriodicSurface, SealedChannelWarning

_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


class SolidCellsWarning(UserWarning):
    """A wall so thick that the cells are solid from somewhere on."""


def _sheets(
    surface: PeriodicSurface,
    thicknesses: tuple[Any, Any],
    counts: tuple[Any, Any, Any],
    rule: str,
    axis: int,
    sample: Sample,
) -> Solid:
    cells = whole_counts(Nx=counts[0], Ny=counts[1], Nz=counts[2])
    one_of(sample, "sample", ("cell", "point"))
    law = Law(rule, *checked_range(*thicknesses, "thickness"), cells[axis], surface.cell[axis], axis)
    thick = float(law.layers.max()) if sample == "cell" else law.field(sample).bounds(*[[-np.inf] * 3, [np.inf] * 3])[1]
    wall = _wall(law, sample)
    part = surface.sheet(wall)
    solid_from = surface.full * min(surface.cell)
    if thick >= solid_from:
        warn(
            f"max_thickness: a wall of {thick:g} mm fills the cells of {surface!r}, which are solid from {solid_from:.3g} mm on",
            SolidCellsWarning,
        )
    return part & frep.box((0.0, 0.0, 0.0), tuple(n * c for n, c in zip(cells, surface.cell, strict=True)))


def _wall(law: Law, sample: Sample) -> Any:
    """A number where the law has one value."""
    return law.low if law.low == law.high and law.rule != "parabola_thesis" else law.field(sample)


def _half_turn(cell: Any) -> PeriodicSurface:
    """LatticeQuery's gyroid: the formula's, half a cell on along x."""
    return tpms.gyroid(sizes(cell, "unit_cell_size"), phase=(math.pi, 0.0, 0.0))


def gyroid_homogeneous_lattice(unit_cell_size: Any, thickness: float, Nx: int, Ny: int, Nz: int) -> Solid:
    """Gyroid sheets of one thickness.

    Differs from LatticeQuery, whose cells come out twice the size asked for.

    Raises:
        ArgumentError: sizes that are not positive, no cells, a wall that fills the cell.

    Warns:
        SealedChannelWarning: a wall that seals the channels.
    """
    wall = positive(thickness, "thickness")
    return _sheets(_half_turn(unit_cell_size), (wall, wall), (Nx, Ny, Nz), "linear", 2, "cell")


def gyroid_heterogeneous_lattice(
    unit_cell_size: Any,
    min_thickness: float,
    max_thickness: float,
    Nx: int,
    Ny: int,
    Nz: int,
    direction: str = "z",
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Gyroid sheets. `direction`: "x", "y" or "z", along which the thickness changes.

    Else as `schwartz_p_heterogeneous_lattice`.
    """
    axis = "xyz".index(one_of(direction, "direction", ("x", "y", "z")))
    walls = (min_thickness, max_thickness)
    return _sheets(_half_turn(unit_cell_size), walls, (Nx, Ny, Nz), rule, axis, sample)


def schwartz_p_heterogeneous_lattice(
    unit_cell_size: Any,
    min_thickness: float,
    max_thickness: float,
    Nx: int,
    Ny: int,
    Nz: int,
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Schwarz P sheets (LF-rep Listing 4). Grading and rules: see the module.

    Raises:
        ArgumentError: an unknown rule or sample; sizes that are not positive; min above max; no cells; a wall that fills the
            cell everywhere.

    Warns:
        SealedChannelWarning: a wall, somewhere, that seals the channels (from 0.471 of the cell on).
        SolidCellsWarning: a wall, somewhere, that fills the cell (from 0.866 of it on): the part is solid there.

    Example:
        >>> schwartz_p_heterogeneous_lattice(20, 0.1, 7, 10, 10, 10).bounds.tolist()
        [[0.0, 0.0, 0.0], [200.0, 200.0, 200.0]]
    """
    surface = tpms.schwarz_p(sizes(unit_cell_size, "unit_cell_size"))
    return _sheets(surface, (min_thickness, max_thickness), (Nx, Ny, Nz), rule, 2, sample)


def schwartz_d_heterogeneous_lattice(
    unit_cell_size: Any,
    min_thickness: float,
    max_thickness: float,
    Nx: int,
    Ny: int,
    Nz: int,
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Schwarz D sheets, four hexagons a cell. Else as `schwartz_p_heterogeneous_lattice`."""
    surface = tpms.schwarz_d(sizes(unit_cell_size, "unit_cell_size"), period="pi")
    return _sheets(surface, (min_thickness, max_thickness), (Nx, Ny, Nz), rule, 2, sample)


def transition_layer(
    min_thickness: float,
    max_thickness: float,
    unit_cell_size: float,
    size_1: int,
    size_2: int,
    direction: str = "X+",
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> tuple[Solid, Solid, Solid]:
    """Half a cell of gyroid, half a cell of Schwarz P, and the half cell between them, in which one becomes the other.

    Args:
        size_1, size_2: cells along the next axis and the one after it, cyclically: for "Y+" along z and x. The thickness
            changes along the second.
        direction: "X+", "X-", "Y+", "Y-", "Z+" or "Z-": from the gyroid to P. With "-" P is at the origin.

    Returns:
        the gyroid, P, the transition. They are cut from one wall: their union is one part.

    The level is (1 - w) gyroid + w P, with w a smoothstep across the gap, and the wall is measured along the normal of its
    surface, as that of any two surfaces `blended` (lf-rep 6.4). Differs from LatticeQuery, whose plates leave gaps and edges:
    the middles of P's necks lie where LatticeQuery's patches end, half a cell from the gyroid, and the block starts at the
    origin in every direction.

    Raises:
        ArgumentError: an unknown direction, rule or sample; sizes that are not positive; min above max; no cells.

    Warns:
        SealedChannelWarning: a wall that seals the channels of the gyroid.
    """
    u = positive(unit_cell_size, "unit_cell_size")
    sizes = whole_counts(size_1=size_1, size_2=size_2)
    one_of(direction, "direction", ("X+", "X-", "Y+", "Y-", "Z+", "Z-"))
    one_of(sample, "sample", ("cell", "point"))
    axis = "XYZ".index(direction[0])
    order = [(axis + i) % 3 for i in range(3)]
    low, high = checked_range(min_thickness, max_thickness, "thickness")
    law = Law(rule, low, high, sizes[1], u, order[2])
    wall = frep.as_field(law.field(sample))
    thick = float(wall.bounds(*_EVERYWHERE)[1])
    gyroid = tpms.gyroid(u, phase=(math.pi, 0.0, 0.0))
    if thick >= gyroid.pinch * u:
        warn(
            f"max_thickness: a wall of {thick:g} mm seals the channels of {gyroid!r}; they stay open below "
            f"{gyroid.pinch * u:.3g} mm",
            SealedChannelWarning,
        )
    schwarz = tpms.schwarz_p(u, phase=(math.pi, 0.0, 0.0))
    w = frep.clip(2.0 * frep.coordinates()[0] / u - 1.0, 0.0, 1.0)
    w = w * w * (3.0 - 2.0 * w)
    # `blended` divides each level by its mean slope: of this share it is zero where (1 - w) gyroid + w P is.
    share = w * schwarz.steepness / ((1.0 - w) * gyroid.steepness + w * schwarz.steepness)
    # One period of it, in its own axes; what follows puts it in place.
    one = gyroid.blended(schwarz, share, over=((0.0, 0.0, 0.0), (1.5 * u, u, u))).distance
    local = [frep.coordinates()[i] for i in order]
    along = local[0] if direction[1] == "+" else 1.5 * u - local[0]
    distance = one.substitute(along, local[1] % u, local[2] % u)
    label = "gyroid to schwarz_p"
    sheet = Solid._make(
        abs(distance) - 0.5 * wall, _EVERYWHERE, features=(Feature("wall", wall, "max_thickness"),), label=label
    )
    made = []
    for start in (0.0, 1.0, 0.5):
        first = start * u if direction[1] == "+" else (1.0 - start) * u
        corner, size = np.zeros(3), np.empty(3)
        corner[axis] = first
        size[order] = 0.5 * u, sizes[0] * u, sizes[1] * u
        made.append(sheet & frep.box(tuple(corner), tuple(corner + size)))
    return made[0], made[1], made[2]
