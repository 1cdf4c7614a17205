"""Shared edges along which texels of two charts meet one to one, and which can be worked on at once."""

from collections.abc import Sequence

import numpy as np

from upholster.geometry import SharedEdge
from upholster.quilt.chart import Chart
from upholster.methods.quilt.old_plans.strips import Strip, edge_length

__all__ = ["color_classes", "strip_along"]


def strip_along(edge: SharedEdge, charts: Sequence[Chart], block: int) -> Strip | None:
    """Return the strip along a shared edge; None where texels do not meet one to one, or no block fits.

    Parameters
    ----------
    edge
        The edge of two patches.
    charts
        Chart n covers the whole of patch n.
    block
        Side of an edge block in texels.
    """
    long_a = edge_length(charts[edge.patch], edge.edge)
    long_b = edge_length(charts[edge.other_patch], edge.other_edge)
    ends = np.array(
        [edge.start * long_a, edge.stop * long_a, edge.other_start * long_b, edge.other_stop * long_b]
    )
    start, stop, other, other_stop = (int(end) for end in np.rint(ends))
    if np.abs(ends - np.rint(ends)).max() > 1e-6 or stop - start != abs(other_stop - other):
        return None
    if stop - start < block:
        return None
    return Strip(
        edge.patch,
        edge.other_patch,
        edge.edge,
        edge.other_edge,
        other > other_stop,
        start,
        stop - start,
        min(other, other_stop),
    )


def color_classes(pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Sort edges, as pairs of charts, into classes in which no chart occurs twice (a greedy edge colouring).

    Returns
    -------
    list of list of int
        Indices into `pairs`, each exactly once.
    """
    classes: list[list[int]] = []
    used: list[set[int]] = []
    for index, (a, b) in enumerate(pairs):
        for members, charts in zip(classes, used, strict=True):
            if a not in charts and b not in charts:
                members.append(index)
                charts |= {a, b}
                break
        else:
            classes.append([index])
            used.append({a, b})
    return classes
