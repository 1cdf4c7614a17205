"""Blocks mirrored and turned: what they need of a material, and where they may be."""

import numpy as np
import pytest
from laying import texture

from upholster.base.errors import InputError
from upholster.covering.synthesis import synthesize
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.image.files.material import Material
from upholster.quilt.materials import paint_material

ALL = {"mirror": True, "rotate": True}


@pytest.mark.parametrize(("name", "allowed"), [("mirror", {0, 5}), ("rotate", {0, 1, 2, 3})])
def test_a_mesh_has_them_as_well(name: str, allowed: set[int]) -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    places = np.stack([1 - corners[:, 1], corners[:, 0]], axis=1)
    surface = MeshSurface(mesh, np.zeros(2), places[mesh.triangles])
    quilt = synthesize(
        texture(64, 64), surface, texels=40_000, sample_size=0.3, direction="x", **{name: True}
    )
    assert set(quilt.placements["symmetry"].tolist()) == allowed


@pytest.mark.parametrize("options", [{"mirror": True}, {"mirror": True, "rotate": True}])
def test_nothing_is_laid_beside_its_own_mirror_image(options: dict[str, bool]) -> None:
    quilt = synthesize(texture(96, 96), "plane", texels=(384, 384), seed=1, **options)
    (places,) = quilt.sources()
    rows, columns = np.moveaxis(places.astype(int), 2, 0)
    steps = np.diff(columns, axis=1)
    # Rows of pixels that run to one side before a place, and back after it.
    turned = (abs(steps[:, :-4]) == 16) & (steps[:, :-4] == -steps[:, 4:])
    near = (abs(columns[:, 4:-1] - columns[:, :-5]) <= 64) & (abs(rows[:, 4:-1] - rows[:, :-5]) <= 48)
    assert turned.sum() > 200
    assert (turned & near).sum() < 0.02 * turned.sum()


def test_flat_textures_have_no_strokes_and_creases() -> None:
    for more in ({"crease": 20.0}, {"stroke": ("0,0,0:1,0,0",)}, {"size_map": "height=1,2"}):
        with pytest.raises(InputError, match="is given for a flat texture"):
            synthesize(texture(64, 64), "plane", texels=(64, 64), **more)


@pytest.mark.parametrize("surface", ["plane", "torus"])
def test_normals_turn_with_their_blocks(surface: str) -> None:
    # The normals of the painted relief are the painted normals, inside of blocks.
    rows, columns = np.meshgrid(np.arange(96), np.arange(96), indexing="ij")
    relief = texture(96, 96, channels=1, passes=30)[..., 0].astype(float) * 0.3
    down, right = np.gradient(relief)
    normal = np.stack([-right, down, np.ones_like(relief)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = np.rint(np.ptp(relief) and (relief - relief.min()) / np.ptp(relief) * 65535).astype(np.uint16)
    albedo = np.stack([2 * rows, 2 * columns, height // 257], axis=-1).astype(np.uint8)
    material = Material(
        {
            "albedo": albedo,
            "normal": np.rint((normal + 1) / 2 * 65535).astype(np.uint16),
            "height": height[..., None],
        }
    )
    size = (
        {"texels": 14_400, "sample_size": 0.8}
        if surface == "plane"
        else {"texels": 40_000, "sample_size": 2.5}
    )
    quilt = synthesize(material, surface, block=20, **size, **ALL)
    assert len(set(quilt.placements["symmetry"].tolist())) > 4
    painted = paint_material(quilt, material)
    errors, wrong = [], []
    for heights, normals, field in zip(
        painted["height"].arrays, painted["normal"].arrays, quilt.fields, strict=True
    ):
        shape = heights.shape[:2]
        slopes = np.stack(np.gradient(heights[..., 0] / 65535 * np.ptp(relief)), axis=-1)
        # From texels to pixels' own steps, along T and B: the same plane seen in a frame without shear.
        matrices = field.at(*np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij"))
        slopes = np.einsum("...ji,...j->...i", np.linalg.inv(matrices), slopes)
        right_step = matrices[..., 1] / np.linalg.norm(matrices[..., 1], axis=-1, keepdims=True)
        along = (slopes * right_step).sum(axis=-1)
        across = slopes[..., 0] * right_step[..., 1] - slopes[..., 1] * right_step[..., 0]
        vector = normals / 65535 * 2 - 1
        for sign, found in ((1, errors), (-1, wrong)):
            apart = np.abs(-sign * along - vector[..., 0] / vector[..., 2])
            found.append((apart + np.abs(across - vector[..., 1] / vector[..., 2])).reshape(-1))
    assert np.median(np.concatenate(errors)) < 0.25 * np.median(np.concatenate(wrong))
