"""The plan of method "quilt" (SPEC.md, sections 4, 5.5 and 5.6) in plain Python, written from the text."""

from collections import defaultdict
from types import SimpleNamespace
from typing import Any

import numpy as np
from plain_coder import PlainCoder, hashed
from plain_field import SYMMETRIES, displaced

GRID_NAMES = (
    *("rows", "across", "first_row", "first_column", "height", "width"),
    *("step_row", "step_column", "level", "mask_cell"),
)


def decode(reader: Any, sources: Any, masks: Any, charts: Any, exemplar: Any, fields: Any) -> Any:
    """Return placements and cells, as `plain_plan.decode`."""
    # Feather, and 32 where own blocks have symmetries.
    feather, order = reader.byte(), list(range(len(charts)))
    turned, feather = feather >= 32, feather % 32
    if more := reader.varint():
        order = [reader.varint() for _ in range(len(charts) + more - 1)]
    before: Any = dict(zip(GRID_NAMES, (1, 1, 20, 20, 40, 40, 28, 28, 0, 2), strict=True))
    grids = []
    for n in order:
        grid = _grid(reader, before, charts[n])
        before = {name: getattr(grid, name) for name in GRID_NAMES}
        grids.append(grid)
    reader.end()
    coder = PlainCoder(sources, None, 255)
    blocks: list[Any] = []
    starts: list[int] = []
    for n, grid in zip(order, grids, strict=True):
        starts.append(len(blocks))
        _chart_blocks(coder, blocks, starts, grid, n, charts[n], exemplar, fields[n], turned)
        for block in blocks[starts[-1] :]:
            block.chart, block.feather, block.mask_cell = n, feather, grid.mask_cell
    cells = _masks(masks, blocks, starts, order, charts)
    placed = [_placement(block) for n in range(len(charts)) for block in blocks if block.chart == n]
    return placed, cells, [block.link for block in blocks]


def _grid(reader: Any, before: Any, chart: Any) -> Any:
    changed = reader.varint()
    change = {name: reader.zigzag() if changed >> k & 1 else 0 for k, name in enumerate(GRID_NAMES)}
    grid = SimpleNamespace(**{name: before[name] + change[name] for name in GRID_NAMES})
    for count, size, first, extent, step in (
        ("rows", chart[0], grid.first_row, grid.height, grid.step_row),
        ("across", chart[1], grid.first_column, grid.width, grid.step_column),
    ):
        guess = max(1, 1 + -(-(size - first + extent // 2 - extent) // step))
        setattr(grid, count, guess + change[count])
    grid.transferred, skipped = reader.varint(), reader.varint()
    grid.own = grid.rows * grid.across - skipped
    return grid


def _placement(block: Any) -> Any:
    cut = bool(block.cut)
    return {
        "chart": block.chart,
        "row": block.row,
        "column": block.column,
        "height": block.height,
        "width": block.width,
        "source_row": block.source[0],
        "source_column": block.source[1],
        "symmetry": block.symmetry,
        "mask": 2 * cut,
        "sides": 0,
        "ramp": 0,
        "mask_cell": block.mask_cell if cut else 0,
        "feather": block.feather if cut else 0,
        "first_cell": block.first_cell if cut else -1,
        "centred": int(block.centred),
        "matrix": block.c if block.centred else [0] * 4,
    }


def _chart_blocks(
    coder: Any,
    blocks: Any,
    starts: Any,
    grid: Any,
    n: Any,
    chart: Any,
    exemplar: Any,
    field: Any,
    turned: Any,
) -> None:
    # Section 5.5: a chart's blocks, appended to `blocks`.
    base = len(blocks)
    near: dict[tuple[int, int], int] = defaultdict(lambda: -1)
    for _ in range(grid.transferred):
        block = _transferred(coder, blocks, starts, grid, n, field, turned)
        blocks.append(block)
        i = (block.row - grid.first_row + grid.step_row // 2) // grid.step_row + 1
        j = (block.column - grid.first_column + grid.step_column // 2) // grid.step_column + 1
        near[max(0, min(grid.rows + 1, i)), max(0, min(grid.across + 1, j))] = len(blocks) - 1
    first_own = len(blocks)

    def owner(n: Any) -> Any:
        return 0 if n < 0 else 1 if n < first_own else 2

    for i in range(1, grid.rows + 1):
        for j in range(1, grid.across + 1):
            rim = i in (1, grid.rows) or j in (1, grid.across)
            beside = owner(near[i, j - 1]), owner(near[i - 1, j]), owner(near[i, j])
            if not coder.bit([("skip", *beside, rim)], 55):
                continue
            block = _own(coder, blocks, base, grid, exemplar, field, near, i, j, turned)
            block.chart = n
            near[i, j] = len(blocks)
            blocks.append(block)
    assert len(blocks) - first_own == grid.own
    assert chart  # its size is told by the grid alone


def _transferred(coder: Any, blocks: Any, starts: Any, grid: Any, n: Any, field: Any, turned: Any) -> Any:
    base = starts[-1]
    before = blocks[-1] if len(blocks) > base else None
    further = blocks[-2] if len(blocks) > base + 1 else None
    link = _link(coder, starts, [block.link for block in blocks[base:]])
    block = SimpleNamespace(link=link, chart=n, mode=7, agrees=0, own=False)
    a = blocks[link] if link >= 0 else None
    m = _nearest(blocks, base, a)
    e = blocks[m.link] if m else None
    last = 0

    def told(f: Any, guess: Any) -> Any:
        nonlocal last
        value = coder.number(f if m else 11 + f, 2 * (a is None) + last)
        last = int(value != 0)
        return guess + value

    guess = before.symmetry if before else 0
    if turned and a:
        guess = _alike(a.symmetry, e.symmetry, m.symmetry) if m else a.symmetry
    block.symmetry = told(4, guess)
    place = _place(a, m, e, field) if m else None
    block.row = told(0, _centre_guess(before, further, place, 0))
    block.column = told(1, _centre_guess(before, further, place, 1))
    here = field.at(block.row, block.column)
    block.c, block.centred = here, coder.bit(["centred"], 55)
    if block.centred:
        block.c = [entry + 64 * coder.number(10, min(k, 1)) for k, entry in enumerate(here)]
    block.tc = _turned(block)
    source = (0, 0)
    if a:
        source = a.source
        if place:
            y, x = 64 * block.row - place[0], 64 * block.column - place[1]
            p, q, r, t = block.tc
            source = source[0] + ((p * y + q * x + 8192) >> 14), source[1] + ((r * y + t * x + 8192) >> 14)
        source = tuple(4 * ((at + 2) // 4) for at in source)
    elif before:
        source = _goes_on(before, block.row, block.column, field)
    block.source = told(6, source[0]), told(7, source[1])
    y, x = (here - there for here, there in zip(block.source, a.source if a else block.source, strict=True))
    down, right = _steps(block.tc, y, x, 2**14, 0)
    block.place = 64 * block.row - down, 64 * block.column - right
    sizes = (grid.height, grid.width) if before is None else (before.height, before.width)
    if a:
        sizes = tuple(_extent(block, a, grid.mask_cell, axis) for axis in (0, 1))
    block.height, block.width = told(2, sizes[0]), told(3, sizes[1])
    block.cut = told(5, before.cut if before else 1)
    return block


def _link(coder: Any, starts: Any, links: Any) -> Any:
    order = len(starts) - 1
    link = links[-1] if links else -1
    back = 0
    if link >= 0:
        back = next(k for k in range(1, order + 1) if starts[order - k] <= link)
        first, end = starts[order - back], starts[order - back + 1]
        last: list[Any] = []
        for one in links[:-5:-1]:
            if not first <= one < end:
                break
            last.append(one)
        usual = 0 if len(last) < 4 else 1 if last[0] - last[1] == last[2] - last[3] else 2
        steps = [last[1] - last[2] if len(last) > 2 else 0, last[0] - last[1] if len(last) > 1 else 0, 1]
        for which, step in enumerate(steps):
            known = step != 0 and step not in steps[:which] and first <= link + step < end
            if known and coder.bit([("run", which, usual)], 55):
                return link + step
    k = back + coder.number(8, int(link >= 0))
    if k == 0:
        return -1
    guess = link if k == back else starts[order - k]
    return guess + coder.number(9, int(k == back))


def _nearest(blocks: Any, base: Any, a: Any) -> Any:
    # m: of the latest 16 transferred blocks that whose own block lay nearest to `a`, on its chart.
    found, least = None, 2**40
    for m in blocks[max(base, len(blocks) - 16) :][::-1]:
        if a is None or m.link < 0 or blocks[m.link].chart != a.chart:
            continue
        e = blocks[m.link]
        apart = abs(a.row - e.row) + abs(a.column - e.column)
        if apart < least:
            found, least = m, apart
    return found


def _steps(matrix: Any, y: Any, x: Any, factor: Any, shift: Any) -> Any:
    p, q, r, s = matrix
    d = (p * s - q * r) >> shift
    found = []
    for n in (factor * (s * y - q * x), factor * (p * x - r * y)):
        share = 0 if d == 0 else (2 * n + d) // (2 * d) if d > 0 else (-2 * n - d) // (-2 * d)
        found.append(max(-(2**24), min(2**24, share)))
    return found


def _place(a: Any, m: Any, e: Any, field: Any) -> Any:
    down, right = a.row - e.row, a.column - e.column
    both = [there + here for there, here in zip(a.c, e.c, strict=True)]
    p, q, r, s = _turned(SimpleNamespace(symmetry=e.symmetry, c=both))
    y, x = (p * down + q * right) >> 6, (r * down + s * right) >> 6
    far = _steps(m.tc, y, x, 16, 7)
    here = field.at((m.place[0] + far[0] + 32) >> 6, (m.place[1] + far[1] + 32) >> 6)
    mean = SimpleNamespace(symmetry=m.symmetry, c=[one + two for one, two in zip(m.c, here, strict=True)])
    far = _steps(_turned(mean), y, x, 8, 9)
    return m.place[0] + far[0], m.place[1] + far[1]


def _alike(t: Any, e: Any, b: Any) -> Any:
    # T·E⁻¹·B
    one, other, third = (np.array(SYMMETRIES[n]).reshape(2, 2) for n in (t, e, b))
    found = one @ np.linalg.inv(other) @ third
    return next(n for n, s in enumerate(SYMMETRIES) if np.allclose(found.reshape(-1), s))


def _centre_guess(before: Any, further: Any, place: Any, axis: Any) -> Any:
    if place:
        return (place[axis] + 32) >> 6
    if before is None:
        return 0
    here = (before.row, before.column)[axis]
    return 2 * here - (further.row, further.column)[axis] if further else here


def _extent(block: Any, a: Any, cell: Any, axis: Any) -> Any:
    p, q, r, s = block.tc
    u, v = (r, p) if axis else (s, q)
    extent = abs(u * a.tc[0] - v * a.tc[2]) * a.height + abs(u * a.tc[1] - v * a.tc[3]) * a.width
    count = extent // max(1, abs(p * s - q * r)) // cell + 6
    # TC_a's inverse times TC_n, times its determinant.
    a00, a01, a10, a11 = (int(entry) for entry in a.tc)
    area = a00 * a11 - a01 * a10
    both = (np.array([[a11, -a01], [-a10, a00]]) @ np.array([[p, q], [r, s]])).tolist()
    by, aside = both[axis][axis], both[axis][1 - axis]
    if 2 * abs(by) > abs(aside) and (by >> 4) != 0:
        half = 2 * ((a.width if axis else a.height) // 2) + 1
        number, by = 32 * half * (area >> 4), by >> 4
        number, by = (-number, -by) if by < 0 else (number, by)
        border = block.place[axis] - 64 * (block.row, block.column)[axis] - (2 * number + by) // (2 * by)

        def off(cells: Any) -> Any:
            apart = (border + 64 * (cells * cell // 2) + 32) % (64 * cell)
            return min(apart, 64 * cell - apart)

        count += off(count + 1) < off(count)
    return min(4096, count * cell)


def _turned(block: Any) -> Any:
    s0, s1, s2, s3 = SYMMETRIES[block.symmetry]
    c = block.c
    return [s0 * c[0] + s1 * c[2], s0 * c[1] + s1 * c[3], s2 * c[0] + s3 * c[2], s2 * c[1] + s3 * c[3]]


def _goes_on(block: Any, row: Any, column: Any, field: Any) -> Any:
    y, x = displaced(block.c, field.at(row, column), row - block.row, column - block.column)
    s0, s1, s2, s3 = SYMMETRIES[block.symmetry]
    return block.source[0] + s0 * y + s1 * x, block.source[1] + s2 * y + s3 * x


def _own(
    coder: Any,
    blocks: Any,
    base: Any,
    grid: Any,
    exemplar: Any,
    field: Any,
    near: Any,
    i: Any,
    j: Any,
    turned: Any,
) -> Any:
    row = grid.first_row + (i - 1) * grid.step_row
    column = grid.first_column + (j - 1) * grid.step_column
    block = SimpleNamespace(
        row=row, column=column, height=grid.height, width=grid.width, symmetry=0, link=-1, centred=0, own=True
    )
    block.cut = coder.bit([("mask", len(blocks) > base)], 55)
    beside = [blocks[n].symmetry if n >= 0 else None for n in (near[i, j - 1], near[i - 1, j])]
    if turned:
        block.symmetry = _own_symmetry(coder, *beside)
    block.c = field.at(row, column)
    block.tc = _turned(block)
    around = [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1), (i - 1, j + 1), (i - 1, j - 1)]
    third = next((near[place] for place in around if near[place] >= 0), -1)
    suggested: list[Any] = []
    for n in (near[i, j - 1], near[i - 1, j], third):
        at = None
        if n >= 0 and blocks[n].symmetry == block.symmetry:
            at = _goes_on(blocks[n], row, column, field)
            if not all(0 <= p < 16 * size for p, size in zip(at, exemplar, strict=True)):
                at = None
        suggested.append(None if len(suggested) == 2 and at in suggested else at)

    def mode(place: Any) -> Any:
        return blocks[near[place]].mode if near[place] >= 0 else 7

    unit = 16 << grid.level
    modes = mode((i, j - 1)), mode((i - 1, j)), mode((i - 1, j - 1)), mode((i - 1, j + 1))
    block.mode, block.source = _source(coder, block, suggested, modes, exemplar, grid.level)
    block.agrees = 0
    for bit, at in ((1, suggested[0]), (2, suggested[1])):
        if at and max(abs(p - q) for p, q in zip(at, block.source, strict=True)) <= unit:
            block.agrees += bit
    assert all(0 <= p < 16 * size for p, size in zip(block.source, exemplar, strict=True))
    return block


def _own_symmetry(coder: Any, left: Any, top: Any) -> Any:
    if left is not None:
        sort = "left alone" if top is None else "left as top" if top == left else "left or top"
        if coder.bit([sort], 55):
            return left
    if top is not None and top != left and coder.bit(["top"], 55):
        return top
    node = 1
    for _ in range(3):
        node = 2 * node + coder.bit([("turn", node)], 55)
    return node - 8


def _source(coder: Any, block: Any, suggested: Any, modes: Any, exemplar: Any, level: Any) -> Any:
    # Mode and source of an own block.
    unit = 16 << level

    def pixel(p: Any) -> Any:
        return (p + 8) >> (4 + level)

    def at(p: Any) -> Any:
        return ((16 * p + 8) << level) - 8

    def inside(place: Any) -> Any:
        c = block.tc
        extents = (
            (abs(c[0]) * block.height + abs(c[1]) * block.width) >> 9,
            (abs(c[2]) * block.height + abs(c[3]) * block.width) >> 9,
        )
        room = min(
            min(p - extent, 16 * (size - 1) - p - extent)
            for p, extent, size in zip(place, extents, exemplar, strict=True)
        )
        return 2 if room >= unit else 1 if room >= -unit else 0

    left, top, _ = suggested
    apart = 3
    if left and top:
        distance = max(abs(p - q) for p, q in zip(left, top, strict=True))
        apart = 0 if distance == 0 else 1 if distance <= 3 * unit else 2
    for t in range(6):
        g, place = t % 3, suggested[t % 3]
        if place is None or (t == 1 and apart == 0):
            continue
        where = inside(place)
        inputs = [("A", t, *modes[:2], apart, where), ("B", t, apart, where), ("C", t, *modes[2:])]
        if not coder.bit(inputs, 56 + t):
            continue
        if t < 3:
            return 1 + t, place
        found: list[int] = []
        moved: list[int] = []
        for axis in (0, 1):
            node = 1
            for _ in range(3):
                node = 2 * node + coder.bit([("D", g, axis, moved[0] if axis else 0, node)], 62 + axis)
            moved.append(node - 8)
            found.append(at(pixel(place[axis]) + moved[axis] - 3))
        return 1 + t, tuple(found)
    if coder.bit(["off"], 68):
        values = [0, 0]
        for axis in (0, 1):
            for bit in range(19, -1, -1):
                values[axis] += coder.bit([("plain", axis, bit)], 68) << bit
        return 0, tuple(values)
    beside = [1 + (pixel(p[0]) >> 2) * 1024 + (pixel(p[1]) >> 2) if p else 0 for p in (left, top)]
    pixels: list[int] = []
    for axis in (0, 1):
        bits, node = pixel(16 * (exemplar[axis] - 1)).bit_length(), 1
        for _ in range(bits):
            place = node + 4096 * (1 + pixels[0]) if axis else node
            inputs = [
                ("T", axis, node & 2047),
                ("A'", hashed(place, beside[0], 0)),
                ("B'", hashed(place, beside[1], 7)),
                ("C'", hashed(place, beside[0], beside[1] + 19)),
            ]
            node = 2 * node + coder.bit(inputs, 64 + 2 * axis + any(beside))
        pixels.append(node - 2**bits)
    return 0, (at(pixels[0]), at(pixels[1]))


class Mask:
    """A cut block's cells: those of its window, whether they are new, and what is told of them."""

    def __init__(self, block: Any, chart: Any) -> None:
        self.block, cell = block, block.mask_cell
        self.top, self.left = block.row - block.height // 2, block.column - block.width // 2
        self.shape = -(-block.height // cell), -(-block.width // cell)
        self.window = []
        for low, count, size in zip((self.top, self.left), self.shape, chart, strict=True):
            first = max(0, min(count, (-block.feather - low) // cell))
            end = max(first, min(count, -(-(size + block.feather - low) // cell)))
            self.window.append(range(first, end))
        self.new: dict[tuple[int, int], int] = {}

    def places(self) -> Any:
        return [(i, j) for i in self.window[0] for j in self.window[1]]

    def in_block(self, i: Any, j: Any) -> Any:
        return 0 <= i < self.shape[0] and 0 <= j < self.shape[1]

    def seen(self, i: Any, j: Any) -> Any:
        return i in self.window[0] and j in self.window[1]

    def at(self, i: Any, j: Any) -> Any:
        """Whether a cell is new, of those that are known."""
        if not self.in_block(i, j):
            return 0
        return self.new.get((i, j), 0) if self.seen(i, j) else 1

    def texels(self, i: Any, j: Any) -> Any:
        """A cell's rows and columns of texels on the chart's grid."""
        cell, block = self.block.mask_cell, self.block
        down = range(self.top + i * cell, self.top + min(block.height, (i + 1) * cell))
        right = range(self.left + j * cell, self.left + min(block.width, (j + 1) * cell))
        return down, right


def _masks(data: Any, blocks: Any, starts: Any, order: Any, charts: Any) -> Any:
    # Section 5.6: all cells; blocks get their `first_cell` and `mask`.
    coder = PlainCoder(data, 24030, 400)
    coder.weights[64] = [72090]
    cells: list[int] = []
    all_covered: Any = defaultdict(set)
    for place, n in enumerate(order):
        covered = all_covered[n]
        end = starts[place + 1] if place + 1 < len(starts) else len(blocks)
        for block in blocks[starts[place] : end]:
            mask = block.mask = Mask(block, charts[n])
            if block.cut:
                block.first_cell = len(cells)
                known, under = _judged(mask, covered, charts[n])
                _mask(coder, blocks, mask, known, under)
                cells += [mask.new[at] for at in mask.places()]
            if block.own or not block.cut:
                down, right = (
                    range(mask.top, mask.top + block.height),
                    range(mask.left, mask.left + block.width),
                )
                covered |= _inside(down, right, charts[n])
                continue
            for i, j in mask.places():
                round_it = [(i + a, j + b) for a in (-1, 0, 1) for b in (-1, 0, 1)]
                sure = all(mask.in_block(*at) and (mask.at(*at) or under.get(at)) for at in round_it)
                if mask.new[i, j] and sure:
                    covered |= _inside(*mask.texels(i, j), charts[n])
    return cells


def _inside(down: Any, right: Any, chart: Any) -> Any:
    return {(r, c) for r in down if 0 <= r < chart[0] for c in right if 0 <= c < chart[1]}


def _judged(mask: Any, covered: Any, chart: Any) -> Any:
    # Which cells are new, next or held before they are coded; and which lie over something covered.
    known, under = {}, {}
    for i, j in mask.places():
        down, right = mask.texels(i, j)
        corner = down[0], right[0]
        on_chart = 0 <= corner[0] < chart[0] and 0 <= corner[1] < chart[1]
        under[i, j] = int(corner in covered or not on_chart)
        if mask.block.own and not _inside(down, right, chart) <= covered:
            known[i, j] = "new"
    if not mask.block.own:
        return known, under
    for i, j in mask.places():
        if (i, j) in known:
            continue
        if any(known.get((i + a, j + b)) == "new" for a in (-1, 0, 1) for b in (-1, 0, 1)):
            known[i, j] = "next"
            continue
        row = min(max(mask.top + i * mask.block.mask_cell, 0), chart[0] - 1)
        column = min(max(mask.left + j * mask.block.mask_cell, 0), chart[1] - 1)
        beyond = []
        if i == 0:
            beyond.append((mask.top - 1, column))
        if i == mask.shape[0] - 1:
            beyond.append((mask.top + mask.block.height, column))
        if j == 0:
            beyond.append((row, mask.left - 1))
        if j == mask.shape[1] - 1:
            beyond.append((row, mask.left + mask.block.width))
        if any(texel in covered for texel in beyond):
            known[i, j] = "held"
    return known, under


def _mask(coder: Any, blocks: Any, mask: Any, known: Any, under: Any) -> None:
    own = mask.block.own
    odd = own and coder.bit(["odd"], 64)

    def certain(i: Any, j: Any) -> Any:
        # Where a cell is new or next; beyond the window all are.
        if not mask.in_block(i, j):
            return False
        return not mask.seen(i, j) or known.get((i, j)) in ("new", "next")

    if not odd:
        for at in mask.places():
            if certain(*at):
                mask.new[at] = 1
    for i, j in mask.places():
        if not odd and certain(i, j):
            continue
        w, n, nw, ne = mask.at(i, j - 1), mask.at(i - 1, j), mask.at(i - 1, j - 1), mask.at(i - 1, j + 1)
        near = w + 2 * n + 4 * nw + 8 * ne
        shape = (near, mask.at(i, j - 2), mask.at(i - 2, j), mask.at(i - 1, j + 2))
        sides = certain(i, j + 1), certain(i + 1, j), certain(i + 1, j - 1)
        right = down = 0
        while right < 7 and mask.in_block(i, j + right + 1) and not certain(i, j + right + 1):
            right += 1
        while down < 7 and mask.in_block(i + down + 1, j) and not certain(i + down + 1, j):
            down += 1
        sort = mask.block.agrees if own else _linked(blocks, mask, i, j)
        h = known.get((i, j)) == "held" if own else under[i, j]
        k = 0 if own else 1
        inputs = [
            ("I", k, *shape, *sides, sort),
            ("J", k, min(i, 31), min(j, 31), w, n, sort),
            ("K", k, right, down, near, sort),
        ]
        mask.new[i, j] = coder.bit(inputs, ("cells", k, near, int(h)))


def _linked(blocks: Any, mask: Any, i: Any, j: Any) -> Any:
    # What a transferred block shows in a cell of the one that it comes from.
    block = mask.block
    if block.link < 0:
        return 3
    a, cell = blocks[block.link], block.mask_cell
    down = 2 * (mask.top + i * cell - block.row) + cell - 1
    right = 2 * (mask.left + j * cell - block.column) + cell - 1
    y = (block.tc[0] * down + block.tc[1] * right) >> 4
    x = (block.tc[2] * down + block.tc[3] * right) >> 4
    p, q, r, s = a.tc
    area = p * s - q * r
    if area < 0:
        area, y, x = -area, -y, -x
    area >>= 4
    if area == 0:
        return 3
    row = a.height // 2 + (s * y - q * x + area) // (2 * area)
    column = a.width // 2 + (p * x - r * y + area) // (2 * area)
    if not (0 <= row < a.height and 0 <= column < a.width):
        return 0
    return 1 + a.mask.at(row // a.mask_cell, column // a.mask_cell) if a.cut else 2
