"""Samples with masks: blocks show what is used, on every kind of surface, and nothing else."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laying import texture
from repeating import repeating

from upholster import InputError, paint, surface_from_spec, synthesize
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.covering.measure.trace import charted_of
from upholster.image.files.material import Material
from upholster.quilt.model import Quilt
from upholster.quilt.pyramid import halved
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.method import lay_plan
from upholster.synthesis.quilt.scene import coarser
from upholster.synthesis.quilt.usable_blocks import (
    allowed_places,
    check_level,
    check_used,
    largest_block,
    level_with_room,
    usable_side,
    used_level,
)
from upholster.synthesis.setup import prepare
from upholster.synthesis.surface_request import kept_sample

CHAIR = str(Path(__file__).parents[2] / "examples" / "chair.glb")
PHOTO = texture(160, 200, seed=3, passes=3)
SCALED = {"texels": 60_000, "sample_size": 3.0}
PLACES: dict[str, tuple[str, dict[str, Any]]] = {
    "plane": ("plane", {"texels": (210, 190)}),
    "tile": ("plane", {"texels": (128, 128), "tileable": True, "mirror": True, "rotate": True}),
    "torus": ("torus", {"texels": 60_000, "sample_size": 6.0}),
    "torus, mirrored": ("torus", {**SCALED, "mirror": True, "rotate": True}),
    "sphere, coarse": ("sphere", {"texels": 9000, "sample_size": 2.5}),
    "chair": (CHAIR, {"texels": 60_000, "sample_size": "60cm"}),
}


def window(height: int = 160, width: int = 200) -> np.ndarray:
    """Return a mask that hides a window, a finger that comes in from below, and some specks."""
    y, x = np.mgrid[:height, :width]
    hidden = (abs(x - 0.4 * width) < 0.11 * width) & (abs(y - 0.35 * height) < 0.13 * height)
    hidden |= (x - 0.8 * width) ** 2 + ((y - height) / 3) ** 2 < (0.09 * width) ** 2
    for row, column in np.random.default_rng(0).integers(0, (height, width), (3, 2)):
        hidden |= abs(y - row) + abs(x - column) < 3
    return ~hidden


def shares(quilt: Quilt, used: np.ndarray) -> np.ndarray:
    """Return which part of each texel on the surface is read where the sample is not used."""
    hidden = np.where(used, 0, 1).astype(np.float32)[..., None]
    charted, found = charted_of(quilt), []
    for index, array in enumerate(paint(quilt, hidden, density=1).arrays):
        own = array[..., 0]
        found.append(own[charted.lies_on(index, (0, 0), own.shape)] if charted is not None else own.ravel())
    return np.concatenate(found)


def assert_same(quilt: Quilt, wanted: Quilt) -> None:
    np.testing.assert_array_equal(quilt.placements, wanted.placements)
    layers = [[one.labels for chart in each.labels for one in chart] for each in (quilt, wanted)]
    for own, other in zip(*layers, strict=True):
        np.testing.assert_array_equal(own, other)


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("name", PLACES)
def test_no_texel_reads_where_the_mask_is_black(name: str) -> None:
    on, options = PLACES[name]
    used = window()
    quilt = synthesize(Material({"albedo": PHOTO}, used=used), on, **options)
    found = shares(quilt, used)
    # A texel that is larger than a pixel is read from a level of the pyramid, whose filter is wide.
    assert found.max() <= (0.1 if name in ("sphere, coarse", "chair") else 0.0)
    assert (found > 0).mean() < 0.002
    # That is the mask's doing.
    assert (shares(synthesize(PHOTO, on, **options), used) > 0.5).mean() > 0.02


def test_no_texel_of_a_repeating_sample_reads_there_either() -> None:
    photo, _ = repeating(150, 150, [(1 / 18, 0), (0, 1 / 25)])
    used = window(150, 150)
    material = Material({"albedo": photo}, used=used)
    prepared = prepare(
        Exemplar(material.color(), used), surface_from_spec("torus"), SynthesisOptions(texels=40_000)
    )
    assert prepared.phases[0] is not None
    for on, options in (("plane", {"texels": (190, 160)}), ("torus", {"texels": 40_000, "sample_size": 7.0})):
        assert shares(synthesize(material, on, **options), used).max() == 0


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("name", ["plane", "tile", "torus", "chair"])
def test_a_white_mask_gives_the_same_quilt_as_none(name: str) -> None:
    on, options = PLACES[name]
    white = Material({"albedo": PHOTO}, used=np.ones(PHOTO.shape[:2], bool))
    found, wanted = synthesize(white, on, **options), synthesize(PHOTO, on, **options)
    assert_same(found, wanted)


@pytest.mark.parametrize("name", ["plane", "torus"])
def test_what_the_mask_hides_changes_nothing(name: str) -> None:
    on, options = PLACES[name]
    used, other = window(), PHOTO.copy()
    other[~used] = (255, 0, 255)
    found, wanted = (
        synthesize(Material({"albedo": pixels}, used=used), on, **options) for pixels in (other, PHOTO)
    )
    assert_same(found, wanted)


@pytest.mark.parametrize("shape", [(64, 64), (61, 90), (33, 34)])
@pytest.mark.parametrize("level", [0, 1, 2])
def test_a_pixel_of_a_level_is_used_if_it_shows_nothing_else(shape: tuple[int, int], level: int) -> None:
    used = np.random.default_rng(2).random(shape) > 0.01
    hidden = np.where(used, 0, 1).astype(np.float32)[..., None]
    for _ in range(level):
        hidden = halved(hidden)
    np.testing.assert_array_equal(used_level(used, level), hidden[..., 0] == 0)


def test_places_are_those_whose_frame_and_margin_are_used() -> None:
    used = window(60, 70)
    found = allowed_places(used, 10).reshape(used.shape)
    for y, x in np.ndindex(used.shape):
        whole = 5 <= y < 55 and 5 <= x < 65
        wanted = whole and used[max(0, y - 8) : y + 9, max(0, x - 8) : x + 9].all()
        assert found[y, x] == wanted, (y, x)


def test_a_block_leaves_places_to_choose_from() -> None:
    used = np.zeros((200, 200), bool)
    used[20:120, 50:150] = True
    assert usable_side(96, None) == 96
    assert usable_side(24, used) == 24
    assert usable_side(96, used) == 48  # half the square
    assert largest_block(used) == 75
    assert usable_side(200, np.ones((200, 200), bool)) == 100
    for side in (18, 19, 24, 40):
        square = np.zeros((64, 64), bool)
        square[5 : 5 + side, 7 : 7 + side] = True
        assert 8 <= usable_side(40, square) <= largest_block(square) <= side - 10
        # A frame of that side has a place on each of the grids that candidates lie on.
        level, room = level_with_room(square, 2, 512)
        places = allowed_places(used_level(square, level), room // 2 * 2).reshape(64 >> level, -1)
        assert all(places[i::4, j::4].any() for i in range(4) for j in range(4))


def test_texels_that_are_too_coarse_for_what_is_left_are_refused() -> None:
    used = np.zeros((160, 200), bool)
    used[40:90, 30:90] = True
    check_level(used, 0)
    words = (
        r"square that the sample's mask leaves is 50x50 pixels, here \d+x\d+ texels; allowed: 18x18 or more"
    )
    with pytest.raises(InputError, match=words):
        check_level(used, 2)
    with pytest.raises(InputError, match=words):
        synthesize(Material({"albedo": PHOTO}, used=used), "torus", texels=20_000, sample_size=1.2)
    # A quick look takes what there is.
    wanted = SynthesisOptions(texels=40_000, sample_size=7.0)
    exemplar = Exemplar(PHOTO, used)
    quick = coarser(prepare(exemplar, surface_from_spec("torus"), wanted), exemplar, 3)
    assert len(lay_plan(quick, exemplar).match.places)


def test_a_sample_without_small_coefficients_keeps_its_mask() -> None:
    used = window()
    material = Material({"albedo": PHOTO}, used=used)
    kept = kept_sample(material, SynthesisOptions(method="paper", threshold=20.0))
    assert isinstance(kept, Material)
    assert kept is not material
    assert kept.used is not None
    np.testing.assert_array_equal(kept.used, used)


@pytest.mark.parametrize("method", ["paper", "pixel"])
def test_other_methods_know_nothing_of_masks(method: str) -> None:
    with pytest.raises(
        InputError, match=f"use is given with method '{method}'; allowed: with method 'quilt'"
    ):
        synthesize(Material({"albedo": PHOTO}, used=window()), "torus", method=method)


def test_a_mask_that_shows_almost_nothing_may_be_inverted() -> None:
    used = np.zeros((160, 200), bool)
    used[:16, :40] = True
    words = r" \(2 % of the photo is white in the mask; is it inverted\?\)$"
    for look in (lambda: check_used(used, "quilt"), lambda: check_level(used, 0)):
        with pytest.raises(InputError, match=r"leaves is 16x16 pixels.*" + words):
            look()


def test_a_mask_that_leaves_no_room_is_refused_by_its_largest_square() -> None:
    used = np.zeros((160, 200), bool)
    used[:17, :], used[:, :17] = True, True
    with pytest.raises(InputError, match=r"leaves is 17x17 pixels; allowed: 18x18 or more$"):
        synthesize(Material({"albedo": PHOTO}, used=used), "plane", texels=(100, 100))
    used[:18, :18] = True
    synthesize(Material({"albedo": PHOTO}, used=used), "plane", texels=(64, 64))
    with pytest.raises(
        InputError, match="block is 40; allowed: 8 to 8 in a sample of 200x160 pixels with this mask"
    ):
        synthesize(Material({"albedo": PHOTO}, used=used), "plane", texels=(64, 64), block=40)
