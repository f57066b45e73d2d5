"""`Solid.save`: which writer a suffix and a solid call for."""

from __future__ import annotations

import os
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
    from frep.io import _brep, step

    design = solid.beams
    with progress("STEP", total=1):
        if design is not None and design.section == "circle" and not design.blended and _balls_have_beams(design):
            failed = None
            for write in (_save_cells, _save_explicit):
                try:
                    if write(design, path):
                        return
                except _brep.BrepError as error:
                    failed = error
            if failed is not None:
                warn(f"{failed}; the file has facets instead", UserWarning)
        limit = step.MAX_FACES if max_faces is None else max_faces
        mesh = solid.mesh(voxel, polish=polish) if voxel is not None else _mesh_within(solid, limit, polish)
        step.write_faceted_step(path, mesh, limit)


def _mesh_within(solid: Solid, limit: int, polish: bool) -> Mesh:
    """The finest mesh, roughly, of no more than `limit` triangles: where no voxel is asked for, the format decides."""
    from frep.sizing import chosen_voxel

    voxel = chosen_voxel(solid, None, None)
    mesh = solid.mesh(voxel, polish=polish)
    for _ in range(4):
        if mesh.n_faces <= limit:
            break
        # Triangles grow as the surface in voxels.
        voxel *= 1.1 * (mesh.n_faces / limit) ** 0.5
        mesh = solid.mesh(voxel, polish=polish)
    return mesh


def _balls_have_beams(design: BeamDesign) -> bool:
    """Whether balls of their own, if there are any, all end beams of an explicit graph."""
    from frep.skeleton import GraphSkeleton

    if design.ball_radii is None:
        return True
    skeleton = design.skeleton
    alone = np.setdiff1d(np.flatnonzero(design.ball_radii), skeleton.edges)
    return isinstance(skeleton, GraphSkeleton) and not len(alone)


_TAPER = 0.01
"""Part of its diameter by which a beam may differ from the cone between its ends."""


def _tapers_evenly(design: BeamDesign, nodes: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> bool:
    """Whether a diameter that is a Field varies as a cone does: along each beam evenly, and not across it."""
    if design.diameter is None or design.diameter.is_constant:
        return True
    a, b = nodes[edges[:, 0]], nodes[edges[:, 1]]
    along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
    across /= np.linalg.norm(across, axis=1)[:, None]
    for t in np.linspace(0.0, 1.0, 9):
        expected = (1.0 - t) * radii[:, 0] + t * radii[:, 1]
        middle = a + t * (b - a)
        for side in (np.zeros_like(a), across, -across, np.cross(along, across), -np.cross(along, across)):
            found = 0.5 * design.diameter(middle + expected[:, None] * side)
            if np.any(np.abs(found - expected) > _TAPER * expected):
                return False
    return True


def _box(design: BeamDesign) -> tuple[np.ndarray, np.ndarray] | None:
    return None if design.clip is None else (design.clip[0], design.clip[1])


def _save_cells(design: BeamDesign, path: str | os.PathLike[str]) -> bool:
    """Whole cells of one diameter: one cell is made and copied. False where the design is not that."""
    from frep.io import step
    from frep.skeleton import PeriodicSkeleton

    skeleton, node = design.skeleton, design.node_diameter
    if not isinstance(skeleton, PeriodicSkeleton) or design.clip is None:
        return False
    if design.diameter is None or not design.diameter.is_constant or not (node is None or node.is_constant):
        return False
    counts = (design.clip[1] - design.clip[0]) / skeleton.size
    start = design.clip[0] / skeleton.size
    whole = np.all(np.abs(counts - np.round(counts)) < 1e-9) and np.all(np.abs(start - np.round(start)) < 1e-9)
    number = np.round(counts).astype(int)
    if not whole or number.min() < 1 or int(number.prod()) > step.MAX_CELLS:
        return False
    if len(skeleton.edges) * int(number.prod()) > 8 * step.MAX_BEAMS:
        return False
    radius = 0.5 * design.diameter.data
    ball = 0.0 if node is None else 0.5 * node.data
    size = tuple(int(n) for n in number)
    step.write_cell_pattern_step(
        path, skeleton.nodes, skeleton.edges, skeleton.size, radius, ball, (size[0], size[1], size[2]), design.clip[0]
    )
    return True


def _save_explicit(design: BeamDesign, path: str | os.PathLike[str]) -> bool:
    """Every beam by itself. False where there are too many, or they are no cylinders and cones."""
    from frep.io import step

    nodes, edges, radii, balls = explicit_beams(design)
    if not 0 < len(edges) <= step.MAX_BEAMS or not _tapers_evenly(design, nodes, edges, radii):
        return False
    step.write_beams_step(path, nodes, edges, radii, balls, _box(design))
    return True


def explicit_beams(design: BeamDesign) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Every beam of a design that reaches into its clip box: nodes (n, 3), edges (m, 2), radii (m, 2), node radii (n,).

    A diameter that is a Field is taken at the nodes; between them a beam tapers. Of a steady lattice that has more beams there
    than a STEP file holds, or balls without beams, there are none.
    """
    from frep.skeleton import PeriodicSkeleton
    from frep.steady import SteadySkeleton

    skeleton = design.skeleton
    segments = skeleton.segments()
    ends = None if design.end_radii is None else design.end_radii[skeleton.edges]
    lo, hi = skeleton.bounds if design.clip is None else design.clip
    if isinstance(skeleton, PeriodicSkeleton):
        if design.clip is None:
            raise ValueError("an infinite lattice has no explicit beams")
        widest = _widest(design, lo, hi)
        segments, ends = _unrolled(segments, ends, skeleton.size, lo - 0.5 * widest, hi + 0.5 * widest)
    elif isinstance(skeleton, SteadySkeleton):
        segments, ends = _instances(skeleton, design, lo, hi)
    points = segments.reshape(-1, 3)
    _, first, number = np.unique(np.round(points, 7), axis=0, return_index=True, return_inverse=True)
    nodes = points[first]
    edges = number.reshape(-1, 2)
    radii = ends if ends is not None else 0.5 * design.diameter(nodes)[edges]  # type: ignore[misc]
    if design.ball_radii is not None:
        balls = np.zeros(len(nodes))
        np.maximum.at(balls, number.reshape(-1), design.ball_radii[skeleton.edges.reshape(-1)])
    else:
        balls = np.zeros(len(nodes)) if design.node_diameter is None else 0.5 * design.node_diameter(nodes)
    return nodes, edges, np.asarray(radii), balls


def _widest(design: BeamDesign, lo: np.ndarray, hi: np.ndarray) -> float:
    """The largest diameter of beams and nodes in a box."""
    if design.end_radii is not None:
        return 2.0 * design.skeleton.scales[1] * float(design.end_radii.max())
    return max(
        (float(f.bounds(lo, hi)[1]) for f in (design.diameter, design.node_diameter) if f is not None), default=0.0
    )


def _instances(
    skeleton: SteadySkeleton, design: BeamDesign, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """The beams (m, 2, 3) of a steady lattice that reach into a box, and the radii of cones; none if too many."""
    from frep.io import step

    widest = _widest(design, low, high)
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
