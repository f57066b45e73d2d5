"""A steady lattice written out as the Python program that builds it: what an edited model is pasted back as.

Source: Constructive Lattice Geometry 6.2 (each edit emits code); Gupta et al., Programmed-Lattice Editor, 7.3 (assisted coding).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from frep.errors import ArgumentError

from .steady_files import room_for

if TYPE_CHECKING:
    from topologies.steady import SteadyLattice

_SIMILARITIES = ("Screw", "Similarity", "Swirl", "Translation")


def program_text(lattice: SteadyLattice) -> str:
    """Python source that rebuilds a lattice, bit for bit, under the name `lattice`; similarities as their repr spells them.

    It is a lattice program as it stands: `frep lattice FILE info` takes it. Give names to what should be a parameter.
    """
    u, v, w = (repr(similarity) for similarity in lattice.skeleton.directions)
    counts, start = tuple(lattice.counts.tolist()), tuple(lattice.start.tolist())
    room = room_for(counts, lattice.racks)
    region = "" if room == counts else f".region({start}, {counts})"
    used = [name for name in _SIMILARITIES if re.search(rf"\b{name}\(", f"{u} {v} {w}")]
    lines = [
        f'"""A steady lattice: {_several(len(lattice.nodes), "ball")} and {_several(len(lattice.racks), "rack")} a cluster, '
        f'{" x ".join(str(n) for n in counts)} clusters. Lengths are mm."""',
        "",
        f"from topologies.steady import {', '.join(sorted([*used, 'SteadyLattice']))}",
        "",
        *_listed("nodes", [_row(node) for node in lattice.nodes]),
        f"radii = {_row(lattice.radii, '[]')}",
        *_listed("racks", [_row(rack) for rack in lattice.racks], "start ball, end ball, di, dj, dk"),
        f"u = {u}",
        f"v = {v}",
        f"w = {w}",
        f"lattice = SteadyLattice(nodes, radii, racks, u, v, w, counts={room}, start={start}){region}",
    ]
    return "\n".join(lines) + "\n"


def rack_between(start: Any, end: Any) -> tuple[int, int, int, int, int]:
    """The rack of the beam between two balls, as one pastes it into a program: it then joins all such pairs.

    Args:
        start: index (i, j, k, node) of a ball, as `nodes_meeting` gives it.
        end: index of the other.

    Returns:
        (start node, end node, di, dj, dk).

    Raises:
        ArgumentError: not four whole numbers each, or twice the same ball.

    Example:
        >>> rack_between((2, 0, 1, 0), (3, 0, 0, 1))
        (0, 1, 1, 0, -1)
    """
    rows = []
    for name, value in (("start", start), ("end", end)):
        row = np.asarray(value)
        if row.shape != (4,) or not np.issubdtype(row.dtype, np.integer):
            raise ArgumentError(f"{name}: expected four whole numbers (i, j, k, node), got {value!r}")
        rows.append([int(n) for n in row])
    a, b = rows
    if a == b:
        raise ArgumentError(f"end: expected another ball than the start, {tuple(a)}")
    return (a[3], b[3], b[0] - a[0], b[1] - a[1], b[2] - a[2])


def _listed(name: str, rows: list[str], comment: str = "") -> list[str]:
    head = f"{name} = ["
    if not rows:
        return [f"{head}]"]
    return [f"{head}  # {comment}" if comment else head, *(f"    {row}," for row in rows), "]"]


def _row(values: Any, brackets: str = "()") -> str:
    numbers = ", ".join(repr(value) for value in np.asarray(values).tolist())
    return f"{brackets[0]}{numbers}{brackets[1]}"


def _several(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
