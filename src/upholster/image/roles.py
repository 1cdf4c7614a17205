"""Which map of a material a file holds, by its name: the common variants of texture libraries."""

import re
from collections.abc import Iterable
from pathlib import Path

from upholster.errors import InputError, nearest
from upholster.image.write import IMAGE_SUFFIXES

__all__ = ["ROLES", "find_maps", "role_of"]

ROLES = ("albedo", "normal", "roughness", "metallic", "ao", "height", "opacity", "emission")
"""What a material's map may be."""

_NAMES = {
    "albedo": "albedo basecolor basecolour diffuse diff color colour col",
    "normal": "normal nor nrm norm normalmap normalgl normalopengl norgl",
    "normal_dx": "normaldx normaldirectx nordx",
    "roughness": "roughness rough",
    "gloss": "gloss glossiness",
    "metallic": "metallic metalness metal",
    "ao": "ao ambientocclusion occlusion occ",
    "height": "height heightmap displacement disp",
    "opacity": "opacity alpha",
    "emission": "emission emissive emit",
    "arm": "arm orm",
}
"""Spellings, without case and separators; the names that are no roles are forms of some that are."""

_ROLE_BY_NAME = {name: role for role, names in _NAMES.items() for name in names.split()}

_DETAIL = re.compile(r"\d{1,2}k|\d{3,5}|\d{1,2}bit|png|jpg|jpeg|exr|tif|tiff|webp")
"""What libraries put behind the role: resolution, depth, format."""


def role_of(name: str) -> str | None:
    """Return which map a file name or a role's name stands for, None if it tells nothing.

    Parameters
    ----------
    name
        As ``brick_wall_nor_gl_1k.png`` or ``Bricks102_4K-JPG_AmbientOcclusion.jpg``: the last words count.

    Returns
    -------
    str or None
        One of `ROLES`; "normal_dx" (green downward), "gloss" (1 − roughness), or "arm" (occlusion, roughness
        and metallic in one image).
    """
    words = re.sub(r"([a-z])(?=[A-Z])|(\d)(?=[A-Z][a-z])", r"\1\2 ", name)
    tokens = [word for word in re.split(r"[^a-z0-9]+", words.lower()) if word]
    while len(tokens) > 1 and _DETAIL.fullmatch(tokens[-1]):
        tokens.pop()
    for count in (3, 2, 1):
        role = _ROLE_BY_NAME.get("".join(tokens[-count:]))
        if role is not None and count <= len(tokens):
            return role
    return None


def find_maps(files: Iterable[Path]) -> dict[str, Path]:
    """Tell a material's files apart by their names.

    Files that are no images are skipped. One whose name all the others start with is the albedo if there
    is no other, else a preview, and skipped too. Of a normal map in both conventions the OpenGL one is taken.

    Returns
    -------
    dict
        Files by role, as `role_of` has it.

    Raises
    ------
    InputError
        If a name tells no role, or two files have one.
    """
    images = sorted(file for file in files if file.suffix.lower() in IMAGE_SUFFIXES)
    found: dict[str, Path] = {}
    unknown = []
    for file in images:
        role = role_of(file.stem)
        if role is None:
            unknown.append(file)
        elif role in found:
            raise InputError(
                f"material has two files of role {role!r}: {found[role].name!r} and {file.name!r}"
            )
        else:
            found[role] = file
    for file in unknown:
        if not found or not all(other.stem.startswith(file.stem) for other in found.values()):
            raise InputError(f"role of {file.name!r} is unknown; {nearest(file.stem, ROLES)}")
        found.setdefault("albedo", file)
    if "normal" in found:
        found.pop("normal_dx", None)
    return found
