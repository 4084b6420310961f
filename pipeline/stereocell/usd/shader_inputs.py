"""Feed a surface shader from the mesh: images by its UVs, or values at its vertices.

Stage and usdz share this shader network. All inputs feed the material's `surface`, a
UsdPreviewSurface. Image files are PNG: colours in sRGB, all others raw.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

Kind = Literal["normal", "occlusion", "color"]

_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class _Feed:
    """One kind's way into the shader: its input, the image's output, the primvar's name."""

    input: str
    type: Any
    texture: str
    output: str
    output_type: Any
    space: str
    primvar: str
    reader: str


FEEDS: dict[Kind, _Feed] = {
    "normal": _Feed("normal", _Types.Normal3f, "normal_map", "rgb", _Types.Float3, "raw", "", ""),
    "occlusion": _Feed(
        "occlusion", _Types.Float, "occlusion_map", "r", _Types.Float, "raw",
        "occlusion", "UsdPrimvarReader_float",
    ),
    "color": _Feed(
        "diffuseColor", _Types.Color3f, "color_map", "rgb", _Types.Float3, "sRGB",
        "displayColor", "UsdPrimvarReader_float3",
    ),
}  # fmt: skip


def feed_image(stage: Usd.Stage, look: Sdf.Path, kind: Kind, file: str) -> None:
    """Feed an image to the surface shader of a material (`look`), by the mesh's `primvars:st`."""
    feed = FEEDS[kind]
    reader = UsdShade.Shader.Define(stage, look.AppendChild("st"))
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", _Types.String).Set("st")
    st = reader.CreateOutput("result", _Types.Float2)

    texture = UsdShade.Shader.Define(stage, look.AppendChild(feed.texture))
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", _Types.Asset).Set(file)
    texture.CreateInput("sourceColorSpace", _Types.Token).Set(feed.space)
    texture.CreateInput("wrapS", _Types.Token).Set("clamp")
    texture.CreateInput("wrapT", _Types.Token).Set("clamp")
    if kind == "normal":
        texture.CreateInput("scale", _Types.Float4).Set(Gf.Vec4f(2, 2, 2, 1))  # 0..1 -> -1..1
        texture.CreateInput("bias", _Types.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
    texture.CreateInput("st", _Types.Float2).ConnectToSource(st)
    _connect(stage, look, feed, texture.CreateOutput(feed.output, feed.output_type))


def feed_vertices(
    mesh: UsdGeom.Mesh,
    look: Sdf.Path,
    kind: Kind,
    values: NDArray[np.float32],
    indices: NDArray[np.int32] | None = None,
) -> None:
    """Store values at a mesh's vertices, (n,) or (n, 3), float32, and feed them to its surface.

    indices  (n,) of each vertex into `values`; None: as many values as vertices
    """
    data = np.ascontiguousarray(values, dtype=np.float32)
    is_color = kind == "color"
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        FEEDS[kind].primvar,
        _Types.Color3fArray if is_color else _Types.FloatArray,
        UsdGeom.Tokens.vertex,
    )
    primvar.Set(Vt.Vec3fArray.FromNumpy(data) if is_color else Vt.FloatArray.FromNumpy(data))
    if indices is not None:
        primvar.SetIndices(Vt.IntArray.FromNumpy(np.ascontiguousarray(indices, np.int32)))
    feed_primvar(mesh, look, kind)


def feed_primvar(mesh: UsdGeom.Mesh, look: Sdf.Path, kind: Kind) -> None:
    """Feed the primvar of a kind, which the mesh has or gets, to its surface."""
    feed, stage = FEEDS[kind], mesh.GetPrim().GetStage()
    reader = UsdShade.Shader.Define(stage, look.AppendChild(feed.primvar))
    reader.CreateIdAttr(feed.reader)
    reader.CreateInput("varname", _Types.String).Set(feed.primvar)
    _connect(stage, look, feed, reader.CreateOutput("result", feed.output_type))


def _connect(stage: Usd.Stage, look: Sdf.Path, feed: _Feed, source: UsdShade.Output) -> None:
    surface = UsdShade.Shader(stage.OverridePrim(look.AppendChild("surface")))
    surface.CreateInput(feed.input, feed.type).ConnectToSource(source)
