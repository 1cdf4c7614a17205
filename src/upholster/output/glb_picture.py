"""Pictures of an existing GLB: everything in it, drawn without synthesis."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.geometry.gltf.accessors import Accessors
from upholster.geometry.gltf.gltf import Gltf, Json
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.gltf_nodes import mesh_placements
from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.model_files.model_reader import read_model
from upholster.image.color import from_linear, to_linear
from upholster.image.files.read import read_image_data
from upholster.image.roles import MAP_ROLES
from upholster.model.render.picture import render

__all__ = ["SHEET", "ShownModel", "redrawn", "shown_model"]

SHEET = ((30.0, 30.0), (120.0, 30.0), (210.0, 30.0), (300.0, 30.0))
"""The views of a sheet, as for `Camera.fit`."""

_GUTTER = 16
"""Texels around each image, because the renderer's mip levels reach that far."""

_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From glTF's axes, y up, to ours, z up."""

_GREY = 200
"""Red, green and blue of a part whose file says nothing of its colour."""

_MOST_TRIANGLES = MAX_TRIANGLES
"""Greatest number of triangles in a picture, of all placements together."""

_DATA = ("normal", "roughness", "metallic", "ao")
"""Roles of maps other than the colour."""


@dataclass(frozen=True, eq=False)
class ShownModel:
    """All triangles of a file at all of their places, z up, and its images, stacked vertically.

    Attributes
    ----------
    corners, normals
        (N, 3, 3) float64: position and normal of each triangle's corners.
    uv
        (N, 3, 2) float64: places in the images, in texels, (0, 0) being the corner of the first one.
    color
        (H, W, 4) uint8, sRGB-coded.
    maps
        The other maps, of the colour's height and width.
    left
        Number of placements that are left out: beyond four million triangles.
    """

    corners: FloatArray
    normals: FloatArray
    uv: FloatArray
    color: PixelArray
    maps: Mapping[str, PixelArray]
    left: int = 0


def redrawn(
    path: str | os.PathLike[str],
    views: Sequence[tuple[float, float]],
    *,
    size: tuple[int, int] = (1024, 768),
    supersample: int = 2,
    notes: list[str] | None = None,
) -> list[NDArray[np.float32]]:
    """Draw a GLB or glTF file from several sides.

    Base colour, alpha, normals, roughness, metalness and occlusion are shown, of all meshes at all of their
    places.

    Parameters
    ----------
    path
        The file.
    views
        Azimuth and elevation of each picture, in degrees.
    size
        (width, height) of each picture in pixels.
    supersample
        As for `upholster.model.render.picture.render`.
    notes
        A list that gets what a user should know.

    Returns
    -------
    list of ndarray
        (height, width, 3) each, linear light.

    Raises
    ------
    InputError, FormatError
        If the file is not glTF, or cannot be read.
    """
    model = shown_model(path)
    if model.left and notes is not None:
        lacking = number_of(model.left, "instance")
        notes.append(f"the picture lacks {lacking}: with them it would have too many triangles")
    corners, normals = model.corners.reshape(-1, 3), model.normals.reshape(-1, 3)
    height, width = model.color.shape[:2]
    return [
        render(
            corners,
            normals,
            model.uv.reshape(-1, 2) / (width, height),
            np.arange(len(corners)).reshape(-1, 3),
            model.color,
            maps=model.maps,
            tangents=_tangents(model.corners, model.uv) if "normal" in model.maps else None,
            size=size,
            view=view,
            supersample=supersample,
        )
        for view in views
    ]


def shown_model(path: str | os.PathLike[str]) -> ShownModel:
    """Read everything that a GLB or glTF file shows.

    Raises
    ------
    InputError, FormatError
        If the file is not glTF, or cannot be read.
    """
    model = read_model(path)
    if model.gltf is None or not model.gltf_parts:
        raise InputError(f"model {os.fspath(path)!r} has no glTF materials; allowed: .glb, .gltf")
    images = _Images(model.gltf)
    uv = np.zeros((len(model.mesh.triangles), 3, 2)) if model.uv is None else np.nan_to_num(model.uv)
    for number, part in enumerate(model.gltf_parts):
        mine = model.mesh.part == number
        primitive = model.gltf.item("meshes", part.mesh)["primitives"][part.primitive]
        uv[mine] = images.placed(primitive.get("material"), uv[mine])
    corners, normals, uv, left = _everywhere(model, uv)
    color = images.stacked("color", (255, 255, 255, 255))
    return ShownModel(corners, normals, uv, color, images.maps(), left)


def part_colors(model: ModelFile) -> NDArray[np.uint8]:
    """Return the mean colour (3) that each part has in its file, sRGB-coded; light grey if it has none."""
    out = np.full((len(model.parts), 3), _GREY, np.uint8)
    if model.gltf is not None:
        images = _Images(model.gltf)
        for number, place in enumerate(model.gltf_parts):
            primitive = model.gltf.item("meshes", place.mesh)["primitives"][place.primitive]
            if "material" in primitive:
                out[number] = images.mean(primitive["material"])
    elif model.colors is not None:
        for number in range(len(model.parts)):
            own = model.colors[model.mesh.part == number]
            if len(own) and np.isfinite(own).all():
                out[number] = np.rint(255 * np.clip(own.mean(axis=(0, 1)), 0, 1))
    return out


def _everywhere(model: ModelFile, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return corners, their normals and places in the images, (N, 3, …), of all parts at all their places.

    The last number is that of the placements that would exceed the limit of triangles.
    """
    assert model.gltf is not None
    mesh = model.mesh
    corners = mesh.positions[mesh.triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.repeat(flat[:, None], 3, axis=1) if mesh.normals is None else mesh.normals
    found = [(corners, normals, uv)]
    room, left = _MOST_TRIANGLES - len(corners), 0
    standing = {placement.mesh: placement for placement in mesh_placements(model.gltf, Accessors(model.gltf))}
    for number, part in enumerate(model.gltf_parts):
        mine, placement = mesh.part == number, standing[part.mesh]
        count = int(mine.sum())
        fitting = placement.others[: max(0, room) // max(1, count)]
        left += len(placement.others) - len(fitting)
        room -= count * len(fitting)
        for other in fitting:
            matrix = _UP @ other @ np.linalg.pinv(placement.matrix) @ _UP.T
            turn = np.linalg.pinv(matrix[:3, :3])
            found.append((corners[mine] @ matrix[:3, :3].T + matrix[:3, 3], normals[mine] @ turn, uv[mine]))
    joined = [np.concatenate(parts) for parts in zip(*found, strict=True)]
    return joined[0], joined[1], joined[2], left


def _tangents(corners: FloatArray, uv: FloatArray) -> FloatArray:
    """Return the direction of increasing u, for each corner of each triangle: (3N, 3)."""
    (a, b), (s, t) = ((each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]) for each in (corners, uv))
    along = a * t[:, 1:] - b * s[:, 1:]
    turned = np.sign(s[:, 0] * t[:, 1] - t[:, 0] * s[:, 1])
    tangents: FloatArray = np.repeat(along * turned[:, None], 3, axis=0)
    return tangents


class _Images:
    """The images of a file's materials, those of each role stacked in one image."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._read: dict[int, PixelArray] = {}
        self._slots: dict[int | None, tuple[int, dict[str, PixelArray]]] = {}
        self.shape = np.zeros(2, int)

    def placed(self, material: object, uv: FloatArray) -> FloatArray:
        """Return texture coordinates (N, 3, 2) of a material in texels of the stacked images."""
        key = material if type(material) is int else None
        if key not in self._slots:
            looks = self._looks({} if key is None else self._gltf.item("materials", key))
            height, width = looks["color"].shape[:2]
            self._slots[key] = int(self.shape[0]), looks
            self.shape = np.array(
                [self.shape[0] + height + 2 * _GUTTER, max(self.shape[1], width + 2 * _GUTTER)]
            )
        top, looks = self._slots[key]
        height, width = looks["color"].shape[:2]
        uv = np.clip(uv - np.floor(uv.min(axis=1, keepdims=True)) * (np.abs(uv - 0.5) > 0.501).any(), 0, 1)
        return uv * (width, height) + (_GUTTER, top + _GUTTER)

    def mean(self, material: int) -> NDArray[np.uint8]:
        """Return the mean colour (3) of a material."""
        pixels = self._looks(self._gltf.item("materials", material))["color"][:, :, :3]
        mean = to_linear(pixels).mean(axis=(0, 1), keepdims=True)
        return np.asarray(from_linear(mean, "uint8")[0, 0], np.uint8)

    def maps(self) -> dict[str, PixelArray]:
        """Return the maps that at least one material has."""
        return {
            role: self.stacked(role, tuple(round(255 * share) for share in MAP_ROLES[role].neutral))
            for role in _DATA
            if any(role in looks for _, looks in self._slots.values())
        }

    def stacked(self, role: str, missing: tuple[int, ...]) -> PixelArray:
        """Return all images of a role, stacked vertically."""
        out = np.empty((*self.shape, len(missing)), np.uint8)
        out[:] = missing
        for top, looks in self._slots.values():
            height, width = looks["color"].shape[:2]
            if role not in looks:
                continue
            found = looks[role]
            rows = np.clip(np.arange(-_GUTTER, height + _GUTTER), 0, height - 1) * found.shape[0] // height
            columns = np.clip(np.arange(-_GUTTER, width + _GUTTER), 0, width - 1) * found.shape[1] // width
            out[top : top + len(rows), : len(columns)] = found[rows[:, None], columns]
        return out

    def _looks(self, material: Json) -> dict[str, PixelArray]:
        """Return a material's images by role; each is uint8; those from constant factors are 4 x 4."""
        surface = material.get("pbrMetallicRoughness", {})
        factor = [*surface.get("baseColorFactor", ()), 1.0, 1.0, 1.0, 1.0][:4]
        color = self._image(surface.get("baseColorTexture"), colors=True)
        shade = np.array([1.055 * max(0.0031308, f) ** (1 / 2.4) - 0.055 for f in factor[:3]] + [factor[3]])
        if color is None:
            color = np.full((4, 4, 4), 255, np.uint8)
        looks: dict[str, PixelArray] = {"color": np.rint(color * np.clip(shade, 0, 1)).astype(np.uint8)}
        if material.get("alphaMode", "OPAQUE") == "OPAQUE":
            looks["color"][:, :, 3] = 255
        packed = self._image(surface.get("metallicRoughnessTexture"))
        for role in ("roughness", "metallic"):
            share = np.clip(float(surface.get(f"{role}Factor", 1.0)), 0, 1)
            own = np.full((4, 4), 255) if packed is None else packed[:, :, MAP_ROLES[role].channel]
            looks[role] = np.rint(share * own).astype(np.uint8)[:, :, None]
        if (open_ := self._image(material.get("occlusionTexture"))) is not None:
            looks["ao"] = open_[:, :, :1]
        if (normal := self._image(material.get("normalTexture"))) is not None:
            looks["normal"] = normal[:, :, :3]
        return looks

    def _image(self, entry: Any, *, colors: bool = False) -> PixelArray | None:
        """Return a texture's pixels, (h, w, 4) uint8; None if there is none."""
        if not isinstance(entry, dict):
            return None
        texture = self._gltf.item("textures", entry.get("index"))
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {})
        index = webp.get("source", texture.get("source"))
        if index not in self._read:
            image = self._gltf.item("images", index)
            view = image.get("bufferView")
            if view is None:
                data = self._gltf.resource(image.get("uri"))
            else:
                data = bytes(self._gltf.view_of(self._gltf.item("bufferViews", view)))
            pixels = read_image_data(data, f"image {index}", colors=colors)
            if pixels.dtype != np.uint8:
                pixels = (pixels >> 8 if pixels.dtype == np.uint16 else 255 * pixels).astype(np.uint8)
            alpha = pixels[:, :, -1:] if pixels.shape[2] in (2, 4) else np.full_like(pixels[:, :, :1], 255)
            shown = pixels[:, :, :3] if pixels.shape[2] >= 3 else np.repeat(pixels[:, :, :1], 3, axis=2)
            self._read[index] = np.concatenate([shown, alpha], axis=2)
        return self._read[index]
