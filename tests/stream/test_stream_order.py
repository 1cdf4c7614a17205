"""The order of a stream's parts: what takes most of the error away comes first."""

import numpy as np
from streams import woven

from upholster.stream.byte_reader import ByteReader
from upholster.stream.order import Part, changed_texels, mask_parts, ordered, unlikeness
from upholster.stream.plans import encode_plan, open_plan

CHARTS = [Part((("P", bytes(100)),), 1000.0, 600.0)]
MASKS = [Part((("M", bytes(100)),), 600.0)]
SAMPLE = [Part((("D", bytes(100)),), 100)]
ERRORS = 10.0, {0: 5.0, 100: 1.0}


def tags(unlike: float) -> str:
    return "".join(chr(chunk[0]) for chunk in ordered(CHARTS, MASKS, SAMPLE, ERRORS, 0, unlike))


def test_a_sample_that_is_seen_in_wrong_places_waits_for_masks() -> None:
    # 1000 texels, 600 of them wrong: at 0.1 of the variance hardly so, at 2 more than a flat colour is.
    assert tags(0.1) == "PDM"
    assert tags(2.0) == "PMD"


def test_masks_come_in_parts_that_tell_all_texels_that_change() -> None:
    surface, quilt, exemplar = woven("torus", sample_size=1.5)
    assert surface
    plan = encode_plan(quilt)
    decoder = open_plan(ByteReader(plan.plan), quilt.charts, quilt.exemplar_shape, quilt.fields)
    decoder.feed_sources(plan.sources)
    straight = decoder.quilt()
    changed = changed_texels(quilt, straight)
    parts = mask_parts(plan, changed)
    assert len(parts) > 1
    assert b"".join(data for part in parts for _, data in part.chunks) == plan.masks
    np.testing.assert_allclose(sum(part.texels for part in parts), changed.sum())
    assert 0 < unlikeness(quilt, straight, exemplar, changed) <= 2
    assert unlikeness(quilt, quilt, exemplar, changed) == 0
