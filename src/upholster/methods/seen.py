"""The input of matching: one exemplar, or several in one image, and the user's placement requests."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface
from upholster.charts.maps import MapGround
from upholster.charts.phases import PhaseField, phase_field
from upholster.charts.size_map import SizeField
from upholster.elements import Lattice, find_lattice
from upholster.errors import InputError
from upholster.image.masks import Used
from upholster.methods.guidance import (
    Guidance,
    ZoneMaps,
    guides_on,
    put_on,
    region_again,
    regions_held,
    zones_on,
)
from upholster.methods.quilt.guides import Again, Steering, Zones, cropped
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.sizes import block_side, suiting_side
from upholster.methods.quilt.usable import largest_block, usable_side
from upholster.options import SynthesisOptions
from upholster.types import FloatArray, PixelArray

__all__ = ["Seen"]


@dataclass(frozen=True, eq=False)
class Seen:
    """The input of matching: one exemplar, or several in one image.

    Attributes
    ----------
    exemplar
        (H, W, C) the complete image.
    used
        (H, W) the pixels that blocks may show; None: all.
    guidance
        The user's placement requests; None: there are none.
    """

    exemplar: PixelArray
    used: Used | None
    guidance: Guidance | None

    @property
    def zones(self) -> ZoneMaps | None:
        """Where each of several samples goes; None if there is only one sample."""
        return None if self.guidance is None else self.guidance.zones

    @property
    def parts(self) -> tuple[PixelArray, ...]:
        """The samples; the first one defines sizes."""
        if self.zones is None:
            return (self.exemplar,)
        return tuple(cropped(self.exemplar, one) for one in self.zones.rectangles)

    @property
    def masks(self) -> tuple[Used | None, ...]:
        """For each sample, the pixels that blocks may show; None for all of them."""
        if self.zones is None or self.used is None:
            return (self.used,) * len(self.parts)
        return tuple(cropped(self.used, one) for one in self.zones.rectangles)

    def steering(
        self, ground: MapGround, block: float, phases: tuple[WantedPhases | None, ...]
    ) -> Steering | None:
        """Return the requests on charts, None if there are none; `block` is the side of blocks in steps."""
        if self.guidance is None:
            return None
        zones = None
        if self.zones is not None:
            zones = Zones(self.zones.rectangles, zones_on(self.zones, ground, block), phases)
        return Steering(guides_on(self.guidance.guides, ground), zones, put=put_on(self.guidance.put, ground))

    def again(self, ground: MapGround) -> tuple[Again, ...]:
        """Return the regions that are laid again.

        Raises
        ------
        InputError
            If a region contains no part of the surface.
        """
        asked = () if self.guidance is None else self.guidance.again
        return tuple(region_again(wanted, ground, seed) for wanted, seed in asked)

    def held(self, ground: MapGround) -> tuple[NDArray[np.bool_], ...] | None:
        """Return for each chart a mask (height, width) of the steps kept from another quilt; None: none."""
        asked = () if self.guidance is None else self.guidance.held
        return regions_held(asked, ground) if asked else None

    def lattices(self, options: SynthesisOptions, weight: float) -> list[Lattice | None]:
        """Return each sample's lattice; all are None if phases have no weight, by default `weight`."""
        counts = (weight if options.phase is None else options.phase) > 0
        return [find_lattice(part) if counts else None for part in self.parts]

    def wanted_phases(
        self,
        options: SynthesisOptions,
        weight: float,
        charted: ChartedSurface,
        vectors: FloatArray,
        scale: float,
        sizes: SizeField | None = None,
    ) -> tuple[WantedPhases | None, ...]:
        """Return the requested phases of each sample; the other parameters are those of `phase_field`."""
        weight = weight if options.phase is None else options.phase
        return tuple(
            None
            if lattice is None
            else WantedPhases(lattice, phase_field(charted, vectors, scale, lattice.waves, sizes), weight)
            for lattice in self.lattices(options, weight)
        )

    def block_side(
        self,
        options: SynthesisOptions,
        across: float,
        turning: float,
        phases: tuple[WantedPhases | None, ...] | None = None,
    ) -> int:
        """Return the side of blocks on a surface; other parameters as in the function `block_side`."""
        if options.block is not None:
            return options.block
        surfaces = [None if one is None else one.surface for one in phases or (None,) * len(self.parts)]
        sides = [
            block_side(part.shape, across, turning, one if isinstance(one, PhaseField) else None)
            for part, one in zip(self.parts, surfaces, strict=True)
        ]
        return min(usable_side(max(sides), mask) for mask in self.masks)

    def wanted_block(self, options: SynthesisOptions, weight: float) -> int:
        """Return the side of blocks in pixels: the requested one, or one that suits the samples.

        `weight` is that of phases by default.

        Raises
        ------
        InputError
            If a sample has no room for blocks of the requested size.
        """
        for part, used in zip(self.parts, self.masks, strict=True):
            most = min(512, 3 * min(part.shape[:2]) // 4)  # larger blocks leave no choice
            most = most if used is None else min(most, largest_block(used))
            if options.block is not None and not 8 <= options.block <= most:
                masked = "" if used is None else " with this mask"
                raise InputError(
                    f"block is {options.block}; allowed: 8 to {most} in a sample of "
                    f"{part.shape[1]}x{part.shape[0]} pixels{masked}"
                )
        if options.block is not None:
            return options.block
        lattices = self.lattices(options, weight)
        side = max(
            suiting_side(part.shape, repeats=lattice is not None and len(lattice.waves) > 1)
            for part, lattice in zip(self.parts, lattices, strict=True)
        )
        return min(usable_side(side, used) for used in self.masks)
