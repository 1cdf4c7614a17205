"""Which way the texture runs, and the warp fields that follow from it.

At a texel, let J = [J_r, J_c] be the surface's derivatives by texel rows and columns, e1 the unit tangent
along the wanted direction and e2 = e1 × n, clockwise from it seen from outside. Then ``M = ρ·[e2ᵀ; e1ᵀ]·J``
takes a texel step to an exemplar-pixel step so that the texture lies on the surface undistorted, ρ pixels per
unit of length.
"""

from collections.abc import Mapping, Sequence
from math import ceil

import numpy as np

from upholster.charts.corner_fit import Corner, fitted_at_corner
from upholster.charts.directions.direction import Direction, Vectors, called, written_point
from upholster.charts.directions.nodes import FINER, finer_places, matrices_at_nodes
from upholster.charts.directions.patches import NODES, signed_lines
from upholster.charts.seams import ChartSeam, find_seams
from upholster.charts.tangents import Frames, aligned, chart_frames, dot, node_texels, within
from upholster.charts.transitions import SAMPLES, transitions
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray

__all__ = ["LEAST_SLOPE", "direction_fields"]

LEAST_SLOPE = 0.05
"""Sine of the steepest slope below which a chart has no level direction of its own: it lies flat."""

_TURNING = np.cos(np.radians(15))
"""Cosine of the angle up to which a chart's rows of texels may turn from node to node: where they turn by
more, as round a pole, signs of lines are looked for in as many places between."""


def direction_fields(
    surface: Surface,
    charts: Sequence[Chart],
    direction: Direction,
    scale: float,
    *,
    margin: int = 1,
    corners: Mapping[int, Corner] | None = None,
) -> tuple[WarpField, ...]:
    """Return each chart's warp field: the texture lies on the surface at true scale, in the direction.

    Beyond a face its derivatives go on as they are at its border. Vectors are projected on the tangent
    plane; what is left is taken for a line: its sign is made one within each chart and across shared edges as
    far as that is possible, so that nothing turns round where a projection passes through zero. Where there
    is none (singular points), directions come from near by; on a whole chart without any, as on the lid of a
    box whose direction is up, from the chart with which it shares most.

    Parameters
    ----------
    surface
        The surface.
    charts
        Its layout.
    direction
        Which way the exemplar's rows of pixels run.
    scale
        Exemplar pixels per model unit, positive.
    margin
        Nodes before texel 0 and beyond the last one, 0 to 64; every `FIELD_STEP` texels.
    corners
        Of charts, by their numbers, about which the direction turns: see `upholster.charts.poles`.

    Returns
    -------
    tuple
        One `WarpField` per chart, or None where it is the identity everywhere.

    Raises
    ------
    InputError
        If `scale` or `margin` is out of range, a chart names a face that is not there, or the direction is
        zero all over the surface, not finite, or no array of vectors: names the place.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(f"scale is {scale}; allowed: a finite number above 0, in pixels per model unit")
    if not 0 <= margin <= 64:
        raise InputError(f"margin is {margin} nodes; allowed: 0 to 64")
    lines = None if direction.vectors is None else signed_lines(surface, direction.vectors)
    fields: list[WarpField | None] = []
    for index, chart in enumerate(charts):
        if not 0 <= chart.face < len(surface.faces):
            raise InputError(
                f"chart {index} lies on face {chart.face}; the surface has 0 to {len(surface.faces) - 1}"
            )
        corner = (corners or {}).get(index)
        finer = finer_places(chart, corner)
        frames = chart_frames(surface.faces[chart.face], chart, margin, finer)
        if direction.along in ("", "level"):
            if lines is not None and direction.vectors is not None:
                tangents = _tangents(surface, frames, direction.vectors, lines, index, chart, margin, finer)
            else:
                tangents = _level(frames)
            if tangents is None:
                fields.append(None)
                continue
            cosine, sine = dot(tangents, frames.right), dot(tangents, frames.across)
        else:
            start = np.arctan2(frames.height, frames.shift) if direction.along == "v" else np.zeros(1)
            angle = start + np.radians(direction.angle)
            cosine, sine = np.cos(angle), np.sin(angle)
        fields.append(_field(frames, cosine, sine, scale, chart, margin, corner))
    return _filled(surface, charts, fields, scale, margin, needed=direction.along != "level")


def _level(frames: Frames) -> FloatArray | None:
    """Return e1 along lines of equal height at a chart's nodes; None if it lies flat."""
    vectors = np.cross((0.0, 0.0, 1.0), np.cross(frames.across, frames.right))
    if not np.sqrt(dot(vectors, vectors)).max() > LEAST_SLOPE:
        return None
    return within(frames, vectors)[0]


def _field(
    frames: Frames,
    cosine: FloatArray,
    sine: FloatArray,
    scale: float,
    chart: Chart,
    margin: int,
    corner: Corner | None = None,
) -> WarpField:
    """Return the field of directions that lie at angles clockwise from texel rows."""
    matrices = np.empty((*frames.width.shape, 2, 2))
    matrices[..., 0, 0] = cosine * frames.height - sine * frames.shift
    matrices[..., 0, 1] = -sine * frames.width
    matrices[..., 1, 0] = cosine * frames.shift + sine * frames.height
    matrices[..., 1, 1] = cosine * frames.width
    if corner is None:
        nodes = matrices_at_nodes(matrices, chart, margin)
    else:
        nodes = fitted_at_corner(matrices, chart, margin, corner, FINER)
    field = WarpField.quantised(scale * nodes, margin=margin)
    return WarpField.identity() if field.is_identity else field


def _filled(
    surface: Surface,
    charts: Sequence[Chart],
    fields: list[WarpField | None],
    scale: float,
    margin: int,
    *,
    needed: bool,
) -> tuple[WarpField, ...]:
    """Give charts without direction that of the chart with which they share most, chart after chart.

    Across the seam the texture goes on; from there it keeps its angle to the chart's rows of texels. Where
    nothing goes on it lies along these, unless a direction is `needed`.
    """
    missing = {n for n, field in enumerate(fields) if field is None}
    across = [m for m in find_seams(surface, charts) if m.other_chart in missing] if missing else []
    while missing:
        best = max(
            (m for m in across if m.other_chart in missing and m.chart not in missing),
            key=lambda m: (float(f"{m.stop - m.start:.9g}"), -m.other_chart, -m.chart, -m.edge),
            default=None,
        )
        n = min(missing) if best is None else best.other_chart
        if best is None and needed:
            place = charts[n]
            middle = surface.faces[place.face].points(
                np.array([(place.s0 + place.s1) / 2]), np.array([(place.t0 + place.t1) / 2])
            )
            raise InputError(
                f"direction has no part along the surface on chart {n} (face {place.face}), at "
                f"({written_point(middle[0])}), nor on any that it hangs together with; allowed: one that is "
                "tangent somewhere on each piece of the surface"
            )
        missing.remove(n)
        angle = 0.0 if best is None else _angle_beyond(surface, charts, best, fields[best.chart])
        frames = chart_frames(surface.faces[charts[n].face], charts[n], margin, finer_places(charts[n]))
        cosine, sine = np.full(1, np.cos(angle)), np.full(1, np.sin(angle))
        fields[n] = _field(frames, cosine, sine, scale, charts[n], margin)
    return tuple(field for field in fields if field is not None)


def _angle_beyond(
    surface: Surface, charts: Sequence[Chart], seam: ChartSeam, field: WarpField | None
) -> float:
    """Return the mean angle, clockwise from texel rows, at which a chart's texture goes on beyond a seam."""
    assert field is not None
    (transition,) = transitions(surface, charts, [seam])
    along = np.linspace(seam.start, seam.stop, SAMPLES) - 0.5
    line = np.full(SAMPLES, transition.line)
    rows, columns = (along, line) if seam.edge & 1 else (line, along)
    with np.errstate(invalid="ignore"):
        there = field.at(rows, columns) @ np.linalg.inv(transition.matrices)
    angles = np.arctan2(-there[:, 0, 1], there[:, 1, 1])
    angles = angles[np.isfinite(angles)]
    if not len(angles):
        return 0.0
    return float(np.arctan2(np.sin(angles).mean(), np.cos(angles).mean()))


def _tangents(
    surface: Surface,
    frames: Frames,
    vectors: Vectors,
    lines: FloatArray,
    index: int,
    chart: Chart,
    margin: int,
    finer: tuple[int, int],
) -> FloatArray | None:
    """Return e1 at a chart's places, `finer` of them from node to node.

    Its sign is that of the lines on the patch of the strongest place. None where nothing is left of the
    vectors on the whole chart.
    """
    place = f"chart {index} (face {chart.face})"
    between = _between(frames)
    if between != (1, 1):
        steps = finer[0] * between[0], finer[1] * between[1]
        frames = chart_frames(surface.faces[chart.face], chart, margin, steps)
    tangents, left = within(frames, called(vectors, frames.points, lambda _: place))
    if not left.max() > 1e-6:
        return None
    tangents = aligned(tangents, left)[:: between[0], :: between[1]]
    left = left[:: between[0], :: between[1]]
    strongest = np.unravel_index(left.argmax(), left.shape)
    patches, nodes = [], []
    for low, high, node, count, step in (
        (chart.s0, chart.s1, int(strongest[0]), chart.height, finer[0]),
        (chart.t0, chart.t1, int(strongest[1]), chart.width, finer[1]),
    ):
        places = node_texels(count, margin, step)
        at = min(max(low + (high - low) * places[node] / count, low), high)
        patches.append(min(int(at), ceil(high) - 1))
        nodes.append(round((NODES - 1) * (at - patches[-1])))
    line = lines[surface.patch_number(chart.face, *patches), *nodes]
    return tangents if tangents[strongest] @ line >= 0 else -tangents


def _between(frames: Frames) -> tuple[int, int]:
    """Return into how many steps each from place to place is cut for signs to be sure, down and right."""
    right = frames.right
    turns = dot(right[1:], right[:-1]), dot(right[:, 1:], right[:, :-1])
    down, aside = (FINER if turn.min() < _TURNING else 1 for turn in turns)
    return down, aside
