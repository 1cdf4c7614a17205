"""Make the pictures of the documentation: ``python docs/make_gallery.py FOLDER [--only NAME]``.

docs/pictures.toml lists them, each with the commands that make it; they become docs/gallery/NAME.jpg, or
docs/guides/NAME.jpg. The folder holds photographs; those whose names begin with a class of texture (regular_,
near_regular_, irregular_, stochastic_) are used for that class. Needs Pillow, which the extra "bench" brings.

``python docs/make_gallery.py paper OUT`` draws every figure of the paper from the project's own exemplars
alone, as OUT/figure_01.jpg and so on; one picture may be several figures: OUT/figure_07_08_09.jpg.
With ``--draft`` figure 11, which takes a minute and a half, has few texels, from small samples.
"""

import contextlib
import importlib
import re
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

from upholster.apps.cli import run_words
from upholster.base.errors import InputError, UpholsterError, nearest
from upholster.image.files.write import write_image

DOCS = Path(__file__).resolve().parent
sys.path.append(str(DOCS.parent))  # where benchmarks are

try:
    from benchmarks.lattice_samples import lattice_sample
    from benchmarks.nets import bent_vase, write_nets
    from gallery_tools.drawing import MOST_BYTES, Panel, compose, save_jpeg
    from gallery_tools.shots import OWN, Exemplars
    from gallery_tools.viewers import lacking
    from PIL import Image, ImageChops
except ModuleNotFoundError as error:
    if error.name != "PIL":
        raise
    sys.exit("make_gallery: Pillow is not installed; install the extra: pip install 'upholster[bench]'")

PICTURES: dict[str, dict[str, Any]] = tomllib.loads((DOCS / "pictures.toml").read_text(encoding="utf-8"))
USAGE = "usage: python docs/make_gallery.py FOLDER [--only NAME], or: paper OUT [--draft]"
MOST_BYTES_OF_GUIDES = 245_000
LAST_FIGURE = 13
"""Of the paper."""


def draw(name: str, exemplars: Exemplars, *, draft: bool = False) -> Any:
    """Return a picture.

    Raises
    ------
    InputError
        If it can not be made here, or as the command raises it.
    """
    about = PICTURES[name]
    if "made" in about:
        raise InputError(f"an earlier revision's script {about['made']} made it; it stays as it is")
    drawn = about.get("draft" if draft else "draw", about.get("draw"))
    if drawn is not None:
        module, _, function = drawn.partition(".")
        if module in ("viewers", "studio") and (missing := lacking()):
            raise InputError(f"it needs {missing}")
        return getattr(importlib.import_module(f"gallery_tools.{module}"), function)(exemplars)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        sources = (DOCS, OWN, *OWN.iterdir(), *exemplars.paths, *exemplars.folder.iterdir())
        for source in sources:
            if not (folder / source.name).exists():
                (folder / source.name).symlink_to(source.resolve())
        for pattern in about.get("generated", ()):
            write_image(folder / f"{pattern}.png", lattice_sample(pattern).image)
        write_nets(folder / "net.json", bent_vase())
        for command in [*map(shlex.split, about.get("before", ())), *_page_commands(name)]:
            _run(command, folder)
        if "rows" not in about:
            return Image.open(folder / f"{Path(name).name}.png").convert("RGB")
        rows = [
            [_panel(about, [word, *panel], letter, exemplars, folder) for panel in row]
            for letter, word in zip("abcdefghijkl", about.get("each", [""]), strict=False)
            for row in about["rows"]
        ]
        return compose(rows, gap=about.get("gap", 22))


def _page_commands(name: str) -> list[list[str]]:
    """Return the commands that are below a picture on its page."""
    if "page" not in PICTURES[name]:
        return []
    page = (DOCS / PICTURES[name]["page"]).read_text(encoding="utf-8")
    found = re.search(rf"\({re.escape(name)}\.jpg\)\n\n```console\n(.*?)```", page, re.DOTALL)
    assert found, name
    lines = found[1].replace("\\\n", " ").splitlines()
    return [shlex.split(line.removeprefix("$ ").removeprefix("upholster ")) for line in lines]


def _panel(about: dict[str, Any], panel: list[Any], letter: str, exemplars: Exemplars, folder: Path) -> Panel:
    word, title, shown, wide, tile = [*panel, 0, 0][:5]
    title, shown = (text.replace("{word}", word).replace("{letter}", letter) for text in (title, shown))
    shown = re.sub(r"<(\w+)>", lambda found: exemplars.pick(found[1]).name, shown)
    words = shlex.split(shown)
    if words[0] in ("cover", "levels", "refine"):
        options = shlex.split(about.get("options", "")) if words[0] != "levels" else []
        _run([*words, *options, "-o", "panel.png"], folder)
        words = ["panel.png"]
    images = [Image.open(folder / file).convert("RGB") for file in words]
    image = images[0] if len(images) == 1 else _differing(*images)
    if tile:
        large = Image.new("RGB", (tile * image.width, tile * image.height))
        for n in range(tile * tile):
            large.paste(image, (n % tile * image.width, n // tile * image.height))
        image = large
    if "part" in about:
        sides = 2 * image.size
        image = image.crop([round(share * side) for share, side in zip(about["part"], sides, strict=True)])
    if "cut" in about:
        image = image.crop((0, 0, *about["cut"]))
    if wide:
        image = image.resize((wide, round(image.height * wide / image.width)), Image.Resampling.LANCZOS)
    return Panel(image, title)


def _differing(before: Any, after: Any) -> Any:
    """Return the second picture, white where it is as the first."""
    channels = ImageChops.difference(before, after).split()
    most = ImageChops.lighter(ImageChops.lighter(*channels[:2]), channels[2])
    white = Image.new("RGB", after.size, "white")
    return Image.composite(after, white, most.point(lambda value: 255 * (value > 3)))


def _run(words: list[str], folder: Path) -> None:
    if words[0] == "python":
        subprocess.run([sys.executable, *words[1:]], cwd=folder, check=True)
        return
    with contextlib.chdir(folder):
        run_words([*words, "-q"])


def make(folder: Path, only: str | None) -> int:
    """Make all pictures, or one; return 2 if one is not made.

    Raises
    ------
    InputError
        If the folder holds no image, one cannot be read, or there is no such picture.
    """
    if only is not None and only not in PICTURES:
        raise InputError(f"unknown picture {only!r}; {nearest(only, PICTURES)}")
    exemplars, status = Exemplars.of(folder), 0
    wanted = [name for name in PICTURES if only in (None, name)]
    for count, name in enumerate(wanted, 1):
        start = time.perf_counter()
        print(f"[{count}/{len(wanted)}] {name} ...", end=" ", flush=True)
        target = DOCS / (f"{name}.jpg" if "/" in name else f"gallery/{name}.jpg")
        most = MOST_BYTES_OF_GUIDES if "/" in name else MOST_BYTES
        try:
            size = save_jpeg(draw(name, exemplars), target, most=most)
            print(f"{size / 1000:.0f} kB, {time.perf_counter() - start:.1f} s", flush=True)
        except UpholsterError as error:
            print(f"skipped: {error}", flush=True)
            status = 2
    return status


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
    drawn: set[int] = set()
    for name, about in PICTURES.items():
        if numbers := about.get("figures"):
            file = "_".join(["figure", *(f"{number:02}" for number in numbers)])
            start = time.perf_counter()
            size = save_jpeg(draw(name, exemplars, draft=draft), out / f"{file}.jpg")
            print(f"{file}.jpg: {name}, {size / 1000:.0f} kB, {time.perf_counter() - start:.1f} s")
            drawn |= set(numbers)
    if missing := sorted({*range(1, LAST_FIGURE + 1)} - drawn):
        print(f"not drawn: figure {', '.join(map(str, missing))}")


def main(arguments: list[str]) -> int:
    """Run the command; return its exit status."""
    try:
        match arguments:
            case ["-h"] | ["--help"]:
                print(f"{USAGE}\nNAME is one of: {', '.join(PICTURES)}")
            case ["paper", out] | ["paper", out, "--draft"] if not out.startswith("-"):
                make_paper(Path(out), draft=len(arguments) > 2)
            case [folder, "--only", name] | ["--only", name, folder]:
                return make(Path(folder), name)
            case [folder] if not folder.startswith("-"):
                return make(Path(folder), None)
            case _:
                raise InputError(USAGE)
    except (UpholsterError, OSError) as error:
        print(f"make_gallery: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
