"""Hot loops of `upholster.charts.phases`."""

import numpy as np

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.runtime.jit import inline, kernel

__all__ = ["carry_phases", "first_members", "nearest_in_course", "nearest_parts"]


@inline
def _top(part: IntArray, at: int) -> int:
    # The root of the part that `at` belongs to, with path compression.
    while part[at] != at:
        part[at] = part[part[at]]
        at = part[at]
    return at


@kernel
def first_members(first: IntArray, second: IntArray, part: IntArray) -> None:
    """Put in `part` (n,), for each of n numbers, the lowest one connected to it by links (first, second)."""
    for i in range(len(part)):
        part[i] = i
    for e in range(len(first)):
        a, b = _top(part, first[e]), _top(part, second[e])
        part[max(a, b)] = min(a, b)
    for i in range(len(part)):
        part[i] = _top(part, i)


@kernel
def carry_phases(
    starts: IntArray, seconds: IntArray, turns: ComplexArray, queue: IntArray, phases: ComplexArray
) -> None:
    """Carry the phase 1 from one unknown of each connected part to all others, breadth first.

    Links `starts[i]` to `starts[i + 1]` are those of unknown i: its phase times `turns` is that of `seconds`.
    `queue` (n,) is scratch; `phases` (n,) are 0 before.
    """
    for root in range(len(phases)):
        if phases[root] != 0:
            continue
        phases[root], queue[0] = 1, root
        head, tail = 0, 1
        while head < tail:
            here = queue[head]
            head += 1
            for link in range(starts[here], starts[here + 1]):
                there = seconds[link]
                if phases[there] == 0:
                    phases[there] = turns[link] * phases[here]
                    queue[tail] = there
                    tail += 1


@kernel
def nearest_parts(
    firsts: IntArray, middles: FloatArray, triangles: IntArray, points: FloatArray, out: IntArray
) -> None:
    """Put in `out` (m,) the part of its triangle that is nearest to each point (m, 3); see `PhaseField`."""
    for i in range(len(out)):
        triangle, least = triangles[i], np.inf
        for part in range(firsts[triangle], firsts[triangle + 1]):
            away = 0.0
            for axis in range(3):
                away += (points[i, axis] - middles[part, axis]) ** 2
            if away < least:
                least = away
                out[i] = part


@kernel
def nearest_in_course(
    firsts: IntArray,
    middles: FloatArray,
    heights: FloatArray,
    triangles: IntArray,
    points: FloatArray,
    height: FloatArray,
    out: IntArray,
) -> None:
    """Put in `out` (m,) the part of its triangle nearest to each point (m, 3) and, if any is, in its course.

    `heights` (parts,) and `height` (m,) are places between the joints of a course, 0 to 1.
    """
    for i in range(len(out)):
        least, is_in_course = np.inf, False
        for part in range(firsts[triangles[i]], firsts[triangles[i] + 1]):
            here = abs(heights[part] - height[i]) < 0.5
            if is_in_course and not here:
                continue
            away = 0.0
            for axis in range(3):
                away += (points[i, axis] - middles[part, axis]) ** 2
            if away < least or (here and not is_in_course):
                least, is_in_course = away, here
                out[i] = part
