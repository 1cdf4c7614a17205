"""Several maps of one material in a stream: names, headers, and how their bytes are interleaved."""

from collections.abc import Mapping, Sequence

from upholster.base.errors import FormatError, InputError
from upholster.codec.header import MAX_SAMPLES
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.image.roles import MAP_ROLES

__all__ = [
    "FIRST_ROLE",
    "MAX_MAP_SAMPLES",
    "MOST_MAPS",
    "MOST_SIDE",
    "check_roles",
    "interleaved",
    "pack_role",
    "parse_role",
]

FIRST_ROLE = "albedo"
"""Role of the first map of a stream: the exemplar."""

MOST_MAPS = 16
"""Largest number of maps of a stream, including the first one."""

MAX_MAP_SAMPLES = 4 * MAX_SAMPLES
"""Largest number of samples of all maps together."""

Chunk = tuple[str, bytes]

MOST_SIDE = 4096
"""Largest height and width of an exemplar."""

_LONGEST_ROLE = 32
_TURNS = 12


def check_roles(roles: Sequence[str]) -> None:
    """Check names of maps after the first one.

    Raises
    ------
    InputError
        For more than 15, a name twice, or one that is not 1 to 32 small letters, digits and underscores.
    """
    if len(roles) >= MOST_MAPS:
        raise InputError(f"stream has {len(roles) + 1} maps; allowed: {MOST_MAPS}")
    for n, role in enumerate(roles):
        if not _sound(role):
            raise InputError(
                f"role of a map is {role!r}; allowed: 1 to {_LONGEST_ROLE} of a to z, 0 to 9 and _"
            )
        if role == FIRST_ROLE or role in roles[:n]:
            raise InputError(f"role {role!r} comes twice; allowed: each once, {FIRST_ROLE!r} is the exemplar")


def pack_role(role: str, header: bytes) -> bytes:
    """Return the payload of a map's chunk: its role and its image header."""
    return varint(len(role)) + role.encode("ascii") + header


def parse_role(data: bytes, offset: int, before: Sequence[str]) -> tuple[str, int]:
    """Read a map's role back; return it and the position of the image header in `data`.

    Raises
    ------
    FormatError
        If it is malformed, comes twice, or is one too many.
    """
    fields = ByteReader(data, offset)
    length = fields.varint("length of a role", _LONGEST_ROLE, 1)
    role = fields.bytes(length, "role").decode("latin-1")
    if not _sound(role) or role in before or len(before) >= MOST_MAPS:
        raise FormatError(f"byte {offset}: map {role!r} is not allowed, comes twice or is one too many")
    return role, fields.offset - offset


def interleaved(first: bytes, others: Mapping[str, bytes], start: int) -> list[tuple[int, tuple[Chunk, ...]]]:
    """Return all maps' streams in turns, so that they refine at the same time.

    Parameters
    ----------
    first, start
        The first map's stream, and the number of its bytes that precede.
    others
        The other maps' streams by role, in the order of their numbers.

    Returns
    -------
    list of (int, tuple)
        For each turn, the number of bytes of the first map up to its end, and its chunks, tags and payloads.
    """
    turns, rest, reached = [], first[start:], min(start, len(first))
    for turn in range(_TURNS):
        part = _part(rest, turn, 1.0)
        reached += len(part)
        chunks = [("D", part)] if part else []
        for number, (role, data) in enumerate(others.items(), 1):
            delay = MAP_ROLES[role].delay if role in MAP_ROLES else 1.0
            part = _part(data, turn, delay)
            chunks += [("E", bytes([number]) + part)] if part else []
        if chunks:
            turns.append((reached, tuple(chunks)))
    return turns


def _part(data: bytes, turn: int, late: float) -> bytes:
    ends = [round(len(data) * ((turn + k) / _TURNS) ** late) for k in (0, 1)]
    return data[ends[0] : ends[1]]


def _sound(role: str) -> bool:
    allowed = "abcdefghijklmnopqrstuvwxyz0123456789_"
    return 1 <= len(role) <= _LONGEST_ROLE and all(letter in allowed for letter in role)
