"""``upholster encode`` and ``upholster decode``: images through the embedded zerotree codec."""

from pathlib import Path
from typing import Annotated

import typer

from upholster.apps.cli.command_options import number_or_text
from upholster.apps.cli.console import Quiet, byte_count, limits_of, naming, noted, progress_bars, say, share
from upholster.base.display import in_bytes
from upholster.base.errors import InputError
from upholster.base.examples import sample_path
from upholster.base.formats import IMAGES_READ, IMAGES_WRITTEN

__all__ = ["decode", "encode"]


def encode(
    image: Annotated[str, typer.Argument(help=f"{IMAGES_READ}.", metavar="IMAGE")],
    output: Annotated[str, typer.Option("-o", "--output", metavar="FILE.ezw", help="The file to write.")],
    most_bytes: Annotated[
        str | None, typer.Option("--bytes", metavar="N", help="Largest length: 4000, 4k, 4Ki.")
    ] = None,
    bpp: Annotated[float | None, typer.Option(help="Largest length, in bits per pixel.")] = None,
    sample_quality: Annotated[
        str | None,
        typer.Option(
            metavar="DB",
            help="Stop at this PSNR in dB, 20 to 80, or `lossless`. Default, without a limit: 46.",
        ),
    ] = None,
    coefficients: Annotated[
        str | None,
        typer.Option(metavar="15%", help="Stop at this share of significant coefficients."),
    ] = None,
    wavelet: Annotated[
        str | None, typer.Option(help="9/7, 5/3 or haar (the paper's: the largest coefficients first).")
    ] = None,
    levels: Annotated[int | None, typer.Option(help="Levels of the transform, 0 to 10.")] = None,
    quiet: Quiet = False,
) -> None:
    """Encode an image as an embedded zerotree stream: any prefix of the file is a picture."""
    from upholster.base.files import outputs, write_bytes
    from upholster.codec.ezw import decode as decode_codec
    from upholster.codec.ezw import encode as encode_codec
    from upholster.image.files.read import read_image

    if Path(output).suffix.lower() != ".ezw":
        raise InputError(f"output {output!r} has suffix {Path(output).suffix!r}; allowed: .ezw")
    with (
        progress_bars(quiet, ["encode lossless" if sample_quality == "lossless" else "encode"]),
        outputs([output], inputs=[sample_path(image)]) as files,
    ):
        with noted() as notes:
            pixels = read_image(sample_path(image), notes=notes)
        data = encode_codec(
            pixels,
            most_bytes=byte_count("bytes", most_bytes),
            bits_per_pixel=bpp,
            sample_quality=None if sample_quality is None else number_or_text(sample_quality),  # type: ignore[arg-type]  # checked by encode
            coefficients=share("coefficients", coefficients),
            wavelet=wavelet,  # type: ignore[arg-type]  # checked by encode
            levels=levels,
        )
        write_bytes(files.path(output), data)
        found = decode_codec(data)
    if not quiet:
        rate = f"{8 * len(data) / (pixels.shape[0] * pixels.shape[1]):.3g} bits per pixel"
        lost = "; floats are stored as 16 bits over their range" if pixels.dtype == "float32" else ""
        say(f"wrote {output} ({in_bytes(len(data))}): {rate}, {_quality(pixels, found)}{lost}")


def decode(
    file: Annotated[str, typer.Argument(help="A file from `encode`, or its start.", metavar="FILE.ezw")],
    output: Annotated[str, typer.Option("-o", "--output", metavar="IMAGE", help=f"{IMAGES_WRITTEN}.")],
    most_bytes: Annotated[
        str | None, typer.Option("--bytes", metavar="N", help="Use only the first N bytes: 4000, 4k, 4Ki.")
    ] = None,
    coefficients: Annotated[
        str | None,
        typer.Option(metavar="15%", help="Stop at this share of significant coefficients."),
    ] = None,
    most_texels: Annotated[
        str | None, typer.Option("--limit", metavar="4M", help="Refuse an image with more samples.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Decode an image from an embedded zerotree stream, or from its start."""
    from upholster.base.files import outputs, read_bytes
    from upholster.codec.ezw import decode as decode_codec
    from upholster.image.files.write import write_image
    from upholster.output.levels import share_text

    with naming(file), progress_bars(quiet, ["decode"]), outputs([output], inputs=[file]) as files:
        found = decode_codec(
            read_bytes(file),
            most_bytes=byte_count("bytes", most_bytes),
            coefficients=share("coefficients", coefficients),
            limits=limits_of(most_texels),
        )
        write_image(files.path(output), found.image, bits=16 if found.image.dtype.itemsize > 1 else 8)
    if not quiet:
        state = "complete" if found.complete else "incomplete"
        say(
            f"wrote {output}: from {in_bytes(found.used)}, {state}, "
            f"{share_text(found.significant)} of the coefficients"
        )


def _quality(pixels: object, found: object) -> str:
    import numpy as np

    from upholster.codec.ezw import DecodedImage

    assert isinstance(found, DecodedImage)
    original = np.asarray(pixels)
    peak = np.iinfo(original.dtype).max if original.dtype != np.float32 else np.ptp(original)
    error = float(np.mean((found.image.astype(float) - original) ** 2))
    return "lossless" if error == 0 else f"{10 * np.log10(peak**2 / error):.2f} dB"
