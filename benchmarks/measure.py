"""What benchmarks share: options, samples, clocks."""

import resource
import statistics
import sys
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import upholster
from upholster.base.types import PixelArray
from upholster.charts.layout import texture_scale
from upholster.geometry.patches.surface import Surface
from upholster.image.files.write import IMAGE_SUFFIXES

__all__ = [
    "EXAMPLES",
    "EXEMPLAR",
    "Request",
    "median_processor_seconds",
    "median_seconds",
    "one_pixel_a_texel",
    "processor_seconds",
    "psnr",
    "row",
    "samples",
]

EXAMPLES = Path(__file__).parent.parent / "examples"
EXEMPLAR = EXAMPLES / "bricks.png"


@dataclass(frozen=True)
class Request:
    """The options of a benchmark: files and folders; a folder for pictures and points; numbers."""

    files: tuple[Path, ...] = ()
    out: Path | None = None
    texels: int | None = None
    seeds: int = 1
    runs: int = 5

    def listed(self, suffixes: Collection[str]) -> list[Path]:
        """Return the files, and those in the folders, that end so; without any the program ends."""
        inside = [sorted(place.iterdir()) if place.is_dir() else [place] for place in self.files]
        found = [file for files in inside for file in files if file.suffix.lower() in suffixes]
        if not found:
            sys.exit(f"there is no file to measure; allowed: folders, or files of {', '.join(suffixes)}")
        return found


def samples(request: Request, side: int = 128) -> dict[str, tuple[PixelArray, PixelArray | None]]:
    """Return samples by name, each with the picture of twice the side whose upper left quarter it is.

    Without a folder they are the project's own, reduced to `side`, of which there is no larger picture.
    """
    if not request.files:
        own = Request((EXAMPLES,)).listed(IMAGE_SUFFIXES)
        return {path.stem: (upholster.read_exemplar(path, resize=(side, side)), None) for path in own}
    found: dict[str, tuple[PixelArray, PixelArray | None]] = {}
    for path in request.listed(IMAGE_SUFFIXES):
        picture = upholster.read_exemplar(path, resize=(2 * side, 2 * side))
        found[path.stem] = (np.ascontiguousarray(picture[:side, :side]), picture)
    return found


def row(what: str, figure: float, unit: str, remark: str = "") -> list[str]:
    """Return a row of a table with the columns "what", "figure", "compared with"."""
    return [what, f"{figure:.4g} {unit}".strip(), remark]


def one_pixel_a_texel(surface: Surface, exemplar: PixelArray, texels: int) -> dict[str, Any]:
    """Return options with which texels are as large as pixels of the sample, along the patches' rows."""
    width = exemplar.shape[1]
    size = width / texture_scale(surface, width, texels=texels).density
    direction = "u" if len(surface.faces) == 1 else "around:z"
    return {"texels": texels, "sample_size": size, "direction": direction}


def psnr(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Return the peak signal-to-noise ratio of 8-bit samples in dB; 99 where they are equal."""
    error = np.mean((one.astype(np.float64) - other.reshape(one.shape)) ** 2)
    return 99.0 if error == 0 else float(10 * np.log10(255**2 / error))


def processor_seconds() -> float:
    """Return the processor time so far, in seconds, of this process, its threads and its finished children.

    Other programs on the machine disturb it less than the clock. A program that uses two cores counts twice.
    """
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def median_processor_seconds(function: Callable[[], object], *, runs: int = 7) -> float:
    """Return the median processor time of `runs` calls, after one that is not counted."""
    return _median(function, processor_seconds, runs)


def median_seconds(function: Callable[[], object], *, runs: int = 7) -> float:
    """Return the median time of `runs` calls by the clock, after one that is not counted."""
    return _median(function, time.perf_counter, runs)


def _median(function: Callable[[], object], clock: Callable[[], float], runs: int) -> float:
    function()
    times = []
    for _ in range(runs):
        start = clock()
        function()
        times.append(clock() - start)
    return statistics.median(times)
