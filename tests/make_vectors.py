"""Makes the frozen vectors of `tests/vectors`: streams and what they decode to. Old ones are never made anew.

``python tests/make_vectors.py`` adds the vectors that are missing; to change one, its file must be deleted
first, which is a change of the format.
"""

import hashlib
import json
import struct
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "stream"))

from mesh_quilts import charts_of, icosphere, sheets, soup
from streams import CHARTS, anything, anything_bent, bent, laid, noise, stream

from upholster.codec.ezw import decode, encode
from upholster.codec.stream.base_maker import made_base
from upholster.codec.stream.byte_reader import varint
from upholster.codec.stream.chunks import ChunkReader, assembled, pack_chunk
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.patches.surface import Surface
from upholster.image.files.read import read_image
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT

FOLDER = Path(__file__).parent / "vectors"
REFUSED = FOLDER / "refused"


def smallest() -> Any:
    """The worked example of SPEC.md: a plane, one chart of 8 × 8 steps, a grey exemplar of 4 × 4 pixels."""
    placed = np.zeros(2, PLACEMENT)
    placed["row"], placed["column"] = [32, 96], [32, 96]
    placed["source_row"], placed["source_column"] = [16, 48], [16, 32]
    placed["symmetry"][1] = 1
    labels = np.array([[0, 0, 1, 1], [0, 0, 1, 1], [0, 1, 1, 1], [0, 1, 1, 1]], np.int32)
    exemplar = (np.arange(16, dtype=np.uint8) * 10).reshape(4, 4, 1)
    quilt = Quilt((Chart(0, 8, 8),), (4, 4), placed, ((LabelMap(4, labels),),))
    return encode_stream(surface_from_spec("plane"), quilt, exemplar, sample_quality="lossless")


def vectors() -> Any:
    """Yield the name and the bytes of each vector."""
    yield "smallest", smallest()
    yield "quilt", encode_stream(*laid())
    surface, quilt, exemplar = laid("sphere:r=2", side=40, second=True)
    yield "two_layers", encode_stream(surface, quilt, exemplar, sample_quality="lossless")
    nets = Surface(surface.patches, "nets")
    grey = noise(dtype=np.uint16, channels=1)
    yield "nets_16_bit", encode_stream(nets, quilt, grey, wavelet="haar", levels=3)
    yield "fields", stream("bent")
    yield "half_cells", stream("half cells")
    rng = np.random.default_rng(11)
    plane = surface_from_spec("plane")
    yield "symmetries", encode_stream(plane, anything(rng, (32, 40), CHARTS, 60, 2), noise())
    quilt = anything(rng, (32, 40), CHARTS, 60, 1)
    for density in (0.25, 2.0):
        yield f"density_{density:g}", encode_stream(plane, replace(quilt, density=density), noise())
    depth = noise(dtype=np.float32, channels=2)
    yield "float_samples", encode_stream(plane, anything_bent(rng, (32, 40), CHARTS, 30, 2), depth)
    rng = np.random.default_rng(7)
    for name, mesh in (("mesh", icosphere(2)), ("mesh_of_any_triangles", soup(3))):
        charts = charts_of(mesh)
        quilt = sheets(rng, charts, (64, 72), 60, bent(rng, charts))
        yield name, encode_stream(mesh, quilt, noise(64, 72))
    quilt = anything_bent(np.random.default_rng(8), (32, 40), CHARTS, 40, 1)
    maps = {"normal": noise(seed=1), "height": noise(channels=1, dtype=np.float32, seed=2)}
    yield "material", encode_stream(plane, quilt, noise(), maps=maps)

    yield "base", with_base()
    toned = replace(laid(cell=2)[1], has_tones=True)
    surface = surface_from_spec("cyclide")
    yield "tones", encode_stream(surface, toned, noise(), maps=maps)
    yield "tones_16_bit", encode_stream(surface, toned, noise(dtype=np.uint16))


def with_base() -> bytes:
    """A stream of a mesh that has two bases and the exemplar before its surface."""
    mesh = icosphere(2)
    rng, charts = np.random.default_rng(7), charts_of(mesh)
    quilt = sheets(rng, charts, (64, 72), 60, bent(rng, charts))
    surface, layout, header, *rest = chunks_of(encode_stream(mesh, quilt, noise(64, 72)))
    sample = b"".join(data for tag, data in rest if tag == "D")
    parts = [("D", sample[:3500]), ("D", sample[3500:])]
    base, finer = (("B", made_base(mesh, quilt, *size)) for size in ((300, 8), (500, 9)))
    others = [chunk for chunk in rest if chunk[0] != "D"]
    return rebuilt([base, header, parts[0], finer, parts[1], surface, layout, *others])


def images() -> Any:
    """Yield the name and the bytes of each image."""
    yield "ordinary", encode(noise(48, 56))
    yield "lossless", encode(noise(48, 56, 4), sample_quality="lossless")
    yield "haar_16_bit", encode(noise(48, 56, 1, np.uint16), wavelet="haar")
    yield "float", encode(noise(31, 57, 2, np.float32))
    yield "colour8", encode(read_image(FOLDER / "colour8.png"), sample_quality="lossless")


def refused() -> Any:
    """Yield the name and the bytes of each stream that no decoder may take, whole but for one number."""
    surface, quilt, exemplar = laid("cylinder")
    depth = noise(*exemplar.shape[:2], 1, np.float32)
    chunks = chunks_of(encode_stream(surface, quilt, exemplar, maps={"height": depth}))
    wide = [
        (tag, data[:-8] + struct.pack("<ff", -3e38, 3e38) if tag == "R" else data) for tag, data in chunks
    ]
    yield "range_beyond", rebuilt(wide)
    grey = chunks_of(encode_stream(surface, quilt, exemplar, maps={"normel": noise(*exemplar.shape[:2], 1)}))
    yield "normal_of_one_channel", rebuilt([(tag, data.replace(b"normel", b"normal")) for tag, data in grey])
    head = chunks_of(smallest())[:3]
    one = bytes([1, 3, 0, 0, 2])
    yield "placements_beyond", rebuilt([*head, ("Q", one + bytes([1]) + varint(101))])
    long = ("L", bytes([7]) + varint(1) + varint(1000))
    two_layers = bytes([2, 3, 0, 0, 2, 1, 2, 1, 1, 0])
    yield "cells_beyond", rebuilt([head[0], long, head[2], ("Q", two_layers)])
    large = ("L", bytes([15]) + varint(16384))
    yield "density_beyond", rebuilt([head[0], large, head[2], ("Q", bytes([1, 4, 0, 0, 2, 64, 1]))])
    base, *rest = chunks_of(with_base())
    yield "base_of_too_many_pixels", rebuilt([("B", _with_pixel(base[1], 1e-30)), *rest])
    yield "base_after_a_surface", rebuilt([chunks_of(smallest())[0], base, *rest])
    tones, (*early, placements, labels) = ("t", b""), chunks_of(smallest())
    yield "tones_after_placements", rebuilt([*early, placements, tones, labels])
    layered = chunks_of(encode_stream(*laid("sphere:r=2", side=40, second=True)))
    place = 1 + [tag for tag, _ in layered].index("Q")
    yield "tones_of_two_layers", rebuilt([*layered[:place], tones, *layered[place:]])
    yield "bases_5", rebuilt([base, base, base, base, *rest])
    yield "chunks_4097", rebuilt([*chunks_of(smallest()), *[("a", b"")] * 4091])


def _with_pixel(base: bytes, pixel: float) -> bytes:
    # The pixel follows two varints, the bits, and four floats.
    place = next(n for n in range(1, 9) if base[n] < 128)
    place = next(n for n in range(place + 1, 9) if base[n] < 128) + 2 + 16
    return base[:place] + struct.pack("<f", pixel) + base[place + 4 :]


def chunks_of(data: bytes) -> list[tuple[str, bytes]]:
    """Return the tags and payloads of a whole stream."""
    reader = ChunkReader()
    list(reader.feed(data))
    return [(c.tag, data[c.payload_offset : c.payload_offset + c.length]) for c in reader.chunks]


def rebuilt(chunks: list[tuple[str, bytes]]) -> bytes:
    """Return a stream of chunks, lengths and checksums right; the first view ends with X."""
    packed = [pack_chunk(*chunk) for chunk in chunks]
    first = 1 + [tag for tag, _ in chunks].index("X")
    return assembled(packed[:first], packed[first:])


def decoded(data: Any) -> Any:
    """What a stream decodes to, at three lengths: hashes of placements, labels, exemplar and texels."""
    found = {}
    decoder = StreamDecoder()
    decoder.feed(data[: len(data) // 3])
    for part in (data[len(data) // 3 : 2 * len(data) // 3], data[2 * len(data) // 3 :]):
        found[str(decoder.received)] = hashes(decoder)
        decoder.feed(part)
    found[str(decoder.received)] = hashes(decoder)
    return found


def hashes(decoder: Any) -> Any:
    if decoder.needed:
        return {"needed": decoder.needed}
    quilt = decoder.quilt()
    placed = quilt.placements
    columns = [placed[name].astype("<i4") for name in placed.dtype.names]
    columns = [column[:, None] if column.ndim == 1 else column for column in columns]
    return {
        "placements": _hash(np.concatenate(columns, axis=1)),
        "labels": _hash(np.concatenate([one.labels.reshape(-1) for maps in quilt.labels for one in maps])),
        "exemplar": _hash(decoder.exemplar()),
        "texels": _hash_of_texels(decoder, "albedo"),
        **{role: _hash_of_texels(decoder, role) for role in decoder.roles[1:]},
    }


def _hash_of_texels(decoder: Any, role: str) -> Any:
    arrays = decoder.texels(role, threads=1).arrays
    return _hash(np.concatenate([array.reshape(-1) for array in arrays]))


def images_at(data: bytes) -> Any:
    """What an image decodes to, at three lengths."""
    lengths = [len(data) // 3, 2 * len(data) // 3, len(data)]
    return {str(length): _hash(decode(data[:length]).image) for length in lengths}


def _hash(array: Any) -> Any:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, data in vectors():
        path = FOLDER / f"{name}.uph"
        if not path.exists():
            path.write_bytes(data)
            path.with_suffix(".json").write_text(json.dumps(decoded(data), indent=1) + "\n")
            print(f"{path.name}: {len(data)} bytes")
    for name, data in images():
        path = FOLDER / f"{name}.ezw"
        if not path.exists():
            path.write_bytes(data)
            path.with_suffix(".json").write_text(json.dumps(images_at(data), indent=1) + "\n")
            print(f"{path.name}: {len(data)} bytes")
    REFUSED.mkdir(exist_ok=True)
    for name, data in refused():
        path = REFUSED / f"{name}.uph"
        if not path.exists():
            path.write_bytes(data)
            print(f"refused {path.name}: {len(data)} bytes")
