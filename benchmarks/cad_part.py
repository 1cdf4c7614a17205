"""A part of about a thousand faces, made here: a rounded plate with pockets and stepped holes.

``python -m benchmarks.cad_part FILE.step [--pockets N]``: a pocket with rounded edges has 17 faces, and each
has two stepped holes of four faces beside it.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

__all__ = ["main", "write_part"]

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


def _rounded(shape: Any) -> Any:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    made = BRepFilletAPI_MakeFillet(shape)
    for edge in _explored(shape, TopAbs_EDGE):
        made.Add(_ROUND, TopoDS.Edge(edge))
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
