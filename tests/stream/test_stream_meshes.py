"""Meshes in streams: what is written is read, whatever the mesh is; it takes few bytes; damage is refused."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_quilts import charts_of, cube, grid, icosphere, in_steps, sheets, soup
from streams import noise, same
from tests.charts.meshes import on_charts

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.description import describe
from upholster.codec.stream.mesh.mesh_code import MeshPrecision, pack_mesh, parse_mesh
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh

SURFACES = {
    "cube": cube(),
    "cube of 16 cells a side": cube(16),
    "half a cube": cube(3, sides=3),
    "sphere of two islands": icosphere(3),
    "sphere of an island each": icosphere(1, each=True),
    "sheet": grid(6, 9),
    "sheet with holes": grid(8, 9, holes=((0, 0), (3, 4), (4, 5), (6, 2), (6, 3))),
    "ring": grid(4, 12, (False, True)),
    "torus": grid(11, 24, (True, True)),
    "torus with holes": grid(11, 24, (True, True), holes=((2, 2), (5, 9), (5, 10), (8, 20))),
    "triangle": MeshSurface(
        TriangleMesh(np.eye(3), np.array([[0, 1, 2]])), np.zeros(1, int), np.zeros((1, 3, 2))
    ),
    "one point": MeshSurface(
        TriangleMesh(np.zeros((1, 3)), np.array([[0, 0, 0]])), np.zeros(1, int), np.zeros((1, 3, 2))
    ),
}


@pytest.mark.parametrize("name", SURFACES)
def test_a_mesh_is_read_as_it_was_written(name):
    surface = SURFACES[name]
    precision = MeshPrecision(12, 1 / 128)
    back = parse_mesh(ByteReader(pack_mesh(surface, precision)))
    check_same(surface, back, precision)


@pytest.mark.parametrize("seed", range(12))
def test_any_triangles_are_read_as_they_were_written(seed):
    surface = soup(seed, vertices=3 + 4 * seed, triangles=5 + 30 * seed)
    precision = MeshPrecision(1 + seed, 1 / 8)
    check_same(surface, parse_mesh(ByteReader(pack_mesh(surface, precision))), precision)


def seams(surface):
    return int(on_charts(surface, 100 / (surface.size or 1.0)).is_seam.sum())


def check_same(surface, back, precision):
    low, high = surface.mesh.box
    step = float((high - low).max()) / (2**precision.bits - 1) or 1.0
    assert (in_steps(surface, step, precision.step) == in_steps(back, step, precision.step)).all()
    assert back.mesh.parts == surface.mesh.parts
    assert back.name == surface.name
    assert back.mesh.metres == surface.mesh.metres
    assert len(back.mesh.positions) == len(np.unique(surface.mesh.triangles))
    if surface.name != "soup":
        assert seams(back) == seams(surface)
        assert (back.mesh.neighbours >= 0).sum() == (surface.mesh.neighbours >= 0).sum()


def test_reading_and_writing_again_gives_the_same_mesh():
    surface = SURFACES["torus with holes"]
    precision = MeshPrecision(12, 1 / 128)
    once = parse_mesh(ByteReader(pack_mesh(surface, precision)))
    twice = parse_mesh(ByteReader(pack_mesh(once, precision)))
    assert np.sort(once.mesh.areas) == pytest.approx(np.sort(twice.mesh.areas))
    assert np.array_equal(once.boxes, twice.boxes)


def test_a_regular_mesh_takes_less_than_two_bytes_a_triangle():
    surface = grid(60, 60)
    size = len(pack_mesh(surface, MeshPrecision(12, 1 / 1000)))
    assert size < 1.0 * len(surface.island)


def test_a_stream_of_a_mesh_holds_surface_charts_and_quilt():
    surface, exemplar = icosphere(2), noise(48, 56)
    charts = charts_of(surface)
    quilt = sheets(np.random.default_rng(1), charts, (48, 56), 40).on(surface)
    data = encode_stream(surface, quilt, exemplar, sample_quality="lossless")
    decoder = read_stream(data)
    assert isinstance(decoder.surface, MeshSurface)
    assert decoder.charts == charts
    assert same(decoder.quilt(), quilt)
    decoder.quilt().check_surface(surface)
    assert any("triangles" in row.holds for row in describe(data).chunks)


def test_a_first_view_of_a_mesh_needs_surface_and_layout_only():
    surface, exemplar = cube(4), noise(48, 56)
    quilt = sheets(np.random.default_rng(1), charts_of(surface), (48, 56), 10)
    data = encode_stream(surface, quilt, exemplar)
    decoder = StreamDecoder()
    while decoder.needed:
        decoder.feed(data[decoder.received : decoder.received + decoder.needed])
    assert decoder.received < len(data) / 2
    assert not decoder.plan_known
    assert decoder.texels().count == quilt.steps


def test_even_charts_of_a_mesh_take_few_bytes():
    surface = icosphere(1, each=True)
    charts = charts_of(surface)
    even = encode_stream(surface, empty(charts), noise(48, 56))
    uneven = encode_stream(
        surface, empty([replace(charts[0], s1=charts[0].s1 * 1.01), *charts[1:]]), noise(48, 56)
    )
    assert read_stream(even).charts == charts
    assert len(uneven) - len(even) > 20 * len(charts)


def empty(charts):
    return sheets(np.random.default_rng(1), charts, (48, 56), 1)


def test_a_mesh_that_is_too_fine_for_its_numbers_is_refused():
    with pytest.raises(InputError, match="parameters have more than"):
        pack_mesh(cube(), MeshPrecision(12, 1e-12))


def test_charts_that_name_an_island_that_is_not_there_are_refused():
    surface = cube()
    charts = (*charts_of(surface)[:5], replace(charts_of(surface)[5], face=6))
    with pytest.raises(InputError, match="other islands"):
        encode_stream(surface, sheets(np.random.default_rng(0), charts, (48, 56), 4), noise(48, 56))


@pytest.mark.parametrize("seed", range(150))
def test_damaged_meshes_are_refused_or_read(seed):
    rng = np.random.default_rng(seed)
    surface = soup(seed % 5) if seed % 2 else icosphere(1)
    data = bytearray(pack_mesh(surface, MeshPrecision(10, 1 / 8)))
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(0, len(data)))
        data[place] = int(rng.integers(0, 256))
    cut = len(data) if rng.random() < 0.7 else int(rng.integers(0, len(data)))
    try:
        read = parse_mesh(ByteReader(bytes(data[:cut])))
    except (FormatError, InputError):
        return
    assert len(read.mesh.triangles)
