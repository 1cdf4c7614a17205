"""Small 3MF packages for tests, put together from text."""

import io
import zipfile
from typing import Any

from gltf_models import BOX, BOX_TRIANGLES

CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
MORE = (
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
)


def mesh(attributes: str = 'id="1"', rows: Any = BOX_TRIANGLES, more: tuple[str, ...] = ()) -> str:
    """A box; `more` has attributes of its triangles."""
    points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in BOX.tolist())
    triangles = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}" {more[n] if n < len(more) else ""}/>'
        for n, (a, b, c) in enumerate(rows.tolist())
    )
    return (
        f"<object {attributes}><mesh><vertices>{points}</vertices>"
        f"<triangles>{triangles}</triangles></mesh></object>"
    )


def placed(attributes: str, *inner: str) -> str:
    components = "".join(f"<component {one}/>" for one in inner)
    return f"<object {attributes}><components>{components}</components></object>"


def model(resources: str, *items: str, attributes: str = "") -> str:
    build = "".join(f"<item {one}/>" for one in items)
    return (
        f'<?xml version="1.0"?><model {attributes} {CORE} {MORE}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def package(text: str, **files: str) -> bytes:
    """A package of a model part and other files, by paths with __ for slashes."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("3D/3dmodel.model", text)
        for name, content in files.items():
            file.writestr(name.replace("__", "/"), content)
    return memory.getvalue()
