"""What the gallery's README says under each picture, in Markdown."""

from textwrap import dedent, fill

from gallery_tools.results import twelve_paths
from gallery_tools.shots import Exemplars, kind_of
from gallery_tools.surfaces import stretch_ratios

__all__ = ["CAPTIONS", "HEAD", "caption"]

HEAD = """\
# Gallery

Made by `python docs/make_gallery.py FOLDER_OF_EXEMPLARS`; not to be edited by hand. Figure numbers are
those of R. N. Shet, H. E. Bez, E. A. Edirisinghe: *Progressive texture synthesis on geometric surfaces
parametrised by bi-quadratic rational Bézier patches*; the method is the paper's throughout. The photographs
in the committed pictures are CC0, by Poly Haven, ambientCG and Nobiax; they are not part of the project.
"""

CAPTIONS = {
    "hero": """\
        The project's own `bricks.png` on a ring Dupin cyclide. The same picture:

            upholster cover examples/bricks.png --on cyclide:spans=8x4 --chart 192 --block 96 --overlap 32 \\
                --seed 5 -o ring.png --size 1000x750 --view 150,32 --supersample 4
        """,
    "strip": """\
        `weave.png` on a torus (`--on torus:R=2,r=0.9,spans=12x4 --chart 128`), `pebbles.png` on a vase (`--on
        vase --chart 192`) and `granite.png` on a sphere (`--on sphere --chart 320`), each with `--block 64
        --overlap 16 --seed 1`. All three exemplars are in `examples`.
        """,
    "surface": """\
        The ring Dupin cyclide with a = 6, c = 2, µ = 3, and its trigonometric parameters: θ runs round the
        ring and starts on the thin side, φ runs round the tube and starts in the hole. Thin lines are 22.5°
        apart.
        """,
    "patches": """\
        (a) The four bi-quadratic rational patches with θ and φ between 0° and 180°, seen from below, with
        their control points; what lies behind the surface is pale. All weights are positive, so each patch
        lies in the convex hull of its points. (b) Sixteen such patches are the whole surface, exactly.
        """,
    "decomposition": """\
        An exemplar and its three-level Haar transform: HL holds vertical details, LH horizontal ones, HH
        diagonal ones. LL3 and HH3, each 1/64 of the coefficients, are all that matching looks at.
        """,
    "matching": """\
        A block of 32 × 32 texels is about to be placed (a); its overlap with what is there, 8 texels wide,
        covers seven tiles. It may come from any of 13 × 13 places on the grid of LL3 in a 128 × 128 exemplar
        (b: their top left corners). A place costs the sum of squared differences of the overlap's LL3 and HH3
        coefficients (c, d); the cheapest one is taken.
        """,
    "seams": """\
        Patches are covered one by one, so texture breaks off at their edges (a, c; red arrows point at the
        edge). Edge blocks that straddle the edge mend it (b, d). For each of them (e) the best match by LL3
        and HH3 is found in the exemplar (f), a minimum cut decides which part of it replaces the seam (g),
        and that is embedded in both patches, feathered (h).
        """,
    "levels": """\
        Two streams as they arrive: the model when 3, 5, 7, 15 and 100 % of the exemplar's coefficients are
        significant, with the bytes received until then, surface and placements included, and the texels' PSNR
        against the whole stream. `upholster levels ring.uph -o levels.png` makes a row.
        """,
    "curve": """\
        The texels' PSNR against the whole stream, over its bytes. The first view shows the exemplar repeated;
        then the placements come, chart after chart; what follows refines the exemplar. `upholster levels
        ring.uph --curve -o curve.png`.
        """,
    "mapping": """\
        Each patch is a grid of quadrilaterals, here 8 × 8, and each of them takes its texture from a square
        of texture space (the same colour in a and b). Black lines are the patches' borders.
        """,
    "twelve": """\
        Twelve textures on the sphere (eight octants, degenerate at the poles), the torus and the cyclide, one
        column per class of texture. Exemplars are 256 × 256, blocks 32 × 32, and seams are mended. What is
        left to see is the method's own: texture shrinks at the sphere's poles and stretches on the wide sides
        (e, i), and large regular elements do not always continue from patch to patch (b).
        """,
    "stretch": """\
        Every patch carries the same dots. A texel on the thick side is up to {length:.2g} times as long
        (round the ring), up to {width:.2g} times as wide (round the tube), and up to {area:.2g} times as
        large as where it is smallest; (b) shows the square root of its area. The paper does not speak of it,
        and its method does nothing about it; keeping scale and direction even over the surface is for the
        next method.
        """,
}


def caption(name: str, exemplars: Exemplars) -> str:
    """Return the caption of one picture, made from these exemplars."""
    words = dedent(CAPTIONS[name])
    if name == "stretch":
        length, width, area = stretch_ratios()
        words = words.format(length=length, width=width, area=area)
    if name == "twelve":
        words += "\n" + _listed(exemplars)
    return words


def _listed(exemplars: Exemplars) -> str:
    """Say which exemplars the figure with twelve textures shows."""
    items = []
    for letter, path in zip("abcdefghijkl", twelve_paths(exemplars), strict=True):
        kind = kind_of(path)
        items.append(f"({letter}) {path.stem.removeprefix(f'{kind}_').replace('_', ' ')}")
    return fill("Exemplars: " + ", ".join(items) + ".", width=102) + "\n"
