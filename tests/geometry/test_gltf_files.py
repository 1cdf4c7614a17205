"""GLB and glTF files: each way of writing a cube gives a cube."""

from pathlib import Path

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES, Glb

from upholster.errors import InputError
from upholster.geometry import TriangleMesh
from upholster.geometry.mesh_files import read_model


def is_closed_cube(mesh: TriangleMesh, edge: float = 1.0) -> None:
    """Check that a mesh is a cube with its faces outward."""
    assert len(mesh.positions) == 8
    assert (mesh.neighbours >= 0).all()
    assert mesh.areas.sum() == pytest.approx(6 * edge**2)
    a, b, c = mesh.corners.transpose(1, 0, 2)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(edge**3)


def test_a_cube_stands_upright_and_is_closed(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(name="Seat", mesh=glb.mesh("cube", glb.box()), scale=[2, 2, 2], translation=[0, 5, 0])
    model = read_model(glb.write(tmp_path / "cube.glb"))
    is_closed_cube(model.mesh, 2)
    assert model.mesh.parts == ("Seat",)
    assert model.mesh.metres == 1.0
    np.testing.assert_allclose(model.mesh.box, [(0, -2, 5), (2, 0, 7)])  # y is up there, z here


def test_a_mirrored_node_keeps_the_outside_out(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()), scale=[1, 1, -1])
    is_closed_cube(read_model(glb.write(tmp_path / "cube.glb")).mesh)


def test_parts_are_chosen_by_name_and_material(tmp_path: Path) -> None:
    glb = Glb(materials=[{"name": "Leather"}, {"name": "Oak"}])
    leather, oak = (glb.box() | {"material": number} for number in (0, 1))
    glb.node(name="Seat", mesh=glb.mesh("seat", leather))
    for name in ("Leg front", "Leg back"):
        glb.node(name=name, mesh=glb.mesh("leg", glb.box() | {"material": 1}))
    glb.node(name="Frame", mesh=glb.mesh("frame", leather, oak))
    path = glb.write(tmp_path / "chair.glb")
    names = ("Seat", "Leg front", "Leg back", "Frame/Leather", "Frame/Oak")
    assert read_model(path).mesh.parts == names
    assert read_model(path, parts=["leg*"]).mesh.parts == names[1:3]
    assert read_model(path, parts=["Oak", "Seat"]).mesh.parts == (*names[:3], names[4])
    with pytest.raises(InputError, match=r"'Arm'; allowed: Seat, Leg front.*by material: Leather, Oak"):
        read_model(path, parts=["Arm"])


def test_vertices_are_those_of_the_primitive(tmp_path: Path) -> None:
    glb = Glb()
    loose = BOX[BOX_TRIANGLES.ravel()]
    position = glb.accessor(loose, min=[0, 0, 0], max=[1, 1, 1])
    glb.node(mesh=glb.mesh("cube", {"attributes": {"POSITION": position}}))
    model = read_model(glb.write(tmp_path / "cube.glb"))
    is_closed_cube(model.mesh)
    (part,) = model.gltf_parts
    x, y, z = np.moveaxis(loose[part.vertices].astype(float), 2, 0)
    np.testing.assert_array_equal(model.mesh.corners, np.stack([x, -z, y], axis=-1))
