"""``upholster prepare``: making a sample from a photo."""

from typing import Annotated

import typer

from upholster.apps.cli.command_options import spelled_out
from upholster.apps.cli.console import Quiet, progress_bars, say
from upholster.base.display import in_bytes
from upholster.base.formats import IMAGES_READ, IMAGES_WRITTEN
from upholster.base.options.sample_options import SampleOptions

__all__ = ["prepare"]


@spelled_out(without=["Maps"])
def prepare(
    photo: Annotated[
        str,
        typer.Argument(help=f"{IMAGES_READ}; or `sample:bricks`.", metavar="PHOTO"),
    ],
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="IMAGE", help=f"The sample: {IMAGES_WRITTEN}.")
    ],
    *,
    preparing: SampleOptions,
    picture: Annotated[
        str | None, typer.Option(metavar="IMAGE", help="Write photo and sample side by side, to compare.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Make a sample from a photo: rectified, cropped, resized, evenly lit, in sRGB."""
    from upholster.covering.photos import prepare_sample

    with progress_bars(quiet, ["prepare" if preparing.rectify else "hints"]):
        report = prepare_sample(photo, output, preparing, picture=picture)
    if not quiet:
        written = ", ".join(f"{name} ({in_bytes(count)})" for name, count in report.written.items())
        say(f"wrote {written}: {report.width}x{report.height} pixels of {report.bits} bits")
        for note in report.notes:
            say(f"note: {note}")
