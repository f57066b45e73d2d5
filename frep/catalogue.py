"""What topologies there are: entries that packages announce, and what can be found out about each.

A package lists its topologies in an iterable of `Entry` and announces that in the entry-point group `frep.topologies`:

    [project.entry-points."frep.topologies"]
    mine = "my_package.catalogue:ENTRIES"

The kernel knows no topology by name. An entry says how to make one; forms, valences and volume fractions are found out
from what comes, by what it has: the methods `thicken`, `sheet`, `solid`, `inverse` and `twin`, a `skeleton`, a `period`
or `cell`.
"""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .arguments import suggestion
from .errors import ArgumentError, ArgumentTypeError, EmptyError, warn
from .parameter import Parameter, Value
from .primitives import box
from .skeleton import PeriodicSkeleton
from .solid import Solid

GROUP = "frep.topologies"
"""The entry-point group; each of its entry points is an iterable of `Entry`."""

FORMS = {"thicken": "diameter", "sheet": "thickness", "solid": "bias", "inverse": "bias", "twin": "thickness"}
"""The methods by which a topology becomes a Solid, and the argument of each that says how much of it."""


class CatalogueWarning(UserWarning):
    """Topologies that a package announces, but that cannot be loaded; they are left out."""


@dataclass(frozen=True)
class EntryParameter(Parameter):
    """A parameter of a topology: a `Parameter` that may be a choice, or whose range goes with the cell.

    Attributes:
        choices: the values accepted, if they are few.
        of_cell: the range is in shares of the shortest side of the cell.
        above: the least value is itself not accepted.
        required: there is no default.
    """

    choices: tuple[Value, ...] = ()
    of_cell: bool = False
    above: bool = False
    required: bool = False

    @property
    def range(self) -> str:
        """The values accepted, in words: "0 to 0.5 of the cell", "one of 'square', 'hexagonal'"."""
        if self.choices:
            return f"one of {', '.join(map(repr, self.choices))}"
        if self.above and self.low is not None:
            most = "" if self.high is None else f" and at most {self.high:g}"
            return f"more than {self.low:g}{most}" + (f" {self.unit}" if self.unit else "")
        if self.of_cell and self.low is not None and self.high is not None:
            return f"{self.low:g} to {self.high:g} of the cell"
        return super().range

    def accept(self, value: Any, cell: float) -> None:
        """Refuse a number out of range, or a text that is no choice; a Field, a body and the like are the maker's affair.

        Args:
            value: what was given.
            cell: shortest side of the cell, mm.

        Raises:
            ArgumentError: naming the parameter, the value and what is accepted.
        """
        if self.choices:
            # An array is no choice; asked whether it is in a tuple, it raises.
            if not isinstance(value, str | int | float | None) or value not in self.choices:
                raise ArgumentError(
                    f"{self.name}: expected {self.range}, got {value!r}{suggestion(value, self.choices)}"
                )
            return
        numbers = value if isinstance(value, tuple | list) else (value,)
        if not all(isinstance(n, int | float | np.number) and not isinstance(n, bool | np.bool_) for n in numbers):
            return
        scale = cell if self.of_cell else 1.0
        slack = 1e-9 * scale
        for n in map(float, numbers):
            low = self.low is not None and (n < scale * self.low - slack or (self.above and n <= scale * self.low))
            high = self.high is not None and n > scale * self.high + slack
            if low or high or not np.isfinite(n):
                of = f" {cell:g} mm" if self.of_cell else ""
                raise ArgumentError(f"{self.name}: expected {self.range or 'a finite number'}{of}, got {value!r}")


@dataclass(frozen=True)
class Facts:
    """What is known of a topology beyond what its attributes tell; None where there is no such thing.

    Attributes:
        pinch: the diameter or thickness, of the cell's shortest side, from which on its channels are closed pockets;
            0 where they are from the start.
        full: that at which nothing of the channels is left.
        bias: the biases between which `solid` is neither empty nor all, in the unit of the bias.
        range: least and largest value of the waveform; of noise, which seldom comes near them, its bounds.
        symmetry: its point group (Hermann-Mauguin).
    """

    pinch: float | None = None
    full: float | None = None
    bias: tuple[float, float] | None = None
    range: tuple[float, float] | None = None
    symmetry: str | None = None


@dataclass(frozen=True)
class Known:
    """What `Entry.found_out` found once and somebody wrote down, so that a list needs no sample; names as in `Entry`.

    Attributes:
        forms: the methods by which the topology becomes a Solid.
        complement_congruent: whether one side has the shape of the other.
        valences: how many beams meet at a node.
        period: mm after which the sample repeats.
        facts: what was sampled.
        fractions: by form, the volume fractions at the widths of `Entry.curve`; None at those that were refused.
    """

    forms: tuple[str, ...]
    complement_congruent: bool = False
    valences: tuple[int, ...] = ()
    period: tuple[float, float, float] | None = None
    facts: Facts = Facts()
    fractions: Mapping[str, tuple[float | None, ...]] = field(default_factory=dict)


def _no_facts(_: Any) -> Facts:
    return Facts()


@dataclass(frozen=True, eq=False)
class Entry:
    """A topology of the catalogue.

    Attributes:
        name: under which it is asked for; unique.
        family: the group it is listed in.
        summary: what it is, in a sentence.
        make: the function that makes it, of the parameters by name.
        parameters: those of `make` worth a line.
        source: where it comes from: paper, equation, table.
        call: how a script makes it, as text.
        example: parameters of the sample, which facts, curves and pictures are of; those without a default, at least.
        methods: which of the sample's methods are its forms, where not all of `FORMS` that it has are.
        body: what the sample is cut to and measured in, where it has no period.
        widest: where the curves end if nothing is known to be full, in shares of `size`.
        facts_of: what finds out `Facts` of the sample.
        note: what else there is to know, in a sentence.
        known: what has been found out and written down; the rest is found out of the sample when asked for.

    Example:
        >>> import frep
        >>> def layers(cell=10.0):
        ...     return Layers(cell)
        >>> class Layers:  # a topology needs no base class
        ...     def __init__(self, cell):
        ...         self.period = (cell, cell, cell)
        ...     def sheet(self, thickness):
        ...         z = frep.coordinates()[2]
        ...         return frep.Solid(abs(frep.mod(z, self.period[2]) - 0.5 * self.period[2]) - 0.5 * thickness)
        >>> entry = Entry("layers", "mine", "Layers across z.", layers)
        >>> entry.forms, entry.signed
        (('sheet',), False)
        >>> round(entry.fraction("sheet", 2.5), 3)
        0.25
    """

    name: str
    family: str
    summary: str
    make: Callable[..., Any]
    parameters: tuple[EntryParameter, ...] = ()
    source: str = ""
    call: str = ""
    example: Mapping[str, Any] = field(default_factory=dict)
    methods: tuple[str, ...] | None = None
    body: Solid | None = None
    widest: float = 1.0
    facts_of: Callable[[Any], Facts] = _no_facts
    note: str = ""
    known: Known | None = None

    def __repr__(self) -> str:
        return f"<Entry {self.name}: {self.summary}>"

    def __str__(self) -> str:
        return "\n".join(f"{name:<11} {_wrapped(value)}" for name, value in self.lines())

    # --- made --------------------------------------------------------------------------------------------------------

    def build(self, **parameters: Any) -> Any:
        """The topology with these parameters, checked before anything is made. Raises as `check`, and as the maker."""
        self.check(**parameters)
        return self.make(**parameters)

    def check(self, **parameters: Any) -> None:
        """Hold names and numbers against what the entry lists.

        Raises:
            ArgumentError: an unknown name, a number out of range, a parameter that is missing.
        """
        known = {p.name: p for p in self.parameters}
        for name in parameters:
            if name not in known:
                takes = ", ".join(known) or "no parameters"
                raise ArgumentError(
                    f"{name}: {self.name} has no such parameter{suggestion(name, known)}; it takes {takes}"
                )
        missing = [p.name for p in self.parameters if p.required and p.name not in parameters]
        if missing:
            raise ArgumentError(
                f"{missing[0]}: {self.name} needs it: {known[missing[0]].help or 'there is no default'}"
            )
        cell = _least(parameters.get("cell"), _least(known["cell"].default if "cell" in known else None, 1.0))
        for name, value in parameters.items():
            if value is not known[name].default:
                known[name].accept(value, cell)

    @cached_property
    def sample(self) -> Any:
        """The topology that facts, curves and pictures are of."""
        return self.make(**self.example)

    def solid(self, form: str, width: float, topology: Any = None) -> Solid:
        """The sample, or another topology of this entry, in one of its forms.

        Args:
            form: one of `forms`.
            width: diameter, thickness or bias, as `FORMS` says.
            topology: None for the sample.

        Raises:
            ArgumentError: a form that it has not, or a width that it refuses.
        """
        if form not in self.forms:
            raise ArgumentError(
                f"form: {self.name} has {', '.join(self.forms) or 'none'}, got {form!r}{suggestion(form, self.forms)}"
            )
        return getattr(self.sample if topology is None else topology, form)(**{FORMS[form]: width})

    def block(self, cells: int = 2) -> Solid:
        """A box of so many periods each way; the sample's body where it has no period."""
        if self.period is None:
            assert self.body is not None
            return self.body
        return box((0, 0, 0), tuple(cells * float(p) for p in self.period))

    # --- facts -------------------------------------------------------------------------------------------------------

    @cached_property
    def forms(self) -> tuple[str, ...]:
        """The methods of the topology by which it becomes a Solid."""
        if self.known is not None:
            return self.known.forms
        if self.methods is not None:
            return self.methods
        return tuple(name for name in FORMS if callable(getattr(self.sample, name, None)))

    @property
    def signed(self) -> bool:
        """Whether the topology parts space into two sides, so that `solid` says something."""
        return "solid" in self.forms

    @property
    def complement_congruent(self) -> bool:
        """Whether one side has the shape of the other, so that `inverse` and walls of negative bias say nothing new."""
        if self.known is not None:
            return self.known.complement_congruent
        return bool(getattr(self.sample, "complement_congruent", False))

    @cached_property
    def valences(self) -> tuple[int, ...]:
        """How many beams meet at a node, of all nodes of a period; empty where there are no beams."""
        if self.known is not None:
            return self.known.valences
        skeleton = getattr(self.sample, "skeleton", None)
        if skeleton is None or not len(skeleton.edges):
            return ()
        number = np.arange(len(skeleton.nodes))
        if isinstance(skeleton, PeriodicSkeleton):
            share = skeleton.nodes / skeleton.size
            # The last node of a period is the first of the next.
            folded = np.round(share - np.floor(share + 1e-6), 6) + 0.0
            _, number = np.unique(folded, axis=0, return_inverse=True)
        met = np.bincount(number.reshape(-1)[skeleton.edges].reshape(-1))
        return tuple(int(n) for n in np.unique(met[met > 0]))

    @cached_property
    def period(self) -> np.ndarray | None:
        """(3,) mm after which the sample repeats; None where it does not."""
        if self.body is not None:
            return None
        if self.known is not None and self.known.period is not None:
            return np.array(self.known.period)
        skeleton = getattr(self.sample, "skeleton", None)
        if isinstance(skeleton, PeriodicSkeleton):
            return skeleton.size
        for name in ("period", "cell"):
            if (found := getattr(self.sample, name, None)) is not None:
                return np.broadcast_to(np.asarray(found, float), (3,))
        raise ArgumentTypeError(
            f"{self.name}: its sample is a {type(self.sample).__name__} without `period` or `cell`; it needs a body"
        )

    @cached_property
    def facts(self) -> Facts:
        """What the entry's own function finds out; sampled where there is no formula, therefore only when asked."""
        return self.facts_of(self.sample) if self.known is None else self.known.facts

    def found_out(self) -> Known:
        """Everything that can be found out of the sample, whatever is known: to be written down, and to be held to it."""
        entry = replace(self, known=None)
        period: Any = None if entry.period is None else tuple(float(p) for p in entry.period)
        fractions = {}
        for form in entry.forms:
            measured = dict(zip(*(row.tolist() for row in entry.curve(form)), strict=True))
            fractions[form] = tuple(measured.get(float(width)) for width in entry.widths(form))
        return Known(entry.forms, entry.complement_congruent, entry.valences, period, entry.facts, fractions)

    @property
    def size(self) -> float:
        """Shortest side of the sample's cell, mm: what `Facts` are shares of."""
        known = {p.name: None if p.required else p.default for p in self.parameters} | dict(self.example)
        for name in ("cell", "cell_size"):
            if (value := known.get(name)) is not None:
                return float(np.min(np.asarray(value, float)))
        if self.known is None and getattr(self.sample, "cell", None) is not None:
            return float(np.min(self.sample.cell))
        return float(np.min(self.period if self.period is not None else np.ptp(self.block().bounds, axis=0)))

    def span(self, form: str) -> tuple[float, float]:
        """Between which widths of a form something happens: none to where all is full, or the biases of a surface."""
        if FORMS[form] == "bias":
            return self.facts.bias or (-0.5 * self.size, 0.5 * self.size)
        return 0.0, (self.facts.full or self.widest) * self.size

    def widths(self, form: str, count: int = 9) -> np.ndarray:
        """(n,) widths of a form spread evenly between the ends of `span`, without them."""
        low, high = self.span(form)
        return low + (high - low) * (np.arange(count) + 0.5) / count

    def fraction(self, form: str, width: float) -> float:
        """Volume fraction of the sample, by the smoothed step of `frep.measure`: to 0.005, of smooth shapes to 0.003."""
        solid = self.solid(form, width)
        if self.period is not None:
            return fraction_of(solid, self.period)
        block = self.block()
        voxel = float(np.ptp(block.bounds, axis=0).min()) / 32.0
        try:
            return (solid & block).volume(voxel) / block.volume(voxel)
        except EmptyError:
            return 0.0

    def curve(self, form: str, count: int = 9) -> tuple[np.ndarray, np.ndarray]:
        """Volume fraction against width: (n,) widths, (n,) fractions; widths that the topology refuses are left out.

        Widths are those of `widths`; what is known of them is not sampled again.
        """
        known = self.known.fractions.get(form, ()) if self.known is not None else ()
        if len(known) == count:
            pairs = [(w, s) for w, s in zip(self.widths(form, count), known, strict=True) if s is not None]
            return np.array([w for w, _ in pairs]), np.array([s for _, s in pairs])
        widths, shares = [], []
        for width in self.widths(form, count):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # sealed channels are for the one who builds with them
                try:
                    shares.append(self.fraction(form, float(width)))
                except ArgumentError:
                    continue
            widths.append(float(width))
        return np.array(widths), np.array(shares)

    @property
    def shown(self) -> tuple[str, float]:
        """The form and width of its picture: slender, so that the eye looks through."""
        form = self.forms[0]
        low, high = self.span(form)
        return form, low + (high - low) * (0.5 if FORMS[form] == "bias" else 0.2)

    # --- told --------------------------------------------------------------------------------------------------------

    def lines(self) -> list[tuple[str, str]]:
        """Name and text of each thing there is to say, without what has to be sampled."""
        rows = [("name", self.name), ("family", self.family), ("what", self.summary)]
        rows += [("source", self.source)] if self.source else []
        rows += [("call", self.call)] if self.call else []
        rows += [("parameters" if k == 0 else "", told(p)) for k, p in enumerate(self.parameters)]
        if self.forms:
            rows.append(("forms", ", ".join(f"{form}({FORMS[form]})" for form in self.forms)))
            congruent = ", complement-congruent" if self.complement_congruent else ""
            rows.append(("waveform", ("signed" if self.signed else "unsigned") + congruent))
        if self.valences:
            rows.append(("valences", ", ".join(map(str, self.valences))))
        return rows + ([("note", self.note)] if self.note else [])

    def record(self) -> dict[str, Any]:
        """All of it as numbers, texts and lists, for JSON; of what has no such form (a body, say) its repr."""
        facts = self.facts
        return {
            "name": self.name,
            "family": self.family,
            "summary": self.summary,
            "source": self.source,
            "call": self.call,
            "note": self.note,
            "parameters": [
                {
                    "name": p.name,
                    "default": None if p.required else _plain(p.default),
                    "required": p.required,
                    "unit": p.unit,
                    "range": p.range,
                    "low": p.low,
                    "high": p.high,
                    "above": p.above,
                    "of_cell": p.of_cell,
                    "choices": _plain(p.choices),
                    "meaning": p.help,
                }
                for p in self.parameters
            ],
            "forms": list(self.forms),
            "signed": self.signed,
            "complement_congruent": self.complement_congruent,
            "symmetry": facts.symmetry,
            "valences": list(self.valences),
            "pinch": _plain(facts.pinch),
            "full": _plain(facts.full),
            "range": _plain(facts.range),
            "bias": _plain(facts.bias),
            "period": _plain(self.period),
            "size": _plain(self.size),
            "sample": {name: _plain(value) for name, value in self.example.items()},
        }


def told(parameter: EntryParameter) -> str:
    """A parameter in a line: `cell = 10 mm (more than 0 mm): the period`."""
    default = f"{parameter.default:.5g}" if isinstance(parameter.default, float) else repr(parameter.default)
    value = "" if parameter.required else f" = {default}"
    unit = f" {parameter.unit}" if parameter.unit and parameter.default is not None and not parameter.required else ""
    allowed = f" ({parameter.range})" if parameter.range else ""
    return f"{parameter.name}{value}{unit}{allowed}" + (f": {parameter.help}" if parameter.help else "")


def fraction_of(solid: Solid, period: Any) -> float:
    """Share of space that a periodic solid fills: how many of the places spread through a period are in it.

    Args:
        solid: fills all space.
        period: (3,) mm.

    Example:
        >>> import frep
        >>> z = frep.coordinates()[2]
        >>> layers = frep.Solid(abs(frep.mod(z, 4.0) - 2.0) - 0.5)
        >>> round(fraction_of(layers, (4, 4, 4)), 3)
        0.25
    """
    from .places import share_within

    return share_within(solid, period)


def _plain(value: Any) -> Any:
    """What JSON can hold of a value; None for an infinite number, which it cannot."""
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    return repr(value)


def _least(value: Any, otherwise: float) -> float:
    """The shortest of one or three sizes; another number for what is none (the maker complains)."""
    try:
        return float(np.min(np.asarray(value, float))) if value is not None else otherwise
    except (TypeError, ValueError):
        return otherwise


def _wrapped(text: str) -> str:
    return ("\n" + 12 * " ").join(textwrap.wrap(text, 100) or [""])


# --- found -----------------------------------------------------------------------------------------------------------


def discover() -> dict[str, Entry]:
    """All entries that installed packages announce in the entry-point group `frep.topologies`, by name.

    Warns:
        CatalogueWarning: an announcement that cannot be loaded, or is no iterable of `Entry`, or repeats a name; the rest
            is there all the same.
    """
    from importlib.metadata import entry_points

    found: dict[str, Entry] = {}
    # A package installed twice (a checkout and a wheel) announces the same thing twice.
    for value, point in {point.value: point for point in entry_points(group=GROUP)}.items():
        try:
            entries = tuple(point.load())
            strange = [entry for entry in entries if not isinstance(entry, Entry)]
            if strange:
                raise TypeError(f"expected frep.catalogue.Entry, got {strange[0]!r}")
            unnamed = [entry.name for entry in entries if not isinstance(entry.name, str) or not entry.name]
            if unnamed:
                raise TypeError(f"expected a name for each entry, got {unnamed[0]!r}")
        except (Exception, SystemExit) as error:
            # Whatever another package's import may raise, `sys.exit` too, must not take the others along.
            warn(f"topologies: {value!r} cannot be loaded and is left out: {error!r}", CatalogueWarning)
            continue
        for entry in entries:
            if entry.name in found:
                warn(f"topologies: {value!r} repeats the name {entry.name!r}; it is left out", CatalogueWarning)
            else:
                found[entry.name] = entry
    return found


def find(entries: Mapping[str, Entry], name: str) -> Entry:
    """The entry of that name.

    Raises:
        ArgumentError: there is none; the message names the nearest.
    """
    if not isinstance(name, str) or name not in entries:
        some = ", ".join(list(entries)[:12]) or "none"
        known = suggestion(name, entries) or f"; there are {some}{' and so on' if len(entries) > 12 else ''}"
        raise ArgumentError(f"name: no topology {name!r}{known}")
    return entries[name]


def of_family(entries: Mapping[str, Entry], family: str | None) -> dict[str, Entry]:
    """The entries of a family, or all.

    Raises:
        ArgumentError: there is no such family; the message names those there are.
    """
    families = list(dict.fromkeys(entry.family for entry in entries.values()))
    if family is not None and family not in families:
        raise ArgumentError(
            f"family: expected one of {', '.join(families)}, got {family!r}{suggestion(family, families)}"
        )
    return {name: entry for name, entry in entries.items() if family in (None, entry.family)}
