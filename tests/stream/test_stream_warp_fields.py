"""Warp fields in a stream: exact, small, from coarse to fine, and refused where they are malformed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from streams import bent, same_fields, woven

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart
from upholster.quilt.warp_field import WarpField
from upholster.stream.byte_reader import ByteReader
from upholster.stream.warp_fields import FieldDecoder, pack_fields


def read(code: Any, charts: Any) -> Any:
    decoder = FieldDecoder(ByteReader(code.head), charts)
    decoder.feed(code.nodes)
    assert decoder.complete
    assert not decoder.unread
    return decoder.fields


@settings(max_examples=30, deadline=None)
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
        fields.append(WarpField.quantised((size[..., None] * symmetry).reshape(*rows.shape, 2, 2)))
    nodes = sum(field.nodes[..., 0].size for field in fields)
    assert len(pack_fields(fields, charts).nodes) < 0.5 * nodes


def test_fields_take_little_of_a_quilt() -> None:
    _, quilt, _ = woven("torus", 200_000)
    nodes = sum(field.nodes[..., 0].size for field in quilt.fields)
    assert len(pack_fields(quilt.fields, quilt.charts).nodes) < 0.9 * nodes


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


def test_what_has_not_come_is_guessed_from_what_has() -> None:
    charts = [Chart(0, 600, 400), Chart(0, 300, 500)]
    fields = []
    for n, chart in enumerate(charts):
        rows, columns = np.mgrid[: chart.height // 32 + 4, : chart.width // 32 + 4] / 20.0
        angle = 0.4 * np.sin(columns + n) + 0.3 * rows
        turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=-1)
        fields.append(WarpField.quantised(turn.reshape(*rows.shape, 2, 2)))
    code = pack_fields(fields, charts)
    decoder, off = FieldDecoder(ByteReader(code.head), charts), []
    for n, byte in enumerate(code.nodes):
        decoder.feed(bytes([byte]))
        now = [field.nodes.astype(int) for field in decoder.fields]
        apart = [np.abs(a - field.nodes) for a, field in zip(now, fields, strict=True)]
        off.append(max(np.minimum(one, 256 - one).max() for one in apart))  # angles the short way round
        if n == code.coarse + 3:  # every fourth node, and what lies between them
            assert all((a[::4, ::4] == f.nodes[::4, ::4]).all() for a, f in zip(now, fields, strict=True))
            assert off[-1] <= 3
    assert decoder.complete
    assert off[-1] == 0
    assert same_fields(decoder.fields, fields)


def test_a_field_in_pieces_is_the_field() -> None:
    charts = [Chart(0, 90, 70), Chart(0, 60, 50), Chart(0, 9, 9), Chart(0, 40, 99)]
    fields = bent(np.random.default_rng(1), charts)
    code = pack_fields(fields, charts)
    decoder = FieldDecoder(ByteReader(code.head), charts)
    for byte in code.nodes:
        decoder.feed(bytes([byte]))
        assert len(decoder.fields) == len(charts)
    assert decoder.complete
    assert same_fields(decoder.fields, fields)


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
