"""HEIC and AVIF: read where their libraries are, refused with what to install where they are not."""

import struct
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from icc_profiles import P3, gamma, matrix_profile
from image_files import FOUR_COLORS, FOUR_COLORS_HEIC
from PIL import Image

from upholster.base.errors import InputError
from upholster.image.files.heif import heif_kind
from upholster.image.files.read import read_exemplar


def quarters(pixels: Any) -> Any:
    """The colours in the middle of the four quarters."""
    height, width = pixels.shape[:2]
    return pixels[height // 4 :: height // 2, width // 4 :: width // 2].reshape(4, -1).astype(int)


def avif(**options: Any) -> bytes:
    colors = np.array(FOUR_COLORS, np.uint8).reshape(2, 2, 3)
    file = BytesIO()
    image = Image.fromarray(colors.repeat(24, axis=0).repeat(32, axis=1))
    image.save(file, "AVIF", quality=95, **options)
    return file.getvalue()


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("data", [FOUR_COLORS_HEIC, avif()], ids=["heic", "avif"])
def test_pixels_are_those_of_the_picture(tmp_path: Path, data: bytes) -> None:
    pixels = read_exemplar(written(tmp_path / "x.jpg", data))  # the content says what it is
    assert pixels.shape == (48, 64, 3)
    assert pixels.dtype == np.uint8
    assert np.abs(quarters(pixels) - FOUR_COLORS).max() <= 8


def test_avif_is_turned_upright(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright: row 0 is the right side
    pixels = read_exemplar(written(tmp_path / "x.avif", avif(exif=exif)))
    assert pixels.shape == (64, 48, 3)
    expected = np.array(FOUR_COLORS)[[2, 0, 3, 1]]
    assert np.abs(quarters(pixels) - expected).max() <= 8


def test_a_profile_is_converted(tmp_path: Path) -> None:
    data = avif(icc_profile=matrix_profile(P3, gamma(2.2)))
    red = quarters(read_exemplar(written(tmp_path / "x.avif", data)))[0]
    assert red[0] > FOUR_COLORS[0][0] + 8  # Display P3's red is farther out


@pytest.mark.parametrize(("data", "library"), [(FOUR_COLORS_HEIC, "pi_heif"), (avif(), "PIL")])
def test_a_missing_library_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, library: str
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    path = written(tmp_path / "x.heic", data)
    with pytest.raises(InputError, match=r"which needs: pip install 'upholster\[photos\]'"):
        read_exemplar(path)


@pytest.mark.parametrize("data", [FOUR_COLORS_HEIC, avif()], ids=["heic", "avif"])
def test_files_cut_short_are_refused_in_one_line(tmp_path: Path, data: bytes) -> None:
    for length in (16, 40, len(data) // 2, len(data) - 60):
        with pytest.raises(InputError) as caught:
            read_exemplar(written(tmp_path / "x.heic", data[:length]))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("data", [FOUR_COLORS_HEIC, avif()], ids=["heic", "avif"])
def test_size_is_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes) -> None:
    path = written(tmp_path / "x.heic", data)
    monkeypatch.setattr("upholster.image.files.read.MAX_BYTES", 5000)
    with pytest.raises(InputError, match="64x48 pixels"):
        read_exemplar(path)


@pytest.mark.parametrize("data", [FOUR_COLORS_HEIC, avif()], ids=["heic", "avif"])
def test_what_is_too_large_for_the_library_is_not_called_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes
) -> None:
    place = data.index(b"ispe") + 8
    huge = data[:place] + struct.pack(">II", 17000, 17000) + data[place + 8 :]
    path = written(tmp_path / "x.avif", huge)
    with pytest.raises(InputError, match="is 17000x17000 pixels; allowed: 200,000,000"):
        read_exemplar(path)
    monkeypatch.setenv("UPHOLSTER_MAX_PIXELS", "400000000")
    if heif_kind(data) == "AVIF":
        with pytest.raises(InputError, match="17000x17000 pixels, too large for the library"):
            read_exemplar(path)


def test_colour_codes_are_applied(tmp_path: Path) -> None:
    data = avif()
    place = data.index(b"colrnclx") + 8
    for codes, more in (((1, 13), 0), ((12, 13), 8)):  # sRGB, Display P3
        coded = data[:place] + struct.pack(">HH", *codes) + data[place + 4 :]
        red = quarters(read_exemplar(written(tmp_path / "x.avif", coded)))[0]
        assert red[0] >= FOUR_COLORS[0][0] + more - 8 * (not more)
    notes: list[str] = []
    coded = data[:place] + struct.pack(">HH", 9, 16) + data[place + 4 :]
    read_exemplar(written(tmp_path / "x.avif", coded), notes=notes)
    assert "pq_rec2020 is not converted" in notes[0]
