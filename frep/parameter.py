"""Control parameters of design files and lattice programs: a default, the range that makes sense, and a unit.

A script says `twist = frep.parameter(0.3, 0, 1, "rad")`. Run alone it gets the default. Run by `frep mesh` or `frep lattice`
with `--param twist=0.5`, it gets the new value, which has been held against the range before anything ran.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar

from .errors import ArgumentError, ArgumentTypeError

Value = int | float | str | bool | tuple[Any, ...]
"""What a parameter can be."""

_V = TypeVar("_V", bound=int | float | str | tuple[Any, ...])


@dataclass(frozen=True)
class Parameter:
    """A control parameter as a script declares it.

    Attributes:
        name: the name to which the script assigns it.
        default: its value where nobody asks for another.
        low: the least value accepted, of every number of a tuple; None for any.
        high: the largest value accepted; None for any.
        unit: of the value and of the range ("mm", "rad", ...); empty for a pure number.
        help: what it controls, in a few words.
    """

    name: str
    default: Value
    low: float | None = None
    high: float | None = None
    unit: str = ""
    help: str = ""

    def validate(self) -> None:
        """Refuse a declaration that makes no sense: a default out of range, a range of text, an empty one.

        Raises:
            ArgumentError, ArgumentTypeError: as for `parameter`.
        """
        numeric = _numbers(self.default)
        for side, limit in (("low", self.low), ("high", self.high)):
            if limit is None:
                continue
            if isinstance(limit, bool) or not isinstance(limit, int | float):
                raise ArgumentTypeError(f"{side}: expected a number or None, got {limit!r}")
            if math.isnan(limit):
                raise ArgumentError(f"{side}: expected a number or None, got {limit!r}")
            if numeric is None:
                raise ArgumentTypeError(f"{side}: only numbers have a range, and the default is {self.default!r}")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ArgumentError(f"low: {self.low:g} lies above high, {self.high:g}; the range is empty")
        for side, text in (("unit", self.unit), ("help", self.help)):
            if not isinstance(text, str):
                raise ArgumentTypeError(f"{side}: expected text, got {text!r}")
        self.check(self.default, "default: ")

    @property
    def is_count(self) -> bool:
        """Whether only whole numbers fit: all its numbers are written as such, and it has a unit of nothing."""
        limits = [limit for limit in (self.low, self.high) if limit is not None]
        whole = isinstance(self.default, int) and not isinstance(self.default, bool)
        return whole and not self.unit and bool(limits) and all(isinstance(limit, int) for limit in limits)

    @property
    def range(self) -> str:
        """The range and unit in words: "0 to 1 rad", "at least 2", or nothing where anything goes."""
        unit = f" {self.unit}" if self.unit else ""
        if self.low is not None and self.high is not None:
            return f"{self.low:g} to {self.high:g}{unit}"
        if self.low is not None:
            return f"at least {self.low:g}{unit}"
        return f"at most {self.high:g}{unit}" if self.high is not None else ""

    def check(self, value: Value, prefix: str = "") -> None:
        """Hold a value against the range.

        Args:
            value: of the kind of the default.
            prefix: how the message begins.

        Raises:
            ArgumentError: a number that is not finite or out of range; the message gives the range and its unit.
            ArgumentTypeError: no number, text, truth value or tuple of numbers.
        """
        if not isinstance(value, int | float | str | tuple):
            raise ArgumentTypeError(f"{prefix}expected a number, text, True or False, or a tuple, got {value!r}")
        subject = f"{self.name}=" if self.name else ""
        numbers = _numbers(value)
        if numbers is None and _numbers(self.default) is not None:
            raise ArgumentError(
                f"{prefix}{subject}{value!r} does not fit its default {self.default!r}; expected numbers"
            )
        for number in numbers or ():
            below = self.low is not None and number < self.low
            above = self.high is not None and number > self.high
            if not math.isfinite(number) or below or above:
                what = self.range if self.range else f"finite numbers{self.unit and ' in ' + self.unit}"
                raise ArgumentError(f"{prefix}{subject}{value!r} is out of range; expected {what}")
        if self.is_count and not isinstance(value, int):
            raise ArgumentError(f"{prefix}{subject}{value!r} is no count; expected a whole number of {self.range}")


def parameter(default: _V, low: float | None = None, high: float | None = None, unit: str = "", help: str = "") -> _V:
    """Declare a control parameter of a design file or a lattice program.

    The call is assigned to a name at the top level of the script, with its arguments written out (numbers, text, `math.pi`
    and arithmetic of these), so that the parameters can be listed without running the script.

    Args:
        default: the value: a number, text, True or False, or a tuple of numbers. A whole number without a unit, within a
            range of whole numbers, is a count: `--param` then takes whole numbers only.
        low: the least value accepted, None for any.
        high: the largest value accepted, None for any.
        unit: of the value and the range, for lists and messages.
        help: what it controls, in a few words.

    Returns:
        The default: the script runs alone as well as under `--param`.

    Raises:
        ArgumentError: a default out of range, or an empty range.
        ArgumentTypeError: a range for something that is no number.

    Example:
        >>> import frep
        >>> twist = frep.parameter(0.3, 0, 1, "rad")
        >>> twist
        0.3
        >>> frep.parameter(3, 0, 1, "rad")
        Traceback (most recent call last):
        frep.errors.ArgumentError: default: 3 is out of range; expected 0 to 1 rad
    """
    Parameter("", default, low, high, unit, help).validate()
    return default


def _numbers(value: Any) -> tuple[int | float, ...] | None:
    """The numbers of a value; None where it is none."""
    if isinstance(value, bool | str):
        return None
    if isinstance(value, int | float):
        return (value,)
    if isinstance(value, tuple) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value):
        return value
    return None
