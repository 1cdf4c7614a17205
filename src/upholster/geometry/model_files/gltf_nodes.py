"""Nodes of a glTF scene: the placements of each mesh, and the poses of skins."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.accessors import Accessor, Accessors, as_floats
from upholster.geometry.gltf.gltf import Gltf, Json, number_list

__all__ = ["INSTANCING", "MeshPlacement", "mesh_placements", "vertex_matrices"]

INSTANCING = "EXT_mesh_gpu_instancing"

_MOST_INSTANCES = 1 << 20


@dataclass(frozen=True, eq=False)
class MeshPlacement:
    """The first placement of a mesh, and its others.

    Attributes
    ----------
    mesh, node
        Their numbers.
    matrix
        (4, 4), from the mesh's space to the scene's.
    joints
        (joints, 4, 4) of a skin, also to the scene; None without one.
    others
        (n, 4, 4): matrices of its other placements.
    nodes
        (n + 1,): the node of each placement, of the first one, too.
    """

    mesh: int
    node: int
    matrix: FloatArray
    joints: FloatArray | None
    others: FloatArray
    nodes: IntArray


def mesh_placements(gltf: Gltf, accessors: Accessors) -> list[MeshPlacement]:
    """Return the meshes that the scene shows, in the order of its nodes, and the instances of a node.

    Raises
    ------
    FormatError
        If nodes do not form trees, or refer to items that do not exist.
    InputError
        If there are more than a million instances.
    """
    nodes = gltf.items("nodes")
    parents = _parents(nodes)
    matrices = _matrices(nodes, parents)
    shown = _shown(gltf, nodes)
    found: dict[int, list[tuple[int, FloatArray]]] = {}
    total = 0
    for number in shown:
        if "mesh" not in nodes[number]:
            continue
        gltf.item("meshes", nodes[number]["mesh"])
        places = matrices[number] @ _instances(accessors, nodes[number], number, _MOST_INSTANCES - total)
        total += len(places)
        found.setdefault(nodes[number]["mesh"], []).append((number, places))
    out = []
    for mesh, group in found.items():
        node = group[0][0]
        places = np.concatenate([places for _, places in group])
        owners = np.repeat([number for number, _ in group], [len(places) for _, places in group])
        joints = _joints(gltf, accessors, nodes[node], matrices)
        out.append(MeshPlacement(mesh, node, places[0], joints, places[1:], owners.astype(np.int32)))
    return out


def vertex_matrices(
    placement: MeshPlacement, joints: Sequence[Accessor], weights: Sequence[Accessor], count: int
) -> FloatArray:
    """Return the matrix from vertices to the scene, (1, 3, 4); for a skin (V, 3, 4), as the nodes pose it.

    Raises
    ------
    FormatError
        If a joint does not exist, or the numbers do not match.
    """
    if placement.joints is None or not joints:
        return placement.matrix[None, :3]
    total = np.zeros(count)
    out = np.zeros((count, 3, 4))
    for of, by in zip(joints, weights, strict=True):
        share, number = as_floats(by), of.values.astype(np.int64)
        if share.shape != number.shape or len(number) != count:
            raise FormatError("joints and weights of a skin differ in number")
        number[share == 0] = 0
        if number.min() < 0 or number.max() >= len(placement.joints):
            raise FormatError(f"a vertex names joint {number.max()}; its skin has {len(placement.joints)}")
        for column in range(number.shape[1]):
            out += share[:, column, None, None] * placement.joints[number[:, column], :3]
            total += share[:, column]
    bare = ~(total > 0)
    out[bare], total[bare] = placement.matrix[:3], 1.0
    return out / total[:, None, None]


def _instances(accessors: Accessors, node: Json, number: int, room: int) -> FloatArray:
    """Return the matrices of a node's instances in its space, (n, 4, 4): the identity without any."""
    extensions = node.get("extensions")
    found = extensions.get(INSTANCING) if isinstance(extensions, dict) else None
    attributes = found.get("attributes") if isinstance(found, dict) else None
    if not isinstance(attributes, dict):
        return np.eye(4)[None]
    if any(accessors.count(index) > room for index in attributes.values()):
        raise InputError(f"it has more than {_MOST_INSTANCES} instances; allowed: up to that")
    given = {
        name: as_floats(accessors.read(attributes[name], width))
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
        if name in attributes
    }
    counts = {len(values) for values in given.values()}
    if not counts:
        return np.eye(4)[None]
    if len(counts) > 1:
        raise FormatError(f"instances of node {number} have {' and '.join(map(str, sorted(counts)))} values")
    out = np.tile(np.eye(4), (counts.pop(), 1, 1))
    if "ROTATION" in given:
        out[:, :3, :3] = _turns(given["ROTATION"])
    if "SCALE" in given:
        out[:, :3, :3] *= given["SCALE"][:, None]
    if "TRANSLATION" in given:
        out[:, :3, 3] = given["TRANSLATION"]
    return out


def _turns(quaternions: FloatArray) -> FloatArray:
    """Return the rotations of quaternions (n, 4), of any length: (n, 3, 3)."""
    lengths = np.linalg.norm(quaternions, axis=1, keepdims=True)
    x, y, z, w = (quaternions / np.where(lengths > 0, lengths, 1.0)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), 2, 0)


def _parents(nodes: list[Json]) -> list[int]:
    """Return each node's parent, -1 for roots."""
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        children = node.get("children", [])
        if not isinstance(children, list):
            raise FormatError(f"children of node {number} are not a list")
        for child in children:
            if type(child) is not int or not 0 <= child < len(nodes):
                raise FormatError(
                    f"node {number} has a child {str(child)[:20]}; there are {len(nodes)} nodes"
                )
            if parents[child] >= 0:
                raise FormatError(f"node {child} is a child twice; allowed: once")
            parents[child] = number
    return parents


def _matrices(nodes: list[Json], parents: list[int]) -> list[FloatArray]:
    """Return each node's matrix to the scene's space, (4, 4)."""
    out = [_own_matrix(node, number) for number, node in enumerate(nodes)]
    done = 0
    children: list[list[int]] = [[] for _ in nodes]
    for number, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(number)
    waiting = [number for number, parent in enumerate(parents) if parent < 0]
    while waiting:
        number = waiting.pop()
        done += 1
        for child in children[number]:
            out[child] = out[number] @ out[child]
        waiting += children[number]
    if done < len(nodes):
        raise FormatError("nodes form a circle; allowed: trees")
    return out


def _own_matrix(node: Json, number: int) -> FloatArray:
    try:
        matrix = number_list(node, "matrix", 16)
        if matrix is not None:
            return np.array(matrix).reshape(4, 4).T
        out = np.eye(4)
        rotation = number_list(node, "rotation", 4)
        if rotation is not None:
            out[:3, :3] = _turns(np.array([rotation]))[0]
        out[:3, :3] *= number_list(node, "scale", 3) or (1.0, 1.0, 1.0)
        out[:3, 3] = number_list(node, "translation", 3) or (0.0, 0.0, 0.0)
    except FormatError as error:
        raise FormatError(f"node {number}: {error}") from None
    return out


def _shown(gltf: Gltf, nodes: list[Json]) -> list[int]:
    """Return the nodes of the scene, parents before children; without scenes all."""
    if not gltf.items("scenes"):
        return list(range(len(nodes)))
    roots = gltf.item("scenes", gltf.json.get("scene", 0)).get("nodes", [])
    if not isinstance(roots, list) or any(type(n) is not int or not 0 <= n < len(nodes) for n in roots):
        raise FormatError("the scene has nodes that do not exist")
    order, waiting = [], list(reversed(dict.fromkeys(roots)))
    seen = set(waiting)
    while waiting:
        number = waiting.pop()
        order.append(number)
        below = [child for child in nodes[number].get("children", []) if child not in seen]
        seen.update(below)
        waiting += reversed(below)
    return order


def _joints(gltf: Gltf, accessors: Accessors, node: Json, matrices: list[FloatArray]) -> FloatArray | None:
    """Return the matrices of a node's skin."""
    if "skin" not in node:
        return None
    skin = gltf.item("skins", node["skin"])
    joints = skin.get("joints")
    if not isinstance(joints, list) or not joints:
        raise FormatError("a skin has no joints")
    for joint in joints:
        gltf.item("nodes", joint)
    out = np.stack([matrices[joint] for joint in joints])
    if "inverseBindMatrices" in skin:
        inverse = as_floats(accessors.read(skin["inverseBindMatrices"], 16))
        if len(inverse) < len(joints):
            raise FormatError(f"a skin has {len(joints)} joints and {len(inverse)} matrices")
        out = out @ inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    return out
