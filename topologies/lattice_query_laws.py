"""What the calls of LatticeQuery accept, their laws, layer by layer, and where their parts stand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import frep
from frep import ArgumentError, ArgumentTypeError, Field, Solid
from frep.arguments import one_of, positive, real

Sample = Literal["cell", "point"]

_ON_A_FACE = 1e-6
"""Of the cell: a beam whose middle is that near to the boundary of two layers belongs to both."""


# --- arguments -----------------------------------------------------------------------------------------------------------


def whole_counts(**counts: Any) -> tuple[int, ...]:
    for name, n in counts.items():
        if isinstance(n, bool) or not isinstance(n, int | np.integer):
            raise ArgumentTypeError(f"{name}: expected a whole number of cells, got {n!r}")
        if n < 1:
            raise ArgumentError(f"{name}: expected at least 1 cell, got {n}")
    return tuple(int(n) for n in counts.values())


def checked_range(low: Any, high: Any, what: str, least: float | None = None) -> tuple[float, float]:
    """`min_what` and `max_what`: positive, or at least `least`, in their order."""
    names = (f"min_{what}", f"max_{what}")
    if least is None:
        found = [positive(value, name) for value, name in zip((low, high), names, strict=True)]
    else:
        found = [real(value, name, "mm") for value, name in zip((low, high), names, strict=True)]
        for value, name in zip(found, names, strict=True):
            if value < least:
                raise ArgumentError(f"{name}: expected at least {least:g}, got {value:g}")
    if found[0] > found[1]:
        raise ArgumentError(f"min_{what}: expected no more than max_{what}, {found[1]:g}, got {found[0]:g}")
    return found[0], found[1]


def checked_truncations(low: Any, high: Any) -> tuple[float, float]:
    found = checked_range(low, high, "truncation", least=0.0)
    if found[1] > 1.0:
        raise ArgumentError(f"max_truncation: expected 0 to 1, of half the cell, got {found[1]:g}")
    return found


# --- laws ----------------------------------------------------------------------------------------------------------------

RULES: dict[str, Callable[[Any, float, float, int], Any]] = {
    "linear": lambda t, low, high, n: low + (high - low) * t,
    "sin": lambda t, low, high, n: 0.5 * (low + high) + 0.5 * (high - low) * np.sin(n * t),
    # As squares, whose bounds are exact: those of t (1 - t) reach four times as far.
    "parabola": lambda t, low, high, n: high - 4.0 * (high - low) * (t - 0.5) ** 2,
    "parabola_thesis": lambda t, low, high, n: low + high - 4.0 * high * (t - 0.5) ** 2,
}
RULES["linear_truncation"] = RULES["linear"]


@dataclass(frozen=True)
class Law:
    """A rule from `low` to `high` over `n` layers of `pitch` mm along an axis."""

    rule: str
    low: float
    high: float
    n: int
    pitch: float
    axis: int

    def __post_init__(self) -> None:
        one_of(self.rule, "rule", RULES)

    @property
    def layers(self) -> np.ndarray:
        """(n,) values of the layers."""
        t = np.linspace(0.0, 1.0, self.n)
        return np.broadcast_to(RULES[self.rule](t, self.low, self.high, self.n), (self.n,))

    def field(self, sample: Sample) -> Field:
        """The law as a Field."""
        cells = frep.coordinates()[self.axis] / self.pitch
        if sample == "point":
            t = frep.clip(cells / self.n, 0.0, 1.0)
        else:
            t = frep.clip(frep.floor(cells), 0.0, self.n - 1.0) / max(self.n - 1, 1)
        return frep.as_field(RULES[self.rule](t, self.low, self.high, self.n))

    def at(self, places: np.ndarray) -> np.ndarray:
        """The values for beams or nodes at these places (m, 3) mm: of their layer, on a boundary of two the larger."""
        cells = places[:, self.axis] / self.pitch
        last = self.n - 1
        below = np.clip(np.floor(cells - _ON_A_FACE), 0, last).astype(int)
        above = np.clip(np.floor(cells + _ON_A_FACE), 0, last).astype(int)
        return np.maximum(self.layers[below], self.layers[above])


# --- where a part stands -------------------------------------------------------------------------------------------------


def euler(degrees: np.ndarray) -> np.ndarray:
    """(3, 3): about x of what is turned about y of what is turned about z."""
    matrix = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        u = np.eye(3)[axis]
        k = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        matrix = matrix @ (np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k)
    return matrix


def placed(part: Solid, turn: np.ndarray, origin: np.ndarray) -> Solid:
    """The part in the axes that are the columns of `turn`, at `origin`."""
    if not np.allclose(turn, np.eye(3), rtol=0.0, atol=1e-12):
        from scipy.spatial.transform import Rotation

        rotation = Rotation.from_matrix(turn).as_rotvec()
        part = part.rotate(rotation, float(np.linalg.norm(rotation)))
    return part.translate(origin) if np.any(origin) else part
