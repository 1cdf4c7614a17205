"""The viewer in Chromium, served by `upholster serve` under its strict policy: what it shows and does."""

from typing import Any

import browser
import numpy as np
import pytest
from browser import likeness, pixels, rendered, wait_until
from command_line import run_cli
from scipy.ndimage import gaussian_filter

from upholster.codec.stream.description import describe
from upholster.codec.stream.prefix import Limit, feed_until
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec

LEAST_OVERLAP = 0.985
MOST_DIFFERENCE = 0.08
LEAST_LIKENESS = 0.94
"""Tolerances of `likeness`: Python's pictures have a key light that throws shadows, and nothing mirrors."""

SHARES = (3, 5, 7, 15, 100)

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(chromium: Any, site: Any) -> Any:
    """The viewer's page with the whole ring, which tests share: under a policy that allows nothing else."""
    with browser.tab(chromium, large=True) as tab:
        answer = tab.page.goto(f"{site}/view/ring.uph?lab")
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        tab.complete().until("inside.querySelector('.panel')")
        yield tab


@pytest.fixture
def ring(page: Any) -> Any:
    """The same, as it was at first."""
    yield page
    assert page.found_wrong() == []
    page.limit()
    page.call("viewer.view = [30, 30]; viewer.removeAttribute('background')")
    page.page.locator("upholster-viewer canvas").focus()
    page.page.keyboard.press("Escape")


def _changed(one: Any, other: Any) -> float:
    """Share of pixels that differ visibly."""
    return float((np.abs(one.astype(int) - other).max(axis=2) > 16).mean())


def _press(tab: Any, *keys: str) -> Any:
    """Press keys with the canvas in focus; the picture then."""
    tab.page.locator("upholster-viewer canvas").focus()
    for key in keys:
        tab.page.keyboard.press(key)
    tab.frames()  # what has moved moves on at the next frame
    tab.settle()
    return tab.picture()


def _wait_for_workers(page: Any, count: int) -> None:
    """Wait until there are so many: one that is at work ends a little later than it is told to."""
    wait_until(page, lambda: len(page.workers) == count)


def test_any_prefix_looks_as_in_python(ring: Any) -> None:
    data = browser.ring()
    ring.call("viewer.setAttribute('background', 'none')")
    ring.settle_shape()
    # Less than the first view is not shown: the model in the exemplar's mean colour.
    assert ring.limit(bytes=1) == {"bytes": describe(data).view, "coefficients": 0, "placements": 0}
    assert describe(data).view < 600
    found = []
    for count in (700, 4_000, 10_000, 20_000, len(data)):
        shown = ring.limit(bytes=count)
        assert shown["bytes"] == count
        picture = ring.picture()
        height, width = picture.shape[:2]
        wanted = rendered(data[:count], (width, height))
        overlap, difference, alike = likeness(picture, wanted)
        assert overlap > LEAST_OVERLAP, count
        assert difference < MOST_DIFFERENCE, count
        # Where charts still have one colour, there are few details that could be alike.
        assert alike > LEAST_LIKENESS or count < 10_000, count
        found.append((picture, wanted))
    # The measure tells one picture from another.
    assert likeness(found[0][0], found[-1][1])[2] < 0.5
    assert likeness(found[-1][0], np.roll(found[-1][1], 3, axis=1))[2] < 0.7
    assert ring.limit()["bytes"] == len(data)


def test_another_view_looks_as_in_python(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ball.uph").complete()
    tab.call("viewer.setAttribute('background', 'none'); viewer.view = [200, -20]")
    tab.settle_shape()
    picture = tab.picture()
    height, width = picture.shape[:2]
    overlap, difference, alike = likeness(picture, rendered(browser.ball(), (width, height), (200.0, -20.0)))
    assert overlap > LEAST_OVERLAP
    assert difference < MOST_DIFFERENCE
    assert alike > LEAST_LIKENESS


def test_the_slider_by_keyboard(ring: Any) -> None:
    slider = ring.page.get_by_label("Bytes of the stream shown")
    slider.focus()
    total = len(browser.ring())
    assert ring.settle()["bytes"] == total
    ring.page.keyboard.press("Home")
    view = describe(browser.ring()).view
    assert ring.settle()["bytes"] == view
    seen = []
    for _ in range(3):
        # Far enough to leave what a part of the warp fields does not change.
        for _ in range(3):
            ring.page.keyboard.press("PageUp")
        seen.append(ring.settle()["bytes"])
    assert view < seen[0] < seen[1] < seen[2] < total
    ring.frames()
    before = slider.get_attribute("aria-valuetext")
    ring.page.keyboard.press("ArrowLeft")
    assert ring.settle()["bytes"] < seen[2]
    ring.until(f"inside.querySelector('input').ariaValueText !== '{before}'")
    ring.page.keyboard.press("End")
    assert ring.settle()["bytes"] == total


def _label(share: int) -> str:
    return f"Show {share} % of the coefficients" if share < 100 else "Show all that the stream has"


def test_buttons_show_shares_of_the_coefficients_as_python_counts_them(ring: Any) -> None:
    data = browser.ring()
    for share in SHARES:
        button = ring.page.get_by_role("button", name=_label(share), exact=True)
        button.click()
        shown = ring.settle()
        decoder = StreamDecoder()
        feed_until(decoder, data, Limit(coefficients=share / 100))
        known, count = decoder.coefficients_known
        assert shown["bytes"] == decoder.received
        assert shown["coefficients"] == pytest.approx(1 if decoder.complete else known / count)
        ring.until_equal(
            "[...inside.querySelectorAll('.group [aria-pressed=true]')].map((one) => one.ariaLabel)",
            [_label(share)],
        )
    ring.page.get_by_role("button", name="Live").click()
    assert ring.settle()["bytes"] == len(data)


def test_keys_turn_zoom_and_go_back(ring: Any) -> None:
    start = _press(ring)
    assert ring.call("return viewer.view") == pytest.approx([30, 30], abs=1e-3)
    turned = _press(ring, "ArrowLeft", "ArrowLeft", "ArrowUp")
    azimuth, elevation = ring.call("return viewer.view")
    assert abs(azimuth - 30) == pytest.approx(15, abs=1e-3)
    assert elevation == pytest.approx(37.5, abs=1e-3)
    assert _changed(start, turned) > 0.2
    assert _changed(_press(ring, "+", "+"), turned) > 0.1
    assert _changed(_press(ring, "0"), start) < 0.01
    assert ring.call("return viewer.view") == pytest.approx([30, 30], abs=1e-3)


def test_every_control_is_reached_by_tab_and_has_a_name(ring: Any) -> None:
    ring.page.evaluate("document.activeElement.blur()")
    seen = []
    for _ in range(40):
        ring.page.keyboard.press("Tab")
        name = ring.call(
            "const one = inside.activeElement; return one && (one.ariaLabel ?? one.textContent.trim())"
        )
        if name and name not in seen:
            seen.append(name)
    count = ring.call("return inside.querySelectorAll('canvas, button, input').length")
    hidden = ring.call(
        "return [...inside.querySelectorAll('button, input')].filter((one) => !one.checkVisibility()).length"
    )
    assert len(seen) == count - hidden
    assert all(seen)


def test_wireframe_borders_and_light_change_the_picture(ring: Any) -> None:
    ring.settle_shape()
    plain = _press(ring)
    for key in "wb":
        assert _changed(_press(ring, key), plain) > 0.01, key
        ring.page.keyboard.press(key)
    assert _changed(_press(ring), plain) < 0.001
    ring.page.keyboard.press("l")
    slider = ring.page.get_by_label("Light from the side, in degrees")
    slider.focus()
    for _ in range(9):
        ring.page.keyboard.press("PageUp")
    ring.settle()
    assert _changed(ring.picture(), plain) > 0.03


def test_side_by_side_with_the_full_quality(ring: Any) -> None:
    ring.page.get_by_role("button", name="Show 3 % of the coefficients", exact=True).click()
    ring.page.get_by_label("Compare with full quality").click()
    ring.until("inside.querySelector('.halves').checkVisibility()")
    _press(ring, *"++++++++")
    ring.settle_shape()  # of both
    picture = ring.picture()
    height, width = picture.shape[:2]
    stacked = ring.call("return inside.querySelector('.halves').classList.contains('stacked')")
    halves = (
        (picture[: height // 2], picture[height - height // 2 :])
        if stacked
        else (picture[:, : width // 2], picture[:, width - width // 2 :])
    )
    # The same model at the same place, but sharper.
    assert _changed(*halves) > 0.01
    smooth = [gaussian_filter(half[:, :, :3].astype(float), (8, 8, 0)) for half in halves]
    assert np.abs(smooth[0] - smooth[1]).mean() < 0.35 * np.abs(smooth[0] - smooth[1][::-1]).mean()
    rough = [np.abs(np.diff(half[:, :, :3].astype(int), axis=1)).mean() for half in halves]
    assert rough[1] > 1.15 * rough[0]
    _wait_for_workers(ring.page, 2)
    ring.page.get_by_label("Compare with full quality").click()
    _wait_for_workers(ring.page, 1)


def test_the_picture_button_saves_a_png(ring: Any, tmp_path: Any) -> None:
    ring.settle_shape()
    with ring.page.expect_download() as waiting:
        ring.page.get_by_label("Save a picture").click()
    assert waiting.value.suggested_filename == "ring.png"
    waiting.value.save_as(tmp_path / "ring.png")
    saved = pixels((tmp_path / "ring.png").read_bytes())
    size = ring.call(
        "const canvas = inside.querySelector('canvas'); return [canvas.clientHeight, canvas.clientWidth]"
    )
    assert saved.shape[:2] == tuple(size)
    assert _changed(saved, ring.picture()) == 0
    assert saved.std() > 20


def test_nothing_overflows_on_a_phone(chromium: Any, site: Any) -> None:
    with browser.tab(chromium, viewport={"width": 360, "height": 640}, has_touch=True, is_mobile=True) as tab:
        tab.open(f"{site}/view/ring.uph?lab").complete().until("inside.querySelector('.panel')")
        for key in ("", "?", "i", "l"):
            if key:
                _press(tab, key)
            wide = tab.call(
                """
                const wide = [document.scrollingElement, viewer, ...inside.querySelectorAll('*')]
                  .filter((one) => one.checkVisibility() && !one.closest('.hidden'))
                  .map((one) => [one, one.getBoundingClientRect()])
                  .filter(([, { left, right }]) => right > 360.5 || left < -0.5)
                  .map(([{ tagName, className }]) => `${tagName} ${className}`)
                return [document.scrollingElement.scrollWidth, ...wide]
                """
            )
            assert wide == [360], key
        small = tab.call(
            """
            const sizes = [...inside.querySelectorAll('button')].filter((one) => one.checkVisibility())
              .map((one) => one.getBoundingClientRect())
            return sizes.filter(({ width, height }) => Math.min(width, height) < 39.5).length
            """
        )
        assert small == 0


def test_what_is_removed_is_freed(tab: Any, site: Any) -> None:
    page = tab.open(f"{site}/view/material.uph").page
    for _ in range(3):
        tab.until("viewer.model?.first")
        _wait_for_workers(page, 1)
        tab.call("viewer.open('/streams/material.uph')")
    for _ in range(3):
        tab.until("viewer.model?.first")
        tab.call("globalThis.kept = viewer; viewer.remove()")
        tab.frames()
        _wait_for_workers(page, 0)
        tab.call("document.querySelector('main').append(kept)")
    # An element that only moves stays as it is.
    tab.complete()
    tab.call("globalThis.model = viewer.model; document.body.append(viewer)")
    tab.frames()
    assert tab.call("return viewer.model === model && viewer.model.complete")
    _wait_for_workers(page, 1)


class Hand:
    """A mouse's wheel and a finger on the canvas; what they do to the page and to the picture."""

    MIDDLE = (200, 200)

    def __init__(self, tab: Any) -> None:
        self.tab = tab
        self.touch = tab.page.context.new_cdp_session(tab.page)
        tab.page.evaluate(
            """() => {
              globalThis.came = { wheel: 0, touchend: 0, scrollend: 0 }
              for (const type in came) addEventListener(type, () => came[type]++, { capture: true })
            }"""
        )

    def look(self) -> Any:
        """The picture as it is now; `picture` keeps the last."""
        self.tab.settle_shape()
        self.picture = self.tab.picture()
        return self.picture

    def wheel(self) -> None:
        self.tab.page.mouse.move(*self.MIDDLE)
        self.tab.page.mouse.wheel(0, 240)

    def swipe(self) -> None:
        """A finger that moves up."""
        x, y = self.MIDDLE
        for kind, above in (
            ("touchStart", 0),
            *(("touchMove", 15 * n) for n in range(1, 9)),
            ("touchEnd", 0),
        ):
            points = [] if kind == "touchEnd" else [{"x": x, "y": y - above}]
            self.touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def moves_the_model(self, work: Any, event: str) -> None:
        """Whether the model moves, and the page does not."""
        before, (came, at) = self.picture, self.tab.page.evaluate("[came, scrollY]")
        work()
        self.tab.until(f"came.{event} > {came[event]}")
        self.tab.frames()
        assert _changed(self.look(), before) > 0.02
        assert self.tab.page.evaluate("[came.scrollend, scrollY]") == [came["scrollend"], at]

    def moves_the_page(self, work: Any) -> None:
        """Whether the page moves, and the model does not; the page is at its start again afterwards."""
        before, came = self.picture, self.tab.page.evaluate("came")
        work()
        self.tab.until(f"came.scrollend > {came['scrollend']} && scrollY > 40")
        assert _changed(self.look(), before) < 0.001
        self.tab.call("scrollTo(0, 0)")
        self.tab.until(f"came.scrollend > {came['scrollend'] + 1} && scrollY === 0")
        self.tab.frames()


def test_a_page_is_scrolled_past_it(chromium: Any, site: Any) -> None:
    with browser.tab(chromium, has_touch=True) as tab:
        tab.open(f"{site}/view/ring.uph").complete()
        hand = Hand(tab)
        hand.look()
        # Nothing scrolls: wheel and finger are the model's.
        hand.moves_the_model(hand.wheel, "wheel")
        hand.moves_the_model(hand.swipe, "touchend")
        tab.call("document.body.style.cssText += ';height:auto;overflow:auto'; viewer.style.height = '300px'")
        tab.frames()
        tab.call("viewer.after(Object.assign(document.createElement('div'), { id: 'more' }))")
        # At once, without anything that would tell the viewer of it.
        tab.call("more.style.cssText = 'height: 3000px'")
        hand.look()
        hand.moves_the_page(hand.swipe)
        hand.moves_the_page(hand.wheel)
        tab.call("inside.querySelector('canvas').focus({ preventScroll: true })")
        hand.moves_the_model(hand.wheel, "wheel")
        tab.call("inside.querySelector('canvas').blur()")
        hand.moves_the_page(hand.wheel)
        # A page that could be scrolled, but whose reader can not.
        tab.call("document.documentElement.style.overflow = 'hidden'")
        hand.moves_the_model(hand.wheel, "wheel")


def test_src_is_a_property_and_an_attribute(tab: Any, site: Any) -> None:
    page = tab.open(f"{site}/view/ring.uph").complete().page
    assert tab.call("return viewer.src") == "/streams/ring.uph"
    tab.call("viewer.src = '/streams/ball.uph'")
    tab.complete()
    assert tab.call("return [viewer.getAttribute('src'), viewer.model.received]") == [
        "/streams/ball.uph",
        len(browser.ball()),
    ]
    tab.call("viewer.removeAttribute('src')")
    assert tab.call("return [viewer.src, viewer.model]") == [None, None]
    _wait_for_workers(page, 0)
    tab.call("viewer.src = '/streams/ring.uph'")
    tab.complete()
    tab.call("viewer.src = null")
    assert tab.call("return [viewer.hasAttribute('src'), viewer.model]") == [False, None]


def test_a_file_opens_from_disk(tab: Any, streams: Any, tmp_path: Any) -> None:
    page, stream = tmp_path / "ring & ring.html", tmp_path / "ring.uph"
    assert run_cli("refine", streams / "ring.uph", "-o", page, "-o", stream).returncode == 0
    data = stream.read_bytes()
    assert page.stat().st_size < 1.24 * len(data) + 100_000  # of which 4 kB are a picture
    asked: list[str] = []
    tab.page.on("request", lambda request: asked.append(request.url.partition(":")[0]))
    tab.open(page.as_uri()).complete()
    assert set(asked) <= {"file", "data", "blob"}
    assert tab.page.title() == "ring & ring"
    tab.call("viewer.setAttribute('background', 'none')")
    tab.settle_shape()
    assert tab.settle()["bytes"] == len(data)
    picture = tab.picture()
    assert likeness(picture, rendered(data, (picture.shape[1], picture.shape[0])))[2] > LEAST_LIKENESS


def test_the_first_picture_has_texture_and_the_page_asked_for_it(tab: Any, site: Any) -> None:
    asked: list[tuple[str, str]] = []
    tab.page.on(
        "request", lambda one: asked.append((one.url.rpartition("/")[2], one.headers.get("range", "")))
    )
    tab.page.add_init_script(
        "addEventListener('first', (event) => (globalThis.firstShown = event.detail.coefficients), true);"
        "addEventListener('complete', () => (globalThis.whole = true), true)"
    )
    tab.open(f"{site}/view/ring.uph").until("globalThis.whole")
    assert tab.call("return firstShown") > 0
    streams = [ranges for name, ranges in asked if name == "ring.uph" and ranges]
    assert streams == ["bytes=0-4095", "bytes=4096-"]
    names = {name for name, _ in asked}
    scripts = {name for name in names if name.endswith(".js")}
    assert scripts == {"upholster-viewer.js", "uph-worker.js"}


def test_nothing_throws_its_shadow_on_what_lies_flat(tab: Any, site: Any) -> None:
    sheet = np.full((48, 48, 3), 180, np.uint8)
    plane = surface_from_spec("plane")
    stream = encode_stream(plane, synthesize(sheet, plane, texels=2000, block=20, seed=1), sheet)
    tab.open(f"{site}/view/ring.uph").until("viewer.open")
    tab.call("viewer.open(Uint8Array.from(argument))", [*stream])
    tab.complete().settle_shape()
    picture = tab.picture()
    height, width = picture.shape[:2]
    middle = picture[int(0.42 * height) : int(0.48 * height), int(0.3 * width) : int(0.7 * width), :3]
    assert middle.min() > 150  # in the shadow 120


def test_viewers_start_near_the_screen_and_share_workers(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/material.uph").until("viewer.model")
    tab.call(
        """
        document.body.replaceChildren(...Array.from({ length: 10 }, () => {
          const one = document.createElement('upholster-viewer')
          one.style.height = '300px'
          one.setAttribute('controls', 'none')
          one.setAttribute('src', '/streams/material.uph')
          return one
        }))
        """
    )
    tab.until("viewer.model?.complete")
    tab.settle_shape()  # its picture is there
    started = "return [...document.querySelectorAll('upholster-viewer')].map((one) => Boolean(one.model))"
    assert 2 <= sum(tab.call(started)) <= 4
    for place in range(0, 2701, 600):
        tab.call("scrollTo(0, argument)", place)
        tab.until(
            f"document.querySelectorAll('upholster-viewer')[{min(9, place // 300 + 1)}].model?.complete"
        )
    tab.until("[...document.querySelectorAll('upholster-viewer')].every((one) => one.model?.complete)")
    assert len(tab.page.workers) <= 3
    # The first one, far away, kept its picture.
    first = tab.call(
        """
        const canvas = inside.querySelector('canvas')
        const context = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d')
        context.drawImage(canvas, 0, 0)
        const { data } = context.getImageData(0, 0, canvas.width, canvas.height)
        return new Set(new Uint32Array(data.buffer)).size
        """
    )
    assert first > 1000


def test_it_is_called_what_its_page_says(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ring.uph").complete()
    canvas = "inside.querySelector('canvas').ariaLabel"
    tab.until(f"{canvas}?.startsWith('ring. Arrow keys')")
    tab.call("viewer.alt = 'A ring of bricks'")
    tab.until(f"{canvas}.startsWith('A ring of bricks. Arrow keys')")
    tab.until("inside.querySelector('[role=status]').textContent.startsWith('Loaded')")


def test_a_picture_of_surroundings_lights_it(tab: Any, site: Any) -> None:
    tab.open(f"{site}/view/ball.uph").complete()
    # Blue above, green below.
    tab.call(
        """
        const canvas = new OffscreenCanvas(64, 32)
        const context = canvas.getContext('2d')
        for (const [n, color] of ['#22f', '#2f2'].entries()) {
          context.fillStyle = color
          context.fillRect(0, 16 * n, 64, 16)
        }
        const own = fetch
        globalThis.fetch = (url, options) => String(url).endsWith('surroundings.png')
          ? canvas.convertToBlob().then((blob) => new Response(blob)) : own(url, options)
        viewer.setAttribute('background', 'none')
        viewer.setAttribute('environment', 'surroundings.png')
        """
    )
    blueness = np.zeros(2)
    for _ in range(100):
        tab.settle_shape()
        picture = tab.picture().astype(float)
        rows, columns = np.nonzero(picture[:, :, 3] == 255)
        middle = rows.mean()
        for n, half in enumerate((rows < middle, rows >= middle)):
            colors = picture[rows[half], columns[half]].mean(axis=0)
            blueness[n] = colors[2] - colors[1]
        if blueness[0] > blueness[1] + 20:
            break
    assert blueness[0] > blueness[1] + 20
