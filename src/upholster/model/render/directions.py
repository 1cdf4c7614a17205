"""Pictures of direction fields: lines along the field on the model, and dots at its singular points."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.base.vectors import unit_vectors
from upholster.charts.directions.field import DirectionField
from upholster.image.color import from_linear
from upholster.image.drawing import Drawing
from upholster.model.render._direction_kernels import DrawnField, trace_lines
from upholster.model.render.camera import Camera
from upholster.model.render.picture import render

__all__ = ["directions_picture", "going_on"]

_SPACING = 13
"""Pixels between lines."""

_LENGTH = 22
"""Length of a line in pixels, in the middle of the model."""

_ROOM = 96
"""The most points of a line."""

_FINER = 2
"""The picture is drawn this many times as large, then reduced, so that lines are smooth."""

_SHALLOW = 0.03
"""Sine of the angle to an edge below which a line follows the edge."""

_LINE, _HEAD = (0.10, 0.22, 0.42), (0.85, 0.30, 0.05)
_POSITIVE, _NEGATIVE = (214, 39, 40), (31, 100, 220)


def directions_picture(
    field: DirectionField,
    *,
    size: tuple[int, int] = (1024, 768),
    view: tuple[float, float] = (30.0, 30.0),
    zoom: float = 1.0,
) -> PixelArray:
    """Draw a field on its mesh: (h, w, 3) uint8, sRGB-coded.

    Lines run along the field, with an orange head if it has a sign; if two directions at right angles count
    as one, there are lines both ways. Dots are singular points: red if the field turns in the same sense as a
    path around the point, blue if in the opposite sense.

    Parameters
    ----------
    field
        The field.
    size
        (width, height) in pixels, 1 to 8192 each.
    view, zoom
        The camera's placement: see `Camera.fit`.

    Raises
    ------
    InputError
        If the size, the view or the zoom is out of range.
    """
    mesh = field.mesh
    used = mesh.positions[np.unique(mesh.triangles)]
    camera = Camera.fit(used, size=(size[0] * _FINER, size[1] * _FINER), view=view, zoom=zoom)
    depth = np.empty((camera.size[1], camera.size[0]), np.float32)
    count = 3 * len(mesh.triangles)
    shape = render(
        mesh.corners.reshape(-1, 3),
        np.zeros((count, 3)),
        np.zeros((count, 2)),
        np.arange(count).reshape(-1, 3),
        None,
        camera=camera,
        supersample=1,
        depth=depth,
    )
    drawing = Drawing(*camera.size)
    drawing.paste(0, 0, from_linear(shape, "uint8"))
    _draw_lines(drawing, field, camera, depth)
    pixels = drawing.pixels()
    _draw_singular(pixels, field, camera, depth)
    fine = pixels.reshape(size[1], _FINER, size[0], _FINER, 3).astype(np.uint32).sum(axis=(1, 3))
    return np.asarray((fine + _FINER**2 // 2) // _FINER**2, np.uint8)


def _draw_lines(drawing: Drawing, field: DirectionField, camera: Camera, depth: NDArray[np.float32]) -> None:
    triangles, points = _seeds(field, camera, depth)
    distance = float(np.median(camera.project(points)[:, 2])) if len(points) else 1.0
    length = 0.5 * _LENGTH * _FINER * distance / camera.focal
    ways = {1: (0, 2), 2: (0, 2), 4: (0, 1, 2, 3)}[field.fold]
    mesh = field.mesh
    drawn = DrawnField(mesh.corners, going_on(field), field.face_vectors, field.jumps)
    for way in ways:
        lines, counts = np.zeros((len(points), _ROOM, 3)), np.zeros(len(points), np.int32)
        turns = np.full(len(points), way, np.int32)
        trace_lines(drawn, triangles, points, turns, length, lines, counts)
        seen = camera.project(lines)[..., :2]
        for line, some in zip(seen.tolist(), counts.tolist(), strict=True):
            shown = [(x, y) for x, y in line[:some]]
            drawing.lines(shown, color=_LINE, width=2)
            if field.fold == 1 and way == 0:
                drawing.lines(shown[len(shown) // 2 :], color=_HEAD, width=3)


def going_on(field: DirectionField) -> IntArray:
    """Return the mesh's neighbours (T, 3), −1 across edges where a line would turn back.

    The field starts again there: the line would leave the surface through the edge that it came in by.
    """
    mesh = field.mesh
    line = unit_vectors(np.roll(mesh.corners, -1, axis=1) - mesh.corners)
    along = np.einsum("tki,ti->tk", line, field.face_vectors)
    out = np.einsum("tki,ti->tk", np.cross(line, mesh.flat_normals[:, None]), field.face_vectors)
    here = along + 1j * out
    there = -here.reshape(-1)[mesh.neighbours] * np.array([1, 1j, -1, -1j])[field.jumps]
    goes_on = _crosses(here.imag, there.imag)
    if field.fold == 4:  # lines run both ways
        goes_on &= _crosses(here.real, there.real)
    return np.where(goes_on, mesh.neighbours, -1).astype(np.int32)


def _crosses(out: FloatArray, inward: FloatArray) -> NDArray[np.bool_]:
    """Return whether lines that leave at one sine to an edge, and continue at another, do cross it."""
    along = (np.abs(out) < _SHALLOW) & (np.abs(inward) < _SHALLOW)
    return np.asarray(along | (out * inward > _SHALLOW**2))


def _seeds(field: DirectionField, camera: Camera, depth: NDArray[np.float32]) -> tuple[IntArray, FloatArray]:
    """Return triangles and visible points in them, about one for each square of the picture."""
    mesh = field.mesh
    cell = _SPACING * _FINER
    wanted = 12 * (depth.size // cell**2)
    ends = np.cumsum(mesh.areas)
    triangles = np.searchsorted(ends, (np.arange(wanted) + 0.5) / wanted * ends[-1])
    triangles = np.minimum(triangles, len(ends) - 1).astype(np.int32)
    # Fractions of the golden ratio and its two-dimensional analogue spread evenly over each triangle.
    a, b = np.mod(np.outer((0.7548776662466927, 0.5698402909980532), np.arange(wanted)), 1.0)
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    corners = mesh.corners[triangles]
    points = corners[:, 0] * (1 - a - b)[:, None] + corners[:, 1] * a[:, None] + corners[:, 2] * b[:, None]
    shown = camera.project(points)
    seen = _is_seen(shown, depth, mesh.size)
    cells = (shown[seen, 1] // cell).astype(np.int64) * (depth.shape[1] // cell + 1) + shown[seen, 0] // cell
    first = np.flatnonzero(seen)[np.unique(cells, return_index=True)[1]]
    return triangles[first], points[first]


def _is_seen(shown: FloatArray, depth: NDArray[np.float32], size: float) -> NDArray[np.bool_]:
    """Return which projected points (n, 3) are in the picture, and not hidden there."""
    x, y = np.floor(shown[:, 0]), np.floor(shown[:, 1])
    inside = (x >= 0) & (x < depth.shape[1]) & (y >= 0) & (y < depth.shape[0])
    nearest = np.full(len(shown), -np.inf)
    nearest[inside] = depth[y[inside].astype(int), x[inside].astype(int)]
    found: NDArray[np.bool_] = inside & (shown[:, 2] <= nearest + 0.004 * size)
    return found


def _draw_singular(
    pixels: PixelArray, field: DirectionField, camera: Camera, depth: NDArray[np.float32]
) -> None:
    shown = camera.project(field.places)
    radius = 5.0 * _FINER
    rows, columns = np.ogrid[: len(pixels), : pixels.shape[1]]
    for (x, y, _), seen, vertex in zip(
        shown, _is_seen(shown, depth, field.mesh.size), field.singular, strict=True
    ):
        if not seen:
            continue
        top, left = max(int(y - radius) - 1, 0), max(int(x - radius) - 1, 0)
        bottom, right = int(y + radius) + 2, int(x + radius) + 2
        part = np.s_[top:bottom, left:right]
        away = np.hypot(rows[top:bottom] + 0.5 - y, columns[:, left:right] + 0.5 - x)
        pixels[part][away <= radius] = 255
        pixels[part][away <= 0.8 * radius] = _POSITIVE if field.index[vertex] > 0 else _NEGATIVE
