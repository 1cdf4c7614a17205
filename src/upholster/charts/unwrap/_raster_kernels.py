"""Hot loop over samples of texture coordinates."""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.runtime.jit import kernel


@kernel
def coverage(corners: FloatArray, times: IntArray) -> None:
    """Count the triangles over each sample, at (row + ½, column + ½).

    ``corners`` (T, 3, 2); ``times`` (rows, columns) receives the counts. A sample on a common edge counts for
    neither or both of its triangles; that is rare and does not matter.
    """
    for t in range(len(corners)):
        s0, t0 = corners[t, 0, 0], corners[t, 0, 1]
        s1, t1 = corners[t, 1, 0] - s0, corners[t, 1, 1] - t0
        s2, t2 = corners[t, 2, 0] - s0, corners[t, 2, 1] - t0
        turned = s1 * t2 - t1 * s2
        if turned == 0.0:
            continue
        top, bottom = s0 + min(0.0, s1, s2), s0 + max(0.0, s1, s2)
        left, right = t0 + min(0.0, t1, t2), t0 + max(0.0, t1, t2)
        for r in range(max(int(np.floor(top)), 0), min(int(np.ceil(bottom)), len(times))):
            for c in range(max(int(np.floor(left)), 0), min(int(np.ceil(right)), times.shape[1])):
                ds, dt = r + 0.5 - s0, c + 0.5 - t0
                one, other = (ds * t2 - dt * s2) / turned, (s1 * dt - t1 * ds) / turned
                if one > 0.0 and other > 0.0 and one + other < 1.0:
                    times[r, c] += 1
