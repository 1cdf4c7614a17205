"""Reports of `cover`: the report itself, automatic choices, notes before the work, counts and times."""

import math
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from upholster.charts.layout import MOST_TEXELS, TextureScale
from upholster.elements import find_joints
from upholster.geometry import AnySurface, MeshSurface, Surface
from upholster.geometry.mesh_state import inside_out_parts
from upholster.image.even_light import UNEVEN, light_range
from upholster.image.sameness import differing_region
from upholster.methods import Prepared
from upholster.methods.paper.method import PaperOptions
from upholster.methods.pixel.method import PixelOptions
from upholster.methods.quilt.phases import better_tile, stretched_by
from upholster.methods.quilt.quilt_options import QuiltOptions
from upholster.options import SynthesisOptions
from upholster.quilt import Chart, Quilt, Texels
from upholster.shown import Shown, on_a_line, texels_in_words
from upholster.textured import TexturedModel
from upholster.types import FloatArray, PixelArray, Progress

__all__ = [
    "CoverReport",
    "counts_of",
    "covering",
    "laid_counts",
    "notes_before",
    "page_counts",
    "peak_memory",
    "sample_notes",
    "settled_words",
    "timed",
    "totalled",
]

_SOFT, _COARSE = 0.6, 1.2
"""Pixels of the sample per texel: below the first a texture looks soft, above the second it loses detail."""

_ELEMENT_TEXELS, _TEXEL_PIXELS, _BLURRED = 8, 8, 2.0
"""Fewest texels across an element; most pixels of the sample per texel if its elements are not known; and how
many there are in any case before a note asks for more texels."""

_TIMES = 4
"""The size that a note suggests for a sample that is wider than the model fits this often along it."""

_FEW = 4
"""Number of elements across a sample below which a note advises more."""

_STRETCHED = 0.01
"""Stretch from which a note names a better size of a tile."""

_SMOOTHED = 0.01
"""Part of the surface from which a note reports that sizes are smoothed there."""

_LISTED = 3
"""Number of part names that a note lists."""

_MANY_TEXELS = 2**25
"""Size from which a note before the work reports the size of the files."""


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
def timed(stage: str, seconds: dict[str, float], progress: Progress | None = None) -> Iterator[None]:
    """Add the time of a block to `seconds`; report the stage to `progress`."""
    start = time.perf_counter()
    if progress is not None:
        progress(stage, 0, 1)
    yield
    if progress is not None:
        progress(stage, 1, 1)
    seconds[stage] = time.perf_counter() - start


def totalled(seconds: dict[str, float]) -> dict[str, float]:
    """Return times, rounded, and their total."""
    return {stage: round(value, 4) for stage, value in [*seconds.items(), ("total", sum(seconds.values()))]}


def settled_words(
    prepared: Prepared, surface: AnySurface, asked: SynthesisOptions, roles: Sequence[str]
) -> dict[str, str]:
    """Return automatic choices in words."""
    found: dict[str, str] = {}
    if isinstance(prepared.options, QuiltOptions):
        found["block"] = f"{prepared.options.block} pixels"
    if isinstance(prepared.options, PaperOptions) and isinstance(surface, Surface):
        found |= _settled_by_paper(prepared.options, surface)
    if isinstance(prepared.options, PixelOptions):
        found["search"] = prepared.options.search
    if prepared.phases is not None:
        found["lattice"] = _lattice_words(prepared.phases.lattice.waves)
    if prepared.scale is not None:
        size = prepared.scale.sample_size
        found["sample"] = f"{size:.4g} units wide on a model of {surface.size:.4g}"
        if prepared.phases is not None:
            pixels = prepared.phases.lattice.element
            sides = " x ".join(f"{side / prepared.scale.scale:.3g}" for side in pixels)
            found["element"] = f"{sides} units ({' x '.join(f'{side:.3g}' for side in pixels)} pixels)"
        if asked.sample_size is None and asked.element_size is None:
            found["sample"] += f" (--sample-size {2 * size:.3g} makes it twice as large)"
        if prepared.sizes is not None:
            found["sizes"] = f"{prepared.sizes.least:.3g} to {prepared.sizes.most:.3g} times that"
        found["direction"] = prepared.direction
    if roles:
        found["maps"] = ", ".join(("albedo", *roles))
    return found


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


def sample_notes(sample: PixelArray) -> list[str]:
    """Return reasons why a sample (H, W, C) may not be suitable, and advice."""
    if region := differing_region(sample):
        return [
            f"the sample does not look like one texture: {region} has another colour than the rest; "
            "use --crop or --rectify to take a part of it"
        ]
    found = []
    if (uneven := light_range(sample)) > UNEVEN:
        found.append(f"the light on the sample varies by a factor of {uneven:.1f}; --even-light removes that")
    joints = find_joints(sample)
    if joints is not None and joints.across < _FEW:
        found.append(
            f"the sample is about {joints.across:.1f} stones, boards or tiles across; with fewer than {_FEW} "
            "the same ones show again and again: a larger piece of the material has more"
        )
    return found


def notes_before(surface: AnySurface, prepared: Prepared, sample: PixelArray, maps: int) -> list[str]:
    """Return notes before the work begins; `maps` are those whose texels are kept."""
    found = _mesh_notes(surface) if isinstance(surface, MeshSurface) else _patch_notes(surface)
    found += sample_notes(sample)
    if prepared.scale is not None:
        found += _size_notes(surface, prepared.scale)
        found += _resolution_notes(prepared, prepared.scale, sample)
    if prepared.sizes is not None and prepared.sizes.smoothed >= _SMOOTHED:
        share = f"{100 * prepared.sizes.smoothed:.0f} %"
        found.append(f"size changes faster than blocks can follow on {share} of the surface: smoothed")
    painted = _painted(prepared.painted)
    if painted > _MANY_TEXELS and maps:
        size = painted * sample.itemsize * 3 * maps
        texels = texels_in_words(covering(surface, prepared.painted), painted)
        found.append(
            f"{texels}: {size / 1e9:.1f} GB of texels in memory, and images of about half of that; "
            "fewer by --texels or --density"
        )
    if prepared.phases is not None and prepared.options.tileable:
        chart, waves = prepared.charts[0], prepared.phases.lattice.waves
        stretched = stretched_by(waves, chart.height, chart.width)
        height, width = better_tile(waves, chart.height, chart.width)
        less = stretched_by(waves, height, width)
        if stretched > _STRETCHED and less < 0.5 * stretched:
            found.append(
                f"the sample's rows or columns are stretched by {stretched:.1%}, so that the tile has whole "
                f"periods of them; {width}x{height} texels would do with {less:.1%}"
            )
    return found


def _patch_notes(surface: Surface) -> list[str]:
    count, tolerance = surface.nearly_meeting
    if not count:
        return []
    return [
        f"{count} edges nearly meet, but are farther apart than the tolerance of {surface.tolerance:g} "
        f"times the surface's size; a tolerance of {tolerance:g} would join them"
    ]


def _mesh_notes(surface: MeshSurface) -> list[str]:
    mesh = surface.mesh
    inward = inside_out_parts(mesh)
    inward[np.setdiff1d(np.arange(len(inward)), mesh.part[surface.island >= 0])] = False
    names = [mesh.parts[number] for number in np.flatnonzero(inward)]
    if not names:
        return []
    listed = ", ".join(names[:_LISTED]) + (" …" if len(names) > _LISTED else "")
    return [
        f"the faces of {listed} point inward: the texture is mirrored as seen from outside, and other "
        "programs may not show it; Blender's Mesh > Normals > Recalculate Outside turns them"
    ]


def _size_notes(surface: AnySurface, scale: TextureScale) -> list[str]:
    box = surface.mesh.box if isinstance(surface, MeshSurface) else surface.box
    longest = float(np.ptp(box, axis=0).max())
    if scale.sample_size <= longest:
        return []
    return [
        f"the sample is {scale.sample_size:.3g} units wide and the model only {longest:.3g} long, so only a "
        f"part of it shows: --sample-size {longest / _TIMES:.2g} fits it {_TIMES} times along the model"
    ]


def _resolution_notes(prepared: Prepared, scale: TextureScale, sample: PixelArray) -> list[str]:
    """Return a note if texels are much smaller or larger than the sample's pixels; at most one."""
    wide = scale.scale / scale.density  # of a texel, in pixels of the sample
    if wide < _SOFT:
        return [
            f"the sample has {wide:.2g} pixels to a texel, so the texture will be soft: a larger sample, a "
            "smaller --sample-size or fewer texels make it sharp"
        ]
    element = _element_pixels(prepared, sample)
    most = _TEXEL_PIXELS if element is None else element / _ELEMENT_TEXELS
    if wide > max(most, _BLURRED):
        most = max(most, 1.0)
        enough = _rounded_up(scale.texels * (wide / most) ** 2)
        if element is None:
            found = (
                f"a texel is {wide:.0f} pixels of the sample wide: --texels {enough} makes that {most:.0f}"
            )
        else:
            found = (
                f"an element of the sample, such as a brick, has only {element / wide:.2g} texels on its "
                f"shorter side: --texels {enough} gives it {element / most:.2g}"
            )
        return [found]
    if wide > _COARSE and scale.texels == MOST_TEXELS:
        return [
            f"a texel is {wide:.1f} pixels of the sample wide: by default there are at most 8M; "
            f"--texels {wide**2 * MOST_TEXELS / 1e6:.0f}M shows all that the sample has"
        ]
    return []


def _element_pixels(prepared: Prepared, sample: PixelArray) -> float | None:
    """Return the shorter side of the sample's elements, in pixels; None if they are not known."""
    if prepared.phases is not None:
        return float(min(prepared.phases.lattice.element))
    joints = find_joints(sample)
    return None if joints is None else max(sample.shape[:2]) / max(joints.across, 1.0)


def _rounded_up(count: float) -> str:
    """Write a number of texels as for --texels, rounded up to two digits."""
    power, name = (1e6, "M") if count >= 1e6 else (1e3, "k")
    step = 10.0 ** math.floor(math.log10(count) - 1)
    return f"{math.ceil(count / step) * step / power:.6g}{name}"


def counts_of(surface: AnySurface, quilt: Quilt, texels: Texels) -> dict[str, int]:
    """Return counts of a covering."""
    # An edge block is on two charts, over their own blocks.
    placed = len(quilt.placements), int(np.count_nonzero(quilt.placements["layer"])) // 2
    counts = laid_counts(surface, texels.charts, placed, texels.arrays[0])
    # One of several materials has islands of its own.
    return counts | {"texels": covering(quilt.surface, texels.charts)}


def laid_counts(
    surface: AnySurface, charts: Sequence[Chart], placed: tuple[int, int], colour: PixelArray
) -> dict[str, int]:
    """Return counts for `placed` placements and edge blocks and a base colour."""
    return _surface_counts(surface) | {
        "charts": len(charts),
        "texels": covering(surface, charts),
        "painted texels": _painted(charts),
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


def _painted(charts: Sequence[Chart]) -> int:
    return sum(chart.height * chart.width for chart in charts)


def covering(surface: AnySurface | None, charts: Sequence[Chart]) -> int:
    """Return the number of texels on the surface: on a mesh charts are larger than their islands."""
    if not isinstance(surface, MeshSurface):
        return _painted(charts)
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
