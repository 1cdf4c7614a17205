"""What is measured of a case, from files alone: the model or picture that a version wrote, and the sample."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.sheet_cases import Case
from benchmarks.sheet_views import broken, find, flat_views, recurrence, views
from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.charts.creases import CREASE
from upholster.covering.measure import patch_distance, sliced_wasserstein, wrap_seams
from upholster.covering.measure.samples import bilinear
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.material_files import read_material
from upholster.image.files.read import read_exemplar, read_image
from upholster.output.glb_picture import ShownModel, shown_model

__all__ = ["MEASURES", "Figures", "Measure", "measure", "seam_ratio"]

Figures = dict[str, float]
"""By the names of `MEASURES`; what does not apply is left out."""

INSIDE = 0.15
"""Share of the edges inside charts that are looked at."""

ALONG = (0.2, 0.4, 0.6, 0.8)
BROKEN_OFF = 0.75
"""Texels by which an edge's places in two triangles differ where a seam runs along it."""

LEAST_TELLING = 20
"""Views that tell size and direction, below which nothing is said of them."""


@dataclass(frozen=True)
class Measure:
    """How a figure is read.

    Attributes
    ----------
    form
        How it is written.
    better
        "low", "high", or "one": as near to 1 as can be.
    noise
        By how much it may be worse and mean nothing: of three seeds of one version two differ by less, where
        the second is worse, in nine cases of ten. Of "one" it is a difference of logarithms.
    share
        The same as a share of the revision's figure; the larger of both counts.
    """

    form: str
    better: str
    noise: float = 0.0
    share: float = 0.0

    def worse(self, before: float, after: float) -> bool:
        """Return whether a figure became worse by more than noise."""
        loss = {
            "low": after - before,
            "high": before - after,
            "one": abs(np.log(max(after, 1e-9))) - abs(np.log(max(before, 1e-9))),
        }[self.better]
        return bool(loss > max(self.noise, self.share * abs(before)) + 1e-9)


MEASURES = {
    "seam": Measure("{:.3f}", "one", 0.09),
    "wrap": Measure("{:.3f}", "one", 0.09),
    "size": Measure("{:.0%}", "high", 0.15),
    "direction": Measure("{:.0%}", "high", 0.06),
    "sure": Measure("{:.0%}", "high", 0.08),
    "broken": Measure("{:.1%}", "low", 0.025),
    "recurrence": Measure("{:.2f}", "low", 0.3),
    "swd": Measure("{:.4f}", "low", 0.0005),
    "patches": Measure("{:.3f}", "low", 0.05),
    "left_out": Measure("{:.3f}", "low", 0.06),
    "stream": Measure("{:.0f}", "low", 0, 0.01),
    "processor": Measure("{:.2f}", "low", 0.3, 0.2),
    "seconds": Measure("{:.2f}", "low", np.inf),
}
"""All measures, in the order of the table; docs/measures.md defines them."""


def measure(case: Case, result: Path, where: Mapping[str, Path]) -> Figures:
    """Measure what a version wrote: a GLB, or a flat picture."""
    sample = _sample(where[case.sample], case.pixels)
    found: Figures = {}
    if case.is_flat:
        image = _colored(read_image(result))
        seen = flat_views(image)
        shown = [image]
        wrap = wrap_seams(image) if case.is_tile else None
        if wrap is not None:
            found["wrap"] = wrap.ratio
    else:
        model = shown_model(result)
        pixel = case.length / sample.shape[1] if case.size else None
        shown = seen = views(model, pixel, case.direction)
        ratio = seam_ratio(model)
        if ratio is not None:
            found["seam"] = ratio
    if not seen:
        return found
    found["swd"] = float(np.mean(sliced_wasserstein(shown, sample)))
    if (patches := patch_distance(shown, sample)) is not None:
        found["patches"], found["left_out"] = patches.to_sample, patches.to_result
    return found | _mapped(seen, sample)


def _mapped(seen: list[PixelArray], sample: PixelArray) -> Figures:
    """Return what views tell by where in the sample they come from."""
    places = find(seen, sample)
    found = {"sure": float(places.sure.mean())}
    if places.telling.sum() >= LEAST_TELLING:
        size, angle = places.size[places.telling], places.angle[places.telling]
        found["size"] = float((np.abs(np.log(size)) < np.log(1.05)).mean())
        found["direction"] = float((angle < 5).mean())
    lattice = find_lattice(sample)
    figures = {
        "broken": None if lattice is None else broken(seen, sample, places, lattice),
        "recurrence": recurrence(places, sample.shape),
    }
    return found | {name: figure for name, figure in figures.items() if figure is not None}


def seam_ratio(model: ShownModel) -> float | None:
    """Return how colour steps across the charts' seams, over how it steps across edges inside charts.

    A step goes from half a texel on one side of an edge of triangles to half a texel on the other, and is
    taken relative to the steps beside it, from half a texel to one and a half: so neither the place nor the
    direction of seams counts. 1 is invisible, more shows, less is blur. Over creases texture starts anew:
    edges that bend by 75° or more are left out. None where there is no seam.
    """
    ends, faces = _edges(model.corners)
    normals = np.cross(*np.moveaxis(model.corners[:, 1:] - model.corners[:, :1], 1, 0))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    chosen = (normals[faces[:, 0]] * normals[faces[:, 1]]).sum(axis=1) > np.cos(np.radians(CREASE))
    texels = model.uv - 0.5
    along = [texels[faces[:, side, None], ends[:, side]] for side in (0, 1)]
    apart = np.linalg.norm(along[0] - along[1], axis=2).max(axis=1) > BROKEN_OFF
    chosen &= apart | (np.random.default_rng(0).random(len(apart)) < INSIDE)
    apart, faces = apart[chosen], faces[chosen]
    along = [places[chosen] for places in along]
    if not apart.any() or apart.all():
        return None
    near, far = (
        [_beside(model.color, texels[faces[:, side]].mean(axis=1), along[side], away) for side in (0, 1)]
        for away in (0.5, 1.5)
    )
    length = np.linalg.norm(along[0][:, 1] - along[0][:, 0], axis=1)
    across = np.abs(near[0] - near[1]).mean(axis=(1, 2)) * length
    beside = np.mean([np.abs(near[side] - far[side]).mean(axis=(1, 2)) for side in (0, 1)], axis=0) * length
    seams, inside = (across[part].sum() / max(float(beside[part].sum()), 1e-9) for part in (apart, ~apart))
    return float(seams / max(inside, 1e-9))


def _edges(corners: FloatArray) -> tuple[IntArray, IntArray]:
    """Return edges between two triangles: (E, 2 sides, 2 ends), corners 0 to 2, and (E, 2) triangles."""
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    welded = np.unique(
        np.round(corners.reshape(-1, 3) / size * 1e6).astype(np.int64), axis=0, return_inverse=True
    )
    vertex = welded[1].reshape(-1, 3)
    ends = np.concatenate([np.tile(pair, (len(vertex), 1)) for pair in ((0, 1), (1, 2), (2, 0))])
    face = np.tile(np.arange(len(vertex)), 3)
    names = vertex[face[:, None], ends]
    turned = names[:, 0] > names[:, 1]
    ends[turned], names[turned] = ends[turned][:, ::-1], names[turned][:, ::-1]
    _, number, count = np.unique(names, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(number.reshape(-1), kind="stable")
    two = order[np.repeat(count == 2, count)].reshape(-1, 2)
    return ends[two], face[two]


def _beside(color: PixelArray, middles: FloatArray, ends: FloatArray, away: float) -> FloatArray:
    """Return colours (E, 4, 3) so many texels from points along edges, toward the triangles' middles."""
    start, step = ends[:, 0], ends[:, 1] - ends[:, 0]
    inward = middles - start
    share = (inward * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-12)
    inward = inward - step * share[:, None]
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-12)
    places = start[:, None] + np.array(ALONG)[:, None] * step[:, None] + away * inward[:, None]
    flat = places.reshape(-1, 2)
    seen = bilinear(color[:, :, :3], flat[:, 1], flat[:, 0])
    return np.asarray(seen.reshape(len(ends), len(ALONG), 3))


def _sample(path: Path, pixels: int) -> PixelArray:
    """Return a sample as the command reads it, in three channels: of a material the base colour."""
    if path.is_dir():
        return _colored(read_material(path, resize=pixels).maps["albedo"])
    return _colored(read_exemplar(path, resize=pixels))


def _colored(image: PixelArray) -> PixelArray:
    return image[:, :, :3] if image.shape[2] >= 3 else np.repeat(image[:, :, :1], 3, axis=2)
