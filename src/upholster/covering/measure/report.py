"""All measures of one result, as figures, rows of a table and JSON."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.charts.creases import CREASE
from upholster.charts.directions.direction import Direction, parse_direction
from upholster.covering.measure.crossings import Crossings, crossings
from upholster.covering.measure.cuts import cut_seam_ratio, matched_cut_ratio
from upholster.covering.measure.faults import BrokenElements, broken_elements
from upholster.covering.measure.fidelity import sliced_wasserstein
from upholster.covering.measure.joint_ends import JointEnds, joint_ends
from upholster.covering.measure.mapping import MappingReport, mapping
from upholster.covering.measure.measure_rows import Row, figure
from upholster.covering.measure.mesh_seams import mesh_seams
from upholster.covering.measure.patch_distance import PatchDistance, patch_distance, undistorted_views
from upholster.covering.measure.scale import TexelScale, texel_scale
from upholster.covering.measure.seams import WrapSeams, edge_seam_ratio, wrap_seams
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.patches.surface import Surface
from upholster.image.elements.courses import find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.read import check_exemplar
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import paint
from upholster.runtime.stages import keeping

__all__ = ["Measures", "Seams", "measure_cover", "measure_image"]

LEAST_SIDE = 32


@dataclass(frozen=True, slots=True)
class Seams:
    """Seam ratios: 1.0 is invisible, more shows, less is blur; None if there is no such seam.

    Attributes
    ----------
    edges
        Across the charts' edges: `edge_seam_ratio`.
    edges_matched
        The same, compared with the exemplar at the same places: `mesh_seams`.
    cuts
        Across the borders between blocks: `cut_seam_ratio`.
    cuts_matched
        The same, compared with the exemplar at the same places: `matched_cut_ratio`.
    creases, over_creases
        The share of the charts' edges where the texture starts again, which `edges` and `edges_matched` leave
        out, and the latter ratio there. See `mesh_seams`.
    """

    edges: float | None
    edges_matched: float | None
    cuts: float | None
    cuts_matched: float | None
    creases: float = 0.0
    over_creases: float | None = None

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        rows = [
            ("seam ratio, chart edges", figure(self.edges), "1: invisible"),
            ("  against the sample there", figure(self.edges_matched), "1: invisible"),
        ]
        if self.over_creases is not None:
            rows += [
                ("  left out there: creases", f"{100 * self.creases:.1f} %", "of the edges' length"),
                ("  over creases", figure(self.over_creases), "texture restarts"),
            ]
        return [
            *rows,
            ("seam ratio, block borders", figure(self.cuts), "1: invisible"),
            ("  against the sample there", figure(self.cuts_matched), "1: invisible"),
        ]


@dataclass(frozen=True, slots=True)
class Measures:
    """The measures of one result.

    Attributes
    ----------
    wasserstein
        Sliced Wasserstein distance from the exemplar per pyramid level, finest first.
    seams, scale, mapping
        None for a flat image, which does not provide them.
    wrap
        `wrap_seams`, for a flat image that is meant to be tiled, else None.
    broken
        `broken_elements`; None for a flat image, or if the exemplar has no certain lattice.
    joints
        `joint_ends`; None for a flat image, or if the exemplar has no certain joints.
    patches
        `patch_distance`; None if an image is smaller than a patch.
    crossings
        `crossings`; None for a flat image, or if there are no seams.
    """

    wasserstein: tuple[float, ...]
    seams: Seams | None = None
    scale: TexelScale | None = None
    mapping: MappingReport | None = None
    wrap: WrapSeams | None = None
    broken: BrokenElements | None = None
    joints: JointEnds | None = None
    patches: PatchDistance | None = None
    crossings: Crossings | None = None

    @property
    def wasserstein_mean(self) -> float:
        """The mean over the levels, the usual single figure."""
        return sum(self.wasserstein) / len(self.wasserstein)

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain dictionaries, lists and numbers; infinite ones become None."""
        found = asdict(self) | {"wasserstein_mean": self.wasserstein_mean}
        plain: dict[str, Any] = _plain(found)
        return plain

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        of_surface = (
            self.seams,
            self.crossings,
            self.wrap,
            self.broken,
            self.joints,
            self.mapping,
            self.scale,
        )
        rows = [row for found in of_surface if found is not None for row in found.rows()]
        levels = " ".join(f"{1000 * value:.2f}" for value in self.wasserstein)
        rows += [
            ("sliced Wasserstein, 1e-3", f"{1000 * self.wasserstein_mean:.3f}", "0: the sample"),
            ("  by level", levels, "finest first"),
        ]
        return rows + ([] if self.patches is None else self.patches.rows())


def measure_cover(
    surface: AnySurface,
    quilt: Quilt,
    exemplar: PixelArray,
    *,
    texels: Texels | None = None,
    scale: float | None = None,
    direction: str | Direction | None = None,
    crease: float | None = None,
    threads: int | None = None,
) -> Measures:
    """Measure a covered surface by all measures.

    Parameters
    ----------
    surface
        What is covered: patches, or a mesh.
    quilt
        The result of the synthesis.
    exemplar
        (H, W, C) that it was made from, and with which the result is compared.
    texels
        The quilt painted at density 1, if already available, or painted with something other than
        `exemplar`, such as a coded exemplar; by default painted with `exemplar`.
    scale, direction
        What was requested, see `mapping`: exemplar pixels per unit of length, and the direction of the
        exemplar's rows of pixels.
    crease
        Degrees at which the texture was to start again, 1 to 180, as in `SynthesisOptions`; see
        `mesh_seams`.
    threads
        For painting: 1 to 256; by default one per core.

    Returns
    -------
    Measures
        All of them.

    Raises
    ------
    InputError
        If the exemplar is not valid, or surface, quilt, texels and exemplar do not belong together.
    """
    exemplar = check_exemplar(exemplar)
    if texels is None:
        texels = paint(quilt, exemplar, density=1.0, threads=threads)
    elif texels.charts != quilt.charts:
        raise InputError(
            "texels have other charts than the quilt; allowed: the quilt's own, painted at density 1"
        )
    crease = CREASE if crease is None else crease
    if not 1 <= crease <= 180:
        raise InputError(f"crease is {crease:g} degrees; allowed: 1 to 180")
    quilt = quilt.on(surface, seed=quilt.seed)
    wanted = None
    if direction is not None:
        wanted = parse_direction(direction, patches=isinstance(surface, Surface))
    with keeping():
        lattice, joints = find_lattice(exemplar), find_joints(exemplar)
        edges = mesh_seams(surface, quilt, texels, exemplar, crease=crease)
        views = undistorted_views(quilt, texels)
        # Texels may be larger or smaller than the sample's pixels, and turned; small charts have no views.
        shown = views or texels.arrays
        return Measures(
            wasserstein=sliced_wasserstein(shown, exemplar),
            seams=Seams(
                edge_seam_ratio(surface, texels, fields=quilt.fields, crease=crease),
                edges.ratio,
                cut_seam_ratio(quilt, texels),
                matched_cut_ratio(quilt, texels, exemplar),
                edges.creases,
                edges.over_creases,
            ),
            scale=texel_scale(surface, quilt.charts),
            mapping=mapping(surface, quilt, scale=scale, direction=wanted),
            broken=None
            if lattice is None
            else broken_elements(
                quilt, lattice, surface, courses=find_courses(lattice, joints), crease=crease
            ),
            joints=None if joints is None else joint_ends(quilt, joints, surface, crease=crease),
            patches=patch_distance(views, exemplar) if views else None,
            crossings=crossings(surface, quilt),
        )


def measure_image(image: PixelArray, exemplar: PixelArray, *, tileable: bool = False) -> Measures:
    """Measure a flat result against its exemplar, as far as a picture alone allows.

    Parameters
    ----------
    image
        (h, w, C), sides of at least 32: the result.
    exemplar
        (H, W, C), of the same number of channels.
    tileable
        Whether it is meant to be laid side by side.

    Returns
    -------
    Measures
        Sliced Wasserstein and patch distance; the wrapped edges' seams of a tileable image.

    Raises
    ------
    InputError
        If the image is too small or not finite, either array is not an image, or their channels differ.
    """
    exemplar = check_exemplar(exemplar)
    if image.ndim != 3 or min(image.shape[:2]) < LEAST_SIDE:
        size = "×".join(str(side) for side in image.shape[1::-1])
        raise InputError(f"image is {size} pixels; allowed: at least {LEAST_SIDE}×{LEAST_SIDE}")
    if image.dtype not in ("uint8", "uint16", "float32"):
        raise InputError(f"image is of {image.dtype}; allowed: uint8, uint16, float32")
    if image.dtype.kind == "f" and not np.isfinite(image).all():
        raise InputError("image holds samples that are not finite; allowed: finite numbers")
    if image.shape[2] != exemplar.shape[2]:
        raise InputError(
            f"image has {image.shape[2]} channels, the sample {exemplar.shape[2]}; allowed: equal numbers"
        )
    return Measures(
        sliced_wasserstein([image], exemplar),
        wrap=wrap_seams(image) if tileable else None,
        patches=patch_distance([image], exemplar),
    )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
