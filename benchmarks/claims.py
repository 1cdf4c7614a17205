"""The paper's claim that 15 % of the coefficients suffice, 7 % for regular textures, measured on pictures.

``python -m benchmarks claims [FOLDER …] [-o OUT] [--profile NAME] [--shares PERCENT …]``, by default on the
project's examples; `benchmarks.fidelity` says how exemplars are read. Each exemplar of 128² covers the
cyclide by method "paper". Its picture with a share of the sample's coefficients is compared with the picture
with the sample itself, where the model is: by the structural similarity (SSIM) of its grey values and by FLIP
(`benchmarks.flip`). Two views: the whole model, and three times enlarged, where a pixel is about a texel.

A picture *passes* if it is as near to the full one as that one's own JPEG of quality 90 is, by both measures:
a difference that nobody notices in everyday use. Writes claims.csv and claims.png to OUT.

Profiles: "default" and "haar" take the start of the sample's stream, by default or with the Haar transform,
up to where that share of its coefficients is significant. "rule" is the paper's rule without any coding: the
largest coefficients of the three-level Haar transform, exactly, and all others zero.
"""

import argparse
import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity import CLASSES, EXAMPLES, exemplars
from benchmarks.flip import flip_map
from benchmarks.measure import Results
from upholster.codec import DecodedImage, decode, encode
from upholster.image import from_linear
from upholster.quilt import Quilt
from upholster.render import Camera, render
from upholster.textured import TexturedModel
from upholster.types import PixelArray
from upholster.wavelet import dwt2, idwt2

__all__ = ["claims", "main"]

SHARES = (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
"""Per cent; 100 is the whole stream, of which some coefficients may be too small to count."""

KINDS = ("regular", "near_regular", "irregular", "stochastic")
VIEWS = {"whole": 1.0, "near": 3.0}
PROFILES: dict[str, dict[str, Any]] = {"default": {}, "haar": {"wavelet": "haar", "levels": 3}}
RULE = "rule"
SIZE, VIEW, SUPERSAMPLE = (640, 480), (30.0, 30.0), 3
JPEG_QUALITY = 90
ALL = "all"


@dataclass(frozen=True)
class Row:
    """One picture beside the full one, and that one's JPEG.

    Attributes
    ----------
    share, significant
        What was asked for and what there is, in per cent.
    size
        Bytes of the sample's stream until then; 0 by the rule, which codes nothing.
    ssim, flip
        Means over the pixels that show the model.
    jpeg_ssim, jpeg_flip
        Of the full picture's JPEG.
    """

    exemplar: str
    kind: str
    view: str
    share: float
    significant: float
    size: int
    ssim: float
    flip: float
    jpeg_ssim: float
    jpeg_flip: float

    @property
    def passes(self) -> bool:
        """Whether it is as near to the full picture as the JPEG, by both measures."""
        return self.ssim >= self.jpeg_ssim and self.flip <= self.jpeg_flip


class Views:
    """Pictures of one quilt with any exemplar: the same cameras for all."""

    def __init__(self, surface: upholster.Surface, quilt: Quilt) -> None:
        self._surface, self._quilt = surface, quilt
        self._cameras: dict[str, Camera] = {}
        self.shown: dict[str, NDArray[np.bool_]] = {}

    def take(self, exemplar: PixelArray) -> dict[str, NDArray[np.uint8]]:
        """Return a picture (H, W, 3) per view."""
        model = TexturedModel(self._surface, upholster.paint(self._quilt, exemplar))
        positions = model.mesh.positions
        found = {}
        for name, zoom in VIEWS.items():
            if name not in self._cameras:
                eye = Camera.fit(positions, size=SIZE, view=VIEW).eye
                nearest = positions[np.linalg.norm(positions - eye, axis=1).argmin()]
                target = None if zoom == 1 else nearest
                self._cameras[name] = Camera.fit(positions, size=SIZE, view=VIEW, zoom=zoom, target=target)
            depth = np.empty((SIZE[1], SIZE[0]), np.float32)
            picture = render(
                positions,
                model.mesh.normals,
                model.uv,
                model.mesh.all_triangles(),
                model.atlas.pixels,
                camera=self._cameras[name],
                supersample=SUPERSAMPLE,
                depth=depth,
            )
            self.shown[name] = np.isfinite(depth)
            found[name] = from_linear(picture, np.uint8)
        return found


def claims(results: Results) -> None:
    """Add, for the project's examples, how many pass at 7 and 15 % and what the means are."""
    rows = list(_measured([EXAMPLES], (7.0, 15.0), RULE))
    for view in VIEWS:
        for share in (7.0, 15.0):
            these = [row for row in rows if (row.view, row.share) == (view, share)]
            results.add(
                f"claims, {view}, {share:g} % by the paper's rule: like the full picture",
                sum(row.passes for row in these),
                f"of {len(these)}",
                remark=f"SSIM {_mean(these, 'ssim'):.3f}, FLIP {_mean(these, 'flip'):.3f}",
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks claims", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--profile", choices=(*PROFILES, RULE), default="default")
    parser.add_argument("--shares", nargs="+", type=float, default=SHARES, metavar="PERCENT")
    asked = parser.parse_args(arguments)
    if not all(0 < share <= 100 for share in asked.shares):
        parser.error("shares are above 0 and at most 100 per cent")
    rows = list(_measured(asked.folders, asked.shares, asked.profile))
    if not rows:
        parser.error("there is no image in the folders")
    _show(rows)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
        with (asked.out / "claims.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([*(entry.name for entry in fields(Row)), "passes"])
            writer.writerows([*astuple(row), int(row.passes)] for row in rows)
        _plot(rows, asked.out / "claims.png")
    return 0


def _measured(folders: Sequence[Path], shares: Sequence[float], profile: str) -> Iterator[Row]:
    surface = upholster.ring_cyclide()
    for name, sample in exemplars([folder.resolve() for folder in folders]).items():
        exemplar = sample.exemplar
        kind = next((kind for kind in KINDS if name.startswith(kind)), CLASSES.get(name, ""))
        quilt = upholster.synthesize(exemplar, surface, method="paper", seed=1)
        views = Views(surface, quilt)
        full = views.take(exemplar)
        limits = {view: _compared(full[view], _jpeg(full[view]), views.shown[view]) for view in VIEWS}
        data = b"" if profile == RULE else encode(exemplar, **PROFILES[profile])
        for share in shares:
            part = _largest(exemplar, share / 100) if profile == RULE else _start(data, share / 100)
            pictures = views.take(part.image)
            for view in VIEWS:
                found = _compared(full[view], pictures[view], views.shown[view])
                yield Row(name, kind, view, share, 100 * part.significant, part.used, *found, *limits[view])


@dataclass(frozen=True)
class Part:
    """A sample with a share of its coefficients, and the bytes that it takes; 0 where it is not coded."""

    image: PixelArray
    significant: float
    used: int


def _largest(exemplar: PixelArray, share: float) -> Part:
    """Keep the largest coefficients of the three-level Haar transform, of all channels together."""
    coefficients = dwt2(exemplar)
    count = round(share * coefficients.size)
    smallest = np.partition(np.abs(coefficients).reshape(-1), -count)[-count]
    kept = np.where(np.abs(coefficients) >= smallest, coefficients, 0.0)
    image = idwt2(kept)
    if exemplar.dtype.kind == "u":
        image = np.clip(np.rint(image), 0, np.iinfo(exemplar.dtype).max)
    return Part(image.astype(exemplar.dtype), np.count_nonzero(kept) / kept.size, 0)


def _start(data: bytes, share: float) -> DecodedImage:
    """Decode the shortest start with a share of significant coefficients; at 1, or beyond all, the whole."""
    whole = decode(data)
    if share >= min(1.0, whole.significant):
        return whole
    short, enough = 0, whole
    while enough.used - short > 1:
        middle = decode(data, most_bytes=(short + enough.used) // 2)
        if middle.significant >= share:
            enough = middle
        else:
            short = middle.used
    return enough


def _compared(
    full: NDArray[np.uint8], other: NDArray[np.uint8], shown: NDArray[np.bool_]
) -> tuple[float, float]:
    """Return SSIM and FLIP of two pictures, means over the pixels that show the model."""
    from skimage.metrics import structural_similarity

    _, similar = structural_similarity(
        _grey(full), _grey(other), data_range=255.0, gaussian_weights=True, sigma=1.5,
        use_sample_covariance=False, full=True,
    )  # fmt: skip
    return float(similar[shown].mean()), float(flip_map(full, other)[shown].mean())


def _grey(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    return np.asarray(picture @ np.array([0.2126, 0.7152, 0.0722]))


def _jpeg(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=JPEG_QUALITY)
    return np.asarray(Image.open(file).convert("RGB"))


def _mean(rows: Sequence[Row], name: str) -> float:
    return float(np.mean([getattr(row, name) for row in rows]))


def _shares(rows: Sequence[Row]) -> list[float]:
    return sorted({row.share for row in rows})


def _show(rows: Sequence[Row]) -> None:
    kinds = [kind for kind in KINDS if any(row.kind == kind for row in rows)]
    for view in VIEWS:
        here = [row for row in rows if row.view == view]
        table = Table("share", "significant", "bytes", "SSIM", "FLIP", "pass", *(f"{k}" for k in kinds))
        table.title = (
            f"{view}: means over {len({row.exemplar for row in here})} exemplars; JPEG {JPEG_QUALITY}: "
            f"SSIM {_mean(here, 'jpeg_ssim'):.3f}, FLIP {_mean(here, 'jpeg_flip'):.3f}"
        )
        for share in _shares(here):
            these = [row for row in here if row.share == share]
            passed = [f"{sum(row.passes for row in these)} of {len(these)}"]
            for kind in kinds:
                own = [row for row in these if row.kind == kind]
                passed.append(f"{sum(row.passes for row in own)} of {len(own)}")
            table.add_row(
                f"{share:g} %",
                f"{_mean(these, 'significant'):.1f} %",
                f"{_mean(these, 'size'):.0f}",
                f"{_mean(these, 'ssim'):.3f}",
                f"{_mean(these, 'flip'):.3f}",
                *passed,
            )
        Console(width=140).print(table)


def _plot(rows: Sequence[Row], path: Path) -> None:
    """Draw SSIM and FLIP over the share, a thin line per exemplar, the mean, and the JPEG's mean."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
    colors = {"whole": "#1f4e9c", "near": "#b5482a"}
    for axis, name, title in zip(axes, ("ssim", "flip"), ("SSIM", "FLIP"), strict=True):
        for view in VIEWS:
            here = [row for row in rows if row.view == view]
            shares = _shares(here)
            for exemplar in sorted({row.exemplar for row in here}):
                line = {row.share: getattr(row, name) for row in here if row.exemplar == exemplar}
                axis.plot(shares, [line[s] for s in shares], color=colors[view], alpha=0.18, linewidth=0.8)
            means = [_mean([row for row in here if row.share == share], name) for share in shares]
            words = {"whole": "whole model", "near": "3 times enlarged"}[view]
            axis.plot(shares, means, color=colors[view], linewidth=2.2, label=words)
            level = _mean(here, f"jpeg_{name}")
            axis.axhline(
                level, color=colors[view], linestyle="--", linewidth=1, label=f"its JPEG {JPEG_QUALITY}"
            )
        for claimed in (7, 15):
            axis.axvline(claimed, color="#888888", linewidth=0.8, linestyle=":")
        axis.set_xscale("log")
        axis.set_xticks([s for s in _shares(rows) if s in (1, 3, 7, 15, 30, 100)])
        axis.get_xaxis().set_major_formatter("{x:g}")
        axis.get_xaxis().set_minor_locator(mpl.ticker.NullLocator())
        axis.set_xlabel("coefficients, % (7 and 15: the paper's)")
        axis.set_title(f"{title} against the full picture")
    axes[0].legend(loc="lower right", fontsize=9)
    figure.savefig(path, dpi=110)
    plt.close(figure)
