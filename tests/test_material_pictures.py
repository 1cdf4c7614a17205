"""Pictures of whole materials: what is written, what a stream's thumbnail shows, and charts that meet."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upholster
from upholster.apps.server.html_pages import THUMBNAIL_SIZE
from upholster.apps.server.thumbnail_picture import draw_thumbnail
from upholster.base.options.write_options import WriteOptions
from upholster.image.color import from_linear
from upholster.image.files.material import Material
from upholster.image.files.read import read_image
from upholster.model.textured_model import TexturedModel
from upholster.pipeline import cover, refine

SIDE = 64


def material() -> Material:
    """A grey wall with rows of polished metal and of bumps."""
    rows, columns = np.mgrid[:SIDE, :SIDE]
    grain = np.random.default_rng(0).integers(90, 160, (SIDE, SIDE, 3), dtype=np.uint8)
    slope = 0.5 * np.sin(columns / 2) * (rows % 16 < 8)
    normal = np.stack([slope, np.zeros_like(slope), np.sqrt(1 - slope**2)], axis=2)
    metal = np.where(rows % 16 < 8, 0, 255).astype(np.uint8)[:, :, None]
    return Material(
        {
            "albedo": grain,
            "normal": np.rint(127.5 + 127.5 * normal).astype(np.uint8),
            "roughness": (200 - metal // 2).astype(np.uint8),
            "metallic": metal,
            "ao": (255 - grain[:, :, :1]).astype(np.uint8),
        }
    )


@pytest.fixture(scope="module")
def stream(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("material") / "m.uph"
    cover(
        material(),
        "sphere",
        [str(path)],
        synthesis={"texels": 60_000},
        options=WriteOptions(sample_quality="lossless"),
    )
    return path


@pytest.mark.slow(reason="covers several models, or one several times")
def test_every_map_is_in_the_picture(tmp_path: Path) -> None:
    chosen = material()
    surface = upholster.surface_from_spec("sphere")
    quilt = upholster.synthesize(chosen, surface, texels=60_000)
    maps = upholster.paint_material(quilt, chosen)
    base = maps.pop("albedo")
    options = WriteOptions(size=(160, 120))

    def picture(options: WriteOptions = options, **shown: Any) -> Any:
        return TexturedModel(surface, base, options, maps=shown).picture()

    alone, whole = picture(), picture(**maps)
    assert np.abs(whole - alone).mean() > 0.02
    for role in maps:
        rest = {other: part for other, part in maps.items() if other != role}
        assert np.abs(whole - picture(**rest)).max() > 0.02, role
    np.testing.assert_array_equal(picture(height=maps["ao"]), alone)  # no picture shows it
    flat = picture(WriteOptions(size=(160, 120), normal_scale=0.0), **maps)
    level = {role: part for role, part in maps.items() if role != "normal"}
    np.testing.assert_allclose(flat, picture(**level), atol=2e-3)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_thumbnails_and_refined_pictures_show_the_material(stream: Path, tmp_path: Path) -> None:
    data = stream.read_bytes()
    (tmp_path / "thumbnail.png").write_bytes(draw_thumbnail(io.BytesIO(data)))
    shown = read_image(tmp_path / "thumbnail.png").astype(int)
    decoder = upholster.StreamDecoder()
    decoder.feed(data)
    assert decoder.surface is not None
    options = WriteOptions(quads=4000, size=THUMBNAIL_SIZE)
    maps = {role: decoder.texels(role) for role in decoder.roles[1:]}
    model = TexturedModel(decoder.surface, decoder.texels(), options, maps=maps)
    # But for blended normals, which a decoder leaves shorter.
    assert np.abs(shown - from_linear(model.picture(), np.uint8)).mean() < 0.2
    bare = TexturedModel(decoder.surface, decoder.texels(), options).picture()
    assert np.abs(shown - from_linear(bare, np.uint8)).mean() > 2

    refine(stream, [str(tmp_path / "r.png")], options=options)
    assert np.abs(read_image(tmp_path / "r.png").astype(int) - shown).mean() < 1  # dithered
