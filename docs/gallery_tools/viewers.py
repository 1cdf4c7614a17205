"""Pictures of the viewer in a browser: Chromium without display, by Playwright, from a server of our own."""

import io
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.browser import ARGUMENTS, find_chromium
from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars

__all__ = ["arriving", "browser_page", "lacking", "lights", "viewer"]

ARRIVED = (1_000, 5_000, 10_000, 20_000)
"""Bytes of a stream at which it is shown."""

_COVERED = {
    "ring.uph": "bricks.png --on cyclide --texels 4M --sample-size 5 --direction around:z --seed 3",
    "torus.uph": "bricks_material --on torus:R=2,r=0.9 --texels 2M --sample-size 2.5"
    " --direction around:z --seed 1",
}


@cache
def lacking() -> str:
    """Return what browser pictures need and this machine has not; nothing: ''."""
    if find_chromium() is None:
        return "Chromium"
    try:
        import playwright.sync_api  # noqa: F401  # only to see whether it is installed
    except ModuleNotFoundError:
        return "Playwright"
    return ""


def viewer(_exemplars: Exemplars) -> Any:
    """Show the viewer on a desk, its laboratory in the dark and side by side, and the viewer on a phone."""
    with _pages() as pages:
        wide = pages.open("ring.uph", (960, 640))
        wide.press("ArrowLeft", "ArrowLeft")
        dark = pages.open("torus.uph", (960, 640), lab=True, color_scheme="dark")
        dark.button("Show 3 % of the coefficients")
        dark.button("Compare with full quality")
        dark.wait("inside.querySelector('.halves').checkVisibility()")
        dark.press("+")
        phone = pages.open("ring.uph", (360, 640), device_scale_factor=2, is_mobile=True, has_touch=True)
        images = [page.screenshot() for page in (wide, dark, phone)]
    images[2] = images[2].resize((360, 640), Image.Resampling.LANCZOS)
    titles = ("(a) light", "(b) the laboratory, dark, side by side with the full quality", "(c) on a phone")
    panels = [Panel(image, title) for image, title in zip(images, titles, strict=True)]
    return compose([panels])


def lights(_exemplars: Exemplars) -> Any:
    """Show a material with the light from two sides."""
    panels = []
    with _pages() as pages:
        page = pages.open("torus.uph", (600, 480), bare=True)
        for title, drag in (("(a) light from the left", 0), ("(b) light from the right", 240)):
            page.light(drag)
            panels.append(Panel(page.canvas(), title))
    return compose([panels])


def arriving(_exemplars: Exemplars) -> Any:
    """Show a stream at five counts of bytes: in the browser, and below as Python renders it."""
    from upholster.base.options.write_options import WriteOptions
    from upholster.codec.stream.reader import StreamDecoder
    from upholster.image.color import from_linear
    from upholster.model.textured_model import TexturedModel

    size = (300, 250)
    upper, lower = [], []
    with _pages() as pages:
        data = pages.data("ring.uph")
        page = pages.open("ring.uph", size, bare=True, view="150,32")
        for count in (*ARRIVED, len(data)):
            page.run("viewer.model.setLimit({ bytes: argument }); await viewer.settled()", count)
            upper.append(Panel(page.canvas(), f"{count:,} bytes in the viewer"))
            decoder = StreamDecoder()
            decoder.feed(data[:count])
            if decoder.surface is None:
                raise AssertionError("these bytes show something")
            model = TexturedModel(
                decoder.surface, decoder.texels(), WriteOptions(size=size, view=(150.0, 32.0))
            )
            lower.append(Panel(Image.fromarray(from_linear(model.picture(), "uint8")), "and by Python"))
    return compose([upper, lower], gap=12)


class _Page:
    """A page with a viewer."""

    def __init__(self, page: Any) -> None:
        self._page = page

    def run(self, code: str, argument: Any = None) -> Any:
        return self._page.evaluate(
            "async (argument) => { const viewer = document.querySelector('upholster-viewer');"
            f" const inside = viewer.shadowRoot; {code} }}",
            argument,
        )

    def wait(self, condition: str) -> None:
        self._page.wait_for_function(
            "() => { const viewer = document.querySelector('upholster-viewer');"
            f" const inside = viewer?.shadowRoot; return Boolean({condition}) }}"
        )

    def press(self, *keys: str) -> None:
        self._page.locator("upholster-viewer canvas").focus()
        for key in keys:
            self._page.keyboard.press(key)

    def button(self, label: str) -> None:
        self._page.get_by_label(label, exact=True).click()

    def light(self, right: int) -> None:
        """Drag the light by so many pixels, with the shift key."""
        box = self._page.locator("upholster-viewer canvas").bounding_box()
        x, y = box["x"] + box["width"] / 3, box["y"] + box["height"] / 2
        self._page.keyboard.down("Shift")
        self._page.mouse.move(x, y)
        self._page.mouse.down()
        self._page.mouse.move(x + right, y, steps=4)
        self._page.mouse.up()
        self._page.keyboard.up("Shift")

    def canvas(self) -> Any:
        """Return what the canvas shows."""
        self.run("await viewer.settled()")
        values = self.run("return [...new Uint8Array(await (await viewer.picture()).arrayBuffer())]")
        return Image.open(io.BytesIO(bytes(values))).convert("RGB")

    def screenshot(self) -> Any:
        """Return what the whole page shows, without the mark of the focus."""
        self.run("await viewer.settled(); inside.activeElement?.blur()")
        self._page.mouse.move(1, 1)
        return Image.open(io.BytesIO(self._page.screenshot())).convert("RGB")


class _Pages:
    """Streams on a server, and a browser."""

    def __init__(self, folder: Path, address: str, chromium: Any) -> None:
        self._folder, self._address, self._chromium = folder, address, chromium

    def data(self, name: str) -> bytes:
        return (self._folder / name).read_bytes()

    def open(
        self,
        name: str,
        size: tuple[int, int],
        *,
        bare: bool = False,
        lab: bool = False,
        view: str = "30,30",
        **options: Any,
    ) -> _Page:
        """Open a stream's page, with the laboratory, or, bare, nothing but its stage; it is complete then."""
        context = self._chromium.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        tab = context.new_page()
        tab.goto(f"{self._address}/view/{name}{'?lab' * lab}")
        page = _Page(tab)
        page.run("viewer.setAttribute('view', argument)", view)
        if bare:
            page.run(
                "viewer.setAttribute('controls', 'none'); document.body.replaceChildren(viewer);"
                " viewer.style.blockSize = '100vh'"
            )
        page.wait("viewer.model?.complete")
        page.run("await viewer.settled()")
        return page


@contextmanager
def _pages() -> Iterator[_Pages]:
    from upholster.apps.server import Catalogue, make_app, serving

    with TemporaryDirectory() as name:
        folder = Path(name)
        for stream, options in _COVERED.items():
            exemplar, *rest = options.split()
            command = [sys.executable, "-m", "upholster", "cover", str(OWN / exemplar), *rest]
            subprocess.run([*command, "-o", str(folder / stream)], check=True, capture_output=True)
        with serving(make_app(Catalogue([name]))) as address, _running() as chromium:
            yield _Pages(folder, address.rstrip("/"), chromium)


@contextmanager
def browser_page(size: tuple[int, int]) -> Iterator[Any]:
    """Yield an empty page of a browser."""
    with _running() as chromium:
        page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
        page.set_default_timeout(120_000)
        yield page


@contextmanager
def _running() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=find_chromium(), args=[*ARGUMENTS])
        try:
            yield chromium
        finally:
            chromium.close()
