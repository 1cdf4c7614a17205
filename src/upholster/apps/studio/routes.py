"""The studio's application: its routes. The page's scripts (``page/api.js``) request them."""

import asyncio
import contextlib
import io
import json
import os
import shutil
import struct
import time
import zipfile
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from upholster._version import __version__
from upholster.apps.server.browser import open_in_browser
from upholster.apps.server.guard import AddedHeaders, Guard, failed
from upholster.apps.server.http_server import allowed_hosts, listen, run_until_stopped
from upholster.apps.studio.entry import SessionGate
from upholster.apps.studio.folder import Folder, file_kind
from upholster.apps.studio.worker import Worker
from upholster.base.errors import InputError, UpholsterError, check_whole
from upholster.base.examples import either_path
from upholster.base.files import outputs
from upholster.base.formats import offered_outputs, split_name
from upholster.base.json_text import read_json
from upholster.base.options.direction_words import DIRECTIONS
from upholster.geometry.built_in.catalog import SURFACES
from upholster.image.files.source import read_source, source_parts
from upholster.image.roles import role_of

__all__ = ["make_studio", "run_studio"]

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_WAIT = 20.0
"""Seconds that a request for a look may wait for one."""

_SILENT = 600.0
"""Seconds without a message after which a busy worker is ended."""

_MOST_JSON = 1 << 20

_MOST_NUMBER = 10**9
"""Of revisions and saves."""

_MEMORY = 4 * 2**30
"""Largest memory of the worker, in bytes."""

Handler = Callable[[Request], Awaitable[Response]]


class Studio:
    """One session: its folder, its worker, and the page's state.

    Parameters
    ----------
    files
        Photos, models or a project to start with.
    save_to
        A folder in which files may be saved; None for no folder.
    most_bytes
        Largest size of an uploaded file.
    """

    def __init__(self, files: Sequence[str], save_to: str | None, most_bytes: int) -> None:
        if save_to is not None and not os.path.isdir(save_to):
            raise InputError(f"save-to is {save_to!r}; allowed: a folder that exists")
        self.save_to = None if save_to is None else Path(save_to)
        self.folder = Folder(most_bytes)
        self.worker = Worker(os.fspath(self.folder.path), _MEMORY)
        self.state: dict[str, Any] | None = None
        self.project: str | None = None
        try:
            self._begin(files)
        except BaseException:
            self.close()
            raise

    def _begin(self, files: Sequence[str]) -> None:
        state: dict[str, Any] = {"upholster": 1}
        images: list[str] = []
        own: list[str] = []  # the same files, named as given
        for file in map(either_path, files):
            if os.path.isfile(file) or os.path.isdir(file):
                path = self.folder.add(file)
                kind = "material" if os.path.isdir(file) else file_kind(file)
                if kind == "project":
                    self.project = self._project(file)
                elif kind == "model":
                    state["model"] = path
                elif kind in ("image", "material"):
                    images.append(path)
                    own.append(file)
                else:
                    raise InputError(f"{file!r} is not an image, material, model or project")
            elif file.split(":")[0] in SURFACES:
                state["model"] = file
            else:
                raise InputError(f"{file!r} does not exist; allowed: photos, models, a project, surfaces")
        if images:
            source_parts(read_source(own[0] if len(own) == 1 else own))  # raises if it is not allowed
            state["sample"] = {"source": images[0] if len(images) == 1 else images}
        self.state = state if len(state) > 1 else None

    def _project(self, file: str) -> str:
        """Copy the user's own project, with all files that it needs, into the folder; return its path."""
        from upholster.apps.project.file import read_project, save_project

        number = self.folder.new_group()
        name = os.path.basename(file)
        save_project(read_project(file), self.folder.path / str(number) / name)
        return f"{number}/{name}"

    def close(self) -> None:
        """End the worker, and delete the folder."""
        self.worker.close()
        self.folder.close()

    # -------------------------------------------------------------- requests

    async def session(self, _request: Request) -> Response:
        """Return all data that a page needs at start."""
        if self.project is not None:
            self.state = (await self.worker.ask("source", self.project))["state"]
            self.project = None
        kinds = {"samples": "image", "models": "model"}
        return _Answer(
            {
                "state": self.state,
                "surfaces": [
                    {"name": kind.name, "description": kind.description} for kind in SURFACES.values()
                ],
                "directions": [[row.word, row.label] for row in DIRECTIONS],
                "outputs": offered_outputs(),
                **{name: [{"path": p} for p in self.folder.included(kind)] for name, kind in kinds.items()},
                "save_to": self.save_to is not None,
                "version": __version__,
            }
        )

    async def blobs(self, request: Request) -> Response:
        """Receive a file."""
        name = request.query_params.get("name", "")
        group = request.query_params.get("group")
        length = request.headers.get("content-length", "0")
        if length.isdigit():
            self.folder.check(name, int(length))
        number = _number(group, "group", 1, _MOST_NUMBER) if group is not None else None
        folder, is_made = request.query_params.get("folder", ""), "made" in request.query_params
        number, path = await self.folder.store(request.stream(), name, number, folder=folder, is_made=is_made)
        kind = file_kind(path)
        if kind == "material":
            project = await run_in_threadpool(self.folder.unpacked, path)
            path, kind = (path, kind) if project is None else (project, "project")
        return _Answer({"group": number, "path": path, "kind": kind})

    async def roles(self, request: Request) -> Response:
        """Return whether each of several file names gives the role of a map."""
        names = _entry(await _body(request), "names")
        if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
            raise InputError("names are not a list of texts")
        return _Answer([role_of(Path(name).stem) is not None for name in names])

    async def sources(self, request: Request) -> Response:
        """Return the kind and contents of a source."""
        path = str(_entry(await _body(request), "path"))
        self.folder.inside(path)
        return _Answer(await self.worker.ask("source", path))

    async def hints(self, request: Request) -> Response:
        """Return suggestions for preparing a photo."""
        path = str(_entry(await _body(request), "path"))
        self.folder.inside(path)
        return _Answer(await self.worker.ask("hints", path))

    async def picture(self, request: Request) -> Response:
        """Return a picture of a source, as read or as prepared."""
        path = request.path_params["path"]
        self.folder.inside(path)
        size = _number(request.query_params.get("size", "512"), "size", 16, 4096)
        if request.url.path.startswith("/prepared/"):
            options = read_json(request.query_params.get("options", "{}"))
            if not isinstance(options, dict):
                raise InputError("options are not an object")
            data, width, height, element = await self.worker.ask("prepared", path, options, size)
        else:
            role, element = request.query_params.get("role", "albedo"), []
            try:
                data, width, height = await self.worker.ask("picture", path, size, role)
            except InputError:
                if file_kind(path) != "model":
                    raise
                return Response(status_code=204)  # the preview of such a model says what is wrong
        headers = {"X-Width": f"{width}", "X-Height": f"{height}"}
        headers["X-Element"] = ",".join(f"{side:.2f}" for side in element)
        return Response(data, media_type="image/png", headers=headers)

    async def change(self, request: Request) -> Response:
        """Switch to another state."""
        state = _entry(await _body(request), "state")
        answer = await self.worker.change(state)
        self.state = state
        return _Answer(answer)

    async def looks(self, request: Request) -> Response:
        """Return the latest unseen look of a revision, or wait for one."""
        number = _revision(request)
        after = _number(request.query_params.get("after", "0"), "after", 0, 1000)
        until, seen = time.monotonic() + _WAIT, None
        while True:
            revision = self.worker.revisions.get(number)
            if revision is None or number < self.worker.revision:
                return Response(status_code=410)
            if len(revision.looks) > after:
                is_final, seconds, streams = revision.looks[-1]
                headers = {"X-Look": f"{len(revision.looks)}", "X-Final": f"{is_final:d}"}
                headers["X-Seconds"] = f"{seconds:.3f}"
                return Response(_packed(streams), media_type="application/octet-stream", headers=headers)
            if revision.error:
                return _error(422, revision.error)
            if revision.ended:
                return Response(status_code=410)
            if seen is not None and revision.stages > seen:
                stage, done, total = revision.stage
                return _Answer({"stage": stage, "done": done, "total": total}, 202)
            seen = revision.stages
            changed = self.worker.changed
            try:
                await asyncio.wait_for(changed.wait(), until - time.monotonic())
            except TimeoutError:
                self.worker.end_if_silent(_SILENT)
                return Response(status_code=204)

    async def facts(self, request: Request) -> Response:
        """Return facts about a revision's model and sample."""
        revision = self.worker.revisions.get(_revision(request))
        for _ in range(20):  # they arrive just after the first look
            if revision is None or revision.facts is not None:
                break
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self.worker.changed.wait(), 0.1)
        if revision is None or revision.facts is None:
            return Response(status_code=204)
        return _Answer(revision.facts)

    async def pick(self, request: Request) -> Response:
        """Return the part that a ray hits."""
        body = await _body(request)
        return _Answer(await self.worker.ask("pick", _entry(body, "origin"), _entry(body, "direction")))

    async def overlay(self, request: Request) -> Response:
        """Return line segments."""
        data = await self.worker.ask("overlay", request.query_params.get("kind", ""))
        return Response(data, media_type="application/octet-stream")

    async def save(self, request: Request) -> Response:
        """Write files of the model shown."""
        body = await _body(request)
        targets = _entry(body, "targets")
        if not (isinstance(targets, list) and targets and all(isinstance(one, str) for one in targets)):
            raise InputError("targets is empty; allowed: names of files")
        for target in targets:
            _check_target(target)
        depth = body.get("depth")
        if not (depth is None or isinstance(depth, str)):
            raise InputError("depth is not a text; allowed: a length, such as '0.6mm', or an empty text")
        revision = check_whole("revision", _entry(body, "revision"), 1)
        return _Answer(await self.worker.ask("save", revision, targets, depth))

    async def saved(self, request: Request) -> Response:
        """Return one saved file as a download, or all files of one save as a zip."""
        number = _number(request.path_params["number"], "number", 1, _MOST_NUMBER)
        name = request.path_params.get("name")
        folder = self.folder.inside(f"saved/{number}")
        if name is not None:
            place = self.folder.inside(f"saved/{number}/{name}")
            return FileResponse(place, filename=place.name)
        data = await run_in_threadpool(_zipped, folder)
        headers = {"content-disposition": f'attachment; filename="{number}.zip"'}
        return Response(data, media_type="application/zip", headers=headers)

    async def keep(self, request: Request) -> Response:
        """Copy saved files into the folder that was named at start."""
        if self.save_to is None:
            raise InputError("the studio writes no files by itself; allowed: upholster studio --save-to DIR")
        body = await _body(request)
        number = _number(str(_entry(body, "id")), "id", 1, _MOST_NUMBER)
        files = [one for one in self.folder.inside(f"saved/{number}").iterdir() if one.is_file()]
        there = [one.name for one in files if (self.save_to / one.name).exists()]
        if there and body.get("over") is not True:
            raise InputError(f"{there[0]} exists already; replace it?")
        await run_in_threadpool(self._keep, files)
        return _Answer({"files": [one.name for one in files]})

    def _keep(self, files: Sequence[Path]) -> None:
        assert self.save_to is not None
        targets = [self.save_to / one.name for one in files]
        with outputs(targets) as written:
            for source, target in zip(files, targets, strict=True):
                shutil.copyfile(source, written.path(target))


def make_studio(
    studio: Studio, *, hosts: Sequence[str] = ("127.0.0.1", "localhost")
) -> tuple[Guard, SessionGate]:
    """Return a session's ASGI application, and the middleware that guards its entry."""
    page = Path(__file__).parent / "page"

    async def start(_request: Request) -> Response:
        return FileResponse(page / "index.html")

    def post(path: str, handler: Handler) -> Route:
        return Route(path, handler, methods=["POST"])

    app = Starlette(
        routes=[
            Route("/", start),
            Mount("/assets", StaticFiles(directory=page, packages=[("upholster.output", "web")])),
            Route("/session", studio.session),
            post("/blobs", studio.blobs),
            post("/roles", studio.roles),
            post("/sources", studio.sources),
            post("/hints", studio.hints),
            Route("/pictures/{path:path}", studio.picture),
            Route("/prepared/{path:path}", studio.picture),
            post("/state", studio.change),
            Route("/looks/{revision}", studio.looks),
            Route("/facts/{revision}", studio.facts),
            Route("/overlays/{revision}", studio.overlay),
            post("/pick", studio.pick),
            post("/save", studio.save),
            Route("/saved/{number}.zip", studio.saved),
            Route("/saved/{number}/{name}", studio.saved),
            post("/keep", studio.keep),
        ],
        exception_handlers={UpholsterError: _refused, Exception: failed},
    )
    entry = SessionGate(AddedHeaders(app, {"cache-control": "no-store"}))
    return Guard(entry, policy=_POLICY, hosts=hosts), entry


def run_studio(
    files: Sequence[str],
    *,
    port: int = 0,
    browser: bool = True,
    save_to: str | None = None,
    most_bytes: int = 2**29,
    listening: Callable[[str, bool], None],
) -> None:
    """Run a session until Ctrl-C.

    Parameters
    ----------
    files, save_to, most_bytes
        See `Studio`.
    port
        0 chooses any free port.
    browser
        Whether to open the page.
    listening
        Called with the page's address, and whether a browser was asked to open it.
    """
    with listen("127.0.0.1", port) as listener, contextlib.closing(Studio(files, save_to, most_bytes)) as own:
        app, entry = make_studio(own, hosts=allowed_hosts("127.0.0.1", listener))

        def ready(address: str) -> None:
            page = f"{address}#{entry.token}"
            listening(page, browser and open_in_browser(page))

        run_until_stopped(app, listener, ready)


async def _body(request: Request) -> dict[str, Any]:
    """Return the JSON object in a request's body."""
    data = b""
    async for part in request.stream():
        data += part
        if len(data) > _MOST_JSON:
            raise InputError(f"the request is too large; allowed: {_MOST_JSON:,} bytes")
    found = read_json(data)
    if not isinstance(found, dict):
        raise InputError("the request is not an object")
    return found


def _entry(body: dict[str, Any], name: str) -> Any:
    if name not in body:
        raise InputError(f"the request lacks {name!r}")
    return body[name]


def _number(text: str, name: str, least: int, most: int) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 12 and least <= int(text) <= most):
        raise InputError(f"{name} is {text[:20]!r}; allowed: {least} to {most}")
    return int(text)


def _revision(request: Request) -> int:
    return _number(request.path_params["revision"], "revision", 0, _MOST_NUMBER)


def _check_target(target: str) -> None:
    _, name = split_name(target)
    if os.path.basename(name) != name or name.startswith(".") or "\\" in name or not name:
        raise InputError(f"target is {target!r}; allowed: a file's name without a folder")


def _packed(streams: Sequence[bytes]) -> bytes:
    """Return streams in one body: their number, then the length and bytes of each."""
    parts = [struct.pack("<I", len(streams))]
    for one in streams:
        parts += [struct.pack("<I", len(one)), one]
    return b"".join(parts)


def _zipped(folder: Path) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for one in sorted(folder.iterdir()):
            if one.is_file():
                file.write(one, one.name)
    return data.getvalue()


class _Answer(JSONResponse):
    """JSON in ASCII: names in models may have halves of characters, which UTF-8 can not store."""

    def render(self, content: Any) -> bytes:
        return json.dumps(content, allow_nan=False, separators=(",", ":")).encode()


def _error(status: int, words: str) -> Response:
    return _Answer({"error": words}, status)


async def _refused(_request: Request, error: Exception) -> Response:
    status = 413 if "too large" in str(error) or "too much" in str(error) else 422
    return _error(status, " ".join(str(error).split()))
