"""The decoder agrees with SPEC.md as plain Python reads it, on small quilts and every prefix of them."""

from typing import Any

import numpy as np
import plain_field
import plain_plan
import pytest
from plain_coder import PlainBytes
from streams import anything, anything_bent, at_cells, bent, laid
from warp_fields import quantised

from upholster.base.errors import FormatError
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.field_chunks import FieldDecoder, pack_fields
from upholster.codec.stream.plan import PlanCode, PlanDecoder, encode_plan
from upholster.codec.stream.plan_head import PlanHead
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.placement import bare_placement
from upholster.quilt.warp_field import WarpField

NAMES = "row", "column", "layer", "symmetry", "offset", "source_row", "source_column"


def check(quilt: Quilt, code: PlanCode, placements: bytes, labels: bytes) -> Quilt:
    """Plain Python makes the same of some bytes as the decoder, which is returned."""
    decoder = PlanDecoder(PlanHead.parse(ByteReader(code.head), quilt.charts), quilt.exemplar_shape)
    decoder.feed_placements(placements)
    if labels:
        decoder.feed_labels(labels)
    now, sizes = decoder.quilt(), [(chart.height, chart.width) for chart in quilt.charts]
    reported = plain_plan.decode(code.head, placements, labels, sizes, quilt.exemplar_shape)
    for n, (placed, maps) in enumerate(reported):
        mine = now.on_chart(n)
        if maps is None:
            assert np.array_equal(mine, bare_placement(n, sizes[n], quilt.exemplar_shape))
            assert [one.labels.max() for one in now.labels[n]] == [0, -1][: len(now.labels[n])]
            continue
        for name in NAMES:
            assert [one[name] for one in placed] == mine[name].tolist(), name
        for one, rows in zip(now.labels[n], maps, strict=True):
            assert one.labels.tolist() == rows
    return now


def check_all(rng: Any, quilt: Quilt) -> None:
    code = encode_plan(quilt)
    whole = check(quilt, code, code.placements, code.labels)
    assert np.array_equal(whole.placements, quilt.placements)
    for length in rng.integers(0, len(code.placements), 8):
        check(quilt, code, code.placements[:length], b"")
    for length in rng.integers(0, len(code.labels), 4) if code.labels else ():
        check(quilt, code, code.placements, code.labels[:length])


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("seed", range(20))
def test_any_quilt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 40, 2).tolist()) for _ in range(1 + seed % 4)]
    shape = tuple(rng.integers(4, 70, 2).tolist())
    check_all(rng, (anything_bent if seed % 2 else anything)(rng, shape, layout, 30))


def test_boxes_of_one_size_wait_in_the_order_in_which_they_came() -> None:
    rng, charts = np.random.default_rng(4), (Chart(0, 16, 16), Chart(0, 14, 20), Chart(0, 40, 4)) * 3
    check_all(rng, anything(rng, (32, 40), charts, 200, 2))


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("second", [False, True])
def test_a_quilt_that_was_laid(second: bool) -> None:
    check_all(np.random.default_rng(1), laid("sphere", second=second)[1])


def test_long_runs_of_one_bit() -> None:
    rng, chart = np.random.default_rng(6), Chart(0, 90, 90)
    placed = at_cells(rng, (92, 92), 1, False, 2)
    labels = nearest_labels(placed["row"], placed["column"], chart, 1)
    labels[60, 60] = 1 - labels[60, 60]  # what comes after thousands of the other
    over = np.full((92, 92), 2, np.int32)
    over[60, 60] = -1
    above = at_cells(rng, (92, 92), 1, False, 1)
    above["layer"] = 1
    both = LabelMap(1, labels), LabelMap(1, over)
    quilt = Quilt((chart,), (32, 40), np.concatenate([placed, above]), (both,))
    code = encode_plan(quilt)
    check(quilt, code, code.placements, code.labels)


def outcome(attempt: Any, refusal: type[Exception]) -> Any:
    """What comes of some bytes: None where they are refused."""
    try:
        return attempt()
    except refusal:
        return None


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize(("layers", "counts"), [(1, (5, 3)), (2, (5, 3)), (1, (18, 8))])
def test_any_bytes_are_refused_by_both_or_by_none(layers: int, counts: tuple[int, int]) -> None:
    rng, charts, seen = np.random.default_rng(layers), (Chart(0, 6, 9), Chart(0, 3, 2)), [0, 0]
    head = bytes([layers, 3, 0, 5, *[3, 1, 3, 2][: 2 * layers], *[*counts, 2, 0][: 2 * layers]])
    sizes = [(chart.height, chart.width) for chart in charts]
    for _ in range(400):
        # Small bytes and large ones, so that some tell little and some much.
        data = bytes(np.minimum(255, rng.integers(0, 256, 14) * rng.integers(1, 6)).tolist())
        labels = bytes(rng.integers(0, 256, 6).tolist())
        decoder = PlanDecoder(PlanHead.parse(ByteReader(head), charts), (9, 13))

        def ours(decoder: Any = decoder, data: Any = data, labels: Any = labels) -> Any:
            decoder.feed_placements(data)
            if decoder.known == decoder.total:
                decoder.feed_labels(labels)
            return [[one.labels.tolist() for one in maps] for maps in decoder.quilt().labels]

        def plain(data: Any = data, labels: Any = labels) -> Any:
            return plain_plan.decode(head, data, labels, sizes, (9, 13))

        reported, wanted = outcome(ours, FormatError), outcome(plain, AssertionError)
        assert (reported is None) == (wanted is None)
        seen[reported is None] += 1
        for maps, (_, rows) in zip(reported or (), wanted or (), strict=True):
            assert rows is None or maps == rows
    assert min(seen) > 20


def test_any_nodes_are_refused_by_both_or_by_none() -> None:
    rng, chart, seen = np.random.default_rng(1), Chart(0, 90, 150), [0, 0]
    for _ in range(300):
        data = bytes(np.minimum(255, rng.integers(0, 256, 12) * rng.integers(1, 4)).tolist())
        decoder = FieldDecoder(ByteReader(b"\1\1"), [chart])

        def ours(decoder: Any = decoder, data: Any = data) -> Any:
            decoder.feed(data)
            return decoder.fields[0].nodes.tolist()

        def plain(data: Any = data) -> Any:
            return [[list(node) for node in row] for row in plain_field.nodes(data, [(6, 8)])[0]]

        reported = outcome(ours, FormatError)
        assert reported == outcome(plain, AssertionError)
        seen[reported is None] += 1
    assert min(seen) > 20


def smooth() -> tuple[WarpField, ...]:
    """Fields whose sizes go far."""
    steps = [[[[2.0**i, 0.1], [0, 2.0**-j]] for j in range(5)] for i in range(5)]
    return (quantised(np.array(steps)),) * 2


@pytest.mark.parametrize("seed", range(4))
def test_nodes_of_warp_fields(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    charts = [Chart(0, *rng.integers(1, 330, 2).tolist()) for _ in range(2 if seed == 2 else 7)]
    fields = smooth() if seed == 2 else bent(rng, charts)
    code = pack_fields(fields, charts)
    shapes = shapes_of(code.head, charts)
    warped = [n for n, field in enumerate(fields) if not field.is_identity]
    assert shapes == [fields[n].nodes.shape[:2] for n in warped]
    for length in (len(code.nodes), 0, 1, *rng.integers(0, len(code.nodes), 9)):
        decoder = FieldDecoder(ByteReader(code.head), charts)
        decoder.feed(code.nodes[:length])
        reported = plain_field.nodes(code.nodes[:length], shapes)
        for n, nodes in zip(warped, reported, strict=True):
            np.testing.assert_array_equal(np.array(nodes), decoder.fields[n].nodes)
            if length == len(code.nodes):
                np.testing.assert_array_equal(np.array(nodes), fields[n].nodes)


def shapes_of(head: bytes, charts: Any) -> Any:
    """What a head tells of nodes: rows and columns of each chart that has any."""
    reported, shapes = PlainBytes(head), []
    kinds, margin = reported.byte(), reported.byte()
    each = [reported.byte() if kinds == 3 else kinds for _ in charts]
    for kind, chart in zip(each, charts, strict=True):
        if kind == 1:
            shapes.append((2 * margin - (-chart.height // 32) + 1, 2 * margin - (-chart.width // 32) + 1))
        if kind == 2:
            reported.varint()
            shapes.append((reported.varint(), reported.varint()))
    reported.end()
    return shapes


def test_matrices_between_nodes() -> None:
    rng = np.random.default_rng(5)
    for field in bent(rng, [Chart(0, 90, 70)] * 4)[1:]:
        rows, columns = rng.integers(-1600, 3200, (2, 30))
        again = plain_field.PlainField(field.nodes.tolist(), field.margin)
        wanted = field.between(rows, columns).tolist()
        assert [again.at(int(r), int(c)) for r, c in zip(rows, columns, strict=True)] == wanted
