"""Method "paper" against a plain twin that follows the text, and what must hold of every quilt it makes."""

import itertools

import numpy as np
import pytest
from plain_cut import FREE, NEW, OLD, plain_cut

from upholster.base.errors import InputError
from upholster.charts.layout import uniform_layout
from upholster.codec.haar import dwt2, subbands
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.labels import cell_centres
from upholster.quilt.painting import paint
from upholster.quilt.placement import SYMMETRIES
from upholster.synthesis.paper.method import PaperOptions, synthesize_paper
from upholster.synthesis.paper.strips import color_classes, strip_along
from upholster.synthesis.working_form import working_form


def texture(height=72, width=64, channels=3, seed=0):
    """Return a smooth random texture: blocks of it differ, and match better or worse."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(height, width, channels))
    for axis in (0, 1):
        for _ in range(6):
            noise = (noise + np.roll(noise, 1, axis)) / 2
    noise = (noise - noise.min()) / np.ptp(noise)
    return np.rint(noise * 255).astype(np.uint8)


def coefficients(image, levels):
    """Return LLn and HHn of an image of whole tiles, as matching rounds them."""
    bands = subbands(dwt2(image, levels=levels), levels=levels)
    both = np.stack([bands[f"LL{levels}"], bands[f"HH{levels}"]]) * 2**levels
    return np.floor(np.rint(both) / 64 + 0.5)


def plain_candidates(exemplar, working, block, levels):
    """Return where blocks lie inside the exemplar on the grid of LLn, and the coefficients of each."""
    tile = 2**levels
    places = [
        (r, c)
        for r in range(0, exemplar.shape[0] - block + 1, tile)
        for c in range(0, exemplar.shape[1] - block + 1, tile)
    ]
    found = [coefficients(working[r : r + block, c : c + block], levels) for r, c in places]
    return places, np.stack(found)


def plain_synthesis(exemplar, charts, shared, options, seed):
    """Follow the paper in plain NumPy; return first pixels of blocks per chart, and all edge blocks."""
    block, overlap, tile = options.block, options.overlap, 2**options.levels
    working = working_form(exemplar).astype(np.int64) << 6
    places, features = plain_candidates(exemplar, working, block, options.levels)
    step, n = block - overlap, block // tile
    canvases, blocks = [], []
    for chart, child in zip(charts, np.random.SeedSequence(seed).spawn(len(charts)), strict=True):
        padded = [-(-size // tile) * tile for size in (chart.height, chart.width)]
        canvas = np.zeros((*padded, exemplar.shape[2]), np.int64)
        chosen = []
        for top in range(0, chart.height - overlap, step):
            for left in range(0, chart.width - overlap, step):
                mask = np.zeros((n, n), bool)
                mask[: overlap // tile] = top > 0
                mask[:, : overlap // tile] |= left > 0
                window = np.zeros((block, block, exemplar.shape[2]), np.int64)
                there = canvas[top : top + block, left : left + block]
                window[: there.shape[0], : there.shape[1]] = there
                mask[there.shape[0] // tile :] = False
                mask[:, there.shape[1] // tile :] = False
                if top == left == 0:
                    best = int(np.random.default_rng(child).integers(len(places)))
                else:
                    difference = (features - coefficients(window, options.levels)) ** 2
                    best = int((difference * mask[None, None, :, :, None]).sum(axis=(1, 2, 3, 4)).argmin())
                chosen.append(places[best])
                row, column = places[best]
                new = working[row : row + block, column : column + block]
                ramp = np.minimum((2 * np.arange(block) + 1) * 128 // overlap, 256)
                ramp[overlap:] = 256
                down = ramp if top else np.full(block, 256)
                right = ramp if left else np.full(block, 256)
                weight = ((down[:, None] * right) >> 8)[: there.shape[0], : there.shape[1], None]
                new = new[: there.shape[0], : there.shape[1]]
                there[:] = (there * (256 - weight) + new * weight + 128) >> 8
        canvases.append(canvas)
        blocks.append(chosen)
    edge_block = options.edge_block or block
    places, features = plain_candidates(exemplar, working, edge_block, options.levels)
    edges = [PlainEdge(strip_along(edge, charts, edge_block), charts) for edge in shared]
    mended = []
    for members in color_classes([(edge.chart_a, edge.chart_b) for edge in edges]):
        for edge in (edges[m] for m in members):
            mended += plain_edge(edge, canvases, charts, working, features, places, options)
    return blocks, mended


class PlainEdge:
    """A strip as the paper's text has it: a line on chart A, and where beyond it chart B lies."""

    def __init__(self, strip, charts):
        a, b = charts[strip.a], charts[strip.b]
        self.chart_a, self.chart_b, self.along_rows = strip.a, strip.b, strip.edge_a in (1, 3)
        self.start, self.length = strip.start, strip.length
        self.line = (0, a.width, a.height, 0)[strip.edge_a]
        self.to_b = lambda row, column: strip.to_b(row, column, a, b)
        ends = np.stack(self.to_b(np.array([0, 1, 0]), np.array([0, 0, 1])))
        self.linear = np.stack([ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]], axis=1)


def plain_edge(edge, canvases, charts, working, features, places, options):
    block = options.edge_block or options.block
    overlap, half, cell = options.overlap, block // 2, 2**options.levels // 2
    side = block // cell
    step, found = block - overlap, []
    starts = [min(k * step, edge.length - block) for k in range(-(-(edge.length - overlap) // step))]
    chart = charts[edge.chart_a]
    for n, start in enumerate(starts):
        top, left = (
            (edge.start + start, edge.line - half)
            if edge.along_rows
            else (edge.line - half, edge.start + start)
        )
        rows, columns = (grid.reshape(-1) for grid in np.mgrid[top : top + block, left : left + block])
        inside = (rows >= 0) & (rows < chart.height) & (columns >= 0) & (columns < chart.width)
        rows_b, columns_b = edge.to_b(rows, columns)
        old = np.empty((block * block, working.shape[2]), np.int64)
        old[inside] = canvases[edge.chart_a][rows[inside], columns[inside]]
        old[~inside] = canvases[edge.chart_b][rows_b[~inside], columns_b[~inside]]
        square = old.reshape(block, block, -1)
        best = int(((features - coefficients(square, options.levels)) ** 2).sum(axis=(1, 2, 3, 4)).argmin())
        row, column = places[best]
        new = working[row : row + block, column : column + block]
        # Squared coefficient differences at levels 1 to n - 1, by the transform itself.
        bands = subbands(
            dwt2(((square + 32) >> 6) - (new >> 6), levels=options.levels - 1), levels=options.levels - 1
        )
        cost = np.zeros((side, side))
        for name, band in bands.items():
            per_cell = band.shape[0] // side
            cost += (
                (band**2).sum(axis=2).reshape(side, per_cell, side, per_cell).sum(axis=(1, 3)) if name else 0
            )
        cost = np.rint(cost).astype(np.int64)
        seeds = np.full((side, side), FREE, np.int8)
        if n == 0:
            seeds[0] = OLD
        if n == len(starts) - 1:
            seeds[-1] = OLD
        seeds[:, side // 2 - 1 : side // 2 + 1] = NEW
        if n > 0:
            seeds[0] = OLD
        seeds[:, [0, -1]] = OLD
        seeds = seeds if edge.along_rows else seeds.T
        cells, _ = plain_cut(cost[:, 1:] + cost[:, :-1], cost[1:] + cost[:-1], seeds)
        w = bilinear(cells, cell).reshape(-1, 1)
        found.append(PlainBlock(edge, (top, left), (row, column), cells))
        for which, (r, c) in (("a", (rows, columns)), ("b", (rows_b, columns_b))):
            size = charts[edge.chart_a if which == "a" else edge.chart_b]
            canvas = canvases[edge.chart_a if which == "a" else edge.chart_b]
            on = (r >= 0) & (r < size.height) & (c >= 0) & (c < size.width)
            canvas[r[on], c[on]] = (
                canvas[r[on], c[on]] * (256 - w[on]) + new.reshape(block * block, -1)[on] * w[on] + 128
            ) >> 8
    return found


class PlainBlock:
    """An edge block: its first texel on A, the first pixel that it shows, its cells (1: new)."""

    def __init__(self, edge, corner, pixel, cells):
        self.edge, self.corner, self.pixel, self.cells = edge, np.array(corner), np.array(pixel), cells

    def on(self, side, row, column):
        """Return how far from its corner, in A's frame, places on A (0) or B (1) are, all in 1/16 texel."""
        place = np.stack([row, column])
        if side == 1:
            origin = np.array(self.edge.to_b(0, 0)).reshape(2, *[1] * row.ndim)
            # Middles of texels, 16·k + 8, are taken to such; the inverse of a rotation is its transpose.
            place = np.tensordot(self.edge.linear.T, place - 8 - 16 * origin, 1) + 8
        return place - 16 * self.corner.reshape(2, *[1] * row.ndim)


def bilinear(cells, cell):
    """Return the weights (of 256) of a block's texels, bilinear between its cells, which are 0 beyond it."""
    place = 16 * np.arange(len(cells) * cell) + 8 + 8 * cell
    low, part = place // (16 * cell), place % (16 * cell) // cell
    padded = np.pad(cells.astype(np.int64), 1)
    rows = padded[low] * (16 - part)[:, None] + padded[low + 1] * part[:, None]
    return rows[:, low] * (16 - part) + rows[:, low + 1] * part


def plain_second_layer(index, shape, cell, mended):
    """Return which of `mended`, on A (0) or B (1), shows in each cell of a chart: 2·number + side, or -1."""
    row, column = np.meshgrid(*(cell_centres(count, cell) for count in shape), indexing="ij")
    labels = np.full(shape, -1)
    for n, block in enumerate(mended):
        for side, chart in enumerate((block.edge.chart_a, block.edge.chart_b)):
            if chart == index:
                a, b = block.on(side, row, column) // (16 * cell)
                inside = (np.minimum(a, b) >= 0) & (np.maximum(a, b) < len(block.cells))
                inside[inside] = block.cells[a[inside], b[inside]] == 1
                labels[inside] = 2 * n + side
    return labels


def read_at(placed, row, column):
    """Return where a placement reads at places of its chart, (2, …) in 1/16 pixel; there is no warp field."""
    step = np.stack([row - placed["row"], column - placed["column"]])
    turned = np.tensordot(SYMMETRIES[placed["symmetry"]].reshape(2, 2), step, 1)
    return turned + np.array([placed["source_row"], placed["source_column"]]).reshape(2, *[1] * row.ndim)


def first_pixels(quilt, index, options):
    """Return the first pixels of a chart's blocks, in order, as its first layer tells them."""
    found = []
    placed = quilt.on_chart(index)
    for one in placed[placed["layer"] == 0]:
        # The centre lies in the block, and not in the overlap with the one before.
        step = options.block - options.overlap
        corner = [max(0, (one[name] // 16 - 1) // step) * step for name in ("row", "column")]
        found.append(read_at(one, *(16 * np.array(corner) + 8)))
    assert all((place % 16 == 0).all() for place in found)
    return [tuple((place // 16).tolist()) for place in found]


def two_by_one():
    return plane(2, 1, spans=(1, 2))


def turned_pair():
    first, second = plane(2, 1, spans=(1, 2)).patches
    return Surface([first, second.transpose().reverse(0)])


@pytest.mark.parametrize("surface", [two_by_one(), turned_pair()], ids=["upright", "turned"])
@pytest.mark.parametrize(
    ("options", "size"),
    [
        (PaperOptions(), 72),
        (PaperOptions(), 74),
        (PaperOptions(block=16, overlap=4, levels=2), 50),
        (PaperOptions(block=24, overlap=8, levels=3), 64),
        (PaperOptions(block=40, edge_block=24), 72),
        (PaperOptions(block=16, overlap=4, levels=2, edge_block=24), 50),
    ],
    ids=["paper", "odd size", "two levels", "block 24", "smaller edge blocks", "larger edge blocks"],
)
def test_follows_the_paper_step_by_step(surface, options, size):
    exemplar = texture()
    charts = uniform_layout(surface, chart=size)
    quilt = synthesize_paper(exemplar, surface, charts, options=options, seed=5)
    blocks, mended = plain_synthesis(exemplar, charts, surface.shared, options, 5)
    for index, plain in enumerate(blocks):
        assert first_pixels(quilt, index, options) == plain
    cell = 2**options.levels // 2
    for index, (_, layer) in enumerate(quilt.labels):
        assert (layer.cell, layer.half) == (cell, False)
        plain = plain_second_layer(index, layer.labels.shape, cell, mended)
        np.testing.assert_array_equal(layer.labels < 0, plain < 0)
        placed = quilt.on_chart(index)
        assert len(np.unique(plain[plain >= 0])) == (placed["layer"] == 1).sum() > 1
        for number in np.unique(plain[plain >= 0]):
            cells = np.nonzero(plain == number)
            (label,) = np.unique(layer.labels[cells])
            place = [cell_centres(n, cell)[at] for n, at in zip(plain.shape, cells, strict=True)]
            block = mended[number // 2]
            wanted = 16 * block.pixel[:, None] + block.on(number % 2, *place) - 8
            np.testing.assert_array_equal(read_at(placed[label], *place), wanted)


@pytest.mark.parametrize(
    ("options", "height", "width"),
    [
        (PaperOptions(seams=False), 80, 57),
        (PaperOptions(block=12, overlap=4, levels=2, seams=False), 33, 40),
        (PaperOptions(block=16, overlap=2, levels=1, seams=False), 33, 40),
    ],
    ids=["paper", "three cells a block", "overlap 2"],
)
def test_blocks_are_blended_by_linear_ramps(options, height, width):
    exemplar = texture()
    charts = (Chart(0, height, width),)
    quilt = synthesize_paper(exemplar, plane(), charts, options=options, seed=5)
    pixels = first_pixels(quilt, 0, options)
    weights = []
    for size in (height, width):
        starts = np.arange(0, size - options.overlap, options.block - options.overlap)
        ramp = (2 * (np.arange(size) - starts[:, None]) + 1) * 8 // options.overlap  # of 16
        up = ramp.clip(0, 16)
        up[0] = 16
        # What the next block shows is taken off.
        weights.append((starts, up - np.concatenate([up[1:], np.zeros((1, size), int)])))
        assert (weights[-1][1].sum(axis=0) == 16).all()
    (tops, down), (lefts, right) = weights
    total = np.zeros((height, width, 3), np.int64)
    for n, (top, left) in enumerate(itertools.product(tops, lefts)):
        weight = np.outer(down[n // len(lefts)], right[n % len(lefts)])[top:, left:]
        shown = weight[: options.block, : options.block]
        assert weight.sum() == shown.sum()
        row, column = pixels[n]
        new = exemplar[row : row + shown.shape[0], column : column + shown.shape[1]]
        total[top : top + shown.shape[0], left : left + shown.shape[1]] += new * shown[..., None]
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[0], (total + 128) >> 8)


@pytest.mark.parametrize("surface", [ring_cyclide(), sphere()], ids=["cyclide", "sphere"])
@pytest.mark.parametrize("size", [64, 75])
def test_placements_are_in_cells_of_their_own(surface, size):
    exemplar = texture(64, 80)
    quilt = synthesize(exemplar, surface, chart=size, seed=2, method="paper")
    for index, layers in enumerate(quilt.labels):
        placed = quilt.on_chart(index)
        for number, layer in enumerate(layers):
            own = np.flatnonzero(placed["layer"] == number)
            cells = [
                np.searchsorted(cell_centres(count, layer.cell, half=layer.half), placed[name][own])
                for count, name in zip(layer.labels.shape, ("row", "column"), strict=True)
            ]
            for count, at, name in zip(layer.labels.shape, cells, ("row", "column"), strict=True):
                np.testing.assert_array_equal(
                    cell_centres(count, layer.cell, half=layer.half)[at], placed[name][own]
                )
            np.testing.assert_array_equal(layer.labels[tuple(cells)], own)
            assert (np.diff(np.ravel_multi_index(cells, layer.labels.shape)) > 0).all()
            assert set(np.unique(layer.labels)) - {-1} == set(own.tolist())


@pytest.mark.parametrize("size", [64, 75])
def test_an_edge_block_goes_on_across_its_edge(size):
    surface = turned_pair()
    quilt = synthesize(texture(), surface, chart=size, seed=2, method="paper")
    (edge,) = surface.shared
    found = PlainEdge(strip_along(edge, quilt.charts, 32), quilt.charts)
    along, line = np.arange(size), found.line
    near, far = (line - 1, line) if line else (0, -1)
    place = (lambda at: (along, 0 * along + at)) if found.along_rows else (lambda at: (0 * along + at, along))
    here = quilt.sources()[found.chart_a][place(near)]
    there = quilt.sources()[found.chart_b][found.to_b(*place(far))]
    layer_here, layer_there = (
        quilt.on_chart(n)["layer"][quilt.owners(n, 0, 0, size, size)] for n in (found.chart_a, found.chart_b)
    )
    assert (layer_here[place(near)] == 1).all()
    assert (layer_there[found.to_b(*place(far))] == 1).all()
    step = np.array([0, 16] if found.along_rows else [16, 0]) * (far - near)
    # Cells of the two charts need not end at the same texels.
    goes_on = (there - here == step).all(axis=1)
    assert goes_on.all() if size % 4 == 0 else goes_on.mean() > 0.85


def test_the_papers_figures_count():
    # 16 charts of 512²: (512 - 8)/24 = 21 blocks each way, and 21 edge blocks on each of 32 edges.
    quilt = synthesize(texture(128, 128), ring_cyclide(), chart=512, seed=1, method="paper")
    edge = quilt.placements["layer"] == 1
    assert (~edge).sum() == 16 * 21 * 21 == 7056
    assert edge.sum() == 2 * 32 * 21
    assert quilt.steps == 16 * 512 * 512
    # A block covers three cells each way: the overlap is that of the block after it.
    first, second = quilt.labels[0]
    assert (first.cell, first.half, first.labels.shape) == (8, True, (66, 66))
    assert (np.bincount(first.labels[2:-1, 2:-1].ravel()) == 9).all()
    assert (second.cell, second.half, second.labels.shape) == (4, False, (130, 130))


@pytest.mark.parametrize(
    "surface", [ring_cyclide(), sphere(), turned_pair()], ids=["cyclide", "sphere", "turned"]
)
def test_every_texel_is_painted_from_inside_the_exemplar(surface):
    exemplar = texture(61, 45, 1)
    quilt = synthesize(exemplar, surface, chart=75, seed=2, method="paper")
    for source in quilt.sources():
        assert source.min() >= 0
        assert (source[:, :, 0] <= 16 * 60).all()
        assert (source[:, :, 1] <= 16 * 44).all()
    values = paint(quilt, np.full((61, 45, 2), 200, np.uint8))
    assert all((array == 200).all() for array in values.arrays)


@pytest.mark.parametrize("threads", [2, 3, 8])
def test_threads_do_not_change_the_quilt(threads):
    exemplar = texture()
    once = synthesize(exemplar, sphere(), chart=100, seed=3, threads=1, method="paper")
    again = synthesize(exemplar, sphere(), chart=100, seed=3, threads=threads, method="paper")
    np.testing.assert_array_equal(once.placements, again.placements)
    for ours, theirs in zip(once.labels, again.labels, strict=True):
        for one, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(one.labels, other.labels)


def test_seeds_differ():
    first, second = (
        synthesize(texture(), two_by_one(), chart=64, seed=seed, method="paper") for seed in (0, 1)
    )
    assert (first.placements["source_row"] != second.placements["source_row"]).any()


def jump_ratio(surface, texels):
    """Return the mean difference across patch edges over that between neighbours inside."""
    across, inside = [], []
    for edge in surface.shared:
        a, b = texels.arrays[edge.patch].astype(float), texels.arrays[edge.other_patch].astype(float)
        found = PlainEdge(strip_along(edge, texels.charts, 16), texels.charts)
        along = np.arange(found.length)
        last, beyond = (found.line - 1, found.line) if found.line else (0, -1)
        place = (
            (lambda line, x=along: (x, np.full_like(x, line)))
            if found.along_rows
            else (lambda line, x=along: (np.full_like(x, line), x))
        )
        row, column = found.to_b(*place(beyond))
        across.append(np.abs(a[place(last)] - b[row, column]).mean())
        other = found.line - 2 if found.line else 1
        inside.append(np.abs(a[place(last)] - a[place(other)]).mean())
    return np.mean(across) / np.mean(inside)


@pytest.mark.parametrize("surface", [ring_cyclide(), sphere()], ids=["cyclide", "sphere"])
def test_mending_makes_the_seams_vanish(surface):
    exemplar = texture(128, 128)
    before, after = (
        jump_ratio(
            surface,
            paint(synthesize(exemplar, surface, chart=128, seed=4, seams=seams, method="paper"), exemplar),
        )
        for seams in (False, True)
    )
    assert before > 2
    assert after < 1.35


def test_a_patch_that_meets_itself_is_mended():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    surface = Surface([RationalPatch.from_points(net)])
    exemplar = texture(128, 128)
    ratios = [
        jump_ratio(
            surface,
            paint(synthesize(exemplar, surface, chart=128, seed=4, seams=seams, method="paper"), exemplar),
        )
        for seams in (False, True)
    ]
    assert ratios[1] < 1.5 < ratios[0]


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 4])
def test_depths_and_channels(dtype, channels):
    exemplar = texture(64, 64, channels).astype(dtype)
    exemplar = exemplar * 257 if dtype == np.uint16 else exemplar / np.float32(255)
    quilt = synthesize(exemplar, two_by_one(), chart=64, method="paper")
    texels = paint(quilt, exemplar)
    assert all(array.dtype == dtype and array.shape == (64, 64, channels) for array in texels.arrays)
    assert texels.nbytes == 2 * 64 * 64 * channels * np.dtype(dtype).itemsize


def test_another_map_is_painted_by_the_same_quilt():
    exemplar = texture(64, 64)
    quilt = synthesize(exemplar, two_by_one(), chart=64, method="paper")
    rows, columns = np.mgrid[:64, :64]
    places = np.stack([rows, columns], -1).astype(np.uint16)
    for colour, place in zip(paint(quilt, exemplar).arrays, paint(quilt, places).arrays, strict=True):
        source = exemplar[place[:, :, 0], place[:, :, 1]]
        assert (np.abs(source.astype(int) - colour) <= 1).mean() > 0.3  # all texels that no ramp blends


@pytest.mark.parametrize("block", [32, 64])
def test_the_smallest_exemplar_has_one_block(block):
    exemplar = texture(block, block)
    quilt = synthesize(exemplar, two_by_one(), chart=block, block=block, method="paper")
    assert first_pixels(quilt, 0, PaperOptions(block=block)) == [(0, 0)]
    sources = np.concatenate([part.reshape(-1, 2) for part in quilt.sources()])
    assert (np.unique(sources) == 16 * np.arange(block)).all()


@pytest.mark.parametrize(
    "options",
    [
        {"levels": 0},
        {"levels": 7},
        {"block": 33},
        {"block": 8},
        {"block": 512},
        {"overlap": 16},
        {"overlap": 0},
        {"overlap": 12},
        {"block": 40, "overlap": 16},
        {"seed": -1},
        {"seed": 2**63},
        {"chart": 0},
        {"chart": 24},
        {"chart": 20000},
        {"method": "papier"},
        {"threads": 0},
        {"block": 64, "levels": 6},
    ],
)
def test_options_that_do_not_fit_are_refused(options):
    with pytest.raises(InputError):
        synthesize(texture(64, 64), two_by_one(), **{"method": "paper"} | options)


def test_too_many_texels_are_refused_with_the_memory_they_take():
    with pytest.raises(InputError, match="GiB"):
        uniform_layout(ring_cyclide(), chart=16384)


def test_an_exemplar_smaller_than_a_block_is_refused():
    with pytest.raises(InputError, match="at least a block"):
        synthesize(texture(40, 72), two_by_one(), block=64, method="paper")


def test_charts_of_different_sizes_are_not_repaired(caplog):
    charts = (Chart(0, 64, 64), Chart(1, 48, 64))
    with caplog.at_level("INFO", logger="upholster"):
        quilt = synthesize_paper(texture(), two_by_one(), charts)
    assert [len(layers) for layers in quilt.labels] == [1, 1]
    assert "not repaired" in caplog.text
