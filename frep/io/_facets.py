"""Triangle meshes as solids of flat faces: welded, parted into shells, each void in the shell that holds it."""

# pyright: reportAttributeAccessIssue=false
# (OCP is a compiled module whose stubs pyright does not find.)
from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from frep.errors import FrepError

if TYPE_CHECKING:
    from frep.mesh import Mesh

Array = npt.NDArray[np.float64]


def welded(mesh: Mesh) -> Mesh:
    """Vertices nearer than OpenCASCADE tells apart become one; triangles that collapse go."""
    from frep.mesh import Mesh

    _, first, number = np.unique(np.round(mesh.vertices, 6) + 0.0, axis=0, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[mesh.faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return Mesh(mesh.vertices[first], faces[proper])


def faceted_solids(mesh: Mesh) -> list[Any]:
    """A solid for each outer shell, with the voids inside it."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Solid

    from frep.mesh import Mesh

    shells = [Mesh(mesh.vertices, mesh.faces[part]) for part in _components(mesh)]
    outer = [s for s in shells if s.volume > 0]
    held: list[list[Mesh]] = [[] for _ in outer]
    for void in (s for s in shells if s.volume <= 0):
        point = void.vertices[void.faces[0, 0]]
        around = [i for i, s in enumerate(outer) if _winding(s, point) > 0.5]
        if not around:
            raise FrepError("mesh: a part of it is inside out (a void that no outer shell holds)")
        held[min(around, key=lambda i: outer[i].volume)].append(void)
    builder = BRep_Builder()
    solids = []
    for shell, voids in zip(outer, held, strict=True):
        solid = TopoDS_Solid()
        builder.MakeSolid(solid)
        for part in (shell, *voids):
            builder.Add(solid, _faceted_shell(part.vertices, part.faces))
        solids.append(solid)
    return solids


def _components(mesh: Mesh) -> list[npt.NDArray[np.bool_]]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    a, b = mesh.faces[:, [0, 1, 2]].ravel(), mesh.faces[:, [1, 2, 0]].ravel()
    n = len(mesh.vertices)
    _, label = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    of_face = label[mesh.faces[:, 0]]
    return [of_face == number for number in np.unique(of_face)]


def _winding(mesh: Mesh, point: Array) -> float:
    """Winding number of a closed mesh round a point: 1 inside, 0 outside (van Oosterom and Strackee)."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(np.arctan2(triple, below).sum() / (2.0 * np.pi))


def _faceted_shell(vertices: Array, faces: Any) -> Any:
    """Planes on shared edges: no sewing, every edge is made once and used in both directions."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeVertex
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Wire

    builder = BRep_Builder()
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    corners = [BRepBuilderAPI_MakeVertex(gp_Pnt(*row)).Vertex() for row in vertices.tolist()]
    edges: dict[tuple[int, int], Any] = {}
    shell = TopoDS_Shell()
    builder.MakeShell(shell)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    for face, corner, normal in zip(faces.tolist(), a.tolist(), normals.tolist(), strict=True):
        wire = TopoDS_Wire()
        builder.MakeWire(wire)
        for i, j in zip(face, face[1:] + face[:1], strict=True):
            key = (min(i, j), max(i, j))
            if key not in edges:
                edges[key] = BRepBuilderAPI_MakeEdge(corners[key[0]], corners[key[1]]).Edge()
            builder.Add(wire, edges[key] if i < j else edges[key].Reversed())
        wire.Closed(True)
        plane = gp_Pln(gp_Pnt(*corner), gp_Dir(*normal))
        builder.Add(shell, BRepBuilderAPI_MakeFace(plane, wire, True).Face())
    shell.Closed(True)
    return shell
