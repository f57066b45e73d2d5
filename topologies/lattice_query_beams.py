"""The calls of LatticeQuery for beams; `topologies.lattice_query` says what they have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import frep
from frep import ArgumentError, Solid
from frep.arguments import positive, real, sizes, vector
from frep.functions import minimum_of
from frep.skeleton import GraphSkeleton, Skeleton
from frep.solid import Feature
from frep.thicken import thickened

from . import beams
from .beam_topology import BeamTopology
from .lattice_query_laws import Law, Sample, checked_range, checked_truncations, euler, one_of, placed, whole_counts

# --- beams ---------------------------------------------------------------------------------------------------------------


_BCC = {"bcc": beams.bcc, "bccz": beams.bccz, "sbcc": beams.bcc, "sbccz": beams.bccz}
_FCC = {"fcc": beams.fcc, "fccz": beams.fccz, "sfcc": beams.s_fcc, "sfccz": beams.s_fccz}
_FBCC = {"fbcc": beams.fbcc, "sfbcc": beams.s_fbcc, "sfbccz": beams.s_fbccz}


def _chosen(value: Any, name: str, known: dict[str, Callable[[Any], BeamTopology]]) -> Callable[[Any], BeamTopology]:
    return known[one_of(value, name, known)]


def _graded(skeleton: Skeleton, strut: Law, node: Law, sample: Sample, label: str, section: str = "circle") -> Solid:
    """A graph thickened by the laws of its struts and nodes."""
    one_of(sample, "sample", ("cell", "point"))

    def thick(graph: Skeleton, diameter: Any, ball: Any = None) -> Solid:
        return thickened(graph, diameter, node=ball, section=section, blend=0.0, label=label)

    balls = node.high > 0.0
    if sample == "point" or section != "circle":
        # A square strut has no diameter of its own: it takes that of the layer it is in, point by point.
        return thick(skeleton, strut.field(sample), node.field(sample) if balls else None)
    nodes, edges = skeleton.nodes, skeleton.edges
    widths, ball_widths = strut.at(nodes[edges].mean(axis=1)), node.at(nodes)
    if np.ptp(widths) == 0.0 and np.ptp(ball_widths) == 0.0:
        return thick(skeleton, float(widths[0]), float(ball_widths[0]) if balls else None)
    # A node for every width that starts from it, so that each beam keeps its own from end to end.
    kinds, kind = np.unique(widths, return_inverse=True)
    used, number = np.unique(edges * len(kinds) + kind.reshape(-1, 1), return_inverse=True)
    places, diameters, ends = nodes[used // len(kinds)], kinds[used % len(kinds)], number.reshape(-1, 2)
    return thick(GraphSkeleton(places, ends), diameters, ball_widths[used // len(kinds)] if balls else None)


def _laws(
    struts: tuple[Any, Any], balls: tuple[Any, Any], rule: str, n: int, pitch: float, axis: int
) -> tuple[Law, Law]:
    strut = Law(rule, *checked_range(*struts, "strut_diameter"), n, pitch, axis)
    return strut, Law(rule, *checked_range(*balls, "node_diameter", least=0.0), n, pitch, axis)


def _heterogeneous(
    topology: Callable[[Any], BeamTopology],
    unit_cell_size: Any,
    struts: tuple[Any, Any],
    balls: tuple[Any, Any],
    counts: tuple[Any, Any, Any],
    rule: str,
    sample: Sample,
    section: str = "circle",
) -> Solid:
    """What all functions of beams without truncation do."""
    size = sizes(unit_cell_size, "unit_cell_size")
    cells = whole_counts(Nx=counts[0], Ny=counts[1], Nz=counts[2])
    strut, node = _laws(struts, balls, rule, cells[2], float(size[2]), 2)
    one_of(sample, "sample", ("cell", "point"))
    block = topology(size).over((np.zeros(3), size * cells))
    return _graded(block.skeleton, strut, node, sample, block.label, section)


def cubic_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    type: str = "cubic",
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Simple cubic cells. `type`: "cubic". Grading and rules: see the module.

    Raises:
        ArgumentError: an unknown type, rule or sample; sizes and diameters that are not positive; min above max; no cells.
    """
    one_of(type, "type", ("cubic",))
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    return _heterogeneous(beams.simple_cubic, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample)


def bcc_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    topology: str = "bcc",
    rule: str = "linear",
    position: Sequence[float] = (0, 0, 0),
    rotation: Sequence[float] = (0, 0, 0),
    *,
    sample: Sample = "cell",
) -> Solid:
    """Body-centred cubic cells (LF-rep Listing 3).

    Args:
        topology: "bcc" or "bccz" (upright edges too); "sbcc" and "sbccz" are the same, BCC has no horizontal beams.
        position: where the block starts, mm.
        rotation: *degrees* about x, y and z, as `cq.Workplane.transformed` takes them: about z first.

    The rest, and what it raises, as in `cubic_heterogeneous_lattice`.

    Example:
        >>> part = bcc_heterogeneous_lattice(10, 0.8, 5.0, 0.88, 5.5, 4, 4, 20, topology="bcc", rule="parabola")
        >>> (part & frep.box((0, 0, 0), (40, 40, 200))).bounds.tolist()
        [[0.0, 0.0, 0.0], [40.0, 40.0, 200.0]]
    """
    made = _chosen(topology, "topology", _BCC)
    origin, turn = vector(position, "position"), euler(vector(rotation, "rotation"))
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    part = _heterogeneous(made, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample)
    return placed(part, turn, origin)


def fcc_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    type: str = "fcc",
    rule: str = "linear",
    c_section: str = "circle",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Face-centred cubic cells.

    Args:
        type: "fcc", "fccz" (upright edges too), "sfcc" (no horizontal beams) or "sfccz".
        c_section: "circle" or "square"; the diameter is the square's side. Differs from LatticeQuery, which ignores it. A square
            strut changes its side at the boundary of two layers.

    The rest, and what it raises, as in `cubic_heterogeneous_lattice`.
    """
    topology = _chosen(type, "type", _FCC)
    section = one_of(c_section, "c_section", ("circle", "square"))
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    return _heterogeneous(topology, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample, section)


def fbcc_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    type: str = "fbcc",
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """BCC and FCC together.

    Args:
        type: "fbcc", "sfbcc" (no horizontal beams) or "sfbccz" (upright edges too).

    Differs from LatticeQuery, which leaves out the ball in the middle of the cell. The rest, and what it raises, as in
    `cubic_heterogeneous_lattice`.
    """
    topology = _chosen(type, "type", _FBCC)
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    return _heterogeneous(topology, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample)


def diamond_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Diamond cells. Arguments, and what it raises, as in `cubic_heterogeneous_lattice`, without a type."""
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    return _heterogeneous(beams.diamond, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample)


def tco_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    truncation: float = 0.5,
    rule: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Truncated cuboctahedra with equal edges.

    Args:
        truncation: checked, 0 to 1, and without effect, as in LatticeQuery.

    Differs from LatticeQuery, which makes two beams a cell of them. The rest, and what it raises, as in
    `cubic_heterogeneous_lattice`.
    """
    if not 0.0 <= real(truncation, "truncation", "1") <= 1.0:
        raise ArgumentError(f"truncation: expected 0 to 1, got {truncation!r}")
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    return _heterogeneous(beams.truncated_cuboctahedron, unit_cell_size, struts, balls, (Nx, Ny, Nz), rule, sample)


def _truncated(
    topology: Callable[..., BeamTopology],
    unit_cell_size: Any,
    struts: tuple[Any, Any],
    balls: tuple[Any, Any],
    counts: tuple[Any, Any, Any],
    truncations: tuple[float, float],
    rule: str,
    direction: str,
    sample: Sample,
) -> Solid:
    """What the functions with a truncation do: it goes from corner to corner of the cells, along z."""
    size = sizes(unit_cell_size, "unit_cell_size")
    cells = whole_counts(Nx=counts[0], Ny=counts[1], Nz=counts[2])
    axis = "XYZ".index(one_of(direction, "direction", ("X", "Y", "Z")))
    strut, node = _laws(struts, balls, rule, cells[axis], float(size[axis]), axis)
    one_of(sample, "sample", ("cell", "point"))
    low, high = (0.5 * float(size.min()) * t for t in truncations)
    height = cells[2] * float(size[2])
    tau = low + (high - low) * frep.clip(frep.coordinates()[2] / height, 0.0, 1.0)
    block = topology(size, tau=tau, over=(np.zeros(3), size * cells))
    return _graded(block.skeleton, strut, node, sample, block.label)


def rco_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    min_truncation: float | None = None,
    max_truncation: float | str | None = None,
    rule: str = "linear",
    *,
    truncation: float | None = None,
    sample: Sample = "cell",
) -> Solid:
    """Rhombicuboctahedra, truncated by 0 (cubes) to 1 (octahedra), of half the cell (LF-rep 4.4, Fig. 4.8).

    Args:
        min_truncation, max_truncation: the truncation at the bottom and at the top of the block; without the second it is
            the same everywhere, and the rule may stand in its place.
        truncation: in place of both.

    Differs from LatticeQuery, where it steps from layer to layer, so that layers may not touch: it is linear from corner to
    corner of the cells, and neighbours agree on it (lf-rep 6.3).
    The rest, and what it raises, as in `cubic_heterogeneous_lattice`.
    """
    if isinstance(max_truncation, str):
        max_truncation, rule = None, max_truncation
    if (truncation is None) == (min_truncation is None):
        raise ArgumentError("truncation: expected either truncation, or min_truncation and max_truncation")
    low = truncation if truncation is not None else min_truncation
    high = low if max_truncation is None else max_truncation
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    within = checked_truncations(low, high)
    made = beams.rhombicuboctahedron
    return _truncated(made, unit_cell_size, struts, balls, (Nx, Ny, Nz), within, rule, "Z", sample)


def tcubic_heterogeneous_lattice(
    unit_cell_size: Any,
    min_strut_diameter: float,
    max_strut_diameter: float,
    min_node_diameter: float,
    max_node_diameter: float,
    Nx: int,
    Ny: int,
    Nz: int,
    min_truncation: float,
    max_truncation: float | None = None,
    rule: str = "linear",
    direction: str = "X",
    truncation: str = "linear",
    *,
    sample: Sample = "cell",
) -> Solid:
    """Truncated cubes, truncated by 0 (cubes) to 1 (cuboctahedra), of half the cell (LF-rep 4.4, Fig. 4.7).

    Args:
        min_truncation, max_truncation: at the bottom and at the top of the block; without the second, as in older scripts, it
            is the same everywhere.
        direction: "X", "Y" or "Z": along which the diameters change.
        truncation: "linear", along z.

    Differs from LatticeQuery: the truncation is linear from corner to corner of the cells, so that layers meet (lf-rep 6.3);
    node diameters go up to their own max, not to that of the truncation. The rest, and what it raises, as in
    `cubic_heterogeneous_lattice`.
    """
    one_of(truncation, "truncation", ("linear",))
    struts, balls = (min_strut_diameter, max_strut_diameter), (min_node_diameter, max_node_diameter)
    within = checked_truncations(min_truncation, min_truncation if max_truncation is None else max_truncation)
    made = beams.truncated_cube
    return _truncated(made, unit_cell_size, struts, balls, (Nx, Ny, Nz), within, rule, direction, sample)


# --- round a cylinder ------------------------------------------------------------------------------------------------------


def cylinder(
    z_uc: int,
    angle_uc_size: float,
    z_uz_size: float,
    r_uz_size: float,
    min_thickness: float,
    max_thickness: float,
    inner_radius: float,
    outer_radius: float,
) -> tuple[Solid, Solid, Solid]:
    """A lattice round the y axis: rings, radial and axial beams that swell from the inside out (LF-rep 4.5.2, Fig. 4.14).

    Args:
        z_uc: cells along the axis, from y = 0 on.
        angle_uc_size: angle of a cell, *degrees*; it must go into 360.
        z_uz_size, r_uz_size: sizes of a cell along the axis and the radius, mm.
        min_thickness, max_thickness: *radii* of the beams at the inner and the outer ring, mm, as in LatticeQuery.
        inner_radius, outer_radius: mm; a whole number of cells apart.

    Returns:
        the rings (true tori), the radial beams, each as thick as the ring it starts from, the axial beams. `|` unites them.

    Raises:
        ArgumentError: sizes that are not positive; a min above its max; an angle or radii that no cells fill.

    Example:
        >>> arcs, radials, axials = cylinder(8, 15, 100, 100, 10, 40, 350, 950)
        >>> (arcs | radials | axials).bounds.tolist()
        [[-990.0, -40.0, -990.0], [990.0, 840.0, 990.0]]
    """
    (levels,) = whole_counts(z_uc=z_uc)
    height, step = positive(z_uz_size, "z_uz_size"), positive(r_uz_size, "r_uz_size")
    inner, outer = positive(inner_radius, "inner_radius"), positive(outer_radius, "outer_radius")
    thin, thick = checked_range(min_thickness, max_thickness, "thickness")
    sectors = _whole(360.0 / positive(angle_uc_size, "angle_uc_size", " in degrees"), "angle_uc_size", "of 360 degrees")
    cells = _whole((outer - inner) / step, "r_uz_size", f"from {inner:g} to {outer:g} mm")
    rings, widths = np.linspace(inner, outer, cells + 1), np.linspace(thin, thick, cells + 1)
    heights = height * np.arange(levels + 1)
    arcs = _rings(rings, widths, height, levels)

    angles = 2.0 * np.pi * np.arange(sectors) / sectors
    out = np.stack([np.sin(angles), np.zeros(sectors), np.cos(angles)], 1)
    up = np.array([0.0, 1.0, 0.0])
    ends = np.stack([rings[:-1], rings[1:]], 1)
    radial = ends[:, None, None, :, None] * out[None, None, :, None, :] + (heights[:, None] * up)[None, :, None, None]
    axial = (rings[:, None, None] * out)[:, :, None] + (np.array([0.0, heights[-1]])[:, None] * up)[None, None]
    return (
        arcs,
        _segments(radial.reshape(-1, 2, 3), np.repeat(widths[:-1], len(heights) * sectors), "radial beams"),
        _segments(axial.reshape(-1, 2, 3), np.repeat(widths, sectors), "axial beams"),
    )


def _whole(share: float, name: str, of: str) -> int:
    if share < 1.0 - 1e-9 or abs(share - round(share)) > 1e-6 * share:
        raise ArgumentError(f"{name}: expected a whole number of cells {of}, got {share:g}")
    return round(share)


def _rings(radii: np.ndarray, widths: np.ndarray, height: float, levels: int) -> Solid:
    """Tori round the y axis at every level: the distance to the nearest level's, of every radius."""
    x, y, z = frep.coordinates()
    level = frep.clip(frep.floor(y / height + 0.5), 0.0, float(levels))
    off, rho = y - height * level, frep.hypot(x, z)
    field = minimum_of([frep.hypot(rho - r, off) - w for r, w in zip(radii, widths, strict=True)])
    widest, reach = float(widths.max()), float((radii + widths).max())
    bounds = np.array([[-reach, -widest, -reach], [reach, levels * height + widest, reach]])
    width = Feature("beam", frep.as_field(2.0 * float(widths.min())), "min_thickness")
    return Solid._make(field, bounds, features=(width,), label="rings")


def _segments(ends: np.ndarray, radii: np.ndarray, label: str) -> Solid:
    edges = np.arange(2 * len(ends)).reshape(-1, 2)
    diameters: Any = np.repeat(2.0 * radii, 2)
    skeleton = GraphSkeleton(ends.reshape(-1, 3), edges)
    return thickened(skeleton, diameters, node=None, section="circle", blend=0.0, label=label)
