"""Models and textures that the tests of `upholster.model.render` look at."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Model = tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]


def grid_triangles(rows: int, columns: int) -> NDArray[np.int64]:
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a = (i * (columns + 1) + j).reshape(-1)
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def sphere(radius: float = 1.0, center: tuple[float, float, float] = (0, 0, 0), cells: int = 96) -> Model:
    """Return a sphere whose vertices lie on it: columns go round, rows from north to south."""
    polar, round_ = np.meshgrid(
        np.linspace(0, np.pi, cells + 1), np.linspace(0, 2 * np.pi, 2 * cells + 1), indexing="ij"
    )
    normals = np.stack(
        [np.sin(polar) * np.cos(round_), np.sin(polar) * np.sin(round_), np.cos(polar)], axis=-1
    )
    uv = np.stack([round_ / (2 * np.pi), polar / np.pi], axis=-1)
    normals = normals.reshape(-1, 3)
    return radius * normals + np.array(center), normals, uv.reshape(-1, 2), grid_triangles(cells, 2 * cells)


def sheet(width: float = 1.0, height: float = 1.0, y: float = 0.0, cells: int = 4) -> Model:
    """Return an upright rectangle that faces -y, the camera at view (0, 0): u to the right, v downward."""
    v, u = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1), indexing="ij")
    positions = np.stack([width * (u - 0.5), np.full_like(u, y), height * (0.5 - v)], axis=-1).reshape(-1, 3)
    normals = np.tile([0.0, -1.0, 0.0], (len(positions), 1))
    return positions, normals, np.stack([u, v], axis=-1).reshape(-1, 2), grid_triangles(cells, cells)


def joined(*models: Model) -> Model:
    """Return several models as one."""
    starts = np.cumsum([0] + [len(model[0]) for model in models])
    return (
        np.concatenate([model[0] for model in models]),
        np.concatenate([model[1] for model in models]),
        np.concatenate([model[2] for model in models]),
        np.concatenate([model[3] + start for model, start in zip(models, starts, strict=False)]),
    )


def checker(cells: int, size: int, *, channels: int = 3) -> NDArray[np.float32]:
    """Return a checkerboard, linear: 0.1 and 0.5."""
    square = np.indices((size, size)) // (size // cells)
    board = np.where(square.sum(axis=0) % 2 == 0, 0.1, 0.5).astype(np.float32)
    return np.repeat(board[..., None], channels, axis=2)
