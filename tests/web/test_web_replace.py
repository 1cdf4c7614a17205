"""One stream in place of another in the element: one worker, no picture in between, and nothing left over."""

from collections.abc import Iterator
from typing import Any

import browser
import numpy as np
import pytest
from browser import BRICKS

from upholster.apps.server import Catalogue, make_app
from upholster.codec.stream.writer import encode_stream
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.image.files.read import read_exemplar

pytestmark = pytest.mark.browser

COUNTED = """
globalThis.started = 0
globalThis.Worker = class extends Worker {
  constructor(...how) {
    super(...how)
    started++
  }
}
globalThis.alive = {}
const { prototype } = WebGL2RenderingContext
for (const kind of ['Texture', 'Buffer', 'VertexArray', 'Framebuffer', 'Renderbuffer']) {
  const [make, end] = [prototype[`create${kind}`], prototype[`delete${kind}`]]
  alive[kind] = 0
  prototype[`create${kind}`] = function () {
    alive[kind]++
    return make.call(this)
  }
  prototype[`delete${kind}`] = function (one) {
    if (one) alive[kind]--
    end.call(this, one)
  }
}
"""
"""Counts workers that were started, and what the graphics card has."""

WATCH_CANVAS = """
  const context = new OffscreenCanvas(48, 48).getContext('2d', { willReadFrequently: true })
  globalThis.look = () => {
    context.clearRect(0, 0, 48, 48)
    context.drawImage(inside.querySelector('canvas'), 0, 0, 48, 48)
    return Array.from(context.getImageData(0, 0, 48, 48).data)
  }
"""
"""Makes `look`, which tells what is on the canvas, made small."""


@pytest.fixture(scope="module")
def layings(tmp_path_factory: Any) -> Iterator[str]:
    """Address of three streams of one sample on one surface, and one of another sample."""
    folder = tmp_path_factory.mktemp("layings")
    surface, exemplar = ring_cyclide(), read_exemplar(BRICKS, resize=128)
    for name, seed, sample in (
        ("a", 1, exemplar),
        ("b", 2, exemplar),
        ("c", 3, exemplar),
        ("d", 1, 255 - exemplar),
    ):
        quilt = synthesize(sample, surface, texels=60_000, sample_size=5.0, seed=seed)
        (folder / f"{name}.uph").write_bytes(encode_stream(surface, quilt, sample))
    with browser.serving(make_app(Catalogue([str(folder)]))) as address:
        yield address


@pytest.fixture
def shown(tab: Any, layings: str) -> Any:
    """A page that shows the first of them, and has all of them at hand."""
    tab.page.add_init_script(COUNTED)
    tab.open(f"{layings}/view/a.uph").complete()
    tab.call(
        "globalThis.streams = {}; for (const name of 'abcd')"
        " streams[name] = new Uint8Array(await (await fetch(`/streams/${name}.uph`)).arrayBuffer())"
    )
    tab.settle_shape()
    return tab


def test_twenty_in_a_row_have_one_worker_and_leave_nothing(shown: Any) -> None:
    alive = []
    shown.call("globalThis.models = []")
    for count in (6, 14):
        shown.call(
            "for (let n = 0; n < argument; n++) {"
            "  if (!(await viewer.replace(streams['bcad'[n % 4]]))) throw new Error('it is not shown');"
            "  models.push(new WeakRef(viewer.model)) }",
            count,
        )
        shown.settle_shape()
        alive.append(shown.page.evaluate("() => alive"))
    assert alive[0] == alive[1]
    assert alive[0]["Texture"] > shown.call("return viewer.model.charts.length")
    assert shown.page.evaluate("() => started") == 1
    assert len(shown.page.workers) == 1
    # Nor does anything hold on to those before, each to the one before it.
    shown.page.context.new_cdp_session(shown.page).send("HeapProfiler.collectGarbage")
    assert shown.page.evaluate("() => models.filter((one) => one.deref()).length") <= 2


def test_of_several_at_once_the_last_is_shown_by_the_same_worker(shown: Any) -> None:
    reported = shown.call(
        "return Promise.all([...'bcadbcad', 'c'].map((name) => viewer.replace(streams[name])))"
    )
    assert reported == [False] * 8 + [True]
    last = shown.texels()
    shown.call("await viewer.replace(streams.c)")
    assert shown.texels() == last
    # Later ones, one after another, while those before are being decoded.
    shown.call(
        """
        const reported = []
        for (let n = 0; n < 12; n++) {
          reported.push(viewer.replace(streams['bcad'[n % 4]]))
          await new Promise((done) => setTimeout(done, 20 * (n % 4)))
        }
        await Promise.all(reported)
        await viewer.replace(streams.c)
        """
    )
    assert shown.texels() == last
    assert shown.page.evaluate("() => started") == 1
    # Likewise where nothing is shown before: the worker that waits takes them.
    shown.call("const other = document.createElement('upholster-viewer'); viewer.replaceWith(other)")
    shown.frames()
    reported = shown.call("return Promise.all([...'bcad'].map((name) => viewer.replace(streams[name])))")
    assert reported == [False] * 3 + [True]
    assert shown.page.evaluate("() => started") == 2
    assert len(shown.page.workers) == 1


def test_what_is_shown_is_what_a_new_viewer_shows(shown: Any) -> None:
    shown.call("viewer.open(streams.a)")  # at the size that the page has by now
    shown.complete().settle_shape()
    before = shown.texels()
    for name in "bdca":
        shown.call("await viewer.replace(streams[argument])", name)
        replaced = shown.texels()
        shown.call("viewer.open(streams[argument])", name)
        shown.complete().settle_shape()
        assert shown.texels() == replaced
    assert replaced == before


def test_the_old_model_stays_until_the_new_one_is_fine(shown: Any) -> None:
    shown.page.locator("upholster-viewer canvas").focus()
    for key in ("ArrowLeft", "ArrowUp", "+", "+", "+"):
        shown.page.keyboard.press(key)
    shown.settle_shape()
    ray = shown.call("return viewer.ray(100, 120)")
    shown.call(WATCH_CANVAS)
    frames, quads = shown.call(
        """
        const frames = [look()]
        let isOver = false
        const watch = () => (frames.push(look()), isOver || requestAnimationFrame(watch))
        requestAnimationFrame(watch)
        const old = viewer.model
        const reported = viewer.replace(streams.d)
        await reported
        const { quads } = viewer.model
        await viewer.settled()
        isOver = true
        frames.push(look())
        return [frames, [old.quads, quads, viewer.model.quads]]
        """
    )
    assert shown.call("return viewer.ray(100, 120)") == ray
    pictures = np.array(frames, float).reshape(len(frames), -1)
    old, new = pictures[0], pictures[-1]
    apart = np.abs(old - new).mean()
    least = np.minimum(np.abs(pictures - old).mean(1), np.abs(pictures - new).mean(1))
    assert apart > 10
    assert least.max() < apart / 10
    assert quads[0] == quads[1] == quads[2] > 1000
