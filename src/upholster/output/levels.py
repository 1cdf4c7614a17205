"""How a stream refines: the paper's figure 13, and the quality that its bytes buy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.limits import Limits
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.codec.stream.prefix import Limit, feed_until
from upholster.codec.stream.reader import StreamDecoder
from upholster.geometry.any_surface import AnySurface
from upholster.image.color import from_linear
from upholster.image.drawing import Drawing
from upholster.model.textured_model import TexturedModel
from upholster.quilt.model import Texels
from upholster.quilt.painting import paint
from upholster.runtime.parallel import quietly, report_progress

__all__ = ["SHARES", "Step", "curve_picture", "levels_picture", "refine_steps", "share_text", "texels_psnr"]

SHARES = (0.03, 0.05, 0.07, 0.15, 1.0)
"""The paper's quality levels: shares of the coefficients."""

_PIECE = 64
"""Number of bytes that are fed at once to find where the surface is complete."""


@dataclass(frozen=True)
class Step:
    """A stream as decoded from some of its bytes.

    Attributes
    ----------
    length
        Number of bytes used: those beyond a share of the coefficients do not count.
    complete
        Whether these are all bytes of the stream.
    coefficients
        Share of significant coefficients.
    charts
        Share of charts that have a placement of their own.
    texels
        The texels that can be painted.
    psnr
        PSNR of the texels against those of the complete stream, in dB; infinite if equal, NaN of a base,
        which has other texels.
    """

    length: int
    complete: bool
    coefficients: float
    charts: float
    texels: Texels
    psnr: float


def refine_steps(data: bytes, wanted: Sequence[Limit], *, limits: Limits | None = None) -> list[Step]:
    """Decode a stream up to each of several limits.

    Parameters
    ----------
    data
        The stream, or its start.
    wanted
        Limits of the bytes used, rising.
    limits
        As for `upholster.codec.stream.reader.StreamDecoder`.

    Returns
    -------
    list of Step
        One per limit.

    Raises
    ------
    FormatError, InputError
        If the stream is damaged, or too short to show anything.
    """
    full = StreamDecoder(limits=limits)
    full.feed(data)
    decoder = StreamDecoder(limits=limits)
    found: list[tuple[int, bool, float, float, Texels]] = []
    for limit in wanted:
        feed_until(decoder, data, limit)
        if decoder.needed:
            raise InputError(f"stream is cut; needs {decoder.needed} more bytes")
        known, count = decoder.coefficients_known
        charts = decoder.charts_known / len(decoder.charts)
        # The stream states its own density only after the first view.
        texels = paint(decoder.quilt(), decoder.exemplar(), density=full.density)
        found.append((decoder.used, decoder.complete, known / count, charts, texels))
    best = full.texels()
    return [Step(*entry, texels_psnr(entry[4], best)) for entry in found]


def texels_psnr(texels: Texels, best: Texels) -> float:
    """Return the PSNR over all charts, in dB: infinite if all texels are equal, NaN on other charts."""
    if texels.charts != best.charts:
        return float("nan")
    error = sum(
        float(np.sum((a.astype(np.float64) - b) ** 2))
        for a, b in zip(texels.arrays, best.arrays, strict=True)
    )
    count = sum(array.size for array in best.arrays)
    dtype = best.arrays[0].dtype
    peak = float(np.iinfo(dtype).max) if dtype.kind == "u" else max(float(np.ptp(a)) for a in best.arrays)
    return float("inf") if error == 0 else 10 * float(np.log10(peak * peak * count / error))


def levels_picture(
    data: bytes,
    *,
    options: WriteOptions | None = None,
    shares: Sequence[float] = SHARES,
    limits: Limits | None = None,
) -> PixelArray:
    """Show the model at rising shares of its coefficients, side by side (the paper's figure 13).

    Progress has the stage "levels".

    Parameters
    ----------
    data
        The stream.
    options
        Options of the pictures; `size` is that of a single one.
    shares
        Shares of significant coefficients.
    limits
        As for `upholster.codec.stream.reader.StreamDecoder`.

    Returns
    -------
    ndarray
        uint8 RGB, with share, bytes and PSNR against the complete stream under each picture.
    """
    options = options or WriteOptions(size=(400, 320))
    surface = _surface(data, limits)
    width, height = options.size
    gap = 12
    drawing = Drawing(len(shares) * (width + gap) + gap, height + 2 * gap + 48)
    wanted = [Limit(coefficients=share) for share in shares]
    with quietly():
        steps = refine_steps(data, wanted, limits=limits)
    for index, step in enumerate(steps):
        model = TexturedModel(step.texels.surface or surface, step.texels, options)
        left = gap + index * (width + gap)
        with quietly():
            drawing.paste(left, gap, from_linear(model.picture(), "uint8", dither=True))
        middle, below = left + width // 2, gap + height
        state = "complete, " if step.complete else ""
        drawing.text(middle, below + 22, f"{state}{share_text(step.coefficients)} of the coefficients")
        quality = "" if not np.isfinite(step.psnr) else f", {step.psnr:.1f} dB"
        drawing.text(middle, below + 44, f"{step.length:,} bytes{quality}")
        report_progress("levels", index + 1, len(shares))
    return drawing.pixels()


def share_text(share: float) -> str:
    """Return a share in per cent, with two digits; a share below 1 is never rounded up to 100 %."""
    percent = 100 * share
    return f"{percent:.2g} %" if percent < 99.5 else f"{min(percent, 100 if percent >= 100 else 99.9):.3g} %"


def curve_picture(data: bytes, *, limits: Limits | None = None) -> tuple[PixelArray, list[Step]]:
    """Plot the texels' PSNR over the bytes of the stream: the best so far, and thin the measured one.

    It begins where surface and layout have arrived. It hardly ever falls: a longer prefix rarely shows
    anything worse. A chart without placements shows the sample unchanged; a cell without a label takes the
    nearest placement.

    Returns
    -------
    picture : ndarray
        uint8 RGB.
    steps : list of Step
        The plotted steps.
    """
    first = StreamDecoder(limits=limits)
    feed_until(first, data, Limit(most_bytes=1))
    if first.needed:
        raise InputError(f"stream is cut; needs {first.needed} more bytes")
    while first.is_base and first.received < len(data):
        first.feed(data[first.received : first.received + _PIECE])
    if first.is_base:
        raise InputError("stream is cut before its surface and layout; allowed: a longer part of it")
    lengths = sorted({int(length) for length in np.geomspace(first.received, len(data), 24)})
    wanted = [Limit(most_bytes=length) for length in lengths]
    steps = refine_steps(data, wanted, limits=limits)
    return _plot(steps), steps


def _plot(steps: list[Step]) -> PixelArray:
    width, height, left, right, top, bottom = 760, 480, 70, 20, 20, 60
    drawing = Drawing(width, height)
    finite = [step.psnr for step in steps if np.isfinite(step.psnr)]
    low = 5 * np.floor(min(finite) / 5)
    high = 5 * np.ceil((max(finite) + 1) / 5)
    first, last = np.log10(steps[0].length), np.log10(steps[-1].length)

    def at(length: float, psnr: float) -> tuple[float, float]:
        x = left + (np.log10(length) - first) / max(1e-9, last - first) * (width - left - right)
        return x, top + (high - min(psnr, high)) / (high - low) * (height - top - bottom)

    grey = (0.85, 0.85, 0.85)
    for psnr in np.arange(low, high + 1, 5):
        drawing.lines([at(steps[0].length, psnr), at(steps[-1].length, psnr)], color=grey)
        drawing.text(left - 24, int(at(steps[0].length, psnr)[1]) + 5, f"{psnr:.0f}", size=14)
    for length in [unit * 10**power for power in range(1, 9) for unit in (1, 2, 5)]:
        if steps[0].length <= length <= steps[-1].length:
            drawing.lines([at(length, low), at(length, high)], color=grey)
            label = f"{length / 1000:g} kB" if length >= 1000 else f"{length}"
            drawing.text(int(at(length, low)[0]), height - bottom + 20, label, size=14)
    drawing.lines([at(steps[0].length, low), at(steps[-1].length, low)])
    drawing.lines([at(steps[0].length, low), at(steps[0].length, high)])
    best = np.maximum.accumulate([step.psnr for step in steps])
    drawing.lines([at(step.length, step.psnr) for step in steps], color=(0.6, 0.65, 0.75))
    drawing.lines(
        [at(step.length, psnr) for step, psnr in zip(steps, best, strict=True)],
        color=(0.1, 0.35, 0.7),
        width=3,
    )
    caption = "bytes of the stream; PSNR of the texels against the whole stream, in dB: best so far"
    thin = " (thin: measured)" if (np.diff(best) == 0).any() else ""
    drawing.text(width // 2, height - 12, caption + thin)
    return drawing.pixels()


def _surface(data: bytes, limits: Limits | None) -> AnySurface:
    decoder = StreamDecoder(limits=limits)
    decoder.feed(data)
    if decoder.surface is None or decoder.needed:
        raise InputError(f"stream is cut; needs {decoder.needed} more bytes")
    return decoder.surface
