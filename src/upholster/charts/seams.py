"""Where charts meet, and how texels are transferred from one to the next.

Charts are rectangles of faces, of any size; they meet across shared edges of faces and inside a face, by
whole sides or parts of sides.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.quilt.chart import Chart
from upholster.types import FloatArray, frozen_array

__all__ = ["SAMPLES", "ChartSeam", "Transition", "find_seams", "transitions"]

SAMPLES = 9
"""Places along a seam at which a transition holds a matrix."""

EPS = 1e-6
"""In face parameters: lines closer than this are one, and intervals shorter than this are none."""

INSET = 1e-3
"""The outermost samples are taken this share of the interval inside, where a pole has its limit."""

# Per edge, in (row, column) steps: along it, as its parameter grows, and outward across it.
_ALONG: FloatArray = np.array([(0.0, 1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 0.0)])
_OUTWARD: FloatArray = np.array([(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0)])

IndexArray = NDArray[np.intp]

Part = tuple[float, float, int]
"""A chart's part of a line: from, to (in the face's parameter along it), and the chart's index."""


@dataclass(frozen=True, slots=True)
class ChartSeam:
    """An interval of a chart's edge, and the interval of another chart's edge (or of its own) that meets it.

    Edge numbers: 0 top, 1 right, 2 bottom, 3 left. A place along an edge is told in texels from the chart's
    first row or column line: 0 to the chart's height or width, so texel k's centre lies at k + ½. The map
    between the two intervals is linear.

    Attributes
    ----------
    chart, edge
        Whose interval it is.
    start, stop
        The interval, start < stop.
    other_chart, other_edge
        Who is on the other side.
    other_start, other_stop
        What meets `start` and `stop`: other_start > other_stop where the two edges run in opposite
        directions.
    """

    chart: int
    edge: int
    start: float
    stop: float
    other_chart: int
    other_edge: int
    other_start: float
    other_stop: float

    def flipped(self) -> "ChartSeam":
        """Return the same seam seen from the other side."""
        ends = sorted([(self.other_start, self.start), (self.other_stop, self.stop)])
        (start, other_start), (stop, other_stop) = ends
        return ChartSeam(
            self.other_chart, self.other_edge, start, stop, self.chart, self.edge, other_start, other_stop
        )


@dataclass(frozen=True, eq=False, slots=True)
class Transition:
    """How texels of a chart, inside or beyond an edge, are transferred onto the chart that it meets there.

    The two tangent planes are unfolded about the edge into one: a crease keeps lengths, and where the surface
    is smooth this is its first order. Along the edge the map is the seam's own, exactly.

    Attributes
    ----------
    seam
        Where.
    line, other_line
        Row or column coordinate of the two edges' lines: −½, or the chart's height or width less ½.
    matrices
        (`SAMPLES`, 2, 2), read-only, at even distances from `start` to `stop`, linear between: what takes
        (row, column) steps on the chart to such steps on the other. NaN where a chart is degenerate.
    """

    seam: ChartSeam
    line: float
    other_line: float
    matrices: FloatArray

    def apply(self, rows: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Carry places from one chart to the other: ``foot_B + matrix(foot)·(place - foot)``.

        The foot is the seam's point nearest to a place, on the grid.

        Parameters
        ----------
        rows, columns
            (n,) on the chart, whose texel (r, c) has its centre at exactly (r, c).

        Returns
        -------
        rows, columns : FloatArray
            (n,) on the other chart, NaN where the matrix is.
        matrices : FloatArray
            (n, 2, 2): the matrix at each foot.
        """
        m = self.seam
        down = bool(m.edge & 1)  # the edge runs along the rows' axis
        along, across = (rows, columns) if down else (columns, rows)
        foot = np.clip(along + 0.5, m.start, m.stop)
        share = (foot - m.start) / (m.stop - m.start)
        place = share * (SAMPLES - 1)
        first = np.minimum(place.astype(np.intp), SAMPLES - 2)
        weight = (place - first)[:, None, None]
        matrices = (1.0 - weight) * self.matrices[first] + weight * self.matrices[first + 1]
        over, depth = along + 0.5 - foot, across - self.line
        step = np.stack([over, depth] if down else [depth, over], axis=1)
        out = (matrices @ step[:, :, None])[:, :, 0]
        other = (1.0 - share) * m.other_start + share * m.other_stop - 0.5
        out[:, 0] += other if m.other_edge & 1 else self.other_line
        out[:, 1] += self.other_line if m.other_edge & 1 else other
        return out[:, 0], out[:, 1], matrices


def find_seams(surface: Surface, charts: Sequence[Chart]) -> tuple[ChartSeam, ...]:
    """Find every interval along which two charts meet, seen from either side.

    Parameters
    ----------
    surface
        The surface.
    charts
        Rectangles of its faces that do not overlap.

    Returns
    -------
    tuple of ChartSeam
        Each seam twice, seen from either side; sorted by chart, edge and start. Borders and degenerate
        edges have none.

    Raises
    ------
    InputError
        If a chart names no face, has no texels or is no rectangle within its face; and as for
        `Surface.shared`.
    """
    _check(surface, charts)
    sides = _sides(surface, charts)
    found: list[ChartSeam] = []

    def meet(a: int, b: int, mine: list[Part], others: list[Part], ends: tuple[float, ...]) -> None:
        for one, other, part in _common(mine, others, ends):
            start, stop = _texels(charts[one], a, part[:2])
            other_start, other_stop = _texels(charts[other], b, part[2:])
            seam = ChartSeam(one, a, start, stop, other, b, other_start, other_stop)
            found.extend((seam, seam.flipped()))

    for (index, edge, line), mine in sides.items():
        face = surface.faces[index]
        most, long = (face.columns, face.rows) if edge & 1 else (face.rows, face.columns)
        if edge in (1, 2) and line < most:  # each line inside a face once, from its upper or left charts
            others = sides.get((index, (edge + 2) % 4, line), [])
            meet(edge, (edge + 2) % 4, mine, others, (0.0, long, 0.0, long))
    for shared in surface.face_shared:
        a, b = shared.edge, shared.other_edge
        mine, others = (
            sides.get((index, edge, surface.faces[index].line(edge)), [])
            for index, edge in ((shared.face, a), (shared.other_face, b))
        )
        meet(a, b, mine, others, (shared.start, shared.stop, shared.other_start, shared.other_stop))
    return tuple(sorted(found, key=lambda m: (m.chart, m.edge, m.start)))


def transitions(
    surface: Surface, charts: Sequence[Chart], found: Sequence[ChartSeam]
) -> tuple[Transition, ...]:
    """Make the transition of each of some `seams`, in their order.

    With T the edge's unit tangent, x the derivatives per texel outward on A and inward on B, and l those
    along the edge, a step outward on A is ``β = |x_A⊥| / |x_B⊥|`` steps inward on B and, along B's edge,
    ``(x_A·T - β·x_B·T) / (l_B·T)`` steps. A step along A's edge is as many along B's as the seam says.

    Parameters
    ----------
    surface, charts
        As for `seams`.
    found
        Some or all of their `seams`.
    """
    if not found:
        return ()
    chart, a, other_chart, b = np.array(
        [(m.chart, m.edge, m.other_chart, m.other_edge) for m in found], np.intp
    ).T
    start, stop, other_start, other_stop = np.array(
        [(m.start, m.stop, m.other_start, m.other_stop) for m in found]
    ).T
    shares = np.linspace(0.0, 1.0, SAMPLES)
    shares[0], shares[-1] = INSET, 1.0 - INSET

    def steps(chart: IndexArray, edge: IndexArray, first: FloatArray, last: FloatArray) -> list[FloatArray]:
        frames = _frames(surface, charts, chart, edge, np.outer(first, 1.0 - shares) + np.outer(last, shares))
        return [np.einsum("nksx,ns->nkx", frames[:, :, 1:], basis[edge]) for basis in (_ALONG, _OUTWARD)]

    along, outward = steps(chart, a, start, stop)
    other_along, other_outward = steps(other_chart, b, other_start, other_stop)
    slope = (other_stop - other_start) / (stop - start)
    # Both sides share in the tangent, so that a transition and its flipped one are each other's inverse.
    mean = 0.5 * (along + slope[:, None, None] * other_along)
    length = np.linalg.norm(mean, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent = mean / length[..., None]
        lean, depth = _split(outward, tangent)
        other_lean, other_depth = _split(-other_outward, tangent)
        across = depth / other_depth
        shift = slope[:, None] * (lean - across * other_lean) / length
    least = 1e-12 * surface.size
    sound = (length > least) & (depth > least) & (other_depth > least)
    across[~sound] = shift[~sound] = np.nan

    image = across[..., None] * -_OUTWARD[b][:, None] + shift[..., None] * _ALONG[b][:, None]
    matrices = image[..., :, None] * _OUTWARD[a][:, None, None]
    matrices += slope[:, None, None, None] * (_ALONG[b][:, :, None] * _ALONG[a][:, None])[:, None]
    frozen_array(matrices)
    return tuple(
        Transition(m, _line(charts[m.chart], m.edge), _line(charts[m.other_chart], m.other_edge), matrices[n])
        for n, m in enumerate(found)
    )


def _check(surface: Surface, charts: Sequence[Chart]) -> None:
    last = len(surface.faces) - 1
    for n, c in enumerate(charts):
        if not 0 <= c.face <= last:
            raise InputError(f"chart {n} lies on face {c.face}; allowed: 0 to {last}")
        face = surface.faces[c.face]
        if c.height < 1 or c.width < 1:
            raise InputError(f"chart {n} has {c.height} x {c.width} texels; allowed: 1 or more each way")
        for low, high, most in ((c.s0, c.s1, face.rows), (c.t0, c.t1, face.columns)):
            if not (low >= 0.0 and high <= most and high - low > 2 * EPS):
                raise InputError(
                    f"chart {n} reaches from {low:.17g} to {high:.17g}; allowed: rising, 0 to {most}, "
                    f"more than {2 * EPS:g} apart"
                )


def _sides(surface: Surface, charts: Sequence[Chart]) -> dict[tuple[int, int, float], list[Part]]:
    """Return the charts' sides by face, edge and the parameter of their line, sorted along it."""
    lines: dict[tuple[int, int], list[float]] = defaultdict(list)
    for c in charts:
        lines[c.face, 0] += (c.s0, c.s1)
        lines[c.face, 1] += (c.t0, c.t1)
    names = {}
    for (index, axis), values in lines.items():
        face = surface.faces[index]
        names[index, axis] = dict(_merged(values, float(face.columns if axis else face.rows)))
    sides: dict[tuple[int, int, float], list[Part]] = defaultdict(list)
    for n, c in enumerate(charts):
        for edge, (line, low, high) in enumerate(
            ((c.s0, c.t0, c.t1), (c.t1, c.s0, c.s1), (c.s1, c.t0, c.t1), (c.t0, c.s0, c.s1))
        ):
            sides[c.face, edge, names[c.face, edge & 1][line]].append((low, high, n))
    for parts in sides.values():
        parts.sort()
    return dict(sides)


def _merged(values: list[float], most: float) -> Iterator[tuple[float, float]]:
    """Yield each value with its name, the same for values within `EPS`; at the far end it is the end's."""
    name = 0.0
    for value in sorted(values):
        if value - name > EPS:
            name = most if value >= most - EPS else value
        yield value, name


def _common(
    mine: list[Part], others: list[Part], ends: tuple[float, ...]
) -> Iterator[tuple[int, int, tuple[float, float, float, float]]]:
    """Yield where two rows of parts meet: both charts, and the interval on either, ends corresponding.

    `ends` are (start, stop, other_start, other_stop): only what lies within counts, the map linear.
    """
    start, stop, other_start, other_stop = ends
    slope = (other_stop - other_start) / (stop - start)
    least = EPS * max(1.0, 1.0 / abs(slope))
    # the others in my parameter, sorted; they do not overlap, so the last that begins before me is the first
    moved = [tuple(sorted(start + (u - other_start) / slope for u in part[:2])) + part for part in others]
    moved.sort()
    begins = [part[0] for part in moved]
    for low, high, one in mine:
        at = max(0, bisect_left(begins, low) - 1)
        for from_, to, other_low, other_high, other in moved[at:]:
            if from_ >= high:
                break
            a, b = max(low, from_, start), min(high, to, stop)
            if b - a > least:
                c, d = (min(max(other_start + slope * (u - start), other_low), other_high) for u in (a, b))
                yield one, int(other), (a, b, c, d)


def _line(chart: Chart, edge: int) -> float:
    """Return the row or column coordinate of an edge's line."""
    return (-0.5, chart.width - 0.5, chart.height - 0.5, -0.5)[edge]


def _texels(chart: Chart, edge: int, ends: tuple[float, ...]) -> tuple[float, float]:
    """Turn parameters of a face along a chart's edge into texels along it."""
    low, high, size = (chart.s0, chart.s1, chart.height) if edge & 1 else (chart.t0, chart.t1, chart.width)
    first, last = ((u - low) / (high - low) * size for u in ends)
    return first, last


def _split(vectors: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the signed part of vectors (N, K, 3) along unit tangents, and the length of what is across."""
    lean: FloatArray = (vectors * tangent).sum(axis=2)
    return lean, np.linalg.norm(vectors - lean[..., None] * tangent, axis=2)


def _frames(
    surface: Surface,
    charts: Sequence[Chart],
    chart: IndexArray,
    edge: IndexArray,
    along: FloatArray,
) -> FloatArray:
    """Return points and derivatives per texel down and right, (N, K, 3, 3), at texels (N, K) along edges."""
    numbers = np.array([(c.height, c.width, c.s0, c.s1, c.t0, c.t1) for c in charts]).reshape(-1, 6)
    height, width, s0, s1, t0, t1 = numbers[chart].T[:, :, None]
    down = (edge & 1)[:, None] == 1
    across = ((edge == 1) | (edge == 2))[:, None].astype(np.float64)
    s = s0 + (s1 - s0) * np.where(down, along / height, across)
    t = t0 + (t1 - t0) * np.where(down, across, along / width)
    out = np.empty((*along.shape, 3, 3))
    order = np.argsort(chart, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(chart[order])) + 1):
        if len(mine):
            # Where derivatives jump, those on the chart's side count.
            one = charts[chart[mine[0]]]
            face, row, column = surface.faces[one.face].smooth_part(one.s0, one.s1, one.t0, one.t1)
            at_s = np.clip(s[mine] - row, 0.0, face.rows)
            at_t = np.clip(t[mine] - column, 0.0, face.columns)
            out[mine] = np.stack(face.derivatives(at_s, at_t), axis=2)
    out[:, :, 1] *= ((s1 - s0) / height)[..., None]
    out[:, :, 2] *= ((t1 - t0) / width)[..., None]
    return out
