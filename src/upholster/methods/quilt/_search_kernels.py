"""Finding the part of the exemplar that goes on best from what is there: by boxes' means, then in full.

Whole numbers in float32 keep sums of squares exact, in any order.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel

__all__ = ["draw", "judge", "mean_boxes", "search", "sort_kept"]


@kernel
def mean_boxes(
    image: NDArray[np.uint8], height: int, width: int, channels: int, step: int
) -> NDArray[np.float32]:
    """Return the rounded means of the 4×4 boxes of an image's first channel, one for each box's first pixel.

    Undecimated LL2 of the Haar transform up to a factor. Boxes that reach beyond the image repeat its edge.
    They come in step² groups, (step², ⌈H/step⌉·⌈W/step⌉): box (y, x) in group (y mod step)·step + x mod step
    at row ⌊y/step⌋ and column ⌊x/step⌋, so that every step-th box lies beside the one before.
    """
    across = np.empty((height, width), np.int32)
    for i in range(height):
        for j in range(width):
            total: Any = 0
            for k in range(4):
                total += np.int32(image[(i * width + min(j + k, width - 1)) * channels])
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
    return np.int64((z ^ (z >> np.uint64(31))) % np.uint64(count))


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
    # Keeps the `most` least of all costs seen, as a heap with the greatest on top; returns how many.
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
        else:
            at = size
            size += 1
            while at > 0 and heap[(at - 1) // 2] < value:
                heap[at], kept[at] = heap[(at - 1) // 2], kept[(at - 1) // 2]
                at = (at - 1) // 2
        heap[at], kept[at] = value, first + n * step
    return size


@inline
def sort_kept(heap: NDArray[np.float32], kept: NDArray[np.int64], size: int) -> None:
    """Sort what `search` kept by cost, then by place: the cheapest first."""
    for n in range(1, size):
        value, place = heap[n], kept[n]
        m = n
        while m > 0 and (heap[m - 1] > value or (heap[m - 1] == value and kept[m - 1] > place)):
            heap[m], kept[m] = heap[m - 1], kept[m - 1]
            m -= 1
        heap[m], kept[m] = value, place


@inline
def search(
    plane: NDArray[np.float32],
    width: int,
    step: int,
    bounds: tuple[int, int, int, int],
    features: NDArray[np.int64],
    values: NDArray[np.float32],
    count: int,
    penalties: NDArray[np.float64],
    stride: int,
    most: int,
    costs: NDArray[np.float32],
    heap: NDArray[np.float32],
    kept: NDArray[np.int64],
) -> int:
    """Find the candidates with the least sum of squared differences of boxes, and of penalties; how many.

    Candidates are every `step`-th pixel of rows and columns `bounds` (first and last row, first and last
    column). Feature f < `count` compares ``values[f]`` with the box ``features[2f]`` rows down and
    ``features[2f + 1]`` columns right of the candidate. `penalties` holds one number for each `stride`-th
    pixel, which counts once for each feature. `kept` gets the candidates as row · width + column; `costs` and
    `heap` are scratch.
    """
    first_y, last_y, first_x, last_x = bounds
    columns = (width + step - 1) // step
    area = plane.size // (step * step)
    flat = plane.reshape(-1)
    # Where each feature's box lies for the first candidate.
    for f in range(count):
        y, x = first_y + features[2 * f], first_x + features[2 * f + 1]
        features[f] = (y % step * step + x % step) * area + y // step * columns + x // step
    size = (last_x - first_x) // step + 1
    part = costs[:size]
    found = 0
    for k in range((last_y - first_y) // step + 1):
        y = first_y + k * step
        line = penalties[min(y // stride, penalties.shape[0] - 1)]
        for x in range(size):
            part[x] = line[min((first_x + x * step) // stride, penalties.shape[1] - 1)] * count
        base = k * columns
        f = 0
        while f + 8 <= count:  # eight features a pass: an eighth of the loads and stores of the sums
            pa, pb = flat[base + features[f] :], flat[base + features[f + 1] :]
            pc, pd = flat[base + features[f + 2] :], flat[base + features[f + 3] :]
            pe, pf = flat[base + features[f + 4] :], flat[base + features[f + 5] :]
            pg, ph = flat[base + features[f + 6] :], flat[base + features[f + 7] :]
            va, vb, vc, vd = values[f], values[f + 1], values[f + 2], values[f + 3]
            ve, vf, vg, vh = values[f + 4], values[f + 5], values[f + 6], values[f + 7]
            for x in range(size):
                da, db, dc, dd = pa[x] - va, pb[x] - vb, pc[x] - vc, pd[x] - vd
                de, df, dg, dh = pe[x] - ve, pf[x] - vf, pg[x] - vg, ph[x] - vh
                part[x] += ((da * da + db * db) + (dc * dc + dd * dd)) + (
                    (de * de + df * df) + (dg * dg + dh * dh)
                )
            f += 8
        while f < count:
            pa = flat[base + features[f] :]
            va = values[f]
            for x in range(size):
                da = pa[x] - va
                part[x] += da * da
            f += 1
        found = _keep(part, y * width + first_x, step, most, heap, kept, found)
    sort_kept(heap, kept, found)
    return found


@inline
def judge(
    image: NDArray[np.uint8],
    channels: int,
    place: Any,
    offsets: NDArray[np.int32],
    values: NDArray[np.int32],
    count: int,
    start: Any,
    limit: Any,
) -> Any:
    """Return `start` and the squared differences of all samples; more than `limit` if it is more.

    Sample t < `count` compares ``values[t · channels …]`` with the pixel ``offsets[t]`` after `place`.
    Samples are taken far from each other first, and no more of them once the limit is passed.
    """
    total: Any = start
    chunks = max(1, count // 24)
    for chunk in range(chunks):
        for t in range(chunk, count, chunks):
            at = (place + offsets[t]) * channels
            for k in range(channels):
                d = np.int32(image[at + k]) - values[t * channels + k]
                total += d * d
        if total > limit:
            break
    return total
