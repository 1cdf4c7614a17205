"""A short, seeded run of the fuzzer; the long one is ``python tests/fuzz --streams 100000``."""

import contextlib
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))

from costly import CASES, costly
from fuzz import LIMITS, fuzz_streams
from readers import CAD, SOURCES, reader, written

from upholster.errors import FormatError
from upholster.stream import StreamDecoder


def test_damaged_streams_are_refused_or_read_in_little_memory() -> None:
    costs = fuzz_streams(np.random.default_rng(1), 250, extremes=False)
    assert costs.seen["refused"] > 100
    assert costs.seen["decoded"] > 10
    assert costs.memory < 2**28


@pytest.mark.parametrize("name", sorted(CASES))
def test_streams_that_ask_for_very_much_are_made_of_what_there_is(name: str) -> None:
    # Their whole cost is the fuzzer's to measure: here they are made, and read as far as charts and images.
    data = costly(name)
    decoder = StreamDecoder(limits=LIMITS)
    with contextlib.suppress(FormatError):
        decoder.feed(data[:400])
    assert len(decoder.chunks) > 0


@pytest.mark.parametrize("suffix", [suffix for suffix in SOURCES if suffix not in CAD])
def test_what_the_fuzzer_damages_is_sound(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"sound.{suffix}"
    path.write_bytes(written(suffix, tmp_path))
    assert reader(suffix, path)() == "read"
