"""A browser, and streams on a server, for each module of tests."""

from typing import Any

import browser
import pytest

from upholster.apps.server import Catalogue, make_app


@pytest.fixture(scope="module")
def chromium() -> Any:
    """One browser for a module's tests: while it runs, this thread can have no event loop of its own."""
    with browser.chromium() as running:
        yield running


@pytest.fixture(scope="session")
def streams(tmp_path_factory: Any) -> Any:
    """A folder with streams: whole, cut, damaged, and none."""
    folder = tmp_path_factory.mktemp("streams")
    ring = browser.ring()
    middle = 2 * len(ring) // 3
    files = {
        "ring.uph": ring,
        "ball.uph": browser.ball(),
        "material.uph": browser.material(),
        "cut.uph": ring[:middle],
        "damaged.uph": ring[:middle] + bytes([ring[middle] ^ 255]) + ring[middle + 1 :],
        "words.uph": b"Once upon a time there was a file of another kind. " * 9,
        "short.uph": ring[:100],
    }
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder


@pytest.fixture(scope="module")
def site(streams: Any) -> Any:
    """Address of `upholster serve` with these streams."""
    with browser.serving(make_app(Catalogue([str(streams)]))) as address:
        yield address


@pytest.fixture
def tab(chromium: Any) -> Any:
    """A new page, about which the browser must have nothing to say."""
    with browser.tab(chromium) as new:
        yield new
