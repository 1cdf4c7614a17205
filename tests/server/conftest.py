"""What the server's tests serve."""

import pytest
from live_server import PATIENCE, VECTORS

from upholster.apps.server import connections, thumbnails


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """Limits of time that a busy machine could reach; tests of these limits set their own."""
    monkeypatch.setattr(thumbnails, "_MOST_SECONDS", PATIENCE)
    monkeypatch.setattr(connections, "HEAD_SECONDS", PATIENCE)
    monkeypatch.setattr(connections, "STALLED_SECONDS", 10 * PATIENCE)


@pytest.fixture
def folder(tmp_path):
    """Return a folder with two streams, beside a secret."""
    inside = tmp_path / "given"
    inside.mkdir()
    (tmp_path / "secret.uph").write_bytes(b"secret")
    for name in ("quilt", "smallest"):
        (inside / f"{name}.uph").write_bytes((VECTORS / f"{name}.uph").read_bytes())
    return inside
