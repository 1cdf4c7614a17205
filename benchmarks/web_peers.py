"""The ring's stream in our viewer beside the same ring as a small GLB in <model-viewer> and in three.js.

The GLB has as many texels, and a mesh as fine as what the viewer shows; gltf-transform makes it small, by
Draco and WebP of quality 50. Each is opened in a browser that knows nothing yet, in turn, over a line that
carries page, scripts and model, at 256 kbit/s and 2 Mbit/s. Peers' scripts are sent as Brotli too, and all
that they need is asked for at once. Chromium draws by the processor; times are of what it then has on the
screen. With ``-o`` there are pictures of all players, web_beside.jpg. Needs Chromium, the extras ``test`` and
``bench``, and ``npm ci --ignore-scripts`` in web/ and in benchmarks/peers/.
"""

import base64
import io
import json
import statistics
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import upholster
from benchmarks.browser import SIZE, fresh_page, open_chromium, serve_files
from benchmarks.measure import EXEMPLAR, Request, psnr
from benchmarks.tables import Table
from upholster.base.options.write_options import WriteOptions
from upholster.codec.stream.reader import StreamDecoder
from upholster.model.textured_model import TexturedModel
from upholster.output.export.glb import write_glb
from upholster.output.export.pages import PagedMesh

__all__ = ["PLAYERS", "RATES", "measured"]

ROOT = Path(__file__).parent.parent
PEERS = Path(__file__).parent / "peers"
TOOLS = PEERS / "node_modules" / ".bin"
RATES = {"256 kbit/s": 256_000, "2 Mbit/s": 2_000_000}
PLAYERS = {
    "`<upholster-viewer>`": "/view/{name}.uph",
    "`<model-viewer>`": "/bench/model-viewer.html?{name}.glb",
    "three.js": "/bench/three.html?{name}.glb",
}
QUALITY = 50
ALIKE = 2.0
"""Pictures are alike if they differ by as much, of 255, in the mean."""
QUIET_MS = 2000
GAP = 8


@dataclass
class _Times:
    """Seconds of one player on one line, run by run, and the bytes of the last."""

    runs: list[tuple[float, ...]] = field(default_factory=list)
    sent: int = 0

    def medians(self) -> list[float]:
        """Return those of `_open`."""
        return [statistics.median(times) for times in zip(*self.runs, strict=True)]


def measured(request: Request) -> Table:
    """Return medians; the least of each line's times are bold."""
    if not TOOLS.is_dir():
        raise SystemExit(f"web_peers: needs `npm ci --ignore-scripts` in {PEERS.relative_to(ROOT)}/")
    with tempfile.TemporaryDirectory() as name, open_chromium("web_peers") as chromium:
        if chromium is None:
            raise SystemExit(2)
        models, pages = Path(name, "models"), Path(name, "pages")
        models.mkdir()
        pages.mkdir()
        subprocess.run(["node", str(PEERS / "build.mjs"), str(pages)], check=True)
        about = _write_ring(chromium, models)
        rows = _rows(_measure(chromium, models, pages, request.runs))
        if request.out is not None:
            _write_torus(models)
            with serve_files(models, pages) as line:
                _beside(chromium, line.address).save(request.out / "web_beside.jpg", quality=88)
    times = ("first picture with texture", "its event", "all of it", "longest task of the page")
    columns = ("line", "player", *times, "bytes on the line")
    note = f"{about} Medians of {request.runs}. Chromium draws without a graphics card."
    return Table(columns, rows, {"peers": _versions(), "note": note})


def _write_ring(chromium: Any, folder: Path) -> str:
    """Make the ring as stream and as GLB; returns what they hold, in words."""
    ring, exemplar = upholster.ring_cyclide(), upholster.read_exemplar(EXEMPLAR)
    quilt = upholster.synthesize(
        exemplar, ring, texels=4_000_000, sample_size=5.0, direction="around:z", seed=3
    )
    model = TexturedModel(ring, upholster.paint(quilt, exemplar), quilt=quilt, exemplar=exemplar)
    (folder / "ring.uph").write_bytes(model.stream)
    with serve_files(folder) as line:
        quads = _quads_shown(chromium, line.address)
    model = replace(model, options=WriteOptions(quads=quads, padding=2))
    write_glb(folder / "large.glb", PagedMesh(model.mesh, model.uv, model.atlas.pixels), texture="png")
    _make_small(folder / "large.glb", folder / "ring.glb")

    decoder = StreamDecoder()
    decoder.feed(model.stream)
    shown = replace(model, texels=decoder.texels())
    texture = _texture(folder / "ring.glb")
    best = np.asarray(model.atlas.pixels)
    ours, theirs = psnr(best, np.asarray(shown.atlas.pixels)), psnr(best, _pixels(texture))
    size = (folder / "ring.glb").stat().st_size
    height, width = best.shape[:2]
    return (
        f"The stream has {len(model.stream) / 1000:.0f} kB, {model.texels.count / 1e6:.1f} million texels, "
        f"{ours:.1f} dB compared with the painted texels. The GLB has {size / 1000:.0f} kB: a texture of "
        f"{width} × {height}, {len(texture) / 1000:.0f} kB of WebP, {theirs:.1f} dB; and "
        f"{len(model.mesh.quads):,} quadrilaterals, as many as the viewer shows, "
        f"{(size - len(texture)) / 1000:.0f} kB by Draco."
    )


def _quads_shown(chromium: Any, address: str) -> int:
    """Return how many quadrilaterals the viewer draws the ring with."""
    with fresh_page(chromium) as page:
        page.goto(f"{address}/view/ring.uph")
        page.wait_for_function("globalThis.seen.complete")
        code = "document.querySelector('upholster-viewer')"
        page.evaluate(f"{code}.settled()")
        return int(page.evaluate(f"{code}.model.quads"))


def _write_torus(folder: Path) -> None:
    """Make a torus of a material, for the pictures."""
    upholster.cover(
        EXEMPLAR.parent / "bricks_material",
        "torus:R=2,r=0.9",
        [folder / "torus.uph", folder / "large.glb"],
        synthesis={"texels": 1_000_000, "sample_size": 2.5, "direction": "around:z"},
        seed=1,
        options=WriteOptions(texture="png"),
    )
    _make_small(folder / "large.glb", folder / "torus.glb")


def _make_small(source: Path, target: Path) -> None:
    """Make a GLB small, as well as gltf-transform can by WebP and Draco."""
    tool = str(TOOLS / "gltf-transform")
    between = target.with_suffix(".webp.glb")
    for step in (
        ["webp", str(source), str(between), "--quality", str(QUALITY), "--effort", "100"],
        ["draco", str(between), str(target), "--encode-speed", "0", "--decode-speed", "0"],
    ):
        subprocess.run([tool, *step], check=True, stdout=subprocess.DEVNULL)
    between.unlink()


def _texture(path: Path) -> bytes:
    """Return the bytes of a GLB's only image."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20 : 20 + length])
    view = document["bufferViews"][document["images"][0]["bufferView"]]
    start = 28 + length + view.get("byteOffset", 0)
    return data[start : start + view["byteLength"]]


def _pixels(data: bytes) -> Any:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def _measure(chromium: Any, models: Path, pages: Path, runs: int) -> dict[tuple[str, str], _Times]:
    """Open each player in turn on each line; by line and player."""
    found = {(rate, player): _Times() for rate in RATES for player in PLAYERS}
    for rate, bits in RATES.items():
        with serve_files(models, pages, bits) as line:
            for _ in range(runs):
                for player, path in PLAYERS.items():
                    before = line.sent
                    times = found[rate, player]
                    times.runs.append(_open(chromium, line.address + path.format(name="ring")))
                    times.sent = line.sent - before
                    shown = ", ".join(f"{seconds:.2f} s" for seconds in times.runs[-1])
                    print(f"{rate} {player}: {shown}", file=sys.stderr)
    return found


def _open(chromium: Any, address: str) -> tuple[float, ...]:
    """Open a page; returns seconds to the first picture, to the event that all is there, and to all shown.

    The fourth is of the longest task on the page's own thread, 0 if none exceeds 50 ms.
    """
    with fresh_page(chromium) as page:
        screen = _Screen(page)
        page.goto(address, wait_until="commit")
        page.wait_for_function("globalThis.seen.complete")
        screen.wait()
        click, seen = page.evaluate("[performance.timeOrigin / 1000, globalThis.seen]")
        complete = screen.complete() - click
        first = complete if seen["first"] is None else seen["first"] / 1000
        return first, seen["complete"] / 1000, complete, seen["longest"] / 1000


class _Screen:
    """What a page has on the screen, picture by picture, with seconds since 1970."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self._session = page.context.new_cdp_session(page)
        self._pictures: list[tuple[float, bytes]] = []
        self._session.on("Page.screencastFrame", self._keep)
        self._session.send("Page.startScreencast", {"format": "jpeg", "quality": 80})

    def _keep(self, event: Any) -> None:
        self._pictures.append((event["metadata"]["timestamp"], base64.b64decode(event["data"])))
        self._session.send("Page.screencastFrameAck", {"sessionId": event["sessionId"]})

    def wait(self) -> None:
        """Wait until there is a picture of something, and no other comes any more."""
        before = -1
        while before != len(self._pictures) or self._differ(-1, 0) < ALIKE:
            before = len(self._pictures)
            self._page.wait_for_timeout(QUIET_MS)

    def complete(self) -> float:
        """Return since when nothing on the screen has changed any more."""
        late = len(self._pictures) - 1
        while self._differ(late - 1, -1) < ALIKE:
            late -= 1
        return self._pictures[late][0]

    def _differ(self, one: int, other: int) -> float:
        first, second = (_pixels(self._pictures[n][1]).astype(float) for n in (one, other))
        return float(np.abs(first - second).mean()) if first.shape == second.shape else 255.0


def _rows(found: dict[tuple[str, str], _Times]) -> list[list[str]]:
    rows = []
    for rate in RATES:
        medians = {player: found[rate, player].medians() for player in PLAYERS}
        least = [min(times) for times in zip(*medians.values(), strict=True)]
        for player, (*times, longest) in medians.items():
            shown = [
                f"**{time:.1f} s**" if time == best else f"{time:.1f} s"
                for time, best in zip(times, least, strict=False)
            ]
            task = f"{1000 * longest:.0f} ms" if longest else "at most 50 ms"
            rows.append([rate, player, *shown, task, f"{found[rate, player].sent / 1000:.0f} kB"])
    return rows


def _versions() -> str:
    """Return the versions of the peers, as npm installed them."""
    packages = json.loads((PEERS / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    names = {
        "@google/model-viewer": "model-viewer",
        "three": "three.js",
        "@gltf-transform/cli": "glTF Transform",
    }
    return ", ".join(f"{name} {packages[f'node_modules/{key}']['version']}" for key, name in names.items())


def _beside(chromium: Any, address: str) -> Image.Image:
    """Return pictures of ring and torus, row by row, in each player, from left to right."""
    width, height = SIZE
    names = ("ring", "torus")
    sheet = Image.new("RGB", ((width + GAP) * len(PLAYERS) - GAP, (height + GAP) * len(names) - GAP), "white")
    for row, name in enumerate(names):
        for column, path in enumerate(PLAYERS.values()):
            with fresh_page(chromium) as page:
                page.goto(address + path.format(name=name))
                page.wait_for_function("globalThis.seen.complete")
                page.evaluate("document.querySelector('upholster-viewer')?.settled()")
                page.wait_for_timeout(1000)
                data = page.locator("upholster-viewer, model-viewer, canvas").first.screenshot()
            picture = Image.open(io.BytesIO(data)).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
            sheet.paste(picture, (column * (width + GAP), row * (height + GAP)))
    return sheet
