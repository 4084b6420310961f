"""Check the documents of a build, each JSON file by its schema, when they are written and read.

`atomic_write` calls `require_readable` before a document takes its place, and `read_json` parses
with the same code. So a command that would write an unreadable document fails in one line, and the
earlier document stays. plan.json has rules beyond its schema, which its writer checks, too.
"""

import hashlib
import json
import re
import tomllib
from functools import cache
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stereocell.model.errors import OutputError
from stereocell.storage.assets import schema_path

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator

# Schemas by the name of a document: a file of schemas/, with `#Name` for one of its definitions.
# A document whose schema is None is only checked to be JSON; its reader has rules of its own.
SCHEMAS: dict[str, str | None] = {
    r"plan\.json": "plan.schema.json",
    r"provenance\.json": "units.schema.json#Provenance",
    r"phases\.json": "units.schema.json#Phases",
    r"exports\.json": "units.schema.json#Exports",
    r"plan\.key": "units.schema.json#PlanKey",
    r"survey\.json": "units.schema.json#Survey",
    r"done\.json": "units.schema.json#Index",
    r"unit\.json": "units.schema.json#Unit",
    r"seconds\.json": "units.schema.json#Seconds",
    r"stage\.json": "units.schema.json#StageTile",
    r"part\.json": "units.schema.json#StageTile",
    r"window-.*\.json": "units.schema.json#Window",
    r"evidence-.*\.json": "units.schema.json#Evidence",
    r"components-.*\.json": "units.schema.json#Components",
    r"extents-.*\.json": "units.schema.json#Extents",
    r"notes-.*\.json": "units.schema.json#Notes",
    r"tissue\.json": "tissue.schema.json",
    r"manifest\.json": "bundle.schema.json",
    r"volumes\.json": "volumes.schema.json",
    r"transfer2d\.json": "transfer2d.schema.json",
    r"objects\.json": "objects.schema.json",
    r"slices\.json": "slices.schema.json",
    r"(files|tile|tileset|finer.*|.*_level|stereocell-published)\.json": None,
}
SETTINGS = "stereocell.toml"
# Finds references to other schemas by their `$id`.
_OTHERS = re.compile(r'"\$ref": "urn:stereocell:schema:(\w+):1#')
NOT_WRITTEN = "not written, because no command could read it"
# Schemas, with hashes of documents that fit them, so that a document is checked only once. A unit's
# record is read with each of its files, and checking it each time took a fifth of a small build.
_fitting: set[tuple[str, bytes]] = set()
_MAX_FITTING = 100_000  # most entries of `_fitting`


def require_readable(path: Path, written: Path) -> None:
    """Raise OutputError if a document could not be read once it lies at its place.

    path     place of the document. Its name tells whether it is a document of a build; other files
             are not checked
    written  file that holds its content
    """
    if path.name == SETTINGS:
        try:
            tomllib.loads(written.read_bytes().decode())
        except ValueError as error:
            raise OutputError(f"{path}: this is not TOML ({error}): {NOT_WRITTEN}") from None
    elif _is_document(path.name):
        parse(path, written.read_bytes(), schema_of(path.name), NOT_WRITTEN)


@cache
def _is_document(name: str) -> bool:
    return any(re.fullmatch(pattern, name) for pattern in SCHEMAS)


def schema_of(name: str) -> str | None:
    """Return the schema of a document by its file's name; None: it has none."""
    return next((schema for one, schema in SCHEMAS.items() if re.fullmatch(one, name)), None)


def parse(path: Path, data: bytes, schema: str | None, remedy: str) -> Any:
    """Return the content of a JSON document.

    path    place of the document, for messages
    schema  schema that it must fit; None: any JSON is accepted
    remedy  what the user should do, for messages

    Raises OutputError, which names file, field and remedy.
    """
    try:
        content = json.loads(data, parse_constant=_refuse, parse_float=_finite)
    except (ValueError, RecursionError) as error:  # RecursionError: deeply nested lists
        raise OutputError(f"{path}: damaged, this is not JSON ({error}): {remedy}") from None
    if schema is None:
        return content
    document = (schema, hashlib.sha256(data).digest())
    if document in _fitting:
        return content
    from jsonschema.exceptions import best_match  # slow to import

    fault = best_match(_validator(schema).iter_errors(content))
    if fault is not None:
        reason = fault.message if len(fault.message) < 200 else f"{fault.message[:200]}..."
        raise OutputError(f"{path}: {fault.json_path}: {reason}: {remedy}")
    if len(_fitting) == _MAX_FITTING:
        _fitting.clear()
    _fitting.add(document)
    return content


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is not a number in JSON")


def _finite(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text:.20} is too large for a number")
    return number


@cache
def _validator(schema: str) -> "Draft202012Validator":
    from jsonschema import Draft202012Validator

    name, _, definition = schema.partition("#")
    text = schema_path(name).read_text("utf-8")
    content = json.loads(text)
    # A reference finds another schema by its `$id`, if that schema is among the definitions.
    others = {other: schema_path(f"{other}.schema.json") for other in _OTHERS.findall(text)}
    own = {other: json.loads(file.read_bytes()) for other, file in others.items()}
    content["$defs"] = {**content.get("$defs", {}), **own}
    if definition:
        content = {"$defs": content["$defs"], "$ref": f"#/$defs/{definition}"}
    return Draft202012Validator(content)
