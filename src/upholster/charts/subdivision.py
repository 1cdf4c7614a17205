"""Cutting a mesh's long edges, so that no triangle is long where a block is short."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import MeshSurface, TriangleMesh
from upholster.types import FloatArray, IntArray

__all__ = ["Subdivided", "subdivided"]

_ROUNDS = 24


@dataclass(frozen=True, eq=False, slots=True)
class Subdivided:
    """A surface with shorter edges, which lies as the one that it was made of.

    Attributes
    ----------
    surface
        The surface.
    parent
        (T,) int32: the triangle that each one is a part of.
    vectors
        (T, 3, 3) a vector at each corner, of unit length: in between, the mean of the ends'.
    """

    surface: MeshSurface
    parent: IntArray
    vectors: FloatArray


def subdivided(surface: MeshSurface, vectors: FloatArray, longest: float) -> Subdivided:
    """Halve edges until none is longer; both sides of an edge halve it alike, so that nothing gapes.

    Parameters
    ----------
    surface
        What to subdivide; triangles on no island are left out.
    vectors
        (T, 3, 3), of unit length, at its triangles' corners.
    longest
        Length of an edge, in model units.
    """
    kept = np.flatnonzero(surface.island >= 0)
    positions, triangles = surface.mesh.positions, surface.mesh.triangles[kept]
    parameters, vectors, parent = surface.parameters[kept], vectors[kept], kept.astype(np.int32)
    for _ in range(_ROUNDS):
        ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
        long = np.linalg.norm(positions[ends[..., 0]] - positions[ends[..., 1]], axis=2) > longest
        if not long.any():
            break
        middles, positions = _halved(ends, long, positions)
        triangles, places, which = _split(triangles, np.concatenate([parameters, vectors], axis=2), middles)
        parameters, vectors, parent = places[..., :2], places[..., 2:], parent[which]
    mesh = TriangleMesh(positions, triangles, name=surface.name)
    return Subdivided(MeshSurface(mesh, surface.island[parent], parameters), parent, vectors)


def _halved(ends: IntArray, long: NDArray[np.bool_], positions: FloatArray) -> tuple[IntArray, FloatArray]:
    # New vertices in the middle of long edges: (T, 3) their numbers, −1 elsewhere, and the longer array.
    low, high = ends[long].min(axis=1).astype(np.int64), ends[long].max(axis=1)
    keys, number = np.unique(low * len(positions) + high, return_inverse=True)
    low, high = keys // len(positions), keys % len(positions)
    middles = np.full(long.shape, -1, np.int32)
    middles[long] = len(positions) + number.reshape(-1)
    return middles, np.concatenate([positions, 0.5 * (positions[low] + positions[high])])


def _unit(vectors: FloatArray, instead: FloatArray) -> FloatArray:
    # Vectors with length 1; where they are nothing, for those of the ends cancel, others.
    length = np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.where(length > 1e-3, vectors / np.maximum(length, 1e-3), instead)


def _split(
    triangles: IntArray, values: FloatArray, middles: IntArray
) -> tuple[IntArray, FloatArray, NDArray[np.intp]]:
    # Triangles cut at the middles of one, two or three edges, values at their corners, and which triangle
    # each is a part of.
    between = 0.5 * (values + np.roll(values, -1, axis=1))
    between[..., 2:] = _unit(between[..., 2:], values[..., 2:])
    vertices = np.concatenate([triangles, middles], axis=1)  # corners 0…2, middles 3…5
    places = np.concatenate([values, between], axis=1)
    cut = middles >= 0
    parts = []
    for turn in range(3):  # patterns turned so that edge 0, or edges 0 and 1, are cut
        corner, middle = (np.arange(3) + turn) % 3, 3 + (np.arange(3) + turn) % 3
        a, b, c = corner
        ab, bc, _ = middle
        here = cut[:, corner]
        for pattern, pieces in (
            ((1, 0, 0), ((a, ab, c), (ab, b, c))),
            ((1, 1, 0), ((ab, b, bc), (a, ab, bc), (a, bc, c))),
        ):
            chosen = np.flatnonzero((here == np.array(pattern, bool)).all(axis=1))
            parts += [(chosen, np.array(piece)) for piece in pieces]
    whole = np.flatnonzero(cut.all(axis=1))
    parts += [(whole, np.array(piece)) for piece in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))]
    parts.append((np.flatnonzero(~cut.any(axis=1)), np.arange(3)))
    origins = np.concatenate([chosen for chosen, _ in parts])
    new = np.concatenate([vertices[np.ix_(chosen, piece)] for chosen, piece in parts])
    flat = np.concatenate([places[np.ix_(chosen, piece)] for chosen, piece in parts])
    order = np.argsort(origins, kind="stable")
    return new[order], flat[order], origins[order]
