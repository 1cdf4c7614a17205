"""Hot loops of clustering: joining triangles with similar normals, and shortening borders."""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._piece_kernels import _pop, _push
from upholster.geometry._union_kernels import root_of
from upholster.runtime.jit import allocating_kernel, inline, kernel


@allocating_kernel
def cluster(
    across: IntArray,
    crossed: FloatArray,
    areas: FloatArray,
    most: float,
    least_cosine: float,
    tiny: float,
    label: IntArray,
) -> None:
    """Join neighbours, first those whose normals' variance then increases least (Ward's criterion).

    ``crossed`` (T, 3) are the normals of the triangles times their ``areas`` (T,). Clusters are joined while
    the variance of their normals stays below ``most`` and the cosine between their mean normals is at least
    ``least_cosine``, or while one is smaller than ``tiny``. ``label`` (T,) receives a triangle of each
    triangle's cluster.
    """
    count = len(across)
    parent = np.arange(count).astype(np.int32)
    facing, area = crossed.copy(), areas.copy()
    key, item = np.empty(3 * count // 2 + 2), np.empty(3 * count // 2 + 2, np.int32)
    size = 0
    for t in range(count):
        for k in range(3):
            if across[t, k] > 3 * t + k:
                size = _push(key, item, size, _growth(facing, area, t, across[t, k] // 3), 3 * t + k)
    while size > 0:
        cost, entry = key[0], item[0]
        size = _pop(key, item, size)
        a, b = root_of(parent, entry // 3), root_of(parent, across[entry // 3, entry % 3] // 3)
        if a == b:
            continue
        now = _growth(facing, area, a, b)
        if now > cost * (1 + 1e-9) + 1e-15:
            size = _push(key, item, size, now, entry)
        elif min(area[a], area[b]) <= tiny or (
            _variance(facing, area, a, b) <= most and _cosine(facing, a, b) >= least_cosine
        ):
            low, high = min(a, b), max(a, b)
            parent[high] = low
            area[low] += area[high]
            for axis in range(3):
                facing[low, axis] += facing[high, axis]
    for t in range(count):
        label[t] = root_of(parent, t)


@inline
def _square(facing: FloatArray, a: int) -> float:
    x, y, z = facing[a, 0], facing[a, 1], facing[a, 2]
    return float(x * x + y * y + z * z)


@inline
def _joint_square(facing: FloatArray, a: int, b: int) -> float:
    x, y, z = facing[a, 0] + facing[b, 0], facing[a, 1] + facing[b, 1], facing[a, 2] + facing[b, 2]
    return float(x * x + y * y + z * z)


@inline
def _growth(facing: FloatArray, area: FloatArray, a: int, b: int) -> float:
    joint = area[a] + area[b]
    if not (area[a] > 0.0 and area[b] > 0.0):
        return 0.0
    apart = _square(facing, a) / area[a] + _square(facing, b) / area[b]
    return float(apart - _joint_square(facing, a, b) / joint)


@inline
def _variance(facing: FloatArray, area: FloatArray, a: int, b: int) -> float:
    joint = area[a] + area[b]
    return float(1.0 - _joint_square(facing, a, b) / (joint * joint)) if joint > 0.0 else 0.0


@inline
def _cosine(facing: FloatArray, a: int, b: int) -> float:
    size = np.sqrt(_square(facing, a) * _square(facing, b))
    dot = facing[a, 0] * facing[b, 0] + facing[a, 1] * facing[b, 1] + facing[a, 2] * facing[b, 2]
    return float(dot / size) if size > 0.0 else 1.0


@kernel
def straighten(across: IntArray, costs: FloatArray, label: IntArray, sweeps: int) -> int:
    """Give triangles the label of a neighbour where that shortens borders; return how many changed.

    ``costs`` (T, 3) are the costs of edges on a border: their lengths, reduced at creases.
    """
    changed = 0
    for sweep in range(sweeps):
        changed = 0
        for place in range(len(across)):
            t = place if sweep % 2 == 0 else len(across) - 1 - place
            kept, best, least = 0.0, label[t], 0.0
            for k in range(3):
                if across[t, k] >= 0 and label[across[t, k] // 3] == label[t]:
                    kept += costs[t, k]
            least = kept
            for k in range(3):
                if across[t, k] < 0 or label[across[t, k] // 3] == label[t]:
                    continue
                other, gained = label[across[t, k] // 3], 0.0
                for j in range(3):
                    if across[t, j] >= 0 and label[across[t, j] // 3] == other:
                        gained += costs[t, j]
                if gained > least * (1 + 1e-9):
                    least, best = gained, other
            if best != label[t]:
                label[t] = best
                changed += 1
        if changed == 0:
            break
    return changed
