"""Hot loops of method "quilt" once more, in plain Python and NumPy: slow, by the book, to check kernels."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from plain_cut import FREE, NEW, OLD, OUTSIDE, plain_cut

# Row per row, row per column, column per row, column per column: rotations by quarters, then the same of the
# transposed square.
SYMMETRIES = (
    *((1, 0, 0, 1), (0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0)),
    *((0, 1, 1, 0), (1, 0, 0, -1), (0, -1, -1, 0), (-1, 0, 0, 1)),
)
BIG = 2**60
REFINED = 4


class Draws:
    """SplitMix64, from its authors' text."""

    def __init__(self, seed: int) -> None:
        self.state = seed

    def below(self, count: int) -> int:
        self.state = (self.state + 0x9E3779B97F4A7C15) % 2**64
        z = self.state
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return (z ^ (z >> 31)) % count


def box_means(image: np.ndarray) -> np.ndarray:
    """Return the rounded means of the first channel's 4×4 boxes that begin at each pixel, edges repeating."""
    padded = np.pad(image[..., 0].astype(int), ((0, 3), (0, 3)), mode="edge")
    total = sum(padded[i : i + image.shape[0], j : j + image.shape[1]] for i in range(4) for j in range(4))
    return (total + 8) >> 4


def misfits(phases: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return of each pixel 1 − cos of what its phases (n, H, W) are off, summed, in 1/2^14."""
    total = np.zeros(phases.shape[1:], np.int64)
    for wave, sign, goal in wanted[: len(phases)].tolist():
        if wave < 0:
            total += 2**14
            continue
        steps = ((sign * phases[wave].astype(np.int64) - goal + 32) // 64) % 1024
        total += np.rint(2**14 * (1 - np.cos(2 * np.pi * steps / 1024))).astype(np.int64)
    return total


def judged(differences: np.ndarray, start: int, limit: int) -> int:
    """Return the sum of samples' squared differences, or of as many as it takes to pass the limit.

    Every ⌊count / 24⌋-th sample is taken, then those right after them, and so on.
    """
    rounds, total = max(1, len(differences) // 24), start
    for first in range(rounds):
        total += int((differences[first::rounds] ** 2).sum())
        if total > limit:
            break
    return total


@dataclass
class PlainChoice:
    """What a block's source is chosen by: the exemplar (H, W, K), the frame, and what places cost.

    `allowed` (H, W) tells which places there are; None: all of the span.
    """

    image: np.ndarray
    numbers: Any
    weights: Any
    span: Any
    marks: np.ndarray
    old: np.ndarray
    ys: np.ndarray
    xs: np.ndarray
    penalties: np.ndarray
    phases: np.ndarray
    wanted: np.ndarray
    allowed: np.ndarray | None = None
    near: np.ndarray | None = None
    avoid: int = -1

    def __post_init__(self) -> None:
        self.image, self.old = self.image.astype(np.int64), self.old.astype(np.int64)
        self.there, self.misfit = self.marks == 1, misfits(self.phases, self.wanted)

    def costs(self, y: Any, x: Any) -> tuple[Any, Any]:
        """Return what places cost by guides, also where all fits, and for their phases."""
        step = self.numbers.guide_step
        i, j = (np.minimum(at // step, n - 1) for at, n in zip((y, x), self.penalties.shape, strict=True))
        return self.penalties[i, j] + self.weights.floor, self.weights.phase * self.misfit[y, x]

    def is_allowed(self, y: int, x: int) -> bool:
        """Tell whether a block may read there."""
        return self.allowed is None or bool(self.allowed[y, x])

    def boxes(self) -> list[tuple[int, int, int]]:
        """Return where boxes that are laid entirely lie from the source, and their means."""
        found = []
        for a in range(0, self.numbers.size - 3, 4):
            for b in range(0, self.numbers.size - 3, 4):
                part = np.s_[a : a + 4, b : b + 4]
                if self.there[part].all():
                    y, x = (int(v[a + 1, b + 1] + v[a + 2, b + 2] - 3) >> 1 for v in (self.ys, self.xs))
                    y = max(min(y, self.span.high_y - 3), self.span.low_y)
                    x = max(min(x, self.span.high_x - 3), self.span.low_x)
                    found.append((y, x, (int(self.old[part][..., 0].sum()) + 8) >> 4))
        return found

    def shortlist(self, draws: Draws) -> list[tuple[int, int]]:
        """Return the candidates that differ least in their boxes' means."""
        span, boxes, most = self.span, self.boxes(), self.numbers.shortlist
        if not boxes and not len(self.phases):
            if self.allowed is not None:
                places = np.argwhere(self.allowed).tolist()
                return [tuple(places[draws.below(len(places))]) for _ in range(most)]
            found = []
            for _ in range(most):
                y = span.first_y + draws.below(span.last_y - span.first_y + 1)
                found.append((y, span.first_x + draws.below(span.last_x - span.first_x + 1)))
            return found
        rows = slice(span.first_y, span.last_y + 1, self.numbers.step)
        columns = slice(span.first_x, span.last_x + 1, self.numbers.step)
        y, x = np.mgrid[rows, columns].reshape(2, -1)
        y, x = (at[[self.is_allowed(*place) for place in zip(y, x, strict=True)]] for at in (y, x))
        cost, means = sum(self.costs(y, x)) * max(1, len(boxes)), box_means(self.image)
        for dy, dx, value in boxes:
            cost = cost + (means[y + dy, x + dx] - value) ** 2
        if self.near is not None and len(self.near):  # in the kernels' 32 bits
            uses = np.array([self.use(*place) for place in zip(y, x, strict=True)])
            more = 1.0 + self.weights.variety * uses
            cost = (cost + 1).astype(np.float32) * more.astype(np.float32)
        kept = np.argsort(cost, kind="stable")[:most]
        return list(zip(y[kept].tolist(), x[kept].tolist(), strict=True))

    def choose(self, draws: Draws) -> tuple[int, int, int]:
        """Return the source's row and column, and what it costs."""
        found = self.shortlist(draws)
        i, j = np.mgrid[: self.numbers.size, : self.numbers.size]
        black = ((i + j) % 2 == 0) & self.there
        count, near = int(black.sum()), self.numbers.step // 2
        if len(self.phases):
            count = max(1, count)
        totals: list[int] = []
        best, begin, span, weights = BIG, 0, self.span, self.weights
        for refining in (False, True):
            for y, x in found[begin:]:
                apart = self.image[y + self.ys[black], x + self.xs[black]] - self.old[black]
                guide, phase = self.costs(y, x)
                more = 1.0 + weights.variety * self.use(y, x)
                more += weights.chance * draws.below(1024) / 1024
                whole = judged(apart, 1 + int(guide * count) + int(phase * count), 2 * best / more)
                row, column = divmod(self.avoid, self.numbers.width)
                reach = self.numbers.size // 4
                is_as_before = self.avoid >= 0 and abs(y - row) < reach and abs(x - column) < reach
                totals.append(BIG if is_as_before else int(whole * more))
                best = min(best, totals[-1])
            if refining or not near:
                break
            begin = len(found)  # now the pixels round the best ones
            for m in sorted(range(begin), key=totals.__getitem__)[:REFINED]:
                y, x = found[m]
                for a in range(max(y - near, span.first_y), min(y + near, span.last_y) + 1):
                    columns = range(max(x - near, span.first_x), min(x + near, span.last_x) + 1)
                    found += [(a, b) for b in columns if (a, b) != (y, x) and self.is_allowed(a, b)]
        cheapest = int(np.argmin(totals))
        return (*found[cheapest], totals[cheapest])

    def use(self, y: int, x: int) -> float:
        """Return how much of a block there the blocks nearby show."""
        total = 0.0
        for other in [] if self.near is None else self.near.tolist():
            down, right = (1.0 - abs(a - b) / self.numbers.size for a, b in zip((y, x), other, strict=True))
            total += down * right if down > 0 and right > 0 else 0.0
        return total


def cells_of(array: np.ndarray, cell: int) -> np.ndarray:
    """Return a frame's pixels by cells, (rows, columns, cell²)."""
    across = len(array) // cell
    return array.reshape(across, cell, across, cell).swapaxes(1, 2).reshape(across, across, -1)


def plain_seeds(
    covered: np.ndarray, marks: np.ndarray, cell: int, barred: np.ndarray | bool = False
) -> np.ndarray:
    """Return which cells stay old and which become new, whatever it costs.

    Of `marks` 1 tells what is laid, 9 what of it stays, 2 what lies beside the surface, 0 what is bare; so
    does `covered`, which has a rim of one pixel. What is `barred` stays as it is.
    """
    across = len(marks) // cell
    missing = cells_of(marks == 0, cell).any(axis=2) & ~np.array(barred)
    bare, beside = cells_of(marks & 1 == 0, cell).any(axis=2), cells_of(marks == 2, cell).any(axis=2)
    ring, near = np.pad(missing, 1), np.zeros_like(missing)
    for a, b in np.ndindex(3, 3):
        near |= ring[a : a + across, b : b + across]
    # On the rim a cell stays old where something is laid beyond its first pixel.
    goes_on, first = np.zeros_like(missing), np.arange(across) * cell + 1
    goes_on[0] |= covered[0, first] & 1 == 1
    goes_on[-1] |= covered[-1, first] & 1 == 1
    goes_on[:, 0] |= covered[first, 0] & 1 == 1
    goes_on[:, -1] |= covered[first, -1] & 1 == 1
    seeds = np.full(missing.shape, FREE, np.int8)
    seeds[beside | goes_on] = OLD
    seeds[near] = NEW
    seeds[bare] = np.where(beside & ~near, OLD, OUTSIDE)[bare]
    seeds[cells_of(marks & 8, cell).any(axis=2) | (barred & ~bare)] = OLD
    seeds[missing] = OUTSIDE
    return seeds


def plain_cut_block(apart: np.ndarray, covered: np.ndarray, marks: np.ndarray, cell: int) -> np.ndarray:
    """Return a block's new cells, 1 where it shows; `apart` are the pixels' squared differences."""
    errors = cells_of(apart * (marks == 1), cell).sum(axis=2)
    seeds = plain_seeds(covered, marks, cell)
    inside = seeds != OUTSIDE
    if not ((seeds == OLD).any() and (seeds == NEW).any()):
        return (~inside | (seeds == NEW).any()).astype(np.uint8)
    right = (errors[:, :-1] + errors[:, 1:] + 1) * (inside[:, :-1] & inside[:, 1:])
    down = (errors[:-1] + errors[1:] + 1) * (inside[:-1] & inside[1:])
    return (plain_cut(right, down, seeds)[0] | ~inside).astype(np.uint8)


def plain_filled(labels: np.ndarray) -> np.ndarray:
    """Fill cells without a label: from all that have one at once, a step at a time."""
    labels = labels.copy()
    queue = [tuple(at) for at in np.argwhere(labels >= 0).tolist()]
    for i, j in queue:
        for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if 0 <= a < labels.shape[0] and 0 <= b < labels.shape[1] and labels[a, b] < 0:
                labels[a, b] = labels[i, j]
                queue.append((a, b))
    return labels


def barycentric(p: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the coordinates of places (n, 2) in a triangle (3, 2)."""
    second = np.linalg.solve((p[1:] - p[0]).T, (places - p[0]).T).T
    return np.column_stack([1 - second.sum(axis=1), second])
