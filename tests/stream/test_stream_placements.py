"""Placements: exact round trips, small, and never a symbol that the bytes do not determine."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from streams import anything, changed, covered, noise, same

from upholster.errors import FormatError, InputError
from upholster.stream.fields import Fields
from upholster.stream.placement_encoder import encode_placements
from upholster.stream.placements import PlacementDecoder
from upholster.synthesis import Chart, PaperOptions, Quilt, paint, synthesize_paper
from upholster.synthesis.quilt import MASK_CUT, PLACEMENT


def decoder_of(quilt: Any, plan: Any) -> Any:
    return PlacementDecoder(Fields(plan), quilt.charts, quilt.exemplar_shape)


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
    quilt = anything(rng, (int(rng.integers(8, 70)), int(rng.integers(8, 70))), layout, count)
    again, _ = back(quilt)
    assert same(quilt, again)


def test_a_quilt_that_is_not_quite_regular_comes_back() -> None:
    surface, quilt, _ = covered("cylinder")
    again, plan = back(changed(quilt), surface.shared)
    assert plan[0] == 0
    assert same(changed(quilt), again)


@pytest.mark.parametrize("regular", [True, False])
def test_no_symbol_is_taken_that_the_bytes_do_not_determine(regular: Any) -> None:
    surface, quilt, _ = covered("cylinder")
    quilt = quilt if regular else changed(quilt)
    plan, sources, masks = encode_placements(quilt, surface.shared)
    rng = np.random.default_rng(0)
    for cut in [*range(12), *range(12, len(sources), 29)]:
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
    for cut in range(0, len(masks), 13):
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
    if decoder.regular:
        return decoder._chosen[:known].tolist()
    return decoder._fields[:known].tolist()


@pytest.mark.parametrize("regular", [True, False])
def test_byte_by_byte_is_all_at_once(regular: Any) -> None:
    surface, quilt, _ = covered("cylinder")
    quilt = quilt if regular else changed(quilt)
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
        encode_placements(Quilt(quilt.charts, quilt.exemplar_shape, quilt.placements, quilt.cells * 2))
    placed = quilt.placements.copy()
    placed["row"][7] = 10_000
    with pytest.raises(InputError, match="placement 7 does not touch its chart"):
        encode_placements(Quilt(quilt.charts, quilt.exemplar_shape, placed, quilt.cells))


def test_placements_outside_chart_or_exemplar_are_refused() -> None:
    _, quilt, _ = covered("cylinder")
    plan, sources, _ = encode_placements(changed(quilt))
    smaller = tuple(Chart(chart.patch, 20, 20) for chart in quilt.charts)
    with pytest.raises(FormatError, match="does not touch its chart"):
        PlacementDecoder(Fields(plan), smaller, quilt.exemplar_shape).feed_sources(sources)
    with pytest.raises(FormatError, match="outside"):
        PlacementDecoder(Fields(plan), quilt.charts, (20, 20)).feed_sources(sources)


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (b"\2", "byte 0: kind of plan is 2"),
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
        PlacementDecoder(Fields(plan), charts, (32, 32))
    assert message in str(error.value)
    assert str(error.value).startswith("byte ")
