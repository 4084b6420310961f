"""Read the appearances of a composed stage: those of the channels, and the material of a mesh."""

import itertools
from typing import get_args

from pxr import Sdf, Usd, UsdGeom, UsdShade

from stereocell.formats.gltf import Material
from stereocell.model.channel import (
    DEFAULT_FUNCTION,
    OpacityPoints,
    SurfaceConfidence,
    TransferFunctions2d,
)
from stereocell.model.errors import StageError
from stereocell.model.settings import MAX_VOXEL_VALUE
from stereocell.usd.composed_appearance import ComposedAppearance, StatedLevel
from stereocell.usd.layer import BUILT_COLOR
from stereocell.usd.numbers2d import read_numbers
from stereocell.usd.read_attributes import (
    color_of,
    numbers_of,
    require_still,
    select_variant,
    shortest,
    value_of,
)
from stereocell.usd.read_shapes2d import read_shapes
from stereocell.usd.read_textures import feeder
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import read_as, text_of

BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_MAX_POINTS = 10_000  # largest number of opacity points; the function is drawn with 256 values
_VOLUME_WINDOW = "stereocell:volumeWindow"


def read_appearances(stage: Usd.Stage) -> list[ComposedAppearance]:
    """Return the appearances of all active channels, in the stage's order.

    Raises StageError if there is none, or for invalid values.
    """
    group = specimen_of(stage).channels
    prims = stage.GetPrimAtPath(group).GetChildren()
    found = [_read_appearance(prim) for prim in prims if prim.IsA(UsdShade.Material)]
    if not found:
        layer = stage.GetRootLayer().realPath
        raise StageError(
            f"{layer}: found no active channel below {group}, expected one or more: activate one"
        )
    return found


def surface_of(prim: Usd.Prim) -> UsdShade.Shader:
    """Return the UsdPreviewSurface of a mesh's material. Raises StageError if it has none."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if not material:
        raise StageError(f"{prim.GetPath()}: found no bound material, expected one")
    surface, _, _ = material.ComputeSurfaceSource()
    if not surface or surface.GetShaderId() != "UsdPreviewSurface":
        raise StageError(
            f"{material.GetPath()}.outputs:surface: found no UsdPreviewSurface, expected one"
        )
    return surface


def material_of(surface: UsdShade.Shader) -> Material:
    """Return the glTF material for a UsdPreviewSurface.

    It is white if an image or the mesh's own colours feed the colour. Raises StageError for invalid
    values.
    """
    color = WHITE
    if feeder(surface, "color") is None:
        diffuse = _color_source(surface)
        if diffuse is None:
            raise StageError(
                f"{surface.GetPath()}.inputs:diffuseColor: found no value, expected a colour"
            )
        color = color_of(diffuse)
    # The defaults below are those of the specification of UsdPreviewSurface.
    emissive = _source(surface, "emissiveColor")
    return Material(
        color,
        _share(surface, "metallic", 0.0),
        _share(surface, "roughness", 0.5),
        _opacity(surface),
        BLACK if emissive is None or emissive.Get() is None else color_of(emissive),
    )


def _opacity(surface: UsdShade.Shader) -> float:
    """Return a surface's opacity, 0..1. With an opacity threshold, it is either 0 or 1."""
    opacity = _share(surface, "opacity", 1.0)
    threshold = _share(surface, "opacityThreshold", 0.0)
    return opacity if threshold == 0 else float(opacity >= threshold)


def edited_color(material: Usd.Prim) -> Usd.Attribute | None:
    """Return the attribute `inputs:color` of a material if it was edited since the build."""
    interface = _interface_color(material)
    surface = material.GetChild("surface")
    repeated = surface.GetAttribute("inputs:diffuseColor") if surface else None
    built = repeated.GetCustomDataByKey(BUILT_COLOR) if repeated else None
    return interface if interface and built is not None and interface.Get() != built else None


def _interface_color(material: Usd.Prim) -> Usd.Attribute | None:
    """Return the attribute that gives a material's `inputs:color` its value, through connections.

    A layer may connect it to another channel's colour. Raises StageError if a shader feeds it.
    """
    return _source(UsdShade.Material(material), "color")


def _color_source(surface: UsdShade.Shader) -> Usd.Attribute | None:
    """Return the attribute that has a surface's colour.

    The colour is stored twice: as input of the material, and again in the shader, for programs that
    do not follow connections. An edit of the shader's value counts only if the material's input
    was not edited.
    """
    source = _source(surface, "diffuseColor")
    is_own = source is not None and source.GetPrim() == surface.GetPrim()
    edited = edited_color(surface.GetPrim().GetParent()) if is_own else None
    return edited or source


def _channel_color(prim: Usd.Prim) -> Usd.Attribute:
    """Return the attribute that has a channel's colour: the material's if the shader has none."""
    surface = UsdShade.Shader(prim.GetChild("surface"))
    diffuse = surface.GetInput("diffuseColor") if surface else None
    has_value = diffuse and not diffuse.HasConnectedSource() and diffuse.Get() is not None
    found = _color_source(surface) if has_value else None
    return found or _interface_color(prim) or prim.GetAttribute("inputs:color")


def _read_appearance(prim: Usd.Prim) -> ComposedAppearance:
    variants = prim.GetVariantSet("transferFunction")
    chosen = variants.GetVariantSelection() or DEFAULT_FUNCTION
    names = sorted(variants.GetVariantNames(), key=lambda name: (name != DEFAULT_FUNCTION, name))
    functions, shapes = {}, {}
    for name in names or [chosen]:  # a flattened stage has only the selected function, no variants
        if names:
            select_variant(prim, "transferFunction", name)
        functions[name] = _opacity_points(prim)
        if found := read_shapes(prim):
            shapes[name] = found
    if chosen not in functions:
        raise StageError(
            f"{prim.GetPath()}: transferFunction is {chosen!r}, expected one of "
            f"{', '.join(functions)}: select one of them"
        )
    window = _window(prim, "stereocell:window")
    return ComposedAppearance(
        prim.GetName(),
        prim.GetDisplayName() or prim.GetName(),
        color_of(_channel_color(prim)),
        window,
        # Only stages of other programs lack a volume window.
        _window(prim, _VOLUME_WINDOW) if prim.GetAttribute(_VOLUME_WINDOW).HasValue() else window,
        _number(prim, "stereocell:isoValue"),
        _surface_confidence(prim, "stereocell:surfaceVerdict"),
        chosen,
        functions,
        TransferFunctions2d(functions=shapes, **read_numbers(prim)),
        _number(prim, "stereocell:threshold"),
        text_of(prim.GetAttribute("stereocell:surfaceReason")),
        _level(prim),
        shows_at_first(prim),
    )


def shows_at_first(prim: Usd.Prim) -> bool:
    """Return whether a channel, given by its material, is visible when the specimen is opened.

    A channel without a stated visibility is visible. Raises StageError for an animated visibility.
    """
    stage = prim.GetStage()
    path = specimen_of(stage).shown.AppendChild(prim.GetName())
    shown = UsdGeom.Imageable(stage.GetPrimAtPath(path))
    if not shown:
        return True
    attribute = shown.GetVisibilityAttr()
    require_still(attribute)
    return bool(attribute.Get() != UsdGeom.Tokens.invisible)


def _level(prim: Usd.Prim) -> StatedLevel | None:
    iso, smoothing = (_number(prim, f"stereocell:level{name}") for name in ("Iso", "Smoothing"))
    if iso is None:
        return None
    background = None
    if prim.GetAttribute(name := "stereocell:levelBackground").Get() is not None:
        low, high = (shortest(number) for number in numbers_of(prim, name, 2))
        background = low, high
    return StatedLevel(iso, background, smoothing or 0.0)


def _window(prim: Usd.Prim, name: str) -> tuple[float, float]:
    low, high = (shortest(number) for number in numbers_of(prim, name, 2))
    if not low < high:
        raise StageError(
            f"{prim.GetPath()}.{name} is ({low:g}, {high:g}), expected the first number below the "
            "second"
        )
    if max(-low, high) > MAX_VOXEL_VALUE:
        raise StageError(
            f"{prim.GetPath()}.{name} is ({low:g}, {high:g}), expected voxel values from "
            f"{-MAX_VOXEL_VALUE:g} to {MAX_VOXEL_VALUE:g}"
        )
    return low, high


def _number(prim: Usd.Prim, name: str) -> float | None:
    value = read_as(prim.GetAttribute(name), Sdf.ValueTypeNames.Float)
    return None if value is None else shortest(value)


def _surface_confidence(prim: Usd.Prim, name: str) -> SurfaceConfidence:
    value = read_as(prim.GetAttribute(name), Sdf.ValueTypeNames.Token)
    if value is None:  # only stages of other programs have no such attribute
        return "clear"
    for confidence in get_args(SurfaceConfidence):
        if value == confidence:
            return confidence
    known = ", ".join(get_args(SurfaceConfidence))
    raise StageError(f"{prim.GetPath()}.{name} is {value!r}, expected one of {known}")


def _opacity_points(prim: Usd.Prim) -> OpacityPoints:
    field = f"{prim.GetPath()}.stereocell:opacityPoints"
    given = value_of(prim, "stereocell:opacityPoints", Sdf.ValueTypeNames.Float2Array)
    if len(given) > _MAX_POINTS:
        raise StageError(f"{field}: found {len(given)} pairs, expected at most {_MAX_POINTS}")
    points = tuple((float(x), float(y)) for x, y in given)
    if not points:
        raise StageError(f"{field}: found no pairs, expected pairs of intensity and opacity")
    outside = [number for point in points for number in point if not 0 <= number <= 1]
    if outside:
        raise StageError(f"{field}: found {outside[0]:g}, expected numbers from 0 to 1")
    if any(after[0] < before[0] for before, after in itertools.pairwise(points)):
        raise StageError(
            f"{field}: found falling intensities, expected rising ones: sort the pairs"
        )
    return points


def _share(surface: UsdShade.Shader, name: str, default: float) -> float:
    source = _source(surface, name)
    value = read_as(source, Sdf.ValueTypeNames.Float)
    return default if value is None else min(max(shortest(value), 0.0), 1.0)


def _source(node: UsdShade.Shader | UsdShade.Material, name: str) -> Usd.Attribute | None:
    """Return the attribute that gives an input its value, through connections."""
    given = node.GetInput(name)
    attributes = given.GetValueProducingAttributes() if given else []
    if not attributes:
        return None
    if UsdShade.Output.IsOutput(attributes[0]):
        raise StageError(
            f"{node.GetPath()}.inputs:{name}: found a connection to {attributes[0].GetPath()}, "
            "expected a plain value: disconnect it"
        )
    return attributes[0]
