"""The base image of a JPEG file: without a gain map, and without faults that cost no pixel.

Decoders report only their first warning. A harmless one would hide that the picture is cut short, so its
cause is removed before a file is decoded.
"""

import re

__all__ = ["START", "base_image"]

_GAIN_MAPS = (
    (b"hdrgm:Version", b"hdrgm:Ignored"),
    (b"urn:iso:std:iso:ts:21496", b"urn:iso:std:iso:ts:-none"),
)
"""Signs of a gain map, by Adobe and Google (Ultra HDR) and by ISO 21496-1, and words of the same length."""

START = b"\xff\xd8"
"""How a JPEG file begins."""

_END = b"\xff\xd9"
_MARKER = re.compile(rb"\xff+([\xc0-\xcf\xda-\xfe])")
_SCAN, _SEQUENTIAL = 0xDA, (0xC0, 0xC1, 0xC9)

_REVISION = re.compile(rb"\xff\xe0..JFIF\0(.)", re.DOTALL)
_SPECTRUM = re.compile(rb"\xff\xda.*(...)\Z", re.DOTALL)

_MOST_SEGMENTS = 10_000


def base_image(data: bytes) -> tuple[bytes, list[str]]:
    """Return a JPEG file that says nothing of a gain map, and its faults that cost no pixel, in words.

    Bytes between two segments before the picture are left out: they belong to neither. Values that decoders
    warn of and ignore are made the usual ones. A missing mark at the file's end is added. So a decoder warns
    only if pixels are missing.

    Parameters
    ----------
    data
        A file that begins as JPEG files do; any other content is returned as it is, as is a damaged header.

    References
    ----------
    ITU-T T.81, annex B, on segments.
    """
    if not data.startswith(START):
        return data, []
    parts, stray, place = [START], 0, len(START)
    faults: list[str] = []
    for _ in range(_MOST_SEGMENTS):
        found = _MARKER.search(data, place)
        if found is None:
            return data, []
        stray += found.start() - place
        kind = found[1][0]
        place = found.end() + int.from_bytes(data[found.end() : found.end() + 2], "big")
        if place < found.end() + 2 or place > len(data):
            return data, []
        if kind == _SCAN:
            break
        part = data[found.end() - 2 : place]
        parts.append(_usual(part, _REVISION, b"\1", faults, "an unknown JFIF revision"))
    else:
        return data, []
    scan, picture = data[found.end() - 2 : place], data[place:]
    # A progressive picture has other parameters; if it ended early at a scan's end, it would look complete.
    end = b""
    if any(part[1] in _SEQUENTIAL for part in parts):
        scan = _usual(scan, _SPECTRUM, b"\0\x3f\0", faults, "unusual parameters of a scan")
        end = b"" if _END in picture else _END
    if stray:
        faults.append(f"{stray} stray bytes")
    header = b"".join(parts)
    for sign, other in _GAIN_MAPS:
        header = header.replace(sign, other)
    return header + scan + picture + end, faults


def _usual(part: bytes, place: re.Pattern[bytes], value: bytes, faults: list[str], words: str) -> bytes:
    """Return a segment with a value at a place, and note the fault if it had another one."""
    found = place.match(part)
    if found is None or found[1] == value:
        return part
    faults.append(words)
    return part[: found.start(1)] + value + part[found.end(1) :]
