"""Method "pixel" once more, in plain NumPy and one texel after another: the oracle of its tests."""

from itertools import pairwise

import numpy as np

REACH = 2
STEPS = [
    (i, j)
    for ring in (1, 2)
    for i in range(-ring, ring + 1)
    for j in range(-ring, ring + 1)
    if max(abs(i), abs(j)) == ring
]
PARENT_STEPS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
CONTINUED = [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1), (-1, -1), (-1, 0), (-1, 1), (0, -1)]


def plain_images(working, levels):
    """Return the exemplar's samples of 10 bits as means of tiles of 2^level, in 8 bits, the finest first."""
    tile = 2**levels
    height, width = (size // tile * tile for size in working.shape[:2])
    images = []
    for level in range(levels + 1):
        side = 2**level
        tiles = working[:height, :width].reshape(height // side, side, width // side, side, -1)
        images.append(np.floor(tiles.mean(axis=(1, 3)) / 4 + 0.5))
    return images


def candidates(image):
    """Return all candidates (row, column), in order."""
    height, width = image.shape[:2]
    return [(r, c) for r in range(REACH, height - REACH) for c in range(REACH, width - REACH)]


class PlainLevel:
    """The exemplar on one level: what a candidate's neighbourhood costs."""

    def __init__(self, image, coarser):
        self.image, self.coarser = image, coarser
        self.inside = candidates(image)
        self.similar = {}

    def cost(self, place, own, parent):
        """Return what known neighbours, by step, cost at a candidate; `parent` are the coarser level's."""
        total = 0
        for (i, j), (row, column) in own.items():
            total += ((self.image[place[0] + i, place[1] + j] - self.image[row, column]) ** 2).sum()
        for (i, j), (row, column) in parent.items():
            there = self.coarser[place[0] // 2 + i, place[1] // 2 + j]
            total += ((there - self.coarser[row, column]) ** 2).sum()
        return total

    def around(self, place):
        """Return the neighbourhood of a pixel of the exemplar, as `cost` takes it."""
        own = {(i, j): (place[0] + i, place[1] + j) for i, j in STEPS}
        if self.coarser is None:
            return own, {}
        return own, {(i, j): (place[0] // 2 + i, place[1] // 2 + j) for i, j in PARENT_STEPS}

    def fill_similar(self, count, above):
        """Find for each candidate the `count` others most like it: of all, or below those of its parent."""
        inside = set(self.inside)
        for place in self.inside:
            others = self.inside
            if above is not None:
                parent = (place[0] // 2, place[1] // 2)
                rows = [(2 * r, 2 * c) for r, c in [parent, *above.similar.get(parent, [])]]
                others = [(r + i, c + j) for r, c in rows for i in (0, 1) for j in (0, 1)]
            around = self.around(place)
            costs = [
                (self.cost(other, *around), n)
                for n, other in enumerate(others)
                if other != place and other in inside
            ]
            self.similar[place] = [others[n] for _, n in sorted(costs)[:count]]


def plain_levels(working, levels, similar):
    """Return the exemplar's levels, the finest first."""
    images = [*plain_images(working, levels), None]
    found = [PlainLevel(image, coarser) for image, coarser in pairwise(images)]
    above = None
    for level in reversed(found):
        level.fill_similar(similar, above)
        above = level
    return found


def choose(level, own, parent, itself, full, lone):
    """Return the candidate that fits a texel's known neighbours best."""
    if not own and not parent:
        return itself if itself is not None else lone
    best, least = None, np.inf
    known = own | ({(0, 0): itself} if itself is not None else {})
    tried = []
    for i, j in CONTINUED:
        if (i, j) not in known:
            continue
        place = (known[i, j][0] - i, known[i, j][1] - j)
        if place in level.similar:
            tried += [place, *level.similar[place]]
    for place in [*tried, *(level.inside if full else [])]:
        cost = level.cost(place, own, parent)
        if cost < least:
            best, least = place, cost
    return itself if best is None else best


class PlainSurface:
    """Sources of charts' texels on one level; `beyond` takes (chart, row, column) of frames to texels."""

    def __init__(self, shapes, beyond):
        self.shapes, self.beyond = shapes, beyond
        self.sources = [{} for _ in shapes]
        self.frames = {}

    def refresh(self):
        """Copy what charts hold to the frames."""
        self.frames = {
            place: self.sources[n][row, column]
            for place, (n, row, column) in self.beyond.items()
            if (row, column) in self.sources[n]
        }

    def at(self, n, row, column):
        """Return the source of a texel on a chart or its frame; None where there is none yet."""
        height, width = self.shapes[n]
        if 0 <= row < height and 0 <= column < width:
            return self.sources[n].get((row, column))
        return self.frames.get((n, row, column))

    def known(self, n, row, column, steps):
        """Return the neighbours that are known, by step."""
        found = {(i, j): self.at(n, row + i, column + j) for i, j in steps}
        return {step: source for step, source in found.items() if source is not None}


def plain_pixel(levels, surfaces, rounds, lone, full, passes):
    """Synthesise; `levels` of the exemplar and `surfaces`, the finest first. Return the finest's sources."""
    top, level = surfaces[-1], levels[-1]
    for members in rounds:
        top.refresh()
        for n in members:
            height, width = top.shapes[n]
            for row in range(height):
                for column in range(width):
                    own = top.known(n, row, column, STEPS)
                    top.sources[n][row, column] = choose(level, own, {}, None, True, lone[n])
    for depth in range(len(levels) - 1, -1, -1):
        surface, coarsest = surfaces[depth], depth == len(levels) - 1
        if not coarsest:
            surfaces[depth + 1].refresh()
            for n, (height, width) in enumerate(surface.shapes):
                for row in range(height):
                    for column in range(width):
                        parent = surfaces[depth + 1].sources[n][row // 2, column // 2]
                        surface.sources[n][row, column] = (
                            2 * parent[0] + row % 2, 2 * parent[1] + column % 2
                        )  # fmt: skip
        for _ in range(1 if coarsest else passes):
            again(levels[depth], surface, None if coarsest else surfaces[depth + 1], full or coarsest)
    return [
        np.array([[part[r, c] for c in range(width)] for r in range(height)])
        for part, (height, width) in zip(surfaces[0].sources, surfaces[0].shapes, strict=True)
    ]


def again(level, surface, above, full):
    """Choose all texels of a level again, in nine classes."""
    for first in np.ndindex(3, 3):
        surface.refresh()
        before = [dict(part) for part in surface.sources]
        for n, (height, width) in enumerate(surface.shapes):
            for row in range(first[0], height, 3):
                for column in range(first[1], width, 3):
                    own = surface.known(n, row, column, STEPS)
                    parent = {}
                    if above is not None:
                        parent = above.known(n, row // 2, column // 2, PARENT_STEPS)
                    itself = before[n][row, column]
                    surface.sources[n][row, column] = choose(level, own, parent, itself, full, None)
