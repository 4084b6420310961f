"""Write the UsdPreviewSurface of a material, and repeat its colour on the mesh."""

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from stereocell.usd.layer import BUILT_COLOR

ROUGHNESS = 0.5  # roughness of all surfaces: the default of UsdPreviewSurface
Color = tuple[float, float, float]

_Types = Sdf.ValueTypeNames


def define_surface(material: UsdShade.Material, color: Color | None) -> UsdShade.Shader:
    """Define a material's shader `surface`, and connect it to the material's output.

    color  linear RGB; None: the shader gets no colour here, since the mesh's primvars feed it
    """
    path = material.GetPath().AppendChild("surface")
    surface = UsdShade.Shader.Define(material.GetPrim().GetStage(), path)
    surface.CreateIdAttr("UsdPreviewSurface")
    if color is not None:
        surface.CreateInput("diffuseColor", _Types.Color3f).Set(Gf.Vec3f(*color))
    surface.CreateInput("metallic", _Types.Float).Set(0.0)
    surface.CreateInput("roughness", _Types.Float).Set(ROUGHNESS)
    output = surface.CreateOutput("surface", _Types.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    return surface


def repeat_color(mesh: UsdGeom.Mesh, color: Color) -> None:
    """Write a colour as the mesh's display colour, for programs that draw without materials.

    The attribute's custom data hold the same colour. If the two differ, the colour was edited.
    """
    attribute = mesh.CreateDisplayColorAttr([Gf.Vec3f(*color)])
    attribute.SetCustomDataByKey(BUILT_COLOR, Gf.Vec3f(*color))


def repeats_color(attribute: Usd.Attribute) -> bool:
    """Return whether a display colour is still the one of the build."""
    built, value = attribute.GetCustomDataByKey(BUILT_COLOR), attribute.Get()
    return built is not None and value is not None and len(value) == 1 and value[0] == built
