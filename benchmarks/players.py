"""A covered rigged model in other programs: whether it still plays, and how it looks there.

``python -m benchmarks.players MODEL.glb -o OUT --blender PYTHON [--sample IMAGE] [--gallery]``. Covers a GLB
that has a skin and animations, and compares it with its source: joints, weights, bind matrices and animations
by value; where every corner of every triangle is in each pose, in three.js (in Chromium) and in Blender; what
Khronos' validator says. Draws it in our renderer, Blender and three.js, to OUT/players.jpg, or with
``--gallery`` to docs/gallery. PYTHON is one that has ``bpy`` (``python3.11 -m venv V && V/bin/pip install
bpy``), which is GPL, and which nothing of ours uses.
"""

import argparse
import base64
import io
import json
import shutil
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import upholster
from benchmarks.browser import ARGUMENTS, find_chromium
from upholster.image import from_linear
from upholster.options import WriteOptions
from upholster.render import Camera, render

__all__ = ["main"]

ROOT = Path(__file__).parent.parent
FPS = 24
SIZE = (400, 340)
VIEW = (50.0, 14.0)
VALIDATE = """
const validator = require(process.argv[1]), fs = require('fs');
const files = process.argv.slice(2);
Promise.all(files.map(file => validator.validateBytes(new Uint8Array(fs.readFileSync(file))))).then(
    reports => console.log(JSON.stringify(reports.map(report => report.issues))));
"""

Pose = tuple[str | None, int]
"""An animation and its frame, `FPS` a second; None for none."""


@dataclass(frozen=True)
class _Played:
    """What a program makes of the covered model in each pose: corners in space, z up, and pictures."""

    corners: list[NDArray[np.float64]]
    pictures: list[Any]


class _Glb:
    """A GLB as it stands in its file."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + length])
        self.bytes = data[28 + length :]

    def values(self, index: int) -> NDArray[Any]:
        """Return an accessor's values, (count, components)."""
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind = np.dtype({5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor["componentType"]])
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step = view.get("byteStride", kind.itemsize * width)
        rows = [
            np.frombuffer(self.bytes, kind, width, start + step * row) for row in range(accessor["count"])
        ]
        return np.array(rows)

    def corners(self, name: str) -> NDArray[Any]:
        """Return an attribute of all triangles' corners of all meshes with a skin."""
        parts = []
        for mesh in self.json["meshes"]:
            for primitive in mesh["primitives"]:
                if name in primitive["attributes"]:
                    values = self.values(primitive["attributes"][name])
                    index = self.values(primitive["indices"])[:, 0] if "indices" in primitive else slice(None)
                    parts.append(values[index])
        return np.concatenate(parts)

    def rig(self) -> list[Any]:
        """Return skins and animations with the values that they name."""
        found: list[Any] = [self.json["nodes"]]
        for skin in self.json["skins"]:
            found += [skin["joints"], self.values(skin["inverseBindMatrices"]).tolist()]
        for animation in self.json["animations"]:
            found += [animation.get("name"), animation["channels"]]
            for sampler in animation["samplers"]:
                found += [self.values(sampler[end]).tolist() for end in ("input", "output")]
                found.append(sampler.get("interpolation", "LINEAR"))
        return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.players", description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--blender", type=Path, required=True)
    parser.add_argument("--sample", type=Path, default=ROOT / "examples" / "weave.png")
    parser.add_argument("--gallery", action="store_true")
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    files = {"source": asked.model.resolve(), "covered": asked.out.resolve() / "covered.glb"}
    report = upholster.cover(
        asked.sample, files["source"], files["covered"], synthesis={"texels": 1_000_000}, seed=1
    )
    poses = _poses(_Glb(files["source"]))
    _same_rig(files)
    _validated(files["covered"])
    assert report.model is not None
    points = report.model.mesh.positions
    middle, half = (points.max(axis=0) + points.min(axis=0)) / 2, np.ptp(points, axis=0) / 2
    # The box's corners, not the model alone: room into which it moves.
    room = middle + half * np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    camera = Camera.fit(room, size=SIZE, view=VIEW)
    ours = _ours(report.model, camera)
    three, blender = _three(files, poses, camera), _blender(asked, files, poses, camera)
    for pose, one, other in zip(poses, three.corners, blender.corners, strict=True):
        apart = np.abs(one - other).max()
        print(f"{_named(pose)}: corners in three.js and Blender are at most {apart:.2g} units apart")
    _save(asked, poses, ours, {"three.js": three.pictures, "Blender": blender.pictures})
    return 0


def _poses(source: _Glb) -> list[Pose]:
    """Return the pose without an animation, and one within each."""
    found: list[Pose] = [(None, 0)]
    for animation in source.json["animations"]:
        last = max(source.json["accessors"][s["input"]]["max"][0] for s in animation["samplers"])
        found.append((animation["name"], int(0.45 * last * FPS)))
    return found


def _same_rig(files: dict[str, Path]) -> None:
    before, after = _Glb(files["source"]), _Glb(files["covered"])
    print(f"nodes, skins, bind matrices, animations: {_told(before.rig() == after.rig())}")
    for name in ("POSITION", "JOINTS_0", "WEIGHTS_0"):
        same = np.array_equal(before.corners(name), after.corners(name))
        print(f"{name} of all {len(after.corners(name))} corners: {_told(same)}")


def _told(same: bool) -> str:
    return "equal" if same else "DIFFERENT"


def _validated(file: Path) -> None:
    package = ROOT / "web" / "node_modules" / "gltf-validator"
    node = shutil.which("node")
    if node is None or not package.is_dir():
        print("validator: skipped; it needs node, and `npm ci` in web/")
        return
    command = [node, "-e", VALIDATE, str(package), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    issues = json.loads(done.stdout)[0]
    counts = ", ".join(f"{issues[kind]} {kind[3:].lower()}" for kind in issues if kind.startswith("num"))
    print(f"validator: {counts}; {sorted({m['code'] for m in issues['messages']})}")


def _ours(model: Any, camera: Camera) -> Any:
    drawn = replace(model, options=WriteOptions(size=SIZE, padding=16))
    linear = render(
        drawn.mesh.positions, drawn.mesh.normals, drawn.uv, drawn.mesh.all_triangles(), drawn.atlas.pixels,
        camera=camera,
    )  # fmt: skip
    return Image.fromarray(from_linear(np.asarray(linear)[..., :3], "uint8"))


def _three(files: dict[str, Path], poses: list[Pose], camera: Camera) -> _Played:
    """Pose both models in three.js, and compare all corners."""
    from playwright.sync_api import sync_playwright

    eye, (_, up, forward) = camera.eye, camera.axes
    sun = 2 * up - camera.axes[0] - forward
    vectors = (("eye", eye), ("target", eye + forward), ("up", up), ("sun", sun))
    place = {name: _y_up(v) for name, v in vectors} | _lens(camera)
    pictures, placed, worst = [], [], 0.0
    with _serving(files) as address, sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=find_chromium(), args=[*ARGUMENTS])
        page = chromium.new_page()
        page.goto(f"{address}/pages/player.html")
        page.wait_for_function("globalThis.ready")
        for name in files:
            page.evaluate("([name, url]) => load(name, url)", [name, f"{address}/models/{name}.glb"])
        rest = _three_corners(page, "source", (None, 0))
        for pose in poses:
            source, covered = (_three_corners(page, name, pose) for name in files)
            placed.append(covered)
            worst = max(worst, float(np.abs(source - covered).max()))
            print(f"three.js, {_named(pose)}: corners have moved by {np.abs(source - rest).max():.3g} units")
            url = page.evaluate("([size, camera]) => draw('covered', size, camera)", [SIZE, place])
            pictures.append(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB"))
        chromium.close()
    print(f"three.js: corners of source and covered are at most {worst:g} units apart")
    return _Played([corners[:, [0, 2, 1]] * (1, -1, 1) for corners in placed], pictures)


def _three_corners(page: Any, name: str, pose: Pose) -> NDArray[np.float64]:
    clip, frame = pose
    page.evaluate("([name, clip, time]) => pose(name, clip, time)", [name, clip, frame / FPS])
    return np.array(page.evaluate("(name) => corners(name)", name)).reshape(-1, 3)


def _y_up(v: NDArray[np.float64]) -> list[float]:
    return [float(v[0]), float(v[2]), float(-v[1])]


def _lens(camera: Camera) -> dict[str, Any]:
    far = 20 * float(np.linalg.norm(camera.eye))
    return {
        "angle": float(np.degrees(2 * np.arctan(SIZE[1] / 2 / camera.focal))),
        "near": far / 1e4,
        "far": far,
    }


@contextmanager
def _serving(files: dict[str, Path]) -> Iterator[str]:
    """Serve web/, the page and the models on a port of this machine."""
    folders = {"web": ROOT / "web", "pages": ROOT / "benchmarks" / "web_pages"}

    class Handler(SimpleHTTPRequestHandler):
        def translate_path(self, path: str) -> str:
            first, _, rest = path.partition("?")[0].strip("/").partition("/")
            if first == "models":
                return str(files[Path(rest).stem])
            return str(folders.get(first, folders["pages"]) / rest)

        def log_message(self, *_: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        thread.join()


def _blender(asked: argparse.Namespace, files: dict[str, Path], poses: list[Pose], camera: Camera) -> _Played:
    """Pose both models in Blender, and compare all corners."""
    names = [asked.out.resolve() / f"blender_{number}.png" for number in range(len(poses))]
    request = {
        "models": {name: str(file) for name, file in files.items()},
        "drawn": "covered",
        "fps": FPS,
        "poses": poses,
        "pictures": [str(name) for name in names],
        "corners": str(asked.out.resolve() / "corners.npz"),
        "size": SIZE,
        "camera": {"eye": camera.eye.tolist(), "axes": camera.axes.tolist(), **_lens(camera)},
    }
    file = asked.out / "request.json"
    file.write_text(json.dumps(request), encoding="utf-8")
    script = Path(__file__).with_name("blender_player.py")
    done = subprocess.run([asked.blender, script, file], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"players: Blender failed: {done.stderr[-2000:]}")
    with np.load(asked.out / "corners.npz") as found:
        apart = [np.abs(found[f"source_{n}"] - found[f"covered_{n}"]).max() for n in range(len(poses))]
        corners = [found[f"covered_{n}"].reshape(-1, 3) for n in range(len(poses))]
    print(f"Blender: corners of source and covered are at most {max(apart):g} units apart")
    return _Played(corners, [Image.open(name).convert("RGB") for name in names])


def _named(pose: Pose) -> str:
    clip, frame = pose
    return "at rest" if clip is None else f"{clip} at {frame / FPS:.2f} s"


def _save(asked: argparse.Namespace, poses: list[Pose], ours: Any, pictures: dict[str, list[Any]]) -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    from gallery_tools.drawing import Panel, compose, save_jpeg

    at_rest = [Panel(ours, "ours, at rest")]
    at_rest += [Panel(images[0], f"{name}, at rest") for name, images in pictures.items()]
    rows = [at_rest]
    for name, images in pictures.items():
        rows.append([Panel(images[n], f"{name}, {_named(poses[n])}") for n in range(1, min(4, len(poses)))])
    folder = ROOT / "docs" / "gallery" if asked.gallery else asked.out
    save_jpeg(compose(rows, gap=12), folder / "players.jpg")
    print(f"wrote {folder / 'players.jpg'}")


if __name__ == "__main__":
    sys.exit(main())
