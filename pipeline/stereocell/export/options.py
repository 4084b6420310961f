"""The options of an export, and the box of `--region`."""

from dataclasses import dataclass, fields
from typing import NamedTuple

from stereocell.model.errors import UsageError

SCALES = 1e-9, 1e9  # range of --scale: from 1 km as 1 um to 1 um as 1 km
WALLS_MM = 1e-6, 1e6  # mm, range of --wall-mm
UNITS_M = {"um": 1e-6, "mm": 1e-3, "m": 1.0}  # metres, length of each unit


class Region(NamedTuple):
    """A box in the stage's world: least and largest (x, y, z), um."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """The options of an export. With None or empty values, the format uses its default.

    channels       names or IDs of the channels; empty: all that the format can hold
    tiles          names of the tiles; empty: all
    lod            level of detail, 0: the finest; a tile with fewer levels uses its coarsest
    max_triangles  largest number of triangles, which decides the level of detail
    max_bytes      largest size of the file in bytes, which decides the level of detail
    region         box that the content is clipped to
    units          unit of the numbers in formats that do not state one
    scale          length in the file / length of the specimen
    compress       compression of a glTF file, `meshopt` or `draco`
    components     whether a .3mf has one mesh per body, joined by 3MF components
    occlusion      whether vertices are darkened by ambient occlusion
    bits           bits per voxel, 8 or 16
    unity          whether to write one channel for UnityVolumeRendering's importers
    wall_mm        thickness in print, mm; thinner bodies are reported
    width          width of an image or a video, in pixels
    max_mb         largest size of a page in one file, in millions of bytes
    strict         whether an edit that the file can't hold is an error
    view           link of the viewer with the view that a page shows at opening
    """

    channels: tuple[str, ...] = ()
    tiles: tuple[str, ...] = ()
    lod: int | None = None
    max_triangles: int | None = None
    max_bytes: int | None = None
    region: Region | None = None
    units: str | None = None
    scale: float | None = None
    compress: str | None = None
    components: bool | None = None
    occlusion: bool | None = None
    bits: int | None = None
    unity: bool | None = None
    wall_mm: float | None = None
    width: int | None = None
    max_mb: float | None = None
    strict: bool | None = None
    view: str | None = None

    def __post_init__(self) -> None:
        for flag, value, (least, most) in (
            ("--scale", self.scale, SCALES),
            ("--wall-mm", self.wall_mm, WALLS_MM),
        ):
            if value is not None and not least <= value <= most:
                raise UsageError(f"{flag} is {value:g}, expected {least:g} to {most:g}")

    def given(self) -> set[str]:
        """Return the names of the options that are not at their defaults."""
        return {field.name for field in fields(self) if getattr(self, field.name) not in (None, ())}


def parse_region(text: str) -> Region:
    """Return the box of a text `x0:x1,y0:y1,z0:z1` in um; an empty end is infinite.

    Raises UsageError for other text, or a first end that is not less than the second.
    """
    ends = [pair.partition(":") for pair in text.split(",")]
    try:
        low, high = (
            tuple(float(end[side]) if end[side].strip() else far for end in ends)
            for side, far in ((0, -float("inf")), (2, float("inf")))
        )
    except ValueError:
        low = high = ()
    if len(low) != 3 or not all(a < b for a, b in zip(low, high, strict=True)):
        raise UsageError(
            f"--region is {text!r}, expected x0:x1,y0:y1,z0:z1 in um, such as 0:20,:,5:12.5"
        )
    (x0, y0, z0), (x1, y1, z1) = low, high
    return Region((x0, y0, z0), (x1, y1, z1))
