"""The studio, asked as its page asks it: on real connections, with a worker of its own."""

import http.client
import json
import os
import re
import shlex
import signal
import struct
import sys
import time
import zipfile
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
from command_line import run_cli

from upholster import InputError, Project, Sample, read_exemplar, read_project
from upholster.apps.project.file import project_of
from upholster.apps.server import serving
from upholster.base.options.direction_words import DIRECTIONS
from upholster.codec.stream.reader import StreamDecoder
from upholster.image.color import from_linear
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.read import read_image
from upholster.image.files.write import encode_image
from upholster.image.photo.rectify import Rectification

pytest.importorskip("starlette")

from upholster.apps.studio import routes as studio_routes
from upholster.apps.studio.overlays import KINDS
from upholster.apps.studio.routes import Studio, make_studio
from upholster.apps.studio.words import command, python

EXAMPLES = Path(__file__).parents[2] / "examples"
WEAVE, CHAIR = EXAMPLES / "weave.png", EXAMPLES / "chair.glb"
STATE = {
    "upholster": 1,
    "model": "included/chair.glb",
    "sample": {"source": "included/weave.png", "size": "60cm"},
    "synthesis": {"texels": 10_000},
    "seed": 3,
}
LONG = STATE | {"synthesis": {"texels": 1_000_000}}
"""A state whose worker is still at work when it is stopped."""

PATIENCE = 600
"""Seconds after which what has not come never will: the machine may be busy."""


class Page:
    """What the page does: it has a cookie, a tab's name, and says where it comes from."""

    def __init__(self, address, entry, studio):
        self.host = urlsplit(address).netloc
        self.entry, self.studio = entry, studio
        self.cookie, self.tab = "", "one"

    def ask(self, method, path, body=None, **headers):
        connection = http.client.HTTPConnection(self.host, timeout=PATIENCE)
        own = {"Origin": f"http://{self.host}", "X-Upholster": "studio"} if method == "POST" else {}
        own |= {"Cookie": self.cookie, "X-Tab": self.tab} | {
            name.replace("_", "-"): text for name, text in headers.items()
        }
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        with closing(connection):
            connection.request(method, path, data, {name: text for name, text in own.items() if text})
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()

    def answer(self, method, path, body=None, status=200, **headers):
        found, _, data = self.ask(method, path, body, **headers)
        assert found == status, data
        return json.loads(data) if data else None

    def enter(self):
        status, headers, _ = self.ask("POST", "/enter", {"token": self.entry.token})
        assert status == 204
        assert "HttpOnly" in headers["set-cookie"]
        assert "SameSite=strict" in headers["set-cookie"]
        self.cookie = headers["set-cookie"].split(";")[0]

    def looks(self, revision):
        """Return the streams of all looks, and the stages that were reported."""
        found, stages, after = [], [], 0
        while True:
            status, headers, data = self.ask("GET", f"/looks/{revision}?after={after}")
            if status == 202:
                stages.append(json.loads(data)["stage"])
            elif status == 200:
                after = int(headers["x-look"])
                found.append(_parted(data))
                if headers["x-final"] == "1":
                    return found, stages
            else:
                assert status == 204, data

    def shown(self, state):
        """Show a state; return the answer, and its looks."""
        answer = self.answer("POST", "/state", {"state": state})
        return answer, self.looks(answer["revision"])[0]


def _parted(data):
    count, at, streams = struct.unpack_from("<I", data)[0], 4, []
    for _ in range(count):
        length = struct.unpack_from("<I", data, at)[0]
        streams.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    assert at == len(data)
    return streams


@contextmanager
def opened(files=(), save_to=None, most_bytes=10**7):
    with closing(Studio(files, save_to, most_bytes)) as studio:
        app, entry = make_studio(studio)
        with serving(app) as address:
            yield Page(address, entry, studio)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with opened(save_to=str(tmp_path_factory.mktemp("kept"))) as found:
        found.enter()
        found.answer("GET", "/session")
        yield found


def test_a_page_gets_the_lists_of_directions_outputs_and_surfaces(page):
    given = page.answer("GET", "/session")
    assert given["directions"] == [[row.word, row.label] for row in DIRECTIONS]
    ways = {output["prefix"] + output["ending"]: output["title"] for output in given["outputs"]}
    assert ways["atlas:_texture.png"] == "Texture"
    assert [output["title"] for output in given["outputs"] if output["solid"]] == ["3MF"]
    assert {"torus", "plane"} <= {surface["name"] for surface in given["surfaces"]}


def _placements(stream):
    decoder = StreamDecoder()
    decoder.feed(stream)
    return decoder.quilt().placements


@pytest.mark.slow(reason="starts processes")
def test_what_is_shown_is_what_a_project_makes_and_what_is_saved(page, tmp_path):
    answer, looks = page.shown(STATE)
    project = Project(str(CHAIR), Sample(str(WEAVE), "60cm"), synthesis={"texels": 10_000}, seed=3)
    (quilt,) = project.quilts()
    np.testing.assert_array_equal(_placements(looks[-1][0]), quilt.placements)
    saved = page.answer(
        "POST", "/save", {"revision": answer["revision"], "targets": ["chair.glb", "chair.uph"]}
    )
    project.cover([str(tmp_path / "chair.glb"), str(tmp_path / "chair.uph")])
    for one in saved["files"]:
        status, headers, data = page.ask("GET", f"/saved/{saved['id']}/{one['name']}")
        assert (status, len(data)) == (200, one["bytes"])
        assert "attachment" in headers["content-disposition"]
        assert data == (tmp_path / one["name"]).read_bytes()
    assert looks[-1][0] == (tmp_path / "chair.uph").read_bytes()


@pytest.mark.slow(reason="starts processes")
def test_the_words_make_the_same(page, tmp_path, monkeypatch):
    state = STATE | {
        "sample": {"source": "included/weave.png", "crop": [0, 0, 120, 100], "even_light": True},
        "synthesis": {
            "texels": 10_000,
            "direction": "around:z",
            "mirror": True,
            "sample_size": "70cm",
            "guide": ["luminance=height", "luminance=slope@2"],
        },
        "writing": {"view": [10, 20], "texture": "png"},
        "reading": {"part": ["Seat", "Leg 1"]},
    }
    answer, _ = page.shown(state)
    saved = page.answer("POST", "/save", {"revision": answer["revision"], "targets": ["chair.glb"]})
    data = page.ask("GET", f"/saved/{saved['id']}/chair.glb")[2]
    for file in (WEAVE, CHAIR):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    words = shlex.split(answer["command"])
    assert words[:2] == ["upholster", "cover"]
    done = run_cli(*words[1:], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    made = tmp_path / "chair_weave.glb"
    assert made.read_bytes() == data
    made.unlink()
    monkeypatch.chdir(tmp_path)
    exec(answer["python"], {})
    assert made.read_bytes() == data


@pytest.mark.slow(reason="starts processes")
def test_a_photo_of_many_pixels_is_reduced_in_the_preview_and_in_the_command(page, tmp_path):
    photo = encode_image(np.kron(read_image(WEAVE), np.ones((8, 8, 1), np.uint8)), "png")
    path = page.answer("POST", "/blobs?name=photo.png", photo)["path"]
    synthesis = {"texels": 30_000}
    answer, looks = page.shown(STATE | {"sample": {"source": path}, "synthesis": synthesis})
    decoder = StreamDecoder()
    decoder.feed(looks[-1][0])
    (side,) = set(decoder.exemplar_shape[:2])
    assert 990 < side < 1033
    (note,) = answer["notes"]
    assert "photo.png has more pixels than the page can show" in note
    assert f"--resize {side}" in note
    saved = page.answer("POST", "/save", {"revision": answer["revision"], "targets": ["x.glb", "x.uph"]})
    data = page.ask("GET", f"/saved/{saved['id']}/x.glb")[2]
    (tmp_path / "photo.png").write_bytes(photo)
    done = run_cli(*shlex.split(answer["command"])[1:], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "chair_photo.glb").read_bytes() == data


def test_models_on_the_shelf_have_pictures(page, tmp_path):
    status, _, data = page.ask("GET", "/pictures/included/chair.glb?size=64")
    assert status == 200
    (tmp_path / "chair.png").write_bytes(data)
    shown = read_image(tmp_path / "chair.png")
    assert shown.shape == (48, 64, 3)
    assert shown[24, 32].mean() < shown[0, 0].mean() - 20  # the chair is darker than the background
    broken = page.answer("POST", "/blobs?name=broken.obj", b"f 1 2 3")["path"]
    assert page.ask("GET", f"/pictures/{broken}")[0] == 204


def test_words_name_only_files_that_the_user_has(page):
    folder = page.studio.folder.path

    def words_for(query, **more):
        photo = page.answer("POST", f"/blobs?{query}", WEAVE.read_bytes())["path"]
        project = project_of(STATE | {"sample": {"source": photo}} | more, folder)
        return command(project, folder), python(project, folder)

    shell, code = words_for("name=photo.png")
    assert shell == ("upholster cover photo.png --on sample:chair --texels 10000 --seed 3 -o chair_photo.glb")
    assert "'sample:chair'" in code
    for query in ("name=pasted.png&made=true", f"name={quote('pasted?.png')}"):
        shell, code = words_for(query)
        assert re.fullmatch(
            "upholster cover --project (chair_pasted.*).upholster.json -o (chair_pasted.*).glb", shell
        )
        assert "upholster.read_project('chair_pasted" in code
    # A part's own sample is a file and a size in a command, and no more.
    seat = {"materials": {"Seat": {"source": "included/weave.png", "size": "9cm"}}}
    assert "--material Seat=sample:weave@9cm" in words_for("name=photo.png", **seat)[0]
    seat["materials"]["Seat"]["resize"] = 64
    assert "--project" in words_for("name=photo.png", **seat)[0]
    # A relief is for files to print: without it, others are made.
    shell, code = words_for("name=photo.png", writing={"displace": "5mm", "displace_by": "luminance"})
    first, second = shell.split("\n")
    assert ("displace" in first, "--displace 5mm --displace-by luminance" in second) == (False, True)
    assert (first.endswith("chair_photo.glb"), second.endswith("chair_photo.3mf")) == (True, True)
    assert "project.change(displace=None, displace_by=None).cover(['chair_photo.glb'])" in code


def test_words_repeat_options_and_name_all_files_as_the_user_has_them(tmp_path):
    project = Project(
        str(tmp_path / "1/chair.glb"),
        Sample(str(tmp_path / "2/a.png"), options={"use": str(tmp_path / "3/mask.png")}),
        synthesis={
            "guide": (f"{tmp_path}/4/g.png={tmp_path}/5/t.png", "luminance=slope@2"),
            "again": ("part:Seat@2", f"{tmp_path}/6/r.png@3"),
            "stroke": (f"{tmp_path}/7/rows.json",),
            "direction": f"{tmp_path}/8/rows.png",
            "size_map": f"{tmp_path}/9/m.png=1,2",
        },
    )
    shell, code = command(project, tmp_path), python(project, tmp_path)
    for words in (
        "--use mask.png",
        "--guide g.png=t.png --guide luminance=slope@2",
        "--again part:Seat@2 --again r.png@3",
        "--stroke rows.json",
        "--direction rows.png",
        "--size-map m.png=",
    ):
        assert words in shell
    assert "'guide': ('g.png=t.png', 'luminance=slope@2')" in code
    assert str(tmp_path) not in shell + code


def test_a_state_without_model_or_sample_shows_nothing_and_is_kept(page):
    before = page.answer("POST", "/state", {"state": LONG | {"seed": 57}})["revision"]
    for state in ({"upholster": 1}, {k: v for k, v in STATE.items() if k != "sample"}):
        answer = page.answer("POST", "/state", {"state": state})
        assert answer == {"revision": answer["revision"]}
        assert page.ask("GET", f"/looks/{before}")[0] == 410
        assert page.ask("GET", f"/looks/{answer['revision']}")[0] == 410
        assert page.answer("GET", "/session")["state"] == state
    for depth in (3, {}):
        body = {"revision": answer["revision"], "targets": ["x.3mf"], "depth": depth}
        assert "depth" in page.answer("POST", "/save", body, status=422)["error"]


def test_an_earlier_state_gives_the_same_looks_again(page):
    _, first = page.shown(STATE)
    _, other = page.shown(STATE | {"seed": 4})
    _, again = page.shown(STATE)
    assert first[-1] == again[-1]
    assert first[-1] != other[-1]


def test_parts_have_samples_of_their_own_and_a_ray_finds_them(page):
    answer, looks = page.shown(STATE | {"materials": {"Seat": {"source": "included/bricks.png"}}})
    assert [len(streams) for streams in looks] == [2] * len(looks)
    facts = page.answer("GET", f"/facts/{answer['revision']}")
    assert [part["name"] for part in facts["parts"]][:2] == ["Seat", "Back"]
    assert facts["unit"] == "m"
    hit = page.answer("POST", "/pick", {"origin": [0, 0, 5], "direction": [0, 0, -1]})
    assert hit["part"] == "Seat"
    assert page.answer("POST", "/pick", {"origin": [0, 0, 5], "direction": [0, 0, 1]}) == {"part": None}
    for kind in KINDS:
        status, _, data = page.ask("GET", f"/overlays/{answer['revision']}?kind={kind}")
        assert status == 200
        assert np.isfinite(np.frombuffer(data, "<f4")).all()
        assert len(data) % 24 == 0
        assert data


def test_a_change_cancels_what_is_under_way(page):
    first = page.answer("POST", "/state", {"state": STATE | {"seed": 100}})["revision"]
    second = page.answer("POST", "/state", {"state": STATE | {"seed": 101}})["revision"]
    assert page.ask("GET", f"/looks/{first}")[0] == 410
    looks, _ = page.looks(second)
    assert looks


def test_files_come_in_and_lead_nowhere(page):
    answer = page.answer("POST", f"/blobs?name={quote('../../a b.png')}", WEAVE.read_bytes())
    assert answer["kind"] == "image"
    assert answer["path"] == f"{answer['group']}/a b.png"
    more = page.answer("POST", f"/blobs?name=x_normal.png&group={answer['group']}", WEAVE.read_bytes())
    assert more["group"] == answer["group"]
    inner = page.answer("POST", f"/blobs?name=a.heic&folder={quote('../Set//b/../c')}", b"x")
    assert inner == {"group": inner["group"], "path": f"{inner['group']}/Set/b/c/a.heic", "kind": "image"}
    found = page.answer("POST", "/sources", {"path": answer["path"]})
    assert (found["kind"], found["width"], found["height"]) == ("image", 256, 256)
    status, headers, data = page.ask("GET", f"/pictures/{quote(answer['path'])}?size=64")
    assert (status, headers["x-width"]) == (200, "256")
    assert data[:4] == b"\x89PNG"
    options = quote(json.dumps({"crop": [0, 0, 64, 32]}))
    status, headers, _ = page.ask("GET", f"/prepared/{quote(answer['path'])}?options={options}")
    assert (status, headers["x-width"], headers["x-height"]) == (200, "64", "32")
    headers = page.ask("GET", "/prepared/included/bricks.png")[1]
    element = find_lattice(read_exemplar(EXAMPLES / "bricks.png")).element
    assert [float(side) for side in headers["x-element"].split(",")] == pytest.approx(element, abs=0.01)
    for path in ("../secret", "/etc/passwd", "", "9999/x.png", "a\0b"):
        assert "error" in page.answer("POST", "/sources", {"path": path}, status=422)
    big = b"\0" * (10**7 + 1)
    assert "too large" in page.answer("POST", "/blobs?name=big.glb", big, status=413)["error"]
    assert (
        "too large"
        in page.answer("POST", "/blobs?name=big.glb", b"", status=413, Content_Length="99999999")["error"]
    )


@pytest.mark.parametrize(
    ("state", "says"),
    [
        (STATE | {"model": "/etc/passwd.glb"}, "refers to"),
        (STATE | {"model": "../x.glb"}, "refers to"),
        (STATE | {"sample": {"source": "9/x.png"}}, "9/x.png"),
        (STATE | {"colour": 3}, "colour"),
        (STATE | {"seed": -1}, "seed"),
        (STATE | {"synthesis": {"texels": "many"}}, "texels"),
        (STATE | {"synthesis": {"direction": "inward"}}, "direction"),
        ([], "object"),
        (None, "object"),
    ],
)
def test_a_state_that_is_wrong_is_one_line(page, state, says):
    status, _, data = page.ask("POST", "/state", {"state": state})
    if status == 200:  # it is found out when the model is read
        status, _, data = page.ask("GET", f"/looks/{json.loads(data)['revision']}")
        while status in (202, 204):
            status, _, data = page.ask("GET", f"/looks/{page.studio.worker.revision}")
    error = json.loads(data)["error"]
    assert status == 422
    assert says in error
    assert "\n" not in error
    assert str(page.studio.folder.path) not in error


def test_the_page_learns_which_names_are_maps(page):
    names = ["wall_diff_1k.png", "wall_arm.jpg", "T_Wall_N.tga", "IMG_2041.jpg", ""]
    assert page.answer("POST", "/roles", {"names": names}) == [True, True, True, False, False]


def test_what_is_no_request_of_the_page_is_one_line(page):
    for body in (b"{", b"[" * 100_000, b'{"state": NaN}', b"\xff", b'{"targets": [1]}'):
        assert "error" in page.answer("POST", "/state", body, status=422)
    for names in (b"{}", b'{"names": "a"}', b'{"names": [1]}'):
        assert "error" in page.answer("POST", "/roles", names, status=422)
    for target in ("../x.glb", "/tmp/x.glb", ".x.glb", "", "a\\b.glb", "x.doc"):
        body = {"revision": page.studio.worker.revision, "targets": [target]}
        assert "error" in page.answer("POST", "/save", body, status=422)
    assert page.ask("GET", "/saved/99/x.glb")[0] == 422
    assert page.ask("GET", "/saved/1/..%2f..%2fetc")[0] in (404, 422)
    assert page.ask("DELETE", "/session")[0] == 405


HALF, DEEP, LONG_NAME = '"\\ud800"', "[" * 3000 + "]" * 3000, json.dumps("a" * 5000)


def odd_requests(revision):
    """Yield paths and JSON texts."""
    big, saved = "9" * 400, '{"revision": %s, "targets": [%s]}'
    yield from (("/save", saved % (one, '"x.uph"')) for one in ("{}", "[]", "1.5", "null", big))
    yield from (("/save", saved % (revision, one)) for one in (LONG_NAME, HALF))
    yield from (("/enter", f'{{"token": {one}}}') for one in (HALF, DEEP))
    for one in (HALF, DEEP, LONG_NAME, "{}", big):
        yield from ((path, f'{{"path": {one}}}') for path in ("/sources", "/hints"))
        yield "/pick", f'{{"origin": [0, 0, {one}], "direction": [0, 0, 1]}}'
        yield "/keep", f'{{"id": {one}}}'
        for state in ("@", STATE | {"synthesis": {"direction": "@"}}, STATE | {"sample": {"size": "@"}}):
            yield "/state", json.dumps({"state": state}).replace('"@"', one)


def test_what_no_page_sends_is_refused_in_one_line(page):
    revision = page.shown(STATE)[0]["revision"]
    for path, body in odd_requests(revision):
        status, _, data = page.ask("POST", path, body.encode())
        later = [200] if path == "/state" else []  # it is found out when the model is read
        assert status in (403, 422, *later), (path, body[:90], data)
        assert "internal" not in json.loads(data).get("error", ""), (path, body[:90])
    zeros, name = "0" * 5000, "a" * 5000
    paths = [f"/looks/{zeros}", f"/looks/{revision}?after={zeros}", f"/facts/{zeros}", f"/saved/{zeros}.zip"]
    paths += [f"/pictures/{name}", f"/saved/1/{name}"]
    options = (DEEP[2000:4000], '{"crop": 1e999}')
    paths += [f"/prepared/included/weave.png?options={quote(one)}" for one in options]
    for path in paths:
        status, _, data = page.ask("GET", path)
        assert status == 422, (path[:90], data)
        assert json.loads(data)["error"]


def test_halves_of_characters_come_back_as_they_are(page):
    materials = {"\ud800": {"source": "included/bricks.png"}}
    answer = page.answer("POST", "/state", {"state": STATE | {"materials": materials}})
    assert "\ud800" in answer["command"]


def test_two_studios_in_one_browser_have_cookies_of_their_own(page):
    with opened() as other:
        other.enter()
        both = f"{page.cookie}; {other.cookie}"
        assert page.cookie.split("=")[0] != other.cookie.split("=")[0]
        for one in (page, other):
            one.answer("GET", "/session", Cookie=both)


def test_a_strangers_page_gets_nothing(page):
    routes = [
        ("GET", "/session"),
        ("GET", "/looks/1"),
        ("GET", "/pictures/included/weave.png"),
        ("GET", "/facts/1"),
    ]
    routes += [
        ("POST", path)
        for path in (
            "/state",
            "/blobs?name=x",
            "/roles",
            "/sources",
            "/hints",
            "/pick",
            "/save",
            "/keep",
            "/take",
        )
    ]
    for method, path in routes:
        assert page.ask(method, path, b"{}", Cookie="upholster-studio=x")[0] == 401
        assert page.ask(method, path, b"{}", Host="evil.example")[0] == 400
        if method == "POST":
            assert page.ask(method, path, b"{}", Origin="http://evil.example")[0] == 403
            assert page.ask(method, path, b"{}", Origin="null")[0] == 403
            assert page.ask(method, path, b"{}", X_Upholster="")[0] == 403
    assert page.ask("POST", "/enter", {"token": "guess"})[0] == 403
    assert page.ask("POST", "/enter", b"x" * 10_000)[0] == 422
    status, headers, data = page.ask("GET", "/", Cookie="")
    assert status == 200
    assert b"studio.js" in data
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "frame-ancestors 'none'" in headers["content-security-policy"]


def test_one_tab_has_the_session_until_another_takes_it(page):
    page.tab = "two"
    try:
        assert "another tab" in page.answer("GET", "/session", status=409)["error"]
        page.answer("POST", "/take", {})
        page.answer("GET", "/session")
        page.tab = "one"
        assert page.ask("POST", "/state", {"state": STATE})[0] == 409
    finally:
        page.tab = "one"
        page.answer("POST", "/take", {})


def test_what_was_shown_is_saved_after_a_change_that_fails(page):
    answer, looks = page.shown(STATE)
    assert "error" in page.answer("POST", "/state", {"state": STATE | {"seed": -1}}, status=422)
    saved = page.answer("POST", "/save", {"revision": answer["revision"], "targets": ["x.uph"]})
    assert page.ask("GET", f"/saved/{saved['id']}/x.uph")[2] == looks[-1][0]
    # Another save may be making a folder of any other name at the same time.
    (page.studio.folder.path / "saved" / "unfinished").mkdir()
    body = {"revision": answer["revision"], "targets": ["x.uph"]}
    numbers = [page.answer("POST", "/save", body)["id"] for _ in range(2)]
    (page.studio.folder.path / "saved" / "unfinished").rmdir()
    assert [*numbers, page.answer("POST", "/save", body)["id"]] == [saved["id"] + n for n in (1, 2, 3)]
    body = {"revision": answer["revision"] + 1, "targets": ["x.uph"]}
    assert "changed" in page.answer("POST", "/save", body, status=422)["error"]


def test_hints_say_what_would_help_a_photo(page):
    found = page.answer("POST", "/hints", {"path": "included/weave.png"})
    assert (found["corners"], found["light"] < found["uneven"]) == (None, True)
    photo = read_exemplar(WEAVE)
    shaded = (photo * np.linspace(1, 0.6, photo.shape[1])[None, :, None]).astype(np.uint8)
    seen = Rectification(((0, 0), (256, 40), (256, 216), (0, 256)), 256, 256).apply(shaded)
    path = page.answer("POST", "/blobs?name=x.png", encode_image(from_linear(seen, "uint8"), "png"))["path"]
    found = page.answer("POST", "/hints", {"path": path})
    assert np.shape(found["corners"]) == (4, 2)
    assert found["light"] > found["uneven"]
    assert "error" in page.answer("POST", "/hints", {"path": "../x.png"}, status=422)


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform == "win32", reason="stops a process")
def test_a_worker_that_says_nothing_for_long_is_ended(page, monkeypatch):
    revision = page.answer("POST", "/state", {"state": LONG | {"seed": 56}})["revision"]
    os.kill(page.studio.worker._process.pid, signal.SIGSTOP)
    monkeypatch.setattr(studio_routes, "_SILENT", 0.5)
    monkeypatch.setattr(studio_routes, "_WAIT", 0.6)
    status, _, data = 204, {}, b""
    until = time.monotonic() + PATIENCE
    while status in (202, 204) and time.monotonic() < until:
        status, _, data = page.ask("GET", f"/looks/{revision}?after=9")
    assert status == 422
    assert "time" in json.loads(data)["error"]
    monkeypatch.undo()
    assert page.shown(STATE)[1]


def test_files_are_kept_and_not_written_over_unasked(page):
    answer, _ = page.shown(STATE)
    saved = page.answer("POST", "/save", {"revision": answer["revision"], "targets": ["x.uph", "project"]})
    names = sorted(one["name"] for one in saved["files"])
    assert names == ["chair_weave.zip", "x.uph"]
    assert page.answer("POST", "/keep", {"id": saved["id"]})["files"]
    assert "replace" in page.answer("POST", "/keep", {"id": saved["id"]}, status=422)["error"]
    page.answer("POST", "/keep", {"id": saved["id"], "over": True})
    kept = page.studio.save_to
    with zipfile.ZipFile(kept / "chair_weave.zip") as file:
        file.extractall(kept / "own")
    assert read_project(kept / "own" / "chair_weave.upholster.json").seed == 3
    # The zip comes back as a project.
    answer = page.answer("POST", "/blobs?name=chair.zip", (kept / "chair_weave.zip").read_bytes())
    assert answer["kind"] == "project"
    state = page.answer("POST", "/sources", {"path": answer["path"]})["state"]
    assert page.shown(state)[1]
    status, _, data = page.ask("GET", f"/saved/{saved['id']}.zip")
    assert status == 200
    assert data[:2] == b"PK"


@pytest.mark.skipif(sys.platform == "win32", reason="kills a process")
def test_a_worker_that_dies_is_reported_and_another_goes_on(page):
    revision = page.answer("POST", "/state", {"state": LONG | {"seed": 55}})["revision"]
    os.kill(page.studio.worker._process.pid, signal.SIGKILL)
    status, _, data = 204, {}, b""
    until = time.monotonic() + PATIENCE
    while status in (202, 204) and time.monotonic() < until:
        status, _, data = page.ask("GET", f"/looks/{revision}?after=9")
    assert status == 422
    assert "worker" in json.loads(data)["error"]
    assert page.shown(STATE)[1]


def test_files_are_given_at_start_and_the_folder_goes(tmp_path):
    with opened([str(WEAVE), str(CHAIR)]) as page:
        folder = page.studio.folder.path
        assert folder.stat().st_mode & 0o777 == 0o700
        page.enter()
        state = page.answer("GET", "/session")["state"]
        assert (state["model"], state["sample"]) == ("2/chair.glb", {"source": "1/weave.png"})
    assert not folder.exists()
    (tmp_path / "text.png").write_text("no image")
    for wrong in ("nothing.glb", str(Path(__file__)), str(tmp_path / "text.png")):
        with pytest.raises(InputError):
            Studio([wrong], None, 10**7)
    with pytest.raises(InputError, match="save-to"):
        Studio([], str(tmp_path / "none"), 10**7)
