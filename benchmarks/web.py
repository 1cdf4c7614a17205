"""The viewer over a slow line, against the same model as GLB, and frame times: in Chromium, by its processor.

Everything is counted from the click on: one line of 256 kbit/s carries page, scripts and model. Needs
Chromium, the extra ``test`` (Playwright, Starlette, uvicorn) and ``npm ci`` in web/; for the GLB beside it
``npm install --no-save --legacy-peer-deps @google/model-viewer@4.1.0`` there.
"""

import shutil
import statistics
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import upholster
from benchmarks.measure import EXEMPLAR, Results
from upholster.export import write_glb, write_html
from upholster.outputs import TexturedModel
from upholster.stream import encode_stream

__all__ = ["frames", "web"]

PAGES = Path(__file__).parent / "web_pages"
WEB = Path(__file__).parent.parent / "web"
RATE = 256_000
RUNS = 10
SIZE = (640, 480)
GAP = 8
BESIDE = Path(__file__).parent / "web_beside.jpg"
MODEL_VIEWER = WEB / "node_modules" / "@google" / "model-viewer" / "dist" / "model-viewer.min.js"
QUADS, FRAMES = (1_000, 5_000, 20_000, 50_000), 60
"""The paper's surfaces have 1,000 to 50,000 quadrilaterals (its section 4.5)."""
MOST_SECONDS = 600
ARGUMENTS = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--no-sandbox",
)


def web(results: Results) -> None:
    """Measure times from the click to the frame at 256 kbit/s, and how long the page is blocked."""
    with tempfile.TemporaryDirectory() as name, _chromium("web") as chromium:
        if chromium is not None:
            folder = Path(name)
            _write(folder)
            with _serving(folder, RATE) as address:
                _stream_times(results, chromium, address, folder)
                _glb_time(results, chromium, address, folder)
            if MODEL_VIEWER.is_file():
                with _serving(folder) as address:
                    pictures = _beside(chromium, address)
                _compose(pictures).save(BESIDE, quality=88)


def frames(results: Results) -> None:
    """Measure frames per second of sixteen charts of 1024² in the viewer's light, by number of quads."""
    with tempfile.TemporaryDirectory() as name, _chromium("frames") as chromium:
        if chromium is not None:
            _write_large(Path(name))
            with _serving(Path(name)) as address:
                for quads in QUADS:
                    _frames(results, chromium, address, quads)


@contextmanager
def _chromium(what: str) -> Iterator[Any]:
    """Start a browser; None, with a message, where something is missing."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None or not (WEB / "node_modules" / "three").is_dir():
        print(f"{what}: skipped; it needs Chromium, and `npm ci` in web/")
        yield None
        return
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        print(f"{what}: skipped; it needs Playwright: pip install 'upholster[test]'")
        yield None
        return
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=browser, args=[*ARGUMENTS])
        try:
            yield chromium
        finally:
            chromium.close()


def _write(folder: Path) -> None:
    """Make the first picture's ring as stream and GLB."""
    ring = upholster.ring_cyclide()
    exemplar = upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(
        exemplar, ring, texels=4_000_000, sample_size=5.0, direction="around:z", seed=3
    )
    (folder / "ring.uph").write_bytes(encode_stream(ring, quilt, exemplar))
    model = TexturedModel(ring, upholster.paint(quilt, exemplar))
    write_glb(folder / "ring.glb", model.mesh, model.uv, model.atlas.pixels, texture="webp")
    upholster.cover(
        EXEMPLAR.parent / "bricks_material",
        "torus:R=2,r=0.9",
        [folder / "torus.uph", folder / "torus.glb"],
        synthesis={"texels": 1_000_000, "sample_size": 2.5, "direction": "around:z"},
        seed=1,
    )


def _write_large(folder: Path) -> None:
    """Make 16 charts of 1024 × 1024 texels as a stream."""
    ring = upholster.ring_cyclide()
    exemplar = upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(exemplar, ring, method="paper", chart=1024, seed=3)
    (folder / "large.uph").write_bytes(encode_stream(ring, quilt, exemplar))


@contextmanager
def _serving(folder: Path, rate: int | None = None) -> Iterator[str]:
    """Serve streams, GLB, pages and scripts over one line."""
    from starlette.applications import Starlette
    from starlette.middleware.gzip import GZipMiddleware
    from starlette.routing import Mount
    from starlette.staticfiles import StaticFiles
    from starlette.types import Receive, Scope, Send

    from upholster.server import Catalogue, make_app
    from upholster.server.running import listen, make_server
    from upholster.server.throttle import Pace, Throttle

    own = Starlette(
        routes=[
            Mount("/bench/web", GZipMiddleware(StaticFiles(directory=WEB, follow_symlink=True))),
            Mount("/bench/models", StaticFiles(directory=folder)),
            Mount("/bench", StaticFiles(directory=PAGES)),
        ]
    )
    streams = make_app(Catalogue([str(path) for path in folder.glob("*.uph")]))

    async def either(scope: Scope, receive: Receive, send: Send) -> None:
        is_own = scope["type"] == "http" and scope["path"].startswith("/bench/")
        await (own if is_own else streams)(scope, receive, send)

    ready = threading.Event()
    server = make_server(either if rate is None else Throttle(either, Pace(rate)), ready.set)
    with listen("127.0.0.1", 0) as listener:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            ready.wait(20)
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(20)


@contextmanager
def _page(chromium: Any) -> Iterator[Any]:
    """Make a page of a browser that knows nothing yet."""
    context = chromium.new_context(viewport={"width": SIZE[0], "height": SIZE[1]}, bypass_csp=True)
    try:
        page = context.new_page()
        page.set_default_timeout(1000 * MOST_SECONDS)
        page.add_init_script((PAGES / "watch.js").read_text(encoding="utf-8"))
        yield page
    finally:
        context.close()


def _stream_times(results: Results, chromium: Any, address: str, folder: Path) -> None:
    """Add the rows of the ring's stream."""
    runs = []
    for _ in range(RUNS):
        with _page(chromium) as page:
            page.goto(f"{address}/view/ring.uph", wait_until="commit")
            page.wait_for_function("globalThis.seen.complete")
            runs.append(page.evaluate("globalThis.seen"))
    line = f"256 kbit/s, {SIZE[0]} × {SIZE[1]} pixels, median of {RUNS}"
    first = statistics.median(run["first"] for run in runs) / 1000
    shown = statistics.median(run["shown"]["bytes"] for run in runs)
    deviation = min(run["deviation"] for run in runs)
    results.add(
        "web: from the click to the first picture with texture",
        first,
        "s",
        aim="at most 2.5",
        remark=f"{line}; of {shown:.0f} bytes of the stream; deviation of its colours {deviation:.0f} of 255",
    )
    scripts = statistics.median(run["bytes"] for run in runs) / 1000
    stream = (folder / "ring.uph").stat().st_size / 1000
    results.add(
        "web: from the click to all of it",
        statistics.median(run["complete"] for run in runs) / 1000,
        "s",
        aim="at most 6",
        remark=f"{stream:.0f} kB of stream and {scripts - stream:.0f} kB of page and scripts: "
        f"{8000 * scripts / RATE:.2f} s on the line",
    )
    blocked = [max((task for task in run["tasks"]), default=0) for run in runs]
    results.add(
        f"web: longest task of the page after the first picture, worst of {RUNS} loads",
        max(blocked),
        "ms",
        aim="at most 50",
        remark="shorter than 50 ms count as 0",
    )
    write_html(folder / "ring.html", (folder / "ring.uph").read_bytes())
    beside = (folder / "ring.html").stat().st_size / 1000 - stream
    results.add("web: ring.html beside its stream", beside, "kB", aim="at most 125")


def _glb_time(results: Results, chromium: Any, address: str, folder: Path) -> None:
    """Add the row of the ring as GLB in <model-viewer>."""
    if not MODEL_VIEWER.is_file():
        print(f"web: no GLB beside it, since {MODEL_VIEWER.relative_to(WEB.parent)} is missing")
        return
    with _page(chromium) as page:
        page.goto(f"{address}/bench/model-viewer.html?ring.glb", wait_until="commit")
        page.wait_for_function("globalThis.seen.complete")
        found = page.evaluate("globalThis.seen")
    size = (folder / "ring.glb").stat().st_size / 1000
    rest = found["bytes"] / 1000 - size
    results.add(
        "web: from the click to the same as GLB with WebP in <model-viewer>",
        found["complete"] / 1000,
        "s",
        remark=f"{size:.0f} kB of GLB and {rest:.0f} kB of page and scripts; one run",
    )


def _beside(chromium: Any, address: str) -> list[list[bytes]]:
    """Return screenshots of ring and torus, each as a stream in the viewer and as GLB in <model-viewer>."""
    rows = []
    for name in ("ring", "torus"):
        row = []
        for path in (f"/view/{name}.uph", f"/bench/model-viewer.html?{name}.glb"):
            with _page(chromium) as page:
                page.goto(address + path)
                page.wait_for_function("globalThis.seen.complete")
                page.evaluate("document.querySelector('upholster-viewer')?.settled()")
                page.wait_for_timeout(1000)
                row.append(bytes(page.locator("upholster-viewer, model-viewer").screenshot()))
        rows.append(row)
    return rows


def _compose(rows: list[list[bytes]]) -> Any:
    """Lay pictures side by side, row by row."""
    import io

    from PIL import Image

    images = [[Image.open(io.BytesIO(data)).convert("RGB") for data in row] for row in rows]
    width, height = SIZE
    sheet = Image.new("RGB", (width * len(rows[0]) + GAP, height * len(rows) + GAP), "white")
    for i, row in enumerate(images):
        for j, image in enumerate(row):
            part = image.resize(SIZE, Image.Resampling.LANCZOS)
            sheet.paste(part, (j * (width + GAP), i * (height + GAP)))
    return sheet


def _frames(results: Results, chromium: Any, address: str, quads: int) -> None:
    code = f"turn('/bench/models/large.uph', {quads}, {FRAMES})"
    with _page(chromium) as page:
        page.goto(f"{address}/bench/frames.html")
        page.wait_for_function("() => globalThis.ready")
        found = page.evaluate(code)
    median = statistics.median(found["times"])
    results.add(
        f"frames of {found['quads']:,} quads, {found['charts']} textures of 1024²",
        1000 / median,
        "per second",
        aim="at least 30 on a GPU",
        remark=f"{median:.0f} ms; by processor (SwiftShader), {SIZE[0]} × {SIZE[1]}, shadows; median of "
        f"{FRAMES}, each waited for by readPixels",
    )
