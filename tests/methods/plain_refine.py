"""What a flat quilt's cuts cost, found plainly: an oracle for refinement."""

import numpy as np

from upholster.methods.quilt.features import pca_features
from upholster.quilt.placement import MASK_CUT, mask_windows


def plain_labels(quilt, cell):
    """Return which placement each cell of the one chart shows, by its first texel, (rows, columns)."""
    chart = quilt.charts[0]
    labels = np.full((-(-chart.height // cell), -(-chart.width // cell)), -1)
    windows = mask_windows(quilt.placements, quilt.charts)
    for n, (one, window) in enumerate(zip(quilt.placements, windows.tolist(), strict=True)):
        top, left = one["row"] - one["height"] // 2, one["column"] - one["width"] // 2
        for i, j in np.ndindex(labels.shape):
            y, x = i * cell - top, j * cell - left
            if not (0 <= y < one["height"] and 0 <= x < one["width"]):
                continue
            new = 1
            if one["mask"] == MASK_CUT:
                i0, _, j0, j1 = window
                a, b = y // one["mask_cell"] - i0, x // one["mask_cell"] - j0
                new = quilt.mask_cells[one["first_cell"] + a * (j1 - j0) + b]
            if new:
                labels[i, j] = n
    return labels


def plain_cost(quilt, exemplar, cell=2):
    """Return what the cuts of a quilt on one chart cost, where a texel is a pixel."""
    form, _ = pca_features(exemplar)
    labels, placed = plain_labels(quilt, cell), quilt.placements

    def read(n, i, j):
        y, x = (
            at * cell + np.arange(0, cell, cell // 2) - placed[name][n] + (placed[f"source_{name}"][n] >> 4)
            for name, at in (("row", i), ("column", j))
        )
        found = form[np.clip(y, 0, len(form) - 1)[:, None], np.clip(x, 0, form.shape[1] - 1)]
        return found.astype(np.int64)

    total = 0
    for i, j in np.ndindex(labels.shape):
        for a, b in ((i, j + 1), (i + 1, j)):
            if a < labels.shape[0] and b < labels.shape[1] and labels[a, b] != labels[i, j]:
                here, there = labels[i, j], labels[a, b]
                total += 1 + sum(
                    int(4 * np.sqrt(((read(here, *place) - read(there, *place)) ** 2).sum()))
                    for place in ((i, j), (a, b))
                )
    return total
