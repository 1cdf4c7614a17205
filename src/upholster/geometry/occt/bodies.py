"""Shapes as bodies: each solid or sheet once, with its faces and all its placements."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as IndexedMap
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound

from upholster.base.types import FloatArray, Progress
from upholster.geometry.occt.face_surfaces import describe_surface
from upholster.geometry.occt.records import BodyRecord, CadRecord, FaceRecord, Placed
from upholster.geometry.occt.shape_mesh import ANGLE, mesh_body
from upholster.geometry.occt.shape_reader import Leaf

__all__ = ["add_bodies"]

_SEWN = 1e-5
"""Loose faces are sewn where they meet within this share of the model's size, or their own tolerance."""

_FINE, _COARSE, _COARSE_ANGLE = 2000.0, 100.0, 30.0
"""Model's size over the deviation of triangles, fine and coarse, and degrees for coarse triangles."""

_APPROXIMATED = 0.1
"""Share of the deviation by which approximations of non-rational surfaces may be off."""


def add_bodies(
    record: CadRecord,
    leaves: list[Leaf],
    *,
    deviation: float | None,
    unique: bool,
    coarse: bool,
    progress: Progress,
) -> None:
    """Add the bodies of a file's shapes.

    Parameters
    ----------
    record
        Receives bodies, tolerance and deviation.
    leaves
        The file's shapes.
    deviation
        Greatest distance of triangles from the faces, in millimetres; by default a two-thousandth of the
        model's size.
    unique
        Whether each placement of a shape becomes a separate body.
    coarse
        Whether coarse triangles suffice, to find out which faces can have any.
    progress
        Called with "faces" and "mesh", the number of faces described or meshed, and their total.
    """
    record.box = _box(leaves)
    size = float(np.linalg.norm(record.box[1] - record.box[0])) or 1.0
    record.deviation = size / (_COARSE if coarse else _FINE) if deviation is None else deviation
    known = IndexedMap()
    by_key: dict[tuple[int, str, bool], BodyRecord] = {}
    found: list[tuple[BodyRecord, Any, list[_KnownFace]]] = []
    for placed in leaves:
        names = placed.name.split("\0")
        place = placed.place.Multiplied(placed.shape.Location())
        leaf = replace(placed, shape=placed.shape.Located(TopLoc_Location()))
        for shape, solid, faces in _parts(leaf, size):
            own = shape.Located(TopLoc_Location())
            stands = Placed(names[0], _matrix(place.Multiplied(shape.Location())))
            # Sheets are sewn again each time, so equal ones are recognized by the shape they are made of.
            key = (known.Add(own if solid else leaf.shape), leaf.colour, solid)
            if key in by_key and not unique:
                by_key[key].places.append(stands)
                continue
            body = BodyRecord(names[-1] or names[0], leaf.colour, leaf.layer, solid, places=[stands])
            by_key[key] = body
            record.bodies.append(body)
            back = shape.Location().Inverted()
            found.append((body, own, [(face.Moved(back), *labels) for face, *labels in faces]))
    total, described, meshed = sum(len(faces) for *_, faces in found), 0, 0
    for body, shape, faces in found:
        _describe_faces(body, faces, record, _after(described, total, "faces", progress))
        described += len(faces)
        mesh_body(
            shape,
            [TopoDS.Face(face) for face, *_ in faces],
            body,
            record.deviation,
            _COARSE_ANGLE if coarse else ANGLE,
            _after(meshed, total, "mesh", progress),
        )
        meshed += len(faces)


def _after(before: int, total: int, stage: str, progress: Progress) -> Callable[[int], None]:
    """Return a function that reports the progress of one body's faces, after those of previous bodies."""
    return lambda done: progress(stage, before + done, total)


_KnownFace = tuple[Any, str, str, str]
"""A ``TopoDS_Face``, its name, colour and layer."""


def _parts(leaf: Leaf, size: float) -> list[tuple[Any, bool, list[_KnownFace]]]:
    """Return the solids of a shape, and its other faces sewn to one sheet: each with its faces."""
    known = _Known(leaf)
    out = [
        (solid, True, [(face, *known.of(face)) for face in _explored(solid, TopAbs_FACE)])
        for solid in _explored(leaf.shape, TopAbs_SOLID)
    ]
    loose = _loose_faces(leaf.shape)
    if loose:
        tolerance = max(_SEWN * size, *(BRep_Tool.Tolerance_s(face) for face in loose))
        sewing = BRepBuilderAPI_Sewing(tolerance)
        for face in loose:
            sewing.Add(face)
        sewing.Perform()
        found, faces = [sewing.ModifiedSubShape(face) for face in loose], []
        whole, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(whole)
        builder.Add(whole, sewing.SewedShape())
        inside = IndexedMap()
        TopExp.MapShapes_s(whole, TopAbs_FACE, inside)
        for face, sewn in zip(loose, found, strict=True):
            number = 0 if sewn.IsNull() else inside.FindIndex(sewn)
            if not number:  # sewing left it out: keep it as it was
                builder.Add(whole, face)
            faces.append((TopoDS.Face(inside.FindKey(number)) if number else face, *known.of(face)))
        out.append((whole, False, faces))
    return out


def _loose_faces(shape: Any) -> list[Any]:
    """Return the faces that are not part of a solid."""
    out = []
    walk = TopExp_Explorer(shape, TopAbs_FACE, TopAbs_SOLID)
    while walk.More():
        out.append(TopoDS.Face(walk.Current()))
        walk.Next()
    return out


def _explored(shape: Any, kind: Any) -> list[Any]:
    out = []
    walk = TopExp_Explorer(shape, kind)
    while walk.More():
        out.append(TopoDS.Face(walk.Current()) if kind == TopAbs_FACE else walk.Current())
        walk.Next()
    return out


class _Known:
    """Names, colours and layers of a shape's faces, including those inherited from a shell or solid."""

    def __init__(self, leaf: Leaf) -> None:
        self._named: list[tuple[Any, tuple[str, str, str]]] = []
        self._faces = IndexedMap()
        self._own: dict[int, tuple[str, str, str]] = {}
        for shape, name, colour, layer in leaf.faces:
            is_face = shape.ShapeType() == TopAbs_FACE
            for face in _explored(shape, TopAbs_FACE):
                number = self._faces.Add(face)
                before = self._own.get(number, ("", "", ""))
                own = (name if is_face else "", colour, layer)
                # A face's own attributes override those of its shell.
                first, last = (own, before) if is_face else (before, own)
                self._own[number] = (first[0] or last[0], first[1] or last[1], first[2] or last[2])

    def of(self, face: Any) -> tuple[str, str, str]:
        return self._own.get(self._faces.FindIndex(face), ("", "", ""))


def _describe_faces(
    body: BodyRecord, known: list[_KnownFace], record: CadRecord, progress: Callable[[int], None]
) -> None:
    """Describe a body's faces."""
    for face, name, colour, layer in known:
        one = FaceRecord(name, colour, layer, reversed=face.Orientation() == TopAbs_REVERSED)
        body.faces.append(one)
        try:
            one.box = BRepTools.UVBounds_s(TopoDS.Face(face))
            one.area = _area(face)
            describe_surface(TopoDS.Face(face), one, _APPROXIMATED * record.deviation)
        except (RuntimeError, ValueError) as error:  # OCP raises C++ exceptions as RuntimeError
            one.surface = None
            message = str(error).splitlines()[0]
            record.notes.append(f"a face of {body.name!r} is taken from Open CASCADE's triangles: {message}")
        record.tolerance = max(record.tolerance, BRep_Tool.Tolerance_s(TopoDS.Face(face)))
        progress(len(body.faces))


def _area(face: Any) -> float:
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, found, 1e-4)
    return float(found.Mass())


def _matrix(place: Any) -> FloatArray:
    moved = place.Transformation()
    return np.array([[moved.Value(i, j) for j in range(1, 5)] for i in range(1, 4)])


def _box(leaves: list[Leaf]) -> FloatArray:
    box = Bnd_Box()
    for leaf in leaves:
        BRepBndLib.AddOptimal_s(leaf.shape.Moved(leaf.place), box, False, False)
    if box.IsVoid():
        return np.zeros((2, 3))
    return np.array([[of.X(), of.Y(), of.Z()] for of in (box.CornerMin(), box.CornerMax())])
