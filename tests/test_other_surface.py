"""The same texels on another surface: ``refine --on``."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.errors import FormatError, InputError
from upholster.base.options.write_options import WriteOptions
from upholster.codec.stream.reader import read_stream
from upholster.codec.stream.surface_swap import on_surface
from upholster.geometry.patches.same_edges import check_same_edges
from upholster.image.files.write import write_image


@pytest.fixture(scope="module")
def ring(tmp_path_factory: Any) -> Path:
    exemplar = np.random.default_rng(3).integers(0, 256, (48, 48, 3), np.uint8)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, texels=20_000, block=16, seed=1)
    path = tmp_path_factory.mktemp("ring") / "ring.uph"
    path.write_bytes(upholster.encode_stream(surface, quilt, exemplar))
    return path


def test_texels_stay_and_the_shape_is_the_other_one(ring: Path, tmp_path: Path) -> None:
    other = "cyclide:a=6,c=1,mu=3"
    files = [f"-o{tmp_path / name}" for name in ("o.npz", "o.uph", "o.obj")]
    done = run_cli("refine", "ring.uph", "--on", other, *files, cwd=ring.parent)
    assert done.returncode == 0, done.stderr
    upholster.refine(ring, [str(tmp_path / "same.npz"), str(tmp_path / "same.obj")])
    texels, same = np.load(tmp_path / "o.npz"), np.load(tmp_path / "same.npz")
    assert texels.files == same.files
    assert all((texels[name] == same[name]).all() for name in same.files)
    surface = upholster.surface_from_spec(other)
    found = read_stream((tmp_path / "o.uph").read_bytes())
    assert found.complete
    assert found.surface is not None
    assert all((a.net == b.net).all() for a, b in zip(found.surface.patches, surface.patches, strict=True))
    assert (tmp_path / "o.obj").read_bytes() != (tmp_path / "same.obj").read_bytes()
    # Nothing but the surface's chunk and the file's length differs.
    assert on_surface((tmp_path / "o.uph").read_bytes(), upholster.ring_cyclide(6, 2, 3)) == ring.read_bytes()
    with pytest.raises(FormatError, match="stream is cut"):
        on_surface(ring.read_bytes()[:-1], surface)


def test_a_surface_of_ones_own_and_a_cut_stream(ring: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.uph"
    cut.write_bytes(ring.read_bytes()[:2000])
    torus = upholster.torus(3, 1)
    check_same_edges(torus, upholster.ring_cyclide(6, 2, 3))
    upholster.refine(cut, [str(tmp_path / "torus.uph")], on=torus, options=WriteOptions(wavelet="5/3"))
    found = read_stream((tmp_path / "torus.uph").read_bytes())
    assert found.surface is not None
    assert found.surface.source == torus.source


@pytest.mark.parametrize(
    ("on", "reported"),
    [
        ("cyclide:spans=6x4", "cyclide:spans=6x4 does not fit the stream: face 0 has 6x4 patches"),
        ("plane:spans=4x4", "edge 0 of patch 0 meets nothing; allowed: meets edge 2 of patch 12"),
        ("toruss", "unknown surface 'toruss'"),
        ("none.json", "none.json: does not exist"),
    ],
)
def test_what_does_not_fit_is_one_line_and_writes_nothing(
    ring: Path, tmp_path: Path, on: str, reported: str
) -> None:
    done = run_cli("refine", "ring.uph", "--on", on, "-o", str(tmp_path / "x.glb"), cwd=ring.parent)
    assert_one_line(done, reported)
    assert not list(tmp_path.iterdir())


def test_octants_are_meant_where_the_stream_has_them(tmp_path: Path) -> None:
    exemplar = np.random.default_rng(3).integers(0, 256, (40, 40, 3), np.uint8)
    write_image(tmp_path / "s.png", exemplar)
    options = {"method": "paper", "chart": 40}
    upholster.cover(str(tmp_path / "s.png"), "sphere", [str(tmp_path / "s.uph")], synthesis=options)
    upholster.refine(tmp_path / "s.uph", [str(tmp_path / "t.npz")], on="sphere:r=2")
    with pytest.raises(InputError, match="it has 6 faces; allowed: 1"):
        upholster.refine(tmp_path / "s.uph", [str(tmp_path / "t.npz")], on="sphere:tiling=six")
