"""The surface of a face, recorded so that it can be converted exactly to rational Bézier patches."""

from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BezierSurface,
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Line,
    Geom_OffsetSurface,
    Geom_Plane,
    Geom_RectangularTrimmedSurface,
    Geom_SphericalSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_ToroidalSurface,
    Geom_TrimmedCurve,
)
from OCP.GeomAbs import GeomAbs_C1
from OCP.GeomConvert import GeomConvert, GeomConvert_ApproxCurve, GeomConvert_ApproxSurface

from upholster.base.types import FloatArray
from upholster.geometry.occt.records import CurveRecord, FaceRecord, SurfaceRecord

__all__ = ["describe_surface"]

_KINDS = (
    (Geom_Plane, "plane"),
    (Geom_CylindricalSurface, "cylinder"),
    (Geom_ConicalSurface, "cone"),
    (Geom_SphericalSurface, "sphere"),
    (Geom_ToroidalSurface, "torus"),
    (Geom_SurfaceOfRevolution, "revolution"),
    (Geom_SurfaceOfLinearExtrusion, "extrusion"),
    (Geom_BSplineSurface, "spline"),
    (Geom_BezierSurface, "spline"),
    (Geom_OffsetSurface, "offset"),
)
_SEGMENTS, _DEGREE = 200, 8
"""Limits of approximations."""


def describe_surface(face: Any, record: FaceRecord, tolerance: float) -> None:
    """Determine kind, axis and surface of a face.

    Parameters
    ----------
    face
        A ``TopoDS_Face``.
    record
        Its box is known; this fills in the rest.
    tolerance
        Greatest error, in millimetres, of the approximation of a non-rational surface.
    """
    surface = BRep_Tool.Surface_s(face)
    while isinstance(surface, Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    record.kind = next((name for known, name in _KINDS if isinstance(surface, known)), "other")
    if isinstance(surface, Geom_OffsetSurface) and surface.Surface() is not None:
        surface = surface.Surface()  # offsets of planes, cylinders etc. have the same kind
    record.axis = _axis(surface)
    record.surface, record.approximated = _surface(surface, record.box, tolerance)


def _surface(
    surface: Any, box: tuple[float, float, float, float], tolerance: float
) -> tuple[SurfaceRecord, float]:
    """Return a surface's record, and its distance from the surface."""
    if isinstance(surface, Geom_Plane):
        place = surface.Position()
        frame = [_xyz(place.Location()), _xyz(place.XDirection()), _xyz(place.YDirection())]
        return SurfaceRecord("plane", np.array(frame)), 0.0
    if isinstance(surface, Geom_BezierSurface):
        surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
    if isinstance(surface, Geom_BSplineSurface):
        return _spline(surface), 0.0
    if isinstance(surface, Geom_SurfaceOfLinearExtrusion):
        curve, error = _curve(surface.BasisCurve(), box[:2], tolerance)
        frame = [_xyz(surface.Direction())]
        return SurfaceRecord(
            "extrusion", np.array(frame), curve, period=(_period(surface.BasisCurve()), 0.0)
        ), error
    if isinstance(surface, Geom_SurfaceOfRevolution):
        axis = surface.Axis()
        curve, error = _curve(surface.BasisCurve(), box[2:], tolerance)
        # Its v is the curve's parameter; its u is the angle of revolution.
        return _turned(axis, curve, _period(surface.BasisCurve())), error
    if isinstance(
        surface, (Geom_CylindricalSurface, Geom_ConicalSurface, Geom_SphericalSurface, Geom_ToroidalSurface)
    ):
        # The curve at u = 0, revolved around the axis in the direction of u, as all these frames are
        # right-handed or mirrored together with their axis.
        meridian = surface.UIso(0.0)
        axis = surface.Axis() if surface.Position().Direct() else surface.Axis().Reversed()
        curve, error = _curve(meridian, box[2:], tolerance)
        return _turned(axis, curve, _period(meridian)), error
    found = GeomConvert_ApproxSurface(
        Geom_RectangularTrimmedSurface(surface, *box, True, True),
        tolerance, GeomAbs_C1, GeomAbs_C1, _DEGREE, _DEGREE, _SEGMENTS, 0,
    )  # fmt: skip
    if not found.HasResult():
        raise ValueError("no rational surface is near enough")
    return _spline(found.Surface()), max(found.MaxError(), 1e-300)


def _turned(axis: Any, curve: CurveRecord, period: float) -> SurfaceRecord:
    frame = np.array([_xyz(axis.Location()), _xyz(axis.Direction())])
    return SurfaceRecord("revolution", frame, curve, period=(2 * np.pi, period))


def _curve(curve: Any, box: tuple[float, float], tolerance: float) -> tuple[CurveRecord, float]:
    """Return a curve's record, and its distance from the curve."""
    while isinstance(curve, Geom_TrimmedCurve):
        curve = curve.BasisCurve()
    if isinstance(curve, Geom_Line):
        line = curve.Position()
        poles = [[*_xyz(line.Location()), 1.0], [*_xyz(line.Direction()), 0.0]]
        return CurveRecord("line", np.array(poles)), 0.0
    if isinstance(curve, (Geom_Circle, Geom_Ellipse)):
        place = curve.Position()
        round_ = isinstance(curve, Geom_Circle)
        sizes = (curve.Radius(),) * 2 if round_ else (curve.MajorRadius(), curve.MinorRadius())
        axes = [
            [*(size * np.array(_xyz(way))), 0.0]
            for size, way in zip(sizes, (place.XDirection(), place.YDirection()), strict=True)
        ]
        return CurveRecord("arc", np.array([[*_xyz(place.Location()), 1.0], *axes])), 0.0
    error = 0.0
    if isinstance(curve, Geom_BezierCurve):
        curve = GeomConvert.CurveToBSplineCurve_s(curve)
    elif not isinstance(curve, Geom_BSplineCurve):
        found = GeomConvert_ApproxCurve(
            Geom_TrimmedCurve(curve, *box), tolerance, GeomAbs_C1, _SEGMENTS, _DEGREE
        )
        if not found.HasResult():
            raise ValueError("no rational curve is near enough")
        curve, error = found.Curve(), max(found.MaxError(), 1e-300)
    if curve.IsPeriodic():
        curve = curve.Copy()
        curve.SetNotPeriodic()
    poles = [[*_weighted(curve.Pole(i), curve.Weight(i))] for i in range(1, curve.NbPoles() + 1)]
    return CurveRecord("spline", np.array(poles), curve.Degree(), _numbers(curve.KnotSequence())), error


def _spline(surface: Any) -> SurfaceRecord:
    first, last, low, high = surface.Bounds()
    period = (last - first if surface.IsUPeriodic() else 0.0, high - low if surface.IsVPeriodic() else 0.0)
    if any(period):
        surface = surface.Copy()
        if surface.IsUPeriodic():
            surface.SetUNotPeriodic()
        if surface.IsVPeriodic():
            surface.SetVNotPeriodic()
    net = [
        [_weighted(surface.Pole(i, j), surface.Weight(i, j)) for j in range(1, surface.NbVPoles() + 1)]
        for i in range(1, surface.NbUPoles() + 1)
    ]
    return SurfaceRecord(
        "spline",
        degrees=(surface.UDegree(), surface.VDegree()),
        knots_u=_numbers(surface.UKnotSequence()),
        knots_v=_numbers(surface.VKnotSequence()),
        net=np.array(net),
        period=period,
    )


def _axis(surface: Any) -> FloatArray | None:
    """Return a point and the direction of a surface's axis."""
    if isinstance(surface, Geom_SurfaceOfLinearExtrusion):
        return None
    known = (Geom_CylindricalSurface, Geom_ConicalSurface, Geom_ToroidalSurface, Geom_SurfaceOfRevolution)
    if not isinstance(surface, known):
        return None
    axis = surface.Axis()
    return np.array([_xyz(axis.Location()), _xyz(axis.Direction())])


def _period(curve: Any) -> float:
    return float(curve.Period()) if curve.IsPeriodic() else 0.0


def _weighted(point: Any, weight: float) -> tuple[float, float, float, float]:
    x, y, z = _xyz(point)
    return x * weight, y * weight, z * weight, weight


def _xyz(of: Any) -> tuple[float, float, float]:
    return of.X(), of.Y(), of.Z()


def _numbers(array: Any) -> FloatArray:
    return np.array(list(array), np.float64)
