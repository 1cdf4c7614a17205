"""Files of every kind that is read, small and sound, and what reads them."""

import importlib.util
import io
import json
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))  # the folder of benchmarks
sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.nets import write_nets
from gltf_models import Glb

from upholster.base.limits import Limits
from upholster.codec.ezw import decode, encode
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.surface_files import read_surface
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.occt.process import read_cad
from upholster.image.files.material_files import read_material
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import encode_image
from upholster.output.export.bare import write_bare_obj, write_bare_ply
from upholster.output.export.three_mf import write_3mf

__all__ = ["CAD", "SOURCES", "reader"]

IMAGES = ("png", "jpeg", "webp", "tiff", "exr")
CAD = ("step", "igs", "brep", "3dm")
_POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1.0]])
_TRIANGLES = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


def pixels() -> Any:
    """A small image."""
    return np.random.default_rng(1).integers(0, 256, (40, 48, 3), dtype=np.uint8)


def written(suffix: str, folder: Path, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a sound file of a kind; a zip by a method."""
    path = folder / f"sound.{suffix}"
    if suffix in IMAGES:
        image = pixels()
        return encode_image(image / np.float32(255) if suffix == "exr" else image, suffix)
    if suffix == "ezw":
        return encode(pixels())
    if suffix == "zip":
        memory = io.BytesIO()
        with zipfile.ZipFile(memory, "w", method) as package:
            for role in ("albedo", "normal", "roughness"):
                package.writestr(f"stone_{role}.png", encode_image(pixels(), "png"))
        return memory.getvalue()
    if suffix == "json":
        write_nets(path, surface_from_spec("cone"))
    elif suffix == "bpt":
        lines = ["2", *(["1 1", "0 0 0", "1 0 0", "0 1 0", "1 1 0"] * 2)]
        path.write_text("\n".join(lines) + "\n")
    elif suffix == "glb":
        glb = Glb()
        glb.node(mesh=glb.mesh("pyramid", triangles(glb)), scale=[2, 1, 1])
        return bytes(glb.bytes())
    elif suffix == "obj":
        write_bare_obj(path, _POINTS, _TRIANGLES)
    elif suffix == "ply":
        write_bare_ply(path, _POINTS, _TRIANGLES)
    elif suffix == "stl":
        facets = np.zeros(len(_TRIANGLES), [("normal", "<3f4"), ("corners", "<(3,3)f4"), ("rest", "<u2")])
        facets["corners"] = _POINTS[_TRIANGLES]
        return bytes(80) + len(facets).to_bytes(4, "little") + facets.tobytes()
    elif suffix == "3mf":
        write_3mf(path, _POINTS, _TRIANGLES)
    elif suffix == "off":
        lines = [f"{x} {y} {z}" for x, y, z in _POINTS] + [f"3 {a} {b} {c}" for a, b, c in _TRIANGLES]
        path.write_text(f"OFF\n{len(_POINTS)} {len(_TRIANGLES)} 0\n" + "\n".join(lines) + "\n")
    else:
        write_cad(path)
    return path.read_bytes()


def triangles(glb: Any) -> Any:
    """The pyramid as a primitive of a GLB file."""
    return {
        "attributes": {"POSITION": glb.accessor(_POINTS.astype(np.float32))},
        "indices": glb.accessor(_TRIANGLES.reshape(-1, 1).astype(np.uint16)),
    }


def write_cad(path: Path) -> None:
    """Write a box."""
    if path.suffix == ".3dm":
        import rhino3dm

        model = rhino3dm.File3dm()
        model.Objects.AddSphere(rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), 5))
        model.Write(str(path), 7)
        return
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.BRepTools import BRepTools
    from OCP.IGESControl import IGESControl_Writer
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    box = BRepPrimAPI_MakeBox(40, 20, 10).Shape()
    if path.suffix == ".brep":
        BRepTools.Write_s(box, str(path))
    elif path.suffix == ".igs":
        writer = IGESControl_Writer("MM", 1)
        writer.AddShape(box)
        writer.Write(str(path))
    else:
        writer = STEPControl_Writer()
        writer.Transfer(box, STEPControl_AsIs)
        writer.Write(str(path))


def reader(suffix: str, path: Path) -> Callable[[], str]:
    """Return what reads a file of a kind, in full."""

    def read() -> str:
        if suffix in IMAGES:
            read_exemplar(path)
        elif suffix == "ezw":
            decode(path.read_bytes(), limits=Limits(texels=2**22))
        elif suffix == "zip":
            read_material(path)
        elif suffix in ("json", "bpt"):
            read_surface(path)
        elif suffix in CAD:
            read_cad(path, seconds=60)
        else:
            read_model(path)
        return "read"

    return read


def installed(suffix: str) -> bool:
    """Whether what reads a kind of file is here."""
    if suffix not in CAD:
        return True
    return importlib.util.find_spec("rhino3dm" if suffix == "3dm" else "OCP") is not None


SOURCES = tuple(
    suffix
    for suffix in (*IMAGES, "ezw", "zip", "json", "bpt", "glb", "obj", "ply", "stl", "off", "3mf", *CAD)
    if installed(suffix)
)


def injected(rng: Any, suffix: str, data: bytes) -> bytes:
    """Return a copy with a name that a terminal might obey, where the file is text that holds names."""
    if suffix == "json":
        return json.dumps({**json.loads(data), "name": "\x1b[2J[/foo]"}).encode()
    if suffix == "obj":
        return b"o \x1b]0;x\x07[bold]\nusemtl [/foo]\n" + data
    return data + rng.bytes(int(rng.integers(0, 9)))
