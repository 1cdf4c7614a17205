"""Method "quilt" over a charted surface: lays overlapping blocks, then makes a quilt of their visible parts.

`planned` sets all parameters, `laying` lays blocks, parcel by parcel, and `emit` makes placements and labels
of their visible parts.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface
from upholster.charts.size_map import SizeField
from upholster.elements import Lattice, find_joints
from upholster.errors import InputError
from upholster.image.masks import Used
from upholster.methods.quilt._block_kernels import LayNumbers, LayWeights
from upholster.methods.quilt._phase_kernels import MISFIT
from upholster.methods.quilt.emit import LabelPiece, emitted_quilt, label_pieces
from upholster.methods.quilt.guides import Asked, Rectangle, Steering, cropped, guide_costs, level_guides
from upholster.methods.quilt.lay_plan import LayPlan
from upholster.methods.quilt.laying import ParcelBlocks, draw_parcel, lay_parcel
from upholster.methods.quilt.match_pyramid import MatchPyramid, SamplePart, match_pyramid
from upholster.methods.quilt.parcels import MOST_WHOLE, Parcels
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.quilt_options import QuiltOptions
from upholster.methods.quilt.usable import allowed_places, level_with_room, used_level
from upholster.parallel import run_tasks, thread_count
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = ["laid_quilt", "planned", "step_level"]

_OVERLAP = 0.3
"""Default overlap of blocks, as a fraction of their side."""

_DIFFERING = 1.5
"""Least tolerance for a region that is laid again: else all seeds would give the same."""

_RELAY = 0.2
"""Least gain of laying again, for each pixel of a frame's side, as a fraction of the sample's variance."""

_COARSE = 24
"""Frames of at least this many pixels have mask cells 4 pixels wide, smaller frames 2 pixels."""

_LARGEST_FRAME, _SHARE = 512, 0.75
"""Maximum side of a frame in pixels, and as a fraction of the sample: larger frames would leave no choice."""

_MIRRORED = 1 << 5
"""The bit of the symmetry that mirrors left and right: columns count backwards."""


def planned(
    exemplar: PixelArray,
    surface: ChartedSurface,
    fields: tuple[WarpField, ...],
    vectors: FloatArray,
    scale: float,
    *,
    fold: int = 1,
    turns: IntArray | None = None,
    options: QuiltOptions,
    phases: WantedPhases | None = None,
    sizes: SizeField | None = None,
    used: Used | None = None,
    steering: Steering | None = None,
    seed: int = 0,
) -> LayPlan:
    """Return the plan by which a surface is covered with one texture.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    surface, fields
        The charts, and their warp fields.
    vectors
        (T, 3, 3), unit vectors at the triangles' corners: the direction of the exemplar's rows.
    scale
        Exemplar pixels per model unit.
    fold, turns
        1, 2 or 4: this many evenly rotated directions count as one where a block extends from triangle to
        triangle; and (T,) the quarter turns from the warp fields to the directions, by default none, see
        `upholster.charts.turns`.
    options
        Parameters of the method.
    phases
        For a sample that repeats: its own phases, and those that the surface requests. None: phases do not
        count.
    sizes
        Factor by which the sample is enlarged at each place, as in the warp fields; None: 1 everywhere.
    used
        (H, W) the pixels of the exemplar that blocks may show, see `check_used`; None: all.
    steering
        The requests to blocks; None: there are none.
    seed
        0 to 2^63 − 1; the same seed gives the same quilt with any number of threads.
    """
    zones = None if steering is None else steering.zones
    wanted = (phases,) if zones is None else zones.phases
    rectangles = () if zones is None else zones.rectangles
    masks = _masks(rectangles, used, exemplar.shape[:2])
    parts = _parts(exemplar, rectangles, tuple(None if one is None else one.lattice for one in wanted))
    # The level must be fine enough for the places where the sample is largest.
    coarsest = scale if sizes is None else scale / sizes.most
    pyramid, numbers = _numbers(exemplar, surface, options, coarsest, parts, masks)
    match = pyramid.levels[numbers.level].match
    if masks:
        allowed = _allowed(numbers, masks)
        match = match._replace(allowed=allowed, places=np.flatnonzero(allowed))
    asked = None
    if steering is not None:
        level = numbers.height, numbers.width
        asked = Asked.of(steering, surface.charts, numbers.level, level)
        match = match._replace(
            guides=level_guides(steering.guides, numbers.level, level),
            costs=guide_costs(steering.guides, pyramid.variance),
        )
    block = numbers.size * 2**numbers.level / scale
    phase = max(0.0 if one is None else one.weight for one in wanted)
    differs = steering is not None and steering.differs
    tolerance = max(options.tolerance, _DIFFERING) if differs else options.tolerance
    weights = LayWeights(tolerance, phase * pyramid.variance / MISFIT, _RELAY * pyramid.variance)
    density = _density(surface)
    return LayPlan(
        surface,
        vectors,
        fields,
        np.zeros(len(surface.chart), np.int32) if turns is None else turns,
        fold,
        options.crease,
        (exemplar.shape[0], exemplar.shape[1]),
        scale,
        density,
        match,
        numbers,
        weights,
        _OVERLAP if options.overlap is None else options.overlap / options.block,
        tuple(None if one is None else one.surface for one in wanted),
        int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]),
        _parcels(surface, vectors, block if sizes is None else block * sizes.most, density, steering),
        asked,
        None if steering is None or steering.kept is None else steering.kept[0],
        () if steering is None else steering.put,
        sizes,
        differs,
    )


def _parcels(
    surface: ChartedSurface, vectors: FloatArray, block: float, density: float, steering: Steering | None
) -> Parcels:
    parcels = Parcels.of(surface, vectors, block, density)
    if len(parcels) > 1 and steering is not None and (steering.kept is not None or steering.put):
        raise InputError(
            f"again, put or a pin is given on more than {MOST_WHOLE:,} steps; allowed: fewer texels"
        )
    return parcels


@stage
def _masks(rectangles: tuple[Rectangle, ...], used: Used | None, shape: tuple[int, ...]) -> tuple[Used, ...]:
    # For each zone the pixels (H, W) that it may show; empty: all pixels of the only sample.
    if not rectangles:
        return () if used is None else (used,)
    found = []
    for row, column, height, width in rectangles:
        mask = np.zeros(shape, np.bool_)
        mask[row : row + height, column : column + width] = True
        found.append(mask if used is None else mask & used)
    return tuple(found)


@stage
def _parts(
    exemplar: PixelArray, rectangles: tuple[Rectangle, ...], lattices: tuple[Lattice | None, ...]
) -> tuple[SamplePart, ...]:
    # The samples in an exemplar, with the lattice and the joints of each.
    if not rectangles:
        return (SamplePart.whole(exemplar, lattices[0], find_joints(exemplar)),)
    found = []
    for rectangle, lattice in zip(rectangles, lattices, strict=True):
        row, column, height, width = rectangle
        rows, columns = slice(row, row + height), slice(column, column + width)
        found.append(SamplePart(rows, columns, lattice, find_joints(cropped(exemplar, rectangle))))
    return tuple(found)


def _allowed(numbers: LayNumbers, masks: Sequence[Used]) -> NDArray[np.uint8]:
    # For each pixel of the level, the zone of a block with its source there; 0: no block may have it there.
    found = np.zeros(numbers.height * numbers.width, np.uint8)
    for zone, mask in enumerate(masks, 1):
        found[allowed_places(used_level(mask, numbers.level), numbers.size) != 0] = zone
    return found


def laid_quilt(plan: LayPlan, threads: int | None = None, progress: Progress | None = None) -> Quilt:
    """Lay a surface's blocks on threads of this process, and return its quilt.

    `threads` and `progress` are as for `upholster.parallel.run_tasks`; stage "blocks".
    """
    if len(plan.parcels) == 1:
        _, drawn = lay_parcel(plan, 0, (), threads=threads, progress=progress)
        assert drawn is not None  # a surface has triangles
        return emitted_quilt(plan, label_pieces(plan, drawn, threads=threads), threads=threads)
    blocks = _laid_parcels(plan, threads, progress)
    pieces: list[list[LabelPiece]] = [[] for _ in blocks]

    def label(n: int) -> None:
        drawn = draw_parcel(plan, n, [blocks[k] for k in plan.parcels.near(n)])
        pieces[n] = [] if drawn is None else label_pieces(plan, drawn)

    run_tasks([partial(label, n) for n in range(len(blocks))], threads=threads)
    return emitted_quilt(plan, [piece for own in pieces for piece in own], threads=threads)


def _laid_parcels(plan: LayPlan, threads: int | None, progress: Progress | None) -> list[ParcelBlocks]:
    blocks: list[ParcelBlocks] = [ParcelBlocks.joined(plan, ())] * len(plan.parcels)

    def lay(n: int, start: int, threads: int) -> None:
        before = [blocks[k] for k in plan.parcels.near(n) if k < start]
        blocks[n], _ = lay_parcel(plan, n, before, threads=threads)

    for start, stop in plan.parcels.ranks:
        inner = max(1, thread_count(threads) // (stop - start))
        run_tasks([partial(lay, n, start, inner) for n in range(start, stop)], threads=threads)
        if progress is not None:
            progress("blocks", stop, len(blocks))
    return blocks


@stage
def _density(surface: ChartedSurface) -> float:
    # Mean number of steps per model unit over the charts.
    flat = surface.places[:, 1:] - surface.places[:, :1]
    steps = 0.5 * np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
    kept = surface.chart >= 0
    return float(np.sqrt(steps[kept].sum() / surface.mesh.areas[kept].sum()))


def step_level(shape: tuple[int, ...], surface: ChartedSurface, scale: float) -> int:
    """Return the level of a sample (H, W) whose pixels are about as large as a step of a surface.

    `scale` is exemplar pixels per model unit.
    """
    last = max(0, int(np.log2(min(shape) / 16)))
    return min(max(0, int(np.floor(np.log2(scale / _density(surface)) + 0.5))), last)


def _numbers(
    exemplar: PixelArray,
    surface: ChartedSurface,
    options: QuiltOptions,
    scale: float,
    parts: Sequence[SamplePart],
    masks: Sequence[Used],
) -> tuple[MatchPyramid, LayNumbers]:
    # The exemplar's pyramid up to the level whose pixels are about as large as a step, and the sizes on that
    # level.
    shape = min((part.rows.stop - part.rows.start, part.columns.stop - part.columns.start) for part in parts)
    number, room = step_level(shape, surface, scale), _LARGEST_FRAME
    if masks:
        number = min(level_with_room(mask, number, room)[0] for mask in masks)
        room = min(level_with_room(mask, number, room)[1] for mask in masks)
    pyramid = match_pyramid(exemplar, number, parts, masks)
    level = pyramid.levels[number]
    cell = 4 if min(options.block >> number, room) >= _COARSE else 2
    wanted = min(min(options.block, _SHARE * min(shape)) / 2**number, room // cell * cell)
    size = cell * max(4, int(np.rint(min(max(wanted, 8), _LARGEST_FRAME) / cell)))
    turns = 0b1111 if options.rotate else 1
    symmetries = turns | (turns << 4 if options.rotate else _MIRRORED) if options.mirror else turns
    return pyramid, LayNumbers(
        level.height,
        level.width,
        number,
        level.step,
        options.shortlist,
        pyramid.stride(number),
        symmetries,
        size,
        cell,
    )
