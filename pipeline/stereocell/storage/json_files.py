"""JSON files of ours: checked against their schema, with errors of one line; written whole.

A sealed file has a hash of its other content, `sha256`: a schema can't detect a changed digit of a
number, and the build would go on with it.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from stereocell.model.errors import OutputError
from stereocell.storage.assets import schema_path
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.workspace import fetch

_SEAL = "sha256"
# Schemas and hashes of documents that fitted: a unit's record is read with each of its files, and
# the schema took up to 20 ms of each time, a fifth of a small build
_fitting: set[tuple[str, bytes]] = set()
_MAX_FITTING = 100_000


def read_json(path: Path, schema: str | None, remedy: str) -> Any:
    """Return the content of a JSON file that fits `schema`.

    schema  a file of schemas/, with `#Name` for one of its definitions; None: any JSON
    remedy  the user's next step where the file is missing or damaged, for messages

    Raises OutputError; its text names file, field and remedy.
    """
    fetch(path)
    try:
        data = path.read_bytes()
        content = json.loads(data, parse_constant=_refuse, parse_float=_finite)
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: {remedy}") from None
    except OSError as error:
        raise OutputError(f"{path}: can't be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:  # of deeply nested lists
        raise OutputError(f"{path}: damaged, no JSON ({error}): {remedy}") from None
    if schema is None:
        return content
    document = (schema, hashlib.sha256(data).digest())
    if document in _fitting:
        return content
    fault = best_match(_validator(schema).iter_errors(content))
    if fault is not None:
        reason = fault.message if len(fault.message) < 200 else f"{fault.message[:200]}..."
        raise OutputError(f"{path}: {fault.json_path}: {reason}: {remedy}")
    if len(_fitting) == _MAX_FITTING:
        _fitting.clear()
    _fitting.add(document)
    return content


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _finite(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text:.20} is beyond all numbers")
    return number


def find_json(path: Path, schema: str) -> Any:
    """Return the content of a JSON file, or None where there is none that fits the schema."""
    try:
        return read_json(path, schema, "")
    except OutputError:
        return None


def write_json(path: Path, content: Any) -> None:
    """Write `content` to `path` as JSON, whole or not at all. Raises OutputError."""
    write_bytes(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def write_sealed(path: Path, content: Mapping[str, Any]) -> None:
    """Write `content` to `path` as sealed JSON, whole or not at all. Raises OutputError."""
    write_json(path, {**content, _SEAL: _digest_of(content)})


def read_sealed(path: Path, schema: str, remedy: str) -> dict[str, Any]:
    """Return the content of sealed JSON, without its hash. Raises OutputError as `read_json` does,
    and where the hash differs.
    """
    content = dict(read_json(path, schema, remedy))
    if content.pop(_SEAL) != _digest_of(content):
        raise OutputError(f"{path}: damaged: {remedy}")
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


@cache
def _validator(schema: str) -> Draft202012Validator:
    name, _, definition = schema.partition("#")
    content = json.loads(schema_path(name).read_bytes())
    if definition:
        content = {"$defs": content["$defs"], "$ref": f"#/$defs/{definition}"}
    return Draft202012Validator(content)
