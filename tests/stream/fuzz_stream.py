"""Mutated streams: nothing but FormatError may come of them, quickly and in little memory.

``python tests/stream/fuzz_stream.py 100000`` is the long run; it prints what it saw and fails loudly.
"""

import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from streams import STREAMS, stream

from upholster.errors import FormatError
from upholster.stream import StreamDecoder, read_stream
from upholster.stream.chunks import ChunkReader, header, pack_chunk

LONGEST_SECONDS = 2.0
MOST_GROWTH = 256 * 2**20
MOST_TEXELS = 2**21


def taken_apart(data: Any) -> Any:
    """Return a file's chunks as (tag, payload)."""
    reader = ChunkReader()
    return [(chunk.tag, part) for chunk, part in reader.feed(data)]


def mutated(rng: Any, data: Any) -> Any:
    """Return a damaged copy: bytes, lengths and chunks changed, with right CRCs or wrong ones."""
    if rng.random() < 0.6:
        chunks = taken_apart(data)
        for _ in range(rng.integers(1, 4)):
            n = int(rng.integers(len(chunks)))
            kind = rng.random()
            tag, payload = chunks[n]
            if kind < 0.75:
                chunks[n] = tag, scrambled(rng, payload)
            elif kind < 0.85:
                chunks.insert(int(rng.integers(len(chunks) + 1)), chunks[n])
            elif kind < 0.95 and len(chunks) > 1:
                del chunks[n]
            else:
                chunks[n] = "SLXDFQPMREabZ"[int(rng.integers(13))], payload
        parts = [pack_chunk(*chunk) for chunk in chunks]
        view = 0
        for (tag, _), part in zip(chunks, parts, strict=True):
            view += len(part)
            if tag == "X":
                break
        total, length = sum(map(len, parts)), 0
        while len(found := header(total + length, view + length)) != length:
            length = len(found)
        out = found + b"".join(parts)
    else:
        out = scrambled(rng, data)
    return out[: int(rng.integers(len(out) + 1))] if rng.random() < 0.3 else out


def scrambled(rng: Any, data: Any) -> Any:
    """Return bytes with some changed, dropped or added."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        place = int(rng.integers(len(out) + 1))
        kind = rng.random()
        if kind < 0.6 and place < len(out):
            out[place] = int(rng.choice([0, 1, 127, 128, 255, int(rng.integers(256)), out[place] ^ 1]))
        elif kind < 0.8:
            out[place : place + int(rng.integers(1, 9))] = b""
        else:
            out[place:place] = rng.bytes(int(rng.integers(1, 9)))
    return bytes(out)


def try_one(rng: Any, data: Any) -> Any:
    """Decode damaged bytes in pieces; return what came of it."""
    decoder = StreamDecoder()
    try:
        if rng.random() < 0.2:
            read_stream(data)
        place = 0
        while place < len(data):
            step = int(rng.integers(1, max(2, len(data))))
            decoder.feed(data[place : place + step])
            place += step
        if decoder.needed:
            return "too short"
        for role in decoder.roles:
            decoder.exemplar(role)
        if sum(chart.height * chart.width for chart in decoder.charts) > MOST_TEXELS:
            decoder.quilt()
            return "large"
        decoder.texels(threads=1)
    except FormatError as error:
        if not str(error).startswith("byte ") or "\n" in str(error):
            raise RuntimeError(f"message without place: {error}") from error
        return "refused"
    return "decoded"


def keep(data: bytes, why: str) -> None:
    """Write a file that was found among the temporary ones, and say where."""
    path = Path(tempfile.gettempdir()) / f"fuzz_{why}.uph"
    path.write_bytes(data)
    print(f"{why}: {path}")


def run(count: Any, seed: Any = 0) -> Any:
    """Try so many damaged streams; return how often what happened, the slowest and the memory grown."""
    rng = np.random.default_rng(seed)
    sources = [stream(name) for name in STREAMS]
    for data in sources:
        read_stream(data).texels(threads=1)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seen: Counter[str] = Counter()
    slowest = 0.0
    for n in range(count):
        data = mutated(rng, sources[n % len(sources)])
        start = time.process_time()  # not the time of other processes
        try:
            seen[try_one(rng, data)] += 1
        except BaseException:
            keep(data, "failure")
            raise
        taken = time.process_time() - start
        if taken > slowest:
            slowest = taken
            if taken > LONGEST_SECONDS:
                keep(data, "slow")
    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    return seen, slowest, grown


if __name__ == "__main__":
    seen, slowest, grown = run(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
    print(dict(seen), f"slowest {slowest:.2f} s, memory grew by {grown / 2**20:.0f} MB")
    if slowest > LONGEST_SECONDS or grown > MOST_GROWTH:
        sys.exit("too slow or too large")
