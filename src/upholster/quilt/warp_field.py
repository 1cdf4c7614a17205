"""The warp field of a chart: how a texel step maps to an exemplar-pixel step, at each place.

A field is kept in the decoder's form: quantised nodes, from which every decoder derives the same integer
matrices. Exact definition: SPEC.md, sections 3 and 8; the mathematics: `upholster.charts.directions`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray, frozen_array
from upholster.quilt._field_kernels import matrices_between, node_matrices

__all__ = [
    "ANGLES",
    "FIELD_STEP",
    "MOST_OCTAVES",
    "MOST_SHEAR",
    "OCTAVE",
    "UNIT",
    "WarpField",
    "node_count",
    "polar_nodes",
]

FIELD_STEP = 32
"""Texels between two nodes."""

UNIT = 4096
"""A matrix entry of 1 exemplar pixel per texel."""

OCTAVE = 32
"""Quantisation steps of a size per factor of two."""

ANGLES = 256
"""Quantisation steps of an angle per full turn."""

MOST_OCTAVES = 6
"""Sizes lie within 2^±6 pixels per texel."""

MOST_SHEAR = 56
"""Rows and columns stay square up to this many steps of angle, so a texel never turns inside out."""

# Rounded far from ties, so that every machine's cosine gives the same result.
_COSINES = np.rint(2**14 * np.cos(2 * np.pi * np.arange(ANGLES) / ANGLES)).astype(np.int64)
_POWERS = np.rint(2**14 * 2 ** (np.arange(OCTAVE) / OCTAVE)).astype(np.int64)


_LEAST = np.array([-OCTAVE * MOST_OCTAVES] * 2 + [0, -MOST_SHEAR], np.int16)
_GREATEST = np.array([OCTAVE * MOST_OCTAVES] * 2 + [ANGLES - 1, MOST_SHEAR], np.int16)


@dataclass(frozen=True, eq=False)
class WarpField:
    """A grid of 2×2 matrices over a chart and the apron around it, bilinear between its nodes.

    Node (i, j) is at texel (`FIELD_STEP`·(i − margin), `FIELD_STEP`·(j − margin)); beyond the grid the
    nearest border node applies. A node's matrix M maps (row, column) steps in texels to (row, column) steps
    in exemplar pixels. Its columns are stored in polar form: a step along texel columns is `a` pixels long at
    angle φ (0 is to the right, a quarter turn is down); a step along texel rows is `b` pixels long at φ + ¼
    turn + shear.

    Attributes
    ----------
    nodes
        (rows, columns, 4) int16, read-only: log2 b and log2 a in steps of 1/32 octave within ±6 octaves, φ in
        1/256 turn (0 to 255), and the shear in 1/256 turn (±56).
    margin
        Nodes before texel 0, and equally many beyond the last one: 0 to 64.

    Raises
    ------
    InputError
        For another shape or dtype, or numbers outside these ranges.
    """

    nodes: NDArray[np.int16]
    margin: int = 1

    def __post_init__(self) -> None:
        nodes = self.nodes
        if nodes.dtype != np.int16 or nodes.ndim != 3 or nodes.shape[2] != 4 or min(nodes.shape) < 1:
            raise InputError(f"field has nodes of {nodes.dtype} {nodes.shape}; allowed: int16 (n, m, 4)")
        if not 0 <= self.margin <= 64:
            raise InputError(f"field has a margin of {self.margin} nodes; allowed: 0 to 64")
        most = OCTAVE * MOST_OCTAVES
        if (nodes < _LEAST).any() or (nodes > _GREATEST).any():
            raise InputError(
                f"a field's node is out of range; allowed: sizes within ±{most}, angles 0 to {ANGLES - 1}, "
                f"shears within ±{MOST_SHEAR}"
            )
        frozen_array(np.ascontiguousarray(nodes))

    @cached_property
    def matrices(self) -> IntArray:
        """The nodes' matrices, (rows, columns, 4) int32, row by row, in 1/4096 pixel per texel.

        An entry is ``(size · cosine + 2^15) >> 16``, with
        ``size = (⌊2^14 · 2^(k mod 32 / 32)⌉ << 6 + ⌊k / 32⌋) >> 6`` for a size of k steps and the cosine or
        sine in 1/2^14, rounded.
        """
        nodes = np.array(self.nodes, order="C")
        out = np.empty(nodes.shape, np.int32)
        node_matrices(nodes, _POWERS, _COSINES, out)
        return frozen_array(out)

    @classmethod
    def identity(cls) -> "WarpField":
        """Return the field of a chart on which texel steps are exemplar-pixel steps: one node."""
        return _IDENTITY

    @cached_property
    def is_identity(self) -> bool:
        """Whether M is the identity everywhere."""
        return not self.nodes.any()

    def at(self, rows: ArrayLike, columns: ArrayLike) -> FloatArray:
        """Return M at places between texels, in exemplar pixels per texel.

        Parameters
        ----------
        rows, columns
            Numbers of one shape (…), in texels: texel (r, c) has its centre exactly at (r, c).

        Returns
        -------
        ndarray
            (…, 2, 2) float64, bilinear like a decoder's but not rounded; beyond the grid its border applies.
        """
        down, right = self.matrices.shape[:2]
        parts = []
        for places, count in ((rows, down), (columns, right)):
            place = np.clip(np.asarray(places) / FIELD_STEP + self.margin, 0, count - 1)
            low = np.minimum(place.astype(np.intp), max(count - 2, 0))
            parts.append((low, np.minimum(low + 1, count - 1), (place - low)[..., None]))
        (i, below, lower), (j, after, later) = parts
        m = self.matrices
        mixed = (1 - lower) * ((1 - later) * m[i, j] + later * m[i, after])
        mixed += lower * ((1 - later) * m[below, j] + later * m[below, after])
        found: FloatArray = mixed / UNIT
        return found.reshape(*np.shape(rows), 2, 2)

    def between(self, rows: ArrayLike, columns: ArrayLike) -> IntArray:
        """Return M at places between steps, exactly as in every decoder.

        Parameters
        ----------
        rows, columns
            Integers that broadcast together: places in 1/16 step from the chart's first edge, the middle of
            step k at 16·k + 8; beyond the grid its border applies.

        Returns
        -------
        ndarray
            (..., 4) int32, row by row, in 1/4096 pixel per step.
        """
        at = np.broadcast_arrays(np.asarray(rows, np.int64), np.asarray(columns, np.int64))
        out = np.empty((at[0].size, 4), np.int32)
        matrices_between(self.matrices, self.margin, at[0].flatten(), at[1].flatten(), out)
        return out.reshape(*at[0].shape, 4)


def polar_nodes(matrices: FloatArray) -> NDArray[np.int16]:
    """Return the nodes (…, 4), in the form of `WarpField`, nearest to matrices (…, 2, 2).

    Raises
    ------
    InputError
        If a matrix is not finite or its determinant is not positive.
    """
    m = matrices
    determinant = np.linalg.det(m) if np.isfinite(m).all() else np.zeros(1)
    if not (determinant > 0).all():
        raise InputError("a matrix of the field is not finite, or its determinant is not positive")
    down, along = m[..., :, 0], m[..., :, 1]
    sizes = OCTAVE * np.log2(np.maximum(1e-12, [np.hypot(*np.moveaxis(v, -1, 0)) for v in (down, along)]))
    angle = np.arctan2(along[..., 0], along[..., 1]) / (2 * np.pi)
    shear = np.arctan2(down[..., 0], down[..., 1]) / (2 * np.pi) - angle - 0.25
    nodes = np.empty((*m.shape[:-2], 4), np.int16)
    most = OCTAVE * MOST_OCTAVES
    nodes[..., 0], nodes[..., 1] = np.clip(np.rint(sizes), -most, most)
    nodes[..., 2] = np.rint(angle * ANGLES).astype(np.int64) % ANGLES
    nodes[..., 3] = np.clip(np.rint((shear - np.rint(shear)) * ANGLES), -MOST_SHEAR, MOST_SHEAR)
    return nodes


def node_count(texels: int, margin: int) -> int:
    """Return the number of a field's nodes for this many texels: at and around them, and in the margins."""
    return 2 * margin + -(-texels // FIELD_STEP) + 1


_IDENTITY = WarpField(np.zeros((1, 1, 4), np.int16), 0)
