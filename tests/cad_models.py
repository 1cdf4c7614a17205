"""CAD models made for tests."""


def part():
    """A plate of 40 x 20 x 10 mm with a round hole of 8 mm, one long edge rounded by 3 mm."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    box = BRepPrimAPI_MakeBox(40, 20, 10).Shape()
    rounded = BRepFilletAPI_MakeFillet(box)
    rounded.Add(3.0, TopoDS.Edge(TopExp_Explorer(box, TopAbs_EDGE).Current()))
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(20, 10, -1), gp_Dir(0, 0, 1)), 4, 12).Shape()
    return BRepAlgoAPI_Cut(rounded.Shape(), hole).Shape()


def write_step(path, shapes, *, files=False):
    """Write an assembly of shapes: name, colour, shape, and where it stands; each in a file, if wanted."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_AsIs
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    whole = tool.NewShape()
    TDataStd_Name.Set_s(whole, TCollection_ExtendedString("assembly"))
    for name, colour, shape, places in shapes:
        label = tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        colours.SetColor(label, Quantity_Color(*colour, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        for k, place in enumerate(places):
            moved = gp_Trsf()
            moved.SetTranslation(gp_Vec(*place))
            component = tool.AddComponent(whole, label, TopLoc_Location(moved))
            TDataStd_Name.Set_s(component, TCollection_ExtendedString(f"{name} {k + 1}"))
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    writer.Transfer(document, STEPControl_AsIs, *([""] if files else []))
    writer.Write(str(path))
