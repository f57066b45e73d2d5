"""Bodies that come in as triangle meshes and become solids: scans with holes, assemblies that overlap, soups.

A body is sampled once, when it is loaded, as a signed distance on a refined grid (`frep/body_distance.py` says how and why it
is closed whatever is wrong with the triangles). What is promised: the sign is that of the winding number at one half; the
distance is that to the nearest triangle, to the sheets that close the holes, and to no triangle that lies inside the body.
What is not: edges and corners are rounded at the size of the voxel, walls thinner than a voxel may go, and a cavity inside an
inside-out part of an assembly may be taken for material.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np

from .arguments import positive
from .check import MeshReport
from .errors import ArgumentError, ArgumentTypeError, FileError, TooLargeError, warn
from .mesh import Mesh
from .sampled import SampledGrid
from .solid import Solid

DEFAULT_BLOCKS = 3000
"""Without `voxel`, the fine grid is made of about so many blocks: a couple of seconds and 10 MB."""


class BodyWarning(UserWarning):
    """A mesh was not the skin of a solid and has been read as one all the same; the message says what was amiss."""


@dataclass(frozen=True)
class BodyReport:
    """What was found in a mesh and how it was read as a solid.

    Attributes:
        mesh: the checks of the mesh after points at one place became one.
        holes: groups of open edges that hang together.
        duplicate_points: points that repeat another one's place.
        unused_points: points that no face uses.
        flipped_components: pieces that were inside out and have been turned.
        inside_out: all pieces were.
        reoriented: neighbouring faces disagreed on which side is out.
        buried: share of the area that lies inside the body, where pieces overlap, or bounds nothing (open sheets).
        lids: triangles that close the holes.
        voxel: node distance of the fine grid, mm.
        fine_blocks: blocks of 9 x 9 x 9 nodes near the surface.
        memory: bytes of the samples.
    """

    mesh: MeshReport
    holes: int
    duplicate_points: int
    unused_points: int
    flipped_components: int
    inside_out: bool
    reoriented: bool
    buried: float
    lids: int
    voxel: float
    fine_blocks: int
    memory: int

    @property
    def clean(self) -> bool:
        """Whether the mesh was the skin of a solid as it came."""
        return self.mesh.printable and not self.flipped_components and self.buried < 1e-3

    def __str__(self) -> str:
        rows = [
            ("holes", f"{self.holes:,}" + (f", closed by {self.lids:,} triangles" if self.lids else "")),
            ("duplicate points", f"{self.duplicate_points:,}"),
            ("unused points", f"{self.unused_points:,}"),
            ("inside out", "yes, turned" if self.inside_out else f"{self.flipped_components:,} components, turned"),
            ("disagreeing faces", "yes, turned" if self.reoriented else "no"),
            ("buried surface", f"{100 * self.buried:.1f} %"),
            ("voxel", f"{self.voxel:.4g} mm, {self.fine_blocks:,} fine blocks, {self.memory / 1e6:,.1f} MB"),
        ]
        return "\n".join([str(self.mesh), *(f"{name:<17} {value}" for name, value in rows)])


def load(path: str | os.PathLike[str], *, voxel: float | None = None) -> Solid:
    """Any triangle mesh file as a solid, holes closed.

    Args:
        path: a mesh file (`frep.io.read.READABLE_SUFFIXES`); its numbers are taken as mm.
        voxel: distance of the samples near the surface, mm; chosen where None so that loading takes a couple of seconds.

    Returns:
        The solid; `solid.report` is a `BodyReport`. A `BodyWarning` names the holes and other faults that were mended.

    Raises:
        FileError: no such file, no mesh, or one that encloses nothing.
        ArgumentError: `voxel` not positive.
        TooLargeError: so fine a voxel that the samples would not fit in memory.
    """
    from .io.read import read_mesh

    voxel = _checked_voxel(voxel)
    mesh = read_mesh(path)
    try:
        return _solid(mesh, voxel, os.path.basename(path))
    except ArgumentError as error:
        raise FileError(f"path: {os.fspath(path)!r} cannot be read as a body: {error}") from error


def from_mesh(mesh: Mesh, *, voxel: float | None = None) -> Solid:
    """A triangle mesh as a solid, holes closed; see `load`.

    Args:
        mesh: triangles in mm, in any state.
        voxel: distance of the samples near the surface, mm; chosen where None so that loading takes a couple of seconds.

    Raises:
        ArgumentTypeError: not a `Mesh`.
        ArgumentError: `voxel` not positive; a mesh that has no faces, no area, or encloses nothing.
        TooLargeError: so fine a voxel that the samples would not fit in memory.
    """
    if not isinstance(mesh, Mesh):
        raise ArgumentTypeError(f"mesh: expected a frep.Mesh, got {type(mesh).__name__}")
    return _solid(mesh, _checked_voxel(voxel), "body")


def _checked_voxel(voxel: float | None) -> float | None:
    return None if voxel is None else positive(voxel, "voxel")


def _solid(mesh: Mesh, voxel: float | None, label: str) -> Solid:
    from .body_distance import BAND, FINE, HALF_DIAGONAL, NODES, sample_body
    from .progress import progress

    vertices, faces, found, duplicates, unused = _cleaned(mesh)
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    side = float((hi - lo).max())
    area = 0.5 * float(np.linalg.norm(_normals(vertices, faces), axis=1).sum())
    # Cells whose centre is within half a diagonal and the band of the surface, times voxel squared.
    blocks_by_area = 2.0 * (HALF_DIAGONAL + BAND) * area / FINE**3
    if voxel is None:
        voxel = float(np.clip(math.sqrt(blocks_by_area / DEFAULT_BLOCKS), side / 512, side / 64))
    n_blocks = blocks_by_area / voxel**2
    n_coarse = float(np.prod((hi - lo) / (FINE * voxel) + 2.0))
    _require_memory(n_blocks, n_coarse, voxel)

    # Nodes outside the box of the mesh on all sides, by less than a coarse cell and more than a fine one.
    cells = np.ceil((hi - lo) / (FINE * voxel) + 0.5).astype(int)
    origin = 0.5 * (lo + hi) - 0.5 * FINE * voxel * cells
    was = not found.oriented
    faces, flipped, pieces = _oriented(vertices, faces, turn=was)
    vertices, faces, holes, lids = _lidded(vertices, faces)
    with progress("distance to the body", total=0.75 * NODES * n_blocks + 3.0 * n_coarse) as advance:
        samples = sample_body(
            (vertices - origin) / voxel, faces, (int(cells[0]), int(cells[1]), int(cells[2])), advance
        )

    grid = SampledGrid(
        origin,
        np.full(3, FINE * voxel),
        samples.nodes * np.float32(voxel),
        samples.table,
        samples.blocks * np.float32(voxel),
        label=label,
    )
    report = BodyReport(
        mesh=found,
        holes=holes,
        duplicate_points=duplicates,
        unused_points=unused,
        flipped_components=flipped,
        inside_out=flipped == pieces,
        reoriented=was,
        buried=samples.buried,
        lids=lids + samples.lids,
        voxel=voxel,
        fine_blocks=len(samples.blocks),
        memory=samples.nodes.nbytes + samples.table.nbytes + samples.blocks.nbytes,
    )
    message = _complaints(report)
    if message:
        warn(f"{label}: {message}", BodyWarning)
    # Nodes outside the box of the mesh are positive, therefore all is from one fine cell beyond it.
    return Solid._make(grid.field(), np.array([lo - voxel, hi + voxel]), label=label, report=report)


def _complaints(report: BodyReport) -> str:
    found = report.mesh
    faults = []
    if found.open_edges:
        holes = f"{report.holes:,} hole" + ("s" if report.holes != 1 else "")
        faults.append(f"{found.open_edges:,} open edges in {holes} were closed")
    if report.inside_out:
        faults.append("the mesh was inside out and has been turned")
    elif report.flipped_components:
        faults.append(f"{report.flipped_components:,} components were inside out and have been turned")
    if report.reoriented:
        faults.append("faces that disagreed on which side is out have been turned")
    if report.buried >= 1e-3:
        faults.append(
            f"{100 * report.buried:.1f} % of the area lies inside the body or bounds nothing and was left out"
        )
    return "; ".join(faults)


def _require_memory(n_blocks: float, n_coarse: float, voxel: float) -> None:
    from .sampling import free_bytes

    # Measured peaks: 50 bytes a fine node while blocks are built, 150 bytes a coarse node.
    estimate = 729 * 50.0 * n_blocks + 150.0 * n_coarse
    free = free_bytes()
    if estimate > 0.8 * free or n_blocks > 2**31 / 729 or n_coarse > 2**31:
        ratio = max(estimate / (0.8 * free), n_blocks * 729 / 2**31)
        fits = voxel * max(math.sqrt(ratio), (n_coarse / 2**31) ** (1 / 3)) * 1.05
        raise TooLargeError(
            f"voxel: at {voxel:g} mm the samples of the body need about {estimate / 1e9:.3g} GB, and {free / 1e9:.3g} GB are "
            f"free; a voxel of {float(f'{fits:.2g}'):g} mm would fit"
        )


# --- cleaning ----------------------------------------------------------------------------------------------------------


def _cleaned(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, MeshReport, int, int]:
    """Vertices and faces (int64) that bound something, the checks, and the numbers of duplicate and of unused points."""
    if not mesh.n_faces:
        raise ArgumentError("mesh: it has no faces; expected the triangles of a surface")
    used, faces = np.unique(mesh.faces, return_inverse=True)
    unused = len(mesh.vertices) - len(used)
    vertices = np.asarray(mesh.vertices)[used] + 0.0  # -0.0 and 0.0 are one place
    faces = faces.reshape(-1, 3).astype(np.int64)
    order = np.lexsort(vertices.T)
    new = np.ones(len(order), bool)
    new[1:] = np.any(vertices[order[1:]] != vertices[order[:-1]], axis=1)
    duplicates = int(np.count_nonzero(~new))
    if duplicates:
        place = np.empty(len(order), np.int64)
        place[order] = np.cumsum(new) - 1
        vertices, faces = vertices[order[new]], place[faces]
    found = Mesh(vertices, faces).check()
    if found.degenerate_faces:
        # A face flat to a line subtends nothing and bounds nothing; the edges it joined stay in place.
        span = float(np.ptp(vertices, axis=0).max())
        unit = (vertices - vertices[0]) / (span or 1.0)
        faces = faces[np.linalg.norm(_normals(unit, faces), axis=1) > 1e-15]
    if found.duplicate_faces:
        faces = _single(faces)
    if not len(faces):
        raise ArgumentError(
            "mesh: all its faces have zero area or cancel out; expected triangles that enclose a volume"
        )
    return vertices, faces, found, duplicates, unused


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a = vertices[faces[:, 0]]
    return np.cross(vertices[faces[:, 1]] - a, vertices[faces[:, 2]] - a)


def _single(faces: np.ndarray) -> np.ndarray:
    """One face of those on the same three vertices, on the side that most of them are; none where they cancel."""
    least = faces.argmin(axis=1)
    turned = faces[np.arange(len(faces))[:, None], (least[:, None] + np.arange(3)) % 3]
    forward = turned[:, 1] < turned[:, 2]
    key = np.where(forward[:, None], turned, turned[:, [0, 2, 1]])
    unique, inverse = np.unique(key, axis=0, return_inverse=True)
    balance = np.bincount(inverse.reshape(-1), np.where(forward, 1, -1), len(unique))
    return np.concatenate([unique[balance > 0], unique[balance < 0][:, [0, 2, 1]]])


def _lidded(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, int, int]:
    """The mesh with a flat lid on every flat hole, the number of holes, and that of the triangles added.

    A winding number of one half closes holes too, but bends the lid of one towards the others. A hole is a group of open edges
    that hang together; a fan from any point closes it, and one in its plane closes a flat one exactly.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    from .body_distance import open_edges

    edges, beside = open_edges(faces)
    if not len(edges):
        return vertices, faces, 0, 0
    points, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(points), len(points)))
    n, of_point = connected_components(graph, directed=False)
    hole = of_point[ends[:, 0]]

    def total(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(hole, column, n) for column in values.T], axis=1)

    tail, head = vertices[edges[:, 0]], vertices[edges[:, 1]]
    length = np.linalg.norm(head - tail, axis=1)
    around = np.bincount(hole, length, n)
    centre = total(0.5 * (tail + head) * length[:, None]) / around[:, None]
    # Against the direction of the edges the lid is on the outside of the body.
    normal = total(0.5 * np.cross(head - centre[hole], tail - centre[hole]))
    area = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(area, 1e-300)[:, None]
    bend = np.zeros(n)
    np.maximum.at(bend, hole, np.abs(np.einsum("ij,ij->i", tail - centre[hole], normal[hole])))
    # Beside the rim of an open sheet (not of a hole in a wall) the faces look the other way: no lid upon the sheet itself.
    beside_normal = _normals(vertices, faces[beside])
    beside_normal /= np.maximum(np.linalg.norm(beside_normal, axis=1), 1e-300)[:, None]
    facing = np.bincount(hole, length * np.einsum("ij,ij->i", beside_normal, normal[hole]), n) / around
    flat = (bend <= 1e-3 * np.sqrt(area)) & (area > 1e-3 * around**2) & (facing > -0.7)
    fan = flat[hole]
    lids = np.column_stack([edges[fan, 1], edges[fan, 0], len(vertices) + hole[fan]])
    closed = np.concatenate([vertices, centre])
    lids = lids[np.linalg.norm(_normals(closed, lids), axis=1) > 1e-12 * area[hole[fan]]]
    used, corner = np.unique(lids[:, 2], return_inverse=True)
    lids[:, 2] = len(vertices) + corner
    return np.concatenate([vertices, closed[used]]), np.concatenate([faces, lids]), n, len(lids)


def _oriented(vertices: np.ndarray, faces: np.ndarray, *, turn: bool) -> tuple[np.ndarray, int, int]:
    """The faces with every piece turned outward, how many pieces were turned, and how many there are.

    On an outward triangle the winding number is 0 in front and 1 behind, on the wall of a cavity too; on a piece that is
    inside out it is -1 in front and 0 behind; inside another piece it is more.
    """
    import igl

    from .body_distance import Winding

    if turn:
        faces, piece = (np.asarray(out) for out in igl.bfs_orient(np.ascontiguousarray(faces)))
    else:
        piece = np.asarray(igl.facet_components(np.ascontiguousarray(faces))[1])
    n = int(piece.max()) + 1
    # About its own centre and size: the tree is built in float32.
    lo, hi = vertices.min(axis=0), vertices.max(axis=0)
    local = (vertices - 0.5 * (lo + hi)) / float((hi - lo).max())
    normal = _normals(local, faces)
    area = np.linalg.norm(normal, axis=1)
    # The largest faces of each piece answer for it.
    order = np.lexsort((-area, piece))
    start = np.searchsorted(piece[order], np.arange(n))
    asked = order[np.arange(len(order)) - start[piece[order]] < 64]
    flipped = np.zeros(n, bool)
    for _ in range(3):
        # Turning one piece changes what the pieces round it see.
        outward = np.where(flipped[piece[asked]], -1.0, 1.0)
        step = outward[:, None] * 1e-4 * normal[asked] / area[asked][:, None]
        winding = Winding(local, _flip(faces, flipped[piece]))
        front = winding.at(local[faces[asked]].mean(axis=1) + step)
        score = np.bincount(piece[asked], area[asked] * np.clip(front + 0.5, -1.0, 1.0), n)
        wrong = score < 0
        if not wrong.any():
            break
        flipped ^= wrong
    return _flip(faces, flipped[piece]), int(np.count_nonzero(flipped)), n


def _flip(faces: np.ndarray, which: np.ndarray) -> np.ndarray:
    return np.where(which[:, None], faces[:, ::-1], faces) if which.any() else faces
