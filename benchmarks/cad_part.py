"""CAD parts made here: one of about a thousand faces, a plate with pockets and stepped holes; and others.

``python -m benchmarks.cad_part FILE.step [--pockets N]``: a pocket with rounded edges has 17 faces, and each
has two stepped holes of four faces beside it.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

__all__ = ["knob", "main", "rounded_part", "t_handle", "write_assembly", "write_part"]

_PITCH, _THICK, _ROUND = 20.0, 12.0, 1.5


def write_part(path: Path, pockets: int) -> int:
    """Write a plate of ``pockets`` cells as STEP; return how many faces it has."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopAbs import TopAbs_FACE

    wide = max(1, round(pockets**0.5))
    rows = -(-pockets // wide)
    plate = _rounded(BRepPrimAPI_MakeBox(wide * _PITCH, rows * _PITCH, _THICK).Shape())
    tools = []
    for k in range(pockets):
        x, y = _PITCH * (k % wide), _PITCH * (k // wide)
        tools += [_pocket(x + 8, y + 10), _hole(x + 16.5, y + 5), _hole(x + 16.5, y + 15)]
    part = BRepAlgoAPI_Cut(plate, _together(tools)).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(part, STEPControl_AsIs)
    writer.Write(str(path))
    return len(_explored(part, TopAbs_FACE))


def knob() -> dict[str, Any]:
    """Return a thick cylinder on a thin one."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    up = gp_Dir(0, 0, 1)
    head = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 16), up), 13, 18).Shape()
    shaft = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 0), up), 5, 16).Shape()
    return {"Knob": _rounded(head), "Shaft": shaft}


def rounded_part() -> dict[str, Any]:
    """Return a plate with a block on it and a hole, all edges rounded."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    up = gp_Dir(0, 0, 1)
    block = BRepPrimAPI_MakeBox(gp_Pnt(8, 9, 5), gp_Pnt(28, 31, 32)).Shape()
    base = BRepAlgoAPI_Fuse(BRepPrimAPI_MakeBox(60, 40, 14).Shape(), block).Shape()
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(44, 20, -1), up), 8, 40).Shape()
    return {"Part": _rounded(BRepAlgoAPI_Cut(base, hole).Shape(), 2.5)}


def t_handle() -> dict[str, Any]:
    """Return an upright rod, one across it, and a plate below that is long the third way."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    rod = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 6, 44).Shape()
    bar = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-32, 0, 50), gp_Dir(1, 0, 0)), 6, 64).Shape()
    plate = BRepPrimAPI_MakeBox(gp_Pnt(-14, -36, -8), gp_Pnt(14, 36, 0)).Shape()
    return {"Rod": _rounded(rod), "Bar": _rounded(bar), "Plate": _rounded(plate)}


def write_assembly(path: Path, bodies: Mapping[str, Any]) -> None:
    """Write bodies by name as one STEP file."""
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for name, shape in bodies.items():
        TDataStd_Name.Set_s(tool.AddShape(shape, False), TCollection_ExtendedString(name))
    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    writer.Write(str(path))


def _rounded(shape: Any, by: float = _ROUND) -> Any:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    made = BRepFilletAPI_MakeFillet(shape)
    for edge in _explored(shape, TopAbs_EDGE):
        made.Add(by, TopoDS.Edge(edge))
    return made.Shape()


def _pocket(x: float, y: float) -> Any:
    """Return what to cut out: a block with all edges rounded that stands out above the plate."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    return _rounded(BRepPrimAPI_MakeBox(gp_Pnt(x - 4, y - 6, 5), gp_Pnt(x + 4, y + 6, 20)).Shape())


def _hole(x: float, y: float) -> Any:
    """Return a hole in steps: a cone below, cylinders of two widths with a flat step between them."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    up = gp_Dir(0, 0, 1)
    low = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, -1), up), 1.2, 14).Shape()
    high = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, 7), up), 2.2, 6).Shape()
    cone = BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(x, y, -1), up), 3.2, 1.2, 2).Shape()
    return BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(low, high).Shape(), cone).Shape()


def _together(shapes: Sequence[Any]) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    whole, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def _explored(shape: Any, kind: Any) -> list[Any]:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as IndexedMap
    from OCP.TopExp import TopExp

    found = IndexedMap()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k) for k in range(1, found.Extent() + 1)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cad_part", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--pockets", type=int, default=40)
    asked = parser.parse_args(arguments)
    print(write_part(asked.file, asked.pockets), "faces")


if __name__ == "__main__":
    main()
