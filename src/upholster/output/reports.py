"""Reports of `cover`: the report itself, automatic choices, counts and times."""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from upholster.base.display import Shown, on_a_line
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.layout import TextureScale
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.image.elements.lattice import element_of
from upholster.model.textured_model import TexturedModel
from upholster.quilt.chart import Chart
from upholster.runtime.parallel import report_progress
from upholster.synthesis.paper.method import PaperOptions
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.pixel.method import PixelOptions
from upholster.synthesis.quilt.scene import Scene

__all__ = [
    "CoverReport",
    "automatic_words",
    "counts_of",
    "covering",
    "laid_counts",
    "page_counts",
    "painted_texels",
    "peak_memory",
    "timed",
    "totalled",
]


@dataclass(frozen=True, slots=True)
class CoverReport(Shown):
    """Report of `cover`; `--report` writes it as JSON. A notebook shows it as a picture of the model.

    Attributes
    ----------
    version
        Version of upholster.
    parameters
        All parameters, including defaults and seed.
    settled
        Automatic choices, in words: block, lattice, sample's size, direction, maps; with method "paper"
        patches, texels, block, overlap, edge block. With several materials, all of that by material.
    counts
        Faces, patches, shared edges (for a mesh triangles, those left plain, parts); charts, texels, painted
        texels (on a mesh more: charts are larger than their islands), placements, edge blocks; maps;
        materials, if there are several; channels and bits per sample of the base colour; pages of the atlas,
        and their texels.
    seconds
        Time per stage, and "total".
    peak_memory_bytes
        Largest memory that the process has held; None if the system does not report it.
    written
        Bytes of each file.
    notes
        Warnings and advice, in words: how a material's maps were read, how many edges nearly
        meet, that the texture will be soft, or that there will be very many texels.
    read
        The files that were read.
    model
        The textured model itself, not in the JSON; None if only tiles were written, one by one.
    """

    version: str
    parameters: dict[str, Any]
    settled: dict[str, str]
    counts: dict[str, int]
    seconds: dict[str, float]
    peak_memory_bytes: int | None
    written: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    read: list[str] = field(default_factory=list)
    model: TexturedModel | None = None

    def __repr__(self) -> str:
        return on_a_line(self, {"texels": self.counts["texels"], "written": list(self.written)})

    def to_json(self) -> dict[str, Any]:
        """Return all fields but the model, in a form for JSON."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name != "model"}


@contextmanager
def timed(stage: str, seconds: dict[str, float], *, reported: bool = False) -> Iterator[None]:
    """Add the time of a block to `seconds`; `reported`: report it as a stage of progress."""
    start = time.perf_counter()
    if reported:
        report_progress(stage, 0, 1)
    yield
    if reported:
        report_progress(stage, 1, 1)
    seconds[stage] = time.perf_counter() - start


def totalled(seconds: dict[str, float]) -> dict[str, float]:
    """Return times, rounded, and their total."""
    return {stage: round(value, 4) for stage, value in [*seconds.items(), ("total", sum(seconds.values()))]}


def automatic_words(
    scene: Scene | PatchScene, surface: AnySurface, asked: SynthesisOptions, roles: Sequence[str]
) -> dict[str, str]:
    """Return automatic choices in words."""
    found: dict[str, str] = {}
    if isinstance(scene, Scene):
        found["block"] = f"{scene.options.block} pixels"
        if scene.waves is not None:
            found["lattice"] = _lattice_words(scene.waves)
        if scene.scale is not None:
            found |= _settled_sizes(scene, scene.scale, surface, asked)
    elif isinstance(scene.options, PixelOptions):
        found["search"] = scene.options.search
    elif isinstance(surface, Surface):
        found |= _settled_by_paper(scene.options, surface)
    if roles:
        found["maps"] = ", ".join(("albedo", *roles))
    return found


def _settled_sizes(
    scene: Scene, scale: TextureScale, surface: AnySurface, asked: SynthesisOptions
) -> dict[str, str]:
    size = scale.sample_size
    found = {"sample": f"{size:.4g} units wide on a model of {surface.size:.4g}"}
    if scene.waves is not None:
        pixels = element_of(scene.waves)
        sides = " x ".join(f"{side / scale.scale:.3g}" for side in pixels)
        found["element"] = f"{sides} units ({' x '.join(f'{side:.3g}' for side in pixels)} pixels)"
    if asked.sample_size is None and asked.element_size is None:
        found["sample"] += f" (--sample-size {2 * size:.3g} makes it twice as large)"
    if scene.sizes is not None:
        found["sizes"] = f"{scene.sizes.least:.3g} to {scene.sizes.most:.3g} times that"
    return found | {"direction": scene.direction}


def _lattice_words(waves: FloatArray) -> str:
    periods = " and ".join(f"{1 / size:.3g}" for size in np.sqrt((waves**2).sum(axis=1)))
    return f"repeats every {periods} pixels"


def _settled_by_paper(options: PaperOptions, surface: Surface) -> dict[str, str]:
    degrees = sorted({patch.degree for patch in surface.patches})
    named = " and ".join(f"({m}, {n})" for m, n in degrees)
    found = {
        "patches": f"{len(surface.patches)} of degree {named}",
        "texels": f"{options.chart}x{options.chart} on each",
        "block": f"{options.block} texels",
        "overlap": f"{options.overlap} texels",
    }
    if options.seams:
        found["edge block"] = f"{options.edge_block or options.block} texels"
    return found


def counts_of(model: TexturedModel) -> dict[str, int]:
    """Return counts of a covered model; of several materials each has its own surface and quilt."""
    parts = model.parts or (model,)
    placements = [part.quilt.placements for part in parts if part.quilt is not None]
    # An edge block is on two charts, over their own blocks.
    edges = sum(int(np.count_nonzero(each["layer"])) // 2 for each in placements)
    placed = sum(map(len, placements)), edges
    counts = laid_counts(model.surface, model.texels.charts, placed, model.texels.arrays[0])
    # The texels of one material may be a little larger than those of another.
    return counts | {"texels": sum(covering(part.surface, part.texels.charts) for part in parts)}


def laid_counts(
    surface: AnySurface, charts: Sequence[Chart], placed: tuple[int, int], colour: PixelArray
) -> dict[str, int]:
    """Return counts for `placed` placements and edge blocks and a base colour."""
    return _surface_counts(surface) | {
        "charts": len(charts),
        "texels": covering(surface, charts),
        "painted texels": painted_texels(charts),
        "placements": placed[0],
        "edge blocks": placed[1],
        "channels": colour.shape[2],
        "bits": 8 * colour.itemsize,
    }


def page_counts(model: TexturedModel) -> dict[str, int]:
    """Return the number of pages of the written atlas, and their texels; empty without one."""
    # The written outputs have made the atlas: in a GLB each material has one of its own.
    made = [model] if "atlas" in vars(model) else [part for part in model.parts if "atlas" in vars(part)]
    pages = [page for each in made for page in each.atlas.pages]
    if not pages:
        return {}
    return {"pages": len(pages), "page texels": sum(page.height * page.width for page in pages)}


def painted_texels(charts: Sequence[Chart]) -> int:
    """Return the number of texels of charts: on meshes some are not on the surface."""
    return sum(chart.height * chart.width for chart in charts)


def covering(surface: AnySurface | None, charts: Sequence[Chart]) -> int:
    """Return the number of texels on the surface: on a mesh charts are larger than their islands."""
    if not isinstance(surface, MeshSurface):
        return painted_texels(charts)
    first = charts[0]
    texels = first.height / (first.s1 - first.s0) * first.width / (first.t1 - first.t0)
    return round(float(surface.mesh.areas[surface.island >= 0].sum()) * texels)


def _surface_counts(surface: AnySurface) -> dict[str, int]:
    if isinstance(surface, MeshSurface):
        plain = int((surface.island < 0).sum())
        return {"triangles": len(surface.island), "left plain": plain, "parts": len(surface.mesh.parts)}
    return {
        "faces": len(surface.faces),
        "patches": len(surface.patches),
        "shared edges": len(surface.shared),
    }


def peak_memory() -> int | None:
    """Return the largest memory that this process has held, in bytes; None if it is not known."""
    if sys.platform == "linux":
        # On Linux getrusage may report the parent's peak, from before this program was loaded.
        with open("/proc/self/status", encoding="ascii") as file:
            return next((1024 * int(line.split()[1]) for line in file if line.startswith("VmHWM:")), None)
    if sys.platform == "win32":
        return None
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # in bytes on macOS
