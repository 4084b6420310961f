"""Read and write StereoCell's JSON files, checked by their schemas, with errors of one line.

A document is checked by the same code when it is written and when it is read (documents.py).

A sealed file has a hash of its other content, `sha256`. A schema alone can't detect a changed digit
of a number.
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

    schema  file in schemas/, with `#Name` for one of its definitions; None: any JSON
    remedy  what the user should do if the file is missing or damaged, for messages

    Raises OutputError, which names file, field and remedy.
    """
    return parse(path, read_record(path, remedy), schema, remedy)


def find_json(path: Path, schema: str) -> Any:
    """Return the content of a JSON file; None: it is missing or does not fit the schema."""
    try:
        return read_json(path, schema, "")
    except OutputError:
        return None


def write_json(path: Path, content: Any) -> None:
    """Write content as JSON, completely or not at all.

    Raises OutputError if that fails, or if the content breaks the schema of a document of that
    name.
    """
    try:
        text = json.dumps(content, indent=1, allow_nan=False)
    except ValueError as error:  # JSON has no NaN and no infinity
        raise OutputError(f"{path}: {error}: {NOT_WRITTEN}") from None
    write_bytes(path, f"{text}\n".encode())


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content with its hash."""
    return {**content, _SEAL: _digest_of(content)}


def write_sealed(path: Path, content: Mapping[str, Any]) -> None:
    """Write content as sealed JSON. Raises OutputError as `write_json` does."""
    write_json(path, sealed(content))


def read_sealed(path: Path, schema: str, remedy: str) -> dict[str, Any]:
    """Return the content of sealed JSON, without its hash.

    Raises OutputError as `read_json` does, and if the hash differs or is missing.
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
    """Return the content of sealed JSON; None: it is missing, invalid or changed."""
    try:
        return read_sealed(path, schema, "")
    except OutputError:
        return None


def _digest_of(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compact_json(content: Any) -> bytes:
    """Return JSON without spaces, in UTF-8, for files that a phone downloads."""
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False) + "\n").encode()
