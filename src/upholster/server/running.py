"""Running the application with uvicorn until Ctrl-C."""

import errno
import socket
from collections.abc import Callable, Collection
from contextlib import suppress

import uvicorn
from starlette.types import ASGIApp

from upholster.errors import InputError
from upholster.server.app import make_app
from upholster.server.catalogue import Catalogue
from upholster.server.connections import Connection
from upholster.server.guard import is_trusted_host

__all__ = ["listen", "make_server", "serve"]

_MOST_CONNECTIONS = 1024
_BACKLOG = 512
_WINDING_UP_SECONDS = 1


def serve(
    catalogue: Catalogue,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    rate: int | None = None,
    origins: Collection[str] = (),
    frames: Collection[str] = (),
    listening: Callable[[str], None] = print,
) -> None:
    """Serve a catalogue until Ctrl-C (or SIGTERM).

    Parameters
    ----------
    catalogue
        The streams.
    host, port
        Where to listen; port 0: any that is free.
    rate, origins, frames
        See `upholster.server.make_app`.
    listening
        Is called once requests are answered, with the start page's address.

    Raises
    ------
    InputError
        If the host is unknown or the port cannot be had.
    """
    listener = listen(host, port)
    _allow_open_files(2 * _MOST_CONNECTIONS + _BACKLOG)  # a connection may have a file of its own
    with listener:
        bound = listener.getsockname()
        # Who listens under another name, which means this machine too, wants to be called by it.
        local = (bound[0] == "::1" or bound[0].startswith("127.")) and is_trusted_host(host)
        app = make_app(catalogue, rate=rate, origins=origins, frames=frames, local=local)
        server = make_server(app, lambda: listening(_address(bound)))
        with suppress(KeyboardInterrupt):
            server.run(sockets=[listener])


def _allow_open_files(count: int) -> None:
    """Let the process have so many files open, as far as the system allows it."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        some, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = count if most == resource.RLIM_INFINITY else min(count, most)
        if some != resource.RLIM_INFINITY and some < wanted:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, most))


def make_server(app: ASGIApp, listening: Callable[[], None]) -> uvicorn.Server:
    """Return uvicorn's server for an application, without log; it calls `listening` once it answers."""
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
    return _Server(config, listening)


class _Server(uvicorn.Server):
    """Uvicorn's server, which tells when it listens."""

    def __init__(self, config: uvicorn.Config, listening: Callable[[], None]) -> None:
        super().__init__(config)
        self._listening = listening

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        self._listening()


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens; on the first address if the host's name has several.

    Raises
    ------
    InputError
        If the host is unknown or the port cannot be had.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; allowed: 1 to 65535, or 0 for any that is free")
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
            why = "is taken; allowed: another --port, or 0 for any that is free"
        else:
            why = f"cannot be listened on: {error.strerror or error}"
        raise InputError(f"port {port} of {host} {why}") from None


def _address(bound: tuple[str, int]) -> str:
    host, port = bound[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # all addresses: this one is among them
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"
