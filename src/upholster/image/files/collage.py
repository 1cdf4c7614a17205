"""Several samples in one image, so that one quilt can read them all."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel, from_linear, to_linear
from upholster.image.files.material import Material
from upholster.image.numbers import as_depth, top_of
from upholster.image.photo.preparation import MAX_SIDE
from upholster.image.roles import COLORS, MAP_ROLES, ROLES

__all__ = ["Rectangle", "combined", "in_form_of"]

Rectangle = tuple[int, int, int, int]
"""Row, column, height and width in pixels."""

_ALIGNED = 64
"""Samples begin at multiples of this: at a whole pixel of every pyramid level that matters."""


def combined(samples: Sequence[Material]) -> tuple[Material, tuple[Rectangle, ...]]:
    """Return one material with all samples side by side, and the rectangle of each in it.

    It has every map that any of them has, each at the depth of the first sample that has it. Pixels that no
    sample covers are not used.

    Raises
    ------
    InputError
        If all samples together are larger than a sample may be.
    """
    rectangles, column = [], 0
    for sample in samples:
        height, width = sample.shape
        rectangles.append((0, column, height, width))
        column += -(-width // _ALIGNED) * _ALIGNED
    height, width = max(one[2] for one in rectangles), sum(rectangles[-1][1::2])
    if width > MAX_SIDE:
        raise InputError(
            f"samples are {width} pixels wide side by side; allowed: up to {MAX_SIDE}, so make them smaller"
        )
    used = np.zeros((height, width), np.bool_)
    for sample, (row, left, tall, wide) in zip(samples, rectangles, strict=True):
        used[row : row + tall, left : left + wide] = True if sample.used is None else sample.used
    maps = {}
    for role in (role for role in ROLES if any(role in sample.maps for sample in samples)):
        parts = _alike(role, samples)
        image = np.zeros((height, width, parts[0].shape[2]), parts[0].dtype)
        for part, (row, left, tall, wide) in zip(parts, rectangles, strict=True):
            image[row : row + tall, left : left + wide] = part
        maps[role] = image
    notes = tuple(note for sample in samples for note in sample.notes)
    return Material(maps, notes, used), tuple(rectangles)


def in_form_of(sample: PixelArray | Material, like: Mapping[str, PixelArray]) -> Material:
    """Return a sample with the same maps as `like`, each with its channels and depth.

    Raises
    ------
    InputError
        If it lacks a map, or is coloured where `like` is grey.
    """
    own = sample.maps if isinstance(sample, Material) else {"albedo": sample}
    maps = {}
    for role, wanted in like.items():
        if role not in own:
            raise InputError(f"sample has no {role}; allowed: one with all of {', '.join(like)}")
        maps[role] = _in_form(role, own[role], wanted)
    return Material(maps, used=sample.used if isinstance(sample, Material) else None)


def _in_form(role: str, pixels: PixelArray, like: PixelArray) -> PixelArray:
    alpha = alpha_channel(like.shape[2])
    colors = like.shape[2] if alpha is None else alpha
    if pixels.shape[2] > 2 and colors == 1:
        raise InputError(f"{role} of the sample is coloured, and that of the photo grey; allowed: a grey one")
    pixels = _at_depth(role, pixels, like.dtype)
    return np.ascontiguousarray(_with_channels(pixels, colors, alpha is not None))


def _at_depth(role: str, pixels: PixelArray, dtype: np.dtype[Any]) -> PixelArray:
    # Integer colours are sRGB-coded, floats are linear.
    if role in COLORS and pixels.dtype.kind != dtype.kind:
        pixels = from_linear(to_linear(pixels), dtype)
    return as_depth(pixels, dtype)


def _alike(role: str, samples: Sequence[Material]) -> list[PixelArray]:
    # One map of all samples, at one depth, with as many channels as the sample that has most.
    dtype = next(sample.maps[role].dtype for sample in samples if role in sample.maps)
    parts = [_at_depth(role, sample.maps[role], dtype) if role in sample.maps else None for sample in samples]
    known = [part for part in parts if part is not None]
    colors = max(part.shape[2] - (alpha_channel(part.shape[2]) is not None) for part in known)
    alpha = any(alpha_channel(part.shape[2]) is not None for part in known)
    return [
        _neutral(role, sample.shape, dtype, colors) if part is None else _with_channels(part, colors, alpha)
        for part, sample in zip(parts, samples, strict=True)
    ]


def _neutral(role: str, shape: tuple[int, int], dtype: np.dtype[Any], channels: int) -> PixelArray:
    # A map that this sample lacks, and another has.
    unit = np.empty((*shape, channels))
    unit[:] = MAP_ROLES[role].neutral
    scaled = unit * top_of(dtype)
    return (scaled if dtype.kind == "f" else np.rint(scaled)).astype(dtype)


def _with_channels(pixels: PixelArray, colors: int, alpha: bool) -> PixelArray:
    # Grey becomes colour where another sample has colours; a map without alpha is opaque.
    own = alpha_channel(pixels.shape[2])
    plain = pixels if own is None else pixels[:, :, :own]
    if plain.shape[2] != colors:
        plain = plain.repeat(colors, axis=2)
    if not alpha:
        return plain
    opaque = np.full((*pixels.shape[:2], 1), top_of(pixels.dtype), pixels.dtype)
    return np.concatenate([plain, opaque if own is None else pixels[:, :, own:]], axis=2)
