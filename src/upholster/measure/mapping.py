"""How large and which way the texture lies on the surface, against what was asked."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.charts.directions import Direction
from upholster.errors import InputError
from upholster.geometry import MeshSurface, Surface
from upholster.measure.meshes import mesh_samples, triangle_steps
from upholster.measure.samples import SEED, Window
from upholster.measure.scale import check_faces, quantiles
from upholster.measure.trace import Trace, quilt_windows
from upholster.model import face_parameters
from upholster.quilt import Quilt
from upholster.quilt.displacement import centre_matrices
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.types import FloatArray

__all__ = ["MappingReport", "mapping", "mesh_mapping"]

MOST_SAMPLES = 2**18

FAST, PIECE = 20.0, 0.1
"""Degrees of turn over a length, as a part of the exemplar's width. A piece of texture of that length and of
true size is off by half of the turn from its middle to its end: 5°."""

_LEAST_SLOPE = 0.05
"""Sine of the slope below which nothing is level on patches: they lie flat."""

_LEAST_ASKED = 0.03
"""Sine of the angle between normal and direction: where it is less nothing is asked."""


@dataclass(frozen=True, slots=True)
class MappingReport:
    """How the texture lies on a surface; all figures weigh every part of the surface by its area.

    A size is what the exemplar's unit of length becomes on the surface, over what was asked: 1 is as asked.

    Attributes
    ----------
    within
        Share of the area where the size is within 5 % of the one asked, 0 to 1.
    error
        Mean absolute log2 of the size, in octaves.
    error_95
        95th percentile of the same: 0.0704 is 5 %.
    stretch_95
        95th percentile of the greatest over the least stretch from exemplar to surface: 1 keeps shapes.
    aligned
        Share of the area where the direction is within 5° of the one asked; None if none was asked.
    angle_95
        95th percentile of the angle between the two, in degrees; None as before.
    fast
        On a mesh: share of the area where a direction is asked that turns fast there, as round its singular
        points: by more than `FAST` degrees over `PIECE` of the exemplar's width. None where it is not known.
    aligned_slow
        The share `aligned` of all other area; None as before.
    """

    within: float
    error: float
    error_95: float
    stretch_95: float
    aligned: float | None
    angle_95: float | None
    fast: float | None = None
    aligned_slow: float | None = None


def mapping(
    surface: Surface,
    quilt: Quilt,
    *,
    scale: float | None = None,
    direction: Direction | None = None,
) -> MappingReport:
    """Measure size and direction of the texture on the surface, wherever a placement paints it.

    A texel q of a block with centre c comes from ``source + T·½(M(c) + M(q))·(q - c)``, whose derivative G
    takes texel steps to exemplar pixels; the surface's derivatives per texel step, J (3×2), take them to
    space. The size is ``√(|J_r × J_c| / |det G|)`` times the scale; the stretches are the singular values of
    J·G⁻¹; the direction is J·G⁻¹·(0, 1), where the exemplar's columns go. Evaluated at a quarter million
    texels on even grids.

    Parameters
    ----------
    surface, quilt
        What was covered, and how.
    scale
        Exemplar pixels per unit of length that were asked for; by default the median of what is found.
    direction
        The direction asked for. Of vectors in space the part along the surface counts, opposite ones being
        one; where it is less than a thousandth of them, nothing was asked. Neither is it by ``smooth``,
        ``curvature`` and ``edges``, which only a field can tell. By default directions are not measured.

    Returns
    -------
    MappingReport
        Shares, octaves and degrees.

    Raises
    ------
    InputError
        If the scale is not positive and finite, a chart names a face that the surface does not have, or
        nothing that is painted has any area.

    References
    ----------
    Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3: singular
    values as local stretch.
    """
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise InputError(f"scale is {scale}; allowed: a positive number of sample pixels per unit")
    check_faces(surface, quilt.charts)
    windows = quilt_windows(quilt)
    total = sum(window.height * window.width for window in windows)
    step = max(1, int(np.ceil(np.sqrt(total / MOST_SAMPLES))))
    rng = np.random.default_rng(SEED)
    parts = [np.zeros((6, 0))]
    for window in windows:
        trace = Trace.of(quilt, window)
        row, column = rng.integers(0, min(step, window.height)), rng.integers(0, min(step, window.width))
        owners = trace.owners[row::step, column::step]
        rows, columns = np.indices(owners.shape).reshape(2, -1)
        owner = trace.placements[owners[rows, columns]]
        rows, columns = (window.row + row + step * rows), (window.column + column + step * columns)
        chart = quilt.charts[window.index]
        s, t = face_parameters(chart, rows + 0.5, columns + 0.5)
        points, by_s, by_t = surface.faces[chart.face].derivatives(s, t)
        steps = np.stack(
            [by_s * ((chart.s1 - chart.s0) / chart.height), by_t * ((chart.t1 - chart.t0) / chart.width)],
            axis=2,
        )
        jacobian = _jacobian(trace.field, owner, rows, columns)
        asked = None if direction is None else _asked(direction, points, by_s, by_t)
        axial = direction is not None and direction.vectors is not None
        parts.append(_at_samples(steps, jacobian, asked, axial))
    return _report(np.concatenate(parts, axis=1), scale)


def mesh_mapping(
    surface: MeshSurface, quilt: Quilt, *, scale: float | None = None, asked: FloatArray | None = None
) -> MappingReport:
    """Measure size and direction of the texture on a mesh, as `mapping` does, at places spread over its area.

    Parameters
    ----------
    surface, quilt
        What was covered, and how.
    scale
        Exemplar pixels per model unit that were asked for; by default the median of what is found.
    asked
        (T, 3, 3) the direction asked for at the triangles' corners, in their planes, see `asked_at_corners`:
        interpolated over each; where less than 0.03 is left none was.
    """
    samples, steps = mesh_samples(surface, quilt.charts), triangle_steps(surface, quilt.charts)
    parts = [np.zeros((6, 0))]
    for index, chart in enumerate(quilt.charts):
        own = samples.chart == index
        if not own.any():
            continue
        trace = Trace.of(quilt, Window(index, 0, 0, chart.height, chart.width), beyond=True)
        rows, columns, triangle = samples.rows[own], samples.columns[own], samples.triangle[own]
        shares = samples.shares[own]
        jacobian = _jacobian(trace.field, trace.placements[trace.owners[rows, columns]], rows, columns)
        wanted = turn = None
        if asked is not None:
            wanted = (shares[:, :, None] * asked[triangle]).sum(axis=1)
            wanted[np.linalg.norm(wanted, axis=1) < _LEAST_ASKED] = 0.0
            turn = _turning(surface.mesh.corners[triangle], asked[triangle], wanted)
        found = _at_samples(steps[triangle], jacobian, wanted, axial=False)
        found[2] = 1.0  # samples are spread by area, not by texels
        found[5] = 0.0 if turn is None else turn
        parts.append(found)
    return _report(np.concatenate(parts, axis=1), scale, PIECE * quilt.exemplar_shape[1])


def _turning(corners: FloatArray, asked: FloatArray, here: FloatArray) -> FloatArray:
    """Return by how many degrees per unit of length directions turn, (n,), at places of triangles.

    `corners` and `asked` (n, 3, 3) are the triangles' and the vectors there, `here` (n, 3) the vectors in
    between: d(angle) = here × d(vector) / here².
    """
    first, second = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)
    normal = np.cross(first, second)
    square = np.maximum((normal * normal).sum(axis=1), 1e-300)
    out = np.maximum((here * here).sum(axis=1) * np.sqrt(square), 1e-300)
    by_first, by_second = (
        (np.cross(here, asked[:, k] - asked[:, 0]) * normal).sum(axis=1) / out for k in (1, 2)
    )
    across = by_first[:, None] * np.cross(second, normal) + by_second[:, None] * np.cross(normal, first)
    turn: FloatArray = np.degrees(np.linalg.norm(across, axis=1) / square)
    return turn


def _jacobian(
    field: WarpField, owner: NDArray[np.void], rows: NDArray[np.intp], columns: NDArray[np.intp]
) -> FloatArray:
    """Return how texel steps become exemplar pixels, (n, 2, 2), at texels that placements own."""
    centre = np.stack([owner["row"], owner["column"]], axis=1) / 16 - 0.5  # as steps are counted
    middle = centre_matrices(field, owner).reshape(-1, 2, 2) / UNIT
    derivative = _derivative(field, middle, centre, np.stack([rows, columns], axis=1))
    out: FloatArray = SYMMETRIES[owner["symmetry"]].reshape(-1, 2, 2) @ derivative
    return out


def _report(parts: FloatArray, scale: float | None, piece: float | None = None) -> MappingReport:
    # `piece`, in exemplar pixels: where it is told, `parts` know how fast what is asked for turns.
    size, stretch, area, angle, directed, turn = parts
    real = (area > 1e-12 * area.max(initial=0)) & (size > 0)  # a pole has some tiny area by rounding
    if not real.any():
        raise InputError("quilt paints nothing that has an area on the surface")
    size, stretch, area, angle, directed, turn = parts[:, real]
    ratio = np.log2(size)
    scale = 2.0 ** -quantiles(ratio, area, (0.5,))[0] if scale is None else scale
    ratio = np.abs(ratio + np.log2(scale))
    known = directed > 0
    slow = known & (turn * piece <= FAST * scale) if piece is not None else known
    told = piece is not None and known.any()
    return MappingReport(
        within=float(np.average(ratio <= np.log2(1.05), weights=area)),
        error=float(np.average(ratio, weights=area)),
        error_95=quantiles(ratio, area, (0.95,))[0],
        stretch_95=quantiles(stretch, area, (0.95,))[0],
        aligned=float(np.average(angle[known] <= 5, weights=area[known])) if known.any() else None,
        angle_95=quantiles(angle[known], area[known], (0.95,))[0] if known.any() else None,
        fast=1.0 - float(area[slow].sum() / area[known].sum()) if told else None,
        aligned_slow=float(np.average(angle[slow] <= 5, weights=area[slow])) if told and slow.any() else None,
    )


def _asked(direction: Direction, points: FloatArray, by_s: FloatArray, by_t: FloatArray) -> FloatArray:
    """Return vectors (n, 3) along the direction, not all in the tangent plane; 0 where there is none."""
    normal = np.cross(by_s, by_t)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(size > 0, size, 1.0)
    if direction.kind == "vectors" and callable(direction.vectors):
        along = np.asarray(direction.vectors(points), np.float64)
    elif direction.kind == "level":
        level = np.cross((0.0, 0.0, 1.0), normal)
        along = np.where(np.linalg.norm(level, axis=1, keepdims=True) > _LEAST_SLOPE, level, 0.0)
    elif direction.kind in ("u", "v"):
        along = by_s if direction.kind == "v" else by_t
    else:
        return np.zeros_like(points)
    if not direction.angle:
        return along
    angle = np.radians(direction.angle)
    # Clockwise seen from outside.
    turned: FloatArray = np.cos(angle) * along + np.sin(angle) * np.cross(along, normal)
    return turned


def _derivative(
    field: WarpField, middle: FloatArray, centre: NDArray[Any], place: NDArray[Any]
) -> FloatArray:
    """Return the derivative (n, 2, 2) by q, at `place` (n, 2), of ``½(middle + M(q))·(q - centre)``."""
    here, by_row, by_column = _matrices(field, place)
    offset = (place - centre)[:, :, None].astype(np.float64)
    drift = np.concatenate([by_row @ offset, by_column @ offset], axis=2)
    out: FloatArray = 0.5 * (middle + here + drift)
    return out


def _matrices(field: WarpField, place: NDArray[Any]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return M (n, 2, 2) at texels (n, 2), in pixels per texel, and its derivatives by row and by column."""
    nodes = field.matrices.reshape(*field.matrices.shape[:2], 2, 2) / UNIT
    last = np.array(nodes.shape[:2]) - 1
    at = np.clip(field.margin + place / FIELD_STEP, 0, last)
    first = np.minimum(at.astype(np.intp), np.maximum(last - 1, 0))
    inside = (at > 0) & (at < last)
    then = np.minimum(first + 1, last)
    down, right = np.moveaxis((at - first)[:, :, None, None], 1, 0)
    (i, j), (k, m) = first.T, then.T
    upper = nodes[i, j] * (1 - right) + nodes[i, m] * right
    lower = nodes[k, j] * (1 - right) + nodes[k, m] * right
    left = nodes[i, j] * (1 - down) + nodes[k, j] * down
    beside = nodes[i, m] * (1 - down) + nodes[k, m] * down
    slopes = [
        (b - a) / FIELD_STEP * inside[:, axis, None, None]
        for axis, (a, b) in enumerate(((upper, lower), (left, beside)))
    ]
    return upper * (1 - down) + lower * down, slopes[0], slopes[1]


def _at_samples(steps: FloatArray, jacobian: FloatArray, asked: FloatArray | None, axial: bool) -> FloatArray:
    """Return (6, n): size times scale, stretch, area, angle in degrees, 1 where a direction was asked, 0."""
    down, right = steps[:, :, 0], steps[:, :, 1]
    normal = np.cross(down, right)
    area = np.linalg.norm(normal, axis=1)
    determinant = jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0]
    out = np.zeros((6, len(area)))
    sound = (area > 0) & (determinant != 0)
    steps, jacobian, normal, area = steps[sound], jacobian[sound], normal[sound], area[sound]
    spread = steps @ np.linalg.inv(jacobian)  # exemplar pixels to space
    e, f, g = (np.einsum("ni,ni->n", spread[:, :, a], spread[:, :, b]) for a, b in ((0, 0), (0, 1), (1, 1)))
    pixel = area / np.abs(determinant[sound])
    mean, half = (e + g) / 2, np.hypot((e - g) / 2, f)
    out[0, sound], out[1, sound], out[2, sound] = np.sqrt(pixel), (mean + half) / pixel, area
    if asked is not None:
        vectors = asked[sound]
        normal = normal / area[:, None]
        lying = vectors - (vectors * normal).sum(axis=1)[:, None] * normal
        length = np.linalg.norm(lying, axis=1)
        known = length > 1e-3 * np.linalg.norm(vectors, axis=1)
        along = spread[:, :, 1]
        cosine = (lying * along).sum(axis=1) / np.where(known, length * np.sqrt(g), 1.0)
        angle = np.degrees(np.arccos(np.clip(np.abs(cosine) if axial else cosine, -1.0, 1.0)))
        out[3, sound], out[4, sound] = np.where(known, angle, 0.0), known
    return out
