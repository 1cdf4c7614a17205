"""A request: what is to be covered, with which samples, how, and with which results; and all that follows."""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from upholster.base.errors import FormatError, InputError
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.charts.layout import LONGEST
from upholster.charts.surface_to_cover import Covered, CoveredLike, as_covered, covered_files, covered_parts
from upholster.covering.pins import Pinned, check_pinned
from upholster.covering.sample_arguments import check_samples
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.files.material import Material
from upholster.image.files.source import Sample, Source, read_source, source_parts
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import quietly
from upholster.synthesis.execution import execute
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.guidance_reader import placement_options
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.quilt.scene import Scene, coarser, holding
from upholster.synthesis.setup import prepare, request_files
from upholster.synthesis.surface_request import SurfaceRequest, needs_patches, surface_request

if TYPE_CHECKING:  # loaded when there are files to write: `synthesize` needs none of it
    from upholster.output.outputs import Output

__all__ = ["Request"]

_REST = "the others"
"""Name in reports for the parts that no pattern fits."""


@dataclass(frozen=True, eq=False)
class Request:
    """What is to be covered, with which samples, how, and with which results.

    Everything that follows is made when it is first needed: the surface, the sample, the scene, the quilt.
    With several materials, `read` gives the request of each.

    Attributes
    ----------
    sample
        For all parts without a material; None leaves those parts unchanged.
    on
        The surface; with materials, a model's file.
    materials
        Other samples, each for parts of the model.
    reading, synthesis, writing
        How the model is read, how it is covered, how files are written. A number of texels is the total of
        all materials.
    seed
        0 to 2^63 − 1.
    pinned
        Regions that stay as they were; None for none.
    outputs
        The files to write.
    largest
        Greatest height and width of a chart on patches, in texels, so that each fits its page.
    pattern
        The pattern of the parts that it is for; None: all parts.
    """

    sample: Sample | None
    on: CoveredLike | Covered
    materials: Mapping[str, Sample] = field(default_factory=dict)
    reading: ModelOptions = field(default_factory=ModelOptions)
    synthesis: SynthesisOptions = field(default_factory=SynthesisOptions)
    writing: WriteOptions = field(default_factory=WriteOptions)
    seed: int = 0
    pinned: Pinned | None = None
    outputs: "Sequence[Output]" = ()
    largest: int = LONGEST
    pattern: str | None = None

    def files(self) -> list[str]:
        """Return the files that it names.

        Raises
        ------
        InputError
            If there is no sample at all, a text that names a file is malformed, or `pinned` has another type.
        """
        found = check_samples(self.sample, self.materials)
        assert not isinstance(self.on, Covered)  # it is not read yet
        found += [*covered_files(self.on), *request_files(self.synthesis)]
        check_pinned(self.pinned, self.synthesis.method)
        return found if self.pinned is None else found + self.pinned.files

    def read(self) -> "list[Request]":
        """Return the request of each sample, with its surface; all files are read.

        Raises
        ------
        InputError, FormatError
            As for `covered_parts` and `read_source`, with the material's pattern; if an option does not fit
            the surface or the sample.
        """
        requests = self._by_material() if self.materials else [self]
        for each in requests:
            _ = each.on_surface
        return requests

    def _by_material(self) -> "list[Request]":
        given = placement_options(self.synthesis) or ([] if self.pinned is None else ["a pinned region"])
        if given:
            raise InputError(f"{given[0]} is given with several materials; allowed: with one sample")
        if self.synthesis.method != "quilt":
            raise InputError(
                f"method is {self.synthesis.method!r} with several materials; allowed there: 'quilt'"
            )
        assert not isinstance(self.on, Covered)
        parts = covered_parts(self.on, list(self.materials), self.reading, rest=self.sample is not None)
        areas = {pattern: _area(covered) for pattern, covered in parts.items()}
        return [
            replace(
                self,
                sample=self.materials.get(pattern, self.sample),
                on=covered,
                materials={},
                synthesis=_share(self.synthesis, areas[pattern] / sum(areas.values())),
                pattern=pattern,
            )
            for pattern, covered in parts.items()
        ]

    # ---------------------------------------------------- what follows, for a request with a single sample

    @property
    def name(self) -> str:
        """Its name in reports; empty if it is for all parts."""
        return "" if self.pattern is None else self.pattern or _REST

    @cached_property
    def covered(self) -> Covered:
        """The surface, in the form that the method covers, and the file that it is from."""
        if isinstance(self.on, Covered):
            return self.on
        paper, patches = self.synthesis.method == "paper", needs_patches(self.synthesis)
        return as_covered(self.on, self.reading, biquadratic=paper, patches=patches)

    @property
    def surface(self) -> AnySurface:
        """The surface."""
        return self.covered.surface

    @cached_property
    def on_surface(self) -> SurfaceRequest:
        """The sample and what is asked of it, on its surface; notes include those from reading."""
        with _naming_material(self.name):
            assert self.sample is not None  # `check_samples` made sure
            notes, title = list(self.covered.notes), f"{self.name}: " if self.name else ""
            source = read_source(self.sample, notes=notes)
            if isinstance(source, Material):
                notes += [title + note for note in source.notes]
            held = () if self.pinned is None else self.pinned.regions
            found = surface_request(self.sample, source, self.covered, self.synthesis, held)
            return replace(found, notes=(*notes, *found.notes))

    @property
    def source(self) -> PixelArray | Material:
        """The sample or material to paint, with the samples of zones."""
        return self.on_surface.source

    @property
    def exemplar(self) -> Exemplar:
        """The same as blocks are compared by it."""
        return self.on_surface.exemplar

    @property
    def roles(self) -> tuple[str, ...]:
        """The maps of the sample other than the base colour."""
        return tuple(source_parts(self.source))[1:]

    @cached_property
    def scene(self) -> Scene | PatchScene:
        """The surface as it is covered; InputError if an option is out of range."""
        with _naming_material(self.name):
            return prepare(
                self.exemplar,
                self.surface,
                self.on_surface.options,
                largest=self.largest,
                model=self.covered.model,
            )

    @property
    def charts(self) -> tuple[Chart, ...]:
        """The layout for painting, in texels."""
        return self.scene.painted

    @property
    def texels(self) -> int:
        """The number of texels."""
        return sum(chart.height * chart.width for chart in self.charts)

    def quilt(self, octaves: int = 0) -> Quilt:
        """Return the quilt; for a quick look one with steps longer by `octaves` powers of two."""
        scene, exemplar = self.scene, self.exemplar
        with _naming_material(self.name):
            if octaves:
                assert isinstance(scene, Scene)
                scene = coarser(scene, exemplar, octaves)
            if self.pinned is not None:
                assert isinstance(scene, Scene)
                with quietly():
                    before = self._before(self.pinned).quilt(octaves)
                scene = holding(scene, before)
            return execute(scene, exemplar, self.surface, seed=self.seed)

    def _before(self, pinned: Pinned) -> "Request":
        # The request whose regions stay.
        own = replace(
            self, on=self.covered, synthesis=pinned.synthesis, seed=pinned.seed, pinned=pinned.before
        )
        if not np.array_equal(own.exemplar.pixels, self.exemplar.pixels):
            raise InputError("a pinned region can not stay if the sample changes; allowed: unpin it")
        return own

    @property
    def title(self) -> str:
        """The material's name in a file: the name of the sample's file or folder; empty if it is alone."""
        if self.pattern is None or self.sample is None:
            return ""
        source: Source = self.sample.source
        if isinstance(source, Sequence) and not isinstance(source, str) and len(source) == 1:
            source = source[0]
        return Path(source).stem if isinstance(source, (str, os.PathLike)) else self.pattern


@contextmanager
def _naming_material(name: str) -> Iterator[None]:
    """Name the material in errors of a block."""
    try:
        yield
    except (FormatError, InputError) as error:
        called = name if name == _REST else repr(name)
        raise type(error)(f"material for {called}: {error}" if name else str(error)) from None


def _share(asked: SynthesisOptions, share: float) -> SynthesisOptions:
    """Return options with the share of the texels that falls to one surface of several."""
    if not isinstance(asked.texels, int):
        return asked
    return replace(asked, texels=max(64, round(asked.texels * share)))


def _area(covered: Covered) -> float:
    assert isinstance(covered.surface, MeshSurface)  # a model's
    return float(covered.surface.mesh.areas[covered.surface.island >= 0].sum())
