"""The command line: ``upholster cover`` and ``upholster surfaces``.

Heavy imports wait until a command needs them: ``upholster --help`` answers at once.
"""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from upholster._version import __version__
from upholster.errors import InputError, UpholsterError

if TYPE_CHECKING:  # NumPy, which it imports, would slow down --help
    from upholster.types import Progress

__all__ = ["app", "main"]

app = typer.Typer(
    name="upholster",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

EXAMPLE = "Example: `upholster cover brick.png --on cyclide -o ring.glb -o ring.png`"


def main() -> NoReturn:
    """Run the command line; bad input is one line on stderr and exit status 2, Ctrl-C is 130."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        # Typer returns an exit code where it would have ended the process: 130 for Ctrl-C.
        status = app(standalone_mode=False) or 0
        if status == 130:
            _stop()
    except UpholsterError as error:
        status = _fail(str(error))
    except KeyboardInterrupt:
        status = _stop()
    except Exception as error:
        # Typer's usage errors and aborts: click's classes may be vendored, so they are known by what they
        # offer.
        if hasattr(error, "format_message"):
            status = _fail(error.format_message())
        elif type(error).__name__ == "Abort":
            status = _stop()
        elif hasattr(error, "exit_code"):
            status = error.exit_code
        elif isinstance(error, MemoryError):
            status = _fail("not enough memory; a smaller --chart, --size or exemplar needs less")
        else:
            raise
    sys.stdout.flush()
    sys.stderr.flush()
    # Kernels may still be running on other threads after Ctrl-C or an error: nobody waits for them.
    os._exit(status)


def _interrupt(_signal: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _fail(message: str) -> int:
    print("upholster: " + " ".join(message.split()), file=sys.stderr)
    return 2


def _stop() -> int:
    print("upholster: stopped, nothing written", file=sys.stderr)
    return 130


def _version(wanted: bool) -> None:
    if wanted:
        print(f"upholster {__version__}")
        raise typer.Exit


@app.callback(epilog=EXAMPLE)
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Cover curved surfaces with texture from a small sample image."""


@app.command()
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


@app.command(epilog=EXAMPLE)
def cover(
    exemplar: Annotated[
        str, typer.Argument(help="The sample: PNG, JPEG, WebP, TIFF or EXR.", metavar="EXEMPLAR")
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
            help="Several at once: .glb .obj (models), .npz (texels), .png .jpg .webp .exr (a picture of the "
            "model, or with `atlas:` before the name its texture).",
        ),
    ],
    chart: Annotated[
        int, typer.Option(help="Texels along each side of a patch.", rich_help_panel="Synthesis")
    ] = 512,
    seed: Annotated[int, typer.Option(help="Same seed, same result.", rich_help_panel="Synthesis")] = 0,
    method: Annotated[
        str, typer.Option(help="How texture is synthesised.", rich_help_panel="Synthesis")
    ] = "paper",
    block: Annotated[int, typer.Option(help="Side of a block, in texels.", rich_help_panel="Synthesis")] = 32,
    overlap: Annotated[
        int, typer.Option(help="Overlap of blocks, in texels.", rich_help_panel="Synthesis")
    ] = 8,
    levels: Annotated[
        int, typer.Option(help="Levels of the Haar transform.", rich_help_panel="Synthesis")
    ] = 3,
    seams: Annotated[
        bool,
        typer.Option(
            "--seams/--no-seams", help="Mend the seams between patches.", rich_help_panel="Synthesis"
        ),
    ] = True,
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
    size: Annotated[
        str, typer.Option(metavar="WxH", help="Of a picture.", rich_help_panel="Output")
    ] = "1024x768",
    view: Annotated[
        str, typer.Option(metavar="AZ,EL", help="Azimuth and elevation in degrees.", rich_help_panel="Output")
    ] = "30,30",
    supersample: Annotated[int, typer.Option(help="Rays per pixel each way.", rich_help_panel="Output")] = 2,
    report: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write parameters, counts and times as JSON.")
    ] = None,
    threads: Annotated[int | None, typer.Option(help="1 to 256; default: one per core.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Cover a surface with texture from an exemplar, and write models and pictures."""
    start = time.perf_counter()
    from upholster.outputs import WriteOptions
    from upholster.pipeline import cover as run

    options = WriteOptions(
        quads=quads,
        texture=texture,  # type: ignore[arg-type]  # checked by WriteOptions
        quality=quality,
        size=_numbers("size", size, "x", 2, int),
        view=_numbers("view", view, ",", 2, float),
        supersample=supersample,
    )
    with _progress(quiet) as progress:
        result = run(
            exemplar,
            on,
            output,
            crop=None if crop is None else _numbers("crop", crop, ",", 4, int),
            resize=resize,
            synthesis={
                "method": method,
                "chart": chart,
                "block": block,
                "overlap": overlap,
                "levels": levels,
                "seams": seams,
                "seed": seed,
            },
            options=options,
            report=report,
            threads=threads,
            progress=progress,
        )
    if not quiet:
        written = ", ".join(f"{name} ({_bytes(count)})" for name, count in result.written.items())
        texels = result.counts["texels"]
        print(f"wrote {written}: {texels:,} texels in {time.perf_counter() - start:.1f} s")


def _numbers(name: str, text: str, separator: str, count: int, kind: Callable[[str], Any]) -> Any:
    parts = text.lower().split(separator)
    try:
        numbers = tuple(kind(part) for part in parts)
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        form = separator.join(["N"] * count)
        raise InputError(f"{name} is {text!r}; allowed: {count} numbers as {form}")
    return numbers


def _bytes(count: int) -> str:
    power = min(3, (len(str(count)) - 1) // 3)
    number = count / 1000**power
    return (
        f"{number:.1f} {('bytes', 'kB', 'MB', 'GB')[power]}"
        if power and number < 100
        else (f"{number:.0f} {('bytes', 'kB', 'MB', 'GB')[power]}")
    )


@contextmanager
def _progress(quiet: bool) -> "Iterator[Progress | None]":
    """Show one bar per stage on stderr, and say once when kernels have to be compiled."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    from upholster.jit import on_first_compilation

    if quiet:
        yield None
        return
    console = Console(stderr=True)
    on_first_compilation(
        lambda: console.print("compiling kernels for this machine, once: 10 to 20 seconds", style="dim")
    )
    columns = (TextColumn("{task.description:>7}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bars(*columns, console=console, disable=not console.is_terminal, transient=True) as bars:
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield report
