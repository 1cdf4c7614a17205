"""A session in the studio, as a strip: an armchair for a shop."""

import io
from contextlib import closing
from typing import Any

from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars
from gallery_tools.viewers import browser_page

__all__ = ["strip"]

_SIZE = (1180, 760)
_SHOWN = (760, 490)


def strip(_exemplars: Exemplars) -> Any:
    """Show four moments of a session."""
    from upholster.apps.server import serving
    from upholster.apps.studio.routes import Studio, make_studio

    panels: list[Panel] = []
    with closing(Studio([str(OWN / "weave.png"), str(OWN / "chair.glb")], None, 10**8)) as session:
        app, entry = make_studio(session)
        with serving(app) as address, browser_page(_SIZE) as page:

            def final() -> None:
                page.wait_for_timeout(500)  # until the change is told
                page.wait_for_function(
                    "() => document.body.dataset.look === 'final'"
                    " && !document.getElementById('light').textContent"
                )
                page.wait_for_timeout(500)

            def shot(title: str) -> None:
                image = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
                panels.append(Panel(image.resize(_SHOWN, Image.Resampling.LANCZOS), title))

            page.goto(f"{address}#{entry.token}")
            final()
            page.get_by_title("bricks").click()
            page.get_by_role("button", name="Prepare the sample …").click()
            page.get_by_label("A part").check()
            page.get_by_label("Length of what the line crosses").fill("40cm")
            page.wait_for_timeout(1500)
            shot("(a) how large is a brick? A line says it")
            page.get_by_role("button", name="Cancel").click()
            page.get_by_title("weave").last.click()
            page.get_by_label("Width of the sample").last.fill("22cm")
            page.keyboard.press("Enter")
            final()
            page.locator("#panel").evaluate("(one) => one.scrollTo(0, 0)")
            shot("(b) a weave of 22 cm, while one looks")
            for leg in range(1, 5):
                page.get_by_label(f"Sample of Leg {leg}").select_option(label="granite.png")
            page.get_by_label("Directions").check()
            final()
            page.wait_for_timeout(1500)
            page.locator(".parts").scroll_into_view_if_needed()
            shot("(c) legs of granite; lines show which way rows run")
            page.get_by_label("Directions").uncheck()
            page.get_by_role("button", name="Save", exact=True).click()
            sizes = "[...document.querySelectorAll('#dialog td.number')]"
            page.wait_for_function(f"() => {sizes}.every((one) => one.textContent !== '…')")
            shot("(d) every kind of file, with its size")
    return compose([panels[:2], panels[2:]])
