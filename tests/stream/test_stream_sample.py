"""A stream's sample is coded once, and kept by its content."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from streams import laid

import upholster.codec.stream.sample as sample
from upholster.codec.stream.reader import read_stream
from upholster.codec.stream.writer import encode_stream


def test_a_sample_is_coded_once_and_gives_the_same_bytes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    surface, quilt, exemplar = laid("torus")
    maps = {"height": exemplar[..., :1] // 2}
    calls: list[Any] = []
    coded = sample.encode_parts
    monkeypatch.setattr(
        sample, "encode_parts", lambda *given, **how: calls.append(how) or coded(*given, **how)
    )
    monkeypatch.setenv("UPHOLSTER_CACHE", str(tmp_path / "kept"))
    first = encode_stream(surface, quilt, exemplar, maps=maps)
    assert len(calls) == 2
    assert encode_stream(surface, quilt, exemplar.copy(), maps=maps) == first
    assert len(calls) == 2
    for kept in (tmp_path / "kept").iterdir():
        kept.write_bytes(kept.read_bytes()[:-1] + b"x")  # damaged: coded anew
    assert encode_stream(surface, quilt, exemplar, maps=maps) == first
    assert len(calls) == 4
    # Another pixel, another shape and other options are other contents.
    other = exemplar.copy()
    other[0, 0, 0] ^= 1
    encode_stream(surface, quilt, other)
    encode_stream(surface, quilt, exemplar, sample_quality=30)
    encode_stream(surface, quilt, exemplar, wavelet="haar")
    assert len(calls) == 7


@pytest.mark.parametrize("quality", [24, 38.0, "lossless"])
def test_every_map_ends_at_the_quality_that_is_named(quality: Any) -> None:
    surface, quilt, exemplar = laid("torus")
    maps = {"normal": exemplar[::-1], "height": exemplar[..., 1:2]}
    reached: dict[str, float] = {}
    data = encode_stream(surface, quilt, exemplar, maps=maps, sample_quality=quality, reached=reached)
    assert list(reached) == ["albedo", "normal", "height"]
    decoder = read_stream(data)
    for role, image in {"albedo": exemplar, **maps}.items():
        error = np.mean((decoder.exemplar(role).astype(float) - image) ** 2)
        if quality == "lossless":
            assert error == 0
            assert reached[role] == np.inf
        else:
            assert 10 * np.log10(255**2 / error) == pytest.approx(reached[role], abs=0.05)
            assert quality <= reached[role]


def test_the_quality_of_a_stream_that_bytes_end_is_that_of_its_part() -> None:
    surface, quilt, exemplar = laid("torus")
    reached: dict[str, float] = {}
    whole = encode_stream(surface, quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar, most_bytes=len(whole) - 700, reached=reached)
    error = np.mean((read_stream(data).exemplar().astype(float) - exemplar) ** 2)
    found = 10 * np.log10(255**2 / error)
    assert found - 1 <= reached["albedo"] <= found + 0.05
