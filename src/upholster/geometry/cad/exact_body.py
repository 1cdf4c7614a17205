"""A body's vertices put on its exact faces, with the normals and the areas that these have."""

from dataclasses import dataclass

import numpy as np

from upholster.errors import InputError
from upholster.geometry.cad.exact_face import ExactFace, exact_face
from upholster.geometry.cad.slivers import without_slivers
from upholster.occt.records import BodyRecord, FaceRecord
from upholster.types import FloatArray, IntArray

__all__ = ["ExactBody", "exact_body"]

_MENDED = 0.5
"""Of the deviation, that triangles may move when slivers are mended."""

_MOST_OFF = 10.0
"""Of the deviation, by which Open CASCADE's vertices may miss our face: else it is taken as it has it."""


@dataclass(frozen=True, eq=False, slots=True)
class ExactBody:
    """What is exact of a body.

    Attributes
    ----------
    positions
        (V, 3) vertices: those inside faces lie on the patches, to rounding; those on edges where Open CASCADE
        has them, on the edge's own curve.
    normals
        For each face (n, 3): unit normals at its vertices, outward.
    triangles
        For each face (t, 3), as `FaceRecord.seen`, with as few slivers as can be.
    faces
        For each its patches; None where that failed.
    areas
        For each its area, in the unit of the file squared: over its triangles in parameters, on the patches.
    problems
        For each why it failed; empty where it did not.
    """

    positions: FloatArray
    normals: list[FloatArray]
    triangles: list[IntArray]
    faces: list[ExactFace | None]
    areas: list[float]
    problems: list[str]


def exact_body(body: BodyRecord, deviation: float) -> ExactBody:
    """Write a body's faces as patches and put its vertices on them.

    Parameters
    ----------
    body
        With triangles, or without.
    deviation
        How far triangles may lie from the faces, in the body's unit.
    """
    positions = body.positions.copy()
    out = ExactBody(positions, [], [], [], [], [])
    for record in body.faces:
        try:
            face = exact_face(record)
            points, normals = face.frames(record.uv)
            off = np.linalg.norm(points - body.positions[record.vertices], axis=1)
            if off.max(initial=0.0) > _MOST_OFF * deviation + record.approximated:
                raise InputError(f"its patches are {off.max():.3g} mm from where Open CASCADE has it")
        except InputError as error:
            out.faces.append(None)
            out.normals.append(_own_normals(record, body.positions))
            out.areas.append(_flat_area(record, body.positions))
            out.problems.append(str(error))
            continue
        inside = ~body.rim[record.vertices]
        positions[record.vertices[inside]] = points[inside]
        out.faces.append(face)
        out.normals.append(-normals if record.reversed else normals)
        out.areas.append(face.area(record.uv, record.triangles))
        out.problems.append("")
    for record, normals in zip(body.faces, out.normals, strict=True):
        out.triangles.append(
            without_slivers(positions[record.vertices], normals, record.uv, record.seen, _MENDED * deviation)
        )
    return out


def _crossed(record: FaceRecord, positions: FloatArray) -> FloatArray:
    a, b, c = positions[record.vertices][record.triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _flat_area(record: FaceRecord, positions: FloatArray) -> float:
    return float(0.5 * np.linalg.norm(_crossed(record, positions), axis=1).sum())


def _own_normals(record: FaceRecord, positions: FloatArray) -> FloatArray:
    """Return normals at a face's vertices from its triangles."""
    out = np.zeros((len(record.vertices), 3))
    np.add.at(out, record.triangles.ravel(), np.repeat(_crossed(record, positions), 3, axis=0))
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300), np.float64)
