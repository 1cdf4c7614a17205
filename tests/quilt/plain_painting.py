"""Painting (SPEC.md, section 8) in plain Python and NumPy: what a texel shows, wherever it reads."""

import numpy as np
from random_quilts import weights_of

from upholster.quilt.placement import SYMMETRIES


def plain_matrix(field, row, column):
    nodes = field.matrices.astype(object)
    i, j, down, right = field.margin + row // 32, field.margin + column // 32, row % 32, column % 32
    rows, columns = nodes.shape[:2]

    def node(a, b):
        return nodes[min(max(a, 0), rows - 1), min(max(b, 0), columns - 1)]

    total = (node(i, j) * (32 - right) + node(i, j + 1) * right) * (32 - down)
    total = total + (node(i + 1, j) * (32 - right) + node(i + 1, j + 1) * right) * down
    return [(int(value) + 512) // 1024 for value in total]


def plain_halved(image):
    """Halve by the formula, axis after axis, with the edges padded."""
    whole = image.dtype != np.float32
    part = image.astype(np.int64 if whole else np.float32)
    for axis in (0, 1):
        part = np.moveaxis(part, axis, 0)
        size = (len(part) + 1) // 2
        padded = np.concatenate([part[:1], part, part[-1:], part[-1:]])
        taps = [padded[k : k + 2 * size : 2] for k in range(4)]
        part = np.moveaxis((taps[0] + taps[3]) + 3 * (taps[1] + taps[2]), 0, axis)
    return ((part + 32) // 64).astype(image.dtype) if whole else (part / 64).astype(np.float32)


def plain_sample(image, row, column):
    """Sample bilinearly at 1/16 pixel, clamped to the image: with 6 fractional bits for integers."""
    row = min(max(row, 0), 16 * (image.shape[0] - 1))
    column = min(max(column, 0), 16 * (image.shape[1] - 1))
    i, j, y, x = row // 16, column // 16, row % 16, column % 16

    def pixel(a, b):
        # A neighbour beyond the rim has no weight.
        value = image[min(a, image.shape[0] - 1), min(b, image.shape[1] - 1)]
        return value if image.dtype == np.float32 else value.astype(np.int64)

    taps = [
        (pixel(i, j), (16 - y) * (16 - x)),
        (pixel(i, j + 1), (16 - y) * x),
        (pixel(i + 1, j), y * (16 - x)),
        (pixel(i + 1, j + 1), y * x),
    ]
    if image.dtype == np.float32:
        (a, p), (b, q), (c, r), (d, s) = [(value, np.float32(w / 256)) for value, w in taps]
        return ((a * p + b * q) + c * r) + d * s
    return (sum(value * w for value, w in taps) + 2) // 4


def plain_paint(quilt, exemplar, index, outside=1):
    """Paint chart `index` by the formula, with Python's own integers: the oracle of the kernels.

    `outside`: what cells are that no window holds.
    """
    whole = exemplar.dtype != np.float32
    levels = [exemplar]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(plain_halved(levels[-1]))
    chart, field = quilt.charts[index], quilt.fields[index]
    canvas = np.zeros((chart.height, chart.width, exemplar.shape[2]), np.int64 if whole else np.float32)
    for placement in quilt.on_chart(index):
        weights = weights_of(quilt, placement, outside)
        (a, b), (c, d) = SYMMETRIES[placement["symmetry"]].reshape(2, 2).tolist()
        row0, column0 = int(placement["row"]), int(placement["column"])
        centre = plain_matrix(field, row0, column0)
        if placement["centred"]:
            centre = placement["matrix"].tolist()
        determinant = centre[0] * centre[3] - centre[1] * centre[2]
        level = sum(determinant >= 2 * 4**m * 4096**2 for m in range(len(levels) - 1))
        top, left = row0 - int(placement["height"]) // 2, column0 - int(placement["width"]) // 2
        for row in range(max(top, 0), min(top + int(placement["height"]), chart.height)):
            for column in range(max(left, 0), min(left + int(placement["width"]), chart.width)):
                i, j, y, x = row - top, column - left, row - row0, column - column0
                if weights[i, j] == 0:
                    continue
                m = [p + q for p, q in zip(centre, plain_matrix(field, row, column), strict=True)]
                v, w = (m[0] * y + m[1] * x + 256) // 512, (m[2] * y + m[3] * x + 256) // 512
                at_row = (int(placement["source_row"]) + a * v + b * w + 8) // 2**level - 8
                at_column = (int(placement["source_column"]) + c * v + d * w + 8) // 2**level - 8
                new, old = plain_sample(levels[level], at_row, at_column), canvas[row, column]
                if whole:
                    canvas[row, column] = (old * (256 - weights[i, j]) + new * weights[i, j] + 128) >> 8
                else:
                    part = np.float32(weights[i, j] / 256)
                    canvas[row, column] = old * (1 - part) + new * part
    return ((canvas + 32) >> 6).astype(exemplar.dtype) if whole else canvas
