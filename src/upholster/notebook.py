"""How surfaces, quilts and texels show themselves in a notebook; what that takes is loaded when they do."""

from typing import TYPE_CHECKING, Any

from upholster.shown import show_with

if TYPE_CHECKING:
    from upholster.geometry import Surface
    from upholster.quilt import Quilt, Texels

__all__: list[str] = []

_WIDEST = 1024
_QUADS = 4000


def _surface_picture(surface: "Surface") -> bytes:
    from upholster.image import encode_image, from_linear
    from upholster.model import tessellate
    from upholster.render import render

    mesh = tessellate(surface, quads=_QUADS)
    picture = render(
        mesh.positions,
        mesh.normals,
        mesh.places,
        mesh.all_triangles(),
        None,
        size=(480, 360),
    )
    return encode_image(from_linear(picture, "uint8"), "png")


def _quilt_picture(quilt: "Quilt") -> bytes:
    import numpy as np

    from upholster.image import encode_image

    # Red and green name the place in the exemplar, blue tells painted from unpainted.
    scale = np.array(quilt.exemplar_shape) * 16
    places = [
        np.concatenate([np.clip(source * 255 / scale, 0, 255), (source[:, :, :1] >= 0) * 128], axis=2)
        for source in quilt.sources()
    ]
    return encode_image(_sheet([place.astype(np.uint8) for place in places]), "png")


def _texels_picture(texels: "Texels") -> bytes:
    from upholster.image import encode_image

    return encode_image(_sheet(list(texels.arrays)), "png", bits=8)


def _sheet(arrays: list[Any]) -> Any:
    """Lay charts side by side, near square, thinned out to what a screen shows."""
    import numpy as np

    columns = int(np.ceil(np.sqrt(len(arrays))))
    rows = -(-len(arrays) // columns)
    height = max(array.shape[0] for array in arrays)
    width = max(array.shape[1] for array in arrays)
    step = max(1, -(-max(rows * height, columns * width) // _WIDEST))
    height, width = -(-height // step), -(-width // step)
    sheet = np.zeros((rows * height, columns * width, arrays[0].shape[2]), arrays[0].dtype)
    for index, array in enumerate(arrays):
        part = array[::step, ::step]
        row, column = index // columns * height, index % columns * width
        sheet[row : row + part.shape[0], column : column + part.shape[1]] = part
    return sheet


show_with("Surface", _surface_picture)
show_with("Quilt", _quilt_picture)
show_with("Texels", _texels_picture)
