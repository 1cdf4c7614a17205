"""The viewer in a notebook's output, in Chromium: as JupyterLab puts it there, and under VS Code's policy."""

import base64
from typing import Any

import browser
import pytest
from browser import PATIENCE, likeness, pixels, rendered

import upholster

pytestmark = pytest.mark.browser

JUPYTERLAB = """<!doctype html><html><body><div class="jp-OutputArea">
<div class="jp-RenderedHTMLCommon jp-RenderedHTML">{output}</div></div></body></html>"""

# What VS Code's notebooks allow where their policy is on (its setting notebook.experimental.enableCsp).
# A frame inherits it.
VS_CODE = """<!doctype html><html><head>
<meta http-equiv="Content-Security-Policy" content="default-src 'none';
script-src https: 'unsafe-inline' 'unsafe-eval'; style-src https: 'unsafe-inline';
img-src https: http: data:; font-src https: data:; connect-src https:; child-src https: data:;">
</head><body>{output}</body></html>"""

PICTURE = """async () => {
  const viewer = document.querySelector('upholster-viewer')
  viewer.setAttribute('background', 'none')
  await viewer.model.settled()
  await viewer.settled()
  const bytes = new Uint8Array(await (await viewer.picture()).arrayBuffer())
  let text = ''
  for (const byte of bytes) text += String.fromCharCode(byte)
  return btoa(text)
}"""


def opened(tab: Any, page: str) -> Any:
    """Open a notebook's page, from which nothing else can be reached; return the frame in it."""

    def answer(route: Any) -> None:
        if route.request.url == "http://notebook.test/":
            route.fulfill(body=page, content_type="text/html; charset=utf-8")
        else:
            tab.problems.append(f"asks for {route.request.url[:99]}")
            route.abort()

    tab.page.route("**/*", answer)
    tab.page.goto("http://notebook.test/")
    return tab.page.frames[1]


@pytest.mark.parametrize("notebook", [JUPYTERLAB, VS_CODE], ids=["JupyterLab", "VS Code"])
def test_a_notebooks_viewer_draws_the_model(tab: Any, notebook: str) -> None:
    stream = browser.ring()
    frame = opened(tab, notebook.format(output=upholster.view(stream, height=400)._repr_html_()))
    frame.wait_for_function(
        "() => document.querySelector('upholster-viewer')?.model?.complete", timeout=PATIENCE
    )
    shown = pixels(base64.b64decode(frame.evaluate(PICTURE)))
    assert frame.evaluate("innerHeight") == 400
    overlap, difference, alike = likeness(shown, rendered(stream, (shown.shape[1], shown.shape[0])))
    assert overlap > 0.97
    assert difference < 0.08  # the light differs
    assert alike > 0.9


def test_a_part_of_a_stream_is_a_coarser_model(tab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("upholster.apps.notebook.MOST_BYTES", 9000)
    frame = opened(tab, JUPYTERLAB.format(output=upholster.view(browser.ring())._repr_html_()))
    frame.wait_for_function(
        "() => document.querySelector('upholster-viewer')?.model?.first", timeout=PATIENCE
    )
    assert len(set(map(tuple, pixels(base64.b64decode(frame.evaluate(PICTURE))).reshape(-1, 4)[::7]))) > 500
