"""What an output consists of, and which image goes where."""

from pathlib import Path

import numpy as np
import pytest

from upholster.charts.seams import find_seams
from upholster.errors import InputError
from upholster.export import write_map
from upholster.geometry import sphere
from upholster.image import read_image
from upholster.model import build_atlas, build_normal_atlas
from upholster.options import WriteOptions
from upholster.outputs import TexturedModel, parse_output
from upholster.quilt import Chart, Texels

ROLES = ("normal", "ao")


def files(text: str, *roles: str, flat: bool = False) -> list[str]:
    return [path.name for path in parse_output(text, flat=flat).files(roles)]


def test_maps_lie_beside_images_by_role() -> None:
    assert files("wall.png") == files("wall.png", *ROLES) == ["wall.png"]
    assert files("atlas:wall.png") == files("wall.png", flat=True) == ["wall.png"]
    beside = ["wall.png", "wall_normal.png", "wall_ao.png"]
    assert files("atlas:wall.png", *ROLES) == files("wall.png", *ROLES, flat=True) == beside
    assert files("a/ring.obj") == ["ring.obj", "ring.mtl", "ring_texture.png"]
    assert files("a/ring.obj", *ROLES)[3:] == ["ring_texture_normal.png", "ring_texture_ao.png"]
    for name in ("a.glb", "a.npz", "a.uph"):
        assert files(name, *ROLES) == [name]
    assert parse_output("atlas:x.exr", flat=True).kind == "atlas"


def test_a_normal_maps_gutters_are_turned() -> None:
    surface = sphere()
    normals = np.random.default_rng(0).integers(0, 256, (6, 32, 32, 3), dtype=np.uint8)
    texels = Texels(tuple(Chart(n, 32, 32) for n in range(6)), tuple(normals))
    maps = {"normal": texels, "emission": texels}
    model = TexturedModel(surface, texels, maps=maps)
    seams = find_seams(surface, texels.charts)
    turned = build_normal_atlas(surface, texels, seams)
    np.testing.assert_array_equal(model.map_pixels("normal"), turned.pixels)
    np.testing.assert_array_equal(model.map_pixels("emission"), build_atlas(texels, seams).pixels)
    assert (model.map_pixels("normal") != model.map_pixels("emission")).any()


@pytest.mark.parametrize("suffix", [".png", ".webp", ".exr", ".jpg"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_plain_numbers_pass_through_no_curve(tmp_path: Path, suffix: str, dtype: type) -> None:
    ramp = np.tile(np.linspace(0, 1, 64), (32, 1))[..., None]
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    write_map(tmp_path / f"a{suffix}", "roughness", (ramp * top).astype(dtype))
    back = read_image(tmp_path / f"a{suffix}")
    found = back / (1 if back.dtype == np.float32 else np.iinfo(back.dtype).max)
    np.testing.assert_allclose(found[..., 0], ramp[..., 0], atol=0.02)


@pytest.mark.parametrize("value", [-1, 101, np.nan])
def test_normal_scale_is_checked(value: float) -> None:
    with pytest.raises(InputError, match="normal_scale"):
        WriteOptions(normal_scale=value)
