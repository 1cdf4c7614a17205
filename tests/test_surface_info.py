"""``upholster info`` of a surface of patches."""

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks.nets import write_nets
from command_line import run_cli

from upholster.apps.cli.surface_info import show_surface
from upholster.geometry.built_in.catalog import surface_from_spec


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        (
            "torus:R=2,r=0.5",
            ("1 face, 16 patches: 16 of degree (2, 2)", "5 x 5 x 1 (x, y, z)", "closed, 32 shared edges\n"),
        ),
        ("cylinder", ("4 of degree (1, 2)", "2 x 2 x 2 (x, y, z)", "open: 8 edges at the border, 4 shared")),
        (
            "sphere:tiling=octants",
            ("8 of degree (2, 2)", "2 x 2 x 2 (x", "closed, 12", "8 edges that are points"),
        ),
    ],
)
def test_patches_size_and_area_of_a_surface(capsys, spec: str, said: tuple[str, ...]) -> None:
    show_surface(spec)
    printed = capsys.readouterr().out
    assert printed.startswith(f"{spec}: ")
    for words in said:
        assert words in printed
    area = {"torus": 4 * np.pi**2, "cylinder": 4 * np.pi, "sphere": 4 * np.pi}[spec.partition(":")[0]]
    found = float(printed.split("area ")[1].split(";")[0])
    assert found == pytest.approx(area, rel=1e-3)
    size = surface_from_spec(spec).size
    assert f"without --sample-size the sample is {min(size / 6, area**0.5 / 2):.3g} wide" in printed


def test_files_of_nets_are_described_and_what_nearly_meets_is_noted(tmp_path: Path) -> None:
    write_nets(tmp_path / "ring.json", surface_from_spec("torus"))
    done = run_cli("info", "ring.json", cwd=tmp_path)
    assert done.returncode == 0
    assert "ring.json: 1 face, 16 patches" in done.stdout
    nets = [[[[x, y, 0.0] for x in (a, a + 1)] for y in (0, 1)] for a in (0, 1.0001)]
    (tmp_path / "two.json").write_text(json.dumps({"patches": [{"points": net} for net in nets]}))
    done = run_cli("info", "two.json", cwd=tmp_path)
    assert "open: 8 edges at the border, 0 shared edges" in done.stdout
    assert "note: 1 edge would also meet with a tolerance of 0.0001" in done.stdout
    for words, said in (
        (["torus:R=x"], "torus: R is 'x'"),
        (["none.json"], "none.json: does not exist"),
        (["torus", "--unit", "mm"], "--unit is for models"),
    ):
        done = run_cli("info", *words, cwd=tmp_path)
        assert done.returncode == 2
        assert said in done.stderr
        assert done.stderr.count("\n") == 1
