"""Wavelet transforms: `lifting` for coding, and the paper's `haar`."""

from upholster.wavelet.haar import dwt2, idwt2, level_shape, subbands

__all__ = ["dwt2", "idwt2", "level_shape", "subbands"]
