"""Method "quilt" over a charted surface: lays overlapping blocks, then makes a quilt of their visible parts.

`lay_plan` sets all parameters, `laying` lays blocks, parcel by parcel, and `emit` makes placements and labels
of their visible parts.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.charts.charted_surface import ChartedSurface, steps_per_unit
from upholster.charts.phases.course_phases import CourseField
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import Lattice
from upholster.image.files.collage import Rectangle
from upholster.image.masks import Used
from upholster.quilt.model import Quilt
from upholster.quilt.pyramid import halved
from upholster.runtime.parallel import report_progress, run_tasks, running, thread_count
from upholster.runtime.stages import stage
from upholster.synthesis.exemplar import Exemplar, cropped
from upholster.synthesis.quilt.emit import LabelPiece, emitted_quilt, label_pieces
from upholster.synthesis.quilt.irregularity import irregularity
from upholster.synthesis.quilt.kernels._block_kernels import CourseRule, LayNumbers, LayWeights
from upholster.synthesis.quilt.kernels._phase_kernels import MISFIT
from upholster.synthesis.quilt.laid_blocks import ParcelBlocks
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.laying import draw_parcel, lay_parcel
from upholster.synthesis.quilt.match_pyramid import MatchPyramid, SamplePart, match_pyramid, with_fringe
from upholster.synthesis.quilt.parcels import MOST_WHOLE, Parcels
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.quilt.steering import guide_costs, level_guides
from upholster.synthesis.quilt.usable_blocks import allowed_places, level_with_room, used_level

__all__ = ["laid_quilt", "lay_plan", "step_level"]

_CHANCE, _CHANCE_AGAIN = 0.05, 0.5
"""Shares by which costs vary at random, also in a region that is laid again. Without chance all seeds would
give the same where texture grows from what is there."""

_ORDERED = 0.5
"""Irregularity of a sample from which on its blocks need not continue each other exactly, so that they vary:
a perfect fit costs the sample's variance times what is beyond, and frames may reach beyond the sample."""

_FRINGE = 1 / 6
"""How far beyond such a sample frames may reach, as a fraction of their side: about half of an overlap, so
that neighbours cover what is not there. Otherwise its rim would hardly be shown, and its middle too often."""

_RELAY = 0.2
"""Least gain of laying again, for each pixel of a frame's side, as a fraction of the sample's variance."""

_FLAT = 0.5
"""Share of pixels that equal the next one, from which on a sample is a drawing."""

_BROAD, _HALVINGS = 1 / 16, 4
"""Share of a sample's variance that is left when it is halved this often, below which it has no broad shades
worth evening out, if it is irregular: that would only take contrast from it."""

_COARSE = 24
"""Frames of at least this many pixels have mask cells 4 pixels wide, smaller frames 2 pixels."""

_LARGEST_FRAME, _SHARE = 512, 0.75
"""Maximum side of a frame in pixels, and as a fraction of the sample: larger frames would leave no choice."""

_MIRRORED = 1 << 5
"""The bit of the symmetry that mirrors left and right: columns count backwards."""

_SPARE = 1.5
"""Pixels by which a block reaches beyond its course where no other block shows: fewer leave slivers."""


def lay_plan(scene: Scene, exemplar: Exemplar, *, seed: int = 0) -> LayPlan:
    """Return the plan by which method "quilt" covers a scene; `seed` is 0 to 2^63 − 1.

    The exemplar may have any number of channels.
    """
    guides, masks = exemplar.guidance.guides, exemplar.zone_masks
    # The level must be fine enough for the places where the sample is largest.
    coarsest = scene.pixels if scene.sizes is None else scene.pixels / scene.sizes.most
    pyramid, numbers = _numbers(scene, exemplar, coarsest)
    match, level = pyramid.levels[numbers.level].match, (numbers.height, numbers.width)
    if masks:
        allowed = _allowed(numbers, masks)
        match = match._replace(allowed=allowed, places=np.flatnonzero(allowed))
    if guides:
        costs = guide_costs(guides, pyramid.variance)
        match = match._replace(guides=level_guides(guides, numbers.level, level), costs=costs)
    options = scene.options
    used = np.logical_or.reduce(masks) if masks else None
    beyond = max(0.0, irregularity(pyramid.form, options.block, used) - _ORDERED)
    if beyond and not masks:
        fringe = numbers.cell * round(_FRINGE * numbers.size / numbers.cell)
        match, numbers = with_fringe(match, numbers, fringe)
    phase = 0.0 if all(one is None for one in scene.phases) else options.phase
    return LayPlan(
        replace(scene, field=None),  # tasks do without
        exemplar.shape,
        match,
        numbers,
        LayWeights(
            options.variety,
            _CHANCE_AGAIN if scene.steering.differs else _CHANCE,
            phase * pyramid.variance / MISFIT,
            _RELAY * pyramid.variance,
            float(round(beyond * pyramid.variance)),
        ),
        _parcels(scene, numbers.size * 2**numbers.level / scene.pixels),
        int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0]),
        _takes_tones(exemplar, irregular=beyond > 0),
    )


def _takes_tones(exemplar: Exemplar, *, irregular: bool) -> bool:
    """Return whether broad shades are evened out: on one photograph, all of which may be shown.

    Shades are read from around a place, so they would show what a mask leaves out, or a neighbouring sample.
    A drawing, most of whose pixels equal their neighbours, would get colours that it does not have. Gravel
    and other irregular samples that look alike everywhere have no broad shades.
    """
    pixels = exemplar.pixels
    if irregular:
        broad = pixels.astype(np.float32)
        for _ in range(_HALVINGS):
            broad = halved(broad)
        if broad.var(axis=(0, 1)).sum() < _BROAD * pixels.var(axis=(0, 1)).sum():
            return False
    flat = (pixels[:, 1:] == pixels[:, :-1]).all(axis=2).mean() if pixels.shape[1] > 1 else 1.0
    return exemplar.used is None and not exemplar.guidance.rectangles and bool(flat < _FLAT)


def _parcels(scene: Scene, block: float) -> Parcels:
    largest = block if scene.sizes is None else block * scene.sizes.most
    parcels = Parcels.of(scene.charted, scene.vectors, largest, steps_per_unit(scene.charted))
    if len(parcels) > 1 and (scene.steering.kept is not None or scene.steering.put):
        raise InputError(
            f"again, put or a pin is given on more than {MOST_WHOLE:,} steps; allowed: fewer texels"
        )
    return parcels


@stage
def _parts(
    pixels: PixelArray, rectangles: tuple[Rectangle, ...], lattices: tuple[Lattice | None, ...]
) -> tuple[SamplePart, ...]:
    # The samples in an exemplar, with the lattice and the joints of each.
    if not rectangles:
        return (SamplePart.whole(pixels, lattices[0], find_joints(pixels)),)
    found = []
    for rectangle, lattice in zip(rectangles, lattices, strict=True):
        row, column, height, width = rectangle
        rows, columns = slice(row, row + height), slice(column, column + width)
        found.append(SamplePart(rows, columns, lattice, find_joints(cropped(pixels, rectangle))))
    return tuple(found)


def _allowed(numbers: LayNumbers, masks: Sequence[Used]) -> NDArray[np.uint8]:
    # For each pixel of the level, the zone of a block with its source there; 0: no block may have it there.
    found = np.zeros(numbers.height * numbers.width, np.uint8)
    for zone, mask in enumerate(masks, 1):
        found[allowed_places(used_level(mask, numbers.level), numbers.size) != 0] = zone
    return found


def laid_quilt(plan: LayPlan) -> Quilt:
    """Lay a surface's blocks on threads of this process, and return its quilt; stage "blocks"."""
    if len(plan.parcels) == 1:
        _, drawn = lay_parcel(plan, 0, ())
        assert drawn is not None  # a surface has triangles
        return emitted_quilt(plan, label_pieces(plan, drawn))
    blocks = _laid_parcels(plan)
    pieces: list[list[LabelPiece]] = [[] for _ in blocks]

    def label(n: int) -> None:
        drawn = draw_parcel(plan, n, [blocks[k] for k in plan.parcels.near(n)])
        pieces[n] = [] if drawn is None else label_pieces(plan, drawn)

    run_tasks([partial(label, n) for n in range(len(blocks))])
    return emitted_quilt(plan, [piece for own in pieces for piece in own])


def _laid_parcels(plan: LayPlan) -> list[ParcelBlocks]:
    blocks: list[ParcelBlocks] = [ParcelBlocks.joined(plan, ())] * len(plan.parcels)

    def lay(n: int, start: int, threads: int) -> None:
        before = [blocks[k] for k in plan.parcels.near(n) if k < start]
        with running(threads):
            blocks[n], _ = lay_parcel(plan, n, before)

    for start, stop in plan.parcels.ranks:
        inner = max(1, thread_count() // (stop - start))
        run_tasks([partial(lay, n, start, inner) for n in range(start, stop)])
        report_progress("blocks", stop, len(blocks))
    return blocks


def step_level(shape: tuple[int, ...], surface: ChartedSurface, scale: float) -> int:
    """Return the level of a sample (H, W) whose pixels are about as large as a step of a surface.

    `scale` is exemplar pixels per model unit.
    """
    last = max(0, int(np.log2(min(shape) / 16)))
    return min(max(0, int(np.floor(np.log2(scale / steps_per_unit(surface)) + 0.5))), last)


def _numbers(scene: Scene, exemplar: Exemplar, scale: float) -> tuple[MatchPyramid, LayNumbers]:
    # The exemplar's pyramid up to the level whose pixels are about as large as a step, and the sizes on that
    # level.
    options, masks = scene.options, exemplar.zone_masks
    shape = min(part.shape[:2] for part in exemplar.parts)
    number, room = step_level(shape, scene.charted, scale), _LARGEST_FRAME
    if masks:
        number = min(level_with_room(mask, number, room)[0] for mask in masks)
        room = min(level_with_room(mask, number, room)[1] for mask in masks)
    lattices = tuple(None if one is None else exemplar.lattices[n] for n, one in enumerate(scene.phases))
    parts = _parts(exemplar.pixels, exemplar.guidance.rectangles, lattices)
    pyramid = match_pyramid(exemplar.pixels, number, parts, masks)
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
        course=_course_rule(scene, number),
    )


def _course_rule(scene: Scene, level: int) -> CourseRule:
    # Where blocks end if the courses of the only sample slip.
    phases = scene.phases[0]
    if not isinstance(phases, CourseField):
        return CourseRule()
    first, second = phases.courses.multiples
    down, right = (phases.courses.wave(phases.waves) * 2.0**level).tolist()
    return CourseRule(
        float(first), float(second), phases.courses.joint, down, right, _SPARE * float(np.hypot(down, right))
    )
