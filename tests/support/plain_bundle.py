"""A bundle of small files, with a manifest and a list as bundles have them, and no surfaces."""

from pathlib import Path
from typing import Any

from stereocell.storage.file_list import encode, list_files, measure, to_json
from stereocell.storage.json_files import sealed

FILES = {
    "index.html": b"<!doctype html>",
    "sw.js": b"self;",
    "assets/page-abc123.js": b"1;",
    **{f"assets/part-{i}.js": b"%d;" % i for i in range(40)},
    "channels/CD31/it's 1.glb": b"glTF" + bytes(3000),
    "volumes/r0_c0.ktx2": bytes(range(256)) * 40,
}
NAME, FINGERPRINT = "b" * 2000, "0123456789abcdef" * 4


def write(out: Path, files: dict[str, bytes], *, fingerprint: str = FINGERPRINT) -> None:
    """Write a bundle; its manifest names the list of files, which names all other files."""
    bundle = out / "bundle"
    for path, content in files.items():
        file = bundle / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    for name in ("files.json", "manifest.json"):
        (bundle / name).unlink(missing_ok=True)
    (bundle / "files.json").write_bytes(encode(list_files(bundle, root=bundle)))
    index = {"path": "files.json", **measure(bundle / "files.json")}
    manifest = manifest_of(NAME, index, fingerprint)
    (bundle / "manifest.json").write_bytes(to_json(sealed(manifest)))


def manifest_of(name: str, index: dict[str, Any], fingerprint: str) -> dict[str, Any]:
    """Return a manifest without its hash. An empty fingerprint states that no source is known."""
    box = {"min": [0, 0, 0], "max": [1, 1, 1]}
    source = {"fingerprint": fingerprint} if fingerprint else {}
    return {
        "format": "stereocell-bundle",
        "version": 1,
        "generator": "tests",
        "specimen": {"name": name, "modality": "", **source, "bounds_um": box},
        "tiles": [{"id": "r0_c0", "representation": "mesh", "bounds_um": box}],
        "channels": [],
        "files": index,
    }


def below(folder: Path) -> dict[str, bytes]:
    """Return all files below a folder by their relative paths."""
    files = (file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}
