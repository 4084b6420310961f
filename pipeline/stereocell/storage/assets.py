"""Find the files that ship with the code: JSON Schemas, the USD schema, layers and the viewer.

A checkout has `schemas/`, `usd_assets/` and `viewer_gltf/` at its top, two levels above the
package. A wheel has them inside the package. The package is searched first, because the folder two
levels above an installed package belongs to something else.
"""

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
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
    """Return the folder of the built viewer; None: it has not been built."""
    folders = (home / "viewer_gltf" / "dist" for home in _HOMES)
    return next((folder for folder in folders if (folder / "index.html").is_file()), None)
