"""Chromium, and servers of our own, for tests of what web/ shows."""

import base64
import json
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.browser import ARGUMENTS, find_chromium
from playwright.sync_api import sync_playwright
from scipy.ndimage import binary_erosion, gaussian_filter

from upholster.apps.server.http_server import serving as serving_app
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.image.color import from_linear
from upholster.image.files.read import read_exemplar, read_image
from upholster.model.render.picture import render
from upholster.model.textured_model import TexturedModel

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from streams import noise

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
BRICKS = ROOT / "examples" / "bricks.png"
PATIENCE = 300_000
"""Milliseconds after which what has not come never will: the machine may be busy, and ten times slower."""

SLOWER = float(os.environ.get("UPHOLSTER_TEST_SLOWER_BROWSER", "1"))
"""By how much pages are slowed down: with 6, too, all tests have to pass. Graphics then are late, too."""

LATE = """
const COMPLETION_STATUS = 0x91B1
const begun = new WeakMap() // fences and programs, with the time
const late = (made) => performance.now() < begun.get(made) + MILLISECONDS
const { fenceSync, getSyncParameter, linkProgram, getProgramParameter } = WebGL2RenderingContext.prototype
Object.assign(WebGL2RenderingContext.prototype, {
  fenceSync (...args) {
    const fence = fenceSync.apply(this, args)
    begun.set(fence, performance.now())
    return fence
  },
  linkProgram (program) {
    begun.set(program, performance.now())
    linkProgram.call(this, program)
  },
  getSyncParameter (fence, name) {
    return late(fence) ? this.UNSIGNALED : getSyncParameter.call(this, fence, name)
  },
  getProgramParameter (program, name) {
    return (name !== COMPLETION_STATUS || !late(program)) && getProgramParameter.call(this, program, name)
  }
})
""".replace("MILLISECONDS", str(100 * SLOWER))
"""What is drawn, and programs for it, are ready so much later."""

WATCH = """
globalThis.violations = []
addEventListener('securitypolicyviolation', (event) => {
  violations.push(`${event.effectiveDirective} forbids ${event.blockedURI}`)
})
"""

VIEWPORT = {"width": 300, "height": 330}
"""Below about a hundred pixels Chromium draws one frame a second."""

SMALL = {"viewport": VIEWPORT, "device_scale_factor": 0.5, "reduced_motion": "reduce"}
"""The processor draws, a microsecond a pixel: pages have few, and models do not swing out."""

LARGE = {
    "viewport": {"width": 420, "height": 460},
    "device_scale_factor": 1,
    "reduced_motion": "no-preference",
}
"""As people have it. In smaller pictures the silhouette is a larger share."""

JAGGED = """
OffscreenCanvas.prototype.getContext = ((get) => function (kind, options) {
  return get.call(this, kind, kind === 'webgl2' ? { ...options, antialias: false } : options)
})(OffscreenCanvas.prototype.getContext)
"""
"""Edges on small pages are not smooth: drawing takes half the time."""

HARMLESS = ("GPU stall due to ReadPixels",)
"""What Chromium warns of where a picture is read back, which tests do all the time."""


@contextmanager
def chromium() -> Any:
    """Debian's Chromium or another, without display, with WebGL2 by the processor."""
    path = find_chromium()
    if path is None:
        if os.environ.get("CI"):
            pytest.fail("Chromium is not installed, and CI is set")
        pytest.skip("Chromium is not installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*ARGUMENTS])
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def serving(app: Any) -> Any:
    """Serve an ASGI application on loopback, in a thread; yields its address without a slash at the end."""
    with serving_app(app) as address:
        yield address.rstrip("/")


class Tab:
    """A page with a viewer in it, and all that the browser found wrong.

    What the viewer does by itself, at its next frame, by an observer, or in its worker, has to be waited for:
    `until` waits for a condition, `settle` and `settle_shape` for textures and shape, `frames` for what the
    page does in its next frame. What must not happen is asked for after something that comes later.
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self.problems: list[str] = []
        page.set_default_timeout(PATIENCE)
        if SLOWER != 1:
            session = page.context.new_cdp_session(page)
            session.send("Emulation.setCPUThrottlingRate", {"rate": SLOWER})
            page.add_init_script(LATE)
        page.add_init_script(WATCH)
        page.on("console", self._heard)
        page.on("pageerror", lambda error: self.problems.append(f"error: {error}"))

    def _heard(self, message: Any) -> None:
        reported = f"{message.type}: {message.text}"
        if message.type in ("error", "warning") and not any(known in reported for known in HARMLESS):
            self.problems.append(reported)

    def found_wrong(self) -> list[str]:
        """What is in the console, thrown, or against the content security policy."""
        return [*self.problems, *self.page.evaluate("violations")]

    def open(self, address: str) -> "Tab":
        """Go to a page that holds a viewer."""
        self.page.goto(address)
        return self

    def call(self, code: str, argument: Any = None) -> Any:
        """Run code with `viewer`, the element, `inside`, its shadow root, and `argument`."""
        return evaluate(
            self.page,
            "async (argument) => { const viewer = document.querySelector('upholster-viewer');"
            f" const inside = viewer?.shadowRoot; {code} }}",
            argument,
        )

    def until(self, condition: str) -> None:
        """Wait until there is a viewer, and a condition on `viewer` and `inside` holds.

        A page that unpacks itself makes the viewer some time after it is loaded.
        """
        self.page.wait_for_function(
            "() => { const viewer = document.querySelector('upholster-viewer');"
            f" const inside = viewer?.shadowRoot; return Boolean(inside && ({condition})) }}"
        )

    def until_equal(self, code: str, expected: Any) -> None:
        """Wait until code, an expression of `viewer` and `inside`, has a value; fails with the one it has."""
        found = self.call(
            f"const look = () => JSON.stringify({code} ?? null);"
            f" for (const end = performance.now() + {PATIENCE / 2};"
            " look() !== argument && performance.now() < end; )"
            "   await new Promise((done) => setTimeout(done, 20));"
            " return look()",
            json.dumps(expected, separators=(",", ":"), ensure_ascii=False),
        )
        assert json.loads(found) == expected

    def frames(self, count: int = 2) -> None:
        """Let the page draw two frames: then the first one's observers have been heard."""
        self.call(f"for (let n = 0; n < {count}; n++) await new Promise(requestAnimationFrame)")

    def settle(self) -> Any:
        """Wait until all that is here is in the textures; what the model says of it."""
        return self.call("await viewer.model.settled(); return viewer.model.shown")

    def settle_shape(self) -> None:
        """Wait until the shape is as fine as the view takes, too: that is several frames."""
        self.call("await viewer.settled()")

    def complete(self) -> "Tab":
        """Wait for the whole stream, and until the controls show it."""
        self.until("viewer.model?.complete")
        self.frames()
        return self

    def limit(self, **limit: float) -> Any:
        """Show a prefix, or all; what is shown then."""
        self.call("viewer.model.setLimit(argument)", limit or None)
        return self.settle()

    def picture(self) -> Any:
        """What the canvas shows, (height, width, 3 or 4) uint8."""
        text = self.call(
            "const blob = await viewer.picture();"
            "const bytes = new Uint8Array(await blob.arrayBuffer());"
            "let text = ''; for (const byte of bytes) text += String.fromCharCode(byte); return btoa(text)"
        )
        return pixels(base64.b64decode(text))

    def texels(self) -> Any:
        """A digest of all textures, gutters included, chart by chart."""
        return self.call(
            """
            const parts = viewer.model.charts.map(({ textures }) => textures.color.data)
            const all = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0))
            parts.reduce((at, part) => (all.set(part, at), at + part.length), 0)
            let [low, high] = [0, 0]
            for (const byte of all) {
              low = (Math.imul(low, 31) + byte) | 0
              high = (Math.imul(high, 131) + byte) | 0
            }
            return [all.length, low, high]
            """
        )

    def note(self) -> str:
        """What the viewer says of errors; nothing: ''."""
        return str(
            self.call("const note = inside.querySelector('.note'); return note.hidden ? '' : note.innerText")
        )


def evaluate(page: Any, code: str, argument: Any = None) -> Any:
    """Run an async function in a page, but not for ever."""
    return page.evaluate(
        "([argument, patience]) => Promise.race([new Promise((_, failed) =>"
        f" setTimeout(() => failed(new Error('nothing comes')), patience)), ({code})(argument)])",
        [argument, PATIENCE],
    )


@contextmanager
def tab(browser: Any, *, faultless: bool = True, large: bool = False, **options: Any) -> Any:
    """A new page, `SMALL` or `LARGE`; at its end nothing may be wrong, unless errors are provoked."""
    context = browser.new_context(**{**(LARGE if large else SMALL), **options})
    try:
        if not large:
            context.add_init_script(JAGGED)
        new = Tab(context.new_page())
        yield new
        if faultless:
            wrong = new.found_wrong()
            assert not wrong, wrong
    finally:
        context.close()


def wait_until(page: Any, condition: Callable[[], object]) -> None:
    """Wait for what shows outside the page: its workers, files, what a server was asked for."""
    for _ in range(PATIENCE // 20):
        if condition():
            return
        page.wait_for_timeout(20)  # lets Playwright hear of events
    raise AssertionError("what is waited for does not come")


def pixels(data: bytes) -> Any:
    """Pixels of a PNG file's bytes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        path.write_bytes(data)
        return read_image(path)


@cache
def ring() -> bytes:
    """The stream of a ring of bricks: 300,000 texels, 32 kB."""
    exemplar, surface = read_exemplar(BRICKS, resize=128), ring_cyclide()
    quilt = synthesize(exemplar, surface, texels=300_000, sample_size=5.0, direction="around:z", seed=3)
    return encode_stream(surface, quilt, exemplar)


@cache
def ball() -> bytes:
    """The stream of a sphere of bricks."""
    exemplar, surface = read_exemplar(BRICKS, resize=128), surface_from_spec("sphere")
    quilt = synthesize(exemplar, surface, texels=200_000, sample_size=1.2, seed=2)
    return encode_stream(surface, quilt, exemplar)


@cache
def material() -> bytes:
    """The stream of a small material on a torus: every map that a picture shows."""
    exemplar, surface = noise(48, 48, 3, seed=1), surface_from_spec("torus:R=2,r=0.9")
    maps = {
        "normal": noise(48, 48, 3, seed=2),
        "roughness": noise(48, 48, 1, seed=3),
        "metallic": noise(48, 48, 1, seed=4),
        "ao": noise(48, 48, 1, np.uint16, seed=5),
        "emission": noise(48, 48, 3, np.uint8, seed=6),
    }
    quilt = synthesize(exemplar, surface, texels=40_000, block=20, sample_size=2.0, seed=1)
    return encode_stream(surface, quilt, exemplar, maps=maps)


def rendered(data: bytes, size: tuple[int, int], view: tuple[float, float] = (30.0, 30.0)) -> Any:
    """Python's picture of a stream, or of a prefix: (height, width, 4) uint8, see-through round the model."""
    decoder = StreamDecoder()
    decoder.feed(data)
    assert decoder.surface is not None
    model = TexturedModel(decoder.surface, decoder.texels())
    mesh = model.mesh
    faces = mesh.all_triangles()
    options: Any = {"size": size, "view": view, "background": None, "floor": False}
    return from_linear(
        render(mesh.positions, mesh.normals, model.uv, faces, model.atlas.pixels, **options), np.uint8
    )


def likeness(one: Any, other: Any) -> tuple[float, float, float]:
    """How alike two pictures (h, w, 4) of a model are, one of the browser's, one of Python's.

    The overlap of the silhouettes, shared over joint area; the mean difference of colours, 0 to 1, light and
    all; and the correlation of details: of each colour over its own mean round about, which takes the light
    out. Of a picture of bricks that is shifted by a hundredth of its width that is about a half.
    """
    inside = [picture[:, :, 3] > threshold for picture, threshold in ((one, 254), (other, 127))]
    overlap = (inside[0] & inside[1]).sum() / (inside[0] | inside[1]).sum()
    both = binary_erosion(inside[0] & inside[1], iterations=3)
    colors = [picture[:, :, :3] / 255.0 for picture in (one, other)]
    details = []
    for color in colors:
        fine, coarse = (_smoothed(color, both, sigma) for sigma in (1, 10))
        detail = fine / np.maximum(coarse, 1e-3)
        details.append(detail - detail.mean())
    norm = np.sqrt((details[0] ** 2).sum() * (details[1] ** 2).sum())
    difference = np.abs(colors[0] - colors[1])[both].mean()
    return float(overlap), float(difference), float((details[0] * details[1]).sum() / norm)


def _smoothed(color: Any, where: Any, sigma: float) -> Any:
    """Means round each pixel of `where`, of these pixels only: (pixels, 3)."""
    weight = gaussian_filter(where.astype(float), sigma)[where]
    return np.stack(
        [gaussian_filter(np.where(where, color[:, :, k], 0), sigma)[where] / weight for k in range(3)],
        axis=-1,
    )
