"""Middleware for an application on the user's machine: a check of the Host header, and security headers."""

import re
import sys
from collections.abc import Mapping, Sequence

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from upholster.base.errors import InputError, printable

__all__ = ["LOCAL_HOSTS", "AddedHeaders", "Guard", "check_origin", "failed", "report"]

LOCAL_HOSTS = ("localhost", "*.localhost", "127.0.0.1", "[::1]")
"""Names of this machine that no other site can have."""

_ORIGIN = re.compile(r"(https?)://([a-z0-9.-]+|\[[0-9a-f:.]+\])(?::([0-9]{1,5}))?")
_USUAL_PORTS = {"http": "80", "https": "443"}


class AddedHeaders:
    """ASGI middleware: adds headers to every answer that does not have them.

    Parameters
    ----------
    app
        The application that answers.
    headers
        The headers to add, by name.
    """

    def __init__(self, app: ASGIApp, headers: Mapping[str, str]) -> None:
        self._app = app
        self._headers = headers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def adding(message: Message) -> None:
            if message["type"] == "http.response.start":
                added = MutableHeaders(scope=message)
                for name, text in self._headers.items():
                    added.setdefault(name, text)
            await send(message)

        await self._app(scope, receive, adding)


class Guard:
    """ASGI middleware: refuses foreign host names, and adds security headers.

    Parameters
    ----------
    app
        The application that answers.
    policy
        Content security policy of all answers.
    hosts
        Host names that are accepted, or "*" for any. Any page can let its own host name point to this
        machine, and would then pass for this server's own page (DNS rebinding): a server that listens on this
        machine only accepts `LOCAL_HOSTS`.
    """

    def __init__(self, app: ASGIApp, *, policy: str, hosts: Sequence[str] = LOCAL_HOSTS) -> None:
        headers = {
            "content-security-policy": policy,
            "x-content-type-options": "nosniff",
            "referrer-policy": "no-referrer",
            "cross-origin-opener-policy": "same-origin",
            "cross-origin-resource-policy": "same-origin",
        }
        self._app = AddedHeaders(TrustedHostMiddleware(app, hosts, www_redirect=False), headers)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        asked = Headers(scope=scope) if scope["type"] == "http" else {}
        app: ASGIApp = self._app
        if "content-length" in asked and "transfer-encoding" in asked:
            # Other software may see its end elsewhere: nothing is read after it (RFC 9112, 6.3).
            app = AddedHeaders(app, {"connection": "close"})
        await app(scope, receive, send)


def check_origin(text: str, option: str = "cors") -> str:
    """Return an origin as browsers write it, or ``*``.

    Raises
    ------
    InputError
        If it is not an origin: scheme, host and port, and nothing after them.
    """
    if text == "*":
        return text
    found = _ORIGIN.fullmatch(text.lower())
    if found is None or int(found[3] or 0) > 65535:
        raise InputError(f"{option} is {text!r}; allowed: an origin such as https://example.org, or *")
    scheme, host, port = found.groups()
    return f"{scheme}://{host}" + (f":{port}" if port not in (None, _USUAL_PORTS[scheme]) else "")


async def failed(request: Request, error: Exception) -> Response:
    """Report the error to the operator, and to the client only that there was one."""
    report(f"{request.method} {request.url.path!r}", error)
    return PlainTextResponse("Internal Server Error", 500)


def report(what: str, error: Exception) -> None:
    """Print the reason of a failure on one line."""
    words = " ".join(f"{type(error).__name__}: {error}".split())
    print(printable(f"upholster: {what} failed: {words}"), file=sys.stderr)
