"""Zip files whose directories say one thing and hold another."""

import io
import struct
import zipfile

import pytest

from upholster.base.errors import InputError
from upholster.base.zip_files import open_zip


def package(entries: int) -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w") as file:
        for number in range(entries):
            file.writestr(f"{number}.txt", b"")
    return memory.getvalue()


def with_zip64_record(data: bytes) -> bytes:
    """The same file: a second record has its directory's true size, the usual one says that it is empty."""
    at = data.rindex(b"PK\5\6")
    count, size, offset = struct.unpack_from("<HII", data, at + 10)
    record = struct.pack("<4sQHHIIQQQQ", b"PK\6\6", 44, 45, 45, 0, 0, count, count, size, offset)
    locator = struct.pack("<4sIQI", b"PK\6\7", 0, at, 1)
    return data[:at] + record + locator + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 0, 0, 0, 0, 0)


def test_a_directory_with_two_records_opens() -> None:
    with open_zip(with_zip64_record(package(3))) as file:
        assert len(file.namelist()) == 3


def test_the_true_number_of_entries_counts() -> None:
    with (
        pytest.raises(InputError, match="1001 entries; allowed: 1000"),
        open_zip(with_zip64_record(package(1001))),
    ):
        pass


def test_a_long_directory_is_not_read() -> None:
    entry = struct.pack("<4s4B4HIIIHHHHHII", b"PK\1\2", *[0] * 4, *[0] * 4, 0, 0, 0, 65535, 0, 0, 0, 0, 0, 0)
    directory = (entry + b"n" * 65535) * 16
    end = struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 16, 16, len(directory), 0, 0)
    with (
        pytest.raises(InputError, match=f"its directory has {len(directory):,} bytes"),
        open_zip(directory + end),
    ):
        pass
