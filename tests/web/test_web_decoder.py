"""The decoder for browsers, written from SPEC.md, decodes what Python decodes, bit for bit."""

import gzip
import hashlib
import json
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from streams import anything, anything_bent, changed, covered, noise, woven

from upholster.codec import decode, encode
from upholster.geometry import Surface, surface_from_spec
from upholster.stream import StreamDecoder, encode_stream
from upholster.synthesis import Chart

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
MOST_GZIPPED = 31_000
"""Bytes of uph.js as it is served, comments and all."""
VECTORS = sorted((ROOT / "tests" / "vectors").glob("*.uph"))


@cache
def _node() -> str:
    node = shutil.which("node")
    if node is None:
        if os.environ.get("CI"):
            pytest.fail("node is not installed, and CI is set")
        pytest.skip("node is not installed")
    return node


def _run(*arguments: Any) -> str:
    done = subprocess.run([_node(), *map(str, arguments)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def _in_browser(folder: Any, files: Any) -> Any:
    """Digests that uph.js finds: `files` are (name, bytes, cuts)."""
    jobs = []
    for n, (name, data, cuts) in enumerate(files):
        path = folder / f"{n}.{name}"
        path.write_bytes(data)
        jobs.append({"path": str(path), "cuts": [int(cut) for cut in cuts]})
    (folder / "jobs.json").write_text(json.dumps(jobs))
    return json.loads(_run(HERE / "decode.mjs", folder / "jobs.json"))


def _digest(*arrays: Any) -> str:
    whole = hashlib.sha256()
    for array in arrays:
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.hexdigest()[:16]


def _in_python(data: Any, cuts: Any) -> Any:
    decoder = StreamDecoder()
    found: list[dict[str, Any]] = []
    for cut in cuts:
        decoder.feed(data[decoder.received : cut])
        if decoder.needed:
            found.append({"needed": decoder.needed})
            continue
        texels = decoder.texels(threads=1).arrays
        maps = [[role, _digest(decoder.exemplar(role))] for role in decoder.roles[1:]]
        if maps:
            texels += decoder.texels(decoder.roles[-1], threads=1).arrays
        shown = {"exemplar": _digest(decoder.exemplar()), "texels": _digest(*texels), "maps": maps}
        found.append({**shown, "known": decoder.charts_known})
    return found


def _cuts(rng: Any, data: Any, count: int) -> Any:
    return [*np.unique(rng.integers(1, len(data), count)).tolist(), len(data)]


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
    """Streams of every kind: surfaces, plans, depths, channels, transforms."""
    surface, quilt, exemplar = covered()
    yield encode_stream(surface, quilt, exemplar)
    for spec in ("cylinder", "sphere:tiling=octants", "torus:spans=6x4", "cone:r1=2", "plane:spans=2x3"):
        surface, quilt, exemplar = covered(spec, chart=40)
        yield encode_stream(surface, quilt, exemplar)
    surface, quilt, _ = covered("vase", chart=32, overlap=6, levels=1)
    yield encode_stream(surface, quilt, noise(dtype=np.uint16, channels=1, seed=1))
    surface, quilt, _ = covered("ellipsoid", chart=33, block=12, overlap=2, levels=1, seams=False)
    yield encode_stream(surface, quilt, noise(channels=4, seed=2), lossless=True)
    surface, quilt, exemplar = covered("sphere", chart=48, seed=9)
    yield encode_stream(Surface(surface.patches, "gestrickt – ñ"), changed(quilt), exemplar, wavelet="haar")
    rng = np.random.default_rng(5)
    plane = surface_from_spec("plane")
    kinds: Any = (
        (np.uint8, 1, {"wavelet": "5/3"}),
        (np.uint8, 2, {}),
        (np.uint16, 3, {"lossless": True}),
        (np.uint16, 4, {"levels": 1}),
        (np.float32, 3, {}),
        (np.float32, 1, {"wavelet": "haar", "levels": 0}),
    )
    for dtype, channels, options in kinds:
        height, width = rng.integers(20, 50, 2)
        exemplar = noise(int(height), int(width), channels, dtype, seed=7)
        count = int(rng.integers(1, 30))
        for make in (anything, anything_bent):
            quilt = make(rng, exemplar.shape[:2], _charts(), count)
            yield encode_stream(plane, quilt, exemplar, **options)
    surface, quilt, exemplar = woven("cone", 9_000)
    yield encode_stream(surface, quilt, exemplar, maps=_maps(exemplar))
    for spec, texels, made in (
        ("sphere", 20_000, {"direction": "0,0,1"}),
        ("cone", 9_000, {"sample_size": 0.5}),
        ("torus", 30_000, {"sample_size": 4.0}),
        ("plane", (90, 70), {}),
    ):
        yield encode_stream(*woven(spec, texels, **made))


def test_streams_cut_anywhere_decode_as_in_python(tmp_path: Any) -> None:
    rng = np.random.default_rng(1)
    files = [("vector.uph", path.read_bytes()) for path in VECTORS]
    files += [("stream.uph", data) for data in _streams()]
    jobs = [(name, data, _cuts(rng, data, 9)) for name, data in files]
    found = _in_browser(tmp_path, jobs)
    for n, (_, data, cuts) in enumerate(jobs):
        assert found[n] == _in_python(data, cuts), f"stream {n}"


def test_vectors_decode_as_frozen(tmp_path: Any) -> None:
    wanted = [json.loads(path.with_suffix(".json").read_text()) for path in VECTORS]
    found = _in_browser(
        tmp_path, [("v.uph", path.read_bytes(), want) for path, want in zip(VECTORS, wanted, strict=True)]
    )
    for got, want in zip(found, wanted, strict=True):
        for one, other in zip(got, want.values(), strict=True):
            keys = ("needed",) if "needed" in other else ("exemplar", "texels")
            assert [one[key] for key in keys] == [other[key] for key in keys]


def test_images_cut_anywhere_decode_as_in_python(tmp_path: Any) -> None:
    rng = np.random.default_rng(2)
    jobs = []
    for shape in ((1, 1, 1), (1, 37, 3), (33, 49, 2), (64, 1, 2), (33, 47, 3), (40, 24, 5), (5, 3, 4)):
        for options in ({}, {"lossless": True}, {"wavelet": "haar"}, {"levels": 0}, {"levels": 3}):
            dtype = (np.uint8, np.uint16, np.float32)[int(rng.integers(3))]
            data = encode(noise(*shape, dtype, seed=int(rng.integers(99))), **options)
            start = _header_length(data)
            if start < len(data):
                jobs.append(("image.ezw", data, [start, *(start + c for c in _cuts(rng, data[start:], 4))]))
    found = _in_browser(tmp_path, jobs)
    for n, (_, data, cuts) in enumerate(jobs):
        assert found[n] == [{"image": _digest(decode(data[:cut]).image)} for cut in cuts], f"image {n}"


def _header_length(data: Any) -> Any:
    """Length of the image header of a file."""
    kind = data[9]
    return 13 + 2 * data[8] + 18 * (kind >> 2 & 3 == 1) + 8 * (kind >> 4 == 2)


def test_damage_is_refused_where_python_refuses_it(tmp_path: Any) -> None:
    rng = np.random.default_rng(3)
    jobs = []
    for path in VECTORS:
        data = path.read_bytes()
        for place in rng.integers(0, len(data), 25):
            damaged = bytearray(data)
            damaged[place] ^= 1 << rng.integers(8)
            jobs.append(("damaged.uph", bytes(damaged), [len(damaged)]))
    found = _in_browser(tmp_path, jobs)
    for n, (_, data, _) in enumerate(jobs):
        try:
            StreamDecoder().feed(data)
            refused = False
        except Exception:
            refused = True
        assert ("error" in found[n][0]) == refused, f"damage {n}"


def test_it_keeps_its_promises_under_node() -> None:
    _run("--test", HERE / "uph.test.mjs")


def test_it_is_small_and_runs_under_a_strict_policy() -> None:
    source = (ROOT / "web" / "uph.js").read_bytes()
    assert len(gzip.compress(source, 9, mtime=0)) <= MOST_GZIPPED
    for word in (b"eval(", b"new Function", b"WebAssembly", b"import(", b"\nimport "):
        assert word not in source
