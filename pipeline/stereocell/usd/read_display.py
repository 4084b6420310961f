"""Read the display colour and opacity of a mesh: its own primvars, or those of an ancestor.

Artists set these primvars on any prim, without a material. A bundle uses the display colour unless
an image or a primvar feeds the material's colour. It multiplies the display opacity by that of the
material.
"""

from pxr import Sdf, Usd, UsdGeom, UsdShade

from stereocell.usd.preview_surface import repeats_color
from stereocell.usd.read_attributes import color_of, shortest
from stereocell.usd.read_textures import feeder
from stereocell.usd.typed_values import read_as

_OPACITY = "displayOpacity"
_Types = Sdf.ValueTypeNames
Color = tuple[float, float, float]


def shows_display_color(surface: UsdShade.Shader) -> bool:
    """Return whether display colours apply: no shader feeds the colour of the material."""
    return feeder(surface, "color") is None


def display_color(mesh: Usd.Prim) -> Color | None:
    """Return the edited display colour of a mesh, linear RGB; None: not edited, or many colours.

    Raises StageError for a colour outside 0..1.
    """
    primvar = _find_edited_color(mesh)
    if primvar is None or not is_single(primvar):
        return None
    return color_of(primvar.GetAttr(), primvar.ComputeFlattened()[0])


def _find_edited_color(mesh: Usd.Prim) -> UsdGeom.Primvar | None:
    """Return a mesh's own or inherited display colour, unless the build wrote it."""
    prim = mesh
    while prim and not prim.IsPseudoRoot():
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
        is_stated = bool(primvar) and primvar.HasAuthoredValue()
        # Meshes inherit only constant primvars.
        is_heard = prim == mesh or (
            is_stated and primvar.GetInterpolation() == UsdGeom.Tokens.constant
        )
        if is_stated and is_heard and not repeats_color(primvar.GetAttr()):
            return primvar
        prim = prim.GetParent()
    return None


def has_many_display_colors(mesh: Usd.Prim) -> bool:
    """Return whether a mesh has its own display colours for its points, faces or corners."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("displayColor")
    return bool(primvar) and bool(primvar.HasValue()) and not is_single(primvar)


def display_opacity(mesh: Usd.Prim, channel: Usd.Prim | None) -> float:
    """Return the display opacity of a mesh times that of its channel, 0..1. The default is 1.

    Raises StageError for values of another type.
    """
    primvar = UsdGeom.PrimvarsAPI(mesh).FindPrimvarWithInheritance(_OPACITY)
    own = primvar.GetAttr() if is_single(primvar) else None
    product = 1.0
    for attribute in (own, channel.GetAttribute(f"primvars:{_OPACITY}") if channel else None):
        values = read_as(attribute, _Types.FloatArray)
        if values is not None and len(values) == 1:
            product *= min(max(shortest(values[0]), 0.0), 1.0)
    return product


def is_single(primvar: UsdGeom.Primvar) -> bool:
    """Return whether a primvar has one value for the whole mesh."""
    if not primvar or not primvar.HasValue():
        return False
    flat = primvar.ComputeFlattened()
    is_constant = primvar.GetInterpolation() == UsdGeom.Tokens.constant
    return flat is not None and is_constant and len(flat) == 1
