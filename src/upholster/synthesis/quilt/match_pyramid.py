"""The pyramid by which method "quilt" compares blocks: on each level, features and means of their boxes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.image.elements.joints import Joints
from upholster.image.elements.lattice import Lattice
from upholster.image.masks import Used
from upholster.quilt.pyramid import halved
from upholster.runtime.stages import stage
from upholster.synthesis.quilt.features import pca_features
from upholster.synthesis.quilt.kernels._block_kernels import LayNumbers, MatchImage
from upholster.synthesis.quilt.kernels._search_kernels import mean_boxes
from upholster.synthesis.quilt.phases import level_phases, shown_waves

__all__ = ["MatchLevel", "MatchPyramid", "SamplePart", "match_pyramid", "with_fringe"]


_EVERYWHERE = (np.empty(0, np.uint8), np.empty(0, np.int64))


@dataclass(frozen=True, eq=False, slots=True)
class MatchLevel:
    """One level: its size, the distance of candidates in pixels, and the kernels' arrays."""

    height: int
    width: int
    step: int
    match: MatchImage


@dataclass(frozen=True, eq=False, slots=True)
class MatchPyramid:
    """All levels on which blocks are compared.

    Attributes
    ----------
    levels
        All levels, the finest first.
    form
        The features of the finest level's pixels, (H, W, K).
    variance
        Mean squared distance of the finest level's used pixels from their mean.
    guide_step
        Distance of the places at which guides are compared, in pixels of the finest level.
    """

    levels: tuple[MatchLevel, ...]
    form: NDArray[np.uint8]
    variance: float
    guide_step: int

    def stride(self, level: int) -> int:
        """Return the distance of the places at which guides are compared, in pixels of a level."""
        return self.guide_step >> level


@dataclass(frozen=True, eq=False, slots=True)
class SamplePart:
    """One of the samples that are rectangles of an image, or the complete image.

    Attributes
    ----------
    rows, columns
        Its rectangle; multiples of the largest pixel of any level.
    lattice, joints
        Its lattice and joints; None: there are none, or they do not count.
    """

    rows: slice
    columns: slice
    lattice: Lattice | None = None
    joints: Joints | None = None

    @classmethod
    def whole(
        cls, pixels: PixelArray, lattice: Lattice | None = None, joints: Joints | None = None
    ) -> "SamplePart":
        """Return a complete exemplar as one part."""
        return cls(slice(0, pixels.shape[0]), slice(0, pixels.shape[1]), lattice, joints)

    def on_level(self, level: int) -> tuple[slice, slice]:
        """Return its rows and columns in pixels of a level."""
        found = [slice(one.start >> level, -(-one.stop >> level)) for one in (self.rows, self.columns)]
        return found[0], found[1]


@stage
def match_pyramid(
    pixels: PixelArray, last: int = 0, parts: Sequence[SamplePart] = (), masks: Sequence[Used] = ()
) -> MatchPyramid:
    """Make the levels of an exemplar (H, W, C), from 0 to `last`.

    Levels include the phases and joints of `parts`, see `_with_joints`. Without parts, the exemplar is one
    part that has neither. The variance is that of the pixels in `masks` (H, W), or of all if there are no
    masks.
    """
    parts = parts or [SamplePart.whole(pixels)]
    shown = np.concatenate(_as_many([shown_waves(part.lattice) for part in parts]))
    form = _matched_form(pixels, parts)
    varying = form[np.logical_or.reduce(masks)][None] if masks else form
    variance = float(varying.astype(np.float64).var(axis=(0, 1)).sum())
    image = form
    levels = []
    for level in range(last + 1):
        if level:
            image = halved(image)
        height, width = image.shape[:2]
        step = _step(height, width)
        plane = mean_boxes(np.ascontiguousarray(image[..., 0]), step)
        phases = _phases_of(parts, level, height, width)
        unasked = np.empty((0, 0), np.uint8), np.empty((0, 256), np.int32)
        match = MatchImage(_as_pixels(image), plane, phases, shown, *_EVERYWHERE, *unasked)
        levels.append(MatchLevel(height, width, step, match))
    guide_step = max(4, 1 << (len(levels) - 1))
    while max(form.shape[:2]) > 64 * guide_step:
        guide_step *= 2
    return MatchPyramid(tuple(levels), form, variance, guide_step)


def with_fringe(match: MatchImage, numbers: LayNumbers, fringe: int) -> tuple[MatchImage, LayNumbers]:
    """Return an exemplar that has no mask with `fringe` mirrored pixels around it, see `LayNumbers`."""
    height, width = numbers.height + 2 * fringe, numbers.width + 2 * fringe

    def wide(planes: NDArray[Any]) -> NDArray[Any]:
        around = (0, 0), (fringe, fringe), (fringe, fringe)
        found = np.pad(planes.reshape(len(planes), numbers.height, numbers.width), around, "reflect")
        return found.reshape(len(planes), height * width)

    image = wide(match.image[None])[0]
    plane = mean_boxes(image.astype(np.uint8).reshape(height, width), numbers.step)
    phases, guides = wide(match.phases), wide(match.guides) if len(match.guides) else match.guides
    return (
        match._replace(image=image, plane=plane, phases=phases, guides=guides),
        numbers._replace(height=height, width=width, fringe=fringe),
    )


def _matched_form(pixels: PixelArray, parts: Sequence[SamplePart]) -> NDArray[np.uint8]:
    # The features by which pixels are compared; joints take one of four channels.
    if all(part.joints is None for part in parts):
        return pca_features(pixels, most=4)
    form = pca_features(pixels, most=3)
    first = form[..., :1].copy()
    for part in parts:
        if part.joints is not None:
            window = part.rows, part.columns
            first[window][..., 0] = _with_joints(first[window][..., 0], part.joints)
    return np.concatenate([first, form], axis=2)


def _as_many(shown: Sequence[NDArray[np.int8]]) -> list[NDArray[np.int8]]:
    # Waves that a part lacks map to themselves. Their phases are 0 everywhere, and so are the requested ones.
    most = max(one.shape[1] for one in shown)
    missing = [
        np.broadcast_to(np.arange(one.shape[1] + 1, most + 1, dtype=np.int8), (8, most - one.shape[1]))
        for one in shown
    ]
    return [np.concatenate(pair, axis=1) for pair in zip(shown, missing, strict=True)]


def _phases_of(parts: Sequence[SamplePart], level: int, height: int, width: int) -> NDArray[np.int16]:
    # The phases of a level's pixels, (n, height · width), for the maximum number n of waves of a part.
    count = max(0 if part.lattice is None else len(part.lattice.waves) for part in parts)
    found = np.zeros((count, height, width), np.int16)
    for part in parts:
        if part.lattice is not None:
            rows, columns = part.on_level(level)
            shape = rows.stop - rows.start, columns.stop - columns.start
            own = level_phases(part.lattice, level, *shape)
            found[: len(own), rows, columns] = own.reshape(-1, *shape)
    return found.reshape(count, height * width)


def _with_joints(first: NDArray[np.uint8], joints: Joints) -> NDArray[np.uint8]:
    # The channel by which candidates are found: the mean of the first colour and of the pixels' distances
    # from joints. Distances are inverted if they correlate negatively with the colour.
    color, far = first.astype(np.int64), joints.distances.astype(np.int64)
    if ((color - int(color.mean())) * (far - int(far.mean()))).sum() < 0:
        far = 255 - far
    return ((color + far) // 2).astype(np.uint8)


def _as_pixels(image: NDArray[np.uint8]) -> NDArray[np.int32]:
    # An image of at most four channels, packed into one number per pixel.
    pixels = np.zeros((*image.shape[:2], 4), np.uint8)
    pixels[..., : image.shape[2]] = image
    return pixels.view("<i4").astype(np.int32, copy=False).reshape(-1)


def _step(height: int, width: int) -> int:
    # Candidates are every step-th pixel each way, because means of boxes change little between neighbours.
    area = height * width
    return 1 if area <= 64 * 64 else 2 if area <= 384 * 384 else 4
