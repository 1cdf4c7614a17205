"""What is added to every answer: checks of host and origin, security headers, sharing with other origins."""

import ipaddress
from collections.abc import Collection
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from upholster.errors import InputError
from upholster.server.pages import EARLY_SCRIPT, script_digest

__all__ = ["CONTENT_SECURITY_POLICY", "Guard", "check_origin", "is_trusted_host"]

CONTENT_SECURITY_POLICY = (
    f"default-src 'none'; script-src 'self' {script_digest(EARLY_SCRIPT)}; worker-src 'self'; "
    "connect-src 'self'; img-src 'self' blob: data:; style-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors "
)
"""What the pages need and no more; behind it stand those who may show them in a frame."""

_NOTHING = "default-src 'none'; frame-ancestors "
_DATA = (
    "/streams/",
    "/thumbnails/",
    "/assets/page.css",
)  # neither pages nor scripts, whose workers obey theirs

_SHARED = ("/streams/", "/assets/")
_ASKED_HEADERS = "Range, If-Range, If-Match, If-None-Match, Cache-Control"
_TOLD_HEADERS = "Accept-Ranges, Content-Length, Content-Range, ETag"


class Guard:
    """ASGI middleware: refuses foreign host names, adds headers, answers CORS.

    Parameters
    ----------
    app
        What answers.
    origins
        Origins whose pages may read streams and scripts (not the start page, which names everything): as
        browsers write them, or "*" for any.
    frames
        Origins whose pages may show this server's pages in a frame, or "*" for any.
    local
        Whether the server listens on this machine alone. Then only addresses and ``localhost`` are answered
        to: a page anywhere can let its own host name point here, and would pass for this server's own page
        (DNS rebinding).
    """

    def __init__(
        self, app: ASGIApp, *, origins: Collection[str] = (), frames: Collection[str] = (), local: bool = True
    ) -> None:
        self._app = app
        self._frames = " ".join(frames) or "'none'"
        self._origins = frozenset(origins)
        self._local = local

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        shared = bool(self._origins) and scope["path"].startswith(_SHARED)
        allowed = self._allowed(headers.get("origin")) if shared else None
        policy = _NOTHING if scope["path"].startswith(_DATA) else CONTENT_SECURITY_POLICY

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                added = MutableHeaders(scope=message)
                added["Content-Security-Policy"] = policy + self._frames
                added["X-Content-Type-Options"] = "nosniff"
                if "content-length" in headers and "transfer-encoding" in headers:
                    # Others may see its end elsewhere: nothing is read behind it (RFC 9112, 6.3).
                    added["Connection"] = "close"
                added["Referrer-Policy"] = "no-referrer"
                added["Cross-Origin-Opener-Policy"] = "same-origin"
                added["Cross-Origin-Resource-Policy"] = "cross-origin" if shared else "same-origin"
                if shared and "*" not in self._origins:
                    added.add_vary_header("Origin")
                if allowed:
                    added["Access-Control-Allow-Origin"] = allowed
                    added["Access-Control-Expose-Headers"] = _TOLD_HEADERS
            await send(message)

        if self._local and not is_trusted_host(_host(headers.get("host", ""))):
            text = "This server answers only to its address and to localhost."
            await PlainTextResponse(text, 421)(scope, receive, guarded)
        elif allowed and scope["method"] == "OPTIONS" and "access-control-request-method" in headers:
            await Response(status_code=204, headers=_preflight(headers))(scope, receive, guarded)
        else:
            await self._app(scope, receive, guarded)

    def _allowed(self, origin: str | None) -> str | None:
        if "*" in self._origins:
            return "*"
        return origin if origin in self._origins else None


def check_origin(text: str, option: str = "cors") -> str:
    """Return an origin as browsers write it, or ``*``.

    Raises
    ------
    InputError
        If it is no origin: scheme, host and port, nothing behind.
    """
    if text == "*":
        return text
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    host = parts.hostname or ""
    host = f"[{host}]" if ":" in host else host
    usual = {"http": 80, "https": 443}.get(parts.scheme)
    plain = f"{parts.scheme}://{parts.netloc}".lower()
    if usual is None or not host or "@" in parts.netloc or plain != text.lower() or not text.isascii():
        raise InputError(f"{option} is {text!r}; allowed: an origin such as https://example.org, or *")
    return f"{parts.scheme}://{host}" + (f":{port}" if port not in (None, usual) else "")


def is_trusted_host(host: str) -> bool:
    """Whether a host is `localhost` or an address: not a name that anybody could let point here."""
    if host.lower().rstrip(".") == "localhost" or host.lower().endswith(".localhost"):
        return True
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _host(field: str) -> str:
    """Return the host of a Host header, without its port."""
    try:
        return urlsplit(f"//{field}").hostname or ""
    except ValueError:
        return ""


def _preflight(headers: Headers) -> dict[str, str]:
    answer = {
        "Access-Control-Allow-Methods": "GET, HEAD",
        "Access-Control-Allow-Headers": _ASKED_HEADERS,
        "Access-Control-Max-Age": "600",
    }
    # A page from the network asks for something on the user's own machine.
    if headers.get("access-control-request-private-network") == "true":
        answer["Access-Control-Allow-Private-Network"] = "true"
    return answer
