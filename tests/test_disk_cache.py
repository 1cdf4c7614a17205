"""Results kept on disk: found again while nothing that they depend on has changed."""

import os

import pytest

import upholster.runtime.disk_cache as disk_cache
from upholster.runtime.disk_cache import kept_on_disk


@pytest.fixture
def kept(tmp_path, monkeypatch):
    folder = tmp_path / "kept"
    monkeypatch.setenv("UPHOLSTER_CACHE", str(folder))
    (tmp_path / "file").write_text("x")
    (tmp_path / "other").write_text("y")
    calls = []

    def get(asked="a"):
        made = kept_on_disk(
            [asked],
            lambda: calls.append(asked) or [asked],
            file=str(tmp_path / "file"),
            files=lambda _: [str(tmp_path / "other")],
        )
        assert made == [asked]
        return len(calls)

    return folder, get


def test_a_result_is_made_once_while_all_its_files_stay(kept, tmp_path):
    _, get = kept
    assert [get(), get(), get("b"), get()] == [1, 1, 2, 2]
    (tmp_path / "file").write_text("z")
    assert [get(), get()] == [3, 3]
    (tmp_path / "other").write_text("z")
    assert [get(), get()] == [4, 4]


def test_what_is_damaged_cut_or_empty_is_made_anew(kept):
    folder, get = kept
    get()
    for number, damage in enumerate((lambda d: d[:-3], lambda d: b"", lambda d: d[:9] + b"?" + d[10:]), 2):
        (file,) = folder.iterdir()
        file.write_bytes(damage(file.read_bytes()))
        assert get() == number


def test_it_can_be_off_or_where_nothing_can_be_written(kept, monkeypatch, tmp_path):
    _, get = kept
    for number, folder in enumerate(("off", str(tmp_path / "file")), 1):
        monkeypatch.setenv("UPHOLSTER_CACHE", folder)
        assert get() == 2 * number - 1
        assert get() == 2 * number


def test_only_its_own_files_are_deleted_the_oldest_first(kept, monkeypatch):
    folder, get = kept
    folder.mkdir()
    (folder / "mine.txt").write_bytes(bytes(10_000))
    get("a")
    (first,) = folder.glob("*.upholster-kept")
    os.utime(first, (1, 1))
    monkeypatch.setattr(disk_cache, "MOST_BYTES", 1.5 * first.stat().st_size)
    get("b")
    assert not first.exists()
    assert (folder / "mine.txt").exists()


@pytest.mark.skipif(os.name != "posix", reason="files have owners there")
def test_files_of_others_are_not_read(kept, monkeypatch):
    _, get = kept
    assert [get(), get()] == [1, 1]
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert get() == 2
