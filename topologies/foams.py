"""Honeycombs and closed-cell foams: walls between cells that fill space, as exact distances.

The waveform is unsigned: it is never below zero, so that of LatticeRobot's variants only Thin (`sheet`) and Twin, the cells
shrunk by it, say something. Intersect with a bounded solid before meshing.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from frep import ArgumentError, Field, FieldLike, Solid, coordinates, maximum, minimum, mod
from frep.arguments import positive, width
from frep.functions import maximum_of
from frep.solid import Feature

_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


@dataclass(frozen=True, eq=False)
class Foam:
    """Walls of no thickness.

    Attributes:
        distance: to the nearest wall, mm; exact.
        depth: of the middle of a cell, mm.
        label: its name.
        period: along each axis, mm.
    """

    distance: Field
    depth: float
    label: str
    period: tuple[float, float, float]

    def __repr__(self) -> str:
        return f"<{self.label}, cells {2 * self.depth:g} mm wide>"

    def sheet(self, thickness: FieldLike) -> Solid:
        """The walls, `thickness` mm thick: a number or a Field.

        Raises:
            ArgumentError: a thickness that is not positive, or so large that the walls fill the cells.

        Example:
            >>> import frep
            >>> comb = honeycomb(cell=6).sheet(0.8) & frep.box((0, 0, 0), (30, 20, 5))
            >>> comb.contains([[3, 1, 1], [6, 1, 1]])
            array([ True, False])
        """
        t = self._checked(thickness)
        feature = Feature("wall", t, "thickness")
        return Solid._make(self.distance - 0.5 * t, _EVERYWHERE, features=(feature,), label=f"{self.label} sheet")

    def twin(self, thickness: FieldLike) -> Solid:
        """The cells that walls of `thickness` mm leave: separate bodies. Raises as `sheet`."""
        return Solid._make(0.5 * self._checked(thickness) - self.distance, _EVERYWHERE, label=f"{self.label} twin")

    def _checked(self, thickness: FieldLike) -> Field:
        t = width(thickness, "thickness")
        least = t.data if t.is_constant else t.bounds(*_EVERYWHERE)[0]
        if least >= 2.0 * self.depth:
            raise ArgumentError(
                f"thickness: walls of {least:g} mm fill {self!r}; expected less than {2 * self.depth:g} mm"
            )
        return t


def _folded(along: Field, size: float, shift: float) -> Field:
    """How far along an axis the nearest of the centres `shift + size k` is."""
    return abs(mod(along - shift + 0.5 * size, size) - 0.5 * size)


def honeycomb(cell: float = 10.0) -> Foam:
    """Hexagonal prisms along z, `cell` mm across their flats, which face x."""
    u = positive(cell, "cell")
    x, y, _ = coordinates()
    height = math.sqrt(3.0) * u
    inside = []
    for k in (0.0, 0.5):
        # In its own prism a point is on the inner side of all six walls; in the other one it is beyond one of them.
        across, along = _folded(x, u, k * u), _folded(y, height, k * height)
        inside.append(0.5 * u - maximum(across, 0.5 * across + 0.5 * math.sqrt(3.0) * along))
    return Foam(maximum_of(inside), 0.5 * u, "honeycomb", (u, height, u))


def kelvin(cell: float = 10.0) -> Foam:
    """Kelvin's foam, truncated octahedra about the points of a body-centred cubic lattice of period `cell` mm (flat faces;
    Kelvin's own are slightly bent)."""
    u = positive(cell, "cell")
    inside = []
    for k in (0.0, 0.5):
        q = [_folded(c, u, k * u) for c in coordinates()]
        hexagons = math.sqrt(3.0) / 4.0 * u - (q[0] + q[1] + q[2]) / math.sqrt(3.0)
        inside.append(minimum(0.5 * u - maximum_of(q), hexagons))
    return Foam(maximum_of(inside), math.sqrt(3.0) / 4.0 * u, "kelvin", (u, u, u))


def rhombic(cell: float = 10.0) -> Foam:
    """Rhombic dodecahedra about the points of a face-centred cubic lattice of period `cell` mm."""
    u = positive(cell, "cell")
    inside = []
    for shift in ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0)):
        q = [_folded(c, u, s * u) for c, s in zip(coordinates(), shift, strict=True)]
        sums = [a + b for a, b in itertools.combinations(q, 2)]
        inside.append((0.5 * u - maximum_of(sums)) / math.sqrt(2.0))
    return Foam(maximum_of(inside), u / math.sqrt(8.0), "rhombic", (u, u, u))


def closed_cubes(cell: float = 10.0) -> Foam:
    """Cubes of side `cell` mm."""
    u = positive(cell, "cell")
    q = [_folded(c, u, 0.0) for c in coordinates()]
    return Foam(0.5 * u - maximum_of(q), 0.5 * u, "closed_cubes", (u, u, u))
