"""The decoders agree with SPEC.md as plain Python reads it: every plan, on small quilts."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import plain_field
import plain_plan
import pytest
from mesh_quilts import charts_of, icosphere, sheets
from plain_coder import PlainBytes
from streams import any_grids, anything, anything_bent, bent, changed, covered, with_matrices, woven

from upholster.quilt import Chart, Quilt
from upholster.quilt.placement import MASK_CUT, PLACEMENT, mask_sizes
from upholster.quilt.plans import PlacementList
from upholster.quilt.warp_field import WarpField
from upholster.stream.plans import encode_plan
from upholster.stream.warp_fields import pack_fields


def plain(quilt: Any) -> Any:
    """What plain Python makes of a quilt's bytes."""
    charts = [(chart.height, chart.width) for chart in quilt.charts]
    fields = [plain_field.PlainField(field.nodes.tolist(), field.margin) for field in quilt.fields]
    return plain_plan.decode(*encode_plan(quilt).parts, charts, quilt.exemplar_shape, fields)


def assert_same_placements(quilt: Any, found: Any) -> None:
    assert len(found) == len(quilt.placements)
    for name in PLACEMENT.names:
        if name != "first_cell":
            assert [one[name] for one in found] == quilt.placements[name].tolist(), name


@cache
def small_strips(spec: Any) -> Any:
    return covered(spec, 40, 16, 2, 4)[1]


@pytest.mark.parametrize("spec", ["cyclide", "sphere", "cylinder"])
def test_strips(spec: Any) -> None:
    quilt = small_strips(spec)
    found, cells = plain(quilt)
    assert_same_placements(quilt, found)
    cut = quilt.placements["mask"] == MASK_CUT
    sizes = mask_sizes(quilt.placements, quilt.charts)
    assert cut.any()
    for n in np.flatnonzero(cut):
        ours = quilt.mask_cells[quilt.placements["first_cell"][n] :][: sizes[n]]
        assert cells[found[n]["first_cell"] :][: sizes[n]] == ours.tolist()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [anything, anything_bent])
def test_lists(make: Any, seed: Any) -> None:
    charts = [Chart(0, 40, 50), Chart(0, 70, 33), Chart(0, 12, 90)]
    quilt = make(np.random.default_rng(seed), (40, 36), charts, 60)
    found, cells = plain(quilt)
    assert_same_placements(quilt, found)
    assert [one["first_cell"] for one in found] == quilt.placements["first_cell"].tolist()
    assert cells == quilt.mask_cells.tolist()


def test_a_list_of_strips() -> None:
    quilt = changed(small_strips("cylinder"))
    found, cells = plain(quilt)
    assert_same_placements(quilt, found)
    assert cells == quilt.mask_cells.tolist()


@cache
def small_grids(name: Any) -> Any:
    if name == "plane":
        return woven("plane:spans=2x2", 6_000)[1]
    if name == "torus":
        return woven("torus", 9_000, sample_size=1.2)[1]
    if name == "turned":
        return woven("torus", 9_000, sample_size=1.2, mirror=True, rotate=True)[1]
    if name == "matrices":
        return with_matrices(woven("sphere", 6_000)[1], seed=3)
    if name == "wild masks":
        quilt = woven("cone", 5_000)[1]
        cells = np.random.default_rng(3).integers(0, 2, len(quilt.mask_cells)).astype(np.uint8)
        return _with(quilt, mask_cells=cells)
    quilt = woven("cylinder", 6_000)[1]
    return _with(quilt, blocks=scattered(quilt))


def _with(quilt: Any, **changes: Any) -> Any:
    return replace(quilt, plan=replace(quilt.plan, **changes))


def scattered(quilt: Any) -> Any:
    """Blocks that agree with nothing: sources anywhere, links dropped or changed, symmetries."""
    rng, blocks = np.random.default_rng(5), quilt.plan.blocks.copy()
    for name, size in zip(("source_row", "source_column"), quilt.exemplar_shape, strict=True):
        some = rng.random(len(blocks)) < 0.5
        blocks[name][some] = rng.integers(0, 16 * size, some.sum())
        pixels = rng.random(len(blocks)) < 0.3
        blocks[name][pixels] = blocks[name][pixels] // 16 * 16
    for place, grid in enumerate(quilt.plan.grids):
        start = int(quilt.plan.starts[place])
        part = blocks[start : start + grid.transferred]
        some = rng.random(len(part)) < 0.4
        part["link"][some] = rng.integers(-1, max(1, start), some.sum())
        part["symmetry"] = np.where(
            rng.random(len(part)) < 0.3, rng.integers(0, 8, len(part)), part["symmetry"]
        )
    return blocks


@pytest.mark.parametrize("name", ["plane", "torus", "turned", "matrices", "wild masks", "scattered"])
def test_grids(name: Any) -> None:
    quilt = small_grids(name)
    found, cells, links = plain(quilt)
    assert_same_placements(quilt, found)
    assert links == quilt.plan.blocks["link"].tolist()
    assert [one["first_cell"] for one in found] == quilt.placements["first_cell"].tolist()
    assert cells == quilt.mask_cells.tolist()


def test_blocks_on_several_charts_with_matrices_near_the_fields() -> None:
    rng = np.random.default_rng(3)
    charts = charts_of(icosphere(1))
    quilt = sheets(rng, charts, (64, 72), 30, bent(rng, charts))
    found, cells = plain(quilt)
    assert_same_placements(quilt, found)
    assert cells == quilt.mask_cells.tolist()


def test_a_matrix_near_its_field_takes_few_bytes() -> None:
    rng = np.random.default_rng(3)
    charts = charts_of(icosphere(1), 160)[:1]
    fields = bent(rng, (charts[0], charts[0]))[1:]
    placed = sheets(rng, charts, (64, 72), 400, fields).placements.copy()
    placed["mask"], placed["first_cell"] = 0, -1
    quilt = Quilt(charts, (64, 72), PlacementList(placed.copy(), np.zeros(0, np.uint8)), fields)
    placed["centred"], placed["matrix"] = 0, 0
    bare = Quilt(charts, (64, 72), PlacementList(placed.copy(), np.zeros(0, np.uint8)), fields)
    more = len(encode_plan(quilt).sources) - len(encode_plan(bare).sources)
    assert more < 3 * len(placed)
    assert len(encode_plan(quilt).sources) < 9 * len(placed)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_grids_that_nobody_laid(seed: Any, turned: Any) -> None:
    rng = np.random.default_rng(seed)
    charts = [Chart(0, *rng.integers(1, 90, 2).tolist()) for _ in range(4)]
    quilt = any_grids(rng, (40, 36), charts, turned)
    found, cells, links = plain(quilt)
    assert_same_placements(quilt, found)
    assert links == quilt.plan.blocks["link"].tolist()
    assert cells == quilt.mask_cells.tolist()


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
    code = pack_fields(fields, charts, range(len(charts)))
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
        rows, columns = rng.integers(-100, 200, (2, 30))
        field_again = plain_field.PlainField(nodes, field.margin)
        wanted = field.integers_at(rows, columns).tolist()
        assert [field_again.at(int(r), int(c)) for r, c in zip(rows, columns, strict=True)] == wanted
