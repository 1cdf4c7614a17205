"""Plans (SPEC.md, sections 4, 5.2 to 5.4) in plain Python, written from the text: an oracle of the decoders.

`decode` reads a whole plan: placements as dictionaries, chart after chart, and the cells of their windows.
`plain_grid` has the plan of method "quilt".
"""

from collections import defaultdict
from typing import Any

import plain_grid
from plain_coder import PlainBytes, PlainCoder, hashed
from plain_field import SYMMETRIES

NAMES = (
    *("row", "column", "height", "width", "symmetry", "mask", "sides", "ramp", "mask_cell", "feather"),
    *("source_row", "source_column", "first_cell", "centred"),
)


def decode(plan: Any, sources: Any, masks: Any, charts: Any, exemplar: Any, fields: Any) -> Any:
    """Return placements and cells; `charts` and `exemplar` are (height, width), `fields` PlainFields."""
    reader = PlainBytes(plan)
    kind = reader.byte()
    if kind == 2:
        return plain_grid.decode(reader, sources, masks, charts, exemplar, fields)
    if kind == 1:
        return _strips(reader, sources, masks, charts, exemplar)
    return _list(reader, sources, masks, charts, fields, fine=kind == 3)


def _list(reader: Any, sources: Any, masks: Any, charts: Any, fields: Any, *, fine: Any) -> Any:
    counts, total = [reader.varint() for _ in charts], reader.varint()
    reader.end()
    coder = PlainCoder(sources, None, 255)
    placed: list[Any] = []
    before, following = dict.fromkeys([*NAMES, *range(4)], 0), 0
    for chart, count in enumerate(counts):
        for _ in range(count):
            one = _record(coder, before if placed else None, following, fields[chart], fine)
            before, placed = one, [*placed, one | {"chart": chart}]
            if one["mask"] == 2:
                rows, columns = window(one, charts[chart])
                following = one["first_cell"] + len(rows) * len(columns)
    for one in placed:
        one["matrix"], one["centred"] = [one.pop(k) for k in range(4)], min(1, one["centred"])
        if not fine:
            one["source_row"], one["source_column"] = 16 * one["source_row"], 16 * one["source_column"]
    cut = sorted((one for one in placed if one["mask"] == 2), key=lambda one: one["first_cell"])
    shapes, end = [], 0
    for one in cut:
        rows, columns = window(one, charts[one["chart"]])
        end = end + len(rows) * len(columns) if end == one["first_cell"] else -1
        shapes.append((len(rows), len(columns), 0))
    if end != total or not cut:
        shapes = [(1, total, 0)]
    return placed, coded_masks(masks, shapes) if total else []


def _record(coder: Any, before: Any, following: Any, field: Any, fine: Any) -> Any:
    # Section 5.3: a placement's fields.
    one: Any = dict.fromkeys([*NAMES, *range(4)], 0)
    differed = [0, 0]
    for f, name in enumerate([*NAMES, *range(4)][: 18 if fine else 13]):
        if f > 13 and not one["centred"]:
            break
        guess = before[name] if before else 0
        if before and f in (10, 11):
            place = ("row", "column")[f - 10]
            guess += (16 if fine else 1) * (one[place] - before[place])
        if f == 12:
            guess = following if one["mask"] == 2 else -1
        unit = 1
        if f > 13 and one["centred"] == 2:
            guess, unit = field.at(one["row"], one["column"])[f - 14], 64
        value = coder.number(f, 2 * differed[-2] + differed[-1])
        differed.append(int(value != 0))
        one[name] = guess + unit * value
    return one


def window(one: Any, chart: Any) -> Any:
    """Section 4: the rows and the columns of cells that a chart can show."""
    out = []
    for at, extent, size in (("row", "height", chart[0]), ("column", "width", chart[1])):
        low, cell, feather = one[at] - one[extent] // 2, one["mask_cell"], one["feather"]
        count = -(-one[extent] // cell)
        first = max(0, min(count, (-feather - low) // cell))
        out.append(range(first, max(first, min(count, -(-(size + feather - low) // cell)))))
    return out


def coded_masks(data: Any, shapes: Any) -> Any:
    """Section 5.4: masks of (rows, columns, z), one after another, as one flat list."""
    coder = PlainCoder(data, 24030, 400)
    out = []
    for rows, columns, z in shapes:
        mask: dict[tuple[int, int], int] = defaultdict(int)
        for i in range(rows):
            for j in range(columns):
                w, n, nw, ne = mask[i, j - 1], mask[i - 1, j], mask[i - 1, j - 1], mask[i - 1, j + 1]
                near = w + 2 * n + 4 * nw + 8 * ne
                around = near + 16 * mask[i, j - 2] + 32 * mask[i - 2, j]
                end = 0 if i == 0 else 2 if i == rows - 1 else 1
                inputs = [
                    ("I", min(i, 63), min(j, 63), z, w, n),
                    ("J", around, min(15, 16 * j // columns), i == 0),
                    ("K", near, min(j, 63), end),
                ]
                mask[i, j] = coder.bit(inputs, i == 0)
        out += [mask[i, j] for i in range(rows) for j in range(columns)]
    return out


def _strips(reader: Any, sources: Any, masks: Any, charts: Any, exemplar: Any) -> Any:
    block, overlap, tile = reader.varint(), reader.varint(), 2 ** reader.byte()
    strips, cell, feather, edge = [], 0, 0, block
    count = reader.varint()
    if count:
        edge = reader.varint()
        cell, feather = reader.byte(), reader.byte()
    for _ in range(count):
        head, a, b = reader.byte(), reader.varint(), reader.varint()
        edge_a, edge_b, opposed, partial = head & 3, head >> 2 & 3, head >> 4 & 1, head >> 5
        start, length, other = 0, charts[a][edge_a in (0, 2)], 0
        if partial:
            start, length, other = reader.varint(), reader.varint(), reader.varint()
        strips.append((edge_a, edge_b, opposed, a, b, start, length, other))
    reader.end()
    step, half, side = block - overlap, block // 2, edge // cell if cell else 0

    def n(x: Any, size: Any = block) -> Any:
        return max(1, -(-(x - overlap) // (size - overlap)))

    grids = [[(length - size) // tile + 1 for length in exemplar] for size in (block, edge)]
    runs = [(n(height) * n(width), n(width), 0) for height, width in charts]
    runs += [(n(s[6], edge), 1 if s[0] in (1, 3) else n(s[6], edge), 1) for s in strips]
    jumps = [max(1, (size - overlap) // tile) for size in (block, edge)]
    chosen = iter(strip_sources(sources, runs, jumps, grids))

    def source(strip: Any = 0) -> Any:
        i, j = divmod(next(chosen), grids[strip][1])
        middle = (half, edge // 2)[strip]
        return 16 * (i * tile + middle), 16 * (j * tile + middle)

    on_chart: list[list[Any]] = [[] for _ in charts]
    for chart, (height, width) in enumerate(charts):
        for r in range(n(height)):
            for c in range(n(width)):
                on_chart[chart].append(
                    _block(chart, (r * step + half, c * step + half), block, source())
                    | {"mask": 1 if r or c else 0, "ramp": overlap, "sides": (r > 0) + 2 * (c > 0)}
                )
    shapes = []
    for s in strips:
        shapes += [(side, side, (k == 0) + 2 * (k == n(s[6], edge) - 1)) for k in range(n(s[6], edge))]
    coded = coded_masks(masks, shapes) if shapes else []
    for s in strips:
        pairs = []
        for k in range(n(s[6], edge)):
            along = s[5] + min(k * (edge - overlap), s[6] - edge) + edge // 2
            line = (0, charts[s[3]][1], charts[s[3]][0], 0)[s[0]]
            centre = (along, line) if s[0] in (1, 3) else (line, along)
            mask = [coded[i * side : (i + 1) * side] for i in range(side)]
            coded = coded[side * side :]
            if s[0] in (0, 2):
                mask = [list(row) for row in zip(*mask, strict=True)]
            one = _block(s[3], centre, edge, source(1))
            one |= {"mask": 2, "mask_cell": cell, "feather": feather}
            pairs.append((one | {"cells": mask}, _seen_from_b(one, mask, s, charts, edge, cell)))
        on_chart[s[3]] += [a for a, _ in pairs]
        on_chart[s[4]] += [b for _, b in pairs]
    placed, cells = [one for part in on_chart for one in part], []
    for one in placed:
        if one["mask"] == 2:
            mask = one.pop("cells")
            one["first_cell"] = len(cells)
            down, right = window(one, charts[one["chart"]])
            cells += [mask[i][j] for i in down for j in right]
    return placed, cells


def _block(chart: Any, centre: Any, block: Any, source: Any) -> Any:
    one: Any = dict.fromkeys(NAMES, 0) | {"chart": chart, "first_cell": -1, "matrix": [0] * 4}
    one["row"], one["column"] = centre
    one["height"] = one["width"] = block
    one["source_row"], one["source_column"] = source
    return one


def _to_b(row: Any, column: Any, strip: Any, charts: Any) -> Any:
    # A texel of a's grid beyond the edge, in b's.
    edge_a, edge_b, opposed, a, b, start, length, other = strip
    (height_a, width_a), (height_b, width_b) = charts[a], charts[b]
    depth = (-1 - row, column - width_a, row - height_a, -1 - column)[edge_a]
    along = (row if edge_a in (1, 3) else column) - start
    there = other + (length - 1 - along if opposed else along)
    return (
        (depth, there),
        (there, width_b - 1 - depth),
        (height_b - 1 - depth, there),
        (there, depth),
    )[edge_b]


def _seen_from_b(one: Any, mask: Any, strip: Any, charts: Any, block: Any, cell: Any) -> Any:
    # The same texels and cells in b's grid, with the symmetry that shows the same pixels.
    top, left = one["row"] - block // 2, one["column"] - block // 2
    origin, far = (_to_b(top + k, left + k, strip, charts) for k in (0, block - 1))
    corner = min(origin[0], far[0]), min(origin[1], far[1])
    turned = [[0] * len(mask) for _ in mask]
    for i in range(len(mask)):
        for j in range(len(mask)):
            r, c = _to_b(top + i * cell, left + j * cell, strip, charts)
            turned[(r - corner[0]) // cell][(c - corner[1]) // cell] = mask[i][j]
    out = one | {
        "chart": strip[4],
        "row": corner[0] + block // 2,
        "column": corner[1] + block // 2,
        "cells": turned,
    }
    for symmetry, (s0, s1, s2, s3) in enumerate(SYMMETRIES):
        # Where b's centre must read, told by three texels: the same for all with one symmetry alone.
        wanted = set()
        for i, j in ((0, 0), (1, 0), (0, 1)):
            r, c = _to_b(top + i, left + j, strip, charts)
            y, x = r - out["row"], c - out["column"]
            seen = one["source_row"] + 16 * (i - block // 2), one["source_column"] + 16 * (j - block // 2)
            wanted.add((seen[0] - 16 * (s0 * y + s1 * x), seen[1] - 16 * (s2 * y + s3 * x)))
        if len(wanted) == 1:
            ((out["source_row"], out["source_column"]),) = wanted
            return out | {"symmetry": symmetry}
    raise AssertionError("no symmetry fits")


def strip_sources(data: Any, runs: Any, jumps: Any, grids: Any) -> Any:
    """Section 5.2: candidates of runs (blocks, blocks across, 1 for strips)."""
    coder = PlainCoder(data, 18022, 255)
    out = []
    for count, across, strip in runs:
        jump, (rows, columns) = jumps[strip], grids[strip]
        found: list[int] = []
        modes: list[int] = []
        for n in range(count):
            left, left_mode = (found[n - 1], modes[n - 1]) if n % across else (-1, 3)
            top, top_mode = (found[n - across], modes[n - across]) if n >= across else (-1, 3)
            onward = left + jump if left >= 0 and left % columns + jump < columns else -1
            downward = top + jump * columns if top >= 0 and top + jump * columns < rows * columns else -1
            equal = onward == downward
            choice, mode = None, 0
            for side, guess in ((0, onward), (1, downward)):
                if choice is None and guess >= 0 and not (side and equal):
                    flag = ("F", strip, side, left_mode, top_mode, equal)
                    if coder.bit([flag, ("B", hashed(left, top, 5000 + side))], (strip, side)):
                        choice, mode = guess, side + 1
            if choice is None:
                state = (left, top, strip, onward >= 0, downward >= 0)
                choice = _candidate(
                    coder, (rows - 1).bit_length(), (columns - 1).bit_length(), columns, *state
                )
            found.append(choice)
            modes.append(mode)
        out += found
    return out


def _candidate(
    coder: Any, bits_row: Any, bits_column: Any, columns: Any, left: Any, top: Any, s: Any, on: Any, down: Any
) -> Any:
    node, row = 1, 0
    for b in range(bits_row + bits_column):
        if b == bits_row:
            row, node = node - 2**bits_row, 1
        second = b >= bits_row
        place = node + 4096 * (1 + row) if second else node
        inputs = [
            ("T", second, node & 2047),
            ("A", hashed(place, left + 1, s)),
            ("B", hashed(place, top + 1, 7 + s)),
            ("C", hashed(place, left + 1, top + 19)),
        ]
        node = 2 * node + coder.bit(inputs, (s, "tree", on, down, second))
    if bits_column == 0:
        row, node = node - 2**bits_row, 1
    return row * columns + node - 2**bits_column
