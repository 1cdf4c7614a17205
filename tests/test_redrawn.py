"""A GLB drawn again looks as when it was made, and shows all of the model."""

from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli
from gltf_models import OLD_IMAGE, Glb

from upholster.geometry.model_files.model_reader import read_model
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.output.glb_picture import part_colors, redrawn
from upholster.pipeline import cover

EXAMPLES = Path(__file__).parents[1] / "examples"
SIZE = (160, 120)


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("sample", ["pebbles.png", "bricks_material"])
def test_it_looks_as_when_it_was_made(tmp_path: Path, sample: str) -> None:
    words = (EXAMPLES / sample, "--on", EXAMPLES / "chair.glb", "--texels", "30k", "--quiet")
    made = run_cli("cover", *words, "--size", "160x120", "-o", tmp_path / "a.glb", "-o", tmp_path / "a.png")
    assert made.returncode == 0, made.stderr
    again = run_cli("picture", tmp_path / "a.glb", "-o", tmp_path / "b.png", "--size", "160x120")
    assert again.returncode == 0, again.stderr
    first, second = (read_image(tmp_path / f"{name}.png").astype(float) for name in "ab")
    assert np.abs(first - second).mean() < 2.5
    sheet = run_cli(
        "picture", tmp_path / "a.glb", "-o", tmp_path / "s.jpg", "--view", "sheet", "--size", "320x240"
    )
    assert sheet.returncode == 0, sheet.stderr
    pixels = read_image(tmp_path / "s.jpg").astype(float)
    assert pixels.shape[:2] == (240, 320)
    assert np.abs(pixels[:120, :160] - second).mean() < 8  # the first view is that of other pictures
    assert np.abs(pixels[:120, :160] - pixels[120:, 160:]).mean() > 3


@pytest.mark.slow(reason="covers several models, or one several times")
def test_a_picture_shows_copies_and_parts_that_are_not_covered(tmp_path: Path) -> None:
    glb = Glb()
    glb.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}})
    box = glb.mesh("box", glb.box())
    for place in (0, 2):
        glb.node(mesh=box, name="copy", translation=[place, 0, 0])
    glb.node(mesh=glb.mesh("red", glb.box() | {"material": 0}), name="red", translation=[0, 0, 2])
    path = glb.write(tmp_path / "boxes.glb")
    sample = tmp_path / "green.png"

    noise = np.random.default_rng(1).integers(0, 60, (64, 64, 1))
    write_image(sample, np.uint8(np.concatenate([noise, noise + 150, noise], axis=2)))
    found = cover(
        str(sample), str(path), [str(tmp_path / "x.png"), str(tmp_path / "x.glb")],
        model={"part": ("copy",)}, synthesis={"texels": 20_000},
    )  # fmt: skip
    assert found.written
    pixels = read_image(tmp_path / "x.png").astype(int)
    red = (pixels[:, :, 0] > pixels[:, :, 1] + 60).mean()
    green = (pixels[:, :, 1] > pixels[:, :, 0] + 40).mean()
    assert red > 0.02
    assert green > 1.2 * red  # both copies; one of them is half of that
    (again,) = redrawn(tmp_path / "x.glb", [(30.0, 30.0)], size=SIZE)
    assert again.shape == (120, 160, 3)


def test_bad_input_is_one_line(tmp_path: Path) -> None:
    assert_one_line(run_cli("picture", EXAMPLES / "chair.glb", "-o", tmp_path / "x.gif"), "has suffix '.gif'")
    assert_one_line(run_cli("picture", tmp_path / "none.glb", "-o", tmp_path / "x.png"), "does not exist")
    wrong = run_cli("picture", EXAMPLES / "chair.glb", "-o", tmp_path / "x.png", "--view", "up")
    assert_one_line(wrong, "view is 'up'")


def test_parts_have_mean_colours(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert part_colors(read_model(tmp_path / "a.obj")).tolist() == [[200, 200, 200]]
    (tmp_path / "b.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n")
    assert part_colors(read_model(tmp_path / "b.obj")).tolist() == [[255, 0, 0]]
    glb = Glb()
    glb.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": [1, 0.2159, 1, 1]}})
    image = glb.add("images", {"bufferView": glb.view(OLD_IMAGE), "mimeType": "image/png"})
    glb.add("textures", {"source": image})
    glb.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    for material in (0, 1):
        glb.node(name=f"{material}", mesh=glb.mesh(f"{material}", glb.box() | {"material": material}))
    (tmp_path / "c.glb").write_bytes(glb.bytes())
    assert part_colors(read_model(tmp_path / "c.glb")).tolist() == [[255, 128, 255], [99, 99, 99]]
