"""``upholster cover`` and ``upholster surfaces``."""

import time
from typing import Annotated

import typer

from upholster.cli.console import byte_count, in_bytes, numbers, progress_bars, texel_count

__all__ = ["cover", "surfaces"]

EXAMPLE = "Example: `upholster cover brick.png --on cyclide -o ring.glb -o ring.png`"


def surfaces() -> None:
    """List the built-in surfaces with their parameters and defaults."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    from upholster.geometry import SURFACES

    table = Table("surface", "parameter", "meaning", "allowed", title_justify="left", box=SIMPLE_HEAD)
    table.title = "--on NAME  or  --on NAME:parameter=value,parameter=value"
    for kind in SURFACES.values():
        table.add_row(
            f"[bold]{kind.name}[/]", "", f"[italic]{kind.description}; {kind.patches} patches[/]", ""
        )
        for p in kind.parameters:
            table.add_row("", f"{p.name}={p.written}", p.meaning, p.allowed)
    table.add_row(
        "[bold]FILE.json[/]", "", "[italic]your own control nets with weights, of any degree[/]", ""
    )
    table.add_row("[bold]FILE.bpt[/]", "", "[italic]the classic list of bi-cubic patches (teapot)[/]", "")
    Console().print(table)


def cover(
    exemplar: Annotated[
        list[str],
        typer.Argument(
            help="The sample: an image (PNG, JPEG, WebP, TIFF, EXR); or a material's maps, as a folder or as "
            "files named by role, `brick_albedo.png brick_normal.png` …",
            metavar="EXEMPLAR",
        ),
    ],
    on: Annotated[
        str,
        typer.Option(
            "--on",
            metavar="SURFACE",
            help="`cyclide`, `torus:R=2,r=0.7`, `nets.json`, `teapot.bpt` … (see `surfaces`).",
        ),
    ],
    output: Annotated[
        list[str],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Several at once: .glb .obj (models), .uph (progressive stream), .html (stream and viewer "
            "in one file), .npz (texels), .png .jpg .webp .exr (a picture of the model; with `atlas:` before "
            "the name its texture; with `--texels WxH` the flat texture). A material's other maps lie beside "
            "textures: `x_normal.png`.",
        ),
    ],
    texels: Annotated[
        str | None,
        typer.Option(
            metavar="N|WxH",
            help="How many in all, `4M`; or, on a plane, the size of a flat texture, `512x512`.",
            rich_help_panel="Scale and direction",
        ),
    ] = None,
    density: Annotated[
        float | None, typer.Option(help="Texels per model unit.", rich_help_panel="Scale and direction")
    ] = None,
    sample_size: Annotated[
        float | None,
        typer.Option(help="Width of the exemplar in model units.", rich_help_panel="Scale and direction"),
    ] = None,
    direction: Annotated[
        str | None,
        typer.Option(
            metavar="u|v|DEG|X,Y,Z|around:AXIS",
            help="Which way the exemplar's rows run: along the patches, at an angle to that, along a vector, "
            "or round an axis.",
            rich_help_panel="Scale and direction",
        ),
    ] = None,
    tileable: Annotated[
        bool,
        typer.Option(
            "--tileable", help="A flat texture wraps both ways.", rich_help_panel="Scale and direction"
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="Same seed, same result.", rich_help_panel="Synthesis")] = 0,
    method: Annotated[
        str,
        typer.Option(
            help="quilt: one texture over the whole surface; paper: the paper's.", rich_help_panel="Synthesis"
        ),
    ] = "quilt",
    block: Annotated[
        int | None,
        typer.Option(help="Side of a block, in exemplar pixels.", rich_help_panel="Synthesis"),
    ] = None,
    overlap: Annotated[
        int | None, typer.Option(help="Overlap of blocks, likewise.", rich_help_panel="Synthesis")
    ] = None,
    evenness: Annotated[
        float | None,
        typer.Option(help="How evenly the exemplar is used, from 0.", rich_help_panel="Synthesis"),
    ] = None,
    variety: Annotated[
        float | None,
        typer.Option(help="How much repeats within sight are avoided, from 0.", rich_help_panel="Synthesis"),
    ] = None,
    chart: Annotated[
        int | None, typer.Option(help="Texels along each side of a patch.", rich_help_panel="Method paper")
    ] = None,
    levels: Annotated[
        int | None, typer.Option(help="Levels of the Haar transform.", rich_help_panel="Method paper")
    ] = None,
    seams: Annotated[
        bool | None,
        typer.Option(
            "--seams/--no-seams", help="Mend the seams between patches.", rich_help_panel="Method paper"
        ),
    ] = None,
    crop: Annotated[
        str | None,
        typer.Option(metavar="X,Y,W,H", help="Use this part, in pixels.", rich_help_panel="Exemplar"),
    ] = None,
    resize: Annotated[
        str | None,
        typer.Option(
            metavar="N|WxH", help="Resize to this longer side, or size.", rich_help_panel="Exemplar"
        ),
    ] = None,
    quads: Annotated[int, typer.Option(help="Quadrilaterals of the mesh.", rich_help_panel="Output")] = 20000,
    texture: Annotated[
        str, typer.Option(help="Texture inside a GLB: png, jpeg or webp.", rich_help_panel="Output")
    ] = "png",
    quality: Annotated[int, typer.Option(help="Of JPEG and WebP, 1 to 100.", rich_help_panel="Output")] = 90,
    normal_scale: Annotated[
        float, typer.Option(help="Strength of a normal map in a GLB.", rich_help_panel="Output")
    ] = 1.0,
    size: Annotated[
        str, typer.Option(metavar="WxH", help="Of a picture.", rich_help_panel="Output")
    ] = "1024x768",
    view: Annotated[
        str, typer.Option(metavar="AZ,EL", help="Azimuth and elevation in degrees.", rich_help_panel="Output")
    ] = "30,30",
    supersample: Annotated[int, typer.Option(help="Rays per pixel each way.", rich_help_panel="Output")] = 2,
    wavelet: Annotated[
        str | None, typer.Option(help="9/7 (default), 5/3 or haar.", rich_help_panel="Stream")
    ] = None,
    lossless: Annotated[
        bool, typer.Option("--lossless", help="Keep the exemplar exactly.", rich_help_panel="Stream")
    ] = False,
    threshold: Annotated[
        float, typer.Option(help="Leave out smaller coefficients (equation 7).", rich_help_panel="Stream")
    ] = 0.0,
    stream_bytes: Annotated[
        str | None, typer.Option("--bytes", metavar="N", help="Length at most: 8k.", rich_help_panel="Stream")
    ] = None,
    report: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write parameters, counts and times as JSON.")
    ] = None,
    threads: Annotated[int | None, typer.Option(help="1 to 256; default: one per core.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Cover a surface with texture from an exemplar or a material, and write models and pictures."""
    start = time.perf_counter()
    from upholster.outputs import WriteOptions
    from upholster.pipeline import cover as run

    options = WriteOptions(
        quads=quads,
        texture=texture,  # type: ignore[arg-type]  # checked by WriteOptions
        quality=quality,
        normal_scale=normal_scale,
        size=numbers("size", size, "x", 2, int),
        view=numbers("view", view, ",", 2, float),
        supersample=supersample,
        wavelet=wavelet,
        # The paper's own transform has three levels.
        levels=(3 if levels is None else levels) if wavelet == "haar" else None,
        lossless=lossless,
        threshold=threshold,
        stream_bytes=byte_count("bytes", stream_bytes),
    )
    with progress_bars(quiet) as progress:
        result = run(
            exemplar,
            on,
            output,
            crop=None if crop is None else numbers("crop", crop, ",", 4, int),
            resize=resize,
            synthesis={
                "method": method,
                "texels": texel_count(texels),
                "density": density,
                "sample_size": sample_size,
                "direction": direction,
                "tileable": True if tileable else None,
                "block": block,
                "overlap": overlap,
                "evenness": evenness,
                "variety": variety,
                "chart": chart,
                # With method "quilt" they can only be those of a stream's Haar transform.
                "levels": None if method == "quilt" and wavelet == "haar" else levels,
                "seams": seams,
            },
            seed=seed,
            options=options,
            report=report,
            threads=threads,
            progress=progress,
        )
    if not quiet:
        written = ", ".join(f"{name} ({in_bytes(count)})" for name, count in result.written.items())
        count = result.counts["texels"]
        print(f"wrote {written}: {count:,} texels in {time.perf_counter() - start:.1f} s")
        if result.settled:
            print("; ".join(f"{name} {value}" for name, value in result.settled.items()))
        for note in result.notes:
            print(f"note: {note}")
