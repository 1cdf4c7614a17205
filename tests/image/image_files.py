"""Image files that OpenImageIO would not write, or not so: made by hand."""

import base64
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from OpenImageIO import ImageOutput, ImageSpec, TypeDesc

CMYK_RED = base64.b85decode(
    "|JeWT01iQ9Z(?NtWB>pF0095n07C!}3k(hn3J?wr4iXU%6BsBO7#0>7F(V}%C^|DeJUKHsH$X^SPC!IgMK?H5ZBbWWVrOV)K233Xa"
    "AbH~WoKjmzyK5o03ZM$1Va%3O%VWD5dcdO0RO}Q9{>OW1pxs80RaI300000000010s{mE1_uZU3Jd?l0JRVR0s#X90t5pE1q1{D00"
    "Dgg0s{a95d{(<F+m0sQDFxnaTGFvk)a49Lb1UWQqk}vGh%Xr2?`b$7#SKRCMPH<Dl|1VH#j*uLqtVJM@UIZQ&d$}S6EqEV`OD!XJ~0"
    "^b98lfcX)YvgM@{Khlq)al9QB`mY0~BnxdnmrKYE-sj9NGw6(UkxVgH*!^FkL$H>Xb($mz{*4NnC+Tr5k<mKk)=;`Y5^7Hid_V@Vt`"
    "v2Mh4g^C0O#oQ{O8@{r0Q3s;`t$nq3MitAD58oeqKYV@iYTIrD58oeqKYV@iYTIrD58oeqKYV@iYTIrD58oeqKg07"
)
"""A JPEG file, 32 × 32 pixels of pure red as CMYK, inverted as Adobe's programs write it (made by Pillow)."""

FOUR_COLORS_HEIC = base64.b85decode(
    "0000SW^{RQXk}?*00000ZE0pPXk}?*ZE0a<00054ZDn*}000000000XXk=`10000000000aA{+7000000000000000000004sdC7"
    "Z2$lO00062000naWMOmw00000KmafR001~?Y;R)$0000)KmY;&0RR9100001(EtGe00000009R80ssL3000000003100000000O8"
    "001~?X>Mi!000000ssI26=`l}WdZ;I0RRC20BCk&F#rGn02OI&W@Q2Z00002003ulX=DHZ007u&aB^?}006dWaAR)(004Gqc4I>U"
    "18@KU000000000U@BsY%`1k+-4+9_o0RR|40Sp2E{{wIU00RJ!0009300RIXx&lBU0096hLID8-Z~y=U0FVFx0{{R603M(qfd!W8"
    "<fgf}5D+jR00093AOHXZ03jj(0RRR>0l{;?i2wiq6lrsCWdHyG00000KmY&$KmY&$6lrsCWdHyG00000KmY&$FaQ7m5O8UDX#fBK"
    "00RgJ2mk;88fkECVE_OC000000ssL5fdT*m0t18q000_ka%E-!00000000hTX>Df!0ssL30RR924{c;&bN~PW11JHn1~~ASz3sQ>"
    "<A4A5^B#xs(5RoYscF@D6D#k;b$|Z*Oe7*o`SXzQ2?`*XDCR_(o5f9!-aFj=y3{~OTGTfI;-?VwKwe{CV=Yb&LgVv%-<LnwM|kWM"
    "YM>AQXF-*?!N)v5v_b#EMPtCWlAld>|3dZN*?n66uaX)0_PASaRla9x_H-h_FwU;<ozuA0WXjXhstW>e`?ZyW;2QgPCcLhwX`by8"
    ")TQ4UJ7GixX&P{l{I~$H=CO+)bZ#~74ICdoRy?Ht(?2NxF6HzKtId)!QJFS(#P+@Y<DS-dW0a0bs_;kO``P)xx%);f{=e@)Gw#n;"
    "L@u#f`V_;@"
)
"""A HEIC file, 64 × 48 pixels: red and green over blue and yellow (made by libheif's heif-enc)."""

FOUR_COLORS = ((200, 60, 40), (60, 160, 70), (50, 80, 190), (220, 200, 120))


def write_raw(path: Path, pixels: Any, samples: str, names: tuple[str, ...] = (), **attributes: Any) -> None:
    """Write through OpenImageIO as it comes; ``__`` in attribute names stands for a colon.

    An attribute may be a type and its value.
    """
    spec = ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], samples)
    if names:
        spec.channelnames = names
        spec.alpha_channel = names.index("A") if "A" in names else -1
        spec.z_channel = names.index("Z") if "Z" in names else -1
    for name, value in attributes.items():
        if isinstance(value, bytes):
            spec.attribute(name, TypeDesc(f"uint8[{len(value)}]"), np.frombuffer(value, np.uint8))
        elif isinstance(value, tuple):
            spec.attribute(name, *value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    file = ImageOutput.create(str(path))
    assert file is not None
    assert file.open(str(path), spec), file.geterror()
    assert file.write_image(np.ascontiguousarray(pixels)), file.geterror()
    assert file.close()


def png(width: int, height: int, depth: int, kind: int, raw: bytes, *chunks: tuple[bytes, bytes]) -> bytes:
    """Return a PNG file with the given header, rows and chunks before IDAT."""

    def chunk(tag: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0))
    body = b"".join(chunk(*one) for one in chunks) + chunk(b"IDAT", zlib.compress(raw))
    return b"\x89PNG\r\n\x1a\n" + head + body + chunk(b"IEND", b"")


def tiff(pixels: Any, form: int, extra: int | None = None) -> bytes:
    """Return a plain TIFF file: `form` 1 unsigned, 2 signed, 3 float; `extra` as in tag ExtraSamples."""
    height, width, channels = pixels.shape
    colors = 3 if channels >= 3 else 1
    data = pixels.tobytes()
    entries = [(256, 4, width), (257, 4, height), (259, 3, 1), (262, 3, 2 if colors == 3 else 1)]
    entries += [(273, 4, 0), (277, 3, channels), (278, 4, height), (279, 4, len(data))]
    if channels > colors and extra is not None:
        entries.append((338, 3, extra))
    table = 8
    shorts = table + 2 + 12 * (len(entries) + 2) + 4
    entries = [(tag, kind, shorts + 4 * channels if tag == 273 else value) for tag, kind, value in entries]
    words = b""
    for tag, kind, value in sorted(entries):
        words += struct.pack("<HHII", tag, kind, 1, value)
        if tag == 257:  # BitsPerSample follows; written out of line unless one or two fit in place
            words += _shorts(258, channels, pixels.itemsize * 8, shorts)
    words += _shorts(339, channels, form, shorts + 2 * channels)
    lists = struct.pack(f"<{channels}H", *[pixels.itemsize * 8] * channels)
    lists += struct.pack(f"<{channels}H", *[form] * channels)
    head = struct.pack("<2sHI", b"II", 42, table) + struct.pack("<H", len(entries) + 2)
    return bytes(head + words + struct.pack("<I", 0) + lists + data)


def _shorts(tag: int, count: int, value: int, offset: int) -> bytes:
    if count <= 2:
        return struct.pack("<HHIHH", tag, 3, count, value, value if count == 2 else 0)
    return struct.pack("<HHII", tag, 3, count, offset)
