"""Exemplars from a folder, and pictures of models covered with them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from gallery_tools.overlay import Overlay
from upholster.base.errors import InputError
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.charts.tessellation.mesh import tessellate
from upholster.covering.synthesis import synthesize
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.patches.surface import Surface
from upholster.image.color import from_linear, to_linear
from upholster.image.files.read import read_exemplar
from upholster.model.render.camera import Camera
from upholster.model.render.picture import render
from upholster.model.textured_model import TexturedModel
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels
from upholster.quilt.painting import paint

__all__ = ["OWN", "Exemplars", "Shot", "charted", "cover", "read", "take"]

OWN = Path(__file__).resolve().parents[2] / "examples"
"""The exemplars that the project ships: what README shows can be repeated with them."""

SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".exr")
SIDE = 256


@dataclass(frozen=True)
class Exemplars:
    """The images of a folder.

    Attributes
    ----------
    folder
        Where they are.
    paths
        Sorted by name.
    """

    folder: Path
    paths: tuple[Path, ...]

    @classmethod
    def of(cls, folder: Path) -> "Exemplars":
        """Find the images of a folder.

        Raises
        ------
        InputError
            If there is no such folder, no image in it, or one that cannot be read.
        """
        if not folder.is_dir():
            raise InputError(f"folder {str(folder)!r} does not exist; allowed: a folder of images")
        paths = sorted(
            path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file()
        )
        if not paths:
            raise InputError(f"folder {str(folder)!r} holds no image; allowed: {', '.join(SUFFIXES)}")
        for path in paths:  # refused now rather than after half a minute
            try:
                read(path)
            except InputError as error:
                raise InputError(f"exemplar {path.name}: {error}") from None
        return cls(folder, tuple(paths))

    def pick(self, word: str) -> Path:
        """Return the first image whose name contains `word`, or else one that the word chooses."""
        found = [path for path in self.paths if word in path.stem]
        return found[0] if found else self.paths[sum(word.encode()) % len(self.paths)]


def read(path: Path, side: int = SIDE) -> PixelArray:
    """Read an exemplar as 8-bit RGB (side, side, 3): the middle, its shorter side brought to `side`."""
    pixels = read_exemplar(path, resize=side)
    shorter = min(pixels.shape[:2])
    if shorter < side:
        pixels = read_exemplar(path, resize=round(side * side / shorter))
    top, left = (max(0, (size - side) // 2) for size in pixels.shape[:2])
    pixels = from_linear(to_linear(pixels[top : top + side, left : left + side]), np.uint8)
    color = pixels[:, :, :3] if pixels.shape[2] > 2 else pixels[:, :, :1]
    return np.ascontiguousarray(np.broadcast_to(color, (*pixels.shape[:2], 3)))


def cover(surface: AnySurface, exemplar: PixelArray, *, quads: int = 20_000, **options: Any) -> TexturedModel:
    """Cover a surface with an exemplar; options as in `upholster.synthesize`."""
    quilt = synthesize(exemplar, surface, **options)
    return TexturedModel(surface, paint(quilt, exemplar), WriteOptions(quads=quads))


def charted(surface: Surface, arrays: Sequence[PixelArray], *, quads: int = 20_000) -> TexturedModel:
    """Put given texels, one (H, W, C) array per patch, on a surface."""
    places = [surface.place(n) for n in range(len(arrays))]
    charts = tuple(
        Chart(face, array.shape[0], array.shape[1], row, row + 1, column, column + 1)
        for (face, row, column), array in zip(places, arrays, strict=True)
    )
    return TexturedModel(surface, Texels(charts, tuple(arrays)), WriteOptions(quads=quads))


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture of a model, and what is needed to draw over it.

    Attributes
    ----------
    image
        Pillow image.
    camera
        Where it was taken from.
    depth
        (h, w) float32, see `upholster.model.render.picture.render`.
    slack
        How far behind the surface a line on it may seem to be, in model units.
    """

    image: Any
    camera: Camera
    depth: NDArray[np.float32]
    slack: float

    def overlay(self) -> Overlay:
        """Return a layer to draw on."""
        return Overlay(self.image, self.camera, self.depth, self.slack)


def take(
    subject: Surface | TexturedModel,
    *,
    size: tuple[int, int],
    view: tuple[float, float],
    supersample: int = 3,
    around: ArrayLike | None = None,
    **options: Any,
) -> Shot:
    """Take a picture of a model, or of a bare surface in clay.

    Parameters
    ----------
    subject
        What to show.
    size, view
        See `upholster.model.render.camera.Camera.fit`.
    around
        (N, 3): more points that have to be in the picture.
    options
        Of `Camera.fit` ("zoom", "target") and of `upholster.model.render.picture.render`.
    """
    if isinstance(subject, TexturedModel):
        mesh, uv, pixels = subject.mesh, subject.uv, subject.atlas.pixels
    else:
        mesh = tessellate(subject)
        uv, pixels = mesh.places, None
    points = mesh.positions if around is None else np.concatenate([mesh.positions, np.asarray(around)])
    aim = {name: options.pop(name) for name in ("zoom", "target") if name in options}
    camera = Camera.fit(points, size=size, view=view, **aim)
    depth = np.empty((size[1], size[0]), np.float32)
    picture = render(
        mesh.positions, mesh.normals, uv, mesh.all_triangles(), pixels,
        camera=camera, supersample=supersample, depth=depth, **options,
    )  # fmt: skip
    extent = float(np.ptp(mesh.positions, axis=0).max())
    return Shot(Image.fromarray(from_linear(picture, np.uint8, dither=True)), camera, depth, 0.006 * extent)
