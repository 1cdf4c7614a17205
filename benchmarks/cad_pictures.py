"""CAD parts covered, in our renderer and in Blender: the picture docs/gallery/cad.jpg.

``python -m benchmarks.cad_pictures OUT --teapot FILE.bpt [--blender PYTHON] [--gallery]``. Makes the parts
and the samples of knurl, leather and brushed metal itself; the teapot is Newell's, and not the project's.
With ``--blender`` Blender draws the GLBs below, of the handle its USDZ, which needs the extra usd; PYTHON is
one that has ``bpy``, as of `benchmarks.players`. With ``--gallery`` the picture goes to docs/gallery.
"""

import argparse
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import upholster
from benchmarks.cad_part import knob, rounded_part, t_handle, write_assembly
from upholster.image import write_image
from upholster.options import WriteOptions
from upholster.types import FloatArray

__all__ = ["main"]

ROOT = Path(__file__).parent.parent
SIZE = (520, 420)
DRAWER = Path(__file__).with_name("blender_picture.py")


def knurl(side: int = 256, period: int = 32) -> FloatArray:
    """Return pyramids in rows that cross, lit from above: (side, side, 3), 0 to 1."""
    y, x = np.mgrid[:side, :side] / period
    cells = [np.abs((a % 1.0) - 0.5) for a in (x + y, x - y)]
    height = 1.0 - 2.0 * np.maximum(*cells)
    slope = np.roll(height, -1, 0) - np.roll(height, 1, 0)
    noise = np.random.default_rng(1).normal(0, 0.012, height.shape)
    grey = np.clip(0.34 + 0.3 * height - 1.4 * slope + noise, 0, 1)
    return np.asarray(grey[..., None] * (0.98, 1.0, 1.03), np.float64)


def leather(side: int = 384, cells: int = 30) -> FloatArray:
    """Return brown cells of uneven size with dark creases between them, (side, side, 3)."""
    rng = np.random.default_rng(2)
    grid = np.indices((cells, cells)).reshape(2, -1).T
    points = (grid + rng.uniform(-0.05, 1.05, grid.shape)) / cells
    moves = np.indices((3, 3)).reshape(2, -1).T - 1
    near = (points + moves[:, None]).reshape(-1, 2)
    near = near[(np.abs(near - 0.5) < 0.6).all(axis=1)]
    places = (np.indices((side, side)).reshape(2, -1).T + 0.5) / side
    two = np.concatenate(
        [
            np.sort(np.linalg.norm(part[:, None] - near, axis=2), axis=1)[:, :2]
            for part in np.array_split(places, 96)
        ]
    ).reshape(side, side, 2)
    crease = np.clip((two[..., 1] - two[..., 0]) * cells / 0.35, 0, 1) ** 0.6
    dome = 1 - 0.2 * np.clip(two[..., 0] * cells, 0, 0.8)
    tone = (0.45 + 0.55 * crease) * dome + rng.normal(0, 0.02, crease.shape)
    return np.asarray(np.clip(tone[..., None] * (0.62, 0.36, 0.21), 0, 1), np.float64)


def brushed(side: int = 384) -> FloatArray:
    """Return grey metal with fine scratches along its rows, (side, side, 3)."""
    rng = np.random.default_rng(3)
    out = np.zeros((side, side))
    for length, part in ((side // 2, 0.6), (side // 8, 0.3), (3, 0.1)):
        noise = np.fft.rfft(rng.normal(size=(side, side)), axis=1)
        noise *= np.exp(-0.5 * (np.arange(noise.shape[1]) * length / side) ** 2)
        rows = np.fft.irfft(noise, side, axis=1)
        out += part * rows / rows.std()
    return np.asarray(np.clip(0.62 + 0.085 * out, 0, 1)[..., None] * (1.0, 1.0, 1.02), np.float64)


def _covered(out: Path, teapot: Path, *, usd: bool) -> list[tuple[str, tuple[float, float]]]:
    """Cover everything; return names and views."""
    for name, sample in (("knurl", knurl()), ("leather", leather()), ("brushed", brushed())):
        write_image(out / f"{name}.png", np.rint(255 * sample).astype(np.uint8))
    write_assembly(out / "knob.step", knob())
    write_assembly(out / "part.step", rounded_part())
    write_assembly(out / "handle.step", t_handle())
    metal = str(out / "brushed.png")
    knurled = {"Knob": f"{out / 'knurl.png'}@10mm", "*": f"{metal}@14mm"}
    round_ = {"direction": {"Knob": "around", "*": "along"}, "fit": True}
    along = {"direction": "along", "sample_size": "20mm"}
    bricks = str(ROOT / "examples/bricks.png")
    looks: list[tuple[str, tuple[float, float], dict[str, Any], Any, Path]] = [
        ("knob", (30.0, 25.0), round_, knurled, out / "knob.step"),
        ("part", (35.0, 35.0), {"sample_size": "22mm"}, str(out / "leather.png"), out / "part.step"),
        ("handle", (35.0, 25.0), along, metal, out / "handle.step"),
        ("teapot", (-60.0, 22.0), {"sample_size": 1.6}, bricks, teapot),
    ]
    for name, view, synthesis, sample, model in looks:
        several = sample if isinstance(sample, dict) else None
        suffixes = [".glb", ".png", *([".usdz"] if name == "handle" and usd else [])]
        report = upholster.cover(
            None if several else sample,
            model,
            [out / f"{name}{suffix}" for suffix in suffixes],
            materials=several,
            synthesis=synthesis | {"texels": 2_000_000},
            options=WriteOptions(size=SIZE, view=view, supersample=3),
            seed=1,
        )
        print(name, report.notes, flush=True)
    return [(name, view) for name, view, *_ in looks]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cad_pictures", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--teapot", type=Path, required=True)
    parser.add_argument("--blender", type=Path)
    parser.add_argument("--gallery", action="store_true")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    shown = _covered(asked.out, asked.teapot, usd=asked.blender is not None)
    rows = [[asked.out / f"{name}.png" for name, _ in shown]]
    if asked.blender is not None:
        rows.append([asked.out / f"{name}_blender.png" for name, _ in shown])
        for (name, view), picture in zip(shown, rows[1], strict=True):
            model = asked.out / f"{name}{'.usdz' if name == 'handle' else '.glb'}"
            words = [asked.blender, DRAWER, model, picture, *SIZE, *view]
            subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)
    whole = Image.new("RGB", (SIZE[0] * len(shown), SIZE[1] * len(rows)))
    for y, row in enumerate(rows):
        for x, file in enumerate(row):
            whole.paste(Image.open(file).convert("RGB"), (x * SIZE[0], y * SIZE[1]))
    target = (ROOT / "docs/gallery" if asked.gallery else asked.out) / "cad.jpg"
    whole.save(target, quality=88, optimize=True)
    print(target)


if __name__ == "__main__":
    main()
