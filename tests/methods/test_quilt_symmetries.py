"""Blocks mirrored and turned: `--mirror` and `--rotate` of method "quilt"."""

import numpy as np
import pytest
from plain_quilt import SYMMETRIES, texture

from upholster.errors import InputError
from upholster.geometry import MeshSurface, TriangleMesh, plane, torus
from upholster.image import Material
from upholster.methods import synthesize
from upholster.methods.quilt import QuiltOptions, synthesize_quilt
from upholster.quilt import Chart, paint, paint_material

ALL = {"mirror": True, "rotate": True}
ALLOWED = [({}, {0}), ({"mirror": True}, {0, 5}), ({"rotate": True}, {0, 1, 2, 3}), (ALL, set(range(8)))]


@pytest.mark.parametrize(("asked", "allowed"), ALLOWED)
def test_own_blocks_have_the_symmetries_that_are_asked_for(asked, allowed):
    exemplar = texture(64, 80, passes=4)
    quilt = synthesize(exemplar, plane(), texels=(400, 400), block=20, **asked)
    assert set(quilt.placements["symmetry"].tolist()) == allowed
    shares = np.bincount(quilt.placements["symmetry"], minlength=8)[sorted(allowed)] / len(quilt.placements)
    assert shares.min() > 0.3 / len(allowed)  # they are used about evenly


def test_mirrored_blocks_exchange_left_and_right():
    # Rows of different colours, each darker to its left: what is above stays above.
    exemplar = np.zeros((40, 40, 3), np.uint8)
    exemplar[..., 0], exemplar[..., 1] = 6 * np.arange(40)[:, None], 6 * np.arange(40)
    quilt = synthesize(exemplar, plane(), texels=(40, 40), block=20, mirror=True, evenness=0, variety=0)
    picture = paint(quilt, exemplar).arrays[0].astype(int)
    for one in quilt.placements[quilt.placements["symmetry"] == 5]:
        row, column = np.clip(int(one["row"]), 1, 38), np.clip(int(one["column"]), 1, 38)
        assert picture[row + 1, column, 0] >= picture[row - 1, column, 0]
    assert (SYMMETRIES[5] == np.array([1, 0, 0, -1])).all()


@pytest.mark.parametrize("name", ["mirror", "rotate"])
def test_on_a_mesh_they_are_refused(name):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = TriangleMesh(corners, np.array([[0, 1, 2]]))
    surface = MeshSurface(mesh, np.zeros(1), corners[mesh.triangles][..., :2])
    with pytest.raises(InputError, match=f"{name} is given on a mesh"):
        synthesize(texture(64, 64), surface, texels=1000, **{name: True})


def lattice(count=4, period=16):
    """Return a texture that tiles and has all the symmetries of the square about its pixel (0, 0)."""
    tile = texture(period, period, passes=2).astype(int)
    back = np.roll(np.arange(period)[::-1], 1)
    half = tile + tile[back]
    half = half + half[:, back]
    return np.tile(((half + half.swapaxes(0, 1)) // 8).astype(np.uint8), (count, count, 1))


@pytest.mark.parametrize("asked", [asked for asked, _ in ALLOWED[1:]])
@pytest.mark.parametrize("wrap", [False, True])
def test_what_has_these_symmetries_goes_on_without_error(asked, wrap):
    exemplar = lattice()
    options = QuiltOptions(block=20, evenness=0, variety=0, **asked)
    used = set()
    for seed in range(3):
        quilt = synthesize_quilt(
            exemplar, plane(), (Chart(0, 64, 80),), options=options, wrap=wrap, seed=seed
        )
        used |= set(quilt.placements["symmetry"].tolist())
        picture = np.tile(paint(quilt, exemplar).arrays[0], (1 + wrap, 1 + wrap, 1))
        # But where a block is blended a little beyond its rim, which may lie beyond the sample's.
        assert (picture[16:] == picture[:-16]).mean() > 0.99
        assert (picture[:, 16:] == picture[:, :-16]).mean() > 0.99
    assert len(used) > 1
    assert np.ptp(exemplar) > 50


def test_a_landmark_recurs_less_in_one_orientation():
    exemplar = texture(64, 64, passes=4)

    def recurrence(**asked):
        # How many blocks show about the same place in the same way, for a block on average.
        quilt = synthesize(exemplar, torus(), texels=60_000, sample_size=1.0, block=20, **asked)
        placed = quilt.placements
        place = (placed["source_row"] >> 8) * 4 + (placed["source_column"] >> 8)
        counts = np.bincount(16 * placed["symmetry"].astype(int) + place).astype(float)
        return (counts**2).sum() / len(placed)

    plain = recurrence()
    assert recurrence(mirror=True) < 0.65 * plain
    assert recurrence(**ALL) < 0.3 * plain


@pytest.mark.parametrize("surface", ["plane", "torus"])
def test_normals_turn_with_their_blocks(surface):
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
    size = {"texels": (120, 120)} if surface == "plane" else {"texels": 40_000, "sample_size": 2.5}
    quilt = synthesize(material, surface, block=32, effort=0, **size, **ALL)
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
