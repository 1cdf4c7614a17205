"""A short, seeded run of the fuzzer; the long one is ``python tests/fuzz --streams 100000``."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))

from fuzz import fuzz_streams
from readers import CAD, SOURCES, reader, written


@pytest.mark.slow(reason="reads streams at many lengths")
def test_damaged_streams_are_refused_or_read_in_little_memory() -> None:
    costs = fuzz_streams(np.random.default_rng(1), 100, extremes=False)
    assert costs.seen["refused"] > 40
    assert costs.seen["decoded"] > 10
    assert costs.memory < 2**28


@pytest.mark.parametrize("suffix", [suffix for suffix in SOURCES if suffix not in CAD])
def test_what_the_fuzzer_damages_is_sound(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"sound.{suffix}"
    path.write_bytes(written(suffix, tmp_path))
    assert reader(suffix, path)() == "read"
