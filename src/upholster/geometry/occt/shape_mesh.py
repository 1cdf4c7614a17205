"""Triangles of bodies, by Open CASCADE's mesher: neighbouring faces share the vertices of common edges."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IMeshTools import IMeshTools_Parameters
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from upholster.geometry.occt.records import BodyRecord

__all__ = ["ANGLE", "mesh_body"]

ANGLE = 7.0
"""Greatest bend of faces' edges from a vertex to the next, in degrees: 7 keeps areas within 0.1 %."""


_INSIDE = 3.0
"""Inside faces this many times as much bend is allowed; there the deviation alone limits the distance."""


@dataclass(eq=False)
class _Vertices:
    """Vertices of a body while they are collected; those on edges by the edge's number."""

    corners: dict[int, int]
    along: dict[int, list[int]]
    positions: list[tuple[float, float, float]]

    def new(self, point: Any) -> int:
        self.positions.append((point.X(), point.Y(), point.Z()))
        return len(self.positions) - 1


def mesh_body(
    shape: Any,
    faces: list[Any],
    body: BodyRecord,
    deviation: float,
    angle: float,
    progress: Callable[[int], None],
) -> None:
    """Triangulate a body's faces; a face without triangles is left plain.

    Parameters
    ----------
    shape
        The body.
    faces
        Its faces, in the order of ``body.faces``.
    body
        Receives positions; its faces receive vertices, parameters and triangles.
    deviation
        Greatest distance of triangles from the faces, in millimetres.
    angle
        Greatest bend of a face's edge from a vertex to the next, in degrees.
    progress
        Called with the number of faces meshed.
    """
    wanted = IMeshTools_Parameters()
    wanted.Deflection = wanted.DeflectionInterior = deviation
    wanted.Angle = float(np.radians(angle))
    wanted.AngleInterior = float(np.radians(_INSIDE * angle))
    wanted.MinSize = deviation
    wanted.InParallel = False
    BRepMesh_IncrementalMesh(shape, wanted)
    numbers = _edge_numbers(shape)
    vertices = _Vertices({}, {}, [])
    for count, (face, record) in enumerate(zip(faces, body.faces, strict=True), 1):
        try:
            _mesh_face(face, record, vertices, numbers)
        except RuntimeError as error:  # OCP raises C++ exceptions as RuntimeError
            record.plain = f"no triangles: {error}".splitlines()[0]
        progress(count)
    body.positions = np.array(vertices.positions, np.float64).reshape(-1, 3)
    rim = np.zeros(len(vertices.positions), bool)
    rim[[*vertices.corners.values(), *(v for line in vertices.along.values() for v in line)]] = True
    body.rim = rim


def _edge_numbers(shape: Any) -> tuple[Any, Any]:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as IndexedMap
    from OCP.TopAbs import TopAbs_VERTEX

    edges, corners = IndexedMap(), IndexedMap()
    TopExp.MapShapes_s(shape, TopAbs_EDGE, edges)
    TopExp.MapShapes_s(shape, TopAbs_VERTEX, corners)
    return edges, corners


def _mesh_face(face: Any, record: Any, vertices: _Vertices, numbers: tuple[Any, Any]) -> None:
    place = TopLoc_Location()
    found = BRep_Tool.Triangulation_s(face, place)
    if found is None or not found.NbTriangles() or not found.HasUVNodes():
        record.plain = "Open CASCADE finds no triangles on it"
        return
    matrix = place.Transformation()
    count = found.NbNodes()
    own = np.full(count + 1, -1, np.int64)
    walk = TopExp_Explorer(face, TopAbs_EDGE)
    while walk.More():
        _number_edge(TopoDS.Edge(walk.Current()), found, place, matrix, own, vertices, numbers)
        walk.Next()
    for node in range(1, count + 1):
        if own[node] < 0:
            own[node] = vertices.new(found.Node(node).Transformed(matrix))
    record.vertices = own[1:].astype(np.int32)
    record.uv = np.array([(p.X(), p.Y()) for p in map(found.UVNode, range(1, count + 1))], np.float64)
    triangles = np.array(
        [found.Triangle(k).Get() for k in range(1, found.NbTriangles() + 1)], np.int32
    ).reshape(-1, 3)[:, -3:]
    triangles = triangles - 1
    record.triangles = triangles[:, [0, 2, 1]] if record.reversed else triangles


def _number_edge(
    edge: Any,
    mesh: Any,
    place: Any,
    matrix: Any,
    own: Any,
    vertices: _Vertices,
    numbers: tuple[Any, Any],
) -> None:
    """Give the nodes of a face along an edge their numbers in the body."""
    line = BRep_Tool.PolygonOnTriangulation_s(edge, mesh, place)
    if line is None:
        return
    nodes = [line.Node(k) for k in range(1, line.NbNodes() + 1)]
    forward = TopoDS.Edge(edge.Oriented(TopAbs_FORWARD))
    ends = []
    corners = (TopExp.FirstVertex_s(forward), TopExp.LastVertex_s(forward))
    for corner, node in zip(corners, (nodes[0], nodes[-1]), strict=True):
        number = numbers[1].FindIndex(corner)
        if not corner.IsNull() and number:
            if number not in vertices.corners:
                vertices.corners[number] = vertices.new(mesh.Node(node).Transformed(matrix))
            ends.append(vertices.corners[number])
        else:
            ends.append(vertices.new(mesh.Node(node).Transformed(matrix)))
    if BRep_Tool.Degenerated_s(edge):
        own[nodes] = ends[0]
        return
    number = numbers[0].FindIndex(edge)
    inner = vertices.along.get(number)
    if inner is None or len(inner) != len(nodes) - 2:
        inner = [vertices.new(mesh.Node(node).Transformed(matrix)) for node in nodes[1:-1]]
        vertices.along.setdefault(number, inner)
    own[nodes] = [ends[0], *inner, ends[1]]
