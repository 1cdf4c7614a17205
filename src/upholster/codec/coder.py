"""Embedded coding of wavelet coefficients: integers to bytes, any prefix of which gives approximations.

Shapiro's zerotrees (IEEE Trans. Signal Processing 41, 1993) with the likely pass, context mixing and binary
arithmetic coding of SPEC.md. All channels share one stream, in which the largest coefficients come first.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, frozen_array
from upholster.codec import _coder_kernels as kernels
from upholster.codec._context_kernels import LEVELS, MODEL_SIZE, REFINED
from upholster.codec._model_kernels import (
    BYTES_DONE,
    BYTES_HERE,
    CODE,
    COUNTERS,
    HIGH,
    MIXERS,
    STATE_SIZE,
    UNKNOWN_BITS,
    WEIGHTS,
)
from upholster.codec.tables import POINTS, QUANTA, RECIPROCALS, SQUASH, STRETCH, THRESHOLDS
from upholster.codec.tree import BAND, FLAGS, KNOWN, LL, LOWEST, PARENT, WAITING, Band, Tree

__all__ = ["MAX_PLANE", "CoefficientDecoder", "CoefficientEncoder", "Coefficients"]

MAX_PLANE = 23
"""Magnitudes are below 2^24, so that scores fit 31 bits."""

_TABLES = frozen_array(np.concatenate([STRETCH, SQUASH, RECIPROCALS, QUANTA, THRESHOLDS]))
_ENDLESS = 2**62
_AT_ONCE = 2**16
"""Values reconstructed at a time, because a decoder's memory is limited."""

_SYMBOLS_A_BYTE, _SYMBOLS_FREE, _MOST_A_BYTE = 128, 2**16, 1024
"""The most bits that a decoder takes: this many per byte of the stream, plus this many, plus one per sample,
but of the latter at most this many per byte."""


class Coefficients:
    """Coefficients at some point of the coding: encoder and decoder know the same at the same point.

    Parameters
    ----------
    tree
        Their layout.
    plane
        The first plane; -1 if all values are 0.
    exact
        Whether a value whose planes are all known is exactly that integer (lossless profiles), or is in the
        unit interval above it.
    """

    def __init__(self, tree: Tree, plane: int, *, exact: bool = False) -> None:
        self.tree = tree
        self.exact = exact
        self._memory = _Memory(tree, plane)
        self._state = self._memory.state
        self.complete = plane < 0

    @property
    def significant(self) -> int:
        """How many coefficients are known to be significant."""
        return int(self._state[kernels.SIGNIFICANT_COUNT])

    @property
    def plane(self) -> int:
        """The plane that is being decoded; -1 if all are decoded."""
        return int(self._state[kernels.PLANE])

    def magnitudes(self) -> NDArray[np.int32]:
        """Return the parts known for certain: values with unknown low bits set to 0, (tree.size,)."""
        known, flags = self._memory.m[KNOWN], self._memory.m[FLAGS]
        return np.where(flags & kernels.NEGATIVE, -known, known)

    def values(self, band: Band, expected: int = 0) -> FloatArray:
        """Return the best estimate of a band: values in their intervals, (rows, columns), multiples of 1/64.

        A value's position in its interval follows from the refinement bits so far (SPEC.md,
        "Reconstruction"). It is done band by band, so that little memory is needed in addition to the
        coder's own.

        Parameters
        ----------
        band
            One of the tree's.
        expected
            The values where nothing known contradicts them; 0: nothing is expected.
        """
        places = self.tree.places(band)
        found = np.empty(places.shape)
        rows = max(1, _AT_ONCE // max(1, band.columns))
        for start in range(0, band.rows, rows):
            part = places[start : start + rows]
            found[start : start + rows] = self._guesses(band, part, expected)
        return found

    def _guesses(self, band: Band, places: NDArray[np.int32], expected: int) -> FloatArray:
        # The best estimate of some rows of a band.
        plane = self.plane
        flags, known = self._memory.m[FLAGS, places], self._memory.m[KNOWN, places]
        lowest = np.where(self._refined(band, places, flags), plane, plane + 1)
        later = (known >> (lowest + 1)) > 0
        point = self._points()[band.kind, band.level][later.astype(np.intp)]
        exact = self.exact & (lowest <= self.tree.table[self.tree.bands.index(band), LOWEST])
        magnitude = known + np.where(exact, 0, point * 2.0**lowest) / 64
        negative = flags & kernels.NEGATIVE != 0
        rest = 0
        if expected:
            agrees = ~negative & (expected >> lowest == known >> lowest)
            magnitude[agrees] = expected
            # Insignificant values are below the plane; values well below the expected one may be 0 as well.
            rest = 0 if expected >> (plane + 3) else min(expected, 2 ** (plane + 1) - 1)
        np.negative(magnitude, out=magnitude, where=negative)
        magnitude[flags & kernels.SIGNIFICANT == 0] = rest
        return magnitude

    def _refined(self, band: Band, places: NDArray[np.int32], flags: NDArray[np.int32]) -> NDArray[np.bool_]:
        # Which values of a band are known down to the current plane, not only to the previous one.
        if self.plane < 0:
            return np.zeros(places.shape, bool)  # plane + 1 = 0 is known for all
        newly = flags & kernels.NEWLY != 0
        phase = int(self._state[kernels.PHASE])
        if phase == kernels.DOMINANT:
            return np.ones(places.shape, bool)
        if phase != kernels.SUBORDINATE:
            return newly if phase == kernels.LIKELY else np.zeros(places.shape, bool)
        segments, done = self.tree.segments, int(self._state[kernels.SEGMENT])
        # A band's region is one segment; segments before the current one are completely refined.
        segment = int(np.flatnonzero(segments[:, 0] == band.begin)[0])
        if segment != done:
            return newly | (segment < done)
        return newly | (places < int(self._state[kernels.PLACE]))

    def _points(self) -> NDArray[np.int64]:
        counts = self._memory.a[REFINED:].astype(np.int64).reshape(4, LEVELS, 2, 2)
        zeros, ones = counts[..., 0] + 9, counts[..., 1] + 7
        return POINTS[64 * ones // (zeros + ones)].astype(np.int64)


class CoefficientEncoder(Coefficients):
    """Encodes coefficients, most significant plane first, and pauses at requested points.

    Parameters
    ----------
    values
        (tree.size,) int32 in the tree's order, magnitudes below 2^24, 0 in the padding.
    tree, exact
        As for all `Coefficients`.
    """

    def __init__(self, values: NDArray[np.int32], tree: Tree, *, exact: bool = False) -> None:
        super().__init__(tree, int(np.abs(values).max()).bit_length() - 1, exact=exact)
        self._values = np.ascontiguousarray(values)
        self._deepest = _deepest(values, tree)
        self._data = np.empty(4 * tree.size + 4096, np.uint8)

    @property
    def length(self) -> int:
        """Bytes so far. A decoder of these knows the same as this encoder, except for the last few bits."""
        return max(int(self._state[BYTES_DONE]), self._memory.bytes_due)

    def code(self, most_bytes: int | None, most_significant: int | None) -> bool:
        """Continue to a length or a number of significant coefficients; return whether that was the end.

        It ends after the last plane, or at the wanted number of significant coefficients.
        """
        limit = _ENDLESS if most_bytes is None else most_bytes
        share = _ENDLESS if most_significant is None else most_significant
        self.complete = self._memory.code(self._data, self._values, self._deepest, True, limit, share)
        return self.complete or self.significant >= share

    def stream(self, *, ended: bool) -> bytes:
        """Return the bytes so far; if it has ended, with those that determine the very last bits."""
        data = self._data[: int(self._state[BYTES_DONE])].tobytes()
        # The upper end of the interval determines every bit coded so far.
        data += int(self._state[HIGH]).to_bytes(4, "big") if ended else b""
        # A decoder takes a limited number of bits per byte: zeros are added if bytes code more.
        return data + bytes(max(0, self._memory.bytes_due - len(data)))


class CoefficientDecoder(Coefficients):
    """Decodes the stream of a `CoefficientEncoder` as its bytes arrive, with work proportional to new bytes.

    Parameters
    ----------
    tree, plane, exact
        As for all `Coefficients`.
    """

    def __init__(self, tree: Tree, plane: int, *, exact: bool = False) -> None:
        super().__init__(tree, plane, exact=exact)
        self._data = np.zeros(256, np.uint8)
        self._state[UNKNOWN_BITS] = 0xFFFFFFFF
        self._state[BYTES_DONE] = 4

    @property
    def received(self) -> int:
        """Bytes fed so far."""
        return int(self._state[BYTES_HERE])

    @property
    def unread(self) -> int:
        """Bytes after the end of a complete stream, which are ignored."""
        used = max(int(self._state[BYTES_DONE]), self._memory.bytes_due)
        return max(0, self.received - used) if self.complete else 0

    def feed(self, data: bytes) -> None:
        """Take further bytes; decode every symbol that they determine, up to the limit for these bytes."""
        state, here = self._state, self.received
        if here + len(data) > len(self._data):
            grown = np.zeros(max(2 * len(self._data), here + len(data)), np.uint8)
            grown[:here] = self._data[:here]
            self._data = grown
        self._data[here : here + len(data)] = np.frombuffer(data, np.uint8)
        state[BYTES_HERE] = here + len(data)
        state[kernels.MOST_SYMBOLS] = self._memory.bits_of(self.received)
        # Bytes that the code register has read as missing.
        for place in range(here, min(here + len(data), int(state[BYTES_DONE]))):
            shift = 8 * (int(state[BYTES_DONE]) - 1 - place)
            state[CODE] |= int(self._data[place]) << shift
            state[UNKNOWN_BITS] &= ~(255 << shift)
        if not self.complete:
            nothing = np.zeros(0, np.int32)
            self.complete = self._memory.code(self._data, nothing, nothing, False, _ENDLESS, _ENDLESS)


class _Memory:
    """Everything that changes while planes are coded, and the call that does it."""

    def __init__(self, tree: Tree, plane: int) -> None:
        size = tree.size
        self.tree = tree
        self.state = np.zeros(STATE_SIZE, np.int64)
        self.state[HIGH] = 0xFFFFFFFF
        self.state[kernels.PLANE] = plane
        self.samples = sum(band.rows * band.columns for band in tree.bands)
        self.state[kernels.MOST_SYMBOLS] = _ENDLESS
        self.m = np.zeros((WAITING + 1, size), np.int32)
        self.m[: BAND + 1] = tree.links
        self.m[FLAGS] = tree.flags
        self.a = np.empty(MODEL_SIZE, np.int32)
        self.a[: len(_TABLES)] = _TABLES
        weights = self.a[WEIGHTS:COUNTERS].reshape(MIXERS, 8)
        # Each input starts with a weight of 1.1 over their number.
        weights[:28], weights[28:32], weights[32:36], weights[36:] = 24030, 14418, 24030, 36045
        self.a[COUNTERS:REFINED] = (1 << 19) << 10
        self.a[REFINED:] = 0

    @property
    def bytes_due(self) -> int:
        """The least number of bytes that may code so many bits."""
        bits = int(self.state[kernels.SYMBOLS]) - _SYMBOLS_FREE
        all_of = -(-bits // (_MOST_A_BYTE + _SYMBOLS_A_BYTE))
        return max(0, all_of, -(-(bits - self.samples) // _SYMBOLS_A_BYTE))

    def bits_of(self, count: int) -> int:
        """Return the most bits that a decoder takes from so many bytes (SPEC.md, section 7.2)."""
        return min(self.samples, _MOST_A_BYTE * count) + _SYMBOLS_A_BYTE * count + _SYMBOLS_FREE

    def code(
        self,
        data: NDArray[np.uint8],
        values: NDArray[np.int32],
        deepest: NDArray[np.int32],
        encoding: bool,
        most_bytes: int,
        most_significant: int,
    ) -> bool:
        """Code planes from the current state, see `code_planes`; return whether all are done."""
        return kernels.code_planes(
            kernels.Coder(self.state, data, self.a),
            values,
            deepest,
            self.m,
            self.tree.table,
            self.tree.segments,
            self.tree.roots,
            encoding,
            most_bytes,
            most_significant,
        )


def _deepest(values: NDArray[np.int32], tree: Tree) -> NDArray[np.int32]:
    """Return the largest magnitude among each coefficient's descendants."""
    magnitudes = np.abs(values)
    deepest = np.zeros(tree.size, np.int32)
    parent = tree.links[PARENT]
    for band in sorted(tree.bands, key=lambda band: (band.level, -band.kind)):
        if band.kind != LL:
            places = tree.places(band).reshape(-1)
            np.maximum.at(deepest, parent[places], np.maximum(magnitudes[places], deepest[places]))
    deepest[0] = 0
    return deepest
