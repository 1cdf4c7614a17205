"""The result of the process that reads a CAD file: plain data that needs no package but NumPy."""

from dataclasses import dataclass, field

import numpy as np

from upholster.base.types import FloatArray, IntArray

__all__ = ["BodyRecord", "CadRecord", "CurveRecord", "FaceRecord", "Placed", "SurfaceRecord"]


@dataclass(eq=False)
class CurveRecord:
    """A curve in space.

    Attributes
    ----------
    kind
        "line", "arc" or "spline".
    poles
        For a line (2, 4): its point at parameter 0 and its direction, weights 1 and 0. For an arc (3, 4):
        centre (weight 1) and the two half axes (weight 0), ``centre + cos v · first + sin v · second``. For a
        spline (n, 4): homogeneous control points.
    degree, knots
        For a spline: ``n + degree + 1`` knots, repeated by multiplicity.
    """

    kind: str
    poles: FloatArray
    degree: int = 1
    knots: FloatArray = field(default_factory=lambda: np.zeros(0))


@dataclass(eq=False)
class SurfaceRecord:
    """The surface under a face, in one of four forms.

    Attributes
    ----------
    form
        "plane", "revolution" (u is the angle), "extrusion" (v is the length) or "spline".
    frame
        For a plane (3, 3): origin, and the vectors of u and v. For a revolution (2, 3): a point of the axis
        and its direction. For an extrusion (1, 3): its direction.
    curve
        The curve that is revolved (it has parameter v) or extruded (parameter u).
    degrees, knots_u, knots_v, net
        For a spline: net (nu, nv, 4), homogeneous.
    period
        Periods of u and v, 0 if not periodic.
    """

    form: str
    frame: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    curve: CurveRecord | None = None
    degrees: tuple[int, int] = (1, 1)
    knots_u: FloatArray = field(default_factory=lambda: np.zeros(0))
    knots_v: FloatArray = field(default_factory=lambda: np.zeros(0))
    net: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 4)))
    period: tuple[float, float] = (0.0, 0.0)


@dataclass(eq=False)
class FaceRecord:
    """A face of a body.

    Attributes
    ----------
    name, colour, layer
        As in the file, empty if it has none; a colour as "#c08040".
    kind
        A designer's name for its surface: "plane", "cylinder", "cone", "sphere", "torus", "revolution",
        "extrusion", "spline", "offset", "other".
    box
        Least and greatest u, least and greatest v.
    area
        From Open CASCADE, in square millimetres.
    reversed
        Whether its outside is opposite to the surface's normal.
    surface
        None if it could not be determined.
    axis
        (2, 3) a point and the direction of its axis, if the surface has one.
    approximated
        Greatest distance of the recorded surface from the file's own, in millimetres; 0 if they are the same.
    vertices, uv
        (n,) its vertices' numbers in the body, and (n, 2) their parameters.
    triangles
        (t, 3) indices into these, counter-clockwise seen from outside. They cover the face in its parameters;
        at poles some are degenerate in space.
    plain
        Why it is left plain; empty if it is not.
    """

    name: str = ""
    colour: str = ""
    layer: str = ""
    kind: str = "other"
    box: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    area: float = 0.0
    reversed: bool = False
    surface: SurfaceRecord | None = None
    axis: FloatArray | None = None
    approximated: float = 0.0
    vertices: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))
    uv: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    plain: str = ""

    @property
    def seen(self) -> IntArray:
        """The triangles with three different vertices."""
        a, b, c = self.vertices[self.triangles].T
        seen: IntArray = self.triangles[(a != b) & (b != c) & (c != a)]
        return seen


@dataclass(eq=False)
class Placed:
    """A placement of a body: its name, and the (3, 4) matrix to the model, in millimetres."""

    name: str
    matrix: FloatArray


@dataclass(eq=False)
class BodyRecord:
    """A shape, once, with its placements.

    Attributes
    ----------
    name, colour, layer
        As in `FaceRecord`.
    solid
        Whether it is a solid; else a sheet.
    faces
        All its faces.
    places
        Its placements, at least one.
    positions
        (V, 3) vertices of its triangles, in millimetres, in the body's own space.
    rim
        (V,) bool: whether each vertex is on an edge of a face.
    """

    name: str
    colour: str = ""
    layer: str = ""
    solid: bool = True
    faces: list[FaceRecord] = field(default_factory=list)
    places: list[Placed] = field(default_factory=list)
    positions: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    rim: IntArray = field(default_factory=lambda: np.zeros(0, bool))


@dataclass(eq=False)
class CadRecord:
    """The contents of a file; lengths in millimetres.

    Attributes
    ----------
    format
        "STEP", "IGES", "BREP" or "3DM", with the schema if the file states it.
    unit
        The file's own unit, as "mm", "inch"; empty if it states none.
    tolerance
        Largest tolerance of its edges and vertices.
    deviation
        Greatest distance of triangles from their faces.
    box
        Least and greatest coordinates, (2, 3).
    bodies
        The file's bodies, in its order.
    notes
        What the user should know.
    files
        The other files that it names, in its folder; there may be none at a place.
    """

    format: str
    unit: str = ""
    tolerance: float = 0.0
    deviation: float = 0.0
    box: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    bodies: list[BodyRecord] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
