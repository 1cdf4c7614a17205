"""XML from untrusted sources, element by element: without document types, so no entity can expand."""

from collections.abc import Callable, Iterable, Mapping
from xml.parsers import expat

from upholster.base.errors import FormatError

__all__ = ["Attributes", "Handlers", "read_xml", "whole_number"]

Attributes = dict[str, str]

Handlers = Mapping[str, Callable[[Attributes], None]]
"""Functions for the starts of elements, by full names: the namespace, a space, and the name."""

_MOST_ELEMENTS = 32_000_000
_DEEPEST = 256
_LONGEST_TAG = 1 << 20
_LONGEST_NAMESPACE = 1000
"""Expat copies the namespace for each element."""


def read_xml(
    pieces: Iterable[bytes],
    starts: Handlers,
    ends: Mapping[str, Callable[[], None]] | None = None,
    namespace: Callable[[str, str], None] | None = None,
) -> None:
    """Call functions for the elements of a document; other elements are ignored.

    Parameters
    ----------
    pieces
        Its bytes.
    starts, ends
        Functions for starts and ends of elements. They may raise KeyError for a missing attribute, and
        ValueError or OverflowError for one that is not the right number.
    namespace
        Called with each prefix and its namespace.

    Raises
    ------
    FormatError
        If it is not XML, has a document type, exceeds a limit, or a function raised one of the above: with
        the line.
    """
    parser = expat.ParserCreate(namespace_separator=" ")
    count = depth = 0

    def start(name: str, attributes: Attributes) -> None:
        nonlocal count, depth
        count += 1
        depth += 1
        if count > _MOST_ELEMENTS or depth > _DEEPEST:
            raise FormatError(f"elements: {count}, {depth} deep; allowed: {_MOST_ELEMENTS}, {_DEEPEST} deep")
        if (function := starts.get(name)) is not None:
            try:
                function(attributes)
            except KeyError as error:
                raise FormatError(f"{_local(name)} has no {_local(str(error.args[0]))}") from None
            except (ValueError, OverflowError):
                raise FormatError(_wrong_number(name, attributes)) from None

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        if ends is not None and (function := ends.get(name)) is not None:
            function()

    def namespace_start(prefix: str | None, place: str | None) -> None:
        if len(place or "") > _LONGEST_NAMESPACE:
            raise FormatError(f"a namespace has {len(place or '')} characters; allowed: {_LONGEST_NAMESPACE}")
        if namespace is not None:
            namespace(prefix or "", place or "")

    def document_type(*_: object) -> None:
        raise FormatError("it has a document type; allowed: none")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = document_type
    parser.StartNamespaceDeclHandler = namespace_start
    fed = 0
    try:
        for piece in pieces:
            parser.Parse(piece, False)
            fed += len(piece)
            if fed - parser.CurrentByteIndex > _LONGEST_TAG:
                raise FormatError(f"a tag has more than {_LONGEST_TAG} bytes; allowed: up to that")
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        message = expat.errors.messages.get(error.code, "")
        raise FormatError(f"its XML is damaged at line {error.lineno}: {message}") from None
    except FormatError as error:
        raise FormatError(f"line {parser.CurrentLineNumber}: {error}") from None


def whole_number(attributes: Attributes, key: str, default: int | None = None) -> int:
    """Return an integer of 0 or more; raise KeyError without, ValueError if it is another."""
    if default is not None and key not in attributes:
        return default
    value = int(attributes[key])
    if not 0 <= value < 1 << 31:
        raise ValueError
    return value


def _local(name: str) -> str:
    return name.rpartition(" ")[2]


def _wrong_number(name: str, attributes: Attributes) -> str:
    """Name an attribute that is not a number as others of the element are."""
    for key, value in attributes.items():
        try:
            float(value)
        except ValueError:
            return f"{_local(key)} of {_local(name)} is {value[:40]!r}; allowed: a number"
    shown = ", ".join(f"{_local(key)} {value[:20]!r}" for key, value in attributes.items())
    return f"{_local(name)} has {shown}; allowed: finite numbers, and whole numbers of 0 or more as indices"
