"""STEP, IGES and BREP files as shapes, with the file's names, colours and layers."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepTools import BRepTools
from OCP.collections import Sequence_TCollection_AsciiString, Sequence_TDF_Label
from OCP.gp import gp_Trsf
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color
from OCP.StepBasic import StepBasic_ConversionBasedUnitAndLengthUnit, StepBasic_SiUnitAndLengthUnit
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape
from OCP.XCAFDoc import (
    XCAFDoc_ColorCurv,
    XCAFDoc_ColorGen,
    XCAFDoc_ColorSurf,
    XCAFDoc_DocumentTool,
    XCAFDoc_ShapeTool,
)

from upholster.base.errors import InputError
from upholster.base.formats import input_kind
from upholster.geometry.occt.named_files import NamedFiles, named_files
from upholster.geometry.occt.records import CadRecord

__all__ = ["Leaf", "UnreadableError", "read_shapes"]

_IGES_UNITS = {
    1: "inch",
    2: "millimetre",
    4: "foot",
    5: "mile",
    6: "metre",
    7: "kilometre",
    8: "mil",
    9: "micron",
    10: "centimetre",
    11: "microinch",
}
"""Units by the flag in an IGES file; 3 means the unit's name."""


_LISTED = 5

_NO_NAME = re.compile(
    r"=>\[[\d:]+\]|COMPOUND|(COMP)?SOLID|SHELL|FACE|WIRE|EDGE|VERTEX|\*DIT\d+|NAUO\d+|\d+|NONE"
)
"""Names that programs give where people gave none: Open CASCADE's, and numbers of placements."""


class UnreadableError(Exception):
    """The file cannot be read. Its text gives the reason as the end of a sentence about the file."""


@dataclass(eq=False)
class Leaf:
    """A shape at the end of an assembly: not an assembly itself.

    Attributes
    ----------
    name, colour, layer
        As in `upholster.geometry.occt.records.FaceRecord`.
    shape
        A ``TopoDS_Shape`` with its own location.
    place
        A ``TopLoc_Location``.
    faces
        Name, colour and layer of faces, each a ``TopoDS_Shape`` in the shape's own space.
    """

    name: str
    shape: Any
    place: Any
    colour: str = ""
    layer: str = ""
    faces: list[tuple[Any, str, str, str]] = field(default_factory=list)


def read_shapes(path: Path, unit: float | None) -> tuple[CadRecord, list[Leaf]]:
    """Read a file by its suffix, in millimetres.

    Parameters
    ----------
    path
        The file.
    unit
        Length of its unit in millimetres, if the file states none; by default 1.

    Raises
    ------
    UnreadableError
        If it cannot be read.
    """
    kind = input_kind(path.name)
    name = "" if kind is None else kind.name
    if name == "BREP":
        return _brep(path, unit)
    if name == "3DM":
        from upholster.geometry.occt.rhino import read_rhino

        return read_rhino(path, unit)
    if unit is not None:
        raise UnreadableError(
            "states its unit itself; leave out --unit: it is for .brep, and .3dm without one"
        )
    return _exchange(path, is_step=name == "STEP")


def _brep(path: Path, unit: float | None) -> tuple[CadRecord, list[Leaf]]:
    shape = TopoDS_Shape()
    if not BRepTools.Read_s(shape, str(path), BRep_Builder()) or shape.IsNull():
        raise UnreadableError("is not a BREP file that Open CASCADE can read")
    if unit is not None and unit != 1.0:
        larger = gp_Trsf()
        larger.SetScaleFactor(unit)
        shape = BRepBuilderAPI_Transform(shape, larger, True).Shape()
    known = "" if unit is None else f"{unit:g} mm"
    return CadRecord("BREP", known), [Leaf(path.stem, shape, TopLoc_Location())]


def _exchange(path: Path, *, is_step: bool) -> tuple[CadRecord, list[Leaf]]:
    """Read STEP or IGES: both produce a document of labelled shapes."""
    Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    reader = STEPCAFControl_Reader() if is_step else IGESCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    format_ = "STEP" if is_step else "IGES"
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise UnreadableError(f"is not a {format_} file that Open CASCADE can read")
    record = CadRecord(format_, _step_unit(reader) if is_step else _iges_unit(reader))
    known = _named_files(reader, path, record) if is_step else NamedFiles()
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    labels = _Labels(document)
    leaves = labels.leaves() if reader.Transfer(document) else []
    _note_missing(record, [name for name, product in known.missing.items() if product in labels.empty])
    if not any(TopExp_Explorer(leaf.shape, TopAbs_FACE).More() for leaf in leaves):
        leaves = _without_products(path, record) if is_step else []
    if not leaves:
        missing = "".join(f"; {note}" for note in record.notes)
        raise UnreadableError(f"has no shapes with faces{missing}; allowed: a model with some")
    return record, leaves if is_step else _as_one(path.stem, leaves)


def _named_files(reader: Any, path: Path, record: CadRecord) -> NamedFiles:
    """Return the other files that an assembly names, checked before they are opened."""
    try:
        known = named_files(reader.ChangeReader().WS(), path)
    except InputError as error:
        raise UnreadableError(str(error).removeprefix("it ")) from None
    record.files = list(dict.fromkeys(map(str, known.places.values())))
    return known


def _note_missing(record: CadRecord, names: list[str]) -> None:
    if names:
        listed = ", ".join(repr(name[:80]) for name in names[:_LISTED])
        more = " …" if len(names) > _LISTED else ""
        record.notes.append(
            f"parts are missing, because their files are not STEP files in the model's folder: {listed}{more}"
        )


def _without_products(path: Path, record: CadRecord) -> list[Leaf]:
    """Read the shapes of a STEP file whose products have none, without names and colours."""
    Interface_Static.SetIVal_s("read.step.product.mode", 0)
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    record.unit = record.unit or _first_unit(reader.WS().Model())
    shapes = [reader.Shape(k) for k in range(1, reader.NbShapes() + 1)]
    with_faces = [shape for shape in shapes if TopExp_Explorer(shape, TopAbs_FACE).More()]
    if with_faces:
        record.notes.append("no product has a shape: the shapes are read without names and colours")
    return [Leaf(path.stem, shape, TopLoc_Location()) for shape in with_faces]


def _first_unit(model: Any) -> str:
    """Return the first length unit among a STEP file's entities."""
    for k in range(1, model.NbEntities() + 1):
        one = model.Value(k)
        if isinstance(one, StepBasic_ConversionBasedUnitAndLengthUnit):
            return str(one.Name().ToCString()).lower()
        if isinstance(one, StepBasic_SiUnitAndLengthUnit):
            prefix = one.Prefix().name.removeprefix("StepBasic_sp").lower() if one.HasPrefix() else ""
            return f"{prefix}metre"
    return ""


def _as_one(name: str, leaves: list[Leaf]) -> list[Leaf]:
    """Combine the sheets of an IGES file: each of its faces may be a separate shape."""
    solids = [leaf for leaf in leaves if TopExp_Explorer(leaf.shape, TopAbs_SOLID).More()]
    sheets = [leaf for leaf in leaves if leaf not in solids]
    if len(sheets) < 2:
        return leaves
    builder = BRep_Builder()
    whole = TopoDS_Compound()
    builder.MakeCompound(whole)
    faces = []
    for leaf in sheets:
        moved = leaf.shape.Moved(leaf.place)
        builder.Add(whole, moved)
        faces.append((moved, leaf.name, leaf.colour, leaf.layer))
        faces += [(shape.Moved(leaf.place), *known) for shape, *known in leaf.faces]
    return [*solids, Leaf(name, whole, TopLoc_Location(), faces=faces)]


def _step_unit(reader: Any) -> str:
    lists = [Sequence_TCollection_AsciiString() for _ in range(3)]
    reader.ChangeReader().FileUnits(*lists)
    names = dict.fromkeys(lists[0].Value(k).ToCString().lower() for k in range(1, lists[0].Length() + 1))
    return ", ".join(names)


def _iges_unit(reader: Any) -> str:
    """Return the unit that Open CASCADE has read in an IGES file's global section."""
    section = reader.IGESModel().GlobalSection()
    if section.UnitFlag() in _IGES_UNITS:
        return _IGES_UNITS[section.UnitFlag()]
    return str(section.UnitName().ToCString()).lower() if section.HasUnitName() else ""


class _Names(NamedTuple):
    """A component's name, and those of the assembly above for parts without one: component's, product's."""

    component: str = ""
    above: tuple[str, str] = ("", "")


class _Labels:
    """The labelled shapes of a document, and the names of parts that have none."""

    def __init__(self, document: Any) -> None:
        self.empty: set[str] = set()
        self._shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self._colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
        self._layers = XCAFDoc_DocumentTool.LayerTool_s(document.Main())

    def leaves(self) -> list[Leaf]:
        found = Sequence_TDF_Label()
        self._shapes.GetFreeShapes(found)
        out: list[Leaf] = []
        for k in range(1, found.Length() + 1):
            self._walk(found.Value(k), TopLoc_Location(), _Names(), "", out)
        return out

    def _walk(self, label: Any, place: Any, names: "_Names", colour: str, out: list[Leaf]) -> None:
        """Descend an assembly; a component's name and colour override its product's."""
        if XCAFDoc_ShapeTool.IsReference_s(label):
            target = TDF_Label()
            XCAFDoc_ShapeTool.GetReferredShape_s(label, target)
            self._walk(
                target,
                place.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label)),
                _Names(_given_name(label) or names.component, names.above),
                self._colour(label) or colour,
                out,
            )
            return
        product = _given_name(label)
        if XCAFDoc_ShapeTool.IsAssembly_s(label):
            parts = Sequence_TDF_Label()
            XCAFDoc_ShapeTool.GetComponents_s(label, parts)
            above = (
                names.component or product or names.above[0],
                product or names.component or names.above[1],
            )
            for k in range(1, parts.Length() + 1):
                self._walk(parts.Value(k), place, _Names("", above), self._colour(label) or colour, out)
            return
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if shape.IsNull() or not TopExp_Explorer(shape, TopAbs_FACE).More():
            self.empty.add(_own_name(label))
        name = names.component or product or names.above[0] or _own_name(label)
        product = product or names.above[1]
        out.append(
            Leaf(
                name if not product or product == name else f"{name}\0{product}",
                shape,
                place,
                self._colour(label) or colour,
                self._layer(label),
                self._sub_shapes(label),
            )
        )

    def _sub_shapes(self, label: Any) -> list[tuple[Any, str, str, str]]:
        parts = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetSubShapes_s(label, parts)
        out = []
        for k in range(1, parts.Length() + 1):
            part = parts.Value(k)
            named = (_own_name(part), self._colour(part), self._layer(part))
            if any(named):
                out.append((XCAFDoc_ShapeTool.GetShape_s(part), *named))
        return out

    def _colour(self, label: Any) -> str:
        found = Quantity_Color()
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        for kind in (XCAFDoc_ColorSurf, XCAFDoc_ColorGen, XCAFDoc_ColorCurv):
            if self._colours.GetColor_s(label, kind, found) or (
                not shape.IsNull() and self._colours.GetColor(shape, kind, found)
            ):
                return str(Quantity_Color.ColorToHex_s(found).ToCString()).lower()
        return ""

    def _layer(self, label: Any) -> str:
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        found = None if shape.IsNull() else self._layers.GetLayers(label)
        return found.Value(1).ToExtString() if found is not None and found.Length() else ""


def _given_name(label: Any) -> str:
    """Return a label's name; empty if a program made it up."""
    name = _own_name(label)
    return "" if _NO_NAME.fullmatch(name) else name


def _own_name(label: Any) -> str:
    if not label.IsAttribute(TDataStd_Name.GetID_s()):  # checked first: without one OCP crashes
        return ""
    found = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), found)
    return " ".join(found.Get().ToExtString().split())
