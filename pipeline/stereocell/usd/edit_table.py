"""The edits of a stage that a bundle takes over: names of properties and metadata, by place.

A place is the role of a prim in the stage, such as `tile`, `mesh` or `channel`.

The readers of a composed stage read only these opinions. `find_lost_edits` compares the opinions of
an artist's layers with the table and reports those that are missing in it. If you make a reader
read a new name, add the name here. tests/bundle/test_edit_table.py tests each kind of row.

A name that begins with `@` is metadata of a prim; any other name is a property. `*` matches any
text.
"""

from fnmatch import fnmatchcase

from stereocell.usd.layer import DISPLAY_SCALE, OPENING_CUT, PAINTED_BY, SIDES
from stereocell.usd.numbers2d import ATTRIBUTES
from stereocell.usd.read_lights import INPUTS
from stereocell.usd.write_objects import (
    COLUMN,
    COLUMNS,
    DEFAULT,
    HIDDEN,
    LABELS,
    NAMES,
    TOUCHING,
    WALL_UM2,
)

_PLACED = ("xformOp:*", "xformOpOrder")
_SHOWN = ("visibility", "purpose", "@active")
# The shape of a mesh
_SHAPE = (
    "points",
    "faceVertexCounts",
    "faceVertexIndices",
    "orientation",
    "normals",
    "primvars:normals*",
)
# Display colour and opacity: all meshes below the prim inherit them
_DISPLAYED = ("primvars:displayColor*", "primvars:displayOpacity*")

TAKEN: dict[str, tuple[str, ...]] = {
    "specimen": (
        *_PLACED,
        *_SHOWN,
        *_DISPLAYED,
        "stereocell:modality",
        OPENING_CUT,
        "@displayName",
    ),
    "tiles": (*_PLACED, *_SHOWN, *_DISPLAYED, *SIDES.values()),
    "tile": (*_PLACED, *_SHOWN, *_DISPLAYED, "extentsHint", "@displayName"),
    "branch": (*_PLACED, *_SHOWN, *_DISPLAYED),
    "mesh": (
        *_PLACED,
        *_SHOWN,
        *_SHAPE,
        "primvars:st",
        "primvars:st:indices",
        "primvars:tangents*",
        LABELS,
        NAMES,
        TOUCHING,
        WALL_UM2,
    ),
    "volume": (
        *_PLACED,
        *_SHOWN,
        "stereocell:atlas",
        "stereocell:atlasSize",
        "stereocell:apron",
        "stereocell:boundsMin",
        "stereocell:boundsMax",
        "field:*",
    ),
    "field": ("filePath",),
    "channel": (
        "@active",
        "@displayName",
        "inputs:color",
        "outputs:surface",
        "primvars:displayOpacity",
        "stereocell:window",
        "stereocell:volumeWindow",
        "stereocell:opacityPoints",
        "stereocell:shape*",
        "stereocell:isoValue",
        "stereocell:surfaceVerdict",
        "stereocell:surfaceReason",
        "stereocell:levelIso",
        "stereocell:levelSmoothing",
        "stereocell:levelBackground",
        "stereocell:threshold",
        *ATTRIBUTES.values(),
        PAINTED_BY,
        COLUMNS,
        f"{COLUMN}*",
        DEFAULT,
        HIDDEN,
    ),
    "shown": ("visibility",),
    # Programs always write horizontalAperture and clippingRange. They need no report although they
    # have no effect: the window's shape decides the horizontal field of view.
    "camera": (
        *_PLACED,
        *_SHOWN,
        "focalLength",
        "horizontalAperture",
        "verticalAperture",
        "clippingRange",
        "@displayName",
    ),
    "light": (*_PLACED, *_SHOWN, *INPUTS, "@displayName"),
    "sphere": (*_PLACED, *_SHOWN, *INPUTS, "@displayName"),
    "lights": (*_PLACED, *_SHOWN),
    # A group is a prim that only holds additions, lights or cameras.
    "group": (*_PLACED, *_SHOWN, *_DISPLAYED),
    "addition": (
        *_PLACED,
        *_SHOWN,
        *_DISPLAYED,
        *_SHAPE,
        "curveVertexCounts",
        "widths",
        "type",
        "basis",
        "wrap",
        "@displayName",
    ),
    "material": ("outputs:surface",),
    "UsdPreviewSurface": (
        "info:id",
        "outputs:*",
        "inputs:diffuseColor",
        "inputs:metallic",
        "inputs:roughness",
        "inputs:opacity",
        "inputs:opacityThreshold",
        "inputs:emissiveColor",
    ),
    # These inputs are taken over only if an image or a primvar feeds them.
    "UsdPreviewSurface, fed": ("inputs:normal", "inputs:occlusion"),
    "UsdUVTexture": ("info:id", "outputs:*", "inputs:file", "inputs:st"),
    "UsdPrimvarReader": ("info:id", "outputs:*", "inputs:varname"),
}

# Values that the bundle computes again from other values of the stage, as place -> name -> the
# attribute to edit instead. Empty: programs write the value with any edit, so it needs no report.
DERIVED: dict[str, dict[str, str]] = {
    "specimen": {"extentsHint": ""},
    "channel": {
        "stereocell:lut": "stereocell:opacityPoints",
        "stereocell:isoConfidence": "stereocell:isoValue",
        "stereocell:levelFile": "stereocell:levelIso",
    },
    "mesh": {
        "extent": "",
        "stereocell:distance": "points",
        "stereocell:largestDistance": "points",
        "stereocell:distanceSamples": "points",
        "stereocell:shapeHash": "points",
    },
    "volume": {"extent": "", "material:binding": ""},
    "addition": {"extent": ""},
}

# Values that every bundle has: a layer that states them changes nothing
ASSUMED: dict[str, object] = {"subdivisionScheme": "none", "doubleSided": True}

# Reasons why a name is not read, as (pattern, reason); the first pattern that matches counts
REASONS: tuple[tuple[str, str], ...] = (
    (
        "model:*",
        "draw modes are stand-ins in other programs; the bundle draws the tile itself",
    ),
    ("subdivision*", "surfaces are not subdivided here: apply the subdivision and export points"),
    ("crease*", "surfaces are not subdivided here: apply the subdivision and export points"),
    ("corner*", "surfaces are not subdivided here: apply the subdivision and export points"),
    ("outputs:*", "the viewer draws with its own shaders, and reads only UsdPreviewSurface"),
    (
        "primvars:displayOpacity*",
        "the bundle takes over one value for the whole mesh, and this primvar has several",
    ),
    ("primvars:displayColor*", "another value feeds the colour of the mesh's material"),
    ("primvars:*", "no material of the mesh reads this primvar"),
    (DISPLAY_SCALE, "only display.usda and the Blender add-on use it; the viewer has its own size"),
    ("xformOp*", "this prim places nothing in the bundle"),
    ("purpose", "this prim draws nothing in the bundle"),
    ("visibility", "this prim draws nothing in the bundle"),
    ("userProperties:*", "properties of other programs stay in the stage"),
    ("collection:*", "no material is bound to this collection, and lamps light everything"),
    ("@customData", "custom data stay in the stage"),
    ("@assetInfo", "asset information stays in the stage"),
    ("@kind", "the kinds of prims stay in the stage"),
    ("@displayName", "the bundle has no name for this prim"),
)

# Reasons why an added prim is lost; the key is its type, or the end of it, as in SphereLight
ADDED: dict[str, str] = {
    "Light": "the viewer has only distant, sphere and dome lights",
    "Volume": "it is not the volume of a channel in a tile",
    "Material": "no mesh is bound to it",
    "Shader": "no surface uses it",
}


def is_taken(place: str, name: str) -> bool:
    """Return whether the bundle takes over edits of this name at this place."""
    return any(fnmatchcase(name, pattern) for pattern in TAKEN.get(place, ()))


def reason_of(name: str) -> str:
    """Return why no reader uses a name; empty: the name is not in REASONS."""
    return next((reason for pattern, reason in REASONS if fnmatchcase(name, pattern)), "")
