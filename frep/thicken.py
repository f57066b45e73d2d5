"""Beams get their body: a skeleton composed with diameters, sections, node balls and blends (`F = P o T`)."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arguments import refuse_nan, suggestion
from .arguments import width as width_of
from .errors import ArgumentError, ArgumentTypeError
from .field import Field, FieldLike, as_field, constant
from .functions import maximum
from .skeleton import Skeleton, beam_field
from .solid import BeamDesign, Feature, Solid, grown


@dataclass(frozen=True, eq=False)
class Rectangle:
    """A square section with rounded corners; `fillet` is their radius in mm."""

    fillet: Field


def thickened(
    skeleton: Skeleton, diameter: Any, *, node: Any, section: str | Rectangle, blend: FieldLike, label: str
) -> Solid:
    """The solid of `BeamTopology.thicken`, whose documentation describes the arguments."""
    square = section if isinstance(section, Rectangle) else Rectangle(constant(0.0)) if section == "square" else None
    if square is None and section != "circle":
        hint = suggestion(section, ("circle", "square"))
        raise ArgumentError(f'section: expected "circle", "square" or a rounded square, got {section!r}{hint}')
    blend_field = as_field(blend, "blend")
    if blend_field.is_constant and blend_field.data < 0.0:
        raise ArgumentError(f"blend: expected a radius >= 0 mm, got {blend_field.data:g}")
    # Where these vary, less than nothing counts as nothing.
    blend_field = blend_field if blend_field.is_constant else maximum(blend_field, 0.0)
    blended = not (blend_field.is_constant and blend_field.data == 0.0)
    ball_radii = None
    if _is_per_node(node):
        ball_radii = 0.5 * _per_node(node, skeleton, "node", least=0.0)
        diameter = _as_per_node(diameter, skeleton)
    node_width = None if node is None or ball_radii is not None else width_of(node, "node")
    if node_width is not None and not node_width.is_constant:
        node_width = maximum(node_width, 0.0)
    features: list[Feature] = []
    end_radii = None
    if _is_per_node(diameter):
        if square is not None:
            raise ArgumentError("diameter: one number a node is for circular sections; give a Field for square ones")
        end_radii = 0.5 * _per_node(diameter, skeleton, "diameter")
        used = end_radii[skeleton.edges] if len(skeleton.edges) else end_radii
        features.append(Feature("beam", constant(2.0 * skeleton.scales[0] * float(used.min())), "diameter"))
        width = None
        field = beam_field(
            skeleton,
            section="cone",
            node_radii=end_radii,
            node_radius=None if node_width is None else 0.5 * node_width,
            ball_radii=ball_radii,
            blend=blend_field if blended else None,
        )
    else:
        width = width_of(diameter, "diameter")
        features.append(Feature("beam", width, "diameter"))
        field = beam_field(
            skeleton,
            section="circle" if square is None else "square",
            width=0.5 * width if square is None else width,
            fillet=None if square is None else maximum(square.fillet, 0.0),
            node_radius=None if node_width is None else 0.5 * node_width,
            blend=blend_field if blended else None,
        )
    design = BeamDesign(
        skeleton=skeleton,
        diameter=width,
        end_radii=end_radii,
        node_diameter=node_width,
        ball_radii=ball_radii,
        section="circle" if square is None else "square",
        blended=blended,
    )
    bounds = skeleton.bounds
    if np.all(np.isfinite(bounds)):
        widest = end_radii if ball_radii is None or end_radii is None else np.maximum(end_radii, ball_radii)
        bounds = _bounds(skeleton, width, widest, node_width, blend_field, square is not None)
    return Solid._make(field, bounds, features=tuple(features), label=label, beams=design)


def _is_per_node(diameter: Any) -> bool:
    return isinstance(diameter, list | tuple) or (isinstance(diameter, np.ndarray) and diameter.ndim > 0)


def _as_per_node(diameter: Any, skeleton: Skeleton) -> Any:
    """A diameter beside balls of their own: one number a node too."""
    if _is_per_node(diameter):
        return diameter
    width = width_of(diameter, "diameter")
    if not width.is_constant:
        raise ArgumentError(
            "node: one number a node goes with numbers for the diameter; give a Field for both, or numbers for both"
        )
    return np.full(len(skeleton.nodes), width.data)


def _per_node(values: Any, skeleton: Skeleton, name: str, least: float | None = None) -> np.ndarray:
    """One diameter a node: positive, or from `least` on."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{name}: expected a number for each node, got {reprlib.repr(values)}") from None
    if array.shape != (len(skeleton.nodes),):
        got = str(len(array)) if array.ndim == 1 else f"shape {array.shape}"
        raise ArgumentError(f"{name}: expected one number for each of {len(skeleton.nodes)} nodes, got {got}")
    refuse_nan(array, name, "node")
    bad = np.flatnonzero(array <= 0.0 if least is None else array < least)
    if len(bad):
        wanted = "> 0" if least is None else f">= {least:g}"
        raise ArgumentError(
            f"{name}: expected diameters {wanted} mm, {len(bad):,} of {len(array):,} nodes have less, "
            f"the first is node {bad[0]}: {array[bad[0]]:g}"
        )
    return array


def _bounds(
    skeleton: Skeleton,
    width: Field | None,
    end_radii: np.ndarray | None,
    node_width: Field | None,
    blend: Field,
    is_square: bool,
) -> np.ndarray:
    """The box of a finite lattice with its widths."""
    axes = skeleton.bounds
    if end_radii is not None:
        outline = axes + skeleton.scales[1] * float(end_radii.max()) * np.array([[-1.0], [1.0]])
    else:
        outline = grown(
            axes, constant(0.0) if width is None else width, math.sqrt(0.5) if is_square else 0.5, "diameter"
        )
    if node_width is not None:
        balls = grown(axes, node_width, 0.5, "node")
        outline = np.array([np.minimum(outline[0], balls[0]), np.maximum(outline[1], balls[1])])
    # A fillet of radius k bulges by less than k beyond the beams that it joins.
    return grown(outline, blend, 1.0, "blend")
