"""Regions that are laid once more, and regions that stay: of projects, and of their files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upholster import InputError, Project, paint, read_project, save_project
from upholster.base.errors import FormatError
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import region
from upholster.covering.pins import MOST_PINNED
from upholster.image.files.write import write_image
from upholster.quilt.model import Quilt
from upholster.synthesis.quilt.scene import Scene

HERE, THERE = "2.5,0,0.5:1.4", "-2.5,0,0.5:1.4"


@pytest.fixture(scope="module")
def sample() -> np.ndarray:
    noise = np.random.default_rng(0).random((96, 96, 3))
    for axis in (0, 1):
        noise = sum(np.roll(noise, k, axis) for k in range(-3, 4)) / 7
    spread = (noise - noise.min()) / np.ptp(noise)
    return (255 * spread).astype(np.uint8)


@pytest.fixture(scope="module")
def torus(sample: np.ndarray) -> Project:
    return Project("torus", sample, synthesis={"texels": 30_000, "sample_size": 3.0})


def changed(
    project: Project, sample: np.ndarray, before: Quilt, after: Quilt, text: str
) -> tuple[float, float]:
    """Return which part of the texels differs in a region, and which outside."""
    request = project.request().read()[0]
    assert isinstance(request.scene, Scene)
    ground = MapGround(request.scene.charted, None, request.surface, False)
    inside = np.concatenate([own.ravel() for own in region(parse_map(text), ground)])
    # Tones change a little around the region: its new blocks have other shades.
    plain = (replace(quilt, has_tones=False) for quilt in (before, after))
    pairs = zip(*(paint(quilt, sample, density=1).arrays for quilt in plain), strict=True)
    differs = np.concatenate([(one != other).any(axis=2).ravel() for one, other in pairs])
    return float(differs[inside].mean()), float(differs[~inside].mean())


def test_a_region_is_laid_once_more_and_all_else_stays(torus: Project, sample: np.ndarray) -> None:
    before, once = torus.quilts()[0], torus.again(HERE)
    within, beyond = changed(torus, sample, before, once.quilts()[0], HERE)
    assert within > 0.5
    assert beyond == 0
    twice = once.again(THERE, seed=7)
    assert twice.synthesis.again == (f"{HERE}@1", f"{THERE}@7")
    within, beyond = changed(torus, sample, once.quilts()[0], twice.quilts()[0], THERE)
    assert within > 0.5
    assert beyond == 0


@pytest.mark.slow(reason="covers a model again and again")
def test_a_pinned_region_stays_whatever_seed_and_variety_change(torus: Project, sample: np.ndarray) -> None:
    before = torus.quilts()[0]
    other = torus.pin(HERE).change(seed=5)
    within, beyond = changed(torus, sample, before, other.quilts()[0], HERE)
    assert within == 0
    assert beyond > 0.5
    third = other.pin(THERE).change(seed=9, variety=1.3)
    assert third.pinned is not None
    assert third.pinned.depth == 2
    for text, earlier in ((HERE, before), (THERE, other.quilts()[0])):
        assert changed(torus, sample, earlier, third.quilts()[0], text)[0] == 0
    # Laid once more, it still stays.
    again = third.again(HERE).quilts()[0]
    assert changed(torus, sample, before, again, HERE)[0] == 0
    assert changed(torus, sample, torus.change(seed=5).quilts()[0], other.unpin().quilts()[0], HERE) == (0, 0)


def test_two_regions_that_are_pinned_at_once_are_one_state(torus: Project) -> None:
    both = torus.pin(HERE).pin(THERE)
    assert both.pinned is not None
    assert both.pinned.depth == 1
    assert both.pinned.regions == (HERE, THERE)


def test_nothing_can_stay_where_the_size_or_the_sample_changes(torus: Project, sample: np.ndarray) -> None:
    pinned = torus.pin(HERE)
    with pytest.raises(InputError, match="model, sizes, texels or directions change; allowed: unpin it"):
        pinned.change(sample_size=2.0).quilts()
    with pytest.raises(InputError, match="if model or sample change; allowed: unpin first"):
        pinned.change(sample=sample[::-1].copy())
    assert pinned.unpin().change(sample=sample[::-1].copy()).pinned is None
    with pytest.raises(InputError, match="map is 'here'"):
        torus.pin("here")
    with pytest.raises(InputError, match="map is 'here'"):
        torus.again("here")
    with pytest.raises(InputError, match="pinned with method 'paper'; allowed: with method 'quilt'"):
        Project("sphere", sample, synthesis={"method": "paper", "chart": 64}).pin(HERE)
    project = torus
    for seed in range(1, MOST_PINNED + 1):
        project = project.pin(HERE).change(seed=seed)
    with pytest.raises(InputError, match=f"at {MOST_PINNED + 1} states; allowed: {MOST_PINNED}"):
        project.pin(HERE)


def test_another_seed_needs_no_new_scene_where_something_is_pinned(torus: Project) -> None:
    pinned = torus.pin(HERE).change(seed=5)
    ran = pinned.previews.stages.ran
    pinned.quilts()
    ran.clear()
    pinned.change(seed=6).quilts()
    names = {each.name for each in ran}
    assert "execute" in names
    assert "prepare" not in names


def test_a_file_holds_what_is_pinned(torus: Project, sample: np.ndarray, tmp_path: Path) -> None:
    write_image(tmp_path / "sample.png", sample)
    write_image(tmp_path / "mask.png", np.tile(np.arange(256, dtype=np.uint8), (16, 1))[..., None])
    own = torus.change(sample=str(tmp_path / "sample.png"), guide=(f"luminance={tmp_path}/mask.png",))
    own = own.pin(f"{tmp_path}/mask.png>0.7").change(seed=3).pin(HERE).change(seed=4)
    file = tmp_path / "kept" / "t.upholster.json"
    save_project(own, file)
    reported = json.loads(file.read_text())
    assert reported["pinned"]["regions"] == ["mask.png>0.7", HERE]
    assert reported["pinned"]["before"]["synthesis"]["guide"] == ["luminance=mask.png"]
    assert set(reported["files"]) == {"sample.png", "mask.png"}
    found = read_project(file)
    np.testing.assert_array_equal(found.quilts()[0].placements, own.quilts()[0].placements)
    reported["pinned"]["regions"] = ["../mask.png"]
    file.write_text(json.dumps(reported))
    with pytest.raises(InputError, match=r"mask\.png"):
        read_project(file)
    for wrong in ({"regions": []}, {"regions": "x"}, {"regions": [HERE], "more": 1}, []):
        file.write_text(json.dumps(reported | {"pinned": wrong}))
        with pytest.raises(FormatError, match="pinned"):
            read_project(file)
