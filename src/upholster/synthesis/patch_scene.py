"""The scene of methods "paper" and "pixel"."""

from dataclasses import dataclass

from upholster.quilt.chart import Chart
from upholster.synthesis.paper.method import PaperOptions
from upholster.synthesis.pixel.method import PixelOptions

__all__ = ["PatchScene"]


@dataclass(frozen=True, eq=False)
class PatchScene:
    """A surface as methods "paper" and "pixel" cover it, patch by patch.

    Attributes
    ----------
    charts
        The layout, in texels.
    options
        The method's options, with all values set.
    scale, field
        As in `upholster.synthesis.quilt.scene.Scene`: there are none.
    """

    charts: tuple[Chart, ...]
    options: PaperOptions | PixelOptions
    scale: None = None
    field: None = None

    @property
    def painted(self) -> tuple[Chart, ...]:
        """The charts at their painted size, in texels."""
        return self.charts
