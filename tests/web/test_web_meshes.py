"""The JavaScript decoder of meshes gives the same numbers as Python's, to the bit, and refuses the same."""

import hashlib
import json
import subprocess
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from mesh_quilts import charts_of, cube, grid, icosphere, sheets, soup
from streams import noise

from upholster.base.errors import FormatError
from upholster.codec.stream.chunks import ChunkReader, assembled, pack_chunk
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.meshes.triangle_mesh import MeshSurface

SCRIPT = Path(__file__).parent / "mesh_bits.mjs"


def decode(tmp_path, streams):
    paths = []
    for n, data in enumerate(streams):
        paths.append(str(tmp_path / f"{n}.uph"))
        Path(paths[-1]).write_bytes(data)
    jobs = tmp_path / "jobs.json"
    jobs.write_text(json.dumps(paths))
    done = subprocess.run(
        ["node", str(SCRIPT), str(jobs)], capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def stream_of(surface):
    charts = charts_of(surface)
    return encode_stream(surface, sheets(np.random.default_rng(2), charts, (48, 56), 12), noise(48, 56))


def in_python(data):
    decoder = StreamDecoder()
    try:
        decoder.feed(data)
    except FormatError as error:
        return {"error": str(error)}
    surface = decoder.surface
    assert isinstance(surface, MeshSurface)
    mesh = surface.mesh
    arrays = (mesh.triangles, surface.island, mesh.part, mesh.positions, surface.parameters)
    charts = [asdict(chart) for chart in decoder.charts]
    reported = {"name": mesh.name, "metres": mesh.metres, "parts": list(mesh.parts), "charts": charts}
    digests = [hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16] for array in arrays]
    return {**reported, "arrays": digests}


@pytest.mark.slow(reason="runs Node on many streams")
def test_both_decoders_give_the_same_mesh(tmp_path):
    surfaces = [
        cube(3, sides=4),
        icosphere(2),
        icosphere(1, each=True),
        grid(7, 9, holes=((2, 3), (4, 4))),
        grid(9, 14, (True, True)),
        *(soup(seed, vertices=4 + 5 * seed, triangles=6 + 40 * seed) for seed in range(5)),
    ]
    streams = [stream_of(surface) for surface in surfaces]
    assert decode(tmp_path, streams) == [in_python(data) for data in streams]


def with_surface(data, payload):
    """The same stream with another surface chunk."""
    reader = ChunkReader()
    list(reader.feed(data))
    parts = [data[c.offset : c.end] for c in reader.chunks]
    head = sum(c.end <= reader.view for c in reader.chunks)
    parts[0] = pack_chunk("S", payload)
    return assembled(parts[:head], parts[head:])


@pytest.mark.slow(reason="runs Node on many streams")
def test_both_decoders_refuse_the_same_meshes(tmp_path):
    rng = np.random.default_rng(4)
    streams = []
    ball, soups = stream_of(icosphere(1)), [stream_of(soup(n, triangles=30 + 20 * n)) for n in range(7)]
    for n in range(80):
        data = soups[n // 2 % 7] if n % 2 else ball
        reader = ChunkReader()
        list(reader.feed(data))
        first = reader.chunks[0]
        payload = bytearray(data[first.payload_offset : first.payload_offset + first.length])
        for _ in range(int(rng.integers(1, 4))):
            # Counts and steps lie in the first bytes.
            most = len(payload) if rng.random() < 0.5 else min(90, len(payload))
            payload[int(rng.integers(1, most))] = int(rng.integers(0, 256))
        cut = len(payload) if rng.random() < 0.7 else int(rng.integers(2, len(payload)))
        streams.append(with_surface(data, bytes(payload[:cut])))
    ours, theirs = [in_python(data) for data in streams], decode(tmp_path, streams)
    refused = sum("error" in one for one in ours)
    assert 10 < refused < 80
    for one, other in zip(ours, theirs, strict=True):
        assert ("error" in one) == ("error" in other), (one, other)
        if "error" not in one:
            assert one == other


@pytest.mark.parametrize("name", ["mesh", "mesh_of_any_triangles"])
def test_a_frozen_mesh_is_read(name, tmp_path):
    data = (Path(__file__).parents[1] / "vectors" / f"{name}.uph").read_bytes()
    assert decode(tmp_path, [data]) == [in_python(data)]


def meshed(tmp_path, surface):
    path = tmp_path / "mesh.uph"
    path.write_bytes(stream_of(surface))
    command = ["node", str(SCRIPT.with_name("triangles.mjs")), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_cube_is_shown_with_creases(tmp_path):
    # Each side has vertices of its own, with the side's normal: 1/√3 of the corners' direction.
    found = meshed(tmp_path, cube(2))
    assert found["sizes"] == [[9, 8]] * 6
    assert found["plain"] is None
    assert found["least"] == pytest.approx(3**-0.5, abs=1e-3)


def test_a_sphere_is_shown_smooth(tmp_path):
    found = meshed(tmp_path, icosphere(3))
    assert sum(triangles for _, triangles in found["sizes"]) == 1280
    assert found["least"] > 0.999


def test_triangles_without_island_are_shown_too(tmp_path):
    found = meshed(tmp_path, cube(2, sides=4))
    assert found["plain"][1] == 16


@pytest.mark.slow(reason="runs Node on many streams")
@pytest.mark.parametrize("seed", range(2))
def test_any_triangles_are_shown(tmp_path, seed):
    surface = soup(seed)
    sizes = meshed(tmp_path, surface)
    assert sum(triangles for _, triangles in sizes["sizes"]) == (surface.island >= 0).sum()
