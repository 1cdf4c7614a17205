"""A mesh with the pages of its atlas: the polygons on each, and the names of their files."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.formats import UDIM
from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.charts.tessellation.mesh import Mesh

__all__ = [
    "PageImages",
    "PagedMesh",
    "check_pages",
    "images_of",
    "page_files",
    "polygons_by_page",
    "udim_tile",
]

PageImages = PixelArray | Sequence[PixelArray]
"""The image of an atlas, or one for each of its pages."""

_TILES_IN_ROW = 10


@dataclass(frozen=True, slots=True, eq=False)
class PagedMesh:
    """A mesh with the base colour of its atlas.

    Attributes
    ----------
    mesh
        Positions in the model's unit; normals of length 1.
    uv
        (V, 2) in 0…1, v downward: on each vertex's page, see `upholster.model.atlas.Atlas.page_coordinates`.
    pixels
        (H, W, C) of the atlas: uint8, uint16 or float32. Or a list, with the image of each page.
    page
        (V,) the page that each vertex lies on, one for all vertices of a polygon; by default the first.
    metres
        Length of the model's unit, if it is known.
    """

    mesh: Mesh
    uv: FloatArray
    pixels: PageImages
    page: IntArray | None = None
    metres: float | None = None

    @property
    def images(self) -> Sequence[PixelArray]:
        """The image of each page."""
        return images_of(self.pixels)


def images_of(images: PageImages) -> Sequence[PixelArray]:
    """Return the images of an atlas's pages, as a list even if there is only one."""
    return [images] if isinstance(images, np.ndarray) else images


def page_files(path: str | os.PathLike[str], pages: int) -> tuple[Path, ...]:
    """Return the files of an atlas to be written to `path`.

    A single page uses that name; several pages of ``wall.png`` are ``wall_1.png``, ``wall_2.png`` … In a name
    with ``<UDIM>`` it is replaced by the tiles' numbers: 1001, 1002 …
    """
    target = Path(path)
    if UDIM in target.name:
        names = [target.name.replace(UDIM, str(1001 + page)) for page in range(pages)]
    elif pages == 1:
        names = [target.name]
    else:
        names = [f"{target.stem}_{page + 1}{target.suffix}" for page in range(pages)]
    return tuple(target.with_name(name) for name in names)


def udim_tile(page: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return column and row (upward) of pages among the tiles of UDIM, (..., 2): ten tiles to a row."""
    return np.stack([page % _TILES_IN_ROW, page // _TILES_IN_ROW], axis=-1)


def check_pages(count: int, page: IntArray | None, maps: Mapping[str, PageImages]) -> None:
    """Raise InputError unless every map has `count` images, and there is one for each vertex's page."""
    last = 0 if page is None else int(page.max(initial=0))
    if not last < count:
        raise InputError(f"vertices lie on page {last}; there are images of {count}")
    for role, images in maps.items():
        if len(images_of(images)) != count:
            raise InputError(f"{role} map has {len(images_of(images))} pages; allowed: {count}")


def polygons_by_page(polygons: IntArray, page: IntArray | None, count: int) -> list[IntArray]:
    """Return the polygons of each page: a polygon's page is that of its first corner."""
    if page is None or count == 1:
        return [polygons]
    on = page[polygons[:, 0]]
    return [polygons[on == number] for number in range(count)]
