"""The order of a stream's parts: at each byte what takes most of the error away that is left.

The head and a coarse sample come first. Then follow two queues, each in its own order: charts with warp
fields and sources, and behind them the masks; and the rest of the sample. The next part is always of the
queue whose next parts together gain most a byte. What a part gains is estimated from variances, and from
what straight cuts show wrongly; a decoder takes any order. Which charts come first is told in
`upholster.stream.arranged`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upholster.codec import ImageDecoder
from upholster.codec.header import ImageHeader
from upholster.quilt import Quilt, paint
from upholster.methods.quilt.masked import MASK_CUT, mask_sizes
from upholster.methods.quilt.old_plans import PlacementList
from upholster.stream.chunks import pack_chunk
from upholster.stream.plan_common import PlanCode
from upholster.stream.warp_fields import FieldCode
from upholster.types import FloatArray, PixelArray

__all__ = [
    "Part",
    "changed_texels",
    "chart_parts",
    "mask_parts",
    "ordered",
    "sample_errors",
    "sample_parts",
    "split_sample",
    "unlikeness",
]

Chunk = tuple[str, bytes]

_ROUND_CHUNK = 7
"""Bytes round a chunk's payload."""

_LEAST_PART, _CHART_PARTS = 800, 24
_LEAST_MASKS, _MASK_PARTS = 320, 16
_GROWTH, _LAST_SPLIT = 1.5, 40_000
"""Lengths of the sample between which other parts may come: each so many times the one before."""

_LOOKED_AT = 2**18
"""Texels in which straight cuts are compared with masks, and less than a chart more."""

_LEAST_GAIN = 0.05
"""Of a chart, in its texels: it is shown in its turn even where straight cuts show little that is right."""


@dataclass(frozen=True)
class Part:
    """What comes at a time.

    Attributes
    ----------
    chunks
        Tags and payloads.
    texels
        Of charts: how many texels get their placements. Of masks: how many change. Of the sample: how many
        bytes of it have come with this part.
    wrong
        Of charts: in how many of its texels straight cuts differ from the masks.
    """

    chunks: tuple[Chunk, ...]
    texels: float
    wrong: float = 0.0

    @property
    def length(self) -> int:
        """Bytes of its chunks."""
        return sum(len(data) + _ROUND_CHUNK for _, data in self.chunks)


def chart_parts(quilt: Quilt, plan: PlanCode, fields: FieldCode | None, changed: FloatArray) -> list[Part]:
    """Return warp fields and sources, a few charts at a time; `changed` as `changed_texels` gives it."""
    nodes, node_ends = (b"", (0,) * len(plan.order)) if fields is None else (fields.nodes, fields.ends)
    ends = [a + b for a, b in zip(node_ends, plan.source_ends, strict=True)]
    parts, sizes = [], [quilt.charts[n].height * quilt.charts[n].width for n in plan.order]
    for low, high in _split(ends, _CHART_PARTS):
        chunks = [
            ("N", _between(nodes, node_ends, low, high)),
            ("P", _between(plan.sources, plan.source_ends, low, high)),
        ]
        wrong = float(sum(changed[n] for n in plan.order[low:high]))
        parts.append(Part(tuple(chunk for chunk in chunks if chunk[1]), sum(sizes[low:high]), wrong))
    return [part for part in parts if part.chunks]


def mask_parts(plan: PlanCode, changed: FloatArray) -> list[Part]:
    """Return masks, so many bytes at a time; `changed` as `changed_texels` gives it."""
    length = len(plan.masks)
    cuts = np.linspace(0, length, 1 + max(1, min(_MASK_PARTS, length // _LEAST_MASKS))).astype(int).tolist()
    known = np.cumsum([0.0, *(changed[n] for n in plan.order)])
    texels = np.interp(cuts, [0, *plan.mask_ends], known)
    return [
        Part((("M", plan.masks[low:high]),), float(texels[n + 1] - texels[n]))
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


def sample_errors(header: bytes, payload: bytes, lengths: Iterable[int]) -> tuple[float, dict[int, float]]:
    """Return a sample's variance, and its mean squared error after so many bytes of its stream."""
    whole = ImageDecoder(ImageHeader.parse(header))
    whole.feed(payload)
    best = whole.integers().astype(np.float64)
    decoder, place, found = ImageDecoder(ImageHeader.parse(header)), 0, dict[int, float]()
    for length in sorted({*lengths}):
        decoder.feed(payload[place:length])
        place = length
        found[length] = float(np.mean((decoder.integers() - best) ** 2))
    variance = float(np.mean((best - best.mean(axis=(0, 1))) ** 2))
    return variance, found


def ordered(
    charts: Sequence[Part],
    masks: Sequence[Part],
    sample: Sequence[Part],
    errors: tuple[float, dict[int, float]],
    first: int,
    unlike: float,
) -> list[bytes]:
    """Return all parts as chunks, at each place the one that gains most a byte.

    What is gained over a flat colour is the texels that are seen in their place, less those that are seen in
    a wrong one, times the variance that the sample shows. `unlike` as `unlikeness` gives it.
    """
    variance, error = errors
    known = [
        max(0.0, variance - error[reached]) for reached in (first, *(int(part.texels) for part in sample))
    ]
    shown = [0.0, *np.cumsum([part.texels - unlike * part.wrong for part in charts])]
    shown += [*(shown[-1] + np.cumsum([unlike * part.texels for part in masks]))]
    queue = [*charts, *masks]
    placed = seen = 0
    out: list[Chunk] = []
    while placed < len(queue) or seen < len(sample):
        clear = known[seen] * _steepest(shown, queue, placed)
        if placed < len(charts):
            # It is shown in its turn even where straight cuts show little that is right.
            clear = max(clear, known[seen] * _LEAST_GAIN * charts[placed].texels / charts[placed].length)
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


def changed_texels(quilt: Quilt, straight: Quilt) -> FloatArray:
    """Return per chart over how many texels masks differ from straight cuts.

    `straight` is the quilt with straight cuts in place of its masks; where that lacks a mask all of its
    texels count.
    """
    placed, other = quilt.placements, straight.placements
    sizes = np.where(placed["mask"] == MASK_CUT, mask_sizes(placed, quilt.charts), 0)
    if len(other) == len(placed):
        owner = np.repeat(np.arange(len(placed)), sizes)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        ours = quilt.mask_cells[placed["first_cell"][owner] + within]
        theirs = straight.mask_cells[other["first_cell"][owner] + within]
        sizes = np.bincount(owner[ours != theirs], minlength=len(placed))
    area = sizes * placed["mask_cell"].astype(np.float64) ** 2
    return np.bincount(placed["chart"], area, minlength=len(quilt.charts)).astype(np.float64)


def unlikeness(quilt: Quilt, straight: Quilt, exemplar: PixelArray, changed: FloatArray) -> float:
    """Return the squared difference of what straight cuts and masks show, over the sample's variance.

    Of the texels that `changed` counts, 0 to 2, as found on some of the charts; 0 where there are none.
    """
    sizes = np.array([chart.height * chart.width for chart in quilt.charts])
    # Evenly over all charts, as they lie over the surface.
    step = max(1, -(-int(sizes.sum()) // _LOOKED_AT))
    some = np.arange(0, len(sizes), step)
    counted = float(changed[some].sum())
    if counted == 0 or len(straight.placements) != len(quilt.placements):
        return 0.0
    ours, theirs = (paint(_charts_of(one, some), exemplar).arrays for one in (quilt, straight))
    total = sum(
        float(((a.astype(np.float64) - b) ** 2).mean(axis=2).sum()) for a, b in zip(ours, theirs, strict=True)
    )
    image = exemplar.astype(np.float64)
    variance = float(np.mean((image - image.mean(axis=(0, 1))) ** 2))
    return min(2.0, total / (counted * variance)) if variance > 0 else 0.0


def _charts_of(quilt: Quilt, some: NDArray[np.int64]) -> Quilt:
    placed = quilt.placements[np.isin(quilt.placements["chart"], some)]
    placed["chart"] = np.searchsorted(some, placed["chart"])
    charts = tuple(quilt.charts[n] for n in some)
    return Quilt(
        charts,
        quilt.exemplar_shape,
        PlacementList(placed, quilt.mask_cells),
        tuple(quilt.fields[n] for n in some),
    )
