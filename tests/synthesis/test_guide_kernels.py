"""What guides, zones and pieces put by hand ask of blocks: kernels against plain twins."""

import numpy as np
import pytest
from laying import plane, texture
from laying_kernels import ask, bar, cut, draw_first, lay_numbers, lie, look, prefer, read_cells, show
from plain_cut import NEW, OLD, OUTSIDE, cut_cost
from plain_laying import SYMMETRIES, cells_of, plain_seeds

from upholster.synthesis.quilt.centres import centres_at
from upholster.synthesis.quilt.kernels._block_kernels import (
    BLOCK_COLUMNS,
    EITHER,
    ChoiceScratch,
    CutScratch,
    FramePixels,
    LayWeights,
    Span,
)
from upholster.synthesis.quilt.kernels._lay_kernels import BlockArrays, LayScratch
from upholster.synthesis.quilt.kernels._put_kernels import put_block
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint
from upholster.synthesis.quilt.match_pyramid import match_pyramid
from upholster.synthesis.quilt.puts import PutPiece, piece_frame

SIZE = 24
SHAPE = (60, 66)


class Asked:
    """A frame over a sample with guides and two zones, the left half and the right one."""

    def __init__(self, seed: int, guides: int = 2, *, zones: bool = True, cell: int = 2, symmetry: int = 0):
        rng = self.rng = np.random.default_rng(seed)
        level = match_pyramid(texture(*SHAPE, seed=seed)).levels[0]
        self.image = level.match.image.view(np.uint8).reshape(*SHAPE, 4).astype(np.int64)
        self.numbers = lay_numbers(*SHAPE, SIZE, step=level.step, cell=cell)
        self.guides = texture(*SHAPE, max(1, guides), seed + 1).clip(1, None).transpose(2, 0, 1)[:guides]
        # The first guide costs more the more it is off; the second one is of labels.
        self.costs = np.stack([np.arange(256) ** 2 // 10, np.minimum(np.arange(256), 1) * 900])[:guides]
        self.zone = np.where(np.arange(SHAPE[1]) < SHAPE[1] // 2, 1, 2) + np.zeros((SHAPE[0], 1), np.int64)
        allowed = self.zone.astype(np.uint8).reshape(-1) if zones else np.empty(0, np.uint8)
        self.match = level.match._replace(
            guides=np.ascontiguousarray(self.guides.reshape(guides, SHAPE[0] * SHAPE[1])),
            costs=self.costs.astype(np.int32),
            allowed=allowed,
            places=np.flatnonzero(allowed),
        )
        pixels = self.pixels = FramePixels.of(SIZE, guides, zones=zones)
        turn, (i, j) = SYMMETRIES[symmetry], np.mgrid[:SIZE, :SIZE] - SIZE // 2
        ys, xs = turn[0] * i + turn[1] * j, turn[2] * i + turn[3] * j
        pixels.ys[:], pixels.xs[:] = ys, xs
        low, high = (ys.min(), xs.min()), (ys.max(), xs.max())
        self.span = Span(
            *(int(-low[0]), int(SHAPE[0] - 1 - high[0]), int(-low[1]), int(SHAPE[1] - 1 - high[1])),
            *(int(low[0]), int(high[0]), int(low[1]), int(high[1])),
        )
        self.choice = ChoiceScratch.of(self.numbers)
        # Blobs of all kinds: laid, bare, beside the surface.
        pixels.marks[:] = np.array([0, 1, 1, 2, 1])[texture(SIZE, SIZE, 1, seed, 8)[..., 0] // 52]
        pixels.old[:] = rng.choice(level.match.image, (SIZE, SIZE))
        pixels.wanted[:] = rng.integers(0, 256, pixels.wanted.shape) * (rng.random((SIZE, SIZE)) < 0.8)
        if zones:
            blobs = texture(SIZE, SIZE, 1, seed + 9, 6)[..., 0] // 43
            pixels.zones[:] = np.array([1, 1, EITHER + 1, EITHER + 2, 2, 0])[blobs]
        if guides:
            pixels.off[:] = rng.integers(0, 2000, pixels.off.shape) * (pixels.marks & 1)
        self.base = (self.span.first_y + 6) * SHAPE[1] + self.span.first_x + 2
        self.scratch = CutScratch.of(self.numbers)

    def paid(self, y: int, x: int) -> np.ndarray:
        """Return what each pixel of the frame pays by all guides with the source at a place."""
        read = self.guides[:, y + self.pixels.ys, x + self.pixels.xs].astype(np.int64)
        wanted, total = self.pixels.wanted.astype(np.int64), np.zeros((SIZE, SIZE), np.int64)
        for cost, one, goal in zip(self.costs, read, wanted, strict=True):
            total += np.where(goal > 0, cost[np.abs(one - goal)], 0)
        return total

    def price(self) -> np.ndarray:
        """Return what each pixel pays by guides that the block shows."""
        return self.paid(*divmod(self.base, SHAPE[1]))

    def barred(self, zone: int) -> np.ndarray:
        """Return which cells shall be of another zone."""
        zones, laid = self.pixels.zones.astype(int), self.pixels.marks & 1 == 1
        other = (zones % EITHER != zone) & (zones > 0) & ((zones < EITHER) | ~laid)
        return cells_of(other, self.numbers.cell).mean(axis=2) > 0.5


@pytest.mark.parametrize("symmetry", [0, 3, 5])
@pytest.mark.parametrize("guides", [1, 2])
def test_places_cost_what_their_frames_are_off(guides: int, symmetry: int) -> None:
    asked = Asked(guides, guides, symmetry=symmetry)
    penalties, span, step = asked.choice.penalties, asked.span, asked.numbers.guide_step
    before = asked.rng.integers(0, 400, penalties.shape).astype(float)
    penalties[:] = before
    ask(asked.match, asked.numbers, span, asked.pixels, asked.choice)
    # Six pixels each way, evenly.
    points, wanted = np.s_[1::4, 1::4], before.copy()
    rows = range(span.first_y // step, span.last_y // step + 1)
    columns = range(span.first_x // step, span.last_x // step + 1)
    for a in rows:
        for b in columns:
            y = np.clip(a * step + step // 2, span.first_y, span.last_y)
            x = np.clip(b * step + step // 2, span.first_x, span.last_x)
            wanted[a, b] += asked.paid(y, x)[points].mean()
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    wanted[part] -= wanted[part].min()
    np.testing.assert_allclose(penalties, wanted, atol=1e-9)
    assert np.ptp(wanted[part] - before[part]) > 100


def test_where_nothing_is_asked_places_cost_what_they_did() -> None:
    asked = Asked(1, 0)
    asked.choice.penalties[:] = 3.0
    ask(asked.match, asked.numbers, asked.span, asked.pixels, asked.choice)
    assert (asked.choice.penalties == 3.0).all()


@pytest.mark.parametrize("cell", [2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_cells_of_which_most_shall_be_of_another_zone_are_barred(seed: int, cell: int) -> None:
    asked, found = Asked(seed, 0, cell=cell), np.full((SIZE // cell, SIZE // cell), 9, np.uint8)
    for zone in (1, 2):
        bar(asked.pixels, zone, cell, found)
        np.testing.assert_array_equal(found, asked.barred(zone))
        assert 0 < found.sum() < found.size
    bar(asked.pixels, 0, cell, found)
    assert not found.any()
    bar(Asked(seed, 1, zones=False).pixels, 1, cell, found)
    assert not found.any()


@pytest.mark.parametrize("guides", [1, 2])
@pytest.mark.parametrize("cell", [2, 4])
def test_cells_prefer_the_side_that_is_less_off(cell: int, guides: int) -> None:
    for symmetry in (0, 3, 5):
        asked = Asked(symmetry, guides, cell=cell, symmetry=symmetry)
        prefer(asked.match, asked.numbers, asked.base, asked.pixels, asked.scratch)
        less = (asked.pixels.off - asked.price()) * (asked.pixels.marks & 1)
        wanted = cells_of(less, cell).sum(axis=2)
        np.testing.assert_array_equal(asked.scratch.balance.reshape(wanted.shape), wanted)
        assert (wanted > 0).any()
        assert (wanted < 0).any()


@pytest.mark.parametrize("zones", [False, True])
def test_a_block_on_nothing_shows_all_that_is_not_of_another_zone(zones: bool) -> None:
    for seed in range(4):
        asked = Asked(seed, 1, zones=zones)
        asked.pixels.marks[:] = 0
        mask = np.full((SIZE // 2) ** 2, 9, np.uint8)
        for base in (asked.base, asked.base + 34):
            show(asked.match, asked.numbers, base, asked.pixels, mask)
            wanted = ~asked.barred(asked.zone.flat[base]) if zones else np.ones((SIZE // 2, SIZE // 2), bool)
            np.testing.assert_array_equal(mask.reshape(wanted.shape), wanted)
            assert mask.all() == (not zones)


class Energy:
    """What a block's cells cost, old or new, and what must stay so."""

    def __init__(self, asked: Asked, covered: np.ndarray, *, zones: bool) -> None:
        pixels, cell, (y, x) = asked.pixels, asked.numbers.cell, divmod(asked.base, SHAPE[1])
        zone, laid = asked.zone.flat[asked.base], pixels.marks & 1
        self.barred = asked.barred(zone) if zones else np.zeros((SIZE // cell,) * 2, bool)
        self.seeds = plain_seeds(covered, pixels.marks, cell, self.barred)
        old = pixels.old.view(np.uint8).reshape(SIZE, SIZE, 4)
        apart = ((asked.image[y + pixels.ys, x + pixels.xs] - old) ** 2).sum(axis=2)
        errors = cells_of(apart * laid, cell).sum(axis=2)
        self.right, self.down = errors[:, :-1] + errors[:, 1:] + 1, errors[:-1] + errors[1:] + 1
        paid = (pixels.off if len(pixels.off) else np.zeros((SIZE, SIZE), int), asked.price())
        self.prices = [cells_of(price * laid, cell).sum(axis=2) for price in paid]

    def of(self, new: np.ndarray) -> int:
        """Return what sides cost: what cells are off by them, and the line between them."""
        inside = self.seeds != OUTSIDE
        off = int(np.where(new, self.prices[1], self.prices[0])[inside].sum())
        return off + cut_cost(self.right, self.down, self.seeds, new)

    def held(self, new: np.ndarray) -> np.ndarray:
        """Return sides where what is held is as it must be."""
        new = np.where(self.seeds == OLD, 0, np.where(self.seeds == NEW, 1, new))
        return np.where(self.seeds == OUTSIDE, ~self.barred, new).astype(np.uint8)


@pytest.mark.parametrize("cell", [2, 4])
@pytest.mark.parametrize(("guides", "zones"), [(2, False), (0, True), (2, True)])
def test_no_sides_are_cheaper_than_a_guided_cut(guides: int, zones: bool, cell: int) -> None:
    barred, moved = 0, 0
    for seed in range(6):
        asked = Asked(seed, guides, zones=zones, cell=cell)
        if seed % 2 == 0:  # all is laid but a corner
            asked.pixels.marks[:] = 1
            asked.pixels.marks[16:, 16:] = 0
        asked.pixels.marks[4:9, 15:20] |= 8 * (asked.pixels.marks[4:9, 15:20] & 1)  # stays
        # About as far from what is laid as it is off: then the cut goes by both.
        asked.pixels.old[:] = asked.match.image[asked.base + asked.pixels.ys * SHAPE[1] + asked.pixels.xs]
        asked.pixels.old[:] ^= asked.rng.integers(0, 16, (SIZE, SIZE))
        if guides:
            asked.pixels.off[:] = asked.rng.permutation(asked.price().ravel()).reshape(SIZE, SIZE)
        covered = np.pad(asked.pixels.marks, 1, mode="edge")
        energy, mask = Energy(asked, covered, zones=zones), np.full((SIZE // cell) ** 2, 9, np.uint8)
        cut(covered, asked.match, asked.numbers, asked.base, asked.pixels, asked.scratch, mask)
        found = mask.reshape(energy.seeds.shape)
        np.testing.assert_array_equal(found, energy.held(found))
        assert not found[energy.barred].any()
        least = energy.of(found)
        for _ in range(20):
            share = asked.rng.choice([0.02, 0.1, 0.5])
            other = energy.held(found ^ (asked.rng.random(found.shape) < share))
            assert energy.of(other) >= least
        for n in (0, 1):
            assert energy.of(energy.held(np.full(found.shape, n))) >= least
        barred += energy.barred.sum()
        moved += len(np.unique(found[~np.isin(energy.seeds, (OLD, NEW, OUTSIDE))])) == 2
    assert (barred > 0) == zones
    assert moved or not guides


@pytest.mark.parametrize("centre", [(45, 40), (3, 50), (101, 88)])
def test_a_frame_tells_what_is_asked_and_what_stays(centre: tuple[int, int]) -> None:
    asked = Asked(centre[0])
    ground, _ = plane(90, 75).ground(1e9)
    bare = ground.canvases
    bare.triangles[:] = 0
    shape, rng = (int(bare.heights[0]), int(bare.widths[0])), asked.rng
    canvases = bare._replace(
        fixed=3,
        wanted=rng.integers(-64, 256, (2, shape[0] * shape[1])).clip(0).astype(np.uint8),
        zones=rng.choice([0, 1, 2, EITHER + 1, EITHER + 2], shape[0] * shape[1]).astype(np.uint8),
    )
    canvases.owners[:] = rng.integers(-4, 9, shape).clip(-1).ravel()
    canvases.sources[:] = rng.integers(0, SHAPE[0] * SHAPE[1], canvases.sources.shape)
    records = np.zeros((9, BLOCK_COLUMNS), np.int32)
    records[:, :2] = rng.integers(0, SHAPE, (9, 2))
    out, fits = Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    clear = ground.clear._replace(crossed=np.zeros_like(ground.clear.crossed))
    half, root = SIZE / 2, np.array([0, *centre, 0, 0, 0.0])
    count = lie(ground.field, clear, root, half, out, fits)
    assert count > 0
    covered, inside = np.zeros((SIZE + 2, SIZE + 2), np.uint8), np.zeros(len(ground.mesh.triangles), np.uint8)
    sizes, pixels = np.zeros(2, np.int64), asked.pixels
    look(canvases, asked.match, records, out, count, inside, covered, pixels, np.zeros(8, np.int64), sizes)
    i, j = np.mgrid[:SIZE, :SIZE] - SIZE // 2 + np.array(centre)[:, None, None]
    on = (i >= 0) & (j >= 0) & (i < shape[0]) & (j < shape[1])
    at = np.where(on, i * shape[1] + j, 0)
    owners = np.where(on, canvases.owners[at], -1)
    laid, stays = owners >= 0, (owners >= 0) & (owners < 3)
    np.testing.assert_array_equal(pixels.marks, np.where(on, laid + 8 * stays, 2))
    np.testing.assert_array_equal(pixels.wanted, canvases.wanted[:, at] * on)
    np.testing.assert_array_equal(pixels.zones, canvases.zones[at] * on)
    assert sizes.tolist() == [laid.sum(), (on & ~laid).sum()]
    # What is laid pays for what it shows.
    apart = np.abs(asked.guides.reshape(2, -1)[:, canvases.sources[at]].astype(int) - pixels.wanted)
    off = sum(
        np.where(goal > 0, cost[d], 0)
        for cost, d, goal in zip(asked.costs, apart, pixels.wanted, strict=True)
    )
    np.testing.assert_array_equal(pixels.off[laid], off[laid])
    assert len(np.unique(pixels.off[laid])) > 2


@pytest.mark.parametrize("zone", [0, 1, 2])
@pytest.mark.parametrize("guides", [0, 2])
def test_the_first_block_is_drawn_from_its_zone_and_from_the_best(guides: int, zone: int) -> None:
    asked = Asked(zone, guides)
    span, choice, step = asked.span, asked.choice, asked.numbers.guide_step
    inside = np.zeros(SHAPE, bool)
    inside[span.first_y : span.last_y + 1, span.first_x : span.last_x + 1] = True
    allowed = inside & ((asked.zone == zone) | (zone == 0))
    kept = (asked.zone * inside).astype(np.uint8).reshape(-1)
    match = asked.match._replace(allowed=kept, places=np.flatnonzero(kept))
    choice.penalties[:] = asked.rng.integers(0, 12000, choice.penalties.shape)
    choice.zone[0] = zone
    out = np.zeros((600, 2), np.int64)
    weights, state = LayWeights(0.2, 0.0, 0.0, 0.0, 0.0), np.array([7], np.uint64)
    draw_first(match, asked.numbers, weights, state, span, choice, out)
    assert allowed[tuple(out.T)].all()
    drawn = {tuple(place) for place in out.tolist()}
    if not guides:
        assert len(drawn) > 0.5 * min(len(out), allowed.sum())
        return
    cost = choice.penalties.repeat(step, axis=0).repeat(step, axis=1)[: SHAPE[0], : SHAPE[1]]
    best = allowed & (cost == cost[allowed].min())
    assert drawn == {tuple(place) for place in np.argwhere(best).tolist()}


@pytest.mark.parametrize("size", [0.5, 1.0, 1.7])
@pytest.mark.parametrize("degrees", [0.0, 90.0, 33.0, -140.0])
def test_a_piece_lies_turned_and_scaled(degrees: float, size: float) -> None:
    placed, _ = plane(90, 75).placed(12.0)
    ground, step, n = placed.ground, (0, 52, 47), 0
    canvases = ground.canvases
    piece = PutPiece(step, (10, 12, 20, 28), size, degrees)
    frame = piece_frame(piece, lay_numbers(*SHAPE, SIZE))
    centres = centres_at(placed, np.array([step], np.int32))
    records, fits = np.zeros((1, BLOCK_COLUMNS), np.int32), np.zeros((MOST_SHEETS, FIT))
    records[0, :2] = frame.source
    blocks = BlockArrays(centres.triangles, centres.roots, centres.spots, np.ones(1), records)
    scratch = LayScratch.of(ground, frame.numbers)
    before = canvases.triangles.copy()
    pieces = put_block(ground, frame.numbers, blocks, n, piece.turn(), frame.half, frame.mask, fits, scratch)
    assert pieces == 1
    # As complex numbers, columns + i · rows: clockwise is the way of positive angles.
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    away = (columns - step[2] + 1j * (rows - step[1])) / (size * np.exp(1j * np.radians(degrees)))
    beyond = np.maximum(np.abs(away.imag) - 10, np.abs(away.real) - 14)
    on, shown = before.reshape(shape) >= 0, canvases.owners.reshape(shape) == n
    assert shown[on & (beyond < -1)].all()
    assert not shown[beyond > 1].any()
    row, column = divmod(canvases.sources.reshape(shape)[shown], SHAPE[1])
    read = column - frame.source[1] + 1j * (row - frame.source[0]) - away[shown]
    assert np.abs(np.stack([read.real, read.imag])).max() <= 0.5 + 1e-6
    # So does its sheet, without rounding.
    places = np.argwhere(shown).astype(float)
    sheets, sources = np.zeros(len(places), np.int64), np.empty(places.shape)
    read_cells(ground.field, fits, sheets, places, sources)
    np.testing.assert_allclose(sources[:, 1] + 1j * sources[:, 0], away[shown], atol=0.02)
    assert shown.sum() == pytest.approx(20 * 28 * size**2, rel=0.1)
