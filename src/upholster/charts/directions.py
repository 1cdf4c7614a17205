"""Which way the texture runs, and the warp fields that follow from it.

At a texel, let J = [J_r, J_c] be the surface's derivatives by texel rows and columns, e1 the unit tangent
along the wanted direction and e2 = e1 × n, clockwise from it seen from outside. Then ``M = ρ·[e2ᵀ; e1ᵀ]·J``
takes a texel step to an exemplar-pixel step so that the texture lies on the surface undistorted, ρ pixels per
unit of length.
"""

import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from math import ceil

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.charts.corner_fit import Corner, fitted_at_corner
from upholster.charts.seams import ChartSeam, find_seams
from upholster.charts.tangents import Frames, aligned, chart_frames, dot, node_texels, patch_frames, within
from upholster.charts.transitions import SAMPLES, transitions
from upholster.errors import InputError
from upholster.geometry import SharedEdge, Surface
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField, node_count
from upholster.types import FloatArray

__all__ = [
    "LEAST_SLOPE",
    "Direction",
    "Vectors",
    "called",
    "default_direction",
    "direction_fields",
    "parse_direction",
]

Vectors = Callable[[FloatArray], ArrayLike]
"""Points (n, 3) in model units to directions (n, 3) of any length, not zero."""

Nodes = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]
"""Indices of nodes on patches: patches, rows, columns."""

NODES = 9
"""Nodes of the coarse grid over each patch, each way."""

ALLOWED = "level, u, v, degrees from u, a vector x,y,z, or around:x, y, z or x,y,z"

LEAST_SLOPE = 0.05
"""Sine of the steepest slope below which a chart has no level direction of its own: it lies flat."""

_SHORT, _FINER = 36, 8
"""A chart of fewer texels is looked at in so many places for each node."""

_TURNING = np.cos(np.radians(15))
"""Cosine of the angle up to which a chart's rows of texels may turn from node to node: where they turn by
more, as round a pole, signs of lines are looked for in as many places between."""

_NEAR_CHART = 2
"""Texels beyond a chart that count as those on it."""

_BEYOND = (0.002, 0.01, 0.05, 0.25)
"""What places farther away weigh: as little as leaves all matrices sound."""

_LEAST_AREA = 0.2
"""Of what is found at a node: less is not sound."""

AGREED = np.cos(np.radians(15))
"""Cosine of the angle up to which directions on both sides of an edge count as one."""

NUMBER = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"


@dataclass(frozen=True, slots=True)
class Direction:
    """A direction on a surface: of the exemplar's rows of pixels, left to right.

    Attributes
    ----------
    text
        As the user writes it: see `parse_direction`.
    along
        ``"u"`` or ``"v"``: along a patch's t or s; `angle` counts from there. ``"level"``: to the right along
        lines of equal height. Empty: along `vectors`.
    angle
        Degrees, clockwise seen from outside: from +column towards +row.
    vectors
        Points to vectors in space, which are projected on the surface.
    """

    text: str
    along: str = ""
    angle: float = 0.0
    vectors: Vectors | None = None


def parse_direction(text: str | Vectors) -> Direction:
    """Return the direction that a text, or a function of points, stands for.

    Parameters
    ----------
    text
        ``level`` (to the right, seen from outside, along lines of equal z), ``u`` (along the patches' t: to
        the right along texel rows), ``v`` (along s), a number (degrees from
        u, clockwise seen from outside), ``x,y,z`` (a vector in space, projected on the surface),
        ``around:z`` (or ``x``, ``y``, or an axis ``x,y,z``: round that axis through the origin, with it as a
        right-handed screw turns); or a function of points (n, 3), in model units, to vectors (n, 3).

    Raises
    ------
    InputError
        If the text is none of these, a number is not finite, or a vector is zero.
    """
    if not isinstance(text, str):
        if not callable(text):
            raise InputError(f"direction is a {type(text).__name__}; allowed: {ALLOWED}, or a function")
        return Direction(getattr(text, "__name__", "function"), vectors=text)
    written = text.strip()
    if written in ("level", "u", "v"):
        return Direction(written, along=written)
    if re.fullmatch(NUMBER, written):
        angle = float(written)
        if abs(angle) > 36000:
            raise InputError(f"direction is {written[:40]} degrees; allowed: -36000 to 36000")
        return Direction(written, along="u", angle=angle)
    kind, colon, rest = written.partition(":")
    if colon and kind.strip() != "around":
        raise InputError(f"direction is {written[:40]!r}; allowed: {ALLOWED}")
    name = (rest if colon else kind).strip()
    if colon and name in ("x", "y", "z"):
        vector = np.eye(3)["xyz".index(name)]
    elif re.fullmatch(f"{NUMBER},{NUMBER},{NUMBER}", name):
        vector = np.array([float(part) for part in name.split(",")])
    else:
        raise InputError(f"direction is {written[:40]!r}; allowed: {ALLOWED}")
    size = np.abs(vector).max()
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"direction is {written[:40]!r}; allowed: a finite vector that is not zero")
    vector = vector / size
    vector /= np.linalg.norm(vector)
    if colon:
        return Direction(written, vectors=lambda points: np.cross(vector, points))
    return Direction(written, vectors=lambda points: np.broadcast_to(vector, points.shape))


def default_direction(surface: Surface) -> Direction:
    """Return a direction that suits a surface: ``u`` if it goes on from face to face, else ``level``.

    On a ring that is closed both ways, rows run the longer way round: ``u`` or ``v``.

    Raises
    ------
    InputError
        If more than two edges claim one interval: names them.
    """
    outer = surface.outer_shared
    # Only the patches there, renumbered.
    members = sorted({patch for seam in outer for patch in (seam.patch, seam.other_patch)})
    if not members:
        return parse_direction("u")
    if _is_longer_down(surface):
        return parse_direction("v")
    number = {patch: n for n, patch in enumerate(members)}
    seams = [replace(m, patch=number[m.patch], other_patch=number[m.other_patch]) for m in outer]
    frames = patch_frames([surface.patches[patch] for patch in members], NODES)
    agreement = _agreement(seams, frames, frames.right, (0.25, 0.5, 0.75))[2]
    return parse_direction("u" if np.mean(agreement > AGREED) >= 0.95 else "level")


def _is_longer_down(surface: Surface) -> bool:
    """Whether the surface is one face that is closed both ways, and is longer along s than along t."""
    closed = {seam.edge & 1 for seam in surface.face_shared if (seam.edge - seam.other_edge) % 4 == 2}
    if len(surface.faces) != 1 or closed != {0, 1}:
        return False
    face = surface.faces[0]
    down, right = (np.arange(NODES * count) / NODES for count in (face.rows, face.columns))
    _, by_s, by_t = face.derivatives_grid(down, right)
    lengths = [np.linalg.norm(by, axis=2).mean() for by in (by_s, by_t)]
    return bool(lengths[0] * face.rows > 1.01 * lengths[1] * face.columns)


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
    lines = None if direction.vectors is None else _lines(surface, direction.vectors)
    fields: list[WarpField | None] = []
    for index, chart in enumerate(charts):
        if not 0 <= chart.face < len(surface.faces):
            raise InputError(
                f"chart {index} lies on face {chart.face}; the surface has 0 to {len(surface.faces) - 1}"
            )
        corner = (corners or {}).get(index)
        finer = _finer(chart, corner)
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
        nodes = _at_nodes(matrices, chart, margin)
    else:
        nodes = fitted_at_corner(matrices, chart, margin, corner, _FINER)
    field = WarpField.quantised(scale * nodes, margin=margin)
    return WarpField.identity() if field.is_identity else field


def _finer(chart: Chart, corner: Corner | None = None) -> tuple[int, int]:
    """Return how many places there are from node to node at which a chart is looked at, down and right."""
    down, right = (
        _FINER if count < _SHORT or corner is not None else 1 for count in (chart.height, chart.width)
    )
    return down, right


def _at_nodes(matrices: FloatArray, chart: Chart, margin: int) -> FloatArray:
    """Return the matrices at a chart's nodes between which all those that were found lie best.

    Where a chart is short, few nodes lie on it: they are fitted to places between them, each weighed by
    whether it lies on the chart. Where that leads astray, as round a pole, they stay as found.
    """
    down, right = _finer(chart)
    found = matrices[::down, ::right]
    if (down, right) == (1, 1):
        return found
    least = _LEAST_AREA * np.linalg.det(found)
    for beyond in _BEYOND:
        fitted = matrices
        for axis, (count, finer) in enumerate(((chart.height, down), (chart.width, right))):
            if finer > 1:
                fit = _fit(count, margin, finer, beyond)
                fitted = np.moveaxis(np.tensordot(fit, fitted, axes=(1, axis)), 0, axis)
        sound = np.linalg.det(fitted) > least
        if sound.all():
            break
    return np.where(sound[..., None, None], fitted, found)


def _fit(texels: int, margin: int, finer: int, beyond: float) -> FloatArray:
    """Return the matrix that takes what is found at `finer` places for each node to nodes: least squares."""
    places, count = node_texels(texels, margin, finer), node_count(texels, margin)
    hats = np.maximum(0.0, 1 - np.abs(np.arange(len(places))[:, None] / finer - np.arange(count)))
    on = (places >= -_NEAR_CHART) & (places <= texels - 1 + _NEAR_CHART)
    weighed = hats * np.where(on, 1.0, beyond)[:, None]
    fit: FloatArray = np.linalg.solve(weighed.T @ hats, weighed.T)
    # Nodes beside which nothing lies on the chart stay as found.
    far = ~(hats[on] > 0).any(axis=0)
    fit[far] = np.eye(len(places))[::finer][far]
    return fit


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
                f"({_written(middle[0])}), nor on any that it hangs together with; allowed: one that is "
                "tangent somewhere on each piece of the surface"
            )
        missing.remove(n)
        angle = 0.0 if best is None else _angle_beyond(surface, charts, best, fields[best.chart])
        frames = chart_frames(surface.faces[charts[n].face], charts[n], margin, _finer(charts[n]))
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
    down, aside = (_FINER if turn.min() < _TURNING else 1 for turn in turns)
    return down, aside


def _lines(surface: Surface, vectors: Vectors) -> FloatArray:
    """Return e1 on a coarse grid over each patch, (patches, nodes, nodes, 3), of one sign where possible.

    Signs spread over the patches from the strongest one, through the edges where the least is lost first.
    """
    frames = patch_frames(surface.patches, NODES)
    tangents, left = within(frames, called(vectors, frames.points, lambda patch: f"patch {patch}"))
    tangents = aligned(tangents, left)
    ends, nodes, agreement = _agreement(surface.shared, frames, tangents, (0.5,))
    strength = np.minimum(left[nodes[0]], left[nodes[1]]) * np.abs(agreement)
    beside: dict[int, list[tuple[float, int, float]]] = defaultdict(list)
    for (a, b), strong, sign in zip(ends.tolist(), strength.tolist(), agreement.tolist(), strict=True):
        beside[a].append((-strong, b, sign))
        beside[b].append((-strong, a, sign))
    signs = np.zeros(len(tangents))
    for start in np.argsort(-left.max(axis=(1, 2)), kind="stable").tolist():
        queue = [(0.0, start, 1.0)] if not signs[start] else []
        while queue:
            _, patch, sign = heappop(queue)
            if not signs[patch]:
                signs[patch] = sign
                for weight, other, turned in beside[patch]:
                    heappush(queue, (weight, other, -sign if turned < 0 else sign))
    return signs[:, None, None, None] * tangents


def _agreement(
    seams: Sequence[SharedEdge], frames: Frames, tangents: FloatArray, along: Sequence[float]
) -> tuple[NDArray[np.int64], tuple[Nodes, Nodes], FloatArray]:
    """Compare tangents on both sides of shared edges, the surface unfolded along them.

    Returns
    -------
    ndarray
        (N, 2) int64: the patches; each shared interval once for every share of it in `along`.
    tuple
        The nodes that stand for its two sides.
    ndarray
        (N,) float64: cosines of the angles between their tangents.
    """
    found = []
    for one in seams:
        for share in along:
            mine = one.start + share * (one.stop - one.start)
            theirs = one.other_start + share * (one.other_stop - one.other_start)
            found.append(
                (one.patch, one.edge, mine, one.other_patch, one.other_edge, theirs, 1 - 2 * one.opposed)
            )
    table = np.array(found, np.float64).reshape(-1, 7)
    sides, parts = [], []
    for first, symmetry in ((0, np.ones(len(table))), (3, table[:, 6])):
        patch, edge = table[:, first].astype(int), table[:, first + 1].astype(int)
        node = np.rint((NODES - 1) * table[:, first + 2]).astype(int)
        last = np.full(len(table), NODES - 1)
        rows, columns = (
            np.choose(edge, (0 * last, node, last, node)),
            np.choose(edge, (node, last, node, 0 * last)),
        )
        nodes = (patch, rows, columns)
        # A step along edges 0 and 2 is one by columns, along edges 1 and 3 one by rows; by (right, across).
        x = np.where(edge % 2 == 0, 1.0, frames.shift[nodes])
        y = np.where(edge % 2 == 0, 0.0, frames.height[nodes])
        size = symmetry * np.hypot(x, y)
        cosine, sine = dot(tangents[nodes], frames.right[nodes]), dot(tangents[nodes], frames.across[nodes])
        parts.append(((cosine * x + sine * y) / size, (sine * x - cosine * y) / size))
        sides.append(nodes)
    (a, b), (c, d) = parts
    return table[:, [0, 3]].astype(np.int64), (sides[0], sides[1]), a * c + b * d


def called(vectors: Vectors, points: FloatArray, place: Callable[[int], str] | None = None) -> FloatArray:
    """Return the vectors at points (…, 3), checked; `place` tells where the points with a first index are.

    Raises
    ------
    InputError
        If the function fails, or returns another shape or what is not finite: names the place.
    """
    flat = points.reshape(-1, 3)
    try:
        found = np.asarray(vectors(flat), np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"direction: the function fails: {error}".splitlines()[0]) from None
    if found.shape != flat.shape:
        raise InputError(f"direction: the function returns shape {found.shape}; allowed: {flat.shape}")
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        n = int(bad.argmax())
        where = "" if place is None else f"on {place(n * len(points) // len(flat))}, "
        raise InputError(f"direction is not finite {where}at ({_written(flat[n])}); allowed: finite vectors")
    return found.reshape(points.shape)


def _written(point: FloatArray) -> str:
    return ", ".join(f"{x:.4g}" for x in point)
