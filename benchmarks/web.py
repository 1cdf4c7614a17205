"""The viewer over a slow line, and frame times: in Chromium, by its processor.

Everything is counted from the click on: one line of 256 kbit/s carries page, scripts and model. Needs
Chromium, the extra ``test`` (Playwright, Starlette, uvicorn) and ``npm ci`` in web/. Beside other viewers:
`benchmarks.web_peers`.
"""

import statistics
import tempfile
from pathlib import Path
from typing import Any

import upholster
from benchmarks.browser import SIZE, fresh_page, open_chromium, serve_files
from benchmarks.measure import EXEMPLAR, Results
from upholster.export import write_html
from upholster.stream import encode_stream
from upholster.textured import TexturedModel

__all__ = ["covered_ring", "frames", "web"]

RATE = 256_000
RUNS = 10
QUADS, FRAMES = (1_000, 5_000, 20_000, 50_000), 60
"""The paper's surfaces have 1,000 to 50,000 quadrilaterals (its section 4.5)."""


def web(results: Results) -> None:
    """Measure times from the click to the frame at 256 kbit/s, and how long the page is blocked."""
    with tempfile.TemporaryDirectory() as name, open_chromium("web") as chromium:
        if chromium is not None:
            folder = Path(name)
            (folder / "ring.uph").write_bytes(covered_ring().stream)
            with serve_files(folder, rate=RATE) as line:
                _stream_times(results, chromium, line.address, folder)


def frames(results: Results) -> None:
    """Measure frames per second of sixteen charts of 1024² in the viewer's light, by number of quads."""
    with tempfile.TemporaryDirectory() as name, open_chromium("frames") as chromium:
        if chromium is not None:
            _write_large(Path(name))
            with serve_files(Path(name)) as line:
                for quads in QUADS:
                    _frames(results, chromium, line.address, quads)


def covered_ring() -> TexturedModel:
    """Return the first picture's ring, four million texels, with all that its stream and its GLB need."""
    ring = upholster.ring_cyclide()
    exemplar = upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(
        exemplar, ring, texels=4_000_000, sample_size=5.0, direction="around:z", seed=3
    )
    return TexturedModel(ring, upholster.paint(quilt, exemplar), quilt=quilt, exemplar=exemplar)


def _write_large(folder: Path) -> None:
    """Make 16 charts of 1024 × 1024 texels as a stream."""
    ring = upholster.ring_cyclide()
    exemplar = upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(exemplar, ring, method="paper", chart=1024, seed=3)
    (folder / "large.uph").write_bytes(encode_stream(ring, quilt, exemplar))


def _stream_times(results: Results, chromium: Any, address: str, folder: Path) -> None:
    """Add the rows of the ring's stream."""
    runs = []
    for _ in range(RUNS):
        with fresh_page(chromium) as page:
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


def _frames(results: Results, chromium: Any, address: str, quads: int) -> None:
    code = f"turn('/bench/models/large.uph', {quads}, {FRAMES})"
    with fresh_page(chromium) as page:
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
