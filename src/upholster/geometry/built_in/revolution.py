"""Surfaces of revolution from any rational profile: ellipsoid, cylinder, cone, vase."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.built_in.circle import circle_arcs, unit_circle
from upholster.geometry.built_in.parameter_checks import check_length, check_spans
from upholster.geometry.patches.bernstein import elevate_axis
from upholster.geometry.patches.face import Face, grid_face
from upholster.geometry.patches.patch import MAX_DEGREE, RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["cone", "cylinder", "ellipsoid", "half_circle", "revolve", "vase"]

Profile = Sequence[ArrayLike]


def revolve(profile: Profile, *, spans: int = 4) -> Surface:
    """Revolve a profile round the z axis.

    Rows follow the profile, columns run counter-clockwise seen from above: with the profile running downward
    on the outside, normals point outward. Where the profile touches the axis the patches' edges are
    degenerate.

    Parameters
    ----------
    profile
        Rational Bézier curves, end to end, from the top: arrays (k, 3) of homogeneous control points ``(w·r,
        w·z, w)``, r ≥ 0 the distance from the axis and z the height in the model's units, degree 1 to 32.
    spans
        Patches round the axis: 3 to 256.

    Returns
    -------
    Surface
        One face of ``len(profile)`` rows and `spans` columns.

    Raises
    ------
    InputError
        If a curve or the spans are out of range, or a curve does not begin where the previous one ends.

    References
    ----------
    L. Piegl and W. Tiller, *The NURBS Book*, 2nd edition, section 8.5.
    """
    spans = check_spans("spans", spans, least=3)
    curves = _checked(profile)
    arcs = circle_arcs(spans)
    patches = []
    for curve in curves:
        radius, height, weight = curve.T[:, :, None]
        for arc in arcs:
            x, y, w = arc.T
            net = np.stack([radius * x, radius * y, height * w, weight * w], axis=-1)
            patches.append(RationalPatch(net))
    return Surface([grid_face(patches, spans)], "revolution")


def half_circle(r: float = 1.0) -> list[FloatArray]:
    """Return the half circle of radius r from top to bottom, in two arcs, as a profile."""
    table = unit_circle(8)[:5]  # angle from the top: (cos, sin) is (height, radius)
    middle = table[1, 0]
    points = np.stack([r * table[:, 1], r * table[:, 0], [1.0, middle, 1.0, middle, 1.0]], axis=1)
    return [points[:3], points[2:]]


def ellipsoid(rx: float = 1.5, ry: float = 1.0, rz: float = 0.75) -> Surface:
    """Build the ellipsoid: a revolved half circle, stretched; 8 patches, degenerate at the poles.

    Parameters
    ----------
    rx, ry, rz
        Half axes, in the model's units: 1e-9 to 1e9.

    Raises
    ------
    InputError
        If a half axis is outside its range.
    """
    scale = [check_length("rx", rx), check_length("ry", ry), check_length("rz", rz), 1.0]
    (ball,) = revolve(half_circle()).faces
    face = Face([[RationalPatch(patch.net * scale) for patch in row] for row in ball.patches])
    return Surface.built_in("ellipsoid", [face], rx=scale[0], ry=scale[1], rz=scale[2])


def cylinder(r: float = 1.0, h: float = 2.0, *, spans: int = 4) -> Surface:
    """Build the wall of a cylinder round the z axis, from z = h/2 down to z = −h/2, open at both ends.

    Parameters
    ----------
    r, h
        Radius and height, in the model's units: 1e-9 to 1e9.
    spans
        Patches round the axis: 3 to 256.

    Raises
    ------
    InputError
        If a parameter is outside its range.
    """
    r, h = check_length("r", r), check_length("h", h)
    round_ = revolve([[(r, h / 2, 1), (r, -h / 2, 1)]], spans=spans)
    return Surface.built_in("cylinder", round_.faces, r=r, h=h, spans=spans)


def cone(r1: float = 1.0, r2: float = 0.4, h: float = 1.5, *, spans: int = 4) -> Surface:
    """Build the wall of a cone frustum round the z axis, from z = h/2 down to z = −h/2, open at both ends.

    Parameters
    ----------
    r1
        Radius at the bottom, in the model's units: 1e-9 to 1e9.
    r2
        Radius at the top, in the model's units; 0 gives the cone with its apex, a degenerate edge.
    h
        Height, in the model's units: 1e-9 to 1e9.
    spans
        Patches round the axis: 3 to 256.

    Raises
    ------
    InputError
        If a parameter is outside its range.
    """
    r1, r2, h = check_length("r1", r1), check_length("r2", r2, zero=True), check_length("h", h)
    round_ = revolve([[(r2, h / 2, 1), (r1, -h / 2, 1)]], spans=spans)
    return Surface.built_in("cone", round_.faces, r1=r1, r2=r2, h=h, spans=spans)


VASE_OUTER = (
    # (radius, height) of cubic control points, lip to foot; the curves join with one tangent
    ((0.52, 1.000), (0.58, 1.000), (0.56, 0.965), (0.50, 0.930)),
    ((0.50, 0.930), (0.38, 0.860), (0.34, 0.800), (0.44, 0.720)),
    ((0.44, 0.720), (0.59, 0.600), (1.00, 0.640), (1.00, 0.470)),
    ((1.00, 0.470), (1.00, 0.270), (0.50, 0.180), (0.46, 0.060)),
    ((0.46, 0.060), (0.445, 0.015), (0.46, 0.000), (0.40, 0.000)),
)
VASE_BASE = ((0.40, 0.000), (0.0, 0.000))
VASE_INNER = (
    ((0.0, 0.120), (0.36, 0.120), (0.90, 0.300), (0.90, 0.470)),
    ((0.90, 0.470), (0.90, 0.620), (0.50, 0.560), (0.36, 0.720)),
    ((0.36, 0.720), (0.27, 0.8228571428571428), (0.34, 0.870), (0.42, 0.930)),
    ((0.42, 0.930), (0.48, 0.975), (0.48, 1.000), (0.52, 1.000)),
)


def vase(radius: float = 0.8, height: float = 2.4, *, spans: int = 4) -> Surface:
    """Build a vase round the z axis, from z = height/2 to −height/2: a closed solid, inside and outside.

    The profile is cubic and has one tangent throughout: inner bottom, up the inner wall, over the lip, down
    the outer wall, and the base. Rows run downward on the outside.

    Parameters
    ----------
    radius
        Of the belly, outside, in the model's units: 1e-9 to 1e9.
    height
        In the model's units: 1e-9 to 1e9.
    spans
        Patches round the axis: 3 to 256.

    Raises
    ------
    InputError
        If a parameter is outside its range.
    """
    radius, height = check_length("radius", radius), check_length("height", height)
    base = elevate_axis(np.array(VASE_BASE), 3)
    profile = []
    for curve in (*VASE_INNER, *VASE_OUTER, base):
        points = np.asarray(curve, dtype=np.float64)
        profile.append(np.stack([points[:, 0] * radius, (points[:, 1] - 0.5) * height, np.ones(4)], axis=1))
    faces = revolve(profile, spans=spans).faces
    return Surface.built_in("vase", faces, radius=radius, height=height, spans=spans)


def _checked(profile: Profile) -> list[FloatArray]:
    """Return the profile's curves as arrays (k, 3), checked."""
    if not isinstance(profile, Sequence) and not getattr(profile, "ndim", 0):
        raise InputError(f"profile is a {type(profile).__name__}; allowed: a list of curves, arrays (k, 3)")
    curves: list[FloatArray] = []
    for k, given in enumerate(profile):
        try:
            curve = np.array(given, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"curve {k} of the profile must be an array of numbers (k, 3): {error}"
            ) from None
        if curve.ndim != 2 or curve.shape[1] != 3 or not 2 <= len(curve) <= MAX_DEGREE + 1:
            raise InputError(
                f"curve {k} of the profile has shape {curve.shape}; "
                f"allowed: (k, 3), k from 2 to {MAX_DEGREE + 1}"
            )
        for i, (radius, height, weight) in enumerate(curve.tolist()):
            if not (0.0 <= radius < np.inf and abs(height) < np.inf and 0.0 < weight < np.inf):
                raise InputError(
                    f"control point [{i}] of the profile's curve {k} is ({radius:g}, {height:g}, {weight:g})"
                    "; allowed: homogeneous, finite numbers, radius >= 0, weight > 0"
                )
        if curves:
            end, begin = curves[-1][-1, :2] / curves[-1][-1, 2], curve[0, :2] / curve[0, 2]
            if np.abs(end - begin).max() > 1e-9 * max(np.abs(end).max(), np.abs(begin).max()):
                raise InputError(
                    f"curve {k} of the profile begins at ({begin[0]:g}, {begin[1]:g}); "
                    f"allowed: where curve {k - 1} ends, ({end[0]:g}, {end[1]:g})"
                )
        curves.append(curve)
    if not curves:
        raise InputError("the profile has no curves; allowed: one or more")
    return curves
