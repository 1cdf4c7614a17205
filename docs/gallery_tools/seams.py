"""Figures of the seams: patch edges before and after the repair, and how an edge block is chosen and cut."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import Panel, compose, enlarged
from gallery_tools.method import BLOCK, LEVELS, OVERLAP, RED, YELLOW, first_placements
from gallery_tools.shots import Exemplars, charted, read, take
from upholster.geometry import ring_cyclide
from upholster.methods import synthesize
from upholster.methods.paper.edges import EdgeMap, edge_map
from upholster.quilt import Quilt, paint
from upholster.quilt.placement import MASK_CUT
from upholster.types import PixelArray

__all__ = ["seams"]


def seams(exemplars: Exemplars) -> Any:
    """Draw figures 7, 8 and 9: a patch edge before and after the repair, and how an edge block is made."""
    exemplar = read(exemplars.pick("cobble"))
    ring = ring_cyclide()
    options: dict[str, Any] = {"chart": 192, "block": BLOCK, "overlap": OVERLAP, "levels": LEVELS, "seed": 5}
    quilt = synthesize(exemplar, ring, **options, method="paper")
    bare = synthesize(exemplar, ring, seams=False, **options, method="paper")
    texels = [paint(one, exemplar) for one in (bare, quilt)]
    corner = ring.patches[6].points(1.0, 1.0)
    close = [
        take(charted(ring, one.arrays), size=(640, 440), view=(205.0, 48.0), zoom=3.2, target=corner).image
        for one in texels
    ]
    edge = next(edge for edge in ring.shared if (edge.patch, edge.other_patch) == (6, 10))
    found = edge_map(edge, quilt.charts[edge.patch], quilt.charts[edge.other_patch])
    if found is None:
        raise AssertionError("charts of one size meet texel by texel")
    flat = [_marked_line(_across(found, one.arrays, (112, 160)), 4) for one in texels]
    return compose(
        [
            [
                Panel(close[0], "(a) a corner of four patches, each covered on its own"),
                Panel(close[1], "(b) the same, repaired"),
            ],
            [Panel(flat[0], "(c) texels along an edge, before"), Panel(flat[1], "(d) after")],
            [Panel(image, title) for image, title in _edge_block(quilt, exemplar, found)],
        ]
    )


def _across(edge: EdgeMap, arrays: Sequence[PixelArray], size: tuple[int, int]) -> PixelArray:
    """Return the texels round the middle of an edge in the frame of its chart A, which runs along rows."""
    height, width = size
    first = edge.line - height // 2, (arrays[edge.chart_a].shape[1] - width) // 2
    return _window(edge, arrays, first, size)


def _window(
    edge: EdgeMap, arrays: Sequence[PixelArray], first: tuple[int, int], size: tuple[int, int]
) -> PixelArray:
    """Return a rectangle of texels of A's grid, those beyond the edge taken from B."""
    a, b = arrays[edge.chart_a], arrays[edge.chart_b]
    rows, columns = np.meshgrid(
        *(np.arange(n) + at for at, n in zip(first, size, strict=True)), indexing="ij"
    )
    inside = (rows >= 0) & (rows < a.shape[0]) & (columns >= 0) & (columns < a.shape[1])
    window = np.empty((*size, a.shape[2]), a.dtype)
    window[inside] = a[rows[inside], columns[inside]]
    beyond = edge.to_b(rows[~inside].astype(np.int32), columns[~inside].astype(np.int32))
    window[~inside] = b[beyond]
    return window


def _marked_line(pixels: PixelArray, factor: int) -> Any:
    """Enlarge texels round an edge, and mark at the sides where the edge runs."""
    picture = enlarged(pixels, factor)
    draw = ImageDraw.Draw(picture)
    y, end = picture.height // 2, picture.width - 1
    for x, way in ((0, 1), (end, -1)):
        draw.polygon([(x, y - 12), (x, y + 12), (x + way * 20, y)], fill=RED)
    return picture


def _edge_block(quilt: Quilt, exemplar: PixelArray, edge: EdgeMap) -> list[tuple[Any, str]]:
    """Show the edge block in the middle of an edge: as found, its best match, the cut, the result."""
    a, b = (quilt.on_chart(n) for n in (edge.chart_a, edge.chart_b))
    mine = [n for n, one in enumerate(a) if one["mask"] == MASK_CUT and _is_on(one, edge)]
    half = BLOCK // 2

    def seen(number: int, more: int) -> PixelArray:
        """Return the block's place before (0) and after (1) it is painted."""
        block = a[number]
        counts = {edge.chart_a: number + more, edge.chart_b: _twin(block, b) + more}
        first = int(block["row"]) - half, int(block["column"]) - half
        return _window(edge, paint(first_placements(quilt, counts), exemplar).arrays, first, (BLOCK, BLOCK))

    def step(number: int) -> float:
        """Return how much the texels at both sides of the edge differ before."""
        rows = seen(number, 0)[half - 1 : half + 1].astype(np.float64)
        return float(np.abs(rows[1] - rows[0]).mean())

    def corners(number: int) -> int:
        """Return how often the cut turns."""
        turns = np.diff(np.diff(_cells(quilt, a[number]).astype(int), axis=0), axis=1)
        return int(np.count_nonzero(turns))

    worst = sorted(mine, key=step, reverse=True)[: max(1, len(mine) // 2)]
    number = max(worst, key=corners)
    block, found, embedded = a[number], seen(number, 0), seen(number, 1)
    row, column = int(block["source_row"]) // 16 - half, int(block["source_column"]) // 16 - half
    match = exemplar[row : row + BLOCK, column : column + BLOCK]
    cells = _cells(quilt, block)
    side = len(cells)
    factor = 9
    large = BLOCK * factor
    new = enlarged(np.kron(cells, np.ones((large // side, large // side), np.uint8)) * 255, 1).convert("L")
    mask = Image.composite(enlarged(match, factor), Image.new("RGB", (large, large), (225, 225, 225)), new)
    images = [_marked_line(found, factor), enlarged(match, factor), mask, _marked_line(embedded, factor)]
    _cut_line(mask, cells, large // side)
    titles = ("(e) an edge block, as found", "(f) its best match", "(g) what is cut from it", "(h) embedded")
    return list(zip(images, titles, strict=True))


def _cells(quilt: Quilt, block: Any) -> NDArray[np.uint8]:
    """Return a placement's cut mask, 1 = new."""
    side, start = int(block["height"]) // int(block["cell"]), int(block["cells"])
    return quilt.cells[start : start + side * side].reshape(side, side)


def _twin(block: Any, others: NDArray[np.void]) -> int:
    """Return the number of the same edge block on the other chart: its cells follow right behind."""
    count = (int(block["height"]) // int(block["cell"])) ** 2
    return int(np.flatnonzero((others["mask"] == MASK_CUT) & (others["cells"] == block["cells"] + count))[0])


def _is_on(placement: Any, edge: EdgeMap) -> bool:
    across, along = ("column", "row") if edge.along_rows else ("row", "column")
    return bool(placement[across] == edge.line and edge.start <= placement[along] <= edge.start + edge.length)


def _cut_line(image: Any, cells: NDArray[np.uint8], size: int) -> None:
    """Draw the border between old and new cells."""
    draw = ImageDraw.Draw(image)
    for i, j in np.argwhere(np.diff(cells, axis=0)):
        draw.line((j * size, (i + 1) * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
    for i, j in np.argwhere(np.diff(cells, axis=1)):
        draw.line(((j + 1) * size, i * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
