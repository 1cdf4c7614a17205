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

from upholster.server import Catalogue, make_app

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

LATE = """
MessagePort.prototype.postMessage = ((post) => function (message, ...rest) {
  globalThis.isLate ||= message.kind === 'paint'
  if (globalThis.isLate) setTimeout(() => post.call(this, message, ...rest), 1000)
  else post.call(this, message, ...rest)
})(MessagePort.prototype.postMessage)
"""
"""Workers hear late that they are to paint: what they sent before is still on its way."""


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


HURRIED = "let calls = 0; performance.now = () => 1000 * calls++"
"""A clock by which everything takes a second, as on a machine that is very busy."""


@pytest.mark.parametrize("on_page", [False, True])
def test_the_first_picture_has_texture_however_long_it_takes(page: Any, on_page: bool) -> None:
    told = evaluate(page, "(told) => first(...told)", ["streams/ring.uph", on_page, HURRIED])
    at_first, at_last, charts = told
    assert charts / 16 < at_first < charts
    assert at_last == charts


def test_the_first_picture_waits_for_what_paints(page: Any) -> None:
    """The card can not show what is see-through; what paints it is loaded only then."""
    sample = {"height": 128, "width": 128, "channels": 4, "data": [99] * (4 * 128 * 128)}
    told = evaluate(page, "(told) => first(...told)", ["streams/ring.uph", True, "", sample])
    assert told[0] == told[1] == told[2]


class _Lacking:
    """An application without one of its files."""

    def __init__(self, app: Any, name: str) -> None:
        self._app, self._name = app, name

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if scope.get("path", "").endswith(f"/{self._name}"):
            scope = {**scope, "path": "/none"}
        await self._app(scope, receive, send)


def _hurry(route: Any) -> None:
    fetched = route.fetch()
    route.fulfill(response=fetched, body=f"{fetched.text()}\n{HURRIED}")


@pytest.mark.parametrize("name", CARD)
def test_the_worker_paints_where_the_cards_scripts_do_not_load(
    chromium: Any, streams: Any, name: str
) -> None:
    app = _Lacking(make_app(Catalogue([str(streams)])), name)
    with browser.serving(app) as address, browser.tab(chromium, faultless=False) as tab:
        tab.page.add_init_script(TOLD.replace("WISH", "card") + LATE)
        tab.page.route("**/uph-worker*.js", _hurry)
        tab.page.add_init_script(
            "addEventListener('first', ({ target }) => (globalThis.painted ="
            " target.model.charts.filter(({ textures }) => textures.color?.data).length), true)"
        )
        tab.open(f"{address}/view/ring.uph").complete()
        tab.settle_shape()
        tab.until("globalThis.painted")
        assert tab.note() == ""
        assert tab.call("return viewer.model.charts.every(({ textures }) => textures.color.data)")
        assert all("404" in problem for problem in tab.found_wrong())


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
