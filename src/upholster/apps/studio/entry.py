"""Checks in front of the studio's routes: the cookie, requests from our own pages only, one tab at a time.

A page of another origin can send requests here, too. But it can not send our header, have our cookie
sent along (SameSite), or claim to come from here (Origin).
"""

import hmac
import secrets

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from upholster.base.errors import FormatError
from upholster.base.json_text import read_json

__all__ = ["SessionGate"]

_OPEN = ("/", "/enter")


class SessionGate:
    """ASGI middleware of one session.

    Parameters
    ----------
    app
        The application that answers.

    Attributes
    ----------
    token
        Exchanged for the cookie once; then it changes.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._secret = secrets.token_urlsafe(32)
        self.token = secrets.token_urlsafe(32)
        self._tab = ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] != "http":
            return
        request = Request(scope, receive)
        path = request.url.path
        response = self._refused(request, path)
        if response is None and path == "/enter" and request.method == "POST":
            response = await self._enter(request)
        if response is None and path == "/take" and request.method == "POST":
            self._tab = request.headers.get("x-tab", "")
            response = JSONResponse({})
        await (response or self._app)(scope, receive, send)

    def _refused(self, request: Request, path: str) -> Response | None:
        if request.method == "POST":
            own = f"{request.url.scheme}://{request.headers.get('host', '')}"
            if request.headers.get("origin") != own or request.headers.get("x-upholster") != "studio":
                return _error(403, "the request does not come from the studio's own page")
        elif request.method not in ("GET", "HEAD"):
            return _error(405, "allowed: GET and POST")
        if path in _OPEN or path.startswith("/assets/"):
            return None
        if not hmac.compare_digest(request.cookies.get(_cookie(request), "").encode(), self._secret.encode()):
            return _error(401, "this page is not signed in; open the address that `upholster studio` printed")
        tab = request.headers.get("x-tab", "")
        if tab and path == "/session":
            self._tab = self._tab or tab
        # The browser itself requests pictures and downloads, without the tab's header.
        if tab and tab != self._tab and path != "/take":
            return _error(409, "another tab has this session; work here instead?")
        return None

    async def _enter(self, request: Request) -> Response:
        body = await _small_body(request)
        try:
            token = str(read_json(body)["token"])
        except (FormatError, KeyError, TypeError):
            return _error(422, "allowed: {token}")
        if not hmac.compare_digest(token.encode(errors="replace"), self.token.encode()):
            return _error(403, "this address was used already; run `upholster studio` again for a new one")
        self.token = secrets.token_urlsafe(32)
        answer = Response(status_code=204)
        answer.set_cookie(_cookie(request), self._secret, httponly=True, samesite="strict", path="/")
        return answer


def _cookie(request: Request) -> str:
    """Return the cookie's name: browsers send a host's cookies to all its ports, and each may be a studio."""
    return f"upholster-studio-{request.headers.get('host', '').rpartition(':')[2]}"


async def _small_body(request: Request) -> bytes:
    found = b""
    async for part in request.stream():
        found += part
        if len(found) > 1000:
            return b""
    return found


def _error(status: int, words: str) -> Response:
    return JSONResponse({"error": words}, status)
