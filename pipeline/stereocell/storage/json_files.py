"""JSON files of ours: read against their schema, one line for what is wrong; written whole.

A sealed one holds a hash of all else that is in it, as `sha256`: of numbers a schema says little,
and one digit that changed would be built on.
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


def read_json(path: Path, schema: str | None, remedy: str) -> Any:
    """Return the content of a JSON file that fits `schema`.

    schema  a file of schemas/, with `#Name` for one of its definitions; None: any JSON
    remedy  what the user can do about a file that is missing or damaged

    Raises OutputError, which names file, field and remedy.
    """
    fetch(path)
    try:
        content = json.loads(path.read_bytes(), parse_constant=_refuse, parse_float=_finite)
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: {remedy}") from None
    except OSError as error:
        raise OutputError(f"{path}: can't be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:  # of lists in lists in lists
        raise OutputError(f"{path}: damaged, no JSON ({error}): {remedy}") from None
    if schema is None:
        return content
    fault = best_match(_validator(schema).iter_errors(content))
    if fault is not None:
        reason = fault.message if len(fault.message) < 200 else f"{fault.message[:200]}..."
        raise OutputError(f"{path}: {fault.json_path}: {reason}: {remedy}")
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
    """Put `content` at `path` as JSON, whole or not at all. Raises OutputError."""
    write_bytes(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def write_sealed(path: Path, content: Mapping[str, Any]) -> None:
    """Put `content` at `path` as sealed JSON, whole or not at all. Raises OutputError."""
    write_json(path, {**content, _SEAL: _digest_of(content)})


def read_sealed(path: Path, schema: str, remedy: str) -> dict[str, Any]:
    """Return what sealed JSON holds, as `read_json` does. Raises OutputError, for damage too."""
    content = dict(read_json(path, schema, remedy))
    if content.pop(_SEAL) != _digest_of(content):
        raise OutputError(f"{path}: damaged: {remedy}")
    return content


def find_sealed(path: Path, schema: str) -> dict[str, Any] | None:
    """Return what sealed JSON holds, or None where there is none that is as it was written."""
    try:
        return read_sealed(path, schema, "")
    except OutputError:
        return None


def _digest_of(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def compact_json(content: Any) -> bytes:
    """Return JSON for what a phone waits for: half the bytes."""
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False) + "\n").encode()


@cache
def _validator(schema: str) -> Draft202012Validator:
    name, _, definition = schema.partition("#")
    content = json.loads(schema_path(name).read_bytes())
    if definition:
        content = {"$defs": content["$defs"], "$ref": f"#/$defs/{definition}"}
    return Draft202012Validator(content)
