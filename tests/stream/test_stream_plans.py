"""Plans: exact round trips, small, and never a symbol that the bytes do not determine."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from streams import (
    any_grids,
    anything,
    anything_bent,
    changed,
    covered,
    leaning,
    noise,
    same,
    with_matrices,
    woven,
)

from upholster.errors import FormatError, InputError
from upholster.methods import synthesize
from upholster.methods.paper import PaperOptions, synthesize_paper
from upholster.quilt import Chart, Quilt, paint
from upholster.quilt.placement import MASK_CUT, PLACEMENT
from upholster.quilt.plans import GridPlan, PlacementList, StripPlan
from upholster.stream.byte_reader import ByteReader
from upholster.stream.grid_plan import GridDecoder
from upholster.stream.plan_common import FINE_LIST, GRID, LIST, STRIPS
from upholster.stream.plans import encode_plan, open_plan
from upholster.stream.strip_plan import StripDecoder


def decoder_of(quilt: Any, plan: Any) -> Any:
    return open_plan(ByteReader(plan), quilt.charts, quilt.exemplar_shape, quilt.fields)


def back(quilt: Any) -> Any:
    """What comes back, and the kind of plan; told again, it takes the same bytes."""
    plan, sources, masks = encode_plan(quilt).parts
    decoder = decoder_of(quilt, plan)
    decoder.feed_sources(sources)
    if masks:
        decoder.feed_masks(masks)
    assert decoder.complete
    assert decoder.unread == 0
    again = decoder.quilt()
    assert encode_plan(again).parts == (plan, sources, masks)
    return again, plan[0]


@pytest.mark.parametrize(
    "spec", ["cyclide", "sphere", "sphere:tiling=octants", "cylinder:spans=3", "plane:spans=2x2"]
)
@pytest.mark.parametrize(
    "sizes", [(64, 16, 2, 4), (50, 16, 2, 4), (33, 32, 3, 8), (40, 8, 1, 2), (70, 16, 1, 6)]
)
def test_quilts_of_method_paper_come_back_exactly_and_are_told_compactly(spec: Any, sizes: Any) -> None:
    chart, block, levels, overlap = sizes
    _, quilt, _ = covered(spec, chart, block, levels, overlap)
    again, kind = back(quilt)
    assert kind == STRIPS
    assert isinstance(again.plan, StripPlan)
    assert same(quilt, again)


@pytest.mark.parametrize(("block", "edge_block"), [(24, 16), (16, 24), (28, 12)])
def test_edge_blocks_of_their_own_size_come_back_exactly(block: Any, edge_block: Any) -> None:
    _, quilt, _ = covered("sphere", 52, block, edge_block=edge_block)
    edges = quilt.placements["mask"] == MASK_CUT
    assert (quilt.placements["height"] == np.where(edges, edge_block, block)).all()
    again, kind = back(quilt)
    assert kind == STRIPS
    assert isinstance(again.plan, StripPlan)
    assert same(quilt, again)


@pytest.mark.parametrize("shape", [(48, 16), (16, 48), (16, 16), (17, 300)])
def test_exemplars_with_few_candidates(shape: Any) -> None:
    surface = covered("cylinder")[0]
    charts = tuple(Chart(n, 50, 64) for n in range(4))
    options = PaperOptions(block=16, overlap=4, levels=2)
    quilt = synthesize_paper(noise(*shape), surface, charts, options=options)
    again, kind = back(quilt)
    assert kind == STRIPS
    assert isinstance(again.plan, StripPlan)
    assert same(quilt, again)


def test_without_seams_and_with_no_placements() -> None:
    _, quilt, _ = covered(seams=False)
    assert same(quilt, back(quilt)[0])
    none = Quilt(
        quilt.charts, quilt.exemplar_shape, PlacementList(np.zeros(0, PLACEMENT), np.zeros(0, np.uint8))
    )
    assert same(none, back(none)[0])


def test_sources_take_less_than_a_byte_and_edge_blocks_less_than_six() -> None:
    _, quilt, _ = covered(chart=256, block=16)
    _, sources, masks = encode_plan(quilt).parts
    edge_blocks = (quilt.placements["mask"] == MASK_CUT).sum() // 2
    assert len(sources) <= 0.8 * (len(quilt.placements) - edge_blocks)
    assert len(masks) <= 4 * edge_blocks


def test_charts_of_different_sizes_meet_along_parts() -> None:
    surface, quilt, exemplar = covered()
    charts = tuple(Chart(n, 64, 64 if n % 2 else 48) for n in range(16))
    options = PaperOptions(block=16, overlap=4, levels=2)
    quilt = synthesize_paper(exemplar, surface, charts, options=options)
    again, kind = back(quilt)
    assert kind == STRIPS
    assert isinstance(again.plan, StripPlan)
    assert same(quilt, again)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.integers(1, 5))
def test_any_valid_quilt_comes_back(seed: Any, count: Any, charts: Any) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 90, 2).tolist()) for _ in range(charts)]
    shape = int(rng.integers(8, 70)), int(rng.integers(8, 70))
    for quilt, kinds in (
        (anything(rng, shape, layout, count), {LIST}),
        (anything_bent(rng, shape, layout, count), {LIST, FINE_LIST}),
    ):
        again, kind = back(quilt)
        assert kind in kinds
        assert same(quilt, again)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.booleans())
def test_any_grid_plan_comes_back(seed: Any, charts: Any, turned: Any) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 120, 2).tolist()) for _ in range(charts)]
    quilt = any_grids(rng, tuple(rng.integers(4, 90, 2).tolist()), layout, turned)
    again, kind = back(quilt)
    assert kind == GRID
    assert same(quilt, again)


def test_a_strip_plan_told_as_a_list_comes_back() -> None:
    _, quilt, _ = covered("cylinder")
    again, kind = back(changed(quilt))
    assert kind == LIST
    assert same(changed(quilt), again)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"sample_size": 0.6},
        {"sample_size": 5.0},
        {"direction": "0,0,1"},
        {"spec": "torus", "texels": 60_000},
        {"mirror": True},
        {"spec": "torus", "mirror": True, "rotate": True},
    ],
)
def test_quilts_of_method_quilt_come_back_with_their_plan(options: Any) -> None:
    _, quilt, _ = woven(effort=2, **options)
    assert isinstance(quilt.plan, GridPlan)
    # Blocks that were added to a chart come as transferred ones without a link, in a grid of their own.
    linked = quilt.plan.blocks["link"] >= 0
    counts = [
        (grid.own, grid.transferred, int(linked[start : start + grid.transferred].sum()))
        for grid, start in zip(quilt.plan.grids, quilt.plan.starts[:-1], strict=True)
    ]
    assert all(found == told or (found == 0 and not own) for own, told, found in counts)
    assert any(found < told for _, told, found in counts)
    assert linked.sum() == sum(found for *_, found in counts) > 0
    again, kind = back(quilt)
    assert kind == GRID
    assert same(quilt, again)
    assert (again.plan.blocks["link"] == quilt.plan.blocks["link"]).all()


@pytest.mark.parametrize("options", [{}, {"spec": "torus", "sample_size": 1.5}])
def test_transferred_blocks_may_have_centre_matrices(options: Any) -> None:
    _, plain, _ = woven(**options)
    _, quilt, _ = leaning(**options)
    assert quilt.plan.blocks["centred"].sum() > 30
    again, kind = back(quilt)
    assert kind == GRID
    assert same(quilt, again)
    first = int(np.flatnonzero(plain.plan.blocks["link"] >= 0)[0])
    few = plain.plan.blocks.copy()
    few["centred"][first] = 1
    chart = plain.plan.grids[int(np.searchsorted(plain.plan.starts, first, side="right")) - 1].chart
    few["matrix"][first] = plain.fields[chart].integers_at(few["row"][first], few["column"][first]) + 32
    with pytest.raises(InputError, match="other than multiples of 64"):
        encode_plan(replace(plain, plan=replace(plain.plan, blocks=few)))


@pytest.mark.parametrize("name", ["matrix", "row", "column", "width", "order"])
def test_own_blocks_that_a_grid_does_not_tell_are_refused(name: Any) -> None:
    _, quilt, _ = woven()
    plan, blocks = quilt.plan, quilt.plan.blocks.copy()
    n = int(np.flatnonzero(blocks["link"] < 0)[3])
    if name == "matrix":
        here = quilt.fields[plan.grids[0].chart].integers_at(blocks["row"][n], blocks["column"][n])
        blocks["centred"][n], blocks["matrix"][n] = 1, here
    elif name == "order":
        blocks[[n - 1, n]] = blocks[[n, n - 1]]
    else:
        blocks[name][n] += 1
    # Enough cells for any windows.
    cells = np.ones(2 * len(plan.mask_cells), np.uint8)
    with pytest.raises(InputError, match=f"block {n} is none of its grid"):
        encode_plan(replace(quilt, plan=replace(plan, blocks=blocks, mask_cells=cells)))


def test_links_that_lead_nowhere_are_refused() -> None:
    _, quilt, _ = woven()
    plan = quilt.plan
    n = int(np.flatnonzero(plan.blocks["link"] >= 0)[0])
    chart_start = int(plan.starts[int(np.searchsorted(plan.starts, n, side="right")) - 1])
    for link in (-2, chart_start, len(plan.blocks)):
        blocks = plan.blocks.copy()
        blocks["link"][n] = link
        with pytest.raises(InputError, match=f"block {n} "):
            encode_plan(replace(quilt, plan=replace(plan, blocks=blocks)))
    # None at all is no fault.
    blocks = plan.blocks.copy()
    blocks["link"] = -1
    loose = replace(quilt, plan=replace(plan, blocks=blocks))
    assert same(back(loose)[0], loose)


def test_flat_quilts_come_back() -> None:
    surface, exemplar = covered("plane")[0], noise(64, 64)
    quilt = synthesize(exemplar, surface, texels=(150, 110), block=20)
    again, kind = back(quilt)
    assert kind == GRID
    assert same(quilt, again)
    tile = synthesize(exemplar, surface, texels=(150, 110), block=20, tileable=True)
    again, kind = back(tile)
    assert kind in (LIST, FINE_LIST)
    assert same(tile, again)


def test_masks_that_show_what_is_not_there_come_back_as_well() -> None:
    _, quilt, _ = woven()
    cells = np.random.default_rng(2).integers(0, 2, len(quilt.mask_cells)).astype(np.uint8)
    wild = replace(quilt, plan=replace(quilt.plan, mask_cells=cells))
    again, kind = back(wild)
    assert kind == GRID
    assert same(wild, again)


@cache
def quilt_of(kind: Any) -> Any:
    """A small quilt of each plan, with all that it can hold."""
    if kind == "strips":
        return covered("cylinder")[1]
    if kind == "list":
        return changed(covered("cylinder")[1])
    if kind == "fine list":
        charts = [Chart(0, 40, 50), Chart(0, 33, 20), Chart(0, 17, 64), Chart(0, 32, 32)]
        return anything_bent(np.random.default_rng(9), (32, 40), charts, 60)
    return with_matrices(woven("cone", 9_000)[1])


KINDS = ("strips", "list", "fine list", "grid")


@pytest.mark.parametrize("kind", KINDS)
def test_every_prefix_decodes_and_paints(kind: Any) -> None:
    quilt = quilt_of(kind)
    rng = np.random.default_rng(4)
    plan, sources, masks = encode_plan(quilt).parts
    image = noise(*quilt.exemplar_shape)
    whole, charts = paint(quilt, image).arrays, 0
    for cut in sorted({0, len(sources), *rng.integers(0, len(sources), 10).tolist()}):
        decoder = decoder_of(quilt, plan)
        decoder.feed_sources(sources[:cut])
        part = decoder.quilt()
        # Charts come in the order in which they were laid; what is not there shows the mean.
        assert decoder.charts_known() >= charts
        charts = decoder.charts_known()
        painted = paint(part, image).arrays
        assert [array.shape for array in painted] == [array.shape for array in whole]
        if kind in ("list", "fine list"):
            known = part.placements[part.placements["chart"] < charts]
            wanted = quilt.placements[quilt.placements["chart"] < charts]
            for name in ("row", "column", "source_row", "source_column", "symmetry", "centred", "matrix"):
                np.testing.assert_array_equal(known[name], wanted[name])
    known_cells = 0
    for cut in sorted({0, len(masks), *rng.integers(0, len(masks), 10).tolist()}):
        decoder = decoder_of(quilt, plan)
        decoder.feed_sources(sources)
        decoder.feed_masks(masks[:cut])
        assert decoder.known_cells >= known_cells
        known_cells = decoder.known_cells
        paint(decoder.quilt(), image)
    assert same(decoder.quilt(), quilt)


@pytest.mark.parametrize("kind", KINDS)
def test_no_symbol_is_taken_that_the_bytes_do_not_determine(kind: Any) -> None:
    quilt = quilt_of(kind)
    plan, sources, masks = encode_plan(quilt).parts
    rng = np.random.default_rng(0)
    for cut in [*range(12), *range(12, len(sources), 41)]:
        decoder = decoder_of(quilt, plan)
        decoder.feed_sources(sources[:cut])
        known = decoder.known
        for tail in (b"\0" * 40, b"\xff" * 40, rng.bytes(40), rng.bytes(40)):
            other = decoder_of(quilt, plan)
            try:
                other.feed_sources(sources[:cut] + tail)
            except FormatError:
                continue  # the tail led outside; what was known before stays known
            assert other.known >= known
            assert _known_part(other, known) == _known_part(decoder, known)
    whole = decoder_of(quilt, plan)
    whole.feed_sources(sources)
    for cut in range(0, len(masks), 41):
        decoder = decoder_of(quilt, plan)
        decoder.feed_sources(sources)
        decoder.feed_masks(masks[:cut])
        for tail in (b"\0" * 40, b"\xff" * 40, rng.bytes(40)):
            other = decoder_of(quilt, plan)
            other.feed_sources(sources)
            other.feed_masks(masks[:cut] + tail)
            assert other.known_cells >= decoder.known_cells
            known = decoder.known_cells
            assert (other._cells[:known] == decoder._cells[:known]).all()


def _known_part(decoder: Any, known: Any) -> Any:
    if isinstance(decoder, GridDecoder):
        return decoder._records[:known].tolist()
    if isinstance(decoder, StripDecoder):
        return decoder._chosen[:known].tolist()
    return decoder._fields[:known].tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_byte_by_byte_is_all_at_once(kind: Any) -> None:
    quilt = quilt_of(kind)
    plan, sources, masks = encode_plan(quilt).parts
    decoder, known = decoder_of(quilt, plan), -1
    for n in range(len(sources)):
        decoder.feed_sources(sources[n : n + 1])
        at_once = decoder_of(quilt, plan)
        if n % 97 == 0:
            at_once.feed_sources(sources[: n + 1])
            assert at_once.known == decoder.known
        assert decoder.known >= known
        known = decoder.known
    for n in range(len(masks)):
        decoder.feed_masks(masks[n : n + 1])
    assert same(decoder.quilt(), quilt)


def test_what_is_missing_shows_the_mean() -> None:
    _, quilt, exemplar = covered("cylinder")
    plan, _, _ = encode_plan(quilt).parts
    bare = decoder_of(quilt, plan).quilt()
    for image in (exemplar, exemplar.astype(np.uint16) * 257, exemplar.astype(np.float32) / 255):
        painted = paint(bare, image).arrays[0]
        mean = image.mean(axis=(0, 1), dtype=np.float64)
        step = 0.5 if image.dtype != np.float32 else 1e-6
        assert (painted == painted[0, 0]).all()
        assert np.abs(painted[0, 0] - mean).max() <= step


@pytest.mark.parametrize("effort", [0, 2])
@pytest.mark.parametrize("spec", ["plane", "torus"])
def test_straight_cuts_leave_nothing_bare_and_lie_midway(spec: Any, effort: Any) -> None:
    _, quilt, _ = woven(spec, 60_000, effort=effort)
    plan, sources, _ = encode_plan(quilt).parts
    decoder = decoder_of(quilt, plan)
    decoder.feed_sources(sources)
    straight = decoder.quilt()
    full = paint(straight, np.full((*quilt.exemplar_shape, 1), 255, np.uint8))
    assert all((array == 255).all() for array in full.arrays)
    assert len(straight.mask_cells) == len(quilt.mask_cells) > 0
    if spec == "plane" and effort == 0:
        # A block inside overlaps those to its left and above it, half of which it leaves to each.
        grid, placed = quilt.plan.grids[0], straight.placements
        one = placed[grid.across + 1]
        side = -(-grid.width // grid.mask_cell)
        mask = straight.mask_cells[one["first_cell"] :][: side * side].reshape(side, side)
        half = (grid.width - grid.step_column) / (2 * grid.mask_cell)
        assert abs(int((mask[side // 2 :] == 0).sum(axis=1)[0]) - half) <= 1
        assert abs(int((mask[:, side // 2 :] == 0).sum(axis=0)[0]) - half) <= 1
        assert (np.diff(mask.astype(int), axis=1) >= 0).all()


def test_charts_arrive_one_after_another() -> None:
    _, quilt, _ = covered()
    plan, sources, _ = encode_plan(quilt).parts
    decoder, seen = decoder_of(quilt, plan), [0]
    for byte in sources:
        decoder.feed_sources(bytes([byte]))
        seen.append(decoder.charts_known())
        part = decoder.quilt()
        if seen[-1] != seen[-2]:
            own = [part.on_chart(n)[: len(quilt.on_chart(n))] for n in range(seen[-1])]
            for n, placed in enumerate(own):
                assert (placed == quilt.on_chart(n)[: len(placed)]).all()
    assert seen[-1] == len(quilt.charts)
    assert len(set(seen)) > 8


def test_what_the_format_does_not_hold_is_refused() -> None:
    _, quilt, _ = covered("cylinder")
    for plan, message in (
        (PlacementList(quilt.placements, quilt.mask_cells * 2), "a cell of the quilt is 2"),
        (replace(quilt.plan, masks=quilt.plan.masks * 2), "a cell of the quilt is 2"),
    ):
        with pytest.raises(InputError, match=message):
            encode_plan(Quilt(quilt.charts, quilt.exemplar_shape, plan))
    placed = quilt.placements.copy()
    placed["row"][7] = 10_000
    with pytest.raises(InputError, match="placement 7 does not touch its chart"):
        encode_plan(Quilt(quilt.charts, quilt.exemplar_shape, PlacementList(placed, quilt.mask_cells)))


class OtherPlan:
    """A plan that no stream knows."""

    def placements(self, charts: Any) -> Any:
        return np.zeros(0, PLACEMENT), np.zeros(0, np.uint8)


def test_a_plan_that_the_format_has_no_place_for_is_refused() -> None:
    with pytest.raises(InputError, match="plan is a OtherPlan; allowed: StripPlan, GridPlan, PlacementList"):
        encode_plan(Quilt((Chart(0, 9, 9),), (32, 32), OtherPlan()))


def test_placements_outside_chart_or_exemplar_are_refused() -> None:
    _, quilt, _ = covered("cylinder")
    plan, sources, _ = encode_plan(changed(quilt)).parts
    smaller = tuple(Chart(chart.face, 20, 20) for chart in quilt.charts)
    with pytest.raises(FormatError, match="does not touch it"):
        open_plan(ByteReader(plan), smaller, quilt.exemplar_shape).feed_sources(sources)
    with pytest.raises(FormatError, match="outside"):
        open_plan(ByteReader(plan), quilt.charts, (20, 20)).feed_sources(sources)


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (b"\4", "byte 0: kind of plan is 4; allowed: 0 to 3"),
        (b"\2\x11", "byte 1: feather is 17; allowed: 0 to 16"),
        (b"\2\2\1\0\1\0\2", "byte 6: a chart's grids do not follow each other"),
        (b"\2\2\1\0\0\0\0", "byte 7: a chart has no grid"),
        (b"\2\2\0\x80\x04\x03", "byte 6: mask_cell of a grid is 0; allowed: 1 to 255"),
        (b"\2\2\0\0\x80\x80\x20\0", "byte 8: plan has"),
        (b"\2\2\0\0\0\x0a", "byte 5: number of positions skipped is 10; allowed: 0 to 4"),
        (b"\3" + b"\x80\x80\x20" * 4 + b"\0", "plan has 2097152 placements"),
        (b"\1\x41\4\2\0", "byte 1: block is 65; allowed: 2 to 32"),
        (b"\1\x10\x08\2\0", "byte 2: overlap is 8; allowed: 1 to 7"),
        (b"\1\x10\4\2\1\x08\2\2\0\0\0", "byte 5: edge block is 8; allowed: 9 to 32"),
        (b"\1\x10\4\2\1\x10\3\2\0\0\0", "byte 8: cell is 3"),
        (b"\1\x10\4\2\1\x10\2\2\0\0\x09", "byte 10: chart is 9"),
        (b"\1\x10\4\2\1\x10\2\2\x20\0\1\0\x41\0", "byte 12: length of a strip is 65"),
        (b"\1\x10\4\2\0!", "byte 5: 1 bytes too many in plan"),
        (b"\0" + b"\x80\x80\x20" * 4 + b"\0", "plan has 2097152 placements"),
    ],
)
def test_malformed_plans_are_refused(plan: Any, message: Any) -> None:
    charts = tuple(Chart(n, 64, 64) for n in range(4))
    with pytest.raises(FormatError) as error:
        open_plan(ByteReader(plan), charts, (32, 32))
    assert message in str(error.value)
    assert str(error.value).startswith("byte ")
