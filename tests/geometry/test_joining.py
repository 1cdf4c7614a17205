"""Patches of a file become faces where they go on smoothly, whatever their order and the way they stand."""

import json

import numpy as np
import pytest
from benchmarks.nets import write_nets

from upholster.base.errors import FormatError, InputError
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.revolution import vase
from upholster.geometry.built_in.surface_files import read_nets
from upholster.geometry.patches.face_assembly import join_patches
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface


def grids(surface):
    return [(face.rows, face.columns) for face in surface.faces]


@pytest.mark.parametrize(
    ("spec", "wanted"),
    [
        ("cyclide", [(4, 4)]),
        ("torus:spans=6x8", [(6, 8)]),
        ("sphere", 6 * [(1, 1)]),
        ("sphere:tiling=octants", [(2, 4)]),
        ("cone:r2=0", [(1, 4)]),
        ("vase", 10 * [(1, 4)]),  # its profile's curves run at different speeds
        ("plane:spans=3x5", [(3, 5)]),
    ],
)
def test_patches_of_a_built_in_surface_find_together(spec, wanted):
    built = surface_from_spec(spec)
    joined = join_patches(Surface(built.patches))
    assert grids(joined) == wanted
    assert all(a is b for a, b in zip(joined.patches, built.patches, strict=True))
    rng = np.random.default_rng(2)
    shuffled = [
        RationalPatch(np.rot90(built.patches[n].net, int(rng.integers(4))))
        for n in rng.permutation(len(built.patches))
    ]
    again = join_patches(Surface(shuffled))
    assert sorted(tuple(sorted(grid)) for grid in grids(again)) == sorted(tuple(sorted(g)) for g in wanted)
    assert len(again.shared) == len(built.shared)
    for patch in again.patches:  # turned, not mirrored
        assert any(np.array_equal(np.rot90(patch.net, k), one.net) for one in shuffled for k in range(4))


def test_degrees_may_differ_but_not_speeds_directions_or_sides():
    points = np.array([[[0, 0, 0], [1, 0, 0]], [[0, -1, 0], [1, -1, 0]]], float)
    left = RationalPatch.from_points(points)
    right = RationalPatch.from_points(points + np.array([1, 0, 0]))
    assert grids(join_patches(Surface([left, right.elevate(3, 2)]))) == [(1, 2)]
    faster, steeper = np.array(points), np.array(points)
    faster[:, 1, 0], steeper[:, 1, 2] = 1.1, 0.1
    for other in (faster, steeper):
        assert grids(
            join_patches(Surface([left, RationalPatch.from_points(other + np.array([1, 0, 0]))]))
        ) == 2 * [(1, 1)]
    assert grids(join_patches(Surface([left, right.transpose()]))) == 2 * [(1, 1)]


def test_what_is_no_grid_is_grids():
    # an L of three squares
    squares = [
        RationalPatch.from_points(
            np.array([[[x, y, 0], [x + 1, y, 0]], [[x, y - 1, 0], [x + 1, y - 1, 0]]], float)
        )
        for x, y in ((0, 0), (1, 0), (0, -1))
    ]
    assert grids(join_patches(Surface(squares))) == [(1, 2), (1, 1)]


def test_faces_are_written_and_read(tmp_path):
    for surface in (vase(), Surface(ring_cyclide().patches), Surface(ring_cyclide().faces)):
        write_nets(tmp_path / "one.json", surface)
        assert grids(read_nets(tmp_path / "one.json")) == grids(surface)
    data = json.loads((tmp_path / "one.json").read_text())
    del data["faces"]
    (tmp_path / "none.json").write_text(json.dumps(data))
    assert grids(read_nets(tmp_path / "none.json")) == [(4, 4)]


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([], "faces is a list of 0"),
        ([[0, 1]], "face 0 is a list of 2"),
        ([[[0], [1, 2]]], "face 0 is a list of 2; allowed: rows of patch numbers, equally long"),
        ([[[0, 16]]], "face 0: patch 16; allowed: 0 to 15, each once"),
        ([[[0]], [[0]]], "face 1: patch 0; allowed"),
        ([[[True]]], "face 0: patch True"),
        ([[[0, 1]]], "patch 2 is in no face"),
    ],
)
def test_wrong_faces_are_refused(tmp_path, faces, message):
    write_nets(tmp_path / "ring.json", ring_cyclide())
    data = json.loads((tmp_path / "ring.json").read_text())
    (tmp_path / "ring.json").write_text(json.dumps(data | {"faces": faces}))
    with pytest.raises(FormatError, match=message) as caught:
        read_nets(tmp_path / "ring.json")
    assert "\n" not in str(caught.value)


def test_faces_that_do_not_join_are_refused(tmp_path):
    write_nets(tmp_path / "ring.json", ring_cyclide())
    data = json.loads((tmp_path / "ring.json").read_text())
    data["faces"] = [[[0, 5]], *([[n]] for n in range(16) if n not in (0, 5))]
    (tmp_path / "ring.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="do not join"):
        read_nets(tmp_path / "ring.json")
