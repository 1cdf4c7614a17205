"""Surfaces, and charts laid over them in several ways."""

import numpy as np

from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cone
from upholster.geometry.built_in.sphere import sphere
from upholster.quilt.chart import Chart

SURFACES = {
    "plane": plane(3, 2, spans=(2, 3)),
    "torus": torus(),
    "cyclide": ring_cyclide(),
    "six": sphere(),
    "octants": sphere(tiling="octants"),
    "cone": cone(r2=0.0),
}
GRID = 8


def on_patch(surface, patch, height, width, s0=0.0, s1=1.0, t0=0.0, t1=1.0):
    """Lay a chart over a rectangle of one patch."""
    face, row, column = surface.place(patch)
    return Chart(face, height, width, row + s0, row + s1, column + t0, column + t1)


def whole(surface):
    """Lay one chart over each patch, of different sizes."""
    return tuple(
        on_patch(surface, n, 40 + 3 * (n % 5), 36 + 5 * (n % 3)) for n in range(len(surface.patches))
    )


def split(surface, seed=1):
    """Cut faces at random places, on multiples of 1/8, into charts of different sizes, shuffled."""
    rng = np.random.default_rng(seed)
    charts = []

    def add(face, s0, s1, t0, t1, depth):
        tall, wide = s1 - s0, t1 - t0
        if depth and tall > 1 and (wide == 1 or rng.random() < 0.5):
            at = int(rng.integers(s0 + 1, s1))
            add(face, s0, at, t0, t1, depth - 1)
            add(face, at, s1, t0, t1, depth - 1)
        elif depth and wide > 1:
            at = int(rng.integers(t0 + 1, t1))
            add(face, s0, s1, t0, at, depth - 1)
            add(face, s0, s1, at, t1, depth - 1)
        else:
            size = rng.integers(10, 50, 2).tolist()
            charts.append(Chart(face, *size, s0 / GRID, s1 / GRID, t0 / GRID, t1 / GRID))

    for n, face in enumerate(surface.faces):
        # Half a ring at most, so that no chart meets itself.
        rows, columns = GRID * face.rows, GRID * face.columns
        for top, bottom in ((0, rows // 2), (rows // 2, rows)):
            for left, right in ((0, columns // 2), (columns // 2, columns)):
                add(n, top, bottom, left, right, int(rng.integers(0, 4)))
    rng.shuffle(charts)
    return tuple(charts)
