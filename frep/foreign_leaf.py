"""Foreign leaves: Python functions that cannot be traced, called in batches and watched for nonsense."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .errors import FunctionError


@dataclass(frozen=True, eq=False)
class Foreign:
    """A user function with an optional Lipschitz bound. Two wraps of the same function are different leaves."""

    function: Callable[..., Any]
    lipschitz: float | None
    name: str
    # Unique beyond this process: a pickled leaf must not meet another function of the same number in a worker.
    serial: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def content_key(self) -> bytes:
        return f"foreign {self.serial}".encode()

    def call(self, points: np.ndarray) -> np.ndarray:
        """Values at (n, 3) points, checked.

        Raises:
            FunctionError: the function raised (the original is the cause), or returned NaN or the wrong shape.
        """
        if len(points) == 0:
            return np.empty(0)
        # Copies, so that a function that writes to its arguments harms nobody.
        x, y, z = (points[:, axis].copy() for axis in range(3))
        try:
            with np.errstate(all="ignore"):
                result = self.function(x, y, z)
        except FunctionError:
            raise
        except (ValueError, TypeError) as error:
            result = self._one_by_one(points, error)
        except Exception as error:
            raise FunctionError(f"the function {self.name!r} raised {type(error).__name__}: {error}") from error
        try:
            if result is None or np.iscomplexobj(result):
                raise TypeError("real numbers are needed")
            values = np.asarray(result, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FunctionError(
                f"the function {self.name!r} must return real numbers, it returned {type(result).__name__}: {result!r:.80}"
            ) from error
        if values.ndim == 0:
            values = np.full(len(points), float(values))
        if values.shape != (len(points),):
            raise FunctionError(
                f"the function {self.name!r} must return an array of shape ({len(points)},) for {len(points)} points, "
                f"it returned shape {values.shape}"
            )
        bad = np.flatnonzero(np.isnan(values))
        if len(bad):
            where = ", ".join(f"{v:.6g}" for v in points[bad[0]])
            raise FunctionError(f"the function {self.name!r} returned NaN at ({where}) and {len(bad) - 1} more points")
        return values

    def _one_by_one(self, points: np.ndarray, first: Exception) -> np.ndarray:
        """A function written for single numbers (`if x < 0`, `math.sin(x)`): call it point by point."""
        try:
            return np.array([float(self.function(*map(float, p))) for p in points])
        except Exception as error:
            raise FunctionError(
                f"the function {self.name!r} raised {type(error).__name__} for single numbers ({error}) and "
                f"{type(first).__name__} for arrays ({first})"
            ) from error
