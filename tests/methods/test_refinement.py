"""Refinement: cuts cost less, what is hidden may go, finished charts stay, any number of threads."""

from dataclasses import replace

import numpy as np
import pytest
from plain_quilt import shown_blocks, sources_of, texture
from plain_refine import plain_cost
from repeating import repeating

import upholster
from upholster.errors import InputError
from upholster.geometry import plane, torus
from upholster.methods import synthesize
from upholster.methods.quilt import refinement
from upholster.methods.quilt.method import lay_all, synthesize_quilt
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.run import planned
from upholster.methods.synthesis import planned_run, prepare
from upholster.options import SynthesisOptions
from upholster.quilt import Chart, paint
from upholster.quilt.warp_field import WarpField

EXEMPLAR = texture(60, 60)
ONE = (Chart(0, 96, 88),)
PLAIN = QuiltOptions(block=20, evenness=0, variety=0, effort=0)


def laid(effort, seed=0, **changes):
    """Return what is laid on the one chart."""
    options = replace(PLAIN, effort=effort, **changes)
    return lay_all(planned(EXEMPLAR, plane(), ONE, options=options, seed=seed))


def quilted(effort, seed=0, **changes):
    return synthesize_quilt(
        EXEMPLAR, plane(), ONE, options=replace(PLAIN, effort=effort, **changes), seed=seed
    )


def test_cuts_cost_less_the_more_is_tried():
    costs = np.array([
        [plain_cost(*laid(effort, seed), ONE[0], EXEMPLAR) for effort in (0, 1, 3)] for seed in range(3)
    ])  # fmt: skip
    assert (costs[:, 1] < 0.95 * costs[:, 0]).all()
    assert costs[:, 2].sum() < costs[:, 1].sum()


def test_what_repeats_is_left_as_it_is_laid_on_surfaces_unless_more_is_asked_for():
    exemplar, _ = repeating(64, 64, [(1 / 10.4, 0), (0, 1 / 9.7)])
    plain, one, two = (
        synthesize(exemplar, torus(), texels=20_000, sample_size=2.5, effort=effort, seed=1)
        for effort in (0, 1, 2)
    )
    assert (plain.placements == one.placements).all()
    assert len(two.placements) != len(one.placements)


def unevenness(quilt):
    """How much the area differs that squares of 6 × 6 pixels of the exemplar have in the result."""
    rows, columns = np.mgrid[:60, :60]
    places = paint(quilt, np.stack([rows // 6, columns // 6], axis=2).astype(np.float32)).arrays[0]
    found = np.rint(places).astype(int)
    area = np.bincount(found[..., 0].ravel() * 10 + found[..., 1].ravel(), minlength=100)
    return area.std() / area.mean()


def test_what_is_shown_already_is_shown_less_with_evenness():
    plain, even = ([quilted(3, seed, evenness=evenness) for seed in range(3)] for evenness in (0, 2))
    laid = [quilted(0, seed, evenness=2) for seed in range(3)]
    assert np.mean([unevenness(one) for one in even]) < np.mean([unevenness(one) for one in laid])
    assert np.mean([unevenness(one) for one in laid]) < np.mean([unevenness(one) for one in plain])


def test_added_blocks_are_cut_and_lie_on_top():
    (before,), (after,) = laid(0), laid(1)
    added = ~np.isin(after.origins, before.origins)
    assert 0 < added.sum() < len(after.placements)
    assert added[-added.sum() :].all()
    assert (after.placements["first_cell"][added] >= 0).all()
    assert (after.placements["height"][added] > before.placements["height"].max()).all()


def test_what_is_hidden_leaves_no_trace(monkeypatch):
    (seen,) = laid(4)
    monkeypatch.setattr(refinement, "_without_hidden", lambda laid, _lattice, _added: laid)
    (whole,) = laid(4)
    assert len(seen.placements) < len(whole.placements)
    shown = (one.origins[shown_blocks(one, ONE[0])] for one in (seen, whole))
    np.testing.assert_array_equal(*shown)


def test_nothing_is_bare():
    prepared = prepare(EXEMPLAR, torus(), SynthesisOptions(texels=30_000, block=16, effort=3))
    each = lay_all(planned_run(prepared, EXEMPLAR, torus(), seed=2))
    for one, chart in zip(each, prepared.charts, strict=True):
        assert (shown_blocks(one, chart) >= 0).all()


def test_a_tile_is_refined_over_its_edges():
    costs = np.empty((3, 2, 2))
    for seed, effort in np.ndindex(3, 2):
        tile, options = Chart(0, 84, 90), QuiltOptions(block=20, effort=effort)
        (one,) = lay_all(planned(EXEMPLAR, plane(), (tile,), options=options, wrap=True, seed=seed))
        sources = sources_of(one, tile, WarpField.identity())
        picture = EXEMPLAR[sources[..., 0] // 16, sources[..., 1] // 16].astype(float)
        breaks = np.zeros(picture.shape[:2])
        for axis, step in ((0, (16, 0)), (1, (0, 16))):
            broken = (np.roll(sources, -1, axis) - sources != step).any(axis=2)
            breaks += broken * np.abs(np.roll(picture, -1, axis) - picture).mean(axis=2)
        middle = np.zeros(breaks.shape, bool)
        middle[12:-12, 12:-12] = True
        costs[seed, effort] = breaks[middle].mean(), breaks[~middle].mean()
    inside, along_edges = costs.mean(axis=0).T
    assert along_edges[1] < 0.85 * along_edges[0]
    assert along_edges[1] / along_edges[0] < 1.2 * inside[1] / inside[0]


def test_a_refined_tile_shows_each_block_once_more_beyond_the_edge_it_reaches_over():
    options, tile = replace(PLAIN, effort=2), Chart(0, 83, 91)
    (whole,) = lay_all(planned(EXEMPLAR, plane(), (tile,), options=options, wrap=True, seed=1))
    assert (shown_blocks(whole, tile) >= 0).all()
    names = ("row", "column", "height", "width", "source_row", "source_column")
    known = {tuple(int(one[name]) for name in names) for one in whole.placements}
    down = [(r - 83, *rest) for r, *rest in known if r - rest[1] // 2 + rest[1] > 83]
    right = [(r, c - 91, *rest) for r, c, *rest in known if c - rest[1] // 2 + rest[1] > 91]
    assert max(len(down), len(right)) > 5
    assert known.issuperset(down + right)


def test_the_number_of_threads_changes_nothing():
    one, four = (
        synthesize(EXEMPLAR, torus(), texels=30_000, block=16, effort=2, threads=threads)
        for threads in (1, 4)
    )
    assert (one.placements == four.placements).all()
    for a, b in zip(one.labels, four.labels, strict=True):
        np.testing.assert_array_equal(a[0].labels, b[0].labels)


@pytest.mark.parametrize("effort", [-1, 10])
def test_effort_is_checked(effort):
    with pytest.raises(InputError, match=f"effort is {effort}; allowed: 0 to 9"):
        SynthesisOptions(effort=effort)


def test_turned_blocks_and_minified_texture_are_refined():
    for options in ({"mirror": True, "rotate": True}, {"sample_size": 0.2}):
        plain, quilt = (
            upholster.synthesize(EXEMPLAR, "torus", texels=20_000, seed=1, effort=effort, **options)
            for effort in (0, 1)
        )
        sources = (np.concatenate([one.ravel() for one in each.sources()]) for each in (plain, quilt))
        assert (next(sources) != next(sources)).mean() > 0.01
        again = upholster.StreamDecoder()
        again.feed(upholster.encode_stream("torus", quilt, EXEMPLAR))
        assert again.complete
