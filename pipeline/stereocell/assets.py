"""Find the files that ship beside the code: JSON Schemas, the USD schema, hand-written layers.

A checkout keeps `schemas/` and `usd_assets/` at its top, two levels above the package; a wheel
carries them inside the package.
"""

from pathlib import Path

_PACKAGE = Path(__file__).parent
_HOMES = (_PACKAGE, _PACKAGE.parents[1])


def find_asset(relative: str) -> Path:
    """Return the path of a shipped file or folder, such as `usd_assets/lights.usda`.

    Raises FileNotFoundError if the installation lacks it.
    """
    for home in _HOMES:
        if (home / relative).exists():
            return home / relative
    raise FileNotFoundError(f"{relative} is neither in {_HOMES[0]} nor in {_HOMES[1]}")


def schema_path(name: str) -> Path:
    """Return the path of a JSON Schema, such as `bundle.schema.json`."""
    return find_asset(f"schemas/{name}")


def viewer_dist() -> Path | None:
    """Return the folder of the built viewer, or None where it has not been built."""
    folder = _PACKAGE.parents[1] / "viewer_gltf" / "dist"
    return folder if (folder / "index.html").is_file() else None
