"""Rows of a table of measures."""

from typing import TypeAlias

__all__ = ["Row", "figure"]

Row: TypeAlias = tuple[str, str, str]
"""A measure's name, its figure and the figure's meaning. An indented name belongs to the row above."""


def figure(value: float | None) -> str:
    """Return a number with three decimals; a dash for None."""
    return "–" if value is None else f"{value:.3f}"
