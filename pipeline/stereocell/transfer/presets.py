"""Titles and explanations of the transfer functions that a build makes, by the name in the stage.

The viewer's tables are generated from PRESETS by viewer_gltf/scripts/types.ts, which reads one row
as a name, a title and a sentence, each a single string. The other modules of `transfer` make the
functions of these names.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Preset:
    """One transfer function as users see it."""

    title: str  # in the list of functions
    sentence: str  # how the channel looks with it


PRESETS = {
    "default": Preset(
        "Translucent bodies",
        "The background is clear, the material translucent, its bright parts denser.",
    ),
    "soft": Preset(
        "Thin veil",
        "A thin veil: faint material shows too, and the inside stays visible.",
    ),
    "sharp": Preset(
        "Solid bodies",
        "A solid body with a crisp edge, almost opaque.",
    ),
    "surface": Preset(
        "Thin shell",
        "A thin shell where the surface lies. Inside and outside are clear.",
    ),
    "threshold": Preset(
        "All above the threshold",
        "All that is brighter than the channel's threshold, and nothing below it.",
    ),
    "arcs": Preset(
        "Boundaries of materials",
        "Boundaries between materials, found by how steeply the values rise there.",
    ),
    "heat": Preset(
        "Heat colours",
        "Little is dark red, much is bright, as PET and SPECT are read.",
    ),
    "grey": Preset(
        "Shades of grey",
        "Tissues in shades of grey, as on a slice.",
    ),
    "tissues": Preset(
        "Tissues in colour",
        "Skin, muscle and bone in colours of their own.",
    ),
    "air": Preset(
        "Air",
        "Only what is as thin as air, such as lungs and sinuses.",
    ),
    "fat": Preset(
        "Fat",
        "Only what has the density of fat.",
    ),
    "soft_tissue": Preset(
        "Soft tissue",
        "Only what has the density of muscles and organs.",
    ),
    "blood": Preset(
        "Blood",
        "Only what has the density of blood.",
    ),
    "bone": Preset(
        "Bone",
        "Only what is as dense as bone.",
    ),
}
