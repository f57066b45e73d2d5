"""frep: graded cellular structures as signed fields, from a short script to a print-ready part.

    import frep
    from topologies import beams
    from graded import parabola

    diameter = parabola("x", 0, 200, ends=1, middle=6)
    part = beams.bcc(cell=10).thicken(diameter, node=1.1 * diameter) & frep.box((0, 0, 0), (200, 60, 60))
    part.mesh(voxel=0.5).save("bcc.stl")

Six nouns carry everything: `Field` (a scalar expression of position), `Solid` (where a field is negative), a topology (see
the package `topologies`), a coordinate map (`conformal`), `SparseGrid` (samples round the surface) and `Mesh`.
Lengths are mm, angles rad, fields negative inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .errors import (
    ArgumentError,
    ArgumentTypeError,
    DisconnectedWarning,
    EmptyError,
    FileError,
    FrepError,
    FunctionError,
    MissingDependencyError,
    ThinWallWarning,
    TooLargeError,
    UnboundedError,
)
from .field import Field, FieldLike, as_field, constant, coordinates, foreign, trace
from .functions import (
    arctan,
    arctan2,
    clip,
    cos,
    exp,
    floor,
    hypot,
    log,
    maximum,
    minimum,
    mod,
    power,
    sign,
    sin,
    sqrt,
    square,
    tan,
    tanh,
    where,
)
from .grid import SparseGrid
from .parameter import parameter
from .primitives import box, capsule, cone, cylinder, half_space, rounded_box, sphere, torus
from .solid import Solid, difference, intersection, union

if TYPE_CHECKING:
    from .bodies import from_mesh, load
    from .check import MeshReport
    from .mesh import Mesh
    from .view import render

__version__ = "0.1.0"

_LAZY = {
    "Mesh": "mesh",
    "MeshReport": "check",
    "from_mesh": "bodies",
    "load": "bodies",
    "render": "view",
}


def __getattr__(name: str) -> Any:
    # What few scripts need, or what needs a heavy library, loads when it is used.
    if name in _LAZY:
        from importlib import import_module

        return getattr(import_module(f".{_LAZY[name]}", __name__), name)
    raise AttributeError(f"module 'frep' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})


__all__ = [
    "ArgumentError",
    "ArgumentTypeError",
    "DisconnectedWarning",
    "EmptyError",
    "Field",
    "FieldLike",
    "FileError",
    "FrepError",
    "FunctionError",
    "Mesh",
    "MeshReport",
    "MissingDependencyError",
    "Solid",
    "SparseGrid",
    "ThinWallWarning",
    "TooLargeError",
    "UnboundedError",
    "arctan",
    "arctan2",
    "as_field",
    "box",
    "capsule",
    "clip",
    "cone",
    "constant",
    "coordinates",
    "cos",
    "cylinder",
    "difference",
    "exp",
    "floor",
    "foreign",
    "from_mesh",
    "half_space",
    "hypot",
    "intersection",
    "load",
    "log",
    "maximum",
    "minimum",
    "mod",
    "parameter",
    "power",
    "render",
    "rounded_box",
    "sign",
    "sin",
    "sphere",
    "sqrt",
    "square",
    "tan",
    "tanh",
    "torus",
    "trace",
    "union",
    "where",
]
