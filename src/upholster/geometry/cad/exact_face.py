"""`ExactFace`: a face of a CAD model as a grid of rational Bézier patches, with the file's own parameters."""

from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.cad.spans import Axis, arc_axis, curve_segments, spline_segments
from upholster.geometry.occt.records import FaceRecord, SurfaceRecord
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.patch import RationalPatch

__all__ = ["ExactFace", "exact_face"]

_GAUSS = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])
"""Barycentric coordinates of three points whose mean integrates polynomials of degree 2 over a triangle."""


@dataclass(frozen=True, eq=False, slots=True)
class ExactFace:
    """A face's surface as a grid of patches.

    Attributes
    ----------
    face
        The patches: s increases with the file's u, t with v.
    u, v
        The file's parameters along them.
    """

    face: Face
    u: Axis
    v: Axis

    @property
    def patches(self) -> int:
        """Number of patches."""
        return self.face.rows * self.face.columns

    def frames(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points and unit normals at the file's parameters (n, 2), each (n, 3)."""
        return self.face.frames(self.u.places(uv[:, 0]), self.v.places(uv[:, 1]))

    def area(self, uv: FloatArray, triangles: IntArray) -> float:
        """Return the area of the surface over triangles of its parameters.

        Parameters
        ----------
        uv
            (n, 2), in the file's parameters.
        triangles
            (t, 3) indices into these.
        """
        corners = uv[triangles]
        inside = np.einsum("gc,tcd->tgd", _GAUSS, corners)
        u, v = inside[..., 0].ravel(), inside[..., 1].ravel()
        _, by_s, by_t = self.face.derivatives(self.u.places(u), self.v.places(v))
        element = np.linalg.norm(np.cross(by_s, by_t), axis=1) * self.u.rates(u) * self.v.rates(v)
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        flat = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
        return float((element.reshape(-1, 3).mean(axis=1) * flat).sum())


def exact_face(record: FaceRecord) -> ExactFace:
    """Convert a face's surface to rational Bézier patches, as many as its box needs.

    Raises
    ------
    InputError
        If it has no known surface, no extent, or weights that are not positive.
    """
    surface = record.surface
    if surface is None:
        raise InputError("its surface is of an unknown kind")
    u0, u1, v0, v1 = record.box
    if not (u1 > u0 and v1 > v0):
        raise InputError("it has no extent")
    builders = {"plane": _plane, "extrusion": _extrusion, "revolution": _revolution, "spline": _spline}
    nets, u, v = builders[surface.form](surface, u0, u1, v0, v1)
    return ExactFace(Face([[RationalPatch(net) for net in row] for row in nets]), u, v)


Built = tuple[FloatArray, Axis, Axis]
"""Nets (rows, columns, m + 1, n + 1, 4), and the parameters u and v along them."""


def _plane(surface: SurfaceRecord, u0: float, u1: float, v0: float, v1: float) -> Built:
    origin, x, y = surface.frame
    u, v = np.array([u0, u1]), np.array([v0, v1])
    net = np.ones((1, 1, 2, 2, 4))
    net[0, 0, ..., :3] = origin + u[:, None, None] * x + v[:, None] * y
    return net, Axis(u), Axis(v)


def _extrusion(surface: SurfaceRecord, u0: float, u1: float, v0: float, v1: float) -> Built:
    assert surface.curve is not None  # the record's own rule
    curve = curve_segments(surface.curve, u0, u1, surface.period[0])
    v = np.array([v0, v1])
    net = np.repeat(curve.points[:, None, :, None], 2, axis=3)
    net[..., :3] += net[..., 3:] * (v[:, None] * surface.frame[0])
    return net, curve.axis, Axis(v)


def _revolution(surface: SurfaceRecord, u0: float, u1: float, v0: float, v1: float) -> Built:
    """Revolve a curve around an axis: each of its control points becomes a circle's three."""
    assert surface.curve is not None  # the record's own rule
    curve = curve_segments(surface.curve, v0, v1, surface.period[1])
    u = arc_axis(u0, u1, surface.period[0])
    origin, axis = surface.frame[0], surface.frame[1] / np.linalg.norm(surface.frame[1])
    weight = curve.points[..., 3:]
    arm = curve.points[..., :3] - weight * origin
    along = (arm @ axis)[..., None] * axis
    radial = arm - along
    across = np.cross(axis, radial)
    fixed = np.concatenate([along + weight * origin, weight], axis=-1)
    rows = []
    for a, b in zip(u.breaks[:-1], u.breaks[1:], strict=True):
        columns = []
        for angle, share in ((a, 1.0), (0.5 * (a + b), np.cos(0.5 * (b - a))), (b, 1.0)):
            point = share * fixed
            point[..., :3] += np.cos(angle) * radial + np.sin(angle) * across
            columns.append(point)
        rows.append(np.stack(columns, axis=1))
    return np.stack(rows), u, curve.axis


def _spline(surface: SurfaceRecord, u0: float, u1: float, v0: float, v1: float) -> Built:
    m, n = surface.degrees
    rows, u = spline_segments(m, surface.knots_u, surface.net, u0, u1, surface.period[0])
    turned = np.moveaxis(rows, 2, 0)  # (nv, rows, m + 1, 4)
    both, v = spline_segments(n, surface.knots_v, turned, v0, v1, surface.period[1])
    return np.ascontiguousarray(both.transpose(2, 0, 3, 1, 4)), u, v
