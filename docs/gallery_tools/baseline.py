"""Figure 11: the paper's baseline, the paper's method and ours, the same samples on the same surfaces."""

import time
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from gallery_tools.drawing import PAPER, Panel, compose, text
from gallery_tools.shots import OWN, Exemplars, read, take
from upholster import paint, synthesize
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.charts.layout import texture_scale
from upholster.covering.measure import sliced_wasserstein
from upholster.covering.measure.mesh_seams import mesh_seams
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.surface import Surface
from upholster.model.textured_model import TexturedModel

__all__ = ["baseline", "draft"]

CHART, FLAT, SIDE, SIZE = 192, 512, 128, (330, 280)

METHODS: dict[str, dict[str, Any]] = {
    "pixel, full search": {"method": "pixel", "search": "full"},
    "pixel, coherent search": {"method": "pixel"},
    "paper": {"method": "paper"},
    "quilt": {"method": "quilt"},
}


def draft(exemplars: Exemplars) -> Any:
    """Draw figure 11 with few texels, from samples half as wide: seconds instead of a minute and a half."""
    return baseline(exemplars, chart=32, flat=64, side=64)


def baseline(_exemplars: Exemplars, *, chart: int = CHART, flat: int = FLAT, side: int = SIDE) -> Any:
    """Draw figure 11: one row for each sample, one column for each method."""
    heads = ["sample", *METHODS]
    rows = [[Panel(_words(name, 256 if name == "sample" else SIZE[0]), "") for name in heads]]
    ring, ball = ring_cyclide(), sphere(tiling="octants")
    for name, surface, view in (
        ("bricks", ring, (150.0, 36.0)),
        ("pebbles", ball, (45.0, 20.0)),
        ("weave", ring, (150.0, 36.0)),
    ):
        exemplar = read(OWN / f"{name}.png", side)
        larger = Image.fromarray(exemplar).resize((256, 256), Image.Resampling.NEAREST)
        panels = [Panel(larger, f"{name}, {side} x {side}")]
        for options in METHODS.values():
            model, seconds, seam = _covered(surface, exemplar, options, chart)
            figures = [f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s", f"seam {seam:.2f}"]
            figures += _fidelity(exemplar, options, flat)
            panels.append(Panel(take(model, size=SIZE, view=view).image, ", ".join(figures)))
        rows.append(panels)
    return compose(rows, gap=14)


def _covered(
    surface: Surface, exemplar: PixelArray, options: dict[str, Any], chart: int
) -> tuple[TexturedModel, float, float]:
    """Return a covered surface, the seconds that synthesis and painting took, and its seam ratio."""
    quilts = options["method"] == "quilt"
    size: dict[str, Any] = {"chart": chart}
    if quilts:  # as many texels, each as large as a pixel of the sample
        texels = len(surface.patches) * chart**2
        density = texture_scale(surface, exemplar.shape[1], texels=texels).density
        size = {"texels": texels, "sample_size": exemplar.shape[1] / density}
    small: dict[str, Any] = {"texels": 100_000} if quilts else {"chart": 32}
    paint(synthesize(exemplar, surface, **options, **small), exemplar)  # kernels are compiled, or read
    start = time.perf_counter()
    quilt = synthesize(exemplar, surface, **options, **size, seed=1)
    painted = paint(quilt, exemplar)
    seconds = time.perf_counter() - start
    ratio = mesh_seams(surface, quilt, painted, exemplar).ratio
    return TexturedModel(surface, painted, WriteOptions()), seconds, ratio or 0.0


def _fidelity(exemplar: PixelArray, options: dict[str, Any], flat: int) -> list[str]:
    """Return what is measured of a flat texture: of a model's charts, warp fields would count as errors."""
    size: dict[str, Any] = {"texels": (flat, flat)} if options["method"] == "quilt" else {"chart": flat}
    made = paint(synthesize(exemplar, plane(), **options, **size, seed=1), exemplar).arrays[0]
    distance = f"SWD {1000 * np.mean(sliced_wasserstein([made], exemplar)):.1f}"
    from benchmarks.fidelity import statistics_error

    error = statistics_error(made, exemplar)
    return [distance] if error is None else [f"PS {error:.2f}", distance]


def _words(name: str, width: int) -> Any:
    image = Image.new("RGB", (width, 30), PAPER)
    text(ImageDraw.Draw(image), (width / 2, 15), name, align=0.5)
    return image
