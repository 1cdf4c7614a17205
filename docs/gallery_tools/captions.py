"""What the gallery's README says under each picture, in Markdown."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import dedent, fill

from gallery_tools.regular import photograph_paths
from gallery_tools.results import twelve_paths
from gallery_tools.shots import KINDS, Exemplars, kind_of
from gallery_tools.surfaces import stretch_ratios

__all__ = ["CAPTIONS", "HEAD", "caption"]

HEAD = """\
# Gallery

Made by `python docs/make_gallery.py FOLDER_OF_EXEMPLARS`; not to be edited by hand. The paper's figures
from the project's own exemplars: `python docs/make_gallery.py paper OUT`. Figure numbers are those of R.
N. Shet, H. E. Bez, E. A. Edirisinghe: *Progressive texture synthesis on geometric surfaces parametrised
by bi-quadratic rational Bézier patches*; figures with a number show method "paper", the paper's, the
others method "quilt" unless they say otherwise. The photographs in the committed pictures are CC0, by
Poly Haven, ambientCG and Nobiax; they are not part of the project. `bricks.png`, `weave.png`,
`pebbles.png`, `granite.png` and `bricks_material` are in `examples`.
"""

CAPTIONS = {
    "hero": """\
        The project's own `bricks.png` on a ring Dupin cyclide. The same picture:

            upholster cover examples/bricks.png --on cyclide --texels 4M --sample-size 5 \\
                --direction around:z --seed 3 --view 150,32 -o ring.png --size 1000x750 --supersample 4

        The ring is five times as thick on one side as on the other, and all bricks are of one size. So some
        rows of bricks end where the ring gets thinner.
        """,
    "chairs": """\
        The project's own `chair.glb`, in metres, in `weave.png` (`--sample-size 18cm`), `bricks.png` (`35cm`)
        and `pebbles.png` (`40cm`), each with `--texels 2M --seed 1`. Rows run level; where the surface lies
        flat, as on the seat, they run round its middle.
        """,
    "cad": """\
        Above our renderer, below Blender 5.0 (Cycles) with the same GLBs, of the third the USDZ. A knurl that
        closes round a knob (`--material "Knob=knurl.png@10mm" --direction Knob=around --fit`: the sample
        became 0.8 % wider for that) on a shaft of brushed metal (`--material "*=brushed.png@14mm" --direction
        along`). Leather over a part with fillets (`--sample-size 22mm`). Brushed metal along each part's own
        axis (`--direction along --sample-size 20mm`). Newell's teapot in `bricks.png` (`--sample-size 1.6`).
        Each has `--texels 2M --seed 1`. The parts are STEP files; they and the samples of knurl, leather and
        metal are computed. The teapot's file is not part of the project. Made by

            python -m benchmarks.cad_pictures OUT --teapot teapot.bpt --blender PYTHON_WITH_BPY --gallery
        """,
    "players": """\
        `weave.png` on a fox with a skin and three animations (`--texels 1M --seed 1`), in our renderer, in
        three.js and in Blender 5.0 (Cycles). Joints, weights, bind matrices and animations are those of the
        source, to the bit; in every pose each corner of each triangle is where the source has it, in both
        programs. The fox: model by PixelMannen (CC0), rig and animation by @tomkranis (CC BY 4.0), conversion
        to glTF by @AsoboStudio and @scurest (CC BY 4.0); it is not part of the project. Made and checked by

            python -m benchmarks.players fox.glb -o OUT --blender PYTHON_WITH_BPY --gallery
        """,
    "strip": """\
        `weave.png` on a torus (`--on torus:R=2,r=0.9 --sample-size 1.6`), `pebbles.png` on a vase (`--on vase
        --sample-size 0.8`) and `granite.png` on a sphere (`--on sphere --sample-size 0.9`), each with
        `--texels 1M --seed 1`.
        """,
    "beside": """\
        On the left `--method paper --chart 512 --block 64 --overlap 16 --seed 1`: texture is stretched as the
        patches' parameters are. On the right `--texels 4M --sample-size 5 --seed 5`, the bricks with
        `--direction around:z`: elements have one size and shape everywhere.
        """,
    "everywhere": """\
        `pebbles.png` on every built-in surface but the plane, with `--texels 1M --seed 1` and samples of 6,
        1.4, 0.6, 0.6, 0.7, 0.6, 0.6 and 0.6 units. (e, h) have poles, where an edge is one point.
        """,
    "sizes": """\
        `pebbles.png` on a torus (`--on torus:R=2,r=0.9 --texels 4M --seed 1`). The sample's width is given in
        the model's units.
        """,
    "directions": """\
        Which way the exemplar's rows run, here rows of bricks: `--direction` u, along the patches' t, here
        around the tube; v, along s; 30, degrees from u; `0,0,1`, a vector projected on the surface;
        `around:z`, around an axis. (f) is a function of points in Python. Where lines converge, rows end;
        where a projected vector vanishes, directions come from nearby (d, at the top). `bricks.png` with
        `--texels 2M --sample-size 6 --seed 1`.
        """,
    "repeating": """\
        On the left of each pair `--phase 0`: blocks only match their neighbours, rows break off
        along lines, bricks are shortened, the zigzag is lost. On the right the default: the sample's waves
        are found, and have a phase everywhere that closes. Where the surface narrows, rows and columns end
        still. Samples of 256 x 256: the project's own `bricks.png` and
        `weave.png`, others by `python -m benchmarks.lattice_samples OUT`; the net is a bent vase. All with
        `--texels 2M --direction around:z --seed 1`; the last two flat, a part of 512 x 512 texels.
        """,
    "regular": """\
        Each row a photograph of 256 x 256, at the left, on a torus, a cyclide, a vase and a sphere, with
        `--texels 1M --seed 1` and no other option. None is chosen: they are the first three of their classes
        by name.
        """,
    "irregular": """\
        The same with photographs of irregular and stochastic textures.
        """,
    "flat": """\
        Exemplars of 128 × 128 (a, d) and `--on plane --texels 512x512 --seed 1` (b, e); (c, f) are two by two
        copies of what `--texels 256x256 --tileable` makes.
        """,
    "material": """\
        `examples/bricks_material`: albedo, normal, roughness, ambient occlusion and height, by one quilt.
        Bumps are lit from the same side on all charts, for normals turn with the texture. (b) is
        `upholster cover examples/bricks_material --on torus:R=2,r=0.9 --texels 2M --sample-size 2.5
        --direction around:z --seed 1 --view 30,38 -o torus.png`; `-o torus.glb` is the same as glTF.
        """,
    "refining": """\
        The first picture's quilt as a stream (`-o ring.uph`), as it arrives. Placements come from coarse to
        fine over all charts, with the exemplar's coarse parts; then labels and details, by what they gain.
        Figures are the texels' PSNR against the whole stream.
        """,
    "studio": """\
        `upholster studio examples/weave.png examples/chair.glb`, screenshots of Chromium: a session that
        [docs/studio.md](../studio.md) tells.
        """,
    "viewer": """\
        `upholster view ring.uph`, screenshots of Chromium: the first picture's ring (a, c); and the
        laboratory (`controls="lab"`) with `examples/bricks_material` on a torus, on the left with 3 % of its
        colour's coefficients.
        """,
    "viewer_arriving": """\
        The first picture's stream, cut: above in the viewer, in the browser's software rasteriser;
        below as Python renders the same bytes.
        """,
    "viewer_light": """\
        Dragging with Shift turns the viewer's light, to judge normal maps: raised parts look raised from all
        sides.
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
    "overview": """\
        What each part makes of one exemplar; numbers are the paper's sections. The paper has the coefficients
        chosen inside the synthesis; here blocks are chosen once, with all coefficients, and painted with any
        of them.
        """,
    "on_one_patch": """\
        Above, the first block of a patch: any place on the grid of LL3, the same in every sub-band. Below,
        the block after a row and a block: its overlap is compared with every place of the exemplar, and the
        best one is laid.
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
        edge). Edge blocks across the edge repair it (b, d). For each of them (e) the best match by LL3
        and HH3 is found in the exemplar (f), a minimum cut decides which part of it replaces the seam (g),
        and that is embedded in both patches, feathered (h).
        """,
    "levels": """\
        Two streams of method paper, in the paper's profile, as they arrive: the model of the largest 3, 5, 7
        and 15 % of the sample's Haar coefficients, and the complete stream, which has all but those that are
        zero. With each stand the bytes that it takes, surface and placements included, and the texels'
        PSNR against the whole stream. `upholster levels ring.uph -o levels.png` makes a row. Samples: the
        project's bricks and granite at 128 × 128; `python docs/make_gallery.py FOLDER --only levels` with any
        folder of images.
        """,
    "curve": """\
        The first of these streams: its texels' PSNR against the whole stream, over its bytes. The first view
        shows the exemplar repeated; then the placements come, over all charts; what follows refines the
        exemplar. `upholster levels ring.uph --curve -o curve.png`.
        """,
    "mapping": """\
        Each patch is a grid of quadrilaterals, here 8 × 8, and each of them takes its texture from a square
        of texture space (the same colour in a and b). Black lines are the patches' borders.
        """,
    "baseline": """\
        The same samples by method "pixel", with both ways of search, by "paper" and by "quilt": cyclide and
        sphere (eight octants), charts of 192 x 192 texels, for "quilt" as many texels in all, and `--seed 1`.
        Seconds are of one run on two cores that others used as well, up to twice what they are on a quiet
        machine (`python -m benchmarks pixel` measures). "Seam" is the seam ratio across the edges of patches
        or charts against what the sample has there, 1: invisible. PS is the Portilla-Simoncelli error, SWD
        the sliced Wasserstein distance in 1/1000, both of what the method makes of the sample on a flat
        512 x 512; less is better. `python docs/make_gallery.py examples --only baseline`; PS needs
        the extra `fidelity`.
        """,
    "twelve": """\
        Twelve textures on the sphere (eight octants, degenerate at the poles), the torus and the cyclide, one
        column per class of texture. Exemplars are 256 × 256, blocks 32 × 32, and seams are repaired. What is
        still visible comes from the method: texture shrinks at the sphere's poles and stretches on the wide
        sides (e, i), and large regular elements do not always continue from patch to patch (b).
        """,
    "stretch": """\
        Every patch has the same dots. A texel on the thick side is up to {length:.2g} times as long
        (round the ring), up to {width:.2g} times as wide (round the tube), and up to {area:.2g} times as
        large as where it is smallest; (b) shows the square root of its area. The paper does not mention this,
        and its method does not correct it; method "quilt" does.
        """,
}


def caption(name: str, exemplars: Exemplars) -> str:
    """Return the caption of one picture, made from these exemplars."""
    words = dedent(CAPTIONS[name])
    if name == "stretch":
        length, width, area = stretch_ratios()
        words = words.format(length=length, width=width, area=area)
    if name == "twelve":
        words += "\n" + _listed(twelve_paths(exemplars))
    if name in ("regular", "irregular"):
        kinds = KINDS[:2] if name == "regular" else KINDS[2:]
        words += "\n" + _listed(photograph_paths(exemplars, kinds))
    return words


def _listed(paths: Sequence[Path]) -> str:
    """Say which exemplars a figure shows."""
    items = []
    for letter, path in zip("abcdefghijkl", paths, strict=False):
        kind = kind_of(path)
        items.append(f"({letter}) {path.stem.removeprefix(f'{kind}_').replace('_', ' ')}")
    return fill("Exemplars: " + ", ".join(items) + ".", width=102) + "\n"
