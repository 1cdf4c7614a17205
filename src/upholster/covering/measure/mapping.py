"""The size and direction of the texture on the surface, compared with the requested ones."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.charted_surface import charted_surface
from upholster.charts.creases import default_crease
from upholster.charts.directions.direction import Direction
from upholster.charts.directions.field import direction_field
from upholster.charts.directions.level_directions import requested_at_corners
from upholster.charts.directions.patch_directions import vectors_on_patches
from upholster.covering.measure.measure_rows import Row, figure
from upholster.covering.measure.places import surface_samples
from upholster.covering.measure.samples import Window
from upholster.covering.measure.scale import FINER, quantiles
from upholster.covering.measure.trace import Trace
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.displacement import centre_matrices
from upholster.quilt.model import Quilt
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField

__all__ = ["MappingReport", "mapping", "mesh_mapping"]

FAST, PIECE = 20.0, 0.1
"""Degrees of turn over a length, as a share of the exemplar's width. A piece of texture of that length and
true size is off by half of the turn from its middle to its end: 5°."""

_LEAST_ASKED = 0.03
"""Sine of the angle between normal and direction: below this no direction is requested."""


@dataclass(frozen=True, slots=True)
class MappingReport:
    """How the texture is mapped to a surface; all figures weight every part of the surface by its area.

    A size is the length on the surface of the exemplar's unit, over the requested length: 1 is exact.

    Attributes
    ----------
    within
        Share of the area where the size is within 5 % of the requested one, 0 to 1.
    error
        Mean absolute log2 of the size, in octaves.
    error_95
        95th percentile of the same: 0.0704 is 5 %.
    stretch_95
        95th percentile of the greatest over the least stretch from exemplar to surface: 1 keeps shapes.
    aligned
        Share of the area where the direction is within 5° of the requested one; None if there is none.
    angle_95
        95th percentile of the angle between the two, in degrees; None as above.
    fast
        Share of the area where the requested direction turns fast, as around its singular points: by more
        than `FAST` degrees over `PIECE` of the exemplar's width. None if that is not known.
    aligned_slow
        The share `aligned` of the remaining area; None as above.
    """

    within: float
    error: float
    error_95: float
    stretch_95: float
    aligned: float | None
    angle_95: float | None
    fast: float | None = None
    aligned_slow: float | None = None

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        rows = [
            ("texture size within 5 %", f"{100 * self.within:.1f} %", "of the area"),
            ("texture size error, mean", f"{self.error:.3f} octaves", "0: as asked"),
            ("texture size error, 95 %", f"{self.error_95:.3f} octaves", "0.07: within 5 %"),
            ("texture stretch, 95 %", figure(self.stretch_95), "1: keeps shapes"),
        ]
        if self.aligned is not None and self.angle_95 is not None:
            rows += [
                ("direction within 5°", f"{100 * self.aligned:.1f} %", "of the area"),
                ("direction error, 95 %", f"{self.angle_95:.2f}°", "0: as asked"),
            ]
        if self.fast is not None and self.aligned_slow is not None:
            rows += [
                ("direction turns fast", f"{100 * self.fast:.1f} %", "of the area"),
                ("  within 5° elsewhere", f"{100 * self.aligned_slow:.1f} %", "of the other area"),
            ]
        return rows


def mapping(
    surface: AnySurface,
    quilt: Quilt,
    *,
    scale: float | None = None,
    direction: Direction | None = None,
) -> MappingReport:
    """Measure size and direction of the texture on the surface, wherever a placement paints it.

    A texel q of a block with centre c comes from ``source + T·½(M(c) + M(q))·(q - c)``, whose derivative G
    takes texel steps to exemplar pixels; the surface's derivatives per texel step, J (3×2), take them to
    space: those of the charted surface's triangles. The size is ``√(|J_r × J_c| / |det G|)`` times the
    scale; the stretches are the singular values of J·G⁻¹; the direction is J·G⁻¹·(0, 1), where the exemplar's
    columns go. Evaluated at places spread over the area.

    Parameters
    ----------
    surface, quilt
        What was covered, and its quilt.
    scale
        The requested exemplar pixels per unit of length; by default the median of those found.
    direction
        The requested direction, as `upholster.charts.directions.level_directions.requested_at_corners`
        defines it; on flat faces, and for ``smooth``, ``curvature`` and ``edges``, as the field of directions
        has it. By default directions are not measured.

    Returns
    -------
    MappingReport
        Shares, octaves and degrees.

    Raises
    ------
    InputError
        If the scale is not positive and finite, a chart names a face that the surface does not have, no
        painted texel has any area, or the direction is nowhere along the surface.

    References
    ----------
    Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3: singular
    values as local stretch.
    """
    asked = None if direction is None else _asked(surface, quilt, direction)
    return mesh_mapping(surface, quilt, scale=scale, asked=asked)


def mesh_mapping(
    surface: AnySurface, quilt: Quilt, *, scale: float | None = None, asked: FloatArray | None = None
) -> MappingReport:
    """Measure size and direction of the texture, as `mapping` does, for directions requested at corners.

    Parameters
    ----------
    surface, quilt, scale
        As for `mapping`.
    asked
        (T, 3, 3) the direction requested at the corners of the charted surface's triangles, in their planes,
        see `requested_at_corners`: interpolated over each; none where its length is below 0.03.
    """
    if scale is not None and not (np.isfinite(scale) and scale > 0):
        raise InputError(f"scale is {scale}; allowed: a positive number of sample pixels per unit")
    charted = charted_surface(surface, quilt.charts, finer=FINER)
    samples = surface_samples(charted)
    parts = [np.zeros((6, 0))]
    for index, chart in enumerate(quilt.charts):
        own = samples.chart == index
        if not own.any():
            continue
        trace = Trace.of(quilt, Window(index, 0, 0, chart.height, chart.width))
        (rows, columns), triangle = samples.texel[own].T, samples.triangle[own]
        jacobian = _jacobian(trace.field, trace.placements[trace.owners[rows, columns]], rows, columns)
        wanted = turn = None
        if asked is not None:
            wanted = (samples.shares[own, :, None] * asked[triangle]).sum(axis=1)
            wanted[np.linalg.norm(wanted, axis=1) < _LEAST_ASKED] = 0.0
            turn = _turning(charted.mesh.corners[triangle], asked[triangle], wanted)
        found = _at_samples(charted.steps[triangle], jacobian, wanted)
        found[2] = 1.0  # samples are spread by area, not by texels
        found[5] = 0.0 if turn is None else turn
        parts.append(found)
    return _report(np.concatenate(parts, axis=1), scale, PIECE * quilt.exemplar_shape[1])


def _asked(surface: AnySurface, quilt: Quilt, direction: Direction) -> FloatArray:
    # (T, 3, 3): the direction itself, or the field if only that has it.
    charted = charted_surface(surface, quilt.charts, finer=FINER)
    if isinstance(surface, Surface):
        direction = vectors_on_patches(surface, charted, direction)
    crease = default_crease(charted.mesh)
    asked = requested_at_corners(charted.mesh, direction, crease)
    field = direction_field(charted.mesh, direction, crease=crease)
    return field.corner_vectors if asked is None else field.with_flat_faces(asked)


def _turning(corners: FloatArray, asked: FloatArray, here: FloatArray) -> FloatArray:
    """Return how many degrees per unit of length directions turn, (n,), at places of triangles.

    `corners` and `asked` (n, 3, 3) are the triangles' corners and their vectors, `here` (n, 3) the vectors in
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
    """Return the Jacobians from texel steps to exemplar pixels, (n, 2, 2), at texels that placements own."""
    centre = np.stack([owner["row"], owner["column"]], axis=1) / 16 - 0.5  # as steps are counted
    middle = centre_matrices(field, owner).reshape(-1, 2, 2) / UNIT
    derivative = _derivative(field, middle, centre, np.stack([rows, columns], axis=1))
    out: FloatArray = SYMMETRIES[owner["symmetry"]].reshape(-1, 2, 2) @ derivative
    return out


def _report(parts: FloatArray, scale: float | None, piece: float | None = None) -> MappingReport:
    # `piece`, in exemplar pixels: if given, `parts` include how fast the requested direction turns.
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
    pace = piece is not None and known.any()
    return MappingReport(
        within=float(np.average(ratio <= np.log2(1.05), weights=area)),
        error=float(np.average(ratio, weights=area)),
        error_95=quantiles(ratio, area, (0.95,))[0],
        stretch_95=quantiles(stretch, area, (0.95,))[0],
        aligned=float(np.average(angle[known] <= 5, weights=area[known])) if known.any() else None,
        angle_95=quantiles(angle[known], area[known], (0.95,))[0] if known.any() else None,
        fast=1.0 - float(area[slow].sum() / area[known].sum()) if pace else None,
        aligned_slow=float(np.average(angle[slow] <= 5, weights=area[slow])) if pace and slow.any() else None,
    )


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
    across = nodes[i, m] * (1 - down) + nodes[k, m] * down
    slopes = [
        (b - a) / FIELD_STEP * inside[:, axis, None, None]
        for axis, (a, b) in enumerate(((upper, lower), (left, across)))
    ]
    return upper * (1 - down) + lower * down, slopes[0], slopes[1]


def _at_samples(steps: FloatArray, jacobian: FloatArray, asked: FloatArray | None) -> FloatArray:
    """Return (6, n): size times scale, stretch, area, angle in degrees, 1 if a direction was requested, 0."""
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
        angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        out[3, sound], out[4, sound] = np.where(known, angle, 0.0), known
    return out
