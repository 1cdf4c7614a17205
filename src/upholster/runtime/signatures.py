"""Types of kernels' arguments as JSON and back, so that a kernel can be compiled without calling it.

``"int64"`` is a number, ``["array", item, dimensions, layout, mutable]`` an array,
``["record", fields, bytes, aligned]`` an item of a structured one (fields as name, type, shape, offset),
``["tuple", items]`` a tuple and ``["named", "module:Class", items]`` a NamedTuple.
"""

import importlib
from typing import Any

import numpy as np
from numba import from_dtype, types
from numba.np.numpy_support import as_dtype

__all__ = ["read_type", "type_as_json"]


def type_as_json(kind: Any) -> Any:
    """Return a Numba type as JSON; ValueError for a type that no kernel has."""
    if isinstance(kind, types.Array):
        return ["array", type_as_json(kind.dtype), kind.ndim, kind.layout, kind.mutable]
    if isinstance(kind, types.Record):
        items = {name: as_dtype(kind.typeof(name)) for name in kind.fields}
        fields = [[name, of.base.str, list(of.shape), kind.offset(name)] for name, of in items.items()]
        return ["record", fields, kind.size, kind.aligned]
    if isinstance(kind, types.BaseNamedTuple):
        of = kind.instance_class
        return ["named", f"{of.__module__}:{of.__qualname__}", [type_as_json(item) for item in kind.types]]
    if isinstance(kind, types.BaseTuple):
        return ["tuple", [type_as_json(item) for item in kind.types]]
    if isinstance(kind, (types.Number, types.Boolean)):
        return str(kind)
    raise ValueError(f"kernels take no argument of type {kind}")


def read_type(written: Any) -> Any:
    """Return the Numba type that `type_as_json` wrote."""
    if isinstance(written, str):
        return types.boolean if written == "bool" else getattr(types, written)
    form, *rest = written
    if form == "array":
        item, dimensions, layout, mutable = rest
        return types.Array(read_type(item), dimensions, layout, readonly=not mutable)
    if form == "record":
        fields, size, aligned = rest
        names, bases, shapes, offsets = zip(*fields, strict=True)
        formats = [(item, tuple(shape)) for item, shape in zip(bases, shapes, strict=True)]
        record: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": size}
        return from_dtype(np.dtype(record, align=aligned))
    if form == "named":
        module, _, name = rest[0].partition(":")
        of = getattr(importlib.import_module(module), name)
        items = [read_type(item) for item in rest[1]]
        alike = all(item == items[0] for item in items)
        return types.NamedUniTuple(items[0], len(items), of) if alike else types.NamedTuple(items, of)
    return types.Tuple.from_types([read_type(item) for item in rest[0]])
