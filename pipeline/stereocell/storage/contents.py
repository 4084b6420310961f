"""Recognise the contents of a path: a build, a part of a build, a published page, ...

All commands use this module. Commands that read refuse folders of the wrong kind, and commands that
write do not replace foreign files. A damaged result is still recognised by the names of its files,
so that the command that reads it can name the fault and the remedy.
"""

import json
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.first_bytes import SCENE, identify
from stereocell.storage.kinds import Kind
from stereocell.storage.location import first_bytes
from stereocell.storage.sealed_text import is_sealed_text
from stereocell.storage.workspace import fetch, names_in

PUBLISHED = "stereocell-published.json"
_PLAN, _MANIFEST, _STAGE, _SLICES = "plan.json", "manifest.json", "stage.usda", "slices.json"
# Words for the parts of a build, by the names of their folders
_PARTS = {
    "units": "the units of a build",
    "stage": "the stage of a build",
    "bundle": "the bundle of a build",
    "report": "the report of a build",
    "tissue": "the tissue classes of a build",
    "stage_parts": "finished parts of a build's unfinished stage",
    "bundle_parts": "finished parts of a build's unfinished bundle",
    "bricks": "bricks cached by `stereocell serve`",
}
# Words for files of surfaces, by their endings; most of these formats have no mark of their own
_BY_ENDING = {
    (".glb", ".gltf"): "a glTF file of surfaces",
    (".stl", ".3mf", ".ply", ".obj"): "a file of surfaces",
    (".usda", ".usdc", ".usdz", ".usd"): "a USD file",
}
# First bytes of formats of surfaces that have a mark, by the endings of their files
_USDA, _USDC, _ZIP = b"#usda", b"PXR-USDC", b"PK\x03\x04"
_MARKS: dict[str, bytes | tuple[bytes, ...]] = {
    ".glb": b"glTF",
    ".ply": b"ply",
    ".3mf": _ZIP,
    ".usda": _USDA,
    ".usdc": _USDC,
    ".usdz": _ZIP,
    ".usd": (_USDA, _USDC, _ZIP),
}
_OTHER = "a file that StereoCell did not write"
# Locks and temporary files of StereoCell, and files that file managers write
_IGNORED = re.compile(r"\.lock|\.writable\..*|\..+\.[0-9a-f]{8}\b.*|\.DS_Store|Thumbs\.db")
_MAX_BYTES = 64 << 20  # bytes; StereoCell writes no larger JSON file
_MAX_NAMED = 3  # most files that a message names


@dataclass(frozen=True, slots=True)
class Contents:
    """The contents of a path.

    words        words for the contents, with an article, for messages
    name         name of the specimen; empty: unknown
    fingerprint  fingerprint of the specimen's source; empty: unknown
    build        the build that contains the path; None: it is not in a build
    """

    kind: Kind
    words: str
    name: str = ""
    fingerprint: str = ""
    build: Path | None = None


def contents_of(path: Path) -> Contents:
    """Return the contents of a path of this machine, or of an OUT on object storage."""
    if os.path.islink(path) and not path.exists():
        return Contents(Kind.FILE, "a link to nothing")
    if path.is_file():
        words = _file_words(path)
        return Contents(Kind.SCENE if words == SCENE else Kind.FILE, words)
    names = {name for name in names_in(path) if not is_ignored(name)}
    if not names:
        return Contents(Kind.NOTHING, "nothing")
    for recognise in (_site, _bundle, _build, _stage, _slices, _part):
        found = recognise(path, names)
        if found is not None:
            return found
    return Contents(Kind.FOLDER, words_for(sorted(names)))


def words_for(names: Sequence[str]) -> str:
    """Return words for files that StereoCell did not write, with the names of some."""
    more = f" and {len(names) - _MAX_NAMED} more" if len(names) > _MAX_NAMED else ""
    return f"something else ({', '.join(names[:_MAX_NAMED])}{more})"


def is_ignored(name: str) -> bool:
    """Return whether a file is a lock, a temporary file or a file manager's own, by its name."""
    return _IGNORED.fullmatch(name) is not None


def _file_words(path: Path) -> str:
    """Return words for a file by its seal, its ending or its first bytes."""
    if path.suffix == ".html" and is_sealed_text(path):
        return "the report of a build"
    head, ending = first_bytes(str(path)), path.suffix.lower()
    content = identify(head)
    if not head:
        return content.words
    if not head.startswith(_MARKS.get(ending, b"")):
        return f"a file that is named {ending} and has other content"
    named = (words for endings, words in _BY_ENDING.items() if ending in endings)
    return next(named, content.words if content.is_known else _OTHER)


def require_kind(path: Path, kinds: Collection[Kind]) -> Contents:
    """Return the contents of a path. Raises OutputError unless its kind is one of `kinds`.

    An empty or missing folder is accepted, because the command itself reports the missing file.
    """
    found = contents_of(path)
    if found.kind is Kind.NOTHING or found.kind in kinds:
        return found
    names = [kind.value for kind in Kind if kind in kinds]
    expected = " or ".join([", ".join(names[:-1]), names[-1]] if names[1:] else names)
    hint = "run `stereocell build INPUT -o OUT` first"
    if found.build is not None and Kind.BUILD in kinds:
        hint = f"give {found.build}"
    raise OutputError(f"{path}: found {found.words}, expected {expected}: {hint}")


def _site(path: Path, names: set[str]) -> Contents | None:
    """Recognise a page that `stereocell publish` wrote."""
    listed = _read(path / PUBLISHED) if PUBLISHED in names else {}
    if listed.get("format") != "stereocell-published":
        return None
    specimen = _table(listed.get("specimen"))
    name = _text(specimen.get("name")) or _text(_specimen(path).get("name"))
    return Contents(
        Kind.SITE, _named("a published page", name), name, _text(specimen.get("fingerprint"))
    )


def _bundle(path: Path, names: set[str]) -> Contents | None:
    """Recognise a bundle, in a build or by itself."""
    # A bundle whose manifest is missing is recognised by its other files.
    is_ours = {"files.json", "channels"} <= names or (
        _MANIFEST in names and _read(path / _MANIFEST).get("format") == "stereocell-bundle"
    )
    if not is_ours:
        return None
    build = _build_around(path)
    specimen = _specimen(path)
    name, fingerprint = _text(specimen.get("name")), _text(specimen.get("fingerprint"))
    return Contents(Kind.BUNDLE, _named("a bundle", name), name, fingerprint, build)


def _build(path: Path, names: set[str]) -> Contents | None:
    """Recognise an OUT as soon as its plan is written."""
    plan = _read(path / _PLAN) if _PLAN in names else {}
    provenance = _read(path / "provenance.json") if "provenance.json" in names else {}
    is_ours = bool(
        plan.get("format") == "stereocell-plan"
        or _text(provenance.get("generator")).startswith("StereoCell")
        or names <= _PARTS.keys()
        or ({_PLAN, "phases.json"} & names and {"units", "stage", "bundle"} & names)
        or ("stage" in names and _STAGE in names_in(path / "stage"))
        or ("bundle" in names and {_MANIFEST, "files.json"} & {*names_in(path / "bundle")})
    )
    if not is_ours:
        return None
    name = _text(plan.get("name"))
    fingerprint = _text(plan.get("fingerprint")) or _text(provenance.get("fingerprint"))
    return Contents(Kind.BUILD, _named("a build", name), name, fingerprint)


def _stage(path: Path, names: set[str]) -> Contents | None:
    """Recognise the folder of a stage, in a build or by itself."""
    if _STAGE not in names or not {"tiles", "looks", "files.json"} & names:
        return None
    return Contents(Kind.STAGE, "a USD stage", build=_build_around(path))


def _slices(path: Path, names: set[str]) -> Contents | None:
    """Recognise the images of `stereocell slices`."""
    content = _read(path / _SLICES) if _SLICES in names else {}
    if content.get("format") != "stereocell-slices":
        return None
    return Contents(
        Kind.SLICES,
        "slices of `stereocell slices`",
        fingerprint=_text(content.get("fingerprint")),
    )


def _part(path: Path, _: set[str]) -> Contents | None:
    """Recognise the other folders of a build by their names and places."""
    build = _build_around(path)
    if build is None or path.resolve().name not in _PARTS:
        return None
    return Contents(Kind.PART, _PARTS[path.resolve().name], build=build)


def _build_around(path: Path) -> Path | None:
    """Return the build that contains a folder; None: there is none."""
    place = path.resolve()
    if place.name not in _PARTS:
        return None
    found = _build(place.parent, set(names_in(place.parent)))
    return None if found is None else path.parent


def _specimen(path: Path) -> Mapping[str, Any]:
    """Return the specimen in a bundle's manifest; empty: the manifest states none."""
    return _table(_read(path / _MANIFEST).get("specimen"))


def _named(words: str, name: str) -> str:
    return f"{words} of {name!r:.80}" if name else words


def _read(file: Path) -> Mapping[str, Any]:
    """Return the content of a JSON file without a check of its seal; empty for other files."""
    fetch(file)
    try:
        if file.stat().st_size > _MAX_BYTES:
            return {}
        return _table(json.loads(file.read_bytes()))
    except (OSError, ValueError, RecursionError):
        return {}


def _table(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _text(value: Any) -> str:
    return value if isinstance(value, str) and value.isprintable() else ""
