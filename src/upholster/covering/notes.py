"""Notes before the work: what in a sample, a model or the options will disappoint, and what helps."""

import math

import numpy as np

from upholster.base.display import texels_in_words
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.layout import MOST_TEXELS, TextureScale
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.mesh_state import inside_out_parts
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import element_of
from upholster.image.photo.even_light import UNEVEN, light_range
from upholster.image.sameness import differing_region
from upholster.output.reports import covering, painted_texels
from upholster.quilt.chart import Chart
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.quilt.phases import better_tile, stretched_by
from upholster.synthesis.quilt.scene import Scene

__all__ = ["notes_before", "sample_notes"]

_SOFT, _COARSE = 0.4, 1.2
"""Pixels of the sample per texel: below the first a texture looks soft, above the second it loses detail."""

_ELEMENT_TEXELS, _TEXEL_PIXELS, _BLURRED = 8, 8, 2.0
"""Fewest texels across an element; most pixels of the sample per texel if its elements are not known; and how
many there are in any case before a note asks for more texels."""

_TIMES = 4
"""The size that a note suggests for a sample that is wider than the model fits this often along it."""

_FEW = 4
"""Number of elements across a sample below which a note advises more."""

_STRETCHED = 0.01
"""Stretch from which a note names a better size of a tile."""

_SMOOTHED = 0.01
"""Part of the surface from which a note reports that sizes are smoothed there."""

_LISTED = 3
"""Number of part names that a note lists."""

_MANY_TEXELS = 2**25
"""Size from which a note before the work reports the size of the files."""


def sample_notes(sample: PixelArray) -> list[str]:
    """Return reasons why a sample (H, W, C) may not be suitable, and advice."""
    if region := differing_region(sample):
        return [
            f"the sample does not look like one texture: {region} has another colour than the rest; "
            "use --crop or --rectify to take a part of it"
        ]
    found = []
    if (uneven := light_range(sample)) > UNEVEN:
        found.append(f"the light on the sample varies by a factor of {uneven:.1f}; --even-light removes that")
    joints = find_joints(sample)
    if joints is not None and joints.across < _FEW:
        found.append(
            f"the sample is about {joints.across:.1f} stones, boards or tiles across; with fewer than {_FEW} "
            "the same ones show again and again: a larger piece of the material has more"
        )
    return found


def notes_before(surface: AnySurface, scene: Scene | PatchScene, sample: PixelArray, maps: int) -> list[str]:
    """Return notes before the work begins; `maps` are those whose texels are kept."""
    found = _mesh_notes(surface) if isinstance(surface, MeshSurface) else _patch_notes(surface)
    found += sample_notes(sample)
    if isinstance(scene, Scene) and scene.scale is not None:
        found += _size_notes(surface, scene.scale)
        found += _resolution_notes(scene, scene.scale, sample)
    if isinstance(scene, Scene) and scene.sizes is not None and scene.sizes.smoothed >= _SMOOTHED:
        share = f"{100 * scene.sizes.smoothed:.0f} %"
        found.append(f"size changes faster than blocks can follow on {share} of the surface: smoothed")
    painted = painted_texels(scene.painted)
    if painted > _MANY_TEXELS and maps:
        size = painted * sample.itemsize * 3 * maps
        texels = texels_in_words(covering(surface, scene.painted), painted)
        found.append(
            f"{texels}: {size / 1e9:.1f} GB of texels in memory, and images of about half of that; "
            "fewer by --texels or --density"
        )
    if isinstance(scene, Scene) and scene.waves is not None and scene.options.tileable:
        found += _tile_notes(scene.charts[0], scene.waves)
    return found


def _tile_notes(chart: Chart, waves: FloatArray) -> list[str]:
    stretched = stretched_by(waves, chart.height, chart.width)
    height, width = better_tile(waves, chart.height, chart.width)
    less = stretched_by(waves, height, width)
    if stretched <= _STRETCHED or less >= 0.5 * stretched:
        return []
    return [
        f"the sample's rows or columns are stretched by {stretched:.1%}, so that the tile has whole "
        f"periods of them; {width}x{height} texels would do with {less:.1%}"
    ]


def _patch_notes(surface: Surface) -> list[str]:
    count, tolerance = surface.nearly_meeting
    if not count:
        return []
    return [
        f"{count} edges nearly meet, but are farther apart than the tolerance of {surface.tolerance:g} "
        f"times the surface's size; a tolerance of {tolerance:g} would join them"
    ]


def _mesh_notes(surface: MeshSurface) -> list[str]:
    mesh = surface.mesh
    inward = inside_out_parts(mesh)
    inward[np.setdiff1d(np.arange(len(inward)), mesh.part[surface.island >= 0])] = False
    names = [mesh.parts[number] for number in np.flatnonzero(inward)]
    if not names:
        return []
    listed = ", ".join(names[:_LISTED]) + (" …" if len(names) > _LISTED else "")
    return [
        f"the faces of {listed} point inward: the texture is mirrored as seen from outside, and other "
        "programs may not show it; Blender's Mesh > Normals > Recalculate Outside turns them"
    ]


def _size_notes(surface: AnySurface, scale: TextureScale) -> list[str]:
    box = surface.mesh.box if isinstance(surface, MeshSurface) else surface.box
    longest = float(np.ptp(box, axis=0).max())
    if scale.sample_size <= longest:
        return []
    return [
        f"the sample is {scale.sample_size:.3g} units wide and the model only {longest:.3g} long, so only a "
        f"part of it shows: --sample-size {longest / _TIMES:.2g} fits it {_TIMES} times along the model"
    ]


def _resolution_notes(scene: Scene, scale: TextureScale, sample: PixelArray) -> list[str]:
    """Return a note if texels are much smaller or larger than the sample's pixels; at most one."""
    wide = scale.scale / scale.density  # of a texel, in pixels of the sample
    if wide < _SOFT:
        return [
            f"the sample has {wide:.2g} pixels to a texel, so the texture will be soft: a larger sample, a "
            "smaller --sample-size or fewer texels make it sharp"
        ]
    element = _element_pixels(scene, sample)
    most = _TEXEL_PIXELS if element is None else element / _ELEMENT_TEXELS
    if wide > max(most, _BLURRED):
        most = max(most, 1.0)
        enough = _rounded_up(scale.texels * (wide / most) ** 2)
        if element is None:
            found = (
                f"a texel is {wide:.0f} pixels of the sample wide: --texels {enough} makes that {most:.0f}"
            )
        else:
            found = (
                f"an element of the sample, such as a brick, has only {element / wide:.2g} texels on its "
                f"shorter side: --texels {enough} gives it {element / most:.2g}"
            )
        return [found]
    if wide > _COARSE and scale.texels == MOST_TEXELS:
        return [
            f"a texel is {wide:.1f} pixels of the sample wide: by default there are at most 8M; "
            f"--texels {wide**2 * MOST_TEXELS / 1e6:.0f}M shows all that the sample has"
        ]
    return []


def _element_pixels(scene: Scene, sample: PixelArray) -> float | None:
    """Return the shorter side of the sample's elements, in pixels; None if they are not known."""
    if scene.waves is not None:
        return float(min(element_of(scene.waves)))
    joints = find_joints(sample)
    return None if joints is None else max(sample.shape[:2]) / max(joints.across, 1.0)


def _rounded_up(count: float) -> str:
    """Write a number of texels as for --texels, rounded up to two digits."""
    power, name = (1e6, "M") if count >= 1e6 else (1e3, "k")
    step = 10.0 ** math.floor(math.log10(count) - 1)
    return f"{math.ceil(count / step) * step / power:.6g}{name}"
