"""Charts painted by the graphics card: the worker's texels, whatever the stream, and in the element."""

from dataclasses import replace
from typing import Any

import browser
import numpy as np
import pytest
from browser import ROOT, evaluate
from decoders import in_node, in_python
from starlette.applications import Starlette
from starlette.responses import FileResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from streams import CHARTS, anything, anything_bent, laid, noise

from upholster.codec.stream.writer import encode_stream
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.quilt.chart import Chart

pytestmark = pytest.mark.browser

PAINTED = {
    "streams/ring": ["color"],
    "streams/material": ["color", "emission", "normal", "surface"],
    "streams/two": ["color"],
    "streams/bent": ["color", "normal"],
    "vectors/mesh": ["color"],
    "vectors/nets_16_bit": ["color"],
}
"""Streams, and what of them the card paints: warped and flat, on patches and meshes, of two layers, turned,
dense."""

REPORTED = """
customElements.define = ((define) => function (name, Kind) {
  const connect = Kind.prototype.connectedCallback
  Kind.prototype.connectedCallback = function () {
    this.setAttribute('painting', 'WISH')
    connect.call(this)
  }
  define.call(this, name, Kind)
})(customElements.define)
"""
"""Gives elements an attribute before they begin."""


@pytest.fixture(scope="module")
def page(chromium: Any, streams: Any) -> Any:
    surface, quilt, exemplar = laid("torus", side=48, second=True)
    (streams / "two.uph").write_bytes(encode_stream(surface, quilt, exemplar))
    (streams / "bent.uph").write_bytes(_bent())
    app = Starlette(
        routes=[
            Route("/painting.html", lambda _: FileResponse(browser.HERE / "painting.html")),
            Mount("/streams", StaticFiles(directory=streams)),
            Mount("/vectors", StaticFiles(directory=browser.HERE.parent / "vectors")),
            Mount("/", StaticFiles(directory=ROOT / "web")),
        ]
    )
    with browser.serving(app) as address, browser.tab(chromium) as tab:
        tab.page.goto(f"{address}/painting.html")
        tab.page.wait_for_function("() => Boolean(globalThis.compare)")
        yield tab.page


def _bent() -> bytes:
    """A stream with warp fields, symmetries and centre matrices, painted with two texels a step."""
    rng = np.random.default_rng(8)
    quilt = replace(anything_bent(rng, (32, 40), CHARTS, 40, 2), density=2.0)
    placed = quilt.placements.copy()
    placed["symmetry"] = rng.integers(0, 8, len(placed))
    maps = {"normal": noise(seed=1, dtype=np.uint16)}
    return encode_stream(surface_from_spec("plane"), replace(quilt, placements=placed), noise(), maps=maps)


def _small_stream(seed: int) -> bytes:
    """A small quilt of any kind, painted with any number of texels a step, and two further maps."""
    rng = np.random.default_rng(seed)
    charts = [Chart(0, int(high), int(wide)) for high, wide in rng.integers(1, 60, (4, 2))]
    high, wide = (int(side) for side in rng.integers(4, 40, 2))
    kind = rng.choice([np.uint8, np.uint16])
    albedo = noise(high, wide, int(rng.integers(1, 5)), kind, seed=seed)
    if not albedo.shape[2] % 2:
        albedo[:, :, -1] = np.iinfo(kind).max  # what is see-through the card does not paint
    normal = noise(high, wide, 3, rng.choice([np.uint8, np.uint16]), seed=seed + 1)
    emission = noise(high, wide, int(rng.choice([1, 3])), rng.choice([np.uint8, np.uint16]), seed=seed + 2)
    quilt = rng.choice([anything, anything_bent])(rng, (high, wide), charts, int(rng.integers(1, 40)))
    quilt = replace(quilt, density=2.0 ** int(rng.integers(-3, 4)))
    return encode_stream(
        surface_from_spec("plane"),
        quilt,
        albedo,
        maps={"normal": normal, "emission": emission},
        sample_quality="lossless",
    )


def test_python_the_worker_and_the_card_paint_the_same_texels(page: Any, streams: Any, tmp_path: Any) -> None:
    """Forty quilts: layers, symmetries, own matrices, warp fields, densities, depths and channels."""
    made = [_small_stream(seed) for seed in range(40)]
    python = [in_python(data, [len(data)])[0] for data in made]
    assert in_node(tmp_path, [("small.uph", data, [len(data)]) for data in made]) == [[one] for one in python]
    (streams / "small").write_bytes(b"".join(made))
    targets = ["color", "normal", "emission"]
    card = evaluate(
        page, "(reported) => sweep(...reported)", ["streams/small", [len(data) for data in made], targets]
    )
    for seed, (painted, one) in enumerate(zip(card, python, strict=True)):
        wanted = {role: shown for role, _, _, shown in one["maps"]}
        assert painted == {"color": one["shown"], **wanted}, f"quilt {seed}"


def _compare(page: Any, name: str, length: int | None = None, picture: Any = None) -> Any:
    found = evaluate(page, "(reported) => compare(...reported)", [f"{name}.uph", length, picture])
    assert found["error"] == 0
    return found


@pytest.mark.parametrize("name", PAINTED)
def test_the_card_paints_the_workers_texels(page: Any, name: str) -> None:
    found = _compare(page, name)
    assert sorted(found["found"]) == PAINTED[name]
    for target, reported in found["found"].items():
        assert reported["onCard"] == found["charts"], target
        assert reported["off"] == 0, target
        assert reported["gutterOff"] <= 4 * found["charts"], target


@pytest.mark.parametrize("name", ["ring", "two"])
def test_it_does_so_while_labels_are_still_to_come(page: Any, streams: Any, name: str) -> None:
    length = 2 * (streams / f"{name}.uph").stat().st_size // 3
    reported = _compare(page, f"streams/{name}", length)["found"]["color"]
    assert reported["onCard"] > 10
    assert reported["off"] == 0


def test_another_sample_is_painted_alike(page: Any) -> None:
    colors = np.random.default_rng(1).integers(0, 256, (128, 128, 4), np.uint8)
    colors[:, :, 3] = 255
    reported = _compare(page, "streams/ring", None, {"width": 128, "data": colors.ravel().tolist()})
    color = reported["found"]["color"]
    assert (color["onCard"], color["off"]) == (reported["charts"], 0)


def test_what_is_see_through_is_left_to_the_worker(page: Any) -> None:
    colors = np.full((128, 128, 4), 99, np.uint8)
    reported = _compare(page, "streams/ring", None, {"width": 128, "data": colors.ravel().tolist()})
    color = reported["found"]["color"]
    assert (color["onCard"], color["most"]) == (0, 0)


def test_what_the_card_has_lost_it_paints_again(page: Any) -> None:
    found = evaluate(page, "(address) => survive(address)", "streams/material.uph")
    assert found["onCard"]
    assert found["before"] == found["after"]
    assert np.std(found["before"]) > 20


HURRIED = "let calls = 0; performance.now = () => 1000 * calls++"
"""A clock by which everything takes a second, as on a machine that is very busy."""


@pytest.mark.parametrize("on_page", [False, True])
def test_the_first_picture_has_texture_however_long_it_takes(page: Any, on_page: bool) -> None:
    reported = evaluate(page, "(reported) => first(...reported)", ["streams/ring.uph", on_page, HURRIED])
    at_first, at_last, charts = reported
    assert at_first == at_last == charts


def test_the_element_paints_on_the_card_where_it_is_asked_to(chromium: Any, site: Any) -> None:
    pictures = []
    for painting in ("worker", "card"):
        with browser.tab(chromium) as tab:
            tab.page.add_init_script(REPORTED.replace("WISH", painting))
            tab.open(f"{site}/view/ring.uph").complete()
            tab.settle_shape()
            on_card = tab.call("return viewer.model.charts.every(({ textures }) => !textures.color.data)")
            assert on_card == (painting == "card")
            pictures.append(tab.picture())
    assert np.abs(pictures[0].astype(int) - pictures[1]).mean() < 0.5


@pytest.mark.parametrize("painting", ["worker", "card"])
def test_a_small_element_paints_fewer_texels_and_more_as_it_grows(
    chromium: Any, site: Any, painting: str
) -> None:
    with browser.tab(chromium) as tab:
        tab.page.add_init_script(NARROW)
        tab.page.add_init_script(REPORTED.replace("WISH", painting))
        tab.open(f"{site}/view/ring.uph").complete()
        tab.settle_shape()
        small = tab.call("return viewer.model.texels")
        assert small < 25_000  # of 300,000
        tab.call("viewer.style.cssText = 'width: 100px; height: 110px'")
        tab.until(f"viewer.model.texels > {3 * small}")
        tab.settle_shape()
        assert tab.call("return viewer.model.texels") < 100_000
        tab.call(NEARER)
        tab.until("viewer.model.texels > 250_000")
        tab.settle_shape()
        assert tab.call(MISSING) == 0


NARROW = """
addEventListener('DOMContentLoaded', () => {
  document.querySelector('upholster-viewer').style.cssText = 'width: 50px; height: 55px'
})
"""

NEARER = """
const key = new KeyboardEvent('keydown', { key: '+', bubbles: true })
for (let n = 0; n < 20; n++) inside.querySelector('canvas').dispatchEvent(key)
"""

MISSING = """
let missing = 0
for (const { textures } of viewer.model.charts) missing += textures.color ? 0 : 1
return missing
"""
"""How many charts have no texture."""
