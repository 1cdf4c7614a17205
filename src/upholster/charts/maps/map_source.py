"""The source of a map, before it is inverted or compared."""

from abc import ABC, abstractmethod

from upholster.charts.maps.map_ground import AtSteps, MapGround

__all__ = ["MapSource"]


class MapSource(ABC):
    """A kind of map with the user's settings. Sources with the same settings are equal."""

    @property
    def is_binary(self) -> bool:
        """Whether its only values are 0 and 1."""
        return False

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it reads."""
        return ()

    @abstractmethod
    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values: from 0 to 1, NaN where there is none.

        Raises
        ------
        InputError
            If it cannot be evaluated on this ground, or a file is wrong.
        """

    def codes(self, _: MapGround, /) -> AtSteps | None:
        """Return a function for labels, int32 0xRRGGBB, −1 where there is none; None if it has no labels.

        Raises
        ------
        InputError
            As `values`.
        """
        return None
