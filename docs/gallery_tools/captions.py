"""The captions of the gallery's README, in Markdown."""

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

`python docs/make_gallery.py FOLDER_OF_EXEMPLARS` generates this page; do not edit it by hand. `python
docs/make_gallery.py paper OUT` draws the paper's figures from the project's own exemplars. Figure numbers
are those of R. N. Shet, H. E. Bez, E. A. Edirisinghe: *Progressive texture synthesis on geometric surfaces
parametrised by bi-quadratic rational Bézier patches*. Figures with a number show method "paper"; the
others show method "quilt" unless they say otherwise. The photographs in these pictures are CC0, by Poly
Haven, ambientCG and Nobiax; they are not part of the project. `bricks.png`, `weave.png`, `pebbles.png`,
`granite.png` and `bricks_material` are in `examples`.
"""

CAPTIONS = {
    "hero": """\
        The project's own `bricks.png` on a ring Dupin cyclide. To make the same picture:

            upholster cover examples/bricks.png --on cyclide --texels 4M --sample-size 5 \\
                --direction around:z --seed 3 --view 150,32 -o ring.png --size 1000x750 --supersample 4

        The ring is five times as thick on one side as on the other, but all bricks have the same size. So
        some rows of bricks end where the ring gets thinner.
        """,
    "chairs": """\
        The project's own `chair.glb`, in metres, in `weave.png` (`--sample-size 18cm`), `bricks.png` (`35cm`)
        and `pebbles.png` (`40cm`), each with `--texels 2M --seed 1`. Rows are level. On horizontal areas,
        such as the seat, they run around the middle.
        """,
    "cad": """\
        Top: our renderer. Bottom: Blender 5.0 (Cycles) with the same GLBs, and with a USDZ for the third
        model.

        - A knurl that closes around a knob (`--material "Knob=knurl.png@10mm" --direction Knob=around
          --fit`, which made the sample 0.8 % wider), on a shaft of brushed metal (`--material
          "*=brushed.png@14mm" --direction along`).
        - Leather over a part with fillets (`--sample-size 22mm`).
        - Brushed metal along each part's own axis (`--direction along --sample-size 20mm`).
        - Newell's teapot in `bricks.png` (`--sample-size 1.6`).

        Each has `--texels 2M --seed 1`. The parts are STEP files; they and the samples of knurl, leather and
        metal are computed. The teapot's file is not part of the project. The picture was made by script
        `cad_pictures`, [in the history](../benchmarks.md#scripts-in-the-history).
        """,
    "players": """\
        `weave.png` on a fox with a skin and three animations (`--texels 1M --seed 1`), in our renderer, in
        three.js and in Blender 5.0 (Cycles). Joints, weights, bind matrices and animations equal those of the
        source, bit for bit. In every pose each corner of each triangle is at the source's position, in both
        programs. The fox: model by PixelMannen (CC0), rig and animation by @tomkranis (CC BY 4.0), conversion
        to glTF by @AsoboStudio and @scurest (CC BY 4.0); it is not part of the project. The picture was made
        and checked by script `players`, [in the history](../benchmarks.md#scripts-in-the-history).
        """,
    "strip": """\
        `weave.png` on a torus (`--on torus:R=2,r=0.9 --sample-size 1.6`), `pebbles.png` on a vase
        (`--on vase --sample-size 0.8`) and `granite.png` on a sphere (`--on sphere --sample-size 0.9`), each
        with `--texels 1M --seed 1`.
        """,
    "beside": """\
        Left: `--method paper --chart 512 --block 64 --overlap 16 --seed 1`; the texture is stretched like the
        patches' parameters. Right: `--texels 4M --sample-size 5 --seed 5`, the bricks with
        `--direction around:z`; elements have one size and shape everywhere.
        """,
    "everywhere": """\
        `pebbles.png` on every built-in surface except the plane, with `--texels 1M --seed 1` and samples of
        6, 1.4, 0.6, 0.6, 0.7, 0.6, 0.6 and 0.6 units. (e, h) have poles, where an edge is a single point.
        """,
    "sizes": """\
        `pebbles.png` on a torus (`--on torus:R=2,r=0.9 --texels 4M --seed 1`). The sample's width is given in
        the model's units.
        """,
    "directions": """\
        The direction of the exemplar's rows, here rows of bricks, for values of `--direction`: u, along the
        patches' t, here around the tube; v, along s; 30, degrees from u; `0,0,1`, a vector projected on the
        surface; `around:z`, around an axis. (f) is a function of points in Python. Where lines converge, rows
        end. Where a projected vector vanishes, the direction comes from nearby (d, at the top). `bricks.png`
        with `--texels 2M --sample-size 6 --seed 1`.
        """,
    "repeating": """\
        Left of each pair: `--phase 0`. Blocks only match their neighbours, so rows break off along lines,
        bricks are shortened, and the zigzag is lost. Right: the default. The sample's waves are detected and
        get a consistent phase everywhere. Rows and columns still end where the surface narrows. The samples
        are 256 x 256: the project's own `bricks.png` and `weave.png`, and others made by
        `benchmarks/lattice_samples.py`; the net is a bent vase. All have
        `--texels 2M --direction around:z --seed 1`; the two flat pairs show a part
        of 512 x 512 texels.
        """,
    "regular": """\
        Each row shows a photograph of 256 x 256, at the left, on a torus, a cyclide, a vase and a sphere,
        with `--texels 1M --seed 1` and no other option. The photographs were not selected by result: they are
        the first three of their classes by name.
        """,
    "irregular": """\
        The same with photographs of irregular and stochastic textures.
        """,
    "flat": """\
        Exemplars of 128 × 128 (a, d); `--on plane --texels 512x512 --seed 1` (b, e); two by two copies of the
        result of `--texels 256x256 --tileable` (c, f).
        """,
    "material": """\
        `examples/bricks_material`: albedo, normal, roughness, ambient occlusion and height, with one quilt.
        Bumps are lit from the same side on all charts, because normals turn with the texture. (b) is
        `upholster cover examples/bricks_material --on torus:R=2,r=0.9 --texels 2M --sample-size 2.5
        --direction around:z --seed 1 --view 30,38 -o torus.png`; `-o torus.glb` writes the same as glTF.
        """,
    "refining": """\
        The first picture's quilt as a stream (`-o ring.uph`), as it arrives. Placements come from coarse to
        fine over all charts, with the exemplar's coarse parts. Labels and details follow in the order of
        their benefit. The numbers are the texels' PSNR compared with the complete stream.
        """,
    "studio": """\
        `upholster studio examples/weave.png examples/chair.glb`, screenshots of Chromium.
        [docs/studio.md](../studio.md) describes this session.
        """,
    "viewer": """\
        `upholster view ring.uph`, screenshots of Chromium: the first picture's ring (a, c); and the
        laboratory (`controls="lab"`) with `examples/bricks_material` on a torus, where the left half has 3 %
        of the colour's coefficients.
        """,
    "viewer_arriving": """\
        The first picture's stream, cut. Top: the viewer, in the browser's software rasteriser. Bottom:
        Python's rendering of the same bytes.
        """,
    "viewer_light": """\
        Dragging with Shift turns the viewer's light, to check normal maps: raised parts look raised from all
        sides.
        """,
    "surface": """\
        The ring Dupin cyclide with a = 6, c = 2, µ = 3, and its trigonometric parameters. θ runs around the
        ring and starts on the thin side; φ runs around the tube and starts in the hole. Thin lines are 22.5°
        apart.
        """,
    "patches": """\
        (a) The four bi-quadratic rational patches with θ and φ between 0° and 180°, seen from below, with
        their control points; points behind the surface are pale. All weights are positive, so each patch is
        in the convex hull of its points. (b) Sixteen such patches form the complete surface exactly.
        """,
    "overview": """\
        The results of each step for one exemplar; numbers are the paper's sections. In the paper,
        coefficients are chosen inside the synthesis. Here blocks are chosen once, with all coefficients, and
        can be painted with any share of them.
        """,
    "on_one_patch": """\
        Top: the first block of a patch, at any position on the grid of LL3, the same in every sub-band.
        Bottom: a block after one row and one block. Its overlap is compared with every position of the
        exemplar, and the best one is laid.
        """,
    "decomposition": """\
        An exemplar and its three-level Haar transform: HL contains vertical details, LH horizontal ones, HH
        diagonal ones. Matching uses only LL3 and HH3, each 1/64 of the coefficients.
        """,
    "matching": """\
        A block of 32 × 32 texels is about to be placed (a). Its overlap with the existing texture, 8 texels
        wide, covers seven tiles. It may come from any of 13 × 13 positions on the grid of LL3 in a 128 × 128
        exemplar (b: their top left corners). The cost of a position is the sum of squared differences of the
        overlap's LL3 and HH3 coefficients (c, d); the position with the lowest cost is used.
        """,
    "seams": """\
        Patches are covered separately, so the texture is discontinuous at their edges (a, c; red arrows point
        at the edge). Edge blocks across the edge repair it (b, d). For each edge block (e), the best match by
        LL3 and HH3 is found in the exemplar (f). A minimum cut determines which part of it replaces the seam
        (g). That part is embedded in both patches, feathered (h).
        """,
    "levels": """\
        Two streams of method paper, in the paper's profile, as they arrive: the model made from the largest
        3, 5, 7 and 15 % of the sample's Haar coefficients, and the complete stream, which has all
        coefficients except zeros. Each picture is labelled with its bytes, surface and placements included,
        and the texels' PSNR compared with the complete stream. `upholster levels ring.uph -o levels.png`
        makes such a row. Samples: the project's bricks and granite at 128 × 128;
        `python docs/make_gallery.py FOLDER --only levels` with any folder of images.
        """,
    "curve": """\
        The first of these streams: its texels' PSNR compared with the complete stream, over its bytes. The
        first view shows the exemplar repeated. Then the placements come, over all charts. The rest refines
        the exemplar. `upholster levels ring.uph --curve -o curve.png`.
        """,
    "mapping": """\
        Each patch is a grid of quadrilaterals, here 8 × 8, and each quadrilateral takes its texture from a
        square of texture space (the same colour in a and b). Black lines are the patches' borders.
        """,
    "baseline": """\
        The same samples by method "pixel", with both kinds of search, by "paper" and by "quilt", on cyclide
        and sphere (eight octants). Charts have 192 x 192 texels; "quilt" has the same total of texels;
        `--seed 1`.

        - Seconds are of one run on two cores that were also busy with other work, up to twice those
          of an idle machine. Script `pixel`,
          [in the history](../benchmarks.md#scripts-in-the-history), measured them.
        - "Seam" is the seam ratio across the edges of patches or charts, relative to the sample; 1 is
          invisible.
        - PS is the Portilla-Simoncelli error and SWD the sliced Wasserstein distance in 1/1000, both
          of the method's flat 512 x 512 texture; less is better. PS needs the extra `fidelity`.

        `python docs/make_gallery.py examples --only baseline` makes the picture.
        """,
    "twelve": """\
        Twelve textures on the sphere (eight octants, degenerate at the poles), the torus and the cyclide, one
        column per class of texture. Exemplars are 256 × 256, blocks 32 × 32, and seams are repaired. The
        remaining defects come from the method: texture shrinks at the sphere's poles and stretches on the
        wide sides (e, i), and large regular elements do not always continue from patch to patch (b).
        """,
    "stretch": """\
        Every patch has the same dots. Compared with the smallest texel, a texel on the thick side is up to
        {length:.2g} times as long (round the ring), up to {width:.2g} times as wide (round the tube), and up
        to {area:.2g} times as large; (b) shows the square root of its area. The paper does not mention this,
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
