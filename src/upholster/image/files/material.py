"""Materials: several maps of one shape, each at its own depth, that one quilt covers a surface with."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from upholster.base.display import on_a_line
from upholster.base.errors import InputError, nearest
from upholster.base.types import PixelArray, frozen_array
from upholster.image.color import alpha_channel, from_linear
from upholster.image.files.read import check_exemplar
from upholster.image.masks import Used, filled
from upholster.image.numbers import as_depth, to_unit
from upholster.image.roles import COLORS, MAP_ROLES, ROLES

__all__ = ["MATCH_WEIGHTS", "Material"]

MATCH_WEIGHTS: Mapping[str, float] = MappingProxyType(
    {role: MAP_ROLES[role].match_weight for role in ROLES[1:]}
)
"""Weight of each map's squared differences in matching, relative to 1 for the albedo."""


@dataclass(frozen=True, eq=False)
class Material:
    """Several maps as one.

    Attributes
    ----------
    maps
        (H, W, C) arrays by role, in the order of `upholster.image.roles.ROLES`, read-only: uint8, uint16 or
        float32, each at its own depth. Albedo (1 to 4 channels) and emission (1 or 3) are colours,
        sRGB-coded where they are integers. The others are plain numbers from 0 to 1 (integers: to the
        largest): roughness, metallic, ao, height and opacity have 1 channel; normal has 3, x to the right,
        y upward and z outward from −1 to 1, coded as (v + 1)/2.
    notes
        What the user should know about how it was read, as sentences.
    used
        (H, W) bool, which pixels are used; None: all. Unused pixels of the maps are replaced by a smooth mean
        of the nearest used ones.

    Raises
    ------
    InputError
        If the albedo is missing, a role is unknown, an array is not an image, or a shape differs from the
        albedo's; if no pixel is used.
    """

    maps: Mapping[str, PixelArray]
    notes: tuple[str, ...] = ()
    used: Used | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.maps, Mapping):
            raise InputError(f"maps are a {type(self.maps).__name__}; allowed: arrays by role")
        for role in self.maps:
            if role not in ROLES:
                raise InputError(f"role {role!r} is unknown; {nearest(str(role), ROLES)}")
        if "albedo" not in self.maps:
            raise InputError(f"material has no albedo; it has: {', '.join(self.maps) or 'nothing'}")
        checked: dict[str, PixelArray] = {}
        for role in (role for role in ROLES if role in self.maps):
            try:
                # A view: the caller's own array stays writable.
                array = check_exemplar(self.maps[role], lamp=role == "emission")[:]
            except InputError as error:
                raise InputError(f"{role}: {error}") from None
            allowed = MAP_ROLES[role].channels
            shape = checked["albedo"].shape[:2] if checked else array.shape[:2]
            if array.shape[2] not in allowed or array.shape[:2] != shape:
                raise InputError(
                    f"{role} has shape {array.shape}; allowed: ({shape[0]}, {shape[1]}, C) as the albedo, "
                    f"with C of {', '.join(map(str, allowed))}"
                )
            checked[role] = frozen_array(array)
        used = None if self.used is None else _checked_used(self.used, checked["albedo"].shape[:2])
        if used is not None:
            checked = {role: frozen_array(filled(array, used)) for role, array in checked.items()}
        object.__setattr__(self, "maps", MappingProxyType(checked))
        object.__setattr__(self, "used", used)

    def __repr__(self) -> str:
        height, width = self.shape
        return on_a_line(self, {"width": width, "height": height, "maps": list(self.maps)})

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels, of every map."""
        height, width = self.maps["albedo"].shape[:2]
        return height, width

    def color(self) -> PixelArray:
        """Return the albedo, the opacity map in place of its alpha: what a model is painted with."""
        albedo, opacity = self.maps["albedo"], self.maps.get("opacity")
        if opacity is None:
            return albedo
        alpha = alpha_channel(albedo.shape[2])
        plain = albedo if alpha is None else albedo[:, :, :alpha]
        return np.concatenate([plain, as_depth(opacity, albedo.dtype)], axis=2)

    def matched(self, weights: Mapping[str, float] | None = None, *, turned: bool = False) -> PixelArray:
        """Return one image with everything that matching compares.

        Parameters
        ----------
        weights
            Weight of squared differences of a map's channel, 0 to 16, where the albedo has 1. Maps that are
            not named take theirs from `MATCH_WEIGHTS`.
        turned
            Whether blocks are mirrored or turned as well. Then normals count by z alone, their slope, because
            x and y turn with the block.

        Returns
        -------
        ndarray
            (H, W, C) uint16: the albedo (sRGB-coded, alpha included), then every other map with a weight, its
            samples scaled about the middle by the weight's square root; of normals x and y, or z alone. The
            albedo itself if no other map has a weight.

        Raises
        ------
        InputError
            For an unknown role or a weight out of range.
        """
        used = {**MATCH_WEIGHTS, **(weights or {})}
        for role, weight in used.items():
            if role not in ROLES[1:]:
                raise InputError(f"weight of {role!r} matches no map; {nearest(role, ROLES[1:])}")
            if not 0 <= weight <= 16:
                raise InputError(f"weight of {role} is {weight}; allowed: 0 to 16")
        others = [role for role in self.maps if role != "albedo" and used[role] > 0]
        albedo = self.maps["albedo"]
        if not others:
            return albedo
        largest = max(1.0, *(used[role] for role in others))
        parts = []
        for role in ("albedo", *others):
            pixels = self.maps[role]
            if role == "normal":
                pixels = pixels[:, :, 2:] if turned else pixels[:, :, :2]
            if pixels.dtype == np.float32 and role in COLORS:
                pixels = from_linear(pixels, np.uint16)
            scale = (used.get(role, 1.0) / largest) ** 0.5
            parts.append(np.rint(65535 * (0.5 + scale * (to_unit(pixels) - 0.5))).astype(np.uint16))
        return np.concatenate(parts, axis=2)


def _checked_used(used: object, shape: tuple[int, ...]) -> Used | None:
    """Return which pixels are used, None where all are."""
    if not isinstance(used, np.ndarray) or used.dtype != np.bool_ or used.shape != shape:
        what = f"shape {used.shape}, {used.dtype}" if isinstance(used, np.ndarray) else type(used).__name__
        raise InputError(f"used is {what}; allowed: shape {shape}, bool")
    if not used.any():
        raise InputError("used leaves nothing of the sample; allowed: some pixels")
    return None if used.all() else frozen_array(used.copy())
