"""Minimum cuts on grids by SciPy's maximum flow: an oracle for the kernel `cut_grid`."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

FREE, OLD, NEW, OUTSIDE = 0, 1, 2, 3
"""Kinds of cells: decided by the cut, stays, is replaced, not part of the grid."""

_ENDLESS = 2**30


def plain_cut(right, down, seeds):
    """Return the cells of the smallest new side among all cheapest ones, and what the cut costs.

    `right` (h, w − 1) and `down` (h − 1, w) are capacities between neighbours, the same both ways; `seeds`
    (h, w) are the kinds of cells.
    """
    height, width = seeds.shape
    node = np.arange(height * width).reshape(height, width)
    source, sink = height * width, height * width + 1
    inside = seeds != OUTSIDE
    rows, columns, values = [], [], []
    for a, b, capacity, keep in (
        (node[:, :-1], node[:, 1:], right, inside[:, :-1] & inside[:, 1:]),
        (node[:-1], node[1:], down, inside[:-1] & inside[1:]),
    ):
        for start, end in ((a, b), (b, a)):
            rows.append(start[keep])
            columns.append(end[keep])
            values.append(capacity[keep])
    new, old = node[seeds == NEW], node[seeds == OLD]
    rows += [np.full(len(new), source), old]
    columns += [new, np.full(len(old), sink)]
    values += [np.full(len(new), _ENDLESS), np.full(len(old), _ENDLESS)]
    ends = np.concatenate(rows), np.concatenate(columns)
    size = height * width + 2
    graph = coo_array((np.concatenate(values).astype(np.int32), ends), shape=(size, size)).tocsr()
    # What the new cells still reach when no more flow fits.
    left = (graph - maximum_flow(graph, source, sink).flow).tocsr()
    left.eliminate_zeros()
    reached = np.zeros(size, np.uint8)
    reached[breadth_first_order(left, source, return_predecessors=False)] = 1
    cells = reached[:-2].reshape(height, width)
    return cells, cut_cost(right, down, seeds, cells)


def cut_cost(right, down, seeds, new):
    """Return the sum of the capacities between the two sides."""
    inside = seeds != OUTSIDE
    across = right * ((new[:, 1:] != new[:, :-1]) & inside[:, 1:] & inside[:, :-1])
    along = down * ((new[1:] != new[:-1]) & inside[1:] & inside[:-1])
    return int(across.sum() + along.sum())
