"""Similarities of space: screws and swirls, with every real power in closed form.

A similarity `x -> s R x + t` (no mirror images) is kept as the one-parameter group it belongs to, not as a matrix: its
generator is `x' = A x + v` with `A = log_scale I + angle [axis]x`, and the power of any real exponent is

    S^t x = exp(tA) x + t phi(tA) v,        phi(z) = (exp(z) - 1) / z.

Along the axis `A` is the number `log_scale`, across it the complex number `log_scale + i angle`, so both functions are
a few scalars. Nothing degenerates where a swirl becomes a screw (scale 1) or a screw a translation (angle 0), where
the fixed point and the axis run off to infinity; a quotient by `scale - 1` is never formed. The angle may exceed a
turn, and powers keep it.

Promised: `S^a S^b = S^(a+b)` to rounding, for every kind and scale. Not promised: that a product of two similarities
keeps their turns; its angle is the one in [0, pi].

Source: Constructive Lattice Geometry, chapter 2.4 to 2.6 (repaired where its solvers fail: pure rotations, axes across
X + Y + Z, scales near 1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from .arguments import direction, finite, positive, real, vector
from .errors import ArgumentError, ArgumentTypeError

Kind = Literal["identity", "translation", "screw", "swirl"]

_EPS = float(np.finfo(float).eps)
_ROUNDING = 4 * _EPS  # a scale or a turn that rounding alone explains is none
_RIGHT_ANGLES = 1e-6  # how far a frame may be from orthogonal axes of one length
_UNIT = 1e-13  # how far a stored axis may be from length 1
_TINY = 1e-290  # a quotient by less may overflow, and phi is 1 there
_LARGEST_LOG = 700.0  # exp of more overflows


@dataclass(frozen=True, eq=False, repr=False)
class Similarity:
    """An orientation-preserving similarity of space, and its real powers.

    Make one with `Screw`, `Swirl`, `Translation`, `planar`, `Similarity.identity`, `.from_matrix`, `.from_frames` or
    `.interpolating`. `f @ g` applies `g` first. Equal means: the same numbers, bit for bit.

    Args:
        log_scale: the natural logarithm of the scale, of one application.
        angle: rad, of one application; may exceed a turn.
        axis: (3,) unit vector. Where nothing turns it is the direction of travel, or z.
        velocity: (3,) mm, how fast the origin sets off: the generator is `x' = A x + velocity`.

    Raises:
        ArgumentError, ArgumentTypeError: a number that is not finite, an axis that is not of length 1.

    Example:
        >>> stair = Screw(math.pi / 6, axis="z", pitch=2.0)  # 30 degrees and 2 mm a step
        >>> stair.power(3).apply((10, 0, 0)).round(9).tolist()
        [0.0, 10.0, 6.0]
        >>> half = stair.power(0.5)
        >>> bool(np.allclose((half @ half).matrix, stair.matrix))
        True
    """

    log_scale: float
    angle: float
    axis: np.ndarray
    velocity: np.ndarray
    __array_ufunc__ = None  # an array times a Similarity is an error, not an array of products

    def __post_init__(self) -> None:
        axis, velocity = vector(self.axis, "axis").copy(), vector(self.velocity, "velocity").copy()
        length = float(np.linalg.norm(axis))
        if abs(length - 1.0) > _UNIT:
            raise ArgumentError(
                f"axis: expected a vector of length 1, got length {length!r}; Screw and Swirl take any length"
            )
        axis.setflags(write=False)
        velocity.setflags(write=False)
        object.__setattr__(self, "log_scale", real(self.log_scale, "log_scale", "1"))
        object.__setattr__(self, "angle", real(self.angle, "angle", "rad"))
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "velocity", velocity)

    # Making one

    @classmethod
    def identity(cls) -> Similarity:
        """The similarity that moves nothing."""
        return Translation((0.0, 0.0, 0.0))

    @classmethod
    def from_matrix(cls, m: Any) -> Similarity:
        """The similarity of a (4, 4) or (3, 4) matrix `[s R | t]`, its angle in [0, pi].

        Raises:
            ArgumentError, ArgumentTypeError: not a matrix of that shape, not finite, a scale of 0, a mirror image,
                columns that are not orthogonal and of one length to 1e-6.
        """
        matrix = finite(m, "m")
        if matrix.shape not in ((4, 4), (3, 4)):
            raise ArgumentError(f"m: expected a matrix of shape (4, 4) or (3, 4), got shape {matrix.shape}")
        return _between((np.zeros(3), 1.0, np.array([1.0, 0.0, 0.0, 0.0])), _frame(matrix, "m"))

    @classmethod
    def from_frames(cls, a: Any, b: Any) -> Similarity:
        """The similarity that takes frame `a` to frame `b`, its angle in [0, pi] (the extrapolating design of a
        pattern).

        A frame is `(origin, x, y)`, the axes x and y at right angles and of one length, which is the frame's scale; or
        a (4, 4) or (3, 4) matrix whose columns are the axes x, y, z and the origin.

        Raises:
            ArgumentError, ArgumentTypeError: the frame named is not finite, has a scale of 0, is left-handed, or its
                axes are not orthogonal and of one length to 1e-6.

        Source: spec 2.6; the formula of the thesis (2.10) needs normalised axes and fails across X + Y + Z.
        """
        return _between(_frame(a, "a"), _frame(b, "b"))

    @classmethod
    def interpolating(cls, first: Any, last: Any, count: int) -> Similarity:
        """The step of a row of `count` frames (2 or more), evenly spread from frame `first` to frame `last`.

        Raises:
            ArgumentError, ArgumentTypeError: as `from_frames`; a count that is not a whole number of 2 or more.

        Source: Constructive Lattice Geometry, 2.6.1.
        """
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)):
            raise ArgumentTypeError(f"count: expected a whole number of 2 or more, got {count!r}")
        if count < 2:
            raise ArgumentError(f"count: expected a whole number of 2 or more, got {count!r}")
        return _between(_frame(first, "first"), _frame(last, "last")).power(1.0 / (int(count) - 1))

    # What it is

    @property
    def kind(self) -> Kind:
        """ "identity", "translation", "screw" (a rotation too: its pitch is 0) or "swirl" (it scales).

        Told by exact zeros of the generator; the constructors round what rounding explains to zero.
        """
        if self.log_scale != 0.0:
            return "swirl"
        if self.angle != 0.0:
            return "screw"
        return "translation" if np.any(self.velocity) else "identity"

    @property
    def scale(self) -> float:
        """The factor by which one application multiplies lengths."""
        return math.exp(self.log_scale)

    @cached_property
    def matrix(self) -> np.ndarray:
        """(4, 4), homogeneous: `[s R | t]` over `[0 0 0 1]`; read only."""
        m = self.powers((1.0,))[0]
        m.setflags(write=False)
        return m

    @property
    def rotation(self) -> np.ndarray:
        """(3, 3), the rotation R, without the scale."""
        return _rotation(np.array([self.angle]), self.axis)[0]

    @property
    def translation(self) -> np.ndarray:
        """(3,) mm, where the origin goes."""
        return self.matrix[:3, 3]

    @property
    def generator(self) -> np.ndarray:
        """(4, 4), `[A | v]` over zeros; its matrix exponential is `matrix`."""
        g = np.zeros((4, 4))
        g[:3, :3] = self.log_scale * np.eye(3) + self.angle * _cross_matrix(self.axis)
        g[:3, 3] = self.velocity
        return g

    @property
    def fixed_point(self) -> np.ndarray | None:
        """(3,) mm, the centre of a swirl; None for the other kinds."""
        if self.log_scale == 0.0:
            return None
        along, across, turned = _split(self.velocity, self.axis)
        w = -1.0 / complex(self.log_scale, self.angle)
        return -along / self.log_scale + w.real * across + w.imag * turned

    @property
    def point(self) -> np.ndarray | None:
        """(3,) mm, the point of the axis nearest to the origin; None where nothing turns."""
        if self.angle == 0.0:
            return None
        _, across, turned = _split(self.velocity, self.axis)
        w = -1.0 / complex(self.log_scale, self.angle)
        return w.real * across + w.imag * turned

    @property
    def pitch(self) -> float | None:
        """mm along the axis per application, of a screw or a translation; None for a swirl."""
        return None if self.log_scale != 0.0 else float(self.axis @ self.velocity)

    # What it does

    def apply(self, points: Any) -> np.ndarray:
        """The images of `points`, (3,) or (n, 3) mm, in the same shape."""
        p = finite(points, "points")
        if p.shape[-1:] != (3,):
            raise ArgumentError(f"points: expected an array of shape (n, 3) or (3,), got shape {p.shape}")
        m = self.matrix
        return p @ m[:3, :3].T + m[:3, 3]

    def power(self, t: float) -> Similarity:
        """S^t, for any real t: S^0 moves nothing, S^-1 is the inverse, S^(1/n) is the n-th part of the way."""
        t = real(t, "t", "1")
        return Similarity(t * self.log_scale, t * self.angle, self.axis, t * self.velocity)

    def powers(self, ts: Any) -> np.ndarray:
        """The matrices of S^t for all `ts` (n,), as (n, 4, 4).

        Raises:
            ArgumentError, ArgumentTypeError: exponents that are not a row of finite numbers, or so large that the
                scale overflows.
        """
        t = finite(ts, "ts")
        if t.ndim != 1:
            raise ArgumentError(f"ts: expected a row of numbers (n,), got shape {t.shape}")
        logs = t * self.log_scale
        if t.size and np.abs(logs).max() > _LARGEST_LOG:
            worst = t[np.abs(logs).argmax()]
            raise ArgumentError(f"ts: the scale exp({self.log_scale:g}) to the power {worst:g} is beyond a float")
        m = np.zeros((t.size, 4, 4))
        if self.log_scale == 0.0 and self.angle == 0.0:
            m[:] = np.eye(4)
            m[:, :3, 3] = np.outer(t, self.velocity)
            return m
        m[:, :3, :3] = np.exp(logs)[:, None, None] * _rotation(t * self.angle, self.axis)
        along, across, turned = _split(self.velocity, self.axis)
        growth, w = _travel(t, self.log_scale, self.angle)
        m[:, :3, 3] = np.outer(growth, along) + np.outer(np.real(w), across) + np.outer(np.imag(w), turned)
        m[:, 3, 3] = 1.0
        return m

    def inverse(self) -> Similarity:
        """S^-1."""
        return Similarity(-self.log_scale, -self.angle, self.axis, -self.velocity)

    def __matmul__(self, other: Similarity) -> Similarity:
        """`self` after `other`; the angle of the product is in [0, pi]."""
        if not isinstance(other, Similarity):
            return NotImplemented
        mine, others = _quaternion(self.angle, self.axis), _quaternion(other.angle, other.axis)
        noise = _ROUNDING * float(np.linalg.norm(mine[1:]) + np.linalg.norm(others[1:]))
        angle, axis = _turn(_product(mine, others), noise)
        log_scale = _unless_noise(
            self.log_scale + other.log_scale, _ROUNDING * max(abs(self.log_scale), abs(other.log_scale))
        )
        moved = self.matrix[:3, :3] @ other.translation
        t = moved + self.translation
        t[np.abs(t) <= _ROUNDING * (np.linalg.norm(moved) + np.linalg.norm(self.translation))] = 0.0
        return _reaching(log_scale, angle, axis, np.zeros(3), t)

    def commutes_with(self, other: Similarity, *, size: float = 1.0, tolerance: float = 1e-9) -> bool:
        """Whether all real powers of the two commute, up to `tolerance`, on a part of `size` mm about the origin.

        The bracket of the generators is held against their own magnitudes, so that the answer is the same for any
        powers of the two. Two screws about axes that cross do not commute, though whole turns of them would.

        Raises:
            ArgumentError, ArgumentTypeError: `size` or `tolerance` is not a positive number; `other` is not a
                Similarity.
        """
        if not isinstance(other, Similarity):
            raise ArgumentTypeError(f"other: expected a Similarity, got {other!r}")
        size, tolerance = positive(size, "size"), positive(tolerance, "tolerance", "")
        g, h = self.generator, other.generator
        g[:3, 3] /= size  # in units of the part, turns and travels compare
        h[:3, 3] /= size
        bracket = float(np.linalg.norm(g @ h - h @ g))
        return bracket <= tolerance * float(np.linalg.norm(g) * np.linalg.norm(h))

    # Identity

    def _key(self) -> bytes:
        turn = math.copysign(1.0, self.angle) * self.axis if self.angle != 0.0 else np.zeros(3)
        numbers = np.concatenate(([self.log_scale, abs(self.angle)], turn, self.velocity))
        return (numbers + 0.0).tobytes()  # + 0.0: there is one zero

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Similarity) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        spelling = self.__dict__.get("_spelling")  # as the user wrote it, where the user did
        if spelling is not None:
            return spelling
        axis, velocity = _written(self.axis), _written(self.velocity)
        return f"Similarity(log_scale={self.log_scale!r}, angle={self.angle!r}, axis={axis}, velocity={velocity})"


def Screw(
    angle: float, axis: str | Sequence[float] = "z", point: Sequence[float] = (0.0, 0.0, 0.0), pitch: float = 0.0
) -> Similarity:
    """A turn by `angle` rad about the line through `point` along `axis`, and `pitch` mm along it.

    `axis` is "x", "y", "z" or three numbers of any length. A pitch of 0 is a rotation, an angle of 0 a translation.

    Raises:
        ArgumentError, ArgumentTypeError: numbers that are not finite, an axis of length 0.

    Example:
        >>> quarter = Screw(math.pi / 2, point=(1, 0, 0), pitch=3.0)
        >>> quarter.apply((2, 0, 0)).round(9).tolist()
        [1.0, 1.0, 3.0]
    """
    angle, pitch = real(angle, "angle", "rad"), real(pitch, "pitch", "mm")
    along, through = direction(axis, "axis"), vector(point, "point")
    velocity = pitch * along - angle * np.cross(along, through)
    text = f"Screw({angle!r}, axis={_spelled(axis)}, point={_written(through)}, pitch={pitch!r})"
    return _named(Similarity(0.0, angle, along, velocity), text)


def Swirl(
    scale: float, center: Sequence[float] = (0.0, 0.0, 0.0), angle: float = 0.0, axis: str | Sequence[float] = "z"
) -> Similarity:
    """A dilation by `scale` about `center`, and a turn by `angle` rad about the line through it along `axis`.

    Raises:
        ArgumentError, ArgumentTypeError: a scale that is not above 0, numbers that are not finite, an axis of length 0.

    Example:
        >>> Swirl(2.0, center=(1, 0, 0)).apply((2, 0, 0)).tolist()
        [3.0, 0.0, 0.0]
    """
    scale = real(scale, "scale", "1")
    if not scale > 0.0:
        raise ArgumentError(
            f"scale: expected a number > 0, got {scale!r}; mirror images are not similarities of a steady lattice"
        )
    fixed, angle, along = vector(center, "center"), real(angle, "angle", "rad"), direction(axis, "axis")
    log_scale = math.log(scale)
    velocity = -(log_scale * fixed + angle * np.cross(along, fixed))
    text = f"Swirl({scale!r}, center={_written(fixed)}, angle={angle!r}, axis={_spelled(axis)})"
    return _named(Similarity(log_scale, angle, along, velocity), text)


def Translation(shift: Sequence[float]) -> Similarity:
    """A shift by three numbers (x, y, z), mm.

    Raises:
        ArgumentError, ArgumentTypeError: not three finite numbers.

    Example:
        >>> Translation((0, 0, 5)).power(0.5).apply((1, 2, 3)).tolist()
        [1.0, 2.0, 5.5]
    """
    v = vector(shift, "shift")
    return _named(Similarity(0.0, 0.0, _heading(v), v), f"Translation({_written(v)})")


def planar(pair_a: Any, pair_b: Any) -> Similarity:
    """The similarity of the xy-plane that takes the points A, B of `pair_a` to the points C, D of `pair_b`.

    A pair is two points (x, y), mm. The axis is z and the angle in (-pi, pi].

    Raises:
        ArgumentError, ArgumentTypeError: not two finite points of the plane each, or the two points of a pair coincide.

    Source: spec 2.5, the complex form of Constructive Lattice Geometry (2.5).

    Example:
        >>> turn = planar([(0, 0), (1, 0)], [(1, 0), (1, 2)])
        >>> turn.scale, turn.angle == math.pi / 2
        (2.0, True)
    """
    a, b = _pair(pair_a, "pair_a")
    c, d = _pair(pair_b, "pair_b")
    change = ((d - c) - (b - a)) / (b - a)
    noise = _ROUNDING * (1.0 + max(abs(a), abs(b), abs(c), abs(d)) / min(abs(b - a), abs(d - c)))
    if abs(change) < 0.5:  # log(1 + change), exact where it is small
        log_scale = 0.5 * math.log1p(2.0 * change.real + abs(change) ** 2)
    else:
        log_scale = math.log(abs(d - c) / abs(b - a))
    angle = math.atan2(change.imag, 1.0 + change.real)
    if angle == -math.pi:
        angle = math.pi
    log_scale, angle = _unless_noise(log_scale, noise), _unless_noise(angle, noise)
    _, phi = _travel(np.ones(1), log_scale, angle)
    v = (c - a) / complex(phi[0]) - complex(log_scale, angle) * a
    velocity = np.array([v.real, v.imag, 0.0])
    axis = _heading(velocity) if log_scale == 0.0 and angle == 0.0 else np.array([0.0, 0.0, 1.0])
    return Similarity(log_scale, angle, axis, velocity)


# The group: exponential and logarithm


def _travel(t: np.ndarray, log_scale: float, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """`t phi(t z)` for z = log_scale (along the axis) and for z = log_scale + i angle (across it)."""
    z = complex(log_scale, angle)
    growth = np.expm1(t * log_scale) / log_scale if abs(log_scale) > _TINY else t
    spiral = np.expm1(t * z) / z if abs(z) > _TINY else t.astype(complex)
    return growth, spiral


def _reaching(log_scale: float, angle: float, axis: np.ndarray, start: np.ndarray, step: np.ndarray) -> Similarity:
    """The similarity of that scale and turn (an angle within [-pi, pi]) that takes `start` to `start + step`."""
    if log_scale == 0.0 and angle == 0.0:
        return Similarity(0.0, 0.0, _heading(step), step)
    growth, spiral = _travel(np.ones(1), log_scale, angle)
    along, across, turned = _split(step, axis)
    w = 1.0 / complex(spiral[0])
    velocity = along / growth[0] + w.real * across + w.imag * turned
    return Similarity(
        log_scale, angle, axis, velocity - (log_scale * start + angle * np.cross(axis, start))
    )  # seen from `start`, where no digits cancel; then from the origin


def _between(a: tuple[np.ndarray, float, np.ndarray], b: tuple[np.ndarray, float, np.ndarray]) -> Similarity:
    """The similarity from frame (origin, scale, quaternion) `a` to frame `b`."""
    (start, size_a, q_a), (end, size_b, q_b) = a, b
    angle, axis = _turn(_product(q_b, q_a * (1.0, -1.0, -1.0, -1.0)), _ROUNDING)
    ratio = (size_b - size_a) / size_a
    log_scale = math.log1p(ratio) if abs(ratio) < 0.5 else math.log(size_b / size_a)
    return _reaching(_unless_noise(log_scale, _ROUNDING), angle, axis, start, end - start)


def _rotation(angles: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Rodrigues: (n, 3, 3), the rotations by `angles` about the unit vector `axis`."""
    across = np.eye(3) - np.outer(axis, axis)
    versine = 2.0 * np.sin(0.5 * angles) ** 2
    return np.eye(3) - versine[:, None, None] * across + np.sin(angles)[:, None, None] * _cross_matrix(axis)


def _split(v: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`v` along the axis, across it, and the latter turned by a quarter turn: the complex plane 1, i."""
    along = (axis @ v) * axis
    return along, v - along, np.cross(axis, v)


def _cross_matrix(a: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _quaternion(angle: float, axis: np.ndarray) -> np.ndarray:
    return np.concatenate(([math.cos(0.5 * angle)], math.sin(0.5 * angle) * axis))


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    w = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate(([w], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])))


def _turn(q: np.ndarray, noise: float) -> tuple[float, np.ndarray]:
    """The angle in [0, pi] and the axis of a quaternion: well conditioned at 0 and at pi."""
    sine = float(np.linalg.norm(q[1:]))
    if sine <= noise:
        return 0.0, np.array([0.0, 0.0, 1.0])
    towards = q[1:] / sine
    towards /= np.linalg.norm(towards)
    return 2.0 * math.atan2(sine, abs(q[0])), towards if q[0] >= 0.0 else -towards


def _matrix_quaternion(r: np.ndarray) -> np.ndarray:
    """The unit quaternion of a rotation matrix; the largest of its four is found first (Shepperd 1978)."""
    squares = np.array([np.trace(r), r[0, 0], r[1, 1], r[2, 2]])
    first = int(np.argmax(squares))
    if first == 0:
        q = np.array([1.0 + squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    else:
        i, j, k = first - 1, first % 3, (first + 1) % 3
        q = np.empty(4)
        q[0] = r[k, j] - r[j, k]
        q[1 + i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        q[1 + j] = r[j, i] + r[i, j]
        q[1 + k] = r[k, i] + r[i, k]
    return q / np.linalg.norm(q)


# What comes in


def _frame(value: Any, name: str) -> tuple[np.ndarray, float, np.ndarray]:
    """A frame as its origin, its scale and its unit quaternion."""
    array = finite(value, name)
    if array.shape == (3, 3):
        origin, axes = array[0], array[1:]
    elif array.shape in ((4, 4), (3, 4)):
        if array.shape == (4, 4) and not np.array_equal(array[3], (0.0, 0.0, 0.0, 1.0)):
            raise ArgumentError(f"{name}: expected the last row (0, 0, 0, 1), got {_written(array[3])}")
        origin, axes = array[:3, 3], array[:3, :3].T
    else:
        raise ArgumentError(
            f"{name}: expected (origin, x, y) or a matrix of shape (4, 4) or (3, 4), got shape {array.shape}"
        )
    lengths = np.linalg.norm(axes, axis=1)
    if not lengths.min() > 0.0:
        raise ArgumentError(f"{name}: expected axes of a length above 0, got the lengths {_written(lengths)}")
    scale = float(np.linalg.norm(axes) / math.sqrt(len(axes)))
    units = axes / scale
    defect = float(np.abs(units @ units.T - np.eye(len(axes))).max())
    if defect > _RIGHT_ANGLES:
        raise ArgumentError(
            f"{name}: expected orthogonal axes of one length, to {_RIGHT_ANGLES:g}; these miss by {defect:.3g} "
            f"(lengths {_written(lengths)})"
        )
    if len(units) == 2:
        units = np.vstack((units, np.cross(units[0], units[1])))
    if np.linalg.det(units) < 0.0:
        raise ArgumentError(
            f"{name}: expected right-handed axes, got left-handed ones; "
            "mirror images are not similarities of a steady lattice"
        )
    return origin, scale, _matrix_quaternion(units.T)


def _pair(value: Any, name: str) -> tuple[complex, complex]:
    pair = finite(value, name)
    if pair.shape != (2, 2):
        raise ArgumentError(f"{name}: expected two points (x, y), got shape {pair.shape}")
    if np.array_equal(pair[0], pair[1]):
        raise ArgumentError(f"{name}: expected two distinct points, got {_written(pair[0])} twice")
    return complex(*pair[0]), complex(*pair[1])


def _unless_noise(value: float, noise: float) -> float:
    return 0.0 if abs(value) <= noise else value


def _heading(v: np.ndarray) -> np.ndarray:
    """The direction of `v`, or z."""
    largest = float(np.abs(v).max())
    if largest == 0.0:
        return np.array([0.0, 0.0, 1.0])
    v = v / largest  # its square must not underflow
    return v / np.linalg.norm(v)


def _written(numbers: np.ndarray) -> str:
    return repr(tuple(float(x) for x in numbers))


def _spelled(axis: Any) -> str:
    return repr(axis) if isinstance(axis, str) else _written(np.asarray(axis, dtype=float))


def _named(similarity: Similarity, text: str) -> Similarity:
    object.__setattr__(similarity, "_spelling", text)
    return similarity
