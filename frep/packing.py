"""Data leaves packed into flat arrays, the only form in which compiled code sees them."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field

import numpy as np

from .biq_kernels import HEAD
from .field import Field


def digest(kind: bytes, *arrays: np.ndarray) -> bytes:
    """A key of arrays: equal where they are."""
    h = hashlib.blake2b(kind, digest_size=16)
    for a in arrays:
        h.update(str(a.shape).encode())
        h.update(np.ascontiguousarray(a).tobytes())
    return h.digest()


@dataclass
class Packer:
    """Collects the arrays of several leaves; `floats`, `ints` and `grid` return where a piece begins."""

    _pieces: dict[str, list[np.ndarray]] = field(default_factory=lambda: {"f": [], "i": [], "g": []})
    _sizes: dict[str, int] = field(default_factory=lambda: {"f": 0, "i": 0, "g": 0})

    def _add(self, kind: str, array, dtype) -> int:
        piece = np.ascontiguousarray(array, dtype=dtype).reshape(-1)
        start = self._sizes[kind]
        self._pieces[kind].append(piece)
        self._sizes[kind] += len(piece)
        return start

    def floats(self, array) -> int:
        return self._add("f", array, np.float64)

    def ints(self, array) -> int:
        return self._add("i", array, np.int32)

    def grid(self, array) -> int:
        return self._add("g", array, np.float32)

    def joined(self, kind: str, dtype) -> np.ndarray:
        pieces = self._pieces[kind]
        if len(pieces) == 1:
            return pieces[0]
        return np.concatenate(pieces) if pieces else np.zeros(1, dtype)


@dataclass(frozen=True, eq=False)
class PackedLeaves:
    """`heads` (n, HEAD) int64 describe each leaf; the arrays hold all their numbers; `cutoffs` (n,) is the value above
    which each leaf need not be exact."""

    heads: np.ndarray
    fdata: np.ndarray
    idata: np.ndarray
    gdata: np.ndarray
    cutoffs: np.ndarray


def pack_leaves(
    leaves: tuple[Field, ...], cutoffs: dict[Field, float] | None = None, regions: dict[Field, np.ndarray] | None = None
) -> PackedLeaves:
    """Pack the data of leaf nodes. Each leaf's data object has `pack(packer) -> list[int]`, its head; those given a region
    `pack(packer, box)`.

    Args:
        leaves: the nodes.
        cutoffs: the value above which each need not be exact.
        regions: a box (2, 3) of each leaf's own space, outside of which nothing of it matters.
    """
    packer = Packer()
    heads = np.zeros((max(len(leaves), 1), HEAD), dtype=np.int64)
    starts: dict[tuple[int, bytes | None], list[int]] = {}
    for i, node in enumerate(leaves):
        box = None if regions is None else regions.get(node)
        key = (id(node.data), None if box is None else box.tobytes())
        if key not in starts:
            starts[key] = node.data.pack(packer) if box is None else node.data.pack(packer, box)
        head = starts[key]
        heads[i, : len(head)] = head
    limits = [math.inf if cutoffs is None else cutoffs.get(node, math.inf) for node in leaves]
    return PackedLeaves(
        heads,
        packer.joined("f", np.float64),
        packer.joined("i", np.int32),
        packer.joined("g", np.float32),
        np.array(limits, dtype=np.float64),
    )
