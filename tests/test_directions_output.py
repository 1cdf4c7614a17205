"""Pictures of a mesh's directions as outputs of `cover`."""

from pathlib import Path

import numpy as np
import pytest

from upholster import InputError, cover
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.output.outputs import parse_output

CHAIR = Path(__file__).parent.parent / "examples" / "chair.glb"


@pytest.mark.parametrize("name", ["directions.png", "directions:field.jpg"])
def test_a_mesh_shows_its_directions(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    image = np.random.default_rng(1).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    write_image(tmp_path / "x.png", image)
    options = {"size": (96, 72)}
    cover("x.png", CHAIR, [name], model={"part": "Leg 1"}, synthesis={"texels": 20_000}, options=options)
    shown = read_image(parse_output(name).path)
    assert shown.shape == (72, 96, 3)
    assert shown.std() > 0.02


def test_other_surfaces_have_none_and_nothing_is_written(tmp_path: Path) -> None:
    image = np.zeros((64, 64, 3), np.uint8)
    write_image(tmp_path / "x.png", image)
    with pytest.raises(InputError, match="on a mesh"):
        cover(tmp_path / "x.png", "torus", [f"directions:{tmp_path / 'y.png'}"])
    with pytest.raises(InputError, match="suffix"):
        parse_output("directions:y.glb")
    assert not (tmp_path / "y.png").exists()
