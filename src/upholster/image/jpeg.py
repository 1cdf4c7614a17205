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
_SCAN, _PROGRESSIVE = 0xDA, (0xC2, 0xC6, 0xCA, 0xCE)

_MOST_SEGMENTS = 10_000


def base_image(data: bytes) -> tuple[bytes, int]:
    """Return a JPEG file that says nothing of a gain map, and the number of stray bytes left out of it.

    Bytes between two segments before the picture are left out: they belong to neither. A missing mark at the
    file's end is added, so that a decoder warns only if pixels are missing.

    Parameters
    ----------
    data
        A file that begins as JPEG files do; any other content is returned as it is, as is a damaged header.

    References
    ----------
    ITU-T T.81, annex B, on segments.
    """
    if not data.startswith(START):
        return data, 0
    parts, stray, place = [START], 0, len(START)
    for _ in range(_MOST_SEGMENTS):
        found = _MARKER.search(data, place)
        if found is None:
            return data, 0
        stray += found.start() - place
        kind = found[1][0]
        place = found.end() + int.from_bytes(data[found.end() : found.end() + 2], "big")
        if place < found.end() + 2 or place > len(data):
            return data, 0
        if kind == _SCAN:
            break
        parts.append(data[found.end() - 2 : place])
    else:
        return data, 0
    picture = data[found.end() - 2 :]
    # A progressive picture that ends early at a scan's end would look complete.
    whole = any(part[1] in _PROGRESSIVE for part in parts) or _END in picture
    header = b"".join(parts)
    for sign, other in _GAIN_MAPS:
        header = header.replace(sign, other)
    return header + picture + (b"" if whole else _END), stray
