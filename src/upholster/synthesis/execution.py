"""From a scene and an exemplar to a quilt, by the scene's method."""

from dataclasses import replace

from upholster.geometry.any_surface import AnySurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.model import Quilt
from upholster.runtime.stages import stage
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.paper.method import PaperOptions, synthesize_paper
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.pixel.method import synthesize_pixel
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.scene import Scene

__all__ = ["execute"]


@stage
def execute(scene: Scene | PatchScene, exemplar: Exemplar, surface: AnySurface, *, seed: int = 0) -> Quilt:
    """Synthesise a scene; the exemplar may have any number of channels here.

    Raises
    ------
    InputError
        If the seed is out of range, or the exemplar too small.
    """
    if isinstance(scene, Scene):
        quilt = laid_quilt(lay_plan(scene, exemplar, seed=seed))
        for stays, own_seed in scene.steering.again:
            steering = replace(scene.steering, kept=(quilt, stays), differs=True)
            quilt = laid_quilt(lay_plan(replace(scene, steering=steering), exemplar, seed=own_seed))
        return quilt.on(surface, seed=seed, density=scene.density)
    assert isinstance(surface, Surface)
    options, charts, pixels = scene.options, scene.charts, exemplar.pixels
    if isinstance(options, PaperOptions):
        quilt = synthesize_paper(pixels, surface, charts, options=options, seed=seed)
    else:
        quilt = synthesize_pixel(pixels, surface, charts, options=options, seed=seed)
    return quilt.on(surface, seed=seed)
