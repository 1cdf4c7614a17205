"""Cells of masks that no texel shows: painted alike whatever they are, in fewer bytes."""

from dataclasses import replace

import numpy as np
import pytest
from streams import woven

import upholster
from upholster.quilt import Quilt, paint
from upholster.quilt.plans import GridPlan
from upholster.stream import encode_stream, read_stream
from upholster.stream.arranged import arranged
from upholster.stream.hidden import hidden_cells
from upholster.stream.plans import encode_plan
from upholster.types import PixelArray


@pytest.fixture(scope="module")
def refined() -> tuple[Quilt, PixelArray]:
    """A flat texture over most of which refinement lays further blocks."""
    grains = np.random.default_rng(5).integers(0, 256, (24, 24, 3))
    exemplar = np.kron(grains, np.ones((4, 4, 1), np.int64)).astype(np.uint8)
    return arranged(upholster.synthesize(exemplar, "plane", texels=(400, 400), seed=2)), exemplar


def with_cells(quilt: Quilt, cells: np.ndarray) -> Quilt:
    assert isinstance(quilt.plan, GridPlan)
    return replace(quilt, plan=replace(quilt.plan, mask_cells=cells.astype(np.uint8)))


def is_same(one: Quilt, other: Quilt, exemplar: PixelArray) -> bool:
    pairs = zip(paint(one, exemplar).arrays, paint(other, exemplar).arrays, strict=True)
    return all((a == b).all() for a, b in pairs)


def test_hidden_cells_change_no_texel_and_others_do(refined: tuple[Quilt, PixelArray]) -> None:
    quilt, exemplar = refined
    assert isinstance(quilt.plan, GridPlan)
    hidden, cells = hidden_cells(quilt), quilt.plan.mask_cells
    assert hidden is not None
    assert hidden.mean() > 0.15
    generator = np.random.default_rng(1)
    for value in (1 - cells, generator.integers(0, 2, len(cells)), 0 * cells, 0 * cells + 1):
        assert is_same(with_cells(quilt, np.where(hidden, value, cells)), quilt, exemplar)
    seen = generator.choice(np.flatnonzero(~hidden), 20, replace=False)
    changed = [with_cells(quilt, np.where(np.arange(len(cells)) == n, 1 - cells, cells)) for n in seen]
    assert sum(not is_same(one, quilt, exemplar) for one in changed) >= 18


def test_hidden_cells_cost_next_to_nothing(refined: tuple[Quilt, PixelArray]) -> None:
    quilt, exemplar = refined
    assert len(encode_plan(quilt, hidden_cells(quilt)).masks) < 0.9 * len(encode_plan(quilt).masks)
    data = encode_stream("plane", quilt, exemplar)
    assert is_same(read_stream(data).quilt(), quilt, exemplar)


def test_charts_without_further_blocks_keep_their_masks() -> None:
    _, quilt, _ = woven("torus", sample_size=1.5)
    assert hidden_cells(quilt) is None
