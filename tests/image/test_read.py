import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from image_files import CMYK_RED, png, tiff, write_raw

from upholster.base.errors import InputError
from upholster.image.color import to_linear
from upholster.image.files.read import check_exemplar, read_exemplar
from upholster.image.files.write import write_image

RNG = np.random.default_rng(11)


def smooth(channels: int = 3, height: int = 48, width: int = 40) -> np.ndarray:
    """A picture with some structure, so that JPEG and WebP stay close to it."""
    rows, columns = np.mgrid[0:height, 0:width]
    planes = [rows * (channel + 2) + columns * (5 - channel) for channel in range(channels)]
    return (np.stack(planes, axis=2) % 256).clip(20, 230).astype(np.uint8)


def refused(path: Path, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read_exemplar(path, **options)  # type: ignore[arg-type]
    message = str(caught.value)
    assert "\n" not in message
    return message


def read_or_refuse(path: Path) -> Any:
    """Return the pixels, None if they were refused in one line; any other exception passes through."""
    try:
        return read_exemplar(path, notes=[])
    except InputError as error:
        if "\n" in str(error):
            raise
        return None


# What phones, scanners and paint programs write


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "exr"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_is_obeyed(tmp_path: Path, suffix: str, orientation: int) -> None:
    """Each stored image is what a camera held so would store; all must come out upright."""
    upright = np.zeros((48, 40, 3), np.uint8)
    upright[:16, :16] = (255, 255, 255)
    upright[:16, 24:] = (255, 255, 0)
    upright[32:, :16] = (255, 0, 0)
    # Exif 2.32, tag 0x0112: where row 0 and column 0 of the stored image are on the upright one.
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: upright[::-1, ::-1],
        4: upright[::-1],
        5: upright.swapaxes(0, 1),
        6: np.rot90(upright, 1),
        7: np.rot90(upright, 2).swapaxes(0, 1),
        8: np.rot90(upright, -1),
    }[orientation]
    path = tmp_path / f"x.{suffix}"
    write_raw(
        path, stored, "uint8", Orientation=orientation, Compression="zip" if suffix != "jpg" else "jpeg:98"
    )
    pixels = read_exemplar(path)
    assert pixels.shape == upright.shape
    if suffix == "exr":
        pixels = (pixels * 255).round()
    corners = np.s_[8::32, 8::24]
    assert np.abs(pixels[corners].astype(int) - upright[corners].astype(int)).max() < 12


def test_crop_is_in_upright_pixels(tmp_path: Path) -> None:
    picture = smooth()
    write_raw(tmp_path / "x.tif", np.rot90(picture, 1), "uint8", Orientation=6)
    np.testing.assert_array_equal(read_exemplar(tmp_path / "x.tif", crop=(3, 7, 33, 35)), picture[7:42, 3:36])


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize("depth", [1, 2, 4, 8])
def test_palette(tmp_path: Path, depth: int, alpha: Any) -> None:
    colors = RNG.integers(0, 256, (1 << depth, 4), dtype=np.uint8)
    index = RNG.integers(0, 1 << depth, (40, 48), dtype=np.uint8)
    bits = np.unpackbits(index[:, :, None], axis=2)[:, :, 8 - depth :].reshape(40, -1)
    raw = b"".join(b"\0" + np.packbits(row).tobytes() for row in bits)
    chunks = [(b"PLTE", colors[:, :3].tobytes())] + ([(b"tRNS", colors[:, 3].tobytes())] if alpha else [])
    (tmp_path / "x.png").write_bytes(png(48, 40, depth, 3, raw, *chunks))
    np.testing.assert_array_equal(read_exemplar(tmp_path / "x.png"), colors[index][:, :, : 3 + alpha])


@pytest.mark.parametrize("depth", [1, 2, 4])
def test_grey_of_few_bits(tmp_path: Path, depth: int) -> None:
    values = RNG.integers(0, 1 << depth, (40, 48), dtype=np.uint8)
    bits = np.unpackbits(values[:, :, None], axis=2)[:, :, 8 - depth :].reshape(40, -1)
    raw = b"".join(b"\0" + np.packbits(row).tobytes() for row in bits)
    (tmp_path / "x.png").write_bytes(png(48, 40, depth, 0, raw))
    expected = values[:, :, None] * (255 // ((1 << depth) - 1))
    np.testing.assert_array_equal(read_exemplar(tmp_path / "x.png"), expected)


def test_cmyk(tmp_path: Path) -> None:
    (tmp_path / "x.jpg").write_bytes(CMYK_RED)
    assert np.abs(read_exemplar(tmp_path / "x.jpg").astype(int) - [255, 0, 0]).max() <= 2
    inks = np.zeros((32, 32, 4), np.uint8)
    inks[:, :, 0], inks[:, :, 3] = 255, 51  # cyan, and a fifth of black
    write_raw(tmp_path / "x.tif", inks, "uint8", ("C", "M", "Y", "K"), tiff__ColorSpace="CMYK")
    assert np.abs(read_exemplar(tmp_path / "x.tif").astype(int) - [0, 204, 204]).max() <= 1


def test_premultiplied_alpha_is_divided_out(tmp_path: Path) -> None:
    straight = np.dstack([smooth(3), np.full((48, 40), 100, np.uint8)])
    straight[:8, :, 3] = 255
    product = straight.copy()
    product[:, :, :3] = np.round(straight[:, :, :3] / 255 * straight[:, :, 3:])
    (tmp_path / "x.tif").write_bytes(tiff(product, 1, extra=1))
    pixels = read_exemplar(tmp_path / "x.tif")
    np.testing.assert_array_equal(pixels[:, :, 3], straight[:, :, 3])
    assert np.abs(pixels.astype(int) - straight).max() <= 2
    for extra in (0, 2):  # not said, and straight
        (tmp_path / "x.tif").write_bytes(tiff(straight, 1, extra=extra))
        np.testing.assert_array_equal(read_exemplar(tmp_path / "x.tif"), straight)


def test_transparent_premultiplied_pixels(tmp_path: Path) -> None:
    product = np.zeros((40, 40, 4), np.float32)
    product[20:] = (0.25, 0.5, 0.125, 0.5)
    write_raw(tmp_path / "x.exr", product, "float", ("R", "G", "B", "A"))
    pixels = read_exemplar(tmp_path / "x.exr")
    assert (pixels[:20] == 0).all()
    np.testing.assert_allclose(pixels[20:], np.broadcast_to((0.5, 1, 0.25, 0.5), (20, 40, 4)))


@pytest.mark.parametrize("samples", ["half", "float"])
def test_floats_become_float32(tmp_path: Path, samples: str) -> None:
    values = RNG.normal(size=(40, 40, 3)).astype(np.float16).astype(np.float32)
    write_raw(tmp_path / "x.exr", values, samples)
    pixels = read_exemplar(tmp_path / "x.exr")
    assert pixels.dtype == np.float32
    np.testing.assert_array_equal(pixels, values)


def test_doubles_become_float32(tmp_path: Path) -> None:
    values = RNG.normal(size=(40, 40, 3))
    (tmp_path / "x.tif").write_bytes(tiff(values, 3))
    np.testing.assert_array_equal(read_exemplar(tmp_path / "x.tif"), values.astype(np.float32))


def test_content_counts_not_suffix(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", smooth())
    os.rename(tmp_path / "x.png", tmp_path / "photo.jpg")
    np.testing.assert_array_equal(read_exemplar(tmp_path / "photo.jpg"), smooth())


def test_odd_file_names(tmp_path: Path) -> None:
    path = tmp_path / "a?b=1 %04d ü {x}.png"
    write_image(path, smooth())
    np.testing.assert_array_equal(read_exemplar(path), smooth())
    np.testing.assert_array_equal(read_exemplar(str(path)), smooth())


# Crop and resize


def test_resize(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", smooth(height=200, width=100))
    assert read_exemplar(tmp_path / "x.png", resize=64).shape == (64, 32, 3)
    assert read_exemplar(tmp_path / "x.png", resize="64").shape == (64, 32, 3)
    assert read_exemplar(tmp_path / "x.png", resize="50x60").shape == (60, 50, 3)
    assert read_exemplar(tmp_path / "x.png", resize=(50, 60)).shape == (60, 50, 3)
    assert read_exemplar(tmp_path / "x.png", crop=(0, 100, 100, 50), resize=64).shape == (32, 64, 3)


@pytest.mark.parametrize(
    "crop", [(-1, 0, 32, 32), (0, 0, 41, 48), (0, 1, 40, 48), (0, 0, 0, 48), (1, 2, 3), (0.5, 0, 32, 32), 7]
)
def test_crop_outside_the_image(tmp_path: Path, crop: Any) -> None:
    write_image(tmp_path / "x.png", smooth())
    assert "crop is" in refused(tmp_path / "x.png", crop=crop)


@pytest.mark.parametrize(
    "resize",
    [0, 31, 4097, -5, "256x", "x", "", "1e3", "256x31", "99999999999999", (64,) * 3, (64.5, 64), 64.5, ()],
)
def test_resize_outside_the_limits(tmp_path: Path, resize: Any) -> None:
    write_image(tmp_path / "x.png", smooth())
    assert "resize" in refused(tmp_path / "x.png", resize=resize)


def test_resize_keeps_the_ratio_or_says_so(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", smooth(height=400, width=40))
    assert "resize gives 26x256 pixels; allowed: 32 to 4096" in refused(tmp_path / "x.png", resize=256)


# What must be refused


def test_sizes(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", np.zeros((32, 31, 3), np.uint8))
    assert "31x32 pixels; allowed: 32x32" in refused(tmp_path / "x.png")
    write_image(tmp_path / "x.png", np.zeros((4100, 33, 1), np.uint8))
    notes: list[str] = []
    assert read_exemplar(tmp_path / "x.png", notes=notes).shape == (4096, 33, 1)
    (note,) = notes
    assert "33x4100 pixels and was reduced to 33x4096" in note
    with pytest.warns(UserWarning, match="was reduced to 33x4096"):
        read_exemplar(tmp_path / "x.png")
    assert read_exemplar(tmp_path / "x.png", crop=(0, 4, 32, 4096), notes=[]).shape == (4096, 32, 1)


@pytest.mark.parametrize("size", [100_000, 20_000])
@pytest.mark.parametrize("options", [{}, {"resize": 256}, {"crop": (0, 0, 64, 64)}])
def test_declared_size_is_not_believed(tmp_path: Path, size: Any, options: Any) -> None:
    (tmp_path / "x.png").write_bytes(png(size, size, 8, 2, b"\0" * 100))
    refused(tmp_path / "x.png", **options)


def test_many_pixels_are_refused_by_their_header(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "x.png").write_bytes(png(1 << 15, 1 << 15, 1, 0, b"", (b"teXt", bytes(1 << 20))))
    assert "32768x32768 pixels; allowed: 200,000,000" in refused(tmp_path / "x.png", resize=256)
    (tmp_path / "y.png").write_bytes(png(64, 48, 8, 0, b"\0" * 48 * 65))
    monkeypatch.setenv("UPHOLSTER_MAX_PIXELS", str(64 * 48))
    assert read_exemplar(tmp_path / "y.png", crop=(0, 0, 32, 32)).shape == (32, 32, 1)
    monkeypatch.setenv("UPHOLSTER_MAX_PIXELS", str(64 * 48 - 1))
    assert "allowed: 3,071 in all" in refused(tmp_path / "y.png", crop=(0, 0, 32, 32))
    monkeypatch.setenv("UPHOLSTER_MAX_PIXELS", "many")
    assert "UPHOLSTER_MAX_PIXELS is 'many'" in refused(tmp_path / "y.png", crop=(0, 0, 32, 32))


def test_texts_that_are_not_utf_8(tmp_path: Path) -> None:
    write_image(tmp_path / "x.exr", smooth().astype(np.float32) / 255)
    data = (tmp_path / "x.exr").read_bytes()
    for text in (b"capDate\0", b"channels\0"):  # too long a name by its missing end
        assert text in data
        (tmp_path / "y.exr").write_bytes(data.replace(text, text[:-1] + b"\xff", 1))
        assert "texts are not UTF-8" in refused(tmp_path / "y.exr")


def test_no_image(tmp_path: Path) -> None:
    assert "does not exist" in refused(tmp_path / "none.png")
    assert "is a directory" in refused(tmp_path)
    (tmp_path / "x.png").touch()
    assert "is empty" in refused(tmp_path / "x.png")
    (tmp_path / "x.png").write_text("P3 40 40 255 hello")
    assert "allowed: PNG, JPEG" in refused(tmp_path / "x.png")
    assert "null character" in refused(Path("a\0b.png"))
    assert refused(tmp_path / "x.png" / "y.png")
    os.mkfifo(tmp_path / "pipe.png")
    assert "not a regular file" in refused(tmp_path / "pipe.png")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read everything")
def test_unreadable(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", smooth())
    (tmp_path / "x.png").chmod(0)
    assert "cannot be read" in refused(tmp_path / "x.png")


@pytest.mark.parametrize(
    ("dtype", "form"),
    [(np.int8, 2), (np.int16, 2), (np.int32, 2), (np.uint32, 1)],
    ids=lambda value: str(value),
)
def test_other_integers(tmp_path: Path, dtype: Any, form: int) -> None:
    (tmp_path / "x.tif").write_bytes(tiff(np.ones((40, 40, 3), dtype), form))
    assert "samples; allowed" in refused(tmp_path / "x.tif")


@pytest.mark.parametrize("names", [("R", "G", "B", "Z"), ("A", "B", "G", "R"), ("U", "V"), tuple("RGBAX")])
def test_other_channels(tmp_path: Path, names: tuple[str, ...]) -> None:
    write_raw(tmp_path / "x.exr", np.ones((40, 40, len(names)), np.float32), "float", names)
    if names == ("A", "B", "G", "R"):  # OpenEXR sorts channels, and OpenImageIO puts them back in order
        assert read_exemplar(tmp_path / "x.exr").shape == (40, 40, 4)
    else:
        assert "channels" in refused(tmp_path / "x.exr")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e6])
def test_floats_beyond_reason(tmp_path: Path, value: float) -> None:
    values = np.ones((40, 40, 3), np.float32)
    values[5, 6, 1] = value
    write_raw(tmp_path / "x.exr", values, "float")
    for options in ({}, {"resize": 32}):
        assert "at row 5, column 6, channel 1; allowed: finite" in refused(tmp_path / "x.exr", **options)


def test_large_doubles_do_not_become_infinite(tmp_path: Path) -> None:
    (tmp_path / "x.tif").write_bytes(tiff(np.full((40, 40, 3), 1e200), 3))
    assert "allowed: finite" in refused(tmp_path / "x.tif")


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tif", "exr"])
def test_every_truncation(tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str) -> None:
    """Cut anywhere: refused, or nothing of value was lost. And the C libraries keep quiet."""
    write_image(tmp_path / f"x.{suffix}", smooth())
    data = (tmp_path / f"x.{suffix}").read_bytes()
    whole = read_exemplar(tmp_path / f"x.{suffix}")
    cut = tmp_path / f"cut.{suffix}"
    kept = 0
    for length in range(0, len(data), max(1, len(data) // 120)):
        cut.write_bytes(data[:length])
        pixels = read_or_refuse(cut)
        if pixels is not None:
            kept += 1
            np.testing.assert_array_equal(pixels, whole)
    assert kept <= 3
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tif", "exr"])
def test_damage_never_crashes(tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str) -> None:
    write_image(tmp_path / f"x.{suffix}", smooth())
    data = np.frombuffer((tmp_path / f"x.{suffix}").read_bytes(), np.uint8)
    rng = np.random.default_rng(5)
    for _ in range(60):
        broken = data.copy()
        broken[rng.integers(0, len(data), 3)] = rng.integers(0, 256, 3)
        (tmp_path / f"b.{suffix}").write_bytes(broken.tobytes())
        pixels = read_or_refuse(tmp_path / f"b.{suffix}")
        assert pixels is None or pixels.ndim == 3
    assert capfd.readouterr() == ("", "")


# Arrays


def test_arrays_that_fit_are_kept() -> None:
    for dtype in (np.uint8, np.uint16, np.float32):
        pixels = np.ones((32, 40, 4), dtype)
        assert check_exemplar(pixels) is pixels


def test_arrays_are_brought_to_shape() -> None:
    assert check_exemplar(np.zeros((32, 40), np.uint8)).shape == (32, 40, 1)
    for dtype in (np.float16, np.float64, ">f4"):
        assert check_exemplar(np.full((32, 40, 3), 0.5, dtype)).dtype == np.dtype("=f4")
    swapped = check_exemplar(np.full((32, 40, 3), 258, ">u2"))
    assert swapped.dtype == np.dtype("=u2")
    assert (swapped == 258).all()
    assert check_exemplar(np.zeros((40, 64, 3), np.uint8)[:, ::2]).flags.c_contiguous


@pytest.mark.parametrize(
    "array",
    [
        np.ones((40, 40), bool),
        np.ones((40, 40), np.int32),
        np.ones((40, 40), complex),
        np.ones((40, 40, 5), np.uint8),
        np.ones((40, 40, 0), np.uint8),
        np.ones((40, 31, 3), np.uint8),
        np.ones((0, 40, 3), np.uint8),
        np.ones(40, np.uint8),
        np.ones((40, 40, 3, 1), np.uint8),
        np.full((40, 40), np.nan),
        np.full((40, 40), 1e300),
        np.full((40, 40), "x"),
        [[1, 2], [3, 4]],
        None,
        np.broadcast_to(np.uint8(0), (4097, 40, 3)),
    ],
)
def test_arrays_that_do_not_fit(array: Any) -> None:
    with pytest.raises(InputError, match=r"sample.*allowed") as caught:
        check_exemplar(array)
    assert "\n" not in str(caught.value)


def test_linear_float_of_an_8_bit_image(tmp_path: Path) -> None:
    """The same picture as PNG and as EXR is the same light."""
    write_image(tmp_path / "x.png", smooth())
    write_image(tmp_path / "x.exr", smooth())
    coded, linear = (to_linear(read_exemplar(tmp_path / name)) for name in ("x.png", "x.exr"))
    np.testing.assert_allclose(coded, linear, atol=3e-4)
