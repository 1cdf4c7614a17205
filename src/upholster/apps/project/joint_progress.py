"""The progress of several pieces of work, each of several passes, as one number that only grows."""

from collections.abc import Sequence

__all__ = ["JointProgress", "shares_of"]

_READING = 0.2
"""The share of a preview's progress that reading has."""

_PASS = 0.8
"""The share that each pass over tasks has of what remains."""


class JointProgress:
    """The progress of a complete preview: thousandths that only grow.

    A piece of work passes over its tasks several times, and how often is not known beforehand. So each pass
    has most of the share that remains of the piece.
    """

    def __init__(self) -> None:
        self._pass: tuple[str, int, int] = ("", 0, 0)
        self.begin(0.0, _READING)

    def begin(self, start: float, end: float) -> None:
        """Begin a piece of work: shares of the whole, 0 to 1."""
        self._from, self._to, self._end = start, start, end
        self._pass = ("", 0, 0)

    def __call__(self, stage: str, done: int, total: int) -> tuple[str, int, int]:
        """Return the progress of a pass as that of the whole, for `upholster.runtime.parallel.reporting`."""
        before, count, all_ = self._pass
        if (stage, total) != (before, all_) or done < count:
            self._from, self._to = self._to, self._to + _PASS * (self._end - self._to)
        self._pass = (stage, done, total)
        share = self._from + (self._to - self._from) * min(1.0, done / max(1, total))
        return stage, int(1000 * share), 1000


def shares_of(sizes: Sequence[Sequence[float]]) -> list[list[tuple[float, float]]]:
    """Return the shares of pieces of work, by their sizes, as start and end; reading comes before."""
    per = (1 - _READING) / max(sum(map(sum, sizes)), 1e-9)
    out: list[list[tuple[float, float]]] = []
    at = _READING
    for row in sizes:
        out.append([])
        for size in row:
            out[-1].append((at, at + per * size))
            at += per * size
    return out
