"""3DM files, read by rhino3dm and converted to Open CASCADE's shapes: same surfaces, edges and loops."""

from pathlib import Path
from typing import Any

import rhino3dm
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Transform
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_int,
    Array2_double,
    Array2_gp_Pnt,
)
from OCP.Geom import Geom_BSplineCurve, Geom_BSplineSurface
from OCP.gp import gp_GTrsf, gp_Pnt, gp_Trsf
from OCP.ShapeFix import ShapeFix_Shape
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Edge, TopoDS_Face, TopoDS_Vertex, TopoDS_Wire

from upholster.geometry.occt.records import CadRecord
from upholster.geometry.occt.shape_reader import Leaf, UnreadableError

__all__ = ["read_rhino"]

_MILLIMETRES = {
    "Microns": 0.001,
    "Millimeters": 1.0,
    "Centimeters": 10.0,
    "Decimeters": 100.0,
    "Meters": 1000.0,
    "Kilometers": 1e6,
    "Inches": 25.4,
    "Feet": 304.8,
    "Yards": 914.4,
}
_DEEPEST = 30
"""Greatest depth of nested blocks."""


def read_rhino(path: Path, unit: float | None) -> tuple[CadRecord, list[Leaf]]:
    """Read the Breps, extrusions and surfaces of a 3DM file, and its blocks at their placements.

    Parameters
    ----------
    path
        The file.
    unit
        Length of its unit in millimetres, if the file states none.

    Raises
    ------
    UnreadableError
        If it is not a 3DM file, or both the file and the caller give a unit.
    """
    model = rhino3dm.File3dm.Read(str(path))
    if model is None:
        raise UnreadableError("is not a 3DM file that rhino3dm can read")
    name = str(model.Settings.ModelUnitSystem).rpartition(".")[2]
    own = _MILLIMETRES.get(name)
    if own is not None and unit is not None:
        raise UnreadableError(f"states its unit itself ({name.lower()}); allowed: without --unit")
    known = name.lower() if own is not None else "" if unit is None else f"{unit:g} mm"
    record = CadRecord("3DM", known)
    reader = _Reader(model, own or unit or 1.0, record)
    for thing in model.Objects:
        if not thing.Attributes.IsInstanceDefinitionObject:
            reader.add(thing, gp_Trsf(), 0)
    if reader.skipped:
        listed = ", ".join(f"{count} {kind}" for kind, count in sorted(reader.skipped.items()))
        record.notes.append(f"left out because they are not surfaces: {listed}")
    return record, reader.leaves


class _Reader:
    """The objects of a file as leaves."""

    def __init__(self, model: Any, scale: float, record: CadRecord) -> None:
        self.leaves: list[Leaf] = []
        self.skipped: dict[str, int] = {}
        self._model, self._scale, self._record = model, scale, record
        self._by_id = {str(thing.Attributes.Id): thing for thing in model.Objects}
        self._blocks = {str(block.Id): block for block in model.InstanceDefinitions}
        self._shapes: dict[str, Any] = {}

    def add(self, thing: Any, place: gp_Trsf, depth: int) -> None:
        """Add an object, or all objects of a block."""
        geometry = thing.Geometry
        if isinstance(geometry, rhino3dm.InstanceReference):
            block = self._blocks.get(str(geometry.ParentIdefId))
            if block is None or depth > _DEEPEST:
                return
            for number in block.GetObjectIds():
                inner = self._by_id.get(str(number))
                if inner is not None:
                    self.add(inner, place.Multiplied(self._placed(geometry.Xform)), depth + 1)
            return
        shape = self._shape(thing)
        if shape is None:
            kind = type(geometry).__name__
            self.skipped[kind] = self.skipped.get(kind, 0) + 1
            return
        layers, on = self._model.Layers, thing.Attributes.LayerIndex
        layer = layers[on].Name if 0 <= on < len(layers) else ""  # files may name layers that do not exist
        colour = thing.Attributes.DrawColor(self._model)
        code = "#" + "".join(f"{part:02x}" for part in colour[:3])
        name = thing.Attributes.Name or f"{type(geometry).__name__.lower()} {len(self.leaves) + 1}"
        if abs(place.ScaleFactor() - 1.0) > 1e-9 or place.IsNegative():
            shape, place = BRepBuilderAPI_Transform(shape, place, True).Shape(), gp_Trsf()
        self.leaves.append(Leaf(name, shape, TopLoc_Location(place), code, layer))

    def _shape(self, thing: Any) -> Any:
        """Return an object's shape, None if it is not a surface."""
        key = str(thing.Attributes.Id)
        if key not in self._shapes:
            geometry = thing.Geometry
            if isinstance(geometry, rhino3dm.Extrusion):
                geometry = geometry.ToBrep(True)
            elif isinstance(geometry, rhino3dm.Surface):
                geometry = rhino3dm.Brep.CreateFromSurface(geometry)
            self._shapes[key] = _brep(geometry, self._scale) if isinstance(geometry, rhino3dm.Brep) else None
        return self._shapes[key]

    def _placed(self, xform: Any) -> gp_Trsf:
        """Return a block's placement; sheared or unevenly scaled ones are approximated by rigid ones."""
        rows = [[getattr(xform, f"M{i}{j}") for j in range(4)] for i in range(3)]
        out = gp_Trsf()
        try:
            out.SetValues(*rows[0][:3], rows[0][3] * self._scale, *rows[1][:3], rows[1][3] * self._scale,
                          *rows[2][:3], rows[2][3] * self._scale)  # fmt: skip
        except RuntimeError:
            self._record.notes.append("a block is singular: it is placed as in its definition")
        uneven = gp_GTrsf(out)
        if any(abs(uneven.Value(i + 1, j + 1) - rows[i][j]) > 1e-6 for i in range(3) for j in range(3)):
            self._record.notes.append("a block is scaled unevenly, which is ignored: it is placed rigidly")
        return out


def _brep(brep: Any, scale: float) -> Any:
    """Return a Brep as a compound of faces that share edges and vertices."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    edges: dict[int, Any] = {}
    vertices: dict[int, Any] = {}
    for face in brep.Faces:
        surface = _surface(face.UnderlyingSurface().ToNurbsSurface(), scale)
        if brep.IsSurface and len(brep.Faces) == 1:
            made = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
        else:
            made = TopoDS_Face()
            builder.MakeFace(made, surface, 1e-6)
            for loop in face.Loops:
                builder.Add(made, _wire(loop, brep, scale, edges, vertices))
        builder.Add(whole, made.Reversed() if face.OrientationIsReversed else made)
    fixed = ShapeFix_Shape(whole)
    fixed.SetPrecision(1e-4)
    fixed.Perform()
    return fixed.Shape()


def _wire(loop: Any, brep: Any, scale: float, edges: dict[int, Any], vertices: dict[int, Any]) -> Any:
    """Return a loop as a wire; Open CASCADE makes the edges that are points."""
    builder, wire = BRep_Builder(), TopoDS_Wire()
    builder.MakeWire(wire)
    for trim in loop.Trims:
        if trim.EdgeIndex < 0:
            continue
        if trim.EdgeIndex not in edges:
            ends = (trim.StartVertexIndex, trim.EndVertexIndex)
            edges[trim.EdgeIndex] = _edge(
                brep, trim.EdgeIndex, ends[::-1] if trim.IsReversed else ends, scale, vertices
            )
        edge = edges[trim.EdgeIndex]
        builder.Add(wire, edge.Oriented(TopAbs_REVERSED if trim.IsReversed else TopAbs_FORWARD))
    return wire


def _edge(brep: Any, number: int, ends: tuple[int, int], scale: float, vertices: dict[int, Any]) -> Any:
    builder, edge = BRep_Builder(), TopoDS_Edge()
    curve = _curve(brep.Edges[number].ToNurbsCurve(), scale)
    first, last = curve.FirstParameter(), curve.LastParameter()
    builder.MakeEdge(edge, curve, 1e-4)
    for corner, at, way in ((ends[0], first, TopAbs_FORWARD), (ends[1], last, TopAbs_REVERSED)):
        point = curve.Value(at)
        if corner not in vertices:
            vertices[corner] = TopoDS_Vertex()
            builder.MakeVertex(vertices[corner], point, 1e-4)
        gap = BRep_Tool.Pnt_s(vertices[corner]).Distance(point)
        builder.UpdateVertex(vertices[corner], 1.01 * gap + 1e-7)
        builder.Add(edge, vertices[corner].Oriented(way))
    builder.Range(edge, first, last)
    return edge


def _surface(nurbs: Any, scale: float) -> Any:
    rows, columns = nurbs.Points.CountU, nurbs.Points.CountV
    poles, weights = Array2_gp_Pnt(1, rows, 1, columns), Array2_double(1, rows, 1, columns)
    for i in range(rows):
        for j in range(columns):
            point, weight = _pole(nurbs.Points[i, j], scale)
            poles.SetValue(i + 1, j + 1, point)
            weights.SetValue(i + 1, j + 1, weight)
    u, counts_u = _knots(nurbs.KnotsU)
    v, counts_v = _knots(nurbs.KnotsV)
    return Geom_BSplineSurface(
        poles, weights, u, v, counts_u, counts_v, nurbs.OrderU - 1, nurbs.OrderV - 1, False, False
    )


def _curve(nurbs: Any, scale: float) -> Any:
    count = len(nurbs.Points)
    poles, weights = Array1_gp_Pnt(1, count), Array1_double(1, count)
    for i in range(count):
        point, weight = _pole(nurbs.Points[i], scale)
        poles.SetValue(i + 1, point)
        weights.SetValue(i + 1, weight)
    knots, counts = _knots(nurbs.Knots)
    return Geom_BSplineCurve(poles, weights, knots, counts, nurbs.Order - 1, False)


def _pole(point: Any, scale: float) -> tuple[gp_Pnt, float]:
    """Return a control point: rhino3dm's is multiplied by its weight."""
    weight = point.W
    return gp_Pnt(*(scale * value / weight for value in (point.X, point.Y, point.Z))), weight


def _knots(listed: Any) -> tuple[Any, Any]:
    """Return distinct knots and their multiplicities: Rhino omits the first and the last knot."""
    values = [listed[k] for k in range(len(listed))]
    values = [values[0], *values, values[-1]]
    knots: list[float] = []
    counts: list[int] = []
    for value in values:
        if knots and value - knots[-1] <= 1e-12 * max(1.0, abs(value)):
            counts[-1] += 1
        else:
            knots.append(value)
            counts.append(1)
    out, times = Array1_double(1, len(knots)), Array1_int(1, len(knots))
    for k, (value, count) in enumerate(zip(knots, counts, strict=True)):
        out.SetValue(k + 1, value)
        times.SetValue(k + 1, count)
    return out, times
