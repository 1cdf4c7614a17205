"""Answers: pages; files, conditional, by range, in pieces from disk that wait for the client to take them."""

import gzip
from collections.abc import Mapping
from email.utils import formatdate
from http import HTTPStatus

import anyio
import anyio.to_thread
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from upholster.server.ranges import answer
from upholster.server.throttle import MAX_PIECE
from upholster.server.versions import Version

__all__ = [
    "accepts",
    "file_response",
    "packed_response",
    "page_response",
    "unchanged_response",
    "validators",
]

_STALLED_SECONDS = 120
_PACKED: dict[str, bytes] = {}
_CACHING = "no-cache, no-transform"  # always ask whether it is still the same; never compress on the way
_BRIEFLY = "max-age=10, no-transform"  # a page asks ahead for what its scripts ask for a moment later


def file_response(request: Request, version: Version, media_type: str, *, piece: int = MAX_PIECE) -> Response:
    """Return the answer to a request for a file; closes the file, at the latest when all is sent.

    Parameters
    ----------
    request
        GET or HEAD.
    version
        The file.
    media_type
        Its type.
    piece
        Bytes that are sent at a time, at most.
    """
    headers = validators(version.tag) | {
        "accept-ranges": "bytes",
        "last-modified": formatdate(version.modified, usegmt=True),
    }
    asked = _joined(request)
    what = answer(request.method, asked, tag=version.tag, modified=version.modified, size=version.size)
    if what.status in (HTTPStatus.OK, HTTPStatus.PARTIAL_CONTENT):
        headers |= {"content-type": media_type, "content-length": str(what.stop - what.start)}
        if what.status == HTTPStatus.PARTIAL_CONTENT:
            headers["content-range"] = f"bytes {what.start}-{what.stop - 1}/{version.size}"
        if request.method == "GET":
            return _FilePart(version, what.start, what.stop, what.status, headers, piece)
    version.file.close()
    if what.status == HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE:
        headers["content-range"] = f"bytes */{version.size}"
    if what.status >= HTTPStatus.BAD_REQUEST:
        return PlainTextResponse(what.status.phrase, what.status, headers)
    return _Bare(what.status, headers)


def accepts(request: Request, coding: str) -> bool:
    """Return whether a client takes answers in a coding, such as ``gzip``."""
    codings = request.headers.get("accept-encoding", "").split(",")
    return coding in {part.partition(";")[0].strip() for part in codings}


async def packed_response(request: Request, version: Version, media_type: str) -> Response:
    """Return a small file gzipped; closes the file."""
    with version.file:
        tag = f'{version.tag[:-1]}-gzip"'
        if (known := unchanged_response(request, tag)) is not None:
            return known
        packed = await anyio.to_thread.run_sync(_packed, version)
    if packed is None:
        return PlainTextResponse("This file is being written.", 503, {"retry-after": "1"})
    headers = validators(tag) | {
        "cache-control": _BRIEFLY,
        "content-type": media_type,
        "content-encoding": "gzip",
        "vary": "Accept-Encoding",
    }
    return Response(packed, headers=headers)


def _packed(version: Version) -> bytes | None:
    """Return a file packed, the same bytes whenever; None if it is written to meanwhile."""
    if version.tag not in _PACKED:
        data = version.read(0, version.size)
        if len(data) < version.size:
            return None
        _PACKED[version.tag] = gzip.compress(data, 9, mtime=0)
    return _PACKED[version.tag]


async def page_response(request: Request, page: str, status: int = 200) -> Response:
    """Return a page, packed where that is taken; it is asked for anew each time."""
    headers = {"cache-control": "no-cache", "vary": "Accept-Encoding"}
    body = page.encode()
    if accepts(request, "gzip"):
        body = await anyio.to_thread.run_sync(gzip.compress, body)  # a start page may be long
        headers["content-encoding"] = "gzip"
    return HTMLResponse(body, status, headers)


def unchanged_response(request: Request, tag: str) -> Response | None:
    """Return the answer 304 if the client has what this entity tag names, None if it has to be sent."""
    conditions = {name: value for name, value in _joined(request).items() if name == "if-none-match"}
    if answer("GET", conditions, tag=tag, modified=0, size=0).status == HTTPStatus.NOT_MODIFIED:
        return _Bare(HTTPStatus.NOT_MODIFIED, validators(tag))
    return None


def validators(tag: str) -> dict[str, str]:
    """Return the headers by which a client finds out later whether something is still the same."""
    return {"etag": tag, "cache-control": _CACHING}


def _joined(request: Request) -> dict[str, str]:
    """Return the request's headers; lines of the same name are one list."""
    return {name: ", ".join(request.headers.getlist(name)) for name in request.headers}


class _Bare(Response):
    """A head alone, with the headers that are given and no others."""

    def __init__(self, status: int, headers: Mapping[str, str]) -> None:
        super().__init__(status_code=status)
        self.raw_headers = [
            (name.encode("latin-1"), value.encode("latin-1")) for name, value in headers.items()
        ]


class _FilePart(_Bare):
    """Bytes of a file, sent piece by piece.

    The next piece is read when the client has taken the ones before it: there is never more than one in
    memory beside what the server's socket holds. If the client goes, stalls, or the file is written to
    meanwhile, sending ends before the announced length, which tells the client that something is missing:
    what it has is a prefix of one version.
    """

    def __init__(
        self,
        version: Version,
        start: int,
        stop: int,
        status: int,
        headers: Mapping[str, str],
        piece: int,
    ) -> None:
        super().__init__(status, headers)
        self._version = version
        self._start, self._stop, self._piece = start, stop, piece

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        with self._version.file:
            async with anyio.create_task_group() as group:
                group.start_soon(_until_gone, receive, group.cancel_scope)
                await self._send(send)
                group.cancel_scope.cancel()

    async def _send(self, send: Send) -> None:
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        place = self._start
        while place < self._stop:
            count = min(self._piece, self._stop - place)
            piece = await anyio.to_thread.run_sync(self._version.read, place, count)
            if not piece:
                return
            place += len(piece)
            with anyio.move_on_after(_STALLED_SECONDS) as limit:
                await send({"type": "http.response.body", "body": piece, "more_body": place < self._stop})
            if limit.cancelled_caught:
                return
        if self._start == self._stop:
            await send({"type": "http.response.body", "body": b""})


async def _until_gone(receive: Receive, scope: anyio.CancelScope) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
    scope.cancel()
