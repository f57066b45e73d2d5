"""Sampling: a bounded field becomes a sparse grid of the leaf blocks that can hold surface.

The block tree is descended level by level, 64 children a box. Interval evaluation bounds the field over each box, with the
ball-interference query bounding its skeletons; a box that cannot hold surface becomes an inside or outside tile, and what is
left at the last level is evaluated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .errors import ArgumentError, EmptyError, TooLargeError
from .evaluate import BLOCK, Program, block_points, require_finite
from .field import Field, coordinates, topological
from .grid import INSIDE, LEAF, OUTSIDE, SparseGrid
from .progress import progress

_LEAF_MARK = -3
_BATCH = 32768
"""Leaves evaluated between two updates of the progress bar: 17 million samples."""

_ROUNDING = 1.02
"""Room for float32 in the distance within which a leaf of data stays exact."""

SAMPLE_BYTES = 2600
"""Memory a leaf takes while it is sampled."""

MESH_BYTES = 16000
"""Memory a leaf takes in addition while it is meshed: some 250 vertices and 500 triangles where it is full of surface."""


@dataclass(frozen=True)
class Lattice:
    """Where samples lie: an axis-aligned grid round a box, its faces midway between samples.

    The box is centred on the grid so that each of its faces lies at least a quarter voxel from the nearest samples: a flat
    face on the box is met by linear interpolation exactly, and no sample hits it.
    """

    origin: np.ndarray
    voxel: float
    blocks: tuple[int, int, int]

    @classmethod
    def over(cls, lo: np.ndarray, hi: np.ndarray, voxel: float) -> Lattice:
        n = np.maximum(np.round((hi - lo) / voxel), 1.0) + 1.0
        origin = 0.5 * (lo + hi) - 0.5 * n * voxel
        return cls(origin, voxel, tuple(int(b) for b in np.ceil((n + 1.0) / LEAF)))  # type: ignore[arg-type]

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates of the samples along each axis."""
        return tuple(self.origin[a] + self.voxel * np.arange(LEAF * self.blocks[a]) for a in range(3))  # type: ignore


def sample(
    field: Field, bounds: np.ndarray, voxel: float, *, band: float = 0.0, exact: float = 1.0, extra_bytes: int = 0
) -> SparseGrid:
    """Sample a field that is positive outside `bounds`.

    Args:
        field: negative inside.
        bounds: (2, 3) finite box that holds the solid.
        voxel: distance of the samples, mm.
        band: also keep leaves whose samples come within this many voxels of the surface (for level-set files).
        exact: values are right within this many voxels of a crossing; farther off, data leaves only promise to be larger.
            One is what the interpolation of crossings needs.
        extra_bytes: memory a leaf will need afterwards, for the estimate.

    Raises:
        TooLargeError: the estimate exceeds the free memory; it names the estimate and a voxel size that fits.
        EmptyError: no sample is inside.
        FunctionError: a user function raised, or the field is NaN somewhere.
    """
    if not (math.isfinite(voxel) and voxel > 0):
        raise ArgumentError(f"voxel: expected a finite size > 0 in mm, got {voxel!r}")
    lo, hi = np.asarray(bounds, float)
    with progress("culling", total=1) as advance:
        _require_memory_for_table(field, lo, hi, voxel, extra_bytes)
        lattice = Lattice.over(lo, hi, voxel)
        limits = cutoffs(field, lo - voxel, hi + voxel, _ROUNDING * max(exact, band + 1.0 if band else 0.0) * voxel)
        program = Program((field,), limits, regions(limits, lo - voxel, hi + voxel))
        table = _classify(program, lattice, band * voxel)
        leaves = np.argwhere(table == _LEAF_MARK).astype(np.int32)
        advance(1)
    _require_memory(len(leaves), voxel, extra_bytes)
    table[tuple(leaves.T)] = np.arange(len(leaves), dtype=np.int32)
    values = np.empty((1, len(leaves), BLOCK), np.float32)
    least = np.empty(len(leaves), np.float32)
    axes = lattice.axes()
    with progress("sampling", total=len(leaves)) as advance:
        for start in range(0, len(leaves), _BATCH):
            part = leaves[start : start + _BATCH]
            least[start : start + _BATCH] = program.on_blocks(part, axes, values[:, start : start + _BATCH])[0]
            advance(len(part))
    lowest = least.min(initial=np.inf)
    if math.isnan(lowest):
        bad = np.flatnonzero(np.isnan(least))[:1]
        require_finite(values[0, bad[0]], block_points(leaves[bad], axes), "the field")
    if not lowest < 0 and not np.any(table == INSIDE):
        raise EmptyError("the solid is empty: no sample is inside")
    return SparseGrid(
        origin=lattice.origin,
        voxel=float(voxel),
        table=table,
        leaves=leaves,
        values=values.reshape(-1, LEAF, LEAF, LEAF),
        background=3.0 * float(voxel),
    )


def _classify(program: Program, lattice: Lattice, band: float = 0.0) -> np.ndarray:
    """The table of blocks: OUTSIDE, INSIDE, or _LEAF_MARK where the field may vanish within a voxel of the samples."""
    shape = np.array(lattice.blocks)
    table = np.full(lattice.blocks, OUTSIDE, np.int32)
    size = 4 ** max(0, math.ceil(math.log(max(float(np.prod(shape)), 1.0) / 64.0, 64)))
    boxes = np.argwhere(np.ones(np.ceil(shape / size).astype(int), bool))
    while True:
        if size == 1 and _mostly_mixed(program, lattice, boxes, band):
            # Bounding each of them would cost more than the few that it would spare.
            table[tuple(boxes.T)] = _LEAF_MARK
            return table
        low, high = _bounds_of(program, lattice, boxes, size)
        inside = boxes[high < -band]
        mixed = boxes[(low <= band) & (high >= -band)]
        _fill(table, inside, size, INSIDE)
        if size == 1:
            table[tuple(mixed.T)] = _LEAF_MARK
            return table
        size //= 4
        boxes = (mixed[:, None, :] * 4 + _CHILDREN).reshape(-1, 3)
        boxes = boxes[(boxes * size < shape).all(axis=1)]


def _mostly_mixed(program: Program, lattice: Lattice, boxes: np.ndarray, band: float) -> bool:
    if len(boxes) < 8 * _ASKED:
        return False
    low, high = _bounds_of(program, lattice, boxes[:: len(boxes) // _ASKED], 1)
    return float(np.mean((low <= band) & (high >= -band))) >= _MOSTLY


_ASKED = 512
"""Boxes of the last level that are asked before the others."""

_MOSTLY = 0.97
"""Share of them that must be mixed to take all for leaves."""

_CHILDREN = np.argwhere(np.ones((4, 4, 4), bool))


def _bounds_of(program: Program, lattice: Lattice, boxes: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Bounds over boxes of `size` blocks, each grown by one sample all round."""
    step = LEAF * size
    lo = lattice.origin + lattice.voxel * (boxes * step - 1)
    hi = lattice.origin + lattice.voxel * (boxes + 1) * step
    least, most = program.bounds(lo, hi)
    return least[0], most[0]


def _fill(table: np.ndarray, boxes: np.ndarray, size: int, value: int) -> None:
    if size == 1:
        table[tuple(boxes.T)] = value
        return
    for i, j, k in boxes * size:
        table[i : i + size, j : j + size, k : k + size] = value


# --- what must be exact ------------------------------------------------------------------------------------------------


def cutoffs(field: Field, lo: np.ndarray, hi: np.ndarray, margin: float) -> dict[Field, float]:
    """For each data leaf, the value above which it need not be exact in order to find `field == 0` in a box.

    The range of values at which the result can cross zero is carried from the result to the leaves: through a minimum it
    passes unchanged, through a sum it shifts by the other argument's bounds, elsewhere it becomes everything. `margin` (mm) is
    added at the leaves, for the samples beside a crossing; where coordinates are stretched on their way to a leaf, more of it.
    """
    order = topological([field])
    leaves = [n for n in order if n.op in ("beams", "grid")]
    if not leaves:
        return {}
    least, most = Program(tuple(order)).bounds(lo[None], hi[None])
    span = {n: (least[i, 0], most[i, 0]) for i, n in enumerate(order)}
    wanted: dict[Field, tuple[float, float]] = {field: (0.0, 0.0)}
    for node in reversed(order):
        if node in wanted:
            for argument, (a, b) in zip(node.args, _crossing(node, *wanted[node], span), strict=True):
                a, b = (-math.inf if math.isnan(a) else a), (math.inf if math.isnan(b) else b)
                had = wanted.get(argument, (math.inf, -math.inf))
                wanted[argument] = (min(had[0], a), max(had[1], b))
    return {n: wanted[n][1] + margin * _stretch(n, lo, hi) for n in leaves if n in wanted}


def regions(limits: dict[Field, float], lo: np.ndarray, hi: np.ndarray) -> dict[Field, np.ndarray]:
    """For each skeleton with a finite cutoff, the box (2, 3) of its own space in which its beams can matter to the box lo, hi.

    A steady lattice asked for a window then descends the window's indices only, however many clusters there are beyond.
    """
    leaves = [n for n, cutoff in limits.items() if n.op == "beams" and math.isfinite(cutoff)]
    if not leaves:
        return {}
    least, most = Program(tuple(a for n in leaves for a in n.args)).bounds(lo[None], hi[None])
    least, most = least.reshape(len(leaves), -1), most.reshape(len(leaves), -1)
    found = {}
    for n, low, high in zip(leaves, least, most, strict=True):
        width, _, ball, blend = np.maximum(high[3:], 0.0)
        reach = max(limits[n], blend) + max(width, ball)
        box = np.array([low[:3] - reach, high[:3] + reach])
        if np.all(np.isfinite(box)):
            found[n] = box
    return found


def _stretch(leaf: Field, lo: np.ndarray, hi: np.ndarray) -> float:
    """A bound on how much a leaf's value can change in one mm: what its coordinates are stretched by, and its widths' slopes."""
    where = leaf.args[:3]
    stretch = 1.0 if where == coordinates() else _slope(where, lo, hi)
    # A slope of one is as steep as widths get; that of a foreign function or of data cannot be bounded.
    return stretch + sum(min(_slope((w,), lo, hi), 1.0) for w in leaf.args[3:] if w.axes)


def _slope(fields: tuple[Field, ...], lo: np.ndarray, hi: np.ndarray) -> float:
    """A bound on the norm of the Jacobian of some Fields over a box."""
    slopes = tuple(d for f in fields for d in f.derivatives())
    least, most = Program(slopes).bounds(lo[None], hi[None])
    with np.errstate(invalid="ignore", over="ignore"):
        norm = float(np.sqrt(np.sum(np.maximum(np.abs(least), np.abs(most)) ** 2)))
    return norm if math.isfinite(norm) else math.inf


_ALL = (-math.inf, math.inf)


def _crossing(node: Field, lo: float, hi: float, span: dict[Field, tuple[float, float]]) -> list[tuple[float, float]]:
    """Ranges of the arguments that matter when those of the result that matter are [lo, hi]."""
    match node.op, node.args:
        case "add", (a, b):
            return [(lo - span[b][1], hi - span[b][0]), (lo - span[a][1], hi - span[a][0])]
        case "subtract", (a, b):
            return [(lo + span[b][0], hi + span[b][1]), (span[a][0] - hi, span[a][1] - lo)]
        case "negative", _:
            return [(-hi, -lo)]
        case "minimum", (a, b):
            return [(lo, min(hi, span[b][1])), (lo, min(hi, span[a][1]))]
        case "maximum", (a, b):
            return [(max(lo, span[b][0]), hi), (max(lo, span[a][0]), hi)]
        case "absolute", _:
            return [(-max(hi, 0.0), max(hi, 0.0))]
        case "where", _:
            return [_ALL, (lo, hi), (lo, hi)]
        case (("less" | "less_equal"), (a, b)):
            # Beyond the other's bounds the answer is known, by however much.
            return [span[b], span[a]]
        case "multiply", (a, b) if a.is_constant or b.is_constant:
            factor = a.data if a.is_constant else b.data
            ends = sorted((lo / factor, hi / factor)) if factor else _ALL
            return [_ALL if argument.is_constant else (ends[0], ends[1]) for argument in (a, b)]
        case _:
            return [_ALL] * len(node.args)


# --- memory ------------------------------------------------------------------------------------------------------------


def free_bytes() -> int:
    """Memory that could be had now without swapping."""
    try:
        with open("/proc/meminfo") as info:
            for line in info:
                if line.startswith("MemAvailable:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    import psutil

    return int(psutil.virtual_memory().available)


def _refuse(surface: float, table: float, free: int, voxel: float, asked: float) -> TooLargeError:
    """`surface` bytes grow as the surface in voxels, `table` bytes as the volume."""
    fits = voxel * max(math.sqrt(surface / (0.7 * free)), (table / (0.2 * free)) ** (1 / 3))
    return TooLargeError(
        f"voxel: at {asked:g} mm the part needs about {(surface + table) / 1e9:.3g} GB, and {free / 1e9:.3g} GB are free; "
        f"a voxel of {float(f'{1.05 * fits:.2g}'):g} mm would fit"
    )


def _require_memory(n_leaves: int, voxel: float, extra_bytes: int) -> None:
    estimate, free = float(n_leaves) * (SAMPLE_BYTES + extra_bytes), free_bytes()
    if estimate > 0.9 * free:
        raise _refuse(estimate, 0.0, free, voxel, voxel)


_LARGEST_TABLE = 3e7
"""Blocks that are classified without asking first: a table of 120 MB, some 2500 samples along each axis."""

_TABLE_BYTES = 40
"""Memory a block takes while it is classified."""


def _require_memory_for_table(field: Field, lo, hi, voxel: float, extra_bytes: int) -> None:
    """Refuse before classifying when even the table of blocks is large: count the leaves of a coarse one and scale."""
    block = LEAF * voxel
    if float(np.sum(np.log(np.maximum((hi - lo) / block, 1.0)))) <= math.log(_LARGEST_TABLE):
        return
    coarse = max(float(np.prod((hi - lo) / LEAF)) / 2e4, 1e-300) ** (1 / 3)
    table = _classify(Program((field,)), Lattice.over(lo, hi, coarse))
    ratio = min(coarse / voxel, 1e60)
    surface = float(np.count_nonzero(table == _LEAF_MARK)) * ratio**2 * (SAMPLE_BYTES + extra_bytes)
    blocks, free = _TABLE_BYTES * float(table.size) * ratio**3, free_bytes()
    if surface + blocks > 0.9 * free:
        raise _refuse(surface, blocks, free, max(voxel, coarse / 1e60), voxel)
