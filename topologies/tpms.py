"""Triply periodic minimal surfaces, by their nodal approximations.

A surface has no thickness; `sheet` gives it a wall of true thickness in mm. Surfaces fill all space: intersect with a bounded
solid before meshing.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from frep import Field, FieldLike, Solid, coordinates, cos, sin
from frep.arguments import width
from frep.redistance import periodic_distance
from frep.solid import Feature

from .beams import _cell_size


class SealedChannelWarning(UserWarning):
    """A wall so thick that it seals the channels between the sheets: powder or resin stays inside."""


@dataclass(frozen=True, eq=False)
class PeriodicSurface:
    """A periodic surface: the zero set of `level`, a Field without unit, of period `cell` (three sizes in mm).

    `pinch` and `full` are the wall thicknesses, of a cubic cell, at which the channels pinch shut and at which the cell is
    solid (lf-rep 3.4).
    """

    level: Field
    cell: tuple[float, float, float]
    label: str
    pinch: float
    full: float

    def __repr__(self) -> str:
        return f"<{self.label}, cell {' x '.join(f'{c:g}' for c in self.cell)} mm>"

    @property
    def distance(self) -> Field:
        """Signed distance to the surface in mm: a smooth spline through exact distances, within 1e-4 of the cell."""
        return periodic_distance(self.level, self.cell)

    def sheet(self, thickness: FieldLike) -> Solid:
        """A wall that reaches half of `thickness` mm to both sides of the surface, measured along its normal.

        Args:
            thickness: full wall in mm: a number, a Field or a function of position.

        Raises:
            ArgumentError: a thickness that is not positive.

        Warns:
            SealedChannelWarning: a wall beyond which the channels are sealed, or the cell is solid.

        Example:
            >>> import frep
            >>> part = gyroid(cell=5).sheet(0.8) & frep.box((0, 0, 0), (10, 10, 10))
            >>> round(part.volume(voxel=0.2) / 1000, 2)
            0.48
        """
        t = width(thickness, "thickness")
        self._warn_of_sealing(t)
        field = abs(self.distance) - 0.5 * t
        everywhere = np.array([[-np.inf] * 3, [np.inf] * 3])
        return Solid._make(field, everywhere, features=(Feature("wall", t, "thickness"),), label=f"{self.label} sheet")

    def _warn_of_sealing(self, thickness: Field) -> None:
        if not thickness.is_constant:
            return
        share = thickness.data / min(self.cell)
        if share >= self.pinch:
            state = "fills the cell" if share >= self.full else "seals the channels"
            warnings.warn(
                f"thickness: a wall of {thickness.data:g} mm {state} of a {self.label} with a {min(self.cell):g} mm cell; "
                f"channels stay open below {self.pinch * min(self.cell):.3g} mm",
                SealedChannelWarning,
                stacklevel=3,
            )


def _angles(cell: Any) -> tuple[tuple[float, float, float], tuple[Field, Field, Field]]:
    size = _cell_size(cell, "cell")
    x, y, z = (c * (2.0 * math.pi / s) for c, s in zip(coordinates(), size, strict=True))
    return (float(size[0]), float(size[1]), float(size[2])), (x, y, z)


def gyroid(cell: Any = 10.0) -> PeriodicSurface:
    """The gyroid, sin x cos y + sin y cos z + sin z cos x (LF-rep Table 3.5). `cell` mm, a number or three.

    Example:
        >>> gyroid(cell=5)
        <gyroid, cell 5 x 5 x 5 mm>
    """
    size, (x, y, z) = _angles(cell)
    level = sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)
    return PeriodicSurface(level, size, "gyroid", pinch=0.415, full=0.456)


def schwarz_p(cell: Any = 10.0) -> PeriodicSurface:
    """Schwarz P, cos x + cos y + cos z (LF-rep Table 3.5). `cell` mm, a number or three."""
    size, (x, y, z) = _angles(cell)
    return PeriodicSurface(cos(x) + cos(y) + cos(z), size, "schwarz_p", pinch=math.sqrt(2.0) / 3.0, full=0.855)
