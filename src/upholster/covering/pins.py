"""Regions that stay as they were when the user pinned them."""

from dataclasses import dataclass

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.maps.map_text import parse_map
from upholster.synthesis.setup import request_files

__all__ = ["MOST_PINNED", "Pinned", "check_pinned"]

MOST_PINNED = 8
"""Largest number of states at which regions are pinned: each state is laid again."""


@dataclass(frozen=True, slots=True)
class Pinned:
    """Regions that stay as they were when pinned.

    Attributes
    ----------
    regions
        Each as `upholster.charts.maps.map_text.parse_map` reads it.
    synthesis, seed
        The options and the seed with which they were laid.
    before
        The regions that were pinned at that time; None for none.
    """

    regions: tuple[str, ...]
    synthesis: SynthesisOptions
    seed: int
    before: "Pinned | None" = None

    def __post_init__(self) -> None:
        for text in self.regions:
            parse_map(text)
        if self.depth > MOST_PINNED:
            raise InputError(
                f"regions are pinned at {self.depth} states; allowed: {MOST_PINNED}; unpin, then pin again"
            )

    @property
    def depth(self) -> int:
        """The number of states at which regions were pinned."""
        return 1 if self.before is None else 1 + self.before.depth

    @property
    def files(self) -> list[str]:
        """The files that the regions and options name."""
        own = [file for text in self.regions for file in parse_map(text).files]
        return [*own, *request_files(self.synthesis), *([] if self.before is None else self.before.files)]


def check_pinned(pinned: object, method: str) -> None:
    """Raise InputError unless `pinned` is None, or from `upholster.Project.pin` and with method "quilt"."""
    if pinned is None:
        return
    if not isinstance(pinned, Pinned):
        raise InputError(f"pinned is {on_a_line(pinned)}; allowed: a result of `Project.pin`")
    if method != "quilt":
        raise InputError(f"a region is pinned with method {method!r}; allowed: with method 'quilt'")
