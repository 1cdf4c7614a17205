"""A person at the studio's page, for tests: drops files, presses buttons, waits for looks."""

import base64
import json
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import browser

from upholster.apps.studio.routes import Studio, make_studio

DROP = """(files) => {
  const transfer = new DataTransfer()
  for (const [name, text] of files) {
    transfer.items.add(new File([Uint8Array.from(atob(text), (one) => one.charCodeAt(0))], name))
  }
  const how = { dataTransfer: transfer, bubbles: true, cancelable: true }
  for (const type of ['dragenter', 'dragover', 'drop']) document.body.dispatchEvent(new DragEvent(type, how))
}"""


class Hand:
    """What a person does with the page."""

    def __init__(self, tab: Any, studio: Studio) -> None:
        self.tab, self.page, self.studio = tab, tab.page, studio

    def drop(self, *files: Path) -> None:
        """Drop files one after the other; each becomes a part of the state."""
        for file in files:
            self.drop_together((file.name, file.read_bytes()))
            self.page.wait_for_function(f"() => sessionStorage.history?.includes({json.dumps(file.name)})")

    def drop_together(self, *files: tuple[str, bytes]) -> None:
        """Drop names with contents, all at once."""
        self.page.evaluate(DROP, [[name, base64.b64encode(data).decode()] for name, data in files])

    def final(self) -> None:
        """Wait for the last look at what was set last."""
        self.page.wait_for_function("() => document.body.dataset.look === 'final'")
        self.page.evaluate("() => { delete document.body.dataset.look }")
        assert self.page.evaluate("() => document.querySelector('upholster-viewer').model.complete")

    def message(self, words: str) -> str:
        """Wait for a message with some words, and return it."""
        self.page.wait_for_function(
            "(words) => { const one = document.getElementById('message');"
            " return !one.hidden && one.textContent.includes(words) }",
            arg=words,
        )
        return str(self.page.locator("#message").inner_text())

    def refused(self) -> None:
        """The browser reports each answer that is an error; so far all of them were provoked."""
        assert all("422" in one or "413" in one for one in self.tab.problems), self.tab.problems
        self.tab.problems.clear()

    @property
    def states(self) -> Any:
        return self.page.evaluate("() => JSON.parse(sessionStorage.history).states")

    @property
    def state(self) -> Any:
        return self.page.evaluate(
            "() => { const { states, at } = JSON.parse(sessionStorage.history); return states[at] }"
        )

    def button(self, name: str) -> Any:
        return self.page.get_by_role("button", name=name, exact=True)


@contextmanager
def hand_at(tab: Any, *files: str) -> Iterator[Hand]:
    """A person at a new studio, which covers models with few texels."""
    with closing(Studio(files, None, 10**7)) as studio:
        app, entry = make_studio(studio)
        with browser.serving(app) as address:
            tab.open(f"{address}/#{entry.token}")
            tab.page.get_by_label("Detail").select_option("250000")
            yield Hand(tab, studio)
