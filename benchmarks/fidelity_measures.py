"""What a flat result is judged by: the project's own measures, and Portilla and Simoncelli's statistics."""

import warnings
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from benchmarks.fidelity_methods import Made
from upholster.measure import copies, matched_cut_ratio, measure_image
from upholster.measure.samples import coded
from upholster.quilt import Texels
from upholster.types import PixelArray

__all__ = ["JUDGED", "Judgement", "judge", "statistics_error"]

JUDGED = ("ps", "swd", "structure")
"""Fields of `Judgement` that every flat picture has: smaller is better. Methods are ranked by these."""

GREY = np.array([0.299, 0.587, 0.114])


@dataclass(frozen=True)
class Judgement:
    """Figures of one result; None where a measure does not apply.

    Attributes
    ----------
    ps
        Portilla–Simoncelli error, see `statistics_error`.
    swd
        Sliced Wasserstein distance, mean over the levels, and `swd_levels` each.
    structure
        Absolute structure loss: autocorrelation at the exemplar's own peaks that is lost or won.
    copy_ratio, longest, cuts
        `upholster.measure.copies` and `matched_cut_ratio`, where there is a quilt.
    seconds
        Time to make it.
    """

    ps: float | None
    swd: float
    swd_levels: tuple[float, ...]
    structure: float | None
    copy_ratio: float | None
    longest: int | None
    cuts: float | None
    seconds: float

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return asdict(self)


def judge(made: Made, exemplar: PixelArray, seconds: float, *, with_ps: bool = True) -> Judgement:
    """Measure one result against its exemplar; `seconds` is what it took."""
    found = measure_image(made.image, exemplar)
    copied = cuts = None
    if made.quilt is not None:
        copied = copies(made.quilt)
        cuts = matched_cut_ratio(made.quilt, Texels(made.quilt.charts, (made.image,)), exemplar)
    loss = found.structure.loss
    return Judgement(
        ps=statistics_error(made.image, exemplar) if with_ps else None,
        swd=found.wasserstein_mean,
        swd_levels=found.wasserstein,
        structure=None if loss is None else abs(loss),
        copy_ratio=None if copied is None else copied.ratio,
        longest=None if copied is None else copied.longest,
        cuts=cuts,
        seconds=seconds,
    )


def statistics_error(image: PixelArray, exemplar: PixelArray) -> float | None:
    """Return how far the texture statistics of Portilla and Simoncelli are from the exemplar's, relatively.

    ``‖S(image) − S(exemplar)‖ / ‖S(exemplar)‖``, S being all statistics of the steerable pyramid (4 scales, 4
    orientations, neighbourhood 7: 710 numbers for 128² and larger) of the whole picture in grey, sRGB-coded
    from 0 to 1, as the package plenoptic computes them. None where that is not installed.

    References
    ----------
    Portilla, Simoncelli: A parametric texture model based on joint statistics of complex wavelet
    coefficients, IJCV 40 (2000).
    """
    try:
        wanted, found = (_statistics(picture) for picture in (exemplar, image))
    except ImportError:
        return None
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def _statistics(picture: PixelArray) -> Any:
    import plenoptic
    import torch

    values = coded(picture).astype(np.float64)
    grey = values[:, :, 0] if values.shape[2] < 3 else values[:, :, :3] @ GREY
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of sizes that are no power of two, and of its own defaults
        model = plenoptic.models.PortillaSimoncelli(grey.shape).double()
        return model(torch.from_numpy(grey)[None, None])[0, 0].numpy()
