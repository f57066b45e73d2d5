"""Evaluators: numba interpreters over a tape, compiled once and cached, so that a new design costs no compile.

Three of them, all made from the operation table:

- *blocks*: float32 values on the 8 x 8 x 8 samples of grid leaves, a register being 512 numbers;
- *points*: float64 values at arbitrary points, in batches of 512;
- *intervals*: float64 bounds over batches of boxes, rounded outward.

Each runs an instruction over a whole register before it goes to the next, so dispatch is free and the loops vectorise.
Foreign leaves are called from here, between the kernels, with arrays.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import prange

from . import ops
from .beam_kernels import beams_block, beams_interval, largest
from .biq_kernels import CAPACITY, ROW
from .errors import FunctionError
from .field import Field
from .grid_kernels import grid_block, grid_interval
from .jit import inlined, kernel, parallel_kernel
from .packing import PackedLeaves, pack_leaves
from .tape import BEAMS, LOAD_EXTERNAL, LOAD_X, LOAD_Y, LOAD_Z, Tape, lower

BLOCK = 512
"""Samples of a leaf, points of a batch: the length of a register."""

_FAR_BLOCKS = 1024
"""Blocks whose samples are evaluated at once as points."""

_DATA_BATCH = 96
"""Points of a batch where data leaves are asked: about the vertices of one leaf block."""

_BOXES = 64
"""Boxes of an interval batch."""

_N_OPERATIONS = len(ops.OPERATIONS)
_EXACT = np.array([row.exact for row in ops.OPERATIONS.values()])
_ROUND_OUT = 4.0 * float(np.finfo(np.float64).eps)


# --- kernels made from the table -------------------------------------------------------------------------------------


def _generated(name: str, parameters: str, branches: list[str], scope: dict):
    """A kernel from generated source, cached as if it stood in ops.py, whose change must recompile it."""
    body = "".join(f"    {'if' if i == 0 else 'elif'} op == {i}:\n{b}" for i, b in enumerate(branches))
    exec(compile(f"def {name}({parameters}):\n{body}", ops.__file__, "exec"), scope)
    return kernel(scope[name])


def _arithmetic_kernel(name: str, *, fast: bool):
    scope: dict = {"__name__": ops.__name__}
    branches = []
    for row in ops.OPERATIONS.values():
        scope[f"rule_{row.name}"] = kernel(row.fast32 if fast and row.fast32 is not None else row.value)
        arguments = ", ".join(f"regs[{r}, i]" for r in "abc"[: row.arity])
        branches.append(f"        for i in range(n):\n            regs[out, i] = rule_{row.name}({arguments})\n")
    return _generated(name, "op, regs, out, a, b, c, n", branches, scope)


def _interval_kernel(name: str):
    scope: dict = {"__name__": ops.__name__}
    branches = []
    for row in ops.OPERATIONS.values():
        scope[f"rule_{row.name}"] = kernel(row.interval)
        arguments = ", ".join(f"lows[{r}, i], highs[{r}, i]" for r in "abc"[: row.arity])
        branches.append(
            f"        for i in range(n):\n            lows[out, i], highs[out, i] = rule_{row.name}({arguments})\n"
        )
    return _generated(name, "op, lows, highs, out, a, b, c, n", branches, scope)


_arithmetic_32 = _arithmetic_kernel("arithmetic_32", fast=True)
_arithmetic_64 = _arithmetic_kernel("arithmetic_64", fast=False)
_arithmetic_interval = _interval_kernel("arithmetic_interval")


# --- interpreters ------------------------------------------------------------------------------------------------------


@inlined
def _leaf(ins, regs, n, heads, fdata, idata, gdata, cutoffs, rows, local):
    out = regs[ins[1]]
    x, y, z = regs[ins[2]], regs[ins[3]], regs[ins[4]]
    head = heads[ins[10]]
    if ins[0] == BEAMS:
        p0, p1, p2, p3 = regs[ins[5]], regs[ins[6]], regs[ins[7]], regs[ins[8]]
        beams_block(head, fdata, idata, x, y, z, p0, p1, p2, p3, n, ins[11], cutoffs[ins[10]], rows, local, out)
    else:
        grid_block(head, fdata, idata, gdata, x, y, z, n, ins[11], out)


@kernel
def _run_block(code, regs, tx, ty, tz, i0, j0, k0, external, heads, fdata, idata, gdata, cutoffs, rows, local):
    """One leaf block. About 15 ns an arithmetic instruction (512 samples), 64 cycles of L1 traffic."""
    for p in range(len(code)):
        op, out, slot = code[p, 0], code[p, 1], code[p, 2]
        if op < _N_OPERATIONS:
            _arithmetic_32(op, regs, out, slot, code[p, 3], code[p, 4], BLOCK)
        elif op == LOAD_X:
            for i in range(8):
                v = tx[slot, i0 + i]
                for r in range(64):
                    regs[out, 64 * i + r] = v
        elif op == LOAD_Y:
            for j in range(8):
                v = ty[slot, j0 + j]
                for k in range(8):
                    regs[out, 8 * j + k] = v
            for i in range(64, BLOCK):
                regs[out, i] = regs[out, i - 64]
        elif op == LOAD_Z:
            for k in range(8):
                regs[out, k] = tz[slot, k0 + k]
            for i in range(8, BLOCK):
                regs[out, i] = regs[out, i - 8]
        elif op == LOAD_EXTERNAL:
            for i in range(BLOCK):
                regs[out, i] = external[slot, i]
        else:
            _leaf(code[p], regs, BLOCK, heads, fdata, idata, gdata, cutoffs, rows, local)


@parallel_kernel
def _blocks(
    code,
    n_registers,
    constants,
    outputs,
    tx,
    ty,
    tz,
    blocks,
    external,
    heads,
    fdata,
    idata,
    gdata,
    cutoffs,
    values,
    least,
):
    chunk = 64
    capacity = CAPACITY if len(cutoffs) else 0
    for c in prange((len(blocks) + chunk - 1) // chunk):
        regs = np.empty((n_registers, BLOCK), tx.dtype)
        local = np.empty((4, BLOCK), tx.dtype)
        rows = np.empty((capacity, ROW), np.float64)
        for r in range(len(constants)):
            regs[r, :] = constants[r]
        for b in range(c * chunk, min((c + 1) * chunk, len(blocks))):
            i0, j0, k0 = 8 * blocks[b, 0], 8 * blocks[b, 1], 8 * blocks[b, 2]
            _run_block(
                code, regs, tx, ty, tz, i0, j0, k0, external[:, b], heads, fdata, idata, gdata, cutoffs, rows, local
            )
            for o in range(len(outputs)):
                # Read once: inside the loop the store might, for all the compiler knows, change it.
                r = outputs[o]
                for i in range(BLOCK):
                    values[o, b, i] = regs[r, i]
                least[o, b] = -largest(regs[r], -1, BLOCK, local[0])


@parallel_kernel
def _points(
    code, n_registers, constants, outputs, points, batch, external, heads, fdata, idata, gdata, cutoffs, values
):
    capacity = CAPACITY if len(cutoffs) else 0
    for c in prange((len(points) + batch - 1) // batch):
        start = c * batch
        n = min(batch, len(points) - start)
        regs = np.empty((n_registers, batch), np.float64)
        local = np.empty((4, batch), np.float64)
        rows = np.empty((capacity, ROW), np.float64)
        for r in range(len(constants)):
            regs[3 + r, :] = constants[r]
        for i in range(n):
            for axis in range(3):
                regs[axis, i] = points[start + i, axis]
        for p in range(len(code)):
            ins = code[p]
            if ins[0] < _N_OPERATIONS:
                _arithmetic_64(ins[0], regs, ins[1], ins[2], ins[3], ins[4], n)
            elif ins[0] == LOAD_EXTERNAL:
                for i in range(n):
                    regs[ins[1], i] = external[ins[2], start + i]
            else:
                _leaf(ins, regs, n, heads, fdata, idata, gdata, cutoffs, rows, local)
        for o in range(len(outputs)):
            for i in range(n):
                values[o, start + i] = regs[outputs[o], i]


@inlined
def _leaf_interval(ins, lows, highs, n, heads, fdata, idata, gdata, cutoffs, rows):
    box = np.empty(6, np.float64)
    least, most = np.empty(4, np.float64), np.empty(4, np.float64)
    for i in range(n):
        for axis in range(3):
            box[axis], box[3 + axis] = lows[ins[2 + axis], i], highs[ins[2 + axis], i]
        if ins[0] == BEAMS:
            for q in range(4):
                least[q], most[q] = lows[ins[5 + q], i], highs[ins[5 + q], i]
            lo, hi = beams_interval(heads[ins[10]], fdata, idata, box, least, most, cutoffs[ins[10]], rows)
        else:
            lo, hi = grid_interval(heads[ins[10]], fdata, gdata, box)
        lows[ins[1], i], highs[ins[1], i] = lo, hi


@parallel_kernel
def _intervals(
    code, n_registers, constants, outputs, lo, hi, ext_lo, ext_hi, heads, fdata, idata, gdata, cutoffs, least, most
):
    for c in prange((len(lo) + _BOXES - 1) // _BOXES):
        start = c * _BOXES
        n = min(_BOXES, len(lo) - start)
        lows, highs = np.empty((n_registers, _BOXES)), np.empty((n_registers, _BOXES))
        rows = np.empty((CAPACITY, ROW), np.float64)
        for r in range(len(constants)):
            # Of a constant that is not a number nothing is known.
            known = constants[r] == constants[r]
            lows[3 + r, :] = constants[r] if known else -math.inf
            highs[3 + r, :] = constants[r] if known else math.inf
        for i in range(n):
            for axis in range(3):
                lows[axis, i], highs[axis, i] = lo[start + i, axis], hi[start + i, axis]
        for p in range(len(code)):
            ins = code[p]
            op = ins[0]
            ol, oh = lows[ins[1]], highs[ins[1]]
            if op < _N_OPERATIONS:
                _arithmetic_interval(op, lows, highs, ins[1], ins[2], ins[3], ins[4], n)
            elif op == LOAD_EXTERNAL:
                for i in range(n):
                    ol[i], oh[i] = ext_lo[ins[2], start + i], ext_hi[ins[2], start + i]
            else:
                _leaf_interval(ins, lows, highs, n, heads, fdata, idata, gdata, cutoffs, rows)
            if op >= _N_OPERATIONS or not _EXACT[op]:
                # Outward rounding; NaN (infinity less infinity) means that nothing is known.
                for i in range(n):
                    ol[i] -= _ROUND_OUT * abs(ol[i])
                    oh[i] += _ROUND_OUT * abs(oh[i])
            for i in range(n):
                if not ol[i] <= oh[i]:
                    ol[i], oh[i] = -math.inf, math.inf
        for o in range(len(outputs)):
            for i in range(n):
                least[o, start + i], most[o, start + i] = lows[outputs[o], i], highs[outputs[o], i]


# --- calling them --------------------------------------------------------------------------------------------------------


class Program:
    """Fields made ready for evaluation: their tapes, lowered and packed when first needed.

    Args:
        fields: what to evaluate.
        cutoffs: for data leaves, the value above which they need not be exact (see `frep/sampling.py`).
        regions: for skeletons, the box of their own space outside of which nothing matters.
    """

    def __init__(
        self,
        fields: tuple[Field, ...],
        cutoffs: dict[Field, float] | None = None,
        regions: dict[Field, np.ndarray] | None = None,
    ) -> None:
        self.fields = fields
        self.cutoffs = cutoffs
        self.regions = regions
        self._tapes: dict[bool, tuple[Tape, PackedLeaves]] = {}

    def tape(self, hoist: bool) -> tuple[Tape, PackedLeaves]:
        if hoist not in self._tapes:
            tape = lower(self.fields, hoist=hoist)
            self._tapes[hoist] = (tape, pack_leaves(tape.leaves, self.cutoffs, self.regions))
        return self._tapes[hoist]

    def at(self, points: np.ndarray) -> np.ndarray:
        """(k, n) float64 values of the k fields at (n, 3) points."""
        tape, data = self.tape(False)
        # Beams are listed for the ball round a batch, so that small batches test fewer of them.
        batch = _DATA_BATCH if tape.leaves else BLOCK
        order = _locality(points, batch) if tape.leaves and len(points) > batch else None
        if order is not None:
            points = points[order]
        external = np.empty((len(tape.externals), len(points)))
        for i, node in enumerate(tape.externals):
            external[i] = node.data.call(_arguments(node, points))
        values = np.empty((len(self.fields), len(points)))
        _points(
            tape.code, tape.n_registers, tape.constants, tape.outputs, _writable(points), batch, external,
            data.heads, data.fdata, data.idata, data.gdata, data.cutoffs, values,
        )  # fmt: skip
        if order is not None:
            unsorted = np.empty_like(values)
            unsorted[:, order] = values
            values = unsorted
        return values

    def bounds(self, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, n) lower and upper bounds of the k fields over n boxes."""
        tape, data = self.tape(False)
        ext_lo = np.empty((len(tape.externals), len(lo)))
        ext_hi = np.empty_like(ext_lo)
        for i, node in enumerate(tape.externals):
            ext_lo[i], ext_hi[i] = _foreign_bounds(node, lo, hi)
        least, most = np.empty((len(self.fields), len(lo))), np.empty((len(self.fields), len(lo)))
        _intervals(
            tape.code, tape.n_registers, tape.constants, tape.outputs, _writable(lo), _writable(hi),
            ext_lo, ext_hi, data.heads, data.fdata, data.idata, data.gdata, data.cutoffs, least, most,
        )  # fmt: skip
        return least, most

    def on_blocks(
        self, blocks: np.ndarray, axes: tuple[np.ndarray, np.ndarray, np.ndarray], out: np.ndarray
    ) -> np.ndarray:
        """Values on grid leaves; returns the lowest of each leaf, (k, n), NaN where one is NaN.

        Args:
            blocks: (n, 3) int32 block coordinates.
            axes: float64 coordinates of the samples along each axis, eight times the blocks of that axis.
            out: (k, n, 512), filled; values are float32 (and copied where `out` is not, or is not contiguous).

        Far from the origin, or at voxels tiny beside the part, float32 coordinates would be too coarse; the samples are then
        evaluated as points, in float64, several times slower.
        """
        if _needs_double(axes):
            for start in range(0, len(blocks), _FAR_BLOCKS):
                part = slice(start, start + _FAR_BLOCKS)
                out[:, part] = self.at(block_points(blocks[part], axes)).reshape(len(self.fields), -1, BLOCK)
            return out.min(axis=2)
        tape, data = self.tape(True)
        tables = [_axis_table(tape.hoisted[axis], axis, axes[axis]) for axis in range(3)]
        constants = tape.constants.astype(np.float32)
        # Foreign leaves get 1024 blocks at once: 12 MB of coordinates.
        step = 1024 if tape.externals else max(len(blocks), 1)
        least = np.empty(out.shape[:2], np.float32)
        for start in range(0, len(blocks), step):
            # One layout and one type: for another numba would compile again.
            part = _writable(np.asarray(blocks[start : start + step], np.int32))
            room, lowest = out[:, start : start + step], np.empty((len(out), len(part)), np.float32)
            fits = room.dtype == np.float32 and room.flags.c_contiguous
            values = room if fits else np.empty(room.shape, np.float32)
            external = np.empty((len(tape.externals), len(part), BLOCK), np.float32)
            if tape.externals:
                points = block_points(part, axes)
                for i, node in enumerate(tape.externals):
                    external[i] = node.data.call(_arguments(node, points)).reshape(len(part), BLOCK)
            _blocks(
                tape.code, tape.n_registers, constants, tape.outputs, *tables, part, external,
                data.heads, data.fdata, data.idata, data.gdata, data.cutoffs, values, lowest,
            )  # fmt: skip
            least[:, start : start + step] = lowest
            if not fits:
                room[:] = values
        return least


def _writable(array: np.ndarray) -> np.ndarray:
    """A contiguous array that may be written to: of one that may not numba would make another type, and compile again."""
    array = np.ascontiguousarray(array)
    return array if array.flags.writeable else array.copy()


@lru_cache(maxsize=256)
def program(*fields: Field) -> Program:
    """The program of exact Fields, kept: asking one Field many times lowers it once."""
    return Program(fields)


def values_at(fields: tuple[Field, ...], points: np.ndarray) -> np.ndarray:
    """(k, n) values of k Fields at (n, 3) points."""
    return program(*fields).at(points)


def bounds_over(field: Field, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) lower and upper bounds of a Field over n boxes."""
    least, most = program(field).bounds(lo, hi)
    return least[0], most[0]


def block_points(blocks: np.ndarray, axes: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """(n * 512, 3) positions of the samples of n blocks."""
    steps = np.arange(8)
    xyz = [axes[a][8 * blocks[:, a : a + 1] + steps] for a in range(3)]
    points = np.empty((len(blocks), 8, 8, 8, 3))
    points[..., 0] = xyz[0][:, :, None, None]
    points[..., 1] = xyz[1][:, None, :, None]
    points[..., 2] = xyz[2][:, None, None, :]
    return points.reshape(-1, 3)


def _needs_double(axes) -> bool:
    """Whether float32 coordinates would be coarser than 1/500 of a voxel."""
    far = max(float(np.max(np.abs(a))) for a in axes)
    voxel = min(float(a[1] - a[0]) for a in axes)
    return far > 2**15 * voxel


def _axis_table(fields: tuple[Field, ...], axis: int, coordinates: np.ndarray) -> np.ndarray:
    if not fields:
        return np.zeros((1, 1), np.float32)
    points = np.zeros((len(coordinates), 3))
    points[:, axis] = coordinates
    with np.errstate(over="ignore"):
        return values_at(fields, points).astype(np.float32)


def _locality(points: np.ndarray, batch: int) -> np.ndarray | None:
    """An order in which neighbouring points share batches; None where they already do."""
    lo, hi = points.min(axis=0), points.max(axis=0)
    if not np.all(np.isfinite(hi - lo)):
        return None
    batches = len(points) / batch
    sample = points[: batch * (len(points) // batch)].reshape(-1, batch, 3)[:: max(1, int(batches) // 64)]
    spread = np.median(np.ptp(sample, axis=1), axis=0)
    if np.all(spread <= 3.0 * (hi - lo) / max(1.0, batches ** (1 / 3))):
        return None
    side = max(1, int(batches ** (1 / 3)) * 2)
    cell = np.minimum((points - lo) / np.where(hi > lo, hi - lo, 1.0) * side, side - 1).astype(np.int64)
    return np.argsort((cell[:, 0] * side + cell[:, 1]) * side + cell[:, 2], kind="stable")


def _arguments(node: Field, points: np.ndarray) -> np.ndarray:
    """The positions at which a foreign leaf is asked, when space is sampled at `points`."""
    if all(a.op == "coordinate" and a.data == axis for axis, a in enumerate(node.args)):
        return points
    return np.ascontiguousarray(values_at(node.args, points).T)


def _foreign_bounds(node: Field, lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if node.data.lipschitz is None:
        return np.full(len(lo), -np.inf), np.full(len(lo), np.inf)
    least, most = program(*node.args).bounds(lo, hi)
    half = 0.5 * np.linalg.norm(most - least, axis=0)
    known = np.isfinite(half)
    centre = np.where(known, 0.5 * (least + most), 0.0)
    value = node.data.call(np.ascontiguousarray(centre.T))
    reach = np.where(known, node.data.lipschitz * np.where(known, half, 0.0), np.inf)
    return value - reach, value + reach


def require_finite(values: np.ndarray, points: np.ndarray, what: str) -> None:
    """Raise FunctionError where values are NaN, naming the first point."""
    bad = np.flatnonzero(np.isnan(values))
    if len(bad):
        where = ", ".join(f"{v:.6g}" for v in points[bad[0]])
        error = FunctionError(f"{what} is not a number (NaN) at ({where}) and {len(bad) - 1} more points")
        error.point = (float(points[bad[0], 0]), float(points[bad[0], 1]), float(points[bad[0], 2]))
        raise error
