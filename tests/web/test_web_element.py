"""How `<upholster-viewer>` behaves toward the page that it is on: what it takes, tells, and survives."""

import re
from typing import Any

import browser
import numpy as np
import pytest
from starlette.applications import Starlette
from starlette.responses import HTMLResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from upholster.codec.stream.description import describe

pytestmark = pytest.mark.browser

CONTEXTS = """
globalThis.contexts = []
OffscreenCanvas.prototype.getContext = ((make) => function (...asked) {
  const made = make.apply(this, asked)
  if (asked[0] === 'webgl2') contexts.push(made)
  return made
})(OffscreenCanvas.prototype.getContext)
"""
"""Remembers what draws."""

NO_WEBGL = """
OffscreenCanvas.prototype.getContext = ((make) => function (kind, ...rest) {
  return kind === 'webgl2' ? null : make.call(this, kind, ...rest)
})(OffscreenCanvas.prototype.getContext)
"""

ERRORS = "globalThis.errors = []; addEventListener('error', ({ detail: d }) => d && errors.push(d), true)"
"""Collects what elements tell is wrong: their events do not bubble."""


def test_the_model_has_all_that_its_types_say(tab: Any, site: Any) -> None:
    types = (browser.ROOT / "web" / "upholster-viewer.d.ts").read_text("utf-8")
    model = types.partition("interface ViewerModel")[2].partition("\n}")[0]
    names = re.findall(r"^  (?:readonly )?(\w+)[(:]", model, re.MULTILINE)
    assert {"texels", "quads", "setExemplar"} <= set(names)
    tab.open(f"{site}/view/ring.uph").complete().settle_shape()
    assert tab.call("return argument.filter((name) => viewer.model[name] === undefined)", names) == []
    texels, painted, quads, indices = tab.call(
        """
        const { texels, quads, charts } = viewer.model
        const painted = charts.map(({ textures }) => (textures.color.width - 2) * (textures.color.height - 2))
        const sum = (numbers) => numbers.reduce((all, one) => all + one, 0)
        return [texels, sum(painted), quads, sum(charts.map(({ geometry }) => geometry.indices.length))]
        """
    )
    assert texels == painted <= 300_000  # as many as a small page shows
    assert quads == round(indices / 6)


HERE_ALREADY = (
    "new File([bytes], 'my ring.uph')",
    "new Blob([bytes])",
    "bytes.buffer",
    "new DataView(bytes.buffer)",
    "bytes.subarray(0)",
)


def test_it_opens_a_stream_that_the_page_has(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/material.uph").complete()
    for source in HERE_ALREADY:
        tab.call(f"const bytes = viewer.model.bytes(); viewer.open({source})")
        tab.complete()
        assert tab.call("return viewer.model.received") == len(browser.material()), source
        name = "my ring" if "File" in source else "3D model"
        tab.until(f"inside.querySelector('canvas').ariaLabel.startsWith('{name}. Arrow keys')")


def test_it_shows_every_prefix_that_refine_shows(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ring.uph").complete()
    view = describe(browser.ring()).view
    for count, said in ((view - 1, "too little for a picture"), (view, "all that it holds")):
        tab.call("viewer.open(Uint8Array.from(argument))", [*browser.ring()[:count]])
        tab.until(f"inside.querySelector('.note').innerText.includes('{said}')")
        is_shown, shown = tab.call("return [viewer.model.first, viewer.model.shown]")
        assert is_shown == (count >= view)
        assert (shown["bytes"], shown["placements"]) == (count if is_shown else 0, 0)


def test_focus_goes_to_the_picture(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ring.uph").complete()
    before = tab.call("viewer.focus(); return viewer.view")
    assert tab.call("return document.activeElement === viewer && inside.activeElement.tagName") == "CANVAS"
    tab.page.keyboard.press("ArrowRight")
    assert tab.call("return viewer.view") != before


def test_what_is_no_stream_is_refused_and_changes_nothing(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ring.uph").complete()
    for source in ("3", "undefined", "{}", "[1, 2]", "new URL(location)", "new Response()"):
        name, message = tab.call(
            f"try {{ viewer.open({source}) }} catch (error) {{ return [error.name, error.message] }}"
        )
        assert name == "TypeError"
        wanted = r"stream is .*; allowed: an address, Blob, ArrayBuffer or view of one, null"
        assert re.fullmatch(wanted, message), source
        assert tab.call("return viewer.model.complete")


def test_a_file_that_can_not_be_read_is_reported(tab: Any, site: Any) -> None:
    tab.page.add_init_script(ERRORS)
    tab.open(f"{site}/view/ring.uph").complete()
    tab.call(
        "Blob.prototype.arrayBuffer = () => Promise.reject(new Error('the file is gone'));"
        "viewer.open(new Blob(['x']))"
    )
    tab.until("errors.length")
    assert tab.call("return errors.map(({ error }) => error.message)") == ["the file is gone"]
    tab.frames()
    assert "the file is gone" in tab.note()


PICTURE = """
const picture = (width, height, color) => {
  const canvas = Object.assign(document.createElement('canvas'), { width, height })
  const context = canvas.getContext('2d')
  context.fillStyle = color
  context.fillRect(0, 0, width, height)
  return canvas
}
"""


WRONG = "was not loaded: an attribute of this element is wrong."


def test_a_page_sets_limits_by_attributes(tab: Any, site: Any) -> None:
    tab.page.add_init_script(ERRORS)
    tab.open(f"{site}/view/ring.uph").complete().settle_shape()
    texels = tab.call("return viewer.model.texels")
    for name, value, message, words in (
        ("limit", "200k", "is larger than this page allows.", "number of texels is"),
        ("limit", "4 apples", WRONG, 'limit is "4 apples"; allowed: a number such as 500k or 4M'),
        ("limit", "0", WRONG, "limit of texels is 0; allowed: 1 to 2147483648"),
        ("maxtexels", "1G", WRONG, "maxtexels is 1G; allowed: 1 to 67108864"),
    ):
        tab.call(
            f"viewer.setAttribute('{name}', argument); errors.length = 0; viewer.open(viewer.src)", value
        )
        tab.until("errors.length")
        tab.frames()
        assert tab.call("return errors.map(({ message }) => message)") == [f"ring.uph {message}"]
        assert words in tab.note()
        assert not tab.call("return viewer.model.first")
        tab.call(f"viewer.removeAttribute('{name}')")
    tab.call(
        "viewer.setAttribute('limit', '400k'); viewer.setAttribute('maxtexels', '20k'); errors.length = 0;"
        "viewer.open(viewer.src)"
    )
    tab.complete().settle_shape()
    assert tab.call("return viewer.model.texels") <= 20_000 < texels
    assert tab.call("return errors.length") == 0


def test_a_sample_of_another_shape_is_an_error(tab: Any, site: Any) -> None:
    tab.page.add_init_script(ERRORS)
    tab.open(f"{site}/view/ring.uph").complete()
    tab.settle_shape()
    before = tab.texels()
    errors = tab.call(
        PICTURE + "return viewer.model.setExemplar(picture(128, 64, 'red')).then(() => 'nothing', String)"
    )
    assert errors == "RangeError: picture is 128 × 64 pixels; allowed: the sample's shape, 128 × 128"
    tab.settle_shape()
    assert tab.texels() == before
    # Another size of the same shape is none.
    tab.call(PICTURE + "await viewer.model.setExemplar(picture(300, 300, 'red'))")
    assert tab.texels() != before
    tab.call(
        PICTURE
        + "const blob = await new Promise((done) => picture(64, 128, 'blue').toBlob(done));"
        + "globalThis.fetch = async () => new Response(blob); viewer.setAttribute('exemplar', 'blue.png')"
    )
    tab.until("errors.length")
    assert tab.call("return errors.map(({ message }) => message)") == [
        "exemplar blue.png can not be shown:"
        " picture is 64 × 128 pixels; allowed: the sample's shape, 128 × 128"
    ]


def test_without_webgl_poster_or_words_are_seen(chromium: Any, site: Any) -> None:
    with browser.tab(chromium) as tab:
        tab.page.add_init_script(NO_WEBGL)
        tab.open(f"{site}/view/ring.uph").until("inside.querySelector('.note').checkVisibility()")
        tab.call(
            """
            const one = document.createElement('upholster-viewer')
            one.alt = 'A ring of bricks'
            document.body.replaceChildren(one)
            globalThis.errors = []
            // After it is on the page, as in a script that imports the viewer first.
            one.addEventListener('error', ({ detail }) => errors.push([detail.message, detail.error.message]))
            """
        )
        tab.until("globalThis.errors.length")
        assert tab.call("return errors") == [["This browser can not show 3D models.", "there is no WebGL2"]]
        assert "A ring of bricks" in tab.note()
        assert tab.call("return [viewer.model, await viewer.settled()]") == [None, None]
        tab.call(
            """
            const poster = Object.assign(new Image(), { slot: 'poster' })
            viewer.replaceWith(Object.assign(document.createElement('upholster-viewer'), { alt: 'Ring' }))
            document.querySelector('upholster-viewer').append(poster)
            """
        )
        tab.until("inside.querySelector('.note').checkVisibility()")
        # The note leaves the poster's middle free.
        shapes = "const [a, b] = [viewer.firstChild, inside.querySelector('.note')].map((one) =>"
        poster, note = tab.call(shapes + " one.getBoundingClientRect()); return [a.toJSON(), b.toJSON()]")
        assert poster["height"] > 300
        assert note["top"] > poster["top"] + 0.6 * poster["height"]


@pytest.mark.parametrize("painting", ["worker", "card"])
def test_a_lost_context_throws_nothing_and_the_picture_comes_back(
    chromium: Any, site: Any, painting: str
) -> None:
    with browser.tab(chromium) as tab:
        tab.page.add_init_script(CONTEXTS)
        tab.open(f"{site}/view/material.uph").complete()
        tab.call(f"viewer.setAttribute('painting', '{painting}'); viewer.open('/streams/ring.uph')")
        tab.complete().settle_shape()
        before = tab.picture()
        # It is turned in the same task in which all is lost, and while all is lost.
        tab.call(
            "globalThis.loss = contexts[0].getExtension('WEBGL_lose_context');"
            "viewer.view = [31, 30]; loss.loseContext(); viewer.view = [200, -10]"
        )
        tab.until("inside.querySelector('.note').innerText.includes('was reset')")
        tab.call("viewer.view = [30, 30]; viewer.style.background = 'red'")
        tab.frames()
        tab.call("loss.restoreContext()")
        tab.until("inside.querySelector('.note').hidden")
        tab.settle_shape()
        assert np.abs(before.astype(int) - tab.picture()).mean() < 0.5


def test_it_is_as_high_as_its_page_says_and_never_of_no_height(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ring.uph").complete()
    tab.call(
        """
        const box = document.createElement('div')
        box.style.width = '64px'
        document.body.style.height = 'auto'
        document.body.replaceChildren(box)
        box.append(viewer)
        """
    )
    for height, shown in (("48px", 48), ("100%", 480), ("auto", 480), ("300px", 300)):
        tab.call("viewer.style.height = argument", height)
        tab.frames()
        canvas = "inside.querySelector('canvas').getBoundingClientRect()"
        sizes = tab.call(f"return [viewer.offsetHeight, {canvas}.height, {canvas}.width]")
        assert sizes == [shown, shown, 64], height
        # On a small one the button would hide the picture.
        assert tab.call("return inside.querySelector('.corner').checkVisibility()") == (shown > 120), height


def test_an_address_may_have_any_characters(chromium: Any, site: Any) -> None:
    with browser.tab(chromium, faultless=False) as tab:
        tab.page.add_init_script(ERRORS)
        tab.open(f"{site}/view/ring.uph").complete()
        tab.call("viewer.src = '/streams/50%.uph'")
        tab.until("errors.length")
        assert tab.call("return errors[0].message") == "50%.uph was not found."
        assert all("404" in problem for problem in tab.found_wrong())


DIFFERENT = ("material", "two_layers", "fields", "symmetries", "half_cells", "mesh_of_any_triangles")
"""Vectors that together have all kinds of chunks, maps and surfaces."""


def _page(request: Any) -> Any:
    return HTMLResponse(
        '<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">'
        '<upholster-viewer style="width: 64px; height: 64px"></upholster-viewer>'
        f'<script type="module" src="/{request.path_params["scripts"]}/upholster-viewer.js"></script>'
    )


def test_the_built_scripts_show_every_stream_as_the_sources_do(chromium: Any) -> None:
    """Their names are short ones, the same in all files; one that is looked up as a text would be missed."""
    root, vectors = browser.ROOT, browser.HERE.parent / "vectors"
    app = Starlette(
        routes=[
            Route("/page/{scripts}", _page),
            Mount("/vectors", StaticFiles(directory=vectors)),
            Mount("/sources", StaticFiles(directory=root / "web")),
            Mount("/built", StaticFiles(directory=root / "src" / "upholster" / "output" / "web")),
        ]
    )
    found: list[dict[str, Any]] = []
    with browser.serving(app) as address:
        for scripts in ("sources", "built"):
            with browser.tab(chromium) as tab:
                tab.open(f"{address}/page/{scripts}").until("viewer.open")
                found.append({})
                for name in DIFFERENT:
                    tab.call("viewer.open(argument)", f"/vectors/{name}.uph")
                    tab.complete().settle_shape()  # until it is as fine as the view takes, too
                    errors = tab.call("return [viewer.model.texels, viewer.model.roles, viewer.model.sphere]")
                    found[-1][name] = (errors, tab.texels())
    assert found[0] == found[1]
