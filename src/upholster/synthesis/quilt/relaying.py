"""The places that are laid again once all blocks are laid: those where cuts cost most."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from upholster.synthesis.quilt.centres import Centres, centres_on_grids
from upholster.synthesis.quilt.kernels._relay_kernels import cost_steps, sum_around
from upholster.synthesis.quilt.laid_blocks import LaidBlocks

__all__ = ["costly_centres"]

_AGAIN = 0.5
"""Distance of the places where laying again is tried, relative to that of blocks."""

_TIMES = 6
"""Number of times that the worst places are laid again: each time others, and all in parallel."""

_APART = 0.7
"""Distance within which only the place with the highest cost of cuts is laid again at a time, in blocks."""

_INNER = 0.35
"""Half the side of the square around such a place in which cuts must cost much, in blocks."""


def costly_centres(blocks: LaidBlocks, apart: float) -> Iterator[Centres]:
    """Yield the places to be laid again next; `apart` is the distance of blocks on a grid, in steps."""
    centres = centres_on_grids(blocks.placed, blocks.own, _AGAIN * apart, blocks.plan.scene.sizes)
    for _ in range(_TIMES):
        worst = _are_costly(blocks, centres)
        yield centres.chosen(worst)
        centres = centres.chosen(~worst)


def _are_costly(blocks: LaidBlocks, centres: Centres) -> NDArray[np.bool_]:
    # Which of some centres have cuts around them that cost much, and more than around all others near them.
    plan, ground = blocks.plan, blocks.placed.ground
    canvases, costs = ground.canvases, np.zeros(len(ground.canvases.owners))
    cost_steps(ground, plan.match, plan.numbers, blocks.records, costs)
    found, least = np.zeros(len(centres.steps)), plan.weights.relay * plan.numbers.size
    pixel = plan.steps_per_unit / blocks.scales_at(centres)  # in steps
    reach = np.maximum(1, np.rint(_INNER * plan.numbers.size * pixel)).astype(np.int64)
    sum_around(canvases, costs, centres.roots, reach, found)
    found /= pixel
    near = plan.near(centres.spots, _APART)
    rows, highest = np.flatnonzero(np.diff(near.firsts)), np.zeros(len(found))
    highest[rows] = np.maximum.reduceat(found[near.others], near.firsts[rows])
    worst: NDArray[np.bool_] = (found >= highest) & (found > least)
    return worst
