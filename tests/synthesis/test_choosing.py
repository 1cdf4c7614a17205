"""What a block shows, and where its border runs: kernels against plain twins."""

from typing import Any

import numpy as np
import pytest
from laying import texture
from laying_kernels import choose, cut, draw_first, lay_numbers
from plain_laying import (
    SYMMETRIES,
    Draws,
    PlainChoice,
    box_means,
    misfits,
    plain_cut_block,
)
from repeating import repeating

from upholster.synthesis.quilt.kernels._block_kernels import (
    ChoiceScratch,
    CutScratch,
    FramePixels,
    LayWeights,
    Span,
)
from upholster.synthesis.quilt.kernels._search_kernels import mean_boxes
from upholster.synthesis.quilt.match_pyramid import SamplePart, match_pyramid


@pytest.mark.parametrize("step", [1, 2, 4])
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 9, 2), (16, 16, 3), (37, 22, 4)])
def test_boxes_means_lie_in_groups(shape: tuple[int, int, int], step: int) -> None:
    image = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    found = mean_boxes(np.ascontiguousarray(image[..., 0]), step)
    wanted = box_means(image)
    rows, columns = -(-shape[0] // step), -(-shape[1] // step)
    assert found.shape == (step * step, rows * columns)
    for a, b in np.ndindex(step, step):
        part = wanted[a::step, b::step]
        group = found[a * step + b].reshape(rows, columns)
        assert (group[: part.shape[0], : part.shape[1]] == part).all()


class Frame:
    """A frame over a smooth texture, partly laid, as kernels and as the twins take it."""

    def __init__(
        self, exemplar: np.ndarray, size: int, symmetry: int, seed: int, lattice: Any = None, **more: Any
    ):
        self.pyramid = match_pyramid(exemplar, 0, [SamplePart.whole(exemplar, lattice)])
        self.level, rng = self.pyramid.levels[0], np.random.default_rng(seed)
        self.match, self.rng = self.level.match, rng
        height, width = exemplar.shape[:2]
        self.numbers = lay_numbers(
            height,
            width,
            size,
            step=self.level.step,
            shortlist=more.get("shortlist", 32),
            guide_step=self.pyramid.stride(0),
        )
        # Costs are multiples of 1/4: then sums are exact in the search's float32, in any order.
        self.weights = LayWeights(
            more.get("variety", 0.3),
            more.get("chance", 0.0),
            0.25 if lattice else 0.0,
            0.0,
            more.get("floor", 0.0),
        )
        self.image = self.match.image.view(np.uint8).reshape(height, width, 4)
        turn, (i, j) = SYMMETRIES[symmetry], np.mgrid[:size, :size] - size // 2
        self.pixels = FramePixels.of(size)
        self.pixels.ys[:], self.pixels.xs[:] = turn[0] * i + turn[1] * j, turn[2] * i + turn[3] * j
        ys, xs = self.pixels.ys, self.pixels.xs
        self.span = Span(
            *(int(-ys.min()), int(height - 1 - ys.max()), int(-xs.min()), int(width - 1 - xs.max())),
            *(int(ys.min()), int(ys.max()), int(xs.min()), int(xs.max())),
        )
        self.allowed = None
        if "allowed" in more:  # a part of all places, and one square of them at least
            self.allowed = np.zeros((height, width), bool)
            self.allowed[self.span.first_y : self.span.last_y, self.span.first_x : self.span.last_x] = True
            self.allowed &= rng.random((height, width)) < more["allowed"]
            y, x = self.span.first_y + 3, self.span.first_x + 5
            self.allowed[y : y + 4, x : x + 4] = True
            self.match = self.match._replace(
                allowed=self.allowed.view(np.uint8).reshape(-1), places=np.flatnonzero(self.allowed)
            )
        self.choice = ChoiceScratch.of(self.numbers)
        self.choice.penalties[:] = rng.integers(0, more.get("dear", 400), self.choice.penalties.shape)
        self.choice.wanted[:] = [(0, 1, 12345), (1, -1, -2345)]
        self.choice.avoid[0] = more.get("avoid", -1)
        self.choice.nearby[0] = near = more.get("near", 3)
        self.choice.near[:near] = rng.integers(0, (height, width), (near, 2))
        # What is laid: a part of the sample, a little changed.
        place = rng.integers(0, (height, width))
        laid = np.roll(self.image, -place, axis=(0, 1))[:size, :size] + rng.integers(0, 30, (size, size, 4))
        self.old = np.clip(laid, 0, 255).astype(np.uint8) * (np.arange(4) < exemplar.shape[2]).astype(
            np.uint8
        )
        self.pixels.old[:] = np.ascontiguousarray(self.old).view("<i4")[..., 0]
        marks = np.zeros((size, size), np.uint8)
        marks[: size // 3], marks[:, : size // 4] = 1, 1
        marks[:3, -3:], marks[size // 3, size // 2 :] = 2, 2
        self.pixels.marks[:] = marks if more.get("laid", True) else 2
        if not more.get("laid", True):
            self.pixels.marks[2, 3:5] = 1  # too little for a box

    def plain(self) -> PlainChoice:
        """Return the twin."""
        near = self.choice.near[: self.choice.nearby[0]]
        pixels, phases = self.pixels, self.match.phases.reshape(-1, *self.image.shape[:2])
        return PlainChoice(
            self.image, self.numbers, self.weights, self.span, pixels.marks, self.old, pixels.ys, pixels.xs,
            self.choice.penalties, phases, self.choice.wanted, self.allowed, near,
            avoid=int(self.choice.avoid[0]),
        )  # fmt: skip


WAVES = repeating(70, 66, [(1 / 12, 0.01), (0.004, 1 / 15)])
CASES: dict[str, tuple[Any, ...]] = {
    "plain": (texture(), 16, 0, {}),
    "nothing nearby": (texture(), 16, 0, {"near": 0, "chance": 0.5}),
    "not as before": (texture(60, 60), 20, 0, {"avoid": 25 * 60 + 30}),
    "many nearby": (texture(60, 60), 20, 0, {"near": 60, "variety": 1.0}),
    "a perfect fit costs something": (texture(60, 60), 20, 0, {"near": 60, "floor": 250.0}),
    "grey, few": (texture(50, 50, 1), 24, 0, {"shortlist": 5}),
    "the best alone": (texture(60, 60), 16, 0, {"variety": 0.0, "dear": 1}),
    "every second pixel": (texture(80, 90), 20, 0, {}),
    "every fourth pixel": (texture(400, 390), 28, 0, {"shortlist": 9}),
    "all judged": (texture(30, 30), 16, 0, {"shortlist": 4000}),
    "turned": (texture(80, 70), 20, 1, {}),
    "transposed": (texture(60, 70), 20, 4, {}),
    "mirrored": (texture(80, 70), 20, 5, {}),
    "too little laid": (texture(), 16, 0, {"laid": False}),
    "a tenth is allowed": (texture(80, 90), 20, 0, {"allowed": 0.1}),
    "few are allowed": (texture(400, 390), 28, 1, {"allowed": 0.0}),
    "few are allowed, too little laid": (texture(), 16, 0, {"allowed": 0.02, "laid": False}),
    "few are allowed, in phase": (*WAVES[:1], 20, 0, {"lattice": WAVES[1], "allowed": 0.02}),
    "in phase": (*WAVES[:1], 20, 0, {"lattice": WAVES[1]}),
    "in phase, turned": (*WAVES[:1], 20, 2, {"lattice": WAVES[1]}),
    "in phase, too little laid": (*WAVES[:1], 20, 0, {"lattice": WAVES[1], "laid": False}),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_source_is_the_twins(name: str, seed: int) -> None:
    exemplar, size, symmetry, more = CASES[name]
    frame = Frame(exemplar, size, symmetry, seed, **more)
    span, draws = frame.span, Draws(seed)
    wanted = frame.plain().choose(draws)
    state, out = np.array([seed], np.uint64), np.zeros(3, np.int64)
    choose(frame.match, frame.numbers, frame.weights, state, span, frame.pixels, frame.choice, out)
    assert tuple(out.tolist()) == wanted
    assert int(state[0]) == draws.state


def test_the_first_block_is_drawn_from_all_sources_or_from_those_in_phase() -> None:
    frame = Frame(texture(), 16, 0, 1)
    out, span = np.zeros((400, 2), np.int64), frame.span
    draw_first(frame.match, frame.numbers, frame.weights, np.array([7], np.uint64), span, frame.choice, out)
    low, high = (span.first_y, span.first_x), (span.last_y, span.last_x)
    assert (out.min(axis=0) == low).all()
    assert (out.max(axis=0) == high).all()
    frame = Frame(WAVES[0], 20, 0, 1, WAVES[1])
    draw_first(
        frame.match, frame.numbers, frame.weights, np.array([7], np.uint64), frame.span, frame.choice, out
    )
    off = misfits(frame.match.phases.reshape(2, *frame.image.shape[:2]), frame.choice.wanted)
    fitting = off[frame.span.first_y : frame.span.last_y + 1, frame.span.first_x : frame.span.last_x + 1]
    assert (off[tuple(out.T)] <= fitting.min() + 2**14 // 32).all()
    assert len(np.unique(out, axis=0)) > 1


@pytest.mark.parametrize("lattice", [None, WAVES[1]])
def test_the_first_block_is_drawn_from_what_is_allowed(lattice: Any) -> None:
    frame = Frame(WAVES[0], 20, 0, 1, lattice, allowed=0.1)
    out = np.zeros((400, 2), np.int64)
    draw_first(
        frame.match, frame.numbers, frame.weights, np.array([7], np.uint64), frame.span, frame.choice, out
    )
    assert frame.allowed is not None
    assert frame.allowed[tuple(out.T)].all()
    drawn = {tuple(place) for place in out.tolist()}
    if lattice is None:
        assert len(drawn) > 0.6 * min(400, frame.allowed.sum())
        return
    off = misfits(frame.match.phases.reshape(2, *frame.image.shape[:2]), frame.choice.wanted)
    best = frame.allowed & (off <= off[frame.allowed].min() + 2**14 // 32)
    assert drawn == {tuple(place) for place in np.argwhere(best).tolist()}


@pytest.mark.parametrize("cell", [2, 4])
@pytest.mark.parametrize("seed", range(6))
def test_a_cut_is_the_cheapest_that_shows_what_is_missing(cell: int, seed: int) -> None:
    frame = Frame(texture(80, 90), 32, seed, seed)
    numbers, rng = frame.numbers._replace(cell=cell), np.random.default_rng(seed)
    marks = frame.pixels.marks
    if seed > 1:  # blobs of all kinds
        blobs = texture(32, 32, 1, seed, 8)[..., 0] // 52
        marks[:] = np.array([0, 1, 1, 2, 1])[blobs.clip(0, 4)]
    covered = np.zeros((34, 34), np.uint8)
    covered[1:-1, 1:-1] = marks
    for side in range(4):
        np.rot90(covered, side)[0] = rng.choice([0, 1, 2], 34)
    y, x = frame.span.first_y + 3, frame.span.first_x + 5
    scratch, mask = CutScratch.of(numbers), np.full((32 // cell) ** 2, 9, np.uint8)
    cut(covered, frame.match, numbers, y * numbers.width + x, frame.pixels, scratch, mask)
    read = frame.image[y + frame.pixels.ys, x + frame.pixels.xs].astype(int)
    apart = ((read - frame.old) ** 2).sum(axis=2)
    wanted = plain_cut_block(apart, covered, marks, cell)
    np.testing.assert_array_equal(mask.reshape(wanted.shape), wanted)
    assert 0 < wanted.sum() < wanted.size or seed > 1
