"""Figures 3 and 4: how the parts work together, each shown by what it makes of one exemplar."""

from typing import Any

import numpy as np
from PIL import ImageDraw

from gallery_tools.drawing import enlarged, heat
from gallery_tools.flow import Node, flow
from gallery_tools.method import (
    BLOCK,
    LEVELS,
    OVERLAP,
    RED,
    TILE,
    bands_picture,
    block_corner,
    candidate_costs,
    first_blocks,
    first_pixel,
    overlap_tiles,
)
from gallery_tools.shots import Exemplars, charted, read, take
from gallery_tools.surfaces import TINTS
from upholster.base.types import PixelArray
from upholster.codec.ezw import decode, encode
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.quilt.model import Quilt
from upholster.quilt.painting import paint

__all__ = ["on_one_patch", "overview"]

SHARE = 0.15
PATCH, SIDE, ACROSS = 6, 128, 5
"""The patch that is shown, its chart's texels each way, and how many blocks lie side by side there."""

CYAN = (0, 150, 190)


def overview(exemplars: Exemplars) -> Any:
    """Draw figure 3: from a surface and an exemplar to a textured model."""
    ring, exemplar = ring_cyclide(), read(exemplars.pick("cobble"), 128)
    options: dict[str, Any] = {"chart": 192, "block": BLOCK, "overlap": OVERLAP, "levels": LEVELS, "seed": 5}
    quilt = synthesize(exemplar, ring, method="paper", **options)
    bare = synthesize(exemplar, ring, method="paper", seams=False, **options)
    part = decode(encode(exemplar, wavelet="haar", levels=LEVELS), coefficients=SHARE).image
    corner = ring.patches[PATCH].points(1.0, 1.0)
    whole: dict[str, Any] = {"size": (480, 400), "view": (205.0, 42.0)}
    close: dict[str, Any] = whole | {"zoom": 3.2, "target": corner}
    tints = [np.full((64, 64, 3), TINTS[n // 4 % 2][n % 2], np.uint8) for n in range(len(ring.patches))]
    texels = [paint(bare, exemplar), paint(quilt, exemplar), paint(quilt, part)]
    nodes = [
        Node(take(ring, **whole).image, ("geometric surface", "(section 3)"), 0, 0),
        Node(take(charted(ring, tints), **whole).image, ("16 Bezier patches", "(sections 2, 3)"), 1, 0),
        Node(
            take(charted(ring, texels[0].arrays), **close).image,
            ("each patch on its own:", "match, place, blend (4.3)"), 2, 0,
        ),
        Node(
            take(charted(ring, texels[1].arrays), **close).image,
            ("edge blocks: match,", "cut, feather (4.4)"), 3, 0,
        ),
        Node(
            take(charted(ring, texels[1].arrays), **whole).image,
            ("quadrilaterals of texture", "on the surface (4.5)"), 4, 0,
        ),
        Node(enlarged(exemplar, 2), ("exemplar", "128 x 128"), 0, 1),
        Node(bands_picture(exemplar, 2), ("three-level Haar", "transform (4.2)"), 1, 1),
        Node(enlarged(part, 2), (f"the exemplar of {100 * SHARE:g} %", "of its coefficients (4.6)"), 3, 1),
        Node(
            take(charted(ring, texels[2].arrays), **whole).image,
            ("the same quilt, painted", "with these"), 4, 1,
        ),
    ]  # fmt: skip
    return flow(nodes, [(0, 1), (1, 2), (2, 3), (3, 4), (5, 6), (6, 2), (6, 7), (7, 8)])


def on_one_patch(exemplars: Exemplars) -> Any:
    """Draw figure 4: a patch's first block, and how the next ones are found."""
    ring, exemplar = ring_cyclide(), read(exemplars.pick("stone_wall"), 128)
    quilt = synthesize(
        exemplar, ring, method="paper", chart=SIDE, block=BLOCK, overlap=OVERLAP, levels=LEVELS, seed=1
    )
    bare = first_blocks(quilt, PATCH, ACROSS**2)
    blocks = bare.on_chart(PATCH)
    first = first_pixel(blocks[0], (0, 0))
    number = ACROSS + 1  # the first block that overlaps both to the left and above
    top, left = block_corner(number, ACROSS)
    before = _laid(bare, exemplar, number)
    costs = candidate_costs(before[top : top + BLOCK, left : left + BLOCK], exemplar)
    winner = first_pixel(blocks[number], (top, left))
    chart = paint(bare, exemplar).arrays
    whole: dict[str, Any] = {"size": (480, 400), "view": (205.0, 42.0)}
    nodes = [
        Node(_framed(exemplar, first), ("exemplar, a random", "block of it"), 0, 0),
        Node(_in_bands(exemplar, first), ("three-level DWT: that", "block in every sub-band"), 1, 0),
        Node(
            enlarged(exemplar[first[0] : first[0] + BLOCK, first[1] : first[1] + BLOCK], 6),
            ("its inverse DWT", ""), 2, 0,
        ),
        Node(enlarged(_laid(bare, exemplar, 1), 2), ("the first block", "on the patch"), 3, 0),
        Node(_tiles(before, (top, left)), ("a later block's overlap,", "7 tiles of 8 x 8 texels"), 0, 1),
        Node(
            enlarged(heat(1 - np.sqrt(costs / costs.max())), 14),
            ("cost of each place by LL3", "and HH3, bright: low"), 1, 1,
        ),
        Node(_framed(exemplar, winner), ("the best place", "in the exemplar"), 2, 1),
        Node(enlarged(_laid(bare, exemplar, number + 1), 2), ("placed, blended", "in the overlap"), 3, 1),
        Node(enlarged(chart[PATCH], 2), ("the whole patch", ""), 4, 1),
        Node(take(charted(ring, _only(chart)), **whole).image, ("on the surface", ""), 4, 0),
    ]  # fmt: skip
    return flow(nodes, [(0, 1), (1, 2), (2, 3), (4, 5), (5, 6), (6, 7), (7, 8), (8, 9)])


def _laid(quilt: Quilt, exemplar: PixelArray, count: int) -> PixelArray:
    """Return the patch's texels after so many blocks, light grey where there is none."""
    laid = paint(first_blocks(quilt, PATCH, count), exemplar).arrays[PATCH]
    there = np.zeros((SIDE, SIDE), bool)
    for number in range(count):
        row, column = block_corner(number, ACROSS)
        there[row : row + BLOCK, column : column + BLOCK] = True
    return np.asarray(np.where(there[..., None], laid, np.uint8(236)))


def _framed(pixels: PixelArray, corner: tuple[int, int]) -> Any:
    """Frame a block of an exemplar."""
    picture = enlarged(pixels, 2)
    _rectangle(ImageDraw.Draw(picture), corner, BLOCK, RED)
    return picture


def _rectangle(draw: Any, corner: tuple[int, int], side: int, color: tuple[int, ...]) -> None:
    y, x = (2 * place for place in corner)
    draw.rectangle((x, y, x + 2 * side - 1, y + 2 * side - 1), outline=color, width=3)


def _in_bands(exemplar: PixelArray, corner: tuple[int, int]) -> Any:
    """Frame what a block has in every sub-band."""
    picture = bands_picture(exemplar, 2)
    draw = ImageDraw.Draw(picture)
    for level in range(1, LEVELS + 1):
        side = exemplar.shape[0] >> level
        place = corner[0] >> level, corner[1] >> level
        for down, across in ((0, 1), (1, 0), (1, 1), (0, 0)):
            if down or across or level == LEVELS:
                at = place[0] + down * side, place[1] + across * side
                _rectangle(draw, at, BLOCK >> level, RED)
    return picture


def _tiles(pixels: PixelArray, corner: tuple[int, int]) -> Any:
    """Frame the tiles of a block's overlap, and the block."""
    picture = enlarged(pixels, 2)
    draw = ImageDraw.Draw(picture)
    for a, b in overlap_tiles():
        _rectangle(draw, (corner[0] + a * TILE, corner[1] + b * TILE), TILE, CYAN)
    _rectangle(draw, corner, BLOCK, RED)
    return picture


def _only(arrays: tuple[PixelArray, ...]) -> list[PixelArray]:
    """Return the texels of all patches, but for the shown one's in light grey."""
    return [array if n == PATCH else np.full_like(array, 214) for n, array in enumerate(arrays)]
