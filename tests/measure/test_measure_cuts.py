"""Borders between blocks and edges of charts: against plain sums, and fair to regular textures."""

import dataclasses

import numpy as np
import pytest
from measured import grains, quilt_of, quilt_of_nearest, tiles, warped

from upholster.base.errors import InputError
from upholster.charts.charted_surface import charted_plane, charted_surface
from upholster.covering.measure import cut_seam_ratio, matched_cut_ratio, mesh_seams
from upholster.covering.measure.places import SeamPlaces
from upholster.covering.measure.trace import Trace, quilt_windows
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels
from upholster.quilt.painting import paint
from upholster.quilt.placement import PLACEMENT


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.5])
def test_cuts_through_a_field_against_the_quilts_own_sources(scale):
    quilt = warped(np.random.default_rng(7), scale, exemplar=(512, 512))
    trace = Trace.of(quilt, quilt_windows(quilt)[0])
    # What each placement would give everywhere, painted alone: exact, from the quilt itself.
    alone = []
    for n in range(len(quilt.placements)):
        placed = quilt.placements[n : n + 1].copy()
        shape = quilt.exemplar_shape
        alone.append(quilt_of_nearest(quilt.charts, placed, exemplar=shape, fields=quilt.fields).sources()[0])
    for axis in (0, 1):
        border = trace.border(axis)
        there = border.rows + (axis == 0), border.columns + (axis == 1)
        one, other = trace.owners[border.rows, border.columns], trace.owners[there]
        assert (one != other).all()
        pairs = zip(one, other, *there, strict=True)
        far = [np.abs(alone[a][row, column] - alone[b][row, column]).max() for a, b, row, column in pairs]
        np.testing.assert_array_equal(border.cut, np.array(far) > 8)


def test_equal_sources_under_other_turns_are_cuts():
    # Both would read texel (0, 0) from pixel (16, 34); turn 5 goes through the columns backwards.
    quilt = quilt_of([(16, 8, 32, 16, 32, 42, 0), (16, 24, 32, 16, 32, 10, 5)])
    assert Trace.of(quilt, quilt_windows(quilt)[0]).border(1).cut.all()


def test_cuts_against_a_plain_sum():
    rng = np.random.default_rng(2)
    blocks = [(r, c, 16, 16, *rng.integers(8, 56, 2), rng.integers(4)) for r in (8, 24) for c in (8, 24)]
    quilt, exemplar = quilt_of(blocks), grains()
    texels = paint(quilt, exemplar)
    pixels = texels.arrays[0] / 255
    down, right = np.abs(np.diff(pixels, axis=0)), np.abs(np.diff(pixels, axis=1))
    everywhere = np.concatenate([down.ravel(), right.ravel()]).mean()
    cuts = np.concatenate([down[15].ravel(), right[:, 15].ravel()]).mean()
    assert cuts > 1.5 * everywhere
    assert cut_seam_ratio(quilt, texels) == pytest.approx(cuts / everywhere, rel=1e-5)


def test_bands_do_not_change_the_figure(monkeypatch):
    exemplar, surface = grains(), plane()
    quilt = synthesize(exemplar, surface, method="paper", chart=100, seed=1)
    texels = paint(quilt, exemplar)
    whole = cut_seam_ratio(quilt, texels)
    monkeypatch.setattr("upholster.covering.measure.cuts.BAND", 7)
    assert cut_seam_ratio(quilt, texels) == pytest.approx(whole)


def test_a_quilt_of_one_block_has_no_cuts():
    quilt = quilt_of([(16, 16, 32, 32, 30, 30, 0)])
    assert cut_seam_ratio(quilt, paint(quilt, grains())) is None
    assert matched_cut_ratio(quilt, paint(quilt, grains()), grains()) is None
    two = quilt_of([(16, 8, 32, 16, 30, 30, 0), (16, 24, 32, 16, 30, 30, 0)])
    assert cut_seam_ratio(two, paint(two, np.full((64, 64, 3), 7, np.uint8))) == 1
    other = Texels((Chart(0, 8, 8),), (np.zeros((8, 8, 3), np.uint8),))
    with pytest.raises(InputError, match="charts"):
        cut_seam_ratio(two, other)
    with pytest.raises(InputError, match="charts"):
        matched_cut_ratio(two, other, grains())
    with pytest.raises(InputError, match="shape"):
        matched_cut_ratio(two, paint(two, grains()), grains(32, 32))


def test_matched_ratio_against_a_plain_sum():
    blocks = [(16, 8, 32, 16, 20, 30, 0), (16, 24, 32, 16, 40, 17, 0)]
    quilt, exemplar = quilt_of(blocks), grains()
    texels = paint(quilt, exemplar)
    pixels, colors = texels.arrays[0] / 255, exemplar / 255
    seen = np.abs(pixels[:, 15] - pixels[:, 16]).mean()
    # Texel column 15 comes from pixel column 37 of the left block, or 8 of the right one.
    left = np.abs(colors[4:36, 37] - colors[4:36, 38]).mean()
    right = np.abs(colors[24:56, 8] - colors[24:56, 9]).mean()
    assert matched_cut_ratio(quilt, texels, exemplar) == pytest.approx(2 * seen / (left + right), rel=1e-5)


def test_quiet_places_do_not_hide_a_border():
    # Blots that are flat between them: blocks that meet in the flat part, with a step of brightness or none.
    exemplar = np.full((64, 64, 3), 120, np.uint8)
    exemplar += (np.arange(64) % 2)[:, None, None].astype(np.uint8)  # nowhere quite flat
    exemplar[:, 8:40] = tiles()[:, 8:40] // 2 + 60
    blocks = [(16, 8, 32, 16, 30, 48, 0), (16, 24, 32, 16, 31, 50, 0)]
    quilt = quilt_of(blocks)
    texels = paint(quilt, exemplar)
    assert cut_seam_ratio(quilt, texels) > 0.5
    quiet = quilt_of([(16, 8, 32, 16, 30, 36, 0), (16, 24, 32, 16, 31, 52, 0)])
    texels = paint(quiet, exemplar)
    assert cut_seam_ratio(quiet, texels) < 0.7
    assert matched_cut_ratio(quiet, texels, exemplar) > 1.4


def test_borders_of_warped_blocks_are_matched_through_the_field():
    exemplar = grains(512, 512)
    rng = np.random.default_rng(5)
    for scale in (0.7, 1.0, 3.0):
        quilt = warped(rng, scale, exemplar=(512, 512))
        texels = paint(quilt, exemplar)
        smooth = matched_cut_ratio(quilt, texels, exemplar)
        placed = quilt.placements.copy()
        placed["source_row"] = rng.integers(0, 512 * 16, len(placed))
        broken = dataclasses.replace(quilt, placements=placed)
        rough = matched_cut_ratio(broken, paint(broken, exemplar), exemplar)
        # Neighbours nearly continue one another: what counts are shifts of more than ½ pixel.
        assert smooth < 0.85 * rough
        assert rough > 1.4
        if scale == 3.0:
            # Sampled as painting does, from a smaller level: else the exemplar seems rougher than the texels.
            assert smooth > 0.9


def test_edges_of_one_copy_are_as_smooth_as_the_exemplar():
    charts = (Chart(0, 32, 20, t1=0.5), Chart(0, 32, 20, t0=0.5))
    placed = np.zeros(2, PLACEMENT)
    placed["chart"] = 0, 1
    placed["row"], placed["column"] = 16 * 16 + 8, 16 * 10 + 8
    placed["source_row"], placed["source_column"] = 16 * 30, (16 * 20, 16 * 40)
    whole = quilt_of_nearest(charts, placed)
    exemplar = grains()
    found = mesh_seams(plane(), whole, paint(whole, exemplar), exemplar).ratio
    assert found == pytest.approx(1, abs=1e-6)
    shifted = placed.copy()
    shifted["source_row"][1] += 16 * 9
    broken = dataclasses.replace(whole, placements=shifted)
    texels = paint(broken, exemplar)
    colors = exemplar / 255
    # Chart 0's last column comes from pixel column 29, chart 1's first from 30.
    seen = np.abs(colors[14:46, 29] - colors[23:55, 30]).mean()
    left, right = (np.abs(colors[r : r + 32, 29] - colors[r : r + 32, 30]).mean() for r in (14, 23))
    expected = 2 * seen / (left + right)
    assert expected > 1.5
    assert mesh_seams(plane(), broken, texels, exemplar).ratio == pytest.approx(expected, rel=1e-5)
    with pytest.raises(InputError, match="charts"):
        mesh_seams(plane(), whole, Texels((Chart(0, 8, 8),), texels.arrays[:1]), exemplar)
    one = quilt_of_nearest(charts[:1], placed[:1].copy())
    assert mesh_seams(plane(), one, paint(one, exemplar), exemplar).ratio is None


@pytest.mark.parametrize("spec", ["torus", "sphere"])
def test_covered_surfaces_have_no_edges_that_show(spec):
    surface, exemplar = surface_from_spec(spec), grains()
    quilt = synthesize(exemplar, surface, texels=2**17, seed=1)
    found = mesh_seams(surface, quilt, paint(quilt, exemplar), exemplar).ratio
    assert 0.9 < found < 1.6
    placed = quilt.placements.copy()
    centre = 16 * 32
    placed["source_row"] = np.where(placed["chart"] % 2 == 0, placed["source_row"], centre)
    broken = dataclasses.replace(quilt, placements=placed)
    assert mesh_seams(surface, broken, paint(broken, exemplar), exemplar).ratio > found + 0.3


@pytest.mark.parametrize("charted", ["tile", "plane"])
def test_places_of_seams_lie_right_beside_one_another(charted):
    if charted == "tile":
        surface, whole = charted_plane(Chart(0, 30, 40), tile=True), np.array((30, 40))
    else:
        charts = (Chart(0, 30, 20, t1=0.5), Chart(0, 30, 20, t0=0.5))
        surface, whole = charted_surface(plane(4, 3), charts), np.array((30, 20))
    found = SeamPlaces.of(surface)
    away = found.texel[:, 1] - found.texel[:, 0]
    # From the last row or column on to the first one of the other chart, or of the tile's other end.
    away = (away + whole // 2) % whole - whole // 2
    np.testing.assert_allclose(found.step[:, 0], away, atol=1e-9)
    np.testing.assert_allclose(found.step[:, 1], -away, atol=1e-9)
    assert (np.abs(away).sum(axis=1) == 1).all()
    assert not found.is_sharp.any()
    inward = found.deep[..., None] * found.inward
    np.testing.assert_allclose(np.abs(inward).sum(axis=2), 1)
    np.testing.assert_allclose(np.floor(found.place + 0.5 * inward), found.texel)
    # One texel of a tile lies beside both of its seams.
    assert len(found.of_texels().chart) == (69 if charted == "tile" else 30)
