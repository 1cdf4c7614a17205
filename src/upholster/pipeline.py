"""The whole flow on one screen: exemplar and surface, layout and synthesis, painting, files.

exemplar, surface ──► synthesize ──► quilt ──► paint ──► texels ──► mesh, atlas ──► GLB, OBJ, PNG, npz
"""

import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any

from upholster._version import __version__
from upholster.files import outputs
from upholster.geometry import Surface, surface_from_spec
from upholster.image import read_exemplar
from upholster.outputs import TexturedModel, WriteOptions, parse_output, write_output
from upholster.synthesis import Quilt, Texels, paint, synthesize
from upholster.synthesis.quilt import MASK_CUT
from upholster.types import Progress

__all__ = ["CoverReport", "cover", "write"]


@dataclass(frozen=True, slots=True)
class CoverReport:
    """What `cover` did; `--report` writes it as JSON.

    Attributes
    ----------
    version
        Of upholster.
    parameters
        Everything that was asked for, defaults and seed included.
    counts
        Patches, charts, texels, placements, edge blocks, channels, bits per sample.
    seconds
        Time per stage, and "total".
    peak_memory_bytes
        Most memory that the process has held at once; None where the system does not tell.
    written
        Bytes of each file.
    """

    version: str
    parameters: dict[str, Any]
    counts: dict[str, int]
    seconds: dict[str, float]
    peak_memory_bytes: int | None
    written: dict[str, int] = field(default_factory=dict)


def cover(
    exemplar: str | os.PathLike[str],
    on: str,
    targets: Sequence[str],
    *,
    crop: tuple[int, int, int, int] | None = None,
    resize: str | None = None,
    synthesis: dict[str, Any] | None = None,
    options: WriteOptions | None = None,
    report: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> CoverReport:
    """Cover a surface with an exemplar and write the results: what the command ``upholster cover`` does.

    Parameters
    ----------
    exemplar
        Image file, see `upholster.read_exemplar` (also for `crop` and `resize`).
    on
        Which surface, see `upholster.surface_from_spec`.
    targets
        Files to write, by suffix; ``atlas:`` before an image's path writes the atlas instead of a picture.
    synthesis
        Keyword arguments of `upholster.synthesize`.
    options
        How models and pictures are written.
    report
        Where to write the report as JSON.
    threads, progress
        As in `upholster.synthesize`; stages "blocks", "seams", "paint" and "render".

    Returns
    -------
    CoverReport
        Parameters, counts and times.

    Raises
    ------
    InputError, FormatError
        Before any work where possible; nothing is written then.
    """
    options = options or WriteOptions()
    wanted = [parse_output(target) for target in targets]
    seconds: dict[str, float] = {}
    with outputs(
        [file for output in wanted for file in output.files] + ([report] if report else [])
    ) as files:
        with _timed("read", seconds):
            surface = surface_from_spec(on)
            _ = surface.shared  # edges that are claimed twice are found now, not after the work
            pixels = read_exemplar(exemplar, crop=crop, resize=resize)
        with _timed("synthesize", seconds):
            quilt = synthesize(pixels, surface, threads=threads, progress=progress, **(synthesis or {}))
        with _timed("paint", seconds):
            texels = paint(quilt, pixels, threads=threads, progress=progress)
        model = TexturedModel(surface, texels, options, threads)
        written: dict[str, int] = {}
        for output in wanted:
            with _timed(f"write {output.path.name}", seconds):
                write_output(output, model, files, progress=progress)
            written |= {str(file): files.path(file).stat().st_size for file in output.files}
        asked = {"exemplar": str(exemplar), "on": on, "crop": crop, "resize": resize, "threads": threads}
        asked |= _defaults(synthesize) | (synthesis or {}) | asdict(options)
        result = CoverReport(
            __version__, asked, _counts(surface, quilt, texels), _totalled(seconds), _peak_memory(), written
        )
        if report:
            files.path(report).write_text(json.dumps(asdict(result), indent=2) + "\n", encoding="utf-8")
    return result


def write(
    target: str | os.PathLike[str],
    surface: Surface,
    texels: Texels,
    *,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a textured surface to one file: .glb, .obj, .npz, or a picture (.png, .jpg, .webp, .exr).

    Parameters
    ----------
    target
        The file; ``atlas:`` before an image's path writes the atlas instead of a picture.
    surface
        The surface.
    texels
        Its texels, as `upholster.paint` makes them.
    options
        Mesh, texture format and picture, see `upholster.WriteOptions`.
    threads, progress
        As in `upholster.synthesize`; stage "render" for pictures.

    Raises
    ------
    InputError
        For an unknown suffix, a place that cannot be written, or texels of another surface.
    """
    output = parse_output(os.fspath(target))
    model = TexturedModel(surface, texels, options or WriteOptions(), threads)
    with outputs(output.files) as files:
        write_output(output, model, files, progress=progress)


@contextmanager
def _timed(stage: str, seconds: dict[str, float]) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def _totalled(seconds: dict[str, float]) -> dict[str, float]:
    return {stage: round(value, 4) for stage, value in [*seconds.items(), ("total", sum(seconds.values()))]}


def _counts(surface: Surface, quilt: Quilt, texels: Texels) -> dict[str, int]:
    sample = texels.arrays[0]
    return {
        "patches": len(surface.patches),
        "shared edges": len(surface.shared),
        "charts": len(quilt.charts),
        "texels": quilt.texel_count,
        "placements": len(quilt.placements),
        # A mended block lies on two charts.
        "edge blocks": int((quilt.placements["mask"] == MASK_CUT).sum()) // 2,
        "channels": sample.shape[2],
        "bits": 8 * sample.itemsize,
    }


def _defaults(function: Any) -> dict[str, Any]:
    return {
        name: value for name, value in function.__kwdefaults__.items() if name not in ("threads", "progress")
    }


def _peak_memory() -> int | None:
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
