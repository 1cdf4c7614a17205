"""In which order charts are covered, and which ones at once."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import Surface
from upholster.quilt.chart import Chart
from upholster.types import FloatArray

if TYPE_CHECKING:
    from upholster.charts.seams import ChartSeam

__all__ = ["THIN", "schedule"]

THIN = 48
"""Charts with a side of fewer texels are thin."""


def schedule(surface: Surface, charts: Sequence[Chart], found: Sequence["ChartSeam"]) -> list[list[int]]:
    """Sort charts into rounds: no two charts of a round touch, neither along an interval nor in a point.

    Those touch that meet, and those that have a corner at one point of space: all that lie round a pole, and
    the opposite ones where four meet. What lies round a thin chart counts as touching too: covered from both
    sides at once, it would have no room for a transition between them.

    The rounds grow from the first chart, so that each one goes on from what is finished: only charts that
    touch a finished one are taken, thin ones first, then those that share most with finished ones, then in
    the charts' order. Nobody is taken before a thin chart beside it that waits for this round's others.

    Parameters
    ----------
    surface, charts, found
        As for `upholster.charts.seams.find_seams`, and all that it found.

    Returns
    -------
    list of list of int
        Indices of charts, each once, rising in a round.
    """
    keys = _keys(surface, charts, found)
    thin = [min(c.height, c.width) < THIN for c in charts]
    beside: dict[int, set[int]] = defaultdict(set)
    for m in found:
        if thin[m.chart]:
            key = -1 - len(found) - m.chart
            keys[m.chart].add(key)
            keys[m.other_chart].add(key)
            beside[m.other_chart].add(m.chart)
    sharing: dict[int, list[int]] = defaultdict(list)
    for index, mine in enumerate(keys):
        for key in mine:
            sharing[key].append(index)
    near = [0] * len(charts)  # how many keys a chart shares with finished charts
    waiting, front = set(range(len(charts))), set[int]()
    sorted_out: list[list[int]] = []
    while waiting:
        taken, passed, members = set[int](), set[int](), list[int]()
        for index in sorted(front, key=lambda n: (not thin[n], -near[n], n)) or [min(waiting)]:
            if taken.isdisjoint(keys[index]) and passed.isdisjoint(beside[index]):
                taken |= keys[index]
                members.append(index)
            else:
                passed.add(index)
        waiting.difference_update(members)
        for index in members:
            for key in keys[index]:
                for other in sharing[key]:
                    near[other] += 1
                    front.add(other)
        front &= waiting
        sorted_out.append(sorted(members))
    return sorted_out


def _keys(surface: Surface, charts: Sequence[Chart], found: Sequence["ChartSeam"]) -> list[set[int]]:
    """Give each chart numbers, so that charts that touch have one in common."""
    keys: list[set[int]] = [set() for _ in charts]
    for n, m in enumerate(found):
        keys[m.chart].add(-1 - n)
        keys[m.other_chart].add(-1 - n)
    corners = [
        (n, edge, along) for n, c in enumerate(charts) for edge in (0, 2) for along in (0.0, float(c.width))
    ]
    # Where a neighbour's corner lies inside an edge, the edge's chart touches whatever meets there.
    corners += [(m.chart, m.edge, along) for m in found for along in (m.start, m.stop)]
    for (owner, _, _), cells in zip(corners, _cells(surface, _points(surface, charts, corners)), strict=True):
        keys[owner].update(cells.tolist())
    return keys


def _points(
    surface: Surface, charts: Sequence[Chart], places: Sequence[tuple[int, int, float]]
) -> FloatArray:
    """Return the points, (n, 3), at places of charts' edges: chart, edge, texels along it."""
    of_face: dict[int, list[int]] = defaultdict(list)
    parameters = np.empty((len(places), 2))
    for n, (index, edge, along) in enumerate(places):
        c = charts[index]
        if edge & 1:
            parameters[n] = c.s0 + (c.s1 - c.s0) * along / c.height, c.t1 if edge == 1 else c.t0
        else:
            parameters[n] = c.s1 if edge == 2 else c.s0, c.t0 + (c.t1 - c.t0) * along / c.width
        of_face[c.face].append(n)
    out = np.empty((len(places), 3))
    for face, mine in of_face.items():
        out[mine] = surface.faces[face].points(*parameters[mine].T)
    return out


def _cells(surface: Surface, points: FloatArray) -> NDArray[np.int64]:
    """Give points (n, 3) eight numbers each, (n, 8): two points at one place have one of them in common.

    Numbers name the cells of eight grids, shifted by half a cell each way: whatever boundary of one passes
    between two points, another has them in one cell. Unequal cells may share a number: only more rounds.
    """
    # adjacency lets corners that meet lie a few tolerances apart
    cell = 16.0 * max(surface.tolerance, 1e-9) * (surface.size or 1.0)
    scaled = (points - surface.box[0]) / cell
    primes = np.array([73_856_093, 19_349_663_000_003, 83_492_791_000_000_027], dtype=np.int64)
    keys = np.empty((len(points), 8), dtype=np.int64)
    for n, shift in enumerate(product((0.0, 0.5), repeat=3)):
        cells = np.floor(scaled + shift).astype(np.int64)
        # wraps round, as hashes do; the lowest bits tell the grid, and the sign keeps clear of seams
        keys[:, n] = (((cells * primes).sum(axis=1) << 3) + n) & np.int64(2**63 - 1)
    return keys
