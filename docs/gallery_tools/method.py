"""Figures of the method inside a patch: decomposition and matching."""

from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from gallery_tools.drawing import PAPER, Panel, compose, enlarged, heat, text, text_width
from gallery_tools.shots import Exemplars, read
from upholster.base.types import FloatArray, PixelArray
from upholster.codec.haar import dwt2, subbands
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.plane import plane
from upholster.quilt.labels import nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.painting import paint

__all__ = [
    "BLOCK",
    "LEVELS",
    "OVERLAP",
    "RED",
    "TILE",
    "YELLOW",
    "bands_picture",
    "block_corner",
    "candidate_costs",
    "decomposition",
    "first_blocks",
    "first_pixel",
    "matching",
    "overlap_tiles",
]

RED, YELLOW, CYAN = (230, 30, 40), (255, 205, 0), (0, 190, 220)
BLOCK, OVERLAP, LEVELS, TILE = 32, 8, 3, 8


def decomposition(exemplars: Exemplars) -> Any:
    """Draw figure 5: an exemplar and its three-level Haar transform."""
    exemplar = read(exemplars.pick("cobble"))
    return compose(
        [[
            Panel(enlarged(exemplar, 2), "(a) exemplar, 256 x 256"),
            Panel(bands_picture(exemplar, 2, named=True),
                  "(b) three-level Haar transform; details three times as strong"),
        ]]
    )  # fmt: skip


def bands_picture(exemplar: PixelArray, factor: int, *, named: bool = False) -> Any:
    """Show an exemplar's three-level Haar transform, its pixels as squares of `factor`."""
    coefficients = dwt2(exemplar, levels=LEVELS)
    shown = np.empty(exemplar.shape, np.uint8)
    corners: dict[str, tuple[int, int, int]] = {}
    bands, places = subbands(coefficients, levels=LEVELS), subbands(shown, levels=LEVELS)
    index = np.arange(exemplar.shape[0] * exemplar.shape[1]).reshape(exemplar.shape[:2])
    for name, band in bands.items():
        level = int(name[2])
        # An orthonormal coefficient of level l is 2^l times a sample; details are stronger than they are.
        tone = band / 2**level if name[:2] == "LL" else 128 + 3 * band / 2**level
        places[name][:] = np.clip(np.rint(tone), 0, 255).astype(np.uint8)
        first = int(subbands(index, levels=LEVELS)[name][0, 0])
        corners[name] = (first % exemplar.shape[1], first // exemplar.shape[1], band.shape[0])
    picture = enlarged(shown, factor)
    draw = ImageDraw.Draw(picture)
    for name, (x, y, side) in corners.items():
        box = (x * factor, y * factor, (x + side) * factor - 1, (y + side) * factor - 1)
        draw.rectangle(box, outline=PAPER, width=1)
        if named:
            size = min(26, max(14, side * factor // 6))
            plate(draw, (box[0] + 4, box[1] + 4), name, size)
    return picture


def plate(draw: Any, place: tuple[float, float], words: str, size: int) -> None:
    """Write words on a light plate whose top left corner is at `place`."""
    x, y = place
    draw.rectangle((x, y, x + text_width(words, size) + 8, y + 1.3 * size), fill=PAPER)
    text(draw, (x + 4, y + 0.66 * size), words, size=size)


def matching(exemplars: Exemplars) -> Any:
    """Draw figure 6: what a block is compared by, where it is looked for, and what each place costs."""
    exemplar = read(exemplars.pick("stone_wall"), 128)
    flat = plane()
    side, across = 128, 5
    quilt = synthesize(
        exemplar,
        flat,
        chart=side,
        block=BLOCK,
        overlap=OVERLAP,
        levels=LEVELS,
        seams=False,
        seed=1,
        method="paper",
    )

    def searched(number: int) -> tuple[float, int, PixelArray, FloatArray]:
        before = paint(first_blocks(quilt, 0, number), exemplar).arrays[0]
        top, left = block_corner(number, across)
        costs = candidate_costs(before[top : top + BLOCK, left : left + BLOCK], exemplar)
        return float(costs.min()), number, before, costs

    inner = [searched(row * across + column) for row in (1, 2, 3) for column in (1, 2, 3)]
    # A block that has to break off its neighbours' source: continuing it exactly costs nothing.
    _, number, before, costs = min([one for one in inner if one[0] > 1] or inner, key=lambda one: one[:2])
    top, left = block_corner(number, across)
    laid = np.zeros((side, side), bool)
    laid[: top + OVERLAP] = True
    laid[: top + BLOCK, : left + OVERLAP] = True
    winner = tuple(place // TILE for place in first_pixel(quilt.placements[number], (top, left)))

    factor = 4
    bare = np.where(laid[..., None], before, np.uint8(236))
    chart = enlarged(bare, factor)
    _grid(chart, (left, top), factor)
    draw = ImageDraw.Draw(chart)
    draw.rectangle(_box(left, top, BLOCK, factor), outline=RED, width=4)
    side_px = exemplar.shape[0] * factor
    search = enlarged(exemplar, factor)
    draw = ImageDraw.Draw(search)
    for i in range(costs.shape[0]):
        for j in range(costs.shape[1]):
            x, y = j * TILE * factor, i * TILE * factor
            draw.ellipse((x - 3, y - 3, x + 3, y + 3), fill=YELLOW)
    draw.rectangle(_box(winner[1] * TILE, winner[0] * TILE, BLOCK, factor), outline=RED, width=4)
    cell = side_px // costs.shape[0]
    scaled = np.sqrt(costs / costs.max())
    chart_costs = enlarged(heat(1 - scaled), cell)
    draw = ImageDraw.Draw(chart_costs)
    box = (winner[1] * cell, winner[0] * cell, (winner[1] + 1) * cell - 1, (winner[0] + 1) * cell - 1)
    draw.rectangle(box, outline=RED, width=4)
    return compose(
        [
            [
                Panel(chart, "(a) the next block, and its overlap in tiles"),
                Panel(search, "(b) its places in the exemplar, the best in red"),
                Panel(chart_costs, "(c) cost of each place, bright: low"),
            ],
            [Panel(_features(before, exemplar, (top, left), winner), "")],
        ]
    )


def _grid(image: Any, corner: tuple[int, int], factor: int) -> None:
    """Tint the overlap's tiles of a block, and draw their borders."""
    shade = Image.new("RGBA", image.size)
    draw = ImageDraw.Draw(shade)
    for a, b in overlap_tiles():
        x, y = corner[0] + b * TILE, corner[1] + a * TILE
        draw.rectangle(_box(x, y, TILE, factor), fill=(*CYAN, 70), outline=(*CYAN, 255), width=2)
    image.paste(shade, (0, 0), shade)


def _box(x: int, y: int, size: int, factor: int) -> tuple[int, int, int, int]:
    return x * factor, y * factor, (x + size) * factor - 1, (y + size) * factor - 1


def overlap_tiles() -> list[tuple[int, int]]:
    """Return row and column of the tiles that a block's left and upper overlap covers."""
    tiles, band = BLOCK // TILE, OVERLAP // TILE
    return [(a, b) for a in range(tiles) for b in range(tiles) if a < band or b < band]


def candidate_costs(block: PixelArray, exemplar: PixelArray) -> FloatArray:
    """Return the sum of squared differences of the overlap's LL3 and HH3 at each candidate: (13, 13)."""
    wanted, offered = (subbands(dwt2(image, levels=LEVELS), levels=LEVELS) for image in (block, exemplar))
    grid, tiles = exemplar.shape[0] // TILE, BLOCK // TILE
    count = grid - tiles + 1
    costs = np.zeros((count, count))
    for name in (f"LL{LEVELS}", f"HH{LEVELS}"):
        for a, b in overlap_tiles():
            difference = offered[name][a : a + count, b : b + count] - wanted[name][a, b]
            costs += (difference**2).sum(axis=2)
    return costs


def _features(
    before: PixelArray, exemplar: PixelArray, corner: tuple[int, int], winner: tuple[int, ...]
) -> Any:
    """Show the coefficients that are compared: the block's, the best place's."""
    top, left = corner
    row, column = winner[0] * TILE, winner[1] * TILE
    blocks = (
        ("the block's overlap", before[top : top + BLOCK, left : left + BLOCK]),
        ("the best place", exemplar[row : row + BLOCK, column : column + BLOCK]),
    )
    cell, wide = 30, 1490
    picture = Image.new("RGB", (wide, 4 * cell + 64), PAPER)
    draw = ImageDraw.Draw(picture)
    x = 40
    for words, block in blocks:
        bands = subbands(dwt2(block, levels=LEVELS), levels=LEVELS)
        for name in (f"LL{LEVELS}", f"HH{LEVELS}"):
            tone = bands[name] / TILE if name[:2] == "LL" else 128 + 6 * bands[name] / TILE
            for a, b in overlap_tiles():
                color = tuple(int(c) for c in np.clip(np.rint(tone[a, b]), 0, 255))
                box = (x + b * cell, 30 + a * cell, x + (b + 1) * cell - 2, 30 + (a + 1) * cell - 2)
                draw.rectangle(box, fill=color)
            text(draw, (x + 2 * cell, 14), name, size=18, align=0.5)
            x += 4 * cell + 40
        text(draw, (x - 4 * cell - 60, 4 * cell + 50), words, size=20, align=0.5)
        x += 60
    lines = (
        "(d) what is compared: of each of the overlap's seven",
        "tiles of 8 x 8 texels one LL3 and one HH3 coefficient",
        "per channel. The place with the least sum of squared",
        "differences wins.",
    )
    for n, line in enumerate(lines):
        text(draw, (x + 30, 40 + 30 * n), line, size=20)
    return picture


def block_corner(number: int, across: int) -> tuple[int, int]:
    """Return the first texel of a chart's block; there are so many across."""
    row, column = divmod(number, across)
    return row * (BLOCK - OVERLAP), column * (BLOCK - OVERLAP)


def first_pixel(block: Any, corner: tuple[int, int]) -> tuple[int, int]:
    """Return the exemplar's pixel that the first texel, `corner`, of an upright block shows."""
    row, column = (
        (int(block[f"source_{axis}"]) + 8 - int(block[axis])) // 16 + at
        for axis, at in zip(("row", "column"), corner, strict=True)
    )
    return row, column


def first_blocks(quilt: Quilt, index: int, count: int) -> Quilt:
    """Return the quilt with only the first blocks on a chart, which go on where others would lie."""
    layer, placed = quilt.labels[index][0], quilt.on_chart(index)[:count]
    nearest = nearest_labels(
        placed["row"], placed["column"], quilt.charts[index], layer.cell, half=layer.half
    )
    shown = replace(layer, labels=np.where(layer.labels < count, layer.labels, nearest))
    return replace(quilt, labels=(*quilt.labels[:index], (shown,), *quilt.labels[index + 1 :]))
