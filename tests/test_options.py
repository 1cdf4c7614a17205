"""Options: each told once, checked in one place, and spelled out by the commands."""

import inspect
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import upholster
from upholster.apps.cli.cover import cover
from upholster.apps.cli.stream import refine
from upholster.base.errors import InputError
from upholster.base.options.choices import chosen, method_options
from upholster.base.options.direction_words import (
    AXIS_DIRECTIONS,
    DIRECTIONS,
    FIELD_DIRECTIONS,
    PATCH_DIRECTIONS,
)
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.option_fields import repeats
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.direction_request import BY_WORD
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.paper.method import PaperOptions
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.setup import prepare

KINDS = (SynthesisOptions, WriteOptions)
EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_is_reported_and_stands_in_the_docstring(kind):
    for entry in fields(kind):
        assert entry.metadata["help"].endswith("."), entry.name
        assert f"\n{entry.name}\n    {entry.metadata['help']}" in kind.__doc__


def options_of(command):
    parameters = inspect.signature(command).parameters
    return {name: get_args(p.annotation)[1] for name, p in parameters.items() if get_args(p.annotation)}


@pytest.mark.parametrize(("command", "panels"), [(cover, None), (refine, {"Output"})])
def test_commands_spell_out_the_fields(command, panels):
    options = options_of(command)
    for kind in KINDS if panels is None else (WriteOptions,):
        for entry in fields(kind):
            if panels is not None and entry.metadata["panel"] not in panels:
                assert entry.name not in options
                continue
            option = options[entry.name]
            assert option.help == entry.metadata["help"]
            assert option.rich_help_panel == entry.metadata["panel"]
    for name, option in options.items():
        assert option.help, name
    names = [text for option in options.values() for text in option.param_decls or ()]
    assert len(names) == len(set(names))


def test_defaults_of_commands_are_those_of_the_fields():
    parameters = inspect.signature(cover).parameters
    texts = {"size": "1024x768", "view": "30,30", "triangles": "500000", "sample_quality": "46"}
    for kind in KINDS:
        for entry in fields(kind):
            assert parameters[entry.name].default == texts.get(entry.name, entry.default)


def run(command, monkeypatch, target, *arguments):
    """Run a command with its work replaced; return the options that the work is given, and its request."""
    from upholster.apps.cli import app

    class StoppedError(Exception):
        pass

    given = {}

    def work(request, *_, **keywords):
        given.update(keywords, request=request)
        raise StoppedError

    monkeypatch.setattr(target, work)
    with pytest.raises(StoppedError):
        app([command, *arguments], standalone_mode=False)
    return given


def test_what_is_written_arrives_as_options(monkeypatch):
    given = run(
        "cover", monkeypatch, "upholster.apps.project.project.carry_out", "a.png", "--on", "plane", "-o",
        "b.uph",
        "--texels", "512x400", "--tileable", "--variety", "1.5", "--shortlist", "8", "--size", "20x30",
        "--view", "10,-5.5", "--wavelet", "haar", "--sample-quality", "lossless", "--bytes", "8k",
        "--texture", "webp",
    )  # fmt: skip
    request = given["request"]
    assert request.synthesis == SynthesisOptions(texels=(512, 400), tileable=True, variety=1.5, shortlist=8)
    assert request.writing == WriteOptions(
        texture="webp",
        size=(20, 30),
        view=(10.0, -5.5),
        wavelet="haar",
        sample_quality="lossless",
        stream_bytes=8000,
    )
    assert request.writing.stream_choices == ["wavelet", "sample_quality", "bytes"]
    paper = run(
        "cover", monkeypatch, "upholster.apps.project.project.carry_out", "a.png", "--on", "plane", "-o",
        "b.png",
        "--method", "paper", "--no-seams", "--chart", "64",
    )  # fmt: skip
    assert paper["request"].synthesis == SynthesisOptions(method="paper", seams=False, chart=64)
    assert paper["request"].writing == WriteOptions(wavelet="haar")  # the paper's
    given = run(
        "refine", monkeypatch, "upholster.pipeline.refine", "a.uph", "-o", "b.glb", "--normal-scale", "2",
        "--bytes", "1000",
    )  # fmt: skip
    assert given["options"] == WriteOptions(normal_scale=2.0)


@pytest.mark.parametrize(
    ("name", "texts"),
    [
        ("stroke", ("0,0,0:1,0,0", "1,0,0:1,0,0")),
        ("guide", ("luminance=height", "height=slope@2")),
        ("labels", ("a.png=b.png", "c.png=d.png")),
        ("zone", ("a.png=height", "b.png@3cm=slope")),
        ("again", ("0,0,1:0.3", "part:Seat@2")),
        ("put", ("a.png=0,0,0", "b.png=1,0,0@90")),
        ("part", ("Seat", "Leg*")),
    ],
)
def test_options_of_several_texts_are_repeated_and_take_one_alone(name, texts, monkeypatch):
    kind, of = (ModelOptions, "reading") if name == "part" else (SynthesisOptions, "synthesis")
    assert {entry.name for entry in fields(kind) if repeats(entry)} >= {name}
    assert getattr(kind(**{name: texts[0]}), name) == texts[:1]
    assert getattr(kind(**{name: list(texts)}), name) == texts
    words = [word for text in texts for word in (f"--{name}", text)]
    target = "upholster.apps.project.project.carry_out"
    request = run("cover", monkeypatch, target, "a.png", "--on", "a.glb", "-o", "b.glb", *words)["request"]
    assert getattr(getattr(request, of), name) == texts


def test_a_default_that_is_written_is_refused_by_the_other_method(monkeypatch):
    from upholster.apps.cli import app

    with pytest.raises(InputError, match="levels belongs to method 'paper' and 'pixel'"):
        app(["cover", "a.png", "--on", "plane", "-o", "b.png", "--levels", "3"], standalone_mode=False)


@pytest.mark.parametrize(
    ("choices", "reported"),
    [
        ({"methd": "paper"}, r"unknown option 'methd'; did you mean 'method'\?"),
        ({"method": "papr"}, r"unknown method 'papr'; did you mean 'paper'\?"),
        (
            {"chart": 512},
            "chart belongs to method 'paper' and 'pixel'; allowed with 'quilt': texels, density",
        ),
        ({"chart": 64}, "chart belongs to method 'paper' and 'pixel'"),
        ({"search": "full"}, "search belongs to method 'pixel'; allowed with 'quilt': texels"),
        ({"method": "paper", "search": "coherent"}, "search belongs to method 'pixel'"),
        ({"method": "pixel", "search": "ful"}, r"unknown search 'ful'; did you mean 'full'\?"),
        (
            {"method": "pixel", "block": 32},
            "block belongs to method 'quilt' and 'paper'; allowed with 'pixel': chart, levels, search",
        ),
        ({"method": "pixel", "seams": False}, "seams belongs to method 'paper'"),
        ({"method": "pixel", "texels": 5000}, "texels belongs to method 'quilt'"),
        ({"method": "pixel", "levels": 0}, "levels is 0; allowed: 1 to 6"),
        (
            {"method": "paper", "variety": 1.2},
            "variety belongs to method 'quilt'; allowed with 'paper': block",
        ),
        ({"method": "paper", "shortlist": 9}, "shortlist belongs to method 'quilt'"),
        ({"method": "pixel", "mirror": True}, "mirror belongs to method 'quilt'"),
        ({"rotate": 90}, "rotate is 90; allowed: True or False"),
        ({"variety": -0.1}, "variety is -0.1; allowed: 0 to 10"),
        ({"shortlist": 0}, "shortlist is 0; allowed: 1 to 4096"),
        ({"block": 7}, "block is 7; allowed: 8 to 512"),
        ({"block": 20, "overlap": 11}, "overlap is 11; allowed: 4 to half a block"),
        ({"method": "paper", "levels": 7}, "levels is 7; allowed: 1 to 6"),
        ({"method": "paper", "block": 20}, "block is 20; allowed: multiples of 2"),
        ({"method": "paper", "block": 32, "overlap": 4}, "overlap is 4; allowed: multiples of 2"),
        ({"edge_block": 32}, "edge_block belongs to method 'paper'"),
        ({"method": "paper", "edge_block": 20}, "edge_block is 20; allowed: multiples of 2"),
        ({"method": "paper", "edge_block": 264}, "edge_block is 264; .* from 16 to 256"),
        ({"method": "paper", "edge_block": 32, "seams": False}, "edge_block is 32 without seams"),
        ({"tileable": True}, "tileable needs texels"),
        ({"texels": 1000, "density": 2.0}, "density and texels are both given"),
        ({"texels": (64, 64), "direction": "u"}, "direction is given with texels 64x64"),
    ],
)
def test_bad_choices_are_refused_in_one_line(choices, reported):
    with pytest.raises(InputError, match=reported) as raised:
        chosen(SynthesisOptions, **choices)
    assert "\n" not in str(raised.value)


def test_choices_come_before_options_and_none_chooses_nothing():
    base = SynthesisOptions(variety=1.5, block=24)
    assert chosen(SynthesisOptions, base, phase=0.5, block=None) == replace(base, phase=0.5)
    assert chosen(SynthesisOptions, {"variety": 1.5}, block=24) == base
    assert chosen(SynthesisOptions) == SynthesisOptions()
    assert chosen(WriteOptions, quads=7) == WriteOptions(quads=7)


def test_methods_get_all_options_settled():
    options = SynthesisOptions(method="paper", levels=2, seams=False)
    own = method_options(options, PaperOptions)
    assert (own.block, own.overlap, own.levels, own.seams) == (32, 8, 2, False)
    with pytest.raises(InputError, match="block is 32; allowed: multiples of 2"):
        method_options(SynthesisOptions(method="paper", levels=5), PaperOptions)
    with pytest.raises(InputError, match=r"edge_block is 16; allowed: more than two overlaps \(16\)"):
        method_options(SynthesisOptions(method="paper", edge_block=16), PaperOptions)
    exemplar = np.random.default_rng(1).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    options = SynthesisOptions(texels=(64, 48), tileable=True, variety=1.5)
    prepared = prepare(Exemplar(exemplar), plane(), options)
    assert isinstance(prepared.options, QuiltOptions)
    assert prepared.options.tileable
    assert prepared.options.variety == 1.5
    assert 8 <= prepared.options.block <= 48


def test_synthesize_takes_options_and_choices_alike():
    exemplar = np.random.default_rng(1).integers(0, 256, (48, 48, 3), dtype=np.uint8)
    options = SynthesisOptions(method="paper", chart=40)
    one = upholster.synthesize(exemplar, sphere(), options=options, seed=2)
    two = upholster.synthesize(exemplar, sphere(), method="paper", chart=40, seed=2)
    assert (one.placements == two.placements).all()
    with pytest.raises(InputError, match=r"unknown option 'texel'; did you mean 'texels'\?"):
        upholster.synthesize(exemplar, sphere(), texel=4)


def test_options_are_known_without_numpy():
    code = "import sys, upholster.base.options; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_every_word_for_a_direction_is_listed_and_does_something() -> None:
    """In the help, and in the studio, whose list is that of the rows."""
    (entry,) = (entry for entry in fields(SynthesisOptions) if entry.name == "direction")
    words = entry.metadata["metavar"].partition("]")[2].split("|")
    assert set(words) >= {*FIELD_DIRECTIONS, *PATCH_DIRECTIONS, *AXIS_DIRECTIONS}
    assert set(BY_WORD) == set(FIELD_DIRECTIONS)
    assert all(row.label for row in DIRECTIONS)
    for word in (*FIELD_DIRECTIONS, *PATCH_DIRECTIONS):
        assert parse_direction(word, patches=True).kind == word


def test_photos_and_materials_are_read_with_the_options_of_samples() -> None:
    file = EXAMPLES / "bricks.png"
    assert upholster.read_exemplar(file, crop=(0, 0, 40, 50)).shape[:2] == (50, 40)
    assert upholster.read_material({"albedo": file}, crop=(0, 0, 40, 50)).maps["albedo"].shape[:2] == (50, 40)
    with pytest.raises(InputError, match="unknown option 'crops' of an image; did you mean 'crop'"):
        upholster.read_exemplar(file, crops=(0, 0, 40, 50))
    with pytest.raises(InputError, match=r"unknown option .use. of an image; .*rectify"):
        upholster.read_exemplar(file, use="mask.png")


def test_the_files_of_a_samples_options_are_renamed_together() -> None:
    options = SampleOptions(use="m.png", maps={"ao": "a.png"}, crop=(0, 0, 40, 50))
    assert options.renamed(str.upper) == replace(options, use="M.PNG", maps={"ao": "A.PNG"})
    assert SampleOptions(use="alpha").renamed(str.upper).use == "alpha"
