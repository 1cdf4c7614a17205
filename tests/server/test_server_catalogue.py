"""What is served: names, and nothing behind them."""

import os
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.apps.server import Catalogue
from upholster.base.errors import FormatError, InputError

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX file systems")


def names(*paths):
    return [entry.name for entry in Catalogue([str(path) for path in paths]).entries()]


def test_a_folder_holds_its_streams_and_nothing_else(folder):
    (folder / ".hidden.uph").write_bytes(b"x")
    (folder / ".uph").write_bytes(b"x")
    (folder / "notes.txt").write_bytes(b"x")
    (folder / "inner.uph").mkdir()
    (folder / "inner.uph" / "deep.uph").write_bytes(b"x")
    (folder / "UPPER.UPH").write_bytes(b"x")
    catalogue = Catalogue([str(folder)])
    assert [entry.name for entry in catalogue.entries()] == ["quilt.uph", "smallest.uph", "UPPER.UPH"]
    assert catalogue.entries()[1].size == (folder / "smallest.uph").stat().st_size
    for name in (".hidden.uph", ".uph", "notes.txt", "inner.uph", "inner.uph/deep.uph", "", ".", ".."):
        assert catalogue.find(name) is None
    with open(catalogue.find("quilt.uph")[0], "rb") as file:
        assert file.read() == (folder / "quilt.uph").read_bytes()


def test_new_files_appear_and_deleted_ones_go(folder):
    catalogue = Catalogue([str(folder)])
    assert catalogue.find("new.uph") is None
    (folder / "new.uph").write_bytes(b"x")
    assert "new.uph" in [entry.name for entry in catalogue.entries()]
    assert catalogue.find("new.uph")
    (folder / "new.uph").unlink()
    assert catalogue.find("new.uph") is None
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    assert catalogue.entries() == []


def test_files_of_one_name_are_distinguished(folder, tmp_path):
    other = tmp_path / "other" / "given"
    other.mkdir(parents=True)
    stream = (folder / "quilt.uph").read_bytes()
    (other / "quilt.uph").write_bytes(stream[:5000])
    one, two = folder / "quilt.uph", other / "quilt.uph"
    own = tmp_path.name
    assert names(one) == ["quilt.uph"]
    assert names(one, one, folder / ".." / "given" / "quilt.uph") == ["quilt.uph"]
    assert names(one, two) == [f"{own}/given/quilt.uph", "other/given/quilt.uph"]
    assert names(two, folder) == ["quilt.uph", "given/quilt.uph", "given/smallest.uph"]
    assert names(folder, other) == [
        f"{own}/given/quilt.uph",
        f"{own}/given/smallest.uph",
        "other/given/quilt.uph",
    ]
    # What is given by name is not listed a second time with its folder.
    assert names(folder, one) == ["given/smallest.uph", "quilt.uph"]
    catalogue = Catalogue([str(one), str(two)])
    for name, path in ((f"{own}/given/quilt.uph", one), ("other/given/quilt.uph", two)):
        with open(catalogue.find(name)[0], "rb") as file:
            assert file.read() == path.read_bytes()


@POSIX
def test_links_out_of_a_folder_are_refused(folder, tmp_path):
    (folder / "out.uph").symlink_to(tmp_path / "secret.uph")
    (folder / "up.uph").symlink_to("../secret.uph")
    (folder / "twice.uph").symlink_to("out.uph")
    (folder / "gone.uph").symlink_to("nowhere.uph")
    (folder / "loop.uph").symlink_to("loop.uph")
    (folder / "notes.txt").write_bytes(b"notes")
    (folder / "notes.uph").symlink_to("notes.txt")
    (folder / "beside.uph").symlink_to("quilt.uph")
    catalogue = Catalogue([str(folder)])
    assert [entry.name for entry in catalogue.entries()] == ["beside.uph", "quilt.uph", "smallest.uph"]
    for name in ("out.uph", "up.uph", "twice.uph", "gone.uph", "loop.uph", "notes.uph"):
        assert catalogue.find(name) is None
    assert catalogue.find("beside.uph")


@POSIX
def test_a_link_and_a_linked_folder_that_are_given_are_followed(folder, tmp_path):
    (tmp_path / "current.uph").symlink_to(folder / "quilt.uph")
    (tmp_path / "latest").symlink_to(folder)
    catalogue = Catalogue([str(tmp_path / "current.uph")])
    with open(catalogue.find("current.uph")[0], "rb") as file:
        assert len(file.read()) == (folder / "quilt.uph").stat().st_size
    assert names(tmp_path / "latest") == ["quilt.uph", "smallest.uph"]


@POSIX
def test_a_pipe_and_a_file_that_became_a_link_are_not_found(folder, monkeypatch, tmp_path):
    os.mkfifo(folder / "pipe.uph")
    catalogue = Catalogue([str(folder)])
    assert catalogue.find("pipe.uph") is None
    places = catalogue._places()
    (folder / "quilt.uph").unlink()
    (folder / "quilt.uph").symlink_to(tmp_path / "secret.uph")
    monkeypatch.setattr(catalogue, "_places", lambda: places)
    assert catalogue.find("quilt.uph") is None


@POSIX
def test_odd_names_become_printable_and_stay_apart(folder):
    stream = (folder / "smallest.uph").read_bytes()
    for name in (b"a\nb.uph", b"a\tb.uph", b"a\xffb.uph", b'<i>"&.uph', b"back\\slash.uph", b"%2e%2e.uph"):
        with open(os.path.join(os.fsencode(folder), name), "wb") as file:
            file.write(stream)
    catalogue = Catalogue([str(folder)])
    found = [entry.name for entry in catalogue.entries()]
    odd = {"a�b.uph", "a�b-2.uph", "a�b-3.uph", '<i>"&.uph', "back\\slash.uph", "%2e%2e.uph"}
    assert set(found) == {"quilt.uph", "smallest.uph"} | odd
    for name in odd:
        with open(catalogue.find(name)[0], "rb") as file:
            assert file.read() == stream


@given(st.text(max_size=30))
def test_no_other_name_finds_anything(tmp_path_factory, text):
    folder = tmp_path_factory.getbasetemp() / "names"
    folder.mkdir(exist_ok=True)
    (folder / "one.uph").write_bytes(b"x")
    catalogue = Catalogue([str(folder)])
    for name in (text, f"../{text}", f"{folder}/{text}", f"{folder}/one.uph", f"./{text}"):
        assert catalogue.find(name) is None


@pytest.mark.parametrize(
    ("name", "content", "error"),
    [
        ("none.uph", None, "does not exist"),
        ("notes.txt", b"notes", "'.txt'; allowed: .uph"),
        ("empty.uph", b"", "empty.uph"),
        ("notes.uph", b"these are notes", "notes.uph.*byte 0"),
        ("nul\0.uph", None, "null"),
    ],
)
def test_bad_files_are_refused(tmp_path, name, content, error):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises((InputError, FormatError), match=error) as raised:
        Catalogue([str(tmp_path / name)])
    assert "\n" not in str(raised.value)


def test_damaged_files_are_refused_by_name_and_listed_in_a_folder(folder):
    stream = bytearray((folder / "quilt.uph").read_bytes())
    stream[-300] ^= 0xFF
    (folder / "bad.uph").write_bytes(stream)
    (folder / "cut.uph").write_bytes(stream[:3000])
    with pytest.raises(FormatError, match=r"bad\.uph.*byte"):
        Catalogue([str(folder / "bad.uph")])
    assert "bad.uph" in names(folder)
    assert names(folder / "cut.uph") == ["cut.uph"]
    with pytest.raises(InputError, match="no streams are given"):
        Catalogue([])
