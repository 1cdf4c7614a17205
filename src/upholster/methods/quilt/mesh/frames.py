"""Frames: the squares of pixels in which blocks on meshes are chosen and cut; and blocks of one frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import BlockTexels, LayNumbers, Span
from upholster.methods.quilt.mesh.footprints import Footprints
from upholster.types import IntArray

__all__ = ["Frame", "Lot", "enter_frame", "frame_numbers", "frame_span"]


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """Sizes of blocks: side and its mask's cells in frame pixels, their level, how many a model unit has.

    `texels` are final texels per working texel, which is a frame pixel on the surface.
    """

    size: int
    cell: int
    level: int
    scale: float
    texels: float

    @property
    def cells(self) -> int:
        """How many cells a mask has."""
        return (self.size // self.cell) ** 2


@dataclass(frozen=True, eq=False, slots=True)
class Lot:
    """Blocks that have frames of one size.

    Attributes
    ----------
    frame, footprints
        Their frame, and where each lies.
    blocks
        (n, `FRAME_COLUMNS`) see `lay_frames`.
    masks
        (n, cells of a frame) which of its cells each shows.
    """

    frame: Frame
    footprints: Footprints
    blocks: IntArray
    masks: NDArray[np.uint8]


def frame_numbers(numbers: LayNumbers, size: int) -> LayNumbers:
    """Return the numbers of blocks with another frame."""
    return numbers._replace(block_height=size, block_width=size, need_bottom=size, need_right=size)


def frame_span(numbers: LayNumbers) -> Span:
    """Return where a block's centre may read: its frame lies inside the exemplar."""
    half = numbers.block_height // 2
    return Span(
        *(half, numbers.height - half, half, numbers.width - half),
        *(-half, half - 1, -half, half - 1),
    )


def enter_frame(texels: BlockTexels) -> None:
    """Enter where a frame's texels fall: a pixel is a texel."""
    size = len(texels.ys)
    texels.rows[:], texels.columns[:] = np.arange(size + 2), np.arange(size + 2)
    texels.ys[:] = np.arange(size)[:, None] - size // 2
    texels.xs[:] = np.arange(size) - size // 2
