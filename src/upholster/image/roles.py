"""The roles of a material's maps, and the role of a file from its name, as texture libraries spell it."""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, TypeVar

from upholster.base.errors import InputError, nearest

__all__ = [
    "COLORS",
    "DEFAULT_ROUGHNESS",
    "LEFT_OUT",
    "MAP_ROLES",
    "ROLES",
    "MapRole",
    "family_of",
    "find_maps",
    "packed_parts",
    "role_of",
]

DEFAULT_ROUGHNESS = 0.8
"""Roughness of a material without a roughness map, from 0 to 1."""


@dataclass(frozen=True, slots=True)
class MapRole:
    """What is the same for all maps of one role.

    Attributes
    ----------
    name
        The role.
    spellings
        Words for it in file names, without case and separators.
    letter
        The same as the last letter of Unreal's names, as in ``T_Wall_D``; '' if there is none.
    channels
        Numbers of channels that such a map may have.
    is_color
        Whether its integers are sRGB-coded; other maps hold plain numbers.
    neutral
        The value, from 0 to 1, where a material has no such map: one number, or one for each channel.
    match_weight
        Weight of its squared differences in matching, where the albedo's count 1.
    gltf
        Where glTF has its texture; '' if it has no place for it.
    channel
        Its channel of a texture that it shares with other maps, as glTF packs them; None if it has its own.
    mtl
        How MTL refers to it: factors, then the word before the file; () if there is no word that programs
        agree on.
    is_sharp
        Whether its values are mostly one or the other, so that painting adds no tones to them.
    delay
        How much later than colour and normals it may come in a stream: the eye misses it less.
    """

    name: str
    spellings: str
    letter: str = ""
    channels: tuple[int, ...] = (1,)
    is_color: bool = False
    neutral: tuple[float, ...] = (0.0,)
    match_weight: float = 0.0
    gltf: str = ""
    channel: int | None = None
    mtl: tuple[str, ...] = ()
    is_sharp: bool = False
    delay: float = 1.0


_METAL_ROUGH = "metallicRoughnessTexture"

MAP_ROLES: Mapping[str, MapRole] = MappingProxyType(
    {
        role.name: role
        for role in (
            MapRole(
                "albedo", "albedo basecolor basecolour diffuse diff color colour col bc", "d",
                channels=(1, 2, 3, 4), is_color=True, match_weight=1.0,
                gltf="baseColorTexture", mtl=("map_Kd",),
            ),
            MapRole(
                "normal", "normal nor nrm norm normalmap", "n",
                channels=(3,), neutral=(0.5, 0.5, 1.0), match_weight=0.5,
                gltf="normalTexture", mtl=("norm",),
            ),
            MapRole(
                "roughness", "roughness rough", "r",
                neutral=(DEFAULT_ROUGHNESS,), match_weight=0.25,
                gltf=_METAL_ROUGH, channel=1, mtl=("Pr 1", "map_Pr"), delay=1.5,
            ),
            MapRole(
                "metallic", "metallic metalness metal", "m",
                match_weight=0.25,
                gltf=_METAL_ROUGH, channel=2, mtl=("Pm 1", "map_Pm"), is_sharp=True, delay=1.5,
            ),
            MapRole(
                "ao", "ao ambientocclusion occlusion occ",
                neutral=(1.0,), gltf="occlusionTexture", channel=0, delay=2.0,
            ),
            MapRole(
                "height", "height heightmap displacement disp", "h",
                neutral=(0.5,), match_weight=0.5, delay=2.0,
            ),
            MapRole(
                "opacity", "opacity alpha",
                neutral=(1.0,), match_weight=1.0, channel=3, is_sharp=True, delay=1.5,
            ),
            MapRole(
                "emission", "emission emissive emit", "e",
                channels=(1, 3), is_color=True, match_weight=0.5,
                gltf="emissiveTexture", mtl=("Ke 1 1 1", "map_Ke"),
            ),
        )
    }
)  # fmt: skip
"""All roles by name, the albedo first.

Match weights: normal and height show where a stone ends as well as colour does, and twice; roughness and
metallic follow it mostly; occlusion adds nothing to the height.
"""

ROLES = tuple(MAP_ROLES)
"""Names of the roles, the albedo first."""

COLORS = tuple(role.name for role in MAP_ROLES.values() if role.is_color)
"""Roles whose integers are sRGB-coded; those of the others are plain numbers."""

LEFT_OUT = "left out"
"""`role_of` returns this for maps that nothing here uses."""

_NAMES = {
    **{role.name: role.spellings for role in MAP_ROLES.values()},
    "normal_gl": "normalgl normalopengl norgl",
    "normal_dx": "normaldx normaldirectx nordx",
    "gloss": "gloss glossiness smoothness",
    "+roughness+metallic": "metallicroughness",
    "metallic+++gloss": "metallicsmoothness metallicgloss",
    "metallic+ao++gloss": "maskmap",
    LEFT_OUT: "cavity specular spec specularlevel curvature bump mask id idmap fuzz sheen translucency "
    "translucent transmission scattering subsurface sss thickness anisotropy anisotropylevel "
    "anisotropyrotation clearcoat bentnormal ior preview thumb thumbnail brush",
}
"""Spellings, without case and separators; `role_of` describes the names that are not roles."""

_ROLE_BY_NAME = {name: role for role, names in _NAMES.items() for name in names.split()}

_LETTERS = {role.letter: role.name for role in MAP_ROLES.values() if role.letter} | {"s": LEFT_OUT}
"""Unreal's suffixes, as in ``T_Wall_D``."""

_PACKED_LETTERS = {"ao": "ao", "a": "ao", "o": "ao", "r": "roughness", "m": "metallic"}
_PACKED_LETTERS |= {"h": "height", "d": "height"}
_PACKED_WORD = "ambientocclusion|occlusion|occ|ao|roughness|rough|metallic|metalness|metal"

_DETAIL = re.compile(r"\d{1,2}k|\d{3,5}|\d{1,2}bit|lod\d|png|jpg|jpeg|exr|tif|tiff|webp")
"""Words that libraries put after the role: resolution, depth, level of detail, format."""


class NamedFile(Protocol):
    """A file's name, without folders."""

    @property
    def name(self) -> str:
        """For example ``brick_diff_1k.png``."""
        ...


File = TypeVar("File", bound=NamedFile)


def role_of(name: str) -> str | None:
    """Return the role that a file name or a role's name stands for, None if there is none in it.

    Parameters
    ----------
    name
        Without suffix, as ``brick_wall_nor_gl_1k`` or ``Bricks102_4K-JPG_AmbientOcclusion``: the last words
        count.

    Returns
    -------
    str or None
        One of `ROLES`; "normal_gl" or "normal_dx" if the name gives the convention (green upward or
        downward); "gloss" (1 − roughness); for several maps in one image the contents of its channels, joined
        by "+", as in "ao+roughness+metallic" (an empty name: the channel is not used); or `LEFT_OUT`.
    """
    words = re.sub(r"([a-z])(?=[A-Z])|(\d)(?=[A-Z][a-z])", r"\1\2 ", name)
    tokens = [word for word in re.split(r"[^a-z0-9]+", words.lower()) if word]
    while len(tokens) > 1 and _DETAIL.fullmatch(tokens[-1]):
        tokens.pop()
    if not tokens:
        return None
    packed = _packed_words("".join(tokens)) or _packed_letters(tokens[-1])
    if packed:
        return packed
    for count in (3, 2, 1):
        role = _ROLE_BY_NAME.get("".join(tokens[-count:]))
        if role is not None and count <= len(tokens):
            return role
    if len(tokens) == 1:
        return None
    role = _LETTERS.get(tokens[-1])
    # Unreal's textures are named T_Wall_N, and their green points down.
    return "normal_dx" if role == "normal" and tokens[0] == "t" else role


def packed_parts(role: str) -> tuple[str, ...]:
    """Return the role of each channel of a packed image, "" for unused ones; () for other roles."""
    return tuple(role.split("+")) if "+" in role else ()


def family_of(role: str) -> str:
    """Return the member of `ROLES` that a file ends up as; a packed image is its own family."""
    return {"normal_gl": "normal", "normal_dx": "normal", "gloss": "roughness"}.get(role, role)


def find_maps(files: Iterable[File], *, taken: Collection[str] = ()) -> tuple[dict[str, File], list[str]]:
    """Find the role of each of a material's files from its name.

    A file whose name all others start with is the albedo if there is no other, else a preview, and left out.
    Colours with alpha (``brick-diffuse-alpha.png``) are the albedo if there is no other, else the opacity.
    An OpenGL normal map is preferred to a DirectX one, and roughness to gloss.

    Parameters
    ----------
    files
        The images.
    taken
        Families (see `family_of`) that need no file.

    Returns
    -------
    dict
        Files by role, as `role_of` returns it.
    list
        Notes: the files left out, in words.

    Raises
    ------
    InputError
        If a name gives no role, or two files have the same one.
    """
    found: dict[str, File] = {}
    unknown: list[File] = []
    notes = []
    for file in sorted(files, key=lambda file: file.name):
        role = role_of(_stem(file))
        if role is None:
            unknown.append(file)
        elif role == LEFT_OUT:
            notes.append(f"left out {file.name!r}: no map of that kind is used")
        elif role in found:
            raise InputError(
                f"material has two files of role {role!r}: {found[role].name!r} and {file.name!r}; "
                f"choose one with --map {role}=FILE"
            )
        elif family_of(role) not in taken:
            found[role] = file
    for file in unknown:
        if not found or not all(_stem(other).startswith(_stem(file)) for other in found.values()):
            raise InputError(
                f"role of {file.name!r} is unknown; {nearest(_stem(file), ROLES)}; or --map ROLE=FILE"
            )
        if "albedo" not in taken:
            found.setdefault("albedo", file)
    opacity = found.get("opacity")
    if opacity is not None and not {"albedo"} & {*found, *taken} and _is_albedo_with_alpha(_stem(opacity)):
        found["albedo"] = found.pop("opacity")
    for better, role in (("normal_gl", "normal"), ("normal_gl", "normal_dx"), ("normal", "normal_dx")):
        if better in found:
            found.pop(role, None)
    if "roughness" in found and "gloss" in found:
        notes.append(f"left out {found.pop('gloss').name!r}: there is a roughness map")
    return found, notes


def _is_albedo_with_alpha(name: str) -> bool:
    """Return whether a name of an opacity map gives the albedo as well."""
    words = re.split("opacity|alpha", name, flags=re.IGNORECASE)
    return len(words) > 1 and role_of(words[-2]) == "albedo"


def _packed_words(joined: str) -> str | None:
    """Return the order of channels that the last three words name, as in ``ao_rough_metal``."""
    match = re.search(rf"(?:{_PACKED_WORD}){{3,}}$", joined)
    parts = [_ROLE_BY_NAME[word] for word in re.findall(_PACKED_WORD, match[0])[-3:]] if match else []
    return "+".join(parts) if len(set(parts)) == 3 else None


def _packed_letters(word: str) -> str | None:
    """Return the order of channels that letters name, as in ORM, ARM, MRAO, ORMH; ORD has no metal."""
    if not re.fullmatch(r"(?:ao|[aormhd]){3,4}|ordp", word):
        return None
    parts = [_PACKED_LETTERS[code] for code in re.findall("ao|[aormhd]", word)]
    if len(set(parts)) != len(parts) or not {"ao", "roughness"} < set(parts):
        return None
    return "+".join(parts) if "metallic" in parts or word in ("ord", "ordp") else None


def _stem(file: NamedFile) -> str:
    return file.name.rpartition(".")[0]
