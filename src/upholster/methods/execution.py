"""From a scene and an exemplar to a quilt, by the scene's method."""

from dataclasses import replace

from upholster.geometry import AnySurface, Surface
from upholster.methods.exemplar import Exemplar
from upholster.methods.paper.method import PaperOptions, synthesize_paper
from upholster.methods.patch_scene import PatchScene
from upholster.methods.pixel.method import synthesize_pixel
from upholster.methods.quilt.method import laid_quilt, lay_plan
from upholster.methods.quilt.scene import Scene
from upholster.quilt.model import Quilt
from upholster.stages import stage

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
