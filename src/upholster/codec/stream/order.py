"""The order of a stream's parts: always next is the part that reduces the error most per byte.

The head, a coarse sample and coarse nodes of warp fields come first; after a base, the surface precedes the
nodes. Then follow two queues, each in its own order: placements, finer nodes and labels; and the rest of the
sample. The next part is always from the queue whose next parts together gain most per byte. The gain of a
part is estimated from variances and from the number of steps that it makes right. A decoder accepts any
order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from upholster.codec.stream.chunks import pack_chunk
from upholster.codec.stream.field_chunks import FieldCode
from upholster.codec.stream.plan import PlanCode

__all__ = [
    "StreamPart",
    "ordered",
    "plan_parts",
    "sample_parts",
    "split_sample",
]

Chunk = tuple[str, bytes]

_ROUND_CHUNK = 7
"""Bytes around a chunk's payload."""

_LEAST_PART = 160
"""Least number of bytes of placements, nodes or labels in a part."""

_SURE = 0.8
"""Share of right steps among those that placements show before finer nodes of warp fields have arrived."""

_GROWTH, _LAST_SPLIT = 1.5, 40_000
"""Ratio of the lengths of the sample between which other parts may come."""


@dataclass(frozen=True)
class StreamPart:
    """A part of the stream.

    Attributes
    ----------
    chunks
        Tags and payloads.
    steps
        For the plan: the number of further steps that it makes right. For the sample: the number of its bytes
        up to the end of this part.
    """

    chunks: tuple[Chunk, ...]
    steps: float

    @property
    def length(self) -> int:
        """Length of its chunks in bytes."""
        return sum(len(data) + _ROUND_CHUNK for _, data in self.chunks)


def plan_parts(plan: PlanCode, fields: FieldCode | None) -> list[StreamPart]:
    """Return placements from coarse to fine, then the finer nodes of warp fields, then labels."""
    sure = 1.0 if fields is None else _SURE
    parts = _parts("P", plan.placements, [(end, sure * right) for end, right in plan.placement_ends])
    if fields is not None:
        right = plan.placement_ends[-1][1]
        parts += _parts("N", fields.nodes[fields.coarse :], [(len(fields.nodes), (1 - sure) * right)])
    return parts + _parts("M", plan.labels, plan.label_ends)


def _parts(tag: str, data: bytes, ends: Sequence[tuple[int, float]]) -> list[StreamPart]:
    found, start, before = list[StreamPart](), 0, 0.0
    for end, right in ends:
        if end - start >= _LEAST_PART or end >= len(data):
            found.append(StreamPart(((tag, data[start:end]),), right - before))
            start, before = end, right
    return [part for part in found if part.chunks[0][1]]


def sample_parts(turns: Sequence[tuple[int, tuple[Chunk, ...]]]) -> list[StreamPart]:
    """Return the sample's parts, each with the number of bytes of the first map up to its end."""
    return [StreamPart(chunks, reached) for reached, chunks in turns]


def split_sample(payload: bytes, first: int) -> list[tuple[int, tuple[Chunk, ...]]]:
    """Return the rest of a sample without further maps, from `first` bytes on."""
    ends, length = [first], float(max(first, 400))
    while length < min(len(payload), _LAST_SPLIT):
        length *= _GROWTH
        ends.append(min(int(length), len(payload)))
    ends.append(len(payload))
    return [(high, (("D", payload[low:high]),)) for low, high in pairwise(ends) if low < high]


def ordered(
    queue: Sequence[StreamPart],
    sample: Sequence[StreamPart],
    errors: tuple[float, dict[int, float]],
    first: int,
) -> list[bytes]:
    """Return all parts as chunks; the next one is always the part that gains most per byte.

    The gain is the number of steps that it makes right, times the variance of the sample. `errors` as
    returned by `upholster.codec.stream.sample.sample_errors`; `first` bytes of the sample precede.
    """
    variance, error = errors
    known = [
        max(0.0, variance - error[reached]) for reached in (first, *(int(part.steps) for part in sample))
    ]
    shown = [0.0, *np.cumsum([part.steps for part in queue])]
    placed = seen = 0
    out: list[Chunk] = []
    while placed < len(queue) or seen < len(sample):
        clear = known[seen] * _steepest(shown, queue, placed)
        sharp = max(0.0, shown[placed]) * _steepest(known, sample, seen)
        if placed < len(queue) and (seen == len(sample) or clear > sharp):
            part, placed = queue[placed], placed + 1
        else:
            part, seen = sample[seen], seen + 1
        for tag, data in part.chunks:
            # Consecutive parts of one kind are joined to one chunk.
            if out and out[-1][0] == tag != "E":
                out[-1] = tag, out[-1][1] + data
            else:
                out.append((tag, data))
    return [pack_chunk(tag, data) for tag, data in out]


def _steepest(values: Sequence[float], parts: Sequence[StreamPart], start: int) -> float:
    # The largest gain per byte of the next parts, over any number of them together.
    best, length = -np.inf, 0
    for n in range(start, len(parts)):
        length += parts[n].length
        best = max(best, (values[n + 1] - values[start]) / length)
    return best
