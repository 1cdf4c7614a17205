"""The image coder against others: PSNR at equal bytes, and bytes without loss.

Peers are compared at their own number of bytes, headers included: our stream is cut there. Textures are a
folder's colour PNGs; grey images are scikit-image's.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from skimage import data

from benchmarks.codec_peers import LOSSLESS, PEERS
from benchmarks.measure import EXAMPLES, Request, psnr
from benchmarks.tables import Table
from upholster.codec.header import ImageHeader
from upholster.codec.image_code import encode_parts
from upholster.codec.partial_image import ImageDecoder

__all__ = ["measured"]

RATES = (1.0, 0.5, 0.25, 0.125, 0.0625)
BUDGETS = (1024, 2048, 4096, 8192, 16384)

Pixels = NDArray[np.uint8]


def measured(request: Request) -> Table:
    """Return a row for each kind of image and peer: how much better we are, by size or rate."""
    textures, greys = _textures(request), list(_greys().values())
    rates = [[int(image.size * rate / 8) for image in greys] for rate in RATES]
    peer = {"JPEG 2000": PEERS["JPEG 2000"]}
    rows = _compared("grey, 512²", greys, rates, peer) + _without_loss("grey, 512²", greys)
    for side in (128, 256):
        images = [image[:side, :side] for image in textures]
        budgets = [[budget] * len(images) for budget in BUDGETS]
        rows += _compared(f"colour, {side}²", images, budgets, PEERS)
        rows += _without_loss(f"colour, {side}²", images)
    columns = ("images", "than", "mean", "by size or rate", "worst")
    note = f"{len(textures)} textures; dB better than the peer, or our share of its bytes. " + (
        f"Sizes {', '.join(f'{budget // 1024} kB' for budget in BUDGETS)}; "
        f"rates {', '.join(f'{rate:g}' for rate in RATES)} bit per pixel."
    )
    return Table(columns, rows, {"note": note})


def _compared(
    what: str,
    images: list[Pixels],
    budgets: list[list[int]],
    peers: dict[str, Callable[[Pixels, int], list[tuple[bytes, Pixels]]]],
) -> list[list[str]]:
    # Each of `budgets` has a number of bytes for each image.
    most = [max(sizes) for sizes in zip(*budgets, strict=True)]
    streams = [_encoded(image, most_bytes=size) for image, size in zip(images, most, strict=True)]
    rows = []
    for name, peer in peers.items():
        every = []
        for sizes in budgets:
            gains = []
            for image, stream, size in zip(images, streams, sizes, strict=True):
                better = [
                    psnr(image, _decoded(stream[: len(coded)])) - psnr(image, other)
                    for coded, other in peer(image, size)
                ]
                gains += [min(better)] if better else []  # the best of its ways to reach the size
            every += [gains] if gains else []
        means = [float(np.mean(gains)) for gains in every]
        worst = min(min(gains) for gains in every)
        shown = " ".join(f"{mean:+.2f}" for mean in means)
        rows.append([what, name, f"{np.mean(means):+.2f} dB", shown, f"{worst:+.2f}"])
    return rows


def _without_loss(what: str, images: list[Pixels]) -> list[list[str]]:
    ours = [_encoded(image, sample_quality="lossless") for image in images]
    for stream, image in zip(ours, images, strict=True):
        if not np.array_equal(_decoded(stream), np.atleast_3d(image)):
            raise SystemExit(f"{what}: lossless is not")
    rows = []
    for name, encode in LOSSLESS.items():
        shares = [len(stream) / len(encode(image)) for stream, image in zip(ours, images, strict=True)]
        rows.append([f"{what}, lossless", name, f"{np.mean(shares):.3f}", "", f"{max(shares):.3f}"])
    return rows


def _greys() -> dict[str, Pixels]:
    # scikit-image's pictures that are free to use, 512² each.
    def grey(image: Pixels, left: int = 0, side: int = 512) -> Pixels:
        cut = Image.fromarray(image).convert("L").crop((left, 0, left + side, side))
        return np.asarray(cut.resize((512, 512), Image.Resampling.LANCZOS))

    return {
        "camera": data.camera(),
        "astronaut": grey(data.astronaut()),
        "brick": data.brick(),
        "grass": data.grass(),
        "gravel": data.gravel(),
        "coffee": grey(data.coffee(), 50, 400),
        "chelsea": grey(data.chelsea(), 75, 300),
    }


def _textures(request: Request) -> list[Pixels]:
    # The middle square of every colour image, reduced to 256².
    out = []
    for path in (request if request.files else Request((EXAMPLES,))).listed([".png"]):
        with Image.open(path) as image:
            if image.mode not in ("RGB", "RGBA", "P"):
                continue
            side = min(image.size)
            left, top = (image.width - side) // 2, (image.height - side) // 2
            square = image.convert("RGB").crop((left, top, left + side, top + side))
        out.append(np.asarray(square.resize((256, 256), Image.Resampling.LANCZOS)))
    if not out:
        raise SystemExit("there is no colour PNG")
    return out


def _encoded(image: Pixels, **options: Any) -> bytes:
    coded = encode_parts(np.atleast_3d(image), **options)
    return coded.header + coded.payload


def _decoded(stream: bytes) -> Pixels:
    header = ImageHeader.parse(stream)
    decoder = ImageDecoder(header)
    decoder.feed(stream[header.length :])
    return np.asarray(decoder.image())
