"""Whether borders between blocks show: compared with everywhere, or with the exemplar at the same places."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.covering.measure.samples import SEED, Samples, bilinear, coded
from upholster.covering.measure.seams import MeanDifference
from upholster.covering.measure.trace import Trace, step_sources, traces
from upholster.quilt.displacement import centre_matrices, levels_of
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.pyramid import most_levels, next_level

__all__ = ["check_measured", "cut_seam_ratio", "matched_cut_ratio", "sampled"]

BAND = 256
MOST_PAIRS = 2**17


def cut_seam_ratio(quilt: Quilt, texels: Texels) -> float | None:
    """Measure whether the borders between blocks show inside charts.

    The mean absolute difference between neighbouring texels (right and lower) that do not continue one
    another in the exemplar (`Border.cut`), divided by that between all neighbouring texels. A blended
    border counts in its middle. Values are sRGB-coded, all channels weigh the same. 1.0 is invisible, more
    shows, less is blur, or borders that run through quiet places: see `matched_cut_ratio`. At most 8 Mtexels
    are examined.

    Parameters
    ----------
    quilt
        Gives the placement that shows in each texel's cell.
    texels
        The quilt, painted at density 1.

    Returns
    -------
    float or None
        The ratio, 0 or more; 1.0 if neither shows any difference, infinite if only the borders do; None
        without borders.

    Raises
    ------
    InputError
        If the texels' charts are not the quilt's.

    References
    ----------
    As for `edge_seam_ratio`.
    """
    _check(quilt, texels)
    cuts, everywhere = MeanDifference(), MeanDifference()
    for trace in traces(quilt):
        window = trace.window
        cut = [np.zeros((window.height - (axis == 0), window.width - (axis == 1)), bool) for axis in (0, 1)]
        for axis in (0, 1):
            border = trace.border(axis)
            cut[axis][border.rows, border.columns] = border.cut
        pixels, shown = window.of(texels.arrays[window.index]), trace.owners >= 0
        pairs = shown[1:] & shown[:-1], shown[:, 1:] & shown[:, :-1]
        for start in range(0, window.height, BAND):
            stop = min(start + BAND, window.height)
            # One row more than the band: the lower neighbours of its last row.
            part = coded(pixels[start : stop + 1])
            rows = stop - start
            for one, other, axis in ((part[:rows, :-1], part[:rows, 1:], 1), (part[:-1], part[1:], 0)):
                for difference, wanted in ((cuts, cut[axis]), (everywhere, pairs[axis])):
                    chosen = wanted[start:stop]
                    difference.add(one[chosen], other[chosen])
    return cuts.over(everywhere)


def matched_cut_ratio(quilt: Quilt, texels: Texels, exemplar: PixelArray) -> float | None:
    """Measure whether the borders between blocks show, compared with the exemplar at the same places.

    Cuts and matched overlaps run through quiet places, of which regular textures have many. Compared with the
    average over all texels, even a visible border may look quiet. So the mean absolute difference between
    neighbouring texels p, q across a border is divided by the mean of two differences in the exemplar itself:
    between the places of p and q as the placement of p maps them, and as the placement of q does. 1.0 is as
    smooth as the exemplar, more shows, less is blur. About 2^17 pairs are examined.

    Parameters
    ----------
    quilt, texels
        As for `cut_seam_ratio`.
    exemplar
        (H, W, C) that the texels were painted from.

    Returns
    -------
    float or None
        As for `cut_seam_ratio`.

    Raises
    ------
    InputError
        If the texels' charts are not the quilt's, or the exemplar's shape is not.
    """
    check_measured(quilt, texels, exemplar)
    rng = np.random.default_rng(SEED)
    found = list(traces(quilt))
    most = max(64, MOST_PAIRS // (2 * max(1, len(found))))
    seen, expected = MeanDifference(), MeanDifference()
    levels = [exemplar]
    for trace in found:
        window = trace.window
        pixels = window.of(texels.arrays[window.index])
        for axis in (0, 1):
            border = trace.border(axis)
            cuts = rng.permutation(np.flatnonzero(border.cut))[:most]
            rows, columns = border.rows[cuts], border.columns[cuts]
            next_rows, next_columns = rows + (axis == 0), columns + (axis == 1)
            seen.add(coded(pixels[rows, columns]), coded(pixels[next_rows, next_columns]))
            here = (rows + window.row, columns + window.column)
            there = (next_rows + window.row, next_columns + window.column)
            for owner in (border.first[cuts], border.second[cuts]):
                places = (step_sources(trace.field, owner, *at).T / 16 for at in (here, there))
                expected.add(*(sampled(trace, owner, place, levels) for place in places))
    return seen.over(expected)


def sampled(trace: Trace, owner: NDArray[np.void], places: FloatArray, levels: list[PixelArray]) -> Samples:
    """Return the pixels that placements (n,) paint at the exemplar's `places` (n, 2): (n, C), sRGB-coded.

    `levels` is the pyramid so far, the exemplar first, and grows as needed.
    """
    places = _mirrored(places, levels[0].shape[:2])
    level = levels_of(centre_matrices(trace.field, owner), most_levels(*levels[0].shape[:2]))
    out = np.empty((len(owner), levels[0].shape[2]), np.float32)
    for k in np.unique(level).tolist():
        while len(levels) <= k:
            levels.append(next_level(levels))
        mine = level == k
        out[mine] = bilinear(levels[k], *((places[mine].T + 0.5) / 2 ** (k // 2) - 0.5))
    return out


def _mirrored(places: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    # Mirrored at the exemplar's edges, as in painting.
    turned = (places + 0.5) % (2 * np.array(shape))
    found: FloatArray = np.where(turned < shape, turned, 2 * np.array(shape) - turned) - 0.5
    return found


def check_measured(quilt: Quilt, texels: Texels, exemplar: PixelArray) -> None:
    """Raise InputError unless the texels have the quilt's charts, and the exemplar its shape."""
    _check(quilt, texels)
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape:
        raise InputError(f"sample has shape {exemplar.shape}; allowed: the quilt's, {quilt.exemplar_shape}")


def _check(quilt: Quilt, texels: Texels) -> None:
    if texels.charts != quilt.charts:
        raise InputError(
            "texels have other charts than the quilt; allowed: the quilt's own, painted at density 1"
        )
