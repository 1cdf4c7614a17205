"""The command line as a user meets it: files written, one-line errors, Ctrl-C."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

from upholster.apps.cli.console import bars, share
from upholster.base.errors import InputError
from upholster.image.files.write import write_image

COMMAND = [sys.executable, "-m", "upholster"]
PATIENCE = 600
"""Seconds after which a process hangs: the machine may be busy, and kernels not compiled yet."""


def run_process(*arguments, cwd):
    return subprocess.run([*COMMAND, *arguments], cwd=cwd, capture_output=True, text=True, timeout=PATIENCE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    rng = np.random.default_rng(0)
    write_image(folder / "brick.png", rng.integers(0, 256, (64, 64, 3), dtype=np.uint8))
    (folder / "empty.png").touch()
    (folder / "text.png").write_text("this is not a picture")
    (folder / "cut.png").write_bytes((folder / "brick.png").read_bytes()[:2000])
    (folder / "folder.glb").mkdir()
    points = "[[[0,0,0],[1,0,0]],[[0,1,0],[1,1,0]]]"
    (folder / "nets.json").write_text(f'{{"patches": [{{"points": {points}, "weights": [[1,1],[1,-1]]}}]}}')
    return folder


def test_cover_writes_what_it_says(folder, tmp_path):
    names = ["ring.glb", "ring.obj", "ply.ply", "ring.png", "ring.npz", "tex.webp", "deep.exr"]
    outputs = [f"-o{'atlas:' if name == 'tex.webp' else ''}{tmp_path / name}" for name in names]
    report = tmp_path / "report.json"
    done = run_cli(
        "cover", "brick.png", "--on", "torus:R=3,r=1", "--method", "paper", "--chart", "64",
        "--edge-block", "24", "--quads", "400", "--size", "80x60", "--seed", "7",
        *outputs, "--report", str(report), cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    last, settled = done.stdout.strip().splitlines()
    assert settled.endswith("block 32 texels; overlap 8 texels; edge block 24 texels")
    for name in names:
        assert (tmp_path / name).stat().st_size > 0
        assert name in last
    assert " s" in last
    assert not list(tmp_path.glob(".upholster*"))
    reported = json.loads(report.read_text())
    assert reported["parameters"]["seed"] == 7
    assert reported["parameters"]["on"] == "torus:R=3,r=1"
    assert reported["counts"]["charts"] == 16
    assert reported["counts"]["texels"] == 16 * 64 * 64
    assert reported["counts"]["edge blocks"] == 32 * 4
    assert reported["settled"] == {
        "patches": "16 of degree (2, 2)",
        "texels": "64x64 on each",
        "block": "32 texels",
        "overlap": "8 texels",
        "edge block": "24 texels",
    }
    assert reported["seconds"]["total"] > 0
    assert reported["peak_memory_bytes"] is None or reported["peak_memory_bytes"] > 10**7
    assert reported["written"][str(tmp_path / "ring.glb")] == (tmp_path / "ring.glb").stat().st_size


BAD = {
    "missing exemplar": (["none.png", "--on", "torus", "-o", "a.glb"], "none.png"),
    "empty exemplar": (["empty.png", "--on", "torus", "-o", "a.glb"], "empty.png"),
    "text as exemplar": (["text.png", "--on", "torus", "-o", "a.glb"], "text.png"),
    "truncated exemplar": (["cut.png", "--on", "torus", "-o", "a.glb"], "cut.png"),
    "folder as exemplar": (["folder.glb", "--on", "torus", "-o", "a.glb"], "folder.glb"),
    "block larger than exemplar": (["brick.png", "--on", "torus", "-o", "a.glb", "--block", "128"], "128"),
    "unknown surface": (["brick.png", "--on", "tours", "-o", "a.glb"], "torus"),
    "unknown parameter": (["brick.png", "--on", "torus:q=3", "-o", "a.glb"], "q"),
    "mu too large": (["brick.png", "--on", "cyclide:a=6,c=2,mu=7", "-o", "a.glb"], "mu"),
    "mu not a number": (["brick.png", "--on", "cyclide:mu=nan", "-o", "a.glb"], "mu"),
    "odd spans": (["brick.png", "--on", "cyclide:spans=5x4", "-o", "a.glb"], "spans"),
    "negative weight": (["brick.png", "--on", "nets.json", "-o", "a.glb"], "weight"),
    "block and levels": (
        ["brick.png", "--on", "torus", "-o", "a.glb", "--method", "paper", "--block", "36"],
        "block",
    ),
    "overlap": (["brick.png", "--on", "torus", "-o", "a.glb", "--overlap", "40"], "overlap"),
    "chart 0": (["brick.png", "--on", "torus", "-o", "a.glb", "--method", "paper", "--chart", "0"], "chart"),
    "chart too large": (
        ["brick.png", "--on", "torus", "-o", "a.glb", "--method", "paper", "--chart", "16385"],
        "chart",
    ),
    "too many texels": (
        ["brick.png", "--on", "torus", "-o", "a.glb", "--method", "paper", "--chart", "16384"],
        "GiB",
    ),
    "stream of pixels": (
        ["brick.png", "--on", "torus", "-o", "a.png", "-o", "a.uph", "--method", "pixel", "--chart", "64"],
        "method 'pixel' has no stream: 65,536 texels with a source of",
    ),
    "page of pixels": (["brick.png", "--on", "torus", "-o", "a.html", "--method", "pixel"], "no stream"),
    "sample too small for pixels": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--method", "pixel", "--levels", "5"],
        "allowed with 5 levels: 160",
    ),
    "sample too large for pixels": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--method", "pixel", "--resize", "600"],
        "up to 512",
    ),
    "search of another method": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--method", "paper", "--search", "full"],
        "search belongs to method 'pixel'",
    ),
    "unknown search": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--method", "pixel", "--search", "fast"],
        "search 'fast'",
    ),
    "quads": (["brick.png", "--on", "torus", "-o", "a.glb", "--quads", "-3"], "quads"),
    "size": (["brick.png", "--on", "torus", "-o", "a.png", "--size", "0x3"], "size"),
    "size not numbers": (["brick.png", "--on", "torus", "-o", "a.png", "--size", "big"], "size"),
    "view": (["brick.png", "--on", "torus", "-o", "a.png", "--view", "0,inf"], "view"),
    "view of a sheet": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--view", "sheet"],
        "`upholster picture model.glb --view sheet`",
    ),
    "length with a unit": (
        ["brick.png", "--on", "torus", "-o", "a.png", "--sample-size", "3cm"],
        "--unit mm",
    ),
    "unit of a surface": (["brick.png", "--on", "torus", "-o", "a.png", "--unit", "mm"], "unit: for models"),
    "crop": (["brick.png", "--on", "torus", "-o", "a.png", "--crop", "60,60,32,32"], "crop"),
    "suffix": (["brick.png", "--on", "torus", "-o", "a.step"], ".step"),
    "no folder": (["brick.png", "--on", "torus", "-o", "nowhere/a.glb"], "nowhere"),
    "a folder": (["brick.png", "--on", "torus", "-o", "folder.glb"], "folder.glb"),
    "twice": (["brick.png", "--on", "torus", "-o", "a.glb", "-o", "a.glb"], "twice"),
    "texture": (["brick.png", "--on", "torus", "-o", "a.glb", "--texture", "gif"], "texture"),
    "not a number": (["brick.png", "--on", "torus", "-o", "a.glb", "--chart", "many"], "chart"),
    "no output": (["brick.png", "--on", "torus"], "output"),
    "unknown option": (["brick.png", "--on", "torus", "-o", "a.glb", "--sede", "1"], "--sede"),
}


def test_a_material_is_covered_pixel_by_pixel(tmp_path):
    report = tmp_path / "report.json"
    material = Path(__file__).parent.parent / "examples" / "bricks_material"
    done = run_cli(
        "cover", material, "--on", "sphere", "--method", "pixel", "--chart", "32", "--resize", "64",
        "-o", tmp_path / "a.glb", "-o", tmp_path / "a.obj", "-o", tmp_path / "a.npz", "--report", report,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "search coherent" in done.stdout
    reported = json.loads(report.read_text())
    assert reported["counts"]["texels"] == 6 * 32 * 32
    assert reported["counts"]["maps"] == 5
    assert reported["parameters"]["search"] == "coherent"
    assert (tmp_path / "a_texture_normal.png").exists()


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_status_2(name, folder):
    arguments, named = BAD[name]
    before = sorted(folder.iterdir())
    assert_one_line(run_cli("cover", *arguments, cwd=folder), named)
    assert sorted(folder.iterdir()) == before


@pytest.mark.slow(reason="starts processes")
def test_a_process_says_the_same_and_ends_with_the_same_status(folder):
    arguments = ["cover", "none.png", "--on", "torus", "-o", "a.glb"]
    done, alike = run_process(*arguments, cwd=folder), run_cli(*arguments, cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (alike.returncode, alike.stdout, alike.stderr)


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals and terminals")
@pytest.mark.parametrize("stop", ["SIGINT", "SIGHUP"])
def test_ctrl_c_or_a_closed_terminal_stops_it_and_leaves_nothing(folder, tmp_path, stop):
    """Pressed while the bars move, when most of the work is still to be done."""
    target = tmp_path / "big.npz"
    target.write_text("an older file")
    arguments = ["brick.png", "--on", "torus", "--texels", "2M", "--sample-size", "0.1", "-o", str(target)]
    ours, terminal = os.openpty()
    process = subprocess.Popen([*COMMAND, "cover", *arguments], cwd=folder, stderr=terminal, preexec_fn=_hear)
    os.close(terminal)
    hanging = threading.Timer(PATIENCE, process.kill)
    hanging.start()
    try:
        said = b""
        while (part := _read(ours)) and not re.search(rb"blocks[^\r\n]*[1-9]\d?%", said := said + part):
            pass
        process.send_signal(getattr(signal, stop))
        while part := _read(ours):
            said += part
        assert process.wait() == 130, said
    finally:
        process.kill()
        process.wait()
        hanging.cancel()
        os.close(ours)
    assert said.decode().rstrip().endswith("upholster: stopped, nothing written")
    assert os.listdir(tmp_path) == ["big.npz"]
    assert target.read_text() == "an older file"


def _hear():
    # A shell starts what it runs in the background with Ctrl-C ignored, and a child inherits that.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX shell")
@pytest.mark.parametrize("closed", [">&-", "<&- >&- 2>&-"])
def test_closed_standard_files_are_no_fault(folder, tmp_path, closed):
    arguments = f"cover brick.png --on plane --texels 64x64 -o {tmp_path}/a.png {closed}"
    command = " ".join([*map(str, COMMAND), arguments])
    done = subprocess.run(["sh", "-c", command], cwd=folder, check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def _read(terminal):
    """Return what comes next on a terminal, b"" when nobody has it open any more."""
    try:
        return os.read(terminal, 4096)
    except OSError:
        return b""


def test_swapped_arguments_are_recognised(folder, tmp_path):
    (tmp_path / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = run_cli("cover", tmp_path / "box.obj", "--on", folder / "brick.png", "-o", tmp_path / "x.glb")
    assert_one_line(done, "the other way round")
    assert "brick.png --on" in done.stderr


def test_all_missing_options_are_named_at_once_with_an_example(folder):
    done = run_cli("cover", folder / "brick.png")
    assert_one_line(done, "missing: --on SURFACE, -o/--output FILE; example: upholster cover")
    assert_one_line(run_cli("cover", folder / "brick.png", "--on", "plane"), "missing: -o/--output FILE;")


def test_a_draft_is_small_unless_asked_otherwise(folder, tmp_path):
    for more, texels in (((), 200_000), (("--texels", "20k"), 20_000)):
        words = (folder / "brick.png", "--on", "torus", "-o", tmp_path / "x.npz", "--draft", *more)
        done = run_cli("cover", *words, "--report", tmp_path / "r.json")
        assert done.returncode == 0, done.stderr
        asked = json.loads((tmp_path / "r.json").read_text())["parameters"]
        assert asked["texels"] == texels


@pytest.mark.parametrize("method", ["paper", "pixel"])
def test_a_draft_by_another_method_is_refused_by_its_name(folder, tmp_path, method):
    words = (folder / "brick.png", "--on", "torus", "-o", tmp_path / "x.npz", "--draft")
    done = run_cli("cover", *words, "--method", method)
    assert_one_line(done, f"draft is given with method '{method}'; allowed: with 'quilt', or a small --chart")


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX terminals")
@pytest.mark.parametrize("words", [("cover", "--help"), ("surfaces",)])
def test_without_colours_nothing_is_bold_or_dim(words):
    ours, terminal = os.openpty()
    environment = {**os.environ, "NO_COLOR": "1", "TERM": "xterm-256color"}
    process = subprocess.Popen([*COMMAND, *words], env=environment, stdout=terminal, stderr=terminal)
    os.close(terminal)
    said = b""
    while part := _read(ours):
        said += part
    os.close(ours)
    assert process.wait() == 0
    assert len(said) > 500
    assert b"\x1b" not in said


def test_surfaces_lists_every_surface(folder):
    from upholster.geometry.built_in.catalog import SURFACES

    done = run_cli("surfaces", cwd=folder)
    assert done.returncode == 0
    for kind in SURFACES.values():
        assert kind.name in done.stdout
        for parameter in kind.parameters:
            assert parameter.name in done.stdout


def test_help_and_version_answer_without_heavy_imports(folder):
    heavy = ("numpy", "numba", "OpenImageIO", "rich")
    code = f"import sys, upholster.apps.cli; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert run_cli("--version", cwd=folder).stdout.startswith("upholster 0")
    done = run_process("cover", "--help", cwd=folder)
    assert done.returncode == 0
    assert "--overlap" in done.stdout


@pytest.mark.parametrize("command", [["--help"], ["surfaces"], ["info", "sample:chair"]])
def test_commands_without_kernels_load_no_numba(command, folder):
    code = (
        "import sys, upholster.apps.cli as cli; cli.run_words(sys.argv[1:]); "
        "print([name for name in ('numba', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="lists threads there")
def test_no_threads_wait_beside_those_of_the_program():
    code = (
        "import os, sys, upholster.apps.cli as cli\n"
        "def end(status):\n"
        "    import numpy; numpy.ones((500, 500)) @ numpy.ones((500, 500))\n"
        "    print(len(os.listdir('/proc/self/task'))); sys.exit(status)\n"
        "os._exit = end; cli.main()"
    )
    env = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True, env=env)
    assert done.stdout.splitlines()[-1] == "1", done.stderr


def test_the_same_seed_writes_the_same_file(folder, tmp_path):
    for name in ("one.glb", "two.glb"):
        threads = "1" if name == "one.glb" else "3"
        done = run_cli(
            "cover", "brick.png", "--on", "sphere", "--method", "paper", "--chart", "64", "--seed", "3",
            "--threads", threads, "-o", str(tmp_path / name), cwd=folder,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    assert Path(tmp_path / "one.glb").read_bytes() == Path(tmp_path / "two.glb").read_bytes()


def test_without_arguments_it_is_the_help():
    bare, asked = run_cli(), run_cli("--help")
    assert bare.returncode == asked.returncode == 0
    assert bare.stdout == asked.stdout
    assert "cover" in bare.stdout
    assert bare.stderr == ""


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is full")
@pytest.mark.parametrize("command", [["surfaces"], ["--version"]])
def test_a_full_standard_output_is_one_line(command):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, *command], stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE
        )
    assert done.returncode == 1
    assert done.stderr == "upholster: standard output cannot be written: No space left on device\n"


@pytest.mark.slow(reason="starts processes")
def test_a_reader_who_has_enough_is_no_error():
    process = subprocess.Popen(
        [*COMMAND, "surfaces"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(PATIENCE) == 1
    process.stderr.close()


def test_a_log_hears_of_progress_every_few_seconds(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("upholster.apps.cli.console.EVERY", 0.01)
    with bars(False, None) as report:
        report("blocks", 3, 40)
        said, until = "", time.monotonic() + PATIENCE
        while said.count("\n") < 4 and time.monotonic() < until:
            time.sleep(0.1)
            said += capsys.readouterr().err
    reported = (said + capsys.readouterr().err).splitlines()
    assert len(reported) > 3
    assert all(re.fullmatch(r"blocks 7 %, \d+ s", line) for line in reported)
    with bars(True, None) as report:
        assert report is None


@pytest.mark.parametrize("name", ["r.png", "r", "r.json.gz"])
def test_a_report_is_json(folder, tmp_path, name):
    done = run_cli(
        "cover",
        "brick.png",
        "--on",
        "torus",
        f"-o{tmp_path / 'a.glb'}",
        f"--report={tmp_path / name}",
        cwd=folder,
    )
    assert_one_line(done, "allowed: .json")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["chair.xyz", "some/chair.fbx", "./chair"])
def test_a_surface_of_an_unknown_suffix_says_which_are_known(folder, name):
    assert_one_line(run_cli("cover", "brick.png", "--on", name, "-oa.glb", cwd=folder), ".json, .bpt")


WRONG = {
    "twice": (["cover", "brick.png", "--on", "torus", "--on=sphere", "-oa.glb"], "--on is given 2 times"),
    "scale": (["cover", "brick.png", "--on=torus", "-oa.glb", "--scale=2"], "--element-size, --sample-size"),
    "no whole number": (
        ["cover", "brick.png", "--on", "torus", "-oa.glb", "--seed", "1.5"],
        "--seed is '1.5'",
    ),
    "no number": (["cover", "brick.png", "--on", "torus", "-oa.glb", "--density=x"], "--density is 'x'"),
    "standard input": (["cover", "-", "--on", "torus", "-oa.glb"], "standard input is not read"),
    "no name": (["cover", "", "--on", "torus", "-oa.glb"], "''"),
    "no stream": (["refine", "brick.png", "-oa.glb"], "brick.png"),
    "no image code": (["decode", "brick.png", "-oa.png"], "brick.png"),
    "nothing in it": (["info", "empty.png"], "empty.png"),
    "no command": (["help"], "allowed: cover, picture, prepare, fill, surfaces"),
    "no arguments": (["cover"], "--on"),
    "no sample": (["cover", "--on", "torus", "-oa.glb"], "no SAMPLE is given; allowed: one, or --material"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_a_command_can_not_take_is_named(folder, case):
    arguments, named = WRONG[case]
    assert_one_line(run_cli(*arguments, cwd=folder), named)


def test_an_option_that_may_be_given_twice_may(folder, tmp_path):
    two = [f"-o{tmp_path / name}" for name in ("a.npz", "b.npz")]
    options = ["--method", "paper", "--chart", "32", "-q", "-q"]
    assert run_cli("cover", "brick.png", "--on", "sphere", *two, *options, cwd=folder).returncode == 0


@pytest.mark.parametrize("text", ["0", "-1%", "101%", "1.01", "nan", "1e99", "much"])
def test_a_share_says_how_much_is_allowed(text):
    assert share("coefficients", "6%") == 0.06
    with pytest.raises(InputError, match=r"coefficients is '.*'; allowed: .* at most 100%"):
        share("coefficients", text)
