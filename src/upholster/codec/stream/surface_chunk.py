"""The surface chunk: a built-in surface by name, control nets with shared points stored once, or a mesh."""

import struct
from collections.abc import Sequence

import numpy as np

from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.base.types import FloatArray
from upholster.codec.stream.byte_reader import ByteReader, unzigzag, varint, zigzag
from upholster.codec.stream.mesh.mesh_code import pack_mesh, parse_mesh, precision_of
from upholster.codec.stream.seam_code import pack_seams, parse_seams
from upholster.geometry.built_in.catalog import SURFACES, SurfaceKind
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.face import Face, grid_face
from upholster.geometry.patches.patch import MAX_DEGREE, RationalPatch
from upholster.geometry.patches.surface import MAX_PATCHES, Surface
from upholster.quilt.chart import Chart

__all__ = ["MAX_POINTS", "NAMED", "pack_surface", "parse_surface"]

NAMED = {kind.number: kind for kind in SURFACES.values() if kind.number is not None}
"""Built-in surfaces by their numbers in a stream; 0 means control nets."""

_MESH = 9
_TILINGS = ("six", "octants")
MAX_POINTS = 2**20
MAX_NAME = 200
MAX_BUILT = 2**14
"""Largest number of patches of a built-in surface: more would take long to build from a few bytes."""

_FLOAT64, _WEIGHTS, _SAME_DEGREE, _GRIDS = 1, 2, 4, 8


def pack_surface(surface: Surface | MeshSurface, charts: Sequence[Chart] = ()) -> bytes:
    """Return a surface as bytes.

    A built-in one (`Surface.source`) is stored by name. For any other, all control points are stored: as
    float32 if that changes neither the edges that meet nor any point by more than 1e-6 of the surface's size;
    else as float64.

    A mesh is rounded, as finely as `charts` on it need, see `upholster.codec.stream.mesh.mesh_code`.

    Raises
    ------
    InputError
        For more than 2^20 control points or triangles.
    """
    if isinstance(surface, MeshSurface):
        return bytes([_MESH]) + pack_mesh(surface, precision_of(charts))
    seams = pack_seams(surface)
    named = _pack_named(surface, bool(seams))
    if named is not None:
        return named + seams
    points = sum(patch.net.shape[0] * patch.net.shape[1] for patch in surface.patches)
    if points > MAX_POINTS:
        raise InputError(f"surface has {points} control points; allowed: {MAX_POINTS} in a stream")
    nets = _joined(surface)
    points_short = [_points(net).astype(np.float32).astype(np.float64) for net in nets]
    short = [_net(points) for points in points_short]
    exact = all((a == b.net).all() for a, b in zip(short, surface.patches, strict=True))
    if exact or _meets_alike(surface, short):
        return _pack_nets(surface, points_short, np.dtype("<f4")) + seams
    return _pack_nets(surface, [patch.net for patch in surface.patches], np.dtype("<f8")) + seams


def parse_surface(fields: ByteReader, limits: Limits | None = None) -> Surface | MeshSurface:
    """Read a surface back.

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
    kind = fields.byte("kind of surface", max(_MESH, *NAMED))
    start = fields.offset
    try:
        surface = _parse_kind(fields, kind, limits or Limits())
    except InputError as error:
        raise FormatError(f"byte {start}: {error}") from None
    fields.end("surface")
    return surface


def _parse_kind(fields: ByteReader, kind: int, limits: Limits) -> Surface | MeshSurface:
    if kind == _MESH:
        return parse_mesh(fields, limits)
    surface = _parse_named(fields, NAMED[kind]) if kind else _parse_nets(fields)
    return surface.sharing(parse_seams(fields, surface.faces))


def _pack_named(surface: Surface, followed: bool) -> bytes | None:
    source = surface.source
    if source is None or len(surface.patches) > MAX_BUILT or (kind := SURFACES[source.name]).number is None:
        return None
    present, values, given = 0, b"", dict(source.values)
    for n, parameter in enumerate(kind.parameters):
        value = given[parameter.name]
        if value == parameter.default:
            continue
        present |= 1 << n
        if isinstance(value, float):
            values += struct.pack("<d", value)
        elif isinstance(value, str):
            values += bytes([_TILINGS.index(value)])
        else:
            values += b"".join(varint(part) for part in (value if isinstance(value, tuple) else (value,)))
    return bytes([kind.number]) + (bytes([present]) + values if present or followed else b"")


def _parse_named(fields: ByteReader, kind: SurfaceKind) -> Surface:
    parameters = kind.parameters
    present = fields.byte("which parameters follow", (1 << len(parameters)) - 1) if fields.left else 0
    values: dict[str, object] = {}
    for n, parameter in enumerate(parameters):
        if not present >> n & 1:
            continue
        if isinstance(parameter.default, float):
            values[parameter.name] = fields.float64(parameter.name)
        elif isinstance(parameter.default, str):
            values[parameter.name] = _TILINGS[fields.byte(parameter.name, len(_TILINGS) - 1)]
        elif isinstance(parameter.default, tuple):
            values[parameter.name] = tuple(fields.varint(parameter.name, 256, 1) for _ in parameter.default)
        else:
            values[parameter.name] = fields.varint(parameter.name, 256, 1)
    spans = values.get("spans", 1)
    if isinstance(spans, tuple) and spans[0] * spans[1] > MAX_BUILT:
        raise fields.error(f"spans make {spans[0] * spans[1]} patches; allowed: {MAX_BUILT}")
    return kind.build(**values)


def _joined(surface: Surface) -> list[FloatArray]:
    """Return the nets with equal control points on edges that meet: they stay equal when rounded."""
    nets = [np.array(patch.net) for patch in surface.patches]
    tolerance = 1e-6 * max(surface.size, 1e-300)
    # Twice: points at a corner are passed on from edge to edge.
    for _ in range(2):
        for edge in surface.shared:
            if not edge.whole:
                continue
            here, there = _edge(nets[edge.patch], edge.edge), _edge(nets[edge.other_patch], edge.other_edge)
            there = there[::-1] if edge.opposed else there
            if here.shape == there.shape and np.abs(here - there).max() <= tolerance:
                low = np.minimum(here, there)
                here[:], there[:] = low, low
    return nets


def _points(net: FloatArray) -> FloatArray:
    return np.concatenate([net[..., :3] / net[..., 3:], net[..., 3:]], axis=-1)


def _net(points: FloatArray) -> FloatArray:
    return np.concatenate([points[..., :3] * points[..., 3:], points[..., 3:]], axis=-1)


def _edge(net: FloatArray, edge: int) -> FloatArray:
    return (net[0], net[:, -1], net[-1], net[:, 0])[edge]


def _meets_alike(surface: Surface, nets: list[FloatArray]) -> bool:
    try:
        grids = [(face.rows, face.columns) for face in surface.faces]
        faces = _faces([RationalPatch(net) for net in nets], grids)
        other = Surface(faces, surface.name, surface.tolerance)
        close = all(
            np.abs(a.control_points - b.control_points).max() <= 1e-6 * surface.size
            for a, b in zip(surface.patches, other.patches, strict=True)
        )
        return close and other.shared == surface.shared and other.degenerate == surface.degenerate
    except InputError:
        return False


def _faces(patches: Sequence[RationalPatch], grids: Sequence[tuple[int, int]]) -> list[Face]:
    """Return patches as faces with given numbers of rows and columns."""
    faces, first = [], 0
    for rows, columns in grids:
        faces.append(grid_face(patches[first : first + rows * columns], columns))
        first += rows * columns
    return faces


def _pack_nets(surface: Surface, nets: list[FloatArray], dtype: "np.dtype[np.floating]") -> bytes:
    name = surface.name.encode()[:MAX_NAME].decode(errors="ignore").encode()
    weighted = any((net[..., 3] != 1.0).any() for net in nets)
    same = len({net.shape for net in nets}) == 1
    grids = len(surface.faces) < len(nets)
    flags = _FLOAT64 * (dtype.itemsize == 8) | _WEIGHTS * weighted | _SAME_DEGREE * same | _GRIDS * grids
    out = [
        bytes([0, flags]),
        varint(len(name)),
        name,
        struct.pack("<d", surface.tolerance),
        varint(len(surface.faces)),
    ]
    if grids:
        out += [varint(count) for face in surface.faces for count in (face.rows, face.columns)]
    out += [bytes([net.shape[0] - 1, net.shape[1] - 1]) for net in (nets[:1] if same else nets)]
    columns = 4 if weighted else 3
    places: dict[bytes, int] = {}
    new, earlier, last = [], [], 0
    points: list[bytes] = []
    for net in nets:
        for point in net.reshape(-1, 4)[:, :columns].astype(dtype):
            key = (point + dtype.type(0)).tobytes()
            place = places.setdefault(key, len(places))
            new.append(place == len(points))
            if new[-1]:
                points.append(key)
            else:
                earlier.append(varint(zigzag(place - last)))
                last = place
    out.append(np.packbits(np.array(new, bool), bitorder="little").tobytes())
    return b"".join(out + earlier + points)


def _parse_nets(fields: ByteReader) -> Surface:
    flags = fields.byte("flags of the nets", 15)
    name = fields.bytes(fields.varint("length of the name", MAX_NAME), "name").decode(errors="replace")
    tolerance = fields.float64("tolerance")
    grids = _parse_grids(fields, bool(flags & _GRIDS))
    count = sum(rows * columns for rows, columns in grids)
    shapes = []
    for _ in range(1 if flags & _SAME_DEGREE else count):
        shapes.append((fields.byte("degree", MAX_DEGREE) + 1, fields.byte("degree", MAX_DEGREE) + 1))
        if min(shapes[-1]) < 2:
            raise fields.error("degree is 0; allowed: 1 to 32")
    shapes = shapes * count if flags & _SAME_DEGREE else shapes
    total = sum(m * n for m, n in shapes)
    if total > MAX_POINTS:
        raise fields.error(f"nets have {total} control points; allowed: {MAX_POINTS}")
    packed = np.frombuffer(fields.bytes(-(-total // 8), "list of new points"), np.uint8)
    new = np.unpackbits(packed, count=total, bitorder="little").astype(bool)
    index = np.cumsum(new) - 1
    last = 0
    for n in np.flatnonzero(~new).tolist():
        last += unzigzag(fields.varint("reference to a point", 2 * MAX_POINTS))
        if not 0 <= last <= index[n]:
            raise fields.error(f"reference is to point {last}; allowed: 0 to {index[n]}")
        index[n] = -1 - last
    index = np.where(index < 0, -1 - index, index)
    columns = 4 if flags & _WEIGHTS else 3
    dtype = np.dtype("<f8" if flags & _FLOAT64 else "<f4")
    unique = int(new.sum())
    data = fields.bytes(unique * columns * dtype.itemsize, "control points")
    points = np.ones((unique, 4))
    with np.errstate(all="ignore"):  # numbers that are not finite are refused with their patch
        points[:, :columns] = np.frombuffer(data, dtype).reshape(unique, columns)
        # Rounded homogeneous points would tear degenerate edges, whose weights differ.
        entries = (points if flags & _FLOAT64 else _net(points))[index]
    starts = np.concatenate([[0], np.cumsum([m * n for m, n in shapes])])
    patches = []
    for k, shape in enumerate(shapes):
        try:
            patches.append(RationalPatch(entries[starts[k] : starts[k + 1]].reshape(*shape, 4)))
        except InputError as error:
            raise InputError(f"patch {k}: {error}") from None
    return Surface(_faces(patches, grids), name, tolerance)


def _parse_grids(fields: ByteReader, are_stored: bool) -> list[tuple[int, int]]:
    """Return rows and columns of patches of all faces."""
    count = fields.varint("number of faces", MAX_PATCHES, 1)
    if not are_stored:
        return [(1, 1)] * count
    grids, left = [], MAX_PATCHES - count
    for _ in range(count):
        rows = fields.varint("rows of a face", left + 1, 1)
        columns = fields.varint("columns of a face", (left + 1) // rows, 1)
        left -= rows * columns - 1
        grids.append((rows, columns))
    return grids
