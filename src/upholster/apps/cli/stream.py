"""``upholster refine``, ``info`` and ``levels``: a stream's contents, and files made from a stream."""

from pathlib import Path
from typing import Annotated

import typer

from upholster.apps.cli.cad_info import show_cad
from upholster.apps.cli.command_options import spelled_out
from upholster.apps.cli.console import (
    MostTexels,
    Quiet,
    Threads,
    add_row,
    byte_count,
    check_suffix,
    large_count,
    limits_of,
    naming,
    new_console,
    numbers,
    progress_bars,
    say,
    share,
    view_angles,
)
from upholster.apps.cli.model_info import show_model
from upholster.apps.cli.project_info import show_project
from upholster.apps.cli.surface_info import is_surface, show_surface
from upholster.base.display import in_bytes
from upholster.base.errors import InputError
from upholster.base.examples import model_path
from upholster.base.formats import (
    CAD_SUFFIXES,
    LDR_PICTURES,
    MODEL_SUFFIXES,
    OUTPUTS,
    PROJECT_SUFFIX,
    SURFACE_SUFFIXES,
    is_model_name,
    suffixes_of,
)
from upholster.base.lengths import METRES
from upholster.base.options.write_options import WriteOptions

__all__ = ["info", "levels", "refine"]


@spelled_out(without=["Stream"])
def refine(
    stream: Annotated[str, typer.Argument(help="A stream, or the start of one.", metavar="FILE.uph")],
    output: Annotated[
        list[str],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"As for `cover`: {' '.join(suffixes_of(OUTPUTS))}; `atlas:` before the name.",
        ),
    ],
    *,
    on: Annotated[
        str | None,
        typer.Option(
            metavar="SURFACE",
            help="Another surface for the same texels, as for `cover`; its patches must meet alike.",
        ),
    ] = None,
    texels: Annotated[
        str | None,
        typer.Option(
            metavar="N", help="Paint the same texture more finely or coarsely: about this many texels, `1M`."
        ),
    ] = None,
    most_bytes: Annotated[
        str | None, typer.Option("--bytes", metavar="N", help="Use only the first N bytes: 8000, 8k, 8Ki.")
    ] = None,
    bpp: Annotated[float | None, typer.Option(help="The same, in bits per pixel of the sample.")] = None,
    coefficients: Annotated[
        str | None,
        typer.Option(metavar="7%", help="Take this share of the sample's coefficients, with all placements."),
    ] = None,
    most_texels: MostTexels = None,
    writing: WriteOptions,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Write models and pictures from a stream, or from its start."""
    from upholster.codec.stream.prefix import Limit
    from upholster.output.levels import share_text
    from upholster.pipeline import refine as run

    limit = Limit(byte_count("bytes", most_bytes), bpp, share("coefficients", coefficients))
    uses = ["refine model", "refine picture", "refine paper", "refine material"]
    with naming(stream), progress_bars(quiet, uses) as progress:
        done = run(
            stream,
            output,
            limit=limit,
            on=on,
            texels=None if texels is None else large_count("texels", texels),
            options=writing,
            threads=threads,
            progress=progress,
            limits=limits_of(most_texels),
        )
    if not quiet:
        written = ", ".join(f"{name} ({in_bytes(count)})" for name, count in done.written.items())
        state = "complete" if done.complete else f"of {in_bytes(done.total)}, incomplete"
        say(
            f"wrote {written}: from {in_bytes(done.used)} {state}; {share_text(done.placements)} of the "
            f"placements, {share_text(done.coefficients)} of the coefficients"
        )


def info(
    file: Annotated[
        str,
        typer.Argument(
            help=f"A stream, or the start of one; or a model: {' '.join(MODEL_SUFFIXES)}; or a surface, "
            "`torus:R=2,r=0.7`, `nets.json`, `teapot.bpt`; or a project, .upholster.json.",
            metavar="FILE",
        ),
    ],
    unit: Annotated[
        str | None, typer.Option(metavar="mm", help=f"Unit of a model's file: {', '.join(METRES)}.")
    ] = None,
    most_texels: MostTexels = None,
) -> None:
    """Show the contents of a stream or a project; a model's parts and their defects; a surface's patches."""
    file = model_path(file)
    if file.lower().endswith(PROJECT_SUFFIX) and unit is None:
        show_project(file)
    elif file.lower().endswith(CAD_SUFFIXES):
        show_cad(file, unit=unit)
    elif is_model_name(file):
        show_model(file, unit=unit)
    elif unit is not None:
        raise InputError("--unit is for models: the unit of a stream or a project is fixed")
    elif is_surface(file):
        show_surface(file)
    else:
        _show_stream(file, most_texels)


def _show_stream(stream: str, most_texels: str | None) -> None:
    """Print a stream's chunks, its placements, and the quality after several numbers of bytes."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from upholster.base.files import read_bytes
    from upholster.codec.stream.chunks import MAGIC
    from upholster.codec.stream.description import describe
    from upholster.output.levels import share_text

    data = read_bytes(stream)
    suffix = Path(stream).suffix
    if suffix.lower() != ".uph" and not data.startswith(MAGIC):
        raise InputError(
            f"{stream!r} is no stream and has suffix {suffix!r}; allowed: .uph, "
            f"{', '.join((*MODEL_SUFFIXES, *SURFACE_SUFFIXES))}, {PROJECT_SUFFIX}, or a built-in surface"
        )
    with naming(stream):
        found = describe(data, limits=limits_of(most_texels))
    console = new_console()
    state = "complete" if found.complete else f"incomplete, {in_bytes(found.total)} in all"
    say(f"{stream}: {found.received:,} bytes, {state}; first view at {found.view:,} bytes")
    chunks = Table("chunk", "offset", "bytes", "here", "holds", box=SIMPLE_HEAD)
    for row in found.chunks:
        here = "all" if row.received == row.length else f"{row.received:,}"
        add_row(chunks, row.tag, f"{row.offset:,}", f"{row.length:,}", here, row.holds)
    console.print(chunks)
    readable = Table("bytes", "charts", "placements", "coefficients", "sample", box=SIMPLE_HEAD)
    for line in found.readable:
        quality = "as received" if line.psnr == float("inf") else f"{line.psnr:.1f} dB"
        parts = map(share_text, (line.charts, line.placements, line.coefficients))
        add_row(readable, f"{line.length:,}", *parts, quality)
    console.print(readable)


def levels(
    stream: Annotated[str, typer.Argument(help="A stream, or the start of one.", metavar="FILE.uph")],
    output: Annotated[str, typer.Option("-o", "--output", metavar="PICTURE", help=" ".join(LDR_PICTURES))],
    curve: Annotated[bool, typer.Option("--curve", help="Plot quality over bytes instead.")] = False,
    most_texels: MostTexels = None,
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of each picture in pixels.")] = "400x320",
    view: Annotated[str, typer.Option(metavar="AZ,EL", help="Azimuth and elevation in degrees.")] = "30,30",
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Show a stream at 3, 5, 7 and 15 % of its coefficients and complete (the paper's figure 13)."""
    from upholster.base.files import outputs, read_bytes
    from upholster.image.files.write import write_image
    from upholster.output.levels import curve_picture, levels_picture
    from upholster.runtime.parallel import running

    check_suffix("output", output, LDR_PICTURES)
    options = WriteOptions(size=numbers("size", size, "x", 2, int), view=view_angles(view), supersample=3)
    with (
        naming(stream),
        progress_bars(quiet, ["levels"]) as progress,
        running(threads, progress),
        outputs([output], inputs=[stream]) as files,
    ):
        data, limits = read_bytes(stream), limits_of(most_texels)
        if curve:
            picture, _ = curve_picture(data, limits=limits)
        else:
            picture = levels_picture(data, options=options, limits=limits)
        write_image(files.path(output), picture)
    if not quiet:
        say(f"wrote {output}")
