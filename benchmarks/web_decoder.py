"""The browser's decoder under node: an exemplar as it comes, F1 repainted, and how large the module is."""

import gzip
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from shutil import which
from typing import Any

import upholster
from benchmarks.measure import EXEMPLAR, Results, one_pixel_a_texel
from upholster.codec import encode
from upholster.stream import encode_stream

__all__ = ["web_decoder"]

WEB = Path(__file__).parent.parent / "web"
PROCESSES = 5
"""Each starts cold; medians are printed."""


def web_decoder(results: Results) -> None:
    """Time web/uph.js under node on one thread, compilation included; nothing where node is not installed."""
    if which("node") is None:
        print("node is not installed: the browser's decoder is left out", file=sys.stderr)
        return
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "exemplar.ezw"
        path.write_bytes(encode(exemplar))
        _image(results, path)
        for method in ("paper", "quilt"):
            options = one_pixel_a_texel(surface, exemplar, 2**22) if method == "quilt" else {}
            quilt = upholster.synthesize(exemplar, surface, seed=7, method=method, **options)
            path = Path(folder) / f"{method}.uph"
            path.write_bytes(encode_stream(surface, quilt, exemplar))
            _paint(results, path, f"uph.js: F1, {method}", upholster.paint(quilt, exemplar).count)
    modules = [WEB / "uph.js", *sorted((WEB / "uph").rglob("*.js"))]
    source = b"".join(path.read_bytes() for path in modules)
    results.add("uph.js: with its modules, gzipped", len(gzip.compress(source, 9)) / 1000, "kB")


def _image(results: Results, path: Path) -> None:
    found = [_node("image", path) for _ in range(PROCESSES)]

    def middle(name: str) -> float:
        return float(statistics.median(one[name] for one in found))

    what = "uph.js: 128² RGB exemplar, cold"
    results.add(
        f"{what}: first 4 kB, four pictures",
        middle("first"),
        "ms",
        aim="at most 80",
        remark=f"{middle('fedFirst'):.0f} ms without the pictures",
    )
    results.add(
        f"{what}: all of it, a picture each kB",
        middle("all"),
        "ms",
        aim="at most 400",
        remark=f"{path.stat().st_size / 1000:.0f} kB",
    )
    pieces = [statistics.median(times) for times in zip(*(one["pieces"] for one in found), strict=True)]
    results.add(
        "uph.js: a further kB of an exemplar, warm",
        statistics.median(pieces),
        "ms",
        remark=f"{min(pieces):.1f} to {max(pieces):.1f}",
    )


def _paint(results: Results, path: Path, what: str, texels: int) -> None:
    found = [_node("paint", path) for _ in range(PROCESSES)]

    def middle(name: str) -> float:
        return float(statistics.median(one[name] for one in found))

    results.add(f"{what}: read, cold", middle("read"), "ms", remark=f"{path.stat().st_size / 1000:.0f} kB")
    results.add(
        f"{what}: painted the first time, cold", middle("cold"), "ms", remark=f"{texels / 1e6:.1f} Mtexels"
    )
    rgba, plain = middle("rgba"), middle("texels")
    results.add(
        f"{what}: repainted as RGBA",
        rgba,
        "ms",
        aim="at most 150",
        remark=f"{plain:.0f} ms as texels",
    )


def _node(what: str, path: Path) -> dict[str, Any]:
    script = Path(__file__).parent / "decoder.mjs"
    done = subprocess.run(["node", script, what, path], check=True, capture_output=True, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found
