"""The viewer over a slow line, against the same model as GLB, and frame times: in Chromium, by its processor.

Needs Chromium, the extra ``test`` (Playwright, Starlette, uvicorn) and ``npm ci`` in web/.
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
RUNS = 5
SIZE = (640, 480)
SHARE = 0.15
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
    """Measure times from request to frame at 256 kbit/s, and how long the page is blocked."""
    with tempfile.TemporaryDirectory() as name, _chromium("web") as chromium:
        if chromium is not None:
            _write(Path(name))
            with _serving(Path(name)) as address:
                _times(results, chromium, address, Path(name))


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
    atlas = model.atlas.pixels
    write_glb(folder / "ring.glb", model.mesh, model.uv, atlas, texture="webp")


def _write_large(folder: Path) -> None:
    """Make 16 charts of 1024 × 1024 texels as a stream."""
    ring = upholster.ring_cyclide()
    exemplar = upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(exemplar, ring, method="paper", chart=1024, seed=3)
    (folder / "large.uph").write_bytes(encode_stream(ring, quilt, exemplar))


@contextmanager
def _serving(folder: Path) -> Iterator[str]:
    """Serve streams and GLB at `RATE`, and pages and scripts as fast as it goes."""
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Mount, Route
    from starlette.staticfiles import StaticFiles
    from starlette.types import Receive, Scope, Send

    from upholster.server import Catalogue, make_app
    from upholster.server.running import listen, make_server
    from upholster.server.sending import file_response
    from upholster.server.versions import Versions

    versions = Versions()

    async def glb(request: Request) -> Response:
        version = versions.identify((folder / "ring.glb").open("rb", buffering=0))
        if version is None:
            raise AssertionError("nobody writes to this file")
        return file_response(request, version, "model/gltf-binary", rate=RATE)

    pages = Starlette(
        routes=[
            Route("/bench/ring.glb", glb),
            Mount("/bench/web", StaticFiles(directory=WEB, follow_symlink=True)),
            Mount("/bench/streams", StaticFiles(directory=folder)),
            Mount("/bench", StaticFiles(directory=PAGES)),
        ]
    )
    streams = make_app(Catalogue([str(path) for path in folder.glob("*.uph")]), rate=RATE)

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        own = scope["type"] == "http" and scope["path"].startswith("/bench/")
        await (pages if own else streams)(scope, receive, send)

    ready = threading.Event()
    server = make_server(app, ready.set)
    with listen("127.0.0.1", 0) as listener:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            ready.wait(20)
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(20)


def _measured(chromium: Any, page_address: str, code: str) -> Any:
    """Open a page in a browser that knows nothing yet, wait until it is loaded, and run its measurement."""
    context = chromium.new_context(viewport={"width": SIZE[0], "height": SIZE[1]})
    try:
        page = context.new_page()
        page.set_default_timeout(1000 * MOST_SECONDS)
        page.goto(page_address)
        page.wait_for_function("() => globalThis.ready")
        return page.evaluate(code)
    finally:
        context.close()


def _times(results: Results, chromium: Any, address: str, folder: Path) -> None:
    page = f"{address}/bench/viewer.html"
    waiting, free = (
        [_measured(chromium, page, f"measure('/streams/ring.uph', {SHARE}, {wait})") for _ in range(RUNS)]
        for wait in ("true", "false")
    )
    median = {
        name: statistics.median(one[name] for one in waiting) / 1000
        for name in ("first", "share", "complete")
    }
    kilobytes = (folder / "ring.uph").stat().st_size / 1000
    size = f"{SIZE[0]} × {SIZE[1]} pixels"
    shown = statistics.median(one["bytes"] for one in waiting)
    results.add(
        "web, 256 kbit/s: first textured frame",
        1000 * median["first"],
        "ms",
        aim="at most 500",
        remark=f"of {shown:.0f} bytes; viewer loaded before; {size}",
    )
    results.add("web, 256 kbit/s: 15 % of the coefficients", median["share"], "s")
    line = 8000 * kilobytes / RATE
    results.add(
        "web, 256 kbit/s: whole",
        median["complete"],
        "s",
        remark=f"{kilobytes:.0f} kB, {line:.2f} s on the line",
    )
    blocked = [max(one["tasks"], default=0) for one in free]
    count = statistics.median(len(one["tasks"]) for one in free)
    results.add(
        f"web: longest task of the page, worst of {RUNS} loads",
        max(blocked),
        "ms",
        aim="at most 50",
        remark=f"shorter than 50 ms count as 0; {count:.0f} longer ones in the median load",
    )
    write_html(folder / "ring.html", (folder / "ring.uph").read_bytes())
    beside = (folder / "ring.html").stat().st_size / 1000 - kilobytes
    results.add("web: ring.html beside its stream", beside, "kB", aim="at most 250")
    taken = _measured(chromium, f"{address}/bench/glb.html", "measure('/bench/ring.glb')") / 1000
    kilobytes = (folder / "ring.glb").stat().st_size / 1000
    results.add(
        "web, 256 kbit/s: the same as GLB with WebP", taken, "s", remark=f"{kilobytes:.0f} kB, one run"
    )
    results.add(
        "web: first textured frame sooner than GLB's", taken / median["first"], "times", aim="at least 20"
    )


def _frames(results: Results, chromium: Any, address: str, quads: int) -> None:
    code = f"turn('/bench/streams/large.uph', {quads}, {FRAMES})"
    found = _measured(chromium, f"{address}/bench/glb.html", code)
    median = statistics.median(found["times"])
    results.add(
        f"frames of {found['quads']:,} quads, {found['charts']} textures of 1024²",
        1000 / median,
        "per second",
        aim="at least 30 on a GPU",
        remark=f"{median:.0f} ms; by processor (SwiftShader), {SIZE[0]} × {SIZE[1]}, shadows; median of "
        f"{FRAMES}, each waited for by readPixels",
    )
