"""Units for models whose files state none."""

from upholster.base.errors import InputError, nearest

__all__ = ["UNITS", "unit_in_metres"]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""Units by name, in metres."""


def unit_in_metres(unit: str | None) -> float | None:
    """Return a unit's length in metres; None for none.

    Raises
    ------
    InputError
        If it is unknown; names the nearest unit.
    """
    if unit is None:
        return None
    if unit not in UNITS:
        raise InputError(f"unit {unit!r} is unknown; {nearest(str(unit), UNITS)}")
    return UNITS[unit]
