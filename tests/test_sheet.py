"""The sheet compares versions by their files: its cases, its options, and what it measures itself."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.sheet import options
from benchmarks.sheet_cases import CASES, EXAMPLES, places
from benchmarks.sheet_measures import MEASURES, Measure, seam_ratio
from benchmarks.sheet_views import SIDE, find, flat_views

from upholster.covering.measure.samples import bilinear
from upholster.image.files.read import read_exemplar
from upholster.output.glb_picture import ShownModel

ROOT = Path(__file__).parents[1]


def test_there_are_24_cases_and_most_need_no_folder(tmp_path: Path) -> None:
    names = [case.name for case in CASES]
    assert len(names) == len(set(names)) == 24
    own = [case for case in CASES if not any(name.startswith("data/") for name in case.files)]
    assert len(own) >= 16
    where, missing = places(CASES, tmp_path, None)
    for case in CASES:
        assert (case.name in missing) == any(not name.startswith("examples/") for name in case.files)
        words = case.words(where)
        assert words[0] == "cover"
        assert words[words.index("--on") + 1] == str(where.get(case.on, case.on))
        assert case.is_flat or not case.size or case.length > 0


def test_options_are_read() -> None:
    asked = options().parse_args(["HEAD~1", "--data", "x", "-o", "y", "--only", CASES[0].name, "--seed", "3"])
    assert (asked.revision, asked.data, asked.out, asked.seed) == ("HEAD~1", Path("x"), Path("y"), 3)
    with pytest.raises(SystemExit):
        options().parse_args(["HEAD", "--only", "no such case"])


@pytest.mark.slow(reason="starts processes")
def test_an_unknown_revision_is_one_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "sheet", "no-such-revision"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "no-such-revision" in done.stderr.splitlines()[-1]


def two_charts(color: np.ndarray, apart: int) -> ShownModel:
    """A strip of 64 × 64 squares, cut in the middle; its right half lies `apart` texels to the right."""
    side = 64
    rows, columns = (part.ravel() for part in np.mgrid[:side, :side])
    lower = np.stack([rows, columns], axis=1)
    square = lower[:, None] + np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    corners = np.concatenate([square[:, [0, 1, 2]], square[:, [0, 2, 3]]]).astype(float)
    right = np.tile(columns >= side // 2, 2)
    uv = corners[:, :, ::-1] + [8, 8] + np.where(right, apart, 0)[:, None, None] * np.array([1, 0])
    space = np.concatenate([corners, np.zeros((*corners.shape[:2], 1))], axis=2)
    return ShownModel(space, np.zeros_like(space), uv, color, {})


def texture(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(84, 84, 3))
    for axis in (0, 1):
        noise = sum(np.roll(noise, shift, axis) for shift in range(4))
    return np.uint8(np.clip(128 + 8 * noise, 0, 255))[:80, :80]


def test_a_seam_shows_where_the_texture_does_not_go_on() -> None:
    whole, other = texture(1), texture(2)
    # Both charts have a margin of 8 texels, which goes on beyond the cut; so the second may lie anywhere.
    going_on = np.concatenate([whole, whole], axis=1)
    assert seam_ratio(two_charts(whole, 0)) is None
    assert seam_ratio(two_charts(going_on, 80)) == pytest.approx(1, abs=0.1)
    assert seam_ratio(two_charts(np.concatenate([whole, other], axis=1), 80)) > 2


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.07])
def test_size_and_place_are_found(scale: float) -> None:
    sample = read_exemplar(EXAMPLES / "pebbles.png", resize=128)[:, :, :3]
    rng = np.random.default_rng(3)
    middles = rng.uniform(40, 88, (12, 2))
    steps = np.stack(np.meshgrid(*[np.arange(SIDE) - (SIDE - 1) / 2] * 2, indexing="ij"), axis=-1)
    turn = np.radians(4)
    matrix = scale * np.array([(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))])
    seen = []
    for middle in middles:
        rows, columns = (middle + steps @ matrix.T).reshape(-1, 2).T
        seen.append(np.uint16(65535 * bilinear(sample, rows, columns)).reshape(SIDE, SIDE, 3))
    found = find(seen, sample)
    assert found.telling.mean() > 0.9
    assert np.abs(found.size[found.telling] / scale - 1).max() < 0.02
    assert np.abs(found.angle[found.telling] - 4).max() < 1
    assert np.abs(found.place - middles)[found.telling].max() < 0.2


def test_views_of_a_picture_are_the_same_for_pictures_of_one_size() -> None:
    image = texture(1)
    one, other = flat_views(image), flat_views(image[::-1])
    assert all(view.shape == (SIDE, SIDE, 3) for view in one)
    assert not np.array_equal(one[0], other[0])
    assert np.array_equal(one[0], flat_views(image)[0])


def test_worse_is_reported_by_more_than_noise() -> None:
    low, one = Measure("{}", "low", 0.1, 0.5), Measure("{}", "one", 0.05)
    assert not low.worse(1.0, 1.5)
    assert low.worse(1.0, 1.6)
    assert not low.worse(1.0, 0.1)
    assert one.worse(1.0, 1.1)
    assert one.worse(1.0, 0.9)
    assert not one.worse(1.3, 1.0)
    assert not any(
        measure.worse(figure, figure) for measure in MEASURES.values() for figure in (0.0, 1.0, 3.0)
    )
