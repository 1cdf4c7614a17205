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
from upholster.codec import check_image
from upholster.errors import FormatError
from upholster.files import outputs, read_bytes
from upholster.geometry import Surface, surface_from_spec
from upholster.image import read_exemplar
from upholster.outputs import TexturedModel, WriteOptions, parse_output, write_output
from upholster.stream import StreamDecoder
from upholster.stream.prefix import Limit, feed_until
from upholster.synthesis import Quilt, Texels, paint, synthesize
from upholster.synthesis.quilt import MASK_CUT
from upholster.types import PixelArray, Progress

__all__ = ["CoverReport", "RefineReport", "cover", "refine", "write"]


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
        if any(output.kind == "uph" for output in wanted):
            check_image(pixels, wavelet=options.wavelet, levels=options.levels, lossless=options.lossless)
        with _timed("synthesize", seconds):
            quilt = synthesize(pixels, surface, threads=threads, progress=progress, **(synthesis or {}))
        with _timed("paint", seconds):
            texels = paint(quilt, pixels, threads=threads, progress=progress)
        model = TexturedModel(surface, texels, options, threads, quilt, pixels)
        written: dict[str, int] = {}
        for output in wanted:
            with _timed(f"write {output.path.name}", seconds):
                write_output(output, model, files, progress=progress)
            written |= {str(file): files.path(file).stat().st_size for file in output.files}
        asked = {"exemplar": str(exemplar), "on": on, "crop": crop, "resize": resize, "threads": threads}
        asked |= _defaults(synthesize) | (synthesis or {}) | asdict(options)
        result = CoverReport(
            __version__, asked, _counts(surface, quilt, texels), _totalled(seconds), peak_memory(), written
        )
        if report:
            files.path(report).write_text(json.dumps(asdict(result), indent=2) + "\n", encoding="utf-8")
    return result


@dataclass(frozen=True, slots=True)
class RefineReport:
    """What `refine` did.

    Attributes
    ----------
    used, total
        Bytes of the stream that were read, and that it has when whole.
    complete
        Whether they are all.
    charts, coefficients
        Shares, 0 to 1, of charts whose placements are known and of significant coefficients.
    written
        Bytes of each file.
    """

    used: int
    total: int
    complete: bool
    charts: float
    coefficients: float
    written: dict[str, int]


def refine(
    stream: str | os.PathLike[str],
    targets: Sequence[str],
    *,
    limit: Limit | None = None,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RefineReport:
    """Write files from a stream, or from as much of one as there is: what ``upholster refine`` does.

    Parameters
    ----------
    stream
        A .uph file, whole or cut.
    targets, options, threads, progress
        As for `cover`.
    limit
        How far to read.

    Raises
    ------
    InputError, FormatError
        If the file is missing, damaged, or so short that nothing can be shown.
    """
    options = options or WriteOptions()
    wanted = [parse_output(target) for target in targets]
    with outputs([file for output in wanted for file in output.files]) as files:
        data = read_bytes(stream)
        decoder = StreamDecoder()
        feed_until(decoder, data, limit or Limit())
        if decoder.needed or decoder.surface is None:
            raise FormatError(f"byte {len(data)}: stream is cut; needs {max(1, decoder.needed)} more bytes")
        quilt, exemplar = decoder.quilt(), decoder.exemplar()
        texels = paint(quilt, exemplar, threads=threads, progress=progress)
        model = TexturedModel(decoder.surface, texels, options, threads, quilt, exemplar)
        written: dict[str, int] = {}
        for output in wanted:
            write_output(output, model, files, progress=progress)
            written |= {str(file): files.path(file).stat().st_size for file in output.files}
    known, count = decoder.coefficients_known
    return RefineReport(
        decoder.received,
        decoder.total or decoder.received,
        decoder.complete,
        decoder.charts_known / len(decoder.charts),
        known / count,
        written,
    )


def write(
    target: str | os.PathLike[str],
    surface: Surface,
    texels: Texels,
    *,
    quilt: Quilt | None = None,
    exemplar: PixelArray | None = None,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a textured surface to one file: .glb, .obj, .npz, .uph, or a picture (.png, .jpg, .webp, .exr).

    Parameters
    ----------
    target
        The file; ``atlas:`` before an image's path writes the atlas instead of a picture.
    surface
        The surface.
    texels
        Its texels, as `upholster.paint` makes them.
    quilt, exemplar
        What the texels were painted from: a stream (.uph) holds them instead.
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
    model = TexturedModel(surface, texels, options or WriteOptions(), threads, quilt, exemplar)
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


def peak_memory() -> int | None:
    """Return the most memory that this process has held at once, in bytes; None if the system is silent."""
    if sys.platform == "linux":
        # What getrusage tells on Linux may be the parent's peak, from before this program was loaded.
        with open("/proc/self/status", encoding="ascii") as file:
            return next((1024 * int(line.split()[1]) for line in file if line.startswith("VmHWM:")), None)
    if sys.platform == "win32":
        return None
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # in bytes on macOS
