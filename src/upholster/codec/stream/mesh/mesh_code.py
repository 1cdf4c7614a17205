"""A mesh in the surface chunk: triangles, positions, parameters (SPEC.md, sections 2 and 5.4)."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.base.types import FloatArray, IntArray
from upholster.codec.stream.bit_coder import BitReader, BitWriter
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.codec.stream.mesh._island_kernels import code_islands, code_seams
from upholster.codec.stream.mesh._mesh_arrays import (
    MOST_PARAMETER,
    OPEN,
    STATUS,
    VERTICES,
    WRONG,
    CodedMesh,
    Origin,
)
from upholster.codec.stream.mesh._mesh_number_kernels import MESH_COUNTERS
from upholster.codec.stream.mesh._triangle_kernels import code_triangles
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.quilt.chart import Chart

__all__ = [
    "MAX_TRIANGLES",
    "POSITION_BITS",
    "TRIANGLES_A_BYTE",
    "MeshPrecision",
    "pack_mesh",
    "pack_triangles",
    "parse_mesh",
    "parse_triangles",
    "precision_of",
]

MAX_TRIANGLES = 2**20
MAX_PARTS = 2**16
MAX_NAME = 200
POSITION_BITS = 12
"""Bits of a coordinate along the longest side of the mesh's bounding box."""

TEXEL_STEPS = 8
"""Steps of parameters per texel of a chart."""

_MOST_BITS = 16
TRIANGLES_A_BYTE = 4096
"""Largest number of triangles for each byte of their code."""
_RECORDS_A_CALL = 4096
_BYTES_A_RECORD = 512
_METRES = 1

_Stage = Callable[..., Any]
_ALL: tuple[_Stage, ...] = (code_triangles, code_seams, code_islands)
"""Triangles and positions; seams; islands and parameters."""


@dataclass(frozen=True, slots=True)
class MeshPrecision:
    """Precision of a mesh in a stream.

    Attributes
    ----------
    bits
        Bits of a coordinate along the longest side of the box, 1 to 16.
    step
        Step of parameters, in model units.
    """

    bits: int
    step: float


def precision_of(charts: Sequence[Chart], bits: int = POSITION_BITS) -> MeshPrecision:
    """Return the precision at which parameters have `TEXEL_STEPS` steps per texel of the finest chart."""
    texels = [min((c.s1 - c.s0) / c.height, (c.t1 - c.t0) / c.width) for c in charts]
    return MeshPrecision(bits, max(min(texels) / TEXEL_STEPS, float(np.median(texels)) / (4 * TEXEL_STEPS)))


def pack_mesh(surface: MeshSurface, precision: MeshPrecision) -> bytes:
    """Return a mesh as bytes, which follow the kind of the surface.

    Positions and parameters are rounded to `precision`; triangles are reordered, and each may start at
    another of its corners.

    Raises
    ------
    InputError
        For more than 2^20 triangles or 2^16 parts, or parameters beyond ±2^28 steps.
    """
    mesh = surface.mesh
    count = len(mesh.triangles)
    if count > MAX_TRIANGLES:
        raise InputError(f"mesh has {count:,} triangles; allowed: {MAX_TRIANGLES:,} in a stream")
    if len(mesh.parts) > MAX_PARTS:
        raise InputError(f"mesh has {len(mesh.parts):,} parts; allowed: {MAX_PARTS:,} in a stream")
    low, high = mesh.box
    most = (1 << precision.bits) - 1
    step = float((high - low).max()) / max(1, most) or 1.0
    origin = _origin(surface, low, step, precision.step)
    used = len(np.unique(mesh.triangles))
    coded = _empty(count, used, (most, surface.islands, len(mesh.parts)))
    writer = BitWriter(MESH_COUNTERS)
    _code(writer, coded, origin, _ALL)
    head = [_text(mesh.name), bytes([_METRES if mesh.metres is not None else 0])]
    head += [struct.pack("<d", mesh.metres)] if mesh.metres is not None else []
    head += [varint(len(mesh.parts)), *[_text(name) for name in mesh.parts]]
    head += [varint(count), varint(used), varint(surface.islands)]
    head += [bytes([precision.bits]), struct.pack("<5d", *low, step, precision.step)]
    return b"".join([*head, writer.finish()])


def parse_mesh(fields: ByteReader, limits: Limits | None = None) -> MeshSurface:
    """Read a mesh back.

    Parameters
    ----------
    fields
        Its bytes.
    limits
        The caller's limits; by default those of the format.

    Raises
    ------
    FormatError
        If it is malformed, or a number is not allowed.
    """
    name = _parse_text(fields)
    metres = fields.float64("metres") if fields.byte("flags of the mesh", 1) else None
    count = fields.varint("number of parts", min(MAX_PARTS, fields.left), 1)
    parts = tuple(_parse_text(fields) for _ in range(count))
    most = min(MAX_TRIANGLES, TRIANGLES_A_BYTE * fields.left)
    triangles = fields.varint("number of triangles", most, 1)
    if limits is not None:
        limits.check("mesh has", "triangles", triangles)
    vertices = fields.varint("number of vertices", 3 * triangles, 1)
    islands = fields.varint("number of islands", triangles, 1)
    bits = fields.byte("bits of a coordinate", _MOST_BITS)
    *low, step, unit = (fields.float64("origin or step") for _ in range(5))
    if not (step > 0 and unit > 0):
        raise fields.error("a step is not above 0")
    coded = _empty(triangles, vertices, ((1 << bits) - 1, islands, count))
    start = fields.offset
    _read(fields, coded, _ALL)
    with np.errstate(over="ignore"):  # numbers that are not finite are refused with the mesh
        parameters: FloatArray = coded.parameters.reshape(-1, 3, 2) * np.float64(unit)
        positions = np.array(low) + coded.positions * step
    triangles_of = coded.vertices.reshape(-1, 3)
    mesh = TriangleMesh(positions, triangles_of, coded.groups[:, 1], parts, name=name, metres=metres)
    surface = MeshSurface(mesh, coded.groups[:, 0], parameters)
    if surface.islands < islands:
        raise FormatError(f"byte {start}: an island has no triangle")
    return surface


def pack_triangles(positions: IntArray, triangles: IntArray, bits: int) -> tuple[bytes, int]:
    """Return triangles and positions alone as bytes, and the number of vertices that triangles use.

    Parameters
    ----------
    positions
        (V, 3) integers from 0 to 2^bits − 1.
    triangles
        (T, 3) vertices.
    bits
        Bits of a coordinate.
    """
    mesh = TriangleMesh(positions.astype(np.float64), triangles)
    plain = MeshSurface(mesh, np.zeros(len(triangles), np.int32), np.zeros((len(triangles), 3, 2)))
    used = len(np.unique(triangles))
    writer = BitWriter(MESH_COUNTERS)
    coded = _empty(len(triangles), used, ((1 << bits) - 1, 1, 1))
    _code(writer, coded, _origin(plain, np.zeros(3), 1.0, 1.0), (code_triangles,))
    return writer.finish(), used


def parse_triangles(
    fields: ByteReader, triangles: int, vertices: int, bits: int
) -> tuple[IntArray, IntArray]:
    """Read the rest of `fields`, bytes of `pack_triangles`: return positions (V, 3) and triangles (T, 3).

    Raises
    ------
    FormatError
        If they are malformed, or a number is not allowed.
    """
    coded = _empty(triangles, vertices, ((1 << bits) - 1, 1, 1))
    _read(fields, coded, (code_triangles,))
    return coded.positions, coded.vertices.reshape(-1, 3)


def _read(fields: ByteReader, mesh: CodedMesh, stages: Sequence[_Stage]) -> None:
    start = fields.offset
    reader = BitReader(MESH_COUNTERS)
    reader.feed(fields.bytes(fields.left, "triangles"))
    status = _code(reader, mesh, None, stages)
    if status:
        message = (
            "a number of the mesh is outside what is allowed" if status == WRONG else "triangles are missing"
        )
        raise FormatError(f"byte {start}: {message}")
    if reader.unread:
        raise FormatError(f"byte {start}: mesh has bytes too many")


def _code(
    bits: BitWriter | BitReader, mesh: CodedMesh, origin: Origin | None, stages: Sequence[_Stage]
) -> int:
    # Returns the error's status, or 0.
    known = _no_origin() if origin is None else origin
    count, counts = len(mesh.pieces), mesh.counts
    for code in stages:
        for start in range(0, count, _RECORDS_A_CALL):
            stop = min(count, start + _RECORDS_A_CALL)
            if isinstance(bits, BitWriter):
                bits.room(_BYTES_A_RECORD * (stop - start) + 4096)
            code(bits.coder, mesh, known, origin is not None, start, stop)
            if counts[STATUS]:
                return int(counts[STATUS])
        if counts[VERTICES] < len(mesh.positions):
            return WRONG
    return 0


def _origin(surface: MeshSurface, low: NDArray[np.float64], step: float, unit: float) -> Origin:
    mesh = surface.mesh
    whole = np.rint(np.where(surface.island[:, None, None] >= 0, surface.parameters, 0) / unit)
    if not (np.abs(whole) <= MOST_PARAMETER).all():
        raise InputError(f"parameters have more than {MOST_PARAMETER:,} steps; allowed: fewer, in a stream")
    return Origin(
        triangles=np.array(mesh.triangles),
        neighbours=np.array(mesh.neighbours),
        positions=np.rint((mesh.positions - low) / step).astype(np.int32),
        parameters=whole.astype(np.int32),
        groups=np.stack([surface.island, mesh.part], axis=1),
        number=np.full(len(mesh.positions), -1, np.int32),
        corners=np.zeros(len(mesh.triangles), np.int32),
        done=np.zeros(len(mesh.triangles), np.uint8),
        first=np.zeros(1, np.int64),
    )


def _no_origin() -> Origin:
    list_, rows = np.zeros(0, np.int32), np.zeros((0, 3), np.int32)
    corners, pairs = np.zeros((0, 3, 2), np.int32), np.zeros((0, 2), np.int32)
    flags, place = np.zeros(0, np.uint8), np.zeros(1, np.int64)
    return Origin(rows, rows, rows, corners, pairs, list_, list_, flags, place)


def _empty(triangles: int, vertices: int, limits: tuple[int, int, int]) -> CodedMesh:
    edges = 3 * triangles
    return CodedMesh(
        vertices=np.zeros(edges, np.int32),
        twins=np.full(edges, OPEN, np.int32),
        before=np.zeros(edges, np.int32),
        after=np.zeros(edges, np.int32),
        stack=np.zeros(edges, np.int32),
        leaving=np.full(vertices, -1, np.int32),
        degrees=np.zeros(vertices, np.uint8),
        positions=np.zeros((vertices, 3), np.int32),
        position_leftovers=np.zeros((vertices, 3), np.int32),
        pieces=np.arange(triangles, dtype=np.int32),
        wedges=np.arange(edges, dtype=np.int32),
        groups=np.zeros((triangles, 2), np.int32),
        parameters=np.zeros((edges, 2), np.int32),
        parameter_leftovers=np.zeros((edges, 2), np.int32),
        counts=np.array([0, 0, 0, 0, -1, 0], np.int64),
        limits=np.array(limits, np.int64),
    )


def _text(name: str) -> bytes:
    data = name.encode()[:MAX_NAME].decode(errors="ignore").encode()
    return varint(len(data)) + data


def _parse_text(fields: ByteReader) -> str:
    return fields.bytes(fields.varint("length of a name", MAX_NAME), "name").decode(errors="replace")
