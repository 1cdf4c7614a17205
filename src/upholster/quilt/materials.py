"""Painting complete materials: every map with the same quilt."""

from dataclasses import replace

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import PixelArray, Progress
from upholster.image.files.material import Material
from upholster.image.files.source import Source, as_exemplar
from upholster.image.roles import MAP_ROLES
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.normal_painting import (
    lengthen,
    paint_normals,
    turn_window,
    turned_pyramid,
    unit_normal_texels,
)
from upholster.quilt.painting import ChartPainter, check_painted, image_pyramid, paint, painted_charts
from upholster.runtime.parallel import running

__all__ = ["WindowPainter", "paint_map", "paint_material"]


def paint_material(
    quilt: Quilt,
    material: Material | Source,
    *,
    density: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Texels]:
    """Paint a quilt with all maps of a material.

    Parameters
    ----------
    quilt
        The origin of each block.
    material
        Its maps have the exemplar's height and width. Or a material's folder, or its files by role.
    density, threads, progress
        As in `upholster.quilt.painting.paint`.

    Returns
    -------
    dict
        Texels by role, each at its map's depth: "albedo", with the opacity as its alpha, then the other maps
        except opacity. Normals are in the tangent frame of `upholster.quilt.normal_painting.paint_normals`
        and have length 1, also where blocks are blended.

    Raises
    ------
    InputError
        If it is not a material, or its height or width differs from the quilt's exemplar.
    """
    if not isinstance(material, Material):
        found = as_exemplar(material)
        material = found if isinstance(found, Material) else Material({"albedo": found})
    with running(threads, progress):
        painted = {"albedo": paint(quilt, material.color(), density=density)}
        for role, pixels in material.maps.items():
            if role not in ("albedo", "opacity"):
                painted[role] = paint_map(quilt, role, pixels, density=density)
        if "normal" in painted:
            painted["normal"] = unit_normal_texels(painted["normal"])
    return painted


def paint_map(quilt: Quilt, role: str, pixels: PixelArray, *, density: float | None = None) -> Texels:
    """Paint a quilt with one map, as decoders do: normals rotate with the texture; sharp maps get no tones.

    Raises
    ------
    InputError
        As for `paint` and `paint_normals`.
    """
    work = paint_normals if role == "normal" else paint
    return work(_toned(quilt, role), pixels, density=density)


def _toned(quilt: Quilt, role: str) -> Quilt:
    """Return the quilt with which a map is painted: without tones if its values are one or the other."""
    sharp = role in MAP_ROLES and MAP_ROLES[role].is_sharp
    return replace(quilt, has_tones=False) if quilt.has_tones and sharp else quilt


class WindowPainter:
    """Paints windows of a quilt's charts with one map, one at a time, without further texels, as for a tile.

    Parameters
    ----------
    quilt
        The quilt of the charts.
    role
        The map's role: normals rotate with the texture and have length 1, as in `paint_material`.
    image
        The map, (H, W) or (H, W, C), with the height and width that the quilt was made for.
    density
        As in `upholster.quilt.painting.paint`.

    Raises
    ------
    InputError
        For a map of another height, width or dtype.
    """

    def __init__(self, quilt: Quilt, role: str, image: PixelArray, *, density: float | None = None) -> None:
        self._quilt, self._turns = _toned(quilt, role), role == "normal"
        charts = painted_charts(quilt.charts, quilt.density if density is None else density)
        image = check_painted(quilt, image)
        if image.shape[:2] != quilt.exemplar_shape:
            raise InputError(f"map {role!r} has shape {image.shape}; the quilt wants {quilt.exemplar_shape}")
        if self._turns:
            pyramid, which = turned_pyramid(quilt, image, density)
        else:
            pyramid, which = image_pyramid((image,), quilt, density), None
        self._painters = [
            ChartPainter(self._quilt, n, chart, pyramid, which) for n, chart in enumerate(charts)
        ]

    def paint(self, index: int, window: tuple[slice, slice] | None = None) -> PixelArray:
        """Return a window of chart `index`, given as rows and columns in texels; None: the complete chart."""
        painter = self._painters[index]
        chart, pyramid = painter.painted, painter.pyramid
        window = window or (slice(0, chart.height), slice(0, chart.width))
        shape = (window[0].stop - window[0].start, window[1].stop - window[1].start, pyramid.channels)
        out = np.zeros(shape, pyramid.dtype)
        painter.paint(window, out)
        if self._turns:
            turn_window(self._quilt, index, chart, window, out)
            lengthen(out)
        return out
