"""Refinement on meshes: cells and cuts of a frame as a plain twin finds them; cuts cost less."""

import numpy as np
import pytest
from tests.charts.test_mesh_layout import sheet
from tests.methods.test_mesh_quilt import DENSITY, SCALE, halves, noise

from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.warp_fields import triangle_frames, warp_fields
from upholster.measure.trace import Trace, quilt_windows
from upholster.methods.quilt._block_kernels import LayNumbers
from upholster.methods.quilt._expansion_kernels import SAMPLES, CellLattice, ChartCells, ExpansionScratch
from upholster.methods.quilt.mesh._refine_frame_kernels import enter_cells, enter_cuts
from upholster.methods.quilt.mesh.method import synthesize_mesh
from upholster.methods.quilt.options import QuiltOptions
from upholster.quilt.displacement import warped_sources

SIZE, CELL = 24, 4
ACROSS = SIZE // CELL


def channels(pixel):
    return np.array([(int(pixel) >> shift) & 255 for shift in (0, 8, 16, 24)])


def apart(one, other):
    total = sum(((channels(a) - channels(b)) ** 2).sum() for a, b in zip(one, other, strict=True))
    return int(4 * np.sqrt(float(total)))


def test_cells_and_cuts_of_a_frame_are_found():
    rng = np.random.default_rng(3)
    height, width = 40, 50
    image = rng.integers(0, 2**31, height * width).astype(np.int32)
    numbers = LayNumbers(*(0,) * len(LayNumbers._fields))._replace(height=height, width=width)
    # Two sources meet aslant; on the right nothing is laid, and a pixel is missing.
    rows, columns = np.mgrid[:SIZE, :SIZE]
    first, second = (rows + 3) * width + columns + 5, (rows + 12) * width + columns + 20
    sources = np.where(rows + columns < 22, first, second).astype(np.int32)
    marks = np.where(columns < 20, 1, 6).astype(np.uint8)
    marks[2, 13] = 0
    old = image[sources]
    lattice = CellLattice(ACROSS, ACROSS, CELL, 0, 0, ACROSS, ACROSS)
    cells = ChartCells(*(np.zeros((ACROSS, ACROSS), kind) for kind in (np.int32, np.uint8)), np.zeros(0, int))
    cells = cells._replace(seams=np.zeros((2, ACROSS, ACROSS), np.int32))
    scratch = ExpansionScratch.of(lattice)
    enter_cells(marks, old, lattice, cells, scratch)
    count = enter_cuts(image, numbers, lattice, cells, sources, scratch)
    whole = (marks == 1).reshape(ACROSS, CELL, ACROSS, CELL).all(axis=(1, 3))
    np.testing.assert_array_equal(cells.labels >= 0, whole)
    rim = np.ones_like(whole)
    rim[1:-1, 1:-1] = False
    np.testing.assert_array_equal(cells.held == 1, rim & whole)
    offsets = [(0, 0), (0, CELL // 2), (CELL // 2, 0), (CELL // 2, CELL // 2)]
    assert len(offsets) == SAMPLES

    def read(source, down, right):
        y, x = divmod(int(source), width)
        return [
            image[min(max(y + down + a, 0), height - 1) * width + min(max(x + right + b, 0), width - 1)]
            for a, b in offsets
        ]

    expected = []
    for way, (down, right) in enumerate(((0, 1), (1, 0))):
        for i, j in np.ndindex(ACROSS - down, ACROSS - right):
            if not (whole[i, j] and whole[i + down, j + right]):
                continue
            here, there = sources[i * CELL, j * CELL], sources[(i + down) * CELL, (j + right) * CELL]
            step = np.array(divmod(int(there), width)) - divmod(int(here), width)
            if (np.abs(step - (down * CELL, right * CELL)) <= 1).all():
                continue
            shown = [
                [old[p * CELL + a, q * CELL + b] for a, b in offsets]
                for p, q in ((i, j), (i + down, j + right))
            ]
            cost = 1 + apart(shown[0], read(there, -down * CELL, -right * CELL))
            cost += apart(shown[1], read(here, down * CELL, right * CELL))
            expected.append((way, i * ACROSS + j, (i + down) * ACROSS + j + right, cost))
    assert 4 < len(expected) == count
    found = np.column_stack([scratch.pairs[:count], scratch.costs[:count, 0]])
    np.testing.assert_array_equal(found, expected)


def cut_cost(quilt, exemplar):
    """Return what the cuts of a quilt cost: by how much both sides differ, each on both sides."""
    total = 0.0
    for window in quilt_windows(quilt):
        trace = Trace.of(quilt, window)
        for axis in (0, 1):
            border = trace.border(axis)
            cut = ~border.continued
            rows, columns = border.rows[cut] + window.row, border.columns[cut] + window.column
            for down, right in ((0, 0), (axis == 0, axis == 1)):
                shown = []
                for side in (border.first, border.second):
                    y, x = warped_sources(trace.field, side[cut], rows + down, columns + right)
                    shown.append(
                        exemplar[np.clip(y + 8 >> 4, 0, 95), np.clip(x + 8 >> 4, 0, 95)].astype(float)
                    )
                total += np.sqrt(((shown[0] - shown[1]) ** 2).sum(axis=1)).sum()
    return total


def refined(effort, threads=1):
    surface = halves(sheet(size=3.0), 35.0)
    along = np.tile([1.0, 0.0, 0.0], (len(surface.island), 3, 1))
    charts = mesh_charts(surface, DENSITY)
    fields = warp_fields(surface, charts, *triangle_frames(surface, along), SCALE)
    options = QuiltOptions(block=24, effort=effort)
    return synthesize_mesh(
        noise(), surface, charts, fields, along, SCALE, options=options, seed=3, threads=threads
    )


@pytest.fixture(scope="module")
def by_effort():
    return {effort: refined(effort) for effort in (1, 2, 3)}


def test_cuts_cost_less_the_more_is_tried(by_effort):
    costs = {effort: cut_cost(quilt, noise()) for effort, quilt in by_effort.items()}
    assert costs[2] < costs[1]
    assert costs[3] < 0.95 * costs[1]


def test_blocks_are_added(by_effort):
    sources = [np.concatenate([one.ravel() for one in by_effort[effort].sources()]) for effort in (1, 3)]
    assert 0.05 < (sources[0] != sources[1]).mean() < 0.95


def test_the_number_of_threads_changes_nothing(by_effort):
    other = refined(3, threads=4)
    assert (other.placements == by_effort[3].placements).all()
    for a, b in zip(other.labels, by_effort[3].labels, strict=True):
        np.testing.assert_array_equal(a[0].labels, b[0].labels)
