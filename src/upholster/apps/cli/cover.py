"""``upholster cover`` and ``upholster surfaces``."""

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upholster.apps.cli.command_options import by_name, spelled_out
from upholster.apps.cli.console import Quiet, Threads, compiled, new_console, progress_bars, say
from upholster.base.display import in_bytes, number_of, texels_in_words
from upholster.base.errors import InputError
from upholster.base.examples import INCLUDED_PREFIX, included_models, included_samples
from upholster.base.formats import (
    IMAGES_READ,
    MESH_SUFFIXES,
    is_model_name,
    kind_of,
    outputs_in_words,
    split_name,
)
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.option_fields import differing
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

    from upholster.apps.project.project import Project
    from upholster.output.reports import CoverReport

__all__ = ["cover", "requested_project", "surfaces", "uses_of"]

EXAMPLE = "Example: `upholster cover sample:bricks --on cyclide -o ring.glb -o ring.png`"


def surfaces() -> None:
    """List the built-in surfaces with their parameters and defaults, and the included samples and models."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from upholster.geometry.built_in.catalog import SURFACES

    table = Table("surface", "parameter", "meaning", "allowed", title_justify="left", box=SIMPLE_HEAD)
    table.title = "--on NAME  or  --on NAME:parameter=value,parameter=value"
    for kind in SURFACES.values():
        patches = number_of(kind.patches, "patch", "patches")
        table.add_row(f"[bold]{kind.name}[/]", "", f"[italic]{kind.description}; {patches}[/]", "")
        for p in kind.parameters:
            table.add_row("", f"{p.name}={p.written}", p.meaning, p.allowed)
    table.add_row(
        "[bold]FILE.json[/]", "", "[italic]your own control nets with weights, of any degree[/]", ""
    )
    table.add_row("[bold]FILE.glb[/]", "", f"[italic]a model: {' '.join(MESH_SUFFIXES)}[/]", "")
    table.add_row("[bold]FILE.step[/]", "", "[italic]a CAD model: .step .iges .brep .3dm[/]", "")
    table.add_row("[bold]FILE.bpt[/]", "", "[italic]the classic list of bi-cubic patches (teapot)[/]", "")
    new_console().print(table)
    for what, names in (("samples", included_samples()), ("models", included_models())):
        say(f"included {what}: {', '.join(INCLUDED_PREFIX + name for name in names)}")


_DRAFT = 200_000
"""Texels of a draft."""

_LARGE = 5_000_000
"""Size of a GLB in bytes above which advice on smaller files is printed."""

_Material = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PART=SAMPLE",
        help="Use another sample on parts of a model: `Seat=leather/`, `'Leg*=oak.jpg@30cm'` with its "
        "width; repeatable. The first name that fits a part counts. `*` means all other parts.",
        rich_help_panel="Model",
    ),
]


def _project(context: typer.Context, name: str | None) -> str | None:
    if name is not None:
        context.default_map = {**(context.default_map or {}), "on": ""}  # the project names the model
    return name


_Draft = Annotated[bool, typer.Option("--draft", help="Quick and coarse: `--texels 200k`.")]

_Project = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        is_eager=True,
        callback=_project,
        help="Use the model, samples and settings of a project, `chair.upholster.json`; other options given "
        "here override it.",
        rich_help_panel="Project",
    ),
]

_Allow = Annotated[
    list[str] | None,
    typer.Option(
        metavar="DIR",
        help="The project may read files in this folder, in addition to its own; repeatable.",
        rich_help_panel="Project",
    ),
]

_SaveProject = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="Save all settings as a project, and copy the files that it needs into its folder.",
        rich_help_panel="Project",
    ),
]


@spelled_out()
def cover(
    sample: Annotated[
        list[str] | None,
        typer.Argument(
            help=f"The sample: an image ({IMAGES_READ}); or a material's maps, as a "
            "folder, a zip file or files named by role, `brick_albedo.png brick_normal.png` …; or an "
            "included one, `sample:bricks` (see `surfaces`). With "
            "--material it covers the other parts, and may be left out.",
            metavar="SAMPLE",
        ),
    ] = None,
    *,
    on: Annotated[
        str,
        typer.Option(
            "--on",
            metavar="SURFACE",
            help="A model (GLB, glTF, OBJ, PLY, STL, OFF, 3MF); or `cyclide`, `torus:R=2,r=0.7`, "
            "`nets.json`, `teapot.bpt`, `sample:chair` … (see `surfaces`).",
        ),
    ],
    output: Annotated[
        list[str],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"Repeatable: {outputs_in_words()}. A material's other maps are written next to textures: "
            "`x_normal.png`. A texture above 8192x8192 becomes several files: `x_1.png`, or, "
            "with `<UDIM>` in its name, UDIM tiles.",
        ),
    ],
    material: _Material = None,
    model: ModelOptions,
    draft: _Draft = False,
    synthesis: SynthesisOptions,
    seed: Annotated[
        int | None, typer.Option(help="Same seed, same result; default: 0.", rich_help_panel="Synthesis")
    ] = None,
    preparing: SampleOptions,
    writing: WriteOptions,
    project: _Project = None,
    allow: _Allow = None,
    save_project: _SaveProject = None,
    report: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write parameters, counts and times as JSON.")
    ] = None,
    threads: Threads = None,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Distribute blocks over this many processes of this machine, 1 to 256: docs/scaling.md."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Use a running Dask cluster instead: tcp://host:8786."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Cover a surface with texture from a sample or a material, and write models and pictures."""
    start = time.perf_counter()
    from upholster.apps.project.file import save_project as save

    asked = requested_project(
        {
            **{"project": project, "allow": allow, "sample": sample, "on": on, "material": material},
            **{"preparing": preparing, "model": model, "synthesis": synthesis, "writing": writing},
            "seed": seed,
        }
    )
    if draft:
        asked = _drafted(asked, synthesis)
    uses = uses_of(asked, output)
    if workers is not None or scheduler is not None:
        compiled(uses if scheduler is None else (), quiet)
        uses = []
    if save_project is not None:
        copied = save(asked, save_project)
        if not quiet:
            copies = f", and {number_of(len(copied), 'file')} in its folder" if copied else ""
            say(f"wrote {save_project}{copies}")
    with progress_bars(quiet, uses) as progress:
        result = asked.cover(
            output,
            report=report,
            threads=threads,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
            tell=None if quiet else lambda note: say(f"note: {note}", error=True),
        )
    if not quiet:
        _say_result(result, time.perf_counter() - start, several=bool(asked.materials))


def requested_project(given: "Mapping[str, Any]") -> "Project":
    """Return the project that `cover`'s parameters describe: a given file's, changed by other options."""
    from upholster.apps.project.file import read_project
    from upholster.apps.project.project import Project
    from upholster.covering.sample_arguments import read_materials, read_sample
    from upholster.image.files.source import Sample

    sample, seed, allow = given["sample"], given["seed"], given["allow"]
    materials = by_name("material", "part=sample, as Seat=leather.jpg", given["material"] or [])
    if given["project"] is not None:
        found = read_project(given["project"], allow=allow or ())
        named = {"model": given["on"] or None, "sample": sample and Sample(sample), "seed": seed}
        changes: dict[str, Any] = {name: value for name, value in named.items() if value is not None}
        if materials:
            changes["materials"] = {**found.materials, **read_materials(materials)}
        for kind in ("preparing", "model", "synthesis", "writing"):
            changes |= differing(given[kind])
        return found.change(**changes)
    if allow:
        raise InputError("allow is for files that a project names; allowed: with --project")
    return Project(
        given["on"],
        read_sample(sample[0] if sample and len(sample) == 1 else sample or None, given["preparing"]),
        read_materials(materials),
        reading=given["model"],
        synthesis=given["synthesis"],
        writing=given["writing"],
        seed=seed or 0,
    )


def _drafted(asked: "Project", written: SynthesisOptions) -> "Project":
    """Return a project at few texels, unless a number or a density was written on the command line."""
    method = asked.synthesis.method
    if method != "quilt":
        raise InputError(f"draft is given with method {method!r}; allowed: with 'quilt', or a small --chart")
    if written.texels is not None or written.density is not None:
        return asked
    return asked.change(texels=_DRAFT, density=None)


def _say_result(result: "CoverReport", seconds: float, *, several: bool) -> None:
    """Print the files written, and the values of open settings."""
    written = ", ".join(f"{name} ({in_bytes(count)})" for name, count in result.written.items())
    count, page = result.counts["texels"], result.counts.get("page texels")
    texels = texels_in_words(count, result.counts["painted texels"])
    if page:
        texels += f", {100 * count / page:.0f} % of {number_of(result.counts['pages'], 'page')}"
    say(f"wrote {written}: {texels} in {seconds:.1f} s")
    if any(name.lower().endswith(".glb") and size > _LARGE for name, size in result.written.items()):
        say("smaller: --texture webp, fewer --texels, a lower --quality; smallest: a stream, -o x.uph")
    if result.settled:
        after = ":" if several else ""
        settled = [f"{name}{after} {value}" for name, value in result.settled.items()]
        for line in settled if several else ["; ".join(settled)]:
            say(line)


def uses_of(project: "Project", outputs: list[str]) -> list[str]:
    """Return the uses of kernels, judged by names only; wrong names are reported elsewhere."""
    from upholster.charts.surface_to_cover import covered_files
    from upholster.image.files.packages import is_zip

    asked, reading = project.synthesis, project.sample.options if project.sample else None
    flat = asked.method == "quilt" and isinstance(asked.texels, tuple)
    material = any(
        each.folders
        or len(each.files) > (1 if each.options.mask is None else 2)
        or any(is_zip(name) for name in each.files)
        for each in project.samples
    )
    mesh = any(map(is_model_name, covered_files(project.model)))
    made = asked.method + (" flat" if flat else " mesh" * mesh + " material" * material)
    kinds = [kind for name in outputs if (kind := kind_of(*split_name(name)))]
    uses = ["displaced"] if any(kind.solid for kind in kinds) else []
    uses += [f"{made} {kind.kernels}" for kind in kinds]
    if asked.guide or asked.labels or asked.zone or asked.again or asked.put:
        uses = ["guides", *uses]
    return ["prepare", *uses] if reading and reading.rectify else uses
