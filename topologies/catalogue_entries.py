"""The entries of the catalogue: what the modules of topologies do not say themselves, beside what is read from them.

A summary is the first sentence of a function's docstring, its source stands there in parentheses, defaults are those of
its signature. What is typed here is what code cannot tell: units, ranges, meanings.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import frep
from frep import Field, FieldLike, Solid
from frep.catalogue import Entry, EntryParameter, Facts

from . import beams, foams, noise, stochastic, tpms
from . import catalogue_facts as facts
from .catalogue_table import KNOWN

_P = EntryParameter

_MEANINGS: dict[str, EntryParameter] = {
    "foams.cell": _P(
        "", 0, low=0, above=True, unit="mm", help="the period along x; one number, cells keep their shape"
    ),
    "noise.cell_size": _P("", 0, low=0, above=True, unit="mm", help="distance of the nodes, or length of the waves"),
    "spinodal.repeat": _P("", 0, 2, 8, help="the period in cells"),
    "noise.random_state": _P("", 0, help="a whole number, with which the same comes out each time", required=True),
} | {
    p.name: p
    for p in (
        _P("cell", 0, low=0, above=True, unit="mm", help="the period; a number, or three for cuboid cells"),
        _P("cell_size", 0, low=0, above=True, unit="mm", help="side of a cube as large as a cell; number or Field"),
        _P("tau", 0, 0, 0.5, "mm", "truncation; None for equal edges", of_cell=True),
        _P(
            "setback",
            0,
            0,
            0.5,
            "mm",
            "half the diagonal of the squares; None for Kelvin's, with equal edges",
            of_cell=True,
        ),
        _P("equal", 0, help="whether the eight bubbles hold equal volumes", choices=(True, False)),
        _P(
            "angle",
            0,
            0,
            math.pi / 2,
            "rad",
            "how far slanted ribs lean inwards; less than pi / 4 in a cubic cell",
            above=True,
        ),
        _P(
            "pattern",
            0,
            help="the plane net at whose nodes they stand",
            choices=("square", "hexagonal", "triangular", "kagome"),
        ),
        _P("period", 0, help="how much of the formula a cell holds", choices=("2pi", "pi")),
        _P("t", 0, help="where between the members; number or Field", required=True),
        _P("phase", 0, unit="rad", help="three angles added to those of the formula; numbers or Fields"),
        _P("rotation", 0, help="(axis, angle in rad) or a rotation matrix"),
        _P("scale", 0, help="what bias and thickness are measured in", choices=("distance", "gradient", "range")),
        _P(
            "drop_x",
            0,
            -1,
            1,
            help="1 for the formula, 0 to flatten it along x, -1 to move or mirror it; number or Field",
        ),
        _P("drop_y", 0, -1, 1, help="the same along y"),
        _P("drop_z", 0, -1, 1, help="the same along z"),
        _P("over", 0, help="a bounded Solid or two corners in mm: the region of what varies"),
        _P(
            "body",
            0,
            help="the Solid that is filled; with periodic=True a box, whose sides are the period",
            required=True,
        ),
        _P("density", 0, low=0, above=True, help="instead of cell_size: cells a mm3; number or Field"),
        _P("seeds", 0, help="instead: (n, 3) points in the body"),
        _P(
            "weights",
            0,
            help="with seeds: radii in mm, one a seed, of balls that pull its faces outwards; None for none",
        ),
        _P("random_state", 0, help="a whole number, with which the same comes out each time, or a numpy Generator"),
        _P("method", 0, help="how seeds are placed", choices=("poisson_disk", "uniform")),
        _P("relax", 0, 0, 1000, help="steps of Lloyd's relaxation"),
        _P("periodic", 0, help="whether it repeats in all directions", choices=(False, True)),
        _P("overhang", 0, 0, unit="mm", help="how far beams may reach out of the body"),
        _P("connected", 0, help="leave out what hangs together only through the surface", choices=(True, False)),
        _P("number", 0, 1, help="how many fibres meet the body", required=True),
        _P("length", 0, 0, unit="mm", help="of a fibre before it is cut; None for all through the body", above=True),
        _P("directions", 0, help="axes near which they run; None for any direction"),
        _P("spread", 0, 0, math.pi / 2, "rad", "how far they lean away from those axes at most"),
        _P("n_waves", 0, 1, help="how many waves are drawn"),
        _P("repeat", 0, 2, 32, help="the period in cells"),
        _P("octaves", 0, 1, 30, help="noises added up, each of half the cell of the one before"),
        _P("persistence", 0, 0, 1, help="how strong each is beside the one before", above=True),
        _P("nodes", 0, help="(n, 3) centres of the balls of cluster (0, 0, 0), mm", required=True),
        _P("radii", 0, help="(n,) their radii, mm", required=True),
        _P("racks", 0, help="(m, 5): from node, to node, to which cluster", required=True),
        _P("u", 0, help="the similarity from a cluster to the next along i", required=True),
        _P("v", 0, help="along j"),
        _P("w", 0, help="along k"),
        _P("counts", 0, help="clusters along i, j and k"),
        _P("start", 0, help="index of the first cluster"),
    )
}
"""Units, ranges and meanings of parameters by name, or function or module and name; defaults come from the functions."""

_NATURAL: dict[str, Any] = {
    "phase": (0.0, 0.0, 0.0),
    "scale": "distance",
    "drop_x": 1.0,
    "drop_y": 1.0,
    "drop_z": 1.0,
}
"""Defaults of the natural parameters of a surface, as its module has them; None for the others."""

_SOURCES = {
    # Where a docstring names none.
    "octet": "Fuller 1961, US patent 2 986 241; Deshpande, Fleck and Ashby 2001",
    "octahedron": "truncated_octahedron at setback 0 (LatticeRobot)",
    "cuboctahedron": "truncated_octahedron at setback cell / 2 (LatticeRobot); LF-rep 3.1, limit of Table 3.4",
    "truncated_octahedron": "Thomson (Kelvin) 1887; LatticeRobot for the family",
    "truncated_cuboctahedron": "LF-rep 3.3, named there",
    "rhombic_dodecahedron": "the Voronoi cells of FCC (Kepler 1611)",
    "supported_cubic": "of this kernel",
    "hexagonal_honeycomb": "Gibson and Ashby 1997",
    "triangular_honeycomb": "Gibson and Ashby 1997; isogrid: Meyer et al. 1973, NASA CR-124075",
    "kagome": "Hyun and Torquato 2002",
    "columns": "LF-rep Table 3.1, its upright beams alone",
    "honeycomb": "Gibson and Ashby 1997",
    "kelvin": "Thomson (Kelvin) 1887",
    "rhombic": "the Voronoi cells of FCC (Kepler 1611)",
    "closed_cubes": "Gibson and Ashby 1997",
    "voronoi": "LF-rep 3.4; Voronoi 1908",
    "delaunay": "LF-rep 3.4; Delaunay 1934",
    "voronoi_walls": "LF-rep 3.4; Voronoi 1908",
    "fibres": "Kendall and Moran 1963, random lines",
    "perlin": "Perlin 2002, improved noise, SIGGRAPH",
}

_SOURCE = re.compile(r"\(([^()]*(?:\b1[5-9]\d\d\b|\b20\d\d\b|LF-rep|lf-rep|IntraLattice|LatticeRobot|K3DSurf)[^()]*)\)")


def source_of(function: Callable[..., Any], name: str) -> str:
    """The first parentheses of a docstring that hold a year or the name of a known work."""
    if name in _SOURCES:
        return _SOURCES[name]
    found = _SOURCE.search(" ".join((function.__doc__ or "").split()))
    return found[1].replace("lf-rep", "LF-rep") if found else ""


def summary_of(function: Callable[..., Any]) -> str:
    """The first sentence of a docstring, without its source and what follows it."""
    first = " ".join(inspect.cleandoc(function.__doc__ or "").split("\n\n")[0].split())
    # Beams tell the unit of the cell in the same paragraph; parameters have lines of their own here.
    first = re.sub(r"\. `cell` mm\b.*$", "", _SOURCE.sub("", first))
    return re.sub(r" ([.,:])", r"\1", first).rstrip(" .:") + "."


def parameters_of(function: Callable[..., Any], leave_out: Iterable[str] = ()) -> tuple[EntryParameter, ...]:
    """The parameters of a function with their defaults, and the natural parameters of a surface."""
    module = function.__module__.rpartition(".")[2]
    found: dict[str, Any] = {}
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            found.update({natural: _NATURAL.get(natural) for natural in tpms.Natural.__annotations__})
        else:
            found[name] = parameter.default
    rows = []
    for name, default in found.items():
        if name in leave_out:
            continue
        keys = (f"{function.__name__}.{name}", f"{module}.{name}", name)
        about = next((_MEANINGS[key] for key in keys if key in _MEANINGS), EntryParameter(name, 0))
        required = default is inspect.Parameter.empty or (default is None and about.required)
        known = {k: getattr(about, k) for k in ("low", "high", "unit", "help", "choices", "of_cell", "above")}
        value: Any = "" if required else default
        rows.append(EntryParameter(name, value, required=required, **known))
    return tuple(rows)


def _entry(
    function: Callable[..., Any],
    family: str,
    facts_of: Callable[[Any], Facts],
    *,
    arguments: str = "cell=10",
    leave_out: Iterable[str] = (),
    **more: Any,
) -> Entry:
    module = function.__module__.rpartition(".")[2]
    name = function.__name__
    make = more.pop("make", function)
    return Entry(
        name=name,
        family=family,
        summary=summary_of(function),
        make=make,
        parameters=parameters_of(function, leave_out),
        source=source_of(function, name),
        call=f"from topologies import {module}; {module}.{name}({arguments})",
        facts_of=facts_of,
        **more,
    )


def _cells_of(module: ModuleType, kind: str) -> list[Callable[..., Any]]:
    """The functions of a module that make a topology of a kind out of the size of a cell, in the order of the file."""
    return [
        function
        for function in vars(module).values()
        if inspect.isfunction(function)
        and function.__module__ == module.__name__
        and not function.__name__.startswith("_")
        and next(iter(inspect.signature(function).parameters), "") == "cell"
        and inspect.signature(function).return_annotation == kind
    ]


# --- beams, surfaces, foams ------------------------------------------------------------------------------------------

_HEXAGONAL = ("hexagonal_honeycomb", "triangular_honeycomb", "kagome")


def _beam_entries() -> list[Entry]:
    return [
        _entry(make, "beams", facts.of_hexagonal_beams if make.__name__ in _HEXAGONAL else facts.of_beams)
        for make in _cells_of(beams, "BeamTopology")
    ]


def _surface_entries() -> list[Entry]:
    """Scherk's tower has no period along z: it is measured where its walls cross."""
    middle = frep.box((0, 0, -5), (10, 10, 5))
    rows = []
    for name, make in tpms.SURFACES.items():
        if name == "scherk":
            rows.append(_entry(make, "surfaces", facts.of_scherk, leave_out=("drop_z",), body=middle))
        else:
            rows.append(_entry(make, "surfaces", facts.of_surface))
    for make, t, limits in ((tpms.primitive_gyroid_diamond, 0.3, (0, 2)), (tpms.primitive_neovius, 0.5, (-5, 5))):
        made = _entry(make, "surfaces", facts.of_surface, arguments=f"t={t:g}, cell=10", example={"t": t})
        parameters = tuple(
            EntryParameter("t", "", *limits, help=p.help, required=True) if p.name == "t" else p
            for p in made.parameters
        )
        rows.append(replace(made, parameters=parameters))
    return rows


def _foam_entries() -> list[Entry]:
    return [_entry(make, "foams", facts.of_foam) for make in _cells_of(foams, "Foam")]


# --- stochastic and noise --------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class VoronoiWalls:
    """The faces of the Voronoi cells of seeds in a body, without a thickness: `stochastic.voronoi_walls` in two steps.

    Attributes:
        options: all its arguments but the thickness.
        period: sides of the body, mm, where the walls repeat.
    """

    options: Mapping[str, Any]
    period: tuple[float, float, float] | None = None

    def sheet(self, thickness: FieldLike) -> Solid:
        """The walls, `thickness` mm thick: a number, a Field or a function of position."""
        return stochastic.voronoi_walls(thickness=thickness, **self.options)


def voronoi_walls(body: Solid, **options: Any) -> VoronoiWalls:
    """Voronoi walls that wait for their thickness; arguments as for `stochastic.voronoi_walls`."""
    sides = None
    if options.get("periodic"):
        a, b, c = (float(s) for s in body.bounds[1] - body.bounds[0])
        sides = (a, b, c)
    return VoronoiWalls({"body": body, **options}, sides)


@dataclass(frozen=True, eq=False)
class Noise:
    """A noise as a waveform: a Field from -1 to 1 that parts space where it is `bias`. It tells no distance.

    Attributes:
        level: the noise.
        cell: distance of its nodes, mm.
        period: after which it repeats, mm; None where it does not.
    """

    level: Field
    cell: float
    period: tuple[float, float, float] | None = None

    def solid(self, bias: FieldLike = 0.0) -> Solid:
        """Where the noise is below a bias, a number, a Field or a function of position."""
        # A noise falls from 1 to -1 in about a cell.
        return Solid((self.level - frep.as_field(bias, "bias")) * (0.5 * self.cell))

    def inverse(self, bias: FieldLike = 0.0) -> Solid:
        """Where it is above."""
        return Solid((frep.as_field(bias, "bias") - self.level) * (0.5 * self.cell))


def perlin(cell_size: float, **options: Any) -> Noise:
    """Perlin noise as a waveform; arguments as for `noise.perlin`, whose Field is its `level`."""
    level = noise.perlin(cell_size, **options)
    period = cell_size * options.get("repeat", 16)
    return Noise(level, cell_size, (period, period, period))


def simplex(cell_size: float, **options: Any) -> Noise:
    """Simplex noise as a waveform; arguments as for `noise.simplex`, whose Field is its `level`."""
    return Noise(noise.simplex(cell_size, **options), cell_size)


def _random_entries() -> list[Entry]:
    block = frep.box((0, 0, 0), (12, 12, 12))
    cells: dict[str, Any] = {"cell_size": 4.0, "random_state": 1}
    filled: dict[str, Any] = {"body": block, "periodic": True, **cells}
    felt: dict[str, Any] = {"body": block, "number": 60, "random_state": 1}
    told = "body, cell_size=4, random_state=1"
    random = partial(facts.of_random_beams, cell=4.0)
    return [
        _entry(stochastic.voronoi, "stochastic", random, arguments=told, example=filled),
        _entry(stochastic.delaunay, "stochastic", random, arguments=told, example=filled),
        _entry(
            stochastic.voronoi_walls,
            "stochastic",
            partial(facts.of_random_walls, cell=4.0),
            arguments="body, thickness=0.5, cell_size=4, random_state=1",
            leave_out=("thickness",),
            make=voronoi_walls,
            example=filled,
        ),
        _entry(
            stochastic.fibres,
            "stochastic",
            lambda _: Facts(),
            arguments="body, number=60, random_state=1",
            example=felt,
            body=block,
            widest=0.5,
        ),
        _entry(
            noise.spinodal,
            "noise",
            facts.of_spinodal,
            arguments="cell_size=5, random_state=1",
            example={"cell_size": 5.0, "repeat": 2, "random_state": 1},
        ),
        _entry(
            noise.perlin,
            "noise",
            facts.of_noise,
            arguments="cell_size=5, random_state=1",
            make=perlin,
            example={"cell_size": 5.0, "repeat": 4, "random_state": 1},
            note="A Field; the catalogue makes it a waveform with `solid` and `inverse`, its `level` is the Field.",
        ),
        _entry(
            noise.simplex,
            "noise",
            facts.of_noise,
            arguments="cell_size=5, random_state=1",
            make=simplex,
            example={"cell_size": 5.0, "random_state": 1},
            body=frep.box((0, 0, 0), (10, 10, 10)),
            note="A Field; the catalogue makes it a waveform with `solid` and `inverse`, its `level` is the Field.",
        ),
    ]


# --- steady lattices -------------------------------------------------------------------------------------------------


def steady(**parameters: Any) -> Any:
    """Without parameters a brick of 3 x 3 x 3 BCC cells, so that there is something to look at."""
    from .steady import SteadyLattice, Translation

    if parameters:
        return SteadyLattice(**parameters)
    return SteadyLattice(
        nodes=[(0, 0, 0), (2, 2, 2)],
        radii=[0.3, 0.3],
        racks=[(0, 1, -i, -j, -k) for i in (0, 1) for j in (0, 1) for k in (0, 1)],
        u=Translation((4, 0, 0)),
        v=Translation((0, 4, 0)),
        w=Translation((0, 0, 4)),
        counts=(3, 3, 3),
    )


def _steady_entry() -> Entry:
    names = {"nodes": None, "radii": None, "racks": None, "u": None, "v": None, "w": None, "counts": (1, 1, 1)}
    rows = []
    for name, default in {**names, "start": (0, 0, 0)}.items():
        about = _MEANINGS[name]
        rows.append(EntryParameter(name, "" if about.required else default, help=about.help, required=about.required))
    return Entry(
        name="steady",
        family="steady",
        summary="A brick of clusters of beams along similarities, of any size, never stored.",
        make=steady,
        parameters=tuple(rows),
        source="Gupta et al.: Programmed-Lattice Editor and RangeFinder",
        call="from topologies.steady import SteadyLattice; SteadyLattice(nodes, radii, racks, u, v, w, counts)",
        methods=("thicken",),
        body=frep.box((-1, -1, -1), (9, 9, 9)),
        widest=0.3,
        note="Its radii are its body: `solid()` needs no diameter. `frep lattice PROGRAM` examines one.",
    )


def entries() -> tuple[Entry, ...]:
    """Every topology of this package, in the order of the families."""
    found = (*_beam_entries(), *_surface_entries(), *_foam_entries(), *_random_entries(), _steady_entry())
    return tuple(replace(entry, known=KNOWN.get(entry.name)) for entry in found)
