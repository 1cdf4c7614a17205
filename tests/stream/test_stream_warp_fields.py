"""Warp fields in a stream: exact, small, from coarse to fine, and refused where they are malformed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from streams import bent, same_fields, woven
from warp_fields import quantised

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.field_chunks import FieldDecoder, pack_fields
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField


def read(code: Any, charts: Any) -> Any:
    decoder = FieldDecoder(ByteReader(code.head), charts)
    decoder.feed(code.nodes)
    assert decoder.complete
    assert not decoder.unread
    return decoder.fields


@given(st.integers(0, 2**32 - 1), st.integers(1, 9))
def test_any_fields_come_back(seed: Any, count: Any) -> None:
    rng = np.random.default_rng(seed)
    charts = [Chart(0, *rng.integers(1, 200, 2).tolist()) for _ in range(count)]
    fields = bent(rng, charts)
    assert same_fields(read(pack_fields(fields, charts), charts), fields)


def test_extreme_nodes_come_back() -> None:
    low = np.array([-192, -192, 0, -56], np.int16)
    high = np.array([192, 192, 255, 56], np.int16)
    nodes = np.where(np.indices((6, 7)).sum(axis=0)[..., None] % 2, low, high).astype(np.int16)
    charts = [Chart(0, 64, 96)]
    fields = (WarpField(nodes, 1),)
    assert same_fields(read(pack_fields(fields, charts), charts), fields)


def test_smooth_fields_take_less_than_half_a_byte_a_node() -> None:
    charts = [Chart(0, 700, 600), Chart(0, 500, 800)]
    fields = []
    for n, chart in enumerate(charts):
        rows, columns = np.mgrid[: chart.height // 32 + 4, : chart.width // 32 + 4] / 20.0
        size = 1.2 + 0.5 * np.sin(rows + n) * np.cos(0.7 * columns)
        angle = 0.4 * np.sin(columns) + 0.3 * rows
        symmetry = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=-1)
        fields.append(quantised((size[..., None] * symmetry).reshape(*rows.shape, 2, 2)))
    nodes = sum(field.nodes[..., 0].size for field in fields)
    assert len(pack_fields(fields, charts).nodes) < 0.5 * nodes


def test_fields_take_little_of_a_quilt() -> None:
    _, quilt, _ = woven("torus", 200_000)
    nodes = sum(field.nodes[..., 0].size for field in quilt.fields)
    assert len(pack_fields(quilt.fields, quilt.charts).nodes) < 1.1 * nodes


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\4\0", "byte 0: kinds of fields is 4; allowed: 0 to 3"),
        (b"\1\x41", "byte 1: margin of the fields is 65; allowed: 0 to 64"),
        (b"\3\0\3\0", "byte 2: kind of a field is 3"),
        (b"\2\0\0\x81\x08\1", "byte 3: rows of nodes is 1025; allowed: 1 to 1024"),
        (b"\1\1\0", "byte 2: 1 bytes too many in head of the fields"),
    ],
)
def test_malformed_fields_are_refused(data: Any, message: Any) -> None:
    charts = [Chart(0, 40, 40), Chart(0, 8, 8)]
    with pytest.raises(FormatError) as error:
        FieldDecoder(ByteReader(data), charts)
    assert message in str(error.value)


def test_nodes_come_from_coarse_to_fine_over_all_charts() -> None:
    charts = [Chart(0, 300, 260), Chart(0, 60, 50), Chart(0, 9, 9), Chart(0, 340, 199)]
    fields = bent(np.random.default_rng(1), charts)
    code = pack_fields(fields, charts)
    decoder = FieldDecoder(ByteReader(code.head), charts)
    stages = [0, 0, 0]  # of how many nodes of step 4, 2 and 1 what is shown is right
    for byte in code.nodes:
        decoder.feed(bytes([byte]))
        right = [0, 0, 0]
        wrong = False
        for stage, step in enumerate((4, 2, 1)):
            for wanted, found in zip(fields, decoder.fields, strict=True):
                same = (wanted.nodes == found.nodes).all(axis=2)[::step, ::step]
                right[stage] += int(same.sum())
                wrong |= not same.all()
            if wrong:
                break
        assert right >= stages  # a step is all right before a finer one is
        stages = right
    assert decoder.complete
    assert same_fields(decoder.fields, fields)


def test_nodes_that_have_not_come_lie_between_those_that_have() -> None:
    at = np.arange(17)[:, None] + np.zeros(13)
    nodes = np.stack([2 * at, -4 * at, (12 * at + 200) % 256, at], axis=-1).astype(np.int16)
    charts, field = [Chart(0, 16 * 32, 12 * 32)], WarpField(nodes, 0)
    code = pack_fields((field,), charts)
    decoder = FieldDecoder(ByteReader(code.head), charts)
    decoder.feed(code.nodes[: code.coarse])
    assert not decoder.complete or code.coarse == len(code.nodes)
    # Of a ramp the guesses are right, up to rounding of halves, and round the circle of angles.
    assert (np.abs(decoder.fields[0].nodes - nodes) <= 1).all()
    first = FieldDecoder(ByteReader(code.head), charts)
    assert (first.fields[0].nodes == 0).all()


def test_a_node_out_of_range_is_refused() -> None:
    charts = [Chart(0, 40, 40)]
    decoder = FieldDecoder(ByteReader(b"\1\1"), charts)
    with pytest.raises(FormatError, match="node is out of range"):
        decoder.feed(bytes(4000))


def test_fields_beyond_the_format_are_refused() -> None:
    with pytest.raises(InputError, match="field 0 has 1025×1 nodes"):
        pack_fields((WarpField(np.ones((1025, 1, 4), np.int16)),), [Chart(0, 9, 9)])
    many = (WarpField(np.ones((1024, 1024, 4), np.int16)),) * 3
    with pytest.raises(InputError, match="fields have 3145728 nodes"):
        pack_fields(many, [Chart(0, 9, 9)] * 3)
