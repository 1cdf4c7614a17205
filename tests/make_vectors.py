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
from streams import bent, changed, covered, leaning, noise, stream, woven

from upholster.codec import ImageHeader, decode, encode
from upholster.geometry import Surface, surface_from_spec
from upholster.quilt import Chart, Quilt
from upholster.quilt.placement import PLACEMENT, mask_sizes
from upholster.quilt.plans import ChartGrid, GridPlan, PlacementList
from upholster.quilt.plans.grid import BLOCK
from upholster.stream import StreamDecoder, encode_stream
from upholster.stream.byte_reader import varint
from upholster.stream.chunks import ChunkReader, assembled, pack_chunk
from upholster.stream.grid_plan import encode_grid
from upholster.stream.list_plan import encode_list
from upholster.stream.plans import encode_plan

FOLDER = Path(__file__).parent / "vectors"
REFUSED = FOLDER / "refused"


def smallest() -> Any:
    """The worked example of SPEC.md: a plane, one chart of 8 × 8, a grey exemplar of 4 × 4, one placement."""
    placed = np.zeros(1, PLACEMENT)
    placed["row"], placed["column"], placed["height"], placed["width"] = 4, 4, 4, 4
    placed["source_row"], placed["source_column"], placed["first_cell"] = 32, 32, -1
    exemplar = (np.arange(16, dtype=np.uint8) * 10).reshape(4, 4, 1)
    quilt = Quilt((Chart(0, 8, 8),), (4, 4), PlacementList(placed, np.zeros(0, np.uint8)))
    return encode_stream(surface_from_spec("plane"), quilt, exemplar, lossless=True)


def vectors() -> Any:
    """Yield the name and the bytes of each vector."""
    yield "smallest", smallest()
    yield "paper", encode_stream(*covered())
    surface, quilt, exemplar = covered("cylinder")
    yield "list_lossless", encode_stream(surface, changed(quilt), exemplar, lossless=True)
    surface, quilt, _ = covered("sphere:r=2")
    nets = Surface(surface.patches, "nets")
    yield (
        "nets_16_bit",
        encode_stream(nets, quilt, noise(dtype=np.uint16, channels=1), wavelet="haar", levels=3),
    )
    yield "quilt", encode_stream(*woven("torus", sample_size=1.5))
    yield "fields", stream("bent")
    yield "rings", encode_stream(*woven("torus", texels=8_000))
    yield "symmetries", encode_stream(*woven("torus", sample_size=1.5, mirror=True, rotate=True))
    yield "refined", encode_stream(*woven("torus", sample_size=1.5, effort=2))
    rng = np.random.default_rng(7)
    for name, mesh in (("mesh", icosphere(2)), ("mesh_of_any_triangles", soup(3))):
        charts = charts_of(mesh)
        quilt = sheets(rng, charts, (64, 72), 60, bent(rng, charts))
        yield name, encode_stream(mesh, quilt, noise(64, 72))
    yield "centre_matrices", encode_stream(*leaning(spec="cone", texels=5_000))
    surface, quilt, exemplar = woven("torus", texels=8_000)
    height, width = exemplar.shape[:2]
    depth = noise(height, width, 1, np.float32, seed=2)
    yield (
        "material",
        encode_stream(
            surface, quilt, exemplar, maps={"normal": noise(height, width, seed=1), "height": depth}
        ),
    )


def images() -> Any:
    """Yield the name and the bytes of each image."""
    yield "ordinary", encode(noise(48, 56))
    yield "lossless", encode(noise(48, 56, 4), lossless=True)
    yield "haar_16_bit", encode(noise(48, 56, 1, np.uint16), wavelet="haar")
    yield "float", encode(noise(31, 57, 2, np.float32))


def refused() -> Any:
    """Yield the name and the bytes of each stream that no decoder may take, whole but for one number."""
    surface, quilt, exemplar = covered("cylinder")
    chart, empty = Chart(0, 32, 32), np.zeros(0, np.uint8)
    block = np.zeros(1, BLOCK)
    block["row"], block["column"], block["height"], block["width"], block["link"] = 8, 8, 16, 16, -1
    grid = ChartGrid(0, 2, 1, 8, 8, 16, 16, 2**20, 16, 0, 2, 0, 1)  # its second row lies far beyond
    far = Quilt((chart,), (32, 40), GridPlan((grid,), 0, block, empty))
    near = replace(far, plan=replace(far.plan, grids=(replace(grid, step_row=16),)))
    chunks = chunks_of(encode_stream(surface_from_spec("plane"), near, noise()))
    told = encode_plan(far).plan
    yield "grid_beyond", rebuilt([(tag, told if tag == "Q" else data) for tag, data in chunks])
    depth = noise(*exemplar.shape[:2], 1, np.float32)
    chunks = chunks_of(encode_stream(surface, quilt, exemplar, maps={"height": depth}))
    wide = [
        (tag, data[:-8] + struct.pack("<ff", -3e38, 3e38) if tag == "R" else data) for tag, data in chunks
    ]
    yield "range_beyond", rebuilt(wide)
    grey = chunks_of(encode_stream(surface, quilt, exemplar, maps={"normel": noise(*exemplar.shape[:2], 1)}))
    yield "normal_of_one_channel", rebuilt([(tag, data.replace(b"normel", b"normal")) for tag, data in grey])
    for name, count in (("work_of_blocks", 2**13), ("work_of_cuts", 2**10), ("work_of_grids", 2**10)):
        yield name, stacked(name, count)
    head = chunks_of(smallest())[:3]
    yield "cells_beyond", rebuilt([*head, ("Q", bytes([0, 0]) + varint(2**25))])
    yield "work_of_strips", strips_stacked(2**13)
    yield "maps_together", stacked("maps_together", 80)
    yield "chunks_4097", rebuilt([*chunks_of(smallest()), *[("a", b"")] * 4091])


def stacked(name: str, count: int) -> bytes:
    """Blocks as large as their chart, one upon the other: cheap to tell, dear to paint."""
    together = name == "maps_together"  # little work for a texel, for many maps
    side = 16384 if together else 128
    chart = Chart(0, side, side)
    if name == "work_of_grids":
        blocks = np.zeros(count, BLOCK)
        blocks["row"], blocks["column"] = 64 + np.array(np.divmod(np.arange(count), 32))
        blocks["height"] = blocks["width"] = 2 * side
        blocks["link"], blocks["cut"] = -1, 1
        grid = ChartGrid(0, count // 32, 32, 64, 64, 2 * side, 2 * side, 1, 1, 0, 255, 0, count)
        plan = GridPlan((grid,), 16, blocks, np.zeros(0, np.uint8))
        cells = np.ones(int(mask_sizes(plan.in_order(), (chart,)).sum()), np.uint8)
        plan = replace(plan, mask_cells=cells)
        coded = encode_grid(Quilt((chart,), (64, 64), plan), plan).parts
    else:
        placed = np.zeros(count, PLACEMENT)
        placed["row"] = placed["column"] = placed["height"] = placed["width"] = min(side, 4096)
        placed["row"] //= 2
        placed["column"] //= 2
        cells = np.zeros(0, np.uint8)
        placed["first_cell"] = -1
        if name == "work_of_cuts":
            placed["mask"], placed["mask_cell"], placed["feather"], placed["first_cell"] = 2, 255, 16, 0
            cells = np.ones(1, np.uint8)
        coded = encode_list(Quilt((chart,), (64, 64), PlacementList(placed, cells))).parts
    layout = ("L", bytes([15]) + varint(side))
    header = ImageHeader(64, 64, 1, np.dtype(np.uint8), "5/3", 0, -1, means=(128,)).pack()
    maps = [("R", bytes([1, letter]) + header) for letter in b"bcdefghijklmnop" if together]
    return rebuilt([("S", bytes([4])), layout, ("X", header), *maps, *zip("QP", coded[:2], strict=True)])


def strips_stacked(count: int) -> bytes:
    """Strips along one edge, one upon the other."""
    side, block = 256, 256
    strip = bytes([0]) + varint(0) + varint(0)
    plan = bytes([1]) + varint(block) + varint(1) + bytes([0]) + varint(count) + varint(block)
    plan += bytes([128, 16]) + strip * count
    header = ("X", ImageHeader(256, 256, 1, np.dtype(np.uint8), "5/3", 0, -1, means=(128,)).pack())
    return rebuilt([("S", bytes([4])), ("L", bytes([15]) + varint(side)), header, ("Q", plan)])


def chunks_of(data: bytes) -> list[tuple[str, bytes]]:
    """Return the tags and payloads of a whole stream."""
    reader = ChunkReader()
    reader.feed(data)
    return [(c.tag, data[c.payload_offset : c.payload_offset + c.length]) for c in reader.chunks]


def rebuilt(chunks: list[tuple[str, bytes]]) -> bytes:
    """Return a stream of chunks, lengths and checksums right; the first view ends with X."""
    packed = [pack_chunk(*chunk) for chunk in chunks]
    first = 1 + [tag for tag, _ in chunks].index("X")
    return assembled(packed[:first], packed[first:])


def decoded(data: Any) -> Any:
    """What a stream decodes to, at three lengths: hashes of placements, cells, exemplar and texels."""
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
        "cells": _hash(quilt.mask_cells),
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
