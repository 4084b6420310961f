"""Write the lights of a stage for the viewer: its lamps, and one image for all its domes."""

from pathlib import Path
from typing import Any

from stereocell.bundle.tile_part import FileRef
from stereocell.formats.exr import write_rgb
from stereocell.formats.latlong import hemispheres
from stereocell.storage.file_list import measure
from stereocell.usd.read_lights import MAX_STRENGTH, StageLamp, StageLights

ROOM = "room.exr"


def write_lights(lights: StageLights, root: Path) -> tuple[dict[str, Any], list[FileRef]]:
    """Write the domes' image if there is one; return the manifest's entry for lights, and the file.

    Raises OutputError.
    """
    described: dict[str, Any] = {"lamps": [_describe_lamp(lamp) for lamp in lights.lamps]}
    if lights.room is None:
        return described, []
    write_rgb(root / ROOM, lights.room)
    file = FileRef(ROOM, **measure(root / ROOM))
    sky, ground = ([round(float(v), 6) for v in half] for half in hemispheres(lights.room))
    named = {"path": file.path, "bytes": file.bytes, "sha256": file.sha256}
    return {**described, "room": {"sky": sky, "ground": ground, "image": named}}, [file]


def _describe_lamp(lamp: StageLamp) -> dict[str, Any]:
    return {
        "name": lamp.name,
        "color": list(lamp.color),
        "strength": min(lamp.strength, MAX_STRENGTH),
        "towards": lamp.towards and list(lamp.towards),
        "position_um": lamp.position and list(lamp.position),
    }
