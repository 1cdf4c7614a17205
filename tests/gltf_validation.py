"""What Khronos' gltf-validator, which web/package.json names, says of files."""

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

_PACKAGE = Path(__file__).parents[1] / "web" / "node_modules" / "gltf-validator"
_SCRIPT = """
const validator = require(process.argv[1]), fs = require('fs');
const files = process.argv.slice(2);
Promise.all(files.map(file => validator.validateBytes(new Uint8Array(fs.readFileSync(file))))).then(
    reports => console.log(JSON.stringify(reports.map(report => report.issues))));
"""


def validated(files: Sequence[Path]) -> Any:
    """Return the issues of each file."""
    node = shutil.which("node")
    missing = "node is not installed" if node is None else None
    if missing is None and not _PACKAGE.is_dir():
        missing = "web/node_modules/gltf-validator is missing: run `npm ci` in web/"
    if missing is not None:
        if os.environ.get("CI"):
            pytest.fail(f"gltf-validator must run in CI: {missing}")
        pytest.skip(missing)
    command = [str(node), "-e", _SCRIPT, str(_PACKAGE), *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
