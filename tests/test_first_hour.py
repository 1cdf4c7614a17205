"""What somebody meets who names a sample and a surface, and nothing else."""

import json
from pathlib import Path

import numpy as np
import pytest

from upholster import pipeline, surface_from_spec
from upholster.image import write_image
from upholster.pipeline import cover

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def box(tmp_path):
    """A box from 0 to 1, as people write it down."""
    corners = (
        *(((0, 0, 1), (1, 0, 0), (0, 0, -1)), ((1, 0, 1), (0, 1, 0), (0, 0, -1))),
        *(((1, 1, 1), (-1, 0, 0), (0, 0, -1)), ((0, 1, 1), (0, -1, 0), (0, 0, -1))),
        *(((0, 1, 1), (1, 0, 0), (0, -1, 0)), ((0, 0, 0), (1, 0, 0), (0, 1, 0))),
    )
    nets = [np.array([[o, o + r], [o + d, o + r + d]]) for o, r, d in np.array(corners, float)]
    path = tmp_path / "box.json"
    path.write_text(json.dumps({"patches": [{"points": net.tolist()} for net in nets]}))
    return str(path)


@pytest.mark.parametrize("spec", ["torus", "sphere", "vase", "box"])
@pytest.mark.parametrize("pixels", [64, 200])
def test_the_sample_is_a_sixth_of_the_model_wide_whatever_its_pixels(spec, pixels, box, tmp_path):
    on = box if spec == "box" else spec
    found = cover(
        str(EXAMPLES / "pebbles.png"), on, [str(tmp_path / "x.npz")], resize=str(pixels),
        synthesis={"texels": 60_000},
    )  # fmt: skip
    wide = float(found.settled["sample"].split()[0])
    assert wide == pytest.approx(surface_from_spec(on).size / 6, rel=1e-3)
    assert "--sample-size" in found.settled["sample"]


def test_what_is_soft_or_very_large_is_told_before_the_work(tmp_path, monkeypatch):
    sample = tmp_path / "small.png"
    write_image(sample, np.random.default_rng(1).integers(0, 255, (40, 40, 3), np.uint8))
    told, stages = [], []

    def run(**synthesis):
        told.clear()
        return cover(
            str(sample), "sphere", [str(tmp_path / "x.npz")], synthesis=synthesis,
            tell=lambda note: told.append((note, len(stages))), progress=lambda *stage: stages.append(stage),
        )  # fmt: skip

    assert run(texels=40_000).notes == []
    stages.clear()
    assert "soft" in run(texels=200_000).notes[0]
    assert [count for _, count in told] == [0]
    monkeypatch.setattr(pipeline, "_MANY_TEXELS", 30_000)
    assert "GB of texels in memory" in run(texels=40_000).notes[0]
