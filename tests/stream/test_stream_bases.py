"""Bases: what shows before a large surface has arrived."""

import io
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
import pytest
from mesh_quilts import charts_of, icosphere, sheets
from streams import laid, noise

from upholster.apps.server.thumbnail_picture import draw_thumbnail
from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.codec.stream.base_chunk import parse_base
from upholster.codec.stream.base_maker import made_base
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.chunks import assembled, pack_chunk
from upholster.codec.stream.description import describe
from upholster.codec.stream.prefix import Limit
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.codec.stream.surface_swap import on_surface
from upholster.codec.stream.writer import FIRST_PART, FIRST_VIEW, encode_stream
from upholster.geometry.meshes.simplification import simplified
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.geometry.patches.surface import Surface
from upholster.output.levels import levels_picture, refine_steps
from upholster.quilt.model import Quilt


@cache
def sphere() -> tuple[MeshSurface, Quilt, Any]:
    """A sphere of 5,120 triangles, a quilt on it, and its exemplar."""
    surface = icosphere(4)
    quilt = sheets(np.random.default_rng(7), charts_of(surface), (64, 72), 60)
    return surface, quilt, noise(64, 72)


@cache
def sphere_stream() -> bytes:
    return encode_stream(*sphere())


def at(data: bytes, length: int) -> StreamDecoder:
    decoder = StreamDecoder()
    decoder.feed(data[:length])
    return decoder


def end_of(data: bytes, tag: str) -> int:
    return next(chunk.end for chunk in read_stream(data).chunks if chunk.tag == tag)


def test_the_base_shows_until_a_sixteenth_of_the_placements_is_known() -> None:
    data = sphere_stream()
    first = next(chunk for chunk in read_stream(data).chunks if chunk.tag == "P")
    last, seen = 0, set()
    for length in np.linspace(end_of(data, "X"), first.end, 50).astype(int).tolist():
        decoder = at(data, length)
        count, every = decoder.placements_known
        assert decoder.is_base == (not every or count < every / 16)
        seen.add((decoder.is_base, count > 0))
        assert decoder.charts_known <= len(decoder.charts)
        assert decoder.quilt().surface is decoder.surface
        known = decoder.coefficients_known[0]
        assert known >= last
        last = known
    assert {(True, False), (False, True)} <= seen
    assert at(data, end_of(data, "X")).needed == 0
    assert at(data, end_of(data, "X") - 1).needed > 0
    whole = read_stream(data)
    assert isinstance(whole.surface, MeshSurface)
    assert whole.surface.is_like(sphere()[0])


def test_the_first_view_is_within_its_bytes_and_has_texture() -> None:
    data = sphere_stream()
    assert end_of(data, "X") <= FIRST_VIEW - FIRST_PART
    assert at(data, FIRST_VIEW).coefficients_known[0] > 20
    assert [chunk.tag for chunk in read_stream(data).chunks][:5] == ["B", "X", "D", "S", "L"]


def test_a_small_surface_has_no_base() -> None:
    small = icosphere(2)
    quilt = sheets(np.random.default_rng(7), charts_of(small), (64, 72), 60)
    assert encode_stream(small, quilt, noise(64, 72))[6:7] != b"B"
    assert not at(encode_stream(*laid()), 3000).is_base


def test_a_base_has_the_surface_and_the_exemplar_at_their_size() -> None:
    surface, quilt, _ = sphere()
    base = parse_base(ByteReader(made_base(surface, quilt, 1500, 8)))
    points = base.surface.mesh.positions
    assert np.abs(np.linalg.norm(points, axis=1) - 1).max() < 0.02
    assert base.surface.mesh.areas.sum() == pytest.approx(4 * np.pi, rel=0.02)
    assert len(base.charts) == base.surface.islands == 6
    chart = quilt.charts[0]  # its fields are the identity: a step is a pixel, on half of the sphere's area
    pixel = np.sqrt(2) * (chart.s1 - chart.s0) / chart.height
    for one, field in zip(base.charts, base.fields, strict=True):
        step = (one.s1 - one.s0) / one.height
        pixels = np.sqrt(np.linalg.det(field.at(0, 0)))
        assert step / pixels == pytest.approx(pixel, rel=0.02)


def test_places_on_charts_turn_the_right_way_and_are_within_them() -> None:
    base = parse_base(ByteReader(made_base(*sphere()[:2], 1500, 8)))
    (a, b), (c, d) = np.diff(base.surface.parameters, axis=1).transpose(1, 2, 0)
    assert (a * d - b * c > -1e-12).all()
    for chart, box in zip(base.charts, base.surface.boxes, strict=True):
        assert chart.s0 < box[0, 0] <= box[1, 0] < chart.s1
        assert chart.t0 < box[0, 1] <= box[1, 1] < chart.t1


def test_a_finer_base_has_the_same_charts() -> None:
    surface, quilt, _ = sphere()
    bases = [parse_base(ByteReader(made_base(surface, quilt, *size))) for size in ((800, 8), (4000, 9))]
    for one, other in zip(bases[0].charts, bases[1].charts, strict=True):
        assert abs(one.height - other.height) <= 2
        assert abs(one.s0 - other.s0) <= 2 * (one.s1 - one.s0) / one.height
    assert len(bases[1].surface.island) > 2 * len(bases[0].surface.island)


def test_every_piece_of_a_model_is_in_its_base() -> None:
    # Thirty spheres, apart from each other.
    ball = icosphere(3).mesh
    places = np.stack(np.meshgrid(np.arange(5), np.arange(3), np.arange(2), indexing="ij"), -1).reshape(-1, 3)
    corners = np.concatenate([0.05 * ball.corners + (place + 0.5) / 5 for place in places])

    def fits(points: Any, triangles: Any) -> bool:
        return len(triangles) <= 700

    found = simplified(corners, 8, fits)
    assert found is not None
    middles = (found[0][found[1]] / 255).mean(axis=1)
    for place in places:
        assert np.linalg.norm(middles - (place + 0.5) / 5, axis=1).min() < 0.06


def test_a_mesh_without_area_has_no_base() -> None:
    flat = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    surface = MeshSurface(flat, np.zeros(1, int), np.zeros((1, 3, 2)))
    assert made_base(surface, sheets(np.random.default_rng(1), charts_of(surface), (8, 8), 1), 900, 8) == b""


def test_patches_have_a_base_and_keep_it_out_of_streams_on_other_surfaces() -> None:
    surface, quilt, exemplar = laid("cyclide:spans=16x16", side=8)
    nets = Surface(surface.faces, "nets")
    data = encode_stream(nets, quilt, exemplar)
    assert at(data, end_of(data, "X")).is_base
    other = on_surface(data, nets)
    assert [chunk.tag for chunk in read_stream(other).chunks][:3] == ["S", "L", "X"]
    a, b = read_stream(data), read_stream(other)
    assert all((x == y).all() for x, y in zip(a.texels().arrays, b.texels().arrays, strict=True))


def test_readers_of_streams_take_a_base() -> None:
    data = sphere_stream()[:4000]
    found = describe(data)
    assert found.chunks[0].holds.startswith("base: ")
    assert found.readable[-1].placements == 0
    assert draw_thumbnail(io.BytesIO(data)).startswith(b"\x89PNG")
    assert levels_picture(data, shares=(0.5,)).std() > 10
    steps = refine_steps(sphere_stream(), [Limit(most_bytes=4000), Limit()])
    assert np.isnan(steps[0].psnr)
    assert steps[1].psnr == float("inf")


def _with(base: bytes) -> bytes:
    rest = read_stream(sphere_stream()).chunks[1:]
    packed = [sphere_stream()[chunk.offset : chunk.end] for chunk in rest]
    return assembled([pack_chunk("B", base), packed[0]], packed[1:])


def test_damaged_bases_are_refused_or_another_mesh() -> None:
    base = made_base(*sphere()[:2], 700, 8)
    rng = np.random.default_rng(3)
    read = 0
    for place in range(60):
        damaged = bytearray(base)
        damaged[place] ^= 1 << int(rng.integers(8))
        decoder = StreamDecoder()
        with suppress(FormatError):
            decoder.feed(_with(bytes(damaged))[:3000])
            read += decoder.quilt().placements["chart"].max() < 6
    assert 0 < read < 60
    for length in (0, 1, 20, 40, len(base) - 1):
        with pytest.raises(FormatError, match="chunk 'B'"):
            StreamDecoder().feed(_with(base[:length]))
    with pytest.raises(FormatError, match="bytes too many"):
        StreamDecoder().feed(_with(base + bytes(5)))


def test_limits_hold_for_bases() -> None:
    count = describe(sphere_stream()).chunks[0].holds.split()[1].replace(",", "")
    for limits in (Limits(triangles=int(count) - 1), Limits(texels=1000)):
        with pytest.raises(FormatError, match=r"chunk 'B'.*allowed here"):
            StreamDecoder(limits=limits).feed(sphere_stream()[:3000])


def test_another_surface_for_a_base_alone_is_refused(tmp_path: Any) -> None:
    from upholster.output.refinement import refine

    path = tmp_path / "cut.uph"
    path.write_bytes(sphere_stream()[:4000])
    with pytest.raises(InputError, match="cut before its surface"):
        refine(path, tmp_path / "a.glb", on="sphere")
