"""Damaged files: streams with right checksums again, and any others byte by byte."""

from typing import Any

from costly import CASES, costly, image_header, rebuilt

from upholster.codec.stream.chunks import ChunkReader

__all__ = ["any_mutant", "mutated", "scrambled"]

TAGS = "BSLXDFQPMREabZ"
NAMES = (b"\x1b]0;x\x07", b"[bold]x[/bold]", b"[/foo]", "\u202egpj.exe".encode(), b"\xff\xfe\0", b"<script>")
"""Names that a terminal, a table or a page might obey."""


def taken_apart(data: bytes) -> list[tuple[str, bytes]]:
    """Return a file's chunks as (tag, payload)."""
    reader = ChunkReader()
    return [(chunk.tag, part) for chunk, part in reader.feed(data)]


def mutated(rng: Any, data: bytes) -> bytes:
    """Return a damaged copy: bytes, lengths and chunks changed, checksums right again or not, or cut."""
    if rng.random() < 0.85:
        chunks = taken_apart(data)
        for _ in range(int(rng.integers(1, 4))):
            change_chunk(rng, chunks)
        out = rebuilt(chunks) if any(tag == "X" for tag, _ in chunks) else scrambled(rng, data)
    else:
        out = scrambled(rng, data)
    return out[: int(rng.integers(len(out) + 1))] if rng.random() < 0.2 else out


def change_chunk(rng: Any, chunks: list[tuple[str, bytes]]) -> None:
    """Change one of a stream's chunks."""
    n = int(rng.integers(len(chunks)))
    tag, payload = chunks[n]
    kind = rng.random()
    if kind < 0.55:
        chunks[n] = tag, scrambled(rng, payload)
    elif kind < 0.65:  # what codes most in fewest bytes
        chunks[n] = tag, bytes([int(rng.choice([0, 255]))]) * int(rng.integers(0, 3000))
    elif kind < 0.72:  # the greatest numbers
        place = int(rng.integers(len(payload) + 1))
        chunks[n] = tag, payload[:place] + b"\xff" * int(rng.integers(1, 9)) + payload[place + 4 :]
    elif kind < 0.77 and tag in "XR":
        side = int(rng.choice([1, 2, 64, 1024, 4096]))
        sizes = side, max(1, min(4096, 3_200_000 // side)), int(rng.integers(1, 5))
        head = image_header(*sizes, plane=int(rng.integers(-1, 24)), depth=int(rng.integers(3)))
        chunks[n] = tag, head if tag == "X" else payload[:8] + head
    elif kind < 0.82:
        name = NAMES[int(rng.integers(len(NAMES)))]
        chunks[n] = tag, payload[:2] + bytes([len(name)]) + name + payload[3:]
    elif kind < 0.9:
        chunks.insert(int(rng.integers(len(chunks) + 1)), chunks[n])
    elif kind < 0.95 and len(chunks) > 1:
        del chunks[n]
    else:
        chunks[n] = TAGS[int(rng.integers(len(TAGS)))], payload


def scrambled(rng: Any, data: bytes) -> bytes:
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


def any_mutant(rng: Any, sources: list[bytes], n: int, extremes: float) -> bytes:
    """Return the n-th mutant: of a source in turn; a share of them of streams that ask for very much."""
    if rng.random() < extremes:
        names = sorted(CASES)
        return mutated(rng, costly(names[int(rng.integers(len(names)))]))
    return mutated(rng, sources[n % len(sources)])
