"""The pages of the sheet: each case a row, revision left, tree right, and a part of each enlarged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.contact_sheet import Tile, write_sheet
from benchmarks.sheet_cases import Case
from upholster.base.types import PixelArray
from upholster.image.color import from_linear
from upholster.image.files.read import read_image
from upholster.image.resize import resize_image
from upholster.output.glb_picture import redrawn
from upholster.runtime.parallel import running

__all__ = ["Drawn", "draw", "write_pages"]

SHOT, SHOWN = 1080, 400
"""Sides of a picture: as it is drawn, of which a part is shown pixel by pixel; and on a page."""

CELL = 40
ROWS = 6

Image = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Drawn:
    """A result's picture, square, and what it says if there is none."""

    picture: Image
    failed: str = ""


def draw(case: Case, result: Path) -> Drawn:
    """Draw a GLB from the case's side, or show a flat picture as it is, at most SHOT wide."""
    if not case.is_flat:
        with running(1):
            (linear,) = redrawn(result, [case.view], size=(SHOT, SHOT), supersample=2)
        return Drawn(from_linear(linear, np.uint8))
    image = read_image(result)
    image = np.repeat(image[:, :, :1], 3, axis=2) if image.shape[2] < 3 else image[:, :, :3]
    if case.is_tile:
        image = np.tile(image, (2, 2, 1))
    return Drawn(np.ascontiguousarray(image[:SHOT, :SHOT]))


def nothing(said: str) -> Drawn:
    """Return a picture for a version that has none."""
    return Drawn(np.full((SHOT, SHOT, 3), 230, np.uint8), said)


def write_pages(
    out: Path,
    drawn: Mapping[str, tuple[Drawn, Drawn]],
    names: tuple[str, str],
    lines: Mapping[str, Sequence[Sequence[str]]],
) -> list[Path]:
    """Write pages of six cases each; `lines` go under the two pictures of each."""
    cases = list(drawn)
    pages = []
    for start in range(0, len(cases), ROWS):
        tiles: list[Tile] = []
        for case in cases[start : start + ROWS]:
            both = drawn[case]
            top, left = _most_texture(both[0].picture)
            whole = [_small(side.picture) for side in both]
            parts = [side.picture[top : top + SHOWN, left : left + SHOWN] for side in both]
            heads = [f"{case}: {name}" for name in names]
            said = [
                [side.failed[:60]] if side.failed else list(text)
                for side, text in zip(both, lines[case], strict=True)
            ]
            tiles += [(whole[n], [heads[n], *said[n]]) for n in (0, 1)]
            tiles += [(parts[n], [f"{names[n]}, enlarged"]) for n in (0, 1)]
        pages.append(out / f"sheet_{start // ROWS + 1}.jpg")
        write_sheet(pages[-1], tiles, columns=4)
    return pages


def _small(picture: Image) -> PixelArray:
    scale = SHOWN / max(picture.shape[:2])
    height, width = (max(1, round(side * scale)) for side in picture.shape[:2])
    return resize_image(picture, height=height, width=width)


def _most_texture(picture: Image) -> tuple[int, int]:
    """Return the corner of the part with the most texture in it: the nearest to the middle of such."""
    grey = picture.mean(axis=2)
    rows, columns = (side // CELL for side in grey.shape)
    cells = grey[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL)
    textured = np.pad((cells.std(axis=(1, 3)) > 4).astype(int).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    side = min(SHOWN // CELL, rows, columns)
    full = (
        textured[side:, side:] - textured[side:, :-side] - textured[:-side, side:] + textured[:-side, :-side]
    )
    middle = (np.array(full.shape) - 1) / 2
    away = np.hypot(*(np.indices(full.shape) - middle[:, None, None]))
    row, column = divmod(int((full - 1e-3 * away).argmax()), full.shape[1])
    return row * CELL, column * CELL
