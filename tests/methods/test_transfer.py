"""A block goes on beyond its chart's edge as if there were none, whichever way the neighbour lies."""

from dataclasses import replace

import numpy as np
import pytest
from plain_fit import plain_fit
from plain_quilt import shown_blocks, sources_of

from upholster.charts import uniform_layout
from upholster.charts.directions import default_direction, direction_fields
from upholster.charts.layout import density_layout
from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.geometry import RationalPatch, Surface, plane, sphere, surface_from_spec, torus
from upholster.methods.quilt.masked import BLOCK
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements, joined
from upholster.quilt import Chart
from upholster.quilt.warp_field import WarpField

SHAPE = (200, 180)
CELL = 2
IDENTITY = WarpField.identity()


def constant(matrix):
    return WarpField.quantised(np.tile(np.asarray(matrix, float), (6, 6, 1, 1)))


def turned(patch, symmetries):
    """Turn a patch's net by quarters, orientation kept."""
    for _ in range(symmetries):
        patch = patch.transpose().reverse(0)
    return patch


def placements_of(placed, cells, numbers):
    """Return a chart's own placements, transferred from nowhere."""
    return ChartPlacements(placed, cells, numbers, np.zeros(len(placed), np.int64))


class Layout:
    """Four patches of a plane, 2 by 2, each turned and sampled in its own way; one unit is 60 pixels."""

    def __init__(self, symmetries=(0, 0, 0, 0), density=(1, 1, 1, 1), cells=(CELL,) * 4, surface=None):
        whole = surface or plane(2, 2, spans=(2, 2))
        self.surface = Surface([turned(p, n) for p, n in zip(whole.patches, symmetries, strict=True)])
        self.charts = tuple(Chart(n, round(60 * d), round(60 * d)) for n, d in enumerate(density))
        self.fields = tuple(IDENTITY if d == 1 else constant(np.eye(2) / d) for d in density)
        found = find_seams(self.surface, self.charts)
        onto = [[] for _ in self.charts]
        for transition in transitions(self.surface, self.charts, found):
            onto[transition.seam.other_chart].append(transition)
        self.transfer = BlockTransfer(self.charts, self.fields, onto, [[]] * 4, SHAPE, cells)

    def pixels(self, chart):
        """Return where a chart's texels lie on the plane: (height, width, 2), rows and columns of pixels."""
        one = self.charts[chart]
        s = (np.arange(one.height) + 0.5) / one.height
        t = (np.arange(one.width) + 0.5) / one.width
        points = self.surface.patches[chart].points_grid(s, t)
        found = 60 * np.stack([1 - points[..., 1], points[..., 0] + 1], axis=-1) - 0.5
        return np.round(found, 6)

    def painted(self, chart, laid):
        """Return a chart's sources, in pixels, where placements paint it, and where it does."""
        found = sources_of(laid, self.charts[chart], self.fields[chart])
        return found / 16, shown_blocks(laid, self.charts[chart]) >= 0

    def laid(self, chart, *blocks, mask=None, size=(32, 28), origin=7):
        placed = np.zeros(len(blocks), BLOCK)
        placed["chart"], placed["first_cell"] = chart, -1
        placed["height"], placed["width"] = size
        for n, (row, column, source_row, source_column) in enumerate(blocks):
            placed["row"][n], placed["column"][n] = row, column
            placed["source_row"][n], placed["source_column"][n] = 16 * source_row, 16 * source_column
        cells = np.zeros(0, np.uint8)
        if mask is not None:
            placed["first_cell"], placed["mask_cell"] = 0, CELL
            cells = mask.reshape(-1)
        numbers = np.arange(origin, origin + len(placed))
        return placements_of(placed, cells, numbers)

    def transferred(self, chart, **finished):
        given = [
            self.transfer.overhang(n, finished[f"on{n}"]) if f"on{n}" in finished else None
            for n in range(len(self.charts))
        ]
        return self.transfer.transferred_onto(chart, given)


SYMMETRIES = [(0, a, b, c) for a, b, c in [(0, 0, 0), (1, 0, 2), (2, 3, 1), (3, 1, 3), (0, 2, 0)]]


@pytest.mark.parametrize("density", [(1, 1, 1, 1), (1, 2, 0.5, 2), (1, 0.5, 2, 1)])
@pytest.mark.parametrize("symmetries", SYMMETRIES)
def test_beyond_the_edge_the_block_goes_on(symmetries, density):
    layout = Layout(symmetries, density)
    # in the middle of the edge to chart 1, of the edge to chart 2, and in the corner of all four
    for row, column, others in ((30, 55, (1,)), (52, 20, (2,)), (50, 52, (1, 2, 3))):
        laid = layout.laid(0, (row, column, 90, 70))
        for other in range(1, 4):
            found = layout.transferred(other, on0=laid)
            assert set(found.origins.tolist()) == ({7} if other in others else set())
            if other not in others:
                continue
            sources, shown = layout.painted(other, found)
            offsets = layout.pixels(other) - (row, column)
            down, right = offsets[..., 0], offsets[..., 1]  # the block's own: -16 … 15 and -14 … 13
            sure = (down > -16) & (down < 15) & (right > -14) & (right < 13)
            never = (down < -22) | (down > 21) | (right < -20) | (right > 19)
            assert sure.any()
            assert shown[sure].all()
            assert not shown[never].any()
            # the texture goes on to within the quarter of a pixel in which sources are told
            exact = density[0] == density[other] == 1
            wanted = offsets + np.array((90, 70))
            np.testing.assert_allclose(sources[shown], wanted[shown], atol=1e-9 if exact else 2 / 16)


@pytest.mark.parametrize("symmetries", SYMMETRIES)
def test_masks_are_transferred_too(symmetries):
    rng = np.random.default_rng(5)
    layout = Layout(symmetries)
    # a mask of large squares: inside them, and outside, neighbours agree
    mask = np.kron(rng.integers(0, 2, (2, 4)), np.ones((8, 4), int))[:16, :14].astype(np.uint8)
    mask[:8, 8:12], mask[8:, 8:12] = 1, 0
    laid = layout.laid(0, (30, 52, 90, 70), mask=mask)
    sources, shown = layout.painted(1, layout.transferred(1, on0=laid))
    offsets = np.rint(layout.pixels(1) - (30, 52)).astype(int) + np.array((16, 14))
    seen = 0
    for value in (0, 1):
        for i, j in np.argwhere(mask == value):
            around = mask[max(0, i - 2) : i + 3, max(0, j - 2) : j + 3]
            if (around == value).all():
                here = (offsets[..., 0] // 2 == i) & (offsets[..., 1] // 2 == j)
                assert (shown[here] == value).all()
                seen |= (1 + value) * here.any()
    assert seen == 3
    assert (sources[shown] == (layout.pixels(1) - (30, 52) + (90, 70))[shown]).all()


def test_a_rotated_direction_turns_the_block():
    # the neighbour's field says what the texture does there: a quarter turn in it is a turn of the block
    layout = Layout()
    quarter = constant([[0, 1], [-1, 0]])
    onto = layout.transfer.onto
    fields = (IDENTITY, quarter, IDENTITY, IDENTITY)
    transfer = BlockTransfer(layout.charts, fields, onto, [[]] * 4, SHAPE, (CELL,) * 4)
    found = transfer.transferred_onto(1, [layout.laid(0, (30, 55, 90, 70)), None, None, None])
    sources = sources_of(found, layout.charts[1], quarter)
    shown = shown_blocks(found, layout.charts[1]) >= 0
    assert shown.any()
    assert found.placements["symmetry"][0] != 0
    wanted = layout.pixels(1) - (30, 55) + (90, 70)
    np.testing.assert_allclose(sources[shown] / 16, wanted[shown], atol=1 / 16)


@pytest.mark.parametrize(("degrees", "count"), [(0, 1), (20, 1), (32, 0), (45, 0), (58, 0), (70, 1), (90, 1)])
def test_where_directions_differ_too_much_nothing_is_transferred(degrees, count):
    layout = Layout()
    angle = np.radians(degrees)
    field = constant([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    transfer = BlockTransfer(
        layout.charts,
        (IDENTITY, field, IDENTITY, IDENTITY),
        layout.transfer.onto,
        [[]] * 4,
        SHAPE,
        (CELL,) * 4,
    )
    found = transfer.transferred_onto(1, [layout.laid(0, (30, 55, 90, 70)), None, None, None])
    assert len(found.placements) == count


def test_where_a_field_has_no_inverse_nothing_is_transferred():
    # Beside a pole neighbouring nodes may point apart: midway between such two, M is no map at all.
    matrices = np.tile(np.eye(2), (6, 6, 1, 1))
    matrices[:, 2:] *= -1
    field, layout = WarpField.quantised(matrices), Layout()
    assert not field.at(np.array([30.0]), np.array([16.0])).any()
    transfer = BlockTransfer(
        layout.charts,
        (IDENTITY, field, IDENTITY, IDENTITY),
        layout.transfer.onto,
        [[]] * 4,
        SHAPE,
        (CELL,) * 4,
    )
    for column, count in ((60 + 16, 0), (60 + 2, 1)):
        laid = layout.laid(0, (30, column, 90, 70), size=(32, 60))
        assert len(transfer.transferred_onto(1, [laid, None, None, None]).placements) == count


def test_ways_that_agree_give_a_block_once():
    layout = Layout()
    laid = layout.laid(0, (50, 52, 90, 70), (30, 52, 60, 60))
    over = layout.transferred(1, on0=laid)
    assert over.origins.tolist() == [7, 8]
    assert over.steps.tolist() == [1, 1]
    # chart 3 sees the corner's block on chart 1 and on chart 2, transferred there once
    under = layout.transferred(2, on0=laid)
    assert under.origins.tolist() == [7]
    again = layout.transferred(3, on0=laid, on1=over, on2=under)
    assert again.origins.tolist() == [7]
    assert again.steps.tolist() == [2]
    # and chart 0's own on chart 3 if only that is finished, over either of the bare ones
    bare = layout.transferred(3, on0=laid)
    assert bare.origins.tolist() == [7]
    # order is that of synthesis, whoever they come from
    late, early = (
        layout.laid(0, (30, 55, 90, 70), origin=30),
        layout.laid(3, (5, 30, 60, 60), origin=20),
    )
    assert layout.transferred(1, on0=late, on3=early).origins.tolist() == [20, 30]


def test_of_an_overhang_others_get_what_the_whole_chart_gives_them():
    layout = Layout()
    inner, mask = (30, 20, 60, 60), np.tile(np.eye(8, 7, dtype=np.uint8), (2, 2))
    laid = layout.laid(0, inner, (52, 20, 90, 70), inner, (50, 52, 90, 70), mask=mask)
    overhang = layout.transfer.overhang(0, laid)
    assert overhang.origins.tolist() == [8, 10]
    assert len(overhang.cells) == 2 * mask.size
    for chart in (1, 2, 3):
        found = layout.transfer.transferred_onto(chart, [overhang, None, None, None])
        whole = layout.transfer.transferred_onto(chart, [laid, None, None, None])
        np.testing.assert_array_equal(found.placements, whole.placements)
        np.testing.assert_array_equal(found.cells, whole.cells)
        assert set(found.origins.tolist()) <= {8, 10}
        assert layout.transfer.asked_of(chart) == {0, 1, 2, 3} - {chart}


def test_what_ends_before_the_edge_stays_at_home():
    layout = Layout()
    for column, count in ((30, 0), (38, 0), (42, 1), (73, 1), (75, 0)):
        found = layout.transferred(1, on0=layout.laid(0, (30, column, 90, 70)))
        # two cells from the edge a block still counts
        assert len(found.placements) == count, column


def test_beyond_their_bounds_placements_do_not_count():
    layout = Layout()
    laid = layout.laid(0, (30, 55, 90, 70))
    bounded = replace(laid, bounds=(0, 60, 0, 64))
    shown = layout.painted(1, layout.transferred(1, on0=bounded))[1]
    assert shown[20:40, :2].all()
    assert not shown[:, 6:].any()
    assert layout.painted(1, layout.transferred(1, on0=laid))[1][20:40, 6].all()


def test_closed_tells_where_finished_charts_lie():
    layout = Layout()
    done = layout.laid(0)

    def closed(chart, *finished):
        return sorted(layout.transfer.closed(chart, [done if n in finished else None for n in range(4)]))

    assert closed(1) == []
    edge = closed(1, 0)
    assert [(e, a, b) for e, a, b, _ in edge] == [(3, -np.inf, np.inf)]
    assert edge[0][3] > 0
    assert [e for e, *_ in closed(3, 1, 2)] == [0, 3]
    # round a corner: beyond the edges of charts that are bare, from the corner on
    assert closed(3, 0) == [(0, -np.inf, 0.0, 0), (3, -np.inf, 0.0, 0)]
    assert closed(0, 3) == [(1, 60.0, np.inf, 0), (2, 60.0, np.inf, 0)]


def test_a_part_of_an_edge_is_closed_at_a_junction():
    # a tall chart beside two short ones
    nets = [
        [[(0, 2), (1, 2)], [(0, 0), (1, 0)]],
        [[(1, 2), (2, 2)], [(1, 1), (2, 1)]],
        [[(1, 1), (2, 1)], [(1, 0), (2, 0)]],
    ]
    surface = Surface([RationalPatch.from_points([[(*p, 0) for p in row] for row in net]) for net in nets])
    charts = (Chart(0, 80, 40), Chart(1, 40, 40), Chart(2, 40, 40))
    onto = [[] for _ in charts]
    for transition in transitions(surface, charts, find_seams(surface, charts)):
        onto[transition.seam.other_chart].append(transition)
    transfer = BlockTransfer(charts, (IDENTITY,) * 3, onto, [[]] * 4, SHAPE, (CELL,) * 3)
    empty = joined([])
    assert {c[:3] for c in transfer.closed(0, [None, empty, None])} == {(1, -np.inf, 40.0)}
    assert {c[:3] for c in transfer.closed(0, [None, None, empty])} == {(1, 40.0, np.inf)}
    placed = np.zeros(1, BLOCK)
    placed["row"], placed["column"], placed["height"], placed["width"] = 40, 38, 32, 28
    placed["source_row"], placed["source_column"], placed["first_cell"] = 16 * 90, 16 * 70, -1
    one = placements_of(placed, empty.cells, np.zeros(1, np.int64))
    for other, top in ((1, 0), (2, 40)):
        found = transfer.transferred_onto(other, [one, None, None])
        sources = sources_of(found, charts[other], IDENTITY) / 16
        shown = shown_blocks(found, charts[other]) >= 0
        rows, columns = np.nonzero(shown)
        wanted = np.stack([rows + top - 40 + 90, columns + 40 - 38 + 70], axis=1)
        assert (sources[shown] == wanted).all()
        assert shown[max(0, 25 - top) : 55 - top, :10].all()


@pytest.mark.parametrize(
    "surface", [torus(), sphere(), sphere(tiling="octants")], ids=["torus", "six", "poles"]
)
def test_on_curved_surfaces_texels_on_both_sides_of_an_edge_read_next_to_each_other(surface):
    size = 48
    charts = uniform_layout(surface, chart=size)
    found = find_seams(surface, charts)
    onto = [[] for _ in charts]
    for transition in transitions(surface, charts, found):
        onto[transition.seam.other_chart].append(transition)
    transfer = BlockTransfer(charts, (IDENTITY,) * len(charts), onto, [[]] * 4, SHAPE, (CELL,) * len(charts))
    gaps = []
    for m in found:
        place = 0.5 * (m.start + m.stop)
        at = ((4, place), (place, size - 4), (size - 4, place), (place, 4))[m.edge]
        placed = np.zeros(1, BLOCK)
        placed["chart"], placed["height"], placed["width"], placed["first_cell"] = m.chart, 24, 24, -1
        placed["row"], placed["column"] = np.int32(at[0]), np.int32(at[1])
        placed["source_row"], placed["source_column"] = 16 * 90, 16 * 70
        own = placements_of(placed, np.zeros(0, np.uint8), np.zeros(1, np.int64))
        finished = [own if n == m.chart else None for n in range(len(charts))]
        over = transfer.transferred_onto(m.other_chart, finished)
        if not len(over.placements):
            continue
        here = np.array((90, 70)) + np.stack(edge_texel(m.edge, place, size)) - at
        texel = edge_texel(m.other_edge, 0.5 * (m.other_start + m.other_stop), size)
        there = sources_of(over, charts[m.other_chart], IDENTITY)[texel] / 16
        gaps.append(np.abs(there - here).max())
    assert len(gaps) > 0.5 * len(found)
    assert np.median(gaps) <= 1.5
    assert max(gaps) <= 3


def edge_texel(edge, place, size):
    place = min(int(place), size - 1)
    return ((0, place), (place, size - 1), (size - 1, place), (place, 0))[edge]


def test_joined_keeps_masks_with_their_placements():
    layout = Layout()
    rng = np.random.default_rng(1)
    masks = [rng.integers(0, 2, (16, 14)).astype(np.uint8) for _ in range(2)]
    parts = [
        layout.laid(0, (30, 30, 90, 70), mask=masks[0]),
        layout.laid(0, (20, 20, 90, 70)),
        layout.laid(0, (40, 30, 90, 70), mask=masks[1]),
    ]
    before = parts[2].placements.copy()
    whole = joined(parts)
    for n, mask in ((0, masks[0]), (2, masks[1])):
        start = whole.placements["first_cell"][n]
        assert (whole.cells[start : start + mask.size] == mask.reshape(-1)).all()
    assert whole.placements["first_cell"][1] == -1
    assert (parts[2].placements == before).all()
    assert len(joined([]).placements) == len(joined([]).cells) == 0


@pytest.mark.parametrize("spec", ["vase", "cyclide", "sphere"])
def test_fits_along_a_seam_equal_their_twin(spec):
    surface, rng = surface_from_spec(spec), np.random.default_rng(4)
    charts = density_layout(surface, texels=30_000)
    scale = float(np.sqrt(30_000) / surface.size)
    fields = direction_fields(surface, charts, default_direction(surface), scale)
    transfer = BlockTransfer(
        charts, fields, [[]] * len(charts), [[]] * len(charts), SHAPE, (CELL,) * len(charts)
    )
    all_found, centred, left_out = 0, 0, 0
    for transition in transitions(surface, charts, find_seams(surface, charts)):
        seam = transition.seam
        old, new, count = fields[seam.chart], fields[seam.other_chart], 4
        block = np.zeros(count, BLOCK)
        across = np.rint(transition.line + rng.integers(-12, 12, count))
        along = np.rint(rng.uniform(seam.start, seam.stop, count))
        block["row"], block["column"] = (along, across) if seam.edge & 1 else (across, along)
        block["height"], block["width"] = rng.integers(10, 60, (2, count))
        block["source_row"], block["source_column"] = rng.integers(0, 16 * 180, (2, count))
        block["symmetry"], block["centred"] = rng.integers(0, 8, count), rng.integers(0, 2, count)
        near = old.integers_at(block["row"], block["column"]) + 64 * rng.integers(-2, 3, (count, 4))
        block["matrix"] = np.where(block["centred"][:, None] > 0, near, 0)
        ends = np.sort(rng.uniform(seam.start, seam.stop, (count, 2)), axis=1)
        places, fitted = transfer._fitted(transition, block, ends)
        wanted = plain_fit(transition, block, ends, old, new, charts[seam.other_chart])
        for place, numbers, one in zip(places, fitted.tolist(), wanted, strict=True):
            symmetry, *source, own = numbers[:4]
            all_found += 1
            if one is None:
                left_out += 1
                assert symmetry == -1
                continue
            np.testing.assert_allclose(place, one[0], rtol=1e-9, atol=1e-9)
            assert symmetry == one[1]
            np.testing.assert_allclose(source, one[2], atol=2 + 1e-6)
            assert not any(at % 4 for at in source)  # quarters of a pixel
            assert own == (one[3] is not None)
            if own:
                centred += 1
                assert numbers[4:] == one[3].tolist()
    assert centred > 10
    assert left_out < 0.5 * all_found
