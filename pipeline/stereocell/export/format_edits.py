"""List the edits of a stage that a file format can't hold, although a bundle takes them over.

Places and names are those of `usd/edit_table.py`. An export reports each of these edits in the same
words as `bundle`. tests/export/test_format_edits.py compares the lists with real files.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase

from pxr import Usd

from stereocell.usd.edit_table import TAKEN
from stereocell.usd.layer import OPENING_CUT, PAINTED_BY, SIDES
from stereocell.usd.layer_opinions import BuiltLayers
from stereocell.usd.lost_edits import WHOLE
from stereocell.usd.numbers2d import ATTRIBUTES
from stereocell.usd.specimen import specimen_of

Names = dict[str, tuple[str, ...]]  # patterns of property names, by place of `edit_table`


@dataclass(frozen=True, slots=True)
class Lack:
    """A kind of edit that a format can't hold, and the reason that messages give."""

    reason: str
    names: Names


_PARTS = ("specimen", "tiles", "tile", "branch", "mesh")
# Values of a material other than its colour
_SHADING = {
    "UsdPreviewSurface": tuple(
        name
        for name in TAKEN["UsdPreviewSurface"]
        if name.startswith("inputs:") and name != "inputs:diffuseColor"
    ),
    "UsdPreviewSurface, fed": ("*",),
    "channel": ("primvars:displayOpacity",),
    **dict.fromkeys(_PARTS, ("primvars:displayOpacity*",)),
}
_COLORS = {
    "channel": ("inputs:*", "outputs:surface", "material:binding*"),
    "UsdPreviewSurface": ("inputs:diffuseColor",),
    "UsdUVTexture": ("inputs:file",),
    **dict.fromkeys(_PARTS, ("primvars:displayColor*", "material:binding*")),
}
_VOLUMES = {
    "channel": (
        "stereocell:window",
        "stereocell:volumeWindow",
        "stereocell:opacityPoints",
        "stereocell:shape*",
        "transferFunction",
        *ATTRIBUTES.values(),
        PAINTED_BY,
    ),
    "volume": ("*",),
    "field": ("*",),
}

# Edits that only USD and a bundle can hold
_NOWHERE = (
    Lack("the file has no cameras", {"camera": (WHOLE,)}),
    Lack("the file has no names of tiles", {"tile": ("@displayName",)}),
    Lack(
        "only the viewer uses it",
        {
            "specimen": ("stereocell:modality", OPENING_CUT),
            "tiles": tuple(SIDES.values()),
            "channel": (
                "stereocell:isoValue",
                "stereocell:surface*",
                "stereocell:level*",
                "stereocell:threshold",
            ),
        },
    ),
)
_NO_LIGHTS = Lack(
    "the file has no lights", {**dict.fromkeys(("light", "sphere"), ("*", WHOLE)), "lights": ("*",)}
)
_NO_ADDITIONS = Lack("the file has only surfaces and volumes of channels", {"addition": (WHOLE,)})
NO_ADDITIONS_OF_PART = Lack(
    "a file of some tiles or of a region has only surfaces of channels", {"addition": (WHOLE,)}
)
_OF_CHANNELS = (*_NOWHERE, _NO_LIGHTS, _NO_ADDITIONS)
_NO_SPHERES = Lack("usdz is scaled, and has no lights with a position", {"sphere": ("*", WHOLE)})
_NO_SHOWN = Lack("--channels chooses the channels of this file", {"shown": ("visibility",)})
_NO_VOLUMES = Lack("the file has no volumes", _VOLUMES)
_NO_COLORS = Lack("the file has no colours", _COLORS)
_NO_SHADING = Lack("the file has only the colour of a material", _SHADING)
_NO_MATERIALS = Lack("the file has no materials", _SHADING)
_NO_SURFACES = Lack("the file has no surfaces", {"mesh": ("*",)})
_NO_NAMES = Lack(
    "the file has no names", {"channel": ("@displayName",), "specimen": ("@displayName",)}
)
_NO_FUNCTIONS = Lack(
    "the file has voxels, but no transfer functions",
    {"channel": tuple(name for name in _VOLUMES["channel"] if name != "stereocell:window")},
)

OF_GLTF = (*_NOWHERE, _NO_LIGHTS, _NO_VOLUMES)
OF_USDZ = (*_NOWHERE, _NO_VOLUMES, _NO_NAMES, _NO_SPHERES)
OF_PICTURES = (*_OF_CHANNELS, _NO_VOLUMES, _NO_SHADING, _NO_NAMES)
OF_SOLIDS = (*_OF_CHANNELS, _NO_VOLUMES, _NO_SHADING, _NO_SHOWN)
OF_PLY = (*OF_SOLIDS, _NO_NAMES)
OF_STL = (*_OF_CHANNELS, _NO_VOLUMES, _NO_MATERIALS, _NO_COLORS, _NO_SHOWN, _NO_NAMES)
OF_VOXELS = (*_OF_CHANNELS, _NO_SURFACES, _NO_MATERIALS, _NO_COLORS, _NO_SHOWN, _NO_FUNCTIONS)
OF_PRECOMPUTED = (*_OF_CHANNELS, _NO_MATERIALS, _NO_COLORS, _NO_SHOWN, _NO_FUNCTIONS)


def left_out(lacks: tuple[Lack, ...], place: str, name: str) -> str:
    """Return why a format leaves out an edit of a name at a place; empty: the format holds it.

    The name `@specifier` stands for the whole prim. A `*` does not match it.
    """
    for lack in lacks:
        patterns = lack.names.get(place, ())
        if name in patterns or (
            name != WHOLE and any(fnmatchcase(name, pattern) for pattern in patterns)
        ):
            return lack.reason
    return ""


def notes_on_functions(stage: Usd.Stage, lacks: tuple[Lack, ...]) -> Iterator[str]:
    """Yield a message for each channel whose transfer function a user's layer selects.

    Yields nothing if the format holds transfer functions.
    """
    reason, built = left_out(lacks, "channel", "transferFunction"), BuiltLayers(stage)
    # In the session layer this program selects variants to read them, so these are not edits.
    session = stage.GetSessionLayer()
    for prim in stage.GetPrimAtPath(specimen_of(stage).channels).GetChildren() if reason else ():
        choosing = [
            spec.layer
            for spec in prim.GetPrimStack()
            if spec.layer != session and "transferFunction" in spec.variantSelections
        ]
        if choosing and choosing[0] not in built:
            yield f"variant transferFunction of {prim.GetPath()} is not taken over: {reason}"
