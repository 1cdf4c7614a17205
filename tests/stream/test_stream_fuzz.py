"""A short, seeded run of the fuzzer; the long one is ``python tests/fuzz --streams 100000``."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))

from fuzz import fuzz_streams


def test_damaged_streams_are_refused_or_read_in_little_memory() -> None:
    costs = fuzz_streams(np.random.default_rng(1), 250, extremes=False)
    assert costs.seen["refused"] > 100
    assert costs.seen["decoded"] > 10
    assert costs.memory < 2**28
