"""Placements: exact round trips, small, and never a symbol that the bytes do not determine."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from streams import anything, anything_bent, changed, covered, noise, same, same_fields, woven
from upholster.stream.grid_decoder import GridDecoder
from upholster.stream.placement_encoder import encode_placements
from upholster.stream.placements import open_plan
from upholster.stream.records import GRID

from upholster.errors import FormatError, InputError
from upholster.methods import synthesize
from upholster.methods.paper import PaperOptions, synthesize_paper
from upholster.quilt import Chart, Quilt, paint
from upholster.quilt.placement import MASK_CUT, PLACEMENT
from upholster.stream.byte_reader import ByteReader


def decoder_of(quilt: Any, plan: Any) -> Any:
    return open_plan(ByteReader(plan), quilt.charts, quilt.exemplar_shape, quilt.fields)


def same_texels(a: Any, b: Any) -> Any:
    """Whether two quilts paint the same."""
    image = noise(*a.exemplar_shape)
    return all((x == y).all() for x, y in zip(paint(a, image).arrays, paint(b, image).arrays, strict=True))


def back(quilt: Any, shared: Any = ()) -> Any:
    plan, sources, masks = encode_placements(quilt, shared)
    decoder = decoder_of(quilt, plan)
    decoder.feed_sources(sources)
    if masks:
        decoder.feed_masks(masks)
    assert decoder.complete
    assert decoder.unread == 0
    return decoder.quilt(), plan


@pytest.mark.parametrize(
    "spec", ["cyclide", "sphere", "sphere:tiling=octants", "cylinder:spans=3", "plane:spans=2x2"]
)
@pytest.mark.parametrize(
    "sizes", [(64, 16, 2, 4), (50, 16, 2, 4), (33, 32, 3, 8), (40, 8, 1, 2), (70, 16, 1, 6)]
)
def test_quilts_of_method_paper_come_back_exactly_and_are_told_compactly(spec: Any, sizes: Any) -> None:
    chart, block, levels, overlap = sizes
    surface, quilt, _ = covered(spec, chart, block, levels, overlap)
    again, plan = back(quilt, surface.shared)
    assert plan[0] == 1
    assert same(quilt, again)


@pytest.mark.parametrize("shape", [(48, 16), (16, 48), (16, 16), (17, 300)])
def test_exemplars_with_few_candidates(shape: Any) -> None:
    surface = covered("cylinder")[0]
    charts = tuple(Chart(n, 50, 64) for n in range(4))
    options = PaperOptions(block=16, overlap=4, levels=2)
    quilt = synthesize_paper(noise(*shape), surface, charts, options=options)
    again, plan = back(quilt, surface.shared)
    assert plan[0] == 1
    assert same(quilt, again)


def test_without_seams_and_with_no_placements() -> None:
    surface, quilt, _ = covered(seams=False)
    assert same(quilt, back(quilt, surface.shared)[0])
    none = Quilt(quilt.charts, quilt.exemplar_shape, np.zeros(0, PLACEMENT), np.zeros(0, np.uint8))
    assert same(none, back(none)[0])


def test_sources_take_less_than_a_byte_and_edge_blocks_less_than_six() -> None:
    surface, quilt, _ = covered(chart=256, block=16)
    _, sources, masks = encode_placements(quilt, surface.shared)
    edge_blocks = (quilt.placements["mask"] == MASK_CUT).sum() // 2
    assert len(sources) <= 0.8 * (len(quilt.placements) - edge_blocks)
    assert len(masks) <= 4 * edge_blocks


def test_charts_of_different_sizes_meet_along_parts() -> None:
    surface, quilt, exemplar = covered()
    charts = tuple(Chart(n, 64, 64 if n % 2 else 48) for n in range(16))
    options = PaperOptions(block=16, overlap=4, levels=2)
    quilt = synthesize_paper(exemplar, surface, charts, options=options)
    again, plan = back(quilt, surface.shared)
    assert plan[0] == 1
    assert same(quilt, again)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.integers(1, 5))
def test_any_valid_quilt_comes_back(seed: Any, count: Any, charts: Any) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 90, 2).tolist()) for _ in range(charts)]
    shape = int(rng.integers(8, 70)), int(rng.integers(8, 70))
    for quilt in (anything(rng, shape, layout, count), anything_bent(rng, shape, layout, count)):
        again, plan = back(quilt)
        if plan[0] == GRID:
            assert same_texels(quilt, again)
        else:
            assert same(quilt, again)


def test_a_quilt_that_is_not_quite_regular_comes_back() -> None:
    surface, quilt, _ = covered("cylinder")
    again, plan = back(changed(quilt), surface.shared)
    assert plan[0] == 0
    assert same(changed(quilt), again)


@pytest.mark.parametrize("options", [{}, {"sample_size": 0.6}, {"sample_size": 5.0}, {"direction": "0,0,1"}])
def test_quilts_of_method_quilt_come_back_and_are_told_compactly(options: Any) -> None:
    surface, quilt, _ = woven(**options)
    again, plan = back(quilt, surface.shared)
    assert plan[0] == GRID
    assert same_fields(quilt.fields, again.fields)
    assert same_texels(quilt, again)
    # What comes back is told by the same bytes again.
    twice, plan_again = back(again, surface.shared)
    assert plan_again == plan
    assert same_texels(quilt, twice)


def test_flat_quilts_come_back() -> None:
    surface, exemplar = covered("plane")[0], noise(64, 64)
    quilt = synthesize(exemplar, surface, texels=(150, 110), block=20)
    again, plan = back(quilt)
    assert plan[0] == GRID
    assert same_texels(quilt, again)


def test_what_nobody_sees_costs_nothing() -> None:
    surface, quilt, _ = woven()
    _, _, masks = encode_placements(quilt, surface.shared)
    placed, cells = quilt.placements, quilt.mask_cells.copy()
    reach = 3
    for one in placed[placed["mask"] == MASK_CUT]:
        chart = quilt.charts[one["chart"]]
        high, wide = -(-one["height"] // one["mask_cell"]), -(-one["width"] // one["mask_cell"])
        top = one["row"] - one["height"] // 2 + one["mask_cell"] * np.arange(high)
        left = one["column"] - one["width"] // 2 + one["mask_cell"] * np.arange(wide)
        beyond = (top + one["mask_cell"] + reach <= 0) | (top - reach >= chart.height)
        aside = (left + one["mask_cell"] + reach <= 0) | (left - reach >= chart.width)
        part = cells[one["first_cell"] : one["first_cell"] + high * wide].reshape(high, wide)
        part[beyond[:, None] | aside] ^= 1
    assert (cells != quilt.mask_cells).any()
    changed = replace(quilt, cells=cells)
    assert encode_placements(changed, surface.shared)[2] == masks


def test_masks_that_show_what_is_not_there_come_back_as_well() -> None:
    surface, quilt, _ = woven()
    cells = np.random.default_rng(2).integers(0, 2, len(quilt.mask_cells)).astype(np.uint8)
    wild = replace(quilt, cells=cells)
    again, plan = back(wild, surface.shared)
    assert plan[0] == GRID
    assert same_texels(wild, again)


def kind_of_quilt(kind: Any) -> Any:
    surface, quilt, _ = woven() if kind == "quilt" else covered("cylinder")
    return surface, changed(quilt) if kind == "general" else quilt


@pytest.mark.parametrize("kind", ["regular", "general", "quilt"])
def test_no_symbol_is_taken_that_the_bytes_do_not_determine(kind: Any) -> None:
    surface, quilt = kind_of_quilt(kind)
    plan, sources, masks = encode_placements(quilt, surface.shared)
    rng = np.random.default_rng(0)
    for cut in [*range(12), *range(12, len(sources), 29 if kind != "quilt" else 173)]:
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
    for cut in range(0, len(masks), 13 if kind != "quilt" else 173):
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
    if decoder.regular:
        return decoder._chosen[:known].tolist()
    return decoder._fields[:known].tolist()


@pytest.mark.parametrize("kind", ["regular", "general", "quilt"])
def test_byte_by_byte_is_all_at_once(kind: Any) -> None:
    surface, quilt = kind_of_quilt(kind)
    plan, sources, masks = encode_placements(quilt, surface.shared)
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
    if kind == "quilt":
        assert same(decoder.quilt(), back(quilt, surface.shared)[0])
    else:
        assert same(decoder.quilt(), quilt)


def test_what_is_missing_repeats_the_exemplar_mirrored() -> None:
    surface, quilt, exemplar = covered("cylinder")
    plan, _, _ = encode_placements(quilt, surface.shared)
    painted = paint(decoder_of(quilt, plan).quilt(), exemplar).arrays[0]
    height, width = exemplar.shape[:2]
    rows, columns = np.arange(painted.shape[0]), np.arange(painted.shape[1])
    rows = np.where(rows // height % 2, height - 1 - rows % height, rows % height)
    columns = np.where(columns // width % 2, width - 1 - columns % width, columns % width)
    assert (painted == exemplar[np.ix_(rows, columns)]).all()


def test_charts_arrive_one_after_another() -> None:
    surface, quilt, _ = covered()
    plan, sources, _ = encode_placements(quilt, surface.shared)
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
    with pytest.raises(InputError, match="a cell of the quilt is 2"):
        encode_placements(Quilt(quilt.charts, quilt.exemplar_shape, quilt.placements, quilt.mask_cells * 2))
    placed = quilt.placements.copy()
    placed["row"][7] = 10_000
    with pytest.raises(InputError, match="placement 7 does not touch its chart"):
        encode_placements(Quilt(quilt.charts, quilt.exemplar_shape, placed, quilt.mask_cells))


def test_placements_outside_chart_or_exemplar_are_refused() -> None:
    _, quilt, _ = covered("cylinder")
    plan, sources, _ = encode_placements(changed(quilt))
    smaller = tuple(Chart(chart.patch, 20, 20) for chart in quilt.charts)
    with pytest.raises(FormatError, match="does not touch its chart"):
        open_plan(ByteReader(plan), smaller, quilt.exemplar_shape).feed_sources(sources)
    with pytest.raises(FormatError, match="outside"):
        open_plan(ByteReader(plan), quilt.charts, (20, 20)).feed_sources(sources)


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (b"\4", "byte 0: kind of plan is 4; allowed: 0 to 3"),
        (b"\2\x11", "byte 1: feather is 17; allowed: 0 to 16"),
        (b"\2\2\1\0\0\1\2", "byte 7: a chart comes twice in the order"),
        (b"\2\2\0\x80\x04\x03", "byte 6: cell of a raster is 0; allowed: 1 to 255"),
        (b"\2\2\0\0\x80\x80\x20\0", "byte 8: plan has"),
        (b"\2\2\0\0\0\x0a", "byte 5: number of positions skipped is 10; allowed: 0 to 4"),
        (b"\3" + b"\x80\x80\x20" * 4 + b"\0", "plan has 2097152 placements"),
        (b"\1\x41\4\2\0", "byte 1: block is 65; allowed: 2 to 32"),
        (b"\1\x10\x08\2\0", "byte 2: overlap is 8; allowed: 1 to 7"),
        (b"\1\x10\4\2\1\3\2\0\0\0", "byte 7: cell is 3"),
        (b"\1\x10\4\2\1\2\2\0\0\x09", "byte 9: chart is 9"),
        (b"\1\x10\4\2\1\2\2\x20\0\1\0\x41\0", "byte 11: length of a strip is 65"),
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
