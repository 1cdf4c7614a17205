"""Whole streams: written, cut anywhere, read back."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from streams import STREAMS, anything, laid, noise, same, stream

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.chunks import CHUNK_KINDS, ChunkKind, ChunkReader, header, pack_chunk
from upholster.codec.stream.description import describe
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.codec.stream.writer import encode_stream
from upholster.output.levels import texels_psnr
from upholster.quilt.chart import Chart
from upholster.quilt.painting import paint


def test_everything_comes_back() -> None:
    surface, quilt, exemplar = laid()
    decoder = read_stream(stream("plain"))
    assert decoder.complete
    assert decoder.needed == 0
    assert decoder.surface is not None
    assert decoder.surface.source == surface.source
    assert decoder.charts == quilt.charts
    assert same(decoder.quilt(), quilt)
    assert decoder.coefficients_known[1] == exemplar.size
    assert np.mean(np.square(decoder.exemplar().astype(float) - exemplar)) <= 255**2 / 10**4.6
    for a, b in zip(decoder.texels().arrays, paint(quilt, decoder.exemplar()).arrays, strict=True):
        assert (a == b).all()


@pytest.mark.slow(reason="reads streams at many lengths")
@given(
    st.sampled_from([np.uint8, np.uint16, np.float32]),
    st.integers(1, 4),
    st.integers(1, 40),
    st.integers(1, 40),
    st.integers(1, 30),
)
def test_exemplars_of_every_kind_come_back(
    dtype: Any, channels: Any, height: Any, width: Any, side: Any
) -> None:
    surface = laid("sphere")[0]
    exemplar = noise(height, width, channels, dtype)
    charts = tuple(Chart(n, side, side + 1) for n in range(6))
    quilt = anything(np.random.default_rng(side), exemplar.shape[:2], charts, 6)
    data = encode_stream(surface, quilt, exemplar, sample_quality="lossless")
    decoder = read_stream(data)
    if dtype == np.float32:
        step = (float(exemplar.max()) - float(exemplar.min())) / 65535
        assert np.abs(decoder.exemplar() - exemplar).max() <= step
    else:
        assert (decoder.exemplar() == exemplar).all()
    assert decoder.exemplar().dtype == dtype
    assert same(decoder.quilt(), quilt)


@pytest.mark.slow(reason="reads streams at many lengths")
@pytest.mark.parametrize("name", STREAMS)
def test_every_prefix_shows_something_and_says_that_it_is_cut(name: Any) -> None:
    data = stream(name)
    view, start = describe(data).view, describe(data).chunks[0].offset
    assert view <= 120
    decoder, texels, step = StreamDecoder(), -1, max(41, len(data) // 16)
    for n in range(len(data)):
        assert not decoder.complete
        assert (decoder.needed == 0) == (n >= view)
        if start <= n < view:
            assert decoder.needed == view - n
        if n >= view and (n < view + 20 or n % step == 0):
            at_once = read_stream(data[:n], strict=False)
            assert same(at_once.quilt(), decoder.quilt())
            assert (at_once.exemplar() == decoder.exemplar()).all()
            if n % 5 == 0:
                texels = decoder.texels(threads=1).count
                assert texels == sum(chart.height * chart.width for chart in decoder.charts)
        decoder.feed(data[n : n + 1])
    assert decoder.complete
    assert texels > 0


def test_below_the_first_view_it_says_how_many_bytes_are_missing() -> None:
    data = stream("plain")
    with pytest.raises(FormatError, match="byte 20: file is cut; needs 49 more bytes"):
        read_stream(data[:20], strict=False)
    decoder = StreamDecoder()
    decoder.feed(data[:20])
    for attempt in (decoder.quilt, decoder.exemplar, decoder.texels):
        with pytest.raises(InputError, match="stream needs 49 more bytes"):
            attempt()


def test_strict_reading_refuses_every_cut_and_every_addition() -> None:
    data = stream("plain")
    for n in [*range(80), *range(80, len(data), 37)]:
        with pytest.raises(FormatError, match=f"^byte {n}: file is cut; needs .* more bytes"):
            read_stream(data[:n])
    with pytest.raises(FormatError, match=f"byte {len(data)}: 1 bytes after the end"):
        read_stream(data + b"\0")


def rebuilt(data: Any, change: Any) -> Any:
    """The file with its list of (tag, payload) changed, lengths and CRCs right again."""
    reader = ChunkReader()
    chunks = change([(chunk.tag, part) for chunk, part in reader.feed(data)])
    parts = [pack_chunk(*chunk) for chunk in chunks]
    until_x = next(n for n, chunk in enumerate(chunks) if chunk[0] == "X") + 1
    view, total, length = sum(map(len, parts[:until_x])), sum(map(len, parts)), 0
    while len(found := header(total + length, view + length)) != length:
        length = len(found)
    return found + b"".join(parts)


def test_unknown_small_letters_are_skipped_and_capitals_refused() -> None:
    data = stream("plain")
    quilt = read_stream(data).quilt()
    with_extra = rebuilt(data, lambda chunks: [("a", b"?"), *chunks[:4], ("z", b"" * 9), *chunks[4:]])
    assert same(read_stream(with_extra).quilt(), quilt)
    with pytest.raises(FormatError, match="unknown chunk 'Z'"):
        read_stream(rebuilt(data, lambda chunks: [*chunks[:4], ("Z", b"?"), *chunks[4:]]))


def test_a_chunk_that_is_known_and_not_read_is_taken_for_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CHUNK_KINDS, "G", ChunkKind("for a test", ("S",)))
    with pytest.raises(FormatError, match=r"^byte .*: chunk 'G' has no reader here"):
        read_stream(rebuilt(stream("plain"), lambda chunks: [*chunks[:4], ("G", b"?"), *chunks[4:]]))


def test_chunks_out_of_order_or_missing_are_refused() -> None:
    data = stream("plain")
    for change, message in [
        (lambda c: [c[1], c[0], *c[2:]], "chunk 'L' comes before 'S'"),
        (lambda c: [*c[:3], c[0], *c[3:]], "chunk 'S' comes twice"),
        (lambda c: c[:5], "file ends before its placements do"),
        (lambda c: c[:4], "file ends without exemplar or placements"),
        (lambda c: [*c[:5], (c[5][0], c[5][1] + b"\0\0\0\0\0"), *c[6:]], "are unused"),
        (lambda c: [*c[:2], (c[2][0], c[2][1] + b"\0"), *c[3:]], "1 bytes too many in image header"),
    ]:
        with pytest.raises(FormatError, match=message) as error:
            read_stream(rebuilt(data, change))
        assert str(error.value).startswith("byte ")


def test_a_damaged_byte_is_found_and_the_decoder_stays_refused() -> None:
    data = bytearray(stream("plain"))
    data[300] ^= 4
    decoder = StreamDecoder()
    with pytest.raises(FormatError, match=r"^byte \d+: "):
        decoder.feed(bytes(data))
    with pytest.raises(FormatError):
        decoder.feed(b"")


def test_a_budget_is_kept_and_what_does_not_fit_is_refused() -> None:
    surface, quilt, exemplar = laid()
    for most in (1600, 2000, 3000):
        data = encode_stream(surface, quilt, exemplar, most_bytes=most)
        assert most - 32 <= len(data) <= most or len(data) == len(stream("plain"))
        assert same(read_stream(data).quilt(), quilt)
    with pytest.raises(InputError, match=r"most_bytes is 100; allowed: \d+ or more"):
        encode_stream(surface, quilt, exemplar, most_bytes=100)
    with pytest.raises(InputError, match="exemplar has shape"):
        encode_stream(surface, quilt, exemplar[1:])
    with pytest.raises(InputError, match="first_part is -1"):
        encode_stream(surface, quilt, exemplar, first_part=-1)


def test_more_bytes_never_hurt_the_exemplar_much() -> None:
    exemplar = laid()[2].astype(float)
    data, decoder, errors = stream("plain"), StreamDecoder(), []
    for n in range(0, len(data), 60):
        decoder.feed(data[n : n + 60])
        if not decoder.needed:
            errors.append(np.mean((decoder.exemplar() - exemplar) ** 2))
    drops = np.diff(10 * np.log10(1 / np.maximum(errors, 1e-9)))
    assert drops.min() > -0.1
    assert errors[-1] <= 255**2 / 10**4.6 < errors[0]


@pytest.mark.parametrize("name", STREAMS)
def test_description(name: Any) -> None:
    data = stream(name)
    found = describe(data)
    assert (found.total, found.received, found.complete) == (len(data), len(data), True)
    assert [row.tag for row in found.chunks][:4] == ["S", "L", "X", "D"]
    assert sum(row.length for row in found.chunks) + found.chunks[0].offset == len(data)
    assert all(row.received == row.length for row in found.chunks)
    assert [row.length for row in found.readable][:2] == [1000, 2000]
    last = found.readable[-1]
    assert (last.charts, last.placements, last.psnr) == (1.0, 1.0, float("inf"))
    cut = describe(data[:1400])
    assert not cut.complete
    assert cut.chunks[-1].received < cut.chunks[-1].length
    with pytest.raises(FormatError, match="needs 1 more bytes"):
        describe(data[: found.view - 1])


def test_declared_sizes_are_refused_before_anything_is_made() -> None:
    data = stream("plain")
    for tag, payload, message in [
        ("L", b"\x0f\x80\x80\x01", "byte .*: layout has 4294967296 texels"),
        ("X", b"\xff\xff\xff\xff\1\0\0\0\0\0\0", "byte .*: the image header's samples"),
        ("Q", b"\1\3\0\0\2\1" + b"\xff\xff\xff\xff\7" * 16, "byte .*: number of placements is 2147483647"),
    ]:
        with pytest.raises(FormatError, match=message):
            read_stream(rebuilt(data, lambda c, t=tag, p=payload: [(k, p if k == t else v) for k, v in c]))


@pytest.mark.slow(reason="reads streams at many lengths")
@pytest.mark.parametrize("name", ["plain", "two layers", "maps"])
def test_quality_hardly_ever_falls_once_placements_are_there(name: Any) -> None:
    data = stream(name)
    best = read_stream(data).texels(threads=1)
    decoder, found = StreamDecoder(), []
    for length in np.linspace(describe(data).view, len(data), 16).astype(int).tolist():
        decoder.feed(data[decoder.received : length])
        if decoder.charts_known == len(decoder.charts):
            found.append(min(60.0, texels_psnr(decoder.texels(threads=1), best)))
    assert found[-1] == 60
    assert len(found) > 5
    assert (np.diff(found) > -0.5).all(), found


def test_coarse_nodes_then_placements_then_labels_over_all_charts() -> None:
    data = stream("bent")
    tags = "".join(row.tag for row in describe(data).chunks)
    assert tags.startswith("SLXDFNDQtP")
    assert tags.index("P") < tags.rindex("N") < tags.index("M")
    assert tags.rindex("P") < tags.index("M")
    decoder, known = StreamDecoder(), [0]
    for n in range(0, len(data), 20):
        decoder.feed(data[n : n + 20])
        assert decoder.charts_known >= known[-1]
        known.append(decoder.charts_known)
        if decoder.labels_known[0]:
            assert decoder.placements_known[0] == decoder.placements_known[1]
    assert known[-1] == len(decoder.charts)
    assert known.index(1) < known.index(known[-1])


def test_nodes_come_behind_their_grids_and_before_the_end() -> None:
    data = stream("bent")

    def without(tag: Any) -> Any:
        return rebuilt(data, lambda chunks: [chunk for chunk in chunks if chunk[0] != tag])

    with pytest.raises(FormatError, match="chunk 'N' comes before 'F'"):
        read_stream(without("F"))
    with pytest.raises(FormatError, match="file ends before its placements do"):
        read_stream(without("N"))
    cut = read_stream(without("N"), strict=False).quilt()
    assert same(replace(cut, fields=read_stream(data).quilt().fields), read_stream(data).quilt())
    early = rebuilt(data, lambda c: sorted(c, key=lambda one: "SLXFNQtRPMDE".index(one[0])))
    assert same(read_stream(early).quilt(), read_stream(data).quilt())
