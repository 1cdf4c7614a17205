"""The kernels agree with SPEC.md as plain Python reads it."""

from typing import Any

import numpy as np
import plain_decoder
import pytest
from streams import anything, covered
from upholster.stream.placement_encoder import encode_placements
from upholster.stream.records import FIELD_NAMES, strip_masks
from upholster.stream.regular import recognise

from upholster.quilt import Chart
from upholster.quilt.placement import MASK_CUT


@pytest.mark.parametrize("spec", ["cyclide", "sphere", "cylinder"])
def test_regular_quilts(spec: Any) -> None:
    surface, quilt, _ = covered(spec)
    _, sources, masks = encode_placements(quilt, surface.shared)
    plan = recognise(quilt, surface.shared)
    assert plan is not None
    counts = np.diff(plan.runs[:, 0])
    runs = [
        (int(count), int(across), int(kind))
        for count, (_, across, kind) in zip(counts, plan.runs, strict=False)
    ]
    chosen = plain_decoder.sources(sources, runs, max(1, plan.step // plan.tile), plan.grid)
    own = quilt.placements[quilt.placements["mask"] != MASK_CUT]
    cut = quilt.placements[quilt.placements["mask"] == MASK_CUT]
    cut = cut[np.argsort(cut["first_cell"])][::2]
    assert chosen == [*plan.chosen(own).tolist(), *plan.chosen(cut).tolist()]
    shapes = []
    for first, rows, columns, place, end in strip_masks(plan):
        shapes += [(rows, columns, place)] * ((end - first) // (rows * columns))
    expected = [
        plan.coded_cells(n, quilt.mask_cells[2 * start : 2 * stop])
        for n, (start, stop) in enumerate(zip(plan.mask_starts, plan.mask_starts[1:], strict=False))
    ]
    assert plain_decoder.masks(masks, shapes) == np.concatenate(expected).tolist()


def test_general_quilts() -> None:
    charts = [Chart(0, 40, 50), Chart(0, 70, 33)]
    quilt = anything(np.random.default_rng(5), (40, 36), charts, 80)
    _, data, _ = encode_placements(quilt)
    found = plain_decoder.fields(data, 80)
    for n, name in enumerate(FIELD_NAMES):
        scale = 16 if name.startswith("source") else 1
        assert [scale * record[n] for record in found] == quilt.placements[name].tolist()
