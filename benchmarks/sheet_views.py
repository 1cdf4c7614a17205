"""Pieces of a model or picture as the sample's pixels lie, and where in the sample they come from.

All of it is measured from outside: rays are cast at the triangles of a file, squares of its texture are seen
from straight above, at the size and in the direction that was asked for, and looked for in the sample.
"""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from upholster.base.types import FloatArray, PixelArray
from upholster.covering.measure.samples import SEED, bilinear, coded
from upholster.image.elements.lattice import Lattice
from upholster.output.glb_picture import ShownModel

Flags = NDArray[np.bool_]

__all__ = ["Found", "broken", "find", "flat_views", "frames", "recurrence", "views"]

SIDE = 49
"""Of a view, in pixels of the sample; odd, as all sides here, so that a pixel is the middle."""

VIEWS = 160
TRIED = 3 * VIEWS
WINDOW = 25
"""Side of what is looked for in the sample, in pixels: larger ones hold more cuts, smaller ones tell less."""

SURE = 0.85
"""Least correlation of a view with what was found."""

TELLING = 0.02
"""Largest standard error of a size (as a share) or direction (in radians) that counts: not along a board."""

RELATED = 6.0
"""Neighbouring pixels, blurred as they are, say as little as one of so many."""

STEEP = 0.8
"""Least cosine between a view's normal and what it sees: about 37°."""

ASIDE = 14
"""Pixels from a view's middle to the places beside it whose phases are compared with it."""

STEPS = 12
_GROWN = np.array([0, 0, 0.5, 0, 0, 0.5])
_TURNED = np.array([0, 0, 0, -0.5, 0.5, 0])
"""How size and direction follow from what is found: rows and columns of the place, and the matrix."""

NEAR = 8.0


@dataclass(frozen=True, eq=False)
class Found:
    """Where the middles of views come from.

    Attributes
    ----------
    place
        (V, 2) rows and columns of the sample.
    matrix
        (V, 2, 2) from a view's pixels to the sample's.
    sure
        (V,) whether the sample looks so there.
    telling
        (V,) whether, besides, size and direction are given by it precisely.
    """

    place: FloatArray
    matrix: FloatArray
    sure: Flags
    telling: Flags

    @property
    def size(self) -> FloatArray:
        """Return by which factor the texture is smaller than asked."""
        return np.asarray(np.sqrt(np.abs(np.linalg.det(self.matrix))))

    @property
    def angle(self) -> FloatArray:
        """Return by how many degrees the texture is turned; a half turn counts as none."""
        a = self.matrix
        turn = np.arctan2(a[:, 1, 0] - a[:, 0, 1], a[:, 0, 0] + a[:, 1, 1])
        return np.asarray(np.degrees(np.abs(turn - np.pi * np.round(turn / np.pi))))


def views(model: ShownModel, pixel: float | None, direction: str) -> list[PixelArray]:
    """Return squares of a model's texture as one looks straight at it, (SIDE, SIDE, 3), 16 bits.

    `pixel` is the length that was asked for of a pixel of the sample; None takes the texels' own size and
    direction. Places are spread evenly over the area, and the same on models of one shape; those are left
    out where the square would reach over an edge or a bend.
    """
    _, origins, steps_at = frames(model, pixel, direction)
    steps = np.arange(SIDE) - (SIDE - 1) / 2
    down, right = np.meshgrid(steps, steps, indexing="ij")
    across = np.stack([down.ravel(), right.ravel()], axis=1)
    scene = EmbreeScene()
    mesh = TriangleMesh(scene, model.corners.astype(np.float32))
    flat = _unit(np.cross(*np.moveaxis(model.corners[:, 1:] - model.corners[:, :1], 1, 0)))
    found = []
    for origin, frame in zip(origins, steps_at, strict=True):
        outward = _unit(np.cross(frame[0], frame[1]))
        height = 0.25 * SIDE * float(np.linalg.norm(frame[0]))
        starts = (origin + height * outward + across @ frame).astype(np.float32)
        hits = scene.run(starts, np.tile(-outward.astype(np.float32), (len(starts), 1)), output=1)
        triangle = hits["primID"].astype(np.int64)
        beyond = (triangle < 0) | (hits["tfar"] > 2 * height) | (flat[triangle] @ outward < STEEP)
        if beyond.any():
            continue
        u, v = hits["u"].astype(float)[:, None], hits["v"].astype(float)[:, None]
        corner = model.uv[triangle]
        place = corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v - 0.5
        seen = bilinear(model.color[:, :, :3], place[:, 1], place[:, 0]).reshape(SIDE, SIDE, 3)
        found.append(np.rint(65535 * seen).astype(np.uint16))
        if len(found) == VIEWS:
            break
    del mesh
    return found


def flat_views(image: PixelArray) -> list[PixelArray]:
    """Return squares of a picture, at places that are the same for pictures of one size."""
    rng = np.random.default_rng(SEED)
    corners = rng.integers(0, np.array(image.shape[:2]) - SIDE + 1, (VIEWS, 2)).tolist()
    return [image[row : row + SIDE, column : column + SIDE] for row, column in corners]


def find(seen: list[PixelArray], sample: PixelArray) -> Found:
    """Look for the middle of each view in the sample: where it is, and how turned and stretched.

    The nearest window of 25² pixels, upright or upside down, is where the search for an affine map starts
    (Gauss–Newton on brightness, blurred by a pixel; Baker and Matthews, IJCV 56, 2004). It follows sizes that
    are wrong by a tenth and directions by 10°.
    """
    theirs = _brightness(sample)
    ours = np.stack([_brightness(view) for view in seen])
    middle = slice((SIDE - WINDOW) // 2, (SIDE - WINDOW) // 2 + WINDOW)
    windows = ours[:, middle, middle]
    upright, one = nearest(windows, theirs)
    turned, other = nearest(windows[:, ::-1, ::-1], theirs)
    sign = np.where(one <= other, 1.0, -1.0)
    place = np.where((sign > 0)[:, None], upright, turned) + (WINDOW - 1) / 2
    matrix = sign[:, None, None] * np.eye(2)
    return _followed(windows, theirs, place, matrix)


def nearest(windows: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corner (V, 2) of the window of the sample that is nearest to each, and its distance."""
    side = windows.shape[1]
    spectrum = np.fft.rfft2(sample)
    sums = np.pad((sample * sample).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    square = sums[side:, side:] - sums[side:, :-side] - sums[:-side, side:] + sums[:-side, :-side]
    corners, distances = [], []
    for window in windows:
        product = np.fft.irfft2(spectrum * np.fft.rfft2(window, sample.shape).conj(), sample.shape)
        cost = square - 2 * product[: square.shape[0], : square.shape[1]]
        best = int(cost.argmin())
        corners.append(divmod(best, cost.shape[1]))
        distances.append(cost.ravel()[best] + (window * window).sum())
    return np.array(corners, float), np.array(distances)


def broken(seen: list[PixelArray], sample: PixelArray, found: Found, lattice: Lattice) -> float | None:
    """Return the share of places 14 pixels from views' middles whose phase is off by a quarter turn."""
    chosen = np.flatnonzero(found.sure)[: VIEWS // 2]
    if len(chosen) < VIEWS // 8:
        return None
    theirs = _brightness(sample)
    half = ASIDE - 4
    offsets = ASIDE * np.array([(-1, 0), (1, 0), (0, -1), (0, 1)])
    middle = SIDE // 2
    windows, steps, starts = [], [], []
    for number in chosen.tolist():
        view, matrix = _brightness(seen[number]), found.matrix[number]
        for row, column in (offsets + middle).tolist():
            window = view[row - half : row + half + 1, column - half : column + half + 1]
            windows.append(window if matrix[0, 0] > 0 else window[::-1, ::-1])
        starts += [found.place[number]] * len(offsets)
        steps.append(offsets @ matrix.T)
    corner, _ = nearest(np.stack(windows), theirs)
    there = _phases(lattice, corner + half)
    here = _phases(lattice, np.array(starts)) + np.concatenate(steps) @ lattice.waves.T
    off = there - here
    return float((np.abs(off - np.round(off)) > 0.25).any(axis=1).mean())


def recurrence(found: Found, shape: tuple[int, ...]) -> float | None:
    """Return how often two views come from the same place of the sample: 1 is as often as by chance."""
    place = found.place[found.sure.astype(bool)]
    if len(place) < VIEWS // 4:
        return None
    away = np.linalg.norm(place[:, None] - place, axis=2)[np.triu_indices(len(place), 1)]
    free = (shape[0] - WINDOW) * (shape[1] - WINDOW)
    return float((away < NEAR).mean() * free / (np.pi * NEAR**2))


def frames(
    model: ShownModel, pixel: float | None, direction: str
) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Return triangles (n,), places on them (n, 3), and a pixel's steps down and right there, (n, 2, 3)."""
    corners = model.corners
    edges = corners[:, 1:] - corners[:, :1]
    cross = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(cross, axis=1)
    middles = corners.mean(axis=1)
    order = np.lexsort(np.round(middles / np.ptp(middles, axis=0).max(), 5).T)
    rng = np.random.default_rng(SEED)
    ends = area[order].cumsum()
    triangle = order[np.searchsorted(ends, rng.permutation((np.arange(TRIED) + 0.5) / TRIED) * ends[-1])]
    shares = rng.dirichlet((1, 1, 1), TRIED)
    place = np.einsum("nc,ncd->nd", shares, corners[triangle])
    if pixel is None:
        texels = model.uv[triangle, 1:] - model.uv[triangle, :1]
        usable = np.abs(np.linalg.det(texels)) > 1e-9
        steps = np.linalg.inv(texels[usable]) @ edges[triangle[usable]]
        return triangle[usable], place[usable], steps[:, ::-1]
    normal = _unit(cross[triangle])
    up = np.array([0.0, 0.0, 1.0])
    right = np.cross(up, normal if direction == "level" else place)
    right -= normal * (right * normal).sum(axis=1, keepdims=True)
    size = np.linalg.norm(right, axis=1)
    usable = size > (
        0.2 if direction == "level" else 0.2 * np.maximum(np.hypot(place[:, 0], place[:, 1]), 1e-9)
    )
    right, normal = _unit(right[usable]), normal[usable]
    steps = pixel * np.stack([np.cross(right, normal), right], axis=1)
    return triangle[usable], place[usable], steps


def _followed(windows: FloatArray, sample: FloatArray, place: FloatArray, matrix: FloatArray) -> Found:
    steps = np.arange(WINDOW) - (WINDOW - 1) / 2
    across = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    weight = np.exp(-(across**2).sum(axis=1) / (2 * (WINDOW / 4) ** 2))
    weight /= weight.sum()
    blurred = gaussian_filter(sample, 1.0)
    images = np.stack([blurred, *np.gradient(blurred)], axis=2).astype(np.float32)
    wanted = gaussian_filter(windows, (0, 1, 1)).reshape(len(windows), -1)
    for step in range(STEPS + 1):
        points = place[:, None] + np.einsum("pd,vcd->vpc", across, matrix)
        flat = points.reshape(-1, 2)
        value, down, right = np.moveaxis(_between(images, flat).reshape(*wanted.shape, 3), 2, 0)
        rest = wanted - value
        slopes = np.stack(
            [
                down,
                right,
                down * across[:, 0],
                down * across[:, 1],
                right * across[:, 0],
                right * across[:, 1],
            ],
            axis=2,
        )
        weighted = slopes * weight[:, None]
        square = np.einsum("vpi,vpj->vij", weighted, slopes)
        square += 1e-4 * np.einsum("vii->v", square)[:, None, None] * np.eye(6)
        if step == STEPS:
            break
        change = np.linalg.solve(square, np.einsum("vpi,vp->vi", weighted, rest)[:, :, None])[:, :, 0]
        place = place + change[:, :2]
        matrix = matrix + change[:, 2:].reshape(-1, 2, 2)
    sure = (_correlation(wanted, value, weight) > SURE) & (np.linalg.det(matrix) > 0.1)
    error = (rest**2 * weight).sum(axis=1) * (weight**2).sum() * RELATED
    inverse = np.linalg.inv(square)
    errors = [np.einsum("i,vij,j->v", way, inverse, way) * error for way in (_GROWN, _TURNED)]
    return Found(place, matrix, sure, sure & (np.maximum(*errors) < TELLING**2))


def _correlation(one: FloatArray, other: FloatArray, weight: FloatArray) -> FloatArray:
    one, other = (part - (part * weight).sum(axis=1, keepdims=True) for part in (one, other))
    products = [((a * b) * weight).sum(axis=1) for a, b in ((one, other), (one, one), (other, other))]
    return np.asarray(products[0] / np.sqrt(np.maximum(products[1] * products[2], 1e-30)))


def _between(images: NDArray[np.float32], places: FloatArray) -> FloatArray:
    height, width = images.shape[:2]
    row = np.clip(places[:, 0], 0, height - 1.001)
    column = np.clip(places[:, 1], 0, width - 1.001)
    i, j = row.astype(np.intp), column.astype(np.intp)
    f, g = (row - i)[:, None], (column - j)[:, None]
    above = images[i, j] * (1 - g) + images[i, j + 1] * g
    below = images[i + 1, j] * (1 - g) + images[i + 1, j + 1] * g
    return np.asarray(above * (1 - f) + below * f)


def _phases(lattice: Lattice, places: FloatArray) -> FloatArray:
    """Return phases (n, waves) in turns, at the nearest pixels."""
    limits = np.array(lattice.phases.shape[1:]) - 1
    rows, columns = np.clip(np.rint(places), 0, limits).astype(np.intp).T
    rest = places - np.stack([rows, columns], axis=1)
    return np.asarray(lattice.phases[:, rows, columns].T / 65536 + rest @ lattice.waves.T)


def _brightness(pixels: PixelArray) -> FloatArray:
    return np.asarray(coded(pixels)[:, :, :3].mean(axis=2, dtype=np.float64))


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-30))
