"""Whole materials: every map is painted by the same quilt, at its own depth, and goes into one GLB."""

import numpy as np
import pytest
from random_quilts import SHAPE, exemplar_of, random_quilt

from upholster.base.errors import InputError
from upholster.charts.chart_seams import find_seams
from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.built_in.sphere import sphere
from upholster.image.files.material import Material
from upholster.model.atlas import build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.tangents import vertex_tangents
from upholster.output.export.glb import write_glb
from upholster.output.export.pages import PagedMesh
from upholster.quilt.materials import paint_material
from upholster.quilt.normal_painting import paint_normals, unit_normal_texels
from upholster.quilt.painting import paint

MAPS = {
    "albedo": exemplar_of(np.uint8, 3),
    "normal": exemplar_of(np.uint16, 3),
    "roughness": exemplar_of(np.uint8, 1),
    "height": exemplar_of(np.float32, 1),
    "opacity": exemplar_of(np.uint8, 1, seed=4),
}


def test_every_map_is_painted_by_the_same_quilt():
    quilt, material = random_quilt(0), Material(MAPS)
    painted = paint_material(quilt, material)
    assert list(painted) == ["albedo", "normal", "roughness", "height"]
    color = np.concatenate([MAPS["albedo"], MAPS["opacity"]], axis=2)
    for role, expected in (
        ("albedo", paint(quilt, color)),
        ("normal", unit_normal_texels(paint_normals(quilt, MAPS["normal"]))),
        ("roughness", paint(quilt, MAPS["roughness"])),
        ("height", paint(quilt, MAPS["height"])),
    ):
        for a, b in zip(painted[role].arrays, expected.arrays, strict=True):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
    with pytest.raises(InputError, match="image to paint has shape"):
        paint_material(quilt, Material({"albedo": np.zeros((SHAPE[0] + 1, SHAPE[1], 3), np.uint8)}))


def test_a_material_goes_into_a_glb(tmp_path):
    surface = sphere()
    painted = paint_material(random_quilt(1, charts=((40, 40),) * 6), Material(MAPS))
    charts = painted["albedo"].charts
    seams = find_seams(surface, charts)
    atlases = {
        role: build_normal_atlas(surface, texels, seams) if role == "normal" else build_atlas(texels, seams)
        for role, texels in painted.items()
    }
    mesh = tessellate(surface, charts, seams, quads=600)
    write_glb(
        tmp_path / "x.glb",
        PagedMesh(mesh, atlases["albedo"].texture_coordinates(mesh), atlases["albedo"].pixels),
        maps={role: atlas.pixels for role, atlas in atlases.items() if role != "albedo"},
        tangents=vertex_tangents(surface, charts, mesh),
    )
    assert (tmp_path / "x.glb").stat().st_size > 10_000
