"""A surface map: a source, optionally inverted or compared with a number; the least of several maps."""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.charts.maps.map_ground import AtSteps, MapGround, Steps, over_steps
from upholster.charts.maps.map_source import MapSource
from upholster.runtime.stages import file_stage, keeping

__all__ = ["Least", "SurfaceMap", "region"]

_WHITE = 0xFFFFFF


@dataclass(frozen=True)
class SurfaceMap:
    """Values over a surface, as `upholster.charts.maps.map_text.parse_map` reads them.

    Attributes
    ----------
    text
        As the user wrote it.
    source
        Its source.
    is_inverted
        Whether the source's values are subtracted from 1.
    above, below
        If given, the map is 1 where values are greater, or less, than this, and otherwise 0.
    """

    text: str
    source: MapSource
    is_inverted: bool = False
    above: float | None = None
    below: float | None = None

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it reads."""
        return self.source.files

    def named(self, name: Callable[[str], str]) -> str:
        """Return its text with its files renamed."""
        if isinstance(self.source, Least):
            return " and ".join(each.named(name) for each in self.source.maps)
        text = self.text
        for file in self.files:
            text = text.replace(file, name(file))
        return text

    @property
    def is_binary(self) -> bool:
        """Whether its only values are 0 and 1."""
        return self.source.is_binary or self.above is not None or self.below is not None

    def values(self, ground: MapGround) -> tuple[NDArray[np.float32], ...]:
        """Return the map's values at the steps of each chart, (height, width) float32.

        They are between 0 and 1; NaN where the map has no value, and off the surface.

        Parameters
        ----------
        ground
            The surface.

        Raises
        ------
        InputError
            If the map cannot be evaluated on this surface, or its file is wrong: one line.
        """
        with keeping():
            return _values(self, ground)

    def codes(self, ground: MapGround) -> tuple[NDArray[np.int32], ...]:
        """Return the map as labels at the steps of each chart, (height, width) int32.

        They are 0xRRGGBB of the nearest pixel or vertex; 0 and 0xFFFFFF for a map that is 0 or 1; −1 where
        the map has no value, and off the surface.

        Raises
        ------
        InputError
            As `values`; and for maps whose values are not labels.
        """
        with keeping():
            return _codes(self, ground)

    def shaped(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Invert and compare its source's values as the map asks."""
        found = np.float32(1) - values if self.is_inverted else values
        if self.above is not None:
            holds = found > self.above
        elif self.below is not None:
            holds = found < self.below
        else:
            return found
        return np.where(np.isnan(found), np.float32(np.nan), holds.astype(np.float32))


@dataclass(frozen=True)
class Least(MapSource):
    """The least of several maps' values, at least two maps; no value where one of them has none."""

    maps: tuple[SurfaceMap, ...]

    @property
    def is_binary(self) -> bool:
        """Whether its only values are 0 and 1."""
        return all(each.is_binary for each in self.maps)

    @property
    def files(self) -> tuple[str, ...]:
        """The files that they read."""
        return tuple(file for each in self.maps for file in each.files)

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        at_each = [(each, each.source.values(ground)) for each in self.maps]

        def at(steps: Steps) -> NDArray[np.float32]:
            found = (each.shaped(np.asarray(own(steps), np.float32)) for each, own in at_each)
            return functools.reduce(np.minimum, found)

        return at


def region(
    wanted: SurfaceMap,
    ground: MapGround,
) -> tuple[NDArray[np.bool_], ...]:
    """Return where a map is above ½, (height, width) for each chart; places without a value are not.

    Raises
    ------
    InputError
        As `SurfaceMap.values`.
    """
    return tuple(values > 0.5 for values in wanted.values(ground))


def _inputs(_: object, read: SurfaceMap | MapSource, *__: object, **___: object) -> tuple[str, ...]:
    return read.files


@file_stage(_inputs)
def _values(wanted: SurfaceMap, ground: MapGround) -> tuple[NDArray[np.float32], ...]:
    return tuple(map(wanted.shaped, _source_values(wanted.source, ground)))


@file_stage(_inputs)
def _source_values(source: MapSource, ground: MapGround) -> tuple[NDArray[np.float32], ...]:
    # A separate stage, because the same curvature may be compared with several numbers in turn.
    nothing = np.array(np.nan, np.float32)
    return over_steps(ground.charted, source.values(ground), nothing)


@file_stage(_inputs)
def _codes(wanted: SurfaceMap, ground: MapGround) -> tuple[NDArray[np.int32], ...]:
    if wanted.is_binary:
        return tuple(_of_binary(values) for values in wanted.values(ground))
    at = wanted.source.codes(ground)
    if at is None:
        compared = "height>0.5" if isinstance(wanted.source, Least) else f"{wanted.text}>0.5"
        raise InputError(
            f"map {wanted.text!r} has no labels; allowed: an image, colors, part:, a ball, or a comparison "
            f"such as {compared}"
        )

    def shaped(steps: Steps) -> NDArray[np.int32]:
        found = np.asarray(at(steps), np.int32)
        return np.where(found < 0, found, _WHITE - found) if wanted.is_inverted else found

    return over_steps(ground.charted, shaped, np.array(-1, np.int32))


def _of_binary(values: NDArray[np.float32]) -> NDArray[np.int32]:
    found: NDArray[np.int32] = np.where(values > 0.5, _WHITE, 0).astype(np.int32)
    found[np.isnan(values)] = -1
    return found
