"""Tapes: a Field lowered to straight-line code for the evaluators.

Lowering orders the graph, shares common subexpressions (the graph is hash-consed, so a node is computed once) and allocates
registers by liveness. A *grid* tape is for samples of an axis-aligned grid: subexpressions of one coordinate only (the
`sin(k x)` of a periodic surface) are hoisted into per-axis tables that are evaluated once, in float64, and enter a block as a
broadcast. A *point* tape reads coordinates from registers. Foreign leaves are fed from outside, by `frep/evaluate.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .beam_kernels import CONSTANT_0, CONSTANT_2, SEPARABLE
from .field import Field
from .ops import OPERATIONS

WIDTH = 12
"""Columns of an instruction: operation, output register, up to eight argument registers, the data
index of a leaf, and what is known of its arguments (bits, see `frep/beam_kernels.py`)."""

CODE = {name: i for i, name in enumerate(OPERATIONS)}
_N = len(CODE)
LOAD_X, LOAD_Y, LOAD_Z = _N, _N + 1, _N + 2
"""Broadcast an entry of an axis table into a block register; the column after the output is the table's slot."""
LOAD_EXTERNAL = _N + 3
"""Copy a row of externally supplied values (foreign leaves)."""
BEAMS = _N + 4
"""Distance to a skeleton, `frep/beam_kernels.py`."""
GRID = _N + 5
"""A sampled grid, `frep/grid_kernels.py`."""

_LEAF_CODE = {"beams": BEAMS, "grid": GRID}


@dataclass(frozen=True, eq=False)
class Tape:
    """Straight-line code. See the module documentation.

    Attributes:
        code: (n, WIDTH) int32 instructions.
        n_registers: registers in use, including inputs and constants.
        constants: (c,) float64; constant i sits in register `constant_start + i` before the code runs.
        constant_start: first constant register. In a point tape registers 0, 1, 2 hold x, y, z.
        outputs: register of each result.
        hoisted: for each axis, the Fields of that axis alone that the code loads (grid tapes).
        leaves: data leaves in the order of their data index.
        externals: the foreign leaf nodes in the order of their external slot.
    """

    code: np.ndarray
    n_registers: int
    constants: np.ndarray
    constant_start: int
    outputs: np.ndarray
    hoisted: tuple[tuple[Field, ...], tuple[Field, ...], tuple[Field, ...]]
    leaves: tuple[Field, ...]
    externals: tuple[Field, ...]


@dataclass
class _Lowering:
    hoist: bool
    code: list[list[int]] = field(default_factory=list)
    hoisted: tuple[list[Field], list[Field], list[Field]] = field(default_factory=lambda: ([], [], []))
    leaves: list[Field] = field(default_factory=list)
    externals: list[Field] = field(default_factory=list)


def lower(outputs: tuple[Field, ...], *, hoist: bool) -> Tape:
    """Straight-line code for one or more Fields; `hoist=True` makes a grid tape."""
    state = _Lowering(hoist)
    order = _needed(outputs, hoist)
    constants = [n for n in order if n.op == "constant"]
    first = 0 if hoist else 3
    register = {n: first + i for i, n in enumerate(constants)}
    next_register = first + len(constants)
    fixed = set(register.values())

    last_use = dict.fromkeys(order, -1)
    for i, node in enumerate(order):
        if not _is_input(node, hoist):
            for a in node.args:
                last_use[a] = i
    for out in outputs:
        last_use[out] = len(order)

    free: list[int] = []
    for i, node in enumerate(order):
        if node.op == "constant":
            continue
        if node.op == "coordinate" and not hoist:
            register[node] = node.data
            fixed.add(node.data)
            continue
        # The output never shares a register with an argument: the block loops vectorise only without aliasing.
        if free:
            out = free.pop()
        else:
            out = next_register
            next_register += 1
        register[node] = out
        state.code.append(_instruction(node, out, register, state))
        if not _is_input(node, hoist):
            for a in set(node.args):
                if last_use[a] == i and register[a] not in fixed:
                    free.append(register[a])

    return Tape(
        code=np.array(state.code, dtype=np.int32).reshape(-1, WIDTH),
        n_registers=max(next_register, 3),
        constants=np.array([c.data for c in constants], dtype=np.float64),
        constant_start=first,
        outputs=np.array([register[o] for o in outputs], dtype=np.int32),
        hoisted=tuple(tuple(h) for h in state.hoisted),  # type: ignore[arg-type]
        leaves=tuple(state.leaves),
        externals=tuple(state.externals),
    )


def _is_hoisted(node: Field) -> bool:
    # Data leaves are evaluated in blocks, never on an axis.
    return len(node.axes) == 1 and not node.has_data


def _is_input(node: Field, hoist: bool) -> bool:
    return node.op in ("constant", "coordinate", "foreign") or (hoist and _is_hoisted(node))


def _needed(outputs: tuple[Field, ...], hoist: bool) -> list[Field]:
    """Topological order of the nodes that the code touches: nothing below an input."""
    order: list[Field] = []
    seen: set[Field] = set()
    for root in outputs:
        stack = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if ready:
                order.append(node)
            elif node not in seen:
                seen.add(node)
                stack.append((node, True))
                if not _is_input(node, hoist):
                    stack.extend((a, False) for a in reversed(node.args) if a not in seen)
    return order


def _known(leaf: Field, hoist: bool) -> int:
    """What the kernels need not find out about a leaf's arguments, as bits."""
    separable = hoist and all(_is_hoisted(a) and a.axes == {axis} for axis, a in enumerate(leaf.args[:3]))
    bits = SEPARABLE if separable else 0
    bits |= CONSTANT_0 if leaf.args[3].is_constant else 0
    return bits | (CONSTANT_2 if leaf.args[5].is_constant else 0)


def _instruction(node: Field, out: int, register: dict[Field, int], state: _Lowering) -> list[int]:
    if node.op == "foreign":
        state.externals.append(node)
        head = [LOAD_EXTERNAL, out, len(state.externals) - 1]
    elif state.hoist and _is_input(node, True):
        (axis,) = node.axes
        state.hoisted[axis].append(node)
        head = [(LOAD_X, LOAD_Y, LOAD_Z)[axis], out, len(state.hoisted[axis]) - 1]
    elif node.op in _LEAF_CODE:
        state.leaves.append(node)
        head = [_LEAF_CODE[node.op], out, *(register[a] for a in node.args)]
        head += [0] * (10 - len(head)) + [len(state.leaves) - 1, _known(node, state.hoist)]
    else:
        head = [CODE[node.op], out, *(register[a] for a in node.args)]
    return head + [0] * (WIDTH - len(head))
