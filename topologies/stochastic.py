"""Stochastic topologies: Voronoi and Delaunay graphs in a body, Voronoi walls (closed-cell foams), fibre networks.

Graphs are straight beams (lf-rep section 7), exact to rounding; `thicken` gives them body. Walls are a Field: the exact
distance to the faces of the cells, for which nothing is sampled. scipy.spatial (Qhull) makes the diagrams.

Seeds may weigh: with a radius each, cells are those of a power diagram. LF-rep's (3.24) to (3.27) trace the edges of
growing balls, an Apollonius diagram (Kim et al., 2005), in which the *distance* to balls decides: its faces are
hyperboloids, its edges conics, written as rational quadratic curves. Here the *power* decides. Its faces are planes and
its edges straight, so that they stay beams, with exact distances and exact STEP files; balls that do not overlap lie
each in its own cell in both; and for equal radii, the case that LF-rep's own program has, both are the Voronoi diagram.

Lattices in a body end where it ends. Those made with `periodic=True` fill all space: intersect them with a bounded
solid.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from frep import ArgumentError, EmptyError, Field, FieldLike, Solid, foreign, graphs
from frep.arguments import positive, real, width
from frep.errors import DisconnectedWarning, warn
from frep.skeleton import GraphSkeleton, PeriodicSkeleton
from frep.solid import Feature

from . import power_diagram
from . import seeds as seeding
from .beams import BeamTopology
from .seeds import Method, RandomState, generator, require_body, whole

_LOOSE = 0.25
"""A greater share of the length left out is worth a warning."""

_STEPS = 16
"""An edge is looked at so many times in a cell's size, to see where it leaves the body and comes back."""


def voronoi(
    body: Solid,
    *,
    cell_size: FieldLike | None = None,
    density: FieldLike | None = None,
    seeds: Any = None,
    weights: Any = None,
    random_state: RandomState | None = None,
    method: Method = "poisson_disk",
    relax: int = 0,
    periodic: bool = False,
    overhang: float = 0.0,
    connected: bool = True,
) -> BeamTopology:
    """The edges of the Voronoi cells of seeds in a body: an open-cell foam (lf-rep section 7).

    Args:
        body: a bounded Solid, in which edges are kept; parts of them that leave it for less than a sixteenth of a cell
            may stay. With `periodic`, a `frep.box`, whose sides are the period.
        cell_size: side of a cube as large as a cell, mm: a number, or a Field or function of position for graded cells.
            Cells at the surface of the body are smaller, and so those of a plate, where "poisson_disk" places them:
            there are some `(V + 0.235 S cell_size) / cell_size**3` in a body of volume V and surface S.
        density: instead, cells for each mm3, number or Field; as many more of them at the surface.
        seeds: instead, (n, 3) points in the body.
        weights: with `seeds`, the radius in mm of a ball round each, one number a seed: a point is in the cell of the
            seed for which distance^2 - radius^2 is least. This is the power diagram, not Apollonius's of (3.27): edges
            stay straight beams, and equal radii, where the two are one, make no difference. Seeds deep in larger balls
            have no cell: a `power_diagram.VanishedCellsWarning` counts them.
        random_state: a whole number, with which the same lattice comes out each time, or a numpy Generator. Needed
            unless all is given by `seeds`.
        method: how seeds are placed: "poisson_disk", at a least distance, for cells of much the same size, or
            "uniform", independent of each other (Poisson-Voronoi cells, of very unlike sizes).
        relax: steps of Lloyd's relaxation, which make cells rounder and more alike.
        periodic: the lattice repeats in all directions.
        overhang: how far edges may reach out of the body, mm; half a diameter lets `lattice.thicken(d) & body` end
            flat. Not with `periodic`.
        connected: leave out what hangs together only through the body's surface; False for a part with a skin. Where
            much is left out, as in a body thinner than its cells, there is a `DisconnectedWarning`.

    Returns:
        A `BeamTopology`; where edges cross the surface, they end in nodes on it.

    Raises:
        ArgumentTypeError, ArgumentError: not one of cell_size, density and seeds; seeds outside the body or too few (a
            body takes 4, or one where periodic); weights that are not a radius for each of given seeds; no
            random_state; sizes that are not positive; an overhang of a periodic lattice.
        EmptyError: no edge lies in the body.

    Example:
        >>> import frep
        >>> body = frep.sphere((0, 0, 0), 10)
        >>> lattice = voronoi(body, cell_size=5, random_state=1)
        >>> part = lattice.thicken(0.8) & body
        >>> bool(part.contains(lattice.skeleton.nodes.mean(axis=0)))
        False

        Beams from thin to `ratio` times as thick (LF-rep Fig. 3.14 calls it alpha): a diameter for each node, between
        which they taper.

        >>> ratio, height = 3, lattice.skeleton.nodes[:, 2]
        >>> up = (height - height.min()) / (height.max() - height.min())
        >>> diameters = 0.4 * (1 + (ratio - 1) * up)
        >>> tapered = lattice.thicken(diameters) & body

        A foam with bubbles of very unlike sizes, packed at random, each in its own cell:

        >>> import numpy as np
        >>> from topologies.seeds import packed_balls
        >>> radii = np.geomspace(1, 4, 40)
        >>> centres = packed_balls(body, radii, random_state=1)
        >>> voronoi(body, seeds=centres, weights=radii).label
        'voronoi'
    """
    power_diagram.require_still_seeds(weights, seeds, relax)
    points, size = seeding.chosen(body, cell_size, density, seeds, random_state, method, relax, periodic, least=4)
    heights = power_diagram.checked_weights(weights, len(points))
    reach = _overhang(overhang, periodic)
    if periodic:
        return _repeated(points, body, "voronoi", heights)
    vertices, edges = power_diagram.voronoi_edges(points, body.bounds, heights)
    graph = _clipped(vertices, edges, body, reach, size / _STEPS)
    return BeamTopology(_largest_piece(graph, size) if connected else graph, "voronoi")


def delaunay(
    body: Solid,
    *,
    cell_size: FieldLike | None = None,
    density: FieldLike | None = None,
    seeds: Any = None,
    random_state: RandomState | None = None,
    method: Method = "poisson_disk",
    relax: int = 0,
    periodic: bool = False,
    overhang: float = 0.0,
    connected: bool = True,
) -> BeamTopology:
    """The edges of the Delaunay tetrahedra of seeds in a body: a stiff network of some 15 beams a node.

    Arguments, errors and warnings as for `voronoi`; `cell_size` is of the Voronoi cells, one a node. Edges between seeds
    on both sides of a notch in the body end at its surface; what they leave loose in it goes unless `connected` is
    False. Where seeds lie on a sphere, as in a grid, one of the ways to cut up what they span is taken, the same for
    its neighbours: no two beams cross.

    Example:
        >>> import frep
        >>> delaunay(frep.box((0, 0, 0), (2, 2, 2)), seeds=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
        <delaunay: 4 nodes, 6 beams>
    """
    points, size = seeding.chosen(body, cell_size, density, seeds, random_state, method, relax, periodic, least=4)
    reach = _overhang(overhang, periodic)
    if periodic:
        return _repeated(points, body, "delaunay")
    _require_volume(points)
    side = float((np.prod(np.ptp(body.bounds, axis=0)) / len(points)) ** (1 / 3))
    pairs = power_diagram.delaunay_edges(points, np.arange(len(points)), side)
    graph = _clipped(points, pairs, body, reach, size / _STEPS)
    return BeamTopology(_largest_piece(graph, size) if connected else graph, "delaunay")


def voronoi_walls(
    body: Solid,
    thickness: FieldLike,
    *,
    cell_size: FieldLike | None = None,
    density: FieldLike | None = None,
    seeds: Any = None,
    weights: Any = None,
    random_state: RandomState | None = None,
    method: Method = "poisson_disk",
    relax: int = 0,
    periodic: bool = False,
) -> Solid:
    """The faces of the Voronoi cells of seeds in a body, as walls: a closed-cell foam.

    Cells at the body's surface are open there; `foam | body.shell(thickness)` closes them. With the seeds of an
    open-cell foam, `foam & body.shell(thickness)` is the net on the surface in whose corners the cut beams end.

    Args:
        body: a bounded Solid, to which the walls are cut; with `periodic` a `frep.box`, whose sides are the period:
            then the walls fill all space.
        thickness: full wall in mm: a number, a Field or a function of position.
        cell_size, density, seeds, weights, random_state, method, relax: as for `voronoi`. Two seeds will do.

    Raises:
        ArgumentTypeError, ArgumentError: as `voronoi`, and a thickness that is not positive.
        EmptyError: weights that leave one cell alone.

    Example:
        >>> import frep
        >>> body = frep.box((0, 0, 0), (20, 10, 10))
        >>> foam = voronoi_walls(body, 2, seeds=[(5, 5, 5), (15, 5, 5)])
        >>> foam.contains([[9.1, 1, 1], [10.9, 8, 8], [8.9, 5, 5]])
        array([ True,  True, False])
    """
    wall = width(thickness, "thickness")
    power_diagram.require_still_seeds(weights, seeds, relax)
    points, _ = seeding.chosen(body, cell_size, density, seeds, random_state, method, relax, periodic, least=2)
    heights = power_diagram.checked_weights(weights, len(points))
    field = _faces(points, body, periodic, heights) - 0.5 * wall
    everywhere = np.array([[-np.inf] * 3, [np.inf] * 3])
    walls = Solid._make(field, everywhere, features=(Feature("wall", wall, "thickness"),), label="voronoi walls")
    return walls if periodic else walls & body


def face_distance(body: Solid, seeds: Any, *, weights: Any = None, periodic: bool = False) -> Field:
    """Distance to the nearest face between the Voronoi cells of seeds, mm, exact: zero on faces, positive in cells.

    In the cell of seed a it is the least, over its neighbours b, of `(|p - b|^2 - |p - a|^2) / (2 |b - a|)`: a convex
    cell's surface is as near as the nearest of its planes. It is no sampled table but a lookup, some 0.4 us a point.
    With weights the squares are powers, `|p - a|^2 - r_a^2`.

    Args:
        body: a bounded Solid; with `periodic`, a `frep.box`.
        seeds: (n, 3) points in the body, mm, two at least (or one where periodic).
        weights: the radius of each, mm, as for `voronoi`.
        periodic: the seeds repeat.

    Example:
        >>> import frep
        >>> body = frep.box((0, 0, 0), (20, 10, 10))
        >>> face_distance(body, [(5, 5, 5), (15, 5, 5)])([[10, 1, 1], [7, 5, 5]])
        array([0., 3.])
        >>> face_distance(body, [(5, 5, 5), (15, 5, 5)], weights=[5, 1])([[11.2, 1, 1], [7, 5, 5]])
        array([0. , 4.2])
    """
    require_body(body, periodic)
    points = seeding.checked_seeds(body, seeds, 1 if periodic else 2, periodic)
    return _faces(points, body, periodic, power_diagram.checked_weights(weights, len(points)))


def fibres(
    body: Solid,
    number: int,
    *,
    length: float | None = None,
    directions: Any = None,
    spread: float = math.pi / 12,
    overhang: float = 0.0,
    random_state: RandomState | None = None,
) -> BeamTopology:
    """Straight fibres at random in a body: a felt, whose fibres pass through each other.

    Args:
        body: a bounded Solid, to which the fibres are cut.
        number: how many fibres meet the body; one that leaves it and comes back becomes several beams.
        length: of a fibre before it is cut, mm; None for fibres all through the body (random lines, met by every body
            in proportion to its surface).
        directions: axes of the fibres ("x", "y", "z" or vectors), None for any direction.
        spread: how far fibres lean away from those axes at most, rad.
        overhang: how far fibres may reach out of the body, mm.
        random_state: a whole number, with which the same fibres come out each time, or a numpy Generator.

    Raises:
        ArgumentTypeError, ArgumentError: not a bounded Solid; number, length, spread or overhang out of range; no
            random state.
        EmptyError: hardly a fibre meets the body.

    Example:
        >>> import frep
        >>> fibres(frep.sphere((0, 0, 0), 10), 20, random_state=1)
        <fibres: 40 nodes, 20 beams>
    """
    lo, hi = require_body(body)
    wanted = seeding.sensible(whole(number, "number"), "number")
    reach = _overhang(overhang, False)
    long = None if length is None else positive(length, "length")
    random = generator(random_state)
    seeding.random_directions(1, directions, spread, random_state=0)  # complain before any work
    centre, radius = 0.5 * (lo + hi), 0.5 * float(np.linalg.norm(hi - lo))
    pieces: list[np.ndarray] = []
    hits = tried = 0
    step = float((hi - lo).min()) / 64
    while hits < wanted:
        count = max(64, 2 * (wanted - hits))
        ends = _random_fibres(count, centre, radius, long, directions, spread, random)
        a, along = ends[:, 0], ends[:, 1] - ends[:, 0]
        start, stop, owner = graphs.stretches(a, ends[:, 1], body, graphs.tolerance_of(body.bounds), step, reach)
        lasting = (stop - start) * np.linalg.norm(along, axis=1)[owner] > 1e-6 * step
        met = np.unique(owner[lasting])[: wanted - hits]
        chosen = lasting & np.isin(owner, met)
        shares = np.stack([start, stop], axis=1)[chosen]
        pieces.append(a[owner[chosen], None] + shares[..., None] * along[owner[chosen], None])
        hits, tried = hits + len(met), tried + count
        if tried > 100_000 and hits < 1e-4 * tried:
            raise EmptyError(f"body: {hits} of {tried:,} random fibres meet it; is it empty?")
    nodes = np.concatenate(pieces).reshape(-1, 3)
    return BeamTopology(GraphSkeleton(nodes, np.arange(len(nodes)).reshape(-1, 2)), "fibres")


def _random_fibres(count, centre, radius, length, directions, spread, random) -> np.ndarray:
    """(count, 2, 3) ends: chords of the ball round the body, or pieces of `length` about evenly spread centres.

    Lines of one direction are spread evenly over the disc that the ball shows them. So are the centres of the pieces
    that could meet it, in a cylinder on that disc: however long they are, many do.
    """
    along = seeding.random_directions(count, directions, spread, random_state=random)
    side = np.cross(along, random.normal(size=(count, 3)))
    side /= np.linalg.norm(side, axis=1)[:, None]
    off = radius * np.sqrt(random.uniform(size=(count, 1)))
    middle = centre + off * side
    if length is None:
        half = np.sqrt(np.maximum(radius**2 - off**2, 1e-12 * radius**2))
    else:
        half = np.full((count, 1), 0.5 * length)
        middle = middle + random.uniform(-1.0, 1.0, (count, 1)) * (radius + half) * along
    return np.stack([middle - half * along, middle + half * along], axis=1)


# --- checks ----------------------------------------------------------------------------------------------------------


def _overhang(value: Any, periodic: bool) -> float:
    reach = real(value, "overhang", "mm")
    if reach < 0.0:
        raise ArgumentError(f"overhang: expected a length >= 0 mm, got {value!r}")
    if periodic and reach > 0.0:
        raise ArgumentError(f"overhang: expected 0 with periodic=True, whose edges fill all space, got {value!r}")
    return reach


def _require_volume(points: np.ndarray) -> None:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[-1] <= 1e-9 * spread[0]:
        raise ArgumentError("seeds: expected points that span a volume, all of them lie in one plane")


# --- diagrams ---------------------------------------------------------------------------------------------------------


def _repeated(points: np.ndarray, body: Solid, kind: str, heights: np.ndarray | None = None) -> BeamTopology:
    size = body.bounds[1] - body.bounds[0]
    nodes, beams = power_diagram.periodic_edges(points, size, kind, heights)
    return BeamTopology(PeriodicSkeleton(nodes, beams, size), kind)


def _faces(points: np.ndarray, body: Solid, periodic: bool, heights: np.ndarray | None) -> Field:
    wrap = body.bounds[1] - body.bounds[0] if periodic else None
    cells = power_diagram.Cells(points, body.bounds, wrap, heights)
    if heights is not None:
        cells.prepare()
    return foreign(cells, lipschitz=1.0, name="voronoi_faces")


# --- clipping ---------------------------------------------------------------------------------------------------------


def _clipped(nodes: np.ndarray, edges: np.ndarray, body: Solid, overhang: float, step: float) -> GraphSkeleton:
    """The parts of edges in the body, with nodes where they cross its surface."""
    try:
        return graphs.trimmed(GraphSkeleton(nodes, edges), body, step=step, overhang=overhang).skeleton
    except EmptyError:
        raise EmptyError("body: no edge of the lattice lies in it; ask for smaller cells") from None


def _largest_piece(graph: GraphSkeleton, size: float) -> GraphSkeleton:
    """The connected piece of the graph with the greatest length; `size` of its cells is for the warning."""
    nodes, edges = graph.nodes, graph.edges
    piece = graphs.connectivity(graph).component[edges[:, 0]]
    lengths = np.bincount(piece, np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1))
    if (left_out := 1.0 - lengths.max() / lengths.sum()) > _LOOSE:
        warn(
            f"{left_out:.0%} of the lattice's length hangs together only through the body's surface and is left out: "
            f"the body is in pieces, or about as thin as its cells of {size:.3g} mm; ask for smaller cells, or for "
            "connected=False and a skin",
            DisconnectedWarning,
        )
    used, kept = np.unique(edges[piece == np.argmax(lengths)], return_inverse=True)
    return GraphSkeleton(nodes[used], kept.reshape(-1, 2))
