"""Tapes: nothing computed twice, nothing overwritten while needed, nothing of one axis computed in a block."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import frep
from frep import Field, coordinates
from frep.evaluate import Program, _axis_table, values_at
from frep.field import constant, topological
from frep.ops import OPERATIONS
from frep.tape import CODE, LOAD_EXTERNAL, LOAD_X, LOAD_Y, LOAD_Z, Tape, lower

x, y, z = coordinates()
LOADS = (LOAD_X, LOAD_Y, LOAD_Z, LOAD_EXTERNAL)
NAME = {code: name for name, code in CODE.items()}

ORACLE: dict[str, Callable] = {
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "absolute": np.abs,
    "sin": np.sin,
    "cos": np.cos,
    "negative": np.negative,
    "less": np.less,
    "where": lambda c, a, b: np.where(c != 0, a, b),
}


def oracle(field: Field, points: np.ndarray) -> np.ndarray:
    """Node by node with numpy, nothing ever overwritten."""
    values: dict[Field, np.ndarray] = {}
    for node in topological([field]):
        if node.op == "constant":
            values[node] = np.full(len(points), node.data)
        elif node.op == "coordinate":
            values[node] = points[:, node.data]
        else:
            values[node] = np.asarray(ORACLE[node.op](*(values[a] for a in node.args)), float)
    return values[field]


def random_graph(seed: int, size: int, *, wide: bool) -> Field:
    """A graph in which a node may be used long after it was made, by many."""
    rng = np.random.default_rng(seed)
    nodes: list[Field] = [x, y, z, x + y, y * z + 0.5]
    names = [n for n in ORACLE if n not in ("absolute", "negative")]
    while len(nodes) < size:
        name = names[rng.integers(len(names))]
        reach = len(nodes) if wide else min(len(nodes), 6)
        pick = [nodes[-1 - rng.integers(reach)] for _ in range(OPERATIONS[name].arity)]
        if rng.uniform() < 0.2:
            pick[-1] = constant(float(rng.integers(-4, 5)) / 4)
        node = Field(name, tuple(pick)) if name not in ("multiply", "add", "subtract") else None
        # Keep values of order one, so that no difference hides in a large number.
        nodes.append(node if node is not None else frep.sin(Field(name, tuple(pick))))
    total = nodes[-1]
    for node in nodes[:: 3 if wide else 40]:
        total = total + node
    return total


def arguments_of(instruction: np.ndarray) -> list[int]:
    """Registers that an instruction reads."""
    code = int(instruction[0])
    if code in LOADS:
        return []
    if code in NAME:
        return [int(r) for r in instruction[2 : 2 + OPERATIONS[NAME[code]].arity]]
    return [int(r) for r in instruction[2:5]]


def nodes_of(field: Field) -> set[Field]:
    return {n for n in topological([field]) if n.op not in ("constant", "coordinate")}


# --- registers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wide", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_registers_are_never_overwritten_while_needed(seed, wide):
    field = random_graph(seed, 400, wide=wide)
    points = np.random.default_rng(seed).uniform(-2, 2, (600, 3))
    want = oracle(field, points)
    # less() turns the last bit of a sine into a step where it compares nearly equal numbers: few points may differ.
    close = np.isclose(field(points), want, rtol=1e-9, atol=1e-9)
    assert close.mean() > 0.995
    axes = tuple(np.linspace(-2, 2, 16) + 0.01 * a for a in range(3))
    out = np.empty((1, 8, 512))
    blocks = np.argwhere(np.ones((2, 2, 2))).astype(np.int32)
    Program((field,)).on_blocks(blocks, axes, out)
    dense = out.reshape(2, 2, 2, 8, 8, 8).transpose(0, 3, 1, 4, 2, 5).reshape(-1)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    assert np.isclose(dense, oracle(field, grid), rtol=0, atol=2e-3).mean() > 0.98


@pytest.mark.parametrize("hoist", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_an_output_never_shares_a_register_with_an_argument(seed, hoist):
    tape = lower((random_graph(seed, 300, wide=True), random_graph(seed + 50, 100, wide=False)), hoist=hoist)
    for instruction in tape.code:
        assert int(instruction[1]) not in arguments_of(instruction)


@pytest.mark.parametrize("hoist", [True, False])
def test_inputs_are_never_written_and_everything_is_written_before_it_is_read(hoist):
    tape = lower((random_graph(3, 300, wide=True),), hoist=hoist)
    constants = range(tape.constant_start, tape.constant_start + len(tape.constants))
    known = set(constants) | (set() if hoist else {0, 1, 2})
    inputs = set(known)
    for instruction in tape.code:
        assert set(arguments_of(instruction)) <= known
        assert int(instruction[1]) not in inputs
        known.add(int(instruction[1]))
    assert set(tape.outputs.tolist()) <= known
    assert max(known) < tape.n_registers


def test_registers_grow_with_what_is_alive_not_with_length():
    chain = x
    for i in range(400):
        chain = frep.sin(chain + 0.001 * (i % 3))
    tape = lower((chain,), hoist=False)
    assert tape.n_registers <= 3 + len(tape.constants) + 2


# --- sharing -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_an_instruction_for_each_distinct_node(seed):
    field = random_graph(seed, 200, wide=True)
    assert len(lower((field,), hoist=False).code) == len(nodes_of(field))


def test_what_is_written_twice_is_computed_once():
    def part():
        return frep.sin(x * y) + frep.cos(y * z)

    field = part() ** 2 + frep.exp(part()) - part() / (1 + frep.square(part()))
    codes = [NAME[c] for c in lower((field,), hoist=False).code[:, 0]]
    assert codes.count("sin") == codes.count("cos") == codes.count("exp") == codes.count("square") == 1


def test_outputs_share_their_common_parts():
    radius = frep.sqrt(x**2 + y**2 + z**2)
    tape = lower((radius - 1, radius - 2, radius, radius - 1, x, constant(4.0)), hoist=False)
    assert [NAME[c] for c in tape.code[:, 0]].count("sqrt") == 1
    assert tape.outputs[0] == tape.outputs[3]
    fields = (radius - 1, radius - 2, radius, x, constant(4.0))
    got = values_at(fields, np.array([[3.0, 4.0, 12.0]]))[:, 0]
    assert got.tolist() == [12.0, 11.0, 13.0, 3.0, 4.0]


def test_constants_are_folded():
    field = x * y * (2 * math.pi / constant(4.0)) + frep.sqrt(constant(2.0)) * frep.exp(constant(1.0))
    tape = lower((field,), hoist=False)
    assert sorted(NAME[c] for c in tape.code[:, 0]) == ["add", "multiply", "multiply"]
    assert sorted(tape.constants) == pytest.approx([math.pi / 2, math.sqrt(2) * math.e], rel=1e-15)


# --- deep and wide -------------------------------------------------------------------------------------------------------


def test_deep_chains_do_not_recurse():
    field, depth = x, 5000
    for i in range(depth):
        field = field * 0.999 + (y if i % 2 else z) * 1e-3
    points = np.random.default_rng(0).uniform(-1, 1, (10, 3))
    want = points[:, 0].copy()
    for i in range(depth):
        want = want * 0.999 + points[:, 1 if i % 2 else 2] * 1e-3
    assert np.allclose(field(points), want, rtol=1e-9)
    low, high = field.bounds((-1, -1, -1), (1, 1, 1))
    assert low <= want.min()
    assert want.max() <= high
    assert len(repr(field)) < 5000
    assert field.substitute(y, z, x)(points) == pytest.approx(field(points[:, [1, 2, 0]]), rel=1e-12)
    gradient = field.gradient(points)
    assert np.allclose(gradient[:, 0], 0.999**depth, rtol=1e-9)
    import pickle

    assert pickle.loads(pickle.dumps(field)) is field
    del field, gradient


def test_shared_graphs_do_not_explode():
    """A node used twice at each of sixty levels is a tree of 2^60 leaves."""
    field = x
    for _ in range(60):
        field = frep.sin(field) * 0.5 + frep.cos(field) * 0.5
    assert len(lower((field,), hoist=False).code) <= 60 * 5
    assert len(repr(field)) < 5000
    value = 0.3
    for _ in range(60):
        value = math.sin(value) * 0.5 + math.cos(value) * 0.5
    assert field((0.3, 0, 0)) == pytest.approx(value, rel=1e-12)


# --- grid tapes ------------------------------------------------------------------------------------------------------------


def gyroid(cell: float) -> Field:
    k = 2 * math.pi / cell
    sx, sy, sz = np.sin(k * x), np.sin(k * y), np.sin(k * z)
    cx, cy, cz = np.cos(k * x), np.cos(k * y), np.cos(k * z)
    return sx * cy + sy * cz + sz * cx


def codes(tape: Tape) -> list[int]:
    return tape.code[:, 0].tolist()


def test_a_gyroid_on_a_grid_has_no_sine_in_its_blocks():
    field = abs(gyroid(5.0)) - 0.5
    tape = lower((field,), hoist=True)
    assert not {CODE["sin"], CODE["cos"]} & set(codes(tape))
    assert [len(h) for h in tape.hoisted] == [2, 2, 2]
    assert sorted(NAME[c] for c in codes(tape) if c not in LOADS) == sorted(
        ["multiply"] * 3 + ["add"] * 2 + ["absolute", "subtract"]
    )
    assert {CODE["sin"], CODE["cos"]} <= set(codes(lower((field,), hoist=False)))


def test_what_is_hoisted_depends_on_its_own_axis_and_is_as_large_as_can_be():
    law = frep.exp(-frep.square(frep.sin(x) + 3)) / (2 + frep.cos(x))
    field = law * frep.sqrt(abs(y)) + frep.sin(x * y) + z
    tape = lower((field,), hoist=True)
    assert tape.hoisted[0] == (law, x) or tape.hoisted[0] == (x, law)
    for axis, fields in enumerate(tape.hoisted):
        assert all(f.axes == {axis} for f in fields)
    assert codes(tape).count(CODE["sin"]) == 1
    assert CODE["exp"] not in codes(tape)


def test_a_field_of_one_axis_or_none_still_fills_blocks():
    axes = tuple(np.arange(8.0) + 10 * a for a in range(3))
    outputs = (frep.sin(y), constant(2.5), z, x + 0.5)
    out = np.empty((4, 1, 512), np.float32)
    Program(outputs).on_blocks(np.zeros((1, 3), np.int32), axes, out)
    i, j, k = np.indices((8, 8, 8)).reshape(3, -1)
    assert np.allclose(out[0, 0], np.sin(10 + j), atol=1e-6)
    assert np.all(out[1] == 2.5)
    assert np.array_equal(out[2, 0], 20.0 + k)
    assert np.array_equal(out[3, 0], i + 0.5)


def test_leaves_with_data_are_not_hoisted():
    curve = frep.foreign(lambda a, b, c: np.interp(a, [0, 8], [0, 1])).substitute(x, 0, 0)
    tape = lower((frep.sin(curve) * y,), hoist=True)
    assert codes(tape).count(LOAD_EXTERNAL) == 1
    assert CODE["sin"] in codes(tape)
    axes = tuple(np.arange(8.0) for _ in range(3))
    out = np.empty((1, 1, 512), np.float32)
    Program((frep.sin(curve) * y,)).on_blocks(np.zeros((1, 3), np.int32), axes, out)
    i, j, _ = np.indices((8, 8, 8)).reshape(3, -1)
    assert np.allclose(out[0, 0], np.sin(i / 8) * j, atol=1e-6)


def test_axis_tables_are_made_in_float64():
    """sin(k x) at 3 m is still right to the last bit of float32, where a float32 argument would be off by a thousandth."""
    k = 2 * math.pi / 5
    positions = 3000.0 + 0.25 * np.arange(64)
    field = np.sin(k * x)
    truth = np.sin(k * positions)
    assert np.max(np.abs(_axis_table((field,), 0, positions)[0] - truth)) < 6.1e-8
    axes = (positions, positions - 6000, positions - 3000)
    out = np.empty((1, 1, 512), np.float32)
    Program((gyroid(5.0),)).on_blocks(np.array([[3, 2, 1]], np.int32), axes, out)
    a, b, c = (k * axes[i][8 * (3 - i) : 8 * (4 - i)] for i in range(3))
    a, b, c = a[:, None, None], b[None, :, None], c[None, None, :]
    want = np.sin(a) * np.cos(b) + np.sin(b) * np.cos(c) + np.sin(c) * np.cos(a)
    assert np.max(np.abs(out.reshape(8, 8, 8) - want)) < 1e-6
