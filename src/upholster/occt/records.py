"""What the process that reads a CAD file tells: plain data, which no package but NumPy is needed for."""

from dataclasses import dataclass, field

import numpy as np

from upholster.types import FloatArray, IntArray

__all__ = ["BodyRecord", "CadRecord", "CurveRecord", "FaceRecord", "Placed", "SurfaceRecord"]


@dataclass(eq=False)
class CurveRecord:
    """A curve in space.

    Attributes
    ----------
    kind
        "line", "arc" or "spline".
    poles
        Of a line (2, 4): its point at parameter 0 and its direction, weights 1 and 0. Of an arc (3, 4):
        centre (weight 1) and the two half axes (weight 0), ``centre + cos v · first + sin v · second``. Of a
        spline (n, 4): homogeneous control points.
    degree, knots
        Of a spline: the knots with their multiplicities, ``n + degree + 1`` of them.
    """

    kind: str
    poles: FloatArray
    degree: int = 1
    knots: FloatArray = field(default_factory=lambda: np.zeros(0))


@dataclass(eq=False)
class SurfaceRecord:
    """The surface that a face lies on, in one of four forms.

    Attributes
    ----------
    form
        "plane", "revolution" (u is the angle), "extrusion" (v is the length) or "spline".
    frame
        Of a plane (3, 3): origin, and the vectors of u and v. Of a revolution (2, 3): a point of the axis and
        its direction. Of an extrusion (1, 3): its direction.
    curve
        What is turned (by v) or moved (by u).
    degrees, knots_u, knots_v, net
        Of a spline: net (nu, nv, 4), homogeneous.
    period
        Of u and v, 0 where there is none.
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
        As the file has them, empty where it has none; a colour as "#c08040".
    kind
        What a designer calls its surface: "plane", "cylinder", "cone", "sphere", "torus", "revolution",
        "extrusion", "spline", "offset", "other".
    box
        Least and greatest u, least and greatest v.
    area
        By Open CASCADE, in square millimetres.
    reversed
        Whether its outside is where the surface's normal does not point.
    surface
        None where it could not be told.
    axis
        (2, 3) a point and the direction of its axis, where the surface has one.
    approximated
        How far the surface given here may lie from the file's own, in millimetres; 0 where it is the same.
    vertices, uv
        (n,) its vertices' numbers in the body, and (n, 2) their parameters.
    triangles
        (t, 3) into these, counter-clockwise seen from outside. They cover the face in its parameters; at
        poles some are lines in space.
    plain
        Why it is left plain; empty where it is not.
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
        """Those of the triangles that have three different vertices."""
        a, b, c = self.vertices[self.triangles].T
        seen: IntArray = self.triangles[(a != b) & (b != c) & (c != a)]
        return seen


@dataclass(eq=False)
class Placed:
    """Where a body stands: the name of that place, and the (3, 4) matrix to the model, in millimetres."""

    name: str
    matrix: FloatArray


@dataclass(eq=False)
class BodyRecord:
    """A shape, once, and where it stands.

    Attributes
    ----------
    name, colour, layer
        As of `FaceRecord`.
    solid
        Whether it is a solid; else a sheet.
    faces
        All of them.
    places
        At least one.
    positions
        (V, 3) vertices of its triangles, in millimetres, in the body's own space.
    rim
        (V,) bool: vertices that lie on edges of faces.
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
    """What a file holds; lengths in millimetres.

    Attributes
    ----------
    format
        "STEP", "IGES", "BREP" or "3DM", with the schema where the file tells.
    unit
        The file's own unit, as "mm", "inch"; empty where it tells none.
    tolerance
        Largest tolerance of its edges and vertices.
    deviation
        How far triangles may lie from their faces.
    box
        Least and greatest coordinates, (2, 3).
    notes
        What the user should know.
    """

    format: str
    unit: str = ""
    tolerance: float = 0.0
    deviation: float = 0.0
    box: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    bodies: list[BodyRecord] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
