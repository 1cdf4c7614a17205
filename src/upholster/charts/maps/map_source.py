"""What a map is made from, before it is inverted or compared."""

from abc import ABC, abstractmethod

from upholster.charts.maps.map_ground import AtSteps, MapGround

__all__ = ["Source"]


class Source(ABC):
    """A kind of map with what the user said of it. Sources with the same words are equal."""

    is_binary = False
    """Whether its values are 0 and 1 alone."""

    @property
    def files(self) -> tuple[str, ...]:
        """Files that it reads."""
        return ()

    @abstractmethod
    def values(self, ground: MapGround, threads: int | None, /) -> AtSteps:
        """Return what tells values: from 0 to 1, NaN where nothing is asked; on so many threads.

        Raises
        ------
        InputError
            If it cannot be told on this ground, or a file is wrong.
        """

    def codes(self, _: MapGround, /) -> AtSteps | None:
        """Return what tells labels, int32 0xRRGGBB, −1 where nothing is asked; None where there are none.

        Raises
        ------
        InputError
            As `values`.
        """
        return None
