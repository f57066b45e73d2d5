"""Polishing: vertices onto the surface, then facets fitted to it.

Marching cubes interpolates linearly, so where a strut is three voxels thick its vertices lie well inside the surface. Newton
steps bring them onto `field == 0`. Facets between vertices that lie on a curved surface are chords, which still lose volume
(4 % at three voxels a diameter); so each vertex is then moved out, along its normal, by the mean sag of the facets round it,
after which the facets straddle the surface. Vertices of exactly flat facets stay, and so do the caps on the part's box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .evaluate import Program
from .field import Field, topological
from .progress import progress
from .sampling import cutoffs, regions

if TYPE_CHECKING:
    from .solid import Solid

_STEPS = 4
_BATCH = 1 << 17

_SETTLED = 0.02
"""A vertex that moved by less than this, in voxels, is on the surface to a few ten thousandths of one."""

_FLAT = 1e-5
"""A facet whose centre keeps this near to the surface, in voxels, is flat."""

_MEAN_OF_SAG = 0.75
"""Mean deviation of a chord triangle from a quadratic surface, of the deviation at its centre."""


def surface_distance(solid: Solid, points: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray]:
    """First-order signed distance to the surface, (n,) mm, and the unit normal (n, 3), at points within a voxel or two of it."""
    value, normal, slope = _first_order(_gradient_program(solid, voxel), points)
    return value / slope, normal


def polished(solid: Solid, vertices: np.ndarray, faces: np.ndarray, voxel: float) -> np.ndarray:
    """The vertices moved as the module describes: (n, 3)."""
    program = _gradient_program(solid, voxel)
    moved = np.empty_like(vertices)
    normals = np.empty(vertices.shape, np.float32)
    slope = np.empty(len(vertices))
    with progress("polishing", total=len(vertices) + len(faces) / 4) as advance:
        for start in range(0, len(vertices), _BATCH):
            part = slice(start, start + _BATCH)
            moved[part], normals[part], slope[part] = _onto_surface(program, vertices[part], voxel)
            advance(len(moved[part]))
        value = Program(program.fields[:1], program.cutoffs, program.regions)
        lift = _lift(value, moved, slope, faces, voxel, advance)
    moved += lift[:, None] * normals
    return np.clip(moved, solid.bounds[0], solid.bounds[1])


def _onto_surface(program: Program, start: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points brought onto the surface by Newton steps, the unit normals, and the slope of the field there."""
    points, normals, slopes = start.copy(), np.zeros_like(start), np.ones(len(start))
    moving = np.arange(len(points))
    for _ in range(_STEPS):
        value, normal, slope = _first_order(program, points[moving])
        distance = value / slope
        # A step of more than half a voxel has left the neighbourhood in which the slope holds.
        points[moving] -= np.clip(distance, -0.5 * voxel, 0.5 * voxel)[:, None] * normal
        normals[moving], slopes[moving] = normal, slope
        # After a step the error is of the square of its length over the radius of curvature.
        moving = moving[np.abs(distance) > _SETTLED * voxel]
        if not len(moving):
            break
    if len(moving):
        # Where Newton does not settle (a sharp corner that no voxel resolves), keep the interpolated vertex.
        value, _, slope = _first_order(program, points[moving])
        lost = moving[~(np.abs(value / slope) < 0.25 * voxel)]
        points[lost] = start[lost]
    return points, normals, slopes


def _lift(
    program: Program, vertices: np.ndarray, slope: np.ndarray, faces: np.ndarray, voxel: float, advance
) -> np.ndarray:
    """How far each vertex goes out, mm. `slope` of the field at the vertices turns values at the facets into distances."""
    total = np.zeros(len(vertices))
    weight = np.zeros(len(vertices))
    flat = np.zeros(len(vertices), bool)
    for start in range(0, len(faces), _BATCH):
        part = faces[start : start + _BATCH]
        a, b, c = (vertices[part[:, i]] for i in range(3))
        sag = program.at((a + b + c) / 3.0)[0] / slope[part].mean(axis=1)
        cross = np.cross(b - a, c - a)
        area = 0.5 * np.sqrt(np.einsum("ij,ij->i", cross, cross))
        sag = np.clip(sag, -0.5 * voxel, 0.5 * voxel)
        lo, hi = int(part.min()), int(part.max()) + 1
        corner = part.reshape(-1) - lo
        total[lo:hi] += np.bincount(corner, np.repeat(sag * area, 3), hi - lo)
        weight[lo:hi] += np.bincount(corner, np.repeat(area, 3), hi - lo)
        flat[part[np.abs(sag) < _FLAT * voxel].reshape(-1)] = True
        advance(len(part) / 4)
    lift = -_MEAN_OF_SAG * total / np.maximum(weight, 1e-300)
    lift[flat] = 0.0
    return lift


def _gradient_program(solid: Solid, voxel: float) -> Program:
    """Value and gradient of the field, exact within four voxels of the surface."""
    field = solid.field
    outputs = (field, *field.derivatives())
    margin = 4.0 * voxel
    near = cutoffs(field, solid.bounds[0] - voxel, solid.bounds[1] + voxel, margin)
    # The gradient differences the same data at shifted places: the same limits hold there.
    by_data = {}
    for node, limit in near.items():
        by_data[id(node.data)] = max(limit, by_data.get(id(node.data), limit))
    limits: dict[Field, float] = {
        n: by_data[id(n.data)] for n in topological(outputs) if n.data is not None and id(n.data) in by_data
    }
    return Program(outputs, limits, regions(limits, solid.bounds[0] - margin, solid.bounds[1] + margin))


def _first_order(program: Program, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value, unit gradient, and length of the gradient (1 where it vanishes)."""
    value, *parts = program.at(points)
    gradient = np.stack(parts, axis=1)
    length = np.sqrt(np.einsum("ij,ij->i", gradient, gradient))
    length = np.where(length > 1e-12, length, 1.0)
    return value, gradient / length[:, None], length
