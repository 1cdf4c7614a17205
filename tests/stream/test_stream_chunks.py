"""The container: header, chunks, CRCs, every length checked."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import FormatError
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.codec.stream.chunks import ChunkReader, header, pack_chunk


def framed(*chunks: Any) -> Any:
    body = b"".join(chunks)
    return header(len(body) + 6, 6) + body


@given(st.integers(0, 2**63 - 1))
def test_varints_come_back(value: Any) -> None:
    data = varint(value)
    assert ByteReader(data).varint("value", 2**63 - 1) == value
    assert len(data) == max(1, -(-value.bit_length() // 7))


@pytest.mark.parametrize("data", [b"", b"\x80", b"\x80\x00", b"\xff" * 9 + b"\1"])
def test_a_varint_that_is_cut_or_not_the_shortest_is_refused(data: Any) -> None:
    with pytest.raises(FormatError, match=r"^byte \d+: value"):
        ByteReader(data).varint("value", 2**63 - 1)


@given(st.lists(st.tuples(st.sampled_from("SDz"), st.binary(max_size=20)), max_size=4), st.data())
def test_chunks_come_back_however_they_are_cut(chunks: Any, data: Any) -> None:
    file = framed(*(pack_chunk(*chunk) for chunk in chunks)) if chunks else header(6, 6)
    reader, place = ChunkReader(), 0
    found: dict[int, bytes] = {}
    while place < len(file):
        step = data.draw(st.integers(1, len(file)))
        for chunk, part in reader.feed(file[place : place + step]):
            found[chunk.offset] = found.get(chunk.offset, b"") + part
        place += step
    assert reader.complete
    assert [(chunk.tag, found[chunk.offset]) for chunk in reader.chunks] == chunks


def test_each_fault_names_its_byte() -> None:
    good = framed(pack_chunk("S", b"abc"), pack_chunk("L", b"de"))
    for data, message in [
        (b"png", "byte 0: file begins with 706e67"),
        (b"uph\4" + good[4:], "byte 3: version is 4; allowed: 3; a newer upholster reads it"),
        (b"uph\2" + good[4:], "byte 3: version is 2; allowed: 3; it was never released: remake it"),
        (good[:9] + b"x" + good[10:], "byte 6: chunk 'S' has CRC"),
        (good + b"!", f"byte {len(good)}: 1 bytes after the end"),
        (header(12, 6) + b"S\x20", "byte 7: length of chunk 'S' is 32; allowed: 0 to 0"),
        (header(12, 6) + b"\xe9\0", "byte 6: tag is"),
        (b"uph\3" + varint(2**30 + 1) + b"\0", "byte 4: length of the file is 1073741825"),
        (b"uph\3" + varint(10) + varint(11), "byte 5: length of the first view is 11"),
    ]:
        with pytest.raises(FormatError) as error:
            list(ChunkReader().feed(data))
        assert str(error.value).startswith(message)


def test_a_cut_chunk_is_read_unverified() -> None:
    file = framed(pack_chunk("D", b"abcdef"))
    reader = ChunkReader()
    ((chunk, part),) = reader.feed(file[:-5])
    assert part == b"abcde"
    assert not chunk.verified
    assert not reader.complete
