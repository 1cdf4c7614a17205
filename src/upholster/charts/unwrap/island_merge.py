"""Rejoining islands that unroll together: a box's sides to a strip, strips of a tube to a sheet."""

from functools import partial
from typing import NamedTuple

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._piece_kernels import number_links
from upholster.charts.unwrap.flat_piece import Flat, flatten
from upholster.charts.unwrap.pieces import Piece, pieces_of
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.parallel import run_tasks

__all__ = ["Layout", "join_islands"]

_ROUNDS = 12
_LEAST_SHARE = 0.1
"""Share of the shorter outline that two islands must have in common."""
_MOST_MISFIT = 0.03
"""Greatest distance between borders when one island is moved to the other, as a share of their length."""
_MOST_UNEVEN = 1.3
_MOST_WASTE = 1.1
"""Greatest area of the joined island's rectangle over the sum of the two islands' rectangles."""
_MOST_TRIANGLES = 40_000


class Layout(NamedTuple):
    """Islands in the plane; changed in place.

    Attributes
    ----------
    across
        (T, 3) int32, as `TriangleMesh.neighbours`, −1 also where it is cut.
    island
        (T,) int32.
    parameters
        (T, 3, 2).
    """

    across: IntArray
    island: IntArray
    parameters: FloatArray


class _Borders(NamedTuple):
    """Stretches of border between two islands, best first."""

    pair: IntArray  # (B, 2) islands
    edges: list[IntArray]  # of each, 3 · triangle + edge, from either side


def join_islands(mesh: TriangleMesh, linked: IntArray, layout: Layout) -> None:
    """Join neighbours while the result is as good as its parts and wastes no more room.

    Parameters
    ----------
    mesh
        The triangles.
    linked
        (T, 3) as `TriangleMesh.neighbours`: edges with −1 are not joined.
    layout
        Changed in place.
    """
    refused: set[tuple[int, ...]] = set()
    for _ in range(_ROUNDS):
        first = np.full(int(layout.island.max()) + 1, len(layout.island), np.int64)
        np.minimum.at(first, layout.island, np.arange(len(layout.island)))
        sizes = np.bincount(layout.island)
        borders = _borders(mesh, linked, layout)
        taken: set[int] = set()
        tries: list[tuple[tuple[int, ...], IntArray]] = []
        for (a, b), edges in zip(borders.pair.tolist(), borders.edges, strict=True):
            name = (int(first[a]), int(first[b]), int(sizes[a]), int(sizes[b]), int(edges[0]))
            if a not in taken and b not in taken and name not in refused:
                taken |= {a, b}
                tries.append((name, edges))
        joined = _joined(mesh, linked, layout, [edges for _, edges in tries])
        refused |= {name for (name, _), done in zip(tries, joined, strict=True) if not done}
        if not any(joined):
            break


def _borders(mesh: TriangleMesh, linked: IntArray, layout: Layout) -> _Borders:
    """Find borders along which one island could be moved to another."""
    lengths = np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=2).ravel()
    outline = np.bincount(np.repeat(layout.island, 3), np.where(layout.across.ravel() < 0, lengths, 0.0))
    other = layout.island[linked // 3]
    own = np.repeat(layout.island[:, None], 3, axis=1)
    edges = np.flatnonzero(((linked >= 0) & (own < other)).ravel()).astype(np.int32)
    count = len(outline)
    pair = own.ravel()[edges].astype(np.int64) * count + other.ravel()[edges]
    triangle, k = edges // 3, edges % 3
    ends = np.stack([mesh.triangles[triangle, k], mesh.triangles[triangle, (k + 1) % 3]], axis=1)
    nodes = np.unique((pair[:, None] * len(mesh.positions) + ends).ravel(), return_inverse=True)[1]
    chain = np.empty(len(edges), np.int32)
    chains = number_links(nodes.reshape(-1, 2).astype(np.int32), chain)
    length = np.bincount(chain, lengths[edges], chains)
    one = np.zeros(chains, np.int64)
    one[chain] = pair
    a, b = (one // count).astype(np.int32), (one % count).astype(np.int32)
    share = length / np.maximum(np.minimum(outline[a], outline[b]), 1e-300)
    sizes = np.bincount(layout.island)
    fits = _misfits(layout, linked, edges, chain, chains) <= _MOST_MISFIT
    able = fits & (share >= _LEAST_SHARE) & (sizes[a] + sizes[b] <= _MOST_TRIANGLES)
    best = np.flatnonzero(able)
    best = best[np.argsort(-share[best], kind="stable")]
    order = np.argsort(chain, kind="stable")
    starts = np.searchsorted(chain[order], np.arange(chains + 1))
    found = [edges[order[starts[c] : starts[c + 1]]] for c in best]
    return _Borders(np.stack([a[best], b[best]], axis=1), found)


def _misfits(layout: Layout, linked: IntArray, edges: IntArray, chain: IntArray, chains: int) -> FloatArray:
    """Return the least distance between the two sides of each border, (chains,), relative to its length."""
    here = layout.parameters[..., 0] + 1j * layout.parameters[..., 1]
    far = linked.ravel()[edges]
    z = np.concatenate([here[edges // 3, edges % 3], here[edges // 3, (edges % 3 + 1) % 3]])
    w = np.concatenate([here[far // 3, (far % 3 + 1) % 3], here[far // 3, far % 3]])
    twice = np.concatenate([chain, chain])

    def summed(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(twice, values, chains), np.float64)

    count = summed(np.ones(len(twice)))
    for values in (z, w):
        values -= ((summed(values.real) + 1j * summed(values.imag)) / count)[twice]
    product = z.conj() * w
    both = np.abs(summed(product.real) + 1j * summed(product.imag))
    one, other = summed(np.abs(z) ** 2), summed(np.abs(w) ** 2)
    return np.asarray(np.sqrt(np.maximum(one + other - 2 * both, 0.0) / np.maximum(one, 1e-300)))


def _joined(mesh: TriangleMesh, linked: IntArray, layout: Layout, tries: list[IntArray]) -> list[bool]:
    """Join islands whose union is good, in parallel; return which were joined."""
    across, island = layout.across.copy(), layout.island
    into = np.arange(int(island.max()) + 1)
    for edges in tries:
        far = linked.ravel()[edges]
        across.reshape(-1)[edges], across.reshape(-1)[far] = far, edges
        into[island[far[0] // 3]] = island[edges[0] // 3]
    pieces = {int(island[edges[0] // 3]): number for number, edges in enumerate(tries)}
    used = np.isin(into[island], list(pieces))
    whole = list(pieces_of(across, used))
    flats: list[Flat | None] = [None] * len(whole)

    def lay(number: int) -> None:
        own = whole[number].triangles
        if whole[number].handles == 0 and whole[number].loops > 0:
            flats[number] = flatten(
                whole[number], mesh.corners[own], mesh.areas[own], mesh.flat_normals[own], 1
            )

    run_tasks([partial(lay, number) for number in range(len(whole))])
    done = [False] * len(tries)
    for piece, flat in zip(whole, flats, strict=True):
        if flat is not None and _is_better(flat, piece, layout):
            number = pieces[int(into[island[piece.triangles[0]]])]
            done[number] = True
            edges = tries[number]
            far = linked.ravel()[edges]
            layout.across.reshape(-1)[edges], layout.across.reshape(-1)[far] = far, edges
            layout.parameters[piece.triangles] = flat.parameters
        else:
            into[island[piece.triangles]] = island[piece.triangles]
    layout.island[:] = np.unique(into[island], return_inverse=True)[1]
    return done


def _is_better(flat: Flat, piece: Piece, layout: Layout) -> bool:
    if not (flat.good and max(flat.spread, flat.stretch) <= _MOST_UNEVEN):
        return False
    before = 0.0
    own = layout.island[piece.triangles]
    for part in np.unique(own):
        before += float(np.ptp(layout.parameters[piece.triangles[own == part]], axis=(0, 1)).prod())
    return float(np.ptp(flat.parameters, axis=(0, 1)).prod()) <= _MOST_WASTE * before
