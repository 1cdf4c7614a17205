"""Maps of pictures: an image over the surface, and the colours of a model's vertices."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.maps._map_kernels import look_up
from upholster.charts.maps.map_ground import AtSteps, MapGround, Steps
from upholster.charts.maps.map_source import MapSource
from upholster.geometry.patches.surface import Surface
from upholster.image.color import alpha_channel
from upholster.image.files.read import read_image

__all__ = ["Image", "VertexColors"]

Coordinates = Callable[[Steps], FloatArray]
"""A function from steps to (u, v) on the image, (n, 2): 0 to 1, to the right and downward; NaN without
any."""


@dataclass(frozen=True)
class Image(MapSource):
    """An image over a flat texture, over each face of patches, or by a model's texture coordinates."""

    file: str

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it reads."""
        return (self.file,)

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values: bilinear means of the pixels that are not clear."""
        coordinates, repeats = _coordinates(self.file, ground)
        pixels = _pixels(self.file)
        grey = pixels[..., : alpha_channel(pixels.shape[2])].mean(axis=2, dtype=np.float32)
        grey = np.clip(grey / _top(pixels), 0.0, 1.0)
        clear = _clear(pixels)
        if clear is not None:
            grey[clear] = np.nan

        def at(steps: Steps) -> NDArray[np.float32]:
            out = np.empty(len(steps.triangles), np.float32)
            look_up(grey, coordinates(steps), repeats, out)
            return out

        return at

    def codes(self, ground: MapGround, /) -> AtSteps:
        """Return a function for labels: those of the nearest pixels."""
        coordinates, repeats = _coordinates(self.file, ground)
        labels = _labels(_pixels(self.file))

        def at(steps: Steps) -> NDArray[np.int32]:
            uv = coordinates(steps)
            known = np.isfinite(uv).all(axis=1)
            out = np.full(len(uv), -1, np.int32)
            size = labels.shape[::-1]
            column, row = np.floor(_within(uv[known], repeats) * size).astype(np.int64).T
            out[known] = labels[np.minimum(row, size[1] - 1), np.minimum(column, size[0] - 1)]
            return out

        return at


@dataclass(frozen=True)
class VertexColors(MapSource):
    """The colours of a model's vertices in its file."""

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values: means of red, green and blue."""
        grey = _vertex_colors(ground).mean(axis=2, dtype=np.float64, keepdims=True)
        return lambda steps: steps.mean_of(grey)[:, 0]

    def codes(self, ground: MapGround, /) -> AtSteps:
        """Return a function for labels: those of the nearest vertices."""
        colors = _vertex_colors(ground)
        labels = np.nan_to_num(np.rint(colors * 255)).astype(np.int32) @ np.array(
            [1 << 16, 1 << 8, 1], np.int32
        )
        labels[np.isnan(colors).any(axis=2)] = -1
        return lambda steps: steps.nearest_of(labels)


def _vertex_colors(ground: MapGround) -> NDArray[np.float32]:
    """Return the colours at the triangles' corners, (T, 3, 3).

    Raises
    ------
    InputError
        If the model has no vertex colours.
    """
    colors = None if ground.model is None else ground.model.colors
    if colors is None or not np.isfinite(colors[ground.charted.chart >= 0]).any():
        raise InputError(
            "map 'colors' is for the colours of a model's vertices, and this surface has no colours; "
            "allowed: other maps"
        )
    return colors


def _pixels(file: str) -> PixelArray:
    return read_image(file, colors=False)


def _top(pixels: PixelArray) -> np.float32:
    return np.float32(1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max)


def _clear(pixels: PixelArray) -> NDArray[np.bool_] | None:
    """Return which pixels are clear, (H, W); None where the image has no alpha."""
    alpha = alpha_channel(pixels.shape[2])
    return None if alpha is None else np.asarray(pixels[..., alpha] <= 0)


def _labels(pixels: PixelArray) -> NDArray[np.int32]:
    """Return 0xRRGGBB of each pixel, (H, W), −1 where it is clear."""
    colors = pixels[..., : alpha_channel(pixels.shape[2])]
    if colors.dtype != np.uint8:
        colors = np.rint(np.clip(colors / _top(pixels), 0.0, 1.0) * 255).astype(np.uint8)
    red, green, blue = (colors[..., min(k, colors.shape[2] - 1)].astype(np.int32) for k in range(3))
    out: NDArray[np.int32] = red << 16 | green << 8 | blue
    clear = _clear(pixels)
    if clear is not None:
        out[clear] = -1
    return out


def _coordinates(file: str, ground: MapGround) -> tuple[Coordinates, bool]:
    """Return a function for the steps' places on an image, and whether the image repeats beyond its borders.

    Raises
    ------
    InputError
        If a model has no texture coordinates.
    """
    charted = ground.charted
    if ground.is_flat:
        return lambda steps: steps.places[:, ::-1] / (steps.chart.width, steps.chart.height), charted.is_tile
    if isinstance(ground.surface, Surface):
        return _on_face(ground.surface), False
    uv = charted.mesh.uv if ground.model is None else ground.model.uv
    if uv is None or not np.isfinite(uv[charted.chart >= 0]).any():
        raise InputError(
            f"map {file!r} is an image, and this model has no texture coordinates to place it; "
            "allowed: maps that need none, such as facing:z"
        )
    corners = np.array(uv, np.float64)
    return lambda steps: steps.mean_of(corners), True


def _on_face(surface: Surface) -> Coordinates:
    def coordinates(steps: Steps) -> FloatArray:
        chart, face = steps.chart, surface.faces[steps.chart.face]
        down, right = steps.places.T / ((chart.height,), (chart.width,))
        s, t = chart.s0 + (chart.s1 - chart.s0) * down, chart.t0 + (chart.t1 - chart.t0) * right
        return np.stack([t / face.columns, s / face.rows], axis=1)

    return coordinates


def _within(uv: FloatArray, repeats: bool) -> FloatArray:
    """Wrap or clamp coordinates to 0 … 1."""
    return cast(FloatArray, uv - np.floor(uv) if repeats else np.clip(uv, 0.0, 1.0))
