"""STEP files for CAD: small beam lattices as exact solids, any closed mesh as a faceted one.

Promises: one valid solid where the lattice hangs together (else a compound), made of cylinders, cones, spheres and
planes, in mm, whose volume has been checked against the beams it was made from and in the file. Hubs that are clear of
each other are laid down in closed form (`frep/io/_net.py`); what overlaps or is cut by a box goes through OpenCASCADE's
booleans, in a process of its own that may crash (`frep/io/_worker.py`). It is for parts of up to some thousand beams; a
CAD program would choke on more.
"""

# pyright: reportAttributeAccessIssue=false
# (OCP is a compiled module whose stubs pyright does not find.)
from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from frep.errors import ArgumentError, FileError, FrepError, TooLargeError
from frep.io import _brep
from frep.io._facets import faceted_solids, welded
from frep.io._knots import WAYS, Beams, Halves, clipped_hubs
from frep.io._shell import Placed, solids_of
from frep.io._worker import apart
from frep.io.atomic import check_target, replacing

if TYPE_CHECKING:
    from frep.mesh import Mesh

MAX_BEAMS = 2000
"""Beams that `write_beams_step` takes."""

MAX_UNITED = 400
"""Beams of them that OpenCASCADE may have to unite."""

MAX_CELLS = 512
"""Cells that `write_cell_pattern_step` takes."""

MAX_FACES = 20_000
"""Triangles that `write_faceted_step` takes unless told otherwise."""

Array = npt.NDArray[np.float64]


def write_beams_step(
    path: str | os.PathLike[str],
    nodes: npt.ArrayLike,
    edges: npt.ArrayLike,
    radii: npt.ArrayLike,
    node_radii: npt.ArrayLike | None = None,
    clip: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    *,
    swept: bool = False,
    turn: npt.ArrayLike | None = None,
) -> None:
    """Write beams as one exact solid: a cylinder or cone a beam, a ball a node.

    A node's ball is as large as the thickest beam that ends there, or as `node_radii` where that is larger, so that
    joints are closed and free ends round. Where the beams of a node touch one ball and the next node's are clear of
    them, their faces are laid down in closed form (`frep/io/_net.py`); OpenCASCADE unites what is left.

    Args:
        path: file name.
        nodes: (n, 3) mm.
        edges: (m, 2) node numbers, at most `MAX_BEAMS`.
        radii: (m, 2) radius at either end of each beam, mm.
        node_radii: (n,) radius of a ball at each node, mm, 0 for none of its own.
        clip: (lower corner, upper corner) of a box, mm; what sticks out is cut off.
        swept: False for cones with discs of these radii at the nodes; True for the hulls of balls of these radii, as
            the distance to a beam with one diameter a node has them. Cylinders are the same either way.
        turn: (3, 3) rotation matrix, applied to everything, the box too, before it is written.

    Raises:
        ArgumentError: wrong shapes, radii that are not positive, a beam without length, nothing left in the box, a
            matrix that is no rotation.
        TooLargeError: more than `MAX_BEAMS` beams.
        BrepError: OpenCASCADE makes no correct solid of them, crashes, or takes too long.
        FileError: the file cannot be written.
    """
    beams = _checked_beams(nodes, edges, radii, node_radii, swept)
    box = None if clip is None else _checked_box(clip)
    rotation = _checked_turn(turn)
    if len(beams.edges) > MAX_BEAMS:
        raise TooLargeError(
            f"edges: {len(beams.edges):,} beams are too many for an exact STEP file, the limit is {MAX_BEAMS}; clip a "
            "smaller part, or write a faceted one from a coarse mesh"
        )
    check_target(path)
    with replacing(path) as temporary:
        name = os.fspath(path)
        try:
            _fill_readable(temporary, name, partial(_joined, beams, box, False), "edges", rotation)
        except _UnionNeededError:
            joined = partial(_joined, beams, box, True)
            seconds = _SECONDS + _SECONDS_EACH * len(beams.edges)
            apart(_fill_readable, temporary, name, joined, "edges", rotation, seconds=seconds, what="edges")


_SECONDS = 60.0
_SECONDS_EACH = 0.5
"""Time that OpenCASCADE has to unite beams, and more of it for each; some twenty times what it usually takes."""


class _UnionNeededError(Exception):
    """Beams overlap, or are cut by a box: the hubs laid down are not all."""


def _joined(beams: Beams, box: _brep.Box | None, union: bool, way: int) -> Any:
    """The hubs of some beams, those laid down and those united, glued to one shape, within the box.

    Raises:
        _UnionNeededError: some have to be united, and `union` is False.
    """
    turn = (way + 1) % _TURNS  # poles away from the beams first
    halves = Halves(beams)
    knots = halves.knots()
    crossing: list[int] = []
    if box is not None:
        where = {knot[0]: _where(*halves.pieces(knot).bounds(), box) for knot in knots}
        knots = [knot for knot in knots if where[knot[0]] != "outside"]
        crossing = [knot[0] for knot in knots if len(knot) == 1 and where[knot[0]] == "crossing"]
    if crossing and not union:
        raise _UnionNeededError
    parts, left = [], crossing
    if box is not None and crossing:
        halves = _well_seamed(beams, crossing, box)
        parts, left = clipped_hubs(halves, crossing, box)
    whole = {knot[0] for knot in knots if len(knot) == 1} - set(crossing)
    hubs = halves.hubs(sorted(whole))
    made = set(hubs) | set(crossing) - set(left)
    rest = [knot for knot in knots if knot[0] not in made]
    united = int(np.isin(halves.node, [node for knot in rest for node in knot]).sum())
    if united > 2 * MAX_UNITED:
        raise _brep.BrepError(f"edges: {united:,} half beams overlap others; at most {2 * MAX_UNITED} can be united")
    if rest and not union:
        raise _UnionNeededError
    parts = _hub_solids(list(hubs.values())) + parts + _joined_knots(halves, rest, box, turn)
    if not parts:
        raise ArgumentError("clip: no beam reaches into the box; nothing is left to write")
    return _brep.glue(parts, "edges") if rest or crossing else _brep.compound(parts)


def _apart(halves: Halves, knot: list[int], place: Array) -> list[Any]:
    """The hubs of a knot, each a solid by itself, about a place; none where one of them is no hub."""
    hubs = halves.hubs(knot)
    if len(hubs) < len(knot):
        return []
    alone = [Placed(h.center - place, h.hub, h.net, [(-1, -1)] * len(h.other)) for h in hubs.values()]
    return solids_of(alone)


_SAMPLE = 8
"""Hubs by which it is told which seams suit a box."""


def _well_seamed(beams: Beams, crossing: list[int], box: _brep.Box) -> Halves:
    """Halves with seams by which OpenCASCADE cuts the most of some hubs."""
    some = crossing[:: -(-len(crossing) // _SAMPLE)]
    best, fewest = Halves(beams), len(some) + 1
    for way in range(WAYS):
        trial = Halves(beams, way)
        _, missing = clipped_hubs(trial, some, box)
        if len(missing) < fewest:
            best, fewest = trial, len(missing)
        if not missing:
            break
    return best


def _where(low: Array, high: Array, box: _brep.Box) -> str:
    if (high < box[0]).any() or (low > box[1]).any():
        return "outside"
    return "inside" if (low >= box[0]).all() and (high <= box[1]).all() else "crossing"


def _hub_solids(hubs: list[Placed]) -> list[Any]:
    """Hubs as solids, what hangs together in one.

    Raises:
        BrepError: a solid is not valid, or has not the volume of its hubs.
    """
    if not hubs:
        return []
    solids = solids_of(hubs)
    shape = _brep.compound(solids)
    expected = sum(placed.net.volume for placed in hubs)
    if not (_brep.is_valid(shape) and abs(_brep.volume(shape) / expected - 1.0) < 1e-4):
        raise _brep.BrepError("edges: the faces of the beams do not close")
    return solids


def _joined_knots(halves: Halves, knots: list[list[int]], box: _brep.Box | None, turn: int) -> list[Any]:
    """Knots of half beams, each united, within the box."""
    known: dict[bytes, Any] = {}
    parts = []
    for knot in knots:
        pieces = halves.pieces(knot)
        place = pieces.center[0]
        what = f"edges: the beams round node {knot[0]}" + (f" and {len(knot) - 1} more" if len(knot) > 1 else "")
        low, high = pieces.bounds()
        if box is not None and ((high < box[0]).any() or (low > box[1]).any()):
            continue
        cut = box is not None and bool((low < box[0]).any() or (high > box[1]).any())
        key = _shape_key(pieces, place, box if cut else None)
        if key not in known:
            known[key] = _brep.unite(
                _shifted(pieces, -place),
                (box[0] - place, box[1] - place) if cut and box is not None else None,
                what,
                turn=turn,
                ready=_apart(halves, knot, place) if len(knot) > 1 and turn == 1 else (),
            )
        if known[key] is not None:
            parts.append(_brep.moved(known[key], place))
    return parts


def write_cell_pattern_step(
    path: str | os.PathLike[str],
    cell_nodes: npt.ArrayLike,
    cell_edges: npt.ArrayLike,
    cell_size: npt.ArrayLike,
    radius: npt.ArrayLike,
    node_radius: float = 0.0,
    counts: tuple[int, int, int] = (1, 1, 1),
    origin: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    turn: npt.ArrayLike | None = None,
) -> None:
    """Write whole cells of a periodic lattice, cut off flat at the outer cell faces, as one exact solid.

    One cell is united and cut once, its copies are glued: some seconds for dozens of cells, where a general union
    takes minutes. Beams of neighbouring cells that reach into the cell are taken along.

    Args:
        path: file name.
        cell_nodes: (n, 3) mm, in the box from 0 to `cell_size`.
        cell_edges: (m, 2) node numbers.
        cell_size: edge length of the cell, mm, one number or three.
        radius: of the beams, mm, one number or (m,).
        node_radius: of a ball at every node, mm; 0 makes it as thick as its thickest beam.
        counts: cells along x, y, z; at most `MAX_CELLS` in all.
        origin: lower corner of the first cell, mm.
        turn: (3, 3) rotation matrix, applied to the whole before it is written.

    Raises:
        ArgumentError, TooLargeError, BrepError, FileError: as `write_beams_step`.
    """
    size = np.broadcast_to(np.asarray(cell_size, np.float64), 3)
    if not (np.isfinite(size).all() and (size > 0).all()):
        raise ArgumentError(f"cell_size: expected a positive length in mm, or three; got {cell_size}")
    if len(counts) != 3 or any(int(n) != n or n < 1 for n in counts):
        raise ArgumentError(f"counts: expected three whole numbers from 1 up, got {counts}")
    if int(np.prod(counts)) > MAX_CELLS:
        raise TooLargeError(
            f"counts: {int(np.prod(counts)):,} cells are too many for an exact STEP file, the limit is {MAX_CELLS}; "
            "clip a smaller part, or write a faceted one from a coarse mesh"
        )
    start = np.asarray(origin, np.float64)
    if start.shape != (3,) or not np.isfinite(start).all():
        raise ArgumentError(f"origin: expected three finite coordinates in mm, got {origin}")
    n_edges = len(np.asarray(cell_edges))
    radii = np.broadcast_to(np.asarray(radius, np.float64).reshape(-1, 1), (n_edges, 2))
    node_radii = np.full(len(np.asarray(cell_nodes)), float(node_radius))
    beams = _checked_beams(cell_nodes, cell_edges, radii, node_radii)
    rotation = _checked_turn(turn)
    check_target(path)

    pieces = _with_neighbours(beams.nodes, beams.edges, beams.radii, beams.balls, size)

    pattern = partial(_pattern, pieces, size, start, counts)
    seconds = _SECONDS + _SECONDS_EACH * len(pieces.start)
    with replacing(path) as temporary:
        name, what = os.fspath(path), "cell_edges"
        apart(_fill_readable, temporary, name, pattern, what, rotation, seconds=seconds, what=what)


def _pattern(pieces: _brep.Pieces, size: Array, start: Array, counts: tuple[int, int, int], way: int) -> Any:
    """The cell that some pieces make, and its copies, glued."""
    cell = _brep.unite(pieces, (np.zeros(3), size), "cell_edges: the beams of the cell", turn=way)
    if cell is None:
        raise ArgumentError("cell_edges: no beam reaches into the cell; nothing is left to write")
    return _brep.glue([_brep.moved(cell, start + size * index) for index in np.ndindex(*counts)], "counts")


_TURNS = 4
"""Ways in which poles and seams of balls are tried."""


def _fill_readable(file: Path, name: str, make: Callable[[int], Any], what: str, rotation: Array | None) -> None:
    """Write a shape, turned, with balls as they are, or, where the file would be misread, with their poles elsewhere.

    Raises:
        BrepError: it is misread with every turn of the balls; `what` names it in the message.
    """
    for way in range(_TURNS):
        shape = make(way)
        try:
            _fill(file, name, shape if rotation is None else _brep.turned(shape, rotation), what)
        except _MisreadError:
            if way == _TURNS - 1:
                raise
            continue
        return


class _MisreadError(_brep.BrepError):
    """A file that a reader takes for another solid."""


def write_faceted_step(path: str | os.PathLike[str], mesh: Mesh, max_faces: int = MAX_FACES) -> None:
    """Write a closed mesh as solids of flat triangles that share their edges, one a component, with its voids.

    Args:
        path: file name.
        mesh: closed, manifold and oriented; vertices nearer than 1e-6 mm are joined first.
        max_faces: refuse meshes of more triangles: the file has about 1 kB a triangle, and CAD programs give up.

    Raises:
        TooLargeError: more than `max_faces` triangles.
        FrepError: the mesh is open, not manifold, inside out in parts, or has triangles flat to a line.
        FileError: the file cannot be written.
    """
    if mesh.n_faces > max_faces:
        raise TooLargeError(
            f"mesh: {mesh.n_faces:,} triangles are too many for a faceted STEP file, the limit is "
            f"max_faces={max_faces:,}; mesh with a larger voxel, or decimate first"
        )
    mesh = welded(mesh)
    report = mesh.check()
    if not report.printable or report.degenerate_faces:
        raise FrepError(
            f"mesh: a STEP solid needs a closed, manifold, oriented mesh without flat triangles; it is\n{report}"
        )
    check_target(path)
    if mesh.volume < 0:
        mesh = type(mesh)(mesh.vertices, mesh.faces[:, ::-1])
    shape = _brep.compound(faceted_solids(mesh))
    if not _brep.is_valid(shape):
        raise _brep.BrepError("mesh: OpenCASCADE finds the faceted solid invalid; it may cut through itself")
    with replacing(path) as temporary:
        _fill(temporary, os.fspath(path), shape)


def _shape_key(pieces: _brep.Pieces, place: Array, clip: _brep.Box | None) -> bytes:
    """Equal for knots that differ by a translation only (to 1e-6 mm)."""
    numbers = [pieces.start - place, pieces.end - place, pieces.start_radius, pieces.end_radius, pieces.ball]
    numbers += [pieces.center - place] + ([] if clip is None else [clip[0] - place, clip[1] - place])
    return b"|".join((np.round(array, 6) + 0.0).tobytes() for array in numbers)


def _shifted(pieces: _brep.Pieces, offset: Array) -> _brep.Pieces:
    return _brep.Pieces(
        start=pieces.start + offset,
        end=pieces.end + offset,
        start_radius=pieces.start_radius,
        end_radius=pieces.end_radius,
        seam=pieces.seam,
        center=pieces.center + offset,
        ball=pieces.ball,
    )


def _with_neighbours(nodes: Array, edges, radii: Array, balls: Array, size: Array) -> _brep.Pieces:
    """The beams and balls of the cell, and those of its 26 neighbours that add something inside it."""
    own = _cell_pieces(nodes, edges, radii, balls, np.zeros(3))
    shifts = [size * (np.array(index) - 1.0) for index in np.ndindex(3, 3, 3) if index != (1, 1, 1)]
    grid = np.stack(np.meshgrid(*(np.linspace(0, length, 33) for length in size), indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    left = grid[own.count_containing(grid) == 0]
    # A neighbour's beam that is also the cell's own (a cell may list shared ones) adds nothing.
    wanted = [own]
    for shift in shifts:
        whole = _cell_pieces(nodes, edges, radii, balls, shift)
        for k in range(len(whole.start)):
            beam = _selected(whole, [k], [])
            if beam.count_containing(left).any():
                wanted.append(beam)
        for k in range(len(whole.center)):
            ball = _selected(whole, [], [k])
            if ball.count_containing(left).any():
                wanted.append(ball)
    joined = _brep.Pieces(*(np.concatenate([getattr(w, f) for w in wanted]) for f in _brep.Pieces.__dataclass_fields__))
    # Neighbours share beams and balls among themselves.
    ends = np.sort(np.round(np.stack([joined.start, joined.end], axis=1), 6), axis=1).reshape(len(joined.start), 6)
    beams = np.unique(ends + 0.0, axis=0, return_index=True)[1]
    return _selected(
        joined, np.sort(beams), np.sort(np.unique(np.round(joined.center, 6) + 0.0, axis=0, return_index=True)[1])
    )


def _cell_pieces(nodes: Array, edges, radii: Array, balls: Array, shift: Array) -> _brep.Pieces:
    used = np.unique(edges)
    start, end = nodes[edges[:, 0]] + shift, nodes[edges[:, 1]] + shift
    return _brep.Pieces(
        start, end, radii[:, 0], radii[:, 1], _brep.seam_directions(end - start), nodes[used] + shift, balls[used]
    )


def _selected(pieces: _brep.Pieces, beams: Any, balls: Any) -> _brep.Pieces:
    beams, balls = np.asarray(beams, int), np.asarray(balls, int)
    return _brep.Pieces(
        start=pieces.start[beams],
        end=pieces.end[beams],
        start_radius=pieces.start_radius[beams],
        end_radius=pieces.end_radius[beams],
        seam=pieces.seam[beams],
        center=pieces.center[balls],
        ball=pieces.ball[balls],
    )


def _checked_beams(nodes, edges, radii, node_radii, swept: bool = False) -> Beams:
    points = np.asarray(nodes, np.float64)
    pairs = np.asarray(edges)
    thickness = np.asarray(radii, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ArgumentError(f"nodes: expected finite coordinates of shape (n, 3), got shape {points.shape}")
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs) or pairs.dtype.kind not in "iu":
        raise ArgumentError(
            f"edges: expected node numbers of shape (m, 2), m > 0, got {pairs.dtype} of shape {pairs.shape}"
        )
    if pairs.min() < 0 or pairs.max() >= len(points):
        raise ArgumentError(f"edges: node numbers must be 0 to {len(points) - 1}, got {pairs.min()} to {pairs.max()}")
    if thickness.shape != pairs.shape:
        raise ArgumentError(f"radii: expected shape {pairs.shape}, a radius for each end, got {thickness.shape}")
    if not (np.isfinite(thickness).all() and (thickness > 0).all()):
        raise ArgumentError(f"radii: every radius must be a positive number of mm; the smallest is {thickness.min()}")
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    if (length < 1e-6).any():
        raise ArgumentError(f"edges: beam {int(length.argmin())} has no length")
    balls = np.zeros(len(points)) if node_radii is None else np.array(node_radii, np.float64)
    if balls.shape != (len(points),) or not (np.isfinite(balls).all() and (balls >= 0).all()):
        raise ArgumentError(f"node_radii: expected {len(points)} radii from 0 up in mm, got {node_radii}")
    np.maximum.at(balls, pairs, thickness)
    # The same beam twice would be united with itself.
    _, first = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True)
    first.sort()
    return Beams(points, pairs[first].astype(np.int64), thickness[first], balls, swept)


def _checked_turn(turn) -> Array | None:
    if turn is None:
        return None
    matrix = np.asarray(turn, np.float64)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise ArgumentError(f"turn: expected a (3, 3) rotation matrix, got {turn}")
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-9 or np.linalg.det(matrix) < 0.0:
        raise ArgumentError(f"turn: expected a rotation, without scale or reflection; got {matrix.tolist()}")
    return matrix


def _checked_box(clip) -> _brep.Box:
    low, high = (np.asarray(corner, np.float64) for corner in clip)
    if low.shape != (3,) or high.shape != (3,) or not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise ArgumentError(f"clip: expected two corners of three finite coordinates, got {clip}")
    if (high <= low).any():
        raise ArgumentError(
            f"clip: the upper corner must lie above the lower one, got {low.tolist()} and {high.tolist()}"
        )
    return low, high


def _name_product(model: Any, path: str | os.PathLike[str]) -> None:
    """Let CAD programs call the part as the file, in the letters that every reader knows."""
    from OCP.StepBasic import StepBasic_Product
    from OCP.TCollection import TCollection_HAsciiString

    name = Path(path).stem.encode("ascii", "replace").decode() or "part"
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetName(TCollection_HAsciiString(name))
            entity.SetId(TCollection_HAsciiString(name))
            return


def _fill(file: Path, name: str, shape: Any, curved: str | None = None) -> None:
    """Write a shape; one of curved faces (`curved` names it in messages) is read again, and its volume compared.

    A trimmed sphere may come back as the rest of it: the file says it by curves, and the reader guesses the side.
    `name` is what the file will be called.
    """
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    parts = _brep.solids(shape)
    # OpenCASCADE takes seconds for the volume of thousands of facets, which their mesh has told.
    there = _brep.volume(shape) if curved is not None else 1.0
    if not parts or not there > 0:
        raise _brep.BrepError("OpenCASCADE made no solid of positive volume; write a faceted STEP file (from a mesh)")
    # Its statistics would go to the terminal.
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    # Readers make the curves on surfaces anew; the file is a third smaller without.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    transferred = writer.Transfer(_brep.compound(parts), STEPControl_StepModelType.STEPControl_AsIs)
    if transferred != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise _brep.BrepError("OpenCASCADE cannot express the solid in STEP; write a faceted STEP file (from a mesh)")
    _name_product(writer.Model(), name)
    status = writer.Write(str(file))
    # The status is "done" on a full disk as well; the last line tells.
    with file.open("rb") as written:
        written.seek(max(0, file.stat().st_size - 200))
        complete = b"END-ISO-10303-21;" in written.read()
    if status != IFSelect_ReturnStatus.IFSelect_RetDone or not complete:
        raise FileError(f"path: cannot write {name!r}: the file came out incomplete; is the disk full?")
    if curved is not None:
        back, valid = _brep.read_back(file)
        if abs(back / there - 1.0) > 1e-3:
            found = f"the file holds {back:.6g} mm3 of the solid's {there:.6g}"
        elif not valid:
            found = "the solid in the file is not valid when it is read again"
        else:
            return
        raise _MisreadError(
            f"{curved}: {found}. Change the radii by a few per cent, or write a faceted STEP file (from a mesh)"
        )
