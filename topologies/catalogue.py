"""The catalogue: every topology by name, with its parameters and limits, and the designs worth trying of one.

    names("surfaces"); print(describe("gyroid")); make("reentrant", cell=8, angle=0.4); doe("gyroid", thickness=[0.5, 1])

`frep topologies` lists the same, with those of other packages (`frep.catalogue.discover`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

import frep
from frep import ArgumentError, ArgumentTypeError, Field, Solid
from frep.catalogue import FORMS, Entry, find, of_family, suggestion

from .catalogue_entries import entries

ENTRIES: tuple[Entry, ...] = entries()
"""Every entry; what the entry point of this package announces."""

_BY_NAME = {entry.name: entry for entry in ENTRIES}

VARIANTS = {"solid": "solid", "inverse": "inverse", "thin": "sheet", "twin": "twin"}
"""LatticeRobot's variants and the methods that make them; Thin of beams is `thicken`."""


def names(family: str | None = None) -> list[str]:
    """The names of all topologies, or of a family: "beams", "surfaces", "foams", "stochastic", "noise", "steady".

    Raises:
        ArgumentError: no such family.

    Example:
        >>> names("foams")
        ['honeycomb', 'kelvin', 'rhombic', 'closed_cubes']
    """
    return list(of_family(_BY_NAME, family))


def describe(name: str) -> Entry:
    """The entry of a topology; printed, it tells all but what takes samples.

    Raises:
        ArgumentError: no such topology; the message names the nearest.

    Example:
        >>> print(describe("octet"))
        name        octet
        family      beams
        what        Octet truss: FCC and the octahedron of its face centres, twelve beams at every node.
        source      Fuller 1961, US patent 2 986 241; Deshpande, Fleck and Ashby 2001
        call        from topologies import beams; beams.octet(cell=10)
        parameters  cell = 10 mm (more than 0 mm): the period; a number, or three for cuboid cells
        forms       thicken(diameter)
        waveform    unsigned
        valences    12
    """
    return find(_BY_NAME, name)


def make(name: str, **parameters: Any) -> Any:
    """A topology by name, its parameters checked.

    Args:
        name: as in `names`.
        parameters: as `describe(name)` lists them; stochastic ones need their `body`.

    Raises:
        ArgumentError: an unknown name or parameter (the message names the nearest), or a value out of range (it says
            the range).

    Example:
        >>> make("gyroid", cell=5)
        <gyroid, cell 5 x 5 x 5 mm>
        >>> make("gyriod")
        Traceback (most recent call last):
        frep.errors.ArgumentError: name: no topology 'gyriod'; did you mean 'gyroid'?
    """
    return describe(name).build(**parameters)


# --- design of experiments -------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Design:
    """One of the designs that `doe` enumerates.

    Attributes:
        name: of the topology.
        variant: "solid", "inverse", "thin" or "twin".
        parameters: all that was chosen: those of the topology, `thickness` or `bias` or both.
    """

    name: str
    variant: str
    parameters: Mapping[str, Any]

    def __repr__(self) -> str:
        chosen = "".join(f", {name}={value!r}" for name, value in self.parameters.items())
        return f"<Design {self.name} {self.variant}{chosen}>"

    @property
    def topology(self) -> Any:
        """The topology, without its body."""
        entry = describe(self.name)
        return entry.build(**{k: v for k, v in self.parameters.items() if k not in ("thickness", "bias")})

    def solid(self) -> Solid:
        """The design as a Solid; most fill all space.

        Raises:
            ArgumentError: a thickness or bias that the topology refuses.
        """
        topology = self.topology
        form = _form(describe(self.name), self.variant)
        options = {k: v for k, v in self.parameters.items() if k in ("thickness", "bias")}
        if form == "thicken":
            options = {"diameter": options["thickness"]}
        return getattr(topology, form)(**options)


def doe(
    name: str,
    *,
    variants: Iterable[str] | str = tuple(VARIANTS),
    thickness: Any = (),
    bias: Any = (0.0,),
    **parameters: Any,
) -> list[Design]:
    """The designs of a topology that differ, for a design of experiments; redundant ones are left out (LatticeRobot).

    - A thickness says nothing of Solid and Inverse, which are listed once a bias.
    - Where one side of a surface has the shape of the other (gyroid, D, Schwarz P: `complement_congruent`), Inverse is
      redundant, and so are negative biases of Thin and Twin. Inverse at a bias is listed as Solid at its negative, Thin
      and Twin at a negative bias as those at the positive one, each once: no shape that was asked for is lost.
    - Of an unsigned waveform (beams, foams) Solid and Inverse are redundant, since they are Thin and Twin: these are
      listed, those of the two that there are, at no bias.

    Args:
        name: as in `names`.
        variants: of "solid", "inverse", "thin" and "twin"; those that the topology has not are left out.
        thickness: walls or diameters in mm, a number, a Field or a list of them.
        bias: mm, alike.
        parameters: of the topology; a list stands for its values one by one, and so does an array or range of a parameter
            that has a range. Anything else, a tuple too, stands for itself.

    Raises:
        ArgumentError: unknown names, values out of range, Thin or Twin without a thickness, or nothing left.

    Example:
        >>> variants = ("solid", "inverse", "thin")
        >>> for design in doe("gyroid", thickness=[0.5, 1.0], bias=[-0.4, 0, 0.4], variants=variants):
        ...     print(design.variant, dict(design.parameters))
        solid {'bias': -0.4}
        solid {'bias': 0.0}
        solid {'bias': 0.4}
        thin {'thickness': 0.5, 'bias': 0.4}
        thin {'thickness': 0.5, 'bias': 0.0}
        thin {'thickness': 1.0, 'bias': 0.4}
        thin {'thickness': 1.0, 'bias': 0.0}
    """
    entry = describe(name)
    asked = _asked(entry, variants)
    walls, biases = _listed(thickness, "thickness"), _listed(bias, "bias")
    walled = [v for v in asked if v in ("thin", "twin")]
    if walled and not walls:
        raise ArgumentError(f"thickness: {' and '.join(walled)} {'need' if len(walled) > 1 else 'needs'} one, in mm")
    for wall in walls:
        frep.arguments.width(wall, "thickness")
    lists = {key: _values_of(entry, key, value) for key, value in parameters.items()}
    for key, row in {"bias": biases if entry.signed else [0.0], **lists}.items():
        if not row:
            raise ArgumentError(f"{key}: expected a value or a list of some, got none")
    found: dict[Any, Design] = {}
    for values in itertools.product(*lists.values()):
        chosen = dict(zip(lists, values, strict=True))
        entry.check(**chosen)
        # Drops break the congruence: the topology itself tells.
        congruent = entry.signed and bool(getattr(entry.make(**chosen), "complement_congruent", False))
        for variant in asked:
            for variant_, body in _bodies(variant, entry.signed, congruent, walls, biases):
                key = (variant_, *(_key(v) for v in (*chosen.values(), *body.values())))
                found.setdefault(key, Design(name, variant_, MappingProxyType({**chosen, **body})))
    return list(found.values())


def _asked(entry: Entry, variants: Iterable[str] | str) -> list[str]:
    """The variants asked for that the topology has and that say something."""
    if not isinstance(variants, Iterable):
        raise ArgumentTypeError(f"variants: expected some of {', '.join(VARIANTS)}, got {variants!r}")
    wanted = [variants] if isinstance(variants, str) else list(variants)
    for variant in wanted:
        if not isinstance(variant, str) or variant not in VARIANTS:
            raise ArgumentError(
                f"variants: expected {', '.join(VARIANTS)}, got {variant!r}{suggestion(variant, VARIANTS)}"
            )
    useful = [v for v in VARIANTS if _form(entry, v) in entry.forms and (entry.signed or v in ("thin", "twin"))]
    kept = [v for v in dict.fromkeys(wanted) if v in useful]
    if not kept:
        raise ArgumentError(
            f"variants: {entry.name} differs only in {', '.join(useful)}; got {', '.join(wanted) or 'none'}"
        )
    return kept


def _form(entry: Entry, variant: str) -> str:
    return "thicken" if variant == "thin" and "thicken" in entry.forms else VARIANTS[variant]


def _bodies(
    variant: str, signed: bool, congruent: bool, walls: list[Any], biases: list[Any]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Variant, thickness and bias of each design, the redundant ones under the name of those that they repeat."""
    if not signed:
        yield from ((variant, {"thickness": wall}) for wall in walls)
    elif variant in ("solid", "inverse"):
        for b in biases:
            if congruent and variant == "inverse" and not isinstance(b, Field):
                yield "solid", {"bias": 0.0 - b}
            else:
                yield variant, {"bias": b}
    else:
        for wall, b in itertools.product(walls, biases):
            # A wall that varies has no place where it would repeat itself.
            plain = congruent and not isinstance(wall, Field) and not isinstance(b, Field)
            yield variant, {"thickness": wall, "bias": abs(b) if plain else b}


def _listed(values: Any, name: str) -> list[Any]:
    """Numbers as floats, Fields and functions as Fields, of one or of a list."""
    row = list(values) if isinstance(values, list | tuple) or hasattr(values, "__array__") else [values]
    fields = [frep.as_field(value, name) for value in row]
    return [float(f.data) + 0.0 if f.is_constant else f for f in fields]


def _values_of(entry: Entry, name: str, values: Any) -> list[Any]:
    """The values of a parameter one by one."""
    if isinstance(values, list):
        return values
    ranged = any(p.name == name and (p.low is not None or p.high is not None) for p in entry.parameters)
    if ranged and (isinstance(values, range) or (isinstance(values, np.ndarray) and values.ndim == 1)):
        return [v.item() if isinstance(v, np.generic) else v for v in values]
    return [values]


def _key(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(_key, value))
    if isinstance(value, np.ndarray):
        return (value.shape, value.tobytes())
    try:
        hash(value)
    except TypeError:
        return id(value)
    return value


__all__ = ["ENTRIES", "FORMS", "VARIANTS", "Design", "Entry", "describe", "doe", "make", "names"]
