"""A sample and the surface that it covers: its prepared synthesis, its quilt and its texels."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from upholster.charts.layout import LONGEST
from upholster.charts.surface_to_cover import Covered
from upholster.errors import FormatError, InputError
from upholster.geometry import AnySurface, Surface
from upholster.image import Material
from upholster.image.source import source_parts, used_pixels
from upholster.methods import Guidance, Prepared, coarser, execute, holding, matched_image, prepare
from upholster.methods.quilt.guides import cropped
from upholster.notes import notes_before
from upholster.options import SynthesisOptions, WriteOptions
from upholster.quilt import Chart, Quilt
from upholster.stream import check_layout
from upholster.stream.plan import refuse_pixel
from upholster.textured import TexturedModel
from upholster.types import PixelArray, Progress
from upholster.writing import painted

__all__ = ["REST", "Covering", "check_streamed", "naming_material"]

REST = "the others"
"""Name in reports for the parts that no pattern fits."""


@dataclass(frozen=True, eq=False)
class Covering:
    """A sample and the surface that it covers.

    Attributes
    ----------
    pattern
        The pattern of the parts that it covers; None: all parts.
    covered
        The surface.
    source
        The sample or material for matching and painting.
    asked
        The options for laying it.
    title
        The material's name in a file.
    largest
        Greatest height and width of a chart on patches, in texels.
    guidance
        Guides, zones, regions and pieces; None for none.
    held
        The earlier covering whose regions stay, and its seed; None if no region stays.
    notes
        Warnings from reading, one line each.
    """

    pattern: str | None
    covered: Covered
    source: PixelArray | Material
    asked: SynthesisOptions
    title: str = ""
    largest: int = LONGEST
    guidance: Guidance | None = None
    held: "tuple[Covering, int] | None" = None
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its name in reports; empty if it covers all parts."""
        return "" if self.pattern is None else self.pattern or REST

    @property
    def surface(self) -> AnySurface:
        """The surface."""
        return self.covered.surface

    @property
    def roles(self) -> tuple[str, ...]:
        """The maps of the sample other than the base colour."""
        return tuple(source_parts(self.source))[1:]

    @cached_property
    def seen(self) -> PixelArray:
        """The pixels that are matched."""
        return matched_image(self.source, self.asked)

    @property
    def first(self) -> PixelArray:
        """The pixels that are matched, without the samples of zones."""
        zones = None if self.guidance is None else self.guidance.zones
        return self.seen if zones is None else cropped(self.seen, zones.rectangles[0])

    @cached_property
    def prepared(self) -> Prepared:
        """The settled parameters of the synthesis; InputError if one is out of range."""
        with naming_material(self.name):
            return prepare(
                self.seen,
                self.surface,
                self.asked,
                largest=self.largest,
                model=self.covered.model,
                used=used_pixels(self.source),
                guidance=self.guidance,
            )

    @property
    def charts(self) -> tuple[Chart, ...]:
        """The layout for painting, in texels."""
        return self.prepared.painted

    @property
    def texels(self) -> int:
        """The number of texels."""
        return sum(chart.height * chart.width for chart in self.charts)

    def work_notes(self, *, in_memory: bool) -> list[str]:
        """Return warnings about the work ahead; `in_memory` says whether all texels will be in memory."""
        maps = 1 + len(self.roles) if in_memory else 0
        found = notes_before(self.surface, self.prepared, self.first, maps)
        return [f"{self.name}: {note}" if self.name else note for note in found]

    def synthesized(
        self, *, octaves: int = 0, seed: int, threads: int | None, progress: Progress | None
    ) -> Quilt:
        """Return the quilt; for a quick look one with steps longer by `octaves` powers of two."""
        with naming_material(self.name):
            prepared = coarser(self.prepared, self.seen, octaves) if octaves else self.prepared
            if self.held is not None:
                before, own_seed = self.held
                if not np.array_equal(before.seen, self.seen):
                    raise InputError("a pinned region can not stay if the sample changes; allowed: unpin it")
                quilt = before.synthesized(octaves=octaves, seed=own_seed, threads=threads, progress=None)
                prepared = holding(prepared, quilt)
            return execute(prepared, self.seen, self.surface, seed=seed, threads=threads, progress=progress)

    def textured(
        self,
        quilt: Quilt,
        options: WriteOptions,
        *,
        density: float | None = None,
        threads: int | None,
        progress: Progress | None,
    ) -> TexturedModel:
        """Return the model with its texels, painted at `density` texels per step each way."""
        density = quilt.density if density is None else density
        texels, others = painted(quilt, self.source, threads, progress, density=density)
        return TexturedModel(
            self.surface, texels, options, threads, quilt, self.source, others,
            file=self.covered.model, field=self.prepared.field, name=self.title, density=density,
        )  # fmt: skip


@contextmanager
def naming_material(name: str) -> Iterator[None]:
    """Name the material in errors of a block."""
    try:
        yield
    except (FormatError, InputError) as error:
        called = name if name == REST else repr(name)
        raise type(error)(f"material for {called}: {error}" if name else str(error)) from None


def check_streamed(covering: Covering) -> None:
    """Raise InputError if a stream can not hold a surface with this layout, or this method."""
    surface, prepared, (height, width) = covering.surface, covering.prepared, covering.seen.shape[:2]
    if not isinstance(surface, Surface):
        return
    if covering.asked.method == "pixel":
        refuse_pixel(covering.texels, (height, width))
    check_layout(surface, prepared.charts, (height, width))
