"""Whether the edges of charts show, against what the exemplar has at the same places."""

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.geometry import Surface
from upholster.measure.cuts import check_painted, sampled
from upholster.measure.samples import SEED, Samples, Window, coded
from upholster.measure.seams import MOST_MEETINGS, MOST_PAIRS, MeanDifference
from upholster.measure.trace import Trace, step_sources
from upholster.quilt import Chart, Quilt, Texels
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray, PixelArray

__all__ = ["looked_up", "matched_edge_ratio"]

Index = NDArray[np.intp]


def matched_edge_ratio(surface: Surface, quilt: Quilt, texels: Texels, exemplar: PixelArray) -> float | None:
    """Measure whether the edges of charts show, against what the exemplar has at the same places.

    A surface of few charts has few edges, and single lines of a regular texture differ from its mean. Here
    the mean absolute difference between a texel at an edge and the nearest one beyond it is taken over the
    mean of the two differences that the exemplar has there: over the same step from the first texel's place,
    as the placement that owns it maps it, and back from the second's. 1.0 is as smooth as the exemplar, more
    shows, less is blur. At most 2048 edges, and some 2^17 pairs are looked at.

    Parameters
    ----------
    surface
        What the charts lie on: says which edges meet.
    quilt, texels
        The quilt, and the same painted.
    exemplar
        (H, W, C) that the texels were painted from.

    Returns
    -------
    float or None
        As for `edge_seam_ratio`.

    Raises
    ------
    InputError
        If a chart names a face that the surface does not have, the texels do not have the quilt's charts, or
        the exemplar not its shape.
    """
    check_painted(quilt, texels, exemplar)
    rng = np.random.default_rng(SEED)
    found = find_seams(surface, quilt.charts)
    chosen = [found[n] for n in rng.permutation(len(found))[:MOST_MEETINGS]]
    most = max(64, MOST_PAIRS // max(1, len(chosen)))
    seen, expected = MeanDifference(), MeanDifference()
    levels = [exemplar]
    traces: dict[tuple[int, int], Trace] = {}
    for transition in transitions(surface, quilt.charts, chosen):
        m = transition.seam
        sides = ((m.chart, m.edge), (m.other_chart, m.other_edge))
        for side in sides:
            if side not in traces:
                traces[side] = Trace.of(quilt, _line(quilt.charts[side[0]], *side))
        along = np.arange(np.ceil(m.start - 0.5), np.ceil(m.stop - 0.5)).astype(np.intp)
        along = rng.permutation(along)[:most]
        rows, columns = _texels(traces[sides[0]].window, m.edge, along)
        carried_rows, carried_columns, matrices = transition.apply(
            rows.astype(np.float64), columns.astype(np.float64)
        )
        sound = np.isfinite(matrices).all(axis=(1, 2))
        rows, columns, matrices = rows[sound], columns[sound], matrices[sound]
        from_ = np.stack([carried_rows[sound], carried_columns[sound]], axis=1)
        line = traces[sides[1]].window
        last = max(line.height, line.width) - 1
        beyond = np.clip(np.rint(from_[:, 0 if m.other_edge & 1 else 1]), 0, last).astype(np.intp)
        other = np.stack(_texels(line, m.other_edge, beyond), axis=1)
        step: FloatArray = other.astype(np.float64) - from_
        step_back = np.linalg.solve(matrices, step[:, :, None])[:, :, 0].astype(np.float64)
        here = looked_up(traces[sides[0]], rows, columns, step_back, levels)
        there = looked_up(traces[sides[1]], other[:, 0], other[:, 1], -step, levels)
        seen.add(
            coded(texels.arrays[m.chart][rows, columns]),
            coded(texels.arrays[m.other_chart][other[:, 0], other[:, 1]]),
        )
        expected.add(*here)
        expected.add(*there)
    return seen.over(expected)


def _line(chart: Chart, index: int, edge: int) -> Window:
    """Return the texels along an edge as a window."""
    if edge & 1:
        return Window(index, 0, chart.width - 1 if edge == 1 else 0, chart.height, 1)
    return Window(index, chart.height - 1 if edge == 2 else 0, 0, 1, chart.width)


def _texels(line: Window, edge: int, along: Index) -> tuple[Index, Index]:
    across = np.full(len(along), line.column if edge & 1 else line.row, np.intp)
    return (along, across) if edge & 1 else (across, along)


def looked_up(
    trace: Trace, rows: Index, columns: Index, step: FloatArray, levels: list[PixelArray]
) -> tuple[Samples, Samples]:
    """Return what the exemplar has for texels, and a step of texels further."""
    owner = trace.placements[trace.owners[rows - trace.window.row, columns - trace.window.column]]
    place = step_sources(trace.field, owner, rows, columns).T / 16
    matrices = trace.field.at(rows, columns)
    pixels = SYMMETRIES[owner["symmetry"]].reshape(-1, 2, 2) @ matrices @ step[:, :, None]
    there = place + pixels[:, :, 0]
    return sampled(trace, owner, place, levels), sampled(trace, owner, there, levels)
