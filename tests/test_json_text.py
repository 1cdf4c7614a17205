"""JSON from outside is plain, or refused in one line."""

import pytest

from upholster.base.errors import FormatError
from upholster.base.json_text import read_json


def test_what_json_allows_is_read():
    assert read_json(b'{"a": [1, -2.5, null, true, "\\ud800"]}') == {"a": [1, -2.5, None, True, "\ud800"]}
    assert read_json("[" * 100 + "]" * 100)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[" * 101 + "]" * 101, "nested too deep; allowed: 100"),
        ('{"a":' * 101 + "1" + "}" * 101, "nested too deep; allowed: 100"),
        ("[" * 10**6, "nested too deep|not JSON"),
        ("9" * 301, "a number of 301 digits; allowed: 300"),
        ("9" * 10_000, "digits; allowed: 300"),
        ("[1e999]", "1e999 is no number"),
        ("NaN", "NaN is no number"),
        ("-Infinity", "no number"),
        ("{", "not JSON"),
        (b"\xff\xfe\xfd", "not JSON"),
    ],
)
def test_the_rest_is_one_line(text, says):
    with pytest.raises(FormatError, match=says):
        read_json(text)
