"""Placing a body's vertices on its exact faces, and the exact normals and areas."""

from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.geometry.cad.exact_face import ExactFace, exact_face
from upholster.geometry.cad.slivers import without_slivers
from upholster.geometry.occt.records import BodyRecord, FaceRecord

__all__ = ["ExactBody", "exact_body"]

_MENDED = 0.5
"""Share of the deviation by which triangles may move when slivers are repaired."""

_MOST_OFF = 10.0
"""Multiple of the deviation by which Open CASCADE's vertices may miss our face; beyond it, its triangles are
used."""


@dataclass(frozen=True, eq=False, slots=True)
class ExactBody:
    """The exact geometry of a body.

    Attributes
    ----------
    positions
        (V, 3) vertices. Those inside faces are on the patches, up to rounding; those on edges are where Open
        CASCADE places them, on the edge's own curve.
    normals
        For each face (n, 3): unit normals at its vertices, outward.
    triangles
        For each face (t, 3), as `FaceRecord.seen`, with as few slivers as possible.
    faces
        For each face its patches; None where that failed.
    areas
        For each face its area, in the file's unit squared: over its triangles in parameters, on the patches.
    problems
        For each face why it failed; empty if it did not.
    """

    positions: FloatArray
    normals: list[FloatArray]
    triangles: list[IntArray]
    faces: list[ExactFace | None]
    areas: list[float]
    problems: list[str]


def exact_body(body: BodyRecord, deviation: float) -> ExactBody:
    """Convert a body's faces to patches and place its vertices on them.

    Parameters
    ----------
    body
        With or without triangles.
    deviation
        Greatest distance of triangles from the faces, in the body's unit.
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
    """Compute normals at a face's vertices from its triangles."""
    out = np.zeros((len(record.vertices), 3))
    np.add.at(out, record.triangles.ravel(), np.repeat(_crossed(record, positions), 3, axis=0))
    return unit_vectors(out)
