"""Titles and explanations of the transfer functions of a build, by their names in the stage.

The viewer's tables are generated from PRESETS by viewer_gltf/scripts/types.ts, which reads each row
as a name, a title and a sentence, each of them a single string. The other modules of `transfer`
make the functions with these names.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Preset:
    """One transfer function as users see it."""

    title: str  # in the list of functions
    sentence: str  # appearance of the channel with the function


PRESETS = {
    "default": Preset(
        "Translucent bodies",
        "The background is clear, and the material is translucent and denser where it is bright.",
    ),
    "soft": Preset(
        "Thin veil",
        "A thin veil that also shows faint material and leaves the inside visible.",
    ),
    "sharp": Preset(
        "Solid bodies",
        "A solid body with a crisp edge, almost opaque.",
    ),
    "surface": Preset(
        "Thin shell",
        "A thin shell at the surface; inside and outside are clear.",
    ),
    "threshold": Preset(
        "Above the threshold",
        "Everything brighter than the channel's threshold.",
    ),
    "arcs": Preset(
        "Boundaries of materials",
        "Boundaries between materials, found by how steeply the values rise there.",
    ),
    "heat": Preset(
        "Heat colours",
        "Little tracer is dark red and much is bright, as in readings of PET and SPECT.",
    ),
    "grey": Preset(
        "Shades of grey",
        "Tissues in shades of grey, as on a slice.",
    ),
    "tissues": Preset(
        "Tissues in colour",
        "Fat is yellow, soft tissue is red, and bone is light.",
    ),
    "air": Preset(
        "Air",
        "Only parts with the density of air, such as lungs and sinuses.",
    ),
    "fat": Preset(
        "Fat",
        "Only parts with the density of fat.",
    ),
    "soft_tissue": Preset(
        "Soft tissue",
        "Only parts with the density of muscles and organs.",
    ),
    "blood": Preset(
        "Blood",
        "Only parts with the density of blood.",
    ),
    "bone": Preset(
        "Bone",
        "Only parts with the density of bone.",
    ),
}
