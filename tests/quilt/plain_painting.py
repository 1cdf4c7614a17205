"""Painting (SPEC.md, section 8) in plain Python: what a texel shows, wherever it reads."""

from functools import cache
from math import isqrt

import numpy as np

from upholster.quilt.placement import SYMMETRIES

F = np.float32


def plain_matrix(field, row, column):
    """Return M at a place in 1/16 step: between rows of nodes, then between columns."""
    nodes = field.matrices.astype(object)

    def between(place, count):
        i, part = field.margin + (place - 8) // 512, (place - 8) % 512
        i, part = (0, 0) if i < 0 else (count - 1, 0) if i >= count - 1 else (i, part)
        return i, min(i + 1, count - 1), part

    (i, below, f), (j, beside, g) = between(row, nodes.shape[0]), between(column, nodes.shape[1])
    left, right = (((512 - f) * nodes[i, k] + f * nodes[below, k] + 256) // 512 for k in (j, beside))
    return [int(value) for value in ((512 - g) * left + g * right + 256) // 512]


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


def plain_softened(image):
    """Filter by (1, 6, 1) by the formula, axis after axis, with the edges padded."""
    whole = image.dtype != np.float32
    part = image.astype(np.int64 if whole else np.float32)
    for axis in (0, 1):
        part = np.moveaxis(part, axis, 0)
        padded = np.concatenate([part[:1], part, part[-1:]])
        part = np.moveaxis((padded[:-2] + padded[2:]) + 6 * part, 0, axis)
    return ((part + 32) // 64).astype(image.dtype) if whole else (part / 64).astype(np.float32)


def plain_levels(image):
    levels = [image]
    while max(image.shape[:2]) > 1:
        levels.append(plain_softened(image))
        image = plain_halved(image)
        levels.append(image)
    return levels


def mirrored(place, size):
    place %= 2 * size
    return place if place < size else 2 * size - 1 - place


def plain_sample(image, row, column):
    """Sample bilinearly at 1/16 pixel, mirrored beyond the image; of integers 256 times the value."""
    i, j, y, x = row // 16, column // 16, row % 16, column % 16
    taps = []
    for a, b, weight in (
        (i, j, (16 - y) * (16 - x)), (i, j + 1, (16 - y) * x), (i + 1, j, y * (16 - x)), (i + 1, j + 1, y * x)
    ):  # fmt: skip
        taps.append((image[mirrored(a, image.shape[0]), mirrored(b, image.shape[1])], weight))
    if image.dtype == np.float32:
        (a, p), (b, q), (c, r), (d, s) = [(value, F(weight / 256)) for value, weight in taps]
        return ((a * p + b * q) + c * r) + d * s
    return sum(value.astype(np.int64) * weight for value, weight in taps)


def plain_place(field, placement, row, column):
    """Return where a placement reads at a place, in 1/16 pixel."""
    centre = plain_centre(field, placement)
    m = [p + q for p, q in zip(centre, plain_matrix(field, row, column), strict=True)]
    down = min(max(row - int(placement["row"]), -16383), 16383)
    right = min(max(column - int(placement["column"]), -16383), 16383)
    v, w = (
        (a * (down // 16) + b * (right // 16) + (a * (down % 16) + b * (right % 16)) // 16 + 256) // 512
        for a, b in (m[:2], m[2:])
    )
    (a, b), (c, d) = SYMMETRIES[placement["symmetry"]].reshape(2, 2).tolist()
    return int(placement["source_row"]) + a * v + b * w, int(placement["source_column"]) + c * v + d * w


def plain_centre(field, placement):
    there = plain_matrix(field, int(placement["row"]), int(placement["column"]))
    return [m + int(offset) for m, offset in zip(there, placement["offset"], strict=True)]


def plain_weights(layer, row, column):
    """Return label and weight, in 1/256, of what shows at a place, in the order of the cells."""
    cell = 16 * layer.cell
    moved = [place + cell - (0 if layer.half else cell // 2) for place in (row, column)]
    (i, j), (f, g) = [m // cell for m in moved], [m % cell // layer.cell for m in moved]
    found = {}
    for a, b, weight in (
        (i, j, (16 - f) * (16 - g)), (i, j + 1, (16 - f) * g), (i + 1, j, f * (16 - g)), (i + 1, j + 1, f * g)
    ):  # fmt: skip
        label = int(layer.labels[a, b])
        found[label] = found.get(label, 0) + weight
    return {label: weight for label, weight in found.items() if weight and label >= 0}


def plain_tone(quilt, levels, level_of, index, cell):
    """Return a cell's tone: for integers in 1/256 sample of 8 bits, or in samples of 16."""
    layer, field, placed = quilt.labels[index][0], quilt.fields[index], quilt.on_chart(index)
    (high, wide), (i, j) = layer.labels.shape, cell
    row, column = (16 * layer.cell * (n - 1) + (0 if layer.half else 8 * layer.cell) for n in cell)

    def shades(label):
        k = min(level_of[label] // 2 + 3, len(levels) // 2)
        place = plain_place(field, placed[label], row, column)
        found = plain_sample(levels[2 * k], *((one + 8) // 2**k - 8 for one in place))
        return (found + 128) // 256 if levels[0].dtype == np.uint16 else found

    weights, covered = {}, 0
    for a in range(max(i - 7, 0), min(i + 8, high)):
        for b in range(max(j - 7, 0), min(j + 8, wide)):
            weight, label = (8 - abs(a - i)) * (8 - abs(b - j)), int(layer.labels[a, b])
            covered += weight
            if label != layer.labels[i, j] and (label in weights or len(weights) < 8):
                weights[label] = weights.get(label, 0) + weight
    whole, fade = levels[0].dtype != np.float32, min(max(covered - 2560, 0) // 4, 256)
    total = np.zeros(levels[0].shape[2], np.int64 if whole else F)
    for label, weight in weights.items():
        difference = shades(label) - shades(int(layer.labels[i, j]))
        total = total + difference * (weight if whole else F(weight))
    return (total // 256 * fade + 2048) // 4096 if whole else total * F(fade / 2**20)


def plain_toned(layer, tones, row, column, value):
    """Return a texel with the tone between the four cells around it."""
    cell = 16 * layer.cell
    moved = [place + cell - (0 if layer.half else cell // 2) for place in (row, column)]
    (i, j), (f, g) = [m // cell for m in moved], [m % cell // layer.cell for m in moved]
    taps = tones(i, j), tones(i, j + 1), tones(i + 1, j), tones(i + 1, j + 1)
    weights = (16 - f) * (16 - g), (16 - f) * g, f * (16 - g), f * g
    if value.dtype == F:
        a, b, c, d = (tap * F(weight / 256) for tap, weight in zip(taps, weights, strict=True))
        return value + (((a + b) + c) + d)
    shift, top = (16, 255) if value.dtype == np.uint8 else (8, 65535)
    tone = sum(tap * weight for tap, weight in zip(taps, weights, strict=True))
    return np.clip(value + (tone + 2 ** (shift - 1)) // 2**shift, 0, top)


def plain_paint(quilt, exemplar, index, density=1):
    """Paint chart `index` texel by texel."""
    whole, levels = exemplar.dtype != np.float32, plain_levels(exemplar)
    chart, field, placed = quilt.charts[index], quilt.fields[index], quilt.on_chart(index)
    n, m = (max(1, int(np.floor(side * density + 0.5))) for side in (chart.height, chart.width))
    ratio = (n * m) / (chart.height * chart.width)
    out = np.zeros((n, m, exemplar.shape[2]), exemplar.dtype)
    level_of = []
    for placement in placed:
        a, b, c, d = plain_centre(field, placement)
        level_of.append(sum(a * d - b * c >= 2.0**25 * 2**k * ratio for k in range(len(levels) - 1)))
    tones = cache(lambda i, j: plain_tone(quilt, levels, level_of, index, (i, j)))
    for t in range(n):
        for u in range(m):
            row, column = (2 * t + 1) * 8 * chart.height // n, (2 * u + 1) * 8 * chart.width // m
            for layer in quilt.labels[index]:
                shown = plain_weights(layer, row, column)
                total, rest = (0, 256 - sum(shown.values())) if whole else (F(0), 256 - sum(shown.values()))
                if not shown:
                    continue
                for label, weight in shown.items():
                    k = level_of[label]
                    place = plain_place(field, placed[label], row, column)
                    value = plain_sample(levels[k], *((one + 8) // 2 ** (k // 2) - 8 for one in place))
                    total = total + (value * weight if whole else value * F(weight / 256))
                if whole:
                    out[t, u] = (out[t, u].astype(np.int64) * 256 * rest + total + 2**15) // 2**16
                else:
                    out[t, u] = total + (out[t, u] * F(rest / 256) if rest else F(0))
            if quilt.has_tones:
                toned = slice(out.shape[2] - (1 - out.shape[2] % 2))  # without alpha
                out[t, u, toned] = plain_toned(quilt.labels[index][0], tones, row, column, out[t, u])[toned]
    return out


def plain_turned(matrix, x, y, top):
    """Return a whole normal's (x, y) turned by the angle of a matrix's second column."""
    v, w = int(matrix[1]), int(matrix[3])
    while max(abs(v), abs(w)) > 32767:
        v, w = v // 2, w // 2
    while (v or w) and max(abs(v), abs(w)) < 16384:
        v, w = 2 * v, 2 * w
    length = max(isqrt(v * v + w * w), 1)
    sine, cosine = ((8192 * part + length // 2) // length for part in (v, w))
    x, y = 2 * int(x) - top, 2 * int(y) - top
    parts = x * cosine - y * sine, x * sine + y * cosine
    assert max(v * v + w * w, *(8192 * (part + 2 * length) + length for part in (v, w))) < 2**31
    assert max(map(abs, parts)) + 8192 * (top + 1) < 2**31
    return [min(max((part + 8192 * (top + 1)) // 2**14, 0), top) for part in parts]
