"""Filling holes in photos and materials with the texture around them, or with that of another sample.

A hole is filled tile by tile, each from a window of the photo around it. Outside the hole nothing changes.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.examples import sample_path
from upholster.base.files import path_text
from upholster.base.options.choices import seed_number
from upholster.base.types import PixelArray, Progress
from upholster.image.blend import blended
from upholster.image.color import alpha_channel, from_linear
from upholster.image.files.collage import combined, in_form_of
from upholster.image.files.material import Material
from upholster.image.files.packages import is_zip
from upholster.image.files.read import check_exemplar, read_image
from upholster.image.files.source import Sample, Source, as_exemplar, read_source
from upholster.image.masks import Used, is_white
from upholster.image.photo.preparation import MAX_SIDE, unit_normal_map
from upholster.image.roles import COLORS
from upholster.runtime.parallel import running
from upholster.synthesis.exemplar import Exemplar, Guidance
from upholster.synthesis.holes import LARGEST_BLOCK, check_room, hole_places

__all__ = ["Filling", "Hole", "fill", "is_alpha"]

Hole = str | os.PathLike[str] | NDArray[Any]
"""A mask's file, or ``"alpha"``; or the mask."""

_LARGEST = 16384
"""Largest side of a photo in pixels; of a material's maps, as of a sample's, 4096."""

_TILE = 1024
"""Side of the tiles in which a hole is filled, in pixels."""

_REACHES = 512, 1024
"""Widths of the window around a tile, in pixels: the first one that shows as many pixels as are missing."""

_EVENED = 64.0
"""Pixels over which edges are evened out: across a hole twice as wide, a sky or shade on a wall continues."""

_EVENED_BESIDE = 8.0
"""The same if another sample fills the hole: the sample keeps its own colours."""

_MARGIN = 2
"""Width of a margin of a hole that no block reads: masks seldom end exactly at the edge of an object."""

Maps = dict[str, PixelArray]
_Window = tuple[slice, slice]


def fill(
    photo: Source | Sample,
    hole: Hole,
    *,
    sample: Source | Sample | None = None,
    block: int | None = None,
    seed: int | None = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> PixelArray | Material:
    """Fill a hole in a photo, or in all maps of a material, with the texture around it.

    Parameters
    ----------
    photo
        An image or its file, 32×32 to 16384×16384; or a material, see `upholster.read_material`.
    hole
        The pixels to fill: a mask's file, white there, of the photo's size; or the mask, (H, W) bool or
        (H, W, C); or "alpha": pixels whose alpha in the photo is less than half. That alpha then is no
        transparency, and is dropped.
    sample
        The sample to fill from; None: the photo itself. It has all maps that the photo has.
    block
        Side of the blocks in pixels, 8 to 512; None: chosen for photo and hole, 48 at most.
    seed, threads, progress
        As for `upholster.synthesize`.

    Returns
    -------
    ndarray or Material
        Like the photo, at its depth; pixels outside the hole are equal to the bit.

    Raises
    ------
    InputError
        If something cannot be read or does not fit, the hole is nothing or everything, or there are too few
        pixels to fill it from.
    """
    with running(threads, progress):
        filling = Filling.of(photo, hole, sample, block, None)
        maps = filling.filled(seed_number(seed))
    if isinstance(filling.photo, Material):
        return Material(maps, filling.photo.notes, filling.photo.used)
    return maps["albedo"]


def _maps_of(photo: PixelArray | Material) -> Maps:
    return dict(photo.maps) if isinstance(photo, Material) else {"albedo": photo}


def is_alpha(hole: Hole) -> bool:
    """Whether the photo's own alpha marks the hole."""
    return isinstance(hole, (str, os.PathLike)) and os.fspath(hole) == "alpha"


@dataclass(frozen=True, eq=False)
class _Tile:
    # A part of a hole: rows and columns of the photo that it fills; the part that is laid, with its
    # surroundings; and the window that it is filled from.
    own: _Window
    laid: _Window
    window: _Window


@dataclass(frozen=True, eq=False)
class Filling:
    """A hole and the pixels to fill it from: all read and checked.

    Attributes
    ----------
    photo
        An image, or a material.
    maps
        The maps that are painted, by role.
    hole
        (H, W) missing pixels.
    used
        (H, W) pixels of the photo that blocks may show.
    sample
        The sample that blocks show instead, in the form of the photo; None: the photo.
    block
        As for `fill`.
    tiles
        The tiles in which it is filled.
    """

    photo: PixelArray | Material
    maps: Maps
    hole: NDArray[np.bool_]
    used: Used
    sample: Material | None
    block: int | None
    tiles: list[_Tile]

    @classmethod
    def of(
        cls,
        photo: Source | Sample,
        hole: Hole,
        sample: Source | Sample | None,
        block: int | None,
        notes: list[str] | None,
    ) -> "Filling":
        """Read and check all inputs; parameters as for `fill`; notes are appended to `notes`.

        Raises
        ------
        InputError
            As for `fill`.
        """
        found = _read_photo(photo, notes)
        maps = _maps_of(found)
        missing = _read_hole(hole, maps["albedo"], notes)
        if is_alpha(hole):
            maps["albedo"] = np.ascontiguousarray(maps["albedo"][:, :, :-1])
        words = "the hole" if isinstance(hole, np.ndarray) else f"hole {os.fspath(hole)!r}"
        if block is not None and not (isinstance(block, (int, np.integer)) and 8 <= block <= 512):
            raise InputError(f"block is {block!r}; allowed: 8 to 512")
        used = ~_grown(missing, _MARGIN)
        if isinstance(found, Material) and found.used is not None:
            used &= found.used
        other = None if sample is None else in_form_of(as_exemplar(sample), maps)
        tiles = _tiles(missing, used, max(block or 0, LARGEST_BLOCK), other)
        for tile in tiles if other is None else ():
            check_room(used[tile.window], block, words)
        if other is not None:
            check_room(
                np.ones(other.shape, np.bool_) if other.used is None else other.used, block, "the sample"
            )
        return cls(found, maps, missing, used, other, block, tiles)

    def filled(self, seed: int) -> Maps:
        """Return all maps without the hole; parameters as for `fill`."""
        maps = {role: pixels.copy() for role, pixels in self.maps.items()}
        missing, left = self.hole.copy(), list(self.tiles)
        while left:
            # Next is the tile with the most known pixels around it.
            tile = left.pop(int(np.argmin([missing[one.laid].mean() for one in left])))
            self._fill_tile(tile, maps, missing, seed)
            missing[tile.own] = False
        return maps

    def _fill_tile(self, tile: _Tile, maps: Maps, missing: NDArray[np.bool_], seed: int) -> None:
        known = ~missing
        if isinstance(self.photo, Material) and self.photo.used is not None:
            known &= self.photo.used
        round_it = Material(
            _coded({role: pixels[tile.window] for role, pixels in maps.items()}), used=known[tile.window]
        )
        exemplar = self._exemplar(round_it, self.used[tile.window])
        corner = tile.laid[0].start - tile.window[0].start, tile.laid[1].start - tile.window[1].start
        hole = missing[tile.laid]
        places = hole_places(exemplar, hole, corner, block=self.block, seed=seed)
        if exemplar.guidance.rectangles:
            places = places - exemplar.guidance.rectangles[1][:2]
        reach = _EVENED if self.sample is None else _EVENED_BESIDE
        for role, pixels in maps.items():
            source = pixels[tile.window] if self.sample is None else self.sample.maps[role]
            new = blended(pixels[tile.laid], hole, source, places, reach=reach)
            if role == "normal":
                new = unit_normal_map(new)
            here = missing[tile.own]
            inner = tuple(
                slice(own.start - laid.start, own.stop - laid.start)
                for own, laid in zip(tile.own, tile.laid, strict=True)
            )
            pixels[tile.own][here] = new[inner][here]

    def _exemplar(self, round_it: Material, used: Used) -> Exemplar:
        if self.sample is None:
            return Exemplar(round_it.matched(), used)
        other = Material(_coded(self.sample.maps), used=self.sample.used)
        whole, rectangles = combined([round_it, other])
        shown = np.ones(whole.shape, np.bool_) if whole.used is None else whole.used.copy()
        row, column, height, width = rectangles[0]
        # Blocks show none of the photo; their largest size follows from every zone.
        shown[row : row + height, column : column + width] = True
        return Exemplar(whole.matched(), shown, Guidance(rectangles=rectangles))


def _read_photo(photo: Source | Sample, notes: list[str] | None) -> PixelArray | Material:
    # An image may be larger than a sample may.
    if isinstance(photo, (str, os.PathLike)) and not (os.path.isdir(photo) or is_zip(photo)):
        return check_exemplar(read_image(sample_path(photo), notes=notes), largest=_LARGEST)
    if isinstance(photo, np.ndarray):
        return check_exemplar(photo, largest=_LARGEST)
    found = read_source(photo, notes=notes)
    if notes is not None and isinstance(found, Material):
        notes.extend(found.notes)
    return found


def _read_hole(hole: Hole, albedo: PixelArray, notes: list[str] | None) -> NDArray[np.bool_]:
    height, width = albedo.shape[:2]
    if isinstance(hole, np.ndarray):
        words, mask = "hole", hole if hole.ndim != 2 else hole[:, :, None]
        if mask.ndim != 3 or not (mask.dtype.kind in "bf" or mask.dtype in (np.uint8, np.uint16)):
            raise InputError(f"hole has shape {hole.shape}, {hole.dtype}; allowed: (H, W) bool, or an image")
    else:
        words = f"hole {path_text(hole, 'hole')!r}"
        alpha = alpha_channel(albedo.shape[2])
        if is_alpha(hole):
            if alpha is None:
                raise InputError("hole is 'alpha', and the photo has none; allowed: a mask's file")
            mask = albedo[:, :, alpha:]
        else:
            mask = read_image(hole, colors=False, notes=notes)
    if mask.shape[:2] != (height, width):
        raise InputError(
            f"{words} is {mask.shape[1]}x{mask.shape[0]} pixels; allowed: {width}x{height}, as the photo"
        )
    white: NDArray[np.bool_] = np.asarray(mask.any(axis=2)) if mask.dtype == np.bool_ else is_white(mask)
    found = ~white if is_alpha(hole) else white
    if not found.any() or found.all():
        extent = "everything" if found.any() else "nothing"
        raise InputError(f"{words} is {extent}; allowed: a mask that is white where pixels are missing")
    return found


def _coded(maps: Mapping[str, PixelArray]) -> Maps:
    # Maps for matching: light in perceptual coding; a window's brightness is not limited.
    return {
        role: from_linear(pixels, np.uint16) if role in COLORS and pixels.dtype.kind == "f" else pixels
        for role, pixels in maps.items()
    }


def _grown(hole: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    # A hole and all pixels up to `by` rows or columns from it.
    found = hole
    for axis in (0, 1):
        ends = [(by, by) if k == axis else (0, 0) for k in (0, 1)]
        wide = np.pad(found, ends)
        parts = [np.take(wide, range(k, k + hole.shape[axis]), axis) for k in range(2 * by + 1)]
        found = np.logical_or.reduce(parts)
    return found


def _tiles(hole: NDArray[np.bool_], used: Used, margin: int, sample: Material | None) -> list[_Tile]:
    spans = []
    for axis in (0, 1):
        at = np.flatnonzero(hole.any(axis=1 - axis))
        first, last = int(at[0]), int(at[-1]) + 1
        ends = np.linspace(first, last, -(-(last - first) // _TILE) + 1).astype(int).tolist()
        spans.append([slice(a, b) for a, b in pairwise(ends)])
    found = []
    for own in [(rows, columns) for rows in spans[0] for columns in spans[1]]:
        if hole[own].any():
            laid = _around(own, margin, hole.shape)
            window = laid
            for reach in _REACHES if sample is None else ():
                window = _around(laid, reach, hole.shape)
                if np.count_nonzero(used[window]) >= np.count_nonzero(hole[window]):
                    break
            found.append(_Tile(own, laid, window))
    if sample is not None:
        width = max(tile.window[1].stop - tile.window[1].start for tile in found)
        most = MAX_SIDE - width - 64
        if sample.shape[1] > most:
            raise InputError(f"sample is {sample.shape[1]} pixels wide; allowed: up to {most} with this hole")
    return found


def _around(window: _Window, by: int, shape: Sequence[int]) -> _Window:
    # A window and `by` pixels around it, inside an image, which has at least 32 each way.
    rows, columns = (
        slice(max(0, one.start - by), min(size, one.stop + by))
        for one, size in zip(window, shape, strict=True)
    )
    return rows, columns
