"""Write the .meta files of the Unity package. Unity ignores an asset of a package without one.

    PYTHONPATH=tests python -m support.unity_meta

writes the missing ones. An asset's GUID is computed from its path, so it stays the same.
"""

import hashlib
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "usd_assets" / "unity"
SAMPLES = PACKAGE / "Samples~"


def assets() -> Iterator[Path]:
    """Yield the files and folders that Unity imports: not `.hidden` ones, nor `Documentation~`.

    Unity imports a sample once its user has copied it into the project, so files of `Samples~`
    count.
    """
    for path in sorted(PACKAGE.rglob("*")):
        parts = path.relative_to(PACKAGE).parts
        if parts[0] == SAMPLES.name:
            parts = parts[1:]
        is_hidden = any(p.startswith(".") or p.endswith("~") for p in parts)
        if path.suffix != ".meta" and parts and not is_hidden:
            yield path


def meta_of(asset: Path) -> Path:
    return asset.with_name(asset.name + ".meta")


def guid_of(asset: Path) -> str:
    name = f"org.stereocell.bundle/{asset.relative_to(PACKAGE).as_posix()}"
    return hashlib.md5(name.encode(), usedforsecurity=False).hexdigest()


def main() -> None:
    for asset in assets():
        if not meta_of(asset).exists():
            folder = "folderAsset: yes\n" if asset.is_dir() else ""
            meta_of(asset).write_text(f"fileFormatVersion: 2\nguid: {guid_of(asset)}\n{folder}")


if __name__ == "__main__":
    main()
