"""The work over all coverings of a model: quilts, the painted model, notes, automatic choices, counts."""

import math
from collections.abc import Sequence
from functools import partial

from upholster.coverings.covering import Covering
from upholster.image.roles import ROLES
from upholster.joined import joined_model
from upholster.options import WriteOptions
from upholster.quilt import Quilt
from upholster.quilt.painting import PAINTED_DENSITIES
from upholster.reports import counts_of, settled_words
from upholster.textured import TexturedModel
from upholster.types import Progress

__all__ = [
    "counted",
    "painted_model",
    "progress_of_each",
    "read_notes",
    "roles_of",
    "settled_values",
    "synthesized",
    "work_notes",
]


def read_notes(coverings: Sequence[Covering]) -> list[str]:
    """Return all warnings from reading."""
    return [note for each in coverings for note in each.notes]


def work_notes(coverings: Sequence[Covering], *, in_memory: bool = True) -> list[str]:
    """Return all warnings about the work ahead; see `Covering.work_notes`."""
    return [note for each in coverings for note in each.work_notes(in_memory=in_memory)]


def roles_of(coverings: Sequence[Covering], *, all_have: bool = False) -> tuple[str, ...]:
    """Return the maps, other than the base colour, that at least one covering has, or that all have."""
    has = all if all_have else any
    return tuple(role for role in ROLES if has(role in each.roles for each in coverings))


def progress_of_each(progress: Progress | None, sizes: Sequence[int]) -> list[Progress | None]:
    """Return, for each of several tasks of given sizes, a function that reports their joint progress."""
    if progress is None or len(sizes) == 1:
        return [progress] * len(sizes)
    before = [sum(sizes[:number]) for number in range(len(sizes))]

    def report(start: int, size: int, stage: str, done: int, total: int) -> None:
        assert progress is not None
        progress(stage, start + size * done // max(1, total), sum(sizes))

    return [partial(report, start, size) for start, size in zip(before, sizes, strict=True)]


def synthesized(
    coverings: Sequence[Covering], *, seed: int, threads: int | None, progress: Progress | None
) -> list[Quilt]:
    """Return the quilt of each covering."""
    shares = progress_of_each(progress, [each.texels for each in coverings])
    return [
        each.synthesized(seed=seed, threads=threads, progress=share)
        for each, share in zip(coverings, shares, strict=True)
    ]


def painted_model(
    coverings: Sequence[Covering],
    quilts: Sequence[Quilt],
    options: WriteOptions,
    *,
    texels: int | None = None,
    threads: int | None,
    progress: Progress | None,
) -> TexturedModel:
    """Return the model with the texels of all coverings; at most `texels` of them, if given."""
    shares = progress_of_each(progress, [each.texels for each in coverings])
    return joined_model(
        [
            each.textured(
                quilt,
                options,
                density=_density(coverings, each, quilt, texels),
                threads=threads,
                progress=share,
            )
            for each, quilt, share in zip(coverings, quilts, shares, strict=True)
        ]
    )


def _density(
    coverings: Sequence[Covering], covering: Covering, quilt: Quilt, texels: int | None
) -> float | None:
    """Return the texels per step with which a quilt has its share of `texels`; None: as exported."""
    all_texels = sum(each.texels for each in coverings)
    if texels is None or texels >= all_texels:
        return None
    steps = sum(chart.height * chart.width for chart in quilt.charts)
    density = math.sqrt(texels * covering.texels / all_texels / steps)
    return min(max(density, PAINTED_DENSITIES[0]), PAINTED_DENSITIES[1])


def settled_values(coverings: Sequence[Covering]) -> dict[str, str]:
    """Return automatic choices in words; for several materials, one line for each."""
    found = {
        each.name: settled_words(each.prepared, each.surface, each.asked, each.roles) for each in coverings
    }
    if len(coverings) == 1 and not coverings[0].name:
        return found[""]
    return {
        name: "; ".join(f"{key} {value}" for key, value in words.items()) for name, words in found.items()
    }


def counted(coverings: Sequence[Covering], quilts: Sequence[Quilt], model: TexturedModel) -> dict[str, int]:
    """Return counts of charts, texels and the like, over all coverings."""
    counts = [counts_of(model.surface, quilt, model.texels) for quilt in quilts]
    summed = {name: sum(each[name] for each in counts) for name in _SUMMED}
    materials = {"materials": len(coverings)} if len(coverings) > 1 else {}
    return counts[0] | summed | {"maps": 1 + len(model.maps)} | materials


_SUMMED = ("charts", "texels", "painted texels", "placements", "edge blocks")
