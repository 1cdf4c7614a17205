"""The page's worker hands over what the decoder paints, gutters that match, and any prefix on demand."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from decoders import HERE, node
from streams import noise, woven

from upholster.codec.stream.writer import encode_stream


def _material(spec: str, texels: int, *, upside: int = 1) -> bytes:
    surface, quilt, exemplar = woven(spec, texels)
    shape = exemplar.shape[:2]
    maps = {
        "normal": noise(*shape, 3, np.uint16, seed=1),
        "roughness": noise(*shape, 1, np.uint8, seed=2)[::upside],
        "opacity": noise(*shape, 1, np.uint8, seed=3),
    }
    return encode_stream(surface, quilt, exemplar, maps=maps)


@pytest.mark.slow(reason="runs Node on many streams")
def test_the_worker_keeps_its_promises(tmp_path: Any) -> None:
    (tmp_path / "sphere.uph").write_bytes(_material("sphere", 8_000))
    (tmp_path / "vase.uph").write_bytes(_material("vase", 12_000))
    (tmp_path / "rough.uph").write_bytes(_material("sphere", 8_000, upside=-1))
    done = subprocess.run(
        [node(), "--test", str(HERE / "worker.test.mjs")],
        env={**os.environ, "STREAMS": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
