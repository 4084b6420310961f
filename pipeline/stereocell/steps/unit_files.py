"""Save and load a unit as a folder: unit.json, voxels.npz, and lodK.npz for each level of detail.

The voxels are compressed, and stored once: as measured where these are kept, so that the 8-bit
voxels are made from them again, or else in 8 bits.

The same input gives the same bytes, except in seconds.json, which no other result depends on.
unit.json lists the other files with their hashes, and holds a hash of itself. Each file is compared
with its hash before it is read.
"""

from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.packed_voxels import pack_voxels, unpack_voxels
from stereocell.formats.stl import write_stl
from stereocell.model.errors import OutputError
from stereocell.model.mesh import Baked, Lod, Mesh, Quality, Spread
from stereocell.model.unit import Closed, Cover, ObjectFacts, Unit
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.file_list import DAMAGED, MISSING, find_faults, is_same, measure, sizes_of
from stereocell.storage.json_files import (
    find_json,
    find_sealed,
    read_sealed,
    write_json,
    write_sealed,
)
from stereocell.storage.workspace import fetch
from stereocell.transfer.joint_histogram import to_eight_bits

SCHEMA, _SECONDS_SCHEMA = "units.schema.json#Unit", "units.schema.json#Seconds"
_RECORD, _CLOSED, _SECONDS = "unit.json", "closed.stl", "seconds.json"
_VOXELS, _OBJECTS = "voxels.npz", "objects.npz"
# Names in objects.npz of fields of ObjectFacts that are called otherwise there.
_NAMES_IN_FILE = {"interface_objects": "walls", "interface_um2": "wall_um2"}


def save_unit(directory: Path, unit: Unit) -> None:
    """Write a unit as a folder, completely or not at all. Raises OutputError."""
    lods = [
        {
            "triangles": len(lod.mesh.triangles),
            "vertices": len(lod.mesh.positions),
            "distance_um": lod.distance_um,
            "maps": _describe_maps(lod),
            "quality": None if lod.quality is None else asdict(lod.quality),
            **({} if lod.farthest_um is None else {"farthest_um": lod.farthest_um}),
        }
        for lod in unit.lods
    ]
    with replacing_folder(directory) as folder:
        voxels = unit.volume if unit.measured is None else unit.measured
        if voxels is not None:
            (folder / _VOXELS).write_bytes(pack_voxels(voxels))
        for level, lod in enumerate(unit.lods):
            np.savez(lod_file(folder, level), **_arrays(lod))
        if unit.objects is not None:
            np.savez(folder / _OBJECTS, allow_pickle=False, **_facts(unit.objects))
        if unit.closed is not None:
            write_stl(folder / _CLOSED, unit.closed.mesh)
        record = {
            "reason": unit.reason,
            "lods": lods,
            "closed": _describe_closed(unit.closed),
            "volume": [] if unit.volume is None else list(unit.volume.shape),
            "window": None if unit.measured is None else [float(end) for end in unit.window],
            "fragments_dropped": unit.fragments_dropped,
            "cavities_filled": unit.cavities_filled,
            "cover": None if unit.cover is None else asdict(unit.cover),
            "files": {file.name: measure(file) for file in sorted(folder.iterdir())},
        }
        write_sealed(folder / _RECORD, record)
        # written after the list of files, because a unit is complete without it
        write_json(folder / _SECONDS, {step: round(s, 3) for step, s in unit.seconds.items()})


def is_whole(directory: Path) -> bool:
    """Return whether a unit's folder holds all files of its record, undamaged.

    Files whose size and time are unchanged are not read (see file_list.py).
    """
    record = find_sealed(directory / _RECORD, SCHEMA)
    if record is None:
        return False
    return not find_faults(directory, record["files"], since=directory / _RECORD)


class UnitFolder:
    """The form of a unit in OUT: the folder that `save_unit` writes."""

    def is_whole(self, place: Path) -> bool:
        """Return whether the folder holds all files of its record, undamaged."""
        return is_whole(place)

    def write(self, place: Path, result: Unit) -> None:
        """Write the folder completely or not at all. Raises OutputError."""
        save_unit(place, result)


UNIT_FOLDER = UnitFolder()


def find_damage(directory: Path) -> dict[str, str]:
    """Return the fault of each damaged file of a unit, by name. All files are read."""
    if _RECORD not in sizes_of(directory):
        return {_RECORD: MISSING}
    record = find_sealed(directory / _RECORD, SCHEMA)
    if record is None:
        return {_RECORD: DAMAGED}
    return find_faults(directory, record["files"])


def load_record(directory: Path) -> dict[str, Any]:
    """Return the content of unit.json: triangles, distances, reason. Raises OutputError."""
    return read_sealed(directory / _RECORD, SCHEMA, _remedy(directory))


def cover_of(record: Mapping[str, Any]) -> Cover | None:
    """Return how many of the source's voxels a unit's solid encloses, from unit.json's content."""
    return None if record["cover"] is None else Cover(**record["cover"])


def _as_written(directory: Path, file: Path) -> Path:
    """Fetch a file of a unit and return it. Raises OutputError unless it matches the record."""
    fetch(file)
    entry = load_record(directory)["files"].get(file.name)
    fault = "not in unit.json" if entry is None else ""
    if entry is not None and not file.is_file():
        fault = MISSING
    elif entry is not None and not is_same(file, entry):
        fault = "damaged, not the bytes that unit.json says"
    if fault:
        raise OutputError(f"{file}: {fault}: {_remedy(directory)}")
    return file


def find_seconds(directory: Path) -> dict[str, float]:
    """Return the seconds of each step of a unit; empty: their file is missing."""
    return dict(find_json(directory / _SECONDS, _SECONDS_SCHEMA) or {})


def lod_file(directory: Path, level: int) -> Path:
    """Return the path of one level of detail."""
    return directory / f"lod{level}.npz"


def record_file(directory: Path) -> Path:
    """Return the path of unit.json."""
    return directory / _RECORD


def volume_file(directory: Path) -> Path:
    """Return the path of the voxels."""
    return directory / _VOXELS


def find_closed(directory: Path) -> Path | None:
    """Return the file of the unit's closed copy; None: there is none. Raises OutputError."""
    has_one = load_record(directory)["closed"] is not None
    return _as_written(directory, directory / _CLOSED) if has_one else None


def load_lods(directory: Path) -> tuple[Lod, ...]:
    """Return the levels of detail, finest first. Raises OutputError for a damaged file."""
    lods = load_record(directory)["lods"]
    return tuple(load_lod(directory, level) for level in range(len(lods)))


def load_lod(directory: Path, level: int) -> Lod:
    """Return one level of detail; 0 is the finest. Raises OutputError for a damaged file."""
    lods = load_record(directory)["lods"]
    try:
        return _load_lod(directory, level, lods[level])
    except (OSError, ValueError, LookupError, EOFError, BadZipFile) as error:
        raise OutputError(f"{directory}: damaged ({error}): {_remedy(directory)}") from error


def load_quality(stored: Mapping[str, Any]) -> Quality:
    """Return the quality of one level of detail from its entry in a record."""
    ways = {way: Spread(**stored[way]) for way in ("away", "back")}
    return Quality(**{**stored, **ways})


def load_volume(directory: Path) -> NDArray[np.uint8]:
    """Return the 8-bit voxels, uint8 (z, y, x). Raises OutputError for a damaged file."""
    return load_voxels(directory)[0]


def load_voxels(directory: Path) -> tuple[NDArray[np.uint8], NDArray[Any] | None]:
    """Return the 8-bit voxels, uint8 (z, y, x), and those as measured; None: these are not kept.

    Raises OutputError for a damaged file.
    """
    try:
        voxels = unpack_voxels(_as_written(directory, directory / _VOXELS))
    except (OSError, ValueError, LookupError, EOFError, RuntimeError, BadZipFile) as error:
        raise OutputError(f"{directory}: damaged ({error}): {_remedy(directory)}") from error
    window = load_record(directory)["window"]
    return (voxels, None) if window is None else (to_eight_bits(voxels, tuple(window)), voxels)


def load_objects(directory: Path) -> ObjectFacts:
    """Return the measurements of the objects in a label map's unit. Raises OutputError."""
    try:
        with (
            _as_written(directory, directory / _OBJECTS).open("rb") as file,
            np.load(file) as arrays,
        ):
            found = {name: arrays[_NAMES_IN_FILE.get(name, name)] for name in _names_of_facts()}
    except (OSError, ValueError, LookupError, EOFError, BadZipFile) as error:
        raise OutputError(f"{directory}: damaged ({error}): {_remedy(directory)}") from error
    bias = tuple(float(share) for share in found.pop("bias"))
    stopped = tuple(int(level) for level in found.pop("stopped"))
    return ObjectFacts(changed=int(found.pop("changed")), bias=bias, stopped=stopped, **found)


def _facts(objects: ObjectFacts) -> dict[str, NDArray[Any]]:
    return {
        _NAMES_IN_FILE.get(name, name): np.asarray(getattr(objects, name))
        for name in _names_of_facts()
    }


def _names_of_facts() -> tuple[str, ...]:
    return tuple(field.name for field in fields(ObjectFacts))


def _load_lod(directory: Path, level: int, stored: Mapping[str, Any]) -> Lod:
    # opened here, because numpy would leave a damaged file open
    with (
        _as_written(directory, lod_file(directory, level)).open("rb") as file,
        np.load(file) as arrays,
    ):
        mesh = Mesh(
            arrays["positions"],
            arrays["triangles"],
            arrays["normals"],
            arrays.get("uvs"),
            arrays.get("tangents"),
            objects=arrays.get("objects"),
            paint=_share(arrays.get("object_paint")),
        )
        quality = stored["quality"] and load_quality(stored["quality"])
        baked = None
        if "openness" in arrays:
            maps = stored["maps"]
            facts = (maps["texel_um"], maps["charts"], maps["reason"])
            baked = Baked(arrays["openness"], arrays.get("paint"), *facts)
        normals, farthest = arrays.get("normal_map"), stored.get("farthest_um")
        return Lod(mesh, stored["distance_um"], normals, quality, baked, farthest)


def _describe_closed(closed: Closed | None) -> dict[str, int] | None:
    """Return the entry of the closed copy in unit.json."""
    if closed is None:
        return None
    return {
        "triangles": len(closed.mesh.triangles),
        "faults": closed.faults,
        "fallbacks": closed.fallbacks,
    }


def _describe_maps(lod: Lod) -> dict[str, Any]:
    """Return the entry in unit.json of the maps of one level of detail."""
    height, width = (0, 0) if lod.normal_map is None else lod.normal_map.shape[:2]
    baked = lod.baked
    return {
        "size": [width, height],
        "texel_um": baked.texel_um if baked else 0.0,
        "charts": baked.charts if baked else 0,
        "painted": baked is not None and baked.paint is not None,
        "reason": baked.reason if baked else "",
    }


def _arrays(lod: Lod) -> dict[str, Any]:
    arrays = {
        "positions": lod.mesh.positions,
        "triangles": lod.mesh.triangles,
        "normals": lod.mesh.normals,
        "uvs": lod.mesh.uvs,
        "tangents": lod.mesh.tangents,
        "normal_map": lod.normal_map,
        "openness": lod.baked and lod.baked.openness,
        "paint": lod.baked and lod.baked.paint,
        "objects": lod.mesh.objects,
        "object_paint": None
        if lod.mesh.paint is None
        else np.rint(lod.mesh.paint * 255).astype("u1"),
    }
    return {name: array for name, array in arrays.items() if array is not None}


def _share(stored: NDArray[np.uint8] | None) -> NDArray[np.float32] | None:
    """Return stored values 0..255 as float32 0..1, or None if there are none."""
    return None if stored is None else np.divide(stored, 255, dtype=np.float32)


def _remedy(directory: Path) -> str:
    return f"remove {directory} and run `stereocell units OUT`"
