"""The studio in Chromium when something is wrong, odd or unfinished: nothing vanishes or is left over."""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import BRICKS, ROOT, wait_until
from gltf_models import BOX, BOX_TRIANGLES
from hand import Hand, hand_at

from upholster.image.files.write import write_image

pytestmark = pytest.mark.browser

WEAVE = ROOT / "examples" / "weave.png"

FOLDER = """([folder, files]) => {
  const named = (path) => ({ name: path.split('/').at(-1), fullPath: `/${path}` })
  const file = (path, text) => {
    const bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0))
    const { name } = named(path)
    return { ...named(path), isDirectory: false, file: (done) => done(new File([bytes], name)) }
  }
  const inside = (path) => {
    const own = files.filter(([name]) => name.startsWith(`${path}/`))
    const below = own.map(([name, text]) => [name.slice(path.length + 1).split('/'), name, text])
    const folders = [...new Set(below.filter(([rest]) => rest.length > 1).map(([[name]]) => name))]
    const entries = below.filter(([rest]) => rest.length === 1).map(([, name, text]) => file(name, text))
    return [...entries, ...folders.map((name) => directory(`${path}/${name}`))]
  }
  const directory = (path) => {
    const left = [inside(path), []]
    const createReader = () => ({ readEntries: (done) => done(left.shift()) })
    return { ...named(path), isDirectory: true, createReader }
  }
  const item = { kind: 'file', webkitGetAsEntry: () => directory(folder), getAsFile: () => null }
  const dataTransfer = { types: ['Files'], items: [item] }
  const drop = new Event('drop', { bubbles: true, cancelable: true })
  document.body.dispatchEvent(Object.assign(drop, { dataTransfer }))
}"""
"""Drops a folder: scripts can make none, so it is one by its interface."""

PROGRESS = """() => {
  const chip = document.getElementById('light')
  const save = document.querySelector('#bar .main')
  globalThis.seen = { numbers: [], enabled: [] }
  new MutationObserver(() => {
    const found = /([0-9]+) %/.exec(chip.textContent)
    if (found) seen.numbers.push(Number(found[1]))
  }).observe(chip, { childList: true, characterData: true, subtree: true })
  const note = () => save.disabled || seen.enabled.push(chip.textContent)
  new MutationObserver(note).observe(save, { attributes: true })
}"""
"""Notes the numbers that the page shows, and what it says when *Save* gets enabled."""

CORNER = "const { origin, direction } = viewer.ray(7, 9); return [...origin, ...direction]"
"""Where the camera is, in the model's own units."""

TRIANGLES = "return viewer.model.geometries.reduce((sum, { indices }) => sum + indices.length / 3, 0)"


def box(*names: str, image: str = "own.png") -> list[tuple[str, bytes]]:
    """A .gltf file of boxes with names, its triangles in another file, and a picture that it uses."""
    places, faces = BOX.astype("<f4"), BOX_TRIANGLES.astype("<u2")
    data = places.tobytes() + faces.tobytes()
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "box.bin", "byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": places.nbytes},
            {"buffer": 0, "byteOffset": places.nbytes, "byteLength": 72},
        ],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 1],
            },
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "images": [{"uri": image}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [primitive]}] * len(names),
        "nodes": [
            {"mesh": n, "name": name, "translation": [0, 1.5 * n, 0]} for n, name in enumerate(names)
        ],
        "scenes": [{"nodes": list(range(len(names)))}],
        "scene": 0,
    }  # fmt: skip
    return [
        ("box.gltf", json.dumps(document).encode()),
        ("box.bin", data),
        (image, BRICKS.read_bytes()),
    ]


@pytest.fixture
def hand(tab: Any) -> Iterator[Hand]:
    with hand_at(tab) as found:
        yield found


def test_all_that_is_dropped_with_a_gltf_is_shown_or_named(hand: Hand) -> None:
    hand.drop_together(
        *box("Box"), ("photo.png", WEAVE.read_bytes()), ("notes.txt", b"a"), ("more.txt", b"b")
    )
    assert hand.message("notes") == "notes.txt, more.txt are no image, material, model or project"
    hand.final()
    assert (hand.state["model"], hand.state["sample"]) == ("1/box.gltf", {"source": "1/photo.png"})
    assert hand.page.get_by_role("button", name="own").count() == 0  # the model's own


def test_a_model_without_its_file_is_named_and_no_step(hand: Hand) -> None:
    hand.drop_together(("photo.png", WEAVE.read_bytes()))
    hand.page.wait_for_function("() => sessionStorage.history.includes('photo')")
    before = hand.states
    hand.drop_together(box("Box")[0])
    assert "box.bin" in hand.message("box.bin")
    assert hand.states == before
    assert hand.page.locator("#welcome").inner_text().startswith("Now drop or choose a model")
    hand.refused()


def test_a_folder_is_dropped_with_its_folders(hand: Hand) -> None:
    files = [
        *(("set/" + name, data) for name, data in box("Box", image="textures/own.png")),
        ("set/photo.png", WEAVE.read_bytes()),
        ("set/.hidden", b"x"),
    ]
    hand.page.evaluate(FOLDER, ["set", [[path, base64.b64encode(data).decode()] for path, data in files]])
    hand.final()
    assert (hand.state["model"], hand.state["sample"]) == (
        "1/set/box.gltf",
        {"source": "1/set/photo.png"},
    )
    assert hand.page.locator("#message").is_hidden()


def test_values_that_are_refused_are_no_steps_of_the_history(hand: Hand) -> None:
    page = hand.page
    page.get_by_title("granite").click()
    page.get_by_label("Built-in surfaces").select_option("torus")
    hand.final()
    for summary in page.locator("#panel summary", has_text="More").all():
        summary.click()
    before = hand.states
    # The server refuses the first two at once, and the last one when it looks for elements in the sample.
    for label, text, says in (
        ("Block", "abc", "block is 'abc'"),
        ("Seed", "abc", "seed is 'abc'"),
        ("Size of an element", "21cm", "repeat"),
    ):
        control = page.get_by_label(label, exact=True)
        shown = control.input_value()
        control.fill(text)
        control.press("Enter")
        hand.message(says)
        assert hand.states == before
        assert control.input_value() == shown
        hand.final()
        assert hand.button("Save").is_enabled()
        assert not hand.button("Redo").is_enabled()
        assert says in hand.message(says)  # it stays until something is changed
    page.get_by_label("Mirror").check()
    assert page.locator("#message").is_hidden()
    hand.refused()


def test_undo_goes_back_to_an_empty_page(hand: Hand) -> None:
    page = hand.page
    page.get_by_title("weave").click()
    page.get_by_label("Built-in surfaces").select_option("torus")
    page.wait_for_function("() => document.getElementById('light').classList.contains('busy')")
    while hand.button("Undo").is_enabled():
        hand.button("Undo").click()
    page.wait_for_function("() => !document.getElementById('light').textContent")
    assert page.locator("#welcome").is_visible()
    assert hand.tab.call("return viewer.model") is None
    assert hand.button("Save").is_disabled()
    # A sample by itself stays, too, if the page is loaded again.
    while not hand.state["sample"]:
        hand.button("Redo").click()
    wait_until(page, lambda: hand.studio.state == hand.state)
    page.reload()
    page.wait_for_selector("#panel h2")
    assert hand.state["sample"] == {"source": "included/weave.png"}
    hand.button("Redo").click()
    hand.final()
    assert page.locator("#welcome").is_hidden()


def test_progress_only_grows_and_a_model_is_saved_when_it_is_final(hand: Hand) -> None:
    page = hand.page
    page.get_by_title("weave").click()
    page.evaluate(PROGRESS)
    page.get_by_title("chair").click()
    hand.final()
    seen = page.evaluate("seen")
    assert len(set(seen["numbers"])) > 1
    assert seen["numbers"] == sorted(seen["numbers"])
    page.wait_for_function("() => seen.enabled.length")
    assert set(page.evaluate("seen.enabled")) == {""}


def test_a_file_for_printers_has_a_depth_or_says_that_it_is_flat(hand: Hand, tmp_path: Path) -> None:
    page = hand.page
    waves = np.cos(np.linspace(0, 2 * np.pi, 48))[:, None, None] * [60, 50, 40] + 128
    write_image(tmp_path / "waves.png", np.broadcast_to(waves, (48, 48, 3)).astype(np.uint8))
    hand.drop_together(*box("Box"), ("waves.png", (tmp_path / "waves.png").read_bytes()))
    hand.final()
    hand.button("Save").click()
    row = page.locator("tr", has_text="3MF")
    depth = page.get_by_label("Depth of the relief")
    assert depth.input_value().endswith("m")  # a length with a unit
    assert "--displace-by luminance" in row.inner_text()
    sizes = []
    for text, says in ((None, "Bright is high"), ("", "Flat"), ("abc", "displace is 'abc'")):
        if text is not None:
            depth.fill(text)
            depth.press("Enter")
        assert says in row.inner_text() or text
        row.locator("a, .wrong").wait_for()
        sizes.append(row.locator(".number").inner_text())
        if text == "abc":
            assert says in row.locator(".wrong").inner_text()
    assert sizes[0] != sizes[1] != ""
    page.get_by_text("The same as a command").click()
    assert page.get_by_label("The same as a command").input_value() == (
        "upholster cover waves.png --on box.gltf --texels 250000 -o box_waves.glb"
    )
    page.wait_for_function(
        "() => [...document.querySelectorAll('td.number')].every((one) => one.textContent !== '…')"
    )
    hand.button("Close").click()
    hand.refused()


def test_the_camera_stays_and_unchecked_parts_stay(hand: Hand) -> None:
    page = hand.page
    page.get_by_title("weave").click()
    page.get_by_title("chair").click()
    hand.final()
    at = page.locator("upholster-viewer").bounding_box()
    page.mouse.move(at["x"] + 80, at["y"] + 80)
    page.mouse.down()
    page.mouse.move(at["x"] + 120, at["y"] + 90, steps=3)
    page.mouse.up()
    page.mouse.wheel(0, -300)
    hand.tab.frames()
    camera, triangles = hand.tab.call(CORNER), hand.tab.call(TRIANGLES)
    page.get_by_label("Sample of Seat").select_option(label="bricks.png")
    hand.final()
    assert hand.tab.call(CORNER) == pytest.approx(camera, rel=1e-6, abs=1e-6)
    page.get_by_label("Cover Leg 1").uncheck()
    hand.final()
    assert hand.tab.call(CORNER) == pytest.approx(camera, rel=1e-6, abs=1e-6)
    assert hand.tab.call(TRIANGLES) == triangles


def test_names_of_parts_are_cut_where_they_are_alike(hand: Hand) -> None:
    names = [f"Assembly of the chair, version 12, final: leg {n} of four" for n in (1, 2)]
    hand.drop_together(*box(*names), ("photo.png", WEAVE.read_bytes()))
    hand.page.wait_for_selector(".parts li")
    for name, part in zip(names, hand.page.locator(".parts .name").all(), strict=True):
        assert part.text_content() == name
        end = part.locator("span").last
        assert f"{names.index(name) + 1} of four" in end.inner_text()
        inside = "(one) => one.getBoundingClientRect().right <= one.parentNode.getBoundingClientRect().right"
        assert end.evaluate(inside)
        assert end.evaluate("(one) => one.scrollWidth <= one.clientWidth + 1 && one.clientWidth > 0")


def test_what_fails_inside_is_said_and_leaves_no_blank_page(hand: Hand, monkeypatch: Any) -> None:
    page = hand.page

    async def broken(_state: Any) -> Any:
        raise RuntimeError("a fault")

    page.get_by_title("weave").click()
    page.wait_for_function("() => sessionStorage.history.includes('weave')")
    with monkeypatch.context() as patch:
        patch.setattr(hand.studio.worker, "change", broken)
        page.get_by_label("Built-in surfaces").select_option("torus")
        assert "see the terminal" in hand.message("internal error")
    assert page.locator("#welcome").is_visible()
    page.route("**/session", lambda route: route.fulfill(status=500, body="Internal Server Error"))
    page.reload()
    hand.message("internal error")
    assert page.get_by_role("heading", name="The studio can not begin").is_visible()
    page.unroute("**/session")
    hand.button("Try again").click()
    page.wait_for_selector("#panel h2")
    page.evaluate("() => void Promise.reject(new Error('a fault of the page'))")
    hand.message("a fault of the page")
    hand.tab.problems.clear()
