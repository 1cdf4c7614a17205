"""Colour profiles: what files in them hold comes out as sRGB, by formulas that the code does not use."""

import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from icc_profiles import (
    ADOBE,
    P3,
    SRGB,
    bradford,
    gamma,
    matrix_profile,
    parametric,
    profile,
    sampled,
    table_profile,
    to_xyz,
)
from image_files import write_raw
from PIL import Image

from upholster.base.errors import FormatError
from upholster.image.files.read import read_exemplar, read_image
from upholster.image.icc import read_profile

RNG = np.random.default_rng(4)
SRGB_CURVE = parametric(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def decoded(coded: Any) -> Any:
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def coded(linear: Any) -> Any:
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)


def saved(path: Path, pixels: Any, data: bytes) -> Path:
    write_raw(path, pixels, str(pixels.dtype), ICCProfile=data)
    return path


def in_srgb(samples: Any, primaries: Any, decode: Any) -> Any:
    """Through XYZ under D65, which both have as white: no adaptation, and no profile."""
    return coded(decode(samples) @ (np.linalg.inv(to_xyz(SRGB)) @ to_xyz(primaries)).T)


@pytest.mark.parametrize(
    ("primaries", "curve", "decode"),
    [
        (ADOBE, gamma(2.19921875), lambda x: x**2.19921875),
        (P3, SRGB_CURVE, decoded),
        (P3, sampled(decoded(np.linspace(0, 1, 1024))), decoded),
        (SRGB, gamma(1.0), lambda x: x),
        (ADOBE, parametric(0, 1.8), lambda x: x**1.8),
    ],
    ids=["AdobeRGB", "DisplayP3", "P3 table", "linear", "gamma"],
)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_matrix_profile_is_converted(
    tmp_path: Path, primaries: Any, curve: bytes, decode: Any, dtype: Any
) -> None:
    top = np.iinfo(dtype).max
    pixels = RNG.integers(0, top, (40, 33, 3), dtype=dtype, endpoint=True)
    found = read_exemplar(saved(tmp_path / "x.tif", pixels, matrix_profile(primaries, curve)))
    assert found.dtype == dtype
    error = np.abs(found / top - in_srgb(pixels / top, primaries, decode))
    # Half a code of rounding; of 16 bits the profile's own numbers, which have 16 fractional bits.
    assert error.max() < (0.7 / 255 if dtype == np.uint8 else 5e-4)
    assert error.mean() < 1 / top + 3e-5


def test_floats_become_linear_srgb(tmp_path: Path) -> None:
    pixels = RNG.random((40, 33, 3), np.float32)
    write_raw(tmp_path / "x.tif", pixels, "float", ICCProfile=matrix_profile(P3, gamma(1.0)))
    expected = pixels @ (np.linalg.inv(to_xyz(SRGB)) @ to_xyz(P3)).T
    np.testing.assert_allclose(read_exemplar(tmp_path / "x.tif"), expected, atol=2e-3)


@pytest.mark.parametrize(
    "curve", [SRGB_CURVE, sampled(decoded(np.linspace(0, 1, 1024)))], ids=["formula", "table"]
)
def test_an_srgb_profile_leaves_every_sample(tmp_path: Path, curve: bytes) -> None:
    pixels = RNG.integers(0, 65536, (40, 40, 4), dtype=np.uint16)
    path = tmp_path / "x.png"
    data = matrix_profile(SRGB, curve)
    write_raw(path, pixels, "uint16", ("R", "G", "B", "A"), ICCProfile=data, oiio__UnassociatedAlpha=1)
    np.testing.assert_array_equal(read_exemplar(path), pixels)


def test_alpha_is_no_colour(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 256, (40, 40, 4), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "x.png", icc_profile=matrix_profile(P3, SRGB_CURVE))
    found = read_exemplar(tmp_path / "x.png")
    np.testing.assert_array_equal(found[:, :, 3], pixels[:, :, 3])
    expected = 255 * in_srgb(pixels[:, :, :3] / 255, P3, decoded)
    assert np.abs(found[:, :, :3] - expected).max() < 0.7


def test_grey_follows_its_curve(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 256, (40, 40, 1), dtype=np.uint8)
    data = profile(b"GRAY", b"XYZ ", {b"kTRC": gamma(1.8)})
    found = read_exemplar(saved(tmp_path / "x.png", pixels, data))
    assert np.abs(found - 255 * coded((pixels / 255) ** 1.8)).max() < 0.7


def lab_to_srgb(lab: Any) -> Any:
    """CIE 15:2018, section 8.2.1.2, then Bradford to D65."""
    L, a, b = np.moveaxis(np.asarray(lab, float), -1, 0)
    y = (L + 16) / 116
    f = np.stack([y + a / 500, y, y - b / 200], axis=-1)
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * [0.9642, 1.0, 0.8249]
    white = to_xyz(SRGB) @ np.ones(3)
    return coded(xyz @ np.linalg.inv(bradford(white) @ to_xyz(SRGB)).T)


def ink(corner: Any) -> Any:
    """Lab of full or no ink: an invented press, muted as real ones are, and black over all is black."""
    c, m, y, k = corner
    if k or (c and m and y):
        return 0.0, 0.0, 0.0
    return 100 - 35 * c - 40 * m - 8 * y, -30 * c + 45 * m, -25 * c + 60 * y - 5 * m


INKS = table_profile(b"CMYK", ink, 4)
CORNERS = [(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 1, 0, 0), (0, 1, 1, 0), (0, 0, 0, 1)]


def inked(side: int = 16) -> np.ndarray:
    """One band for each of the corners."""
    bands = [np.full((side, 7 * side, 4), 255 * np.array(corner), np.uint8) for corner in CORNERS]
    return np.concatenate(bands)


@pytest.mark.parametrize("missing", [None, "imagecodecs", "PIL"])
@pytest.mark.parametrize("suffix", ["jpg", "tif"])
def test_cmyk_is_what_its_profile_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, missing: str | None
) -> None:
    path = tmp_path / f"x.{suffix}"
    Image.fromarray(inked(), mode="CMYK").save(path, icc_profile=INKS, quality=100)
    if missing:
        monkeypatch.setitem(sys.modules, missing, None)
    notes: list[str] = []
    found = read_exemplar(path, notes=notes)
    expected = 255 * lab_to_srgb([ink(corner) for corner in CORNERS])
    assert notes == []
    assert np.abs(found[8::16, 50] - expected).max() < 3


def without_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("imagecodecs", "PIL"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.parametrize("suffix", ["jpg", "tif"])
def test_what_is_not_applied_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    path = tmp_path / f"x.{suffix}"
    Image.fromarray(inked(), mode="CMYK").save(path, icc_profile=INKS)
    without_libraries(monkeypatch)
    notes: list[str] = []
    found = read_exemplar(path, notes=notes)
    assert found.shape == (112, 112, 3)
    assert found.dtype == np.uint8
    assert len(notes) == 1
    assert "profile" in notes[0]
    assert "not applied" in notes[0]
    assert "upholster[photos]" in notes[0]
    with pytest.warns(UserWarning, match="not applied"):
        read_exemplar(path)


def test_a_table_at_16_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Grey corners lie on one line of Lab, where interpolation between them is exact."""
    data = table_profile(b"RGB ", lambda rgb: (100 * sum(rgb) / 3, 0, 0), 3)
    pixels = np.repeat(np.linspace(0, 65535, 64 * 64).astype(np.uint16).reshape(64, 64, 1), 3, axis=2)
    path = saved(tmp_path / "x.tif", pixels, data)
    grey = np.linspace(0, 100, 64 * 64).reshape(64, 64)
    expected = lab_to_srgb(np.stack([grey, 0 * grey, 0 * grey], axis=-1))
    found = read_exemplar(path)
    assert np.abs(found / 65535 - expected).max() < 0.002
    assert len(np.unique(found[:, :, 1])) > 3000
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    notes: list[str] = []
    rough = read_exemplar(path, notes=notes)
    assert "at 8 bits" in notes[0]
    assert np.abs(rough / 65535 - expected).max() < 0.006


@pytest.mark.parametrize(
    "data",
    [
        b"no profile at all",
        matrix_profile(P3, gamma(2.2))[:200],
        matrix_profile(P3, b"curv" + bytes(4)),
        matrix_profile(P3, gamma(0.0)),
        matrix_profile(P3, b"what" + bytes(40)),
        profile(b"RGB ", b"XYZ ", {}),
        profile(b"CMYK", b"Lab ", {}),
        table_profile(b"RGB ", lambda rgb: (0, 0, 0), 3)[:-200],
    ],
)
def test_a_damaged_profile_is_left_and_reported(tmp_path: Path, data: bytes) -> None:
    pixels = RNG.integers(0, 256, (40, 40, 3), dtype=np.uint8)
    notes: list[str] = []
    found = read_exemplar(saved(tmp_path / "x.tif", pixels, data), notes=notes)
    np.testing.assert_array_equal(found, pixels)
    assert len(notes) == 1
    assert "\n" not in notes[0]


def test_any_bytes_are_a_profile_or_refused() -> None:
    whole = bytearray(matrix_profile(P3, SRGB_CURVE))
    for _ in range(300):
        data = bytearray(whole)
        for place in RNG.integers(0, len(data), 4):
            data[place] = RNG.integers(256)
        try:
            found = read_profile(bytes(data))
        except FormatError:
            continue
        with np.errstate(all="ignore"):
            for curve in found.curves:
                curve(np.linspace(0, 1, 5))


def test_numbers_that_are_no_colours_stay(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 256, (40, 40, 3), dtype=np.uint8)
    path = saved(tmp_path / "x.png", pixels, matrix_profile(ADOBE, gamma(2.2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(read_image(path, colors=False), pixels)
    assert (read_image(path) != pixels).any()
