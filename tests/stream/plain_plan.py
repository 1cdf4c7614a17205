"""Plans (SPEC.md, sections 4 and 5.2) in plain Python, written from the text: an oracle of the decoder."""

from typing import Any

from plain_coder import PlainBytes, PlainCoder
from plain_field import SYMMETRIES, displaced


def decode(head: Any, placements: Any, labels: Any, charts: Any, exemplar: Any, fields: Any) -> Any:
    """Return placements as dictionaries, and per chart its maps as (cell, half, rows of labels).

    `charts` and `exemplar` are (height, width), `fields` PlainFields.
    """
    reader = PlainBytes(head)
    layers = []
    number = reader.varint()
    reader.byte()  # the density changes nothing here
    bits = reader.byte(), reader.byte()
    for _ in range(number):
        flags = reader.byte()
        cells = [reader.varint() for _ in (charts[:1] if flags & 2 else charts)]
        layers.append((flags & 1, cells * len(charts) if flags & 2 else cells))
    counts = [[reader.varint() for _ in charts] for _ in layers]
    reader.end()
    coder, found, mine = PlainCoder(placements, None, 255), [], []
    for n, chart in enumerate(charts):
        parts = []
        for layer, (half, cells) in enumerate(layers):
            grid = Grid(chart, cells[n], half)
            part = _placements(coder, grid, counts[layer][n], fields[n], exemplar, bits)
            parts.append((grid, part))
            found += [one | {"chart": n, "layer": layer} for one in part]
        mine.append(parts)
    coder = PlainCoder(labels, None, 255)
    maps = [[_labels(coder, parts, layer) for layer in range(len(layers))] for parts in mine]
    return found, maps


class Grid:
    """Cells of a layer of a chart."""

    def __init__(self, chart: Any, cell: Any, half: Any) -> None:
        self.cell, self.half = cell, half
        self.rows, self.columns = (-(-side // cell) + 2 for side in chart)

    def centre(self, i: Any) -> Any:
        return 16 * self.cell * (i - 1) + (0 if self.half else 8 * self.cell)


def _placements(coder: Any, grid: Any, count: Any, field: Any, exemplar: Any, bits: Any) -> Any:
    placed: Any = []
    i, j = 0, -1
    for _ in range(count):
        told: Any = [0, 0]

        def number(k: Any, guess: Any, told: Any = told) -> Any:
            told.append(coder.number(k, 2 * (told[-2] != 0) + (told[-1] != 0)))
            unit = 2 ** (0 if k < 4 else bits[1] if k < 8 else bits[0])
            return unit * ((guess + unit // 2) // unit + told[-1])

        row = number(0, i)
        j = number(1, j + 1 if row == i else 0)
        i = row
        p = grid.centre(i), grid.centre(j)
        m = field.at(*p)
        near = None
        for other in placed[-128:]:
            away = (other["row"] - p[0]) ** 2 + (other["column"] - p[1]) ** 2
            if near is None or away <= near[0]:
                near = away, other
        guess, symmetry = (8 * (exemplar[0] - 1), 8 * (exemplar[1] - 1)), 0
        if near:
            guess, symmetry = _reads(near[1], p, m), near[1]["symmetry"]
            guess = tuple(min(16 * n - 1, max(0, x)) for x, n in zip(guess, exemplar, strict=True))
        one = {"row": p[0], "column": p[1], "symmetry": number(2, symmetry), "centred": number(3, 0)}
        one["C"] = [number(4 + k, m[k]) for k in range(4)] if one["centred"] else m
        one["matrix"] = one["C"] if one["centred"] else [0] * 4
        one["source_row"], one["source_column"] = number(8, guess[0]), number(9, guess[1])
        placed.append(one)
    return placed


def _reads(one: Any, p: Any, m: Any) -> Any:
    """Section 8: where a placement reads at p."""
    d = [max(-16383, min(16383, x - c)) for x, c in zip(p, (one["row"], one["column"]), strict=True)]
    v = displaced(one["C"], m, *d)
    s = SYMMETRIES[one["symmetry"]]
    return (
        one["source_row"] + s[0] * v[0] + s[1] * v[1],
        one["source_column"] + s[2] * v[0] + s[3] * v[1],
    )


def _nearest(grid: Any, placed: Any, first: Any) -> Any:
    out = []
    for i in range(grid.rows):
        out.append([])
        for j in range(grid.columns):
            away = [
                (one["row"] - grid.centre(i)) ** 2 + (one["column"] - grid.centre(j)) ** 2 for one in placed
            ]
            out[-1].append(first + away.index(min(away)))
    return out


def _labels(coder: Any, parts: Any, layer: Any) -> Any:
    grid, placed = parts[layer]
    first = len(parts[0][1]) if layer else 0
    known = [[-1 if layer else 0] * grid.columns for _ in range(grid.rows)]
    if len(placed) == 1 - layer:
        return grid.cell, grid.half, known
    nearest = _nearest(grid, placed, first)
    for i in range(grid.rows):
        for j in range(grid.columns):
            known[i][j] = _label(coder, grid, nearest, known, (i, j), (layer, first, len(placed)))
    return grid.cell, grid.half, known


def _label(coder: Any, grid: Any, nearest: Any, known: Any, place: Any, named: Any) -> Any:
    i, j = place
    layer, first, count = named

    def at(a: Any, b: Any) -> Any:
        return known[i + a][j + b] if i + a >= 0 and 0 <= j + b < grid.columns else -2

    w, n, nw, ne, ww, nn = at(0, -1), at(-1, 0), at(-1, -1), at(-1, 1), at(0, -2), at(-2, 0)
    v = nearest[i][j]
    right, below = nearest[i][min(j + 2, grid.columns - 1)], nearest[min(i + 2, grid.rows - 1)][j]
    equal = [
        *(w == n, w == nw, n == ne, v == w, v == n, w == ww, n == nn, n == nw),
        *(right == w, below == w, right == n, below == n),
    ]
    context = sum(2**k for k, each in enumerate(equal) if each)
    asked = []
    if layer and coder.bit([(6, context)], 6):
        return -1
    for k, candidate in enumerate((w, n, v, ne, right, below)):
        if candidate < 0 or candidate in asked:
            continue
        asked.append(candidate)
        if coder.bit([(k, context)], k):
            return candidate
    label = 0
    for b in range((count - 1).bit_length() - 1, -1, -1):
        label = 2 * label + coder.bit([("plain", b)], 7)
    assert label < count
    return first + label
