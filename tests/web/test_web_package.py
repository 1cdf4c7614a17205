"""What `npm pack` makes is all that a page needs: built, typed and opened in a browser, or on a server."""

import json
import os
import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest
from starlette.applications import Starlette
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

pytestmark = pytest.mark.browser

WEB = browser.ROOT / "web"
EXAMPLES = WEB / "examples"


def _run(folder: Path, *command: Any) -> str:
    done = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="module")
def site(tmp_path_factory: Any) -> Any:
    """A folder with the examples, and the package installed as npm would, with what they need."""
    for what in ("node", "npm"):
        if shutil.which(what) is None or not (WEB / "node_modules" / "vite").is_dir():
            if os.environ.get("CI"):
                pytest.fail(f"{what} or web/node_modules/vite is missing, and CI is set")
            pytest.skip("npm is not installed, or web/node_modules is missing: run `npm ci` in web/")
    folder = tmp_path_factory.mktemp("site")
    _run(WEB, "npm", "pack", "--ignore-scripts", "--offline", "--pack-destination", folder)
    (packed,) = folder.glob("*.tgz")
    modules = folder / "node_modules"
    modules.mkdir()
    with tarfile.open(packed) as archive:
        if hasattr(tarfile, "data_filter"):  # from Python 3.11.4 on
            archive.extraction_filter = tarfile.data_filter
        archive.extractall(folder)
    (folder / "package").rename(modules / "upholster")
    for module in (WEB / "node_modules").iterdir():
        (modules / module.name).symlink_to(module.resolve())
    for example in EXAMPLES.iterdir():
        if example.is_dir():
            shutil.copytree(example, folder / example.name)
    return folder


@pytest.fixture(scope="module")
def address(site: Path) -> Any:
    """Where the site is."""
    app = Starlette(routes=[Mount("/", StaticFiles(directory=site, html=True, follow_symlink=True))])
    with browser.serving(app) as where:
        yield where


def test_the_package_holds_what_it_names_and_no_more(site: Path) -> None:
    names = {path.name for path in (site / "node_modules" / "upholster").iterdir()}
    assert {"package.json", "README.md", "LICENSE", "uph.js", "uph-three.d.ts", "uph-react.d.ts"} <= names
    assert not names & {"build.mjs", "examples", "node_modules", "index.html"}


def _vite(folder: Path, *options: str) -> None:
    (folder / "public").mkdir()
    (folder / "public" / "ring.uph").write_bytes(browser.material())
    program = WEB / "node_modules" / "vite" / "bin" / "vite.js"
    _run(folder, "node", program, "build", *options, "--logLevel", "error")


def test_a_page_without_a_build(tab: Any, site: Path, address: str) -> None:
    shutil.copytree(site / "three", site, dirs_exist_ok=True)
    (site / "ring.uph").write_bytes(browser.material())
    tab.page.goto(f"{address}/")
    tab.page.wait_for_function("() => document.body.dataset.complete === 'true'")


def test_a_page_built_by_vite(tab: Any, site: Path, address: str) -> None:
    _vite(site / "vite", "--minify", "false")
    tab.page.goto(f"{address}/vite/dist/")
    tab.page.wait_for_function("() => document.body.dataset.complete === 'true'")


def test_a_page_with_react(tab: Any, site: Path, address: str) -> None:
    _vite(site / "react", "--minify", "false")
    tab.open(f"{address}/react/dist/")
    total = len(browser.material())
    tab.page.get_by_text(f"complete, {total} bytes").wait_for()
    tab.page.get_by_role("button", name="From the front").click()
    assert tab.call("return viewer.view") == pytest.approx([30, 30], abs=1e-3)


PAGE = """
<!doctype html>
<meta charset="utf-8">
<link rel="icon" href="data:,">
<style>upholster-viewer { display: block; height: 300px }</style>
<upholster-viewer src="ring.uph" background="none"></upholster-viewer>
<script>document.querySelector('upholster-viewer').setAttribute('painting', location.hash.slice(1))</script>
<script type="module">import 'upholster/viewer'</script>
"""


def test_the_element_built_by_vite_whoever_paints(chromium: Any, site: Path, address: str) -> None:
    """With Vite's own settings. Chromium here has no graphics card, and so has to be told that it paints."""
    pictures = []
    folder = site / "painted"
    folder.mkdir()
    (folder / "index.html").write_text(PAGE)
    _vite(folder, "--base", "./")
    for painting in ("card", "worker"):
        with browser.tab(chromium) as tab:
            tab.open(f"{address}/painted/dist/#{painting}").complete().settle_shape()
            on_card = tab.call("return viewer.model.charts.map(({ textures }) => !textures.color.data)")
            assert set(on_card) == {painting == "card"}
            pictures.append(tab.picture())
    covered = pictures[0][:, :, 3] == 255
    assert covered.mean() > 0.1
    assert pictures[0][covered].std() > 10
    assert np.abs(pictures[0].astype(int) - pictures[1]).mean() < 0.5


USES = """
import 'upholster/react'
import { UphLoader } from 'upholster/three'
import type { UpholsterViewer, ViewerModel } from 'upholster/viewer'

export const element = (
  <upholster-viewer
    src="ring.uph"
    alt="A ring"
    exemplar="blue.png"
    environment="sky.jpg"
    painting="card"
    autorotate
    onerror={({ detail }) => console.error(detail.message)}
  />
)
// @ts-expect-error: an address is a text
export const wrong = <upholster-viewer src={3} />
export const loaded = (line: HTMLElement) =>
  new UphLoader().loadAsync('ring.uph', ({ received, total }) => (line.innerText = `${received} of ${total}`))
export function show(viewer: UpholsterViewer, file: File): ViewerModel | null {
  const bytes = new Uint8Array(9)
  const views = [bytes, new DataView(bytes.buffer)]
  for (const source of [file, new Blob(), bytes.buffer, ...views, 'ring.uph', null]) viewer.open(source)
  // @ts-expect-error: it is no stream
  viewer.open(3)
  return viewer.model
}
"""


def _tsc(folder: Path) -> None:
    _run(folder, "node", WEB / "node_modules" / "typescript" / "bin" / "tsc")


@pytest.mark.parametrize(("module", "resolution"), [("esnext", "bundler"), ("nodenext", "nodenext")])
def test_types_are_right_to_the_strictest_compiler(site: Path, module: str, resolution: str) -> None:
    """Every file of types, which a page's own compiler checks with its libraries unless it is told not to."""
    folder = site / f"strict_{resolution}"
    folder.mkdir()
    (folder / "uses.tsx").write_text(USES)
    types = sorted(path.as_posix() for path in (site / "node_modules" / "upholster").glob("*.d.ts"))
    assert len(types) > 5
    options = {"module": module, "moduleResolution": resolution, "target": "es2022", "jsx": "react-jsx"}
    options |= {"types": ["@webgpu/types"], "strict": True, "noEmit": True, "skipLibCheck": False}
    project = {"compilerOptions": options, "files": ["uses.tsx", *types]}
    (folder / "tsconfig.json").write_text(json.dumps(project))
    (folder / "package.json").write_text('{"type": "module"}')
    _tsc(folder)


def test_the_examples_types_are_right(site: Path) -> None:
    for example in ("vite", "react"):
        _tsc(site / example)


def test_a_server_imports_it_as_nothing(site: Path) -> None:
    """Pages are rendered ahead of time where there is no window: every entry can be imported there."""
    exports = json.loads((WEB / "package.json").read_text("utf-8"))["exports"]
    names = [f"upholster{entry[1:]}" for entry in exports]
    assert "upholster/viewer" in names
    (site / "server.mjs").write_text(
        "import { createElement } from 'react'\nimport { renderToString } from 'react-dom/server'\n"
        f"for (const name of {json.dumps(names)}) await import(name)\n"
        "console.log(renderToString(createElement('upholster-viewer', { src: 'ring.uph', alt: 'A ring' })))\n"
    )
    reported = _run(site, "node", "server.mjs")
    assert reported.strip() == '<upholster-viewer src="ring.uph" alt="A ring"></upholster-viewer>'
