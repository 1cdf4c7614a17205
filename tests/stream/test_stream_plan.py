"""Placements and labels: exact round trips, and never a symbol that the bytes do not determine."""

import tracemalloc
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from streams import CHARTS, anything, anything_bent, at_cells, laid, noise, same, same_labels

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.codec.stream.plan import PlanCode, PlanDecoder, encode_plan
from upholster.codec.stream.plan_head import PlanHead, PlanPart
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, label_shape, nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.painting import paint
from upholster.quilt.placement import PLACEMENT, bare_placement


def decoder_of(quilt: Quilt, head: bytes) -> PlanDecoder:
    return PlanDecoder(PlanHead.parse(ByteReader(head), quilt.charts), quilt.exemplar_shape)


def decoded(quilt: Quilt, code: PlanCode, step: int = 2**30) -> Quilt:
    """What comes back of bytes that come so many at a time."""
    decoder = decoder_of(quilt, code.head)
    for start in range(0, len(code.placements), step):
        decoder.feed_placements(code.placements[start : start + step])
    for start in range(0, len(code.labels), step):
        decoder.feed_labels(code.labels[start : start + step])
    assert decoder.complete
    assert decoder.unread == 0
    return decoder.quilt(quilt.fields)


def with_placed(quilt: Quilt, placed: Any) -> Quilt:
    return Quilt(quilt.charts, quilt.exemplar_shape, placed, quilt.labels, quilt.fields)


@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.integers(1, 5), st.booleans())
def test_any_valid_quilt_comes_back(seed: int, count: int, charts: int, fields: bool) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 90, 2).tolist()) for _ in range(charts)]
    shape = tuple(rng.integers(4, 70, 2).tolist())
    quilt = (anything_bent if fields else anything)(rng, shape, layout, count)
    code = encode_plan(quilt)
    assert same(decoded(quilt, code), quilt)
    assert same(decoded(quilt, code, 1 + seed % 7), quilt)


@pytest.mark.parametrize("second", [False, True])
def test_a_quilt_that_was_laid_takes_few_bytes(second: bool) -> None:
    _, quilt, _ = laid(side=128, second=second)
    code = encode_plan(quilt)
    assert same(decoded(quilt, code), quilt)
    assert len(code.placements) < 4 * len(quilt.placements)
    cells = sum(one.labels.size for maps in quilt.labels for one in maps)
    assert len(code.labels) < 0.25 * cells


def test_labels_that_are_the_nearest_take_next_to_nothing() -> None:
    _, quilt, _ = laid(side=256)
    code = encode_plan(replace(quilt, labels=nearest_of(quilt)))
    assert len(code.labels) < 0.02 * sum(maps[0].labels.size for maps in quilt.labels)


def nearest_of(quilt: Quilt) -> tuple[tuple[LabelMap, ...], ...]:
    """The nearest map of each chart, and nothing in a second layer."""
    found = []
    for n, (chart, (one, *others)) in enumerate(zip(quilt.charts, quilt.labels, strict=True)):
        part = quilt.on_chart(n)
        part = part[part["layer"] == 0]
        labels = nearest_labels(part["row"], part["column"], chart, one.cell, half=one.half)
        above = (replace(other, labels=np.full_like(other.labels, -1)) for other in others)
        found.append((replace(one, labels=labels), *above))
    return tuple(found)


def test_a_tie_goes_to_the_placement_of_the_lowest_number() -> None:
    placed = np.zeros(2, PLACEMENT)
    placed["row"], placed["column"] = 32, [32, 160]  # the middle of column 2 is as far from both
    quilt = Quilt((Chart(0, 8, 12),), (9, 9), placed, ((LabelMap(4, np.ones((4, 5), np.int32)),),))
    decoder = decoder_of(quilt, (code := encode_plan(quilt)).head)
    decoder.feed_placements(code.placements)
    assert decoder.quilt().labels[0][0].labels.tolist() == [[0, 0, 0, 1, 1]] * 4


def keys(placed: Any) -> Any:
    """Placements as what can be looked up."""
    return {str(one) for one in placed}


@pytest.mark.slow(reason="reads streams at many lengths")
@pytest.mark.parametrize(("seed", "bytes_a_step"), [(0, 5), (1, 29), (2, 29), (3, 29)])
def test_every_prefix_shows_the_nearest_placements_there(seed: int, bytes_a_step: int) -> None:
    rng = np.random.default_rng(seed)
    quilt = anything_bent(rng, (32, 40), CHARTS, 25)
    code, exemplar = encode_plan(quilt), noise()
    decoder = decoder_of(quilt, code.head)
    known, with_some, seen = 0, 0, [set() for _ in quilt.charts]
    for start in range(0, len(code.placements), bytes_a_step):
        decoder.feed_placements(code.placements[start : start + bytes_a_step])
        now = decoder.quilt(quilt.fields)
        assert paint(now, exemplar, threads=1).count == quilt.steps
        assert decoder.known >= known
        charts = 0
        for n, (chart, maps) in enumerate(zip(quilt.charts, now.labels, strict=True)):
            mine = now.on_chart(n)
            if np.array_equal(mine, bare_placement(n, (chart.height, chart.width), (32, 40))):
                assert all((one.labels == -k).all() for k, one in enumerate(maps))
                continue
            charts += 1
            assert seen[n] <= keys(mine) <= keys(quilt.on_chart(n))
            seen[n] = keys(mine)
            assert same_labels(maps, nearest_of(now)[n])
        assert charts == decoder.charts_known >= with_some
        known, with_some = decoder.known, charts
    assert known == decoder.total
    assert with_some == len(quilt.charts)
    assert np.array_equal(decoder.quilt().placements, quilt.placements)


@pytest.mark.slow(reason="reads streams at many lengths")
@pytest.mark.parametrize("seed", range(4))
def test_of_labels_a_chart_shows_all_or_the_nearest(seed: int) -> None:
    quilt = anything_bent(np.random.default_rng(seed), (32, 40), CHARTS, 25)
    code = encode_plan(quilt)
    decoder = decoder_of(quilt, code.head)
    decoder.feed_placements(code.placements)
    nearest, shown, cells = nearest_of(quilt), 0, 0
    for byte in code.labels:
        decoder.feed_labels(bytes([byte]))
        maps = decoder.quilt().labels
        whole = [same_labels(a, b) for a, b in zip(maps, quilt.labels, strict=True)]
        first = whole.index(False) if False in whole else len(whole)
        assert all(one or same_labels(a, b) for one, a, b in zip(whole, maps, nearest, strict=True))
        assert first >= shown
        assert decoder.known_cells >= cells
        shown, cells = first, decoder.known_cells
    assert shown == len(quilt.charts)
    assert cells == decoder.total_cells


def test_a_tenth_of_the_placements_covers_every_chart() -> None:
    _, quilt, _ = laid(side=256)
    code = encode_plan(quilt)
    decoder = decoder_of(quilt, code.head)
    decoder.feed_placements(code.placements[: len(code.placements) // 10])
    assert decoder.charts_known == len(quilt.charts)
    now = decoder.quilt()
    counts = np.bincount(now.placements["chart"])
    assert counts.max() <= 2 * counts.min()
    for n, chart in enumerate(quilt.charts):  # none is far from anything
        at = now.on_chart(n)
        rows, columns = np.mgrid[8 : 16 * chart.height : 256, 8 : 16 * chart.width : 256]
        away = np.hypot(at["row"] - rows[..., None], at["column"] - columns[..., None]).min(axis=2)
        assert away.max() < 16 * 256 / 2


def test_large_charts_have_placements_before_small_ones() -> None:
    rng, charts = np.random.default_rng(2), (Chart(0, 8, 8), Chart(0, 120, 130), Chart(0, 30, 30))
    quilt = anything(rng, (32, 40), charts, 90, 1)
    code = encode_plan(quilt)
    decoder, come = decoder_of(quilt, code.head), list[int]()
    for byte in code.placements:
        decoder.feed_placements(bytes([byte]))
        there = [n for n in range(3) if len(decoder.quilt().on_chart(n)) > 1]
        come += [n for n in there if n not in come]
    assert come == [1, 2, 0]


def test_labels_that_can_only_be_one_thing_are_not_reported() -> None:
    placed = np.zeros(2, PLACEMENT)
    placed["chart"], placed["row"], placed["column"] = [0, 1], 32, 32
    maps = (LabelMap(4, np.zeros((4, 4), np.int32)), LabelMap(4, np.full((4, 4), -1, np.int32)))
    quilt = Quilt((Chart(0, 8, 8),) * 2, (9, 9), placed, (maps, maps))
    code = encode_plan(quilt)
    assert code.labels == b""
    assert same(decoded(quilt, code), quilt)
    decoder = decoder_of(quilt, code.head)
    decoder.feed_placements(code.placements)
    with pytest.raises(FormatError, match="labels come where none are due"):
        decoder.feed_labels(b"\0")


def test_labels_wait_for_all_placements() -> None:
    _, quilt, _ = laid()
    code = encode_plan(quilt)
    decoder = decoder_of(quilt, code.head)
    decoder.feed_placements(code.placements[:-4])
    with pytest.raises(FormatError, match="labels come where none are due"):
        decoder.feed_labels(code.labels)


def test_density_and_units_come_back() -> None:
    _, quilt, _ = laid()
    for density in (0.125, 1.0, 64.0):
        again = replace(quilt, density=density)
        assert decoded(again, encode_plan(again)).density == density
    lengths = []
    for unit in (1, 4, 16):
        placed = quilt.placements.copy()
        for name in ("source_row", "source_column"):
            placed[name] = placed[name] // unit * unit
        placed["offset"] = 8 * unit * np.arange(4)
        again = with_placed(quilt, placed)
        code = encode_plan(again)
        assert same(decoded(again, code), again)
        lengths.append(len(code.placements))
    assert lengths[2] < lengths[1] < lengths[0]


def refused(quilt: Quilt, message: str) -> None:
    with pytest.raises(InputError, match=message):
        encode_plan(quilt)


def test_centres_that_a_stream_can_not_tell_are_refused() -> None:
    _, quilt, _ = laid()
    for name in ("row", "column"):
        for moved in (1, 16 * 4 * 30, -16 * 4 * 30):
            placed = quilt.placements.copy()
            placed[name][9] += moved
            refused(with_placed(quilt, placed), "layer 0 of chart 0 has a placement whose centre is none")
    for other in (4, 6):
        placed = quilt.placements.copy()
        for name in ("row", "column"):
            placed[name][5] = placed[name][other]
        refused(with_placed(quilt, placed), "layer 0 of chart 0 has placements that share a cell or")


def test_layers_that_differ_are_refused() -> None:
    _, quilt, _ = laid(second=True)
    placed = quilt.placements[~((quilt.placements["chart"] == 0) & (quilt.placements["layer"] == 1))]
    fewer = (quilt.labels[0][:1], *quilt.labels[1:])
    refused(replace(quilt, labels=fewer, placements=placed), "second layer; allowed in a stream: all")
    half = tuple(replace(one, half=True) for one in quilt.labels[0])
    refused(
        replace(quilt, labels=(half, *quilt.labels[1:])), "shifted by half; allowed in a stream: all or none"
    )


def test_too_many_placements_and_cells_are_refused() -> None:
    side = 768
    rng, cells = np.random.default_rng(0), (side + 2, side + 2)
    placed = at_cells(rng, cells, 1, False, 2**19 + 1)
    quilt = Quilt((Chart(0, side, side),), (9, 9), placed, ((LabelMap(1, np.zeros(cells, np.int32)),),))
    refused(quilt, "method 'pixel' has no stream: 589,824 texels with a source of 7 bits each")
    long = Chart(0, 1, 1000)
    two = tuple(LabelMap(1, np.full((3, 1002), -k, np.int32)) for k in range(2))
    quilt = Quilt((long,), (9, 9), at_cells(rng, (3, 1002), 1, False, 3), (two,))
    refused(quilt, "label maps have 6012 cells; allowed: 4032 in a stream")


TWO = (Chart(0, 8, 8), Chart(0, 16, 16))


@pytest.mark.parametrize(
    ("head", "message"),
    [
        (b"\0", "byte 0: number of layers is 0; allowed: 1 to 2"),
        (b"\3", "byte 0: number of layers is 3"),
        (b"\1\x0a", "byte 1: density is 10; allowed: 0 to 9"),
        (b"\1\3\5", "byte 2: bits of sources is 5; allowed: 0 to 4"),
        (b"\1\3\0\x08", "byte 3: bits of offsets is 8; allowed: 0 to 7"),
        (b"\1\3\0\0\4", "byte 4: flags of a layer is 4; allowed: 0 to 3"),
        (b"\1\3\0\0\2\0", "byte 5: cell of a layer is 0; allowed: 1 to 255"),
        (b"\1\3\0\0\2\x80\2", "byte 5: cell of a layer is 256"),
        (b"\1\3\0\0\2\4\0\1", "byte 6: number of placements is 0; allowed: 1 to 16"),
        (b"\1\3\0\0\2\4\1\x25", "byte 7: number of placements is 37; allowed: 1 to 36"),
        (b"\1\3\0\0\2\4\1\1\0", "byte 8: 1 bytes too many in plan"),
        (b"\1\3\0\0\0\4", "byte 6: cell of a layer takes 1 bytes; 0 are left"),
        (b"\2\3\0\0\2\4\2\4\1\1\0", "byte 11: number of placements takes 1 bytes; 0 are left"),
    ],
)
def test_malformed_heads_are_refused(head: bytes, message: str) -> None:
    with pytest.raises(FormatError) as error:
        PlanHead.parse(ByteReader(head), TWO)
    assert message in str(error.value)


def test_heads_that_ask_for_too_much_are_refused() -> None:
    with pytest.raises(FormatError, match="label maps have 6012 cells; allowed: 4032"):
        PlanHead.parse(ByteReader(b"\2\3\0\0\2\1\2\1"), (Chart(0, 1, 1000),))
    wide = (Chart(0, 4096, 4096),)
    with pytest.raises(FormatError, match="number of placements is 524289; allowed: 1 to 524288"):
        PlanHead.parse(ByteReader(b"\1\3\0\0\2\1" + varint(2**19 + 1)), wide)
    with pytest.raises(FormatError, match="plan has 524289 placements; allowed: 524288"):
        PlanHead.parse(ByteReader(b"\1\3\0\0\2\1" + varint(2**19) + varint(1)), wide * 2)


@pytest.mark.parametrize("seed", range(60))
def test_damaged_bytes_are_refused_or_give_another_quilt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    quilt = anything_bent(rng, (32, 40), CHARTS, 40)
    code = encode_plan(quilt)
    parts = [bytearray(part) for part in (code.placements, code.labels)]
    part = parts[seed % 2] or parts[0]
    for _ in range(3):
        part[int(rng.integers(0, len(part)))] = int(rng.integers(0, 256))
    decoder = decoder_of(quilt, code.head)
    with suppress(FormatError):
        decoder.feed_placements(bytes(parts[0]))
        if decoder.known == decoder.total and parts[1]:
            decoder.feed_labels(bytes(parts[1]))
    assert paint(decoder.quilt(), noise(), threads=1).count == quilt.steps


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_largest_offsets_come_back(sign: int) -> None:
    _, quilt, _ = laid()
    placed = quilt.placements.copy()
    placed["offset"][::2] = sign * 2**18
    placed["offset"][1::4] = (0, 0, 0, -sign)
    again = with_placed(quilt, placed)
    assert same(decoded(again, encode_plan(again)), again)


def a_large_one(count: int, side: int = 4096) -> PlanDecoder:
    """A decoder of so many placements on a square chart."""
    head = b"\1\3\0\0\2\2" + varint(count)
    return PlanDecoder(PlanHead.parse(ByteReader(head), (Chart(0, side, side),)), (64, 64))


def test_bytes_that_code_most_in_fewest_are_refused_or_end() -> None:
    with pytest.raises(FormatError, match="has a number outside what is allowed"):
        a_large_one(2**16).feed_placements(bytes(3000))
    decoder = a_large_one(2**16, 1024)  # of ones every number is 0, which is allowed
    decoder.feed_placements(b"\xff" * 3000)
    assert decoder.known == decoder.total
    decoder.feed_labels(b"\xff" * 3000)
    assert decoder.known_cells > 2**16


def test_memory_grows_with_what_has_come() -> None:
    few = b"\x5a\x13\x77"
    tracemalloc.start()
    decoder = a_large_one(2**19)
    decoder.feed_placements(few)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert decoder.known < 10
    assert peak < 2**20  # 2^19 placements and boxes take 40 MB


def test_a_label_map_is_made_once_however_many_calls_decode_it(monkeypatch: pytest.MonkeyPatch) -> None:
    chart = Chart(0, 256, 256)
    blanks: list[int] = []
    blank = PlanPart.blank
    monkeypatch.setattr(PlanPart, "blank", lambda part: (blanks.append(part.number), blank(part))[1])
    placed = np.zeros(2, PLACEMENT)
    placed["row"], placed["column"] = 8, (8, 24)
    labels = LabelMap(1, np.zeros(label_shape(256, 256, 1), np.int32))
    code = encode_plan(Quilt((chart,), (64, 64), placed, ((labels,),)))
    blanks.clear()
    decoder = PlanDecoder(PlanHead.parse(ByteReader(code.head), (chart,)), (64, 64))
    decoder.feed_placements(code.placements)
    decoder.feed_labels(code.labels)
    assert decoder.complete
    assert len(blanks) <= 2
