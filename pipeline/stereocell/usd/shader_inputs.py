"""Connect images, or a mesh's values at vertices, to inputs of a surface shader.

Stages and usdz files use the same shader network. Its inputs are those of the UsdPreviewSurface
that is called `surface`. Image files are PNG: colours in sRGB, all others raw.
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
    """The names and types that connect one kind of value to the surface shader.

    input        input of the surface shader, and its `type`
    texture      name of the prim that reads the image
    output       output of that prim, and its `output_type`
    space        colour space of the image
    primvar      primvar with values at vertices; empty: this kind has none
    reader       shader ID that reads the primvar
    """

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
    """Connect an image to the surface shader of the material `look`; `primvars:st` are the UVs."""
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
    """Store values at a mesh's vertices, and connect them to its surface shader.

    look     path of the mesh's material
    values   (n,) or (n, 3), float32
    indices  (vertices,), the index into `values` for each vertex; None: one value per vertex
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
    """Connect the primvar of a kind to the surface shader. The mesh may get the primvar later."""
    feed, stage = FEEDS[kind], mesh.GetPrim().GetStage()
    reader = UsdShade.Shader.Define(stage, look.AppendChild(feed.primvar))
    reader.CreateIdAttr(feed.reader)
    reader.CreateInput("varname", _Types.String).Set(feed.primvar)
    _connect(stage, look, feed, reader.CreateOutput("result", feed.output_type))


def _connect(stage: Usd.Stage, look: Sdf.Path, feed: _Feed, source: UsdShade.Output) -> None:
    surface = UsdShade.Shader(stage.OverridePrim(look.AppendChild("surface")))
    surface.CreateInput(feed.input, feed.type).ConnectToSource(source)
