"""``upholster fill``: holes in photos and materials."""

import time
from typing import Annotated

import typer

from upholster.apps.cli.console import Quiet, progress_bars, say
from upholster.base.display import in_bytes
from upholster.base.formats import IMAGES_READ, IMAGES_WRITTEN

__all__ = ["fill"]


def fill(
    photo: Annotated[
        list[str],
        typer.Argument(
            help=f"A photo ({IMAGES_READ}); or a material's maps, as a folder, a zip "
            "file or files named by role: all are filled in the same way.",
            metavar="PHOTO",
        ),
    ],
    hole: Annotated[
        str,
        typer.Option(
            "--hole",
            metavar="MASK",
            help="Pixels to fill: an image of the photo's size, white there. Or `alpha`: the photo's "
            "transparent pixels.",
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="IMAGE",
            help=f"{IMAGES_WRITTEN}. A material's other maps go next to it: `x_normal.png`.",
        ),
    ],
    *,
    sample: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="SAMPLE", help="Fill from this image or material, not from the photo."
        ),
    ] = None,
    block: Annotated[
        int | None,
        typer.Option(
            help="Side of a block in pixels, 8 to 512. Default: chosen for photo and hole, up to 48."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same result.")] = 0,
    quiet: Quiet = False,
) -> None:
    """Fill holes in a photo or a material with the texture around them: outside nothing changes."""
    start = time.perf_counter()
    from upholster.covering.photos import fill_files

    source = photo[0] if len(photo) == 1 else photo
    with progress_bars(quiet, ["quilt flat texels"]) as progress:
        report = fill_files(source, hole, output, sample=sample, block=block, seed=seed, progress=progress)
    if not quiet:
        written = ", ".join(f"{name} ({in_bytes(count)})" for name, count in report.written.items())
        share = 100 * report.filled / (report.width * report.height)
        say(
            f"wrote {written}: {report.width}x{report.height} pixels of {report.bits} bits, {share:.2g} % of "
            f"them new, in {time.perf_counter() - start:.1f} s"
        )
        for note in report.notes:
            say(f"note: {note}")
