"""Surfaces from files, described in docs/surfaces.md: control nets in JSON, and patch lists (.bpt)."""

import json
import os
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from upholster.base.errors import FormatError, InputError, nearest
from upholster.base.formats import MODEL_SUFFIXES, SURFACE_SUFFIXES, input_kind
from upholster.base.types import FloatArray
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.face_assembly import join_patches
from upholster.geometry.patches.orientation import pointing_outward
from upholster.geometry.patches.patch import MAX_DEGREE, RationalPatch
from upholster.geometry.patches.surface import MAX_PATCHES, Surface

__all__ = ["MAX_FILE_BYTES", "read_bpt", "read_nets", "read_surface"]

MAX_FILE_BYTES = 128 * 2**20
MAX_POINTS = 2**20
MAX_LINE = 4096

PathLike = str | os.PathLike[str]


def read_surface(path: PathLike) -> Surface:
    """Read a surface by its suffix: ``.json`` (`read_nets`), ``.bpt`` or ``.bpt.txt`` (`read_bpt`).

    Raises
    ------
    InputError, FormatError
        If the suffix is unknown, the file cannot be read, or its content is outside what is allowed.
    """
    kind = input_kind(os.fspath(path))
    if kind is not None and kind.holds == "patches":
        return _READERS[kind.name](path)
    raise InputError(
        f"surface {str(path)!r} has an unknown suffix; allowed: files of {', '.join(SURFACE_SUFFIXES)}, a "
        f"model of {', '.join(MODEL_SUFFIXES)}, or a built-in surface, see `upholster surfaces`"
    )


def read_nets(path: PathLike) -> Surface:
    """Read control nets with weights, of any degree, from a JSON file.

    Normals are turned outward if the signed volume is negative. The file may group patches into faces; if it
    does not, patches that continue smoothly into each other are joined (`join_patches`).

    Raises
    ------
    FormatError
        If the file is not JSON (gives line and column) or violates docs/surfaces.md (names the place).
    InputError
        If the file cannot be read or a number is outside what is allowed (names patch and index).
    """
    where = str(path)
    try:
        data = json.loads(_text(path))
    except json.JSONDecodeError as error:
        raise FormatError(
            f"{where}: no JSON: {error.msg} at line {error.lineno} column {error.colno}"
        ) from None
    except (RecursionError, ValueError):
        raise FormatError(f"{where}: no JSON of control nets: nested too deep or a number too long") from None
    _keys(where, "the file", data, {"patches"}, {"faces", "name", "tolerance"})
    name = data.get("name", Path(path).stem)
    if not isinstance(name, str) or len(name) > 200:
        raise FormatError(f"{where}: name is {_short(name)}; allowed: text of up to 200 characters")
    tolerance = data.get("tolerance", 1e-9)
    if isinstance(tolerance, bool) or not isinstance(tolerance, int | float) or not 0.0 <= tolerance <= 0.01:
        raise FormatError(
            f"{where}: tolerance is {_short(tolerance)}; allowed: 0 to 0.01, relative to the size"
        )
    nets = data["patches"]
    if not isinstance(nets, list) or not 1 <= len(nets) <= MAX_PATCHES:
        raise FormatError(
            f"{where}: patches is {_short(nets)}; allowed: a list of 1 to {MAX_PATCHES} patches"
        )
    patches = []
    for k, net in enumerate(nets):
        _keys(where, f"patch {k}", net, {"points"}, {"weights"})
        points = _rows(where, f"patch {k}: points", net["points"], 3)
        weights = None
        if "weights" in net:
            weights = _rows(where, f"patch {k}: weights", net["weights"], 1)
            if weights.shape != points.shape[:2]:
                raise FormatError(
                    f"{where}: patch {k}: weights are {weights.shape[0]} x {weights.shape[1]}; "
                    f"allowed: {points.shape[0]} x {points.shape[1]}, one per point"
                )
        patches.append(_patch(f"{where}: patch {k}", points, weights))
    if "faces" not in data:
        return join_patches(pointing_outward(Surface(patches, name, float(tolerance))))
    grids = _grids(where, data["faces"], len(patches))
    faces = [Face([[patches[number] for number in row] for row in grid]) for grid in grids]
    surface = pointing_outward(Surface(faces, name, float(tolerance)))
    try:
        _ = surface.shared  # patches of a face that do not join are refused here
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return surface


def read_bpt(path: PathLike) -> Surface:
    """Read the classic list of polynomial patches, with point indices or with the points themselves.

    Normals are turned outward if the signed volume is negative, and patches that continue smoothly into each
    other are joined into faces (`join_patches`).

    Raises
    ------
    FormatError
        If the file violates the format (docs/surfaces.md); gives the line.
    InputError
        If the file cannot be read or a coordinate is outside what is allowed.
    """
    lines = _Lines(str(path), _text(path))
    (count,) = lines.whole("the number of patches", 1, 1, MAX_PATCHES)
    nets = _listed_nets(lines, count) if len(lines.peek()) == 2 else _indexed_nets(lines, count)
    lines.end()
    patches = [_patch(f"{path}: patch {k}", net, None) for k, net in enumerate(nets)]
    name = Path(path).name
    name = name[: name.lower().rindex(".bpt")] if ".bpt" in name.lower() else name
    return join_patches(pointing_outward(Surface(patches, name)))


def _indexed_nets(lines: "_Lines", count: int) -> list[FloatArray]:
    """Read bi-cubic nets as 16 one-based indices per line, then the points."""
    rows, at = [], []
    for _ in range(count):
        rows.append(lines.whole("16 point numbers", 16, 1, MAX_POINTS))
        at.append(lines.number)
    (total,) = lines.whole("the number of points", 1, 1, MAX_POINTS)
    for k, row in enumerate(rows):
        if max(row) > total:
            raise FormatError(
                f"{lines.name}: line {at[k]}: point {max(row)}; allowed: 1 to {total}, the points below"
            )
    points = np.array([lines.reals("a point, x y z", 3) for _ in range(total)])
    return [points[np.array(row) - 1].reshape(4, 4, 3) for row in rows]


def _listed_nets(lines: "_Lines", count: int) -> list[FloatArray]:
    """Read nets, each as a line of two degrees and the points, one per line."""
    nets = []
    for _ in range(count):
        m, n = lines.whole("two degrees", 2, 1, MAX_DEGREE)
        points = [lines.reals("a point, x y z", 3) for _ in range((m + 1) * (n + 1))]
        nets.append(np.array(points).reshape(m + 1, n + 1, 3))
    return nets


class _Lines:
    """The non-empty lines of a text file, read one by one as numbers."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.number = 0
        self._source = StringIO(text)
        self._next: list[str] | None = None

    def peek(self) -> list[str]:
        """Return the fields of the next non-empty line, [] at the end; `number` becomes its line number."""
        while self._next is None:
            line = self._source.readline(MAX_LINE)
            if not line:
                return []
            self.number += 1
            if len(line) == MAX_LINE:
                raise FormatError(f"{self._place()}: too long; allowed: {MAX_LINE - 1} characters")
            self._next = line.replace(",", " ").split() or None
        return self._next

    def whole(self, what: str, count: int, least: int, most: int) -> list[int]:
        """Read a line of `count` integers from `least` to `most`."""
        values: list[int] = self._read(what, count, lambda text: int(text) if len(text) < 12 else most + 1)
        for value in values:
            if not least <= value <= most:
                raise FormatError(f"{self._place()}: {value} in {what}; allowed: {least} to {most}")
        return values

    def reals(self, what: str, count: int) -> list[float]:
        """Read a line of `count` numbers."""
        return self._read(what, count, float)

    def end(self) -> None:
        """Check that nothing is left."""
        if self.peek():
            raise FormatError(f"{self._place()}: more lines than the counts in the file announce")

    def _read(self, what: str, count: int, convert: Callable[[str], Any]) -> list[Any]:
        fields = self.peek()
        if not fields:
            raise FormatError(f"{self.name}: ends after line {self.number}, where {what} should follow")
        if len(fields) != count:
            raise FormatError(f"{self._place()}: {len(fields)} numbers; allowed: {count} ({what})")
        self._next = None
        try:
            if any("_" in text for text in fields):  # Python would accept it as a separator
                raise ValueError
            return [convert(text) for text in fields]
        except ValueError:
            raise FormatError(
                f"{self._place()}: {_short(' '.join(fields))} are not numbers ({what})"
            ) from None

    def _place(self) -> str:
        return f"{self.name}: line {self.number}"


def _text(path: PathLike) -> str:
    """Return a file's text, after checking its size."""
    try:
        if not os.path.isfile(path):
            reason = "is not a file" if os.path.exists(path) else "does not exist"
            raise InputError(f"{path}: {reason}; allowed: a surface file")
        size = os.path.getsize(path)
        if not 1 <= size <= MAX_FILE_BYTES:
            raise InputError(f"{path}: has {size} bytes; allowed: 1 to {MAX_FILE_BYTES}")
        return Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: no UTF-8 text: byte {error.start} is wrong") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def _keys(where: str, what: str, data: object, needed: set[str], optional: set[str]) -> None:
    """Check that `data` is an object with the needed keys and no unknown ones."""
    if not isinstance(data, dict):
        raise FormatError(
            f"{where}: {what} is {_short(data)}; allowed: an object with {', '.join(sorted(needed))}"
        )
    for key in data:
        if key not in needed | optional:
            raise FormatError(f"{where}: {what} has {_short(key)}; {nearest(key, sorted(needed | optional))}")
    for key in sorted(needed - data.keys()):
        raise FormatError(f"{where}: {what} has no {key!r}; needed: {', '.join(sorted(needed))}")


def _rows(where: str, what: str, rows: object, width: int) -> FloatArray:
    """Return a list of equally long lists of points (width 3) or numbers (width 1) as an array."""
    if not isinstance(rows, list) or not 2 <= len(rows) <= MAX_DEGREE + 1:
        raise FormatError(f"{where}: {what} is {_short(rows)}; allowed: a list of 2 to {MAX_DEGREE + 1} rows")
    first = rows[0]
    if not isinstance(first, list) or not 2 <= len(first) <= MAX_DEGREE + 1:
        raise FormatError(f"{where}: {what}[0] is {_short(first)}; allowed: a list of 2 to {MAX_DEGREE + 1}")
    flat: list[Any] = []
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != len(first):
            raise FormatError(
                f"{where}: {what}[{i}] is {_short(row)}; allowed: a list of {len(first)}, as row 0"
            )
        for j, entry in enumerate(row):
            numbers = entry if width > 1 else [entry]
            if not isinstance(numbers, list) or len(numbers) != width or not all(map(_is_number, numbers)):
                kind = "three numbers [x, y, z]" if width > 1 else "a number"
                raise FormatError(f"{where}: {what}[{i}][{j}] is {_short(entry)}; allowed: {kind}")
            flat.extend(numbers)
    shape = (len(rows), len(first), width) if width > 1 else (len(rows), len(first))
    return np.array(flat, dtype=np.float64).reshape(shape)


def _grids(where: str, faces: object, count: int) -> list[list[list[int]]]:
    """Return the patch numbers of faces, rows of columns, checked: each of the patches once."""
    if not isinstance(faces, list) or not faces:
        raise FormatError(f"{where}: faces is {_short(faces)}; allowed: a list of grids of patch numbers")
    seen: set[int] = set()
    for k, grid in enumerate(faces):
        rows = grid if isinstance(grid, list) else []
        width = len(rows[0]) if rows and isinstance(rows[0], list) else 0
        if not width or any(not isinstance(row, list) or len(row) != width for row in rows):
            raise FormatError(
                f"{where}: face {k} is {_short(grid)}; allowed: rows of patch numbers, equally long"
            )
        for number in (number for row in rows for number in row):
            if type(number) is not int or not 0 <= number < count or number in seen:
                raise FormatError(
                    f"{where}: face {k}: patch {_short(number)}; allowed: 0 to {count - 1}, each once"
                )
            seen.add(number)
    if len(seen) < count:
        missing = next(number for number in range(count) if number not in seen)
        raise FormatError(f"{where}: patch {missing} is in no face; allowed: each patch once")
    return faces


def _is_number(value: object) -> bool:
    """Return whether a JSON value is a number that a float can hold (NaN and infinity are refused later)."""
    return isinstance(value, float) or (type(value) is int and abs(value) < 2**1000)


def _patch(where: str, points: FloatArray, weights: FloatArray | None) -> RationalPatch:
    """Make a patch; its errors name the patch."""
    try:
        return RationalPatch.from_points(points, weights)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _short(value: object) -> str:
    """Format a wrong value for an error message: a list by its length, other values in 40 characters."""
    if isinstance(value, list | dict):
        return f"{'a list' if isinstance(value, list) else 'an object'} of {len(value)}"
    if type(value) is int and abs(value) >= 2**64:
        return "a huge number"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


_READERS: dict[str, Callable[[PathLike], Surface]] = {"nets": read_nets, "patch list": read_bpt}
"""Readers by the names of `upholster.base.formats.INPUTS`."""
