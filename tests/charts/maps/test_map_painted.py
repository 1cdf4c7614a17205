"""Strokes with values: which counts where, and what of a file is refused."""

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from grounds import at_steps, map_values, on_flat, on_mesh, steps_of
from meshes import box, sphere

from upholster.base.errors import InputError
from upholster.charts.maps.map_text import parse_map
from upholster.runtime.stages import Stages


def written(path: Path, strokes: Any) -> str:
    path.write_text(json.dumps(strokes))
    return str(path)


@pytest.mark.parametrize("count", [1, 3, 60])
def test_the_nearest_stroke_that_reaches_counts(tmp_path: Path, count: int) -> None:
    rng, ground = np.random.default_rng(count), on_mesh(sphere(8), 15)
    at = rng.normal(size=(count, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    values, radii = rng.random(count), rng.random(count) * 0.8
    strokes = [
        {"at": a, "value": v, "radius": r}
        for a, v, r in zip(at.tolist(), values.tolist(), radii.tolist(), strict=True)
    ]
    found = map_values(written(tmp_path / "strokes.json", strokes), ground)
    places = at_steps(ground.charted.mesh.corners, ground)
    away = np.linalg.norm(places[:, None] - at, axis=2)
    reached = np.where(away <= radii, away, np.inf)  # within 0.8 nothing faces away on a ball
    wanted = np.where(np.isfinite(reached).any(axis=1), values[reached.argmin(axis=1)], np.nan)
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_the_radius_is_a_length_or_a_part_of_the_size(tmp_path: Path) -> None:
    ground = on_mesh(replace(box((2.0, 2.0, 2.0), 2), metres=0.01))
    stroke = {"at": [1, 1, 2], "value": 0.4}
    plain = map_values(written(tmp_path / "a.json", [stroke]), ground)
    size = ground.charted.mesh.size
    assert np.isfinite(plain).any()
    for radius in (0.05 * size, f"{0.5 * size}mm", None):
        other = map_values(written(tmp_path / "b.json", [stroke | {"radius": radius}]), ground)
        np.testing.assert_array_equal(other, plain)


def test_of_strokes_at_one_place_the_last_counts(tmp_path: Path) -> None:
    strokes = [{"at": [20, -15, 0], "value": v, "radius": 4} for v in (0.25, 0.75)]
    found = parse_map(written(tmp_path / "strokes.json", strokes)).values(on_flat())[0]
    np.testing.assert_array_equal(np.unique(found[np.isfinite(found)]), [0.75])


def test_a_stroke_does_not_reach_the_other_side_of_a_wall(tmp_path: Path) -> None:
    ground = on_mesh(box((2.0, 2.0, 0.05), 2))
    strokes = [{"at": [1, 1, 0.05], "value": 1, "radius": 0.5}]
    found = map_values(written(tmp_path / "strokes.json", strokes), ground)
    triangles = np.concatenate([t for *_, t, _ in steps_of(ground.charted)])
    up = ground.charted.mesh.flat_normals[triangles, 2]
    assert np.isfinite(found[up > 0.5]).any()
    assert np.isnan(found[up < -0.5]).all()


def test_nothing_is_asked_beyond_strokes_inverted_or_compared(tmp_path: Path) -> None:
    name = written(tmp_path / "strokes.json", [{"at": [20, -15, 0], "value": 0.25, "radius": 4}])
    plain = parse_map(name).values(on_flat())[0]
    for text, value in ((f"1-{name}", 0.75), (f"{name}>0.2", 1), (f"{name}<0.2", 0)):
        found = parse_map(text).values(on_flat())[0]
        np.testing.assert_array_equal(found, np.where(np.isnan(plain), np.nan, value))
    with pytest.raises(InputError, match="has no labels"):
        parse_map(name).codes(on_flat())


STROKE = {"at": [20, -15, 0], "value": 0.5}


@pytest.mark.parametrize(
    ("strokes", "said"),
    [
        ({}, "a dict; allowed: a list"),
        ([], "there are 0; allowed: 1 to 10000"),
        ([STROKE, 3], 'stroke 1 is 3; allowed: {"at": [x, y, z], "value": 0 to 1}'),
        ([{"at": [0, 0, 0]}], "stroke 0 is {'at': [0, 0, 0]}; allowed"),
        ([STROKE | {"colour": 3}], "allowed: {"),
        ([STROKE | {"at": [0, 0]}], "is at [0, 0]; allowed: three finite numbers"),
        ([STROKE | {"at": [0, 0, True]}], "three finite numbers"),
        ([STROKE | {"at": [0, 0, float("nan")]}], "NaN is no number"),
        ([STROKE | {"value": 1.5}], "has the value 1.5; allowed: 0 to 1"),
        ([STROKE | {"value": "dark"}], "has the value dark; allowed: 0 to 1"),
        ([STROKE | {"radius": 0}], "has the radius 0; allowed: a length above 0"),
        ([STROKE | {"radius": "wide"}], "radius is 'wide'"),
        ([STROKE | {"radius": [1]}], "radius is [1]"),
        ([STROKE | {"radius": "3cm"}], "this model does not state the length of its unit"),
        ([STROKE | {"at": [0, 0, 500]}], "lies 500 from the surface; allowed: at most 5"),
    ],
)
def test_what_is_no_stroke_is_refused_in_one_line(tmp_path: Path, strokes: Any, said: str) -> None:
    name = written(tmp_path / "strokes.json", strokes)
    with pytest.raises(InputError) as caught:
        parse_map(name).values(on_flat())
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_missing_or_no_json_are_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"file '.*none\.json' does not exist"):
        parse_map(str(tmp_path / "none.json")).values(on_flat())
    (tmp_path / "no.json").write_text("no JSON")
    with pytest.raises(InputError, match="it is not JSON"):
        parse_map(str(tmp_path / "no.json")).values(on_flat())


def test_a_file_that_has_changed_is_read_again(tmp_path: Path) -> None:
    ground, path = on_flat(), tmp_path / "strokes.json"
    with Stages().active():
        for n, value in enumerate((0.25, 0.75)):
            wanted = parse_map(written(path, [STROKE | {"value": value}]))
            os.utime(path, (n, n))
            assert np.nanmax(wanted.values(ground)[0]) == value
