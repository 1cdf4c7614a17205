"""Choosing a block's source: find candidates by boxes' means, judge them by texels, refine, take a good one.

Candidates are every `step`-th pixel at which the block reads only used pixels inside the exemplar. Each costs
more by what nearby blocks show of it. Those that cost least by boxes' means are judged by the texels
themselves (every other one, as on a chessboard). Then the pixels around the best ones are judged too; the
cheapest is taken.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64, uint64
from upholster.runtime.jit import inline, shared
from upholster.synthesis.quilt.kernels._block_kernels import (
    REFINED,
    ChoiceScratch,
    FramePixels,
    LayNumbers,
    LayWeights,
    MatchImage,
    Span,
    squared_difference,
)
from upholster.synthesis.quilt.kernels._phase_kernels import MISFIT, misfit
from upholster.synthesis.quilt.kernels._search_kernels import draw, search, use_nearby

__all__ = ["choose_source", "draw_fitting", "judge_sources", "next_best"]

_BIG = int64(2**60)

_FAR = int64(2)
"""Candidates that cost more than this many times the best are not compared to the end."""

_DRAWN = int64(1024)
"""Number of different random values."""

_CLOSE = MISFIT // 32
"""A source drawn for a block on bare steps has a misfit at most this much above the best."""


@inline
def _is_allowed(match: MatchImage, choice: ChoiceScratch, place: Any) -> Any:
    # Whether a block may have its source at a pixel.
    if match.allowed.shape[0] == 0:
        return True
    return match.allowed[place] != 0 and (choice.zone[0] == 0 or match.allowed[place] == choice.zone[0])


@inline
def _draw_place(
    match: MatchImage, numbers: LayNumbers, state: NDArray[np.uint64], span: Span, choice: ChoiceScratch
) -> Any:
    # Draws a pixel of a span, or one of the allowed pixels, which are in every span.
    if match.places.shape[0]:
        while True:
            place = match.places[draw(state, match.places.shape[0])]
            if _is_allowed(match, choice, place):
                return place
    y = span.first_y + draw(state, span.last_y - span.first_y + 1)
    return y * numbers.width + span.first_x + draw(state, span.last_x - span.first_x + 1)


@inline
def _is_asked(match: MatchImage) -> Any:
    # Whether some places fit better than others even on bare steps.
    return match.phases.shape[0] > 0 or match.guides.shape[0] > 0


@inline
def _misfit_at(
    match: MatchImage, numbers: LayNumbers, weights: LayWeights, choice: ChoiceScratch, place: Any
) -> Any:
    # The cost of a pixel's phases and guides; a pixel that is not allowed has the largest cost.
    if not _is_allowed(match, choice, place):
        return _BIG
    found = int64(misfit(match.phases, choice.wanted, place))
    if match.guides.shape[0] == 0:
        return found
    i = min(place // numbers.width // numbers.guide_step, choice.penalties.shape[0] - 1)
    j = min(place % numbers.width // numbers.guide_step, choice.penalties.shape[1] - 1)
    return int64(weights.phase * found + choice.penalties[i, j])


@inline
def draw_fitting(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    state: NDArray[np.uint64],
    span: Span,
    choice: ChoiceScratch,
) -> tuple[Any, Any]:
    """Draw an allowed pixel of a span: any, or if there are phases or guides, one that fits about best."""
    if not _is_asked(match):
        place = _draw_place(match, numbers, state, span, choice)
        return place // numbers.width, place % numbers.width
    close, least, good = int64(_CLOSE), _BIG, int64(0)
    if match.guides.shape[0]:
        close = int64(weights.phase * _CLOSE)
    for y in range(span.first_y, span.last_y + 1):
        for x in range(span.first_x, span.last_x + 1):
            cost = _misfit_at(match, numbers, weights, choice, y * numbers.width + x)
            if cost < least:
                least = cost
    for y in range(span.first_y, span.last_y + 1):
        for x in range(span.first_x, span.last_x + 1):
            cost = _misfit_at(match, numbers, weights, choice, y * numbers.width + x)
            good += cost <= least + close
    pick = draw(state, good)
    for y in range(span.first_y, span.last_y + 1):
        for x in range(span.first_x, span.last_x + 1):
            if _misfit_at(match, numbers, weights, choice, y * numbers.width + x) <= least + close:
                if pick == 0:
                    return y, x
                pick -= 1
    return int64(span.first_y), int64(span.first_x)


@inline
def _list_features(numbers: LayNumbers, span: Span, pixels: FramePixels, choice: ChoiceScratch) -> Any:
    # Lists the means of completely laid boxes; returns their number.
    ys, xs, low = pixels.ys, pixels.xs, np.int32(255)
    count = int64(0)
    for a in range(0, numbers.size - 3, 4):
        for b in range(0, numbers.size - 3, 4):
            total, whole = int64(0), np.uint8(1)
            for i in range(a, a + 4):
                for j in range(b, b + 4):
                    whole &= pixels.marks[uint64(i), uint64(j)]
                    total += pixels.old[uint64(i), uint64(j)] & low
            if whole & 1:
                # The box's centre is midway between two pixels' centres, 1½ pixels from the first of four.
                y, x = (
                    (ys[a + 1, b + 1] + ys[a + 2, b + 2] - 3) >> 1,
                    (xs[a + 1, b + 1] + xs[a + 2, b + 2] - 3) >> 1,
                )
                choice.features[count, 0] = max(min(y, span.high_y - 3), span.low_y)
                choice.features[count, 1] = max(min(x, span.high_x - 3), span.low_x)
                choice.means[count] = (total + 8) >> 4
                count += 1
    return count


@inline
def _list_samples(numbers: LayNumbers, pixels: FramePixels, choice: ChoiceScratch) -> Any:
    # Lists every other laid pixel, as on a chessboard; returns their number. Pixels far from each other come
    # first: every n-th, then those right after them, and so on.
    width, listed = np.int32(numbers.width), choice.listed
    count = int64(0)
    for i in range(numbers.size):
        row = uint64(i)
        for j in range(i & 1, numbers.size, 2):
            # Always written, then counted only if it is laid: this is faster than a branch.
            at, column = uint64(count), uint64(j)
            listed[0, at] = np.int32(pixels.ys[row, column] * width) + pixels.xs[row, column]
            listed[1, at] = pixels.old[row, column]
            count += pixels.marks[row, column] & np.uint8(1)
    rounds, at = _rounds(count), int64(0)
    for first in range(rounds):
        for n in range(first, count, rounds):
            choice.offsets[uint64(at)], choice.values[uint64(at)] = listed[0, uint64(n)], listed[1, uint64(n)]
            at += 1
    return count


@inline
def _rounds(samples: Any) -> Any:
    # The number of rounds in which samples are compared: about 24 samples in each.
    return max(1, samples // 24)


@inline
def _compare(
    image: NDArray[np.int32],
    place: int,
    offsets: NDArray[np.int32],
    values: NDArray[np.int32],
    start: int,
    stop: int,
) -> Any:
    # The sum of squared differences of a candidate and samples from `start` to before `stop`, at most 48.
    total = np.int32(0)
    for t in range(start, stop):
        one = image[uint64(place + offsets[uint64(t)])]
        total = np.int32(total + squared_difference(one, values[uint64(t)]))
    return int64(total)


@inline
def _is_as_before(numbers: LayNumbers, choice: ChoiceScratch, place: int) -> Any:
    # Whether a source is about that which the block's centre showed before it is laid again.
    avoid, reach = choice.avoid[0], numbers.size // 4
    down = abs(place // numbers.width - avoid // numbers.width)
    return avoid >= 0 and down < reach and abs(place % numbers.width - avoid % numbers.width) < reach


@inline
def _judge(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    state: NDArray[np.uint64],
    choice: ChoiceScratch,
    samples: int,
    part: tuple[int, int],
    least: int,
) -> int:
    # Judges the candidates in the range `part`, from, to: a candidate's squared differences in all samples,
    # plus its penalty and its phase's cost for each sample; these count once if there are no samples. Use
    # and chance multiply the sum, also where all fits. `least` is the lowest cost so far; a sum that exceeds
    # it by far is stopped. Returns the lowest cost.
    penalties, rounds = choice.penalties, _rounds(samples)
    last_row, last_column = penalties.shape[0] - 1, penalties.shape[1] - 1
    times = max(samples, 1 if _is_asked(match) else 0)
    for m in range(part[0], part[1]):
        place = choice.kept[m]
        y, x = place // numbers.width, place % numbers.width
        penalty = penalties[min(y // numbers.guide_step, last_row), min(x // numbers.guide_step, last_column)]
        total, stop = int64((penalty + weights.floor) * times) + 1, int64(0)
        if match.phases.shape[0]:
            total += int64(weights.phase * misfit(match.phases, choice.wanted, place) * times)
        more = 1.0 + weights.variety * use_nearby(numbers, choice, y, x)
        more += weights.chance * draw(state, _DRAWN) / _DRAWN
        limit = _FAR * least / more
        for first in range(rounds):
            start, stop = stop, stop + (samples - first + rounds - 1) // rounds
            total += _compare(match.image, place, choice.offsets, choice.values, start, stop)
            if total > limit:
                break
        cost = _BIG if _is_as_before(numbers, choice, place) else int64(total * more)
        choice.judged[m] = cost
        least = min(least, cost)
    return least


@inline
def _list_refined(
    match: MatchImage, numbers: LayNumbers, span: Span, choice: ChoiceScratch, stop: int
) -> int:
    # Appends the allowed pixels around the best candidates: the cheapest candidate first, ties in order.
    kept, judged, reach = choice.kept, choice.judged, numbers.step // 2
    end = stop
    cost, place = int64(-1), int64(-1)
    for _ in range(REFINED):
        best = int64(-1)
        for m in range(stop):
            later = judged[m] > cost or (judged[m] == cost and m > place)
            if later and (best < 0 or judged[m] < judged[best]):
                best = m
        if best < 0:
            break
        cost, place = judged[best], best
        y, x = kept[best] // numbers.width, kept[best] % numbers.width
        for i in range(max(y - reach, span.first_y), min(y + reach, span.last_y) + 1):
            for j in range(max(x - reach, span.first_x), min(x + reach, span.last_x) + 1):
                if (i != y or j != x) and _is_allowed(match, choice, i * numbers.width + j):
                    kept[end] = i * numbers.width + j
                    end += 1
    return end


@shared
def judge_sources(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    state: NDArray[np.uint64],
    span: Span,
    pixels: FramePixels,
    choice: ChoiceScratch,
) -> Any:
    """Find and judge a block's candidates; return their number.

    `choice` contains the places' penalties and the sources of blocks nearby, and receives the candidates and
    their costs.
    """
    count = _list_features(numbers, span, pixels, choice)
    samples = _list_samples(numbers, pixels, choice)
    if count or _is_asked(match):
        stop = search(match, numbers, weights, span, count, choice)
    else:  # too little is laid for a search
        stop = int64(numbers.shortlist)
        for m in range(stop):
            choice.kept[m] = _draw_place(match, numbers, state, span, choice)
    part = (int64(0), stop)
    least = _judge(match, numbers, weights, state, choice, samples, part, _BIG)
    if numbers.step > 1:
        part = (stop, _list_refined(match, numbers, span, choice, stop))
        _judge(match, numbers, weights, state, choice, samples, part, least)
        stop = part[1]
    return stop


@inline
def choose_source(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    state: NDArray[np.uint64],
    span: Span,
    pixels: FramePixels,
    choice: ChoiceScratch,
) -> tuple[Any, Any, Any]:
    """Choose a block's source; return its row, its column and its cost.

    `choice` contains the places' penalties and the sources of blocks nearby.
    """
    stop = judge_sources(match, numbers, weights, state, span, pixels, choice)
    taken = np.argmin(choice.judged[:stop])
    chosen = choice.kept[taken]
    return chosen // numbers.width, chosen % numbers.width, choice.judged[taken]


@inline
def next_best(numbers: LayNumbers, choice: ChoiceScratch, stop: int) -> Any:
    """Return the cheapest candidate, and drop it and those within two pixels of it; −1: none is left."""
    best = int64(-1)
    for m in range(stop):
        if choice.judged[m] < _BIG and (best < 0 or choice.judged[m] < choice.judged[best]):
            best = int64(m)
    if best < 0:
        return best
    place = choice.kept[best]
    y, x = place // numbers.width, place % numbers.width
    for m in range(stop):
        other = choice.kept[m]
        if abs(other // numbers.width - y) <= 2 and abs(other % numbers.width - x) <= 2:
            choice.judged[m] = _BIG
    return place
