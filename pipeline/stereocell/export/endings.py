"""The endings of exported files, and the options that each of these formats takes.

The table is apart from the writers (`write.FORMATS`), because their libraries are slow to import.
"""

from pathlib import Path

from stereocell.export.options import ExportOptions
from stereocell.model.errors import UsageError

PAGE = ".html"  # made from the bundle; all other formats are made from the stage
_LEVELS = frozenset({"strict", "tiles", "lod", "max_triangles", "max_bytes", "region", "scale"})
_USD = frozenset({"strict", "tiles", "lod", "max_triangles", "max_bytes", "scale"})
_PICTURE = frozenset({"strict", "tiles", "lod", "max_triangles", "region", "occlusion", "width"})
_VOLUME = frozenset({"strict", "tiles", "region", "units", "bits"})
_SOLID = _LEVELS | {"wall_mm", "units"}
_GLTF = _LEVELS | {"compress", "occlusion"}
# Names of the options that each format accepts, besides --channels
TAKES = {
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".stl": _SOLID,
    ".3mf": _SOLID | {"components"},
    ".ply": _SOLID,
    ".obj": _SOLID,
    ".usdz": _USD,
    ".usdc": _USD,
    ".usda": _USD,
    ".png": _PICTURE,
    ".mp4": _PICTURE,
    ".webm": _PICTURE,
    ".nrrd": _VOLUME | {"unity"},
    ".raw": _VOLUME | {"unity"},
    ".nii.gz": _VOLUME,
    ".nii": _VOLUME,
    ".precomputed": frozenset({"strict", "tiles", "region", "bits"}),
    PAGE: frozenset({"max_mb", "view"}),
}


def find_ending(file: Path) -> str:
    """Return the ending that selects the format. Raises UsageError if it is unknown."""
    name = file.name.lower()
    for ending in TAKES:
        if name.endswith(ending) and len(name) > len(ending):
            return ending
    raise UsageError(
        f"{file}: found the ending {file.suffix!r}, expected a name that ends in one of "
        f"{', '.join(TAKES)}"
    )


def require_takes(ending: str, options: ExportOptions) -> None:
    """Raise UsageError for an option that a format does not accept."""
    for name in sorted(options.given() - TAKES[ending] - {"channels"}):
        able = [other for other, taken in TAKES.items() if name in taken]
        flag = name.replace("_", "-")
        raise UsageError(
            f"--{flag} does not apply to {ending}, expected a file that ends in one of "
            f"{', '.join(able)}"
        )
