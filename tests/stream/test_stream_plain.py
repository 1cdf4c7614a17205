"""The decoder agrees with SPEC.md as plain Python reads it, on small quilts."""

from typing import Any

import numpy as np
import plain_field
import plain_plan
import pytest
from plain_coder import PlainBytes
from streams import anything, anything_bent, bent, laid, same_labels

from upholster.quilt import Chart, Quilt
from upholster.quilt.labels import LabelMap
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField
from upholster.stream.plan import encode_plan
from upholster.stream.warp_fields import pack_fields


def check(quilt: Quilt) -> None:
    """Plain Python makes the same of a quilt's bytes as was told."""
    charts = [(chart.height, chart.width) for chart in quilt.charts]
    fields = [plain_field.PlainField(field.nodes.tolist(), field.margin) for field in quilt.fields]
    code = encode_plan(quilt)
    told = code.head, code.placements, code.labels
    found, maps = plain_plan.decode(*told, charts, quilt.exemplar_shape, fields)
    assert len(found) == len(quilt.placements)
    for name in PLACEMENT.names or ():
        assert [one[name] for one in found] == quilt.placements[name].tolist(), name
    for layers, wanted in zip(maps, quilt.labels, strict=True):
        again = tuple(LabelMap(cell, np.array(rows, np.int32), bool(half)) for cell, half, rows in layers)
        assert same_labels(again, wanted)


@pytest.mark.parametrize("seed", range(20))
def test_any_quilt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = [Chart(0, *rng.integers(1, 40, 2).tolist()) for _ in range(1 + seed % 4)]
    shape = tuple(rng.integers(4, 70, 2).tolist())
    check((anything_bent if seed % 2 else anything)(rng, shape, layout, 30))


@pytest.mark.parametrize("across", [128, 129])
def test_as_many_placements_as_are_looked_at_and_one_more(across: int) -> None:
    rng, chart = np.random.default_rng(3), Chart(0, 2, 3 * across)
    placed = np.zeros(2 * across, PLACEMENT)  # the one above is nearer than the one to the left
    for name, at, apart in zip(
        ("row", "column"), np.divmod(np.arange(2 * across), across), (1, 3), strict=True
    ):
        placed[name] = 16 * apart * at + 8
    placed["source_row"], placed["source_column"] = rng.integers(0, 512, (2, len(placed)))
    labels = rng.integers(0, 3, (4, 3 * across + 2)).astype(np.int32)
    check(Quilt((chart,), (32, 40), placed, ((LabelMap(1, labels),),)))


@pytest.mark.parametrize("second", [False, True])
def test_a_quilt_that_was_laid(second: bool) -> None:
    check(laid("sphere", second=second)[1])


@pytest.mark.parametrize("seed", range(3))
def test_nodes_of_warp_fields(seed: Any) -> None:
    rng = np.random.default_rng(seed)
    charts = [Chart(0, *rng.integers(1, 120, 2).tolist()) for _ in range(7)]
    fields = bent(rng, charts)
    if seed == 2:  # smooth ones, whose sizes go far
        fields = tuple(
            WarpField.quantised(
                np.array([[[[2.0**i, 0.1], [0, 2.0**-j]] for j in range(5)] for i in range(5)])
            )
            for _ in charts[:2]
        )
        charts = charts[:2]
    code = pack_fields(fields, charts)
    told = PlainBytes(code.head)
    kinds, margin = told.byte(), told.byte()
    each = [told.byte() if kinds == 3 else kinds for _ in charts]
    shapes = []
    for kind, chart in zip(each, charts, strict=True):
        if kind == 1:
            shapes.append((2 * margin - (-chart.height // 32) + 1, 2 * margin - (-chart.width // 32) + 1))
        if kind == 2:
            told.varint()
            shapes.append((told.varint(), told.varint()))
    told.end()
    found = plain_field.nodes(code.nodes, shapes)
    warped = [field for field in fields if not field.is_identity]
    assert len(found) == len(warped) > 1
    for nodes, field in zip(found, warped, strict=True):
        np.testing.assert_array_equal(np.array(nodes), field.nodes)
        rows, columns = rng.integers(-1600, 3200, (2, 30))
        field_again = plain_field.PlainField(nodes, field.margin)
        wanted = field.between(rows, columns).tolist()
        assert [field_again.at(int(r), int(c)) for r, c in zip(rows, columns, strict=True)] == wanted
