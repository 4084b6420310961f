"""JSON files of ours: checked against their schema, with errors of one line; written whole.

A document is checked by the same code when it is written and when it is read: see documents.py.

A sealed file has a hash of its other content, `sha256`: a schema can't detect a changed digit of a
number, and the build would go on with it.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.documents import NOT_WRITTEN, parse
from stereocell.storage.seals import read_record, require_seal

_SEAL = "sha256"


def read_json(path: Path, schema: str | None, remedy: str) -> Any:
    """Return the content of a JSON file that fits `schema`.

    schema  a file of schemas/, with `#Name` for one of its definitions; None: any JSON
    remedy  the user's next step where the file is missing or damaged, for messages

    Raises OutputError; its text names file, field and remedy.
    """
    return parse(path, read_record(path, remedy), schema, remedy)


def find_json(path: Path, schema: str) -> Any:
    """Return the content of a JSON file, or None where there is none that fits the schema."""
    try:
        return read_json(path, schema, "")
    except OutputError:
        return None


def write_json(path: Path, content: Any) -> None:
    """Write `content` to `path` as JSON, whole or not at all.

    Raises OutputError, also where it breaks the schema of a document of that name.
    """
    try:
        text = json.dumps(content, indent=1, allow_nan=False)
    except ValueError as error:  # numbers that JSON has not
        raise OutputError(f"{path}: {error}: {NOT_WRITTEN}") from None
    write_bytes(path, f"{text}\n".encode())


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content with its hash."""
    return {**content, _SEAL: _digest_of(content)}


def write_sealed(path: Path, content: Mapping[str, Any]) -> None:
    """Write `content` to `path` as sealed JSON. Raises OutputError as `write_json` does."""
    write_json(path, sealed(content))


def read_sealed(path: Path, schema: str, remedy: str) -> dict[str, Any]:
    """Return the content of sealed JSON, without its hash. Raises OutputError as `read_json` does,
    and where the hash differs or is missing.
    """
    data = read_record(path, remedy)
    found = parse(path, data, None, remedy)
    if isinstance(found, dict) and found and isinstance(found.get(_SEAL, ""), str):
        content = {name: value for name, value in found.items() if name != _SEAL}
        digest = _digest_of(content)
        require_seal(path, found.get(_SEAL), digest, place=repr(_SEAL), remedy=remedy)
    content = dict(parse(path, data, schema, remedy))
    del content[_SEAL]
    return content


def find_sealed(path: Path, schema: str) -> dict[str, Any] | None:
    """Return the content of sealed JSON, or None where it is missing, invalid or changed."""
    try:
        return read_sealed(path, schema, "")
    except OutputError:
        return None


def _digest_of(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compact_json(content: Any) -> bytes:
    """Return JSON without spaces, half the bytes, for files that a phone downloads."""
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False) + "\n").encode()
