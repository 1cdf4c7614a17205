"""Charts painted by the graphics card: the worker's texels, whatever the stream, and in the element."""

from typing import Any

import browser
import numpy as np
import pytest
from browser import ROOT, evaluate
from starlette.applications import Starlette
from starlette.responses import FileResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from test_web_build import CARD

pytestmark = pytest.mark.browser

MOST_OFF = 0.001
"""Share of the texels that may differ by more than 1 of 255. Measured: none but corners of gutters."""

PAINTED = {
    "streams/ring": ["color"],
    "streams/material": ["color", "emission", "normal", "surface"],
    "vectors/symmetries": ["color"],
    "vectors/centre_matrices": ["color"],
    "vectors/paper": ["color"],
    "vectors/mesh": ["color"],
    "vectors/nets_16_bit": ["color"],
}
"""Streams, and what of them the card paints: warped and flat, on patches and meshes, with ramps, turned."""

TOLD = """
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


def _compare(page: Any, name: str, length: int | None = None, picture: Any = None) -> Any:
    found = evaluate(page, "(told) => compare(...told)", [f"{name}.uph", length, picture])
    assert found["error"] == 0
    return found


@pytest.mark.parametrize("name", PAINTED)
def test_the_card_paints_the_workers_texels(page: Any, name: str) -> None:
    found = _compare(page, name)
    assert sorted(found["found"]) == PAINTED[name]
    for target, told in found["found"].items():
        assert told["onCard"] == found["charts"], target
        assert told["off"] <= MOST_OFF * told["texels"], target
        assert told["gutterOff"] <= 4 * found["charts"], target


def test_it_does_so_while_masks_are_still_to_come(page: Any) -> None:
    told = _compare(page, "streams/ring", 14_000)["found"]["color"]
    assert told["onCard"] > 10
    assert told["off"] <= MOST_OFF * told["texels"]


def test_another_sample_is_painted_alike(page: Any) -> None:
    colors = np.random.default_rng(1).integers(0, 256, (128, 128, 4), np.uint8)
    colors[:, :, 3] = 255
    told = _compare(page, "streams/ring", None, {"width": 128, "data": colors.ravel().tolist()})
    color = told["found"]["color"]
    assert (color["onCard"], color["off"]) == (told["charts"], 0)


def test_what_is_see_through_is_left_to_the_worker(page: Any) -> None:
    colors = np.full((128, 128, 4), 99, np.uint8)
    told = _compare(page, "streams/ring", None, {"width": 128, "data": colors.ravel().tolist()})
    color = told["found"]["color"]
    assert (color["onCard"], color["most"]) == (0, 0)


def test_what_the_card_has_lost_it_paints_again(page: Any) -> None:
    found = evaluate(page, "(address) => survive(address)", "streams/material.uph")
    assert found["onCard"]
    assert found["before"] == found["after"]
    assert np.std(found["before"]) > 20


def test_the_element_paints_on_the_card_where_it_is_told_to(chromium: Any, site: Any) -> None:
    pictures = []
    for painting in ("worker", "card"):
        with browser.tab(chromium) as tab:
            loaded: list[str] = []
            tab.page.on("request", lambda request, loaded=loaded: loaded.append(request.url.split("/")[-1]))
            tab.page.add_init_script(TOLD.replace("WISH", painting))
            tab.open(f"{site}/view/ring.uph").complete()
            tab.settle_shape()
            assert all((name in loaded) == (painting == "card") for name in CARD)
            on_card = tab.call("return viewer.model.charts.every(({ textures }) => !textures.color.data)")
            assert on_card == (painting == "card")
            pictures.append(tab.picture())
    assert np.abs(pictures[0].astype(int) - pictures[1]).mean() < 0.5
