"""How often the most salient places of a sample recur in the result, and how close together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface, charted_surface
from upholster.geometry import AnySurface
from upholster.measure.samples import Window, coded
from upholster.measure.trace import Trace
from upholster.quilt import Quilt
from upholster.quilt.displacement import centre_matrices
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import UNIT
from upholster.types import FloatArray, PixelArray

__all__ = ["Landmarks", "landmark_recurrence", "landmarks"]

MOST = 8
APART = 8
"""Landmarks are at least the sample's shorter side over this apart."""

BLUR = 32
"""A landmark's size is the shorter side over this."""

Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Landmarks:
    """How a sample's most salient places recur.

    Attributes
    ----------
    recurrence
        How often one of them is shown, relative to the average place of the sample, which is the result's
        area over the sample's. 1 is evenly used, 0 never.
    nearest
        Median straight-line distance from one to the nearest copy of the same place, in widths of the sample;
        a width is the square root of its area. 1 is as far apart as possible, 0.5 is random.
    nearest_5
        5th percentile of the same, for the closest copies. Both are None if nothing is shown twice.
    """

    recurrence: float
    nearest: float | None
    nearest_5: float | None


def landmarks(exemplar: PixelArray) -> Index:
    """Return the places of a sample that differ most from its usual colour: (n, 2) rows and columns, n ≤ 8.

    Colours are averaged over 1/32 of the shorter side, and weighted by their variation in the sample
    (Mahalanobis distance).
    """
    shorter = min(exemplar.shape[:2])
    size = max(1, shorter // BLUR)
    colors = coded(exemplar).astype(np.float64)
    sums = np.pad(colors.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0), (0, 0)))
    mean = (sums[size:, size:] - sums[size:, :-size] - sums[:-size, size:] + sums[:-size, :-size]) / size**2
    away = (mean - mean.mean(axis=(0, 1))).reshape(-1, mean.shape[2])
    spread = away.T @ away / len(away) + 1e-6 * np.eye(mean.shape[2])
    salience = (away @ np.linalg.inv(spread) * away).sum(axis=1).reshape(mean.shape[:2])
    found: list[tuple[int, int]] = []
    rows, columns = np.mgrid[: salience.shape[0], : salience.shape[1]]
    while len(found) < MOST and salience.max() > 0:
        row, column = divmod(int(salience.argmax()), salience.shape[1])
        found.append((row + size // 2, column + size // 2))
        salience = np.where(np.hypot(rows - row, columns - column) < shorter / APART, 0.0, salience)
    return np.array(found, np.intp).reshape(-1, 2)


def landmark_recurrence(surface: AnySurface, quilt: Quilt, exemplar: PixelArray) -> Landmarks | None:
    """Measure how often a sample's most salient places are shown, and how close together.

    Exact, from the quilt: a landmark is shown where a placement that reads there owns the cell.

    Parameters
    ----------
    surface, quilt, exemplar
        What was covered, its quilt, and its exemplar.

    Returns
    -------
    Landmarks or None
        None if the sample has no landmark.
    """
    marks = landmarks(exemplar)
    shown = [np.zeros((0, 3)) for _ in marks]
    charted = charted_surface(surface, quilt.charts)
    scales, area = [np.zeros(0)], 0.0
    for index, chart in enumerate(quilt.charts):
        owners = Trace.of(quilt, Window(index, 0, 0, chart.height, chart.width), charted).owners
        rows, columns = np.nonzero(owners[::8, ::8] >= 0)
        sizes = np.abs(np.linalg.det(_matrices(quilt, index, 8 * rows, 8 * columns)))
        area += float(sizes.sum()) * 64
        for n, mark in enumerate(marks):
            texel, points, areas = _located(charted, index, _texels(quilt, index, owners, mark))
            pixels = np.abs(np.linalg.det(_matrices(quilt, index, *texel.T)))
            shown[n] = np.concatenate([shown[n], points])
            scales.append(np.sqrt(pixels[areas > 0] / areas[areas > 0]))
    count = sum(len(points) for points in shown)
    if not len(marks) or not area:
        return None
    height, width = quilt.exemplar_shape
    recurrence = count / len(marks) * height * width / area
    near = np.concatenate([_nearest(points) for points in shown])
    if not len(near):
        return Landmarks(recurrence, None, None)
    near *= float(np.median(np.concatenate(scales))) / np.sqrt(height * width)
    return Landmarks(recurrence, float(np.median(near)), float(np.quantile(near, 0.05)))


def _texels(quilt: Quilt, index: int, owners: NDArray[np.int32], mark: Index) -> Index:
    # The texels (n, 2) of a chart at which a place of the sample is shown, each by the block that owns it.
    placed, field = quilt.on_chart(index), quilt.fields[index]
    centre = np.stack([placed["row"], placed["column"]], axis=1) / 16 - 0.5  # as steps are counted
    source = np.stack([placed["source_row"], placed["source_column"]], axis=1) / 16
    turned = SYMMETRIES[placed["symmetry"]].reshape(-1, 2, 2).transpose(0, 2, 1) @ (mark - source)[:, :, None]
    own = centre_matrices(field, placed).reshape(-1, 2, 2) / UNIT
    sound = np.abs(np.linalg.det(own)) > 0
    own[~sound] = np.eye(2)
    place = centre + np.linalg.solve(own, turned)[:, :, 0]
    # ½·(C + M(q))·(q − c) is the place minus the source: one more iteration, with M at the place found.
    mean = 0.5 * (own + field.at(place[:, 0], place[:, 1]))
    sound &= np.abs(np.linalg.det(mean)) > 0
    mean[~sound] = np.eye(2)
    texel = np.rint(centre + np.linalg.solve(mean, turned)[:, :, 0]).astype(np.intp)
    sound &= ((texel >= 0) & (texel < owners.shape)).all(axis=1)
    number = np.flatnonzero(sound)
    texel = texel[sound]
    shown: Index = texel[owners[texel[:, 0], texel[:, 1]] == number]
    return shown


def _matrices(quilt: Quilt, index: int, rows: Index, columns: Index) -> FloatArray:
    return quilt.fields[index].at(rows.astype(np.float64), columns.astype(np.float64))


def _located(charted: ChartedSurface, index: int, texel: Index) -> tuple[Index, FloatArray, FloatArray]:
    # Texels (n, 2) of a chart, their places in space, and their areas, for texels on a triangle only.
    own = np.flatnonzero(charted.chart == index)
    corners, places, steps = charted.mesh.corners[own, 0], charted.places[own], charted.steps[own]
    edges = places[:, 1:] - places[:, :1]
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    kept, points, areas = [], [], []
    for n, at in enumerate(texel + 0.5):
        away = at - places[:, 0]
        a = (away[:, 0] * edges[:, 1, 1] - away[:, 1] * edges[:, 1, 0]) / np.where(area > 0, area, 1.0)
        b = (away[:, 1] * edges[:, 0, 0] - away[:, 0] * edges[:, 0, 1]) / np.where(area > 0, area, 1.0)
        inside = np.flatnonzero((area > 0) & (a >= 0) & (b >= 0) & (a + b <= 1))
        if len(inside):
            k = int(inside[0])
            kept.append(n)
            points.append(corners[k] + steps[k] @ away[k])
            areas.append(np.linalg.norm(np.cross(steps[k, :, 0], steps[k, :, 1])))
    return texel[kept], np.array(points).reshape(-1, 3), np.array(areas)


def _nearest(points: FloatArray) -> FloatArray:
    # The distance from each point to the nearest other one; empty for a single point.
    if len(points) < 2:
        return np.zeros(0)
    found = np.empty(len(points))
    for n, point in enumerate(points):
        away = ((points - point) ** 2).sum(axis=1)
        away[n] = np.inf
        found[n] = away.min()
    return np.sqrt(found)
