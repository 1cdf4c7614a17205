"""Figures of the seams: patch edges before and after mending, and how an edge block is mended."""

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
from upholster.quilt import Quilt, paint
from upholster.quilt.plans import Strip, StripLayout, StripPlan
from upholster.types import PixelArray

__all__ = ["seams"]


def seams(exemplars: Exemplars) -> Any:
    """Draw figures 7, 8 and 9: a patch edge before and after mending, and how an edge block is mended."""
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
    if not isinstance(quilt.plan, StripPlan):
        raise AssertionError("method paper emits strips")
    layout = quilt.plan.layout
    index = next(n for n, strip in enumerate(layout.strips) if (strip.a, strip.b) == (6, 10))
    flat = [_marked_line(_across(layout, layout.strips[index], one.arrays, (112, 160)), 4) for one in texels]
    return compose(
        [
            [
                Panel(close[0], "(a) a corner of four patches, each covered on its own"),
                Panel(close[1], "(b) the same after mending"),
            ],
            [Panel(flat[0], "(c) texels along an edge, before"), Panel(flat[1], "(d) after")],
            [Panel(image, title) for image, title in _edge_block(quilt, quilt.plan, exemplar, index)],
        ]
    )


def _across(
    layout: StripLayout, strip: Strip, arrays: Sequence[PixelArray], size: tuple[int, int]
) -> PixelArray:
    """Return the texels round the middle of an edge in the frame of its chart A, which runs along rows."""
    height, width = size
    line = layout.charts[strip.a].height if strip.edge_a == 2 else 0
    first = line - height // 2, (arrays[strip.a].shape[1] - width) // 2
    return _window(layout, strip, arrays, first, size)


def _window(
    layout: StripLayout,
    strip: Strip,
    arrays: Sequence[PixelArray],
    first: tuple[int, int],
    size: tuple[int, int],
) -> PixelArray:
    """Return a rectangle of texels of A's grid, those beyond the edge taken from B."""
    a, b = arrays[strip.a], arrays[strip.b]
    rows, columns = np.meshgrid(
        *(np.arange(n) + at for at, n in zip(first, size, strict=True)), indexing="ij"
    )
    inside = (rows >= 0) & (rows < a.shape[0]) & (columns >= 0) & (columns < a.shape[1])
    window = np.empty((*size, a.shape[2]), a.dtype)
    window[inside] = a[rows[inside], columns[inside]]
    charts = layout.charts[strip.a], layout.charts[strip.b]
    beyond = strip.to_b(rows[~inside].astype(np.int32), columns[~inside].astype(np.int32), *charts)
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


def _edge_block(quilt: Quilt, plan: StripPlan, exemplar: PixelArray, index: int) -> list[tuple[Any, str]]:
    """Show the edge block in the middle of an edge: as found, its best match, the cut, the result."""
    layout, strip = plan.layout, plan.layout.strips[index]
    start, stop = layout.mask_starts[index : index + 2].tolist()
    masks, _ = layout.strip_masks(index, plan.masks[start:stop])
    first_a, first_b = (_first_of(layout, index, chart) for chart in (strip.a, strip.b))
    blocks = quilt.on_chart(strip.a)[first_a : first_a + len(masks)]
    half = BLOCK // 2

    def seen(number: int, more: int) -> PixelArray:
        """Return the block's place before (0) and after (1) it is painted."""
        block = blocks[number]
        counts = {strip.a: first_a + number + more, strip.b: first_b + number + more}
        first = int(block["row"]) - half, int(block["column"]) - half
        arrays = paint(first_placements(quilt, counts), exemplar).arrays
        return _window(layout, strip, arrays, first, (BLOCK, BLOCK))

    def step(number: int) -> float:
        """Return how much the texels at both sides of the edge differ before."""
        rows = seen(number, 0)[half - 1 : half + 1].astype(np.float64)
        return float(np.abs(rows[1] - rows[0]).mean())

    def corners(number: int) -> int:
        """Return how often the cut turns."""
        turns = np.diff(np.diff(masks[number].astype(int), axis=0), axis=1)
        return int(np.count_nonzero(turns))

    worst = sorted(range(len(masks)), key=step, reverse=True)[: max(1, len(masks) // 2)]
    number = max(worst, key=corners)
    block, found, embedded = blocks[number], seen(number, 0), seen(number, 1)
    row, column = int(block["source_row"]) // 16 - half, int(block["source_column"]) // 16 - half
    match = exemplar[row : row + BLOCK, column : column + BLOCK]
    cells = masks[number]
    side = len(cells)
    factor = 9
    large = BLOCK * factor
    new = enlarged(np.kron(cells, np.ones((large // side, large // side), np.uint8)) * 255, 1).convert("L")
    mask = Image.composite(enlarged(match, factor), Image.new("RGB", (large, large), (225, 225, 225)), new)
    images = [_marked_line(found, factor), enlarged(match, factor), mask, _marked_line(embedded, factor)]
    _cut_line(mask, cells, large // side)
    titles = ("(e) an edge block, as found", "(f) its best match", "(g) what is cut from it", "(h) embedded")
    return list(zip(images, titles, strict=True))


def _first_of(layout: StripLayout, index: int, chart: int) -> int:
    """Return how many placements come before those of a strip on one of its charts."""
    rows, across = layout.block_grid(chart)
    before = layout.strips[:index]
    return rows * across + sum(
        layout.blocks_along(strip) for strip in before for end in (strip.a, strip.b) if end == chart
    )


def _cut_line(image: Any, cells: NDArray[np.uint8], size: int) -> None:
    """Draw the border between old and new cells."""
    draw = ImageDraw.Draw(image)
    for i, j in np.argwhere(np.diff(cells, axis=0)):
        draw.line((j * size, (i + 1) * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
    for i, j in np.argwhere(np.diff(cells, axis=1)):
        draw.line(((j + 1) * size, i * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
