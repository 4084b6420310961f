"""What an export is asked for, and the formats that can do it."""

from dataclasses import dataclass, fields
from typing import NamedTuple

from stereocell.model.errors import UsageError

SCALES = 1e-9, 1e9  # a kilometre is a micrometre, and the reverse
WALLS_MM = 1e-6, 1e6
UNITS_M = {"um": 1e-6, "mm": 1e-3, "m": 1.0}  # length of each unit in metres


class Region(NamedTuple):
    """A box of the stage's world, um: least and largest (x, y, z)."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """What is exported, and how. None and empty: the format's own choice.

    channels       by name or ID; empty: all that have what the format holds
    tiles          by name; empty: all
    lod            level of detail, 0: the finest; a tile that has fewer takes its coarsest
    max_triangles  the finest level of at most as many is taken
    max_bytes      the finest level is taken whose file is no larger
    units          of the numbers in formats that state none
    scale          lengths in the file for a length of the specimen
    compress       meshopt or draco
    components     a .3mf has an object a body, joined by components
    occlusion      darken vertices by ambient occlusion
    bits           of a voxel
    unity          one channel, as UnityVolumeRendering's importers read it
    wall_mm        what is thinner in print is named
    width          pixels of a picture
    max_mb         the most that a page in one file takes, millions of bytes
    strict         an edit that the file does not have is an error
    view           a link of the viewer: the view that a page opens with
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
        """Return the names of the options that are given."""
        return {field.name for field in fields(self) if getattr(self, field.name) not in (None, ())}


def parse_region(text: str) -> Region:
    """Return the box of `x0:x1,y0:y1,z0:z1` in um; an empty end means as far as there is anything.

    Raises UsageError.
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
            f"--region is {text!r}, expected x0:x1,y0:y1,z0:z1 in um, as 0:20,:,5:12.5"
        )
    (x0, y0, z0), (x1, y1, z1) = low, high
    return Region((x0, y0, z0), (x1, y1, z1))
