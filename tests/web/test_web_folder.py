"""`upholster web`: a folder that any static server can serve."""

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import browser
import pytest
from command_line import assert_one_line, run_cli
from decoders import run
from starlette.applications import Starlette
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

VECTORS = Path(__file__).parents[1] / "vectors"

DECODES = """
import { readFileSync } from 'node:fs'
const [folder, stream] = process.argv.slice(-2)
const { UphDecoder } = await import(`${folder}/uph.js`)
const { TriangleMesher } = await import(`${folder}/uph-mesh.js`)
const decoder = new UphDecoder()
decoder.feed(readFileSync(`${folder}/${stream}`))
const mesher = new TriangleMesher(decoder.surface, decoder.charts)
console.log(decoder.complete, decoder.rgba(0).length > 0, typeof mesher.bounds)
"""


class _Viewers(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[dict[str, str | None]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "upholster-viewer":
            self.found.append(dict(attrs))


def test_the_folder_has_all_that_its_files_name(tmp_path: Path) -> None:
    folder = tmp_path / "site"
    names = ["mesh.uph", "50% & <more>.uph"]
    for name in names:
        (tmp_path / name).write_bytes((VECTORS / "mesh.uph").read_bytes())
    done = run_cli("web", "site", *names, cwd=tmp_path)
    assert done.returncode == 0
    files = {path.name: path for path in folder.iterdir()}
    assert f"wrote {len(files)} files to site" in done.stdout
    assert {*names, "index.html", "upholster-viewer.js", "uph.js", "uph.d.ts", "LICENSES.txt"} <= set(files)
    for name, path in files.items():
        if name.endswith(".ts") or name.endswith(".js"):
            named = re.findall(r"""["'](\./[\w.-]+)["']""", path.read_text("utf-8"))
            assert {one.removeprefix("./") for one in named} <= set(files), name
    shown = _Viewers(files["index.html"].read_text("utf-8")).found
    assert [one["src"] for one in shown] == ["mesh.uph", "50%25%20%26%20%3Cmore%3E.uph"]
    assert [one["alt"] for one in shown] == ["mesh", "50% & <more>"]


def test_a_page_of_ones_own_stays_and_scripts_are_replaced(tmp_path: Path) -> None:
    assert run_cli("web", "site", cwd=tmp_path).returncode == 0
    page, script = tmp_path / "site" / "index.html", tmp_path / "site" / "uph.js"
    assert 'src="model.uph"' in page.read_text("utf-8")
    current = script.read_bytes()
    page.write_text("mine")
    script.write_text("old")
    (tmp_path / "site" / "mesh.uph").write_bytes((VECTORS / "mesh.uph").read_bytes())
    done = run_cli("web", "site", "site/mesh.uph", cwd=tmp_path)
    assert "index.html stays" in done.stdout
    assert page.read_text() == "mine"
    assert script.read_bytes() == current


def test_what_can_not_be_written_is_one_line_and_writes_nothing(tmp_path: Path) -> None:
    data = (VECTORS / "mesh.uph").read_bytes()
    for name, content in (
        ("mesh.uph", data),
        ("cut.uph", data[:-1]),
        ("bad.uph", data[:-9] + b"\0" + data[-8:]),
        ("words.uph", b"words"),
        ("uph.js", data),
    ):
        (tmp_path / name).write_bytes(content)
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "mesh.uph").write_bytes(data)
    for arguments, named in (
        (["site", "cut.uph"], "cut.uph: byte"),
        (["site", "bad.uph"], "bad.uph: byte"),
        (["site", "words.uph"], "words.uph: byte 0"),
        (["site", "none.uph"], "none.uph"),
        (["site", "mesh.uph", "copy/mesh.uph"], "has the name of another file"),
        (["site", "uph.js"], "has the name of another file"),
        (["mesh.uph"], "mesh.uph"),
        (["none/site"], "none/site"),
    ):
        assert_one_line(run_cli("web", *arguments, cwd=tmp_path), named)
        assert not (tmp_path / "site").exists()


def test_the_decoder_in_the_folder_runs_alone(tmp_path: Path) -> None:
    run_cli("web", "site", VECTORS / "mesh.uph", cwd=tmp_path)
    (tmp_path / "site" / "package.json").write_text('{"type": "module"}')  # for Node 18
    (tmp_path / "decodes.mjs").write_text(DECODES)
    assert run(tmp_path / "decodes.mjs", tmp_path / "site", "mesh.uph").split() == [
        "true",
        "true",
        "function",
    ]


@pytest.mark.browser
def test_its_page_shows_the_stream(tmp_path: Path, tab: Any) -> None:
    run_cli("web", "site", VECTORS / "mesh.uph", cwd=tmp_path)
    app = Starlette(routes=[Mount("/", StaticFiles(directory=tmp_path / "site", html=True))])
    with browser.serving(app) as address:
        tab.open(f"{address}/").complete().settle_shape()
        assert tab.call("return [viewer.model.first, viewer.clientHeight]") == [
            True,
            browser.VIEWPORT["height"],
        ]
