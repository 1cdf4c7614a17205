"""Blocks mirrored and turned: what they need of a material, and where they are refused."""

import numpy as np
import pytest
from laying import texture

from upholster.errors import InputError
from upholster.geometry import MeshSurface, TriangleMesh
from upholster.image import Material
from upholster.methods import synthesize
from upholster.quilt import paint_material

ALL = {"mirror": True, "rotate": True}


@pytest.mark.parametrize("name", ["mirror", "rotate"])
def test_on_a_mesh_they_are_refused(name: str) -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = TriangleMesh(corners, np.array([[0, 1, 2]]))
    surface = MeshSurface(mesh, np.zeros(1), corners[mesh.triangles][..., :2])
    with pytest.raises(InputError, match=f"{name} is given on a mesh"):
        synthesize(texture(64, 64), surface, texels=1000, **{name: True})


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
    quilt = synthesize(material, surface, block=32, **size, **ALL)
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
