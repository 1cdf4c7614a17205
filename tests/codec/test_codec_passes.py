"""The passes as SPEC.md has them (section 7.2) run as they are there, and decode what the decoder decodes."""

import contextlib
import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from codec_images import coded_parts, textured

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from plain_coder import EndError, PlainCoder

from upholster.codec.header import ImageHeader
from upholster.codec.partial_image import ImageDecoder
from upholster.codec.tree import LOWEST

ROOT = Path(__file__).parents[2]
SPEC = (ROOT / "SPEC.md").read_text(encoding="utf-8")
EXAMPLE = ROOT / "tests" / "vectors" / "colour8.ezw"

(PASSES,) = re.findall(
    r"^```python\n(.*?)^```$", SPEC.partition("### 7.2")[2].partition("### 7.3")[0], re.MULTILINE | re.DOTALL
)


class MixingCoder(PlainCoder):
    """`bit` of section 5.1; keeps of each bit: plane, coefficient, mixer, counters, chance, and itself."""

    def __init__(self, data: Any) -> None:
        super().__init__(data)
        self.weights: Any = {}
        self.bits: list[Any] = []

    def mixed(self, names: Any, mixer: Any, limit: Any) -> Any:
        weights = self.weights.setdefault(mixer, [{2: 36045, 3: 24030, 5: 14418}[len(names)]] * len(names))
        logits = [stretched(self.counters[name].p >> 8) for name in names]
        x = sum(weight * logit for weight, logit in zip(weights, logits, strict=True)) >> 16
        chance = min(65520, max(16, round(65536 / (1 + math.exp(-min(2047, max(-2047, x)) / 256)))))
        bit = self.decided(chance)
        for k, name in enumerate(names):
            weights[k] += (logits[k] * ((bit << 16) - chance) + 8192) >> 14
            self.counters[name].adapt(bit, limit)
        frame = sys._getframe(1)
        found = frame.f_globals["P"], frame.f_locals["c"], mixer, [numbers(name) for name in names]
        self.bits.append((*found, chance, bit))
        return bit


def numbers(name: Any) -> Any:
    return tuple(x if isinstance(x, str) else int(x) for x in name)


def stretched(p: Any) -> Any:
    q = (p + 0.5) / 4096
    return min(2047, max(-2047, round(256 * math.log(q / (1 - q)))))


def run_passes(decoder: Any, data: Any) -> tuple[Any, Any]:
    """The names that the passes leave, and their coder, after the bytes of a stream."""
    header, tree = decoder.header, decoder._coefficients.tree
    lowest = {(band.level, band.kind): int(tree.table[n, LOWEST]) for n, band in enumerate(tree.bands)}
    coder = MixingCoder(data)
    names: Any = {"H": header.height, "W": header.width, "C": header.channels, "n": header.levels}
    names |= {"first": header.plane, "lowest": lowest, "bit": coder.mixed, "counters": coder.counters}
    with contextlib.suppress(EndError):
        exec(PASSES, names)
    return names, coder


def check_passes(head: Any, data: Any) -> None:
    decoder = ImageDecoder(ImageHeader.parse(head))
    decoder.feed(data)
    names, _ = run_passes(decoder, data)
    known, sigma, coefficients = names["known"], names["sigma"], decoder._coefficients
    signed = coefficients.magnitudes()
    for band in coefficients.tree.bands:
        places = coefficients.tree.places(band)
        found = np.zeros(places.shape, int)
        for row, column in np.ndindex(places.shape):
            c = band.channel, band.level, band.kind, row, column
            found[row, column] = -known[c] if sigma[c] == 2 else known[c]
        np.testing.assert_array_equal(found, signed[places])


@pytest.mark.parametrize("length", [0, 1, 5, 20, 40, 60, 80, 100, 108])
def test_the_passes_of_the_specification_decode_its_image_like_the_decoder(length: Any) -> None:
    data = EXAMPLE.read_bytes()[4:]
    head = ImageHeader.parse(data).length
    check_passes(data[:head], data[head : head + length])


@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((7, 5, 1), {"wavelet": "9/7", "levels": 2, "sample_quality": 40}),
        ((5, 9, 4), {"wavelet": "5/3", "levels": 3, "sample_quality": "lossless"}),
        ((9, 11, 2), {"wavelet": "haar", "levels": 2, "sample_quality": "lossless"}),
        ((3, 1, 5), {"wavelet": "5/3", "levels": 0, "sample_quality": "lossless"}),
        ((1, 13, 3), {"wavelet": "9/7", "levels": 4, "sample_quality": 45}),
    ],
)
def test_they_decode_other_shapes_and_wavelets(shape: Any, options: Any) -> None:
    head, data = coded_parts(textured(shape), **options)
    for length in (len(data) // 3, len(data)):
        check_passes(head, data[:length])


def line_of_first_bits(one: Any, two: Any) -> str:
    """Significance and sign of a coefficient in the dominant pass of plane 8, as in the specification."""
    plane, (channel, level, kind, row, column), mixer, (s1, s2, s3), chance, bit = one
    _, same, other_mixer, (g1, g2, g3, g4, g5), sign_chance, sign = two
    assert (plane, level, kind, mixer, other_mixer) == (8, 1, 0, ("significance", 6, 0), ("sign", 0))
    assert same == one[1]
    assert s1[2:] == (1, 0, channel > 0)
    assert s2[9:] == (0, 0, channel > 0)
    assert s3[2:] == (0, 0, 0)
    assert g4[1:] == (0,) * 5
    assert g1[-1] == g2[-1] == g3[-1] == g5[-1] == 0

    def plain(values: Any) -> str:
        return "".join(map(str, values))

    found = f"{('Y ', 'Co')[channel]} {row} {column}  {s1[1]} {plain(s2[1:9])} {s3[1]} {chance} {bit}"
    signs = " ".join(plain(values) for values in (g1[1:5], g2[1:5], g3[1:5], g5[2:5]))
    return f"{found}   {signs} {sign_chance:5} {sign}"


def line_of_bit(n: Any, bits: Any) -> str:
    plane, (channel, _, kind, row, column), mixer, names, chance, bit = bits[n - 1]
    contexts = "  ".join(" ".join(map(str, name)) for name in names)
    place = f"{('Y', 'Co', 'Cg')[channel]} {('LL', 'HL', 'LH', 'HH')[kind]} {row} {column}"
    return f"    {n:4} {plane} {place:9}  {' '.join(map(str, mixer)):16} {chance:5} {bit}  {contexts}"


def test_the_bits_of_the_example_are_those_of_the_specification() -> None:
    data = EXAMPLE.read_bytes()[4:]
    decoder = ImageDecoder(ImageHeader.parse(data))
    _, coder = run_passes(decoder, data[decoder.header.length :])
    pairs = [line_of_first_bits(*coder.bits[n : n + 2]) for n in range(0, 50, 2)]
    lines = ["    " + "   │ ".join(pairs[n : n + 2]) for n in range(0, 25, 2)]
    later = re.findall(r"^ +(\d+) \d (?:Y|Co|Cg) (?:LL|HL|LH|HH) .*$", SPEC, re.MULTILINE)
    lines += [line_of_bit(int(n), coder.bits) for n in later]
    assert len(later) >= 6
    assert [line for line in lines if line not in SPEC.splitlines()] == []
