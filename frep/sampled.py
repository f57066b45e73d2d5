"""Sampled grids as Fields: what a mesh, an image or a periodic distance table becomes.

A `SampledGrid` interpolates trilinearly between nodes, a `PeriodicSpline` and a `BoxSpline` by cubic B-splines, whose values
lie between their coefficients. Coarse nodes cover its box; where data asks for more, a coarse cell is
refined eightfold by a block of 9 x 9 x 9 nodes. A min/max pyramid over the cells bounds it over boxes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .errors import ArgumentError
from .field import Field, constant, coordinates, leaf_field
from .functions import clip
from .packing import Packer, digest


@dataclass(frozen=True, eq=False)
class SampledGrid:
    """Numbers on a grid, interpolated trilinearly.

    Attributes:
        origin: (3,) position of node (0, 0, 0), mm.
        spacing: (3,) distance of the coarse nodes along each axis, mm.
        nodes: (nx + 1, ny + 1, nz + 1) float32 coarse node values.
        table: (nx, ny, nz) int32, the number of the fine block that refines a cell, or -1; None when nothing is refined.
        blocks: (m, 9, 9, 9) float32 fine node values; its outer nodes lie on the faces of the coarse cell.
        periodic: the grid repeats; the last nodes along each axis equal the first.
        label: shown by `repr`.

    Outside the box of a grid that does not repeat, the value at the nearest point is continued with slope one.
    """

    origin: np.ndarray
    spacing: np.ndarray
    nodes: np.ndarray
    table: np.ndarray | None = None
    blocks: np.ndarray = field(default_factory=lambda: np.zeros((0, 9, 9, 9), np.float32))
    periodic: bool = False
    label: str = "grid"

    def __post_init__(self) -> None:
        if self.nodes.ndim != 3 or min(self.nodes.shape) < 2:
            raise ArgumentError(
                f"nodes: expected at least 2 nodes along each of three axes, got shape {self.nodes.shape}"
            )
        if not np.all(np.isfinite(self.nodes)) or not np.all(np.isfinite(self.blocks)):
            raise ArgumentError("nodes: a sampled grid must hold finite numbers only")
        if self.table is not None and self.table.shape != self.cells:
            raise ArgumentError(f"table: expected shape {self.cells}, one entry a cell, got {self.table.shape}")

    @property
    def cells(self) -> tuple[int, int, int]:
        """Coarse cells along each axis."""
        nx, ny, nz = self.nodes.shape
        return (nx - 1, ny - 1, nz - 1)

    @property
    def name(self) -> str:
        return self.label

    @cached_property
    def content_key(self) -> bytes:
        table = () if self.table is None else (self.table,)
        kind = b"periodic grid" if self.periodic else b"grid"
        return digest(kind, self.origin, self.spacing, self.nodes, self.blocks, *table)

    def field(self) -> Field:
        """The interpolated values as a Field."""
        zero = constant(0.0)
        return leaf_field("grid", self, zero, zero, zero, zero)

    def pack(self, packer: Packer) -> list[int]:
        floats = packer.floats(np.concatenate([self.origin, self.spacing]))
        levels = self._pyramid
        # One piece, so that a single grid is handed to the kernels without a copy.
        pieces = [self.nodes.reshape(-1), self.blocks.reshape(-1), *(level.reshape(-1) for level in levels)]
        nodes = packer.grid(np.concatenate(pieces))
        fine = nodes + self.nodes.size
        table = -1 if self.table is None else packer.ints(self.table)
        return [*self.cells, nodes, table, fine, int(self.periodic), fine + self.blocks.size, len(levels), floats, 0]

    @cached_property
    def _pyramid(self) -> list[np.ndarray]:
        low, high = _cell_extremes(self.nodes, 1)
        if self.table is not None and len(self.blocks):
            refined = self.table >= 0
            flat = self.blocks.reshape(len(self.blocks), -1)
            low[refined] = flat.min(axis=1)[self.table[refined]]
            high[refined] = flat.max(axis=1)[self.table[refined]]
        return _pyramid(low, high, self.periodic)


@dataclass(frozen=True, eq=False)
class PeriodicSpline:
    """A smooth periodic function: the cubic B-spline through values on one period.

    Attributes:
        period: (3,) mm.
        values: (nx, ny, nz) values at `period * (i / nx, j / ny, k / nz)`.
        label: shown by `repr`.
    """

    period: np.ndarray
    values: np.ndarray
    label: str = "spline"

    @property
    def name(self) -> str:
        return self.label

    @cached_property
    def content_key(self) -> bytes:
        return digest(b"spline", self.period, self.values)

    def field(self) -> Field:
        """The interpolated values as a Field."""
        zero = constant(0.0)
        return leaf_field("grid", self, zero, zero, zero, zero)

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """B-spline coefficients with the layers that a point's 4 x 4 x 4 neighbourhood reaches past the period."""
        from scipy.ndimage import spline_filter

        c = spline_filter(np.asarray(self.values, np.float64), order=3, mode="grid-wrap")
        return np.ascontiguousarray(np.pad(c, ((1, 2),) * 3, mode="wrap").astype(np.float32))

    @cached_property
    def _packed(self) -> tuple[np.ndarray, int]:
        # A B-spline lies between the least and the largest of the coefficients round a point.
        levels = _pyramid(*_cell_extremes(self._coefficients, 3), True)
        return np.concatenate([self._coefficients.reshape(-1), *(level.reshape(-1) for level in levels)]), len(levels)

    def pack(self, packer: Packer) -> list[int]:
        numbers, levels = self._packed
        floats = packer.floats(np.concatenate([np.zeros(3), self.period / self.values.shape]))
        nodes = packer.grid(numbers)
        pyramid = nodes + self._coefficients.size
        return [*self.values.shape, nodes, -1, 0, 1, pyramid, levels, floats, 1]


@dataclass(frozen=True, eq=False)
class BoxSpline:
    """A smooth function in a box: the cubic B-spline through values on a grid.

    Attributes:
        origin: (3,) position of node (0, 0, 0), mm.
        spacing: (3,) distance of the nodes along each axis, mm.
        values: (nx, ny, nz) values at the nodes.
        label: shown by `repr`.

    One spacing inside the outermost nodes the box ends; beyond, the value at its nearest point goes on.
    """

    origin: np.ndarray
    spacing: np.ndarray
    values: np.ndarray
    label: str = "spline"

    @property
    def name(self) -> str:
        return self.label

    @cached_property
    def content_key(self) -> bytes:
        return digest(b"box spline", self.spacing, self.values)

    def field(self) -> Field:
        """The interpolated values as a Field."""
        zero = constant(0.0)
        # The compiled spline repeats; within its own cells, and a spacing inside them, this is not seen.
        inside = [
            clip(c - float(o), float(s), float((n - 2) * s))
            for c, o, s, n in zip(coordinates(), self.origin, self.spacing, self.values.shape, strict=True)
        ]
        return leaf_field("grid", self, zero, zero, zero, zero).substitute(*inside)

    @cached_property
    def _packed(self) -> tuple[np.ndarray, int]:
        from scipy.ndimage import spline_filter

        c = spline_filter(self.values, order=3, mode="mirror", output=np.float32)  # type: ignore[arg-type]
        c = np.pad(c, 1, mode="reflect")
        levels = _pyramid(*_cell_extremes(c, 3), False)
        return np.concatenate([c.reshape(-1), *(level.reshape(-1) for level in levels)]), len(levels)

    def pack(self, packer: Packer) -> list[int]:
        numbers, levels = self._packed
        cells = [n - 1 for n in self.values.shape]
        floats = packer.floats(np.concatenate([np.zeros(3), self.spacing]))
        nodes = packer.grid(numbers)
        pyramid = nodes + int(np.prod([n + 3 for n in cells]))
        return [*cells, nodes, -1, 0, 1, pyramid, levels, floats, 1]


def _pyramid(low: np.ndarray, high: np.ndarray, periodic: bool) -> list[np.ndarray]:
    """(nx, ny, nz, 2) lowest and highest value of each cell, then of 2 x 2 x 2 cells, and so on."""
    levels = [np.stack([low, high], axis=-1)]
    # A periodic grid is only halved while the cells pair up across the period.
    while max(low.shape) > 2 and not (periodic and any(n % 2 for n in low.shape)):
        low, high = _halved(low, np.minimum), _halved(high, np.maximum)
        levels.append(np.stack([low, high], axis=-1))
    return levels


def _cell_extremes(nodes: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest node of the `reach + 1` along each axis that a cell's values depend on."""
    low, high = nodes, nodes
    for axis in range(3):
        n = nodes.shape[axis] - reach
        parts = [[slice(None)] * axis + [slice(k, k + n)] for k in range(reach + 1)]
        low = np.minimum.reduce([low[tuple(p)] for p in parts])
        high = np.maximum.reduce([high[tuple(p)] for p in parts])
    return low, high


def _halved(values: np.ndarray, pick: np.ufunc) -> np.ndarray:
    for axis in range(3):
        n = values.shape[axis]
        values = pick.reduceat(values, np.arange(0, n, 2), axis=axis)
    return values
