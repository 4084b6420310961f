"""Check the JSON documents of a bundle: their schemas, and rules that schemas can't express."""

import hashlib
import struct
from pathlib import Path
from typing import Any

from stereocell.bundle.manifest import MANIFEST, REMEDY, SCHEMA, read_manifest
from stereocell.bundle.write_objects import hash_parts
from stereocell.model.errors import CheckError
from stereocell.storage.json_files import read_json
from stereocell.transfer.shapes2d import find_fault, shapes_from
from stereocell.usd.written_files import USDZ_NAME
from stereocell.verify.build_files import check_usdz
from stereocell.verify.check_line import raise_on


def check_manifest(bundle: Path) -> str:
    """Check the manifest against its schema and its own hash."""
    read_manifest(bundle)
    return f"{MANIFEST} follows {SCHEMA} and is as written"


def check_json(path: Path, schema: str, remedy: str) -> str:
    """Check one document against its schema."""
    read_json(path, schema, remedy)
    return f"{path.name} follows {schema}"


def check_usdz_of_bundle(bundle: Path) -> str:
    """Check specimen.usdz if the manifest names one; `check_hashes` compares its hash."""
    manifest = read_manifest(bundle)
    if manifest.get("usdz") is None:
        return f"no {USDZ_NAME}: {manifest.get('usdz_reason') or 'the manifest names none'}"
    if not (bundle / USDZ_NAME).is_file():
        raise CheckError(f"{USDZ_NAME}: missing: {REMEDY}")
    return check_usdz(bundle / USDZ_NAME)


def check_volume_lists(bundle: Path) -> str:
    """Check each volumes.json, and compare the textures' mip levels with the hashes in it."""
    problems = []
    volumes = 0
    for channel in channels_of(bundle):
        path = bundle / channel["volumes"]["path"]
        content = read_json(path, "volumes.schema.json", REMEDY)
        for volume in content["volumes"]:
            volumes += 1
            texture = bundle / volume["file"]["path"]
            listed = [(level["offset"], level["length"]) for level in volume["levels"]]
            if _levels_of(texture, len(listed)) != listed:
                problems.append(
                    f"{path}: found other offsets of resolution levels, expected those in "
                    f"{volume['file']['path']}"
                )
                continue
            problems += _damaged_levels(texture, volume)
    raise_on(problems)
    return f"{volumes} volumes"


def _levels_of(texture: Path, count: int) -> list[tuple[int, int]]:
    """Return the offset and the length, in bytes, of each mip level of a KTX2 file.

    The list is empty if the file does not have `count` mip levels.
    """
    try:
        with texture.open("rb") as file:
            head = file.read(80 + 24 * count)
    except OSError as error:
        raise CheckError(f"{texture}: {error.strerror or error}") from error
    if len(head) < 80 + 24 * count or struct.unpack_from("<I", head, 40) != (count,):
        return []
    return [struct.unpack_from("<2Q", head, 80 + 24 * k) for k in range(count)]


def _damaged_levels(texture: Path, volume: dict[str, Any]) -> list[str]:
    """Return a problem for each mip level that doesn't match its hash."""
    problems = []
    try:
        with texture.open("rb") as file:
            for k, level in enumerate(volume["levels"]):
                file.seek(level["offset"])
                found = hashlib.sha256(file.read(level["length"])).hexdigest()
                if found != level["sha256"]:
                    problems.append(
                        f"{volume['file']['path']}: resolution level {k}: found SHA-256 {found}, "
                        f"expected {level['sha256']}"
                    )
    except OSError as error:
        raise CheckError(f"{texture}: {error.strerror or error}") from error
    return problems


def channels_of(bundle: Path) -> list[dict[str, Any]]:
    """Return the channels of a bundle's manifest. Raises OutputError if it is invalid."""
    manifest = read_manifest(bundle)
    channels: list[dict[str, Any]] = manifest["channels"]
    return channels


def transfer2d_of(bundle: Path, channel: dict[str, Any]) -> dict[str, Any]:
    """Return a channel's 2D transfer functions. Raises OutputError if they are invalid."""
    path = bundle / channel["transfer_functions_2d"]["file"]["path"]
    content: dict[str, Any] = read_json(path, "transfer2d.schema.json", REMEDY)
    return content


def check_transfer2d(bundle: Path) -> str:
    """Check the names in each transfer2d.json, and rules of its shapes beyond the schema."""
    problems = []
    count = 0
    for channel in channels_of(bundle):
        listed, known = channel["transfer_functions_2d"], channel["transfer_functions"]
        functions = transfer2d_of(bundle, channel)["functions"]
        if list(functions) != listed["names"] or not set(functions) <= set(known):
            problems.append(
                f"{listed['file']['path']}: found functions {', '.join(functions) or 'none'}, "
                f"expected {', '.join(listed['names']) or 'none'} as in the manifest, out of "
                f"{', '.join(known)}"
            )
        for name, content in functions.items():
            count += len(content)
            problems += [
                f"{listed['file']['path']}: {name}: shape {i}: {fault}"
                for i, shape in enumerate(shapes_from(content))
                if (fault := find_fault(shape))
            ]
    raise_on(problems)
    return f"{count} shapes"


def objects_of(bundle: Path, channel: dict[str, Any]) -> dict[str, Any] | None:
    """Return the table of a channel that is a label map; None for an image's channel."""
    if "objects" not in channel:
        return None
    path = bundle / channel["objects"]["path"]
    content: dict[str, Any] = read_json(path, "objects.schema.json", REMEDY)
    return content


def check_objects(bundle: Path) -> str:
    """Check that the files of each objects.json have a value per row, and tiles' rows exist.

    The hashes of the parts of the exact values are checked, too.
    """
    problems = []
    objects = 0
    for channel in channels_of(bundle):
        content = objects_of(bundle, channel)
        if content is None:
            continue
        count, name = content["count"], channel["objects"]["path"]
        objects += count
        sizes = [(content["labels"], content["label_bytes"]), (content["boxes"], 24)]
        sizes += [(column["bytes"], 1) for column in content["columns"]]
        sizes += [(column["exact"], 4) for column in content["columns"]]
        problems += [
            f"{name}: {ref['path']}: found {ref['bytes']} bytes, expected {count * width}"
            for ref, width in sizes
            if ref["bytes"] != count * width
        ]
        problems += [
            f"{name}: {column['exact']['path']}: found other SHA-256 of its parts, expected those "
            "in the table"
            for column in content["columns"]
            if "parts" in column and not _has_parts(bundle / column["exact"]["path"], column)
        ]
        for tile, rows in content["tiles"].items():
            last = max([rows["first"] + rows["count"] - 1, *rows.get("more", [])])
            if last >= max(count, 1):
                problems.append(f"{name}: {tile}: found row {last}, expected rows below {count}")
    raise_on(problems)
    return f"{objects} objects"


def _has_parts(file: Path, column: dict[str, Any]) -> bool:
    try:
        return bool(column["parts"] == hash_parts(file.read_bytes()))
    except OSError as error:
        raise CheckError(f"{file}: {error.strerror or error}") from error
