"""Derivatives of Fields, as Fields: forward mode over the operation table's `partials` rules.

Leaves with data have no symbolic derivative; they are differenced centrally in their own arguments, and the chain rule
carries the rest, so that a skeleton seen through a coordinate map needs no rule of its own.
"""

from __future__ import annotations

from .field import Field, _lift, _make, constant, topological
from .ops import OPERATIONS

LEAF_STEP = 1e-5
"""Step of the central difference in a leaf's arguments, mm: far below any voxel, far above float64 rounding."""


def derivatives(field: Field) -> tuple[Field, Field, Field]:
    """The partial derivatives of `field` with respect to x, y and z."""
    zero, one = constant(0.0), constant(1.0)
    done: dict[Field, tuple[Field, Field, Field]] = {}
    for node in topological([field]):
        if not node.axes:
            done[node] = (zero, zero, zero)
        elif node.op == "coordinate":
            done[node] = tuple(one if axis == node.data else zero for axis in range(3))  # type: ignore[assignment]
        else:
            factors = _partials(node, done)
            done[node] = tuple(  # type: ignore[assignment]
                _sum(_make("multiply", (p, done[a][axis])) for p, a in zip(factors, node.args, strict=True))
                for axis in range(3)
            )
    return done[field]


def _partials(node: Field, done: dict[Field, tuple[Field, Field, Field]]) -> list[Field]:
    row = OPERATIONS.get(node.op)
    if row is not None:
        return [_lift(p) for p in row.partials(node, *node.args)]
    return [
        _leaf_partial(node, i) if done[a] != (constant(0.0),) * 3 else constant(0.0) for i, a in enumerate(node.args)
    ]


def _leaf_partial(node: Field, i: int) -> Field:
    up, down = list(node.args), list(node.args)
    up[i] = node.args[i] + LEAF_STEP
    down[i] = node.args[i] - LEAF_STEP
    return (Field(node.op, tuple(up), node.data) - Field(node.op, tuple(down), node.data)) * (0.5 / LEAF_STEP)


def _sum(terms) -> Field:
    total = constant(0.0)
    for term in terms:
        total = total + term
    return total
