"""Faces: points, derivatives and frames are the patches' own, wherever parameters lie."""

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.face import Face, grid_face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

RNG = np.random.default_rng(4)
FACE = ring_cyclide().faces[0]


def by_hand(face, s, t):
    """Return what each patch says: points, derivatives by s and by t, normals."""
    found = []
    for a, b in zip(s, t, strict=True):
        i = min(max(int(np.floor(a)), 0), face.rows - 1)
        j = min(max(int(np.floor(b)), 0), face.columns - 1)
        patch = face.patches[i][j]
        found.append([*patch.derivatives(a - i, b - j), patch.normals(a - i, b - j)])
    return np.array(found).swapaxes(0, 1)


def test_scattered_parameters_find_their_patches():
    s, t = RNG.uniform(-0.3, 4.3, (2, 200))
    s[:4], t[:4] = (0, 4, 2, 1), (4, 0, 2, 3)
    points, by_s, by_t, normals = by_hand(FACE, s, t)
    np.testing.assert_array_equal(FACE.points(s, t), points)
    for found, wanted in zip(FACE.derivatives(s, t), (points, by_s, by_t), strict=True):
        np.testing.assert_array_equal(found, wanted)
    shaped = FACE.frames(s.reshape(10, 20), t.reshape(10, 20))
    np.testing.assert_array_equal(shaped[1].reshape(-1, 3), normals)
    assert FACE.points(1.5, 2.5).shape == (3,)


def test_grids_are_all_pairs():
    s, t = RNG.uniform(-0.2, 4.2, 7), RNG.uniform(-0.2, 4.2, 9)
    pairs = [x.ravel() for x in np.meshgrid(s, t, indexing="ij")]
    wanted = [x.reshape(7, 9, 3) for x in by_hand(FACE, *pairs)]
    np.testing.assert_allclose(FACE.points_grid(s, t), wanted[0], rtol=1e-13, atol=1e-13)
    for found, one in zip(FACE.derivatives_grid(s, t), wanted, strict=False):
        np.testing.assert_allclose(found, one, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(FACE.frames_grid(s, t)[1], wanted[3], atol=1e-12)


def test_a_reversed_face_has_its_points_mirrored():
    s, t = RNG.uniform(0, 4, (2, 50))
    for axis, (a, b) in enumerate(((4 - s, t), (s, 4 - t))):
        np.testing.assert_allclose(FACE.reverse(axis).points(s, t), FACE.points(a, b), atol=1e-12)


def test_derivatives_jump_where_they_do():
    assert FACE.breaks == ((), ())
    assert vase().faces[0].breaks == ((1, 2, 3, 4, 5, 6, 7, 8, 9), ())


def test_patches_have_numbers_and_places():
    surface = Surface([*ring_cyclide().faces, *sphere().patches, *plane(spans=(2, 3)).faces])
    assert len(surface.patches) == 28
    assert surface.first_patches == (0, 16, 17, 18, 19, 20, 21, 22)
    assert [surface.place(n) for n in (0, 7, 16, 21, 27)] == [
        (0, 0, 0),
        (0, 1, 3),
        (1, 0, 0),
        (6, 0, 0),
        (7, 1, 2),
    ]
    assert all(surface.patch_number(*surface.place(n)) == n for n in range(28))
    assert surface.whole_patch(7, 1, 2, 2, 3) == 27
    assert surface.whole_patch(7, 1, 2, 2, 2.5) is None
    for wrong in (-1, 28):
        with pytest.raises(InputError, match="allowed: 0 to 27"):
            surface.place(wrong)
    with pytest.raises(InputError, match="face 7 has no patch"):
        surface.patch_number(7, 2, 0)


def test_faces_meet_along_whole_edges():
    ring = ring_cyclide()
    assert [
        (m.face, m.edge, m.start, m.stop, m.other_edge, m.other_start, m.other_stop) for m in ring.face_shared
    ] == [(0, 0, 0, 4, 2, 0, 4), (0, 1, 0, 4, 3, 0, 4)]
    # Two faces of one plane, divided differently.
    left, right = plane(1, 1, spans=(3, 1)), plane(1, 1, spans=(2, 1))
    moved = [
        [RationalPatch(p.net + [1, 0, 0, 0] * p.net[..., 3:]) for p in row] for row in right.faces[0].patches
    ]
    two = Surface([left.faces[0], Face(moved)])
    (seam,) = two.face_shared
    assert (seam.edge, seam.start, seam.stop, seam.other_edge) == (1, 0.0, 3.0, 3)
    assert (seam.other_start, seam.other_stop) == (0.0, 2.0)
    assert seam.flipped().flipped() == seam


def test_what_is_no_face_is_refused():
    patch = plane().patches[0]
    for wrong in ([], [[]], [[patch], [patch, patch]]):
        with pytest.raises(InputError, match="a face has rows"):
            Face(wrong)
    with pytest.raises(InputError, match=r"patch \[0, 1\] of a face is a int"):
        Face([[patch, 3]])
    torn = Surface([grid_face([patch, patch], 2)])
    with pytest.raises(InputError, match="patches 0 and 1 lie side by side in a face, but do not join"):
        _ = torn.shared
