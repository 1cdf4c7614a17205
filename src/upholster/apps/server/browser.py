"""Opening an address in the user's browser, if there is one with a window."""

import os
import sys
import threading
import webbrowser
from pathlib import PurePath

__all__ = ["open_in_browser"]

_IN_TERMINAL = {"browsh", "carbonyl", "elinks", "links", "links2", "lynx", "w3m", "www-browser"}


def open_in_browser(url: str) -> bool:
    """Open an address; return whether there is a browser to ask.

    Never waits for the browser, and never uses one that runs in the terminal. The user's ``$BROWSER`` has
    priority; otherwise, on systems where windows need a display, there must be one.
    """
    desktop = sys.platform in ("darwin", "win32") or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("BROWSER")
    )
    if not desktop:
        return False
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return False
    name = getattr(browser, "name", "")
    command = PurePath(name if isinstance(name, str) else "").stem.lower()
    if command in _IN_TERMINAL:
        return False
    if type(browser) is webbrowser.GenericBrowser:  # run as a separate process, which Ctrl-C does not reach
        browser = webbrowser.BackgroundBrowser([browser.name, *browser.args])
    threading.Thread(target=browser.open, args=(url,), daemon=True).start()
    return True
