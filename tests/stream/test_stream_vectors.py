"""Frozen streams decode as they always did, at every length that their files name."""

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from make_vectors import hashes, images_at

from upholster.codec.ezw import decode
from upholster.codec.stream.reader import StreamDecoder, read_stream
from upholster.image.files.read import read_image

VECTORS = sorted((Path(__file__).parents[1] / "vectors").glob("*.uph"))


IMAGES = sorted((Path(__file__).parents[1] / "vectors").glob("*.ezw"))


def test_there_are_vectors() -> None:
    assert len(VECTORS) >= 13
    assert len(IMAGES) >= 4


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_an_image_decodes_as_frozen(path: Any) -> None:
    data = path.read_bytes()
    assert images_at(data) == json.loads(path.with_suffix(".json").read_text())


@pytest.mark.parametrize("path", VECTORS, ids=lambda path: path.stem)
def test_a_vector_decodes_as_frozen(path: Any) -> None:
    data = path.read_bytes()
    expected = json.loads(path.with_suffix(".json").read_text())
    read_stream(data)
    decoder = StreamDecoder()
    for length, wanted in expected.items():
        decoder.feed(data[decoder.received : int(length)])
        assert hashes(decoder) == wanted


@pytest.mark.parametrize("name", ["smallest.uph", "colour8.ezw"])
def test_the_worked_examples_of_the_specification_are_vectors(name: str) -> None:
    text = (Path(__file__).parents[2] / "SPEC.md").read_text(encoding="utf-8")
    data = (Path(__file__).parents[1] / "vectors" / name).read_bytes().hex(" ")
    shown = text[text.index("## 11. Examples") :].partition(name)[2].partition("\n**")[0]
    lines = [line.strip() for line in shown.splitlines() if line.startswith("    ")]
    bytes_of = [re.match(r"(?:[0-9a-f]{2} )*[0-9a-f]{2}(?= {2,}|$)", line) for line in lines]
    assert " ".join(found[0] for found in bytes_of if found) == data


def test_the_image_of_the_specification_is_its_picture() -> None:
    folder = Path(__file__).parents[1] / "vectors"
    image = decode((folder / "colour8.ezw").read_bytes()).image
    np.testing.assert_array_equal(image, read_image(folder / "colour8.png"))


def test_every_vector_is_described() -> None:
    folder = Path(__file__).parents[1] / "vectors"
    text = (folder / "README.md").read_text(encoding="utf-8")
    described = set(re.findall(r"^\| `(\S+\.(?:uph|ezw))`", text, re.MULTILINE))
    found = [path.relative_to(folder).as_posix() for path in folder.rglob("*.*")]
    assert described == {name for name in found if name.endswith((".uph", ".ezw"))}
