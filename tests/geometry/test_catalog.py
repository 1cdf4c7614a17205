"""Surfaces by name."""

import inspect
import re
from pathlib import Path

import pytest
from benchmarks.nets import write_nets

from upholster.base.errors import InputError
from upholster.geometry.built_in.catalog import SURFACES, surface_from_spec
from upholster.geometry.built_in.plane import plane


@pytest.mark.parametrize("name", SURFACES)
def test_the_catalogue_says_what_the_builders_do(name: str) -> None:
    kind = SURFACES[name]
    assert kind.name == name
    surface = surface_from_spec(name)
    assert surface.name == name
    assert len(surface.patches) == kind.patches
    defaults = {p.name: p.default for p in inspect.signature(kind.build).parameters.values()}
    assert {p.name: p.default for p in kind.parameters} == defaults
    written = ",".join(f"{p.name}={p.written}" for p in kind.parameters)
    again = surface_from_spec(f"{name}:{written}")
    assert all((a.net == b.net).all() for a, b in zip(surface.patches, again.patches, strict=True))
    assert all(p.allowed and p.meaning for p in kind.parameters)


def test_parameters_reach_the_builder() -> None:
    assert len(surface_from_spec("cyclide:a=6,c=2,mu=3,spans=6x4").patches) == 24
    assert len(surface_from_spec("torus: R=3, r=1").patches) == 16
    assert surface_from_spec("sphere:r=2,tiling=octants").patches[0].points([1.0], [0.0])[0, 0] == 2
    assert surface_from_spec("plane:width=3,height=4").size == pytest.approx(5)
    assert surface_from_spec("cone:r2=0").degenerate
    assert len(surface_from_spec("vase:spans=6").patches) == 60


def test_bi_quadratic_patches_are_taken_where_the_choice_is_open() -> None:
    for name, kind in SURFACES.items():
        if name == "vase":  # its profile is cubic
            continue
        patches = surface_from_spec(name, biquadratic=True).patches
        assert all(max(patch.degree) <= 2 for patch in patches), name
        assert len(patches) == (8 if name == "sphere" else kind.patches)
    assert len(surface_from_spec("sphere:r=2", biquadratic=True).patches) == 8
    assert len(surface_from_spec("sphere:tiling=six", biquadratic=True).patches) == 6


def test_files_by_name(tmp_path: Path) -> None:
    path = tmp_path / "my: net, a=b.json"
    write_nets(path, plane())
    assert len(surface_from_spec(str(path)).patches) == 1


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("cyclid", "unknown surface 'cyclid'; did you mean 'cyclide'?"),
        ("", "unknown surface ''"),
        ("torus:r1=2", "torus: unknown parameter 'r1'; did you mean 'r'?"),
        ("cyclide:b=3", "unknown parameter 'b'; known: a, c, mu, spans"),
        ("cyclide:a", "'a' is no parameter=value"),
        ("cyclide:", "'' is no parameter=value"),
        ("cyclide:a=6,a=6", "a is given twice"),
        ("cyclide:a=six", "cyclide: a is 'six'"),
        ("cyclide:mu=nan", "cyclide: mu is nan"),
        ("cyclide:c=7", "cyclide: c is 7; allowed: 0 <= c < a = 6"),
        ("cyclide:spans=4", "spans is '4'"),
        ("cyclide:spans=4x5", "spans round the tube is 5"),
        ("cyclide:spans=4x99999999999", "spans is '4x99999999999'"),
        ("cylinder:spans=4x4", "spans is '4x4'"),
        ("sphere:tiling=seven", "tiling is 'seven'; known: six, octants"),
        ("model.obj", "unknown suffix"),
        ("folder/model", "unknown suffix"),
        ("none.bpt", "does not exist"),
    ],
)
def test_bad_specs_are_named(spec: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        surface_from_spec(spec)
    assert "\n" not in str(caught.value)
