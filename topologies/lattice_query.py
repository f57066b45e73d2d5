"""The calls of LatticeQuery, with their names, arguments and defaults, made by this kernel (LF-rep 4.6; Letov's public code).

A LatticeQuery script runs with its import line changed:

    from topologies.lattice_query import bcc_heterogeneous_lattice

Imports of what LatticeQuery's own functions were built from (`eachpointAdaptive`, `unit_cell`, `transition_unit_cell`), which
some scripts have and do not use, go.

What comes back is a `frep.Solid`, one part and not a compound of overlapping cells: `result.save("part.stl", voxel=0.2)`.
The block starts at the origin. Beams and balls on its outer faces are whole, as in LatticeQuery; intersect with a box to cut
them. Sheets end at the block. `unit_cell_size` may be three numbers.

**Grading.** Diameters and thicknesses go from their `min_` to their `max_` along z by the `rule`, layer by layer
(`sample="cell"`): layer k of N has the law's value at t = k / (N - 1), and a beam or ball that two layers share has the larger
of their diameters. `sample="point"` takes the law at every point instead, with t from 0 to 1 over the height.

| rule | value at t, of N layers |
|---|---|
| "linear" | min + (max - min) t |
| "sin" | the mean, and half the difference times sin(N t): a period every 2 pi cells |
| "parabola" | min + 4 (max - min) t (1 - t) |
| "parabola_thesis" | min + max - 4 max (t - 1/2)^2, which peaks at min + max (LF-rep 4.1 as printed) |
| "linear_truncation" | "linear", where the truncation is what varies |

Differs from LatticeQuery:

- every rule works everywhere; "sin" is that of its sheets, since that of its beams leaves the range asked for; "parabola"
  peaks at max, "parabola_thesis" as LatticeQuery does;
- nodes are balls of the diameter given, 0 for none; beams end in half balls;
- `c_section` counts, a truncation out of its range is refused, and so is a min above its max;
- surfaces are the nodal ones, their walls measured along the normal, without seams.

Where `cadquery` has been imported, every function is also a method of `cq.Workplane` (see `register`).
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from frep import MissingDependencyError

from .lattice_query_beams import (
    bcc_heterogeneous_lattice,
    cubic_heterogeneous_lattice,
    cylinder,
    diamond_heterogeneous_lattice,
    fbcc_heterogeneous_lattice,
    fcc_heterogeneous_lattice,
    rco_heterogeneous_lattice,
    tco_heterogeneous_lattice,
    tcubic_heterogeneous_lattice,
)
from .lattice_query_laws import placed
from .lattice_query_sheets import SolidCellsWarning as SolidCellsWarning
from .lattice_query_sheets import (
    gyroid_heterogeneous_lattice,
    gyroid_homogeneous_lattice,
    schwartz_d_heterogeneous_lattice,
    schwartz_p_heterogeneous_lattice,
    transition_layer,
)

__all__ = [
    "BCC_heterogeneous_lattice",
    "bcc_heterogeneous_lattice",
    "cubic_heterogeneous_lattice",
    "cylinder",
    "diamond_heterogeneous_lattice",
    "fbcc_heterogeneous_lattice",
    "fcc_heterogeneous_lattice",
    "gyroid_heterogeneous_lattice",
    "gyroid_homogeneous_lattice",
    "rco_heterogeneous_lattice",
    "register",
    "schwartz_d_heterogeneous_lattice",
    "schwartz_heterogeneous_lattice",
    "schwartz_p_heterogeneous_lattice",
    "tco_heterogeneous_lattice",
    "tcubic_heterogeneous_lattice",
    "transition_layer",
]

BCC_heterogeneous_lattice = bcc_heterogeneous_lattice
schwartz_heterogeneous_lattice = schwartz_p_heterogeneous_lattice
"""Names of older scripts."""


def _method(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function as a method of a workplane, in whose axes its parts are put."""

    @functools.wraps(function)
    def method(self: Any, *args: Any, **options: Any) -> Any:
        plane = self.plane
        turn = np.array([plane.xDir.toTuple(), plane.yDir.toTuple(), plane.zDir.toTuple()]).T
        origin = np.array(plane.origin.toTuple())
        made = function(*args, **options)
        if isinstance(made, tuple):
            return tuple(placed(part, turn, origin) for part in made)
        return placed(made, turn, origin)

    return method


def register() -> None:
    """Make every function of this module a method of `cq.Workplane`: `cq.Workplane("XY").bcc_heterogeneous_lattice(10, ...)`.

    The method returns the Solid, in the axes of the workplane. On import this is done where `cadquery` has been imported before,
    as in LatticeQuery's scripts and in CQ-editor; call it where it comes later. A script's own
    `cq.Workplane.f = f` does no harm, and the plain function is what it calls afterwards.

    Raises:
        MissingDependencyError: no cadquery.
    """
    try:
        import cadquery
    except ImportError as error:
        raise MissingDependencyError("register: needs cadquery: pip install cadquery") from error
    for name in __all__:
        if name != "register":
            setattr(cadquery.Workplane, name, _method(globals()[name]))


if "cadquery" in sys.modules:
    register()
