"""What the server's tests serve."""

import pytest
from live_server import VECTORS


@pytest.fixture
def folder(tmp_path):
    """Return a folder with two streams, beside a secret."""
    inside = tmp_path / "given"
    inside.mkdir()
    (tmp_path / "secret.uph").write_bytes(b"secret")
    for name in ("quilt", "smallest"):
        (inside / f"{name}.uph").write_bytes((VECTORS / f"{name}.uph").read_bytes())
    return inside
