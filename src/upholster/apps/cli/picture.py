"""``upholster picture``: a GLB drawn again, without synthesis."""

from pathlib import Path
from typing import Annotated, Any

import typer

from upholster.apps.cli.console import Quiet, Threads, check_suffix, numbers, progress_bars, say, view_angles
from upholster.base.display import in_bytes
from upholster.base.formats import PICTURES

__all__ = ["picture"]


def picture(
    model: Annotated[str, typer.Argument(help="A model: .glb, .gltf.", metavar="MODEL")],
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FILE", help=f"The picture: {' '.join(PICTURES)}.")
    ],
    view: Annotated[
        str,
        typer.Option(
            metavar="AZ,EL|sheet",
            help="Azimuth and elevation in degrees; `sheet`: four sides in one picture.",
        ),
    ] = "30,30",
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the picture in pixels.")] = "1024x768",
    supersample: Annotated[int, typer.Option(help="Samples per pixel each way, 1 to 8.")] = 2,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Draw a model with its own textures, from one side or from four."""
    import numpy as np

    from upholster.base.files import outputs
    from upholster.image.color import from_linear
    from upholster.image.files.write import write_image
    from upholster.output.glb_picture import SHEET, redrawn
    from upholster.runtime.parallel import running

    check_suffix("output", output, PICTURES)
    width, height = numbers("size", size, "x", 2, int)
    is_sheet = view == "sheet"
    views = SHEET if is_sheet else (view_angles(view),)
    each = (width // 2, height // 2) if is_sheet else (width, height)
    notes: list[str] = []
    how: dict[str, Any] = {"size": each, "supersample": supersample, "notes": notes}
    with (
        progress_bars(quiet, ["picture"]) as progress,
        running(threads, progress),
        outputs([output], inputs=[model]) as files,
    ):
        found = redrawn(model, views, **how)
        linear = np.vstack([np.hstack(found[:2]), np.hstack(found[2:])]) if is_sheet else found[0]
        is_linear = Path(output).suffix.lower() == ".exr"
        write_image(files.path(output), linear if is_linear else from_linear(linear, "uint8", dither=True))
    if not quiet:
        for note in notes:
            say(f"note: {note}")
        say(f"wrote {output} ({in_bytes(Path(output).stat().st_size)})")
