"""Conditions and ranges of RFC 9110, as a table and against a plain reading of the grammar."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.server.ranges import answer, parse_range

TAG = '"abc"'
PAST, NOW, LATER = (
    "Sun, 06 Nov 1994 08:49:37 GMT",
    "Sun, 06 Nov 1994 08:49:38 GMT",
    "Sun, 06 Nov 1994 08:49:39 GMT",
)
MODIFIED = 784111778  # NOW


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("bytes=0-99", (0, 100)),
        ("bytes=0-0", (0, 1)),
        ("bytes=999-", (999, 1000)),
        ("bytes=500-5000", (500, 1000)),
        ("bytes=-1", (999, 1000)),
        ("bytes=-5000", (0, 1000)),
        ("BYTES= 0-1 ,", (0, 2)),
        ("bytes=000000000000000000000000001-2", (1, 3)),
        ("bytes=5-" + "9" * 9000, (5, 1000)),
        ("bytes=1000-", ()),
        ("bytes=1000-1001", ()),
        ("bytes=" + "9" * 9000 + "-", ()),
        ("bytes=-0", ()),
        ("bytes=-", None),
        ("bytes=", None),
        ("bytes", None),
        ("bytes=2-1", None),
        ("bytes=a-b", None),
        ("bytes=1-2-3", None),
        ("bytes=+1-2", None),
        ("bytes=٣-٤", None),
        ("bytes=0-1,5-6", None),
        ("chunks=0-1", None),
        ("", None),
    ],
)
def test_ranges(text, found):
    got = parse_range(text, 1000)
    if found is None:
        assert got is None
    else:
        assert got is not None
        assert (got.start, got.stop) == found if found else not got


@given(st.integers(0, 50), st.one_of(st.none(), st.integers(0, 60)), st.one_of(st.none(), st.integers(0, 60)))
def test_ranges_are_slices(size, first, last):
    data = bytes(range(size))
    text = f"bytes={'' if first is None else first}-{'' if last is None else last}"
    got = parse_range(text, size)
    if (first is None and last is None) or (first is not None and last is not None and last < first):
        assert got is None
        return
    if first is None:
        expected = data[len(data) - min(last, size) :]
    else:
        expected = data[first : None if last is None else last + 1]
    assert data[got.start : got.stop] == expected
    assert len(got) == len(expected)


@given(st.text(max_size=40))
def test_any_text_is_read(text):
    for value in (text, f"bytes={text}"):
        got = parse_range(value, 1000)
        assert got is None or not got or 0 <= got.start < got.stop <= 1000
    headers = dict.fromkeys(("if-match", "if-none-match", "if-modified-since", "if-range", "range"), text)
    assert answer("GET", headers, tag=TAG, modified=MODIFIED, size=10).status in (200, 304, 412)
    assert answer("GET", {"if-modified-since": text}, tag=TAG, modified=MODIFIED, size=10).status in (
        200,
        304,
    )


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"if-none-match": TAG}, 304),
        ({"if-none-match": f'"x", W/{TAG}'}, 304),
        ({"if-none-match": "*"}, 304),
        ({"if-none-match": '"abcd"'}, 200),
        ({"if-none-match": "abc"}, 200),
        ({"if-none-match": '"x"', "if-modified-since": NOW}, 200),
        ({"if-modified-since": NOW}, 304),
        ({"if-modified-since": LATER}, 304),
        ({"if-modified-since": PAST}, 200),
        ({"if-modified-since": "yesterday"}, 200),
        ({"if-match": TAG}, 200),
        ({"if-match": "*"}, 200),
        ({"if-match": f"W/{TAG}"}, 412),
        ({"if-match": '"x"'}, 412),
        ({"if-unmodified-since": PAST}, 412),
        ({"if-unmodified-since": NOW}, 200),
        ({"if-match": TAG, "if-unmodified-since": PAST}, 200),
        ({"range": "bytes=1-2"}, 206),
        ({"range": "bytes=1-2", "if-range": TAG}, 206),
        ({"range": "bytes=1-2", "if-range": f"W/{TAG}"}, 200),
        ({"range": "bytes=1-2", "if-range": '"x"'}, 200),
        ({"range": "bytes=1-2", "if-range": NOW}, 200),
        ({"range": "bytes=1-2", "if-none-match": TAG}, 304),
        ({"range": "bytes=10-"}, 416),
        ({"range": "bytes=10-", "if-range": '"x"'}, 200),
    ],
)
def test_conditions(headers, status):
    got = answer("GET", headers, tag=TAG, modified=MODIFIED, size=10)
    assert got.status == status
    assert (got.start, got.stop) == {200: (0, 10), 206: (1, 3)}.get(status, (0, 0))


def test_a_range_counts_for_get_alone():
    assert answer("HEAD", {"range": "bytes=1-2"}, tag=TAG, modified=0, size=10).status == 200


def test_an_empty_file_has_no_ranges():
    assert answer("GET", {"range": "bytes=0-"}, tag=TAG, modified=0, size=0).status == 416
    assert re.fullmatch(r"range\(0, 0\)", repr(parse_range("bytes=-5", 0)))
