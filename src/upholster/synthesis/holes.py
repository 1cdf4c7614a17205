"""Filling a hole with blocks: a flat texture of which everything around the hole is kept."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.charts.charted_surface import charted_plane
from upholster.charts.phases.phase_cells import TURN
from upholster.image.elements.lattice import Lattice
from upholster.image.masks import Used, filled, largest_square
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.quilt.sizes import suiting_side
from upholster.synthesis.quilt.steering import Steering
from upholster.synthesis.quilt.usable_blocks import LEAST_ROOM, largest_block, usable_side

__all__ = ["LARGEST_BLOCK", "check_room", "hole_places"]

LARGEST_BLOCK = 48
"""Default limit of a block's side in pixels: a photo is not a single texture, and no larger block would fit
around a hole."""

_SMALLEST, _TIMES = 24, 2
"""For narrow holes a block's side is limited to this many pixels, or this many times the hole's own width."""

_CELL = 2
"""Steps of a cell of labels."""


def check_room(used: Used, block: int | None, what: str) -> None:
    """Raise InputError unless a block fits into the used pixels; `what` names their owner in messages."""
    found = largest_square(used)
    if found < LEAST_ROOM:
        raise InputError(
            f"the largest square that {what} leaves to fill from is {found}x{found} pixels; "
            f"allowed: {LEAST_ROOM}x{LEAST_ROOM} or more"
        )
    most = min(512, 3 * min(used.shape) // 4, largest_block(used))
    if block is not None and not 8 <= block <= most:
        raise InputError(f"block is {block}; allowed: 8 to {most} with what {what} leaves to fill from")


def hole_places(
    exemplar: Exemplar,
    hole: NDArray[np.bool_],
    corner: tuple[int, int],
    *,
    block: int | None = None,
    seed: int = 0,
) -> IntArray:
    """Return the pixel of the exemplar that each pixel of a part of a photo shows, with its hole filled.

    Blocks are laid one after another, those next to kept pixels first.

    Parameters
    ----------
    exemplar
        The photo around the hole, of which blocks may show all but the hole; or, in one image, the photo and
        another sample, of which blocks then show all pixels.
    hole
        (h, w): the pixels missing in this part.
    corner
        Row and column in the exemplar of the part's first pixel.
    block
        Side of a block in pixels, within `check_room`; None: chosen for photo and hole.
    seed
        As in `upholster.synthesize`.

    Returns
    -------
    ndarray
        (h, w, 2): row and column.
    """
    pixels, used = exemplar.parts[-1], exemplar.masks[-1]
    assert used is not None
    side = usable_side(_side(pixels, hole), used) if block is None else block
    chart = Chart(0, *hole.shape)
    charted = charted_plane(chart)
    # Whole cells of labels are kept, so that no cell with a pixel of the hole shows the old pixels.
    stays = ~_in_cells(hole)
    kept = _as_it_is(chart, stays, corner, exemplar.shape), (stays,)
    if exemplar.guidance.rectangles:
        phases: tuple[_PhotoPhases | None, ...] = (None, None)
        steering = Steering(zones=(np.full(hole.shape, 2, np.uint8),), kept=kept)
    else:
        lattice = exemplar.lattices[0]
        phases = (None if lattice is None else _PhotoPhases(lattice, _gone_on(lattice, used), corner),)
        steering = Steering(kept=kept)
    scene = Scene(
        charted,
        np.broadcast_to((1.0, 0.0, 0.0), (len(charted.chart), 3, 3)),
        (WarpField.identity(),),
        QuiltOptions(block=side),
        np.zeros(len(charted.chart), np.int32),
        phases=phases,
        steering=steering,
    )
    quilt = laid_quilt(lay_plan(scene, exemplar, seed=seed))
    found: IntArray = quilt.sources()[0] // 16
    return found


def _side(pixels: PixelArray, hole: NDArray[np.bool_]) -> int:
    width = max(_SMALLEST, _TIMES * largest_square(hole))
    return min(suiting_side(pixels.shape, repeats=False), LARGEST_BLOCK, width) // 4 * 4


def _in_cells(hole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    # The cells that contain any part of a hole, as pixels.
    height, width = hole.shape
    whole = np.pad(hole, ((0, -height % _CELL), (0, -width % _CELL)))
    cells = whole.reshape(len(whole) // _CELL, _CELL, -1, _CELL).any(axis=(1, 3))
    return cells.repeat(_CELL, axis=0).repeat(_CELL, axis=1)[:height, :width]


def _as_it_is(
    chart: Chart, stays: NDArray[np.bool_], corner: tuple[int, int], shape: tuple[int, ...]
) -> Quilt:
    # A quilt with one placement, which reads the photo at each step. Its centre is at a kept step: a block
    # that shows only the cell of another placement's centre is left out.
    placed = np.zeros(1, PLACEMENT)
    centre = np.unravel_index(np.argmax(stays), stays.shape)
    for name, at, first in zip(("row", "column"), centre, corner, strict=True):
        # The middle of a step is half a step after its number, that of a pixel at its number.
        placed[name], placed[f"source_{name}"] = 16 * at + 8, 16 * (first + at)
    labels = np.zeros(label_shape(chart.height, chart.width, _CELL), np.int32)
    layers = ((LabelMap(_CELL, labels),),)
    return Quilt((chart,), (shape[0], shape[1]), placed, layers, (WarpField.identity(),))


@dataclass(frozen=True, eq=False, slots=True)
class _PhotoPhases:
    # The wanted phases of a photo: its own, and in the hole a continuation of those around it.
    lattice: Lattice
    phases: NDArray[np.int16]  # (n, H, W)
    corner: tuple[int, int]

    @property
    def waves(self) -> FloatArray:
        """The photo's waves."""
        return self.lattice.waves

    def at(self, _: IntArray, points: FloatArray) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) of the flat texture, (n, m)."""
        row = np.floor(-points[:, 1]).astype(np.int64) + self.corner[0]
        column = np.floor(points[:, 0]).astype(np.int64) + self.corner[1]
        return self.phases[:, row, column]


def _gone_on(lattice: Lattice, used: Used) -> NDArray[np.int16]:
    # Phases over the hole, where pixels have no information. Their lead over even waves is interpolated from
    # around the hole.
    rows, columns = np.arange(used.shape[0])[:, None], np.arange(used.shape[1])
    found = []
    for wave, phases in zip(lattice.waves, lattice.phases, strict=True):
        even = wave[0] * rows + wave[1] * columns
        ahead: Any = 2 * np.pi * (phases / TURN - even)
        around = filled(np.stack([np.cos(ahead), np.sin(ahead)], axis=2).astype(np.float32), used)
        turns = even + np.arctan2(around[:, :, 1], around[:, :, 0]) / (2 * np.pi)
        gone = np.rint(TURN * (turns - np.rint(turns))).astype(np.int64).astype(np.int16)
        found.append(np.where(used, phases, gone))
    return np.stack(found)
