"""`Solid.save`: which writer a suffix and a solid call for."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from frep.errors import FileError, TooLargeError, warn
from frep.io import MESH_SUFFIXES, save_mesh, suffix_of
from frep.io.atomic import check_target
from frep.progress import progress

if TYPE_CHECKING:
    from frep.mesh import Mesh
    from frep.solid import BeamDesign, Solid
    from frep.steady import SteadySkeleton

_STEP = (".step", ".stp")
_VDB = ".vdb"
SUFFIXES = (*MESH_SUFFIXES, *_STEP, _VDB)
"""Suffixes that `Solid.save` writes."""

_BAND = 3.0
"""Half width of the narrow band of a level set, in voxels: what level-set tools expect."""


def save_solid(
    solid: Solid,
    path: str | os.PathLike[str],
    voxel: float | None,
    *,
    polish: bool = False,
    max_faces: int | None = None,
) -> None:
    """Write a solid in the format that the suffix names; see `Solid.save`."""
    suffix = suffix_of(path)
    if suffix not in SUFFIXES:
        raise FileError(f"path: {os.fspath(path)!r} does not end in a known suffix; known are {', '.join(SUFFIXES)}")
    check_target(path)
    if suffix in _STEP:
        _save_step(solid, path, voxel, polish, max_faces)
    elif suffix == _VDB:
        from frep.io.vdb import write_vdb
        from frep.sizing import sample_solid

        grid = sample_solid(solid, voxel, None, band=_BAND)
        with progress("writing", total=1):
            write_vdb(path, grid)
    else:
        mesh = solid.mesh(voxel, polish=polish)
        with progress("writing", total=1):
            save_mesh(mesh, path)


def _save_step(
    solid: Solid, path: str | os.PathLike[str], voxel: float | None, polish: bool, max_faces: int | None
) -> None:
    from frep.io import step

    with progress("STEP"):
        failed = None if solid.beams is None else _save_exact(solid.beams, path)
        if solid.beams is not None and failed is None:
            return
        limit = step.MAX_FACES if max_faces is None else max_faces
        if voxel is None:
            mesh, voxel, off = _mesh_within(solid, limit, polish)
        else:
            mesh, off = solid.mesh(voxel, polish=polish), None
        step.write_faceted_step(path, mesh, limit)
    if failed is not None or abs(off or 0.0) > _NOTABLE:
        reason = f"{failed}; the file has facets instead" if failed else "the file has facets"
        volume = "" if off is None else f", and {off:+.1%} of a finer mesh's volume"
        warn(f"{reason}: {mesh.n_faces:,} triangles on a voxel of {voxel:.3g} mm{volume}", FacetsWarning)


_NOTABLE = 0.01
"""Part of the volume that facets may be off before it is said."""


class FacetsWarning(UserWarning):
    """A STEP file has facets where exact faces could be expected, or facets so coarse that the volume is off."""


def _save_exact(design: BeamDesign, path: str | os.PathLike[str]) -> str | None:
    """Write beams as exact solids; what hindered it, None where nothing did."""
    from frep.io import _brep

    if design.section != "circle" or design.blended:
        return "blend: blends have no exact faces" if design.blended else "section: only round beams have exact faces"
    if not _balls_have_beams(design):
        return "node: some balls are not the ends of beams"
    failed = None
    for write in (_save_cells, _save_explicit):
        try:
            hindrance = write(design, path)
        except _brep.BrepError as error:
            hindrance = str(error)
        if hindrance is None:
            return None
        failed = hindrance or failed
    return failed


_MANY = (8, 3, 2, 1, 1, 1)
"""Times as many triangles as wanted, from which a mesh is thinned out."""

_FINE = 160_000
"""Triangles of the first mesh that is thinned out, at least."""

_THINNED = 0.05
"""Part of its volume by which thinning may change a mesh."""


def _mesh_within(solid: Solid, limit: int, polish: bool) -> tuple[Mesh, float, float]:
    """The most faithful mesh, roughly, of no more than `limit` triangles: where no voxel is asked for, the format decides.

    One thinned out from a fine voxel is off in volume by a tenth of what one of a coarse voxel is.

    Returns:
        The mesh; its voxel, mm; and by what part its volume is off that of the finest mesh that was tried.
    """
    from frep.sizing import chosen_voxel

    voxel = chosen_voxel(solid, None, None)
    mesh = finest = solid.mesh(voxel, polish=polish)
    for most in (max(_MANY[0] * limit, _FINE), *(times * limit for times in _MANY[1:])):
        if mesh.n_faces > most:
            # Triangles grow as the surface in voxels.
            voxel *= 1.1 * (mesh.n_faces / most) ** 0.5
            mesh = solid.mesh(voxel, polish=polish)
        thinned = mesh if mesh.n_faces <= limit else _thinned(mesh, limit)
        if thinned is not None:
            mesh = thinned
            break
    return mesh, voxel, mesh.volume / finest.volume - 1.0


def _thinned(mesh: Mesh, limit: int) -> Mesh | None:
    """A mesh of `limit` triangles, the fewest where it is flat; None where it is no closed surface any more."""
    import pyvista as pv

    from frep.errors import FrepError

    whole, reduction = mesh.to_pyvista(), 1.0 - 0.98 * limit / mesh.n_faces
    # The second is less faithful, and keeps a surface closed where the first has torn it.
    for way in (
        lambda: whole.decimate(reduction, volume_preservation=True),
        lambda: whole.decimate_pro(reduction, preserve_topology=True, splitting=False),
    ):
        thin = way()
        try:
            found = type(mesh).from_pyvista(pv.PolyData(thin.points, thin.faces))
        except FrepError:
            continue
        report = found.check()
        sound = report.printable and not report.degenerate_faces and found.n_faces <= limit
        if sound and abs(found.volume / mesh.volume - 1.0) < _THINNED:
            return found
    return None


def _balls_have_beams(design: BeamDesign) -> bool:
    """Whether balls of their own, if there are any, all end beams of an explicit graph."""
    from frep.skeleton import GraphSkeleton

    if design.ball_radii is None:
        return True
    skeleton = design.skeleton
    alone = np.setdiff1d(np.flatnonzero(design.ball_radii), skeleton.edges)
    return isinstance(skeleton, GraphSkeleton) and not len(alone)


_TAPER = 0.01
"""Part of its diameter by which a beam may differ from the cone that stands for it."""


@dataclass(frozen=True, eq=False)
class ExplicitBeams:
    """Every beam of a design that reaches into its box, in the axes of the box.

    Attributes:
        nodes, edges: (n, 3) mm and (m, 2).
        radii: (m, 2) mm: each beam is the hull of balls of these radii.
        balls: (n,) radius of a ball at each node, mm, 0 for none.
    """

    nodes: np.ndarray
    edges: np.ndarray
    radii: np.ndarray
    balls: np.ndarray


def _scale(design: BeamDesign) -> float:
    """By how much the design was magnified."""
    return float(np.cbrt(abs(np.linalg.det(design.matrix))))


def _off_balls(design: BeamDesign, beams: ExplicitBeams) -> float:
    """By what part of itself a node diameter that is a Field varies, at most, over a ball that stands out of its beams."""
    if design.node_diameter is None or design.node_diameter.is_constant:
        return 0.0
    widest = np.zeros(len(beams.nodes))
    np.maximum.at(widest, beams.edges, beams.radii)
    out = beams.balls > widest
    nodes, balls = beams.nodes[out], beams.balls[out]
    off = 0.0
    for side in (*np.eye(3), *-np.eye(3)):
        found = 0.5 * design.node_diameter((nodes + balls[:, None] * side) @ design.turn.T)
        off = max(off, float(np.max(np.abs(found - balls) / balls, initial=0.0)))
    return off


def _off_cones(design: BeamDesign, beams: ExplicitBeams) -> float:
    """By what part of itself a diameter that is a Field differs, at most, from the cones that stand for the beams.

    Infinite where beams taper too steeply for that.
    """
    if design.diameter is None or design.diameter.is_constant:
        return 0.0
    a, b = beams.nodes[beams.edges[:, 0]], beams.nodes[beams.edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    along = (b - a) / length[:, None]
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    across /= np.linalg.norm(across, axis=1)[:, None]
    sine = (beams.radii[:, 1] - beams.radii[:, 0]) / length
    if (np.abs(sine) > 0.5).any():
        return np.inf
    off = 0.0
    for t in np.linspace(0.0, 1.0, 9):
        expected = ((1.0 - t) * beams.radii[:, 0] + t * beams.radii[:, 1]) / np.sqrt(1.0 - sine**2)
        middle = a + t * (b - a)
        for side in (np.zeros_like(a), across, -across, np.cross(along, across), -np.cross(along, across)):
            found = 0.5 * design.diameter((middle + expected[:, None] * side) @ design.turn.T)
            off = max(off, float(np.max(np.abs(found - expected) / expected)))
    return off


def _save_cells(design: BeamDesign, path: str | os.PathLike[str]) -> str | None:
    """Whole cells of one diameter: one cell is made and copied. None where it was written, "" for no such design."""
    from frep.io import step
    from frep.skeleton import PeriodicSkeleton

    skeleton, node = design.skeleton, design.node_diameter
    if not isinstance(skeleton, PeriodicSkeleton) or design.clip is None or not np.all(np.isfinite(design.clip)):
        return ""
    if design.diameter is None or not design.diameter.is_constant or not (node is None or node.is_constant):
        return ""
    scale = _scale(design)
    flip = np.array([np.sign(np.linalg.det(design.matrix)), 1.0, 1.0])
    rotation = design.matrix / scale * flip
    # From the axes of the box to those of the cells, which must be the same.
    back = rotation.T @ design.turn
    if not np.all(np.count_nonzero(np.abs(back) > 1e-9, axis=0) == 1):
        return ""
    size = scale * skeleton.size
    corners = design.clip @ np.round(back).T
    low, high = corners.min(axis=0), corners.max(axis=0)
    counts = (high - low) / size
    number = np.round(counts).astype(int)
    if np.any(np.abs(counts - number) > 1e-9 * np.maximum(number, 1)) or number.min() < 1:
        return ""
    if int(number.prod()) > step.MAX_CELLS or len(skeleton.edges) * int(number.prod()) > 8 * _MOST_COPIED:
        return ""
    # Cells begin where the box does: what lies between is part of the cell.
    begin = (low - rotation.T @ design.shift) / size
    begin -= np.round(begin)
    begin[np.abs(begin) < 1e-9] = 0.0
    nodes = np.where(flip < 0.0, skeleton.size - skeleton.nodes, skeleton.nodes) * scale - begin * size
    step.write_cell_pattern_step(
        path,
        nodes,
        skeleton.edges,
        size,
        0.5 * design.diameter.data,
        0.0 if node is None else 0.5 * node.data,
        (int(number[0]), int(number[1]), int(number[2])),
        low,
        turn=None if np.array_equal(rotation, np.eye(3)) else rotation,
    )
    return None


_MOST_COPIED = 400
"""Beams of whole cells that are written, in eighths."""


def _save_explicit(design: BeamDesign, path: str | os.PathLike[str]) -> str | None:
    """Every beam by itself. None where it was written, else why there are too many, or no cylinders and cones."""
    from frep.io import _brep, step
    from frep.io._worker import TooLongError

    beams = explicit_beams(design)
    if not 0 < len(beams.edges) <= step.MAX_BEAMS:
        many = f"{len(beams.edges):,} beams are" if len(beams.edges) else "its beams, or balls without any, are"
        return f"skeleton: {many} too many for exact faces, the limit is {step.MAX_BEAMS:,} beams"
    off = _off_cones(design, beams)
    if off > _TAPER:
        how = f"the Field differs from cones between the nodes by up to {off:.1%}" if np.isfinite(off) else "too steep"
        return f"diameter: only beams that taper evenly have exact faces; {how}"
    off = _off_balls(design, beams)
    if off > _TAPER:
        return f"node: the Field varies over its balls by up to {off:.1%}; only balls have exact faces"
    clip = None if design.clip is None else (design.clip[0], design.clip[1])
    upright = np.array_equal(design.turn, np.eye(3))
    turn = None if upright else design.turn
    lattice = path, beams.nodes, beams.edges, beams.radii, beams.balls, clip
    try:
        step.write_beams_step(*lattice, swept=True, turn=turn)
    except TooLongError:
        raise
    except _brep.BrepError:
        # Cones between discs at the nodes are thinner by so much; OpenCASCADE may unite them where it fails with hulls.
        length = np.linalg.norm(np.diff(beams.nodes[beams.edges], axis=1)[:, 0], axis=1)
        slope = np.ptp(beams.radii, axis=1) / length
        if not 0.0 < slope.max() <= np.sqrt(2.0 * _TAPER):
            raise
        step.write_beams_step(*lattice, turn=turn)
    return None


def explicit_beams(design: BeamDesign) -> ExplicitBeams:
    """Every beam of a design that reaches into its clip box.

    A diameter that is a Field is taken at the nodes; between them a beam tapers. Of a steady lattice that has more beams there
    than a STEP file holds, or balls without beams, there are none.
    """
    from frep.skeleton import PeriodicSkeleton
    from frep.steady import SteadySkeleton

    skeleton = design.skeleton
    segments = skeleton.segments()
    ends = None if design.end_radii is None else design.end_radii[skeleton.edges]
    scale, unturn = _scale(design), np.linalg.inv(design.matrix)
    widest = 0.0
    lo, hi = skeleton.bounds
    if design.clip is not None:
        there = _corners(design.clip) @ design.turn.T
        widest = _widest(design, there.min(axis=0), there.max(axis=0))
        local = (there - design.shift) @ unturn.T
        lo, hi = np.maximum(lo, local.min(axis=0)), np.minimum(hi, local.max(axis=0))
    if isinstance(skeleton, PeriodicSkeleton):
        if design.clip is None:
            raise ValueError("an infinite lattice has no explicit beams")
        segments, ends = _unrolled(segments, ends, skeleton.size, lo - 0.5 * widest / scale, hi + 0.5 * widest / scale)
    elif isinstance(skeleton, SteadySkeleton):
        segments, ends = _instances(skeleton, design, lo, hi)
    placed = segments @ design.matrix.T + design.shift
    segments = placed @ design.turn
    if design.clip is not None and isinstance(skeleton, PeriodicSkeleton):
        meets = np.all(segments.max(axis=1) + 0.5 * widest >= design.clip[0], axis=1)
        meets &= np.all(segments.min(axis=1) - 0.5 * widest <= design.clip[1], axis=1)
        segments, placed = segments[meets], placed[meets]
        ends = None if ends is None else ends[meets]
    points = segments.reshape(-1, 3)
    _, first, number = np.unique(np.round(points, 7), axis=0, return_index=True, return_inverse=True)
    nodes, places = points[first], placed.reshape(-1, 3)[first]
    edges = number.reshape(-1, 2)
    radii = scale * ends if ends is not None else _hull_radii(nodes, edges, 0.5 * design.diameter(places))  # type: ignore[misc]
    if design.ball_radii is not None:
        balls = np.zeros(len(nodes))
        np.maximum.at(balls, number.reshape(-1), scale * design.ball_radii[skeleton.edges.reshape(-1)])
    else:
        balls = np.zeros(len(nodes)) if design.node_diameter is None else 0.5 * design.node_diameter(places)
    return ExplicitBeams(nodes, edges, np.asarray(radii), balls)


def _hull_radii(nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(m, 2) radii of balls whose hulls are cones of about these radii (n,) at the nodes."""
    a, b = edges.T
    length = np.maximum(np.linalg.norm(nodes[b] - nodes[a], axis=1), 1e-300)
    # A cone that falls by tan(q) a mm touches a ball smaller by cos(q); one ball serves all beams of a node.
    share = 1.0 / np.hypot(1.0, (radii[a] - radii[b]) / length)
    total, count = np.zeros(len(nodes)), np.zeros(len(nodes))
    np.add.at(total, edges, share[:, None])
    np.add.at(count, edges, 1.0)
    return (radii * total / np.maximum(count, 1.0))[edges]


def _corners(box: np.ndarray) -> np.ndarray:
    return np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])


def _widest(design: BeamDesign, lo: np.ndarray, hi: np.ndarray) -> float:
    """The largest diameter of beams and nodes in a box."""
    if design.end_radii is not None:
        balls = 0.0 if design.ball_radii is None else float(design.ball_radii.max())
        return 2.0 * _scale(design) * design.skeleton.scales[1] * max(float(design.end_radii.max()), balls)
    return max(
        (float(f.bounds(lo, hi)[1]) for f in (design.diameter, design.node_diameter) if f is not None), default=0.0
    )


def _instances(
    skeleton: SteadySkeleton, design: BeamDesign, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """The beams (m, 2, 3) of a steady lattice that reach into a box, and the radii of cones; none if too many."""
    from frep.io import step

    there = _corners(np.array([low, high])) @ design.matrix.T + design.shift
    widest = _widest(design, there.min(axis=0), there.max(axis=0)) / _scale(design)
    radius = 0.5 * (float(np.linalg.norm(high - low)) + widest)
    none = np.zeros((0, 2, 3)), None if design.end_radii is None else np.zeros((0, 2))
    if design.end_radii is not None and len(skeleton.lone_nodes):
        return none
    try:
        beams = skeleton.beams_meeting(0.5 * (low + high), radius, most=8 * step.MAX_BEAMS)[:, [1, 2, 3, 0]]
    except TooLargeError:
        return none
    segments, radii = skeleton.ends(beams)
    if design.end_radii is None:
        return segments, None
    pairs = skeleton.edges[beams[:, 3]]
    return segments, radii / skeleton.radii[pairs] * design.end_radii[pairs]


def _unrolled(segments: np.ndarray, ends: np.ndarray | None, size: np.ndarray, lo: np.ndarray, hi: np.ndarray):
    """The segments of all periods whose box meets [lo, hi]."""
    least, most = segments.min(axis=1), segments.max(axis=1)
    found, radii = [], []
    first = np.ceil((lo - most) / size).astype(int).min(axis=0)
    last = np.floor((hi - least) / size).astype(int).max(axis=0)
    for index in np.ndindex(*(last - first + 1)):
        shift = (first + index) * size
        meets = np.all((most + shift >= lo) & (least + shift <= hi), axis=1)
        found.append(segments[meets] + shift)
        if ends is not None:
            radii.append(ends[meets])
    return np.concatenate(found), None if ends is None else np.concatenate(radii)
