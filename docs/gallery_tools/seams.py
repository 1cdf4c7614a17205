"""Figures of the seams: patch edges before and after the repair, and how an edge block is chosen and cut."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import Panel, compose, enlarged
from gallery_tools.method import BLOCK, LEVELS, OVERLAP, RED, YELLOW, block_corner
from gallery_tools.shots import Exemplars, charted, read, take
from upholster.geometry import ring_cyclide
from upholster.methods import synthesize
from upholster.methods.paper.edges import Strip, strip_along
from upholster.quilt import Chart, Quilt, paint
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
    strips = [strip_along(edge, quilt.charts, BLOCK) for edge in ring.shared]
    strip = next(one for one in strips if one is not None and (one.a, one.b) == (6, 10))
    flat = [_marked_line(_across(strip, quilt.charts, one.arrays, (112, 160)), 4) for one in texels]
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


_Arrays = tuple[PixelArray, ...]


def _across(strip: Strip, charts: tuple[Chart, ...], arrays: _Arrays, size: tuple[int, int]) -> PixelArray:
    """Return the texels round the middle of an edge in the frame of its chart A, which runs along rows."""
    height, width = size
    chart = charts[strip.a]
    line = (0, chart.width, chart.height, 0)[strip.edge_a]
    return _window(strip, charts, arrays, (line - height // 2, (chart.width - width) // 2), size)


def _window(
    strip: Strip, charts: tuple[Chart, ...], arrays: _Arrays, first: tuple[int, int], size: tuple[int, int]
) -> PixelArray:
    """Return a rectangle of texels of A's grid, those beyond the edge taken from B."""
    a, b = arrays[strip.a], arrays[strip.b]
    rows, columns = np.meshgrid(
        *(np.arange(n, dtype=np.int64) + at for at, n in zip(first, size, strict=True)), indexing="ij"
    )
    inside = (rows >= 0) & (rows < a.shape[0]) & (columns >= 0) & (columns < a.shape[1])
    window = np.empty((*size, a.shape[2]), a.dtype)
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
    charts, half = quilt.charts, BLOCK // 2
    corners = strip.corners(charts[strip.a], BLOCK, OVERLAP)
    numbers = _numbers(quilt, strip, corners + half)

    def seen(k: int, more: int) -> PixelArray:
        """Return the block's place before (0) and after (1) it is laid."""
        left_out = [set(own[k + more :]) for own in numbers]
        arrays = paint(_without(quilt, strip, left_out), exemplar).arrays
        return _window(strip, charts, arrays, tuple(corners[k]), (BLOCK, BLOCK))

    def shown(k: int) -> NDArray[np.uint8]:
        """Return where the block shows in its square, 1 or 0."""
        arrays = tuple(
            (quilt.owners(n, 0, 0, chart.height, chart.width) == own[k])[..., None]
            for n, chart, own in ((n, charts[n], numbers[n == strip.b]) for n in range(len(charts)))
        )
        return _window(strip, charts, arrays, tuple(corners[k]), (BLOCK, BLOCK))[..., 0].astype(np.uint8)

    def step(k: int) -> float:
        """Return how much the texels at both sides of the edge differ before."""
        rows = seen(k, 0)[half - 1 : half + 1].astype(np.float64)
        return float(np.abs(rows[1] - rows[0]).mean())

    def turns(k: int) -> int:
        """Return how often the cut turns."""
        return int(np.count_nonzero(np.diff(np.diff(shown(k).astype(int), axis=0), axis=1)))

    worst = sorted(range(len(corners)), key=step, reverse=True)[: max(1, len(corners) // 2)]
    chosen = max(worst, key=turns)
    block, found, embedded = quilt.on_chart(strip.a)[numbers[0][chosen]], seen(chosen, 0), seen(chosen, 1)
    row, column = block_corner(block, tuple(corners[chosen]))
    match = exemplar[row : row + BLOCK, column : column + BLOCK]
    cells, factor = shown(chosen), 9
    large = BLOCK * factor
    new = enlarged(np.kron(cells, np.ones((factor, factor), np.uint8)) * 255, 1).convert("L")
    mask = Image.composite(enlarged(match, factor), Image.new("RGB", (large, large), (225, 225, 225)), new)
    images = [_marked_line(found, factor), enlarged(match, factor), mask, _marked_line(embedded, factor)]
    _cut_line(mask, cells, factor)
    titles = ("(e) an edge block, as found", "(f) its best match", "(g) what is cut from it", "(h) embedded")
    return list(zip(images, titles, strict=True))


def _numbers(quilt: Quilt, strip: Strip, middles: NDArray[np.int64]) -> tuple[list[int], list[int]]:
    """Return which placements of A and of B edge blocks with these middles are: what shows there."""
    rows, columns = middles.T
    there = strip.to_b(rows, columns, quilt.charts[strip.a], quilt.charts[strip.b])
    a, b = (
        quilt.labels[chart][1].at(*(np.clip(part, 0, side - 1) for part, side in zip(at, sides, strict=True)))
        for chart, at in ((strip.a, (rows, columns)), (strip.b, there))
        for sides in [(quilt.charts[chart].height, quilt.charts[chart].width)]
    )
    return a.tolist(), b.tolist()


def _without(quilt: Quilt, strip: Strip, numbers: list[set[int]]) -> Quilt:
    """Return the quilt without some of the edge blocks of A and of B."""
    labels = list(quilt.labels)
    for chart, own in zip((strip.a, strip.b), numbers, strict=True):
        lower, upper = labels[chart]
        left = np.where(np.isin(upper.labels, sorted(own)), -1, upper.labels).astype(np.int32)
        labels[chart] = lower, replace(upper, labels=left)
    return replace(quilt, labels=tuple(labels))


def _cut_line(image: Any, cells: NDArray[np.uint8], size: int) -> None:
    """Draw the border between old and new cells."""
    draw = ImageDraw.Draw(image)
    for i, j in np.argwhere(np.diff(cells, axis=0)):
        draw.line((j * size, (i + 1) * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
    for i, j in np.argwhere(np.diff(cells, axis=1)):
        draw.line(((j + 1) * size, i * size, (j + 1) * size, (i + 1) * size), fill=YELLOW, width=3)
