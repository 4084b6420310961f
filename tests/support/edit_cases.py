"""Edits of a stage as artists make them, with their outcomes: taken over, refused or reported.

Each edit is made by USD's own API in a layer over the stage of two tiles (`support.bundles`). The
table in docs/edit-table.md is printed by
`PYTHONPATH=pipeline:tests python tests/support/edit_cases.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

Outcome = Literal["taken", "refused", "reported"]
CHANNEL = "/Specimen/Channels/CD31"
SURFACE = f"{CHANNEL}/surface"
TILE = "/Specimen/Tiles/r0_c0"
BRANCH = f"{TILE}/CD31"
MESH = f"{BRANCH}/CD31_r0_c0"
VOLUME = f"{MESH}_volume"
_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class EditCase:
    """One edit.

    what    description of the edit for the table of the docs
    change  makes the edit on a stage whose edit target is the artist's layer
    words   text of the line that refuses or reports the edit; for a taken edit, its effect
    is_partial  whether only a part of the edit is lost
    """

    what: str
    change: Callable[[Usd.Stage], object]
    outcome: Outcome
    words: str
    is_partial: bool = False


def _put(
    path: str, name: str, kind: Sdf.ValueTypeName, value: object, *times: float
) -> Callable[[Usd.Stage], object]:
    """Return an edit of one attribute, at the default time or at others."""

    def change(stage: Usd.Stage) -> None:
        attribute = stage.OverridePrim(path).CreateAttribute(name, kind, custom=False)
        for time in times or (Usd.TimeCode.Default(),):
            attribute.Set(value, time)

    return change


def _hide(path: str) -> Callable[[Usd.Stage], object]:
    return lambda stage: UsdGeom.Imageable(stage.OverridePrim(path)).MakeInvisible()


def _name(path: str, name: str) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.OverridePrim(path).SetDisplayName(name)


def _move(path: str, *times: float) -> Callable[[Usd.Stage], object]:
    def change(stage: Usd.Stage) -> None:
        op = UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp(opSuffix="mine")
        for time in times or (Usd.TimeCode.Default(),):
            op.Set(Gf.Vec3d(0, 5, 0), time)

    return change


def define_material(
    stage: Usd.Stage, path: str, color: tuple[float, float, float]
) -> UsdShade.Material:
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/preview")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", _Types.Color3f).Set(Gf.Vec3f(*color))
    output = shader.CreateOutput("surface", _Types.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    return material


def _bind(where: str, strength: str) -> Callable[[Usd.Stage], object]:
    def change(stage: Usd.Stage) -> None:
        material = define_material(stage, "/Specimen/Mine", (0, 1, 0))
        UsdShade.MaterialBindingAPI.Apply(stage.OverridePrim(where)).Bind(material, strength)

    return change


def define_camera(stage: Usd.Stage, roll_deg: float = 0) -> None:
    """Add a camera 20 um in front of the sphere's middle."""
    camera = UsdGeom.Camera.Define(stage, "/Specimen/Cameras/close")
    camera.GetPrim().SetDisplayName("Close")
    camera.AddTranslateOp().Set(Gf.Vec3d(10, -5, 24))
    if roll_deg:
        camera.AddRotateZOp().Set(roll_deg)
    camera.CreateFocalLengthAttr(50.0)
    camera.CreateVerticalApertureAttr(20.0)


def define_arrow(stage: Usd.Stage, path: str = "/Specimen/Annotations/Arrow") -> UsdGeom.Mesh:
    """Add a flat arrow of three triangles that points down at the sphere."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = [(10, 0, 4), (8, 4, 4), (12, 4, 4), (9, 4, 4), (11, 4, 4), (11, 9, 4), (9, 9, 4)]
    mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in points])
    mesh.CreateFaceVertexCountsAttr([3, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 2, 1, 3, 4, 5, 6])
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDisplayColorAttr([Gf.Vec3f(0, 0, 1)])
    return mesh


def define_wire(stage: Usd.Stage) -> UsdGeom.BasisCurves:
    """Add a straight wire through the sphere's middle, 1 um thick."""
    curves = UsdGeom.BasisCurves.Define(stage, "/Specimen/Electrode/Wire")
    curves.CreateTypeAttr("linear")
    curves.CreateCurveVertexCountsAttr([2])
    curves.CreatePointsAttr([Gf.Vec3f(2, -5, 4), Gf.Vec3f(18, -5, 4)])
    curves.CreateWidthsAttr([1.0])
    return curves


def _draw_as_cards(stage: Usd.Stage) -> None:
    UsdGeom.ModelAPI.Apply(stage.GetPrimAtPath(TILE)).CreateModelDrawModeAttr("cards")


def _green_class(stage: Usd.Stage) -> str:
    look = stage.CreateClassPrim("/_green")
    look.CreateAttribute("inputs:color", _Types.Color3f).Set(Gf.Vec3f(0, 1, 0))
    return "/_green"


def inherit_color(stage: Usd.Stage) -> None:
    """Let a channel inherit a class that states its colour."""
    stage.GetPrimAtPath(CHANNEL).GetInherits().AddInherit(_green_class(stage))


def _specialize_color(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath(CHANNEL).GetSpecializes().AddSpecialize(_green_class(stage))


def broadcast_color(stage: Usd.Stage) -> None:
    """State a channel's colour on the class that the specimens of all stages inherit."""
    channel = stage.OverridePrim("/__class__/Specimen/Channels/CD31")
    channel.CreateAttribute("inputs:color", _Types.Color3f, custom=False).Set(Gf.Vec3f(0, 1, 0))


def _connect_color(stage: Usd.Stage) -> None:
    """Connect a channel's colour to an input of a palette."""
    palette = UsdShade.NodeGraph.Define(stage, "/Specimen/Palette")
    vessels = palette.CreateInput("vessels", _Types.Color3f)
    vessels.Set(Gf.Vec3f(0, 1, 0))
    channel = UsdShade.Material(stage.GetPrimAtPath(CHANNEL))
    channel.GetInput("color").ConnectToSource(vessels)


def _bind_to_collection(*, is_bound: bool) -> Callable[[Usd.Stage], object]:
    def change(stage: Usd.Stage) -> None:
        root = stage.OverridePrim("/Specimen")
        collection = Usd.CollectionAPI.Apply(root, "vessels")
        collection.CreateIncludesRel().SetTargets([Sdf.Path(MESH)])
        if is_bound:
            material = define_material(stage, "/Specimen/Mine", (0, 1, 0))
            UsdShade.MaterialBindingAPI.Apply(root).Bind(
                collection, material, "vessels", UsdShade.Tokens.strongerThanDescendants
            )

    return change


def _relocate(old: str, new: str) -> Callable[[Usd.Stage], object]:
    def change(stage: Usd.Stage) -> None:
        stage.GetRootLayer().relocates = [(Sdf.Path(old), Sdf.Path(new))]

    return change


def color_in_variant(where: str) -> Callable[[Usd.Stage], object]:
    """Return an edit that states a channel's colour in a variant set on a prim."""

    def change(stage: Usd.Stage) -> None:
        palette = stage.GetPrimAtPath(where).GetVariantSets().AddVariantSet("palette")
        palette.AddVariant("green")
        palette.SetVariantSelection("green")
        with palette.GetVariantEditContext():
            channel = stage.OverridePrim(CHANNEL)
            color = channel.CreateAttribute("inputs:color", _Types.Color3f, custom=False)
            color.Set(Gf.Vec3f(0, 1, 0))

    return change


def _keep_in_variant(stage: Usd.Stage) -> None:
    palette = stage.GetPrimAtPath("/Specimen").GetVariantSets().AddVariantSet("palette")
    for name in ("day", "night"):
        palette.AddVariant(name)
    palette.SetVariantSelection("night")
    with palette.GetVariantEditContext():
        stage.GetAttributeAtPath(f"{CHANNEL}.stereocell:window").Set(Gf.Vec2f(200, 300))
    palette.SetVariantSelection("day")


def _forget_the_set(stage: Usd.Stage) -> None:
    layer = stage.GetEditTarget().GetLayer()
    spec = Sdf.CreatePrimInLayer(layer, CHANNEL)
    variants = Sdf.VariantSetSpec(spec, "transferFunction")
    variant = Sdf.VariantSpec(variants, "default").primSpec
    points = Sdf.AttributeSpec(variant, "stereocell:opacityPoints", _Types.Float2Array)
    points.default = [Gf.Vec2f(0, 0), Gf.Vec2f(1, 0.5)]


def _choose(path: str, name: str, variant: str) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.GetPrimAtPath(path).GetVariantSet(name).SetVariantSelection(variant)


def _fade(stage: Usd.Stage) -> None:
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(MESH))
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "displayOpacity", _Types.FloatArray, UsdGeom.Tokens.vertex
    )
    primvar.Set(
        [k / len(mesh.GetPointsAttr().Get()) for k in range(len(mesh.GetPointsAttr().Get()))]
    )


def _hide_in_an_instance(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath(TILE).SetInstanceable(True)
    over = Sdf.CreatePrimInLayer(stage.GetEditTarget().GetLayer(), BRANCH)
    hidden = Sdf.AttributeSpec(over, "visibility", _Types.Token)
    hidden.default = "invisible"


def _add_to_a_level(stage: Usd.Stage) -> None:
    """Add an arrow inside the finest level of detail, and select another one."""
    levels = stage.GetPrimAtPath(TILE).GetVariantSet("lod")
    levels.SetVariantSelection("lod0")
    with levels.GetVariantEditContext():
        define_arrow(stage, f"{TILE}/Arrow")
    levels.SetVariantSelection("lod1")


CASES: tuple[EditCase, ...] = (
    EditCase(
        "`inputs:color` of a channel",
        _put(CHANNEL, "inputs:color", _Types.Color3f, Gf.Vec3f(0, 1, 0)),
        "taken",
        "surfaces and volumes of the channel",
    ),
    EditCase(
        "`inputs:colour` of a channel (a typo)",
        _put(CHANNEL, "inputs:colour", _Types.Color3f, Gf.Vec3f(0, 1, 0)),
        "reported",
        "inputs:colour is not taken over: no reader knows this name: did you mean inputs:color",
    ),
    EditCase(
        "`inputs:color` of a channel that is not there",
        _put("/Specimen/Channels/CD13", "inputs:color", _Types.Color3f, Gf.Vec3f(0, 1, 0)),
        "reported",
        "/Specimen/Channels/CD13 is not taken over: the stage has no such prim: did you mean CD31",
    ),
    EditCase(
        "`inputs:color` by a class that a channel specializes",
        _specialize_color,
        "reported",
        "CD31.inputs:color is not taken over: the stage's own value in channels.usda is stronger",
    ),
    EditCase(
        "`inputs:color` over time",
        _put(CHANNEL, "inputs:color", _Types.Color3f, Gf.Vec3f(0, 1, 0), 1, 2),
        "refused",
        "CD31.inputs:color: found values over time",
    ),
    EditCase(
        "`inputs:color` by a class that a channel inherits",
        inherit_color,
        "taken",
        "surfaces and volumes of the channel",
    ),
    EditCase(
        "`inputs:color` by the class `/__class__/Specimen`",
        broadcast_color,
        "taken",
        "surfaces and volumes of the channel",
    ),
    EditCase(
        "`inputs:color` of a channel, connected to an input of a node graph",
        _connect_color,
        "taken",
        "surfaces and volumes of the channel",
    ),
    EditCase(
        "`inputs:color` in the selected variant of a set on `/Specimen`",
        color_in_variant("/Specimen"),
        "taken",
        "surfaces and volumes of the channel",
    ),
    EditCase(
        "`inputs:roughness` of a channel's shader",
        _put(SURFACE, "inputs:roughness", _Types.Float, 0.2),
        "taken",
        "roughness of the surfaces",
    ),
    EditCase(
        "`inputs:opacity` of a channel's shader",
        _put(SURFACE, "inputs:opacity", _Types.Float, 0.4),
        "taken",
        "translucent surfaces: `alphaMode` BLEND, in `specimen.usdz` too",
    ),
    EditCase(
        "`inputs:emissiveColor` of a channel's shader",
        _put(SURFACE, "inputs:emissiveColor", _Types.Color3f, Gf.Vec3f(0, 0.5, 0)),
        "taken",
        "surfaces that glow, in `specimen.usdz` too",
    ),
    EditCase(
        "`displayOpacity` of a channel",
        _put(CHANNEL, "primvars:displayOpacity", _Types.FloatArray, [0.4]),
        "taken",
        "translucent surfaces of the channel",
    ),
    EditCase(
        "`displayOpacity` of a mesh",
        _put(MESH, "primvars:displayOpacity", _Types.FloatArray, [0.4]),
        "taken",
        "a translucent surface in that tile",
    ),
    EditCase(
        "`displayOpacity` of a mesh by its points",
        _fade,
        "reported",
        "primvars:displayOpacity is not taken over: the bundle takes over one value "
        "for the whole mesh",
    ),
    EditCase(
        "`displayColor` of a mesh",
        _put(MESH, "primvars:displayColor", _Types.Color3fArray, [Gf.Vec3f(0, 1, 0)]),
        "taken",
        "the colour of that tile's surface",
    ),
    EditCase(
        "`inputs:clearcoat` of a channel's shader",
        _put(SURFACE, "inputs:clearcoat", _Types.Float, 0.5),
        "reported",
        "surface.inputs:clearcoat is not taken over: the bundle does not use it",
    ),
    EditCase(
        "`stereocell:window` of a channel",
        _put(CHANNEL, "stereocell:window", _Types.Float2, Gf.Vec2f(200, 3000)),
        "taken",
        "voxels of the volumes",
    ),
    EditCase(
        "`stereocell:lut` of a channel",
        _put(CHANNEL, "stereocell:lut", _Types.Asset, Sdf.AssetPath("./stage.usda")),
        "reported",
        "stereocell:lut is not taken over: it is computed from other values: edit "
        "stereocell:opacity",
    ),
    EditCase("display name of a channel", _name(CHANNEL, "Vessels"), "taken", "its name"),
    EditCase(
        "variant `transferFunction` of a channel",
        _choose(CHANNEL, "transferFunction", "sharp"),
        "taken",
        "the function that the viewer opens with",
    ),
    EditCase(
        "an opinion in a variant of a set that the layer does not list",
        _forget_the_set,
        "reported",
        "variant 'default' of transferFunction on /Specimen/Channels/CD31 is not taken over: its",
    ),
    EditCase(
        "an opinion in a variant that is not selected",
        _keep_in_variant,
        "reported",
        "variant 'night' of palette on /Specimen is not taken over: it is not selected",
    ),
    EditCase("transform of a tile", _move(TILE), "taken", "surfaces, volumes and boxes move"),
    EditCase(
        "transform over time",
        _move(TILE, 1, 2),
        "refused",
        "r0_c0.xformOp:translate:mine: found values over time",
    ),
    EditCase("visibility of a tile", _hide(TILE), "taken", "the tile is left out"),
    EditCase(
        "visibility of `/Specimen/Shown/CHANNEL`",
        _hide("/Specimen/Shown/CD31"),
        "taken",
        "whether the channel shows at first, in `specimen.usdz` too",
    ),
    EditCase(
        "visibility over time",
        _put(TILE, "visibility", _Types.Token, "invisible", 1, 2),
        "refused",
        "r0_c0.visibility: found values over time",
    ),
    EditCase(
        "`active` of a tile",
        lambda stage: stage.GetPrimAtPath(TILE).SetActive(False),
        "taken",
        "the tile is left out",
    ),
    EditCase(
        "`purpose` of a tile: `guide` or `proxy`",
        _put(TILE, "purpose", _Types.Token, "guide"),
        "taken",
        "the tile is left out, as in other final pictures",
    ),
    EditCase(
        "`purpose` of a mesh: `guide` or `proxy`",
        _put(MESH, "purpose", _Types.Token, "proxy"),
        "taken",
        "the surface is left out",
    ),
    EditCase("display name of a tile", _name(TILE, "Left half"), "taken", "its name"),
    EditCase(
        "visibility of a channel's material",
        _put(CHANNEL, "visibility", _Types.Token, "invisible"),
        "reported",
        "CD31.visibility is not taken over: this prim draws nothing in the bundle",
    ),
    EditCase(
        "draw mode of a tile",
        _draw_as_cards,
        "reported",
        "r0_c0.model:drawMode is not taken over: draw modes are stand-ins",
    ),
    EditCase(
        "`subdivisionScheme` of a mesh",
        _put(MESH, "subdivisionScheme", _Types.Token, "catmullClark"),
        "reported",
        "CD31_r0_c0.subdivisionScheme is not taken over: surfaces are not subdivided",
    ),
    EditCase(
        "a primvar of one's own on a mesh",
        _put(MESH, "primvars:mine", _Types.FloatArray, [1.0]),
        "reported",
        "primvars:mine is not taken over: no material of the mesh reads this primvar",
    ),
    EditCase(
        "a material bound on the specimen, stronger than its descendants",
        _bind("/Specimen", "strongerThanDescendants"),
        "taken",
        "surfaces below it; a line says that volumes keep their colours",
    ),
    EditCase(
        "a material bound to a collection on the specimen, stronger than its descendants",
        _bind_to_collection(is_bound=True),
        "taken",
        "surfaces of the collection; a line says that volumes keep their colours",
    ),
    EditCase(
        "a collection to which no material is bound",
        _bind_to_collection(is_bound=False),
        "reported",
        "collection:vessels:includes is not taken over: no material is bound to this collection",
    ),
    EditCase(
        "a tile or channel at another path, by `relocates`",
        _relocate(TILE, "/Specimen/Tiles/left"),
        "refused",
        "relocates /Specimen/Tiles/r0_c0 to /Specimen/Tiles/left, expected",
    ),
    EditCase(
        "a material bound on the specimen, weaker",
        _bind("/Specimen", "weakerThanDescendants"),
        "reported",
        "bound on /Specimen, is not taken over: the channels' own materials are stronger",
    ),
    EditCase(
        "a material that is bound nowhere",
        lambda stage: define_material(stage, "/Specimen/Mine", (0, 1, 0)),
        "reported",
        "Material /Specimen/Mine is not taken over: no mesh is bound to it",
    ),
    EditCase("an added mesh", define_arrow, "taken", "a layer of the bundle, shown and hidden"),
    EditCase("added curves", define_wire, "taken", "a layer of the bundle: tubes"),
    EditCase(
        "an added mesh over time",
        lambda stage: define_arrow(stage).GetPointsAttr().Set([Gf.Vec3f(0)] * 7, 2.0),
        "refused",
        "Arrow.points: found values over time",
    ),
    EditCase(
        "an edit below a tile that is an instance",
        _hide_in_an_instance,
        "reported",
        "/r0_c0/CD31 is not taken over: USD ignores opinions below an instance",
    ),
    EditCase(
        "visibility of an added group over time",
        lambda stage: (
            UsdGeom.Xform.Define(stage, "/Specimen/Kit")
            .CreateVisibilityAttr()
            .Set("invisible", 2.0)
        ),
        "refused",
        "Kit.visibility: found values over time",
    ),
    EditCase(
        "a primvar of one's own on an added group",
        lambda stage: (
            UsdGeom.PrimvarsAPI(UsdGeom.Xform.Define(stage, "/Specimen/Kit"))
            .CreatePrimvar("displayColour", _Types.Color3fArray)
            .Set([Gf.Vec3f(1, 0, 0)])
        ),
        "reported",
        "Kit.primvars:displayColour is not taken over: no material of the mesh reads this primvar",
    ),
    EditCase(
        "an added mesh in a level of detail that is not selected",
        _add_to_a_level,
        "reported",
        "/r0_c0/Arrow is not taken over: it is in a variant that is not selected",
    ),
    EditCase(
        "an added mesh or curve without faces",
        lambda stage: UsdGeom.Mesh.Define(stage, "/Specimen/Annotations/Nothing"),
        "reported",
        "Mesh /Specimen/Annotations/Nothing is not taken over",
    ),
    EditCase(
        "an added sphere, cube or other shape without points",
        lambda stage: UsdGeom.Sphere.Define(stage, "/Specimen/Annotations/Ball"),
        "reported",
        "Sphere /Specimen/Annotations/Ball is not taken over: the bundle uses no prims of",
    ),
    EditCase(
        "a camera",
        define_camera,
        "taken",
        "a named view of the viewer, in order",
    ),
    EditCase(
        "a camera with a roll",
        lambda stage: define_camera(stage, roll_deg=30),
        "reported",
        "roll of camera 'Close', 30 degrees, is not taken over: the viewer keeps the up axis "
        "vertical",
        is_partial=True,
    ),
    EditCase(
        "brightness, colour and turn of a light of the stage",
        _put("/Specimen/Lights/key", "inputs:intensity", _Types.Float, 2.0),
        "taken",
        "the viewer's lamps, which then stand with the specimen",
    ),
    EditCase(
        "an added distant light or sphere",
        lambda stage: UsdLux.SphereLight.Define(stage, "/Specimen/Lights/Lamp"),
        "taken",
        "a lamp of the viewer; a sphere shines as a point",
    ),
    EditCase(
        "an added dome, with an image or without",
        lambda stage: UsdLux.DomeLight.Define(stage, "/Specimen/Lights/Sky"),
        "taken",
        "the light from all around, by the mean of its halves outside of path tracing",
    ),
    EditCase(
        "`active` of `/Specimen/Lights`",
        lambda stage: stage.GetPrimAtPath("/Specimen/Lights").SetActive(False),
        "taken",
        "no light in `specimen.usdz`; the viewer keeps its own lamps",
    ),
    EditCase(
        "brightness of a light over time",
        _put("/Specimen/Lights/key", "inputs:intensity", _Types.Float, 2.0, 1, 2),
        "refused",
        "key.inputs:intensity: found values over time",
    ),
    EditCase(
        "an added rectangle, disk or cylinder of light",
        lambda stage: UsdLux.RectLight.Define(stage, "/Specimen/Lights/Lamp"),
        "reported",
        "RectLight /Specimen/Lights/Lamp is not taken over: the viewer has only distant, "
        "sphere and dome lights",
    ),
    EditCase(
        "`inputs:specular` of a light",
        _put("/Specimen/Lights/key", "inputs:specular", _Types.Float, 0.5),
        "reported",
        "key.inputs:specular is not taken over: the bundle does not use it",
        is_partial=True,
    ),
    EditCase(
        "a prim outside `/Specimen`",
        lambda stage: UsdGeom.Cube.Define(stage, "/Box"),
        "reported",
        "Cube /Box is not taken over: it lies outside /Specimen",
    ),
)


def main() -> None:
    """Print the table as Markdown."""
    print("\n".join(markdown()))


def markdown() -> list[str]:
    """Return the lines of the docs' table."""
    rows = [(case.what, case.outcome, case.words) for case in CASES]
    order = ("taken", "refused", "reported")
    lines = ["| edit | is | in the bundle, or the line that is printed |", "|---|---|---|"]
    for what, outcome, words in sorted(rows, key=lambda row: order.index(row[1])):
        shown = words if outcome == "taken" else f"`... {words} ...`"
        lines.append(f"| {what} | {outcome} | {shown} |")
    return lines


if __name__ == "__main__":
    main()
