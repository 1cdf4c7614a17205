"""The viewer in Chromium, served by `upholster serve` under its strict policy: what it shows and does."""

from typing import Any

import browser
import numpy as np
import pytest
from browser import likeness, pixels, rendered
from command_line import run_cli
from scipy.ndimage import gaussian_filter

from upholster.stream import StreamDecoder, describe
from upholster.stream.prefix import Limit, feed_until

LEAST_OVERLAP = 0.985
MOST_DIFFERENCE = 0.025
LEAST_LIKENESS = 0.96
"""Tolerances of `likeness`; measured: 0.992, 0.011 and 0.987."""

SHARES = (3, 5, 7, 15, 100)

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(chromium: Any, site: Any) -> Any:
    """The viewer's page with the whole ring, which tests share: under a policy that allows nothing else."""
    with browser.tab(chromium) as tab:
        answer = tab.page.goto(f"{site}/view/ring.uph")
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        yield tab.complete()


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
    tab.settle()
    return tab.picture()


def _wait_for_workers(page: Any, count: int) -> None:
    """Wait until there are so many: one that is at work ends a little later than it is told to."""
    for _ in range(100):
        if len(page.workers) == count:
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"{len(page.workers)} workers, not {count}")


def test_any_prefix_looks_as_in_python(ring: Any) -> None:
    data = browser.ring()
    ring.call("viewer.setAttribute('background', 'none')")
    ring.settle_shape()
    # Less than the first view is not shown: the model in the exemplar's mean colour.
    assert ring.limit(bytes=1) == {"bytes": describe(data).view, "coefficients": 0, "charts": 0}
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
        assert alike > LEAST_LIKENESS, count
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
    before = slider.get_attribute("aria-valuetext")
    ring.page.keyboard.press("ArrowLeft")
    assert ring.settle()["bytes"] < seen[2]
    assert slider.get_attribute("aria-valuetext") != before
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
        assert shown["coefficients"] == pytest.approx(known / count)
        assert button.get_attribute("aria-pressed") == "true"
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
    assert _changed(ring.picture(), plain) > 0.1


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
        tab.open(f"{site}/view/ring.uph").complete()
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
    for _ in range(5):
        tab.until("viewer.model?.first")
        _wait_for_workers(page, 1)
        tab.call("viewer.open('/streams/material.uph')")
    wait = "await new Promise((done) => setTimeout(done, 50));"
    for _ in range(5):
        tab.until("viewer.model?.first")
        tab.call("globalThis.kept = viewer; viewer.remove();" + wait)
        _wait_for_workers(page, 0)
        tab.call("document.querySelector('main').append(kept)")
    # An element that only moves stays as it is.
    tab.complete()
    tab.call("globalThis.model = viewer.model; document.body.append(viewer);" + wait)
    assert tab.call("return viewer.model === model && viewer.model.complete")
    _wait_for_workers(page, 1)


def test_a_page_is_scrolled_past_it(tab: Any, site: Any) -> None:
    page = tab.open(f"{site}/view/ring.uph").complete().page
    size = "return (await viewer.picture()).size"
    middle = (200, 200)

    def wheel() -> tuple[float, int]:
        before = tab.call(size)
        page.mouse.wheel(0, 240)
        page.wait_for_timeout(400)
        return tab.call("return scrollY"), tab.call(size) - before

    page.mouse.move(*middle)
    moved, change = wheel()
    assert moved == 0  # nothing scrolls: the wheel is the model's
    assert change != 0
    tab.call("document.body.style.cssText += ';height:auto;overflow:auto'")
    tab.call(
        "viewer.style.height = '400px'; document.body.append(Object.assign(document.createElement('div')))"
    )
    tab.call("document.body.lastChild.style.height = '3000px'")
    page.wait_for_timeout(300)
    page.mouse.move(middle[0] + 1, middle[1])
    moved, change = wheel()
    assert moved > 100
    assert change == 0
    assert tab.call("return inside.querySelector('canvas').style.touchAction") == "pan-y"
    tab.call("scrollTo(0, 0)")
    page.mouse.click(*middle)
    moved, change = wheel()
    assert moved == 0
    assert change != 0


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
    assert page.stat().st_size < len(data) + 256_000
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
