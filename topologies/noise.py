"""Random fields: spinodal surfaces, and Perlin and simplex noise as Fields for any thickness, offset or map.

All but simplex noise repeat, after a period of so many cells as asked for, and are kept as one period's cubic spline: a lookup,
whatever they are the sum of, with bounds by which the sampler leaves out what holds no surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from frep import ArgumentError, Field, FieldLike, Solid, as_field, coordinates, foreign, power, where
from frep.arguments import positive, real, sizes, width
from frep.redistance import periodic_distance
from frep.sampled import PeriodicSpline
from frep.solid import Feature

from .seeds import RandomState, generator, random_directions, whole

_NODES_A_WAVE = 16
"""Spline nodes in a wave length: a cubic spline then keeps a sine within 1e-4 of its amplitude."""

_NODES_A_CELL = 8
"""Spline nodes in a cell of Perlin noise: within 2e-3 of it between the nodes, on which it is exact."""

_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


@dataclass(frozen=True, eq=False)
class Spinodal:
    """A random bicontinuous structure: a sum of waves of one length and random directions and phases.

    Attributes:
        level: the sum, a Field of mean 0 and variance 1, normally distributed over a period as nearly as many waves are.
        cell: wave length along each axis, mm.
        period: after which it repeats, mm.
    """

    level: Field
    cell: tuple[float, float, float]
    period: tuple[float, float, float]

    def __repr__(self) -> str:
        return f"<spinodal, cell {' x '.join(f'{c:g}' for c in self.cell)} mm>"

    def bias_of(self, fraction: FieldLike) -> Field:
        """The bias at which the solid fills a fraction of space: the inverse of the level's distribution.

        For a number it is the very quantile of a period; for a Field that of the normal distribution, within 0.003 of the
        fraction (Shore, J. Roy. Statist. Soc. C 31, 1982), to which the waves come within some 0.01.

        Raises:
            ArgumentError: a number not between 0 and 1.
        """
        share = as_field(fraction, "fraction")
        if share.is_constant:
            if not 0.0 < share.data < 1.0:
                raise ArgumentError(f"fraction: expected a number between 0 and 1, got {share.data:g}")
            return as_field(float(np.quantile(self._values, share.data)))
        p = share.clip(1e-4, 1.0 - 1e-4)
        above = p > 0.5
        odds = where(above, (1.0 - p) / p, p / (1.0 - p))
        size = 5.55556 * (1.0 - power(odds, 0.1186))
        return where(above, size, -size)

    def distance(self, bias: float = 0.0) -> Field:
        """Signed distance to the surface where the level is `bias`, mm, negative where it is less.

        A spline through exact distances. Its error is 0.0005 of the cell on average where the structure repeats after 4
        cells and 0.001 after 6; where the surface bends most, 0.01 and 0.025. It takes a few seconds, once for a structure
        and bias.
        """
        return periodic_distance(self.level - real(bias, "bias", "1"), self.period)

    def solid(self, fraction: FieldLike | None = None, *, bias: FieldLike | None = None) -> Solid:
        """The solid phase, where the level is below a bias: given, or such that it fills `fraction` of space.

        Args:
            fraction: of space, between 0 and 1; a Field or function of position grades it. Below about 0.15 an isotropic
                structure falls into pieces, above 0.85 its pores do.
            bias: instead, the level of the surface, number or Field; 0 fills half of space.

        The surface is that of the level itself; off it, for a number, the field is a lower bound of the distance.

        Raises:
            ArgumentError: not one of fraction and bias; a fraction not between 0 and 1, or a bias that the level never has.

        Example:
            >>> import frep
            >>> part = spinodal(4, random_state=1).solid(fraction=0.3) & frep.box((0, 0, 0), (24, 24, 24))
            >>> round(part.volume(voxel=0.5) / 24**3, 2)
            0.3
        """
        if (fraction is None) == (bias is None):
            raise ArgumentError("fraction, bias: expected one of them, got " + ("none" if bias is None else "both"))
        at = self.bias_of(fraction) if fraction is not None else as_field(bias, "bias")  # type: ignore[arg-type]
        if at.is_constant:
            least, most = float(self._values.min()), float(self._values.max())
            if not least < at.data < most:
                raise ArgumentError(f"bias: expected a level between {least:.3g} and {most:.3g}, got {at.data:g}")
        return Solid._make((self.level - at) / self._steepest, _EVERYWHERE, label="spinodal")

    def sheet(self, thickness: FieldLike, *, bias: float = 0.0) -> Solid:
        """A wall that reaches half of `thickness` mm to both sides of the surface, measured along its normal.

        Args:
            thickness: full wall in mm: a number, a Field or a function of position.
            bias: the level of the surface, a number; 0 parts space into halves.

        Raises:
            ArgumentError: a thickness that is not positive.
        """
        t = width(thickness, "thickness")
        field = abs(self.distance(bias)) - 0.5 * t
        return Solid._make(field, _EVERYWHERE, features=(Feature("wall", t, "thickness"),), label="spinodal sheet")

    @cached_property
    def _values(self) -> np.ndarray:
        return self.level.data.values

    @cached_property
    def _steepest(self) -> float:
        """No slope of the level is greater, a mm: that at the nodes and 6 % for what lies between them."""
        spectrum = np.fft.fftn(self._values)
        squared = np.zeros(self._values.shape)
        for axis, (n, period) in enumerate(zip(self._values.shape, self.period, strict=True)):
            k = np.expand_dims(2.0 * math.pi * np.fft.fftfreq(n, period / n), [a for a in range(3) if a != axis])
            squared += np.fft.ifftn(1j * k * spectrum).real ** 2
        return 1.06 * float(np.sqrt(squared.max()))


def spinodal(
    cell_size: Any = 10.0,
    *,
    directions: Any = None,
    spread: float = math.pi / 6,
    n_waves: int = 200,
    repeat: int = 6,
    random_state: RandomState | None = None,
) -> Spinodal:
    """Spinodal structures, as of phases that have begun to part: isotropic, lamellar, columnar or cubic.

    The level is the Gaussian random field `sqrt(2 / n) sum cos(k_i . x + a_i)` with |k_i| = 2 pi / cell and random phases
    (Cahn, J. Chem. Phys. 42, 1965; Kumar, Tan, Zheng and Kochmann, npj Comput. Mater. 6, 73, 2020, equations 1 to 5). Waves
    are those nearest to the random ones that fit the period.

    Args:
        cell_size: wave length, mm: the mean distance from a wall to the next. A number, or three to stretch it along an axis.
        directions: axes ("x", "y", "z" or vectors) near which the waves run: one gives lamellae across it, two columns
            along the third, three a cubic structure. None for any direction.
        spread: how far the waves lean away from those axes at most, rad.
        n_waves: how many waves are drawn.
        repeat: the period in cells. Solids are as exact whatever it is, sheets the less the longer it is.
        random_state: a whole number, with which the same structure comes out each time, or a numpy Generator.

    Raises:
        ArgumentTypeError, ArgumentError: sizes or angles out of range, repeat not 2 to 8, no random state.

    Example:
        >>> spinodal(5, directions=["z"], random_state=1)
        <spinodal, cell 5 x 5 x 5 mm>
    """
    cell = sizes(cell_size, "cell_size")
    cells = whole(repeat, "repeat", least=2)
    if cells > 8:
        raise ArgumentError(f"repeat: expected 2 to 8 cells, got {cells}")
    count = whole(n_waves, "n_waves")
    random = generator(random_state)
    waves = np.round(cells * random_directions(count, directions, spread, random_state=random)).astype(int)
    phases = random.uniform(0.0, 2.0 * math.pi, count)
    n = _NODES_A_WAVE * cells
    # The sum of the waves at all nodes is a Fourier transform of their amplitudes.
    spectrum = np.zeros((n, n, n), complex)
    np.add.at(spectrum, tuple((waves % n).T), np.exp(1j * phases))
    values = np.fft.ifftn(spectrum, norm="forward").real
    values -= values.mean()
    values /= values.std()
    period = cells * cell
    level = PeriodicSpline(period, values, label="spinodal").field()
    a, b, c = map(float, cell)
    return Spinodal(level, (a, b, c), (cells * a, cells * b, cells * c))


def perlin(
    cell_size: float,
    *,
    octaves: int = 1,
    persistence: float = 0.5,
    repeat: int = 16,
    random_state: RandomState | None = None,
) -> Field:
    """Perlin's gradient noise (improved noise, SIGGRAPH 2002, with gradients all over the sphere): a Field from -1 to 1.

    Args:
        cell_size: distance of the nodes at which one octave is zero, mm.
        octaves: noises added up, each of half the cell of the one before.
        persistence: how strong each is beside the one before, over 0 up to 1. The sum is scaled back to -1 to 1.
        repeat: the period in cells.
        random_state: a whole number, with which the same noise comes out each time, or a numpy Generator.

    Raises:
        ArgumentTypeError, ArgumentError: numbers out of range, repeat above 32, no random state.

    Example:
        >>> rough = perlin(4, octaves=3, random_state=1)
        >>> low, high = rough.bounds((0, 0, 0), (64, 64, 64))
        >>> -1.3 < low < -0.3 and 0.3 < high < 1.3
        True
    """
    size = positive(cell_size, "cell_size")
    count, cells = whole(octaves, "octaves"), whole(repeat, "repeat", least=2)
    if cells > 32:
        raise ArgumentError(f"repeat: expected 2 to 32 cells, got {cells}")
    weaker = positive(persistence, "persistence", "")
    if weaker > 1.0:
        raise ArgumentError(f"persistence: expected more than 0 and at most 1, got {persistence!r}")
    random = generator(random_state)
    slopes = random_directions(cells**3, random_state=random).reshape(cells, cells, cells, 3)
    one = PeriodicSpline(np.full(3, size * cells), _gradient_noise(slopes), label="perlin").field()
    x, y, z = coordinates()
    total, strength, sum_of_strengths = one, 1.0, 1.0
    for octave in range(1, count):
        strength *= weaker
        scale, shift = 2.0**octave, random.uniform(0.0, size * cells, 3)
        finer = one.substitute(scale * x + shift[0], scale * y + shift[1], scale * z + shift[2])
        total, sum_of_strengths = total + strength * finer, sum_of_strengths + strength
    return total / sum_of_strengths


def _gradient_noise(slopes: np.ndarray) -> np.ndarray:
    """Perlin noise at all spline nodes of a period; `slopes` (n, n, n, 3) unit gradients at its lattice nodes."""
    n = len(slopes)
    t = np.arange(_NODES_A_CELL) / _NODES_A_CELL
    fade = t**3 * (t * (6.0 * t - 15.0) + 10.0)
    out = np.zeros((n, _NODES_A_CELL) * 3)
    for corner in np.ndindex(2, 2, 2):
        g = np.roll(slopes, tuple(-c for c in corner), axis=(0, 1, 2))
        # One factor of the weight an axis, and the gradient's rise over the way from the corner.
        u, v, w = (fade if c else 1.0 - fade for c in corner)
        du, dv, dw = (t - c for c in corner)
        weight = u[:, None, None] * v[:, None] * w
        rises = [
            np.einsum("ijk,abc->iajbkc", g[..., axis], weight * way)
            for axis, way in enumerate((du[:, None, None], dv[:, None], dw))
        ]
        out += rises[0] + rises[1] + rises[2]
    # A unit gradient at each corner lifts the middle of the cell by half its diagonal at most.
    return out.reshape((n * _NODES_A_CELL,) * 3) * (2.0 / math.sqrt(3.0))


_SIMPLEX_PEAK = 0.00928907
"""The greatest sum of the four falls of a tetrahedron, with all gradients towards the point; found numerically."""

_SIMPLEX_SLOPE = 0.0724793
"""The greatest sum of their slopes."""


def simplex(cell_size: float, *, random_state: RandomState | None = None) -> Field:
    """Simplex noise (Perlin 2001): like Perlin noise, with less of a grain along the axes. A Field from -1 to 1.

    It is called as a function, some 0.5 us a point, and does not repeat for 256 cells. The reach of a node is that at which
    it is continuous (0.5, not the 0.6 of many programs).

    Args:
        cell_size: side of the cubes that are sheared into tetrahedra, mm; bumps are about half as wide.
        random_state: a whole number, with which the same noise comes out each time, or a numpy Generator.

    Raises:
        ArgumentTypeError, ArgumentError: a size that is not positive, no random state.

    Example:
        >>> simplex(4, random_state=1)([[0, 0, 0]])
        array([0.])
    """
    size = positive(cell_size, "cell_size")
    random = generator(random_state)
    noise = _SimplexNoise(size, random.permutation(256), random_directions(256, random_state=random))
    return foreign(noise, lipschitz=_SIMPLEX_SLOPE / _SIMPLEX_PEAK / size, name="simplex")


@dataclass(frozen=True, eq=False)
class _SimplexNoise:
    size: float
    order: np.ndarray
    slopes: np.ndarray

    def __call__(self, x, y, z) -> np.ndarray:
        p = np.stack([x, y, z], axis=1) / self.size
        # Sheared along the diagonal, the tetrahedra fill cubes, six in each.
        base = np.floor(p + p.sum(axis=1, keepdims=True) / 3.0)
        local = p - (base - base.sum(axis=1, keepdims=True) / 6.0)
        rank = np.argsort(np.argsort(-local, axis=1, kind="stable"), axis=1)
        total = np.zeros(len(p))
        for corner in range(4):
            step = (rank < corner).astype(float)
            away = local - step + corner / 6.0
            i, j, k = (base + step).astype(np.int64).T & 255
            slope = self.slopes[self.order[(self.order[(self.order[i] + j) & 255] + k) & 255]]
            fall = np.maximum(0.5 - (away**2).sum(axis=1), 0.0)
            total += fall**4 * (slope * away).sum(axis=1)
        return total / _SIMPLEX_PEAK
