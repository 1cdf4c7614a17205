"""Plans (SPEC.md, sections 4 and 5.2) in plain Python, written from the text: an oracle of the decoder.

Of bytes that are cut it tells what is known.
"""

from typing import Any

from plain_coder import EndError, PlainBytes, PlainCoder


class Head:
    """Chunk Q: per layer, then chart, its grid of cells and its number of placements."""

    def __init__(self, data: Any, charts: Any) -> None:
        reader = PlainBytes(data)
        layers = reader.varint()
        reader.byte()  # the density changes nothing here
        self.a, self.b = reader.byte(), reader.byte()
        self.grids = []
        for _ in range(layers):
            flags = reader.byte()
            cells = [reader.varint() for _ in (charts[:1] if flags & 2 else charts)]
            cells = cells * len(charts) if flags & 2 else cells
            self.grids.append([Grid(*one, flags & 1) for one in zip(charts, cells, strict=True)])
        self.counts = [[reader.varint() for _ in charts] for _ in range(layers)]
        reader.end()


class Grid:
    """Cells of a layer of a chart."""

    def __init__(self, chart: Any, cell: Any, half: Any) -> None:
        self.cell, self.half = cell, half
        self.rows, self.columns = (-(-side // cell) + 2 for side in chart)

    def centre(self, i: Any) -> Any:
        return 16 * self.cell * (i - 1) + (0 if self.half else 8 * self.cell)


class Box:
    """Rows r0 … r1 − 1, columns c0 … c1 − 1 of a layer's cells, with n placements; one may be known."""

    def __init__(self, layer: Any, chart: Any, place: Any, n: Any, known: Any = None) -> None:
        self.layer, self.chart, self.place, self.n, self.known = layer, chart, place, n, known
        r0, r1, c0, c1 = place
        assert 0 <= n <= (r1 - r0) * (c1 - c0)

    def has(self, row: Any, column: Any) -> Any:
        r0, r1, c0, c1 = self.place
        return r0 <= row < r1 and c0 <= column < c1


def decode(head: Any, placements: Any, labels: Any, charts: Any, exemplar: Any) -> Any:
    """Return, of each chart, its known placements and its maps, as (cell, half, rows of labels).

    Placements are dictionaries, in the order of their numbers. `charts` and `exemplar` are (height, width).
    """
    header = Head(head, charts)
    found = _placements(header, placements, exemplar)
    known = sum(map(len, found.values())) == sum(map(sum, header.counts))
    coder, out = PlainCoder(labels), []
    for chart in range(len(charts)):
        try:
            maps = [
                known and _labels(header, found, layer, chart, coder) for layer in range(len(header.grids))
            ]
        except EndError:
            known = False
        out.append((_numbered(found, chart), maps if known else _unlabelled(header, found, chart, exemplar)))
    return out


def _numbered(found: Any, chart: Any) -> Any:
    return [one for layer in (0, 1) for one in found.get((layer, chart), [])]


def _unlabelled(header: Any, found: Any, chart: Any, exemplar: Any) -> Any:
    """What a chart shows while not all of its labels are known. None: one placement in its middle."""
    if not found[0, chart]:
        return None
    first, *others = (grids[chart] for grids in header.grids)
    return [
        _nearest(first, found[0, chart], 0),
        *([[-1] * grid.columns for _ in range(grid.rows)] for grid in others),
    ]


def _placements(header: Any, data: Any, exemplar: Any) -> Any:
    """Return the known placements by layer and chart, in the order of their cells."""
    coder, lines, found = PlainCoder(data), {}, {}

    def wait(box: Any) -> None:
        r0, r1, c0, c1 = box.place
        steps = (r1 - r0) * (c1 - c0) * header.grids[box.layer][box.chart].cell ** 2
        lines.setdefault((box.layer, -steps.bit_length()), []).append(box)

    for layer, grids in enumerate(header.grids):
        for chart, grid in enumerate(grids):
            found[layer, chart] = []
            if header.counts[layer][chart]:
                wait(Box(layer, chart, (0, grid.rows, 0, grid.columns), header.counts[layer][chart]))
    try:
        while lines:
            first = min(lines)
            box = lines[first].pop(0)
            if not lines[first]:
                del lines[first]
            new = box.known is None
            box.known = box.known or _placement(coder, box, header, exemplar)
            halves = _cut(coder, box) if box.n > 1 else []
            if new:  # what a box tells counts when all of it is determined
                found[box.layer, box.chart].append(box.known)
            for half in halves:
                wait(half)
    except EndError:
        pass  # the bytes end within what a box tells
    return {key: sorted(some, key=lambda one: one["cell"]) for key, some in found.items()}


def _placement(coder: Any, box: Any, header: Any, exemplar: Any) -> Any:
    r0, r1, c0, c1 = box.place
    grid = header.grids[box.layer][box.chart]
    c = min(box.n, 4)
    row = (r0 + r1 - 1) // 2 + coder.number(0, c)
    assert r0 <= row < r1
    column = (c0 + c1 - 1) // 2 + coder.number(1, c)
    assert c0 <= column < c1
    bits = 1
    for _ in range(3):
        bits = 2 * bits + coder.bit(("quarter", bits))
    offset, source = [0] * 4, [0] * 2
    for k in range(4) if coder.bit("has") else ():
        offset[k] = 2**header.b * coder.number(2 + k, 0)
        assert abs(offset[k]) <= 2**18
    for i, size in enumerate(exemplar):
        source[i] = coder.plain(("bit", i), ((16 * size - 1) >> header.a).bit_length()) << header.a
        assert source[i] < 16 * size
    return {
        "cell": (row, column), "row": grid.centre(row), "column": grid.centre(column), "layer": box.layer,
        "symmetry": bits - 8, "offset": offset, "source_row": source[0], "source_column": source[1],
    }  # fmt: skip


def _cut(coder: Any, box: Any) -> Any:
    """The halves of a box: the one with the known placement, and the other, if it has any."""
    r0, r1, c0, c1 = box.place
    if r1 - r0 >= c1 - c0:
        middle = (r0 + r1) // 2
        places = [(r0, middle, c0, c1), (middle, r1, c0, c1)]
    else:
        middle = (c0 + c1) // 2
        places = [(r0, r1, c0, middle), (r0, r1, middle, c1)]
    m = box.n // 2 + coder.number(6, min(box.n, 5))
    assert 0 <= m < box.n
    with_known, other = places if Box(0, 0, places[0], 0).has(*box.known["cell"]) else places[::-1]
    halves = [Box(box.layer, box.chart, with_known, box.n - m, box.known)]
    return [*halves, Box(box.layer, box.chart, other, m)] if m else halves


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


def _labels(header: Any, found: Any, layer: Any, chart: Any, coder: Any) -> Any:
    grid, placed = header.grids[layer][chart], found[layer, chart]
    first = len(found[0, chart]) if layer else 0
    known = [[-layer] * grid.columns for _ in range(grid.rows)]
    if len(placed) == 1 - layer:
        return known
    nearest = _nearest(grid, placed, first)
    for i in range(grid.rows):
        for j in range(grid.columns):
            known[i][j] = _label(coder, grid, nearest, known, (i, j), (layer, first, len(placed)))
    return known


def _label(coder: Any, grid: Any, nearest: Any, known: Any, place: Any, named: Any) -> Any:
    i, j = place
    layer, first, count = named

    def at(a: Any, b: Any) -> Any:
        return known[i + a][j + b] if i + a >= 0 and 0 <= j + b < grid.columns else -2

    w, n, nw, ne = at(0, -1), at(-1, 0), at(-1, -1), at(-1, 1)
    v = nearest[i][j]
    right, below = nearest[i][min(j + 2, grid.columns - 1)], nearest[min(i + 2, grid.rows - 1)][j]
    equal = (w == n, w == nw, n == ne, n == nw, v == w, v == n, right == w, below == n)
    context = sum(2**k for k, each in enumerate(equal) if each)
    if layer and coder.bit(("is", 6, context)):
        return -1
    asked = []
    for k, candidate in enumerate((w, n, v, ne, right, below)):
        if candidate < 0 or candidate in asked:
            continue
        asked.append(candidate)
        if coder.bit(("is", k, context)):
            return candidate
    x = coder.plain("plain", (count - 1).bit_length())
    assert x < count
    return first + x
