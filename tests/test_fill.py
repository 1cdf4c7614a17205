"""`upholster fill` and `upholster.fill`: holes in photos and materials."""

from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster import InputError, Material
from upholster.image.color import to_linear
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.image.masks import is_white

EXAMPLES = Path(__file__).parents[1] / "examples"
PEBBLES = read_image(EXAMPLES / "pebbles.png")[:160, :160, :3]
HIDDEN = (255, 0, 255)


def box(height: int = 160, width: int = 160) -> np.ndarray:
    hole = np.zeros((height, width), np.bool_)
    hole[50:85, 61:110] = True
    return hole


def marked(photo: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """A photo whose hole has a colour that is nowhere else in it."""
    found = photo.copy()
    found[hole] = HIDDEN
    return found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_image(tmp_path / "photo.png", marked(PEBBLES, box()))
    write_image(tmp_path / "mask.png", np.where(box(), 255, 0).astype(np.uint8)[..., None])
    return tmp_path


def test_outside_stays_and_inside_is_texture() -> None:
    hole = box()
    found = upholster.fill(marked(PEBBLES, hole), hole)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], PEBBLES[~hole])
    inside = found[hole].astype(float)
    # Nothing of what was there, and as much variety as round it.
    assert (inside[:, 0] - inside[:, 1]).max() < 80
    assert inside.std() > 0.6 * PEBBLES[~hole].std()


def test_what_was_in_the_hole_counts_for_nothing() -> None:
    hole = box()
    other = PEBBLES.copy()
    other[hole] = np.random.default_rng(1).integers(0, 256, (hole.sum(), 3))
    np.testing.assert_array_equal(upholster.fill(marked(PEBBLES, hole), hole), upholster.fill(other, hole))


def test_the_border_does_not_show() -> None:
    # Across it neighbours differ as they did in the photo; where blocks are merely pasted, 2.4 times as much.
    new, before = [], []
    for seed, moved in ((0, (0, 0)), (1, (30, -20))):
        hole = np.roll(box(), moved, axis=(0, 1))
        found = upholster.fill(marked(PEBBLES, hole), hole, seed=seed)
        for axis in (0, 1):
            for pixels, steps in ((found, new), (PEBBLES, before)):
                differences = np.abs(np.diff(np.asarray(pixels, float), axis=axis)).mean(axis=2)
                steps += differences[np.diff(hole, axis=axis)].tolist()
    assert 0.7 < np.mean(new) / np.mean(before) < 1.5


def test_a_texture_that_repeats_goes_on() -> None:
    rows, columns = np.indices((128, 128))
    photo = (127.5 + 100 * np.sin(rows * 2 * np.pi / 10) * np.cos(columns * 2 * np.pi / 16)).astype(np.uint8)
    hole = box(128, 128)
    found = upholster.fill(np.where(hole, 0, photo)[..., None].astype(np.uint8), hole)
    assert isinstance(found, np.ndarray)
    assert np.abs(found[..., 0][hole].astype(int) - photo[hole]).mean() < 8


def test_the_seed_counts() -> None:
    hole, photo = box(), marked(PEBBLES, box())
    first = upholster.fill(photo, hole, seed=1, threads=1)
    np.testing.assert_array_equal(first, upholster.fill(photo, hole, seed=1, threads=2))
    assert (first != upholster.fill(photo, hole, seed=2)).any()


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_every_kind_of_image(dtype: type, channels: int) -> None:
    photo = to_linear(PEBBLES)
    alpha = np.full((160, 160, 1), 0.5, np.float32)
    photo = np.concatenate(
        [photo if channels > 2 else photo[..., :1], *([alpha] * (channels % 2 == 0))], axis=2
    )
    pixels = photo if dtype == np.float32 else np.rint(photo * np.iinfo(dtype).max).astype(dtype)
    hole = box()
    found = upholster.fill(pixels, hole)
    assert isinstance(found, np.ndarray)
    assert (found.shape, found.dtype) == (pixels.shape, pixels.dtype)
    np.testing.assert_array_equal(found[~hole], pixels[~hole])
    if channels % 2 == 0:
        assert (found[..., -1] == pixels[0, 0, -1]).all()
    assert found[..., 0][hole].std() > 0.5 * pixels[..., 0][~hole].std()


def test_lamps_and_highlights_may_lie_beyond_white() -> None:
    photo = 4 * to_linear(PEBBLES)
    photo[:40] *= 0.01
    assert np.median(photo) < 1 < photo.max()
    hole = box()
    found = upholster.fill(photo, hole)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], photo[~hole])
    assert found[hole].max() > 1


def test_all_maps_of_a_material_show_the_same_places() -> None:
    height = PEBBLES[..., 1:2]
    slope = np.stack(np.gradient(height[..., 0] / 255.0), axis=2)
    normal = np.concatenate([-slope[..., 1:], slope[..., :1], np.full((160, 160, 1), 0.5)], axis=2)
    normal = np.rint(65535 * (0.5 + 0.5 * normal / np.linalg.norm(normal, axis=2, keepdims=True)))
    material = Material({"albedo": PEBBLES, "height": height, "normal": normal.astype(np.uint16)})
    hole = box()
    found = upholster.fill(material, hole)
    assert isinstance(found, Material)
    assert list(found.maps) == list(material.maps)
    for role, pixels in found.maps.items():
        np.testing.assert_array_equal(pixels[~hole], material.maps[role][~hole])
    # The height is the albedo's green: in the hole as well.
    off = np.abs(found.maps["height"][..., 0].astype(int) - found.maps["albedo"][..., 1])
    assert off.max() <= 1
    length = np.linalg.norm(found.maps["normal"] / 32767.5 - 1, axis=2)
    np.testing.assert_allclose(length[hole], 1, atol=1e-3)


def test_another_sample_fills_it() -> None:
    hole = box()
    green = np.zeros((64, 70, 3), np.uint8)
    green[..., 1] = np.random.default_rng(2).integers(150, 250, (64, 70))
    found = upholster.fill(marked(PEBBLES, hole), hole, sample=green)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], PEBBLES[~hole])
    inner = found[62:73, 73:98].astype(int)
    assert (inner[..., 1] > 80).all()
    assert (inner[..., [0, 2]] < 60).all()


def test_clear_parts_of_a_photo_are_a_hole() -> None:
    hole = box()
    alpha = np.where(hole, 0, 255).astype(np.uint8)[..., None]
    found = upholster.fill(np.concatenate([marked(PEBBLES, hole), alpha], axis=2), "alpha")
    np.testing.assert_array_equal(found, upholster.fill(marked(PEBBLES, hole), hole))


def test_holes_that_touch_the_edge_and_several_at_once() -> None:
    hole = np.zeros((160, 160), np.bool_)
    hole[:30, :30] = hole[100:, 75:79] = hole[40:44, 40:44] = hole[159, 159] = True
    found = upholster.fill(marked(PEBBLES, hole), hole)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], PEBBLES[~hole])
    inside = found[hole].astype(int)
    assert (inside[:, 0] - inside[:, 1]).max() < 80


def test_a_speck_is_filled() -> None:
    photo, hole = read_image(EXAMPLES / "pebbles.png")[..., :3], np.zeros((256, 256), np.bool_)
    hole[120, 130] = True
    found = upholster.fill(marked(photo, hole), hole)
    assert isinstance(found, np.ndarray)
    assert (found[hole] != HIDDEN).any()


def test_a_large_hole_is_filled_tile_by_tile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("upholster.synthesis.photo_fill._TILE", 32)
    hole = box()
    found = upholster.fill(marked(PEBBLES, hole), hole, block=16)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], PEBBLES[~hole])
    inside = found[hole].astype(int)
    assert (inside[:, 0] - inside[:, 1]).max() < 80
    steps = np.abs(np.diff(found.astype(float), axis=1)).mean(axis=2)[50:85]
    assert steps[:, 84].mean() < 1.5 * steps[:, 62:108].mean()  # where two tiles meet


def test_a_photo_may_be_larger_than_a_sample() -> None:
    photo = np.tile(PEBBLES, (1, 32, 1))[:64]
    hole = np.zeros(photo.shape[:2], np.bool_)
    hole[20:40, 4500:4520] = True
    found = upholster.fill(photo, hole)
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found[~hole], photo[~hole])


def test_the_command_writes_what_the_library_gives(folder: Path) -> None:
    done = run_cli("fill", "photo.png", "--hole", "mask.png", "--seed", "3", "-o", "out.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("wrote out.png (")
    assert "160x160 pixels of 8 bits, 6.7 % of them new" in done.stdout
    expected = upholster.fill(folder / "photo.png", folder / "mask.png", seed=3)
    np.testing.assert_array_equal(read_image(folder / "out.png"), expected)


def test_a_materials_maps_lie_beside_each_other(folder: Path) -> None:
    write_image(folder / "photo_height.png", PEBBLES[..., :1])
    done = run_cli(
        "fill", "photo.png", "photo_height.png", "--hole", "mask.png", "-o", "out.tif", "-q", cwd=folder
    )
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    height = read_image(folder / "out_height.tif")
    np.testing.assert_array_equal(height[~box()], PEBBLES[..., :1][~box()])
    assert is_white(height)[box()].any()


def test_what_a_format_does_not_hold_is_said(folder: Path) -> None:
    done = run_cli("fill", "photo.png", "--hole", "mask.png", "-o", "out.jpg", cwd=folder)
    assert "note: .jpg does not hold all of the photo to the bit" in done.stdout


BAD = {
    "no such mask": (["--hole", "x.png", "-o", "o.png"], "'x.png' does not exist"),
    "another size": (["--hole", "small.png", "-o", "o.png"], "hole 'small.png' is 40x50 pixels"),
    "no hole": (["--hole", "black.png", "-o", "o.png"], "hole 'black.png' is nothing"),
    "all hole": (["--hole", "white.png", "-o", "o.png"], "hole 'white.png' is everything"),
    "no alpha": (["--hole", "alpha", "-o", "o.png"], "hole is 'alpha', and the photo has none"),
    "no room": (["--hole", "most.png", "-o", "o.png"], "leaves to fill from is"),
    "over the photo": (["--hole", "mask.png", "-o", "photo.png"], "same file as input"),
    "over the mask": (["--hole", "mask.png", "-o", "mask.png"], "same file as input"),
    "over the sample": (
        ["--hole", "mask.png", "--from", "small.png", "-o", "small.png"],
        "same file as input",
    ),
    "no image": (["--hole", "mask.png", "-o", "o.glb"], "'o.glb' is no image"),
    "block": (["--hole", "mask.png", "--block", "4", "-o", "o.png"], "block is 4; allowed: 8 to 512"),
    "too large a block": (
        ["--hole", "mask.png", "--block", "90", "-o", "o.png"],
        "block is 90; allowed: 8 to",
    ),
    "too small a sample": (["--hole", "mask.png", "--from", "tiny.png", "-o", "o.png"], "is 20x20 pixels"),
    "seed": (["--hole", "mask.png", "--seed", "-1", "-o", "o.png"], "seed is -1"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_in_one_line(folder: Path, case: str) -> None:
    arguments, named = BAD[case]
    most = np.full((160, 160, 1), 255, np.uint8)
    most[::12] = 0
    for name, pixels in {
        "small": np.full((50, 40, 1), 255, np.uint8),
        "tiny": np.full((20, 20, 3), 255, np.uint8),
        "black": np.zeros((160, 160, 1), np.uint8),
        "white": np.full((160, 160, 1), 255, np.uint8),
        "most": most,
    }.items():
        write_image(folder / f"{name}.png", pixels)
    before = sorted(folder.iterdir())
    assert_one_line(run_cli("fill", "photo.png", *arguments, cwd=folder), named)
    assert sorted(folder.iterdir()) == before


def test_arrays_that_are_wrong() -> None:
    with pytest.raises(InputError, match=r"hole is 10x12 pixels; allowed: 160x160"):
        upholster.fill(PEBBLES, np.zeros((12, 10), np.bool_))
    with pytest.raises(InputError, match=r"hole has shape \(160, 160\), int64"):
        upholster.fill(PEBBLES, box().astype(np.int64))
    with pytest.raises(InputError, match="sample has no height"):
        upholster.fill(Material({"albedo": PEBBLES, "height": PEBBLES[..., :1]}), box(), sample=PEBBLES)
    with pytest.raises(InputError, match="albedo of the sample is coloured"):
        upholster.fill(PEBBLES[..., :1], box(), sample=PEBBLES)
    with pytest.raises(InputError, match="sample is 4096 pixels wide"):
        upholster.fill(PEBBLES, box(), sample=np.zeros((32, 4096, 3), np.uint8))
