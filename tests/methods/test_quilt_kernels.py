"""The kernels of method "quilt" against plain twins."""

import numpy as np
import pytest
from plain_quilt import PlainChart, PlainLevel, box_means, texture

from upholster.methods.quilt._block_kernels import ChartCanvas
from upholster.methods.quilt._search_kernels import mean_boxes
from upholster.methods.quilt._transfer_kernels import lay_transferred, transfer_masks
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.masked import BLOCK, step_matrices
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.quilt import Chart
from upholster.quilt.warp_field import WarpField


def channels_of(match_level):
    """Return the pixels of a level, channel by channel: (rows, columns, 4)."""
    return match_level.match.image.view(np.uint8).reshape(match_level.height, match_level.width, 4)


@pytest.mark.parametrize("step", [1, 2, 4])
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 9, 2), (16, 16, 3), (37, 22, 4)])
def test_boxes_means_lie_in_groups(shape, step):
    image = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    found = mean_boxes(np.ascontiguousarray(image[..., 0]), step)
    wanted = box_means(image.astype(int))
    rows, columns = -(-shape[0] // step), -(-shape[1] // step)
    assert found.shape == (step * step, rows * columns)
    for a in range(step):
        for b in range(step):
            part = wanted[a::step, b::step]
            group = found[a * step + b].reshape(rows, columns)
            assert (group[: part.shape[0], : part.shape[1]] == part).all()


def plain_masks(placements, cells, places, bounds, cell, size):
    """Return the rectangles, and the masks or None, of placements as another chart sees them."""
    out = []
    for (row, column, h, w, own, cut, start), place in zip(placements.tolist(), places, strict=True):
        back = place[2:].reshape(2, 2)
        extent = np.abs(np.linalg.inv(back)) @ (h, w)
        count = [int(np.ceil(side / cell)) + 5 for side in extent]
        centre = [int(at) for at in np.rint(place[:2])]
        for axis, side in enumerate((h, w)):
            # one cell more, if cells' borders come to lie nearer to those on their own chart
            if abs(back[axis, axis]) > 0.5 * abs(back[axis, 1 - axis]):
                border = place[axis] - (side // 2 + 0.5) / back[axis, axis]
                starts = [centre[axis] - n * cell // 2 - 0.5 for n in (count[axis], count[axis] + 1)]
                off = [abs((border - start) / cell - np.rint((border - start) / cell)) for start in starts]
                count[axis] += int(off[1] < off[0])
        first = [at - n * cell // 2 for at, n in zip(centre, count, strict=True)]
        down, right = (f + np.arange(n) * cell for f, n in zip(first, count, strict=True))
        i, j = np.meshgrid(down, right, indexing="ij")
        # each cell asks for what its middle shows, seen from the other chart
        y = i + 0.5 * (cell - 1) - place[0]
        x = j + 0.5 * (cell - 1) - place[1]
        r = np.floor(back[0, 0] * y + back[0, 1] * x + 0.5).astype(int) + h // 2
        s = np.floor(back[1, 0] * y + back[1, 1] * x + 0.5).astype(int) + w // 2
        there = r + row - h // 2, s + column - w // 2
        new = (
            (there[0] >= bounds[0])
            & (there[0] < bounds[1])
            & (there[1] >= bounds[2])
            & (there[1] < bounds[3])
        )
        new &= (r >= -2 * own) & (r < h + 2 * own) & (s >= -2 * own) & (s < w + 2 * own)
        if cut:
            across = -(-w // own)
            at = r.clip(0, h - 1) // own * across + s.clip(0, w - 1) // own
            new &= cells[start + at].astype(bool)
        near = (i > -3 * cell) & (i < size[0] + 2 * cell) & (j > -3 * cell) & (j < size[1] + 2 * cell)
        rectangle = [*centre, count[0] * cell, count[1] * cell]
        out.append((rectangle, new.astype(np.uint8) if (new & near).any() else None))
    return out


@pytest.mark.parametrize("cell", [2, 4, 6])
def test_masks_are_transferred_as_their_middles_fall(cell):
    rng = np.random.default_rng(cell)
    count, size, bounds = 60, (70, 50), (-8, 90, -6, 75)
    placements = np.empty((count, 7), np.int32)
    placements[:, 0], placements[:, 1] = rng.integers(-10, 95, count), rng.integers(-10, 80, count)
    placements[:, 4] = rng.choice([2, 4], count)
    placements[:, 2], placements[:, 3] = (placements[:, 4] * rng.integers(4, 9, count) for _ in range(2))
    placements[:, 5] = rng.integers(0, 2, count)
    areas = placements[:, 2] // placements[:, 4] * (placements[:, 3] // placements[:, 4])
    placements[:, 6] = np.concatenate([[0], np.cumsum(areas)[:-1]])
    cells = rng.integers(0, 2, areas.sum()).astype(np.uint8)
    places = np.empty((count, 6))
    places[:, 0], places[:, 1] = rng.uniform(-40, 110, count), rng.uniform(-40, 90, count)
    angle, scale = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.6, 1.7, count)
    places[:, 2:] = (scale * [np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)]).T
    out, masks = np.empty((count, 5), np.int32), np.empty(10**6, np.uint8)
    written = transfer_masks(placements, cells, places, bounds, cell, *size, out, masks)
    wanted = plain_masks(placements, cells, places, bounds, cell, size)
    end, kinds = 0, set()
    for n, (rectangle, mask) in enumerate(wanted):
        assert out[n, :4].tolist() == rectangle
        kinds.add(mask is None)
        if mask is None:
            assert out[n, 4] == -1
            continue
        assert out[n, 4] == end
        assert (masks[end : end + mask.size] == mask.reshape(-1)).all()
        end += mask.size
    assert written == end
    assert kinds == {True, False}
    # where there is no room left nothing is written
    few = np.full(1000, 9, np.uint8)
    written = transfer_masks(placements, cells, places, bounds, cell, *size, out, few[:900])
    assert written <= 900
    assert (few[900:] == 9).all()


@pytest.mark.parametrize(
    ("scale", "size"), [(None, (60, 50)), (0.4, (80, 70)), (1.2, (60, 50)), (2.3, (50, 40))]
)
def test_transferred_blocks_are_laid_and_count_where_they_are_whole(scale, size):
    rng = np.random.default_rng(7)
    field = WarpField.identity()
    if scale:
        angle = rng.uniform(0, 1, (5, 5)) + 0.4
        symmetry = np.stack([np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)], -1).reshape(
            5, 5, 2, 2
        )
        field = WarpField.quantised(scale * symmetry)
    exemplar = texture(70, 90)
    grid = BlockGrid.of(Chart(0, *size), field, (70, 90), 20, None)
    match_pyramid = MatchPyramid.of(exemplar, grid.level)
    match_level, cell, count = match_pyramid.levels[grid.level], grid.mask_cell, 25
    placed = np.zeros(count, BLOCK)
    placed["row"], placed["column"] = rng.integers(-15, 70, count), rng.integers(-15, 60, count)
    placed["height"], placed["width"] = (cell * rng.integers(4, 12, count) for _ in range(2))
    placed["source_row"], placed["source_column"] = (
        rng.integers(0, 16 * 70, count),
        rng.integers(0, 16 * 90, count),
    )
    placed["symmetry"], placed["mask_cell"] = rng.integers(0, 8, count), cell
    placed["centred"] = rng.random(count) < 0.3
    own = field.integers_at(placed["row"], placed["column"]) + 64 * rng.integers(-9, 10, (count, 4))
    placed["matrix"] = np.where(placed["centred"][:, None] > 0, own, 0)
    areas = placed["height"] // cell * (placed["width"] // cell)
    placed["first_cell"] = np.concatenate([[0], np.cumsum(areas)[:-1]])
    cells = (rng.random(areas.sum()) < 0.9).astype(np.uint8)

    image = channels_of(match_level)
    plain = PlainChart(grid, grid.need({0, 1}), PlainLevel(image.astype(np.int64), match_level.step), False)
    plain.lay_transferred(placed, cells)
    canvas = np.zeros(plain.laid.shape, np.int32)
    covered, symmetries = np.zeros(plain.laid.shape, np.uint8), np.full(plain.laid.shape, 255, np.uint8)
    names = ("row", "column", "height", "width", "source_row", "source_column", "symmetry", "first_cell")
    laid = np.stack([placed[name].astype(np.int32) for name in names], axis=1)
    laid = np.concatenate([laid, step_matrices(field, placed)], axis=1)
    lay_transferred(
        ChartCanvas(canvas, covered, symmetries),
        match_level.match.image,
        (match_level.height, match_level.width, grid.level),
        field.matrices,
        field.margin,
        plain.pads,
        cell,
        laid,
        cells,
    )
    assert (canvas.view(np.uint8).reshape(plain.canvas.shape) == plain.canvas).all()
    assert (covered == plain.laid).all()
    assert (symmetries == plain.shown % 256).all()
    assert 0.05 < covered.mean() < 0.95
