"""Make the pictures of docs/guides.md: ``python docs/make_guides.py FOLDER [--only NAME]``.

FOLDER holds the photographs and the teapot that the page names. The page's own commands are run, in a folder
that has all of these. Before, house, sign and painted map are drawn anew. Needs Pillow, which the extra
"bench" brings.
"""

import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from upholster.errors import InputError, UpholsterError, nearest

try:
    from gallery_tools.drawing import Panel, compose, save_jpeg
    from gallery_tools.guide_inputs import draw_inputs
    from PIL import Image, ImageChops
except ModuleNotFoundError as error:
    if error.name != "PIL":
        raise
    sys.exit("make_guides: Pillow is not installed; install the extra: pip install 'upholster[bench]'")

DOCS = Path(__file__).resolve().parent
USAGE = "usage: python docs/make_guides.py FOLDER [--only NAME]"
MOST_BYTES = 245_000

Shown = tuple[str, str, int]
"""Of a panel the files, what stands below, and its width in pixels. Of two files what differs is shown."""

PANELS: dict[str, tuple[tuple[Shown, ...], ...]] = {
    "numbers": (
        (
            ("steel.png", "sample", 240),
            ("labels.png", "its labels", 240),
            ("docs/guides/numbers.png", "painted", 480),
        ),
        (("numbers.png", "by numbers", 988),),
    ),
    "house": ((("north.png", "from the north-east", 620), ("south.png", "from the south-east", 620)),),
    "again": (
        (
            ("before.png", "before", 520),
            ("after.png", "after", 520),
            ("before.png after.png", "what changed", 520),
        ),
    ),
}
"""Rows of pictures that show several files."""

CROPPED = {"house": (0.16, 0.02, 0.88, 0.97), "again": (0.15, 0.02, 0.92, 0.98)}
"""Which part of each of their files is shown: left, top, right and bottom, as parts of width and height."""


def commands(page: str) -> dict[str, list[list[str]]]:
    """Return the page's commands by the picture that stands before them."""
    found: dict[str, list[list[str]]] = {}
    for name, block in re.findall(r"\(guides/(\w+)\.jpg\)\n\n```console\n(.*?)```", page, re.DOTALL):
        lines = block.replace("\\\n", " ").splitlines()
        found[name] = [shlex.split(line.removeprefix("$ ")) for line in lines]
    return found


def make(folder: Path, only: str | None) -> None:
    """Make all pictures, or one.

    Raises
    ------
    InputError
        If the folder or a picture is not there, or a command fails.
    """
    if not folder.is_dir():
        raise InputError(f"folder {str(folder)!r} does not exist; allowed: a folder of photographs")
    asked = commands((DOCS / "guides.md").read_text(encoding="utf-8"))
    if only is not None and only not in asked:
        raise InputError(f"unknown picture {only!r}; {nearest(only, asked)}")
    draw_inputs(DOCS / "guides")
    with tempfile.TemporaryDirectory() as made:
        for source in (DOCS, DOCS.parent / "examples", *folder.resolve().iterdir()):
            Path(made, source.name).symlink_to(source)
        for name in (name for name in asked if only in (None, name)):
            for command in asked[name]:
                _run(command, Path(made))
            size = save_jpeg(_picture(name, Path(made)), DOCS / "guides" / f"{name}.jpg", most=MOST_BYTES)
            print(f"{name}: {size / 1000:.0f} kB", flush=True)


def _run(command: list[str], folder: Path) -> None:
    if command[0] not in ("upholster", "python"):
        raise InputError(f"command {command[0]!r} of the page; allowed: upholster, python")
    module = ["-m", "upholster"] if command[0] == "upholster" else []
    done = subprocess.run(
        [sys.executable, *module, *command[1:]], cwd=folder, check=False, capture_output=True, text=True
    )
    if done.returncode:
        raise InputError(f"command {shlex.join(command)[:200]!r} failed: {done.stderr[-300:]}")


def _picture(name: str, folder: Path) -> Any:
    if name not in PANELS:
        return Image.open(folder / f"{name}.png").convert("RGB")
    part = CROPPED.get(name, (0.0, 0.0, 1.0, 1.0))
    return compose([[_panel(folder, shown, part) for shown in row] for row in PANELS[name]], gap=14)


def _panel(folder: Path, shown: Shown, part: tuple[float, float, float, float]) -> Panel:
    files, title, width = shown
    images = [Image.open(folder / file).convert("RGB") for file in files.split()]
    image = images[0] if len(images) == 1 else _differing(*images)
    sides = 2 * image.size
    image = image.crop([round(share * side) for share, side in zip(part, sides, strict=True)])
    size = (width, round(image.height * width / image.width))
    return Panel(image.resize(size, Image.Resampling.LANCZOS), title)


def _differing(before: Any, after: Any) -> Any:
    """Return the second picture, white where it is as the first."""
    channels = ImageChops.difference(before, after).split()
    most = ImageChops.lighter(ImageChops.lighter(*channels[:2]), channels[2])
    return Image.composite(
        after, Image.new("RGB", after.size, "white"), most.point(lambda value: 255 * (value > 3))
    )


def main(arguments: list[str]) -> int:
    """Run the command; return its exit status."""
    try:
        match arguments:
            case ["-h"] | ["--help"]:
                print(USAGE)
            case [folder, "--only", name] | ["--only", name, folder]:
                make(Path(folder), name)
            case [folder] if not folder.startswith("-"):
                make(Path(folder), None)
            case _:
                raise InputError(USAGE)
    except (UpholsterError, OSError) as error:
        print(f"make_guides: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
