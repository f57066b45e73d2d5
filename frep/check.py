"""Is this triangle mesh the skin of a solid? A report of everything a slicer would stumble over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from frep.mesh import Mesh

FLAT = 1e-12
"""A face is flat to a line when its area is below this part of its longest edge squared."""


@dataclass(frozen=True)
class MeshReport:
    """What `Mesh.check` found. Vertices that no face uses are ignored; faces that name a vertex twice count as
    degenerate and take no part in the rest.

    Attributes:
        closed: there are faces, and every edge has an even number of them: no hole anywhere.
        manifold: every edge has one or two faces and the faces round every vertex form one fan.
        oriented: the faces of every edge agree on which side is out.
        components: pieces, faces hanging together by a vertex at least.
        genus: handles, summed over the pieces (Euler: V - E + F = 2 components - 2 genus). None when the mesh is not
            closed and manifold, where the formula says nothing.
        open_edges: edges of exactly one face.
        non_manifold_edges: edges of three faces or more.
        non_manifold_vertices: vertices whose faces do not form one fan.
        degenerate_faces: faces that name a vertex twice or whose corners lie on one line.
        duplicate_faces: faces that repeat the three vertices of another.
        faces: all faces.
        vertices: vertices that a face uses.
    """

    closed: bool
    manifold: bool
    oriented: bool
    components: int
    genus: int | None
    open_edges: int
    non_manifold_edges: int
    non_manifold_vertices: int
    degenerate_faces: int
    duplicate_faces: int
    faces: int
    vertices: int

    @property
    def printable(self) -> bool:
        """Closed, manifold and oriented: the skin of a solid, as a slicer wants it."""
        return self.closed and self.manifold and self.oriented

    def __str__(self) -> str:
        def yes(value: bool) -> str:
            return "yes" if value else "NO"

        rows = [
            ("faces", f"{self.faces:,}"),
            ("vertices", f"{self.vertices:,}"),
            ("closed", f"{yes(self.closed)} ({self.open_edges:,} open edges)"),
            (
                "manifold",
                f"{yes(self.manifold)} ({self.non_manifold_edges:,} edges and "
                f"{self.non_manifold_vertices:,} vertices are not)",
            ),
            ("oriented", yes(self.oriented)),
            ("components", f"{self.components:,}"),
            ("genus", "undefined: not closed and manifold" if self.genus is None else f"{self.genus:,}"),
            ("degenerate faces", f"{self.degenerate_faces:,}"),
            ("duplicate faces", f"{self.duplicate_faces:,}"),
        ]
        return "\n".join(f"{name:<17} {value}" for name, value in rows)


def check(mesh: Mesh) -> MeshReport:
    """Examine a mesh: holes, edges and vertices that are not manifold, orientation, pieces, handles, bad faces.

    Purely by index, except for faces flat to a line: two vertices at one place are two vertices, and a surface that
    cuts through itself is not noticed.

    Args:
        mesh: any triangle mesh; 8 M faces take seconds and under 1 GB.
    """
    from frep import triangles

    vertices, faces = mesh.vertices, mesh.faces
    n_vertices, n_faces = len(vertices), len(faces)
    kind = triangles.degenerate_faces(vertices, faces, FLAT)
    twin = np.empty(3 * n_faces, np.int32 if 3 * n_faces < 2**31 else np.int64)
    edges, single, many, odd, twisted = triangles.pair_half_edges(faces, kind, n_vertices, twin)
    used, broken = triangles.broken_fans(faces, kind, twin, n_vertices)
    del twin
    components = triangles.connected_components(faces, kind, n_vertices)
    n_proper = n_faces - int(np.count_nonzero(kind >= 2))
    closed = n_proper > 0 and odd == 0
    manifold = many == 0 and broken == 0
    return MeshReport(
        closed=closed,
        manifold=manifold,
        oriented=twisted == 0,
        components=int(components),
        genus=int(components - (used - edges + n_proper) // 2) if closed and manifold else None,
        open_edges=int(single),
        non_manifold_edges=int(many),
        non_manifold_vertices=int(broken),
        degenerate_faces=int(np.count_nonzero(kind)),
        duplicate_faces=int(triangles.duplicate_faces(faces, kind, n_vertices)),
        faces=n_faces,
        vertices=int(used),
    )
