"""Fits of a block's sheets: the centre, source and centre matrix by which each sheet reads the exemplar.

Texel q of a sheet's chart reads at ``s + ½(C + Q·M(q))(q − c)``. M is the chart's warp field, and Q the
quarter turns from it to the block's directions. On the sheet with the block's centre, C and s are fitted to
the block map, with C held near Q·M there. On any other sheet they are fitted to the settled sheets along
common seams, and with less weight to the block map. There C is held near ``C_A·T⁻¹``: the centre matrix
across the seam, transformed by the seam's transition.
All quantities are in steps and frame pixels.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, shared
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint, MeshArrays

__all__ = [
    "FIT",
    "FIT_PLACE",
    "FIT_TURNS",
    "MOST_SHEETS",
    "FieldArrays",
    "SheetScratch",
    "enter_fit",
    "field_at",
    "fit_block",
    "shown_at",
    "turned",
]

MOST_SHEETS = 24
"""Maximum number of sheets of a block: further ones are left out."""

FIT = 11
"""Number of values of a fitted sheet: 1 if it is settled or −1 if it cannot be, chart, c (2), s (2), C (4),
turns."""

FIT_PLACE, FIT_TURNS = slice(2, 4), 10
"""The columns of c and of the turns in a fit."""

_HELD = 30.0
"""Weight that holds C near its first guess, equal to this many texels of seam that are off by one texel."""

_HELD_ALONE = 1.0
"""The same weight on the sheet with the block's centre, equal to this many texels inside it."""

_INSIDE = 0.1
"""Weight of a texel inside a sheet, relative to a texel along a seam."""

_LEAST, _MOST = 0.1, 4.0
"""Minimum determinant and maximum entry of C, in frame pixels per step. On sound charts both are about 1."""

_MOST_EDGES = 2048


class FieldArrays(NamedTuple):
    """All charts' warp fields: nodes (n, 4) float64 in frame pixels per step, one after another.

    `shapes` (charts, 3) are each chart's first node, rows and columns. Nodes are `step` steps apart. The
    second one of each row and column is at `origins` (charts, 2), relative to the chart's window.
    """

    nodes: FloatArray
    shapes: NDArray[np.int64]
    step: float
    origins: FloatArray


class SheetScratch(NamedTuple):
    """Scratch: `local` for triangles, −1 between calls; `edges` on seams between a block's sheets; sums."""

    local: IntArray
    edges: IntArray
    shares: FloatArray
    sums: FloatArray

    @classmethod
    def of(cls, triangles: int) -> "SheetScratch":
        """Return scratch for a mesh."""
        return cls(
            np.full(triangles, -1, np.int32),
            np.empty((_MOST_EDGES, 4), np.int32),
            np.empty((MOST_SHEETS, MOST_SHEETS)),
            np.empty(32),
        )


@inline
def field_at(field: FieldArrays, chart: int, row: float, column: float) -> tuple[float, float, float, float]:
    """Return M at a place of a chart: bilinear between nodes, constant beyond the outermost ones."""
    first, rows, columns = field.shapes[chart, 0], field.shapes[chart, 1], field.shapes[chart, 2]
    y = min(max((row - field.origins[chart, 0]) / field.step + 1.0, 0.0), rows - 1.0)
    x = min(max((column - field.origins[chart, 1]) / field.step + 1.0, 0.0), columns - 1.0)
    i, j = min(int64(y), max(rows - 2, 0)), min(int64(x), max(columns - 2, 0))
    down, right = y - i, x - j
    a = first + i * columns + j
    b = a + (1 if columns > 1 else 0)
    c = a + (columns if rows > 1 else 0)
    d = c + b - a
    n = field.nodes
    wa, wb = (1.0 - down) * (1.0 - right), (1.0 - down) * right
    wc, wd = down * (1.0 - right), down * right
    return (
        wa * n[a, 0] + wb * n[b, 0] + wc * n[c, 0] + wd * n[d, 0],
        wa * n[a, 1] + wb * n[b, 1] + wc * n[c, 1] + wd * n[d, 1],
        wa * n[a, 2] + wb * n[b, 2] + wc * n[c, 2] + wd * n[d, 2],
        wa * n[a, 3] + wb * n[b, 3] + wc * n[c, 3] + wd * n[d, 3],
    )


@inline
def turned(m: tuple[float, float, float, float], quarters: float) -> tuple[float, float, float, float]:
    """Return a matrix rotated by quarter turns, in the direction of `SYMMETRIES`."""
    if quarters == 1.0:
        return m[2], m[3], -m[0], -m[1]
    if quarters == 2.0:
        return -m[0], -m[1], -m[2], -m[3]
    if quarters == 3.0:
        return -m[2], -m[3], m[0], m[1]
    return m


@inline
def shown_at(field: FieldArrays, fit: FloatArray, row: float, column: float) -> tuple[float, float]:
    """Return where a place of a fitted sheet's chart reads, in frame pixels from the block's source."""
    m = turned(field_at(field, int64(fit[1]), row, column), fit[10])
    y, x = row - fit[2], column - fit[3]
    return (
        fit[4] + 0.5 * ((fit[6] + m[0]) * y + (fit[7] + m[1]) * x),
        fit[5] + 0.5 * ((fit[8] + m[2]) * y + (fit[9] + m[3]) * x),
    )


@inline
def _list_edges(mesh: MeshArrays, found: Footprint, count: int, scratch: SheetScratch) -> Any:
    # Lists the edges along which two sheets of a block meet, from each side: for each of the two triangles
    # its index in the footprint and its edge.
    edges = int64(0)
    for n in range(count):
        scratch.local[found.triangles[n]] = n
    for n in range(count):
        t = found.triangles[n]
        for k in range(3):
            if mesh.seam[t, k] < 0:
                continue
            across = mesh.neighbours[t, k]
            other = scratch.local[across // 3]
            if other >= 0 and found.sheets[other] != found.sheets[n] and edges < scratch.edges.shape[0]:
                scratch.edges[edges, 0], scratch.edges[edges, 1] = n, k
                scratch.edges[edges, 2], scratch.edges[edges, 3] = other, across % 3
                edges += 1
    for n in range(count):
        scratch.local[found.triangles[n]] = -1
    return edges


@inline
def _edge_length(mesh: MeshArrays, t: int, k: int) -> float:
    last = (k + 1) % 3
    y = mesh.places[t, last, 0] - mesh.places[t, k, 0]
    x = mesh.places[t, last, 1] - mesh.places[t, k, 1]
    return float(np.sqrt(y * y + x * x))


@inline
def _samples(length: float) -> Any:
    # The number of sampled places on an edge.
    return min(max(int64(length / 2.0) + 1, 1), 16)


@inline
def _place_on(mesh: MeshArrays, t: int, k: int, share: float) -> tuple[float, float]:
    last = (k + 1) % 3
    return (
        mesh.places[t, k, 0] + share * (mesh.places[t, last, 0] - mesh.places[t, k, 0]),
        mesh.places[t, k, 1] + share * (mesh.places[t, last, 1] - mesh.places[t, k, 1]),
    )


@inline
def _is_inside(maps: FloatArray, n: int, k: int, share: float, half: float) -> tuple[bool, float]:
    # Whether a place on an edge is in the block's square, and its squared distance from the centre.
    last = (k + 1) % 3
    y = maps[n, k, 0] + share * (maps[n, last, 0] - maps[n, k, 0])
    x = maps[n, k, 1] + share * (maps[n, last, 1] - maps[n, k, 1])
    return abs(y) < half and abs(x) < half, y * y + x * x


@inline
def _choose_next(
    mesh: MeshArrays,
    found: Footprint,
    edges: int,
    pieces: int,
    half: float,
    fits: FloatArray,
    scratch: SheetScratch,
) -> tuple[int, int]:
    # The sheet with the longest common seams with settled sheets, and the settled sheet with the longest of
    # these.
    lengths = scratch.shares
    for a in range(pieces):
        for b in range(pieces):
            lengths[a, b] = 0.0
    for e in range(edges):
        a, b = found.sheets[scratch.edges[e, 0]], found.sheets[scratch.edges[e, 2]]
        if a >= pieces or b >= pieces or fits[a, 0] != 1.0 or fits[b, 0] != 0.0:
            continue
        n, k = scratch.edges[e, 0], scratch.edges[e, 1]
        length = _edge_length(mesh, found.triangles[n], k)
        places = _samples(length)
        for m in range(places):
            inside, _ = _is_inside(found.maps, n, k, (m + 0.5) / places, half)
            if inside:
                lengths[a, b] += length / places
    best, most, source, longest = int64(-1), 0.0, int64(-1), 0.0
    for b in range(pieces):
        total = 0.0
        for a in range(pieces):
            total += lengths[a, b]
        if total > most:
            best, most = b, total
    if best >= 0:
        for a in range(pieces):
            if lengths[a, best] > longest:
                source, longest = a, lengths[a, best]
    return best, source


@inline
def _guess(
    mesh: MeshArrays,
    field: FieldArrays,
    found: Footprint,
    edges: int,
    half: float,
    source: int,
    wanted: int,
    fits: FloatArray,
    scratch: SheetScratch,
) -> None:
    # The centre of a sheet, extrapolated across the seam, and the first guess of its C.
    fit, old = fits[wanted], fits[source]
    t00, t01, t10, t11, row, column, total = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for e in range(edges):
        n, k, m, l = scratch.edges[e, 0], scratch.edges[e, 1], scratch.edges[e, 2], scratch.edges[e, 3]  # noqa: E741
        if found.sheets[n] != source or found.sheets[m] != wanted:
            continue
        t, other = found.triangles[n], found.triangles[m]
        cross = mesh.crossing[mesh.seam[t, k]]
        length = _edge_length(mesh, t, k)
        places = _samples(length)
        for step in range(places):
            share = (step + 0.5) / places
            inside, apart = _is_inside(found.maps, n, k, share, half)
            if not inside:
                continue
            weight = length / places / (apart + 9.0)
            a, b = _place_on(mesh, t, k, share), _place_on(mesh, other, l, 1.0 - share)
            t00, t01 = t00 + weight * cross[0, 0], t01 + weight * cross[0, 1]
            t10, t11 = t10 + weight * cross[1, 0], t11 + weight * cross[1, 1]
            down, right = old[2] - a[0], old[3] - a[1]
            row += weight * (b[0] + cross[0, 0] * down + cross[0, 1] * right)
            column += weight * (b[1] + cross[1, 0] * down + cross[1, 1] * right)
            total += weight
            fit[1] = mesh.chart[other]
    t00, t01, t10, t11 = t00 / total, t01 / total, t10 / total, t11 / total
    determinant = t00 * t11 - t01 * t10
    fit[2], fit[3], fit[4], fit[5] = row / total, column / total, 0.0, 0.0
    fit[6] = (old[6] * t11 - old[7] * t10) / determinant
    fit[7] = (old[7] * t00 - old[6] * t01) / determinant
    fit[8] = (old[8] * t11 - old[9] * t10) / determinant
    fit[9] = (old[9] * t00 - old[8] * t01) / determinant
    # The quarter turns with which the chart's own matrix there is nearest to C.
    m = field_at(field, int64(fit[1]), fit[2], fit[3])
    best, step = -1e300, 4 // mesh.fold
    for quarters in range(0, 4, step):
        n = turned(m, float(quarters))
        like = fit[6] * n[0] + fit[7] * n[1] + fit[8] * n[2] + fit[9] * n[3]
        if like > best:
            best, fit[10] = like, quarters


@inline
def _add_sample(
    fit: FloatArray, sums: FloatArray, row: float, column: float, shown: tuple[float, float], weight: float
) -> None:
    # Adds a place of the sheet's chart, where `shown` is the remaining error of the position that it reads.
    y, x = 0.5 * (row - fit[2]), 0.5 * (column - fit[3])
    down, right = weight * shown[0], weight * shown[1]
    sums[0], sums[1], sums[2] = sums[0] + weight, sums[1] + weight * y, sums[2] + weight * x
    sums[3], sums[4] = sums[3] + weight * y * y, sums[4] + weight * y * x
    sums[5] += weight * x * x
    sums[6], sums[7], sums[8] = sums[6] + down, sums[7] + down * y, sums[8] + down * x
    sums[9], sums[10], sums[11] = sums[9] + right, sums[10] + right * y, sums[11] + right * x


@inline
def _add_inside(
    mesh: MeshArrays,
    field: FieldArrays,
    found: Footprint,
    count: int,
    half: float,
    sheet: int,
    weight: float,
    fit: FloatArray,
    sums: FloatArray,
) -> None:
    # Adds the midpoints of the edges of a sheet's triangles, weighted by area, with their block map.
    for n in range(count):
        if found.sheets[n] != sheet:
            continue
        p, u = found.places[n], found.maps[n]
        area = (p[1, 0] - p[0, 0]) * (p[2, 1] - p[0, 1]) - (p[1, 1] - p[0, 1]) * (p[2, 0] - p[0, 0])
        for k in range(3):
            last = (k + 1) % 3
            down, right = 0.5 * (u[k, 0] + u[last, 0]), 0.5 * (u[k, 1] + u[last, 1])
            if abs(down) > half or abs(right) > half:
                continue
            row, column = 0.5 * (p[k, 0] + p[last, 0]), 0.5 * (p[k, 1] + p[last, 1])
            mine = shown_at(field, fit, row, column)
            _add_sample(fit, sums, row, column, (down - mine[0], right - mine[1]), weight * area / 6.0)


@inline
def _solve(fit: FloatArray, sums: FloatArray) -> None:
    # Least squares for the changes of s and C: one system of three unknowns, with a right side for each of
    # the two rows. `sums`: the matrix's upper triangle (6), then the right sides (3 and 3).
    a00, a01, a02, a11, a12, a22 = sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]
    c00, c01, c02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
    c11, c12, c22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
    determinant = a00 * c00 + a01 * c01 + a02 * c02
    fit[0] = -1.0
    if not determinant > 0.0:
        return
    for axis in range(2):
        p, q, r = sums[6 + 3 * axis], sums[7 + 3 * axis], sums[8 + 3 * axis]
        fit[4 + axis] += (c00 * p + c01 * q + c02 * r) / determinant
        fit[6 + 2 * axis] += (c01 * p + c11 * q + c12 * r) / determinant
        fit[7 + 2 * axis] += (c02 * p + c12 * q + c22 * r) / determinant
    low, high = fit[6] * fit[9] - fit[7] * fit[8], max(abs(fit[6]), abs(fit[7]), abs(fit[8]), abs(fit[9]))
    fit[0] = 1.0 if low > _LEAST and high < _MOST else -1.0


@inline
def _fit(
    mesh: MeshArrays,
    field: FieldArrays,
    found: Footprint,
    count: int,
    edges: int,
    half: float,
    wanted: int,
    fits: FloatArray,
    scratch: SheetScratch,
) -> None:
    # Fits C and s to the settled sheets along common seams, and with less weight to the block map. The sheet
    # with the block's centre is fitted first, without seams, to the block map alone.
    fit, sums = fits[wanted], scratch.sums
    for n in range(12):
        sums[n] = 0.0
    weight, held = (_INSIDE, _HELD) if edges else (1.0, _HELD_ALONE)
    sums[0], sums[3], sums[5] = 1e-6, held, held
    _add_inside(mesh, field, found, count, half, wanted, weight, fit, sums)
    for e in range(edges):
        n, k, m, l = scratch.edges[e, 0], scratch.edges[e, 1], scratch.edges[e, 2], scratch.edges[e, 3]  # noqa: E741
        settled = found.sheets[n]
        if found.sheets[m] != wanted or settled >= fits.shape[0] or fits[settled, 0] != 1.0:
            continue
        t, other = found.triangles[n], found.triangles[m]
        length = _edge_length(mesh, t, k)
        places = _samples(length)
        for step in range(places):
            share = (step + 0.5) / places
            inside, _ = _is_inside(found.maps, n, k, share, half)
            if not inside:
                continue
            a, b = _place_on(mesh, t, k, share), _place_on(mesh, other, l, 1.0 - share)
            known, mine = shown_at(field, fits[settled], a[0], a[1]), shown_at(field, fit, b[0], b[1])
            apart = known[0] - mine[0], known[1] - mine[1]
            _add_sample(fit, sums, b[0], b[1], apart, length / places)
    _solve(fit, sums)


@inline
def enter_fit(fit: FloatArray, root: FloatArray, centre: tuple[float, float, float, float]) -> None:
    """Write the fit of a sheet that reads by its chart's field alone about a block's centre."""
    fit[0], fit[1], fit[2], fit[3], fit[4], fit[5] = 1.0, root[0], root[1], root[2], root[3], root[4]
    fit[6], fit[7], fit[8], fit[9], fit[10] = centre[0], centre[1], centre[2], centre[3], root[5]


@shared
def fit_block(
    mesh: MeshArrays,
    field: FieldArrays,
    root: FloatArray,
    half: float,
    found: Footprint,
    sizes: tuple[int, int],
    scratch: SheetScratch,
    fits: FloatArray,
) -> int:
    """Fit the sheets of a block, `fits` (`MOST_SHEETS`, `FIT`); return their number, settled or not.

    `root` (6,) is the chart; the place of the block's centre there; the position that it reads minus the
    block's source; and the quarter turns from the chart's matrix to the block's. `sizes` are the numbers of
    triangles and sheets that `unfold_block` found. `found.sheets` becomes −1 on sheets that are not settled.
    """
    count, pieces = sizes[0], min(sizes[1], MOST_SHEETS)
    for m in range(pieces):
        fits[m, 0] = 0.0
    centre = turned(field_at(field, int64(root[0]), root[1], root[2]), root[5])
    enter_fit(fits[0], root, centre)
    _fit(mesh, field, found, count, 0, half, 0, fits, scratch)
    if fits[0, 0] != 1.0:  # it cannot be fitted: the chart's field alone
        enter_fit(fits[0], root, centre)
    if pieces > 1:
        edges = _list_edges(mesh, found, count, scratch)
        while True:
            wanted, source = _choose_next(mesh, found, edges, pieces, half, fits, scratch)
            if wanted < 0:
                break
            _guess(mesh, field, found, edges, half, source, wanted, fits, scratch)
            _fit(mesh, field, found, count, edges, half, wanted, fits, scratch)
    for m in range(count):
        sheet = found.sheets[m]
        if sheet >= pieces or fits[sheet, 0] != 1.0:
            found.sheets[m] = -1
    return pieces
