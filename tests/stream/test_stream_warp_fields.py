"""warp fields in a stream: exact, small, and refused where they are malformed; the scale of a first view."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from streams import bent, noise, same_fields, woven

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart, paint
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField
from upholster.stream.byte_reader import ByteReader
from upholster.stream.first_view import assemble, check_tiles, scale_of
from upholster.stream.warp_fields import pack_fields, parse_fields


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9))
def test_any_fields_come_back(seed: Any, count: Any) -> None:
    rng = np.random.default_rng(seed)
    charts = [Chart(0, *rng.integers(1, 200, 2).tolist()) for _ in range(count)]
    fields = bent(rng, charts)
    assert same_fields(parse_fields(ByteReader(pack_fields(fields, charts)), charts), fields)


def test_extreme_nodes_come_back() -> None:
    low = np.array([-192, -192, 0, -56], np.int16)
    high = np.array([192, 192, 255, 56], np.int16)
    nodes = np.where(np.indices((6, 7)).sum(axis=0)[..., None] % 2, low, high).astype(np.int16)
    charts = [Chart(0, 64, 96)]
    fields = (WarpField(nodes, 1),)
    assert same_fields(parse_fields(ByteReader(pack_fields(fields, charts)), charts), fields)


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
    assert len(pack_fields(fields, charts)) < 0.5 * nodes


def test_fields_take_little_of_a_quilt() -> None:
    _, quilt, _ = woven("torus", 200_000)
    nodes = sum(field.nodes[..., 0].size for field in quilt.fields)
    assert len(pack_fields(quilt.fields, quilt.charts)) < 0.8 * nodes


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\4\0", "byte 0: kinds of fields is 4; allowed: 0 to 3"),
        (b"\1\x41", "byte 1: margin of the fields is 65; allowed: 0 to 64"),
        (b"\3\0\3\0", "byte 2: kind of a field is 3"),
        (b"\2\0\0\x81\x08\1", "byte 3: rows of nodes is 1025; allowed: 1 to 1024"),
        (b"\1\1", "byte 2: nodes of a field are missing"),
        (b"\0\0!!!!!", "byte 2: 1 bytes too many in the fields"),
        (b"\2\0" + b"\0\x80\x08\x80\x08" * 2, "nodes of a field are missing"),
    ],
)
def test_malformed_fields_are_refused(data: Any, message: Any) -> None:
    charts = [Chart(0, 40, 40), Chart(0, 8, 8)]
    with pytest.raises(FormatError) as error:
        parse_fields(ByteReader(data), charts)
    assert message in str(error.value)


def test_every_cut_of_the_nodes_is_refused() -> None:
    charts = [Chart(0, 90, 70)] * 4
    data = pack_fields(bent(np.random.default_rng(1), charts), charts)
    for n in range(len(data)):
        with pytest.raises(FormatError, match=r"^byte "):
            parse_fields(ByteReader(data[:n]), charts)


def test_a_first_view_shows_the_exemplar_at_its_scale() -> None:
    # At half a pixel per texel, mirrored repeats are twice as large and show the same.
    exemplar, chart = noise(16, 20), Chart(0, 70, 90)
    nothing = np.zeros(0, PLACEMENT), np.zeros(0, np.uint8)
    half = paint(assemble((chart,), (16, 20), *nothing, (), scale=-32), exemplar).arrays[0]
    double = np.concatenate([exemplar, exemplar[::-1]] * 2, axis=0)
    double = np.concatenate([double, double[:, ::-1]] * 2, axis=1).astype(int)
    # Texels 2i + ½ and 2i + 3/2 lie a quarter pixel on either side of a pixel's centre.
    seen = (half[:62:2, :78:2].astype(int) + half[1:63:2, 1:79:2]) / 2
    wanted = double[:31, :39]
    assert np.abs(seen - wanted).mean() < 0.2 * np.abs(wanted - wanted.mean()).mean()


def test_the_scale_is_the_usual_one_that_fits() -> None:
    field = WarpField(np.full((3, 3, 4), [20, 24, 7, 0], np.int16))
    assert scale_of((field,), [Chart(0, 9, 9)], (64, 64)) == 22
    assert scale_of((WarpField.identity(),), [Chart(0, 9, 9)], (64, 64)) == 0
    even = WarpField(np.full((3, 3, 4), [20, 20, 7, 0], np.int16))
    assert scale_of((even, WarpField.identity()), [Chart(0, 9, 9)] * 2, (64, 64)) == 20
    wide = WarpField(np.full((3, 3, 4), [-96, -96, 0, 0], np.int16))
    fits = scale_of((wide,), [Chart(0, 9, 9)], (1024, 1024))
    assert -34 <= fits <= -32
    check_tiles([Chart(0, 9, 9)], (1024, 1024), fits)
    with pytest.raises(InputError, match="scale is -96"):
        check_tiles([Chart(0, 9, 9)], (1024, 1024), -96)


def test_fields_beyond_the_format_are_refused() -> None:
    with pytest.raises(InputError, match="field 0 has 1025×1 nodes"):
        pack_fields((WarpField(np.ones((1025, 1, 4), np.int16)),), [Chart(0, 9, 9)])
    many = (WarpField(np.ones((1024, 1024, 4), np.int16)),) * 3
    with pytest.raises(InputError, match="fields have 3145728 nodes"):
        pack_fields(many, [Chart(0, 9, 9)] * 3)
