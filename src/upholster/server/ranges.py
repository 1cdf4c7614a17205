"""What a request asks for: the conditions and the one byte range of RFC 9110, sections 13 and 14."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from http import HTTPStatus

__all__ = ["Answer", "answer", "parse_range"]

_RANGE = re.compile(r"[Bb][Yy][Tt][Ee][Ss]=[ \t,]*([0-9]*)-([0-9]*)[ \t,]*")
_TAG = re.compile(r'(W/)?("[\x21\x23-\x7e\x80-\xff]*")')
_ENDLESS = 2**63


@dataclass(frozen=True, slots=True)
class Answer:
    """What to send: status and bytes `start` to `stop` of the file; none unless the status is 200 or 206."""

    status: HTTPStatus
    start: int = 0
    stop: int = 0


def answer(method: str, headers: Mapping[str, str], *, tag: str, modified: int, size: int) -> Answer:
    """Decide what a GET or HEAD request gets.

    Parameters
    ----------
    method
        Of the request. A range counts for GET alone.
    headers
        Of the request, by name in lower case; lines of the same name joined by commas.
    tag
        The file's entity tag, quoted and strong.
    modified
        When it was last modified, in whole seconds since 1970.
    size
        Its bytes.

    Returns
    -------
    Answer
        200, 206, 304, 412 or 416. Several ranges, bad ones and those on a condition that does not hold are
        answered with the whole file, as the RFC allows: clients have to be ready for it.

    References
    ----------
    RFC 9110, section 13.2.2: which condition goes first. If-Range holds for entity tags only: two versions
    within one second have one date.
    """
    if "if-match" in headers:
        if not _matches(headers["if-match"], tag, weakly=False):
            return Answer(HTTPStatus.PRECONDITION_FAILED)
    elif (until := _date(headers.get("if-unmodified-since"))) is not None and modified > until:
        return Answer(HTTPStatus.PRECONDITION_FAILED)
    if "if-none-match" in headers:
        if _matches(headers["if-none-match"], tag, weakly=True):
            return Answer(HTTPStatus.NOT_MODIFIED)
    elif (since := _date(headers.get("if-modified-since"))) is not None and modified <= since:
        return Answer(HTTPStatus.NOT_MODIFIED)
    whole = Answer(HTTPStatus.OK, 0, size)
    if method != "GET" or "range" not in headers or headers.get("if-range", tag) != tag:
        return whole
    found = parse_range(headers["range"], size)
    if found is None:
        return whole
    if not found:
        return Answer(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
    return Answer(HTTPStatus.PARTIAL_CONTENT, found.start, found.stop)


def parse_range(text: str, size: int) -> range | None:
    """Read a Range header for a file of `size` bytes.

    Returns
    -------
    range or None
        The bytes; an empty range if there are none of those asked for; None where the header is to be
        ignored: another unit, several ranges, bad syntax.
    """
    found = _RANGE.fullmatch(text.strip(" \t"))
    if found is None or not (found[1] or found[2]):
        return None
    if not found[1]:
        return range(max(0, size - _number(found[2])), size)
    first, last = _number(found[1]), _number(found[2]) if found[2] else _ENDLESS
    if last < first:
        return None
    return range(first, min(last + 1, size))


def _number(digits: str) -> int:
    # Python refuses numbers of thousands of digits; beyond any file all are alike.
    digits = digits.lstrip("0")
    return int(digits or "0") if len(digits) < 19 else _ENDLESS


def _matches(text: str, tag: str, *, weakly: bool) -> bool:
    """Whether a list of entity tags names `tag`; weak ones count only in a weak comparison."""
    if text.strip() == "*":
        return True
    return any(found[2] == tag and (weakly or not found[1]) for found in _TAG.finditer(text))


def _date(text: str | None) -> float | None:
    """Return an HTTP date in seconds since 1970; None if there is none, or it cannot be read."""
    if text is None:
        return None
    try:
        return parsedate_to_datetime(text).timestamp()
    except (ValueError, TypeError, OverflowError, IndexError, OSError):
        return None
