"""A base: a coarse mesh of the whole surface, shown until the surface itself has arrived (SPEC.md, 2.1).

It has positions and triangles alone. The exemplar is projected on it from the six sides of a box.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.base.types import FloatArray, IntArray
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.codec.stream.mesh.mesh_code import (
    MAX_TRIANGLES,
    TRIANGLES_A_BYTE,
    pack_triangles,
    parse_triangles,
)
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import ANGLES, MOST_OCTAVES, OCTAVE, WarpField

__all__ = [
    "MOST_BASES",
    "MOST_BITS",
    "SIDES",
    "Base",
    "CoarseMesh",
    "pack_base",
    "parse_base",
    "side_places",
    "sides_of",
]

MOST_BASES = 4

SIDES = 6
"""Sides of the box: +x −x +y −y +z −z."""

MOST_BITS = 16
_MOST_STEPS = 512
"""Steps of a chart, each way, without its margins."""

_MARGIN = 8
"""Steps by which a chart extends beyond its triangles, each way, for filtering."""

_MOST_PIXELS = 2.0**24
"""Largest number of the exemplar's pixels in a step of positions."""

# Axis and sign of s, then of t, per side: seen from outside with z up (on ±z with y up), s runs down.
_AXES = np.array([[2, 1], [2, 1], [2, 0], [2, 0], [1, 0], [1, 0]])
_SIGNS = np.array([[-1, 1], [-1, -1], [-1, -1], [-1, 1], [-1, 1], [-1, -1]])


@dataclass(frozen=True, eq=False, slots=True)
class CoarseMesh:
    """Contents of the chunk.

    Attributes
    ----------
    positions
        (V, 3) integers from 0 to 2^bits − 1.
    triangles
        (T, 3) vertices, counter-clockwise seen from outside.
    bits
        Bits of a coordinate, 1 to 16.
    origin, step
        A vertex is at origin + step · its integers, in model units.
    pixel
        Model units per pixel of the exemplar.
    metres
        Metres per model unit; 0 if that is not known.
    angles
        Of the exemplar on each of the six sides, in 1/256 turn, as the angle of a warp field's node.
    """

    positions: IntArray
    triangles: IntArray
    bits: int
    origin: tuple[float, float, float]
    step: float
    pixel: float
    metres: float
    angles: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Base:
    """A base as it is shown.

    Attributes
    ----------
    surface
        The triangles; each side of the box that has triangles is an island.
    charts, fields
        A chart and a warp field for each island.
    """

    surface: MeshSurface
    charts: tuple[Chart, ...]
    fields: tuple[WarpField, ...]


def sides_of(corners: NDArray[Any]) -> IntArray:
    """Return the side of the box, 0 to 5, that triangles (T, 3, 3) face."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(one, two)
    axes = np.abs(normals).argmax(axis=1)
    return (2 * axes + (np.take_along_axis(normals, axes[:, None], axis=1)[:, 0] < 0)).astype(np.int32)


def side_places(corners: NDArray[Any], sides: IntArray) -> NDArray[Any]:
    """Return (s, t) of points (T, n, 3) on the sides (T,) of the box, (T, n, 2)."""
    axes, signs = _AXES[sides][:, None], _SIGNS[sides][:, None]
    return np.take_along_axis(corners, np.broadcast_to(axes, (*corners.shape[:2], 2)), axis=2) * signs


def pack_base(coarse: CoarseMesh) -> bytes:
    """Return a base as the payload of its chunk; its triangles are reordered."""
    bits, used = pack_triangles(coarse.positions, coarse.triangles, coarse.bits)
    numbers = struct.pack("<6f", *coarse.origin, coarse.step, coarse.pixel, coarse.metres)
    head = [varint(len(coarse.triangles)), varint(used), bytes([coarse.bits]), numbers, bytes(coarse.angles)]
    return b"".join([*head, bits])


def parse_base(fields: ByteReader, limits: Limits | None = None) -> Base:
    """Read a base back.

    Parameters
    ----------
    fields
        Its bytes.
    limits
        Limits of its demands; by default `Limits()`.

    Raises
    ------
    FormatError
        If it is malformed, or a number is not allowed.
    """
    count = fields.varint("number of triangles", min(MAX_TRIANGLES, TRIANGLES_A_BYTE * fields.left), 1)
    (limits or Limits()).check("base has", "triangles", count)
    vertices = fields.varint("number of vertices", 3 * count, 1)
    bits = fields.byte("bits of a coordinate", MOST_BITS)
    start = fields.offset
    x, y, z, step, pixel, metres = struct.unpack("<6f", fields.bytes(24, "origin and steps"))
    if not (np.isfinite([x, y, z, step, pixel, metres]).all() and step > 0 and pixel > 0 and metres >= 0):
        raise FormatError(f"byte {start}: a length of the base is not finite, or not above 0")
    if step > _MOST_PIXELS * pixel:
        pixels = step / pixel
        raise FormatError(f"byte {start}: a step of the base has {pixels:g} pixels; allowed: at most 2^24")
    angles = tuple(fields.bytes(SIDES, "angles"))
    start = fields.offset
    positions, triangles = parse_triangles(fields, count, vertices, bits)
    try:
        return _shown(CoarseMesh(positions, triangles, bits, (x, y, z), step, pixel, metres, angles))
    except InputError as error:
        raise FormatError(f"byte {start}: {error}") from None


def _shown(coarse: CoarseMesh) -> Base:
    corners = coarse.positions.astype(np.int64)[coarse.triangles]
    sides = sides_of(corners)
    used, island = np.unique(sides, return_inverse=True)
    mesh = TriangleMesh(
        np.array(coarse.origin) + coarse.positions * coarse.step,
        coarse.triangles,
        metres=coarse.metres or None,
    )
    surface = MeshSurface(mesh, island.astype(np.int32), side_places(corners, sides) * coarse.step)
    box = np.stack([coarse.positions.min(axis=0), coarse.positions.max(axis=0)]) * coarse.step
    octaves = 0
    while float((box[1] - box[0]).max()) / (coarse.pixel * 2.0**octaves) > _MOST_STEPS:
        octaves += 1
    step = coarse.pixel * 2.0**octaves
    charts = [_chart(number, box, side, step) for number, side in enumerate(used.tolist())]
    size = OCTAVE * min(octaves, MOST_OCTAVES)
    nodes = [np.array([[[size, size, coarse.angles[side], 0]]], np.int16) for side in used.tolist()]
    return Base(surface, tuple(charts), tuple(WarpField(node, 0) for node in nodes))


def _chart(number: int, box: FloatArray, side: int, step: float) -> Chart:
    """Return the chart over a side of a box (2, 3), with margins."""
    places = side_places(box[None], np.array([side]))[0] / step
    low = np.floor(places.min(axis=0)).astype(np.int64) - _MARGIN
    high = np.ceil(places.max(axis=0)).astype(np.int64) + _MARGIN
    (s0, t0), (s1, t1) = (low * step).tolist(), (high * step).tolist()
    height, width = (high - low).tolist()
    return Chart(number, height, width, s0, s1, t0, t1)


def mean_angle(matrices: FloatArray, weights: Sequence[float]) -> int:
    """Return the mean angle of maps (n, 2, 2) from (s, t) to pixels, as that of a warp field's node."""
    sine = float(np.dot(matrices[:, 0, 1] - matrices[:, 1, 0], weights))
    cosine = float(np.dot(matrices[:, 0, 0] + matrices[:, 1, 1], weights))
    return round(float(np.arctan2(sine, cosine)) * ANGLES / (2 * np.pi)) % ANGLES
