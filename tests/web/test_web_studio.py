"""The studio in Chromium, as a person uses it: drop, set, undo, save, reload."""

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import BRICKS, ROOT
from hand import Hand, hand_at

from upholster import Project, Sample, read_exemplar
from upholster.image.color import from_linear
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.image.photo.perspective import proposed_corners
from upholster.image.photo.rectify import Rectification

pytestmark = pytest.mark.browser

CHAIR, WEAVE = ROOT / "examples" / "chair.glb", ROOT / "examples" / "weave.png"


@pytest.fixture
def hand(tab: Any) -> Iterator[Hand]:
    with hand_at(tab) as found:
        yield found


def test_a_person_drops_sets_undoes_saves_and_finds_it_again(hand: Hand, tmp_path: Path) -> None:
    page = hand.page
    hand.drop(WEAVE, CHAIR)
    hand.final()
    assert page.locator("#welcome").is_hidden()
    view = page.evaluate("() => document.querySelector('upholster-viewer').view")
    for _ in range(3):
        hand.button("Again").click()
    page.get_by_label("Width of the sample").last.fill("60cm")
    page.keyboard.press("Enter")
    hand.final()
    assert (hand.state["seed"], hand.state["sample"]["size"]) == (3, "60cm")
    assert page.evaluate("() => document.querySelector('upholster-viewer').view") == view
    hand.button("Undo").click()
    assert "size" not in hand.state["sample"]
    page.keyboard.press("Control+y")
    hand.final()

    hand.button("Save").click()
    row = page.locator("tr", has_text="GLB")
    with page.expect_download() as waiting:
        row.get_by_role("link", name="Save").click()
    waiting.value.save_as(tmp_path / "saved.glb")
    project = Project(str(CHAIR), Sample(str(WEAVE), "60cm"), synthesis={"texels": 250_000}, seed=3)
    project.cover([str(tmp_path / "made.glb")])
    assert (tmp_path / "saved.glb").read_bytes() == (tmp_path / "made.glb").read_bytes()
    with page.expect_download() as waiting:
        page.locator("tr", has_text="Project").get_by_role("link", name="Save").click()
    waiting.value.save_as(tmp_path / "project.zip")
    with zipfile.ZipFile(tmp_path / "project.zip") as file:
        assert {"chair_weave.upholster.json", "chair.glb", "weave.png"} == set(file.namelist())
    hand.button("Close").click()

    page.reload()
    hand.final()
    assert hand.state["seed"] == 3
    assert hand.button("Undo").is_enabled()


def test_a_photo_of_many_pixels_is_shown_with_a_note_and_models_have_pictures(
    hand: Hand, tmp_path: Path
) -> None:
    page = hand.page
    tile = page.get_by_title("chair").evaluate("(one) => one.style.backgroundImage")
    assert tile.startswith('url("/pictures/included/chair.glb')
    note = page.locator("#panel > .note")
    assert note.is_hidden()
    write_image(tmp_path / "photo.png", np.kron(read_image(WEAVE), np.ones((8, 8, 1), np.uint8)))
    hand.drop(tmp_path / "photo.png")
    page.get_by_title("chair").click()
    hand.final()
    assert note.inner_text().startswith("Note: photo.png has more pixels than the page can show")
    page.get_by_title("weave").click()
    hand.final()
    assert note.is_hidden()


def test_parts_are_chosen_on_the_model_and_have_their_own_samples(hand: Hand) -> None:
    page = hand.page
    page.get_by_title("weave").click()
    page.get_by_title("chair").click()
    hand.final()
    box = page.locator("upholster-viewer").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 0.45 * box["height"])
    page.wait_for_selector(".parts .chosen")
    assert page.locator(".parts .chosen").inner_text().split("\n")[0] in ("Seat", "Back")
    page.get_by_label("Sample of Seat").select_option(label="bricks.png")
    hand.final()
    assert hand.state["materials"] == {"Seat": {"source": "included/bricks.png"}}
    assert page.evaluate("() => document.querySelector('upholster-viewer').model.parts.length") == 2
    page.get_by_label("Cover Leg 1").uncheck()
    assert "Leg 1" not in hand.state["reading"]["part"]


def test_twenty_changes_in_a_row_end_at_the_last(hand: Hand) -> None:
    page = hand.page
    hand.drop(WEAVE)
    page.get_by_label("Built-in surfaces").select_option("torus")
    hand.final()
    for _ in range(20):
        hand.button("Again").click()
        page.wait_for_timeout(30)
    page.wait_for_function("() => document.body.dataset.look === 'final'")
    assert hand.state["seed"] == 20
    for _ in range(12):
        page.keyboard.press("Control+z")
    hand.page.wait_for_function("() => !document.getElementById('light').textContent")
    assert hand.state["seed"] == 8


def test_the_sample_table_makes_a_sample_of_a_photo(hand: Hand) -> None:
    page = hand.page
    hand.drop(BRICKS)
    hand.button("Prepare the sample …").click()
    page.get_by_label("A part").check()
    handle = page.get_by_label("Bottom right of the part")
    box = handle.bounding_box()
    page.mouse.move(box["x"] + 11, box["y"] + 11)
    page.mouse.down()
    page.mouse.move(box["x"] - 30, box["y"] - 15, steps=3)
    page.mouse.up()
    handle.press("ArrowLeft")
    page.get_by_label("Length of what the line crosses").fill("21cm")
    page.wait_for_function("() => document.querySelector('#dialog .value').textContent.includes('wide')")
    hand.button("Use it").click()
    page.wait_for_function("() => !document.getElementById('dialog').open")
    sample = hand.state["sample"]
    left, top, width, height = sample["crop"]
    assert 0 < left < 256
    assert width < height < 256 - top
    # The line lies along one brick: that is 21 cm wide then.
    lattice = find_lattice(read_exemplar(BRICKS, crop=(left, top, width, height)))
    assert lattice is not None
    assert float(sample["size"].removesuffix("cm")) == pytest.approx(
        21 * width / lattice.element[0], rel=0.01
    )


def test_corners_are_proposed_on_a_photo_that_was_taken_at_an_angle(hand: Hand, tmp_path: Path) -> None:
    page = hand.page
    seen = Rectification(((0, 0), (256, 40), (256, 216), (0, 256)), 256, 256).apply(read_exemplar(WEAVE))
    write_image(tmp_path / "angle.png", from_linear(seen, "uint8"))
    hand.drop(tmp_path / "angle.png")
    hand.button("Prepare the sample …").click()
    hand.button("Use four corners").click()
    assert page.get_by_label("Four corners").is_checked()
    hand.button("Use it").click()
    page.wait_for_function("() => !document.getElementById('dialog').open")
    proposed = proposed_corners(read_exemplar(tmp_path / "angle.png"))
    assert hand.state["sample"]["rectify"] == [[pytest.approx(x, abs=0.06) for x in one] for one in proposed]


def test_what_is_wrong_is_reported_in_one_line(hand: Hand) -> None:
    hand.drop_together(("words.txt", b"no image"))
    hand.message("words.txt is not an image")
    hand.drop_together(("big.glb", b"\0" * (10**7 + 1)))
    hand.message("too large")
    (reported,) = hand.tab.problems
    assert "413" in reported
    hand.tab.problems.clear()


def test_two_variants_lie_under_a_slider(hand: Hand) -> None:
    page = hand.page
    hand.drop(WEAVE)
    page.get_by_label("Built-in surfaces").select_option("torus")
    hand.final()
    hand.button("Keep this to compare").click()
    page.get_by_title("granite").click()
    hand.final()
    line = page.locator(".wipe")
    pictures = []
    for share in ("0", "1"):
        line.evaluate("(one, share) => { one.value = share; one.dispatchEvent(new Event('input')) }", share)
        text = page.evaluate(
            "async () => Array.from(new Uint8Array(await (await "
            "document.querySelector('upholster-viewer').picture()).arrayBuffer())).join()"
        )
        pictures.append(text)
    assert pictures[0] != pictures[1]
