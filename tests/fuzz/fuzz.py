"""Runs of damaged files: streams, all other kinds, and streams by both decoders."""

import json
import sys
import tempfile
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from costly import CASES, costly
from costs import Costs
from mutants import any_mutant, scrambled
from readers import CAD, SOURCES, injected, reader, written
from streams import STREAMS, stream

from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.codec.stream.description import describe
from upholster.codec.stream.reader import StreamDecoder, read_stream

__all__ = ["LIMITS", "fuzz_files", "fuzz_pairs", "fuzz_streams"]

LIMITS = Limits(texels=2**22)
MOST_TEXELS = 2**21
VECTORS = Path(__file__).parents[1] / "vectors"
METHODS = (zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2)
OF_PROCESSES: Any = {"slow": 10.0, "large": 2**30}
_PAIRS_AT_ONCE = 1000


def sources() -> list[bytes]:
    """Sound streams of every kind."""
    return [
        *(stream(name) for name in STREAMS),
        *(path.read_bytes() for path in sorted(VECTORS.glob("*.uph"))),
    ]


def try_stream(rng: Any, data: bytes) -> str:
    """Decode damaged bytes in pieces, paint what can be painted; return what came of it."""
    decoder = StreamDecoder(limits=LIMITS)
    try:
        chosen = rng.random()  # each by itself: its time is told
        if chosen < 0.1:
            read_stream(data, limits=LIMITS)
            return "read strictly"
        if chosen < 0.2:
            describe(data, limits=LIMITS)
            return "described"
        place = 0
        while place < len(data):
            step = int(rng.integers(1, max(2, len(data))))
            decoder.feed(data[place : place + step])
            place += step
        if decoder.needed:
            return "too short"
        for role in decoder.roles:
            decoder.exemplar(role)
            decoder.texels(role, threads=1)
    except FormatError as error:
        if not str(error).startswith("byte "):
            raise RuntimeError(f"message without place: {error}") from error
        raise
    return "decoded"


def taken(data: bytes) -> bool:
    """Whether a decoder takes a stream's first chunk: what asks for very much is no mere rubbish."""
    decoder = StreamDecoder(limits=LIMITS)
    with suppress(FormatError):
        decoder.feed(data[:400])
    return len(decoder.chunks) > 0


def fuzz_streams(rng: Any, count: int, *, extremes: bool = True) -> Costs:
    """Try so many damaged streams, and before them, unless told not to, those that ask for very much."""
    sound, costs = sources(), Costs("uph")
    for data in sound:
        read_stream(data).texels(threads=1)  # compiles
    for name in sorted(CASES) if extremes else ():
        data = costly(name)
        if not taken(data):
            raise RuntimeError(f"no decoder takes the first bytes of {name!r}")
        costs.attempt(data, lambda data=data: try_stream(rng, data))
    for n in range(count):
        data = any_mutant(rng, sound, n, 0.02 * extremes)
        costs.attempt(data, lambda data=data: try_stream(rng, data))
    return costs


def fuzz_files(rng: Any, count: int, cad: int, folder: Path) -> list[Costs]:
    """Try so many damaged files of all kinds together, and so many of each kind of CAD file."""
    found = []
    plain = [suffix for suffix in SOURCES if suffix not in CAD]
    for suffix in SOURCES:
        # What reads CAD files is a process that takes two seconds and 300 MB before it begins.
        sound, costs = written(suffix, folder), Costs(suffix, **(OF_PROCESSES if suffix in CAD else {}))
        path = folder / f"damaged.{suffix}"
        path.write_bytes(sound)
        if suffix in CAD:
            try:
                reader(suffix, path)()
            except InputError as error:  # what reads it is here, but does not work
                print(f"{suffix}: left out: {error}")
                continue
        sounds = [written(suffix, folder, method) for method in METHODS] if suffix == "zip" else [sound]
        for n in range(cad if suffix in CAD else count // len(plain)):
            one = sounds[n % len(sounds)]
            data = injected(rng, suffix, one) if n % 20 == 0 else scrambled(rng, one)
            path.write_bytes(data)
            costs.attempt(data, reader(suffix, path))
        found.append(costs)
    return found


def fuzz_pairs(rng: Any, count: int, folder: Path) -> int:
    """Decode so many damaged streams with both decoders; return how many differ."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "web"))
    from decoders import in_node, in_python

    sound, differ = sources(), 0
    for start in range(0, count, _PAIRS_AT_ONCE):
        jobs = []
        for n in range(start, min(count, start + _PAIRS_AT_ONCE)):
            data = any_mutant(rng, sound, n, 0.0)
            if data:
                cut = int(rng.integers(1, 4 * len(data)))  # some are looked at before their end, too
                jobs.append(("damaged.uph", data, [cut] * (cut < len(data)) + [len(data)]))
        for (_, data, cuts), found in zip(jobs, in_node(folder, jobs), strict=True):
            wanted = in_python(data, cuts)
            if ("error" in found[-1]) != ("error" in wanted[-1]) or (
                "error" not in wanted[-1] and found != wanted
            ):
                differ += 1
                path = Path(tempfile.gettempdir()) / f"fuzz_pair_{differ}.uph"
                path.write_bytes(data)
                print(f"differ: {path}: {json.dumps(found[-1])[:200]}; Python {json.dumps(wanted[-1])[:200]}")
    print(f"pairs: {count:,}, of which {differ} differ")
    return differ
