"""Make the gallery: ``python docs/make_gallery.py FOLDER_OF_EXEMPLARS [--only NAME]``.

Writes docs/gallery/*.jpg and docs/gallery/README.md. The folder holds images of any names; those that start
with a class of texture (regular_, near_regular_, irregular_, stochastic_) are used for that class. Needs
Pillow, which the extra "bench" brings.

``python docs/make_gallery.py paper OUT`` draws every figure of the paper from the project's own exemplars
alone, as OUT/figure_01.jpg and so on; one picture may be several figures: OUT/figure_07_08_09.jpg.
With ``--draft`` figure 11, which takes a minute and a half, has few texels, from small samples.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upholster.errors import InputError, UpholsterError, nearest

sys.path.append(str(Path(__file__).resolve().parent.parent))  # where benchmarks are

try:
    from gallery_tools import (
        baseline,
        diagrams,
        method,
        progressive,
        quilts,
        regular,
        relight,
        results,
        seams,
        studio,
        surfaces,
        viewers,
    )
    from gallery_tools.captions import HEAD, caption
    from gallery_tools.drawing import save_jpeg
    from gallery_tools.shots import OWN, Exemplars
except ModuleNotFoundError as error:
    if error.name != "PIL":
        raise
    sys.exit("make_gallery: Pillow is not installed; install the extra: pip install 'upholster[bench]'")

GALLERY = Path(__file__).resolve().parent / "gallery"
USAGE = "usage: python docs/make_gallery.py FOLDER_OF_EXEMPLARS [--only NAME], or: paper OUT [--draft]"
LAST_FIGURE = 13
"""Of the paper."""


@dataclass(frozen=True)
class Figure:
    """One picture of the gallery: its file's name without suffix, its heading, and what draws it.

    `lacking` tells what it needs that this machine has not; then it stays as it is. `numbers` are those of
    the paper's figures that it shows. `draft` draws it with few texels, where that spares much time.
    """

    name: str
    title: str
    draw: Callable[[Exemplars], Any]
    lacking: Callable[[], str] = str
    numbers: tuple[int, ...] = ()
    draft: Callable[[Exemplars], Any] | None = None


FIGURES = (
    Figure("hero", "Bricks on a ring", results.hero),
    Figure("chairs", "A model", results.chairs),
    Figure("cad", "CAD parts", results.cad, results.cad_lacking),
    Figure("players", "A rigged model in other programs", results.players, results.players_lacking),
    Figure("strip", "Three more samples", results.strip),
    Figure("beside", "The paper's method and ours", quilts.beside),
    Figure("everywhere", "One sample, every surface", quilts.everywhere),
    Figure("sizes", "True scale", quilts.sizes),
    Figure("directions", "Direction", quilts.directions),
    Figure("repeating", "Samples that repeat, before and after", regular.repeating),
    Figure("regular", "Six regular photographs, four surfaces", regular.regular),
    Figure("irregular", "Six other photographs, four surfaces", regular.irregular),
    Figure("flat", "Flat and tileable", quilts.flat),
    Figure("material", "A whole material", relight.material),
    Figure("studio", "The studio", studio.strip, viewers.lacking),
    Figure("refining", "A stream of a quilt", progressive.refining),
    Figure("viewer", "In the browser", viewers.viewer, viewers.lacking),
    Figure("viewer_arriving", "In the browser, as it arrives", viewers.arriving, viewers.lacking),
    Figure("viewer_light", "In the browser, a material", viewers.lights, viewers.lacking),
    Figure("surface", "The surface (figure 1)", surfaces.surface, numbers=(1,)),
    Figure("patches", "Patches and Bézier polygons (figure 2)", surfaces.patches, numbers=(2,)),
    Figure("overview", "All steps (figure 3)", diagrams.overview, numbers=(3,)),
    Figure("on_one_patch", "The steps on one patch (figure 4)", diagrams.on_one_patch, numbers=(4,)),
    Figure("decomposition", "Decomposition (figure 5)", method.decomposition, numbers=(5,)),
    Figure("matching", "Matching (figure 6)", method.matching, numbers=(6,)),
    Figure("seams", "Seams (figures 7, 8 and 9)", seams.seams, numbers=(7, 8, 9)),
    Figure("mapping", "Mapping (figure 10)", surfaces.mapping, numbers=(10,)),
    Figure(
        "baseline", "The paper's baseline (figure 11)", baseline.baseline, numbers=(11,), draft=baseline.draft
    ),
    Figure("twelve", "Twelve textures (figure 12)", results.twelve, numbers=(12,)),
    Figure("levels", "Progressive texture (figure 13)", progressive.levels, numbers=(13,)),
    Figure("curve", "What bytes buy", progressive.curve),
    Figure("stretch", "What a plain mapping does to scale", surfaces.stretch),
)


def readme(exemplars: Exemplars) -> str:
    """Return the gallery's README."""
    return HEAD + "".join(
        f"\n## {figure.title}\n\n![{figure.title}]({figure.name}.jpg)\n\n{caption(figure.name, exemplars)}"
        for figure in FIGURES
    )


def make(folder: Path, only: str | None) -> None:
    """Make all pictures, or one, and the README.

    Raises
    ------
    InputError
        If the folder holds no image, one cannot be read, or there is no such picture.
    """
    names = [figure.name for figure in FIGURES]
    if only is not None and only not in names:
        raise InputError(f"unknown picture {only!r}; {nearest(only, names)}")
    exemplars = Exemplars.of(folder)
    GALLERY.mkdir(exist_ok=True)
    wanted = [figure for figure in FIGURES if only in (None, figure.name)]
    begin = time.perf_counter()
    for count, figure in enumerate(wanted, 1):
        start = time.perf_counter()
        print(f"[{count}/{len(wanted)}] {figure.name} ...", end=" ", flush=True)
        if missing := figure.lacking():
            print(f"skipped: it needs {missing}", flush=True)
            continue
        size = save_jpeg(figure.draw(exemplars), GALLERY / f"{figure.name}.jpg")
        print(f"{size / 1000:.0f} kB, {time.perf_counter() - start:.1f} s", flush=True)
    (GALLERY / "README.md").write_text(readme(exemplars), encoding="utf-8")
    total = sum(
        (GALLERY / f"{name}.jpg").stat().st_size for name in names if (GALLERY / f"{name}.jpg").exists()
    )
    print(f"docs/gallery: {total / 1e6:.1f} MB of pictures, {time.perf_counter() - begin:.0f} s")


def make_paper(out: Path, *, draft: bool) -> None:
    """Draw every figure of the paper from the exemplars that the project ships.

    Raises
    ------
    InputError
        If there is a file in the folder's place.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{str(out)!r} is a file; allowed: a folder, or a new name")
    out.mkdir(parents=True, exist_ok=True)
    exemplars = Exemplars.of(OWN)
    for figure in FIGURES:
        if figure.numbers:
            name = "_".join(["figure", *(f"{number:02}" for number in figure.numbers)])
            start = time.perf_counter()
            draw = (figure.draft if draft else None) or figure.draw
            size = save_jpeg(draw(exemplars), out / f"{name}.jpg")
            print(f"{name}.jpg: {figure.title}, {size / 1000:.0f} kB, {time.perf_counter() - start:.1f} s")
    drawn = {number for figure in FIGURES for number in figure.numbers}
    if missing := sorted({*range(1, LAST_FIGURE + 1)} - drawn):
        print(f"not drawn: figure {', '.join(map(str, missing))}")


def main(arguments: list[str]) -> int:
    """Run the command; return its exit status."""
    try:
        match arguments:
            case ["-h"] | ["--help"]:
                print(f"{USAGE}\nNAME is one of: {', '.join(figure.name for figure in FIGURES)}")
            case ["paper", out] if not out.startswith("-"):
                make_paper(Path(out), draft=False)
            case ["paper", out, "--draft"] if not out.startswith("-"):
                make_paper(Path(out), draft=True)
            case [folder, "--only", name] | ["--only", name, folder]:
                make(Path(folder), name)
            case [folder] if not folder.startswith("-"):
                make(Path(folder), None)
            case _:
                raise InputError(USAGE)
    except (UpholsterError, OSError) as error:
        print(f"make_gallery: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
