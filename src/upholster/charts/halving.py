"""Where patches are cut into charts, so that texels come out about equally large all over each chart."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

import numpy as np

from upholster.geometry import Surface
from upholster.types import FloatArray

__all__ = ["MOST_HALVINGS", "Halving", "Interval"]

MOST_HALVINGS = 4
"""A patch's smallest chart is what is left of it after so many halvings, both ways together."""

WANTED = np.log(2.0)
"""No more cuts once texel area's 99th over its 1st percentile is below the exponential of this."""

ALONE = 0.75
"""How much cutting a patch alone counts, against going on through its neighbours: T-junctions cost."""

AT_ONCE = 0.7
"""Cuts that are nearly as good as the best one are made with it."""

BINS = 256
"""Of a histogram of log texel area over its chart's typical one, from −4 to 4."""

Interval = tuple[int, int, int, int]
"""(patch, axis, first, last): samples first to last of a patch along s (axis 0) or t (axis 1)."""


class Halving:
    """The cuts of all patches, and what they are decided by: the area element, sampled evenly.

    A patch is cut along whole parameter lines, into a grid of charts. A cut goes on through the
    patches that it meets across whole shared edges where that does about as much good there, so that charts
    meet along whole sides.

    Attributes
    ----------
    samples
        Per patch and direction: 32 on few patches, 8 on very many.
    cuts
        Per patch, for s and t: where its intervals begin, in samples; the first at 0.
    whole
        (patches, 2) float64: typical height and width of each patch, in model units.
    """

    def __init__(self, surface: Surface) -> None:
        patches = surface.patches
        self.samples = n = 32 if len(patches) <= 1024 else 16 if len(patches) <= 8192 else 8
        # Per patch: the area element, log |S_s|, log |S_t|, log of the area element.
        self.area = np.empty((len(patches), n, n))
        self.logs = np.empty((len(patches), 3, n, n))
        middle = (np.arange(n) + 0.5) / n
        for index, patch in enumerate(patches):
            _, by_s, by_t = patch.derivatives_grid(middle, middle)
            down, right = (np.einsum("ijk,ijk->ij", v, v) for v in (by_s, by_t))
            both = np.einsum("ijk,ijk->ij", by_s, by_t)
            self.area[index] = np.sqrt(np.maximum(down * right - both * both, 0))
            self.logs[index, 0], self.logs[index, 1] = down, right
        # A pole's derivative vanishes, and so does its weight: any finite logarithm does.
        least = 1e-60 * surface.size**2
        self.logs[:, :2] = 0.5 * np.log(np.maximum(self.logs[:, :2], least))
        self.logs[:, 2] = np.log(np.maximum(self.area, least))
        self.cuts: list[tuple[list[int], list[int]]] = [([0], [0]) for _ in patches]
        self.whole = np.concatenate([self.extents(patch) for patch in range(len(patches))])
        self._links = _links(surface)

    @property
    def total_area(self) -> float:
        """The surface's area, in squared model units."""
        return float(self.area.sum()) / self.samples**2

    def even_out(self, density: float, smallest: int, thinnest: int) -> int:
        """Cut patches until texels are about equally large, as far as charts may not become too small.

        Greedy: the cuts that take most of the area-weighted fourth power of log texel area over the wanted
        one, per chart that they add; then cuts that turned out needless are taken back. If charts of
        `smallest` texels do not reach it, smaller ones are tried.

        Parameters
        ----------
        density
            Texels per model unit.
        smallest, thinnest
            Least height and width of a chart in texels, as for `density_layout`.

        Returns
        -------
        int
            The least height and width that it took: `thinnest` to `smallest`.
        """
        tried = []
        for least in sorted({smallest, (smallest + thinnest) // 2, thinnest}, reverse=True):
            self.cuts = [([0], [0]) for _ in self.cuts]
            tried.append((self._greedy(density, least, thinnest), least, self.cuts))
            if tried[-1][0] <= WANTED:
                return least
        # Many more charts are not worth a little evenness.
        costs = [
            round(spread + 0.5 * np.log(sum(len(r) * len(c) for r, c in cuts)), 6)
            for spread, _, cuts in tried
        ]
        _, least, self.cuts = tried[int(np.argmin(costs))]
        return least

    def _greedy(self, density: float, smallest: int, thinnest: int) -> float:
        """Cut, and return the logarithm of the spread that is reached."""
        self._least = np.log(self.samples / density * np.clip(self.whole * density, thinnest, smallest))
        made: list[frozenset[Interval]] = []
        histogram = self._histogram(range(len(self.cuts)))
        gains: dict[Interval, float] = {}
        changed = set(range(len(self.cuts)))
        while _spread(histogram) > WANTED:
            gains |= {one: self._gain(one) for patch in sorted(changed) for one in self._intervals(patch)}
            best = self._best(gains)
            if not best:
                break
            changed = set()
            for cut in best:
                touched = {patch for patch, *_ in cut}
                if touched.isdisjoint(changed):
                    histogram += self._changed(cut, self.cut, touched)
                    made.append(cut)
                    changed |= touched
                    for interval in cut:
                        del gains[interval]
        limit = max(WANTED, _spread(histogram) + 0.01)
        for cut in reversed(made):
            # Only a cut that no later one goes through can be taken back.
            if all(self._whole_again(interval) for interval in cut):
                touched = {patch for patch, *_ in cut}
                histogram += self._changed(cut, self.join, touched)
                if _spread(histogram) > limit:
                    histogram += self._changed(cut, self.cut, touched)
        return _spread(histogram)

    def fellows(self, interval: Interval) -> frozenset[Interval]:
        """Return the interval and those that a cut through it would go on to, across whole shared edges."""
        found, queue = {interval}, [interval]
        while queue:
            patch, axis, first, last = queue.pop()
            for other, across, opposed in self._links.get((patch, axis), ()):
                ends = (self.samples - last, self.samples - first) if opposed else (first, last)
                fellow = (other, across, *ends)
                if fellow not in found and fellow in self._intervals(other):
                    found.add(fellow)
                    queue.append(fellow)
        return frozenset(found)

    def cut(self, intervals: Iterable[Interval]) -> None:
        """Halve intervals."""
        for patch, axis, first, last in intervals:
            cuts = self.cuts[patch][axis]
            cuts.append((first + last) // 2)
            cuts.sort()

    def join(self, intervals: Iterable[Interval]) -> None:
        """Take halvings back."""
        for patch, axis, first, last in intervals:
            self.cuts[patch][axis].remove((first + last) // 2)

    def extents(self, patch: int) -> FloatArray:
        """Return the typical height and width of each of a patch's charts, in model units.

        They are area-weighted geometric means of the derivatives' lengths, corrected for the angle between
        them, so that their product is the typical area.

        Returns
        -------
        ndarray
            (charts, 2) float64, row by row.
        """
        down, right, element = _means(self.area[patch], self.logs[patch], *self.cuts[patch])
        sine = 0.5 * (element - down - right)
        spans = [np.diff([*c, self.samples]) / self.samples for c in self.cuts[patch]]
        sizes = np.exp(down + sine) * spans[0][:, None], np.exp(right + sine) * spans[1]
        return np.stack(sizes, axis=-1).reshape(-1, 2)

    def _intervals(self, patch: int) -> Iterator[Interval]:
        for axis in (0, 1):
            for first, last in pairwise([*self.cuts[patch][axis], self.samples]):
                yield patch, axis, first, last

    def _gain(self, interval: Interval) -> float:
        """Return how much better halving an interval makes its own patch; −∞ where it must not be halved."""
        patch, axis, first, last = interval
        n, size = self.samples, last - first
        across = self.cuts[patch][1 - axis]
        finest = size * min(b - a for a, b in pairwise([*across, n])) // 2
        if size < 2 or finest << MOST_HALVINGS < n * n:
            return -np.inf
        # Charts about as small as may be are not worth a try, and there may be very many of them.
        if np.log(self.whole[patch, axis] * size) < self._least[patch, axis] + 0.4:
            return -np.inf
        area, logs, least = self.area[patch], self.logs[patch], self._least[patch]
        if axis:
            area, logs, least = area.T, logs[[1, 0, 2]].transpose(0, 2, 1), least[::-1]
        area, logs = area[first:last], logs[:, first:last]
        before = _deviation(area, logs, [0], across, least) ** 2
        after = _deviation(area, logs, [0, size // 2], across, least) ** 2
        return float((area * (before * before - after * after)).sum())

    def _best(self, gains: dict[Interval, float]) -> list[frozenset[Interval]]:
        """Return what to cut next, best first: intervals with their fellows or alone."""
        found = []
        seen: set[Interval] = set()
        for interval in sorted(one for one, gain in gains.items() if gain > 0):
            choices = [(ALONE, frozenset([interval]))]
            if interval not in seen:
                together = self.fellows(interval)
                seen |= together
                choices.append((1.0, together))
            for weight, chosen in choices:
                charts = sum(len(self.cuts[patch][1 - axis]) for patch, axis, *_ in chosen)
                gain = weight * sum(gains[one] for one in sorted(chosen)) / charts
                # Patches that are mirror images differ by rounding only, which must not decide anything.
                found.append((float(f"{max(gain, 0):.6g}"), chosen))
        found.sort(key=lambda one: -one[0])
        least = max(1e-9 * float(self.area.sum()), AT_ONCE * found[0][0]) if found else 0
        return [chosen for gain, chosen in found if gain > least]

    def _whole_again(self, interval: Interval) -> bool:
        patch, axis, first, last = interval
        return [c for c in self.cuts[patch][axis] if first < c < last] == [(first + last) // 2]

    def _histogram(self, patches: Iterable[int]) -> FloatArray:
        """Return how much area has which log texel area."""
        total = np.zeros(BINS)
        for patch in patches:
            rows, columns = self.cuts[patch]
            x = _deviation(self.area[patch], self.logs[patch], rows, columns, self._least[patch])
            place = np.clip((x + 4) * (BINS / 8), 0, BINS - 1).astype(np.intp)
            total += np.bincount(place.ravel(), self.area[patch].ravel(), BINS)
        return total

    def _changed(
        self,
        intervals: frozenset[Interval],
        how: Callable[[Iterable[Interval]], None],
        patches: set[int],
    ) -> FloatArray:
        """Cut or join, and return how that changes the histogram."""
        order = sorted(patches)
        before = self._histogram(order)
        how(intervals)
        return self._histogram(order) - before


def _links(surface: Surface) -> dict[tuple[int, int], list[tuple[int, int, bool]]]:
    """Tell, per patch and axis, where its cuts go on: (patch, axis, whether it runs the other way)."""
    links: dict[tuple[int, int], list[tuple[int, int, bool]]] = defaultdict(list)
    for seam in surface.shared:
        if seam.whole:
            for one in (seam, seam.flipped()):
                # Edges 0 and 2 run along t, edges 1 and 3 along s.
                mine, theirs = 1 - one.edge % 2, 1 - one.other_edge % 2
                links[one.patch, mine].append((one.other_patch, theirs, one.opposed))
    return links


def _spread(histogram: FloatArray) -> float:
    """Return the logarithm of the 99th over the 1st percentile."""
    below = np.concatenate([[0.0], np.cumsum(np.maximum(histogram, 0))])
    low, high = np.interp([0.01 * below[-1], 0.99 * below[-1]], below, np.arange(BINS + 1))
    return float(high - low) * (8 / BINS)


def _sums(values: FloatArray, rows: list[int], columns: list[int]) -> FloatArray:
    return np.add.reduceat(np.add.reduceat(values, rows, axis=-2), columns, axis=-1)


def _means(area: FloatArray, logs: FloatArray, rows: list[int], columns: list[int]) -> FloatArray:
    weights = np.maximum(area, 1e-300)
    return _sums(weights * logs, rows, columns) / _sums(weights, rows, columns)


def _deviation(
    area: FloatArray, logs: FloatArray, rows: list[int], columns: list[int], least: FloatArray
) -> FloatArray:
    """Return log texel area at all samples, over that of the texels asked for.

    `least` is the logarithm of a chart's least height and width: model units × samples of the patch.
    """
    down, right, element = _means(area, logs, rows, columns)
    sine = 0.5 * (element - down - right)
    spans = [np.diff([*c, n]) for c, n in zip((rows, columns), area.shape, strict=True)]
    # Too small a chart gets more texels than asked for: what is cut too often grows uneven again.
    short = np.maximum(0, least[0] - down - sine - np.log(spans[0])[:, None])
    narrow = np.maximum(0, least[1] - right - sine - np.log(spans[1]))
    typical = element + short + narrow
    places = [np.repeat(np.arange(len(span)), span) for span in spans]
    found: FloatArray = logs[2] - typical[places[0][:, None], places[1]]
    return found
