"""Options of method "quilt"."""

from dataclasses import dataclass

from upholster.base.options.synthesis_options import SynthesisOptions

__all__ = ["QuiltOptions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuiltOptions(SynthesisOptions):
    """Options of method "quilt", with all defaults resolved.

    Attributes
    ----------
    block
        Side of a block in exemplar pixels.
    """

    block: int = 40
