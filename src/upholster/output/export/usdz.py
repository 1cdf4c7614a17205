"""USDZ made from a GLB, for iPhones and film programs, by Pixar's own library (extra ``usd``).

Each instance of a mesh in the scene becomes a prim, with its materials as UsdPreviewSurface. Skins are in the
pose of their joints when no animation plays; animations are left out.

References
----------
Pixar: UsdPreviewSurface specification; Usdz file format specification.
PKWARE: .ZIP file format specification, 4.3.7 and 4.3.12 (the fields for an entry's date).
"""

import os
import struct
import tempfile
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.files import write_bytes
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.accessors import Accessors, as_floats
from upholster.geometry.gltf.gltf import Gltf, Json, parse_gltf
from upholster.geometry.model_files.gltf_nodes import MeshPlacement, mesh_placements, vertex_matrices
from upholster.geometry.model_files.gltf_scene import primitive_arrays, primitive_triangles

__all__ = ["check_usd", "write_usdz"]

_SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}
_CLAMP = 33071
_TRIANGLES = (4, 5, 6)
_MOST_PLACES = 65_536
_ZIP_EPOCH = (0, 33)  # time and date of 1 January 1980, 0:00


def check_usd() -> None:
    """Raise InputError if Pixar's library is not installed."""
    try:
        import pxr  # noqa: F401  # only to see whether it is installed
    except ModuleNotFoundError:
        raise InputError("writing .usdz needs usd-core; install it: pip install 'upholster[usd]'") from None


def write_usdz(path: str | os.PathLike[str], glb: bytes) -> tuple[str, ...]:
    """Write the scene of a GLB as USDZ, also with y up.

    Parameters
    ----------
    path
        The file to write.
    glb
        A GLB with textures in PNG or JPEG.

    Returns
    -------
    tuple
        Parts that could not be kept, one line each.

    Raises
    ------
    InputError
        If usd-core is not installed.
    """
    check_usd()
    from pxr import Sdf, UsdUtils

    gltf = parse_gltf(glb, "model.glb")
    # Collects the warnings of Pixar's library, which would otherwise go to the terminal.
    heard = UsdUtils.CoalescingDiagnosticDelegate()
    with tempfile.TemporaryDirectory(prefix="upholster-") as folder:
        scene = _Scene(gltf, Path(folder))
        scene.write()
        packed = str(Path(folder, "packed.usdz"))
        if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(scene.file)), packed):
            raise InputError("the USDZ package cannot be made: is there room on the disk?")
        write_bytes(path, _undated(Path(packed).read_bytes()))
    heard.TakeUncoalescedDiagnostics()
    return tuple(scene.notes)


def _undated(package: bytes) -> bytes:
    """Return a ZIP archive with ZIP's first date for each entry: the same model gives the same file."""
    data = bytearray(package)
    with zipfile.ZipFile(BytesIO(package)) as archive:
        entries, central = archive.infolist(), archive.start_dir
    for entry in entries:
        struct.pack_into("<HH", data, entry.header_offset + 10, *_ZIP_EPOCH)
        struct.pack_into("<HH", data, central + 12, *_ZIP_EPOCH)
        central += 46 + sum(struct.unpack_from("<HHH", data, central + 28))
    return bytes(data)


class _Scene:
    """A stage under construction, in a folder of its own with its textures."""

    def __init__(self, gltf: Gltf, folder: Path) -> None:
        from pxr import Usd, UsdGeom

        self.file = folder / "model.usdc"
        self.notes: list[str] = []
        self._gltf, self._folder = gltf, folder
        self._accessors = Accessors(gltf)
        self._stage: Any = Usd.Stage.CreateNew(str(self.file))
        UsdGeom.SetStageUpAxis(self._stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(self._stage, 1.0)
        self._root: Any = UsdGeom.Xform.Define(self._stage, "/Model")
        self._stage.SetDefaultPrim(self._root.GetPrim())
        self._materials: dict[int, Any] = {}
        self._images: dict[int, str] = {}

    def write(self) -> None:
        """Write all meshes, and save."""
        from pxr import Gf, UsdGeom

        for placement in mesh_placements(self._gltf, self._accessors):
            places = [np.eye(4)] if placement.joints is not None else [placement.matrix, *placement.others]
            if len(places) > _MOST_PLACES:
                self.notes.append(
                    f"{_MOST_PLACES:,} of {len(places):,} instances are in .usdz, each with its own vertices"
                )
            for place, number in zip(places[:_MOST_PLACES], placement.nodes.tolist(), strict=False):
                node = self._gltf.item("nodes", number)
                called = node.get("name") or self._gltf.item("meshes", placement.mesh).get("name") or "mesh"
                form = UsdGeom.Xform.Define(self._stage, self._free("/Model", str(called)))
                form.GetPrim().SetDisplayName(str(called))
                form.AddTransformOp().Set(Gf.Matrix4d(np.ascontiguousarray(place.T).tolist()))
                self._add_mesh(str(form.GetPath()), placement)
        if self._gltf.items("animations"):
            self.notes.append("animations are left out of .usdz: the model keeps its pose at rest")
        self._stage.GetRootLayer().Save()

    def _free(self, parent: str, name: str) -> str:
        """Return an unused path below another."""
        from pxr import Tf

        own = Tf.MakeValidIdentifier(name) or "part"
        path, number = f"{parent}/{own}", 2
        while self._stage.GetPrimAtPath(path):
            path, number = f"{parent}/{own}_{number}", number + 1
        return path

    def _add_mesh(self, parent: str, placement: MeshPlacement) -> None:
        for primitive in self._gltf.item("meshes", placement.mesh).get("primitives", []):
            if primitive.get("mode", 4) in _TRIANGLES:
                self._add_primitive(parent, placement, primitive)

    def _add_primitive(self, parent: str, placement: MeshPlacement, primitive: Json) -> None:
        """Add triangles with the vertices that they use, and bind their material."""
        from pxr import Sdf, UsdGeom, UsdShade, Vt

        arrays, indices = primitive_arrays(self._gltf, self._accessors, primitive)
        count = len(arrays["POSITION"].values)
        used, corners = np.unique(primitive_triangles(primitive, indices, count), return_inverse=True)
        points = as_floats(arrays["POSITION"])
        if placement.joints is not None:
            points = self._posed(placement, arrays, points)
        mesh = UsdGeom.Mesh.Define(self._stage, self._free(parent, "mesh"))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreatePointsAttr(_vectors(points[used]))
        mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(corners.reshape(-1)) // 3, 3))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(_plain(corners)))
        if "NORMAL" in arrays and placement.joints is None:
            mesh.CreateNormalsAttr(_vectors(as_floats(arrays["NORMAL"])[used]))
            mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        if "TEXCOORD_0" in arrays:
            uv = as_floats(arrays["TEXCOORD_0"])[used] * (1, -1) + (0, 1)
            value = Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uv, np.float32))
            primvars = UsdGeom.PrimvarsAPI(mesh)
            primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex).Set(value)
        if "material" not in primitive:
            return
        number = primitive["material"]
        entry = self._gltf.item("materials", number)
        mesh.CreateDoubleSidedAttr(entry.get("doubleSided") is True)
        if number not in self._materials:
            self._materials[number] = self._material(entry)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(self._materials[number])

    def _posed(self, placement: MeshPlacement, arrays: dict[str, Any], points: FloatArray) -> FloatArray:
        sets = [name for name in (f"JOINTS_{n}" for n in range(8)) if name in arrays]
        weights = [arrays[name.replace("JOINTS", "WEIGHTS")] for name in sets]
        matrices = vertex_matrices(placement, [arrays[name] for name in sets], weights, len(points))
        turned: FloatArray = np.einsum("vij,vj->vi", matrices[:, :, :3], points) + matrices[:, :, 3]
        return turned

    def _material(self, entry: Json) -> Any:
        """Return a material as a UsdPreviewSurface."""
        from pxr import Sdf, UsdShade

        name = str(entry.get("name") or "material")
        material = UsdShade.Material.Define(self._stage, self._free("/Model/Materials", name))
        path = str(material.GetPath())
        shader = UsdShade.Shader.Define(self._stage, f"{path}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        look = entry.get("pbrMetallicRoughness", {})
        colour = look.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
        types = Sdf.ValueTypeNames
        read = _Textures(self, path, shader)
        base = read.texture(look.get("baseColorTexture"), "base", "sRGB", colour)
        read.put("diffuseColor", types.Color3f, base, "rgb", tuple(colour[:3]))
        mode = entry.get("alphaMode", "OPAQUE")
        if mode != "OPAQUE":
            read.put("opacity", types.Float, base, "a", float(colour[3]))
        if mode == "MASK":
            shader.CreateInput("opacityThreshold", types.Float).Set(float(entry.get("alphaCutoff", 0.5)))
        rough, metal = float(look.get("roughnessFactor", 1.0)), float(look.get("metallicFactor", 1.0))
        both = read.texture(look.get("metallicRoughnessTexture"), "rough", "raw", [1.0, rough, metal, 1.0])
        read.put("roughness", types.Float, both, "g", rough)
        read.put("metallic", types.Float, both, "b", metal)
        if (shade := read.texture(entry.get("occlusionTexture"), "shade", "raw", [1.0] * 4)) is not None:
            read.put("occlusion", types.Float, shade, "r", 1.0)
        bent = entry.get("normalTexture")
        slope = 2.0 * float(bent.get("scale", 1.0)) if bent else 2.0
        relief = read.texture(
            bent, "normal", "raw", [slope, slope, 2.0, 1.0], [-slope / 2, -slope / 2, -1.0, 0.0]
        )
        if relief is not None:
            read.put("normal", types.Normal3f, relief, "rgb", (0.0, 0.0, 1.0))
        glow = entry.get("emissiveFactor", [0.0, 0.0, 0.0])
        light = read.texture(entry.get("emissiveTexture"), "glow", "sRGB", [*glow, 1.0])
        if light is not None or any(glow):
            read.put("emissiveColor", types.Color3f, light, "rgb", tuple(glow))
        return material

    def image(self, index: int) -> str | None:
        """Write an image next to the stage, once; return its name, None if USDZ does not allow its format."""
        if index not in self._images:
            entry = self._gltf.item("images", index)
            suffix = _SUFFIXES.get(str(entry.get("mimeType")))
            if suffix is None or "bufferView" not in entry:
                self.notes.append(f"image {index} is neither PNG nor JPEG: left out of .usdz")
                return None
            data = self._gltf.view_of(self._gltf.item("bufferViews", entry["bufferView"]))
            self._images[index] = f"texture_{index}{suffix}"
            (self._folder / self._images[index]).write_bytes(data)
        return self._images[index]

    def source(self, reference: Json) -> tuple[str | None, str]:
        """Return the image of a texture, and its wrapping beyond the edge."""
        texture = self._gltf.item("textures", reference.get("index"))
        if "source" not in texture:
            self.notes.append("a texture of another format than PNG and JPEG is left out of .usdz")
            return None, "repeat"
        sampler = self._gltf.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        return self.image(texture["source"]), "clamp" if sampler.get("wrapS") == _CLAMP else "repeat"

    def define(self, path: str, kind: str) -> Any:
        """Return a new shader of a kind."""
        from pxr import UsdShade

        shader = UsdShade.Shader.Define(self._stage, path)
        shader.CreateIdAttr(kind)
        return shader


class _Textures:
    """The textures of one material, which share a reader of texture coordinates."""

    def __init__(self, scene: _Scene, path: str, shader: Any) -> None:
        self._scene, self._path, self._shader = scene, path, shader
        self._reader: Any = None

    def texture(
        self,
        reference: Json | None,
        name: str,
        space: str,
        scale: list[float],
        bias: list[float] | None = None,
    ) -> Any:
        """Return a shader that reads a texture: value · scale + bias; None if there is no texture."""
        from pxr import Gf, Sdf

        if reference is None:
            return None
        file, wrap = self._scene.source(reference)
        if file is None:
            return None
        types = Sdf.ValueTypeNames
        if self._reader is None:
            self._reader = self._scene.define(f"{self._path}/coordinates", "UsdPrimvarReader_float2")
            self._reader.CreateInput("varname", types.String).Set("st")
            self._reader.CreateOutput("result", types.Float2)
        shader = self._scene.define(f"{self._path}/{name}", "UsdUVTexture")
        shader.CreateInput("file", types.Asset).Set(Sdf.AssetPath(file))
        shader.CreateInput("st", types.Float2).ConnectToSource(self._reader.ConnectableAPI(), "result")
        shader.CreateInput("sourceColorSpace", types.Token).Set(space)
        for side in ("wrapS", "wrapT"):
            shader.CreateInput(side, types.Token).Set(wrap)
        shader.CreateInput("scale", types.Float4).Set(Gf.Vec4f(*scale))
        shader.CreateInput("bias", types.Float4).Set(Gf.Vec4f(*(bias or [0.0] * 4)))
        return shader

    def put(self, name: str, kind: Any, texture: Any, output: str, value: object) -> None:
        """Set an input of the surface to a texture's output, or else to a value."""
        from pxr import Sdf

        own = self._shader.CreateInput(name, kind)
        if texture is None:
            own.Set(value)
            return
        types = Sdf.ValueTypeNames
        texture.CreateOutput(output, types.Float3 if output == "rgb" else types.Float)
        own.ConnectToSource(texture.ConnectableAPI(), output)


def _vectors(values: FloatArray) -> Any:
    from pxr import Vt

    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


def _plain(corners: NDArray[np.integer]) -> IntArray:
    return np.ascontiguousarray(corners.reshape(-1), np.int32)
