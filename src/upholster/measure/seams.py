"""Whether seams show: differences across them over differences elsewhere."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.measure.copies import copy_labels, copy_maps, quilt_windows
from upholster.measure.samples import SEED, coded
from upholster.synthesis import Chart, Quilt, Texels
from upholster.types import PixelArray

__all__ = ["cut_seam_ratio", "edge_seam_ratio"]

LINES = 16
MOST_EDGES = 4096
MOST_PAIRS = 2**18
BAND = 256

Index = NDArray[np.int64]


@dataclass
class _Mean:
    """A mean of absolute differences, added up part by part."""

    total: float = 0.0
    count: int = 0

    def add(self, one: PixelArray, other: PixelArray) -> None:
        self.total += float(np.abs(coded(one) - coded(other)).sum(dtype=np.float64))
        self.count += one.size

    def over(self, other: "_Mean") -> float | None:
        """Return this mean over another: None if there is nothing here, 1 where there is no difference."""
        if not self.count or not other.count:
            return None
        here, there = self.total / self.count, other.total / other.count
        if there == 0:
            return 1.0 if here == 0 else float("inf")
        return here / there


def edge_seam_ratio(surface: Surface, texels: Texels) -> float | None:
    """Measure whether the edges of charts show.

    The mean absolute difference between the texels on both sides of shared edges, over the same between
    neighbouring texels along random lines parallel to those edges inside the charts. Values are sRGB-coded,
    all channels weigh alike. Each texel at an edge is compared with the nearest one across it, from either
    side: 1.0 is invisible, more shows, less is blur. At most 4096 edges and some 2^18 pairs are looked at.

    Parameters
    ----------
    surface
        What the charts lie on: says which edges meet.
    texels
        The result.

    Returns
    -------
    float or None
        The ratio, 0 or more; 1.0 where neither shows any difference, infinite where only the edges do; None
        without shared edges.

    Raises
    ------
    InputError
        If a chart names a patch that the surface does not have.

    References
    ----------
    The quotient of the boundary's gradient and the interior's is the usual blocking measure: Wang, Sheikh,
    Bovik: No-reference perceptual quality assessment of JPEG compressed images, ICIP 2002, eq. 1 and 3.
    """
    charts = texels.charts
    on_patch: dict[int, list[int]] = defaultdict(list)
    for index, chart in enumerate(charts):
        if not 0 <= chart.patch < len(surface.patches):
            raise InputError(
                f"chart {index} lies on patch {chart.patch}; the surface has 0 to {len(surface.patches) - 1}"
            )
        on_patch[chart.patch].append(index)
    rng = np.random.default_rng(SEED)
    edges = rng.permutation(4 * len(charts))[:MOST_EDGES]
    most = max(64, MOST_PAIRS // len(edges))
    across, inside = _Mean(), _Mean()
    for index, edge in zip((edges // 4).tolist(), (edges % 4).tolist(), strict=True):
        own = texels.arrays[index]
        extent = own.shape[0] if edge in (0, 2) else own.shape[1]
        depths = rng.integers(0, max(1, extent - 1), LINES)
        for along, other, other_edge, there in _facing(surface, charts, on_patch, index, edge):
            chosen = rng.permutation(len(along))[:most]
            at = along[chosen]
            beyond = _line(texels.arrays[other], other_edge, np.zeros(1, np.int64), there[chosen])
            across.add(_line(own, edge, np.zeros(1, np.int64), at), beyond)
            if extent > 1:
                inside.add(_line(own, edge, depths, at), _line(own, edge, depths + 1, at))
    return across.over(inside)


def cut_seam_ratio(quilt: Quilt, texels: Texels) -> float | None:
    """Measure whether the borders between blocks show inside charts.

    The mean absolute difference between neighbouring texels (right and lower) that do not continue one
    another in the exemplar, over the same between all neighbouring texels. A blended border counts where the
    greater weight changes. Values are sRGB-coded, all channels weigh alike: 1.0 is invisible, more shows,
    less is blur. At most 8 Mtexels are looked at.

    Parameters
    ----------
    quilt
        Says which placement gives each texel most of its colour.
    texels
        The quilt, painted.

    Returns
    -------
    float or None
        The ratio, 0 or more; 1.0 where neither shows any difference, infinite where only the borders do; None
        without borders.

    Raises
    ------
    InputError
        If the texels do not have the quilt's charts.

    References
    ----------
    As for `edge_seam_ratio`.
    """
    if texels.charts != quilt.charts:
        raise InputError("texels have other charts than the quilt; allowed: the quilt's own, painted")
    maps = copy_maps(quilt)
    cuts, everywhere = _Mean(), _Mean()
    for window in quilt_windows(quilt):
        labels = copy_labels(quilt, window, maps)
        pixels = window.of(texels.arrays[window.index])
        for start in range(0, window.height, BAND):
            # One row more than the band: the lower neighbours of its last row.
            part, label = pixels[start : start + BAND + 1], labels[start : start + BAND + 1]
            rows = min(BAND, window.height - start)
            right = (part[:rows, :-1], part[:rows, 1:], label[:rows, :-1], label[:rows, 1:])
            lower = (part[:-1], part[1:], label[:-1], label[1:])
            for one, other, label_one, label_other in (right, lower):
                cut = (label_one != label_other) & (label_one >= 0) & (label_other >= 0)
                cuts.add(one[cut], other[cut])
                everywhere.add(one, other)
    return cuts.over(everywhere)


def _facing(
    surface: Surface, charts: Sequence[Chart], on_patch: dict[int, list[int]], index: int, edge: int
) -> Iterator[tuple[Index, int, int, Index]]:
    """Find what lies across an edge of a chart.

    Yields texels along the edge, the chart that faces them, its edge, and the texels along that edge.
    """
    chart = charts[index]
    line, low, high, count = _edge_of(chart, edge)
    centres = low + (high - low) * (np.arange(count) + 0.5) / count
    border = 0.0 if edge in (0, 3) else 1.0
    if line != border:  # inside its patch: the next chart of the same patch
        yield from _on_edge(charts, on_patch[chart.patch], (edge + 2) % 4, line, centres, np.arange(count))
        return
    for there in surface.neighbours(chart.patch, edge):
        along = np.flatnonzero((centres >= there.start) & (centres < there.stop))
        slope = (there.other_stop - there.other_start) / (there.stop - there.start)
        where = there.other_start + slope * (centres[along] - there.start)
        line = 0.0 if there.other_edge in (0, 3) else 1.0
        members = on_patch.get(there.other_patch, [])
        yield from _on_edge(charts, members, there.other_edge, line, where, along)


def _on_edge(
    charts: Sequence[Chart],
    members: list[int],
    edge: int,
    line: float,
    where: NDArray[np.float64],
    along: Index,
) -> Iterator[tuple[Index, int, int, Index]]:
    """Find the charts among `members` whose edge lies on a line of the patch, and their texels at `where`."""
    for other in members:
        own_line, low, high, count = _edge_of(charts[other], edge)
        if own_line != line:
            continue
        here = (where >= low) & (where <= high)
        texel = np.clip(((where[here] - low) / (high - low) * count).astype(np.int64), 0, count - 1)
        if len(texel):
            yield along[here], other, edge, texel


def _edge_of(chart: Chart, edge: int) -> tuple[float, float, float, int]:
    """Return where an edge of a chart lies: its line, the parameters it spans, its texels."""
    if edge in (0, 2):
        return (chart.s0 if edge == 0 else chart.s1), chart.t0, chart.t1, chart.width
    return (chart.t0 if edge == 3 else chart.t1), chart.s0, chart.s1, chart.height


def _line(array: PixelArray, edge: int, depths: Index, along: Index) -> PixelArray:
    """Return texels (depths, along, C) of a chart, counted from one of its edges inward."""
    height, width = array.shape[:2]
    across = depths[:, None]
    rows, columns = (
        (across, along),
        (along, width - 1 - across),
        (height - 1 - across, along),
        (along, across),
    )[edge]
    found: PixelArray = array[rows, columns]
    return found
