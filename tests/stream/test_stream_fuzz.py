"""A short, seeded run of the fuzzer; the long one is ``python tests/stream/fuzz_stream.py 100000``."""

from fuzz_stream import LONGEST_SECONDS, MOST_GROWTH, run


def test_damaged_streams_are_refused_or_read_quickly_and_in_little_memory() -> None:
    seen, slowest, grown = run(300, seed=1)
    assert seen["refused"] > 100
    assert seen["decoded"] > 10
    assert slowest < LONGEST_SECONDS
    assert grown < MOST_GROWTH
