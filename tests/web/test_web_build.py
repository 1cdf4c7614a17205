"""The npm package, and the built files that the Python package ships."""

import gzip
import json
import os
import re
import shutil
import subprocess
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from tests.web.decoders import run

import upholster
from upholster.base.lengths import METRES, parse_length
from upholster.base.limits import Limits
from upholster.codec.stream.base_chunk import MOST_BASES
from upholster.codec.stream.chunks import CHUNK_KINDS
from upholster.image.roles import MAP_ROLES

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
WEB = ROOT / "web"
FOLDERS = ("glb", "uph", "mesh", "model", "three", "worker", "viewer")
PAGE = ROOT / "src" / "upholster" / "apps" / "studio" / "page"
SHIPPED = ROOT / "src" / "upholster" / "output" / "web"
LONGEST_FUNCTION = 60
"""Lines."""
MOST_SCRIPTS = 80_000
"""Bytes gzipped of viewer and worker, which every page with a viewer loads: they have 67 kB."""


@pytest.fixture(scope="module")
def package() -> Any:
    return json.loads((WEB / "package.json").read_text(encoding="utf-8"))


def _lacking(what: str) -> None:
    if os.environ.get("CI"):
        pytest.fail(f"{what}, and CI is set")
    pytest.skip(what)


def _build(folder: Path, *arguments: str) -> Any:
    """Run a copy's build.mjs as it is run in web/."""
    node = shutil.which("node")
    assert node is not None
    return subprocess.run(
        [node, str(folder / "build.mjs"), *arguments], cwd=folder, capture_output=True, text=True, timeout=900
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of web/ and of what is built from it."""
    if shutil.which("node") is None:
        _lacking("node is not installed")
    if not (WEB / "node_modules" / "esbuild").is_dir():
        _lacking("web/node_modules is missing: run `npm ci` in web/")
    shutil.copytree(WEB, tmp_path / "web", ignore=shutil.ignore_patterns("node_modules"))
    (tmp_path / "web" / "node_modules").symlink_to(WEB / "node_modules", target_is_directory=True)
    shutil.copytree(SHIPPED, tmp_path / "src" / "upholster" / "output" / "web")
    shutil.copy(ROOT / "LICENSE", tmp_path)
    return tmp_path


def test_the_shipped_files_are_what_the_sources_make(copy: Path) -> None:
    done = _build(copy / "web", "--check")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow(reason="runs Node on many streams")
def test_a_file_that_differs_is_named(copy: Path) -> None:
    for source in (copy / "web").glob("u*.js"):  # small ones are built in a second
        source.write_text("self.shown = 1 + 1\n")
    built = copy / "src" / "upholster" / "output" / "web"
    assert "upholster/output/web/upholster-viewer.js is not" in _build(copy / "web", "--check").stderr
    assert _build(copy / "web").returncode == 0
    assert _build(copy / "web", "--check").returncode == 0
    with (built / "LICENSES.txt").open("ab") as file:
        file.write(b" ")
    done = _build(copy / "web", "--check")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "upholster/output/web/LICENSES.txt is not" in done.stderr
    (built / "uph-worker.js").unlink()
    assert "upholster/output/web/uph-worker.js is missing" in _build(copy / "web", "--check").stderr


def test_the_package_tells_the_version_and_what_there_is(package: Any) -> None:
    assert package["version"] == upholster.__version__
    assert package["license"] == "MIT"
    assert (WEB / "LICENSE").read_text(encoding="utf-8") == (ROOT / "LICENSE").read_text(encoding="utf-8")
    # Without types the strictest compiler refuses an entry, and TypeScript reads them first.
    assert all(list(entry) == ["types", "default"] for entry in package["exports"].values())
    named = [path for entry in package["exports"].values() for path in entry.values()]
    for path in (*named, package["types"], *package["sideEffects"]):
        assert (WEB / path).is_file(), path
    packed = {path for pattern in package["files"] for path in WEB.glob(pattern)}
    assert {WEB / path for path in named} <= packed
    for source in packed:
        for found in re.findall(r"""(?:from|import|URL\()\s*'(\.[^']+)'""", source.read_text("utf-8")):
            assert (source.parent / found).resolve() in packed, f"{source.name} needs {found}"


def test_the_elements_attributes_are_the_same_wherever_they_stand() -> None:
    viewer, types, react = (
        (WEB / name).read_text("utf-8")
        for name in ("upholster-viewer.js", "upholster-viewer.d.ts", "uph-react.d.ts")
    )
    heard = re.findall(r"'(\w+)'", viewer.partition("observedAttributes = ")[2].partition("]")[0])
    read = re.findall(r"(?:get|has)Attribute\('(\w+)'\)", viewer)
    table = (ROOT / "docs" / "web.md").read_text("utf-8").partition("| attribute |")[2].partition("\n\n")[0]
    assert set(heard) <= set(read)
    for reported in (
        re.findall(r"^ \* - `(\w+)`:", types, re.MULTILINE),
        re.findall(r"^  (?!on)(\w+)\?:", react, re.MULTILINE),
        re.findall(r"^\| `(\w+)", table, re.MULTILINE),
    ):
        assert set(reported) == set(read)


def test_bundlers_keep_what_is_imported_for_what_it_does(package: Any) -> None:
    """What is imported without its names, `import './it.js'`, bundlers leave out unless it is listed."""
    kept = {(WEB / path).resolve() for path in package["sideEffects"]}
    for source in _sources():
        text = source.read_text("utf-8")
        wanted = re.findall(r"^import '(\.[^']+)'", text, re.MULTILINE)
        loaded = re.findall(r"=> import\('(\.[^']+)'\)", text)
        wanted += [name for name in loaded if "export " not in (source.parent / name).read_text("utf-8")]
        for name in wanted:
            assert (source.parent / name).resolve() in kept, f"{source.name} needs {name}"


def _sources() -> list[Path]:
    return [*WEB.glob("*.js"), *(path for folder in FOLDERS for path in (WEB / folder).rglob("*.js"))]


def _imports(path: Path) -> list[Path]:
    """Modules of ours that a module imports."""
    text = path.read_text(encoding="utf-8")
    found = re.findall(r"""^(?:import|export)[^'"]*'(\.[^']+)'""", text, re.MULTILINE)
    return [(path.parent / name).resolve() for name in found]


def test_no_module_imports_itself_however_far_round() -> None:
    left = {path.resolve(): _imports(path) for path in _sources()}
    assert len(left) > 50
    while left:
        free = [path for path, wanted in left.items() if not any(other in left for other in wanted)]
        assert free, f"imports go round: {sorted(path.name for path in left)}"
        for path in free:
            del left[path]


@pytest.mark.parametrize("name", ["glb", "uph", "mesh"])
def test_decoder_and_mesher_need_only_their_own_folders(name: str) -> None:
    for path in (WEB / name).rglob("*.js"):
        assert all(other.is_relative_to((WEB / name).resolve()) for other in _imports(path)), path.name


def test_the_roles_of_maps_are_pythons() -> None:
    text = (WEB / "uph" / "roles.js").read_text(encoding="utf-8")
    rows = re.findall(r"^  (\w+): \{ (.*) \},$", text, re.MULTILINE)
    assert [role for role, _ in rows] == list(MAP_ROLES)
    for role, row in rows:
        python, found = MAP_ROLES[role], dict(re.findall(r"(\w+): ([^,]+)", row))
        assert found.keys() <= {"target", "channel", "neutral", "isColor", "isSharp"}
        assert ("isColor" in found) is python.is_color, role
        assert ("isSharp" in found) is python.is_sharp, role
        assert found.get("channel") == (None if python.channel is None else str(python.channel)), role
        # Where textures are shared, materials need the value of a missing map.
        if found["target"] == "'surface'":
            assert (float(found["neutral"]),) == python.neutral, role


@pytest.mark.slow(reason="runs Node on many streams")
def test_functions_are_short() -> None:
    if not (WEB / "node_modules" / "typescript").is_dir():
        _lacking("web/node_modules is missing: run `npm ci` in web/")
    node = shutil.which("node")
    assert node is not None
    arguments = [node, str(HERE / "lengths.mjs"), *map(str, _sources())]
    done = subprocess.run(arguments, cwd=WEB, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found) > 500
    assert [one for one in found if one["lines"] > LONGEST_FUNCTION] == []


def test_development_is_pinned_and_no_host_is_named(package: Any) -> None:
    lock = (WEB / "package-lock.json").read_text(encoding="utf-8")
    packages = json.loads(lock)["packages"]
    assert packages[""]["version"] == package["version"]
    for name, version in package["devDependencies"].items():
        assert re.fullmatch(r"\d+\.\d+\.\d+(-[a-z0-9.]+)?", version), name
        assert packages[f"node_modules/{name}"]["version"] == version
    for text in (lock, (WEB / "package.json").read_text("utf-8"), (WEB / ".npmrc").read_text("utf-8")):
        assert "//" not in re.sub(r'"(integrity|url)": "[^"]*"', "", text)


def _built() -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in SHIPPED.glob("*.js")}


def test_notices_go_with_the_copies() -> None:
    ours = (ROOT / "LICENSE").read_text(encoding="utf-8").strip()
    assert ours in (SHIPPED / "LICENSES.txt").read_text(encoding="utf-8")
    for text in _built().values():
        assert text.startswith("/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */\n")


def test_the_scripts_stand_alone() -> None:
    wanted = {
        "upholster-viewer.js": {
            "./upholster-lab.js",
            "./upholster-environment.js",
            "./uph-picture.js",
        },
        "uph-three.js": {"./uph-glb.js", "./uph-picture.js"},
    }
    for name, text in _built().items():
        code = text.partition("*/")[2]
        if name == "uph-three.js":  # three.js is the page's
            code = re.sub(r'import\{[^}]*\}from"three";', "", code)
        assert not re.search(r"""(?:^|[;}])import\s*[{*"'\w]|\bfrom\s*["']\.""", code), name
        assert set(re.findall(r"""import\(["']([^"']*)["']\)""", code)) == wanted.get(name, set()), name
        assert "eval(" not in code
        assert "new Function(" not in code
    for name in ("upholster-viewer.js", "uph-three.js"):
        assert 'new URL("./uph-worker.js",import.meta.url)' in _built()[name]


def test_scripts_are_small() -> None:
    """A test of the browser looks at which scripts are loaded."""
    built = _built()
    names = ("upholster-viewer.js", "uph-worker.js")
    sizes = {name: len(gzip.compress(built[name].encode(), 9)) for name in names}
    assert sum(sizes.values()) <= MOST_SCRIPTS, sizes


def test_the_studio_writes_lengths_in_the_units_of_python() -> None:
    script = f"import {{ METRES, written }} from '{PAGE}/lengths.js'; "
    script += "console.log(JSON.stringify([METRES, [1e-5, 0.02, 3, 2500].map((size) => written(size, 'm'))]))"
    units, lengths = json.loads(run("--input-type=module", "-e", script))
    assert units == METRES
    assert [parse_length(text, 1.0) for text in lengths] == pytest.approx([1e-5, 0.02, 3, 2500])


def test_chunks_have_the_same_order_and_lengths_as_in_python() -> None:
    text = (WEB / "uph" / "chunks.js").read_text(encoding="utf-8")
    rows = dict(line.split(" = ", 1) for line in re.findall(r"^const ([A-Z_]+ = .+)$", text, re.MULTILINE))
    needs = re.findall(r"(\w): \[([^]]*)\]", rows["NEEDS"])
    kinds = CHUNK_KINDS.items()
    assert {tag: tuple(re.findall(r"\w+", groups)) for tag, groups in needs} == {
        tag: kind.needs for tag, kind in kinds
    }
    longest = re.findall(r"(\w): 2 \*\* (\d+)", rows["LONGEST"])
    assert {tag: 2 ** int(bits) for tag, bits in longest} == {
        tag: kind.longest for tag, kind in kinds if kind.longest
    }
    assert set(rows["ANY_NUMBER"].strip("'")) == {tag for tag, kind in kinds if kind.repeats}
    assert int(rows["MOST_BASES"]) == MOST_BASES


@pytest.mark.parametrize("texels", [1, 10**6, 2**31])
def test_limits_follow_from_texels_as_in_python(texels: int) -> None:
    script = f"import {{ fillLimits }} from '{WEB}/uph/limits.js'; "
    script += f"console.log(JSON.stringify([fillLimits(), fillLimits({{ texels: {texels} }})]))"
    found = json.loads(run("--input-type=module", "-e", script))
    assert found == [asdict(Limits()), asdict(Limits(texels=texels))]
