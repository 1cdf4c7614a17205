from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.image.color import from_linear, to_linear
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import ImageFormat, encode_image, write_image


@st.composite
def images(draw: Any) -> Any:
    dtype = draw(st.sampled_from([np.uint8, np.uint16, np.float32]))
    shape = (draw(st.integers(32, 45)), draw(st.integers(32, 45)), draw(st.integers(1, 4)))
    rng = np.random.default_rng(draw(st.integers(0, 1 << 30)))
    if dtype == np.float32:
        return rng.uniform(0, 1, shape).astype(np.float32)
    return rng.integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)


@given(pixels=images(), kind=st.sampled_from(["png", "tiff", "exr", "webp"]))
def test_lossless_round_trips(tmp_path_factory: pytest.TempPathFactory, pixels: Any, kind: str) -> None:
    path = tmp_path_factory.mktemp("x") / f"x.{kind}"
    write_image(path, pixels, quality=100)
    back = read_exemplar(path)
    channels = pixels.shape[2]
    if kind == "exr":
        assert back.dtype == np.float32
        if channels in (1, 3):  # premultiplied alpha rounds
            expected = to_linear(pixels)
            np.testing.assert_array_equal(back, _half(expected) if pixels.dtype == np.uint8 else expected)
        return
    if kind == "webp":
        assert back.dtype == np.uint8
        pixels = pixels[:, :, {1: [0, 0, 0], 2: [0, 0, 0, 1], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[channels]]
    if pixels.dtype == np.float32 and kind != "tiff":
        pixels = from_linear(pixels, np.uint8)
    if pixels.dtype == np.uint16 and kind == "webp":
        pixels = np.round(pixels / 257).astype(np.uint8)
    if kind == "webp" and pixels.shape[2] == 4:  # it drops the colour of what nobody sees
        pixels, back = (np.where(image[:, :, 3:] == 0, np.uint8(0), image) for image in (pixels, back))
    assert back.dtype == pixels.dtype
    np.testing.assert_array_equal(back, pixels)


def _half(values: Any) -> Any:
    return values.astype(np.float16).astype(np.float32)


@pytest.mark.parametrize("kind", ["jpg", "jpeg", "webp"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_lossy_formats_stay_close(tmp_path: Path, kind: str, dtype: Any) -> None:
    rows, columns = np.mgrid[0:64, 0:64] / 64
    coded = np.stack([rows, columns, 1 - rows], axis=2)
    pixels = to_linear((coded * 255).astype(np.uint8))
    pixels = pixels if dtype == np.float32 else from_linear(pixels, dtype)
    write_image(tmp_path / f"x.{kind}", pixels, quality=95)
    back = read_exemplar(tmp_path / f"x.{kind}")
    assert np.abs(back - coded * 255).mean() < 3
    assert len(encode_image(pixels, "jpeg", quality=30)) < len(encode_image(pixels, "jpeg", quality=95))


def test_bits() -> None:
    pixels = np.linspace(0, 1, 32 * 32 * 3, dtype=np.float32).reshape(32, 32, 3)
    coded = from_linear(pixels, np.uint16)
    assert encode_image(pixels, "png", bits=16) == encode_image(coded, "png")
    assert encode_image(coded, "png", bits=8) == encode_image(np.round(coded / 257).astype(np.uint8), "png")
    eight = from_linear(pixels, np.uint8)
    assert encode_image(eight, "png", bits=16) == encode_image(eight * np.uint16(257), "png")


def test_jpeg_lays_alpha_over_white(tmp_path: Path) -> None:
    pixels = np.zeros((32, 32, 4), np.uint8)
    pixels[:16, :, 3] = 255
    write_image(tmp_path / "x.jpg", pixels)
    back = read_exemplar(tmp_path / "x.jpg")
    assert back.shape == (32, 32, 3)
    assert back[:15].max() < 8
    assert back[17:].min() > 247


def test_images_are_written_the_same_each_time() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (64, 64, 4), dtype=np.uint8)
    kinds: tuple[ImageFormat, ...] = ("png", "jpeg", "webp")
    for kind in kinds:
        assert encode_image(pixels, kind) == encode_image(pixels.copy(order="F"), kind)


@pytest.mark.parametrize(
    ("pixels", "kind", "options"),
    [
        (np.zeros((4, 4, 3), np.uint8), "gif", {}),
        (np.zeros((4, 4, 3), np.uint8), "jpeg", {"quality": 0}),
        (np.zeros((4, 4, 3), np.uint8), "jpeg", {"quality": 101}),
        (np.zeros((4, 4, 3), np.uint8), "png", {"bits": 12}),
        (np.zeros((4, 4), np.uint8), "png", {}),
        (np.zeros((4, 4, 5), np.uint8), "png", {}),
        (np.zeros((0, 4, 3), np.uint8), "png", {}),
        (np.zeros((4, 4, 3), np.int32), "png", {}),
        (np.full((4, 4, 3), np.nan, np.float32), "png", {}),
        (np.full((4, 4, 3), np.inf, np.float32), "exr", {}),
        (np.zeros((1, 16384, 3), np.uint8), "webp", {}),
        (np.zeros((65536, 1, 1), np.uint8), "jpeg", {}),
    ],
)
def test_what_cannot_be_written(pixels: Any, kind: Any, options: Any) -> None:
    with pytest.raises(InputError, match=r"allowed|known") as caught:
        encode_image(pixels, kind, **options)
    assert "\n" not in str(caught.value)


def test_where_it_cannot_be_written(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pixels = np.zeros((32, 32, 3), np.uint8)
    with pytest.raises(InputError, match=r"did you mean '.png'"):
        write_image(tmp_path / "x.pgn", pixels)
    for suffix in ("png", "jpg", "webp", "tif", "exr"):
        with pytest.raises(InputError, match="cannot be written") as caught:
            write_image(tmp_path / "no" / f"x.{suffix}", pixels)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tif", "exr"])
def test_full_disk(suffix: str, tmp_path: Path) -> None:
    """Every write to /dev/full fails, as on a full disk."""
    path = tmp_path / f"x.{suffix}"
    path.symlink_to("/dev/full")
    with pytest.raises(InputError, match="cannot be written"):
        write_image(path, np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8))


def test_systems_without_files_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    in_memory = encode_image(pixels, "png")
    monkeypatch.delattr("os.memfd_create")
    assert encode_image(pixels, "png") == in_memory
    monkeypatch.setattr("shutil.disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(InputError, match="too little room"):
        encode_image(pixels, "jpeg")
