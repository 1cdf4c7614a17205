"""The order of a stream's parts: at each byte what takes most of the error away that is left.

The head and a coarse sample come first. Then follow two queues, each in its own order: charts with warp
fields and placements, and behind them the labels; and the rest of the sample. The next part is always of the
queue whose next parts together gain most a byte. What a part gains is estimated from variances and from how
many steps are shown right; a decoder takes any order.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from upholster.quilt import Chart
from upholster.stream.chunks import pack_chunk
from upholster.stream.plan import PlanCode
from upholster.stream.warp_fields import FieldCode

__all__ = [
    "Part",
    "chart_parts",
    "label_parts",
    "ordered",
    "sample_parts",
    "split_sample",
]

Chunk = tuple[str, bytes]

_ROUND_CHUNK = 7
"""Bytes round a chunk's payload."""

_LEAST_PART, _CHART_PARTS = 800, 24
_LEAST_LABELS, _LABEL_PARTS = 320, 16
_GROWTH, _LAST_SPLIT = 1.5, 40_000
"""Lengths of the sample between which other parts may come: each so many times the one before."""


@dataclass(frozen=True)
class Part:
    """What comes at a time.

    Attributes
    ----------
    chunks
        Tags and payloads.
    steps
        Of charts and of labels: how many steps are shown right from then on. Of the sample: how many bytes of
        it have come with this part.
    """

    chunks: tuple[Chunk, ...]
    steps: float

    @property
    def length(self) -> int:
        """Bytes of its chunks."""
        return sum(len(data) + _ROUND_CHUNK for _, data in self.chunks)


def chart_parts(charts: Sequence[Chart], plan: PlanCode, fields: FieldCode | None) -> list[Part]:
    """Return warp fields and placements, a few charts at a time."""
    nodes, node_ends = (b"", (0,) * len(charts)) if fields is None else (fields.nodes, fields.ends)
    ends = [a + b for a, b in zip(node_ends, plan.placement_ends, strict=True)]
    right = [chart.height * chart.width - wrong for chart, wrong in zip(charts, plan.surprising, strict=True)]
    parts = []
    for low, high in _split(ends, _CHART_PARTS):
        chunks = [
            ("N", _between(nodes, node_ends, low, high)),
            ("P", _between(plan.placements, plan.placement_ends, low, high)),
        ]
        parts.append(Part(tuple(chunk for chunk in chunks if chunk[1]), float(sum(right[low:high]))))
    return [part for part in parts if part.chunks]


def label_parts(plan: PlanCode) -> list[Part]:
    """Return labels, so many bytes at a time."""
    length = len(plan.labels)
    cuts = np.linspace(0, length, 1 + max(1, min(_LABEL_PARTS, length // _LEAST_LABELS))).astype(int).tolist()
    steps = np.interp(cuts, [0, *plan.label_ends], np.cumsum([0.0, *plan.surprising]))
    return [
        Part((("M", plan.labels[low:high]),), float(steps[n + 1] - steps[n]))
        for n, (low, high) in enumerate(pairwise(cuts))
        if low < high
    ]


def sample_parts(turns: Sequence[tuple[int, tuple[Chunk, ...]]]) -> list[Part]:
    """Return the sample's parts: each with how many bytes of the first map have come with it."""
    return [Part(chunks, reached) for reached, chunks in turns]


def split_sample(payload: bytes, first: int) -> list[tuple[int, tuple[Chunk, ...]]]:
    """Return the rest of a sample without further maps, from `first` bytes on."""
    ends, length = [first], float(max(first, 400))
    while length < min(len(payload), _LAST_SPLIT):
        length *= _GROWTH
        ends.append(min(int(length), len(payload)))
    ends.append(len(payload))
    return [(high, (("D", payload[low:high]),)) for low, high in pairwise(ends) if low < high]


def ordered(
    charts: Sequence[Part],
    labels: Sequence[Part],
    sample: Sequence[Part],
    errors: tuple[float, dict[int, float]],
    first: int,
) -> list[bytes]:
    """Return all parts as chunks, at each place the one that gains most a byte.

    What is gained is the steps that are shown right, times the variance that the sample shows. `errors` as
    `upholster.stream.sample.sample_errors` gives them; `first` bytes of the sample come before.
    """
    variance, error = errors
    known = [
        max(0.0, variance - error[reached]) for reached in (first, *(int(part.steps) for part in sample))
    ]
    queue = [*charts, *labels]
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
            # Parts of one kind that follow each other are one chunk.
            if out and out[-1][0] == tag != "E":
                out[-1] = tag, out[-1][1] + data
            else:
                out.append((tag, data))
    return [pack_chunk(tag, data) for tag, data in out]


def _steepest(values: Sequence[float], parts: Sequence[Part], start: int) -> float:
    # The most that the next parts gain a byte, so many of them together as are best.
    best, length = -np.inf, 0
    for n in range(start, len(parts)):
        length += parts[n].length
        best = max(best, (values[n + 1] - values[start]) / length)
    return best


def _between(data: bytes, ends: Sequence[int], low: int, high: int) -> bytes:
    return data[ends[low - 1] if low else 0 : ends[high - 1]]


def _split(ends: Sequence[int], most: int) -> list[tuple[int, int]]:
    # From which to which chart, such that each part has enough bytes.
    least = max(_LEAST_PART, ends[-1] // most)
    cuts, start = [0], 0
    for n, end in enumerate(ends[:-1], 1):
        if end - start >= least and ends[-1] - end >= least // 2:
            cuts.append(n)
            start = end
    return list(pairwise([*cuts, len(ends)]))
