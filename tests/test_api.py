"""The public names: few, documented, and enough for the README's few lines."""

import inspect

import numpy as np
import pytest

import upholster
from upholster.image import write_image


def test_public_names_exist_and_say_what_they_do():
    assert len(upholster.__all__) <= 27
    for name in upholster.__all__:
        value = getattr(upholster, name)
        assert name in dir(upholster)
        if inspect.isfunction(value):
            parameters = inspect.signature(value).parameters.values()
            documented = inspect.getdoc(value)
            assert "Raises" in documented or name == "cover"
            for parameter in parameters:
                assert parameter.name in documented, f"{name} does not document {parameter.name}"
                # Data positional, options keyword-only.
                builder = name in ("ring_cyclide", "torus", "sphere", "plane")
                optional = parameter.default is not parameter.empty
                assert builder or not optional or parameter.kind is parameter.KEYWORD_ONLY
        elif inspect.isclass(value):
            assert value.__doc__
    with pytest.raises(AttributeError):
        upholster.nothing_of_the_kind  # noqa: B018


def test_the_readmes_few_lines_work(tmp_path):
    rng = np.random.default_rng(1)
    write_image(tmp_path / "brick.png", rng.integers(0, 256, (48, 48, 3), dtype=np.uint8))
    seen = []
    exemplar = upholster.read_exemplar(tmp_path / "brick.png")
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(
        exemplar,
        surface,
        seed=7,
        chart=64,
        progress=lambda stage, done, total: seen.append((stage, done, total)),
        method="paper",
    )
    texels = upholster.paint(quilt, exemplar)
    upholster.write(tmp_path / "ring.glb", surface, texels)
    assert (tmp_path / "ring.glb").read_bytes()[:4] == b"glTF"
    decoder = upholster.StreamDecoder()
    decoder.feed(upholster.encode_stream(surface, quilt, exemplar)[:1000])
    upholster.write(tmp_path / "coarse.glb", decoder.surface, decoder.texels())
    assert (tmp_path / "coarse.glb").read_bytes()[:4] == b"glTF"
    assert [entry for entry in seen if entry[1] == entry[2]] == [("blocks", 16, 16), ("seams", 32, 32)]
    with pytest.raises(upholster.InputError):
        upholster.write(tmp_path / "ring.what", surface, texels)


def test_notebooks_show_pictures():
    exemplar = np.random.default_rng(1).integers(0, 65536, (48, 48, 2), dtype=np.uint16)
    surface = upholster.sphere()
    quilt = upholster.synthesize(exemplar, surface, chart=64, method="paper")
    pictures = [thing._repr_png_() for thing in (surface, quilt, upholster.paint(quilt, exemplar))]
    for picture in pictures:
        assert picture.startswith(b"\x89PNG")
    assert len(set(pictures)) == 3


def test_a_surface_of_ones_own():
    flat = upholster.RationalPatch.from_points(
        np.array([[[0, 0, 0], [1, 0, 0]], [[0, -1, 0], [1, -1, 0]]], float)
    )
    surface = upholster.Surface([flat])
    exemplar = np.random.default_rng(1).integers(0, 256, (48, 48), dtype=np.uint8)
    texels = upholster.paint(
        upholster.synthesize(exemplar, surface, chart=40, method="paper"), exemplar[:, :, None]
    )
    assert texels.arrays[0].shape == (40, 40, 1)
