"""The kernels against plain Python: one bit's prediction and interval, and streams without the compiler."""

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from codec_images import coded_parts, decoder_of

from upholster.codec import _model_kernels as model
from upholster.codec.coder import _TABLES
from upholster.codec.tables import RECIPROCALS, SQUASH, STRETCH


class PlainCoder:
    """The arithmetic coder in Python's own integers, interval as (low, high), with unlimited precision."""

    def __init__(self, weights, counters):
        self.low, self.high, self.out = 0, 2**32 - 1, bytearray()
        self.weights, self.counters = list(weights), [list(counter) for counter in counters]

    def encode(self, contexts, bit, limit):
        logits = [int(STRETCH[self.counters[c][0] // 256]) for c in contexts]
        total = sum(w * logit for w, logit in zip(self.weights, logits, strict=False)) // 65536
        chance = int(SQUASH[2048 + min(2047, max(-2047, total))])
        span = self.high - self.low
        # span·chance / 65536, rounded down in two parts.
        middle = self.low + span // 65536 * chance + span % 65536 * chance // 65536
        if bit:
            self.high = middle
        else:
            self.low = middle + 1
        while self.low // 2**24 == self.high // 2**24:
            self.out.append(self.low // 2**24)
            self.low, self.high = self.low % 2**24 * 256, self.high % 2**24 * 256 + 255
        error = bit * 65536 - chance
        for k, (context, logit) in enumerate(zip(contexts, logits, strict=True)):
            self.weights[k] += (logit * error + 8192) // 16384
            counter = self.counters[context]
            target = 2**20 - 1 if bit else 0
            counter[0] += (target - counter[0]) // 16 * int(RECIPROCALS[counter[1]]) // 1024
            counter[1] = min(counter[1] + 1, limit)


def test_one_bit_after_another_equals_plain_integers():
    rng = np.random.default_rng(8)
    size = 12
    a = np.zeros(model.COUNTERS + size, np.int32)
    a[: len(_TABLES)] = _TABLES
    a[model.COUNTERS :] = 1 << 29
    a[model.WEIGHTS : model.WEIGHTS + 8] = 24030
    state, data = np.zeros(model.STATE_SIZE, np.int64), np.zeros(4000, np.uint8)
    state[model.HIGH] = 2**32 - 1
    plain = PlainCoder([24030] * 8, [[2**19, 0]] * size)
    bits = (rng.random(5000) < np.repeat(rng.random(50) ** 2, 100)).astype(int)
    choices = [rng.choice(size, 3, replace=False) for _ in bits]
    for bit, chosen in zip(bits, choices, strict=True):
        a[model.CONTEXTS : model.CONTEXTS + 3] = model.COUNTERS + chosen
        assert model.code_bit(state, data, a, 3, 0, 60, True, int(bit)) == bit
        plain.encode(chosen.tolist(), int(bit), 60)
    count = int(state[model.BYTES_DONE])
    assert data[:count].tobytes() == bytes(plain.out)
    assert (state[model.LOW], state[model.HIGH]) == (plain.low, plain.high)
    assert a[model.WEIGHTS : model.WEIGHTS + 3].tolist() == plain.weights[:3]
    assert a[model.COUNTERS :].tolist() == [p << 10 | n for p, n in plain.counters]
    assert 100 < count < 5000 / 8 * 1.1

    # And back: the decoder takes the same bits, with the whole file or byte by byte, and stops at its end.
    b = np.zeros_like(a)
    b[: len(_TABLES)] = _TABLES
    b[model.COUNTERS :] = 1 << 29
    b[model.WEIGHTS : model.WEIGHTS + 8] = 24030
    back = np.zeros(model.STATE_SIZE, np.int64)
    back[model.HIGH] = 2**32 - 1
    stream = data[:count]
    back[model.BYTES_HERE], back[model.BYTES_DONE] = count, 4
    back[model.CODE] = int.from_bytes(stream[:4].tobytes(), "big")
    taken = 0
    for bit, chosen in zip(bits, choices, strict=True):
        b[model.CONTEXTS : model.CONTEXTS + 3] = model.COUNTERS + chosen
        got = model.code_bit(back, stream, b, 3, 0, 60, False, 0)
        if got < 0:
            break
        assert got == bit
        taken += 1
    assert taken > 4960


def picture(height, width, channels, most):
    """Whole numbers by a formula without rounding: the same on any machine."""
    rows, columns, planes = np.ogrid[:height, :width, :channels]
    waves = (rows * rows * 3 + columns * 7 + rows * columns + planes * 40) % 251
    steps = ((rows // 8 + columns // 8 + planes) % 2) * 90
    return ((waves // 2 + steps) * (most // 255)).astype(np.uint8 if most == 255 else np.uint16)


STREAMS = {
    "9/7": (picture(48, 40, 1, 255), {}),
    "5/3": (picture(33, 30, 3, 255), {"sample_quality": "lossless"}),
    "haar": (picture(24, 40, 2, 65535), {"wavelet": "haar", "levels": 3}),
}
DIGESTS = {"9/7": "af35cd3ade9b6521", "5/3": "5db6caf4c85a4f86", "haar": "f74194c1248f4eca"}


def digests():
    return {
        name: sha256(b"".join(coded_parts(image, **options))).hexdigest()[:16]
        for name, (image, options) in STREAMS.items()
    }


def test_streams_stay_the_same():
    # They are files that people have: see SPEC.md on versions before changing a digest.
    assert digests() == DIGESTS


@pytest.mark.slow(reason="codes many images, or large ones")
def test_the_kernels_give_the_bytes_of_plain_python():
    # Uncompiled, NumPy warns where a number grows beyond its type.
    program = (
        "import warnings, sys; warnings.simplefilter('error');"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r});"
        "import test_codec_kernels as t; print(t.plain_digests())"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True, text=True, check=False, env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-800:]
    assert done.stdout.strip() == str(plain_digests())


def plain_digests():
    """Digests of small streams and of what their halves decode to."""
    out = []
    for name, (image, options) in STREAMS.items():
        part = image[:12, :14]
        header, payload = coded_parts(part, **options)
        decoder = decoder_of(header, payload[: len(payload) // 2])
        out.append(
            (name, sha256(payload).hexdigest()[:12], sha256(decoder.image().tobytes()).hexdigest()[:12])
        )
    return out
