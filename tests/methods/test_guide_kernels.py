"""What guides and zones ask of a block: kernels against plain twins."""

import numpy as np
import pytest
from laying import texture
from laying_kernels import choose, count_off, cut, draw_first, prefer, show
from test_choosing import Frame

from upholster.methods.quilt._block_kernels import EITHER, ChoiceScratch, CutScratch, FramePixels, LayWeights

COSTS = np.stack([np.arange(256) ** 2 // 8, np.minimum(np.arange(256), 1) * 5000]).astype(np.int32)


class Asked(Frame):
    """A frame of which two guides ask something, with three zones: the first one's sample is on the left."""

    def __init__(self, seed: int, symmetry: int = 0, size: int = 24) -> None:
        super().__init__(texture(80, 90), size, symmetry, seed)
        rng, count = np.random.default_rng(seed), 80 * 90
        guides = rng.integers(1, 256, (2, count), dtype=np.uint8)
        zones = np.repeat(np.where(np.arange(90) < 45, 1, 2)[None], 80, axis=0).astype(np.uint8)
        self.match = self.match._replace(guides=guides, costs=COSTS, pull=77, allowed=zones.reshape(-1))
        pixels = FramePixels.of(size, 2, zones=True)
        for name in ("marks", "old", "ys", "xs"):
            getattr(pixels, name)[:] = getattr(self.pixels, name)
        pixels.wanted[:] = rng.integers(0, 256, pixels.wanted.shape) * (rng.random(pixels.wanted.shape) < 0.7)
        pixels.off[:] = rng.integers(0, 9000, pixels.off.shape)
        pixels.zones[:] = np.where(np.arange(size)[:, None] < size // 2, 1, 2)
        pixels.zones[size // 3 : 2 * size // 3] += EITHER
        self.pixels = pixels
        self.choice = ChoiceScratch.of(self.numbers, self.pyramid.empty_usage())

    def costs_at(self, y: int, x: int) -> np.ndarray:
        """Return what each pixel of the frame pays whose block reads there, (size, size)."""
        place = (y + self.pixels.ys) * self.numbers.width + x + self.pixels.xs
        total = np.zeros(place.shape, np.int64)
        for guide, costs, wanted in zip(self.match.guides, COSTS, self.pixels.wanted, strict=True):
            off = np.abs(guide[place].astype(int) - wanted)
            total += np.where(wanted > 0, costs[off], 0)
        return total


@pytest.mark.parametrize("symmetry", [0, 1, 4, 5])
@pytest.mark.parametrize("seed", [1, 2])
def test_places_cost_the_mean_over_points_of_the_frame(seed: int, symmetry: int) -> None:
    frame = Asked(seed, symmetry)
    rng, span, step = np.random.default_rng(seed), frame.span, frame.numbers.usage_step
    before = rng.random(frame.choice.penalties.shape) * 1000
    frame.choice.penalties[:] = before
    count_off(frame.match, frame.numbers, span, frame.pixels, frame.choice)
    stride = frame.numbers.size // 6
    points = np.s_[(frame.numbers.size - 1) % stride // 2 :: stride]
    wanted = before.copy()
    rows = range(span.first_y // step, min(span.last_y // step, len(before) - 1) + 1)
    columns = range(span.first_x // step, min(span.last_x // step, before.shape[1] - 1) + 1)
    for a in rows:
        for b in columns:
            y = min(max(a * step + step // 2, span.first_y), span.last_y)
            x = min(max(b * step + step // 2, span.first_x), span.last_x)
            wanted[a, b] += frame.costs_at(y, x)[points, points].mean()
    window = np.s_[rows.start : rows.stop, columns.start : columns.stop]
    wanted[window] -= wanted[window].min()
    np.testing.assert_allclose(frame.choice.penalties, wanted, rtol=1e-12, atol=1e-6)


@pytest.mark.parametrize("zone", [1, 2])
def test_cells_prefer_the_side_that_is_less_off(zone: int) -> None:
    frame = Asked(zone, 0)
    numbers, scratch = frame.numbers, CutScratch.of(frame.numbers)
    y, x = frame.span.first_y + 5, frame.span.first_x + 3
    prefer(frame.match, numbers, y * numbers.width + x, zone, frame.pixels, scratch)
    pull = 77 * ((frame.pixels.zones >= EITHER) & (frame.pixels.zones % EITHER != zone))
    gain = (frame.pixels.off - frame.costs_at(y, x) - pull) * (frame.pixels.marks & 1)
    cells = numbers.size // numbers.cell
    wanted = gain.reshape(cells, numbers.cell, cells, numbers.cell).sum(axis=(1, 3))
    np.testing.assert_array_equal(scratch.balance.reshape(cells, cells), wanted)


@pytest.mark.parametrize("zone", [1, 2])
def test_a_block_leaves_cells_of_another_zone(zone: int) -> None:
    frame = Asked(3, 0)
    numbers, pixels = frame.numbers, frame.pixels
    x = frame.span.first_x if zone == 1 else frame.span.last_x
    base, across = frame.span.first_y * numbers.width + x, numbers.size // numbers.cell
    assert frame.match.allowed[base] == zone
    mask = np.full(across * across, 9, np.uint8)
    show(frame.match, numbers, base, pixels, mask)
    other = (pixels.zones % EITHER != zone) & ((pixels.zones < EITHER) | (pixels.marks & 1 == 0))
    counts = other.reshape(across, numbers.cell, across, numbers.cell).sum(axis=(1, 3))
    np.testing.assert_array_equal(mask.reshape(across, across), 2 * counts <= numbers.cell**2)

    # Cut against what is laid, they stay as they are as well: old, or bare.
    covered = np.zeros((numbers.size + 2, numbers.size + 2), np.uint8)
    covered[1:-1, 1:-1] = pixels.marks
    cut(covered, frame.match, numbers, base, pixels, CutScratch.of(numbers), mask)
    assert not mask.reshape(across, across)[2 * counts > numbers.cell**2].any()
    assert mask.any()


def test_a_cut_costs_no_more_than_any_other_of_its_kind() -> None:
    """Differences along the border, and what each side is off: against borders drawn at random."""
    frame = Asked(5, 0, 16)
    numbers, pixels = frame.numbers, frame.pixels
    pixels.zones[:], pixels.marks[:] = 0, 1
    pixels.marks[:2, :2] = 0
    y, x = frame.span.first_y + 2, frame.span.first_x + 2
    covered = np.ones((numbers.size + 2, numbers.size + 2), np.uint8)
    covered[:-1, :-1] = 0
    covered[1:-1, 1:-1] = pixels.marks
    across, scratch = numbers.size // numbers.cell, CutScratch.of(numbers)
    mask = np.zeros(across * across, np.uint8)
    cut(covered, frame.match, numbers, y * numbers.width + x, pixels, scratch, mask)
    read = frame.image[y + pixels.ys, x + pixels.xs].astype(int)
    apart = ((read - frame.old) ** 2).sum(axis=2) * (pixels.marks == 1)

    def cells_of(values: np.ndarray) -> np.ndarray:
        return values.reshape(across, numbers.cell, across, numbers.cell).sum(axis=(1, 3))

    errors, held = cells_of(apart), scratch.seeds.reshape(across, across)
    gain = cells_of((pixels.off - frame.costs_at(y, x)) * (pixels.marks & 1))

    def energy(new: np.ndarray) -> int:
        inside = held != 3
        total = int((-gain * new)[inside].sum())
        for a, b in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            both = inside[a] & inside[b] & (new[a] != new[b])
            total += int(((errors[a] + errors[b] + 1) * both).sum())
        return total

    found, rng = mask.reshape(across, across).astype(bool), np.random.default_rng(0)
    least = energy(found)
    for _ in range(300):
        other = found ^ (rng.random(found.shape) < rng.choice([0.02, 0.1, 0.5]))
        other[held == 1], other[held == 2] = False, True
        assert energy(other) >= least
    assert 0 < found.sum() < found.size


@pytest.mark.parametrize("zone", [1, 2])
def test_sources_lie_in_the_zone_of_the_block(zone: int) -> None:
    frame = Asked(7, 0)
    weights = LayWeights(0.0, 0.0, 1.1, 0.0, 1.0)
    frame.choice.zone[0] = zone
    frame.choice.penalties[:] = 0
    count_off(frame.match, frame.numbers, frame.span, frame.pixels, frame.choice)
    penalties = frame.choice.penalties.copy()
    out = np.zeros((200, 2), np.int64)
    places = np.flatnonzero(frame.match.allowed)
    match = frame.match._replace(places=places)
    draw_first(match, frame.numbers, weights, np.array([3], np.uint64), frame.span, frame.choice, out)
    step = frame.numbers.usage_step
    assert (frame.match.allowed.reshape(80, 90)[tuple(out.T)] == zone).all()
    assert len(np.unique(out, axis=0)) > 3
    rows, columns = np.mgrid[
        frame.span.first_y : frame.span.last_y + 1, frame.span.first_x : frame.span.last_x + 1
    ]
    inside = frame.match.allowed.reshape(80, 90)[rows, columns] == zone
    cost = penalties[
        np.minimum(rows // step, len(penalties) - 1), np.minimum(columns // step, penalties.shape[1] - 1)
    ]
    drawn = penalties[tuple(np.minimum(out // step, np.array(penalties.shape) - 1).T)]
    assert drawn.max() <= cost[inside].min() + COSTS[:, 16].sum() + 1
    found = np.zeros(3, np.int64)
    for seed in range(5):
        state = np.array([seed], np.uint64)
        choose(match, frame.numbers, weights, state, frame.span, frame.pixels, frame.choice, found)
        assert frame.match.allowed.reshape(80, 90)[found[0], found[1]] == zone
