"""Figures of the seams: patch edges before and after the repair, and how an edge block is chosen and cut."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import Panel, compose, enlarged
from gallery_tools.method import BLOCK, LEVELS, OVERLAP, RED, YELLOW, first_pixel
from gallery_tools.shots import Exemplars, charted, read, take
from upholster.base.types import PixelArray
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import paint
from upholster.synthesis.paper.layers import edge_placements
from upholster.synthesis.paper.strips import Strip, strip_along

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
    strip = strip_along(edge, quilt.charts, BLOCK)
    if strip is None:
        raise AssertionError("patches of one size meet texel by texel")
    flat = [_marked_line(_across(strip, one, (112, 160)), 4) for one in texels]
    return compose(
        [
            [
                Panel(close[0], "(a) a corner of four patches, each covered on its own"),
                Panel(close[1], "(b) the same, repaired"),
            ],
            [Panel(flat[0], "(c) texels along an edge, before"), Panel(flat[1], "(d) after")],
            [Panel(image, title) for image, title in _edge_block(quilt, strip, exemplar)],
        ]
    )


def _across(strip: Strip, texels: Texels, size: tuple[int, int]) -> PixelArray:
    """Return the texels round the middle of an edge in the frame of its chart A, which runs along rows."""
    height, width = size
    chart = texels.charts[strip.a]
    line = (0, chart.width, chart.height, 0)[strip.edge_a]
    first = line - height // 2, (chart.width - width) // 2
    return _window(strip, texels.charts, (texels.arrays[strip.a], texels.arrays[strip.b]), first, size)


def _window(
    strip: Strip,
    charts: Sequence[Chart],
    arrays: tuple[NDArray[Any], NDArray[Any]],
    first: tuple[int, int],
    size: tuple[int, int],
) -> NDArray[Any]:
    """Return a rectangle of A's grid, of arrays of both charts' texels: beyond the edge those of B."""
    a, b = arrays
    rows, columns = np.meshgrid(
        *(np.arange(n, dtype=np.int32) + at for at, n in zip(first, size, strict=True)), indexing="ij"
    )
    inside = (rows >= 0) & (rows < a.shape[0]) & (columns >= 0) & (columns < a.shape[1])
    window = np.empty((*size, *a.shape[2:]), a.dtype)
    window[inside] = a[rows[inside], columns[inside]]
    window[~inside] = b[strip.to_b(rows[~inside], columns[~inside], charts[strip.a], charts[strip.b])]
    return window


def _marked_line(pixels: PixelArray, factor: int) -> Any:
    """Enlarge texels round an edge, and mark at the sides where the edge runs."""
    picture = enlarged(pixels, factor)
    draw = ImageDraw.Draw(picture)
    y, end = picture.height // 2, picture.width - 1
    for x, way in ((0, 1), (end, -1)):
        draw.polygon([(x, y - 12), (x, y + 12), (x + way * 20, y)], fill=RED)
    return picture


def _edge_block(quilt: Quilt, strip: Strip, exemplar: PixelArray) -> list[tuple[Any, str]]:
    """Show the edge block in the middle of an edge: as found, its best match, the cut, the result."""
    corners = strip.corners(quilt.charts[strip.a], BLOCK, OVERLAP)
    middles = edge_placements(strip, quilt.charts, BLOCK, corners, np.zeros_like(corners))
    charts = strip.a, strip.b
    numbers = [
        [_number(quilt.on_chart(chart), block) for chart, block in zip(charts, both, strict=True)]
        for both in middles
    ]

    def window(k: int, arrays: list[NDArray[Any]]) -> NDArray[Any]:
        """Return the block's place, of arrays of its two charts."""
        first = int(corners[k, 0]), int(corners[k, 1])
        return _window(strip, quilt.charts, (arrays[0], arrays[1]), first, (BLOCK, BLOCK))

    def bare(k: int) -> PixelArray:
        """Return the block's place without it."""
        labels = list(quilt.labels)
        for chart, number in zip(charts, numbers[k], strict=True):
            first, second = labels[chart]
            without = np.where(second.labels == number, np.int32(-1), second.labels)
            labels[chart] = first, replace(second, labels=without)
        texels = paint(replace(quilt, labels=tuple(labels)), exemplar)
        return window(k, [texels.arrays[chart] for chart in charts])

    def cut(k: int) -> NDArray[np.uint8]:
        """Return the cells that show the block: 1."""
        size = [(quilt.charts[chart].height, quilt.charts[chart].width) for chart in charts]
        owners = [quilt.owners(chart, 0, 0, *size[n]) for n, chart in enumerate(charts)]
        mine = [owner == number for owner, number in zip(owners, numbers[k], strict=True)]
        cell = quilt.labels[strip.a][1].cell
        return window(k, mine)[::cell, ::cell].astype(np.uint8)

    def step(k: int) -> float:
        """Return how much the texels at both sides of the edge differ without the block."""
        rows = bare(k)[BLOCK // 2 - 1 : BLOCK // 2 + 1].astype(np.float64)
        return float(np.abs(rows[1] - rows[0]).mean())

    def turns(k: int) -> int:
        """Return how often the cut turns."""
        return int(np.count_nonzero(np.diff(np.diff(cut(k).astype(int), axis=0), axis=1)))

    worst = sorted(range(len(corners)), key=step, reverse=True)[: max(1, len(corners) // 2)]
    chosen = max(worst, key=turns)
    painted = paint(quilt, exemplar).arrays
    found, embedded = bare(chosen), window(chosen, [painted[chart] for chart in charts])
    corner = int(corners[chosen, 0]), int(corners[chosen, 1])
    row, column = first_pixel(quilt.on_chart(strip.a)[numbers[chosen][0]], corner)
    match = exemplar[row : row + BLOCK, column : column + BLOCK]
    cells = cut(chosen)
    side = len(cells)
    factor = 9
    large = BLOCK * factor
    new = enlarged(np.kron(cells, np.ones((large // side, large // side), np.uint8)) * 255, 1).convert("L")
    mask = Image.composite(enlarged(match, factor), Image.new("RGB", (large, large), (225, 225, 225)), new)
    images = [_marked_line(found, factor), enlarged(match, factor), mask, _marked_line(embedded, factor)]
    _cut_line(mask, cells, large // side)
    titles = ("(e) an edge block, as found", "(f) its best match", "(g) what is cut from it", "(h) embedded")
    return list(zip(images, titles, strict=True))


def _number(placed: NDArray[np.void], block: NDArray[np.void]) -> int:
    """Return which of a chart's placements an edge block is of which the middle is known."""
    away = np.hypot(placed["row"] - block["row"], placed["column"] - block["column"])
    return int(np.where(placed["layer"] == 1, away, np.inf).argmin())


def _cut_line(image: Any, cells: NDArray[np.uint8], size: int) -> None:
    """Draw the border between old and new cells."""
    draw = ImageDraw.Draw(image)
    for i, j in np.argwhere(np.diff(cells, axis=0)):
        draw.line((j * size, (i + 1) * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
    for i, j in np.argwhere(np.diff(cells, axis=1)):
        draw.line(((j + 1) * size, i * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
