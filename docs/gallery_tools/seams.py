"""Figures of the seams: patch edges before and after the repair, and how an edge block is chosen and cut."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import Panel, compose, enlarged
from gallery_tools.method import BLOCK, LEVELS, OVERLAP, RED, YELLOW, first_placements
from gallery_tools.shots import Exemplars, charted, read, take
from upholster.geometry import ring_cyclide
from upholster.methods import synthesize
from upholster.quilt import Quilt, Texels, paint
from upholster.quilt.plans import Strip, StripPlan
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
    plan = quilt.plan
    if not isinstance(plan, StripPlan):
        raise AssertionError("method paper's quilts have strips")
    index = next(n for n, strip in enumerate(plan.layout.strips) if (strip.a, strip.b) == (6, 10))
    strip = plan.layout.strips[index]
    flat = [_marked_line(_across(strip, one, (112, 160)), 4) for one in texels]
    return compose(
        [
            [
                Panel(close[0], "(a) a corner of four patches, each covered on its own"),
                Panel(close[1], "(b) the same, repaired"),
            ],
            [Panel(flat[0], "(c) texels along an edge, before"), Panel(flat[1], "(d) after")],
            [Panel(image, title) for image, title in _edge_block(quilt, plan, index, exemplar)],
        ]
    )


def _across(strip: Strip, texels: Texels, size: tuple[int, int]) -> PixelArray:
    """Return the texels round the middle of an edge in the frame of its chart A, which runs along rows."""
    height, width = size
    chart = texels.charts[strip.a]
    line = (0, chart.width, chart.height, 0)[strip.edge_a]
    return _window(strip, texels, (line - height // 2, (chart.width - width) // 2), size)


def _window(strip: Strip, texels: Texels, first: tuple[int, int], size: tuple[int, int]) -> PixelArray:
    """Return a rectangle of texels of A's grid, those beyond the edge taken from B."""
    a, b = texels.arrays[strip.a], texels.arrays[strip.b]
    rows, columns = np.meshgrid(
        *(np.arange(n, dtype=np.int32) + at for at, n in zip(first, size, strict=True)), indexing="ij"
    )
    inside = (rows >= 0) & (rows < a.shape[0]) & (columns >= 0) & (columns < a.shape[1])
    window = np.empty((*size, a.shape[2]), a.dtype)
    window[inside] = a[rows[inside], columns[inside]]
    charts = texels.charts[strip.a], texels.charts[strip.b]
    window[~inside] = b[strip.to_b(rows[~inside], columns[~inside], *charts)]
    return window


def _marked_line(pixels: PixelArray, factor: int) -> Any:
    """Enlarge texels round an edge, and mark at the sides where the edge runs."""
    picture = enlarged(pixels, factor)
    draw = ImageDraw.Draw(picture)
    y, end = picture.height // 2, picture.width - 1
    for x, way in ((0, 1), (end, -1)):
        draw.polygon([(x, y - 12), (x, y + 12), (x + way * 20, y)], fill=RED)
    return picture


def _edge_block(quilt: Quilt, plan: StripPlan, index: int, exemplar: PixelArray) -> list[tuple[Any, str]]:
    """Show the edge block in the middle of an edge: as found, its best match, the cut, the result."""
    strip, starts = plan.layout.strips[index], plan.layout.mask_starts
    masks, _ = plan.layout.strip_masks(index, plan.masks[starts[index] : starts[index + 1]])
    blocks = plan.layout.strip_blocks(index, np.zeros(len(masks), np.int32))
    a = quilt.on_chart(strip.a)
    numbers = [_numbers(quilt, placed) for placed in blocks]
    half = BLOCK // 2

    def seen(k: int, more: int) -> PixelArray:
        """Return the block's place before (0) and after (1) it is painted."""
        block = blocks[0][k]
        counts = {strip.a: numbers[0][k] + more, strip.b: numbers[1][k] + more}
        first = int(block["row"]) - half, int(block["column"]) - half
        return _window(strip, paint(first_placements(quilt, counts), exemplar), first, (BLOCK, BLOCK))

    def step(k: int) -> float:
        """Return how much the texels at both sides of the edge differ before."""
        rows = seen(k, 0)[half - 1 : half + 1].astype(np.float64)
        return float(np.abs(rows[1] - rows[0]).mean())

    def corners(k: int) -> int:
        """Return how often the cut turns."""
        return int(np.count_nonzero(np.diff(np.diff(masks[k].astype(int), axis=0), axis=1)))

    worst = sorted(range(len(masks)), key=step, reverse=True)[: max(1, len(masks) // 2)]
    chosen = max(worst, key=corners)
    block, found, embedded = a[numbers[0][chosen]], seen(chosen, 0), seen(chosen, 1)
    row, column = int(block["source_row"]) // 16 - half, int(block["source_column"]) // 16 - half
    match = exemplar[row : row + BLOCK, column : column + BLOCK]
    cells = masks[chosen]
    side = len(cells)
    factor = 9
    large = BLOCK * factor
    new = enlarged(np.kron(cells, np.ones((large // side, large // side), np.uint8)) * 255, 1).convert("L")
    mask = Image.composite(enlarged(match, factor), Image.new("RGB", (large, large), (225, 225, 225)), new)
    images = [_marked_line(found, factor), enlarged(match, factor), mask, _marked_line(embedded, factor)]
    _cut_line(mask, cells, large // side)
    titles = ("(e) an edge block, as found", "(f) its best match", "(g) what is cut from it", "(h) embedded")
    return list(zip(images, titles, strict=True))


def _numbers(quilt: Quilt, blocks: NDArray[np.void]) -> list[int]:
    """Return which of its chart's placements each block of a strip is."""
    others = quilt.on_chart(int(blocks["chart"][0]))
    cut = others["mask"] == blocks["mask"][0]
    return [
        int(np.flatnonzero(cut & (others["row"] == one["row"]) & (others["column"] == one["column"]))[-1])
        for one in blocks
    ]


def _cut_line(image: Any, cells: NDArray[np.uint8], size: int) -> None:
    """Draw the border between old and new cells."""
    draw = ImageDraw.Draw(image)
    for i, j in np.argwhere(np.diff(cells, axis=0)):
        draw.line((j * size, (i + 1) * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
    for i, j in np.argwhere(np.diff(cells, axis=1)):
        draw.line(((j + 1) * size, i * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
