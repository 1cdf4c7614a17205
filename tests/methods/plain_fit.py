"""How transferred blocks are shown on their other chart, once more, in NumPy: an oracle for `fit_blocks`."""

from typing import Any

import numpy as np
from plain_quilt import matrix

from upholster.quilt.placement import SYMMETRIES


def plain_fit(transition: Any, block: Any, ends: Any, old: Any, new: Any, chart: Any) -> Any:
    """Return what each block becomes: None, or its place, symmetry, source, and its own matrix or None."""
    return [_fitted(transition, one, end, old, new, chart) for one, end in zip(block, ends, strict=True)]


def _fitted(transition: Any, block: Any, end: Any, old: Any, new: Any, chart: Any) -> Any:
    seam = transition.seam
    own = np.array([block["row"], block["column"]], float)
    row, column, forth = (at[0] for at in transition.apply(own[:1], own[1:]))
    if not (np.isfinite(row) and abs(np.linalg.det(forth)) > 1e-6):
        return None
    back, other = np.linalg.inv(forth), np.rint([row, column])
    there = new.at(*other[:, None])[0]
    if abs(np.linalg.det(there)) <= 1e-6:
        return None
    whole = block["matrix"] if block["centred"] else matrix(old, int(own[0]), int(own[1]))
    centre, turned = whole.reshape(2, 2) / 4096, SYMMETRIES[block["symmetry"]].reshape(2, 2)
    wanted = turned @ centre @ back @ np.linalg.inv(there)
    wanted /= np.sqrt(abs(np.linalg.det(wanted)))
    likeness = [(wanted * one.reshape(2, 2)).sum() for one in SYMMETRIES]
    symmetry = int(np.argmax(likeness))
    if likeness[symmetry] <= 2 * np.cos(np.radians(25)):
        return None
    unturned = SYMMETRIES[symmetry].reshape(2, 2).T
    # What the block shows at five places along the seam, and where these lie on the other chart.
    along = end[0] + (end[1] - end[0]) * (np.arange(5) + 0.5) / 5
    there_along = np.interp(along, *_rising(seam))
    here = _places(seam.edge, transition.line, along)
    there = _places(seam.other_edge, transition.other_line, there_along)
    start = np.array([block["source_row"], block["source_column"]]) / 16
    seen = [start + turned @ _displaced(old, centre, own, place) for place in here]
    seen = np.array([unturned @ one for one in seen])
    plain = matrix(new, int(other[0]), int(other[1])).reshape(2, 2)
    source, error = _source(new, plain / 4096, other, seen, there)
    place = (row, column, *back.ravel())
    found = (place, symmetry, unturned.T @ source * 16, None)
    if error <= 0.4 or not _ends_within(chart, seam.other_edge, block, back):
        return found
    # A centre matrix of its own: least squares, held to what is expected.
    expected = unturned @ turned @ centre @ back
    rest = seen - [_displaced(new, expected, other, one) for one in there]
    lever = 0.5 * (there - other)
    rest, lever = rest - rest.mean(axis=0), lever - lever.mean(axis=0)
    change = rest.T @ lever @ np.linalg.inv(lever.T @ lever + 30 * np.eye(2))
    fit = plain + 64 * np.rint(((expected + change) * 4096 - plain) / 64)
    own_source, own_error = _source(new, fit / 4096, other, seen, there)
    sound = np.linalg.det(fit) > 0 and 2 * np.abs(fit - plain).max() < np.abs(plain).max()
    if own_error < 0.75 * error and sound:
        return place, symmetry, unturned.T @ own_source * 16, fit.ravel()
    return found


def _rising(seam: Any) -> Any:
    return [seam.start, seam.stop], [seam.other_start, seam.other_stop]


def _places(edge: int, line: float, along: Any) -> Any:
    across = np.full_like(along, line)
    return np.stack([along - 0.5, across] if edge & 1 else [across, along - 0.5], axis=1)


def _displaced(field: Any, centre: Any, at: Any, place: Any) -> Any:
    return 0.5 * (centre + field.at(*place[:, None])[0]) @ (place - at)


def _source(field: Any, centre: Any, at: Any, seen: Any, places: Any) -> Any:
    apart = seen - [_displaced(field, centre, at, place) for place in places]
    return apart.mean(axis=0), np.abs(apart - apart.mean(axis=0)).max()


def _ends_within(chart: Any, edge: int, block: Any, back: Any) -> bool:
    (a, b), (c, d) = np.abs(back)
    size = abs(np.linalg.det(back))
    if edge & 1:
        return bool(c * block["height"] + a * block["width"] <= size * (chart.width + 1e-6))
    return bool(d * block["height"] + b * block["width"] <= size * (chart.height + 1e-6))
