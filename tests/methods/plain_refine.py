"""What a flat quilt's cuts cost, found plainly: an oracle for refinement."""

import numpy as np
from plain_quilt import shown_blocks

from upholster.methods.quilt.features import pca_features


def plain_cost(laid, chart, exemplar, cell=2):
    """Return what the cuts of what is laid on a chart cost, where a texel is a pixel."""
    form, _ = pca_features(exemplar)
    # A cell shows what its first texel shows.
    labels, placed = shown_blocks(laid, chart)[::cell, ::cell], laid.placements

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
