"""What files say of themselves: each statement of the list, in a small file, and what is done with it."""

import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from icc_profiles import P3, gamma, matrix_profile
from image_files import png, write_raw
from OpenImageIO import TypeDesc
from PIL import Image

from upholster.base.errors import InputError
from upholster.image.files.jpeg import base_image
from upholster.image.files.read import read_exemplar, read_image
from upholster.image.files.statements import STATEMENTS

DOCS = Path(__file__).parents[2] / "docs" / "photos.md"
MARK = b"\xff\xd9"
GAIN_MAP = (
    b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
    b'<rdf:Description xmlns:hdrgm="http://ns.adobe.com/hdr-gain-map/1.0/" hdrgm:Version="1.0" '
    b'hdrgm:GainMapMax="2.0"/></rdf:RDF></x:xmpmeta>'
)
RNG = np.random.default_rng(4)


def jpeg(*segments: tuple[int, bytes], **options: Any) -> bytes:
    """A JPEG file of 48 x 32 pixels with further segments at its beginning."""
    file = BytesIO()
    small = RNG.integers(0, 255, (4, 6, 3), np.uint8)
    Image.fromarray(small).resize((48, 32)).save(file, "JPEG", quality=95, **options)
    data = file.getvalue()
    more = b"".join(struct.pack(">BBH", 255, kind, len(body) + 2) + body for kind, body in segments)
    return data[:2] + more + data[2:]


def read(path: Path, data: bytes) -> tuple[Any, list[str]]:
    path.write_bytes(data)
    notes: list[str] = []
    return read_image(path, notes=notes), notes


def same_as_pillow(pixels: Any, data: bytes) -> bool:
    return bool(np.abs(pixels.astype(int) - np.asarray(Image.open(BytesIO(data)))).max() <= 2)


def test_the_documents_have_the_same_list() -> None:
    text = DOCS.read_text()
    for row in STATEMENTS:
        assert f"| {row.format} | {row.said} | {row.done} |" in text


# Gain maps and harmless faults of JPEG files


@pytest.mark.parametrize("iso", [False, True])
def test_of_an_ultra_hdr_photo_the_base_image_is_read(tmp_path: Path, iso: bool) -> None:
    gain_map = jpeg((0xE1, b"http://ns.adobe.com/xap/1.0/\0" + GAIN_MAP))
    sign = (0xE2, b"urn:iso:std:iso:ts:21496:-1\0" + bytes(4))
    base = jpeg(sign) if iso else jpeg((0xE1, b"http://ns.adobe.com/xap/1.0/\0" + GAIN_MAP))
    pixels, notes = read(tmp_path / "x.jpg", base + gain_map)
    assert pixels.dtype == np.uint8
    assert same_as_pillow(pixels, base)
    assert notes == []


@pytest.mark.parametrize("count", [1, 5, 300])
def test_stray_bytes_are_left_out_with_a_note(tmp_path: Path, count: int) -> None:
    clean = jpeg()
    place = clean.index(b"\xff\xdb")
    data = clean[:place] + bytes(range(1, 200))[:count] * (1 + count // 200) + clean[place:]
    pixels, notes = read(tmp_path / "x.jpg", data)
    assert same_as_pillow(pixels, clean)
    (note,) = notes
    assert "stray bytes in its header; no pixel is missing" in note
    cut = data[: len(data) * 2 // 3]
    with pytest.raises(InputError, match="truncated or damaged"):
        read(tmp_path / "x.jpg", cut)


@pytest.mark.parametrize("progressive", [False, True])
def test_only_lost_pixels_are_damage(tmp_path: Path, progressive: bool) -> None:
    data = jpeg(progressive=progressive)
    assert data.endswith(MARK)
    if not progressive:  # its last scan might be missing
        assert same_as_pillow(read(tmp_path / "x.jpg", data[:-2])[0], data)
    for less in (40, 400):
        with pytest.raises(InputError, match="truncated or damaged"):
            read(tmp_path / "x.jpg", data[:-less])


@pytest.mark.parametrize("segment", [(0xE1, b"Exif\0\0nonsense"), (0xE2, b"ICC_PROFILE\0\1\1nonsense")])
def test_damaged_metadata_cost_no_pixel(tmp_path: Path, segment: tuple[int, bytes]) -> None:
    pixels, _ = read(tmp_path / "x.jpg", jpeg(segment))
    assert pixels.shape == (32, 48, 3)


def test_headers_of_any_bytes_are_left_to_the_decoder() -> None:
    whole = jpeg()
    for _ in range(200):
        data = bytearray(whole)
        for place in RNG.integers(2, 300, 8):
            data[place] = RNG.integers(256)
        found, faults = base_image(bytes(data))
        assert len(found) <= len(data) + len(MARK)
        assert all(isinstance(fault, str) for fault in faults)


@pytest.mark.parametrize("progressive", [False, True])
def test_stray_bytes_after_the_picture(tmp_path: Path, progressive: bool) -> None:
    clean = jpeg(progressive=progressive)
    pixels, _ = read(tmp_path / "x.jpg", clean[:-2] + bytes(5) + MARK)
    assert same_as_pillow(pixels, clean)


def test_odd_values_that_decoders_ignore(tmp_path: Path) -> None:
    clean = jpeg()
    revision, scan = clean.index(b"JFIF\0") + 5, clean.index(b"\xff\xda")
    spectrum = scan + int.from_bytes(clean[scan + 2 : scan + 4], "big")
    for place, words in ((revision, "JFIF revision"), (spectrum, "parameters of a scan")):
        data = bytearray(clean)
        data[place] = 7
        pixels, notes = read(tmp_path / "x.jpg", bytes(data))
        assert same_as_pillow(pixels, clean)
        (note,) = notes
        assert words in note
        with pytest.raises(InputError, match="truncated or damaged"):
            read(tmp_path / "x.jpg", bytes(data[:-100]))


# Orientation


def test_orientation_by_xmp(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 255, (32, 40, 3), np.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    words = b'XML:com.adobe.xmp\0\0\0\0\0<rdf:Description tiff:Orientation="3"/>'
    turned, _ = read(tmp_path / "x.png", png(40, 32, 8, 2, raw, (b"iTXt", words)))
    np.testing.assert_array_equal(turned, pixels[::-1, ::-1])


# Colours


def written_png(path: Path, pixels: Any, *chunks: tuple[bytes, bytes]) -> tuple[Any, list[str]]:
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    kind = {1: 0, 3: 2}[pixels.shape[2]]
    return read(path, png(pixels.shape[1], pixels.shape[0], 8, kind, raw, *chunks))


@pytest.mark.parametrize("channels", [1, 3])
def test_gamma_of_png(tmp_path: Path, channels: int) -> None:
    pixels = np.full((32, 32, channels), 55, np.uint8)  # 0.216 of full light, sRGB 128
    same, _ = written_png(tmp_path / "x.png", pixels, (b"gAMA", struct.pack(">I", 45455)))
    np.testing.assert_array_equal(same, pixels)
    linear, notes = written_png(tmp_path / "x.png", pixels, (b"gAMA", struct.pack(">I", 100000)))
    assert np.abs(linear.astype(int) - 128).max() <= 1
    assert notes == []


@pytest.mark.parametrize("order", ["<", ">"])
def test_adobe_rgb_by_exif(tmp_path: Path, order: str) -> None:
    # ColorSpace in the Exif folder at 26, InteroperabilityIndex in that at 56.
    head = struct.pack(f"{order}HIHHHIII", 42, 8, 1, 0x8769, 4, 1, 26, 0)
    camera = struct.pack(f"{order}HHHIHHHHIII", 2, 0xA001, 3, 1, 65535, 0, 0xA005, 4, 1, 56, 0)
    names = {name: struct.pack(f"{order}HHHI", 1, 1, 2, 4) + name + bytes(4) for name in (b"R98\0", b"R03\0")}
    reds = []
    for name in names.values():
        exif = b"Exif\0\0" + {"<": b"II", ">": b"MM"}[order] + head + camera + name
        file = BytesIO()
        Image.new("RGB", (32, 32), (200, 60, 40)).save(file, "JPEG", quality=100, exif=exif)
        reds.append(int(read(tmp_path / "x.jpg", file.getvalue())[0][16, 16, 0]))
    assert abs(reds[0] - 200) <= 2
    assert reds[1] > 215


def test_colour_codes_of_png(tmp_path: Path) -> None:
    red = np.full((32, 32, 3), (200, 60, 40), np.uint8)
    wide, notes = written_png(tmp_path / "x.png", red, (b"cICP", bytes([12, 13, 0, 1])))
    assert wide[0, 0, 0] > 208  # Display P3's red is farther out
    assert notes == []
    same, notes = written_png(tmp_path / "x.png", red, (b"cICP", bytes([9, 16, 0, 1])))
    np.testing.assert_array_equal(same, red)
    (note,) = notes
    assert "pq_rec2020 is not converted" in note


SRGB = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
ACESCG = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
TO_ACESCG = np.array([[0.6131, 0.3395, 0.0474], [0.0702, 0.9164, 0.0134], [0.0206, 0.1096, 0.8698]])


@pytest.mark.parametrize(
    ("chromaticities", "matrix"), [(SRGB, np.eye(3)), (XYZ, TO_XYZ), (ACESCG, TO_ACESCG)]
)
def test_chromaticities_of_exr(tmp_path: Path, chromaticities: Any, matrix: Any) -> None:
    light = RNG.random((32, 32, 3)).astype(np.float32)
    light[0, 0] = 0.5
    stored = (light @ matrix.T).astype(np.float32)
    write_raw(
        tmp_path / "x.exr",
        stored,
        "float",
        chromaticities=(TypeDesc("float[8]"), np.array(chromaticities, np.float32)),
    )
    found = read_exemplar(tmp_path / "x.exr")
    np.testing.assert_allclose(found, light, atol=0.004)
    np.testing.assert_array_equal(read_image(tmp_path / "x.exr", colors=False), stored)


def test_chromaticities_that_are_none_are_ignored(tmp_path: Path) -> None:
    light = RNG.random((32, 32, 3)).astype(np.float32)
    for numbers in (np.zeros(8), np.full(8, np.nan), np.full(8, 0.3)):
        kind = (TypeDesc("float[8]"), numbers.astype(np.float32))
        write_raw(tmp_path / "x.exr", light, "float", chromaticities=kind)
        np.testing.assert_array_equal(read_image(tmp_path / "x.exr"), light)


def test_a_profile_counts_before_a_colour_code(tmp_path: Path) -> None:
    file = BytesIO()
    image = Image.fromarray(np.full((32, 32, 3), (200, 60, 40), np.uint8))
    image.save(file, "PNG", icc_profile=matrix_profile(P3, gamma(2.2)))
    data = file.getvalue()
    code = png(1, 1, 8, 2, b"", (b"cICP", bytes([9, 16, 0, 1])))[33:49]
    pixels, notes = read(tmp_path / "x.png", data[:33] + code + data[33:])
    assert pixels[0, 0, 0] > 208
    assert notes == []
