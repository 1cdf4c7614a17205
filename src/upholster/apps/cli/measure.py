"""``upholster measure``: figures for seams, scale and fidelity."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upholster.apps.cli.command_options import spelled_out
from upholster.apps.cli.console import (
    MostTexels,
    Quiet,
    Threads,
    add_row,
    check_suffix,
    limits_of,
    naming,
    new_console,
    noted,
    progress_bars,
    say,
)
from upholster.base.display import in_bytes
from upholster.base.errors import InputError
from upholster.base.options.option_fields import differing
from upholster.base.options.sample_options import SampleOptions

if TYPE_CHECKING:  # NumPy, which it imports, would slow down --help
    from upholster.base.limits import Limits
    from upholster.base.types import PixelArray
    from upholster.covering.measure import Measures

__all__ = ["measure"]


@spelled_out(without=["Maps", "use"])
def measure(
    result: Annotated[str, typer.Argument(help="A stream, or a flat image.", metavar="STREAM-OR-IMAGE")],
    sample: Annotated[
        str | None,
        typer.Option(
            metavar="IMAGE", help="The sample that it was made from. Default: the one in the stream."
        ),
    ] = None,
    *,
    preparing: SampleOptions,
    tileable: Annotated[
        bool, typer.Option("--tileable", help="The image wraps both ways: measure the seams of its edges.")
    ] = False,
    sample_size: Annotated[
        float | None,
        typer.Option(help="The requested width of the sample in model units. Default: the median found."),
    ] = None,
    direction: Annotated[
        str | None,
        typer.Option(metavar="DIRECTION", help="The requested direction, as in upholster cover."),
    ] = None,
    crease: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Angle from which the texture is interrupted at edges, as in upholster cover; "
            "seams there are listed separately. Default: 75.",
        ),
    ] = None,
    most_texels: MostTexels = None,
    json: Annotated[str | None, typer.Option(metavar="FILE", help="Write the figures as JSON.")] = None,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Measure a result: seams, scale, fidelity to the sample."""
    import json as codec

    from upholster.base.files import outputs, write_bytes
    from upholster.image.files.write import IMAGE_SUFFIXES

    suffix = Path(result).suffix.lower()
    check_suffix("result", result, (".uph", *IMAGE_SUFFIXES))
    if suffix != ".uph" and sample is None:
        raise InputError(f"--sample is missing; image {result!r} is compared with its sample")
    if (given := differing(preparing)) and sample is None:
        raise InputError(f"{', '.join(given)} is for --sample, and none is given; allowed: with it")
    if json is not None:
        check_suffix("output", json, (".json",))
    if suffix == ".uph" and tileable:
        raise InputError("--tileable belongs to a flat image; a stream stores its own surface")
    if suffix != ".uph" and any(value is not None for value in (sample_size, direction, crease, most_texels)):
        raise InputError(
            "--sample-size, --direction, --crease, --limit belong to a stream; an image has no surface"
        )
    if sample_size is not None and not 1e-9 <= sample_size <= 1e9:
        raise InputError(f"sample size is {sample_size:g}; allowed: 1e-9 to 1e9 model units")
    read = [result] if sample is None else [result, sample]
    with progress_bars(quiet, ["measure"]), outputs([] if json is None else [json], inputs=read) as files:
        if suffix == ".uph":
            original = None if sample is None else _read_sample(sample, preparing)
            found, state = _stream(
                result, original, sample_size, direction, crease, threads, limits_of(most_texels)
            )
        else:
            found, state = _image(result, _read_sample(sample or "", preparing), tileable), ""
        if json is not None:
            asked = {"sample_size": sample_size, "direction": direction, "crease": crease}
            asked = asked if suffix == ".uph" else {}
            figures = {"result": result, "sample": sample, **given, **asked, **found.to_json()}
            text = codec.dumps(figures, indent=2)
            write_bytes(files.path(json), (text + "\n").encode())
    if not quiet:
        _show(found, state)


def _stream(
    path: str,
    original: "PixelArray | None",
    sample_size: float | None,
    direction: str | None,
    crease: float | None,
    threads: int | None,
    limits: "Limits | None",
) -> "tuple[Measures, str]":
    from upholster.base.files import read_bytes
    from upholster.codec.stream.reader import read_stream
    from upholster.covering.measure import measure_cover
    from upholster.quilt.painting import paint

    with naming(path):
        decoder = read_stream(read_bytes(path), strict=False, limits=limits)
    surface, quilt, coded = decoder.surface, decoder.quilt(), decoder.exemplar()
    if surface is None or decoder.is_base:
        raise InputError(f"stream {path!r} is cut before its surface; allowed: more of it")
    if original is not None and original.shape != coded.shape:
        shapes = ["×".join(str(side) for side in image.shape) for image in (original, coded)]
        raise InputError(
            f"--sample is {shapes[0]}; allowed: the stream's shape, {shapes[1]}; give the same --crop, "
            "--resize and so on as for the stream"
        )
    state = ""
    if not decoder.complete:
        known = "{:,} of {:,} placements are known".format(*decoder.placements_known)
        state = f"{path}: incomplete, {in_bytes(decoder.received)}; {known}"
    texels = paint(quilt, coded, density=1.0, threads=threads)
    compared = coded if original is None else original
    scale = None if sample_size is None else compared.shape[1] / sample_size
    found = measure_cover(
        surface,
        quilt,
        compared,
        texels=texels,
        scale=scale,
        direction=direction,
        crease=crease,
        threads=threads,
    )
    return found, state


def _read_sample(sample: str, preparing: SampleOptions) -> "PixelArray":
    from upholster.image.files.read import read_exemplar

    with noted() as notes:
        return read_exemplar(sample, notes=notes, **preparing.preparing)


def _image(path: str, original: "PixelArray", tileable: bool) -> "Measures":
    from upholster.covering.measure import measure_image
    from upholster.image.files.read import read_image

    with noted() as notes:
        image = read_image(path, notes=notes)
    return measure_image(image, original, tileable=tileable)


def _show(found: "Measures", state: str) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.table import Column, Table

    console = new_console()
    if state:
        say(state)
    table = Table(Column("measure", no_wrap=True), "figure", "meaning", box=SIMPLE_HEAD)
    for row in found.rows():
        add_row(table, *row)
    console.print(table)
