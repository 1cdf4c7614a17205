"""Running an application with uvicorn, until Ctrl-C or while a block runs."""

import errno
import os
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

import uvicorn
from starlette.types import ASGIApp

from upholster.apps.server.connections import Connection
from upholster.apps.server.guard import LOCAL_HOSTS
from upholster.base.errors import InputError

__all__ = ["allowed_hosts", "listen", "run_until_stopped", "serving"]

_MOST_CONNECTIONS = 1024
_BACKLOG = 512
_WINDING_UP_SECONDS = 1


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens; on the first address if the host's name has several.

    Raises
    ------
    InputError
        If the host is unknown or the port is not available.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; allowed: 1 to 65535, or 0 for any free one")
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError):
        raise InputError(f"host {host!r} is unknown; allowed: an address or a name of this machine") from None
    try:
        return socket.create_server(address[:2], family=family, backlog=_BACKLOG)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            why = "is in use; allowed: another --port, or 0 for any free one"
        else:
            why = f"cannot be listened on: {error.strerror or error}"
        raise InputError(f"port {port} of {host} {why}") from None


def allowed_hosts(host: str, listener: socket.socket) -> Sequence[str]:
    """Return the host names that a server accepts: any, unless it listens on this machine only."""
    bound = listener.getsockname()[0]
    return [*LOCAL_HOSTS, host, bound] if bound == "::1" or bound.startswith("127.") else ["*"]


def run_until_stopped(app: ASGIApp, listener: socket.socket, listening: Callable[[str], None]) -> None:
    """Run an application until Ctrl-C (or SIGTERM).

    The process is assumed to be the server's own: the processes it starts import nothing from the working
    directory.

    Parameters
    ----------
    app
        The application that answers.
    listener
        The socket, see `listen`.
    listening
        Called with the server's address. Requests sent at that time are answered a moment later.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    _allow_open_files(2 * _MOST_CONNECTIONS + _BACKLOG)  # a connection may have a file of its own
    with suppress(KeyboardInterrupt):
        listening(_address(listener))
        _server(app).run(sockets=[listener])


@contextmanager
def serving(app: ASGIApp) -> Iterator[str]:
    """Run an application on 127.0.0.1 from a thread of its own, while a block runs; yields its address."""
    server = _server(app)
    with listen("127.0.0.1", 0) as listener:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            yield _address(listener)
        finally:
            server.should_exit = True
            thread.join()


def _server(app: ASGIApp) -> uvicorn.Server:
    """Return uvicorn's server for an application, without log."""
    config = uvicorn.Config(
        app,
        http=Connection,
        ws="none",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        log_level="critical",
        access_log=False,
        proxy_headers=False,
        server_header=False,
        limit_concurrency=_MOST_CONNECTIONS,
        backlog=_BACKLOG,
        timeout_graceful_shutdown=_WINDING_UP_SECONDS,
    )
    return uvicorn.Server(config)


def _allow_open_files(count: int) -> None:
    """Raise the process's limit of open files to `count`, as far as the system allows."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        some, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = count if most == resource.RLIM_INFINITY else min(count, most)
        if some != resource.RLIM_INFINITY and some < wanted:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, most))


def _address(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # all addresses: this one is among them
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"
