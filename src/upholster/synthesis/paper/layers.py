"""The chosen blocks as layers of a quilt: label maps, and the placements that they number.

The first layer has a chart's blocks. Its cells are as wide as the overlap and shifted by half a cell. So a
block begins at the centre of a cell that shows the previous one, and its ramp ends at the next cell's
centre: the bilinear weights of label maps are the ramps. The second layer has the edge blocks; its cells are
those of their masks.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.placement import PLACEMENT, SYMMETRIES
from upholster.synthesis.paper.strips import Strip

__all__ = ["Layer", "block_layer", "edge_placements", "on_cells"]

Layer = tuple[NDArray[np.void], LabelMap]
"""Placements of one chart, and the label map that numbers them from 0 on; −1 where none shows."""


def block_layer(
    chart: Chart, pixels: NDArray[np.int64], *, block: int, overlap: int, shape: tuple[int, ...]
) -> Layer:
    """Return the first layer of a chart.

    Parameters
    ----------
    chart
        The chart.
    pixels
        (down, across, 2) int: the first pixel (row, column) of the exemplar that each block shows; blocks are
        `block` − `overlap` texels apart.
    block, overlap
        In texels; `block` is a multiple of `overlap`.
    shape
        (height, width) of the exemplar.
    """
    down, across = pixels.shape[:2]
    step = block - overlap
    high, wide = label_shape(chart.height, chart.width, overlap)
    # A cell's centre is after the start of its block, by one step at most.
    row, column = (
        ((cell_centres(count, overlap, half=True) // 16 - 1) // step).clip(0, blocks - 1)
        for count, blocks in ((high, down), (wide, across))
    )
    labels = (row[:, None] * across + column).astype(np.int32)
    blocks = np.zeros((down, across), PLACEMENT)
    blocks["row"] = (16 * step * np.arange(down) + 8 * block)[:, None]
    blocks["column"] = 16 * step * np.arange(across) + 8 * block
    blocks["source_row"], blocks["source_column"] = np.moveaxis(16 * pixels + 8 * block - 8, 2, 0)
    return on_cells(blocks.reshape(-1), LabelMap(overlap, labels, half=True), shape)


def edge_placements(
    strip: Strip, charts: Sequence[Chart], block: int, corners: NDArray[np.int64], pixels: NDArray[np.int64]
) -> NDArray[np.void]:
    """Return a strip's edge blocks on both of its charts.

    Parameters
    ----------
    strip
        The strip that they cover.
    charts
        The layout.
    block
        Their side in texels.
    corners, pixels
        (n, 2): the first texel of each on A, the first pixel (row, column) of the exemplar that it shows.

    Returns
    -------
    ndarray
        (n, 2) of `PLACEMENT`: each block on A, then on B, its centre in its middle.
    """
    out = np.zeros((len(corners), 2), PLACEMENT)
    m0, m1, m2, m3, m4, m5 = strip.map_to_b(charts[strip.a], charts[strip.b]).tolist()
    out["row"][:, 0], out["column"][:, 0] = (16 * corners + 8 * block).T
    # The map takes middles of texels, 16·k + 8, to middles of texels.
    row, column = out["row"][:, 0] - 8, out["column"][:, 0] - 8
    out["row"][:, 1] = m0 * row + m1 * column + 16 * m4 + 8
    out["column"][:, 1] = m2 * row + m3 * column + 16 * m5 + 8
    out["source_row"], out["source_column"] = (16 * pixels + 8 * block - 8).T[:, :, None]
    undone = np.array([m0, m2, m1, m3])
    out["symmetry"][:, 1] = (undone == SYMMETRIES).all(axis=1).argmax()
    return out


def on_cells(blocks: NDArray[np.void], layer: LabelMap, shape: tuple[int, ...]) -> Layer:
    """Return a layer whose placements have their centres at centres of cells, as streams require.

    Blocks that show nowhere are left out. The others are sorted by their cells.

    Parameters
    ----------
    blocks
        (n,) of `PLACEMENT`, their centres in their middles.
    layer
        The layer whose labels number them. A block's centre moves to the centre of its nearest own cell.
    shape
        (height, width) of the exemplar.
    """
    rows, columns = np.nonzero(layer.labels >= 0)
    own = layer.labels[rows, columns]
    centres = [
        cell_centres(count, layer.cell, half=layer.half)[at]
        for count, at in zip(layer.labels.shape, (rows, columns), strict=True)
    ]
    distance = (centres[0] - blocks["row"][own]) ** 2 + (centres[1] - blocks["column"][own]) ** 2
    order = np.lexsort((distance, own))  # of several equally near cells the first
    kept = order[np.flatnonzero(np.diff(own[order], prepend=-1))]
    names, ranks = own[kept], np.empty(len(kept), np.int32)
    kept_order = np.argsort(kept)
    ranks[kept_order] = np.arange(len(kept))
    labels = np.full(layer.labels.shape, -1, np.int32)
    labels[rows, columns] = ranks[np.searchsorted(names, own)]
    kept = kept[kept_order]
    placed = blocks[own[kept]]
    down, right = centres[0][kept] - placed["row"], centres[1][kept] - placed["column"]
    symmetry = SYMMETRIES[placed["symmetry"]].T
    placed["row"] += down
    placed["column"] += right
    for axis, name in enumerate(("source_row", "source_column")):
        source = placed[name] + symmetry[2 * axis] * down + symmetry[2 * axis + 1] * right
        placed[name] = np.clip(source, 0, 16 * shape[axis] - 1)
    return placed, LabelMap(layer.cell, labels, half=layer.half)
