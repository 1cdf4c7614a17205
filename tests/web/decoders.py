"""What streams decode to, in Python and by uph.js in node, as digests to compare."""

import hashlib
import json
import os
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import FormatError
from upholster.codec.stream.reader import StreamDecoder

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
MOST_TEXELS = 2**21


@cache
def node() -> str:
    node = shutil.which("node")
    if node is None:
        if os.environ.get("CI"):
            pytest.fail("node is not installed, and CI is set")
        pytest.skip("node is not installed")
    return node


def run(*arguments: Any) -> str:
    done = subprocess.run([node(), *map(str, arguments)], capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def in_node(folder: Any, files: Any) -> Any:
    """Digests that uph.js finds: `files` are (name, bytes, cuts)."""
    jobs = []
    for n, (name, data, cuts) in enumerate(files):
        path = folder / f"{n}.{name}"
        path.write_bytes(data)
        jobs.append({"path": str(path), "cuts": [int(cut) for cut in cuts]})
    (folder / "jobs.json").write_text(json.dumps(jobs))
    return json.loads(run(HERE / "decode.mjs", folder / "jobs.json"))


def digest(*arrays: Any) -> str:
    whole = hashlib.sha256()
    for array in arrays:
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.hexdigest()[:16]


def in_python(data: Any, cuts: Any) -> Any:
    decoder = StreamDecoder()
    found: list[dict[str, Any]] = []
    for cut in cuts:
        try:
            decoder.feed(data[decoder.received : cut])
        except FormatError as error:
            return [*found, {"error": int(str(error).split()[1].rstrip(":"))}]
        if decoder.needed:
            found.append({"needed": decoder.needed})
            continue
        if sum(chart.height * chart.width for chart in decoder.charts) > MOST_TEXELS:
            found.append({"large": True, "known": decoder.charts_known})
            continue
        albedo, *others = ((role, *_painted(decoder, role)) for role in decoder.roles)
        _, exemplar, texels, shown = albedo
        known = decoder.charts_known
        maps = [list(other) for other in others]
        found.append({"exemplar": exemplar, "texels": texels, "shown": shown, "known": known, "maps": maps})
    return found


def _painted(decoder: Any, role: Any) -> Any:
    """Digests of a map, of its texels, and of these as they are shown."""
    texels = decoder.texels(role, threads=1).arrays
    shown = (rgba(array, role in ("albedo", "emission")) for array in texels)
    return digest(decoder.exemplar(role)), digest(*texels), digest(*shown)


def rgba(texels: Any, colored: bool) -> Any:
    """RGBA of 8 bits, as pictures are written."""
    channels = texels.shape[2]
    if texels.dtype == np.uint16:
        texels = (texels.astype(np.uint32) + 128) // 257
    elif texels.dtype == np.float32:
        plain = np.clip(texels.astype(np.float64), 0, 1) * 255 + 0.5
        if colored:
            alpha = channels - 1 if channels % 2 == 0 else channels
            plain[:, :, :alpha] = _srgb_codes()[
                (np.clip(texels[:, :, :alpha], 0, 1) * 65535 + 0.5).astype(np.uint16)
            ]
        texels = plain
    out = np.full((*texels.shape[:2], 4), 255, np.uint8)
    out[:, :, :3] = texels[:, :, :3] if channels > 2 else texels[:, :, :1]
    if channels % 2 == 0:
        out[:, :, 3] = texels[:, :, -1]
    return out


@cache
def _srgb_codes() -> Any:
    """Codes of 65536 even steps of linear light, in double precision as the browser has them."""
    linear = np.linspace(0, 1, 65536)
    power = 1.055 * linear ** (1 / 2.4) - 0.055
    return np.floor(255 * np.where(linear <= 0.0031308, 12.92 * linear, power) + 0.5)
