"""What synthesis gets from the user besides a surface: the exemplar, and what is asked of places."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.charts.maps.surface_map import SurfaceMap
from upholster.image.elements.lattice import Lattice, find_lattice
from upholster.image.files.collage import Rectangle
from upholster.image.masks import Used
from upholster.runtime.stages import stage

__all__ = ["NO_GUIDANCE", "Exemplar", "Guidance", "Guide", "Put", "cropped"]


@dataclass(frozen=True, eq=False, slots=True)
class Guide:
    """A map of the sample paired with a map of the surface.

    Attributes
    ----------
    text
        The guide as the user wrote it.
    shown
        (H, W) the map of the sample's pixels: values 1 to 255, or the numbers of labels, from 1.
    wanted
        The map of the surface: the requested values.
    weight
        The guide's weight; 1 is usual.
    labels
        The colours 0xRRGGBB that the numbers stand for, ascending: they are either equal or different. None:
        values.
    """

    text: str
    shown: NDArray[np.uint8]
    wanted: SurfaceMap
    weight: float = 1.0
    labels: NDArray[np.int32] | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Put:
    """A piece of the sample, and the place where the user puts it.

    Attributes
    ----------
    text
        The option as the user wrote it.
    rectangle
        The piece's rectangle in the sample.
    place
        In model units; (column, row) on a flat texture.
    size, degrees, used
        As in `upholster.synthesis.quilt.puts.PutPiece`.
    """

    text: str
    rectangle: Rectangle
    place: tuple[float, ...]
    size: float = 1.0
    degrees: float = 0.0
    used: Used | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Guidance:
    """All placement requests, as the user says them: maps of the sample and of the surface.

    Attributes
    ----------
    guides
        See `Guide`.
    rectangles
        If there are several samples, the rectangle of each in the image; the first sample covers all places
        that no map requests. Empty: there is one sample.
    zones
        For each of the other samples, the map of its places. Where several maps overlap, the last one counts.
    blend
        Width in model units over which the zones' borders fray; None: borders are exactly as in the maps.
    again
        Regions that are laid again, one after another, and their seeds.
    put
        Pieces at places that the user chose.
    held
        Regions that stay as they are in another quilt.
    """

    guides: tuple[Guide, ...] = ()
    rectangles: tuple[Rectangle, ...] = ()
    zones: tuple[SurfaceMap, ...] = ()
    blend: float | None = None
    again: tuple[tuple[SurfaceMap, int], ...] = ()
    put: tuple[Put, ...] = ()
    held: tuple[SurfaceMap, ...] = ()


NO_GUIDANCE = Guidance()
"""One for all that ask for nothing: stages recognise it by its identity."""


@dataclass(frozen=True, eq=False)
class Exemplar:
    """What blocks are compared by: one sample, or several in one image.

    Attributes
    ----------
    pixels
        (H, W, C) the complete image.
    used
        (H, W) the pixels that blocks may show; None: all.
    guidance
        The user's placement requests.
    """

    pixels: PixelArray
    used: Used | None = None
    guidance: Guidance = NO_GUIDANCE

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""
        return self.pixels.shape[0], self.pixels.shape[1]

    @cached_property
    def parts(self) -> tuple[PixelArray, ...]:
        """The samples; the first one defines sizes."""
        return tuple(cropped(self.pixels, one) for one in self.guidance.rectangles) or (self.pixels,)

    @property
    def masks(self) -> tuple[Used | None, ...]:
        """For each sample, the pixels that blocks may show; None for all of them."""
        if self.used is None:
            return (None,) * len(self.parts)
        return tuple(cropped(self.used, one) for one in self.guidance.rectangles) or (self.used,)

    @cached_property
    def zone_masks(self) -> tuple[Used, ...]:
        """For each sample the pixels (H, W) of the image that it may show; empty: all of the only one."""
        if not self.guidance.rectangles:
            return () if self.used is None else (self.used,)
        return _zone_masks(self.guidance.rectangles, self.used, self.shape)

    @cached_property
    def lattices(self) -> tuple[Lattice | None, ...]:
        """The lattice of each sample; None: it does not repeat."""
        return tuple(map(find_lattice, self.parts))


@stage
def _zone_masks(
    rectangles: tuple[Rectangle, ...], used: Used | None, shape: tuple[int, int]
) -> tuple[Used, ...]:
    found = []
    for row, column, height, width in rectangles:
        mask = np.zeros(shape, np.bool_)
        mask[row : row + height, column : column + width] = True
        found.append(mask if used is None else mask & used)
    return tuple(found)


@stage
def cropped(image: PixelArray, rectangle: Rectangle) -> PixelArray:
    """Return a rectangle of an image, which is one of the samples in it."""
    row, column, height, width = rectangle
    return np.ascontiguousarray(image[row : row + height, column : column + width])
