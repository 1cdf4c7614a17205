"""How badly blocks of a sample fit elsewhere, and what irregular samples get: a fringe and a floor."""

import numpy as np
import pytest
from laying import plane, texture
from laying_kernels import lay_numbers

from upholster.synthesis.quilt.irregularity import irregularity
from upholster.synthesis.quilt.match_pyramid import match_pyramid, with_fringe

NOISE = np.random.default_rng(3).integers(0, 256, (128, 136, 3), dtype=np.uint8)


def plain_irregularity(form: np.ndarray, side: int, places: np.ndarray) -> float:
    """Return the mean of the least misfit of windows of 4×4 boxes elsewhere, compared one by one."""
    height, width = form.shape[0] // 4, form.shape[1] // 4
    means = form[: 4 * height, : 4 * width].astype(int).reshape(height, 4, width, 4, -1).sum((1, 3)) // 16
    part = np.ones((side, side), bool)
    part[-(-side // 3) :, -(-side // 3) :] = False
    found = []
    for y, x in places[np.random.default_rng(0).integers(len(places), size=24)].tolist():
        own = means[y : y + side, x : x + side][part]
        found.append(
            min(
                ((means[i : i + side, j : j + side][part] - own) ** 2).sum()
                for i, j in places.tolist()
                if max(abs(i - y), abs(j - x)) > side // 4
            )
        )
    return float(np.mean(found) / (means.var(axis=(0, 1)).sum() * part.sum()))


@pytest.mark.parametrize("masked", [False, True])
def test_it_is_the_mean_misfit_at_the_best_other_place(masked: bool) -> None:
    form, used = texture(60, 70, passes=6), np.ones((60, 70), bool)
    if masked:
        used[:, 41:], used[:7] = False, False
    places = np.argwhere(np.ones((15 - 5 + 1, 17 - 5 + 1), bool))
    if masked:  # boxes from row 2 on and up to column 9
        places = places[(places[:, 0] >= 2) & (places[:, 1] + 5 <= 10)]
    found = irregularity(form, 20, used if masked else None)
    assert found == pytest.approx(plain_irregularity(form, 5, places), rel=1e-12)


def test_tiles_are_regular_and_noise_is_not() -> None:
    tiles = np.tile(texture(16, 24, passes=2), (6, 5, 1))
    assert irregularity(tiles, 32) == 0
    assert 1.2 < irregularity(NOISE, 32) < 2
    assert irregularity(np.full((40, 40, 3), 9, np.uint8), 16) == 0
    assert irregularity(NOISE[:9, :9], 8) >= 0  # hardly larger than a box


@pytest.mark.parametrize("shape", [(31, 40), (64, 50)])
@pytest.mark.parametrize("step", [1, 2])
def test_a_fringe_mirrors_the_sample(shape: tuple[int, int], step: int) -> None:
    match = match_pyramid(texture(*shape)).levels[0].match
    guides = np.random.default_rng(1).integers(1, 256, (2, shape[0] * shape[1]), dtype=np.uint8)
    numbers = lay_numbers(*shape, 16, step=step)
    wide, now = with_fringe(match._replace(guides=guides), numbers, 6)
    assert (now.height, now.width, now.fringe) == (shape[0] + 12, shape[1] + 12, 6)
    at = np.array([np.pad(np.arange(size), 6, "reflect") for size in shape], object)
    for planes, mirrored in ((match.image[None], wide.image[None]), (guides, wide.guides)):
        own = planes.reshape(-1, *shape)[:, at[0].astype(int)[:, None], at[1].astype(int)]
        np.testing.assert_array_equal(mirrored.reshape(own.shape), own)
    assert wide.phases.shape == (0, now.height * now.width)


def test_only_irregular_samples_without_broad_shades_get_no_tones() -> None:
    """Gravel has none, boards of different shades have; what repeats keeps them."""
    shades = np.random.default_rng(5).integers(-60, 61, (8, 8, 1)).repeat(16, 0).repeat(17, 1)
    boards = np.clip(NOISE[:, :136] // 2 + 64 + shades, 0, 255).astype(np.uint8)
    tiles = np.tile(NOISE[:32, :34], (4, 4, 1))
    for sample, tones in ((NOISE, False), (boards, True), (tiles, True)):
        assert plane(96, 96).laid(sample, block=32).quilt.has_tones == tones


def shown(sample: np.ndarray) -> np.ndarray:
    """Return how often a large quilt shows each pixel of a sample, relative to the mean."""
    (places,) = plane(512, 512).laid(sample, block=40).quilt.sources()
    at = np.clip((places + 8) >> 4, 0, np.array(sample.shape[:2]) - 1).reshape(-1, 2)
    counts = np.zeros(sample.shape[:2])
    np.add.at(counts, tuple(at.T), 1)
    return np.asarray(counts / counts.mean())


def test_the_rim_of_an_irregular_sample_is_shown_too() -> None:
    counts = shown(NOISE)
    rim = np.ones(counts.shape, bool)
    rim[8:-8, 8:-8] = False
    # Without a fringe 62 % of the rim is never shown, and all of it a fifth as often as the sample.
    assert (counts[rim] == 0).mean() < 0.2
    assert counts[rim].mean() > 0.45
