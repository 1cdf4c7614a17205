"""The public names: few, documented, and enough for the README's few lines."""

import ast
import html
import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import upholster
from upholster.covering.photos import fill_files
from upholster.image.files.write import write_image

SMALL = {"method": "paper", "chart": 32, "block": 24}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A small model with all that belongs to it, and a folder with its files."""
    folder = tmp_path_factory.mktemp("made")
    exemplar = np.random.default_rng(1).integers(0, 256, (48, 48, 3), dtype=np.uint8)
    write_image(folder / "x.png", exemplar)
    surface = upholster.sphere()
    quilt = upholster.synthesize(exemplar, surface, **SMALL)
    stream = upholster.encode_stream(surface, quilt, exemplar)
    (folder / "x.uph").write_bytes(stream)
    return folder, exemplar, surface, quilt, upholster.paint(quilt, exemplar), stream


def test_public_names_exist_and_say_what_they_do():
    assert len(upholster.__all__) <= 37
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


def test_type_checkers_see_all_public_names():
    tree = ast.parse(Path(upholster.__file__).read_text(encoding="utf-8"))
    (checked,) = (one for one in tree.body if isinstance(one, ast.If))
    homes = {name.name: entry.module for entry in checked.body for name in entry.names}
    assert homes == upholster._HOME | {"measure": "upholster.covering"}
    at_once = {"FormatError", "InputError", "UpholsterError", "__version__"}
    assert set(upholster.__all__) == homes.keys() | at_once


def test_texels_are_an_array_where_there_is_one_chart(made):
    *_, texels, _ = made
    if len(texels.arrays) > 1:
        with pytest.raises(upholster.InputError, match=r"allowed: \.arrays"):
            np.asarray(texels)
    only = upholster.Texels(texels.charts[:1], texels.arrays[:1])
    np.testing.assert_array_equal(np.asarray(only), texels.arrays[0])
    assert np.asarray(only, np.float32).dtype == np.float32


def test_measures_are_there_without_an_import():
    assert callable(upholster.measure.measure_cover)
    assert "measure" in dir(upholster)


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


def test_callbacks_are_checked_before_a_file_is_read(tmp_path):
    project, target = upholster.Project("torus", "missing.png", notes=("a note",)), [str(tmp_path / "x.glb")]
    for work in (
        lambda: upholster.cover("missing.png", "torus", target, tell=3),
        lambda: upholster.cover("missing.png", "torus", target, progress=3),
        lambda: upholster.fill("missing.png", "alpha", progress=3),
        lambda: fill_files("missing.png", "alpha", tmp_path / "x.png", progress=3),
        lambda: project.cover(target, tell=3),
        lambda: project.quilts(progress=3),
        lambda: project.preview(progress=3),
    ):
        with pytest.raises(upholster.InputError, match=r"^(tell|progress) is a int; allowed: a function"):
            work()


@pytest.mark.slow(reason="calls every function with much that is wrong")
def test_notebooks_show_pictures(made):
    _, _, surface, quilt, texels, stream = made
    decoder = upholster.StreamDecoder()
    assert decoder._repr_png_() is None
    decoder.feed(stream[:300])
    coarse = decoder._repr_png_()
    decoder.feed(stream[300:])
    sheet = upholster.Texels(texels.charts, texels.arrays)._repr_png_()
    pictures = [thing._repr_png_() for thing in (surface, quilt, texels)]
    for picture in (*pictures, coarse, sheet):
        assert picture.startswith(b"\x89PNG")
        assert len(picture) < 600_000
    assert len({*pictures, coarse, sheet}) == 5
    assert upholster.view(stream).stream == texels.view().stream == stream


@pytest.mark.slow(reason="calls every function with much that is wrong")
def test_the_viewer_is_one_frame_without_anything_beside_it(made, tmp_path):
    _, exemplar, surface, _, texels, stream = made
    report = upholster.cover(exemplar, surface, tmp_path / "x.uph", synthesis=SMALL)
    assert report._repr_png_() == texels._repr_png_()
    refined = upholster.refine(tmp_path / "x.uph", tmp_path / "y.npz")
    decoder = upholster.StreamDecoder()
    decoder.feed(stream)
    for model in (report, refined, tmp_path / "x.uph", str(tmp_path / "x.uph"), {"albedo": texels}, decoder):
        viewer = upholster.view(model)
        again = upholster.StreamDecoder()
        again.feed(viewer.stream)
        assert (again.quilt().placements == texels.quilt.placements).all()
    shown = report.view(height=300)._repr_html_()
    assert shown.startswith("<iframe ")
    assert shown.count("<") == 2  # the frame and its end
    assert "300px" in shown
    assert len(shown) < 500_000
    page = html.unescape(re.search('srcdoc="([^"]*)"', shown)[1])
    assert page.startswith("<!doctype html>")
    assert "src=" not in re.sub(r"<script[^>]*>[^<]*</script>", "", page)


def test_a_view_of_a_long_stream_is_bounded(made, monkeypatch):
    stream = made[-1]
    monkeypatch.setattr("upholster.apps.notebook.MOST_BYTES", 2000)
    viewer = upholster.view(stream)
    assert viewer.stream == stream[:2000]
    assert f"2,000 of {len(stream):,} bytes" in repr(viewer)


def test_what_has_no_model_is_not_viewed(made):
    _, exemplar, surface, quilt, texels, stream = made
    alone = upholster.Texels(texels.charts, texels.arrays)
    for wrong in (
        surface,
        quilt,
        exemplar,
        5,
        None,
        "none.uph",
        b"x" * 99,
        stream[:20],
        upholster.StreamDecoder(),
        alone,
    ):
        with pytest.raises((upholster.InputError, upholster.FormatError)):
            upholster.view(wrong)
    for shown in (surface, quilt, alone):
        with pytest.raises(upholster.InputError):
            shown.view()
    with pytest.raises(upholster.InputError, match="height is 5; allowed: 100 to 10000"):
        upholster.view(stream, height=5)


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


def test_paths_and_text_stand_for_what_they_name(made):
    folder, exemplar, surface, quilt, texels, stream = made
    same = upholster.synthesize(str(folder / "x.png"), "sphere:tiling=six", **SMALL)
    assert (same.placements == quilt.placements).all()
    for path in (folder / "x.png", str(folder / "x.png")):
        painted = upholster.paint(same, path)
        assert all((a == b).all() for a, b in zip(painted.arrays, texels.arrays, strict=True))
    assert upholster.encode_stream("sphere", quilt, folder / "x.png") == stream
    (folder / "nets.json").write_text('{"patches": [{"points": [[[0,0,0],[1,0,0]],[[0,-1,0],[1,-1,0]]]}]}')
    on_file = upholster.synthesize(folder / "x.png", folder / "nets.json", **SMALL)
    assert len(on_file.charts) == 1
    upholster.write(folder / "own.uph", "sphere", painted)  # it knows what it was painted from
    assert (folder / "own.uph").read_bytes() == stream
    report = upholster.cover(exemplar, surface, folder / "y.npz", synthesis=SMALL)
    assert list(report.written) == [str(folder / "y.npz")]


@pytest.mark.parametrize("direction", [(0, 0, 1), [0, 0, 1], np.array([0.0, 0, 1]), "0,0,1"])
def test_a_vector_is_a_direction(direction):
    exemplar = np.random.default_rng(1).integers(0, 256, (48, 48), dtype=np.uint8)
    options = upholster.SynthesisOptions(direction=direction)
    assert options == upholster.SynthesisOptions(direction="0,0,1")
    cylinder = upholster.surface_from_spec("cylinder")
    quilt = upholster.synthesize(exemplar, cylinder, texels=5000, sample_size=1.5, block=16, options=options)
    assert quilt.steps > 4000
    assert upholster.SynthesisOptions(direction=45).direction == "45"


def test_no_seed_is_a_fresh_one_that_is_message(made):
    folder, exemplar, surface, _, _, _ = made
    one, other = (upholster.synthesize(exemplar, surface, seed=None, **SMALL) for _ in range(2))
    assert one.seed != other.seed
    again = upholster.synthesize(exemplar, surface, seed=one.seed, **SMALL)
    assert (again.placements == one.placements).all()
    report = upholster.cover(folder / "x.png", "sphere", [folder / "z.npz"], synthesis=SMALL, seed=None)
    reported = report.to_json()["parameters"]["seed"]
    assert report.model.quilt.seed == reported >= 0


@pytest.mark.parametrize("other", ["torus", "sphere:r=2", "sphere:tiling=octants", "plane"])
def test_what_belongs_to_another_surface_is_refused(made, tmp_path, other):
    _, exemplar, _, quilt, texels, _ = made
    with pytest.raises(upholster.InputError, match=r"sphere:r=1\.0"):
        upholster.encode_stream(other, quilt, exemplar)
    for name in ("x.glb", "x.npz", "x.uph"):
        with pytest.raises(upholster.InputError, match=r"sphere:r=1\.0"):
            upholster.write(tmp_path / name, other, texels)
    own = upholster.Texels(texels.charts, texels.arrays)  # made by hand: only the charts tell
    if other != "sphere:r=2":
        with pytest.raises(upholster.InputError, match="do not fit"):
            upholster.write(tmp_path / "x.glb", other, own)
    assert not list(tmp_path.iterdir())


def test_a_decoded_model_fits_its_surface(made, tmp_path):
    _, _, surface, _, _, stream = made
    decoder = upholster.StreamDecoder()
    decoder.feed(stream[: len(stream) // 2])
    upholster.write(tmp_path / "x.npz", surface, decoder.texels())
    with pytest.raises(upholster.InputError, match="other"):
        upholster.write(tmp_path / "x.npz", "torus", decoder.texels())


def test_floats_from_0_to_255_are_refused_and_highlights_are_not():
    rng = np.random.default_rng(1)
    photo = rng.integers(0, 256, (48, 48, 3))
    dark = np.where(rng.random((48, 48, 3)) < 0.9, 0, photo)
    smooth = photo * 0.93
    for wrong in (photo, dark, smooth):
        for dtype in (np.float32, np.float64):
            with pytest.raises(upholster.InputError, match="white at 1"):
                upholster.synthesize(wrong.astype(dtype), "sphere", **SMALL)
    albedo = photo.astype(np.uint8)
    upholster.Material({"albedo": albedo, "emission": 9 * smooth.astype(np.float32)})  # a lamp may be bright
    with pytest.raises(upholster.InputError, match=r"roughness: .*white at 1"):
        upholster.Material({"albedo": albedo, "roughness": smooth[:, :, :1]})
    light = photo / 255.0
    light[10:20, 10:20] = 900.0
    for right in (light, np.zeros((48, 48, 3)), (photo > 99).astype(float)):
        assert upholster.synthesize(right, "sphere", **SMALL).steps == 8 * 32 * 32


def test_every_object_says_what_it_is_on_a_line(made, tmp_path):
    _, exemplar, surface, quilt, texels, stream = made
    decoder = upholster.StreamDecoder()
    decoder.feed(stream)
    material = upholster.Material({"albedo": exemplar})
    report = upholster.cover(exemplar, surface, tmp_path / "x.uph", synthesis=SMALL)
    refined = upholster.refine(tmp_path / "x.uph", tmp_path / "y.npz")
    axis = ",".join(["0.12345678901234567"] * 3)
    long = upholster.SynthesisOptions(direction=f"around:{axis}", density=3, block=99)
    things = [
        surface,
        surface.patches[0],
        quilt,
        texels,
        decoder,
        upholster.StreamDecoder(),
        material,
        report,
    ]
    for thing in (
        *things,
        refined,
        report.model,
        long,
        upholster.WriteOptions(quads=9),
        upholster.SynthesisOptions(),
    ):
        text = repr(thing)
        assert text.startswith(f"{type(thing).__name__}(")
        assert text.endswith(")")
        assert len(text) <= 100
        assert len(text.splitlines()) == 1
    assert repr(upholster.SynthesisOptions(density=3)) == "SynthesisOptions(density=3.0)"


ODD = [
    None, -1, 1.5, float("nan"), "x", "", b"x", [], {"a": 1}, object(), np.array("x"), np.zeros((4, 4, 4)),
    Path("none.png"), Path(), "nul\0", True, range(3), np.array([["a"] * 40] * 40),
]  # fmt: skip


@pytest.mark.slow(reason="calls every function with much that is wrong")
@pytest.mark.parametrize(
    "name",
    [
        "synthesize", "paint", "paint_material", "write", "encode_stream", "read_exemplar", "read_material",
        "surface_from_spec", "cover", "refine", "ring_cyclide", "torus", "sphere", "plane", "revolve",
        "view", "Material", "RationalPatch", "Surface", "SynthesisOptions", "WriteOptions", "Texels", "Quilt",
    ],
)  # fmt: skip
def test_whatever_is_wrong_is_reported_in_one_line(made, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)  # some of what is odd is a good name of a file
    folder, exemplar, surface, quilt, texels, _ = made
    target = tmp_path / "a.npz"
    given = {
        "synthesize": (exemplar, surface), "paint": (quilt, exemplar), "write": (target, surface, texels),
        "paint_material": (quilt, upholster.Material({"albedo": exemplar})),
        "encode_stream": (surface, quilt, exemplar), "read_exemplar": (folder / "x.png",),
        "read_material": ({"albedo": folder / "x.png"},), "surface_from_spec": ("torus",),
        "cover": (folder / "x.png", "plane", [target]), "refine": (folder / "x.uph", [target]),
        "ring_cyclide": (6, 2, 3), "torus": (2, 0.5), "sphere": (1,), "plane": (1, 1),
        "revolve": ([[[1, 0, 1], [1, 1, 1]]],), "Material": ({"albedo": exemplar},),
        "RationalPatch": (surface.patches[0].net,), "Surface": (surface.patches,),
        "Texels": (texels.charts, texels.arrays), "view": (made[-1],),
        "Quilt": (quilt.charts, quilt.exemplar_shape, quilt.placements, quilt.labels),
    }.get(name, ())  # fmt: skip
    call = getattr(upholster, name)
    own = {"synthesize": SMALL, "cover": {"synthesis": SMALL}}.get(name, {})
    named = [p.name for p in inspect.signature(call).parameters.values() if p.kind is p.KEYWORD_ONLY]
    named = [one for one in named if one != "tell"]  # nothing is to be told here
    if name in ("SynthesisOptions", "WriteOptions"):
        named = [p.name for p in inspect.signature(call).parameters.values()]
    refused = 0
    for odd in ODD:
        calls = [((*given[:k], odd, *given[k + 1 :]), own) for k in range(len(given))]
        calls += [(given, own | {keyword: odd}) for keyword in named]
        reported = [_message(call, *each) for each in calls]
        assert all(text is None or 8 < len(text) < 700 for text in reported)
        assert all(text is None or len(text.splitlines()) == 1 for text in reported)
        refused += len([text for text in reported if text is not None])
    assert refused >= len(ODD) // 2


def _message(call, arguments, keywords):
    """What a call says that is refused; whatever else goes wrong fails the test."""
    try:
        call(*arguments, **keywords)
    except (upholster.InputError, upholster.FormatError) as error:
        return str(error)
    return None
