"""How texels are transferred from one chart to the next, over the seam at which they meet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import ChartSeam
from upholster.geometry import Surface
from upholster.quilt.chart import Chart
from upholster.types import FloatArray, frozen_array

__all__ = ["SAMPLES", "Transition", "transitions"]

SAMPLES = 9
"""Places along a seam at which a transition holds a matrix."""

INSET = 1e-3
"""The outermost samples are taken this share of the interval inside, where a pole has its limit."""

# Per edge, in (row, column) steps: along it, as its parameter grows, and outward across it.
_ALONG: FloatArray = np.array([(0.0, 1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 0.0)])
_OUTWARD: FloatArray = np.array([(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0)])

IndexArray = NDArray[np.intp]


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
        down = m.edge & 1 == 1  # the edge runs along the rows' axis
        along, across = (rows, columns) if down else (columns, rows)
        foot = np.clip(along + 0.5, m.start, m.stop)
        share = (foot - m.start) / (m.stop - m.start)
        first = np.minimum((share * (SAMPLES - 1)).astype(np.intp), SAMPLES - 2)
        weight = (share * (SAMPLES - 1) - first)[:, None, None]
        matrices: FloatArray = (1.0 - weight) * self.matrices[first] + weight * self.matrices[first + 1]
        over, depth = along + 0.5 - foot, across - self.line
        step = np.stack([over, depth] if down else [depth, over], axis=1)
        out = (matrices @ step[:, :, None])[:, :, 0]
        met = (1.0 - share) * m.other_start + share * m.other_stop - 0.5
        line = np.full(len(met), self.other_line)
        out += np.stack([met, line] if m.other_edge & 1 else [line, met], axis=1)
        return out[:, 0], out[:, 1], matrices


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


def _line(chart: Chart, edge: int) -> float:
    """Return the row or column coordinate of an edge's line."""
    return (-0.5, chart.width - 0.5, chart.height - 0.5, -0.5)[edge]


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
    # Where derivatives jump, those on the chart's side count.
    parts = [surface.faces[c.face].smooth_part(c.s0, c.s1, c.t0, c.t1) for c in charts]
    same: dict[int, int] = {}
    group = np.array([same.setdefault(id(part), len(same)) for part, *_ in parts])[chart]
    order = np.argsort(group, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        face, row, column = parts[chart[mine[0]]]
        at_s = np.clip(s[mine] - row, 0.0, face.rows)
        at_t = np.clip(t[mine] - column, 0.0, face.columns)
        out[mine] = np.stack(face.derivatives(at_s, at_t), axis=2)
    out[:, :, 1] *= ((s1 - s0) / height)[..., None]
    out[:, :, 2] *= ((t1 - t0) / width)[..., None]
    return out
