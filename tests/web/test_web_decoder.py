"""The decoder for browsers, written from SPEC.md, decodes what Python decodes, bit for bit."""

import json
import struct
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))
sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))

from decoders import HERE, digest, in_node, in_python, rgba, run
from mutants import mutated
from streams import STREAMS, anything, anything_bent, laid, noise, stream

from upholster.base.errors import FormatError
from upholster.codec.ezw import decode, encode
from upholster.codec.stream.chunks import header, pack_chunk
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.codec.stream.surface_chunk import NAMED
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.painting import paint

ROOT = HERE.parents[1]
VECTORS = sorted((ROOT / "tests" / "vectors").glob("*.uph"))


def _cuts(rng: Any, data: Any, count: int) -> Any:
    return [*np.unique(rng.integers(1, len(data), count)).tolist(), len(data)]


@pytest.mark.slow(reason="runs Node on many streams")
def test_another_sample_is_painted_as_in_python(tmp_path: Any) -> None:
    data = (ROOT / "tests" / "vectors" / "quilt.uph").read_bytes()
    decoder = StreamDecoder()
    decoder.feed(data)
    height, width = decoder.quilt().exemplar_shape
    others = [noise(height, width, channels, seed=7) for channels in (1, 3, 4)]
    others.append(noise(height, width + 1, 3, seed=7))
    (tmp_path / "quilt.uph").write_bytes(data)
    job = {"path": str(tmp_path / "quilt.uph"), "cuts": [len(data)]}
    jobs = [
        {
            **job,
            "other": dict(
                zip(("height", "width", "channels"), one.shape, strict=True), data=one.ravel().tolist()
            ),
        }
        for one in others
    ]
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    *found, [refused] = json.loads(run(HERE / "decode.mjs", tmp_path / "jobs.json"))
    for other, [one] in zip(others, found, strict=False):
        texels = paint(decoder.quilt(), other).arrays
        assert one["texels"] == digest(*texels)
        assert one["shown"] == digest(*(rgba(array, True) for array in texels))
    assert refused == {"refused": f"picture has {height} × {width + 1} pixels; allowed: {height} × {width}"}


def _charts() -> Any:
    return [Chart(0, 31, 20), Chart(0, 17, 40, 0.0, 0.5, 0.25, 1.0), Chart(0, 1, 1)]


def _maps(exemplar: Any) -> Any:
    """Maps of other depths and channels, as wide and high as the exemplar."""
    shape = exemplar.shape[:2]
    return {
        "normal": noise(*shape, 3, np.uint16, seed=1),
        "roughness": noise(*shape, 1, np.uint8, seed=2),
        "height": noise(*shape, 1, np.float32, seed=3),
    }


def _streams() -> Any:
    """Streams of every kind: surfaces, layers, grids, fields, depths, channels, transforms."""
    yield from (stream(name) for name in STREAMS)
    for spec in ("cylinder", "sphere:tiling=octants", "torus:spans=6x4", "cone:r1=2", "plane:spans=2x3"):
        yield encode_stream(*laid(spec, side=40))
    surface, quilt, _ = laid("vase", side=32, cell=3)
    yield encode_stream(surface, quilt, noise(dtype=np.uint16, channels=1, seed=1))
    surface, quilt, _ = laid("ellipsoid", side=33, second=True)
    yield encode_stream(surface, quilt, noise(channels=4, seed=2), sample_quality="lossless")
    surface, quilt, exemplar = laid("sphere", side=48, seed=9)
    yield encode_stream(Surface(surface.patches, "gestrickt – ñ"), quilt, exemplar, wavelet="haar")
    rng = np.random.default_rng(5)
    plane = surface_from_spec("plane")
    kinds: Any = (
        (np.uint8, 1, {"wavelet": "5/3"}),
        (np.uint8, 2, {}),
        (np.uint16, 3, {"sample_quality": "lossless"}),
        (np.uint16, 4, {"levels": 1}),
        (np.float32, 3, {}),
        (np.float32, 1, {"wavelet": "haar", "levels": 0}),
    )
    for dtype, channels, options in kinds:
        height, width = rng.integers(20, 50, 2)
        exemplar = noise(int(height), int(width), channels, dtype, seed=7)
        for layers, make in enumerate((anything, anything_bent), 1):
            quilt = make(rng, exemplar.shape[:2], _charts(), int(rng.integers(1, 30)), layers)
            yield encode_stream(plane, quilt, exemplar, **options)
    for make in (anything, anything_bent):  # charts painted in strips
        charts = [Chart(0, 150, 500), Chart(0, 5, 3)]
        yield encode_stream(plane, make(rng, exemplar.shape[:2], charts, 200), exemplar)
    for dtype, make in ((np.uint8, anything), (np.float32, anything_bent), (np.uint16, anything_bent)):
        exemplar = noise(21, 34, 3, np.float32, seed=4)
        maps = {
            **_maps(exemplar),
            "normal": noise(21, 34, 3, dtype, seed=5),
            "emission": noise(21, 34, 4, np.float32, seed=6),
        }
        yield encode_stream(plane, make(rng, (21, 34), _charts(), 9), exemplar, maps=maps)
    for density in (0.125, 0.5, 2.0, 4.0):
        quilt = anything_bent(rng, (21, 34), _charts(), 12, 2)
        yield encode_stream(
            plane, replace(quilt, density=density), noise(21, 34, 3), maps=_maps(noise(21, 34))
        )
    yield from _streams_of_faces(rng)


def _streams_of_faces(rng: Any) -> Any:
    """Control nets in grids, charts that lie across patches and anyhow."""
    for spec in ("vase:spans=6", "sphere:tiling=octants", "torus:spans=6x4", "sphere"):
        surface, quilt, exemplar = laid(spec, side=24)
        yield encode_stream(Surface(surface.faces, "grids"), quilt, exemplar)
    surface = surface_from_spec("plane:spans=3x5")
    for ends in ((0.5, 2.25, 1.0, 4.75), (0.1, 2.9, 0.7, 5.0)):
        charts = [Chart(0, 20, 33, *ends), Chart(0, 16, 9, 0.0, 3.0, 0.0, 5.0)]
        yield encode_stream(surface, anything(rng, (30, 44), charts, 12), noise(30, 44))
    mixed = Surface([*surface_from_spec("sphere").faces[:2], surface.faces[0]], "mixed")
    charts = [
        Chart(2, 20, 20, 1.0, 3.0, 0.0, 5.0),
        Chart(0, 9, 9),
        Chart(1, 8, 8),
        Chart(2, 5, 40, 0.0, 1.0, 0.0, 2.5),
    ]
    yield encode_stream(mixed, anything(rng, (30, 44), charts, 12), noise(30, 44))
    nets = Surface([*mixed.faces[:2]], "patches")
    yield encode_stream(nets, anything(rng, (30, 44), charts[1:3], 5), noise(30, 44))


@pytest.mark.parametrize("count", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_streams_cut_anywhere_decode_as_in_python(tmp_path: Any, count: int) -> None:
    rng = np.random.default_rng(1)
    files = [("vector.uph", path.read_bytes()) for path in VECTORS]
    every = 2 if count == 1 else 1
    files += [("stream.uph", data) for data in list(_streams())[::every]]
    jobs = [(name, data, _cuts(rng, data, count)) for name, data in files]
    found = in_node(tmp_path, jobs)
    for n, (_, data, cuts) in enumerate(jobs):
        assert found[n] == in_python(data, cuts), f"stream {n}"


@pytest.mark.slow(reason="runs Node on many streams")
def test_a_plan_cut_behind_any_byte_decodes_as_in_python(tmp_path: Any) -> None:
    """A placement, a node, a chart's labels: each counts only when all of it has come."""
    charts = (Chart(0, 12, 17), Chart(0, 9, 5))
    quilt = anything_bent(np.random.default_rng(5), (32, 40), charts, 16, 2)
    data = encode_stream(surface_from_spec("plane"), quilt, noise())
    decoder, cuts = StreamDecoder(), []
    while not decoder.placements_complete:
        decoder.feed(data[decoder.received : decoder.received + 1])
        if decoder.plan_known:
            cuts.append(decoder.received)
    assert len(cuts) > 50
    [found] = in_node(tmp_path, [("cut.uph", data, cuts)])
    assert found == in_python(data, cuts)


def test_vectors_decode_as_frozen(tmp_path: Any) -> None:
    wanted = [json.loads(path.with_suffix(".json").read_text()) for path in VECTORS]
    found = in_node(
        tmp_path, [("v.uph", path.read_bytes(), want) for path, want in zip(VECTORS, wanted, strict=True)]
    )
    for got, want in zip(found, wanted, strict=True):
        for one, other in zip(got, want.values(), strict=True):
            keys = ("needed",) if "needed" in other else ("exemplar", "texels")
            assert [one[key] for key in keys] == [other[key] for key in keys]
            maps = {role: texels for role, _, texels, _ in one.get("maps", [])}
            assert maps == {role: other[role] for role in maps}


def test_images_decode_as_frozen(tmp_path: Any) -> None:
    paths = sorted((ROOT / "tests" / "vectors").glob("*.ezw"))
    wanted = [json.loads(path.with_suffix(".json").read_text()) for path in paths]
    found = in_node(
        tmp_path, [("v.ezw", path.read_bytes(), want) for path, want in zip(paths, wanted, strict=True)]
    )
    assert [[one["image"] for one in got] for got in found] == [list(want.values()) for want in wanted]


@pytest.mark.slow(reason="runs Node on many streams")
@pytest.mark.parametrize("wavelet", ["9/7", "haar"])
def test_a_limit_in_coefficients_shows_what_python_shows(tmp_path: Any, wavelet: str) -> None:
    surface, quilt, exemplar = laid("torus", side=48)
    data = encode_stream(surface, quilt, exemplar, wavelet=wavelet)
    jobs, wanted = [], []
    for n, share in enumerate((0.01, 0.07, 0.3)):
        path = tmp_path / f"{n}.uph"
        path.write_bytes(data)
        decoder = StreamDecoder()
        decoder.limit_coefficients(share)
        decoder.feed(data)
        assert decoder.placements_complete
        known, count = decoder.coefficients_known
        assert share * count <= known < share * count + 64
        jobs.append({"path": str(path), "cuts": [len(data)], "share": share})
        wanted.append((digest(decoder.exemplar()), digest(*decoder.texels().arrays)))
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    found = json.loads(run(HERE / "decode.mjs", tmp_path / "jobs.json"))
    assert [(one["exemplar"], one["texels"]) for (one,) in found] == wanted


@pytest.mark.slow(reason="runs Node on many streams")
def test_images_cut_anywhere_decode_as_in_python(tmp_path: Any) -> None:
    rng = np.random.default_rng(2)
    jobs = []
    for shape in ((1, 1, 1), (1, 37, 3), (33, 49, 2), (64, 1, 2), (40, 24, 5), (5, 3, 4)):
        for options in (
            {},
            {"sample_quality": "lossless"},
            {"wavelet": "haar"},
            {"wavelet": "haar", "levels": 1},
            {"levels": 0},
            {"levels": 3},
        ):
            dtype = (np.uint8, np.uint16, np.float32)[int(rng.integers(3))]
            data = encode(noise(*shape, dtype, seed=int(rng.integers(99))), **options)
            start = _header_length(data)
            if start < len(data):
                jobs.append(("image.ezw", data, [start, *(start + c for c in _cuts(rng, data[start:], 2))]))
    i, j = np.mgrid[:128, :128]
    woven = np.stack([(i + j) % 2 * 255, i % 2 * 255, j % 2 * 255], axis=2).astype(np.uint8)
    data = encode(
        woven, sample_quality="lossless", wavelet="haar"
    )  # so regular that its stream ends with zeros
    jobs.append(("image.ezw", data, [100, 500, len(data) - 1, len(data)]))
    found = in_node(tmp_path, jobs)
    for n, (_, data, cuts) in enumerate(jobs):
        assert found[n] == [{"image": digest(decode(data[:cut]).image)} for cut in cuts], f"image {n}"


def _header_length(data: Any) -> Any:
    """Length of the image header of a file."""
    kind = data[9]
    return 13 + 2 * data[8] + 18 * (kind >> 2 & 3 == 1) + 16 * (kind & 3 == 2) + 8 * (kind >> 4 == 2)


def test_frozen_streams_that_no_decoder_may_take_are_refused(tmp_path: Any) -> None:
    files = [path.read_bytes() for path in sorted((ROOT / "tests" / "vectors" / "refused").glob("*.uph"))]
    assert files
    for found in in_node(tmp_path, [("refused.uph", data, [len(data)]) for data in files]):
        assert "error" in found[-1]


@pytest.mark.parametrize("count", [2, pytest.param(12, marks=pytest.mark.slow)])
def test_damaged_streams_are_read_or_refused_as_in_python(tmp_path: Any, count: int) -> None:
    rng = np.random.default_rng(3)
    jobs = []
    for data in (*(stream(name) for name in STREAMS), *(path.read_bytes() for path in VECTORS)):
        for _ in range(count):
            damaged = mutated(rng, data)
            if damaged:
                jobs.append(("damaged.uph", damaged, _cuts(rng, damaged, 2) if len(damaged) > 1 else [1]))
    found = in_node(tmp_path, jobs)
    refused = 0
    for n, (_, data, cuts) in enumerate(jobs):
        wanted = in_python(data, cuts)
        assert _without_words(found[n]) == wanted, f"damage {n}"
        refused += "error" in wanted[-1]
    assert 0.1 * len(jobs) < refused < 0.9 * len(jobs)


@pytest.mark.slow(reason="runs Node on many streams")
def test_surfaces_by_name_are_read_or_refused_as_in_python(tmp_path: Any) -> None:
    rng = np.random.default_rng(4)
    jobs = []
    for n in range(400):
        kind = 1 + int(rng.integers(len(NAMED)))
        parameters = NAMED[kind].parameters
        payload = bytes([kind, (1 << len(parameters)) - 1])
        for parameter in parameters:
            if isinstance(parameter.default, float):
                values = (
                    -1.0,
                    0.0,
                    -0.0,
                    1e-10,
                    1e-9,
                    0.5,
                    1.0,
                    1.0,
                    2.0,
                    1e9,
                    2e9,
                    float("inf"),
                    float("nan"),
                )
                payload += struct.pack("<d", parameter.default if n % 3 else rng.choice(values))
            elif isinstance(parameter.default, str):
                payload += bytes([int(rng.integers(3))])
            else:
                count = len(parameter.default) if isinstance(parameter.default, tuple) else 1
                payload += bytes(rng.choice([0, 1, 2, 3, 4, 5, 6, 8, 100], count).astype(np.uint8).tolist())
        data = header(10_000, 9_000) + pack_chunk("S", payload)
        jobs.append(("named.uph", data, [12, len(data)]))
    found, refused = in_node(tmp_path, jobs), 0
    for n, (_, data, cuts) in enumerate(jobs):
        wanted = in_python(data, cuts)
        assert _without_words(found[n]) == wanted, f"surface {n}: {data[9:]!r}"
        refused += "error" in wanted[-1]
    assert 40 < refused < 360


@pytest.mark.parametrize("name", ["bent", "maps"])
def test_one_damage_has_one_address(tmp_path: Any, name: str) -> None:
    """Both decoders name the damaged chunk's first byte, in whatever pieces a stream comes."""
    data, rng = stream(name), np.random.default_rng(5)
    damages = [(b"upx" + data[3:], 0), (data[:3] + b"\2" + data[4:], 3), (data + b"!", len(data))]
    for chunk in {chunk.tag: chunk for chunk in read_stream(data).chunks}.values():
        last = chunk.end - 5
        for place in {chunk.offset, chunk.payload_offset, (chunk.payload_offset + last) // 2, last, last + 4}:
            damages += [(data[:place] + bytes([data[place] ^ 2]) + data[place + 1 :], chunk.offset)]
        damages += [(data[: chunk.offset] + data[chunk.offset + 1 :], chunk.offset)]  # a byte is lost
    jobs = []
    for n, (damaged, _) in enumerate(damages):
        path = tmp_path / f"{n}.uph"
        path.write_bytes(damaged)
        pieces = [len(damaged)], _cuts(rng, damaged, 9)
        jobs += [{"path": str(path), "cuts": cuts, "shown": False} for cuts in pieces]
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    found = json.loads(run(HERE / "decode.mjs", tmp_path / "jobs.json"))
    for n, (job, [one]) in enumerate(zip(jobs, found, strict=True)):
        damaged, place = damages[n // 2]
        assert one["error"] == place, one
        with pytest.raises(FormatError, match=f"^byte {place}: "):
            _feed_python(damaged, job["cuts"])


def _feed_python(data: bytes, cuts: list[int]) -> None:
    decoder = StreamDecoder()
    for cut in cuts:
        decoder.feed(data[decoder.received : cut])


def _without_words(found: Any) -> Any:
    return [{"error": one["error"]} if "error" in one else one for one in found]


@pytest.mark.slow(reason="runs Node on many streams")
def test_it_keeps_its_promises_under_node() -> None:
    run("--test", HERE / "uph.test.mjs")


def test_it_is_small_and_runs_under_a_strict_policy() -> None:
    web = ROOT / "web"
    modules = [web / "uph.js", *sorted((web / "uph").rglob("*.js"))]
    source = b"".join(path.read_bytes() for path in modules)
    for word in (b"eval(", b"new Function", b"WebAssembly", b"import("):
        assert word not in source


def test_large_images_of_many_channels_are_read(tmp_path: Any) -> None:
    """As many places as the format allows, however they are spread over channels."""
    heads = [
        struct.pack("<4sHHBBBBB", b"EZW1", height, width, channels, 1, 5, 0, 0) + bytes(2 * channels)
        for height, width, channels in ((1024, 1024, 3), (1024, 1024, 1), (890, 890, 4), (1100, 1100, 3))
    ]
    found = in_node(tmp_path, [("large.ezw", head, [len(head)]) for head in heads])
    assert ["image" in one[-1] for one in found] == [True, True, True, False]
