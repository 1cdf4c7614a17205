"""Several maps in one stream: each comes back at its own depth, refining beside the others."""

from typing import Any

import numpy as np
import pytest
from streams import laid, noise, same, stream

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.chunks import ChunkReader, header, pack_chunk
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.codec.stream.writer import encode_stream
from upholster.quilt.painting import paint


def maps_like(exemplar: Any) -> Any:
    shape = exemplar.shape[:2]
    return {
        "normal": noise(*shape, 3, np.uint16, seed=1),
        "roughness": noise(*shape, 1, seed=2),
        "height": noise(*shape, 1, np.float32, seed=3),
    }


def test_every_map_comes_back_at_its_own_depth() -> None:
    surface, quilt, exemplar = laid("cone")
    maps = maps_like(exemplar)
    decoder = read_stream(encode_stream(surface, quilt, exemplar, maps=maps, sample_quality="lossless"))
    assert decoder.roles == ("albedo", *maps)
    assert (decoder.exemplar("albedo") == exemplar).all()
    for role, image in maps.items():
        again = decoder.exemplar(role)
        assert again.dtype == image.dtype
        assert again.shape == image.shape
        if image.dtype == np.float32:
            assert np.abs(again - image).max() <= np.ptp(image) / 65535
        else:
            assert (again == image).all()
        painted = paint(quilt, again)
        for a, b in zip(decoder.texels(role).arrays, painted.arrays, strict=True):
            assert (a == b).all()
    assert same(decoder.quilt(), quilt)


def test_maps_refine_side_by_side() -> None:
    surface, quilt, exemplar = laid("cone")
    maps = maps_like(exemplar)
    data = encode_stream(surface, quilt, exemplar, maps=maps)
    start = next(chunk.offset for chunk in read_stream(data).chunks if chunk.tag == "E")
    decoder = StreamDecoder()
    decoder.feed(data[: start + (len(data) - start) // 2])
    for role, image in maps.items():
        error = np.abs(decoder.exemplar(role).astype(float) - image).mean()
        assert error < 0.5 * np.abs(image - image.mean()).mean(), role


def test_a_budget_is_shared() -> None:
    surface, quilt, exemplar = laid("cone")
    maps = maps_like(exemplar)
    whole = len(encode_stream(surface, quilt, exemplar, maps=maps))
    for most in (whole // 2, whole - 500, whole + 1000):
        data = encode_stream(surface, quilt, exemplar, maps=maps, most_bytes=most)
        assert most - 700 <= len(data) <= most or len(data) == whole
        assert read_stream(data).roles == ("albedo", *maps)


@pytest.mark.parametrize(
    ("maps", "message"),
    [
        ({"Normal": (32, 40, 3)}, "role of a map is 'Normal'"),
        ({"": (32, 40, 3)}, "role of a map is ''"),
        ({"albedo": (32, 40, 3)}, "role 'albedo' comes twice"),
        ({"normal": (32, 39, 3)}, "map 'normal' has shape"),
        ({"normal": (32, 40, 5)}, "map 'normal' has shape"),
        ({"normal": (32, 40, 1)}, "map 'normal' has 1 channels; allowed: 3"),
        ({f"m{n}": (32, 40, 1) for n in range(16)}, "stream has 17 maps; allowed: 16"),
    ],
)
def test_maps_that_do_not_fit_are_refused(maps: Any, message: Any) -> None:
    surface, quilt, exemplar = laid("cone")
    images = {role: np.zeros(shape, np.uint8) for role, shape in maps.items()}
    with pytest.raises(InputError, match=message):
        encode_stream(surface, quilt, exemplar, maps=images)


def test_an_unknown_map_is_named() -> None:
    decoder = read_stream(stream("maps"))
    with pytest.raises(InputError, match="stream has no map 'norml'; did you mean 'normal'"):
        decoder.exemplar("norml")


def rebuilt(data: Any, change: Any) -> Any:
    chunks = change([(chunk.tag, part) for chunk, part in ChunkReader().feed(data)])
    parts = [pack_chunk(*chunk) for chunk in chunks]
    view, total, length = sum(map(len, parts[:3])), sum(map(len, parts)), 0
    while len(found := header(total + length, view + length)) != length:
        length = len(found)
    return found + b"".join(parts)


@pytest.mark.parametrize(
    ("tag", "payload", "message"),
    [
        ("E", b"", "a part of a map is empty"),
        ("E", b"\0abc", "number of a map is 0; allowed: 1 to 2"),
        ("E", b"\3abc", "number of a map is 3; allowed: 1 to 2"),
        ("R", b"\6normal" + b"\0" * 20, "map 'normal' is not allowed, comes twice"),
        ("R", b"\2a!" + b"\0" * 20, "map 'a!' is not allowed"),
        ("R", b"\2ab" + bytes([32, 0, 39, 0, 1, 1, 0, 0, 0, 0, 0]), "map 'ab' is 39×32×1"),
        ("R", b"\2ab" + bytes([32, 0, 40, 0, 1, 1, 0, 0, 0, 0, 0, 9]), "1 bytes too many"),
        ("F", b"\0\0", "chunk 'F' comes twice|chunk 'F' comes after 'Q'"),
    ],
)
def test_malformed_maps_are_refused(tag: Any, payload: Any, message: Any) -> None:
    with pytest.raises(FormatError, match=message) as error:
        read_stream(rebuilt(stream("maps"), lambda chunks: [*chunks, (tag, payload)]))
    assert str(error.value).startswith("byte ")
