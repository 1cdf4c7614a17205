"""How soon a change is seen in the studio, in Chromium.

``python -m benchmarks studio``: opens the page with the chair and a weave, and changes seed, direction and
size in turn, each when all is there. From the event until the first look, and until the last, is on screen.
Where there is no graphics card Chromium draws with the processor, which takes part in the work.
"""

import statistics
import time
from contextlib import closing
from pathlib import Path
from typing import Any

from benchmarks.browser import ARGUMENTS, find_chromium
from benchmarks.measure import Results

__all__ = ["studio"]

EXAMPLES = Path(__file__).parent.parent / "examples"
ROUNDS = 7


def studio(results: Results) -> None:
    """Measure."""
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        print("studio: Playwright is not installed")
        return
    from upholster.server import serving
    from upholster.studio.routes import Studio, make_studio

    path = find_chromium()
    if path is None:
        print("studio: Chromium is not installed")
        return
    files = [str(EXAMPLES / "weave.png"), str(EXAMPLES / "chair.glb")]
    with closing(Studio(files, None, 10**8)) as session:
        app, entry = make_studio(session)
        with serving(app) as address, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(f"{address}#{entry.token}")
            page.get_by_label("Detail").select_option("1000000")
            _wait(page, "final")
            for name in ("seed", "direction", "size"):
                times = []
                for n in range(ROUNDS):
                    page.evaluate("() => { delete document.body.dataset.look }")
                    begun = time.perf_counter()
                    _change(page, name, n)
                    times.append([_wait(page, look) - begun for look in ("", "final")])
                for look, taken in zip(("first look", "last look"), zip(*times, strict=True), strict=True):
                    ordered = sorted(taken)
                    results.add(f"{name}: {look}, median", statistics.median(ordered), "s")
                    results.add(f"{name}: {look}, slowest of {ROUNDS}", ordered[-1], "s")
            browser.close()


def _change(page: Any, name: str, n: int) -> None:
    if name == "seed":
        page.get_by_role("button", name="Again").click()
        return
    # Not what is there already: nothing would change then.
    texts = {"direction": ("Angle", f"{10 * n + 10}"), "size": ("Width of the sample", f"{40 + n}cm")}
    label, text = texts[name]
    page.get_by_label(label).last.fill(text)
    page.keyboard.press("Enter")


def _wait(page: Any, look: str) -> float:
    page.wait_for_function(
        "(look) => look ? document.body.dataset.look === look : Boolean(document.body.dataset.look)",
        arg=look,
        timeout=120_000,
    )
    return time.perf_counter()
