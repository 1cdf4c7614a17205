"""A session's folder: what is dropped counts while it stays, and nothing stays of what is refused."""

import asyncio
import os
import struct
import sys
import tempfile
import zipfile
from contextlib import closing

import pytest

from upholster import InputError

pytest.importorskip("starlette")

from upholster.apps.studio.folder import MADE, Folder

PROJECT = "a.upholster.json"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with closing(Folder(10**6)) as made:
        yield made


def files_of(folder):
    found = (file for file in folder.path.glob("[0-9]*/**/*") if file.is_file())
    return {file.relative_to(folder.path).as_posix() for file in found}


def stored(folder, data, name="x.zip", group=None, /, **more):
    async def parts():
        for start in range(0, len(data), 1000):
            yield data[start : start + 1000]

    return asyncio.run(folder.store(parts(), name, group, **more))


def packed(path, files, method=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", method) as file:
        for name, data in files.items():
            file.writestr(name, data)
    return path.read_bytes()


def room(folder):
    """Return how many bytes fit in, found by asking."""
    low, high = 0, 9 * 10**6
    while low < high:
        middle = (low + high + 1) // 2
        try:
            folder._check_together("x", middle)
        except InputError:
            high = middle - 1
        else:
            low = middle
    return low


def test_a_zip_of_a_project_is_replaced_by_its_files(folder, tmp_path):
    data = packed(tmp_path / "x.zip", {PROJECT: b"{}", "b/c.png": b"123"})
    path = stored(folder, data)[1]
    assert folder.unpacked(path) == f"2/{PROJECT}"
    assert files_of(folder) == {f"2/{PROJECT}", "2/b/c.png", f"2/{MADE}"}
    assert room(folder) == 8 * 10**6 - 5
    path = stored(folder, packed(tmp_path / "y.zip", {"a_albedo.png": b"1"}))[1]
    assert folder.unpacked(path) is None
    assert path in files_of(folder)


def _declared(data, size):
    """Return a zip whose directory gives another size for its second file."""
    at = data.index(b"PK\1\2", data.index(b"PK\1\2") + 4)
    return data[: at + 24] + struct.pack("<I", size) + data[at + 28 :]


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({"b": b"\0" * (2 * 10**6)}, "'b' is too large"),
        ({f"b{n}": b"\0" * 900_000 for n in range(9)}, "too much"),
        ({"../../b": b"1"}, "plain relative paths"),
        ({"/b": b"1"}, "plain relative paths"),
        ({"b": b"1", "b/c": b"1"}, "cannot be kept"),
        ({"b" * 300: b"1"}, "cannot be kept"),
        ({f"b{n}": b"" for n in range(1000)}, "1001 entries"),
    ],
)
def test_of_a_zip_that_is_refused_nothing_stays_or_counts(folder, tmp_path, files, says):
    path = stored(folder, packed(tmp_path / "x.zip", {PROJECT: b"{}", **files}))[1]
    with pytest.raises(InputError, match=says) as error:
        folder.unpacked(path)
    assert str(tmp_path) not in str(error.value)
    assert files_of(folder) == set()
    assert room(folder) == 8 * 10**6


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda data: data[:60] + b"\xff" * 30 + data[90:], "cannot be unpacked"),
        (lambda data: data[:-30], "not a readable zip file"),
        (lambda _: b"PK\3\4 no", "not a readable zip file"),
        (lambda data: _declared(data, 100), "cannot be unpacked"),
    ],
)
def test_damaged_zips_are_one_line(folder, tmp_path, damage, says):
    data = packed(tmp_path / "x.zip", {PROJECT: b"{ }" * 1000, "b": bytes(10**4)})
    path = stored(folder, damage(data))[1]
    with pytest.raises(InputError, match=says):
        folder.unpacked(path)
    assert files_of(folder) == set()


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_zips_by_other_methods_are_refused(folder, tmp_path, method):
    path = stored(folder, packed(tmp_path / "x.zip", {PROJECT: b"{}"}, method))[1]
    with pytest.raises(InputError, match="allowed: stored, deflate"):
        folder.unpacked(path)


def test_a_file_that_replaces_another_counts_once(folder):
    group = stored(folder, bytes(5000), "a.png")[0]
    stored(folder, bytes(7000), "a.png", group)
    assert room(folder) == 8 * 10**6 - 7000
    with pytest.raises(InputError, match="too large"):
        stored(folder, bytes(10**6 + 1), "a.png", group)
    assert room(folder) == 8 * 10**6 - 7000
    assert files_of(folder) == {f"{group}/a.png"}


def test_a_group_has_a_thousand_files_in_all_of_its_folders_together(folder):
    group = stored(folder, b"1", "a.png", folder="Set/b")[0]
    for n in range(999):
        (folder.path / str(group) / "Set" / f"{n}.png").touch()
    with pytest.raises(InputError, match=r"'c\.png' is one file too many; allowed: 1000 together"):
        stored(folder, b"1", "c.png", group, folder="Set/c")
    assert not (folder.path / str(group) / "Set" / "c").exists()


def test_a_refused_file_does_not_mark_its_group(folder):
    group = stored(folder, b"1", "a.png")[0]
    with pytest.raises(InputError, match="too large"):
        stored(folder, bytes(10**6 + 1), "b.png", group, is_made=True)
    assert files_of(folder) == {f"{group}/a.png"}
    stored(folder, b"1", "b.png", group, is_made=True)
    assert files_of(folder) == {f"{group}/{name}" for name in ("a.png", "b.png", MADE)}


def test_names_of_any_script_are_cut_to_what_a_disk_takes(folder):
    path = stored(folder, b"1", "\u4e2d" * 200 + ".png")[1]
    assert path.endswith("\u4e2d.png")
    assert len(os.fsencode(path)) < 255
    for name in ("a" * 5000, "\ud800", "a\0b"):
        with pytest.raises(InputError, match="does not exist"):
            folder.inside(name)


@pytest.mark.skipif(sys.platform == "win32", reason="needs locks on folders")
def test_the_next_start_removes_the_folders_of_killed_sessions(folder):
    with closing(Folder(10**6)) as living:
        os.close(folder._lock)  # as the system does when a process ends
        folder._lock = None
        with closing(Folder(10**6)):
            assert not folder.path.exists()
            assert living.path.exists()
