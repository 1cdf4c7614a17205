"""Search for the places of the exemplar that continue the laid pixels best, by boxes' means.

Integers in float32 keep sums of squares exact in any order.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.runtime.jit import allocating_kernel, inline, shared
from upholster.synthesis.quilt.kernels._block_kernels import (
    ChoiceScratch,
    LayNumbers,
    LayWeights,
    MatchImage,
    Span,
)
from upholster.synthesis.quilt.kernels._phase_kernels import list_misfits

__all__ = ["draw", "mean_boxes", "search", "use_nearby"]


@allocating_kernel
def mean_boxes(image: NDArray[np.uint8], step: int) -> NDArray[np.float32]:
    """Return the rounded means of the 4×4 boxes of a channel (H, W), one for each box's first pixel.

    They are the undecimated LL2 of the Haar transform up to a factor. Boxes that extend beyond the image
    repeat its edge. Boxes are in step² groups, (step², ⌈H/step⌉·⌈W/step⌉): box (y, x) is in group
    (y mod step)·step + x mod step at row ⌊y/step⌋ and column ⌊x/step⌋, so that every step-th box is adjacent
    to the previous one.
    """
    height, width = image.shape
    across = np.empty((height, width), np.int32)
    for i in range(height):
        for j in range(width):
            total: Any = 0
            for k in range(4):
                total += np.int32(image[i, min(j + k, width - 1)])
            across[i, j] = total
    columns = (width + step - 1) // step
    out = np.zeros((step * step, (height + step - 1) // step * columns), np.float32)
    for i in range(height):
        for j in range(width):
            total = 0
            for k in range(4):
                total += across[min(i + k, height - 1), j]
            out[i % step * step + j % step, i // step * columns + j // step] = (total + 8) >> 4
    return out


@inline
def draw(state: NDArray[np.uint64], count: Any) -> Any:
    """Return a random number below `count` and advance `state`: SplitMix64 (Steele, Lea, Flood 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return int64((z ^ (z >> np.uint64(31))) % np.uint64(count))


@inline
def _keep(
    costs: NDArray[np.float32],
    first: int,
    step: int,
    most: int,
    heap: NDArray[np.float32],
    kept: NDArray[np.int64],
    size: int,
) -> int:
    # Keeps the `most` least of all finite costs so far, as a heap with the greatest on top; returns its size.
    for n in range(costs.shape[0]):
        value = costs[n]
        if size == most:
            if value >= heap[0]:
                continue
            at = 0
            while True:
                child = 2 * at + 1
                if child >= most:
                    break
                if child + 1 < most and heap[child + 1] > heap[child]:
                    child += 1
                if heap[child] <= value:
                    break
                heap[at], kept[at] = heap[child], kept[child]
                at = child
        elif value < np.inf:
            at = size
            size += 1
            while at > 0 and heap[(at - 1) // 2] < value:
                heap[at], kept[at] = heap[(at - 1) // 2], kept[(at - 1) // 2]
                at = (at - 1) // 2
        else:
            continue
        heap[at], kept[at] = value, first + n * step
    return size


@inline
def _sort_kept(heap: NDArray[np.float32], kept: NDArray[np.int64], size: int) -> None:
    # Sorts the kept candidates by cost, then by place: the cheapest first.
    for n in range(1, size):
        value, place = heap[n], kept[n]
        m = n
        while m > 0 and (heap[m - 1] > value or (heap[m - 1] == value and kept[m - 1] > place)):
            heap[m], kept[m] = heap[m - 1], kept[m - 1]
            m -= 1
        heap[m], kept[m] = value, place


@inline
def _add_features(
    flat: NDArray[np.float32],
    base: int,
    features: NDArray[np.int64],
    means: NDArray[np.float32],
    count: int,
    part: NDArray[np.float32],
) -> None:
    # Adds each feature's squared difference to the costs of some candidates. Eight features per pass take an
    # eighth of the loads and stores of the sums.
    f = 0
    while f + 8 <= count:
        pa, pb = flat[base + features[f, 0] :], flat[base + features[f + 1, 0] :]
        pc, pd = flat[base + features[f + 2, 0] :], flat[base + features[f + 3, 0] :]
        pe, pf = flat[base + features[f + 4, 0] :], flat[base + features[f + 5, 0] :]
        pg, ph = flat[base + features[f + 6, 0] :], flat[base + features[f + 7, 0] :]
        va, vb, vc, vd = means[f], means[f + 1], means[f + 2], means[f + 3]
        ve, vf, vg, vh = means[f + 4], means[f + 5], means[f + 6], means[f + 7]
        for x in range(part.shape[0]):
            da, db, dc, dd = pa[x] - va, pb[x] - vb, pc[x] - vc, pd[x] - vd
            de, df, dg, dh = pe[x] - ve, pf[x] - vf, pg[x] - vg, ph[x] - vh
            part[x] += ((da * da + db * db) + (dc * dc + dd * dd)) + (
                (de * de + df * df) + (dg * dg + dh * dh)
            )
        f += 8
    while f < count:
        pa, va = flat[base + features[f, 0] :], means[f]
        for x in range(part.shape[0]):
            da = pa[x] - va
            part[x] += da * da
        f += 1


@inline
def _fill_line(
    numbers: LayNumbers, weights: LayWeights, span: Span, y: int, count: int, choice: ChoiceScratch
) -> None:
    # Writes what the places of a line's candidates cost if they fit: the floor and their penalties, times
    # `count`, the number of features.
    penalties = choice.penalties
    i = min(y // numbers.guide_step, penalties.shape[0] - 1)
    last, n = penalties.shape[1] - 1, int64(0)
    size = (span.last_x - span.first_x) // numbers.step + 1
    while n < size:
        # All candidates up to the next point of the lattice have the same penalty.
        j = min((span.first_x + n * numbers.step) // numbers.guide_step, last)
        stop = size
        if j < last:
            ahead = (j + 1) * numbers.guide_step - span.first_x
            stop = min(size, (ahead + numbers.step - 1) // numbers.step)
        cost = np.float32((penalties[i, j] + weights.floor) * count)
        for m in range(n, stop):
            choice.line[m] = cost
        n = stop


@inline
def use_nearby(numbers: LayNumbers, choice: ChoiceScratch, y: int, x: int) -> float:
    """Return how much of a block with its source at a pixel blocks nearby show, 1 for all of it."""
    total = 0.0
    for n in range(choice.nearby[0]):
        down = 1.0 - abs(y - choice.near[n, 0]) / numbers.size
        right = 1.0 - abs(x - choice.near[n, 1]) / numbers.size
        if down > 0.0 and right > 0.0:
            total += down * right
    return total


@inline
def _add_use(
    numbers: LayNumbers,
    weights: LayWeights,
    span: Span,
    y: int,
    choice: ChoiceScratch,
    part: NDArray[np.float32],
) -> None:
    # Multiplies the costs of a line's candidates by what the use nearby makes of them.
    uses, step, size = choice.uses, numbers.step, numbers.size
    uses[:] = 0.0
    for n in range(choice.nearby[0]):
        down = 1.0 - abs(y - choice.near[n, 0]) / size
        if down > 0.0:
            low, high = choice.near[n, 1] - size - span.first_x, choice.near[n, 1] + size - span.first_x
            for m in range(max(0, low // step), min(part.shape[0], high // step + 1)):
                right = 1.0 - abs(span.first_x + m * step - choice.near[n, 1]) / size
                if right > 0.0:
                    uses[m] += down * right
    for m in range(part.shape[0]):
        part[m] = (part[m] + np.float32(1.0)) * np.float32(1.0 + weights.variety * uses[m])


@shared
def search(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    span: Span,
    count: int,
    choice: ChoiceScratch,
) -> Any:
    """Find the candidates that cost least by boxes' squared differences, penalties and use; return how many.

    Candidates are every `step`-th pixel of a span, if it is allowed. The first `count` features are compared,
    and a candidate's penalty and phase count once for each. Without features only penalty and phase count.
    The candidates are written to `kept`.
    """
    step, features = numbers.step, choice.features
    columns = (numbers.width + step - 1) // step
    area = match.plane.size // (step * step)
    flat = match.plane.reshape(-1)
    times = max(count, 1)
    # A feature's first number becomes the index of its box for the first candidate.
    for f in range(count):
        y, x = span.first_y + features[f, 0], span.first_x + features[f, 1]
        features[f, 0] = (y % step * step + x % step) * area + y // step * columns + x // step
    size, lines = (span.last_x - span.first_x) // step + 1, (span.last_y - span.first_y) // step + 1
    kept, found, filled = choice.kept, int64(0), int64(-1)
    # Several lines at a time, because long runs are faster. Costs between lines are computed but not used.
    group = choice.costs.shape[0] // columns
    for start in range(0, lines, group):
        stop = min(start + group, lines)
        for k in range(start, stop):
            y = span.first_y + k * step
            if y // numbers.guide_step != filled:
                filled = y // numbers.guide_step
                _fill_line(numbers, weights, span, y, times, choice)
            part = choice.costs[(k - start) * columns : (k - start) * columns + size]
            for n in range(size):
                part[n] = choice.line[n]
            place = y * numbers.width + span.first_x
            if match.allowed.shape[0]:
                zone = choice.zone[0]
                for n in range(size):
                    own = match.allowed[place + n * step]
                    if own == 0 or (zone != 0 and own != zone):
                        part[n] = np.float32(np.inf)
            if match.phases.shape[0]:
                misfits = choice.misfits[:size]
                list_misfits(match.phases, choice.wanted, place, step, misfits)
                for n in range(size):
                    part[n] += np.float32(weights.phase * misfits[n] * times)
        run = choice.costs[: (stop - start - 1) * columns + size]
        _add_features(flat, start * columns, features, choice.means, count, run)
        for k in range(start, stop):
            part = choice.costs[(k - start) * columns : (k - start) * columns + size]
            y = span.first_y + k * step
            if choice.nearby[0]:
                _add_use(numbers, weights, span, y, choice, part)
            first = y * numbers.width + span.first_x
            found = _keep(part, first, step, numbers.shortlist, choice.heap, kept, found)
    _sort_kept(choice.heap, kept, found)
    return found
