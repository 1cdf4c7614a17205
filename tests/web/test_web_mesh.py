"""Meshes made in the browser lie on Python's surfaces, with its normals, tangents and seams."""

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from decoders import HERE, ROOT, run
from streams import anything, noise

from upholster.charts.chart_seams import find_seams
from upholster.charts.layout import density_layout, uniform_layout
from upholster.charts.tessellation.mesh import Mesh, face_parameters
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.model.tangents import vertex_tangents
from upholster.quilt.chart import Chart

SPECS = (
    "cyclide",
    "cyclide:a=5,c=1.5,mu=4.2,spans=6x8",
    "cyclide:a=6,c=2,mu=6",
    "torus:R=3,r=1.25,spans=10x4",
    "sphere",
    "sphere:r=0.37",
    "sphere:tiling=octants,r=5",
    "plane:width=3,height=0.7,spans=2x3",
    "ellipsoid",
    "ellipsoid:rx=0.4,ry=2,rz=7",
    "cylinder:r=0.3,h=9,spans=3",
    "cone",
    "cone:r1=2,r2=0,h=1,spans=5",
    "vase",
    "vase:radius=0.1,height=3,spans=7",
)


def _whole(surface: Any) -> Any:
    return uniform_layout(surface, chart=8)


def _quadrants(surface: Any) -> Any:
    """Charts of many sizes: each patch whole, or in two or three."""
    parts = (
        [(0, 1, 0, 1)],
        [(0, 0.5, 0, 1), (0.5, 1, 0, 1)],
        [(0, 1, 0, 0.25), (0, 0.75, 0.25, 1), (0.75, 1, 0.25, 1)],
    )
    places = [surface.place(n) for n in range(len(surface.patches))]
    return tuple(
        Chart(face, 8, 8, row + s0, row + s1, column + t0, column + t1)
        for n, (face, row, column) in enumerate(places)
        for s0, s1, t0, t1 in parts[n * n % 3]
    )


def _wide(surface: Any) -> Any:
    """A chart on each face; one that closes to a ring meets itself."""
    return tuple(
        Chart(n, 8 * face.rows, 6 * face.columns, 0, face.rows, 0, face.columns)
        for n, face in enumerate(surface.faces)
    )


def _across(surface: Any) -> Any:
    """Charts that begin and end inside patches, next to ones that do not begin there."""
    charts = []
    for n, face in enumerate(surface.faces):
        s, t = face.rows / 2 + 0.25, face.columns / 2 - 0.125
        charts += [
            Chart(n, 11, 9, 0, s, 0, t),
            Chart(n, 9, 11, s, face.rows, 0, t),
            Chart(n, 30, 20, 0, face.rows, t, face.columns),
        ]
    return tuple(charts)


def _roof() -> Any:
    """A face with creases between its rows, whose last patch is longer than the others."""
    profile = [(0, 0), (1, 1), (2, 0), (5, 0)]
    rows = [
        [RationalPatch.from_points([[(y, -x, z) for y in (k, k + 1)] for x, z in ends]) for k in range(2)]
        for ends in pairwise(profile)
    ]
    return Surface([Face(rows)], "roof")


def _rectangle(x: float, y: float, width: float, height: float) -> Any:
    corners = [[(x, y, 0), (x + width, y, 0)], [(x, y - height, 0), (x + width, y - height, 0)]]
    return RationalPatch.from_points(corners)


def _split() -> Any:
    """Surfaces whose edges meet in parts: a ring of which some patches are cut, and a sheet with a border."""
    ring = surface_from_spec("torus").patches
    cut = [*ring[0].split(s=0.5), *ring[5].split(t=0.3), *ring[6].part(0, 1, 0, 0.5).split(s=0.625)]
    yield Surface([*ring[1:5], *cut, ring[6].part(0, 1, 0.5, 1), *ring[7:]], "cut", 1e-8)
    places = ((0, 0, 1, 1), (1, 0.25, 1, 1), (1, -0.75, 1, 1), (-0.5, 0, 0.5, 1))
    yield Surface([_rectangle(*place) for place in places], "sheet")


def _jobs() -> Any:
    for spec in SPECS:
        surface = surface_from_spec(spec)
        yield surface, _whole(surface)
    for spec in ("vase", "cone", "cone:r2=0", "cyclide", "sphere:tiling=octants"):
        surface = surface_from_spec(spec)
        yield surface, density_layout(surface, texels=60_000)
        yield surface, _quadrants(surface)
    for surface in _split():
        yield surface, _whole(surface)
        yield surface, _quadrants(surface)
    for spec in (*SPECS[:2], "sphere", "plane:spans=3x4", "cone:r2=0"):
        surface = surface_from_spec(spec)
        yield surface, _wide(surface)
        yield surface, _across(surface)
    yield _roof(), _wide(_roof())
    yield _roof(), _across(_roof())
    bent = surface_from_spec("sphere").patches
    yield (
        Surface([bent[0].elevate(6, 5), *(patch.transpose().reverse(0) for patch in bent[1:])], "raised"),
        _whole(surface_from_spec("sphere")),
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory: Any) -> Any:
    """What the browser makes of all jobs: (surface, charts, found)."""
    folder = tmp_path_factory.mktemp("mesh")
    rng = np.random.default_rng(4)
    jobs, files = list(_jobs()), []
    for n, (surface, charts) in enumerate(jobs):
        path = folder / f"{n}.uph"
        path.write_bytes(encode_stream(surface, anything(rng, (32, 40), charts, 1), noise()))
        files.append({"path": str(path), "counts": (2 ** rng.integers(0, 5, 2 * len(charts))).tolist()})
    (folder / "jobs.json").write_text(json.dumps(files))
    found = json.loads(run(HERE / "mesh.mjs", folder / "jobs.json"))
    return [(*job, files[n]["counts"], found[n]) for n, job in enumerate(jobs)]


@pytest.mark.slow(reason="runs Node on many streams")
def test_control_nets_are_pythons(made: Any) -> None:
    for surface, _, _, found in made:
        assert len(found["nets"]) == len(surface.patches)
        for patch, net in zip(surface.patches, found["nets"], strict=True):
            assert (net["m"], net["n"]) == patch.degree
            mine = np.reshape(net["net"], patch.net.shape)
            np.testing.assert_allclose(mine, patch.net, rtol=1e-12, atol=1e-12 * np.abs(patch.net).max())


def test_seams_are_pythons(made: Any) -> None:
    partial = 0
    for surface, charts, _, found in made:
        seams = find_seams(surface, charts)
        for n in range(len(charts)):
            for edge in range(4):
                wanted = [m for m in seams if (m.chart, m.edge) == (n, edge)]
                got = found["seams"][n][edge]
                assert [(m["chart"], m["edge"]) for m in got] == [
                    (m.other_chart, m.other_edge) for m in wanted
                ]
                ends = [[m[name] for name in ("start", "stop", "otherStart", "otherStop")] for m in got]
                here = [_shares(charts, m) for m in wanted]
                np.testing.assert_allclose(np.reshape(ends, -1), np.reshape(here, -1), atol=1e-7)
                partial += sum({*shares} != {0, 1} for shares in here)
    assert partial > 150


def test_vertices_normals_and_tangents_are_pythons(made: Any) -> None:
    for surface, charts, counts, found in made:
        for n, mesh in enumerate(found["meshes"]):
            chart, face = charts[n], surface.faces[charts[n].face]
            places = np.reshape(mesh["parameters"], (-1, 2)) * (chart.height, chart.width)
            s, t = face_parameters(chart, *places.T)
            positions, normals = face.frames(s, t)
            np.testing.assert_allclose(
                np.reshape(mesh["positions"], (-1, 3)), positions, atol=1e-6 * surface.size
            )
            np.testing.assert_allclose(np.reshape(mesh["normals"], (-1, 3)), normals, atol=1e-6)
            owner, none = np.full(len(s), n, np.int32), np.empty((0, 4), np.int32)
            python = Mesh(positions, normals, places, owner, none, none[:, :3])
            tangents = np.reshape(mesh["tangents"], (-1, 4))
            wanted = vertex_tangents(surface, charts, python)
            np.testing.assert_allclose(tangents[:, :3], wanted, atol=2e-6)
            # glTF's bitangent is up in the texture: rows run down
            up = np.cross(normals, tangents[:, :3]) * tangents[:, 3:]
            assert (np.einsum("ij,ij->i", up, face.derivatives(s, t)[1]) <= 1e-9 * surface.size).all()
            rows, columns = np.maximum(counts[2 * n : 2 * n + 2], 2)
            assert len(np.unique(s)) >= rows + 1
            assert len(np.unique(t)) >= columns + 1
            for values, low, high, lines in (
                (s, chart.s0, chart.s1, face.breaks[0]),
                (t, chart.t0, chart.t1, face.breaks[1]),
            ):
                for line in lines:
                    assert not low < line < high or np.abs(values - line).min() < 1e-6


def test_bounds_hold_and_are_close(made: Any) -> None:
    fine = np.linspace(0, 1, 97)
    for surface, charts, _, found in made:
        for chart, bounds in zip(charts, found["bounds"], strict=True):
            face = surface.faces[chart.face]
            if any(face.breaks):
                continue
            s, t = face_parameters(chart, fine * chart.height, fine * chart.width)
            points = face.points_grid(s, t)
            reach = np.linalg.norm(points - bounds["center"], axis=2).max()
            assert reach <= bounds["radius"] * (1 + 1e-9) <= 1.5 * reach + 1e-9
            for name, lines in (("bendS", points), ("bendT", points.swapaxes(0, 1))):
                for segments in (1, 2, 4, 8, 16, 48):
                    step = 96 // segments
                    ends = lines[::step]
                    error = np.linalg.norm(
                        (ends[1:] + ends[:-1]) / 2 - lines[step // 2 :: step], axis=2
                    ).max()
                    estimate = bounds[name] / (8 * segments**2)
                    assert error <= 1.5 * estimate + 1e-12 * surface.size
                assert estimate <= 2 * error + 1e-9 * surface.size


@pytest.mark.slow(reason="runs Node on many meshes")
def test_it_keeps_its_promises_under_node() -> None:
    run("--test", HERE / "mesh.test.mjs")


def test_the_glb_writer_keeps_its_promises() -> None:
    run("--test", HERE / "glb.test.mjs")


def test_it_runs_under_a_strict_policy() -> None:
    web = ROOT / "web"
    for path in (web / "uph-mesh.js", *(web / "mesh").rglob("*.js")):
        source = path.read_bytes()
        for word in (b"eval(", b"new Function", b"WebAssembly", b"import("):
            assert word not in source


def _shares(charts: Any, m: Any) -> tuple[float, ...]:
    """Where a seam lies along its two edges, 0 to 1."""
    own, other = (
        charts[n].height if edge & 1 else charts[n].width
        for n, edge in ((m.chart, m.edge), (m.other_chart, m.other_edge))
    )
    return m.start / own, m.stop / own, m.other_start / other, m.other_stop / other
