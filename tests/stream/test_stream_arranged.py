"""The order of a plan's grids in a stream: painted alike, and seen as early as can be."""

import numpy as np
import pytest
from streams import woven

import upholster
from upholster.quilt import Quilt, paint
from upholster.quilt.plans import GridPlan
from upholster.stream.arranged import arranged
from upholster.stream.byte_reader import ByteReader
from upholster.stream.plans import encode_plan, open_plan
from upholster.types import PixelArray


@pytest.fixture(scope="module")
def flat() -> tuple[Quilt, PixelArray]:
    """A flat texture over most of which refinement lays further blocks."""
    grains = np.random.default_rng(5).integers(0, 256, (24, 24, 3))
    exemplar = np.kron(grains, np.ones((4, 4, 1), np.int64)).astype(np.uint8)
    return upholster.synthesize(exemplar, "plane", texels=(400, 400), seed=2), exemplar


def without_masks(quilt: Quilt) -> tuple[Quilt, int]:
    plan = encode_plan(quilt)
    decoder = open_plan(ByteReader(plan.plan), quilt.charts, quilt.exemplar_shape, quilt.fields)
    decoder.feed_sources(plan.sources)
    return decoder.quilt(), sum(map(len, plan.parts))


def same_texels(one: Quilt, other: Quilt, exemplar: PixelArray) -> float:
    pairs = zip(paint(one, exemplar).arrays, paint(other, exemplar).arrays, strict=True)
    return float(np.mean([(a == b).all(axis=2).mean() for a, b in pairs]))


def test_added_blocks_are_seen_before_their_masks_come(flat: tuple[Quilt, PixelArray]) -> None:
    quilt, exemplar = flat
    assert isinstance(quilt.plan, GridPlan)
    assert quilt.plan.grids[-1].transferred > 0
    ours = arranged(quilt)
    assert same_texels(ours, quilt, exemplar) == 1
    (early, length), (before, length_before) = without_masks(ours), without_masks(quilt)
    assert same_texels(early, quilt, exemplar) > 0.02 + same_texels(before, quilt, exemplar)
    assert length < length_before
    assert arranged(ours).plan is ours.plan


def test_charts_of_many_texels_a_byte_come_first() -> None:
    _, quilt, exemplar = woven("cyclide", sample_size=4.0)
    ours = arranged(quilt)
    assert same_texels(ours, quilt, exemplar) == 1

    def early(one: Quilt) -> float:
        # The texels that are there, on average over all places in the code of the sources.
        plan = encode_plan(one)
        areas = np.array([one.charts[n].height * one.charts[n].width for n in plan.order])
        return float((areas * (len(plan.sources) - np.array(plan.source_ends))).sum() / areas.sum())

    assert early(ours) > early(quilt)
