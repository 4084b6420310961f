"""Read the harness's report of an import into Unity, and map the specimen's places into Unity."""

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.ktx2 import decode_finest
from support.bundles import load

MIRROR = np.diag([-1.0, 1.0, 1.0])
UM = 1e-6  # m


def child(of: Any, *names: str) -> Any:
    for name in names:
        (of,) = (each for each in of["children"] if each["name"] == name)
    return of


def boxes(root: Any) -> Iterator[tuple[str, Any]]:
    for tile in root["children"]:
        for box in child(tile, "volume").get("children", []):
            # A property block overrides the material.
            yield tile["name"], {**box, "material": {**box["material"], **box.get("block", {})}}


def world_of(root: Any, bundle: Path, places_um: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the positions in Unity of the specimen's points (n, 3): mirrored, round its middle."""
    bounds = load(bundle / "manifest.json")["specimen"]["bounds_um"]
    middle = np.mean([bounds["min"], bounds["max"]], axis=0)
    scale = root["scale"][0]
    moved: NDArray[np.float64] = (places_um - middle) @ MIRROR * UM * scale
    return moved


def volume_of(bundle: Path, channel: str, tile: str) -> tuple[Any, NDArray[np.uint8]]:
    (entry,) = (c for c in load(bundle / "manifest.json")["channels"] if c["id"] == channel)
    volumes = load(bundle / entry["volumes"]["path"])["volumes"]
    (volume,) = (v for v in volumes if v["tile"] == tile)
    return volume, decode_finest((bundle / volume["file"]["path"]).read_bytes())[..., 0]


def texels_of(texture: Any) -> NDArray[np.uint8]:
    x, y, z = texture["size"]
    data = np.frombuffer(base64.b64decode(texture["texels"]), np.uint8)
    return data.reshape(z, y, x, -1)
