"""From an exemplar and a surface to a quilt: the one call that chooses layout and method."""

from upholster.errors import InputError, nearest
from upholster.geometry import Surface
from upholster.image import check_exemplar
from upholster.synthesis.layout import uniform_layout
from upholster.synthesis.paper import PaperOptions, synthesize_paper
from upholster.synthesis.quilt import Quilt
from upholster.types import PixelArray, Progress

__all__ = ["METHODS", "synthesize"]

METHODS = ("paper",)


def synthesize(
    exemplar: PixelArray,
    surface: Surface,
    *,
    method: str = "paper",
    chart: int = 512,
    block: int = 32,
    overlap: int = 8,
    levels: int = 3,
    seams: bool = True,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Synthesise texture over a surface.

    Parameters
    ----------
    exemplar
        (H, W) or (H, W, C) with 1 to 4 channels, 32×32 to 4096×4096; uint8, uint16 or float.
    surface
        The surface to cover.
    method
        "paper": see `upholster.synthesis.paper`.
    chart
        Side of each patch's chart in texels, from a block to 16384.
    block, overlap, levels, seams
        Parameters of method "paper", see `PaperOptions`.
    seed
        0 to 2^63 − 1. The same seed gives the same quilt, whatever the number of threads and on any machine.
    threads
        1 to 256; by default one per core.
    progress
        Called as ``progress(stage, done, total)``, with stages "blocks" and "seams".

    Returns
    -------
    Quilt
        Charts and placements; `upholster.paint` makes texels of it.

    Raises
    ------
    InputError
        If something is out of range or does not fit together, before any work is done.
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}; {nearest(method, METHODS)}")
    options = PaperOptions(block=block, overlap=overlap, levels=levels, seams=seams)
    checked = check_exemplar(exemplar)
    charts = uniform_layout(surface, chart=chart)
    return synthesize_paper(
        checked, surface, charts, options=options, seed=seed, threads=threads, progress=progress
    )
