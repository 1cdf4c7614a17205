"""Where charts meet.

Charts are rectangles of faces, of any size. They meet across shared edges of faces and inside a face, along
complete sides or parts of sides.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from upholster.base.errors import InputError
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

__all__ = ["ChartSeam", "find_seams"]

EPS = 1e-6
"""In face parameters: lines closer than this count as one, and shorter intervals are ignored."""

Part = tuple[float, float, int]
"""A chart's part of a line: from, to (in the face's parameter along the line), and the chart's index."""


@dataclass(frozen=True, slots=True)
class ChartSeam:
    """An interval of a chart's edge, and the interval of another chart's edge (or of its own) that meets it.

    Edge numbers: 0 top, 1 right, 2 bottom, 3 left. A place along an edge is given in texels from the chart's
    first row or column line: 0 to the chart's height or width, so texel k's centre is at k + ½. The map
    between the two intervals is linear.

    Attributes
    ----------
    chart, edge
        The chart and the edge that the interval is on.
    start, stop
        The interval, start < stop.
    other_chart, other_edge
        The chart and the edge on the other side.
    other_start, other_stop
        The places that meet `start` and `stop`: other_start > other_stop where the two edges run in opposite
        directions.
    """

    chart: int
    edge: int
    start: float
    stop: float
    other_chart: int
    other_edge: int
    other_start: float
    other_stop: float

    def flipped(self) -> "ChartSeam":
        """Return the same seam seen from the other side."""
        ends = sorted([(self.other_start, self.start), (self.other_stop, self.stop)])
        (start, other_start), (stop, other_stop) = ends
        return ChartSeam(
            self.other_chart, self.other_edge, start, stop, self.chart, self.edge, other_start, other_stop
        )


def find_seams(surface: Surface, charts: Sequence[Chart]) -> tuple[ChartSeam, ...]:
    """Find every interval along which two charts meet, seen from both sides.

    Parameters
    ----------
    surface
        The surface.
    charts
        Rectangles of its faces that do not overlap.

    Returns
    -------
    tuple of ChartSeam
        Each seam twice, once from each side; sorted by chart, edge and start. Borders and degenerate edges
        have none.

    Raises
    ------
    InputError
        If a chart's face does not exist, or it has no texels or is not a rectangle within its face; and as
        for `Surface.shared`.
    """
    _check(surface, charts)
    sides = _sides(surface, charts)
    found: list[ChartSeam] = []

    def meet(a: int, b: int, mine: list[Part], others: list[Part], ends: tuple[float, ...]) -> None:
        for one, other, part in _common(mine, others, ends):
            start, stop = _texels(charts[one], a, part[:2])
            other_start, other_stop = _texels(charts[other], b, part[2:])
            seam = ChartSeam(one, a, start, stop, other, b, other_start, other_stop)
            found.extend((seam, seam.flipped()))

    for (index, edge, line), mine in sides.items():
        face = surface.faces[index]
        most, long = (face.columns, face.rows) if edge & 1 else (face.rows, face.columns)
        if edge in (1, 2) and line < most:  # each line inside a face once, from its upper or left charts
            others = sides.get((index, (edge + 2) % 4, line), [])
            meet(edge, (edge + 2) % 4, mine, others, (0.0, long, 0.0, long))
    for shared in surface.face_shared:
        a, b = shared.edge, shared.other_edge
        mine, others = (
            sides.get((index, edge, surface.faces[index].line(edge)), [])
            for index, edge in ((shared.face, a), (shared.other_face, b))
        )
        meet(a, b, mine, others, (shared.start, shared.stop, shared.other_start, shared.other_stop))
    return tuple(sorted(found, key=lambda m: (m.chart, m.edge, m.start)))


def _check(surface: Surface, charts: Sequence[Chart]) -> None:
    last = len(surface.faces) - 1
    for n, c in enumerate(charts):
        if not 0 <= c.face <= last:
            raise InputError(f"chart {n} lies on face {c.face}; allowed: 0 to {last}")
        face = surface.faces[c.face]
        if c.height < 1 or c.width < 1:
            raise InputError(f"chart {n} has {c.height} x {c.width} texels; allowed: 1 or more each way")
        for low, high, most in ((c.s0, c.s1, face.rows), (c.t0, c.t1, face.columns)):
            if not (low >= 0.0 and high <= most and high - low > 2 * EPS):
                raise InputError(
                    f"chart {n} reaches from {low:.17g} to {high:.17g}; allowed: rising, 0 to {most}, "
                    f"more than {2 * EPS:g} apart"
                )


def _sides(surface: Surface, charts: Sequence[Chart]) -> dict[tuple[int, int, float], list[Part]]:
    """Return the charts' sides by face, edge and the parameter of their line, sorted along it."""
    lines: dict[tuple[int, int], list[float]] = defaultdict(list)
    for c in charts:
        lines[c.face, 0] += (c.s0, c.s1)
        lines[c.face, 1] += (c.t0, c.t1)
    names = {}
    for (index, axis), values in lines.items():
        face = surface.faces[index]
        names[index, axis] = dict(_merged(values, float(face.columns if axis else face.rows)))
    sides: dict[tuple[int, int, float], list[Part]] = defaultdict(list)
    for n, c in enumerate(charts):
        for edge, (line, low, high) in enumerate(
            ((c.s0, c.t0, c.t1), (c.t1, c.s0, c.s1), (c.s1, c.t0, c.t1), (c.t0, c.s0, c.s1))
        ):
            sides[c.face, edge, names[c.face, edge & 1][line]].append((low, high, n))
    for parts in sides.values():
        parts.sort()
    return dict(sides)


def _merged(values: list[float], most: float) -> Iterator[tuple[float, float]]:
    """Yield each value with its name, the same for values within `EPS`; at the far end the name is `most`."""
    name = 0.0
    for value in sorted(values):
        if value - name > EPS:
            name = most if value >= most - EPS else value
        yield value, name


def _common(
    mine: list[Part], others: list[Part], ends: tuple[float, ...]
) -> Iterator[tuple[int, int, tuple[float, float, float, float]]]:
    """Yield the overlaps of two rows of parts: both charts, and the interval on each, ends corresponding.

    `ends` are (start, stop, other_start, other_stop): only overlaps within them count; the map is linear.
    """
    start, stop, other_start, other_stop = ends
    slope = (other_stop - other_start) / (stop - start)
    least = EPS * max(1.0, 1.0 / abs(slope))
    # The other parts in this side's parameter, sorted. They do not overlap, so the last one that begins
    # before a part is the first to compare with it.
    moved = [tuple(sorted(start + (u - other_start) / slope for u in part[:2])) + part for part in others]
    moved.sort()
    begins = [part[0] for part in moved]
    for low, high, one in mine:
        at = max(0, bisect_left(begins, low) - 1)
        for from_, to, other_low, other_high, other in moved[at:]:
            if from_ >= high:
                break
            a, b = max(low, from_, start), min(high, to, stop)
            if b - a > least:
                c, d = (min(max(other_start + slope * (u - start), other_low), other_high) for u in (a, b))
                yield one, int(other), (a, b, c, d)


def _texels(chart: Chart, edge: int, ends: tuple[float, ...]) -> tuple[float, float]:
    """Convert face parameters along a chart's edge to texels along it."""
    low, high, size = (chart.s0, chart.s1, chart.height) if edge & 1 else (chart.t0, chart.t1, chart.width)
    first, last = ((u - low) / (high - low) * size for u in ends)
    return first, last
