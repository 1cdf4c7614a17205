"""Units for models whose files state none."""

from upholster.base.errors import InputError, nearest
from upholster.base.lengths import METRES

__all__ = ["unit_in_metres"]


def unit_in_metres(unit: str | None) -> float | None:
    """Return a unit's length in metres; None for none.

    Raises
    ------
    InputError
        If it is unknown; names the nearest unit.
    """
    if unit is None:
        return None
    if unit not in METRES:
        raise InputError(f"unit {unit!r} is unknown; {nearest(str(unit), METRES)}")
    return METRES[unit]
