"""Pages of pairs to be judged by eyes: without names, in random order; the key is in another file."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import upholster
from upholster.base.types import PixelArray
from upholster.image.files.write import write_image

__all__ = ["write_pairs"]

GAP = 16
QUESTIONS = (
    "The small picture is a piece of a material. One of the two large ones, A or B, shall show more of the "
    "same. <b>Which one do you take?</b> For each of them: <b>do you find a fault within five seconds, and "
    "where?</b>"
)


def write_pairs(
    out: Path,
    sheets: Mapping[tuple[Path, str], Mapping[str, Path]],
    pairs: Sequence[tuple[str, str]],
    seed: int,
) -> Path:
    """Write ``pairs/index.html`` with its pictures, and ``key.csv`` next to the folder; return the page.

    Parameters
    ----------
    out
        Gets both.
    sheets
        By sample file and model, then by way.
    pairs
        The ways that are compared, two at a time.
    seed
        Of the order, of the pairs and within them.
    """
    rng = np.random.default_rng(seed)
    folder = out / "pairs"
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    every = [(shown, pair) for shown in sheets for pair in pairs]
    key, rows = [("pair", "sample", "on", "A", "B")], []
    for number, n in enumerate(rng.permutation(len(every)), 1):
        (sample, on), pair = every[n]
        ways = [pair[k] for k in rng.permutation(2)]
        files = [sample, *(sheets[sample, on][way] for way in ways)]
        pictures = [_rgb(upholster.read_exemplar(file)) for file in files]
        write_image(folder / f"{number:03}.png", _beside(pictures))
        key.append((f"{number:03}", sample.stem, on, *ways))
        rows.append(f'<h2>{number:03}</h2><p><img src="{number:03}.png" alt="sample, A, B"></p>')
    with (out / "key.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(key)
    page = folder / "index.html"
    title = "<!doctype html><meta charset=utf-8><title>Pairs</title>"
    page.write_text("\n".join([title, f"<p>{QUESTIONS}</p>", *rows, ""]), encoding="utf-8")
    return page


def _rgb(image: PixelArray) -> PixelArray:
    return image[:, :, :3] if image.shape[2] > 2 else np.repeat(image[:, :, :1], 3, axis=2)


def _beside(pictures: Sequence[PixelArray]) -> PixelArray:
    """Return pictures in one row, A in the middle and B at the right, on white."""
    height = max(picture.shape[0] for picture in pictures)
    width = sum(picture.shape[1] for picture in pictures) + GAP * (len(pictures) - 1)
    row, column = np.full((height, width, 3), 255, np.uint8), 0
    for picture in pictures:
        row[: picture.shape[0], column : column + picture.shape[1]] = picture
        column += picture.shape[1] + GAP
    return row
