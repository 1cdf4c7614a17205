"""Method "quilt" once more, in plain Python and NumPy: slow, by the book, an oracle for its kernels.

It shares no code with what it checks: search, cut, laying, features, pyramid, sizes of blocks, matrices,
and random numbers. What other charts leave on a chart it takes from
`BlockTransfer`, which `test_transfer` and `test_quilt_kernels` check, the sample's landmarks and where blocks
lie on the surface from `LandmarkRules`, which `test_landmarks` checks, and the order of charts from
`upholster.charts`.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from plain_cut import FREE, NEW, OLD, OUTSIDE, plain_cut

from upholster.charts.schedule import schedule
from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.methods.quilt.emit import LABEL_CELL
from upholster.methods.quilt.features import pca_features
from upholster.methods.quilt.landmarks import LandmarkRules, ShownBlocks
from upholster.methods.quilt.masked import BLOCK
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements, joined
from upholster.quilt.warp_field import WarpField

# Row per row, row per column, column per row, column per column: rotations by quarters, then the same of the
# transposed square.
SYMMETRIES = (
    *((1, 0, 0, 1), (0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0)),
    *((0, 1, 1, 0), (1, 0, 0, -1), (0, -1, -1, 0), (-1, 0, 0, 1)),
)


def masks_of(laid):
    """Return a chart's blocks' masks, (rows, columns) each; None where there is none."""
    out = []
    for one in laid.placements:
        if one["first_cell"] < 0:
            out.append(None)
            continue
        rows, columns = (-(-int(one[name]) // int(one["mask_cell"])) for name in ("height", "width"))
        out.append(laid.cells[one["first_cell"] :][: rows * columns].reshape(rows, columns))
    return out


def check_same(found, wanted):
    """Check that as much is laid on each chart, in the same order, with the same masks."""
    for one, other in zip(found, wanted, strict=True):
        for name in BLOCK.names:
            if name != "first_cell":
                np.testing.assert_array_equal(one.placements[name], other.placements[name], name)
        for mask, same in zip(masks_of(one), masks_of(other), strict=True):
            np.testing.assert_array_equal(mask, same)


def shown_blocks(laid, chart):
    """Return of each step the last block that shows there, −1 where none does."""
    out = np.full((chart.height, chart.width), -1)
    for n, (one, mask) in enumerate(zip(laid.placements, masks_of(laid), strict=True)):
        top, left = one["row"] - one["height"] // 2, one["column"] - one["width"] // 2
        rows, columns = np.arange(chart.height) - top, np.arange(chart.width) - left
        rows = np.flatnonzero((rows >= 0) & (rows < one["height"]))
        columns = np.flatnonzero((columns >= 0) & (columns < one["width"]))
        cell = int(one["mask_cell"])
        at = np.ix_(rows, columns)
        shows = True if mask is None else mask[np.ix_((rows - top) // cell, (columns - left) // cell)] > 0
        out[at] = np.where(shows, n, out[at])
    return out


def sources_of(laid, chart, field):
    """Return where each step reads, (height, width, 2) in 1/16 pixel, −1 where no block shows."""
    owner = shown_blocks(laid, chart)
    rows, columns = np.nonzero(owner >= 0)
    one = laid.placements[owner[rows, columns]]
    own = one["centred"][:, None] > 0
    centre = np.where(own, one["matrix"], matrix(field, one["row"], one["column"]))
    y, x = offset(centre, matrix(field, rows, columns), rows - one["row"], columns - one["column"])
    turn = np.array(SYMMETRIES)[one["symmetry"]]
    out = np.full((*owner.shape, 2), -1)
    out[rows, columns, 0] = one["source_row"] + turn[:, 0] * y + turn[:, 1] * x
    out[rows, columns, 1] = one["source_column"] + turn[:, 2] * y + turn[:, 3] * x
    return out


def texture(height=56, width=48, channels=3, seed=0, passes=5):
    """Return a smooth random texture, uint8: blocks of it differ, and match better or worse."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(height, width, channels))
    for axis in (0, 1):
        for _ in range(passes):
            noise = (noise + np.roll(noise, 1, axis)) / 2
    noise = (noise - noise.min()) / np.ptp(noise)
    return np.rint(noise * 255).astype(np.uint8)


def node_matrices(field):
    """Return the nodes' matrices in 1/4096, (rows, columns, 4) integers (SPEC.md, section 3)."""
    nodes = field.nodes.astype(np.int64)
    angles = np.rint(2**14 * np.cos(2 * np.pi * np.arange(256) / 256)).astype(np.int64)
    powers = np.rint(2**14 * 2 ** (np.arange(32) / 32)).astype(np.int64)

    def size(steps):
        return powers[steps % 32] << (6 + steps // 32) >> 6

    def cosine(angle):
        return angles[angle % 256]

    b, a, phi, shear = (nodes[..., k] for k in range(4))
    entries = [
        size(b) * cosine(phi + shear),
        size(a) * cosine(phi - 64),
        size(b) * cosine(phi + shear + 64),
        size(a) * cosine(phi),
    ]
    return (np.stack(entries, axis=-1) + 2**15) >> 16


def matrix(field, rows, columns):
    """Return M at texels in 1/4096, (..., 4) integers."""
    m = node_matrices(field)
    rows, columns = np.broadcast_arrays(np.asarray(rows), np.asarray(columns))
    ends = []
    for at, count in ((rows, m.shape[0]), (columns, m.shape[1])):
        place, share = field.margin + at // 32, at % 32
        share = np.where((place < 0) | (place >= count - 1), 0, share)
        place = np.clip(place, 0, count - 1)
        ends.append((place, np.minimum(place + 1, count - 1), share[..., None]))
    (i, below, f), (j, beside, g) = ends
    upper = m[i, j] * (32 - g) + m[i, beside] * g
    lower = m[below, j] * (32 - g) + m[below, beside] * g
    return (upper * (32 - f) + lower * f + 512) >> 10


def matrix_between(field, row, column):
    """Return M between texels, 2 × 2 in pixels per texel: bilinear between the nodes."""
    m = node_matrices(field).reshape(*field.nodes.shape[:2], 2, 2)
    y = min(max(row / 32 + field.margin, 0), m.shape[0] - 1)
    x = min(max(column / 32 + field.margin, 0), m.shape[1] - 1)
    i, j = min(int(y), max(m.shape[0] - 2, 0)), min(int(x), max(m.shape[1] - 2, 0))
    below, beside = min(i + 1, m.shape[0] - 1), min(j + 1, m.shape[1] - 1)
    y, x = y - i, x - j
    upper, lower = (m[k, j] * (1 - x) + m[k, beside] * x for k in (i, below))
    return (upper * (1 - y) + lower * y) / 4096


def offset(first, here, down, right):
    """Return where texels fall, seen from a block's centre, in 1/16 pixel (SPEC.md, section 8)."""
    total = first + here
    return (
        (total[..., 0] * down + total[..., 1] * right + 256) >> 9,
        (total[..., 2] * down + total[..., 3] * right + 256) >> 9,
    )


def main_colours(image):
    """Return the principal components that hold 99 % of the variance, at most four, and the variance.

    Samples in 10 bits; the directions rounded to 1/1024; the first component's inner 99.8 % span 0 to 255,
    the others go by the same scale, from the mean colour on.
    """
    if image.dtype == np.uint8:
        samples = image.astype(np.int64) * 4
    elif image.dtype == np.uint16:
        samples = image.astype(np.int64) // 64
    else:
        span = float(np.ptp(image))
        share = (image.astype(np.float64) - image.min()) / span if span else 0.0 * image
        samples = np.rint(share * 1023).astype(np.int64)
    samples = samples.reshape(-1, image.shape[2])
    samples = samples - np.rint(samples.mean(axis=0)).astype(np.int64)
    values, vectors = np.linalg.eigh((samples.T @ samples).astype(np.float64))
    kept = []
    for k in sorted(range(len(values)), key=lambda k: -values[k])[:4]:
        vector = vectors[:, k]
        kept.append(vector if vector[np.abs(vector).argmax()] > 0 else -vector)
        if sum(sorted(values, reverse=True)[: len(kept)]) >= 0.99 * max(1e-9, values.sum()):
            break
    parts = samples @ np.rint(1024 * np.stack(kept, axis=1)).astype(np.int64)
    ranked, rim = sorted(parts[:, 0].tolist()), len(parts) // 1000
    low, high = ranked[rim], ranked[-1 - rim]
    parts[:, 0] -= (low + high) // 2
    span = max(1, high - low)
    form = ((2 * 255 * parts + 256 * span) // (2 * span)).clip(0, 255)
    mean = form.mean(axis=0)
    return form.reshape(*image.shape[:2], -1), float(((form - mean) ** 2).mean(axis=0).sum())


def half_size(image):
    """Return an image (of integers) filtered by (1, 3, 3, 1)/8 both ways, at every other pixel."""
    for axis in (0, 1):
        size = image.shape[axis]
        padded = np.pad(image, [(1, 2) if k == axis else (0, 0) for k in range(3)], mode="edge")
        taps = [np.take(padded, 2 * np.arange((size + 1) // 2) + k, axis) for k in range(4)]
        image = taps[0] + taps[3] + 3 * (taps[1] + taps[2])
    return (image + 32) >> 6


@dataclass(frozen=True)
class PlainLevel:
    """A level of the exemplar: its main colours (rows, columns, channels), and its candidates' distance."""

    image: Any
    step: int


@dataclass(frozen=True)
class PlainSample:
    """The exemplar as blocks are compared by it."""

    levels: Any
    variance: float
    usage_step: int

    @classmethod
    def of(cls, exemplar, last):
        image, variance = main_colours(exemplar)
        usage_step = max(4, 2**last)
        while max(image.shape[:2]) > 64 * usage_step:
            usage_step *= 2
        levels = []
        for _ in range(last + 1):
            area = image.shape[0] * image.shape[1]
            levels.append(PlainLevel(image, 1 if area <= 64**2 else 2 if area <= 384**2 else 4))
            image = half_size(image)
        return cls(levels, variance, usage_step)

    def unused(self, symmetries):
        """Return a usage grid of zeros for each symmetry, by its number."""
        sides = [-(-side // self.usage_step) for side in self.levels[0].image.shape[:2]]
        return {n: np.zeros(sides) for n in symmetries}


@dataclass(frozen=True)
class PlainGrid:
    """The sizes of a chart's blocks: see `upholster.methods.quilt.grid`."""

    chart: Any
    field: Any
    level: int
    sample: int
    mask_cell: int
    height: int
    width: int
    overlaps: Any
    wrap: bool

    @staticmethod
    def steps(chart, field):
        """Return matrices at 9 × 9 places at most, and how many pixels a step down and one right take."""
        rows = np.linspace(0, chart.height - 1, min(9, chart.height))
        columns = np.linspace(0, chart.width - 1, min(9, chart.width))
        found = np.array([matrix_between(field, row, column) for row in rows for column in columns])
        steps = np.maximum(1e-3, np.sqrt((found**2).sum(axis=1)))
        return found, np.exp(np.log(steps).mean(axis=0))

    @classmethod
    def typical(cls, chart, field):
        """Return how many pixels a texel is wide."""
        _, steps = cls.steps(chart, field)
        return float(np.sqrt(steps[0] * steps[1]))

    @classmethod
    def of(cls, chart, field, shape, block, overlap, coarse, copied, wrap, around):
        found, steps = cls.steps(chart, field)
        typical = cls.typical(chart, field)
        last = max(0, int(np.log2(min(shape) / 16)))
        level = min(max(0, int(np.floor(np.log2(typical) + 0.5))), last)
        sample = max(1, int(np.rint(2**level / typical)))
        cell = 4 * sample if coarse else 2 * sample
        wanted = block / steps
        # A block reads three quarters of the exemplar at most, wherever it lies.
        spans = np.abs(found).max(axis=0) @ wanted
        wanted = np.clip(
            wanted * min(1.0, *(0.75 * side / span for side, span in zip(shape, spans, strict=True))), 16, 512
        )
        # Where the chart meets itself, a block fits in between.
        for axis, size in ((0, chart.height), (1, chart.width)):
            if around & {axis, axis + 2}:
                wanted[axis] = min(wanted[axis], max(16, size))
        if wrap:
            wanted = np.minimum(wanted, (chart.height // 2, chart.width // 2))
        share = block / (0.3 * block if overlap is None else overlap)
        sides, overlaps = [], []
        for texels, pixels in zip(wanted, shape, strict=True):
            side = cell * max(2, int(np.rint(texels / cell)))
            if copied:
                side = max(cell, min(side, pixels // cell * cell))
            sides.append(side)
            least = 8 if overlap is None and level > 0 else 4 * sample
            overlaps.append(min(max(least, cell * int(np.rint(side / share / cell))), side // 2))
        return cls(chart, field, level, sample, cell, *sides, tuple(overlaps), wrap)

    def need(self, waiting):
        """Return rows from, to, columns from, to: beyond edges whose neighbour waits, a little more."""
        rows, columns = (n + 2 * self.mask_cell + 8 for n in self.overlaps)
        # A first block that would end at the edge, or within two texels of it, begins later.
        if rows > self.height - 2:
            rows = self.height - self.overlaps[0]
        if columns > self.width - 2:
            columns = self.width - self.overlaps[1]
        top, right, bottom, left = (edge in waiting for edge in range(4))
        return (
            -rows * top,
            self.chart.height + rows * bottom,
            -columns * left,
            self.chart.width + columns * right,
        )

    def centres(self, need):
        """Return the rows and the columns in which blocks have their centres."""
        out = []
        for axis, block in ((0, self.height), (1, self.width)):
            start, stop = need[2 * axis : 2 * axis + 2]
            step = block - self.overlaps[axis]
            if self.wrap:
                count = -(-(stop - start) // step)
                first = [start + n * (stop - start) // count for n in range(count)]
            else:
                count = max(1, -(-(stop - start - self.overlaps[axis]) // step))
                first = [start + n * step for n in range(count)]
            out.append([at + block // 2 for at in first])
        return out

    @property
    def cells(self):
        return self.height // self.mask_cell * (self.width // self.mask_cell)


BIG = 2**60
REFINED = 4


class Draws:
    """SplitMix64, from its authors' text."""

    def __init__(self, seed):
        self.state = seed

    def below(self, count):
        self.state = (self.state + 0x9E3779B97F4A7C15) % 2**64
        z = self.state
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return (z ^ (z >> 31)) % count


def box_means(image):
    """Return the rounded means of the first channel's 4×4 boxes that begin at each pixel, edges repeating."""
    padded = np.pad(image[..., 0], ((0, 3), (0, 3)), mode="edge")
    total = sum(padded[i : i + image.shape[0], j : j + image.shape[1]] for i in range(4) for j in range(4))
    return (total + 8) >> 4


def judged(differences, start, limit):
    """Return the sum of samples' squared differences, or of as many as it takes to pass the limit.

    Every ⌊count / 24⌋-th sample is taken, then those right after them, and so on.
    """
    rounds_ = max(1, len(differences) // 24)
    total = start
    for first in range(rounds_):
        total += int((differences[first::rounds_] ** 2).sum())
        if total > limit:
            break
    return total


def add_tent(usage_step, stride, centre, reach, by):
    """Add to each point how much of a block there a block at `centre` covers."""
    sides = [
        1.0 - np.abs(np.arange(size) * stride - at) / length
        for size, at, length in zip(usage_step.shape, centre, reach, strict=True)
    ]
    y, x = np.meshgrid(*sides, indexing="ij")
    usage_step += np.where((y > 0) & (x > 0), by * (x * y), 0.0)


def symmetries_of(options):
    """Return the symmetries that blocks may have: left and right exchanged, quarter turns, all eight."""
    if options.rotate:
        return list(range(8 if options.mirror else 4))
    return [0, 5] if options.mirror else [0]


class PlainChart:
    """One chart and its apron while it is covered."""

    def __init__(self, grid, need, level, wrap, wanted=None, index=0):
        self.wanted, self.index = wanted, index
        self.grid, self.need, self.image, self.step, self.wrap = grid, need, level.image, level.step, wrap
        self.pads = (0, 0) if wrap else (2 * grid.height, 2 * grid.width)
        shape = [side + 2 * pad for side, pad in zip(self.shape, self.pads, strict=True)]
        self.means = box_means(self.image)
        self.canvas = np.zeros((*shape, self.image.shape[2]), np.int64)
        self.laid, self.fixed = np.zeros(shape, bool), np.zeros(shape, bool)
        self.shown = np.full(shape, -1)  # symmetries

    @property
    def shape(self):
        return self.grid.chart.height, self.grid.chart.width

    def places(self, first, count, axis):
        """Return where texels lie on the canvas along an axis, -1 beyond it."""
        at = first + np.arange(count) + self.pads[axis]
        size = self.laid.shape[axis]
        return at % size if self.wrap else np.where((at >= 0) & (at < size), at, -1)

    def lay_transferred(self, placements, cells):
        level, field = self.grid.level, self.grid.field
        for one in placements:
            row, column, height, width, cell = (
                int(one[n]) for n in ("row", "column", "height", "width", "mask_cell")
            )
            top, left = row - height // 2, column - width // 2
            mask = cells[one["first_cell"] :][: (height // cell) * (width // cell)]
            mask = mask.reshape(height // cell, width // cell).astype(bool)
            # Covered for sure well inside the mask: a cell and the eight round it.
            ring = np.pad(mask, 1)
            whole = mask.copy()
            for a, b in np.ndindex(3, 3):
                whole &= ring[a : a + mask.shape[0], b : b + mask.shape[1]]
            rows, columns = np.mgrid[top : top + height, left : left + width]
            centre = one["matrix"].astype(np.int64) if one["centred"] else matrix(field, row, column)
            y, x = offset(centre, matrix(field, rows, columns), rows - row, columns - column)
            symmetry = SYMMETRIES[one["symmetry"]]
            y, x = symmetry[0] * y + symmetry[1] * x, symmetry[2] * y + symmetry[3] * x
            y = ((one["source_row"] + y + 8) >> (4 + level)).clip(0, self.image.shape[0] - 1)
            x = ((one["source_column"] + x + 8) >> (4 + level)).clip(0, self.image.shape[1] - 1)
            r, c = rows + self.pads[0], columns + self.pads[1]
            inside = (r >= 0) & (r < self.laid.shape[0]) & (c >= 0) & (c < self.laid.shape[1])
            shown = inside & np.kron(mask, np.ones((cell, cell), bool))
            self.canvas[r[shown], c[shown]] = self.image[y[shown], x[shown]]
            self.shown[r[shown], c[shown]] = one["symmetry"]
            sure = inside & np.kron(whole, np.ones((cell, cell), bool))
            self.laid[r[sure], c[sure]] = True

    def close(self, closed):
        """Mark what lies beyond finished charts' edges, and a rim inside them, as theirs."""
        rows, columns = (np.arange(n) - pad + 0.5 for n, pad in zip(self.laid.shape, self.pads, strict=True))
        for side, start, stop, rim in closed:
            along = (columns, rows)[side & 1]
            ends = [np.rint(end) if np.isfinite(end) else end for end in (start, stop)]
            mine = (along > ends[0]) & (along < ends[1])
            across = (rows, self.shape[1] - columns, self.shape[0] - rows, columns)[side] < rim
            self.fixed |= np.outer(across, mine) if side in (0, 2) else np.outer(mine, across)

    def begin(self, opened, usage, seed):
        """Settle the blocks and their order; return what is laid at a time: blocks from, to, edges closed."""
        self.draws, self.usage = Draws(seed), {s: grid.copy() for s, grid in usage.items()}
        rows, columns = self.grid.centres(self.need)
        self.across = len(columns)
        parts = {}
        for i, row in enumerate(rows):
            late_row = 0 in opened and self.late(i, row, self.grid.height, self.shape[0], self.need[0])
            for j, column in enumerate(columns):
                late = 3 in opened and self.late(j, column, self.grid.width, self.shape[1], self.need[2])
                parts.setdefault((late_row, late), []).append((i, j))
        order = [place for part in sorted(parts) for place in parts[part]]
        number = {place: n for n, place in enumerate(order)}
        self.blocks = [  # row, column, the block to the left, the one above
            (rows[i], columns[j], number.get((i, j - 1), -1), number.get((i - 1, j), -1)) for i, j in order
        ]
        self.sources, self.symmetries = [None] * len(self.blocks), [0] * len(self.blocks)
        out, start = [], 0
        for late_row, late in sorted(parts):
            stop = start + len(parts[late_row, late])
            out.append((start, stop, {edge for edge, yes in ((2, late_row), (1, late)) if yes}))
            start = stop
        return out

    @staticmethod
    def late(n, centre, size, length, need):
        """Tell whether a row or column of blocks is laid after what begins at the opposite edge."""
        first = centre - size // 2
        return n > 0 and (first + size > length + need or 2 * first + size >= length)

    def cover(self, whole, options, start, stop):
        """Choose, cut and lay blocks in order; return the placements, their cells and their numbers."""
        grid, placed, cells, laid_at = self.grid, [], [], []
        blocks, sources = self.blocks, self.sources
        for n in range(start, stop):
            row, column, *_ = blocks[n]
            found = self.lay(n, blocks, sources, whole, self.usage, options, self.draws)
            if found is None:
                continue
            sources[n], one_symmetry, mask = found
            self.symmetries[n] = one_symmetry
            one = np.zeros((), BLOCK)
            one["row"], one["column"], one["height"], one["width"] = row, column, grid.height, grid.width
            one["source_row"], one["source_column"] = sources[n]
            one["symmetry"] = one_symmetry
            one["first_cell"] = -1
            if mask is not None:
                one["mask_cell"] = grid.mask_cell
                one["first_cell"] = len(cells) * grid.cells
            cells.append(np.ones(grid.cells, np.uint8) if mask is None else mask.reshape(-1))
            placed.append(one)
            laid_at.append(n)
        none = np.zeros(0, np.uint8)
        return np.array(placed, BLOCK), np.concatenate([none, *cells]), np.array(laid_at, np.int64)

    def lay(self, n, blocks, sources, whole, usage, options, draws):
        grid = self.grid
        bh, bw = grid.height, grid.width
        row, column, *_ = blocks[n]
        top, left = row - bh // 2, column - bw // 2
        window = np.ix_(self.places(top, bh, 0), self.places(left, bw, 1))
        there = self.laid[window]
        rows, columns = np.mgrid[top : top + bh, left : left + bw]
        needed = (rows >= self.need[0]) & (rows < self.need[1])
        needed &= (columns >= self.need[2]) & (columns < self.need[3])
        if not (needed & ~there).any():
            return None
        best = None
        for symmetry in self.tried(there, self.shown[window], options, draws):
            cost, *found = self.choose(n, symmetry, window, blocks, sources, whole, usage, options, draws)
            if best is None or cost < best[0]:
                best = cost, symmetry, *found
        _, symmetry, source, (y, x), (down, right), reach = best
        mask = self.cut(window, (top, left), needed, y + down, x + right) if there.any() else None
        add_tent(usage[symmetry], whole.usage_step >> grid.level, (y, x), reach, 1.0)
        self.show(n, (y, x), reach)
        new = np.ones((bh, bw), bool)
        if mask is not None:
            new = np.kron(mask, np.ones((grid.mask_cell, grid.mask_cell), bool)).astype(bool)
        self.put(window, new, y + down, x + right, symmetry)
        return source, symmetry, mask

    @staticmethod
    def tried(there, shown, options, draws):
        """Return the symmetries that a block is tried with: the two that most is laid with, and one drawn."""
        allowed = symmetries_of(options)
        if allowed == [0]:
            return [0]
        counts = {s: int((shown[there] == s).sum()) for s in allowed}
        out = sorted((s for s in counts if counts[s]), key=lambda s: -counts[s])[:2]
        one = allowed[draws.below(len(allowed))]
        return out if one in out else [*out, one]

    def choose(self, n, symmetry, window, blocks, sources, whole, usage, options, draws):
        """Return what the best source costs, the source, its pixel, where texels fall from it, how far."""
        grid, level = self.grid, self.grid.level
        bh, bw, sample, shift = grid.height, grid.width, grid.sample, 4 + level
        row, column, *before = blocks[n]
        top, left = row - bh // 2, column - bw // 2
        there, now = self.laid[window], self.canvas[window]
        rows, columns = np.mgrid[top : top + bh, left : left + bw]
        centre, turn = matrix(grid.field, row, column), SYMMETRIES[symmetry]
        ys, xs = offset(centre, matrix(grid.field, rows, columns), rows - row, columns - column)
        ys, xs = turn[0] * ys + turn[1] * xs, turn[2] * ys + turn[3] * xs
        (first_y, last_y), down = self.range(ys, self.image.shape[0])
        (first_x, last_x), right = self.range(xs, self.image.shape[1])
        ends_y, ends_x = (int(down.min()), int(down.max())), (int(right.min()), int(right.max()))
        reach = max(1, ends_y[1] - ends_y[0]), max(1, ends_x[1] - ends_x[0])
        stride = whole.usage_step >> level
        mean = sum(x for s in usage for x in usage[s].ravel().tolist()) / sum(u.size for u in usage.values())
        usage = usage[symmetry]
        penalty = np.zeros_like(usage)
        if mean > 0:
            penalty = options.evenness * whole.variance * np.maximum(0.0, usage / mean - 1.0)
        if options.variety > 0:
            penalty = penalty + self.near_landmarks(n, reach, stride, penalty.shape)
            for m in range(n - 1, max(-1, n - 2 * self.across - 3), -1):
                near = abs(blocks[m][0] - row) < 2 * bh and abs(blocks[m][1] - column) < 2 * bw
                if sources[m] is not None and near:
                    at = [(s + 8) >> shift for s in sources[m]]
                    half = reach[0] // 2 + 1, reach[1] // 2 + 1
                    add_tent(penalty, stride, at, half, options.variety * whole.variance)

        def drawn():
            y = first_y + draws.below(last_y - first_y + 1)
            return y, first_x + draws.below(last_x - first_x + 1)

        misfit = self.misfits(symmetry, row, column)

        def phase(y, x):
            return 0.0 if self.wanted is None else self.wanted.weight * whole.variance * misfit[y, x]

        def extra(y, x):
            return penalty[
                np.minimum(y // stride, usage.shape[0] - 1), np.minimum(x // stride, usage.shape[1] - 1)
            ]

        middle = (8 << level) - 8  # of a level's pixel, in 1/16 pixel
        if not there.any():
            if self.wanted is None:
                y, x = drawn()
            else:
                part = misfit[first_y : last_y + 1, first_x : last_x + 1]
                fitting = np.argwhere(part <= part.min() + 1 / 32)
                y, x = (fitting[draws.below(len(fitting))] + (first_y, first_x)).tolist()
            source = ((16 * y) << level) + middle, ((16 * x) << level) + middle
            return 0, source, (y, x), (down, right), reach

        # Shortlisted by the means of boxes.
        boxes = []
        box = 4 * sample
        for a in range(0, bh - box + 1, box):
            for b in range(0, bw - box + 1, box):
                part = np.s_[a : a + box : sample, b : b + box : sample]
                if there[part].all():
                    at = []
                    for v, (low, high) in ((down, ends_y), (right, ends_x)):
                        half = box // 2
                        corner = (v[a + half - 1, b + half - 1] + v[a + half, b + half] - 3) >> 1
                        at.append(max(min(int(corner), high - 3), low))
                    boxes.append((*at, (int(now[part][..., 0].sum()) + 8) >> 4))
        if boxes or self.wanted is not None:
            y, x = np.mgrid[first_y : last_y + 1 : self.step, first_x : last_x + 1 : self.step].reshape(2, -1)
            cost = np.float32(extra(y, x) * max(1, len(boxes)))
            cost = cost + np.float32(phase(y, x) * max(1, len(boxes)))
            for dy, dx, value in boxes:
                cost = cost + (self.means[y + dy, x + dx] - value) ** 2
            kept = np.argsort(np.float32(cost), kind="stable")[: options.shortlist]
            found = list(zip(y[kept].tolist(), x[kept].tolist(), strict=True))
        else:
            found = [drawn() for _ in range(options.shortlist)]

        # Where the left and the upper neighbour would go on.
        going = []
        for m in before:
            if m >= 0 and sources[m] is not None and self.symmetries[m] == symmetry:
                other = matrix(grid.field, *blocks[m][:2])
                y, x = offset(other, centre, row - blocks[m][0], column - blocks[m][1])
                step = turn[0] * y + turn[1] * x, turn[2] * y + turn[3] * x
                on = tuple(int(s + d) for s, d in zip(sources[m], step, strict=True))
                pixel = (on[0] + 8) >> shift, (on[1] + 8) >> shift
                if first_y <= pixel[0] <= last_y and first_x <= pixel[1] <= last_x:
                    going.append((pixel, on))
                    found.insert(0, pixel)

        # Judged at full resolution, on the black squares of a chessboard.
        i, j = np.arange(bh)[:, None], np.arange(bw)
        black = (i % sample == 0) & (j % sample == 0) & ((i // sample + j // sample) % 2 == 0) & there
        totals, best, limit, begin, near = [], BIG, BIG, 0, self.step // 2
        for refining in (False, True):
            for y, x in found[begin:]:
                apart = self.image[y + down[black], x + right[black]] - now[black]
                count = int(black.sum()) if self.wanted is None else max(1, int(black.sum()))
                start = int(extra(y, x) * count) + int(phase(y, x) * count)
                totals.append(judged(apart, start, limit))
                if totals[-1] < best:
                    best, limit = totals[-1], int(totals[-1] * options.tolerance)
            if refining or not near:
                break
            # The pixels round the best ones.
            begin = len(found)
            for m in sorted(range(begin), key=totals.__getitem__)[:REFINED]:
                y, x = found[m]
                for i in range(max(y - near, first_y), min(y + near, last_y) + 1):
                    for j in range(max(x - near, first_x), min(x + near, last_x) + 1):
                        if (i, j) != (y, x):
                            found.append((i, j))
        good = [place for place, total in zip(found, totals, strict=True) if total <= limit]
        pick = draws.below(len(good))
        y, x = good[pick]
        cost = [total for total in totals if total <= limit][pick]
        source = ((16 * y) << level) + middle, ((16 * x) << level) + middle
        source = next((on for pixel, on in going if pixel == (y, x)), source)
        return cost, source, (y, x), (down, right), reach

    def near_landmarks(self, n, reach, stride, shape):
        """Return what places cost a block for the landmarks that they show, most of those shown near by."""
        uses = self.uses
        blocks = list(range(uses.before)) + list(range(max(0, n - uses.look) + uses.before, n + uses.before))
        if self.wrap:
            blocks += [uses.before + m for m in range(min(uses.look, max(0, n - uses.look)))]
        costs = np.zeros(len(uses.marks))
        for m in blocks:
            away = np.abs(uses.places[m] - uses.places[uses.before + n])
            if self.wrap:
                away[:2] = np.minimum(away[:2], np.abs(np.array(self.shape) - away[:2]))
            share = 1 - (away[0] ** 2 + away[1] ** 2 + away[2] ** 2) / (uses.reach * uses.reach)
            if share > 0:
                costs[[k in self.landmarks[m] for k in range(len(costs))]] += share * share
        out = np.zeros(shape)
        rows, columns = np.meshgrid(*(np.arange(size) * stride for size in shape), indexing="ij")
        for (row, column, much), cost in zip(uses.marks.tolist(), costs, strict=True):
            inside = (np.abs(rows - row) <= 0.4 * reach[0]) & (np.abs(columns - column) <= 0.4 * reach[1])
            out[inside] += uses.weight * much / 256.0 * (cost - uses.usual)
        return out - min(0.0, out.min())

    def show(self, n, pixel, reach):
        """Note which landmarks a block shows."""
        marks = self.uses.marks
        shown = (np.abs(marks[:, :2] - pixel) <= 0.4 * np.array(reach)).all(axis=1)
        self.landmarks[self.uses.before + n] = set(np.flatnonzero(shown).tolist())

    def misfits(self, symmetry, row, column):
        """Return for each pixel of the level by how much its phases differ from those wanted at a texel."""
        height, width = self.image.shape[:2]
        total = np.zeros((height, width))
        if self.wanted is None:
            return total
        lattice, level, turn = self.wanted.lattice, self.grid.level, np.array(SYMMETRIES[symmetry])
        theta = self.wanted.surface.at(self.index, np.array([float(row)]), np.array([float(column)]))[:, 0]
        y, x = np.mgrid[:height, :width]
        for wave, goal in zip(lattice.waves, theta, strict=True):
            # The wave of the sample that is seen in this one's place, with its sign.
            seen = [
                (k, sign)
                for k, other in enumerate(lattice.waves)
                for sign in (1, -1)
                if np.linalg.norm(sign * turn.reshape(2, 2).T @ other - wave) <= 0.05 * np.linalg.norm(wave)
            ]
            if not seen:
                total += 1
                continue
            k, sign = seen[0]
            own = lattice.phases[k]
            half = (1 << level) // 2
            at = own[
                np.minimum((y << level) + half, own.shape[0] - 1),
                np.minimum((x << level) + half, own.shape[1] - 1),
            ].astype(np.int64)
            if level:
                at = (at - int(np.rint(32768 * lattice.waves[k].sum())) + 32768) % 65536 - 32768
            steps = ((sign * at - int(goal) + 32) // 64) % 1024
            total += np.rint(2**14 * (1 - np.cos(2 * np.pi * steps / 1024))) / 2**14
        return total

    def range(self, v, size):
        """Return from where to where a source may lie, and offsets in whole pixels that stay inside."""
        level = self.grid.level
        whole = (v + (8 << level)) >> (4 + level)
        first, last = -int(whole.min()), size - 1 - int(whole.max())
        if first > last:
            first = last = min(max((first + last) // 2, 0), size - 1)
        return (first, last), np.clip(whole, -first, size - 1 - last)

    def put(self, window, mask, y, x, symmetry):
        rows, columns = (np.broadcast_to(at, mask.shape)[mask] for at in window)
        self.laid[rows, columns] = True
        self.canvas[rows, columns] = self.image[y[mask], x[mask]]
        self.shown[rows, columns] = symmetry

    def cut(self, window, corner, needed, y, x):
        grid = self.grid
        cell, sample, bh, bw = grid.mask_cell, grid.sample, grid.height, grid.width
        there = self.laid[window]

        def cells_of(array):
            return (
                array.reshape(bh // cell, cell, bw // cell, cell)
                .swapaxes(1, 2)
                .reshape(bh // cell, bw // cell, -1)
            )

        apart = ((self.image[y, x] - self.canvas[window]) ** 2).sum(axis=2) * there
        looked_at = np.zeros_like(there)
        looked_at[::sample, ::sample] = True
        errors = cells_of(apart * looked_at).sum(axis=2)
        bare = ~cells_of(there).all(axis=2)
        missing = cells_of(needed & ~there).any(axis=2)
        ring = np.pad(missing, 1)
        near = np.zeros_like(missing)
        for a in range(3):
            for b in range(3):
                near |= ring[a : a + missing.shape[0], b : b + missing.shape[1]]
        fixed = cells_of(self.fixed[window]).any(axis=2)
        outside = bare & (near | ~fixed)
        seeds = np.full(outside.shape, FREE, np.int8)
        for side in range(4):
            # On the rim: held old where the chart goes on beyond it.
            beyond = self.beside(corner, side)
            rim = [seeds[0], seeds[:, -1], seeds[-1], seeds[:, 0]][side]
            rim[beyond] = OLD
        seeds[fixed] = OLD
        seeds[near] = NEW
        seeds[outside] = OUTSIDE
        if not ((seeds == OLD).any() and (seeds == NEW).any()):
            return (outside | (seeds == NEW).any()).astype(np.uint8)
        inner = ~outside
        right = (errors[:, :-1] + errors[:, 1:] + 1) * (inner[:, :-1] & inner[:, 1:])
        down = (errors[:-1] + errors[1:] + 1) * (inner[:-1] & inner[1:])
        return plain_cut(right, down, seeds)[0] | outside

    def beside(self, corner, side):
        """Tell for each cell along a side whether something is laid beyond its first texel."""
        grid = self.grid
        bh, bw, cell = grid.height, grid.width, grid.mask_cell
        rows = self.places(corner[0] - 1, bh + 2, 0)
        columns = self.places(corner[1] - 1, bw + 2, 1)
        if side in (0, 2):
            columns = columns[1 : 1 + bw : cell]
            rows = np.full(len(columns), rows[0 if side == 0 else bh + 1])
        else:
            rows = rows[1 : 1 + bh : cell]
            columns = np.full(len(rows), columns[0 if side == 3 else bw + 1])
        return (rows >= 0) & (columns >= 0) & self.laid[rows, columns]


def plain_quilt(exemplar, surface, charts, fields=None, *, options, phases=None, wrap=False, seed=0):
    """Return what `lay_all` must return, in all but origins and steps."""
    fields = tuple(fields or (WarpField.identity(),) * len(charts))
    shape = exemplar.shape[:2]
    found = () if wrap else find_seams(surface, charts)
    copied = len(charts) == 1 and not fields[0].nodes.any() and not found
    itself = [{m.edge for m in found if m.chart == m.other_chart == n} for n in range(len(charts))]
    coarse = (
        options.block >= 48
        and min(options.block / max(1.0, PlainGrid.typical(*one)) for one in zip(charts, fields, strict=True))
        >= 24
    )
    fitting = (min(shape), min(shape)) if options.rotate else shape
    grids = [
        PlainGrid.of(c, f, fitting, options.block, options.overlap, coarse, copied, wrap, around)
        for c, f, around in zip(charts, fields, itself, strict=True)
    ]
    whole = PlainSample.of(exemplar, max(grid.level for grid in grids))
    onto, around = [[] for _ in charts], [[] for _ in charts]
    for c in transitions(surface, charts, found):
        (around if c.seam.chart == c.seam.other_chart else onto)[c.seam.other_chart].append(c)
    sizes = tuple(grid.mask_cell for grid in grids)
    transfer = BlockTransfer(charts, fields, onto, around, shape, sizes)
    children = np.random.SeedSequence(seed).spawn(len(charts))
    finished, usage, order = [None] * len(charts), whole.unused(symmetries_of(options)), []
    rules = LandmarkRules.of(
        pca_features(exemplar)[0],
        surface,
        charts,
        fields,
        weight=options.variety * whole.variance,
        block=options.block,
        shape=next(iter(usage.values())).shape,
        wrap=wrap,
    )
    shown, fresh = [None] * len(charts), {}
    for members in [[0]] if wrap else schedule(surface, charts, found):
        results = {}
        for n in members:
            waiting = {c.seam.other_edge for c in onto[n] if finished[c.seam.chart] is None}
            # Of two edges that meet, blocks reach beyond the first, if one fits in between.
            opened = {0} & itself[n] if grids[n].height <= charts[n].height else set()
            opened |= {3} & itself[n] if grids[n].width <= charts[n].width else set()
            need = grids[n].need(waiting | opened)
            overhangs = [one and transfer.overhang(k, one) for k, one in enumerate(finished)]
            transferred = transfer.transferred_onto(n, overhangs)
            chart = PlainChart(grids[n], need, whole.levels[grids[n].level], wrap, phases, n)
            chart.lay_transferred(transferred.placements, transferred.cells)
            chart.close(transfer.closed(n, finished))
            state = int(children[n].generate_state(1, np.uint64)[0])
            laid = transferred
            parts = chart.begin(opened, usage, state)
            blocks = np.array([block[:2] for block in chart.blocks], np.int32)
            chart.uses = rules.uses(n, blocks, grids[n].level, chart.across, shown)
            chart.landmarks = [{k for k in range(63) if bits >> k & 1} for bits in chart.uses.shown.tolist()]
            for start, stop, closed in parts:
                if closed:
                    again = transfer.transferred_around(n, replace(laid, bounds=need))
                    chart.lay_transferred(again.placements, again.cells)
                    chart.close([side for side in transfer.closed_around(n) if side[0] in closed])
                    laid = joined([laid, again])
                placed, cells, laid_at = chart.cover(whole, options, start, stop)
                placed["chart"] = n
                numbers = ((len(order) + members.index(n)) << 32) + laid_at
                steps = np.zeros(len(placed), np.int64)
                laid = joined([laid, ChartPlacements(placed, cells, numbers, steps)])
            results[n] = replace(laid, bounds=need), chart.usage
            first = chart.uses.before
            bits = np.array([sum(1 << k for k in seen) for seen in chart.landmarks[first:]], np.int64)
            fresh[n] = ShownBlocks(chart.uses.places[first:], bits)
        base = usage
        for n in members:
            finished[n], shown[n] = results[n][0], fresh[n]
            usage = {s: usage[s] + (results[n][1][s] - base[s]) for s in usage}
        order += members
    if wrap:
        return [replace(finished[0], placements=wrapped(finished[0].placements, charts[0], 2 * LABEL_CELL))]
    return finished


def wrapped(placements, chart, rim):
    """Repeat what reaches beyond an edge, or within `rim` of one, at the opposite one, right after."""
    out = []
    around = ((0, 0), (-1, 0), (0, -1), (-1, -1), (1, 0), (0, 1), (1, 1), (-1, 1), (1, -1))
    for one in placements:
        for down, right in around:
            again = one.copy()
            again["row"] += down * chart.height
            again["column"] += right * chart.width
            first = again["row"] - one["height"] // 2, again["column"] - one["width"] // 2
            sides = (one["height"], chart.height), (one["width"], chart.width)
            if all(
                at < long + rim and at + side > -rim for at, (side, long) in zip(first, sides, strict=True)
            ):
                out.append(again)
    return np.array(out, placements.dtype)
